"""Checks of where filaments are put, before anything is built."""

import numpy as np

from ..errors import InputError
from ..mechanics.geometry import joined, segment_vectors
from ..units.quantities import whole_number
from ..units.types import FloatArray, Indices
from .chain_type import ChainType

_PLANE_TOLERANCE = 1e-9  # Of a segment's length: rounding of positions that were computed.
_FARTHEST = 1e12


def named_nodes(nodes: int | Indices, count: int, label: str) -> tuple[int, ...]:
    """Return nodes, counted from the start and sorted; raise InputError for one that does not exist."""
    numbers = set()
    for node in np.atleast_1d(np.asarray(nodes, dtype=object)):
        number = whole_number(node, -count, f"{label} node")
        number += count if number < 0 else 0
        if number >= count:
            raise InputError(f"{label} node {node} does not exist; there are {count} nodes.")
        numbers.add(number)
    return tuple(sorted(numbers))


def clamped_nodes(clamped: int | Indices, count: int, label: str) -> tuple[int, ...]:
    """Return the clamped nodes, counted from the start and sorted; raise InputError for one that does not exist."""
    nodes = named_nodes(clamped, count, f"{label}: clamped")
    if len(nodes) == count:
        raise InputError(f"{label} has all of its nodes clamped (mass zero): leave at least one free to move.")
    return nodes


def joint_stiffnesses(filament_type: ChainType, nodes: int, clamped: Indices, closed: bool = False) -> FloatArray:
    """Stiffness (joints,) in the bending potential of every joint of a filament; that next to a clamped segment
    differs.

    Half a segment of material on either side of a joint bends. Where a segment is held, because both of its nodes are
    clamped, and its neighbour is not, only the half on the neighbour's side can: the joint of a FilamentType has
    ``FilamentType.clamped_joint_stiffness``, about twice as much, and the filament is clamped at that node. A ring has
    a joint at every node, an open filament at all nodes but its ends.
    """
    fixed = np.zeros(nodes, dtype=bool)
    fixed[list(clamped)] = True
    held = fixed & np.roll(fixed, -1)
    before, behind = joined(held if closed else held[:-1], closed)
    return np.where(before != behind, filament_type.clamped_bending_stiffness, filament_type.bending_stiffness)


def planar_direction(direction: FloatArray, label: str) -> FloatArray:
    """Return a unit vector in the plane of a planar filament; raise InputError if it leaves it."""
    if abs(direction[2]) > _PLANE_TOLERANCE:
        raise InputError(f"{label} is planar, so its direction must lie in the xy plane, but is {direction.tolist()}.")
    return direction * [1.0, 1.0, 0.0]


def check_shape(filament_type: ChainType, positions: FloatArray, label: str, closed: bool = False) -> None:
    """Raise InputError for node positions (n, 3) in nm in which a force is not defined."""
    if np.max(np.abs(positions)) > _FARTHEST:
        raise InputError(
            f"{label}: its nodes are up to {np.max(np.abs(positions)):.3g} nm from the origin. Beyond {_FARTHEST:g} nm "
            "numbers are too coarse for its forces: move it closer."
        )
    vectors = segment_vectors(positions, closed)
    lengths = np.linalg.norm(vectors, axis=1)
    refuse_coinciding(lengths, len(positions), label)
    if filament_type.maximum_extension is not None:
        _check_extension(filament_type, lengths, label)
    filament_type.check_folds(vectors, label, closed)


def refuse_coinciding(lengths: FloatArray, nodes: int, label: str) -> None:
    """Raise InputError for a segment without a length, of the lengths (segments,) in nm between so many nodes."""
    if np.any(lengths == 0.0):
        node = int(np.argmax(lengths == 0.0))
        raise InputError(f"{label}: nodes {node} and {(node + 1) % nodes} coincide; move them apart.")


def in_one_plane(positions: FloatArray, segment_length: float, label: str) -> FloatArray:
    """Return positions whose z is the same to the bit; raise InputError if they are not in a plane of constant z."""
    heights = positions[:, 2]
    if np.ptp(heights) > _PLANE_TOLERANCE * segment_length:
        node = int(np.argmax(np.abs(heights - heights[0])))
        raise InputError(
            f"{label} is planar, so all of its nodes must have the same z, but node 0 is at z = {heights[0]:g} nm and "
            f"node {node} at {heights[node]:g} nm."
        )
    positions[:, 2] = heights[0]
    return positions


def _check_extension(filament_type, lengths, label):
    extension = np.abs(lengths - filament_type.segment_length)
    segment = int(np.argmax(extension))
    if extension[segment] >= filament_type.maximum_extension:
        raise InputError(
            f"{label}: segment {segment} is {lengths[segment]:.4g} nm long, outside the FENE potential's "
            f"{filament_type.segment_length:g} -/+ {filament_type.maximum_extension:g} nm."
        )
