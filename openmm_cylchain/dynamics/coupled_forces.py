"""Which forces of a System implicit schemes have in their equations, and what keeps others out.

Native links, contacts, walls and linkers are in them if all of their places are: particles that move by themselves,
nodes, places on segments, and what does not move. A place that moves in any other way, such as a virtual site between
particles that are not the ends of a segment, makes its force explicit: all of it.
"""

from functools import cached_property

import numpy as np
import numpy.typing as npt
import openmm

from ..couplings.capsule_contacts import as_capsule_contact_force
from ..couplings.native_links import is_link_force, table_of_force
from ..filaments.collection import FilamentCollection
from ..units.types import Indices, IntArray

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

    def may_include(self, force: openmm.Force) -> bool:
        """Whether a force is one of links or contacts that implicit schemes have in their equations if they can."""
        return is_link_force(force) or as_capsule_contact_force(force) is not None

    def includes(self, force: openmm.Force) -> bool:
        """Whether a force of links or contacts is in the equations of implicit schemes."""
        return self.may_include(force) and self.place_outside(force) is None

    def place_outside(self, force: openmm.Force) -> str | None:
        """What makes a force of links or contacts explicit, in words; None if nothing does."""
        contacts = as_capsule_contact_force(force)
        if contacts is None:
            places = table_of_force(force).places
            return self._outside(*self._on_segments(places, 0)) or self._outside(*self._on_segments(places, 1))
        first, second = [], []
        for chain in range(contacts.getNumChains()):
            particles = np.array(contacts.getChainParticles(chain), dtype=int)
            last = len(particles) - (0 if contacts.isChainClosed(chain) else 1)
            first.append(particles[:last])
            second.append(np.roll(particles, -1)[:last])
        first.append(np.array([contacts.getSphereParticle(i) for i in range(contacts.getNumSpheres())], dtype=int))
        second.append(np.full(len(first[-1]), _NOWHERE))
        return self._outside(np.concatenate(first), np.concatenate(second))

    def particle_outside(self, particles: Indices) -> str | None:
        """The first of some particles at walls, or with anchors of linkers, that makes their force explicit."""
        first = np.asarray(particles, dtype=int)
        return self._outside(first, np.full(len(first), _NOWHERE))

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
        result = np.zeros(self._system.getNumParticles(), dtype=bool)
        for particle, one in zip(self._filaments.attachment_indices, self._filaments.attachments):
            result[particle] = self._filaments[one.filament].type.has_beam_elements
        return result

    @cached_property
    def _is_of_beam(self):
        result = np.zeros(self._system.getNumParticles(), dtype=bool)
        for filament, nodes in zip(self._filaments, self._filaments.node_indices):
            result[nodes] = filament.type.has_beam_elements
        return result

    @cached_property
    def _is_control_point(self):
        result = np.zeros(self._system.getNumParticles(), dtype=bool)
        for particles in self._filaments.control_point_indices:
            result[particles] = True
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

    def _outside(self, first: IntArray, second: npt.NDArray[np.int64]) -> str | None:
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
        nodes = self._filaments.node_indices
        is_node = any(particle in own for own in (*nodes, *self._filaments.control_point_indices))
        massless = self._system.getParticleMass(particle)._value == 0.0
        return massless and not is_node and not self._is_virtual[particle]
