"""Planar filaments that lie across each other: nothing in their plane takes them apart."""

from dataclasses import dataclass

import numpy as np

from ..filaments.collection import FilamentCollection
from ..units.types import FloatArray


@dataclass(frozen=True)
class PlanarCrossing:
    """Two segments of planar filaments that cross: the numbers of the filaments and of the segments, from 0."""

    filament: int
    segment: int
    other_filament: int
    other_segment: int


class PlanarSegments:
    """Segments of planar filaments that are placed one after the other.

    In a box, vectors (3, 3) in nm, nearest images are looked at.
    """

    def __init__(self, box: FloatArray | None = None) -> None:
        self._box = box
        self._inverse = None if box is None else np.linalg.inv(box)
        self._starts, self._vectors = np.zeros((0, 3)), np.zeros((0, 3))
        self._numbers: list[tuple[int, int]] = []

    def add(self, number: int, nodes: FloatArray, closed: bool) -> None:
        """Add the segments of the filament of a number, between nodes (n, 3) in nm."""
        starts, vectors = _segments(nodes, closed)
        self._starts, self._vectors = np.concatenate([self._starts, starts]), np.concatenate([self._vectors, vectors])
        self._numbers += [(number, segment) for segment in range(len(starts))]

    def crossing(self, number: int, nodes: FloatArray, closed: bool) -> PlanarCrossing | None:
        """The first segment of a filament, if any, that crosses another one of it or one of those that are there."""
        starts, vectors = _segments(nodes, closed)
        for segment, (start, vector) in enumerate(zip(starts, vectors)):
            found = self._crossed(start, vector, self._starts, self._vectors)
            if len(found):
                there, one = self._numbers[found[0]]
                return PlanarCrossing(there, one, number, segment)
            for other in segment + 1 + self._crossed(start, vector, starts[segment + 1 :], vectors[segment + 1 :]):
                if not _are_neighbors(segment, other, len(starts), closed):
                    return PlanarCrossing(number, segment, number, other)
        return None

    def _crossed(self, start, p, starts, q):
        between = starts - start
        if self._inverse is not None:
            between = between - np.round((between + 0.5 * (q - p)) @ self._inverse) @ self._box
        # start + s p = other start + t q, in x and y.
        determinant = _cross(p, q)
        inner = determinant != 0.0
        safe = np.where(inner, determinant, 1.0)
        s, t = _cross(between, q) / safe, _cross(between, p) / safe
        return np.flatnonzero(inner & (np.abs(between[:, 2]) < 1e-6) & (s > 0.0) & (s < 1.0) & (t > 0.0) & (t < 1.0))


def find_planar_crossing(
    filaments: FilamentCollection, box: FloatArray | None, positions: FloatArray | None = None
) -> PlanarCrossing | None:
    """Two segments, if any, that cross each other in one plane where filaments are planar.

    They are looked at as they were added, or at ``positions`` (particles, 3) in nm of their System.
    """
    segments = PlanarSegments(box)
    for number, filament in enumerate(filaments):
        if filament.planar:
            nodes = filament.positions
            if positions is not None:
                nodes = positions[filaments.node_indices[number][: len(nodes)]]
            own = number, nodes, filament.closed
            found = segments.crossing(*own)
            if found is not None:
                return found
            segments.add(*own)
    return None


def _segments(nodes, closed):
    ends = np.roll(nodes, -1, axis=0)
    return (nodes, ends - nodes) if closed else (nodes[:-1], (ends - nodes)[:-1])


def _cross(a, b):
    return a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]


def _are_neighbors(first, second, segments, closed):
    apart = abs(first - second)
    return apart == 1 or (closed and apart == segments - 1)
