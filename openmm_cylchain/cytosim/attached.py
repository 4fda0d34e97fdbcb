"""What fibers are created with: singles and couples that are attached to them at first."""

from .document import EXACT, NEAREST, Note, point, quantity
from .hands import read_hand
from .settings import OFF

_REFERENCES = ("minus_end", "plus_end", "center", "")
PLACED, GROWING = "linkers that begin bound at given places", "links on filaments that grow"


def add_attached(translation, options, count, segments):
    """Add what is attached to the last ``count`` filaments, of some segments, by the options that they begin with."""
    taken = []
    keys = ["attach", *(f"attach{number}" for number in range(1, 100))]
    for key in (key for key in keys if key in options):
        words = (options.text(key, default="").removesuffix("each")).split()
        own = translation.script.properties.get(words[-1]) if words else None
        place = _node(options, key, translation.made[-1], segments, taken)
        if own is not None and len(words) == 1 and _moves(own) and _add_places(translation, own, options, key, count):
            continue
        if own is None or own.kind != "single" or not _holds(translation, own) or place is None or len(words) > 1:
            translation.left_out(f"{key} = {', '.join(options.values(key))}", options.line_of(key), PLACED)
        elif translation.made[-1].grows:
            translation.left_out(f"{key} = {own.name}", options.line_of(key), GROWING)
        else:
            taken.append(place[0])
            _add_tether(translation, own, options, key, place, count)


def _moves(own):
    # Whether it is none that is tied to a point.
    return own.kind == "couple" or (own.kind == "single" and own.settings.text("activity") != "fixed")


def _add_places(translation, own, options, key, count):
    # Whether its first hand begins at a place, on each of the filaments.
    made = translation.made[-count:]
    length, along = made[-1].length, place_along(options, key, made[-1].length)
    inside = along is not None and 0.0 <= along <= length * (1.0 + 1e-9)
    if not inside or options.text((key, 3), default="off") not in OFF:
        return False
    numbers = [one.number for one in made]
    place = {"filament": numbers, "arc_length": quantity(min(along, length), "um")}
    translation.attached.setdefault(own.name, []).append(place)
    return True


def place_along(options, key, length):
    """How far in um from its first node an attachment to a filament is, by what stands behind a key; None if it is not
    said in numbers."""
    along, reference = options.number((key, 1), default=None), options.text((key, 2), default="minus_end")
    if along is None or reference not in _REFERENCES:
        return None
    return {"plus_end": length - along, "center": 0.5 * length + along}.get(reference, along)


def _node(options, key, made, segments, taken):
    # The free node that is nearest to a place, and how far from it in um; None if it is no place along the filament.
    along = place_along(options, key, made.length)
    if along is None or options.text((key, 3), default="off") not in OFF:
        return None
    free = [node for node in (*range(segments), -1) if node not in taken]
    if not free or not 0.0 <= along <= made.length * (1.0 + 1e-9):
        return None
    distances = {node: abs(along - made.length * (node % (segments + 1)) / segments) for node in free}
    node = min(free, key=distances.get)
    return node, distances[node]


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


def _add_tether(translation, own, options, key, place, count):
    table = translation.document.table("[[tether]]", options.line_of(key))
    numbers = [made.number for made in translation.made[-count:]]
    note = Note(EXACT, f"{own.name}, whose hand never unbinds", options.line_of(key))
    node, off = place
    table.add("filament", numbers, note)
    table.add("node", node, None if off < 1e-6 else Note(NEAREST, f"the nearest one, {off:.3g} um from there"))
    if options.text((key, 4)) is not None:
        table.add("point", point(options.vector(key, 4)), Note(EXACT, "", options.line_of(key)))
    table.add("stiffness", quantity(own.settings.number("stiffness"), "pN/um"), Note(EXACT, "", own.line))
