"""Speed of the engines beside stock OpenMM: 200 chains of 64 segments.

Stock OpenMM moves as many particles with a BrownianIntegrator, bonds of a HarmonicBondForce and angles of a
HarmonicAngleForce or, with the potential of the filaments, a CustomAngleForce. Everything is measured in one
run, in turn. Where two are compared on one thread, each takes part with the faster of the Reference platform
and the CPU platform with one thread, and stock OpenMM with the faster of its angle forces as well.

The compiled engine takes steps of 1 ms with scheme "implicit" as well, in the precision that it chooses and in double
precision, and its recommended steps with as many beam elements, for which there is double precision alone.
"""

from dataclasses import dataclass
from functools import partial

import numpy as np
import openmm

from openmm_cylchain.engine_choice import ENGINES, available_engines

from .measurement import Case, describe_machine, median, processors, ratio, scaled, time_interleaved
from .report import Report, row
from .systems import BEAMS, IMPLICIT_TIME_STEP, SCHEME, TIME_STEP, simulate_beads, simulate_filaments

CHAINS, SEGMENTS = 200, 64
SPEED_UNIT = "10^6 segment steps/s"

_PRECISIONS = {"implicit": "automatic", "implicit_double": "double"}
_BEAMS = "implicit_beams"
_STOCK = ("stock_harmonic_angle", "stock_custom_angle")
_ONE_THREAD, _ALL_THREADS, _TWO_THREADS, _REFERENCE = "1_thread", "all_threads", "2_threads", "reference"


@dataclass(frozen=True)
class Effort:
    """How much is spent on measuring: repetitions, and seconds for each case in each of them."""

    repetitions: int
    seconds: float


FULL = Effort(repetitions=21, seconds=0.3)
QUICK = Effort(repetitions=5, seconds=0.1)


def benchmark_engines(effort=FULL, chains=CHAINS, segments=SEGMENTS, say=lambda message: None):
    """Measure the engines and stock OpenMM.

    Parameters
    ----------
    effort : Effort
    chains, segments : int
    say : callable (str), optional
        Told how far it is.

    Returns
    -------
    Report
    """
    machine = describe_machine()
    say("building")
    cases, missing = _cases(chains, segments)
    times = time_interleaved(cases, effort.repetitions, effort.seconds, say)
    rows, compared = engine_rows(times, chains * segments)
    settings = {
        "chains": chains,
        "segments_per_chain": segments,
        "particles": chains * (segments + 1),
        "time_step_ps": TIME_STEP,
        "scheme": SCHEME,
        "time_step_implicit_ps": IMPLICIT_TIME_STEP,
        "repetitions": effort.repetitions,
        "seconds_per_repetition": effort.seconds,
        "compared_on_one_thread": compared,
    }
    title = f"{chains} chains of {segments} segments, {effort.repetitions} interleaved repetitions"
    return Report(title, machine, settings, rows, missing)


def _cases(chains, segments):
    """All cases that can be measured here, and why others cannot."""
    missing = {f"{name} engine": reason for name, reason in available_engines().items() if reason is not None}
    families = {name: partial(simulate_filaments, name) for name in ENGINES if f"{name} engine" not in missing}
    if "compiled" in families:
        options = {"scheme": "implicit", "step": IMPLICIT_TIME_STEP}
        for name, precision in _PRECISIONS.items():
            families[name] = partial(simulate_filaments, "compiled", **options, precision=precision)
        families[_BEAMS] = partial(simulate_filaments, "compiled", scheme="implicit", step=None, filament_type=BEAMS)
    families |= {name: partial(simulate_beads, angle) for name, angle in zip(_STOCK, ("harmonic", "custom"))}
    cases = []
    for family, simulate in families.items():
        for suffix, (platform, properties) in _places().items():
            name = f"{family}_{suffix}"
            try:
                simulated = simulate(chains, segments, platform, properties)
            except openmm.OpenMMException as error:
                missing[name] = str(error)
            else:
                cases.append(Case(name, simulated.advance))
    return cases, missing


def _places():
    count = processors()
    places = {_REFERENCE: ("Reference", {}), _ONE_THREAD: ("CPU", {"Threads": "1"})}
    if count > 2:
        places[_TWO_THREADS] = ("CPU", {"Threads": "2"})
    if count > 1:
        places[_ALL_THREADS] = ("CPU", {"Threads": str(count)})
    return places


def engine_rows(times, segments):
    """Rows from the times of all cases, and which of them were compared on one thread.

    Parameters
    ----------
    times : dict
        Seconds per step of every case, one for each repetition.
    segments : int
        Segments that a step advances.

    Returns
    -------
    rows : list of Row
    compared : dict
    """
    rows = []
    for name, values in times.items():
        rows.append(row(f"time_per_step_{name}", scaled(median(values), 1e3), "ms"))
        rows.append(row(f"speed_{name}", median(1e-6 * segments / values), SPEED_UNIT))
    compared = {
        "compiled": _fastest(times, ("compiled",)),
        "portable": _fastest(times, ("portable",)),
        **{name: _fastest(times, (name,)) for name in (*_PRECISIONS, _BEAMS)},
        "stock_openmm": _fastest(times, _STOCK),
        "stock_openmm_custom_angle": _fastest(times, _STOCK[1:]),
    }
    compared = {name: case for name, case in compared.items() if case is not None}
    rows.extend(_one_thread_ratios(times, compared))
    rows.extend(_thread_ratios(times))
    return rows, compared


def _fastest(times, families):
    names = [f"{family}_{suffix}" for family in families for suffix in (_REFERENCE, _ONE_THREAD)]
    return min((name for name in names if name in times), key=lambda name: np.median(times[name]), default=None)


def _one_thread_ratios(times, compared):
    pairs = [("compiled", "portable"), ("compiled", "stock_openmm"), ("compiled", "stock_openmm_custom_angle")]
    pairs += [("portable", "stock_openmm"), ("portable", "stock_openmm_custom_angle"), tuple(_PRECISIONS)]
    pairs += [(name, _BEAMS) for name in _PRECISIONS]
    for numerator, denominator in pairs:
        if numerator in compared and denominator in compared:
            speeds = ratio(times[compared[denominator]], times[compared[numerator]])
            yield row(f"{numerator}_over_{denominator}", speeds, "1")


def _thread_ratios(times):
    two = f"compiled_{_TWO_THREADS}"
    two = two if two in times else f"compiled_{_ALL_THREADS}"
    pairs = {"two_threads_over_one": ("compiled", two)}
    pairs |= {f"{name}_all_threads_over_one": (name, f"{name}_{_ALL_THREADS}") for name in (*ENGINES, *_STOCK)}
    for name, (family, several) in pairs.items():
        one = f"{family}_{_ONE_THREAD}"
        if one in times and several in times:
            yield row(name, ratio(times[one], times[several]), "1")
