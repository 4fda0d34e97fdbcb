"""Fibers as [[filament]] tables: what they are made of, how many there are, and where they begin; lengths in um."""

import math
from dataclasses import dataclass

import numpy as np

from .attached import add_attached
from .directions import KEYS as DIRECTIONS
from .directions import (
    UnknownDirectionError,
    draw_direction,
    draw_orientation,
    draw_second_orientation,
    fixed_direction,
)
from .document import EXACT, NEAREST, Note, number_in, point, quantity
from .grammar import ScriptError
from .growth import longest_of, read_growth, same_growth, still_growth
from .places import draw_inside, region_of, unknown_position
from .script import count_of
from .settings import OFF
from .simulation import contact_diameter

_DRAG = 3.0
"""Of a cylinder that turns in all directions: 3 pi viscosity length/(ln(length/diameter) + 0.32)."""
_CORRECTION = 0.32
_LEAST_SHARE, _TRIALS = 0.05, 400
_LENGTHS = 9
"""How many lengths stand for a distribution of them."""
_RANGES = ("range", "position_range", "positions", "position_ends", "translation")
_PLACEMENT = (*DIRECTIONS, "position", "reference", "placement", *_RANGES)
_OFF_PLACE = ("off", "outside", "surface")
_PARTS, _MOST_PARTS = 20, 2000
_MOST_SEGMENTS = 5_000_000
_MOST_FIBERS = 1_000_000


@dataclass
class Made:
    """A filament that is written: that of which property, its number in the file, its length, and whether it grows."""

    name: str
    number: int
    length: float
    grows: bool


def add_filaments(translation, new):
    """Add the fibers of a New."""
    fiber = translation.script.named(new.name, "fiber", new.line)
    count = count_of(new, translation.space())
    options = new.settings
    if count == 0:
        return
    lengths = _lengths(fiber, options)
    growing = shared_growth(translation, fiber, options)
    for key in ("length", "plus_end", "minus_end", "end_state", "mark"):
        options.values(key)
    shape = _shape(translation, fiber, options, lengths[0])
    if shape is not None:
        for _ in range(count):
            _add_shape(translation, fiber, options, shape, growing)
        return
    if len(lengths) == 1:
        _add_group(translation, fiber, options, lengths[0], count, growing)
        return
    note = Note(NEAREST, f"{len(lengths)} lengths stand for the distribution of length", options.line_of("length"))
    for number, length in enumerate(lengths):
        share = (count + len(lengths) - 1 - number) // len(lengths)
        if share:
            _add_group(translation, fiber, options, length, share, growing, note)


def add_on_body(translation, fiber, options, length, count, growing):
    """Add fibers that begin on bodies, which say where: the number of their table, and how long they are."""
    table, segment, segments = _start(translation, fiber, options, length, growing)
    whole = segment * segments
    if options.text(("length", 1)) not in OFF:
        table.comment(Note(NEAREST, "all of the mean length, which is distributed in Cytosim", options.line))
    for key in ("length", "plus_end", "minus_end", "end_state", "mark"):
        options.values(key)
    table.add("segments", segments)
    table.add("count", count, Note(EXACT, "on bodies", options.line))
    _finish(translation, table, fiber, length, segment, segments, count, growing)
    number = len(translation.document.tables_called("[[filament]]"))
    add_attached(translation, options, count, segments)
    translation.note_unused(options, "fibers of asters")
    return number, whole


def shared_growth(translation, fiber, options, begins=False):
    """The Growing of fibers that are created with options, one for all that share monomers.

    None without growth, but for those that begin during a run.
    """
    growing = read_growth(translation, fiber, options)
    if growing is None and begins:
        growing = still_growth(fiber)
        growing.entries.append(("severing_rate", "0 1/(um*s)", Note(EXACT, "it neither grows nor shrinks")))
    if growing is None:
        return None
    for other in translation.growings:
        if same_growth(growing, other):
            growing.name = other.name
            return other
    names = [other.name for other in translation.growings]
    while growing.name in names:
        growing.name += "_"
    translation.growings.append(growing)
    return growing


def first_length(fiber, options):
    """The length that fibers are created with, the middle one of a distribution."""
    lengths = _lengths(fiber, options)
    return lengths[len(lengths) // 2]


def _lengths(fiber, options):
    # Those that stand for the distribution of lengths.
    settings = fiber.settings
    least = settings.number("min_length", default=0.008)
    most = settings.number("max_length", default=math.inf)
    length = options.number("length", "fiber_length", default=min(max(1.0, least), most))
    if options.text("position_ends") is not None:
        ends = np.array([options.vector("position_ends", own, default=(0.0, 0.0, 0.0)) for own in (0, 1)])
        length = float(np.linalg.norm(ends[1] - ends[0]))
    if not 0.0 < length < 1e6:
        raise options.mistake("length", f"must be positive, but is {length:g}.")
    shares = (np.arange(_LENGTHS) + 0.5) / _LENGTHS
    if options.text(("length", 1)) == "exponential":
        low, high = (math.exp(-own / length) for own in (least, min(most, 1e9)))
        return [float(own) for own in -length * np.log(low - shares * (low - high))]
    width = options.number(("length", 1))
    if width is None or width == 0.0:
        return [length]
    lower, upper = max(length - width, least), min(length + width, most)
    if not lower < upper:
        raise options.mistake("length", "allows no length between min_length and max_length.")
    return [float(own) for own in lower + shares * (upper - lower)]


def _shape(translation, fiber, options, length):
    # Points that a fiber begins with, as (n, 3), or None.
    for key in ("shape", "points"):
        if key not in options:
            continue
        if options.text(key) == "curved":
            return _arc(translation, fiber, options, length)
        points = np.array([options.vector(key, index) for index in range(len(options.values(key)))])
        if len(points) < 2 or np.any(np.linalg.norm(np.diff(points, axis=0), axis=1) == 0.0):
            raise options.mistake(key, "must be points that differ, separated by commas.")
        if translation.dimensions == 2:
            points[:, 2] = 0.0
        return points
    return None


def _arc(translation, fiber, options, length):
    # Of a circle about the origin, or off it, whose middle points along a vector across x.
    radius, off = options.number(("shape", 1), default=1.0), options.number(("shape", 3), default=0.0)
    across = np.array(options.vector("shape", 2, default=(0.0, 1.0, 0.0)))
    across[0] = 0.0
    across[translation.dimensions :] = 0.0
    segment, segments = segment_of(fiber, length, None)
    if not (across.any() and 0.5 * segment < radius < math.inf and math.isfinite(off)):
        raise options.mistake("shape", "must have a radius above half a segment, and a vector across x.")
    turn = 2.0 * math.asin(0.5 * segment / radius)
    angles = turn * (np.arange(segments + 1) - 0.5 * (segments + 1))
    up = radius * np.cos(angles) - off
    return np.outer(radius * np.sin(angles), [1.0, 0.0, 0.0]) + np.outer(up, across / np.linalg.norm(across))


def segment_of(fiber, length, growing):
    """How long a segment of a fiber is, and how many there are."""
    segmentation = fiber.settings.number("segmentation", default=1.0)
    if not 0.0 < segmentation < math.inf:
        raise fiber.settings.mistake("segmentation", "must be positive.")
    if length / segmentation > _MOST_SEGMENTS:
        raise fiber.settings.mistake("segmentation", f"makes {length / segmentation:.3g} segments of a fiber.")
    if growing is None:
        # Of the number of points that Cytosim has.
        ratio = length / segmentation
        number = 1 + math.floor(ratio)
        segments = max(1, int(number - 1 + (ratio * (number - 0.5) >= number * (number - 1))))
        return length / segments, segments
    wanted = segmentation if length >= segmentation else max(length, 0.25 * segmentation)
    own = max(2, round(wanted / growing.monomer)) * growing.monomer
    return own, max(1, round(length / own))


def add_type(translation, table, fiber, segment, length):
    """Add what a fiber of a length is made of to a table."""
    settings = fiber.settings
    rigidity = settings.number("rigidity")
    if rigidity is None or not 0.0 <= rigidity < math.inf:
        raise settings.mistake("rigidity", "must be given, and not negative.")
    table.add("name", translation.type_name(fiber.name), Note(EXACT, f"fiber {fiber.name}", fiber.line))
    table.add("bending_rigidity", quantity(rigidity, "pN*um^2"), Note(EXACT, "", settings.line_of("rigidity")))
    table.add("bending_model", "kratky-porod", Note(EXACT, "the energy of Cytosim's joints"))
    table.add("segment_length", quantity(segment, "um"), Note(EXACT, "", settings.line_of("segmentation")))
    radius = settings.number("drag_radius", "hydrodynamic_radius", default=0.0125)
    if not 0.0 < radius < math.inf:
        raise settings.mistake("drag_radius", "must be positive.")
    modulus = max(16.0 * rigidity / (2.0 * radius) ** 2, 1e4 * translation.thermal_energy / segment, 1000.0)
    note = Note(NEAREST, "Cytosim's fibers have no length but one: these stretch next to nothing")
    table.add("stretching_modulus", quantity(modulus, "pN"), note)
    diameter = min(2.0 * radius, contact_diameter(translation, fiber) or math.inf)
    translation.tables_by_fiber.append((table, fiber))
    table.add("diameter", quantity(diameter, "um"), Note(EXACT, "of drag_radius, or of steric if that is less"))
    _add_friction(translation, table, settings, segment, length, radius, diameter)
    force = settings.number("colinear_force", default=0.0)
    if force:
        note = Note(EXACT, "colinear_force times a segment", settings.line_of("colinear_force"))
        table.add("propulsion", quantity(force * segment, "pN"), note)


def _add_friction(translation, table, settings, segment, length, radius, diameter):
    # Cytosim has one friction along and across, that of a cylinder on average over all directions.
    cutoff = settings.number("drag_length", ("hydrodynamic_radius", 1), default=5.0)
    along = max(min(length, cutoff), radius)
    cylinder = math.log(0.5 * along / radius) + _CORRECTION
    if cylinder <= 1.0:
        # The larger one of a cylinder and a sphere.
        sphere = _DRAG * length / (6.0 * radius)
        cylinder = min(cylinder, sphere) if cylinder > 0.0 else sphere
    if settings.number("drag_model", "surface_effect", default=0.0) != 0.0:
        gap = settings.number(("drag_model", 1), ("surface_effect", 1), default=0.0)
        if gap <= 0.0:
            raise settings.mistake("drag_model", "needs the distance from the surface.")
        cylinder = 0.5 * _DRAG * math.acosh(1.0 + gap / radius)
    # A viscosity of its own.
    cylinder *= translation.viscosity / settings.number("viscosity", default=translation.viscosity)
    at = max(along, segment)
    logarithm = math.log(at / diameter)
    corrections = {"parallel": 2.0 * cylinder / _DRAG - logarithm}
    corrections |= {own: 4.0 * cylinder / _DRAG - logarithm for own in ("perpendicular", "rotational")}
    table.add("friction_length", quantity(at, "um"), Note(EXACT, "the length of the fiber, or drag_length"))
    note = Note(EXACT, "one friction along and across; delete this line for that of a cylinder")
    table.add("end_corrections", {key: round(value, 9) for key, value in corrections.items()}, note)


def _start(translation, fiber, options, length, growing, note=None):
    # A table with all but where its filaments are.
    segment, segments = segment_of(fiber, length, growing)
    table = translation.document.table("[[filament]]", options.line)
    if note is not None:
        table.comment(note)
    add_type(translation, table, fiber, segment, length)
    if translation.dimensions == 2:
        table.add("planar", True, Note(EXACT, "two dimensions: it stays in the plane z = 0"))
    return table, segment, segments


def _finish(translation, table, fiber, length, segment, segments, count, growing):
    first = translation.filament_count
    if count > _MOST_FIBERS:
        raise ScriptError(fiber.line, f"{count} {fiber.name} are more than {_MOST_FIBERS}, the most of one new.")
    translation.filament_count += count
    translation.made += [Made(fiber.name, first + own, length, growing is not None) for own in range(count)]
    # In either order: a vector and an end.
    index = 0 if fiber.settings.text("end_force", default="x")[0] in "+-.0123456789" else 1
    force, end = fiber.settings.vector("end_force", index), fiber.settings.text(("end_force", 1 - index), default="off")
    if force is not None and any(force):
        node = {"plus_end": -1, "minus_end": 0}.get(end)
        if end == "center" and segments % 2 == 0:
            node = segments // 2
        if node is None or growing is not None:
            line = fiber.settings.line_of("end_force")
            translation.left_out(f"end_force = {end} of {fiber.name}", line, "forces on ends that grow, or on middles")
        else:
            pull = translation.document.table("[[pull]]", table.line)
            numbers = list(range(first, first + count))
            pull.add("filament", numbers, Note(EXACT, "end_force", fiber.settings.line_of("end_force")))
            pull.add("node", node)
            pull.add("force", [quantity(own, "pN") for own in force])
    if growing is None:
        return
    growing.length += count * length
    if any(key == "severing_rate" for key, *_ in growing.entries):
        table.add("reserve", min(_MOST_PARTS, _PARTS * count), Note(NEAREST, "places for parts of those that are cut"))
    add_growth(translation, "filament", table, fiber, max(length, segment * segments), growing)


def add_growth(translation, name, table, fiber, length, growing):
    """Add the growth of a table of a name, such as filament, whose filaments are of a length at first."""
    longest, note = longest_of(translation, growing, length)
    inner = translation.document.table(f"[{name}.growth]", table.line)
    inner.add("monomers", growing.name)
    inner.add("longest", quantity(longest, "um"), note)
    least = min(fiber.settings.number("min_length", default=0.008), length)
    if least > 0.0:
        inner.add("shortest", quantity(max(least, growing.monomer), "um"), Note(EXACT, "min_length", fiber.line))
    for key, value, own in growing.entries:
        inner.add(key, value, own)


def keep_longer(translation, growing, arm):
    """Let fibers of the last table stay as long as the arm in um by which a body keeps their direction."""
    table = translation.document.tables_called("[filament.growth]")[-1]
    least = growing.monomer * math.ceil(arm / growing.monomer * (1.0 - 1e-9))
    text = "not below the second spring of the aster, where Cytosim brings it nearer"
    longer = "shortest", quantity(least, "um"), Note(NEAREST, text)
    place = next((k for k, (key, *_) in enumerate(table.entries) if key == "shortest"), None)
    if place is None:
        table.add(*longer)
    elif number_in(table.entries[place][1]) < least:
        table.entries[place] = longer


def _add_shape(translation, fiber, options, points, growing):
    steps = np.linalg.norm(np.diff(points, axis=0), axis=1)
    length = float(steps.sum())
    table, segment, segments = _start(translation, fiber, options, length, growing)
    at = np.linspace(0.0, length, segments + 1) if growing is None else segment * np.arange(segments + 1)
    marks = np.concatenate([[0.0], np.cumsum(steps)])
    nodes = np.stack([np.interp(at, marks, points[:, axis]) for axis in range(3)], axis=1)
    nodes = _with_equal_steps(nodes, segment)
    if options.text("placement") != "off":
        nodes = _placed(translation, options, nodes)
    table.add("nodes", [point(node) for node in nodes], Note(EXACT, "shape", options.line_of("shape")))
    _finish(translation, table, fiber, length, segment, segments, 1, growing)
    add_attached(translation, options, 1, segments)


def _with_equal_steps(nodes, segment):
    # Where the path turns, its chords are shorter than segments at rest.
    steps = np.diff(nodes, axis=0)
    lengths = np.linalg.norm(steps, axis=1, keepdims=True)
    if np.all(np.abs(lengths / segment - 1.0) < 1e-6):
        return nodes
    steps = steps / lengths * segment
    whole = np.concatenate([nodes[:1], nodes[0] + np.cumsum(steps, axis=0)])
    return whole + nodes.mean(axis=0) - whole.mean(axis=0)


def _placed(translation, options, nodes):
    space = _own_space(translation, options)
    draw = translation.draw_in(space, options.line)
    if space is None and not any(key in options for key in ("position", *DIRECTIONS)):
        translation.document.note(NEAREST, "a fiber with a shape stays where its points are", options.line)
        return nodes
    place = draw_inside(options.text("position", default="center" if space is None else "inside"), draw, keep=False)
    nodes = nodes @ draw_orientation(options, place, draw).T + place
    second = draw_second_orientation(options, place, draw)
    return nodes if second is None else nodes @ second.T


def _add_group(translation, fiber, options, length, count, growing, note=None):
    table, segment, segments = _start(translation, fiber, options, length, growing, note)
    whole = segment * segments
    if abs(whole - length) > 1e-6 * length:
        table.comment(Note(NEAREST, f"{whole:g} um long in whole segments, not {length:g} um", options.line))
    if segments * count > _MOST_SEGMENTS:
        raise options.mistake("length", f"makes {segments * count} segments.")
    table.add("segments", segments)
    _read_placement(translation, options)
    equilibrate = options.number("equilibrate", default=0.0)
    if equilibrate > 0.0:
        table.comment(Note(NEAREST, "equilibrate: shapes are those of equilibrium, of its own rigidity", options.line))
    else:
        table.add("start", "straight", Note(EXACT, "as in Cytosim"))
    if not _add_region(translation, table, options, whole, count):
        _add_places(translation, table, options, segment, segments, count, equilibrate > 0.0)
    _finish(translation, table, fiber, length, segment, segments, count, growing)
    add_attached(translation, options, count, segments)


def _read_placement(translation, options):
    for key in _PLACEMENT:
        options.values(key)
    space = _own_space(translation, options)
    word = unknown_position(options.text("position", default="inside"), space)
    if word is not None:
        translation.left_out(
            f"the position {options.text('position')!r}, for which they begin anywhere in the space",
            options.line_of("position"),
            f"positions: {word}",
        )
        options.set("position", ["inside"], options.line_of("position"))
    draw = translation.draw_in(space, options.line)
    for key in DIRECTIONS:
        try:
            draw_direction(options.text(key), np.array([0.3, 0.2, 0.0]), draw)
        except UnknownDirectionError:
            text = f"{key} = {options.text(key)}, for which they have any"
            translation.left_out(text, options.line_of(key), f"directions: {options.text(key).split()[0]}")
            options.set(key, ["random"], options.line_of(key))


def _own_space(translation, options):
    name = options.text(("position", 1)) or options.text(("placement", 1))
    return translation.space(name)


def _add_region(translation, table, options, whole, count):
    # A count of filaments in a region, where that is about what Cytosim does; whether it is.
    if count == 1 and "position" in options:
        return False
    if options.text("reference", default="center") != "center" or options.text("placement") in _OFF_PLACE:
        return False
    if any(key in options for key in _RANGES) or any(len(options.values(key)) > 1 for key in DIRECTIONS):
        return False
    direction = options.text(*DIRECTIONS)
    fixed = fixed_direction(direction) if direction else None
    if direction not in (None, "random") and fixed is None:
        return False
    space = _own_space(translation, options)
    draw = translation.draw_in(space, options.line)
    text = options.text("position")
    everywhere = text in (None, "inside") and space is not None and space.shape == "periodic"
    region = None if everywhere else region_of(text, draw)
    if region is None and not everywhere:
        return False
    if region is not None and _share_inside(region, draw, whole, text, direction) < _LEAST_SHARE:
        return False
    table.add("count", count, Note(EXACT, "", options.line))
    if region is not None:
        table.add("inside", region, Note(NEAREST, "where all of a filament begins; in Cytosim, its middle"))
    if fixed is not None:
        vector, opposite = fixed
        vector = (*vector[:2], 0.0) if translation.dimensions == 2 else vector
        table.add("direction", [float(own) for own in vector], Note(EXACT, "", options.line_of("direction")))
        if opposite:
            table.add("orientation", "nematic", Note(EXACT, "half of them have the opposite direction"))
    return True


def _share_inside(region, draw, whole, text, direction):
    # How many of those that Cytosim draws are in the region as a whole.
    from ..runs.keys import Place
    from ..runs.tables.shapes import REGION, Region

    inside, found = Region(REGION.read(region, Place("inside", ()))), 0
    for _ in range(_TRIALS):
        place = draw_inside(text, draw)
        if place is None:
            return 0.0
        ends = place + 0.5 * whole * np.outer([-1.0, 0.0, 1.0], draw_direction(direction, place, draw))
        found += inside.contains(1e3 * ends)
    return found / _TRIALS


def _add_places(translation, table, options, segment, segments, count, drawn):
    whole = segment * segments
    starts, directions = [], []
    for number in range(count):
        start, direction = _one_place(translation, options, whole, number, count)
        starts.append(start)
        directions.append(direction)
    if count == 1:
        table.add("position", point(starts[0]), Note(EXACT, "of its first node", options.line_of("position")))
        table.add("direction", [round(float(own), 12) for own in directions[0]])
        return
    nodes = np.array(starts)[:, None] + segment * np.arange(segments + 1)[:, None] * np.array(directions)[:, None]
    if drawn:
        table.comment(Note(NEAREST, "equilibrate: those at places that are drawn here begin straight"))
    _remove(table, ("start", "segments"))
    note = Note(EXACT, f"{count} filaments at places as Cytosim draws them", options.line)
    table.add("file", translation.start_file(1000.0 * nodes), note)


def _remove(table, keys):
    table.entries = [entry for entry in table.entries if entry[0] not in keys]


def _one_place(translation, options, whole, number, count):
    space = _own_space(translation, options)
    draw = translation.draw_in(space, options.line)
    direction = options.text(*DIRECTIONS)
    key = "position_range" if "position_range" in options else "range"
    placement = options.text("placement", default="inside")
    if "position_ends" in options:
        ends = np.array([options.vector("position_ends", own) for own in (0, 1)])
        return ends[0], (ends[1] - ends[0]) / np.linalg.norm(ends[1] - ends[0])
    if key in options:
        first, last = (np.array(options.vector(key, own, default=(0.0, 0.0, 0.0))) for own in (0, 1))
        place = first + (last - first) * number / max(1, count - 1)
    elif "positions" in options:
        place = np.array(options.vector("positions", number % len(options.values("positions"))))
    else:
        keep = placement in ("inside", "all_inside")
        place = draw_inside(options.text("position"), draw, keep)
        if place is None:
            # Cytosim says so too, and makes fewer.
            place = draw_inside(options.text("position"), draw, False)
            options.set("placement", ["anywhere"], options.line)
            translation.document.note(
                NEAREST, "places outside of the space, where Cytosim makes no fiber, are taken", options.line
            )
    if placement in ("surface", "outside"):
        translation.left_out(f"placement = {placement}", options.line_of("placement"), "surfaces: placement")
    vector = draw_direction(direction, place, draw)
    reference = options.text("reference", default="center")
    share = {"center": 0.5, "minus_end": 0.0, "plus_end": 1.0}.get(reference, 0.5)
    shift = np.array(options.vector("translation", default=(0.0, 0.0, 0.0)))
    if translation.dimensions == 2:
        place[2] = shift[2] = 0.0
    second = draw_second_orientation(options, place, draw)
    if second is not None:
        place, vector = second @ place, second @ vector
    return place - share * whole * vector + shift, vector
