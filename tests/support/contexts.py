"""Contexts and Simulations of OpenMM, and what is in them, in OpenMM's units."""

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


def close_reporters(simulation):
    """Remove the reporters so that their files are complete on disk."""
    while simulation.reporters:
        getattr(simulation.reporters.pop(), "close", lambda: None)()
