"""Stiffness of the forces of a System that are taken at the start of a step, and the step that they allow.

Such a force is a set of springs: from a particle to a fixed point (walls, restraints), or between two particles (bonds,
crosslinks, contacts), which are nodes, places on filaments, or particles with a friction of their own. The largest
eigenvalue lambda of response and stiffness (see ``mobility``) says how much too large a variance is, by the factor
1/(1 - lambda/2) at most, and from lambda = 2 on the System is thrown apart.
"""

import math
import re
import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt
import openmm
from scipy.optimize import brentq
from scipy.sparse import csr_array

from ..couplings.capsule_contacts import as_capsule_contact_force
from ..couplings.contacts import CONTACT_STIFFNESS, is_contact_force
from ..couplings.crosslinks import Crosslinks
from ..couplings.native_links import is_link_force
from ..couplings.pulling import is_constant_force
from ..couplings.walls import WALL_NAME, as_filament_wall_force
from ..errors import TimeStepWarning
from ..filaments.collection import FilamentCollection
from ..kinetics.binding_force import find_binding_force, is_binding_force
from ..units.types import FloatArray, Indices, IntArray, Numbers
from .beam_response import BeamResponse
from .coupled_forces import CoupledForces
from .mobility import FilamentResponse, PlaceResponse
from .other_particles import describe_other_particles
from .schemes import EXPLICIT_SCHEMES, IMPLICIT_SCHEMES
from .time_step import TimeStep

ACCURATE = 2.0 * (1.0 - 1.0 / 1.05)
"""lambda up to which no variance is more than 5 % too large."""

ACCURATE_ALONG_CONTACT = 0.5
"""lambda where filaments touch with all beads at once, which they seldom do: up to a third too large."""

UNSTABLE = 2.0
"""lambda from which on the System is thrown apart."""

TOO_STIFF = 2.0 * (1.0 - 1.0 / 1.10)
"""lambda from which on a System is warned of: variances may be 10 % too large."""

_TOGETHER = "explicit forces together"
_NOWHERE = -1
_WITHOUT_STIFFNESS = (openmm.CMMotionRemover, openmm.MonteCarloBarostat)
_WALL = re.compile(r"\(([-+.0-9e]+)\)\*\(")
_MOST_EVALUATED = 5000
# In nm. A potential that has the same curvature at all of them is harmonic.
_SCALES = (1.0, 30.0, 1e3, 3e4, 1e6)


@dataclass(frozen=True, eq=False)
class Springs:
    """The springs of one force.

    Attributes
    ----------
    force : str
        Name and number of the force.
    item : str
        What one of the springs is called.
    numbers : (n,) int array
        By which they are known in the force.
    first, second : (n,) int arrays
        Particles; -1 for a fixed point in place of a second one.
    stiffness : (n,) array
        In kJ/(mol nm^2), along its stiffest direction.
    accurate : float
        lambda up to which their energies are right.
    """

    force: str
    item: str
    numbers: IntArray
    first: IntArray
    second: IntArray
    stiffness: FloatArray
    accurate: float = ACCURATE

    @classmethod
    def at_points(cls, force: str, item: str, particles: Indices, stiffness: npt.ArrayLike, **others: Any) -> "Springs":
        """Springs to fixed points."""
        particles = np.asarray(particles, dtype=int)
        nowhere = np.full(len(particles), _NOWHERE)
        stiffness = np.broadcast_to(np.asarray(stiffness, dtype=float), len(particles))
        return cls(force, item, np.arange(len(particles)), particles, nowhere, stiffness, **others)


class ExplicitForces:
    """The forces of a System with filaments that are taken at the start of a step.

    Parameters
    ----------
    system : openmm.System
    filaments : Filaments
        In the System.
    scheme : {"implicit", "implicit-second-order", "midpoint", "euler"}
        Tethers are among these forces where it is explicit.
    particle_friction : energy*time/length^2, or array of them, optional
        As for ``Filaments.create_integrator``.
    coupled_forces : CoupledForces, optional
        Of the System, if it is known.

    Attributes
    ----------
    springs : list of Springs
    unknown : tuple of str
        Forces whose stiffness is not known.
    constant_forces : dict of int to (3,) arrays
        What external forces that do not change with positions add up to on each particle, in kJ/(mol nm).
    """

    def __init__(
        self,
        system: openmm.System,
        filaments: FilamentCollection,
        scheme: str,
        particle_friction: Numbers | None = None,
        coupled_forces: CoupledForces | None = None,
    ) -> None:
        self._system = system
        self._filaments = filaments
        self._scheme = scheme
        self._other_friction = self._frictions(particle_friction)
        self._responses: dict[Any, PlaceResponse] = {}
        # Places between two particles that have none of their own, with numbers behind those of all particles.
        self._between: dict[tuple[int, int, float], int] = {}
        self.springs: list[Springs] = []
        self.constant_forces: dict[int, FloatArray] = {}
        unknown: list[str] = []
        coupled = coupled_forces or CoupledForces(system)
        for index, force in enumerate(system.getForces()):
            found = self._read(force, f"{force.getName()} (force {index})", index, coupled)
            if found is None:
                unknown.append(f"{force.getName()} (force {index})")
            else:
                self.springs += [one for one in found if np.any(one.stiffness > 0.0)]
        if scheme in EXPLICIT_SCHEMES and filaments.tethers:
            nodes = [filaments.node_indices[tether.filament][tether.node] for tether in filaments.tethers]
            stiffness = [tether.stiffness for tether in filaments.tethers]
            self.springs.append(Springs.at_points("Tethers", "tether", nodes, stiffness))
        unknown += self._find_places()
        self.unknown = tuple(unknown)

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
            if self._filaments[one.filament].type.has_beam_elements
        }

    def recommended_step(self) -> TimeStep:
        """The TimeStep of these forces, one by one and together; an infinite step if there are none."""
        bounds, allowed = {}, {}
        accurate = [one for one in self.springs if one.accurate == ACCURATE]
        for one in self.springs:
            step = self.allowed_step([one], one.accurate)
            name = self.eigenvalue([one], min(step, 1e30))[1]
            bounds[name], allowed[name] = self.allowed_step([one], UNSTABLE), step
        if len(accurate) > 1:
            bounds[_TOGETHER] = self.allowed_step(accurate, UNSTABLE)
            allowed[_TOGETHER] = self.allowed_step(accurate, ACCURATE)
        if not allowed:
            return TimeStep(math.inf, "no forces beside filaments", {}, {}, self.unknown)
        binding = min(allowed, key=allowed.__getitem__)
        named = f"{self.eigenvalue(accurate, allowed[binding])[1]} most of all, " if binding == _TOGETHER else ""
        reason = f"{binding}: {named}explicit, so its fluctuations may be 5 % too large"
        return TimeStep(allowed[binding], reason, bounds, allowed, self.unknown)

    def warn_if_too_stiff(self, step: float) -> None:
        """Issue a TimeStepWarning, naming the spring, if variances may be 10 % too large in a step in ps."""
        accurate = [one for one in self.springs if one.accurate == ACCURATE]
        if not accurate:
            return
        largest, name = self.eigenvalue(accurate, step)
        if largest > TOO_STIFF:
            excess = 1.0 / (1.0 - 0.5 * largest) - 1.0 if largest < UNSTABLE else math.inf
            what = f"fluctuations may be {100.0 * excess:.3g} % too large" if excess < 10.0 else "it is thrown apart"
            warnings.warn(
                f"A time step of {step:.4g} ps is too long for forces that are explicit, most of all {name}: {what}. "
                f"Recommended for these forces: {self.allowed_step(accurate, ACCURATE):.4g} ps.",
                TimeStepWarning,
                stacklevel=4,
            )

    def allowed_step(self, springs: Sequence[Springs], target: float) -> float:
        """The longest step, in ps, in which lambda of some springs does not exceed ``target``."""
        # The response grows no faster than the step.
        start = 1e-9
        shortest = target * start / max(self.eigenvalue(springs, start)[0], 1e-300)
        if shortest > 1e250:
            return math.inf

        def excess(step):
            return self.eigenvalue(springs, step)[0] - target

        below, above = shortest * (1.0 - 1e-6), shortest * (1.0 + 1e-3)
        while excess(above) < 0.0:
            below, above = above, 8.0 * above
            if above > 1e12 * shortest:
                return math.inf
        return math.exp(brentq(lambda x: excess(math.exp(x)), math.log(below), math.log(above), xtol=1e-3))

    def eigenvalue(self, springs: Sequence[Springs], step: float) -> tuple[float, str]:
        """lambda of some springs in a step in ps, and the name of the spring that has most part in it.

        A spring between two particles with the responses r and s is taken as springs k (r + s)/r and k (r + s)/s to
        fixed points, which is exact for one and an upper bound for several.
        """
        responses = self._components @ self._response_of_places(step)
        demand = np.zeros(len(responses))
        for one in springs:
            for sites, stiffness in self._shares(one, responses):
                demand += np.bincount(sites, weights=stiffness, minlength=len(demand))
        demand = self._components.T @ demand
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
        return largest, self._name_of_worst(springs, responses, places)

    def _name_of_worst(self, springs, responses, places):
        here = np.zeros(self._components.shape[1], dtype=bool)
        here[places] = True
        sites_here = (self._components @ here.astype(float)) > 0.0
        name, most = "", -1.0
        for one in springs:
            for sites, stiffness in self._shares(one, responses):
                part = np.where(sites_here[sites], stiffness * responses[sites], -1.0)
                if len(part) and part.max() > most:
                    row = int(np.argmax(part))
                    most = float(part[row])
                    kept = np.flatnonzero(self._kept(one))
                    name = f"{one.force}: {one.item} {one.numbers[kept[row]]}"
        return name

    def _kept(self, springs):
        return (self._site_of[springs.first] >= 0) & (self._site_of[springs.second] >= _NOWHERE)

    def _shares(self, springs, responses):
        # Sites and the stiffness of the spring to a fixed point that each of them is given.
        kept = self._kept(springs)
        first, second = self._site_of[springs.first[kept]], springs.second[kept]
        stiffness = springs.stiffness[kept]
        paired = second != _NOWHERE
        mine, other = responses[first], np.zeros(len(first))
        other[paired] = responses[self._site_of[second[paired]]]
        total = mine + other
        with np.errstate(divide="ignore", invalid="ignore"):
            yield first, np.where(mine > 0.0, stiffness * total / mine, 0.0)
            share = np.where(other > 0.0, stiffness * total / other, 0.0)
        # In the order of the first ones, so that a row is a spring in both.
        sites = np.where(paired, self._site_of[second], first)
        yield sites, np.where(paired, share, 0.0)

    # Particles

    def _frictions(self, particle_friction):
        nodes = np.concatenate([*self._filaments.node_indices, *self._filaments.control_point_indices])
        others, frictions = describe_other_particles(self._system, nodes, particle_friction)
        return dict(zip(others.tolist(), frictions.tolist()))

    def _find_places(self):
        # Sites are particles that springs act on. Each is one place or a mean of several: on a filament or free.
        particles = np.unique(np.concatenate([np.zeros(0, int), *(np.r_[s.first, s.second] for s in self.springs)]))
        particles = particles[particles != _NOWHERE]
        # The last entry stands for _NOWHERE.
        self._between_of = {number: place for place, number in self._between.items()}
        self._site_of = np.full(self._system.getNumParticles() + len(self._between) + 1, -2)
        self._site_of[_NOWHERE] = _NOWHERE
        places: dict[Any, int] = {}
        rows, columns, weights, unknown = [], [], [], []
        for site, particle in enumerate(particles.tolist()):
            components = self._places_of(particle)
            if components is None:
                what = "control point of beam elements" if particle in self._control_points else "virtual site"
                unknown.append(f"{what} {particle}")
                continue
            self._site_of[particle] = site
            for place, weight in components:
                rows.append(site)
                columns.append(places.setdefault(place, len(places)))
                weights.append(weight)
        self._components = csr_array((weights, (rows, columns)), shape=(len(particles), len(places)))
        self._sort_places(list(places))
        return unknown

    def _places_of(self, particle):
        # Weights of places: a friction, or a filament, a segment and a fraction. None where that is not known.
        if particle in self._between_of:
            first, second, fraction = self._between_of[particle]
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
        if self._filaments[number].type.has_beam_elements:
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
        self._place_count = len(places)

    def _response(self, number):
        filament = self._filaments[number]
        key: tuple[Any, ...] = (filament.type, filament.segments, filament.clamped, filament.closed)
        if filament.type.has_beam_elements:
            key = (*key, filament.clamped_tangents, filament.planar)
        if key not in self._responses:
            solvent = (self._filaments.viscosity, self._filaments.temperature)
            friction = filament.type.segment_friction(*solvent, filament.segments)
            if filament.type.has_beam_elements:
                element = filament.beam_element(self._filaments.temperature)
                self._responses[key] = BeamResponse(filament, friction, element)
            else:
                self._responses[key] = FilamentResponse(filament, friction, self._scheme)
        return self._responses[key]

    def _response_of_places(self, step):
        responses = np.zeros(self._place_count)
        responses[self._free] = step / self._free_friction
        known = {}
        for (response, piece), indices, segments, fractions, key in self._clusters:
            if key not in known:
                known[key] = response.at(piece, segments, fractions, step)
            responses[indices] = known[key]
        return responses

    # Forces

    def _read(self, force, label, index, coupled):
        # A list of Springs, or None where the stiffness is not known.
        if self._scheme in IMPLICIT_SCHEMES and coupled.may_include(index):
            outside = coupled.place_outside(index)
            if outside is None:
                return []
            label = f"{label}, explicit because of {outside}"
        capsules = as_capsule_contact_force(force)
        if capsules is not None:
            return self._between_capsules(label, capsules)
        wall = as_filament_wall_force(force)
        if wall is not None:
            particles = [wall.getParticle(particle) for particle in range(wall.getNumParticles())]
            return [Springs.at_points(label, "entry", particles, wall.getStiffness()._value)]
        links = Crosslinks.of_force(force)
        if links is not None or is_link_force(force):
            return None if links is None else self._crosslinks(links, label)
        if is_binding_force(force):
            return self._linkers(label)
        if force.getName().startswith("CylinderChain") or isinstance(force, _WITHOUT_STIFFNESS):
            return []
        if isinstance(force, openmm.HarmonicBondForce):
            bonds = [force.getBondParameters(index) for index in range(force.getNumBonds())]
            return _bonds(label, [(first, second, k._value) for first, second, _, k in bonds])
        if isinstance(force, openmm.CustomBondForce):
            return _custom_bonds(force, label)
        if isinstance(force, openmm.CustomExternalForce):
            return self._external(force, label)
        if is_contact_force(force):
            return self._contacts(force, label)
        if isinstance(force, openmm.PythonForce):
            if any(name.startswith("cylinder_chain") for name in dict(force.getGlobalParameters())):
                return []
        return None

    def _crosslinks(self, links, label):
        table = links.table(None)
        if len(table):
            stiffness = links.thermal_stiffness(table, self._filaments.temperature)
            first, second = (self._holders(table.places, side) for side in (0, 1))
            return [Springs(label, "crosslink", table.numbers, first, second, stiffness)]
        return [self._to_come(label, "crosslink", links.thermal_stiffness(None, self._filaments.temperature))]

    def _linkers(self, label):
        linkers = find_binding_force(self._system)
        kinds = range(linkers.getNumLinkerTypes())
        stiffness = max((linkers.getLinkerTypeParameters(kind)[3] for kind in kinds), default=0.0)
        anchors = np.unique([linkers.getAnchor(index)[0] for index in range(linkers.getNumAnchors())]).astype(int)
        anchors = anchors[anchors != _NOWHERE]
        found = [self._to_come(label, "linker", stiffness)]
        if len(anchors):
            first, last = (int(self._filaments.node_indices[number][number]) for number in (0, -1))
            ends, stiffnesses = np.where(anchors == first, last, first), np.full(len(anchors), stiffness)
            found.append(Springs(label, "linker to come, on particle", anchors, anchors, ends, stiffnesses))
        return found

    def _to_come(self, label, what, stiffness):
        # What may join any two places: ends of filaments move most.
        ends = [int(node) for nodes in self._filaments.node_indices for node in nodes[[0, -1]]]
        first, second = np.array(ends), np.roll(ends, 2)
        if len(self._filaments) == 1:
            first, second = first[:1], np.array(ends[1:])
        numbers = np.arange(len(first)) // 2
        item = f"{what} to come, on the end of filament"
        return Springs(label, item, numbers, first, second, np.full(len(first), stiffness))

    def _holders(self, places, side):
        # Particles, and numbers behind all of them for places between two. Fixed points are nowhere.
        particles = np.array(places.pairs[:, side])
        for row in np.flatnonzero(places.on_segments[:, side]):
            place = (int(particles[row]), int(places.partners[row, side]), float(places.fractions[row, side]))
            particles[row] = self._between.setdefault(place, self._system.getNumParticles() + len(self._between))
        return particles

    def _external(self, force, label):
        particles = [force.getParticleParameters(index) for index in range(force.getNumParticles())]
        indices = [index for index, _ in particles]
        if is_constant_force(force) or not particles:
            self._add_constant(particles)
            return []
        wall = _WALL.match(force.getEnergyFunction()) if force.getName().startswith(f"{WALL_NAME} (") else None
        if wall:
            return [Springs.at_points(label, "entry", indices, 2.0 * float(wall[1]))]
        if len(particles) > _MOST_EVALUATED or force.usesPeriodicBoundaryConditions():
            return None
        stiffness, constants = _external_curvatures(force, [values for _, values in particles])
        if any(one is None for one in stiffness):
            return None
        self._add_constant((index, one) for index, one in zip(indices, constants) if one is not None)
        return [Springs.at_points(label, "entry", indices, stiffness)]

    def _add_constant(self, forces):
        for particle, force in forces:
            self.constant_forces[particle] = self.constant_forces.get(particle, 0.0) + np.array(force)

    def _contacts(self, force, label):
        stiffness = next(
            force.getGlobalParameterDefaultValue(index)
            for index in range(force.getNumGlobalParameters())
            if force.getGlobalParameterName(index) == CONTACT_STIFFNESS
        )
        diameters = np.array([force.getParticleParameters(index)[0] for index in range(force.getNumParticles())])
        return self._between_beads(label, stiffness, diameters)

    def _between_beads(self, label, stiffness, diameters):
        # Diameters of all particles, zero for those that take no part.
        columns = []
        for number, mine in enumerate(self._filaments.bead_indices):
            mine = mine[diameters[mine] > 0.0]
            if len(mine):
                spacing = self._filaments[number].segments * self._filaments[number].type.segment_length / len(mine)
                at_end = np.arange(len(mine)) * spacing <= diameters[mine[0]]
                columns.append((mine, np.full(len(mine), number), at_end))
        beads, owners, at_end = map(np.concatenate, zip(*columns))
        nowhere = np.full(len(beads), _NOWHERE)
        # Of two filaments that touch, each moves.
        both = np.full(len(beads), 2.0 * stiffness)
        crossing = Springs(label, "end of filament", owners[at_end], beads[at_end], nowhere[at_end], both[at_end])
        along = Springs(label, "all along filament", owners, beads, nowhere, both, ACCURATE_ALONG_CONTACT)
        others = np.setdiff1d(np.flatnonzero(diameters > 0.0), beads)
        partner = np.full(len(others), beads[0])
        outside = Springs(label, "particle", others, others, partner, np.full(len(others), stiffness))
        return [crossing, along, outside] if len(others) else [crossing, along]

    def _between_capsules(self, label, force):
        # One contact, at the node that moves most; and where filaments lie side by side, one for each segment.
        stiffness = force.getStiffness()._value
        chains = [np.array(force.getChainParticles(chain)) for chain in range(force.getNumChains())]
        ends = [nodes[:1] if force.isChainClosed(chain) else nodes[[0, -1]] for chain, nodes in enumerate(chains)]
        springs = []
        # Of two filaments that touch, each moves.
        for item, parts, accurate in (
            ("end of filament", ends, ACCURATE),
            ("all along filament", chains, ACCURATE_ALONG_CONTACT),
        ):
            owners = np.repeat(np.arange(len(parts)), [len(part) for part in parts])
            nodes = np.concatenate([np.zeros(0, dtype=int), *parts])
            springs.append(
                Springs(
                    label,
                    item,
                    owners,
                    nodes,
                    np.full(len(nodes), _NOWHERE),
                    np.full(len(nodes), 2.0 * stiffness),
                    accurate,
                )
            )
        spheres = np.array([force.getSphereParticle(sphere) for sphere in range(force.getNumSpheres())], dtype=int)
        if len(spheres):
            partner = np.full(len(spheres), chains[0][0] if chains else _NOWHERE)
            springs.append(Springs(label, "particle", spheres, spheres, partner, np.full(len(spheres), stiffness)))
        return springs


def _bonds(label, bonds):
    if not bonds:
        return []
    first, second, stiffness = (np.array(column) for column in zip(*bonds))
    return [Springs(label, "bond", np.arange(len(bonds)), first, second, stiffness.astype(float))]


def _custom_bonds(force, label):
    bonds = [force.getBondParameters(index) for index in range(force.getNumBonds())]
    if len(bonds) > _MOST_EVALUATED:
        return None
    parameters = sorted({values for _, _, values in bonds})
    curvatures = dict(zip(parameters, _bond_curvatures(force, parameters)))
    stiffness = [curvatures[values] for _, _, values in bonds]
    if any(one is None for one in stiffness):
        return None
    return _bonds(label, [(first, second, k) for (first, second, _), k in zip(bonds, stiffness)])


def _bond_curvatures(force, parameters):
    # One for each set of parameters; None where the potential is not harmonic.
    copy = openmm.CustomBondForce(force.getEnergyFunction())
    _copy_globals(force, copy)
    for index in range(force.getNumPerBondParameters()):
        copy.addPerBondParameter(force.getPerBondParameterName(index))
    distances = np.array([distance for scale in _SCALES for distance in (scale, 1.01 * scale)])
    positions: list[Any] = []
    for values in parameters:
        for distance in distances:
            copy.addBond(len(positions), len(positions) + 1, values)
            positions += [[0.0, 0.0, 0.0], [distance, 0.0, 0.0]]
    slopes = -_forces(copy, positions)[1::2, 0].reshape(len(parameters), len(_SCALES), 2)
    curvatures = (slopes[..., 1] - slopes[..., 0]) / (0.01 * np.array(_SCALES))
    return [_constant(row) for row in curvatures]


def _external_curvatures(force, parameters):
    # The curvature for each set of parameters, None where it is not the same everywhere; and the force, None where that
    # is not.
    copy = openmm.CustomExternalForce(force.getEnergyFunction())
    _copy_globals(force, copy)
    for index in range(force.getNumPerParticleParameters()):
        copy.addPerParticleParameter(force.getPerParticleParameterName(index))
    direction = np.array([0.48, -0.6, 0.64])
    origins = [sign * scale * direction for scale in _SCALES for sign in (1.0, -1.0)]
    points = [
        origin + side * 0.01 * np.linalg.norm(origin) * axis
        for origin in origins
        for axis in np.eye(3)
        for side in (-0.5, 0.5)
    ]
    positions: list[Any] = []
    for values in parameters:
        for point in points:
            copy.addParticle(len(positions), values)
            positions.append(point)
    forces = _forces(copy, positions).reshape(len(parameters), len(origins), 3, 2, 3)
    widths = 0.01 * np.array([np.linalg.norm(origin) for origin in origins])
    hessians = (forces[..., 0, :] - forces[..., 1, :]) / widths[:, None, None]
    if not np.all(np.isfinite(hessians)):
        return [None] * len(parameters), [None] * len(parameters)
    curvatures = np.max(np.linalg.eigvalsh(hessians + np.swapaxes(hessians, -1, -2)), axis=-1) / 2
    forces = forces.reshape(len(parameters), -1, 3)
    spread = np.ptp(forces, axis=1).max(axis=1) <= 1e-9 * np.abs(forces).max(axis=(1, 2))
    return [_constant(row) for row in curvatures], [own[0] if same else None for own, same in zip(forces, spread)]


def _copy_globals(force, copy):
    for index in range(force.getNumGlobalParameters()):
        copy.addGlobalParameter(force.getGlobalParameterName(index), force.getGlobalParameterDefaultValue(index))


def _forces(force, positions):
    system = openmm.System()
    for _ in positions:
        system.addParticle(1.0)
    system.addForce(force)
    context = openmm.Context(system, openmm.VerletIntegrator(1.0), openmm.Platform.getPlatform("Reference"))
    context.setPositions(positions)
    return context.getState(forces=True).getForces(asNumpy=True)._value


def _constant(curvatures):
    # Rounding leaves 1e-16 of a force, which is 1e-14 of it, in a curvature.
    if not np.all(np.isfinite(curvatures)):
        return None
    spread = np.ptp(curvatures)
    return max(0.0, float(np.mean(curvatures))) if spread <= 1e-6 * np.max(np.abs(curvatures)) else None
