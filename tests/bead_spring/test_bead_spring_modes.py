"""Modes of bead-spring chains: the transform, its rates, what couples them, and steps of the scheme of modes."""

import numpy as np
import pytest
import scipy

from openmm_cylchain import DSDNA_BASE_PAIRS, BeadSpringType, theory
from openmm_cylchain.bead_spring.draws import draw_bonds
from openmm_cylchain.bead_spring.modes import bead_spring_mode_rates, mode_shapes
from openmm_cylchain.units.quantities import thermal_energy
from reproduce.mode_coupling import mode_amplitudes, mode_forces

ROOM = 296.15
KIND = DSDNA_BASE_PAIRS


def energy(kind, nodes):
    bonds = np.diff(nodes, axis=-2)
    lengths = np.linalg.norm(bonds, axis=-1)
    products = np.sum(bonds[..., 1:, :] * bonds[..., :-1, :], axis=(-2, -1))
    return (
        0.5 * kind.stiffness * np.sum((lengths - kind.natural_length) ** 2, axis=-1) - kind.bending_stiffness * products
    )


def positions_of(amplitudes):
    return scipy.fft.idct(amplitudes, type=2, norm="ortho", axis=-2)


def mode_step(kind, bonds, step, temperature):
    """What one step of scheme "modes" does to all modes: decay, response and noise, three arrays (bonds + 1,).

        R_p(t + h) = exp(-zeta_p h) R_p(t) + E_p F_p(t) + w_p N(0, 1)

    with the force F_p = lambda DeltaH_p, of ``mode_forces``, taken to decay with zeta^l_p in the step (48):

        E_p = (exp(-zeta_p h) - exp(-zeta^l_p h))/(xi (zeta^l_p - zeta_p)), E_0 = h/xi    (49), in nm^2 mol/kJ
        w_p^2 = k_B T (1 - exp(-2 zeta_p h))/(xi zeta_p), w_0^2 = 2 k_B T h/xi            (35), w_p in nm
    """
    bending, along = bead_spring_mode_rates(kind, bonds)
    decay, friction = np.exp(-bending * step), kind.bead_friction
    with np.errstate(invalid="ignore", divide="ignore"):
        response = decay * -np.expm1(-(along - bending) * step) / (along - bending)
        noise = -np.expm1(-2.0 * bending * step) / bending
    response[0], noise[0] = step, 2.0 * step
    return decay, response / friction, np.sqrt(thermal_energy(temperature) / friction * noise)


def test_amplitudes_and_back():
    nodes = np.random.default_rng(1).normal(size=(3, 8, 3))
    amplitudes = mode_amplitudes(nodes)
    shapes = mode_shapes(7, np.arange(8))
    assert shapes.T @ shapes == pytest.approx(np.eye(8), abs=1e-12)
    assert amplitudes == pytest.approx(np.einsum("np,cnk->cpk", shapes, nodes))
    assert amplitudes[:, 0] == pytest.approx(np.sqrt(8.0) * nodes.mean(axis=1))
    assert positions_of(amplitudes) == pytest.approx(nodes)


@pytest.mark.parametrize("bonds", [1, 2, 7])
def test_the_equation_of_motion_in_modes_is_exact(bonds):
    """(46): the gradient of the energy (1), by differences, is what rates and couplings of modes give."""
    nodes = np.random.default_rng(bonds).normal(size=(bonds + 1, 3))
    amplitudes = mode_amplitudes(nodes)
    bending, along = (rate[:, None] * KIND.bead_friction for rate in bead_spring_mode_rates(KIND, bonds))
    rest, whole = mode_forces(KIND, nodes)
    forces = np.zeros_like(nodes)
    for index in np.ndindex(*nodes.shape):
        moved = np.zeros_like(nodes)
        moved[index] = 1e-6
        forces[index] = (energy(KIND, nodes - moved) - energy(KIND, nodes + moved)) / 2e-6
    expected = mode_amplitudes(forces)
    scale = np.abs(expected).max()
    assert rest - bending * amplitudes == pytest.approx(expected, abs=1e-6 * scale)
    assert whole - along * amplitudes == pytest.approx(expected, abs=1e-6 * scale)


def test_rates():
    """zeta_p = 16 nu s^4 (45), and, of long waves, those of a rod: EI q^4/(xi/a) and K q^2/(xi/a)."""
    bonds = 2000
    bending, along = bead_spring_mode_rates(KIND, bonds)
    wave = np.pi * 3 / ((bonds + 1) * KIND.bead_spacing)
    friction = KIND.bead_friction / KIND.bead_spacing
    assert bending[3] == pytest.approx(KIND.bending_rigidity * wave**4 / friction, rel=1e-4)
    assert along[3] == pytest.approx(KIND.stretching_modulus * wave**2 / friction, rel=1e-3)
    assert bending[0] == along[0] == 0.0
    assert along[-1] * KIND.time_unit == pytest.approx(4.0 * (1.0 + 2.0 * KIND.nu), rel=1e-5)


def test_what_couples_modes_is_small():
    """The ratios of Fig. 1, N = 63, from exact samples; their values from other samples are known to about 3 %."""
    drawn = draw_bonds(KIND.nu, KIND.reduced_temperature(ROOM), 63, np.random.default_rng(7), 1500)
    nodes = KIND.natural_length * np.concatenate([np.zeros((1500, 1, 3)), np.cumsum(drawn, axis=1)], axis=1)
    rest, whole = (np.mean(np.sum(force**2, axis=2), axis=0) for force in mode_forces(KIND, nodes))
    ratios = np.sqrt(whole / np.where(rest > 0.0, rest, 1.0))
    expected = {1: 64, 2: 20, 3: 19.5, 4: 10.3, 5: 10.3, 6: 6.7, 7: 6.8, 8: 4.8, 9: 4.9, 10: 3.6, 31: 1.53, 62: 1.54}
    for mode, ratio in expected.items():
        assert ratios[mode] == pytest.approx(ratio, rel=0.08), mode


def test_a_short_step_is_eulers():
    decay, response, noise = mode_step(KIND, 7, 1e-4 * KIND.time_unit, ROOM)
    step, friction = 1e-4 * KIND.time_unit, KIND.bead_friction
    bending, _ = bead_spring_mode_rates(KIND, 7)
    assert 1.0 - decay == pytest.approx(step * bending, rel=1e-3)
    assert response == pytest.approx(np.full(8, step / friction), rel=1e-3)
    kT = KIND.reduced_temperature(ROOM) * KIND.stiffness * KIND.natural_length**2
    assert noise**2 == pytest.approx(np.full(8, 2.0 * kT * step / friction), rel=1e-3)


def test_a_long_step_forgets():
    """Modes that relax within a step are Gaussian, of the variance k_B T/(xi zeta_p), and the coupling is gone."""
    decay, response, noise = mode_step(KIND, 7, 1e6 * KIND.time_unit, ROOM)
    bending, _ = bead_spring_mode_rates(KIND, 7)
    kT = KIND.reduced_temperature(ROOM) * KIND.stiffness * KIND.natural_length**2
    assert np.all(decay[1:] < 1e-100) and np.all(response[1:] < 1e-100)
    assert noise[1:] ** 2 == pytest.approx(kT / (KIND.bead_friction * bending[1:]))


@pytest.mark.slow
def test_steps_in_modes_keep_the_exact_equilibrium():
    """The scheme with a short step samples what the transfer operator says: neither knows of the other."""
    kind = BeadSpringType.from_reduced(
        name="BSP", diameter=1.0, nu=0.3, reduced_temperature=0.3, bead_spacing=1.0, temperature=ROOM, bead_friction=1.0
    )
    bonds, chains, generator = 5, 3000, np.random.default_rng(3)
    drawn = draw_bonds(kind.nu, 0.3, bonds, generator, chains)
    nodes = kind.natural_length * np.concatenate([np.zeros((chains, 1, 3)), np.cumsum(drawn, axis=1)], axis=1)
    # Away from equilibrium first: it must find back.
    nodes *= 1.3
    decay, response, noise = (one[:, None] for one in mode_step(kind, bonds, 0.1 * kind.time_unit, ROOM))
    sums = []
    for step in range(3000):
        force, _ = mode_forces(kind, nodes)
        amplitudes = decay * mode_amplitudes(nodes) + response * force
        nodes = positions_of(amplitudes + noise * generator.normal(size=amplitudes.shape))
        if step >= 1000 and step % 50 == 0:
            vectors = np.diff(nodes, axis=1)
            sums.append(np.stack([np.sum(vectors.sum(axis=1) ** 2, axis=1), *np.sum(vectors**2, axis=2).T]))
    averages = np.mean(sums, axis=0)
    error = averages.std(axis=1) / np.sqrt(chains)
    exact = np.array(
        [
            theory.bead_spring_mean_square_end_to_end(kind, bonds, ROOM),
            *theory.bead_spring_mean_square_lengths(kind, bonds, ROOM),
        ]
    )
    assert np.all(error < 0.01 * exact)
    # The step leaves 2 % at most.
    assert np.all(np.abs(averages.mean(axis=1) - exact) < 4.0 * error + 0.02 * exact)
