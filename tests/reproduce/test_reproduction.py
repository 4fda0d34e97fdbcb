"""Reproduction of a paper: rules and verdicts, records, results and pages, and that faults turn verdicts."""

import json
from dataclasses import replace

import numpy as np
import pytest

from openmm_cylchain import InputError, cli, theory
from openmm_cylchain.reproduce import (
    end_to_end,
    force_extension,
    free_segments,
    pesek2016,
    relaxing_filaments,
    simulation,
    speed,
    tables,
)
from openmm_cylchain.reproduce.case import Case, Outcome
from openmm_cylchain.reproduce.page import format_number, format_page
from openmm_cylchain.reproduce.records import Records
from openmm_cylchain.reproduce.reproduction import reproduce, unexplained
from openmm_cylchain.reproduce.result import ROUNDING, Estimate, LowerBound, Printed, Result, Rule, printed

RULE = Rule(standard_errors=3.0, tolerance=0.01, resolution=0.02)


def result(ours, error=0.01, theory=1.0, paper=None, cause="", rule=RULE):
    return Result("number", "1", Estimate(ours, error), rule, theory, paper, cause)


# Results and rules


@pytest.mark.parametrize(
    "text, value, rounding",
    [("2.685", 2.685, 5e-4), ("20.8e3", 20800.0, 50.0), ("0.29e6", 0.29e6, 5e3), ("-0.114", -0.114, 5e-4)],
)
def test_printed_numbers(text, value, rounding):
    number = printed(text, "0.028")
    assert (number.value, number.error) == (value, 0.028)
    assert number.rounding == pytest.approx(rounding)


@pytest.mark.parametrize("arguments", [("two",), ("",), (None,), ("nan",), ("inf",), ("1", "-1"), ("1", "x")])
def test_numbers_that_are_not_printed(arguments):
    with pytest.raises(InputError):
        printed(*arguments)


def test_verdict_on_the_theory():
    assert result(1.039).verdict == "agrees"
    assert result(1.041).verdict == result(0.959).verdict == "differs"
    assert "theory: +4.1 %, 4.1 standard errors" in result(1.041).reason
    assert result(1.041).unexplained and not result(1.039).unexplained
    assert result(1.039).reason == ""


def test_verdict_on_the_paper():
    paper = Printed(1.1, error=0.02, rounding=0.005)
    allowed = 3 * np.hypot(0.01, 0.02) + 0.011 + 0.005
    rule = Rule(standard_errors=3.0, tolerance=0.01)
    assert result(1.1 - 0.99 * allowed, theory=None, paper=paper, rule=rule).verdict == "agrees"
    assert result(1.1 - 1.02 * allowed, theory=None, paper=paper, rule=rule).verdict == "differs"


def test_a_cause_explains_the_paper_only_where_the_theory_agrees():
    paper = Printed(2.0)
    explained = result(1.0, paper=paper, cause="it is misprinted")
    assert explained.verdict == "differs" and not explained.unexplained
    assert explained.reason.endswith("it is misprinted")
    wrong = result(1.2, paper=paper, cause="it is misprinted")
    assert wrong.unexplained and "misprinted" not in wrong.reason
    assert result(1.0, paper=paper).unexplained


def test_a_result_that_is_too_uncertain_does_not_agree():
    assert result(1.0, error=0.019).verdict == "agrees"
    uncertain = result(1.0, error=0.021)
    assert uncertain.verdict == "differs" and uncertain.unexplained
    assert "too large" in uncertain.reason


def test_a_lower_bound_is_surely_exceeded():
    rule = LowerBound(3.0)

    def bounded(ours, error, paper_error=0.0):
        return result(ours, error, theory=None, paper=Printed(10.0, paper_error), rule=rule)

    assert bounded(11.0, 0.33).verdict == bounded(1e6, 1.0).verdict == "agrees"
    assert bounded(11.0, 0.34).verdict == bounded(9.9, 0.0).verdict == "differs"
    assert bounded(11.0, 0.3, 0.2).verdict == "differs"
    assert bounded(2.0, 0.1).unexplained
    assert "paper: 0.2 times as much" in bounded(2.0, 0.1).reason
    assert bounded(11.0, 0.1).as_dict()["paper"] == {"value": 10.0, "error": None, "relation": "> "}


@pytest.mark.parametrize("arguments", [{"ours": 1.0, "theory": None}, {"ours": np.nan}, {"ours": 1.0, "error": np.inf}])
def test_results_that_are_none(arguments):
    with pytest.raises(InputError):
        result(**arguments)


def test_rounding():
    def rounded(ours, text):
        return Result("number", "1", Estimate(ours, None), ROUNDING, ours, printed(text)).verdict

    assert rounded(0.0495, "0.05") == "agrees"
    assert rounded(0.0444, "0.05") == "differs"


def test_jackknife_is_the_standard_error_of_a_mean():
    values = np.random.default_rng(1).normal(3.0, 2.0, 50)
    estimate = simulation.jackknife(lambda mean: mean, values)
    assert estimate.value == pytest.approx(values.mean())
    assert estimate.error == pytest.approx(values.std(ddof=1) / np.sqrt(50))
    squared = simulation.jackknife(lambda mean: mean**2, values)
    assert squared.error == pytest.approx(2 * values.mean() * estimate.error, rel=0.01)


# Records


def counted(value, calls):
    calls.append(value)
    return {"double": 2 * value, "array": np.arange(3.0)}


def test_records_measure_once(tmp_path):
    calls = []

    def double(value):
        return counted(value, calls)

    first = Records(tmp_path).measure("case", double, value=2)
    again = Records(tmp_path).measure("case", double, value=2)
    assert calls == [2]
    assert first["double"] == again["double"] == 4
    assert again["array"] == pytest.approx([0, 1, 2])
    Records(tmp_path).measure("case", double, value=3)
    Records(tmp_path, force=True).measure("case", double, value=3)
    assert calls == [2, 3, 3]


def test_records_that_were_cut_off_are_measured_again(tmp_path):
    calls = []

    def double(value):
        return counted(value, calls)

    Records(tmp_path).measure("case", double, value=2)
    path = tmp_path / "case.json"
    path.write_text(path.read_text()[:-20])
    assert Records(tmp_path).measure("case", double, value=2)["double"] == 4
    assert calls == [2, 2]


# Running


@pytest.fixture
def two_cases(monkeypatch):
    calls = []

    def doubled(value):
        return counted(value, calls)

    def evaluate(records, quick):
        value = float(records.measure("double", doubled, value=1 if quick else 2)["double"])
        return Outcome(
            [result(value, theory=2.0)], {"A picture": lambda figure: figure.subplots().plot([0, 1])}, "Why."
        )

    cases = (
        Case("one", "Fig. 1: one", (1,), evaluate),
        Case("two", "Table: two", (), lambda records, quick: Outcome([result(1.0, paper=Printed(2.0), cause="A|b")])),
    )
    monkeypatch.setattr(pesek2016, "CASES", cases)
    return calls


def test_reproduction(two_cases, tmp_path, capsys):
    folder = tmp_path / "new"
    assert cli.main(["reproduce", "pesek2016", "--quick", "--output", str(folder)]) == 0
    content = json.loads((folder / "results.json").read_text())
    assert [case["key"] for case in content["cases"]] == ["one", "two"]
    assert content["cases"][0]["results"][0]["verdict"] == "agrees"
    assert content["cases"][1]["results"][0]["verdict"] == "differs"
    assert (folder / "one.png").read_bytes().startswith(b"\x89PNG")
    page = (folder / "pesek2016.md").read_text()
    assert "![A picture](one.png)" in page and "**differs**" in page and "1 of 2 results" in page
    output = capsys.readouterr()
    assert "1 of 2 results agree" in output.out and "measuring double" in output.err

    # What is there is kept; one figure with full statistics replaces that of the quick run, and no other.
    assert cli.main(["reproduce", "pesek2016", "--quick", "--output", str(folder)]) == 0
    assert two_cases == [1]
    assert cli.main(["reproduce", "pesek2016", "--figure", "1", "--output", str(folder)]) == 1
    assert two_cases == [1, 2]
    content = json.loads((folder / "results.json").read_text())
    assert [case["quick"] for case in content["cases"]] == [False, True]
    assert unexplained(content) == ["number"]
    assert "without a stated cause" in capsys.readouterr().err


@pytest.mark.parametrize(
    "arguments, message",
    [
        (["pesek2016", "--figure", "3"], "Figure 3"),
        (["pesek2016", "--figure", "-1"], "Figure -1"),
        (["nobody1999"], "nobody1999"),
    ],
)
def test_what_is_not_reproduced(arguments, message, tmp_path, capsys):
    assert cli.main(["reproduce", *arguments, "--output", str(tmp_path / "new")]) == 2
    assert message in capsys.readouterr().err
    assert not (tmp_path / "new").exists()


def test_output_that_is_no_directory_of_this_paper(two_cases, tmp_path, capsys):
    (tmp_path / "file").write_text("")
    assert cli.main(["reproduce", "pesek2016", "--output", str(tmp_path / "file")]) == 2
    (tmp_path / "results.json").write_text('{"title": "another"}')
    assert cli.main(["reproduce", "pesek2016", "--output", str(tmp_path)]) == 2
    assert two_cases == []


def test_numbers_for_people():
    assert format_number(2.68451, 0.0283) == "2.685 ± 0.028"
    assert format_number(16380.0, 770.0) == "(1.638 ± 0.077)·10⁴"
    assert format_number(0.5, None) == "0.5"
    assert format_number(-0.00002, 0.000003) == "(-2.00 ± 0.30)·10⁻⁵"
    assert format_number(0.0, 0.02) == "0.000 ± 0.020"
    assert format_number(3.0, 250.0) == "3 ± 250"
    assert format_number(2.5e11) == "2.5·10¹¹"
    assert format_number(1234.5, digits=2) == "1.2·10³"


def test_page_of_nothing():
    content = {"title": "T", "citation": "C", "cases": []}
    assert format_page(content).startswith("# T\n\nC\n\n0 of 0 results")


def page_of(results):
    case = {"title": "C", "seconds": 90.0, "quick": False, "remarks": "", "pictures": {}}
    cases = [{**case, "results": [each.as_dict() for each in results]}]
    return format_page({"title": "T", "citation": "C", "cases": cases})


def test_page_begins_with_what_differs():
    misprinted = [
        replace(result(1.0, paper=Printed(value), cause="it is misprinted"), name=f"number_{value:g}")
        for value in (2.0, 3.0)
    ]
    page = page_of([result(1.0), *misprinted, replace(result(1.3), name="wrong", unit="um")])
    assert "| C | 1 | 2 | **1** |" in page
    assert "- Differing: wrong (theory: +30 %, 30.0 standard errors)." in page
    assert "- Differing for a stated cause: number 2 (paper: " in page and "It is misprinted." in page
    assert page.count("misprinted") == 1
    table = page[page.index("| result |") :].splitlines()
    rows = [line.split(" | ")[0] for line in table if line.endswith(("agrees |", "** |", "above |"))]
    assert rows == ["| wrong", "| number 2", "| number 3", "| number"]
    assert "| wrong | µm |" in page
    assert page.count(f"Rule: {RULE}.") == 1


def test_page_gives_each_rule_where_there_are_several():
    bounded = result(12.0, theory=None, paper=Printed(10.0), rule=LowerBound(2.0))
    page = page_of([bounded, result(1.0)])
    assert "| number |  | > 10 |  | 12.000 ± 0.010 | above by at least 2 standard errors | agrees |" in page
    assert "Rule: " not in page and f"| {RULE} |" in page


# Cases


def test_tables_agree_but_for_causes(tmp_path):
    results = [each for case in tables.CASES for each in case.evaluate(Records(tmp_path), True).results]
    assert len(results) == 67
    assert not [each.name for each in results if each.unexplained]
    differing = {each.name.split("_")[0] for each in results if each.verdict == "differs"}
    assert differing == {"bending", "speed", "momentum"}


def verdicts(case, folder):
    return {each.name: each.verdict for each in case.evaluate(Records(folder), True).results}


def test_bending_potentials(tmp_path):
    (case,) = pesek2016.bending_potentials.CASES
    assert set(verdicts(case, tmp_path).values()) == {"agrees"}


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
