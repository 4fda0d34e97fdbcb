"""CylinderChainWallForce: forces of every shape, XML and Contexts, and walls in the equations of implicit steps."""

import copy
import pickle

import numpy as np
import openmm
import pytest
from openmm import unit

from openmm_cylchain import (
    F_ACTIN,
    Box,
    Capsule,
    Cylinder,
    Ellipsoid,
    Filaments,
    InputError,
    Plane,
    Slab,
    Sphere,
    Torus,
    constant_force,
    filament_wall_force,
    prism_faces,
    wall_force,
    wall_forces,
)
from openmm_cylchain.couplings.walls import as_filament_wall_force
from openmm_cylchain.engines.compiled import plugin
from openmm_cylchain.time_steps.explicit_forces import ExplicitForces
from support.contexts import energy_of, forces_of, new_context, positions_of
from support.platforms import ON_COMPILED_PLATFORMS
from support.solvent import KT, TEMPERATURE, VISCOSITY
from support.wall_shapes import SHAPES

ACTIN = F_ACTIN.with_segment_length(100)
STIFFNESS = 7.0
SMALLER = [
    (Plane([1, 2, 3], [0, 0, 2]), Plane([1, 2, 3.4], [0, 0, 1])),
    (Slab([1, 2, 3], [0, 1, 1], 3), Slab([1, 2, 3], [0, 1, 1], 2.2)),
    (Sphere([0, 1, 0], 2), Sphere([0, 1, 0], 1.6)),
    (Cylinder([0, 1, 0], [1, 1, 0], 2), Cylinder([0, 1, 0], [1, 1, 0], 1.6)),
    (Capsule([0, 1, 0], [1, 1, 0], 3, 1), Capsule([0, 1, 0], [1, 1, 0], 3, 0.6)),
    (Torus([0, 1, 0], [1, 1, 0], 3, 1), Torus([0, 1, 0], [1, 1, 0], 3, 0.6)),
    (Box([-1, -2, -1], [1, 2, 3]), Box([-0.6, -1.6, -0.6], [0.6, 1.6, 2.6])),
    (Ellipsoid([0, 1, 0], [2, 2, 2]), Ellipsoid([0, 1, 0], [1.6, 1.6, 1.6])),
]


def _name(shape):
    return type(shape[0] if isinstance(shape, tuple) else shape).__name__


def _filaments(count=30, segments=3):
    filaments = Filaments(VISCOSITY, TEMPERATURE)
    for number in range(count):
        filaments.add_straight(ACTIN, segments, [0, 200 * number, 0], [1, 0, 0])
    topology, system, positions = filaments.build()
    return filaments, system, np.array(positions._value)


def _alone(system, force):
    """A System with the force alone."""
    result = openmm.System()
    for _ in range(system.getNumParticles()):
        result.addParticle(1.0)
    result.addForce(copy.deepcopy(force))
    return result


def _points(count, seed=3):
    return np.random.default_rng(seed).uniform(-4, 4, size=(count, 3))


# Energies and forces


@ON_COMPILED_PLATFORMS
@pytest.mark.parametrize("shape", SHAPES, ids=_name)
def test_energy_and_forces_are_those_of_wall_force(shape, platform):
    filaments, system, _ = _filaments()
    count = system.getNumParticles()
    stiffness = STIFFNESS * unit.kilojoule_per_mole / unit.nanometer**2
    force = filament_wall_force(filaments, system, shape, stiffness)
    points = _points(count)
    points[:2] = [[0.1, 0.2, 0.3], [0.1, 0, 0]]
    context = new_context(_alone(system, force), points, platform=platform)
    energies = 0.5 * STIFFNESS * shape.square_depth(points)
    assert energy_of(context) == pytest.approx(energies.sum(), rel=max(1e-12, platform.tolerance))
    assert energies.sum() > 100
    forces = forces_of(context)
    other = new_context(_alone(system, wall_force(shape, STIFFNESS, range(count))), points)
    np.testing.assert_allclose(forces, forces_of(other), atol=platform.tolerance * np.abs(forces).max())
    width = 1e-5
    for axis in range(3):
        step = width * np.eye(3)[axis]
        slope = (shape.square_depth(points + step) - shape.square_depth(points - step)) / (2 * width)
        np.testing.assert_allclose(forces[:, axis], -0.5 * STIFFNESS * slope, atol=max(1e-3, 40 * platform.tolerance))


@pytest.mark.parametrize("shape, smaller", SMALLER, ids=[_name(one) for one in SMALLER])
def test_a_radius_makes_the_shape_smaller(shape, smaller):
    filaments, system, _ = _filaments()
    points = _points(system.getNumParticles())
    expected = energy_of(
        new_context(_alone(system, filament_wall_force(filaments, system, smaller, STIFFNESS)), points)
    )
    assert expected > 100
    for radius in (0.4, 4 * unit.angstrom, np.full(len(filaments), 0.4)):
        force = filament_wall_force(filaments, system, shape, STIFFNESS, radius)
        assert energy_of(new_context(_alone(system, force), points)) == pytest.approx(expected, rel=1e-12)


def test_filaments_and_particles_have_radii_of_their_own():
    filaments, system, _ = _filaments(2, 1)
    outside = system.addParticle(1.0)
    force = filament_wall_force(
        filaments, system, Plane([0, 0, 0], [0, 0, 1]), 2.0, [1, 2], [outside], 3 * unit.nanometer
    )
    heights = np.array([0.5, 5, 1, -1, 2])
    points = np.column_stack([np.zeros((5, 2)), heights])
    assert [force.getParticle(index) for index in range(5)] == list(range(5))
    assert force.getParticleRadius(4) == 3 * unit.nanometer
    np.testing.assert_allclose(forces_of(new_context(_alone(system, force), points))[:, 2], [1, 0, 2, 6, 2])


def test_a_wall_holds_some_filaments_alone():
    """Of rods that a force drives at a plane, those stay before it that it holds; others move on at their speed."""
    filaments = Filaments(VISCOSITY, 0.0)
    for number in range(3):
        filaments.add_straight(ACTIN, 1, [0, 200 * number, 100], [1, 0, 0])
    _, system, positions = filaments.build()
    outside = system.addParticle(1.0)
    wall = filament_wall_force(
        filaments, system, Plane([0, 0, 0], [0, 0, 1]), 2.0, [1, 3], [outside], 5, numbers=[2, 0]
    )
    held = [wall.getParticle(index) for index in range(5)]
    assert held == [*filaments.node_indices[2], *filaments.node_indices[0], outside]
    assert [wall.getParticleRadius(index)._value for index in range(5)] == [1, 1, 3, 3, 5]
    system.addForce(wall)
    speed = 1e-6
    friction = ACTIN.segment_friction(VISCOSITY, TEMPERATURE, 1).perpendicular
    system.addForce(constant_force(range(6), [0, 0, -0.5 * speed * friction]))
    integrator = filaments.create_integrator(system, 2e6, random_seed=1, particle_friction=1e3, checks=False)
    context = new_context(system, np.vstack([positions._value, [0, 900, 900]]), integrator)
    integrator.step(500)
    heights = positions_of(context)[:6, 2]
    np.testing.assert_allclose(heights[2:4], 100 - 1e9 * speed, rtol=1e-6)
    depth = 0.5 * speed * friction / 2.0
    np.testing.assert_allclose(heights[[0, 1, 4, 5]], [3 - depth, 3 - depth, 1 - depth, 1 - depth], atol=1e-4)
    (found,) = wall_forces(context)
    on_filaments = found.on_filaments(filaments)._value
    assert not on_filaments[1].any() and np.all(on_filaments[[0, 2], 2] > 0)


# Force objects


@pytest.mark.parametrize("shape", SHAPES, ids=_name)
def test_copies_pickles_and_xml(shape):
    filaments, system, _ = _filaments()
    points = _points(system.getNumParticles())
    force = filament_wall_force(filaments, system, shape, STIFFNESS, 0.25)
    force.setForceGroup(3)
    force.setName("mine")
    expected = energy_of(new_context(_alone(system, force), points))
    xml = openmm.XmlSerializer.serialize(force)
    for other in (copy.deepcopy(force), pickle.loads(pickle.dumps(force)), openmm.XmlSerializer.deserialize(xml)):
        assert plugin.CylinderChainWallForce.isinstance(other)
        assert openmm.XmlSerializer.serialize(other) == xml
        assert energy_of(new_context(_alone(system, other), points)) == expected
    host = _alone(system, force)
    assert as_filament_wall_force(host.getForce(0)).getRegion()[0] == type(shape).__name__.lower()
    assert as_filament_wall_force(openmm.HarmonicBondForce()) is None


@ON_COMPILED_PLATFORMS
def test_a_wall_moves_in_one_of_two_contexts(platform):
    filaments, system, _ = _filaments(1, 1)
    host = _alone(system, filament_wall_force(filaments, system, Plane([0, 0, 0], [0, 0, 1]), 2.0))
    force = as_filament_wall_force(host.getForce(0))
    contexts = [new_context(host, [[0, 0, 1], [5, 0, -1]], platform=platform) for _ in range(2)]
    assert [energy_of(context) for context in contexts] == [1.0, 1.0]
    force.setRegion("plane", openmm.Vec3(0, 0, 3) * unit.nanometer, openmm.Vec3(0, 0, 2), 0)
    force.setStiffness(4 * unit.kilojoule_per_mole / unit.nanometer**2)
    force.setParticleRadius(1, 1)
    force.updateParametersInContext(contexts[1])
    assert [energy_of(context) for context in contexts] == pytest.approx([1.0, 2.0 * (2**2 + 5**2)])
    force.setRegion("sphere", openmm.Vec3(0, 0, 0), openmm.Vec3(0, 0, 0), 3)
    force.updateParametersInContext(contexts[1])
    assert energy_of(contexts[1]) == pytest.approx(2.0 * (np.sqrt(26) - 2) ** 2)
    force.setParticleRadius(0, 3)
    with pytest.raises(openmm.OpenMMException, match="does not fit"):
        force.updateParametersInContext(contexts[1])
    force.setParticleRadius(0, 0)
    force.addParticle(0)
    with pytest.raises(openmm.OpenMMException, match="cannot be added"):
        force.updateParametersInContext(contexts[1])


def test_bad_input_is_refused():
    filaments, system, positions = _filaments(2)
    sphere, origin, up = Sphere([0, 0, 0], 5), openmm.Vec3(0, 0, 0), openmm.Vec3(0, 0, 1)
    for arguments, message in (
        (("sphere", 1), "shape must be a Shape"),
        ((sphere, 0), "stiffness must be positive"),
        ((sphere, 1, -1), "radius cannot be negative"),
        ((sphere, 1, np.nan), "radius"),
        ((sphere, 1, 5), "radius must be below 5 nm to fit"),
        ((sphere, 1, [1, 1, 1]), "radius must be a number or have 2 entries"),
        ((sphere, 1, 1, [0]), "belongs to a filament"),
        ((sphere, 1, 1, [99]), "the System has 8 particles"),
        ((sphere, 1, 0, (), 0, [2]), "Filament 2 does not exist; there are 2"),
        ((sphere, 1, 0, (), 0, [1, 1]), "numbers must be those of different filaments"),
        ((sphere, 1, [1, 1], (), 0, [1]), "radius must be a number or have 1 entries"),
    ):
        with pytest.raises(InputError, match=message):
            filament_wall_force(filaments, system, *arguments)
    force = plugin.CylinderChainWallForce("plane", origin, up, 0, 1)
    for call, message in (
        (lambda: force.setRegion("cube", origin, up, 1), "There is no shape 'cube'"),
        (lambda: force.setRegion("plane", origin, origin, 1), "cannot be the zero vector"),
        (lambda: force.setRegion("sphere", origin, up, 0), "must be positive"),
        (lambda: force.setRegion("sphere", openmm.Vec3(0, np.nan, 0), up, 1), "finite"),
        (lambda: force.setRegion("box", up, origin, 0), "must exceed"),
        (lambda: force.setRegion("ellipsoid", origin, up, 0), "must be positive"),
        (lambda: force.setRegion("capsule", origin, origin, 1), "cannot be the zero vector"),
        (lambda: force.setRegion("capsule", origin, up, 0), "must be positive"),
        (lambda: force.setRegion("torus", origin, up, 1), "must have a larger radius than its tube"),
        (lambda: force.setRegion("torus", origin, up, 0), "must be positive"),
        (lambda: force.setStiffness(-1), "cannot be negative"),
        (lambda: force.addParticle(-1), "Illegal particle index"),
        (lambda: force.addParticle(0, -1), "cannot be negative"),
        (lambda: force.getParticle(0), "Index out of range"),
    ):
        with pytest.raises(openmm.OpenMMException, match=message):
            call()
    force.addParticle(8)
    system.addForce(force)
    with pytest.raises(openmm.OpenMMException, match="Illegal particle index: 8"):
        new_context(system, positions)


# Steps


def test_explicit_steps_are_those_of_wall_force():
    shape, ends = Sphere([0, 0, 0], 150), []
    for native in (True, False):
        filaments = Filaments(VISCOSITY, TEMPERATURE, engine="compiled")
        filaments.add_straight(ACTIN, 3, [-150, 10, 0], [1, 0, 0])
        _, system, positions = filaments.build()
        nodes = filaments.node_indices[0]
        wall = filament_wall_force(filaments, system, shape, 0.5) if native else wall_force(shape, 0.5, nodes)
        system.addForce(wall)
        step = filaments.recommended_time_step(system=system, scheme="midpoint")
        integrator = filaments.create_integrator(system, step, scheme="midpoint", random_seed=1)
        context = new_context(system, positions, integrator)
        integrator.step(200)
        ends.append((positions_of(context), step.step))
    np.testing.assert_allclose(ends[0][0], ends[1][0], atol=1e-8)
    assert ends[0][1] == ends[1][1]


def test_walls_bind_no_implicit_steps_but_those_of_virtual_sites():
    filaments, system, _ = _filaments(1, 4)
    others = [system.addParticle(10.0), system.addParticle(10.0), system.addParticle(0.0)]
    system.setVirtualSite(others[2], openmm.TwoParticleAverageSite(others[0], others[1], 0.5, 0.5))
    free = filaments.recommended_time_step()
    system.addForce(filament_wall_force(filaments, system, Sphere([0, 0, 0], 500), 100.0, particles=others[:2]))
    assert filaments.recommended_time_step(system=system, particle_friction=1e4).step == free.step
    assert not ExplicitForces(system, filaments, "implicit", 1e4).springs
    assert ExplicitForces(system, filaments, "midpoint", 1e4).springs
    system.addForce(filament_wall_force(filaments, system, Sphere([0, 0, 0], 500), 100.0, particles=others))
    (springs,) = ExplicitForces(system, filaments, "implicit", 1e4).springs
    assert "CylinderChainWallForce" in springs.force


def _with_particles(heights, friction, step, wall):
    """A Context with particles at heights, and an integrator; a filament is far away."""
    filaments = Filaments(VISCOSITY, TEMPERATURE)
    filaments.add_straight(ACTIN, 2, [0, 0, 1e5], [1, 0, 0])
    _, system, positions = filaments.build()
    particles = [system.addParticle(1.0) for _ in heights]
    points = np.column_stack([np.zeros((len(heights), 2)), heights])
    for own in wall if isinstance(wall, tuple) else (wall,):
        system.addForce(filament_wall_force(filaments, system, own, 20.0, particles=particles))
    integrator = filaments.create_integrator(system, step, random_seed=5, particle_friction=friction, checks=False)
    return new_context(system, np.vstack([positions._value, points]), integrator), integrator, len(positions)


def test_pressure_of_free_particles():
    """Before a wall, the density n has the pressure n k_B T, in steps much longer than its depth."""
    friction, step, count, depth = 3.4e5, 8e7, 8000, 160.0
    heights = (np.arange(count) + 0.5) / count * depth
    pushes = []
    near, far = (_with_particles(heights, friction, step, Plane([0, 0, at], [0, 0, 1])) for at in (0.0, -1e5))
    for _ in range(40):
        moved = []
        for context, integrator, first in (near, far):
            start = positions_of(context)
            start[first:, 2] = heights
            context.setPositions(start)
            integrator.step(1)
            moved.append(positions_of(context)[first:, 2])
        pushes.append((moved[0] - moved[1]).sum() * friction / step)
    expected = count / depth * KT
    error = np.std(pushes, ddof=1) / np.sqrt(len(pushes))
    assert 4 * error < 0.04 * expected
    assert abs(np.mean(pushes) - expected) < 0.03 * expected
    assert np.sqrt(2 * KT * step / friction) > 60 * np.sqrt(KT / 20.0)


@pytest.mark.slow
def test_particles_in_a_prism():
    """Energies at its sides and corners, and the mean place, from quadrature."""
    faces = prism_faces([[-2.0, -1.0], [2.5, -1.0], [-2.0, 2.0]])
    places = 12.0 * (np.arange(600) + 0.5) / 600 - 6.0
    grid = np.stack(np.meshgrid(places, places, [0.0], indexing="ij"), axis=-1).reshape(-1, 3)
    energies = 10.0 * sum(face.square_depth(grid) for face in faces)
    weights = np.exp(-energies / KT)
    weights /= weights.sum()
    expected = weights @ np.column_stack([energies, grid[:, :2]])
    context, integrator, first = _with_particles(np.zeros(800), 3.4e5, 4e4, faces)
    start = positions_of(context)
    start[first:] = np.random.default_rng(2).choice(grid, 800, p=weights)
    context.setPositions(start)
    found = []
    for _ in range(40):
        integrator.step(15)
        now = positions_of(context)[first:]
        found.append([10.0 * sum(face.square_depth(now) for face in faces).mean(), *now[:, :2].mean(axis=0)])
    error = np.std(found, axis=0, ddof=1) / np.sqrt(len(found))
    assert np.all(4 * error < [0.05 * expected[0], 0.06, 0.05])
    assert np.all(np.abs(np.mean(found, axis=0) - expected) < 4 * error), (np.mean(found, axis=0), expected, error)


def test_density_of_free_particles_is_even():
    thickness, friction, step, count = 400.0, 3.4e5, 4e7, 3000
    generator = np.random.default_rng(3)
    heights = generator.uniform(-0.5, 0.5, count) * thickness
    context, integrator, first = _with_particles(heights, friction, step, Slab([0, 0, 0], [0, 0, 1], thickness))
    counts = []
    for _ in range(60):
        integrator.step(10)
        found = np.abs(positions_of(context)[first:, 2]) / thickness
        counts.append(np.histogram(found, bins=np.linspace(0, 0.5, 6))[0] / count)
    # 40 nm each, with the surface excess in the last one.
    shares = np.mean(counts, axis=0)
    widths = np.full(5, 40.0) + np.sqrt(0.5 * np.pi * KT / 20.0) * np.array([0, 0, 0, 0, 1])
    error = np.max(np.std(counts, axis=0, ddof=1)) / np.sqrt(len(counts))
    assert 4 * error < 0.03 * 0.2
    np.testing.assert_allclose(shares, widths / widths.sum(), atol=4 * error + 0.002)


@pytest.mark.sample("^20")
@pytest.mark.slow
@pytest.mark.parametrize("stiffness", [1.0, 20.0])
def test_rods_between_walls_are_where_they_should_be(stiffness):
    """Heights and directions of rods in a slab that is narrower than they are long, against an integral."""
    length, thickness, chains = F_ACTIN.segment_length, 300.0, 800
    heights, cosines = np.meshgrid(np.linspace(-300, 300, 2401), np.linspace(-1, 1, 801), indexing="ij")

    def wall_energy(z):
        return 0.5 * stiffness * np.maximum(0.0, np.abs(z) - 0.5 * thickness) ** 2

    energy = wall_energy(heights + 0.5 * length * cosines) + wall_energy(heights - 0.5 * length * cosines)
    weight = np.exp(-energy / KT)
    generator = np.random.default_rng(4)
    filaments = Filaments(VISCOSITY, TEMPERATURE)
    for chosen in generator.choice(weight.size, size=chains, p=weight.ravel() / weight.sum()):
        height, cosine = heights.ravel()[chosen], cosines.ravel()[chosen]
        direction = np.array([np.sqrt(1 - cosine**2), 0.0, cosine])
        filaments.add_straight(F_ACTIN, 1, np.array([0, 0, height]) - 0.5 * length * direction, direction)
    _, system, positions = filaments.build()
    free = filaments.recommended_time_step()
    system.addForce(filament_wall_force(filaments, system, Slab([0, 0, 0], [0, 0, 1], thickness), stiffness))
    step = filaments.recommended_time_step(system=system)
    assert step.step == free.step
    integrator = filaments.create_integrator(system, step, random_seed=1)
    context = new_context(system, positions, integrator)
    found = []
    for _ in range(80):
        integrator.step(20)
        z = positions_of(context).reshape(chains, 2, 3)[:, :, 2]
        found.append([z.mean(axis=1) ** 2, ((z[:, 1] - z[:, 0]) / length) ** 2])
    found = np.mean(found, axis=0)
    for values, exact in zip(found, (heights**2, cosines**2)):
        exact = np.sum(exact * weight) / np.sum(weight)
        error = values.std(ddof=1) / np.sqrt(chains)
        assert 4 * error < 0.025 * exact
        assert abs(values.mean() - exact) < 0.03 * exact


@pytest.mark.parametrize("times", [1, 10])
def test_filaments_stay_in_a_sphere(times):
    radius, stiffness = 500.0, 1.0
    filaments = Filaments(VISCOSITY, TEMPERATURE)
    generator = np.random.default_rng(1)
    for direction in generator.normal(size=(60, 3)):
        direction /= np.linalg.norm(direction)
        filaments.add_straight(ACTIN, 8, generator.uniform(-100, 100, 3) - 360 * direction, direction)
    _, system, positions = filaments.build()
    system.addForce(filament_wall_force(filaments, system, Sphere([0, 0, 0], radius), stiffness))
    step = times * filaments.recommended_time_step().step
    integrator = filaments.create_integrator(system, step, random_seed=1, checks=False)
    context = new_context(system, positions, integrator)
    integrator.step(20)
    distances = []
    for _ in range(30):
        integrator.step(10)
        distances.append(np.linalg.norm(positions_of(context), axis=1))
    # A node's thermal depth is 1.6 nm; in a step it moves by 20 nm and more.
    assert np.max(distances) < radius + 4 * np.sqrt(KT / stiffness)
    assert np.mean(np.array(distances) > 450) > 0.03


def test_without_temperature_a_filament_comes_back_to_the_wall():
    filaments = Filaments(VISCOSITY, 0.0)
    filaments.add_straight(ACTIN, 3, [0, 0, -50], [1, 0, 0])
    _, system, positions = filaments.build()
    system.addForce(filament_wall_force(filaments, system, Plane([0, 0, 0], [0, 0, 1]), 20.0))
    integrator = filaments.create_integrator(system, 1e6, random_seed=1, checks=False)
    context = new_context(system, positions, integrator)
    integrator.step(20)
    # The first step leaves it bent by 0.4 nm, which takes longer.
    np.testing.assert_allclose(positions_of(context)[:, 2], 0.0, atol=0.1)
