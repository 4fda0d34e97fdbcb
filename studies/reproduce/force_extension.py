"""Figs. 13 and 14: extension of a filament of 64 segments under tension.

Filaments start straight along the force, as in the paper (Fig. 12), in a solvent of a tenth of the viscosity. Fitted
numbers are compared with the same fits to the exact extensions of the discrete chain.
"""

import math

import numpy as np

from openmm_cylchain.couplings.pulling import constant_tension
from openmm_cylchain.theory import (
    chain_extension,
    crossover_force,
    effective_spring_constant,
    limiting_spring_constant,
    linear_force,
    marko_siggia_extension,
    marko_siggia_spring_constant,
)
from openmm_cylchain.time_steps.recommended_step import recommended_time_step

from . import simulation, style
from .case import Case, Outcome
from .result import Estimate, Result, Rule, printed
from .table_2 import (
    ACTIN,
    MICROSECOND,
    PERSISTENCE_LENGTH,
    PICONEWTON,
    SOLVENT_TEMPERATURE,
    SOLVENT_VISCOSITY,
    actin_friction,
)

_SEGMENTS = 64
_CONTOUR = _SEGMENTS * ACTIN.segment_length
_VISCOSITY_FACTOR = 0.1
_LARGEST_FITTED_EXTENSION = 0.99
_WEAK, _STRONG = 1.0, 100.0
_LIMIT = limiting_spring_constant(ACTIN.segment_stiffness, _SEGMENTS)
_FRAMES = 200
_SHORTEST_RUN = 20 * _FRAMES
_SLACK_RULE = Rule(3.0, 0.01, 0.06)
_LENGTH_RULE = Rule(3.0, 0.02, 0.05)
_EXPONENT_RULE = Rule(3.0, 0.005, 0.02)
_SPRING_RULE = Rule(3.0, 0.002, 0.01)
_CROSSOVER_RULE = Rule(3.0, 0.02, 0.05)
_CAUSE = "it depends on which forces below 1 pN are fitted, and with which weights, which the paper does not say"
_QUICK_FORCES = (0.02, 0.08, 0.32, 0.9, 3.0, 10.0, 20.0, 40.0, 160.0, 1000.0)
_FORCES = (0.01, 0.02, 0.04, 0.08, 0.16, 0.32, 0.64, 1.28, 2.5, 5.0, 8.0, 12.0, 16.0, 20.0, 30.0, 50.0)
_FORCES += (100.1, 200.0, 400.0, 1000.0)


def pulled_filaments(force, chains, step_microseconds, discarded, frames, stride, seed):
    """Mean extensions of filaments that are pulled by a force in pN.

    Returns
    -------
    dict of arrays
        ``extension`` of each filament in nm, and its standard deviation in time, ``fluctuation``.
    """
    filaments = simulation.solvent(_VISCOSITY_FACTOR)
    for _ in range(chains):
        filaments.add_straight(simulation.ACTIN, _SEGMENTS, [0, 0, 0], [1, 0, 0])
    _, system, positions = filaments.build()
    system.addForce(constant_tension(filaments, force * PICONEWTON, [1, 0, 0]))
    context = simulation.start(filaments, step_microseconds * MICROSECOND, seed, system, positions)
    steps = discarded + stride * np.arange(frames)
    extensions = [nodes[:, -1, 0] - nodes[:, 0, 0] for nodes in simulation.frames(context, chains, steps)]
    return {"extension": np.mean(extensions, axis=0), "fluctuation": np.std(extensions, axis=0)}


def _slowest_relaxation(force):
    # Of the transverse mode with a wave length of twice the filament, in ps.
    friction = _VISCOSITY_FACTOR * actin_friction().perpendicular / ACTIN.segment_length
    wave_number = math.pi / _CONTOUR
    return friction / (ACTIN.bending_rigidity * wave_number**4 + force * PICONEWTON * wave_number**2)


def _settings(force, quick):
    step = recommended_time_step(
        ACTIN, _VISCOSITY_FACTOR * SOLVENT_VISCOSITY, SOLVENT_TEMPERATURE, "implicit", _SEGMENTS
    ).step
    relaxation = _slowest_relaxation(force) / step
    steps = max(_SHORTEST_RUN, (6 if quick else 25) * relaxation)
    return {
        "force": force,
        "chains": 12 if quick else 48,
        "step_microseconds": step / MICROSECOND,
        "discarded": int(max(_SHORTEST_RUN // 5, 5 * relaxation)),
        "frames": _FRAMES,
        "stride": int(steps / _FRAMES),
        "seed": 13,
    }


def fitted_persistence_length(extensions, forces):
    """Persistence length in nm from a fit of eq. (34) where the relative extension is below 0.99.

    The paper does not say how points are weighted; here each has the same weight in the logarithm of 1 - <R.e>/L.

    Parameters
    ----------
    extensions : (forces,) array in nm
    forces : (forces,) array in kJ/(mol nm)
    """
    from scipy.optimize import minimize_scalar

    fitted = extensions < _LARGEST_FITTED_EXTENSION * _CONTOUR
    slack = np.log1p(-extensions[fitted] / _CONTOUR)

    def misfit(logarithm):
        model = marko_siggia_extension(forces[fitted], math.exp(logarithm), SOLVENT_TEMPERATURE)
        return float(np.sum((np.log1p(-model) - slack) ** 2))

    centre = math.log(PERSISTENCE_LENGTH)
    best = minimize_scalar(misfit, bounds=(centre - 2.0, centre + 2.0), method="bounded", options={"xatol": 1e-7})
    return math.exp(best.x)


def fitted_power_law(extensions, forces):
    """(exponent, prefactor) of eq. (38), k_eff ~ F^exponent, from a fit of logarithms below 1 pN."""
    fitted = forces < _WEAK * PICONEWTON
    springs = forces[fitted] / (_CONTOUR - extensions[fitted])
    exponent, logarithm = np.polyfit(np.log(forces[fitted]), np.log(springs), 1)
    return float(exponent), float(np.exp(logarithm))


def fitted_limit(extensions, forces):
    """k_eff above 100 pN in kJ/(mol nm^2), each force weighted as if all extensions had the same error."""
    fitted = forces > _STRONG * PICONEWTON
    excess = extensions[fitted] - _CONTOUR
    springs = forces[fitted] / excess
    return float(np.average(springs, weights=(excess / springs) ** 2))


def fitted_crossover(extensions, forces):
    """Force in kJ/(mol nm) at which the power law meets the limit."""
    exponent, prefactor = fitted_power_law(extensions, forces)
    return (fitted_limit(extensions, forces) / prefactor) ** (1.0 / exponent)


def _fits():
    # name, unit, what is fitted, its unit in OpenMM's, rule, what is printed.
    return (
        ("persistence_length", "um", fitted_persistence_length, 1e3, _LENGTH_RULE, printed("16.38", "0.77")),
        (
            "spring_constant_exponent",
            "1",
            lambda *data: fitted_power_law(*data)[0],
            1.0,
            _EXPONENT_RULE,
            printed("1.534", "0.0074"),
        ),
        ("limiting_spring_constant", "k/N", fitted_limit, _LIMIT, _SPRING_RULE, printed("1.0004", "0.0038")),
        ("crossover_force", "pN", fitted_crossover, PICONEWTON, _CROSSOVER_RULE, printed("23.93", "0.55")),
    )


def evaluate(records, quick):
    """Extensions against the exact ones, and the four numbers that the paper fits."""
    newtons = _QUICK_FORCES if quick else _FORCES
    forces = np.array(newtons) * PICONEWTON
    runs = [
        records.measure(f"figure-13-14-{force:g}-pN", pulled_filaments, **_settings(force, quick)) for force in newtons
    ]
    copies = np.array([run["extension"] for run in runs])
    measured = simulation.mean(copies)
    exact = chain_extension(ACTIN, _SEGMENTS, forces, SOLVENT_TEMPERATURE)
    results = []
    for name, unit, fit, scale, rule, paper in _fits():
        ours = simulation.jackknife(lambda mean, fit=fit: fit(mean, forces), copies)
        theory = fit(exact, forces) / scale
        estimate = Estimate(ours.value / scale, ours.error / scale)
        results.append(Result(name, unit, estimate, rule, theory, paper, _CAUSE))
    for newton, value, error, expected in zip(newtons, measured.value, measured.error, exact):
        if newton <= 3.0 or newton > _STRONG:
            ours = Estimate(float(abs(value - _CONTOUR)), float(error))
            results.append(
                Result(f"length_difference_at_{newton:g}_pN", "nm", ours, _SLACK_RULE, float(abs(expected - _CONTOUR)))
            )
    fluctuation = np.array([run["fluctuation"].mean() for run in runs])
    pictures = {
        "Force against extension": lambda figure: _draw_extension(figure, newtons, measured, fluctuation, results),
        "Effective spring constant": lambda figure: _draw_spring(figure, newtons, measured, results),
    }
    remarks = (
        "Theory is the same fit to the exact extensions of the discrete chain at the same forces: eq. (34) leaves out "
        "stretching, so that its fit gives more than the persistence length of the model, the more the stronger the "
        "forces. The paper does not list its forces. The asymptotes (37) and (38) themselves cross at "
        f"{_asymptotic_crossover():.2f} pN."
    )
    return Outcome(results, pictures, remarks)


def _asymptotic_crossover():
    arguments = (_CONTOUR, PERSISTENCE_LENGTH, ACTIN.segment_stiffness, _SEGMENTS, SOLVENT_TEMPERATURE)
    return crossover_force(*arguments) / PICONEWTON


def _draw_extension(figure, newtons, measured, fluctuation, results):
    axis = figure.subplots()
    curve = np.geomspace(0.5 * newtons[0], 1.5 * newtons[-1], 50) * PICONEWTON
    relative = chain_extension(ACTIN, _SEGMENTS, curve, SOLVENT_TEMPERATURE) / _CONTOUR
    axis.plot(relative, curve / PICONEWTON, color=style.THEORY, label="exact, discrete chain")
    worm = marko_siggia_extension(curve, PERSISTENCE_LENGTH, SOLVENT_TEMPERATURE)
    axis.plot(worm, curve / PICONEWTON, "--", color="gray", label=r"eq. (34), $\ell_\mathrm{p}$ = 17.2 µm")
    worm = marko_siggia_extension(curve, 16380.0, SOLVENT_TEMPERATURE)
    axis.plot(worm, curve / PICONEWTON, ":", color=style.PAPER, label=r"eq. (34), fit of the paper, 16.38 µm")
    spring = np.linspace(1.0001, 1.08, 400) * _CONTOUR
    force = linear_force(spring, _CONTOUR, ACTIN.segment_stiffness, _SEGMENTS)
    axis.plot(spring / _CONTOUR, force / PICONEWTON, "-.", color=style.COLOURS[1], label="eq. (35), springs")
    axis.errorbar(
        measured.value / _CONTOUR,
        newtons,
        xerr=fluctuation / _CONTOUR,
        fmt="o",
        markersize=3.5,
        capsize=2,
        color=style.OURS,
        label="ours, bars: fluctuations",
    )
    axis.axvline(1.0, color="black", linewidth=0.8)
    axis.axvline(_LARGEST_FITTED_EXTENSION, color="black", linewidth=0.8, linestyle=":", label="fitted to the left")
    style.finish(
        axis,
        r"relative extension $\langle R\cdot e\rangle/L$",
        "force (pN)",
        yscale="log",
        xlim=(0.9, 1.08),
        ylim=(0.7 * newtons[0], 1.5 * newtons[-1]),
    )


def _draw_spring(figure, newtons, measured, results):
    axis = figure.subplots()
    forces = np.array(newtons) * PICONEWTON
    curve = np.geomspace(0.5 * newtons[0], 2 * newtons[-1], 400) * PICONEWTON
    exact = chain_extension(ACTIN, _SEGMENTS, curve, SOLVENT_TEMPERATURE)
    spring = effective_spring_constant(curve, exact, _CONTOUR) / _LIMIT
    axis.plot(curve / PICONEWTON, spring, color=style.THEORY, label="exact, discrete chain")
    weak = marko_siggia_spring_constant(curve, _CONTOUR, PERSISTENCE_LENGTH, SOLVENT_TEMPERATURE) / _LIMIT
    axis.plot(curve / PICONEWTON, weak, "--", color="gray", label="eq. (38), weak forces")
    axis.axhline(1.0, color="gray", linestyle="-.", label="eq. (37), springs")
    values = effective_spring_constant(forces, measured.value, _CONTOUR) / _LIMIT
    errors = values * measured.error / np.abs(measured.value - _CONTOUR)
    axis.errorbar(newtons, values, errors, fmt="o", markersize=3.5, capsize=2, color=style.OURS, label="ours")
    axis.axvline(23.93, color=style.PAPER, linestyle=":", label="crossover of the paper")
    crossover = next(result for result in results if result.name == "crossover_force").ours.value
    axis.axvline(crossover, color=style.OURS, linestyle=":", label="ours, crossover")
    style.finish(
        axis,
        "force (pN)",
        r"effective spring constant $k_\mathrm{eff}/k_0$",
        xscale="log",
        yscale="log",
        ylim=(1e-6 if newtons[0] < 0.05 else 1e-4, 1e2),
    )


CASES = (Case("figure-13-14", "Figs. 12 to 14: a filament under tension", (12, 13, 14), evaluate),)
