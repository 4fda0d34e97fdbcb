"""Crosslinks that the compiled engine computes: a CylinderChainLinkForce."""

from typing import Any
from weakref import WeakKeyDictionary

import numpy as np
import openmm

from ..engine_choice import load_plugin
from ..errors import InputError
from ..units.types import FloatArray, IntArray
from .beam_curves import BeamCurves
from .crosslink_tables import CrosslinkTable
from .link_places import LinkPlaces
from .link_store import LinkStore, not_of_this_system, unknown_crosslinks

_CHANGES = 256


def is_of_compiled_engine(system: openmm.System) -> bool:
    """Whether a System has filaments of the compiled engine."""
    plugin = load_plugin()
    return plugin is not None and any(plugin.CylinderChainForce.isinstance(force) for force in system.getForces())


def is_link_force(force: openmm.Force) -> bool:
    """Whether a force of a System is a CylinderChainLinkForce."""
    plugin = load_plugin()
    return plugin is not None and plugin.CylinderChainLinkForce.isinstance(force)


def table_of_force(force: Any) -> CrosslinkTable:
    """The links of a CylinderChainLinkForce, with which Contexts begin."""
    return _as_table(load_plugin().CylinderChainLinkForce.cast(force).getLinks())


class NativeLinks(LinkStore):
    """The crosslinks of a CylinderChainLinkForce of a System, by whose address it is known: see ``LinkStore``."""

    def __init__(
        self,
        force: Any,
        model: str,
        defaults: tuple[float, float, float],
        initial: CrosslinkTable,
    ) -> None:
        self.model = model
        self.defaults = defaults
        self.initial = initial
        self._curves: tuple[BeamCurves | None] | None = None
        self._address = int(force.this)
        self._known: WeakKeyDictionary[openmm.Context, tuple[float, CrosslinkTable]] = WeakKeyDictionary()

    @classmethod
    def of_force(cls, force: openmm.Force) -> "NativeLinks | None":
        """Those of a force of a System; None if it is no such force, joins tangents, or has several potentials."""
        if not is_link_force(force):
            return None
        plugin = load_plugin()
        own = plugin.CylinderChainLinkForce.cast(force)
        if own.getJoinsTangents():
            # They are Joints.
            return None
        models, links = own.getStretchingModelNames(), own.getLinks()
        number, rest, stiffness, extension = (getattr(one, "_value", one) for one in own.getDefaultLinkParameters())
        if not stiffness and links[0]:
            # One that Crosslinks has not made.
            number, (rest, stiffness, extension) = links[4][0], links[5][:3]
        if any(one != number for one in links[4]) or not all(stiffness > 0.0 for stiffness in links[5][1::3]):
            return None
        defaults = (stiffness, rest, extension if models[number] == "fene" else np.inf)
        return cls(own, models[number], defaults, _as_table(links))

    @classmethod
    def make_for(
        cls,
        system: openmm.System,
        model: str,
        initial: CrosslinkTable,
        periodic: bool,
        defaults: tuple[float, float, float],
    ) -> "tuple[NativeLinks, openmm.Force]":
        """Make the force of a System."""
        plugin = load_plugin()
        kind = plugin.CylinderChainLinkForce
        force = kind()
        number = kind.getStretchingModelNames().index(model)
        force.setDefaultLinkParameters(number, defaults[1], defaults[0], defaults[2] if model == "fene" else 0.0)
        force.setUsesPeriodicBoundaryConditions(periodic)
        with _as_input_error():
            force.setLinks(*_as_columns(initial, number))
        return cls(force, model, defaults, initial), force

    def require(self, context: openmm.Context) -> None:
        """See LinkStore."""
        self._force_in(context)

    def table(self, context: openmm.Context) -> CrosslinkTable:
        """See LinkStore."""
        force = self._force_in(context)
        digest = context.getParameter(force.getDigestParameter(context))
        known = self._known.get(context)
        if known is None or known[0] != digest:
            with _as_input_error():
                known = digest, _as_table(force.getLinksInContext(context))
            if len(known[1]) and np.any(np.isfinite(known[1].maximum_extension) != (self.model == "fene")):
                raise InputError(
                    f"This Context has links that are not of model {self.model!r}: a CylinderChainLinkForce of "
                    "Crosslinks cannot hold others."
                )
            self._known[context] = known
        return known[1]

    def replace(self, context: openmm.Context, table: CrosslinkTable) -> None:
        """See LinkStore."""
        force = self._force_in(context)
        with _as_input_error():
            force.setLinksInContext(context, *_as_columns(table, self._model_of(force)))

    def boxes(self, context: openmm.Context, state: openmm.State) -> tuple[FloatArray | None, FloatArray | None]:
        """See LinkStore."""
        plugin = load_plugin()
        box = state.getPeriodicBoxVectors(asNumpy=True)._value
        forces = [one for one in context.getSystem().getForces() if plugin.CylinderChainForce.isinstance(one)]
        nearest = any(one.usesPeriodicBoundaryConditions() for one in forces)
        periodic = self._force_in(context).usesPeriodicBoundaryConditions()
        return (box if periodic else None), (box if nearest else None)

    def curves(self, context: openmm.Context) -> BeamCurves | None:
        """See LinkStore."""
        if self._curves is None:
            # Of the System, whose Contexts have the same.
            self._curves = (BeamCurves.of_system(context.getSystem()),)
        return self._curves[0]

    def next_number(self, context: openmm.Context) -> int:
        """See LinkStore."""
        with _as_input_error():
            return self._force_in(context).getNextLinkNumberInContext(context)

    def add(self, context: openmm.Context, places: LinkPlaces, parameters: tuple[float, float, float]) -> None:
        """See LinkStore."""
        force = self._force_in(context)
        stiffness, rest_length, extension = parameters
        parameters = rest_length, stiffness, extension if self.model == "fene" else 0.0
        count = len(places)
        with _as_input_error():
            force.addLinksInContext(
                context, *_columns_of(places), [self._model_of(force)] * count, list(parameters) * count
            )

    def remove(self, context: openmm.Context, numbers: IntArray) -> None:
        """See LinkStore."""
        try:
            self._force_in(context).removeLinksInContext(context, numbers.tolist())
        except openmm.OpenMMException:
            # What is wrong is said by the table, as ever.
            super().remove(context, numbers)

    def switch(self, context: openmm.Context, numbers: IntArray, active: bool) -> None:
        """See LinkStore."""
        try:
            self._force_in(context).setLinksActiveInContext(context, numbers.tolist(), active)
        except openmm.OpenMMException:
            super().switch(context, numbers, active)

    def _model_of(self, force):
        return force.getStretchingModelNames().index(self.model)

    def _force_in(self, context):
        kind = load_plugin().CylinderChainLinkForce
        # The System keeps what they are, so none of them is kept here.
        for force in context.getSystem().getForces():
            if int(force.this) == self._address:
                return kind.cast(force)
        raise not_of_this_system()


class _as_input_error:  # noqa: N801 - it reads as a statement
    def __enter__(self):
        return self

    def __exit__(self, kind, error, traceback):
        if getattr(error, "kind", None) == "unknown-links":
            raise unknown_crosslinks(_CHANGES) from None
        if isinstance(error, openmm.OpenMMException):
            raise InputError(f"{error}.") from None


def _columns_of(places):
    ends = np.stack([places.pairs, places.partners], axis=2)
    return ends.ravel().tolist(), places.fractions.ravel().tolist(), places.points.ravel().tolist()


def _as_columns(table, model):
    extension = np.where(np.isfinite(table.maximum_extension), table.maximum_extension, 0.0)
    parameters = np.stack([table.rest_length, table.stiffness, extension], axis=1)
    return (
        table.numbers.tolist(),
        *_columns_of(table.places),
        [model] * len(table),
        parameters.ravel().tolist(),
        table.active.astype(int).tolist(),
        table.next_number,
    )


def _as_table(links):
    numbers, ends, fractions, points, models, parameters, active, next_number = links
    ends = np.array(ends, dtype=np.int64).reshape(-1, 2, 2)
    rest_length, stiffness, extension = np.array(parameters, dtype=float).reshape(-1, 3).T
    return CrosslinkTable(
        np.array(numbers, dtype=np.int64),
        ends[:, :, 0],
        stiffness,
        rest_length,
        np.where(extension > 0.0, extension, np.inf),
        next_number,
        ends[:, :, 1],
        np.array(fractions, dtype=float).reshape(-1, 2),
        np.array(points, dtype=float).reshape(-1, 3),
        np.array(active, dtype=bool),
    )
