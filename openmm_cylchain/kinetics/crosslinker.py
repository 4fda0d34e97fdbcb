"""Crosslinker: a spring between two hands, or between an anchor and a hand."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from ..errors import InputError
from ..units.quantities import LENGTH, STIFFNESS, non_negative, positive, require_kind, thermal_energy, true_or_false
from ..units.types import Scalar
from .hand import Hand


@dataclass(frozen=True, kw_only=True)
class Crosslinker:
    """A linker: a spring with the energy (k/2) (d - d0)^2 of its length d, and a hand at each end.

    With hands that walk it is a motor. Arguments are keywords and take ``openmm.unit`` quantities or plain numbers in
    OpenMM's units; the attributes hold plain numbers in OpenMM's units (nm, kJ/mol).

    Parameters
    ----------
    hands : Hand, or two of them
        One Hand stands for two equal ones, or for that of a linker which is anchored at its other end.
    stiffness : energy/length^2
        k of the spring.
    rest_length : length
        d0; may be zero.
    same_filament : bool
        Whether both hands may bind to one filament.
    name : str
        For tables and messages.

    Raises
    ------
    InputError
        For a value that is missing, not finite, negative, or of the wrong unit, or for more than two hands.
    """

    hands: tuple[Hand, Hand]
    stiffness: float
    rest_length: float = 0.0
    same_filament: bool = False
    name: str = "crosslinker"

    if TYPE_CHECKING:  # What may be given; the attributes hold plain numbers.

        def __init__(
            self,
            *,
            hands: Hand | Sequence[Hand],
            stiffness: Scalar,
            rest_length: Scalar = 0.0,
            same_filament: bool = False,
            name: str = "crosslinker",
        ) -> None: ...

    def __post_init__(self) -> None:
        given = [self.hands, self.hands] if isinstance(self.hands, Hand) else self.hands
        hands = tuple(given) if isinstance(given, Sequence) else ()
        if len(hands) != 2 or not all(isinstance(hand, Hand) for hand in hands):
            raise InputError(f"Crosslinker {self.name!r}: hands must be a Hand or two of them, but are {self.hands!r}.")
        require_kind(self.name, str, "Crosslinker: name")
        label = f"Crosslinker {self.name!r}:"
        true_or_false(self.same_filament, f"{label} same_filament")
        object.__setattr__(self, "hands", hands)
        object.__setattr__(self, "stiffness", positive(self.stiffness, STIFFNESS, f"{label} stiffness"))
        object.__setattr__(self, "rest_length", non_negative(self.rest_length, LENGTH, f"{label} rest_length"))

    @property
    def is_motor(self) -> bool:
        """Whether one of its hands walks."""
        return any(hand.speed != 0.0 for hand in self.hands)

    def energy_at_reach(self, hand: Hand, temperature: Scalar) -> float:
        """The energy of the spring at the reach of a hand, in k_B T: beyond it nothing binds.

        Where this is small, or the reach is below the rest length, the reach cuts off places that the spring would
        allow, so that the equilibrium of bound linkers is not that of their energies.
        """
        require_kind(hand, Hand, "hand")
        extension = hand.reach - self.rest_length
        kT = thermal_energy(temperature)
        energy = 0.5 * self.stiffness * extension * abs(extension)
        return energy / kT if kT > 0.0 else math.copysign(math.inf, energy)
