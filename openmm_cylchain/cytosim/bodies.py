"""Beads, solids, spheres and asters as [[body]] tables, with the fibers and singles on them; lengths in um."""

import math
import re
from dataclasses import dataclass, field

import numpy as np

from .directions import KEYS as DIRECTIONS
from .directions import UnknownDirectionError, draw_direction, draw_second_orientation, fixed_direction
from .document import EXACT, LEFT_OUT, NEAREST, Note, Table, point, quantity
from .filaments import add_on_body, first_length, keep_longer, shared_growth
from .places import draw_inside, draw_position, region_of, unknown_position
from .script import count_of
from .settings import OFF, Settings
from .simulation import STILL, contact_diameter

KINDS = ("bead", "solid", "sphere", "aster")
_ONE_SINGLE = re.compile(r"(\d+\s+)?([A-Za-z_]\w*)\s*(.*)", re.DOTALL)
_LEAST_SHARE = 0.8
"""Of the length of filaments: how far along them a second spring is at most."""
_LEAST_GAP = 1.05
"""Of ends of filaments on a body where there are contacts, in diameters."""
_TYPES = {"radial": "random", "0": "random", "regular": "even", "2": "even"}


@dataclass
class MadeBodies:
    """Bodies of one table: their name and that of their property, how many, the table and its number, and points of
    keys by their names.

    ``singles`` are numbers of points by the names of singles: one for each anchor. ``steric`` is the line that lets
    them touch others, if any does.
    """

    name: str
    property: str
    count: int
    table: Table
    number: int
    groups: dict
    singles: dict = field(default_factory=dict)
    steric: int | None = None


class _Shape:
    # Points in the frame of a body, with radii, none of them twice.
    def __init__(self):
        self.points, self.radii, self.groups, self.singles = [], [], {}, {}

    def add(self, place, radius=0.0):
        for number, there in enumerate(self.points):
            if np.linalg.norm(there - place) < 1e-6:
                self.radii[number] = max(self.radii[number], radius)
                return number
        self.points.append(np.array(place, dtype=float))
        self.radii.append(radius)
        return len(self.points) - 1

    def hold(self, name, numbers):
        self.singles.setdefault(name, []).extend(numbers)


def add_bodies(translation, new):
    """Add the bodies of a New of one of KINDS."""
    count, options = count_of(new, translation.space()), new.settings
    if count == 0:
        return options.take_rest()
    draw = translation.draw_in(translation.space(), new.line)
    if new.kind == "aster":
        return _add_aster(translation, new, count, draw)
    own = translation.script.named(new.name, new.kind, new.line)
    made = _add_table(translation, own, new, count, _shape_of(translation, new.kind, options, draw))
    if made is not None and new.kind == "sphere" and len(made.groups) > 0:
        text = "points of a sphere stay where they are on it; in Cytosim they slide on its surface"
        made.table.comment(Note(NEAREST, text, new.line))
    return None


def find_bodies(translation, text):
    """The MadeBodies of what a base names, such as solid1 or kinetochore~1, alone in their table, or None."""
    words = re.fullmatch(r"([A-Za-z_]\w*?)\s*(~?)\s*(\d+)?", (text or "").strip())
    if words is None:
        return None
    there = translation.bodies if translation.there is None else translation.bodies[: translation.there[1]]
    kinds = {own.property: translation.script.properties[own.property].kind for own in there}
    found = [own for own in there if words[1] in (own.name, own.property, kinds[own.property])]
    number = int(words[3] or 0)
    if words[2] == "~" or number == 0:
        # name~1 is the last one, as name0 is.
        found, number = found[::-1], max(number, 1)
    for own in found:
        if number <= own.count:
            return own if own.count == 1 else None
        number -= own.count
    return None


def point_of_base(translation, options):
    """The number of the body that a base names, and of its point; None if there is no such one."""
    own = find_bodies(translation, options.text("base"))
    key = options.text(("base", 1), default="point1")
    if own is None or key not in own.groups:
        return None
    return sum(other.count for other in translation.bodies[: own.number - 1]), own.groups[key][0]


def attach_to_bodies(translation, new, count):
    """Attach singles to bodies where new names a base; whether that was possible."""
    options = new.settings
    if "multi_base" in options:
        found = [own for own in translation.bodies if own.name == options.text("multi_base")]
        if not found:
            return False
        each = max(1, round(count / sum(own.count for own in found)))
        text = f"{each} {new.name} on each {options.text('multi_base')}, for {count} on any of them"
        translation.document.note(NEAREST, text, new.line)
        for own in found:
            own.singles.setdefault(new.name, []).extend([0] * each)
        return True
    found = point_of_base(translation, options)
    if found is None:
        return False
    own = find_bodies(translation, options.text("base"))
    own.singles.setdefault(new.name, []).extend([found[1]] * count)
    return True


def _shape_of(translation, kind, options, draw):
    shape = _Shape()
    if kind in ("bead", "sphere") and "radius" in options:
        radius = _radius(options, "radius")
        shape.add(np.zeros(3), radius)
        if kind == "bead":
            shape.groups["point1"] = [0]
    for number in range(1, 1000):
        keys = [key for key in (f"sphere{number}", f"ball{number}", f"point{number}") if key in options]
        if not keys:
            break
        for key in keys:
            if key.startswith("point"):
                _add_points(translation, kind, options, key, shape, draw)
            else:
                _add_sphere(translation, options, key, shape, draw)
    _add_interpolated(translation, options, shape)
    everywhere = list(range(1 if kind == "sphere" and len(shape.points) > 1 else 0, len(shape.points)))
    for key in ("attach", "anchor"):
        for text in options.values(key):
            _hold(translation, options, key, text, shape, everywhere, draw)
    for number in range(1, 100):
        for text in options.values(f"attach{number}"):
            there = shape.groups.get(f"point{number}", everywhere)
            _hold(translation, options, f"attach{number}", text, shape, there, draw)
    return shape


def _radius(options, *places):
    radius = options.number(*places, default=0.0)
    if not 0.0 < abs(radius) < math.inf:
        key = places[0][0] if isinstance(places[0], tuple) else places[0]
        raise options.mistake(key, "must have a radius above zero.")
    return abs(radius)


def _add_points(translation, kind, options, key, shape, draw):
    values = options.values(key)
    several = values[0].strip().isdigit()
    count, rest = (int(values[0]), values[1:]) if several else (1, values)
    text = rest[0] if rest else "center"
    radius, singles = 0.0, rest[1:]
    if kind != "sphere" and singles:
        radius, singles = abs(options.number((key, 1 + several), default=0.0)), singles[1:]
    elif kind == "sphere" and text == "surface":
        text = f"sphere {shape.radii[0]:g}"
    numbers = []
    for _ in range(count):
        place = _local(translation, options, key, text, draw)
        if kind == "sphere" and np.any(place):
            place = place * shape.radii[0] / np.linalg.norm(place)
        numbers.append(shape.add(place, radius))
    shape.groups[key] = numbers
    for single in singles:
        _hold(translation, options, key, single, shape, numbers, draw)


def _add_sphere(translation, options, key, shape, draw):
    radius = _radius(options, (key, 1))
    center = _local(translation, options, key, options.text(key, default="center"), draw)
    number = shape.add(center, radius)
    shape.groups[key] = shape.groups[key.replace("sphere", "point").replace("ball", "point")] = [number]
    inside = key.startswith("ball")
    for text in options.values(key)[2:]:
        count, name, where = _single_of(translation, options, key, text)
        for _ in range(count):
            if where:
                place = _local(translation, options, key, where, draw)
            else:
                place = draw.ball() if inside else draw.unit()
            shape.hold(name, [shape.add(center + radius * place)])


def _add_interpolated(translation, options, shape):
    # single1 = NAME, point1, point2, 0.5
    for number in range(1, 1000):
        key = f"single{number}"
        if key not in options:
            return
        count, name, _ = _single_of(translation, options, key, options.text(key, default=""))
        ends = [shape.groups.get(options.text((key, own), default="point1"), [0])[0] for own in (1, 2)]
        if options.text((key, 2)) is None:
            ends[1] = ends[0]
        share = options.number((key, 3), default=0.0)
        place = (1.0 - share) * shape.points[ends[0]] + share * shape.points[ends[1]]
        if count:
            shape.hold(name, [shape.add(place)] * count)


def _single_of(translation, options, key, text):
    # How many, the name of a single and what stands behind it; none if there is no such single.
    inner = text.strip()
    inner = inner[1:-1].strip() if inner[:1] == "(" and inner[-1:] == ")" else inner
    words = _ONE_SINGLE.fullmatch(inner)
    found = None if words is None else translation.script.properties.get(words[2])
    if found is None or found.kind != "single":
        translation.left_out(f"{text!r} of {key}", options.line_of(key), "bodies: what is attached to them")
        return 0, None, ""
    return int(words[1] or 1), words[2], words[3].strip()


def _hold(translation, options, key, text, shape, numbers, draw):
    count, name, rest = _single_of(translation, options, key, text)
    if name is None:
        return
    if rest == "each":
        shape.hold(name, [number for number in numbers for _ in range(count)])
    else:
        chosen = draw.generator.integers(0, len(numbers), count)
        shape.hold(name, [numbers[own] for own in chosen])


def _local(translation, options, key, text, draw):
    # A place in the frame of a body.
    word = unknown_position(text, None)
    if word is not None:
        translation.left_out(f"{text!r} of {key}", options.line_of(key), f"positions: {word}")
        return draw.unit()
    return draw_position(text, draw)


def _add_table(translation, own, new, count, shape):
    settings, options = own.settings, new.settings
    if not any(shape.radii):
        translation.left_out(f"{count} {new.name} without a radius", new.line, f"bodies: {new.kind}s without a radius")
        options.take_rest()
        return None
    table = translation.document.table("[[body]]", new.line)
    table.add("name", translation.type_name(new.name), Note(EXACT, f"{own.kind} {own.name}", own.line))
    sphere = shape.radii[0] > 0.0 and not any(shape.radii[1:]) and not np.any(shape.points[0])
    if sphere:
        note = Note(EXACT, "with the friction of a sphere, 6 pi viscosity radius")
        table.add("radius", quantity(shape.radii[0], "um"), note)
    else:
        note = Note(EXACT, "friction is the sum of that of its spheres, as in Cytosim")
        table.add("radii", [quantity(radius, "um") for radius in shape.radii], note)
    places = shape.points[1:] if sphere else shape.points
    if places:
        random = any(not text.strip()[:1].isdigit() for text in options.text("point1", default="0"))
        note = Note(NEAREST, "drawn once, the same for all of them") if count > 1 and random else None
        table.add("points", [point(place) for place in places], note)
    _add_places(translation, table, new, count)
    if translation.dimensions == 2:
        table.add("planar", True, Note(EXACT, "two dimensions"))
    steric = _steric_line(translation, table, settings)
    _add_viscosity(translation, table, settings)
    for key in ("point_mobility", "piston_effect"):
        settings.values(key)
    number = len(translation.document.tables_called("[[body]]"))
    made = MadeBodies(new.name, own.name, count, table, number, shape.groups, shape.singles, steric)
    translation.bodies.append(made)
    return made


def _add_viscosity(translation, table, settings):
    viscosity, line = settings.number("viscosity", default=translation.viscosity), settings.line_of("viscosity")
    if viscosity <= 0.0:
        raise settings.mistake("viscosity", "must be positive.")
    if viscosity != translation.viscosity:
        note = Note(NEAREST, "inf in Cytosim", line) if viscosity == math.inf else Note(EXACT, "its own", line)
        table.add("viscosity", quantity(min(viscosity, STILL), "pN*s/um^2"), note)


def _steric_line(translation, table, settings):
    if translation.script.simul.text("steric") in OFF:
        return None
    if settings.text("steric") not in OFF:
        return settings.line_of("steric")
    table.add("contacts", False, Note(EXACT, "steric is off"))
    return None


def _add_places(translation, table, new, count):
    options = new.settings
    text = options.text("position")
    fixed = options.text("placement") in ("off", "0", "none")
    for key in ("placement", "position", *DIRECTIONS):
        options.values(key)
    space = translation.space(options.text(("position", 1)))
    word = None if text is None else unknown_position(text, space)
    if word is not None:
        translation.left_out(
            f"the position {text!r}, for which they are anywhere in the space",
            options.line_of("position"),
            f"positions: {word}",
        )
        text = None
    draw = translation.draw_in(space, new.line)
    if text in (None, "inside") and (fixed or space is None):
        if not fixed:
            translation.document.note(NEAREST, f"{new.name} is at the origin, since there is no space", new.line)
        text = "center"
    turned = any(len(options.values(key)) > 1 for key in ("rotation", "orientation"))
    region = region_of(text, draw) if count > 1 and not turned else None
    direction = options.text(*DIRECTIONS, default="off" if fixed else None)
    everywhere = text in (None, "inside") and space is not None and space.shape == "periodic"
    everywhere = everywhere and count > 1 and not turned
    first, second = None, None
    if region is not None or everywhere:
        table.add("count", count, Note(EXACT, "", new.line))
        if region is not None:
            table.add("inside", region, Note(EXACT, "where all of their spheres are"))
    else:
        places = [draw_inside(text, draw, keep=not fixed) for _ in range(count)]
        if any(place is None for place in places):
            translation.document.note(NEAREST, f"{new.name}: places outside of the space are taken", new.line)
            places = [draw_inside(text, draw, keep=False) if place is None else place for place in places]
        if turned:
            turns = [draw_second_orientation(options, place, draw) for place in places]
            places, second = [turn @ place for turn, place in zip(turns, places)], turns[0]
        if translation.dimensions == 2:
            places = [np.array([*place[:2], 0.0]) for place in places]
        first = places[0]
        table.add("positions", [point(place) for place in places], Note(EXACT, "", options.line_of("position")))
    if second is not None and count > 1 and options.text(("rotation", 1), ("orientation", 1)) == "random":
        direction = "random"
    _add_direction(translation, table, options, direction, first, draw, second)


def _add_direction(translation, table, options, direction, place, draw, second=None):
    if direction in (None, "random"):
        return
    line = options.line_of("direction")
    found = fixed_direction(direction)
    if found is None and place is None:
        translation.left_out(f"direction = {direction}, for which they have any", line, f"directions: {direction}")
        return
    try:
        vector = draw_direction(direction, place if place is not None else np.ones(3), draw)
    except UnknownDirectionError:
        word = direction.split()[0]
        translation.left_out(f"direction = {direction}, for which they have any", line, f"directions: {word}")
        return
    vector = vector if second is None else second @ vector
    table.add("direction", [round(float(own), 12) for own in vector], Note(EXACT, "of its x axis", line))


def _add_aster(translation, new, count, draw):
    options = new.settings
    aster = translation.script.named(new.name, "aster", new.line)
    outer = _radius(options, "radius")
    inner = abs(options.number(("radius", 1), default=0.0))
    name = options.text("solid", default="")
    solid = translation.script.properties.get(name)
    if solid is None:
        made = find_bodies(translation, name)
        for key in ("position", "direction", "orientation", "placement"):
            options.values(key)
    else:
        shape = _shape_of(translation, "solid", options, draw)
        if not any(shape.radii):
            shape = _Shape()
            shape.add(np.zeros(3), outer)
        made = _add_table(translation, solid, new, count, shape)
    if made is None or made.table.value("filaments") is not None:
        translation.left_out(f"{count} {new.name} on {name}", new.line, "bodies: asters on a solid that is there")
        return options.take_rest()
    if aster.settings.number("nucleate", "fiber_rate", default=0.0) > 0.0:
        text = f"nucleation of fibers by {new.name}"
        translation.left_out(text, aster.settings.line_of("nucleate"), "bodies that nucleate fibers")
    aster.settings.values("nucleate")
    return _add_fibers(translation, new, aster, made, outer, inner, draw)


def _add_fibers(translation, new, aster, made, outer, inner, draw):
    options = new.settings
    line = options.line_of("fibers")
    kind = options.text("type", default="custom" if "fiber1" in options else "radial")
    for key in ("separation", "seed_diameter", *(f"fiber{own}" for own in range(1, 100))):
        options.values(key)
    number = options.number("fibers", default=0.0)
    if kind == "custom":
        number = sum(f"fiber{own}" in options for own in range(1, 100))
    name = options.text(("fibers", 1))
    fiber = translation.script.properties.get(name)
    if fiber is None or fiber.kind != "fiber" or number < 1.0:
        if number >= 1.0:
            translation.left_out(f"fibers = {number:g}, {name}", line, "fibers of an aster")
        return
    block = options.block("fibers", 2)
    own = Settings.of(f"fibers of {new.name}", line, block)
    total = int(number) * made.count
    growing = shared_growth(translation, fiber, own)
    length = first_length(fiber, own)
    stiffness = [aster.settings.number(("stiffness", index), default=0.0) for index in (0, 1)]
    stiffness[1] = stiffness[1] or stiffness[0]
    end = {"plus_end": "plus"}.get(aster.settings.text("pole", "focus"), "minus")
    table, whole = add_on_body(translation, fiber, own, length, total, growing)
    capped = growing is None or any(key == f"{end}_capped" for key, *_ in growing.entries)
    if not capped or stiffness[0] <= 0.0:
        text = f"{total} {name} begin anywhere: their {end} end is none that stays" if not capped else "no stiffness"
        translation.left_out(text, line, "fibers that grow where a body holds them")
        return
    # What a [[filament]] table has that stands by itself.
    if kind in _TYPES:
        inner, crowded = _least_distance(translation, inner, int(number), contact_diameter(translation, fiber))
        wanted = abs(outer - inner)
        where = {"distance": quantity(inner, "um"), "spread": "even" if crowded else _TYPES[kind]}
        if crowded:
            text = "their ends are as far out, and as evenly, as they have to be not to overlap"
            made.table.comment(Note(NEAREST, text, new.line))
    else:
        where, wanted = _places_of(translation, options, kind, int(number), outer, inner, draw)
    arm = min(wanted, _LEAST_SHARE * whole)
    if growing is not None:
        keep_longer(translation, growing, arm or 0.5 * whole)
    held = {
        "table": table,
        "end": end,
        "stiffness": quantity(stiffness[0], "pN/um"),
        "arm_stiffness": quantity(stiffness[1], "pN/um"),
        "arm": quantity(arm or 0.5 * whole, "um"),
        **where,
    }
    exact = arm == wanted
    text = "stiffness and radius of the aster" + ("" if exact else ", the second spring nearer where fibers are short")
    made.table.add("filaments", held, Note(EXACT if exact else NEAREST, text, new.line))
    if made.steric is not None and contact_diameter(translation, fiber) is None:
        made.table.add("contacts", True, Note(EXACT, "steric", made.steric))
    elif made.steric is not None:
        text = "contacts of bodies that hold fibers"
        made.table.comment(Note(LEFT_OUT, text, made.steric, text))
        made.steric = None


def _places_of(translation, options, kind, number, outer, inner, draw):
    # Of asters that are not radial: places and directions, as src/sim/organizers/aster.cc has them, and an arm.
    generator, x = draw.generator, np.array([1.0, 0.0, 0.0])
    if kind == "disc":
        across = outer * _apart_on_disc(translation, options, number, outer, generator)
        places = np.column_stack([np.full(number, -0.5 * inner * outer), across])
        directions, arm = np.tile(x, (number, 1)), inner * outer
    elif kind == "custom":
        ends = [[options.vector(f"fiber{own}", end) for end in (0, 1)] for own in range(1, number + 1)]
        places, vectors = outer * np.array(ends)[:, 0], outer * np.diff(np.array(ends), axis=1)[:, 0]
        lengths = np.linalg.norm(vectors, axis=1)
        if np.any(lengths == 0.0):
            raise options.mistake("fiber1", "must have two places that differ.")
        directions, arm = vectors / lengths[:, None], float(lengths.mean())
    else:
        directions = np.array([draw.unit() for _ in range(number)])
        if kind == "angular":
            angle = options.number("aster_angle", default=math.pi)
            cap = options.number("aster_cap", default=1.0 - math.cos(angle))
            along = 1.0 - cap * generator.uniform(0.0, 1.0, number)
            if draw.dimensions == 2:
                along = np.cos(math.acos(max(-1.0, 1.0 - cap)) * generator.uniform(-1.0, 1.0, number))
            around = directions - np.outer(directions @ x, x)
            around /= np.linalg.norm(around, axis=1, keepdims=True)
            directions = along[:, None] * x + np.sqrt(1.0 - along**2)[:, None] * around
            places, arm = inner * directions, abs(outer - inner)
        else:
            outside = outer * np.array([draw.ball() for _ in range(number)])
            directions *= np.where(np.sum(directions * outside, axis=1) < 0.0, -1.0, 1.0)[:, None]
            places, arm = outside - inner * directions, inner
    if draw.dimensions == 2:
        places[:, 2] = directions[:, 2] = 0.0
    directions = [[round(float(own), 12) for own in vector] for vector in directions]
    return {"places": [point(place) for place in places], "directions": directions}, arm


def _apart_on_disc(translation, options, number, outer, generator):
    # Points of the unit disc, apart by what a seed takes, or as far as there is room for.
    apart = options.number("seed_diameter", default=0.025) / outer
    apart = min(apart, 1.0 / math.sqrt(number))
    found = []
    while len(found) < number:
        place = generator.uniform(-1.0, 1.0, 2)
        if place @ place <= 1.0 and all(np.linalg.norm(place - other) >= apart for other in found):
            found.append(place)
    return np.array(found)


def _least_distance(translation, distance, count, diameter):
    # From which filaments that are spread evenly do not overlap, and whether the distance was less.
    if diameter is None or count < 2:
        return distance, False
    if translation.dimensions == 2:
        least = 0.5 * diameter / math.sin(math.pi / count)
    else:
        # Neighbours on the spiral are at least 3.09/sqrt(n) apart.
        least = diameter / (2.0 * math.sin(min(0.5 * 3.0 / math.sqrt(count), 0.5 * math.pi)))
    least *= _LEAST_GAP
    return (least, True) if distance < least else (distance, False)
