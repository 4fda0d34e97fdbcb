"""Benchmarks of engines and scaling: rows, JSON, ratios from given timings. How fast anything is is never asserted."""

import json
import math
import sys

import numpy as np
import openmm
import pytest

from benchmark import engines as engine_benchmark
from benchmark import measurement, memory, report, scaling, systems
from command_line import main
from support.contexts import positions_of

TINY_ENGINES = engine_benchmark.Effort(repetitions=2, seconds=1e-3)
TINY_SCALING = scaling.Effort((2, 3), (1, 2), (2,), (), 2, 2, 1e-3)


def by_name(rows):
    names = [row.name for row in rows]
    assert len(set(names)) == len(names)
    return {row.name: row for row in rows}


def test_cases_take_turns():
    calls = []
    cases = [measurement.Case(name, lambda steps, name=name: calls.append((name, steps))) for name in "ABC"]
    times = measurement.time_interleaved(cases, 3, 1e-9)
    assert [name for name, _ in calls[-9:]] == list("ABC" * 3)
    assert len({call for call in calls[-9:]}) == 3
    assert list(times) == list("ABC") and all(len(values) == 3 and np.all(values > 0) for values in times.values())


def test_times_are_per_step(monkeypatch):
    clock = [0.0]
    monkeypatch.setattr(measurement.time, "perf_counter", lambda: clock[0])

    def advance(steps):
        clock[0] += 0.25 * steps

    times = measurement.time_interleaved([measurement.Case("A", advance)], 4, 10.0)
    np.testing.assert_allclose(times["A"], 0.25)
    assert clock[0] >= 4 * 10.0


def test_slow_case_takes_at_least_one_step(monkeypatch):
    clock, taken = [0.0], []
    monkeypatch.setattr(measurement.time, "perf_counter", lambda: clock[0])

    def advance(steps):
        taken.append(steps)
        clock[0] += 7.0 * steps

    measurement.time_interleaved([measurement.Case("A", advance)], 2, 0.1)
    assert taken == [1, 1, 1, 1]


def test_standard_error_of_the_median():
    generator = np.random.default_rng(1)
    samples = generator.normal(5.0, 2.0, (4000, 25))
    spread = np.std(np.median(samples, axis=1))
    errors = [measurement.median(sample).error for sample in samples[:200]]
    assert np.mean(errors) == pytest.approx(spread, rel=0.05)
    assert measurement.median([3.0, 1.0, 100.0]).value == 3.0
    assert measurement.median([3.0]) == measurement.Estimate(3.0, None)


def test_ratio_pairs_repetitions():
    # A disturbance that hits both alike leaves no trace in the ratio.
    disturbance = np.array([1.0, 3.0, 1.0, 10.0, 2.0])
    exact = measurement.ratio(6.0 * disturbance, 2.0 * disturbance)
    assert exact.value == pytest.approx(3.0) and exact.error == pytest.approx(0.0, abs=1e-12)
    spread = measurement.ratio([2.0, 4.0, 8.0], [1.0, 1.0, 1.0])
    assert spread.value == pytest.approx(4.0)
    assert spread.error == pytest.approx(4.0 * math.sqrt(math.pi / 2.0) * math.log(2.0) / math.sqrt(3.0))
    inverse = measurement.ratio([1.0, 1.0, 1.0], [2.0, 4.0, 8.0])
    assert inverse.value == pytest.approx(1.0 / spread.value)
    assert inverse.error / inverse.value == pytest.approx(spread.error / spread.value)
    assert measurement.ratio([6.0], [2.0]).error is None


def test_difference_adds_errors_in_quadrature():
    first, second = measurement.median([10.0, 12.0, 14.0]), measurement.median([1.0, 2.0, 3.0])
    both = measurement.difference([10.0, 12.0, 14.0], [1.0, 2.0, 3.0])
    assert both.value == 10.0 and both.error == pytest.approx(math.hypot(first.error, second.error))
    assert measurement.difference([3.0], [1.0, 2.0]).error is None
    assert measurement.scaled(both, -2.0) == measurement.Estimate(-20.0, 2.0 * both.error)


def test_machine_can_be_written_as_json():
    machine = json.loads(json.dumps(measurement.describe_machine(), allow_nan=False))
    assert machine["processor"] and machine["processors"] >= 1
    assert machine["versions"]["openmm"] == openmm.Platform.getOpenMMVersion()


def given_times(**seconds):
    # Whatever case: one repetition takes twice as long as the other two.
    return {name: value * np.array([1.0, 2.0, 1.0]) for name, value in seconds.items()}


TIMES = given_times(
    compiled_reference=0.5e-3,
    compiled_1_thread=0.4e-3,
    compiled_2_threads=0.25e-3,
    compiled_all_threads=0.1e-3,
    implicit_reference=1.6e-3,
    implicit_1_thread=1.5e-3,
    implicit_double_reference=3.0e-3,
    implicit_double_1_thread=4.0e-3,
    implicit_beams_reference=12.0e-3,
    implicit_beams_1_thread=9.0e-3,
    portable_reference=20e-3,
    portable_1_thread=24e-3,
    stock_harmonic_angle_reference=1.2e-3,
    stock_harmonic_angle_1_thread=1.6e-3,
    stock_custom_angle_reference=2.4e-3,
    stock_custom_angle_1_thread=2.0e-3,
    stock_custom_angle_all_threads=4.0e-3,
)


def test_engine_ratios():
    rows, compared = engine_benchmark.engine_rows(TIMES, segments=12800)
    rows = by_name(rows)
    assert compared == {
        "compiled": "compiled_1_thread",
        "portable": "portable_reference",
        "implicit": "implicit_1_thread",
        "implicit_double": "implicit_double_reference",
        "implicit_beams": "implicit_beams_1_thread",
        "stock_openmm": "stock_harmonic_angle_reference",
        "stock_openmm_custom_angle": "stock_custom_angle_1_thread",
    }
    expected = {
        "compiled_over_portable": 50.0,
        "compiled_over_stock_openmm": 3.0,
        "compiled_over_stock_openmm_custom_angle": 5.0,
        "portable_over_stock_openmm": 0.06,
        "implicit_over_implicit_double": 2.0,
        "implicit_over_implicit_beams": 6.0,
        "implicit_double_over_implicit_beams": 3.0,
        "portable_over_stock_openmm_custom_angle": 0.1,
        "two_threads_over_one": 1.6,
        "compiled_all_threads_over_one": 4.0,
        "stock_custom_angle_all_threads_over_one": 0.5,
    }
    ratios = {name: row for name, row in rows.items() if row.unit == "1"}
    assert {name: pytest.approx(row.value) for name, row in ratios.items()} == expected
    assert all(row.error == pytest.approx(0.0, abs=1e-12) for row in ratios.values())
    assert rows["time_per_step_portable_1_thread"].value == pytest.approx(24.0)
    assert rows["speed_compiled_1_thread"].value == pytest.approx(32.0)
    assert rows["speed_compiled_1_thread"].unit == "10^6 segment steps/s"
    assert rows["speed_compiled_1_thread"].error > 0


def test_two_processors_are_all_threads():
    times = given_times(compiled_1_thread=3e-3, compiled_all_threads=2e-3)
    rows, _ = engine_benchmark.engine_rows(times, segments=10)
    assert by_name(rows)["two_threads_over_one"].value == pytest.approx(1.5)


def test_nothing_is_said_of_what_was_not_measured():
    times = {name: values for name, values in TIMES.items() if not name.startswith("compiled")}
    rows, compared = engine_benchmark.engine_rows(times, segments=10)
    assert not [row.name for row in rows if "compiled" in row.name or row.name == "two_threads_over_one"]
    assert "compiled" not in compared


def test_benchmark_of_engines(without_compiled):
    result = engine_benchmark.benchmark_engines(TINY_ENGINES, chains=3, segments=4)
    rows = by_name(result.rows)
    assert result.missing["compiled engine"]
    assert {"portable_over_stock_openmm", "speed_portable_reference", "speed_stock_custom_angle_reference"} <= set(rows)
    assert all(math.isfinite(row.value) for row in result.rows)
    assert result.settings["particles"] == 15


def test_cases_that_cannot_be_built_are_missing(monkeypatch, without_compiled):
    monkeypatch.setattr(
        engine_benchmark,
        "_places",
        lambda: {"reference": ("Reference", {}), "1_thread": ("CPU", {"NoSuchProperty": "1"})},
    )
    result = engine_benchmark.benchmark_engines(TINY_ENGINES, chains=2, segments=3)
    assert "NoSuchProperty" in result.missing["portable_1_thread"]
    assert "speed_portable_1_thread" not in by_name(result.rows)
    assert "portable_1_thread missing: " in report.format_report(result)


def test_beads_are_as_many_particles_with_stock_forces():
    for angle_force, kind in (("harmonic", openmm.HarmonicAngleForce), ("custom", openmm.CustomAngleForce)):
        beads = systems.simulate_beads(angle_force, 3, 5, "Reference", {})
        filaments = systems.simulate_filaments("portable", 3, 5, "Reference", {})
        assert beads.system.getNumParticles() == filaments.system.getNumParticles() == 18
        for topology in (beads.topology, filaments.topology):
            assert (topology.getNumChains(), topology.getNumAtoms(), topology.getNumBonds()) == (3, 18, 15)
        bonds, angles = beads.system.getForces()
        assert isinstance(bonds, openmm.HarmonicBondForce) and bonds.getNumBonds() == 15
        assert isinstance(angles, kind) and angles.getNumAngles() == 12
        beads.advance(20)
        filaments.advance(20)
        for simulated in (beads, filaments):
            positions = positions_of(simulated.context)
            lengths = np.linalg.norm(np.diff(positions[:6], axis=0), axis=1)
            np.testing.assert_allclose(lengths, 360.0, rtol=0.2)


def test_sizes():
    assert [scaling.many_chains(exponent).chains for exponent in (1, 2, 3, 6)] == [1, 2, 16, 15625]
    assert scaling.many_chains(2).segments == 128
    assert scaling.many_chains(6).segments == 10**6
    assert scaling.one_chain(5).segments == 10**5


def test_rows_of_costs():
    nanosecond = 1e-9 * np.array([1.0, 2.0, 1.0])
    costs = {scaling.many_chains(exponent): nanosecond * exponent for exponent in (2, 4, 6)}
    costs |= {scaling.one_chain(exponent): nanosecond * exponent for exponent in (2, 5)}
    rows = by_name(scaling.cost_rows(costs))
    assert rows["cost_1e6_over_1e2_segments"].value == pytest.approx(3.0)
    assert rows["cost_1e6_over_1e2_segments"].error == pytest.approx(0.0, abs=1e-12)
    assert rows["cost_1e6_over_1e4_segments"].value == pytest.approx(1.5)
    assert rows["cost_one_chain_1e5_over_1e2_segments"].value == pytest.approx(2.5)
    assert rows["cost_chains_of_64_1e4_segments"].value == pytest.approx(4.0)
    assert rows["cost_chains_of_64_1e4_segments"].unit == "ns per segment and step"


def test_rows_of_memory():
    small, large = scaling.many_chains(2), scaling.many_chains(6)
    growths = {
        small: ([memory.Growth(12800, 12800)], [memory.Growth(0, 0)]),
        scaling.one_chain(7): ([memory.Growth(0, 0)], [memory.Growth(0, 0)]),
        large: (
            [memory.Growth(1_000 * 10**6, 1_500 * 10**6)] * 3,
            [memory.Growth(800 * 10**6, 900 * 10**6)] * 3,
        ),
    }
    rows = by_name(scaling.memory_rows(growths))
    assert rows["bytes_per_segment"] == report.Row("bytes_per_segment", 200.0, 0.0, "bytes per segment")
    assert rows["memory_chains_of_64_1e6_segments"].value == 200.0
    assert rows["peak_bytes_per_segment"].value == 600.0
    assert rows["total_bytes_per_segment_of_stock"].value == 800.0
    assert rows["memory_chains_of_64_1e2_segments"].value == 100.0
    assert rows["memory_chains_of_64_1e2_segments"].error is None


def test_benchmark_of_scaling(without_compiled, monkeypatch):
    growths = {"portable": memory.Growth(3 * 128, 4 * 128), "stock": memory.Growth(128, 128)}
    monkeypatch.setattr(scaling, "measure_growth", lambda kind, chains, segments: growths[kind])
    result = scaling.benchmark_scaling(effort=TINY_SCALING)
    rows = by_name(result.rows)
    assert result.settings["engine"] == "portable" and result.missing["compiled engine"]
    assert rows["bytes_per_segment"].value == 2.0
    assert {"cost_1e3_over_1e2_segments", "cost_one_chain_1e2_over_1e1_segments"} <= set(rows)
    assert result.settings["segments"]["chains_of_64_1e3_segments"] == 1024


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="resident memory is read from /proc")
def test_memory_is_measured_in_a_fresh_process():
    few, many = (memory.measure_growth("stock", chains, 64) for chains in (2, 400))
    assert 0 < few.resident < many.resident <= many.peak


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="resident memory is read from /proc")
def test_fresh_process_imports_this_very_package(tmp_path, monkeypatch):
    for name in ("openmm_cylchain", "benchmark"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "__init__.py").write_text("raise ImportError('the wrong package')")
    monkeypatch.chdir(tmp_path)
    assert memory.measure_growth("portable", 2, 4).resident > 0


def test_failed_measurement_of_memory_is_missing(monkeypatch):
    with pytest.raises(memory.MeasurementError, match="engine must be one of"):
        memory.measure_growth("no such kind", 1, 2)

    def fail(*arguments):
        raise memory.MeasurementError("killed")

    monkeypatch.setattr(scaling, "measure_growth", fail)
    result = scaling.benchmark_scaling("portable", TINY_SCALING)
    assert result.missing["memory_chains_of_64_1e2_segments"] == "killed"
    assert "bytes_per_segment" not in by_name(result.rows)


REPORT = report.Report(
    title="Title",
    machine={"processor": "P", "processors": 2, "load_average": None},
    settings={"engine": "portable"},
    rows=[report.Row("speed", 1234.5678, 12.3, "m"), report.Row("a_ratio", 0.98765, None, "1")],
    missing={"compiled engine": "why"},
)


def test_table():
    lines = report.format_report(REPORT).splitlines()
    assert lines[0] == "Title"
    assert lines[3].split() == ["speed", "1235", "±", "12", "m"]
    assert lines[4].split() == ["a_ratio", "0.9877"]
    assert lines[5] == "compiled engine missing: why"


def test_values_of_any_size_can_be_shown():
    for value, error in ((0.0, None), (0.0, 0.0), (1e9, 1e3), (1e-9, 1e-12), (-5.0, 200.0)):
        rows = [report.Row("name", value, error, "1")]
        text = report.format_report(report.Report("", REPORT.machine, {}, rows, {}))
        assert float(text.splitlines()[3].split()[1]) == pytest.approx(value, abs=1e-12 + (error or 0.0))


@pytest.fixture
def instant(monkeypatch):
    """Benchmarks that are over at once."""
    monkeypatch.setattr(engine_benchmark, "benchmark_engines", lambda *arguments, **named: REPORT)
    monkeypatch.setattr(scaling, "benchmark_scaling", lambda *arguments, **named: REPORT)


@pytest.mark.parametrize("name", ["engines", "scaling"])
def test_json(name, instant, tmp_path, capsys):
    path = tmp_path / "result.json"
    assert main(["benchmark", name, "--quick", "--json", str(path)]) == 0
    content = json.loads(path.read_text())
    assert set(content) == {"machine", "settings", "rows", "missing"}
    assert content["rows"] == [
        {"name": "speed", "value": 1234.5678, "error": 12.3, "unit": "m"},
        {"name": "a_ratio", "value": 0.98765, "error": None, "unit": "1"},
    ]
    assert content["machine"] == REPORT.machine and content["missing"] == {"compiled engine": "why"}
    assert "compiled engine missing: why" in capsys.readouterr().out


def test_file_that_cannot_be_written_is_refused_before_measuring(instant, tmp_path, capsys):
    for path in (tmp_path / "no" / "file.json", tmp_path):
        assert main(["benchmark", "engines", "--json", str(path)]) == 2
        captured = capsys.readouterr()
        assert captured.err.startswith("error: ") and captured.out == ""


def test_failure_to_write_does_not_speak_of_runs(instant, tmp_path, monkeypatch, capsys):
    def fail(*arguments):
        raise OSError("No space left on device")

    monkeypatch.setattr(report, "write_json", fail)
    assert main(["benchmark", "engines", "--json", str(tmp_path / "file.json")]) == 1
    error = capsys.readouterr().err
    assert "No space left" in error and "--resume" not in error


def test_missing_engine_is_refused(without_compiled, capsys):
    assert main(["benchmark", "scaling", "--engine", "compiled"]) == 2
    assert "compiled engine is missing" in capsys.readouterr().err


def test_interruption(monkeypatch, capsys):
    def interrupt(*arguments, **named):
        raise KeyboardInterrupt

    monkeypatch.setattr(engine_benchmark, "benchmark_engines", interrupt)
    assert main(["benchmark", "engines"]) == 130
    assert "--resume" not in capsys.readouterr().err
