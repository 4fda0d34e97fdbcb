"""Figs. 9 to 11: mean square end-to-end distance of F-actin and DNA that start straight, and how it relaxes.

Where the paper averages over one polymer for 1 s after 1 s, here many polymers relax for several relaxation times of
their slowest mode and are averaged over several more.
"""

import math

import numpy as np

from openmm_cylchain.theory import chain_mean_square_end_to_end, chain_persistence_length, wlc_mean_square_end_to_end
from openmm_cylchain.time_steps.recommended_step import recommended_time_step

from . import simulation, style
from .case import Case, Outcome
from .result import Estimate, Result, Rule, printed
from .table_2 import ACTIN, DNA, MICROSECOND, SOLVENT_TEMPERATURE, SOLVENT_VISCOSITY, THERMAL_ENERGY

_VISCOSITY_FACTOR = 0.1
_FRAMES = 200
_GROUPS = 24
_ACTIN_SEGMENTS = {True: (2, 4, 8, 16, 32), False: (2, 4, 8, 16, 32, 64, 128)}
_DNA_SEGMENTS = {True: (2, 4, 8, 16), False: (2, 4, 8, 16, 32)}
_RELAXING_SEGMENTS = (64, 128)
_RELAXING_SECONDS = 2.0
_RELAXING_FRAMES = 40
_RULE = Rule(3.0, 0.02, 0.08)
_TIME_RULE = Rule(3.0, 0.0, 0.1)
_SINGLE_RANGE = (0.025, 0.975)
_TIMES = {64: printed("3.03", "0.35"), 128: printed("5.51", "0.81")}
_LARGEST_ROTATION_STEPS = {128: 4.0}
"""Steps over the recommended one; the slowest mode of the longest filament takes 10^5 steps even so."""

_MATERIALS = {"actin": ACTIN, "dna": DNA}
_NAMES = {"actin": "actin", "dna": "DNA"}


def _simulated(material):
    return {"actin": simulation.ACTIN, "dna": simulation.DNA}[material]


def straight_filaments(material, segments, chains, groups, step_microseconds, steps, seed):
    """Filaments that start straight, after given numbers of steps, in a solvent of a tenth of the viscosity.

    Returns
    -------
    dict of arrays
        ``time`` in ps and the squared end-to-end distance in nm^2, means over groups of filaments (times, groups).
    """
    filaments = simulation.solvent(_VISCOSITY_FACTOR)
    for _ in range(chains):
        filaments.add_straight(_simulated(material), segments, [0, 0, 0], [1, 0, 0])
    context = simulation.start(filaments, step_microseconds * MICROSECOND, seed)
    squares = [
        simulation.groups(np.sum((nodes[:, -1] - nodes[:, 0]) ** 2, axis=1), groups)
        for nodes in simulation.frames(context, chains, steps)
    ]
    return {"time": np.array(steps) * step_microseconds * MICROSECOND, "square": squares}


def _step(material, segments):
    kind = _MATERIALS[material]
    solvent = (_VISCOSITY_FACTOR * SOLVENT_VISCOSITY, SOLVENT_TEMPERATURE)
    factor = _LARGEST_ROTATION_STEPS.get(segments, 1.0)
    return factor * recommended_time_step(kind, *solvent, "implicit", segments).step


def _slowest_relaxation(material, segments):
    # The rates of the first bending mode of a rod and of the first mode of a coil (Rouse), added; in ps.
    kind = _MATERIALS[material]
    friction = kind.segment_friction(_VISCOSITY_FACTOR * SOLVENT_VISCOSITY, SOLVENT_TEMPERATURE, segments)
    per_length, length = friction.perpendicular / kind.segment_length, segments * kind.segment_length
    rod = per_length * (length / 4.73) ** 4 / kind.bending_rigidity
    persistence = kind.persistence_length_at(SOLVENT_TEMPERATURE)
    coil = 2.0 * per_length * length**2 * persistence / (3.0 * math.pi**2 * THERMAL_ENERGY)
    return 1.0 / (1.0 / rod + 1.0 / coil)


def _chains(segments, quick):
    if segments > 64:
        return 24
    if segments > 32:
        return 48
    few = 480 if segments <= 8 else 60
    return few if quick or segments > 16 else 4 * few


def _averaged(records, quick, material, segments):
    step = _step(material, segments)
    steps = _slowest_relaxation(material, segments) / step
    long = segments == 128
    discarded, averaged = (3.0, 3.0) if long else (5.0, 10.0)
    frames = int(discarded * steps) + max(1, int(averaged * steps / _FRAMES)) * np.arange(_FRAMES)
    return records.measure(
        f"figure-09-11-{material}-{segments}-segments",
        straight_filaments,
        material=material,
        segments=segments,
        chains=_chains(segments, quick),
        groups=_GROUPS,
        step_microseconds=step / MICROSECOND,
        steps=frames.tolist(),
        seed=9,
    )


def _evaluate(records, quick, material, numbers):
    kind = _MATERIALS[material]
    persistence = kind.persistence_length_at(SOLVENT_TEMPERATURE)
    results, points = [], []
    for segments in numbers:
        contour = segments * kind.segment_length
        mean = simulation.mean(_averaged(records, quick, material, segments)["square"].mean(axis=0))
        exact = chain_mean_square_end_to_end(kind, segments, SOLVENT_TEMPERATURE)
        points.append((contour, mean.value, mean.error, exact))
        # What a stiff filament falls short of its length tells more than its length.
        label = f"{contour:g}_nm"
        if contour < persistence:
            ours = Estimate(float(1.0 - mean.value / contour**2), float(mean.error / contour**2))
            name, theory = f"one_minus_mean_square_over_length_square_{material}_{label}", 1.0 - exact / contour**2
        else:
            ours = Estimate(float(mean.value / contour**2), float(mean.error / contour**2))
            name, theory = f"mean_square_over_length_square_{material}_{label}", exact / contour**2
        results.append(Result(name, "1", ours, _RULE, float(theory)))

    def draw(figure):
        axis = figure.subplots()
        contours, squares, errors, chains = np.transpose(points)
        curve = np.geomspace(0.7 * contours[0], 1.5 * contours[-1], 200)
        axis.plot(
            curve, wlc_mean_square_end_to_end(curve, persistence), color=style.THEORY, label="(25), wormlike chain"
        )
        axis.plot(curve, curve**2, ":", color="gray", label="rod")
        axis.errorbar(contours, squares, errors, fmt="o", markersize=4, capsize=2, color=style.OURS, label="ours")
        axis.plot(contours, chains, "+", markersize=10, color=style.COLOURS[1], label="exact, discrete chain")
        axis.axvline(persistence, color="black", linewidth=0.8, linestyle=":", label=r"$\ell_\mathrm{p}$")
        ylabel = r"mean square end-to-end distance $\langle R^2\rangle$ (nm$^2$)"
        style.finish(axis, r"contour length $L$ (nm)", ylabel, xscale="log", yscale="log")

    correlated = chain_persistence_length(kind, SOLVENT_TEMPERATURE)
    remarks = (
        "The theory is that of the discrete chain, exact. Its bending potential (27) grows faster than the harmonic "
        f"one, so that tangents are correlated over {correlated / 1e3:.4g} µm with segments of {kind.segment_length:g} "
        f"nm, where the rigidity stands for {persistence / 1e3:.4g} µm, and long filaments lie above (25)."
    )
    return Outcome(results, {f"Mean square end-to-end distance of {_NAMES[material]}": draw}, remarks)


def evaluate_actin(records, quick):
    """Fig. 9."""
    return _evaluate(records, quick, "actin", _ACTIN_SEGMENTS[quick])


def evaluate_dna(records, quick):
    """Fig. 11."""
    return _evaluate(records, quick, "dna", _DNA_SEGMENTS[quick])


def fitted_relaxation_time(time, relative):
    """Relaxation time from a straight line through the logarithm of the mean over groups, as the paper fits it.

    Points after the start that are at least three standard errors above zero count, weighted by their errors.

    Parameters
    ----------
    time : (times,) array
    relative : (times, groups) array
    """
    mean = simulation.mean(relative)
    fitted = (time > 0) & (mean.value > 3.0 * mean.error)
    weight = mean.value[fitted] / mean.error[fitted]
    return simulation.jackknife(
        lambda values: -1.0 / np.polyfit(time[fitted], np.log(values), 1, w=weight)[0], relative[fitted]
    )


def single_filament_rates(time, relative):
    """Slopes of straight lines through -log |<R^2>/<R^2>_th - 1| of single filaments, (filaments,) array.

    Parameters
    ----------
    time : (times,) array
    relative : (times, filaments) array
    """
    later = time > 0
    return -np.polyfit(time[later], np.log(np.abs(relative[later])), 1)[0]


def _cause(time, relative, paper):
    # None, unless a single filament of ours may well have what the paper found for its only one.
    slowest, fastest = np.quantile(single_filament_rates(time, relative), _SINGLE_RANGE)
    if not slowest <= 1.0 / paper.value <= fastest:
        return ""
    return (
        "the paper fits one filament, ours is the mean over many; the same fit to single ones of ours gives rates "
        f"from {slowest:.2g} to {fastest:.2g} 1/s (95 %), which includes the printed one of {1.0 / paper.value:.2g} 1/s"
    )


def evaluate_relaxation(records, quick):
    """Fig. 10: relaxation times of the mean over polymers, fitted over the 2 s of the paper."""
    results, curves = [], {}
    for segments in _RELAXING_SEGMENTS:
        step = _step("actin", 64)
        last = _RELAXING_SECONDS * 1e6 * MICROSECOND / step
        chains = 48 if quick else 192
        data = records.measure(
            f"figure-10-{segments}-segments",
            straight_filaments,
            material="actin",
            segments=segments,
            chains=chains,
            groups=chains,
            step_microseconds=step / MICROSECOND,
            steps=np.linspace(0, last, _RELAXING_FRAMES + 1).astype(int).tolist(),
            seed=10,
        )
        exact = chain_mean_square_end_to_end(ACTIN, segments, SOLVENT_TEMPERATURE)
        time = data["time"] / (1e6 * MICROSECOND)
        relative = data["square"] / exact - 1.0
        curves[segments] = time, relative
        ours = fitted_relaxation_time(time, relative)
        name = f"relaxation_time_{segments * ACTIN.segment_length / 1e3:g}_um"
        paper = _TIMES[segments]
        results.append(Result(name, "s", ours, _TIME_RULE, paper=paper, cause=_cause(time, relative, paper)))

    def draw(figure):
        axis = figure.subplots()
        for colour, (segments, (time, relative)) in zip(style.COLOURS, curves.items()):
            mean = simulation.mean(relative)
            label = f"ours, {segments * ACTIN.segment_length / 1e3:g} µm"
            axis.errorbar(time, mean.value, mean.error, fmt="o", markersize=3, color=colour, label=label)
            slope = np.exp(-time / _TIMES[segments].value) * mean.value[0]
            axis.plot(time, slope, "--", color=colour, label=f"paper, {_TIMES[segments].value} s")
        ylabel = r"$\langle R^2\rangle/\langle R^2\rangle^\mathrm{th} - 1$"
        style.finish(axis, "time (s)", ylabel, yscale="log", xlim=(0, _RELAXING_SECONDS))

    return Outcome(results, {"Relaxation of the mean square end-to-end distance": draw})


CASES = (
    Case("figure-09", "Fig. 9: mean square end-to-end distance of F-actin", (9,), evaluate_actin),
    Case("figure-10", "Fig. 10: relaxation of the mean square end-to-end distance", (10,), evaluate_relaxation),
    Case("figure-11", "Fig. 11: mean square end-to-end distance of DNA", (11,), evaluate_dna),
)
