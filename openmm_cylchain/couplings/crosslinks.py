"""Crosslinks: springs between particles that come and go while a simulation runs.

A crosslink joins two particles, which may be attachment points or nodes of filaments or anything else, with the energy
of their distance d

    harmonic    (k/2) (d - d0)^2
    fene        -(k/2) D^2 ln(1 - ((d - d0)/D)^2)

A PythonForce computes them on any platform. Which ones there are is a table that never changes: adding or removing a
crosslink makes another one. A context parameter holds the identity of the table that a Context uses, a digest of what
the table holds. So Contexts of one System have crosslinks of their own, States and checkpoints say which belong to
them, and one that comes from elsewhere cannot be taken for another.
"""

import pickle
import xml.etree.ElementTree as ElementTree
from typing import Any

import numpy as np
import numpy.typing as npt
import openmm

from ..errors import InputError
from ..mechanics.potentials import STRETCHING_POTENTIALS
from ..units.quantities import LENGTH, STIFFNESS, non_negative, positive, thermal_energy, whole_number
from ..units.types import FloatArray, FloatOrArray, Indices, IntArray, Scalar
from .crosslink_computation import CrosslinkComputation
from .crosslink_tables import TABLES, CrosslinkTable

CROSSLINKS_NAME = "Crosslinks"

_PARAMETER = "crosslink_table"


class Crosslinks:
    """Crosslinks of one potential, that are added and removed while simulations run.

    The methods that take a Context change or describe the crosslinks of that Context alone; with None they mean those
    that every new Context begins with, which can change until ``add_to``. No other crosslink of a Context gets the
    number of one that is removed, unless ``set_pairs`` numbers all of them anew.

    Crosslinks are explicit in every scheme. ``Filaments.recommended_time_step(system=system)`` knows those that the
    System begins with, or where there are none, one between ends of filaments.

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
    States and checkpoints of OpenMM hold the identity of a table of crosslinks, not the crosslinks. In the process that
    saved them, going back restores those that there were then, up to 256 changes ago. In another process, any step or
    energy raises an error that asks for them: save ``table(context)`` beside the checkpoint
    (``CrosslinkTable.save``) and give it to ``set_table``. It does not matter whether this is done before or after the
    checkpoint is loaded.

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
        if model not in STRETCHING_POTENTIALS:
            raise InputError(f"model must be one of {', '.join(STRETCHING_POTENTIALS)}, but is {model!r}.")
        if (model == "fene") != (maximum_extension is not None):
            raise InputError("maximum_extension must be given for model 'fene', and only for it.")
        self._model = model
        self._defaults = self._described("Crosslinks:", stiffness, rest_length, maximum_extension)
        self._initial = CrosslinkTable()
        self._computation: Any = None

    @classmethod
    def from_system(cls, system: openmm.System) -> "list[Crosslinks]":
        """The Crosslinks of a System that holds some, such as one that was read from XML.

        Returns
        -------
        list of Crosslinks
            In the order in which they were added.
        """
        found = (cls.of_force(force) for force in system.getForces())
        return [links for links in found if links is not None]

    @classmethod
    def of_force(cls, force: openmm.Force) -> "Crosslinks | None":
        """The Crosslinks of a force of a System, or None if it is no force of crosslinks."""
        if not _parameters_of(force):
            return None
        content = ElementTree.fromstring(openmm.XmlSerializer.serialize(force)).attrib["function"]
        return cls._of(pickle.loads(bytes.fromhex(content)))

    @classmethod
    def _of(cls, computation):
        links = cls.__new__(cls)
        links._model = computation.model
        links._defaults = computation.defaults
        links._initial = computation.initial
        links._computation = computation
        return links

    @property
    def model(self) -> str:
        """The potential: "harmonic" or "fene"."""
        return self._model

    def add_to(self, system: openmm.System, force_group: int = 0, periodic: bool | None = None) -> openmm.PythonForce:
        """Add the force to a System, when its particles are there and before the integrator is created.

        Parameters
        ----------
        system : openmm.System
        force_group : int
        periodic : bool, optional
            Whether a crosslink joins the nearest images of its particles; whether the System has another force that
            does so if not given.

        Returns
        -------
        openmm.PythonForce

        Raises
        ------
        InputError
            If these crosslinks are in a System already, or join particles that it does not have.
        """
        if self._computation is not None:
            raise InputError("These crosslinks are already in a System; make another Crosslinks for another System.")
        if whole_number(force_group, 0, "force_group") > 31:
            raise InputError(f"force_group must be between 0 and 31, but is {force_group}.")
        _check_pairs(self._initial.pairs, self._initial.numbers, system.getNumParticles())
        periodic = system.usesPeriodicBoundaryConditions() if periodic is None else bool(periodic)
        taken = [name for force in system.getForces() for name in _parameters_of(force)]
        parameter = f"{_PARAMETER}_{len(taken)}"
        computation = CrosslinkComputation(parameter, self._model, self._initial, periodic, self._defaults)
        force = openmm.PythonForce(computation, {parameter: float(self._initial.identity)})
        force.setName(CROSSLINKS_NAME)
        force.setForceGroup(int(force_group))
        force.setUsesPeriodicBoundaryConditions(periodic)
        system.addForce(force)
        self._computation = computation
        return force

    def add(
        self,
        context: openmm.Context | None,
        first: int,
        second: int,
        stiffness: Scalar | None = None,
        rest_length: Scalar | None = None,
        maximum_extension: Scalar | None = None,
    ) -> int:
        """Add a crosslink between two particles.

        Parameters
        ----------
        context : openmm.Context or None
        first, second : int
            Particle indices. A particle may have any number of crosslinks.
        stiffness, rest_length, maximum_extension : optional
            Of this crosslink, if they differ from those of the others.

        Returns
        -------
        int
            The crosslink's number.

        Raises
        ------
        InputError
            For a particle that does not exist, a crosslink of a particle to itself, or a bad parameter.
        """
        table = self.table(context)
        number = table.next_number
        pairs = _as_pairs([[first, second]])
        _check_pairs(pairs, [number], None if context is None else context.getSystem().getNumParticles())
        default = self._defaults
        given = (
            default[0] if stiffness is None else stiffness,
            default[1] if rest_length is None else rest_length,
            self._default_extension() if maximum_extension is None else maximum_extension,
        )
        self._replace(context, table.with_links(pairs, *self._described(f"Crosslink {number}:", *given)))
        return number

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
        numbers = np.atleast_1d(np.asarray(numbers, dtype=object)).ravel()
        numbers = np.array([whole_number(number, 0, "The number of a crosslink") for number in numbers], dtype=int)
        self._replace(context, self.table(context).without(numbers))

    def pairs(self, context: openmm.Context | None) -> IntArray:
        """The particles of all crosslinks of a Context: an int array (n, 2), in the order of ``numbers``."""
        return self.table(context).pairs

    def numbers(self, context: openmm.Context | None) -> IntArray:
        """The numbers of all crosslinks of a Context: an int array (n,), ascending."""
        return self.table(context).numbers

    def set_pairs(self, context: openmm.Context | None, pairs: npt.ArrayLike) -> None:
        """Replace all crosslinks of a Context by others with the common parameters, numbered from 0.

        Parameters
        ----------
        context : openmm.Context or None
        pairs : (n, 2) array of int

        Raises
        ------
        InputError
            For particles that do not exist, or a crosslink of a particle to itself.
        """
        pairs = _as_pairs(pairs)
        _check_pairs(pairs, range(len(pairs)), None if context is None else context.getSystem().getNumParticles())
        self._replace(context, CrosslinkTable().with_links(pairs, *self._defaults))

    def table(self, context: openmm.Context | None) -> CrosslinkTable:
        """All crosslinks of a Context with their numbers and parameters: a CrosslinkTable, which never changes.

        Raises
        ------
        InputError
            If the Context has got a State or checkpoint whose crosslinks are not known in this process.
        """
        if context is None:
            return self._initial
        return self._computation_in(context).table(context.getParameter(self._computation.parameter))

    def set_table(self, context: openmm.Context | None, table: CrosslinkTable) -> None:
        """Give a Context the crosslinks of a table, with the numbers and parameters that it holds."""
        if not isinstance(table, CrosslinkTable):
            raise InputError(f"table must be a CrosslinkTable, as Crosslinks.table returns it, but is {table!r}.")
        if len(table) and np.all(np.isfinite(table.maximum_extension)) != (self._model == "fene"):
            raise InputError(f"The table is not one of crosslinks with model {self._model!r}.")
        _check_pairs(table.pairs, table.numbers, None if context is None else context.getSystem().getNumParticles())
        self._replace(context, table)

    def lengths(self, context: openmm.Context) -> FloatArray:
        """Distances d between the particles of all crosslinks of a Context, in nm: an array (n,)."""
        return self._measured(context)[1]

    def extensions(self, context: openmm.Context) -> FloatArray:
        """Extensions d - d0 of all crosslinks of a Context, in nm: an array (n,)."""
        table, lengths, _ = self._measured(context)
        return lengths - table.rest_length

    def forces(self, context: openmm.Context) -> FloatArray:
        """Forces dV/dd of all crosslinks of a Context, in kJ/(mol nm): an array (n,), positive where they pull."""
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
            If the crosslinks are not known in this process, or one is longer than its potential allows.
        """
        table = self.table(context)
        lengths, _ = self._computation.geometry(table, state, state.getPositions(asNumpy=True)._value)
        return table, lengths, self._computation.slopes(table, lengths)

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
            stiffness, extension = table.stiffness, table.maximum_extension
        if self._model != "fene":
            return stiffness
        kT = thermal_energy(temperature)
        square = np.minimum(4.0 * kT / (3.0 * kT + stiffness * extension**2), 0.9)
        return stiffness * (1.0 + square) / (1.0 - square) ** 2

    def _measured(self, context):
        self._computation_in(context)
        return self.measure(context, context.getState(positions=True))

    def _computation_in(self, context):
        if self._computation is None:
            raise InputError("These crosslinks are not in a System yet: call add_to before Contexts are created.")
        if not isinstance(context, openmm.Context):
            raise InputError(f"context must be an openmm.Context, but is {context!r}.")
        if self._computation.parameter not in dict(context.getParameters()):
            raise InputError("This Context is of a System that does not have these crosslinks.")
        return self._computation

    def _replace(self, context, table):
        if context is None:
            if self._computation is not None:
                raise InputError("The crosslinks are in a System already: give the Context in which they shall change.")
            self._initial = table
            return
        parameter = self._computation_in(context).parameter
        TABLES.hold(context, table)
        # OpenMM drops forces that it may have kept.
        context.setParameter(parameter, float(table.identity))

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


def _parameters_of(force):
    if not isinstance(force, openmm.PythonForce):
        return []
    return [name for name in dict(force.getGlobalParameters()) if name.startswith(_PARAMETER)]


def _as_pairs(pairs: npt.ArrayLike) -> IntArray:
    try:
        array = np.asarray(pairs)
    except ValueError:
        array = np.asarray(None)
    if array.size == 0 and array.dtype.kind != "O":
        return np.zeros((0, 2), dtype=np.int64)
    if array.ndim != 2 or array.shape[1] != 2:
        raise InputError(f"pairs must have the shape (n, 2), but are {pairs!r}.")
    return np.array([[whole_number(one, 0, "particle") for one in pair] for pair in array.tolist()], dtype=np.int64)


def _check_pairs(pairs, numbers, particles):
    for number, (first, second) in zip(numbers, pairs):
        if first == second:
            raise InputError(f"Crosslink {number} joins particle {first} to itself.")
        if particles is not None and max(first, second) >= particles:
            raise InputError(
                f"Crosslink {number}: particle {max(first, second)} does not exist; the System has {particles}."
            )
