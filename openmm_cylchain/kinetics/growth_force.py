"""The CylinderChainGrowthForce of a System: filaments of the compiled engine that grow."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import openmm
from openmm import unit

from ..couplings.periodicity import is_periodic
from ..couplings.shapes import Plane
from ..engine_choice import load_plugin
from ..errors import InputError
from ..filaments.end_states import ENDS, SHRINKING
from ..filaments.filament import Filament
from ..filaments.filament_type import FilamentType
from ..filaments.grown import count_nodes_of_monomers, rest_lengths
from ..filaments.growth import joints_by_monomers, segments_by_monomers
from ..units.quantities import AVOGADRO, LENGTH, NUMBER_DENSITY, shown
from ..units.types import BoolArray, FloatArray, IntArray, StringArray
from .branching import Branching
from .first_places import contour_of
from .nucleation import nucleations_of

GROWTH_FORCE_NAME = "Growth"
_MOST_MONOMERS = 10**9


def is_growth_force(force: openmm.Force) -> bool:
    """Whether a force of a System is a CylinderChainGrowthForce."""
    plugin = load_plugin()
    return plugin is not None and plugin.CylinderChainGrowthForce.isinstance(force)


def find_growth_force(system: openmm.System) -> Any:
    """The CylinderChainGrowthForce of a System, or None."""
    for force in system.getForces():
        if is_growth_force(force):
            return load_plugin().CylinderChainGrowthForce.cast(force)
    return None


def make_growth_force(
    filaments: Sequence[Filament], viscosity: float, temperature: float, box: FloatArray | None
) -> openmm.Force:
    """The force of the filaments that grow, which are chains of the same numbers, in a periodic box (3, 3) or none."""
    force = load_plugin().CylinderChainGrowthForce()
    force.setName(GROWTH_FORCE_NAME)
    tables: dict[Any, int] = {}
    pools: dict[int, int] = {}
    indices: dict[int, int] = {}
    for number, filament in enumerate(filaments):
        growth, kind = filament.growth, filament.type
        if growth is None or not isinstance(kind, FilamentType):
            continue
        per_segment = growth.monomers_per_segment(kind)
        key = (kind, growth.monomers.length, growth.fewest_monomers(kind), filament.propulsion)
        if key not in tables:
            segments = segments_by_monomers(growth, kind, viscosity, temperature, filament.propulsion)
            joints = joints_by_monomers(growth, kind)
            tables[key] = force.addTable(per_segment, segments.ravel().tolist(), joints.tolist())
        if id(growth.pool) not in pools:
            pools[id(growth.pool)] = force.addPool(growth.pool.concentration, growth.pool.volume or 0.0)
        monomers = 0 if filament.is_reserve else per_segment * filament.segments
        least = growth.fewest_monomers(kind)
        index = force.addGrowingChain(number, tables[key], pools[id(growth.pool)], 0, monomers, least, growth.vanishes)
        _set_ends(force, index, growth)
        indices[number] = index
    for nucleation, numbers in nucleations_of(filaments):
        _add_nucleator(force, filaments[numbers[0]], [indices[number] for number in numbers], box)
        if isinstance(nucleation, Branching):
            _set_branching(force, nucleation, filaments, indices)
    return force


def branchings_of(filaments: Sequence[Filament]) -> list[tuple[int, Branching]]:
    """Those by which filaments begin, with the numbers of their nucleators."""
    nucleations = enumerate(nucleations_of(filaments))
    return [(number, own) for number, (own, _) in nucleations if isinstance(own, Branching)]


def _set_branching(force, branching, filaments, indices):
    # Of the nucleator that was added last; ``indices`` are those of growing filaments, by their numbers.
    mothers = list(indices) if branching.mothers is None else branching.mothers
    for number in mothers:
        if number not in indices:
            raise InputError(f"Filament {number} cannot have branches: it does not grow, or does not exist.")
    lengths = {filaments[number].growth.monomers.length for number in mothers}
    if len(lengths) > 1:
        raise InputError("Filaments of different monomers have no branches of one kind: give mothers of one kind.")
    force.setBranching(
        force.getNumNucleators() - 1,
        branching.angle,
        branching.angular_stiffness,
        branching.distance,
        branching.lever,
        [indices[number] for number in mothers],
    )


def _set_ends(force, index, growth):
    oldest = len(growth.monomers.aging)
    states = [growth.states(end) for end in ENDS]
    for end, own in enumerate(states):
        rates = np.column_stack([own.on_rates, own.off_rates]).ravel()
        after = np.column_stack([own.after_gain, own.after_loss]).ravel()
        force.setEndStates(index, end, oldest, rates.tolist(), after.tolist(), np.ravel(own.switch_rates).tolist())
        force.setEndSwitching(index, end, list(own.switch_lengths), np.ravel(own.blocked_switch_rates).tolist())
        force.setSwitchingOfShortest(index, end, np.ravel(own.shortest_switch_rates).tolist())
        of_load = 0.0 if growth.growing_force is None else growth.growing_force * growth.monomers.length
        force.setEndTiming(index, end, growth.deterministic, of_load)
    force.setMonomersHaveStates(index, oldest > 0)
    severing = growth.severing
    if severing is not None:
        cut = [float(not severing.of_states or name in severing.of_states) for name in states[1].names]
        shares = cut if oldest > 0 else []
        plus_state = states[1].find(SHRINKING) if severing.shrinks else 0
        force.setSevering(index, severing.rate * growth.monomers.length, 0, plus_state, shares)


def _add_nucleator(force, filament, indices, box):
    nucleation, growth = filament.nucleation, filament.growth
    direction = np.zeros(3) if nucleation.direction is None else nucleation.direction
    force.addNucleator(
        nucleation.whole_rate(box, growth.monomers.length),
        nucleation.order,
        nucleation.monomers(growth, filament.type),
        *nucleation.described_region,
        openmm.Vec3(*direction),
        indices,
    )


@dataclass(frozen=True)
class FilamentGrowth:
    """How far filaments have grown in a Context: those of ``filaments``, in their order.

    Attributes
    ----------
    filaments : (n,) int array
        The numbers of those that grow.
    monomers : (n, 2) int array
        The number of the first monomer, at the minus end, and that behind the last one. They begin at zero, so a
        filament has gone where its numbers have: a treadmilling one forwards. Both are zero if there is none now.
    lengths : (n,) Quantity in nm
        At rest.
    nodes : (n,) int array
        How many nodes they have. Others of their particles are spare, and where the last node is.
    gained, lost, waited : (n, 2) int arrays
        How many monomers each end, minus and plus, has gained and lost since the start, and how often it would have
        gained one, but had no spare node.
    end_states : (n, 2) int array
        The number of the state of each end among ``EndStates.names``.
    state_names : (n, 2) str array
        Its name; empty where there is no filament.
    shrinking : (n, 2) bool array
        Whether each end shrinks now, of those with dynamic instability.
    catastrophes, rescues : (n, 2) int arrays
        How often each end has begun to shrink, and to grow again: has changed by itself to the first of its states.
    concentrations : (n,) Quantity in mol/l
        Of free monomers in the pool of each.
    identities, parents : (n,) int arrays
        Which of all filaments that have ever grown each one is, counted from zero, and of which it was a part when that
        was cut; -1 for none.
    nucleated, vanished, severed, without_place : int
        How many filaments have begun, vanished, and were cut, and how often one would have begun or been cut, but there
        was no place left (``Filaments.add_reserve``).
    """

    filaments: IntArray
    monomers: IntArray
    lengths: unit.Quantity
    nodes: IntArray
    gained: IntArray
    lost: IntArray
    waited: IntArray
    end_states: IntArray
    state_names: StringArray
    shrinking: BoolArray
    catastrophes: IntArray
    rescues: IntArray
    concentrations: unit.Quantity
    identities: IntArray
    parents: IntArray
    nucleated: int
    vanished: int
    severed: int
    without_place: int


def growth_of(context: openmm.Context, filaments: Sequence[Filament]) -> FilamentGrowth:
    """How far filaments have grown in a Context of their System."""
    force = find_growth_force(context.getSystem())
    ends, states, events, densities = force.getGrowthInContext(context)
    lineages, population = force.getPopulationInContext(context)
    monomers, end_states = np.array(ends).reshape(-1, 2), np.array(states, dtype=int).reshape(-1, 2)
    chains = [force.getGrowingChainParameters(index) for index in range(len(monomers))]
    own = [filaments[number] for number, *_ in chains]
    counts = _counts_of_ends([filament.growth for filament in own], end_states, events)
    per_monomer = np.array([filament.growth.monomers.length for filament in own])
    per_segment = np.array([filament.growth.monomers_per_segment(filament.type) for filament in own])
    molar = np.array(densities)[[pool for _, _, pool, *_ in chains]] / AVOGADRO
    identities, parents = np.array(lineages, dtype=int).reshape(-1, 2).T
    nodes = count_nodes_of_monomers(monomers, per_segment)
    return FilamentGrowth(
        np.array([number for number, *_ in chains]),
        monomers,
        (monomers[:, 1] - monomers[:, 0]) * per_monomer * LENGTH,
        nodes,
        counts[:, :, 0],
        counts[:, :, 1],
        counts[:, :, 2],
        end_states,
        _names_of_states([filament.growth for filament in own], end_states, nodes > 0),
        counts[:, :, 3].astype(bool),
        counts[:, :, 4],
        counts[:, :, 5],
        unit.Quantity(molar, NUMBER_DENSITY * unit.mole).in_units_of(unit.molar),
        identities,
        parents,
        *map(int, population),
    )


def _names_of_states(growths, end_states, there):
    names = [
        [growth.states(end).names[number] if present else "" for end, number in zip(ENDS, numbers)]
        for growth, numbers, present in zip(growths, end_states, there)
    ]
    return np.array(names, dtype=str).reshape(-1, 2)


def _counts_of_ends(growths, end_states, events):
    # Gained, lost, waited, whether it shrinks, catastrophes and rescues of each end: (n, 2, 6).
    counts = np.zeros((len(growths), 2, 6), dtype=int)
    position = 0
    for index, growth in enumerate(growths):
        for end, name in enumerate(ENDS):
            own = growth.states(name).names
            counts[index, end, :3] = events[position : position + 3]
            if SHRINKING in own:
                entered = events[position + 3 : position + 3 + len(own)]
                shrinks = own[end_states[index, end]] == SHRINKING
                counts[index, end, 3:] = shrinks, entered[own.index(SHRINKING)], entered[0]
            position += 3 + len(own)
    return counts


def set_growth_of(context: openmm.Context, filaments: Sequence[Filament], monomers: Any) -> None:
    """Tell a Context how far its filaments have grown; InputError for what they cannot be."""
    force = find_growth_force(context.getSystem())
    numbers = [force.getGrowingChainParameters(index)[0] for index in range(force.getNumGrowingChains())]
    ends = np.asarray(monomers)
    if ends.shape != (len(numbers), 2) or not np.issubdtype(ends.dtype, np.integer):
        raise InputError(
            f"monomers must be whole numbers of the shape ({len(numbers)}, 2), for each filament that grows the number "
            f"of its first monomer and that behind its last one, but are {shown(monomers)}."
        )
    for number, (first, last) in zip(numbers, ends.tolist()):
        own = filaments[number]
        fewest = own.growth.fewest_monomers(own.type)
        if first == last == 0 and (own.growth.vanishes or own.is_reserve):
            continue
        label = f"Filament {number} ({own.type.name}) cannot have the monomers from {first} to before {last}"
        if last - first < fewest or max(abs(first), abs(last)) >= _MOST_MONOMERS:
            raise InputError(f"{label}: it has {fewest} monomers at least, with numbers below {_MOST_MONOMERS:.0e}.")
        nodes = int(count_nodes_of_monomers(np.array([first, last]), own.growth.monomers_per_segment(own.type)))
        most = len(own.positions) + own.spare_nodes
        if nodes > most:
            raise InputError(f"{label}: they need {nodes} nodes, but it has {most}. Give its growth a larger longest.")
    try:
        force.setGrowthInContext(context, ends.ravel().tolist())
    except openmm.OpenMMException as error:
        raise InputError(str(error)) from None


def cut_by(context: openmm.Context, plane: Plane, numbers: Sequence[int] | None) -> tuple[int, int]:
    """Cut filaments of a Context by a plane, all that grow if numbers is None: at how many places they go through it,
    and how often they were cut."""
    if is_periodic(context.getSystem()):
        raise InputError("In a periodic box, a plane would not cut the images of filaments: cut them without one.")
    force = find_growth_force(context.getSystem())
    indices = {force.getGrowingChainParameters(index)[0]: index for index in range(force.getNumGrowingChains())}
    for number in numbers or ():
        if number not in indices:
            raise InputError(f"Filament {number} cannot be cut: it does not grow, or does not exist.")
    chosen = list(indices.values()) if numbers is None else [indices[number] for number in numbers]
    before = force.getPopulationInContext(context)[1][2]
    places = force.cutInContext(context, openmm.Vec3(*plane.point), openmm.Vec3(*plane.normal), chosen)
    return places, int(force.getPopulationInContext(context)[1][2] - before)


def contours_in(context: openmm.Context, filaments: Sequence[Filament]) -> list[FloatArray]:
    """Where the segments of filaments in a Context begin along them, with segments at rest, and their ends: a list of
    (segments + 1,) arrays in nm. Those that grow begin where their minus ends have grown to."""
    contours = [contour_of(filament) for filament in filaments]
    if all(filament.growth is None for filament in filaments):
        return contours
    present = growth_of(context, filaments)
    for number, monomers in zip(present.filaments, present.monomers):
        filament = filaments[number]
        length = filament.growth.monomers.length
        rest = rest_lengths(monomers, filament.growth.monomers_per_segment(filament.type), length)
        contours[number] = monomers[0] * length + np.concatenate([[0.0], np.cumsum(rest)])
    return contours
