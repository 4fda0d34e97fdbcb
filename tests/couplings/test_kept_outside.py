"""What walls keep outside of shapes, between two of them: where it is, and how it presses, against integrals."""

import numpy as np
import pytest

from openmm_cylchain import (
    F_ACTIN,
    Cylinder,
    Filaments,
    Sphere,
    filament_wall_force,
    wall_forces,
)
from support.contexts import new_context, positions_of
from support.solvent import KT, TEMPERATURE, VISCOSITY

INNER, OUTER, BEAD = 60.0, 150.0, 10.0


@pytest.mark.sample("^5.0-3.0-sphere|^5.0-30.0-cyl")
@pytest.mark.parametrize(("shape", "power"), [("sphere", 2), ("cylinder", 1)])
@pytest.mark.parametrize(("stiffness", "motion"), [(0.05, 3.0), (5.0, 3.0), (5.0, 30.0)])
def test_particles_between(shape, power, stiffness, motion):
    """Distances from the middle, energies, and forces on both walls, in steps of a motion in nm along each axis."""
    distances = np.linspace(0.0, OUTER + 80.0, 40001)
    within = np.maximum(0.0, INNER + BEAD - distances)
    beyond = np.maximum(0.0, distances + BEAD - OUTER)
    weights = distances**power * np.exp(-0.5 * stiffness * (within**2 + beyond**2) / KT)
    weights /= weights.sum()
    exact = np.array([weights @ own for own in (distances, distances**2, stiffness * within, stiffness * beyond)])

    count, generator = 1700, np.random.default_rng(4)
    filaments = Filaments(VISCOSITY, TEMPERATURE)
    filaments.add_straight(F_ACTIN, 1, [0, 0, 0], [1, 0, 0])
    _, system, positions = filaments.build()
    particles = [system.addParticle(1.0) for _ in range(count)]
    for radius, side in ((INNER, "outside"), (OUTER, "inside")):
        wall = Sphere([0, 0, 0], radius) if shape == "sphere" else Cylinder([0, 0, 0], [0, 0, 1], radius)
        system.addForce(
            filament_wall_force(
                filaments,
                system,
                wall,
                stiffness,
                particles=particles,
                particle_radius=BEAD,
                numbers=[],
                side=side,
            )
        )
    step = 1e3
    integrator = filaments.create_integrator(
        system, step, particle_friction=2.0 * KT * step / motion**2, random_seed=3, checks=False
    )
    start = generator.normal(size=(count, 3))
    start[:, 2] *= power - 1
    start *= (generator.choice(distances, size=count, p=weights) / np.linalg.norm(start, axis=1))[:, None]
    context = new_context(system, np.vstack([positions._value, start]), integrator)
    wall_forces(context)
    found = []
    for _ in range(80):
        integrator.step(1)
        away = np.linalg.norm(positions_of(context)[2:, : power + 1], axis=1)
        pushes = [np.linalg.norm(forces.forces._value[2:], axis=1) for forces in wall_forces(context)]
        found.append([away, away**2, *pushes])
    assert integrator.getNumDividedSteps() < 100
    found = np.mean(found, axis=0)
    errors = found.std(axis=1, ddof=1) / np.sqrt(count)
    assert np.all(4 * errors < np.array([0.05, 0.05, 0.5, 0.25]) * exact)
    assert np.all(np.abs(found.mean(axis=1) - exact) < 4 * errors)
