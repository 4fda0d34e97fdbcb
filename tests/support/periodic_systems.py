"""Filaments that are longer than their periodic box and cross it among beads."""

import numpy as np
import openmm
from openmm import app, unit

from openmm_cylchain import F_ACTIN, Filaments
from support.contexts import new_simulation
from support.solvent import VISCOSITY

CUBIC = 1500.0 * np.eye(3)
TRICLINIC = np.array([[1500.0, 0.0, 0.0], [400.0, 1400.0, 0.0], [-600.0, 500.0, 1600.0]])
BEADS = 4
STEP_SIZE = 5e3  # ps


def crossing_filaments(engine, vectors):
    """Three filaments of 2.9 um with attachment points among beads, dragged along x in a box of 1.5 um."""
    topology, system = app.Topology(), openmm.System()
    chain = topology.addChain()
    for _ in range(BEADS):
        topology.addAtom("B", None, topology.addResidue("BEA", chain))
        system.addParticle(1e5)
    system.setDefaultPeriodicBoxVectors(*vectors)
    topology.setPeriodicBoxVectors(vectors * unit.nanometer)
    filaments = Filaments(VISCOSITY, 310, engine)
    for number in range(3):
        filaments.add_equilibrium(F_ACTIN, 8, seed=number, start=[300 * number, 100, 50])
        filaments.add_attachment(number, segment=3, fraction=0.3)
        filaments.add_attachment(number, arc_length=8 * 360)
    beads = 1400 * np.random.default_rng(2).uniform(size=(BEADS, 3))
    positions = filaments.add_to(topology, system, beads)
    repulsion = openmm.CustomNonbondedForce("20*(1-r/100)^2")
    repulsion.setNonbondedMethod(openmm.CustomNonbondedForce.CutoffPeriodic)
    repulsion.setCutoffDistance(100.0)
    for _ in range(system.getNumParticles()):
        repulsion.addParticle([])
    repulsion.addInteractionGroup(range(BEADS), range(system.getNumParticles()))
    system.addForce(repulsion)
    # Ends have half of the friction, so that nothing is compressed.
    ends = {int(end) for nodes in filaments.node_indices for end in nodes[[0, -1]]}
    drift = openmm.CustomExternalForce("-force*x")
    drift.addPerParticleParameter("force")
    for particle in range(system.getNumParticles()):
        if not system.isVirtualSite(particle):
            drift.addParticle(particle, [5000.0 if particle in ends else 10000.0])
    system.addForce(drift)
    return filaments, topology, system, positions


def particles_of(filaments):
    """Particles of each filament, attachment points included."""
    return [np.arange(nodes[0], nodes[-1] + 3) for nodes in filaments.node_indices]


def crossing_simulation(engine, vectors=CUBIC, seed=4):
    """These filaments and a Simulation of them."""
    filaments, topology, system, positions = crossing_filaments(engine, vectors)
    integrator = filaments.create_integrator(
        system, STEP_SIZE, scheme="midpoint", particle_friction=5e5, random_seed=seed
    )
    # Several boxes away from the origin, and more than a micrometre.
    return filaments, new_simulation(topology, system, positions + 4000 * unit.nanometer, integrator)
