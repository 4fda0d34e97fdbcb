"""How far filaments have grown: in tables of runs, and by a reporter for ``simulation.reporters`` of OpenMM."""

from collections.abc import Iterator
from typing import Any

from openmm import unit

from ..errors import InputError
from ..filaments.collection import FilamentCollection, require_filaments
from ..units.quantities import LENGTH
from .files import TextFile
from .reporters import FilamentsReporter
from .run_tables import GROWTH_TABLE_COLUMNS, MILLISECOND, in_units_of_columns, line_of_table

_OF_END = ("gained", "lost", "waited", "state_names", "shrinking", "catastrophes", "rescues")
"""What each end has, as FilamentGrowth says."""


def rows_of_growth(growth: Any) -> Iterator[tuple[float | str, ...]]:
    """What lines of GROWTH_TABLE_COLUMNS say behind step and time, for a FilamentGrowth; none for None."""
    if growth is None:
        return
    lengths = growth.lengths.value_in_unit(LENGTH)
    concentrations = growth.concentrations.value_in_unit(unit.molar)
    population = growth.nucleated, growth.vanished, growth.severed, growth.without_place
    for index, filament in enumerate(growth.filaments):
        ends = zip(*(getattr(growth, what)[index] for what in _OF_END))
        yield (
            int(filament),
            float(lengths[index]),
            int(growth.nodes[index]),
            *map(int, growth.monomers[index]),
            *(str(own) if isinstance(own, str) else int(own) for values in ends for own in values),
            float(concentrations[index]),
            int(growth.identities[index]),
            int(growth.parents[index]),
            *population,
        )


class GrowthReporter(FilamentsReporter):
    """Reports how far filaments have grown, a line for each one that grows, as ``growth.csv`` of runs does.

    Columns: ``length (nm)`` at rest and ``nodes``; ``minus end (monomers)`` and ``plus end (monomers)``, the number of
    the first monomer and that behind the last one, from 0 on and as they are at the start: a treadmilling filament goes
    where these go; ``minus end gained (monomers)``, ``minus end lost (monomers)``, ``minus end waited``,
    ``minus end state``, ``minus end shrinking``, ``minus end catastrophes``, ``minus end rescues``, and the same of
    ``plus end``: how many monomers each end has gained and lost since the start, how often it would have gained one,
    but had no spare node, the name of its state (``EndStates.names``; empty without a filament), whether it shrinks, 0
    or 1, and how often it has turned; and ``free monomers (uM)``, the concentration in its pool.
    A place without a filament has no nodes, and the length zero. ``identity`` says which of all filaments that have
    ever been there is in it, and ``parent`` of which it was a part, -1 for none; ``filaments nucleated``,
    ``filaments vanished``, ``filaments severed`` and ``without place`` are counts of all that grow, the same in each
    line of a report, see ``FilamentGrowth``.

    Before these, the file has ``step``, ``time (ms)`` and ``filament``; ``analysis.read_growth`` reads it.
    ``reporter["nodes"]`` is an array (reports, filaments that grow), in the order of ``reporter.filaments``.

    Parameters
    ----------
    file : str, Path, file object or None
        None keeps the arrays alone.
    reportInterval : int
        In steps.
    filaments : Filaments
        Some of which grow.
    append : bool
        Go on with a file that exists.

    Attributes
    ----------
    filaments : list of int
        The numbers of those that grow.

    Raises
    ------
    InputError
        If no filament grows.

    Examples
    --------
    >>> simulation.reporters.append(GrowthReporter("growth.csv", 100, filaments))  # doctest: +SKIP
    """

    _columns = GROWTH_TABLE_COLUMNS[3:]
    _include = ()

    def __init__(
        self, file: TextFile | None, reportInterval: int, filaments: FilamentCollection, append: bool = False
    ) -> None:  # noqa: N803 - OpenMM's name
        require_filaments(filaments)
        self.filaments = [number for number, filament in enumerate(filaments) if filament.growth is not None]
        if not self.filaments:
            raise InputError("There is no growth to report: give filaments a growth when they are added.")
        super().__init__(file, reportInterval, filaments, append)

    @property
    def _header(self):
        return ",".join(GROWTH_TABLE_COLUMNS)

    def _line(self, step, time, number, row):
        return line_of_table(step, (time / MILLISECOND, number, *row))

    def _table(self, simulation, state):
        growth = self._filaments.in_context(simulation.context).growth()
        rows = [in_units_of_columns(self._columns, row[1:]) for row in rows_of_growth(growth)]
        return self.filaments, rows
