"""From a stage of a run to the next one: another System, in the state in which the last one has ended.

Linkers that a stage adds are not bound, unless it says so; of those that it takes away, each has the same chance. Hands
on filaments that it deletes let go.
"""

import functools

import numpy as np

from ..systems.carried_state import carry_state
from .created_simulation import stage_simulation
from .deleted_and_cut_filaments import cut_filaments, deleted_filaments
from .relaxation import relaxed_again
from .tables.linkers import KEPT


def following_simulation(before, stage, first, seed, say=lambda message: None, stop=None):
    """The Simulation of a stage, in the state in which that before has ended, and its BuiltSystem.

    Parameters
    ----------
    before, first : tuple of (app.Simulation, BuiltSystem)
        Of the stage before, and of the first one.
    stage : Stage
        The later one.
    seed : int
        By which linkers and filaments are chosen that are taken away.
    say : callable (str), optional
        Told at how many places planes cut filaments.
    stop : callable (), optional
        Called after each step in which filaments that have come push others apart.

    Warns
    -----
    StageWarning
        If filaments stay whole that go through planes which cut them.

    Raises
    ------
    InputError
        If it cannot be simulated, or the two Systems have not the same particles.
    """
    old, old_built = before
    going = deleted_filaments(stage, before, seed)
    new, built = stage_simulation(stage, first, old_built.deleted | going)
    generator = np.random.default_rng([seed, stage.number, 6])
    carry_state(
        old.context,
        new.context,
        functools.partial(_change_linkers, stage, generator, going),
        functools.partial(_delete_grown, going),
    )
    if any(built.filaments[number].growth is not None for number in going):
        positions = new.context.getState(positions=True).getPositions(asNumpy=True)
        for number in going:
            nodes = built.filaments.node_indices[number]
            if built.filaments[number].growth is not None:
                positions[nodes] = positions[nodes[0]]
        new.context.setPositions(positions)
    pairs = list(zip(old_built.filaments, built.filaments))
    have_come = any(own.takes_part and not other.takes_part for other, own in pairs)
    if have_come and stage.configuration.relaxes and all(own.growth is None for own in built.filaments):
        positions = new.context.getState(positions=True).getPositions(asNumpy=True)
        new.context.setPositions(relaxed_again(stage.configuration, built.filaments, positions, built.deleted, stop))
    cut_filaments(stage, (new, built), say)
    return new, built


def _delete_grown(deleted, columns, force):
    # Their monomers are no longer anywhere: a pool that has a volume does not get them.
    chains = [force.getGrowingChainParameters(index)[0] for index in range(force.getNumGrowingChains())]
    gone = np.isin(chains, list(deleted))
    if not gone.any():
        return
    ends = columns.get("ends").reshape(-1, 2)
    states = [force.getMonomersHaveStates(index) for index in range(len(chains))]
    stays = np.repeat(~gone, np.where(states, ends[:, 1] - ends[:, 0], 0))
    ends[gone] = 0
    columns.put("ends", ends)
    for name in ("monomerTimes", "monomerStates"):
        columns.put(name, columns.get(name)[stays])
    for name in ("identities", "parents"):
        columns.put(name, np.where(gone, -1, columns.get(name)))


def _change_linkers(stage, generator, deleted, columns, force):
    first = force.getLinkers()
    rows = {name: columns.get(name) for name in ("numbers", "types", "anchors", "clocks")}
    rows["chains"], rows["places"] = (columns.get(name).reshape(-1, 2) for name in ("chains", "places"))
    _let_go(rows, force, deleted)
    # Behind those of the file are those by which mothers hold branches, which are no more when one of the two is not.
    of_branches = (rows["types"] >= len(stage.configuration.linkers)) & (rows["anchors"] < 0)
    keep, added = ~(of_branches & (rows["chains"] < 0).any(axis=1)), []
    for number, own in enumerate(stage.configuration.linkers):
        if own.anchors is not None:
            continue
        mine = np.flatnonzero(rows["types"] == number)
        hands = (rows["chains"][mine] >= 0).sum(axis=1)
        least = 0 if stage.is_piece else KEPT.index(own.keep)
        # Of a concentration, those that are not bound are nobody's.
        least = max(least, int(own.concentration is not None))
        keep[mine[hands < least]] = False
        mine = mine[hands >= least]
        if number in stage.counted and own.count is not None:
            excess = len(mine) - own.count
            if excess > 0:
                keep[generator.choice(mine, excess, replace=False)] = False
            added.append((number, max(0, -excess), own.bound if number in stage.bound else 0))
    rows = {name: values[keep] for name, values in rows.items()}
    parts, next_number = [rows], int(columns.get("nextNumber")[0])
    for number, count, bound in added:
        parts.append(_new_linkers(number, count, bound, next_number, first))
        next_number += count
    for name in rows:
        columns.put(name, np.concatenate([own[name] for own in parts]))
    columns.put("nextNumber", [next_number])
    if columns.has("unboundNumbers"):
        # Linkers that are added, or have let go, are put anywhere.
        unbound = rows["numbers"][(rows["chains"] < 0).all(axis=1)]
        numbers, places = columns.get("unboundNumbers"), columns.get("unboundPlaces").reshape(-1, 3)
        stay = np.isin(numbers, unbound)
        columns.put("unboundNumbers", numbers[stay])
        columns.put("unboundPlaces", places[stay])


def _let_go(rows, force, deleted):
    # Hands on filaments that go, and those of which a stage says that they do not bind there.
    gone = np.isin(rows["chains"], list(deleted))
    rows["chains"][gone] = -1
    rows["places"][gone] = 0.0
    for number in range(force.getNumLinkerTypes()):
        for side, hand in enumerate(force.getLinkerTypeParameters(number)[:2]):
            if hand < 0:
                continue
            there = (rows["types"] == number) & (rows["chains"][:, side] >= 0)
            gone = there & ~np.isin(rows["chains"][:, side], np.array(force.getHandChains(hand)))
            rows["chains"][gone, side] = -1
            rows["places"][gone, side] = 0.0


def _new_linkers(kind, count, bound, next_number, first):
    # The first ones begin bound where those of the new System do.
    _, types, _, chains, places = (np.array(column) for column in first[:5])
    there = np.flatnonzero(types == kind)[:bound]
    rows = {
        "numbers": next_number + np.arange(count),
        "types": np.full(count, kind),
        "anchors": np.full(count, -1),
        "clocks": np.zeros(count),
        "chains": np.full((count, 2), -1),
        "places": np.zeros((count, 2)),
    }
    rows["chains"][: len(there)] = chains.reshape(-1, 2)[there]
    rows["places"][: len(there)] = places.reshape(-1, 2)[there]
    return rows
