"""Settings of a property or of a command: values by keys, which know their lines and which of them were asked for."""

import math

from .grammar import Block, ScriptError, read_pairs

IGNORED = frozenset(
    (
        *("display", "verbose", "precondition", "precond", "tolerance", "acceptable_prob", "binding_grid_step"),
        *("steric_max_range", "save_unbound", "save_lattice", "lattice", "lattice_unit", "mark", "nb_frames", "prune"),
        *("system_file", "property_file", "skip_free_single", "skip_free_couple", "nb_trials", "required", "flag"),
        *("label", "footprint", "site_shift"),
    )
)
"""Keys that change nothing of what is computed here: displays, files and numerical methods."""


OFF = (None, "0", "off", "none")
"""What a key has whose feature is off."""
CONFINED = ("inside", "all_inside", "1")
"""What confine has of what is held within a space."""


class Settings:
    """Values by keys, each a list of texts."""

    def __init__(self, label, line):
        self.label, self.line = label, line
        self._values, self._lines, self._used = {}, {}, set()

    @classmethod
    def of(cls, label, line, block):
        """Those of a Block, or none without one."""
        settings = cls(label, line)
        if block is not None:
            settings.read(block)
        return settings

    def read(self, block):
        """Take what a Block sets; values that it does not give stay."""
        for key, values, line in read_pairs(block):
            self.set(key, values, line)

    def set(self, key, values, line):
        """Take values of a key."""
        self._values[key] = list(values) + self._values.get(key, [])[len(values) :]
        self._lines[key] = line

    def __contains__(self, key):
        return key in self._values

    def peek(self, key):
        """The first value of a key, or None; it does not count as asked for."""
        return next(iter(self._values.get(key, [])), None)

    def values(self, key):
        """All values of a key; none if it is not there."""
        self._used.add(key)
        return self._values.get(key, [])

    def line_of(self, key):
        """Where a key stands."""
        return self._lines.get(key, self.line)

    def text(self, *places, default=None):
        """The first value that is there of some places, each a key or (key, index)."""
        found = default
        for place in reversed(places):
            key, index = place if isinstance(place, tuple) else (place, 0)
            values = self.values(key)
            if len(values) > index and values[index]:
                found = values[index]
        return found

    def number(self, *places, default=None):
        """The same as a number; "inf" is one. ScriptError for anything else."""
        text = self.text(*places)
        return default if text is None else as_number(text, self._line_among(places), self._what(places))

    def vector(self, key, index=0, default=None):
        """Three numbers; what is not given is zero. ScriptError if a key that is there has no such value."""
        text = self.text((key, index))
        if text is None and default is None and key in self:
            raise self.mistake(key, f"must have a vector, as in {key} = 1 0 0")
        return default if text is None else as_vector(text, self.line_of(key), f"{key} of {self.label}")

    def flag(self, *places, default=False):
        """Whether a number is not zero."""
        value = self.number(*places, default=None)
        return default if value is None else value != 0

    def confining_space(self, key="confine"):
        """The name of the space that confines it by a key, or None for the first one."""
        name = self.text((key, 2), f"{key}_spec", f"{key}_space")
        return None if name in ("first", "last") else name

    def unused(self):
        """(key, values, line) of all that was not asked for and that is not ignored, if anything was asked for."""
        if not self._used:
            return
        for key, values in self._values.items():
            if key not in self._used and key not in IGNORED:
                yield key, values, self._lines[key]

    def take_rest(self):
        """Take all keys as asked for: what they mean is left out as a whole, which is said elsewhere."""
        self._used.update(self._values)

    def mistake(self, key, message):
        """A ScriptError about a key."""
        return ScriptError(self.line_of(key), f"{key} of {self.label} {message}")

    def block(self, key, index=0):
        """A value that is settings of its own, as a Block; None if it is not there."""
        text = self.text((key, index))
        return None if text is None else Block(text, self.line_of(key))

    def _line_among(self, places):
        keys = [place[0] if isinstance(place, tuple) else place for place in places]
        return next((self._lines[key] for key in keys if key in self._lines), self.line)

    def _what(self, places):
        keys = [place[0] if isinstance(place, tuple) else place for place in places]
        return f"{next((key for key in keys if key in self._values), keys[0])} of {self.label}"


def as_number(text, line, what):
    """A text as a number, of which nan is none."""
    try:
        number = float(text)
    except ValueError:
        number = math.nan
    if math.isnan(number):
        raise ScriptError(line, f"{what} must be a number, but is {text!r}.")
    return number


def as_vector(text, line, what):
    """A text of one to three numbers as a tuple of three."""
    parts = text.split()
    if not 1 <= len(parts) <= 3:
        raise ScriptError(line, f"{what} must be a vector, as in 1 0 0, but is {text!r}.")
    numbers = [as_number(part, line, what) for part in parts]
    if not all(map(math.isfinite, numbers)):
        raise ScriptError(line, f"{what} must be finite, but is {text!r}.")
    return (*numbers, *(0.0,) * (3 - len(numbers)))
