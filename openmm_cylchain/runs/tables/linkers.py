"""[[linkers]]: crosslinkers and motors that bind, walk and unbind."""

import dataclasses
from dataclasses import dataclass

import numpy as np

from ...couplings.wall_points import random_points_on
from ...errors import InputError
from ...kinetics.binding_range import ENDS_OF_RANGE, BindingRange
from ...kinetics.crosslinker import Crosslinker
from ...kinetics.hand import AT_ENDS, Hand
from ...kinetics.hand_at_end import HandAtEnd
from ...kinetics.hand_on_helix import HandOnHelix
from ...kinetics.linkers import as_linkers, is_closed
from ...kinetics.presets import PRESETS
from ...units import quantities as units
from ..keys import REQUIRED, Choice, Flag, Inline, Key, Listing, Number, Pair, Quantity, Text, Whole, as_written, point
from ..table import Entries, TableKind
from .couplings import NUMBERS
from .filament_types import TypeNames
from .nucleation import has_places
from .shapes import REGION, REGION_EXAMPLE, Region
from .solvent import EDGES
from .walls import volume_of_walls

_QUANTITIES = {
    "binding_rate": (units.RATE, "zero", "Rate at which a hand binds that has filaments within reach."),
    "reach": (units.LENGTH, "positive", "How far a hand binds."),
    "unbinding_rate": (units.RATE, "zero", "Rate at which a hand unbinds without a load."),
    "unbinding_force": (units.FORCE, "positive", "Force at which a hand unbinds e times as fast."),
    "catch_rate": (units.RATE, "zero", "Rate of unbinding of a catch bond without a load; loads slow it down."),
    "catch_force": (units.FORCE, "positive", "Force at which a catch bond unbinds e times as slowly."),
    "speed": (
        units.VELOCITY,
        "any",
        "Speed of walking towards the last node; negative towards the first, zero if it stands.",
    ),
    "stall_force": (units.FORCE, "positive", "Force at which a hand stands still."),
    "sliding_friction": (units.FRICTION, "positive", "Friction of a hand that slides along filaments."),
    "site_spacing": (units.LENGTH, "positive", "Distance of binding sites, each of which holds one hand."),
    "severing_rate": (
        units.RATE,
        "zero",
        "Rate at which it cuts the filament that it is bound to, which grows. Parts need places: reserve of "
        "[[filament]].",
    ),
}


class _Anchors:
    """Points, numbers of nodes, or a region in which points are drawn."""

    example = '[["0 nm", "0 nm", "0 nm"], ["100 nm", "0 nm", "0 nm"]]'
    text = "a list of points or of numbers of nodes, or a table"

    @property
    def table(self):
        return _ANCHOR_REGION

    def read(self, value, place):
        if isinstance(value, dict):
            return _ANCHOR_REGION.read(value, place)
        if not isinstance(value, list) or not value:
            raise place.error(
                f"must be a list of points, as in {self.example}, or of numbers of nodes, as in [0, 64], or a region, "
                "as in { count = 1000, lower = [...], upper = [...] }"
            )
        if all(isinstance(own, int) and not isinstance(own, bool) for own in value):
            return tuple(value)
        for index, own in enumerate(value):
            if not isinstance(own, list) or len(own) != 3:
                raise place.item(index).error(f"must be a point, as in {self.example}, but is {as_written(own)}.")
        return tuple(point().read(own, place.item(index)) for index, own in enumerate(value))

    def schema(self):
        numbers = {"type": "array", "items": {"type": "integer", "minimum": 0}, "minItems": 1}
        points = {"type": "array", "items": point().schema(), "minItems": 1}
        return {"anyOf": [points, numbers, _ANCHOR_REGION.schema()]}


_AT_END_EXAMPLE = (
    '{ end = "plus", range = "20 nm", binds_there = true, tracks = true, changes = ["free", "with formin"] }'
)
_AT_END = TableKind(
    "filament_end",
    (
        Key("end", Choice(ENDS_OF_RANGE), REQUIRED, "Which one."),
        Key("range", Quantity(units.LENGTH), REQUIRED, "How near to it a hand counts as there."),
        Key("binds_there", Flag(), False, "Whether it binds there alone, and is at the end itself then."),
        Key("tracks", Flag(), False, "Whether it stays at the end while that grows and shrinks, once it is there."),
        Key("off_rate", Quantity(units.RATE, "zero"), None, "At which it takes monomers off the end, if given."),
        Key("sites", Whole(1, None, "14"), None, "How many of its kind do so at a time at an end, at most."),
        Key("unbinding_rate", Quantity(units.RATE, "zero"), None, "That of a hand there; its own if not given."),
        Key(
            "changes",
            Listing(Text('"free"'), "two names of states", '["free", "with formin"]', 2),
            None,
            "An end in the first state is in the second one as long as such a hand is there: names of plus_states or "
            'minus_states of growth, or "growing" and "shrinking" of ends that do so in turn.',
        ),
    ),
    "What a hand has to do with an end of filaments that grow, see `HandAtEnd`.",
    owner="filament_end of the hand of [[linkers]]",
)

_RANGE_EXAMPLE = '{ end = "plus", range = "200 nm" }'
_RANGE = TableKind(
    "binding_range",
    (
        Key("end", Choice(ENDS_OF_RANGE), REQUIRED, "Which one."),
        Key("range", Quantity(units.LENGTH), REQUIRED, "How near to it is near."),
        Key("excluded", Flag(), False, "Whether a hand binds to all else; without it, to what is near alone."),
    ),
    "The part of filaments to which a hand binds, see `BindingRange`.",
    owner="binding_range of the hand of [[linkers]]",
)

_HELIX_EXAMPLE = '{ pitch = "3.57 nm", rotational_friction = "1 pN*nm*s", stall_torque = "11 pN*nm" }'
_HELIX = TableKind(
    "helix",
    (
        Key("pitch", Quantity(units.LENGTH, "any"), REQUIRED, "Length of a turn; left-handed if negative."),
        Key(
            "rotational_friction",
            Quantity(units.ROTATIONAL_FRICTION, "zero"),
            REQUIRED,
            "Torque over angular velocity of the hand, with what is bound to it, about the filament.",
        ),
        Key("stall_torque", Quantity(units.ENERGY), None, "Torque of the filament at which the hand stands still."),
        Key("torque_range", Quantity(units.LENGTH), None, "How far on either side it is from; 100 nm if not given."),
    ),
    "How a hand follows the helix of filaments with twist, see `HandOnHelix`.",
    owner="helix of the hand of [[linkers]]",
)

KEPT = ("all", "bound", "both hands bound")
"""Linkers that a stage keeps, by how many of their hands are bound at least."""
HAND = TableKind(
    "hand",
    (
        *(Key(name, Quantity(unit, least), None, text) for name, (unit, least, text) in _QUANTITIES.items()),
        Key("strain_share", Number("0.5"), None, "Share of a spring's energy that speeds up unbinding, see `Hand`."),
        Key("walks_backward", Flag(), None, "Whether a load above the stall force drives it back."),
        Key("at_end", Choice(AT_ENDS), None, "What a hand does at the end of a filament."),
        Key("binds_to", TypeNames(), None, "Names of filament types; all if not given."),
        Key(
            "filament_end",
            Inline(_AT_END, _AT_END_EXAMPLE),
            None,
            "What it has to do with an end of filaments that grow: formins, caps, depolymerases.",
        ),
        Key("helix", Inline(_HELIX, _HELIX_EXAMPLE), None, "How it follows the helix of filaments with twist."),
        Key("binding_range", Inline(_RANGE, _RANGE_EXAMPLE), None, "Near which end it binds; everywhere if not given."),
    ),
    "A hand, see `Hand`.",
    owner="the hand of [[linkers]]",
)
# Of a segment: the search for hands that bind cuts it into pieces of their reach.
_LEAST_REACH = 1e-3
_HAND_EXAMPLE = '{ binding_rate = "10 1/s", reach = "50 nm", unbinding_rate = "0.3 1/s" }'

_ANCHOR_REGION = TableKind(
    "anchors",
    (
        Key("count", Whole(1, 10**7, "1000"), None, "How many."),
        Key("wall", Whole(1, 1000, "1"), None, "Number of the [[wall]] on which they are, from 1 on."),
        Key("lower", point(), None, "Corner of a box that they are in. For a wall, else that of the periodic box."),
        Key("upper", point(), None, "The opposite corner."),
        Key(
            "body_table",
            Whole(1, 1000, "1"),
            None,
            "In place of count: number of the [[body]] table on whose bodies they are, from 1 on.",
        ),
        Key(
            "body_points",
            Listing(Whole(0, None, "0"), "numbers of points", "[1, 2, 3]"),
            None,
            "Points of each of these bodies that are anchors; one that is named twice has two.",
        ),
    ),
    "Anchors at random places, in a box or on a wall, or points of bodies.",
)
_BOUND_AT = TableKind(
    "bound_at",
    (
        Key("filament", NUMBERS, REQUIRED, "Number of a filament, or a list of them."),
        Key("arc_length", Quantity(units.LENGTH, "zero"), REQUIRED, "Distance from the first node along it."),
        Key("second_filament", NUMBERS, None, "That of the second hand, if it is bound too; of a list, a list."),
        Key("second_arc_length", Quantity(units.LENGTH, "zero"), None, "Where the second hand is."),
    ),
    "Where a hand is bound as a run begins, or both.",
    owner="bound_at of [[linkers]]",
)
_BOUND_AT_EXAMPLE = '[{ filament = 0, arc_length = "1 um" }]'
LINKERS = TableKind(
    "linkers",
    (
        Key("type", Choice(tuple(PRESETS)), None, "A preset, of which any property can be changed by the keys below."),
        Key("name", Text('"motor"'), None, "Name of your own linkers."),
        Key("hand", Inline(HAND, _HAND_EXAMPLE), None, "Properties of two equal hands."),
        Key("hands", Pair(HAND, f"[{_HAND_EXAMPLE}, {{ ... }}]"), None, "In place of hand: two that differ."),
        Key("stiffness", Quantity(units.STIFFNESS), None, "Stiffness of the spring between the hands."),
        Key("rest_length", Quantity(units.LENGTH, "zero"), None, "Rest length of that spring."),
        Key("same_filament", Flag(), None, "Whether both hands may bind to one filament."),
        Key(
            "cosine_range",
            Listing(Number("0.5"), "two cosines", "[0.5, 1.0]", 2),
            None,
            "Between which the cosine of the angle of two filaments is where the second hand binds: [0.5, 1.0] for "
            "parallel ones, [-1.0, -0.5] for antiparallel ones.",
        ),
        Key("trans_activated", Flag(), None, "Whether the second of hands binds only while the first one is bound."),
        Key(
            "reversible",
            Flag(),
            None,
            "Whether hands unbind only where and when they could bind by these two rules; true if not given.",
        ),
        Key(
            "loading_distance",
            Quantity(units.LENGTH),
            None,
            "Both hands bind and unbind at once, the second one so far from the first towards the plus end: loop "
            "extruders.",
        ),
        Key("count", Whole(0, 10**7, "1000"), None, "How many there are."),
        Key(
            "concentration",
            Quantity(units.NUMBER_DENSITY, "zero"),
            None,
            "In place of count: concentration of unbound linkers.",
        ),
        Key(
            "volume",
            Quantity(units.VOLUME),
            None,
            "Volume in which unbound linkers are; what the wall and the box leave if not given.",
        ),
        Key(
            "diffusion",
            Quantity(units.DIFFUSION, "zero"),
            None,
            "Diffusion coefficient of unbound linkers, which have positions then: within walls and the box.",
        ),
        Key(
            "inside",
            Inline(REGION, REGION_EXAMPLE),
            None,
            "A region in which unbound linkers diffuse; what walls and the box leave if not given.",
        ),
        Key("planar", Flag(), False, "Whether unbound linkers that diffuse stay in the plane z = 0."),
        Key("anchors", _Anchors(), None, "Points to which they are tied, one each, in place of their first hands."),
        Key("bound", Whole(0, 10**7, "100"), 0, "How many begin with one hand bound, at random or near anchors."),
        Key(
            "bound_at",
            Listing(Inline(_BOUND_AT), "places on filaments", _BOUND_AT_EXAMPLE),
            None,
            "In place of bound: where they are, one linker each; those with anchors are tied to the first of these.",
        ),
        Key(
            "keep",
            Choice(KEPT),
            "all",
            "In a `[[stage]]`: which of those that are there stay as it begins. Others go, and come by count alone.",
        ),
    ),
    "Crosslinkers or motors that bind to filaments, walk along them and unbind; the page on linkers has their laws.",
    repeated=True,
)


_BEFORE_ANCHORS, _BEHIND_ANCHORS = ("count", "concentration", "volume"), ("bound", "diffusion", "planar")


@dataclass(frozen=True)
class LinkerGroup:
    """One [[linkers]] table; lengths in nm, anchors as points or as numbers of particles.

    ``body_anchors`` are the number of a [[body]] table, and points of its bodies: then ``anchors`` are as many zeros.
    """

    kind: Crosslinker
    count: int | None
    concentration: float | None
    volume: float | None
    anchors: tuple | None
    bound: int
    diffusion: float | None
    planar: bool
    region: tuple | None
    keep: str = "all"
    body_anchors: tuple | None = None
    bound_at: tuple | None = None


def read_linkers(entries, groups, box, seed, walls=(), bodies=()):
    """The LinkerGroup of a [[linkers]] table, for FilamentGroups; the seed is that of anchors at random places."""
    on_bodies = _body_anchors(entries["anchors"], bodies)
    if on_bodies is None:
        anchors = _anchor_points(entries, sum(own.count * own.nodes for own in groups), seed, box, walls)
    else:
        table, points = on_bodies
        anchors = (0,) * (bodies[table - 1].count * len(points))
    first, last = (tuple(entries[name] for name in names) for names in (_BEFORE_ANCHORS, _BEHIND_ANCHORS))
    region = None if entries["inside"] is None else Region(entries["inside"]).walls
    places = None
    if entries["bound_at"] is not None:
        entries.refuse(("bound",), "cannot be with bound_at, which says how many.")
        places = tuple(place for own in entries["bound_at"] for place in _first_places(own))
        last = (len(places), *last[1:])
    group = LinkerGroup(_kind(entries), *first, anchors, *last, region, entries["keep"], on_bodies, places)
    with entries.naming():
        as_linkers(group.kind, *first, group.anchors, group.bound, 0, group.diffusion, group.planar, region)
    if group.diffusion is not None:
        # They are on both sides of what holds filaments on its surface.
        around = [wall for wall in walls if wall.side != "surface"]
        if region is None and not all(wall.encloses_all for wall in around):
            raise entries.error(
                "linkers that diffuse need a region where walls hold some filaments, or keep them outside: "
                f"inside = {REGION_EXAMPLE}."
            )
        if region is None and not is_closed([wall.shape.region for wall in around], box is not None):
            raise entries.error(
                f"linkers that diffuse need a region: inside = {REGION_EXAMPLE}, a [[wall]] that is closed (a sphere, "
                f"a capsule, a torus, an ellipsoid or a box), or a periodic [box] with edges = {EDGES.example}, in "
                "which there may be a slit or a cylinder."
            )
    elif group.count is not None and group.volume is None and (box is None or walls):
        group = dataclasses.replace(group, volume=_volume(entries, walls, box))
    names = sorted({own.type.name for own in groups})
    for hand in group.kind.hands:
        if box is not None and hand.reach >= 0.5 * min(box):
            raise entries.error(
                f"The reach of a hand, {hand.reach:g} nm, must be less than half of the shortest edge of "
                f"the box, {min(box):g} nm."
            )
        longest = max((own.type.segment_length for own in groups if hand.binds(own.type)), default=0.0)
        if hand.reach < _LEAST_REACH * longest:
            raise entries.error(
                f"The reach of a hand, {hand.reach:g} nm, must be at least a thousandth of a segment, "
                f"{_LEAST_REACH * longest:g} nm."
            )
        if not any(hand.binds(own.type) for own in groups):
            raise entries.error(
                f"A hand binds to filaments of the type {' or '.join(hand.binds_to)}, but those of the "
                f'configuration are {", ".join(names)}: change it, as in hand = {{ binds_to = "{names[0]}" }}.'
            )
        if hand.filament_end is not None:
            bound = [own.growth for own in groups if own.growth is not None and hand.binds(own.type)]
            with entries.naming():
                hand.filament_end.find_changes(bound)
        if hand.severing_rate > 0.0:
            _check_severing(entries, hand, groups)
    return group


def _check_severing(entries, hand, groups):
    cut = [own for own in groups if own.growth is not None and hand.binds(own.type)]
    if not cut:
        raise entries.error(
            "A hand cuts filaments, but binds to none that grow: give them growth, in which both ends may be capped "
            'if severing_rate = "0 1/(um*s)" is there.'
        )
    for group in cut:
        if not has_places(group, groups):
            raise entries.error(
                f"A hand cuts filaments ({group.label}), and there are no places for their parts: add to their table a "
                "line such as reserve = 100"
            )


def _volume(entries, walls, box):
    volume = volume_of_walls(walls, box)
    if volume is None:
        fits = "" if box is None else " that is no larger than the periodic one"
        reason = (
            f"which what there is of [[wall]] and [box] does not say: add a [[wall]] that is closed (a sphere, "
            f"a capsule, a torus, an ellipsoid or a box{fits}), or"
            if any(wall.held_types is None for wall in walls)
            else f"which nothing says: add a periodic [box] with edges = {EDGES.example}, or"
        )
        raise entries.error(
            f'Linkers that are not bound are in a volume, {reason} to this table a line such as volume = "1 um^3".'
        )
    return volume


def binds_to(group, linkers):
    """Whether linkers bind to the filaments of a FilamentGroup."""
    return any(hand.binds(group.type) for own in linkers for hand in own.kind.hands)


_KIND_KEYS = (
    *("stiffness", "rest_length", "same_filament", "name"),
    *("cosine_range", "trans_activated", "reversible", "loading_distance"),
)


def _first_places(entries):
    first = [(number, entries["arc_length"]) for number in np.atleast_1d(entries["filament"]).tolist()]
    if entries["second_filament"] is None:
        entries.refuse(("second_arc_length",), "needs a second_filament.")
        return first
    entries.require("second_arc_length")
    second = [(number, entries["second_arc_length"]) for number in np.atleast_1d(entries["second_filament"]).tolist()]
    if len(first) != len(second):
        raise entries.error(f"filament has {len(first)} numbers, and second_filament {len(second)}.")
    return list(zip(first, second))


def _kind(entries):
    preset = PRESETS[entries["type"]] if "type" in entries else None
    properties = entries.given(*_KIND_KEYS)
    with entries.naming():
        hands = _hands(entries, preset)
        if hands is not None:
            properties["hands"] = hands
        if preset is not None:
            return dataclasses.replace(preset, **properties)
        entries.require("stiffness")
        return Crosslinker(**properties)


def _hands(entries, preset):
    if "hand" in entries and "hands" in entries:
        raise entries.error("give hand, for two equal ones, or hands, not both.")
    if "hands" in entries:
        first = (None, None) if preset is None else preset.hands
        return tuple(_hand(own, changed) for own, changed in zip(entries["hands"], first))
    if "hand" in entries:
        own = entries["hand"]
        return _hand(own, None) if preset is None else tuple(_hand(own, changed) for changed in preset.hands)
    if preset is None:
        raise entries.error(
            f"lacks the key 'type': name a preset ({', '.join(PRESETS)}), or describe the linker with stiffness, "
            f"rest_length and hand = {_HAND_EXAMPLE}"
        )
    return None


def _hand(entries, changed):
    properties = entries.given(*HAND.names)
    if changed is None:
        entries.require("binding_rate", "reach", "unbinding_rate")
    if "filament_end" in properties:
        at_end = properties["filament_end"]
        with at_end.naming():
            properties["filament_end"] = HandAtEnd(**at_end.given(*_AT_END.names))
    if "binding_range" in properties:
        own = properties["binding_range"]
        with own.naming():
            properties["binding_range"] = BindingRange(**own.given(*_RANGE.names))
    if "helix" in properties:
        own = properties["helix"]
        with own.naming():
            properties["helix"] = HandOnHelix(**own.given(*_HELIX.names))
    if properties.get("speed") == 0.0:
        # One that stands still, as in a stage with a drug, keeps what it has for when it walks.
        properties.update(stall_force=None, walks_backward=False)
    with entries.naming():
        try:
            return Hand(**properties) if changed is None else dataclasses.replace(changed, **properties)
        except InputError as error:
            # Hands begin their messages with their own name.
            raise InputError(f"{entries.label}: {str(error).removeprefix('Hand: ')}") from None


def _anchor_points(entries, nodes, seed, box, walls):
    anchors = entries["anchors"]
    if anchors is None:
        return None
    if isinstance(anchors, Entries):
        return tuple(map(tuple, _random_anchors(anchors, [seed, *entries.place.path[1:]], box, walls).tolist()))
    if isinstance(anchors[0], int) and not 0 <= min(anchors) <= max(anchors) < nodes:
        raise entries.at("anchors").error(
            f"must be numbers of nodes between 0 and {nodes - 1}, but are {list(anchors)}."
        )
    return anchors


def _body_anchors(entries, bodies):
    # Of a table, the number of a [[body]] table and points; None if it has none.
    if not isinstance(entries, Entries) or entries["body_table"] is None:
        if isinstance(entries, Entries):
            entries.refuse(("body_points",), "belongs to a body_table.")
            entries.require("count")
        return None
    entries.refuse(("count", "wall", "lower", "upper"), "cannot be with a body_table.")
    table, points = entries["body_table"], entries["body_points"] or (0,)
    if table > len(bodies):
        raise entries.at("body_table").error(f"is {table}, but there are {len(bodies)} [[body]] tables.")
    there = len(bodies[table - 1].body.points)
    if max(points) >= there:
        raise entries.at("body_points").error(f"{max(points)} does not exist; there are {there}, from 0 on.")
    return table, points


def _random_anchors(entries, seed, box, walls):
    """In a box, or on what it holds of a wall."""
    wall, lower, upper = (entries[name] for name in ("wall", "lower", "upper"))
    if box is not None and wall is not None:
        lower, upper = (0.0, 0.0, 0.0) if lower is None else lower, box if upper is None else upper
    if wall is None:
        entries.require("lower", "upper")
    elif wall - 1 not in (numbered := {own.number: own for own in walls}):
        raise entries.at("wall").error(f"is {wall}, but there are {len(numbered)} [[wall]] tables.")
    elif numbered[wall - 1].first_face:
        raise entries.at("wall").error(f"is {wall}, a prism: give their places.")
    if lower is not None and upper is not None and np.any(np.array(lower) > np.array(upper)):
        raise entries.at("upper").error("must not be below lower.")
    if wall is None:
        return np.random.default_rng(seed).uniform(lower, upper, (entries["count"], 3))
    try:
        return random_points_on(numbered[wall - 1].shape, entries["count"], seed, lower, upper)
    except InputError as error:
        raise entries.error(f"at random places: {error}") from None
