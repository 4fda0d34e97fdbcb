"""Tables of crosslinks, which never change, and those of them that this process knows by their identity."""

import hashlib
import threading
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
from ..units.types import FloatArray, IntArray

RECENT_TABLES = 256
"""Changes of crosslinks that one can go back."""

_COLUMNS = ("numbers", "pairs", "stiffness", "rest_length", "maximum_extension")


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
        Their particles.
    stiffness : (n,) array
        k in kJ/(mol nm^2).
    rest_length : (n,) array
        d0 in nm.
    maximum_extension : (n,) array
        D in nm; infinite for harmonic crosslinks.
    next_number : int
        The number of the next crosslink.
    """

    numbers: IntArray = _empty((), int)
    pairs: IntArray = _empty((2,), int)
    stiffness: FloatArray = _empty((), float)
    rest_length: FloatArray = _empty((), float)
    maximum_extension: FloatArray = _empty((), float)
    next_number: int = 0

    def __post_init__(self) -> None:
        for name in _COLUMNS:
            kind = np.int64 if name in ("numbers", "pairs") else np.float64
            column = np.array(getattr(self, name), dtype=kind)
            column.setflags(write=False)
            object.__setattr__(self, name, column)
        self._check()

    def _check(self):
        count = len(self.numbers)
        shapes = [getattr(self, name).shape for name in _COLUMNS]
        if shapes != [(count,), (count, 2), (count,), (count,), (count,)]:
            raise InputError(f"The columns of a table of crosslinks do not have equal lengths: {shapes}.")
        bounded = np.concatenate([[-1], self.numbers, [self.next_number]])
        if not np.all(np.diff(bounded) > 0):
            raise InputError("The numbers of a table of crosslinks must ascend, from 0 to below next_number.")
        # Written so that NaN is refused.
        if not (np.all(self.stiffness > 0) and np.all(self.rest_length >= 0) and np.all(self.maximum_extension > 0)):
            raise InputError("A table of crosslinks must hold parameters that are positive (rest_length may be zero).")

    def __len__(self) -> int:
        return len(self.numbers)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, CrosslinkTable) and self.identity == other.identity

    def __hash__(self) -> int:
        return hash(self.identity)

    def __getstate__(self) -> dict[str, Any]:
        return {name: getattr(self, name) for name in (*_COLUMNS, "next_number")}

    @cached_property
    def identity(self) -> int:
        """A digest of the table: a whole number that a double holds exactly."""
        digest = hashlib.blake2b(np.int64(self.next_number).tobytes(), digest_size=8)
        for name in _COLUMNS:
            digest.update(getattr(self, name).tobytes())
        return int.from_bytes(digest.digest(), "little") >> 11

    @cached_property
    def particles(self) -> IntArray:
        """The first particles of all crosslinks and then the second."""
        return self.pairs.T.ravel()

    def with_links(
        self, pairs: IntArray, stiffness: float, rest_length: float, maximum_extension: float
    ) -> "CrosslinkTable":
        """This table with further crosslinks of equal parameters, numbered on."""
        count = len(pairs)
        return CrosslinkTable(
            np.concatenate([self.numbers, self.next_number + np.arange(count)]),
            np.concatenate([self.pairs, pairs]),
            np.concatenate([self.stiffness, np.full(count, stiffness)]),
            np.concatenate([self.rest_length, np.full(count, rest_length)]),
            np.concatenate([self.maximum_extension, np.full(count, maximum_extension)]),
            self.next_number + count,
        )

    def without(self, numbers: IntArray) -> "CrosslinkTable":
        """This table without some crosslinks; raises InputError for a number that is not there or named twice."""
        rows = np.searchsorted(self.numbers, numbers)
        known = rows < len(self)
        known[known] = self.numbers[rows[known]] == numbers[known]
        if not known.all():
            raise InputError(f"Crosslink {numbers[~known][0]} does not exist.")
        if len(np.unique(numbers)) < len(numbers):
            raise InputError("A crosslink to be removed is named twice.")
        rest = np.delete(np.arange(len(self)), rows)
        return replace(self, **{name: getattr(self, name)[rest] for name in _COLUMNS})

    def save(self, file: str | Path | IO[bytes]) -> None:
        """Write the table to a file (.npz), for ``CrosslinkTable.load`` in another process."""
        np.savez(file, **self.__getstate__())

    @classmethod
    def load(cls, file: str | Path | IO[bytes]) -> "CrosslinkTable":
        """Read a table that ``save`` has written."""
        with np.load(file) as content:
            missing = {*_COLUMNS, "next_number"} - set(content.files)
            if missing:
                raise InputError(f"{file} holds no table of crosslinks: it lacks {', '.join(sorted(missing))}.")
            return cls(**{name: content[name] for name in _COLUMNS}, next_number=int(content["next_number"]))

    def displacements(self, positions: FloatArray, box: FloatArray | None = None) -> FloatArray:
        """Vectors (n, 3) from first to second particles, to nearest images in a box (3, 3) if one is given."""
        ends = positions[self.particles]
        vectors = ends[len(self) :] - ends[: len(self)]
        return vectors if box is None else to_nearest_images(vectors, box)


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
