"""Contact of filaments whose segments are capsules: cylinders with round ends, without beads and without gaps."""

from __future__ import annotations

import itertools
import math
import warnings
from typing import Any

import numpy as np
import openmm

from ..engine_choice import available_engines, choose_engine
from ..errors import ContactWarning, InputError
from ..filaments.chain_type import ChainType
from ..filaments.collection import FilamentCollection, held_numbers, require_filaments
from ..filaments.filaments_that_take_part import FilamentsThatTakePart
from ..filaments.grown import longest_segment
from ..filaments.twist import has_twist
from ..units.quantities import (
    LARGEST_INT,
    LENGTH,
    STIFFNESS,
    positive,
    thermal_energy,
    true_or_false,
    whole_number,
)
from ..units.types import Indices, IntArray, Numbers, Scalar
from .contacts import SAFE_BARRIER, filament_diameters, outside_particles, particle_diameters
from .periodicity import default_box, is_periodic
from .planar_crossings import find_planar_crossing

CAPSULE_BARRIER = 40.0
"""Energy of two capsules whose axes meet in k_B T, with the stiffness that ``default_capsule_stiffness`` gives."""

_SMALLEST, _LARGEST = 1e-6, 1e6
"""Of diameters in nm."""

_LEAST_PIECES = 4
_DEEPEST_BOW = 0.1

# Along the contour, in diameters. Segments that are nearer do not touch each other.
_EXCLUDED_DIAMETERS = 2.0
# Of filaments with twist, which torque may fold: two turns are lost where they pass through themselves.
_EXCLUDED_DIAMETERS_WITH_TWIST = 1.5


def default_capsule_stiffness(diameter: Scalar, temperature: Scalar) -> float:
    """Stiffness of a contact that two filaments cross for 40 k_B T: k = 80 k_B T/d^2, in kJ/(mol nm^2)."""
    diameter = positive(diameter, LENGTH, "diameter")
    _refuse_size(diameter)
    return 2.0 * CAPSULE_BARRIER * thermal_energy(temperature) / diameter**2


def _refuse_size(diameter):
    if not _SMALLEST <= diameter <= _LARGEST:
        raise InputError(f"A contact diameter of {diameter:g} nm is none of filaments: check its unit.")


def contact_spacing(filament_type: ChainType, diameter: Scalar, temperature: Scalar) -> float:
    """Spacing of the beads of a filament of beam elements, in nm, with which its capsules are on its curve.

    An element of length h that bends by the angle a is ``h a/(8 n^2)`` away from the n straight pieces between its
    beads. That is a tenth of the diameter at most, for the angle of thermal fluctuations, ``(2 h k_B T/EI)^(1/2)``; at
    least four pieces.
    """
    element = filament_type.beam_element(temperature)
    angle = math.sqrt(2.0 * element.length * thermal_energy(temperature) / element.rigidity)
    deepest = _DEEPEST_BOW * positive(diameter, LENGTH, "diameter")
    return element.length / max(_LEAST_PIECES, math.ceil(math.sqrt(element.length * angle / (8.0 * deepest))))


def capsule_contact_force(
    filaments: FilamentCollection,
    system: openmm.System,
    diameter: Numbers | None = None,
    stiffness: Scalar | None = None,
    particles: Indices = (),
    particle_diameter: Numbers | None = None,
    excluded_neighbors: int | None = None,
    periodic: bool | None = None,
    numbers: Indices | None = None,
) -> Any:
    """A repulsion between segments of filaments, and other particles as spheres: of all of them with each other.

    Segments are capsules: all points within half the diameter of the line between their ends. Where two of them
    overlap, or two spheres, or a capsule and a sphere, the energy is ``(k/2) g^2`` for the gap g, the distance of the
    lines less the mean of the diameters. Unlike the beads of ``contact_force``, capsules have no gaps and are smooth
    along the filament, two that cross cost ``(k/2) d^2`` at whatever place and angle, and the force takes a fraction
    of the time.

    Two segments touch where they are nearest to each other, and if they are nearly parallel (within 1.8 degrees), at
    both ends of their overlap with k/2 each. What neighbouring segments see of one thing counts once, so that nothing
    is felt of joints. Forces act on the ends of segments, in proportion to where they touch.

    A filament of beam elements is covered by the capsules between its neighbouring beads (``Filaments.add_beads``),
    which are on its curve: straight pieces, n of each element. An element that bends by the angle a is up to
    ``h a/(8 n^2)`` away from them. Forces act on its nodes and control points as on those of the beads' places.

    The implicit schemes have it in their equations, and divide a step in which filaments would cross; others take it at
    the start of a step. ``Filaments.recommended_time_step(system=system)`` says which step it allows.

    Parameters
    ----------
    filaments : Filaments
        In the System. Those of beam elements have beads, others need none.
    system : openmm.System
        With all of its particles. The force is not added to it.
    diameter : length, or array of lengths, one for each filament that takes part
        Distance of two axes at which filaments of the same diameter touch: that of the cylinders, or more. Nothing
        where there are only bodies.
    stiffness : energy/length^2, optional
        k; that of ``default_capsule_stiffness`` for the thinnest filament if not given: crossing costs 40 k_B T. That
        of the smallest sphere where there are no filaments. ``setStiffness`` and ``updateParametersInContext`` change
        it.
    particles : sequence of int
        Particles outside filaments that take part, as spheres, those of rigid bodies among them. All push each other,
        but not those of one body, which are excluded: give no force of your own to the same pairs.
    particle_diameter : length, or array of lengths, one for each of ``particles``
    excluded_neighbors : int, optional
        Segments of one filament whose numbers differ by no more than this do not touch each other. If not given: those
        that are within two diameters along the contour, or one and a half of filaments with twist, whose tight loops
        must not lose turns there; at least 1.
    periodic : bool, optional
        Whether distances are those of nearest images. If not given: whether the System has a box, or another force
        that is periodic.
    numbers : sequence of int, optional
        Of the filaments that take part; nothing touches others. All of them if not given.

    Returns
    -------
    CylinderChainContactForce
        To be added to the System. It works where the compiled engine does. Its ``addExclusion`` lets further pairs
        not touch each other.

    Raises
    ------
    InputError
        If the compiled engine is missing, a filament or a particle does not exist, or a particle is one of the
        filaments', a diameter or stiffness is not positive, nothing could touch, the box is narrower than twice a
        segment with its diameter, or a filament of beam elements has no beads. Implicit schemes need a box as wide as
        twice a segment with two diameters: a Context with a narrower one is refused.

    Warns
    -----
    ContactWarning
        If filaments, or spheres, can pass through each other: if ``(k/2) d^2`` is below 25 k_B T for the thinnest. If
        planar filaments were added across each other: nothing in their plane takes them apart.
    """
    choose_engine("compiled")
    from .. import plugin

    require_filaments(filaments)
    spheres = outside_particles(filaments, system, particles)
    filaments = FilamentsThatTakePart(filaments, held_numbers(numbers, len(filaments)))
    diameters = np.zeros(0)
    if len(filaments) or diameter is not None:
        diameters = filament_diameters(diameter, len(filaments))
    sphere_diameters = particle_diameters(particles, particle_diameter)
    for own in (*diameters, *sphere_diameters):
        _refuse_size(own)
    if not len(diameters) and len(spheres) < 2:
        raise InputError("There are no filaments that could touch, and no two spheres.")
    _require_beads(filaments, diameters)
    if stiffness is None:
        if filaments.temperature == 0.0:
            raise InputError("At a temperature of zero, a contact needs a stiffness.")
        thinnest = diameters if len(diameters) else sphere_diameters
        stiffness = default_capsule_stiffness(thinnest.min(), filaments.temperature)
    stiffness = positive(stiffness, STIFFNESS, "stiffness")
    if excluded_neighbors is not None:
        excluded_neighbors = whole_number(excluded_neighbors, 0, "excluded_neighbors", LARGEST_INT)
    periodic = is_periodic(system) if periodic is None else true_or_false(periodic, "periodic")
    if periodic:
        _check_box(system, filaments, max([*diameters, *sphere_diameters]))
    _warn_of_barrier(filaments, diameters, sphere_diameters, stiffness)
    _warn_of_planar_crossing(filaments, default_box(system) if periodic else None)
    force = plugin.CylinderChainContactForce(stiffness)
    force.setUsesPeriodicBoundaryConditions(periodic)
    for filament, ends, value in zip(filaments, _ends_of_capsules(filaments), diameters):
        neighbors = excluded_neighbors
        if neighbors is None:
            shortest = _capsule_lengths(filament, ends).min()
            diameters_apart = _EXCLUDED_DIAMETERS_WITH_TWIST if has_twist(filament.type) else _EXCLUDED_DIAMETERS
            neighbors = max(1, math.ceil(diameters_apart * value / shortest - 1e-9))
        force.addChain([int(end) for end in ends], float(value), neighbors, filament.closed)
    for particle, value in zip(spheres, sphere_diameters):
        force.addSphere(int(particle), float(value))
    _exclude_within_bodies(force, filaments, spheres)
    return force


def owners_of_chains(contacts: Any, filaments: FilamentCollection) -> IntArray:
    """Numbers of the filaments that are the chains of a CylinderChainContactForce; -1 of one that is none."""
    owners = {int(particle): one.filament for particle, one in zip(filaments.attachment_indices, filaments.attachments)}
    owners |= {int(nodes[0]): number for number, nodes in enumerate(filaments.node_indices)}
    firsts = (contacts.getChainParticles(chain)[0] for chain in range(contacts.getNumChains()))
    return np.array([owners.get(first, -1) for first in firsts], dtype=int)


def as_capsule_contact_force(force: openmm.Force) -> Any | None:
    """A force as the CylinderChainContactForce that it is, or None if it is another one."""
    if available_engines()["compiled"] is not None:
        return None
    from .. import plugin

    if not plugin.CylinderChainContactForce.isinstance(force):
        return None
    return plugin.CylinderChainContactForce.cast(force)


def _exclude_within_bodies(force, filaments, spheres):
    owners = {int(particle): body for body, own in enumerate(filaments.body_indices) for particle in own}
    of_bodies: dict[int, list[int]] = {}
    for number, particle in enumerate(spheres):
        if int(particle) in owners:
            of_bodies.setdefault(owners[int(particle)], []).append(number)
    for own in of_bodies.values():
        for one, other in itertools.combinations(own, 2):
            force.addExclusion(-1, one, -1, other)


def _require_beads(filaments, diameters):
    for number, filament, beads, own in zip(filaments.numbers, filaments, filaments.bead_indices, diameters):
        if not (filament.type.segment_kind.straight or len(beads)):
            spacing = contact_spacing(filament.type, own, filaments.temperature)
            raise InputError(
                f"Filament {number} ({filament.type.name}) has beam elements, whose capsules lie between beads on its "
                f"curve: call filaments.add_beads({number}, {spacing:g}) before the filaments are built."
            )


def _ends_of_capsules(filaments):
    return [
        filament.type.segment_kind.particles_along(nodes, beads)
        for filament, nodes, beads in zip(filaments, filaments.node_indices, filaments.bead_indices)
    ]


def _capsule_lengths(filament, ends):
    # At rest; of a filament that grows, as it is at the start.
    if filament.type.segment_kind.straight:
        return filament.type.segment_lengths(filament.segments, filament.closed)
    lengths = filament.type.segment_lengths(filament.segments, filament.closed)
    return lengths * (filament.segments / (len(ends) - (not filament.closed)))


def _longest_capsule(filament, ends):
    if filament.growth is not None:
        return longest_segment(filament)
    return float(_capsule_lengths(filament, ends).max())


def _check_box(system, filaments, diameter):
    a, b, c = default_box(system)
    volume = abs(np.dot(a, np.cross(b, c)))
    narrowest = min(volume / np.linalg.norm(np.cross(*pair)) for pair in ((b, c), (c, a), (a, b)))
    lengths = [_longest_capsule(*each) for each in zip(filaments, _ends_of_capsules(filaments))]
    longest = max(lengths, default=0.0)
    needed = 2.0 * (longest + diameter)
    if narrowest < needed:
        between = f" between segments of {longest:g} nm" if lengths else ""
        raise InputError(
            f"The periodic box is {narrowest:g} nm wide between two of its faces: contacts of {diameter:g} nm{between} "
            f"need {needed:g} nm. Take a larger box{' or shorter segments' if lengths else ''}."
        )


def _warn_of_barrier(filaments, diameters, sphere_diameters, stiffness):
    kT = thermal_energy(filaments.temperature)
    spheres = range(len(sphere_diameters)) if len(sphere_diameters) > 1 else ()
    for what, numbers, own in (("Filament", filaments.numbers, diameters), ("Sphere", spheres, sphere_diameters)):
        if not len(numbers):
            continue
        thinnest = int(np.argmin(own))
        barrier = 0.5 * stiffness * own[thinnest] ** 2
        if barrier < SAFE_BARRIER * kT:
            warnings.warn(
                f"{what} {numbers[thinnest]} has a contact diameter of {own[thinnest]:.3g} nm: others of its kind can "
                f"pass through it for {barrier / kT:.3g} k_B T. Use a larger stiffness.",
                ContactWarning,
                stacklevel=3,
            )


def _warn_of_planar_crossing(filaments, box):
    found = find_planar_crossing(filaments, box)
    if found is not None:
        one, other = (filaments.numbers[number] for number in (found.filament, found.other_filament))
        warnings.warn(
            f"Segment {found.segment} of filament {one} and segment {found.other_segment} of filament {other} cross "
            "each other in one plane. Planar filaments stay so until an end comes out, and what long steps give of "
            "them until then is wrong. Place them where they do not cross.",
            ContactWarning,
            stacklevel=3,
        )
