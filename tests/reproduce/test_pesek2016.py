"""Reproduction of Pesek et al. 2016: cases, fits, and that faults turn verdicts."""

from dataclasses import replace

import numpy as np
import pytest

from openmm_cylchain import theory
from reproduce import (
    end_to_end,
    force_extension,
    free_segments,
    pesek2016,
    relaxing_filaments,
    simulation,
    speed,
    tables,
)
from reproduce.records import Records
from reproduce.reproduction import reproduce, unexplained
from reproduce.result import Printed
from support.verdicts import verdicts


def test_tables_agree_but_for_causes(tmp_path):
    results = [each for case in tables.CASES for each in case.evaluate(Records(tmp_path), True).results]
    assert len(results) == 67
    assert not [each.name for each in results if each.unexplained]
    differing = {each.name.split("_")[0] for each in results if each.verdict == "differs"}
    assert differing == {"bending", "speed", "momentum"}


def test_bending_potentials(tmp_path):
    (case,) = pesek2016.bending_potentials.CASES
    assert set(verdicts(case, tmp_path).values()) == {"agrees"}


@pytest.mark.slow
def test_free_segments_and_planted_faults(tmp_path, monkeypatch):
    orientation, displacement = free_segments.CASES
    content = reproduce("pesek2016", tmp_path / "right", figure=7, quick=True)
    assert unexplained(content) == []
    assert set(verdicts(displacement, tmp_path / "right" / "measurements").values()) == {"agrees"}
    with monkeypatch.context() as planted:
        planted.setattr(simulation, "VISCOSITY", 1.1 * simulation.VISCOSITY)
        assert verdicts(orientation, tmp_path / "viscous")["rotational_relaxation_time"] == "differs"
        assert "differs" in verdicts(displacement, tmp_path / "viscous").values()
    monkeypatch.setattr(simulation, "TEMPERATURE", 1.1 * simulation.TEMPERATURE)
    assert verdicts(orientation, tmp_path / "hot")["rotational_relaxation_time"] == "differs"


class Given:
    """Records of times that are given: 1 ms for a step of one filament of beads, as long for so many segments."""

    def __init__(self, segments=201, own=1.0, energy=1.0, noise=0.01):
        self.segments, self.own, self.energy = segments, own, energy
        self.generator, self.noise = np.random.default_rng(1), noise

    def measure(self, name, function, filaments, lengths, steps, **settings):
        if function is speed.energies_of_filaments:
            return {"energy": np.array([1.0, self.energy]), "error": np.array([0.01, 0.01])}
        segment = 1e-3 / self.segments
        times = {
            curve: segment * np.array([1200 / length * np.ones(9) for length in lengths])
            for curve in ("equal", "own", "implicit")
        }
        times = {"beads": 1e-3 * np.ones(9), **times, "own": self.own * times["own"]}
        noisy = {
            name: time * np.exp(self.noise * self.generator.normal(size=time.shape)) for name, time in times.items()
        }
        return {"processor": "abacus", **noisy}


def speed_verdicts(**given):
    return {each.name: each for each in speed.evaluate(Given(**given), True).results[:5]}


def test_speed_up_of_given_times():
    results = speed_verdicts(segments=150)
    assert {each.verdict for each in results.values()} == {"agrees"}
    expected = {
        "speed_of_1_segment_over_beads": 150.0,
        "speed_of_120_segments_over_beads": 150.0 / 120.0,
        "largest_speed_up_at_own_bounds": 150.0 * 255.5,
        "cost_of_a_step_at_own_bounds": 1.0,
        "smallest_speed_up_of_scheme_implicit": 150.0 / 120.0 * speed.steps_of_segments(10)["implicit"] / 10.0,
    }
    for name, value in expected.items():
        assert results[name].ours.value == pytest.approx(value, rel=0.02)
    outcome = speed.evaluate(Given(), True)
    assert "processor named abacus" in outcome.remarks
    assert [each.name for each in outcome.results[5:]][-1] == "worst_energy_over_exact_of_scheme_implicit"


def test_speed_up_that_differs():
    faster = speed_verdicts(segments=800, noise=0.0)["speed_of_120_segments_over_beads"]
    assert faster.verdict == "differs" and not faster.unexplained
    assert "1250 ns for a step here and a bead 4975 ns" in faster.reason
    slower = speed_verdicts(segments=9)
    assert slower["speed_of_120_segments_over_beads"].unexplained
    assert slower["speed_of_1_segment_over_beads"].unexplained
    assert slower["largest_speed_up_at_own_bounds"].verdict == "agrees"
    assert speed_verdicts(segments=7)["largest_speed_up_at_own_bounds"].unexplained
    assert speed_verdicts(own=1.1)["cost_of_a_step_at_own_bounds"].unexplained
    assert speed_verdicts(noise=1.0)["cost_of_a_step_at_own_bounds"].unexplained
    assert speed.evaluate(Given(energy=1.1), True).results[-1].unexplained
    assert not speed.evaluate(Given(energy=0.95), True).results[-1].unexplained


def test_speed_of_filaments_that_are_timed():
    lengths = [30, 1200]
    steps = {curve: [speed.steps_of_segments(length)[curve] for length in lengths] for curve in speed._CURVES}
    assert steps["equal"] == [10.0, 10.0]
    assert steps["own"] == pytest.approx([221.0, 2555.0], rel=5e-3)
    times = speed.timed_filaments(2, lengths, steps, bead_step=10.0, repetitions=3, seconds=2e-3)
    assert times["beads"].shape == (3,) and np.shape(times["implicit"]) == (2, 3)
    assert times["beads"].min() > np.max(times["equal"][1]) > 0.0
    energies = speed.energies_of_filaments(8, lengths, steps["implicit"], sampled_segments=20000)
    assert len(energies["energy"]) == 3
    for energy, error in zip(energies["energy"], energies["error"]):
        assert error < 0.025
        assert abs(energy - 1.0) < 4 * error + 0.02


def test_bending_stiffness_of_actin_and_a_planted_fault(tmp_path, monkeypatch):
    monkeypatch.setattr(end_to_end, "_ACTIN_SEGMENTS", {True: (4, 8)})
    case = end_to_end.CASES[0]
    assert set(verdicts(case, tmp_path / "right").values()) == {"agrees"}
    stiff = replace(simulation.ACTIN, bending_rigidity=1.1 * simulation.ACTIN.bending_rigidity)
    monkeypatch.setattr(simulation, "ACTIN", stiff)
    assert "differs" in verdicts(case, tmp_path / "stiff").values()


def test_slowest_relaxation_of_rods_and_coils():
    """That of a rod grows with the fourth power of its length, that of a coil with the second."""
    rod = end_to_end._slowest_relaxation("actin", 4) / end_to_end._slowest_relaxation("actin", 2)
    coil = end_to_end._slowest_relaxation("actin", 2000) / end_to_end._slowest_relaxation("actin", 1000)
    assert rod == pytest.approx(16, rel=0.01)
    assert coil == pytest.approx(4, rel=0.1)


def test_fitted_relaxation_time():
    generator = np.random.default_rng(1)
    time = np.linspace(0.0, 2.0, 41)
    values = np.exp(-time / 0.8)[:, None] + 0.05 * generator.normal(size=(41, 24))
    estimate = end_to_end.fitted_relaxation_time(time, values)
    assert abs(estimate.value - 0.8) < 4 * estimate.error < 0.08


def test_single_filaments_explain_a_printed_time_that_they_scatter_around():
    generator = np.random.default_rng(2)
    time = np.linspace(0.0, 2.0, 41)
    rates = generator.normal(1.0, 0.5, 400)
    relative = np.exp(-np.outer(time, rates))
    assert end_to_end.single_filament_rates(time, relative) == pytest.approx(rates)
    assert "from 0.0" in end_to_end._cause(time, relative, Printed(3.0))
    assert end_to_end._cause(time, relative, Printed(0.1)) == ""


def test_fits_of_force_and_extension():
    length, kT = force_extension._CONTOUR, 310.0
    forces = np.array([0.01, 0.03, 0.1, 0.3, 0.9]) * 0.602214076
    extensions = length * theory.marko_siggia_extension(forces, 12345.0, kT)
    assert force_extension.fitted_persistence_length(extensions, forces) == pytest.approx(12345.0, rel=1e-5)
    power = length - forces / (3.0 * forces**1.4)
    assert force_extension.fitted_power_law(power, forces) == pytest.approx((1.4, 3.0))
    strong = np.array([120.0, 500.0, 900.0]) * 0.602214076
    springs = length + strong / 0.5
    assert force_extension.fitted_limit(springs, strong) == pytest.approx(0.5)
    both = np.concatenate([power, springs]), np.concatenate([forces, strong])
    assert force_extension.fitted_crossover(*both) == pytest.approx((0.5 / 3.0) ** (1 / 1.4))


def test_pulled_filaments_have_the_exact_extension():
    settings = {**force_extension._settings(40.0, True), "stride": 5, "frames": 60, "discarded": 100}
    copies = force_extension.pulled_filaments(**settings)["extension"]
    expected = theory.chain_extension(simulation.ACTIN, 64, 40.0 * 0.602214076, 310.0)
    error = copies.std(ddof=1) / np.sqrt(len(copies))
    assert error < 0.5
    assert abs(copies.mean() - expected) < 4 * error


def test_relaxing_filaments():
    settings = {"extension_time_microseconds": 0.1, "chains": 80, "seed": 1}
    data = relaxing_filaments.relaxing_filaments(step_microseconds=1.0, steps=[0, 10, 300], **settings)
    assert data["time"] == pytest.approx([0, 10, 300])
    assert all(data[name].shape == (3, 40) for name in ("shortening", "stretching", "bending"))
    assert np.abs([data[name][0] for name in ("shortening", "stretching", "bending")]).max() < 1e-6
    # Bends stretch the straight filament until its ends have come nearer.
    stretching = data["stretching"].mean(axis=1)
    assert stretching[1] > 1.15 * 0.5 > 0.9 * stretching[2]
    assert np.all(np.diff(data["bending"].mean(axis=1)) > 0)


def test_linear_relaxation():
    """Each joint has k_B T in the end; energies and shortening grow linearly in the beginning."""
    bending, shortening = relaxing_filaments.linear_relaxation([1e-6, 2e-6, 1e13])
    assert bending[2] == pytest.approx(1.0)
    assert bending[1] / bending[0] == pytest.approx(2.0, rel=1e-4)
    assert shortening[1] / shortening[0] == pytest.approx(2.0, rel=1e-4)


def test_stages_of_a_relaxation():
    generator = np.random.default_rng(1)
    time = np.geomspace(1e-3, 1e5, 200)
    values = 2.0 * time[:, None] ** 0.37 * (1 + 0.02 * generator.normal(size=(200, 20)))
    whole = relaxing_filaments.Relaxation(0.1, [{"time": time, "shortening": values}])
    estimate = whole.exponent("shortening", (1.0, 1e3))
    assert abs(estimate.value - 0.37) < 4 * estimate.error < 0.01
    assert whole.at("shortening", 1.0).value == pytest.approx(2.0, rel=0.05)
    names = ("shortening", "stretching", "bending")
    stages = [
        {"time": np.array([1.0, 2.0, 3.0]), **dict.fromkeys(names, np.ones((3, 2)))},
        {"time": np.array([2.0, 3.0, 4.0]), **dict.fromkeys(names, 2 * np.ones((3, 2)))},
    ]
    relaxation = relaxing_filaments.Relaxation(0.1, stages)
    times, joined = relaxation.joined("shortening")
    assert times == pytest.approx([1, 2, 3, 4])
    assert joined[:, 0] == pytest.approx([1, 1, 1, 2])
    (overlap,) = relaxation.overlaps()
    assert overlap.ours.value == pytest.approx(2.0)
    assert overlap.verdict == "differs"
