"""Spheres and short rods in a torus and around it: where they are and their energies, against integrals."""

import numpy as np
import pytest
from openmm import unit

from openmm_cylchain import F_ACTIN, Filaments, Sphere, Torus, filament_wall_force
from support.contexts import new_context, positions_of
from support.solvent import KT, TEMPERATURE, VISCOSITY

AXIS = np.array([1.0, 2.0, -2.0]) / 3.0
CENTER = np.array([40.0, -30.0, 20.0])
MAJOR, MINOR = 300.0, 150.0
FIRST, SECOND = np.linalg.svd(AXIS[None])[2][1:]


def along_and_across(points):
    """How far points are from the middle along the axis and across it."""
    apart = points - CENTER
    along = apart @ AXIS
    return along, np.linalg.norm(apart - along[..., None] * AXIS, axis=-1)


def from_circle(along, across, radius=MAJOR):
    return np.hypot(across - radius, along)


def placed(along, across, generator):
    """Points at heights along the axis and distances from it, at random angles."""
    angles = generator.uniform(0.0, 2.0 * np.pi, len(along))
    outward = np.cos(angles)[:, None] * FIRST + np.sin(angles)[:, None] * SECOND
    return CENTER + along[:, None] * AXIS + across[:, None] * outward


@pytest.mark.sample("10.0-5.0-inside|30.0-0.05-outside")
@pytest.mark.parametrize("side", ["inside", "outside"])
@pytest.mark.parametrize("stiffness", [0.05, 5.0])
@pytest.mark.parametrize("motion", [3.0, 10.0, 30.0])
def test_spheres(side, stiffness, motion):
    """Distances from the circle and from the axis, and energies, in steps of a motion in nm along each axis.

    Steps are as 1 to 11 to 100. Those outside are in a sphere, and go through the hole and around.
    """
    sphere, around, count = 10.0, 550.0, 6000
    height, distance = np.meshgrid(np.linspace(-600.0, 600.0, 1201), np.linspace(0.0, 600.0, 601), indexing="ij")
    away = from_circle(height, distance)
    if side == "inside":
        beyond = np.maximum(0.0, away - (MINOR - sphere))
        energy = 0.5 * stiffness * beyond**2
        outer = 0.0
    else:
        beyond = np.maximum(0.0, MINOR + sphere - away)
        energy = 0.5 * stiffness * beyond**2
        outer = 0.5 * stiffness * np.maximum(0.0, np.hypot(height, distance) - (around - sphere)) ** 2
    weight = distance * np.exp(-(energy + outer) / KT)
    weight /= weight.sum()
    exact = np.array([np.sum(weight * own) for own in (away, distance, height**2, energy)])

    generator = np.random.default_rng(3)
    filaments = Filaments(VISCOSITY, TEMPERATURE)
    filaments.add_straight(F_ACTIN, 1, CENTER, AXIS)
    _, system, positions = filaments.build()
    particles = [system.addParticle(1.0) for _ in range(count)]
    chosen = generator.choice(weight.size, size=count, p=weight.ravel())
    points = placed(height.ravel()[chosen], distance.ravel()[chosen], generator)
    walls = [(Torus(CENTER * unit.nanometer, AXIS, MAJOR, MINOR * unit.nanometer), side)]
    walls += [(Sphere(CENTER, around), "inside")] * (side == "outside")
    for wall, own in walls:
        system.addForce(
            filament_wall_force(
                filaments, system, wall, stiffness, particles=particles, particle_radius=sphere, numbers=[], side=own
            )
        )
    step = 1e3
    integrator = filaments.create_integrator(
        system, step, particle_friction=2.0 * KT * step / motion**2, random_seed=3, checks=False
    )
    context = new_context(system, np.vstack([positions._value, points]), integrator)
    found = []
    for _ in range(100):
        integrator.step(2)
        along, across = along_and_across(positions_of(context)[2:])
        away = from_circle(along, across)
        beyond = np.maximum(0.0, away - (MINOR - sphere) if side == "inside" else MINOR + sphere - away)
        found.append([away, across, along**2, 0.5 * stiffness * beyond**2])
    found = np.mean(found, axis=0)
    errors = found.std(axis=1, ddof=1) / np.sqrt(count)
    assert integrator.getNumDividedSteps() < 10
    assert np.all(
        4 * errors < np.array([0.05, 0.05, 0.05, 0.12 if side == "inside" and stiffness < 1.0 else 0.3]) * exact
    )
    assert np.all(np.abs(found.mean(axis=1) - exact) < 4 * errors)


@pytest.mark.slow
@pytest.mark.parametrize("stiffness", [0.1, 0.5])
def test_rods_in_a_torus(stiffness):
    """Where they are, how they lie to its axis, and their energies, by random places with weights."""
    segment, chains, major, minor = 60.0, 1300, 120.0, 60.0
    generator = np.random.default_rng(4)
    count = 4_000_000
    reach = minor + 25.0
    height = generator.uniform(-reach, reach, count)
    distance = np.sqrt(generator.uniform((major - reach) ** 2, (major + reach) ** 2, count))
    direction = generator.normal(size=(count, 3))
    direction /= np.linalg.norm(direction, axis=1)[:, None]
    energy = 0.0
    for half in (-0.5 * segment, 0.5 * segment):
        across = np.hypot(distance + half * direction[:, 0], half * direction[:, 1])
        beyond = np.maximum(0.0, from_circle(height + half * direction[:, 2], across, major) - minor)
        energy = energy + 0.5 * stiffness * beyond**2
    weight = np.exp(-energy / KT)
    weight /= weight.sum()
    values = distance, height**2, direction[:, 2] ** 2, direction[:, 1] ** 2, energy
    exact = np.array([np.sum(weight * value) for value in values])

    filaments = Filaments(VISCOSITY, TEMPERATURE)
    for own in generator.choice(count, size=chains, p=weight):
        turn = generator.uniform(0.0, 2.0 * np.pi)
        out, aside = np.cos(turn) * FIRST + np.sin(turn) * SECOND, np.cos(turn) * SECOND - np.sin(turn) * FIRST
        way = direction[own, 0] * out + direction[own, 1] * aside + direction[own, 2] * AXIS
        middle = CENTER + height[own] * AXIS + distance[own] * out
        filaments.add_straight(F_ACTIN.with_segment_length(segment), 1, middle - 0.5 * segment * way, way)
    _, system, positions = filaments.build()
    system.addForce(filament_wall_force(filaments, system, Torus(CENTER, AXIS, major, minor), stiffness))
    step = 0.25 * filaments.recommended_time_step(system=system).step
    integrator = filaments.create_integrator(system, step, random_seed=1)
    context = new_context(system, positions, integrator)
    found = []
    for _ in range(150):
        integrator.step(40)
        nodes = positions_of(context).reshape(chains, 2, 3)
        along, across = along_and_across(nodes)
        energies = 0.5 * stiffness * np.sum(np.maximum(0.0, from_circle(along, across, major) - minor) ** 2, axis=1)
        height, distance = along_and_across(nodes.mean(axis=1))
        way = (nodes[:, 1] - nodes[:, 0]) / segment
        outward = nodes.mean(axis=1) - CENTER - height[:, None] * AXIS
        outward /= distance[:, None]
        aside = np.cross(AXIS, outward)
        found.append([distance, height**2, (way @ AXIS) ** 2, np.sum(way * aside, axis=1) ** 2, energies])
    found = np.mean(found, axis=0)
    errors = found.std(axis=1, ddof=1) / np.sqrt(chains)
    assert np.all(4 * errors < 0.05 * exact)
    assert np.all(np.abs(found.mean(axis=1) - exact) < 4 * errors)
