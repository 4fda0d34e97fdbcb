"""The particles of a System outside filaments, and their friction."""

import numpy as np
import openmm

from ..errors import InputError
from ..units.quantities import FRICTION, in_units_of
from ..units.types import FloatArray, Indices, IntArray, Numbers


def describe_other_particles(
    system: openmm.System, nodes: Indices, particle_friction: Numbers | None
) -> tuple[IntArray, FloatArray]:
    """Indices and friction coefficients of the mobile particles outside filaments.

    Parameters
    ----------
    nodes : int array
        Particle indices of all nodes.
    particle_friction : energy*time/length^2, array of them, or None
        In the order of the indices of the particles outside filaments, massless ones included.

    Raises
    ------
    InputError
        If there are such particles but no friction, or it has the wrong shape or is not positive.
    """
    outside = np.setdiff1d(np.arange(system.getNumParticles()), nodes)
    mobile = np.array([system.getParticleMass(int(index))._value != 0.0 for index in outside], dtype=bool)
    if not mobile.any():
        return outside[mobile], np.zeros(0)
    if particle_friction is None:
        raise InputError(
            f"{mobile.sum()} particles outside filaments can move, but have no friction: give particle_friction."
        )
    friction = np.asarray(in_units_of(particle_friction, FRICTION, "particle_friction"))
    if friction.ndim and friction.shape != outside.shape:
        raise InputError(
            f"particle_friction must be a number or have one entry for each of the {len(outside)} particles "
            f"outside filaments, but has the shape {friction.shape}."
        )
    friction = np.broadcast_to(friction, outside.shape)[mobile]
    if np.any(friction <= 0):
        raise InputError(
            f"particle_friction must be positive, but is {friction.min():g} for particle "
            f"{outside[mobile][np.argmin(friction)]}."
        )
    return outside[mobile], np.array(friction)
