"""Two filaments of actin and three beads in one System."""

import numpy as np
import openmm
from openmm import app, unit

from openmm_cylchain import F_ACTIN, Filaments, stokes_friction
from support.solvent import TEMPERATURE, VISCOSITY

STEP = 5e3  # ps


def actin_filaments(engine, segments=(5, 3)):
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine=engine)
    for seed, count in enumerate(segments):
        filaments.add_equilibrium(F_ACTIN, count, seed=seed)
    return filaments


def bead_system():
    """A System of three beads, one of them massless, held by a weak bond, with its Topology."""
    topology, system = app.Topology(), openmm.System()
    chain = topology.addChain()
    for mass in (1e5, 0.0, 1e5):
        topology.addAtom("B", None, topology.addResidue("BEA", chain))
        system.addParticle(mass)
    bond = openmm.HarmonicBondForce()
    bond.addBond(0, 2, 100.0, 0.01)
    system.addForce(bond)
    return topology, system, np.array([[0.0, 500.0, 0.0], [50.0, 500.0, 0.0], [100.0, 500.0, 0.0]])


def filaments_and_beads(engine):
    """Two filaments and three beads in one System."""
    topology, system, positions = bead_system()
    filaments = actin_filaments(engine)
    positions = filaments.add_to(topology, system, positions * unit.nanometer)
    return filaments, system, positions


def integrator_of_both(filaments, system, **options):
    friction = stokes_friction(50, VISCOSITY)
    return filaments.create_integrator(system, STEP, particle_friction=friction, **options)
