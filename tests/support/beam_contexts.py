"""Contexts of chains of beam elements that forces are given directly, without Filaments."""

from openmm_cylchain.engines.compiled import CylinderChainIntegrator

from .contexts import new_context
from .solvent import TEMPERATURE


def beam_context(system, positions, step, temperature=TEMPERATURE, platform="CPU", seed=1):
    """A Context whose integrator takes steps of the length ``step`` in ps."""
    integrator = CylinderChainIntegrator(temperature, 1.0, step)
    integrator.setRandomNumberSeed(seed)
    return new_context(system, positions, integrator, platform)
