"""The states of the end of a filament that grows: growth and shrinking, caps, and models of your own."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from openmm import unit

from ..errors import InputError
from ..units.quantities import AVOGADRO, LENGTH, ON_RATE, RATE, in_units_of, non_negative, positive, shown
from ..units.types import FloatArray, Scalar

_PER_AMOUNT = unit.liter / unit.mole / unit.second
_MOST_STATES = 64


def as_on_rate(rate: Scalar, name: str) -> float:
    """A rate per concentration or per number in a volume, in nm^3/ps."""
    if isinstance(rate, unit.Quantity) and rate.unit.is_compatible(_PER_AMOUNT):
        rate = in_units_of(rate, ON_RATE / unit.mole, name) / AVOGADRO
    return non_negative(rate, ON_RATE, name)


def as_tuple(values: Any, name: str) -> tuple[Any, ...]:
    """A sequence as a tuple; InputError for what is none, such as a number or a string."""
    try:
        if not isinstance(values, (str, bytes)):
            return tuple(values)
    except TypeError:
        pass
    raise InputError(f"{name} must be a sequence, but is {shown(values)}.")


def check_state_name(name: Any) -> None:
    """InputError unless a name of a state can stand in a table of comma-separated values."""
    if not isinstance(name, str) or not name or not name.isprintable() or set(name) & set(',"'):
        raise InputError(f"The name of a state must be a text without commas and quotes, but is {shown(name)}.")


@dataclass(frozen=True, kw_only=True, eq=False)
class EndStates:
    """What an end does in each of its states, and how it goes from one to another: a model of your own.

    In state i, an end gains monomers at k_on[i] c and loses them at k_off[i], is in state after_gain[i] or
    after_loss[i] then, and changes to state j by itself at the rate switch_rates[i][j]. It is in state 0 at first.

    Parameters
    ----------
    on_rates : (n,) sequence of volume/time, or 1/(concentration*time)
    off_rates : (n,) sequence of 1/time
    switch_rates : (n, n) sequence of 1/time
        Zero from a state to itself.
    after_gain, after_loss : (n,) sequence of int, optional
        The state stays as it is if not given.
    names : (n,) sequence of str, optional
        For reports, without commas and quotes; numbers if not given.
    blocked_switch_rates : (n, n) sequence of 1/time, optional
        How much larger switch_rates are while what is in its way lets no monomer come: the rate is ``switch_rates +
        blocked_switch_rates (1 - s)`` with s the share of the monomers that come, which is that of the speed at which
        an end grows without loss.
    switch_lengths : (n,) sequence of length, optional
        If not zero, the rates from this state to others are those of a filament of this length, and proportional to
        lengths.
    shortest_switch_rates : (n, n) sequence of 1/time, optional
        How much larger switch_rates are while the filament has its shortest length.

    The attributes hold plain numbers, in nm^3/ps, 1/ps and nm.

    Raises
    ------
    InputError
        For another number of values, a rate that is negative or not finite, a state that there is not, or names that
        are the same.
    """

    on_rates: tuple[float, ...]
    off_rates: tuple[float, ...]
    switch_rates: tuple[tuple[float, ...], ...]
    after_gain: tuple[int, ...] = ()
    after_loss: tuple[int, ...] = ()
    names: tuple[str, ...] = ()
    blocked_switch_rates: tuple[tuple[float, ...], ...] = ()
    switch_lengths: tuple[float, ...] = ()
    shortest_switch_rates: tuple[tuple[float, ...], ...] = ()

    if TYPE_CHECKING:

        def __init__(
            self,
            *,
            on_rates: Sequence[Scalar],
            off_rates: Sequence[Scalar],
            switch_rates: Sequence[Sequence[Scalar]],
            after_gain: Sequence[int] = (),
            after_loss: Sequence[int] = (),
            names: Sequence[str] = (),
            blocked_switch_rates: Sequence[Sequence[Scalar]] = (),
            switch_lengths: Sequence[Scalar] = (),
            shortest_switch_rates: Sequence[Sequence[Scalar]] = (),
        ) -> None: ...

    def __post_init__(self) -> None:
        for name in ("on_rates", "off_rates", "after_gain", "after_loss", "names", "switch_lengths"):
            as_tuple(getattr(self, name), name)
        count = len(self.on_rates)
        if not 1 <= count <= _MOST_STATES:
            raise InputError(f"An end has from 1 to {_MOST_STATES} states, but on_rates has {count} values.")
        lengths = tuple(self.switch_lengths) or (0.0,) * count
        for name, values in (("off_rates", self.off_rates), ("switch_lengths", lengths)):
            if len(values) != count:
                raise InputError(f"on_rates has {count} values: {name} must have as many.")
        object.__setattr__(self, "on_rates", tuple(as_on_rate(rate, "on_rates") for rate in self.on_rates))
        object.__setattr__(self, "off_rates", tuple(non_negative(rate, RATE, "off_rates") for rate in self.off_rates))
        object.__setattr__(
            self, "switch_lengths", tuple(non_negative(length, LENGTH, "switch_lengths") for length in lengths)
        )
        self._read_switches("switch_rates", count)
        for name in ("blocked_switch_rates", "shortest_switch_rates"):
            if not len(as_tuple(getattr(self, name), name)):
                object.__setattr__(self, name, ((0.0,) * count,) * count)
            self._read_switches(name, count)
        for name in ("after_gain", "after_loss"):
            after = tuple(getattr(self, name)) or tuple(range(count))
            if len(after) != count or not all(
                isinstance(state, (int, np.integer)) and 0 <= state < count for state in after
            ):
                raise InputError(f"{name} must have a number of a state, from 0 to {count - 1}, for each of {count}.")
            object.__setattr__(self, name, tuple(int(state) for state in after))
        names = tuple(self.names) or tuple(map(str, range(count)))
        for name in names:
            check_state_name(name)
        if len(names) != count or len(set(names)) < count:
            raise InputError(f"names must have a string of its own for each of {count} states.")
        object.__setattr__(self, "names", names)

    def _read_switches(self, name: str, count: int) -> None:
        rows = [as_tuple(row, name) for row in as_tuple(getattr(self, name), name)]
        if len(rows) != count or any(len(row) != count for row in rows):
            raise InputError(f"on_rates has {count} values: {name} must have {count} x {count}.")
        switches = tuple(tuple(non_negative(rate, RATE, name) for rate in row) for row in rows)
        if any(row[state] != 0.0 for state, row in enumerate(switches)):
            raise InputError(f"{name} must be zero from a state to itself.")
        object.__setattr__(self, name, switches)

    def find(self, name: str) -> int:
        """The number of the state with a name; InputError if there is none."""
        if name not in self.names:
            raise InputError(f"There is no end state {name!r}: there are {', '.join(self.names)}.")
        return self.names.index(name)

    def shares(self, concentration: float) -> FloatArray:
        """Which share of its time a free end is in each state in the long run, at a concentration in 1/nm^3: (n,).

        Where its states do not depend on which monomer comes to light, and its filament is seldom the shortest. NaN if
        they depend on lengths.
        """
        if any(self.switch_lengths):
            return np.full(len(self.names), np.nan)
        on, off = np.array(self.on_rates) * concentration, np.array(self.off_rates)
        count = len(on)
        leaving = np.array(self.switch_rates)
        for state in range(count):
            leaving[state, self.after_gain[state]] += on[state]
            leaving[state, self.after_loss[state]] += off[state]
        np.fill_diagonal(leaving, 0.0)
        generator = leaving - np.diag(leaving.sum(axis=1))
        # From state 0 on: what is never reached has no share.
        shares = np.zeros(count)
        reached = _reached_from_first(leaving)
        generator = generator[np.ix_(reached, reached)] / max(np.abs(generator).max(), 1e-300)
        conditions = np.vstack([generator.T, np.ones(len(reached))])
        shares[reached] = np.linalg.lstsq(conditions, np.eye(len(reached) + 1)[-1], rcond=None)[0].clip(0.0, 1.0)
        return shares

    def net_rate(self, concentration: float) -> float:
        """The mean of what a free end gains, less what it loses, in 1/ps, at a concentration in 1/nm^3; see
        ``shares``."""
        gains = np.array(self.on_rates) * concentration - np.array(self.off_rates)
        return float(self.shares(concentration) @ gains)

    def _share_of_rates(self, length: float) -> FloatArray:
        # By what the rates from each state are to be multiplied, of a filament of a length.
        lengths = np.array(self.switch_lengths)
        return np.divide(length, lengths, out=np.ones_like(lengths), where=lengths > 0.0)

    def require_monomers_for_blocked(self, concentration: float, longest: float) -> None:
        """InputError if more changes are asked for where growth is blocked than monomers that could not come."""
        blocked = np.sum(self.blocked_switch_rates, axis=1) * self._share_of_rates(longest)
        tried = np.array(self.on_rates) * concentration
        for state in np.flatnonzero(blocked > tried):
            raise InputError(
                f"An end that is {self.names[state]} changes by {blocked[state] * 1e12:.3g}/s more where its growth is "
                f"blocked, but only {tried[state] * 1e12:.3g} monomers/s come to it: that is the most."
            )

    def busiest_rate(self, concentration: float, longest: float) -> float:
        """How many events an end has per ps in the state where it has most.

        At a concentration in 1/nm^3, of a filament as long as it can be, in nm.
        """
        switches = np.sum(self.switch_rates, axis=1) * self._share_of_rates(longest)
        switches += np.sum(self.shortest_switch_rates, axis=1)
        return float(np.max(np.array(self.on_rates) * concentration + np.array(self.off_rates) + switches))

    def most_gained(self, concentration: float) -> float:
        """How many monomers an end gains per ps in the state where it gains most, at a concentration in 1/nm^3."""
        return max(self.on_rates) * concentration

    @property
    def grows(self) -> bool:
        """Whether it gains or loses monomers in any state."""
        return any(self.on_rates) or any(self.off_rates)


def _reached_from_first(leaving: FloatArray) -> list[int]:
    reached, frontier = {0}, [0]
    while frontier:
        frontier = [int(to) for to in np.flatnonzero(leaving[frontier.pop()]) if to not in reached] + frontier
        reached.update(frontier)
    return sorted(reached)


GROWING, SHRINKING, CAPPED = "growing", "shrinking", "capped"

ENDS = "minus", "plus"
"""Of a filament, at its first and its last node."""


def _read_renucleation(own):
    if own.renucleation_rate is None:
        return
    rate = non_negative(own.renucleation_rate, RATE, "renucleation_rate")
    object.__setattr__(own, "renucleation_rate", rate)
    if rate < own.rescue_rate:
        raise InputError("renucleation_rate must not be below rescue_rate, which filaments of any length have.")


def _more_at_shortest(own):
    return 0.0 if own.renucleation_rate is None else own.renucleation_rate - own.rescue_rate


@dataclass(frozen=True, kw_only=True)
class DynamicInstability:
    """An end that grows and shrinks in turn, as those of microtubules do.

    While it grows, it has the rates of its monomers; a catastrophe turns it, and a rescue turns it back. With the speed
    v+ of growth and v- of shrinking, lengths beyond the shortest are exponential with the mean l = v+ v-/(v- f_cat -
    v+ f_res) where this is positive, and grow without end otherwise (Dogterom and Leibler, Phys. Rev. Lett. 1993, 70,
    1347). A filament that has shrunk to the shortest length waits there, 1/r on average for the renucleation_rate r, as
    a seed does for a new one, and is there for a share 1/(1 + r l (1/v+ + 1/v-)) of the time.

    Parameters
    ----------
    catastrophe_rate, rescue_rate : 1/time
        f_cat of a growing end, and f_res of one that shrinks.
    shrinking_off_rate : 1/time
        How many monomers it loses per time while it shrinks: v-/length of a monomer.
    shrinking_on_rate : volume/time, or 1/(concentration*time)
        k_on while it shrinks.
    blocked_catastrophe_rate : 1/time, optional
        That of an end whose growth is blocked. Between, the rate falls with the share of the monomers that come, so
        that an obstacle brings catastrophes about: f_cat is not changed by it if not given.
    catastrophe_length : length, optional
        f_cat is that of a filament of this length, and proportional to lengths, as kinesin-8 makes it.
    renucleation_rate : 1/time, optional
        At which an end grows again when its filament has shrunk to the shortest length; the rescue_rate if not given.

    The attributes hold plain numbers, in 1/ps, nm^3/ps and nm.

    Raises
    ------
    InputError
        For a rate that is negative or not finite, a ``blocked_catastrophe_rate`` below the ``catastrophe_rate``, a
        ``renucleation_rate`` below the ``rescue_rate``, or a length that is not positive.
    """

    catastrophe_rate: float
    rescue_rate: float
    shrinking_off_rate: float
    shrinking_on_rate: float = 0.0
    blocked_catastrophe_rate: float | None = None
    catastrophe_length: float | None = None
    renucleation_rate: float | None = None

    if TYPE_CHECKING:

        def __init__(
            self,
            *,
            catastrophe_rate: Scalar,
            rescue_rate: Scalar,
            shrinking_off_rate: Scalar,
            shrinking_on_rate: Scalar = 0.0,
            blocked_catastrophe_rate: Scalar | None = None,
            catastrophe_length: Scalar | None = None,
            renucleation_rate: Scalar | None = None,
        ) -> None: ...

    def __post_init__(self) -> None:
        for name in ("catastrophe_rate", "rescue_rate", "shrinking_off_rate"):
            object.__setattr__(self, name, non_negative(getattr(self, name), RATE, name))
        object.__setattr__(self, "shrinking_on_rate", as_on_rate(self.shrinking_on_rate, "shrinking_on_rate"))
        blocked, length = self.blocked_catastrophe_rate, self.catastrophe_length
        if blocked is not None:
            blocked = non_negative(blocked, RATE, "blocked_catastrophe_rate")
            object.__setattr__(self, "blocked_catastrophe_rate", blocked)
            if blocked < self.catastrophe_rate:
                raise InputError("blocked_catastrophe_rate must not be below catastrophe_rate, which a free end has.")
        _read_renucleation(self)
        if length is not None:
            object.__setattr__(self, "catastrophe_length", positive(length, LENGTH, "catastrophe_length"))

    def states(self, on_rate: float, off_rate: float) -> EndStates:
        """Of an end with the rates of its monomers, in nm^3/ps and 1/ps: "growing" and "shrinking"."""
        blocked = self.blocked_catastrophe_rate
        more = 0.0 if blocked is None else blocked - self.catastrophe_rate
        return EndStates(
            on_rates=(on_rate, self.shrinking_on_rate),
            off_rates=(off_rate, self.shrinking_off_rate),
            switch_rates=((0.0, self.catastrophe_rate), (self.rescue_rate, 0.0)),
            names=(GROWING, SHRINKING),
            blocked_switch_rates=((0.0, more), (0.0, 0.0)),
            switch_lengths=(self.catastrophe_length or 0.0, 0.0),
            shortest_switch_rates=((0.0, 0.0), (_more_at_shortest(self), 0.0)),
        )


@dataclass(frozen=True, kw_only=True)
class TwoUnitCap:
    """An end with a cap of two units, which has its catastrophe when both have lost it.

    Each of the last two units hydrolyses at the rate h; one that comes is new. Without losses of growing ends, and with
    g units that come per time, a new end has its catastrophe after 1/h + (g+h)^2/(h^2 (3g+2h)) on the average (Brun et
    al., Proc. Natl. Acad. Sci. 2009, 106, 21173). A monomer is a unit here: of microtubules, one of 8 nm, which is 13
    dimers.

    Parameters
    ----------
    hydrolysis_rate : 1/time
        h of each of both units.
    shrinking_off_rate : 1/time
        How many units it loses per time while it shrinks.
    rescue_rate : 1/time
        At which it begins to grow again, with a new cap.
    renucleation_rate : 1/time, optional
        That of a filament that has shrunk to the shortest length; the rescue_rate if not given.

    The attributes hold plain numbers, in 1/ps.

    Raises
    ------
    InputError
        For a rate that is negative or not finite, or a ``renucleation_rate`` below the ``rescue_rate``.
    """

    hydrolysis_rate: float
    shrinking_off_rate: float
    rescue_rate: float = 0.0
    renucleation_rate: float | None = None

    if TYPE_CHECKING:

        def __init__(
            self,
            *,
            hydrolysis_rate: Scalar,
            shrinking_off_rate: Scalar,
            rescue_rate: Scalar = 0.0,
            renucleation_rate: Scalar | None = None,
        ) -> None: ...

    def __post_init__(self) -> None:
        for name in ("hydrolysis_rate", "shrinking_off_rate", "rescue_rate"):
            object.__setattr__(self, name, non_negative(getattr(self, name), RATE, name))
        _read_renucleation(self)

    def states(self, on_rate: float, off_rate: float) -> EndStates:
        """Of an end with the rates of its monomers, in nm^3/ps and 1/ps: which units are capped, "shrinking"."""
        h = self.hydrolysis_rate
        return EndStates(
            on_rates=(on_rate, on_rate, on_rate, 0.0),
            off_rates=(off_rate, off_rate, off_rate, self.shrinking_off_rate),
            switch_rates=(
                (0.0, h, h, 0.0),
                (0.0, 0.0, 0.0, h),
                (0.0, 0.0, 0.0, h),
                (self.rescue_rate, 0.0, 0.0, 0.0),
            ),
            # What was the last unit is the one before it.
            after_gain=(0, 0, 1, 3),
            names=("capped", "last unit capped", "unit before capped", SHRINKING),
            shortest_switch_rates=(*((0.0,) * 4,) * 3, (_more_at_shortest(self), 0.0, 0.0, 0.0)),
        )
