"""Relaxation of a straight filament whose first node is trapped: Figs. 15 to 18 of Pesek et al. 2016."""

from dataclasses import replace

import numpy as np
import pytest

from openmm_cylchain import F_ACTIN, Filaments
from support.contexts import new_context, positions_of
from support.solvent import KT, TEMPERATURE, VISCOSITY

CHAINS, SEGMENTS = 1600, 64
# Of the trap, over that of a segment: where it is explicit, too, steps of 0.02 us resolve it.
TRAP = 0.05
TIMES = (10, 20, 50, 100, 200)
MICROSECOND = 1e6


def _relax(scheme, step, times, seed, chains=CHAINS, kind=F_ACTIN):
    """{time: (mean, error) of the shortening, and of the stretching energy of a segment over k_B T}."""
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine="compiled")
    for chain in range(chains):
        filaments.add_straight(kind, SEGMENTS, [0, 0, 0], [1, 0, 0])
        filaments.add_tether(chain, 0, [0, 0, 0], TRAP * kind.segment_stiffness)
    _, system, positions = filaments.build()
    integrator = filaments.create_integrator(system, step * MICROSECOND, scheme=scheme, random_seed=seed)
    context = new_context(system, positions, integrator, "CPU")
    result, taken = {}, 0
    for moment in times:
        integrator.step(round(moment / step) - taken)
        taken = round(moment / step)
        nodes = positions_of(context).reshape(chains, SEGMENTS + 1, 3)
        lengths = np.linalg.norm(np.diff(nodes, axis=1), axis=2)
        shortening = SEGMENTS * F_ACTIN.segment_length - (nodes[:, -1, 0] - nodes[:, 0, 0])
        stretching = F_ACTIN.stretching_energy(lengths).mean(axis=1) / KT
        result[moment] = [(values.mean(), values.std(ddof=1) / np.sqrt(chains)) for values in (shortening, stretching)]
    return result


@pytest.fixture(scope="module")
def reference():
    return _relax("midpoint", 0.02, TIMES[1:], seed=1)


@pytest.mark.sample("^5")
@pytest.mark.slow
@pytest.mark.parametrize("step", [1, 5, 10])
def test_shortening_is_that_of_fine_steps(reference, step):
    relaxation = _relax("implicit", step, [moment for moment in TIMES if moment >= step], seed=2)
    for moment in relaxation:
        if moment in reference and moment >= 10 * step:
            (mean, error), (expected, expected_error) = relaxation[moment][0], reference[moment][0]
            relative_error = np.hypot(error / mean, expected_error / expected)
            assert 4 * relative_error < 0.05
            assert abs(mean / expected - 1) < 0.05, (moment, mean / expected, relative_error)
    if step == 1:
        # Bends stretch the straight filament until its ends have come nearer.
        overshoot, error = relaxation[10][1]
        assert overshoot - 4 * error > 1.2 * 0.5
        assert relaxation[200][1][0] + 4 * relaxation[200][1][1] < 1.1 * 0.5


@pytest.mark.sample("^implicit$")
@pytest.mark.slow
@pytest.mark.parametrize("scheme", ["implicit", "implicit-second-order"])
def test_steps_of_different_lengths_shorten_filaments_alike(scheme):
    """Those in between converge in the fewest iterations; two of them were not enough."""
    shortening = {step: _relax(scheme, step, [moment], seed=3)[moment][0] for step, moment in ((3, 999), (10, 1000))}
    (mean, error), (other, other_error) = shortening.values()
    relative_error = np.hypot(error / mean, other_error / other)
    assert 4 * relative_error < 0.025
    assert abs(mean / other - 1) < 4 * relative_error, shortening


@pytest.mark.parametrize(
    "extension_time, moment, steps", [pytest.param(10, 3, (0.01, 0.1, 1), marks=pytest.mark.slow), (100, 10, (1,))]
)
def test_lengths_with_much_friction(extension_time, moment, steps):
    """Their tension is that of friction alone: steps, short or long, must turn it with the segments."""
    kind = replace(F_ACTIN, extension_relaxation_time=extension_time * MICROSECOND)
    expected = _relax("midpoint", 0.01, [moment], 1, 500, kind)[moment]
    for step in steps:
        measured = _relax("implicit", step, [moment], 2, 500, kind)[moment]
        for (mean, error), (exact, exact_error) in zip(measured, expected):
            assert abs(mean - exact) < 4 * np.hypot(error, exact_error), (step, mean, exact)
        # Of the energy, a bias of 5 % would be seen.
        assert 4 * np.hypot(error, exact_error) < 0.05 * exact
