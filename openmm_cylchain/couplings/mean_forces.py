"""Forces of walls and of contacts in a Context: their means over steps."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import openmm
from openmm import unit

from ..errors import InputError
from ..filaments.collection import FilamentCollection, require_filaments
from ..units.quantities import require_kind
from ..units.types import IntArray
from .capsule_contacts import as_capsule_contact_force, owners_of_chains
from .walls import as_filament_wall_force, shape_of_wall

_FORCE = unit.kilojoule_per_mole / unit.nanometer


@dataclass(frozen=True)
class WallForces:
    """Forces of a wall.

    Attributes
    ----------
    force : int
        The number of the wall's Force in the System.
    duration : time
        Of the steps over which forces are means; 0 for those at the present positions.
    forces : (particles, 3) force
        On each particle of the System, those that the wall does not touch among them.
    loads : (n,) force
        The sum of the sizes of the forces of each face: over its area, it is the pressure. A ``Slab`` has two faces, of
        which the first is the one that its normal points at, a ``Box`` six (lower x, upper x, lower y, ...), other
        shapes have one. What holds filaments on a surface has the sum of its forces inwards, less those outwards.
    sums : (n, 3) force
        The sum of the forces of each face on what it keeps in.
    """

    force: int
    duration: Any
    forces: Any
    loads: Any
    sums: Any

    def on_filaments(self, filaments: FilamentCollection) -> Any:
        """The sum of the forces on each filament: an array (filaments, 3) with units."""
        return _on_filaments(self.forces, filaments)


@dataclass(frozen=True)
class ContactForces:
    """Forces of the contacts of a ``capsule_contact_force``.

    Attributes
    ----------
    force : int
        The number of the Force in the System.
    contacts : CylinderChainContactForce
    duration : time
        Of the steps over which forces are means; 0 for those at the present positions.
    forces : (particles, 3) force
        On each particle of the System, those that nothing touches among them.
    pairs : (pairs, 2) array of int
        The filaments that have touched each other, as places in ``numbers`` of ``capsule_contact_force``. Particles
        outside filaments have numbers behind those, in the order of its ``particles``. A filament that touches itself
        makes a pair with itself.
    loads : (pairs,) force
        The sum of the sizes of the forces of a pair.
    sums : (pairs, 3) force
        The sum of the forces on the first of a pair; those on the second are opposite.
    """

    force: int
    contacts: Any
    duration: Any
    forces: Any
    pairs: IntArray
    loads: Any
    sums: Any

    def on_filaments(self, filaments: FilamentCollection) -> Any:
        """The sum of the forces on each filament: an array (filaments, 3) with units."""
        return _on_filaments(self.forces, filaments)

    def loads_of_filaments(self, filaments: FilamentCollection) -> Any:
        """The sum of the sizes of all forces on each filament: an array (filaments,) with units."""
        require_filaments(filaments)
        _refuse_others(self.forces, filaments)
        # Behind filaments stands what is none.
        loads, owners = np.zeros(len(filaments) + 1), owners_of_chains(self.contacts, filaments)
        numbers = np.append(owners, -1)[np.minimum(self.pairs, len(owners))]
        np.add.at(loads, numbers[:, 0], self.loads._value)
        other = self.pairs[:, 0] != self.pairs[:, 1]
        np.add.at(loads, numbers[other, 1], self.loads._value[other])
        return unit.Quantity(loads[:-1], _FORCE)


class ForceReaders:
    """Somebody who asks a Context for mean forces, from now on, again and again, whoever else may ask, too."""

    def __init__(self, context: openmm.Context) -> None:
        self._context = context
        self._readers = {}
        for number, force in enumerate(context.getSystem().getForces()):
            own = as_filament_wall_force(force) or as_capsule_contact_force(force)
            if own is not None:
                self._readers[number] = own.addForceReader(context)

    def wall_forces(self) -> list[WallForces]:
        """What ``wall_forces`` says, since this was called last."""
        return _wall_forces(self._context, self._readers)

    def contact_forces(self) -> list[ContactForces]:
        """What ``contact_forces`` says, since this was called last."""
        return _contact_forces(self._context, self._readers)


def wall_forces(context: openmm.Context) -> list[WallForces]:
    """The mean forces of the walls of a Context since this was asked last, or since the Context was made.

    Of walls of ``filament_wall_force``, all steps of the compiled engine count. A
    step of scheme "implicit" knows the mean within itself; in explicit schemes, the force is that at its start. In each
    case it is what has moved the filaments: in equilibrium, it balances what presses on them. Checkpoints hold the
    sums, so that a run which goes on from one has the same means as one that was not interrupted; States do not.

    What two soft walls or contacts squeeze between them all the time has forces of both that are up to a quarter too
    large at the recommended step, and right in short ones alone: the difference of both is right, and so are overlaps.

    Where nothing is summed up, forces are those at the present positions, with a duration of 0: of walls of
    ``wall_force``, in other Integrators, and as long as no step was taken.

    Parameters
    ----------
    context : openmm.Context

    Returns
    -------
    list of WallForces
        One for each wall, in the order of Forces in the System.

    Examples
    --------
    >>> simulation.step(10000)  # doctest: +SKIP
    >>> (upper, lower) = wall_forces(simulation.context)[0].loads  # doctest: +SKIP
    """
    return _wall_forces(context, {})


def contact_forces(context: openmm.Context) -> list[ContactForces]:
    """The mean forces of contacts of a Context since this was asked last, or since the Context was made.

    As ``wall_forces`` has those of walls, with the same meaning of steps. Those of ``contact_force`` between beads, and
    other forces of OpenMM, are not among them: ``getState(getForces=True, groups=...)`` has these. Until it is asked
    for the first time, the sums begin again whenever 100 000 pairs have touched: durations say what means are over.

    Parameters
    ----------
    context : openmm.Context

    Returns
    -------
    list of ContactForces
        One for each ``capsule_contact_force``, in the order of Forces in the System.

    Examples
    --------
    >>> simulation.step(10000)  # doctest: +SKIP
    >>> found = contact_forces(simulation.context)[0]  # doctest: +SKIP
    >>> found.pairs[np.argmax(found.loads)]  # doctest: +SKIP
    """
    return _contact_forces(context, {})


def _wall_forces(context: openmm.Context, readers: Mapping[int, int]) -> list[WallForces]:
    require_kind(context, openmm.Context, "context")
    found = []
    for number, force in enumerate(context.getSystem().getForces()):
        own = as_filament_wall_force(force)
        if own is not None:
            found.append(_of_native_wall(context, number, own, readers.get(number, 0)))
            continue
        wall = shape_of_wall(force)
        if wall is not None:
            found.append(_of_present_positions(context, number, force, *wall))
    return found


def _of_native_wall(context, number, force, reader):
    duration, forces, places, sums, loads = _taken(force, context, reader)
    faces = {"slab": 2, "box": 6}.get(force.getRegion()[0], 1)
    load, total = np.zeros(faces), np.zeros((faces, 3))
    load[places[:, 0]], total[places[:, 0]] = loads, sums
    return WallForces(
        number, duration, unit.Quantity(forces, _FORCE), *(unit.Quantity(v, _FORCE) for v in (load, total))
    )


def _of_present_positions(context, number, force, shape, stiffness):
    positions = context.getState(positions=True).getPositions(asNumpy=True)._value
    particles = np.array([force.getParticleParameters(i)[0] for i in range(force.getNumParticles())], dtype=int)
    forces, loads, sums = np.zeros(positions.shape), [], []
    for face in shape.faces:
        depths, gradients = face.depths(positions[particles])
        pushes = -stiffness * np.maximum(0.0, depths)[:, None] * gradients
        np.add.at(forces, particles, pushes)
        loads.append(np.linalg.norm(pushes, axis=1).sum())
        sums.append(pushes.sum(axis=0))
    values = (unit.Quantity(np.array(value), _FORCE) for value in (forces, loads, sums))
    return WallForces(number, 0.0 * unit.picosecond, *values)


def _contact_forces(context: openmm.Context, readers: Mapping[int, int]) -> list[ContactForces]:
    require_kind(context, openmm.Context, "context")
    found = []
    for number, force in enumerate(context.getSystem().getForces()):
        own = as_capsule_contact_force(force)
        if own is None:
            continue
        duration, forces, pairs, sums, loads = _taken(own, context, readers.get(number, 0))
        quantities = (unit.Quantity(value, _FORCE) for value in (loads, sums))
        found.append(ContactForces(number, own, duration, unit.Quantity(forces, _FORCE), pairs, *quantities))
    return found


def _taken(force, context, reader):
    duration, forces, numbers, sums, loads = force.takeMeanForces(context, reader)
    return (
        duration,
        np.array(forces._value).reshape(-1, 3),
        np.array(numbers, dtype=int).reshape(-1, 2),
        np.array(sums._value).reshape(-1, 3),
        np.array(loads._value),
    )


def _refuse_others(forces, filaments):
    own = [*filaments.node_indices, *filaments.control_point_indices, filaments.attachment_indices]
    if max(one.max(initial=-1) for one in own) >= len(forces):
        raise InputError(f"filaments must be those in the System of the forces, which has {len(forces)} particles.")


def _on_filaments(forces, filaments):
    require_filaments(filaments)
    _refuse_others(forces, filaments)
    values = forces._value
    sums = np.zeros((len(filaments), 3))
    for number, particles in enumerate(zip(filaments.node_indices, filaments.control_point_indices)):
        sums[number] = values[np.concatenate(particles)].sum(axis=0)
    # Beads are among the attachment points.
    for attachment, particle in zip(filaments.attachments, filaments.attachment_indices):
        sums[attachment.filament] += values[particle]
    return unit.Quantity(sums, _FORCE)
