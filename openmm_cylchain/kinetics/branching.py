"""Branches: filaments that begin on the side of others, at an angle that a joint of linkers holds."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ..couplings.shapes import Box, Sphere
from ..errors import InputError
from ..filaments.filament_type import FilamentType
from ..filaments.growth import Growth
from ..units.quantities import (
    ANGLE,
    ENERGY,
    FORCE,
    LENGTH,
    PICONEWTON,
    RATE,
    STIFFNESS,
    non_negative,
    positive,
    thermal_energy,
    whole_numbers,
)
from ..units.types import Indices, Scalar
from .crosslinker import Crosslinker
from .hand import Hand
from .linkers import Linkers
from .nucleation import Nucleation

_PER_LENGTH = RATE / LENGTH
_MOST_THERMAL_FORCE = 5.0
"""Of the spring, in debranching forces: more is so seldom what lets go that steps do not see it."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Branching(Nucleation):
    """Filaments that begin as branches on the side of others, as those do that Arp2/3 complex nucleates.

    A branch begins anywhere on its mother with the same chance, at an angle theta towards its plus end that is drawn
    from sin(theta) exp(-K (theta-theta0)^2/2k_BT). Linkers hold it there: one its first node on the mother, and a strut
    between points at the distance ``lever`` from there on both, which has the stiffness K against changes of the angle.
    When one of them lets go, because it unbinds or the mother has shrunk past it, all do. The minus end should be
    capped (``Growth.minus_capped``), as it is by Arp2/3.

    Parameters
    ----------
    rate : 1/(length*time)
        For each length of mothers, at the first concentration of monomers.
    mothers : sequence of int, optional
        The numbers of filaments that have branches; all that grow, also branches, if not given.
    angle : angle
        theta0.
    angular_stiffness : energy
        K. 70 +- 7 degrees are 275 pN nm (Blanchoin et al., Nature 2000, 404, 1007, from electron micrographs).
    stiffness : energy/length^2
        Of the spring at the first node.
    lever : length
    distance : length
        From the axis of the mother to the first node: with contacts, that of two axes that touch.
    debranching_rate : 1/time
        k of a branch without a load.
    debranching_force : force, optional
        F_u of the rate k exp(F/F_u)/m with the force F of the spring at the first node (Bell, Science 1978, 200, 618).
        m is the ``thermal_factor``, so that the rate without a load is k. With a constant load f it is between
        k exp(f/F_u), with soft springs, and k sinh(f/F_u)/(f/F_u), with stiff ones whose load has any direction.
    region, length, order
        As of ``Nucleation``; the region is where mothers have branches, which is anywhere if not given.

    The attributes hold plain numbers, in OpenMM's units.

    Raises
    ------
    InputError
        For a value that is negative, not finite or of the wrong unit, or a joint that cannot hold an angle.
    """

    mothers: Sequence[int] | None = None
    angle: float = np.deg2rad(70.0)
    angular_stiffness: float = 275.0 * 0.602214076
    stiffness: float = 40.0 * 0.602214076
    lever: float = 10.0
    distance: float = 0.0
    debranching_rate: float = 0.0
    debranching_force: float | None = None

    if TYPE_CHECKING:

        def __init__(
            self,
            *,
            rate: Scalar,
            mothers: Indices | None = None,
            angle: Scalar = ...,
            angular_stiffness: Scalar = ...,
            stiffness: Scalar = ...,
            lever: Scalar = ...,
            distance: Scalar = ...,
            debranching_rate: Scalar = ...,
            debranching_force: Scalar | None = None,
            region: Sphere | Box | None = None,
            length: Scalar | None = None,
            order: int = 0,
        ) -> None: ...

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.direction is not None:
            raise InputError("Branches have the direction of their angle: leave direction out.")
        for name, check, target in (
            ("angle", positive, ANGLE),
            ("angular_stiffness", positive, ENERGY),
            ("stiffness", positive, STIFFNESS),
            ("lever", positive, LENGTH),
            ("distance", non_negative, LENGTH),
            ("debranching_rate", non_negative, RATE),
        ):
            object.__setattr__(self, name, check(getattr(self, name), target, f"Branching: {name}"))
        if self.debranching_force is not None:
            force = positive(self.debranching_force, FORCE, "Branching: debranching_force")
            object.__setattr__(self, "debranching_force", force)
        if self.mothers is not None:
            mothers = tuple(whole_numbers(self.mothers, 0, "Branching: mothers"))
            if not mothers:
                raise InputError("Branching: mothers has no filament: leave it out for all that grow.")
            if len(set(mothers)) < len(mothers):
                raise InputError(f"Branching: mothers has a filament twice: {list(mothers)}.")
            object.__setattr__(self, "mothers", mothers)
        if not (self.angle < np.pi and abs(self._slope) > 0.1 * self.lever):
            raise InputError(
                f"A strut at a lever of {self.lever:g} nm does not hold an angle of {np.rad2deg(self.angle):g} "
                "degrees: take another angle or lever."
            )

    def monomers(self, growth: Growth, filament_type: FilamentType) -> int:
        """As that of ``Nucleation``; InputError also for branches that a strut cannot hold."""
        number = super().monomers(growth, filament_type)
        if number * growth.monomers.length < self.lever:
            raise InputError(
                f"Branches begin with {number * growth.monomers.length:g} nm, on which the strut of their joint, at "
                f"the lever {self.lever:g} nm, finds no place: give them a larger length."
            )
        return number

    def _convert_rate(self) -> None:
        object.__setattr__(self, "rate", non_negative(self.rate, _PER_LENGTH, "rate of branching"))

    def whole_rate(self, box: object, mothers: float = 1.0) -> float:
        """J in 1/ps on mothers of a length in nm, wherever these are."""
        return self.rate * mothers

    @property
    def _strut(self):
        # From the mother to the branch, in the plane of both.
        return self.lever * np.array([np.cos(self.angle) - 1.0, np.sin(self.angle)]) + [0.0, self.distance]

    @property
    def _slope(self):
        # By how much the strut becomes longer with the angle.
        turned = self.lever * np.array([-np.sin(self.angle), np.cos(self.angle)])
        return float(turned @ self._strut / np.linalg.norm(self._strut))

    @property
    def springs(self) -> list[tuple[float, float, float, float]]:
        """Rest length in nm and stiffness of each spring, and where it holds the mother and the branch, in nm."""
        strut = float(np.linalg.norm(self._strut))
        springs = [(self.distance, self.stiffness, 0.0, 0.0)]
        if self.distance > 0.0:
            springs.append((float(np.hypot(self.distance, self.lever)), self.stiffness, self.lever, 0.0))
        return [*springs, (strut, self.angular_stiffness / self._slope**2, self.lever, self.lever)]

    def thermal_factor(self, temperature: Scalar) -> float:
        """The mean m of exp(F/F_u) by thermal motion of the spring at the first node, where no load acts on a branch.

        With a = sqrt(k k_BT)/F_u and the normal distribution Phi, it is 2 exp(a^2/2) Phi(a) of a spring whose length is
        about the ``distance``, if that is some of its thermal lengths sqrt(k_BT/k), and, of one without rest length,

            m = 2 (1 + a^2) exp(a^2/2) Phi(a) + a sqrt(2/pi)

        The strut changes nothing in that: its share of the partition function of straight filaments, summed over the
        directions of a branch, is proportional to 1/q of the distance q of the first node from where it holds the
        mother, which has the same mean over all directions of the spring as without the spring.

        Raises
        ------
        InputError
            For springs whose thermal motion has forces sqrt(k k_BT) of more than 5 F_u.
        """
        if self.debranching_force is None:
            return 1.0
        force = math.sqrt(self.stiffness * thermal_energy(temperature))
        share = force / self.debranching_force
        if share > _MOST_THERMAL_FORCE:
            raise InputError(
                f"Branching: thermal motion pulls at the spring of a branch with {force / PICONEWTON:.3g} pN, over "
                f"{_MOST_THERMAL_FORCE:g} times the debranching_force, {self.debranching_force / PICONEWTON:.3g} pN: "
                "give it a smaller stiffness."
            )
        along = math.exp(0.5 * share**2) * (1.0 + math.erf(share / math.sqrt(2.0)))
        if self.distance > 0.0:
            return along
        return (1.0 + share**2) * along + share * math.sqrt(2.0 / math.pi)

    def linkers(self, name: str, temperature: Scalar) -> list[Linkers]:
        """The linkers of its joint, which bind by themselves to nothing: those that branches begin with."""
        still = Hand(binding_rate=0.0, reach=self.lever, unbinding_rate=0.0)
        own = Hand(
            binding_rate=0.0,
            reach=self.lever,
            unbinding_rate=self.debranching_rate / self.thermal_factor(temperature),
            unbinding_force=self.debranching_force,
        )
        joints = []
        for number, (rest_length, stiffness, _, _) in enumerate(self.springs):
            hands = (still, own if number == 0 else still)
            kind = Crosslinker(
                hands=hands, stiffness=stiffness, rest_length=rest_length, same_filament=True, name=f"{name}_{number}"
            )
            joints.append(Linkers(kind, 0, 0.0, None, None, 0, 0))
        return joints
