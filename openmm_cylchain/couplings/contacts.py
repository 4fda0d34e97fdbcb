"""Contact of filaments: beads along them, what beads do not see, and a repulsion that keeps filaments apart.

Beads are attachment points at equal distances along a filament, which ``Filaments.add_beads`` puts there. OpenMM's
nonbonded forces act on them, with neighbour lists, periodic boxes and on every platform, and the ends of the segments
move accordingly.
"""

from __future__ import annotations

import math
import warnings

import numpy as np
import numpy.typing as npt
import openmm

from ..errors import ContactWarning, InputError
from ..filaments.attachments import SAME_PLACE
from ..filaments.collection import FilamentCollection, require_filaments
from ..units.quantities import (
    LENGTH,
    STIFFNESS,
    in_units_of,
    non_negative,
    positive,
    require_kind,
    shown,
    thermal_energy,
    true_or_false,
    whole_numbers,
)
from ..units.types import FloatArray, Indices, IntArray, Numbers, Scalar
from .periodicity import default_box, is_periodic

CONTACT_NAME = "Contact"
CONTACT_STIFFNESS = "contact_stiffness"
"""Name of the Context parameter that holds the stiffness of a contact force."""

BARRIER = 20.0
"""Energy of two coinciding beads in k_B T, with the stiffness that ``default_stiffness`` gives."""

SAFE_BARRIER = 25.0
"""In k_B T: a network pays it in fewer than one of 1e10 encounters."""

_WITH_EXCLUSIONS = (openmm.NonbondedForce, openmm.CustomNonbondedForce, openmm.CustomGBForce)

# OpenMM's CPU platform looks for neighbours within 5/4 of the cutoff, and again when particles have moved by 1/8 of it.
# Looking is what costs most, so three diameters take a third of the time that one takes.
_CUTOFF_DIAMETERS = 3.0

_MOST_BEADS = 100
"""Of a filament within the diameter of one."""


def excluded_pairs(filaments: FilamentCollection, distance: Scalar = 0.0) -> IntArray:
    """Pairs of particles of one filament that nonbonded forces should leave alone.

    A pair has a bead, or another attachment point, and a bead, an attachment point or a node of the same segment, of a
    neighbouring one, or within a distance along the contour. (Nodes and nodes are left to you: nothing that this
    package adds acts between them.) The number of pairs is proportional to that of beads.

    Parameters
    ----------
    filaments : Filaments
        In a System.
    distance : length
        Along segments of rest length.

    Returns
    -------
    (pairs, 2) int array
        Particle indices, the lower first.
    """
    require_filaments(filaments)
    distance = non_negative(distance, LENGTH, "distance")
    beads_and_points: list[list[tuple[int, int, float]]] = [[] for _ in range(len(filaments))]
    for particle, attachment in zip(filaments.attachment_indices, filaments.attachments):
        beads_and_points[attachment.filament].append((int(particle), attachment.segment, attachment.fraction))
    pairs = [np.zeros((0, 2), dtype=int)]
    for number, points in enumerate(beads_and_points):
        if points:
            pairs.append(_excluded_in(filaments[number], filaments.node_indices[number], points, distance))
    return np.concatenate(pairs)


def _excluded_in(filament, nodes, points, distance):
    # Every place belongs to the segments ``first`` to ``last``: two of them at a joint.
    particles, segments, fractions = (np.array(column) for column in zip(*points))
    particles = np.concatenate([nodes, particles])
    place = np.concatenate([np.arange(len(nodes)), segments + fractions])
    is_node = np.arange(len(place)) < len(nodes)
    order = np.argsort(place, kind="stable")
    particles, place, is_node = particles[order], place[order], is_node[order]
    total = len(place)
    if filament.closed:
        # What lies behind the last place of a ring comes once more.
        place = np.concatenate([place, place + filament.segments])
    first = np.ceil(place - SAME_PLACE).astype(int) - 1
    last = np.floor(place + SAME_PLACE).astype(int)
    if not filament.closed:
        first, last = np.maximum(first, 0), np.minimum(last, filament.segments - 1)
    # Both grow with the place, so those that a place does not see follow it without a gap.
    shortest = filament.type.segment_lengths(filament.segments, filament.closed).min()
    reach = place + distance / shortest + SAME_PLACE
    end = np.maximum(np.searchsorted(first, last + 1, side="right"), np.searchsorted(place, reach, side="right"))
    counts = np.minimum(end - np.arange(len(place)) - 1, total - 1)[:total]
    one = np.repeat(np.arange(total), counts)
    other = (one + 1 + np.arange(len(one)) - np.repeat(np.cumsum(counts) - counts, counts)) % total
    wanted = ~(is_node[one] & is_node[other])
    pairs = np.sort(np.stack([particles[one[wanted]], particles[other[wanted]]], axis=1), axis=1)
    # In a small ring, two places may be in reach of each other both ways around.
    return np.unique(pairs, axis=0) if filament.closed else pairs


def add_exclusions(force: openmm.Force, pairs: npt.ArrayLike) -> None:
    """Exclude pairs of particles from a nonbonded force; those that are excluded stay so.

    A NonbondedForce gets exceptions without interaction. Those that it has, for instance between third neighbours of a
    molecule, stay as they are.

    Parameters
    ----------
    force : openmm.NonbondedForce, openmm.CustomNonbondedForce or openmm.CustomGBForce
    pairs : (pairs, 2) int array
        Particle indices, such as ``excluded_pairs`` returns.

    Raises
    ------
    InputError
        For another force, or pairs that are none.
    """
    if not isinstance(force, _WITH_EXCLUSIONS):
        raise InputError(
            f"force must be one of {', '.join(one.__name__ for one in _WITH_EXCLUSIONS)}, but is {shown(force)}."
        )
    try:
        array = np.asarray(pairs)
    except ValueError:
        array = np.asarray(None)
    if array.size == 0 and array.dtype.kind in "iuf":
        return
    pairs = array
    if pairs.ndim != 2 or pairs.shape[1] != 2 or pairs.dtype.kind not in "iu":
        raise InputError(f"pairs must be an int array (pairs, 2), but has the shape {pairs.shape} of {pairs.dtype}.")
    there = _exclusions(force)
    for pair in pairs.tolist():
        pair = (min(pair), max(pair))
        if pair in there:
            continue
        there.add(pair)
        if isinstance(force, openmm.NonbondedForce):
            force.addException(*pair, 0.0, 1.0, 0.0)
        else:
            force.addExclusion(*pair)


def _exclusions(force):
    if isinstance(force, openmm.NonbondedForce):
        pairs = (force.getExceptionParameters(index)[:2] for index in range(force.getNumExceptions()))
    else:
        pairs = (force.getExclusionParticles(index) for index in range(force.getNumExclusions()))
    return {(min(pair), max(pair)) for pair in pairs}


def share_exclusions(system: openmm.System) -> None:
    """Give all nonbonded forces of a System the same exclusions: each gets those of all others.

    OpenMM's CPU and GPU platforms want that: a Context with a contact force beside a NonbondedForce, a
    CustomNonbondedForce or a CustomGBForce fails with "All Forces must have identical exclusions" otherwise. Call it
    when all forces are in the System.

    (GPU platforms also want one cutoff for all such forces of a force group: put the contact force into another one by
    ``setForceGroup``. And a System of which some nonbonded forces have a cutoff and others have none is refused.)

    Parameters
    ----------
    system : openmm.System
        Its forces are changed in place.
    """
    require_kind(system, openmm.System, "system")
    forces = [force for force in system.getForces() if isinstance(force, _WITH_EXCLUSIONS)]
    everything = sorted(set().union(*(_exclusions(force) for force in forces)))
    for force in forces:
        add_exclusions(force, np.array(everything, dtype=int))


def default_stiffness(diameter: Scalar, temperature: Scalar) -> float:
    """Stiffness of a contact whose energy is 20 k_B T where two beads coincide: k = 40 k_B T/d^2, in kJ/(mol nm^2)."""
    return 2.0 * BARRIER * thermal_energy(temperature) / positive(diameter, LENGTH, "diameter") ** 2


def crossing_barrier(diameter: Scalar, spacing: Scalar, stiffness: Scalar) -> float:
    """The least energy, in kJ/mol, that two filaments pay to cross at a right angle.

    Their beads are in one plane then, ``(k/2) (d - r)^2`` for each pair at a distance r below d, and the sum depends
    on where the rows cross. It is zero if the beads are so far apart that the rows pass through each other's gaps,
    which they are from sqrt(2) d on.

    Parameters
    ----------
    diameter, spacing : length
        Contact diameter of the beads, and the distance of neighbours on a filament.
    stiffness : energy/length^2
    """
    diameter = positive(diameter, LENGTH, "diameter")
    spacing = positive(spacing, LENGTH, "spacing")
    stiffness = positive(stiffness, STIFFNESS, "stiffness")
    if diameter > _MOST_BEADS * spacing:
        raise InputError(f"spacing is {spacing:g} nm, which is too small beside the diameter of {diameter:g} nm.")
    number = math.ceil(diameter / spacing) + 1
    row = np.arange(-number, number + 1)
    offset = np.linspace(0.0, 0.5, 26)
    squares = (spacing * (row + offset[:, None])) ** 2
    distance = np.sqrt(squares[:, None, :, None] + squares[None, :, None, :])
    energy = 0.5 * stiffness * np.maximum(0.0, diameter - distance) ** 2
    return float(energy.sum(axis=(2, 3)).min())


def contact_force(
    filaments: FilamentCollection,
    system: openmm.System,
    diameter: Numbers,
    stiffness: Scalar | None = None,
    particles: Indices = (),
    particle_diameter: Numbers | None = None,
    periodic: bool | None = None,
) -> openmm.CustomNonbondedForce:
    """A repulsion between beads of different filaments, and between beads and other particles.

    The energy of a pair is ``(k/2) (d - r)^2`` at a distance r below d, the mean of the two diameters, and zero beyond:
    of all potentials whose curvature, which limits the step, is at most k, this one is highest at r = 0. Force and
    energy are bounded, so beads that come close, or overlap to begin with, are not thrown apart as by a Lennard-Jones
    core. Only in exactly one point would the force have no direction: let no two beads of different filaments start
    there.

    It is explicit in every scheme. ``Filaments.recommended_time_step(system=system)`` says which step it allows, or,
    before it is in a System, ``recommended_time_step`` with its diameter and stiffness.

    Beads, attachment points and nodes do not see those of the same or of neighbouring segments, or within a distance
    of two diameters along the contour. Nodes, and attachment points that are not beads, see nothing at all. With other
    nonbonded forces in the System, call ``share_exclusions``. Force and energy end at d; the cutoff is longer, so that
    OpenMM looks for neighbours less often.

    Parameters
    ----------
    filaments : Filaments
        With beads, in the System.
    system : openmm.System
        With all of its particles. The force is not added to it.
    diameter : length, or (filaments,) array of lengths
        Distance of two axes at which filaments touch: that of the cylinders, or more.
    stiffness : energy/length^2, optional
        k; that of ``default_stiffness`` for the thinnest filament if not given. The Context parameter
        "contact_stiffness" changes it.
    particles : sequence of int
        Particles outside filaments that take part.
    particle_diameter : length, or array of lengths, one for each of ``particles``
    periodic : bool, optional
        Whether distances are those of nearest images. If not given: whether the System has a box, or another force
        that is periodic.

    Returns
    -------
    openmm.CustomNonbondedForce
        To be added to the System.

    Raises
    ------
    InputError
        If there are no beads, a particle does not exist or is one of the filaments', a diameter or stiffness is not
        positive, or the box is smaller than two diameters.

    Warns
    -----
    ContactWarning
        If beads are so far apart, or so soft, that filaments can pass through each other: if ``crossing_barrier`` is
        below 25 k_B T.
    """
    require_filaments(filaments)
    require_kind(system, openmm.System, "system")
    periodic = is_periodic(system) if periodic is None else true_or_false(periodic, "periodic")
    beads = filaments.bead_indices
    if not any(len(one) for one in beads):
        raise InputError("There are no beads to touch: call add_beads before the filaments are put into a System.")
    spheres = outside_particles(filaments, system, particles)
    diameters = np.zeros(system.getNumParticles())
    for indices, value in zip(beads, filament_diameters(diameter, len(filaments))):
        diameters[indices] = value
    diameters[spheres] = particle_diameters(particles, particle_diameter)
    if stiffness is None:
        if filaments.temperature == 0.0:
            raise InputError("At a temperature of zero, a contact needs a stiffness.")
        stiffness = default_stiffness(diameters[np.concatenate(beads)].min(), filaments.temperature)
    _warn_of_gaps(filaments, diameters, positive(stiffness, STIFFNESS, "stiffness"))
    force = openmm.CustomNonbondedForce(
        f"0.5*{CONTACT_STIFFNESS}*max(0, touching-r)^2;"
        "touching=select(diameter1*diameter2, 0.5*(diameter1+diameter2), 0)"
    )
    force.setName(CONTACT_NAME)
    force.addGlobalParameter(CONTACT_STIFFNESS, positive(stiffness, STIFFNESS, "stiffness"))
    force.addPerParticleParameter("diameter")
    for value in diameters:
        force.addParticle([value])
    _set_cutoff(force, system, float(diameters.max()), periodic)
    add_exclusions(force, excluded_pairs(filaments, 2.0 * diameters[np.concatenate(beads)].max()))
    return force


def is_contact_force(force: openmm.Force) -> bool:
    """Whether a force is one that ``contact_force`` has made."""
    return isinstance(force, openmm.CustomNonbondedForce) and force.getName() == CONTACT_NAME


def _warn_of_gaps(filaments, diameters, stiffness):
    # The filament whose gaps are widest, crossed by another one of its kind.
    barriers = []
    for number, beads in enumerate(filaments.bead_indices):
        if len(beads):
            filament = filaments[number]
            intervals = len(beads) if filament.closed else len(beads) - 1
            spacing = filament.segments * filament.type.segment_length / intervals
            diameter = diameters[beads[0]]
            barriers.append((crossing_barrier(diameter, spacing, stiffness), number, spacing, diameter))
    barrier, number, spacing, diameter = min(barriers)
    kT = thermal_energy(filaments.temperature)
    if barrier < SAFE_BARRIER * kT:
        warnings.warn(
            f"Filament {number} has beads every {spacing:.3g} nm with a contact diameter of {diameter:.3g} nm: "
            f"others can pass through it for {barrier / kT:.3g} k_B T. Use a spacing of half the diameter, or a larger "
            "stiffness.",
            ContactWarning,
            stacklevel=3,
        )


def filament_diameters(diameter: Numbers, count: int) -> FloatArray:
    """Contact diameters of ``count`` filaments in nm, from one length or one for each."""
    return _positive_array(diameter, count, "diameter")


def _positive_array(value, count, name):
    values = np.asarray(in_units_of(value, LENGTH, name))
    if values.ndim and values.shape != (count,):
        raise InputError(f"{name} must be a number or have {count} entries, but has the shape {values.shape}.")
    if not np.all(values > 0.0):
        raise InputError(f"{name} must be positive, but is {values.min():g}.")
    return np.broadcast_to(values, (count,))


def particle_diameters(particles: Indices, particle_diameter: Numbers | None) -> FloatArray:
    """Contact diameters in nm of particles outside filaments."""
    if particle_diameter is None:
        if len(particles):
            raise InputError("particles need a particle_diameter.")
        return np.zeros(0)
    return _positive_array(particle_diameter, len(particles), "particle_diameter")


def outside_particles(filaments: FilamentCollection, system: openmm.System, particles: Indices) -> IntArray:
    """Particles that take part in contacts, which are none of the filaments'; an InputError if they are not there."""
    require_filaments(filaments)
    require_kind(system, openmm.System, "system")
    count = system.getNumParticles()
    filled = [*filaments.node_indices, *filaments.control_point_indices, filaments.attachment_indices]
    own = set(np.concatenate(filled).tolist())
    if max(own, default=-1) >= count:
        raise InputError("system is not the System that the filaments were put into: it has too few particles.")
    indices = whole_numbers(particles, 0, "particles")
    for index in indices:
        if index >= count:
            raise InputError(f"particles contains {index}, but the System has {count} particles.")
        if index in own:
            raise InputError(f"particles contains {index}, which belongs to a filament.")
    if len(set(indices)) < len(indices):
        twice = next(index for index in indices if indices.count(index) > 1)
        raise InputError(f"particles contains {twice} twice.")
    return np.array(indices, dtype=int)


def _set_cutoff(force, system, diameter, periodic):
    cutoff = _CUTOFF_DIAMETERS * diameter
    force.setNonbondedMethod(openmm.CustomNonbondedForce.CutoffNonPeriodic)
    if periodic:
        force.setNonbondedMethod(openmm.CustomNonbondedForce.CutoffPeriodic)
        narrowest = np.diagonal(default_box(system)).min()
        if narrowest < 2.0 * diameter:
            raise InputError(f"The periodic box is {narrowest:g} nm wide: contacts of {diameter:g} nm need twice that.")
        cutoff = min(cutoff, 0.5 * narrowest)
    force.setCutoffDistance(cutoff)
