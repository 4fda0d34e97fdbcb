"""How runs with several steps are compared: errors of averages, their standard errors, and exact averages."""

import math
from typing import Any

import numpy as np
import openmm

from ..bead_spring.bead_spring_type import BeadSpringType
from ..filaments.collection import FilamentCollection
from ..mechanics.flow import Flow
from ..theory import (
    bead_spring_bending_energies,
    bead_spring_stretching_energies,
    bending_energy_mean,
    chain_mean_square_end_to_end,
    stretching_energy_mean,
)
from ..theory.beam_elements import beam_averages, beam_mean_square_end_to_end, beam_stretching_energy_mean
from ..units.quantities import thermal_energy
from ..units.types import FloatArray
from .step_check_observables import Kind, Probe, interacting
from .step_check_results import ObservableCheck

WEIGHTS = {2: (2.0, -2.0), 3: (2.0 / 3.0, 2.0, -8.0 / 3.0)}
"""How averages with h, h/2 and h/4 make the error of the first, by their number."""

_BLOCKS = (32, 16)
_FEWEST_COPIES = 8
_WARM_UP = 0.25


@np.errstate(over="ignore", invalid="ignore")
def compare(probe: Probe, records: list[Any], exact: "ExactAverages", seconds: float) -> list[ObservableCheck]:
    """The ObservableChecks of values (frames, levels, rows) that a Probe has measured."""
    late = records[int(_WARM_UP * len(records)) :]
    checks = []
    for row, (name, unit, kind, what) in enumerate(probe.rows):
        # (levels, frames, copies)
        series = np.array([[level[row] for level in frame] for frame in late]).swapaxes(0, 1)
        means = series.mean(axis=(1, 2))
        if not np.any(means):
            # Nothing of the kind: a single segment does not bend, a clamped middle does not move.
            continue
        weights = np.array(WEIGHTS[len(means)])
        scale, influence = abs(means[-1]), math.copysign(1.0, means[-1])
        if kind is None and scale < 1.0:
            # Energies of forces may have any sign: an error well below k_B T is none.
            scale, influence = 1.0, 0.0
        error = float(weights @ means / scale)
        # How each frame contributes to the ratio.
        linear = np.tensordot(weights, series, 1) - error * influence * series[-1]
        unpaired = [weight * _standard_error(one) for weight, one in zip(weights, series)]
        checks.append(
            ObservableCheck(
                name=name,
                unit=unit,
                values=tuple(float(mean) for mean in means),
                error=error,
                standard_error=_standard_error(linear) / scale,
                unpaired_standard_error=float(np.linalg.norm(unpaired)) / scale,
                seconds=seconds,
                **exact.compare(kind, what, series[0]),
            )
        )
    return checks


def _standard_error(series):
    # Of the mean of (frames, copies): the largest of what blocks of several lengths and copies give.
    frames, copies = series.shape
    if frames < _BLOCKS[-1]:
        return math.inf
    line = series.mean(axis=1)
    errors = []
    for count in _BLOCKS:
        length = frames // count
        if length:
            means = line[frames - count * length :].reshape(count, length).mean(axis=1)
            # Blocks leave out what is left over of the frames.
            errors.append(means.std(ddof=1) / math.sqrt(frames / length))
    if copies >= _FEWEST_COPIES:
        errors.append(series.mean(axis=0).std(ddof=1) / math.sqrt(copies))
    return float(max(errors))


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
        """What an ObservableCheck says of the exact average, with the values (frames, copies) with h."""
        exact = self._average(kind, what)
        if exact is None:
            return {name: None for name in ("exact", "deviation", "deviation_standard_error")} | {
                "judged_by_exact": False
            }
        # Time tells little of a few filaments that keep their shape.
        known = self._lasting or series.shape[1] >= _FEWEST_COPIES
        return {
            "exact": float(exact),
            "deviation": float(series.mean() / exact - 1.0),
            "deviation_standard_error": _standard_error(series) / exact if known else math.inf,
            "judged_by_exact": self._equilibrium,
        }

    def _average(self, kind, what):
        if kind is None or not self._free:
            return None
        one = kind.filament
        if one.closed or one.clamped or one.propulsion:
            return None
        if one.type.has_beam_elements:
            return None if one.planar else self._average_of_beams(one, what)
        arguments = self._temperature, one.planar
        if what == "distance":
            return chain_mean_square_end_to_end(one.type, one.segments, *arguments)
        if what not in ("stretching", "bending"):
            return None
        if isinstance(one.type, BeadSpringType):
            of_beads = bead_spring_stretching_energies if what == "stretching" else bead_spring_bending_energies
            energies = of_beads(one.type, one.segments, *arguments) / self._kT
            return energies.mean() if len(energies) else 0.0
        mean = stretching_energy_mean if what == "stretching" else bending_energy_mean
        return mean(one.type, *arguments) / self._kT

    def _average_of_beams(self, one, what):
        if what == "distance":
            return beam_mean_square_end_to_end(one.type, one.segments, self._temperature)
        if what == "stretching":
            return beam_stretching_energy_mean(one.type, one.segments, self._temperature) / self._kT
        return beam_averages(one.type, self._temperature).bending if what == "bending" else None
