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


def linked_pairs(kinds, places, stiffness, copies, seed=0, spread=KT):
    """Pairs of filaments in equilibrium, of which a place of the first is linked to one of the second.

    Parameters
    ----------
    kinds : ((FilamentType, int), (FilamentType, int))
        With the numbers of segments.
    places : ((int, float), (int, float))
        Segments and fractions.
    spread : float
        The thermal energy of the links as they are drawn.

    Returns
    -------
    filaments, system, positions, links
    """
    filaments, generator = Filaments(VISCOSITY, TEMPERATURE, engine="compiled"), np.random.default_rng(seed)
    for copy in range(copies):
        kind, segments = kinds[0]
        first = filaments.add_equilibrium(kind, segments, seed=2 * copy + seed)
        target = place_of(filaments[first], *places[0]) + generator.normal(0.0, np.sqrt(spread / stiffness), 3)
        add_moved(filaments, *kinds[1], 2 * copy + 1 + seed, places[1], target)
    _, system, positions = filaments.build()
    links = Crosslinks(stiffness, 0.0)
    for number in range(0, len(filaments), 2):
        ends = [filaments.segment_place(number + i, segment=s, fraction=f) for i, (s, f) in enumerate(places)]
        links.add(None, *ends)
    links.add_to(system)
    return filaments, system, positions, links
