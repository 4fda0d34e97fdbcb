"""What fibers are created with: singles and couples that are attached to them at first."""

from .document import EXACT, Note, quantity
from .hands import read_hand

PLACED, GROWING = "linkers that begin bound at given places", "links on filaments that grow"


def add_attached(translation, options, count):
    """Add what is attached to the last ``count`` filaments by the options that they are created with."""
    keys = ["attach", *(f"attach{number}" for number in range(1, 100))]
    for key in (key for key in keys if key in options):
        words = (options.text(key, default="").removesuffix("each")).split()
        own = translation.script.properties.get(words[-1]) if words else None
        node = _node(options, key)
        if own is None or own.kind != "single" or not _holds(translation, own) or node is None or len(words) > 1:
            translation.left_out(f"{key} = {', '.join(options.values(key))}", options.line_of(key), PLACED)
        elif translation.made[-1].grows:
            translation.left_out(f"{key} = {own.name}", options.line_of(key), GROWING)
        else:
            _add_tether(translation, own, options, key, node, count)


def _node(options, key):
    # The first or the last one, or None if it is another place.
    at_end = options.number((key, 1), default=None) == 0.0
    return {"minus_end": 0, "plus_end": -1}.get(options.text((key, 2), default="minus_end")) if at_end else None


def _holds(translation, own):
    settings = own.settings
    hand = read_hand(translation, settings.text("hand", default=""), own.line)
    length = settings.number("length", default=0.0)
    return (
        settings.text("activity") == "fixed"
        and hand.stays
        and length == 0.0
        and settings.number("stiffness", default=0.0) > 0.0
    )


def _add_tether(translation, own, options, key, node, count):
    table = translation.document.table("[[tether]]", options.line_of(key))
    numbers = [made.number for made in translation.made[-count:]]
    note = Note(EXACT, f"{own.name}, whose hand never unbinds from that end", options.line_of(key))
    table.add("filament", numbers, note)
    table.add("node", node)
    table.add("stiffness", quantity(own.settings.number("stiffness"), "pN/um"), Note(EXACT, "", own.line))
