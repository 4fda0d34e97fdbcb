"""DNA base pair by base pair: the mode-space integrator of Panja et al. beside scheme "implicit", each at its largest
step; and one chain of up to 10^5 beads in scheme "implicit".

Chains of 63 to 511 bonds of ``DSDNA_BASE_PAIRS``, on one thread, timed in turn. The step of scheme "modes" is the
largest of Table II of Panja, Barkema and van Leeuwen, Phys. Rev. E 2015, 92, 032603, for averages and motion. That of
scheme "implicit" is the largest found by the same rule: averages within 5 %, and what the end-to-end vector, the middle
bond and the middle bead (from the center of the chain) move in three steps within 10 %. The benchmark measures both
again. The reference of the motion is scheme "implicit" with a thirtieth of the step, which is that of scheme "modes" at
its shortest steps: tests/bead_spring/test_bead_spring_dynamics.py.
"""

from dataclasses import dataclass

import numpy as np

from bead_spring_observables import observables
from openmm_cylchain.bead_spring.bead_spring_type import DSDNA_BASE_PAIRS
from openmm_cylchain.bead_spring.equilibrium import bead_spring_bond_correlations
from openmm_cylchain.engine_choice import choose_engine
from openmm_cylchain.systems.filaments import Filaments
from openmm_cylchain.units.text import format_time

from .measurement import Case, Estimate, describe_machine, median, ratio, scaled, time_interleaved
from .report import Report, row
from .systems import one_thread_context
from .time_step import stepper

TEMPERATURE = 296.15
MODES_STEPS = {63: 10.0, 127: 50.0, 255: 100.0, 511: 100.0}
"""In units of tau: Table II, last column."""

IMPLICIT_STEPS = {63: 1e4, 127: 3e4, 255: 7e4, 511: 7e4}
"""In units of tau: see above."""

STEP_OF_ONE_CHAIN = 1e4
"""In units of tau: the recommended step."""

LAG = 3
_RESOLVED = 30
_VISCOSITY = 602.0
_MILLISECONDS_PER_HOUR = 3600.0 * 1e-9
OBSERVABLES = ("end_to_end", "middle_bond", "middle_bead")


@dataclass(frozen=True)
class BasePairEffort:
    """How much is measured: numbers of bonds, chains of each, lags that motion is followed for, and timing; and the
    numbers of beads of one chain."""

    bonds: tuple
    chains: int
    lags: int
    repetitions: int
    seconds: float
    beads_of_one_chain: tuple


FULL = BasePairEffort((63, 127, 255, 511), 128, 40, 9, 1.0, (100, 1000, 10_000, 100_000))
QUICK = BasePairEffort((63, 127), 64, 12, 3, 0.3, (100, 1000))


def benchmark_base_pairs(effort=FULL, say=lambda message: None):
    """Measure the simulated time per hour of both schemes, and the errors of scheme "implicit" at its step; and what a
    bead of one chain takes, however long it is.

    Returns
    -------
    Report

    Raises
    ------
    InputError
        If there is no compiled engine, which has the schemes that are measured.
    """
    choose_engine("compiled")
    machine = describe_machine()
    unit = DSDNA_BASE_PAIRS.time_unit
    rows, cases, errors = [], [], []
    for bonds in effort.bonds:
        errors += list(_error_rows(bonds, effort, say))
        for scheme, steps in (("modes", MODES_STEPS), ("implicit", IMPLICIT_STEPS)):
            step = steps[bonds] * unit
            rows.append(row(f"step_{scheme}_{bonds}", Estimate(step, None), "ps"))
            context = _context(bonds, effort.chains, scheme, step)
            cases.append(Case(f"{scheme}_{bonds}", stepper(context)))
    times = time_interleaved(cases, effort.repetitions, effort.seconds, say)
    for bonds in effort.bonds:
        speeds = {}
        for scheme, steps in (("modes", MODES_STEPS), ("implicit", IMPLICIT_STEPS)):
            name = f"{scheme}_{bonds}"
            nanoseconds = scaled(median(times[name]), 1e9 / (effort.chains * (bonds + 1)))
            rows.append(row(f"time_per_step_and_bead_{name}", nanoseconds, "ns"))
            speeds[scheme] = effort.chains * steps[bonds] * unit * _MILLISECONDS_PER_HOUR / times[name]
            rows.append(row(f"simulated_ms_per_hour_{name}", median(speeds[scheme]), "ms"))
        rows.append(row(f"implicit_over_modes_{bonds}", ratio(speeds["implicit"], speeds["modes"]), "1"))
    rows += _rows_of_one_chain(effort, say)
    settings = {"chains": effort.chains, "lag_in_steps": LAG, "lags": effort.lags, "threads": 1}
    title = f"{effort.chains} chains of DNA base pair by base pair, one thread: simulated time per hour and chain"
    return Report(title, machine, settings, rows + errors, {})


def _filaments(bonds, chains):
    filaments = Filaments(_VISCOSITY, TEMPERATURE, engine="compiled")
    for chain in range(chains):
        filaments.add_equilibrium(DSDNA_BASE_PAIRS, bonds, seed=chain + 1)
    return filaments


def _context(bonds, chains, scheme, step):
    filaments = _filaments(bonds, chains)
    _, system, positions = filaments.build()
    integrator = filaments.create_integrator(system, step, scheme=scheme, random_seed=1, checks=False)
    return one_thread_context(system, integrator, positions)


def _rows_of_one_chain(effort, say):
    step = STEP_OF_ONE_CHAIN * DSDNA_BASE_PAIRS.time_unit
    cases = []
    for beads in effort.beads_of_one_chain:
        say(f"building a chain of {beads} beads")
        cases.append(Case(str(beads), stepper(_context(beads - 1, 1, "implicit", step))))
    times = time_interleaved(cases, effort.repetitions, effort.seconds, say)
    costs = {beads: times[str(beads)] / beads for beads in effort.beads_of_one_chain}
    rows = [row(f"time_per_bead_{beads}", scaled(median(cost), 1e6), "us") for beads, cost in costs.items()]
    shortest, *longer = costs
    for beads in longer:
        name = f"time_per_bead_{beads}_over_{shortest}"
        rows.append(row(name, ratio(costs[beads], costs[shortest]), "1"))
    return rows


def _error_rows(bonds, effort, say):
    """Rows of the relative errors of scheme "implicit" at its largest step."""
    step = IMPLICIT_STEPS[bonds] * DSDNA_BASE_PAIRS.time_unit
    say(f"errors of {bonds} bonds at {format_time(step)}")
    moved, correlation = _motion_and_correlation(bonds, effort, step, LAG)
    expected, _ = _motion_and_correlation(bonds, effort, step / _RESOLVED, LAG * _RESOLVED)
    for name, found, reference in zip(OBSERVABLES, moved.T, expected.T):
        yield row(f"error_of_motion_{name}_implicit_{bonds}", _relative(found, reference), "1")
    exact = _correlation_of_neighbors(bonds)
    yield row(f"error_of_bond_correlation_implicit_{bonds}", _relative(correlation, np.array([exact])), "1")


def _correlation_of_neighbors(bonds):
    correlations = bead_spring_bond_correlations(DSDNA_BASE_PAIRS, bonds, TEMPERATURE)
    return float(np.mean(np.diagonal(correlations, _distance(bonds))))


def _distance(bonds):
    # Bonds that are a tenth of a persistence length apart, whose correlation is in equilibrium within a few steps.
    return min(10, bonds - 1)


def _motion_and_correlation(bonds, effort, step, steps):
    """The mean square motion (chains, 3) in nm^2 over so many steps, and <u_n.u_(n+k)> (chains,) in nm^2."""
    context = _context(bonds, effort.chains, "implicit", step)
    before, moved, correlations = None, 0.0, 0.0
    for _ in range(effort.lags + 1):
        nodes = context.getState(positions=True).getPositions(asNumpy=True)._value
        nodes = nodes.reshape(effort.chains, bonds + 1, 3)
        now = observables(nodes)
        if before is not None:
            moved += np.sum((now - before) ** 2, axis=2) / effort.lags
            vectors = np.diff(nodes, axis=1)
            products = np.sum(vectors[:, _distance(bonds) :] * vectors[:, : -_distance(bonds)], axis=2)
            correlations += products.mean(axis=1) / effort.lags
        before = now
        context.getIntegrator().step(steps)
    return moved, correlations


def _relative(found, expected):
    errors = [
        values.std(ddof=1) / np.sqrt(len(values)) / values.mean() for values in (found, expected) if len(values) > 1
    ]
    value = found.mean() / expected.mean()
    return Estimate(float(value - 1.0), float(value * np.sqrt(np.sum(np.square(errors)))))
