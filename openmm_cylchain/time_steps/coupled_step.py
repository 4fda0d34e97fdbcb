"""The recommended step of links and contacts that are in the equations of implicit schemes.

Their stiffness does not bound it. What they join or keep apart does: two places that diffuse with the frictions z1 and
z2 move against each other by the mean square 2 k_B T dt (1/z1 + 1/z2) along each axis in a step. That should stay below
(0.6 d)^2, where d is the rest length of a link, whose direction a step would lose otherwise, or the distance at which
two filaments touch, which would often be predicted on the wrong sides of each other. Harmonic links of rest length zero
have no direction, and do not bind. FENE links always have one: d of those of rest length zero is their length in
equilibrium, (3 k_B T/k)^(1/2), or their maximum extension if that is less. What holds a place on a curved surface, or
keeps it outside of one, is as a link to its centre of curvature, with the least radius of curvature for d.

A place in contact moves as a segment does, or as the end of a filament that is short: that of a rod of n segments has
the mobility (1/zeta + l0^2/(4 zeta_r))/n across it, with the friction zeta and zeta_r of a segment that moves and
turns, which is four times that of its middle.

A link that joins places which contacts or a wall push moves their gaps within the step, which these do not know of. The
two are springs in series, k and kc: energies of contacts come out too large by some 0.05 of (mu_1 + mu_2) dt k kc/(k +
kc), with the mobilities of the places as in contact. Measured for pairs of rods on a link with a rest length, over
draws of the same energies: 0.046 to 0.052 for rods of 100 nm with k from 0.25 to 5 and kc of 0.1 or 0.38 pN/nm, links
of 35 nm; 0.034 for rods of 200 nm; the length of the link is of no account. The product may be 0.6: at 1.2, links have
5 % too much energy, and rods are too parallel. Longer steps, as those that networks of long filaments take, have hard
contacts, of whose energies nothing is promised.

Measured for F-actin in segments of 100 nm: the distribution of gaps beyond 10 nm is right to 5 % at that step, for
contacts of 30 nm; beyond it, more and more steps must be divided.
"""

import math
from typing import cast

import numpy as np
import openmm

from ..couplings.capsule_contacts import as_capsule_contact_force
from ..couplings.crosslinks import Crosslinks
from ..couplings.walls import as_filament_wall_force
from ..filaments.collection import FilamentCollection
from ..units.quantities import thermal_energy
from ..units.types import FloatArray, Numbers
from .coupled_forces import CoupledForces
from .hard_contacts import longest_resolving_step
from .other_particles import describe_beside_filaments
from .time_step import TimeStep

RELATIVE_MOTION = 0.6
"""The largest standard deviation of relative motion in a step, over the distance."""

RELATIVE_MOTION_OF_SPHERES = 0.2
"""The same of two spheres, of which the one is near the other in all directions: see ``_spheres_in_contact``."""

LARGEST_LINKED_MOTION = 0.6
"""The largest product of a step, the mobility of two places, and the stiffness of a link in series with a contact."""

_REASON = "{what}: {motion} by {share:g} of {distance}, {value:.3g} nm, in an implicit step"
_OF_TWO, _OF_ONE = "the two may diffuse against each other", "it may diffuse"


def steps_of_couplings(
    filaments: FilamentCollection,
    system: openmm.System,
    temperature: float,
    particle_friction: Numbers | None = None,
    coupled_forces: CoupledForces | None = None,
) -> list[TimeStep]:
    """The TimeSteps of the links and contacts of a System with filaments; none where they do not bind.

    The temperature is that of the bath, in K; ``particle_friction`` is as for ``Filaments.create_integrator``. The
    CoupledForces of the System are given if they are known.
    """
    forces = coupled_forces or CoupledForces(system)
    coupled = [(index, force) for index, force in enumerate(system.getForces()) if forces.includes(index)]
    kT = thermal_energy(temperature)
    if not coupled or kT == 0.0:
        return []
    mobility = mobilities(filaments, system, particle_friction)
    mobility_in_contact = mobilities_of_ends(filaments, mobility)
    steps = []
    for index, force in coupled:
        label = f"{force.getName()} (force {index})"
        capsules = as_capsule_contact_force(force)
        wall = as_filament_wall_force(force)
        if capsules is not None:
            found = [_contacts(capsules, mobility_in_contact), _spheres_in_contact(capsules, filaments, mobility)]
        elif wall is not None:
            found = [_curved_wall(wall, mobility)]
        else:
            found = [_links(force, filaments, mobility, kT)]
        motion = _OF_TWO if wall is None else _OF_ONE
        for distance, total, what, of_what, share in filter(None, found):
            bound = distance**2 / (2.0 * kT * total)
            reason = _REASON.format(what=what, motion=motion, share=share, distance=of_what, value=distance)
            name = f"{label}: {what}"
            allowed = float(share**2 * bound)
            steps.append(TimeStep(allowed, f"{label}: {reason}", {name: float(bound)}, {name: allowed}))
    return steps


def steps_of_linked_contacts(
    filaments: FilamentCollection,
    system: openmm.System,
    particle_friction: Numbers | None,
    coupled_forces: CoupledForces,
    longest: float,
) -> list[TimeStep]:
    """The TimeSteps of links that move the gaps of contacts and walls, with scheme "implicit".

    None where steps of ``longest`` in ps, which all else allows, take contacts for hard ones: their energies do not
    tell of links then.
    """
    coupled = [(index, force) for index, force in enumerate(system.getForces()) if coupled_forces.includes(index)]
    links = [one for one in coupled if Crosslinks.of_force(one[1]) is not None]
    pushing = [(index, force, _stiffness_of_surface(force)) for index, force in coupled]
    if not links or max(one[2] for one in pushing) == 0.0:
        return []
    index, pusher, contact = max(pushing, key=lambda one: one[2])
    capsules = [one for one in (as_capsule_contact_force(force) for _, force in coupled) if one is not None]
    if any(longest > longest_resolving_step(filaments, system, one, particle_friction) for one in capsules):
        return []
    mobility = mobilities(filaments, system, particle_friction)
    ends = mobilities_of_ends(filaments, mobility)
    other = f"{pusher.getName()} (force {index})"
    return [_step_with_contacts(*one, other, contact, filaments, ends) for one in links]


def _stiffness_of_surface(force):
    wall = as_filament_wall_force(force)
    if wall is not None and wall.getSide() == "surface":
        return 0.0
    surface = as_capsule_contact_force(force) or wall
    return 0.0 if surface is None else surface.getStiffness()._value


def _step_with_contacts(index, force, other, contact, filaments, mobility):
    # Of the link whose spring in series with that of a contact, or a wall, relaxes fastest.
    links = cast(Crosslinks, Crosslinks.of_force(force))
    numbers, stiffness, _, _, first, second = _rows_of(links, filaments, mobility)
    if len(numbers):
        # Of all links on the same segment: three rods in a loop need the steps of twice the stiffness.
        nodes = links.table(None).places.pairs[:, :2]
        on_segment = np.bincount(nodes[nodes >= 0], np.repeat(stiffness, 2)[nodes.ravel() >= 0])
        stiffness = np.where(nodes >= 0, on_segment[nodes], 0.0).max(axis=1)
    rates = (first + second) * stiffness * contact / (stiffness + contact)
    worst = int(np.argmax(rates))
    what = f"{force.getName()} (force {index}): {_name_of(numbers, worst)}"
    name = f"{what} with {other}"
    bound = 1.0 / float(rates[worst]) if rates[worst] > 0.0 else math.inf
    reason = (
        f"{what}: beside contacts or walls, {other}, it moves their gaps within an implicit step, after which their "
        "energies may be 5 % off"
    )
    return TimeStep(LARGEST_LINKED_MOTION * bound, reason, {name: bound}, {name: LARGEST_LINKED_MOTION * bound})


def mobilities(filaments: FilamentCollection, system: openmm.System, particle_friction: Numbers | None) -> FloatArray:
    """Of all particles of a System, across segments; zero for those that do not move. In nm^2 mol/(kJ ps).

    Of beam elements, that of the end of one.
    """
    mobility = np.zeros(system.getNumParticles())
    for filament, nodes in zip(filaments, filaments.node_indices):
        friction = filament.type.segment_friction(filaments.viscosity, filaments.temperature, filament.segments)
        whole = 1.0 / max(friction.perpendicular, filament.type.node_friction)
        mobility[nodes] = filament.type.segment_kind.end_mobility * whole
    for particle, attachment in zip(filaments.attachment_indices, filaments.attachments):
        mobility[particle] = mobility[filaments.node_indices[attachment.filament][0]]
    others, frictions = describe_beside_filaments(system, filaments, particle_friction)
    mobility[others] = 1.0 / np.asarray(frictions, dtype=float)
    return mobility


def mobilities_of_ends(filaments: FilamentCollection, mobility: FloatArray) -> FloatArray:
    """The same, and of ends of filaments that are so short that they turn, from what ``mobilities`` gives."""
    result = mobility.copy()
    for filament, nodes in zip(filaments, filaments.node_indices):
        friction = filament.type.segment_friction(filaments.viscosity, filaments.temperature, filament.segments)
        if filament.closed or not (friction.perpendicular > 0.0 and friction.rotational > 0.0):
            continue
        length = filament.type.segment_lengths(filament.segments, filament.closed).max()
        end = (1.0 / friction.perpendicular + length**2 / (4.0 * friction.rotational)) / filament.segments
        result[nodes] = np.maximum(result[nodes], end)
    return result


def _contacts(force, mobility):
    # The pair that diffuses most over its distance: of all, as good as the worst capsule with the worst other one.
    capsules = [(force.getChainParticles(i)[0], force.getChainDiameter(i)._value) for i in range(force.getNumChains())]
    capsules += [(force.getSphereParticle(i), force.getSphereDiameter(i)._value) for i in range(force.getNumSpheres())]
    kinds = np.array(sorted({(float(mobility[particle]), diameter) for particle, diameter in capsules}))
    return _worst_pair(kinds, "segments in contact", RELATIVE_MOTION) if force.getNumChains() else None


def _spheres_in_contact(force, filaments, mobility):
    # With the stiffness that crossing for 40 k_B T takes, energies of pairs under a load and of dense boxes are right
    # within 3 % then; at 0.35, one step in twenty is divided in a dense box.
    spheres = [(force.getSphereParticle(i), force.getSphereDiameter(i)._value) for i in range(force.getNumSpheres())]
    kinds = sorted({(float(mobility[particle]), diameter) for particle, diameter in spheres})
    owners = {int(particle): -1 - body for body, own in enumerate(filaments.body_indices) for particle in own}
    if len({owners.get(particle, particle) for particle, _ in spheres}) < 2:
        return None
    return _worst_pair(np.array(kinds), "spheres in contact", RELATIVE_MOTION_OF_SPHERES)


def _worst_pair(kinds, what, share):
    # Of mobilities and diameters (n, 2), any of which may touch each other.
    total = kinds[:, 0] + kinds[:, :1]
    distance = 0.5 * (kinds[:, 1] + kinds[:, 1][:, None])
    worst = _worst(distance.ravel(), total.ravel())
    if worst is None:
        return None
    return distance.ravel()[worst], total.ravel()[worst], what, "the contact distance", share


def _curved_wall(force, mobility):
    # What is kept inside comes back from wherever it gets to.
    radius = _least_radius(force)
    largest = max((mobility[force.getParticle(own)] for own in range(force.getNumParticles())), default=0.0)
    if force.getSide() == "inside" or math.isinf(radius) or largest == 0.0:
        return None
    what = "what it holds" if force.getSide() == "surface" else "what it keeps outside"
    return radius, largest, what, "the radius of curvature", RELATIVE_MOTION


def _least_radius(force):
    # In nm, of a surface with one face.
    shape, _, vector, length = (getattr(value, "_value", value) for value in force.getRegion())
    if shape == "ellipsoid":
        return min(vector) ** 2 / max(vector)
    return math.inf if shape == "plane" else float(length)


def _links(force, filaments, mobility, kT):
    links = Crosslinks.of_force(force)
    if links is None:
        return None
    numbers, stiffness, rest, extension, first, second = _rows_of(links, filaments, mobility)
    # A FENE link has a direction: without a rest length, it is as long as it is in equilibrium.
    thermal = np.sqrt(3.0 * kT / stiffness)
    of_fene = (rest == 0.0) & np.isfinite(extension)
    distance = np.where(of_fene, np.minimum(extension, thermal), rest)
    worst = _worst(distance, first + second)
    if worst is None:
        return None
    what = _name_of(numbers, worst)
    of_what = "its rest length"
    if of_fene[worst]:
        of_what = "its length in equilibrium" if thermal[worst] < extension[worst] else "its maximum extension"
    return distance[worst], (first + second)[worst], what, of_what, RELATIVE_MOTION


def _rows_of(links, filaments, mobility):
    # Numbers, stiffnesses, rest lengths, maximum extensions, and mobilities of both places.
    table = links.table(None)
    if len(table):
        places = table.places
        sides = (np.where(places.pairs[:, side] >= 0, mobility[places.pairs[:, side]], 0.0) for side in (0, 1))
        return table.numbers, table.stiffness, table.rest_length, table.maximum_extension, *sides
    # Those to come may join any two.
    values = (np.array([value]) for value in (links.default_stiffness, *links.default_lengths))
    largest = np.sort([mobility[nodes[0]] for nodes in filaments.node_indices])[::-1]
    return (), *values, largest[:1], largest[-1:] if len(largest) == 1 else largest[1:2]


def _name_of(numbers, row):
    return f"crosslink {numbers[row]}" if len(numbers) else "a crosslink to come"


def _worst(distance, total):
    moving = (distance > 0.0) & (total > 0.0)
    if not np.any(moving):
        return None
    return int(np.argmax(np.where(moving, total / np.where(moving, distance, 1.0) ** 2, -math.inf)))
