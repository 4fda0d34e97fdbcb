"""Filaments of beam elements that are linked at places on their curves, drawn from equilibrium."""

from dataclasses import replace

import numpy as np

from openmm_cylchain import Crosslinks, Filaments, FilamentType
from openmm_cylchain.beams.curve import element_points

from .solvent import KT, TEMPERATURE, VISCOSITY

LENGTH = 250.0
BEAM = FilamentType(
    name="BEAM",
    diameter=6.0,
    segment_length=LENGTH,
    persistence_length=1000.0,
    temperature=TEMPERATURE,
    stretching_modulus=1e4,
    friction_length="filament",
    element="beam",
)
STRAIGHT = replace(BEAM, name="STRA", element="straight", segment_length=125.0, friction_length="segment")


def place_of(filament, segment, fraction):
    """Where a place of a Filament is, as it was added."""
    if filament.control_points is not None:
        return element_points(filament.positions, filament.control_points, [fraction])[segment, 0]
    return (1.0 - fraction) * filament.positions[segment] + fraction * filament.positions[segment + 1]


def add_moved(filaments, kind, segments, seed, place, target):
    """Add a filament that is drawn from equilibrium so that a place of it is at a target."""
    drawn = Filaments(VISCOSITY, TEMPERATURE, engine="compiled")
    drawn.add_equilibrium(kind, segments, seed=seed)
    start = drawn[0].positions[0] + np.asarray(target) - place_of(drawn[0], *place)
    return filaments.add_equilibrium(kind, segments, seed=seed, start=start)


def distances_of(stiffness, rest_length):
    """A grid of distances, and the density of that of a link whose vector has no other weight than its energy."""
    width = np.sqrt(KT / stiffness)
    distances = np.linspace(max(0.0, rest_length - 8.0 * width), rest_length + 8.0 * width, 4001)
    density = distances**2 * np.exp(-0.5 * ((distances - rest_length) / width) ** 2)
    return distances, density / density.sum()


def draw_vector(stiffness, rest_length, generator):
    """The vector of a link in its own equilibrium."""
    distances, density = distances_of(stiffness, rest_length)
    direction = generator.normal(size=3)
    return direction / np.linalg.norm(direction) * generator.choice(distances, p=density)


def mean_energy(stiffness, rest_length):
    """Of such a link, in k_B T."""
    distances, density = distances_of(stiffness, rest_length)
    return float(density @ (0.5 * stiffness * (distances - rest_length) ** 2)) / KT


def linked_pairs(kinds, places, stiffness, copies, seed=0, rest_length=0.0):
    """Pairs of filaments in equilibrium, of which a place of the first is linked to one of the second.

    Parameters
    ----------
    kinds : ((FilamentType, int), (FilamentType, int))
        With the numbers of segments.
    places : ((int, float), (int, float))
        Segments and fractions.

    Returns
    -------
    filaments, system, positions, links
    """
    filaments, generator = Filaments(VISCOSITY, TEMPERATURE, engine="compiled"), np.random.default_rng(seed)
    for copy in range(copies):
        kind, segments = kinds[0]
        first = filaments.add_equilibrium(kind, segments, seed=2 * copy + seed)
        target = place_of(filaments[first], *places[0]) + draw_vector(stiffness, rest_length, generator)
        add_moved(filaments, *kinds[1], 2 * copy + 1 + seed, places[1], target)
    _, system, positions = filaments.build()
    links = Crosslinks(stiffness, rest_length)
    for number in range(0, len(filaments), 2):
        ends = [filaments.segment_place(number + i, segment=s, fraction=f) for i, (s, f) in enumerate(places)]
        links.add(None, *ends)
    links.add_to(system)
    return filaments, system, positions, links
