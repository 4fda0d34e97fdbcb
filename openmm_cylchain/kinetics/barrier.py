"""Barriers: places on filaments that capture hands which walk past them."""

from dataclasses import dataclass

from ..errors import InputError
from ..units.quantities import DIMENSIONLESS, LENGTH, RATE, non_negative, one_of
from ..units.types import Scalar
from .binding_range import ENDS_OF_RANGE


@dataclass(frozen=True)
class Barrier:
    """A place on a filament that captures hands; see ``Filaments.add_barrier``.

    Attributes
    ----------
    filament : int
    arc_length : float
        From the first node, with segments at rest, in nm.
    toward : {"plus", "minus", "both"}
        It captures hands that walk towards this end.
    release_rate : float
        In 1/ps.
    capture_probability : float
    """

    filament: int
    arc_length: float
    toward: str
    release_rate: float
    capture_probability: float

    @property
    def direction(self) -> int:
        """1 if it captures hands that walk to the plus end, -1 to the minus end, 0 to either."""
        return {"plus": 1, "minus": -1, "both": 0}[self.toward]


def as_barrier(
    filament: int, arc_length: Scalar, toward: str, release_rate: Scalar, capture_probability: float, length: float
) -> Barrier:
    """A Barrier on a filament of a length in nm; InputError if something is wrong."""
    along = non_negative(arc_length, LENGTH, "Barrier: arc_length")
    if along > length:
        raise InputError(f"Barrier: filament {filament} is {length:g} nm long, but arc_length is {along:g} nm.")
    one_of(toward, ENDS_OF_RANGE, "Barrier: toward")
    rate = non_negative(release_rate, RATE, "Barrier: release_rate")
    probability = non_negative(capture_probability, DIMENSIONLESS, "Barrier: capture_probability")
    if probability > 1.0:
        raise InputError(f"Barrier: capture_probability must be between 0 and 1, but is {probability:g}.")
    return Barrier(filament, along, toward, rate, probability)
