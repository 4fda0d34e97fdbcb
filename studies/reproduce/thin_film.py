"""Fig. 10 of Chandran and Mofrad 2009: F-actin that moves freely in a plane, and how its bending modes relax."""

import math

import numpy as np

from benchmark.measurement import scaled
from openmm_cylchain.analysis.statistics import fit_relaxation_time
from openmm_cylchain.beams.curve import element_slopes
from openmm_cylchain.theory import (
    bending_mode_variance,
    chain_mean_square_end_to_end,
    chain_planar_bending_mode_variance,
    chain_tangent_correlation,
    wlc_mean_square_end_to_end,
    wlc_tangent_correlation,
)
from openmm_cylchain.time_steps.recommended_step import recommended_time_step

from . import rods_on_string, simulation, style
from .case import Case, Outcome
from .result import ROUNDING, Estimate, Result, Rule, printed
from .rods_on_string import ACTIN, MICROMETER, SECOND
from .transverse_modes import transverse_modes

_LENGTH, _SEGMENTS = 15.5 * MICROMETER, 62
_ONE = _LENGTH / _SEGMENTS
_FRAME_SECONDS = 0.02
_FRAMES = {True: 400, False: 800}
_DISCARDED = {True: 60, False: 120}
_COPIES = {True: 128, False: 256}
_GROUPS = 16
_MODES = np.arange(1, 16)
_SHAPES, _SHAPE_STRIDE = 6, 75
"""Frames 1.5 s apart, as in the paper."""
_LAGS = {1: np.arange(0, 200, 8), 2: np.arange(0, 46, 2)}
_COMPARED_MODES = (1, 2, 3, 5, 10)
_COMPARED_SEGMENTS = (10, 20, 40)
_SQUARE_RULE = Rule(3.0, 0.002, 0.02)
_CORRELATION_RULE = Rule(3.0, 0.002, 0.03)
_MODE_RULE = Rule(3.0, 0.02, 0.15)
_TIME_RULE = Rule(3.0, 0.03, 0.15)
_PAPER_SECONDS = 80.0
_ELEMENTS = 12
_BEAM_MODES = np.arange(1, 6)
_BEAM_COPIES, _BEAM_FRAMES = {True: 512, False: 2048}, {True: 20, False: 80}
_BEAM_FRAME_SECONDS = 0.1
_BEAM_SQUARE_RULE = Rule(3.0, 0.002, 0.01)
_BEAM_MODE_RULE = Rule(3.0, 0.01, 0.05)


def filaments_in_a_thin_film(copies, step_microseconds, stride, discarded, frames, seed):
    """Free filaments in a plane that start from equilibrium.

    Returns
    -------
    dict of arrays
        ``square``, the squared end-to-end distance in nm^2 (groups,); ``correlation`` of tangents (segments, groups);
        ``modes``, the squared amplitudes of ``_MODES`` in nm (modes, groups); ``correlation_1`` and ``correlation_2``
        of the amplitudes of modes 1 and 2 at ``_LAGS`` (lags, groups); ``shapes`` (shapes, nodes, 2) of one filament in
        nm.
    """
    column = rods_on_string.SIMULATED_ACTIN
    filaments = column.solvent()
    for number in range(copies):
        filaments.add_equilibrium(column.filament_type(_ONE), _SEGMENTS, 1000 * seed + number, planar=True)
    context = simulation.start(filaments, 1e6 * step_microseconds, seed)
    cosines = np.cos(np.outer(_MODES, np.pi * (np.arange(_SEGMENTS) + 0.5) / _SEGMENTS))
    squares, correlations, amplitudes, shapes = [], [], [], []
    for nodes in simulation.frames(context, copies, range(discarded * stride, (discarded + frames) * stride, stride)):
        angles = _angles(nodes)
        squares.append(np.sum((nodes[:, -1] - nodes[:, 0]) ** 2, axis=1))
        correlations.append([_mean_cosine(angles, lag) for lag in range(_SEGMENTS)])
        amplitudes.append(math.sqrt(2.0 / _LENGTH) * _ONE * angles @ cosines.T)
        shapes.append(nodes[0, :, :2])
    amplitudes = np.array(amplitudes)
    return {
        "square": simulation.groups(np.mean(squares, axis=0), _GROUPS),
        "correlation": simulation.groups(np.mean(correlations, axis=0), _GROUPS),
        "modes": simulation.groups(np.mean(amplitudes**2, axis=0).T, _GROUPS),
        "correlation_1": simulation.groups(_lagged(amplitudes[..., 0], _LAGS[1]), _GROUPS),
        "correlation_2": simulation.groups(_lagged(amplitudes[..., 1], _LAGS[2]), _GROUPS),
        "shapes": shapes[::_SHAPE_STRIDE][:_SHAPES],
    }


def beams_in_a_thin_film(elements, copies, step_microseconds, stride, frames, seed):
    """Free filaments of beam elements in a plane that start from equilibrium.

    Returns
    -------
    dict of arrays
        ``square`` in nm^2 (groups,), and ``modes`` in nm, those of ``_BEAM_MODES`` (modes, groups), as those of
        ``filaments_in_a_thin_film``, with the angle of the curve at four Gauss points of each element.
    """
    column = rods_on_string.SIMULATED_ACTIN
    filaments = column.solvent()
    one = _LENGTH / elements
    for number in range(copies):
        filaments.add_equilibrium(
            column.filament_type(one, element="beam"), elements, 1000 * seed + number, planar=True
        )
    context = simulation.start(filaments, 1e6 * step_microseconds, seed)
    gauss, weights = np.polynomial.legendre.leggauss(4)
    places = 0.5 * (1.0 + gauss)
    along = (np.arange(elements)[:, None] + places).ravel() / elements
    cosines = np.cos(np.outer(_BEAM_MODES, np.pi * along)) * np.tile(0.5 * one * weights, elements)
    squares, variances = np.zeros(copies), np.zeros((copies, len(_BEAM_MODES)))
    for points in simulation.frames(context, copies, range(0, frames * stride, stride)):
        nodes, control_points = points[:, : elements + 1], points[:, elements + 1 :]
        slopes = element_slopes(nodes, control_points, places, one).reshape(copies, -1, 3)
        angles = np.unwrap(np.arctan2(slopes[..., 1], slopes[..., 0]), axis=1)
        squares += np.sum((nodes[:, -1] - nodes[:, 0]) ** 2, axis=1)
        variances += 2.0 / _LENGTH * (angles @ cosines.T) ** 2
    return {
        "square": simulation.groups(squares / frames, _GROUPS),
        "modes": simulation.groups(variances.T / frames, _GROUPS),
    }


def _angles(nodes):
    # Of the segments, continuous along the chain.
    vectors = np.diff(nodes[..., :2], axis=1)
    return np.unwrap(np.arctan2(vectors[..., 1], vectors[..., 0]), axis=1)


def _mean_cosine(angles, lag):
    return np.mean(np.cos(angles[:, lag:] - angles[:, : _SEGMENTS - lag]), axis=1)


def _lagged(series, lags):
    return [np.mean(series[: len(series) - lag] * series[lag:], axis=0) for lag in lags]


def _modes_of_the_rod():
    return transverse_modes(ACTIN.rigidity, ACTIN.friction(_ONE, _SEGMENTS), _ONE, _SEGMENTS)


def _mode_correlation(mode, time):
    # Of an amplitude of (45) for small deflections: it is no mode of a free rod, but nearly one.
    cosines = np.cos(mode * np.pi * (np.arange(_SEGMENTS) + 0.5) / _SEGMENTS)
    weights = np.diff(np.eye(_SEGMENTS + 1), axis=0).T @ cosines
    return _modes_of_the_rod().autocorrelation(weights, time)


def _fitted(correlation, lags):
    time = _FRAME_SECONDS * np.asarray(lags)
    fit = fit_relaxation_time(time, correlation, amplitude=1.0, fit_above=0.2, blocks=_GROUPS)
    return Estimate(fit.time, fit.standard_error)


def _measured(records, quick):
    kind = ACTIN.filament_type(_ONE)
    longest = recommended_time_step(kind, ACTIN.solvent().viscosity, ACTIN.temperature, "implicit", _SEGMENTS).step
    stride = math.ceil(_FRAME_SECONDS * SECOND / longest)
    return records.measure(
        "figure-10",
        filaments_in_a_thin_film,
        copies=_COPIES[quick],
        step_microseconds=1e6 * _FRAME_SECONDS / stride,
        stride=stride,
        discarded=_DISCARDED[quick],
        frames=_FRAMES[quick],
        seed=10,
    )


def _scaled(copies, scale=1.0):
    return scaled(simulation.mean(copies), 1.0 / scale)


def _shape_results(data):
    kind, temperature = ACTIN.filament_type(_ONE), ACTIN.temperature
    wormlike = wlc_mean_square_end_to_end(_LENGTH, 17.7 * MICROMETER, planar=True) / MICROMETER**2
    yield Result("end_to_end_square_(44)", "um^2", Estimate(wormlike, None), ROUNDING, wormlike, printed("208.7"))
    exact = chain_mean_square_end_to_end(kind, _SEGMENTS, temperature, planar=True) / MICROMETER**2
    ours = _scaled(data["square"], MICROMETER**2)
    yield Result("end_to_end_square", "um^2", ours, _SQUARE_RULE, exact, printed("210.7"), _square_cause(exact))
    for lag in _COMPARED_SEGMENTS:
        exact = chain_tangent_correlation(kind, lag, temperature, planar=True)
        ours = _scaled(data["correlation"][lag])
        yield Result(f"tangent_correlation_at_{lag * _ONE / MICROMETER:g}_um", "1", ours, _CORRELATION_RULE, exact)
    for mode in _COMPARED_MODES:
        exact = chain_planar_bending_mode_variance(kind, _SEGMENTS, mode, temperature) / MICROMETER
        ours = _scaled(data["modes"][mode - 1], MICROMETER)
        yield Result(f"variance_of_bending_mode_{mode}", "um", ours, _MODE_RULE, float(exact))


def _beam_results(records, quick):
    kind = ACTIN.filament_type(_LENGTH / _ELEMENTS, element="beam")
    longest = recommended_time_step(kind, ACTIN.solvent().viscosity, ACTIN.temperature, "implicit", _ELEMENTS).step
    stride = math.ceil(_BEAM_FRAME_SECONDS * SECOND / longest)
    data = records.measure(
        "figure-10-beams",
        beams_in_a_thin_film,
        elements=_ELEMENTS,
        copies=_BEAM_COPIES[quick],
        step_microseconds=1e6 * _BEAM_FRAME_SECONDS / stride,
        stride=stride,
        frames=_BEAM_FRAMES[quick],
        seed=20,
    )
    persistence, suffix = ACTIN.persistence_length, f"{_ELEMENTS}_beam_elements"
    exact = wlc_mean_square_end_to_end(_LENGTH, persistence, planar=True) / MICROMETER**2
    ours = _scaled(data["square"], MICROMETER**2)
    yield Result(f"end_to_end_square_{suffix}", "um^2", ours, _BEAM_SQUARE_RULE, exact)
    for mode, copies in zip(_BEAM_MODES, data["modes"]):
        exact = bending_mode_variance(mode, _LENGTH, persistence) / MICROMETER
        ours = _scaled(copies, MICROMETER)
        yield Result(f"variance_of_bending_mode_{mode}_{suffix}", "um", ours, _BEAM_MODE_RULE, float(exact))


def _square_cause(exact):
    # The first mode alone: R^2 = L^2 - c a^2 with a normal amplitude a, whose square relaxes twice as fast as a.
    missing = (_LENGTH / MICROMETER) ** 2 - exact
    independent = _PAPER_SECONDS / (1.0 / _modes_of_the_rod().rates[0] / SECOND)
    return f"the paper averages one filament for 80 s, to about {math.sqrt(2.0 / independent) * missing:.1f} um^2"


def _time_results(data):
    for mode, lags in _LAGS.items():
        theory = _fitted(_mode_correlation(mode, _FRAME_SECONDS * SECOND * lags)[:, None], lags).value
        ours = _fitted(data[f"correlation_{mode}"], lags)
        paper, cause = (printed("15"), _time_cause()) if mode == 1 else (None, "")
        yield Result(f"relaxation_time_of_bending_mode_{mode}", "s", ours, _TIME_RULE, theory, paper, cause)


def _time_cause():
    friction = ACTIN.friction(_ONE, _SEGMENTS)
    sine = friction.perpendicular / _ONE * (_LENGTH / math.pi) ** 4 / ACTIN.rigidity / SECOND
    return (
        "the paper says about 15 s, and not where it comes from; with cos(pi l/L) for the shape of the first mode it "
        f"would be gamma (L/pi)^4/EI = {sine:.0f} s, but free ends make it (pi/4.730)^4 = "
        f"{(math.pi / 4.730) ** 4:.3f} of that"
    )


def evaluate(records, quick):
    """Fig. 10."""
    data = _measured(records, quick)
    results = [*_shape_results(data), *_time_results(data), *_beam_results(records, quick)]
    pictures = {
        "An actin filament in a thin film": lambda figure: _draw_shapes(figure, data["shapes"]),
        "Correlation of tangents and variance of bending modes": lambda figure: _draw_statics(figure, data),
        "Relaxation of bending modes": lambda figure: _draw_relaxation(figure, data),
    }
    return Outcome(results, pictures, _remarks(quick))


def _remarks(quick):
    kind = ACTIN.filament_type(_ONE)
    discrete = chain_planar_bending_mode_variance(kind, _SEGMENTS, 10, ACTIN.temperature)
    share = discrete / bending_mode_variance(10, _LENGTH, ACTIN.persistence_length)
    return (
        f"{_COPIES[quick]} filaments in a plane start from equilibrium and move for "
        f"{_FRAME_SECONDS * (_DISCARDED[quick] + _FRAMES[quick]):.3g} s each, of which the last "
        f"{_FRAME_SECONDS * _FRAMES[quick]:.3g} s are averaged; the paper has one for 80 s. The theory is that of the "
        "discrete chain, exact for ⟨R²⟩, the correlation of tangents and the variances of bending modes, whatever the "
        f"angles (mode 10 has {share:.3f} times the variance (46) of the continuous filament). Relaxation times are "
        "fits to the correlation of the amplitudes of (45), the theory the same fit to the correlation that the chain "
        "has for small deflections: its modes are not quite the cosines of (45). This theory is not exact for a "
        "filament as long as its persistence length, and its rule allows for that.\n\n"
        f"{_ELEMENTS} beam elements are compared with the continuous filament, (44) and (46): {_BEAM_COPIES[quick]} "
        f"filaments for {_BEAM_FRAME_SECONDS * (_BEAM_FRAMES[quick] - 1):.3g} s each, from the first step on."
    )


def _draw_shapes(figure, shapes):
    figure.set_size_inches(6.4, 3.6)
    axis = figure.subplots()
    for number, shape in enumerate(shapes):
        middle = shape - shape.mean(axis=0)
        turned = middle @ np.linalg.svd(middle, full_matrices=False)[2].T / MICROMETER
        row, column = divmod(number, 2)
        x, y = 19.0 * column, -5.5 * row
        axis.plot(turned[:, 0] + x, turned[:, 1] + y, color=style.OURS, linewidth=2)
        seconds = number * _SHAPE_STRIDE * _FRAME_SECONDS
        axis.text(x - 8.5, y + 2.0, f"{seconds:g} s", fontsize=9, color="0.35")
    axis.plot([22, 27], [-14.5, -14.5], color="black", linewidth=3)
    axis.text(24.5, -14.9, "5 µm", ha="center", va="top", fontsize=9)
    axis.set(aspect="equal", xlim=(-9.5, 28), ylim=(-16.5, 4))
    axis.set_axis_off()


def _draw_statics(figure, data):
    figure.set_size_inches(9.6, 3.8)
    left, right = figure.subplots(1, 2)
    distance = np.arange(_SEGMENTS) * _ONE
    mean = simulation.mean(data["correlation"])
    every = slice(0, None, 4)
    left.errorbar(
        distance[every] / MICROMETER,
        mean.value[every],
        mean.error[every],
        fmt="o",
        markersize=4,
        color=style.OURS,
        label="ours",
    )
    theory = wlc_tangent_correlation(distance, ACTIN.persistence_length, planar=True)
    left.plot(distance / MICROMETER, theory, color=style.THEORY, label="(4)")
    mean = simulation.mean(data["modes"] / MICROMETER)
    right.errorbar(_MODES, mean.value, mean.error, fmt="o", markersize=4, color=style.OURS, label="ours")
    exact = chain_planar_bending_mode_variance(ACTIN.filament_type(_ONE), _SEGMENTS, _MODES, ACTIN.temperature)
    right.plot(_MODES, exact / MICROMETER, "+", markersize=9, color=style.COLOURS[1], label="discrete chain")
    wormlike = bending_mode_variance(_MODES, _LENGTH, ACTIN.persistence_length)
    right.plot(_MODES, wormlike / MICROMETER, color=style.THEORY, linewidth=1, label="(46)")
    style.finish(left, "distance along the filament (µm)", r"$\langle\cos\Delta\theta\rangle$", ylim=(0.6, 1.02))
    style.finish(right, "mode n", r"$\langle a_n^2\rangle$ (µm)", xscale="log", yscale="log")
    right.set_xticks([1, 2, 5, 10, 15], ["1", "2", "5", "10", "15"])
    right.set_xticks([], minor=True)


def _draw_relaxation(figure, data):
    axis = figure.subplots()
    for (mode, lags), colour, marker in zip(_LAGS.items(), style.COLOURS, "os"):
        time = _FRAME_SECONDS * lags
        correlation = data[f"correlation_{mode}"]
        mean = simulation.mean(correlation / correlation[0].mean())
        axis.errorbar(time, mean.value, mean.error, fmt=marker, markersize=4, color=colour, label=f"ours, mode {mode}")
        fine = np.linspace(0.0, time[-1], 200)
        theory = _mode_correlation(mode, fine * SECOND)
        axis.plot(fine, theory, color=colour, linewidth=1, label=f"small deflections, mode {mode}")
    style.finish(axis, "time (s)", "correlation of the amplitude", xlim=(0, None), ylim=(0, None))


CASES = (Case("figure-10", "Fig. 10: F-actin that moves freely in a plane", (10,), evaluate),)
