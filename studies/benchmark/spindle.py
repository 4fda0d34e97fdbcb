"""A spindle: what a second of examples/spindle.toml costs, 200 microtubules that turn over in a plane, and 9000 motors.

Loughlin, Heald and Nédélec (J. Cell Biol. 2010, 191, 1239) simulate as many for 5000 s, in steps of 5 ms. The file has
their numbers where it can, but is no copy of their model, as it says: only its size compares with theirs. Motors bind
and filaments grow in the first minute, so that steps cost more at its end: it is timed from there on, in pieces one
after the other.
"""

import dataclasses
import time
from dataclasses import dataclass
from pathlib import Path

from openmm_cylchain.engine_choice import choose_engine
from openmm_cylchain.runs.configuration import read_configuration
from openmm_cylchain.runs.created_simulation import begin, create_simulation

from .measurement import describe_machine, median, scaled
from .report import Report, Row, row

SPINDLE = Path(__file__).parents[2] / "examples" / "spindle.toml"
PUBLISHED_SECONDS = 5000.0
_SECOND = 1e12


@dataclass(frozen=True)
class SpindleEffort:
    """How much is measured.

    Attributes
    ----------
    settling : float
        How long is simulated before, in s.
    pieces : int
    piece : float
        How long each of them that are timed is, in s.
    """

    settling: float
    pieces: int
    piece: float


FULL = SpindleEffort(60.0, 7, 3.0)
QUICK = SpindleEffort(5.0, 3, 1.0)


def benchmark_spindle(effort=FULL, say=lambda message: None):
    """Measure how much of a spindle one thread simulates.

    Parameters
    ----------
    effort : SpindleEffort
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
    configuration = read_configuration(SPINDLE)
    settings = dataclasses.replace(configuration.simulation, platform="CPU", threads=1)
    configuration = dataclasses.replace(configuration, simulation=settings)
    say("building")
    simulation, built = create_simulation(configuration)
    begin(configuration, simulation, built)
    here = built.filaments.in_context(simulation.context)
    step = settings.time_step / _SECOND
    _timed(simulation, round(effort.settling / step), say, "settling")
    seconds = [
        _timed(simulation, round(effort.piece / step), say, f"timing, {number + 1} of {effort.pieces}")
        for number in range(effort.pieces)
    ]
    speed = median([effort.piece / own for own in seconds])
    growth, table = here.growth(), here.linkers()
    there = growth.nodes > 0
    rows = [
        row("simulated_seconds_per_second_spindle", speed, "s/s"),
        row("time_per_step_spindle", scaled(median(seconds), 1e3 * step / effort.piece), "ms"),
        row("hours_for_5000_s_spindle", scaled(median(seconds), PUBLISHED_SECONDS / effort.piece / 3600), "h"),
        Row("microtubules_spindle", float(there.sum()), None, "1"),
        Row("mean_length_spindle", float(growth.lengths._value[there].mean()), None, "nm"),
        Row("linkers_with_one_hand_bound_spindle", float((table.held == 1).sum()), None, "1"),
        Row("linkers_with_both_hands_bound_spindle", float((table.held == 2).sum()), None, "1"),
    ]
    said = {"step_ms": 1e3 * step, "settling_s": effort.settling, "threads": 1, "clock": "processor"}
    return Report("A spindle of 200 microtubules, 6000 kinesin-5 and 3000 dynein, one thread", machine, said, rows, {})


def _timed(simulation, steps, say, what):
    say(what)
    start = time.process_time()
    simulation.context.getIntegrator().step(steps)
    return time.process_time() - start
