"""Particles that diffuse among rods in implicit steps at the recommended step, against Boltzmann's density."""

import numpy as np
import pytest
from openmm import unit

from openmm_cylchain import F_ACTIN, Filaments, capsule_contact_force
from support.contexts import new_context, positions_of
from support.solvent import KT, TEMPERATURE, VISCOSITY

LENGTH, DIAMETER, EDGE = 100.0, 20.0, 800.0
ACTIN = F_ACTIN.with_segment_length(LENGTH)
STIFFNESS = 80 * KT / DIAMETER**2


def _distances(ends, particles):
    """Of particles from the axes of rods with given ends (rods, 2, 3), in the periodic box: (particles, rods)."""
    along = ends[:, 1] - ends[:, 0]
    apart = particles[:, None] - ends.mean(axis=1)
    apart -= EDGE * np.round(apart / EDGE)
    fraction = np.clip((apart * along).sum(axis=-1) / (along**2).sum(axis=-1), -0.5, 0.5)
    return np.linalg.norm(apart - fraction[..., None] * along, axis=-1)


def _energy(distance):
    return 0.5 * STIFFNESS * np.maximum(0.0, DIAMETER - distance) ** 2


def _context(rods, count, generator):
    """Rods that do not touch each other, and particles with Boltzmann's density among them."""
    filaments = Filaments(VISCOSITY, TEMPERATURE)
    for _ in range(rods):
        direction = generator.normal(size=3)
        filaments.add_straight(ACTIN, 1, generator.uniform(0, EDGE, 3), direction / np.linalg.norm(direction))
    _, system, positions = filaments.build()
    system.setDefaultPeriodicBoxVectors(*(EDGE * np.eye(3)))
    particles = [system.addParticle(1.0) for _ in range(count)]
    force = capsule_contact_force(
        filaments, system, DIAMETER, STIFFNESS, particles=particles, particle_diameter=DIAMETER, periodic=True
    )
    for rod in range(rods):
        for other in range(rod):
            force.addExclusion(rod, 0, other, 0)
    system.addForce(force)
    nodes = np.array(filaments.node_indices)
    ends = positions._value[nodes]
    drawn = np.zeros((0, 3))
    while len(drawn) < count:
        tried = generator.uniform(0, EDGE, (count, 3))
        weight = np.exp(-_energy(_distances(ends, tried)).sum(axis=1) / KT)
        drawn = np.vstack([drawn, tried[generator.uniform(size=count) < weight]])
    friction = 3 * np.pi * VISCOSITY * (DIAMETER * unit.nanometer)
    step = filaments.recommended_time_step("implicit", system=system, particle_friction=friction).step
    integrator = filaments.create_integrator(system, step, random_seed=5, checks=False, particle_friction=friction)
    positions = np.vstack([positions._value, drawn[:count]])
    return new_context(system, positions, integrator, "CPU", {"Threads": "1"}), nodes, particles


@pytest.mark.slow
def test_particles_around_rods_at_the_recommended_step():
    """From a gap of 10 nm on, they are as dense around a rod as anywhere.

    Other rods take as much room there as elsewhere. Particles are few: that they touch each other, too, changes their
    density near rods by less than 2 %.
    """
    rods, count, blocks, frames, steps_between = 160, 200, 20, 600, 5
    edges = np.array([0.0, 20.0, 30.0, 50.0, 80.0])
    context, nodes, particles = _context(rods, count, np.random.default_rng(3))
    found = np.zeros((blocks, len(edges) - 1))
    for block in range(blocks):
        for _ in range(frames):
            context.getIntegrator().step(steps_between)
            positions = positions_of(context)
            found[block] += np.histogram(_distances(positions[nodes], positions[particles]), edges)[0]
    found /= frames
    lower, upper = edges[:-1], edges[1:]
    shells = np.pi * LENGTH * (upper**2 - lower**2) + 4 / 3 * np.pi * (upper**3 - lower**3)
    distance = (np.arange(20000) + 0.5) * 0.001
    missing = 1 - np.exp(-_energy(distance) / KT)
    taken = ((2 * np.pi * distance * LENGTH + 4 * np.pi * distance**2) * missing).sum() * 0.001
    ratio = found / (shells * rods * count / (EDGE**3 - taken))
    mean, error = ratio.mean(axis=0), ratio.std(axis=0, ddof=1) / np.sqrt(blocks)
    beyond = lower >= DIAMETER + 10
    assert 4 * error[beyond].max() < 0.05
    assert mean[beyond] == pytest.approx(1.0, abs=0.05)
