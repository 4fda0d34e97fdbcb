"""Rays that meet tubes, cameras, and lines in periodic boxes, against geometry."""

import numpy as np
import pytest

from openmm_cylchain.errors import InputError
from openmm_cylchain.rendering.camera import PROJECTIONS, Camera, camera_on
from openmm_cylchain.rendering.scene import cut_at_faces
from openmm_cylchain.rendering.shading import shaded_image
from openmm_cylchain.rendering.tubes import Tubes, cast

WHITE, RED, BLUE = np.ones(3), np.array([0.8, 0.1, 0.1]), np.array([0.1, 0.1, 0.8])


def tubes_of(*ends, radius=10.0, color=BLUE):
    return Tubes.of_one_kind(np.array(ends, dtype=float), radius, color)


def camera(distance=1e5, scale=2.0, width=400, height=300):
    """Looks down the z axis at the origin."""
    return Camera(np.zeros(3), np.eye(3), distance, scale, width, height, (distance - 100.0, distance + 100.0))


def test_a_sphere_is_a_disc():
    hits = cast(camera(), tubes_of([[3.0, -2.0, 5.0]] * 2, radius=30.0))
    assert len(hits.pixels) == pytest.approx(np.pi * 60.0**2, rel=3e-3)
    row, column = np.divmod(hits.pixels, 400)
    assert np.mean(column + 0.5) == pytest.approx(200 + 6, abs=0.1)
    assert np.mean(row + 0.5) == pytest.approx(150 + 4, abs=0.1)
    assert hits.depths.min() == pytest.approx(1e5 - 35.0, abs=1e-2)
    np.testing.assert_allclose(np.linalg.norm(hits.normals, axis=1), 1.0)
    np.testing.assert_allclose(hits.normals[np.argmin(hits.depths)], [0, 0, 1], atol=0.02)


@pytest.mark.parametrize("angle", [0, 30, 45, 60, 90, 135, 300])
def test_a_tube_has_the_same_area_in_every_direction(angle):
    end = 40.0 * np.array([np.cos(np.radians(angle)), np.sin(np.radians(angle)), 0.0])
    hits = cast(camera(), tubes_of([-end, end]))
    assert len(hits.pixels) == pytest.approx(4.0 * (20.0 * 80.0 + np.pi * 100.0), rel=0.01)


def test_a_tube_along_the_view_is_a_disc():
    hits = cast(camera(), tubes_of([[0, 0, -40], [0, 0, 40]]))
    assert len(hits.pixels) == pytest.approx(np.pi * 20.0**2, rel=0.02)
    assert hits.depths.min() == pytest.approx(1e5 - 50.0, abs=1e-2)


def test_what_is_in_front_is_seen():
    hits = cast(camera(), tubes_of([[-50, 0, 30], [50, 0, 30]], [[0, -50, 0], [0, 50, 0]]))
    middle = np.isin(hits.pixels, [150 * 400 + 200, 145 * 400 + 205])
    assert middle.sum() == 2 and set(hits.tubes[middle]) == {0}
    assert set(hits.tubes[np.isin(hits.pixels, [80 * 400 + 200])]) == {1}


def test_what_is_nearer_is_larger_in_perspective():
    near, far = (
        len(cast(camera(distance=1000.0, scale=6.0), tubes_of([[0, 0, z]] * 2, radius=10.0)).pixels)
        for z in (300.0, -300.0)
    )
    assert near / far == pytest.approx((1300.0**2 - 100.0) / (700.0**2 - 100.0), rel=0.02)


def test_random_tubes_by_marching():
    """Each pixel against a march along its ray by the distance from the nearest tube."""
    generator = np.random.default_rng(1)
    tubes = Tubes(
        generator.uniform(-60.0, 60.0, (12, 2, 3)), generator.uniform(2, 15, 12), np.ones((12, 3)), np.ones(12, bool)
    )
    own = camera(distance=250.0, scale=0.4, width=64, height=48)
    row, column = np.divmod(np.arange(64 * 48), 64)
    rays = np.stack([(column + 0.5 - 32) / 100.0, (24 - row - 0.5) / 100.0, -np.ones(64 * 48)], axis=1)
    length = np.linalg.norm(rays, axis=1)
    ends = own.seen(tubes.ends)
    axes = ends[:, 1] - ends[:, 0]
    depths, nearest = np.zeros(len(rays)), np.zeros(len(rays), dtype=int)
    for _ in range(300):
        points = depths[:, None] * rays
        relative = points[:, None] - ends[:, 0]
        along = np.clip(np.einsum("pti,ti->pt", relative, axes) / (axes**2).sum(axis=1), 0.0, 1.0)
        distances = np.linalg.norm(relative - along[..., None] * axes, axis=2) - tubes.radii
        nearest = distances.argmin(axis=1)
        depths = np.minimum(depths + distances.min(axis=1) / length, 1e4)
    met = depths < 1e3
    hits = cast(own, tubes)
    assert 0.2 < met.mean() < 0.9
    # A march hardly gets past the edge of a tube.
    assert len(np.setxor1d(hits.pixels, np.flatnonzero(met))) <= 3
    both = np.isin(hits.pixels, np.flatnonzero(met))
    expected = depths[hits.pixels[both]]
    agree = np.abs(hits.depths[both] - expected) < 1e-3 * expected
    assert agree.mean() > 0.995
    assert (hits.tubes[both] == nearest[hits.pixels[both]]).mean() > 0.99


def test_nothing_and_what_is_outside_the_picture():
    for ends in (np.zeros((0, 2, 3)), [[[1e3, 0, 0], [2e3, 0, 0]]]):
        assert len(cast(camera(), tubes_of(*ends)).pixels if len(ends) else []) == 0
    image = shaded_image(camera(), Tubes.of_one_kind(np.zeros((0, 2, 3)), 1.0, RED), WHITE)
    np.testing.assert_array_equal(image, np.ones((300, 400, 3)))


def test_light_falls_from_above_and_the_background_stays():
    image = shaded_image(camera(), tubes_of([[-50, 0, 0], [50, 0, 0]]), WHITE)
    np.testing.assert_array_equal(image[:100], 1.0)
    tube = image[131:169, 200].sum(axis=1)
    assert np.all(image[131:169, 200, 2] > image[131:169, 200, 0])
    assert tube[8] > tube[-8]


def test_tubes_shade_what_is_behind_them():
    behind = [[-90.0, 0, -15], [90, 0, -15]]
    alone = shaded_image(camera(), tubes_of(behind), WHITE)
    crossed = shaded_image(camera(), tubes_of(behind, [[0, -60, 8], [0, 60, 8]]), WHITE)
    assert crossed[150, 174].sum() < 0.97 * alone[150, 174].sum()
    assert crossed[150, 80].sum() == pytest.approx(alone[150, 80].sum(), rel=1e-3)


@pytest.mark.parametrize("projection", PROJECTIONS)
@pytest.mark.parametrize("extent", [(100, 80, 60), (1, 500, 3), (300, 300, 0.1), (0, 0, 70)])
def test_a_camera_sees_all_points_with_equal_axes(projection, extent):
    generator = np.random.default_rng(2)
    points = generator.uniform(-0.5, 0.5, (50, 3)) * extent + 1e4
    own = camera_on(points, (640, 480), projection, turn=25.0)
    seen = own.seen(points)
    pixels = own.scale * own.distance * seen[:, :2] / -seen[:, 2:]
    assert np.all(np.abs(pixels) <= [320 * 0.881, 240 * 0.881])
    assert np.max(np.abs(pixels) / [320, 240]) > 0.85
    np.testing.assert_allclose(own.axes @ own.axes.T, np.eye(3), atol=1e-12)
    assert np.linalg.det(own.axes) == pytest.approx(1.0)


def test_cameras_that_are_none():
    points = np.eye(3)
    with pytest.raises(InputError, match="projection must be one of"):
        camera_on(points, (640, 480), "fisheye")
    with pytest.raises(InputError, match="view must be a direction"):
        camera_on(points, (640, 480), view=np.zeros(3))


def test_lines_are_cut_at_faces():
    generator = np.random.default_rng(3)
    box = np.diag([10.0, 20.0, 15.0])
    ends = generator.uniform(-30.0, 30.0, (200, 2, 3))
    pieces, which = cut_at_faces(ends, box)
    assert np.all(pieces > -1e-9) and np.all(pieces < np.diag(box) + 1e-9)
    lengths = np.bincount(which, np.linalg.norm(pieces[:, 1] - pieces[:, 0], axis=1))
    np.testing.assert_allclose(lengths, np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1))
    # A place on each line is, in the box, on one of its pieces.
    places = np.mod(0.3 * ends[:, 0] + 0.7 * ends[:, 1], np.diag(box))
    starts, axes = pieces[:, 0], pieces[:, 1] - pieces[:, 0]
    relative = places[which] - starts
    along = np.clip(np.einsum("ij,ij->i", relative, axes) / (axes**2).sum(axis=1), 0.0, 1.0)
    distances = np.linalg.norm(relative - along[:, None] * axes, axis=1)
    assert max(distances[which == line].min() for line in range(200)) < 1e-6
