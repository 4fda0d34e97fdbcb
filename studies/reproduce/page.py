"""The page of a reproduced paper, in Markdown, from the content of results.json."""

import math
from itertools import groupby

_UNITS = {"us": "µs", "um": "µm", "nm^2": "nm²", "k_B T": "k_BT"}
_SUPERSCRIPTS = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


def format_page(content):
    """The page: how many results of each case agree, and for every case its pictures, what differs and a table.

    Parameters
    ----------
    content : dict
        Of results.json.
    """
    cases = content["cases"]
    lines = [f"# {content['title']}", "", content["citation"], "", _summary(cases), "", *_counts(cases)]
    for case in cases:
        lines += [f"## {case['title']}", ""]
        if case["remarks"]:
            lines += [case["remarks"], ""]
        for title, picture in case["pictures"].items():
            lines += [f"![{title}]({picture})", ""]
        results = sorted(case["results"], key=_urgency)
        lines += _reasons(results)
        lines += _table(results)
    return "\n".join(lines).rstrip() + "\n"


def _urgency(result):
    """What differs for no stated cause comes first, what agrees last."""
    return 0 if result["unexplained"] else 1 if _differs(result) else 2


def _differs(result):
    return result["verdict"] != "agrees"


def _count(results):
    """How many agree, differ from the print for a stated cause, and differ otherwise."""
    urgencies = [_urgency(result) for result in results]
    return urgencies.count(2), urgencies.count(1), urgencies.count(0)


def _summary(cases):
    results = [result for case in cases for result in case["results"]]
    agreeing, explained, unexplained = _count(results)
    text = f"{agreeing} of {len(results)} results agree with the theory and with what is printed"
    if agreeing < len(results):
        text += (
            f"; {explained} differ from the print for a stated cause and {unexplained} without one or from the theory"
        )
    quick = " Some of it has the reduced statistics of a quick run." if any(case["quick"] for case in cases) else ""
    notes = "Every verdict follows from the rule given with it. Errors are standard errors, deviations those of ours."
    return f"{text}.{quick} {notes}"


def _counts(cases):
    yield "| | agree | differ, for a stated cause | differ |"
    yield "|---|---|---|---|"
    for case in cases:
        agreeing, explained, unexplained = (str(number) for number in _count(case["results"]))
        unexplained = f"**{unexplained}**" if unexplained != "0" else unexplained
        yield f"| {case['title']} | {agreeing} | {explained} | {unexplained} |"
    yield ""


def _table(results):
    common = results[0]["rule"] if len({result["rule"] for result in results}) == 1 else None
    columns = ["result", "unit", "paper", "theory", "ours", *([] if common else ["rule"]), "verdict"]
    yield f"| {' | '.join(columns)} |"
    yield "|" + len(columns) * "---|"
    for result in results:
        paper, ours = result["paper"], result["ours"]
        cells = (
            _name(result),
            "" if result["unit"] == "1" else _UNITS.get(result["unit"], result["unit"]),
            "" if paper is None else paper.get("relation", "") + format_number(paper["value"], paper["error"]),
            "" if result["theory"] is None else format_number(result["theory"]),
            format_number(ours["value"], ours["error"]),
            *([] if common else [result["rule"]]),
            _verdict(result),
        )
        yield "| " + " | ".join(cells) + " |"
    if common:
        yield ""
        yield f"Rule: {common}."
    yield ""


def _name(result):
    return result["name"].replace("_", " ")


def _verdict(result):
    if not _differs(result):
        return result["verdict"]
    return f"**{result['verdict']}**" + ("" if result["unexplained"] else ", see above")


def _reasons(results):
    """What differs and why, each cause once."""
    differing = [result for result in results if _differs(result)]
    for cause, group in groupby(sorted(differing, key=_cause), key=_cause):
        names = "; ".join(f"{_name(result)} ({_deviation(result)})" for result in group)
        yield (
            f"- Differing for a stated cause: {names}. {cause[0].upper()}{cause[1:]}."
            if cause
            else f"- Differing: {names}."
        )
    if differing:
        yield ""


def _cause(result):
    return "" if result["unexplained"] else result["reason"].partition("; ")[2]


def _deviation(result):
    return result["reason"] if result["unexplained"] else result["reason"].partition("; ")[0]


def format_number(value, error=None, digits=4):
    """A number for people, with two digits of its error if it has one, else with so many of its own."""
    if not error:
        return _with_power(f"{value:.{digits}g}")
    exponent = 0 if value == 0 else math.floor(math.log10(abs(value)))
    if exponent >= 4 or exponent < -3:
        scale = 10.0**exponent
        return f"({format_number(value / scale, error / scale)})·10{str(exponent).translate(_SUPERSCRIPTS)}"
    decimals = max(0, 1 - math.floor(math.log10(error)))
    return f"{value:.{decimals}f} ± {error:.{decimals}f}"


def _with_power(text):
    mantissa, _, exponent = text.partition("e")
    return f"{mantissa}·10{str(int(exponent)).translate(_SUPERSCRIPTS)}" if exponent else mantissa
