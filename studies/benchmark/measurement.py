"""Timing: interleaved repetitions, medians and ratios with their errors, and what machine it was.

Whatever disturbs a machine for a while (other processes, heat) disturbs neighbouring measurements alike.
So all cases take turns, A B C A B C, and a ratio is taken within each repetition before it is averaged.
"""

import os
import platform
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from openmm_cylchain.runs.information import versions

_MEDIAN_OVER_MEAN = np.sqrt(0.5 * np.pi)
_INSTRUCTION_SETS = ("sse4_2", "avx", "avx2", "fma", "avx512f", "asimd", "sve")


@dataclass(frozen=True)
class Case:
    """One of the things that are timed: its name and what advances it by a number of steps."""

    name: str
    advance: Callable


@dataclass(frozen=True)
class Estimate:
    """A value and its standard error, which is None if there is only one measurement."""

    value: float
    error: float | None


def time_interleaved(cases, repetitions, seconds, say=lambda message: None, minimum_steps=1, clock=None):
    """Time cases in turn, over and over.

    Parameters
    ----------
    cases : sequence of Case
    repetitions : int
        How many times every case is timed.
    seconds : float
        About how long a case advances in each repetition.
    say : callable (str), optional
        Told how far it is.
    minimum_steps : int
        How many steps a case advances in each repetition at least.
    clock : callable, optional
        Tells the time in seconds; that on the wall if not given. ``time.process_time`` tells that of processors, which
        for one thread is the same but for waiting while other processes run.

    Returns
    -------
    dict
        The seconds per step of every case, one for each repetition.
    """
    clock = time.perf_counter if clock is None else clock
    say("warming up")
    steps = {case.name: max(minimum_steps, _steps_within(case, seconds, clock)) for case in cases}
    times = {case.name: [] for case in cases}
    for repetition in range(repetitions):
        say(f"timing, repetition {repetition + 1} of {repetitions}")
        for case in cases:
            times[case.name].append(_seconds_per_step(case, steps[case.name], clock))
    return {name: np.array(values) for name, values in times.items()}


def _seconds_per_step(case, steps, clock):
    start = clock()
    case.advance(steps)
    return (clock() - start) / steps


def _steps_within(case, seconds, clock):
    case.advance(1)
    steps = 1
    while True:
        elapsed = steps * _seconds_per_step(case, steps, clock)
        if elapsed > 0.2 * seconds:
            return max(1, round(steps * seconds / elapsed))
        steps *= 4


def median(values):
    """The median of measurements with its standard error, for a normal distribution: sqrt(pi/2) s/sqrt(n)."""
    values = np.asarray(values, dtype=float)
    if len(values) < 2:
        return Estimate(float(np.median(values)), None)
    error = _MEDIAN_OVER_MEAN * np.std(values, ddof=1) / np.sqrt(len(values))
    return Estimate(float(np.median(values)), float(error))


def ratio(numerators, denominators):
    """The median of the ratios of paired measurements, its error from the spread of their logarithms."""
    logarithm = median(np.log(np.asarray(numerators) / np.asarray(denominators)))
    value = float(np.exp(logarithm.value))
    return Estimate(value, None if logarithm.error is None else value * logarithm.error)


def difference(values, subtracted):
    """The difference of the medians of two independent sets of measurements."""
    first, second = median(values), median(subtracted)
    errors = (first.error, second.error)
    return Estimate(first.value - second.value, None if None in errors else float(np.hypot(*errors)))


def scaled(estimate, factor):
    """An estimate times an exact number."""
    error = None if estimate.error is None else estimate.error * abs(factor)
    return Estimate(estimate.value * factor, error)


def processors():
    """How many processors this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def describe_machine():
    """The machine and the software that a measurement was made with, as a dict for JSON."""
    model, instruction_sets = _processor()
    return {
        "processor": model,
        "instruction_sets": instruction_sets,
        "architecture": platform.machine(),
        "processors": processors(),
        "memory_bytes": _memory(),
        "load_average": os.getloadavg()[0] if hasattr(os, "getloadavg") else None,
        "operating_system": f"{platform.system()} {platform.release()}",
        "versions": versions(),
        "date": time.strftime("%Y-%m-%dT%H:%M:%SZ", time.gmtime()),
    }


def _processor():
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
    except OSError:
        return platform.processor() or platform.machine(), None
    fields = {key.strip(): value.strip() for key, _, value in (line.partition(":") for line in lines)}
    flags = fields.get("flags", fields.get("Features", "")).split()
    return fields.get("model name", platform.machine()), [name for name in _INSTRUCTION_SETS if name in flags]


def _memory():
    try:
        return os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    except (AttributeError, OSError, ValueError):
        return None
