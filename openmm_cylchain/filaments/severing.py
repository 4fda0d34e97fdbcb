"""Severing: how filaments that grow are cut at random."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from ..units.quantities import LENGTH, RATE, non_negative, true_or_false
from ..units.types import Scalar
from .end_states import as_tuple


@dataclass(frozen=True, kw_only=True)
class Severing:
    """How a filament is cut at random, between any two of its monomers.

    Both parts are filaments then, and lengths and bends keep their equilibrium. The part at the plus end becomes one of
    those that ``Filaments.add_reserve`` has added. A part that is shorter than ``Growth.shortest`` vanishes if its
    filament ``vanishes``, and filaments are not cut there if not.

    Cofilin of fission yeast cuts filaments of ADP-actin 0.032 times per second in 1000 monomers, 0.012/s in each um, at
    the concentration at which it cuts most (Chen and Pollard, J. Cell Biol. 2011, 195, 485).

    Parameters
    ----------
    rate : 1/(length*time)
        How often in a length.
    of_states : sequence of str, optional
        Of monomers with states (``Monomers.aging``): the names of those before which it is cut; any if not given.
    shrinks : bool
        New plus ends shrink, where these have a dynamic instability.

    The attributes hold plain numbers, in 1/(nm ps).

    Raises
    ------
    InputError
        For a rate that is negative or not finite.
    """

    rate: float
    of_states: tuple[str, ...] = ()
    shrinks: bool = False

    if TYPE_CHECKING:

        def __init__(self, *, rate: Scalar, of_states: Sequence[str] = (), shrinks: bool = False) -> None: ...

    def __post_init__(self) -> None:
        object.__setattr__(self, "rate", non_negative(self.rate, RATE / LENGTH, "rate of severing"))
        object.__setattr__(self, "of_states", as_tuple(self.of_states, "Severing: of_states"))
        true_or_false(self.shrinks, "Severing: shrinks")
