"""Reporters of the forces of walls and contacts, for ``simulation.reporters`` of OpenMM's app layer."""

from abc import abstractmethod
from typing import TYPE_CHECKING, Any

import numpy as np
import openmm

from ..errors import InputError
from ..filaments.collection import FilamentCollection
from ..output.files import TextFile
from ..output.reporters import FilamentsReporter, TableReporter
from .mean_forces import ContactForces, ForceReaders, WallForces

if TYPE_CHECKING:
    from openmm import app


def rows_of_walls(walls: list[WallForces]) -> tuple[list[tuple[int, int]], list[tuple[float, ...]]]:
    """The wall and the face of each line of a table, and what stands there: duration, load and force."""
    places = [(number, face) for number, wall in enumerate(walls) for face in range(len(wall.loads))]
    return places, [
        (wall.duration._value, load, *total)
        for wall in walls
        for load, total in zip(wall.loads._value.tolist(), wall.sums._value.tolist())
    ]


def rows_of_contacts(contacts: list[ContactForces], filaments: FilamentCollection) -> list[tuple[float, ...]]:
    """What a table says of each filament: duration, load and force of all contacts."""
    duration = contacts[0].duration._value
    loads = np.sum([own.loads_of_filaments(filaments)._value for own in contacts], axis=0)
    sums = np.sum([own.on_filaments(filaments)._value for own in contacts], axis=0)
    return [(duration, load, *total) for load, total in zip(loads.tolist(), sums.tolist())]


class _MeanForceReporter(TableReporter):
    # Means begin when the first report is planned.

    _columns = ("duration_ps", "load", "force_x", "force_y", "force_z")
    _include = ()
    _readers: ForceReaders | None = None

    def describeNextReport(self, simulation: "app.Simulation") -> dict[str, Any]:  # noqa: N802 - OpenMM's name
        """When the next report is due; means begin when this is called for the first time."""
        if self._readers is None:
            self._readers = ForceReaders(simulation.context)
            self._begin(self._readers)
        return super().describeNextReport(simulation)

    @abstractmethod
    def _begin(self, readers: ForceReaders) -> None:
        """Look at what there is to report; InputError if there is nothing."""


class WallForceReporter(_MeanForceReporter):
    """Reports the force of every face of every wall: its mean over the steps since the report before.

    A line for each wall, in the order of ``wall_forces``, and face. Columns: ``duration_ps``, of the steps that the
    mean is taken over, 0 for a force at the present positions (see ``wall_forces``); ``load``, the sum of the sizes of
    the forces, which over the area of the face is the pressure; ``force_x``, ``force_y``, ``force_z`` of the wall on
    what it keeps in; all of them in kJ/(mol nm), of which 0.602214 are 1 pN. ``reporter["load"]`` is an array (reports,
    faces of all walls), and ``reporter.places`` says which. Where a script goes on from a checkpoint between two
    reports, the next mean is that of the steps from there on.

    Parameters
    ----------
    file : str, Path, file object or None
        None keeps the arrays alone.
    reportInterval : int
        In steps.
    append : bool
        Go on with a file that exists.

    Raises
    ------
    InputError
        In the first step, if there are no walls.

    Examples
    --------
    >>> simulation.reporters.append(WallForceReporter("wall_forces.csv", 100))  # doctest: +SKIP
    """

    _thing = "wall,face"
    places: list[tuple[int, int]]

    def __init__(self, file: TextFile | None, reportInterval: int, append: bool = False) -> None:  # noqa: N803 - OpenMM's name
        self.places = []
        super().__init__(file, reportInterval, append)

    def _begin(self, readers: ForceReaders) -> None:
        self.places, _ = rows_of_walls(readers.wall_forces())
        if not self.places:
            raise InputError("There are no walls to report: add a filament_wall_force or wall_force to the System.")

    def _table(self, simulation: "app.Simulation", state: openmm.State) -> tuple[list[str], list[tuple[float, ...]]]:
        assert self._readers is not None
        places, rows = rows_of_walls(self._readers.wall_forces())
        return [f"{wall},{face}" for wall, face in places], rows


class ContactForceReporter(_MeanForceReporter, FilamentsReporter):
    """Reports the force of contacts on every filament: its mean over the steps since the report before.

    Columns: ``duration_ps``, of the steps that the mean is taken over, 0 for a force at the present positions (see
    ``contact_forces``); ``load``, the sum of the sizes of all forces on the filament; ``force_x``, ``force_y``,
    ``force_z``, their sum; all of them in kJ/(mol nm), of which 0.602214 are 1 pN. ``reporter["load"]`` is an array
    (reports, filaments).

    Parameters
    ----------
    file : str, Path, file object or None
        None keeps the arrays alone.
    reportInterval : int
        In steps.
    filaments : Filaments
    append : bool
        Go on with a file that exists.

    Raises
    ------
    InputError
        In the first step, if there are no contacts of ``capsule_contact_force``.

    Examples
    --------
    >>> simulation.reporters.append(ContactForceReporter("contact_forces.csv", 100, filaments))  # doctest: +SKIP
    """

    _thing = "filament"

    def _begin(self, readers: ForceReaders) -> None:
        if not readers.contact_forces():
            raise InputError("There are no contacts to report: add a capsule_contact_force to the System.")

    def _table(self, simulation: "app.Simulation", state: openmm.State) -> tuple[range, list[tuple[float, ...]]]:
        assert self._readers is not None
        rows = rows_of_contacts(self._readers.contact_forces(), self._filaments)
        return range(len(rows)), rows
