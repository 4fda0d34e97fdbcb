"""Writhe and linking number of curves that are straight between nodes."""

from __future__ import annotations

import numpy as np

from ..errors import InputError
from ..units.quantities import LENGTH, in_units_of, true_or_false
from ..units.types import FloatArray, Vectors

_PAIRS = 2**20
"""Of segments that are looked at together."""


def writhe(nodes: Vectors, closed: bool = True) -> float:
    """Writhe Wr of a curve that is straight between its nodes; exact.

    The Gauss integral ``Wr = (1/4 pi) int int (dx times dy).(x - y)/|x - y|^3`` of the curve with itself, as a sum of
    solid angles over pairs of segments (Klenin and Langowski, Biopolymers 2000, 54, 307). A right-handed crossing of a
    curve with itself counts +1 where it is seen from. The time is that of all pairs.

    Parameters
    ----------
    nodes : (n, 3) length
        At least two. They must not be wrapped into a periodic box.
    closed : bool
        Whether a last segment leads back to the first node. The integral over an open curve is no topological number.

    Raises
    ------
    InputError
        For an array of another shape, or numbers that are not finite.
    """
    nodes, closed = _curve(nodes, "nodes"), true_or_false(closed, "closed")
    segments = _segments(nodes, closed)
    # Neighbours lie in one plane, and add nothing.
    return _gauss_integral(segments, segments)


def linking_number(first: Vectors, second: Vectors) -> float:
    """Linking number Lk of two closed curves that are straight between their nodes: a whole number, to rounding.

    Parameters
    ----------
    first, second : (n, 3) length
        Nodes of each, in order. A last segment leads back to the first node.

    Raises
    ------
    InputError
        For arrays of another shape, or numbers that are not finite.
    """
    one, other = _curve(first, "first"), _curve(second, "second")
    return _gauss_integral(_segments(one, True), _segments(other, True))


def _curve(nodes, name):
    nodes = np.asarray(in_units_of(nodes, LENGTH, name))
    if nodes.ndim != 2 or nodes.shape[-1] != 3 or len(nodes) < 2:
        raise InputError(f"{name} must have the shape (n, 3) with at least two nodes, but have {nodes.shape}.")
    return nodes


def _segments(nodes, closed):
    return (nodes, np.roll(nodes, -1, axis=0)) if closed else (nodes[:-1], nodes[1:])


def _gauss_integral(one, other):
    # Over all pairs of segments of two curves, which are given by where they begin and end; over 4 pi.
    start, end = one
    total, rows = 0.0, max(1, _PAIRS // len(other[0]))
    for first in range(0, len(start), rows):
        own = slice(first, first + rows)
        total += float(np.sum(_solid_angles(start[own], end[own], *other)))
    return total / (4.0 * np.pi)


def _solid_angles(start: FloatArray, end: FloatArray, other_start: FloatArray, other_end: FloatArray) -> FloatArray:
    # The solid angle of the parallelogram that x - y covers, as that of two triangles.
    corners = [
        start[:, None] - other_start,
        end[:, None] - other_start,
        end[:, None] - other_end,
        start[:, None] - other_end,
    ]
    return -(_solid_angle(*corners[:3]) + _solid_angle(corners[0], *corners[2:]))


def _solid_angle(a, b, c):
    # Van Oosterom and Strackee, IEEE Trans. Biomed. Eng. 1983, 30, 125.
    def dot(v, w):
        return np.einsum("...k,...k->...", v, w)

    lengths = [np.sqrt(dot(v, v)) for v in (a, b, c)]
    volume = dot(a, np.cross(b, c))
    scale = lengths[0] * lengths[1] * lengths[2]
    rest = scale + dot(a, b) * lengths[2] + dot(b, c) * lengths[0] + dot(c, a) * lengths[1]
    # Segments in one plane have none, though rounding may say otherwise where one of them begins at the other.
    flat = np.abs(volume) <= 1e-14 * np.max(lengths, axis=0) ** 3
    return np.where(flat, 0.0, 2.0 * np.arctan2(volume, np.where(flat, 1.0, rest)))
