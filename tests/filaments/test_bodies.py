"""Rigid bodies: what they are, what they refuse, and how they move by themselves, in a flow and from a checkpoint."""

import math

import numpy as np
import openmm
import pytest
from openmm import unit

from openmm_cylchain import F_ACTIN, Body, Crosslinks, Filaments, Flow, InputError
from openmm_cylchain.filaments.body import random_rotation, rotation_between
from support.contexts import new_context, positions_of
from support.solvent import KT, TEMPERATURE, VISCOSITY

MICROSECOND = 1e6
NUMBER = VISCOSITY.value_in_unit(unit.pascal * unit.second) * 602214.076


def _with_body(body, position=(0, 0, 0), **options):
    filaments = Filaments(VISCOSITY, TEMPERATURE)
    # Far away: there must be one.
    filaments.add_straight(F_ACTIN, 2, [1e4, 0, 0], [1, 0, 0], clamped=[0, 1])
    filaments.add_body(body, position, **options)
    return filaments


def _bodies(body, count, **options):
    generator = np.random.default_rng(5)
    filaments = _with_body(body, **options)
    for number in range(1, count):
        orientation = random_rotation(generator, options.get("planar", False))
        filaments.add_body(body, [1000 * number, 0, 0], orientation, **options)
    return filaments


def test_friction_of_a_sphere():
    body = Body.sphere(0.05 * unit.micrometer, [[50, 0, 0]])
    assert body.friction(VISCOSITY) == pytest.approx(6 * np.pi * NUMBER * 50)
    assert body.rotational_friction(NUMBER) == pytest.approx(8 * np.pi * NUMBER * 50**3 * np.eye(3))
    # With a point on it and a second one that tells how it is turned.
    assert body.points.shape == (3, 3) and list(body.radii) == [50, 0, 0]
    alone = Body.sphere(50)
    assert alone.points.shape == (3, 3) and not alone.has_places and body.has_places
    place = 1 / (1 / body.friction(NUMBER) + 50**2 / body.rotational_friction(NUMBER)[0, 0])
    assert body.place_frictions(NUMBER)[:2] == pytest.approx([body.friction(NUMBER), place])


def test_friction_of_two_spheres():
    body = Body(np.array([[0, 0, 0], [0, 0, 100]]) * unit.nanometer, [10, 30] * unit.nanometer)
    assert body.centre == pytest.approx([0, 0, 75])
    assert body.friction(NUMBER) == pytest.approx(6 * np.pi * NUMBER * 40)
    own = 8 * np.pi * NUMBER * (10**3 + 30**3)
    across = 6 * np.pi * NUMBER * (10 * 75**2 + 30 * 25**2)
    assert body.rotational_friction(NUMBER) == pytest.approx(np.diag([own + across, own + across, own]))
    # One beside the line.
    assert len(body.points) == 3


@pytest.mark.parametrize("viscosity", [0.0, -1.0, math.inf, math.nan, "thick"])
def test_a_viscosity_must_be_positive(viscosity):
    with pytest.raises(InputError, match="Body: viscosity"):
        Body.sphere(10, viscosity=viscosity)


@pytest.mark.parametrize(
    ("points", "radii", "message"),
    [
        ([], 1, "shape"),
        ([[0, 0]], 1, "shape"),
        ([[0, 0, np.nan]], 1, "finite"),
        ([[0, 0, 0], [0, 0, 0]], 1, "points 0 and 1 are in one place"),
        ([[0, 0, 0]], [1, 2], "must be one length, or 1 of them"),
        ([[0, 0, 0]], 0, "one must be above zero"),
        ([[0, 0, 0]], -1, "must not be negative"),
        ([[0, 0, 0]], 1 * unit.second, "unit"),
    ],
)
def test_what_is_no_body(points, radii, message):
    with pytest.raises(InputError, match=message):
        Body(points, radii)


@pytest.mark.parametrize("points", [[1, 2, 3], [[1, 2]], [1, 2, 3, 4, 5, 6], [[1, 2, 3, 4]] * 3])
def test_places_on_a_sphere_are_of_the_shape_of_points(points):
    with pytest.raises(InputError, match="shape"):
        Body.sphere(10, points)


def test_what_is_refused():
    body = Body.sphere(10)
    filaments = Filaments(VISCOSITY, TEMPERATURE)
    with pytest.raises(InputError, match="must be an object of the class Body"):
        filaments.add_body("sphere", [0, 0, 0])
    with pytest.raises(InputError, match="position"):
        filaments.add_body(body, [0, 0])
    for orientation in (np.zeros((3, 3)), -np.eye(3), np.eye(2), "x", [[1, 2], [3]]):
        with pytest.raises(InputError, match="rotation matrix"):
            filaments.add_body(body, [0, 0, 0], orientation)
    with pytest.raises(InputError, match="portable engine has no rigid bodies"):
        Filaments(VISCOSITY, TEMPERATURE, engine="portable").add_body(body, [0, 0, 0])
    filaments = _with_body(body)
    with pytest.raises(InputError, match="not in a System"):
        filaments.body_indices  # noqa: B018
    _, system, positions = filaments.build()
    with pytest.raises(InputError, match="comes too late"):
        filaments.add_body(body, [0, 0, 0])
    other = new_context(system, positions, openmm.LangevinMiddleIntegrator(300, 1, 0.001))
    with pytest.raises(openmm.OpenMMException, match="would tear apart"):
        other.getIntegrator().step(1)
    with pytest.raises(InputError, match="scheme 'implicit' alone"):
        filaments.create_integrator(system, 1, scheme="midpoint")
    integrator = filaments.create_integrator(system, 1)
    deformed = positions._value.copy()
    deformed[filaments.body_indices[0][1], 0] += 1
    context = new_context(system, deformed, integrator, "CPU")
    with pytest.raises(openmm.OpenMMException, match="Body 0 is deformed"):
        integrator.step(1)
    context.setPositions(positions)
    integrator.step(1)


def test_friction_of_particles_leaves_bodies_out():
    filaments = _with_body(Body.sphere(10))
    _, system, _ = filaments.build()
    system.addParticle(1.0)
    with pytest.raises(InputError, match="1 particles outside filaments can move"):
        filaments.create_integrator(system, 1)
    friction = filaments.create_integrator(system, 1, particle_friction=[5.0], checks=False).getParticleFrictions()
    assert list(friction) == [system.getNumParticles() - 1]


def test_topology():
    filaments = _with_body(Body.sphere(10, name="Pole"))
    topology, _, positions = filaments.build()
    atoms = [atom for atom in topology.atoms() if atom.name == "BOD"]
    assert [atom.index for atom in atoms] == list(filaments.body_indices[0])
    assert {atom.residue.name for atom in atoms} == {"Pole"}
    assert positions._value[filaments.body_indices[0]] == pytest.approx(filaments.bodies[0].positions)


@pytest.mark.parametrize(("step", "times"), [(0.01, None), (20.0, None), (20.0, 5.0)])
def test_diffusion(step, times):
    """Also in a viscosity of its own."""
    radius, count = 20.0, 1500
    body = Body.sphere(radius, [[radius, 0, 0]], viscosity=None if times is None else times * VISCOSITY)
    assert body.friction(VISCOSITY) == pytest.approx(6 * np.pi * NUMBER * radius * (times or 1.0))
    assert body.rotational_friction(NUMBER)[0, 0] == pytest.approx(8 * np.pi * NUMBER * radius**3 * (times or 1.0))
    filaments = _bodies(body, count)
    _, system, positions = filaments.build()
    integrator = filaments.create_integrator(system, step * MICROSECOND, random_seed=1, checks=False)
    context = new_context(system, positions, integrator, "CPU")
    integrator.step(2)
    indices = np.array(filaments.body_indices)
    before, after = positions._value[indices], positions_of(context)[indices]
    squares = np.sum((after[:, 0] - before[:, 0]) ** 2, axis=1)
    time = 2 * step * MICROSECOND
    expected = 6 * KT / body.friction(VISCOSITY) * time
    assert squares.mean() == pytest.approx(expected, abs=4 * squares.std() / np.sqrt(count))
    arms = (after[:, 1] - after[:, 0]) / radius
    assert np.linalg.norm(arms, axis=1) == pytest.approx(1, abs=1e-9)
    cosines = np.sum(arms * (before[:, 1] - before[:, 0]), axis=1) / radius
    decay = np.exp(-2 * KT / body.rotational_friction(VISCOSITY)[0, 0] * time)
    assert cosines.mean() == pytest.approx(decay, abs=4 * cosines.std() / np.sqrt(count))


def test_planar_bodies_keep_to_their_plane():
    body = Body.sphere(20, [[20, 0, 0]])
    filaments = _bodies(body, 200, planar=True)
    _, system, positions = filaments.build()
    links = Crosslinks(1000.0, 0.0)
    for own in filaments.body_indices:
        links.add(None, int(own[1]), positions._value[own[1]])
    links.add_to(system)
    integrator = filaments.create_integrator(system, MICROSECOND, random_seed=1, checks=False)
    context = new_context(system, positions, integrator, "CPU")
    integrator.step(20)
    indices = np.array(filaments.body_indices)
    moved = positions_of(context)[indices] - positions._value[indices]
    assert np.abs(moved[..., 2]).max() < 1e-9
    # The place is where it is held, in two directions.
    squares = np.sum(moved[:, 1] ** 2, axis=1)
    assert squares.mean() == pytest.approx(2 * KT / 1000, abs=4 * squares.std() / np.sqrt(len(squares)))


def test_shear_flow_turns_a_body():
    body = Body.sphere(20, [[20, 0, 0]])
    filaments = _with_body(body)
    _, system, positions = filaments.build()
    rate = 1e-6
    flow = Flow(gradient=[[0, rate, 0], [0, 0, 0], [0, 0, 0]])
    integrator = filaments.create_integrator(system, 0.1 / rate, temperature=0, flow=flow, checks=False)
    context = new_context(system, positions, integrator, "CPU")
    integrator.step(10)
    centre, end = positions_of(context)[filaments.body_indices[0][:2]]
    assert centre == pytest.approx(0, abs=1e-9)
    # Half of the curl, for ten steps.
    assert (end - centre) / 20 == pytest.approx([np.cos(0.5), -np.sin(0.5), 0], abs=1e-9)


def _linked():
    filaments = _bodies(Body.sphere(20, [[20, 0, 0], [0, 0, -20]]), 4)
    _, system, positions = filaments.build()
    links = Crosslinks(50.0, 10.0)
    for number in range(3):
        first, second = filaments.body_indices[number], filaments.body_indices[number + 1]
        links.add(None, int(first[1]), int(second[2]), rest_length=900)
    links.add_to(system)
    return filaments, system, positions


@pytest.mark.parametrize("threads", ["1", "2"])
def test_restart_to_the_bit(threads):
    filaments, system, positions = _linked()

    def context_of(system=system):
        integrator = filaments.create_integrator(system, MICROSECOND, random_seed=3, checks=False)
        return new_context(system, positions, integrator, "CPU", {"Threads": threads})

    # One from XML moves bodies alike.
    copied = context_of(openmm.XmlSerializer.clone(system))
    whole = context_of()
    whole.getIntegrator().step(20)
    checkpoint = whole.createCheckpoint()
    whole.getIntegrator().step(20)
    other = context_of()
    other.loadCheckpoint(checkpoint)
    other.getIntegrator().step(20)
    assert np.array_equal(positions_of(whole), positions_of(other))
    copied.getIntegrator().step(40)
    assert np.array_equal(positions_of(whole), positions_of(copied))


def test_rotations():
    generator = np.random.default_rng(2)
    points = generator.normal(size=(5, 3))
    for planar in (False, True):
        rotation = random_rotation(generator, planar)
        assert rotation @ rotation.T == pytest.approx(np.eye(3)) and np.linalg.det(rotation) == pytest.approx(1)
        assert rotation_between(points, 3 + points @ rotation.T) == pytest.approx(rotation)
    turned = np.array([random_rotation(generator) for _ in range(4000)])
    # Of all entries, the mean is zero and the mean square a third.
    assert np.abs(turned.mean(axis=0)).max() < 4 / np.sqrt(3 * 4000)
    assert (turned**2).mean(axis=0) == pytest.approx(1 / 3, abs=4 * 0.3 / np.sqrt(4000))
