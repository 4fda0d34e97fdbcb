"""Straight filaments whose first node is trapped, over nine decades of time.

Each stage of these has a step of its own and begins anew at the start; where two of these stages meet, they must
agree.
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import eigh

from openmm_cylchain.theory import bending_energy_mean, stretching_energy_mean

from . import simulation
from .result import Estimate, Result, Rule
from .table_2 import ACTIN, MICROSECOND, SOLVENT_TEMPERATURE, THERMAL_ENERGY, actin_friction
from .transverse_modes import transverse_matrices

SEGMENTS = 64
CONTOUR_LENGTH = SEGMENTS * ACTIN.segment_length
STEPS = (1e-4, 2e-3, 0.05, 2.0, 50.0)
"""Time steps in us."""
ENDS = (0.04, 1.0, 40.0, 1e3, 1e5)
"""Of the stages, in us."""
_COMPARED_MOMENTS = (10.0, 100.0)
_FEWEST_STEPS = 10
_MOMENTS_OF_A_STAGE = 40
_GROUPS = 40
_COMPARED = ("bending", "stretching", "shortening", "shortening")
_OVERLAP_RULE = Rule(3.0, 0.03, 0.06)


def relaxing_filaments(extension_time_microseconds, chains, step_microseconds, steps, seed, scheme="implicit"):
    """Straight filaments with their first node in a trap as stiff as a segment, after given numbers of steps.

    Returns
    -------
    dict of arrays
        ``time`` in us; means over groups of filaments, (times, groups): ``shortening`` L - R.e in nm, and the energies
        ``stretching`` of a segment and ``bending`` of a joint over k_B T.
    """
    kind = replace(simulation.ACTIN, extension_relaxation_time=extension_time_microseconds * MICROSECOND)
    filaments = simulation.solvent()
    for chain in range(chains):
        filaments.add_straight(kind, SEGMENTS, [0, 0, 0], [1, 0, 0])
        filaments.add_tether(chain, 0, [0, 0, 0], kind.segment_stiffness)
    context = simulation.start(filaments, step_microseconds * MICROSECOND, seed, scheme=scheme)
    rows = []
    for nodes in simulation.frames(context, chains, steps):
        vectors = np.diff(nodes, axis=1)
        lengths = np.linalg.norm(vectors, axis=2)
        tangents = vectors / lengths[:, :, None]
        cosines = np.sum(tangents[:, 1:] * tangents[:, :-1], axis=2)
        shortening = CONTOUR_LENGTH - (nodes[:, -1, 0] - nodes[:, 0, 0])
        stretching = kind.stretching_energy(lengths).mean(axis=1) / THERMAL_ENERGY
        bending = kind.bending_energy(cosines).mean(axis=1) / THERMAL_ENERGY
        rows.append([simulation.groups(values, _GROUPS) for values in (shortening, stretching, bending)])
    columns = dict(zip(("shortening", "stretching", "bending"), np.transpose(rows, (1, 0, 2))))
    return {"time": np.array(steps) * step_microseconds, **columns}


@dataclass(frozen=True)
class Relaxation:
    """The stages of one relaxation time of a length.

    Attributes
    ----------
    extension_time : float
        Relaxation time of a length in us.
    stages : list of dict
        What ``relaxing_filaments`` returns, with longer and longer steps.
    """

    extension_time: float
    stages: list

    def joined(self, name):
        """(time in us, values by group): of each stage what lies beyond the end of the one with shorter steps."""
        times, values, end = [], [], 0.0
        for stage in self.stages:
            later = stage["time"] > 1.001 * end
            times.append(stage["time"][later])
            values.append(stage[name][later])
            end = stage["time"][-1]
        return np.concatenate(times), np.concatenate(values)

    def exponent(self, name, window):
        """Slope of the logarithms within a window of times in us: an Estimate."""
        time, values = self.joined(name)
        inside = (time >= 0.999 * window[0]) & (time <= 1.001 * window[1])
        return simulation.jackknife(lambda mean: np.polyfit(np.log(time[inside]), np.log(mean), 1)[0], values[inside])

    def at(self, name, moment):
        """The mean at a moment in us, an Estimate."""
        return _mean_at(*self.joined(name), moment)

    def late(self, name):
        """The mean over the last nine tenths of the time, an Estimate."""
        time, values = self.joined(name)
        mean = simulation.mean(values[time > 0.1 * time[-1]].mean(axis=0))
        return Estimate(float(mean.value), float(mean.error))

    def overlaps(self):
        """Results: where a stage ends, that with longer steps has the same mean."""
        for number, name in enumerate(_COMPARED[: len(self.stages) - 1]):
            moment = self.stages[number]["time"][-1]
            pair = self.stages[number : number + 2]
            short, long = (_mean_at(stage["time"], stage[name], moment) for stage in pair)
            steps = f"{STEPS[number + 1]:g}_over_{STEPS[number]:g}_us"
            label = f"{name}_at_{moment:g}_us_with_steps_of_{steps}_extension_time_{self.extension_time:g}_us"
            yield Result(label, "1", ratio(long, short), _OVERLAP_RULE, 1.0)


def _mean_at(time, values, moment):
    return simulation.mean(values[int(np.argmin(np.abs(time - moment)))])


def ratio(first, second):
    """The ratio of two independent Estimates."""
    value = first.value / second.value
    return Estimate(float(value), float(value * np.hypot(first.error / first.value, second.error / second.value)))


def measure_relaxation(records, extension_time, chains):
    """A Relaxation with a relaxation time of lengths in us.

    Parameters
    ----------
    records : Records
    extension_time : float
    chains : int
    """
    stages = []
    for number, step in enumerate(STEPS):
        stages.append(
            records.measure(
                f"figure-15-18-extension-time-{extension_time:g}-us-step-{step:g}-us",
                relaxing_filaments,
                extension_time_microseconds=extension_time,
                chains=chains,
                step_microseconds=step,
                steps=_steps(number),
                seed=15 + number,
            )
        )
    return Relaxation(extension_time, stages)


def _steps(number):
    # Those of a stage after which there is a frame, with the end of the stage before.
    step, end = STEPS[number], ENDS[number]
    first = _FEWEST_STEPS if number else 1
    spaced = np.geomspace(first, round(end / step), _MOMENTS_OF_A_STAGE).round().astype(int).tolist()
    moments = [moment for moment in (*_COMPARED_MOMENTS, *ENDS[:number][-1:]) if first * step <= moment <= end]
    return sorted({*spaced, *(round(moment / step) for moment in moments)})


def equilibrium(name):
    """Mean energy in equilibrium over k_B T, (40) and (42); of "stretching" per segment, of "bending" per joint."""
    mean = {"stretching": stretching_energy_mean, "bending": bending_energy_mean}[name]
    return mean(ACTIN, SOLVENT_TEMPERATURE) / THERMAL_ENERGY


def linear_relaxation(time):
    """Bending energy of a joint over k_B T, and shortening in nm, of small transverse motion without tension.

    The transverse coordinates y of the nodes obey Z dy/dt = -K y + noise from y = 0, so that each mode v of K v = w Z v
    has the variance k_B T (1 - exp(-2 w t))/w. Lengths stay what they are, and nothing resists along the filament.

    Parameters
    ----------
    time : (times,) array in us

    Returns
    -------
    (bending, shortening) : (times,) arrays
    """
    length = ACTIN.segment_length
    resistance, stiffness = transverse_matrices(ACTIN.bending_rigidity, actin_friction(), length, SEGMENTS)
    trapped = stiffness.copy()
    trapped[0, 0] += ACTIN.segment_stiffness
    rates, modes = eigh(trapped, resistance)
    # A chain that is held at one node turns about it freely, at a rate that rounding may make negative.
    rates = np.maximum(rates, 1e-12 * rates[-1])
    bent = np.sum(modes * (stiffness @ modes), axis=0)
    tilted = np.sum((np.diff(modes, axis=0) / length) ** 2, axis=0)
    # Two transverse directions, each with half of an energy and half of what a tilt takes from the extension.
    variance = -np.expm1(-2.0 * np.outer(np.asarray(time) * MICROSECOND, rates)) / rates
    return variance @ bent / (SEGMENTS - 1), THERMAL_ENERGY * length * (variance @ tilted)
