"""Tables of a configuration: the keys that each kind has, and the entries that were read from one."""

import contextlib
import re
from dataclasses import dataclass

from ..errors import InputError
from .keys import REQUIRED, ConfigurationError, Flag, Key, Place, close_match

ACTIVE = Key("active", Flag("false"), True, "Whether it is there; a `[[stage]]` can change that.")
"""A key of tables that may be there in some stages of a run alone."""


class UnknownKeyError(ConfigurationError):
    """A key that a table does not have, beside the names of those that it has."""

    def __init__(self, place, name, names, value=None):
        super().__init__(f"{place.name} has an unknown key {name!r}.", (*place.path, name))
        self.name = name
        self.names = names
        self.value = value

    def with_suggestion(self, others):
        """The same with what would be right: where else a key of that name belongs to, or one with a similar name."""
        for other in others:
            if other.name == self.name and not other.owner and isinstance(self.value, (dict, list)):
                return ConfigurationError(f"{self} It is a table of its own: write {other.header}.", self.path)
        for other in others:
            if other.names != self.names and self.name in other.names:
                return ConfigurationError(f"{self} It belongs to {other.owner or other.header}.", self.path)
        known = close_match(self.name, self.names) or f" Known are {', '.join(self.names)}."
        return ConfigurationError(f"{self}{known}", self.path)


class Entries:
    """What was read from one table: ``entries["segments"]``; the default if it was not ``given``."""

    def __init__(self, kind, values, place):
        self.kind = kind
        self.place = place
        self._values = values
        self._defaults = {key.name: key.default for key in kind.keys}

    @property
    def label(self):
        """What messages call the table."""
        return self.place.name

    @property
    def values(self):
        """All values by their keys, defaults among them, for comparisons."""
        plain = {name: self[name] for name in self._defaults}
        return {name: value.values if isinstance(value, Entries) else value for name, value in plain.items()}

    def __getitem__(self, name):
        return self._values.get(name, self._defaults[name])

    def __contains__(self, name):
        return name in self._values

    def __eq__(self, other):
        return isinstance(other, Entries) and self.values == other.values

    __hash__ = None

    def given(self, *names):
        """Those of some keys that the table has, by name."""
        return {name: self._values[name] for name in names if name in self._values}

    def at(self, name):
        """The Place of a key."""
        return self.place_of(self.place, name)

    @staticmethod
    def place_of(place, name):
        return Place(f"{place.name} {name}", (*place.path, name))

    def error(self, message):
        """A ConfigurationError about the table as a whole."""
        return self.place.error(message)

    def require(self, *names):
        """Raise ConfigurationError unless the table has all of these keys."""
        for key in self.kind.keys:
            if key.name in names and key.name not in self._values:
                raise self.error(f"lacks the key {key.name!r}: add a line such as {key.line}")

    def refuse(self, names, reason):
        """Raise ConfigurationError if the table has one of these keys."""
        for name in names:
            if name in self._values:
                raise self.at(name).error(reason)

    def only_one(self, *names):
        """Raise ConfigurationError if the table has several of these keys."""
        found = [name for name in names if name in self._values]
        if len(found) > 1:
            raise self.at(found[1]).error(f"and {found[0]} say the same: give one of them.")

    @contextlib.contextmanager
    def naming(self):
        """Give the place of this table to an InputError: that of a key, if it names one and no other."""
        try:
            yield
        except ConfigurationError:
            raise
        except InputError as error:
            message = str(error)
            named = {name for name in self._values if re.search(rf"\b{name}\b", message)}
            path = (*self.place.path, *named) if len(named) == 1 else self.place.path
            # Messages may begin with the name of the table, with or without its colon.
            text = message if message.startswith(self.label.rstrip(":")) else f"{self.label} {message}"
            raise ConfigurationError(text, path) from None


@dataclass(frozen=True)
class TableKind:
    """A kind of table: ``[name]``, ``[[name]]`` if it is repeated, or one within another table.

    ``text`` is what the reference says of it; ``owner`` what messages call it where a key belongs to it. ``borrowed``
    are keys of another table, of which the reference only says their names.
    """

    name: str
    keys: tuple[Key, ...]
    text: str = ""
    repeated: bool = False
    owner: str = ""
    required: bool = False
    borrowed: tuple[str, ...] = ()

    @property
    def header(self):
        """As it is written: [name], or [[name]] where there may be several."""
        return f"[[{self.name}]]" if self.repeated else f"[{self.name}]"

    @property
    def names(self):
        """Names of its keys."""
        return tuple(key.name for key in self.keys)

    def read(self, table, place):
        """Entries of a table that tomllib has read."""
        kinds = {key.name: key for key in self.keys}
        values = {}
        for name, value in table.items():
            own = Entries.place_of(place, name)
            if name not in kinds:
                raise UnknownKeyError(place, name, self.names, value)
            values[name] = kinds[name].kind.read(value, own)
        entries = Entries(self, values, place)
        entries.require(*(key.name for key in self.keys if key.default is REQUIRED))
        return entries

    def schema(self):
        """What a JSON schema says of such a table."""
        required = [key.name for key in self.keys if key.default is REQUIRED]
        content = {
            "type": "object",
            "properties": {key.name: {"description": key.text, **key.kind.schema()} for key in self.keys},
            "additionalProperties": False,
        }
        return {**content, **({"required": required} if required else {})}


def group_of(number, groups):
    """The group of a table that has a filament or body, by the number of this in the file."""
    for group in groups:
        if number < group.count:
            return group
        number -= group.count
    raise IndexError(number)
