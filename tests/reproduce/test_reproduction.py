"""Reproduction of papers: rules and verdicts, records, results and pages."""

import json
from dataclasses import replace

import numpy as np
import pytest

from command_line import main
from openmm_cylchain import InputError
from reproduce import pesek2016, simulation
from reproduce.case import Case, Outcome
from reproduce.page import format_number, format_page
from reproduce.records import Records
from reproduce.reproduction import unexplained
from reproduce.result import (
    ROUNDING,
    AtLeast,
    AtMost,
    Estimate,
    LowerBound,
    Printed,
    Result,
    Rule,
    printed,
)

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


def test_limits_are_not_surely_passed():
    def limited(ours, error, rule):
        return result(ours, error, theory=None, paper=Printed(10.0), rule=rule)

    most, least = AtMost(3.0, 0.05), AtLeast(3.0, 0.05)
    assert limited(11.0, 0.34, most).verdict == limited(2.0, 0.1, most).verdict == "agrees"
    assert limited(9.0, 0.34, least).verdict == limited(20.0, 0.1, least).verdict == "agrees"
    assert limited(11.0, 0.33, most).unexplained and limited(9.0, 0.33, least).unexplained
    assert limited(10.0, 0.51, most).unexplained and limited(10.0, 0.51, least).unexplained
    assert str(most) == "not above by more than 3 standard errors, with a standard error of at most 5 %"
    assert str(least) == str(most).replace("above", "below")
    assert [limited(10.0, 0.1, rule).as_dict()["paper"]["relation"] for rule in (most, least)] == ["≤ ", "≥ "]


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
    assert main(["reproduce", "pesek2016", "--quick", "--output", str(folder)]) == 0
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
    assert main(["reproduce", "pesek2016", "--quick", "--output", str(folder)]) == 0
    assert two_cases == [1]
    assert main(["reproduce", "pesek2016", "--figure", "1", "--output", str(folder)]) == 1
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
    assert main(["reproduce", *arguments, "--output", str(tmp_path / "new")]) == 2
    assert message in capsys.readouterr().err
    assert not (tmp_path / "new").exists()


def test_output_that_is_no_directory_of_this_paper(two_cases, tmp_path, capsys):
    (tmp_path / "file").write_text("")
    assert main(["reproduce", "pesek2016", "--output", str(tmp_path / "file")]) == 2
    (tmp_path / "results.json").write_text('{"title": "another"}')
    assert main(["reproduce", "pesek2016", "--output", str(tmp_path)]) == 2
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
