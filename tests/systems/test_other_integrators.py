"""Filaments beside molecules that have constraints and PME, with OpenMM's own integrator: their equilibrium."""

import numpy as np
import openmm
import pytest
from openmm import app

from openmm_cylchain import Crosslinks, Filaments, FilamentType, analysis, theory
from support.solvent import VISCOSITY

TEMPERATURE = 300.0
CHAIN_GROUP = 1
BOX = 2.2
# Light and stiff, so that its modes are as fast as molecules; the longest bend has a period of some 10 ps.
THREAD = FilamentType(
    name="THR",
    diameter=0.3,
    segment_length=1.0,
    persistence_length=4.0,
    temperature=TEMPERATURE,
    stretching_modulus=250.0,
    mass_per_length=10.0,
)
FILAMENTS, SEGMENTS = 24, 6


def water(count_along_edge=3):
    """Rigid molecules of water in a periodic box, with PME."""
    topology, positions = app.Topology(), []
    chain = topology.addChain("W")
    for cell in np.ndindex(*[count_along_edge] * 3):
        residue = topology.addResidue("HOH", chain)
        oxygen, *hydrogens = [
            topology.addAtom(name, app.Element.getBySymbol(name[0]), residue) for name in ("O", "H1", "H2")
        ]
        for hydrogen in hydrogens:
            topology.addBond(oxygen, hydrogen)
        place = BOX / count_along_edge * np.array(cell)
        positions += [place, place + [0.09572, 0, 0], place + [-0.02399, 0.09266, 0]]
    vectors = [openmm.Vec3(*row) for row in BOX * np.eye(3)]
    topology.setPeriodicBoxVectors(vectors)
    field = app.ForceField("tip3p.xml")
    system = field.createSystem(topology, app.PME, 0.9, app.HBonds, True, removeCMMotion=False)
    assert system.getNumConstraints() == 3 * count_along_edge**3
    return topology, system, np.array(positions)


def simulated(steps, interval):
    """Energies of all filaments, and squares of their end-to-end distances: (samples,), (samples, filaments)."""
    topology, system, positions = water()
    filaments = Filaments(VISCOSITY, TEMPERATURE)
    for number in range(FILAMENTS):
        filaments.add_equilibrium(THREAD, SEGMENTS, seed=number + 1, start=[0.09 * number, 0.3, 0.2])
    positions = filaments.add_to(topology, system, positions, CHAIN_GROUP, CHAIN_GROUP)
    # A spring to a molecule at one end changes no free chain.
    links = Crosslinks(100.0, 0.3)
    for number in range(6):
        links.add(None, int(filaments.node_indices[number][0]), 3 * number)
    links.add_to(system)
    integrator = openmm.LangevinMiddleIntegrator(TEMPERATURE, 2.0, 0.004)
    integrator.setRandomNumberSeed(1)
    simulation = app.Simulation(topology, system, integrator, openmm.Platform.getPlatform("CPU"), {"Threads": "1"})
    simulation.context.setPositions(positions)
    simulation.minimizeEnergy(maxIterations=20)
    simulation.step(steps // 20)
    energies, squares = [], []
    ends = np.array([[nodes[0], nodes[-1]] for nodes in filaments.node_indices])
    for _ in range(steps // interval):
        simulation.step(interval)
        state = simulation.context.getState(energy=True, positions=True, groups={CHAIN_GROUP})
        energies.append(state.getPotentialEnergy()._value)
        found = state.getPositions(asNumpy=True)._value[ends]
        squares.append(np.sum((found[:, 1] - found[:, 0]) ** 2, axis=1))
    return np.array(energies), np.array(squares)


def expected():
    stretching, bending = theory.chain_mean_energies(THREAD, SEGMENTS, TEMPERATURE)
    energy = FILAMENTS * (SEGMENTS * stretching + (SEGMENTS - 1) * bending)
    return energy, theory.chain_mean_square_end_to_end(THREAD, SEGMENTS, TEMPERATURE)


@pytest.mark.slow
def test_equilibrium_beside_rigid_water_is_that_of_theory():
    energies, squares = simulated(80_000, 50)
    energy, square = expected()
    independent = squares.mean(axis=0)
    for mean, error, exact in (
        (*analysis.statistics.mean_with_error(energies), energy),
        (independent.mean(), independent.std(ddof=1) / np.sqrt(FILAMENTS), square),
    ):
        # 5 % would fail.
        assert error < 0.05 / 4 * exact
        assert abs(mean - exact) < 4 * error
