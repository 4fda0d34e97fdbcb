"""What places and directions are drawn with: dimensions, a space, a random generator, and words of texts."""

import math
from dataclasses import dataclass

import numpy as np

from ..errors import InputError
from .arithmetic import evaluate
from .grammar import ScriptError

TRIES = 2000
_CONDITION = " if "


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


class Words:
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


def flat(draw, vector):
    """A vector, in the plane in two dimensions."""
    if draw.dimensions == 2:
        vector[2] = 0.0
    return vector


def split_condition(text):
    """A text, and the condition behind it or none."""
    text, _, condition = text.partition(_CONDITION)
    return text, condition


def draw_where(condition, drawn, draw):
    """The first vector that is drawn for which a condition in X, Y, Z and S, along the diagonal, is right."""
    for _ in range(TRIES if condition else 1):
        place = drawn()
        names = dict(zip("XYZ", map(float, place)), S=float(place.sum()) / math.sqrt(draw.dimensions))
        try:
            if not condition or evaluate(condition, names):
                return place
        except InputError as error:
            raise draw.mistake(str(error)) from None
    raise draw.mistake(f"nothing was found for which {condition}.")
