"""Events that create fibers at a rate, as [[nucleation]]."""

import math

from .directions import KEYS as DIRECTIONS
from .directions import fixed_direction
from .document import EXACT, NEAREST, Note, quantity
from .filaments import add_growth, add_type, first_length, segment_of, shared_growth
from .grammar import read_commands
from .places import box_around, box_of
from .settings import CONFINED, Settings

_EVENTS = "events during a run"
_WITHOUT_EFFECT = ("report", "write", "export", "save", "mark")
_MOST_PLACES, _MOST_NUCLEATORS = 500, 500


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


def _is_held(fiber, space, translation):
    # Whether walls hold a fiber in a space.
    settings = fiber.settings
    return (
        space is not None
        and bool(space.walls)
        and space.volume is not None
        and settings.text("confine") in CONFINED
        and translation.space(settings.confining_space()) is space
        and settings.number(("confine", 1), "confine_stiffness", default=0.0) > 0.0
    )


def _begins(translation, new, command, rate):
    # Whether a command of an event is a [[nucleation]], which is written then.
    words = [word for word in command.words if word != "fiber"]
    fiber = translation.script.properties.get(words[-1]) if words else None
    if command.verb != "new" or fiber is None or fiber.kind != "fiber" or len(words) > 1:
        return False
    options = Settings.of(f"new {fiber.name}", command.line, command.block)
    return _add_nucleation(translation, new, fiber, options, rate)


def add_nucleators(translation, new, hand, places):
    """Add hands that make fibers at places: whether they could be added.

    Each of them has a [[nucleation]] of its own, of one filament at a time, as it holds one as long as that is there.

    ``places`` are points in um.
    """
    name, unbinding = _made_by(translation, hand)
    if name is None or unbinding > 0.0 or len(places) > _MOST_NUCLEATORS:
        return False
    positions = [[" ".join(f"{own:.9g}" for own in place)] for place in places]
    return _add_nucleators(translation, new, hand, name, positions, 1)


def add_diffusing_nucleators(translation, own, new, hand, count):
    """Add a count of singles whose hands make fibers where they diffuse: whether they could be added.

    One that holds what it has made has a [[nucleation]] of its own, as those at places; those that let go have one of
    all, as often as they begin and let go on average.

    ``own`` is the Property of the singles.
    """
    name, unbinding = _made_by(translation, hand)
    space = translation.space(own.settings.confining_space())
    on_surface = own.settings.text("confine") in ("on", "surface") and space is not None and not space.thin
    if name is None or on_surface or (unbinding == 0.0 and count > _MOST_NUCLEATORS):
        return False
    confining = own.settings.confining_space()
    position = new.settings.values("position") if own.settings.number("diffusion", default=0.0) == 0.0 else []
    position = position or ["inside", *([] if confining is None else [confining])]
    if unbinding == 0.0:
        return _add_nucleators(translation, new, hand, name, [position] * count, 1)
    return _add_nucleators(translation, new, hand, name, [position], None, count, unbinding)


def _made_by(translation, hand):
    # The name of the fiber that a hand makes, or None if it cannot be said here; and the rate at which it lets go.
    name = hand.text(("nucleate", 1), default="")
    fiber = translation.script.properties.get(name)
    unbinding = hand.number("unbinding_rate", "unbinding", default=0.0)
    holds = hand.text("hold_end", "track_end", default="minus_end") == "minus_end"
    rate = hand.number("nucleate", default=0.0)
    if rate <= 0.0 or fiber is None or fiber.kind != "fiber" or not holds or hand.flag("addictive", default=False):
        return None, unbinding
    return name, unbinding


def _add_nucleators(translation, new, hand, name, positions, places, count=1, unbinding=0.0):
    # One [[nucleation]] for each position, of so many hands that let go at a rate.
    rate, line = hand.number("nucleate"), hand.line_of("nucleate")
    fiber, block = translation.script.properties[name], hand.block("nucleate", 2)
    note = Note(EXACT, f"nucleate = {rate:g}, of one {new.name}", line)
    if unbinding > 0.0:
        text = f"of {count} {new.name}, each of which makes one at nucleate = {rate:g} and lets go at {unbinding:g}"
        rate, note = count / (1.0 / rate + 1.0 / unbinding), Note(NEAREST, text, line)
    for position in positions:
        options = Settings.of(f"new {name}", line, block)
        options.set("position", position, new.line)
        if not _add_nucleation(translation, new, fiber, options, (rate, note), places, "minus_end"):
            return False
    for key in ("activity", "binding_rate", "binding", "binding_range", "unbinding_force", "nucleate"):
        hand.values(key)
    return True


def _add_nucleation(translation, new, fiber, options, rate, places=None, reference="center"):
    # Whether it could be added; ``places`` of filaments, or as many as begin; what of a fiber is at its position.
    growing = shared_growth(translation, fiber, options, begins=True)
    space = translation.space(options.text(("position", 1)))
    draw = translation.draw_in(space, options.line)
    text = options.text("position")
    everywhere = text is None and translation.dimensions == 3 and space is not None and space.shape == "periodic"
    region, (frequency, note) = None if everywhere else box_of(text, draw), rate
    if region is None and text in (None, "inside") and _is_held(fiber, space, translation):
        # Walls keep those from beginning that are outside.
        region = box_around(space.middle, space.half)
        share = space.volume / math.prod(2.0 * own for own in space.half if own > 0.0)
        text = f"rate = {frequency:g} in the space, and more around it, where walls let none begin"
        frequency, note = frequency / share, Note(NEAREST, text, note.line)
    if region is None and not everywhere:
        return False
    direction = options.text(*DIRECTIONS)
    fixed = fixed_direction(direction) if direction else None
    signs = [1.0] if fixed is None or not fixed[1] else [1.0, -1.0]
    if fixed is None and direction not in (None, "random"):
        word = direction.split()[0]
        translation.left_out(f"direction = {direction}", options.line_of("direction"), f"directions: {word}")
    length = first_length(fiber, options)
    segment, _ = segment_of(fiber, length, growing)
    for sign in signs:
        table = translation.document.table("[[nucleation]]", new.line)
        share = frequency / len(signs)
        most = min(_MOST_PLACES, math.ceil(1.2 * share * translation.duration) + 5)
        table.add(
            "count", places or most, Note(NEAREST, "places: so many can be there at once") if not places else None
        )
        table.add("total_rate", quantity(share, "1/s"), note)
        if region is not None:
            where = Note(EXACT, "")
            if reference == "center":
                where = Note(NEAREST, "where the first node is; in Cytosim, the middle")
            table.add("inside", region, where)
        if fixed is not None:
            note_of_two = Note(EXACT, "half of them have the opposite direction" if len(signs) > 1 else "")
            table.add("direction", [sign * float(own) for own in fixed[0]], note_of_two)
        if translation.dimensions == 2:
            table.add("planar", True, Note(EXACT, "two dimensions: they stay in the plane z = 0"))
        add_type(translation, table, fiber, segment, length)
        whole = max(2, round(length / growing.monomer)) * growing.monomer
        table.add("length", quantity(whole, "um"), Note(EXACT, "", options.line))
        add_growth(translation, "nucleation", table, fiber, whole, growing)
    for key in ("reference", "placement", "plus_end", "minus_end", "end_state"):
        options.values(key)
    translation.note_unused(options, "new fiber")
    translation.nucleated.append(fiber.name)
    return True
