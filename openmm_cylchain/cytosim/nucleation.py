"""Events that create fibers at a rate, as [[nucleation]]."""

import math

from .directions import fixed_direction
from .document import EXACT, NEAREST, Note, quantity
from .filaments import add_growth, add_type, first_length, segment_of, shared_growth
from .grammar import read_commands
from .places import region_of
from .settings import Settings

_EVENTS = "events during a run"
_WITHOUT_EFFECT = ("report", "write", "export", "save", "mark")
_MOST_PLACES = 500
_SPHERE_OR_BOX = ("sphere", "box")


def add_event(translation, new):
    """Add the event of a New: fibers that begin, or a note of what is left out."""
    options = new.settings
    block = options.block("code")
    commands = [] if block is None else read_commands(block.text, block.line)
    rate = _rate(options)
    effective = [own for own in commands if own.verb not in _WITHOUT_EFFECT and "display" not in own.words]
    for command in effective:
        if rate is None or not _begins(translation, new, command, rate):
            words = " ".join((command.verb, *command.words))
            translation.left_out(f"event: {words}", new.line, _EVENTS)


def _rate(options):
    # In 1/s, and a Note; None if it happens at given times.
    for key in ("code", "activity", "recurrent", "rate", "delay", "time"):
        options.values(key)
    rate, delay = options.number("rate"), options.number("delay")
    if rate is not None and rate > 0.0:
        return rate, Note(EXACT, f"rate = {rate:g}", options.line_of("rate"))
    if delay is not None and delay > 0.0:
        return 1.0 / delay, Note(NEAREST, f"at random, and not every {delay:g} s", options.line_of("delay"))
    return None


def _begins(translation, new, command, rate):
    # Whether a command of an event is a [[nucleation]], which is written then.
    words = [word for word in command.words if word != "fiber"]
    fiber = translation.script.properties.get(words[-1]) if words else None
    if command.verb != "new" or fiber is None or fiber.kind != "fiber" or len(words) > 1:
        return False
    options = Settings.of(f"new {fiber.name}", command.line, command.block)
    growing = shared_growth(translation, fiber, options)
    space = translation.space(options.text(("position", 1)))
    draw = translation.draw_in(space, command.line)
    text = options.text("position")
    everywhere = text is None and space is not None and space.shape == "periodic"
    region = None if everywhere else region_of(text, draw)
    if growing is None or translation.dimensions == 2:
        return False
    if not everywhere and (region is None or region["shape"] not in _SPHERE_OR_BOX):
        return False
    frequency, note = rate
    length = first_length(fiber, options)
    segment, _ = segment_of(fiber, length, growing)
    table = translation.document.table("[[nucleation]]", new.line)
    places = min(_MOST_PLACES, math.ceil(1.2 * frequency * translation.duration) + 5)
    table.add("count", places, Note(NEAREST, "places: so many can be there at once"))
    table.add("total_rate", quantity(frequency, "1/s"), note)
    if region is not None:
        table.add("inside", region, Note(NEAREST, "where the first node is; in Cytosim, the middle"))
    direction = options.text("direction", "orientation")
    fixed = fixed_direction(direction) if direction else None
    if fixed is not None and not fixed[1]:
        table.add("direction", [float(own) for own in fixed[0]], Note(EXACT, "", options.line_of("direction")))
    elif direction not in (None, "random"):
        translation.left_out(
            f"direction = {direction}", options.line_of("direction"), f"directions: {direction.split()[0]}"
        )
    add_type(translation, table, fiber, segment, length)
    table.add(
        "length",
        quantity(max(2, round(length / growing.monomer)) * growing.monomer, "um"),
        Note(EXACT, "", command.line),
    )
    add_growth(translation, "nucleation", table, fiber, length, growing)
    for key in ("reference", "placement", "plus_end", "minus_end", "end_state"):
        options.values(key)
    translation.note_unused(options, "new fiber")
    translation.nucleated.append(fiber.name)
    return True
