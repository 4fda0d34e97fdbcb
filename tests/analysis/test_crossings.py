"""Crossings: constructed cases, a brute-force count, and periodic boxes."""

from itertools import product

import numpy as np
import pytest
from openmm import unit

from openmm_cylchain import F_ACTIN, Filaments, InputError
from openmm_cylchain.analysis.crossings import CrossingCounter, find_crossings, segment_distances

TWO = [np.array([0, 1]), np.array([2, 3])]


def _two(height, along=0.0, length=10.0):
    """A segment along x at z = 0 and one along y at a height, through a place on the first."""
    half = 0.5 * length
    return np.array([[-half, 0, 0], [half, 0, 0], [along, -half, height], [along, half, height]])


def test_passing_through_is_found_where_and_when_it_happens():
    crossings = find_crossings(TWO, _two(1.0, along=2.0), _two(-3.0, along=2.0))
    assert len(crossings) == 1
    assert crossings.filaments.tolist() == [[0, 1]] and crossings.segments.tolist() == [[0, 0]]
    assert crossings.times == pytest.approx([0.25])
    assert crossings.fractions[0] == pytest.approx([0.7, 0.5])


@pytest.mark.parametrize("along", [5.1, -5.1, 30.0])
def test_passing_beside_is_none(along):
    assert len(find_crossings(TWO, _two(1.0, along), _two(-1.0, along))) == 0


def test_segments_that_move_together_do_not_cross():
    shift = np.array([100.0, -50.0, 3.0])
    assert len(find_crossings(TWO, _two(0.01), _two(0.01) + shift)) == 0
    rotation = np.linalg.qr(np.random.default_rng(1).normal(size=(3, 3)))[0]
    assert len(find_crossings(TWO, _two(1.0), _two(1.0) @ (rotation * np.linalg.det(rotation)).T)) == 0


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_coming_close_and_returning_is_none(side):
    counter = CrossingCounter(TWO, _two(side))
    for height in (0.2, 1e-9, 0.1, 1e-12, 1.0):
        assert len(counter.update(_two(side * height))) == 0
    assert counter.count == 0


@pytest.mark.parametrize("flip", [1.0, -1.0])
def test_a_touch_is_none_and_a_passage_and_return_are_two(flip):
    """The height of one segment above the other is depth - (2 t - 1)^2/4 where their projections meet."""

    def ends(depth):
        start = np.array([[-5, 0, depth + 0.5], [5, 0, depth - 0.5], [2.5, -5, 0], [2.5, 5, 0]])
        end = np.array([[-5, 0, depth - 0.5], [5, 0, depth + 0.5], [-2.5, -5, 0], [-2.5, 5, 0]])
        return start * [1, 1, flip], end * [1, 1, flip]

    assert len(find_crossings(TWO, *ends(-0.01))) == 0
    assert len(find_crossings(TWO, *ends(0.0))) == 0
    crossings = find_crossings(TWO, *ends(0.04))
    assert crossings.times == pytest.approx([0.3, 0.7])


def test_a_passage_through_an_exact_touch_is_found_once():
    for side in (1.0, -1.0):
        counter = CrossingCounter(TWO, _two(side))
        for height in (0.0, -0.5):
            counter.update(_two(side * height))
        assert counter.count == 1


def test_segments_of_one_chain_cross_unless_they_are_neighbours():
    # A chain of three segments whose last one comes down through the first, and one whose second folds through it.
    start = np.array([[0, 0, 0], [10, 0, 0], [10, 10, 5], [5, -5, 5]], dtype=float)
    end = start * [1, 1, 1] - [[0, 0, 0], [0, 0, 0], [0, 0, 10], [0, 0, 10]]
    crossings = find_crossings([np.arange(4)], start, end)
    assert crossings.filaments.tolist() == [[0, 0]] and crossings.segments.tolist() == [[0, 2]]
    assert len(find_crossings([np.arange(3)], start, end)) == 0


BOXES = [100.0 * np.eye(3), np.array([[100.0, 0, 0], [30, 90, 0], [-20, 25, 80]])]


@pytest.mark.parametrize("box", BOXES)
def test_crossings_through_the_boundary(box):
    images = np.array([[0, 0, 0], [0, 0, 0], [2, -1, 3], [2, -1, 3]]) @ box
    for place in np.array([[0.0, 0, 0], [0, 0.999, 0.5], [0.3, 0.02, 0.99]]) @ box:
        start, end = _two(2.0) + place + images, _two(-2.0) + place + images
        assert len(find_crossings(TWO, start, end)) == 0
        assert len(find_crossings(TWO, start, end, box)) == 1
        assert len(find_crossings(TWO, start, start, box)) == 0


def test_a_filament_crosses_its_own_image():
    box = 20.0 * np.eye(3)
    start = np.array([[0, 0, 0], [10, 0, 0], [20, -2, 1], [25, -4, 1], [25, 4, 1.0]])
    end = start - [[0, 0, 0], [0, 0, 0], [0, 0, 2], [0, 0, 2], [0, 0, 2]]
    assert len(find_crossings([np.arange(5)], start, end)) == 0
    crossings = find_crossings([np.arange(5)], start, end, box)
    assert crossings.segments.tolist() == [[0, 3]]


def _far(start, end, one, other, shift):
    """Whether the middles of two segments are too far apart for them to meet."""
    nodes = [positions[[*one, *other]] + np.array([[0], [0], [1], [1]]) * shift for positions in (start, end)]
    middles = [0.5 * np.array([n[0] + n[1], n[2] + n[3]]) for n in nodes]
    reach = sum(max(np.linalg.norm(n[k] - n[k + 1]) for n in nodes) for k in (0, 2))
    travelled = np.linalg.norm(middles[1] - middles[0], axis=1).sum()
    return np.linalg.norm(middles[0][1] - middles[0][0]) > 0.5 * reach + travelled


def _sampled(chains, start, end, box, samples):
    """All crossings by the signs of volumes at many times, for all pairs and images."""
    times = np.linspace(0.0, 1.0, samples + 1)[:, None]
    segments = [(c, i, *chain[i : i + 2]) for c, chain in enumerate(chains) for i in range(len(chain) - 1)]
    images = [np.zeros(3)]
    if box is not None:
        images = [np.array(shift) @ box for shift in product(range(-2, 3), repeat=3)]
    found = []
    for number, (c, i, *one) in enumerate(segments):
        for d, j, *other in segments[number + 1 :]:
            a, b = ((1 - times) * start[node] + times * end[node] for node in one)
            for shift in images:
                if c == d and abs(i - j) <= 1 and not shift.any() or _far(start, end, one, other, shift):
                    continue
                x, y = ((1 - times) * start[node] + times * end[node] + shift for node in other)
                volume = np.linalg.det(np.stack([x - a, b - a, y - x], axis=1))
                for k in np.flatnonzero(volume[1:] * volume[:-1] < 0):
                    matrix = np.stack([(b - a)[k], (x - y)[k]], axis=1)
                    places = np.linalg.lstsq(matrix, (x - a)[k], rcond=None)[0]
                    if np.all((places > 0) & (places < 1)):
                        found.append((c, d, i, j, float(times[k, 0] + 0.5 / samples)))
    return sorted(found)


@pytest.mark.parametrize("seed", [0, 1, 2, 4, 5, 9])
def test_random_motion_against_brute_force(seed):
    """Whole steps of the size of segments, in the open, in a box and in a skewed one."""
    generator = np.random.default_rng(seed)
    box = [None, 9.0 * np.eye(3), 0.11 * BOXES[1]][seed % 3]
    chains = [np.arange(4 * number, 4 * number + 4) for number in range(5)]
    shape = np.cumsum(generator.normal(size=(5, 4, 3)), axis=1) + 0.2 * generator.normal(size=(5, 1, 3))
    start = shape.reshape(-1, 3)
    end = start + 0.7 * generator.normal(size=start.shape)
    crossings = find_crossings(chains, start, end, box)
    expected = _sampled(chains, start, end, box, 500)
    assert len(expected) >= 1
    rows = zip(crossings.filaments, crossings.segments, crossings.times)
    found = sorted((*(int(n) for n in (*filaments, *segments)), time) for filaments, segments, time in rows)
    assert [one[:4] for one in found] == [one[:4] for one in expected]
    assert [one[4] for one in found] == pytest.approx([one[4] for one in expected], abs=2e-3)


def test_counting_with_kept_pairs_is_counting_anew():
    generator = np.random.default_rng(8)
    box = 15.0 * np.eye(3)
    chains = [np.arange(5 * number, 5 * number + 5) for number in range(40)]
    shape = np.cumsum(2.0 * generator.normal(size=(40, 5, 3)), axis=1) + generator.uniform(0, 15, size=(40, 1, 3))
    positions = shape.reshape(-1, 3)
    counter = CrossingCounter(chains, positions * unit.nanometer, box * unit.nanometer, margin=1.5 * unit.nanometer)
    total = 0
    for _ in range(60):
        moved = positions + 0.1 * generator.normal(size=positions.shape)
        crossings = find_crossings(chains, positions, moved, box)
        assert counter.update(moved).times == pytest.approx(crossings.times)
        total += len(crossings)
        positions = moved
    assert counter.count == total > 50


def test_distances_of_segments():
    generator = np.random.default_rng(2)
    p, q, w = generator.normal(size=(3, 200, 3))
    q[:20] = generator.uniform(-2, 2, size=(20, 1)) * p[:20]
    s, t = (place[..., None] for place in np.meshgrid(np.linspace(0, 1, 201), np.linspace(0, 1, 201)))
    sampled = [np.linalg.norm(c + t * b - s * a, axis=-1).min() for a, b, c in zip(p, q, w)]
    distances = segment_distances(p, q, w)
    assert np.all(distances <= np.array(sampled) + 1e-12)
    assert distances == pytest.approx(sampled, abs=2e-3)


def test_rings_are_crossed_in_their_last_segment_too():
    filaments = Filaments(1.0, 300.0)
    filaments.add_ring(F_ACTIN, 6, [0, 0, 0])
    filaments.add_straight(F_ACTIN, 1, [0, 0, 0], [1, 0, 0])
    _, system, positions = filaments.build()
    nodes = np.array(positions._value)
    middle = 0.5 * (nodes[5] + nodes[0])
    # The rod leans over the last segment, from its inside to its outside, and sinks through it.
    rod = np.array([0.8 * middle, 1.2 * middle])
    start, end = nodes.copy(), nodes.copy()
    start[6:], end[6:] = rod + [0, 0, 10], rod - [0, 0, 10]
    crossings = find_crossings(filaments, start, end)
    assert (crossings.filaments.tolist(), crossings.segments.tolist()) == ([[0, 1]], [[5, 0]])
    assert len(find_crossings(filaments.node_indices, start, end)) == 0
    # The ring alone may shake as it likes: neighbours do not cross, nor do the last segment and the first.
    generator = np.random.default_rng(2)
    for _ in range(20):
        shaken = nodes[:6] + generator.normal(scale=20, size=(6, 3))
        assert len(find_crossings([[0, 1, 2, 3, 4, 5, 0]], nodes[:6], shaken)) == 0


def test_bad_input_is_refused():
    start = _two(1.0)
    for make, message in (
        (lambda: find_crossings([], start, start), "chains must be int arrays"),
        (lambda: find_crossings([np.array([0])], start, start), "chains must be int arrays"),
        (lambda: find_crossings([np.array([0.0, 1.0])], start, start), "chains must be int arrays"),
        (lambda: find_crossings(TWO, start[:3], start), "start must have the shape"),
        (lambda: find_crossings(TWO, start, start[:, :2]), "end must have the shape"),
        (lambda: find_crossings(TWO, start, start * np.nan), "end must be finite"),
        (lambda: find_crossings(TWO, start * unit.kelvin, start), "start has the unit"),
        (lambda: find_crossings(TWO, start, start, np.eye(3)[:2]), "box_vectors must be three vectors"),
        (lambda: find_crossings(TWO, start, start, np.zeros((3, 3))), "box_vectors must span a volume"),
        (lambda: find_crossings(TWO, start, start, 5.0 * np.eye(3)), "box is 5 nm wide, but segments reach 10 nm"),
        (lambda: CrossingCounter(TWO, start, margin=0), "margin must be positive"),
        (lambda: CrossingCounter(TWO, start).update(start[:1]), "positions must have the shape"),
    ):
        with pytest.raises(InputError, match=message):
            make()


# In one plane


def _across(r):
    """Whether segments from r[0] to r[1] and from r[2] to r[3], in a plane, lie across each other."""
    p, q, w = r[1] - r[0], r[3] - r[2], r[2] - r[0]
    area = p[0] * q[1] - p[1] * q[0]
    s, t = (w[0] * q[1] - w[1] * q[0]) / area, (w[0] * p[1] - w[1] * p[0]) / area
    return (s > 0) & (s < 1) & (t > 0) & (t < 1)


def test_passages_in_a_plane_against_where_segments_lie_across_each_other():
    """Whenever an end goes through a segment, the two lie across each other, or cease to."""
    rng = np.random.default_rng(4)
    passages = 0
    times = np.linspace(0, 1, 4001)
    for _ in range(200):
        plane = np.linalg.qr(rng.normal(size=(3, 3)))[0][:2]
        start = rng.normal(0, 10, (4, 2))
        end = start + rng.normal(0, 10, (4, 2))
        found = find_crossings(TWO, start @ plane, end @ plane)
        states = _across(start[..., None] + (end - start)[..., None] * times)
        changes = times[1:][states[1:] != states[:-1]]
        # Two that are nearer to each other than the resolution of the other count are missed by it.
        if len(found) > 1 and np.diff(found.times).min() < 1e-3:
            continue
        assert len(found) == len(changes)
        np.testing.assert_allclose(found.times, changes, atol=3e-4)
        assert np.all(np.any((found.fractions == 0) | (found.fractions == 1), axis=1))
        passages += len(found)
    assert passages > 60


def test_a_joint_that_passes_in_a_plane_counts_once():
    chains = [np.arange(3), np.arange(3, 5)]
    start = np.array([[-10, 5, 0], [0, 1, 0], [10, 5, 0], [-30, 0, 0], [30, 0, 0]], float)
    end = start - np.array([[0, 2, 0]] * 3 + [[0, 0, 0]] * 2)
    for order in ([0, 1, 2], [2, 1, 0]):
        crossings = find_crossings([np.array(order), chains[1]], start, end)
        assert len(crossings) == 1 and crossings.segments.tolist() == [[0, 0]]
        assert crossings.times == pytest.approx([0.5])
    # Out of the plane by a nanometre, it passes above, and does not cross.
    end[1, 2] = start[1, 2] = 1.0
    assert len(find_crossings(chains, start, end)) == 0


def test_segments_that_pass_side_by_side_in_a_plane_are_counted():
    """Parallel ones, one of which is longer: both ends of the shorter one go through the other."""
    start = np.array([[-5.0, 1, 0], [5, 1, 0], [-9, 0, 0], [9, 0, 0]])
    end = start + np.array([[0.0, -3, 0]] * 2 + [[0, 0, 0]] * 2)
    assert len(find_crossings(TWO, start, end)) == 2
    assert len(find_crossings(TWO, start, end + [0, 0, 1e-3])) == 2
