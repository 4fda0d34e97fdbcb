"""The benchmarks of the time step and of beads: what they conclude from given errors, and that they run."""

import json
from dataclasses import replace

import numpy as np
import pytest

from benchmark import bead_spring, measurement, time_step, time_step_figure
from benchmark.measurement import Estimate
from benchmark.time_step import StepErrors, SystemErrors, ladder
from benchmark.time_step_systems import F_ACTIN_SYSTEM, WORKLOAD
from command_line import main
from openmm_cylchain.time_steps.schemes import CYLINDER_SCHEMES

TINY = time_step.Effort((replace(F_ACTIN_SYSTEM, segments=4),), frames=24, share=0.05, every=3, repetitions=2)


def given(scheme, step, equilibrium, dynamics=0.0, error=0.001):
    return StepErrors(
        scheme,
        step,
        {"bending energy": Estimate(equilibrium, error)},
        {"orientation, 10 steps": Estimate(dynamics, error)},
        Estimate(1e-3, None),
    )


def test_ladder():
    assert ladder(0.05, 10.0) == pytest.approx([0.05, 0.1, 0.2, 0.5, 1, 2, 5, 10])
    assert ladder(3.0, 2e3, every=3) == pytest.approx([10, 100, 1000])


def test_largest_step_is_below_the_first_that_surely_fails():
    steps = [
        given("implicit", 1.0, 0.01),
        given("implicit", 2.0, -0.051),
        given("implicit", 5.0, 0.02, dynamics=-0.09),
        given("implicit", 10.0, 0.02, dynamics=0.13),
        given("implicit", 20.0, 0.01),
        given("euler", 1.0, 0.2),
        given("midpoint", 1.0, np.inf, error=None),
    ]
    result = SystemErrors(F_ACTIN_SYSTEM, steps, 4.0)
    divided = replace(steps[2], divided=0.01)
    assert SystemErrors(F_ACTIN_SYSTEM, [*steps[:2], divided], 4.0).largest_step("implicit", 0.05, 0.10).step == 1.0
    # The error of -5.1 % is within two standard errors of 5 %.
    assert result.largest_step("implicit", 0.05, 0.10).step == 5.0
    assert result.largest_step("implicit", 0.02, 0.05).step == 1.0
    assert result.largest_step("euler", 0.05, 0.10) is None
    assert result.largest_step("midpoint", 0.05, 0.10) is None
    rows, missing = time_step.largest_step_rows([result])
    values = {row.name: row.value for row in rows}
    assert values["largest_step_implicit_f_actin"] == 5e-6
    assert values["recommended_step_f_actin"] == 4e-6
    assert set(missing) >= {"largest_step_euler_f_actin", "largest_step_midpoint_f_actin_tight"}
    assert time_step.format_errors(result).count("blown up") == 1


def test_changes_of_the_middle():
    generator = np.random.default_rng(1)
    nodes = np.cumsum(generator.normal(size=(40, 3, 9, 3)), axis=0)
    middle = nodes[:, :, time_step._middle(9)]
    assert middle.shape == (40, 3, 3, 3)
    squares = ((middle[5:] - middle[:-5]) ** 2).sum(axis=-1).mean(axis=(0, 2))
    assert time_step._mean_square_change(middle, 5) == pytest.approx(squares)
    assert [time_step._middle(count) for count in (1, 2, 4)] == [slice(0, 1), slice(0, 2), slice(1, 3)]


def test_errors_of_a_system():
    result = time_step.measure_system(TINY.systems[0], TINY)
    schemes = {one.scheme for one in result.steps}
    assert schemes == set(CYLINDER_SCHEMES)
    for one in result.steps:
        assert set(one.equilibrium) == {"stretching energy", "bending energy", "end-to-end distance"}
        assert all(np.isfinite(error.value) for error in (*one.equilibrium.values(), *one.dynamics.values()))
    compared = [one for one in result.of_scheme("implicit") if one.dynamics]
    assert len(compared) == len(result.of_scheme("implicit")) - 1
    assert set(compared[0].dynamics) == {
        f"{name}, {steps} steps" for name in ("end-to-end vector", "orientation", "displacement") for steps in (10, 20)
    }


def test_steps_that_blow_up_end_the_ladder(monkeypatch):
    monkeypatch.setattr(time_step, "_simulate", lambda *arguments: None)
    result = time_step.measure_system(TINY.systems[0], TINY)
    assert [one.scheme for one in result.steps] == ["implicit", "euler", "midpoint", "implicit-second-order"]
    assert all(not one.passes(1.0, 1.0) for one in result.steps)
    assert "blown up" in time_step.format_errors(result)


def test_benchmark_of_the_time_step(monkeypatch, tmp_path, capsys):
    monkeypatch.setattr(time_step, "QUICK", TINY)
    monkeypatch.setattr(time_step, "WORKLOAD", replace(WORKLOAD, segments=4, chains=20))
    monkeypatch.setattr(time_step, "time_interleaved", quickly)
    paths = tmp_path / "result.json", tmp_path / "figure.png"
    assert main(["benchmark", "time-step", "--quick", "--json", str(paths[0]), "--plot", str(paths[1])]) == 0
    content = json.loads(paths[0].read_text())
    names = {row["name"] for row in content["rows"]}
    assert {"recommended_step_f_actin", "speed_stock_openmm_bead_spring"} <= names
    assert any(name.startswith("error_bending_energy_implicit_f_actin_step_") for name in names)
    names |= set(content["missing"])
    assert {"largest_step_implicit_f_actin", "simulated_seconds_per_second_cytosim_workload"} <= names
    assert paths[1].stat().st_size > 1000
    assert "scheme" in capsys.readouterr().out


def quickly(cases, repetitions, seconds, say=None, minimum_steps=1):
    return measurement.time_interleaved(cases, repetitions, 1e-3)


def test_plot_that_cannot_be_written_is_refused_before_measuring(monkeypatch, tmp_path, capsys):
    monkeypatch.setattr(time_step, "benchmark_time_step", lambda *arguments: pytest.fail("has measured"))
    assert main(["benchmark", "time-step", "--plot", str(tmp_path / "no" / "figure.png")]) == 2
    assert capsys.readouterr().err.startswith("error: ")
    assert main(["benchmark", "time-step", "--plot", str(tmp_path / "figure.txt")]) == 2
    assert "figure.txt" in capsys.readouterr().err


def test_figure_of_a_system_without_dynamics(tmp_path):
    steps = [replace(given("implicit", step, 0.01), dynamics={}) for step in (1.0, 10.0)]
    time_step_figure.write_figure([SystemErrors(F_ACTIN_SYSTEM, steps, 4.0)], tmp_path / "figure.svg")
    assert (tmp_path / "figure.svg").read_text().startswith("<?xml")


def test_benchmark_of_beads(monkeypatch):
    monkeypatch.setattr(bead_spring, "time_interleaved", quickly)
    effort = bead_spring.BeadEffort((12, 3), 40, 200, replace(TINY, systems=(), share=1.0))
    rows = {row.name: row.value for row in bead_spring.benchmark_bead_spring(effort).rows}
    # An explicit step keeps the energy of bonds within 5 % up to about 0.1/(4 k/gamma).
    assert 0.2e-6 <= rows["largest_step_beads"] <= 5e-6
    assert rows["simulated_time_over_bead_spring"] > 2e4


def test_energies_of_beads_are_exact_for_small_steps():
    beads = bead_spring._Beads(20)
    assert max(beads._energy_errors(0.1, 400)) < 0.03
    assert max(beads._energy_errors(10.0, 400)) > 0.3
