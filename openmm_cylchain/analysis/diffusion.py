"""Mean square displacements of filaments from an ``mdtraj.Trajectory``; arguments are as in ``filament_shapes``."""

from __future__ import annotations

from dataclasses import dataclass

import mdtraj
import numpy as np

from ..errors import InputError
from ..filaments.topology_nodes import require_trajectory
from ..units.quantities import TIME, numbers_of, positive, true_or_false
from ..units.types import FloatArray, Indices, IntArray, Scalar
from .filament_shapes import (
    center_of_segments,
    filament_curves,
    node_positions,
    normalized,
    refuse_rings,
    refuse_spare_nodes,
)


@dataclass(frozen=True)
class MeanSquareDisplacement:
    """Mean square displacements against time, in nm^2, averaged over filaments.

    Attributes
    ----------
    time : (lags,) array
        In ps.
    nodes, center : (lags,) arrays
        Of the nodes on average, and of the centre of mass, summed over three directions.
    parallel, perpendicular : (lags,) arrays
        Of the centre of mass along the end-to-end direction at the start, and along one direction across it.
    nodes_error, center_error, parallel_error, perpendicular_error : (lags,) arrays
        Standard errors over filaments; NaN for a single filament.
    """

    time: FloatArray
    nodes: FloatArray
    center: FloatArray
    parallel: FloatArray
    perpendicular: FloatArray
    nodes_error: FloatArray
    center_error: FloatArray
    parallel_error: FloatArray
    perpendicular_error: FloatArray


def mean_square_displacement(
    trajectory: mdtraj.Trajectory,
    filaments: int | Indices | None = None,
    lags: Indices | None = None,
    window_average: bool = True,
    time_step: Scalar | None = None,
) -> MeanSquareDisplacement:
    """Mean square displacement of nodes and centres of mass, also along and across the initial axis, of open filaments.

    Parameters
    ----------
    trajectory : mdtraj.Trajectory
    filaments : int or list of int, optional
        Filaments may differ in length.
    lags : list of int, optional
        Lags in frames; about 50 from 0 to half the trajectory, evenly spaced in their logarithm, if not given.
    window_average : bool
        Average over every frame as a start (a stationary process), or start from the first frame only.
    time_step : time between frames, optional
        That of ``trajectory.time``, which must be evenly spaced, if not given.

    Returns
    -------
    MeanSquareDisplacement
    """
    require_trajectory(trajectory)
    refuse_rings(trajectory, filaments, "axis")
    refuse_spare_nodes(trajectory, filaments, "displacements of the same nodes")
    window_average = true_or_false(window_average, "window_average")
    lags = _checked_lags(lags, trajectory.n_frames)
    step = _frame_spacing(trajectory) if time_step is None else positive(time_step, TIME, "time_step")
    results = np.stack(
        [
            _filament_displacements(nodes, line, lags, window_average)
            for nodes, line in zip(node_positions(trajectory, filaments), filament_curves(trajectory, filaments))
        ]
    )
    count = len(results)
    errors = results.std(axis=0, ddof=1) / np.sqrt(count) if count > 1 else np.full(results.shape[1:], np.nan)
    return MeanSquareDisplacement(np.asarray(step * lags, dtype=float), *results.mean(axis=0), *errors)


def _checked_lags(lags: Indices | None, frames: int) -> IntArray:
    if frames < 2:
        raise InputError("A mean square displacement needs at least two frames.")
    if lags is None:
        return np.unique(np.concatenate([[0], np.geomspace(1, max(1, frames // 2), 50).round()])).astype(int)
    lags = np.array(numbers_of(lags, 0, "lags"), dtype=int)
    if np.any(lags >= frames):
        raise InputError(f"lags must be below the number of frames, {frames}, but go up to {lags.max()}.")
    return lags


def _frame_spacing(trajectory):
    steps = np.diff(trajectory.time.astype(float))
    # Times are stored in single precision.
    tolerance = 1e-3 * abs(steps[0]) + 1e-6 * np.max(np.abs(trajectory.time))
    if steps[0] <= 0 or np.any(np.abs(steps - steps.mean()) > tolerance):
        raise InputError("The frames are not evenly spaced in time: give time_step, or every n-th frame.")
    return steps.mean()


def _filament_displacements(positions, line, lags, window_average):
    centers = center_of_segments(line, ring=False)
    axes = normalized(positions[:, -1] - positions[:, 0])
    result = np.zeros((4, len(lags)))
    for column, lag in enumerate(lags):
        starts = len(positions) - lag if window_average else 1
        moved = centers[lag : lag + starts] - centers[:starts]
        total = np.sum(moved**2, axis=-1)
        along = np.sum(moved * axes[:starts], axis=-1) ** 2
        nodes = np.sum((positions[lag : lag + starts] - positions[:starts]) ** 2, axis=-1)
        result[:, column] = nodes.mean(), total.mean(), along.mean(), 0.5 * (total - along).mean()
    return result
