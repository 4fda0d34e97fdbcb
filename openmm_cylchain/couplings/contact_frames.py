"""The contacts of capsules at given positions: which segments overlap, where, and with which forces."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np
import openmm

from ..engine_choice import choose_engine
from ..errors import InputError
from ..output.run_description import DescribedContacts
from ..units.quantities import require_kind
from ..units.types import FloatArray, IntArray
from .capsule_contacts import as_capsule_contact_force


@dataclass(frozen=True)
class ContactFrame:
    """The contacts of a frame: every place where two segments, two spheres, or a segment and a sphere, overlap.

    Attributes
    ----------
    filaments : (n, 2) int array
        Whose segments touch; -1 for a sphere. Of ``find_contacts``, chains of the force.
    segments : (n, 2) int array
        Their numbers in the filaments, or that of a sphere.
    fractions : (n, 2) array
        Where along its segment each side touches, from 0 to 1; 0 for a sphere.
    gaps : (n,) array
        Distance of the axes less the mean of the diameters, in nm: negative.
    forces : (n,) array
        With which the two repel each other, in kJ/(mol nm).
    directions : (n, 3) array
        Unit vectors from the second side to the first, along which the force on the first acts.
    distances : (n,) array
        Of the axes, in nm.
    """

    filaments: IntArray
    segments: IntArray
    fractions: FloatArray
    gaps: FloatArray
    forces: FloatArray
    directions: FloatArray
    distances: FloatArray

    def __len__(self) -> int:
        return len(self.gaps)


def find_contacts(force: openmm.Force, context: openmm.Context) -> ContactFrame:
    """The contacts of a ``capsule_contact_force`` at the present positions of a Context.

    Each has the energy ``(w k/2) g^2`` of its gap g, with the stiffness k of the force and a weight w of 1, or 1/2 at
    both ends of the overlap of segments that are nearly parallel, so that forces are ``-w k g``.

    Parameters
    ----------
    force : openmm.Force
        Of ``capsule_contact_force``, in the System of the Context.
    context : openmm.Context

    Returns
    -------
    ContactFrame

    Raises
    ------
    InputError
        If the force is another one, or none of the Context's.
    """
    own = as_capsule_contact_force(force) if isinstance(force, openmm.Force) else None
    if own is None:
        raise InputError(f"force must be one of capsule_contact_force, but is {type(force).__name__}.")
    require_kind(context, openmm.Context, "context")
    try:
        ends, fractions, gaps, forces, directions = own.getContacts(context)
    except openmm.OpenMMException as error:
        raise InputError(f"Contacts are not to be found: {error}") from None
    sides = np.array(ends, dtype=int).reshape(-1, 2, 2)
    spheres = sides[:, :, 0] < 0
    radii = np.empty(spheres.shape)
    chains = np.array([0.5 * own.getChainDiameter(chain)._value for chain in range(own.getNumChains())])
    balls = np.array([0.5 * own.getSphereDiameter(sphere)._value for sphere in range(own.getNumSpheres())])
    radii[~spheres] = chains[sides[~spheres][:, 0]]
    if spheres.any():
        radii[spheres] = balls[sides[spheres][:, 1]]
    gaps = np.array(gaps._value, dtype=float)
    return ContactFrame(
        filaments=sides[:, :, 0],
        segments=sides[:, :, 1],
        fractions=np.array(fractions, dtype=float).reshape(-1, 2),
        gaps=gaps,
        forces=np.array(forces._value, dtype=float),
        directions=np.array([tuple(one) for one in directions], dtype=float).reshape(-1, 3),
        distances=gaps + radii.sum(axis=1),
    )


class DescribedContactFinder:
    """Finds the contacts of a run from what is written of it.

    Parameters
    ----------
    filaments : dict
        By the particles at which the segments of their capsules end, the number of each filament, and of how many
        capsules a segment is made: one, or several of a beam element.
    particles : int
        Of the System.
    box : (3, 3) array in nm, or None
    """

    def __init__(
        self,
        contacts: DescribedContacts,
        filaments: Mapping[tuple[int, ...], tuple[int, int]],
        particles: int,
        box: FloatArray | None,
    ) -> None:
        choose_engine("compiled")
        from .. import plugin

        # Filaments that are not there now have no nodes. Behind the last chain stands what spheres have.
        there = {number: chain for number, chain in enumerate(contacts.chains) if chain[0]}
        owners = [*(filaments.get(nodes, (-1, 1)) for nodes, *_ in there.values()), (-1, 1)]
        self._filaments, self._pieces = np.array(owners).T
        self._force: Any = plugin.CylinderChainContactForce(contacts.stiffness)
        for nodes, diameter, neighbors, ring in there.values():
            self._force.addChain(list(nodes), diameter, neighbors, ring)
        for particle, diameter in contacts.spheres:
            self._force.addSphere(particle, diameter)
        index = {-1: -1, **{number: own for own, number in enumerate(there)}}
        for chain, segment, other, other_segment in contacts.exclusions:
            if chain in index and other in index:
                self._force.addExclusion(index[chain], segment, index[other], other_segment)
        self._force.setUsesPeriodicBoundaryConditions(contacts.periodic)
        system = openmm.System()
        for _ in range(particles):
            system.addParticle(1.0)
        if box is not None:
            system.setDefaultPeriodicBoxVectors(*np.asarray(box).tolist())
        system.addForce(self._force)
        # The Context refers to the System, and the Force is the System's.
        self._system = system
        self._context = openmm.Context(
            system, openmm.VerletIntegrator(0.001), openmm.Platform.getPlatformByName("Reference")
        )

    def find(self, positions: FloatArray) -> ContactFrame:
        """The contacts at positions (particles, 3) in nm."""
        self._context.setPositions(positions)
        found = find_contacts(self._force, self._context)
        pieces = self._pieces[found.filaments]
        return replace(
            found,
            filaments=self._filaments[found.filaments],
            segments=found.segments // pieces,
            fractions=(found.segments % pieces + found.fractions) / pieces,
        )


def joined_contacts(frames: list[ContactFrame]) -> ContactFrame:
    """The contacts of several forces as those of one."""
    shapes = {"filaments": (0, 2), "segments": (0, 2), "fractions": (0, 2), "directions": (0, 3)}
    columns = {}
    for column in fields(ContactFrame):
        kind = int if column.name in ("filaments", "segments") else float
        none = np.zeros(shapes.get(column.name, (0,)), dtype=kind)
        columns[column.name] = np.concatenate([none, *(getattr(frame, column.name) for frame in frames)])
    return ContactFrame(**columns)
