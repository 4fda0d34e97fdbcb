"""Reproduction of Panja, Barkema and van Leeuwen 2015: closed forms, cases, and that faults turn verdicts."""

from dataclasses import replace

import numpy as np
import pytest

from reproduce import (
    base_pairs,
    coarse_graining,
    explicit_steps,
    inextensible_chains,
    largest_steps,
    mode_coupling,
    simulated_time,
    tumbling,
)
from reproduce.records import Records
from reproduce.result import Estimate
from support.verdicts import verdicts

# Closed forms


@pytest.mark.parametrize(
    ("bonds", "squares"),
    [(63, (35444, 11.1587, 140.60)), (255, (382740, 11.1587, 5805.1))],
)
def test_exact_mean_squares(bonds, squares):
    assert base_pairs.mean_squares(bonds) == pytest.approx(squares, rel=2e-5)


def test_coarse_graining_of_table_3():
    """r = 120 and y = 12000 give the rows of Table III from the second on, T* of 15 base pairs cut off."""
    for k in (2, 5, 10, 12, 15, 20):
        temperature, nu = (float(text) for text in coarse_graining._TABLE_3[k])
        assert coarse_graining.coarse(120.0, 12000.0, k) == pytest.approx((temperature, nu), rel=1.2e-3)


def test_coupling_of_one_bond():
    """A single bond has H_1 = sqrt(2) along it; DeltaH_1 is what the bond is shorter or longer than b, over b."""
    positions = np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 0.5]])
    kind = base_pairs.BASE_PAIRS
    rest, whole = mode_coupling.mode_forces(kind, positions)
    force = kind.stiffness * kind.natural_length
    assert np.linalg.norm(whole[1]) == pytest.approx(np.sqrt(2.0) * force)
    assert np.linalg.norm(rest[1]) == pytest.approx(np.sqrt(2.0) * force * (0.5 / kind.bead_spacing - 1.0))


def test_inextensible_chains_in_equilibrium():
    generator = np.random.default_rng(1)
    temperature, bonds, copies = 0.3, 9, 40000
    tangents = inextensible_chains.drawn_bonds(temperature, bonds, copies, generator)
    assert np.linalg.norm(tangents, axis=2) == pytest.approx(np.ones((copies, bonds)))
    parts = [inextensible_chains.mean_squares(part) for part in np.array_split(tangents, 20)]
    error = np.std(parts, axis=0, ddof=1) / np.sqrt(20)
    exact = inextensible_chains.exact_mean_squares(temperature, bonds)
    assert np.all(np.abs(np.mean(parts, axis=0) - exact) < 4 * error)
    assert np.all(error < 0.01 * exact)


def test_inextensible_chains_keep_lengths_and_energy():
    """Lengths stay; without noise, the energy falls to that of a straight chain."""
    generator = np.random.default_rng(2)
    tangents = inextensible_chains.drawn_bonds(0.3, 6, 8, generator)
    bends = [np.sum(tangents[:, 1:] * tangents[:, :-1], axis=2).sum(axis=1)]
    for _ in range(400):
        tangents, _ = inextensible_chains.advanced(tangents, 0.02, 0.0, generator)
        assert np.linalg.norm(tangents, axis=2) == pytest.approx(np.ones((8, 6)), abs=1e-12)
        bends.append(np.sum(tangents[:, 1:] * tangents[:, :-1], axis=2).sum(axis=1))
    assert np.all(np.diff(bends, axis=0) > -1e-9)
    assert np.all(bends[-1] > 4.8)


def test_tumbles_are_counted_from_side_to_side():
    there_and_back = [0.9, 0.2, -0.2, 0.4, -0.5, -0.1, -0.9, 0.31]
    never = [0.9, 0.8, 0.1, -0.2, -0.29, 0.1, 0.2, 0.7]
    assert tumbling.tumbles(np.transpose([there_and_back, never])).tolist() == [2, 0]


# Cases and planted faults


def planted(monkeypatch, **factors):
    changes = {name: factor * getattr(base_pairs.SIMULATED, name) for name, factor in factors.items()}
    monkeypatch.setattr(base_pairs, "SIMULATED", replace(base_pairs.SIMULATED, **changes))


def differing(case, folder):
    return {name for name, verdict in verdicts(case, folder).items() if verdict == "differs"}


def test_tables_agree_but_for_causes(tmp_path):
    coarse, actin, _ = coarse_graining.CASES
    results = [each for case in (coarse, actin) for each in case.evaluate(Records(tmp_path), True).results]
    assert not [each.name for each in results if each.unexplained]
    agreeing = {each.name for each in results if each.verdict == "agrees"}
    assert {"friction_of_a_base_pair", "unit_of_time", "nu_of_20_base_pairs_with_r_120_and_y_12000"} <= agreeing
    assert all(each.name in agreeing for each in results if each.name.endswith("with_y_7.765e7"))
    assert all(each.name not in agreeing for each in results if each.name.startswith("unit_of_time_of_2_base"))


def test_coupling_of_modes_and_a_planted_fault(tmp_path, monkeypatch):
    (case,) = mode_coupling.CASES
    assert not differing(case, tmp_path / "right")
    planted(monkeypatch, bending_rigidity=1.2)
    assert "ratio_of_mode_31" in differing(case, tmp_path / "stiff")


@pytest.mark.slow
def test_largest_steps_and_a_planted_fault(tmp_path, monkeypatch):
    runs = largest_steps._Runs(64, 4e4, 1e2, 2, (5.0, 10.0, 20.0, 50.0, 100.0), (20.0,))
    monkeypatch.setattr(largest_steps, "_RUNS", {True: {63: runs}})
    ladders, _ = largest_steps.CASES
    results = ladders.evaluate(Records(tmp_path / "right"), True).results
    assert len(results) == 6 and not [each.name for each in results if each.unexplained]
    planted(monkeypatch, bending_rigidity=0.8)
    wrong = differing(ladders, tmp_path / "soft")
    assert "largest_deviation_equilibrium_implicit_63_bonds_20_tau" in wrong


def test_deviations_are_those_that_are_known():
    ratios = {0: Estimate(1.02, 0.01), 1: Estimate(0.96, 0.015), 2: Estimate(1.3, 0.05)}
    largest = largest_steps._largest_deviation(ratios, largest_steps._EQUILIBRIUM)
    assert (largest.value, largest.error) == pytest.approx((0.04, 0.015))
    assert largest_steps._largest_deviation({0: Estimate(1.3, 0.05)}, largest_steps._EQUILIBRIUM) is None


def test_rates_of_exponential_correlations():
    """Q = <Q^2> e^(-t) has the rate e^(-1) - 1 from a lag to twice that; a displacement 6 D t has the rate 1."""
    correlation = np.exp(-np.array([1.0, 2.0]))
    losses = np.repeat(2.0 * (1.0 - correlation)[:, None], 3, axis=1)
    losses[:, 2] = (6.0, 12.0)
    data = {"squares": np.ones((3, 4)), "losses": np.repeat(losses[..., None], 4, axis=2)}
    rates = largest_steps._rates([1.0], data)
    assert [rates[which, 1.0].value for which in range(3)] == pytest.approx([np.exp(-1) - 1, np.exp(-1) - 1, 1.0])


class Given:
    """Records of times that are given: so many microseconds for a step of a bead."""

    def __init__(self, modes, implicit):
        self.seconds = {"modes": 1e-6 * modes, "implicit": 1e-6 * implicit, "recommended": 1e-6 * implicit}

    def measure(self, name, function, bonds, steps, **settings):
        noise = 1.0 + 0.01 * np.random.default_rng(1).normal(size=9)
        times = {curve: [count * second * noise for count in bonds] for curve, second in self.seconds.items()}
        return {"processor": "abacus", **times}


def test_simulated_time_of_given_times():
    outcome = simulated_time.evaluate(Given(modes=0.02, implicit=0.2), True)
    assert "processor named abacus" in outcome.remarks
    results = {each.name: each for each in outcome.results}
    assert not [each.name for each in outcome.results if each.unexplained]
    # 3600 s/(63 0.02 us) steps of 10 times 0.1557 ps.
    speed = results["ms_in_an_hour_modes_64_base_pairs"].ours.value
    assert speed == pytest.approx(3600 / (63 * 0.02e-6) * 1.557e-9, rel=0.02)
    assert results["implicit_over_modes_256_base_pairs_of_16_chains"].ours.value == pytest.approx(2.0)
    slow = simulated_time.evaluate(Given(modes=2.0, implicit=20.0), True).results
    assert "ms_in_an_hour_modes_256_base_pairs" in {each.name for each in slow if each.unexplained}


def test_chains_are_timed():
    steps = {"modes": [10.0], "implicit": [20.0], "recommended": [1000.0]}
    times = simulated_time.timed_chains([31], 2, steps, repetitions=3, seconds=2e-3)
    assert all(np.shape(times[curve]) == (1, 3) and np.min(times[curve]) > 0 for curve in steps)


@pytest.mark.slow
def test_euler_and_its_bound(tmp_path):
    euler, _ = explicit_steps.CASES
    results = {each.name: each for each in euler.evaluate(Records(tmp_path), True).results}
    assert not [name for name, each in results.items() if each.unexplained]
    assert results["largest_stable_step_of_euler"].ours.value == pytest.approx(0.294, abs=0.015)
    assert results["largest_stable_step_of_euler_over_nu_at_small_nu"].verdict == "differs"


@pytest.mark.slow
def test_inextensible_chains_and_a_planted_fault(tmp_path, monkeypatch):
    monkeypatch.setattr(explicit_steps, "_TIMES", {True: {(7, 1e-2): 6.0}})
    _, case = explicit_steps.CASES
    right = {each.name: each for each in case.evaluate(Records(tmp_path / "right"), True).results}
    assert not [name for name, each in right.items() if each.unexplained]
    bending = inextensible_chains._bending
    monkeypatch.setattr(inextensible_chains, "_bending", lambda tangents: 0.7 * bending(tangents))
    assert "deviation_of_shortening_7_bonds_step_0.01" in differing(case, tmp_path / "soft")


@pytest.mark.slow
def test_dimers_and_a_planted_fault(tmp_path, monkeypatch):
    *_, case = coarse_graining.CASES
    assert not differing(case, tmp_path / "right")

    class Slippery:
        """Dimers with too little friction."""

        def coarse_grained(self, beads):
            kind = base_pairs.BASE_PAIRS.coarse_grained(beads)
            return replace(kind, bead_friction=kind.bead_friction / (1.5 if beads > 1 else 1.0))

    monkeypatch.setattr(base_pairs, "SIMULATED", Slippery())
    assert differing(case, tmp_path / "slippery")


def test_tumbling(tmp_path):
    data = tumbling.tumbling_chains("implicit", 800.0, 20, 3, seed=1)
    assert data["along"].shape == data["across"].shape == (20, 3)
    assert np.abs(data["along"]).max() < 1.2
    # The flow turns chains along x.
    assert np.mean(data["along"][10:] ** 2) > 5.0 * np.mean(data["across"][10:] ** 2)
    assert tumbling.weissenberg_number(1.54e-4, 52.0) == pytest.approx(5.53e3, rel=1e-3)
