"""How filaments of an ``mdtraj.Trajectory`` bend: joints, correlation of tangents, persistence length, modes.

Arguments and results are as in ``filament_shapes``.
"""

from __future__ import annotations

import warnings
from dataclasses import dataclass

import mdtraj
import numpy as np

from ..errors import EquilibrationWarning, InputError
from ..filaments.topology_nodes import ring_filaments
from ..units.quantities import DIMENSIONLESS, LENGTH, in_units_of, positive, shown, true_or_false, whole_number
from ..units.types import FloatArray, Indices, IntArray, Scalar
from .filament_shapes import (
    contour_lengths,
    filament_curves,
    node_positions,
    normalized,
    refuse_rings,
    refuse_spare_nodes,
    segment_lengths,
    selected_indices,
    tangents,
)
from .statistics import FEWEST_FRAMES_OF_DRIFT, SIGNIFICANT_DRIFT, drift, mean_with_error


def joint_cosines(trajectory: mdtraj.Trajectory, filaments: int | Indices | None = None) -> list[FloatArray]:
    """Cosines t1.t2 between neighbouring segments: a list of (frames, joints) arrays.

    A ring has as many joints as segments, with the one at its first node first. Of beam elements, between neighbouring
    nodes: (frames, segments).
    """
    rings = ring_filaments(trajectory)
    cosines = []
    for index, t in zip(selected_indices(filaments, len(rings)), tangents(trajectory, filaments)):
        before, behind = (np.roll(t, 1, axis=1), t) if rings[index] else (t[:, :-1], t[:, 1:])
        cosines.append(np.sum(before * behind, axis=-1))
    return cosines


@dataclass(frozen=True)
class TangentCorrelation:
    """Correlation of tangents along a filament.

    Attributes
    ----------
    lag : (lags,) int array
        Distance along the filament in segments, from 0.
    contour_distance : (lags,) array
        The same in nm: lag times the mean segment length.
    mean : (lags,) array
        <t(i).t(i+k)> over segments, filaments and frames.
    standard_error : (lags,) array
        Accounts for correlation in time; filaments count as independent.
    """

    lag: IntArray
    contour_distance: FloatArray
    mean: FloatArray
    standard_error: FloatArray


def tangent_correlation(
    trajectory: mdtraj.Trajectory, filaments: int | Indices | None = None, maximum_lag: int | None = None
) -> TangentCorrelation:
    """Correlation of tangents ``<t(i).t(i+k)>`` against the distance k along the filament.

    Parameters
    ----------
    trajectory : mdtraj.Trajectory
    filaments : int or list of int, optional
        The selected filaments must have one number of segments; they are pooled.
    maximum_lag : int, optional
        Largest k; segments - 1 if not given.

    Returns
    -------
    TangentCorrelation

    Raises
    ------
    InputError
        For filaments of different lengths, a maximum_lag beyond the filament, a single sample, rings, or filaments
        that grow.
    """
    refuse_rings(trajectory, filaments, "free correlation of tangents")
    refuse_spare_nodes(trajectory, filaments, "correlation of the same segments")
    directions = _stacked(tangents(trajectory, filaments))
    segments = directions.shape[2]
    maximum_lag = segments - 1 if maximum_lag is None else whole_number(maximum_lag, 0, "maximum_lag")
    if maximum_lag >= segments:
        raise InputError(f"maximum_lag must be below the number of segments, {segments}, but is {maximum_lag}.")
    estimates = [(1.0, 0.0)]
    for lag in range(1, maximum_lag + 1):
        products = np.einsum("fijx,fijx->fij", directions[:, :, lag:], directions[:, :, :-lag])
        estimates.append(mean_with_error(products.mean(axis=2)))
    mean, error = np.array(estimates).T
    lags = np.arange(maximum_lag + 1)
    spacing = np.mean(_stacked(segment_lengths(trajectory, filaments)))
    return TangentCorrelation(lags, lags * spacing, mean, error)


def _stacked(per_filament):
    if len({values.shape[1] for values in per_filament}) > 1:
        raise InputError("The selected filaments differ in their number of segments: select those of one length.")
    return np.stack(per_filament, axis=1)


def persistence_length(
    trajectory: mdtraj.Trajectory, filaments: int | Indices | None = None, planar: bool | None = None
) -> tuple[float, float]:
    """Persistence length ``-<l>/ln<c>`` from the joint cosines c, with its standard error, in nm.

    In a plane, tangents decorrelate over twice the persistence length, ``<t(0).t(s)> = exp(-s/2 l_p)``, so it is half
    of that.

    In the free discrete chain joints are independent, so that neighbouring tangents hold all there is to know
    and larger distances add nothing. Compare it with ``theory.chain_persistence_length``. That of a FilamentType
    given by its ``persistence_length`` differs by the mean stretching of a segment, l0 for <l>, alone. External forces
    or contacts that align or bend the filament change it.

    Parameters
    ----------
    trajectory : mdtraj.Trajectory
    filaments : int or list of int, optional
        The selected filaments must have one number of segments; they are pooled.
    planar : bool, optional
        Whether they bend in a plane alone; whether each keeps all of its nodes at one z if not given.

    Returns
    -------
    (persistence_length, standard_error) : floats
        The error accounts for correlation in time; filaments count as independent.

    Raises
    ------
    InputError
        For filaments of a single segment, of different lengths or that grow, for rings, for a single sample, and if the
        mean cosine is not between 0 and 1. If some of them are planar, and others are not.

    Warns
    -----
    EquilibrationWarning
        If the bends drift, see ``bending_drift``: leave out the frames in which the filaments relax.
    """
    bends = _mean_bends(trajectory, filaments)
    _warn_of_drift(bends)
    bend, bend_error = mean_with_error(bends)
    if not 0.0 < bend < 1.0:
        raise InputError(f"The mean cosine between segments is {1.0 - bend:g}: the persistence length is not defined.")
    length, length_error = mean_with_error(_stacked(segment_lengths(trajectory, filaments)).mean(axis=2))
    logarithm = np.log1p(-bend) * (2.0 if _are_planar(trajectory, filaments, planar) else 1.0)
    value = -length / logarithm
    relative_error = np.hypot(length_error / length, bend_error / ((1.0 - bend) * np.log1p(-bend)))
    return float(value), float(value * relative_error)


def _are_planar(trajectory, filaments, planar):
    if planar is not None:
        return true_or_false(planar, "planar")
    flat = {bool(np.all(nodes[..., 2] == nodes[0, 0, 2])) for nodes in node_positions(trajectory, filaments)}
    if len(flat) > 1:
        raise InputError("Some of the filaments are planar, and others are not: select those of one kind.")
    return flat.pop()


def bending_drift(trajectory: mdtraj.Trajectory, filaments: int | Indices | None = None) -> float:
    """How far the mean bend 1 - c of the last half of the frames lies above that of the first quarter.

    In standard errors, see ``statistics.drift``: beyond ``statistics.SIGNIFICANT_DRIFT``, 4, the filaments have not
    been in equilibrium from the first frame on. Raises InputError for rings, for filaments of a single segment or of
    different lengths, and for fewer than 8 frames.
    """
    return drift(_mean_bends(trajectory, filaments))


def _mean_bends(trajectory, filaments):
    # 1 - c = |t2 - t1|^2/2, which keeps the digits of stiff chains, averaged over joints: (frames, filaments).
    refuse_rings(trajectory, filaments, "independent joints")
    refuse_spare_nodes(trajectory, filaments, "joints that are all alike")
    directions = _stacked(tangents(trajectory, filaments))
    if directions.shape[2] < 2:
        raise InputError("A persistence length needs filaments of at least two segments.")
    return 0.5 * np.sum(np.diff(directions, axis=2) ** 2, axis=-1).mean(axis=2)


def _warn_of_drift(bends):
    if len(bends) < FEWEST_FRAMES_OF_DRIFT:
        return
    found = drift(bends)
    if abs(found) > SIGNIFICANT_DRIFT:
        warnings.warn(
            "The filaments have not been in equilibrium from the first frame on: joints are "
            f"{'more' if found > 0 else 'less'} bent in the last half of the trajectory than in its first quarter, by "
            f"{abs(found):.1f} standard errors. The persistence length contains this relaxation, its error does not. "
            "Leave out the frames in which filaments relax, as in trajectory[100:], or start from equilibrium.",
            EquilibrationWarning,
            stacklevel=3,
        )


def bending_mode_amplitudes(
    trajectory: mdtraj.Trajectory, filament: int, modes: int | Indices, contour_length: Scalar | None = None
) -> FloatArray:
    """Vector amplitudes of the bending modes of one filament.

    ``A_n = sqrt(2/L) (L/N) sum_i t_i cos(n pi (i + 1/2)/N)`` over the tangents t_i, i = 0..N-1: the cosine
    modes of a free filament, without reference to an axis. Of a stiff filament A_n is transverse; half of
    <|A_n|^2> is the variance per transverse direction, with the exact value
    ``theory.chain_bending_mode_variance``.

    Parameters
    ----------
    trajectory : mdtraj.Trajectory
    filament : int
    modes : int or list of int, from 1 to segments - 1
    contour_length : length, optional
        L; the mean contour length over all frames if not given.

    Returns
    -------
    (frames, modes, 3) array in nm^(1/2)
    """
    filament = whole_number(filament, 0, "filament")
    refuse_rings(trajectory, filament, "bending modes of free ends")
    refuse_spare_nodes(trajectory, filament, "bending modes of one length")
    directions = normalized(np.diff(filament_curves(trajectory, filament)[0], axis=1))
    highest, segments = segment_lengths(trajectory, filament)[0].shape[1], directions.shape[1]
    numbers = np.atleast_1d(in_units_of(modes, DIMENSIONLESS, "modes"))
    if np.any(numbers != np.floor(numbers)) or np.any(numbers < 1) or np.any(numbers >= highest):
        raise InputError(
            f"modes must be whole numbers from 1 to {highest - 1} for {highest} segments, but are {shown(modes)}."
        )
    if contour_length is None:
        contour_length = contour_lengths(trajectory, filament).mean()
    length = positive(contour_length, LENGTH, "contour_length")
    cosines = np.cos(np.outer(numbers, np.pi * (np.arange(segments) + 0.5) / segments))
    return np.sqrt(2.0 * length) / segments * np.einsum("ni,fix->fnx", cosines, directions)
