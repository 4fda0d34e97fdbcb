"""Steps that do not resolve contacts, and take them for hard ones.

A force that lasts for an implicit step h moves a place by c. Steps with k c > 18 do not resolve a contact of the
stiffness k, with c of both filaments together: of their ends, which move most. A filament with the rigidity EI and the
friction zeta per length is moved at its end by 2^(1/2) h/(zeta w), w = (EI h/zeta)^(1/4), as a beam on a foundation,
see M. Hetenyi, Beams on Elastic Foundation, 1946; a shorter one as a rod; no place farther than a segment that is
alone.

Well below that, contacts are as soft as they are. From a quarter of it on, those of filaments along each other hold too
much energy, as segments turn within a step: by a sixth at its end in a bundle, 6 % at a quarter of it, nothing at a
tenth, against steps of a thirtieth.
"""

import math
import warnings
from typing import Any

import numpy as np
import openmm
import scipy

from ..couplings.capsule_contacts import as_capsule_contact_force, owners_of_chains
from ..errors import ContactWarning
from ..filaments.collection import FilamentCollection
from ..filaments.growth import segment_of_length
from ..units.text import format_time
from ..units.types import Numbers
from .coupled_forces import CoupledForces
from .other_particles import describe_beside_filaments

LARGEST_SOFTNESS = 18.0
"""Of k c: contacts that are softer in a step are hard ones there."""

SHARE_FOR_BUNDLES = 0.25
"""Of the longest step that resolves contacts: up to it, energies of contacts along filaments are right within 6 %."""

_SHORTEST, _LONGEST = 1e-9, 1e18  # ps


def longest_resolving_step(
    filaments: FilamentCollection, system: openmm.System, contacts: Any, particle_friction: Numbers | None
) -> float:
    """The longest implicit step, in ps, in which a ``capsule_contact_force`` of a System with filaments is not a hard
    one.

    ``particle_friction`` is as for ``Filaments.create_integrator``.
    """
    stiffness = contacts.getStiffness()._value
    chains = _chains_in_contact(filaments, contacts)
    mobility = _mobility_of_spheres(filaments, system, contacts, particle_friction)

    def excess(logarithm: float) -> float:
        step = math.exp(logarithm)
        responses = [_response_of_end(filaments, step, *chain) for chain in chains]
        return 2.0 * stiffness * max([*responses, mobility * step], default=0.0) - LARGEST_SOFTNESS

    first, last = math.log(_SHORTEST), math.log(_LONGEST)
    if excess(last) <= 0.0:
        return math.inf
    return math.exp(scipy.optimize.brentq(excess, first, last, xtol=1e-6)) if excess(first) < 0.0 else 0.0


def warn_of_hard_contacts(
    filaments: FilamentCollection,
    system: openmm.System,
    step: float,
    scheme: str,
    particle_friction: Numbers | None,
    coupled_forces: CoupledForces,
) -> None:
    """Issue a ContactWarning for each contact force that an implicit step, in ps, takes for a hard one, or nearly."""
    if scheme != "implicit":
        return
    for index, force in enumerate(system.getForces()):
        contacts = as_capsule_contact_force(force)
        if contacts is None or not coupled_forces.includes(index):
            continue
        longest = longest_resolving_step(filaments, system, contacts, particle_friction)
        label = f"{force.getName()} (force {index}): a time step of {format_time(step, 4)}"
        if step > longest:
            warnings.warn(
                f"{label} takes contacts, and walls beside them, for hard ones: what touches keeps its distance, but "
                "energies and forces of contacts and walls are too small, by up to a half. Steps of up to "
                f"{format_time(longest, 3)} resolve them.",
                ContactWarning,
                stacklevel=4,
            )
        elif contacts.getNumChains() and step > SHARE_FOR_BUNDLES * longest:
            warnings.warn(
                f"{label} gives contacts of filaments that lie along each other, as in a bundle, up to a sixth too "
                f"much energy: 6 % at {format_time(SHARE_FOR_BUNDLES * longest, 3)}, nothing at a tenth of "
                f"{format_time(longest, 3)}.",
                ContactWarning,
                stacklevel=4,
            )


def _chains_in_contact(filaments, contacts):
    # Type, segments, and whether it is closed, of each kind of filament; beam elements touch at beads. Short filaments
    # are softest: those that grow count as they are when they are shortest.
    found = [filaments[number] for number in owners_of_chains(contacts, filaments) if number >= 0]
    return set((*_at_its_shortest(filament), filament.closed) for filament in found)


def _at_its_shortest(filament):
    growth, kind = filament.growth, filament.type
    if growth is None:
        return kind, filament.segments
    monomers = growth.fewest_monomers(kind)
    segments = max(1, round(monomers / growth.monomers_per_segment(kind)))
    return segment_of_length(kind, monomers * growth.monomers.length / segments), segments


def _mobility_of_spheres(filaments, system, contacts, particle_friction):
    others, frictions = describe_beside_filaments(system, filaments, particle_friction)
    mobility = dict(zip((int(one) for one in others), 1.0 / np.asarray(frictions, dtype=float)))
    return max((mobility.get(contacts.getSphereParticle(i), 0.0) for i in range(contacts.getNumSpheres())), default=0.0)


def _response_of_end(filaments, step, kind, segments, closed):
    friction = kind.segment_friction(filaments.viscosity, filaments.temperature, segments)
    length = kind.segment_length
    arm = 0.25 * length**2 / friction.rotational if friction.rotational > 0.0 else math.inf
    of_segment = 1.0 / (1.0 / friction.perpendicular + arm) if friction.perpendicular > 0.0 else 0.0
    alone = step / (of_segment + kind.node_friction)
    per_length = friction.perpendicular / length
    if not (per_length > 0.0 and kind.bending_rigidity > 0.0):
        return alone
    wave = math.sqrt(2.0) * (kind.bending_rigidity * step / per_length) ** 0.25
    bending, whole = 0.5 * step / (per_length * wave), step / (per_length * length * segments)
    bending, whole = (bending, 1.5 * whole) if closed else (4.0 * bending, 4.0 * whole)
    return min(alone, (bending**3 + whole**3) ** (1.0 / 3.0))
