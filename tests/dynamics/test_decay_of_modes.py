"""How fast bending modes decay under the implicit schemes, against linear theory."""

import numpy as np
import pytest
from scipy.linalg import eigh

from openmm_cylchain import MICROTUBULE, Filaments
from openmm_cylchain.time_steps.schemes import IMPLICIT_SCHEMES, amplification_of_second_order
from support.contexts import new_context, positions_of
from support.solvent import KT, TEMPERATURE, VISCOSITY

SEGMENTS = 8
KIND = MICROTUBULE
LENGTH = KIND.segment_length
SIGMAS = 4.0


def _modes():
    """Rates (1/ps) and shapes (nodes, modes) of the transverse modes of a straight free filament, slowest first."""
    friction = KIND.segment_friction(VISCOSITY, TEMPERATURE, SEGMENTS)
    middles = 0.5 * (np.eye(SEGMENTS, SEGMENTS + 1) + np.eye(SEGMENTS, SEGMENTS + 1, 1))
    turns = (np.eye(SEGMENTS, SEGMENTS + 1, 1) - np.eye(SEGMENTS, SEGMENTS + 1)) / LENGTH
    bends = np.diff(turns, axis=0)
    resistance = friction.perpendicular * middles.T @ middles + friction.rotational * turns.T @ turns
    rates, shapes = eigh(KIND.joint_stiffness * bends.T @ bends, resistance)
    return rates[2:], shapes[:, 2:], bends


def _amplification(scheme, z, fastest):
    """What a step leaves of a mode: of the rate z/h, where that of the sharpest bend is fastest/h."""
    if scheme == "implicit-second-order":
        return amplification_of_second_order(z)
    theta = max(0.5, 1 - 1 / fastest)
    return (1 - (1 - theta) * z) / (1 + theta * z)


@pytest.mark.parametrize("scheme", IMPLICIT_SCHEMES)
@pytest.mark.parametrize("mode", [0, 1, 2, 6])
@pytest.mark.parametrize("z", [0.1, 1.0, 5.0])
def test_a_small_bend_decays_as_linear_theory_of_the_scheme(scheme, mode, z):
    rates, shapes, _ = _modes()
    step = z / rates[mode]
    shape = shapes[:, mode] / np.abs(shapes[:, mode]).max()
    nodes = np.zeros((SEGMENTS + 1, 3))
    nodes[:, 0] = LENGTH * np.arange(SEGMENTS + 1)
    nodes[:, 1] = shape
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine="compiled")
    filaments.add_nodes(KIND, nodes)
    _, system, positions = filaments.build()
    integrator = filaments.create_integrator(system, step, scheme=scheme, temperature=0, checks=False)
    context = new_context(system, positions, integrator)
    integrator.step(1)
    after = positions_of(context)[:, 1]
    friction = KIND.segment_friction(VISCOSITY, TEMPERATURE, SEGMENTS)
    fastest = 4 * step * KIND.joint_stiffness / friction.rotational
    assert after == pytest.approx(_amplification(scheme, z, fastest) * shape, abs=2e-3)


@pytest.mark.parametrize("z, allowed", [(0.1, 0.001), (0.5, 0.012), (1.0, 0.05)])
def test_decay_of_second_order_is_right_within(z, allowed):
    assert abs(-np.log(amplification_of_second_order(z)) / z - 1) < allowed


@pytest.mark.slow
@pytest.mark.parametrize("slowest", [0.02, 0.15, 1.0])
def test_fluctuations_decay_within_five_percent_up_to_one_over_the_step(slowest):
    """The first three modes of stiff filaments in equilibrium: those of rates up to 1/h decay as linear theory says."""
    rates, shapes, bends = _modes()
    step = slowest / rates[0]
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine="compiled")
    for chain in range(256):
        filaments.add_equilibrium(KIND, SEGMENTS, seed=chain)
    _, system, positions = filaments.build()
    integrator = filaments.create_integrator(system, step, scheme="implicit-second-order", random_seed=3, checks=False)
    context = new_context(system, positions, integrator)
    nodes = np.array(filaments.node_indices)
    amplitudes = []
    for _ in range(400):
        integrator.step(1)
        tangents = np.diff(positions_of(context)[nodes], axis=1)
        tangents /= np.linalg.norm(tangents, axis=2)[..., None]
        amplitudes.append(np.einsum("ijk,jm->imk", np.diff(tangents, axis=1), bends @ shapes[:, :3]))
    amplitudes = np.array(amplitudes)
    squares = 0.5 * np.sum(amplitudes[1:] ** 2 + amplitudes[:-1] ** 2, axis=(0, 3))
    products = np.sum(amplitudes[1:] * amplitudes[:-1], axis=(0, 3))
    left = products.sum(axis=0) / squares.sum(axis=0)
    scatter = np.sqrt(np.sum((products - left * squares) ** 2, axis=0)) / squares.sum(axis=0)
    tested = 0
    for mode, z in enumerate(rates[:3] * step):
        if z > 1.0001:
            continue
        tested += 1
        rate, error = -np.log(left[mode]) / z, scatter[mode] / left[mode] / z
        assert SIGMAS * error < 0.1
        assert abs(rate - 1) < 0.05 + SIGMAS * error, (z, rate, error)
        expected = -np.log(amplification_of_second_order(z)) / z
        assert abs(rate - expected) < 0.01 + SIGMAS * error, (z, rate, expected, error)
    assert tested
    # Their variances are those of equilibrium, k_B T/rate in each of two directions.
    squares = np.sum(amplitudes**2, axis=3).mean(axis=0) * KIND.joint_stiffness**2 / rates[:3] / KT / 2
    mean, error = squares.mean(axis=0), squares.std(axis=0, ddof=1) / np.sqrt(len(squares))
    assert np.all(SIGMAS * error < 0.4)
    assert np.all(np.abs(mean - 1) < SIGMAS * error + 0.01), (mean, error)
