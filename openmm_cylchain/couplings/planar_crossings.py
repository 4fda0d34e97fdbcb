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


def find_planar_crossing(filaments: FilamentCollection, box: FloatArray | None) -> PlanarCrossing | None:
    """The first two segments, if any, that cross each other in one plane where filaments are planar.

    Filaments are where they were added; in a box, vectors (3, 3) in nm, nearest images are looked at.
    """
    starts, vectors, numbers = [], [], []
    for number, filament in enumerate(filaments):
        if filament.planar:
            nodes = filament.positions
            ends = np.roll(nodes, -1, axis=0)[: filament.segments]
            starts.append(nodes[: filament.segments])
            vectors.append(ends - starts[-1])
            numbers += [(number, segment, filament) for segment in range(filament.segments)]
    if not starts:
        return None
    start, vector = np.concatenate(starts), np.concatenate(vectors)
    middle, inverse = start + 0.5 * vector, None if box is None else np.linalg.inv(box)
    for index in range(len(start) - 1):
        others = slice(index + 1, None)
        between = start[others] - start[index]
        if inverse is not None:
            between = between - np.round((middle[others] - middle[index]) @ inverse) @ box
        p, q = vector[index], vector[others]
        # start + s p = other start + t q, in x and y.
        determinant = _cross(p, q)
        inner = determinant != 0.0
        safe = np.where(inner, determinant, 1.0)
        s, t = _cross(between, q) / safe, _cross(between, p) / safe
        found = inner & (np.abs(between[:, 2]) < 1e-6) & (s > 0.0) & (s < 1.0) & (t > 0.0) & (t < 1.0)
        for place in np.flatnonzero(found):
            (first, segment, filament), (second, other, _) = numbers[index], numbers[index + 1 + place]
            if first != second or not _are_neighbors(segment, other, filament):
                return PlanarCrossing(first, segment, second, other)
    return None


def _cross(a, b):
    return a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]


def _are_neighbors(first, second, filament):
    apart = abs(first - second)
    return apart == 1 or (filament.closed and apart == filament.segments - 1)
