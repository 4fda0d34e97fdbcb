"""Contexts and Simulations of OpenMM, and what is in them, in OpenMM's units."""

import numpy as np
import openmm
from openmm import app

from .compiled_platform import CompiledPlatform


def new_context(system, positions, integrator=None, platform="Reference", properties=None):
    """A Context with positions. An integrator is for those who take steps.

    A platform may be given by its name, or with its precision as a ``CompiledPlatform``.
    """
    if integrator is None:
        integrator = openmm.VerletIntegrator(0.001)
    if isinstance(platform, CompiledPlatform):
        platform.enable()
        platform, properties = platform.name, {**platform.properties, **(properties or {})}
    if isinstance(platform, str):
        platform = openmm.Platform.getPlatform(platform)
    context = openmm.Context(system, integrator, platform, properties or {})
    context.setPositions(positions)
    return context


def new_simulation(topology, system, positions, integrator):
    """A Simulation with positions, on the Reference platform."""
    simulation = app.Simulation(topology, system, integrator, openmm.Platform.getPlatform("Reference"))
    simulation.context.setPositions(positions)
    return simulation


def positions_of(context, wrapped=False):
    """In nm, and in the periodic box if wrapped."""
    return context.getState(positions=True, enforcePeriodicBox=wrapped).getPositions(asNumpy=True)._value


def forces_of(context, groups=-1):
    """In kJ/(mol nm)."""
    return context.getState(forces=True, groups=groups).getForces(asNumpy=True)._value


def energy_of(context, groups=-1):
    """The potential energy in kJ/mol."""
    return context.getState(energy=True, groups=groups).getPotentialEnergy()._value


def slopes_of(context, positions, particles, groups=-1, distance=1e-2):
    """By how much the energy grows with the places of some particles: (particles, 3) in kJ/(mol nm), by differences."""
    slopes = np.zeros((len(particles), 3))
    for row, particle in enumerate(particles):
        for axis in range(3):
            for sign in (1.0, -1.0):
                moved = positions.copy()
                moved[particle, axis] += sign * distance
                context.setPositions(moved)
                context.computeVirtualSites()
                slopes[row, axis] += sign * energy_of(context, groups)
    return slopes / (2.0 * distance)


def close_reporters(simulation):
    """Remove the reporters so that their files are complete on disk."""
    while simulation.reporters:
        getattr(simulation.reporters.pop(), "close", lambda: None)()
