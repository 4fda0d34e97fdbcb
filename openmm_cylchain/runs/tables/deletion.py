"""The ``delete`` and ``cut`` of a [[filament]] table in a stage: which filaments go or are cut as it begins."""

from dataclasses import dataclass

import numpy as np

from ...couplings.shapes import Plane
from ..keys import REQUIRED, Inline, Key, Whole, direction, point
from ..table import TableKind
from .shapes import REGION, REGION_EXAMPLE, Region

DELETE = TableKind(
    "delete",
    (
        Key(
            "count", Whole(1, 10**7, "5"), None, "How many go, at random, or all if there are fewer; all if not given."
        ),
        Key(
            "inside",
            Inline(REGION, REGION_EXAMPLE),
            None,
            "A region: those go whose middles, the means of their nodes, are in it.",
        ),
        Key("outside", Inline(REGION, REGION_EXAMPLE), None, "A region: those go whose middles are not in it."),
    ),
    "Filaments that go, as a stage begins, with their monomers and with what is bound to them; see the page on stages.",
)
DELETE_EXAMPLE = "{ count = 5 }"

CUT = TableKind(
    "cut",
    (
        Key("point", point(), (0.0, 0.0, 0.0), "A point on the plane."),
        Key("normal", direction(), REQUIRED, "Its normal."),
    ),
    "A plane that cuts filaments, as a stage begins, wherever they go through it.",
)
CUT_EXAMPLE = "{ normal = [1, 0, 0] }"


@dataclass(frozen=True)
class Deletion:
    """Filaments that go: at most so many (all if ``count`` is None) of those on a side of a Region, if there is one."""

    count: int | None
    region: Region | None
    outside: bool

    def chosen(self, middles, box, generator):
        """Which of filaments go, by the middles (n, 3) of these in nm in a box with edges (3,) in nm, or None.

        Returns
        -------
        (m,) int array
        """
        places = np.arange(len(middles))
        if self.region is not None:
            if box is not None:
                center = self.region.center
                middles = middles - box * np.round((middles - center) / box)
            inside = np.array([self.region.contains(own) for own in middles], dtype=bool)
            places = places[inside != self.outside]
        if self.count is None or self.count >= len(places):
            return places
        return np.sort(generator.choice(places, self.count, replace=False))


def read_deletion(entries):
    """The Deletion of Entries of DELETE."""
    entries.only_one("inside", "outside")
    region = entries["inside"] or entries["outside"]
    return Deletion(entries["count"], None if region is None else Region(region), "outside" in entries)


def read_cuts(listed):
    """The Planes of Entries of CUT."""
    planes = []
    for entries in listed or ():
        with entries.naming():
            planes.append(Plane(np.array(entries["point"]), np.array(entries["normal"])))
    return tuple(planes)
