"""Fig. 6: how much faster segments of any length are than touching beads, for an actin filament of 1.2 um.

The parts of ``python studies benchmark bead-spring``, with the filament and the steps of the paper. Everything is
timed in turn in one run, so that its ratios carry over to other machines better than its times.
"""

import math
import time

import numpy as np

from benchmark.bead_spring import CONTOUR_LENGTH, bead_stepper
from benchmark.measurement import Case as Timed
from benchmark.measurement import describe_machine, median, ratio, scaled, time_interleaved
from benchmark.systems import REFERENCE
from benchmark.time_step import equilibrium_errors, system_stepper
from benchmark.time_step_systems import BenchmarkSystem, actin
from openmm_cylchain.time_steps.recommended_step import recommended_time_step

from . import style
from .case import Case, Outcome
from .page import format_number
from .result import Estimate, LowerBound, Result, Rule, printed
from .table_2 import ACTIN, SOLVENT_TEMPERATURE, SOLVENT_VISCOSITY
from .tables import LENGTHS, speed_up

_BEADS = 201
_STEP_PICOSECONDS = 10.0
_FILAMENTS = (1, 64)
_LENGTHS = {True: (10, 40, 150, 600, 1200), False: tuple(length for length in LENGTHS if length <= CONTOUR_LENGTH)}
_REPETITIONS = {True: 6, False: 15}
_SECONDS = 0.04
_CURVES = ("equal", "own", "implicit")
_SAMPLED_SEGMENTS = 40000
_NANOSECONDS = 1e9

_STATED = ((10, 1, False), (1200, 10, True), (1200, 2000, True))
"""Lengths in nm, speed-ups, and whether they are "more than"."""

_MORE_THAN = LowerBound(3.0)
_AS_FAST_RULE = Rule(3.0, 0.1)
_SAME_RULE = Rule(3.0, 0.05, 0.2)
_ENERGY_RULE = Rule(3.0, 0.05, 0.03)


def segments_of(length):
    """How many segments of a length in nm the filament has."""
    return round(CONTOUR_LENGTH / length)


def steps_of_segments(length):
    """The step of each curve, in ps, for segments of a length in nm."""
    recommended = recommended_time_step(
        actin(float(length)), SOLVENT_VISCOSITY, SOLVENT_TEMPERATURE, "implicit", segments_of(length)
    )
    steps = (_STEP_PICOSECONDS, _STEP_PICOSECONDS * speed_up(length), recommended.step)
    return dict(zip(_CURVES, steps))


def timed_filaments(filaments, lengths, steps, bead_step, repetitions, seconds):
    """Time filaments of beads and of segments in turn, on one thread.

    Parameters
    ----------
    filaments : int
        Of each kind.
    lengths : list of int
        Of segments, in nm.
    steps : dict of str to list of float
        In ps, by curve, for each length.
    bead_step : float
        In ps.
    repetitions : int
    seconds : float
        Of each kind in a repetition.

    Returns
    -------
    dict
        Processor seconds for a step of all filaments: ``beads`` (repetitions,), and each curve (lengths, repetitions).
        ``processor``, a str.
    """
    beads = bead_stepper(filaments, bead_step, ACTIN.segment_stiffness * ACTIN.diameter, REFERENCE)
    cases = [Timed("beads", beads)]
    for curve in _CURVES:
        scheme = "implicit" if curve == "implicit" else "euler"
        for length, step in zip(lengths, steps[curve]):
            system = _system(scheme, length, filaments)
            cases.append(Timed(f"{curve} {length}", system_stepper(system, scheme, step, REFERENCE)))
    times = time_interleaved(cases, repetitions, seconds, clock=time.process_time)
    by_curve = {curve: [times[f"{curve} {length}"] for length in lengths] for curve in _CURVES}
    return {"processor": describe_machine()["processor"], "beads": times["beads"], **by_curve}


def energies_of_filaments(filaments, lengths, steps, sampled_segments):
    """Mean energies over the exact ones with steps of scheme "implicit", one in ps for each length in nm.

    Returns
    -------
    dict of arrays
        ``energy`` and ``error`` of each length and potential; a filament of one segment has no bending energy.
    """
    values = []
    for length, step in zip(lengths, steps):
        frames = max(20, math.ceil(sampled_segments / (filaments * segments_of(length))))
        errors = equilibrium_errors(_system("implicit", length, filaments), "implicit", step, frames)
        values += [errors[name] for name in ("stretching energy", "bending energy") if name in errors]
    return {"energy": [1.0 + each.value for each in values], "error": [each.error for each in values]}


def _system(scheme, length, filaments):
    # Explicit schemes need the soft segments and the long extension time of the paper; "implicit" needs neither.
    kind = actin(float(length)) if scheme == "implicit" else ACTIN.with_segment_length(float(length))
    count = segments_of(length)
    label = f"{count} segments of {length} nm"
    return BenchmarkSystem(label, label, kind, count, filaments, SOLVENT_TEMPERATURE, SOLVENT_VISCOSITY)


class _Speeds:
    """What the times of ``timed_filaments`` say about a number of filaments."""

    def __init__(self, filaments, lengths, steps, times):
        self.filaments, self.lengths, self._steps, self._times = filaments, lengths, steps, times

    def steps_per_second(self, curve):
        """Those of segments over those of beads, for each length."""
        return [ratio(self._times["beads"], times) for times in self._times[curve]]

    def simulated_time(self, curve):
        """That of segments in a second over that of beads, for each length."""
        factors = [step / _STEP_PICOSECONDS for step in self._steps[curve]]
        return [scaled(speed, factor) for speed, factor in zip(self.steps_per_second(curve), factors)]

    def cost_of_longer_steps(self):
        """The time of a step at the segments' own bounds over that at equal steps: the mean over lengths."""
        logarithms = {curve: np.log(self._times[curve]).mean(axis=0) for curve in ("own", "equal")}
        return ratio(np.exp(logarithms["own"]), np.exp(logarithms["equal"]))

    def element_nanoseconds(self):
        """The time of an explicit step of a bead, and of a segment of the shortest."""
        elements = (_BEADS, segments_of(self.lengths[0]))
        times = (self._times["beads"], self._times["equal"][0])
        return [_NANOSECONDS * median(each).value / (self.filaments * count) for each, count in zip(times, elements)]


def _results(speeds):
    suffix = "" if speeds.filaments == 1 else f"_{speeds.filaments}_filaments"
    equal = speeds.steps_per_second("equal")
    return [
        Result(f"speed_of_1_segment_over_beads{suffix}", "1", equal[-1], _MORE_THAN, None, printed("10")),
        Result(
            f"speed_of_120_segments_over_beads{suffix}", "1", equal[0], _AS_FAST_RULE, None, printed("1"),
            _cause(speeds, equal[0]),
        ),
        Result(
            f"largest_speed_up_at_own_bounds{suffix}", "1", _largest(speeds.simulated_time("own")), _MORE_THAN, None,
            printed("2000"),
        ),
        Result(f"cost_of_a_step_at_own_bounds{suffix}", "1", speeds.cost_of_longer_steps(), _SAME_RULE, 1.0),
        Result(
            f"smallest_speed_up_of_scheme_implicit{suffix}", "1", _smallest(speeds.simulated_time("implicit")),
            _MORE_THAN, None, printed("2000"),
        ),
    ]  # fmt: skip


def _cause(speeds, ours):
    """Why ours is not as fast as beads, if it is because it is faster."""
    bead, segment = speeds.element_nanoseconds()
    if ours.value <= 1.0 or segment >= bead:
        return ""
    return (
        f"a segment takes {segment:.0f} ns for a step here and a bead {bead:.0f} ns, where the paper's code, which "
        f"moves both, takes {_BEADS / segments_of(speeds.lengths[0]):.1f} times as long for a segment as for a bead"
    )


def _largest(estimates):
    return max(estimates, key=lambda each: each.value)


def _smallest(estimates):
    return min(estimates, key=lambda each: each.value)


def _worst_energy(data):
    worst = np.argmax(np.abs(data["energy"] - 1.0))
    ours = Estimate(float(data["energy"][worst]), float(data["error"][worst]))
    return Result("worst_energy_over_exact_of_scheme_implicit", "1", ours, _ENERGY_RULE, 1.0)


def evaluate(records, quick):
    """Fig. 6: explicit steps that are equal, and as long as the bounds of each allow; steps of scheme implicit."""
    lengths = _LENGTHS[quick]
    each = [steps_of_segments(length) for length in lengths]
    steps = {curve: [one[curve] for one in each] for curve in _CURVES}
    timing = {"repetitions": _REPETITIONS[quick], "seconds": _SECONDS, "bead_step": _STEP_PICOSECONDS}
    measured, processor = [], ""
    for filaments in _FILAMENTS:
        name = f"figure-06-filaments-{filaments}"
        times = records.measure(name, timed_filaments, filaments=filaments, lengths=lengths, steps=steps, **timing)
        processor = str(times["processor"])
        measured.append(_Speeds(filaments, lengths, steps, times))
    energies = records.measure(
        "figure-06-energies",
        energies_of_filaments,
        filaments=_FILAMENTS[-1],
        lengths=lengths,
        steps=steps["implicit"],
        sampled_segments=_SAMPLED_SEGMENTS,
    )
    results = [result for speeds in measured for result in _results(speeds)] + [_worst_energy(energies)]
    title = "Speed-up against segment length"
    return Outcome(results, {title: lambda figure: _draw(figure, measured)}, _remarks(measured, processor))


def _remarks(measured, processor):
    one, many = measured
    explicit, implicit = one.simulated_time("own"), one.simulated_time("implicit")
    gains = [after.value / before.value for before, after in zip(explicit, implicit)]
    smallest, largest, rod = (format_number(gain, digits=2) for gain in (min(gains[:-1]), max(gains[:-1]), gains[-1]))
    alone, together = (speeds.element_nanoseconds()[1] for speeds in measured)
    step = f"{_STEP_PICOSECONDS:g} ps"
    return (
        f"Processor time of one thread, measured in turn on a processor named {processor}; times depend on the "
        f"machine, their ratios less. Beads are moved by OpenMM's `BrownianIntegrator` on the Reference platform, the "
        f"fastest for one filament, with {step} and bonds of 48.7 pN/nm as in the paper. Explicit steps at their own "
        f"bounds are the same share of them as {step} for beads. A single filament, as in the paper, fills one of the "
        f"eight lanes in which the compiled engine moves filaments; {many.filaments} fill all, and a segment of "
        f"{many.lengths[0]} nm takes {together:.0f} instead of {alone:.0f} ns. Scheme implicit, here with segments as "
        f"stiff as actin and no artificial extension time, advances {smallest} to {largest} times as far in a second "
        f"as the explicit scheme with these steps; a single segment, which cannot bend, {rod} times."
    )


def _draw(figure, measured):
    axis = figure.subplots()
    one, many = measured
    labels = {
        "implicit": "implicit, recommended step",
        "own": "explicit, each at its own bound",
        "equal": f"explicit, {_STEP_PICOSECONDS:g} ps for all",
    }
    for (curve, label), colour, marker in zip(labels.items(), style.COLOURS, "^so"):
        _plot(axis, many, curve, colour, marker=marker, linestyle=":", markerfacecolor="white")
        _plot(axis, one, curve, colour, marker=marker, linestyle="-", label=label)
    axis.plot([], [], ":o", color="gray", markersize=4, markerfacecolor="white", label=f"{many.filaments} filaments")
    lengths = np.array(LENGTHS[:-1], dtype=float)
    elements = f"{_BEADS} beads over segments"
    axis.plot(lengths, _BEADS * lengths / CONTOUR_LENGTH, color=style.THEORY, linewidth=0.8, label=elements)
    for length, value, lower_bound in _STATED:
        label = None if lower_bound else "stated in the paper"
        axis.plot(length, value, "*", color=style.PAPER, markersize=10, zorder=5, label=label)
        if lower_bound:
            arrow = {"arrowstyle": "->", "color": style.PAPER, "shrinkA": 0, "shrinkB": 0}
            axis.annotate("", (length, 8 * value), (length, value), arrowprops=arrow, zorder=5)
    scales = {"xscale": "log", "yscale": "log", "xlim": (8, 1500), "ylim": (0.3, 1e14)}
    style.finish(axis, r"segment length $\ell_0$ (nm)", "simulated time over that of touching beads", **scales)


def _plot(axis, speeds, curve, colour, **settings):
    estimates = speeds.simulated_time(curve)
    values, errors = [each.value for each in estimates], [each.error for each in estimates]
    axis.plot(speeds.lengths, values, color=colour, markersize=4, linewidth=1, **settings)
    axis.errorbar(speeds.lengths, values, errors, fmt="none", ecolor=colour, elinewidth=1, capsize=2)


CASES = (Case("figure-06", "Fig. 6: speed against segment length and beside touching beads", (6,), evaluate),)
