"""The benchmark of DNA base pair by base pair: rows of one chain. How fast anything is is never asserted."""

from benchmark.base_pairs import BasePairEffort, benchmark_base_pairs


def test_rows_of_one_chain():
    rows = {row.name: row for row in benchmark_base_pairs(BasePairEffort((), 1, 1, 2, 1e-3, (10, 20, 40))).rows}
    assert set(rows) == {
        "time_per_bead_10",
        "time_per_bead_20",
        "time_per_bead_40",
        "time_per_bead_20_over_10",
        "time_per_bead_40_over_10",
    }
    assert rows["time_per_bead_40"].unit == "us"
    assert all(row.value > 0.0 for row in rows.values())
