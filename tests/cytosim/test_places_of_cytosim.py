"""Positions, directions and rotations of Cytosim against moments, geometry and their definitions."""

import math

import numpy as np
import pytest

from openmm_cylchain.cytosim.directions import draw_direction, draw_orientation
from openmm_cylchain.cytosim.drawing import Draw
from openmm_cylchain.cytosim.grammar import Block, ScriptError
from openmm_cylchain.cytosim.places import draw_inside, draw_position
from openmm_cylchain.cytosim.settings import Settings
from openmm_cylchain.cytosim.spaces import make_space
from openmm_cylchain.cytosim.translation import translate


def draw_of(dimensions, space=None):
    return Draw(space, dimensions, np.random.default_rng(5), 1)


@pytest.mark.parametrize(
    ("text", "dimensions", "expected"),
    [
        # Mean and variance along each axis.
        ("1 2 3", 3, [(1, 0), (2, 0), (3, 0)]),
        ("ball 2", 3, [(0, 4 / 5)] * 3),
        ("ball 2 at 1 0 0", 2, [(1, 1), (0, 1), (0, 0)]),
        ("disc 2 0.6", 3, [(0, 1), (0, 1), (0, 0.36 / 12)]),
        ("discYZ 2 0.6", 3, [(0, 0.36 / 12), (0, 1), (0, 1)]),
        ("rectangle 2 1 0.5", 3, [(0, 4 / 12), (0, 1 / 12), (0, 0.25 / 12)]),
        ("sphere 2", 3, [(0, 4 / 3)] * 3),
        ("circle 2", 2, [(0, 2), (0, 2), (0, 0)]),
        ("cylinder 4 2", 3, [(0, 16 / 12), (0, 1), (0, 1)]),
        ("ring 4 2", 3, [(0, 16 / 12), (0, 2), (0, 2)]),
        ("equator 2 1", 3, [(0, 2), (0, 2), (0, 1 / 12)]),
        ("line 4 0", 3, [(0, 16 / 12), (0, 0), (0, 0)]),
        ("square 2", 2, [(0, 4 / 12), (0, 4 / 12), (0, 0)]),
        ("0 0 0 to 2 0 0", 3, [(1, 4 / 12), (0, 0), (0, 0)]),
        ("1 0 0 or -1 0 0", 3, [(0, 1), (0, 0), (0, 0)]),
        ("1 0 0 blur 0.5", 2, [(1, 0.25), (0, 0.25), (0, 0)]),
        ("2 0 0 turn degree 90", 3, [(0, 0), (2, 0), (0, 0)]),
        ("line 2 0 align 0 1 0", 2, [(0, 0), (0, 4 / 12), (0, 0)]),
        ("center add ball 2", 3, [(0, 4 / 5)] * 3),
        ("ball 2 if (X > 0)", 3, [(0.75, 0.2375), (0, 0.8), (0, 0.8)]),
        ("cap 2 1", 3, [(0, 5 / 6), (0, 5 / 6), (1.5, 1 / 12)]),
        ("capX 2 1", 3, [(1.5, 1 / 12), (0, 5 / 6), (0, 5 / 6)]),
        ("ellipse_surface 3 2 1", 3, [(0, 3), (0, 4 / 3), (0, 1 / 3)]),
        ("2 0 0 turn axis 0 0 1 degree 90", 3, [(0, 0), (2, 0), (0, 0)]),
        ("0 2 0 turn quat 0.7071067811865476 0.7071067811865476 0 0", 3, [(0, 0), (0, 0), (2, 0)]),
        ("2 0 0 turn Y 1.5707963267948966", 3, [(0, 0), (0, 0), (-2, 0)]),
    ],
)
def test_positions_have_the_means_and_variances_of_their_shapes(text, dimensions, expected):
    draw, count = draw_of(dimensions), 4000
    places = np.array([draw_position(text, draw) for _ in range(count)])
    for values, (mean, variance) in zip(places.T, expected):
        deviations = (values - mean) ** 2
        assert abs(np.mean(values) - mean) <= 4 * math.sqrt(variance / count) + 1e-9
        error = np.std(deviations) / math.sqrt(count)
        assert abs(np.mean(deviations) - variance) <= 4 * error + 1e-9
        assert error <= 0.05 * variance + 1e-9


def test_positions_in_spaces():
    settings = Settings("space", 1)
    settings.set("radius", ["3"], 1)
    draw = draw_of(3, make_space("sphere", [settings], 3))
    flat = np.array([draw_inside("XY 1", draw) for _ in range(200)])
    assert np.all(flat[:, 2] == 1.0) and np.all(np.linalg.norm(flat, axis=1) <= 3)
    rising = np.array([draw_inside("gradient -3 3", draw)[0] for _ in range(2000)])
    # Of the density (x + 3)(9 - x^2): its mean is the ratio of the integrals of x^2 (9 - x^2) and of 3 (9 - x^2).
    assert abs(rising.mean() - 0.6) < 4 * rising.std() / math.sqrt(len(rising))
    assert draw_inside("rectangle 0.1 0.1 0.1 at 9 0 0", draw) is None


@pytest.mark.parametrize(
    ("text", "of"),
    [
        ("X", lambda v, at: abs(abs(v[0]) - 1)),
        ("off", lambda v, at: abs(v[0] - 1)),
        ("axis 0 0 1 degree 90", lambda v, at: abs(v[1] - 1)),
        ("degree 180 axis 0 1 0", lambda v, at: abs(v[0] + 1)),
        ("random if (Y > 0.8)", lambda v, at: max(0.0, 0.8 - v[1])),
        ("0 2 0", lambda v, at: abs(v[1] - 1)),
        ("horizontal", lambda v, at: abs(abs(v[0]) - 1)),
        ("parallel 0 1 0", lambda v, at: abs(abs(v[1]) - 1)),
        ("orthogonal 0 0 1", lambda v, at: abs(v[2])),
        ("parallel XY", lambda v, at: abs(v[2])),
        ("radial", lambda v, at: abs(v @ at / np.linalg.norm(at) - 1)),
        ("antiradial", lambda v, at: abs(v @ at / np.linalg.norm(at) + 1)),
        ("circular", lambda v, at: abs(v @ at)),
        ("1 0 0 or 0 1 0", lambda v, at: abs(v[0] + v[1] - 1)),
        (None, lambda v, at: 0.0),
    ],
)
def test_directions(text, of):
    draw, at = draw_of(3), np.array([1.0, 2.0, 0.5])
    vectors = np.array([draw_direction(text, at, draw) for _ in range(500)])
    assert np.allclose(np.linalg.norm(vectors, axis=1), 1.0)
    assert max(of(vector, at) for vector in vectors) < 1e-9
    if text is None:
        assert np.allclose(vectors.mean(axis=0), 0.0, atol=4 / math.sqrt(3 * 500))


def test_directions_have_noise_across():
    draw = draw_of(3)
    slopes = np.array([(v := draw_direction("0 0 1 blur 0.1", np.zeros(3), draw))[:2] / v[2] for _ in range(4000)])
    error = 0.01 * math.sqrt(2 / len(slopes))
    assert np.all(abs(slopes.var(axis=0) - 0.01) < 4 * error)


def test_orientations_turn_as_matrices():
    for text, expected in (
        ("orientation = axis 0 0 1 degree 90", [[0, -1, 0], [1, 0, 0], [0, 0, 1]]),
        ("rotation = X 1.5707963267948966", [[1, 0, 0], [0, 0, -1], [0, 1, 0]]),
        ("orientation = off", np.eye(3)),
        ("orientation = angle 3.141592653589793", np.diag([-1, -1, 1])),
    ):
        options = Settings.of("new", 1, Block(text, 1))
        np.testing.assert_allclose(draw_orientation(options, np.zeros(3), draw_of(3)), expected, atol=1e-12)
    with pytest.raises(ScriptError, match="axis of a rotation"):
        draw_position("1 0 0 turn axis 0 0 0 degree 9", draw_of(3))


HEAD = "set simul system { time_step = 0.01; viscosity = 1; dim = 3 }\nset space cell { shape = sphere }\n"
HEAD += "new cell { radius = 5 }\nset fiber tube { rigidity = 20; segmentation = 0.5 }\n"


def first_nodes(tmp_path, new):
    """Nodes of the first filament that is written, in um."""
    (tmp_path / "my.cym").write_text(f"{HEAD}new tube {{ {new} }}\nrun 100 system\n")
    (table,) = translate(tmp_path / "my.cym", "my").document.tables_called("[[filament]]")
    return np.array([[float(own.split()[0]) for own in place] for place in table.value("nodes")])


def test_fibers_with_a_shape_are_turned_and_moved_as_they_stand(tmp_path):
    shape = "shape = 1 0 0, 1 1 0, 1 2 0"
    nodes = first_nodes(tmp_path, f"{shape}; position = 0 0 1; orientation = axis 0 0 1 degree 90")
    np.testing.assert_allclose(nodes[[0, -1]], [[0, 1, 1], [-2, 1, 1]], atol=1e-6)
    # What comes second turns the place, too.
    nodes = first_nodes(tmp_path, f"{shape}; position = 0 0 1; orientation = off, axis 0 1 0 degree 90")
    np.testing.assert_allclose(nodes[[0, -1]], [[1, 0, -1], [1, 2, -1]], atol=1e-6)


def test_curved_fibers_are_on_their_circle(tmp_path):
    nodes = first_nodes(tmp_path, "length = 4; shape = curved, 3, 0 0 1; position = 0 0 0; rotation = off")
    np.testing.assert_allclose(np.linalg.norm(nodes, axis=1), 3.0, atol=1e-6)
    assert np.all(nodes[:, 1] == 0.0) and np.all(nodes[:, 2] > 2.0)
    np.testing.assert_allclose(np.linalg.norm(np.diff(nodes, axis=0), axis=1), 0.5, atol=1e-6)
