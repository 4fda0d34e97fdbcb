"""Pairs of filaments in equilibrium whose middles lie in one place, with springs between them."""

import openmm

from openmm_cylchain import Filaments
from support.solvent import TEMPERATURE, VISCOSITY

PICONEWTON_PER_NANOMETER = 0.602214076


def pairs_of_filaments(kind, segments, count=1, engine=None):
    """A System with pairs of free filaments in equilibrium, and the middle nodes of each pair."""
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine=engine)
    middle = segments // 2
    for number in range(2 * count):
        drawn = Filaments(VISCOSITY, TEMPERATURE)
        drawn.add_equilibrium(kind, segments, seed=number + 1)
        nodes = drawn[0].positions
        # Pairs begin with their middles in one place: in equilibrium but for the spring's length.
        filaments.add_nodes(kind, nodes - nodes[middle])
    _, system, positions = filaments.build()
    middles = [int(nodes[middle]) for nodes in filaments.node_indices]
    return filaments, system, positions, list(zip(middles[::2], middles[1::2]))


def linked_pairs(kind, segments, stiffness, count=1):
    filaments, system, positions, pairs = pairs_of_filaments(kind, segments, count)
    force = openmm.HarmonicBondForce()
    for first, second in pairs:
        force.addBond(first, second, 0.0, stiffness * PICONEWTON_PER_NANOMETER)
    system.addForce(force)
    return filaments, system, positions, pairs
