"""Where objects begin: POSITION and DIRECTION of Cytosim (``doc/sim/placement.md``, ``src/sim/primitives.cc``); in um.

Each primitive is a function that draws a point; some are regions as well, within which runs draw places themselves.
"""

import math
from dataclasses import dataclass

import numpy as np

from .document import point, quantity
from .grammar import ScriptError
from .settings import as_vector
from .spaces import disc_region

_TRIES = 2000


class UnknownDirectionError(ScriptError):
    """A direction that is not known here."""


@dataclass
class Draw:
    """What places are drawn with: a Space or None, dimensions, a random generator, and the line of messages."""

    space: object
    dimensions: int
    generator: object
    line: int

    def mistake(self, message):
        """A ScriptError at its line."""
        return ScriptError(self.line, message)

    def half(self, count=1):
        """Uniform between -1/2 and 1/2."""
        return self.generator.uniform(-0.5, 0.5, count)

    def unit(self):
        """A random direction."""
        while True:
            vector = self.generator.normal(size=3)
            vector[self.dimensions :] = 0.0
            length = np.linalg.norm(vector)
            if length > 1e-9:
                return vector / length

    @property
    def radius(self):
        """That of the space, if it is a sphere."""
        if self.space is None or self.space.shape != "sphere":
            raise self.mistake("places on the surface of a space that is no sphere are not known here.")
        return float(self.space.half[0])

    def ball(self, dimensions=None):
        """A random point of the unit ball."""
        count = dimensions or self.dimensions
        while True:
            vector = np.zeros(3)
            vector[:count] = self.generator.uniform(-1.0, 1.0, count)
            if vector @ vector <= 1.0:
                return vector

    def inside(self):
        """A random point of the space."""
        place = None if self.space is None else self.space.draw(self.generator)
        if place is None:
            raise self.mistake("places inside a space are asked for, but there is none whose shape is known here.")
        return place


class _Words:
    # Words and numbers of a position, in turn.
    def __init__(self, text):
        self._words, self._at = text.split(), 0

    @property
    def word(self):
        return self._words[self._at] if self._at < len(self._words) else ""

    def take(self):
        word, self._at = self.word, self._at + 1
        return word

    def numbers(self, most=3):
        found = []
        while len(found) < most and self.word:
            try:
                number = float(self.word)
            except ValueError:
                break
            if not math.isfinite(number):
                break
            found.append(number)
            self._at += 1
        return found

    def vector(self):
        numbers = self.numbers()
        return np.array([*numbers, *[0.0] * (3 - len(numbers))])


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
    return _flat(draw, _axis(letter, length * draw.half()[0], radius * draw.ball(2)[:2]))


def _circle(draw, numbers, letter):
    radius, thickness = (*numbers, 0.0, 0.0)[:2]
    angle = draw.generator.uniform(0.0, 2.0 * np.pi)
    around = radius * np.array([np.cos(angle), np.sin(angle)])
    return _axis("Z" if draw.dimensions == 2 else letter, 0.0, around) + 0.5 * thickness * draw.unit()


def _ring(draw, numbers, letter):
    length, radius, thickness = (*numbers, 0.0, 0.0, 0.0)[:3]
    angle, own = draw.generator.uniform(0.0, 2.0 * np.pi), radius * (1.0 + thickness * draw.half()[0])
    return _flat(draw, _axis(letter, length * draw.half()[0], own * np.array([np.cos(angle), np.sin(angle)])))


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
    return _flat(draw, np.array((*numbers, 0.0, 0.0, 0.0)[:3]) * draw.half(3))


def _square(draw, numbers, _):
    return np.array([*((numbers or [1.0])[0] * draw.half(2)), 0.0])


def _ellipse(draw, numbers, _):
    return np.array((*numbers, 0.0, 0.0, 0.0)[:3]) * draw.ball()


def _equator(draw, numbers, _):
    radius, thickness = (*numbers, *(1.0, 0.0)[len(numbers) :])[:2]
    angle = draw.generator.uniform(0.0, 2.0 * np.pi)
    return _flat(draw, np.array([radius * np.cos(angle), radius * np.sin(angle), thickness * draw.half()[0]]))


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
        for _ in range(_TRIES):
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


def _flat(draw, vector):
    if draw.dimensions == 2:
        vector[2] = 0.0
    return vector


_PRIMITIVES = {
    "inside": lambda draw, numbers, _: draw.inside(),
    "random": lambda draw, numbers, _: draw.inside(),
    "center": lambda draw, numbers, _: np.zeros(3),
    "origin": lambda draw, numbers, _: np.zeros(3),
    "arc": _arc,
    "ball": lambda draw, numbers, _: numbers[0] * draw.ball(),
    "circle": _circle,
    "cylinder": _cylinder,
    "disc": _disc,
    "ellipse": _ellipse,
    "equator": _equator,
    "line": _line,
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
_ON_SPHERES = ("surface", "edge")
_WITH_AXIS = {"cylinder": "X", "disc": "Z", "circle": "Z", "ring": "X"}
_NEED_NUMBER = {"ball", "cylinder", "disc", "circle", "sphere", "arc", "line", "rectangle", "ring", "ellipse"}


def unknown_position(text, space):
    """The word of a position in a Space or none that is not known here, or None."""
    words = _Words(text)
    if words.numbers() and not words.word:
        return None
    while words.word:
        word = words.take()
        if word in ("at", "blur", "to", "or", "add", "flip", "turn", "align", "angle", "degree"):
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
    """A random point of a POSITION, or None if it is not allowed."""
    words = _Words(text or "inside")
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
            place = place + (words.numbers(1) or [0.0])[0] * _flat(draw, draw.generator.normal(size=3))
        elif word == "to":
            return place + (_primitive(words, draw) - place) * draw.generator.uniform()
        elif word == "or":
            other = _primitive(words, draw)
            place = other if draw.generator.uniform() < 0.5 else place
        elif word == "turn":
            place = _rotation(words, draw) @ place
        elif word == "align":
            place = _towards(words.vector(), draw) @ place
        else:
            raise draw.mistake(f"{word!r} in a position is not known here.")
    return place


def _primitive(words, draw):
    if not words.word or words.word[0].isdigit() or words.word[0] in "+-.":
        vector = words.vector()
        if words.word and not words.word[0].isalpha():
            raise draw.mistake(f"{words.word!r} in a position is no number.")
        return _flat(draw, vector)
    name, letter = _named(words.take())
    if name not in _PRIMITIVES:
        raise draw.mistake(f"the position {name!r} is not known here.")
    numbers = words.numbers()
    if name in _NEED_NUMBER and not numbers:
        raise draw.mistake(f"the position {name} needs its size.")
    return _PRIMITIVES[name](draw, numbers, letter)


def _rotation(words, draw):
    # About z by an angle, or what takes x to a vector.
    word = words.take() if words.word[:1].isalpha() else "vector"
    if word in ("angle", "degree"):
        angle = (words.numbers(1) or [0.0])[0] * (1.0 if word == "angle" else math.pi / 180.0)
        cosine, sine = math.cos(angle), math.sin(angle)
        return np.array([[cosine, -sine, 0.0], [sine, cosine, 0.0], [0.0, 0.0, 1.0]])
    if word != "vector":
        raise draw.mistake(f"the rotation {word!r} is not known here.")
    return _towards(words.vector(), draw)


def _towards(vector, draw):
    # A rotation that takes x to a vector, any of them in space.
    if not vector.any():
        raise draw.mistake("the rotation has no direction.")
    return frame_of(vector / np.linalg.norm(vector), np.array([0.0, 0.0, 1.0]) if draw.dimensions == 2 else draw.unit())


def frame_of(direction, up):
    """A rotation matrix that takes x to a unit vector, and z about to another."""
    side = np.cross(up, direction)
    while np.linalg.norm(side) < 1e-6:
        up = up[[2, 0, 1]]
        side = np.cross(up, direction)
    side /= np.linalg.norm(side)
    return np.stack([direction, side, np.cross(direction, side)], axis=1)


def region_of(text, draw):
    """The region of a POSITION that is one of ours, as a table; None for others, and for points."""
    words = _Words(text or "inside")
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


def fixed_direction(text):
    """A direction that is the same for all, and whether half have the opposite one; None if it is neither."""
    words = text.split() if text else []
    opposite = bool(words) and words[0] == "parallel"
    words = words[1:] if opposite else words
    named = {"X": (1, 0, 0), "Y": (0, 1, 0), "Z": (0, 0, 1), "horizontal": (1, 0, 0), "vertical": (0, 1, 0)}
    named |= {"off": (1, 0, 0), "identity": (1, 0, 0)}
    if len(words) == 1 and words[0] in named:
        return named[words[0]], opposite or words[0] in ("horizontal", "vertical")
    try:
        vector = as_vector(" ".join(words), 0, "direction")
    except ScriptError:
        return None
    return (vector, opposite) if any(vector) else None


def draw_direction(text, place, draw):
    """A unit vector of a DIRECTION at a place. ScriptError for one that is not known here."""
    if not text or text == "random":
        return draw.unit()
    if " or " in f" {text} ":
        text = text.split(" or ")[int(draw.generator.integers(0, text.count(" or ") + 1))]
    fixed = fixed_direction(text)
    if fixed is not None:
        vector, opposite = np.array(fixed[0], dtype=float), fixed[1]
        vector[draw.dimensions :] = 0.0
        if not vector.any():
            raise draw.mistake(f"the direction {text!r} leaves the plane.")
        return vector / np.linalg.norm(vector) * (-1.0 if opposite and draw.generator.uniform() < 0.5 else 1.0)
    words = text.split()
    if words[-1] in ("XY", "XZ", "YZ") and words[:-1] in ([], ["parallel"]):
        vector = _flat(draw, np.array([draw.generator.normal() if own in words[-1] else 0.0 for own in "XYZ"]))
        return vector / np.linalg.norm(vector)
    radial = place / np.linalg.norm(place) if np.linalg.norm(place) > 0.0 else draw.unit()
    if words[0] in ("radial", "antiradial"):
        return radial if words[0] == "radial" else -radial
    if words[0] in ("circular", "orthoradial"):
        around = np.cross([0.0, 0.0, 1.0] if draw.dimensions == 2 else draw.unit(), radial)
        return around / np.linalg.norm(around)
    if (
        draw.space is not None
        and draw.space.shape == "sphere"
        and words[0] in ("normal", "outward", "inward", "tangent")
    ):
        if words[0] != "tangent":
            return -radial if words[0] == "inward" else radial
        across = np.cross(np.array([0.0, 0.0, 1.0]) if draw.dimensions == 2 else draw.unit(), radial)
        return across / np.linalg.norm(across)
    if words[0] == "orthogonal" and len(words) > 1:
        across = np.cross(as_vector(" ".join(words[1:]), draw.line, "direction"), draw.unit())
        if np.linalg.norm(across) > 0.0:
            return across / np.linalg.norm(across)
    raise UnknownDirectionError(draw.line, f"the direction {text!r} is not known here.")


def draw_inside(text, draw, keep=True):
    """A random point of a POSITION that is in the space, if ``keep``; None if there is none."""
    for _ in range(_TRIES):
        place = draw_position(text, draw)
        if not keep or draw.space is None or draw.space.inside(place[None])[0]:
            return place
    return None
