"""What tomllib makes of a text, and in which line of it each table, key and item of a list stands.

tomllib does not say where. The text is walked through once more, and what is found must be just what tomllib has read:
otherwise there are no lines at all, because a wrong one is worse than none.
"""

import bisect
import re
import sys

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

from ..errors import InputError

_BLANK = re.compile(r"(?:[ \t\r\n]|#[^\n]*)*")
_SPACE = re.compile(r"[ \t]*")
_BARE = re.compile(r"[A-Za-z0-9_-]+")
_STRING = re.compile(
    r'"""(?:\\.|[^\\])*?"{3,5}|\'\'\'.*?\'{3,5}|"(?:\\.|[^"\\])*"|\'[^\']*\'',
    re.DOTALL,
)
_PLAIN = re.compile(r"[^,\]}#\n]+")
_TWICE = re.compile(r"(?:Cannot|Duplicate).*\(at line (\d+), column \d+\)")
_DEFINED = re.compile(r"\s*(?:(?P<table>\[\[?[^\[\]]*\]\]?)|(?P<key>[\w.\"'-]+)\s*=)")


def read_toml(text):
    """What tomllib makes of a text with line ends that are a line feed; InputError if it is not TOML."""
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        twice = _TWICE.search(str(error))
        if twice is None:
            raise InputError(f'not valid TOML: {error}. Texts, quantities among them, need quotes: "360 nm".') from None
        raise InputError(f"line {twice[1]}: {_said_twice(str(error), text.splitlines()[int(twice[1]) - 1])}") from None
    except (ValueError, RecursionError) as error:
        # Numbers of thousands of digits, and lists within lists.
        raise InputError(f"not valid TOML: {error}.") from None


def _said_twice(error, line):
    key = re.search(r"inline table key '(.*)'", error)
    defined = _DEFINED.match(line)
    if key or not defined:
        name = f"the key {key[1]!r}" if key else "a key"
        return f"{name} stands twice between the same braces: give it once."
    if defined["table"]:
        return (
            f"{defined['table']} has come before: give a table once, and each one of a list of tables with two "
            "brackets, as in [[filament]]."
        )
    return f"the key {defined['key']!r} has come before in the same table: give it once."


def lines_of(text, entries):
    """Lines, counted from 1, by paths such as ("filament", 0, "segments"); empty if they cannot be told.

    ``text`` is valid TOML with line ends that are a line feed, and ``entries`` what tomllib made of it.
    """
    walk = _Walk(text)
    try:
        walk.document()
    except (AttributeError, LookupError, tomllib.TOMLDecodeError):
        return {}
    return walk.lines if set(walk.lines) == set(_paths(entries, ())) else {}


def line_of(lines, path):
    """The line of a path, or of the nearest table or key around it; None if there is none."""
    for length in range(len(path), 0, -1):
        if path[:length] in lines:
            return lines[path[:length]]
    return None


def _paths(value, path):
    if path:
        yield path
    if isinstance(value, (dict, list)):
        for key, item in value.items() if isinstance(value, dict) else enumerate(value):
            yield from _paths(item, (*path, key))


class _Walk:
    def __init__(self, text):
        self._text = text
        self._ends = [match.start() for match in re.finditer("\n", text)]
        self._at = 0
        self._counts = {}  # of tables in lists of tables
        self.lines = {}

    def document(self):
        table = ()
        self._skip(_BLANK)
        while self._at < len(self._text):
            if self._text[self._at] == "[":
                table = self._header()
            else:
                self._pair(table)
            self._skip(_BLANK)

    def _header(self):
        start, width = self._at, 2 if self._text.startswith("[[", self._at) else 1
        self._at += width
        key = self._key()
        self._at += width
        if width == 1:
            return self._resolved(key, start)
        path = (*self._resolved(key[:-1], start), key[-1])
        number = self._counts.get(path, 0)
        self._counts[path] = number + 1
        self._note(path, start)
        self._note((*path, number), start)
        return (*path, number)

    def _resolved(self, key, start):
        # The path of a header, in which a list of tables stands for its last one.
        path = ()
        for part in key:
            path = (*path, part)
            self._note(path, start)
            if path in self._counts:
                path = (*path, self._counts[path] - 1)
        return path

    def _pair(self, table):
        start, path = self._at, table
        for part in self._key():
            path = (*path, part)
            self._note(path, start)
        self._at += 1  # the sign of equality
        self._value(path)

    def _key(self):
        parts = []
        while True:
            self._skip(_SPACE)
            if self._text[self._at] in "\"'":
                (part,) = tomllib.loads(f"{self._take(_STRING)} = 0")
            else:
                part = self._take(_BARE)
            parts.append(part)
            self._skip(_SPACE)
            if self._text[self._at] != ".":
                return parts
            self._at += 1

    def _value(self, path):
        self._skip(_SPACE)
        sign = self._text[self._at]
        if sign in "\"'":
            self._take(_STRING)
        elif sign in "[{":
            self._items(path, sign)
        else:
            self._take(_PLAIN)

    def _items(self, path, sign):
        self._at += 1
        number = 0
        while True:
            self._skip(_BLANK)
            if self._text[self._at] in "]}":
                self._at += 1
                return
            if sign == "{":
                self._pair(path)
            else:
                self._note((*path, number), self._at)
                self._value((*path, number))
            number += 1
            self._skip(_BLANK)
            if self._text[self._at] == ",":
                self._at += 1

    def _note(self, path, start):
        self.lines.setdefault(path, bisect.bisect_left(self._ends, start) + 1)

    def _skip(self, pattern):
        self._at = pattern.match(self._text, self._at).end()

    def _take(self, pattern):
        match = pattern.match(self._text, self._at)
        self._at = match.end()
        return match[0]
