"""Curvatures of custom potentials of OpenMM that are harmonic, and forces of those that are linear, by evaluation."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import openmm

from ..units.types import FloatArray

# In nm. A potential that has the same curvature at all of them is harmonic.
_SCALES = (1.0, 30.0, 1e3, 3e4, 1e6)


def bond_curvatures(force: openmm.CustomBondForce, parameters: Sequence[Any]) -> list[float | None]:
    """The curvature for each set of parameters of bonds; None where the potential is not harmonic."""
    copy = openmm.CustomBondForce(force.getEnergyFunction())
    _copy_globals(force, copy)
    for index in range(force.getNumPerBondParameters()):
        copy.addPerBondParameter(force.getPerBondParameterName(index))
    distances = np.array([distance for scale in _SCALES for distance in (scale, 1.01 * scale)])
    positions: list[Any] = []
    for values in parameters:
        for distance in distances:
            copy.addBond(len(positions), len(positions) + 1, values)
            positions += [[0.0, 0.0, 0.0], [distance, 0.0, 0.0]]
    slopes = -_forces(copy, positions)[1::2, 0].reshape(len(parameters), len(_SCALES), 2)
    curvatures = (slopes[..., 1] - slopes[..., 0]) / (0.01 * np.array(_SCALES))
    return [_constant(row) for row in curvatures]


def external_curvatures(
    force: openmm.CustomExternalForce, parameters: Sequence[Any]
) -> tuple[list[float | None], list[FloatArray | None]]:
    """The curvature for each set of parameters of particles, and the force; None where it is not constant."""
    copy = openmm.CustomExternalForce(force.getEnergyFunction())
    _copy_globals(force, copy)
    for index in range(force.getNumPerParticleParameters()):
        copy.addPerParticleParameter(force.getPerParticleParameterName(index))
    direction = np.array([0.48, -0.6, 0.64])
    origins = [sign * scale * direction for scale in _SCALES for sign in (1.0, -1.0)]
    points = [
        origin + side * 0.01 * np.linalg.norm(origin) * axis
        for origin in origins
        for axis in np.eye(3)
        for side in (-0.5, 0.5)
    ]
    positions: list[Any] = []
    for values in parameters:
        for point in points:
            copy.addParticle(len(positions), values)
            positions.append(point)
    forces = _forces(copy, positions).reshape(len(parameters), len(origins), 3, 2, 3)
    widths = 0.01 * np.array([np.linalg.norm(origin) for origin in origins])
    hessians = (forces[..., 0, :] - forces[..., 1, :]) / widths[:, None, None]
    if not np.all(np.isfinite(hessians)):
        return [None] * len(parameters), [None] * len(parameters)
    curvatures = np.max(np.linalg.eigvalsh(hessians + np.swapaxes(hessians, -1, -2)), axis=-1) / 2
    forces = forces.reshape(len(parameters), -1, 3)
    spread = np.ptp(forces, axis=1).max(axis=1) <= 1e-9 * np.abs(forces).max(axis=(1, 2))
    return [_constant(row) for row in curvatures], [own[0] if same else None for own, same in zip(forces, spread)]


def _copy_globals(force, copy):
    for index in range(force.getNumGlobalParameters()):
        copy.addGlobalParameter(force.getGlobalParameterName(index), force.getGlobalParameterDefaultValue(index))


def _forces(force, positions):
    system = openmm.System()
    for _ in positions:
        system.addParticle(1.0)
    system.addForce(force)
    context = openmm.Context(system, openmm.VerletIntegrator(1.0), openmm.Platform.getPlatform("Reference"))
    context.setPositions(positions)
    return context.getState(forces=True).getForces(asNumpy=True)._value


def _constant(curvatures):
    # Rounding leaves 1e-16 of a force, which is 1e-14 of it, in a curvature.
    if not np.all(np.isfinite(curvatures)):
        return None
    spread = np.ptp(curvatures)
    return max(0.0, float(np.mean(curvatures))) if spread <= 1e-6 * np.max(np.abs(curvatures)) else None
