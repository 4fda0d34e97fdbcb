"""The engines against each other: without noise their trajectories are the same to rounding."""

from dataclasses import replace

import numpy as np
import openmm
import pytest
from openmm import app, unit

from openmm_cylchain import DSDNA, F_ACTIN, Filaments, stokes_friction
from support.bending_models import BENDING_MODELS
from support.contexts import energy_of, new_context, positions_of
from support.dense_mechanics import bent_chain
from support.equilibrium_cases import CASES
from support.platforms import ENGINE_PLATFORMS
from support.solvent import TEMPERATURE, VISCOSITY

SLOW_DNA = replace(DSDNA, extension_relaxation_time=1e5)
KINDS = [
    (F_ACTIN, 64, ()),
    (F_ACTIN, 1, ()),
    (F_ACTIN, 2, (0,)),
    (SLOW_DNA, 7, (3,)),
    (SLOW_DNA, 8, (-1,)),
    *((CASES[model].type, 5, clamped) for model in BENDING_MODELS for clamped in ((), (0, 1))),
    (CASES["fene"].type, 6, ()),
    (CASES["freely-jointed"].type, 9, ()),
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
        filaments.add_nodes(kind, bent_chain(kind, segments, seed), clamped)
    positions = filaments.add_to(topology, system, positions * unit.nanometer)
    external = openmm.CustomExternalForce("-(fx*x+fy*y+fz*z)")
    for name in ("fx", "fy", "fz"):
        external.addPerParticleParameter(name)
    generator = np.random.default_rng(7)
    for particle in range(system.getNumParticles()):
        external.addParticle(particle, generator.normal(size=3))
    system.addForce(external)
    bond = openmm.HarmonicBondForce()
    bond.addBond(2, int(filaments.node_indices[0][20]), 100.0, 0.01)
    system.addForce(bond)
    friction = stokes_friction(50, VISCOSITY)
    integrator = filaments.create_integrator(
        system, 200.0, scheme=scheme, temperature=0, particle_friction=friction, random_seed=1
    )
    context = new_context(system, positions, integrator, platform)
    tensions = np.concatenate([tension._value for tension in filaments.joint_tensions(context)])
    energy = energy_of(context)
    integrator.step(steps)
    return positions_of(context) - positions._value, tensions, energy


@pytest.fixture(scope="module", params=["euler", "midpoint"])
def portable(request):
    """The portable engine's trajectory on the Reference platform."""
    return request.param, _trajectory("portable", "Reference", request.param)


@pytest.mark.parametrize("platform", [platform for engine, platform in ENGINE_PLATFORMS if engine == "compiled"])
def test_trajectories_without_noise_agree(portable, platform):
    scheme, (moved, tensions, energy) = portable
    other_moved, other_tensions, other_energy = _trajectory("compiled", platform, scheme)
    assert np.abs(moved).max() > 1.0
    assert np.abs(other_moved - moved).max() < 1e-9 * np.abs(moved).max()
    assert np.abs(other_tensions - tensions).max() < 1e-9 * np.abs(tensions).max()
    assert other_energy == pytest.approx(energy, rel=1e-9)
