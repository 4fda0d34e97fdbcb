"""Shapes of new filaments: straight ones, rings, draws from equilibrium and given ones, with what they are given."""

from dataclasses import replace
from typing import Any, TypedDict

import numpy as np

from ..errors import InputError
from ..units.quantities import (
    FORCE,
    LENGTH,
    finite_number,
    in_units_of,
    true_or_false,
    unit_vector,
    vector,
    whole_number,
)
from ..units.types import Indices, Scalar, Vector, Vectors
from .chain_type import ChainType, Points
from .filament import Filament
from .growth import Growth, check_growth
from .placement import check_shape, in_one_plane, joint_stiffnesses, planar_direction
from .rest_bends import RestBends, check_rest_bends, draw_bent_chain

MINIMUM_RING = 4
"""Segments that a ring has at least."""

_MOST_SEGMENTS = 10**8


def number_of_segments(segments: int, label: str) -> int:
    """The number of segments of a filament as an int; InputError if it is none, or more than a computer can hold."""
    number = whole_number(segments, 1, f"{label}: segments")
    if number > _MOST_SEGMENTS:
        raise InputError(f"{label}: segments must be at most {_MOST_SEGMENTS:.0e}, but is {number:.3g}.")
    return number


def straight(filament_type: ChainType, segments: int, start: Vector, direction: Vector, label: str) -> Points:
    """A straight filament with segments of rest length: without forces."""
    segments = number_of_segments(segments, label)
    start = vector(start, LENGTH, f"{label}: start")
    lengths = filament_type.straight_lengths(segments)
    # Equal ones without an error that adds up along the filament.
    if np.all(lengths == lengths[0]):
        distance = np.arange(segments + 1) * lengths[0]
    else:
        distance = np.concatenate([[0.0], np.cumsum(lengths)])
    nodes = start + distance[:, None] * unit_vector(direction, label)
    return nodes, filament_type.segment_kind.control_points(filament_type, nodes, label)


def given(
    filament_type: ChainType,
    positions: Vectors,
    label: str,
    tangents: Vectors | None = None,
    control_points: Vectors | None = None,
    closed: bool = False,
) -> Points:
    """A copy of given positions in nm, two nodes or more, and control points: see ``SegmentKind.control_points``."""
    positions = np.atleast_1d(in_units_of(positions, LENGTH, f"{label}: positions"))
    if positions.ndim != 2 or positions.shape[1] != 3:
        raise InputError(f"{label}: positions must have the shape (n, 3), but have {positions.shape}.")
    if len(positions) < 2:
        raise InputError(f"{label} needs at least two nodes (one segment), but has {len(positions)}.")
    if tangents is not None and control_points is not None:
        raise InputError(f"{label}: give either tangents or control_points, not both.")
    if true_or_false(closed, f"{label}: closed"):
        _number_of_ring(len(positions), label)
    nodes, kind = positions.copy(), filament_type.segment_kind
    return nodes, kind.control_points(filament_type, nodes, label, tangents, control_points, closed)


def ring(
    filament_type: ChainType,
    segments: int,
    temperature: float,
    center: Vector,
    normal: Vector,
    planar: bool,
    label: str,
) -> Points:
    """A ring without strains: a regular polygon, or a circle of beam elements."""
    segments = _number_of_ring(number_of_segments(segments, label), label)
    center, planar = vector(center, LENGTH, f"{label}: center"), true_or_false(planar, f"{label}: planar")
    axis = unit_vector(normal, label, "normal")
    return filament_type.segment_kind.ring(filament_type, segments, temperature, center, axis, planar)


def _number_of_ring(segments, label):
    if segments < MINIMUM_RING:
        raise InputError(f"{label}: a ring needs at least {MINIMUM_RING} segments, but has {segments}.")
    return segments


def drawn(
    filament_type: ChainType,
    segments: int,
    temperature: float,
    generator: np.random.Generator,
    start: Vector,
    direction: Vector | None,
    clamped: int | Indices,
    planar: bool,
    rest_bends: RestBends | None,
    label: str,
) -> Points:
    """A filament from the exact equilibrium of the free discrete chain."""
    segments = number_of_segments(segments, label)
    start = vector(start, LENGTH, f"{label}: start")
    planar = true_or_false(planar, f"{label}: planar")
    if direction is not None:
        direction = unit_vector(direction, label)
        direction = planar_direction(direction, label) if planar else direction
    if temperature == 0:
        raise InputError(f"{label}: an equilibrium draw needs a temperature above zero.")
    if rest_bends is not None:
        check_rest_bends(rest_bends, filament_type, segments - 1, planar, False, label)
        stiffnesses = joint_stiffnesses(filament_type, segments + 1, (), False)
        rest = rest_bends.components(filament_type.bending_model, segments - 1)
        return draw_bent_chain(filament_type, temperature, generator, start, direction, rest, stiffnesses), None
    return filament_type.segment_kind.draw(
        filament_type, segments, temperature, generator, start, direction, clamped, planar, label
    )


class FilamentOptions(TypedDict, total=False):
    """What any filament that is added to ``Filaments`` can be given by keywords.

    Parameters
    ----------
    clamped : sequence of int
        Nodes that do not move; negative numbers count from the end. One that is clamped alone is a hinge: see
        ``Filaments.add_straight``.
    clamped_tangents : sequence of int
        Of beam elements: clamped nodes whose tangents do not turn either. The filament is clamped exactly there.
    planar : bool
        The filament moves in a plane of constant z, as under a cover slip: its nodes keep their z, and no force or
        noise acts along z.
    propulsion : force
        F0 of self-propelled filaments: a force F0 t acts on every segment, half on either end, where t is its
        tangent, away from the first node; on beam elements, along their curves. With a negative F0 the filament
        moves with its first node in front. It is not conservative and has no energy.
    growth : Growth
        How the filament grows and shrinks at its ends. Its first node is its minus end.
    rest_bends : RestBends
        By how much the joints of a filament with twist are bent at rest: curved DNA.
    """

    clamped: int | Indices
    clamped_tangents: int | Indices
    planar: bool
    propulsion: Scalar
    growth: Growth | None
    rest_bends: RestBends | None


def new_filament(
    filament_type: ChainType,
    points: Points,
    label: str,
    closed: bool = False,
    clamped: int | Indices = (),
    clamped_tangents: int | Indices = (),
    planar: bool = False,
    propulsion: Scalar = 0.0,
    growth: Growth | None = None,
    rest_bends: RestBends | None = None,
) -> Filament:
    """A Filament with nodes and control points, and FilamentOptions.

    InputError if forces are not defined there, or the filament is not what it is said to be.
    """
    positions, control_points = points
    closed, planar = true_or_false(closed, f"{label}: closed"), true_or_false(planar, f"{label}: planar")
    if closed:
        _number_of_ring(len(positions), label)
    check_shape(filament_type, positions, label, closed)
    propulsion = finite_number(propulsion, FORCE, f"{label}: propulsion")
    length = filament_type.segment_length
    if planar:
        positions = in_one_plane(positions, length, label)
        if control_points is not None:
            both = in_one_plane(np.concatenate([positions, control_points]), length, f"{label}, with its tangents,")
            control_points = both[len(positions) :]
    held, held_tangents = filament_type.segment_kind.clamps(clamped, clamped_tangents, len(positions), label)
    spare = 0
    if growth is not None:
        spare = check_growth(growth, filament_type, len(positions) - 1, closed, held, label)
    filament = Filament(
        filament_type, positions, held, closed, planar, propulsion, control_points, held_tangents, growth, spare
    )
    if rest_bends is None:
        return filament
    check_rest_bends(rest_bends, filament_type, filament.bends, planar, growth is not None, label)
    return replace(filament, rest_bends=rest_bends)


def reserve_filament(
    filament_type: ChainType,
    label: str,
    growth: Growth,
    nucleation: Any,
    planar: bool,
    propulsion: Scalar,
) -> Filament:
    """A Filament that has not begun yet."""
    nodes = check_growth(growth, filament_type, None, False, (), label)
    place = np.zeros(3) if nucleation is None else nucleation.centre
    return Filament(
        filament_type,
        np.tile(place, (2, 1)),
        (),
        planar=true_or_false(planar, f"{label}: planar"),
        propulsion=finite_number(propulsion, FORCE, f"{label}: propulsion"),
        growth=growth,
        spare_nodes=nodes - 2,
        is_reserve=True,
        nucleation=nucleation,
    )
