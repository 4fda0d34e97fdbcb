"""[[body]]: rigid bodies, and filaments that begin on them."""

import dataclasses
import math
from dataclasses import dataclass

import numpy as np

from ...errors import InputError
from ...filaments.body import Body, random_rotation, rotation_along
from ...filaments.end_states import ENDS
from ...units import quantities as units
from ..keys import REQUIRED, Choice, Flag, Inline, Key, Listing, Quantity, Text, Whole, direction, point
from ..table import TableKind, group_of
from .particles import check_name_and_places
from .shapes import REGION, REGION_EXAMPLE, Region

_TAKEN = ("NOD", "ATT", "BED", "BOD")
_MOST_BODIES = 10**6
_TRIES = 2000
_SAME_PLACE = 1e-6
_SAID_BY_BODIES = (
    *("position", "direction", "orientation", "inside", "nodes", "tangents", "file", "closed", "normal"),
    *("clamped", "clamped_tangents", "height"),
)
"""Keys of a [[filament]] table whose filaments bodies hold."""

_HELD_EXAMPLE = '{ table = 1, stiffness = "1 pN/nm", arm_stiffness = "0.5 pN/nm" }'
_HELD = TableKind(
    "filaments",
    (
        Key("table", Whole(1, None, "1"), REQUIRED, "Number of the [[filament]] table, counted from 1: equal shares."),
        Key("end", Choice(("minus", "plus")), "minus", "Which end is held: the first node, or the last one."),
        Key("stiffness", Quantity(units.STIFFNESS), REQUIRED, "Stiffness of the spring that holds this end."),
        Key(
            "distance",
            Quantity(units.LENGTH, "zero"),
            None,
            "How far from the origin of the body it is held; the radius of its sphere if not given. With [contacts], "
            "filaments must not overlap there.",
        ),
        Key(
            "arm_stiffness",
            Quantity(units.STIFFNESS),
            None,
            "Stiffness of a second spring, which keeps filaments radial; without it, they turn freely about their end.",
        ),
        Key(
            "arm",
            Quantity(units.LENGTH),
            None,
            "How far along the filament the second spring is, whose place on the body is as far out, and below which "
            "filaments must not shrink; a segment if not given, or the shortest length, if that is less.",
        ),
        Key(
            "spread",
            Choice(("even", "random")),
            "even",
            "Whether directions are spread evenly around the body, or drawn at random.",
        ),
        Key(
            "places",
            Listing(point(), "points", '[["0 nm", "50 nm", "0 nm"], ["0 nm", "-50 nm", "0 nm"]]'),
            None,
            "In place of distance and spread: where the filaments of a body are held, in its frame.",
        ),
        Key(
            "directions",
            Listing(direction(), "directions", "[[1, 0, 0], [1, 0, 0]]"),
            None,
            "With places: where each of them points, away from the end that is held.",
        ),
    ),
    "Filaments that begin on bodies, straight and along the radius: asters, spindle poles. They are held by springs "
    "that stay: links, or, of filaments that grow, linkers that never unbind.",
    owner="filaments of [[body]]",
)

BODY = TableKind(
    "body",
    (
        Key("name", Text('"POLE"'), "BODY", "1 to 5 letters or digits, for structure files and pictures."),
        Key("radius", Quantity(units.LENGTH), None, "Radius of a sphere, whose centre is point 0 of the body."),
        Key(
            "points",
            Listing(point(), "points", '[["0 nm", "0 nm", "0 nm"], ["300 nm", "0 nm", "0 nm"]]'),
            None,
            "Places in the frame of the body, which links and anchors hold: points 1, 2, ... of a sphere; with radii, "
            "points 0, 1, ... of a set of spheres.",
        ),
        Key(
            "radii",
            Listing(Quantity(units.LENGTH, "zero"), "lengths", '["200 nm", "100 nm"]'),
            None,
            "In place of radius: that of a sphere about each point, or zero for one that is a place alone.",
        ),
        Key(
            "viscosity",
            Quantity(units.VISCOSITY),
            None,
            "Of what it moves in, and to which its friction is in proportion; that of the solvent if not given.",
        ),
        Key("count", Whole(1, _MOST_BODIES, "10"), None, "How many begin at random places."),
        Key(
            "positions",
            Listing(point(), "points", '[["0 nm", "0 nm", "0 nm"]]'),
            None,
            "In place of count: where the origins of their frames begin.",
        ),
        Key("inside", Inline(REGION, REGION_EXAMPLE), None, "A region of random places; the box if not given."),
        Key(
            "direction",
            direction(),
            None,
            "Where the x axis of their frame points, with its y axis in the xy plane; if not given, each is turned at "
            "random.",
        ),
        Key(
            "planar",
            Flag("false"),
            None,
            "Whether they stay in a plane of constant z; if not given, they do where all filaments do.",
        ),
        Key(
            "contacts",
            Flag("false"),
            None,
            "Whether their spheres push filaments, particles and other bodies that touch them, with [contacts]; true "
            "if not given, but false for bodies that hold filaments.",
        ),
        Key("filaments", Inline(_HELD, _HELD_EXAMPLE), None, "Filaments that begin on them: see below."),
    ),
    "Rigid bodies: beads, vesicles, nuclei, spindle poles, asters, see `Body`. [[link]] and the anchors of [[linkers]] "
    "take hold of their points. [contacts] and [[wall]] act on their spheres. They need the compiled engine and the "
    "scheme implicit.",
    repeated=True,
)


@dataclass(frozen=True)
class HeldFilaments:
    """Filaments that the bodies of a table hold: numbers in the configuration, of which body i of n has i, i+n, ...

    ``places`` and ``directions`` are those of the filaments of a body in its frame, ``bases`` and ``arms`` the numbers
    of the points that hold them; lengths in nm. ``growing`` says whether linkers hold them.
    """

    table: int
    end: str
    stiffness: float
    arm_stiffness: float | None
    arm: float
    numbers: tuple
    places: np.ndarray = dataclasses.field(compare=False)
    directions: np.ndarray = dataclasses.field(compare=False)
    bases: tuple = ()
    arms: tuple = ()
    growing: bool = False


@dataclass(frozen=True)
class BodyGroup:
    """The bodies of a [[body]] table; lengths in nm."""

    body: Body = dataclasses.field(compare=False)
    count: int
    positions: tuple | None
    inside: Region | None
    direction: tuple | None
    planar: bool
    height: float
    contacts: bool
    held: HeldFilaments | None

    def starts(self, generator, box):
        """Where they begin: pairs of an origin (3,) in nm and a rotation matrix (3, 3)."""
        for number in range(self.count):
            yield self._start(number, generator, box)

    def _start(self, number, generator, box):
        if self.positions is not None:
            return np.array(self.positions[number]), self._rotation(generator)
        for _ in range(_TRIES):
            origin = generator.uniform(0.0, box) if self.inside is None else self.inside.draw(generator)
            rotation = self._rotation(generator)
            if self.planar:
                origin[2] = self.height
            spheres = origin + self.body.points[self.body.radii > 0.0] @ rotation.T
            if self.inside is None or self.inside.contains(spheres):
                return origin, rotation
        raise InputError("inside is too small: at none of many random places are all of its spheres in it.")

    def _rotation(self, generator):
        if self.direction is None:
            return random_rotation(generator, self.planar)
        return rotation_along(np.array(self.direction))


def read_body(entries, tables, groups, box, seed):
    """The BodyGroup of a [[body]] table, for FilamentGroups and the tables that they were read from.

    The seed is that of random directions of filaments.
    """
    check_name_and_places(entries, box, _TAKEN, "other particles")
    entries.only_one("radius", "radii")
    planes = [group.planar for group in groups]
    planar = bool(planes) and all(planes) if entries["planar"] is None else entries["planar"]
    if planar and entries["direction"] is not None and entries["direction"][2] != 0.0:
        raise entries.at("direction").error("must lie in the xy plane, because these bodies are planar.")
    count = entries["count"] if entries["positions"] is None else len(entries["positions"])
    points, radii = _points(entries)
    held = None
    if entries["filaments"] is not None:
        points, held = _held(entries, tables, groups, planar, count, points, radii, [seed, *entries.place.path[1:], 7])
        radii = np.concatenate([radii, np.zeros(len(points) - len(radii))])
    with entries.naming():
        body = Body(points, radii, entries["name"], entries["viscosity"])
    return BodyGroup(
        body,
        count,
        entries["positions"],
        None if entries["inside"] is None else Region(entries["inside"]),
        entries["direction"],
        planar,
        groups[0].height if groups else 0.0,
        held is None if entries["contacts"] is None else entries["contacts"],
        held,
    )


def with_bodies(groups, bodies):
    """FilamentGroups of which those that BodyGroups hold know it."""
    held = {own.held.table for own in bodies if own.held is not None}
    return tuple(
        dataclasses.replace(group, start="straight", on_body=True)
        if group.table in held and not group.is_reserve
        else group
        for group in groups
    )


def check_body(entries, bodies):
    """Raise ConfigurationError unless a table with the key body names one of BodyGroups."""
    count = sum(own.count for own in bodies)
    if entries["body"] >= count:
        raise entries.at("body").error(f"{entries['body']} does not exist; there are {count}, counted from 0.")


def check_body_point(place, bodies):
    """Raise ConfigurationError unless a table with the keys body and body_point names a point of BodyGroups."""
    check_body(place, bodies)
    points = len(group_of(place["body"], bodies).body.points)
    if place["body_point"] >= points:
        raise place.at("body_point").error(f"{place['body_point']} does not exist; there are {points}, from 0 on.")


def _points(entries):
    given = np.array(entries["points"] or np.zeros((0, 3)))
    if "radius" in entries:
        return np.concatenate([np.zeros((1, 3)), given]), np.r_[entries["radius"], np.zeros(len(given))]
    if "radii" not in entries:
        raise entries.error('lacks its size: add a line such as radius = "200 nm", or points with radii.')
    entries.require("points")
    if len(entries["radii"]) != len(given):
        raise entries.at("radii").error(
            f"must be one for each of the {len(given)} points, but are {len(entries['radii'])}."
        )
    return given, np.array(entries["radii"])


def _held(entries, tables, groups, planar, count, points, radii, seed):
    own = entries["filaments"]
    table = own["table"]
    numbers, first, held = [], 0, []
    for group in groups:
        if group.table == table and not group.is_reserve:
            numbers += range(first, first + group.count)
            held.append(group)
        first += group.count
    if not held:
        raise own.at("table").error(f"is {table}, but there is no such [[filament]] table.")
    others = [one["filaments"] for one in tables["body"] if one["filaments"] is not None]
    if sum(one["table"] == table for one in others) > 1:
        raise own.at("table").error(f"is {table}, as in another [[body]] table: a filament is on one body.")
    _check_filaments(tables["filament"][table - 1], own, held, planar)
    shrunk = min(map(_shrunk_length, held))
    arm = min(held[0].type.segment_length, shrunk) if own["arm"] is None else own["arm"]
    if own["arm_stiffness"] is None:
        own.refuse(("arm",), "belongs to an arm_stiffness.")
    shortest = min(map(_length, held))
    if own["arm_stiffness"] is not None and arm > shortest * (1.0 + 1e-9):
        raise own.at("arm").error(f"is {arm:g} nm, but filaments are {shortest:g} nm long: take a shorter one.")
    if own["arm_stiffness"] is not None and arm > shrunk * (1.0 + 1e-9):
        raise own.at("arm").error(
            f"is {arm:g} nm, but filaments may shrink to {shrunk:.6g} nm, and would lose the second spring: take a "
            "shorter one, or a larger shortest length in their growth."
        )
    origins, directions = _origins(entries, own, len(numbers), count, planar, np.random.default_rng(seed))
    places = list(points)
    bases = _add_points(places, len(points), origins)
    arms = []
    if own["arm_stiffness"] is not None:
        arms = _add_points(places, len(points), origins + arm * directions)
    growing = held[0].growth is not None
    names = ("end", "stiffness")
    return np.array(places), HeldFilaments(
        table,
        *(own[key] for key in names),
        own["arm_stiffness"],
        arm,
        tuple(numbers),
        origins,
        directions,
        tuple(bases),
        tuple(arms),
        growing,
    )


def _origins(entries, own, filaments, count, planar, generator):
    # Where the filaments of a body are held, and their directions: (n, 3) each.
    if "places" not in own:
        own.refuse(("directions",), "belong to places.")
        if own["distance"] is None and "radius" not in entries:
            raise own.error('lacks the key "distance", since the body is no single sphere: distance = "200 nm"')
        distance = entries["radius"] if own["distance"] is None else own["distance"]
        directions = _directions(-(-filaments // count), own["spread"], planar, generator)
        return distance * directions, directions
    own.refuse(("distance", "spread"), "cannot be with places.")
    own.require("directions")
    places, directions = np.array(own["places"]), np.array(own["directions"])
    if not len(places) == len(directions) == filaments / count:
        raise own.at("places").error(
            f"and directions must be one for each filament of a body: {filaments / count:g}, but are {len(places)} "
            f"and {len(directions)}."
        )
    if planar and (np.any(places[:, 2]) or np.any(directions[:, 2])):
        raise own.at("places").error("and directions must lie in the xy plane, because these bodies are planar.")
    return places, directions


def _check_filaments(entries, own, groups, planar):
    entries.refuse(_SAID_BY_BODIES, "cannot be given: these filaments begin on bodies.")
    if entries["start"] == "equilibrium":
        raise entries.at("start").error("must be straight, because these filaments begin on bodies.")
    growth, capped = groups[0].growth, f"{own['end']}_capped"
    if growth is not None and not getattr(growth, capped):
        raise own.at("end").error(
            f"is one that grows: what holds a filament stays at its monomer. Write {capped} = true in its growth."
        )
    if any(group.planar for group in groups) and not planar:
        raise own.at("table").error("is one of planar filaments: its bodies must be planar, too.")


def _length(group):
    return float(group.type.segment_lengths(group.segments, group.closed).sum())


def _shrunk_length(group):
    # The least length that it may have: without growth, that which it has.
    growth = group.growth
    if growth is None or not any(max(growth.states(end).off_rates) > 0.0 for end in ENDS):
        return _length(group)
    return min(_length(group), growth.fewest_monomers(group.type) * growth.monomers.length)


def _directions(count, spread, planar, generator):
    if spread == "random":
        vectors = generator.normal(size=(count, 3))
        vectors[:, 2] *= not planar
        return vectors / np.linalg.norm(vectors, axis=1, keepdims=True)
    if planar:
        angles = 2.0 * math.pi * np.arange(count) / count
        vectors = np.stack([np.cos(angles), np.sin(angles), np.zeros(count)], axis=1)
    else:
        # On a spiral from pole to pole, with the same area for each.
        heights = 1.0 - (2.0 * np.arange(count) + 1.0) / count
        angles = math.pi * (3.0 - math.sqrt(5.0)) * np.arange(count)
        around = np.sqrt(1.0 - heights**2)
        vectors = np.stack([around * np.cos(angles), around * np.sin(angles), heights], axis=1)
    # Filaments of one length follow each other in the table, but not around the body.
    return generator.permutation(vectors)


def _add_points(places, given, vectors):
    # Their numbers; there is one point where several are in one place, or where one of those that are given is.
    known = {_rounded(there): number for number, there in enumerate(places[:given])}
    numbers = []
    for vector in vectors:
        number = known.setdefault(_rounded(vector), len(places))
        if number == len(places):
            places.append(vector)
        numbers.append(number)
    return numbers


def _rounded(vector):
    return tuple(np.round(vector / _SAME_PLACE).astype(np.int64).tolist())
