"""From a stage of a run to the next one: another System, in the state in which the last one has ended.

Positions, what has grown, linkers and the count of steps, by which noise is drawn, go on; all else is new. Linkers that
a stage adds are not bound, unless it says so; of those that it takes away, each has the same chance.
"""

from xml.etree import ElementTree

import numpy as np
import openmm

from ..errors import InputError
from ..kinetics.binding_force import find_binding_force
from ..kinetics.growth_force import find_growth_force
from .tables.linkers import KEPT

_PARAMETERS = "IntegratorParameters"
_LINKERS, _GROWTH = "linkers", "growth"


def carry_over(before, after, stage, seed):
    """Bring the Context of a stage into the state of that of the stage before.

    Parameters
    ----------
    before, after : tuple of (app.Simulation, BuiltSystem)
    stage : Stage
        The later one.
    seed : int
        By which linkers are chosen that are taken away.

    Raises
    ------
    InputError
        If the two Systems have not the same particles.
    """
    (old, _), (new, built) = before, after
    if old.system.getNumParticles() != new.system.getNumParticles():
        raise InputError(
            f"Stage {stage.name!r} has {new.system.getNumParticles()} particles, but that before has "
            f"{old.system.getNumParticles()}: how many there are cannot change while a run goes on, and so contacts of "
            "beam elements, which have particles, have one diameter in all stages."
        )
    compiled = built.filaments.engine == "compiled"
    state = old.context.getState(positions=True, integratorParameters=compiled)
    if not compiled:
        new.context.setPositions(state.getPositions())
        new.context.setTime(state.getTime())
        new.context.setStepCount(state.getStepCount())
        return
    tree = ElementTree.fromstring(openmm.XmlSerializer.serialize(state))
    parameters = tree.find(_PARAMETERS)
    for child in list(parameters):
        # The flow and links are those of the stage.
        if child.tag not in (_LINKERS, _GROWTH):
            parameters.remove(child)
    linkers, growth = (parameters.find(name) for name in (_LINKERS, _GROWTH))
    if linkers is not None:
        generator = np.random.default_rng([seed, stage.number, 6])
        _Linkers(linkers).go_on(find_binding_force(new.system), stage, generator)
    if growth is not None:
        _change_pools(growth, old.system, new.system)
    new.context.setState(openmm.XmlSerializer.deserialize(ElementTree.tostring(tree, encoding="unicode")))


class _Columns:
    # Numbers of a state by the names of their columns.
    def __init__(self, node):
        self._nodes = {child.get("name"): child for child in node}

    def get(self, name):
        node = self._nodes[name]
        kind = float if node.tag == "Reals" else np.int64
        return np.array(node.get("values").split(), dtype=kind)

    def put(self, name, values):
        self._nodes[name].set("values", "".join(f"{value!r} " for value in np.asarray(values).ravel().tolist()))


class _Linkers(_Columns):
    def go_on(self, force, stage, generator):
        first = force.getLinkers()
        rows = {name: self.get(name) for name in ("numbers", "types", "anchors", "clocks")}
        rows["chains"], rows["places"] = (self.get(name).reshape(-1, 2) for name in ("chains", "places"))
        self._let_go(rows, force)
        keep, added = np.ones(len(rows["numbers"]), bool), []
        for number, own in enumerate(stage.configuration.linkers):
            mine = np.flatnonzero(rows["types"] == number)
            if own.anchors is not None:
                continue
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
        numbers, next_number = [rows], int(self.get("nextNumber")[0])
        for number, count, bound in added:
            numbers.append(_new_linkers(number, count, bound, next_number, first))
            next_number += count
        for name in rows:
            self.put(name, np.concatenate([own[name] for own in numbers]))
        self.put("nextNumber", [next_number])

    def _let_go(self, rows, force):
        # Hands of which a stage says that they do not bind there.
        for number in range(force.getNumLinkerTypes()):
            hands = force.getLinkerTypeParameters(number)[:2]
            for side, hand in enumerate(hands):
                if hand < 0:
                    continue
                chains = np.array(force.getHandChains(hand))
                mine = (rows["types"] == number) & (rows["chains"][:, side] >= 0)
                gone = mine & ~np.isin(rows["chains"][:, side], chains)
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


def _change_pools(node, old, new):
    # By how much the first concentration of a pool with a volume changes, so many monomers come or go.
    columns, (before, after) = _Columns(node), map(find_growth_force, (old, new))
    free = columns.get("free")
    for pool in range(len(free)):
        (first, _), (concentration, volume) = before.getPoolParameters(pool), after.getPoolParameters(pool)
        if volume > 0.0:
            free[pool] = max(0, free[pool] + round((concentration - first) * volume))
    columns.put("free", free)
