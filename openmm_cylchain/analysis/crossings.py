"""Crossings: segments that pass through each other between two configurations.

While the ends of two segments move on straight lines, the volume w . (p x q), which the vectors p and q along them span
with the vector w between their first ends, is a cubic polynomial of time. Where it changes its sign the segments lie in
one plane, and they cross there if they meet within their lengths. Where all stays in one plane, the volume is zero, and
segments cross where an end of one goes through the inside of the other. Filaments with contacts that hold do not cross.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from itertools import product

import numpy as np
import numpy.typing as npt
import scipy

from ..errors import InputError
from ..filaments.collection import FilamentCollection
from ..filaments.refusals import refuse_beams, refuse_growth
from ..mechanics.geometry import cross
from ..units.quantities import LENGTH, in_units_of, positive, shown
from ..units.types import BoolArray, BoxVectors, FloatArray, IntArray, Scalar, Vectors

# Of the width of a bracket around the time of a crossing: 2^-52.
_BISECTIONS = 52

# Segments stay in one plane if no vector between their ends leaves it by more than this, over the longest one.
_PLANAR = 1e-9


@dataclass(frozen=True)
class Crossings:
    """Crossings in the order of time.

    Attributes
    ----------
    filaments, segments : (crossings, 2) int arrays
        Which segments of which filaments.
    fractions : (crossings, 2) array
        Where on the two segments, from 0 at the first node to 1 at the last.
    times : (crossings,) array
        When, from 0 in the first configuration to 1 in the second.
    """

    filaments: IntArray
    segments: IntArray
    fractions: FloatArray
    times: FloatArray

    def __len__(self) -> int:
        return len(self.times)


def find_crossings(
    chains: FilamentCollection | Iterable[npt.ArrayLike],
    start: Vectors,
    end: Vectors,
    box_vectors: BoxVectors | None = None,
) -> Crossings:
    """Crossings of segments of different chains, or of one but not neighbours, on the way from start to end.

    A pair that crosses and goes back is found twice. One that touches is not found. In a plane, each end that goes
    through a segment is one crossing; a joint is an end of one of its segments. The number of pairs that are looked at
    is proportional to the number of segments.

    Parameters
    ----------
    chains : Filaments, or sequence of int arrays
        Particle indices of the nodes of every chain. Those of a ring end with its first node once more.
    start, end : (particles, 3) length
        Configurations between which each node moves on a straight line: not wrapped into a periodic box.
    box_vectors : three (3,) lengths, optional
        Of a periodic box, all images in which are looked at.

    Returns
    -------
    Crossings

    Raises
    ------
    InputError
        For chains that are none, positions of another shape, or a box that is narrower than segments are long.
    """
    segments = _Segments(chains)
    start, end = segments.check(start, "start"), segments.check(end, "end")
    margin = 2.0 * segments.greatest_displacement(start, end)
    return segments.crossings(segments.pairs_within(margin, start, _box(box_vectors)), start, end)


class CrossingCounter:
    """Counts crossings along a trajectory, configuration by configuration.

    It keeps the pairs that are close, and looks for others when nodes have moved by half of the margin.

    Parameters
    ----------
    chains : Filaments, or sequence of int arrays
        Particle indices of the nodes of every chain. Those of a ring end with its first node once more.
    positions : (particles, 3) length
        The first configuration.
    box_vectors : three (3,) lengths, optional
        Of a periodic box, which stays as it is.
    margin : length, optional
        Half of the mean segment length if not given. It matters for speed alone.

    Examples
    --------
    >>> counter = CrossingCounter(filaments, positions)  # doctest: +SKIP
    >>> simulation.step(1)  # doctest: +SKIP
    >>> crossings = counter.update(context.getState(positions=True).getPositions(asNumpy=True))  # doctest: +SKIP
    """

    def __init__(
        self,
        chains: FilamentCollection | Iterable[npt.ArrayLike],
        positions: Vectors,
        box_vectors: BoxVectors | None = None,
        margin: Scalar | None = None,
    ) -> None:
        self._segments = _Segments(chains)
        self._box = _box(box_vectors)
        self._positions = self._segments.check(positions, "positions")
        lengths = np.linalg.norm(self._segments.vectors(self._positions), axis=1)
        self._margin = 0.5 * float(lengths.mean()) if margin is None else positive(margin, LENGTH, "margin")
        self._look_around(self._margin)
        self._count = 0

    def _look_around(self, margin):
        self._reach = margin
        self._pairs_at = self._positions
        self._pairs = self._segments.pairs_within(margin, self._positions, self._box)

    @property
    def count(self) -> int:
        """Number of crossings so far."""
        return self._count

    def update(self, positions: Vectors) -> Crossings:
        """Go on to the next configuration; return the crossings on the way, with times from 0 to 1."""
        positions = self._segments.check(positions, "positions")
        if 2.0 * self._segments.greatest_displacement(self._pairs_at, positions) > self._reach:
            step = 2.0 * self._segments.greatest_displacement(self._positions, positions)
            self._look_around(max(self._margin, step))
        crossings = self._segments.crossings(self._pairs, self._positions, positions)
        self._positions = positions
        self._count += len(crossings)
        return crossings


@dataclass(frozen=True)
class Pairs:
    """Pairs of points by their numbers, and the vectors by which the second is shifted to the image in question."""

    first: IntArray
    second: IntArray
    shift: FloatArray

    def where(self, wanted: BoolArray) -> Pairs:
        """Those that are wanted."""
        return Pairs(self.first[wanted], self.second[wanted], self.shift[wanted])


class _Segments:
    # The segments of all chains, one after another.

    def __init__(self, chains):
        wrong = "chains must be int arrays, one for each chain, with the indices of two nodes or more."
        own = _chains_of(chains) if hasattr(type(chains), "node_indices") else chains
        try:
            chains = [np.asarray(chain) for chain in own]
        except (TypeError, ValueError):
            raise InputError(wrong) from None
        if not chains or any(c.ndim != 1 or len(c) < 2 or c.dtype.kind not in "iu" for c in chains):
            raise InputError(wrong)
        self._minus = np.concatenate([chain[:-1] for chain in chains])
        self._plus = np.concatenate([chain[1:] for chain in chains])
        self._chain = np.repeat(np.arange(len(chains)), [len(chain) - 1 for chain in chains])
        self._number = np.concatenate([np.arange(len(chain) - 1) for chain in chains])
        # In a ring, the first segment and the last are neighbours, too.
        self._around = np.array([len(chain) - 2 if chain[0] == chain[-1] else -1 for chain in chains])

    def check(self, positions, name):
        positions = np.asarray(in_units_of(positions, LENGTH, name))
        count = max(self._minus.max(), self._plus.max()) + 1
        if positions.ndim != 2 or positions.shape[1] != 3 or len(positions) < count:
            raise InputError(f"{name} must have the shape ({count} or more, 3), but have {positions.shape}.")
        return np.array(positions)

    def vectors(self, positions):
        return positions[self._plus] - positions[self._minus]

    def greatest_displacement(self, start, end):
        squares = [np.sum((end[nodes] - start[nodes]) ** 2, axis=1).max() for nodes in (self._minus, self._plus)]
        return float(np.sqrt(max(squares)))

    def pairs_within(self, margin, positions, box):
        """Pairs whose segments are at most ``margin`` apart, neighbours in a chain excepted."""
        vectors = self.vectors(positions)
        starts = positions[self._minus]
        radius = float(np.linalg.norm(vectors, axis=1).max()) + margin
        # Rounding must not lose a pair at the very end of the radius.
        pairs = pairs_of_points(starts + 0.5 * vectors, radius * (1.0 + 1e-9), box)
        same_chain = self._chain[pairs.first] == self._chain[pairs.second]
        apart = np.abs(self._number[pairs.first] - self._number[pairs.second])
        close = (apart <= 1) | (apart == self._around[self._chain[pairs.first]])
        pairs = pairs.where(~(same_chain & close & np.all(pairs.shift == 0.0, axis=1)))
        between = starts[pairs.second] + pairs.shift - starts[pairs.first]
        distances = segment_distances(vectors[pairs.first], vectors[pairs.second], between)
        return pairs.where(distances <= margin * (1.0 + 1e-9))

    def crossings(self, pairs, start, end):
        geometry = [self._geometry(pairs, positions) for positions in (start, end)]
        volume = _volume_polynomial(*geometry)
        planar, normals = _in_one_plane(volume, *geometry)
        index, times = _sign_changes(*volume)
        p, q, w = ((1.0 - times[:, None]) * a[index] + times[:, None] * b[index] for a, b in zip(*geometry))
        fractions = _meeting_place(p, q, w)
        if len(planar):
            in_space = ~np.isin(index, planar)
            found = [(index[in_space], times[in_space], fractions[in_space])]
            inside = [tuple(vectors[planar] for vectors in one) for one in geometry]
            for side in (0, 1):
                for place in (0.0, 1.0):
                    number, when, where = _passages_of_end(side, place, normals, *inside)
                    counts = self._is_counted(pairs, planar[number], side, place)
                    found.append((planar[number[counts]], when[counts], where[counts]))
            index, times, fractions = (np.concatenate(column) for column in zip(*found))
        met = np.all((fractions >= 0.0) & (fractions <= 1.0), axis=1)
        met = np.flatnonzero(met)[np.argsort(times[met], kind="stable")]
        both = np.stack([pairs.first[index[met]], pairs.second[index[met]]], axis=1)
        return Crossings(self._chain[both], self._number[both], fractions[met], times[met])

    def _is_counted(self, pairs, index, side, place):
        # A joint goes through with the segment that ends there, unless that one is a neighbour of the other.
        if place == 1.0:
            return np.full(len(index), True)
        own, other = (pairs.first[index], pairs.second[index])[:: 1 - 2 * side]
        chain, around = self._chain[own], self._around[self._chain[own]]
        before = np.where(self._number[own] > 0, self._number[own] - 1, around)
        apart = np.abs(before - self._number[other])
        same = (chain == self._chain[other]) & np.all(pairs.shift[index] == 0.0, axis=1)
        return (before < 0) | (same & ((apart <= 1) | (apart == around)))

    def _geometry(self, pairs, positions):
        vectors, starts = self.vectors(positions), positions[self._minus]
        return vectors[pairs.first], vectors[pairs.second], starts[pairs.second] + pairs.shift - starts[pairs.first]


def _chains_of(filaments):
    refuse_beams(filaments, "the search for crossings")
    refuse_growth(filaments, "the search for crossings, which follows nodes by their numbers,")
    pairs = zip(filaments, filaments.node_indices)
    return [np.append(nodes, nodes[0]) if filament.closed else nodes for filament, nodes in pairs]


def _box(box_vectors):
    if box_vectors is None:
        return None
    try:
        edges = list(box_vectors)
    except TypeError:
        edges = []
    box = np.asarray(in_units_of(edges, LENGTH, "box_vectors"))
    if box.shape != (3, 3):
        raise InputError(f"box_vectors must be three vectors, but are {shown(box_vectors)}.")
    if not abs(np.linalg.det(box)) > 0.0:
        raise InputError("box_vectors must span a volume.")
    return box


def pairs_of_points(points: FloatArray, radius: float, box: FloatArray | None) -> Pairs:
    """All pairs within a radius, with every image of a periodic box: each once, the lower number first."""
    if box is None:
        pairs = scipy.spatial.cKDTree(points).query_pairs(radius, output_type="ndarray")
        return Pairs(pairs[:, 0], pairs[:, 1], np.zeros((len(pairs), 3)))
    inverse = np.linalg.inv(box)
    reach = radius * np.linalg.norm(inverse, axis=0)
    if np.any(reach > 1.0):
        raise InputError(
            f"The periodic box is {np.min(1.0 / np.linalg.norm(inverse, axis=0)):g} nm wide, but segments reach "
            f"{radius:g} nm: longer than the box, or they move too far."
        )
    places = points @ inverse
    cells = np.floor(places)
    places -= cells
    copies, shifts = [np.arange(len(points))], [np.zeros((len(points), 3))]
    for cell in product((-1.0, 0.0, 1.0), repeat=3):
        image = places + cell
        near = np.flatnonzero(np.all((image >= -reach) & (image <= 1.0 + reach), axis=1))
        if any(cell):
            copies.append(near)
            shifts.append(np.broadcast_to(cell, (len(near), 3)))
    copy, shift = np.concatenate(copies), np.concatenate(shifts)
    found = scipy.spatial.cKDTree((places[copy] + shift) @ box).query_pairs(radius, output_type="ndarray")
    # Originals come first among the points of the tree, and query_pairs puts the lower number first, but a pair of an
    # original with an image of a lower one comes again as an image of the original with the lower one.
    found = found[(found[:, 0] < len(points)) & (copy[found[:, 0]] < copy[found[:, 1]])]
    first, second = copy[found[:, 0]], copy[found[:, 1]]
    return Pairs(first, second, (shift[found[:, 1]] - cells[second] + cells[first]) @ box)


def segment_distances(p: FloatArray, q: FloatArray, w: FloatArray) -> FloatArray:
    """Smallest distances (pairs,) of segments along p and q (pairs, 3), with the vectors w from the first ends of p to
    those of q."""
    pp, qq, pq = _dot(p, p), _dot(q, q), _dot(p, q)
    pw, qw = _dot(p, w), _dot(q, w)
    tiny = np.finfo(float).tiny
    # The distance is convex in the place on the first segment, so its place on the line may be clipped, and the rest
    # follows in turn.
    determinant = pp * qq - pq**2
    s = np.where(determinant > 1e-12 * pp * qq, (pw * qq - qw * pq) / np.maximum(determinant, tiny), 0.0)
    s = np.clip(s, 0.0, 1.0)
    t = np.clip((s * pq - qw) / np.maximum(qq, tiny), 0.0, 1.0)
    s = np.clip((t * pq + pw) / np.maximum(pp, tiny), 0.0, 1.0)
    return np.linalg.norm(w + t[:, None] * q - s[:, None] * p, axis=1)


def _dot(a, b):
    return np.einsum("ij,ij->i", a, b)


def _volume_polynomial(start, end):
    # Coefficients of w . (p x q), the lowest first, for p, q and w that change at constant speed.
    (p, q, w), (dp, dq, dw) = start, (b - a for a, b in zip(start, end))
    normal = cross(p, q)
    first, second = cross(dp, q) + cross(p, dq), cross(dp, dq)
    return (
        _dot(w, normal),
        _dot(dw, normal) + _dot(w, first),
        _dot(dw, first) + _dot(w, second),
        _dot(dw, second),
    )


def _in_one_plane(volume, start, end):
    # Numbers of the pairs that stay in one plane on their way, and unit vectors across it.
    vectors = np.stack([*start, *end], axis=1)
    squares = np.sum(vectors**2, axis=2)
    length = np.sqrt(squares.max(axis=1))
    flat = np.flatnonzero(np.max(np.abs(volume), axis=0) <= 40.0 * _PLANAR * length**3)
    vectors, length = vectors[flat], length[flat]
    longest = vectors[np.arange(len(flat)), squares[flat].argmax(axis=1)]
    across = cross(longest[:, None], vectors)
    areas = np.linalg.norm(across, axis=2)
    widest = areas.argmax(axis=1)
    areas = areas[np.arange(len(flat)), widest]
    with np.errstate(all="ignore"):
        normals = across[np.arange(len(flat)), widest] / areas[:, None]
    off = np.abs(np.einsum("ik,ijk->ij", normals, vectors)).max(axis=1, initial=0.0)
    kept = (areas > _PLANAR * length**2) & (off <= _PLANAR * length)
    return flat[kept], normals[kept]


def _passages_of_end(side, place, normals, start, end):
    # When an end of the first segment (side 0) or of the second one (side 1) goes through the line of the other, in a
    # plane: numbers of the pairs, times, and fractions along both.
    along = [one[1 - side] for one in (start, end)]
    ends = [place * p - w if side == 0 else w + place * q for p, q, w in (start, end)]
    (a, b), (da, db) = (along[0], ends[0]), (along[1] - along[0], ends[1] - ends[0])
    c0, c1, c2 = cross(a, b), cross(a, db) + cross(da, b), cross(da, db)
    index, times = _sign_changes(_dot(normals, c0), _dot(normals, c1), _dot(normals, c2), np.zeros(len(normals)))
    line, r = a[index] + times[:, None] * da[index], b[index] + times[:, None] * db[index]
    foot = _dot(line, r) / _dot(line, line)
    fractions = np.stack([np.full(len(foot), place), foot], axis=1)
    return index, times, fractions if side == 0 else fractions[:, ::-1]


def _sign_changes(c0, c1, c2, c3):
    # Numbers of the polynomials that change their sign between 0 and 1, and when. Zero at the ends counts as positive,
    # so that a change on the border of two intervals is found in one of them.
    def value(which, t):
        return c0[which] + t * (c1[which] + t * (c2[which] + t * c3[which]))

    with np.errstate(all="ignore"):
        root = np.sqrt(c2**2 - 3.0 * c1 * c3)
        larger = -(c2 + np.copysign(root, c2))
        turns = np.stack([larger / (3.0 * c3), c1 / larger], axis=1)
    turns = np.sort(np.where((turns > 0.0) & (turns < 1.0), turns, 0.0), axis=1)
    borders = np.concatenate([np.zeros((len(c0), 1)), turns, np.ones((len(c0), 1))], axis=1)
    values = value(np.arange(len(c0)), borders.T).T
    positive_at = values >= 0.0
    # A turn that touches zero without passing it, but for rounding, has the sign from before.
    touching = np.abs(values) <= 1e-14 * (np.abs(c0) + np.abs(c1) + np.abs(c2) + np.abs(c3))[:, None]
    for turn in (1, 2):
        positive_at[:, turn] = np.where(touching[:, turn], positive_at[:, turn - 1], positive_at[:, turn])
    which, part = np.nonzero(positive_at[:, 1:] != positive_at[:, :-1])
    low, high, rising = borders[which, part], borders[which, part + 1], positive_at[which, part + 1]
    for _ in range(_BISECTIONS):
        middle = 0.5 * (low + high)
        above = (value(which, middle) >= 0.0) == rising
        low, high = np.where(above, low, middle), np.where(above, middle, high)
    return which, 0.5 * (low + high)


def _meeting_place(p, q, w):
    # Where two lines in a plane meet, in units of p and q: a p - b q = w. Parallel ones do not.
    normal = cross(p, q)
    square = _dot(normal, normal)
    with np.errstate(all="ignore"):
        a, b = _dot(cross(w, q), normal) / square, _dot(cross(w, p), normal) / square
    return np.nan_to_num(np.stack([a, b], axis=1), nan=-1.0)
