"""Steps that take contacts for hard ones: which those are, and that a word is said."""

import warnings

import numpy as np
import pytest
from openmm import unit

from openmm_cylchain import (
    ACTIN_ATP,
    F_ACTIN,
    ContactWarning,
    Filaments,
    Growth,
    capsule_contact_force,
)
from openmm_cylchain.time_steps.hard_contacts import LARGEST_SOFTNESS, longest_resolving_step
from support.solvent import TEMPERATURE, VISCOSITY

ACTIN = F_ACTIN.with_segment_length(100)
STIFFNESS = 0.2


def _system(segments, particles=0, **options):
    filaments = Filaments(VISCOSITY, TEMPERATURE, "compiled")
    filaments.add_straight(ACTIN, segments, [0, 0, 0], [1, 0, 0], **options)
    _, system, _ = filaments.build()
    spheres = [system.addParticle(1.0) for _ in range(particles)]
    diameter = {"particle_diameter": 40.0} if spheres else {}
    force = capsule_contact_force(filaments, system, 30.0, STIFFNESS, spheres, **diameter)
    system.addForce(force)
    return filaments, system, force


def test_a_rod_moves_at_its_end():
    """A unit force on it turns it as well."""
    filaments, system, force = _system(1)
    friction = ACTIN.segment_friction(VISCOSITY, TEMPERATURE, 1)
    end = 1 / friction.perpendicular + 0.25 * 100**2 / friction.rotational
    expected = LARGEST_SOFTNESS / (2 * STIFFNESS * end)
    assert longest_resolving_step(filaments, system, force, None) == pytest.approx(expected, rel=1e-3)


def test_a_long_filament_moves_as_the_end_of_a_beam():
    filaments, system, force = _system(400)
    friction = ACTIN.segment_friction(VISCOSITY, TEMPERATURE, 400).perpendicular / 100
    step = longest_resolving_step(filaments, system, force, None)
    response = np.sqrt(2) * step / (friction * (ACTIN.bending_rigidity * step / friction) ** 0.25)
    assert 2 * STIFFNESS * response == pytest.approx(LARGEST_SOFTNESS, rel=0.01)


def test_a_sphere_may_move_most():
    filaments, system, force = _system(400, particles=1)
    slow, fast = (longest_resolving_step(filaments, system, force, friction) for friction in (1e9, 10.0))
    assert fast == pytest.approx(LARGEST_SOFTNESS * 10.0 / (2 * STIFFNESS))
    assert slow > fast
    quantity = 10.0 * unit.kilojoule_per_mole * unit.picosecond / unit.nanometer**2
    assert longest_resolving_step(filaments, system, force, quantity) == fast


def test_a_ring_has_no_end():
    filaments = Filaments(VISCOSITY, TEMPERATURE, "compiled")
    filaments.add_ring(ACTIN, 400, [0, 0, 0])
    _, system, _ = filaments.build()
    force = capsule_contact_force(filaments, system, 30.0, STIFFNESS)
    system.addForce(force)
    open_ones, open_system, open_force = _system(400)
    step = longest_resolving_step(filaments, system, force, None)
    of_open_one = longest_resolving_step(open_ones, open_system, open_force, None)
    assert step == pytest.approx(4 ** (4 / 3) * of_open_one, rel=0.02)


@pytest.mark.parametrize(("monomers", "segments"), [(20, 1), (130, 3)])
def test_filaments_that_grow_count_as_they_are_when_they_are_shortest(monomers, segments):
    """The softest filament decides for the contacts of all."""
    kind, length = F_ACTIN.with_segment_length(108), monomers * ACTIN_ATP.length
    growth = Growth(monomers=ACTIN_ATP, pool=unit.Quantity(1e-6, unit.molar), shortest=length, longest=5000)
    steps = []
    for one, count, options in (
        (kind, 20, {"growth": growth}),
        (kind.with_segment_length(length / segments), segments, {}),
    ):
        filaments = Filaments(VISCOSITY, TEMPERATURE, "compiled")
        filaments.add_straight(one, count, [0, 0, 0], [1, 0, 0], **options)
        _, system, _ = filaments.build()
        force = capsule_contact_force(filaments, system, 30.0, STIFFNESS)
        system.addForce(force)
        steps.append(longest_resolving_step(filaments, system, force, None))
    assert steps[0] == pytest.approx(steps[1], rel=1e-6)


@pytest.mark.parametrize(
    ("times", "told"),
    [(1.01, "takes contacts, and walls beside them, for hard ones"), (0.99, "up to a sixth too much"), (0.24, None)],
)
def test_longer_steps_are_warned_of(times, told):
    filaments, system, force = _system(10)
    step = times * longest_resolving_step(filaments, system, force, None)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        filaments.create_integrator(system, step, scheme="implicit")
    found = [one for one in caught if issubclass(one.category, ContactWarning)]
    assert len(found) == (told is not None)
    if told:
        assert "CylinderChainContactForce (force 1)" in str(found[0].message)
        assert told in str(found[0].message)
