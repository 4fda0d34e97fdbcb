"""What the ends of filaments that grow did in a run, for its summary."""

from dataclasses import dataclass

import numpy as np

from ..output.read_tables import read_growth
from ..output.run_tables import MILLISECOND
from ..units.quantities import AVOGADRO
from .summary import group_labels, mean_over_filaments

ENDS = ("plus", "minus")
_SECOND = 1e12
"""In ps."""
MICROMOLAR = 1e-6 * AVOGADRO * 1e-24
"""In 1/nm^3."""


@dataclass(frozen=True)
class EndSummary:
    """The ends of one kind of the filaments of a [[filament]] table: what they did all together in a run.

    Attributes
    ----------
    end : {"plus", "minus"}
    gained, lost, waited : int
        Monomers, and how often one would have come if there had been a spare node.
    rate, rate_error : float
        Monomers that an end gained in a second, less those that it lost, on average.
    rate_of_free_ends : float
        See ``free_rate``, at the mean concentration.
    """

    name: str
    end: str
    gained: int
    lost: int
    waited: int
    rate: float
    rate_error: float
    rate_of_free_ends: float


class GrowthTable:
    """The growth.csv of a run: columns (reports, filaments) by their names, of all that grow or of one table."""

    def __init__(self, directory):
        self._columns = read_growth(directory.growth)
        self.times = self._columns["time (ms)"][:, 0] * MILLISECOND

    def column(self, name, filaments=None):
        """A column of the filaments of such numbers; of all that grow if None."""
        values = self._columns[name]
        return values if filaments is None else values[:, np.isin(self._columns["filament"][0], filaments)]

    def ends(self, end, filaments=None):
        """How many monomers more than at the start the "plus" or "minus" ends have."""
        moved = self.column(f"{end} end (monomers)", filaments)
        return (moved - moved[0]) * (1.0 if end == "plus" else -1.0)


def growing_groups(configuration, members):
    """The groups of a configuration that grow, with the numbers of their filaments and their labels."""
    labels = group_labels(configuration)
    every = zip(configuration.filaments, members, labels)
    return [(group, list(numbers), label) for group, numbers, label in every if group.growth is not None]


def free_rate(growth, end, concentration):
    """What a free "plus" or "minus" end gains less what it loses, in 1/s, at a concentration in umol/l.

    Of one with several states, the mean over those that it has in the long run.
    """
    return growth.states(end).net_rate(concentration * MICROMOLAR) * _SECOND


def summarise_growth(configuration, members, directory):
    """What ends did in a run: a list of EndSummary, for the numbers of the filaments of each [[filament]] table."""
    groups = growing_groups(configuration, members)
    table = GrowthTable(directory) if groups else None
    return [
        _summarise(table, group.growth, numbers, label, end)
        for group, numbers, label in groups
        for end in ENDS
        if group.growth.states(end).grows
    ]


def _summarise(table, growth, numbers, label, end):
    events = "gained (monomers)", "lost (monomers)", "waited"
    counts = [int(table.column(f"{end} end {what}", numbers)[-1].sum()) for what in events]
    gains = np.diff(table.ends(end, numbers), axis=0) / np.diff(table.times)[:, None] * _SECOND
    rate, error = mean_over_filaments(gains) if len(gains) > 1 else (float(gains.mean()), float("nan"))
    concentration = float(table.column("free monomers (uM)", numbers).mean())
    return EndSummary(label, end, *counts, rate, error, free_rate(growth, end, concentration))
