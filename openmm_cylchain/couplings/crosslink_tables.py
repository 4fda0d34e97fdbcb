"""Tables of crosslinks, which never change, and those of them that this process knows by their identity."""

from __future__ import annotations

import hashlib
import threading
import zipfile
from collections import OrderedDict
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import IO, Any
from weakref import WeakKeyDictionary

import numpy as np
import openmm

from ..errors import InputError
from ..mechanics.geometry import to_nearest_images
from ..output.files import as_path, check_output_path
from ..units.quantities import (
    LENGTH,
    STIFFNESS,
    in_units_of,
    non_negative,
    numbers_to_compute_with,
    positive,
    require_kind,
    shown,
    true_or_false,
    whole_number,
)
from ..units.types import BoolArray, FloatArray, IntArray
from .beam_curves import BeamCurves
from .link_places import PLACE_COLUMNS, LinkPlaces

RECENT_TABLES = 256
"""Changes of crosslinks that one can go back."""

_COLUMNS = ("numbers", "pairs", "stiffness", "rest_length", "maximum_extension")
# They may be missing: then there are no other places than particles, and all crosslinks are on.
_FURTHER = ("partners", "fractions", "points", "active")
_WHOLE = ("numbers", "pairs", "partners")


def _empty(columns, kind):
    return field(default_factory=lambda: np.zeros((0, *columns), dtype=kind))


@dataclass(frozen=True, eq=False)
class CrosslinkTable:
    """Crosslinks at one moment, as ``Crosslinks.table`` returns them: immutable, and equal if all they hold is.

    Attributes
    ----------
    numbers : (n,) int array
        The numbers by which crosslinks are known, in ascending order.
    pairs : (n, 2) int array
        Their particles. The one at fraction 0 where a place is on a segment; -1 where the second place is a fixed
        point.
    stiffness : (n,) array
        k in kJ/(mol nm^2).
    rest_length : (n,) array
        d0 in nm.
    maximum_extension : (n,) array
        D in nm; infinite for harmonic crosslinks.
    next_number : int
        The number of the next crosslink.
    partners : (n, 2) int array
        The particles at fraction 1 where places are on segments, and -1 where they are not.
    fractions : (n, 2) array
        Where places are on segments.
    points : (n, 3) array
        The second places, in nm, where they are fixed points.
    active : (n,) bool array
        Whether crosslinks are switched on.
    """

    numbers: IntArray = _empty((), int)
    pairs: IntArray = _empty((2,), int)
    stiffness: FloatArray = _empty((), float)
    rest_length: FloatArray = _empty((), float)
    maximum_extension: FloatArray = _empty((), float)
    next_number: int = 0
    partners: IntArray = _empty((2,), int)
    fractions: FloatArray = _empty((2,), float)
    points: FloatArray = _empty((3,), float)
    active: BoolArray = _empty((), bool)

    def __post_init__(self) -> None:
        for name in (*_COLUMNS, *(name for name in _FURTHER if name != "active")):
            self._set(name, self._column(name))
        object.__setattr__(self, "next_number", whole_number(self.next_number, 0, "next_number"))
        places = LinkPlaces(*(getattr(self, name) for name in PLACE_COLUMNS))
        for name in PLACE_COLUMNS:
            self._set(name, getattr(places, name))
        # They share their arrays.
        object.__setattr__(self, "_places", places)
        active = self.active
        if not (isinstance(active, np.ndarray) and active.dtype == bool and active.ndim):
            active = np.array(active, dtype=object)
            if not active.ndim or not all(isinstance(one, (bool, np.bool_)) for one in active.ravel()):
                raise InputError("active of a table of crosslinks must be an array of True and False.")
        active = active.astype(bool)
        self._set("active", active if len(active) else np.ones(len(self.numbers), dtype=bool))
        self._check()

    def _column(self, name):
        try:
            column = np.array(getattr(self, name), dtype=np.float64)
        except (ValueError, TypeError, OverflowError):
            raise InputError(f"{name} of a table of crosslinks must be an array of numbers.") from None
        if name != "maximum_extension" and not np.all(np.isfinite(column)):
            raise InputError(f"{name} of a table of crosslinks must be finite, but contains NaN or infinity.")
        if not column.ndim:
            raise InputError(f"{name} of a table of crosslinks must be an array, but is {column:g}.")
        if name not in _WHOLE:
            return column
        if np.any(column != np.round(column)) or np.any(np.abs(column) >= 2.0**63):
            raise InputError(f"{name} of a table of crosslinks must be whole numbers.")
        return np.array(getattr(self, name), dtype=np.int64)

    def _set(self, name, column):
        column.setflags(write=False)
        object.__setattr__(self, name, column)

    def _check(self):
        count = len(self.numbers)
        shapes = [getattr(self, name).shape for name in (*_COLUMNS, *_FURTHER)]
        expected = [(count,), (count, 2), (count,), (count,), (count,), (count, 2), (count, 2), (count, 3), (count,)]
        if shapes != expected:
            raise InputError(f"The columns of a table of crosslinks do not have equal lengths: {shapes}.")
        bounded = np.concatenate([[-1], self.numbers, [self.next_number]])
        if not np.all(np.diff(bounded) > 0):
            raise InputError("The numbers of a table of crosslinks must ascend, from 0 to below next_number.")
        # Written so that NaN is refused.
        if not (np.all(self.stiffness > 0) and np.all(self.rest_length >= 0) and np.all(self.maximum_extension > 0)):
            raise InputError("A table of crosslinks must hold parameters that are positive (rest_length may be zero).")
        if not (np.all(self.fractions >= 0) and np.all(self.fractions <= 1) and np.all(np.isfinite(self.points))):
            raise InputError("A table of crosslinks must hold fractions between 0 and 1, and finite points.")

    def __len__(self) -> int:
        return len(self.numbers)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, CrosslinkTable) and self.identity == other.identity

    def __hash__(self) -> int:
        return hash(self.identity)

    def __getstate__(self) -> dict[str, Any]:
        return {name: getattr(self, name) for name in (*_COLUMNS, "next_number", *_FURTHER)}

    def __setstate__(self, state: dict[str, Any]) -> None:
        # Earlier versions have stored tables without the further columns.
        self.__init__(**state)  # type: ignore[misc]

    @property
    def places(self) -> LinkPlaces:
        """What the crosslinks join."""
        return self.__dict__["_places"]

    @cached_property
    def identity(self) -> int:
        """A digest of the table: a whole number that a double holds exactly."""
        digest = hashlib.blake2b(np.int64(self.next_number).tobytes(), digest_size=8)
        for name in _COLUMNS:
            digest.update(getattr(self, name).tobytes())
        if not (self.places.are_particles and np.all(self.active)):
            for name in _FURTHER:
                digest.update(getattr(self, name).tobytes())
        return int.from_bytes(digest.digest(), "little") >> 11

    def with_links(
        self, places: LinkPlaces, stiffness: float, rest_length: float, maximum_extension: float
    ) -> CrosslinkTable:
        """This table with further crosslinks of equal parameters, numbered on."""
        require_kind(places, LinkPlaces, "places")
        stiffness = positive(stiffness, STIFFNESS, "stiffness")
        rest_length = non_negative(rest_length, LENGTH, "rest_length")
        if not (isinstance(maximum_extension, float) and maximum_extension == np.inf):
            maximum_extension = positive(maximum_extension, LENGTH, "maximum_extension")
        count = len(places)
        both = self.places.with_places(places)
        return CrosslinkTable(
            np.concatenate([self.numbers, self.next_number + np.arange(count)]),
            both.pairs,
            np.concatenate([self.stiffness, np.full(count, stiffness)]),
            np.concatenate([self.rest_length, np.full(count, rest_length)]),
            np.concatenate([self.maximum_extension, np.full(count, maximum_extension)]),
            self.next_number + count,
            both.partners,
            both.fractions,
            both.points,
            np.concatenate([self.active, np.ones(count, dtype=bool)]),
        )

    def without(self, numbers: IntArray) -> CrosslinkTable:
        """This table without some crosslinks; raises InputError for a number that is not there or named twice."""
        rest = np.delete(np.arange(len(self)), self._rows_of(numbers, "removed"))
        return replace(self, **{name: getattr(self, name)[rest] for name in (*_COLUMNS, *_FURTHER)})

    def switched(self, numbers: IntArray, active: bool) -> CrosslinkTable:
        """This table with some crosslinks on or off; raises InputError as ``without`` does."""
        switched = np.array(self.active)
        switched[self._rows_of(numbers, "switched")] = true_or_false(active, "active")
        return replace(self, active=switched)

    def _rows_of(self, numbers, what):
        numbers = as_numbers(numbers)
        rows = np.searchsorted(self.numbers, numbers)
        known = rows < len(self)
        known[known] = self.numbers[rows[known]] == numbers[known]
        if not known.all():
            raise InputError(f"Crosslink {numbers[~known][0]} does not exist.")
        if len(np.unique(numbers)) < len(numbers):
            raise InputError(f"A crosslink to be {what} is named twice.")
        return rows

    def save(self, file: str | Path | IO[bytes]) -> None:
        """Write the table to a file (.npz), for ``CrosslinkTable.load`` in another process."""
        if not hasattr(file, "write"):
            check_output_path(file)
        np.savez(file, **self.__getstate__())

    @classmethod
    def load(cls, file: str | Path | IO[bytes]) -> CrosslinkTable:
        """Read a table that ``save`` has written; InputError for a file that holds none."""
        if not hasattr(file, "read"):
            file = as_path(file, "file")
        try:
            content = np.load(file)
        except FileNotFoundError:
            raise InputError(f"file {file} does not exist.") from None
        except (ValueError, EOFError, OSError, zipfile.BadZipFile) as error:
            raise InputError(
                f"file {file} holds no table of crosslinks that CrosslinkTable.save wrote: {error}"
            ) from None
        if not isinstance(content, np.lib.npyio.NpzFile):
            raise InputError(f"file {file} holds an array alone, and no table of crosslinks.")
        with content:
            missing = {*_COLUMNS, "next_number"} - set(content.files)
            if missing:
                raise InputError(f"{file} holds no table of crosslinks: it lacks {', '.join(sorted(missing))}.")
            columns = {name: content[name] for name in (*_COLUMNS, *_FURTHER) if name in content.files}
            return cls(**columns, next_number=content["next_number"].item())

    def displacements(
        self,
        positions: FloatArray,
        box: FloatArray | None = None,
        segment_box: FloatArray | None = None,
        curves: BeamCurves | None = None,
    ) -> FloatArray:
        """Vectors (n, 3) from first to second places.

        Parameters
        ----------
        positions : (particles, 3) array
            In nm.
        box : (3, 3) array, optional
            Of which to take the nearest images of places.
        segment_box : (3, 3) array, optional
            Of which to take the nearest images of the two particles of a place.
        curves : BeamCurves, optional
            Those of beam elements, on which places between their nodes are.
        """
        positions = numbers_to_compute_with(positions, LENGTH, "positions", 3)
        last = max(self.pairs.max(initial=-1), self.partners.max(initial=-1))
        if positions.ndim != 2 or len(positions) <= last:
            raise InputError(
                f"positions must have the shape (particles, 3) and hold particle {last}, but have {positions.shape}."
            )
        box = None if box is None else _as_box(box, "box")
        segment_box = None if segment_box is None else _as_box(segment_box, "segment_box")
        if curves is not None:
            require_kind(curves, BeamCurves, "curves")
        second, first = (self.places.positions(positions, side, segment_box, curves) for side in (1, 0))
        vectors = second - first
        return vectors if box is None else to_nearest_images(vectors, box)


def _as_box(vectors, name):
    box = np.asarray(in_units_of(vectors, LENGTH, name))
    if box.shape != (3, 3) or not np.all(np.diagonal(box) > 0.0):
        raise InputError(f"{name} must be three vectors in the reduced form of OpenMM, but is {shown(vectors)}.")
    return box


def as_numbers(numbers: Any) -> IntArray:
    """The numbers of crosslinks, of which there may be one alone; InputError for what is none."""
    array = np.atleast_1d(numbers if isinstance(numbers, np.ndarray) else np.asarray(numbers, dtype=object)).ravel()
    if array.dtype.kind not in "iu" or np.any(array < 0):
        array = np.array([whole_number(number, 0, "The number of a crosslink") for number in array], dtype=np.int64)
    if np.any(array >= 2**31):
        raise InputError(f"There is no crosslink {array.max()}: numbers are below 2^31.")
    return array.astype(np.int64)


class _TableRegistry:
    # The tables of this process: those that Contexts have got through Crosslinks, and those used last by any Context,
    # so that one can go back to a State from before a few changes. More would let memory grow with every change.

    def __init__(self) -> None:
        self._of_context: WeakKeyDictionary[Any, CrosslinkTable] = WeakKeyDictionary()
        self._recent: OrderedDict[int, CrosslinkTable] = OrderedDict()
        self._lock = threading.Lock()

    def hold(self, context: openmm.Context, table: CrosslinkTable) -> None:
        with self._lock:
            self._of_context[context] = table
            self._remember(table)

    def find(self, identity: int) -> CrosslinkTable | None:
        with self._lock:
            table = self._recent.get(identity)
            if table is None:
                held = self._of_context.values()
                table = next((one for one in held if one.identity == identity), None)
            if table is not None:
                self._remember(table)
        return table

    def _remember(self, table):
        self._recent[table.identity] = table
        self._recent.move_to_end(table.identity)
        if len(self._recent) > RECENT_TABLES:
            self._recent.popitem(last=False)


TABLES = _TableRegistry()
