"""What a hand has to do with the end of a filament that grows: end trackers, formins, depolymerases."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from ..errors import InputError
from ..filaments.end_states import ENDS
from ..filaments.growth import Growth
from ..units.quantities import LENGTH, RATE, non_negative, one_of, positive, shown, true_or_false, whole_number
from ..units.types import Scalar
from .binding_range import ENDS_OF_RANGE


@dataclass(frozen=True, kw_only=True)
class HandAtEnd:
    """What a hand has to do with the ends of filaments that grow.

    A formin binds at a plus end, stays there as it grows, and changes how fast it does: ``HandAtEnd(end="plus",
    range=..., binds_there=True, tracks=True, changes=("growing", "with formin"))``, with ``EndStates`` of these names.
    A kinesin-8 walks to an end (``Hand(at_end="hold")``) and lets it shrink there; a kinesin-13 slides to either end,
    stays, and takes monomers off. A protein that blocks an end changes it to a state that neither gains nor loses
    monomers.

    Parameters
    ----------
    end : {"plus", "minus", "both"}
        Both: whichever it is at, and ``changes`` are not given.
    range : length
        How near to the end a hand counts as there.
    binds_there : bool
        It binds within the range of the end alone, and is at the end itself then: at the rate ``binding_rate range/(2
        reach)``.
    tracks : bool
        A hand that is at the end stays there while it grows and shrinks. One that slides stays at the end to which it
        comes, until it unbinds.
    changes : two of the names of the states of the end, optional
        An end in the first state is in the second one as long as such a hand is there, and in the first one again
        afterwards, if it is not in another one then. The second state should not change to others by itself but for
        what the hand is to bring about.
    off_rate : 1/time
        At which such a hand takes monomers off the end, beside those that leave by themselves. It does so at ends that
        gain or lose monomers; a capped one keeps them.
    sites : int, optional
        How many of the hands of a kind take monomers off an end at a time: more of them do no more.
    unbinding_rate : 1/time, optional
        That of a hand which is there, in place of its own.

    Raises
    ------
    InputError
        For another end, a range that is not positive, rates or sites that are no such numbers, or names that are no two
        different strings.
    """

    end: str
    range: float
    binds_there: bool = False
    tracks: bool = False
    changes: tuple[str, str] | None = None
    off_rate: float = 0.0
    sites: int | None = None
    unbinding_rate: float | None = None

    if TYPE_CHECKING:

        def __init__(
            self,
            *,
            end: str,
            range: Scalar,
            binds_there: bool = False,
            tracks: bool = False,
            changes: Sequence[str] | None = None,
            off_rate: Scalar = 0.0,
            sites: int | None = None,
            unbinding_rate: Scalar | None = None,
        ) -> None: ...

    def __post_init__(self) -> None:
        one_of(self.end, ENDS_OF_RANGE, "HandAtEnd: end")
        object.__setattr__(self, "range", positive(self.range, LENGTH, "HandAtEnd: range"))
        true_or_false(self.binds_there, "HandAtEnd: binds_there")
        true_or_false(self.tracks, "HandAtEnd: tracks")
        object.__setattr__(self, "off_rate", non_negative(self.off_rate, RATE, "HandAtEnd: off_rate"))
        if self.sites is not None:
            object.__setattr__(self, "sites", whole_number(self.sites, 1, "HandAtEnd: sites"))
        if self.unbinding_rate is not None:
            rate = non_negative(self.unbinding_rate, RATE, "HandAtEnd: unbinding_rate")
            object.__setattr__(self, "unbinding_rate", rate)
        if self.changes is not None and self.end == "both":
            raise InputError("HandAtEnd: a hand changes the states of the plus or the minus end, not of both.")
        if self.changes is not None:
            names = () if isinstance(self.changes, str) else tuple(self.changes)
            if len(names) != 2 or not all(isinstance(name, str) for name in names) or names[0] == names[1]:
                raise InputError(
                    f"HandAtEnd: changes must be the names of two different states, but is {shown(self.changes)}."
                )
            object.__setattr__(self, "changes", names)

    @property
    def ends(self) -> tuple[str, ...]:
        """The ends with which it has to do."""
        return ENDS if self.end == "both" else (self.end,)

    def require_ends_that_shrink(self, bound: Iterable[Growth]) -> None:
        """InputError if it takes monomers off, but an end to which it binds neither gains nor loses any."""
        if self.off_rate == 0.0:
            return
        able = False
        for growth in bound:
            for end in self.ends:
                able = able or growth.states(end).grows
                if not (growth.states(end).grows or getattr(growth, f"{end}_capped")):
                    raise InputError(
                        f"a hand takes monomers off {end} ends, but there are some at which no monomers come and go: "
                        f"give their monomers a {end}_off_rate, or cap these ends."
                    )
        if not able:
            raise InputError("a hand takes monomers off ends, but binds to filaments alone whose ends are capped.")

    def may_change(self, growth: Growth) -> bool:
        """Whether ends of a growth have both states of ``changes``."""
        return self.changes is not None and set(self.changes) <= set(growth.states(self.end).names)

    def find_changes(self, bound: Iterable[Growth]) -> tuple[int, int]:
        """The numbers of both states of ``changes`` among those of the ends to which it binds; -1 without changes.

        InputError if none of these has such states, or if they have different numbers.
        """
        growths = list(bound)
        if not growths:
            raise InputError("a hand has to do with ends, but binds to no filaments that grow.")
        if self.changes is None:
            return -1, -1
        able = [growth.states(self.end) for growth in growths if self.may_change(growth)]
        found = {tuple(map(states.find, self.changes)) for states in able}
        if len(found) != 1:
            what = f"a hand changes {self.end} ends from {self.changes[0]!r} to {self.changes[1]!r}"
            known = " or ".join(dict.fromkeys(", ".join(growth.states(self.end).names) for growth in growths))
            if found:
                raise InputError(f"{what}, which have different numbers among their states {known}.")
            raise InputError(f"{what}, but the states are {known}.")
        ((free, held),) = found
        return free, held
