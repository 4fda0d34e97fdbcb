"""[contacts], [[tether]], [[pull]], [[end_frame]] and [[link]]: what acts on filaments, beside walls and linkers."""

from dataclasses import dataclass

from ...filaments.attachments import lengths_along
from ...filaments.twist import FILAMENT_ENDS
from ...units import quantities as units
from ..keys import (
    REQUIRED,
    Choice,
    Either,
    Flag,
    Key,
    Listing,
    Number,
    Pair,
    Quantity,
    Triple,
    Whole,
    direction,
    point,
)
from ..table import ACTIVE, TableKind, group_of
from .bodies import check_body, check_body_point

CONTACTS = TableKind(
    "contacts",
    (
        Key(
            "diameter",
            Quantity(units.LENGTH),
            None,
            "Distance of two axes at which filaments touch that have no contact_diameter of their own. Two that differ "
            "touch at the mean.",
        ),
        Key(
            "stiffness",
            Quantity(units.STIFFNESS),
            None,
            "Stiffness of a contact; without it, two filaments cross for 40 k_B T, or without filaments the two "
            "smallest spheres.",
        ),
        Key("excluded_neighbors", Whole(0, 10**6, "2"), None, "Segments of one filament that do not touch each other."),
        Key(
            "relax",
            Flag("false"),
            True,
            "Whether filaments, particles and bodies that are drawn on top of each other come apart before the run.",
        ),
        ACTIVE,
    ),
    "Filaments do not pass through each other: their segments are capsules, see `capsule_contact_force`. [[particles]] "
    "and [[body]] take part as spheres, which push each other, too, but not those of one body.",
)

NUMBERS = Either(
    (
        (list, Listing(Whole(0, None, "0"), "numbers of filaments", "[0, 1]")),
        (object, Whole(0, None, "0")),
    )
)
_WHICH = (
    Key("filament", NUMBERS, None, "Number of a filament, or a list of them, counted from 0 in the order of the file."),
    Key("table", Whole(1, None, "1"), None, "Number of a [[filament]] table, counted from 1: all of its filaments."),
)

TETHER = TableKind(
    "tether",
    (
        *_WHICH,
        Key("node", Whole(-(10**9), 10**9, "0"), REQUIRED, "Its number in the filament; -1 is the last one."),
        Key("point", point(), None, "Where the node is held; where it begins if not given."),
        Key("stiffness", Quantity(units.STIFFNESS), REQUIRED, "Stiffness of the spring."),
        Key(
            "velocity",
            Triple(Quantity(units.VELOCITY, "any"), '["1 um/s", "0 um/s", "0 um/s"]'),
            None,
            "Velocity at which the point moves; `pulling.csv` has its force at every report.",
        ),
        Key("start_time", Quantity(units.TIME, "zero"), 0.0, "Time until which the point stays where it begins."),
        ACTIVE,
    ),
    "A spring from a node of a filament to a point, such as an optical trap, see `Filaments.add_tether`. The point may "
    "move at a constant velocity.",
    repeated=True,
)

PULL = TableKind(
    "pull",
    (
        *_WHICH,
        Key(
            "tension",
            Quantity(units.FORCE, "any"),
            None,
            "Force on both ends, in opposite directions; negative to compress.",
        ),
        Key("direction", direction(), (1.0, 0.0, 0.0), "Direction of the tension on the last node."),
        Key("node", Whole(-(10**9), 10**9, "-1"), None, "Node on which the force acts."),
        Key("force", Triple(Quantity(units.FORCE, "any"), '["1 pN", "0 pN", "0 pN"]'), None, "Force on that node."),
        ACTIVE,
    ),
    "Constant forces: a tension, or a force on one node of each filament.",
    repeated=True,
)

END_FRAME = TableKind(
    "end_frame",
    (
        *_WHICH,
        Key("end", Choice(FILAMENT_ENDS), REQUIRED, "minus is that of the first node, plus that of the last."),
        Key(
            "direction",
            direction(),
            (1.0, 0.0, 0.0),
            "From minus to plus: where the filament would go on, or has come from.",
        ),
        Key(
            "torque",
            Quantity(units.ENERGY, "any"),
            None,
            "Torque on a frame that turns; without it and without a friction, the frame is held.",
        ),
        Key(
            "rotational_friction",
            Quantity(units.ROTATIONAL_FRICTION),
            None,
            "Of a frame that turns against it, as a bead does: pi eta d^3 of a sphere.",
        ),
        Key(
            "angular_velocity",
            Quantity(units.RATE, "any"),
            0.0,
            "Of a frame that is held: radians per time, about the direction.",
        ),
        Key("body", Whole(0, None, "0"), None, "Number of the body that carries the frame, counted from 0."),
    ),
    "What binds the material at an end of filaments with twist, such as a magnetic bead, see "
    "`Filaments.add_end_frame`; `twist.csv` has twist and torque of these filaments at every report.",
    repeated=True,
)

PLACE_KEYS = (
    Key("filament", Whole(0, None, "0"), None, "Number of a filament."),
    Key("arc_length", Quantity(units.LENGTH, "zero"), None, "Distance from its first node along it."),
    Key("segment", Whole(-(10**9), 10**9, "0"), None, "Number of its segment, in place of an arc_length."),
    Key("fraction", Number("0.5"), None, "Place on that segment, 0 to 1."),
    Key("node", Whole(-(10**9), 10**9, "0"), None, "Number of its node, in place of a segment."),
    Key("point", point(), None, "A fixed point, in place of a filament."),
    Key("body", Whole(0, None, "0"), None, "Number of a body, counted from 0 in the order of the file."),
    Key("body_point", Whole(0, None, "0"), 0, "Number of its point; 0 is the centre of a sphere."),
)
_PLACE = TableKind("place", PLACE_KEYS, "A place on a filament or a body, or a point.")
_PLACES = '[{ filament = 0, arc_length = "1 um" }, { filament = 1, node = 0 }]'

LINK = TableKind(
    "link",
    (
        Key("between", Pair(_PLACE, _PLACES), None, "Two places that are joined."),
        Key(
            "within",
            Quantity(units.LENGTH),
            None,
            "In place of between: random pairs of places on filaments this near.",
        ),
        Key("count", Whole(0, 10**7, "100"), None, "How many random ones at most; all if not given."),
        Key(
            "spacing",
            Quantity(units.LENGTH),
            None,
            "Distance of the places along filaments that random ones join; half a segment if not given.",
        ),
        Key("stiffness", Quantity(units.STIFFNESS), REQUIRED, "Stiffness of the spring."),
        Key(
            "rest_length",
            Quantity(units.LENGTH, "zero"),
            None,
            "Rest length of the spring; without it, the spring is at rest as the run begins.",
        ),
        Key("model", Choice(("harmonic", "fene")), "harmonic", "Energy of the spring."),
        Key("maximum_extension", Quantity(units.LENGTH), None, "Largest extension of a FENE spring."),
        ACTIVE,
    ),
    "Springs that stay: one between two places, or random ones between filaments, see `Crosslinks`.",
    repeated=True,
)


@dataclass(frozen=True)
class Contacts:
    """The [contacts] table, but for diameters, which FilamentGroups have."""

    stiffness: float | None
    excluded_neighbors: int | None
    relax: bool


@dataclass(frozen=True)
class TetherGroup:
    """A [[tether]] table, whose number is counted from 0: a node of each of some filaments.

    The point is in nm, or None; the velocity in nm/ps, or None.
    """

    filaments: tuple
    node: int
    point: tuple | None
    stiffness: float
    velocity: tuple | None
    start_time: float
    number: int = 0


@dataclass(frozen=True)
class Pull:
    """A [[pull]] table: a tension of some filaments, or else a force on a node of each."""

    filaments: tuple
    tension: float | None
    direction: tuple
    node: int | None
    force: tuple | None


@dataclass(frozen=True)
class EndFrameGroup:
    """An [[end_frame]] table: a frame beyond the same end of some filaments; numbers in OpenMM's units."""

    filaments: tuple
    end: str
    direction: tuple
    torque: float | None
    angular_velocity: float
    rotational_friction: float | None
    body: int | None


@dataclass(frozen=True)
class LinkGroup:
    """A [[link]] table: a pair of places, as dicts, or else random links; lengths in nm."""

    between: tuple | None
    within: float | None
    count: int | None
    spacing: float | None
    stiffness: float
    rest_length: float | None
    model: str
    maximum_extension: float | None
    label: str


def read_contacts(entries):
    """The Contacts of a [contacts] table."""
    return Contacts(*(entries[name] for name in ("stiffness", "excluded_neighbors", "relax")))


def read_tether(entries, groups):
    """The TetherGroup of a [[tether]] table."""
    numbers = _filaments(entries, groups)
    _check_node(entries, numbers, groups)
    if "velocity" in entries and not any(entries["velocity"]):
        raise entries.at("velocity").error("is zero: leave it out for a point that stays.")
    if "start_time" in entries:
        entries.require("velocity")
    names = ("node", "point", "stiffness", "velocity", "start_time")
    return TetherGroup(numbers, *(entries[name] for name in names), entries.place.path[1])


def read_pull(entries, groups):
    """The Pull of a [[pull]] table."""
    entries.only_one("tension", "force")
    if "force" in entries:
        entries.require("node")
        entries.refuse(("direction",), "belongs to a tension.")
    else:
        entries.require("tension")
        entries.refuse(("node",), "belongs to a force.")
    numbers = _filaments(entries, groups)
    if "node" in entries:
        _check_node(entries, numbers, groups)
    return Pull(numbers, entries["tension"], entries["direction"], entries["node"], entries["force"])


def read_end_frame(entries, groups, bodies):
    """The EndFrameGroup of an [[end_frame]] table."""
    names = ("end", "direction", "torque", "angular_velocity", "rotational_friction", "body")
    if "body" in entries:
        check_body(entries, bodies)
    return EndFrameGroup(_filaments(entries, groups), *(entries[name] for name in names))


def read_link(entries, groups, bodies):
    """The LinkGroup of a [[link]] table."""
    entries.only_one("between", "within")
    if "between" in entries:
        entries.refuse(("count", "spacing"), "belongs to random links, within a distance.")
        for place in entries["between"]:
            check_place(place, groups, bodies)
        if all("point" in place for place in entries["between"]):
            raise entries.at("between").error("must have a filament or a body: two points cannot be joined.")
    elif "within" not in entries:
        raise entries.error(f'lacks its places: add a line such as between = {_PLACES}, or within = "30 nm".')
    if (entries["model"] == "fene") != ("maximum_extension" in entries):
        raise entries.error('maximum_extension must be given for model = "fene", and only for it.')
    values = {name: value for name, value in entries.values.items() if name != ACTIVE.name}
    between = None if entries["between"] is None else tuple(place.values for place in entries["between"])
    return LinkGroup(**{**values, "between": between}, label=entries.label)


def _filaments(entries, groups):
    # Numbers of the filaments that a table means.
    entries.only_one("filament", "table")
    if "table" in entries:
        numbers, first = [], 0
        for group in groups:
            there = group.table == entries["table"] and not group.is_reserve
            numbers += range(first, first + group.count) if there else ()
            first += group.count
        if not numbers:
            raise entries.at("table").error(f"is {entries['table']}, but there is no such [[filament]] table.")
        return tuple(numbers)
    entries.require("filament")
    numbers = entries["filament"] if isinstance(entries["filament"], tuple) else (entries["filament"],)
    for number in numbers:
        check_filament(entries, number, groups)
    if len(set(numbers)) < len(numbers):
        raise entries.at("filament").error(f"must name different filaments, but is {list(numbers)}.")
    return numbers


def check_filament(entries, number, groups):
    """Raise ConfigurationError for the number of a filament that FilamentGroups do not have."""
    count = sum(group.count for group in groups)
    if number >= count:
        raise entries.at("filament").error(f"{number} does not exist; there are {count}, counted from 0.")


def _check_node(entries, numbers, groups):
    for number in numbers:
        nodes = group_of(number, groups).nodes
        if not -nodes <= entries["node"] < nodes:
            raise entries.at("node").error(
                f"{entries['node']} does not exist in filament {number}; there are {nodes}, counted from 0."
            )


def check_place(place, groups, bodies=()):
    """Raise ConfigurationError unless a table is a place on a filament of the groups or on a body, or a point."""
    if "body" in place:
        place.refuse(("filament", "arc_length", "segment", "fraction", "node", "point"), "cannot be with a body.")
        check_body_point(place, bodies)
        return
    place.refuse(("body_point",), "belongs to a body.")
    if "point" in place:
        place.refuse(("filament", "arc_length", "segment", "fraction", "node"), "cannot be with a point.")
        return
    place.require("filament")
    check_filament(place, place["filament"], groups)
    place.only_one("arc_length", "segment", "node")
    if not place.given("arc_length", "segment", "node"):
        raise place.error("lacks a place on the filament: give an arc_length, a segment or a node.")
    if "fraction" in place:
        place.require("segment")
        if not 0.0 <= place["fraction"] <= 1.0:
            raise place.at("fraction").error(f"must be between 0 and 1, but is {place['fraction']:g}.")
    if "node" in place:
        _check_node(place, (place["filament"],), groups)
    group = group_of(place["filament"], groups)
    if "segment" in place and not -group.segments <= place["segment"] < group.segments:
        raise place.at("segment").error(f"{place['segment']} does not exist; there are {group.segments}.")
    length = float(lengths_along(group.type, group.segments, group.closed).sum())
    if "arc_length" in place and place["arc_length"] > length * (1.0 + 1e-9):
        raise place.at("arc_length").error(f"is beyond the end of the filament, which is {length:g} nm long.")
