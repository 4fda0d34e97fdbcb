"""Table II and Figs. 2 to 4: the largest steps by the rule of the paper, of scheme "modes" and of scheme "implicit".

The rule: mean squares of three observables within 5 % of their exact values; and (dQ/dt)/Q at fixed lags, of their
correlations Q, within 10 % of what it is at the smallest step.
"""

from dataclasses import dataclass

import numpy as np

from . import simulation, style
from .base_pairs import LARGEST_STEPS, OBSERVABLES, mean_squares, motion
from .case import Case, Outcome
from .result import AtLeast, AtMost, Estimate, Printed, Result

_LADDER = tuple(digit * 10.0**power for power in range(-1, 5) for digit in (1, 2, 5))
_PRINTED = {63: (50.0, 10.0), 127: (100.0, 50.0), 255: (100.0, 200.0), 511: (100.0, 200.0)}
"""Table II: largest steps in tau from equilibrium and from dynamics."""
IMPLICIT_STEPS = {63: 20.0, 127: 200.0, 255: 2000.0, 511: 20000.0}
"""Steps of scheme "implicit" in tau: a fifth of the shortest lag at which the rule of the paper looks."""
_RELAXED = (63, 127)
"""Bonds of chains that relax altogether within the runs here; of longer ones only the middle bond does."""

_EQUILIBRIUM, _DYNAMICS = Printed(0.05), Printed(0.10)
_RESOLUTION = {_EQUILIBRIUM: 0.4, _DYNAMICS: 0.3}
_GROUPS = 16
_MIDDLE_BOND, _MIDDLE_BEAD = 1, 2
_MARKERS = "osD"
_LABELS = ("end-to-end vector", "middle bond", "middle bead")


@dataclass(frozen=True)
class _Runs:
    """Runs of chains of one length: copies, time and the shortest lag in tau, how many decades of lags, and steps."""

    copies: int
    time: float
    shortest_lag: float
    decades: int
    modes: tuple
    implicit: tuple

    def lags(self, spacing):
        """Every lag and twice that, in tau, as far as frames allow it."""
        every = [self.shortest_lag * 10.0**decade for decade in range(self.decades)]
        return [lag for lag in every if lag >= spacing]


_RUNS = {
    True: {63: _Runs(64, 1e5, 1e2, 2, (2.0, 10.0, 20.0, 50.0, 100.0), (20.0, 1e3))},
    False: {
        63: _Runs(64, 8e5, 1e2, 4, (1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0), (20.0, 50.0, 100.0, 1e3, 1e4)),
        127: _Runs(64, 6e6, 1e3, 3, (10.0, 20.0, 50.0, 100.0, 200.0, 500.0, 1000.0), (200.0, 500.0, 1000.0, 1e4)),
        255: _Runs(128, 4e6, 1e4, 2, (20.0, 50.0, 100.0, 200.0, 500.0, 1000.0, 2000.0, 5000.0), (2e3, 5e3, 1e4)),
        511: _Runs(64, 1e7, 1e5, 1, (50.0, 100.0, 200.0, 500.0, 1000.0, 5000.0), (2e4, 5e4, 1e5)),
    },
}


def _run(records, runs, bonds, scheme, step):
    spacing = max(step, runs.shortest_lag)
    lags = runs.lags(spacing)
    frames = round(runs.time / spacing)
    data = records.measure(
        f"figure-02-03-{bonds}-bonds-{scheme}-{step:g}",
        motion,
        bonds=bonds,
        copies=runs.copies,
        groups=_GROUPS,
        scheme=scheme,
        step=step,
        spacing=spacing,
        frames=frames,
        lags=[round(multiple * lag / spacing) for lag in lags for multiple in (1, 2)] or [1],
        seed=2,
    )
    return lags, data


def _equilibrium(data, bonds):
    """<Q^2> over its exact value: an Estimate for each observable that has relaxed."""
    relaxed = range(len(OBSERVABLES)) if bonds in _RELAXED else (_MIDDLE_BOND,)
    exact = mean_squares(bonds)
    return {which: simulation.mean(data["squares"][which] / exact[which]) for which in relaxed}


def _rate(which):
    """(dQ/dt)/Q times the lag, from the mean square and the losses of correlation at a lag and at twice that."""

    def rate(means):
        square, first, second = means
        before, after = (first, second) if which == _MIDDLE_BEAD else (square - first / 2, square - second / 2)
        return (after - before) / before

    return rate


def _rates(lags, data):
    return {
        (which, lag): simulation.jackknife(
            _rate(which), np.stack([data["squares"][which], *data["losses"][2 * number : 2 * number + 2, which]])
        )
        for number, lag in enumerate(lags)
        for which in range(len(OBSERVABLES))
    }


def _over(rates, references):
    """Ratios of rates to those at the smallest step: Estimates, where there are both."""
    ratios = {}
    for key, rate in rates.items():
        if key in references:
            value = rate.value / references[key].value
            errors = rate.error / rate.value, references[key].error / references[key].value
            ratios[key] = Estimate(value, abs(value) * float(np.hypot(*errors)))
    return ratios


def _largest_deviation(ratios, limit):
    """The largest of |ratio - 1| that is known well enough; None if none is."""
    known = [each for each in ratios.values() if each.error <= _RESOLUTION[limit] * limit.value]
    if not known:
        return None
    largest = max(known, key=lambda each: abs(each.value - 1.0))
    return Estimate(float(abs(largest.value - 1.0)), float(largest.error))


class _Ladder:
    """What the runs of chains of one length give: by scheme and step, ratios that should be one."""

    def __init__(self, records, runs, bonds):
        self.bonds, self.runs = bonds, runs
        self.equilibrium, self.dynamics = {}, {}
        references = None
        for scheme, steps in (("modes", runs.modes), ("implicit", runs.implicit)):
            for step in steps:
                lags, data = _run(records, runs, bonds, scheme, step)
                rates = _rates(lags, data)
                references = rates if references is None else references
                self.equilibrium[scheme, step] = _equilibrium(data, bonds)
                self.dynamics[scheme, step] = _over(rates, references)

    def results(self):
        equilibrium, dynamics = _PRINTED[self.bonds]
        for name, ratios, limit, step in (
            ("equilibrium", self.equilibrium, _EQUILIBRIUM, equilibrium),
            ("dynamics", self.dynamics, _DYNAMICS, dynamics),
        ):
            following = _LADDER[_LADDER.index(step) + 1]
            whole = name == "dynamics" or self.bonds in _RELAXED
            yield from self._result(name, ratios, limit, "modes", step, AtMost)
            if whole:
                yield from self._result(name, ratios, limit, "modes", following, AtLeast)
            yield from self._result(name, ratios, limit, "implicit", IMPLICIT_STEPS[self.bonds], AtMost)

    def _result(self, name, ratios, limit, scheme, step, rule):
        deviation = _largest_deviation(ratios.get((scheme, step), {}), limit)
        if deviation is not None:
            yield Result(
                f"largest_deviation_{name}_{scheme}_{self.bonds}_bonds_{step:g}_tau",
                "1",
                deviation,
                rule(3.0, _RESOLUTION[limit]),
                paper=limit,
                cause=_cause(self, name, ratios, limit, scheme, rule),
            )


def _allowed(ratios, scheme, limit):
    """The largest step that the rule allows here, and its deviation; None if it allows none or none is known."""
    largest = None
    for (which, step), each in ratios.items():
        deviation = _largest_deviation(each, limit) if which == scheme else None
        if deviation is not None and deviation.value > limit.value:
            break
        largest = (step, deviation) if deviation is not None else largest
    return largest


def _cause(ladder, name, ratios, limit, scheme, rule):
    allowed = _allowed(ratios, scheme, limit)
    if rule is not AtLeast or allowed is None:
        return ""
    step, deviation = allowed
    return (
        f"the rule allows {step:g} tau here, where {name} of chains of {ladder.bonds} bonds deviates by "
        f"{100 * deviation.value:.1f} ± {100 * deviation.error:.1f} %; error bars count in the paper, so that its "
        "steps depend on its statistics"
    )


def evaluate_ladders(records, quick):
    """Table II, Figs. 2 and 3."""
    ladders = [_Ladder(records, runs, bonds) for bonds, runs in _RUNS[quick].items()]
    results = [result for ladder in ladders for result in ladder.results()]
    pictures = {
        "Mean squares over exact ones against the step": lambda figure: _draw(figure, ladders, "equilibrium", 0.05),
        "Rates of change over those at the smallest step": lambda figure: _draw(figure, ladders, "dynamics", 0.10),
    }
    return Outcome(results, pictures, _remarks(ladders))


def _remarks(ladders):
    smallest = ", ".join(f"{ladder.runs.modes[0]:g} ({ladder.bonds})" for ladder in ladders)
    undecided = [ladder.bonds for ladder in ladders if ladder.bonds not in _RELAXED]
    text = (
        "All chains start from their exact equilibrium. The largest of the deviations is given that is known to "
        f"{100 * _RESOLUTION[_EQUILIBRIUM] * _EQUILIBRIUM.value:.0f} % in equilibrium and "
        f"{100 * _RESOLUTION[_DYNAMICS] * _DYNAMICS.value:.0f} % in dynamics: at the step of the table it should not "
        "be above the limit of the paper, at the next step of its ladder not below; where none is known so well, there "
        "is no result. Rates of change are those between "
        f"a lag and twice that, over those at the smallest step of scheme modes, in tau (bonds): {smallest}. "
        "Scheme implicit takes a fifth of the shortest lag. "
        f"As values, without error bars, the rule allows dynamics here up to {_listed(ladders, 'modes')} tau with "
        f"scheme modes, and {_listed(ladders, 'implicit')} tau with scheme implicit (bonds: step)."
    )
    if undecided:
        text += (
            f" Chains of {' and '.join(map(str, undecided))} bonds relax in 10⁷ to 10⁹ tau: what the steps do to "
            "their end-to-end vectors and middle beads in equilibrium is not decided here, only that of their middle "
            "bonds, which the paper calls not at all critical."
        )
    return text


def _listed(ladders, scheme):
    allowed = {ladder.bonds: _allowed(ladder.dynamics, scheme, _DYNAMICS) for ladder in ladders}
    return ", ".join(f"{bonds}: {each[0]:g}" if each else f"{bonds}: none" for bonds, each in allowed.items())


def _draw(figure, ladders, name, limit):
    panels = figure.subplots(2, 2).flat if len(ladders) > 1 else [figure.subplots()]
    for axis, ladder in zip(panels, ladders):
        axis.axhspan(1 - limit, 1 + limit, color="#F0E442", alpha=0.3, linewidth=0)
        for scheme, colour in (("modes", style.COLOURS[0]), ("implicit", style.COLOURS[3])):
            for which, marker in enumerate(_MARKERS):
                points = _points(getattr(ladder, name), scheme, which, limit)
                if points:
                    label = f"{scheme}, {_LABELS[which]}"
                    axis.errorbar(
                        *zip(*points), fmt=marker, color=colour, markersize=3, linewidth=0.6, capsize=1.5, label=label
                    )
        printed_step = _PRINTED[ladder.bonds][0 if name == "equilibrium" else 1]
        axis.axvline(printed_step, color=style.PAPER, linewidth=0.8, linestyle="--", label="Table II")
        style.finish(axis, f"N = {ladder.bonds}: step (tau)", "ratio", False, xscale="log")
        axis.set_ylim(1 - 4 * limit, 1 + 4 * limit)
    entries = figure.axes[0].get_legend_handles_labels()
    figure.legend(*entries, loc="outside upper center", ncols=3, fontsize="x-small", frameon=False)


def _points(ratios, scheme, which, limit):
    return [
        (step, ratio.value, ratio.error)
        for (name, step), each in ratios.items()
        if name == scheme
        for key, ratio in each.items()
        if (key if isinstance(key, int) else key[0]) == which and ratio.error <= limit
    ]


_CURVE_BONDS = 255
_CURVE_SPACING = 100.0
_CURVE_LAGS = {True: (1e2, 3e2, 1e3, 3e3, 1e4, 3e4), False: (1e2, 3e2, 1e3, 3e3, 1e4, 3e4, 1e5)}
_CURVE_STEPS = {True: (10.0, 100.0), False: (1.0, 10.0, 100.0)}
_CURVE_TIME = {True: 1e5, False: 4e5}
_JUDGED_LAGS = {True: (3e2, 1e3, 3e3), False: (3e2, 1e3, 1e4)}


def evaluate_curves(records, quick):
    """Fig. 4: correlations of N = 255 at steps from the smallest to the largest."""
    lags, curves = _CURVE_LAGS[quick], {}
    exact = mean_squares(_CURVE_BONDS)
    for step in _CURVE_STEPS[quick]:
        data = records.measure(
            f"figure-04-step-{step:g}",
            motion,
            bonds=_CURVE_BONDS,
            copies=32,
            groups=_GROUPS,
            scheme="modes",
            step=step,
            spacing=_CURVE_SPACING,
            frames=round(_CURVE_TIME[quick] / _CURVE_SPACING),
            lags=[round(lag / _CURVE_SPACING) for lag in lags],
            seed=4,
        )
        losses = np.array(data["losses"])
        losses[:, :2] = 1.0 - losses[:, :2] / (2.0 * exact[:2, None])
        curves[step] = simulation.mean(losses)
    smallest, largest = curves[min(curves)], curves[max(curves)]
    results = []
    for lag in _JUDGED_LAGS[quick]:
        number = lags.index(lag)
        for which, name in enumerate(OBSERVABLES):
            ratio = largest.value[number, which] / smallest.value[number, which]
            errors = [each.error[number, which] / each.value[number, which] for each in (largest, smallest)]
            ours = Estimate(float(abs(ratio - 1.0)), float(ratio * np.hypot(*errors)))
            label = f"deviation_of_{name}_at_lag_{lag:g}_tau"
            results.append(Result(label, "1", ours, AtMost(3.0, 0.6), paper=_EQUILIBRIUM, cause=_cause_of_lag(lag)))

    def draw(figure):
        panels = figure.subplots(1, 3)
        ylabels = ("end-to-end vector", "middle bond", "middle bead ($d^2$)")
        for which, axis in enumerate(panels):
            for (step, curve), colour, marker in zip(curves.items(), style.COLOURS, "os^"):
                axis.errorbar(
                    lags, curve.value[:, which], curve.error[:, which], fmt=marker, markersize=3, color=colour,
                    capsize=2, markerfacecolor="none", label=f"ours, {step:g} tau",
                )  # fmt: skip
            scales = {"xscale": "log", "yscale": "log" if which == _MIDDLE_BEAD else "linear"}
            style.finish(axis, "lag (tau)", ylabels[which], which == 0, **scales)

    remarks = (
        "Autocorrelation functions of the end-to-end vector and the middle bond over their exact mean squares, and "
        "the mean square displacement of the middle bead seen from the centre; ours at the largest step over the "
        "smallest."
    )
    return Outcome(results, {"Correlations of chains of 255 bonds": draw}, remarks)


def _cause_of_lag(lag):
    shortest, step = _RUNS[False][_CURVE_BONDS].shortest_lag, LARGEST_STEPS[_CURVE_BONDS]
    if lag >= shortest:
        return ""
    return (
        f"at so few steps, {lag / step:g}, the rule of Table II does not look, whose shortest lag is {shortest:g} tau"
    )


CASES = (
    Case("figure-02-03", "Table II, Figs. 2 and 3: largest steps", (2, 3), evaluate_ladders),
    Case("figure-04", "Fig. 4: correlations at all steps", (4,), evaluate_curves),
)
