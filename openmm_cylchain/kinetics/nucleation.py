"""Where and how often filaments begin."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from openmm import unit

from ..couplings.shapes import Box, Sphere, bounds_of, volume_of
from ..errors import InputError
from ..filaments.filament import Filament
from ..filaments.filament_type import FilamentType
from ..filaments.growth import Growth
from ..units.quantities import (
    AVOGADRO,
    LENGTH,
    RATE,
    VOLUME,
    in_units_of,
    non_negative,
    positive,
    require_kind,
    shown,
    unit_vector,
    vector,
    whole_number,
)
from ..units.types import FloatArray, Scalar, Vector

_PER_VOLUME = RATE / VOLUME
_MOLAR = unit.mole / unit.liter


@dataclass(frozen=True, kw_only=True, eq=False)
class Nucleation:
    """Where and how often filaments begin, as straight as thermal motion lets them be.

    All places of a region are as likely for their first nodes, and so are all directions. A new one that would have the
    energy V with walls and contacts begins with the chance min(1, exp(-V/k_BT)): where filaments ``vanishes``, which
    they do at the sum k_off of both ends, there are so many with the least number of monomers as the law of mass action
    says, J/k_off exp(-V/k_BT).

    Parameters
    ----------
    rate : 1/(volume*time), concentration/time, or 1/time
        J, at the first concentration of monomers: in each volume, or in the whole region. Plain numbers are 1/ps in the
        whole region.
    region : Sphere or Box, optional
        The periodic box of the System if not given.
    length : length, optional
        Of a new filament; the ``shortest`` of its growth if not given.
    direction : (3,) array, optional
        Of the first segment; any if not given.
    order : int
        The power of the concentration that the rate is proportional to, as a pool runs dry: 3 for nuclei of three
        monomers.

    The attributes hold plain numbers, in nm and 1/ps or 1/(nm^3 ps).

    Raises
    ------
    InputError
        For a rate that is negative or not finite, another region or unit, or a direction of no length.
    """

    rate: float
    region: Sphere | Box | None = None
    length: float | None = None
    direction: FloatArray | None = None
    order: int = 0
    is_per_volume: bool = False

    if TYPE_CHECKING:

        def __init__(
            self,
            *,
            rate: Scalar,
            region: Sphere | Box | None = None,
            length: Scalar | None = None,
            direction: Vector | None = None,
            order: int = 0,
        ) -> None: ...

    def __post_init__(self) -> None:
        if not (self.region is None or isinstance(self.region, (Sphere, Box))):
            raise InputError(
                f"The region of a Nucleation must be a Sphere, a Box or None, but is {shown(self.region)}."
            )
        self._convert_rate()
        if self.length is not None:
            object.__setattr__(self, "length", positive(self.length, LENGTH, "length of new filaments"))
        if self.direction is not None:
            direction = vector(self.direction, unit.dimensionless, "direction of new filaments")
            object.__setattr__(self, "direction", unit_vector(direction, "Nucleation"))
        whole_number(self.order, 0, "order of nucleation")

    def _convert_rate(self) -> None:
        rate: Any = self.rate
        if isinstance(rate, unit.Quantity) and rate.unit.is_compatible(_MOLAR * RATE):
            rate = in_units_of(rate, unit.mole * _PER_VOLUME, "rate of nucleation") * AVOGADRO * _PER_VOLUME
        if isinstance(rate, unit.Quantity) and rate.unit.is_compatible(_PER_VOLUME):
            object.__setattr__(self, "is_per_volume", True)
            object.__setattr__(self, "rate", non_negative(rate, _PER_VOLUME, "rate of nucleation"))
        else:
            object.__setattr__(self, "rate", non_negative(rate, RATE, "rate of nucleation"))

    def whole_rate(self, box: FloatArray | None, mothers: float = 1.0) -> float:
        """J in 1/ps in the whole region, or in a periodic box (3, 3) in nm; InputError if there is none.

        Of branches that on so long mothers, in nm.
        """
        if self.region is not None:
            volume = volume_of(self.region)
        elif box is not None:
            volume = abs(float(np.linalg.det(box)))
        else:
            raise InputError("A Nucleation needs a region, a Sphere or a Box, since the System has no periodic box.")
        return self.rate * volume if self.is_per_volume else self.rate

    def monomers(self, growth: Growth, filament_type: FilamentType) -> int:
        """How many monomers a new filament has; InputError if it cannot have so many."""
        fewest, longest = growth.fewest_monomers(filament_type), growth.longest
        if self.length is None:
            return fewest
        number = round(self.length / growth.monomers.length)
        if number < fewest or number * growth.monomers.length > longest * (1.0 + 1e-6):
            raise InputError(
                f"New filaments of {self.length:g} nm are not between the shortest and the longest of their growth, "
                f"{fewest * growth.monomers.length:g} and {longest:g} nm."
            )
        return number

    @property
    def described_region(self) -> tuple[int, list[float]]:
        """As a CylinderChainGrowthForce has it: 0, 1 or 2 for the box, a cuboid or a sphere, and its numbers."""
        if self.region is None:
            return 0, []
        if isinstance(self.region, Sphere):
            return 2, [*map(float, self.region.center), float(self.region.radius)]
        return 1, [*map(float, self.region.lower), *map(float, self.region.upper)]

    @property
    def centre(self) -> FloatArray:
        """(3,) in nm: of its region, or the origin."""
        return np.zeros(3) if self.region is None else np.mean(bounds_of(self.region), axis=0)


def nucleations_of(filaments: Sequence[Filament]) -> list[tuple[Nucleation, list[int]]]:
    """Those by which filaments begin, with the numbers of these."""
    found: dict[int, tuple[Nucleation, list[int]]] = {}
    for number, own in enumerate(filaments):
        if own.nucleation is not None:
            found.setdefault(id(own.nucleation), (own.nucleation, []))[1].append(number)
    return list(found.values())


def require_nucleation(nucleation: Nucleation | None) -> None:
    """Raise InputError unless it is a Nucleation or None."""
    if nucleation is not None:
        require_kind(nucleation, Nucleation, "nucleation")
