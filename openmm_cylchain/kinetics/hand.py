"""Hand: how one end of a linker binds to filaments, walks along them and unbinds."""

from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import TYPE_CHECKING

from ..errors import InputError
from ..filaments.chain_type import ChainType
from ..units.quantities import (
    DIMENSIONLESS,
    FORCE,
    FRICTION,
    LENGTH,
    RATE,
    VELOCITY,
    finite_number,
    non_negative,
    one_of,
    positive,
    require_kind,
    shown,
    true_or_false,
)
from ..units.types import Scalar
from .binding_range import BindingRange
from .hand_at_end import HandAtEnd
from .hand_on_helix import HandOnHelix

AT_ENDS = ("release", "hold")
"""What a hand may do at the end of a filament to which it has walked or slid."""

_OPTIONAL = ("unbinding_force", "catch_force", "stall_force", "site_spacing", "sliding_friction")


@dataclass(frozen=True, kw_only=True)
class Hand:
    """One end of a linker: an immutable description.

    All arguments are keywords and take ``openmm.unit`` quantities or plain numbers in OpenMM's units; the attributes
    hold plain numbers in OpenMM's units (nm, ps, kJ/mol).

    With the energy U and the tension F of the spring between the two ends of a linker, a hand

    - binds to a place within its reach with the rate ``(binding_rate/(2 reach)) exp(-(1 - strain_share) U/k_B T)`` for
      each length of filament, where the distance is that from the other end of the linker to the place. That is
      ``binding_rate`` for a straight filament through the other end, if the spring is not strained;
    - unbinds with the rate ``unbinding_rate exp(strain_share U/k_B T)``, or, if an ``unbinding_force`` F_u is given,
      with ``unbinding_rate exp(|F|/F_u)`` (Bell, Science 1978, 200, 618). A ``catch_rate`` adds a second pathway, which
      load closes: ``catch_rate exp(-|F|/catch_force)`` (Pereverzev et al., Biophys. J. 2005, 89, 1446);
    - walks with the speed ``speed (1 + F_w/stall_force)`` under the force F_w of the spring along the direction of
      walking, at most twice its ``speed``, and not backward unless ``walks_backward`` (then at most as fast);
    - slides, if it has a ``sliding_friction`` f, with the speed F_t/f under the force F_t of the spring along the
      filament, and at random, with the diffusion coefficient k_B T/f.

    Without ``unbinding_force``, ``catch_rate`` and ``speed``, rates obey detailed balance: the equilibrium of bound and
    unbound linkers is that of their energies.

    Parameters
    ----------
    binding_rate : 1/time
    reach : length
    unbinding_rate : 1/time
    strain_share : float
        lambda, from 0 to 1: which share of the energy of the spring speeds up unbinding, rather than slowing down
        binding.
    unbinding_force : force, optional
    catch_rate : 1/time
    catch_force : force, optional
        Required with a catch_rate.
    speed : velocity
        Without load: towards the plus end, the last node of a filament, if positive; towards the minus end if negative.
    stall_force : force, optional
        If not given, no load changes the speed.
    walks_backward : bool
    at_end : {"release", "hold"}, optional
        What it does at the end of a filament to which it has walked or slid. If not given, a hand that slides stays
        there, as detailed balance needs it, and others let go.
    site_spacing : length, optional
        It binds to sites so far apart along filaments, which hold one hand each, and steps from one to the next. Hands
        of all kinds with the same spacing share their sites.
    binds_to : sequence of FilamentType, BeadSpringType or str, optional
        Types of filaments, or their names; all if not given.
    filament_end : HandAtEnd, optional
        What it has to do with an end of filaments that grow.
    binding_range : BindingRange, optional
        Near which end of filaments it binds, or does not; everywhere if not given.
    sliding_friction : friction, optional
        It slides along filaments, with this friction. Such a hand has no ``speed``, no sites and no ``binding_range``.
    severing_rate : 1/time
        At which it cuts the filament to which it is bound, which must grow, before the nearest monomer: katanin,
        gelsolin, a clump of cofilin. New ends are as ``Growth.severing`` says; the hand stays where it was.
    helix : HandOnHelix, optional
        How it follows the helix of filaments with twist, to which alone it binds then: a polymerase. Such a hand has no
        sites, and does not slide.

    Raises
    ------
    InputError
        For a value that is missing, not finite, negative, or of the wrong unit, or values that exclude each other.
    """

    binding_rate: float
    reach: float
    unbinding_rate: float
    strain_share: float = 0.0
    unbinding_force: float | None = None
    catch_rate: float = 0.0
    catch_force: float | None = None
    speed: float = 0.0
    stall_force: float | None = None
    walks_backward: bool = False
    at_end: str | None = None
    site_spacing: float | None = None
    binds_to: tuple[str, ...] | None = None
    filament_end: HandAtEnd | None = None
    severing_rate: float = 0.0
    binding_range: BindingRange | None = None
    sliding_friction: float | None = None
    helix: HandOnHelix | None = None

    if TYPE_CHECKING:  # What may be given; the attributes hold plain numbers.

        def __init__(
            self,
            *,
            binding_rate: Scalar,
            reach: Scalar,
            unbinding_rate: Scalar,
            strain_share: float = 0.0,
            unbinding_force: Scalar | None = None,
            catch_rate: Scalar = 0.0,
            catch_force: Scalar | None = None,
            speed: Scalar = 0.0,
            stall_force: Scalar | None = None,
            walks_backward: bool = False,
            at_end: str | None = None,
            site_spacing: Scalar | None = None,
            binds_to: Sequence[ChainType | str] | None = None,
            filament_end: HandAtEnd | None = None,
            severing_rate: Scalar = 0.0,
            binding_range: BindingRange | None = None,
            sliding_friction: Scalar | None = None,
            helix: HandOnHelix | None = None,
        ) -> None: ...

    def __post_init__(self) -> None:
        def convert(name, check, target):
            if getattr(self, name) is not None or name not in _OPTIONAL:
                object.__setattr__(self, name, check(getattr(self, name), target, f"Hand: {name}"))

        convert("binding_rate", non_negative, RATE)
        convert("reach", positive, LENGTH)
        convert("unbinding_rate", non_negative, RATE)
        convert("strain_share", non_negative, DIMENSIONLESS)
        convert("unbinding_force", positive, FORCE)
        convert("catch_rate", non_negative, RATE)
        convert("catch_force", positive, FORCE)
        convert("speed", finite_number, VELOCITY)
        convert("stall_force", positive, FORCE)
        convert("site_spacing", positive, LENGTH)
        convert("severing_rate", non_negative, RATE)
        convert("sliding_friction", positive, FRICTION)
        true_or_false(self.walks_backward, "Hand: walks_backward")
        if self.strain_share > 1.0:
            raise InputError(f"Hand: strain_share must be between 0 and 1, but is {self.strain_share:g}.")
        if self.strain_share > 0.0 and self.unbinding_force is not None:
            raise InputError("Hand: give strain_share or unbinding_force, not both: each says how strain unbinds.")
        if (self.catch_rate > 0.0) != (self.catch_force is not None):
            raise InputError("Hand: catch_rate and catch_force must be given together.")
        if self.speed == 0.0 and (self.stall_force is not None or self.walks_backward):
            raise InputError("Hand: stall_force and walks_backward say how it walks, but its speed is zero.")
        if self.sliding_friction is not None:
            for name in ("speed", "site_spacing", "binding_range"):
                if getattr(self, name):
                    raise InputError(f"Hand: give sliding_friction or {name}, not both.")
        if self.helix is not None:
            require_kind(self.helix, HandOnHelix, "Hand: helix")
            if self.site_spacing is not None or self.sliding_friction is not None:
                raise InputError("Hand: one that follows a helix has no site_spacing, and no sliding_friction.")
        if self.at_end is not None:
            one_of(self.at_end, AT_ENDS, "Hand: at_end")
        if self.binding_range is not None:
            require_kind(self.binding_range, BindingRange, "Hand: binding_range")
            if self.filament_end is not None and self.filament_end.binds_there:
                raise InputError("Hand: one that binds at ends has no binding_range: leave one of them out.")
        if self.filament_end is not None:
            require_kind(self.filament_end, HandAtEnd, "Hand: filament_end")
            if self.filament_end.binds_there and self.site_spacing is not None:
                raise InputError("Hand: one that binds at ends has no sites: leave site_spacing out.")
        if self.binds_to is not None:
            kinds = [self.binds_to] if isinstance(self.binds_to, (str, ChainType)) else self.binds_to
            kinds = kinds if isinstance(kinds, (Sequence, set, frozenset)) else ()
            names = tuple(kind.name if isinstance(kind, ChainType) else kind for kind in kinds)
            if not names or not all(isinstance(name, str) for name in names):
                raise InputError(
                    f"Hand: binds_to must be types of filaments or their names, but is {shown(self.binds_to)}."
                )
            object.__setattr__(self, "binds_to", names)

    @property
    def rate_per_length(self) -> float:
        """The rate of binding per length of filament where the spring is not strained, in 1/(ps nm)."""
        return self.binding_rate / (2.0 * self.reach)

    @property
    def holds_at_ends(self) -> bool:
        """Whether it stays at the end of a filament to which it has come."""
        return self.at_end == "hold" or (self.at_end is None and self.sliding_friction is not None)

    def binds(self, filament_type: ChainType) -> bool:
        """Whether it binds to filaments of a type."""
        require_kind(filament_type, ChainType, "filament_type")
        return self.binds_to is None or filament_type.name in self.binds_to

    def __repr__(self) -> str:
        given = [f"{one.name}={getattr(self, one.name)!r}" for one in fields(self) if self._differs(one)]
        return f"Hand({', '.join(given)})"

    def _differs(self, one):
        return getattr(self, one.name) != one.default
