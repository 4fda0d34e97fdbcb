"""Errors of correlated samples, drifts, autocorrelations and fits of relaxation times, on series with known answers."""

import math
import subprocess
import sys

import numpy as np
import pytest
from openmm import unit

from openmm_cylchain.analysis import statistics
from openmm_cylchain.errors import InputError
from support.random_series import correlated_series


@pytest.mark.parametrize("copies", [1, 12])
def test_drift_of_a_stationary_series_is_chance_and_of_a_relaxing_one_is_not(copies):
    generator = np.random.default_rng(14)
    stationary = np.array([correlated_series(generator, 600, 0.9, (copies,)) for _ in range(200)])
    drifts = np.array([statistics.drift(series) for series in stationary])
    # Of variance one, or somewhat more: the errors themselves are estimates.
    assert 0.8 < drifts.std() < 1.6
    assert np.mean(np.abs(drifts) > statistics.SIGNIFICANT_DRIFT) <= 0.02
    relaxation = 6.0 * np.exp(-np.arange(600) / 100)[:, None]
    relaxing = np.array([statistics.drift(series - relaxation) for series in stationary])
    assert np.mean(relaxing > statistics.SIGNIFICANT_DRIFT) > 0.9
    assert np.mean([statistics.drift(series + relaxation) for series in stationary]) < -statistics.SIGNIFICANT_DRIFT


def test_drift_of_series_without_fluctuations_and_refusals():
    assert statistics.drift(np.full(10, 0.1)) == 0.0
    assert statistics.drift(np.repeat([0.0, 1.0], 8)) == math.inf
    assert statistics.drift(np.repeat([1.0, 0.0], 8)) == -math.inf
    with pytest.raises(InputError, match="at least 8 frames"):
        statistics.drift(np.arange(7.0))
    with pytest.raises(InputError):
        statistics.drift([math.nan] * 20)


def test_autocorrelation_is_the_direct_sum():
    series = np.random.default_rng(6).normal(size=(40, 3)) + [0.0, 5.0, -2.0]
    centred = series - series.mean(axis=0)
    direct = np.array([np.sum(centred[lag:] * centred[: 40 - lag]) / (40 - lag) for lag in range(40)])
    assert statistics.autocorrelation(series) == pytest.approx(direct / direct[0], abs=1e-12)
    assert statistics.autocorrelation(series, maximum_lag=5) == pytest.approx((direct / direct[0])[:6], abs=1e-12)
    about_zero = np.sum(series[1:] * series[:-1]) / 39 / (np.sum(series**2) / 40)
    assert statistics.autocorrelation(series, mean=0.0)[1] == pytest.approx(about_zero, abs=1e-12)


def test_autocorrelation_of_a_constant_is_refused():
    for series in (np.full(10, 0.1), np.full((10, 2), [0.1, 0.7])):
        with pytest.raises(InputError, match="fluctuations"):
            statistics.autocorrelation(series)
    with pytest.raises(InputError, match="maximum_lag"):
        statistics.autocorrelation(np.arange(5.0), maximum_lag=5)


def test_statistical_inefficiency_of_an_autoregressive_series():
    series = correlated_series(np.random.default_rng(8), 40000, 0.8)
    exact = (1 + 0.8) / (1 - 0.8)
    # Over 40 seeds the estimates spread by 5 %; 4 standard deviations are allowed.
    assert statistics.statistical_inefficiency(series) == pytest.approx(exact, rel=0.2)
    tau = statistics.integrated_autocorrelation_time(series, 2 * unit.nanosecond)
    assert tau == pytest.approx(0.5 * (exact - 1) * 2000.0, rel=0.22)
    copies = correlated_series(np.random.default_rng(9), 4000, 0.8, (10,))
    assert statistics.statistical_inefficiency(copies) == pytest.approx(exact, rel=0.2)
    assert statistics.statistical_inefficiency(np.full(50, 0.1)) == 1.0


@pytest.mark.parametrize("shape", [(), (4,)])
def test_standard_error_covers_the_true_mean_of_correlated_samples(shape):
    generator = np.random.default_rng(10)
    deviations = []
    for _ in range(250):
        mean, error = statistics.mean_with_error(correlated_series(generator, 1000, 0.85, shape))
        deviations.append(mean / error)
    deviations = np.abs(deviations)
    # 250 trials give the coverage to 3 %; the naive error, 3.5 times too small, would cover 22 %.
    assert 0.58 < np.mean(deviations < 1) < 0.78
    assert np.mean(deviations < 2) > 0.89


def test_mean_with_error_of_special_series():
    assert statistics.mean_with_error([0.1] * 30) == pytest.approx((0.1, 0.0))
    assert statistics.mean_with_error([1.0, 3.0]) == pytest.approx((2.0, 1.0))
    frozen = np.tile(np.random.default_rng(12).normal(size=25), (40, 1))
    mean, error = statistics.mean_with_error(frozen)
    assert error == pytest.approx(np.std(frozen[0], ddof=1) / 5, rel=0.05)
    for bad in ([1.0], [], [1.0, float("nan")], 3.0, np.zeros((2, 2, 2)), ["a", "b"]):
        with pytest.raises(InputError):
            statistics.mean_with_error(bad)


def test_fit_of_an_exact_exponential():
    time = np.linspace(0.0, 40.0, 30)
    fit = statistics.fit_relaxation_time(time * unit.nanosecond, 3.0 * np.exp(-time / 12.0))
    assert fit.time == pytest.approx(12000.0, rel=1e-6) and fit.amplitude == pytest.approx(1.0, rel=1e-6)
    assert math.isnan(fit.standard_error)
    late = 0.7 * np.exp(-time / 12.0)
    late[0] = 1.0
    fit = statistics.fit_relaxation_time(time, late)
    assert 0.7 < fit.amplitude < 1.0


def test_fit_error_over_copies_covers_the_true_time():
    generator, time, deviations = np.random.default_rng(13), np.arange(0.0, 60.0), []
    for _ in range(40):
        # The mean orientation of segments that turn in a plane: <cos> = exp(-t/tau) with strongly correlated times.
        angle = np.cumsum(math.sqrt(2 / 20.0) * generator.normal(size=(60, 300)), axis=0)
        orientation = np.cos(np.concatenate([np.zeros((1, 300)), angle[:-1]]))
        fit = statistics.fit_relaxation_time(time, orientation, amplitude=1.0)
        deviations.append((fit.time - 20.0) / fit.standard_error)
    assert abs(np.mean(deviations)) < 4 / math.sqrt(40)
    assert 0.65 < np.std(deviations) < 1.45


@pytest.mark.parametrize(("frames", "shape"), [(8000, ()), (1500, (12,)), (1500, (12, 2))])
def test_relaxation_time_of_autoregressive_series(frames, shape):
    generator, deviations = np.random.default_rng(14), []
    exact = -2.0 / math.log(0.8)
    for _ in range(25):
        fit = statistics.relaxation_time(correlated_series(generator, frames, 0.8, shape), 2.0, amplitude=1.0)
        assert fit.standard_error < 0.15 * exact
        deviations.append((fit.time - exact) / fit.standard_error)
    assert abs(np.mean(deviations)) < 1.0
    assert 0.6 < np.std(deviations) < 1.6


def test_relaxation_fits_refuse_what_they_cannot_fit():
    generator = np.random.default_rng(15)
    with pytest.raises(InputError, match="too short"):
        statistics.relaxation_time(correlated_series(generator, 400, 0.99), 1.0)
    with pytest.raises(InputError, match="too few"):
        statistics.relaxation_time(generator.normal(size=30), 1.0)
    with pytest.raises(InputError, match="too far apart"):
        statistics.relaxation_time(generator.normal(size=4000), 1.0)
    with pytest.raises(InputError, match="fluctuations"):
        statistics.relaxation_time(np.full(400, 2.0), 1.0)
    with pytest.raises(InputError, match="not decay"):
        statistics.fit_relaxation_time(np.arange(5.0), np.ones(5))
    with pytest.raises(InputError, match="increase"):
        statistics.fit_relaxation_time(np.zeros(5), np.exp(-np.arange(5.0)))
    with pytest.raises(InputError, match="differ"):
        statistics.fit_relaxation_time(np.arange(4.0), np.ones(5))
    with pytest.raises(InputError, match="above zero"):
        statistics.fit_relaxation_time(np.arange(5.0), -np.ones(5))


def test_statistics_print_nothing():
    program = (
        "import numpy; from openmm_cylchain.analysis import statistics; "
        "statistics.mean_with_error(numpy.random.default_rng(0).normal(size=(50, 2)))"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=60)
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")
