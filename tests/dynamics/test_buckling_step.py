"""The recommended step resolves how fast filaments buckle under forces that are known before a run."""

import math
import warnings

import numpy as np
import openmm
import pytest
from scipy.linalg import eigh

from openmm_cylchain import (
    F_ACTIN,
    Filaments,
    TimeStepWarning,
    constant_force,
    constant_tension,
)
from openmm_cylchain.time_steps.schemes import IMPLICIT_SCHEMES
from support.contexts import new_context, positions_of
from support.dense_mechanics import straight_matrices
from support.linked_pairs import PICONEWTON_PER_NANOMETER
from support.solvent import TEMPERATURE, VISCOSITY

SEGMENTS = 60
KIND = F_ACTIN.with_segment_length(150.0)
TRAP = 0.1 * PICONEWTON_PER_NANOMETER
# Noise must be nothing beside a shape of a hundredth of a nanometre.
COLD = 1e-12


def euler_load(kind=KIND, segments=SEGMENTS):
    return math.pi**2 * kind.bending_rigidity / (segments * kind.segment_length) ** 2


def rate_of_waves(kind, segments, compression):
    """P^2/(4 EI zeta), in 1/ps."""
    per_length = kind.segment_friction(VISCOSITY, TEMPERATURE, segments).perpendicular / kind.segment_length
    return compression**2 / (4.0 * kind.bending_rigidity * per_length)


def pressed(compression, ends, kind=KIND, segments=SEGMENTS, shape=None):
    """A filament along x under a compressive force: a System with it, and its initial positions."""
    filaments = Filaments(VISCOSITY, TEMPERATURE)
    points = np.zeros((segments + 1, 3))
    points[:, 0] = np.arange(segments + 1) * kind.segment_length
    if shape is not None:
        points[:, 1] = shape
    filaments.add_nodes(kind, points, clamped=[0] if ends == "held" else ())
    if ends == "held":
        # As much as the filament gets shorter, too.
        along = compression * (1.0 / TRAP + segments / kind.segment_stiffness)
        filaments.add_tether(0, -1, points[-1] - [along, 0, 0], TRAP)
    _, system, positions = filaments.build()
    if ends == "free":
        system.addForce(constant_tension(filaments, -compression, [1, 0, 0]))
    return filaments, system, positions


def fastest_mode(compression, ends):
    """The largest growth rate of the linear equations of the chain, in 1/ps, and its mode of 0.01 nm."""
    resistance, stiffness, _ = straight_matrices(KIND, SEGMENTS, 1.0)
    lengths = np.diff(np.eye(SEGMENTS + 1), axis=0)
    stiffness = stiffness - compression / KIND.segment_length * lengths.T @ lengths
    free = np.arange(SEGMENTS + 1) > 0 if ends == "held" else np.full(SEGMENTS + 1, True)
    stiffness[-1, -1] += TRAP if ends == "held" else 0.0
    rates, modes = eigh(-stiffness[np.ix_(free, free)], resistance[np.ix_(free, free)])
    mode = np.zeros(SEGMENTS + 1)
    mode[free] = modes[:, -1]
    return rates[-1], 0.01 * mode / np.abs(mode).max()


def growth_rate(compression, ends, step, scheme, steps):
    """In 1/ps, of the fastest mode."""
    _, mode = fastest_mode(compression, ends)
    filaments, system, positions = pressed(compression, ends, shape=mode)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        integrator = filaments.create_integrator(system, step, scheme, temperature=COLD, random_seed=1)
    context = new_context(system, positions, integrator)
    heights = []
    for _ in range(2):
        integrator.step(steps)
        heights.append(mode @ positions_of(context)[:, 1])
    return math.log(heights[1] / heights[0]) / (steps * step)


@pytest.mark.parametrize("scheme", IMPLICIT_SCHEMES)
@pytest.mark.parametrize("ends, factor", [("free", 4.0), ("held", 1.0)])
@pytest.mark.parametrize("loads", [30.0, 100.0])
def test_filaments_buckle_as_fast_as_they_should(loads, ends, factor, scheme):
    compression = loads * euler_load()
    filaments, system, _ = pressed(compression, ends)
    theory = factor * rate_of_waves(KIND, SEGMENTS, compression)
    share = {"implicit": 0.09, "implicit-second-order": 0.15}[scheme]
    recommended = filaments.recommended_time_step(scheme, system=system)
    (name,) = [name for name in recommended.bounds if name.startswith("buckling of")]
    assert recommended.allowed[name] == pytest.approx(share / theory, rel=1e-3)
    # Ends and segments leave the theory of an endless beam within a few per cent.
    exact, _ = fastest_mode(compression, ends)
    assert exact == pytest.approx(theory, rel=0.03)
    measured = growth_rate(compression, ends, recommended.allowed[name], scheme, steps=10)
    assert measured == pytest.approx(exact, rel=0.05)


@pytest.mark.parametrize("loads", [3.0, -100.0])
def test_weak_compression_and_tension_do_not_bind(loads):
    filaments, system, _ = pressed(loads * euler_load(), "free")
    alone = filaments.recommended_time_step("implicit")
    assert filaments.recommended_time_step("implicit", system=system).step == alone.step
    assert "buckling" not in alone.reason


def test_what_pulls_all_of_a_filament_along_itself_does_not_compress_it():
    # Friction takes it up everywhere.
    filaments, system, _ = pressed(0.0, "free")
    weights = np.ones(SEGMENTS + 1)
    weights[[0, -1]] = 0.5
    nodes = filaments.node_indices[0]
    system.addForce(constant_force(nodes, np.outer(weights, [100.0 * euler_load(), 0.0, 0.0])))
    assert not any(name.startswith("buckling") for name in filaments.recommended_time_step(system=system).bounds)


def test_forces_of_ones_own_that_are_constant_count():
    compression = 100.0 * euler_load()
    filaments, system, _ = pressed(compression, "free")
    known = filaments.recommended_time_step("implicit", system=system)
    own, other, _ = pressed(0.0, "free")
    force = openmm.CustomExternalForce("f*x+1.0")
    force.addPerParticleParameter("f")
    for node, sign in ((0, -1.0), (-1, 1.0)):
        force.addParticle(int(own.node_indices[0][node]), [sign * compression])
    other.addForce(force)
    assert own.recommended_time_step("implicit", system=other).step == pytest.approx(known.step, rel=1e-6)


def test_propulsion_compresses_what_is_held_in_front():
    # The force of all segments adds up towards the node that is held; one that is held behind is stretched.
    load = 400.0 * euler_load()
    bounds = []
    for held in (-1, 0):
        filaments = Filaments(VISCOSITY, TEMPERATURE)
        filaments.add_straight(KIND, SEGMENTS, [0, 0, 0], [1, 0, 0], clamped=[held], propulsion=load / SEGMENTS)
        bounds.append(filaments.recommended_time_step("implicit").allowed)
    (step,) = [step for name, step in bounds[0].items() if name.startswith("buckling")]
    # Less what pushes on the last node itself.
    assert step * rate_of_waves(KIND, SEGMENTS, load) == pytest.approx(0.09, rel=2.0 / SEGMENTS)
    assert not any(name.startswith("buckling") for name in bounds[1])


def test_a_step_that_does_not_resolve_buckling_is_warned_of():
    filaments, system, _ = pressed(100.0 * euler_load(), "free")
    step = filaments.recommended_time_step("implicit", system=system).step
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        filaments.create_integrator(system, 3.9 * step, "implicit")
    with pytest.warns(TimeStepWarning, match="does not resolve how a filament buckles"):
        filaments.create_integrator(system, 4.1 * step, "implicit")
