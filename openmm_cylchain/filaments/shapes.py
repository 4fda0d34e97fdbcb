"""Node positions of new filaments: straight ones, rings, draws from equilibrium and given ones, checked."""

import numpy as np

from ..beams.curve import control_points_of, natural_tangents
from ..beams.equilibrium import draw_beam
from ..beams.rings import circle
from ..errors import InputError
from ..mechanics.geometry import regular_polygon
from ..units.quantities import (
    DIMENSIONLESS,
    FORCE,
    LENGTH,
    finite_number,
    in_units_of,
    shown,
    thermal_energy,
    unit_vector,
    vector,
    whole_number,
)
from ..units.types import FloatArray, Indices, Scalar, Vector, Vectors
from .chain_type import ChainType
from .filament import Filament
from .placement import check_shape, clamped_nodes, in_one_plane, joint_stiffnesses, named_nodes, planar_direction

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
    segments = _number_of_ring(number_of_segments(segments, label), label)
    center = vector(center, LENGTH, f"{label}: center")
    return regular_polygon(segments, filament_type.segment_length, center, unit_vector(normal, label, "normal"))


def beam_ring(
    filament_type: ChainType,
    elements: int,
    temperature: float,
    center: Vector,
    normal: Vector,
    planar: bool,
    label: str,
) -> tuple[FloatArray, FloatArray]:
    """Nodes and control points, (elements, 3) in nm each, of a circle of beam elements without strains."""
    elements = _number_of_ring(number_of_segments(elements, label), label)
    center = vector(center, LENGTH, f"{label}: center")
    element = filament_type.beam_element(temperature, _flag(planar, f"{label}: planar"))
    return circle(element, elements, center, unit_vector(normal, label, "normal"))


def _number_of_ring(segments, label):
    if segments < MINIMUM_RING:
        raise InputError(f"{label}: a ring needs at least {MINIMUM_RING} segments, but has {segments}.")
    return segments


def beam_control_points(
    filament_type: ChainType,
    positions: FloatArray,
    tangents: Vectors | None,
    label: str,
    closed: bool = False,
) -> FloatArray | None:
    """Control points (n, 3) in nm of nodes with tangents, which are normalised; None if segments are straight.

    Tangents that are not given are those of the natural cubic spline through the nodes, or of the periodic one of a
    ring.
    """
    if not filament_type.has_beam_elements:
        if tangents is not None:
            raise InputError(f"{label}: tangents belong to nodes of beam elements; its segments are straight.")
        return None
    if tangents is None:
        return control_points_of(positions, natural_tangents(positions, closed), filament_type.segment_length)
    tangents = np.asarray(in_units_of(tangents, DIMENSIONLESS, f"{label}: tangents"))
    if tangents.shape != positions.shape:
        raise InputError(f"{label}: tangents must have the shape {positions.shape}, but have {tangents.shape}.")
    lengths = np.linalg.norm(tangents, axis=1, keepdims=True)
    if np.any(lengths == 0.0):
        raise InputError(f"{label}: the tangent of node {int(np.argmin(lengths))} is zero.")
    return control_points_of(positions, tangents / lengths, filament_type.segment_length)


def given_control_points(
    filament_type: ChainType, positions: FloatArray, tangents: Vectors | None, control_points: Vectors, label: str
) -> FloatArray:
    """Control points (n, 3) in nm that are given in place of tangents."""
    if tangents is not None:
        raise InputError(f"{label}: give either tangents or control_points, not both.")
    if not filament_type.has_beam_elements:
        raise InputError(f"{label}: control_points belong to nodes of beam elements; its segments are straight.")
    controls = np.array(in_units_of(control_points, LENGTH, f"{label}: control_points"))
    if controls.shape != positions.shape:
        raise InputError(f"{label}: control_points must have the shape {positions.shape}, but have {controls.shape}.")
    apart = np.linalg.norm(controls - positions, axis=1)
    if not np.all(apart > 0.0):
        raise InputError(f"{label}: the control point of node {int(np.argmin(apart))} is at the node.")
    return controls


def drawn_beam(
    filament_type: ChainType,
    segments: int,
    temperature: float,
    generator: np.random.Generator,
    start: Vector,
    direction: Vector | None,
    planar: bool,
    label: str,
) -> tuple[FloatArray, FloatArray]:
    """Nodes and control points, (segments + 1, 3) in nm each, from the equilibrium of a free chain of beam elements."""
    count, origin, first_tangent, flat = _of_draw(segments, temperature, start, direction, planar, label)
    element = filament_type.beam_element(temperature, flat)
    try:
        return draw_beam(element, count, thermal_energy(temperature), generator, origin, first_tangent, flat)
    except InputError as error:
        raise InputError(f"{label}: {error}") from None


def _of_draw(segments, temperature, start, direction, planar, label):
    segments = number_of_segments(segments, label)
    start = vector(start, LENGTH, f"{label}: start")
    planar = _flag(planar, f"{label}: planar")
    if direction is not None:
        direction = unit_vector(direction, label)
        direction = planar_direction(direction, label) if planar else direction
    if temperature == 0:
        raise InputError(f"{label}: an equilibrium draw needs a temperature above zero.")
    return segments, start, direction, planar


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
    count, origin, first_tangent, flat = _of_draw(segments, temperature, start, direction, planar, label)
    stiffnesses = joint_stiffnesses(filament_type, count + 1, clamped_nodes(clamped, count + 1, label))
    return filament_type.draw_chain(count, temperature, generator, origin, first_tangent, flat, stiffnesses)


def new_filament(
    filament_type: ChainType,
    positions: FloatArray,
    clamped: int | Indices,
    label: str,
    closed: bool = False,
    planar: bool = False,
    propulsion: Scalar = 0.0,
    control_points: FloatArray | None = None,
    clamped_tangents: int | Indices = (),
) -> Filament:
    """A Filament with node positions (n, 3) in nm, and control points if it has beam elements.

    Raises
    ------
    InputError
        If forces are not defined there, or the filament is not what it is said to be.
    """
    closed, planar = _flag(closed, f"{label}: closed"), _flag(planar, f"{label}: planar")
    if closed:
        _number_of_ring(len(positions), label)
    check_shape(filament_type, positions, label, closed)
    propulsion = finite_number(propulsion, FORCE, f"{label}: propulsion")
    if planar:
        positions = in_one_plane(positions, filament_type.segment_length, label)
    if control_points is None:
        clamped = clamped_nodes(clamped, len(positions), label)
        if np.size(np.asarray(clamped_tangents, dtype=object)):
            raise InputError(f"{label}: clamped_tangents are those of beam elements; clamp two neighbouring nodes.")
        return Filament(filament_type, positions, clamped, closed, planar, propulsion)
    if planar:
        control_points = _in_plane_of_nodes(control_points, positions, filament_type.segment_length, label)
    held, held_tangents = clamped_beam(clamped, clamped_tangents, len(positions), label)
    return Filament(filament_type, positions, held, closed, planar, propulsion, control_points, held_tangents)


def clamped_beam(
    clamped: int | Indices, tangents: int | Indices, nodes: int, label: str
) -> tuple[tuple[int, ...], tuple[int, ...]]:
    """Clamped nodes of beam elements, and those whose tangents are clamped, too; InputError if they cannot be."""
    clamped = named_nodes(clamped, nodes, f"{label}: clamped")
    tangents = named_nodes(tangents, nodes, f"{label}: clamped_tangents")
    if len(tangents) == nodes:
        raise InputError(f"{label} has all of its nodes and tangents clamped: leave at least one free to move.")
    for node in tangents:
        if node not in clamped:
            raise InputError(f"{label}: the tangent of node {node} is clamped, but the node is not: clamp it, too.")
    return clamped, tangents


def _in_plane_of_nodes(control_points, positions, length, label):
    both = in_one_plane(np.concatenate([positions, control_points]), length, f"{label}, with its tangents,")
    return both[len(positions) :]


def _flag(value, name):
    if not isinstance(value, (bool, np.bool_)):
        raise InputError(f"{name} must be True or False, but is {shown(value)}.")
    return bool(value)
