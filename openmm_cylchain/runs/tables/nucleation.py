"""[[nucleation]] and [[branching]]: filaments that begin while a run goes on, and how."""

import dataclasses

from ...couplings.shapes import Box, Sphere
from ...kinetics.branching import Branching
from ...kinetics.nucleation import Nucleation
from ...units import quantities as units
from ..keys import REQUIRED, Flag, Inline, Key, Listing, Quantity, Whole, direction
from ..table import TableKind
from .filament import CONTACT_KEYS, MOST_NODES, SHARED, read_contact_diameter, reserve_group
from .filament_types import TYPE_KEYS, read_filament_type
from .growth import GROWTH, GROWTH_EXAMPLE, read_growth
from .shapes import REGION, REGION_EXAMPLE, Region

_WHICH = (
    Key(
        "table",
        Whole(1, None, "1"),
        None,
        "Number of a [[filament]] table, counted from 1: new filaments are of its type, and grow as its own do.",
    ),
    Key(
        "count",
        Whole(1, MOST_NODES, "100"),
        REQUIRED,
        "How many places there are for them: so many can be there at once. One that vanishes leaves its place.",
    ),
)
_OF_NEW_ONES = (
    Key("length", Quantity(units.LENGTH), None, "Of a new filament; the shortest of its growth if not given."),
    Key(
        "order",
        Whole(0, 100, "3"),
        0,
        "Power of the concentration of monomers that the rate goes with as a pool runs dry.",
    ),
)
_OWN_TYPE = (
    Key("growth", Inline(GROWTH, GROWTH_EXAMPLE), None, "Without a table: as of [[filament]]."),
    Key("propulsion", Quantity(units.FORCE, "any"), None, "Without a table: as of [[filament]]."),
    Key("planar", Flag(), None, "Without a table: whether each moves in a plane of constant z."),
    *(
        dataclasses.replace(key, default=None, text=f"Without a table. {key.text}")
        for key in (*CONTACT_KEYS, *TYPE_KEYS)
    ),
)
_BORROWED = tuple(key.name for key in _OWN_TYPE)

NUCLEATION = TableKind(
    "nucleation",
    (
        *_WHICH,
        Key(
            "rate",
            Quantity(units.RATE_PER_VOLUME, "zero"),
            None,
            'How often one begins in a volume, at the first concentration of monomers; "1 nM/s" is one, too.',
        ),
        Key("total_rate", Quantity(units.RATE, "zero"), None, "In place of rate: how often one begins in all."),
        Key(
            "inside",
            Inline(REGION, REGION_EXAMPLE),
            None,
            "Where first nodes are: a sphere or a box. The periodic box if not given.",
        ),
        Key("direction", direction(), None, "Direction of the first segment; any if not given."),
        *_OF_NEW_ONES,
        *_OWN_TYPE,
    ),
    "Filaments that are not there at first and begin at a rate, see `Nucleation`. A System cannot get more particles "
    "while it runs, so they have places. Their numbers come after those of all [[filament]] tables.",
    repeated=True,
    borrowed=_BORROWED,
)

BRANCHING = TableKind(
    "branching",
    (
        *_WHICH,
        Key(
            "rate",
            Quantity(units.RATE_PER_LENGTH, "zero"),
            REQUIRED,
            "How often one begins for each length of mothers, at the first concentration of monomers.",
        ),
        Key(
            "mothers",
            Listing(Whole(1, None, "1"), "numbers of [[filament]] tables", "[1]"),
            None,
            "Whose filaments, but not their branches, have branches; all that grow, and branches too, if not given.",
        ),
        Key("angle", Quantity(units.ANGLE), None, "At which branches leave their mothers: 70 degrees if not given."),
        Key(
            "angular_stiffness",
            Quantity(units.ENERGY),
            None,
            "Of that angle, K in K (theta-theta0)^2/2: 275 pN*nm if not given.",
        ),
        Key("stiffness", Quantity(units.STIFFNESS), None, "Of the spring at the first node: 40 pN/nm if not given."),
        Key("lever", Quantity(units.LENGTH), None, "Of the strut that holds the angle: 10 nm if not given."),
        Key(
            "distance",
            Quantity(units.LENGTH, "zero"),
            None,
            "From the axis of the mother to the first node. If not given: with [contacts] that at which the two touch, "
            "the largest of different mothers; or zero.",
        ),
        Key("debranching_rate", Quantity(units.RATE, "zero"), None, "At which a branch lets go; never if not given."),
        Key("debranching_force", Quantity(units.FORCE), None, "Force that makes it let go e times as often."),
        Key("inside", Inline(REGION, REGION_EXAMPLE), None, "Where mothers have them: a sphere or a box."),
        *_OF_NEW_ONES,
        *_OWN_TYPE,
    ),
    "Filaments that begin on the side of others, at an angle, see `Branching`. Their minus ends should be capped.",
    repeated=True,
    borrowed=_BORROWED,
)

_SHARED = ("length", "order")
_OF_BRANCHES = (
    "angle",
    "angular_stiffness",
    "stiffness",
    "lever",
    "distance",
    "debranching_rate",
    "debranching_force",
)


def read_nucleation(entries, groups, solvent, box, monomers, contacts):
    """The FilamentGroup of a [[nucleation]] table, for FilamentGroups of [[filament]] tables and MonomerGroups.

    ``contacts`` are the Entries of [contacts], or None.
    """
    entries.only_one("rate", "total_rate")
    if not entries.given("rate", "total_rate"):
        entries.require("rate")
    region = _region(entries)
    if region is None and box is None:
        raise entries.error(f"does not say where filaments begin: add a [box], or inside = {REGION_EXAMPLE}")
    rate = entries["total_rate"]
    if rate is None:
        rate = entries["rate"] * units.RATE_PER_VOLUME
    with entries.naming():
        own = Nucleation(rate=rate, region=region, **entries.given("direction", *_SHARED))
    return _group(entries, own, *_which(entries, groups, solvent, monomers, contacts))


def read_branching(entries, groups, solvent, monomers, contacts):
    """The FilamentGroup of a [[branching]] table, for those of all other tables, in the order of their filaments.

    ``contacts`` are the Entries of [contacts], or None.
    """
    which = _which(entries, groups, solvent, monomers, contacts)
    mothers = _mothers(entries, groups)
    # Branches that begin within the contact of their mothers would not begin at all.
    distance = _distance_of_contacts(mothers, groups, which[-1]["contact_diameter"])
    with entries.naming():
        own = Branching(
            rate=entries["rate"],
            region=_region(entries),
            mothers=mothers,
            **{**distance, **entries.given(*_OF_BRANCHES, *_SHARED)},
        )
    return _group(entries, own, *which)


def _distance_of_contacts(mothers, groups, diameter):
    # Branches may have branches, where no mothers are named.
    owners = [group for group in groups for _ in range(group.count)]
    others = [owners[number].contact_diameter for number in mothers or ()]
    if mothers is None:
        others = [diameter, *(group.contact_diameter for group in groups if group.growth is not None)]
    if diameter is None:
        return {}
    return {"distance": max((0.5 * (diameter + own) for own in others if own is not None), default=0.0)}


def _group(entries, nucleation, kind, growth, others):
    if nucleation.length is not None and nucleation.length > growth.longest:
        raise entries.at("length").error(f"must not exceed the longest of its growth, {growth.longest:g} nm.")
    direction = getattr(nucleation, "direction", None)
    if others["planar"] and direction is not None and direction[2] != 0.0:
        raise entries.at("direction").error("must lie in the xy plane, because these filaments are planar.")
    path = entries.place.path
    return reserve_group(entries, kind, growth, entries["count"], nucleation=nucleation, own_path=path, **others)


def _which(entries, groups, solvent, monomers, contacts):
    # Their type, their growth, and what else is that of their table.
    if "table" not in entries:
        if not entries.given(*_BORROWED):
            raise entries.error("does not say which filaments begin: add table = 1, or a type and its growth.")
        kind = read_filament_type(entries, solvent)
        entries.require("growth")
        own = {"propulsion": entries["propulsion"] or 0.0, "planar": bool(entries["planar"]), "table": 0}
        own["contact_diameter"] = read_contact_diameter(entries, kind, contacts)
        return kind, read_growth(entries["growth"], monomers), own
    entries.refuse(_BORROWED, "is that of the table whose number is given: leave one of them out.")
    found = [group for group in groups if group.path == ("filament", entries["table"] - 1)]
    if not found:
        raise entries.at("table").error(f"is {entries['table']}, but there is no such [[filament]] table.")
    first = found[0]
    if first.growth is None:
        raise entries.at("table").error(
            f"is {entries['table']}, whose filaments do not grow: add to it a line such as growth = {GROWTH_EXAMPLE}"
        )
    return first.type, first.growth, {key: getattr(first, key) for key in SHARED}


def _region(entries):
    if entries["inside"] is None:
        return None
    shape = Region(entries["inside"]).shape
    if not isinstance(shape, (Sphere, Box)):
        raise entries["inside"].at("shape").error("must be a sphere or a box where filaments begin.")
    return shape


def _mothers(entries, groups):
    if entries["mothers"] is None:
        return None
    numbers, first = [], 0
    for group in groups:
        if group.table in entries["mothers"] and not isinstance(group.nucleation, Branching):
            numbers += range(first, first + group.count)
        first += group.count
    for table in entries["mothers"]:
        found = [group for group in groups if group.table == table]
        if not found or found[0].growth is None:
            what = "whose filaments do not grow" if found else "but there is no such [[filament]] table"
            raise entries.at("mothers").error(f"names {table}, {what}: name others, or leave mothers out.")
    return numbers


def has_places(group, groups):
    """Whether there are places for parts of the filaments of a group: any of the same type and growth."""
    return any(own.is_reserve and own.growth is group.growth for own in groups)


def check_places(tables, groups):
    """Raise ConfigurationError for a table whose filaments are cut, but have no places for their parts."""
    for group in groups:
        severing = None if group.growth is None else group.growth.severing
        if severing is None or has_places(group, groups):
            continue
        name, index = group.path
        raise tables[name][index].error(
            "has filaments that are cut, and no places for their parts: add a line such as reserve = 100"
        )
