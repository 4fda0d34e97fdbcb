"""What a hand has to do with the end of a filament that grows: end trackers, formins, depolymerases."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from ..errors import InputError
from ..filaments.end_states import ENDS
from ..filaments.growth import Growth
from ..units.quantities import LENGTH, one_of, positive, shown, true_or_false
from ..units.types import Scalar


@dataclass(frozen=True, kw_only=True)
class HandAtEnd:
    """What a hand has to do with the plus or minus end of filaments that grow.

    A formin binds at a plus end, stays there as it grows, and changes how fast it does: ``HandAtEnd(end="plus",
    range=..., binds_there=True, tracks=True, changes=("growing", "with formin"))``, with ``EndStates`` of these names.
    A kinesin-8 or -13 walks to an end (``Hand(at_end="hold")``) and lets it shrink there. A protein that blocks an end
    changes it to a state that neither gains nor loses monomers.

    Parameters
    ----------
    end : {"plus", "minus"}
    range : length
        How near to the end a hand counts as there.
    binds_there : bool
        It binds within the range of the end alone, and is at the end itself then: at the rate ``binding_rate range/(2
        reach)``.
    tracks : bool
        A hand that is at the end stays there while it grows and shrinks.
    changes : two of the names of the states of the end, optional
        An end in the first state is in the second one as long as such a hand is there, and in the first one again
        afterwards, if it is not in another one then. The second state should not change to others by itself but for
        what the hand is to bring about.

    Raises
    ------
    InputError
        For another end, a range that is not positive, or names that are no two different strings.
    """

    end: str
    range: float
    binds_there: bool = False
    tracks: bool = False
    changes: tuple[str, str] | None = None

    if TYPE_CHECKING:

        def __init__(
            self,
            *,
            end: str,
            range: Scalar,
            binds_there: bool = False,
            tracks: bool = False,
            changes: Sequence[str] | None = None,
        ) -> None: ...

    def __post_init__(self) -> None:
        one_of(self.end, ENDS, "HandAtEnd: end")
        object.__setattr__(self, "range", positive(self.range, LENGTH, "HandAtEnd: range"))
        true_or_false(self.binds_there, "HandAtEnd: binds_there")
        true_or_false(self.tracks, "HandAtEnd: tracks")
        if self.changes is not None:
            names = () if isinstance(self.changes, str) else tuple(self.changes)
            if len(names) != 2 or not all(isinstance(name, str) for name in names) or names[0] == names[1]:
                raise InputError(
                    f"HandAtEnd: changes must be the names of two different states, but is {shown(self.changes)}."
                )
            object.__setattr__(self, "changes", names)

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
