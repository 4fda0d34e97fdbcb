"""Tables I and IV: the largest steps in ps, and how much time one thread simulates in an hour.

Scheme "modes" takes the steps of the paper, scheme "implicit" those that the same rule allows, timed in turn.
"""

import time

import numpy as np

from benchmark.measurement import Case as Timed
from benchmark.measurement import describe_machine, median, ratio, scaled, time_interleaved
from openmm_cylchain.time_steps.recommended_step import recommended_time_step

from . import base_pairs, style
from .base_pairs import BASE_PAIRS, LARGEST_STEPS, PRINTED_UNIT, TEMPERATURE
from .case import Case, Outcome
from .largest_steps import IMPLICIT_STEPS
from .page import format_number
from .result import ROUNDING, Estimate, LowerBound, Result, printed

_TABLE_1 = {63: "1.59", 127: "7.96", 255: "15.9", 511: "15.9"}
_TABLE_4 = {63: "0.23", 127: "0.56", 255: "0.56", 511: "0.25"}
_ABSTRACT = "0.26"
"""ms of 512 base pairs in an hour."""
_COPIES = (1, 16)
_BONDS = {True: (63, 255), False: (63, 127, 255, 511)}
_REPETITIONS = {True: 5, False: 15}
_SECONDS = {True: 0.03, False: 0.1}
_HOUR = 3600.0
_PICOSECONDS = 1e-9
"""In ms."""
_FASTER = LowerBound(3.0)
_SHORTEST_FOR_IMPLICIT = 255
"""Bonds; of shorter chains the rule looks at lags of a few steps of scheme modes."""
_CURVES = ("modes", "implicit", "recommended")


def timed_chains(bonds, copies, steps, repetitions, seconds):
    """Time chains of several lengths in several schemes in turn, on one thread.

    Parameters
    ----------
    bonds : list of int
    copies : int
    steps : dict of str to list of float
        In tau, of the curves, for each length.
    repetitions : int
    seconds : float
        Of each in a repetition.

    Returns
    -------
    dict
        Processor seconds for a step of one chain: every curve (lengths, repetitions). ``processor``, a str.
    """
    cases = []
    for number, count in enumerate(bonds):
        positions = base_pairs.drawn_positions(base_pairs.SIMULATED, count, copies, seed=7)
        for curve, each in steps.items():
            scheme = "modes" if curve == "modes" else "implicit"
            context = base_pairs.start(scheme, each[number], positions, 7, platform="Reference")
            cases.append(Timed(f"{curve} {count}", _Steps(context)))
    times = time_interleaved(cases, repetitions, seconds, clock=time.process_time)
    by_curve = {curve: [times[f"{curve} {count}"] / copies for count in bonds] for curve in steps}
    return {"processor": describe_machine()["processor"], **by_curve}


class _Steps:
    """Takes steps in a Context, which it keeps."""

    def __init__(self, context):
        self._context = context

    def __call__(self, steps):
        self._context.getIntegrator().step(steps)


def milliseconds_per_hour(step, seconds):
    """Simulated time in ms of steps in tau that take so many seconds: an Estimate."""
    estimate = median(seconds)
    value = _HOUR / estimate.value * step * BASE_PAIRS.time_unit * _PICOSECONDS
    return Estimate(value, value * estimate.error / estimate.value)


def evaluate(records, quick):
    """Tables I and IV."""
    results = list(_steps_in_picoseconds())
    bonds = _BONDS[quick]
    steps = {
        "modes": [LARGEST_STEPS[count] for count in bonds],
        "implicit": [IMPLICIT_STEPS[count] for count in bonds],
        "recommended": [_recommended_step(count) for count in bonds],
    }
    speeds, gains, processor = {}, {}, ""
    for copies in _COPIES:
        times = records.measure(
            f"table-04-{copies}-chains", timed_chains, bonds=list(bonds), copies=copies, steps=steps,
            repetitions=_REPETITIONS[quick], seconds=_SECONDS[quick],
        )  # fmt: skip
        processor = str(times["processor"])
        suffix = f"_of_{copies}_chains" if copies > 1 else ""
        for number, count in enumerate(bonds):
            paper = printed(_TABLE_4[count])
            for curve in _CURVES:
                speed = milliseconds_per_hour(steps[curve][number], times[curve][number])
                speeds[copies, curve, count] = speed
                if curve == "recommended" or (curve == "implicit" and count < _SHORTEST_FOR_IMPLICIT):
                    continue
                name = f"ms_in_an_hour_{curve}_{count + 1}_base_pairs{suffix}"
                results.append(Result(name, "ms", speed, _FASTER, paper=paper))
            longer = steps["implicit"][number] / steps["modes"][number]
            gains[copies, count] = scaled(ratio(times["modes"][number], times["implicit"][number]), longer)
    for count in bonds:
        if count >= _SHORTEST_FOR_IMPLICIT:
            name = f"implicit_over_modes_{count + 1}_base_pairs_of_{_COPIES[-1]}_chains"
            results.append(Result(name, "1", gains[_COPIES[-1], count], _FASTER, 1.0))

    def draw(figure):
        axis = figure.subplots()
        pairs = np.array(bonds) + 1
        labels = {
            "modes": "scheme modes, steps of the paper",
            "implicit": "scheme implicit, by the rule of the paper",
            "recommended": "scheme implicit, recommended steps",
        }
        for (curve, label), colour, marker in zip(labels.items(), style.COLOURS, "os^"):
            for copies, line in zip(_COPIES, ("-", ":")):
                values = [speeds[copies, curve, count].value for count in bonds]
                name = f"ours, {label}" if copies == 1 else None
                axis.plot(pairs, values, line, marker=marker, markersize=4, color=colour, label=name)
        axis.plot([], [], ":", color="gray", label=f"ours, {_COPIES[-1]} chains, each")
        values = [float(_TABLE_4[count]) for count in bonds]
        axis.plot(pairs, values, "*", color=style.PAPER, markersize=10, label="paper, Table IV")
        # Room for the legend above the lines.
        limits = (None, 100.0 * max(speed.value for speed in speeds.values()))
        style.finish(axis, "base pairs", "simulated time in an hour (ms)", xscale="log", yscale="log", ylim=limits)

    return Outcome(results, {"Simulated time in an hour, one thread": draw}, _remarks(bonds, speeds, gains, processor))


def _recommended_step(bonds):
    """Of scheme "implicit", in tau; the viscosity has no part in it."""
    step = recommended_time_step(BASE_PAIRS, 1.0, TEMPERATURE, "implicit", bonds).step
    return round(step / BASE_PAIRS.time_unit, 3)


def _steps_in_picoseconds():
    # With the 52.0 ps of (71), which is judged with the units of time.
    for count, text in _TABLE_1.items():
        ours = Estimate(LARGEST_STEPS[count] * PRINTED_UNIT, None)
        yield Result(f"largest_step_{count + 1}_base_pairs_with_52.0_ps", "ps", ours, ROUNDING, paper=printed(text))
    name, ours = "ms_in_an_hour_512_base_pairs_table_4_against_abstract", Estimate(float(_TABLE_4[511]), None)
    cause = "the abstract has 0.26 ms where Table IV has 0.25 ms"
    yield Result(name, "ms", ours, ROUNDING, paper=printed(_ABSTRACT), cause=cause)


def _remarks(bonds, speeds, gains, processor):
    def listed(curve, copies):
        numbers = [f"{count + 1}: {format_number(speeds[copies, curve, count].value, digits=2)}" for count in bonds]
        return ", ".join(numbers)

    alone, together = _COPIES
    ratios = ", ".join(f"{count + 1}: {format_number(gains[together, count].value, digits=2)}" for count in bonds)
    return (
        f"Processor time of one thread, measured in turn on a processor named {processor}; times depend on the "
        "machine, their ratios less. One chain fills one of the lanes in which the compiled engine moves chains, "
        f"{together} fill them. The rule of the paper allows scheme implicit a fifth of the shortest lag at which it "
        "looks (Fig. 3), which at small N are only some steps of scheme modes: it then simulates "
        f"{ratios} times as much time as scheme modes (base pairs: ratio, {together} chains), one chain alone "
        f"{listed('implicit', alone)} ms. At its recommended "
        "steps, at which equilibrium is right and dynamics from ten steps on, it simulates, in ms in an hour for each "
        "chain, "
        f"{listed('recommended', together)} (one chain alone {listed('recommended', alone)}), scheme modes "
        f"{listed('modes', together)}; the paper has 0.23 to 0.56."
    )


CASES = (Case("table-01-04", "Tables I and IV: largest steps and simulated time", (), evaluate),)
