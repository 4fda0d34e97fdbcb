"""Walls: energy and force on every platform, and a confined segment in equilibrium."""

import numpy as np
import openmm
import pytest
from openmm import unit

from openmm_cylchain import F_ACTIN, Filaments, InputError, prism_faces
from openmm_cylchain.couplings.shapes import Box, Capsule, Cylinder, Ellipsoid, Plane, Shape, Slab, Sphere, Torus
from openmm_cylchain.couplings.walls import wall_force
from support.contexts import new_context, positions_of
from support.solvent import KT, TEMPERATURE, VISCOSITY
from support.wall_shapes import SHAPES


def _name(shape):
    return type(shape).__name__


def distance(shape, point):
    """How far a point is outside, from the nearest of many points inside."""
    generator = np.random.default_rng(1)
    inside = generator.uniform(-8, 8, size=(400000, 3))
    inside = inside[shape.square_depth(inside) == 0]
    return np.linalg.norm(inside - point, axis=1).min()


@pytest.mark.parametrize("shape", SHAPES, ids=_name)
def test_depth_is_the_distance_from_the_inside(shape):
    generator = np.random.default_rng(2)
    points = generator.uniform(-4, 4, size=(400, 3))
    depths = np.sqrt(shape.square_depth(points))
    outside = np.flatnonzero((depths > 0.3) & (depths < 1.0))[:8]
    assert len(outside) == 8 and np.any(depths == 0)
    for index in outside:
        # Random points leave gaps of about 0.2 nm; that of an ellipsoid is a distance to first order only.
        tolerance = 0.2 if not isinstance(shape, Ellipsoid) else 0.2 + 0.5 * depths[index]
        assert depths[index] == pytest.approx(distance(shape, points[index]), abs=tolerance)


@pytest.mark.parametrize("backward", [False, True])
def test_faces_of_a_prism(backward):
    """Over a rectangle they are those of a box, and over a polygon each side has what is beyond it by its distance."""
    points = np.random.default_rng(4).uniform(-4, 4, size=(500, 3))
    corners = np.array([[-1.0, -2.0], [0.5, -2.0], [2.0, -2.0], [2.0, 1.0], [-1.0, 1.0]])
    faces = prism_faces(corners[::-1] if backward else corners, -1 * unit.nanometer, 3)
    assert [type(face) for face in faces] == [Plane] * 4 + [Slab]
    total = sum(face.square_depth(points) for face in faces)
    np.testing.assert_allclose(total, Box([-1, -2, -1], [2, 1, 3]).square_depth(points), atol=1e-12)
    angles = 2 * np.pi * np.arange(400) / 400
    many = prism_faces(3.0 * np.column_stack([np.cos(angles), np.sin(angles)])[:: -1 if backward else 1])
    inside = np.all([face.square_depth(points) == 0.0 for face in many], axis=0)
    distances = np.hypot(points[:, 0], points[:, 1])
    np.testing.assert_array_equal(inside, distances < 3.0)
    deepest = np.sqrt(np.max([face.square_depth(points) for face in many], axis=0))
    np.testing.assert_allclose(deepest, np.maximum(0.0, distances - 3.0), atol=1e-3)


@pytest.mark.parametrize(
    ("corners", "ends", "message"),
    [
        ([[0, 0], [1, 0]], {}, "must have the shape"),
        ([[0, 0], [1, 0], [1, 0], [0, 1]], {}, "Corner 1 and the next one are in one place"),
        ([[0, 0], [3, 0], [3, 1], [1, 1], [1, 3], [0, 3]], {}, "those of a convex polygon"),
        ([[0, 3], [2, -2], [-3, 1], [3, 1], [-2, -2]], {}, "those of a convex polygon"),
        ([[0, 0], [1, 0], [2, 0]], {}, "those of a convex polygon"),
        ([[0, 0], [1, 0], [0, 1]], {"top": 1}, "both a bottom and a top"),
        ([[0, 0], [1, 0], [0, 1]], {"bottom": 1, "top": 1}, "top must be above bottom"),
    ],
)
def test_no_prisms(corners, ends, message):
    with pytest.raises(InputError, match=message):
        prism_faces(corners, **ends)


@pytest.mark.parametrize("shape", SHAPES, ids=_name)
def test_energy_and_force(shape, platform):
    generator = np.random.default_rng(3)
    points = np.concatenate([generator.uniform(-4, 4, size=(200, 3)), [[0.1, 0.2, 0.3], [0.1, 0, 0]]])
    system = openmm.System()
    for _ in points:
        system.addParticle(1.0)
    system.addForce(wall_force(shape, 7 * unit.kilojoule_per_mole / unit.nanometer**2, range(len(points))))
    context = new_context(system, points, platform=platform)
    state = context.getState(energy=True, forces=True)
    assert state.getPotentialEnergy()._value == pytest.approx(3.5 * shape.square_depth(points).sum(), rel=1e-5)
    forces = state.getForces(asNumpy=True)._value
    width = 1e-5
    for axis in range(3):
        step = width * np.eye(3)[axis]
        expected = -3.5 * (shape.square_depth(points + step) - shape.square_depth(points - step)) / (2 * width)
        assert forces[:, axis] == pytest.approx(expected, abs=1e-3)
    assert np.abs(forces).max() > 1


@pytest.mark.slow
def test_a_segment_in_a_slab_has_the_exact_energy():
    """The energy of both nodes in the wall, against an integral over height and angle of a rigid segment."""
    length, thickness, stiffness, chains = F_ACTIN.segment_length, 300.0, 0.05, 5600
    heights, cosines = np.meshgrid(np.linspace(-600, 600, 2401), np.linspace(-1, 1, 801), indexing="ij")
    slab = Slab([0, 0, 0], [0, 0, 1], thickness)

    def wall_energy(z):
        return 0.5 * stiffness * np.maximum(0.0, np.abs(z) - 0.5 * thickness) ** 2

    energy = wall_energy(heights + 0.5 * length * cosines) + wall_energy(heights - 0.5 * length * cosines)
    weight = np.exp(-energy / KT)
    exact = np.sum(energy * weight) / np.sum(weight)

    generator = np.random.default_rng(4)
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine="compiled")
    probabilities = weight.ravel() / weight.sum()
    for chosen in generator.choice(weight.size, size=chains, p=probabilities):
        height, cosine = heights.ravel()[chosen], cosines.ravel()[chosen]
        direction = np.array([np.sqrt(1 - cosine**2), 0.0, cosine])
        filaments.add_straight(F_ACTIN, 1, np.array([0, 0, height]) - 0.5 * length * direction, direction)
    _, system, positions = filaments.build()
    wall = wall_force(slab, stiffness, np.concatenate(filaments.node_indices))
    wall.setForceGroup(5)
    system.addForce(wall)
    integrator = filaments.create_integrator(system, 2e5, random_seed=1)
    context = new_context(system, positions, integrator)
    integrator.step(100)
    energies = []
    for _ in range(150):
        integrator.step(60)
        nodes = positions_of(context).reshape(chains, 2, 3)
        energies.append(0.5 * stiffness * slab.square_depth(nodes).sum(axis=1))
    energies = np.mean(energies, axis=0)
    error = energies.std(ddof=1) / np.sqrt(chains)
    assert 4 * error < 0.05 * exact
    assert abs(energies.mean() - exact) < 0.02 * exact + 4 * error
    state = context.getState(energy=True, groups={5})
    assert state.getPotentialEnergy()._value == pytest.approx(
        0.5 * stiffness * slab.square_depth(nodes).sum(), rel=1e-6
    )


def test_bad_input_is_refused():
    for make, message in (
        (lambda: Sphere([0, 0, 0], 0), "Sphere: radius must be positive"),
        (lambda: Sphere([0, 0], 1), "Sphere: center must have three components"),
        (lambda: Plane([0, 0, 0], [0, 0, 0]), "Plane: direction must not be the zero vector"),
        (lambda: Slab([0, 0, 0], [1, 0, 0], -1), "Slab: thickness must be positive"),
        (lambda: Cylinder([0, 0, np.nan], [1, 0, 0], 1), "Cylinder: point must be finite"),
        (lambda: Cylinder([0, 0, 0], [1, 0, 0], 1 * unit.kelvin), "Cylinder: radius has the unit"),
        (lambda: Box([0, 0, 0], [1, 0, 1]), "Box: upper must exceed lower"),
        (lambda: Capsule([0, 0, 0], [0, 0, 0], 1, 1), "Capsule: direction must not be the zero vector"),
        (lambda: Capsule([0, 0, 0], [1, 0, 0], 0, 1), "Capsule: length must be positive"),
        (lambda: Capsule([0, 0, 0], [1, 0, 0], 1, -1), "Capsule: radius must be positive"),
        (lambda: Torus([0, 0, 0], [0, 0, 0], 2, 1), "Torus: direction must not be the zero vector"),
        (lambda: Torus([0, 0, 0], [1, 0, 0], 2, 0), "Torus: minor_radius must be positive"),
        (lambda: Torus([0, 0, 0], [1, 0, 0], 2, 2 * unit.nanometer), "must be smaller than major_radius, 2 nm"),
        (lambda: Ellipsoid([0, 0, 0], [1, -1, 1]), "Ellipsoid: semi_axes must be positive"),
        (lambda: wall_force("sphere", 1, []), "shape must be a Shape"),
        (lambda: wall_force(SHAPES[0], 0, []), "stiffness must be positive"),
    ):
        with pytest.raises(InputError, match=message):
            make()
    assert issubclass(Sphere, Shape)
