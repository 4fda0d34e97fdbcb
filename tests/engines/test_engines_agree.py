"""The engines against each other: without noise their trajectories are the same to rounding."""

from dataclasses import replace

import numpy as np
import openmm
import pytest
from openmm import app, unit

from openmm_cylchain import DSDNA, DSDNA_BASE_PAIRS, F_ACTIN, Filaments, Flow, stokes_friction
from support.bending_models import BENDING_MODELS
from support.contexts import energy_of, forces_of, new_context, positions_of
from support.dense_mechanics import bent_chain
from support.equilibrium_cases import CASES
from support.platforms import CPU_CASES, ON_COMPILED_PLATFORMS
from support.solvent import TEMPERATURE, VISCOSITY

SLOW_DNA = replace(DSDNA, extension_relaxation_time=1e5)
SLOW_BEADS = replace(DSDNA_BASE_PAIRS, bead_friction=1e5 * DSDNA_BASE_PAIRS.bead_friction)
KINDS = [
    (F_ACTIN, 64, ()),
    (F_ACTIN, 1, ()),
    (F_ACTIN, 2, (0,)),
    (SLOW_DNA, 7, (3,)),
    (SLOW_DNA, 8, (-1,)),
    *((CASES[model].type, 5, clamped) for model in BENDING_MODELS for clamped in ((), (0, 1))),
    (CASES["fene"].type, 6, ()),
    (CASES["freely-jointed"].type, 9, ()),
    (SLOW_BEADS, 12, ()),
    (SLOW_BEADS, 1, ()),
    (SLOW_BEADS, 5, (0, 1)),
]


def _trajectory(engine, platform, scheme, steps=100):
    topology, system = app.Topology(), openmm.System()
    chain = topology.addChain()
    for mass in (1e5, 0.0, 1e5):
        topology.addAtom("B", None, topology.addResidue("BEA", chain))
        system.addParticle(mass)
    positions = np.array([[0.0, 500.0, 0.0], [50.0, 500.0, 0.0], [100.0, 500.0, 0.0]])
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine=engine)
    for seed, (kind, segments, clamped) in enumerate(KINDS):
        filaments.add_nodes(kind, bent_chain(kind, segments, seed), clamped=clamped)
    positions = filaments.add_to(topology, system, positions * unit.nanometer)
    external = openmm.CustomExternalForce("-(fx*x+fy*y+fz*z)")
    for name in ("fx", "fy", "fz"):
        external.addPerParticleParameter(name)
    generator = np.random.default_rng(7)
    # OpenMM keeps parameters of these forces in single precision on GPUs.
    for particle in range(system.getNumParticles()):
        external.addParticle(particle, generator.normal(size=3).astype(np.float32).astype(float))
    system.addForce(external)
    bond = openmm.HarmonicBondForce()
    bond.addBond(2, int(filaments.node_indices[0][20]), 100.0, 2.0**-7)
    system.addForce(bond)
    friction = stokes_friction(50, VISCOSITY)
    integrator = filaments.create_integrator(
        system, 200.0, scheme=scheme, temperature=0, particle_friction=friction, random_seed=1
    )
    context = new_context(system, positions, integrator, platform)
    tensions = np.concatenate([tension._value for tension in filaments.in_context(context).joint_tensions()])
    energy = energy_of(context)
    integrator.step(steps)
    return positions_of(context) - positions._value, tensions, energy


@pytest.fixture(scope="module", params=["euler", "midpoint"])
def portable(request):
    """The portable engine's trajectory on the Reference platform."""
    return request.param, _trajectory("portable", "Reference", request.param)


@ON_COMPILED_PLATFORMS
def test_trajectories_without_noise_agree(portable, platform):
    scheme, (moved, tensions, energy) = portable
    other_moved, other_tensions, other_energy = _trajectory("compiled", platform, scheme)
    assert np.abs(moved).max() > 1.0
    assert np.abs(other_moved - moved).max() < 1e-9 * np.abs(moved).max() + platform.path_tolerance
    assert np.abs(other_tensions - tensions).max() < platform.tolerance * np.abs(tensions).max()
    assert other_energy == pytest.approx(energy, rel=platform.tolerance)


FLOW = Flow(gradient=1e-6 * np.array([[1.0, 3.0, 0.0], [2.0, -4.0, 1.0], [0.5, -1.0, 3.0]]), origin=[0.0, 3.0, 1.0])


def _chains_of_beads(engine, platform, scheme):
    """Open, held, planar, tethered and propelled chains of beads, rings and cylinders in a flow, and their motion."""
    filaments, generator = Filaments(VISCOSITY, TEMPERATURE, engine=engine), np.random.default_rng(2)
    ring = 0.3 * generator.normal(size=(7, 3))
    flat = bent_chain(SLOW_BEADS, 6, 4) * [1.0, 1.0, 0.0]
    filaments.add_nodes(SLOW_BEADS, bent_chain(SLOW_BEADS, 9, 1), propulsion=30.0)
    filaments.add_nodes(SLOW_BEADS, ring, closed=True, propulsion=-20.0)
    filaments.add_nodes(SLOW_BEADS, ring + 3.0, clamped=[2], closed=True)
    filaments.add_nodes(SLOW_BEADS, flat, clamped=[-1], planar=True)
    filaments.add_nodes(DSDNA, bent_chain(DSDNA, 3, 5))
    filaments.add_tether(0, 4, [1.0, 2.0, 3.0], 5.0)
    filaments.add_tether(3, 2, [1.0, 2.0, 3.0], 500.0)
    _, system, positions = filaments.build()
    integrator = filaments.create_integrator(system, 100.0, scheme=scheme, temperature=0, flow=FLOW, checks=False)
    context = new_context(system, positions, integrator, platform)
    tensions = np.concatenate([tension._value for tension in filaments.in_context(context).joint_tensions()])
    energy, forces, start = energy_of(context), forces_of(context), positions_of(context)
    integrator.step(1)
    velocities = (positions_of(context) - start) / 100.0
    integrator.step(50)
    return filaments, start, forces, velocities, (positions_of(context) - start, tensions, energy, velocities)


@pytest.mark.parametrize("scheme", ["euler", "midpoint"])
def test_chains_of_beads_move_alike(scheme):
    filaments, start, forces, velocities, expected = _chains_of_beads("portable", "Reference", scheme)
    # A bead moves as it is pulled, wherever others are; in a flow, scheme "midpoint" does so half-way.
    free = np.ones(len(start), dtype=bool)
    free[filaments.node_indices[4]] = free[filaments.node_indices[2][2]] = free[filaments.node_indices[3][-1]] = False

    def drift(positions):
        result = (positions - FLOW.origin) @ np.array(FLOW.gradient).T + forces / SLOW_BEADS.bead_friction
        result[filaments.node_indices[3], 2] = 0.0
        return result

    halfway = start + 50.0 * drift(start) if scheme == "midpoint" else start
    assert velocities[free] == pytest.approx(drift(halfway)[free], rel=1e-9)
    assert not np.any(velocities[filaments.node_indices[2][2]])
    for platform in CPU_CASES:
        found = _chains_of_beads("compiled", platform, scheme)[-1]
        for one, other in zip(expected, found):
            assert np.abs(one - other).max() < 1e-9 * np.abs(one).max()
