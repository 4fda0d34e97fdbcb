"""Hands of Cytosim as hands of [[linkers]]: ``doc/sim/objects.md`` and ``src/sim/hands``."""

import math

from .document import EXACT, LEFT_OUT, NEAREST, Note, quantity
from .settings import OFF

_PLAIN, _MOTORS, _ON_SITES = ("bind", "none", ""), ("move", "motor"), ("walk", "digit")
_NEAR_ENDS = "hands near ends"
_OF_ACTIVITY = {"slide": "hands that slip along filaments", "track": _NEAR_ENDS}
_LEAST_REACH = 0.001
_EVERY_KEY = 2**32 - 1


class HandRead:
    """A hand: its ``table``, the ``notes`` about it, and the names of ``types`` to which it binds."""

    def __init__(self, name):
        self.name, self.table, self.notes, self.types = name, {}, [], []

    def note(self, kind, text, line=None, needs=None):
        """Add a Note."""
        self.notes.append(Note(kind, f"hand {self.name}: {text}", line, needs))

    def set(self, key, value, unit):
        """A key with a quantity."""
        self.table[key] = quantity(value, unit)

    @property
    def stays(self):
        """Whether it never unbinds and never walks: what it joins is joined forever."""
        return self.table["unbinding_rate"].startswith("0 ") and "speed" not in self.table

    @property
    def reach(self):
        """In um."""
        return float(self.table["reach"].split()[0])


def read_hand(translation, name, line):
    """The HandRead of a hand by its name."""
    settings = translation.script.named(name, "hand", line).settings
    hand = HandRead(name)
    hand.set("binding_rate", settings.number("binding_rate", "binding", default=0.0), "1/s")
    reach = settings.number("binding_range", ("binding", 1), default=0.0)
    hand.set("reach", max(reach, _LEAST_REACH), "um")
    if reach < _LEAST_REACH:
        hand.note(NEAREST, f"a reach of {_LEAST_REACH:g} um, for {reach:g} um", settings.line)
    hand.set("unbinding_rate", settings.number("unbinding_rate", "unbinding", default=0.0), "1/s")
    force = settings.number("unbinding_force", ("unbinding", 1), default=math.inf)
    if 0.0 < force < math.inf:
        hand.set("unbinding_force", force, "pN")
    _read_activity(hand, settings)
    _read_ends(translation, hand, settings)
    _read_keys(translation, hand, settings)
    return hand


def _read_activity(hand, settings):
    activity = settings.text("activity", default="bind")
    if activity in _PLAIN:
        return
    if activity not in (*_MOTORS, *_ON_SITES):
        needs = _OF_ACTIVITY.get(activity, f"hands: {activity}")
        # What else it has is of that activity.
        settings.take_rest()
        hand.note(LEFT_OUT, f"activity = {activity}", settings.line_of("activity"), needs)
        return
    speed = settings.number("unloaded_speed", "speed", "max_speed", default=0.0)
    stall = settings.number("stall_force", "force", default=math.inf)
    if activity in _ON_SITES:
        step = settings.number("step_size", default=0.0)
        if step > 0.0:
            hand.set("site_spacing", step, "um")
            hand.note(NEAREST, "sites that hold one hand each, of which steps are drawn by our law", settings.line)
    if speed == 0.0 or activity == "digit":
        return
    hand.set("speed", speed, "um/s")
    if 0.0 < stall < math.inf:
        hand.set("stall_force", stall, "pN")
    if not settings.flag("limit_speed", default=True):
        hand.table["walks_backward"] = True
        hand.note(NEAREST, "it walks backward at most as fast as forward", settings.line_of("limit_speed"))


def _read_ends(translation, hand, settings):
    if settings.text("bind_only_end", "bind_end") not in OFF:
        settings.values("bind_end_range")
        settings.values("bind_only_free_end")
        hand.note(LEFT_OUT, "bind_only_end", settings.line_of("bind_only_end"), _NEAR_ENDS)
    if settings.text("bind_also_end", "bind_also_ends") not in OFF:
        hand.note(EXACT, "it binds at ends as well, as all of ours do", settings.line_of("bind_also_end"))
    forward = not hand.table.get("speed", "0").startswith("-")
    holds = settings.number(("hold_growing_end", 0 if forward else 1), "hold_growing_ends", default=0.0)
    if "speed" in hand.table and holds > 0.0:
        hand.table["at_end"] = "hold"
        if holds < 1.0:
            hand.note(LEFT_OUT, f"a chance of {holds:g} to stay at an end", settings.line, _NEAR_ENDS)
    shrinking = [settings.number(("hold_shrinking_end", own), default=0.0) for own in (0, 1)]
    if any(shrinking) and translation.growings:
        hand.note(LEFT_OUT, "hold_shrinking_end", settings.line_of("hold_shrinking_end"), _NEAR_ENDS)


def _read_keys(translation, hand, settings):
    own = _key(settings.number("binding_key", ("binding", 2)))
    matching, every = [], True
    for fiber in translation.fibers_made():
        if own & _key(fiber.settings.number("binding_key")):
            matching.append(translation.type_name(fiber.name))
        else:
            every = False
    hand.types = matching
    if matching and not every:
        hand.table["binds_to"] = matching
        hand.note(EXACT, "binding_key", settings.line_of("binding_key"))


def _key(number):
    return _EVERY_KEY if number is None or not 0 <= number < 2**63 else int(number)
