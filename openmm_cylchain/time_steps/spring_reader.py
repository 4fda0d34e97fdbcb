"""How stiff the forces of a System are: the springs by which each of them acts."""

import re

import numpy as np
import openmm

from ..couplings.capsule_contacts import as_capsule_contact_force, owners_of_chains
from ..couplings.chain_forces import is_chain_force
from ..couplings.contacts import CONTACT_STIFFNESS, is_contact_force
from ..couplings.crosslinks import Crosslinks
from ..couplings.link_store import parameters_of
from ..couplings.native_links import is_link_force
from ..couplings.pulling import is_constant_force
from ..couplings.walls import WALL_NAME, as_filament_wall_force
from ..filaments.collection import FilamentCollection
from ..kinetics.binding_force import find_binding_force, is_binding_force
from ..kinetics.growth_force import is_growth_force
from ..units.types import FloatArray
from .harmonic_curvatures import bond_curvatures, external_curvatures
from .springs import ACCURATE, ACCURATE_ALONG_CONTACT, NOWHERE, Springs

_WITHOUT_STIFFNESS = (openmm.CMMotionRemover, openmm.MonteCarloBarostat)
_WALL = re.compile(r"\(([-+.0-9e]+)\)\*\(")
_MOST_EVALUATED = 5000


class SpringReader:
    """Reads how stiff the forces of a System with filaments are.

    Parameters
    ----------
    filaments : Filaments
        In the System.

    Attributes
    ----------
    constant_forces : dict of int to (3,) arrays
        What external forces that do not change with positions add up to on each particle, in kJ/(mol nm).
    between : dict of (int, int, float) to int
        Places between two particles that have none of their own, with numbers behind those of all particles.
    """

    def __init__(self, system: openmm.System, filaments: FilamentCollection) -> None:
        self._system = system
        self._filaments = filaments
        self.constant_forces: dict[int, FloatArray] = {}
        self.between: dict[tuple[int, int, float], int] = {}

    def read(self, force: openmm.Force, label: str) -> list[Springs] | None:
        """The springs of a force of the System, known by a label, or None where the stiffness is not known."""
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
        if is_chain_force(force) or is_growth_force(force) or isinstance(force, _WITHOUT_STIFFNESS):
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
        return [] if parameters_of(force, "cylinder_chain") else None

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
        anchors = anchors[anchors != NOWHERE]
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
            particles[row] = self.between.setdefault(place, self._system.getNumParticles() + len(self.between))
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
        stiffness, constants = external_curvatures(force, [values for _, values in particles])
        known = [one for one in stiffness if one is not None]
        if len(known) < len(stiffness):
            return None
        self._add_constant((index, one) for index, one in zip(indices, constants) if one is not None)
        return [Springs.at_points(label, "entry", indices, known)]

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
        nowhere = np.full(len(beads), NOWHERE)
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
        numbers = owners_of_chains(force, self._filaments)
        ends = [nodes[:1] if force.isChainClosed(chain) else nodes[[0, -1]] for chain, nodes in enumerate(chains)]
        springs = []
        # Of two filaments that touch, each moves.
        for item, parts, accurate in (
            ("end of filament", ends, ACCURATE),
            ("all along filament", chains, ACCURATE_ALONG_CONTACT),
        ):
            owners = np.repeat(numbers, [len(part) for part in parts])
            nodes = np.concatenate([np.zeros(0, dtype=int), *parts])
            nowhere, both = np.full(len(nodes), NOWHERE), np.full(len(nodes), 2.0 * stiffness)
            springs.append(Springs(label, item, owners, nodes, nowhere, both, accurate))
        spheres = np.array([force.getSphereParticle(sphere) for sphere in range(force.getNumSpheres())], dtype=int)
        if len(spheres):
            partner = np.full(len(spheres), chains[0][0] if chains else NOWHERE)
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
    curvatures = dict(zip(parameters, bond_curvatures(force, parameters)))
    stiffness = [curvatures[values] for _, _, values in bonds]
    if any(one is None for one in stiffness):
        return None
    return _bonds(label, [(first, second, k) for (first, second, _), k in zip(bonds, stiffness)])
