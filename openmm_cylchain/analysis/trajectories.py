"""Observables of filaments from an ``mdtraj.Trajectory``: shape, bending and diffusion.

A filament is a chain of the topology; its nodes are the atoms of that chain with the name "NOD", in order. It is a ring
if a bond joins the last one to the first.
Of a filament of beam elements, whose control points have the name "CTL", functions take the curve: arc lengths of its
elements, tangents at its nodes, and points along all of it.
Anything else in the trajectory is left alone. Positions have to be those of whole filaments, not wrapped
into a periodic box (``periodic`` makes them whole). Results are plain numbers in OpenMM's units (nm, ps).

Every function takes ``filaments``: one index or a list of indices into ``filament_nodes``, all filaments if
not given. Data per filament come as an array with the axes (frames, filaments); data per segment, joint or
node come as a list with one array per filament, since filaments may differ in length. Every function raises
InputError for a trajectory without filaments and for indices out of range.
"""

import warnings
from dataclasses import dataclass

import mdtraj
import numpy as np

from ..beams.curve import arc_lengths, curve_points
from ..errors import EquilibrationWarning, InputError
from ..filaments.filament import CONTROL_POINT_NAME, NODE_NAME
from ..units.quantities import DIMENSIONLESS, LENGTH, TIME, in_units_of, positive, shown, whole_number
from ..units.types import BoolArray, FloatArray, Indices, IntArray, Scalar
from .statistics import FEWEST_FRAMES_OF_DRIFT, SIGNIFICANT_DRIFT, drift, mean_with_error

_POINTS_OF_ELEMENT = 8


def filament_nodes(trajectory_or_topology: mdtraj.Trajectory | mdtraj.Topology) -> list[IntArray]:
    """Atom indices of the nodes of every filament, in order along the filament.

    Parameters
    ----------
    trajectory_or_topology : mdtraj.Trajectory or mdtraj.Topology

    Returns
    -------
    list of (nodes,) int arrays

    Raises
    ------
    InputError
        If there is no filament, or one with fewer than two nodes.
    """
    topology = getattr(trajectory_or_topology, "topology", trajectory_or_topology)
    filaments = []
    for chain in topology.chains:
        nodes = np.array([atom.index for atom in chain.atoms if atom.name == NODE_NAME], dtype=int)
        if len(nodes) == 1:
            raise InputError(f"Chain {chain.index} has a single node, but a filament has at least two.")
        if len(nodes):
            filaments.append(nodes)
    if not filaments:
        raise InputError(f"The topology has no filament: no atom has the name {NODE_NAME!r}.")
    return filaments


def node_positions(trajectory: mdtraj.Trajectory, filaments: int | Indices | None = None) -> list[FloatArray]:
    """Positions of the nodes: a list of (frames, nodes, 3) arrays in nm."""
    nodes = filament_nodes(trajectory)
    return [trajectory.xyz[:, nodes[index]].astype(float) for index in _selection(filaments, len(nodes))]


def control_point_positions(
    trajectory: mdtraj.Trajectory, filaments: int | Indices | None = None
) -> list[FloatArray | None]:
    """Positions of the control points: a list of (frames, nodes, 3) arrays in nm, None without beam elements."""
    nodes, positions = filament_nodes(trajectory), []
    for index in _selection(filaments, len(nodes)):
        chain = trajectory.topology.atom(int(nodes[index][0])).residue.chain
        own = [atom.index for atom in chain.atoms if atom.name == CONTROL_POINT_NAME]
        if len(own) not in (0, len(nodes[index])):
            raise InputError(
                f"Filament {index} has {len(nodes[index])} nodes, but {len(own)} control points "
                f"({CONTROL_POINT_NAME}): take all of its atoms."
            )
        positions.append(trajectory.xyz[:, own].astype(float) if own else None)
    return positions


def filament_curves(trajectory: mdtraj.Trajectory, filaments: int | Indices | None = None) -> list[FloatArray]:
    """Points by which filaments are drawn: nodes, or of beam elements eight along the curve of each and the last node.

    Those of a ring end before its first point, to which the last one is joined.

    Returns
    -------
    list of (frames, points, 3) arrays in nm
    """
    rings = ring_filaments(trajectory)
    closed = rings[list(_selection(filaments, len(rings)))]
    chains = zip(node_positions(trajectory, filaments), control_point_positions(trajectory, filaments), closed)
    return [
        nodes if own is None else curve_points(nodes, own, _POINTS_OF_ELEMENT, bool(ring))
        for nodes, own, ring in chains
    ]


def _selection(filaments, count):
    if filaments is None:
        return range(count)
    if isinstance(filaments, (int, np.integer)) and not isinstance(filaments, bool):
        filaments = [filaments]
    selected = [whole_number(index, 0, "an index in filaments") for index in filaments]
    if not selected:
        raise InputError("filaments selects no filament.")
    if max(selected) >= count:
        raise InputError(f"filaments contains {max(selected)}, but the trajectory has {count} filaments.")
    return selected


def ring_filaments(trajectory_or_topology: mdtraj.Trajectory | mdtraj.Topology) -> BoolArray:
    """Whether each filament is a ring: (filaments,) bool array."""
    topology = getattr(trajectory_or_topology, "topology", trajectory_or_topology)
    bonds = {frozenset((bond.atom1.index, bond.atom2.index)) for bond in topology.bonds}
    nodes = filament_nodes(topology)
    return np.array([len(one) > 2 and frozenset((int(one[0]), int(one[-1]))) in bonds for one in nodes])


def _refuse_rings(trajectory, filaments, what):
    rings = ring_filaments(trajectory)
    for index in _selection(filaments, len(rings)):
        if rings[index]:
            raise InputError(f"Filament {index} is a ring, which has no {what}: select the others.")


def _segment_vectors(trajectory, filaments):
    rings = ring_filaments(trajectory)
    selected = _selection(filaments, len(rings))
    return [
        np.diff(positions, axis=1, append=positions[:, :1]) if rings[index] else np.diff(positions, axis=1)
        for index, positions in zip(selected, node_positions(trajectory, filaments))
    ]


def end_to_end_vectors(trajectory: mdtraj.Trajectory, filaments: int | Indices | None = None) -> FloatArray:
    """Vectors from the first to the last node: (frames, filaments, 3) array in nm. Raises InputError for rings."""
    _refuse_rings(trajectory, filaments, "end-to-end vector")
    return np.stack([p[:, -1] - p[:, 0] for p in node_positions(trajectory, filaments)], axis=1)


def radii_of_gyration(trajectory: mdtraj.Trajectory, filaments: int | Indices | None = None) -> FloatArray:
    """Radii of gyration of the nodes, all of one weight: (frames, filaments) array in nm.

    Of beam elements, those of the curve.
    """
    positions = filament_curves(trajectory, filaments)
    return np.stack([np.sqrt(np.var(p, axis=1).sum(axis=-1)) for p in positions], axis=1)


def centers_of_mass(trajectory: mdtraj.Trajectory, filaments: int | Indices | None = None) -> FloatArray:
    """Mean of the segments' midpoints, all of one weight: (frames, filaments, 3) array in nm."""
    rings = ring_filaments(trajectory)
    selected = _selection(filaments, len(rings))
    lines = filament_curves(trajectory, filaments)
    return np.stack([_center(p, rings[index]) for index, p in zip(selected, lines)], axis=1)


def _center(positions, ring):
    # Every node of a ring belongs to two segments.
    return positions.mean(axis=1) if ring else 0.5 * (positions[:, 1:] + positions[:, :-1]).mean(axis=1)


def segment_lengths(trajectory: mdtraj.Trajectory, filaments: int | Indices | None = None) -> list[FloatArray]:
    """Lengths of the segments, of beam elements along their arcs: a list of (frames, segments) arrays in nm."""
    chains = zip(_segment_vectors(trajectory, filaments), *_curves(trajectory, filaments))
    return [
        np.linalg.norm(vectors, axis=-1) if own is None else arc_lengths(nodes, own, vectors.shape[1] == nodes.shape[1])
        for vectors, nodes, own in chains
    ]


def _curves(trajectory, filaments):
    return node_positions(trajectory, filaments), control_point_positions(trajectory, filaments)


def contour_lengths(trajectory: mdtraj.Trajectory, filaments: int | Indices | None = None) -> FloatArray:
    """Sums of the segments' lengths: (frames, filaments) array in nm."""
    return np.stack([lengths.sum(axis=1) for lengths in segment_lengths(trajectory, filaments)], axis=1)


def tangents(trajectory: mdtraj.Trajectory, filaments: int | Indices | None = None) -> list[FloatArray]:
    """Unit vectors along the segments: a list of (frames, segments, 3) arrays.

    Of beam elements, unit vectors along the curve at the nodes: (frames, segments + 1, 3). Raises InputError for a
    segment of zero length.
    """
    chains = zip(_segment_vectors(trajectory, filaments), *_curves(trajectory, filaments))
    return [_normalized(vectors if own is None else own - nodes) for vectors, nodes, own in chains]


def _normalized(vectors):
    norms = np.linalg.norm(vectors, axis=-1, keepdims=True)
    if np.any(norms == 0):
        raise InputError("Two nodes that should span a segment or a filament lie at one point.")
    return vectors / norms


def joint_cosines(trajectory: mdtraj.Trajectory, filaments: int | Indices | None = None) -> list[FloatArray]:
    """Cosines t1.t2 between neighbouring segments: a list of (frames, joints) arrays.

    A ring has as many joints as segments, with the one at its first node first. Of beam elements, between neighbouring
    nodes: (frames, segments).
    """
    rings = ring_filaments(trajectory)
    cosines = []
    for index, t in zip(_selection(filaments, len(rings)), tangents(trajectory, filaments)):
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
        For filaments of different lengths, a maximum_lag beyond the filament, a single sample, or rings.
    """
    _refuse_rings(trajectory, filaments, "free correlation of tangents")
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
        For filaments of a single segment or of different lengths, for rings, for a single sample, and if the mean
        cosine is not between 0 and 1. If some of them are planar, and others are not.

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
        return bool(planar)
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
    _refuse_rings(trajectory, filaments, "independent joints")
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
    _refuse_rings(trajectory, filament, "bending modes of free ends")
    directions = _normalized(np.diff(filament_curves(trajectory, filament)[0], axis=1))
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
    _refuse_rings(trajectory, filaments, "axis")
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
    lags = np.array([whole_number(lag, 0, "a lag") for lag in np.atleast_1d(lags).tolist()])
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
    centers = _center(line, ring=False)
    axes = _normalized(positions[:, -1] - positions[:, 0])
    result = np.zeros((4, len(lags)))
    for column, lag in enumerate(lags):
        starts = len(positions) - lag if window_average else 1
        moved = centers[lag : lag + starts] - centers[:starts]
        total = np.sum(moved**2, axis=-1)
        along = np.sum(moved * axes[:starts], axis=-1) ** 2
        nodes = np.sum((positions[lag : lag + starts] - positions[:starts]) ** 2, axis=-1)
        result[:, column] = nodes.mean(), total.mean(), along.mean(), 0.5 * (total - along).mean()
    return result
