"""The places that crosslinks join: particles, places on segments and fixed points, as columns of numbers."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt

from ..errors import InputError
from ..filaments.attachments import SAME_PLACE
from ..filaments.segment_place import SegmentPlace
from ..mechanics.geometry import to_nearest_images
from ..units.quantities import LENGTH, shown, vector, whole_number
from ..units.types import BoolArray, FloatArray, IntArray
from .beam_curves import BeamCurves

NOWHERE = -1
"""In place of a particle that there is none of."""

PLACE_COLUMNS = ("pairs", "partners", "fractions", "points")

_SHAPES = {"pairs": (2,), "partners": (2,), "fractions": (2,), "points": (3,)}
_KINDS = {"pairs": np.int64, "partners": np.int64, "fractions": np.float64, "points": np.float64}
_ABSENT = {"pairs": NOWHERE, "partners": NOWHERE, "fractions": 0.0, "points": 0.0}


def _empty(name):
    return field(default_factory=lambda: np.zeros((0, *_SHAPES[name]), dtype=_KINDS[name]))


@dataclass(frozen=True, eq=False)
class LinkPlaces:
    """The two places of each of n links.

    Attributes
    ----------
    pairs : (n, 2) int array
        The particles. That at fraction 0 where a place is between two, and -1 where the second place is a fixed point.
    partners : (n, 2) int array
        The particles at fraction 1, or -1 where a place is at a particle.
    fractions : (n, 2) array
        Where a place is between two particles.
    points : (n, 3) array
        The second places, in nm, where they are fixed points.
    """

    pairs: IntArray = _empty("pairs")
    partners: IntArray = _empty("partners")
    fractions: FloatArray = _empty("fractions")
    points: FloatArray = _empty("points")

    def __post_init__(self) -> None:
        count = len(self.pairs)
        for name in PLACE_COLUMNS:
            column = np.array(getattr(self, name), dtype=_KINDS[name])
            if len(column) == 0:
                column = np.full((count, *_SHAPES[name]), _ABSENT[name], dtype=_KINDS[name])
            column.setflags(write=False)
            object.__setattr__(self, name, column)

    def __len__(self) -> int:
        return len(self.pairs)

    @property
    def shapes(self) -> list[tuple[int, ...]]:
        """The shapes of the columns, after the first axis."""
        return [getattr(self, name).shape for name in PLACE_COLUMNS]

    @cached_property
    def are_particles(self) -> bool:
        """Whether all places are at particles."""
        return not np.any(self.partners >= 0) and not np.any(self.pairs < 0)

    @cached_property
    def on_segments(self) -> BoolArray:
        """Which places are between two particles: (n, 2)."""
        return self.partners >= 0

    @cached_property
    def at_points(self) -> BoolArray:
        """Which second places are fixed points: (n,)."""
        return self.pairs[:, 1] < 0

    def rows(self, chosen: Any) -> "LinkPlaces":
        """Those of some links."""
        return LinkPlaces(*(getattr(self, name)[chosen] for name in PLACE_COLUMNS))

    def with_places(self, others: "LinkPlaces") -> "LinkPlaces":
        """These and others behind them."""
        both = (np.concatenate([getattr(self, name), getattr(others, name)]) for name in PLACE_COLUMNS)
        return LinkPlaces(*both)

    def positions(
        self, positions: FloatArray, side: int, box: FloatArray | None = None, curves: BeamCurves | None = None
    ) -> FloatArray:
        """Where the first (side 0) or the second (side 1) places are: (n, 3).

        Of the two particles of a place the images that are nearest in a box (3, 3), if one is given. Those between the
        nodes of beam elements are on ``curves``.
        """
        places = positions[self.pairs[:, side]]
        if self.are_particles:
            return places
        between = np.flatnonzero(self.on_segments[:, side])
        fractions = self.fractions[between, side][:, None]
        others = positions[self.partners[between, side]]
        if box is None:
            places[between] = (1.0 - fractions) * places[between] + fractions * others
        else:
            places[between] += fractions * to_nearest_images(others - places[between], box)
        if curves is not None:
            first, second = self.pairs[:, side], self.partners[:, side]
            rows = np.flatnonzero(curves.on_curve(first, second))
            places[rows] = curves.places(first[rows], second[rows], self.fractions[rows, side], positions, box)
        if side == 1:
            places[self.at_points] = self.points[self.at_points]
        return places

    @cached_property
    def holders(self) -> tuple[IntArray, IntArray, FloatArray]:
        """Particles on which forces act, the links that they are of, and their shares of a force on the first places.

        The shares are negative for second places.
        """
        particles, links, shares = [], [], []
        for side, sign in ((0, 1.0), (1, -1.0)):
            fractions = self.fractions[:, side]
            at = np.flatnonzero(self.pairs[:, side] >= 0)
            between = np.flatnonzero(self.on_segments[:, side])
            particles += [self.pairs[at, side], self.partners[between, side]]
            links += [at, between]
            shares += [sign * (1.0 - fractions[at]), sign * fractions[between]]
        return np.concatenate(particles), np.concatenate(links), np.concatenate(shares)

    def check(self, numbers: npt.ArrayLike, particles: int | None) -> None:
        """Refuse particles that a System does not have (None for any), and links of a place to itself.

        Links are known by their numbers (n,) in messages.
        """
        numbers = np.asarray(numbers)
        same = np.flatnonzero(self._joins_itself())
        if len(same):
            row = int(same[0])
            raise InputError(f"Crosslink {numbers[row]} joins {self._describe(row, 0)} to itself.")
        largest = np.maximum(self.pairs.max(axis=1, initial=-1), self.partners.max(axis=1, initial=-1))
        if particles is not None and np.any(largest >= particles):
            row = int(np.argmax(largest >= particles))
            raise InputError(
                f"Crosslink {numbers[row]}: particle {largest[row]} does not exist; the System has {particles}."
            )

    def describe(self, row: int) -> str:
        """What a link joins: "between particles 3 and 5"."""
        if self.partners[row].max() < 0 and self.pairs[row, 1] >= 0:
            return f"between particles {self.pairs[row, 0]} and {self.pairs[row, 1]}"
        return f"between {self._describe(row, 0)} and {self._describe(row, 1)}"

    def _joins_itself(self):
        if self.are_particles:
            return self.pairs[:, 0] == self.pairs[:, 1]
        # The same place with the lesser particle first, and with one particle if it is at one.
        turned = self.on_segments & (self.pairs > self.partners)
        first = np.where(turned, self.partners, self.pairs)
        second = np.where(turned, self.pairs, self.partners)
        fraction = np.where(turned, 1.0 - self.fractions, self.fractions)
        at_second = self.on_segments & (fraction > 1.0 - SAME_PLACE)
        first = np.where(at_second, second, first)
        at_one = ~self.on_segments | at_second | (fraction < SAME_PLACE)
        second, fraction = np.where(at_one, NOWHERE, second), np.where(at_one, 0.0, fraction)
        equal = [column[:, 0] == column[:, 1] for column in (first, second)]
        return equal[0] & equal[1] & (np.abs(fraction[:, 0] - fraction[:, 1]) < SAME_PLACE)

    def _describe(self, row, side):
        particle, partner = self.pairs[row, side], self.partners[row, side]
        if particle < 0:
            return "the point ({:.6g}, {:.6g}, {:.6g}) nm".format(*self.points[row])
        if partner < 0:
            return f"particle {particle}"
        return f"the place {self.fractions[row, side]:.6g} from particle {particle} to {partner}"


def as_places(pairs: Any) -> LinkPlaces:
    """What a user gives as (n, 2) places: particles, SegmentPlaces, and one fixed point at most in each pair; else
    InputError."""
    particles = None if isinstance(pairs, (str, bytes, Mapping)) else _as_particles(pairs)
    if particles is not None:
        return LinkPlaces(particles)
    rows = _as_rows(pairs)
    if rows is None:
        raise InputError(f"pairs must have the shape (n, 2), but are {shown(pairs)}.")
    columns: dict[str, Any] = {name: [] for name in PLACE_COLUMNS}
    for first, second in rows:
        ends = [_as_place(first), _as_place(second)]
        if ends[0][0] == NOWHERE:
            ends.reverse()
        if ends[0][0] == NOWHERE:
            raise InputError(f"A crosslink cannot join two fixed points: {first!r} and {second!r}.")
        columns["pairs"].append([end[0] for end in ends])
        columns["partners"].append([end[1] for end in ends])
        columns["fractions"].append([end[2] for end in ends])
        columns["points"].append(ends[1][3])
    return LinkPlaces(**columns)


def _as_particles(pairs):
    # An int array (n, 2), or None if they are none: then they are taken one by one.
    try:
        array = np.asarray(pairs)
    except (TypeError, ValueError):
        return None
    if array.size == 0 and array.dtype.kind != "O":
        return np.zeros((0, 2), dtype=np.int64)
    if array.ndim != 2 or array.shape[1] != 2 or array.dtype.kind not in "iu" or np.any(array < 0):
        return None
    return array.astype(np.int64)


def _as_rows(pairs):
    if isinstance(pairs, (str, bytes, Mapping)):
        return None
    try:
        rows = [tuple(pair) for pair in pairs]
    except TypeError:
        return None
    return rows if all(len(row) == 2 for row in rows) else None


def _as_place(end):
    # Particle, partner, fraction and point.
    if isinstance(end, SegmentPlace):
        return end.first, end.second, end.fraction, (0.0, 0.0, 0.0)
    try:
        is_number = np.ndim(getattr(end, "_value", end)) == 0
    except ValueError:
        raise InputError(f"A place must be a particle, a SegmentPlace or a point, but is {shown(end)}.") from None
    if is_number:
        return whole_number(end, 0, "particle"), NOWHERE, 0.0, (0.0, 0.0, 0.0)
    return NOWHERE, NOWHERE, 0.0, tuple(vector(end, LENGTH, "The fixed point of a crosslink"))
