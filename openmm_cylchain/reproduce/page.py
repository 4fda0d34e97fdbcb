"""The page of a reproduced paper, in Markdown, from the content of results.json."""

import math

_SUPERSCRIPTS = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


def format_page(content):
    """The page: a summary, and for every case its pictures and a table.

    Parameters
    ----------
    content : dict
        Of results.json.
    """
    lines = [f"# {content['title']}", "", content["citation"], "", _summary(content["cases"]), ""]
    for case in content["cases"]:
        lines += [f"## {case['title']}", ""]
        if case["remarks"]:
            lines += [case["remarks"], ""]
        for title, picture in case["pictures"].items():
            lines += [f"![{title}]({picture})", ""]
        lines += _table(case["results"])
        lines += _reasons(case["results"])
    return "\n".join(lines).rstrip() + "\n"


def _summary(cases):
    results = [result for case in cases for result in case["results"]]
    agreeing = sum(result["verdict"] == "agrees" for result in results)
    unexplained = sum(result["unexplained"] for result in results)
    text = f"{agreeing} of {len(results)} results agree with the theory and with what is printed"
    if agreeing < len(results):
        text += f"; {len(results) - agreeing - unexplained} differ from the print for a stated cause"
        text += f" and {unexplained} without one or from the theory"
    quick = " Some of it has the reduced statistics of a quick run." if any(case["quick"] for case in cases) else ""
    return f"{text}.{quick} Every verdict follows from the rule beside it."


def _table(results):
    yield "| result | unit | paper | theory | ours | rule | verdict |"
    yield "|---|---|---|---|---|---|---|"
    for result in results:
        paper, ours = result["paper"], result["ours"]
        cells = (
            result["name"].replace("_", " "),
            "" if result["unit"] == "1" else result["unit"],
            "" if paper is None else paper["relation"] + format_number(paper["value"], paper["error"]),
            "" if result["theory"] is None else format_number(result["theory"]),
            format_number(ours["value"], ours["error"]),
            result["rule"],
            result["verdict"] if result["verdict"] == "agrees" else f"**{result['verdict']}**",
        )
        yield "| " + " | ".join(cells) + " |"
    yield ""


def _reasons(results):
    for result in results:
        if result["reason"]:
            yield f"- {result['name'].replace('_', ' ')} {result['verdict']}: {result['reason']}."
    yield ""


def format_number(value, error=None):
    """A number for people, with two digits of its error if it has one."""
    if not error:
        return _with_power(f"{value:.4g}")
    exponent = 0 if value == 0 else math.floor(math.log10(abs(value)))
    if exponent >= 4 or exponent < -3:
        scale = 10.0**exponent
        return f"({format_number(value / scale, error / scale)})·10{str(exponent).translate(_SUPERSCRIPTS)}"
    decimals = max(0, 1 - math.floor(math.log10(error)))
    return f"{value:.{decimals}f} ± {error:.{decimals}f}"


def _with_power(text):
    mantissa, _, exponent = text.partition("e")
    return f"{mantissa}·10{str(int(exponent)).translate(_SUPERSCRIPTS)}" if exponent else mantissa
