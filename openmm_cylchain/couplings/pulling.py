"""Pulling: constant forces, constant tension, and tethers that move at constant velocity."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import openmm

from ..errors import InputError
from ..filaments.collection import FilamentCollection, require_filaments
from ..filaments.refusals import growth_refusal
from ..output.files import TextFile
from ..output.reporters import FilamentsReporter
from ..units.quantities import (
    FORCE,
    LENGTH,
    TIME,
    VELOCITY,
    in_units_of,
    shown,
    unit_vector,
    whole_number,
    whole_numbers,
)
from ..units.types import FloatArray, Indices, Numbers, Scalar, Vector, Vectors

if TYPE_CHECKING:
    from openmm import app

CONSTANT_FORCE_NAME = "ConstantForce"

_COMPONENTS = ("force_x", "force_y", "force_z")
_ENERGY = "-(force_x*x+force_y*y+force_z*z)"


def constant_force(particles: Indices, forces: Vectors) -> openmm.CustomExternalForce:
    """A CustomExternalForce that pulls particles with constant forces: energy -F.x of each.

    The energy is that of the position that OpenMM holds. In a periodic box it jumps by F.a whenever a particle is
    wrapped by a box vector a, which GPU platforms do as they please; the force does not.

    Parameters
    ----------
    particles : sequence of int
        Particle indices, of nodes, attachment points or anything else.
    forces : (3,) or (particles, 3) force
        One for all of them, or one for each.

    Returns
    -------
    openmm.CustomExternalForce
        To be added to the System. ``change_constant_force`` changes it while a simulation runs.

    Raises
    ------
    InputError
        For forces of the wrong shape or unit, or particle indices that are none.
    """
    particles = whole_numbers(particles, 0, "particles")
    force = openmm.CustomExternalForce(_ENERGY)
    force.setName(CONSTANT_FORCE_NAME)
    for name in _COMPONENTS:
        force.addPerParticleParameter(name)
    for particle, components in zip(particles, _as_forces(forces, len(particles))):
        force.addParticle(particle, components)
    return force


def change_constant_force(force: openmm.CustomExternalForce, context: openmm.Context, forces: Vectors) -> None:
    """Change the forces of a ``constant_force`` or ``constant_tension`` in a Context.

    Parameters
    ----------
    force : openmm.CustomExternalForce
        In the System of the Context.
    context : openmm.Context
    forces : (3,) or (particles, 3) force
        In the order in which the force has its particles. Those of ``constant_tension`` are the first and the last node
        of each filament in turn; ``tension_forces`` has their forces.
    """
    _refuse_unless_constant(force)
    if not isinstance(context, openmm.Context) or not _has_force(context.getSystem(), force):
        raise InputError(f"context must be one of the System that has the force, but is {shown(context)}.")
    for index, components in enumerate(_as_forces(forces, force.getNumParticles())):
        particle, _ = force.getParticleParameters(index)
        force.setParticleParameters(index, particle, components)
    force.updateParametersInContext(context)


def is_constant_force(force: openmm.Force) -> bool:
    """Whether a force is one that ``constant_force`` or ``constant_tension`` has made."""
    if not isinstance(force, openmm.CustomExternalForce) or force.getEnergyFunction() != _ENERGY:
        return False
    names = (force.getPerParticleParameterName(i) for i in range(force.getNumPerParticleParameters()))
    return tuple(names) == _COMPONENTS


def _has_force(system, force):
    return any(int(one.this) == int(force.this) for one in system.getForces())


def _refuse_unless_constant(force):
    if not is_constant_force(force):
        raise InputError(f"force must be one that constant_force or constant_tension has made, but is {shown(force)}.")


def _as_forces(forces, count):
    forces = np.asarray(in_units_of(forces, FORCE, "forces"))
    if forces.shape not in ((3,), (count, 3)):
        raise InputError(f"forces must have the shape (3,) or ({count}, 3), but have {forces.shape}.")
    return np.broadcast_to(forces, (count, 3)).tolist()


def constant_tension(
    filaments: FilamentCollection, tension: Numbers, direction: Vector, numbers: Indices | None = None
) -> openmm.CustomExternalForce:
    """A CustomExternalForce that holds filaments under tension: F e on their last nodes and -F e on their first.

    The energy is -F R.e for the end-to-end vector R, which is right in a periodic box as long as no node is wrapped on
    its own; see ``constant_force``.

    Parameters
    ----------
    filaments : Filaments
        In a System.
    tension : force, or array of them
        F, one for all filaments or one for each; negative to compress.
    direction : (3,) array
        Of e; need not be normalised.
    numbers : sequence of int, optional
        Of the filaments; all of them if not given.

    Returns
    -------
    openmm.CustomExternalForce
        To be added to the System.

    Raises
    ------
    InputError
        For a filament that does not exist or grows, or a tension or direction that is none.
    """
    require_filaments(filaments)
    every = range(len(filaments))
    numbers = every if numbers is None else whole_numbers(numbers, 0, "numbers")
    for number in numbers:
        if number not in every:
            raise InputError(f"Filament {number} does not exist; there are {len(filaments)}.")
        if filaments[number].growth is not None:
            label = f"Filament {number} ({filaments[number].type.name})"
            raise InputError(growth_refusal(label, "a constant tension"))
    ends = [int(node) for number in numbers for node in filaments.node_indices[number][[0, -1]]]
    return constant_force(ends, tension_forces(len(numbers), tension, direction))


def tension_forces(count: int, tension: Numbers, direction: Vector) -> FloatArray:
    """Forces (2 count, 3), in kJ/(mol nm), on the first and the last node of each of ``count`` filaments in turn."""
    tension = np.asarray(in_units_of(tension, FORCE, "tension"))
    if tension.shape not in ((), (count,)):
        raise InputError(f"tension must be a number or have the shape ({count},), but has {tension.shape}.")
    pulls = np.broadcast_to(tension, (count,))[:, None] * unit_vector(direction, "Tension")
    return np.stack([-pulls, pulls], axis=1).reshape(-1, 3)


class ConstantVelocityPulling(FilamentsReporter):
    """Moves the points of tethers at constant velocity and reports force, extension and work; for simulation.reporters.

    A point is at ``start + velocity (t - start_time)`` at every report, and stays there until the next, so the motion
    is one of many small steps. It follows from the time of the Context alone: a run that goes on from a checkpoint has
    its tethers where they were, to the bit if the checkpoint was made at a report.

    Columns, for each tether: ``point_x``, ``point_y``, ``point_z`` since the last report, in nm; ``force`` of the
    tether along the velocity, k (point - x).e, in kJ/(mol nm); ``extension`` R.e and ``end_to_end_distance`` |R| in nm,
    of the end-to-end vector R of its filament, which points to the end that the tethered node is nearer to; ``work``,
    by which the motion of the point at this report changes the energy of the tether, in kJ/mol. The sum of ``work`` is
    the work done on the System. Its exponential average over runs that begin in equilibrium is exact at any velocity
    and interval (Jarzynski, Phys. Rev. Lett. 1997, 78, 2690).

    Parameters
    ----------
    file : str, Path, file object or None
        None keeps the arrays alone.
    reportInterval : int
        Steps from one motion and report to the next. Between two, the force rises by k velocity interval step.
    filaments : Filaments
    tethers : int or sequence of int
        Their numbers.
    velocity : (3,) or (tethers, 3) length/time
    start : (3,) or (tethers, 3) length, optional
        Where the points are until ``start_time``; where the tethers were added if not given.
    start_time : time
        In the time of the Context.
    append : bool
        Go on with a file that exists.

    Raises
    ------
    InputError
        For a tether that does not exist or is named twice, a velocity that is zero, or values of the wrong shape or
        unit.

    Examples
    --------
    >>> velocity = [0.1, 0, 0] * unit.micrometer / unit.second  # doctest: +SKIP
    >>> pulling = ConstantVelocityPulling("pulling.csv", 100, filaments, 0, velocity)  # doctest: +SKIP
    >>> simulation.reporters.append(pulling)  # doctest: +SKIP
    """

    _columns = ("point_x", "point_y", "point_z", "force", "extension", "end_to_end_distance", "work")
    _thing = "tether"

    def __init__(
        self,
        file: TextFile | None,
        reportInterval: int,  # noqa: N803 - OpenMM's name
        filaments: FilamentCollection,
        tethers: int | Indices,
        velocity: Vectors,
        start: Vectors | None = None,
        start_time: Scalar = 0.0,
        append: bool = False,
    ) -> None:
        require_filaments(filaments)
        self._tethers = _tether_numbers(tethers, len(filaments.tethers))
        named = [filaments.tethers[number] for number in self._tethers]
        count = len(named)
        self._velocity = _vectors(velocity, VELOCITY, count, "velocity")
        self._directions = np.array([unit_vector(one, "velocity of a tether") for one in self._velocity])
        start = [tether.point for tether in named] if start is None else start
        self._start = _vectors(start, LENGTH, count, "start")
        self._start_time = in_units_of(start_time, TIME, "start_time")
        if not isinstance(self._start_time, float):
            raise InputError("start_time must be a single number.")
        self._stiffness = np.array([tether.stiffness for tether in named])
        super().__init__(file, reportInterval, filaments, append)
        self._pulled, self._far, self._near = np.transpose([self._ends(tether) for tether in named])

    def _ends(self, tether):
        nodes = self._nodes[tether.filament]
        ends = (nodes[0], nodes[-1]) if 2 * tether.node >= len(nodes) - 1 else (nodes[-1], nodes[0])
        return nodes[tether.node], *ends

    def describeNextReport(self, simulation: app.Simulation) -> dict[str, Any]:  # noqa: N802 - OpenMM's name
        """When the next report is due; puts the points where they belong if a run begins or goes on."""
        since = simulation.currentStep % self._interval * simulation.integrator.getStepSize()
        self._move(simulation.context, self._points_at((simulation.context.getTime() - since)._value))
        return super().describeNextReport(simulation)

    def _points_at(self, time):
        return self._start + self._velocity * max(0.0, time - self._start_time)

    def _points(self, context):
        tethers = self._filaments.in_context(context).tethers()
        return np.array([tethers[number].point for number in self._tethers])

    def _move(self, context, points):
        if not np.array_equal(points, self._points(context)):
            self._filaments.in_context(context).move_tethers(self._tethers, points)

    def _table(self, simulation, state):
        positions = state.getPositions(asNumpy=True)._value
        before, after = self._points(simulation.context), self._points_at(state.getTime()._value)
        pulled = positions[self._pulled]
        vectors = positions[self._near] - positions[self._far]
        energies = [0.5 * self._stiffness * np.sum((pulled - points) ** 2, axis=1) for points in (before, after)]
        columns = (
            *before.T,
            self._stiffness * np.sum((before - pulled) * self._directions, axis=1),
            np.sum(vectors * self._directions, axis=1),
            np.linalg.norm(vectors, axis=1),
            energies[1] - energies[0],
        )
        self._move(simulation.context, after)
        return self._tethers, list(zip(*columns))


def _tether_numbers(tethers, count):
    numbers = [whole_number(number, 0, "tether") for number in np.atleast_1d(np.asarray(tethers, dtype=object))]
    for number in numbers:
        if number >= count:
            raise InputError(f"Tether {number} does not exist; there are {count}.")
    if not numbers or len(set(numbers)) < len(numbers):
        raise InputError(f"tethers must be different and at least one, but are {numbers}.")
    return numbers


def _vectors(value, target, count, name):
    array = np.asarray(in_units_of(value, target, name))
    if array.shape not in ((3,), (count, 3)):
        raise InputError(f"{name} must have the shape (3,) or ({count}, 3), but has {array.shape}.")
    return np.array(np.broadcast_to(array, (count, 3)))
