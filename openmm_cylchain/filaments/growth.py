"""Growth: how the ends of a filament gain and lose monomers."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from ..errors import InputError
from ..units.quantities import (
    FORCE,
    LENGTH,
    one_of,
    positive,
    require_kind,
    shown,
    true_or_false,
)
from ..units.types import FloatArray, Indices, Scalar
from .chain_type import ChainType
from .end_states import (
    CAPPED,
    ENDS,
    SHRINKING,
    DynamicInstability,
    EndStates,
    TwoUnitCap,
)
from .filament_type import FilamentType
from .monomers import MonomerPool, Monomers
from .severing import Severing

_SAME_LENGTH = 1e-6
"""By what share the length of a segment may differ from that of its monomers."""
_MOST_NODES = 1_000_000
_MOST_MONOMERS_OF_SEGMENT = 100_000


@dataclass(frozen=True, kw_only=True)
class Growth:
    """How a filament grows and shrinks at its ends, with detailed balance.

    An end gains k_on c monomers per time and loses k_off while it is free. Where a wall or contacts of this package are
    in its way, it gains k_on c min(1, exp(-dV/k_BT)) with dV the change of their energy, and loses
    k_off min(1, exp(-dV/k_BT)); so it stalls at the force (k_BT/delta) ln(k_on c/k_off). Within a step, monomers come
    and go while all else stands still. The segment at an end has half as many monomers as others, or up to half
    as many more; lengths and bends keep their equilibrium whatever monomers come and go.

    Parameters
    ----------
    monomers : Monomers
        Such as ACTIN_ATP. A segment of the filament's type is a whole number of monomers long.
    pool : MonomerPool, or a concentration
        Filaments that are given the same pool share it.
    longest : length
        For which the filament has nodes, wherever its joints are: it may become up to two segments longer. An end that
        has no node left waits, and ``FilamentGrowth.waited`` counts how often.
    shortest : length, optional
        To which it shrinks at most; half a segment if not given.
    plus_capped, minus_capped : bool
        A capped end neither gains nor loses monomers.
    plus_instability, minus_instability : DynamicInstability, TwoUnitCap or EndStates, optional
        Of an end that grows and shrinks in turn, or has states of your own. It begins by growing, and one that has
        shrunk to the end waits to be rescued, or vanishes.
    vanishes : bool
        A filament of the length ``shortest`` vanishes when it loses another monomer. Its place is free for others, see
        ``Filaments.add_reserve``.
    severing : Severing, optional
        How it is cut at random.
    deterministic : bool
        Monomers come and go at regular times, k_on c - k_off in all per time, and not at random: filaments grow at a
        constant speed.
    growing_force : force, optional
        F_g: where something is in its way, an end gains k_on c exp(-F/F_g) monomers under the load F = dV/length of a
        monomer. That has an equilibrium for k_BT/length alone, which it is if not given.

    Raises
    ------
    InputError
        For a value that is missing or wrong, a ``longest`` that is not longer than ``shortest``, or two capped ends.
    """

    monomers: Monomers
    pool: MonomerPool
    longest: float
    shortest: float | None = None
    plus_capped: bool = False
    minus_capped: bool = False
    plus_instability: DynamicInstability | TwoUnitCap | EndStates | None = None
    minus_instability: DynamicInstability | TwoUnitCap | EndStates | None = None
    vanishes: bool = False
    severing: Severing | None = None
    deterministic: bool = False
    growing_force: float | None = None

    if TYPE_CHECKING:

        def __init__(
            self,
            *,
            monomers: Monomers,
            pool: MonomerPool | Scalar,
            longest: Scalar,
            shortest: Scalar | None = None,
            plus_capped: bool = False,
            minus_capped: bool = False,
            plus_instability: DynamicInstability | TwoUnitCap | EndStates | None = None,
            minus_instability: DynamicInstability | TwoUnitCap | EndStates | None = None,
            vanishes: bool = False,
            severing: Severing | None = None,
            deterministic: bool = False,
            growing_force: Scalar | None = None,
        ) -> None: ...

    def __post_init__(self) -> None:
        require_kind(self.monomers, Monomers, "monomers")
        if not isinstance(self.pool, MonomerPool):
            object.__setattr__(self, "pool", MonomerPool(self.pool))
        object.__setattr__(self, "longest", positive(self.longest, LENGTH, "longest"))
        if self.shortest is not None:
            object.__setattr__(self, "shortest", positive(self.shortest, LENGTH, "shortest"))
            if self.shortest >= self.longest:
                raise InputError(f"longest must exceed shortest, {self.shortest:g} nm, but is {self.longest:g} nm.")
        if self.growing_force is not None:
            object.__setattr__(self, "growing_force", positive(self.growing_force, FORCE, "growing_force"))
        for name in ("plus_capped", "minus_capped", "vanishes", "deterministic"):
            true_or_false(getattr(self, name), name)
        for end in ("plus", "minus"):
            instability = getattr(self, f"{end}_instability")
            if instability is not None:
                if not isinstance(instability, (DynamicInstability, TwoUnitCap, EndStates)):
                    raise InputError(
                        f"{end}_instability must be a DynamicInstability, a TwoUnitCap or EndStates, but is "
                        f"{shown(instability)}."
                    )
                if self.monomers.aging:
                    raise InputError(
                        f"Monomers that age decide what ends do: leave {end}_instability, or their aging, out."
                    )
                if getattr(self, f"{end}_capped"):
                    raise InputError(f"The {end} end is capped, and has a dynamic instability: leave one of them out.")
                # Not those that are kept, which are found when they are asked for.
                self._find_states(end).require_monomers_for_blocked(self.pool.concentration, self.longest)
        if self.severing is not None:
            require_kind(self.severing, Severing, "severing")
            if self.severing.of_states and not self.monomers.aging:
                raise InputError("Monomers that do not age have no states: leave of_states of their Severing out.")
            for state in self.severing.of_states:
                self.monomers.states("plus").find(state)
            if self.severing.shrinks:
                self.states("plus").find(SHRINKING)
        if self.plus_capped and self.minus_capped and self.severing is None:
            raise InputError("A filament with two capped ends does not grow: leave its growth out.")

    def rates(self, end: str) -> tuple[float, float]:
        """k_on in nm^3/ps and k_off in 1/ps of the "plus" or "minus" end; zero if it is capped.

        InputError for another one.
        """
        one_of(end, ENDS, "end")
        if getattr(self, f"{end}_capped"):
            return 0.0, 0.0
        return getattr(self.monomers, f"{end}_on_rate"), getattr(self.monomers, f"{end}_off_rate")

    def states(self, end: str) -> EndStates:
        """What the "plus" or "minus" end does in each of its states; InputError for another one."""
        return self._states_of_ends[one_of(end, ENDS, "end")]

    @property
    def keeps_first_node(self) -> bool:
        """Whether a filament has one first node for all time: its minus end never grows, and it does not vanish."""
        return not (self.states("minus").grows or self.vanishes)

    @cached_property
    def _states_of_ends(self):
        return {end: self._find_states(end) for end in ENDS}

    def _find_states(self, end):
        instability = getattr(self, f"{end}_instability")
        if isinstance(instability, EndStates):
            return instability
        if instability is not None:
            return instability.states(*self.rates(end))
        states = self.monomers.states(end)
        if not getattr(self, f"{end}_capped"):
            return states
        none = (0.0,) * len(states.names)
        # Those of monomers that age go on.
        names = states.names if self.monomers.aging else (CAPPED,)
        return replace(states, on_rates=none, off_rates=none, names=names)

    def monomers_per_segment(self, filament_type: FilamentType) -> int:
        """The monomers of a segment; InputError if they are not a whole number from 2 on."""
        ratio = filament_type.segment_length / self.monomers.length
        number = round(ratio)
        if abs(ratio - number) > _SAME_LENGTH * ratio or not 2 <= number <= _MOST_MONOMERS_OF_SEGMENT:
            suggested = min(max(number, 2), _MOST_MONOMERS_OF_SEGMENT)
            length = suggested * self.monomers.length
            raise InputError(
                f"segments of {filament_type.segment_length:g} nm have {ratio:g} monomers of {self.monomers.length:g} "
                f"nm. A filament that grows needs a whole number of them, from 2 to {_MOST_MONOMERS_OF_SEGMENT}: take "
                f"the type's with_segment_length({length:g}), which are {suggested} monomers."
            )
        return number

    def fewest_monomers(self, filament_type: FilamentType) -> int:
        """The fewest monomers of the filament."""
        if self.shortest is None:
            return max(2, self.monomers_per_segment(filament_type) // 2)
        return max(2, round(self.shortest / self.monomers.length))

    def count_nodes(self, filament_type: FilamentType) -> int:
        """How many nodes the longest filament may need."""
        per_segment = self.monomers_per_segment(filament_type)
        most = int(np.ceil(self.longest / self.monomers.length))
        return max(0, most - 2 * (per_segment // 2)) // per_segment + 3


def check_growth(
    growth: Growth, filament_type: ChainType, segments: int | None, closed: bool, clamped: Indices, label: str
) -> int:
    """The number of spare nodes of a filament that grows, or of all its nodes if it has no segments yet (None).

    InputError if it cannot.
    """
    require_kind(growth, Growth, f"{label}: growth")
    if not (isinstance(filament_type, FilamentType) and filament_type.segment_kind.straight) or closed:
        raise InputError(f"{label}: only open filaments of straight segments grow.")
    if filament_type.friction_length == "filament":
        raise InputError(
            f"{label}: the friction of its segments is that of the length of the filament, which changes as it grows. "
            "Give its type a friction_length that is a length, such as the one that it mostly has."
        )
    if tuple(clamped) not in ((), (0,)) or (clamped and not growth.minus_capped):
        raise InputError(
            f"{label}: of a filament that grows, the first node alone may be clamped, if growth has minus_capped=True."
        )
    try:
        per_segment, fewest = growth.monomers_per_segment(filament_type), growth.fewest_monomers(filament_type)
        _shortest_segment(filament_type, growth, min(fewest, per_segment // 2))
    except InputError as error:
        raise InputError(f"{label}: {error}") from None
    if fewest * growth.monomers.length > growth.longest * (1.0 + _SAME_LENGTH):
        raise InputError(
            f"{label}: it is {fewest * growth.monomers.length:g} nm long where it is shortest, which exceeds its "
            f"longest, {growth.longest:g} nm. Give its growth a shortest, or take shorter segments."
        )
    nodes = growth.count_nodes(filament_type)
    if nodes > _MOST_NODES:
        raise InputError(
            f"{label}: for its longest, {growth.longest:g} nm, it would need {nodes:,} nodes, of more than "
            f"{_MOST_NODES:,}. Check the unit of longest, or take longer segments."
        )
    if segments is None:
        return nodes
    if growth.vanishes and tuple(clamped):
        raise InputError(f"{label} vanishes when it is short, so none of its nodes may be clamped.")
    length = segments * filament_type.segment_length
    if segments * per_segment < fewest or length > growth.longest * (1.0 + _SAME_LENGTH):
        raise InputError(
            f"{label} is {length:g} nm long, but its growth has filaments between {fewest * growth.monomers.length:g} "
            f"and {growth.longest:g} nm."
        )
    return max(0, nodes - segments - 1)


def _shortest_segment(filament_type, growth, fewest):
    # The fewest monomers of a segment that has friction, at most so many.
    length = growth.monomers.length
    for monomers in range(1, fewest + 1):
        try:
            segment_of_length(filament_type, monomers * length)
        except InputError as error:
            if monomers == fewest:
                raise InputError(
                    f"segments at its ends may be {fewest * length:g} nm long, for which they have no friction "
                    f"({error}) Take longer segments, a larger shortest, or a friction_length."
                ) from None
        else:
            return monomers
    raise AssertionError("The loop returns or raises.")


def segment_of_length(filament_type: FilamentType, length: float) -> FilamentType:
    """The type of a segment of another length in nm, of the same material; InputError if it has no friction.

    Of a type that has the stiffness of a segment, that of its material.
    """
    modulus = filament_type.segment_stiffness * filament_type.segment_length
    material = replace(filament_type, stretching_stiffness=None, stretching_modulus=modulus)
    return material.with_segment_length(length)


def segments_by_monomers(
    growth: Growth, filament_type: FilamentType, viscosity: float, temperature: float, propulsion: float
) -> FloatArray:
    """What segments with 1, 2, ..., twice ``monomers_per_segment`` monomers are: (segments, 8).

    Rest length, stretching stiffness, maximum extension, the parallel, perpendicular, rotational and extensional
    friction, and propulsion. Those that are too short for friction, which no filament has, have that of the next one.
    """
    per_segment = growth.monomers_per_segment(filament_type)
    least = _shortest_segment(filament_type, growth, min(growth.fewest_monomers(filament_type), per_segment // 2))
    rows = []
    for monomers in range(1, 2 * per_segment + 1):
        length = monomers * growth.monomers.length
        own = segment_of_length(filament_type, max(monomers, least) * growth.monomers.length)
        friction = own.segment_friction(viscosity, temperature, 1)
        extension = 0.0 if filament_type.maximum_extension is None else own.maximum_extension
        stiffness = own.segment_stiffness
        frictions = (friction.parallel, friction.perpendicular, friction.rotational, friction.extensional)
        rows.append([length, stiffness, extension, *frictions, propulsion * monomers / per_segment])
    return np.array(rows)


def joints_by_monomers(growth: Growth, filament_type: FilamentType) -> FloatArray:
    """Stiffness in kJ/mol of joints whose two segments have 2, 3, ... three times ``monomers_per_segment`` monomers."""
    per_segment = growth.monomers_per_segment(filament_type)
    lengths = 0.5 * growth.monomers.length * np.arange(2, 3 * per_segment + 1)
    return np.array([filament_type.stiffness_of_joint(length) for length in lengths])
