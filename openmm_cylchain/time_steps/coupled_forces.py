"""Which forces of a System implicit schemes have in their equations, and what keeps others out.

Native links, contacts, walls and linkers are in them if all of their places are: particles that move by themselves,
nodes, places on segments, and what does not move. A place that moves in any other way, such as a virtual site between
particles that are not the ends of a segment, makes its force explicit: all of it.
"""

from functools import cached_property

import numpy as np
import openmm

from ..couplings.capsule_contacts import as_capsule_contact_force
from ..couplings.native_links import is_link_force, table_of_force
from ..couplings.walls import as_filament_wall_force
from ..errors import InputError
from ..filaments.collection import FilamentCollection
from ..kinetics.binding_force import find_binding_force, is_binding_force

_NOWHERE = -1
_SAME_WEIGHT = 1e-12


class CoupledForces:
    """The forces of a System with filaments that implicit schemes of the compiled engine may have in their equations.

    Parameters
    ----------
    system : openmm.System
    filaments : Filaments
        In the System.
    """

    def __init__(self, system: openmm.System, filaments: FilamentCollection) -> None:
        self._system = system
        self._filaments = filaments
        self._known: dict[int, str | None] = {}

    def may_include(self, index: int) -> bool:
        """Whether a force, by its index, is one of links, contacts, walls or linkers: in the equations if it can be."""
        force = self._system.getForce(index)
        return is_link_force(force) or is_binding_force(force) or _is_contact_or_wall(force)

    def includes(self, index: int) -> bool:
        """Whether a force, by its index, is in the equations of implicit schemes."""
        return self.may_include(index) and self.place_outside(index) is None

    def refuse_in_two_stages(self, scheme: str) -> None:
        """Raise InputError if scheme "implicit-second-order" has contacts or walls in its equations.

        In its two stages, they would not keep their equilibrium.
        """
        if scheme != "implicit-second-order":
            return
        for index, force in enumerate(self._system.getForces()):
            if _is_contact_or_wall(force) and self.includes(index):
                raise InputError(
                    f'{force.getName()} (force {index}): contacts and walls need scheme="implicit": in the two stages '
                    f"of {scheme!r} they would not keep their equilibrium."
                )

    def place_outside(self, index: int) -> str | None:
        """What makes a force that may be included explicit, in words; None if nothing does."""
        if index not in self._known:
            self._known[index] = self._find_outside(self._system.getForce(index))
        return self._known[index]

    def _find_outside(self, force):
        if is_link_force(force):
            places = table_of_force(force).places
            return self._outside(*self._on_segments(places, 0)) or self._outside(*self._on_segments(places, 1))
        contacts, wall = as_capsule_contact_force(force), as_filament_wall_force(force)
        if contacts is not None:
            return self._outside(*_capsules(contacts))
        if wall is not None:
            particles = [wall.getParticle(particle) for particle in range(wall.getNumParticles())]
        else:
            linkers = find_binding_force(self._system)
            particles = [linkers.getAnchor(anchor)[0] for anchor in range(linkers.getNumAnchors())]
        return self._outside(*_alone(particles))

    @cached_property
    def _is_virtual(self):
        return np.array([self._system.isVirtualSite(index) for index in range(self._system.getNumParticles())], bool)

    @cached_property
    def _behind(self):
        # The node behind each node on its filament.
        behind = np.full(self._system.getNumParticles(), _NOWHERE)
        for filament, nodes in zip(self._filaments, self._filaments.node_indices):
            behind[nodes[:-1]] = nodes[1:]
            if filament.closed:
                behind[nodes[-1]] = nodes[0]
        return behind

    @cached_property
    def _is_on_curve(self):
        attachments = zip(self._filaments.attachment_indices, self._filaments.attachments)
        return self._flags(particle for particle, one in attachments if self._has_beams(one.filament))

    @cached_property
    def _is_of_beam(self):
        nodes = enumerate(self._filaments.node_indices)
        return self._flags(particle for number, own in nodes if self._has_beams(number) for particle in own)

    @cached_property
    def _is_control_point(self):
        return self._flags(particle for own in self._filaments.control_point_indices for particle in own)

    @cached_property
    def _is_node(self):
        return self._flags(particle for own in self._filaments.node_indices for particle in own)

    def _has_beams(self, filament):
        return len(self._filaments.control_point_indices[filament]) > 0

    def _flags(self, particles):
        result = np.zeros(self._system.getNumParticles(), dtype=bool)
        result[np.fromiter(particles, dtype=int)] = True
        return result

    def _on_segments(self, places, side):
        # Virtual sites between the ends of a segment are places on it.
        first, second = places.pairs[:, side].copy(), places.partners[:, side].copy()
        alone = (first >= 0) & (second < 0)
        for row in np.flatnonzero(alone & self._is_virtual[first]):
            between = self._ends_of_site(int(first[row]))
            if between is not None:
                first[row], second[row] = between
        return first, second

    def _ends_of_site(self, particle):
        site = self._system.getVirtualSite(particle)
        if not isinstance(site, openmm.TwoParticleAverageSite):
            return None
        ends = site.getParticle(0), site.getParticle(1)
        weights = site.getWeight(0), site.getWeight(1)
        between = abs(sum(weights) - 1.0) < _SAME_WEIGHT and 0.0 <= weights[1] <= 1.0
        return ends if between and not np.any(self._is_of_beam[list(ends)]) else None

    def _outside(self, first, second):
        # Of particles (first), places between two, and points (-1).
        particle, between = (first >= 0) & (second < 0), second >= 0
        on_curve = self._is_on_curve[first] & (~between | self._is_on_curve[second])
        odd = particle & ~on_curve & (self._is_virtual[first] | self._is_control_point[first])
        if np.any(odd):
            index = int(first[np.argmax(odd)])
            return f"{'control point' if self._is_control_point[index] else 'virtual site'} {index}"
        on_segment = (self._behind[first] == second) | (self._behind[second] == first)
        for row in np.flatnonzero(between & ~on_curve & ~on_segment):
            ends = int(first[row]), int(second[row])
            if not all(self._is_fixed(end) for end in ends):
                return f"the place between particles {ends[0]} and {ends[1]}"
        return None

    def _is_fixed(self, particle):
        moves = self._is_node[particle] or self._is_control_point[particle] or self._is_virtual[particle]
        return not moves and self._system.getParticleMass(particle)._value == 0.0


def _is_contact_or_wall(force):
    return as_capsule_contact_force(force) is not None or as_filament_wall_force(force) is not None


def _alone(particles):
    first = np.array(particles, dtype=int)
    return first, np.full(len(first), _NOWHERE)


def _capsules(contacts):
    # Segments between two particles, and spheres.
    columns = [_alone([contacts.getSphereParticle(sphere) for sphere in range(contacts.getNumSpheres())])]
    for chain in range(contacts.getNumChains()):
        particles = np.array(contacts.getChainParticles(chain), dtype=int)
        last = len(particles) - (0 if contacts.isChainClosed(chain) else 1)
        columns.append((particles[:last], np.roll(particles, -1)[:last]))
    first, second = zip(*columns)
    return np.concatenate(first), np.concatenate(second)
