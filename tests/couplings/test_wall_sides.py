"""Walls that keep what they hold outside, or on their surface: forces, XML, refusals, and what else holds it."""

import copy
import pickle

import numpy as np
import openmm
import pytest

from openmm_cylchain import (
    ACTIN_ATP,
    F_ACTIN,
    Body,
    BoxWarning,
    Crosslinker,
    Crosslinks,
    Cylinder,
    Ellipsoid,
    Filaments,
    Growth,
    Hand,
    InputError,
    Plane,
    Slab,
    Sphere,
    capsule_contact_force,
    constant_force,
    filament_wall_force,
    wall_forces,
)
from openmm_cylchain.engines.compiled import plugin
from support.contexts import energy_of, forces_of, new_context, positions_of, slopes_of
from support.platforms import ON_COMPILED_PLATFORMS
from support.solvent import KT, TEMPERATURE, VISCOSITY
from support.wall_shapes import SHAPES

STIFFNESS = 7.0
ONE_FACE = [shape for shape in SHAPES if len(shape.faces) == 1]
ACTIN = F_ACTIN.with_segment_length(100)


def _rods(count=12, **options):
    filaments = Filaments(VISCOSITY, TEMPERATURE)
    for number in range(count):
        filaments.add_straight(ACTIN, 1, [0, 200 * number, 0], [1, 0, 0])
    return (filaments, *filaments.build()[1:])


def _alone(system, force):
    result = openmm.System()
    for _ in range(system.getNumParticles()):
        result.addParticle(1.0)
    result.addForce(copy.deepcopy(force))
    return result


@ON_COMPILED_PLATFORMS
@pytest.mark.parametrize("side", ["outside", "surface"])
@pytest.mark.parametrize("shape", ONE_FACE, ids=lambda shape: type(shape).__name__)
def test_energies_and_forces(shape, side, platform):
    """Of depths that ``Face.depths`` has, or of the formula for ellipsoids; forces are slopes of energies."""
    filaments, system, _ = _rods(60)
    radius = 0.3
    points = np.random.default_rng(3).uniform(-2, 2, size=(system.getNumParticles(), 3))
    force = filament_wall_force(filaments, system, shape, STIFFNESS, radius, side=side)
    depths, _ = shape.depths(points)
    if isinstance(shape, Ellipsoid):
        apart = (points - shape.center) / shape.semi_axes
        s = np.linalg.norm(apart, axis=1)
        depths = (s - 1.0) * s / np.linalg.norm(apart / shape.semi_axes, axis=1)
    depths = depths + radius if side == "surface" else np.maximum(0.0, radius - depths)
    context = new_context(_alone(system, force), points, platform=platform)
    expected = 0.5 * STIFFNESS * np.sum(depths**2)
    assert expected > 1
    assert energy_of(context) == pytest.approx(expected, rel=max(1e-12, platform.tolerance))
    forces = forces_of(context)
    slopes = slopes_of(new_context(_alone(system, force), points), points, range(6), distance=1e-5)
    np.testing.assert_allclose(forces[:6], -slopes, atol=max(1e-3, 40 * platform.tolerance))
    (found,) = wall_forces(context)
    assert found.sums._value[0] == pytest.approx(forces.sum(axis=0), abs=max(1e-9, 100 * platform.tolerance))


def test_copies_pickles_and_xml():
    filaments, system, _ = _rods(2)
    read = plugin.CylinderChainWallForce.cast
    for side in ("inside", "outside", "surface"):
        force = filament_wall_force(filaments, system, Sphere([0, 0, 0], 50), STIFFNESS, side=side)
        xml = openmm.XmlSerializer.serialize(force)
        for other in (copy.deepcopy(force), pickle.loads(pickle.dumps(force)), openmm.XmlSerializer.deserialize(xml)):
            assert read(other).getSide() == side and openmm.XmlSerializer.serialize(other) == xml
    # As it was written before there were sides.
    old = openmm.XmlSerializer.deserialize(xml.replace('side="surface"', ""))
    assert read(old).getSide() == "inside"


def test_which_nodes_are_held():
    filaments = Filaments(VISCOSITY, TEMPERATURE)
    filaments.add_straight(ACTIN, 3, [0, 0, 0], [1, 0, 0])
    filaments.add_straight(ACTIN, 2, [0, 90, 0], [1, 0, 0])
    _, system, _ = filaments.build()
    for nodes, expected in (("all", range(7)), ("ends", [0, 3, 4, 6]), ("first", [0, 4]), ("last", [3, 6])):
        force = filament_wall_force(filaments, system, Plane([0, 0, 0], [0, 0, 1]), 1.0, nodes=nodes)
        assert [force.getParticle(index) for index in range(force.getNumParticles())] == list(expected)


def test_what_is_refused():
    filaments, system, positions = _rods(1)
    plane = Plane([0, 0, 0], [0, 0, 1])
    with pytest.raises(InputError, match="several faces"):
        filament_wall_force(filaments, system, Slab([0, 0, 0], [0, 0, 1], 50), 1.0, side="surface")
    with pytest.raises(InputError, match="one of inside, outside, surface"):
        filament_wall_force(filaments, system, plane, 1.0, side="on")
    with pytest.raises(InputError, match="one of all, ends, first, last"):
        filament_wall_force(filaments, system, plane, 1.0, nodes="middle")
    grown = Filaments(VISCOSITY, TEMPERATURE)
    growth = Growth(monomers=ACTIN_ATP, pool=1e-6, longest=1e3)
    grown.add_straight(ACTIN.with_segment_length(108), 2, [0, 0, 0], [1, 0, 0], growth=growth)
    with pytest.raises(InputError, match='Filament 0 grows: nodes must be "all"'):
        filament_wall_force(grown, grown.build()[1], plane, 1.0, nodes="ends")
    force = filament_wall_force(filaments, system, plane, 1.0, side="surface")
    with pytest.raises(openmm.OpenMMException, match="several faces"):
        force.setRegion("box", openmm.Vec3(0, 0, 0), openmm.Vec3(1, 1, 1), 0)
    with pytest.raises(openmm.OpenMMException, match="no side 'above'"):
        force.setSide("above")
    host = _alone(system, force)
    context = new_context(host, positions)
    own = plugin.CylinderChainWallForce.cast(host.getForce(0))
    own.setSide("inside")
    with pytest.raises(openmm.OpenMMException, match="cannot become a surface"):
        own.updateParametersInContext(context)
    system.addForce(force)
    with pytest.raises(InputError, match="two stages"):
        filaments.create_integrator(system, 1e6, "implicit-second-order")


def test_what_is_kept_outside_in_a_periodic_box():
    """A wall has no images, which is said; beside a plane, linkers that diffuse have no region."""
    filaments = Filaments(VISCOSITY, TEMPERATURE)
    filaments.add_straight(ACTIN, 2, [0, 0, 300], [1, 0, 0])
    hand = Hand(binding_rate=1e-9, reach=30.0, unbinding_rate=1e-9)
    filaments.add_linkers(Crosslinker(hands=hand, stiffness=0.1), count=10, diffusion=1e-5)
    _, system, _ = filaments.build(box_vectors=1000.0 * np.eye(3))
    index = system.addForce(filament_wall_force(filaments, system, Sphere([0, 0, 0], 100.0), 1.0, side="outside"))
    with pytest.warns(BoxWarning, match="outside.* keeps filaments and linkers out of one place alone"):
        filaments.create_integrator(system, 1e4)
    system.removeForce(index)
    system.addForce(filament_wall_force(filaments, system, Plane([0, 0, 0], [0, 0, -1]), 1.0, side="outside"))
    with pytest.warns(BoxWarning), pytest.raises(InputError, match="diffuse, and need a region"):
        filaments.create_integrator(system, 1e4)


def test_steps_on_curved_surfaces_are_bounded_by_their_radius():
    """A flat one does not bound them, nor does any stiffness."""
    filaments, system, _ = _rods(1)
    free = filaments.recommended_time_step(system=system).step
    for shape, bounds in ((Plane([0, 0, 0], [0, 0, 1]), False), (Sphere([0, 0, 0], 3), True)):
        for stiffness in (1.0, 1e6):
            own = copy.deepcopy(system)
            own.addForce(filament_wall_force(filaments, own, shape, stiffness, side="surface"))
            found = filaments.recommended_time_step(system=own)
            assert (found.step < 0.5 * free) == bounds
            assert ("radius of curvature" in found.reason) == bounds


# Beside others


def _on_sphere(radius, length, count, seed):
    """Middles and directions of rods, whose ends are on a sphere."""
    generator = np.random.default_rng(seed)
    out, other = generator.normal(size=(2, count, 3))
    out /= np.linalg.norm(out, axis=1)[:, None]
    along = np.cross(out, other)
    return np.sqrt(radius**2 - 0.25 * length**2) * out, along / np.linalg.norm(along, axis=1)[:, None]


def test_bodies_on_a_sphere():
    """Of two points that are held each, the depths, by an integral over heights and directions."""
    length, radius, stiffness, count = 100.0, 90.0, 2.0, 500
    flat, width = np.sqrt(radius**2 - 0.25 * length**2), np.sqrt(KT / stiffness)
    heights = np.linspace(flat - 13 * width, flat + 13 * width, 1501)[:, None]
    cosines = (np.arange(1500) + 0.5) / 1500 * min(1.0, 24 * width / length)
    squares = sum(
        (np.sqrt(heights**2 + 0.25 * length**2 + sign * heights * length * cosines) - radius) ** 2 for sign in (1, -1)
    )
    weights = heights**2 * np.exp(-0.5 * stiffness * squares / KT)
    exact = np.sum(weights * squares / 2) / weights.sum()
    filaments = Filaments(VISCOSITY, TEMPERATURE)
    filaments.add_straight(ACTIN, 1, [0, 0, 0], [1, 0, 0])
    for middle, along in zip(*_on_sphere(radius, length, count, 3)):
        across = np.cross(along, middle / np.linalg.norm(middle))
        frame = np.stack([along, across, np.cross(along, across)], axis=1)
        filaments.add_body(Body([[-50, 0, 0], [50, 0, 0]], [20.0, 20.0]), middle, frame)
    _, system, positions = filaments.build()
    points = np.array(filaments.body_indices)[:, :2]
    system.addForce(
        filament_wall_force(
            filaments,
            system,
            Sphere([0, 0, 0], radius),
            stiffness,
            particles=[int(particle) for particle in points.ravel()],
            numbers=[],
            side="surface",
        )
    )
    for step in (1e5, 1e7):
        integrator = filaments.create_integrator(system, step, random_seed=1, checks=False)
        context = new_context(system, positions, integrator)
        integrator.step(20)
        found = []
        for _ in range(40):
            integrator.step(4)
            found.append(np.mean((np.linalg.norm(positions_of(context)[points], axis=2) - radius) ** 2, axis=1))
        found = np.mean(found, axis=0)
        error = found.std(ddof=1) / np.sqrt(count)
        assert 4 * error < 0.06 * exact
        assert found.mean() == pytest.approx(exact, abs=4 * error)


@pytest.mark.parametrize("stiffness", [0.05, 20.0])
def test_planar_rods_on_a_circle(stiffness):
    """In the plane across a cylinder: depths of their ends, by an integral over distances and angles."""
    length, radius, count = 100.0, 90.0, 400
    flat, width = np.sqrt(radius**2 - 0.25 * length**2), np.sqrt(KT / stiffness)
    heights = np.linspace(max(0.0, flat - 13 * width), flat + 13 * width, 1501)[:, None]
    steepest = np.arcsin(min(1.0, 24 * width / length))
    cosines = np.sin((np.arange(1500) + 0.5) / 1500 * steepest)
    squares = sum(
        (np.sqrt(heights**2 + 0.25 * length**2 + sign * heights * length * cosines) - radius) ** 2 for sign in (1, -1)
    )
    weights = heights * np.exp(-0.5 * stiffness * squares / KT)
    exact = np.sum(weights * squares / 2) / weights.sum()
    filaments = Filaments(1e-3, TEMPERATURE)
    for number in range(count):
        angle = 2 * np.pi * number / count
        out, along = np.array([np.cos(angle), np.sin(angle), 0]), np.array([-np.sin(angle), np.cos(angle), 0])
        filaments.add_straight(ACTIN, 1, flat * out - 0.5 * length * along, along, planar=True)
    _, system, positions = filaments.build()
    cylinder = Cylinder([0, 0, 0], [0, 0, 1], radius)
    system.addForce(filament_wall_force(filaments, system, cylinder, stiffness, side="surface"))
    integrator = filaments.create_integrator(system, 2.0, random_seed=1, checks=False)
    context = new_context(system, positions, integrator)
    integrator.step(100)
    found = []
    for _ in range(60):
        integrator.step(max(2, int(0.5 / stiffness)))
        places = positions_of(context)
        assert np.all(np.abs(places[:, 2]) < 1e-6)
        found.append(np.mean((np.linalg.norm(places.reshape(count, 2, 3), axis=2) - radius) ** 2, axis=1))
    found = np.mean(found, axis=0)
    error = found.std(ddof=1) / np.sqrt(count)
    assert 4 * error < 0.06 * exact
    assert found.mean() == pytest.approx(exact, abs=4 * error)


@pytest.mark.parametrize("motion", [2.0, 8.0])
def test_linked_spheres_that_touch_on_a_sphere(motion):
    """Pairs on a link, with contacts, held on a sphere: their distance, by an integral over the angle between them."""
    radius, count, rest, spring, diameter, contact = 80.0, 400, 45.0, 0.02, 40.0, 0.5
    distances = np.linspace(1e-3, 2 * radius, 20001)
    energies = 0.5 * spring * (distances - rest) ** 2 + 0.5 * contact * np.maximum(0.0, diameter - distances) ** 2
    weights = distances * np.exp(-energies / KT)
    weights /= weights.sum()
    exact = np.array([weights @ distances, weights @ distances**2, weights @ np.maximum(0.0, diameter - distances)])
    filaments = Filaments(VISCOSITY, TEMPERATURE)
    filaments.add_straight(ACTIN, 1, [0, 0, 1e4], [1, 0, 0])
    _, system, positions = filaments.build()
    first = system.getNumParticles()
    particles = [system.addParticle(1.0) for _ in range(2 * count)]
    generator = np.random.default_rng(2)
    angles = 2 * np.arcsin(0.5 * generator.choice(distances, count, p=weights) / radius)
    links, places = Crosslinks(spring, rest), []
    for pair, angle in enumerate(angles):
        # Pairs do not know of each other: each is on a sphere of its own.
        center = np.array([1000.0 * (pair + 1), 0.0, 0.0])
        places += [center + [0, 0, radius], center + radius * np.array([np.sin(angle), 0, np.cos(angle)])]
        own = particles[2 * pair : 2 * pair + 2]
        system.addForce(
            filament_wall_force(
                filaments, system, Sphere(center, radius), 50.0, particles=own, numbers=[], side="surface"
            )
        )
        links.add(None, *own)
    links.add_to(system)
    system.addForce(capsule_contact_force(filaments, system, diameter, contact, particles, diameter))
    step = 1e3
    integrator = filaments.create_integrator(
        system, step, particle_friction=2 * KT * step / motion**2, random_seed=3, checks=False
    )
    context = new_context(system, np.vstack([positions._value, places]), integrator)
    found = []
    for _ in range(60):
        integrator.step(2)
        pairs = positions_of(context)[first:].reshape(count, 2, 3)
        away = np.linalg.norm(pairs[:, 1] - pairs[:, 0], axis=1)
        found.append([away, away**2, np.maximum(0.0, diameter - away)])
    found = np.mean(found, axis=0)
    errors = found.std(axis=1, ddof=1) / np.sqrt(count)
    assert np.all(4 * errors[:2] < 0.08 * exact[:2])
    assert np.all(np.abs(found.mean(axis=1) - exact) < 4 * errors)


@pytest.mark.parametrize("pull", [6.0, -6.0])
def test_forces_balance_a_pull(pull):
    """What pulls on a rod off a plane or into it, the plane holds; its load is positive inwards."""
    filaments = Filaments(VISCOSITY, TEMPERATURE)
    filaments.add_straight(ACTIN, 1, [0, 0, 0], [1, 0, 0])
    _, system, positions = filaments.build()
    system.addForce(filament_wall_force(filaments, system, Plane([0, 0, 0], [0, 0, 1]), 5.0, side="surface"))
    system.addForce(constant_force([0, 1], [0, 0, 0.5 * pull]))
    integrator = filaments.create_integrator(system, 1e6, random_seed=3, checks=False)
    context = new_context(system, positions, integrator)
    integrator.step(10)
    wall_forces(context)
    integrator.step(20000)
    (found,) = wall_forces(context)
    assert found.sums._value[0, 2] == pytest.approx(-pull, rel=0.01)
    assert found.loads._value[0] == pytest.approx(-pull, rel=0.01)


def test_a_checkpoint_goes_on_to_the_bit():
    radius, length = 90.0, 100.0
    filaments = Filaments(1e-3, TEMPERATURE)
    for middle, along in zip(*_on_sphere(radius, length, 8, 5)):
        filaments.add_straight(ACTIN, 1, middle - 0.5 * length * along, along)
    _, system, positions = filaments.build()
    system.addForce(filament_wall_force(filaments, system, Sphere([0, 0, 0], radius), 3.0, side="surface"))

    def begin():
        integrator = filaments.create_integrator(system, 5.0, random_seed=3, checks=False)
        return integrator, new_context(system, positions, integrator)

    integrator, context = begin()
    integrator.step(7)
    state = context.createCheckpoint()
    integrator.step(9)
    other, again = begin()
    again.loadCheckpoint(state)
    other.step(9)
    assert np.array_equal(positions_of(context), positions_of(again))
    assert np.array_equal(*(wall_forces(own)[0].forces._value for own in (context, again)))
