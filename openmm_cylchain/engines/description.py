"""What an engine has to know of filaments and their System, checked against the System."""

import numpy as np

from ..couplings.growing_chains import growing_particles
from ..couplings.periodicity import is_periodic
from ..errors import InputError
from ..filaments.twist import has_twist
from ..mechanics.friction import SegmentFriction
from ..mechanics.redistribution import ChainSet


def advice_after_blow_up(system, filaments):
    """What else to say of a chain that has blown up: its positions may be those of another length, or may have been
    torn in a periodic System by wrapping; torque may have folded it."""
    advice = ""
    if growing_particles(system):
        advice = (
            " Positions of filaments that grow are those of a length: set them with it, by a checkpoint or by a State "
            "with integratorParameters=True."
        )
    if any(has_twist(filament.type) for filament in filaments):
        advice += (
            " Where torque has folded two segments with twist onto each other, a smaller step does not help: use "
            "shorter segments, contacts with fewer excluded_neighbors, or less torque."
        )
    if not is_periodic(system):
        return advice
    return advice + (
        " If positions were wrapped into the periodic box particle by particle, make filaments whole first with "
        "openmm_cylchain.make_whole."
    )


def filament_label(number, filament):
    """What to call a filament in messages."""
    return f"Filament {number} ({filament.type.name})"


def refuse_constraints(system, placed):
    """Raise InputError if the System has constraints, naming the filament that one is on."""
    if not system.getNumConstraints():
        return
    every = range(len(placed.filaments))
    owner = {int(particle): number for number in every for particle in placed.particles_of(number)}
    for index in range(system.getNumConstraints()):
        first, second, _ = system.getConstraintParameters(index)
        for particle in (first, second):
            if particle in owner:
                number = owner[particle]
                node = particle - placed.node_indices[number][0]
                raise InputError(
                    f"{filament_label(number, placed.filaments[number])}: node {node} has a System constraint. "
                    "Segments are held by stiff springs, not by constraints: remove it."
                )
    raise InputError(
        f"Particles {first} and {second} have a System constraint, which the integrators of filaments cannot keep. "
        "Take openmm.LangevinMiddleIntegrator, which keeps it, and filaments in equilibrium, or replace it by a bond."
    )


def describe_chains(system, placed):
    """The filaments as a ChainSet. Nodes of mass zero in the System are fixed.

    InputError if a node is a virtual site, or all nodes of a filament have mass zero.
    """
    fixed = fixed_nodes(system, placed)
    filaments, solvent = placed.filaments, (placed.viscosity, placed.temperature)
    frictions = [friction_of_segments(filament, *solvent) for filament in filaments]
    node_frictions = [filament.type.node_friction for filament in filaments]
    counts = [len(filament.positions) for filament in filaments]
    segments = [filament.segments for filament in filaments]
    return ChainSet(
        node_counts=np.array(counts),
        fixed=np.array(fixed),
        closed=np.array([filament.closed for filament in filaments]),
        planar=np.array([filament.planar for filament in filaments]),
        node_friction=np.repeat(node_frictions, counts) if any(node_frictions) else None,
        **{
            name: np.repeat([getattr(friction, name) for friction in frictions], segments)
            for name in ("parallel", "perpendicular", "rotational", "extensional")
        },
    )


def fixed_nodes(system, placed):
    """Whether nodes have mass zero in the System: a list of bools, filament by filament, control points behind nodes.

    InputError if a node is a virtual site, or all nodes of a filament have mass zero.
    """
    fixed = []
    for number, filament in enumerate(placed.filaments):
        label, particles = filament_label(number, filament), placed.particles_of(number)
        virtual = [particle for particle in particles if system.isVirtualSite(int(particle))]
        if virtual:
            raise InputError(f"{label}: particle {virtual[0]} is a node and cannot be a virtual site.")
        massless = [_mass(system, particle) == 0.0 for particle in particles]
        if all(massless):
            raise InputError(f"{label} has only nodes of mass zero: leave at least one free to move.")
        fixed.extend(massless)
    return fixed


def friction_of_segments(filament, viscosity, temperature):
    """SegmentFriction of the segments of a filament as engines have it: none where nodes have all of the friction."""
    if filament.type.node_friction > 0.0:
        return SegmentFriction(0.0, 0.0, 0.0, 0.0)
    return filament.type.segment_friction(viscosity, temperature, filament.segments)


def describe_lengths(filaments):
    """Rest lengths of all segments, and by how much each may be longer or shorter: two (segments,) arrays in nm."""
    rest_lengths = [filament.type.segment_lengths(filament.segments, filament.closed) for filament in filaments]
    ranges = [np.full(filament.segments, filament.type.maximum_extension or np.inf) for filament in filaments]
    return np.concatenate(rest_lengths), np.concatenate(ranges)


def _mass(system, particle):
    return system.getParticleMass(int(particle))._value
