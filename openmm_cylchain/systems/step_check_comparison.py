"""How runs with several steps are compared: errors of averages, their standard errors, and exact averages."""

import math
from typing import Any

import numpy as np
import openmm

from ..filaments.collection import FilamentCollection
from ..mechanics.flow import Flow
from ..theory import chain_mean_energies, chain_mean_square_end_to_end
from ..units.quantities import thermal_energy
from ..units.types import FloatArray
from .step_check_observables import Kind, Probe, interacting
from .step_check_results import ObservableCheck
from .step_check_rule import sigmas

_FEWEST_COPIES = 8
_WARM_UP = 0.25
_DEVIATIONS = 9.0
# In k_B T.
_STRAIN = 20.0


@np.errstate(over="ignore", invalid="ignore")
def compare(
    probe: Probe, windows: list[Any], parts: int, exact: "ExactAverages", seconds: float
) -> list[ObservableCheck]:
    """The ObservableChecks of values (windows, frames, 2, rows) that a Probe has measured, with h and with h/parts."""
    checks = []
    late = [frames[int(_WARM_UP * len(frames)) :] for frames in windows]
    for row, (name, unit, kind, what) in enumerate(probe.rows):
        # (2, windows, copies)
        series = np.array([[np.mean([run[row] for run in runs], axis=0) for runs in zip(*frames)] for frames in late])
        series = series.swapaxes(0, 1)
        coarse, fine = series.mean(axis=(1, 2))
        if coarse == fine == 0.0:
            # Nothing of the kind: a single segment does not bend, a clamped middle does not move.
            continue
        scale, influence = abs(fine), np.copysign(1.0, fine)
        if kind is None and scale < 1.0:
            # Energies of forces may have any sign: an error well below k_B T is none.
            scale, influence = 1.0, 0.0
        weight = parts / (parts - 1.0)
        error = float(weight * (coarse - fine) / scale)
        # How each window and copy contributes to the ratio.
        linear = weight * (series[0] - series[1]) - error * influence * series[1]
        standard_error, degrees = _standard_error(linear)
        deviation = exact.compare(kind, what, series[0])
        checks.append(
            ObservableCheck(
                name=name,
                unit=unit,
                values=(float(coarse), float(fine)),
                error=error,
                standard_error=standard_error / scale,
                unpaired_standard_error=weight
                * float(np.linalg.norm([_standard_error(one)[0] for one in series]))
                / scale,
                seconds=seconds,
                degrees=min(degrees, deviation.pop("degrees")),
                **deviation,
            )
        )
    return checks


def compare_growth(probe: Probe, starts: list[Any], step: float, looks: int, seconds: float) -> list[ObservableCheck]:
    """How long bends take to grow, for each kind of filaments of which they do.

    The bends of M modes are S, the mean over modes of square amplitudes over those in equilibrium. They grow if the
    mean of S over all runs becomes 1 + 9/M^(1/2) times as large as at the start and as in equilibrium, beyond what
    fluctuations do. Others are not looked at: what relaxes within a few steps is not resolved by a step that is right.

    Parameters
    ----------
    starts : list
        Of runs from the same start: square amplitudes (times, modes) of each kind, with h and with that of the
        reference.
    step : float
        h in ps.
    looks : int
        At the reference, within h.
    """
    checks = []
    for label, coarse, fine, beyond in _bends(probe, starts):
        if not np.isfinite(_time_to_grow(fine, beyond)):
            continue
        runs = np.arange(len(starts))
        slow, right = _times(coarse, fine, beyond, step, looks)
        without = np.array([_times(coarse[runs != out], fine[runs != out], beyond, step, looks) for out in runs])
        spread = math.sqrt(len(runs) - 1.0)
        ratios = without[:, 0] / without[:, 1]
        checks.append(
            ObservableCheck(
                name=f"{label} bends, time to grow",
                unit="us",
                values=(float(slow) / 1e6, float(right) / 1e6),
                error=float(slow / right - 1.0),
                standard_error=spread * float(ratios.std()),
                unpaired_standard_error=spread * float(np.linalg.norm(without.std(axis=0) / without.mean(axis=0))),
                exact=None,
                deviation=None,
                deviation_standard_error=None,
                judged_by_exact=False,
                seconds=seconds,
                degrees=len(runs) - 1.0,
            )
        )
    return checks


def bends_grow(probe: Probe, starts: list[Any]) -> bool:
    """Whether ``compare_growth`` has anything to look at."""
    return any(np.isfinite(_time_to_grow(fine, beyond)) for _, _, fine, beyond in _bends(probe, starts))


def _bends(probe, starts):
    # Of each kind: its label, S (runs, times) with h and of the reference, and where they have grown.
    labels = [kind.label for kind in probe.kinds if not kind.filament.closed]
    for number, (label, equilibrium) in enumerate(zip(labels, probe.equilibrium_amplitudes())):
        if len(equilibrium) and len(starts) > 1:
            coarse, fine = (
                np.array([[np.mean(look[number] / equilibrium) for look in runs[which]] for runs in starts])
                for which in range(2)
            )
            yield label, coarse, fine, 1.0 + _DEVIATIONS / math.sqrt(len(equilibrium))


def _times(coarse, fine, beyond, step, looks):
    # In ps. Bends that do not get there have taken the longest time that there is, at least.
    times = step * _time_to_grow(coarse, beyond), step * _time_to_grow(fine, beyond) / looks
    return np.minimum(times, step * (coarse.shape[1] - 1))


def _time_to_grow(runs, beyond):
    # In looks: growth is exponential between two of them. Infinite if they do not grow so far.
    bends = runs.mean(axis=0)
    aim = beyond * max(1.0, bends[0])
    if not np.any(bends >= aim):
        return math.inf
    last = int(np.argmax(bends >= aim))
    if bends[last - 1] <= 0.0:
        return float(last)
    return last - 1 + math.log(aim / bends[last - 1]) / math.log(bends[last] / bends[last - 1])


def find_strained(probe: Probe, windows: list[Any], energies: list[FloatArray]) -> tuple[str, ...]:
    """Forces whose energies, (1,) each in k_B T, are far above those that the reference has in values of a Probe."""
    first = len(probe.rows) - len(energies)
    names = [name for name, *_ in probe.rows[first:]]
    later = [
        np.mean([frame[-1][first + number] for frames in windows for frame in frames]) for number in range(len(names))
    ]
    return tuple(name for name, own, mean in zip(names, energies, later) if own[0] > 2.0 * max(mean, 0.0) + _STRAIN)


def _standard_error(samples):
    # Of the mean of (windows, copies), and its degrees of freedom: of windows, whose noise is independent, or of
    # copies, where there are many, whichever is larger.
    found = [_of_mean(samples.mean(axis=1))]
    if samples.shape[1] >= _FEWEST_COPIES:
        found.append(_of_mean(samples.mean(axis=0)))
    return max(found, key=lambda one: one[0] * sigmas(one[1]))


def _of_mean(values):
    count = len(values)
    if count < 2:
        return math.inf, math.inf
    return float(values.std(ddof=1)) / math.sqrt(count), count - 1.0


class ExactAverages:
    """Exact averages of filaments that nothing acts on, and how far those of a run are off."""

    def __init__(
        self,
        filaments: FilamentCollection,
        system: openmm.System,
        flow: Flow | None,
        temperature: float,
        equilibrium: bool,
        lasting: bool,
    ) -> None:
        self._free = not interacting(filaments, system) and flow is None
        self._temperature, self._kT = temperature, thermal_energy(temperature)
        self._equilibrium, self._lasting = equilibrium, lasting

    def compare(self, kind: Kind | None, what: str, series: FloatArray) -> dict[str, Any]:
        """What an ObservableCheck says of the exact average, with the values (windows, copies) with h."""
        exact = self._average(kind, what)
        if exact is None:
            unknown = {name: None for name in ("exact", "deviation", "deviation_standard_error")}
            return {**unknown, "judged_by_exact": False, "degrees": math.inf}
        # Time tells little of a few filaments that keep their shape.
        known = self._lasting or series.shape[1] >= _FEWEST_COPIES
        standard_error, degrees = _standard_error(series)
        return {
            "exact": float(exact),
            "deviation": float(series.mean() / exact - 1.0),
            "deviation_standard_error": standard_error / exact if known else math.inf,
            "judged_by_exact": self._equilibrium,
            "degrees": degrees,
        }

    def _average(self, kind, what):
        if kind is None or not self._free:
            return None
        one = kind.filament
        if one.closed or one.clamped or one.propulsion or one.rest_bends is not None:
            return None
        if one.planar and not one.type.segment_kind.straight:
            return None
        free = one.type, one.segments, self._temperature, one.planar
        if what == "distance":
            return chain_mean_square_end_to_end(*free)
        if what not in ("stretching", "bending"):
            return None
        stretching, bending = chain_mean_energies(*free)
        return (stretching if what == "stretching" else bending) / self._kT
