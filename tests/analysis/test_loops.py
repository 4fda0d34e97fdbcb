"""P(s), sparse contact maps, their files and loop lengths, against counts of all pairs and a closed form."""

import math
import sys

import cooler
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


def test_files_of_cooler(tmp_path):
    """Of two chains and a ring, with bins of four segments: 8, 5 and 6."""
    counts, path = (31, 17, 24), tmp_path / "walks.cool"
    run = PlacedChains(random_walks(np.random.default_rng(4), counts, 3), rings=(2,))
    analysis.write_cooler(run, path, 25.0, 59, bin_size=236, frames=range(1, 3), names=["chr1", "chr-2", "plasmid"])
    file = cooler.Cooler(str(path))
    dense = analysis.contact_counts(run, 25.0, bin_length=80.0, frames=range(1, 3)).toarray()
    upper = np.triu(dense)
    assert file.binsize == 236 and file.chromsizes.to_dict() == dict(zip(file.chromnames, 59 * np.array(counts)))
    assert file.info["sum"] == upper.sum() and file.info["nnz"] == np.count_nonzero(upper)
    assert file.info["metadata"] == {"cutoff_nm": 25.0, "frames": 2} and file.info["storage-mode"] == "symmetric-upper"
    whole = file.matrix(balance=False)[:]
    assert np.any(np.diag(whole)) and np.any(whole[:8, 8:])
    np.testing.assert_array_equal(whole, dense)
    np.testing.assert_array_equal(whole, whole.T)
    np.testing.assert_array_equal(file.matrix(balance=False).fetch("chr-2:236-1003", "plasmid"), dense[9:13, 13:])
    assert file.pixels()[:]["count"].dtype == np.int64
    bins = file.bins()[:]
    np.testing.assert_array_equal(bins["start"], np.concatenate([236 * np.arange(n) for n in (8, 5, 6)]))
    assert bins["end"].tolist()[7:9] == [31 * 59, 236]
    # Several runs, which begin with a bin for each node, over a file that is there.
    for number, frame in enumerate(range(1, 3)):
        analysis.write_cooler(run, tmp_path / f"{number}.cool", 25.0, 100, frames=range(frame, frame + 1))
    cooler.merge_coolers(str(path), [str(tmp_path / f"{number}.cool") for number in range(2)], mergebuf=1000)
    merged = cooler.Cooler(str(path))
    assert merged.binsize == 100 and merged.chromnames == ["filament_0", "filament_1", "filament_2"]
    expected = analysis.contact_counts(run, 25.0, frames=range(1, 3)).toarray()
    np.testing.assert_array_equal(merged.matrix(balance=False)[:], expected)
    assert sorted(one.name for one in tmp_path.iterdir()) == ["0.cool", "1.cool", "walks.cool"]


def test_files_of_cooler_are_refused(tmp_path, monkeypatch):
    run, path = PlacedChains(random_walks(np.random.default_rng(4), (9, 5), 1)), tmp_path / "walks.cool"
    for name, given, message in (
        ("a.mcool", {}, "must end in .cool"),
        ("no/a.cool", {}, "not a directory"),
        ("a.cool", {"base_pairs": 58.8}, "base_pairs must be a whole number"),
        ("a.cool", {"bin_size": 150}, "whole segments of 100 base pairs, but is 150"),
        ("a.cool", {"base_pairs": 300_000_000}, "filament 0 has more"),
        *(
            (
                "a.cool",
                {"names": names},
                "names must be 2 different ones, one for each filament, of ASCII without colons",
            )
            for names in (["chr1"], "ab", ["chr1"] * 2, ["chr1", "chr:2"], ["chr1", ""], ["chr1", 2], ["chr1", []], 2)
        ),
    ):
        with pytest.raises(InputError, match=message):
            analysis.write_cooler(run, tmp_path / name, 25.0, **{"base_pairs": 100, **given})
    monkeypatch.setitem(sys.modules, "cooler", None)
    with pytest.raises(InputError, match="pip install cooler"):
        analysis.write_cooler(run, path, 25.0, 100)
    assert not list(tmp_path.iterdir())


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
