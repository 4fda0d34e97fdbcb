"""Figs. 7 and 8: rotational and translational diffusion of free segments.

Fig. 7 of the paper holds the centres of the segments. Here one simulation serves both figures, since a free segment
turns alike wherever it is.
"""

import numpy as np

from openmm_cylchain.analysis.statistics import fit_relaxation_time
from openmm_cylchain.mechanics.friction import rotational_relaxation_time
from openmm_cylchain.theory import (
    free_segment_mean_square_displacement,
    long_time_mean_square_displacement,
    mean_orientation,
    short_time_mean_square_displacement,
)

from . import simulation, style
from .case import Case, Outcome
from .result import Estimate, Result, Rule, printed
from .table_2 import MICROSECOND, MILLISECOND, SOLVENT_TEMPERATURE, actin_friction

_PRINTED_SEGMENTS = 728
_STEP_MICROSECONDS = 10.0
_STEPS = 1500
_GROUPS = 40
_COMPARED_MILLISECONDS = (0.05, 2.5, 15.0)
_ORIENTATION_RULE = Rule(3.0, 0.005, 0.015)
_DISPLACEMENT_RULE = Rule(3.0, 0.01, 0.03)


def free_segments(segments, step_microseconds, steps, groups, seed):
    """Segments that start at the origin along x, after each of the given numbers of steps.

    Returns
    -------
    dict of arrays
        ``time`` in ps; means over groups of segments, (times, groups): ``orientation_x``, ``orientation_y``,
        ``orientation_x_square``, ``orientation_y_square``, and, of the centres in nm^2, ``displacement_x_square`` and
        ``displacement_y_square``, the mean over y and z.
    """
    filaments = simulation.solvent()
    length = simulation.ACTIN.segment_length
    for _ in range(segments):
        filaments.add_straight(simulation.ACTIN, 1, [-0.5 * length, 0, 0], [1, 0, 0])
    context = simulation.start(filaments, step_microseconds * MICROSECOND, seed)
    rows = []
    for nodes in simulation.frames(context, segments, steps):
        centre = nodes.mean(axis=1)
        orientation = nodes[:, 1] - nodes[:, 0]
        orientation /= np.linalg.norm(orientation, axis=1)[:, None]
        across = 0.5 * (centre[:, 1] ** 2 + centre[:, 2] ** 2)
        values = (*orientation[:, :2].T, *(orientation[:, :2] ** 2).T, centre[:, 0] ** 2, across)
        rows.append([simulation.groups(value, groups) for value in values])
    names = ("orientation_x", "orientation_y", "orientation_x_square", "orientation_y_square")
    names += ("displacement_x_square", "displacement_y_square")
    columns = dict(zip(names, np.transpose(rows, (1, 0, 2))))
    return {"time": np.array(steps) * step_microseconds * MICROSECOND, **columns}


def _measured(records, quick):
    logarithmic = np.unique(np.geomspace(1, _STEPS, 24).round().astype(int))
    compared = [round(1e3 * time / _STEP_MICROSECONDS) for time in _COMPARED_MILLISECONDS]
    steps = sorted({0, *range(0, _STEPS + 1, 25), *logarithmic.tolist(), *compared})
    factor = 8 if quick else 32
    return records.measure(
        "figure-07-08",
        free_segments,
        segments=factor * _PRINTED_SEGMENTS,
        step_microseconds=_STEP_MICROSECONDS,
        steps=steps,
        groups=_GROUPS,
        seed=7,
    )


def evaluate_orientation(records, quick):
    """Fig. 7: the rotational relaxation time, and the spread of orientations in the end."""
    data = _measured(records, quick)
    friction = actin_friction()
    tau = rotational_relaxation_time(friction, SOLVENT_TEMPERATURE) / MILLISECOND
    time = data["time"] / MILLISECOND
    fit = fit_relaxation_time(data["time"], data["orientation_x"], amplitude=1.0, blocks=_GROUPS)
    ours = Estimate(fit.time / MILLISECOND, fit.standard_error / MILLISECOND)
    results = [Result("rotational_relaxation_time", "ms", ours, _ORIENTATION_RULE, tau, printed("2.685", "0.028"))]
    square = np.exp(-3 * time / tau)
    variance = {"x": 1 / 3 + 2 / 3 * square - np.exp(-2 * time / tau), "y": 1 / 3 - 1 / 3 * square}
    spread = {}
    for axis, theory in variance.items():
        copies = np.stack([data[f"orientation_{axis}"], data[f"orientation_{axis}_square"]])
        spread[axis] = np.sqrt(np.maximum(0.0, copies[1].mean(axis=-1) - copies[0].mean(axis=-1) ** 2))
        ours = simulation.jackknife(lambda moments: np.sqrt(moments[1] - moments[0] ** 2), copies[:, -1])
        name = f"orientation_standard_deviation_{axis}_at_15_ms"
        results.append(Result(name, "1", ours, _ORIENTATION_RULE, float(np.sqrt(theory[-1]))))

    def draw(figure):
        axis = figure.subplots()
        for name, marker, colour in (("x", "o", style.OURS), ("y", "s", style.COLOURS[1])):
            mean = simulation.mean(data[f"orientation_{name}"])
            label = rf"ours, $\langle t_{name}\rangle$"
            axis.errorbar(time, mean.value, mean.error, fmt=marker, markersize=3, color=colour, label=label)
        for name, marker, colour in (("x", "^", style.COLOURS[2]), ("y", "v", style.COLOURS[3])):
            label = rf"ours, $\sigma(t_{name})$"
            axis.plot(time, spread[name], marker, markersize=3, color=colour, label=label)
            axis.plot(time, np.sqrt(variance[name]), color=style.THEORY, linewidth=0.8)
        theory = mean_orientation(data["time"], friction, SOLVENT_TEMPERATURE)
        axis.plot(time, theory, color=style.THEORY, linewidth=0.8, label="eq. (29); exact spread")
        axis.plot(time, np.exp(-time / 2.685), "--", color=style.PAPER, label="fit of the paper")
        axis.axhline(1 / np.sqrt(3), color="gray", linewidth=0.8, linestyle=":", label=r"$1/\sqrt{3}$")
        style.finish(axis, "time (ms)", "mean and standard deviation of orientation", xlim=(0, time[-1]))

    return Outcome(results, {"Rotational diffusion of free segments": draw})


def evaluate_displacement(records, quick):
    """Fig. 8: mean square displacements along and across the initial axis, against (30), (31) and (32)."""
    data = _measured(records, quick)
    friction = actin_friction()
    theory = dict(zip("xy", free_segment_mean_square_displacement(data["time"], friction, SOLVENT_TEMPERATURE)))
    time = data["time"] / MILLISECOND
    results = []
    for axis, label in (("x", "parallel"), ("y", "perpendicular")):
        for moment in _COMPARED_MILLISECONDS:
            index = int(np.argmin(np.abs(time - moment)))
            ours = simulation.mean(data[f"displacement_{axis}_square"][index])
            name = f"displacement_{label}_at_{moment:g}_ms"
            results.append(Result(name, "nm^2", ours, _DISPLACEMENT_RULE, float(theory[axis][index])))

    def draw(figure):
        upper, lower = figure.subplots(2, sharex=True, height_ratios=(3, 2))
        later = slice(1, None)
        times = time[later]
        short = dict(zip("xy", short_time_mean_square_displacement(data["time"], friction, SOLVENT_TEMPERATURE)))
        late = long_time_mean_square_displacement(data["time"], friction, SOLVENT_TEMPERATURE)[later]
        for axis, unit in ((upper, 1e6), (lower, late)):
            for name, label, colour in (("x", "parallel", style.COLOURS[0]), ("y", "perpendicular", style.COLOURS[1])):
                mean = simulation.mean(data[f"displacement_{name}_square"][later])
                line = {"color": colour, "linewidth": 1}
                bars = {"fmt": "o", "markersize": 3, "color": colour, "label": f"ours, {label}"}
                axis.errorbar(times, mean.value / unit, mean.error / unit, **bars)
                axis.plot(times, theory[name][later] / unit, **line, label=f"eq. (32), {label}")
                axis.plot(times, short[name][later] / unit, ":", **line, label=f"eq. (30), {label}")
            axis.plot(times, late / unit, "--", color=style.THEORY, linewidth=1, label="eq. (31)")
        style.finish(upper, "", "mean square displacement (µm²)", xscale="log", yscale="log")
        style.finish(lower, "time (ms)", "over eq. (31)", legend=False, xscale="log")

    return Outcome(results, {"Mean square displacement of free segments": draw})


CASES = (
    Case("figure-07", "Fig. 7: rotational diffusion of free segments", (7,), evaluate_orientation),
    Case("figure-08", "Fig. 8: mean square displacement of free segments", (8,), evaluate_displacement),
)
