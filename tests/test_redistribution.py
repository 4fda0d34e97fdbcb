"""Redistribution of forces along chains against dense solutions in both of its forms."""

from dataclasses import replace

import numpy as np
import openmm
import pytest
from conftest import ENGINES
from physics_cases import TEMPERATURE, VISCOSITY

from openmm_cylchain import DSDNA, F_ACTIN, Filament, Filaments
from openmm_cylchain.mechanics import redistribution
from openmm_cylchain.mechanics.tension import segment_end_forces


def _project(tangent, along, across):
    parallel = np.outer(tangent, tangent)
    return along * parallel + across * (np.eye(3) - parallel)


def _bent_chain(kind, segments, seed):
    generator = np.random.default_rng(seed)
    tangents = np.array([1.0, 0.0, 0.0]) + 0.4 * generator.normal(size=(segments, 3))
    tangents /= np.linalg.norm(tangents, axis=1)[:, None]
    lengths = kind.segment_length * (1.0 + 0.05 * generator.normal(size=(segments, 1)))
    return np.concatenate([np.zeros((1, 3)), np.cumsum(lengths * tangents, axis=0)]) + generator.normal(size=3) * 50


def _dense_resistance(nodes, friction, closed=False):
    """Z assembled segment by segment from the four friction coefficients."""
    count = len(nodes)
    resistance = np.zeros((3 * count, 3 * count))
    for segment in range(count if closed else count - 1):
        following = (segment + 1) % count
        difference = nodes[following] - nodes[segment]
        length = np.linalg.norm(difference)
        tangent = difference / length
        trans = _project(tangent, friction.parallel, friction.perpendicular)
        dr = _project(tangent, friction.extensional, friction.rotational) / length**2
        same, other = trans / 4 + dr, trans / 4 - dr
        block = np.concatenate([3 * segment + np.arange(3), 3 * following + np.arange(3)])
        resistance[np.ix_(block, block)] += np.block([[same, other], [other, same]])
    return resistance


def _virtual_forces(nodes, friction, minus, plus):
    """Phi from (24) and velocities from (22) and (23), in the paper's notation.

    The paper's segment i has its plus end at node i and its minus end at node i + 1.
    """
    count = len(nodes) - 1
    mobility_trans, mobility_dr, length = [], [], []
    force, torque = [], []
    for i in range(count):
        difference = nodes[i] - nodes[i + 1]
        length.append(np.linalg.norm(difference))
        tangent = difference / length[i]
        mobility_trans.append(_project(tangent, 1 / friction.parallel, 1 / friction.perpendicular))
        mobility_dr.append(_project(tangent, 1 / friction.extensional, 1 / friction.rotational))
        force.append(minus[i] + plus[i])
        torque.append(length[i] / 2 * (minus[i] - plus[i]))
    a_plus = [mobility_trans[i] + length[i] ** 2 / 4 * mobility_dr[i] for i in range(count)]
    a_minus = [mobility_trans[i] - length[i] ** 2 / 4 * mobility_dr[i] for i in range(count)]
    phi = np.zeros((count + 1, 3))  # phi[i] is Phi^(i); phi[-1] stands for the absent Phi^(-1) and Phi^(N-1).
    if count > 1:
        matrix, right = np.zeros((3 * (count - 1), 3 * (count - 1))), np.zeros((count - 1, 3))
        for i in range(count - 1):
            rows = slice(3 * i, 3 * i + 3)
            matrix[rows, rows] = a_plus[i + 1] + a_plus[i]
            if i + 1 < count - 1:
                matrix[rows, 3 * i + 3 : 3 * i + 6] = -a_minus[i + 1]
            if i > 0:
                matrix[rows, 3 * i - 3 : 3 * i] = -a_minus[i]
            right[i] = (
                mobility_trans[i + 1] @ force[i + 1]
                - mobility_trans[i] @ force[i]
                + length[i + 1] / 2 * mobility_dr[i + 1] @ torque[i + 1]
                + length[i] / 2 * mobility_dr[i] @ torque[i]
            )
        phi[: count - 1] = np.linalg.solve(matrix, right.reshape(-1)).reshape(-1, 3)
    velocity = np.zeros((count + 1, 3))
    for i in range(count):
        before, after = phi[i - 1] if i > 0 else np.zeros(3), phi[i] if i < count - 1 else np.zeros(3)
        total = force[i] + after - before
        moment = torque[i] - length[i] / 2 * after - length[i] / 2 * before
        translation, turning = mobility_trans[i] @ total, length[i] / 2 * mobility_dr[i] @ moment
        velocity[i], velocity[i + 1] = translation + turning, translation - turning
    return velocity, phi[: count - 1]


SLOW_DNA = replace(DSDNA, extension_relaxation_time=1e5)  # ps: one long step stays small.
CHAINS = [(F_ACTIN, 1, 1), (F_ACTIN, 2, 2), (SLOW_DNA, 3, 3), (F_ACTIN, 64, 4)]


@pytest.fixture(scope="module", params=ENGINES)
def mixed_system(request):
    """Bent chains of 1, 2, 3 and 64 segments in one System, with external forces on all nodes."""
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine=request.param)
    for kind, segments, seed in CHAINS:
        filaments.add_nodes(kind, _bent_chain(kind, segments, seed))
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
    return np.linalg.solve(_dense_resistance(nodes, friction), forces.reshape(-1)).reshape(-1, 3)


@pytest.mark.parametrize("scheme", ["euler", "midpoint"])
def test_step_without_noise_equals_dense_solutions(mixed_system, scheme):
    filaments, system, positions = mixed_system
    step = 1000.0
    integrator = filaments.create_integrator(system, step, scheme=scheme, temperature=0)
    context = openmm.Context(system, integrator, openmm.Platform.getPlatform("Reference"))
    context.setPositions(positions)
    state = context.getState(positions=True, forces=True)
    start, forces = state.getPositions(asNumpy=True)._value, state.getForces(asNumpy=True)._value
    integrator.step(1)
    moved = context.getState(positions=True).getPositions(asNumpy=True)._value - start
    for (kind, _, _), indices in zip(CHAINS, filaments.node_indices):
        nodes, force, friction = start[indices], forces[indices], kind.segment_friction(VISCOSITY, TEMPERATURE)
        if scheme == "midpoint":
            nodes = nodes + 0.5 * step * _dense_velocity(nodes, friction, force)
        expected = step * _dense_velocity(nodes, friction, force)
        assert np.abs(moved[indices] - expected).max() < 1e-10 * np.abs(expected).max()


def test_both_forms_agree_and_give_the_joint_tensions(mixed_system):
    filaments, system, positions = mixed_system
    integrator = filaments.create_integrator(system, 1.0, temperature=0)
    context = openmm.Context(system, integrator, openmm.Platform.getPlatform("Reference"))
    context.setPositions(positions)
    state = context.getState(positions=True, forces=True)
    start, forces = state.getPositions(asNumpy=True)._value, state.getForces(asNumpy=True)._value
    velocities = redistribution.redistribute(filaments.chain_set(system), start, forces)
    tensions = filaments.joint_tensions(context)
    for (kind, _, _), indices, tension in zip(CHAINS, filaments.node_indices, tensions):
        nodes, friction = start[indices], kind.segment_friction(VISCOSITY, TEMPERATURE)
        nodal = _dense_velocity(nodes, friction, forces[indices])

        # Stretching and bending belong to segments; the rest of a node's force goes to its segments in equal parts.
        minus, plus = segment_end_forces(Filament(kind, nodes, ()), nodes)
        external = forces[indices].copy()
        external[:-1] -= minus
        external[1:] -= plus
        external[1:-1] /= 2
        virtual, phi = _virtual_forces(nodes, friction, minus + external[:-1], plus + external[1:])
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
    nodes = _bent_chain(F_ACTIN, 5, 11)
    forces = np.random.default_rng(12).normal(size=nodes.shape)
    resistance = _dense_resistance(nodes, F_ACTIN.segment_friction(VISCOSITY, TEMPERATURE))
    free = np.repeat(~chains.fixed, 3)
    expected = np.zeros(18)
    expected[free] = np.linalg.solve(resistance[np.ix_(free, free)], forces.reshape(-1)[free])
    velocity = redistribution.redistribute(chains, nodes, forces)
    assert np.abs(velocity.reshape(-1) - expected).max() < 1e-10 * np.abs(expected).max()
    assert np.all(velocity[list(fixed)] == 0.0)


def test_midpoint_drift_is_the_divergence_of_the_mobility():
    """Mean displacement without forces against k_B T div(Z^-1) by finite differences of a dense inverse."""
    chains = _chain_set([2])
    nodes = _bent_chain(F_ACTIN, 2, 13)
    friction = F_ACTIN.segment_friction(VISCOSITY, TEMPERATURE)
    kT, width = 2.5, 1e-3

    def mobility(flat):
        return np.linalg.inv(_dense_resistance(flat.reshape(-1, 3), friction))

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
