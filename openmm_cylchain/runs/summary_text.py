"""The summary of a run as JSON in its directory, and as tables for a terminal."""

import json
import math
from dataclasses import asdict

import openmm

from ..output.files import write_atomically
from ..output.run_tables import MILLISECOND
from ..units.text import format_time, format_with_error
from ..version import __version__
from .stages import stages_of, time_steps_in_words
from .summary import AGREEMENT_FRACTION, AGREEMENT_SIGMA, NOT_COMPARABLE

_STAGES_IN_TABLE, _MOST_STAGES = 4, 12
_EXPLANATIONS = {
    "agrees": f"agrees: within {AGREEMENT_SIGMA:g} standard errors.",
    f"within {100 * AGREEMENT_FRACTION:.0f} %": (
        "within 5 %: a deviation beyond chance, but of the size that a recommended time step may leave; a smaller "
        "step reduces it."
    ),
    "reference": "reference: the continuous chain, to which the discrete one tends for short segments.",
    "differs": "differs: more than 3 standard errors and 5 %. Try a smaller time step.",
}


def write_summary(configuration, directory, groups, linkers=(), measures=(), growth=(), population=None, stages=()):
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
        "simulated time (ms)": stages_of(configuration)[-1].end / MILLISECOND,
        "groups": [asdict(group) for group in groups],
        **({"linkers": [asdict(own) for own in linkers]} if linkers else {}),
        **({"measures": [asdict(own) for own in measures]} if measures else {}),
        **({"growth": [asdict(own) for own in growth]} if growth else {}),
        **({"population": asdict(population)} if population else {}),
        **({"stages": [_of_stage(own) for own in stages]} if stages else {}),
    }
    write_atomically(directory.summary, (json.dumps(content, indent=2, allow_nan=False) + "\n").encode())


def _of_stage(stage):
    # A standard error of NaN is none.
    values = {name: [mean, error if math.isfinite(error) else None] for name, (mean, error) in stage.values.items()}
    return {"name": stage.name, "begin (ms)": stage.begin, "end (ms)": stage.end, "values": values}


def _rounded(value, digits):
    # To significant digits; large numbers without an exponent, as long as they can be read.
    text = f"{value:.{digits}g}"
    return f"{float(text):.0f}" if "e+" in text and abs(value) < 1e9 else text


def format_summary(configuration, groups, linkers=(), measures=(), growth=(), population=None, stages=()):
    """The summary as text for a terminal: what is compared with theory, averages of what is not, and measures."""
    settings = configuration.simulation
    lines = [
        f"{configuration.title or 'Run'}: {format_time(stages_of(configuration)[-1].end)} in steps of "
        f"{time_steps_in_words(stages_of(configuration))}, scheme {settings.scheme}"
    ]
    if stages:
        lines += ["", *_table_of_stages(stages)]
    if measures:
        lines += ["", *_table_of_measures(measures)]
    if linkers:
        lines += [
            "",
            *_linker_table(linkers),
            "  Means over the last half of the run; the largest tension of all of it.",
        ]
    if growth:
        lines += ["", *_growth_table(growth), *_waits(growth), *_states_of_ends(growth)]
    if population:
        lines += ["", *_population(population)]
    compared = [[own for own in group.observables if own.verdict != NOT_COMPARABLE] for group in groups]
    for group, own in zip(groups, compared):
        if len(own) > 1:
            lines += ["", group.label, *_table([(_name(one), one) for one in own])]
    single = [(f"{group.label}: {_name(own[0])}", own[0]) for group, own in zip(groups, compared) if len(own) == 1]
    if single:
        lines += ["", *_table(single)]
    others = [group for group, own in zip(groups, compared) if len(own) < 2 and group.observables]
    if others:
        lines += ["", *_table_of_averages(others)]
    lines += ["", *_notes(groups)]
    verdicts = {observable.verdict for group in groups for observable in group.observables}
    lines += ["", *(text for verdict, text in _EXPLANATIONS.items() if verdict in verdicts)]
    return "\n".join(lines).rstrip()


def _mean_of_stage(value):
    if value is None:
        return "-"
    return _with_error(value[0], value[1] if math.isfinite(value[1]) else None)


def _table_of_stages(stages):
    # Values below each other, stages side by side in tables of a few.
    for begin in range(0, len(stages), _STAGES_IN_TABLE):
        own = stages[begin : begin + _STAGES_IN_TABLE]
        names = list(dict.fromkeys(name for one in own for name in one.values))
        rows = [("", *(one.name for one in own))]
        rows.append(("from (ms)", *(f"{one.begin:.6g}" for one in own)))
        rows += [(name, *(_mean_of_stage(one.values.get(name)) for one in own)) for name in names]
        yield from _aligned(rows, (0,))
        yield ""
        if begin + _STAGES_IN_TABLE >= _MOST_STAGES < len(stages):
            yield f"  {len(stages) - _MOST_STAGES} more stages are in the file of the summary."
            break
    yield "  Means over the last half of each stage; what is compared below is of the last stage."


def _notes(groups):
    # What holds for all filaments is said once.
    owners = {}
    for group in groups:
        for note in group.notes:
            owners.setdefault(note, []).append(group.label)
    for note, labels in owners.items():
        yield f"  {note}" if len(labels) == len(groups) else f"  {'; '.join(labels)}: {note}"


def _table_of_measures(measures):
    rows = [("", "first frame", "last frame", "second half of the run")]
    for own in measures:
        ends = ["" if value is None else _rounded(value, 3) for value in (own.first, own.last)]
        mean = "" if own.mean is None else format_with_error(own.mean, own.standard_error)
        rows.append((own.name + (f" ({own.unit})" if own.unit else ""), *ends, mean))
    return _aligned(rows, (0,))


def _table_of_averages(groups):
    """Of what is not compared, the bends and the distance of the ends."""
    rows = [("", "energy per bend (kT)", "of free ones", "end-to-end distance, root of mean square (nm)")]
    for group in groups:
        found = {own.name: own for own in group.observables}
        bend = next((own for name, own in found.items() if name.startswith("bending energy")), None)
        square = found.get("mean square end-to-end distance")
        cells = ["-"] * 3
        if bend is not None:
            cells[:2] = format_with_error(bend.value, bend.standard_error), _rounded(bend.theory, 3)
        if square is not None and square.value > 0.0:
            root = math.sqrt(square.value)
            cells[2] = format_with_error(root, 0.5 * square.standard_error / root)
        rows.append((group.label, *cells))
    return _aligned(rows, (0,))


def _linker_table(linkers):
    rows = [("linkers", "unbound", "one hand", "both hands", "mean tension (pN)", "largest (pN)")]
    for own in linkers:
        states = [
            "-" if value is None else format_with_error(value, error)
            for value, error in (
                (own.unbound, own.unbound_error),
                (own.one_hand_bound, own.one_hand_bound_error),
                (own.both_hands_bound, own.both_hands_bound_error),
            )
        ]
        tensions = ["-" if force is None else f"{force:.3g}" for force in (own.mean_tension, own.largest_tension)]
        rows.append((own.name, *states, *tensions))
    return _aligned(rows, (0,))


def _growth_table(growth):
    rows = [("ends of filaments that grow", "monomers gained", "lost", "gained per second and end", "of free ends")]
    for own in growth:
        rate = _with_error(own.rate, own.rate_error)
        name = _name_of_ends(own)
        free = "-" if own.rate_of_free_ends is None else _rounded(own.rate_of_free_ends, 3)
        rows.append((name, str(own.gained), str(own.lost), rate, free))
    return _aligned(rows, (0,))


def _name_of_ends(own):
    return f"{own.name}, {own.end} end{'s' * (not own.name.startswith('1 '))}"


def _states_of_ends(growth):
    if not any(own.states for own in growth):
        return
    rows = [("states of ends", "share of the time (%)", "of free ends")]
    for own in growth:
        for state in own.states:
            share, error = (None if one is None else 100.0 * one for one in (state.share, state.share_error))
            free = "-" if state.share_of_free_ends is None else _rounded(100.0 * state.share_of_free_ends, 3)
            rows.append((f"{_name_of_ends(own)}: {state.name}", _with_error(share, error), free))
    yield from ("", *_aligned(rows, (0,)))
    yield "  At the reports of the last half of the run."


def _with_error(value, error):
    if value is None:
        return "-"
    return f"{value:.4g}" if error is None else format_with_error(value, error)


def _population(population):
    rows = [("filaments that come and go", "at once", "of free ones", "mean length (nm)", "of free ones")]
    for own in population.kinds:
        known = "-" if own.number_of_free_ones is None else _rounded(own.number_of_free_ones, 3)
        length = _with_error(own.length, own.length_error)
        free = "-" if own.length_of_free_ones is None else _rounded(own.length_of_free_ones, 3)
        rows.append((own.name, format_with_error(own.number, own.number_error), known, length, free))
    yield from _aligned(rows, (0,))
    yield "  Means over the last half of the run."
    counts = (("began", population.nucleated), ("vanished", population.vanished), ("were cut", population.severed))
    yield f"  In all of it, {', '.join(f'{count} {what}' for what, count in counts)}."
    if population.branches is not None:
        yield f"  At the end, {population.branches} of them hold on to mothers as branches."
    if population.without_place:
        yield (
            f"  {population.without_place} more would have begun or been cut, but there was no place for them: give "
            "a larger count, or reserve, and run again."
        )


def _waits(growth):
    waited = sum(own.waited for own in growth)
    if waited:
        yield (
            f"  {waited} monomers more would have come, but there was no spare node for them: give growth a larger "
            "longest, and run again."
        )


def _name(observable):
    return observable.name + (f" ({observable.unit})" if observable.unit else "")


def _table(observables):
    rows = [("", "average", "standard error", "theory", "deviation", "", "")]
    for name, observable in observables:
        deviation = "-" if observable.deviation is None else f"{observable.deviation:+.1f} sigma"
        relative = observable.relative_deviation
        rows.append(
            (
                name,
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
