"""Networks: links and contacts in implicit steps, beside the same networks with links and contacts that are explicit.

Two hundred actin filaments of 1 um, at random in a periodic box, on one thread: with contacts; with a thousand links
that are soft, stiff, or of a rest length; with both. Each network is timed with the steps of ``NETWORKS``; with the
step that is recommended for the explicit scheme "midpoint"; and with scheme "implicit" whose links and contacts are
explicit, at the step of ``NETWORKS`` for that; all in turn. Energies begin at the same positions: what the step changes
of them is an error of the step. Crossings are counted where contacts should prevent them.

Some of the networks are timed at ten times the size as well, on one thread and on two.
"""

import time
from dataclasses import dataclass, replace

import numpy as np

from openmm_cylchain.engine_choice import choose_engine
from openmm_cylchain.errors import InstabilityError

from .measurement import Case, Estimate, describe_machine, median, processors, ratio, scaled, time_interleaved
from .network_systems import NETWORKS, SEGMENTS, create_network, enlarged, relaxed_positions
from .report import Report, Row, row

_EXPLICIT = {
    "explicit": lambda system, positions: create_network(system, "midpoint", None, positions),
    "explicit_couplings": lambda system, positions: create_network(
        system, "implicit", system.explicit_step, positions, explicit_couplings=True
    ),
}
REFERENCE_FACTOR = 10.0
"""How much shorter than the shortest step the one is, with the implicit scheme, that energies can be compared with."""

ENLARGEMENT = 10
"""Of the networks that are timed at another size."""

_BLOCKS = 8
_FRAMES_PER_BLOCK = 5
_MICROSECOND = 1e6


@dataclass(frozen=True)
class NetworkEffort:
    """How much is measured.

    Attributes
    ----------
    networks : tuple of NetworkSystem
    relaxation : int
        Steps before anything is measured.
    duration : float
        Over which energies are averaged, in us; a tenth of it with the steps that others are compared with.
    explicit_steps : int
        Over which the energies of what is explicit are averaged.
    crossing_steps : int
        In which crossings are counted.
    repetitions : int
    seconds : float
        Of timing in each repetition.
    enlarged : tuple of str
        The networks that are timed at ENLARGEMENT times the size as well.
    """

    networks: tuple
    relaxation: int
    duration: float
    explicit_steps: int
    crossing_steps: int
    repetitions: int
    seconds: float
    enlarged: tuple = ()


def _with_longest_steps(networks):
    return tuple(replace(network, steps=network.steps[-1:]) for network in networks)


FULL = NetworkEffort(NETWORKS, 300, 1e4, 30000, 300, 7, 0.7, ("contacts", "links_soft"))
QUICK = NetworkEffort(_with_longest_steps(NETWORKS), 20, 3e2, 2000, 10, 3, 0.2)


@dataclass(frozen=True)
class NetworkErrors:
    """What a scheme does to a network with a step.

    Attributes
    ----------
    step : float
        In us.
    energies : dict
        Means with their standard errors by name, in k_BT, as Estimates.
    divided : float
        The share of steps of filaments that were taken in parts.
    crossings : int or None
        None if they were not counted.
    """

    step: float
    energies: dict
    divided: float
    crossings: int | None = None


def benchmark_networks(effort=FULL, say=lambda message: None):
    """Measure speed, energies, divided steps and crossings of networks.

    Parameters
    ----------
    effort : NetworkEffort
    say : callable (str), optional
        Told how far it is.

    Returns
    -------
    Report

    Raises
    ------
    InputError
        If there is no compiled engine, which has links and contacts in its implicit steps.
    """
    choose_engine("compiled")
    machine = describe_machine()
    cases, details, missing, explicit_steps, sizes = [], [], {}, {}, []
    for system in effort.networks:
        say(f"{system.name}: relaxing")
        positions = relaxed_positions(system, effort.relaxation)
        if system.name in effort.enlarged:
            sizes += measure_sizes(system, positions, effort, say)
        reference = system.steps[0] / REFERENCE_FACTOR
        for step in (reference, *system.steps):
            say(f"{system.name}: energies with steps of {step:g} us")
            network = create_network(system, "implicit", step, positions)
            duration = effort.duration / (REFERENCE_FACTOR if step == reference else 1.0)
            crossing_steps = effort.crossing_steps if system.contacts and step != reference else 0
            errors = measure_errors(network, max(1, round(duration / step)), crossing_steps)
            details += error_rows(f"{system.name}_{step:g}_us", errors)
            if step != reference:
                cases.append(_case(case_name(system, step), network))
        explicit_steps[system.name] = {}
        for kind, create in _EXPLICIT.items():
            say(f"{system.name}: energies, {kind.replace('_', ' ')}")
            network = create(system, positions)
            try:
                errors = measure_errors(network, effort.explicit_steps)
            except InstabilityError as error:
                missing[f"{system.name}_{kind}"] = str(error)
            else:
                explicit_steps[system.name][kind] = errors.step
                details += error_rows(f"{system.name}_{kind}", errors)
                cases.append(_case(f"{system.name}_{kind}", network))
    # Of one thread, so that other processes disturb it less.
    times = time_interleaved(cases, effort.repetitions, effort.seconds, say, clock=time.process_time)
    rows = speed_rows(effort.networks, explicit_steps, times) + sizes
    settings = {
        "steps_us": {system.name: system.steps for system in effort.networks},
        "duration_of_energies_us": effort.duration,
        "explicit_steps_of_energies": effort.explicit_steps,
        "crossing_steps": effort.crossing_steps,
        "threads": 1,
        "clock": "processor",
    }
    title = "Networks of 200 filaments of 10 segments, one thread: simulated time, and errors of energies"
    return Report(title, machine, settings, rows, missing, details, format_energies(details))


def case_name(system, step):
    """The name of a network with an implicit step in us, as in rows."""
    return f"{system.name}_{step:g}_us"


_RELAXATION_OF_ENLARGED = 20


def measure_sizes(system, positions, effort, say=lambda message: None):
    """Rows of the cost per segment of a network and of a larger one, and of the latter on two threads.

    Parameters
    ----------
    system : NetworkSystem
    positions : (nodes, 3) array
        Of the smaller one.
    effort : NetworkEffort
    say : callable (str), optional

    Returns
    -------
    list of Row
    """
    large = enlarged(system, ENLARGEMENT)
    say(f"{large.filaments} filaments of {system.name}: relaxing")
    relaxed = relaxed_positions(large, _RELAXATION_OF_ENLARGED)
    cases = [_case("small", create_network(system, "implicit", system.steps[-1], positions))]
    cases.append(_case("large", create_network(large, "implicit", system.steps[-1], relaxed)))
    if processors() > 1:
        network = create_network(large, "implicit", system.steps[-1], relaxed, threads=2)
        cases.append(_case("two_threads", network))
    return size_rows(system, time_interleaved(cases, effort.repetitions, effort.seconds, say))


def size_rows(system, times):
    """Rows of the cost per segment of a network and of a larger one.

    Parameters
    ----------
    system : NetworkSystem
    times : dict
        Seconds per step, one for each repetition: of "small", "large", and "two_threads" if there are two.
    """
    segments = SEGMENTS * system.filaments
    small = times["small"] / segments
    large = times["large"] / (ENLARGEMENT * segments)
    unit = "ns per segment and step"
    rows = [
        row(f"cost_{system.name}_{segments}_segments", scaled(median(small), 1e9), unit),
        row(f"cost_{system.name}_{ENLARGEMENT * segments}_segments", scaled(median(large), 1e9), unit),
        row(f"growth_of_cost_{system.name}", ratio(large, small), "1"),
    ]
    if "two_threads" in times:
        rows.append(row(f"two_threads_over_one_{system.name}", ratio(times["large"], times["two_threads"]), "1"))
    return rows


def _case(name, network):
    # It keeps the network.
    return Case(name, lambda steps: network.integrator.step(steps))


def measure_errors(network, steps, crossing_steps=0):
    """Energies over a number of steps, the first quarter left out, and crossings in more steps.

    Parameters
    ----------
    network : Network
    steps, crossing_steps : int

    Returns
    -------
    NetworkErrors
        Standard errors are those of the means of blocks.
    """
    frames = _BLOCKS * _FRAMES_PER_BLOCK
    interval = max(1, steps * 3 // (4 * frames))
    integrator = network.integrator
    integrator.step(max(1, steps - frames * interval))
    before, energies = integrator.getNumDividedSteps(), []
    for _ in range(frames):
        integrator.step(interval)
        energies.append(network.energies())
    divided = (integrator.getNumDividedSteps() - before) / (frames * interval * network.system.filaments)
    means = {name: _mean_of_blocks([one[name] for one in energies]) for name in energies[0]}
    crossings = network.count_crossings(crossing_steps) if crossing_steps else None
    return NetworkErrors(integrator.getStepSize()._value / _MICROSECOND, means, divided, crossings)


def _mean_of_blocks(values):
    means = np.reshape(values, (_BLOCKS, -1)).mean(axis=1)
    return Estimate(float(means.mean()), float(means.std(ddof=1) / np.sqrt(_BLOCKS)))


def error_rows(name, errors):
    """Rows of the energies, divided steps and crossings of a network with a step."""
    rows = [row(f"{kind}_energy_{name}", energy, "k_BT") for kind, energy in errors.energies.items()]
    rows.append(Row(f"divided_steps_{name}", errors.divided, None, "1"))
    if errors.crossings is not None:
        rows.append(Row(f"crossings_{name}", float(errors.crossings), None, "crossings"))
    return rows


def speed_rows(networks, explicit_steps, times):
    """Rows of speeds, and of their ratios to those of what is explicit.

    Parameters
    ----------
    networks : sequence of NetworkSystem
    explicit_steps : dict of dict
        In us, by the names of networks and by what is explicit.
    times : dict
        Seconds per step, one for each repetition, by the names of cases.
    """
    rows = []
    for system in networks:
        for step in system.steps:
            rows += _rows_of_case(case_name(system, step), step, times)
        fastest = _speed(system.steps[-1], times[case_name(system, system.steps[-1])])
        rows.append(row(f"simulated_seconds_per_second_{system.name}", median(fastest), "s/s"))
        for kind, step in explicit_steps[system.name].items():
            name = f"{system.name}_{kind}"
            rows.append(row(f"step_{name}", Estimate(step, None), "us"))
            rows += _rows_of_case(name, step, times)
            rows.append(row(f"implicit_over_{kind}_{system.name}", ratio(fastest, _speed(step, times[name])), "1"))
    return rows


def _rows_of_case(name, step, times):
    yield row(f"time_per_step_{name}", scaled(median(times[name]), 1e3), "ms")
    yield row(f"simulated_seconds_per_second_{name}", median(_speed(step, times[name])), "s/s")


def _speed(step, seconds):
    return 1e-6 * step / np.asarray(seconds)


def format_energies(rows):
    """The rows of energies, divided steps and crossings as a table with a line for each network and step."""
    columns = ("link_energy", "contact_energy", "stretching_energy", "bending_energy", "divided_steps", "crossings")
    lines = {}
    for one in rows:
        column = next(column for column in columns if one.name.startswith(column))
        lines.setdefault(one.name[len(column) + 1 :], {})[column] = _format(one)
    width = max(len(name) for name in lines)
    texts = [f"{'energies in k_BT':<{width}}" + "".join(f"  {column.replace('_', ' '):>17}" for column in columns)]
    for name, cells in lines.items():
        texts.append(f"{name:<{width}}" + "".join(f"  {cells.get(column, ''):>17}" for column in columns))
    return "\n".join(texts)


def _format(one):
    return f"{one.value:g}" if one.error is None else f"{one.value:.1f} ± {one.error:.1f}"
