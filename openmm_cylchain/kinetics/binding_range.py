"""Near which end of a filament a hand binds, or does not."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ..filaments.end_states import ENDS
from ..units.quantities import LENGTH, one_of, positive, true_or_false
from ..units.types import FloatArray, Scalar

ENDS_OF_RANGE = (*ENDS, "both")


@dataclass(frozen=True, kw_only=True)
class BindingRange:
    """The part of filaments to which a hand binds: near an end, or away from it. Rings have no ends.

    Parameters
    ----------
    end : {"plus", "minus", "both"}
    range : length
        How near to the end, along the filament, is near.
    excluded : bool
        Whether a hand binds to all but what is near; else to what is near alone.

    Raises
    ------
    InputError
        For another end, or a range that is not positive.
    """

    end: str
    range: float
    excluded: bool = False

    if TYPE_CHECKING:

        def __init__(self, *, end: str, range: Scalar, excluded: bool = False) -> None: ...

    def __post_init__(self) -> None:
        one_of(self.end, ENDS_OF_RANGE, "BindingRange: end")
        object.__setattr__(self, "range", positive(self.range, LENGTH, "BindingRange: range"))
        true_or_false(self.excluded, "BindingRange: excluded")

    def includes(self, along: FloatArray, length: FloatArray, closed: FloatArray) -> FloatArray:
        """Whether places at such lengths along filaments of such lengths, some of them rings, are in it."""
        near = np.zeros(np.shape(along), dtype=bool)
        if self.end != "plus":
            near |= np.asarray(along) <= self.range
        if self.end != "minus":
            near |= np.asarray(length) - along <= self.range
        return (near & np.logical_not(closed)) != self.excluded
