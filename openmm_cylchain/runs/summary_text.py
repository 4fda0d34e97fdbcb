"""The summary of a run as JSON in its directory, and as tables for a terminal."""

import json
from dataclasses import asdict

import openmm

from ..output.files import write_atomically
from ..output.run_tables import MILLISECOND
from ..units.text import format_time, format_with_error
from ..version import __version__
from .summary import AGREEMENT_FRACTION, AGREEMENT_SIGMA

_EXPLANATIONS = {
    "agrees": f"agrees: within {AGREEMENT_SIGMA:g} standard errors.",
    f"within {100 * AGREEMENT_FRACTION:.0f} %": (
        "within 5 %: a deviation beyond chance, but of the size that a recommended time step may leave; a smaller "
        "step reduces it."
    ),
    "reference": "reference: the continuous chain, to which the discrete one tends for short segments.",
    "differs": "differs: more than 3 standard errors and 5 %. Try a smaller time step.",
}


def write_summary(configuration, directory, groups, linkers=()):
    """Write the summary as JSON into the directory of the run."""
    settings = configuration.simulation
    content = {
        "title": configuration.title,
        "openmm_cylchain": __version__,
        "openmm": openmm.Platform.getOpenMMVersion(),
        "platform": settings.platform,
        "scheme": settings.scheme,
        "temperature (K)": configuration.solvent.temperature,
        "time step (ms)": settings.time_step / MILLISECOND,
        "simulated time (ms)": settings.steps * settings.time_step / MILLISECOND,
        "groups": [asdict(group) for group in groups],
        **({"linkers": [asdict(own) for own in linkers]} if linkers else {}),
    }
    write_atomically(directory.summary, (json.dumps(content, indent=2, allow_nan=False) + "\n").encode())


def _rounded(value, digits):
    # To significant digits; large numbers without an exponent, as long as they can be read.
    text = f"{value:.{digits}g}"
    return f"{float(text):.0f}" if "e+" in text and abs(value) < 1e9 else text


def format_summary(configuration, groups, linkers=()):
    """The summary as text for a terminal."""
    settings = configuration.simulation
    lines = [
        f"{configuration.title or 'Run'}: {format_time(settings.steps * settings.time_step)} in steps of "
        f"{format_time(settings.time_step)}, scheme {settings.scheme}"
    ]
    for group in groups:
        lines += ["", group.label, *_table(group.observables), *(f"  {note}" for note in group.notes)]
    if linkers:
        lines += [
            "",
            *_linker_table(linkers),
            "  Means over the last half of the run; the largest tension of all of it.",
        ]
    verdicts = {observable.verdict for group in groups for observable in group.observables}
    lines += ["", *(text for verdict, text in _EXPLANATIONS.items() if verdict in verdicts)]
    return "\n".join(lines).rstrip()


def _linker_table(linkers):
    rows = [("linkers", "unbound", "one hand", "both hands", "mean tension (pN)", "largest (pN)")]
    for own in linkers:
        states = [
            format_with_error(getattr(own, state), getattr(own, f"{state}_error"))
            for state in ("unbound", "one_hand_bound", "both_hands_bound")
        ]
        tensions = ["-" if force is None else f"{force:.3g}" for force in (own.mean_tension, own.largest_tension)]
        rows.append((own.name, *states, *tensions))
    return _aligned(rows, (0,))


def _table(observables):
    rows = [("", "average", "standard error", "theory", "deviation", "", "")]
    for observable in observables:
        deviation = "-" if observable.deviation is None else f"{observable.deviation:+.1f} sigma"
        relative = observable.relative_deviation
        if observable.verdict == "not comparable":
            deviation, relative = "-", None
        rows.append(
            (
                observable.name + (f" ({observable.unit})" if observable.unit else ""),
                _rounded(observable.value, 6),
                _rounded(observable.standard_error, 2),
                _rounded(observable.theory, 6),
                deviation,
                "" if relative is None else f"{100 * relative:+.2g} %",
                observable.verdict,
            )
        )
    return _aligned(rows, (0, len(rows[0]) - 1))


def _aligned(rows, left):
    widths = [max(len(row[column]) for row in rows) for column in range(len(rows[0]))]
    return [
        "  ".join(
            ["", *(cell.ljust(widths[i]) if i in left else cell.rjust(widths[i]) for i, cell in enumerate(row))]
        ).rstrip()
        for row in rows
    ]
