"""A reporter of how far filaments have grown, for ``simulation.reporters`` of OpenMM's app layer."""

from openmm import unit

from ..errors import InputError
from ..filaments.collection import FilamentCollection, require_filaments
from ..units.quantities import LENGTH
from .files import TextFile
from .reporters import FilamentsReporter

_OF_END = ("gained", "lost", "waited", "shrinking", "catastrophes", "rescues")
"""What each end has, as FilamentGrowth says."""


class GrowthReporter(FilamentsReporter):
    """Reports how far filaments have grown, a line for each one that grows.

    Columns: ``length_nm`` at rest and ``nodes``; ``minus_end`` and ``plus_end``, the number of the first monomer and
    that behind the last one, from 0 on and as they are at the start: a treadmilling filament goes where these go;
    ``minus_gained``, ``minus_lost``, ``minus_waited``, ``minus_shrinking``, ``minus_catastrophes``, ``minus_rescues``,
    and the same of ``plus``: how many monomers each end has gained and lost since the start, how often it would have
    gained one, but had no spare node, whether it shrinks, 0 or 1, and how often it has turned; and
    ``concentration_micromolar`` of free monomers in its pool. ``reporter["plus_end"]`` is an array (reports, filaments
    that grow), in the order of ``reporter.filaments``.

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

    _columns = (
        "length_nm",
        "nodes",
        "minus_end",
        "plus_end",
        *(f"{end}_{what}" for end in ("minus", "plus") for what in _OF_END),
        "concentration_micromolar",
    )
    _thing = "filament"
    _include = ()

    def __init__(
        self, file: TextFile | None, reportInterval: int, filaments: FilamentCollection, append: bool = False
    ) -> None:  # noqa: N803 - OpenMM's name
        require_filaments(filaments)
        self.filaments = [number for number, filament in enumerate(filaments) if filament.growth is not None]
        if not self.filaments:
            raise InputError("There is no growth to report: give filaments a growth when they are added.")
        super().__init__(file, reportInterval, filaments, append)

    def _table(self, simulation, state):
        growth = self._filaments.in_context(simulation.context).growth()
        lengths = growth.lengths.value_in_unit(LENGTH)
        concentrations = 1e6 * growth.concentrations.value_in_unit(unit.molar)
        rows = []
        for index in range(len(growth.filaments)):
            ends = zip(*(getattr(growth, what)[index].astype(int) for what in _OF_END))
            counts = [count for end in ends for count in end]
            rows.append((lengths[index], growth.nodes[index], *growth.monomers[index], *counts, concentrations[index]))
        return growth.filaments, rows
