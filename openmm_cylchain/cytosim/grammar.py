"""The language of Cytosim's configurations: commands, and settings in their blocks, each with its line.

After the documentation of Cytosim (F. Nedelec and others, gitlab.com/f-nedelec/cytosim): ``doc/sim/config.md`` and
``commands.md``.
"""

import bisect
import re
from dataclasses import dataclass

from ..errors import InputError

_WORD = re.compile(r"[A-Za-z]\w*")
_CLOSING = {"{": "}", "(": ")", "[": "]", '"': '"'}
_MOST_SHOWN = 40


class ScriptError(InputError):
    """A mistake in a configuration of Cytosim, whose message begins with its line."""

    def __init__(self, line, message):
        super().__init__(f"line {line}: {message}")


@dataclass(frozen=True)
class Block:
    """What is between brackets, and the line on which it begins."""

    text: str
    line: int


@dataclass(frozen=True)
class Command:
    """A command: its verb, the words after it, its block in { } or None, that in ( ) or None, and its line."""

    verb: str
    words: tuple
    block: Block | None
    position: Block | None
    line: int


def read_commands(text, line=1):
    """A list of Commands. ScriptError for text that is none."""
    reader, commands = _Reader(text, line), []
    while reader.skip(blank=True):
        if reader.sign == ";":
            reader.at += 1
            continue
        commands.append(_command(reader))
    return commands


def read_pairs(block):
    """Key, values and line of each setting in a Block; values are texts, without the parentheses around them."""
    reader = _Reader(block.text, block.line)
    while reader.skip(blank=True):
        if reader.sign in ";,":
            reader.at += 1
            continue
        line = reader.line
        key = reader.take(_WORD)
        if key is None:
            raise ScriptError(line, f"expected the name of a parameter, but found {reader.shown()}.")
        reader.skip()
        if reader.sign != "=":
            raise ScriptError(line, f'expected "=" after {key}, but found {reader.shown()}.')
        reader.at += 1
        yield key, _values(reader), line


class _Reader:
    """A text, and how far it has been read."""

    def __init__(self, text, line):
        self.text, self.at, self._first = text, 0, line
        self._ends = [match.start() for match in re.finditer("\n", text)]

    @property
    def line(self):
        return self._first + bisect.bisect_left(self._ends, self.at)

    @property
    def sign(self):
        return self.text[self.at : self.at + 1]

    def shown(self):
        """What follows, for a message."""
        rest = self.text[self.at :].split("\n", 1)[0].strip()
        return repr(rest if len(rest) <= _MOST_SHOWN else f"{rest[:_MOST_SHOWN]}...") if rest else "the end of the line"

    def skip(self, blank=False):
        """Skip spaces, and comments and ends of lines too if ``blank``; whether anything is left."""
        while self.at < len(self.text):
            if blank and (self.sign == "%" or self.text.startswith("/*", self.at)):
                self.skip_comment()
            elif self.sign.isspace() and (blank or self.sign != "\n"):
                self.at += 1
            else:
                return True
        return False

    def skip_comment(self):
        if self.text.startswith("%{", self.at):
            self.at += 1
            self.bracket()
        elif self.sign == "/":
            end = self.text.find("*/", self.at + 2)
            if end < 0:
                raise ScriptError(self.line, '"/*" has no "*/" that closes it.')
            self.at = end + 2
        else:
            end = self.text.find("\n", self.at)
            self.at = len(self.text) if end < 0 else end

    def take(self, pattern):
        match = pattern.match(self.text, self.at)
        if match is None:
            return None
        self.at = match.end()
        return match[0]

    def bracket(self):
        """The Block of the bracket that begins here; brackets in it are in pairs."""
        line, opening, start = self.line, self.sign, self.at + 1
        waiting = [_CLOSING[opening]]
        self.at = start
        while self.at < len(self.text):
            sign = self.sign
            if sign == waiting[-1]:
                waiting.pop()
                if not waiting:
                    self.at += 1
                    return Block(self.text[start : self.at - 1], self._first + bisect.bisect_left(self._ends, start))
            elif sign == "%" and opening != "[":
                end = self.text.find("\n", self.at)
                self.at = len(self.text) if end < 0 else end
                continue
            elif sign in "{([" and waiting[-1] != '"':
                waiting.append(_CLOSING[sign])
            self.at += 1
        raise ScriptError(line, f'"{opening}" has no "{_CLOSING[opening]}" that closes it.')


def _command(reader):
    line = reader.line
    verb = reader.take(_WORD)
    if verb is None:
        raise ScriptError(line, f"expected a command, such as set, new or run, but found {reader.shown()}.")
    words, position = [], None
    while True:
        reader.skip()
        sign = reader.sign
        if sign in ("", "\n", "{", ";", "%"):
            break
        if sign == "(":
            position = reader.bracket()
        elif sign == "[":
            words.append(f"[{reader.bracket().text}]")
        else:
            words.append(_plain(reader))
    # The block may begin on a line further down.
    end = reader.at
    reader.skip(blank=True)
    if reader.sign == "{":
        return Command(verb, tuple(words), reader.bracket(), position, line)
    if reader.sign == "(" and position is None and verb in ("new", "add"):
        return Command(verb, tuple(words), None, reader.bracket(), line)
    reader.at = end
    return Command(verb, tuple(words), None, position, line)


def _plain(reader):
    start = reader.at
    while reader.sign and not reader.sign.isspace() and reader.sign not in "{(;%":
        reader.at += 1
    return reader.text[start : reader.at]


def _values(reader):
    values = []
    while True:
        reader.skip()
        if reader.sign == "\\":
            reader.at += 1
            reader.skip(blank=True)
            continue
        if reader.sign in ("(", "{", '"'):
            opening, block = reader.sign, reader.bracket()
            value = block.text if opening != "{" else f"{{{block.text}}}"
            # "(1) 2" is one value.
            value = (value + _until(reader)).strip()
        else:
            value = _until(reader).strip()
        values.append(value)
        if reader.sign == ",":
            reader.at += 1
        elif reader.sign == "\\":
            reader.at += 1
            reader.skip(blank=True)
        else:
            if reader.sign == ";":
                reader.at += 1
            return values[:-1] if len(values) > 1 and not values[-1] else values


def _until(reader):
    start = reader.at
    while reader.sign and reader.sign not in ",;\n%\\":
        if reader.sign == "(":
            reader.bracket()
        else:
            reader.at += 1
    return reader.text[start : reader.at]
