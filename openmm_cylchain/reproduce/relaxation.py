"""Figs. 15 to 17: relaxation of straight filaments whose first node is trapped.

Nine decades of time are covered with four time steps; each begins at the start, and where two of them cover the same
time they must agree. They do for relaxation times of a segment's length of 0.01 and 0.1 us. From 1 us on they do not:
steps of 1 us then miss most of the elastic energy at 10 us, so the larger times of Figs. 17 and 18 are left out.
"""

from dataclasses import replace

import numpy as np

from ..theory import bending_energy_mean, stretching_energy_mean
from . import simulation, style
from .case import Case, Outcome
from .result import Estimate, Result, Rule, printed
from .table_2 import ACTIN, MICROSECOND, SOLVENT_TEMPERATURE, THERMAL_ENERGY

_SEGMENTS = 64
_CONTOUR = _SEGMENTS * ACTIN.segment_length
_STEP_MICROSECONDS = (1e-4, 1e-2, 1.0, 30.0)
_LONGEST = (1000, 1000, 1000, 3333)
_FIRST = (1, 10, 10, 10)
_GROUPS = 40
_COOPERATIVE, _UNCOUPLED = (2.0, 10.0), (1e3, 1e5)
_CAUSE = "the slope varies within the window, whose bounds the paper draws but does not print"
_OVERLAPS = ((10.0, 1, 2), (300.0, 2, 3))
_COOPERATIVE_RULE = Rule(3.0, 0.03, 0.05)
_UNCOUPLED_RULE = Rule(3.0, 0.03, 0.02)
_ENERGY_RULE = Rule(3.0, 0.01, 0.01)
_OVERLAP_RULE = Rule(3.0, 0.03, 0.06)
_EXPONENTS = {
    0.01: (printed("1.178", "0.014"), printed("0.3494", "0.0029")),
    0.1: (printed("1.114", "0.010"), printed("0.3436", "0.0030")),
}


def relaxing_filaments(extension_time_microseconds, chains, step_microseconds, steps, groups, seed):
    """Straight filaments with their first node in a trap as stiff as a segment, after given numbers of steps.

    Returns
    -------
    dict of arrays
        ``time`` in ps; means over groups of filaments, (times, groups): ``shortening`` L - R.e in nm, and the energies
        ``stretching`` of a segment and ``bending`` of a joint over k_B T.
    """
    kind = replace(simulation.ACTIN, extension_relaxation_time=extension_time_microseconds * MICROSECOND)
    filaments = simulation.solvent()
    for chain in range(chains):
        filaments.add_straight(kind, _SEGMENTS, [0, 0, 0], [1, 0, 0])
        filaments.add_tether(chain, 0, [0, 0, 0], kind.segment_stiffness)
    context = simulation.start(filaments, step_microseconds * MICROSECOND, seed)
    rows = []
    for nodes in simulation.frames(context, chains, steps):
        vectors = np.diff(nodes, axis=1)
        lengths = np.linalg.norm(vectors, axis=2)
        tangents = vectors / lengths[:, :, None]
        cosines = np.sum(tangents[:, 1:] * tangents[:, :-1], axis=2)
        shortening = _CONTOUR - (nodes[:, -1, 0] - nodes[:, 0, 0])
        stretching = kind.stretching_energy(lengths).mean(axis=1) / THERMAL_ENERGY
        bending = kind.bending_energy(cosines).mean(axis=1) / THERMAL_ENERGY
        rows.append([simulation.groups(values, groups) for values in (shortening, stretching, bending)])
    columns = dict(zip(("shortening", "stretching", "bending"), np.transpose(rows, (1, 0, 2))))
    return {"time": np.array(steps) * step_microseconds * MICROSECOND, **columns}


def _stages(records, quick, extension_time):
    for number, step in enumerate(_STEP_MICROSECONDS):
        steps = np.unique(np.geomspace(_FIRST[number], _LONGEST[number], 40).round().astype(int)).tolist()
        steps = sorted({*steps, *(round(time / step) for time, *pair in _OVERLAPS if number in pair)})
        yield records.measure(
            f"figure-15-17-extension-time-{extension_time:g}-us-step-{step:g}-us",
            relaxing_filaments,
            extension_time_microseconds=extension_time,
            chains=400 if quick else 2000,
            step_microseconds=step,
            steps=steps,
            groups=_GROUPS,
            seed=15 + number,
        )


def _joined(stages, name):
    # Of each stage what lies beyond the end of the one with shorter steps.
    times, values, end = [], [], 0.0
    for stage in stages:
        later = stage["time"] > 1.001 * end
        times.append(stage["time"][later])
        values.append(stage[name][later])
        end = stage["time"][-1]
    return np.concatenate(times) / MICROSECOND, np.concatenate(values)


def _exponent(time, values, window):
    inside = (time >= window[0]) & (time <= 1.001 * window[1])

    def slope(mean):
        return np.polyfit(np.log(time[inside]), np.log(mean), 1)[0]

    return simulation.jackknife(slope, values[inside])


def _exponents(stages, extension_time):
    time, shortening = _joined(stages, "shortening")
    rules = (("cooperative", _COOPERATIVE, _COOPERATIVE_RULE), ("uncoupled", _UNCOUPLED, _UNCOUPLED_RULE))
    for (name, window, rule), paper in zip(rules, _EXPONENTS[extension_time]):
        if paper is not None:
            label = f"{name}_exponent_extension_time_{extension_time:g}_us"
            yield Result(label, "1", _exponent(time, shortening, window), rule, paper=paper, cause=_CAUSE)


def _energy(stages):
    late = stages[-1]["time"] > 0.1 * stages[-1]["time"][-1]
    mean = simulation.mean(stages[-1]["stretching"][late].mean(axis=0))
    expected = stretching_energy_mean(ACTIN, SOLVENT_TEMPERATURE) / THERMAL_ENERGY
    return Result(
        "elastic_energy",
        "k_B T",
        Estimate(float(_SEGMENTS * mean.value), float(_SEGMENTS * mean.error)),
        _ENERGY_RULE,
        _SEGMENTS * expected,
        printed("34.2"),
        "the print has Euler's error at its step of 0.01 us, and the drift of a free segment for that of a chain",
    )


def _overlaps(stages, extension_time):
    for moment, first, second in _OVERLAPS:
        means = []
        for number in (first, second):
            index = int(np.argmin(np.abs(stages[number]["time"] / MICROSECOND - moment)))
            means.append(simulation.mean(stages[number]["shortening"][index]))
        ratio = means[1].value / means[0].value
        error = ratio * np.hypot(means[0].error / means[0].value, means[1].error / means[1].value)
        steps = f"{_STEP_MICROSECONDS[second]:g}_over_{_STEP_MICROSECONDS[first]:g}_us"
        name = f"shortening_at_{moment:g}_us_with_steps_of_{steps}_extension_time_{extension_time:g}_us"
        yield Result(name, "1", Estimate(float(ratio), float(error)), _OVERLAP_RULE, 1.0)


def evaluate_relaxation(records, quick):
    """Figs. 15 and 16: the shortening, its exponents, and energies on the way."""
    stages = list(_stages(records, quick, 0.1))
    results = [*_exponents(stages, 0.1), _energy(stages), *_overlaps(stages, 0.1)]
    pictures = {
        "Shortening of straight filaments": lambda figure: _draw_stages(figure, stages),
        "Energies of straight filaments that relax": lambda figure: _draw_energies(figure, stages),
    }
    return Outcome(results, pictures)


def evaluate_extension_times(records, quick):
    """Fig. 17: the same with another relaxation time of a segment's length."""
    every = {extension_time: list(_stages(records, quick, extension_time)) for extension_time in _EXPONENTS}
    results = []
    for extension_time, stages in every.items():
        if extension_time != 0.1:
            results += [*_exponents(stages, extension_time), *_overlaps(stages, extension_time)]
    labels = {
        "shortening": r"shortening $\Delta$ (nm)",
        "stretching": r"$\langle V_\mathrm{el}\rangle/\langle V_\mathrm{el}\rangle_\mathrm{eq}$",
        "bending": r"$\langle V_\mathrm{b}\rangle/\langle V_\mathrm{b}\rangle_\mathrm{eq}$",
    }
    pictures = {
        f"{name} for several relaxation times of a length".capitalize(): (
            lambda figure, name=name, label=label: _draw_extension_times(figure, every, name, label)
        )
        for name, label in labels.items()
    }
    remarks = (
        "Relaxation times of 1 us and more, and Fig. 18 with them, are not reproduced yet: at them, steps of 1 us do "
        "not give what steps of 0.01 us give."
    )
    return Outcome(results, pictures, remarks)


def _equilibrium(name):
    if name == "shortening":
        return 1.0
    mean = {"stretching": stretching_energy_mean, "bending": bending_energy_mean}[name]
    return mean(ACTIN, SOLVENT_TEMPERATURE) / THERMAL_ENERGY


def _draw_stages(figure, stages):
    axis = figure.subplots()
    for colour, step, stage in zip(style.COLOURS, _STEP_MICROSECONDS, stages):
        mean = simulation.mean(stage["shortening"])
        label = rf"ours, $\Delta t$ = {step:g} µs"
        axis.errorbar(
            stage["time"] / MICROSECOND, mean.value, mean.error, fmt="o", markersize=3, color=colour, label=label
        )
    time, shortening = _joined(stages, "shortening")
    for window, exponent, line in ((_COOPERATIVE, 1.114, "--"), (_UNCOUPLED, 0.3436, ":")):
        inside = (time >= window[0]) & (time <= 1.001 * window[1])
        middle = np.exp(np.mean(np.log(shortening.mean(axis=1)[inside] / time[inside] ** exponent)))
        span = np.array([0.3 * window[0], 3 * window[1]])
        axis.plot(span, middle * span**exponent, line, color=style.PAPER, label=rf"paper, $t^{{{exponent:g}}}$")
        for edge in window:
            axis.axvline(edge, color="black", linewidth=0.6, linestyle=":")
    style.finish(
        axis, "time (µs)", r"shortening $\Delta$ (nm)", xscale="log", yscale="log", ylim=(1e-3, 3e3), xlim=(5e-5, 2e5)
    )


def _draw_energies(figure, stages):
    axis = figure.subplots()
    for name, colour, label in (("stretching", style.COLOURS[5], "elastic"), ("bending", style.COLOURS[0], "bending")):
        for number, stage in enumerate(stages):
            mean = simulation.mean(stage[name] / _equilibrium(name))
            axis.errorbar(
                stage["time"] / MICROSECOND,
                mean.value,
                mean.error,
                fmt="os^v"[number],
                markersize=3,
                color=colour,
                label=rf"{label}, $\Delta t$ = {_STEP_MICROSECONDS[number]:g} µs",
            )
    axis.axhline(1.0, color=style.THEORY, linewidth=0.8)
    for edge in (*_COOPERATIVE, *_UNCOUPLED):
        axis.axvline(edge, color="black", linewidth=0.6, linestyle=":")
    style.finish(axis, "time (µs)", "energy over its equilibrium value", xscale="log", ylim=(0, 2))


def _draw_extension_times(figure, every, name, label):
    axis = figure.subplots()
    for colour, (extension_time, stages) in zip(style.COLOURS, every.items()):
        time, values = _joined(stages, name)
        mean = simulation.mean(values / _equilibrium(name))
        axis.plot(
            time,
            mean.value,
            "o-",
            markersize=2.5,
            linewidth=0.7,
            color=colour,
            label=rf"$\tau_\ell$ = {extension_time:g} µs",
        )
    scales = {"xscale": "log"}
    if name == "shortening":
        scales.update(yscale="log", ylim=(1e-3, 3e3))
    else:
        axis.axhline(1.0, color=style.THEORY, linewidth=0.8)
    style.finish(axis, "time (µs)", label, **scales)


CASES = (
    Case("figure-15-16", "Figs. 15 and 16: relaxation of straight filaments", (15, 16), evaluate_relaxation),
    Case("figure-17", "Fig. 17: another relaxation time of a length", (17,), evaluate_extension_times),
)
