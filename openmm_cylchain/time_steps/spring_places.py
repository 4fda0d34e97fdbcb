"""Where springs act: on nodes of filaments, places on their segments, or particles with a friction of their own."""

from collections.abc import Sequence
from functools import cached_property
from typing import Any

import numpy as np
import openmm
import scipy

from ..filaments.collection import FilamentCollection
from ..units.types import BoolArray, FloatArray, IntArray, Numbers
from .beam_response import BeamResponse
from .mobility import FilamentResponse, PlaceResponse
from .other_particles import describe_beside_filaments
from .springs import NOWHERE, Springs


class SpringPlaces:
    """The places at which the springs of a System with filaments act, and how far these move in a step.

    A *site* is a particle on which springs act, or a place between two. It is one place or a mean of several.

    Parameters
    ----------
    filaments : Filaments
        In the System.
    scheme : {"implicit", "implicit-second-order", "midpoint", "euler"}
    particle_friction : energy*time/length^2, or array of them, or None
        As for ``Filaments.create_integrator``.
    between : dict of (int, int, float) to int
        The numbers of places between two particles, behind those of all particles: see ``SpringReader``.

    Attributes
    ----------
    site_of : (n,) int array
        The site of each particle and of each place between two; -2 of those that are none, or of which it is not known
        how far they move. The last entry, which ``NOWHERE`` finds, is ``NOWHERE``.
    unknown : list of str
        Names of those of which it is not known.
    """

    def __init__(
        self,
        system: openmm.System,
        filaments: FilamentCollection,
        scheme: str,
        particle_friction: Numbers | None,
        springs: Sequence[Springs],
        between: dict[tuple[int, int, float], int],
    ) -> None:
        self._system = system
        self._filaments = filaments
        self._scheme = scheme
        self._between = {number: place for place, number in between.items()}
        others, frictions = describe_beside_filaments(system, filaments, particle_friction)
        self._other_friction = dict(zip(others.tolist(), frictions.tolist()))
        self._responses: dict[Any, PlaceResponse] = {}
        particles = np.unique(np.concatenate([np.zeros(0, int), *(np.r_[s.first, s.second] for s in springs)]))
        particles = particles[particles != NOWHERE]
        self.site_of: IntArray = np.full(system.getNumParticles() + len(between) + 1, -2)
        self.site_of[NOWHERE] = NOWHERE
        self.unknown: list[str] = []
        places: dict[Any, int] = {}
        rows, columns, weights = [], [], []
        for site, particle in enumerate(particles.tolist()):
            components = self._places_of(particle)
            if components is None:
                what = "control point of beam elements" if particle in self._control_points else "virtual site"
                self.unknown.append(f"{what} {particle}")
                continue
            self.site_of[particle] = site
            for place, weight in components:
                rows.append(site)
                columns.append(places.setdefault(place, len(places)))
                weights.append(weight)
        self._components = scipy.sparse.csr_array((weights, (rows, columns)), shape=(len(particles), len(places)))
        self._sort_places(list(places))

    def responses(self, step: float) -> FloatArray:
        """How far a force moves each site in a step in ps: (sites,) array."""
        responses = np.zeros(self._components.shape[1])
        responses[self._free] = step / self._free_friction
        known = {}
        for (response, piece), indices, segments, fractions, key in self._clusters:
            if key not in known:
                known[key] = response.at(piece, segments, fractions, step)
            responses[indices] = known[key]
        return self._components @ responses

    def largest_eigenvalue(self, stiffness: FloatArray, step: float) -> tuple[float, BoolArray]:
        """lambda of springs to fixed points, with stiffnesses (sites,), in a step in ps, and which sites have part in
        it."""
        demand = self._components.T @ stiffness
        largest, places = 0.0, np.zeros(0, dtype=int)
        if len(self._free):
            values = demand[self._free] * step / self._free_friction
            worst = int(np.argmax(values))
            largest, places = float(values[worst]), self._free[[worst]]
        known: dict[Any, float] = {}
        for (response, piece), indices, segments, fractions, place in self._clusters:
            used = demand[indices] > 0.0
            if not used.any():
                continue
            key = (*place, demand[indices].tobytes())
            if key not in known:
                known[key] = response.largest_eigenvalue(
                    piece, segments[used], fractions[used], demand[indices][used], step
                )
            if known[key] > largest:
                largest, places = known[key], indices[used]
        there = np.zeros(self._components.shape[1])
        there[places] = 1.0
        return largest, self._components @ there > 0.0

    @cached_property
    def _node(self):
        # Filament and node of each particle that is one: in a large System without such forces, nobody asks for it.
        return {
            int(particle): (number, node)
            for number, nodes in enumerate(self._filaments.node_indices)
            for node, particle in enumerate(nodes)
        }

    @cached_property
    def _control_points(self):
        # How far a force on one of them moves it is not known.
        return {int(particle) for own in self._filaments.control_point_indices for particle in own}

    @cached_property
    def _on_curves(self):
        # The place of each attachment point on a beam element.
        return {
            int(particle): (one.filament, one.segment, one.fraction)
            for particle, one in zip(self._filaments.attachment_indices, self._filaments.attachments)
            if not self._filaments[one.filament].type.segment_kind.straight
        }

    def _places_of(self, particle):
        # Weights of places: a friction, or a filament, a segment and a fraction. None where that is not known.
        if particle in self._between:
            first, second, fraction = self._between[particle]
            return self._mean_place([first, second], [1.0 - fraction, fraction])
        if particle in self._control_points:
            return None
        if particle in self._on_curves:
            return [(self._on_curves[particle], 1.0)]
        if particle in self._node:
            number, node = self._node[particle]
            filament = self._filaments[number]
            if filament.closed or node < filament.segments:
                return [((number, node, 0.0), 1.0)]
            return [((number, node - 1, 1.0), 1.0)]
        if not self._system.isVirtualSite(particle):
            friction = self._other_friction.get(particle)
            return [] if friction is None else [((particle, friction), 1.0)]
        site = self._system.getVirtualSite(particle)
        if not isinstance(site, (openmm.TwoParticleAverageSite, openmm.ThreeParticleAverageSite)):
            return None
        parents = [site.getParticle(index) for index in range(site.getNumParticles())]
        weights = [site.getWeight(index) for index in range(site.getNumParticles())]
        return self._mean_place(parents, weights)

    def _mean_place(self, parents, weights):
        on_segment = self._on_segment(parents, weights)
        if on_segment is not None:
            return [(on_segment, 1.0)]
        components = []
        for parent, weight in zip(parents, weights):
            mine = self._places_of(parent)
            if weight < 0.0 or mine is None:
                return None
            components += [(place, weight * part) for place, part in mine]
        return components

    def _on_segment(self, parents, weights):
        if len(parents) != 2 or any(parent not in self._node for parent in parents):
            return None
        (number, minus), (other, plus) = (self._node[parent] for parent in parents)
        nodes = len(self._filaments.node_indices[number])
        if not self._filaments[number].type.segment_kind.straight:
            # The line between two nodes is not on the curve.
            return None
        closes = self._filaments[number].closed and minus + 1 == nodes
        if number != other or plus != (0 if closes else minus + 1) or not 0.0 <= weights[1] <= 1.0:
            return None
        return (number, minus, weights[1])

    def _sort_places(self, places):
        free = [index for index, place in enumerate(places) if len(place) == 2]
        self._free = np.array(free, dtype=int)
        self._free_friction = np.array([places[index][1] for index in free])
        groups: dict[tuple[int, int], list[int]] = {}
        for index, place in enumerate(places):
            if len(place) == 3:
                response = self._response(place[0])
                groups.setdefault((place[0], response.piece_of(place[1])), []).append(index)
        self._clusters = []
        for (number, piece), indices in groups.items():
            segments = np.array([places[index][1] for index in indices])
            fractions = np.array([places[index][2] for index in indices])
            response = self._response(number)
            key = (id(response), piece, segments.tobytes(), fractions.tobytes())
            self._clusters.append(((response, piece), np.array(indices), segments, fractions, key))

    def _response(self, number):
        filament = self._filaments[number]
        ends = filament.clamped, filament.clamped_tangents
        key = (filament.type, filament.segments, *ends, filament.closed, filament.planar)
        if key not in self._responses:
            solvent = (self._filaments.viscosity, self._filaments.temperature)
            friction = filament.type.segment_friction(*solvent, filament.segments)
            if filament.type.segment_kind.straight:
                self._responses[key] = FilamentResponse(filament, friction, self._scheme)
            else:
                element = filament.beam_element(self._filaments.temperature)
                self._responses[key] = BeamResponse(filament, friction, element)
        return self._responses[key]
