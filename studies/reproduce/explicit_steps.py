"""Sections III A, VI A and VII A: steps of Euler's scheme and of the inextensible chain, beside those of modes."""

import math

import numpy as np

from benchmark.measurement import Estimate
from openmm_cylchain import InstabilityError
from openmm_cylchain.theory import bead_spring_mean_square_lengths

from . import base_pairs, simulation, style
from .base_pairs import BASE_PAIRS, LARGEST_STEPS, TEMPERATURE
from .case import Case, Outcome
from .inextensible_chains import exact_mean_squares, inextensible_chains
from .result import ROUNDING, AtLeast, AtMost, Printed, Result, Rule, printed

_BONDS = 63
_USABLE = 0.1
_STABILITY_GRID = np.arange(0.80, 1.2001, 0.02)
_STABILITY_STEPS = 4000
_STABILITY_RULE = Rule(3.0, 0.02)
_LIMIT = Printed(0.05)
_GROUPS = 16
_COARSE = 10
_EULER_STEPS = {True: 20000, False: 200000}

_INEXTENSIBLE_STEP = 5e-5
_SHORT_BONDS = 7
_TIMES = {
    True: {(_BONDS, _INEXTENSIBLE_STEP): 0.02, (_BONDS, 1e-2): 1.0, (_SHORT_BONDS, 1e-2): 16.0},
    False: {
        (_BONDS, _INEXTENSIBLE_STEP): 0.2,
        (_BONDS, 1e-4): 0.4,
        (_BONDS, 1e-3): 4.0,
        (_BONDS, 1e-2): 20.0,
        (_SHORT_BONDS, 1e-3): 12.0,
        (_SHORT_BONDS, 1e-2): 60.0,
        (_SHORT_BONDS, 3e-2): 60.0,
    },
}
"""Times in xi/kappa, by bonds and step."""
_JUDGED_STEP = 1e-2
_COPIES = {_BONDS: 64, _SHORT_BONDS: 1024}
_QUANTITIES = {_BONDS: ("end_to_end", "middle_bead"), _SHORT_BONDS: ("end_to_end", "shortening")}
"""Of mean squares: what the paper looks at; of short chains also N^2 - <L^2>, which is small and hard to get right."""


def blows_up(beads_per_bond, step, copies, steps, seed):
    """Whether chains in Euler's scheme are lost within some steps: a dict with ``lost``, 0 or 1."""
    kind = base_pairs.SIMULATED.coarse_grained(beads_per_bond)
    positions = base_pairs.drawn_positions(kind, _BONDS, copies, seed)
    context = base_pairs.start("euler", step, positions, seed, kind)
    try:
        (nodes,) = simulation.frames(context, copies, [steps])
    except InstabilityError:
        return {"lost": 1}
    squares = np.sum(np.diff(nodes, axis=1) ** 2, axis=-1)
    return {"lost": int(not np.mean(squares) < 4.0 * kind.bead_spacing**2)}


def lengths_with_euler(step, copies, steps, frames, groups, seed):
    """Mean squares of the lengths of all bonds with Euler's scheme, in nm^2: ``squares``, (groups,)."""
    kind = base_pairs.SIMULATED
    positions = base_pairs.drawn_positions(kind, _BONDS, copies, seed)
    context = base_pairs.start("euler", step, positions, seed, kind)
    every = steps // frames * np.arange(1, frames + 1)
    squares = [
        np.sum(np.diff(nodes, axis=1) ** 2, axis=-1).mean(axis=-1)
        for nodes in simulation.frames(context, copies, every)
    ]
    return {"squares": simulation.groups(np.mean(squares, axis=0), groups)}


def stability_bound(nu):
    """The step of Euler's scheme above which beads of a straight chain that move against each other grow, in tau."""
    return 1.0 / (2.0 * (1.0 + 2.0 * nu))


def _measured_bound(records, beads_per_bond):
    """The step between the largest that goes well and the smallest that does not, by bisection: an Estimate in tau."""
    bound = stability_bound(BASE_PAIRS.coarse_grained(beads_per_bond).nu)
    low, high = 0, len(_STABILITY_GRID) - 1
    while high - low > 1:
        middle = (low + high) // 2
        step = float(bound * _STABILITY_GRID[middle])
        data = records.measure(
            f"section-3-{beads_per_bond}-base-pairs-step-{step:.4f}", blows_up,
            beads_per_bond=beads_per_bond, step=step, copies=16, steps=_STABILITY_STEPS, seed=3,
        )  # fmt: skip
        low, high = (low, middle) if data["lost"] else (middle, high)
    width = bound * (_STABILITY_GRID[high] - _STABILITY_GRID[low])
    value = 0.5 * bound * (_STABILITY_GRID[low] + _STABILITY_GRID[high])
    return Estimate(float(value), float(width / math.sqrt(12.0)))


def evaluate_euler(records, quick):
    """Sections III A and VII A: Euler's scheme."""
    theory = stability_bound(BASE_PAIRS.nu)
    results = [
        Result(
            "largest_stable_step_of_euler", "tau", _measured_bound(records, 1), _STABILITY_RULE, theory, printed("0.3")
        )
    ]
    coarse = BASE_PAIRS.coarse_grained(_COARSE)
    bound = stability_bound(coarse.nu)
    cause = (
        f"the stiffest mode of the springs, 4 (1 + 2 ν) by (27), grows from 1/(2 (1 + 2 ν)) on, which is {bound:.3f} "
        f"at ν = {coarse.nu:.4f} and below 1/2 at any ν"
    )
    results.append(
        Result(
            "largest_stable_step_of_euler_over_nu_at_small_nu", "xi/kappa", _measured_bound(records, _COARSE),
            _STABILITY_RULE, bound, printed("0.6"), cause,
        )
    )  # fmt: skip
    data = records.measure(
        "section-3-usable", lengths_with_euler, step=_USABLE, copies=32, steps=_EULER_STEPS[quick], frames=100,
        groups=_GROUPS, seed=3,
    )  # fmt: skip
    exact = bead_spring_mean_square_lengths(BASE_PAIRS, _BONDS, TEMPERATURE).mean()
    ratio = simulation.mean(data["squares"] / exact)
    ours = Estimate(float(abs(ratio.value - 1.0)), float(ratio.error))
    results.append(Result("deviation_of_bonds_with_euler_0.1_tau", "1", ours, AtMost(3.0, 0.2), paper=_LIMIT))
    for bonds, step in LARGEST_STEPS.items():
        if bonds in (63, 511):
            orders = math.log10(step / _USABLE)
            text = {63: "2", 511: "3"}[bonds]
            name = f"orders_of_magnitude_of_modes_over_euler_{bonds}_bonds"
            results.append(Result(name, "1", Estimate(orders, None), ROUNDING, paper=printed(text)))
    orders = math.log10(_USABLE * BASE_PAIRS.nu / _INEXTENSIBLE_STEP)
    name = "orders_of_magnitude_of_euler_over_inextensible_chains"
    results.append(Result(name, "1", Estimate(orders, None), ROUNDING, paper=printed("3")))
    remarks = (
        "Chains of 63 bonds. The largest stable step is where chains of base pairs are first lost within "
        f"{_STABILITY_STEPS} steps; the theory is that of the stiffest mode of a straight chain."
    )
    return Outcome(results, {}, remarks)


def evaluate_inextensible(records, quick):
    """Section VI A."""
    persistence = BASE_PAIRS.persistence_length_at(TEMPERATURE) / BASE_PAIRS.bead_spacing
    unit = BASE_PAIRS.time_unit / BASE_PAIRS.nu * 1e3
    results = [_exact("step_of_the_print", "fs", _INEXTENSIBLE_STEP * unit, "0.02")]
    cause = (
        f"5·10⁻⁵ a/l_p with a/l_p = {1.0 / persistence:.5f}; the print follows with T*/ν = 0.097 of base pairs, whose "
        "bonds are not 1 but 10/3 long"
    )
    results.append(_exact("step_of_the_print_with_noise_2", "1", _INEXTENSIBLE_STEP / persistence, "5e-6", cause))
    for bonds, text in ((63, "5"), (511, "6")):
        orders = math.log10(LARGEST_STEPS[bonds] * BASE_PAIRS.nu / _INEXTENSIBLE_STEP)
        results.append(_exact(f"orders_of_magnitude_of_modes_over_the_print_{bonds}_bonds", "1", orders, text))
    deviations = {}
    for (bonds, step), time in _TIMES[quick].items():
        data = records.measure(
            f"section-6-{bonds}-bonds-step-{step:g}", inextensible_chains, bonds=bonds, persistence_length=persistence,
            copies=_COPIES[bonds], step=step, time=time, frames=40, groups=_GROUPS, seed=6,
        )  # fmt: skip
        deviations[bonds, step] = _deviations(data, bonds, persistence)
    for bonds, step in _TIMES[quick]:
        if step > _JUDGED_STEP:
            continue
        for name, ours in zip(_QUANTITIES[bonds], deviations[bonds, step]):
            label = f"deviation_of_{name}_{bonds}_bonds_step_{step:g}"
            results.append(Result(label, "1", ours, AtMost(3.0, 0.4), paper=_LIMIT))
    # The print has 5e-5 for the largest step, so that one 200 times as long should deviate by more.
    longest = _JUDGED_STEP
    worst = max(deviations[_SHORT_BONDS, longest], key=lambda each: each.value)
    cause = (
        f"with all forces at the midpoint and iterations that converge, a step of {longest:g} deviates by "
        f"{100 * worst.value:.1f} ± {100 * worst.error:.1f} % only: the scheme allows steps "
        f"{longest / _INEXTENSIBLE_STEP:.0f} times as long as the print, with which modes gain "
        f"{math.log10(LARGEST_STEPS[63] * BASE_PAIRS.nu / longest):.1f} to "
        f"{math.log10(LARGEST_STEPS[511] * BASE_PAIRS.nu / longest):.1f} orders of magnitude"
    )
    name = f"largest_deviation_{_SHORT_BONDS}_bonds_{longest / _INEXTENSIBLE_STEP:.0f}_times_the_step_of_the_print"
    results.append(Result(name, "1", worst, AtLeast(3.0, 0.4), paper=_LIMIT, cause=cause))

    def draw(figure):
        axis = figure.subplots()
        axis.axhspan(-0.05, 0.05, color="#F0E442", alpha=0.3, linewidth=0)
        for bonds, colour in ((_BONDS, style.COLOURS[0]), (_SHORT_BONDS, style.COLOURS[1])):
            for number, marker in enumerate("oD"):
                points = [
                    (step, each[number].value, each[number].error)
                    for (count, step), each in deviations.items()
                    if count == bonds
                ]
                label = f"ours, {bonds} bonds, {_QUANTITIES[bonds][number].replace('_', ' ')}"
                axis.errorbar(*zip(*points), fmt=marker, color=colour, markersize=4, capsize=2, label=label)
        axis.axvline(_INEXTENSIBLE_STEP, color=style.PAPER, linestyle="--", linewidth=0.8, label="paper, largest step")
        style.finish(axis, r"step ($\xi/\kappa$)", "deviation", xscale="log", ylim=(-0.02, 0.1))

    remarks = (
        "Scheme (62) to (68) in NumPy, chains that start in equilibrium. A chain of 63 bonds relaxes in 3·10⁴ ξ/κ, "
        "which no step below 1 reaches here: its bends of short wavelength relax, which a step that is too long spoils "
        f"first. Chains of {_SHORT_BONDS} bonds relax altogether, in less than 10 ξ/κ. Without the metric force, which "
        "the scheme leaves out, chains of fixed bonds are softer to bending by up to 3 %, at any step."
    )
    return Outcome(results, {"Deviations of inextensible chains against the step": draw}, remarks)


def _exact(name, dimension, value, text, cause=""):
    return Result(name, dimension, Estimate(float(value), None), ROUNDING, float(value), printed(text), cause)


def _deviations(data, bonds, persistence):
    """Of mean squares from exact ones: Estimates. What long chains had at the start is not held against the step."""
    if data["failed"]:
        return [Estimate(1.0, 0.0)] * 2
    exact = exact_mean_squares(1.0 / persistence, bonds)
    if bonds == _SHORT_BONDS:
        square, longest = data["squares"][0], bonds**2
        ratios = simulation.mean(np.stack([square / exact[0], (longest - square) / (longest - exact[0])]))
    else:
        ratios = simulation.mean(1.0 + (data["squares"] - data["starts"]) / exact[:, None])
    return [Estimate(float(abs(value - 1.0)), float(error)) for value, error in zip(ratios.value, ratios.error)]


CASES = (
    Case("section-3", "Sections III A and VII A: Euler's scheme", (), evaluate_euler),
    Case("section-6", "Sections VI A and VII A: inextensible chains", (), evaluate_inextensible),
)
