"""Places on segments that need no particle of their own."""

import math
from dataclasses import dataclass

from ..errors import InputError
from ..units.quantities import shown, whole_number


@dataclass(frozen=True)
class SegmentPlace:
    """A place between two particles, such as the ends of a segment: (1 - fraction) x_first + fraction x_second.

    Where the two are neighbouring nodes of a filament of beam elements, it is on the curve between them, at the
    parameter ``fraction``: that share of the arc length where the element is as long as at rest.

    Any two particles may be its ends. A force at a place between two that are not neighbours on a filament is explicit,
    with all else that is in the same Force.

    ``Filaments.segment_place`` finds that of a filament, a segment and a fraction.

    Attributes
    ----------
    first, second : int
        Particle indices.
    fraction : float
        From 0 at the first particle to 1 at the second.

    Raises
    ------
    InputError
        For particle indices that are none or the same, or a fraction that is not between 0 and 1.
    """

    first: int
    second: int
    fraction: float

    def __post_init__(self) -> None:
        for name in ("first", "second"):
            object.__setattr__(self, name, whole_number(getattr(self, name), 0, f"SegmentPlace: particle {name}"))
        if self.first == self.second:
            raise InputError(f"SegmentPlace: a place between particle {self.first} and itself does not exist.")
        try:
            fraction = float(self.fraction)
        except (TypeError, ValueError, OverflowError):
            fraction = math.nan
        if not 0.0 <= fraction <= 1.0:
            raise InputError(f"SegmentPlace: fraction must be a number between 0 and 1, but is {shown(self.fraction)}.")
        object.__setattr__(self, "fraction", fraction)
