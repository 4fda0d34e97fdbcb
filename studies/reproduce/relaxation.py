"""Figs. 15 to 18: relaxation of straight filaments whose first node is trapped."""

import numpy as np

from benchmark.measurement import scaled

from . import simulation, style
from .case import Case, Outcome
from .relaxing_filaments import (
    SEGMENTS,
    STEPS,
    equilibrium,
    linear_relaxation,
    measure_relaxation,
    ratio,
    relaxing_filaments,
)
from .result import Estimate, LowerBound, Result, Rule, printed

_EXTENSION_TIME = 0.1
_SMALL_TIMES = {True: (0.01, 0.1), False: (0.01, 0.1, 1.0)}
_LARGE_TIMES = {True: (10.0,), False: (10.0, 100.0, 1000.0)}
_COOPERATIVE, _UNCOUPLED = (2.0, 10.0), (1e3, 1e5)
_REGIMES = ((0.9, "I"), (4.5, "II"), (100.0, "III"), (1e4, "IV"))
_EDGES = (*_COOPERATIVE, *_UNCOUPLED)
_MARKERS = "os^vD"
_EARLY, _PEAK = 0.04, 10.0
_EXPONENTS = {
    0.01: (printed("1.178", "0.014"), printed("0.3494", "0.0029")),
    0.1: (printed("1.114", "0.010"), printed("0.3436", "0.0030")),
    10.0: (printed("0.8941", "0.0078"), printed("0.3313", "0.0032")),
}
_PRINTED_SCHEME = {"extension_time_microseconds": 10.0, "chains": 64, "step_microseconds": 0.01, "scheme": "euler"}
_PRINTED_SCHEME_END = {True: 10.0, False: 1000.0}
_COOPERATIVE_RULE = Rule(3.0, 0.03, 0.05)
_UNCOUPLED_RULE = Rule(3.0, 0.03, 0.02)
_ENERGY_RULE = Rule(3.0, 0.01, 0.01)
_EARLY_RULE = Rule(3.0, 0.01, 0.015)
_SAME_RULE = Rule(3.0, 0.03, 0.03)
_WINDOW_CAUSE = "the slope varies within the window, whose bounds the paper draws but does not print"
_EULER_CAUSE = "the print has Euler's error at its step of 0.01 us, and the drift of a free segment for that of a chain"
_DRIFT_CAUSE = (
    "the printed scheme has the drift of a free segment for that of a chain, which the friction of lengths scales"
)

_LABELS = {
    "shortening": r"shortening $\Delta$ (nm)",
    "stretching": r"elastic energy over equilibrium",
    "bending": r"bending energy over equilibrium",
}


def _relaxation(records, quick, extension_time):
    chains = (400 if quick else 2000) if extension_time == _EXTENSION_TIME else (320 if quick else 1000)
    return measure_relaxation(records, extension_time, chains)


def _exponents(relaxation, cause):
    windows = (("cooperative", _COOPERATIVE, _COOPERATIVE_RULE), ("uncoupled", _UNCOUPLED, _UNCOUPLED_RULE))
    for (name, window, rule), paper in zip(windows, _EXPONENTS.get(relaxation.extension_time, ())):
        label = f"{name}_exponent_extension_time_{relaxation.extension_time:g}_us"
        yield Result(label, "1", relaxation.exponent("shortening", window), rule, paper=paper, cause=cause)


def _late_elastic_energy(relaxation, paper=None, cause=""):
    # Of the whole filament, as the paper gives it.
    ours = scaled(relaxation.late("stretching"), SEGMENTS)
    label = f"late_elastic_energy_extension_time_{relaxation.extension_time:g}_us"
    return Result(label, "k_B T", ours, _ENERGY_RULE, SEGMENTS * equilibrium("stretching"), paper, cause)


def _over_equilibrium(estimate, name):
    return scaled(Estimate(float(estimate.value), float(estimate.error)), 1.0 / equilibrium(name))


def evaluate_relaxation(records, quick):
    """Figs. 15 and 16: the shortening, its exponents, and energies on the way."""
    relaxation = _relaxation(records, quick, _EXTENSION_TIME)
    early, _ = linear_relaxation([_EARLY])
    bending = relaxation.at("bending", _EARLY)
    peak = _over_equilibrium(relaxation.at("stretching", _PEAK), "stretching")
    results = [
        *_exponents(relaxation, _WINDOW_CAUSE),
        Result(f"bending_energy_at_{_EARLY:g}_us", "k_B T", bending, _EARLY_RULE, float(early[0])),
        Result(f"elastic_energy_over_equilibrium_at_{_PEAK:g}_us", "1", peak, LowerBound(), paper=printed("1")),
        _late_elastic_energy(relaxation, printed("34.2"), _EULER_CAUSE),
        *relaxation.overlaps(),
    ]
    pictures = {
        "Shortening of straight filaments": lambda figure: _draw_shortening(figure, relaxation),
        "Energies of straight filaments that relax": lambda figure: _draw_energies(figure, relaxation),
    }
    _, free = linear_relaxation([_PEAK])
    shortening = relaxation.at("shortening", _PEAK)
    remarks = (
        "The theory of the bending energy is that of small transverse motion without tension, which holds before "
        "filaments resist being drawn in. Tension delays this, and stretches the segments meanwhile (regime II): after "
        f"{_PEAK:g} µs filaments are shorter by {shortening.value:.2f} ± {shortening.error:.2f} nm, and would be by "
        f"{free[0]:.1f} nm without it."
    )
    return Outcome(results, pictures, remarks)


def evaluate_small_extension_times(records, quick):
    """Fig. 17: relaxation times of a length that are shorter than those of transverse motion."""
    every = [_relaxation(records, quick, extension_time) for extension_time in _SMALL_TIMES[quick]]
    reference = next(each for each in every if each.extension_time == _EXTENSION_TIME)
    results = []
    for relaxation in every:
        if relaxation is not reference:
            same = ratio(relaxation.at("bending", _PEAK), reference.at("bending", _PEAK))
            times = f"{relaxation.extension_time:g}_over_{_EXTENSION_TIME:g}_us"
            label = f"bending_energy_at_{_PEAK:g}_us_extension_time_{times}"
            results += [
                *_exponents(relaxation, _WINDOW_CAUSE),
                Result(label, "1", same, _SAME_RULE, paper=printed("1")),
            ]
            results += [_late_elastic_energy(relaxation), *relaxation.overlaps()]
    return Outcome(results, {"Small relaxation times of a length": lambda figure: _draw_extension_times(figure, every)})


def evaluate_large_extension_times(records, quick):
    """Fig. 18: relaxation times of a length that are longer than those of transverse motion."""
    every = [_relaxation(records, quick, extension_time) for extension_time in _LARGE_TIMES[quick]]
    end = _PRINTED_SCHEME_END[quick]
    step = _PRINTED_SCHEME["step_microseconds"]
    printed_scheme = records.measure(
        "figure-18-printed-scheme",
        relaxing_filaments,
        **_PRINTED_SCHEME,
        steps=np.unique(np.geomspace(10, round(end / step), 25).round().astype(int)).tolist(),
        seed=18,
    )
    of_print = _over_equilibrium(simulation.mean(printed_scheme["stretching"][-1]), "stretching")
    ours = _over_equilibrium(every[0].at("stretching", end), "stretching")
    label = f"elastic_energy_of_the_printed_scheme_over_equilibrium_at_{end:g}_us"
    results = [Result(label, "1", of_print, LowerBound(), paper=printed("1"))]
    for relaxation in every:
        results += [*_exponents(relaxation, _DRIFT_CAUSE), _late_elastic_energy(relaxation), *relaxation.overlaps()]
    remarks = (
        "In the paper, elastic energies stay far above their equilibrium when lengths relax slowly. Friction cannot "
        "change an equilibrium, and in ours they return to it. The cause is the drift of the printed scheme, that of "
        f"a free segment: at a relaxation time of 10 µs it gives {of_print.value:.2f} ± {of_print.error:.2f} of the "
        f"equilibrium after {end:g} µs, where the drift of the chain gives {ours.value:.2f} ± {ours.error:.2f}."
    )
    picture = {
        "Large relaxation times of a length": lambda figure: _draw_extension_times(figure, every, printed_scheme, True)
    }
    return Outcome(results, picture, remarks)


def _mark_regimes(axis, height):
    for edge in _EDGES:
        axis.axvline(edge, color="black", linewidth=0.6, linestyle=":")
    for position, name in _REGIMES:
        axis.text(position, height, name, ha="center", transform=axis.get_xaxis_transform(), fontsize=9, color="0.3")


def _draw_stages(axis, relaxation, name, scale=1.0, colour=None):
    # Stages have entries in the legend and colours of their own unless one colour is given for all.
    for number, (stage, marker) in enumerate(zip(relaxation.stages, _MARKERS)):
        mean = simulation.mean(stage[name] / scale)
        axis.errorbar(
            stage["time"],
            mean.value,
            mean.error,
            fmt=marker,
            markersize=3,
            color=style.COLOURS[number] if colour is None else colour,
            label=rf"ours, $\Delta t$ = {STEPS[number]:g} µs" if colour is None else None,
        )


def _draw_shortening(figure, relaxation):
    axis = figure.subplots()
    _draw_stages(axis, relaxation, "shortening")
    time, shortening = relaxation.joined("shortening")
    curve = np.geomspace(1e-3, 30.0, 60)
    axis.plot(curve, linear_relaxation(curve)[1], color=style.THEORY, linewidth=0.8, label="linear, without tension")
    exponents = _EXPONENTS[relaxation.extension_time]
    for window, exponent, line in zip((_COOPERATIVE, _UNCOUPLED), exponents, ("--", ":")):
        inside = (time >= window[0]) & (time <= 1.001 * window[1])
        middle = np.exp(np.mean(np.log(shortening.mean(axis=1)[inside] / time[inside] ** exponent.value)))
        span = np.array([0.3 * window[0], 3 * window[1]])
        label = rf"paper, $t^{{{exponent.value:g}}}$"
        axis.plot(span, middle * span**exponent.value, line, color=style.PAPER, linewidth=1.5, zorder=3, label=label)
    _mark_regimes(axis, 0.03)
    limits = {"ylim": (1e-3, 3e3), "xlim": (5e-5, 2e5)}
    style.finish(axis, "time (µs)", _LABELS["shortening"], xscale="log", yscale="log", **limits)


def _draw_energies(figure, relaxation):
    axis = figure.subplots()
    for name, colour, label in (("stretching", style.COLOURS[5], "elastic"), ("bending", style.COLOURS[0], "bending")):
        _draw_stages(axis, relaxation, name, equilibrium(name), colour)
        axis.plot([], [], "o", markersize=4, color=colour, label=f"ours, {label}")
    for step, marker in zip(STEPS, _MARKERS):
        axis.plot([], [], marker, markersize=4, color="gray", label=rf"$\Delta t$ = {step:g} µs")
    curve = np.geomspace(1e-4, 1e5, 200)
    linear = linear_relaxation(curve)[0]
    axis.plot(curve, linear, color=style.THEORY, linewidth=0.8, label="bending, linear, without tension")
    axis.axhline(1.0, color=style.THEORY, linewidth=0.8, linestyle="--", label="equilibrium, eqs. (40), (42)")
    _mark_regimes(axis, 0.95)
    style.finish(axis, "time (µs)", "energy over its equilibrium value", xscale="log", ylim=(0, 2), xlim=(5e-5, 2e5))


def _draw_extension_times(figure, every, printed_scheme=None, logarithmic=False):
    figure.set_size_inches(style.SIZE[0], 2.2 * style.SIZE[1])
    panels = figure.subplots(3, 1, sharex=True)
    for axis, name in zip(panels, _LABELS):
        scale = 1.0 if name == "shortening" else equilibrium(name)
        for colour, relaxation in zip(style.COLOURS, every):
            time, values = relaxation.joined(name)
            mean = simulation.mean(values / scale)
            label = rf"ours, $\tau_\ell$ = {relaxation.extension_time:g} µs"
            axis.errorbar(time, mean.value, mean.error, fmt="o", markersize=2.5, color=colour, label=label)
        if printed_scheme is not None:
            values = printed_scheme[name].mean(axis=-1) / scale
            label = r"printed scheme, $\tau_\ell$ = 10 µs"
            axis.plot(printed_scheme["time"], values, "--", color=style.PAPER, label=label)
        if name != "shortening":
            axis.axhline(1.0, color=style.THEORY, linewidth=0.8)
        scales = {"yscale": "log"} if name == "shortening" or logarithmic else {}
        if name == "shortening":
            scales["ylim"] = (1e-2, 3e3)
        last = axis is panels[-1]
        style.finish(axis, "time (µs)" if last else "", _LABELS[name], name == "shortening", xscale="log", **scales)


CASES = (
    Case("figure-15-16", "Figs. 15 and 16: relaxation of straight filaments", (15, 16), evaluate_relaxation),
    Case("figure-17", "Fig. 17: small relaxation times of a length", (17,), evaluate_small_extension_times),
    Case("figure-18", "Fig. 18: large relaxation times of a length", (18,), evaluate_large_extension_times),
)
