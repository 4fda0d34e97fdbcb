"""What a run of several stages has done in each of them, for its summary and its figure."""

import dataclasses
import re
from dataclasses import dataclass

import numpy as np

from ..analysis.statistics import mean_with_error
from ..output.read_tables import read_growth, read_reports, read_table
from ..output.run_tables import MILLISECOND
from ..units.quantities import TIME
from ..units.text import parse_quantity
from .configuration import linker_labels
from .figure_style import FONT_SIZE
from .stages import named_stages

_ENERGIES = ("stretching energy per segment (kT)", "bending energy per joint (kT)", "mean end-to-end distance (nm)")
_FEWEST = 2
_TIME = re.compile(r"time \((.*)\)")
_MOST_LINES, _MOST_NAMES = 60, 12


@dataclass(frozen=True)
class StageSummary:
    """A stage: its name, when it begins and ends in ms, and means over its second half by their names.

    ``values`` are (mean, standard error), the latter NaN for fewer than two reports.
    """

    name: str
    begin: float
    end: float
    values: dict


def as_summarised(configuration):
    """The configuration by which the results of a run are described.

    That of its last stage, but with all walls that there were in some stage, and contacts if there were such.
    """
    if not configuration.stages:
        return configuration
    every = [own.configuration for own in configuration.stages]
    walls = {(wall.number, wall.first_face): wall for own in every for wall in own.walls}
    contacts = [own.contacts for own in every if own.contacts is not None]
    return dataclasses.replace(
        every[-1],
        walls=tuple(walls[number] for number in sorted(walls)),
        contacts=contacts[-1] if contacts else None,
        stages=configuration.stages,
        simulation=dataclasses.replace(every[-1].simulation, steps=configuration.simulation.steps),
    )


def frames_of_last_stage(configuration):
    """A slice of the frames of a run: those in its last stage, or all if it has none."""
    if not configuration.stages:
        return slice(None)
    first, last = named_stages(configuration.stages)[-1]
    return slice(min(first.first_report + 1, last.first_report + last.reports - 1), None)


def summarise_stages(configuration, directory):
    """What a run has done in its stages: a list of StageSummary, empty if it has none."""
    if not configuration.stages:
        return []
    columns = dict(_columns(configuration, directory))
    return [_summarise(first, last, columns) for first, last in named_stages(configuration.stages)]


def _columns(configuration, directory):
    # Of each number its values at all reports.
    energies = read_table(directory.energies)
    for name in _ENERGIES:
        yield name, energies[name]
    if configuration.linkers:
        table = read_reports(directory.linkers)
        for number, label in enumerate(linker_labels(configuration)):
            for state in ("one hand bound", "both hands bound"):
                yield f"{label}, {state}", table[state][:, number]
    if directory.growth.exists():
        table = read_growth(directory.growth)
        there = table["nodes"] > 0
        with np.errstate(invalid="ignore"):
            lengths = np.where(there, table["length (nm)"], 0.0).sum(axis=1) / there.sum(axis=1)
        yield "mean length of filaments that grow (nm)", lengths
    for path, name, sums in (
        (directory.wall_forces, "sum of forces of walls (pN)", True),
        (directory.contact_forces, "sum of forces of contacts on a filament (pN)", False),
    ):
        if path.exists():
            loads = read_reports(path)["load (pN)"]
            yield name, loads.sum(axis=1) if sums else loads.mean(axis=1)
    if directory.pulling.exists():
        yield (
            "force of moving tethers along their velocity (pN)",
            read_reports(directory.pulling)["force along the velocity (pN)"].mean(axis=1),
        )


def _summarise(first, last, columns):
    begin, end = first.first_report + 1, last.first_report + last.reports + 1
    late, values = slice(begin + (end - begin) // 2, end), {}
    for name, column in columns.items():
        own = column[late]
        own = own[np.isfinite(own)]
        if len(own):
            mean, error = mean_with_error(own) if len(own) >= _FEWEST else (own.mean(), np.nan)
            values[name] = float(mean), float(error)
    return StageSummary(first.name, first.begin / MILLISECOND, last.end / MILLISECOND, values)


def mark_stages(axes, configuration, low=None):
    """Draw a line where each stage begins into all panels of a figure that have times, and the names of stages.

    In the panel ``low``, names are below, because there is a legend above.
    """
    if not configuration.stages:
        return
    stages = named_stages(configuration.stages)
    if len(stages) > _MOST_LINES:
        return
    for axis in axes:
        unit = _TIME.fullmatch(axis.get_xlabel())
        if unit is None:
            continue
        length = parse_quantity(f"1 {unit[1]}", TIME, "the unit")
        for first, _ in stages:
            if first.number:
                axis.axvline(first.begin / length, color="0.55", linewidth=0.8, linestyle=(0, (4, 3)), zorder=0)
            if len(stages) <= _MOST_NAMES:
                axis.text(
                    first.begin / length,
                    0.02 if axis is low else 0.98,
                    f" {first.name} ",
                    transform=axis.get_xaxis_transform(),
                    rotation=90,
                    ha="left",
                    va="bottom" if axis is low else "top",
                    fontsize=FONT_SIZE - 2,
                    color="0.35",
                )
