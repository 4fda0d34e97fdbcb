"""The particles of a System outside filaments, those of rigid bodies among them, and their friction."""

import numpy as np
import openmm

from ..errors import InputError
from ..filaments.collection import FilamentCollection
from ..units.quantities import FRICTION, in_units_of
from ..units.types import FloatArray, Indices, IntArray, Numbers


def describe_beside_filaments(
    system: openmm.System, filaments: FilamentCollection, particle_friction: Numbers | None
) -> tuple[IntArray, FloatArray]:
    """Indices and friction coefficients of the mobile particles outside filaments, and of those of rigid bodies behind
    them: the least that each of these has against motion of its own."""
    bodies = [np.zeros(0, dtype=int), *(np.asarray(own, dtype=int) for own in filaments.body_indices)]
    inside = np.concatenate([*filaments.node_indices, *filaments.control_point_indices, *bodies])
    others, frictions = describe_other_particles(system, inside, particle_friction)
    of_bodies = [placed.body.place_frictions(filaments.viscosity) for placed in filaments.bodies]
    return np.concatenate([others, *bodies]), np.concatenate([frictions, *of_bodies])


def describe_other_particles(
    system: openmm.System, nodes: Indices, particle_friction: Numbers | None
) -> tuple[IntArray, FloatArray]:
    """Indices and friction coefficients of the mobile particles outside filaments and bodies.

    Parameters
    ----------
    nodes : int array
        Particle indices of all nodes, and of bodies.
    particle_friction : energy*time/length^2, array of them, or None
        In the order of the indices of the particles outside filaments and bodies, massless ones included.

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
