"""Contexts that are told how far their filaments have grown."""

import numpy as np
import openmm
import pytest
from openmm import unit

from openmm_cylchain import (
    ACTIN_ATP,
    F_ACTIN,
    Filaments,
    Growth,
    InputError,
    MonomerPool,
    Sphere,
    capsule_contact_force,
    filament_wall_force,
)
from support.contexts import energy_of, positions_of
from support.solvent import TEMPERATURE, VISCOSITY

KIND = F_ACTIN.with_segment_length(54.0)  # of 20 monomers
STEP = 2e8
POOL = unit.Quantity(50e-6, unit.molar)


def built(count, pool=POOL):
    """Filaments side by side in a sphere, all but the last of which grow."""
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine="compiled")
    for number in range(count + 1):
        growth = Growth(monomers=ACTIN_ATP, pool=pool, longest=600.0) if number < count else None
        filaments.add_straight(KIND, 4, [0, 9 * number, 0], [1, 0, 0], growth=growth)
    _, system, positions = filaments.build()
    system.addForce(capsule_contact_force(filaments, system, 8.0))
    system.addForce(filament_wall_force(filaments, system, Sphere([108, 9, 0], 200.0), 10.0))
    return filaments, system, positions


def in_context(filaments, system, positions):
    integrator = filaments.create_integrator(system, STEP, random_seed=4, checks=False)
    context = openmm.Context(system, integrator, openmm.Platform.getPlatformByName("CPU"), {"Threads": "1"})
    context.setPositions(positions)
    return context


@pytest.mark.parametrize("volume", [None, 1e7])
def test_a_context_is_told_how_far_filaments_have_grown(volume):
    """With positions and numbers of monomers of another Context, it has its energy, its nodes and its pools."""
    filaments, system, positions = built(2, MonomerPool(POOL, volume))
    other = in_context(filaments, system, positions)
    other.getIntegrator().step(400)
    there = filaments.in_context(other).growth()
    context = in_context(filaments, system, positions)
    inside = filaments.in_context(context)
    moved = positions_of(other)
    for own, count in zip((filaments.node_indices[number] for number in there.filaments), there.nodes):
        moved[own[count:]] = 7.0
    context.getIntegrator().step(20)
    before = inside.growth()
    # A State that does not say how far filaments have grown.
    context.setState(other.getState(positions=True, parameters=True))
    context.setPositions(moved)
    inside.set_growth(there.monomers)
    found = inside.growth()
    np.testing.assert_array_equal(found.monomers, there.monomers)
    np.testing.assert_array_equal(found.nodes, there.nodes)
    np.testing.assert_array_equal(found.gained, before.gained)
    np.testing.assert_allclose(found.concentrations._value, there.concentrations._value, rtol=1e-9)
    assert np.all(there.nodes > 5)
    assert energy_of(context) == pytest.approx(energy_of(other), rel=1e-6)
    np.testing.assert_array_equal(positions_of(context), positions_of(other))
    context.getIntegrator().step(5)
    inside.set_growth([tuple(own) for own in before.monomers.tolist()])
    np.testing.assert_array_equal(inside.growth().monomers, before.monomers)


@pytest.mark.parametrize(
    ("monomers", "message"),
    [
        ([[0, 100]], r"shape \(2, 2\), for each filament that grows the number of its first"),
        ([[0.0, 100.0], [0.0, 100.0]], r"whole numbers of the shape \(2, 2\)"),
        ("many", "whole numbers"),
        ([[0, 80], [7, 16]], r"Filament 1 \(ACT\) cannot have the monomers from 7 to before 16: it has 10 monomers"),
        ([[90, 80], [0, 80]], "Filament 0 .* at least"),
        ([[10**9, 10**9 + 80], [0, 80]], "numbers below 1e"),
        ([[0, 80], [0, 800]], "they need 41 nodes, but it has 13. Give its growth a larger longest"),
        ([[0, 80], [0, 230]], "Pool 0 has not so many monomers"),
    ],
)
def test_growth_that_cannot_be_is_refused(monomers, message):
    filaments, system, positions = built(2, MonomerPool(1e-4, 1e6))
    context = in_context(filaments, system, positions)
    with pytest.raises(InputError, match=message):
        filaments.in_context(context).set_growth(monomers)
    assert filaments.in_context(context).growth().monomers.tolist() == [[0, 80], [0, 80]]
    still, system, positions = built(0)
    with pytest.raises(InputError, match="No filaments grow"):
        still.in_context(in_context(still, system, positions)).set_growth([])
