"""Segments of any length beside touching beads: an actin filament of 1.2 µm, as in Fig. 6 of the paper.

The beads are moved by OpenMM's BrownianIntegrator, with its own bonds and angles: 201 beads of 6 nm that touch, with
the stretching modulus and the bending rigidity of the filament and the friction 3 pi eta d of each. Their step is the
largest of 0.1, 0.2, 0.5, 1 … ps at which the mean energies of bonds and angles are within 5 % of the exact ones.
Segments of 10 to 1200 nm are moved by scheme "implicit", with the recommended step, which resolves the slowest
relaxation of the filament, or the largest at which energies and end-to-end distance are within 5 % and dynamics within
10 %, if that is smaller: see ``time_step``. As many filaments of either kind are timed in turn.
"""

import math
from dataclasses import dataclass

import numpy as np
import openmm

from openmm_cylchain import F_ACTIN
from openmm_cylchain.engine_choice import choose_engine
from openmm_cylchain.filaments.equilibrium import draw_chain
from openmm_cylchain.filaments.filament_type import FilamentType
from openmm_cylchain.theory import bending_energy_mean, stretching_energy_mean
from openmm_cylchain.units.text import format_time

from .measurement import Case, Estimate, describe_machine, median, ratio, scaled, time_interleaved
from .report import Report, row
from .systems import bonds, harmonic_angles, one_thread_context
from .time_step import CRITERIA, Effort, ladder, measure_system, stepper, system_stepper
from .time_step_systems import F_ACTIN_SYSTEM, STRETCHING_MODULUS, BenchmarkSystem, actin

CONTOUR_LENGTH = 1200.0
SEGMENTS = (120, 60, 40, 20, 10, 5, 3, 2, 1)
ENERGY_ERROR = 0.05

_MICROSECOND = 1e6
_BEAD_STEPS = ladder(0.1, 20.0)


@dataclass(frozen=True)
class BeadEffort:
    """How much is measured: numbers of segments, chains, steps of the beads, and the effort for segments."""

    segments: tuple
    chains: int
    bead_steps: int
    segment_effort: Effort


FULL = BeadEffort(SEGMENTS, 64, 2000, Effort((), frames=240, share=1.0, every=1, repetitions=9))
QUICK = BeadEffort((60, 3), 16, 400, Effort((), frames=80, share=0.5, every=3, repetitions=3))


def benchmark_bead_spring(effort=FULL, say=lambda message: None):
    """Measure simulated time per second of segments of all lengths over that of touching beads.

    Returns
    -------
    Report

    Raises
    ------
    InputError
        If there is no compiled engine, which has the scheme that is measured.
    """
    choose_engine("compiled")
    machine = describe_machine()
    rows, missing, cases, steps = [], {}, [], {}
    beads = _Beads(effort.chains)
    bead_step = beads.largest_step(effort.bead_steps, say)
    rows.append(row("largest_step_beads", Estimate(bead_step / _MICROSECOND, None), "us"))
    cases.append(Case("beads", stepper(beads.context(bead_step))))
    for count in effort.segments:
        system = _segments_system(count, effort.chains)
        result = measure_system(system, effort.segment_effort, say, ("implicit",))
        largest = result.largest_step("implicit", *CRITERIA[""])
        if largest is None:
            missing[system.name] = "no step that was tried is accurate enough"
            continue
        step = min(largest.step, result.recommended)
        steps[system.name] = step
        rows.append(row(f"largest_step_{system.name}", Estimate(largest.step / _MICROSECOND, None), "us"))
        rows.append(row(f"step_{system.name}", Estimate(step / _MICROSECOND, None), "us"))
        cases.append(Case(system.name, system_stepper(system, "implicit", step)))
    times = time_interleaved(cases, effort.segment_effort.repetitions, 0.2, say)
    speeds = {name: ratio(times["beads"], times[name]) for name in steps}
    simulated = {name: scaled(speeds[name], step / bead_step) for name, step in steps.items()}
    rows.append(row("time_per_step_and_chain_beads", scaled(median(times["beads"]), 1e6 / effort.chains), "us"))
    for name in steps:
        rows.append(row(f"time_per_step_and_chain_{name}", scaled(median(times[name]), 1e6 / effort.chains), "us"))
    rows += [row(f"steps_per_second_over_bead_spring_{name}", speed, "1") for name, speed in speeds.items()]
    rows += [row(f"simulated_time_over_bead_spring_{name}", factor, "1") for name, factor in simulated.items()]
    if simulated:
        best = max(simulated.values(), key=lambda factor: factor.value)
        rows.append(row("simulated_time_over_bead_spring", best, "1"))
    settings = {
        "contour_length_nm": CONTOUR_LENGTH,
        "beads": beads.count,
        "chains": effort.chains,
        "energy_error": ENERGY_ERROR,
        "bead_steps": effort.bead_steps,
        "threads": 1,
    }
    title = f"An actin filament of {CONTOUR_LENGTH:g} nm: segments beside {beads.count} touching beads, one thread"
    return Report(title, machine, settings, rows, missing)


def bead_stepper(chains, step, stretching_modulus=STRETCHING_MODULUS, platform=None):
    """What advances filaments of touching beads by a number of steps, for timing.

    Parameters
    ----------
    chains : int
    step : float
        In ps.
    stretching_modulus : float
        In kJ/(mol nm).
    platform : tuple of str and dict, optional
        A name and properties, if it is not that on which one thread computes.
    """
    return stepper(_Beads(chains, stretching_modulus).context(step, platform))


def _segments_system(count, chains):
    length = CONTOUR_LENGTH / count
    return BenchmarkSystem(f"segments_{length:g}nm", f"{count} × {length:g} nm", actin(length), count, chains)


class _Beads:
    """Chains of touching beads of stock OpenMM."""

    def __init__(self, chains, stretching_modulus=STRETCHING_MODULUS):
        diameter = F_ACTIN.diameter
        self._chains = chains
        self.count = round(CONTOUR_LENGTH / diameter) + 1
        self._type = FilamentType(
            name="BEAD",
            # Any that is thinner than long; only the energies of this type are used.
            diameter=0.5 * diameter,
            segment_length=diameter,
            bending_rigidity=F_ACTIN.bending_rigidity,
            bending_model="quadratic",
            stretching_modulus=stretching_modulus,
        )
        self._temperature = F_ACTIN_SYSTEM.temperature
        self._friction = 3.0 * math.pi * F_ACTIN_SYSTEM.viscosity * diameter
        generator = np.random.default_rng(1)
        self._positions = np.concatenate(
            [draw_chain(self._type, self.count - 1, self._temperature, generator) for _ in range(chains)]
        )

    def context(self, step, platform=None):
        system = openmm.System()
        for _ in range(self._chains * self.count):
            system.addParticle(1.0)
        angles = harmonic_angles(self._type, self._chains, self.count - 1)
        angles.setForceGroup(1)
        system.addForce(bonds(self._type, self._chains, self.count - 1))
        system.addForce(angles)
        integrator = openmm.BrownianIntegrator(self._temperature, self._friction, step)
        integrator.setRandomNumberSeed(1)
        return one_thread_context(system, integrator, self._positions, platform)

    def largest_step(self, steps, say):
        """The largest step that keeps the energies, together with all smaller ones."""
        largest = None
        for step in _BEAD_STEPS:
            say(f"{self.count} beads: {format_time(step, 2)}")
            if not max(self._energy_errors(step, steps)) <= ENERGY_ERROR:
                break
            largest = step
        if largest is None:
            raise RuntimeError(f"the beads are not accurate with a step of {_BEAD_STEPS[0]} ps")
        return largest

    def _energy_errors(self, step, steps):
        context = self.context(step)
        context.getIntegrator().step(steps // 4)
        energies = []
        for _ in range(50):
            try:
                context.getIntegrator().step(max(1, 3 * steps // 200))
            except openmm.OpenMMException:
                return [math.inf]
            states = [context.getState(energy=True, groups={group}) for group in (0, 1)]
            energies.append([state.getPotentialEnergy()._value for state in states])
        means = np.mean(energies, axis=0) / self._chains
        exact = (
            (self.count - 1) * stretching_energy_mean(self._type, self._temperature),
            (self.count - 2) * bending_energy_mean(self._type, self._temperature),
        )
        return [abs(mean / value - 1.0) for mean, value in zip(means, exact)]
