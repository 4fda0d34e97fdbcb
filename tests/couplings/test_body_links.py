"""Rigid bodies on links and in walls: their equilibrium beside closed forms, quadrature and Monte Carlo."""

import numpy as np
import pytest

from openmm_cylchain import F_ACTIN, MICROTUBULE, Body, Crosslinks, Filaments, Sphere, filament_wall_force
from openmm_cylchain.filaments.body import random_rotation
from support.contexts import new_context, positions_of
from support.solvent import KT, TEMPERATURE, VISCOSITY

MICROSECOND = 1e6


def _far_filament(filaments):
    filaments.add_straight(F_ACTIN, 2, [1e5, 0, 0], [1, 0, 0], clamped=[0, 1])


def _check_mean(samples, expected, largest):
    """Samples (times, copies) beside an exact mean; an error of the share ``largest`` would fail."""
    of_copies = np.mean(samples, axis=0)
    error = of_copies.std() / np.sqrt(len(of_copies))
    assert 4 * error < largest * abs(expected)
    assert of_copies.mean() == pytest.approx(expected, abs=4 * error)


@pytest.mark.sample(r"^0\.2|^20")
@pytest.mark.parametrize("step", [0.2, 2.0, 20.0])
def test_two_springs(step):
    """Opposite points of a sphere on springs to two points: its direction has the weight exp(c cos)."""
    radius, count, sharpness = 50.0, 400, 60.0
    stiffness = sharpness * KT / (2 * radius**2)
    filaments = Filaments(VISCOSITY, TEMPERATURE)
    _far_filament(filaments)
    for _ in range(count):
        filaments.add_body(Body.sphere(radius, [[radius, 0, 0], [-radius, 0, 0]]), [0, 0, 0])
    _, system, positions = filaments.build()
    links = Crosslinks(stiffness, 0.0)
    for own in filaments.body_indices:
        links.add_many(None, [(int(own[1]), (radius, 0, 0)), (int(own[2]), (-radius, 0, 0))])
    links.add_to(system)
    integrator = filaments.create_integrator(system, step * MICROSECOND, random_seed=2, checks=False)
    context = new_context(system, positions, integrator, "CPU")
    indices = np.array(filaments.body_indices)
    bends, squares = [], []
    relaxation = Body.sphere(radius).rotational_friction(VISCOSITY)[0, 0] / (2 * stiffness * radius**2)
    interval = max(1, round(0.5 * relaxation / (step * MICROSECOND)))
    integrator.step(10 * interval)
    for _ in range(30):
        integrator.step(interval)
        found = positions_of(context)[indices]
        bends.append(1 - (found[:, 1] - found[:, 2])[:, 0] / (2 * radius))
        squares.append(np.sum(found[:, 0] ** 2, axis=1))
    _check_mean(bends, 1 - (1 / np.tanh(sharpness) - 1 / sharpness), 0.1)
    _check_mean(squares, 3 * KT / (2 * stiffness), 0.1)


def _monte_carlo(radius, stiffness, rest, copies, moves):
    """Distances of the centres of two spheres, and cosines of their arms, for a spring between points on them."""
    generator = np.random.default_rng(4)
    centres = np.zeros((copies, 2, 3))
    centres[:, 1, 0] = 2 * radius + rest
    turns = np.array([[np.eye(3), np.diag([-1, -1, 1.0])]] * copies)

    def energy(centres, turns):
        ends = centres + radius * turns[..., 0]
        return 0.5 * stiffness / KT * (np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1) - rest) ** 2

    now, found = energy(centres, turns), []
    for move in range(moves):
        body = generator.integers(2)
        new_centres, new_turns = centres.copy(), turns.copy()
        new_centres[:, body] += generator.normal(scale=0.5 * rest, size=(copies, 3))
        axis = generator.integers(3)
        angles = generator.normal(scale=0.8, size=copies)
        rotation = np.zeros((copies, 3, 3))
        first, second = (axis + 1) % 3, (axis + 2) % 3
        rotation[:, axis, axis] = 1
        rotation[:, first, first] = rotation[:, second, second] = np.cos(angles)
        rotation[:, second, first] = np.sin(angles)
        rotation[:, first, second] = -np.sin(angles)
        new_turns[:, body] = rotation @ new_turns[:, body]
        new = energy(new_centres, new_turns)
        taken = generator.random(copies) < np.exp(now - new)
        centres[taken], turns[taken], now[taken] = new_centres[taken], new_turns[taken], new[taken]
        if move > moves // 4 and move % 20 == 0:
            found.append((np.linalg.norm(centres[:, 1] - centres[:, 0], axis=1), now.copy()))
    return np.mean(found, axis=(0, 2))


@pytest.mark.slow
@pytest.mark.parametrize("step", [0.3, 3.0])
def test_two_spheres_on_a_spring(step):
    """A spring of a rest length between points on two spheres, beside Monte Carlo."""
    radius, rest, copies = 30.0, 20.0, 300
    stiffness = 100 * KT / rest**2
    body = Body.sphere(radius, [[radius, 0, 0]])
    filaments = Filaments(VISCOSITY, TEMPERATURE)
    _far_filament(filaments)
    for _ in range(copies):
        filaments.add_body(body, [0, 0, 0])
        filaments.add_body(body, [2 * radius + rest, 0, 0], np.diag([-1, -1, 1.0]))
    _, system, positions = filaments.build()
    links = Crosslinks(stiffness, rest)
    indices = np.array(filaments.body_indices)
    links.add_many(None, indices[:, 1].reshape(-1, 2))
    links.add_to(system)
    integrator = filaments.create_integrator(system, step * MICROSECOND, random_seed=2, checks=False)
    context = new_context(system, positions, integrator, "CPU")
    # Spheres forget how they were turned in 100 us.
    interval = round(40 / step)
    integrator.step(6 * interval)
    distances, energies = [], []
    for _ in range(10):
        integrator.step(interval)
        found = positions_of(context)[indices].reshape(copies, 2, -1, 3)
        distances.append(np.linalg.norm(found[:, 1, 0] - found[:, 0, 0], axis=1))
        lengths = np.linalg.norm(found[:, 1, 1] - found[:, 0, 1], axis=1)
        energies.append(0.5 * stiffness / KT * (lengths - rest) ** 2)
    distance, energy = _monte_carlo(radius, stiffness, rest, 1500, 4000)
    _check_mean(distances, distance, 0.05)
    _check_mean(energies, energy, 0.1)


@pytest.mark.parametrize("step", [pytest.param(1.0, marks=pytest.mark.slow), 100.0])
def test_aster_in_a_trap(step):
    """Microtubules on stiff links all around a sphere that a spring holds: the sphere has the energy of its spring, and
    the links that of theirs."""
    radius, count, copies = 200.0, 8, 12
    trap, stiff = 0.01, 500.0
    generator = np.random.default_rng(3)
    directions = generator.normal(size=(count, 3))
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    body = Body.sphere(radius, radius * directions)
    filaments = Filaments(VISCOSITY, TEMPERATURE)
    for copy in range(copies):
        centre = np.array([0, 1e4 * copy, 0])
        for direction in directions:
            filaments.add_straight(MICROTUBULE, 3, centre + radius * direction, direction)
        filaments.add_body(body, centre)
    _, system, positions = filaments.build()
    links, indices = Crosslinks(stiff, 0.0), np.array(filaments.body_indices)
    nodes = np.array([own[0] for own in filaments.node_indices]).reshape(copies, count)
    for copy in range(copies):
        links.add_many(None, np.stack([nodes[copy], indices[copy, 1 : 1 + count]], axis=1))
        links.add(None, int(indices[copy, 0]), (0, 1e4 * copy, 0), stiffness=trap)
    links.add_to(system)
    integrator = filaments.create_integrator(system, step * MICROSECOND, random_seed=2, checks=False)
    context = new_context(system, positions, integrator, "CPU")
    squares, lengths = [], []
    for _ in range(60):
        integrator.step(400 if step < 10 else 40)
        found = positions_of(context)
        squares.append(np.sum((found[indices[:, 0]] - np.arange(copies)[:, None] * [0, 1e4, 0]) ** 2, axis=1))
        lengths.append(np.sum((found[nodes] - found[indices[:, 1 : 1 + count]]) ** 2, axis=(1, 2)))
    _check_mean(lengths, 3 * KT / stiff * count, 0.1)
    _check_mean(squares[10:], 3 * KT / trap, 0.35)


@pytest.mark.parametrize("planar", [False, True])
@pytest.mark.parametrize(("stiffness", "step"), [(1e4, 1e9), (1.0, 1e9), (0.01, 1e11)])
def test_without_noise_they_rest_where_links_are_at_rest(planar, stiffness, step):
    """Two links to where their places are, one of them at the origin, whose coordinates round to nothing."""
    filaments = Filaments(VISCOSITY, 0.0)
    filaments.add_body(Body.sphere(100, [[100, 0, 0]]), [0, 0, 0], planar=planar)
    _, system, positions = filaments.build()
    links = Crosslinks(stiffness, 0.0)
    links.add_many(None, [(0, (0.0, 0.0, 0.0)), (1, (0.0, 100.0, 0.0))])
    links.add_to(system)
    context = new_context(system, positions, filaments.create_integrator(system, step, checks=False), "CPU")
    context.getIntegrator().step(300)
    np.testing.assert_allclose(positions_of(context)[:2], [[0, 0, 0], [0, 100, 0]], atol=1e-6)


@pytest.mark.parametrize("step", [pytest.param(10.0, marks=pytest.mark.slow), 300.0])
def test_sphere_in_a_spherical_wall(step):
    """The distance of a sphere from the middle of a soft wall around it, beside quadrature."""
    radius, room, stiffness, copies = 50.0, 150.0, 0.1, 300
    filaments = Filaments(VISCOSITY, TEMPERATURE)
    filaments.add_straight(F_ACTIN, 1, [0, 0, -50], [0, 0, 1], clamped=[0])
    for _ in range(copies):
        filaments.add_body(Body.sphere(radius), [0, 0, 0])
    _, system, positions = filaments.build()
    centres = [int(own[0]) for own in filaments.body_indices]
    wall = Sphere([0, 0, 0], room)
    system.addForce(filament_wall_force(filaments, system, wall, stiffness, particles=centres, particle_radius=radius))
    integrator = filaments.create_integrator(system, step * MICROSECOND, random_seed=2, checks=False)
    context = new_context(system, positions, integrator, "CPU")
    distances = []
    for _ in range(20):
        integrator.step(round(2000 / step))
        distances.append(np.linalg.norm(positions_of(context)[centres], axis=1))
    r = np.linspace(0, 2 * room, 20001)
    weight = r**2 * np.exp(-0.5 * stiffness / KT * np.maximum(r - (room - radius), 0) ** 2)
    _check_mean(distances, (weight * r).sum() / weight.sum(), 0.05)


def test_random_orientations_begin_anywhere():
    """A body may begin turned by any rotation, and stays rigid."""
    generator = np.random.default_rng(7)
    body = Body(generator.normal(size=(6, 3)) * 40, 5.0)
    filaments = Filaments(VISCOSITY, TEMPERATURE)
    _far_filament(filaments)
    for _ in range(20):
        filaments.add_body(body, [0, 0, 0], random_rotation(generator))
    _, system, positions = filaments.build()
    links = Crosslinks(100.0, 30.0)
    indices = np.array(filaments.body_indices)
    links.add_many(None, np.stack([indices[:-1, 0], indices[1:, 3]], axis=1))
    links.add_to(system)
    integrator = filaments.create_integrator(system, 0.2 * MICROSECOND, random_seed=2, checks=False)
    context = new_context(system, positions, integrator, "CPU")
    integrator.step(300)
    found = positions_of(context)[indices]
    shapes = np.linalg.norm(found[:, :, None] - found[:, None], axis=-1)
    assert shapes == pytest.approx(
        np.linalg.norm(body.points[:, None] - body.points[None], axis=-1)[None].repeat(20, 0)
    )
