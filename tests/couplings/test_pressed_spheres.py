"""A sphere that a soft wall presses on a filament: how near it lies, beside quadrature, at steps of any length."""

import numpy as np
import pytest
from openmm import unit

from openmm_cylchain import F_ACTIN, Filaments, Sphere, capsule_contact_force, filament_wall_force
from support.contexts import new_context, positions_of
from support.solvent import KT, TEMPERATURE, VISCOSITY

PICONEWTON_PER_NANOMETER = 0.602214076
MICROSECOND = 1e6
CONTACT = 0.5
DIAMETER = 20.0
# Diameter of the sphere: length of the filament, radius of the wall around its middle, stiffness of the wall in pN/nm.
CASES = {200.0: (100.0, 150.0, 0.1), 20.0: (40.0, 21.0, 0.5)}


def _distances(sphere):
    """Mean distance of the sphere's center from the axis, and its variance."""
    length, radius, wall = CASES[sphere]
    reach, room = 0.5 * (DIAMETER + sphere), radius - 0.5 * sphere
    along, across = np.meshgrid(np.linspace(0, 2 * reach, 1201), np.linspace(0, 2 * reach, 2001), indexing="ij")
    distance = np.hypot(np.maximum(along - 0.5 * length, 0), across)
    overlap, depth = np.maximum(reach - distance, 0), np.maximum(np.hypot(along, across) - room, 0)
    energy = 0.5 * PICONEWTON_PER_NANOMETER / KT * (CONTACT * overlap**2 + wall * depth**2)
    weight = across * np.exp(energy.min() - energy)
    weight[0] *= 0.5
    weight /= weight.sum()
    mean = (weight * distance).sum()
    return mean, (weight * (distance - mean) ** 2).sum()


def _run(sphere, step, samples):
    """Distances (samples,), each after so much time that the sphere forgets half of where it was."""
    length, radius, wall = CASES[sphere]
    filaments = Filaments(VISCOSITY, TEMPERATURE)
    filaments.add_straight(F_ACTIN.with_segment_length(length), 1, [-0.5 * length, 0, 0], [1, 0, 0], clamped=[0])
    filaments.add_tether(0, 1, [0.5 * length, 0, 0], 100 * PICONEWTON_PER_NANOMETER)
    _, system, positions = filaments.build()
    particle = system.addParticle(1.0)
    options = {"particles": [particle], "particle_diameter": sphere}
    system.addForce(capsule_contact_force(filaments, system, DIAMETER, CONTACT * PICONEWTON_PER_NANOMETER, **options))
    options = {"particles": [particle], "particle_radius": 0.5 * sphere}
    stiffness = wall * PICONEWTON_PER_NANOMETER
    system.addForce(filament_wall_force(filaments, system, Sphere([0, 0, 0], radius), stiffness, **options))
    friction = 3 * np.pi * VISCOSITY.value_in_unit(unit.pascal * unit.second) * 602214.076 * sphere
    integrator = filaments.create_integrator(
        system, step * MICROSECOND, particle_friction=friction, random_seed=1, checks=False
    )
    nodes = np.vstack([positions._value, [[0, _distances(sphere)[0], 0]]])
    context = new_context(system, nodes, integrator, "CPU", {"Threads": "1"})
    memory = friction / ((CONTACT + wall) * PICONEWTON_PER_NANOMETER)
    interval = max(1, round(0.5 * memory / (step * MICROSECOND)))
    integrator.step(interval * samples // 10)
    found = []
    for _ in range(samples):
        integrator.step(interval)
        start, end, center = positions_of(context)
        along = end - start
        fraction = np.clip((center - start) @ along / (along @ along), 0, 1)
        found.append(np.linalg.norm(center - start - fraction * along))
    return np.array(found)


def _mean_and_error(values):
    blocks = [block.mean() for block in np.array_split(values, 20)]
    return np.mean(blocks), np.std(blocks, ddof=1) / np.sqrt(20)


# The recommended step of the small sphere is 0.13 us.
STEPS = [(20.0, 0.2), *(pytest.param(200.0, step, marks=pytest.mark.slow) for step in (1.0, 0.2))]
STEPS += [pytest.param(sphere, step, marks=pytest.mark.slow) for sphere in CASES for step in (0.05, 0.005)]


@pytest.mark.sample(r"-0\.2|-1\.0|^20\.0-0\.05$")
@pytest.mark.filterwarnings("ignore:.*can pass through it:openmm_cylchain.errors.ContactWarning")
@pytest.mark.parametrize(("sphere", "step"), STEPS)
def test_a_pressed_sphere_lies_where_quadrature_says(step, sphere):
    """Within 2 % of its overlap, and with its fluctuations within 10 %."""
    exact, variance = _distances(sphere)
    overlap = 0.5 * (DIAMETER + sphere) - exact
    found = _run(sphere, step, 20000)
    mean, error = _mean_and_error(found)
    assert 4 * error < 0.05 * overlap
    assert mean == pytest.approx(exact, abs=0.02 * overlap + 4 * error)
    mean, error = _mean_and_error((found - exact) ** 2)
    assert 4 * error < 0.25 * variance
    assert mean == pytest.approx(variance, abs=0.1 * variance + 4 * error)
