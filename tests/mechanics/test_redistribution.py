"""Redistribution of forces along chains against dense solutions in both of its forms."""

from dataclasses import replace

import numpy as np
import openmm
import pytest

from openmm_cylchain import DSDNA, F_ACTIN, Filament, Filaments
from openmm_cylchain.mechanics import redistribution
from openmm_cylchain.mechanics.tension import segment_end_forces
from support.contexts import new_context, positions_of
from support.dense_mechanics import bent_chain, dense_resistance, virtual_forces
from support.platforms import ENGINES
from support.solvent import TEMPERATURE, VISCOSITY

SLOW_DNA = replace(DSDNA, extension_relaxation_time=1e5)  # ps: one long step stays small.
CHAINS = [(F_ACTIN, 1, 1), (F_ACTIN, 2, 2), (SLOW_DNA, 3, 3), (F_ACTIN, 64, 4)]


@pytest.fixture(scope="module", params=ENGINES)
def mixed_system(request):
    """Bent chains of 1, 2, 3 and 64 segments in one System, with external forces on all nodes."""
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine=request.param)
    for kind, segments, seed in CHAINS:
        filaments.add_nodes(kind, bent_chain(kind, segments, seed))
    _, system, positions = filaments.build()
    external = openmm.CustomExternalForce("-(fx*x+fy*y+fz*z)")
    for name in ("fx", "fy", "fz"):
        external.addPerParticleParameter(name)
    generator = np.random.default_rng(7)
    for particle in range(system.getNumParticles()):
        external.addParticle(particle, 20 * generator.normal(size=3))
    system.addForce(external)
    return filaments, system, positions


def _dense_velocity(nodes, friction, forces):
    return np.linalg.solve(dense_resistance(nodes, friction), forces.reshape(-1)).reshape(-1, 3)


@pytest.mark.parametrize("scheme", ["euler", "midpoint"])
def test_step_without_noise_equals_dense_solutions(mixed_system, scheme):
    filaments, system, positions = mixed_system
    step = 1000.0
    integrator = filaments.create_integrator(system, step, scheme=scheme, temperature=0)
    context = new_context(system, positions, integrator)
    state = context.getState(positions=True, forces=True)
    start, forces = state.getPositions(asNumpy=True)._value, state.getForces(asNumpy=True)._value
    integrator.step(1)
    moved = positions_of(context) - start
    for (kind, _, _), indices in zip(CHAINS, filaments.node_indices):
        nodes, force, friction = start[indices], forces[indices], kind.segment_friction(VISCOSITY, TEMPERATURE)
        if scheme == "midpoint":
            nodes = nodes + 0.5 * step * _dense_velocity(nodes, friction, force)
        expected = step * _dense_velocity(nodes, friction, force)
        assert np.abs(moved[indices] - expected).max() < 1e-10 * np.abs(expected).max()


def test_both_forms_agree_and_give_the_joint_tensions(mixed_system):
    filaments, system, positions = mixed_system
    integrator = filaments.create_integrator(system, 1.0, temperature=0)
    context = new_context(system, positions, integrator)
    state = context.getState(positions=True, forces=True)
    start, forces = state.getPositions(asNumpy=True)._value, state.getForces(asNumpy=True)._value
    velocities = redistribution.redistribute(filaments.chain_set(system), start, forces)
    tensions = filaments.in_context(context).joint_tensions()
    for (kind, _, _), indices, tension in zip(CHAINS, filaments.node_indices, tensions):
        nodes, friction = start[indices], kind.segment_friction(VISCOSITY, TEMPERATURE)
        nodal = _dense_velocity(nodes, friction, forces[indices])

        # Stretching and bending belong to segments; the rest of a node's force goes to its segments in equal parts.
        minus, plus = segment_end_forces(Filament(kind, nodes, ()), nodes)
        external = forces[indices].copy()
        external[:-1] -= minus
        external[1:] -= plus
        external[1:-1] /= 2
        virtual, phi = virtual_forces(nodes, friction, minus + external[:-1], plus + external[1:])
        assert np.abs(virtual - nodal).max() < 1e-10 * np.abs(nodal).max()
        assert np.abs(velocities[indices] - nodal).max() < 1e-10 * np.abs(nodal).max()
        assert tension.shape == phi.shape
        if len(phi):
            assert np.abs(tension._value - phi).max() < 1e-10 * np.abs(phi).max()


def _chain_set(segment_counts, fixed=()):
    frictions = F_ACTIN.segment_friction(VISCOSITY, TEMPERATURE)
    total = sum(segment_counts)
    nodes = total + len(segment_counts)
    mask = np.zeros(nodes, dtype=bool)
    mask[list(fixed)] = True
    return redistribution.ChainSet(
        node_counts=np.array(segment_counts) + 1,
        fixed=mask,
        **{
            name: np.full(total, getattr(frictions, name))
            for name in ("parallel", "perpendicular", "rotational", "extensional")
        },
    )


@pytest.mark.parametrize("fixed", [(0,), (0, 1), (3,), (0, 5)])
def test_fixed_nodes_equal_dense_solution_of_the_free_ones(fixed):
    chains = _chain_set([5], fixed)
    nodes = bent_chain(F_ACTIN, 5, 11)
    forces = np.random.default_rng(12).normal(size=nodes.shape)
    resistance = dense_resistance(nodes, F_ACTIN.segment_friction(VISCOSITY, TEMPERATURE))
    free = np.repeat(~chains.fixed, 3)
    expected = np.zeros(18)
    expected[free] = np.linalg.solve(resistance[np.ix_(free, free)], forces.reshape(-1)[free])
    velocity = redistribution.redistribute(chains, nodes, forces)
    assert np.abs(velocity.reshape(-1) - expected).max() < 1e-10 * np.abs(expected).max()
    assert np.all(velocity[list(fixed)] == 0.0)


@pytest.mark.slow
def test_midpoint_drift_is_the_divergence_of_the_mobility():
    """Mean displacement without forces against k_B T div(Z^-1) by finite differences of a dense inverse."""
    chains = _chain_set([2])
    nodes = bent_chain(F_ACTIN, 2, 13)
    friction = F_ACTIN.segment_friction(VISCOSITY, TEMPERATURE)
    kT, width = 2.5, 1e-3

    def mobility(flat):
        return np.linalg.inv(dense_resistance(flat.reshape(-1, 3), friction))

    flat = nodes.reshape(-1)
    drift = np.zeros(9)
    for column in range(9):
        shift = np.zeros(9)
        shift[column] = width
        drift += kT * (mobility(flat + shift)[:, column] - mobility(flat - shift)[:, column]) / (2 * width)

    # Antithetic noise removes the odd part of the displacement; the even part that remains is the drift.
    step, pairs = 100.0, 20000
    generator = np.random.default_rng(14)
    samples = np.empty((pairs, 9))
    for pair in range(pairs):
        translational, rotational = generator.normal(size=(2, 2, 3))
        forward = redistribution.midpoint_step(chains, nodes, np.zeros((3, 3)), kT, step, translational, rotational)
        backward = redistribution.midpoint_step(chains, nodes, np.zeros((3, 3)), kT, step, -translational, -rotational)
        samples[pair] = (forward + backward).reshape(-1) / (2 * step)
    error = samples.std(axis=0, ddof=1) / np.sqrt(pairs)
    assert np.all(np.abs(samples.mean(axis=0) - drift) < 4 * error)
    assert np.linalg.norm(drift) > 40 * np.linalg.norm(error)
