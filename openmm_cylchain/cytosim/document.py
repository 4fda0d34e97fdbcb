"""The configuration that is written: tables of keys, values and comments, and what each comment says was done."""

import json
from dataclasses import dataclass, field

EXACT, NEAREST, LEFT_OUT = "exact", "nearest", "left out"
_IN_ONE_LINE = 3


@dataclass(frozen=True)
class Note:
    """What was done with something: EXACT, NEAREST or LEFT_OUT, where it stands, and what it would need, or None."""

    kind: str
    text: str
    line: int | None = None
    needs: str | None = None

    def __str__(self):
        where = "" if self.line is None else f" (line {self.line})"
        return f"{self.kind}{': ' if self.text else ''}{self.text}{where}"


@dataclass
class Table:
    """A table: its header, such as [[filament]], and in turn comments and (key, value, Note or None)."""

    header: str
    line: int | None = None
    entries: list = field(default_factory=list)

    def add(self, key, value, note=None):
        """Add a key with a value that TOML has, and what its comment says."""
        self.entries.append((key, value, note))

    def comment(self, note):
        """Add a line of comment."""
        self.entries.append((None, None, note))

    @property
    def notes(self):
        """All of its Notes."""
        return [note for _, _, note in self.entries if note is not None]

    def value(self, key):
        """That of a key, or None."""
        return next((value for name, value, _ in self.entries if name == key), None)


class Document:
    """Tables in their order, and Notes that belong to none of them."""

    def __init__(self, title):
        self.title, self.tables, self._notes = title, [], []

    def table(self, header, line=None):
        """Add a Table."""
        self.tables.append(Table(header, line))
        return self.tables[-1]

    def note(self, kind, text, line=None, needs=None):
        """Add a Note that belongs to no table."""
        self._notes.append(Note(kind, text, line, needs))

    def tables_called(self, header):
        """Those with a header."""
        return [table for table in self.tables if table.header == header]

    @property
    def notes(self):
        """All Notes, each once."""
        every = [*self._notes, *(note for table in self.tables for note in table.notes)]
        return list(dict.fromkeys(every))

    @property
    def missing(self):
        """What left out things would need, each once."""
        return list(dict.fromkeys(note.needs for note in self.notes if note.needs))

    def text(self):
        """As TOML."""
        lines = [f"title = {_toml(self.title)}"]
        lines += ["", *(f"# {note}" for note in dict.fromkeys(self._notes))] if self._notes else []
        for table in self.tables:
            lines += ["", table.header]
            for key, value, note in table.entries:
                if key is None:
                    lines.append(f"# {_one_line(note)}")
                else:
                    lines.append(f"{key} = {_toml(value)}{'' if note is None else f'  # {_one_line(note)}'}")
        return "\n".join(lines) + "\n"


def quantity(value, unit):
    """A number with a unit, as configurations have it."""
    return f"{value:.12g} {unit}"


def number_in(text):
    """The number of a quantity, whatever its unit."""
    return float(text.split()[0])


def point(vector):
    """Lengths in um."""
    return [quantity(round(float(value), 9) + 0.0, "um") for value in vector]


def _one_line(note):
    return " ".join(str(note).split())


def _toml(value):
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
    if isinstance(value, (list, tuple)) and len(value) > _IN_ONE_LINE and isinstance(value[0], (list, tuple)):
        return "[\n" + "".join(f"    {_toml(own)},\n" for own in value) + "]"
    if isinstance(value, (list, tuple)):
        return f"[{', '.join(map(_toml, value))}]"
    if isinstance(value, dict):
        return f"{{ {', '.join(f'{key} = {_toml(own)}' for key, own in value.items())} }}"
    return f"{value:.12g}" if isinstance(value, float) else repr(value)
