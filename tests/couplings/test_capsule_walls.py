"""Spheres and short rods in a capsule: where they are and their energies, against integrals."""

import numpy as np
import pytest
from openmm import unit

from openmm_cylchain import F_ACTIN, Capsule, Filaments, filament_wall_force
from support.contexts import new_context, positions_of
from support.solvent import KT, TEMPERATURE, VISCOSITY

AXIS = np.array([1.0, 2.0, -2.0]) / 3.0
CENTER = np.array([40.0, -30.0, 20.0])


def _along_and_across(points):
    """How far points are from the middle along the axis and across it."""
    apart = points - CENTER
    along = apart @ AXIS
    return along, np.linalg.norm(apart - along[..., None] * AXIS, axis=-1)


def _from_axis(along, across, length):
    """The distance from a part of the axis that is so long."""
    return np.hypot(np.maximum(0.0, np.abs(along) - 0.5 * length), across)


def test_spheres_in_a_capsule():
    """Shares of the caps, distances from the axis and energies, by an integral over the distance."""
    length, radius, sphere, stiffness, count = 250.0, 130.0, 30.0, 0.05, 2500
    room = radius - sphere
    distance = np.linspace(0.0, room + 80.0, 20001)
    energy = 0.5 * stiffness * np.maximum(0.0, distance - room) ** 2
    boltzmann = np.exp(-energy / KT)
    side, caps = 2 * np.pi * distance * length * boltzmann, 4 * np.pi * distance**2 * boltzmann
    total = np.sum(side + caps)
    exact = np.array([np.sum(caps), np.sum((side + caps) * distance), np.sum((side + caps) * energy)]) / total

    generator = np.random.default_rng(3)
    filaments = Filaments(VISCOSITY, TEMPERATURE)
    filaments.add_straight(F_ACTIN, 1, CENTER, AXIS)
    _, system, positions = filaments.build()
    particles = [system.addParticle(1.0) for _ in range(count)]
    # As they are in equilibrium, so that there is nothing to wait for.
    chosen = generator.choice(2 * distance.size, size=count, p=np.concatenate([side, caps]) / total)
    apart = generator.normal(size=(count, 3))
    on_caps = chosen >= distance.size
    apart[~on_caps] -= np.outer(apart[~on_caps] @ AXIS, AXIS)
    apart *= distance[chosen % distance.size][:, None] / np.linalg.norm(apart, axis=1)[:, None]
    shift = np.where(on_caps, 0.5 * np.sign(apart @ AXIS), generator.uniform(-0.5, 0.5, count)) * length
    points = CENTER + apart + shift[:, None] * AXIS
    wall = Capsule(CENTER * unit.nanometer, AXIS, length, radius)
    system.addForce(
        filament_wall_force(filaments, system, wall, stiffness, particles=particles, particle_radius=sphere)
    )
    # In a step, a sphere moves by 30 nm, and gets 7 nm beyond the wall.
    integrator = filaments.create_integrator(system, 6e7, random_seed=5, particle_friction=3.4e5, checks=False)
    context = new_context(system, np.vstack([positions._value, points]), integrator)
    found = []
    for _ in range(60):
        integrator.step(5)
        along, across = _along_and_across(positions_of(context)[len(positions) :])
        away = _from_axis(along, across, length)
        beyond = np.maximum(0.0, away - room)
        found.append([np.abs(along) > 0.5 * length, away, 0.5 * stiffness * beyond**2])
    found = np.mean(found, axis=0)
    errors = found.std(axis=1, ddof=1) / np.sqrt(count)
    assert np.all(4 * errors < 0.05 * exact)
    assert np.all(np.abs(found.mean(axis=1) - exact) < 4 * errors)


@pytest.mark.sample("^0.1")
@pytest.mark.slow
@pytest.mark.parametrize("stiffness", [0.1, 0.5])
def test_rods_in_a_capsule(stiffness):
    """Where they are along the axis, how they lie to it, and their energies, by random places with weights.

    At the recommended step, they lie along the axis by 2 % too much, as they do in a cylinder.
    """
    segment, length, radius, chains = 100.0, 120.0, 70.0, 1000
    generator = np.random.default_rng(4)
    count = 4_000_000
    along = generator.uniform(-1.0, 1.0, count) * (0.5 * length + radius + 30.0)
    across = np.sqrt(generator.uniform(0.0, 1.0, count)) * (radius + 30.0)
    cosine, angle = generator.uniform(-1.0, 1.0, count), generator.uniform(0.0, 2.0 * np.pi, count)
    sine = np.sqrt(1.0 - cosine**2)
    energy = 0.0
    for half in (-0.5 * segment, 0.5 * segment):
        end = np.hypot(across + half * sine * np.cos(angle), half * sine * np.sin(angle))
        beyond = np.maximum(0.0, _from_axis(along + half * cosine, end, length) - radius)
        energy = energy + 0.5 * stiffness * beyond**2
    weight = np.exp(-energy / KT)
    weight /= weight.sum()
    exact = np.array([np.sum(weight * value) for value in (along**2, cosine**2, energy)])

    filaments = Filaments(VISCOSITY, TEMPERATURE)
    first, second = np.linalg.svd(AXIS[None])[2][1:]
    for own in generator.choice(count, size=chains, p=weight):
        turn = generator.uniform(0.0, 2.0 * np.pi)
        out, aside = np.cos(turn) * first + np.sin(turn) * second, np.cos(turn) * second - np.sin(turn) * first
        direction = cosine[own] * AXIS + sine[own] * (np.cos(angle[own]) * out + np.sin(angle[own]) * aside)
        middle = CENTER + along[own] * AXIS + across[own] * out
        filaments.add_straight(F_ACTIN.with_segment_length(segment), 1, middle - 0.5 * segment * direction, direction)
    _, system, positions = filaments.build()
    system.addForce(filament_wall_force(filaments, system, Capsule(CENTER, AXIS, length, radius), stiffness))
    step = 0.25 * filaments.recommended_time_step(system=system).step
    integrator = filaments.create_integrator(system, step, random_seed=1)
    context = new_context(system, positions, integrator)
    found = []
    for _ in range(150):
        integrator.step(40)
        nodes = positions_of(context).reshape(chains, 2, 3)
        along, across = _along_and_across(nodes)
        beyond = np.maximum(0.0, _from_axis(along, across, length) - radius)
        energies = 0.5 * stiffness * np.sum(beyond**2, axis=1)
        found.append([along.mean(axis=1) ** 2, ((along[:, 1] - along[:, 0]) / segment) ** 2, energies])
    found = np.mean(found, axis=0)
    errors = found.std(axis=1, ddof=1) / np.sqrt(chains)
    assert np.all(4 * errors < 0.05 * exact)
    assert np.all(np.abs(found.mean(axis=1) - exact) < 4 * errors)
