"""Fig. 9 of Chandran and Mofrad 2009: thermal fluctuations of a condensed chromosome that is clamped at one end."""

import math

import numpy as np
from openmm import unit

from openmm_cylchain.analysis.statistics import fit_relaxation_time
from openmm_cylchain.theory import clamped_angle_variance, clamped_deflection_variance
from openmm_cylchain.units.quantities import FORCE, LENGTH, VISCOSITY, in_units_of, thermal_energy

from . import rods_on_string, simulation, style
from .case import Case, Outcome
from .result import Estimate, Result, Rule, printed
from .rods_on_string import CHROMOSOME, MICROMETER, SECOND
from .transverse_modes import transverse_modes

_LENGTH, _SEGMENTS = 5.0 * MICROMETER, 25
_ONE = _LENGTH / _SEGMENTS
_VISCOSITIES = {"water": 1.0, "cell": 100.0}
_STEPS_PER_RELAXATION = 60
_STRIDE = 6
_DISCARDED, _AVERAGED = 4, 12
"""In relaxation times of the slowest mode."""
_LAGS = 26
_GROUPS = 30
_COPIES = {True: 1000, False: 3000}
_NODES = (5, 10, 15, 20, 25)
_BINS = np.linspace(-4.0, 4.0, 33)
"""Of the angle over its standard deviation in theory."""
_RULE = Rule(3.0, 0.005, 0.03)
_TIME_RULE = Rule(3.0, 0.01, 0.04)
_ESTIMATE = printed("0.14")
_RATIO = Rule(0.0, 1e-3)
_ELEMENTS = 3
_BEAM_STEP = 3.0
"""In relaxation times: steps of stiff cantilevers are exact however long they are, so each is a sample of its own."""
_BEAM_COPIES, _BEAM_STEPS = {True: 1000, False: 3000}, {True: 110, False: 410}
_BEAM_DISCARDED = 10
_BEAM_RULE = Rule(3.0, 0.005, 0.01)


def fluctuating_chromosome(viscosity_factor, copies, step_seconds, seed):
    """Clamped filaments that start straight and fluctuate in a plane.

    Returns
    -------
    dict of arrays
        ``angle_square`` and ``angle_fourth`` (groups,) of the last segment; ``deflection_square`` (segments, groups) of
        the nodes beyond the clamp in nm^2; ``correlation`` (lags, groups) of the slowest mode; ``counts`` of the angle
        in bins; ``trace`` of the angle of one filament, and ``time`` in ps from frame to frame.
    """
    column = rods_on_string.SIMULATED_CHROMOSOME
    filaments = column.solvent(viscosity_factor)
    kind = column.filament_type(_ONE)
    for _ in range(copies):
        filaments.add_straight(kind, _SEGMENTS + 1, [-_ONE, 0, 0], [1, 0, 0], clamped=[0, 1], planar=True)
    context = simulation.start(filaments, step_seconds * SECOND, seed)
    first, last = _DISCARDED * _STEPS_PER_RELAXATION, (_DISCARDED + _AVERAGED) * _STEPS_PER_RELAXATION
    steps = range(first, last + 1, _STRIDE)
    deflections = np.array([nodes[:, 2:, 1] for nodes in simulation.frames(context, copies, steps)])
    angles = np.arcsin((deflections[..., -1] - deflections[..., -2]) / _ONE)
    friction = column.friction(_ONE, _SEGMENTS + 1, viscosity_factor)
    slowest = transverse_modes(column.rigidity, friction, _ONE, _SEGMENTS, clamped=True).projections[0]
    amplitudes = deflections @ slowest
    correlation = [np.mean(amplitudes[: len(amplitudes) - lag] * amplitudes[lag:], axis=0) for lag in range(_LAGS)]
    deviation = math.sqrt(_angle_variance())
    return {
        "angle_square": simulation.groups(np.mean(angles**2, axis=0), _GROUPS),
        "angle_fourth": simulation.groups(np.mean(angles**4, axis=0), _GROUPS),
        "deflection_square": simulation.groups(np.mean(deflections**2, axis=0).T, _GROUPS),
        "correlation": simulation.groups(correlation, _GROUPS),
        "counts": np.histogram(angles / deviation, _BINS)[0],
        "trace": angles[:, 0],
        "time": _STRIDE * step_seconds * SECOND,
    }


def fluctuating_beams(elements, copies, steps, step_seconds, seed):
    """Clamped filaments of beam elements that start straight and fluctuate in a plane.

    Returns
    -------
    dict of arrays
        ``angle_square`` (groups,) of the tangent at the end, and ``deflection_square`` (elements, groups) of the nodes
        beyond the clamp in nm^2.
    """
    column = rods_on_string.SIMULATED_CHROMOSOME
    filaments = column.solvent()
    kind = column.filament_type(_LENGTH / elements, element="beam")
    for _ in range(copies):
        filaments.add_straight(kind, elements, [0, 0, 0], [1, 0, 0], clamped=0, clamped_tangents=0, planar=True)
    context = simulation.start(filaments, step_seconds * SECOND, seed)
    angles, deflections = np.zeros(copies), np.zeros((copies, elements))
    for points in simulation.frames(context, copies, range(_BEAM_DISCARDED, steps)):
        x, y = (points[:, -1] - points[:, elements]).T[:2]
        angles += np.arctan2(y, x) ** 2
        deflections += points[:, 1 : elements + 1, 1] ** 2
    samples = steps - _BEAM_DISCARDED
    return {
        "angle_square": simulation.groups(angles / samples, _GROUPS),
        "deflection_square": simulation.groups(deflections.T / samples, _GROUPS),
    }


def _angle_variance():
    # The angle of the last segment is that of its middle.
    return clamped_angle_variance(_LENGTH - 0.5 * _ONE, CHROMOSOME.persistence_length)


def _deflection_variances():
    # Of the nodes of the discrete chain, exact for small angles.
    node = np.arange(1, _SEGMENTS + 1)
    return clamped_deflection_variance(node * _ONE, CHROMOSOME.persistence_length) * (1.0 + 0.5 / node**2)


def _relaxation_time(viscosity_factor):
    friction = CHROMOSOME.friction(_ONE, _SEGMENTS + 1, viscosity_factor)
    return 1.0 / transverse_modes(CHROMOSOME.rigidity, friction, _ONE, _SEGMENTS, clamped=True).rates[0]


def _exponent(squares):
    nodes = np.array(_NODES)
    return np.polyfit(np.log(nodes), np.log(squares[nodes - 1]), 1)[0]


def _medium_results(medium, data):
    variance = _angle_variance()
    name = f"in_{medium}"
    ours = simulation.mean(data["angle_square"] / variance)
    results = [Result(f"angle_variance_over_(42)_{name}", "1", ours, _RULE, 1.0)]
    moments = np.stack([data["angle_square"], data["angle_fourth"]])
    ours = simulation.jackknife(lambda moment: moment[1] / moment[0] ** 2, moments)
    results.append(Result(f"fourth_moment_of_the_angle_{name}", "1", ours, _RULE, 3.0))
    exact = _deflection_variances()
    for node in _NODES:
        ours = simulation.mean(data["deflection_square"][node - 1] / MICROMETER**2)
        place = f"{node * _ONE / MICROMETER:g}_um"
        results.append(
            Result(f"deflection_variance_at_{place}_{name}", "um^2", ours, _RULE, exact[node - 1] / MICROMETER**2)
        )
    ours = simulation.jackknife(_exponent, data["deflection_square"])
    results.append(Result(f"exponent_of_the_deflection_variance_{name}", "1", ours, _RULE, _exponent(exact)))
    return results


def _beam_results(records, quick):
    data = records.measure(
        "figure-09-beams",
        fluctuating_beams,
        elements=_ELEMENTS,
        copies=_BEAM_COPIES[quick],
        steps=_BEAM_STEPS[quick],
        step_seconds=_BEAM_STEP * _relaxation_time(1.0) / SECOND,
        seed=19,
    )
    persistence, suffix = CHROMOSOME.persistence_length, f"{_ELEMENTS}_beam_elements"
    ours = simulation.mean(data["angle_square"] / clamped_angle_variance(_LENGTH, persistence))
    yield Result(f"angle_variance_over_(42)_{suffix}", "1", ours, _BEAM_RULE, 1.0)
    for node, squares in enumerate(data["deflection_square"], 1):
        place = node * _LENGTH / _ELEMENTS
        exact = clamped_deflection_variance(place, persistence) / MICROMETER**2
        name = f"deflection_variance_at_{place / MICROMETER:.3g}_um_{suffix}"
        yield Result(name, "um^2", simulation.mean(squares / MICROMETER**2), _BEAM_RULE, exact)


def _relaxation_result(medium, factor, data):
    fit = fit_relaxation_time(data["time"] * np.arange(_LAGS), data["correlation"], amplitude=1.0, blocks=_GROUPS)
    ours = Estimate(fit.time / SECOND, fit.standard_error / SECOND)
    theory = _relaxation_time(factor) / SECOND
    paper, cause = (_ESTIMATE, _cause()) if medium == "water" else (None, "")
    return Result(f"relaxation_time_in_{medium}", "s", ours, _TIME_RULE, theory, paper, cause)


def _cause():
    viscosity = in_units_of(CHROMOSOME.viscosity, VISCOSITY, "viscosity")
    coarse = 4.0 * math.pi * viscosity * _LENGTH**4 / CHROMOSOME.rigidity / SECOND
    logarithm = math.log(_LENGTH / CHROMOSOME.diameter)
    return (
        "the paper calls its time a preliminary estimate, and does not say how it was made; 4 pi eta L^4/EI is "
        f"{coarse:.2f} s, the slowest mode of a cantilever faster by 1.875^4 = {1.8751**4:.1f} times the logarithm "
        f"{logarithm:.2f} of the friction"
    )


def _persistence_result():
    ratio = CHROMOSOME.persistence_length / _LENGTH
    temperature = CHROMOSOME.temperature * ratio / 2694.1
    energy = thermal_energy(temperature) / in_units_of(1.0 * unit.piconewton * unit.nanometer, FORCE * LENGTH, "energy")
    cause = (
        f"the printed one follows from EI and L of Table II at {temperature:.1f} K, where k_B T = {energy:.3f} pN nm"
    )
    return Result("persistence_length_over_length", "1", Estimate(ratio, None), _RATIO, ratio, printed("2694.1"), cause)


def evaluate(records, quick):
    """Fig. 9."""
    results, measured = [_persistence_result()], {}
    for medium, factor in _VISCOSITIES.items():
        measured[medium] = records.measure(
            f"figure-09-{medium}",
            fluctuating_chromosome,
            viscosity_factor=factor,
            copies=_COPIES[quick],
            step_seconds=_relaxation_time(factor) / _STEPS_PER_RELAXATION / SECOND,
            seed=9 + int(factor),
        )
        results += _medium_results(medium, measured[medium])
        results.append(_relaxation_result(medium, factor, measured[medium]))
    results += _beam_results(records, quick)
    pictures = {
        "Deflections and angles of a clamped chromosome": lambda figure: _draw_fluctuations(figure, measured),
        "Relaxation of a clamped chromosome": lambda figure: _draw_relaxation(figure, measured),
    }
    return Outcome(results, pictures, _remarks())


def _remarks():
    return (
        f"A chromosome of {_LENGTH / MICROMETER:g} µm and {CHROMOSOME.diameter / MICROMETER:g} µm in {_SEGMENTS} "
        "segments, shorter than thick, which only the logarithm of the whole filament allows. It starts straight, in a "
        "plane. The angle is that of the last segment, whose middle is half a segment before the end, where (42) is "
        "taken. (43) has the factor 32/π⁴ = 0.3285, the share of the first mode, for the exact 1/3; the theory here is "
        "the latter times 1 + 1/(2 n²), exact for the n-th node of a chain. Shape and variances do not depend on the "
        "viscosity, and the relaxation time is proportional to it: in theory it is that of the slowest mode of the "
        "chain, from the friction of its segments and the stiffness of its joints.\n\n"
        f"{_ELEMENTS} beam elements have the variances of the continuous filament at their nodes and at the very "
        f"end, in steps of {_BEAM_STEP:g} relaxation times."
    )


def _draw_fluctuations(figure, measured):
    figure.set_size_inches(9.6, 3.8)
    left, right = figure.subplots(1, 2)
    place = np.arange(1, _SEGMENTS + 1) * _ONE
    theory = clamped_deflection_variance(place, CHROMOSOME.persistence_length)
    left.plot(place / MICROMETER, theory / MICROMETER**2, color=style.THEORY, label=r"$l^3/(3\,l_p)$")
    printed_factor = 96.0 / math.pi**4
    left.plot(place / MICROMETER, printed_factor * theory / MICROMETER**2, "--", color=style.PAPER, label="(43)")
    width = 0.5 * (_BINS[1] - _BINS[0])
    deviation = math.sqrt(_angle_variance())
    angle = np.linspace(-4.0, 4.0, 200)
    right.plot(
        1e3 * angle * deviation,
        np.exp(-0.5 * angle**2) / math.sqrt(2.0 * math.pi),
        color=style.THEORY,
        label="(41), (42)",
    )
    for (medium, data), colour, marker in zip(measured.items(), style.COLOURS, "os"):
        mean = simulation.mean(data["deflection_square"] / MICROMETER**2)
        left.errorbar(
            place / MICROMETER, mean.value, mean.error, fmt=marker, markersize=3, color=colour, label=f"ours, {medium}"
        )
        density = data["counts"] / data["counts"].sum() / (2.0 * width)
        right.plot(
            1e3 * deviation * (_BINS[:-1] + width), density, marker, markersize=4, color=colour, label=f"ours, {medium}"
        )
    style.finish(left, "distance from the clamp (µm)", r"$\langle\Delta y^2\rangle$ (µm²)", xscale="log", yscale="log")
    left.set_xticks([0.2, 0.5, 1, 2, 5], ["0.2", "0.5", "1", "2", "5"])
    left.set_xticks([], minor=True)
    style.finish(
        right, "angle of the end (mrad)", r"density times $\langle\Delta\theta^2\rangle^{1/2}$", ylim=(0, None)
    )


def _draw_relaxation(figure, measured):
    figure.set_size_inches(9.6, 3.8)
    left, right = figure.subplots(1, 2)
    for (medium, data), colour, marker in zip(measured.items(), style.COLOURS, "os"):
        tau = _relaxation_time(_VISCOSITIES[medium])
        time = data["time"] * np.arange(len(data["trace"])) / tau
        shift = 80.0 if medium == "cell" else 0.0
        label = f"{medium}, τ = {1e3 * tau / SECOND:.3g} ms" + (f", shifted by {shift:g} mrad" if shift else "")
        left.plot(time, 1e3 * data["trace"] + shift, color=colour, linewidth=0.8, label=label)
        left.axhline(shift, color="gray", linewidth=0.5)
        copies = data["correlation"] / data["correlation"][0].mean()
        mean = simulation.mean(copies)
        lags = data["time"] * np.arange(_LAGS) / tau
        right.errorbar(lags, mean.value, mean.error, fmt=marker, markersize=4, color=colour, label=f"ours, {medium}")
    right.plot(lags, np.exp(-lags), color=style.THEORY, label=r"$\exp(-t/\tau)$, slowest mode")
    style.finish(left, "time / τ", "angle of the end (mrad)", xlim=(0, _AVERAGED), ylim=(-80, 200))
    style.finish(right, "time / τ", "correlation of the slowest mode", xlim=(0, None), ylim=(0, None))


CASES = (Case("figure-09", "Fig. 9: fluctuations of a clamped chromosome", (9,), evaluate),)
