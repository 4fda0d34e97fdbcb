"""Hands of Cytosim as hands of [[linkers]]: ``doc/sim/objects.md`` and ``src/sim/hands``."""

import math

from .document import EXACT, LEFT_OUT, NEAREST, Note, number_in, quantity
from .growth import binding_key, monomer_of
from .settings import OFF

_PLAIN, _MOTORS, _ON_SITES = ("bind", "none", ""), ("move", "motor"), ("walk", "digit")
_NEAR_ENDS = "hands near ends"
_ENDS = {"plus_end": "plus", "minus_end": "minus"}
_RANGES = {**_ENDS, "both_ends": "both"}
_AT_END = "8 nm"
"""How near to an end a motor counts as there."""
_LEAST_REACH = 0.001


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
        """Whether it never unbinds, walks or follows an end: what it joins is joined forever."""
        moves = {"speed", "filament_end", "severing_rate"} & set(self.table)
        return self.table["unbinding_rate"].startswith("0 ") and not moves

    @property
    def reach(self):
        """In um."""
        return number_in(self.table["reach"])


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
    _read_activity(translation, hand, settings)
    _read_ends(translation, hand, settings)
    _read_keys(translation, hand, settings)
    return hand


def _read_activity(translation, hand, settings):
    activity = settings.text("activity", default="bind")
    if activity in (*_PLAIN, "track"):
        return
    if activity == "cut":
        _read_cutting(hand, settings)
        return
    if activity == "slide":
        _read_sliding(translation, hand, settings)
        return
    if activity == "chew":
        _read_chewing(translation, hand, settings)
        return
    if activity not in (*_MOTORS, *_ON_SITES):
        # What else it has is of that activity.
        settings.take_rest()
        hand.note(LEFT_OUT, f"activity = {activity}", settings.line_of("activity"), f"hands: {activity}")
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


def _read_sliding(translation, hand, settings):
    mobility, line = settings.number("mobility", default=0.0), settings.line_of("mobility")
    diffusion, energy = settings.number("diffusion", default=0.0), translation.thermal_energy
    # Of their implicit steps.
    settings.values("stiffness")
    if mobility <= 0.0:
        hand.note(EXACT if diffusion == 0.0 else LEFT_OUT, "it has no mobility", line, "hands that diffuse alone")
        return
    hand.set("sliding_friction", 1.0 / mobility, "pN*s/um")
    hand.note(EXACT, f"mobility = {mobility:g}", line)
    if diffusion > 0.0 and not math.isclose(diffusion, mobility * energy, rel_tol=0.02):
        hand.note(NEAREST, f"a diffusion of kT mobility, for {diffusion:g}", settings.line_of("diffusion"))
    holds = [settings.number(("hold_growing_end", end), default=0.0) for end in (0, 1)]
    hand.table["at_end"] = "hold" if any(holds) else "release"
    if any(holds) and holds != [1.0, 1.0]:
        hand.note(NEAREST, "it stays at both ends", settings.line_of("hold_growing_end"))


def _read_chewing(translation, hand, settings):
    speed, line = settings.number("chewing_speed", "chewing_rate", default=0.0), settings.line_of("activity")
    diffusion = settings.number("diffusion", "line_diffusion", default=0.0)
    fibers = _growing_fibers(translation, settings)
    if not fibers or not 0.0 < diffusion < math.inf or settings.number("hold_growing_end", default=0.0) < 1.0:
        settings.values("hold_shrinking_end")
        text = "activity = chew, of fibers that do not grow, or without diffusion or hold_growing_end = 1"
        hand.note(LEFT_OUT, text, line, "hands: chew")
        return
    hand.set("sliding_friction", translation.thermal_energy / diffusion, "pN*s/um")
    at_end = {"end": "both", "range": _AT_END, "tracks": True}
    most = min(fiber.settings.number("max_chewing_speed", default=0.0) for fiber in fibers)
    if speed > 0.0 and most > 0.0:
        monomer = monomer_of(fibers[0].settings)
        at_end["off_rate"] = quantity(min(speed, most) / monomer, "1/s")
        at_end["sites"] = max(1, round(most / speed))
        hand.note(NEAREST, f"chewing_speed = {speed:g}, of at most {at_end['sites']} hands at an end", line)
    else:
        hand.note(EXACT, "it takes nothing off: max_chewing_speed of fibers, or chewing_speed, is zero", line)
    hand.table["filament_end"] = at_end


def _read_cutting(hand, settings):
    rate = settings.number("cutting_rate", default=0.0)
    settings.values("new_end_state")
    if rate > 0.0:
        hand.set("severing_rate", rate, "1/s")
        hand.note(NEAREST, "it cuts, and stays on one of both parts; in Cytosim it lets go", settings.line)


def _read_ends(translation, hand, settings):
    tracks = settings.text("activity") == "track"
    end = settings.text("bind_only_end", "bind_end", default="off")
    tracked = settings.text("track_end", default="off") if tracks else "off"
    if settings.text("bind_also_end", "bind_also_ends") not in OFF:
        hand.note(EXACT, "it binds at ends as well, as all of ours do", settings.line_of("bind_also_end"))
    if end not in OFF or tracked not in OFF:
        _bind_near(translation, hand, settings, end, tracked)
    forward = not hand.table.get("speed", "0").startswith("-")
    holds = settings.number(("hold_growing_end", 0 if forward else 1), "hold_growing_ends", default=0.0)
    if "speed" in hand.table and holds > 0.0:
        hand.table["at_end"] = "hold"
        if holds < 1.0:
            _hold_at_times(translation, hand, settings, holds)
    _hold_shrinking(translation, hand, settings, forward)


def _bind_near(translation, hand, settings, end, tracked):
    reach = settings.number("bind_end_range", ("bind_only_end", 1), ("bind_end", 1), default=0.0)
    line = settings.line_of("bind_only_end")
    alone = settings.flag("bind_only_free_end", default=False)
    if end in _RANGES and tracked in OFF and not alone and "sliding_friction" not in hand.table:
        near = {"end": _RANGES[end], "range": quantity(max(reach, _LEAST_REACH), "um")}
        hand.table["binding_range"] = near
        hand.note(EXACT if reach >= _LEAST_REACH else NEAREST, "bind_only_end", line)
        return
    if alone or end not in _ENDS or tracked != end or not _growing_fibers(translation, settings):
        key, value = ("track_end", tracked) if end in OFF else ("bind_only_end", end)
        hand.note(LEFT_OUT, f"{key} = {value}", settings.line_of(key), _NEAR_ENDS)
        return
    hand.table["filament_end"] = {
        "end": _ENDS[end],
        "range": quantity(max(reach, _LEAST_REACH), "um"),
        "binds_there": True,
        "tracks": True,
    }
    hand.note(EXACT, "bind_only_end; it is at the end itself as soon as it binds, where that is within its reach", line)


def _growing_fibers(translation, settings):
    # Those that it binds to whose ends come and go.
    own = binding_key(settings.number("binding_key", ("binding", 2)))
    names = {made.name for made in translation.made if made.grows} | set(translation.nucleated)
    fibers = [translation.script.properties[name] for name in sorted(names)]
    return [fiber for fiber in fibers if own & binding_key(fiber.settings.number("binding_key"))]


def _hold_at_times(translation, hand, settings, holds):
    # Cytosim draws for it once in each step of a motor, or of time.
    attempts = 1.0 / translation.script.time_step
    if "site_spacing" in hand.table:
        attempts = abs(number_in(hand.table["speed"])) / number_in(hand.table["site_spacing"])
    text = f"a chance of {holds:g} to stay at an end"
    if attempts * (1.0 - holds) <= number_in(hand.table["unbinding_rate"]):
        hand.note(
            NEAREST, f"{text}, from which it unbinds more often than at its rate: at its rate here", settings.line
        )
    else:
        hand.note(LEFT_OUT, f"{text}: it stays", settings.line, _NEAR_ENDS)


def _hold_shrinking(translation, hand, settings, forward):
    chances = [settings.number(("hold_shrinking_end", own), default=0.0) for own in (0, 1)]
    if not any(chances) or not _growing_fibers(translation, settings) or "filament_end" in hand.table:
        return
    line, walked_to = settings.line_of("hold_shrinking_end"), 0 if forward else 1
    if not {"speed", "sliding_friction"} & set(hand.table) and set(chances) <= {0.0, 1.0}:
        hand.table["at_end"] = "hold"
        hand.note(NEAREST, "hold_shrinking_end: it stays at either end that shrinks to where it is", line)
    elif chances[walked_to] == 1.0 and chances[1 - walked_to] == 0.0 and hand.table.get("at_end") == "hold":
        end = ("plus", "minus")[walked_to]
        hand.table["filament_end"] = {"end": end, "range": _AT_END, "tracks": True}
        hand.note(NEAREST, "hold_shrinking_end: it stays at the end that it has walked to", line)
    else:
        hand.note(LEFT_OUT, "hold_shrinking_end", line, _NEAR_ENDS)


def _read_keys(translation, hand, settings):
    own = binding_key(settings.number("binding_key", ("binding", 2)))
    matching, every = [], True
    for fiber in translation.fibers_made():
        if own & binding_key(fiber.settings.number("binding_key")):
            matching.append(translation.type_name(fiber.name))
        else:
            every = False
    hand.types = matching
    if matching and not every:
        hand.table["binds_to"] = matching
        hand.note(EXACT, "binding_key", settings.line_of("binding_key"))
