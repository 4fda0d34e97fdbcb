"""[[wall]]: what keeps filaments, bodies and particles in, out, or on its surface."""

from dataclasses import dataclass

from ...couplings.walls import NODES, SIDES
from ...units import quantities as units
from ..keys import REQUIRED, Choice, Flag, Key, Quantity
from ..table import ACTIVE, TableKind
from .filament_types import TypeNames
from .shapes import SHAPE_KEYS, read_walls_of, volume_within

WALL = TableKind(
    "wall",
    (
        *SHAPE_KEYS,
        Key("stiffness", Quantity(units.STIFFNESS), REQUIRED, "Stiffness of the spring that pushes back."),
        Key(
            "distance",
            Quantity(units.LENGTH, "zero"),
            0.0,
            "That axes of filaments keep from the wall, such as their radius.",
        ),
        Key(
            "side",
            Choice(SIDES),
            "inside",
            "Where it keeps them: surface holds nodes of filaments, and centres of bodies and particles, on the wall "
            "from both sides. For shapes with one face.",
        ),
        Key(
            "whole",
            Flag("false"),
            True,
            "Whether bodies and particles are inside or outside with all of their spheres; if not, with the centres of "
            "these.",
        ),
        Key(
            "nodes",
            Choice(tuple(NODES)),
            "all",
            "Which nodes of filaments it is for; of bodies with several spheres, first is for that of their first "
            "point, and last and ends are refused.",
        ),
        Key(
            "holds",
            TypeNames("filaments, bodies or particles", '["F_ACTIN", "POLE"]'),
            None,
            "Names of types of filaments, of bodies and of particles that it is for; for all if not given.",
        ),
        ACTIVE,
    ),
    "A wall around all filaments, particles and bodies, or some of them, see `filament_wall_force`.",
    repeated=True,
)


@dataclass(frozen=True)
class Wall:
    """A [[wall]] table, whose number is counted from 0, or a face of the prism that it is; the distance in nm.

    ``first_face`` is the number of its first face among those of the table.
    """

    shape: object
    stiffness: float
    distance: float
    held_types: tuple | None = None
    number: int = 0
    side: str = "inside"
    nodes: str = "all"
    whole: bool = True
    first_face: int = 0

    @property
    def faces(self):
        """The numbers of its faces among those of the table."""
        return range(self.first_face, self.first_face + len(self.shape.faces))

    @property
    def encloses_all(self):
        """Whether all filaments, bodies and particles are inside of it as a whole."""
        return self.held_types is None and self.side == "inside" and self.nodes == "all"

    def holds(self, kind):
        """Whether it is for filaments of a type, or for bodies or particles of a group, with a name."""
        return self.held_types is None or kind.name in self.held_types


def read_walls(entries):
    """The Walls of a [[wall]] table: of a prism one for each of its faces."""
    shapes, side = read_walls_of(entries), entries["side"]
    if side != "inside" and sum(len(shape.faces) for shape in shapes) > 1:
        raise entries.at("side").error(f'must be "inside" of a {entries["shape"]}, which has several faces.')
    room = min(shape.room for shape in shapes)
    if side != "outside" and entries["distance"] >= room:
        raise entries.at("distance").error(f"must be below {room:g} nm to fit into the shape.")
    whole = entries["whole"] and side != "surface"
    own = [entries[name] for name in ("stiffness", "distance", "holds")]
    walls, first_face = [], 0
    for shape in shapes:
        walls.append(Wall(shape, *own, entries.place.path[1], side, entries["nodes"], whole, first_face))
        first_face += len(shape.faces)
    return walls


def walls_of_all(walls):
    """Shapes of those Walls that all is inside of."""
    return [wall.shape for wall in walls if wall.encloses_all]


def volume_of_walls(walls, box):
    """The volume in nm^3 that Walls and a periodic box leave to what is in neither of them; None if nobody knows."""
    if any(wall.held_types is None and wall.side == "outside" for wall in walls):
        return None
    return volume_within(walls_of_all(walls), box)


def check_walls(tables, walls, groups, bodies, particles):
    """Raise ConfigurationError for a [[wall]] table that holds nothing of FilamentGroups, BodyGroups and particles.

    ``particles`` are names of [[particles]] tables.
    """
    there = {group.type.name for group in groups} | {group.body.name for group in bodies} | set(particles)
    numbered = {entries.place.path[1]: entries for entries in tables}
    for wall in walls:
        entries = numbered[wall.number]
        for name in wall.held_types or ():
            if name not in there:
                raise entries.at("holds").error(
                    f"names {name}, but filaments, bodies and particles of the configuration are "
                    f"{', '.join(sorted(there))}."
                )
        if wall.nodes == "all":
            continue
        for group in groups:
            if wall.holds(group.type) and (group.growth is not None or group.closed):
                what = "grow" if group.growth is not None else "are rings"
                raise entries.at("nodes").error(f'must be "all" for filaments that {what} ({group.label}).')
        for group in bodies:
            if wall.nodes != "first" and wall.holds(group.body) and (group.body.radii > 0.0).sum() > 1:
                raise entries.at("nodes").error(
                    f'must be "all" or "first" for the body {group.body.name}, which has several spheres.'
                )
