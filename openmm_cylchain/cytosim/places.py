"""Where objects begin: POSITION of Cytosim (``doc/sim/placement.md``, ``src/sim/primitives.cc``); in um.

Each primitive is a function that draws a point; some are regions as well, within which runs draw places themselves.
"""

import math

import numpy as np

from .directions import ROTATIONS, rotation_of, towards
from .document import point, quantity
from .drawing import TRIES, Words, draw_where, flat, split_condition
from .spaces import disc_region

_THIN = 1e-6
"""Half of an edge in um of a box that is none."""


def _axis(letter, along, across):
    # A vector with one component along an axis, and two across it.
    axis = "XYZ".find(letter)
    vector = np.zeros(3)
    vector[axis] = along
    vector[[own for own in range(3) if own != axis]] = across
    return vector


def _disc(draw, numbers, letter):
    radius, thickness = (*numbers, 0.0, 0.0)[:2]
    if draw.dimensions == 2:
        return radius * draw.ball()
    return _axis(letter, thickness * draw.half()[0], radius * draw.ball(2)[:2])


def _cylinder(draw, numbers, letter):
    length, radius = (*numbers, 0.0, 0.0)[:2]
    return flat(draw, _axis(letter, length * draw.half()[0], radius * draw.ball(2)[:2]))


def _circle(draw, numbers, letter):
    radius, thickness = (*numbers, 0.0, 0.0)[:2]
    angle = draw.generator.uniform(0.0, 2.0 * np.pi)
    around = radius * np.array([np.cos(angle), np.sin(angle)])
    return _axis("Z" if draw.dimensions == 2 else letter, 0.0, around) + 0.5 * thickness * draw.unit()


def _ring(draw, numbers, letter):
    length, radius, thickness = (*numbers, 0.0, 0.0, 0.0)[:3]
    angle, own = draw.generator.uniform(0.0, 2.0 * np.pi), radius * (1.0 + thickness * draw.half()[0])
    return flat(draw, _axis(letter, length * draw.half()[0], own * np.array([np.cos(angle), np.sin(angle)])))


def _arc(draw, numbers, _):
    length, angle = numbers[0], numbers[1] if len(numbers) > 1 else 1.57
    if angle == 0.0:
        return np.array([0.0, length * draw.half()[0], 0.0])
    radius, own = length / angle, angle * draw.half()[0]
    return np.array([radius * np.cos(own) - radius, radius * np.sin(own), 0.0])


def _shell(draw, numbers, _):
    radius, thickness = (*numbers, 0.0, 0.0)[:2]
    return radius * draw.unit() + 0.5 * thickness * draw.unit()


def _line(draw, numbers, _):
    length, thickness = (*numbers, 0.0, 0.0)[:2]
    if draw.dimensions == 2:
        return np.array([length * draw.half()[0], thickness * draw.half()[0], 0.0])
    return _axis("X", length * draw.half()[0], thickness * draw.ball(2)[:2])


def _rectangle(draw, numbers, _):
    return flat(draw, np.array((*numbers, 0.0, 0.0, 0.0)[:3]) * draw.half(3))


def _square(draw, numbers, _):
    return np.array([*((numbers or [1.0])[0] * draw.half(2)), 0.0])


def _ellipse(draw, numbers, _):
    return np.array((*numbers, 0.0, 0.0, 0.0)[:3]) * draw.ball()


def _ellipse_surface(draw, numbers, _):
    return np.array((*numbers, 0.0, 0.0, 0.0)[:3]) * draw.unit()


def _cap(draw, numbers, letter):
    # On a sphere, and no further than a height below its pole.
    radius, height = (*numbers, 0.0)[:2]
    along = max(radius - height * draw.generator.uniform(), -radius)
    across, angle = math.sqrt(radius**2 - along**2), draw.generator.uniform(0.0, 2.0 * np.pi)
    if draw.dimensions == 2:
        return np.array([across if angle < np.pi else -across, along, 0.0])
    return _axis(letter, along, across * np.array([np.cos(angle), np.sin(angle)]))


def _outside_sphere(draw, numbers, _):
    for _ in range(TRIES):
        place = draw.inside()
        if np.linalg.norm(place) >= (*numbers, 0.0)[0]:
            return place
    raise draw.mistake("no place was found outside of that sphere.")


def _equator(draw, numbers, _):
    radius, thickness = (*numbers, *(1.0, 0.0)[len(numbers) :])[:2]
    angle = draw.generator.uniform(0.0, 2.0 * np.pi)
    return flat(draw, np.array([radius * np.cos(angle), radius * np.sin(angle), thickness * draw.half()[0]]))


def _stripe(draw, numbers, _):
    first, last = (*numbers, 0.5)[:2] if numbers else (-0.5, 0.5)
    if draw.space is None:
        raise draw.mistake("a stripe needs a space.")
    place = draw.space.middle + draw.space.half * draw.generator.uniform(-1.0, 1.0, 3)
    place[0] = draw.generator.uniform(min(first, last), max(first, last))
    return place


def _within_plane(draw, numbers, letters):
    place = draw.inside()
    (axis,) = set(range(3)) - {"XYZ".index(letter) for letter in letters}
    place[axis] = numbers[0] if numbers and axis < draw.dimensions else 0.0
    return place


def _along_x(weight):
    def place(draw, numbers, _):
        first, second = (*numbers, -10.0, 10.0)[:2] if numbers else (-10.0, 10.0)
        for _ in range(TRIES):
            own = draw.inside()
            if draw.generator.uniform() < weight(own[0], first, second):
                return own
        raise draw.mistake("no place was found along that gradient.")

    return place


def _gradient(x, first, last):
    share = (x - first) / (last - first) if last != first else 0.0
    return share if 0.0 <= share <= 1.0 else 0.0


def _surface(draw, numbers, _):
    return draw.radius * draw.unit()


def _edge(draw, numbers, _):
    # Within a distance of the surface.
    radius, depth = draw.radius, (*numbers, 1.0)[0]
    least = (1.0 - min(1.0, depth / radius)) ** draw.dimensions
    return radius * draw.generator.uniform(least, 1.0) ** (1.0 / draw.dimensions) * draw.unit()


_PRIMITIVES = {
    "inside": lambda draw, numbers, _: draw.inside(),
    "random": lambda draw, numbers, _: draw.inside(),
    "center": lambda draw, numbers, _: np.zeros(3),
    "origin": lambda draw, numbers, _: np.zeros(3),
    "arc": _arc,
    "cap": _cap,
    "ball": lambda draw, numbers, _: numbers[0] * draw.ball(),
    "circle": _circle,
    "cylinder": _cylinder,
    "disc": _disc,
    "ellipse": _ellipse,
    "ellipse_surface": _ellipse_surface,
    "equator": _equator,
    "line": _line,
    "outside_sphere": _outside_sphere,
    "rectangle": _rectangle,
    "ring": _ring,
    "sphere": _shell,
    "square": _square,
    "stripe": _stripe,
    "surface": _surface,
    "edge": _edge,
    "XY": _within_plane,
    "XZ": _within_plane,
    "YZ": _within_plane,
    "gradient": _along_x(_gradient),
    "exponential": _along_x(lambda x, first, scale: math.exp((first - x) / scale) if x >= first else 0.0),
}
_CHANGES = ("at", "blur", "to", "or", "add", "flip", "turn", "align")
_ON_SPHERES = ("surface", "edge")
_WITH_AXIS = {"cylinder": "X", "disc": "Z", "circle": "Z", "ring": "X", "cap": "Z"}
_NEED_NUMBER = {"ball", "cylinder", "disc", "circle", "sphere", "arc", "line", "rectangle", "ring", "ellipse"}
_NEED_NUMBER |= {"cap", "ellipse_surface"}


def unknown_position(text, space):
    """The word of a position in a Space or none that is not known here, or None."""
    words = Words(split_condition(text)[0])
    if words.numbers() and not words.word:
        return None
    while words.word:
        word = words.take()
        if word == "turn":
            while words.word in ROTATIONS:
                words.take()
                words.numbers(4)
        if word in _CHANGES:
            words.numbers()
            continue
        if _named(word)[0] not in _PRIMITIVES:
            return word
        if word in _ON_SPHERES and (space is None or space.shape != "sphere"):
            return word
        words.numbers()
    return None


def _named(word):
    # "discXZ" is the disc across Y, as Cytosim's documentation has it; "discY" the same, as its source does.
    for name, axis in _WITH_AXIS.items():
        letters = word.removeprefix(name)
        if word.startswith(name) and all(letter in "XYZ" for letter in letters) and len(letters) <= 2:
            if len(letters) == 2:
                letters = (set("XYZ") - set(letters)).pop()
            return name, letters or axis
    return word, word


def draw_position(text, draw):
    """A random point of a POSITION."""
    text, condition = split_condition(text or "inside")
    return draw_where(condition, lambda: _moved(Words(text), draw), draw)


def _moved(words, draw):
    place = _primitive(words, draw)
    while words.word:
        word = words.take()
        if word == "at":
            place = place + words.vector()
        elif word == "add":
            place = place + _primitive(words, draw)
        elif word == "flip":
            place = -place
        elif word == "blur":
            place = place + (words.numbers(1) or [0.0])[0] * flat(draw, draw.generator.normal(size=3))
        elif word == "to":
            return place + (_primitive(words, draw) - place) * draw.generator.uniform()
        elif word == "or":
            other = _primitive(words, draw)
            place = other if draw.generator.uniform() < 0.5 else place
        elif word == "turn":
            place = rotation_of(words, draw) @ place
        elif word == "align":
            place = towards(words.vector(), draw) @ place
        else:
            raise draw.mistake(f"{word!r} in a position is not known here.")
    return place


def _primitive(words, draw):
    if not words.word or words.word[0].isdigit() or words.word[0] in "+-.":
        vector = words.vector()
        if words.word and not words.word[0].isalpha():
            raise draw.mistake(f"{words.word!r} in a position is no number.")
        return flat(draw, vector)
    name, letter = _named(words.take())
    if name not in _PRIMITIVES:
        raise draw.mistake(f"the position {name!r} is not known here.")
    numbers = words.numbers()
    if name in _NEED_NUMBER and not numbers:
        raise draw.mistake(f"the position {name} needs its size.")
    return _PRIMITIVES[name](draw, numbers, letter)


def region_of(text, draw):
    """The region of a POSITION that is one of ours, as a table; None for others, and for points."""
    words = Words(text or "inside")
    name, letter = _named(words.take())
    numbers = words.numbers()
    center = np.zeros(3)
    if words.word == "at":
        words.take()
        center = words.vector()
    if words.word:
        return None
    if name in ("inside", "random"):
        return None if draw.space is None else draw.space.region
    if name == "ball" and numbers:
        if draw.dimensions == 2:
            return disc_region(numbers[0], center=center)
        at = {"center": point(center)} if any(center) else {}
        return {"shape": "sphere", **at, "radius": quantity(numbers[0], "um")}
    if name == "rectangle" and len(numbers) >= draw.dimensions and min(numbers[: draw.dimensions]) > 0.0:
        half = 0.5 * np.array((*numbers[: draw.dimensions], 2.0, 2.0)[:3])
        return {"shape": "box", "lower": point(center - half), "upper": point(center + half)}
    if name == "cylinder" and len(numbers) == 2 and draw.dimensions == 3 and min(numbers) > 0.0:
        return disc_region(numbers[1], numbers[0], center, [int(letter == own) for own in "XYZ"])
    return None


def box_of(text, draw):
    """A region in which first nodes of filaments are, as a table: that of a POSITION, flat or thin ones as well.

    None where it is neither a box nor a sphere.
    """
    space = draw.space
    if text in (None, "inside", "random"):
        if space is None:
            return None
        if draw.dimensions == 3 and space.region is not None:
            return space.region if space.region["shape"] in ("sphere", "box") else None
        if space.shape not in ("square", "periodic", "strip"):
            return None
        return box_around(space.middle, space.half)
    region = region_of(text, draw) if draw.dimensions == 3 else None
    if region is not None and region["shape"] in ("sphere", "box"):
        return region
    words, center = Words(text), np.zeros(3)
    if not words.word[:1].isalpha():
        place = words.vector()
        return None if words.word else box_around(place, np.zeros(3))
    name, letter = _named(words.take())
    numbers = words.numbers()
    if words.word == "at":
        words.take()
        center = words.vector()
    sizes = np.array((*numbers, 0.0, 0.0, 0.0)[:3])
    if words.word or (name in _NEED_NUMBER and not numbers):
        return None
    if name in ("center", "origin"):
        sizes = np.zeros(3)
    elif name in ("line", "cylinder") and sizes[1] == 0.0:
        sizes = _axis(letter if name == "cylinder" else "X", sizes[0], 0.0)
    elif name == "square":
        sizes = np.array([*[numbers[0] if numbers else 1.0] * 2, 0.0])
    elif name != "rectangle":
        return None
    return box_around(center, 0.5 * sizes)


def box_around(center, half):
    """A box as a table, with next to no width where it has none."""
    half = np.maximum(np.abs(half), _THIN)
    return {"shape": "box", "lower": point(center - half), "upper": point(center + half)}


def draw_inside(text, draw, keep=True):
    """A random point of a POSITION that is in the space, if ``keep``; None if there is none."""
    for _ in range(TRIES):
        place = draw_position(text, draw)
        if not keep or draw.space is None or draw.space.inside(place[None])[0]:
            return place
    return None
