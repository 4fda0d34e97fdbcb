"""The CylinderChainGrowthForce of a System: filaments of the compiled engine that grow."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import openmm
from openmm import unit

from ..engine_choice import load_plugin
from ..errors import InputError
from ..filaments.filament import Filament
from ..filaments.filament_type import FilamentType
from ..filaments.grown import count_nodes_of_monomers, rest_lengths
from ..filaments.growth import joints_by_monomers, segments_by_monomers
from ..units.quantities import AVOGADRO, LENGTH, NUMBER_DENSITY, shown
from ..units.types import BoolArray, FloatArray, IntArray
from .first_places import contour_of

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


def make_growth_force(filaments: Sequence[Filament], viscosity: float, temperature: float) -> openmm.Force:
    """The force of the filaments that grow, which are chains of the same numbers."""
    force = load_plugin().CylinderChainGrowthForce()
    force.setName(GROWTH_FORCE_NAME)
    tables: dict[Any, int] = {}
    pools: dict[int, int] = {}
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
        force.addGrowingChain(
            number,
            tables[key],
            pools[id(growth.pool)],
            0,
            per_segment * filament.segments,
            growth.fewest_monomers(kind),
            *growth.rates("minus"),
            *growth.rates("plus"),
        )
        for end, name in enumerate(("minus", "plus")):
            instability = growth.instability(name)
            if instability is not None:
                force.setDynamicInstability(force.getNumGrowingChains() - 1, end, *instability.rates)
    return force


@dataclass(frozen=True)
class FilamentGrowth:
    """How far filaments have grown in a Context: those of ``filaments``, in their order.

    Attributes
    ----------
    filaments : (n,) int array
        The numbers of those that grow.
    monomers : (n, 2) int array
        The number of the first monomer, at the minus end, and that behind the last one. They begin at zero, so a
        filament has gone where its numbers have: a treadmilling one forwards.
    lengths : (n,) Quantity in nm
        At rest.
    nodes : (n,) int array
        How many nodes they have. Others of their particles are spare, and where the last node is.
    gained, lost, waited : (n, 2) int arrays
        How many monomers each end, minus and plus, has gained and lost since the start, and how often it would have
        gained one, but had no spare node.
    shrinking : (n, 2) bool array
        Whether each end shrinks now, of those with dynamic instability.
    catastrophes, rescues : (n, 2) int arrays
        How often each end has begun to shrink, and to grow again.
    concentrations : (n,) Quantity in mol/l
        Of free monomers in the pool of each.
    """

    filaments: IntArray
    monomers: IntArray
    lengths: unit.Quantity
    nodes: IntArray
    gained: IntArray
    lost: IntArray
    waited: IntArray
    shrinking: BoolArray
    catastrophes: IntArray
    rescues: IntArray
    concentrations: unit.Quantity


def growth_of(context: openmm.Context, filaments: Sequence[Filament]) -> FilamentGrowth:
    """How far filaments have grown in a Context of their System."""
    force = find_growth_force(context.getSystem())
    ends, shrinks, events, densities = force.getGrowthInContext(context)
    monomers, counts = np.array(ends).reshape(-1, 2), np.array(events).reshape(-1, 2, 5).astype(int)
    numbers, pools = [], []
    for index in range(len(monomers)):
        number, _, pool, *_ = force.getGrowingChainParameters(index)
        numbers.append(number)
        pools.append(pool)
    per_monomer = np.array([filaments[number].growth.monomers.length for number in numbers])
    per_segment = np.array(
        [filaments[number].growth.monomers_per_segment(filaments[number].type) for number in numbers]
    )
    molar = np.array(densities)[pools] / AVOGADRO
    return FilamentGrowth(
        np.array(numbers),
        monomers,
        (monomers[:, 1] - monomers[:, 0]) * per_monomer * LENGTH,
        count_nodes_of_monomers(monomers, per_segment),
        counts[:, :, 0],
        counts[:, :, 1],
        counts[:, :, 2],
        np.array(shrinks, dtype=bool).reshape(-1, 2),
        counts[:, :, 3],
        counts[:, :, 4],
        unit.Quantity(molar, NUMBER_DENSITY * unit.mole).in_units_of(unit.molar),
    )


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
