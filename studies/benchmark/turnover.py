"""Turnover: what it costs that filaments of a network grow, begin, vanish and are cut, beside their mechanics alone.

Ten thousand segments of actin in a periodic box with 10 uM of free monomers, in a solvent of 1 Pa s, with crosslinkers
like alpha-actinin and motors like myosin II. Ends grow and shrink with the rates of ATP-actin at plus ends, and at
minus ends with k_off of filaments with ADF/cofilin, 6.75/s (Roland et al., Biophys. J. 2008, 94, 2082). Filaments are
cut as often as by cofilin where it cuts most, 0.032 times a second in 1000 monomers (Chen and Pollard, J. Cell Biol.
2011, 195, 485), begin at random, and vanish when they have become too short.

From one network that has been linked for a while, Contexts take steps of each length; in turn with them the same
filaments with growth alone, with so many births that each step has some, and as they were drawn, without growth and
without linkers, which is the mechanics. Free monomers stay as many, so that filaments become longer: all begin anew
from the same state each time that they are timed.
"""

import sys
import time
from dataclasses import dataclass, replace

import numpy as np
from openmm import unit

from openmm_cylchain import (
    ACTIN_ATP,
    ALPHA_ACTININ,
    COFILIN,
    F_ACTIN,
    MYOSIN_II,
    Filaments,
    Growth,
    MonomerPool,
    Nucleation,
)
from openmm_cylchain.engine_choice import choose_engine

from .kinetic_systems import MICROSECOND, TEMPERATURE, VISCOSITY
from .measurement import Estimate, describe_machine, median, ratio, scaled, time_interleaved
from .memory import MeasurementError, measure_in_process, print_growth
from .report import Report, Row, row
from .systems import Network, one_thread_context, restarting

MONOMERS_OF_SEGMENT = 40
MONOMERS = replace(ACTIN_ATP, minus_off_rate=6.75 / unit.second)
ACTIN = F_ACTIN.with_segment_length(MONOMERS_OF_SEGMENT * ACTIN_ATP.length)
CONCENTRATION = unit.Quantity(10e-6, unit.molar)
LONGEST = 10 * unit.micrometer

_CASES = ("turnover", "growth_alone", "growth_with_births", "mechanics")
_MEAN, _MOST = 20, 60
_SEED = 1
_STEPS = 3
"""Before memory is looked at."""


@dataclass(frozen=True)
class TurnoverSystem:
    """Actin filaments in a periodic box.

    Attributes
    ----------
    filaments : int
        Each of 2 to 60 segments, 20 in the mean.
    reserve : int
        How many more there can be.
    edge : float
        Of the box, in nm.
    births : float
        How often a filament begins in the box, in 1/s.
    crosslinkers, motors : int
    """

    filaments: int = 530
    reserve: int = 500
    edge: float = 4000.0
    births: float = 10.0
    crosslinkers: int = 2000
    motors: int = 500


@dataclass(frozen=True)
class TurnoverEffort:
    """How much is measured.

    Attributes
    ----------
    system : TurnoverSystem
    steps : tuple of float
        In us, the shortest first. The last one is that of the rows without a step in their names.
    duration : float
        In us, before the network is timed.
    repetitions : int
    seconds : float
        Of timing in each repetition.
    """

    system: TurnoverSystem
    steps: tuple
    duration: float
    repetitions: int
    seconds: float


FULL = TurnoverEffort(TurnoverSystem(), (100.0, 1000.0), 5e5, 7, 2.0)
QUICK = TurnoverEffort(TurnoverSystem(), (100.0, 1000.0), 1e5, 3, 0.5)


class TurnoverNetwork(Network):
    """Filaments in a Context that may grow."""

    def segments(self):
        """How many there are."""
        if self.filaments[0].growth is None:
            return sum(len(nodes) - 1 for nodes in self.filaments.node_indices)
        return int(np.maximum(self.filaments.in_context(self.context).growth().nodes - 1, 0).sum())

    def events(self):
        """Since the start: monomers that have come and gone; filaments that have begun, vanished and were cut: (2,)."""
        growth = self.filaments.in_context(self.context).growth()
        monomers = int(growth.gained.sum() + growth.lost.sum())
        return np.array([monomers, growth.nucleated + growth.vanished + growth.severed])


def create_network(system, step, growing=True, linked=True, births=None):
    """Filaments in a Context on one thread.

    Parameters
    ----------
    system : TurnoverSystem
    step : float
        In us.
    growing, linked : bool
        Whether filaments grow, and whether there are linkers.
    births : float, optional
        In place of those of the system, in 1/s.
    """
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine="compiled")
    generator = np.random.default_rng(_SEED)
    growth = None
    if growing:
        growth = Growth(
            monomers=MONOMERS,
            pool=MonomerPool(CONCENTRATION),
            longest=LONGEST,
            vanishes=True,
            severing=replace(COFILIN, of_states=()),
        )
    sizes = np.clip(1 + generator.geometric(1.0 / (_MEAN - 1), system.filaments), 2, _MOST)
    for seed, size in enumerate(sizes, 1):
        start = generator.uniform(0.0, system.edge, 3)
        filaments.add_equilibrium(ACTIN, int(size), seed, start, growth=growth)
    if growing:
        rate = system.births if births is None else births
        filaments.add_reserve(ACTIN, system.reserve, growth=growth, nucleation=Nucleation(rate=rate / unit.second))
    for kind, count in ((ALPHA_ACTININ, system.crosslinkers), (MYOSIN_II, system.motors)) if linked else ():
        filaments.add_linkers(kind, count, bound=count, seed=_SEED)
    _, openmm_system, positions = filaments.build(box_vectors=system.edge * np.eye(3))
    integrator = filaments.create_integrator(openmm_system, step * MICROSECOND, random_seed=_SEED, checks=False)
    return TurnoverNetwork(filaments, one_thread_context(openmm_system, integrator, positions._value))


def benchmark_turnover(effort=FULL, say=lambda message: None):
    """Measure the speed of a network whose filaments grow and are linked, and what growth costs beside mechanics.

    Parameters
    ----------
    effort : TurnoverEffort
    say : callable (str), optional
        Told how far it is.

    Returns
    -------
    Report

    Raises
    ------
    InputError
        If there is no compiled engine.
    """
    choose_engine("compiled")
    machine = describe_machine()
    system, longest = effort.system, effort.steps[-1]
    say("linking filaments")
    network = create_network(system, longest)
    recommended = network.filaments.recommended_time_step(system=network.context.getSystem()).step / MICROSECOND
    network.advance(round(effort.duration / longest))
    monomers, filaments = network.events() / (1e-6 * effort.duration)
    networks = {
        "turnover": network,
        "growth_alone": create_network(system, longest, linked=False),
        "growth_with_births": create_network(system, longest, linked=False, births=2e6 / longest),
        "mechanics": create_network(system, longest, growing=False, linked=False),
    }
    cases = [
        restarting(_name(name, step), own, step * MICROSECOND)
        for name, own in networks.items()
        for step in effort.steps
    ]
    times = time_interleaved(cases, effort.repetitions, effort.seconds, say, clock=time.process_time)
    rows = speed_rows(effort.steps, times)
    rows += event_rows(monomers, filaments, times[_name("turnover", longest)], longest)
    rows.append(Row("recommended_step_turnover", float(recommended), None, "us"))
    rows += [Row(f"segments_{name}", float(own.segments()), None, "segments") for name, own in networks.items()]
    missing = {}
    try:
        rows.append(Row("memory_turnover", memory_in_process(system) / 2**20, None, "MiB"))
    except MeasurementError as error:
        missing["memory_turnover"] = str(error)
    settings = {
        "steps_us": effort.steps,
        "filaments": system.filaments,
        "reserve": system.reserve,
        "crosslinkers": system.crosslinkers,
        "motors": system.motors,
        "particles": network.context.getSystem().getNumParticles(),
        "threads": 1,
        "clock": "processor",
    }
    title = (
        f"Turnover of {system.filaments} actin filaments, {system.crosslinkers} crosslinkers and {system.motors} "
        "motors, one thread"
    )
    return Report(title, machine, settings, rows, missing)


def _name(case, step):
    return f"{case}_{step:g}_us"


def speed_rows(steps, times):
    """Rows of speeds and of what growth and linkers cost beside the mechanics.

    Parameters
    ----------
    steps : sequence of float
        In us.
    times : dict
        Seconds per step, one for each repetition, by the names of cases.
    """
    rows = []
    for step in steps:
        own = {name: np.asarray(times[_name(name, step)]) for name in _CASES}
        ends = [f"_{step:g}_us", *([""] if step == steps[-1] else [])]
        for end in ends:
            for name in ("turnover", "mechanics"):
                speed = median(1e-6 * step / own[name])
                rows.append(row(f"simulated_seconds_per_second_{name}{end}", speed, "s/s"))
        for name, seconds in own.items():
            rows.append(row(f"time_per_step_{name}_{step:g}_us", scaled(median(seconds), 1e3), "ms"))
        whole = ratio(own["turnover"], own["mechanics"])
        rows.append(row(f"kinetics_over_mechanics_{step:g}_us", Estimate(whole.value - 1.0, whole.error), "1"))
    # Births come at two in a step of the longest length, so that exp(-2) of such steps have none.
    beyond = median(own["growth_with_births"] - own["growth_alone"])
    rows.append(row("time_of_births_in_a_step_turnover", scaled(beyond, 1e3 / (1.0 - np.exp(-2.0))), "ms"))
    return rows


def event_rows(monomers, filaments, seconds, step):
    """Rows of events per simulated second, and of all of them per second of the processor at a step in us."""
    speed = median(1e-6 * step / np.asarray(seconds))
    return [
        Row("monomers_per_simulated_second_turnover", float(monomers), None, "1/s"),
        Row("births_deaths_and_cuts_per_simulated_second_turnover", float(filaments), None, "1/s"),
        row("events_per_second_turnover", scaled(speed, float(monomers + filaments)), "1/s"),
    ]


def memory_in_process(system):
    """By how much a process grows with the network, in bytes.

    Raises
    ------
    MeasurementError
        If the process fails, or memory cannot be measured on this operating system.
    """
    numbers = (system.filaments, system.reserve, system.crosslinkers, system.motors)
    return measure_in_process(__name__, *map(str, numbers))["resident"]


def _grow(*numbers):
    filaments, reserve, crosslinkers, motors = map(int, numbers)

    def make():
        system = TurnoverSystem(filaments, reserve, crosslinkers=crosslinkers, motors=motors)
        network = create_network(system, 1000.0)
        network.advance(_STEPS)
        return network

    print_growth(make)


if __name__ == "__main__":
    try:
        _grow(*sys.argv[1:])
    except MeasurementError as error:
        sys.exit(str(error))
