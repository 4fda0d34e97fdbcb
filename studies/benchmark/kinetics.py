"""Kinetics: a contractile bundle of actin, motors and crosslinkers, its speed, and what the step changes of it.

A hundred and fifty actin filaments of 1 um along a cylinder of 5 um in a solvent of 1 Pa s, with a thousand motors and
as many crosslinkers, on one thread (see ``kinetic_systems``). From the same relaxed filaments, each linker with one
hand bound, bundles take steps of each length over the same time, with several seeds; and a tenth of the longest step. A
bundle is not in equilibrium: energies, numbers of linkers and lengths are compared at the same times. Then the bundles
as they are, linked, are timed in turn. They are the more contracted, and the slower, the later that is: what the
courses took is there, too. The same without contacts shows what linkers cost, and what they change.
In turn with them, ``many_linkers`` are timed beside the mechanics of their filaments, and their memory is measured.
"""

import time
from dataclasses import dataclass, replace

import numpy as np

from openmm_cylchain.engine_choice import choose_engine

from .kinetic_systems import MICROSECOND, BundleSystem, create_bundle, relaxed_positions
from .many_linkers import NetworkSystem, bytes_per_linker, linked_networks, linker_cases, linker_rows
from .measurement import Case, Estimate, describe_machine, median, scaled, time_interleaved
from .memory import MeasurementError
from .report import Report, Row, row

REFERENCE_FACTOR = 10.0
"""How much shorter than the longest step the one is that energies are compared with."""

STATES = ("unbound", "one_hand_bound", "both_hands_bound")


@dataclass(frozen=True)
class KineticsEffort:
    """How much is measured.

    Attributes
    ----------
    systems : tuple of BundleSystem
    steps : tuple of float
        In us, the shortest first. The last one is that of the rows without a step in their names.
    relaxation : int
        Steps before there are linkers.
    duration : float
        In us, of the course of a bundle.
    frames : int
        How often it is looked at in that time.
    seeds : int
    crossing_steps : int
        In which crossings are counted, at the end.
    repetitions : int
    seconds : float
        Of timing in each repetition.
    network : NetworkSystem
        Of many linkers.
    """

    systems: tuple
    steps: tuple
    relaxation: int
    duration: float
    frames: int
    seeds: int
    crossing_steps: int
    repetitions: int
    seconds: float
    network: NetworkSystem = NetworkSystem()


_SYSTEMS = (BundleSystem(), BundleSystem(name="bundle_without_contacts", contacts=False))
FULL = KineticsEffort(_SYSTEMS, (1000.0, 2000.0, 2500.0), 200, 1e6, 20, 4, 50, 7, 2.0)
_SHORT_SYSTEMS = tuple(replace(own, filaments=60, motors=400, crosslinkers=400, length=2000.0) for own in _SYSTEMS)
QUICK = KineticsEffort(_SHORT_SYSTEMS, (2000.0,), 50, 1e5, 4, 2, 10, 3, 1.0, NetworkSystem(steps=100))


@dataclass(frozen=True)
class Course:
    """What a bundle does with a step and a seed.

    Attributes
    ----------
    times : (frames,) array
        In us.
    energies : dict of (frames,) arrays
        In k_BT.
    numbers : dict of (frames, 3) arrays
        Of linkers in each state, by the names of their types.
    lengths : (frames + 1,) array
        Of the bundle, in nm, from the start on.
    divided : float
        The share of steps of filaments that were taken in parts.
    speed : float
        Simulated seconds per second of processor time.
    """

    times: np.ndarray
    energies: dict
    numbers: dict
    lengths: np.ndarray
    divided: float
    speed: float

    @property
    def shortening(self):
        """By which share of its length the bundle has become shorter: a (frames,) array."""
        return 1.0 - self.lengths[1:] / self.lengths[0]


def follow(bundle, step, duration, frames):
    """The Course of a bundle over a duration in us, with steps in us."""
    interval = max(1, round(duration / (frames * step)))
    energies, numbers, lengths = [], [], [bundle.length()]
    before, seconds = bundle.integrator.getNumDividedSteps(), 0.0
    for _ in range(frames):
        begun = time.process_time()
        bundle.integrator.step(interval)
        seconds += time.process_time() - begun
        energies.append(bundle.energies())
        table = bundle.linkers()
        numbers.append({one.kind.name: table.counts(type_) for type_, one in enumerate(bundle.filaments.linkers)})
        lengths.append(bundle.length())
    divided = bundle.integrator.getNumDividedSteps() - before
    return Course(
        step * interval * np.arange(1, frames + 1),
        {name: np.array([one[name] for one in energies]) for name in energies[0]},
        {name: np.array([one[name] for one in numbers]) for name in numbers[0]},
        np.array(lengths),
        divided / (frames * interval * bundle.system.filaments),
        step * interval * frames / MICROSECOND / seconds,
    )


def benchmark_kinetics(effort=FULL, say=lambda message: None):
    """Measure speed, energies, numbers of linkers, divided steps, crossings and shortening of a contractile bundle.

    Parameters
    ----------
    effort : KineticsEffort
    say : callable (str), optional
        Told how far it is.

    Returns
    -------
    Report

    Raises
    ------
    InputError
        If there is no compiled engine, which has linkers.
    """
    choose_engine("compiled")
    machine = describe_machine()
    courses, crossings, cases, details, tables = {}, {}, [], [], []
    for system in effort.systems:
        say(f"{system.name}: relaxing")
        start = relaxed_positions(system, effort.relaxation)
        courses[system.name], crossings[system.name] = {}, {}
        for step in (effort.steps[-1] / REFERENCE_FACTOR, *effort.steps):
            own = courses[system.name][step] = []
            for seed in range(1, effort.seeds + 1):
                say(f"{system.name}: steps of {step:g} us, seed {seed} of {effort.seeds}")
                bundle = create_bundle(system, step, seed, start)
                own.append(follow(bundle, step, effort.duration, effort.frames))
            name = case_name(system.name, step)
            if step in effort.steps:
                if system.contacts:
                    say(f"{system.name}: steps of {step:g} us, crossings")
                    crossings[system.name][step] = bundle.crossings(effort.crossing_steps)
                cases.append(_case(name, bundle))
            details += course_rows(name, own, crossings[system.name].get(step))
        tables.append(f"{system.name}\n\n" + format_courses(courses[system.name], crossings[system.name]))
    say(f"{effort.network.linkers} linkers on {effort.network.segments * effort.network.filaments} segments")
    networks, joined = linked_networks(effort.network)
    cases += linker_cases(networks)
    times = time_interleaved(cases, effort.repetitions, effort.seconds, say, clock=time.process_time)
    settings = {
        "steps_us": effort.steps,
        "duration_us": effort.duration,
        "seeds": effort.seeds,
        "filaments": bundle.system.filaments,
        "segments": sum(len(nodes) - 1 for nodes in bundle.nodes),
        "motors": bundle.system.motors,
        "crosslinkers": bundle.system.crosslinkers,
        "many_linkers": effort.network.linkers,
        "segments_of_many_linkers": effort.network.filaments * effort.network.segments,
        "threads": 1,
        "clock": "processor",
    }
    title = (
        f"A contractile bundle of {settings['filaments']} filaments, {settings['segments']} segments, "
        f"{settings['motors']} motors and {settings['crosslinkers']} crosslinkers, one thread"
    )
    rows = []
    for system in effort.systems:
        rows += speed_rows(system.name, effort.steps, times)
        rows += ratio_rows(system.name, effort.steps, courses[system.name])
    rows += linker_rows(times, joined)
    missing = {}
    try:
        rows.append(Row("bytes_per_linker", bytes_per_linker(effort.network), None, "B"))
    except MeasurementError as error:
        missing["bytes_per_linker"] = str(error)
    return Report(title, machine, settings, rows, missing, details, "\n\n".join(tables))


def case_name(system, step):
    """The name of a system with a step in us, as in rows."""
    return f"{system}_{step:g}_us"


def _case(name, bundle):
    # It keeps the bundle.
    return Case(name, lambda steps: bundle.integrator.step(steps))


def over_seeds(values):
    """The mean of a value for each seed with its standard error, an Estimate."""
    values = np.asarray(values, dtype=float)
    error = float(values.std(ddof=1) / np.sqrt(len(values))) if len(values) > 1 else None
    return Estimate(float(values.mean()), error)


def _at_end(frames):
    # Over the last quarter.
    return float(np.mean(frames[-max(1, len(frames) // 4) :]))


def speed_rows(system, steps, times):
    """Rows of speeds.

    Parameters
    ----------
    system : str
        Its name.
    steps : sequence of float
        In us.
    times : dict
        Seconds per step, one for each repetition, by the names of cases.
    """
    rows = []
    for step in steps:
        seconds = np.asarray(times[case_name(system, step)])
        own = (scaled(median(seconds), 1e3), median(step / MICROSECOND / seconds))
        names = [case_name(system, step), *([system] if step == steps[-1] else [])]
        for name in names:
            rows.append(row(f"time_per_step_{name}", own[0], "ms"))
            rows.append(row(f"simulated_seconds_per_second_{name}", own[1], "s/s"))
    return rows


def ratio_rows(system, steps, courses):
    """Rows of energies and of shortening over those with a tenth of the longest step, at the end of the courses."""
    rows, reference = [], courses[steps[-1] / REFERENCE_FACTOR]
    for step in steps:
        for name in ("bending", "motor", "crosslinker"):
            one, other = ([_at_end(course.energies[name]) for course in own] for own in (courses[step], reference))
            if not np.any(other):  # None is bound with both hands yet.
                continue
            rows.append(row(f"{name}_energy_over_reference_{case_name(system, step)}", ratio_of_means(one, other), "1"))
        one, other = ([course.shortening[-1] for course in own] for own in (courses[step], reference))
        rows.append(row(f"shortening_over_reference_{case_name(system, step)}", ratio_of_means(one, other), "1"))
    return rows


def ratio_of_means(values, others):
    """The ratio of two means over seeds, which are independent of each other, as an Estimate."""
    one, other = over_seeds(values), over_seeds(others)
    value = one.value / other.value
    if one.error is None or other.error is None:
        return Estimate(value, None)
    # The first mean may be zero: where no linker has bound with both hands.
    return Estimate(value, float(np.hypot(one.error, value * other.error) / abs(other.value)))


def course_rows(name, courses, crossings=None):
    """Rows of energies, numbers of linkers, divided steps and crossings at the end, and of shortening at all times."""
    rows = []
    for kind in courses[0].energies:
        energy = over_seeds([_at_end(course.energies[kind]) for course in courses])
        rows.append(row(f"{kind}_energy_{name}", energy, "k_BT"))
    for kind in courses[0].numbers:
        for state, label in enumerate(STATES):
            number = over_seeds([_at_end(course.numbers[kind][:, state]) for course in courses])
            rows.append(row(f"{kind}_{label}_{name}", number, "linkers"))
    rows.append(row(f"divided_steps_{name}", over_seeds([course.divided for course in courses]), "1"))
    speed = over_seeds([course.speed for course in courses])
    rows.append(row(f"simulated_seconds_per_second_course_{name}", speed, "s/s"))
    if crossings is not None:
        rows.append(Row(f"crossings_{name}", float(crossings), None, "crossings"))
    for frame, elapsed in enumerate(courses[0].times):
        shortening = over_seeds([course.shortening[frame] for course in courses])
        rows.append(row(f"shortening_{name}_at_{elapsed / MICROSECOND:g}_s", shortening, "1"))
    return rows


def format_courses(courses, crossings):
    """Two tables: energies and numbers at the end with a line for each step, and shortening against time."""
    one = next(iter(courses.values()))[0]
    numbers = [(kind, state) for kind in one.numbers for state in (1, 2)]
    heads = [*one.energies, *(f"{kind}s {('', '1 hand', '2 hands')[state]}" for kind, state in numbers)]
    heads += ["divided", "crossings", "s/s"]
    lines = [
        "At the end: energies in k_BT, and linkers with one and two hands bound; of all the time: the share of divided "
        "steps, and simulated seconds per second"
    ]
    table = [["step", *heads]]
    for step, own in courses.items():
        cells = [_text(over_seeds([_at_end(course.energies[kind]) for course in own]), 0) for kind in one.energies]
        for kind, state in numbers:
            cells.append(_text(over_seeds([_at_end(course.numbers[kind][:, state]) for course in own]), 0))
        cells.append(_text(over_seeds([course.divided for course in own]), 4))
        cells.append(str(crossings.get(step, "")))
        cells.append(_text(over_seeds([course.speed for course in own]), 3))
        table.append([_milliseconds(step), *cells])
    widths = [max(map(len, column)) for column in zip(*table)]
    lines += ["  ".join(f"{cell:>{width}}" for cell, width in zip(cells, widths)) for cells in table]
    lines += ["", "Shortening in %, and its standard error over seeds, against time"]
    lines.append(f"{'time':>8}" + "".join(f"  {_milliseconds(step):>14}" for step in courses))
    for frame, elapsed in enumerate(one.times):
        cells = [over_seeds([100.0 * course.shortening[frame] for course in own]) for own in courses.values()]
        lines.append(f"{elapsed / MICROSECOND:>6g} s" + "".join(f"  {_text(cell, 2):>14}" for cell in cells))
    return "\n".join(lines)


def _milliseconds(step):
    return f"{1e-3 * step:g} ms"


def _text(estimate, decimals):
    error = "" if estimate.error is None else f" ± {estimate.error:.{decimals}f}"
    return f"{estimate.value:.{decimals}f}{error}"
