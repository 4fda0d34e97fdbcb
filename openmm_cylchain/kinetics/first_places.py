"""Where linkers are bound to begin with: places drawn along filaments, or along what is within reach of anchors."""

from collections.abc import Sequence

import numpy as np

from ..beams.curve import curve_points, place_weights
from ..errors import InputError
from ..filaments.filament import Filament
from ..mechanics.geometry import to_nearest_images, unrolled
from ..units.types import FloatArray, IntArray
from .crosslinker import Crosslinker
from .hand import Hand

_MOST_SITES = 1e9
"""Of a filament: more of them are refused when a Context is made."""

_CANDIDATES = 200
"""Places of which that of an anchored linker is drawn."""

_MOST_ROUNDS = 1000
"""In which places are drawn that are in range."""

_PIECES = 16
"""Straight ones, in place of the curve of a beam element where what is within reach is looked for."""

Places = tuple[IntArray, FloatArray]
"""Numbers of filaments, and lengths along them."""


def contour_of(filament: Filament) -> FloatArray:
    """Where the segments of a filament begin along it, with segments at rest, and its length: (segments + 1,) in nm.

    Of one that is not there yet, (1,).
    """
    if filament.is_reserve:
        return np.zeros(1)
    return np.concatenate([[0.0], np.cumsum(filament.type.segment_lengths(filament.segments, filament.closed))])


class FirstPlaces:
    """Draws places where linkers begin bound; of sites, each once, for the linkers of all types.

    kT is in kJ/mol. In a box, (3, 3), distances are those of nearest images.
    """

    def __init__(self, filaments: Sequence[Filament], kT: float, box: FloatArray | None) -> None:
        self._filaments, self._kT, self._box = filaments, kT, box
        self._contours = [contour_of(filament) for filament in filaments]
        self._lengths = np.array([contour[-1] for contour in self._contours])
        self._closed = np.array([filament.closed for filament in filaments])
        # By the distance of sites, filaments and numbers of those that are taken.
        self._taken: dict[float, IntArray] = {}

    def anywhere(self, hand: Hand, count: int, generator: np.random.Generator, name: str) -> Places:
        """With the same chance for each length of filament; InputError if there are fewer sites without a hand."""
        if count == 0:
            return np.zeros(0, dtype=int), np.zeros(0)
        lengths = np.where(self._binds(hand), self._lengths, 0.0)
        _refuse_without_length(lengths, count, name)
        if hand.binding_range is not None:
            return self._in_range(hand, count, lengths, generator, name)
        if hand.site_spacing is None:
            chains = generator.choice(len(lengths), count, p=lengths / lengths.sum())
            return chains, generator.uniform(0.0, lengths[chains])
        sites = self._sites(hand.site_spacing, lengths)
        ends = np.cumsum(sites)
        others = self._taken_sites(hand.site_spacing)
        others = others[sites[others[:, 0]] > 0]
        occupied = np.sort((ends - sites)[others[:, 0]] + others[:, 1])
        free = ends[-1] - len(occupied)
        if count > free:
            raise InputError(f"Linkers {name!r}: {count} are to begin bound, but there are only {free} sites for them.")
        chosen = np.sort(generator.choice(free, count, replace=False))
        # Counted without those that are occupied.
        chosen += np.searchsorted(occupied - np.arange(len(occupied)), chosen, side="right")
        chains = np.searchsorted(ends, chosen, side="right")
        return self._take(hand.site_spacing, chains, chosen - (ends - sites)[chains])

    def _in_range(self, hand, count, lengths, generator, name):
        # Places anywhere, of which those are kept that are in range.
        if hand.site_spacing is not None:
            raise InputError(f"Linkers {name!r}: let them begin unbound: their hands have sites and a binding_range.")
        found: list[Places] = []
        for _ in range(_MOST_ROUNDS):
            chains = generator.choice(len(lengths), _CANDIDATES + count, p=lengths / lengths.sum())
            along = generator.uniform(0.0, lengths[chains])
            kept = hand.binding_range.includes(along, lengths[chains], self._closed[chains])
            found.append((chains[kept], along[kept]))
            if sum(len(own) for own, _ in found) >= count:
                break
        chains, along = (np.concatenate(column)[:count] for column in zip(*found))
        if len(chains) < count:
            raise InputError(f"Linkers {name!r}: {count} are to begin bound, but few or no places are in their range.")
        return chains, along

    def near(
        self, points: FloatArray, kind: Crosslinker, count: int, generator: np.random.Generator
    ) -> tuple[IntArray, Places]:
        """Within reach of anchors, in the equilibrium of the spring: which of the anchors, the first that have a place.

        InputError if fewer anchors have one.
        """
        hand = kind.hands[1]
        found: list[tuple[int, int, float]] = []
        if count == 0:
            return np.zeros(0, dtype=int), (np.zeros(0, dtype=int), np.zeros(0))
        _refuse_without_length(self._lengths[self._binds(hand)], count, kind.name)
        starts, vectors, chains, begins, lengths, bows = self._segments(hand)
        squares = np.sum(vectors**2, axis=1)
        halves = 0.5 * vectors
        # Places on a curve that are within reach are at most this far from a piece's.
        reaches = hand.reach + bows
        farthest = reaches.max() + 0.5 * np.sqrt(squares.max())
        for anchor, point in enumerate(points):
            if len(found) == count:
                break
            middles = self._nearest(starts + halves - point)
            around = np.flatnonzero(np.einsum("ij,ij->i", middles, middles) <= farthest**2)
            relative = middles[around] - halves[around]
            # Fractions of segments: the nearest one, and those at which they come within reach and leave it.
            nearest = -np.sum(relative * vectors[around], axis=1) / squares[around]
            apart = np.sum((relative + nearest[:, None] * vectors[around]) ** 2, axis=1)
            half = np.sqrt(np.maximum(reaches[around] ** 2 - apart, 0.0) / squares[around])
            first, last = np.clip(nearest - half, 0.0, 1.0), np.clip(nearest + half, 0.0, 1.0)
            within = lengths[around] * (last - first)
            if not np.any(within > 0.0):
                continue
            chosen = generator.choice(len(around), _CANDIDATES, p=within / within.sum())
            fractions = generator.uniform(first[chosen], last[chosen])
            segments = around[chosen]
            along = begins[segments] + fractions * lengths[segments]
            place = self._choose(kind, point, chains[segments], along, generator)
            if place is not None:
                found.append((anchor, *place))
        if len(found) < count:
            raise InputError(
                f"Linkers {kind.name!r}: {count} are to begin bound, but only {len(found)} of the {len(points)} "
                "anchors have a free place on a filament within reach of their hands."
            )
        columns = np.array(found, dtype=float).reshape(-1, 3)
        return columns[:, 0].astype(int), (columns[:, 1].astype(int), columns[:, 2])

    def _choose(self, kind, point, chains, along, generator):
        spacing = kind.hands[1].site_spacing
        allowed = np.ones(len(chains), dtype=bool)
        numbers = np.zeros(len(chains), dtype=int)
        if spacing is not None:
            numbers = np.floor(along / spacing).astype(int)
            along = (numbers + 0.5) * spacing
            taken = set(map(tuple, self._taken_sites(spacing).tolist()))
            allowed = numbers < self._sites(spacing, self._lengths)[chains]
            allowed &= [own not in taken for own in zip(chains.tolist(), numbers.tolist())]
        own = kind.hands[1].binding_range
        if own is not None:
            allowed &= own.includes(along, self._lengths[chains], self._closed[chains])
        distances = np.linalg.norm(self._nearest(self._positions(chains, along) - point), axis=1)
        allowed &= distances <= kind.hands[1].reach
        if not np.any(allowed):
            return None
        energies = 0.5 * kind.stiffness * (distances - kind.rest_length) ** 2
        energies = np.where(allowed, energies - energies[allowed].min(), np.inf)
        weights = np.exp(-energies / self._kT) if self._kT > 0.0 else (energies == 0.0).astype(float)
        chosen = generator.choice(len(weights), p=weights / weights.sum())
        if spacing is not None:
            self._take(spacing, chains[chosen : chosen + 1], numbers[chosen : chosen + 1])
        return chains[chosen], along[chosen]

    def _segments(self, hand):
        # Of all filaments to which it binds, segments or pieces of curves: where they begin, their vectors, filaments,
        # lengths along these, and how far a curve is from them.
        columns: list[list[FloatArray]] = [[], [], [], [], [], []]
        for number, (filament, contour) in enumerate(zip(self._filaments, self._contours)):
            if not (hand.binds(filament.type) and filament.takes_part) or filament.is_reserve:
                continue
            nodes, bows = self._nodes(number), np.zeros(filament.segments)
            if filament.control_points is not None:
                nodes, control_points = _open_curve(filament)
                bows = np.repeat(_largest_bows(nodes, control_points), _PIECES)
                nodes = curve_points(nodes, control_points, _PIECES)
                contour = np.linspace(0.0, contour[-1], len(nodes))
            own = (nodes[:-1], np.diff(nodes, axis=0), np.full(len(bows), number), contour[:-1])
            for column, values in zip(columns, (*own, np.diff(contour), bows)):
                column.append(values)
        return [np.concatenate(column) for column in columns]

    def _nodes(self, number):
        nodes = self._filaments[number].positions
        return unrolled(nodes) if self._filaments[number].closed else nodes

    def _positions(self, chains, along):
        found = np.empty((len(chains), 3))
        for chain in np.unique(chains):
            own, nodes = chains == chain, self._nodes(chain)
            if self._filaments[chain].control_points is not None:
                found[own] = _on_curve(self._filaments[chain], self._contours[chain], along[own])
                continue
            found[own] = np.column_stack([np.interp(along[own], self._contours[chain], x) for x in nodes.T])
        return found

    def _nearest(self, vectors):
        return vectors if self._box is None else to_nearest_images(vectors, self._box)

    def _binds(self, hand):
        return np.array([hand.binds(filament.type) and filament.takes_part for filament in self._filaments])

    def _sites(self, spacing, lengths):
        return np.floor(np.minimum(lengths / spacing, _MOST_SITES) + 1e-9).astype(int)

    def _taken_sites(self, spacing):
        return self._taken.get(spacing, np.zeros((0, 2), dtype=int))

    def _take(self, spacing, chains, numbers):
        own = np.column_stack([chains, numbers])
        self._taken[spacing] = np.concatenate([self._taken_sites(spacing), own])
        return chains, (numbers + 0.5) * spacing


def _refuse_without_length(lengths, count, name):
    if not np.any(lengths > 0.0):
        raise InputError(
            f"Linkers {name!r}: {count} are to begin bound, but of the filaments that their hands bind to none is "
            "there yet: let them begin unbound."
        )


def _open_curve(filament):
    # Nodes and control points; of a ring, the first ones once more behind the last.
    own = filament.positions, filament.control_points
    return tuple(map(unrolled, own)) if filament.closed else own


def _largest_bows(nodes, control_points):
    # Of each element, how far its curve can be from the line between the ends of a piece, at the same fraction: no more
    # than an eighth of the second derivative, which is largest at one of the two ends.
    first, last = control_points[:-1], 2.0 * nodes[1:] - control_points[1:]
    seconds = 6.0 * np.stack([nodes[:-1] - 2.0 * first + last, first - 2.0 * last + nodes[1:]])
    return np.linalg.norm(seconds, axis=-1).max(axis=0) / (8.0 * _PIECES**2)


def _on_curve(filament, contour, along):
    # Places on a filament of beam elements, at lengths along it.
    element = np.clip(np.searchsorted(contour, along, side="right") - 1, 0, filament.segments - 1)
    weights = place_weights((along - contour[element]) / np.diff(contour)[element])
    nodes, control_points = _open_curve(filament)
    vectors = control_points - nodes
    ends = np.stack([nodes[element], vectors[element], nodes[element + 1], vectors[element + 1]], axis=1)
    return np.einsum("nw,nwx->nx", weights, ends)
