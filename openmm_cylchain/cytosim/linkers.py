"""Singles and couples as [[linkers]], and as [[link]] where they join for ever what they are attached to."""

import math
from dataclasses import dataclass, field

import numpy as np

from .attached import GROWING, PLACED, place_along
from .bodies import attach_to_bodies, point_of_base
from .document import EXACT, LEFT_OUT, NEAREST, Note, point, quantity
from .hands import read_hand
from .nucleation import add_diffusing_nucleators, add_nucleators
from .places import draw_inside, unknown_position
from .script import count_of
from .settings import OFF

_PAIRS = "rules for pairs of hands"
_MOST_ANCHORS = 50_000
_HALF_OF_NO_SPACE = 5.0
_NEAR, _SOON = "10 nm", "1e+04 1/s"
"""Within what, and how soon, a nucleator holds what it has made."""
_RANGE_AND_LAW = (
    "k_on/(2 reach) exp(-U/kT) for each length within reach of a hand that is tied, which has an equilibrium; in "
    "Cytosim it is k_on wherever a fiber is within reach, however strained"
)
_COSINES = {
    "parallel": [0.5, 1.0],
    "not_parallel": [-1.0, 0.5],
    "antiparallel": [-1.0, -0.5],
    "not_antiparallel": [-0.5, 1.0],
    "orthogonal": [-0.7071, 0.7071],
}
_COUPLES = {
    "fork": "links that hold an angle (fork)",
    "duo": "linkers that are active in places (duo)",
}


@dataclass
class Linked:
    """What is created of one single or couple: how many, how many of them bound, points of anchors, and places.

    ``places`` are the places on filaments of those whose first hands begin there, or both.
    """

    count: int = 0
    bound: int = 0
    points: list = field(default_factory=list)
    places: list = field(default_factory=list)
    nucleators: list = field(default_factory=list)

    @property
    def held(self):
        """How many begin at places."""
        return sum(len(own["filament"]) for own in self.places)

    def hold(self, site, count, second=None):
        """A count of them begin at a site, unless it is None, with the second hands at another one."""
        if site is None:
            return
        place = {**site["at"], "filament": [site["made"].number] * count}
        if second is not None:
            place["second_filament"] = [second["made"].number] * count
            place["second_arc_length"] = second["at"]["arc_length"]
        self.places.append(place)


def add_linkers(translation, news):
    """Add singles and couples: one [[linkers]] table for each property.

    ``news`` are Newly created objects, with how many filaments and tables of bodies were there before them.
    """
    kinds = {
        name: Linked(sum(len(own["filament"]) for own in places), 0, [], places)
        for name, places in translation.attached.items()
    }
    for new, *translation.there in news:
        own = translation.script.named(new.name, new.kind, new.line)
        linked = kinds.setdefault(new.name, Linked())
        adder = _couples if own.kind == "couple" else _singles
        adder(translation, own, new, linked)
    translation.there = None
    on_bodies = [own for bodies in translation.bodies for own in bodies.singles]
    for name in dict.fromkeys([*kinds, *on_bodies]):
        own, linked = translation.script.properties[name], kinds.get(name, Linked())
        for bodies in translation.bodies:
            if bodies.singles.get(name):
                _table_on_bodies(translation, own, bodies, bodies.singles[name])
        if linked.nucleators:
            _table_of_nucleators(translation, own, linked)
        if linked.points or linked.count:
            (_couple_table if own.kind == "couple" else _single_table)(translation, own, linked)
        elif name not in on_bodies and not linked.nucleators:
            own.settings.take_rest()


def _hands_of(translation, own):
    keys = ("hand1", "hand2") if own.kind == "couple" else ("hand",)
    names = [own.settings.text(key) for key in keys]
    if None in names:
        raise own.settings.mistake(keys[names.index(None)], "must be given.")
    return [read_hand(translation, name, own.settings.line) for name in names]


def _couples(translation, own, new, linked):
    count = count_of(new, translation.space())
    options = new.settings
    for key in ("position", "orientation", "direction", "placement", "range"):
        options.values(key)
    keys = [key for key in ("attach1", "site1", "attach2", "site2") if key in options]
    if len(keys) < 2:
        for key in keys:
            site = _site(translation, options, key)
            if site is None:
                linked.bound += count
            elif key in ("attach1", "site1"):
                linked.hold(site, count)
            else:
                translation.left_out(f"{key} of {new.name}", options.line_of(key), PLACED)
        linked.count += count
        return
    hands = _hands_of(translation, own)
    places = [_site(translation, options, key) for key in keys]
    if None in places or own.settings.text("activity") in _COUPLES:
        translation.left_out(f"where {count} {new.name} are attached", new.line, PLACED)
        linked.count += count
        linked.bound += count
    elif not all(hand.stays for hand in hands) or any(place["made"].grows for place in places):
        linked.count += count
        second = places[1]
        if places[0]["made"].number == second["made"].number or any("site_spacing" in hand.table for hand in hands):
            translation.left_out(f"where second hands of {count} {new.name} are", new.line, PLACED)
            second = None
        linked.hold(places[0], count, second)
    else:
        for _ in range(count):
            _link(translation, own, new, *map(_joined, places))


def _site(translation, options, key):
    # A place on a filament, or None.
    made = translation.find_filament(options.text(key))
    if made is None:
        return None
    along = place_along(options, key, made.length)
    if along is None:
        return None
    along = min(max(along, 0.0), made.length)
    return {"at": {"filament": made.number, "arc_length": quantity(along, "um")}, "made": made, "along": along}


def _joined(site):
    # A site as a place of a [[link]].
    node = {0.0: 0, site["made"].length: -1}.get(site["along"])
    return site["at"] if node is None else {"filament": site["made"].number, "node": node}


def _link(translation, own, new, first, second):
    table = translation.document.table("[[link]]", new.line)
    note = Note(EXACT, f"{new.name}, whose hands never unbind", new.line)
    table.add("between", [first, second], note)
    table.add("stiffness", quantity(_stiffness(translation, own), "pN/um"), Note(EXACT, "", own.line))
    table.add("rest_length", quantity(own.settings.number("length", default=0.0), "um"))
    for hand in own.settings.values("hand1") + own.settings.values("hand2") + own.settings.values("hand"):
        read_hand(translation, hand, own.line)
    _read_rest(own.settings)


def _stiffness(translation, own):
    stiffness = own.settings.number("stiffness", default=0.0)
    if stiffness > 0.0:
        return stiffness
    translation.document.note(NEAREST, f"{own.name}: a stiffness of 1e-3 pN/um for {stiffness:g}", own.line)
    return 1e-3


def _read_rest(settings):
    for key in (
        "diffusion",
        "fast_diffusion",
        "min_loop",
        "stiff",
        "activity",
        "confine",
        "confine_spec",
        "specificity",
    ):
        settings.values(key)


def _singles(translation, own, new, linked):
    count = count_of(new, translation.space())
    options, fixed = new.settings, own.settings.text("activity") == "fixed"
    for key in ("position", "orientation", "direction", "placement", "range", "base"):
        options.values(key)
    if "base" in options or "multi_base" in options:
        for key in ("base", "multi_base"):
            options.values(key)
        if "attach" in options:
            _join_body(translation, own, new, count)
        elif not attach_to_bodies(translation, new, count):
            translation.left_out(f"{count} {new.name} on a body", new.line, "bodies: singles on one of several")
        return
    if "attach" in options or "attach1" in options:
        _attached(translation, own, new, linked, count, "attach" if "attach" in options else "attach1")
        return
    hand = _nucleator(translation, own)
    if not fixed:
        if hand is None or not add_diffusing_nucleators(translation, own, new, hand.settings, count):
            linked.count += count
        return
    points = _points(translation, new, count, len(linked.points))
    if hand is not None and add_nucleators(translation, new, hand.settings, points):
        linked.nucleators += points
    else:
        linked.points += points


def _nucleator(translation, own):
    # The Property of its hand if that makes fibers.
    hand = translation.script.properties.get(own.settings.peek("hand"))
    return hand if hand is not None and hand.settings.peek("activity") == "nucleate" else None


def _join_body(translation, own, new, count):
    # A single that joins a point of a body and a filament.
    site, base = _site(translation, new.settings, "attach"), point_of_base(translation, new.settings)
    (hand,) = _hands_of(translation, own)
    if site is None or base is None or not hand.stays:
        translation.left_out(f"where {count} {new.name} are attached", new.line, PLACED)
    elif site["made"].grows:
        translation.left_out(f"{count} {new.name} that join for ever", new.line, GROWING)
    else:
        for _ in range(count):
            _link(translation, own, new, _joined(site), {"body": base[0], "body_point": base[1]})


def _attached(translation, own, new, linked, count, key):
    options = new.settings
    site = _site(translation, options, key)
    (hand,) = _hands_of(translation, own)
    fixed = own.settings.text("activity") == "fixed"
    points = _points(translation, new, count, len(linked.points)) if fixed else []
    if site is None:
        translation.left_out(f"where {count} {new.name} are attached", new.line, PLACED)
    if not fixed:
        linked.count += count
        linked.hold(site, count)
    elif site is None:
        linked.points += points
    elif not hand.stays or site["made"].grows:
        # Those that begin bound come first.
        linked.points[linked.held : linked.held] = points
        linked.hold(site, len(points))
    else:
        for place in points:
            _link(translation, own, new, _joined(site), {"point": point(place)})


def _points(translation, new, count, before):
    if before + count > _MOST_ANCHORS:
        translation.left_out(
            f"{before + count - _MOST_ANCHORS} of {before + count} anchors",
            new.line,
            f"more than {_MOST_ANCHORS} anchors",
        )
        count = _MOST_ANCHORS - before
    options = new.settings
    text = options.text("position", default="inside")
    space = translation.space(options.text(("position", 1)))
    word = unknown_position(text, space)
    if word is not None:
        translation.left_out(f"{count} {new.name} at {text!r}", options.line_of("position"), f"positions: {word}")
        return []
    draw = translation.draw_in(space, new.line)
    keep, places = options.text("placement", default="inside") == "inside", []
    first, last = (options.vector("range", own) for own in (0, 1))
    for number in range(count):
        if first is not None and last is not None:
            places.append(np.array(first) + np.subtract(last, first) * number / max(1, count - 1))
            continue
        place = draw_inside(text, draw, keep)
        if place is None:
            text = f"{count - number} of {count} {new.name}: no place is in the space, and Cytosim makes none either"
            translation.document.note(NEAREST, text, new.line)
            break
        places.append(place)
    return places


def _single_table(translation, own, linked):
    settings = own.settings
    fixed = settings.text("activity") == "fixed"
    (hand,) = _hands_of(translation, own)
    if not _binds(translation, own, [hand]):
        return
    _let_hold(translation, own, linked, [hand])
    table = translation.document.table("[[linkers]]", own.line)
    table.add("name", own.name, Note(EXACT, f"single {own.name}", own.line))
    _add_spring(translation, table, own)
    if fixed:
        table.add("hand", hand.table, Note(NEAREST, _RANGE_AND_LAW))
        table.add("anchors", [point(place) for place in linked.points], Note(EXACT, "activity = fixed"))
        _add_bound(table, own, linked, hand)
        settings.values("diffusion")
    else:
        idle = {"binding_rate": "0 1/s", "reach": hand.table["reach"], "unbinding_rate": "0 1/s"}
        table.add("hands", [hand.table, idle], Note(NEAREST, "a second hand that never binds"))
        _add_count(translation, table, own, linked, hand)
    for note in hand.notes:
        table.comment(note)


def _table_of_nucleators(translation, own, linked):
    # They hold the minus ends of what they make.
    hand = translation.script.properties[own.settings.text("hand")].settings
    table = translation.document.table("[[linkers]]", own.line)
    table.add("name", own.name, Note(EXACT, f"single {own.name}", own.line))
    _add_spring(translation, table, own)
    types = dict.fromkeys([translation.type_name(hand.text(("nucleate", 1)))])
    at_end = {"end": "minus", "range": _NEAR, "binds_there": True, "tracks": True}
    held = {"binding_rate": _SOON, "reach": _NEAR, "unbinding_rate": "0 1/s", "filament_end": at_end}
    note = Note(NEAREST, "it binds at once to the first node of what begins where it is")
    table.add("hand", {**held, "binds_to": list(types)}, note)
    table.add("anchors", [point(place) for place in linked.nucleators], Note(EXACT, "activity = fixed"))
    _read_rest(own.settings)


def _table_on_bodies(translation, own, bodies, points):
    # Singles whose bases are points of bodies.
    if own.kind != "single":
        translation.left_out(f"{own.name} on {bodies.name}", own.line, "bodies: what is attached to them")
        return
    (hand,) = _hands_of(translation, own)
    for key in ("diffusion", "activity"):
        own.settings.values(key)
    if not _binds(translation, own, [hand]):
        return
    table = translation.document.table("[[linkers]]", own.line)
    table.add("name", own.name, Note(EXACT, f"single {own.name}", own.line))
    _add_spring(translation, table, own)
    table.add("hand", hand.table, Note(NEAREST, _RANGE_AND_LAW))
    anchors = {"body_table": bodies.number, "body_points": sorted(points)}
    table.add("anchors", anchors, Note(EXACT, f"on {bodies.name}", bodies.table.line))
    for note in hand.notes:
        table.comment(note)


def _couple_table(translation, own, linked):
    settings = own.settings
    hands = _hands_of(translation, own)
    if not _binds(translation, own, hands):
        return
    _let_hold(translation, own, linked, hands)
    activity = settings.text("activity", default="diffuse")
    if activity in ("slide", "shackle"):
        _let_slide(translation, own, hands[0])
    table = translation.document.table("[[linkers]]", own.line)
    table.add("name", own.name, Note(EXACT, f"couple {own.name}", own.line))
    _add_spring(translation, table, own)
    note = Note(NEAREST, _RANGE_AND_LAW)
    if hands[0].table == hands[1].table:
        table.add("hand", hands[0].table, note)
    else:
        table.add("hands", [hand.table for hand in hands], note)
    loop = settings.number("min_loop", "stiff", default=1.0)
    if loop <= 0.0:
        table.add("same_filament", True, Note(EXACT, "min_loop = 0", settings.line_of("min_loop")))
    else:
        table.comment(Note(NEAREST, f"its hands bind to two filaments; in Cytosim to one as well, {loop:g} um apart"))
    _add_count(translation, table, own, linked, hands[0])
    _add_rules(table, settings)
    if activity in _COUPLES:
        settings.take_rest()
        table.comment(Note(LEFT_OUT, f"activity = {activity}", settings.line_of("activity"), _COUPLES[activity]))
    for note in dict.fromkeys(hands[0].notes + hands[1].notes):
        table.comment(note)


def _let_slide(translation, own, hand):
    # Its first hand is where the second one is nearest, so it takes no load along its fiber.
    line, stiffness = own.settings.line_of("activity"), _stiffness(translation, own)
    others = {"speed", "site_spacing", "binding_range"} & set(hand.table)
    if others:
        hand.note(LEFT_OUT, f"{own.name} slides", line, "hands that slide and walk")
        return
    hand.table["at_end"] = "hold"
    hand.set("sliding_friction", stiffness * translation.script.time_step, "pN*s/um")
    hand.note(
        NEAREST, f"{own.name} slides: with so little friction that a step relaxes its spring; Cytosim's has none", line
    )


def _add_rules(table, settings):
    rule, line = settings.text("specificity"), settings.line_of("specificity")
    ruled = rule in _COSINES
    if ruled:
        table.add("cosine_range", _COSINES[rule], Note(EXACT, f"specificity = {rule}", line))
    elif rule not in OFF:
        table.comment(Note(LEFT_OUT, f"specificity = {rule}", line, _PAIRS))
    if settings.text("trans_activated") not in OFF:
        table.add("trans_activated", True, Note(EXACT, "trans_activated", settings.line_of("trans_activated")))
        ruled = True
    if ruled:
        table.add("reversible", False, Note(EXACT, "hands unbind wherever they are, without detailed balance"))


def _binds(translation, own, hands):
    if all(hand.types for hand in hands):
        return True
    kind = "they have nothing to bind to"
    translation.document.note(EXACT if translation.made else LEFT_OUT, f"{own.name}: {kind}", own.line)
    own.settings.take_rest()
    return False


def _add_spring(translation, table, own):
    table.add("stiffness", quantity(_stiffness(translation, own), "pN/um"), Note(EXACT, ""))
    length = own.settings.number("length", default=0.0)
    if length > 0.0:
        note = Note(NEAREST, "a spring in any direction; Cytosim's is across")
        if own.settings.text("activity") == "bridge":
            note = Note(EXACT, "activity = bridge")
        table.add("rest_length", quantity(length, "um"), note)


def _let_hold(translation, own, linked, hands):
    # Cytosim attaches hands also to fibers to which they do not bind, here those that never bind.
    for place in list(linked.places):
        for hand, key in zip(hands, ("filament", "second_filament")):
            types = {translation.type_name(translation.made[number].name) for number in place.get(key, ())}
            others = sorted(types - set(hand.types))
            if others and not hand.table["binding_rate"].startswith("0 "):
                text = f"{own.name} attached to {', '.join(others)}, to which hand {hand.name} does not bind"
                translation.left_out(text, own.line, PLACED)
                linked.places.remove(place)
                break
            if others:
                hand.types = [*hand.types, *others]
                hand.table["binds_to"] = hand.types
                hand.note(EXACT, f"it is attached to {', '.join(others)}, and never binds", own.line)


def _add_bound(table, own, linked, hand):
    # How many begin with their first hands bound, and where.
    if linked.places:
        if "site_spacing" in hand.table:
            table.comment(Note(LEFT_OUT, "where they begin bound: to sites, at random here", own.line, PLACED))
            table.add("bound", linked.held)
        else:
            table.add("bound_at", linked.places, Note(EXACT, "where hands are attached"))
    elif linked.bound:
        bound = min(linked.bound, linked.count)
        table.add("bound", bound, Note(NEAREST, "attach1: one hand is bound, at random"))


def _add_count(translation, table, own, linked, hand):
    settings = own.settings
    table.add("count", linked.count, Note(EXACT, ""))
    _add_bound(table, own, linked, hand)
    fast = settings.text("diffusion") == "fast" or settings.flag("fast_diffusion")
    if settings.text("confine") in ("on", "surface"):
        table.comment(Note(LEFT_OUT, "confine = on", settings.line_of("confine"), "surfaces: linkers on one"))
    if settings.number(("fast_diffusion", 1), default=0.0) > 0.0:
        table.comment(Note(LEFT_OUT, "a reservoir of a fixed number", settings.line, "linkers: reservoirs"))
    space = translation.space(settings.confining_space())
    if not fast:
        _add_diffusion(translation, table, own, space)
        return
    if space is None or space.volume is None:
        if translation.document.tables_called("[box]"):
            return
        table.add("volume", "1000 um^3", Note(LEFT_OUT, "the volume of the space", own.line, "spaces: volume"))
        return
    # Binding from solution, per length of filament: (2/3) pi R^2 k/V here, pi R^2 k/V there and 2 R k/A in the plane.
    if translation.dimensions == 2:
        volume, why = math.pi * hand.reach * space.volume / 3.0, "pi reach/3 of its area"
    else:
        volume, why = 2.0 / 3.0 * space.volume, "2/3 of it"
    note = Note(EXACT, f"{why}, by which hands bind from solution as often as in Cytosim")
    table.add("volume", quantity(volume, "um^3"), note)


def _add_diffusion(translation, table, own, space):
    settings = own.settings
    rate = settings.number("diffusion", default=0.0)
    text = "a hand binds to each length within reach, and unbinds to anywhere in reach; Cytosim's to where it is"
    table.add("diffusion", quantity(rate, "um^2/s"), Note(NEAREST, text, settings.line_of("diffusion")))
    if translation.dimensions == 2:
        table.add("planar", True, Note(EXACT, "two dimensions: in the plane z = 0"))
    if space is not None and space.region is not None and not space.edges:
        table.add("inside", space.region, Note(EXACT, "its space"))
    elif not translation.document.tables_called("[box]"):
        text, needs, middle, half = "no space that is known", "spaces: volume", np.zeros(3), [_HALF_OF_NO_SPACE] * 3
        if space is not None:
            text, needs, middle = "a box around the space", f"walls: {space.shape}", space.middle
            half = [own or _HALF_OF_NO_SPACE for own in space.half]
        region = {"shape": "box", "lower": point(middle - half), "upper": point(middle + half)}
        table.add("inside", region, Note(LEFT_OUT, text, settings.line_of("diffusion"), needs))
