"""Filaments that a stage deletes or cuts as it begins: which ones, and what can hold none of them."""

import warnings

import numpy as np
from openmm import unit

from ..errors import StageWarning
from ..systems.described_runs import growth_in

_SEED = 7


def deleted_filaments(stage, current, seed):
    """The numbers of the filaments that go as a Stage begins.

    They are those of a table, with the parts of these and those that have begun by nucleation.

    Parameters
    ----------
    current : tuple of (app.Simulation, BuiltSystem)
        Of the stage before, at its end.
    seed : int

    Returns
    -------
    frozenset of int
    """
    simulation, built = current
    tables = {} if stage.is_piece else {own.table: own.delete for own in stage.configuration.filaments if own.delete}
    if not tables:
        return frozenset()
    positions = simulation.context.getState(positions=True).getPositions(asNumpy=True).value_in_unit(unit.nanometer)
    nodes = _nodes_that_are_there(simulation.context, built.filaments)
    members = _numbers_of_tables(stage.configuration)
    box = None if stage.configuration.box is None else np.array(stage.configuration.box)
    gone = set()
    for table, deletion in tables.items():
        numbers = [number for number in members[table] if len(nodes[number])]
        middles = np.array([positions[nodes[number]].mean(axis=0) for number in numbers]).reshape(-1, 3)
        generator = np.random.default_rng([seed, stage.number, _SEED, table])
        gone.update(numbers[place] for place in deletion.chosen(middles, box, generator))
    return frozenset(gone)


def cut_filaments(stage, current, say):
    """Cut filaments in the Simulation of a Stage and its BuiltSystem, as it begins, by the planes that it has.

    They are those of a table, with the parts of these and those that have begun by nucleation. ``say`` is told at how
    many places. Warns where some stay whole.
    """
    tables = {} if stage.is_piece else {own.table: own.cuts for own in stage.configuration.filaments if own.cuts}
    simulation, built = current
    members = _numbers_of_tables(stage.configuration)
    for table, planes in tables.items():
        in_context = built.filaments.in_context(simulation.context)
        places, cuts = np.sum([in_context.cut(plane, members[table]) for plane in planes], axis=0)
        text = (
            f"{stage.name}: filaments of [[filament]] number {table} are cut at {cuts} of the {places} places at which "
            "they go through its planes"
        )
        say(f"{text}.")
        if cuts < places:
            warnings.warn(
                f"{text}. They stay whole where no place is free for a part (give a larger reserve), where a part "
                "would be shorter than the shortest, or is clamped or held by a tether, and where walls or contacts "
                "leave no room for the new ends.",
                StageWarning,
                stacklevel=2,
            )


def _numbers_of_tables(configuration):
    members, first = {}, 0
    for group in configuration.filaments:
        members.setdefault(group.table, []).extend(range(first, first + group.count))
        first += group.count
    return members


def _nodes_that_are_there(context, filaments):
    nodes = [own if filament.takes_part else own[:0] for own, filament in zip(filaments.node_indices, filaments)]
    growth = growth_in(context, filaments)
    if growth is not None:
        for number, count in zip(growth.filaments, growth.nodes):
            nodes[number] = nodes[number][:count]
    return nodes


def refuse_held(configuration, tables, place):
    """Raise ConfigurationError if something holds a filament of one of some [[filament]] tables in a stage.

    ``tables`` are their numbers, from 1: some of their filaments may have been deleted. Links go with these.
    """
    owners = [group for group in configuration.filaments for _ in range(group.count)]
    for group in configuration.filaments:
        if group.on_body and group.table in tables:
            raise place.error(f"deletes filaments that bodies hold ({group.label}), which stay: leave it out.")
    pulled = [("pull", own.filaments) for own in configuration.pulls]
    joined = [("joint", [end["filament"] for end in own.between]) for own in configuration.joints]
    framed = [("end_frame", own.filaments) for own in configuration.end_frames]
    for name, numbers in (*(("tether", own.filaments) for own in configuration.tethers), *pulled, *joined, *framed):
        for number in numbers:
            if number is not None and owners[number].table in tables:
                raise place.error(
                    f"has a [[{name}]] that holds filaments of {owners[number].label}, of which some have been "
                    f"deleted: take it away, with active = false in [stage.{name}]."
                )
