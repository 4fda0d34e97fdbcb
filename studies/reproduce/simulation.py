"""Simulations of the paper's filaments with scheme "implicit".

What is simulated is stated here once more, apart from what the theory is evaluated for, so that the one can be wrong
without the other.
"""

from dataclasses import replace

import numpy as np
import openmm
from openmm import unit

from benchmark.measurement import Estimate
from openmm_cylchain import DSDNA, F_ACTIN, Filaments

ACTIN = replace(F_ACTIN, temperature=None)
"""With the joints of the paper, l_p k_B T/l0; those of the preset are calibrated to l_p."""
DNA = replace(DSDNA, temperature=None)
VISCOSITY = 1.71e-3 * unit.pascal * unit.second
TEMPERATURE = 310.0


def solvent(viscosity_factor=1.0):
    """Filaments in the solvent of Table 2, or one with another viscosity."""
    return Filaments(viscosity_factor * VISCOSITY, TEMPERATURE, engine="compiled")


def start(filaments, step, seed, system=None, positions=None, scheme="implicit"):
    """A Context, ready to step.

    Parameters
    ----------
    filaments : Filaments
    step : float
        In ps.
    seed : int
    system, positions : optional
        Of the filaments, if they are built; without them they are built here.
    scheme : str
    """
    if system is None:
        _, system, positions = filaments.build()
    # Steps are those of the papers, some of them too long on purpose.
    integrator = filaments.create_integrator(system, step, scheme=scheme, random_seed=seed, checks=False)
    context = openmm.Context(system, integrator, openmm.Platform.getPlatform("CPU"))
    context.setPositions(positions)
    return context


def frames(context, chains, steps):
    """Node positions (chains, nodes, 3) in nm after each of the given numbers of steps, which increase."""
    taken = 0
    for each in steps:
        if each > taken:
            context.getIntegrator().step(int(each - taken))
            taken = each
        positions = context.getState(positions=True).getPositions(asNumpy=True)._value
        yield positions.reshape(chains, -1, 3)


def groups(values, count):
    """Means over ``count`` groups of copies, along the last axis."""
    return np.stack([part.mean(axis=-1) for part in np.array_split(np.asarray(values), count, axis=-1)], axis=-1)


def mean(copies):
    """The mean over independent copies, the last axis, with its standard error: an Estimate of numbers or arrays."""
    copies = np.asarray(copies)
    return Estimate(copies.mean(axis=-1), copies.std(axis=-1, ddof=1) / np.sqrt(copies.shape[-1]))


def jackknife(function, copies):
    """``function`` of the mean over independent copies, the last axis, with its standard error.

    The error is a jackknife that leaves out one copy at a time.
    """
    copies = np.asarray(copies)
    count = copies.shape[-1]
    total = copies.sum(axis=-1)
    left_out = np.array([function((total - copies[..., i]) / (count - 1)) for i in range(count)])
    error = np.sqrt((count - 1) * np.var(left_out, axis=0))
    return Estimate(float(function(total / count)), float(error))
