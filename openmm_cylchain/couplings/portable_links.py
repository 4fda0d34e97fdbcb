"""Crosslinks that a PythonForce computes, on any platform.

A context parameter holds the identity of the table of crosslinks that a Context uses, a digest of what the table holds.
"""

import pickle
import xml.etree.ElementTree as ElementTree

import openmm

from ..engine_choice import why_no_python_forces
from ..errors import InputError
from ..units.types import FloatArray
from .crosslink_computation import CrosslinkComputation
from .crosslink_tables import TABLES, CrosslinkTable
from .link_store import LinkStore, not_of_this_system, parameters_of

_PARAMETER = "crosslink_table"


class PortableLinks(LinkStore):
    """The crosslinks of a PythonForce, by its computation."""

    def __init__(self, computation: CrosslinkComputation, force: openmm.Force) -> None:
        self._address = int(force.this)
        self._computation = computation
        self.model = computation.model
        self.defaults = computation.defaults
        self.initial = computation.initial

    @classmethod
    def of_force(cls, force: openmm.Force) -> "PortableLinks | None":
        """Those of a force of a System, or None if it is no such force."""
        if not parameters_of(force, _PARAMETER):
            return None
        content = ElementTree.fromstring(openmm.XmlSerializer.serialize(force)).attrib["function"]
        return cls(pickle.loads(bytes.fromhex(content)), force)

    @classmethod
    def make_for(
        cls,
        system: openmm.System,
        model: str,
        initial: CrosslinkTable,
        periodic: bool,
        defaults: tuple[float, float, float],
    ) -> "tuple[PortableLinks, openmm.Force]":
        """Make the force of a System; InputError if OpenMM has no forces that are computed in Python."""
        missing = why_no_python_forces()
        if missing is not None:
            raise InputError(
                "Without filaments of the compiled engine in the System, crosslinks are computed in Python: "
                f"{missing}, or add the filaments to the System before its crosslinks."
            )
        taken = [name for force in system.getForces() for name in parameters_of(force, _PARAMETER)]
        parameter = f"{_PARAMETER}_{len(taken)}"
        computation = CrosslinkComputation(parameter, model, initial, periodic, defaults)
        force = openmm.PythonForce(computation, {parameter: float(initial.identity)})
        force.setUsesPeriodicBoundaryConditions(periodic)
        return cls(computation, force), force

    def require(self, context: openmm.Context) -> None:
        """See LinkStore."""
        if all(int(force.this) != self._address for force in context.getSystem().getForces()):
            raise not_of_this_system()

    def table(self, context: openmm.Context) -> CrosslinkTable:
        """See LinkStore."""
        return self._computation.table(context.getParameter(self._computation.parameter))

    def replace(self, context: openmm.Context, table: CrosslinkTable) -> None:
        """See LinkStore."""
        TABLES.hold(context, table)
        # OpenMM drops forces that it may have kept.
        context.setParameter(self._computation.parameter, float(table.identity))

    def boxes(self, context: openmm.Context, state: openmm.State) -> tuple[FloatArray | None, FloatArray | None]:
        """See LinkStore."""
        return (state.getPeriodicBoxVectors(asNumpy=True)._value if self._computation.periodic else None), None
