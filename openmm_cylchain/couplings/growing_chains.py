"""Forces on filaments that grow: they may feel walls and contacts of this package, but nothing else as yet."""

from collections.abc import Iterable
from typing import Any

import numpy as np
import openmm

from ..engine_choice import load_plugin
from ..errors import InputError
from ..filaments.refusals import HELD_BY_LINKERS, growth_refusal
from .link_places import LinkPlaces

_ADVICE = "filament_wall_force and capsule_contact_force can."
_LISTS = (
    ("getNumBonds", "getBondParameters"),
    ("getNumAngles", "getAngleParameters"),
    ("getNumTorsions", "getTorsionParameters"),
    ("getNumDonors", "getDonorParameters"),
    ("getNumAcceptors", "getAcceptorParameters"),
)
"""What forces have lists of, in which particles come first."""


def growing_particles(system: openmm.System) -> dict[int, str]:
    """What the filaments of a System that grow are called, by their particles."""
    plugin: Any = load_plugin()
    if plugin is None:
        return {}
    growth = [force for force in system.getForces() if plugin.CylinderChainGrowthForce.isinstance(force)]
    if not growth:
        return {}
    chains = [force for force in system.getForces() if plugin.CylinderChainForce.isinstance(force)]
    force, chain_force = plugin.CylinderChainGrowthForce.cast(growth[0]), plugin.CylinderChainForce.cast(chains[0])
    numbers = [force.getGrowingChainParameters(index)[0] for index in range(force.getNumGrowingChains())]
    return {
        particle: chain_force.getChainName(number)
        for number in numbers
        for particle in chain_force.getChainParticles(number)
    }


def refuse_links_of_growing(system: openmm.System, places: LinkPlaces, numbers: Iterable[int]) -> None:
    """Raise InputError for crosslinks, by their numbers, that hold filaments which grow."""
    growing = growing_particles(system)
    if not growing:
        return
    held = np.concatenate([places.pairs, places.partners], axis=1)
    for number, particles in zip(numbers, held.tolist()):
        for particle in particles:
            if particle in growing:
                refusal = growth_refusal(growing[particle], "a crosslink", HELD_BY_LINKERS)
                raise InputError(f"Crosslink {number}: {refusal}")


def refuse_forces_on_growing(system: openmm.System) -> None:
    """Raise InputError for a stock force of OpenMM, or anchors of linkers, on a particle of a filament that grows.

    Not where particles interact by their parameters, such as charges: those of filaments have none.
    """
    growing = growing_particles(system)
    for index, force in enumerate(system.getForces() if growing else ()):
        for particle in _named_particles(force):
            if particle in growing:
                label = f"{force.getName()} (force {index})"
                raise InputError(growth_refusal(growing[particle], f"{label}, which acts on its particles,", _ADVICE))


def _named_particles(force):
    plugin = load_plugin()
    if plugin.CylinderChainBindingForce.isinstance(force):
        linkers = plugin.CylinderChainBindingForce.cast(force)
        yield from (linkers.getAnchor(index)[0] for index in range(linkers.getNumAnchors()))
    if isinstance(force, openmm.CustomExternalForce):
        yield from (force.getParticleParameters(index)[0] for index in range(force.getNumParticles()))
    if isinstance(force, openmm.CustomCentroidBondForce):
        for group in range(force.getNumGroups()):
            yield from force.getGroupParameters(group)[0]
        return
    if type(force).__module__.startswith("openmm_cylchain"):
        return
    for count, parameters in _LISTS:
        for index in range(getattr(force, count)() if hasattr(force, count) else 0):
            # Those with lists of particles have the list first.
            for entry in getattr(force, parameters)(index):
                if isinstance(entry, (tuple, list)) and all(isinstance(own, int) for own in entry):
                    yield from entry
                    break
                if not isinstance(entry, int):
                    break
                yield entry
    if hasattr(force, "getReferencePositions") or type(force).__name__ == "RGForce":
        yield from force.getParticles()
