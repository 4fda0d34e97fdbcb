"""What filaments that grow did in a run, for its summary: their ends, and how many there were."""

from dataclasses import dataclass

import numpy as np

from ..analysis.statistics import mean_with_error
from ..kinetics.branching import Branching
from ..output.read_tables import read_growth, read_reports
from ..output.run_tables import MILLISECOND, POPULATION_COLUMNS
from ..units.quantities import AVOGADRO
from .initial_state import box_vectors
from .steady_populations import steady_population
from .summary import group_labels, mean_over_filaments

ENDS = ("plus", "minus")
_SECOND = 1e12
"""In ps."""
_ROUNDING = 1e-12
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
    rate, rate_error : float or None
        Monomers that an end gained in a second, less those that it lost, on average; None if there was none.
    rate_of_free_ends : float or None
        See ``free_rate``, at the mean concentration; of filaments that vanish, only of ends with a single state.
    states : tuple of StateShare
        Of an end with several states.
    """

    name: str
    end: str
    gained: int
    lost: int
    waited: int
    rate: float | None
    rate_error: float | None
    rate_of_free_ends: float | None
    states: tuple


@dataclass(frozen=True)
class StateShare:
    """The share of their time for which ends are in a state, at the reports of the last half of a run.

    ``share`` and its error are None if there were no filaments; ``share_of_free_ends`` is that in the long run at the
    mean concentration (``EndStates.shares``), None where monomers age or filaments vanish, whose states depend on more.
    """

    name: str
    share: float | None
    share_error: float | None
    share_of_free_ends: float | None


@dataclass(frozen=True)
class PopulationOfKind:
    """Filaments of one growth, some of which come and go: means over the last half of a run.

    Attributes
    ----------
    number, number_error : float
        How many there were at once.
    length, length_error : float or None
        Their mean length in nm; None if there were none.
    number_of_free_ones, length_of_free_ones : float or None
        See ``steady_population``, at the mean concentration.
    """

    name: str
    number: float
    number_error: float
    number_of_free_ones: float | None
    length: float | None
    length_error: float | None
    length_of_free_ones: float | None


@dataclass(frozen=True)
class PopulationSummary:
    """Filaments that come and go: those of each growth, and counts of all of them in a run.

    ``branches`` is the number of those that are on their mothers at the end, None if there can be none.
    """

    kinds: tuple
    nucleated: int
    vanished: int
    severed: int
    without_place: int
    branches: int | None


class GrowthTable:
    """The growth.csv of a run: columns (reports, filaments) by their names, of all that grow or of one table."""

    def __init__(self, directory):
        self._columns = read_growth(directory.growth)
        self.times = self._columns["time (ms)"][:, 0] * MILLISECOND

    def column(self, name, filaments=None):
        """A column of the filaments of such numbers; of all that grow if None."""
        values = self._columns[name]
        return values if filaments is None else values[:, np.isin(self._columns["filament"][0], filaments)]

    def gains(self, end, filaments=None):
        """How many monomers the "plus" or "minus" ends have gained since the start, less those that they have lost."""
        gained, lost = (self.column(f"{end} end {what} (monomers)", filaments) for what in ("gained", "lost"))
        return gained - lost

    def there(self, filaments=None):
        """Whether there is a filament."""
        return self.column("nodes", filaments) > 0


def growing_groups(configuration, members):
    """The groups of a configuration that grow, with the numbers of their filaments and their labels."""
    labels = group_labels(configuration)
    every = zip(configuration.filaments, members, labels)
    return [(group, list(numbers), label) for group, numbers, label in every if group.growth is not None]


def free_rate(growth, end, concentration):
    """What a free "plus" or "minus" end gains less what it loses, in 1/s, at a concentration in umol/l.

    Of one with several states, the mean over those that it has in the long run; NaN if that depends on lengths.
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
    rate = map(_finite, rate_of_gains(table, end, numbers))
    concentration = float(table.column("free monomers (uM)", numbers).mean())
    # Those that shrink vanish, and are no more to be counted.
    known = not growth.vanishes or len(growth.states(end).names) == 1
    free = _finite(free_rate(growth, end, concentration)) if known else None
    return EndSummary(label, end, *counts, *rate, free, tuple(_shares_of_states(table, growth, numbers, end)))


def _shares_of_states(table, growth, numbers, end):
    states, late = growth.states(end), _late(table)
    if len(states.names) == 1:
        return
    names, there = table.column(f"{end} end state", numbers)[late], table.there(numbers)[late]
    concentration = float(table.column("free monomers (uM)", numbers)[late].mean()) * MICROMOLAR
    known = not (growth.monomers.aging or growth.vanishes)
    free = states.shares(concentration).tolist() if known else [np.nan] * len(states.names)
    for name, of_free_ends in zip(states.names, free):
        share = _ratio(np.sum((names == name) & there, axis=1, dtype=float), there.sum(axis=1, dtype=float))
        yield StateShare(name, *map(_finite, (*share, of_free_ends)))


def rate_of_gains(table, end, numbers=None, late=slice(None), sizes=1.0):
    """Monomers that an end gains in a second, less those that it loses, times their sizes, and the error of that.

    Of filaments that come and go, while they are there; NaN if there are none.
    """
    times, there = table.times[late], table.there(numbers)[late]
    gains = np.diff(table.gains(end, numbers)[late], axis=0) * sizes
    seconds = np.diff(times)[:, None] / _SECOND
    if there.all():
        rates = gains / seconds
        return mean_over_filaments(rates) if len(rates) > 1 else (float(rates.mean()), float("nan"))
    spent = 0.5 * (there[1:] + there[:-1].astype(float)) * seconds
    return _ratio(gains.sum(axis=1), spent.sum(axis=1))


def _ratio(upper, lower):
    # Of the means of two series, and its error; NaN if there is nothing below.
    mean = float(lower.mean())
    if mean == 0.0:
        return float("nan"), float("nan")
    ratio = float(upper.mean()) / mean
    error = mean_with_error(upper - ratio * lower)[1] / mean if len(upper) > 1 else float("nan")
    return ratio, 0.0 if error < _ROUNDING * abs(ratio) else error


def populations(configuration, members):
    """The groups of each growth some of whose filaments come and go, with a name and the numbers of all."""
    kinds = {}
    for group, numbers, label in growing_groups(configuration, members):
        kinds.setdefault(id(group.growth), []).append((group, numbers, label))
    for own in kinds.values():
        groups = [group for group, *_ in own]
        if any(group.is_reserve or group.growth.vanishes for group in groups):
            name = own[0][2] if len(own) == 1 else f"all {groups[0].type.name} of {groups[0].label}"
            yield groups, [number for _, numbers, _ in own for number in numbers], name


def summarise_population(configuration, members, directory):
    """The PopulationSummary of a run; None if no filaments come and go."""
    found = list(populations(configuration, members))
    if not found:
        return None
    table = GrowthTable(directory)
    kinds = tuple(_population(configuration, table, *own) for own in found)
    counts = (int(table.column(name)[-1, 0]) for name in POPULATION_COLUMNS)
    return PopulationSummary(kinds, *counts, _branches(configuration, directory))


def free_of_kind(configuration, table, groups, numbers):
    """The SteadyPopulation of what ``populations`` names, at the mean concentration in the last half; or None."""
    concentration = float(table.column("free monomers (uM)", numbers)[_late(table)].mean()) * MICROMOLAR
    return steady_population(groups, box_vectors(configuration.box), concentration)


def _late(table):
    # Two reports at least, which a standard error needs.
    return slice(min(len(table.times) // 2, len(table.times) - 2), None)


def _population(configuration, table, groups, numbers, name):
    late = _late(table)
    there = table.there(numbers)[late].sum(axis=1)
    number, error = mean_with_error(there)
    length, length_error = _ratio(table.column("length (nm)", numbers)[late].sum(axis=1), there)
    free = free_of_kind(configuration, table, groups, numbers)
    of_free_ones = (None, None) if free is None else (free.number, free.length)
    return PopulationOfKind(
        name, number, error, of_free_ones[0], _finite(length), _finite(length_error), of_free_ones[1]
    )


def _finite(value):
    return value if np.isfinite(value) else None


def _branches(configuration, directory):
    # The springs of joints are the last types of linkers; each joint has one at its first node.
    own = [group.nucleation for group in configuration.filaments if isinstance(group.nucleation, Branching)]
    if not own:
        return None
    bound = read_reports(directory.linkers)["both hands bound"][-1]
    firsts = len(configuration.linkers) + np.cumsum([0] + [len(branching.springs) for branching in own[:-1]])
    return int(bound[firsts].sum())
