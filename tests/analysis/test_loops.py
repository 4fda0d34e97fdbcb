"""P(s), sparse contact maps and loop lengths, against counts of all pairs and a closed form."""

import math

import numpy as np
import pytest
import scipy

from openmm_cylchain import F_ACTIN, InputError, analysis
from openmm_cylchain.analysis.run_filaments import RunFilament
from openmm_cylchain.output.linker_records import LINKER_RECORD

ACTIN = F_ACTIN.with_segment_length(20.0)


class PlacedChains:
    """What analysis sees of a run: filaments at given nodes in each frame."""

    passing = frozenset()

    def __init__(self, frames, box=None, rings=(), linkers=()):
        self._frames, self.linkers = frames, linkers
        self.box = None if box is None else np.diag(np.array(box, dtype=float))
        ends = np.cumsum([0] + [len(nodes) for nodes in frames[0]])
        self.filaments = tuple(
            RunFilament(ACTIN, np.arange(first, last), ACTIN.diameter, number in rings)
            for number, (first, last) in enumerate(zip(ends[:-1], ends[1:]))
        )

    def __len__(self):
        return len(self._frames)

    def nodes(self, frame):
        return self._frames[frame]


def random_walks(generator, counts, frames, step=10.0):
    return [[np.cumsum(generator.normal(0.0, step, (n, 3)), axis=0) for n in counts] for _ in range(frames)]


def test_contacts_against_all_pairs():
    generator = np.random.default_rng(3)
    counts, cutoff, box = (31, 17, 24), 25.0, 400.0
    run = PlacedChains(random_walks(generator, counts, 3), [box] * 3, rings=(2,))
    found, possible = np.zeros((3, 31)), np.zeros(31)
    full = np.zeros((sum(counts),) * 2, dtype=int)
    for frame in range(3):
        points = np.concatenate(run.nodes(frame))
        between = points[:, None] - points
        between -= box * np.round(between / box)
        near = np.linalg.norm(between, axis=2) <= cutoff
        np.fill_diagonal(near, False)
        full += near
        first = 0
        for number, count in enumerate(counts):
            for i in range(count):
                for j in range(i + 1, count):
                    s = min(j - i, count - j + i) if number == 2 else j - i
                    possible[s] += frame == 0
                    found[frame, s] += near[first + i, first + j]
            first += count
    result = analysis.contact_probability(run, cutoff, bins_per_decade=1000)
    there = possible[1:] > 0
    np.testing.assert_allclose(result.separations, 20.0 * np.arange(1, 31)[there])
    np.testing.assert_allclose(result.values, (found[:, 1:] / np.maximum(possible[1:], 1))[:, there])
    np.testing.assert_allclose(result.mean, result.values.mean(axis=0))
    counted = analysis.contact_counts(run, cutoff)
    assert scipy.sparse.issparse(counted) and counted.dtype == np.int64
    np.testing.assert_array_equal(counted.toarray(), full)
    # Bins of four segments: 8, 5 and 6 of them.
    coarse = analysis.contact_counts(run, cutoff, bin_length=81.0, frames=range(1, 3)).toarray()
    only = np.zeros_like(full)
    for frame in (1, 2):
        own = PlacedChains([run.nodes(frame)], [box] * 3, rings=(2,))
        only += analysis.contact_counts(own, cutoff).toarray()
    starts = np.concatenate([begin + np.arange(0, n, 4) for begin, n in zip((0, 31, 48), counts)])
    sums = np.add.reduceat(np.add.reduceat(only, starts, axis=0), starts, axis=1)
    np.fill_diagonal(sums, np.diag(sums) // 2)
    np.testing.assert_array_equal(coarse, sums)
    assert coarse.shape == (19, 19)


def test_probability_of_a_gaussian_chain():
    # Of random walks, the distance at n steps has the Maxwell distribution of the variance n a^2 along each axis.
    run = PlacedChains(random_walks(np.random.default_rng(5), (400,) * 6, 60))
    result = analysis.contact_probability(run, 30.0, bins_per_decade=6)
    separations = np.arange(1, 400)
    x = 30.0 / np.sqrt(separations * 100.0)
    each = np.array([math.erf(u / math.sqrt(2)) for u in x]) - np.sqrt(2 / np.pi) * x * np.exp(-0.5 * x**2)
    edges = np.unique(np.round(np.logspace(0, math.log10(400), 17))).astype(int)
    weights = 400 - separations
    expected = [
        np.average(each[first - 1 : last - 1], weights=weights[first - 1 : last - 1])
        for first, last in zip(edges[:-1], edges[1:])
    ]
    errors = result.values.std(axis=0, ddof=1) / math.sqrt(len(run))
    assert np.all(np.abs(result.mean - expected) <= 4.0 * errors)
    assert np.all(4.0 * errors[:6] < 0.05 * result.mean[:6])


def test_loops_of_linkers():
    records = np.zeros(4, LINKER_RECORD)
    records["type"] = [0, 0, 1, 1]
    records["filaments"] = [[0, 0], [1, 1], [0, 1], [1, -1]]
    records["arc_lengths"] = [[150, 30], [10, 390], [5, 6], [3, 0]]
    walks = random_walks(np.random.default_rng(1), (31, 20), 1)
    run = PlacedChains(walks, rings=(1,), linkers=[records])
    np.testing.assert_allclose(analysis.loop_lengths(run, 0), [120.0, 20.0])
    assert len(analysis.loop_lengths(run, 0, kind=1)) == 0


def test_refused():
    run = PlacedChains(random_walks(np.random.default_rng(1), (9,), 2), [100.0] * 3)
    with pytest.raises(InputError, match="frames must be numbers of frames, of which there are 2"):
        analysis.contact_probability(run, 10.0, frames=range(3))
    with pytest.raises(InputError, match="box is 100 nm wide"):
        analysis.contact_counts(run, 101.0)
    with pytest.raises(InputError, match="bins_per_decade"):
        analysis.contact_probability(run, 10.0, bins_per_decade=0)
