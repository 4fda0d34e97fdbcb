"""The recommended step of filaments that grow.

Free ends gain and lose monomers at their rates whatever the step is, and lengths and bends keep their equilibrium. The
segment at an end has half as many monomers as others at least: where a rule depends on what a segment is, that one
counts. How far segments turn in a step is that of the filament as it is at first; the relaxation that steps resolve is
that of the longest filament. An end that pushes a wall or another filament gains monomers while all else stands still,
so that a step should see few of them: ``k_on c dt`` is a fifth at most, where speeds under loads are up to 4 % too
small. Where a step has hard contacts, neither speeds nor the force at which an end stalls are right: it resolves them.
"""

import math
import warnings
from collections.abc import Sequence

import openmm

from ..couplings.capsule_contacts import as_capsule_contact_force, owners_of_chains
from ..couplings.walls import as_filament_wall_force
from ..errors import InputError, TimeStepWarning
from ..filaments.chain_type import ChainType
from ..filaments.collection import FilamentCollection
from ..filaments.end_states import ENDS
from ..filaments.filament import Filament
from ..filaments.filament_type import FilamentType
from ..filaments.growth import segment_of_length
from ..kinetics.nucleation import nucleations_of
from ..units.text import format_time
from ..units.types import FloatArray, Numbers
from .coupled_forces import CoupledForces
from .hard_contacts import longest_resolving_step
from .time_step import TimeStep

SHARE_OF_ON_RATE = 0.2
"""The largest product of a step and the rate of monomers that come to an end that pushes."""

_LARGEST_SHARE = 0.5
"""The same, from which on a step is warned of."""

_MOST_EVENTS = 1e5
_PER_SECOND = 1e12


def kind_of_segments(filament: Filament) -> tuple[ChainType, int, float, int | None]:
    """The type of a filament, its number of segments, their propulsion, and None.

    If it grows, those of a filament of its length, all of whose segments are as short as one at an end may be; and in
    place of None how many it has when it is longest.
    """
    growth, kind = filament.growth, filament.type
    if growth is None or not isinstance(kind, FilamentType):
        return kind, filament.segments, filament.propulsion, None
    shortest = (growth.monomers_per_segment(kind) // 2) * growth.monomers.length
    share = shortest / kind.segment_length
    segments = max(1, round(filament.segments / share))
    longest = max(segments, round(growth.longest / shortest))
    return segment_of_length(kind, shortest), segments, filament.propulsion * share, longest


def steps_of_growth(
    filaments: FilamentCollection,
    system: openmm.System,
    particle_friction: Numbers | None,
    coupled_forces: CoupledForces,
) -> list[TimeStep]:
    """The TimeSteps of ends that push walls or contacts of a System; none if there are no such."""
    label, rate = _fastest_end(filaments, system)
    if rate == 0.0:
        return []
    reason = f"{label} gains {_PER_SECOND * rate:.3g} monomers per second where it pushes, a fifth in a step"
    steps = [TimeStep(SHARE_OF_ON_RATE / rate, reason, {reason: 1.0 / rate}, {reason: SHARE_OF_ON_RATE / rate})]
    for index, force in enumerate(system.getForces()):
        contacts = as_capsule_contact_force(force)
        if contacts is None or not coupled_forces.includes(index):
            continue
        longest = longest_resolving_step(filaments, system, contacts, particle_friction)
        if 0.0 < longest < math.inf:
            reason = (
                f"{force.getName()} (force {index}): longer steps have hard contacts, which growing ends push wrongly"
            )
            steps.append(TimeStep(longest, reason, {reason: longest}, {reason: longest}))
    return steps


def warn_if_growth_is_not_resolved(filaments: FilamentCollection, system: openmm.System, step: float) -> None:
    """Issue a TimeStepWarning if an end that may push gains half a monomer or more in a step, in ps."""
    label, rate = _fastest_end(filaments, system)
    if step * rate > _LARGEST_SHARE:
        warnings.warn(
            f"In a time step of {format_time(step, 4)} {label} gains {step * rate:.3g} monomers: how it pushes walls "
            f"and contacts is not resolved. Use a step of at most {format_time(_LARGEST_SHARE / rate, 4)}, or better "
            f"{format_time(SHARE_OF_ON_RATE / rate, 4)}.",
            TimeStepWarning,
            stacklevel=4,
        )


def refuse_countless_monomers(filaments: Sequence[Filament], step: float, box: FloatArray | None) -> None:
    """Raise InputError if a filament gains and loses more than 100000 monomers in a step, in ps, or so many begin."""
    mothers = sum(own.growth.longest for own in filaments if own.growth is not None)
    for nucleation, (number, *_) in nucleations_of(filaments):
        rate = nucleation.whole_rate(box, mothers)
        if step * rate > _MOST_EVENTS:
            raise InputError(
                f"Of the reserve from filament {number} ({filaments[number].type.name}) on, {_PER_SECOND * rate:.3g} "
                f"would begin per second, which are {step * rate:.3g} in a time step of {format_time(step, 4)}. Check "
                "the units of its nucleation."
            )
    for number, filament in enumerate(filaments):
        rate = sum(_events(filament, end) for end in ENDS)
        severing = None if filament.growth is None else filament.growth.severing
        if filament.growth is not None and severing is not None:
            rate += severing.rate * filament.growth.longest
        if step * rate > _MOST_EVENTS:
            raise InputError(
                f"Filament {number} ({filament.type.name}) gains and loses {_PER_SECOND * rate:.3g} monomers per "
                f"second, or turns or is cut so often: {step * rate:.3g} times in a time step of "
                f"{format_time(step, 4)}. Check the units of its rates and of its pool."
            )


def _fastest_end(filaments, system):
    # Of those that may push, with what it is called.
    grows = [(number, own) for number, own in enumerate(filaments) if own.growth is not None]
    if not grows:
        return "", 0.0
    pushing = set().union(*(_filaments_of(force, filaments) for force in system.getForces()))
    rates = [
        (own.growth.states(end).most_gained(own.growth.pool.concentration), f"the {end} end of filament {i}")
        for i, own in grows
        if i in pushing
        for end in ("plus", "minus")
    ]
    rate, label = max(rates, key=lambda one: one[0], default=(0.0, ""))
    return label, rate


def _filaments_of(force, filaments):
    # Those that feel a wall or contacts.
    contacts, wall = as_capsule_contact_force(force), as_filament_wall_force(force)
    if contacts is not None:
        return owners_of_chains(contacts, filaments)
    if wall is None:
        return ()
    held = {wall.getParticle(index) for index in range(wall.getNumParticles())}
    return (number for number, nodes in enumerate(filaments.node_indices) if int(nodes[0]) in held)


def _events(filament, end):
    # How many come to an end in 1/ps, in the state in which they are most.
    if filament.growth is None:
        return 0.0
    growth = filament.growth
    busiest: float = growth.states(end).busiest_rate(growth.pool.concentration, growth.longest)
    return busiest
