"""Filaments among many particles."""

import numpy as np
import openmm
from openmm import app, unit

from openmm_cylchain import Filaments, stokes_friction

from .contexts import new_context
from .platform_variants import ACTIN
from .solvent import TEMPERATURE, VISCOSITY

BOX = 1500.0


def mixed_context(platform, precision=None, temperature=None):
    """Ten filaments among Lennard-Jones particles, some of them bound to virtual sites on segments."""
    topology, system = app.Topology(), openmm.System()
    system.setDefaultPeriodicBoxVectors(*(BOX * np.eye(3)))
    topology.setPeriodicBoxVectors(BOX * np.eye(3) * unit.nanometer)
    chain = topology.addChain()
    lattice = 100.0 * np.stack(np.meshgrid(range(15), range(15), [9, 11, 13]), axis=-1).reshape(-1, 3)
    for _ in lattice:
        topology.addAtom("LJ", None, topology.addResidue("PAR", chain))
        system.addParticle(1e5)
    filaments = Filaments(VISCOSITY, TEMPERATURE, "compiled")
    for number in range(10):
        filaments.add_straight(ACTIN, 10, [50.0, 150.0 * number + 20, 400.0], [1, 0, 0.3])
        filaments.add_attachment(number, segment=4, fraction=0.3)
    positions = filaments.add_to(topology, system, lattice * unit.nanometer)
    # Parameters that single precision holds, in which OpenMM has them on GPUs.
    attraction, bonds = openmm.NonbondedForce(), openmm.HarmonicBondForce()
    attraction.setNonbondedMethod(openmm.NonbondedForce.CutoffPeriodic)
    attraction.setCutoffDistance(150.0)
    attraction.setUseDispersionCorrection(False)
    for particle in range(system.getNumParticles()):
        attraction.addParticle(0.0, 60.0 if particle < len(lattice) else 20.0, 2.25)
    for filament, nodes in enumerate(filaments.node_indices):
        for first in [*nodes, filaments.attachment_indices[filament]]:
            for second in [*nodes, filaments.attachment_indices[filament]]:
                if first < second:
                    attraction.addException(int(first), int(second), 0.0, 1.0, 0.0)
    for number, site in enumerate(filaments.attachment_indices):
        bonds.addBond(int(site), 40 * number, 100.0, 2**-10)
    bonds.setUsesPeriodicBoundaryConditions(True)
    system.addForce(attraction)
    system.addForce(bonds)
    friction = stokes_friction(30, VISCOSITY)
    integrator = filaments.create_integrator(
        system,
        2e4,
        "implicit",
        particle_friction=friction,
        random_seed=4,
        precision="double",
        checks=False,
        temperature=temperature,
    )
    return filaments, new_context(
        system, positions, integrator, platform, {"Precision": precision} if precision else {}
    )
