"""LinkerTable: which linkers there are, and where their hands are bound."""

from dataclasses import dataclass

import numpy as np

from ..errors import InputError
from ..units.quantities import DIMENSIONLESS, in_units_of, whole_number
from ..units.types import BoolArray, FloatArray, IntArray

STATES = ("unbound", "one hand bound", "both hands bound")
"""What a linker may be, by how many of its ends hold something; an anchored linker always holds its anchor."""

_LARGEST_NUMBER = 2**31 - 1


@dataclass(frozen=True)
class LinkerTable:
    """The linkers of a Context at one time. It does not change.

    Attributes
    ----------
    numbers : (n,) int array
        Of linkers, ascending: a linker keeps its number as long as it is there.
    types : (n,) int array
        What ``Filaments.add_linkers`` returned for its type.
    anchors : (n,) int array
        The number of the anchor in the place of the first hand, or -1.
    filaments : (n, 2) int array
        To which filaments the two hands are bound; -1 where they are not.
    arc_lengths : (n, 2) float array
        Where, as lengths along the filaments with segments at rest, in nm, from their minus ends, or from where these
        were at the start if filaments grow: negative where monomers have come at a minus end.
    next_number : int
        The number of the next linker.
    positions : (n, 3) float array
        Where those are that diffuse and are not bound, in nm, not taken back into a periodic box; NaN of others. If not
        given to ``set_linkers``, they are anywhere.
    """

    numbers: IntArray
    types: IntArray
    anchors: IntArray
    filaments: IntArray
    arc_lengths: FloatArray
    next_number: int
    positions: FloatArray = None  # type: ignore[assignment]

    def __post_init__(self) -> None:
        for name in ("numbers", "types", "anchors", "filaments", "arc_lengths"):
            column = np.asarray(in_units_of(getattr(self, name), DIMENSIONLESS, f"LinkerTable: {name}"))
            if name != "arc_lengths":
                if np.any(column != np.rint(column)) or np.any(np.abs(column) > _LARGEST_NUMBER):
                    raise InputError(f"LinkerTable: {name} must be whole numbers of 32 bits.")
                column = column.astype(np.int64)
            object.__setattr__(self, name, column)
        next_number = whole_number(self.next_number, 0, "LinkerTable: next_number")
        if next_number > _LARGEST_NUMBER:
            raise InputError(f"LinkerTable: next_number must be at most {_LARGEST_NUMBER}, but is {next_number}.")
        object.__setattr__(self, "next_number", next_number)
        count = self.numbers.size
        positions = np.full((count, 3), np.nan)
        if self.positions is not None:
            positions = np.asarray(getattr(self.positions, "_value", self.positions), dtype=float)
        object.__setattr__(self, "positions", positions)
        shapes = {
            "numbers": (count,),
            "types": (count,),
            "anchors": (count,),
            "filaments": (count, 2),
            "arc_lengths": (count, 2),
            "positions": (count, 3),
        }
        for name, shape in shapes.items():
            if np.shape(getattr(self, name)) != shape:
                raise InputError(f"LinkerTable: {name} must have the shape {shape}.")

    def __len__(self) -> int:
        return len(self.numbers)

    @property
    def bound(self) -> BoolArray:
        """Which hands are bound: a bool array (n, 2)."""
        return np.asarray(self.filaments) >= 0

    @property
    def held(self) -> IntArray:
        """How many ends of each linker hold something, a filament or an anchor: an int array (n,) of 0, 1 and 2."""
        return self.bound.sum(axis=1) + (np.asarray(self.anchors) >= 0)

    def counts(self, linker_type: int | None = None) -> tuple[int, int, int]:
        """How many linkers, of a type or of all, are in each state of ``STATES``."""
        if linker_type is not None:
            linker_type = whole_number(linker_type, 0, "linker_type")
        held = self.held if linker_type is None else self.held[np.asarray(self.types) == linker_type]
        unbound, one, both = np.bincount(held, minlength=3)
        return int(unbound), int(one), int(both)
