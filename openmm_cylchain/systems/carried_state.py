"""The state of a Context in that of another System with the same particles: what goes on when forces change."""

from collections.abc import Callable
from typing import Any
from xml.etree import ElementTree

import numpy as np
import openmm

from ..couplings.native_links import is_of_compiled_engine
from ..errors import InputError
from ..kinetics.binding_force import find_binding_force
from ..kinetics.growth_force import find_growth_force

_PARAMETERS, _LINKERS, _GROWTH, _TWISTS = "IntegratorParameters", "linkers", "growth", "twists"


class StateColumns:
    """Numbers that a Force stores of a Context in XML, by the names of their columns."""

    def __init__(self, node: ElementTree.Element) -> None:
        self._nodes = {child.get("name"): child for child in node}

    def get(self, name: str) -> Any:
        """A column as an array."""
        node = self._nodes[name]
        kind = float if node.tag == "Reals" else np.int64
        return np.array((node.get("values") or "").split(), dtype=kind)

    def has(self, name: str) -> bool:
        """Whether there is a column."""
        return name in self._nodes

    def put(self, name: str, values: Any) -> None:
        """Replace a column; of real numbers to the last digit."""
        self._nodes[name].set("values", "".join(f"{value!r} " for value in np.asarray(values).ravel().tolist()))


def carry_state(
    before: openmm.Context,
    after: openmm.Context,
    change_linkers: Callable[[StateColumns, Any], None] | None = None,
    change_growth: Callable[[StateColumns, Any], None] | None = None,
) -> None:
    """Bring a Context into the state of another one.

    Positions, time, the count of steps, by which noise is drawn, what has grown, twists and linkers go on; flow,
    crosslinks and where tethers are stay as they are.

    Parameters
    ----------
    change_linkers, change_growth : callable, optional
        Given the StateColumns of linkers, or of growth, and the force of the later System, changes them.

    Raises
    ------
    InputError
        If the two Systems have not as many particles, or a state does not fit the later one.
    """
    counts = [context.getSystem().getNumParticles() for context in (before, after)]
    if counts[0] != counts[1]:
        raise InputError(
            f"The System has {counts[1]} particles, but that before has {counts[0]}: it must have as many."
        )
    compiled = is_of_compiled_engine(after.getSystem())
    state = before.getState(positions=True, integratorParameters=compiled)
    if not compiled:
        after.setPositions(state.getPositions())
        after.setTime(state.getTime())
        after.setStepCount(state.getStepCount())
        return
    tree = ElementTree.fromstring(openmm.XmlSerializer.serialize(state))  # noqa: S314 - OpenMM's own
    parameters = tree.find(_PARAMETERS)
    assert parameters is not None
    for child in list(parameters):
        if child.tag not in (_LINKERS, _GROWTH, _TWISTS):
            parameters.remove(child)
    linkers, growth = (parameters.find(name) for name in (_LINKERS, _GROWTH))
    if linkers is not None and change_linkers is not None:
        change_linkers(StateColumns(linkers), find_binding_force(after.getSystem()))
    if growth is not None:
        columns, forces = StateColumns(growth), [find_growth_force(own.getSystem()) for own in (before, after)]
        _change_pools(columns, *forces)
        if change_growth is not None and forces[1] is not None:
            change_growth(columns, forces[1])
    try:
        after.setState(openmm.XmlSerializer.deserialize(ElementTree.tostring(tree, encoding="unicode")))
    except openmm.OpenMMException as error:
        raise InputError(f"The state does not fit the System that goes on: {error}.") from None


def _change_pools(columns, before, after):
    # By how much the first concentration of a pool with a volume changes, so many monomers come or go.
    free = columns.get("free")
    if after is None or before.getNumPools() != after.getNumPools():
        return
    for pool in range(len(free)):
        (first, _), (concentration, volume) = before.getPoolParameters(pool), after.getPoolParameters(pool)
        if volume > 0.0:
            free[pool] = max(0, free[pool] + round((concentration - first) * volume))
    columns.put("free", free)
