"""The tables of a run that have forces of walls and of contacts."""

from collections.abc import Iterable, Sequence

from ..filaments.collection import FilamentCollection
from ..output.run_files import RunFiles
from ..output.run_tables import ReportTable
from .force_reporters import rows_of_contacts, rows_of_walls
from .mean_forces import ContactForces, WallForces


class ForceTables:
    """Files of forces of walls and of contacts, as far as a System has such; new ones, or continued at their sizes."""

    def __init__(self, files: RunFiles, walls: bool, contacts: bool, sizes: Sequence[int] | None = None) -> None:
        of_walls, of_contacts = (None, None) if sizes is None else sizes
        self._walls = ReportTable(files.wall_forces, of_walls) if walls else None
        self._contacts = ReportTable(files.contact_forces, of_contacts) if contacts else None

    def write(
        self,
        step: int,
        time: float,
        walls: list[WallForces],
        contacts: list[ContactForces],
        filaments: FilamentCollection,
    ) -> None:
        """Append lines of a report at a time in ps."""
        self.write_rows(
            step,
            time,
            zip(*rows_of_walls(walls)) if self._walls is not None else (),
            rows_of_contacts(contacts, filaments) if self._contacts is not None else (),
        )

    def write_rows(
        self,
        step: int,
        time: float,
        walls: Iterable[tuple[tuple[int, int], tuple[float, ...]]],
        contacts: Iterable[tuple[float, ...]],
    ) -> None:
        """Append lines: what ``rows_of_walls`` says of each wall and face, and ``rows_of_contacts`` of filaments."""
        for place, row in walls:
            if self._walls is not None:
                self._walls.write(step, (time, *place, *row))
        for number, row in enumerate(contacts):
            if self._contacts is not None:
                self._contacts.write(step, (time, number, *row))

    def synchronise(self) -> tuple[int, int]:
        """Bring everything to disk and return the sizes of both files, 0 of one that is not there."""
        walls, contacts = (0 if own is None else own.synchronise() for own in (self._walls, self._contacts))
        return walls, contacts

    def close(self) -> None:
        """Close the files."""
        for own in (self._walls, self._contacts):
            if own is not None:
                own.close()
