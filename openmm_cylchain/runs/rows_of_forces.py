"""Lines of tables of forces, of all walls and contacts that there are in some stage of a run."""

from ..couplings.force_reporters import rows_of_contacts, rows_of_walls

_NONE = (0.0, 0.0, 0.0, 0.0, 0.0)


class RowsOfForces:
    """What ``wall_forces.csv`` and ``contact_forces.csv`` have at a report of a stage.

    A wall that is not active, and contacts that are not, have forces of zero, as means over no time; walls have the
    numbers of their tables, counted from 0.

    Attributes
    ----------
    there : (bool, bool)
        Whether there are walls, and contacts of filaments, in some stage.
    """

    def __init__(self, stages, configuration):
        self._walls = configuration.walls
        every = (own for stage in stages for own in stage.configuration.walls)
        self._faces = sorted({(own.number, face) for own in every for face in own.faces})
        self.there = bool(self._faces), any(stage.configuration.contacts_of_filaments for stage in stages)

    def of(self, walls, contacts, filaments):
        """Rows of walls, each with its wall and face, and of contacts; see ``ForceTables.write_rows``."""
        known = {}
        for (wall, face), row in zip(*rows_of_walls(walls)):
            known[self._walls[wall].number, self._walls[wall].faces[face]] = row
        rows = [(place, known.get(place, _NONE)) for place in self._faces]
        if not self.there[1]:
            return rows, ()
        return rows, rows_of_contacts(contacts, filaments) if contacts else [_NONE] * len(filaments)
