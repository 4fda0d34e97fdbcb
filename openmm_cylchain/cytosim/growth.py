"""Growth of fibers: activities grow, treadmill, classic and dynamic as [[monomers]] and growth of [[filament]].

Laws of Cytosim are in ``doc/sim/fiber_dynamics.md`` and ``src/sim/fibers``. An end that grows has there the speed
``growing_speed * free * exp(-load/growing_force) + growing_off_speed``, with the share ``free`` of the polymer that is
in no fiber; here, monomers of the length delta come at the rate k_on c and go at k_off.
"""

import math
from dataclasses import dataclass, field

from .document import EXACT, NEAREST, Note, number_in, quantity

_STATES = {"white": 0, "green": 1, "yellow": 2, "orange": 3, "red": 4, "static": 0}
_STATES |= {"grow": 1, "growing": 1, "shrink": 4, "shrinking": 4}
_STILL, _GROWING, _SHRINKING = 0, 1, 4
_ENDS = ("plus", "minus")
_KEYS = ("growing_speed", "shrinking_speed", "growing_force", "growing_off_speed", "total_polymer", "min_length")
_KEYS += ("max_length", "persistent", "fate", "delete_stub", "rebirth_rate", "catastrophe_rate", "hydrolysis_rate")
_KEYS += ("catastrophe_rate_stalled", "rescue_rate", "unit_length", "catastrophe_length")
_USUAL_MONOMER = 0.008
_REFERENCE = 1.0
"""Concentration in uM at which all of the polymer is free."""
_PER_UM3 = 602.214076
"""Number in 1 um^3 at 1 uM."""
_NO_FORCE = 1e6
"""In pN: a growing_force so large that loads change nothing."""
_NEW_ENDS = "growth: states of new ends"
_AT_ONCE = 10.0
"""In a time step."""
_EVERY_KEY = 2**32 - 1
_MOST_LENGTH, _MANY_CATASTROPHES = 200.0, 20.0


@dataclass
class Growing:
    """How fibers of one property with the same states of their ends grow.

    ``entries`` are (key, value, Note) of the growth table, ``rates`` those of monomers, ``monomer`` is the length of
    one in um, ``speed`` that of an end in um/s, ``turns`` how often it turns in 1/s, and ``length`` that of all fibers.
    """

    name: str
    settings: object
    monomer: float
    rates: list = field(default_factory=list)
    entries: list = field(default_factory=list)
    speed: float = 0.0
    turns: float = 0.0
    length: float = 0.0


def state_of(options, end):
    """Number of the state of the "plus" or "minus" end of fibers that are created."""
    text = options.text(f"{end}_end", f"{end}_end_state", ("end_state", _ENDS.index(end)), default="0")
    if text in _STATES:
        return _STATES[text]
    return int(text) if text in "01234" and len(text) == 1 else _STILL


def read_growth(translation, fiber, options):
    """The Growing of fibers of a Property that are created with options, or None if they do not grow."""
    settings = fiber.settings
    activity = settings.text("activity", default="none")
    cutting = find_cutting(translation.script, fiber)
    states = {end: state_of(options, end) for end in _ENDS}
    # Those of other activities mean nothing in Cytosim either.
    for key in _KEYS:
        settings.values(key)
    if activity in ("none", "fiber", ""):
        return _of_still(translation, fiber, cutting)
    if activity not in _LAWS:
        translation.left_out(
            f"activity = {activity} of {settings.label}", settings.line_of("activity"), "growth: " + activity
        )
        return None
    if all(state == _STILL for state in states.values()):
        if cutting is None:
            text = f"{fiber.name}: both ends are static, so it keeps its length"
            translation.document.note(EXACT, text, options.line)
        return _of_still(translation, fiber, cutting)
    growing = Growing(fiber.name, settings, monomer_of(settings))
    _LAWS[activity](translation, growing, states)
    if not growing.rates and len(growing.entries) > 1 and activity not in ("classic", "dynamic"):
        if cutting is None:
            text = f"{fiber.name}: its speeds are zero, so it keeps its length"
            translation.document.note(EXACT, text, options.line)
        return _of_still(translation, fiber, cutting)
    if cutting is not None:
        _add_cutting(translation, growing, cutting)
    _add_ends(translation, growing)
    return growing


def monomer_of(settings):
    """The length in um of the monomers of fibers that grow, of which these are the Settings."""
    is_dynamic = settings.text("activity", default="none") == "dynamic"
    monomer = settings.number("unit_length", default=_USUAL_MONOMER if is_dynamic else None)
    if monomer is None:
        monomer = _usual_monomer(settings)
    if not 0.0 < monomer < math.inf:
        raise settings.mistake("unit_length" if "unit_length" in settings else "segmentation", "must be positive.")
    return monomer


def _usual_monomer(settings):
    segment = settings.number("segmentation", default=1.0)
    return segment / max(2, round(segment / _USUAL_MONOMER))


def find_cutting(script, fiber):
    """The Settings of the hand, or of the plane, that cuts fibers of a Property of a Script; None if nothing does."""
    own = binding_key(fiber.settings.number("binding_key"))
    for kind in ("single", "couple"):
        for new in (new for new in script.created if new.kind == kind):
            for key in ("hand", "hand1", "hand2"):
                hand = script.properties.get(script.properties[new.name].settings.peek(key))
                if hand is None or hand.settings.peek("activity") != "cut":
                    continue
                if hand.settings.number("cutting_rate", default=0.0) > 0.0 and own & binding_key(
                    hand.settings.number("binding_key", ("binding", 2))
                ):
                    return hand.settings
    return script.cut_fibers.get(fiber.name)


def binding_key(number):
    """The bits of a key, all of them if it is not given."""
    return _EVERY_KEY if number is None or not 0 <= number < 2**63 else int(number)


def _of_still(translation, fiber, cutting):
    # Fibers that do nothing but be cut.
    if cutting is None:
        return None
    growing = still_growth(fiber)
    _add_cutting(translation, growing, cutting)
    return growing


def still_growth(fiber):
    """The Growing of fibers whose ends neither grow nor shrink."""
    growing = Growing(fiber.name, fiber.settings, _usual_monomer(fiber.settings))
    for end in _ENDS:
        _cap(growing, end)
    return growing


def _add_cutting(translation, growing, cutting):
    is_plane = cutting.label == "cut"
    text = "planes alone cut it" if is_plane else "hands alone cut it"
    growing.entries.append(("severing_rate", "0 1/(um*s)", Note(EXACT, text)))
    usual = "red" if is_plane else "white", "white"
    plus, minus = (_STATES.get(cutting.text(("new_end_state", own), default=usual[own]), _STILL) for own in (0, 1))
    line, keys = cutting.line_of("new_end_state"), [key for key, *_ in growing.entries]
    turns = "catastrophe_rate" in keys or "hydrolysis_rate" in keys
    if turns and plus == _SHRINKING:
        growing.entries.append(("severed_ends_shrink", True, Note(EXACT, "new_end_state", line)))
    said = plus == (_STILL if "plus_capped" in keys else _GROWING) or (turns and plus == _SHRINKING)
    if not said or minus != (_STILL if "minus_capped" in keys else _GROWING):
        translation.left_out("new_end_state: new ends are as those of other filaments", line, _NEW_ENDS)


def _rate(growing, end, on, off):
    # Speeds in um/s as rates of monomers.
    growing.speed = max(growing.speed, on)
    for name, speed, unit in (("on", on / _REFERENCE, "1/(uM*s)"), ("off", off, "1/s")):
        if speed > 0.0:
            value = quantity(speed / growing.monomer, unit)
            growing.rates.append((f"{end}_{name}_rate", value, Note(EXACT, f"{speed:g} um/s", growing.settings.line)))


def _speed(growing, key, end):
    return growing.settings.number((key, _ENDS.index(end)), default=0.0)


def _cap(growing, end):
    growing.entries.append((f"{end}_capped", True, Note(EXACT, f"the {end} end is static")))


def _simple(translation, growing, states, end):
    # An end that only grows, or only shrinks.
    if states[end] == _STILL:
        return _cap(growing, end)
    off = _speed(growing, "growing_off_speed", end)
    if states[end] == _GROWING:
        on = _speed(growing, "growing_speed", end) + max(off, 0.0)
        off = max(-off, 0.0)
    else:
        on, off = 0.0, -_speed(growing, "shrinking_speed", end)
    if on <= 0.0 and off <= 0.0:
        return _cap(growing, end)
    return _rate(growing, end, on, off)


def _grow(translation, growing, states):
    for end in _ENDS:
        _simple(translation, growing, states, end)
    growing.entries.append(("deterministic", True, Note(EXACT, "lengths change at constant speeds")))


def _turning(translation, growing, states, key):
    # Ends that grow and shrink in turn, or do one of them.
    for end in _ENDS:
        settings = growing.settings
        turns = _turning_rate(growing, key, end) > 0.0
        rescued = settings.number(("rescue_rate", _ENDS.index(end)), default=0.0) > 0.0
        rescued = rescued or _rebirth(translation, settings, key, end)[0] > 0.0
        grows, shrinks = (states[end] == own for own in (_GROWING, _SHRINKING))
        if end == "minus" and not (grows and turns) and not (shrinks and rescued):
            _simple(translation, growing, states, end)
        elif states[end] == _STILL:
            _cap(growing, end)
        else:
            _turn(translation, growing, states[end], key, end)


def _turn(translation, growing, state, key, end):
    settings, index, prefix = growing.settings, _ENDS.index(end), "minus_" if end == "minus" else ""
    on, off = _speed(growing, "growing_speed", end), -_speed(growing, "growing_off_speed", end)
    shrinking = -settings.number(("shrinking_speed", index), default=0.0)
    shrinking_off = Note(EXACT, f"{shrinking:g} um/s", settings.line_of("shrinking_speed"))
    turning = _turning_rate(growing, key, end)
    rates = {
        key: (quantity(turning, "1/s"), Note(EXACT, "", settings.line_of(key))),
        "rescue_rate": (
            quantity(settings.number(("rescue_rate", index), default=0.0), "1/s"),
            Note(EXACT, "", settings.line_of("rescue_rate")),
        ),
        "shrinking_off_rate": (quantity(shrinking / growing.monomer, "1/s"), shrinking_off),
    }
    rebirth, note = _rebirth(translation, settings, key, end)
    if rebirth > 0.0:
        rates["renucleation_rate"] = quantity(rebirth + number_in(rates["rescue_rate"][0]), "1/s"), note
    _rate(growing, end, on, off)
    growing.turns = max(growing.turns, turning)
    if key == "catastrophe_rate":
        rates |= _load_and_length(growing, end, on)
    if state == _SHRINKING and key == "catastrophe_rate":
        growing.entries.append((f"{end}_states", _from_shrinking(rates), Note(EXACT, "it begins by shrinking")))
        return
    if state == _SHRINKING:
        text = f"{growing.name}: the {end} end begins to shrink, and grows at first here"
        translation.left_out(text, settings.line, "growth: ends that begin by shrinking")
    growing.entries += [(prefix + name, *own) for name, own in rates.items()]


def _has_old_rates(settings):
    # Whether the second catastrophe_rate is that of a stalled plus end, as before 2014.
    return len(settings.values("growing_force")) == 1


def _turning_rate(growing, key, end):
    settings = growing.settings
    if end == "minus" and key == "catastrophe_rate" and _has_old_rates(settings):
        return 0.0
    return settings.number((key, _ENDS.index(end)), default=0.0)


def _from_shrinking(rates):
    # The two states of such an end, the second one first.
    values = {name: value for name, (value, _) in rates.items()}
    growing = {"name": "growing", "switch_rates": {"shrinking": values["catastrophe_rate"]}}
    if "blocked_catastrophe_rate" in values:
        more = number_in(values["blocked_catastrophe_rate"]) - number_in(values["catastrophe_rate"])
        growing["blocked_switch_rates"] = {"shrinking": quantity(more, "1/s")}
    if "catastrophe_length" in values:
        growing["switch_length"] = values["catastrophe_length"]
    shrinking = {"name": "shrinking", "on_rate": "0 1/(uM*s)", "off_rate": values["shrinking_off_rate"]}
    if "renucleation_rate" in values:
        more = number_in(values["renucleation_rate"]) - number_in(values["rescue_rate"])
        shrinking["shortest_switch_rates"] = {"growing": quantity(more, "1/s")}
    return [shrinking | {"switch_rates": {"growing": values["rescue_rate"]}}, growing]


def _load_and_length(growing, end, on):
    # How catastrophes depend on what is in the way of an end, and on the length of its fiber.
    settings, index, own = growing.settings, _ENDS.index(end), {}
    free = _turning_rate(growing, "catastrophe_rate", end)
    stalled = settings.number(("catastrophe_rate_stalled", index), default=0.0)
    if end == "plus" and _has_old_rates(settings):
        stalled = settings.number(("catastrophe_rate", 1), default=0.0) or stalled
    # More catastrophes than monomers that could come have no meaning here.
    most = on / growing.monomer if free > 0.0 else 0.0
    if free < stalled:
        blocked = min(stalled, free + most)
        text = "linear in the share of monomers that come, where Cytosim's 1/rate is"
        if blocked < stalled:
            text += f"; {stalled:g} 1/s there, more than monomers that come"
        note = Note(NEAREST, text, settings.line_of("catastrophe_rate_stalled"))
        if blocked > free:
            own["blocked_catastrophe_rate"] = (quantity(blocked, "1/s"), note)
    length = settings.number("catastrophe_length", default=0.0)
    if end == "plus" and length > 0.0:
        own["catastrophe_length"] = (quantity(length, "um"), Note(EXACT, "", settings.line_of("catastrophe_length")))
    return own


def _classic(translation, growing, states):
    _turning(translation, growing, states, "catastrophe_rate")
    growing.entries.append(("deterministic", True, Note(EXACT, "lengths change at constant speeds")))


def _dynamic(translation, growing, states):
    _turning(translation, growing, states, "hydrolysis_rate")


_LAWS = {"grow": _grow, "treadmill": _grow, "classic": _classic, "dynamic": _dynamic}


def _add_ends(translation, growing):
    settings = growing.settings
    force = settings.number("growing_force", "dynamic_force", default=math.inf)
    if math.isfinite(force) and force > 0.0:
        note = Note(NEAREST, "of Cytosim, which has no equilibrium; delete it for one that has", settings.line)
        growing.entries.append(("growing_force", quantity(force, "pN"), note))
    else:
        note = Note(EXACT, "loads do not slow growth down; delete it for growth with an equilibrium")
        growing.entries.append(("growing_force", quantity(_NO_FORCE, "pN"), note))
    shrinks = any(key.endswith(("off_rate", "_states")) for key, *_ in (*growing.rates, *growing.entries))
    if shrinks and not _is_persistent(settings):
        note = Note(EXACT, "one of the shortest length is deleted (persistent = 0)", settings.line)
        growing.entries.append(("vanishes", True, note))


def _is_persistent(settings):
    # Whether fibers of the shortest length stay.
    stub = settings.number("delete_stub")
    return settings.flag("persistent", default=stub == 0.0 if stub is not None else False)


def _rebirth(translation, settings, key, end):
    # At which an end of a fiber that has shrunk to the shortest length grows again, in 1/s, and its Note.
    line, step = settings.line_of("rebirth_rate"), translation.script.time_step
    rate = settings.number(("rebirth_rate", _ENDS.index(end)), default=0.0)
    has_none = end == "minus" and key == "hydrolysis_rate"
    if rate <= 0.0 or has_none or not _is_persistent(settings):
        return 0.0, None
    if rate * step > _AT_ONCE:
        return _AT_ONCE / step, Note(NEAREST, f"rebirth_rate = {rate:g}, at once", line)
    if key == "hydrolysis_rate":
        return rate, Note(NEAREST, "rebirth_rate, in Cytosim in steps alone in which a unit would come off", line)
    return rate, Note(EXACT, "rebirth_rate", line)


def longest_of(translation, growing, length):
    """The length in um for which fibers have places, and its Note."""
    settings = growing.settings
    given = settings.number("max_length", default=math.inf)
    grown = length + growing.speed * translation.duration
    polymer = settings.number("total_polymer", default=math.inf)
    typical = math.inf
    if growing.turns > 0.0 and settings.number("rescue_rate", default=0.0) == 0.0:
        typical = length + _MANY_CATASTROPHES * growing.speed / growing.turns
    longest = min(given, 1.05 * grown, polymer, typical, max(_MOST_LENGTH, 2.0 * length))
    longest = max(longest, 1.01 * length, length + 2.0 * growing.monomer)
    if longest == given:
        return longest, Note(NEAREST, "max_length, beyond which there may be up to two segments", settings.line)
    return longest, Note(EXACT if longest >= min(grown, polymer) else NEAREST, "for which there are places")


def add_monomers(translation, growings):
    """A [[monomers]] table for each Growing."""
    for growing in growings:
        table = translation.document.table("[[monomers]]", growing.settings.line)
        table.add("name", growing.name)
        table.add("length", quantity(growing.monomer, "um"), Note(EXACT, "of what is added at once"))
        for key, value, note in growing.rates:
            table.add(key, value, note)
        if not growing.rates:
            table.add("plus_on_rate", "1e-9 1/(uM*s)", Note(NEAREST, "next to nothing"))
        total = growing.settings.number("total_polymer", default=math.inf)
        if not math.isfinite(total):
            table.add("concentration", quantity(_REFERENCE, "uM"), Note(EXACT, "which gives the speeds above"))
            continue
        if total <= 0.0:
            raise growing.settings.mistake("total_polymer", "must be positive.")
        free = max(0.0, 1.0 - growing.length / total)
        table.add("concentration", quantity(_REFERENCE * free, "uM"), Note(EXACT, f"{free:.3g} of the polymer is free"))
        volume = total / growing.monomer / (_REFERENCE * _PER_UM3)
        table.add("volume", quantity(volume, "um^3"), Note(EXACT, f"in which total_polymer is {total:g} um"))


def same_growth(one, other):
    """Whether two Growings share their monomers."""
    return one.settings is other.settings and one.rates == other.rates and one.monomer == other.monomer
