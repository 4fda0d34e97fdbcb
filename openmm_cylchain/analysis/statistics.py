"""Means, correlation functions and relaxation times of correlated samples, with their errors.

A series is an array with time along its first axis. Where a second axis is allowed it holds independent
copies (filaments, segments), which are pooled.
"""

from __future__ import annotations

import logging
import math
import warnings
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import scipy

from ..errors import EquilibrationWarning, InputError
from ..units.quantities import DIMENSIONLESS, TIME, in_units_of, positive, whole_number
from ..units.types import FloatArray, Numbers, Scalar


def _series(values: npt.ArrayLike, name: str = "series") -> FloatArray:
    series = np.asarray(in_units_of(values, DIMENSIONLESS, name))
    if series.ndim == 0 or series.shape[0] == 0 or series.size == 0:
        raise InputError(f"{name} must be an array with at least one value.")
    return series


def _copies(values: npt.ArrayLike, name: str = "series") -> FloatArray:
    series = _series(values, name)
    if series.ndim > 2:
        raise InputError(f"{name} must have the shape (frames,) or (frames, copies), but has {series.shape}.")
    return series.reshape(series.shape[0], -1)


def _pymbar_timeseries():
    # pymbar reports on import that it found no JAX, and that its estimates need long series.
    logging.getLogger("pymbar").setLevel(logging.ERROR)
    from pymbar import timeseries

    return timeseries


def statistical_inefficiency(series: npt.ArrayLike) -> float:
    """Number of correlated samples that are worth one independent sample: ``g = 1 + 2 tau`` in frames.

    From the normalised correlation function summed up to its first zero (pymbar; Chodera et al., J. Chem.
    Theory Comput. 2007, 3, 26). A series much shorter than its correlation time gives too small a value.

    Parameters
    ----------
    series : (frames,) or (frames, copies) array
        Columns are independent copies with a common mean.

    Returns
    -------
    float
        At least 1; 1 for a series without fluctuations.
    """
    copies = _copies(series)
    if _is_constant(copies):
        return 1.0
    timeseries = _pymbar_timeseries()
    if copies.shape[1] == 1:
        return float(timeseries.statistical_inefficiency(copies[:, 0]))
    return float(timeseries.statistical_inefficiency_multiple(list(copies.T)))


def _is_constant(values, axis=None):
    # The mean of equal values carries rounding errors, which would pass for fluctuations.
    return np.all(np.ptp(values, axis=axis) <= 1e-14 * np.max(np.abs(values), axis=axis))


def integrated_autocorrelation_time(series: npt.ArrayLike, time_step: Scalar = 1.0) -> float:
    """Integrated correlation time ``tau = (g - 1)/2 * time_step``, in ps; see ``statistical_inefficiency``.

    Parameters
    ----------
    series : (frames,) or (frames, copies) array
    time_step : time between frames, above zero
        Left out, the result is in frames.
    """
    return 0.5 * (statistical_inefficiency(series) - 1.0) * positive(time_step, TIME, "time_step")


def mean_with_error(series: npt.ArrayLike) -> tuple[float, float]:
    """Mean of correlated samples and its standard error: ``sqrt(variance * g / samples)``.

    Parameters
    ----------
    series : (frames,) or (frames, copies) array
        Columns are independent copies with a common mean; they are pooled.

    Returns
    -------
    (mean, standard_error) : floats
        The error of a constant series is 0.

    Raises
    ------
    InputError
        For fewer than two values, or values that are not finite.
    """
    copies = _copies(series)
    if copies.size < 2:
        raise InputError("A standard error needs at least two values, but series has one.")
    mean = float(np.mean(copies))
    if _is_constant(copies):
        return mean, 0.0
    return mean, float(np.sqrt(np.var(copies, ddof=1) * statistical_inefficiency(copies) / copies.size))


FEWEST_INDEPENDENT_SAMPLES = 20
"""Below which ``mean_in_equilibrium`` warns: an error from n samples is itself uncertain by (2n)^(-1/2), here 16 %."""


@dataclass(frozen=True)
class EquilibriumMean:
    """A mean over the part of a series that is in equilibrium.

    Attributes
    ----------
    mean, standard_error : float
    first_frame : int
        From which on the series is in equilibrium; frames before it are left out.
    independent_samples : float
        How many independent samples the rest is worth.
    """

    mean: float
    standard_error: float
    first_frame: int
    independent_samples: float


def mean_in_equilibrium(series: npt.ArrayLike) -> EquilibriumMean:
    """Mean of a series without the frames in which it relaxes, and its standard error.

    The first frame is the one from which on the series has most independent samples (pymbar; Chodera, J. Chem. Theory
    Comput. 2016, 12, 1799).

    Parameters
    ----------
    series : (frames,) array

    Returns
    -------
    EquilibriumMean

    Raises
    ------
    InputError
        For fewer than 8 frames, or values that are not finite.

    Warns
    -----
    EquilibrationWarning
        If fewer than 20 independent samples are left, so that the error itself is not known, or the series relaxes in
        more than half of its frames: the run is too short.
    """
    values = _series(series)
    if values.ndim != 1 or len(values) < FEWEST_FRAMES_OF_DRIFT:
        raise InputError(
            f"series must be an array of {FEWEST_FRAMES_OF_DRIFT} frames at least, but has the shape {values.shape}."
        )
    if _is_constant(values):
        return EquilibriumMean(float(values.mean()), 0.0, 0, float(len(values)))
    first, inefficiency, _ = _pymbar_timeseries().detect_equilibration(values, nskip=max(1, len(values) // 200))
    rest = values[int(first) :]
    samples = len(rest) / float(inefficiency)
    error = float(np.sqrt(np.var(rest, ddof=1) / samples)) if len(rest) > 1 else math.nan
    if samples < FEWEST_INDEPENDENT_SAMPLES or first > len(values) // 2:
        longer = max(2.0, 2.0 * FEWEST_INDEPENDENT_SAMPLES / samples)
        warnings.warn(
            f"The run is too short for its error bar: from frame {int(first)} of {len(values)} on it is worth "
            f"{samples:.3g} independent samples. Run it at least {longer:.0f} times as long.",
            EquilibrationWarning,
            stacklevel=2,
        )
    return EquilibriumMean(float(rest.mean()), error, int(first), samples)


SIGNIFICANT_DRIFT = 4.0
"""``drift`` beyond which a series has not been in equilibrium from its start."""
FEWEST_FRAMES_OF_DRIFT = 8
_FEWEST_COPIES_OF_DRIFT = 8


def drift(series: npt.ArrayLike) -> float:
    """How far the last half of a series lies above its first quarter, in standard errors of the difference.

    A test of equilibration in the manner of Geweke, in Bayesian Statistics 4 (Oxford, 1992), p. 169: of a series that
    is in equilibrium from its start it is about normal with the variance one; ``SIGNIFICANT_DRIFT`` is beyond chance.
    The error is that of the differences of independent copies; of fewer than 8 copies, from the fluctuations in the
    last half, accounting for their correlation. A relaxation much longer than the series goes unseen.

    Parameters
    ----------
    series : (frames,) or (frames, copies) array

    Returns
    -------
    float
        Infinite for a difference without fluctuations.

    Raises
    ------
    InputError
        For fewer than 8 frames, or values that are not finite.
    """
    copies = _copies(series)
    frames = len(copies)
    if frames < FEWEST_FRAMES_OF_DRIFT:
        raise InputError(f"A drift needs at least {FEWEST_FRAMES_OF_DRIFT} frames, but series has {frames}.")
    first, last = copies[: frames // 4], copies[frames - frames // 2 :]
    differences = last.mean(axis=0) - first.mean(axis=0)
    difference = float(differences.mean())
    if abs(difference) <= 1e-14 * np.max(np.abs(copies)):
        return 0.0
    if len(differences) >= _FEWEST_COPIES_OF_DRIFT:
        error = differences.std(ddof=1) / np.sqrt(len(differences))
    else:
        error = mean_with_error(last)[1] * np.sqrt(1.0 + len(last) / len(first))
    return difference / float(error) if error > 0 else math.copysign(math.inf, difference)


def autocorrelation(
    series: npt.ArrayLike, mean: npt.ArrayLike | None = None, maximum_lag: int | None = None
) -> FloatArray:
    """Normalised autocorrelation function ``C(k) = <dx(t).dx(t+k)>/<dx.dx>``, by FFT.

    Parameters
    ----------
    series : (frames, ...) array
        Products are summed over all axes but the first: over the components of a vector, over copies.
    mean : number or array that broadcasts with one frame, optional
        The mean to subtract; the average over frames, for every component, if not given. Give 0 for a
        vector whose mean is known to be zero.
    maximum_lag : int, optional
        Largest lag in frames; frames - 1 if not given.

    Returns
    -------
    (maximum_lag + 1,) array
        C(0) = 1. Every lag k is averaged over its frames - k pairs.

    Raises
    ------
    InputError
        For a series without fluctuations, or a maximum_lag that it does not reach.
    """
    series = _series(series)
    frames = series.shape[0]
    maximum_lag = frames - 1 if maximum_lag is None else whole_number(maximum_lag, 0, "maximum_lag")
    if maximum_lag >= frames:
        raise InputError(f"maximum_lag must be below the number of frames, {frames}, but is {maximum_lag}.")
    products = _lagged_products(_fluctuations(series, mean))[: maximum_lag + 1].sum(axis=1)
    if products[0] <= 0:
        raise InputError("The autocorrelation of a series without fluctuations is not defined.")
    return products / products[0]


def _fluctuations(series, mean):
    if mean is None:
        if _is_constant(series, axis=0):
            return np.zeros_like(series)
        return series - series.mean(axis=0)
    return series - _mean_of(series, mean)


def _mean_of(series, mean):
    mean = in_units_of(mean, DIMENSIONLESS, "mean")
    try:
        shape = np.broadcast_shapes(np.shape(mean), series.shape[1:])
    except ValueError:
        shape = ()
    if shape != series.shape[1:]:
        raise InputError(f"mean must broadcast with one frame, {series.shape[1:]}, but has the shape {np.shape(mean)}.")
    return mean


def _lagged_products(fluctuations):
    # <x(t) x(t+k)> of every column; padding with zeros keeps the end from meeting the start.
    frames = fluctuations.shape[0]
    columns = fluctuations.reshape(frames, -1)
    transform = np.fft.rfft(columns, n=2 * frames, axis=0)
    products = np.fft.irfft(np.abs(transform) ** 2, n=2 * frames, axis=0)[:frames]
    return products / np.arange(frames, 0, -1)[:, None]


@dataclass(frozen=True)
class RelaxationTime:
    """Exponential fit ``amplitude * exp(-t/time)`` of a correlation function.

    Attributes
    ----------
    time : float
        Relaxation time in ps.
    standard_error : float
        Of ``time``, from a jackknife that leaves out one block at a time; NaN with a single block.
    amplitude : float
        Value at t = 0 relative to the correlation function's first value.
    """

    time: float
    standard_error: float
    amplitude: float


def fit_relaxation_time(
    time: Numbers, correlation: npt.ArrayLike, amplitude: float | None = None, fit_above: float = 0.1, blocks: int = 20
) -> RelaxationTime:
    """Relaxation time of a decaying quantity, by a least-squares fit of ``amplitude * exp(-t/tau)``.

    The standard error is a jackknife over groups of copies: it needs no assumption on how the values at
    different times are correlated.

    Parameters
    ----------
    time : (times,) array of times, increasing
    correlation : (times,) or (times, copies) array
        Copies are independent (filaments, segments), and the fit is to their mean.
    amplitude : number, optional
        The amplitude relative to the first value of ``correlation``; fitted if not given.
    fit_above : number
        The fit ends where the correlation first falls below this fraction of its first value.
    blocks : int
        Largest number of groups of copies for the jackknife.

    Returns
    -------
    RelaxationTime
        With ``standard_error`` NaN if there is one copy only.

    Raises
    ------
    InputError
        For fewer than three points to fit, a correlation that does not start above zero, or one that does
        not decay.
    """
    time = np.asarray(in_units_of(time, TIME, "time"))
    copies = _copies(correlation, "correlation")
    if time.ndim != 1 or time.shape[0] != copies.shape[0]:
        raise InputError(f"time and correlation differ in length: {time.shape} and {copies.shape[0]}.")
    if np.any(np.diff(time) <= 0):
        raise InputError("time must increase.")
    if amplitude is not None:
        amplitude = positive(amplitude, DIMENSIONLESS, "amplitude")
    blocks = whole_number(blocks, 2, "blocks")
    end = _fit_end(copies.mean(axis=1), fit_above)
    if end < 3:
        raise InputError(
            f"Only {end} points of the correlation lie above fit_above: the times are too far apart for a fit."
        )
    return _jackknifed_fit(time[:end], copies[:end], amplitude, min(blocks, copies.shape[1]))


def _fit_end(correlation, fit_above):
    if correlation[0] <= 0:
        raise InputError("The correlation must start above zero.")
    below = np.flatnonzero(correlation < positive(fit_above, DIMENSIONLESS, "fit_above") * correlation[0])
    return int(below[0]) if below.size else correlation.shape[0]


def _jackknifed_fit(time, copies, amplitude, blocks):
    best = _fit(time, copies.mean(axis=1), amplitude)
    if blocks < 2:
        return RelaxationTime(best[0], float("nan"), best[1])
    total, count = copies.sum(axis=1), copies.shape[1]
    left_out = []
    for group in np.array_split(np.arange(count), blocks):
        rest = (total - copies[:, group].sum(axis=1)) / (count - len(group))
        left_out.append(_fit(time, rest, amplitude)[0])
    spread = np.var(left_out, ddof=0)
    return RelaxationTime(best[0], float(np.sqrt((blocks - 1) * spread)), best[1])


def _fit(time, correlation, amplitude):
    values = correlation / correlation[0]
    if not values.max() > values[-1]:
        raise InputError("The correlation does not decay over the times given.")
    # An inverse time relative to the range of the data keeps the fit well scaled; the area is a good first guess.
    span = time[-1] - time[0]
    area = np.sum(0.5 * (values[1:] + values[:-1]) * np.diff(time))
    start = [span / max(area, 1e-3 * span)]

    def residual(parameters):
        prefactor = parameters[1] if amplitude is None else amplitude
        return prefactor * np.exp(-parameters[0] * time / span) - values

    fit = scipy.optimize.least_squares(residual, start if amplitude is not None else [*start, 1.0])
    rate = fit.x[0] / span
    if not (fit.success and rate > 0):
        raise InputError("The correlation does not decay exponentially over the times given.")
    return float(1.0 / rate), float(fit.x[1] if amplitude is None else amplitude)


def relaxation_time(
    series: npt.ArrayLike,
    time_step: Scalar,
    mean: npt.ArrayLike | None = None,
    amplitude: float | None = None,
    fit_above: float = 0.1,
    blocks: int = 20,
) -> RelaxationTime:
    """Relaxation time of a stationary series from its autocorrelation function, with a statistical error.

    The autocorrelation function is fitted with ``amplitude * exp(-t/tau)``; the error is a jackknife over
    copies, or over blocks of time where there are fewer than ten copies.

    Parameters
    ----------
    series : (frames,) or (frames, copies) or (frames, copies, components) array
        Copies are independent and share one mean; products are summed over components.
    time_step : time between frames, above zero
    mean : number, optional
        The known mean; the average over frames and copies, for every component, if not given.
    amplitude : number, optional
        1 for a series with a single relaxation time; fitted if not given.
    fit_above : number
        The fit ends where the autocorrelation first falls below this.
    blocks : int
        Largest number of blocks for the jackknife.

    Returns
    -------
    RelaxationTime

    Raises
    ------
    InputError
        If the series is too short against its relaxation time: the autocorrelation has to fall below
        ``fit_above`` within half a block.
    """
    series = _series(series)
    if series.ndim == 1:
        series = series[:, None]
    if series.ndim > 3:
        raise InputError(f"series must have up to three axes (frames, copies, components), but has {series.shape}.")
    blocks = whole_number(blocks, 2, "blocks")
    step = positive(time_step, TIME, "time_step")
    series = series.reshape(*series.shape[:2], -1)
    average = series.mean(axis=(0, 1)) if mean is None else _mean_of(series, mean)
    copies = _time_blocks(series - average, blocks)
    products = _lagged_products(copies)
    products = products.reshape(products.shape[0], copies.shape[1], copies.shape[2]).sum(axis=2)
    lags = max(products.shape[0] // 2, min(3, products.shape[0]))
    if not products[0].sum() > 0:
        raise InputError("The relaxation time of a series without fluctuations is not defined.")
    if _fit_end(products[:lags].mean(axis=1), fit_above) == lags:
        raise InputError(
            f"The series is too short for its relaxation time: the autocorrelation does not fall below {fit_above:g} "
            f"within {lags} frames, half a block."
        )
    time = step * np.arange(lags)
    return fit_relaxation_time(time, products[:lags], amplitude, fit_above, blocks)


def _time_blocks(fluctuations, blocks):
    frames, copies, components = fluctuations.shape
    if copies >= 10:
        return fluctuations
    length = frames // blocks
    if length < 6:
        raise InputError(f"The series has {frames} frames: too few for {blocks} blocks of at least 6.")
    cut = fluctuations[: length * blocks].reshape(blocks, length, copies, components)
    return cut.transpose(1, 0, 2, 3).reshape(length, blocks * copies, components)
