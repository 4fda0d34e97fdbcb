"""What runs simulate and what they write of it, for ``analysis.load``: from their filaments and their System."""

import dataclasses
import io
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import openmm

from ..couplings.capsule_contacts import as_capsule_contact_force
from ..couplings.shapes import Shape
from ..couplings.walls import as_filament_wall_force
from ..engine_choice import load_plugin
from ..kinetics.growth_force import FilamentGrowth
from ..output.files import write_atomically
from ..output.run_description import (
    DescribedContacts,
    DescribedFilament,
    DescribedLinkers,
    DescribedParticles,
    DescribedWall,
    RunDescription,
)
from ..output.run_files import RunFiles
from ..output.structure_files import write_lammps_data, write_mmcif, write_psf
from ..units.types import FloatArray
from .insertion import filament_masses

if TYPE_CHECKING:
    from openmm import app


def describe_system(
    filaments: Any,
    system: openmm.System,
    title: str,
    time_step: float,
    steps: int | None,
    steps_per_frame: int,
    box: FloatArray | None,
    shapes: Sequence[Shape] = (),
    topology: "app.Topology | None" = None,
    diameters: Mapping[int, float] | None = None,
) -> RunDescription:
    """What a run of a System simulates: filaments, linkers, walls and contacts.

    Parameters
    ----------
    system : openmm.System
        With the filaments; walls of ``filament_wall_force`` and contacts are found in it.
    time_step : float
        In ps.
    box : (3, 3) array in nm, or None
    shapes : sequence of Shape
        Walls beside those in the System.
    topology : openmm.app.Topology or None
        Names particles beside filaments by their residues; they are not described without it.
    diameters : mapping, optional
        Of particles beside filaments, in nm, by their indices. Those of contacts and the sigma of a
        ``NonbondedForce`` if not given.
    """
    walls = [wall for wall in map(_wall, system.getForces()) if wall is not None]
    contacts = [own for own in map(_contacts, system.getForces()) if own is not None]
    return RunDescription(
        title=title,
        temperature=filaments.temperature,
        time_step=time_step,
        steps=steps,
        steps_per_frame=steps_per_frame,
        particles=system.getNumParticles(),
        filaments=tuple(
            DescribedFilament(
                own.type,
                tuple(nodes.tolist()),
                own.closed,
                tuple(own.clamped),
                tuple(controls.tolist()),
                tuple(own.clamped_tangents),
                own.planar,
                monomer_length=0.0 if own.growth is None else own.growth.monomers.length,
                bent_at_rest=own.rest_bends is not None,
            )
            for own, nodes, controls in zip(filaments, filaments.node_indices, filaments.control_point_indices)
        ),
        box=None if box is None else tuple(tuple(float(edge) for edge in vector) for vector in box),
        linkers=tuple(
            DescribedLinkers(own.kind.name, own.kind.stiffness, own.kind.rest_length, own.kind.is_motor)
            for own in filaments.linkers
        ),
        walls=(*walls, *(DescribedWall(*_region(shape.region)) for shape in shapes)),
        contacts=tuple(contacts),
        others=() if topology is None else _others(filaments, system, topology, contacts, diameters or {}),
    )


def _others(filaments, system, topology, contacts, diameters):
    # Virtual sites are places on filaments, or on what is drawn already; so are points of bodies without a radius.
    of_bodies = {
        int(particle): 2.0 * radius
        for placed, own in zip(filaments.bodies, filaments.body_indices)
        for particle, radius in zip(own, placed.body.radii)
    }
    places = {particle for particle, diameter in of_bodies.items() if diameter == 0.0}
    known = {
        **_sigmas(system),
        **of_bodies,
        **{sphere: diameter for own in contacts for sphere, diameter in own.spheres},
        **diameters,
    }
    nodes = {int(node) for own in (*filaments.node_indices, *filaments.control_point_indices) for node in own}
    kinds: dict[tuple[str, float], list[int]] = {}
    for atom in topology.atoms():
        if atom.index not in nodes and atom.index not in places and not system.isVirtualSite(atom.index):
            kinds.setdefault((atom.residue.name, known.get(atom.index, 0.0)), []).append(atom.index)
    return tuple(DescribedParticles(name, tuple(own), diameter) for (name, diameter), own in kinds.items())


def _sigmas(system):
    # Of particles that have a Lennard-Jones interaction.
    sigmas = {}
    for force in system.getForces():
        if isinstance(force, openmm.NonbondedForce):
            for index in range(force.getNumParticles()):
                _, sigma, epsilon = force.getParticleParameters(index)
                if epsilon._value > 0.0:
                    sigmas[index] = sigma._value
    return sigmas


def _region(region):
    # Quantities in OpenMM's units: the vector is a direction of some shapes and a length of others.
    shape, point, vector, length = (getattr(value, "_value", value) for value in region)
    return shape, tuple(map(float, point)), tuple(map(float, vector)), float(length)


def _wall(force):
    force = as_filament_wall_force(force)
    if force is None:
        return None
    held = range(force.getNumParticles())
    return dataclasses.replace(
        DescribedWall(*_region(force.getRegion())),
        stiffness=force.getStiffness()._value,
        particles=tuple(force.getParticle(index) for index in held),
        radii=tuple(force.getParticleRadius(index)._value for index in held),
    )


def _contacts(force):
    force = as_capsule_contact_force(force)
    if force is None:
        return None
    return DescribedContacts(
        stiffness=force.getStiffness()._value,
        periodic=force.usesPeriodicBoundaryConditions(),
        chains=tuple(
            (
                tuple(force.getChainParticles(chain)),
                force.getChainDiameter(chain)._value,
                force.getChainExcludedNeighbors(chain),
                force.isChainClosed(chain),
            )
            for chain in range(force.getNumChains())
        ),
        spheres=tuple(
            (force.getSphereParticle(sphere), force.getSphereDiameter(sphere)._value)
            for sphere in range(force.getNumSpheres())
        ),
        exclusions=tuple(tuple(force.getExclusion(index)) for index in range(force.getNumExclusions())),
    )


def write_topology(
    files: RunFiles, topology: "app.Topology", filaments: Any, system: openmm.System, positions: Any
) -> None:
    """Write what programs need to know of a trajectory: files for mdtraj, VMD and OVITO."""
    mmcif, psf, data = io.StringIO(), io.StringIO(), io.StringIO()
    write_mmcif(topology, positions, mmcif)
    write_psf(topology, psf, system, _particle_masses(filaments, system))
    write_lammps_data(topology, positions, data, system)
    for path, text in zip((files.topology, files.topology_psf, files.topology_data), (mmcif, psf, data)):
        write_atomically(path, text.getvalue().encode())


def _particle_masses(filaments, system):
    # A System has none of nodes that are clamped.
    masses = np.array([system.getParticleMass(index)._value for index in range(system.getNumParticles())])
    for filament, *indices in zip(filaments, filaments.node_indices, filaments.control_point_indices):
        for particles, own in zip(indices, filament_masses(filament)):
            masses[particles[: len(own)]] = own
    return masses


def total_energies(filaments: Any, context: openmm.Context, positions: FloatArray) -> tuple[float, float]:
    """Stretching and bending energy of all filaments that are there in a Context in kJ/mol, for its positions in nm."""
    if any(own.growth is not None or own.rest_bends is not None for own in filaments):
        # The Context alone knows lengths at rest, and frames.
        return _energies_in(context)
    stretching = bending = 0.0
    for filament, nodes, controls in zip(filaments, filaments.node_indices, filaments.control_point_indices):
        if not filament.takes_part:
            continue
        with np.errstate(all="ignore"):
            energies = filament.energies(positions[nodes], positions[controls], filaments.temperature)
        stretching += energies[0]
        bending += energies[1]
    return stretching, bending


def growth_in(context: openmm.Context, filaments: Any) -> FilamentGrowth | None:
    """How far filaments have grown in a Context; None if none of them grow."""
    if all(filament.growth is None for filament in filaments):
        return None
    return filaments.in_context(context).growth()


def _energies_in(context):
    kind: Any = load_plugin().CylinderChainForce
    (force,) = (kind.cast(own) for own in context.getSystem().getForces() if kind.isinstance(own))
    stretching, bending = force.computeEnergies(context)
    return stretching._value, bending._value


def energy_cells(
    filaments: Any,
    positions: FloatArray,
    stretching: float,
    bending: float,
    kT: float,
    growth: FilamentGrowth | None = None,
) -> tuple[float, ...]:
    """What a line of ENERGY_COLUMNS says behind its step and time.

    Positions are in nm, energies those of ``total_energies``, and ``growth`` that of filaments that grow.
    """
    segments = sum(filament.segments for filament in filaments if filament.takes_part)
    bends = sum(filament.bends for filament in filaments if filament.takes_part)
    there = np.array([filament.takes_part for filament in filaments], dtype=bool)
    if growth is not None:
        grown = [filaments[number] for number in growth.filaments]
        segments += int(np.maximum(growth.nodes - 1, 0).sum()) - sum(own.segments for own in grown)
        bends += int(np.maximum(growth.nodes - 2, 0).sum()) - sum(own.bends for own in grown)
        there[growth.filaments] = growth.nodes > 0
    ends = np.array([(nodes[0], nodes[-1]) for nodes in filaments.node_indices])[there]
    return (
        stretching,
        bending,
        stretching + bending,
        stretching / segments / kT if segments and kT else np.nan,
        bending / bends / kT if bends and kT else np.nan,
        float(np.mean(np.linalg.norm(positions[ends[:, 1]] - positions[ends[:, 0]], axis=1))) if len(ends) else np.nan,
    )
