"""Distances, contacts, mesh size and contraction of filaments at known places; means of series that relax."""

import math
import warnings

import numpy as np
import pytest
from openmm import unit

from openmm_cylchain import F_ACTIN, EquilibrationWarning, InputError, analysis
from openmm_cylchain.analysis.run_filaments import RunFilament
from openmm_cylchain.analysis.statistics import mean_in_equilibrium
from support.random_series import correlated_series


class PlacedRun:
    """What analysis sees of a run: filaments at given nodes, in one frame or several."""

    passing = frozenset()

    def __init__(self, frames, box=None, rings=()):
        self._frames = [[np.array(nodes, dtype=float) for nodes in frame] for frame in frames]
        self.box = None if box is None else np.diag(np.array(box, dtype=float))
        ends = np.cumsum([0] + [len(nodes) for nodes in self._frames[0]])
        self.filaments = tuple(
            RunFilament(F_ACTIN, np.arange(first, last), F_ACTIN.diameter, number in rings)
            for number, (first, last) in enumerate(zip(ends[:-1], ends[1:]))
        )

    def __len__(self):
        return len(self._frames)

    def nodes(self, frame):
        return self._frames[frame]

    def curves(self, frame):
        return self._frames[frame]


CROSS = [[[-50, 0, 0], [0, 0, 0], [50, 0, 0]], [[10, -40, 8], [10, 40, 8]], [[0, 0, 300], [0, 50, 300]]]


def test_distances_of_filaments():
    distances = analysis.filament_distances(PlacedRun([CROSS]), 0, 500.0)
    np.testing.assert_allclose(distances, [[0, 8, 300], [8, 0, math.hypot(10, 292)], [300, math.hypot(10, 292), 0]])
    distances = analysis.filament_distances(PlacedRun([CROSS]), 0, 20.0)
    np.testing.assert_allclose(distances, [[0, 8, np.inf], [8, 0, np.inf], [np.inf, np.inf, 0]])


def test_distances_are_of_nearest_images():
    # The second is a box away and a little more; the third goes through the face at 200.
    run = PlacedRun(
        [[[[0, 5, 5], [30, 5, 5]], [[200, 405, -192], [230, 405, -192]], [[180, 5, 20], [195, 5, 20]]]], [200] * 3
    )
    distances = analysis.filament_distances(run, 0, 60.0)
    np.testing.assert_allclose(distances[0], [0.0, 3.0, math.hypot(5.0, 15.0)])
    np.testing.assert_allclose(distances, distances.T)
    with pytest.raises(InputError, match="box is 200 nm wide"):
        analysis.filament_distances(run, 0, 190.0)


def test_distances_by_points():
    """Random filaments and rings in a box against the least distance of many points on them and their images."""
    generator = np.random.default_rng(4)
    walks = np.cumsum(generator.normal(size=(8, 5, 3)) * 12.0, axis=1) + generator.uniform(0, 100, (8, 1, 3))
    run = PlacedRun([walks], [100.0, 120.0, 90.0], rings=(2, 5))
    points = []
    for own, nodes in zip(run.filaments, walks):
        last = np.roll(nodes, -1, axis=0)[: own.segments]
        places = np.linspace(0.0, 1.0, 60)[:, None, None]
        points.append(((1.0 - places) * nodes[: own.segments] + places * last).reshape(-1, 3))
    expected = np.zeros((8, 8))
    for i in range(8):
        for j in range(i):
            apart = points[i][:, None] - points[j]
            apart -= np.diag(run.box) * np.round(apart / np.diag(run.box))
            expected[i, j] = expected[j, i] = np.linalg.norm(apart, axis=2).min()
    distances = analysis.filament_distances(run, 0, 35.0)
    near = expected < 34.0
    assert 20 < near.sum() < 64
    np.testing.assert_allclose(distances[near], expected[near], atol=0.6)
    assert np.all(distances[near] <= expected[near] + 1e-9)


def test_contacts():
    run = PlacedRun([CROSS])
    # Actin is 6 nm thick: the surfaces of the first two are 2 nm apart.
    assert not analysis.contact_map(run, 0, 1.9).any()
    np.testing.assert_array_equal(np.argwhere(analysis.contact_map(run, 0, 2.1)), [[0, 1], [1, 0]])
    with pytest.raises(InputError, match="gap"):
        analysis.contact_map(run, 0, -1.0)


def test_mesh_size_of_a_lattice():
    # 3 x 3 x 3 cells of 360 nm: one filament of a segment along each edge, three for each cell.
    filaments = [[np.zeros(3), 360.0 * axis] for _ in range(27) for axis in np.eye(3)]
    assert analysis.mesh_size(PlacedRun([filaments], [1080.0] * 3)) == pytest.approx(360.0)
    assert analysis.mesh_size(PlacedRun([filaments]), 1080.0**3) == pytest.approx(360.0)
    with pytest.raises(InputError, match="give the volume"):
        analysis.mesh_size(PlacedRun([filaments]))


def test_contraction():
    first = np.random.default_rng(5).normal(size=(4, 3, 3))
    run = PlacedRun([first, 0.5 * first + 70.0, 2.0 * first])
    np.testing.assert_allclose(analysis.contraction(run), [1.0, 0.5, 2.0])
    with pytest.raises(InputError, match="does not contract"):
        analysis.contraction(PlacedRun([first], [9.0] * 3))


def test_a_series_that_relaxes():
    """A decay of ten standard deviations over the first tenth, then correlated noise with the mean 3."""
    generator = np.random.default_rng(6)
    frames = 4000
    noise = correlated_series(generator, frames, 0.8)
    series = 3.0 + noise + 10.0 * np.exp(-np.arange(frames) / 60.0)
    with warnings.catch_warnings():
        warnings.simplefilter("error", EquilibrationWarning)
        found = mean_in_equilibrium(series)
    assert 100 <= found.first_frame <= 800
    # g = (1 + 0.8)/(1 - 0.8) = 9.
    expected = math.sqrt(9.0 / (frames - found.first_frame))
    assert found.standard_error == pytest.approx(expected, rel=0.25)
    assert expected < 0.0125 * 5.0 and found.mean == pytest.approx(3.0, abs=4.0 * expected)
    assert found.independent_samples == pytest.approx((frames - found.first_frame) / 9.0, rel=0.4)
    # With its relaxation the mean is off.
    assert series.mean() > 3.0 + 2.0 * expected


def test_runs_that_are_too_short():
    generator = np.random.default_rng(7)
    with pytest.warns(EquilibrationWarning, match="too short for its error bar.*times as long"):
        mean_in_equilibrium(correlated_series(generator, 200, 0.97))
    constant = mean_in_equilibrium(np.full(10, 2.0))
    assert (constant.mean, constant.standard_error, constant.first_frame) == (2.0, 0.0, 0)
    for series in (np.zeros(7), np.zeros((20, 2))):
        with pytest.raises(InputError, match="8 frames at least"):
            mean_in_equilibrium(series)


# Two that run side by side, turned round; one across them; one beside an end; two far away, 10 degrees apart.
SIDE_BY_SIDE = [
    [[0, 0, 0], [100, 0, 0], [200, 0, 0], [300, 0, 0]],
    [[300, 12, 0], [200, 12, 0], [100, 12, 0], [0, 12, 0]],
    [[50, -100, 10], [50, 0, 10], [50, 100, 10]],
    [[290, 0, 12], [390, 0, 12], [490, 0, 12]],
    [[0, 0, 500], [200, 0, 500]],
    [[0, 10, 500], [200 * math.cos(math.radians(10)), 10 + 200 * math.sin(math.radians(10)), 500]],
]


@pytest.mark.parametrize("gap", [8.0, 8.0 * unit.nanometer])
def test_bundles(gap):
    run = PlacedRun([SIDE_BY_SIDE])

    def bundles(angle, overlap, gap=gap):
        return [own.tolist() for own in analysis.find_bundles(run, 0, gap, angle, overlap)]

    assert bundles(math.radians(5.0), 150.0) == [[0, 1]]
    assert bundles(5.0 * unit.degree, 150.0 * unit.nanometer) == [[0, 1]]
    # The fourth has one segment beside the end of the first.
    assert bundles(math.radians(5.0), 100.0) == [[0, 1, 3]]
    assert bundles(math.radians(5.0), 101.0) == [[0, 1]]
    assert bundles(math.radians(11.0), 100.0) == [[0, 1, 3], [4, 5]]
    assert bundles(math.radians(90.0), 0.0) == [[0, 1, 2, 3], [4, 5]]
    assert bundles(math.radians(11.0), 0.0, gap=4.1) == [[4, 5]]
    assert bundles(math.radians(11.0), 0.0, gap=3.9) == []


def test_bundles_through_faces_of_a_box():
    run = PlacedRun([[[[0, 2, 5], [30, 2, 5]], [[200, 399 - 1200, 5], [230, 399 - 1200, 5]]]], [200, 400, 300])
    assert [own.tolist() for own in analysis.find_bundles(run, 0, 0.0, 0.1, 30.0)] == [[0, 1]]
    with pytest.raises(InputError, match="box is 200 nm wide"):
        analysis.find_bundles(run, 0, 190.0, 0.1, 30.0)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((-1.0, 0.1, 10.0), "gap"),
        ((1.0, 0.0, 10.0), "angle"),
        ((1.0, 1.6, 10.0), "angle must be at most 90 degrees, but is 91.6"),
        ((1.0, 0.1, math.nan), "overlap"),
        ((1.0 * unit.second, 0.1, 1.0), "gap"),
    ],
)
def test_bad_bundles_are_refused(arguments, message):
    with pytest.raises(InputError, match=message):
        analysis.find_bundles(PlacedRun([SIDE_BY_SIDE]), 0, *arguments)
