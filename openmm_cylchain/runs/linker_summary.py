"""What the linkers of a run did, for its summary."""

from dataclasses import dataclass

import numpy as np

from ..analysis.statistics import mean_with_error
from ..output.read_tables import read_reports
from .configuration import linker_labels


@dataclass(frozen=True)
class LinkerSummary:
    """Linkers of one [[linkers]] table: means over the last half of a run, and the largest tension of all of it.

    Numbers of linkers with standard errors from their fluctuations in time, None of unbound ones of a concentration,
    which nobody counts; tensions in pN, None where none pulled.
    """

    name: str
    unbound: float | None
    unbound_error: float | None
    one_hand_bound: float
    one_hand_bound_error: float
    both_hands_bound: float
    both_hands_bound_error: float
    mean_tension: float | None
    largest_tension: float | None


def summarise_linkers(configuration, directory):
    """What the linkers of a run did: a LinkerSummary for each [[linkers]] table."""
    if not configuration.linkers:
        return []
    table = read_reports(directory.linkers)
    names = linker_labels(configuration)
    return [
        _summarise_linkers(name, {key: table[key][:, n] for key in table}, own.concentration is None)
        for n, (name, own) in enumerate(zip(names, configuration.linkers))
    ]


def _summarise_linkers(name, table, counted):
    # Two values at least, which a standard error needs.
    late = slice(min(len(table["step"]) // 2, len(table["step"]) - 2), None)
    states = {}
    for state in ("unbound", "one hand bound", "both hands bound"):
        known = counted or state != "unbound"
        mean, error = mean_with_error(table[state][late, None]) if known else (None, None)
        states[state.replace(" ", "_")] = mean
        states[f"{state.replace(' ', '_')}_error"] = error
    pulling = table["both hands bound"][late]
    tensions = np.nan_to_num(table["mean tension (pN)"][late])
    largest = table["maximum tension (pN)"]
    largest = largest[~np.isnan(largest)]
    return LinkerSummary(
        name=name,
        **states,
        mean_tension=float(np.average(tensions, weights=pulling)) if pulling.any() else None,
        largest_tension=float(largest.max()) if len(largest) else None,
    )
