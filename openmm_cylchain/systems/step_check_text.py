"""The check of a step as text for people."""

import math
from typing import Any

from ..units.text import format_time
from .step_check_observables import STEPS_PER_FRAME
from .step_check_rule import DIVERGED, diverged, sigmas, surely_large

_RELAXATIONS = 5.0


def format_check(check: Any) -> str:
    """A StepCheck as a table in ASCII, with its verdict below."""
    times = [format_time(step, 3) for step in check.steps]
    window = check.frames * STEPS_PER_FRAME * check.step
    simulated = check.windows * window
    path = "the same Brownian path" if check.paired else "independent paths: the portable engine has no common one"
    lines = [
        f"{' against '.join(times)} on {path}; scheme {check.scheme}",
        f"{format_time(simulated, 3)} simulated in {check.seconds:.3g} s, in {check.windows} windows of "
        f"{format_time(window, 3)}, each from one start; changes and displacements are those in "
        f"{format_time(STEPS_PER_FRAME * check.step, 3)}; +- one standard error",
        "",
    ]
    if check.observables:
        lines += [*_table(check, times), ""]
    lines += _notes(check, window)
    lines.append(check.explanation())
    return "\n".join(lines)


def _table(check, times):
    header = ["average", "", *times, "error of the step", "exact", "off exact", "verdict"]
    rows = [header, *(_table_row(one) for one in check.observables)]
    if all(one.exact is None for one in check.observables):
        rows = [row[:-3] + row[-1:] for row in rows]
    widths = [max(map(len, column)) for column in zip(*rows)]
    left = (0, 1, len(widths) - 1)
    for row in rows:
        cells = [
            text.ljust(width) if column in left else text.rjust(width)
            for column, (text, width) in enumerate(zip(row, widths))
        ]
        yield "  ".join(cells).rstrip()


def _notes(check, window):
    if check.divided[0] > 0.0:
        yield f"{percent(check.divided[0])} of the steps of filaments were divided."
    if check.failure is None and window < _RELAXATIONS * check.relaxation:
        yield (
            f"The slowest bends relax in {format_time(check.relaxation, 3)}: what a longer run would show of them is "
            "not seen."
        )
    if check.strained:
        yield (
            f"The start is strained ({', '.join(check.strained)}): what grows from it is not looked at. Begin with "
            "positions that have come to rest for that."
        )
    off = [
        one.name
        for one in check.observables
        if one.exact is not None
        and not one.judged_by_exact
        and surely_large(one.deviation, sigmas(one.degrees) * one.deviation_standard_error)
    ]
    if off:
        yield (
            f"Off their exact values are {', '.join(off)}: filaments did not begin in equilibrium, or any step of this "
            "scheme is wrong."
        )


def _table_row(one):
    exact = "" if one.exact is None else f"{one.exact:.4g}"
    off = ""
    if one.deviation is not None:
        known = math.isfinite(one.deviation_standard_error)
        error = f" +- {100.0 * one.deviation_standard_error:.1f}" if known else ""
        off = f"{100.0 * one.deviation:+.1f}{error} %"
    return [
        one.name,
        one.unit,
        *(f"{value:.4g}" for value in one.values),
        percent(one.error, "+")
        if diverged(one.error)
        else f"{100.0 * one.error:+.2f} +- {100.0 * one.standard_error:.2f} %",
        exact,
        off,
        one.explanation(),
    ]


def percent(share: float, sign: str = "") -> str:
    """A share in percent, with two digits."""
    digits = ".2g" if abs(share) < 0.995 else ".0f" if abs(share) < DIVERGED else ".1e"
    return f"{100.0 * share:{sign}{digits}} %"


def two_digits(seconds: float) -> str:
    """A number with two digits, such as 2400."""
    return f"{float(f'{seconds:.2g}'):.6g}"
