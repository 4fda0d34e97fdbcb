"""Walls around beam elements in the equations of steps: at their nodes, and at beads along their curves."""

from dataclasses import replace

import numpy as np
import pytest
from openmm import unit
from scipy.spatial.transform import Rotation

from openmm_cylchain import Filaments, Slab, Sphere, filament_wall_force
from openmm_cylchain.beams.curve import element_energies, element_points
from openmm_cylchain.beams.equilibrium import draw_beam
from support.contexts import energy_of, forces_of, new_context, positions_of
from support.linked_beams import BEAM, LENGTH
from support.solvent import KT, TEMPERATURE, VISCOSITY

SIGMAS = 4.0
WALLS = 5
BEADS = np.array([0.0, 0.25, 0.5, 0.75, 1.0])


@pytest.mark.parametrize("platform", ["Reference", "CPU"])
def test_energies_and_forces_are_those_of_beads_or_nodes(platform):
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine="compiled")
    for seed in range(2):
        filaments.add_equilibrium(BEAM, 3, seed=seed)
    filaments.add_beads(1, 100.0)
    _, system, positions = filaments.build()
    wall = filament_wall_force(filaments, system, Sphere([0, 0, 0], 300.0), 0.02, radius=10.0)
    wall.setForceGroup(WALLS)
    system.addForce(wall)
    held = [*filaments.node_indices[0], *filaments.bead_indices[1]]
    assert [wall.getParticle(i) for i in range(wall.getNumParticles())] == held
    context = new_context(system, positions, platform=platform)
    depth = np.maximum(0.0, np.linalg.norm(positions._value[held], axis=1) + 10.0 - 300.0)
    assert np.count_nonzero(depth) > 5
    assert energy_of(context, 1 << WALLS) == pytest.approx(0.01 * np.sum(depth**2))
    assert np.any(forces_of(context, 1 << WALLS)[filaments.control_point_indices[1]])
    assert not np.any(forces_of(context, 1 << WALLS)[filaments.control_point_indices[0]])


def test_a_stiff_wall_holds_the_curve_in_long_steps():
    """A filament that is pushed against a plane with its middle element, without noise: the curve stays before it."""
    filaments = Filaments(VISCOSITY, 0.0, engine="compiled")
    kind = replace(BEAM, temperature=None, bending_rigidity=1000.0 * KT)
    angles = np.linspace(-0.5, 0.5, 3)
    arc = np.stack([600.0 * np.sin(angles), 0 * angles, 600.0 * np.cos(angles) - 600.0], axis=1)
    filaments.add_nodes(kind, arc, tangents=np.stack([np.cos(angles), 0 * angles, -np.sin(angles)], axis=1))
    filaments.add_beads(0, LENGTH / 8)
    _, system, positions = filaments.build()
    system.addForce(filament_wall_force(filaments, system, Slab([0, 0, -100], [0, 0, 1], 100.0), 1e3))
    step = filaments.recommended_time_step(system=system)
    assert step.step == filaments.recommended_time_step().step
    integrator = filaments.create_integrator(system, 10 * step.step, checks=False)
    context = new_context(system, positions._value - [0, 0, 30.0], integrator)
    assert energy_of(context) > 1e3
    integrator.step(100)
    heights = positions_of(context)[filaments.bead_indices[0], 2]
    assert heights.max() < -50.0 + 1e-2 and heights.min() > -150.0 - 1e-2


@pytest.mark.slow
def test_filaments_between_walls_are_those_of_weighted_draws():
    """Elements between walls that are closer than they are long: where middles are, how they lie, and bends."""
    draws, samples, copies, width, stiffness = 200000, 300, 1200, 80.0, 0.5
    generator, element = np.random.default_rng(5), BEAM.beam_element(TEMPERATURE)
    # The elements of one chain, turned at random.
    chain = draw_beam(element, draws, KT, generator, np.zeros(3), None, False)
    nodes, controls = (np.stack([own[:-1], own[1:]], axis=1) for own in chain)
    turns, origins = Rotation.random(draws, random_state=2), nodes[:, :1].copy()
    nodes, controls = (
        np.stack([turns.apply(own[:, end] - origins[:, 0]) for end in (0, 1)], axis=1) for own in (nodes, controls)
    )
    middles = element_points(nodes, controls, [0.5])[:, 0]
    moved = np.zeros((draws, 1, 3))
    moved[:, 0, 2] = generator.uniform(-0.6 * width, 0.6 * width, draws)
    nodes, controls = nodes - middles + moved, controls - middles + moved

    def measure(nodes, controls):
        depth = np.maximum(0.0, np.abs(element_points(nodes, controls, BEADS)[:, 0, :, 2]) - 0.5 * width)
        chords = nodes[:, 1] - nodes[:, 0]
        order = chords[:, 2] ** 2 / np.sum(chords**2, axis=1)
        bends = element_energies(nodes, controls, element)[1][:, 0] / KT
        middle = element_points(nodes, controls, [0.5])[:, 0, 0, 2]
        return np.sum(depth**2, axis=1), (middle / width) ** 2, order, bends

    energy, *values = measure(nodes, controls)
    weights = np.exp(-0.5 * stiffness * energy / KT)
    weights /= weights.sum()
    assert 1.0 / np.sum(weights**2) > 0.05 * draws
    expected = [float(weights @ each) for each in values]
    errors = [np.sqrt(np.sum((weights * (each - mean)) ** 2)) for each, mean in zip(values, expected)]
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine="compiled")
    for _ in range(copies):
        filaments.add_beads(filaments.add_straight(BEAM, 1, [0, 0, 0], [1, 0, 0]), LENGTH / 4 * unit.nanometer)
    _, system, positions = filaments.build()
    system.addForce(filament_wall_force(filaments, system, Slab([0, 0, 0], [0, 0, 1], width), stiffness))
    positions = positions._value
    chosen = generator.choice(draws, copies, p=weights)
    indices = [np.array(own) for own in (filaments.node_indices, filaments.control_point_indices)]
    for own, drawn in zip(indices, (nodes, controls)):
        positions[own] = drawn[chosen]
    integrator = filaments.create_integrator(system, filaments.recommended_time_step(system=system), random_seed=3)
    context = new_context(system, positions, integrator, "CPU")
    integrator.step(50)
    measured = []
    for _ in range(samples):
        integrator.step(4)
        now = positions_of(context)
        measured.append(measure(*(now[own] for own in indices))[1:])
    means = np.mean(measured, axis=0)
    for mean, value, uncertainty, least in zip(means, expected, errors, (0.0125, 0.0125, 0.0125)):
        error = np.hypot(np.std(mean, ddof=1) / np.sqrt(copies), uncertainty)
        print(np.mean(mean), value, error)
        assert error < least * value
        assert abs(np.mean(mean) - value) < SIGMAS * error + 0.01 * value
