"""Node positions of new filaments: straight ones, rings, draws from equilibrium and given ones, checked."""

import numpy as np

from ..errors import InputError
from ..mechanics.geometry import regular_polygon
from ..units.quantities import (
    FORCE,
    LENGTH,
    finite_number,
    in_units_of,
    shown,
    unit_vector,
    vector,
    whole_number,
)
from ..units.types import FloatArray, Indices, Scalar, Vector, Vectors
from .chain_type import ChainType
from .filament import Filament
from .placement import check_shape, clamped_nodes, in_one_plane, joint_stiffnesses, planar_direction

MINIMUM_RING = 4
"""Segments that a ring has at least."""

_MOST_SEGMENTS = 10**8


def number_of_segments(segments: int, label: str) -> int:
    """The number of segments of a filament as an int; InputError if it is none, or more than a computer can hold."""
    number = whole_number(segments, 1, f"{label}: segments")
    if number > _MOST_SEGMENTS:
        raise InputError(f"{label}: segments must be at most {_MOST_SEGMENTS:.0e}, but is {number:.3g}.")
    return number


def straight(filament_type: ChainType, segments: int, start: Vector, direction: Vector, label: str) -> FloatArray:
    """Positions (segments + 1, 3) in nm of a straight filament with segments of rest length: without forces."""
    segments = number_of_segments(segments, label)
    start = vector(start, LENGTH, f"{label}: start")
    lengths = filament_type.straight_lengths(segments)
    # Equal ones without an error that adds up along the filament.
    if np.all(lengths == lengths[0]):
        distance = np.arange(segments + 1) * lengths[0]
    else:
        distance = np.concatenate([[0.0], np.cumsum(lengths)])
    return start + distance[:, None] * unit_vector(direction, label)


def given(positions: Vectors, label: str) -> FloatArray:
    """A copy of given positions in nm; raise InputError unless they are those of two nodes or more."""
    positions = np.atleast_1d(in_units_of(positions, LENGTH, f"{label}: positions"))
    if positions.ndim != 2 or positions.shape[1] != 3:
        raise InputError(f"{label}: positions must have the shape (n, 3), but have {positions.shape}.")
    if len(positions) < 2:
        raise InputError(f"{label} needs at least two nodes (one segment), but has {len(positions)}.")
    return positions.copy()


def ring(filament_type: ChainType, segments: int, center: Vector, normal: Vector, label: str) -> FloatArray:
    """Positions (segments, 3) in nm of a regular polygon with segments of rest length."""
    segments = number_of_segments(segments, label)
    center = vector(center, LENGTH, f"{label}: center")
    return regular_polygon(segments, filament_type.segment_length, center, unit_vector(normal, label, "normal"))


def drawn(
    filament_type: ChainType,
    segments: int,
    temperature: float,
    generator: np.random.Generator,
    start: Vector,
    direction: Vector | None,
    clamped: int | Indices,
    planar: bool,
    label: str,
) -> FloatArray:
    """Positions (segments + 1, 3) in nm from the exact equilibrium of the free discrete chain."""
    segments = number_of_segments(segments, label)
    start = vector(start, LENGTH, f"{label}: start")
    planar = _flag(planar, f"{label}: planar")
    if direction is not None:
        direction = unit_vector(direction, label)
        direction = planar_direction(direction, label) if planar else direction
    if temperature == 0:
        raise InputError(f"{label}: an equilibrium draw needs a temperature above zero.")
    stiffnesses = joint_stiffnesses(filament_type, segments + 1, clamped_nodes(clamped, segments + 1, label))
    return filament_type.draw_chain(segments, temperature, generator, start, direction, planar, stiffnesses)


def new_filament(
    filament_type: ChainType,
    positions: FloatArray,
    clamped: int | Indices,
    label: str,
    closed: bool = False,
    planar: bool = False,
    propulsion: Scalar = 0.0,
) -> Filament:
    """A Filament with node positions (n, 3) in nm.

    Raises
    ------
    InputError
        If forces are not defined there, or the filament is not what it is said to be.
    """
    closed, planar = _flag(closed, f"{label}: closed"), _flag(planar, f"{label}: planar")
    if closed and len(positions) < MINIMUM_RING:
        raise InputError(f"{label}: a ring needs at least {MINIMUM_RING} segments, but has {len(positions)}.")
    check_shape(filament_type, positions, label, closed)
    if planar:
        positions = in_one_plane(positions, filament_type.segment_length, label)
    return Filament(
        filament_type,
        positions,
        clamped_nodes(clamped, len(positions), label),
        closed,
        planar,
        finite_number(propulsion, FORCE, f"{label}: propulsion"),
    )


def _flag(value, name):
    if not isinstance(value, (bool, np.bool_)):
        raise InputError(f"{name} must be True or False, but is {shown(value)}.")
    return bool(value)
