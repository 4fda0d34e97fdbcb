"""Filaments that cross a periodic box, with a cutoff force, for longer than GPU platforms wait to reorder.

Noise depends on the seed and the step alone, so platforms can be compared trajectory by trajectory.
"""

import numpy as np
import openmm
import pytest
from openmm import app, unit

from openmm_cylchain import F_ACTIN, Filaments, stokes_friction
from openmm_cylchain.engines.gpu_platforms import GPU_PLATFORMS
from support.contexts import new_context
from support.platforms import PLATFORMS
from support.solvent import VISCOSITY

BOX = 1500.0
STEPS = 600


def _crowded_box():
    """Six equal filaments of 2.9 um among 60 repulsive beads in a periodic box of 1.5 um, dragged across it."""
    topology, system = app.Topology(), openmm.System()
    generator = np.random.default_rng(3)
    chain = topology.addChain()
    beads = 60
    for _ in range(beads):
        topology.addAtom("B", None, topology.addResidue("BEA", chain))
        system.addParticle(1e5)
    grid = np.stack(np.meshgrid(*[np.arange(4)] * 3, indexing="ij"), axis=-1).reshape(-1, 3)[:beads]
    positions = grid * BOX / 4 + generator.uniform(-50, 50, size=(beads, 3))
    filaments = Filaments(VISCOSITY, 310, "portable")
    for number in range(6):
        filaments.add_equilibrium(F_ACTIN, 8, seed=number, start=generator.uniform(0, BOX, 3))
    system.setDefaultPeriodicBoxVectors(*(BOX * np.eye(3)))
    topology.setPeriodicBoxVectors(BOX * np.eye(3) * unit.nanometer)
    positions = filaments.add_to(topology, system, positions * unit.nanometer)
    repulsion = openmm.CustomNonbondedForce("20*(1-r/150)^2")
    repulsion.setNonbondedMethod(openmm.CustomNonbondedForce.CutoffPeriodic)
    repulsion.setCutoffDistance(150.0)
    for _ in range(system.getNumParticles()):
        repulsion.addParticle([])
    for first, second in topology.bonds():
        repulsion.addExclusion(first.index, second.index)
    system.addForce(repulsion)
    drift = openmm.CustomExternalForce("-600*(x+0.7*y-0.5*z)")
    for particle in range(system.getNumParticles()):
        drift.addParticle(particle, [])
    system.addForce(drift)
    return filaments, system, positions


def _run(platform, precision, scheme, steps=STEPS):
    filaments, system, positions = _crowded_box()
    integrator = filaments.create_integrator(
        system, 5e3, scheme=scheme, particle_friction=stokes_friction(60, VISCOSITY), random_seed=4
    )
    properties = {"Precision": precision} if precision else {}
    context = new_context(system, positions, integrator, platform, properties)
    integrator.step(steps)
    return filaments, positions._value, context.getState(positions=True, energy=True)


@pytest.fixture(scope="module", params=["euler", "midpoint"])
def reference_run(request):
    """The trajectory's end on the Reference platform, which never wraps or reorders."""
    _, start, state = _run("Reference", None, request.param)
    return request.param, start, state


TOLERANCES = {None: 1e-5, "double": 2e-5, "mixed": 1e-3, "single": 0.02}  # nm, of coordinates of some thousand nm
CHOICES = [(name, None) for name in PLATFORMS if name == "CPU"]
CHOICES += [
    (name, precision) for name in GPU_PLATFORMS if name in PLATFORMS for precision in ("single", "mixed", "double")
]


@pytest.mark.sample(r"^(?!euler-(CPU|\w+-mixed)|midpoint-\w+-(single|double))")
@pytest.mark.parametrize(("platform", "precision"), CHOICES)
def test_platforms_follow_the_reference_trajectory(reference_run, platform, precision):
    scheme, start, expected = reference_run
    _, _, state = _run(platform, precision, scheme)
    end, wanted = (one.getPositions(asNumpy=True)._value for one in (state, expected))
    moved = np.linalg.norm(wanted - start, axis=1)
    assert moved.min() > BOX
    # Rounding shifts the paths by a little; a wrapped or swapped vector would shift them by the size of the box.
    assert np.abs(end - wanted).max() < TOLERANCES[precision]


def test_filaments_cross_the_box_and_stay_whole(reference_run):
    _, _, state = reference_run
    filaments, _, _ = _crowded_box()
    positions = state.getPositions(asNumpy=True)._value
    for nodes in filaments.node_indices:
        assert np.ptp(positions[nodes], axis=0).max() > BOX
        lengths = np.linalg.norm(np.diff(positions[nodes], axis=0), axis=1)
        assert np.abs(lengths - F_ACTIN.segment_length).max() < 0.1 * F_ACTIN.segment_length
