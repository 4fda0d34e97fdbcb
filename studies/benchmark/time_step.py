"""How large a step may be: equilibrium, dynamics and speed against the step, for every scheme.

A step is large enough to be useful as long as it is right. The criterion is that of Panja et al., Phys. Rev. E 2017
(equilibrium within 5 %, dynamics within 10 %), also applied with 2 % and 5 %. Chains start in their exact equilibrium.

Equilibrium: the mean energies of stretching and bending against the exact ones, and the mean square end-to-end
distance against that of the same chains at the start. The first quarter of a run is left out of the means. A step that
is taken in parts more often than once in a thousand is too large, whatever the means.

Dynamics: how much of its correlation the end-to-end vector has lost after a lag, the same of the direction of the
segments in the middle quarter of a chain, and the mean square displacement of the nodes there, at lags of 10 and 20
steps, where the step matters most. They are compared with those of scheme "implicit" with a tenth of the step.
"""

import math
import time
from dataclasses import dataclass

import numpy as np

from openmm_cylchain import Filaments
from openmm_cylchain.engine_choice import choose_engine
from openmm_cylchain.errors import InstabilityError
from openmm_cylchain.theory import bending_energy_mean, stretching_energy_mean
from openmm_cylchain.time_steps.recommended_step import recommended_time_step
from openmm_cylchain.time_steps.schemes import CYLINDER_SCHEMES, EXPLICIT_SCHEMES
from openmm_cylchain.time_steps.stability import stability_bounds
from openmm_cylchain.time_steps.step_watch import LARGEST_DIVIDED_SHARE
from openmm_cylchain.units.text import format_time

from .measurement import Case, Estimate, describe_machine, median, ratio, scaled, time_interleaved
from .report import Report, row
from .systems import one_thread_context, one_thread_platform, simulate_beads
from .time_step_systems import F_ACTIN_SYSTEM, SYSTEMS, WORKLOAD

STEPS_PER_FRAME = 10
REFERENCE_FACTOR = 10
CRITERIA = {"": (0.05, 0.10), "_tight": (0.02, 0.05)}
"""Largest errors of equilibrium and of dynamics."""

_LADDER = (1.0, 2.0, 5.0)
_MICROSECOND = 1e6
_DYNAMICS = ("end-to-end vector", "orientation", "displacement")


@dataclass(frozen=True)
class Effort:
    """How much is measured.

    Attributes
    ----------
    systems : sequence of BenchmarkSystem
    frames : int
        Of ten steps each.
    share : float
        Of the chains of each system.
    every : int
        Which steps of the ladder 1, 2, 5 … are taken; three of them are a factor of ten.
    repetitions : int
        Of the final timing.
    """

    systems: tuple
    frames: int
    share: float
    every: int
    repetitions: int


FULL = Effort(SYSTEMS, frames=240, share=1.0, every=1, repetitions=9)
QUICK = Effort((F_ACTIN_SYSTEM,), frames=80, share=0.5, every=3, repetitions=3)


@dataclass(frozen=True)
class StepErrors:
    """What a step of a scheme does to a system.

    Attributes
    ----------
    scheme : str
    step : float
        In ps.
    equilibrium, dynamics : dict
        Relative errors by observable, as Estimates; infinite where the run has blown up. Dynamics is empty if there
        is no finer run to compare with.
    seconds_per_step : Estimate
    divided : float
        The share of steps of chains that were taken in parts.
    """

    scheme: str
    step: float
    equilibrium: dict
    dynamics: dict
    seconds_per_step: Estimate
    divided: float = 0.0

    def passes(self, equilibrium, dynamics):
        """Whether no error exceeds what is allowed; without a finer run to compare with, equilibrium alone."""
        if self.divided > LARGEST_DIVIDED_SHARE:
            return False
        return _largest(self.equilibrium) <= equilibrium and _largest(self.dynamics) <= dynamics

    def surely_fails(self, equilibrium, dynamics):
        """Whether an error exceeds what is allowed by more than twice its standard error, or steps were divided."""
        if self.divided > LARGEST_DIVIDED_SHARE:
            return True
        allowed = [(error, equilibrium) for error in self.equilibrium.values()]
        allowed += [(error, dynamics) for error in self.dynamics.values()]
        return any(abs(error.value) > limit + 2.0 * (error.error or 0.0) for error, limit in allowed)

    @property
    def largest_equilibrium_error(self):
        """The largest of the equilibrium errors."""
        return _largest(self.equilibrium)

    @property
    def largest_dynamic_error(self):
        """The largest of the dynamic errors."""
        return _largest(self.dynamics)


def _largest(errors):
    return max((abs(error.value) for error in errors.values()), default=0.0)


@dataclass(frozen=True)
class SystemErrors:
    """The errors of all steps of all schemes for a system, and the step that is recommended for scheme "implicit"."""

    system: object
    steps: list
    recommended: float

    def of_scheme(self, scheme):
        """Those of a scheme, by step."""
        return sorted((one for one in self.steps if one.scheme == scheme), key=lambda one: one.step)

    def largest_step(self, scheme, equilibrium, dynamics):
        """The StepErrors of the largest step that passes, below the first that surely fails, or None."""
        largest = None
        for one in self.of_scheme(scheme):
            if one.surely_fails(equilibrium, dynamics):
                break
            if one.passes(equilibrium, dynamics):
                largest = one
        return largest


def benchmark_time_step(effort=FULL, say=lambda message: None):
    """Measure errors and speed against the step.

    Parameters
    ----------
    effort : Effort
    say : callable (str), optional
        Told how far it is.

    Returns
    -------
    report : Report
    results : list of SystemErrors
        For ``time_step_figure.write_figure``.

    Raises
    ------
    InputError
        If there is no compiled engine, which has the scheme "implicit".
    """
    choose_engine("compiled")
    machine = describe_machine()
    results = [measure_system(system, effort, say) for system in effort.systems]
    rows, missing = largest_step_rows(results)
    rows += _speed_rows(results[0], effort, say, missing)
    details = [each for result in results for each in _error_rows(result)]
    settings = {
        "systems": {result.system.name: result.system.label for result in results},
        "recommended_steps_ps": {result.system.name: result.recommended for result in results},
        "criteria": {f"equilibrium and dynamics{name}": allowed for name, allowed in CRITERIA.items()},
        "frames": effort.frames,
        "steps_per_frame": STEPS_PER_FRAME,
        "threads": 1,
    }
    title = "Errors against the step: equilibrium and dynamics, one thread"
    table = "\n\n".join(format_errors(result) for result in results)
    return Report(title, machine, settings, rows, missing, details, table), results


def measure_system(system, effort, say=lambda message: None, schemes=CYLINDER_SCHEMES):
    """Run the ladders of schemes, "implicit" among them, for a system.

    Returns
    -------
    SystemErrors
    """
    references, steps = {}, []
    for scheme, ladder_of_scheme in _ladders(system, schemes, effort.every).items():
        for step in ladder_of_scheme:
            say(f"{system.label}: {scheme}, {format_time(step, 2)}")
            run = _simulate(system, max(8, round(system.chains * effort.share)), scheme, step, effort.frames)
            if run is None:
                steps.append(_blown_up(scheme, step))
                break
            if scheme == "implicit":
                references[_key(step)] = run.displacements
            reference = references.get(_key(step / REFERENCE_FACTOR))
            errors = _equilibrium_errors(system, run), _dynamic_errors(run, reference)
            steps.append(StepErrors(scheme, step, *errors, median(run.seconds_per_step), run.divided))
    return SystemErrors(system, steps, _recommended(system, "implicit"))


def _recommended(system, scheme):
    return recommended_time_step(system.type, system.viscosity, system.temperature, scheme, system.segments).step


def _ladders(system, schemes, every):
    # Scheme "implicit", the reference of all, comes first and begins a factor of ten below the others.
    recommended = _recommended(system, "implicit")
    explicit = _recommended(system, "midpoint")
    smallest = 0.02 * explicit if len(schemes) > 1 else 0.01 * recommended
    ladders = {"implicit": ladder(smallest, 40.0 * recommended, every)}
    bounds = stability_bounds(system.type, system.viscosity, system.temperature, system.segments)
    for scheme in EXPLICIT_SCHEMES:
        if scheme in schemes:
            ladders[scheme] = [step for step in ladders["implicit"] if 0.2 * explicit <= step <= min(bounds.values())]
    if "implicit-second-order" in schemes:
        # What it is for are steps at which scheme "implicit" is of first order.
        ladders["implicit-second-order"] = [step for step in ladders["implicit"] if step >= 0.2 * recommended]
    return ladders


def ladder(smallest, largest, every=1):
    """The steps 1, 2, 5, 10 … between two bounds; only one in three with ``every`` = 3."""
    exponents = range(int(np.floor(np.log10(smallest))), int(np.ceil(np.log10(largest))) + 1)
    steps = [factor * 10.0**exponent for exponent in exponents for factor in _LADDER[::every]]
    return [step for step in steps if smallest <= step * (1 + 1e-9) and step <= largest * (1 + 1e-9)]


def _key(step):
    return f"{step:.3e}"


@dataclass(frozen=True)
class _Run:
    # Energies and square end-to-end distances are means over time for each chain; displacements are functions of the
    # lag in frames, for each chain.
    energies: dict
    square_distance: np.ndarray
    start_square_distance: np.ndarray
    displacements: dict
    seconds_per_step: list
    divided: float


def _simulate(system, chains, scheme, step, frames):
    """Run a system; None if it blows up."""
    context = _context(system, chains, scheme, step)
    integrator = context.getIntegrator()
    shape = (chains, system.segments + 1, 3)
    nodes, seconds = [_positions(context).reshape(shape)], []
    for _ in range(frames):
        start = time.perf_counter()
        try:
            integrator.step(STEPS_PER_FRAME)
        except InstabilityError:
            return None
        seconds.append((time.perf_counter() - start) / STEPS_PER_FRAME)
        nodes.append(_positions(context).reshape(shape))
    divided = integrator.getNumDividedSteps() / (chains * frames * STEPS_PER_FRAME)
    return _reduce(system, np.array(nodes), seconds, divided)


def _context(system, chains, scheme, step, platform=None):
    """A Context of chains in equilibrium, on one thread or on a platform that is given."""
    filaments = Filaments(system.viscosity, system.temperature, engine="compiled")
    for seed in range(chains):
        filaments.add_equilibrium(system.type, system.segments, seed)
    _, openmm_system, positions = filaments.build()
    # What steps that are too long do is what is measured.
    integrator = filaments.create_integrator(openmm_system, step, scheme=scheme, random_seed=1, checks=False)
    return one_thread_context(openmm_system, integrator, positions, platform)


def _positions(context):
    return context.getState(positions=True).getPositions(asNumpy=True)._value


def _reduce(system, nodes, seconds, divided):
    differences = np.diff(nodes, axis=2)
    lengths = np.linalg.norm(differences, axis=3)
    tangents = differences / lengths[..., None]
    late = slice(len(nodes) // 4, None)
    energies = {"stretching energy": system.type.stretching_energy(lengths[late]).mean(axis=(0, 2))}
    if system.type.bending_rigidity > 0 and system.segments > 1:
        cosines = np.einsum("fcsk,fcsk->fcs", tangents[late, :, 1:], tangents[late, :, :-1])
        energies["bending energy"] = system.type.bending_energy(cosines).mean(axis=(0, 2))
    ends = nodes[:, :, -1] - nodes[:, :, 0]
    series = {
        "end-to-end vector": ends,
        "orientation": tangents[:, :, _middle(system.segments)],
        "displacement": nodes[:, :, _middle(system.segments + 1)],
    }
    lags = {1, 2} | {lag for lag in (REFERENCE_FACTOR, 2 * REFERENCE_FACTOR) if lag < len(nodes)}
    displacements = {(name, lag): _mean_square_change(values, lag) for name, values in series.items() for lag in lags}
    square = np.sum(ends**2, axis=2)
    return _Run(energies, square[late].mean(axis=0), square[0], displacements, seconds, divided)


def _middle(count):
    half = max(1, count // 4) / 2
    return slice(math.floor(count / 2 - half), math.ceil(count / 2 + half))


def _mean_square_change(values, lag):
    """For each chain: the mean over time, and over places in the chain if there are several."""
    squares = np.sum((values[lag:] - values[:-lag]) ** 2, axis=-1)
    return squares.reshape(*squares.shape[:2], -1).mean(axis=(0, 2))


def _equilibrium_errors(system, run):
    kind = system.type
    exact = {"stretching energy": stretching_energy_mean(kind, system.temperature)}
    if "bending energy" in run.energies:
        exact["bending energy"] = bending_energy_mean(kind, system.temperature)
    errors = {name: _mean(run.energies[name] / value - 1.0) for name, value in exact.items()}
    change = (run.square_distance - run.start_square_distance) / run.start_square_distance.mean()
    errors["end-to-end distance"] = _mean(change)
    return errors


def _dynamic_errors(run, reference):
    if reference is None:
        return {}
    errors = {}
    for name in _DYNAMICS:
        for lag in (1, 2):
            finer = reference.get((name, REFERENCE_FACTOR * lag))
            if finer is not None:
                mean, expected = _mean(run.displacements[name, lag]), _mean(finer)
                relative = mean.value / expected.value
                error = relative * np.hypot(mean.error / mean.value, expected.error / expected.value)
                errors[f"{name}, {STEPS_PER_FRAME * lag} steps"] = Estimate(relative - 1.0, float(error))
    return errors


def _mean(values):
    return Estimate(float(np.mean(values)), float(np.std(values, ddof=1) / np.sqrt(len(values))))


def _blown_up(scheme, step):
    return StepErrors(scheme, step, {"blown up": Estimate(np.inf, None)}, {}, Estimate(np.inf, None))


def largest_step_rows(results):
    """Rows with the largest steps, and why some are missing.

    Returns
    -------
    rows : list of Row
    missing : dict
    """
    rows, missing = [], {}
    for result in results:
        for suffix, allowed in CRITERIA.items():
            for scheme in CYLINDER_SCHEMES:
                name = f"largest_step_{_words(scheme)}_{result.system.name}{suffix}"
                largest = result.largest_step(scheme, *allowed)
                if largest is None:
                    missing[name] = "no step that was tried is accurate enough"
                else:
                    rows.append(row(name, Estimate(largest.step / _MICROSECOND, None), "us"))
        recommended = Estimate(result.recommended / _MICROSECOND, None)
        rows.append(row(f"recommended_step_{result.system.name}", recommended, "us"))
    return rows, missing


def _speed_rows(actin, effort, say, missing):
    """Simulated time per second, everything in turn: schemes at their largest steps, the workload, stock OpenMM."""
    steps = {}
    for scheme in CYLINDER_SCHEMES:
        largest = actin.largest_step(scheme, *CRITERIA[""])
        if largest is None:
            missing[f"simulated_time_per_second_{_words(scheme)}"] = "no step that was tried is accurate enough"
        else:
            steps[scheme] = (actin.system, scheme, largest.step)
    steps["implicit_recommended"] = (actin.system, "implicit", actin.recommended)
    workload = measure_system(WORKLOAD, effort, say, ("implicit",))
    largest = workload.largest_step("implicit", *CRITERIA[""])
    if largest is None:
        missing["simulated_seconds_per_second_cytosim_workload"] = "no step that was tried is accurate enough"
    else:
        steps["cytosim_workload"] = (WORKLOAD, "implicit", largest.step)
    cases = [Case(name, system_stepper(*arguments)) for name, arguments in steps.items()]
    beads = simulate_beads("harmonic", WORKLOAD.chains, WORKLOAD.segments, *one_thread_platform())
    cases.append(Case("stock", beads.advance))
    times = time_interleaved(cases, effort.repetitions, 0.3, say)
    rows = []
    for scheme in CYLINDER_SCHEMES:
        if scheme in steps:
            speed = median(1e-12 * steps[scheme][2] / times[scheme])
            rows.append(row(f"simulated_time_per_second_{_words(scheme)}", scaled(speed, 1e6), "us/s"))
    for scheme in EXPLICIT_SCHEMES:
        if scheme in steps and "implicit" in steps:
            speeds = ratio(times[scheme], times["implicit"])
            factor = steps["implicit"][2] / steps[scheme][2]
            rows.append(row(f"simulated_time_implicit_over_{scheme}", scaled(speeds, factor), "1"))
    if "euler" in steps:
        speeds = ratio(times["euler"], times["implicit_recommended"])
        factor = actin.recommended / steps["euler"][2]
        rows.append(row("simulated_time_implicit_over_euler_at_recommended_step", scaled(speeds, factor), "1"))
    if "cytosim_workload" in steps:
        rows.append(row("largest_step_implicit_cytosim_workload", Estimate(largest.step / _MICROSECOND, None), "us"))
        speed = median(1e-12 * largest.step / times["cytosim_workload"])
        rows.append(row("simulated_seconds_per_second_cytosim_workload", speed, "1"))
    segments = WORKLOAD.chains * WORKLOAD.segments
    rows.append(row("speed_stock_openmm_bead_spring", median(1e-6 * segments / times["stock"]), "10^6 segment steps/s"))
    return rows


def equilibrium_errors(system, scheme, step, frames):
    """What a step does to the equilibrium of a system: relative errors by observable, as Estimates.

    Parameters
    ----------
    system : BenchmarkSystem
    scheme : str
    step : float
        In ps.
    frames : int
        Of ten steps each.

    Raises
    ------
    InstabilityError
        If the run has blown up.
    """
    run = _simulate(system, system.chains, scheme, step, frames)
    if run is None:
        raise InstabilityError(f"{system.label} blows up with a step of {step:g} ps of scheme {scheme}.")
    return _equilibrium_errors(system, run)


def system_stepper(system, scheme, step, platform=None):
    """What advances a system by a number of steps, for timing; see ``one_thread_context`` for the platform."""
    return stepper(_context(system, system.chains, scheme, step, platform))


def stepper(context):
    """What advances a Context by a number of steps. It keeps the Context."""

    def advance(steps):
        context.getIntegrator().step(steps)

    return advance


def _error_rows(result):
    for one in result.steps:
        for name, error in {**one.equilibrium, **one.dynamics}.items():
            if np.isfinite(error.value):
                words = _words(name.replace(", ", "_at_"))
                label = f"error_{words}_{_words(one.scheme)}_{result.system.name}_step_{one.step / _MICROSECOND:g}_us"
                yield row(label, error, "1")


def _words(name):
    # As in names of rows.
    return name.replace(" ", "_").replace("-", "_")


def format_errors(result):
    """A table of the errors of a system in per cent, a line for each scheme and step."""
    header = (
        f"{'scheme':<21} {'step':>8} {'V_el':>15} {'V_b':>15} {'R^2':>15} {'dynamics':>9} {'divided':>8} {'µs/s':>9}"
    )
    lines = [f"{result.system.label} (errors in %; recommended {format_time(result.recommended, 3)})", header]
    for scheme in CYLINDER_SCHEMES:
        for one in result.of_scheme(scheme):
            lines.append(f"{scheme:<21} {format_time(one.step, 2):>8} {_columns(one)}")
    return "\n".join(lines)


def _columns(one):
    if not np.isfinite(one.largest_equilibrium_error):
        return f"{'blown up':>15}"
    names = ("stretching energy", "bending energy", "end-to-end distance")
    columns = [f"{_percent(one.equilibrium.get(name)):>15}" for name in names]
    columns.append(f"{100 * one.largest_dynamic_error:>9.1f}" if one.dynamics else f"{'–':>9}")
    columns.append(f"{100 * one.divided:>8.2g}" if one.divided else f"{'–':>8}")
    columns.append(f"{one.step / _MICROSECOND / one.seconds_per_step.value:>9.3g}")
    return " ".join(columns)


def _percent(error):
    return "–" if error is None else f"{100 * error.value:+.2f} ± {100 * error.error:.2f}"
