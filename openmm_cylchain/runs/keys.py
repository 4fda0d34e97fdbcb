"""Kinds of values that keys of a configuration have: how each is read and checked, and what a JSON schema says of it.

Each kind has ``read(value, place)``, which returns plain numbers in OpenMM's units or raises a ``ConfigurationError``;
``schema()``; ``example``, as it is written in TOML; and ``text``, what it is called in the reference.
"""

import datetime
import difflib
import math
from dataclasses import dataclass, field

from ..errors import InputError
from ..units import quantities as units
from ..units.text import example as example_of
from ..units.text import kind_of, parse_quantity
from .toml_lines import line_of

_LONGEST_VALUE = 200

REQUIRED = object()
"""The default of a key that must be given."""

# Beyond these, in OpenMM's units, nothing that filaments do is computed rightly, and most are slips of a unit.
_RANGES = {
    units.LENGTH: (1e-6, 1e9),
    units.TIME: (1e-9, 1e21),
    units.TEMPERATURE: (1e-6, 1e5),
    units.VISCOSITY: (1e-3, 1e15),
    units.STIFFNESS: (1e-12, 1e12),
    units.FORCE: (1e-12, 1e9),
    units.BENDING_RIGIDITY: (1e-9, 1e15),
    units.FRICTION: (1e-9, 1e21),
    units.DIFFUSION: (1e-21, 1e9),
    units.MASS: (1e-6, 1e21),
    units.ROTATIONAL_FRICTION: (1e-12, 1e30),
    units.MASS_PER_LENGTH: (1e-9, 1e15),
    units.RATE: (1e-27, 1e6),
    units.ON_RATE: (1e-18, 1e3),
    units.RATE_PER_LENGTH: (1e-30, 1e6),
    units.RATE_PER_VOLUME: (1e-40, 1e6),
    units.VELOCITY: (1e-24, 1e6),
    units.VOLUME: (1e-18, 1e27),
    units.NUMBER_DENSITY: (1e-27, 1e6),
    units.ENERGY: (1e-9, 1e12),
    units.ANGLE: (1e-9, 1e3),
    units.ANGLE_PER_LENGTH: (1e-12, 1e3),
}

_UNSIGNED = r"\+?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?\s*(\s1\s*/|[(°A-Za-zµμÅ]).*"


class ConfigurationError(InputError):
    """A mistake in a configuration; ``path`` says in which table and at which key: ("filament", 0, "segments")."""

    def __init__(self, message, path=()):
        super().__init__(message)
        self.path = path

    def with_line(self, lines, file=""):
        """The same with its file and line in front, as far as they are known.

        ``lines`` are those of ``toml_lines.lines_of``.
        """
        line = line_of(lines, self.path)
        if line is None and not file:
            return self
        return LocatedError(f"{place_in_words(file, line)}: {self}")


class LocatedError(ConfigurationError):
    """A mistake whose message begins with its line, and its file if there is one."""

    def with_line(self, lines, file=""):
        """The same."""
        return self


def place_in_words(file, line):
    """A file and a line, either of which may be missing (empty, or None)."""
    return ", ".join([*([str(file)] if file else []), *([] if line is None else [f"line {line}"])])


@dataclass(frozen=True)
class Place:
    """Where a value stands: what messages call it, and its path."""

    name: str
    path: tuple

    def error(self, message):
        """A ConfigurationError that begins with the name of this place."""
        return ConfigurationError(f"{self.name} {message}", self.path)

    def item(self, index):
        """The place of an item of a list."""
        return Place(f"{self.name}[{index}]", (*self.path, index))


@dataclass(frozen=True)
class Key:
    """A key of a table: its kind, its default and a sentence about it."""

    name: str
    kind: object
    default: object = None
    text: str = ""

    @property
    def line(self):
        """How the key is written, such as ``segments = 64``."""
        return f"{self.name} = {self.kind.example}"


def as_written(value):
    """A value that tomllib has read, about as the file has it, in a line that is not too long."""
    text = _in_toml(value)
    return text if len(text) <= _LONGEST_VALUE else f"{text[:_LONGEST_VALUE]}..."


def _in_toml(value):
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, (datetime.date, datetime.time)):
        return value.isoformat()
    if isinstance(value, list):
        return f"[{', '.join(map(_in_toml, value))}]"
    if isinstance(value, dict):
        return f"{{ {', '.join(f'{name} = {_in_toml(own)}' for name, own in value.items())} }}" if value else "{}"
    return repr(value)


def close_match(text, choices):
    """A sentence that names the choice that is nearest to a text, or nothing."""
    close = difflib.get_close_matches(str(text), list(choices), n=1)
    return f" Did you mean {close[0]!r}?" if close else ""


@dataclass(frozen=True)
class Quantity:
    """A text with a number and a unit; ``least`` is "positive", "zero" (which is allowed then) or "any"."""

    unit: object
    least: str = "positive"

    @property
    def example(self):
        return f'"{example_of(self.unit)}"'

    @property
    def text(self):
        return kind_of(self.unit)

    def read(self, value, place):
        if not isinstance(value, str):
            raise place.error(
                f"must be a text with a number and a unit, as in {self.example}, but is {as_written(value)}."
            )
        try:
            number = parse_quantity(value, self.unit, place.name)
        except InputError as error:
            raise ConfigurationError(str(error), place.path) from None
        if self.least != "any" and (number < 0 or (number == 0 and self.least == "positive")):
            raise place.error(f'must be {"zero or " if self.least == "zero" else ""}positive, but is "{value}".')
        smallest, largest = _RANGES[self.unit]
        if number and not smallest <= abs(number) <= largest:
            raise place.error(
                f'is "{value}", which is too {"small" if abs(number) < smallest else "large"} to be simulated: write a '
                f"{self.text} as in {self.example}."
            )
        return number

    def schema(self):
        sign = "-?" if self.least == "any" else ""
        return {"type": "string", "pattern": rf"^\s*{sign}{_UNSIGNED}$", "examples": [self.example.strip('"')]}


@dataclass(frozen=True)
class WordOrQuantity:
    """One of some words, or a quantity."""

    words: tuple
    unit: object

    @property
    def example(self):
        return f'"{self.words[0]}"'

    @property
    def text(self):
        return f"{' or '.join(f'`{word!r}`' for word in self.words)}, or a {kind_of(self.unit)}".replace("'", '"')

    def read(self, value, place):
        if isinstance(value, str) and value in self.words:
            return value
        return Quantity(self.unit).read(value, place)

    def schema(self):
        return {"anyOf": [{"enum": list(self.words)}, Quantity(self.unit).schema()]}


@dataclass(frozen=True)
class Whole:
    """A whole number in a range."""

    minimum: int
    maximum: int | None = None
    example: str = "64"
    text = "a whole number"

    def read(self, value, place):
        if isinstance(value, bool) or not isinstance(value, int):
            raise place.error(f"must be a whole number, but is {as_written(value)}.")
        if value < self.minimum:
            raise place.error(f"must be at least {self.minimum}, but is {value}.")
        if self.maximum is not None and value > self.maximum:
            raise place.error(f"must be at most {self.maximum}, but is {value}.")
        return value

    def schema(self):
        limits = {"minimum": self.minimum} | ({} if self.maximum is None else {"maximum": self.maximum})
        return {"type": "integer", **limits}


@dataclass(frozen=True)
class Number:
    """A finite number without a unit."""

    example: str = "1.0"
    text = "a number"

    def read(self, value, place):
        if isinstance(value, bool) or not isinstance(value, (int, float)) or not math.isfinite(value):
            raise place.error(f"must be a finite number without a unit, but is {as_written(value)}.")
        if value and not 1e-15 <= abs(value) <= 1e15:
            raise place.error(f"must be zero or between 1e-15 and 1e15 in size, but is {as_written(value)}.")
        return float(value)

    def schema(self):
        return {"type": "number", "minimum": -1e15, "maximum": 1e15}


@dataclass(frozen=True)
class Text:
    """Any text without line breaks."""

    example: str = '"..."'
    text = "a text"

    def read(self, value, place):
        if not isinstance(value, str):
            raise place.error(f"must be a text in quotes, but is {as_written(value)}.")
        if any(not character.isprintable() for character in value):
            raise place.error(f"must be one line of printable characters, but is {as_written(value)}.")
        return value

    def schema(self):
        return {"type": "string", "pattern": r"^[^\n\r\t]*$"}


@dataclass(frozen=True)
class Choice:
    """One of some words."""

    words: tuple

    @property
    def example(self):
        return f'"{self.words[0]}"'

    @property
    def text(self):
        return "one of " + ", ".join(f'`"{word}"`' for word in self.words)

    def read(self, value, place):
        if not isinstance(value, str):
            raise place.error(f"must be a text in quotes, but is {as_written(value)}.")
        if value not in self.words:
            raise place.error(
                f"must be one of {', '.join(self.words)}, but is {as_written(value)}.{close_match(value, self.words)}"
            )
        return value

    def schema(self):
        return {"enum": list(self.words)}


@dataclass(frozen=True)
class Flag:
    """True or false."""

    example: str = "true"
    text = "true or false"

    def read(self, value, place):
        if not isinstance(value, bool):
            raise place.error(f"must be true or false, without quotes, but is {as_written(value)}.")
        return value

    def schema(self):
        return {"type": "boolean"}


@dataclass(frozen=True)
class Triple:
    """A list of three numbers or quantities."""

    kind: object
    example: str = '["0 nm", "0 nm", "0 nm"]'
    not_zero: bool = False
    positive: bool = False

    @property
    def text(self):
        return f"three of {self.kind.text}"

    def read(self, value, place):
        if not isinstance(value, list) or len(value) != 3:
            raise place.error(f"must be a list of three, as in {self.example}, but is {as_written(value)}.")
        items = tuple(self.kind.read(item, place.item(index)) for index, item in enumerate(value))
        if self.not_zero and items == (0.0, 0.0, 0.0):
            raise place.error("must not be the zero vector.")
        if self.positive and min(items) <= 0.0:
            raise place.error(f"must be positive, but are {value}.")
        return items

    def schema(self):
        items = Quantity(self.kind.unit).schema() if self.positive else self.kind.schema()
        return {"type": "array", "items": items, "minItems": 3, "maxItems": 3}


def point():
    """Three lengths."""
    return Triple(Quantity(units.LENGTH, "any"))


def direction():
    """Three numbers that are not all zero."""
    return Triple(Number(), "[1, 0, 0]", not_zero=True)


@dataclass(frozen=True)
class Listing:
    """A list of values of one kind; ``what`` they are is for messages."""

    kind: object
    what: str
    example: str
    least: int = 1

    @property
    def text(self):
        return f"a list of {self.what}"

    def read(self, value, place):
        if not isinstance(value, list) or len(value) < self.least:
            raise place.error(f"must be a list of {self.what}, as in {self.example}, but is {as_written(value)}.")
        return tuple(self.kind.read(item, place.item(index)) for index, item in enumerate(value))

    def schema(self):
        return {"type": "array", "items": self.kind.schema(), "minItems": self.least}


@dataclass(frozen=True)
class Named:
    """Values of one kind by names of your own, in a table within another one."""

    kind: object
    what: str
    example: str

    @property
    def text(self):
        return f"a table of {self.what}"

    def read(self, value, place):
        if not isinstance(value, dict):
            raise place.error(f"must be a table of {self.what}, as in {self.example}, but is {as_written(value)}.")
        return {
            name: self.kind.read(own, Place(f"{place.name} {name!r}", (*place.path, name)))
            for name, own in value.items()
        }

    def schema(self):
        return {"type": "object", "additionalProperties": self.kind.schema()}


@dataclass(frozen=True)
class Either:
    """A value of the first kind that takes it: ``(type, kind)`` in turn, the last one if none does."""

    kinds: tuple

    @property
    def example(self):
        return self.kinds[0][1].example

    @property
    def text(self):
        return ", or ".join(kind.text for _, kind in self.kinds)

    def read(self, value, place):
        for accepted, kind in self.kinds:
            if isinstance(value, accepted):
                return kind.read(value, place)
        return self.kinds[-1][1].read(value, place)

    def schema(self):
        return {"anyOf": [kind.schema() for _, kind in self.kinds]}


@dataclass(frozen=True)
class Inline:
    """A table within a table: ``{ ... }`` or one with a header of its own."""

    table: object
    example: str = "{ ... }"

    @property
    def text(self):
        return "a table"

    def read(self, value, place):
        if not isinstance(value, dict):
            name = place.path[-1]
            example = f"{name} = {self.example}" if isinstance(name, str) else self.example
            raise place.error(f"must be a table, as in {example}, but is {as_written(value)}.")
        return self.table.read(value, place)

    def schema(self):
        return self.table.schema()


@dataclass(frozen=True)
class Pair:
    """A list of two tables of one kind."""

    table: object
    example: str = "[{ ... }, { ... }]"
    text: str = field(default="a list of two tables")

    def read(self, value, place):
        if not isinstance(value, list) or len(value) != 2 or not all(isinstance(own, dict) for own in value):
            raise place.error(f"must be a list of two tables, as in {self.example}, but is {as_written(value)}.")
        return tuple(self.table.read(own, place.item(index)) for index, own in enumerate(value))

    def schema(self):
        return {"type": "array", "items": self.table.schema(), "minItems": 2, "maxItems": 2}
