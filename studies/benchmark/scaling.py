"""Cost and memory per segment, from 10^2 to 10^6 segments in chains of 64, and of one chain of up to 10^5.

Costs are those of one thread, measured in turn in one run. ``memory`` says how memory is measured.
"""

from dataclasses import dataclass

import numpy as np

from openmm_cylchain.engine_choice import available_engines, choose_engine

from .measurement import Case, describe_machine, difference, median, ratio, scaled, time_interleaved
from .memory import STOCK, MeasurementError, measure_growth
from .report import Report, row
from .systems import SCHEME, TIME_STEP, one_thread_platform, simulate_filaments

CHAIN_LENGTH = 64
COST_UNIT = "ns per segment and step"
MEMORY_UNIT = "bytes per segment"


@dataclass(frozen=True)
class Effort:
    """How much is measured.

    Attributes
    ----------
    exponents_of_chains, exponents_of_one_chain : tuple of int
        Powers of ten of segments for which the cost is measured.
    exponents_of_memory : tuple of int
        Powers of ten of segments in chains of 64 for which memory is measured.
    exponents_of_memory_of_one_chain : tuple of int
    repetitions, memory_repetitions : int
    seconds : float
        For each size in each repetition.
    """

    exponents_of_chains: tuple
    exponents_of_one_chain: tuple
    exponents_of_memory: tuple
    exponents_of_memory_of_one_chain: tuple
    repetitions: int
    memory_repetitions: int
    seconds: float


# Where there is nothing but chains, the compiled engine takes many steps at once, all but the first of each call. A few
# steps of a large system would time that first one.
_MINIMUM_STEPS = {"compiled": 100, "portable": 1}

FULL = Effort((2, 3, 4, 5, 6), (2, 3, 4, 5), (2, 3, 4, 5, 6), (2, 3, 4, 5), 9, 3, 0.3)
QUICK = Effort((2, 3, 4), (2, 3, 4), (4,), (), 5, 2, 0.1)


@dataclass(frozen=True)
class Size:
    """A size of which there are rows: its family, the power of ten it stands for, and what it really is."""

    family: str
    exponent: int
    chains: int
    segments_per_chain: int

    @property
    def name(self):
        """Its part of the names of rows."""
        return f"{self.family}_1e{self.exponent}_segments"

    @property
    def segments(self):
        """All of its segments."""
        return self.chains * self.segments_per_chain


def many_chains(exponent):
    """The size of about 10^exponent segments in whole chains of 64."""
    chains = max(1, round(10**exponent / CHAIN_LENGTH))
    return Size(f"chains_of_{CHAIN_LENGTH}", exponent, chains, CHAIN_LENGTH)


def one_chain(exponent):
    """The size of one chain of 10^exponent segments."""
    return Size("one_chain", exponent, 1, 10**exponent)


def benchmark_scaling(engine=None, effort=FULL, say=lambda message: None):
    """Measure cost and memory per segment for many sizes.

    Parameters
    ----------
    engine : {"compiled", "portable"}, optional
        The fastest that is available if not given.
    effort : Effort
    say : callable (str), optional
        Told how far it is.

    Returns
    -------
    Report
    """
    engine = choose_engine(engine)
    missing = {f"{name} engine": reason for name, reason in available_engines().items() if reason is not None}
    machine = describe_machine()
    sizes = [many_chains(exponent) for exponent in effort.exponents_of_memory]
    sizes += [one_chain(exponent) for exponent in effort.exponents_of_memory_of_one_chain]
    # Memory comes first, before this process holds systems of its own.
    growths, failures = _measure_memory(engine, sizes, effort.memory_repetitions, say)
    missing |= failures
    sizes = [many_chains(exponent) for exponent in effort.exponents_of_chains]
    sizes += [one_chain(exponent) for exponent in effort.exponents_of_one_chain]
    minimum_steps = _MINIMUM_STEPS[engine]
    cases = list(_cases(engine, sizes, say))
    times = time_interleaved(cases, effort.repetitions, effort.seconds, say, minimum_steps)
    costs = {size: times[size.name] / size.segments for size in sizes}
    settings = {
        "engine": engine,
        "platform": one_thread_platform()[0],
        "threads": 1,
        "time_step_ps": TIME_STEP,
        "scheme": SCHEME,
        "repetitions": effort.repetitions,
        "memory_repetitions": effort.memory_repetitions,
        "seconds_per_repetition": effort.seconds,
        "minimum_steps_per_repetition": minimum_steps,
        "segments": {size.name: size.segments for size in sizes},
        "bytes_per_segment_measured_at": many_chains(max(effort.exponents_of_memory)).name,
    }
    title = f"{engine} engine, one thread, {effort.repetitions} interleaved repetitions"
    return Report(title, machine, settings, [*cost_rows(costs), *memory_rows(growths)], missing)


def _cases(engine, sizes, say):
    for size in sizes:
        say(f"building {size.name}")
        simulated = simulate_filaments(engine, size.chains, size.segments_per_chain, *one_thread_platform())
        yield Case(size.name, simulated.advance)


def _measure_memory(engine, sizes, repetitions, say):
    growths, failures = {}, {}
    for size in sizes:
        measured = {engine: [], STOCK: []}
        try:
            for repetition in range(repetitions):
                say(f"memory of {size.name}, repetition {repetition + 1} of {repetitions}")
                for kind, values in measured.items():
                    values.append(measure_growth(kind, size.chains, size.segments_per_chain))
        except MeasurementError as error:
            failures[f"memory_{size.name}"] = str(error)
        else:
            growths[size] = (measured[engine], measured[STOCK])
    return growths, failures


def cost_rows(costs):
    """Rows of costs, and of the ratio of the largest size of each family to every smaller one.

    Parameters
    ----------
    costs : dict
        Seconds per segment and step of every Size, one for each repetition.
    """
    rows = [row(f"cost_{size.name}", scaled(median(values), 1e9), COST_UNIT) for size, values in costs.items()]
    for family in dict.fromkeys(size.family for size in costs):
        *smaller, largest = sorted((size for size in costs if size.family == family), key=lambda size: size.exponent)
        # The name without a family is that of chains of 64.
        prefix = "cost" if family != "one_chain" else "cost_one_chain"
        for size in smaller:
            name = f"{prefix}_1e{largest.exponent}_over_1e{size.exponent}_segments"
            rows.append(row(name, ratio(costs[largest], costs[size]), "1"))
    return rows


def memory_rows(growths):
    """Rows of memory beyond stock OpenMM; without a size in their names, those of the largest in chains of 64.

    Parameters
    ----------
    growths : dict
        Lists of Growth of every Size: of filaments, and of stock beads.
    """
    rows = []
    for size, (filaments, stock) in growths.items():
        excess = _beyond(filaments, stock, size, "resident")
        rows.append(row(f"memory_{size.name}", excess, MEMORY_UNIT))
    many = [size for size in growths if size.family != "one_chain"]
    if not many:
        return rows
    largest = max(many, key=lambda size: size.exponent)
    filaments, stock = growths[largest]
    rows.append(row("bytes_per_segment", _beyond(filaments, stock, largest, "resident"), MEMORY_UNIT))
    rows.append(row("peak_bytes_per_segment", _beyond(filaments, stock, largest, "peak"), MEMORY_UNIT))
    for name, growth in (("filaments", filaments), ("stock", stock)):
        total = scaled(median(_bytes(growth, "resident")), 1.0 / largest.segments)
        rows.append(row(f"total_bytes_per_segment_of_{name}", total, MEMORY_UNIT))
    return rows


def _beyond(filaments, stock, size, quantity):
    return scaled(difference(_bytes(filaments, quantity), _bytes(stock, quantity)), 1.0 / size.segments)


def _bytes(growths, quantity):
    return np.array([getattr(growth, quantity) for growth in growths], dtype=float)
