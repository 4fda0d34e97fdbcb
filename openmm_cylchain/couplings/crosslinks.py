"""Crosslinks: springs between two places that come and go while a simulation runs.

A crosslink joins two places with the energy of their distance d

    harmonic    (k/2) (d - d0)^2
    fene        -(k/2) D^2 ln(1 - ((d - d0)/D)^2)

A place is a particle, which may be an attachment point or a node of a filament or anything else; a place on a segment
or on the curve of a beam element; or, for one of the two, a point that does not move. Where the places coincide, the
force has no direction and is zero.

Where a System has filaments of the compiled engine, its CylinderChainLinkForce computes them; elsewhere a PythonForce
does, on any platform. Which crosslinks there are belongs to each Context. A context parameter holds a digest of them:
so States and checkpoints say which belong to them, and one that comes from elsewhere cannot be taken for another.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import openmm

from ..errors import InputError
from ..filaments.segment_place import SegmentPlace
from ..mechanics.potentials import STRETCHING_POTENTIALS
from ..units.quantities import (
    LENGTH,
    STIFFNESS,
    non_negative,
    one_of,
    positive,
    require_kind,
    shown,
    thermal_energy,
    true_or_false,
    whole_number,
)
from ..units.types import FloatArray, FloatOrArray, Indices, IntArray, Scalar, Vector
from .crosslink_computation import lengths_and_vectors, slopes_of, thermal_stiffness_of
from .crosslink_tables import CrosslinkTable, as_numbers
from .growing_chains import refuse_links_of_growing
from .link_places import as_places
from .link_store import LinkStore
from .native_links import NativeLinks, is_of_compiled_engine
from .periodicity import check_rest_lengths, default_box, is_periodic
from .portable_links import PortableLinks

CROSSLINKS_NAME = "Crosslinks"


class Crosslinks:
    """Crosslinks of one potential, that are added and removed while simulations run.

    The methods that take a Context change or describe the crosslinks of that Context alone; with None they mean those
    that every new Context begins with, which can change until ``add_to``. No other crosslink of a Context gets the
    number of one that is removed, unless ``set_pairs`` numbers all of them anew.

    The implicit schemes of the compiled engine have crosslinks in their equations, however stiff they are; all other
    schemes take them at the start of a step. ``Filaments.recommended_time_step(system=system)`` knows those that the
    System begins with, or where there are none, one between filaments.

    Parameters
    ----------
    stiffness : energy/length^2
        k of a crosslink that is given none of its own.
    rest_length : length
        d0; may be zero.
    model : {"harmonic", "fene"}
    maximum_extension : length
        D of the FENE potential (required by it, refused otherwise): the distance stays within d0 - D and d0 + D.

    Raises
    ------
    InputError
        For a value that is missing, not finite, of the wrong unit, or negative.

    Notes
    -----
    With an integrator of the compiled engine, checkpoints hold the crosslinks themselves, and so do States with
    ``integratorParameters=True`` (those of ``Simulation.saveState``): they restore them in any Context and process.

    All other checkpoints, and States with ``parameters=True``, hold a digest of the crosslinks. Going back to one
    restores those that the Context had then, up to 256 changes ago. Elsewhere, any step or energy raises an error that
    asks for them: save ``table(context)`` beside the checkpoint (``CrosslinkTable.save``) and give it to ``set_table``.
    It does not matter whether this is done before or after the checkpoint is loaded. A State without parameters leaves
    crosslinks as they are.

    Examples
    --------
    >>> import openmm
    >>> system = openmm.System()
    >>> for _ in range(3):
    ...     _ = system.addParticle(1.0)
    >>> links = Crosslinks(stiffness=100.0, rest_length=0.5)
    >>> links.add(None, 0, 1)
    0
    >>> force = links.add_to(system)
    >>> context = openmm.Context(system, openmm.VerletIntegrator(0.001), openmm.Platform.getPlatform("Reference"))
    >>> context.setPositions([[0, 0, 0], [0.6, 0, 0], [1.1, 0, 0]])
    >>> links.add(context, 1, 2)
    1
    >>> links.remove(context, 0)
    >>> links.pairs(context).tolist()
    [[1, 2]]
    """

    def __init__(
        self, stiffness: Scalar, rest_length: Scalar, model: str = "harmonic", maximum_extension: Scalar | None = None
    ) -> None:
        one_of(model, STRETCHING_POTENTIALS, "model")
        if (model == "fene") != (maximum_extension is not None):
            raise InputError("maximum_extension must be given for model 'fene', and only for it.")
        self._model = model
        self._defaults = self._described("Crosslinks:", stiffness, rest_length, maximum_extension)
        self._initial = CrosslinkTable()
        self._store: LinkStore | None = None

    @classmethod
    def from_system(cls, system: openmm.System) -> list[Crosslinks]:
        """The Crosslinks of a System that holds some, such as one that was read from XML.

        Returns
        -------
        list of Crosslinks
            In the order in which they were added.
        """
        require_kind(system, openmm.System, "system")
        found: list[Crosslinks] = []
        for force in system.getForces():
            store = PortableLinks.of_force(force) or NativeLinks.of_force(force)
            if store is not None:
                found.append(cls._of(store))
        return found

    @classmethod
    def of_force(cls, force: openmm.Force) -> Crosslinks | None:
        """The Crosslinks of a force of a System, or None if it is no force of crosslinks of one potential."""
        require_kind(force, openmm.Force, "force")
        store = PortableLinks.of_force(force) or NativeLinks.of_force(force)
        return None if store is None else cls._of(store)

    @classmethod
    def _of(cls, store):
        links = cls.__new__(cls)
        links._model = store.model
        links._defaults = store.defaults
        links._initial = store.initial
        links._store = store
        return links

    @property
    def model(self) -> str:
        """The potential: "harmonic" or "fene"."""
        return self._model

    def add_to(self, system: openmm.System, force_group: int = 0, periodic: bool | None = None) -> openmm.Force:
        """Add the force to a System, when its filaments and particles are there and before the integrator is created.

        Parameters
        ----------
        system : openmm.System
        force_group : int
        periodic : bool, optional
            Whether a crosslink joins the nearest images of its places. If not given: whether the System has a box, or
            another force that is periodic.

        Returns
        -------
        openmm.Force
            A CylinderChainLinkForce if the System has filaments of the compiled engine, or else a PythonForce.

        Raises
        ------
        InputError
            If these crosslinks are in a System already, or join particles that it does not have; if one of them is
            longer at rest than nearest images can be apart; if OpenMM is older than 8.5 and the System has no filaments
            of the compiled engine.
        """
        if self._store is not None:
            raise InputError("These crosslinks are already in a System; make another Crosslinks for another System.")
        if whole_number(force_group, 0, "force_group") > 31:
            raise InputError(f"force_group must be between 0 and 31, but is {force_group}.")
        require_kind(system, openmm.System, "system")
        self._initial.places.check(self._initial.numbers, system.getNumParticles())
        refuse_links_of_growing(system, self._initial.places, self._initial.numbers)
        periodic = is_periodic(system) if periodic is None else true_or_false(periodic, "periodic")
        if periodic:
            check_rest_lengths(self._initial.numbers, self._initial.rest_length, default_box(system))
        kind: Any = NativeLinks if is_of_compiled_engine(system) else PortableLinks
        store, force = kind.make_for(system, self._model, self._initial, periodic, self._defaults)
        force.setName(CROSSLINKS_NAME)
        force.setForceGroup(int(force_group))
        system.addForce(force)
        self._store = store
        return force

    def add(
        self,
        context: openmm.Context | None,
        first: int | SegmentPlace | Vector,
        second: int | SegmentPlace | Vector,
        stiffness: Scalar | None = None,
        rest_length: Scalar | None = None,
        maximum_extension: Scalar | None = None,
    ) -> int:
        """Add a crosslink between two places.

        Parameters
        ----------
        context : openmm.Context or None
        first, second : int, SegmentPlace, or (3,) length
            A particle index; a place on a segment, such as ``Filaments.segment_place`` returns; or, for one of the two,
            a point that does not move. A place may have any number of crosslinks.
        stiffness, rest_length, maximum_extension : optional
            Of this crosslink, if they differ from those of the others.

        Returns
        -------
        int
            The crosslink's number.

        Raises
        ------
        InputError
            For a particle that does not exist, a crosslink of a place to itself, a bad parameter, or a rest length that
            nearest images can never have.
        """
        return int(self.add_many(context, [(first, second)], stiffness, rest_length, maximum_extension)[0])

    def add_many(
        self,
        context: openmm.Context | None,
        pairs: Any,
        stiffness: Scalar | None = None,
        rest_length: Scalar | None = None,
        maximum_extension: Scalar | None = None,
    ) -> IntArray:
        """Add many crosslinks at once, which is much faster than one by one.

        Parameters
        ----------
        context : openmm.Context or None
        pairs : (n, 2) array of int, or sequence of n pairs of places
            What each of them joins, as for ``add``. An int array is taken fastest.
        stiffness, rest_length, maximum_extension : optional
            Of these crosslinks, if they differ from those of the others.

        Returns
        -------
        (n,) int array
            The numbers of the crosslinks.

        Raises
        ------
        InputError
            As for ``add``; none of them is added then.
        """
        store = self._store_for(context)
        number = self._initial.next_number if store is None else store.next_number(context)
        places = as_places(pairs)
        numbers = number + np.arange(len(places))
        places.check(numbers, None if context is None else context.getSystem().getNumParticles())
        default = self._defaults
        given = (
            default[0] if stiffness is None else stiffness,
            default[1] if rest_length is None else rest_length,
            self._default_extension() if maximum_extension is None else maximum_extension,
        )
        parameters = self._described(f"Crosslink {number}:", *given)
        if store is None:
            self._initial = self._initial.with_links(places, *parameters)
        elif len(places):
            _check_in_context(store, context, numbers[:1], np.array([parameters[1]]))
            assert context is not None
            refuse_links_of_growing(context.getSystem(), places, numbers)
            store.add(context, places, parameters)
        return numbers

    def remove(self, context: openmm.Context | None, numbers: int | Indices) -> None:
        """Remove a crosslink, or several at once.

        Parameters
        ----------
        context : openmm.Context or None
        numbers : int or sequence of int

        Raises
        ------
        InputError
            For a number that is not that of a crosslink of this Context.
        """
        chosen, store = as_numbers(numbers), self._store_for(context)
        if store is None:
            self._initial = self._initial.without(chosen)
        else:
            store.remove(context, chosen)

    def set_active(self, context: openmm.Context | None, numbers: int | Indices, active: bool) -> None:
        """Switch a crosslink, or several at once, on or off.

        One that is off exerts no force, but keeps its number, places and parameters. ``table(context).active`` says
        which are on.

        Parameters
        ----------
        context : openmm.Context or None
        numbers : int or sequence of int
        active : bool

        Raises
        ------
        InputError
            For a number that is not that of a crosslink of this Context.
        """
        chosen, store = as_numbers(numbers), self._store_for(context)
        active = true_or_false(active, "active")
        if store is None:
            self._initial = self._initial.switched(chosen, active)
        else:
            store.switch(context, chosen, active)

    def pairs(self, context: openmm.Context | None) -> IntArray:
        """The particles of all crosslinks of a Context: an int array (n, 2), in the order of ``numbers``.

        Of a place on a segment, the particle at fraction 0; -1 for a fixed point, which is always the second place.
        ``table(context)`` has the rest.
        """
        return self.table(context).pairs

    def numbers(self, context: openmm.Context | None) -> IntArray:
        """The numbers of all crosslinks of a Context: an int array (n,), ascending."""
        return self.table(context).numbers

    def set_pairs(self, context: openmm.Context | None, pairs: Any) -> None:
        """Replace all crosslinks of a Context by others with the common parameters, numbered from 0.

        Parameters
        ----------
        context : openmm.Context or None
        pairs : (n, 2) array of int, or sequence of n pairs of places
            As for ``add_many``.

        Raises
        ------
        InputError
            For particles that do not exist, or a crosslink of a place to itself.
        """
        self._store_for(context)
        places = as_places(pairs)
        places.check(np.arange(len(places)), None if context is None else context.getSystem().getNumParticles())
        self._replace(context, CrosslinkTable().with_links(places, *self._defaults))

    def table(self, context: openmm.Context | None) -> CrosslinkTable:
        """All crosslinks of a Context with their numbers and parameters: a CrosslinkTable, which never changes.

        Raises
        ------
        InputError
            If the Context has got a State or checkpoint whose crosslinks are not known.
        """
        if context is None:
            return self._initial
        return self._store_in(context).table(context)

    def set_table(self, context: openmm.Context | None, table: CrosslinkTable) -> None:
        """Give a Context the crosslinks of a table, with the numbers and parameters that it holds."""
        if not isinstance(table, CrosslinkTable):
            raise InputError(f"table must be a CrosslinkTable, as Crosslinks.table returns it, but is {shown(table)}.")
        self._store_for(context)
        if len(table) and np.all(np.isfinite(table.maximum_extension)) != (self._model == "fene"):
            raise InputError(f"The table is not one of crosslinks with model {self._model!r}.")
        table.places.check(table.numbers, None if context is None else context.getSystem().getNumParticles())
        self._replace(context, table)

    def lengths(self, context: openmm.Context) -> FloatArray:
        """Distances d between the places of all crosslinks of a Context, in nm: an array (n,)."""
        return self._measured(context)[1]

    def extensions(self, context: openmm.Context) -> FloatArray:
        """Extensions d - d0 of all crosslinks of a Context, in nm: an array (n,)."""
        table, lengths, _ = self._measured(context)
        return lengths - table.rest_length

    def forces(self, context: openmm.Context) -> FloatArray:
        """Forces dV/dd of all crosslinks of a Context, in kJ/(mol nm): an array (n,), positive where they pull.

        Zero of those that are off.
        """
        return self._measured(context)[2]

    def measure(self, context: openmm.Context, state: openmm.State) -> tuple[CrosslinkTable, FloatArray, FloatArray]:
        """The crosslinks of a Context, their lengths and their forces, in a State of it.

        Parameters
        ----------
        context : openmm.Context
        state : openmm.State
            With positions.

        Returns
        -------
        table : CrosslinkTable
        lengths, forces : (n,) arrays
            d in nm and dV/dd in kJ/(mol nm).

        Raises
        ------
        InputError
            If the crosslinks are not known, or one is longer than its potential allows.
        """
        store = self._store_in(context)
        require_kind(state, openmm.State, "state")
        table = store.table(context)
        positions = state.getPositions(asNumpy=True)._value
        box, segment_box = store.boxes(context, state)
        lengths, _ = lengths_and_vectors(self._model, table, positions, box, segment_box, store.curves(context))
        return table, lengths, slopes_of(self._model, table, lengths)

    @property
    def default_lengths(self) -> tuple[float, float]:
        """Rest length and maximum extension, in nm, of a crosslink that is given none; the latter may be infinite."""
        extension = self._default_extension()
        return self._defaults[1], float("inf") if extension is None else extension

    @property
    def default_stiffness(self) -> float:
        """Stiffness k, in kJ/(mol nm^2), of a crosslink that is given none."""
        return self._defaults[0]

    def thermal_stiffness(self, table: CrosslinkTable | None, temperature: Scalar) -> FloatOrArray:
        """Stiffness of crosslinks where thermal motion takes them, in kJ/(mol nm^2).

        k of harmonic ones. The curvature k (1 + u^2)/(1 - u^2)^2 of a FENE potential at u = (d - d0)/D, for twice the
        standard deviation of u in its own equilibrium, u^2 = 4/(3 + k D^2/k_B T), or 0.9 if that is less.

        Parameters
        ----------
        table : CrosslinkTable or None
            None for a crosslink with the common parameters.
        temperature : temperature

        Returns
        -------
        (n,) array, or a number
        """
        stiffness, extension = self._defaults[0], self._defaults[2]
        if table is not None:
            require_kind(table, CrosslinkTable, "table")
            stiffness, extension = table.stiffness, table.maximum_extension
        return thermal_stiffness_of(self._model, stiffness, extension, thermal_energy(temperature))

    def _measured(self, context):
        self._store_in(context)
        return self.measure(context, context.getState(positions=True))

    def _store_in(self, context):
        if self._store is None:
            raise InputError("These crosslinks are not in a System yet: call add_to before Contexts are created.")
        if not isinstance(context, openmm.Context):
            raise InputError(f"context must be an openmm.Context, but is {shown(context)}.")
        self._store.require(context)
        return self._store

    def _store_for(self, context):
        # None where the crosslinks that new Contexts begin with are meant.
        if context is not None:
            return self._store_in(context)
        if self._store is not None:
            raise InputError("The crosslinks are in a System already: give the Context in which they shall change.")
        return None

    def _replace(self, context, table):
        store = self._store_for(context)
        if store is None:
            self._initial = table
        else:
            _check_in_context(store, context, table.numbers, table.rest_length)
            store.replace(context, table)

    def _default_extension(self):
        return self._defaults[2] if self._model == "fene" else None

    def _described(self, label, stiffness, rest_length, maximum_extension):
        if maximum_extension is not None and self._model != "fene":
            raise InputError(f"{label} maximum_extension belongs to model 'fene' alone.")
        return (
            positive(stiffness, STIFFNESS, f"{label} stiffness"),
            non_negative(rest_length, LENGTH, f"{label} rest_length"),
            np.inf if maximum_extension is None else positive(maximum_extension, LENGTH, f"{label} maximum_extension"),
        )


def _check_in_context(store, context, numbers, rest_lengths):
    if np.any(rest_lengths > 0.0):
        box, _ = store.boxes(context, context.getState())
        if box is not None:
            check_rest_lengths(numbers, rest_lengths, box)
