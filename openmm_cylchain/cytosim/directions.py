"""Directions and rotations: DIRECTION and ORIENTATION of Cytosim.

After ``doc/sim/placement.md`` and ``src/sim/primitives.cc``.
"""

import math

import numpy as np

from .drawing import Words, draw_where, flat, split_condition
from .grammar import ScriptError
from .settings import as_vector

KEYS = ("direction", "rotation", "orientation")
"""Which keys say how objects are turned; the first one that is there counts."""


class UnknownDirectionError(ScriptError):
    """A direction that is not known here."""


def rotation_of(words, draw):
    """A rotation matrix that Words say, or one that takes x to a vector."""
    word = words.take() if words.word[:1].isalpha() else "vector"
    if word in ("off", "identity", "none"):
        return np.eye(3)
    if word == "random":
        return towards(draw.unit(), draw)
    if word in _AXES and draw.dimensions == 2 and word != "Z":
        raise draw.mistake(f"the rotation about {word} leaves the plane.")
    if word in _AXES:
        (angle,) = words.numbers(1) or [draw.generator.uniform(-np.pi, np.pi)]
        return _about(np.eye(3)["XYZ".index(word)], angle)
    if word in ("axis", "angle", "degree"):
        return _about_axis(word, words, draw)
    if word == "quat":
        return _of_quaternion(np.array(words.numbers(4)), draw)
    if word != "vector":
        raise UnknownDirectionError(draw.line, f"the rotation {word!r} is not known here.")
    return towards(words.vector(), draw)


_AXES = ("X", "Y", "Z")
ROTATIONS = ("off", "identity", "none", "random", "axis", "angle", "degree", "quat", "vector", *_AXES)
"""Words with which rotations begin."""


def _about(axis, angle):
    # Rodrigues' formula.
    across = np.cross(np.eye(3), axis).T
    return np.cos(angle) * np.eye(3) - np.sin(angle) * across + (1.0 - np.cos(angle)) * np.outer(axis, axis)


def _about_axis(word, words, draw):
    # "axis 0 0 1 degree 90", in either order.
    axis, angle = np.array([0.0, 0.0, 1.0]), 0.0
    while word in ("axis", "angle", "degree"):
        if word == "axis":
            axis = words.vector()
        else:
            angle = (words.numbers(1) or [0.0])[0] * (1.0 if word == "angle" else math.pi / 180.0)
        if words.word not in ("axis", "angle", "degree"):
            break
        word = words.take()
    if draw.dimensions == 2:
        axis = np.array([0.0, 0.0, 1.0])
    if not axis.any():
        raise draw.mistake("the axis of a rotation has no direction.")
    return _about(axis / np.linalg.norm(axis), angle)


def _of_quaternion(numbers, draw):
    if len(numbers) != 4 or not numbers.any():
        raise draw.mistake("quat needs four numbers.")
    w, *vector = numbers / np.linalg.norm(numbers)
    length = float(np.linalg.norm(vector))
    return np.eye(3) if length == 0.0 else _about(np.array(vector) / length, 2.0 * math.atan2(length, w))


def draw_orientation(options, place, draw):
    """A rotation matrix of Settings with KEYS, of something at a place."""
    text = options.text(*KEYS, default="random")
    words = Words(text)
    if "direction" not in options and words.word in ROTATIONS:
        return rotation_of(words, draw)
    return frame_of(draw_direction(text, place, draw), np.array([0.0, 0.0, 1.0]))


def draw_second_orientation(options, place, draw):
    """A rotation matrix of places too, which Settings have as a second value; None if they have none."""
    text = options.text(("rotation", 1), ("orientation", 1))
    if text is None:
        return None
    words = Words(text)
    if words.word in ROTATIONS:
        return rotation_of(words, draw)
    return towards(draw_direction(text, place, draw), draw)


def towards(vector, draw):
    """A rotation matrix that takes x to a vector, any of them in space."""
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


def fixed_direction(text):
    """A direction that is the same for all, and whether half have the opposite one; None if it is neither."""
    words = text.split() if text else []
    opposite = bool(words) and words[0] == "parallel"
    words = words[1:] if opposite else words
    # Of letters, Cytosim takes either direction.
    named = {"X": (1, 0, 0), "Y": (0, 1, 0), "Z": (0, 0, 1), "horizontal": (1, 0, 0), "vertical": (0, 1, 0)}
    still = ("off", "identity", "none")
    if len(words) == 1 and words[0] in (*named, *still):
        return named.get(words[0], (1, 0, 0)), words[0] not in still
    try:
        vector = as_vector(" ".join(words), 0, "direction")
    except ScriptError:
        return None
    return (vector, opposite) if any(vector) else None


def draw_direction(text, place, draw):
    """A unit vector of a DIRECTION at a place. ScriptError for one that is not known here."""
    text, condition = split_condition(text or "random")
    return draw_where(condition, lambda: _blurred(text, place, draw), draw)


def _blurred(text, place, draw):
    # One of several, with Gaussian noise across.
    if " or " in text:
        text = text.split(" or ")[int(draw.generator.integers(0, text.count(" or ") + 1))]
    text, _, width = text.partition(" blur ")
    vector = _one_direction(text.strip(), place, draw)
    if width:
        try:
            noise = float(width) * flat(draw, draw.generator.normal(size=3))
        except ValueError:
            raise draw.mistake(f"{width!r} is no number.") from None
        if draw.dimensions == 2:
            return _about(np.array([0.0, 0.0, 1.0]), noise[0]) @ vector
        vector = vector + noise - noise @ vector * vector
    return vector / np.linalg.norm(vector)


def _one_direction(text, place, draw):
    if text == "random":
        return draw.unit()
    fixed = fixed_direction(text)
    if fixed is not None:
        vector, opposite = np.array(fixed[0], dtype=float), fixed[1]
        vector[draw.dimensions :] = 0.0
        if not vector.any():
            raise draw.mistake(f"the direction {text!r} leaves the plane.")
        return vector / np.linalg.norm(vector) * (-1.0 if opposite and draw.generator.uniform() < 0.5 else 1.0)
    words = text.split()
    if not words:
        raise draw.mistake("a direction is empty.")
    if words[0] in ROTATIONS:
        return rotation_of(Words(text), draw)[:, 0]
    if words[-1] in ("XY", "XZ", "YZ") and words[:-1] in ([], ["parallel"]):
        vector = flat(draw, np.array([draw.generator.normal() if own in words[-1] else 0.0 for own in "XYZ"]))
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
