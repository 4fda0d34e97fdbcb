"""Growth: how the ends of a filament gain and lose monomers, and where these come from."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from openmm import unit

from ..errors import InputError
from ..units.quantities import (
    AVOGADRO,
    LENGTH,
    NUMBER_DENSITY,
    ON_RATE,
    RATE,
    VOLUME,
    as_number_density,
    in_units_of,
    non_negative,
    positive,
    require_kind,
    true_or_false,
)
from ..units.types import FloatArray, Indices, Scalar
from .chain_type import ChainType
from .filament_type import FilamentType

_PER_AMOUNT = unit.liter / unit.mole / unit.second
_SAME_LENGTH = 1e-6
"""By what share the length of a segment may differ from that of its monomers."""
_MOST_MONOMERS_OF_SEGMENT = 100_000
_MOST_MONOMERS_OF_POOL = 1e15


@dataclass(frozen=True, kw_only=True)
class Monomers:
    """What filaments grow of: how long a monomer is in a filament, and how fast ends gain and lose them.

    Parameters
    ----------
    length : length
        By which a filament grows with a monomer.
    plus_on_rate, minus_on_rate : volume/time, or 1/(concentration*time)
        k_on of the end at the last and at the first node: an end gains k_on c monomers per time.
    plus_off_rate, minus_off_rate : 1/time
        k_off: it loses so many.

    The attributes hold plain numbers, in nm, nm^3/ps and 1/ps.

    Raises
    ------
    InputError
        For a length that is not positive, or a rate that is negative or not finite.
    """

    length: float
    plus_on_rate: float = 0.0
    plus_off_rate: float = 0.0
    minus_on_rate: float = 0.0
    minus_off_rate: float = 0.0

    if TYPE_CHECKING:

        def __init__(
            self,
            *,
            length: Scalar,
            plus_on_rate: Scalar = 0.0,
            plus_off_rate: Scalar = 0.0,
            minus_on_rate: Scalar = 0.0,
            minus_off_rate: Scalar = 0.0,
        ) -> None: ...

    def __post_init__(self) -> None:
        object.__setattr__(self, "length", positive(self.length, LENGTH, "length of a monomer"))
        for end in ("plus", "minus"):
            on, off = f"{end}_on_rate", f"{end}_off_rate"
            object.__setattr__(self, on, _as_on_rate(getattr(self, on), on))
            object.__setattr__(self, off, non_negative(getattr(self, off), RATE, off))

    @property
    def treadmilling_concentration(self) -> unit.Quantity:
        """The concentration at which a filament keeps its length: (sum of k_off)/(sum of k_on).

        One end grows then as fast as the other shrinks. In mol/l. InputError if no end gains monomers.
        """
        on = self.plus_on_rate + self.minus_on_rate
        if on == 0.0:
            raise InputError("Filaments of these monomers never grow: both on-rates are zero.")
        density = (self.plus_off_rate + self.minus_off_rate) / on
        return unit.Quantity(density / AVOGADRO, NUMBER_DENSITY * unit.mole).in_units_of(unit.molar)


@dataclass(frozen=True, eq=False)
class MonomerPool:
    """Free monomers: a concentration that stays as it is, or a volume that runs dry.

    Filaments that are given the same pool share it.

    Parameters
    ----------
    concentration : amount/length^3, or 1/length^3
        Of free monomers, at the start if there is a volume.
    volume : length^3, optional
        In which they are. Each monomer that a filament gains is one less.

    The attributes hold plain numbers, in 1/nm^3 and nm^3.

    Raises
    ------
    InputError
        For a concentration that is negative, a volume that is not positive, or 1e15 monomers or more in it.
    """

    concentration: float
    volume: float | None = None

    if TYPE_CHECKING:

        def __init__(self, concentration: Scalar, volume: Scalar | None = None) -> None: ...

    def __post_init__(self) -> None:
        object.__setattr__(self, "concentration", as_number_density(self.concentration, "concentration of monomers"))
        if self.volume is not None:
            object.__setattr__(self, "volume", positive(self.volume, VOLUME, "volume of a pool of monomers"))
            if self.concentration * self.volume >= _MOST_MONOMERS_OF_POOL:
                raise InputError(
                    f"A pool of {self.concentration * self.volume:.3g} monomers has more than the "
                    f"{_MOST_MONOMERS_OF_POOL:.0e} that are counted one by one: leave its volume out."
                )


@dataclass(frozen=True, kw_only=True)
class DynamicInstability:
    """An end that grows and shrinks in turn, as those of microtubules do.

    While it grows, it has the rates of its monomers; a catastrophe turns it, and a rescue turns it back. With the speed
    v+ of growth and v- of shrinking, lengths are exponential with the mean v+ v-/(v- f_cat - v+ f_res) where this is
    positive, and grow without end otherwise (Dogterom and Leibler, Phys. Rev. Lett. 1993, 70, 1347).

    Parameters
    ----------
    catastrophe_rate, rescue_rate : 1/time
        f_cat of a growing end, and f_res of one that shrinks.
    shrinking_off_rate : 1/time
        How many monomers it loses per time while it shrinks: v-/length of a monomer.
    shrinking_on_rate : volume/time, or 1/(concentration*time)
        k_on while it shrinks.

    The attributes hold plain numbers, in 1/ps and nm^3/ps.

    Raises
    ------
    InputError
        For a rate that is negative or not finite.
    """

    catastrophe_rate: float
    rescue_rate: float
    shrinking_off_rate: float
    shrinking_on_rate: float = 0.0

    if TYPE_CHECKING:

        def __init__(
            self,
            *,
            catastrophe_rate: Scalar,
            rescue_rate: Scalar,
            shrinking_off_rate: Scalar,
            shrinking_on_rate: Scalar = 0.0,
        ) -> None: ...

    def __post_init__(self) -> None:
        for name in ("catastrophe_rate", "rescue_rate", "shrinking_off_rate"):
            object.__setattr__(self, name, non_negative(getattr(self, name), RATE, name))
        object.__setattr__(self, "shrinking_on_rate", _as_on_rate(self.shrinking_on_rate, "shrinking_on_rate"))

    @property
    def rates(self) -> tuple[float, float, float, float]:
        """The rates while it shrinks, on and off, and those of catastrophes and rescues."""
        return self.shrinking_on_rate, self.shrinking_off_rate, self.catastrophe_rate, self.rescue_rate


@dataclass(frozen=True, kw_only=True)
class Growth:
    """How a filament grows and shrinks at its ends, with detailed balance.

    An end gains k_on c monomers per time and loses k_off while it is free. Where a wall or contacts of this package are
    in its way, it gains k_on c min(1, exp(-dV/k_BT)) with dV the change of their energy, and loses
    k_off min(1, exp(-dV/k_BT)); so it stalls at the force (k_BT/delta) ln(k_on c/k_off). Within a step, monomers come
    and go while all else stands still. The segment at an end has half as many monomers as others, or up to half
    as many more; lengths and bends keep their equilibrium whatever monomers come and go.

    Parameters
    ----------
    monomers : Monomers
        Such as ACTIN_ATP. A segment of the filament's type is a whole number of monomers long.
    pool : MonomerPool, or a concentration
        Filaments that are given the same pool share it.
    longest : length
        For which the filament has nodes, wherever its joints are: it may become up to two segments longer. An end that
        has no node left waits, and ``FilamentGrowth.waited`` counts how often.
    shortest : length, optional
        To which it shrinks at most; half a segment if not given.
    plus_capped, minus_capped : bool
        A capped end neither gains nor loses monomers.
    plus_instability, minus_instability : DynamicInstability, optional
        Of an end that grows and shrinks in turn. It begins by growing, and one that has shrunk to the end waits to be
        rescued.

    Raises
    ------
    InputError
        For a value that is missing or wrong, a ``longest`` that is not longer than ``shortest``, or two capped ends.
    """

    monomers: Monomers
    pool: MonomerPool
    longest: float
    shortest: float | None = None
    plus_capped: bool = False
    minus_capped: bool = False
    plus_instability: DynamicInstability | None = None
    minus_instability: DynamicInstability | None = None

    if TYPE_CHECKING:

        def __init__(
            self,
            *,
            monomers: Monomers,
            pool: MonomerPool | Scalar,
            longest: Scalar,
            shortest: Scalar | None = None,
            plus_capped: bool = False,
            minus_capped: bool = False,
            plus_instability: DynamicInstability | None = None,
            minus_instability: DynamicInstability | None = None,
        ) -> None: ...

    def __post_init__(self) -> None:
        require_kind(self.monomers, Monomers, "monomers")
        if not isinstance(self.pool, MonomerPool):
            object.__setattr__(self, "pool", MonomerPool(self.pool))
        object.__setattr__(self, "longest", positive(self.longest, LENGTH, "longest"))
        if self.shortest is not None:
            object.__setattr__(self, "shortest", positive(self.shortest, LENGTH, "shortest"))
            if self.shortest >= self.longest:
                raise InputError(f"longest must exceed shortest, {self.shortest:g} nm, but is {self.longest:g} nm.")
        for name in ("plus_capped", "minus_capped"):
            true_or_false(getattr(self, name), name)
        for end in ("plus", "minus"):
            instability = getattr(self, f"{end}_instability")
            if instability is not None:
                require_kind(instability, DynamicInstability, f"{end}_instability")
                if getattr(self, f"{end}_capped"):
                    raise InputError(f"The {end} end is capped, and has a dynamic instability: leave one of them out.")
        if self.plus_capped and self.minus_capped:
            raise InputError("A filament with two capped ends does not grow: leave its growth out.")

    def rates(self, end: str) -> tuple[float, float]:
        """k_on in nm^3/ps and k_off in 1/ps of the "plus" or "minus" end; zero if it is capped."""
        if getattr(self, f"{end}_capped"):
            return 0.0, 0.0
        return getattr(self.monomers, f"{end}_on_rate"), getattr(self.monomers, f"{end}_off_rate")

    def instability(self, end: str) -> DynamicInstability | None:
        """That of the "plus" or "minus" end."""
        instability: DynamicInstability | None = getattr(self, f"{end}_instability")
        return instability

    def monomers_per_segment(self, filament_type: FilamentType) -> int:
        """The monomers of a segment; InputError if they are not a whole number from 2 on."""
        ratio = filament_type.segment_length / self.monomers.length
        number = round(ratio)
        if abs(ratio - number) > _SAME_LENGTH * ratio or not 2 <= number <= _MOST_MONOMERS_OF_SEGMENT:
            suggested = min(max(number, 2), _MOST_MONOMERS_OF_SEGMENT)
            length = suggested * self.monomers.length
            raise InputError(
                f"segments of {filament_type.segment_length:g} nm have {ratio:g} monomers of {self.monomers.length:g} "
                f"nm. A filament that grows needs a whole number of them, from 2 to {_MOST_MONOMERS_OF_SEGMENT}: take "
                f"the type's with_segment_length({length:g}), which are {suggested} monomers."
            )
        return number

    def fewest_monomers(self, filament_type: FilamentType) -> int:
        """The fewest monomers of the filament."""
        if self.shortest is None:
            return max(2, self.monomers_per_segment(filament_type) // 2)
        return max(2, round(self.shortest / self.monomers.length))

    def count_nodes(self, filament_type: FilamentType) -> int:
        """How many nodes the longest filament may need."""
        per_segment = self.monomers_per_segment(filament_type)
        most = int(np.ceil(self.longest / self.monomers.length))
        return max(0, most - 2 * (per_segment // 2)) // per_segment + 3


def _as_on_rate(rate, name):
    if isinstance(rate, unit.Quantity) and rate.unit.is_compatible(_PER_AMOUNT):
        rate = in_units_of(rate, ON_RATE / unit.mole, name) / AVOGADRO
    return non_negative(rate, ON_RATE, name)


def check_growth(
    growth: Growth, filament_type: ChainType, segments: int, closed: bool, clamped: Indices, label: str
) -> int:
    """The number of spare nodes of a filament that grows; InputError if it cannot."""
    require_kind(growth, Growth, f"{label}: growth")
    if not (isinstance(filament_type, FilamentType) and filament_type.segment_kind.straight) or closed:
        raise InputError(f"{label}: only open filaments of straight segments grow.")
    if filament_type.friction_length == "filament":
        raise InputError(
            f"{label}: the friction of its segments is that of the length of the filament, which changes as it grows. "
            "Give its type a friction_length that is a length, such as the one that it mostly has."
        )
    if tuple(clamped) not in ((), (0,)) or (clamped and not growth.minus_capped):
        raise InputError(
            f"{label}: of a filament that grows, the first node alone may be clamped, if growth has minus_capped=True."
        )
    try:
        per_segment, fewest = growth.monomers_per_segment(filament_type), growth.fewest_monomers(filament_type)
        _shortest_segment(filament_type, growth, min(fewest, per_segment // 2))
    except InputError as error:
        raise InputError(f"{label}: {error}") from None
    length = segments * filament_type.segment_length
    if segments * per_segment < fewest or length > growth.longest * (1.0 + _SAME_LENGTH):
        raise InputError(
            f"{label} is {length:g} nm long, but its growth has filaments between {fewest * growth.monomers.length:g} "
            f"and {growth.longest:g} nm."
        )
    return max(0, growth.count_nodes(filament_type) - segments - 1)


def _shortest_segment(filament_type, growth, fewest):
    # The fewest monomers of a segment that has friction, at most so many.
    length = growth.monomers.length
    for monomers in range(1, fewest + 1):
        try:
            segment_of_length(filament_type, monomers * length)
        except InputError as error:
            if monomers == fewest:
                raise InputError(
                    f"segments at its ends may be {fewest * length:g} nm long, for which they have no friction "
                    f"({error}) Take longer segments, a larger shortest, or a friction_length."
                ) from None
        else:
            return monomers
    raise AssertionError("The loop returns or raises.")


def segment_of_length(filament_type: FilamentType, length: float) -> FilamentType:
    """The type of a segment of another length in nm, of the same material; InputError if it has no friction.

    Of a type that has the stiffness of a segment, that of its material.
    """
    modulus = filament_type.segment_stiffness * filament_type.segment_length
    material = replace(filament_type, stretching_stiffness=None, stretching_modulus=modulus)
    return material.with_segment_length(length)


def segments_by_monomers(
    growth: Growth, filament_type: FilamentType, viscosity: float, temperature: float, propulsion: float
) -> FloatArray:
    """What segments with 1, 2, ..., twice ``monomers_per_segment`` monomers are: (segments, 8).

    Rest length, stretching stiffness, maximum extension, the parallel, perpendicular, rotational and extensional
    friction, and propulsion. Those that are too short for friction, which no filament has, have that of the next one.
    """
    per_segment = growth.monomers_per_segment(filament_type)
    least = _shortest_segment(filament_type, growth, min(growth.fewest_monomers(filament_type), per_segment // 2))
    rows = []
    for monomers in range(1, 2 * per_segment + 1):
        length = monomers * growth.monomers.length
        own = segment_of_length(filament_type, max(monomers, least) * growth.monomers.length)
        friction = own.segment_friction(viscosity, temperature, 1)
        extension = 0.0 if filament_type.maximum_extension is None else own.maximum_extension
        stiffness = own.segment_stiffness
        frictions = (friction.parallel, friction.perpendicular, friction.rotational, friction.extensional)
        rows.append([length, stiffness, extension, *frictions, propulsion * monomers / per_segment])
    return np.array(rows)


def joints_by_monomers(growth: Growth, filament_type: FilamentType) -> FloatArray:
    """Stiffness in kJ/mol of joints whose two segments have 2, 3, ... three times ``monomers_per_segment`` monomers."""
    per_segment = growth.monomers_per_segment(filament_type)
    lengths = 0.5 * growth.monomers.length * np.arange(2, 3 * per_segment + 1)
    return np.array([filament_type.stiffness_of_joint(length) for length in lengths])
