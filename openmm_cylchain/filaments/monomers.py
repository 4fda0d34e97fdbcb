"""Monomers: what filaments grow of, how it ages, and where it comes from."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from openmm import unit

from ..errors import InputError
from ..units.quantities import (
    AVOGADRO,
    LENGTH,
    NUMBER_DENSITY,
    RATE,
    VOLUME,
    as_number_density,
    non_negative,
    one_of,
    positive,
    require_kind,
)
from ..units.types import Scalar
from .end_states import ENDS, GROWING, EndStates, as_on_rate, as_tuple, check_state_name

_MOST_MONOMERS_OF_POOL = 1e15
_NEW = "new"
"""The name of the state that monomers come in, of those that age."""


@dataclass(frozen=True, kw_only=True)
class MonomerState:
    """A state that monomers come to after some time, such as that with ADP, and the rates of ends where they are last.

    Parameters
    ----------
    name : str
    rate : 1/time
        At which monomers come to it from the state before.
    plus_off_rate, minus_off_rate : 1/time
        k_off of such monomers.
    plus_on_rate, minus_on_rate : volume/time, or 1/(concentration*time), optional
        k_on of new monomers at such ends; that of ``Monomers`` if not given.

    The attributes hold plain numbers, in nm^3/ps and 1/ps.

    Raises
    ------
    InputError
        For a rate that is negative or not finite.
    """

    name: str
    rate: float
    plus_off_rate: float = 0.0
    minus_off_rate: float = 0.0
    plus_on_rate: float | None = None
    minus_on_rate: float | None = None

    if TYPE_CHECKING:

        def __init__(
            self,
            *,
            name: str,
            rate: Scalar,
            plus_off_rate: Scalar = 0.0,
            minus_off_rate: Scalar = 0.0,
            plus_on_rate: Scalar | None = None,
            minus_on_rate: Scalar | None = None,
        ) -> None: ...

    def __post_init__(self) -> None:
        check_state_name(self.name)
        for name in ("rate", "plus_off_rate", "minus_off_rate"):
            object.__setattr__(self, name, non_negative(getattr(self, name), RATE, f"{self.name}: {name}"))
        for name in ("plus_on_rate", "minus_on_rate"):
            if getattr(self, name) is not None:
                object.__setattr__(self, name, as_on_rate(getattr(self, name), f"{self.name}: {name}"))


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
    aging : sequence of MonomerState, optional
        To which monomers come one after the other, at random, wherever they are in a filament. New ones are as above;
        those of a filament that is added are in the last state.

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
    aging: tuple[MonomerState, ...] = ()

    if TYPE_CHECKING:

        def __init__(
            self,
            *,
            length: Scalar,
            plus_on_rate: Scalar = 0.0,
            plus_off_rate: Scalar = 0.0,
            minus_on_rate: Scalar = 0.0,
            minus_off_rate: Scalar = 0.0,
            aging: Sequence[MonomerState] = (),
        ) -> None: ...

    def __post_init__(self) -> None:
        object.__setattr__(self, "aging", as_tuple(self.aging, "aging"))
        for state in self.aging:
            require_kind(state, MonomerState, "aging")
        names = [_NEW, *(state.name for state in self.aging)]
        if len(set(names)) < len(names):
            raise InputError(f"States of monomers need names of their own, but are {', '.join(names)}.")
        object.__setattr__(self, "length", positive(self.length, LENGTH, "length of a monomer"))
        for end in ("plus", "minus"):
            on, off = f"{end}_on_rate", f"{end}_off_rate"
            object.__setattr__(self, on, as_on_rate(getattr(self, on), on))
            object.__setattr__(self, off, non_negative(getattr(self, off), RATE, off))

    def states(self, end: str) -> EndStates:
        """Those of the "plus" or "minus" end: one, or those of the last monomer if monomers age.

        InputError for another end.
        """
        one_of(end, ENDS, "end")
        first_on, first_off = getattr(self, f"{end}_on_rate"), getattr(self, f"{end}_off_rate")
        on_rates, off_rates = [first_on], [first_off]
        switches = np.zeros((1 + len(self.aging), 1 + len(self.aging)))
        for number, state in enumerate(self.aging):
            own = getattr(state, f"{end}_on_rate")
            on_rates.append(first_on if own is None else own)
            off_rates.append(getattr(state, f"{end}_off_rate"))
            switches[number, number + 1] = state.rate
        return EndStates(
            on_rates=on_rates,
            off_rates=off_rates,
            switch_rates=switches.tolist(),
            after_gain=[0] * len(on_rates),
            names=(_NEW, *(state.name for state in self.aging)) if self.aging else (GROWING,),
        )

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
