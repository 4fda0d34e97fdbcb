"""Crosslinker: a spring between two hands, or between an anchor and a hand."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ..errors import InputError
from ..units.quantities import (
    DIMENSIONLESS,
    LENGTH,
    STIFFNESS,
    in_units_of,
    non_negative,
    positive,
    require_kind,
    shown,
    thermal_energy,
    true_or_false,
)
from ..units.types import Scalar
from .hand import Hand


@dataclass(frozen=True, kw_only=True)
class Crosslinker:
    """A linker: a spring with the energy (k/2) (d - d0)^2 of its length d, and a hand at each end.

    With hands that walk it is a motor, or, with a ``loading_distance``, an extruder of loops. Arguments are keywords
    and take ``openmm.unit`` quantities or plain numbers in OpenMM's units; the attributes hold plain numbers in
    OpenMM's units (nm, kJ/mol).

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
    cosine_range : two floats
        The second hand to bind does so where the cosine of the angle between both filaments is between these: (0.5, 1)
        joins those that are parallel within 60 degrees, (-1, -0.5) those that are antiparallel.
    trans_activated : bool
        The second hand binds only while the first one is bound, and that one only before it.
    reversible : bool
        Whether hands unbind only where and when they could bind by ``cosine_range`` and ``trans_activated``: what is
        bound stays where filaments turn out of the range, and the first hand stays as long as the second one is bound.
        Without it they always unbind, which breaks detailed balance.
    loading_distance : length, optional
        Both hands bind in one event, to one filament: the first one, with its ``binding_rate``, and the second one so
        far from it towards the plus end. They unbind in one event, with the sum of both rates, also where one of them
        lets go at an end. A first hand that walks to the minus end and a second one to the plus end extrude a loop.
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
    cosine_range: tuple[float, float] = (-1.0, 1.0)
    trans_activated: bool = False
    reversible: bool = True
    loading_distance: float | None = None

    if TYPE_CHECKING:  # What may be given; the attributes hold plain numbers.

        def __init__(
            self,
            *,
            hands: Hand | Sequence[Hand],
            stiffness: Scalar,
            rest_length: Scalar = 0.0,
            same_filament: bool = False,
            name: str = "crosslinker",
            cosine_range: Sequence[float] = (-1.0, 1.0),
            trans_activated: bool = False,
            reversible: bool = True,
            loading_distance: Scalar | None = None,
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

        true_or_false(self.trans_activated, f"{label} trans_activated")
        true_or_false(self.reversible, f"{label} reversible")
        object.__setattr__(self, "cosine_range", _as_cosines(self.cosine_range, f"{label} cosine_range"))
        if self.loading_distance is not None:
            object.__setattr__(self, "loading_distance", self._checked_loading(label))

    def _checked_loading(self, label):
        distance = positive(self.loading_distance, LENGTH, f"{label} loading_distance")
        if self.has_rules:
            raise InputError(f"{label} give loading_distance, or cosine_range or trans_activated, not both.")
        spacing = self.hands[1].site_spacing
        if spacing is not None and distance < spacing:
            raise InputError(
                f"{label} loading_distance must be at least the site_spacing of the second hand, {spacing:g} nm: a "
                "site holds one hand."
            )
        if any(hand.filament_end is not None and hand.filament_end.binds_there for hand in self.hands):
            raise InputError(f"{label} hands that bind at ends have no loading_distance.")
        return distance

    @property
    def has_rules(self) -> bool:
        """Whether which hand binds, or where, depends on the other one."""
        return self.trans_activated or self.cosine_range != (-1.0, 1.0)

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


def _as_cosines(given, label):
    cosines = np.asarray(in_units_of(given, DIMENSIONLESS, label))
    if cosines.shape != (2,) or not -1.0 <= cosines[0] < cosines[1] <= 1.0:
        raise InputError(f"{label} must be two numbers that ascend, between -1 and 1, but is {shown(given)}.")
    return tuple(cosines.tolist())
