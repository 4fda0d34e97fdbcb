"""Bundles of fibers as [[filament]] tables, and as [[link]] tables that join them near one of their ends."""

import numpy as np

from ..mechanics.geometry import regular_polygon
from .directions import KEYS as DIRECTIONS
from .directions import draw_direction
from .document import EXACT, NEAREST, Note, quantity
from .filaments import add_filaments
from .places import draw_inside
from .script import New, count_of
from .settings import OFF, Settings
from .simulation import contact_diameter

_MOST_FIBERS = 100
_NEEDS = "bundles of fibers that grow"


def add_bundles(translation, new):
    """Add the bundles of a New: fibers that point in turn to either side, and overlap where links join them."""
    settings = translation.script.named(new.name, "bundle", new.line).settings
    options = new.settings
    count, size = count_of(new, translation.space()), int(options.number("fibers", default=0.0))
    fiber = translation.script.named(options.text(("fibers", 1), default=""), "fiber", new.line)
    if not 1 <= size <= _MOST_FIBERS:
        raise options.mistake("fibers", f"must have from 1 to {_MOST_FIBERS} fibers, as in fibers = 2, actin.")
    if fiber.settings.text("activity", default="none") not in OFF:
        options.take_rest()
        settings.take_rest()
        translation.left_out(f"{count} {new.name}", new.line, _NEEDS)
        return
    overlap, stiffness = (settings.number(key, default=0.0) for key in ("overlap", "stiffness"))
    at_plus = settings.text("focus", "pole", default="minus_end") in ("plus_end", "plus")
    for number in range(count):
        place, direction = _where(translation, options, number, count)
        places = place + _aside(translation, fiber, size, direction)
        own = []
        for index in range(size):
            along = (-1) ** index * direction
            own.append(_add_fiber(translation, fiber, options, index, places[index], along, overlap, at_plus))
        # Neighbours, and the last one with the first one.
        pairs = [(first, first + 1) for first in range(size - 1)] + ([(size - 1, 0)] if size > 1 else [])
        for first, second in pairs:
            opposite = (first - second) % 2 == 1
            apart = float(np.linalg.norm(places[second] - places[first]))
            _link(translation, new, own[first], own[second], opposite, overlap, stiffness, at_plus, apart)


def _aside(translation, fiber, size, direction):
    # Where its fibers are in a bundle across its direction: in one place, or beside each other where they would touch.
    diameter = contact_diameter(translation, fiber)
    if diameter is None or size < 2:
        return np.zeros((size, 3))
    if translation.dimensions == 2:
        return np.outer(diameter * (np.arange(size) - 0.5 * (size - 1)), np.cross([0.0, 0.0, 1.0], direction))
    return regular_polygon(size, diameter, np.zeros(3), direction)


def _where(translation, options, number, count):
    space = translation.space(options.text(("position", 1)))
    draw = translation.draw_in(space, options.line)
    options.values("placement")
    if "range" in options:
        first, last = (np.array(options.vector("range", own, default=(0.0, 0.0, 0.0))) for own in (0, 1))
        place = first + (last - first) * number / max(1, count - 1)
    else:
        place = draw_inside(options.text("position"), draw)
    if place is None:
        place = draw_inside(options.text("position"), draw, False)
        translation.document.note(NEAREST, "places outside of the space are taken", options.line)
    return place, draw_direction(options.text(*DIRECTIONS), place, draw)


def _add_fiber(translation, fiber, options, index, place, direction, overlap, at_plus):
    # Its point at half of the overlap from the end is at the place.
    own = Settings.of(f"fibers of {options.label}", options.line, options.block("fibers", 2))
    length = options.text(("length", index))
    if length is not None:
        own.set("length", [length], options.line)
    long = own.number("length", default=1.0)
    middle = place + (1.0 if at_plus else -1.0) * 0.5 * (overlap - long) * direction
    for key, vector in (("position", middle), ("direction", direction)):
        own.set(key, [" ".join(f"{value:.9g}" for value in vector)], options.line)
    own.set("placement", ["anywhere"], options.line)
    add_filaments(translation, New(1, "fiber", fiber.name, own, options.line))
    translation.note_unused(own, "new fiber")
    return translation.made[-1]


def _link(translation, new, first, second, opposite, overlap, stiffness, at_plus, apart):
    if stiffness <= 0.0:
        return
    places = [(_at(own, 0.0, at_plus), _at(own, overlap, at_plus)) for own in (first, second)]
    between = [(places[0][0], places[1][1]), (places[1][0], places[0][1])]
    if not opposite:
        between = list(zip(*places))
    for pair in between:
        table = translation.document.table("[[link]]", new.line)
        table.add("between", list(pair), Note(EXACT, new.name, new.line))
        table.add("stiffness", quantity(stiffness, "pN/um"))
        note = Note(NEAREST, "where they touch; Cytosim draws them together against it") if apart > 0.0 else None
        table.add("rest_length", quantity(apart, "um"), note)


def _at(made, along, at_plus):
    if along == 0.0:
        return {"filament": made.number, "node": -1 if at_plus else 0}
    along = min(along, made.length)
    return {"filament": made.number, "arc_length": quantity(made.length - along if at_plus else along, "um")}
