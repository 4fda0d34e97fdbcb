"""Observables of filaments from an ``mdtraj.Trajectory``: their curves and shapes.

A filament is a chain of the topology; its nodes are the atoms of that chain with the name "NOD", in order. It is a ring
if a bond joins the last one to the first.
Of a filament of beam elements, whose control points have the name "CTL", functions take the curve: arc lengths of its
elements, tangents at its nodes, and points along all of it.
Of a filament that grows, nodes come and go: its other particles are where the last node is (``count_nodes``). What is
given for each node, segment or joint is NaN where there is none in a frame, and averages are over those that there are.
All is NaN in frames in which there is no filament: before it has begun, or where it has vanished.
Anything else in the trajectory is left alone. Positions have to be those of whole filaments, not wrapped
into a periodic box (``periodic`` makes them whole). Results are plain numbers in OpenMM's units (nm, ps).

Every function takes ``filaments``: one index or a list of indices into ``filament_nodes``, all filaments if
not given. Data per filament come as an array with the axes (frames, filaments); data per segment, joint or
node come as a list with one array per filament, since filaments may differ in length. Every function raises
InputError for a trajectory without filaments and for indices out of range.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager

import mdtraj
import numpy as np

from ..beams.curve import arc_lengths, curve_points
from ..errors import InputError
from ..filaments.filament import CONTROL_POINT_NAME
from ..filaments.spare_nodes import count_nodes, without_spare_nodes
from ..filaments.topology_nodes import filament_nodes, require_trajectory, ring_filaments
from ..units.quantities import numbers_of
from ..units.types import FloatArray, Indices

_POINTS_OF_ELEMENT = 8


def node_positions(trajectory: mdtraj.Trajectory, filaments: int | Indices | None = None) -> list[FloatArray]:
    """Positions of the nodes: a list of (frames, nodes, 3) arrays in nm, NaN of spare ones of a filament that grows."""
    return [without_spare_nodes(positions).astype(float) for positions in _particles(trajectory, filaments)]


def _particles(trajectory, filaments):
    # With spare nodes, in the precision of the trajectory.
    require_trajectory(trajectory)
    nodes = filament_nodes(trajectory)
    return [trajectory.xyz[:, nodes[index]] for index in selected_indices(filaments, len(nodes))]


def control_point_positions(
    trajectory: mdtraj.Trajectory, filaments: int | Indices | None = None
) -> list[FloatArray | None]:
    """Positions of the control points: a list of (frames, nodes, 3) arrays in nm, None without beam elements."""
    require_trajectory(trajectory)
    nodes, positions = filament_nodes(trajectory), []
    for index in selected_indices(filaments, len(nodes)):
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

    Those of a ring end before its first point, to which the last one is joined. Spare nodes of a filament that grows
    are where its last node is; one that is not there has NaN.

    Returns
    -------
    list of (frames, points, 3) arrays in nm
    """
    particles = [
        np.where(count_nodes(own)[:, None, None] == 0, np.nan, own) for own in _particles(trajectory, filaments)
    ]
    return _curves(particles, trajectory, filaments)


def _curves(particles, trajectory, filaments):
    rings = ring_filaments(trajectory)
    closed = rings[list(selected_indices(filaments, len(rings)))]
    chains = zip(particles, control_point_positions(trajectory, filaments), closed)
    return [
        nodes.astype(float) if own is None else curve_points(nodes.astype(float), own, _POINTS_OF_ELEMENT, bool(ring))
        for nodes, own, ring in chains
    ]


def selected_indices(filaments: int | Indices | None, count: int) -> Sequence[int]:
    """Indices of the filaments that are meant among so many; InputError for others."""
    if filaments is None:
        return range(count)
    selected = numbers_of(filaments, 0, "filaments")
    if not selected:
        raise InputError("filaments selects no filament.")
    if max(selected) >= count:
        raise InputError(f"filaments contains {max(selected)}, but the trajectory has {count} filaments.")
    return selected


def refuse_rings(trajectory: mdtraj.Trajectory, filaments: int | Indices | None, what: str) -> None:
    """Raise InputError if one of the filaments is a ring, which lacks something."""
    rings = ring_filaments(trajectory)
    for index in selected_indices(filaments, len(rings)):
        if rings[index]:
            raise InputError(f"Filament {index} is a ring, which has no {what}: select the others.")


def refuse_spare_nodes(trajectory: mdtraj.Trajectory, filaments: int | Indices | None, what: str) -> None:
    """Raise InputError if one of the filaments has spare nodes in a frame, and so lacks something that is the same in
    all frames."""
    particles = _particles(trajectory, filaments)
    for index, own in zip(selected_indices(filaments, len(filament_nodes(trajectory))), particles):
        counts = count_nodes(own)
        if np.any(counts < own.shape[1]):
            raise InputError(
                f"Filament {index} grows: {counts.min()} to {counts.max()} of its {own.shape[1]} particles are nodes. "
                f"They come and go, and it has no {what}: select the others."
            )


def _segment_vectors(trajectory, filaments):
    rings = ring_filaments(trajectory)
    selected = selected_indices(filaments, len(rings))
    return [
        np.diff(positions, axis=1, append=positions[:, :1]) if rings[index] else np.diff(positions, axis=1)
        for index, positions in zip(selected, node_positions(trajectory, filaments))
    ]


def end_to_end_vectors(trajectory: mdtraj.Trajectory, filaments: int | Indices | None = None) -> FloatArray:
    """Vectors from the first to the last node: (frames, filaments, 3) array in nm. Raises InputError for rings."""
    refuse_rings(trajectory, filaments, "end-to-end vector")
    # Spare nodes are where the last node is; all of them, if there is no filament.
    ends = [particles[:, [0, -1]].astype(float) for particles in _particles(trajectory, filaments)]
    there = _are_there(node_positions(trajectory, filaments))
    return np.where(there[..., None], np.stack([p[:, -1] - p[:, 0] for p in ends], axis=1), np.nan)


def _are_there(nodes):
    # Which filaments there are (frames, filaments), with the positions of their nodes.
    return np.stack([np.isfinite(own[:, 0, 0]) for own in nodes], axis=1)


@contextmanager
def _quiet() -> Iterator[None]:
    # Of a filament that is not there, NumPy would say that it has no mean.
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)
        yield


def radii_of_gyration(trajectory: mdtraj.Trajectory, filaments: int | Indices | None = None) -> FloatArray:
    """Radii of gyration of the nodes, all of one weight: (frames, filaments) array in nm.

    Of beam elements, those of the curve.
    """
    positions = _curves(node_positions(trajectory, filaments), trajectory, filaments)
    with _quiet():
        return np.stack([np.sqrt(np.nanvar(p, axis=1).sum(axis=-1)) for p in positions], axis=1)


def centers_of_mass(trajectory: mdtraj.Trajectory, filaments: int | Indices | None = None) -> FloatArray:
    """Mean of the segments' midpoints, all of one weight: (frames, filaments, 3) array in nm."""
    rings = ring_filaments(trajectory)
    selected = selected_indices(filaments, len(rings))
    lines = _curves(node_positions(trajectory, filaments), trajectory, filaments)
    return np.stack([center_of_segments(p, rings[index]) for index, p in zip(selected, lines)], axis=1)


def center_of_segments(positions: FloatArray, ring: bool) -> FloatArray:
    """Mean (frames, 3) of the midpoints of segments between positions (frames, points, 3)."""
    # Every node of a ring belongs to two segments.
    with _quiet():
        return positions.mean(axis=1) if ring else 0.5 * np.nanmean(positions[:, 1:] + positions[:, :-1], axis=1)


def segment_lengths(trajectory: mdtraj.Trajectory, filaments: int | Indices | None = None) -> list[FloatArray]:
    """Lengths of the segments, of beam elements along their arcs: a list of (frames, segments) arrays in nm."""
    chains = zip(_segment_vectors(trajectory, filaments), *_nodes_and_control_points(trajectory, filaments))
    return [
        np.linalg.norm(vectors, axis=-1) if own is None else arc_lengths(nodes, own, vectors.shape[1] == nodes.shape[1])
        for vectors, nodes, own in chains
    ]


def _nodes_and_control_points(trajectory, filaments):
    return node_positions(trajectory, filaments), control_point_positions(trajectory, filaments)


def contour_lengths(trajectory: mdtraj.Trajectory, filaments: int | Indices | None = None) -> FloatArray:
    """Sums of the segments' lengths: (frames, filaments) array in nm."""
    lengths = np.stack([np.nansum(own, axis=1) for own in segment_lengths(trajectory, filaments)], axis=1)
    return np.where(_are_there(node_positions(trajectory, filaments)), lengths, np.nan)


def tangents(trajectory: mdtraj.Trajectory, filaments: int | Indices | None = None) -> list[FloatArray]:
    """Unit vectors along the segments: a list of (frames, segments, 3) arrays.

    Of beam elements, unit vectors along the curve at the nodes: (frames, segments + 1, 3). Raises InputError for a
    segment of zero length.
    """
    chains = zip(_segment_vectors(trajectory, filaments), *_nodes_and_control_points(trajectory, filaments))
    return [normalized(vectors if own is None else own - nodes) for vectors, nodes, own in chains]


def normalized(vectors: FloatArray) -> FloatArray:
    """Vectors (..., 3) divided by their lengths; InputError if one has none."""
    norms = np.linalg.norm(vectors, axis=-1, keepdims=True)
    if np.any(norms == 0):
        raise InputError("Two nodes that should span a segment or a filament lie at one point.")
    return vectors / norms
