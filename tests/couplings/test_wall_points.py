"""Points at random on walls: on the surface, and with the same chance for each area."""

import numpy as np
import pytest
from openmm import unit

from openmm_cylchain import Box, Capsule, Cylinder, Ellipsoid, InputError, Plane, Slab, Sphere, Torus, random_points_on

COUNT = 5000
LOWER, UPPER = np.array([-40.0, -60.0, -50.0]), np.array([70.0, 50.0, 30.0])
TILTED = np.array([1.0, 2.0, 3.0]) / np.sqrt(14.0)
SHAPES = {
    "plane": Plane([1, 2, 3], TILTED),
    "slab": Slab([1, 2, 3], TILTED, 20.0),
    "cylinder": Cylinder([1, 2, 3], TILTED, 25.0),
    "sphere": Sphere([5, 0, 0], 45.0),
    "box": Box([-10, -20, -30], [20, 30, 40]),
    "capsule": Capsule([5, 0, -5], TILTED, 40.0, 20.0),
    "torus": Torus([5, 0, -5], TILTED, 35.0, 15.0),
    "ellipsoid": Ellipsoid([5, 0, 0], [60, 20, 35]),
}


def _areas_beyond(shape, heights):
    """The shares of the area of a shape, within the box, that are above heights: by a fine grid of parameters."""
    first, second = (np.arange(1500) + 0.5) / 1500, (np.arange(1501) + 0.5) / 1501
    one, other = np.meshgrid(first, second, indexing="ij")
    if isinstance(shape, Box):
        faces, edges = [], shape.upper - shape.lower
        for axis in range(3):
            for end in (shape.lower, shape.upper):
                points = shape.lower + np.insert(np.stack([one, other], -1), axis, 0.0, -1) * edges
                points[..., axis] = end[axis]
                faces.append((points, np.full(one.shape, np.prod(edges) / edges[axis])))
    elif isinstance(shape, (Sphere, Ellipsoid)):
        axes = np.broadcast_to(shape.radius if isinstance(shape, Sphere) else shape.semi_axes, 3)
        cosine, angle = 2 * one - 1, 2 * np.pi * other
        sine = np.sqrt(1 - cosine**2)
        normal = np.stack([sine * np.cos(angle), sine * np.sin(angle), cosine], -1)
        faces = [(shape.center + normal * axes, np.linalg.norm(normal / axes, axis=-1))]
    elif isinstance(shape, Capsule):
        across = np.linalg.svd(shape.axis[None])[2][1:]
        angle, cosine = 2 * np.pi * other, 2 * one - 1
        round_ = np.cos(angle)[..., None] * across[0] + np.sin(angle)[..., None] * across[1]
        side = shape.radius * round_ + shape.length * (one[..., None] - 0.5) * shape.axis
        height = shape.radius * cosine + 0.5 * shape.length * np.sign(cosine)
        sine = np.sqrt(1 - cosine**2)
        caps = height[..., None] * shape.axis + shape.radius * sine[..., None] * round_
        sizes = shape.length, 2 * shape.radius
        faces = [(shape.center + own, np.full(one.shape, size)) for own, size in zip((side, caps), sizes)]
    elif isinstance(shape, Torus):
        across = np.linalg.svd(shape.axis[None])[2][1:]
        angle, about = 2 * np.pi * one, 2 * np.pi * other
        round_ = np.cos(angle)[..., None] * across[0] + np.sin(angle)[..., None] * across[1]
        away = shape.major_radius + shape.minor_radius * np.cos(about)
        points = away[..., None] * round_ + shape.minor_radius * np.sin(about)[..., None] * shape.axis
        faces = [(shape.center + points, away)]
    else:
        normal = shape.axis if isinstance(shape, Cylinder) else shape.normal
        across = np.linalg.svd(normal[None])[2][1:]
        if isinstance(shape, Cylinder):
            angle = 2 * np.pi * one[..., None]
            round_ = np.cos(angle) * across[0] + np.sin(angle) * across[1]
            faces = [shape.point + shape.radius * round_ + 400 * (other[..., None] - 0.5) * normal]
        else:
            flat = shape.point + 400 * ((one[..., None] - 0.5) * across[0] + (other[..., None] - 0.5) * across[1])
            sides = (-0.5, 0.5) if isinstance(shape, Slab) else (0.0,)
            faces = [flat + side * getattr(shape, "thickness", 0.0) * normal for side in sides]
        faces = [(points, np.ones(points.shape[:-1])) for points in faces]
    within = [np.all((points >= LOWER) & (points <= UPPER), axis=-1) * area for points, area in faces]
    total, places = sum(area.sum() for area in within), list(zip(faces, within, strict=True))
    return [sum((area * (points[..., 2] > height)).sum() for (points, _), area in places) / total for height in heights]


@pytest.mark.parametrize("name", SHAPES)
def test_points_are_on_walls_with_the_same_chance_for_each_area(name):
    shape = SHAPES[name]
    points = random_points_on(shape, COUNT, seed=4, lower=LOWER * unit.nanometer, upper=UPPER)
    assert points.shape == (COUNT, 3)
    assert np.all((points >= LOWER) & (points <= UPPER))
    np.testing.assert_allclose(shape.square_depth(points), 0.0, atol=1e-15)
    # A little beyond: no point is inside.
    outward = points + 1e-6 * np.sign(points - 0.5) if isinstance(shape, Box) else None
    if isinstance(shape, (Sphere, Ellipsoid, Capsule)):
        outward = points + 1e-6 * (points - shape.center)
    elif isinstance(shape, Torus):
        across = points - shape.center - np.outer((points - shape.center) @ shape.axis, shape.axis)
        middles = shape.major_radius * across / np.linalg.norm(across, axis=1)[:, None]
        outward = points + 1e-6 * (points - shape.center - middles)
    elif isinstance(shape, Cylinder):
        apart = points - shape.point
        outward = points + 1e-6 * (apart - np.outer(apart @ shape.axis, shape.axis))
    elif isinstance(shape, (Plane, Slab)):
        side = -1.0 if isinstance(shape, Plane) else np.sign((points - shape.point) @ shape.normal)[:, None]
        outward = points + 1e-6 * side * shape.normal
    assert np.all(shape.square_depth(outward) > 0.0)
    heights = (-20.0, 5.0, 15.0)
    for height, share in zip(heights, _areas_beyond(shape, heights)):
        assert 0.02 < share < 0.98
        error = np.sqrt(share * (1 - share) / COUNT)
        assert 4 * error < 0.05 or share < 0.3
        assert np.mean(points[:, 2] > height) == pytest.approx(share, abs=4 * error)


def test_points_follow_the_seed_and_whole_shapes_need_no_box():
    sphere = SHAPES["sphere"]
    first, again, other = (random_points_on(sphere, 50, seed) for seed in (1, 1, 2))
    np.testing.assert_array_equal(first, again)
    assert not np.any(first == other)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((SHAPES["plane"], 5), "A Plane has no end: give lower and upper"),
        ((SHAPES["cylinder"], 5, 0, LOWER), "A Cylinder has no end"),
        ((SHAPES["sphere"], 0), "count must be"),
        ((SHAPES["sphere"], 5, 0, UPPER, LOWER), "lower must not be above upper"),
        ((SHAPES["sphere"], 5, 0, [90, 90, 90], [99, 99, 99]), "holds nothing of the wall"),
        ((SHAPES["sphere"], 5, 0, [np.nan, 0, 0]), "lower"),
        (("plane", 5), "wall must be a shape"),
    ],
)
def test_bad_requests_are_refused(arguments, message):
    with pytest.raises(InputError, match=message):
        random_points_on(*arguments)
