"""How a hand follows the helix of filaments with twist: polymerases."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

from ..errors import InputError
from ..units.quantities import ENERGY, LENGTH, ROTATIONAL_FRICTION, finite_number, non_negative, positive
from ..units.types import Scalar


@dataclass(frozen=True, kw_only=True)
class HandOnHelix:
    """How a hand follows the helix of filaments with twist, as a polymerase does that of DNA.

    Where it is bound, the hand turns about the filament as the material does there; and as it walks by dx, by
    ``(2 pi/pitch + (m - m0)/l0) dx`` more, with the twist m of the joint there, m0 at rest. Against all this is its
    ``rotational_friction``, with the noise that belongs to it. A hand that hardly turns has the filament turn in its
    place: it is overwound ahead, and underwound behind, by one turn for each pitch (Liu and Wang, Proc. Natl. Acad.
    Sci. USA 1987, 84, 7024). Turns are those about the filament, without what its direction makes of them: the
    filament carries the hand along as it bends. The whole of the filament keeps its linking number.

    Parameters
    ----------
    pitch : length
        Of a turn of the helix at rest, positive if it is right-handed: 3.57 nm for 10.5 base pairs of DNA.
    rotational_friction : energy time
        Torque over angular velocity of the hand, and of what is bound to it. That of a body which is held is large: it
        turns by the torque times the time over it. Zero for a hand that turns freely.
    stall_torque : energy, optional
        With the torque T of the filament against going on, the hand walks with the speed ``speed (1 + F_w/stall_force -
        T/stall_torque)``, within the bounds of a ``Hand``. Without it, no torque changes the speed.
    torque_range : length
        T is that of joints ahead of the hand less that of joints behind, each of them a mean over so long a part of the
        filament on that side. One joint of 5 nm has thermal torques of 18 pN nm, 100 nm of DNA of 4 pN nm.

    Raises
    ------
    InputError
        For a pitch of zero, a friction that is negative, or others that are not positive.
    """

    pitch: float
    rotational_friction: float
    stall_torque: float | None = None
    torque_range: float = 100.0

    if TYPE_CHECKING:

        def __init__(
            self,
            *,
            pitch: Scalar,
            rotational_friction: Scalar,
            stall_torque: Scalar | None = None,
            torque_range: Scalar = 100.0,
        ) -> None: ...

    def __post_init__(self) -> None:
        def convert(name, check, target):
            object.__setattr__(self, name, check(getattr(self, name), target, f"HandOnHelix: {name}"))

        convert("pitch", finite_number, LENGTH)
        convert("rotational_friction", non_negative, ROTATIONAL_FRICTION)
        convert("torque_range", positive, LENGTH)
        if self.stall_torque is not None:
            convert("stall_torque", positive, ENERGY)
        if self.pitch == 0.0:
            raise InputError("HandOnHelix: pitch must not be zero; leave the helix of a hand out that follows none.")
