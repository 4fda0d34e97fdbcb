"""Moduli of networks and solutions from the fluctuations of their stress."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..errors import InputError
from ..units.quantities import numbers_of, thermal_energy, whole_number
from ..units.types import FloatArray, Indices, Scalar
from .runs import Run, volume_of
from .stress import stress


@dataclass(frozen=True)
class RelaxationModulus:
    """A shear relaxation modulus.

    Attributes
    ----------
    times : (lags,) array
        In ps.
    values : (lags,) array
        In kJ/(mol nm^3), of which one is 1.66054 MPa.
    errors : (lags,) array
        Standard errors of the values, from blocks of the run.
    """

    times: FloatArray
    values: FloatArray
    errors: FloatArray


_FEWEST_BLOCKS = 4
_MOST_BLOCKS = 20


def relaxation_modulus(
    run: Run, maximum_lag: int, frames: slice | Indices | None = None, volume: Scalar | None = None
) -> RelaxationModulus:
    """The shear relaxation modulus ``G(t) = V/(k_B T) <sigma_xy(t) sigma_xy(0)>`` of an isotropic solution or network.

    Of the symmetric stress tensor without its trace, P, all components count, in the combination that has the same
    value for every orientation of the axes: ``G(t) = V/(10 k_B T) sum over i, j of <P_ij(t) P_ij(0)>`` (Daivis and
    Evans, J. Chem. Phys. 1994, 100, 541), five times as much data as one component. It is that of the filaments: the
    fluid around adds its viscosity to the integral of G. See ``stress`` for what is in it.

    The run must be in equilibrium and last much longer than what relaxes. For a network that is linked for good, the
    stress does not relax: G(t) is then that above its modulus at rest, if the mean of P is what the box holds. Frames
    must be as close as the relaxation that is looked for; the tensions of stiff segments relax faster and
    are a part of G(0).

    Parameters
    ----------
    run : Run
    maximum_lag : int
        Largest time of G, in frames: at most a quarter of all.
    frames : slice or list of int, optional
        Frames at equal distances; all if not given.
    volume : volume, optional
        That of the periodic box if not given.

    Returns
    -------
    RelaxationModulus

    Raises
    ------
    InputError
        Without a periodic box and a volume, for frames that are not at equal distances, or too few for the lag.
    """
    room = volume_of(run, volume)
    chosen = np.arange(len(run))
    if isinstance(frames, slice):
        chosen = chosen[frames]
    elif frames is not None:
        numbers = numbers_of(frames, -len(run), "frames")
        if max(numbers, default=0) >= len(run):
            raise InputError(f"frames must be below the number of frames, {len(run)}, but go up to {max(numbers)}.")
        chosen = chosen[numbers]
    maximum_lag = whole_number(maximum_lag, 0, "maximum_lag")
    if len(chosen) < _FEWEST_BLOCKS * max(1, maximum_lag):
        raise InputError(
            f"{len(chosen)} frames are too few for a maximum_lag of {maximum_lag}: it takes four times as many."
        )
    times = run.times[chosen]
    spacings = np.diff(times)
    if np.any(spacings <= 0.0) or np.ptp(spacings) > 1e-6 * spacings.mean():
        raise InputError("frames must go forward at equal distances.")
    tensors = np.array([stress(run, int(frame), room).total for frame in chosen])
    values, errors = _correlation(_shears(tensors), maximum_lag)
    scale = room / (10.0 * thermal_energy(run.temperature))
    return RelaxationModulus(spacings.mean() * np.arange(maximum_lag + 1), scale * values, scale * errors)


def _shears(tensors):
    # The symmetric parts without traces, as rows of nine.
    symmetric = 0.5 * (tensors + tensors.transpose(0, 2, 1))
    traces = np.trace(symmetric, axis1=1, axis2=2)
    return (symmetric - traces[:, None, None] / 3.0 * np.eye(3)).reshape(-1, 9)


def _correlation(series, maximum_lag):
    # Means of x(t) . x(t+lag), and their errors from blocks of pairs.
    blocks = min(_MOST_BLOCKS, len(series) // max(1, maximum_lag))
    values, errors = np.empty(maximum_lag + 1), np.empty(maximum_lag + 1)
    for lag in range(maximum_lag + 1):
        products = np.einsum("ti,ti->t", series[: len(series) - lag], series[lag:])
        parts = np.array([block.mean() for block in np.array_split(products, blocks)])
        values[lag] = products.mean()
        errors[lag] = parts.std(ddof=1) / np.sqrt(blocks)
    return values, errors
