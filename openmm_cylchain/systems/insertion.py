"""Insertion of filaments into a Topology and a System that may hold other things already."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import openmm

from ..couplings.chain_forces import is_chain_force
from ..couplings.periodicity import has_box, is_periodic
from ..errors import InputError
from ..filaments.body import BODY_NAME, PlacedBody
from ..filaments.filament import CONTROL_POINT_NAME, NODE_NAME, Filament
from ..units.quantities import LENGTH, in_units_of, require_kind, shown, vector, whole_number
from ..units.types import BoxVectors, FloatArray, IntArray, Vectors

if TYPE_CHECKING:
    from openmm import app


def check_target(topology: "app.Topology", system: openmm.System, positions: Vectors) -> FloatArray:
    """Positions (particles, 3) in nm of what is there; raise InputError if they, Topology and System do not match."""
    positions = np.asarray(in_units_of(positions, LENGTH, "positions"))
    require_kind(system, openmm.System, "system")
    if not hasattr(topology, "getNumAtoms"):
        raise InputError(f"topology must be a Topology of OpenMM, but is {shown(topology)}.")
    count = system.getNumParticles()
    if topology.getNumAtoms() != count:
        raise InputError(f"The Topology has {topology.getNumAtoms()} atoms, but the System has {count} particles.")
    if positions.size == 0 and count == 0:
        positions = np.zeros((0, 3))
    if positions.shape != (count, 3):
        raise InputError(f"positions must have the shape ({count}, 3), but have {positions.shape}.")
    if topology.getPeriodicBoxVectors() is not None and not is_periodic(system):
        raise InputError(
            "The Topology has a periodic box, but the System has none: give it the same, by "
            "system.setDefaultPeriodicBoxVectors(*topology.getPeriodicBoxVectors()), or take it from the Topology, by "
            "topology.setPeriodicBoxVectors(None)."
        )
    for force in system.getForces():
        if is_chain_force(force):
            raise InputError("The System already holds filaments: add all of them through one Filaments object.")
    return positions


def check_force_groups(*groups: int) -> None:
    """Raise InputError unless all numbers are those of force groups."""
    for group in groups:
        if whole_number(group, 0, "force group") > 31:
            raise InputError(f"A force group must be between 0 and 31, but is {group}.")


def add_nodes_to_system(system: openmm.System, filament: Filament) -> tuple[IntArray, IntArray]:
    """Add the nodes of a Filament to a System, and behind them the control points of beam elements: the indices of
    both."""
    masses, control_masses = filament_masses(filament)
    masses[list(filament.clamped)] = 0.0
    masses = np.concatenate([masses, np.full(filament.spare_nodes, masses[-1])])
    control_masses[list(filament.clamped_tangents)] = 0.0
    nodes, control_points = ([system.addParticle(mass) for mass in own] for own in (masses, control_masses))
    return np.array(nodes), np.array(control_points, dtype=int)


def filament_masses(filament: Filament) -> tuple[FloatArray, FloatArray]:
    """Masses in Da of the nodes of a Filament, and of their control points, also of those that are clamped."""
    masses = filament.type.node_masses(len(filament.positions), filament.closed)
    if filament.control_points is None:
        return masses, masses[:0]
    return 0.5 * masses, 0.5 * masses


def add_to_topology(topology: "app.Topology", filament: Filament, name: str, attachment_names: Sequence[str]) -> None:
    """Add a Filament to a Topology: a chain with bonds along its nodes.

    It has a residue and an atom for each node, control point or attachment point.
    """
    chain = topology.addChain(name)
    nodes = len(filament.positions) + filament.spare_nodes
    atoms = []
    control_names = [CONTROL_POINT_NAME] * (0 if filament.control_points is None else nodes)
    for particle, atom_name in enumerate([NODE_NAME] * nodes + control_names + list(attachment_names)):
        residue = topology.addResidue(filament.type.name, chain, str(particle + 1))
        atoms.append(topology.addAtom(atom_name, None, residue))
    for first, second in zip(atoms, atoms[1:nodes]):
        topology.addBond(first, second)
    if filament.closed:
        topology.addBond(atoms[nodes - 1], atoms[0])


_BODY_MASS = 1.0
"""In Da, of each point of a rigid body: motion is overdamped, so that any will do but none."""


def add_body_to_system(system: openmm.System, topology: "app.Topology", placed: PlacedBody, name: str) -> IntArray:
    """Add a rigid body to a System, and to a Topology as a chain of a residue and an atom for each point.

    Returns the indices of its particles.
    """
    chain = topology.addChain(name)
    particles = []
    for number in range(len(placed.positions)):
        residue = topology.addResidue(placed.body.name, chain, str(number + 1))
        topology.addAtom(BODY_NAME, None, residue)
        particles.append(system.addParticle(_BODY_MASS))
    return np.array(particles)


def set_box_vectors(system: openmm.System, box_vectors: BoxVectors) -> list[openmm.Vec3]:
    """Give a System periodic box vectors, and return them in nm; InputError if they are none."""
    try:
        edges: list[Any] = list(box_vectors)
    except TypeError:
        edges = []
    if len(edges) != 3 or isinstance(box_vectors, str):
        raise InputError(f"box_vectors must be three vectors of three lengths, but is {shown(box_vectors)}.")
    vectors = [openmm.Vec3(*(float(x) for x in vector(edge, LENGTH, "box_vectors"))) for edge in edges]
    try:
        system.setDefaultPeriodicBoxVectors(*vectors)
    except openmm.OpenMMException:
        raise InputError(
            "box_vectors must be in the reduced form of OpenMM: the first along x, the second in the plane of x and y, "
            f"diagonal elements above zero, others at most half of these; but are {[tuple(own) for own in vectors]}."
        ) from None
    if not has_box(system):
        raise InputError("box_vectors are those of every System that has no box: take another size than 2 nm.")
    return vectors
