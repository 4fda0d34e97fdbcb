"""What a configuration of Cytosim does: its commands, followed one after the other until the run that is translated.

A run of ours goes on with one set of values. Where there are several runs, and something changes between them, the
longest is taken, with all that is there when it begins.
"""

import math
import re
from dataclasses import dataclass, field
from pathlib import Path

from ..errors import InputError
from .arithmetic import evaluate
from .grammar import ScriptError, read_commands
from .settings import Settings
from .templates import expand_template

KINDS = ("space", "field", "event", "fiber", "hand", "single", "couple", "solid", "bead", "sphere", "aster", "bundle")
KINDS = (*KINDS, "nucleus", "fake", "organizer")
"""Classes of objects, apart from simul."""

_WITHOUT_EFFECT = ("report", "write", "export", "save", "mark", "call", "dump", "print")
_STATES = ("cut", "delete", "move", "import", "load", "equilibrate", "change")
_MOST_COMMANDS, _MOST_FILES = 200_000, 10
_BRACKETED = re.compile(r"\[([^\[\]]*)\]")
_RANGE = re.compile(r"([A-Za-z_]\w*)=(-?\d+):(-?\d+)(?::(-?\d+))?")


@dataclass
class Property:
    """What ``set`` makes: its class, such as fiber, its name and its settings."""

    kind: str
    name: str
    settings: Settings
    line: int


@dataclass
class New:
    """Objects that are created: how many, of which class and property, and with which settings."""

    count: int
    kind: str
    name: str
    settings: Settings
    line: int


@dataclass
class Script:
    """What is there when the run that is translated begins: properties by their names, and objects in their order.

    ``stages`` are (line, sentence) of what happens between runs, ``choices`` those of what was chosen in a template.
    """

    simul: Settings = field(default_factory=lambda: Settings("simul", 1))
    properties: dict = field(default_factory=dict)
    created: list = field(default_factory=list)
    run: Settings | None = None
    steps: int = 0
    stages: list = field(default_factory=list)
    choices: list = field(default_factory=list)

    def named(self, name, kind, line):
        """A Property of a class, by its name. ScriptError if there is none."""
        found = self.properties.get(name)
        if found is None or found.kind != kind:
            raise ScriptError(line, f"there is no {kind} called {name!r}.")
        return found

    @property
    def time_step(self):
        """In s."""
        step = self.simul.number("time_step")
        if step is None or not 0.0 < step < math.inf:
            raise ScriptError(self.simul.line, "time_step of simul must be given and positive.")
        return step


def read_script(path, given=None):
    """Follow a file: a Script. InputError if it cannot be read, or is no configuration of Cytosim.

    ``given`` are values of names in templates.
    """
    text, choices = expand_template(_text_of(path), given)
    commands = read_commands(text)
    if not any(command.verb == "set" for command in commands) and not _reads(commands):
        raise ScriptError(1, 'this is no configuration of Cytosim: it has no "set", such as set simul system { ... }')
    whole = _Follower(Path(path).parent)
    whole.follow(commands)
    script = whole.up_to_longest()
    script.choices = choices
    return script


def _reads(commands):
    return any(command.verb in ("read", "include") for command in commands)


def _text_of(path):
    try:
        content = Path(path).read_bytes()
    except OSError as error:
        raise InputError(f"{path} cannot be read: {error.strerror}.") from None
    try:
        text = content.decode("utf-8")
    except UnicodeDecodeError:
        text = content.decode("latin-1")
    if "\0" in text:
        raise InputError(f"{path} is no text: it has bytes that are zero.")
    return text.replace("\r\n", "\n").replace("\r", "\n")


class _Follower:
    # Actions: (line, function of a Script) and runs, in their order; it stops where Cytosim does.
    def __init__(self, folder):
        self._folder, self._actions, self._count, self._files = folder, [], 0, 0

    def follow(self, commands):
        """Whether the file goes on after these commands."""
        for command in commands:
            self._count += 1
            if self._count > _MOST_COMMANDS:
                raise ScriptError(command.line, f"there are more than {_MOST_COMMANDS} commands.")
            if command.verb in ("stop", "end", "restart"):
                return False
            if not getattr(self, f"_do_{command.verb}", self._other)(command):
                return False
        return True

    def up_to_longest(self):
        """The Script when the longest run begins, or at the end of a file without runs."""
        script, runs = Script(), []
        # Runs between which nothing happens are one.
        for number, (line, what, action) in enumerate(self._actions):
            if what == "run":
                settings, steps = action(script)
                if runs and not runs[-1]["between"]:
                    runs[-1]["steps"] += steps
                else:
                    runs.append({"number": number, "steps": steps, "line": line, "between": []})
                runs[-1]["settings"] = settings
                continue
            if what and runs:
                runs[-1]["between"].append((line, what))
            action(script)
        if not runs:
            return script
        longest = max(runs, key=lambda run: run["steps"])
        script = Script(run=longest["settings"], steps=longest["steps"])
        for _, what, action in self._actions[: longest["number"]]:
            if what != "run":
                action(script)
        if len(runs) > 1:
            script.stages.append(
                (longest["line"], f"the run of {longest['steps']} steps is taken of {len(runs)}, all others left out")
            )
        for run in runs[:-1]:
            script.stages += run["between"]
        return script

    def _add(self, command, what, action):
        self._actions.append((command.line, what, action))
        return True

    def _other(self, command):
        if command.verb in _WITHOUT_EFFECT:
            return True
        if command.verb in _STATES:
            return self._add(command, f"{command.verb} {' '.join(command.words)}".strip(), lambda script: None)
        raise ScriptError(command.line, f"{command.verb!r} is no command of Cytosim.")

    def _do_set(self, command):
        words = [word for word in " ".join(command.words).replace(":", " ").split() if not word.isdigit()]
        if not words or command.block is None:
            raise ScriptError(command.line, "set needs a class, a name and a block, as in set fiber actin { ... }")
        if "display" in words[1:]:
            return True
        if words[0] == "simul":
            return self._add(command, "", lambda script: script.simul.read(command.block))
        if words[0] not in KINDS or len(words) == 1:
            return self._change(command, words, "")
        kind, name = words[0], words[-1]

        def define(script):
            settings = Settings.of(f"{kind} {name}", command.line, command.block)
            script.properties[name] = Property(kind, name, settings, command.line)

        return self._add(command, "", define)

    def _do_change(self, command):
        words = " ".join(command.words).replace(":", " ").split()
        if not words or command.block is None:
            raise ScriptError(command.line, "change needs a name and a block, as in change actin { rigidity = 1 }")
        if words[-1] == "display" or not any(key != "display" for key in Settings.of("", 1, command.block)._values):
            return True
        return self._change(command, words, f"change {' '.join(words)}")

    def _change(self, command, words, what):
        whole = words[0] == "all"
        name, *parameter = words[1:] if whole else words

        def change(script):
            if whole:
                found = [own.settings for own in script.properties.values() if own.kind == name]
            elif name in script.properties:
                found = [script.properties[name].settings]
            else:
                # The one simul has any name.
                found = [script.simul]
            for settings in found:
                if parameter:
                    settings.set(parameter[0], [command.block.text.strip()], command.line)
                else:
                    settings.read(command.block)

        return self._add(command, what, change)

    def _do_new(self, command):
        words = list(command.words)
        first = words.pop(0) if words and (words[0].isdigit() or words[0].startswith("[")) else "1"
        if not words:
            raise ScriptError(command.line, "new needs the name of a property, as in new 10 actin")
        kind = words[0] if len(words) > 1 and words[0] in KINDS else None

        def create(script):
            if words[0] == "event":
                name, own = "event", "event"
            else:
                name = words[-1]
                if first == "0":
                    return
                if name not in script.properties:
                    raise ScriptError(command.line, f"nothing called {name!r} has been set.")
                own = kind or script.properties[name].kind
            settings = Settings.of(f"new {name}", command.line, command.block)
            if command.position is not None:
                settings.set("position", command.position.text.split(","), command.line)
            # A count such as [10 * volume] is known with the space.
            count = first if first.startswith("[") else int(first)
            script.created.append(New(count, own, name, settings, command.line))

        return self._add(command, f"new {' '.join(words)}", create)

    _do_add = _do_new

    def _do_run(self, command):
        counts = [int(word) for word in command.words if word.isdigit()]

        def run(script):
            settings = Settings.of("run", command.line, command.block)
            steps = settings.number("nb_steps", default=float(counts[0]) if counts else 1.0)
            duration = settings.number("duration", "time")
            if duration is not None:
                steps = math.ceil(duration / script.time_step * (1.0 - 1e-9))
            if not 0 <= steps < 1e15:
                raise ScriptError(command.line, f"a run cannot have {steps:g} steps.")
            return settings, int(steps)

        return self._add(command, "run", run)

    def _do_repeat(self, command):
        times = command.words[0] if command.words else ""
        if not times.isdigit() or command.block is None:
            raise ScriptError(command.line, "repeat needs a number and a block, as in repeat 10 { ... }")
        commands = read_commands(command.block.text, command.block.line)
        return all(self.follow(commands) for _ in range(int(times) if commands else 0))

    def _do_for(self, command):
        match = _RANGE.fullmatch("".join(command.words))
        if match is None or command.block is None:
            raise ScriptError(command.line, "for needs a range and a block, as in for X=1:10 { ... }")
        name, *numbers = match.groups()
        first, *others = (int(number) for number in numbers if number is not None)
        last, step = others[-1], others[0] if len(others) > 1 else 1
        if step <= 0:
            raise ScriptError(command.line, "for needs an increment that is positive.")
        if (last - first) // step > _MOST_COMMANDS:
            raise ScriptError(command.line, f"for makes more than {_MOST_COMMANDS} commands.")
        for value in range(first, last, step):
            text = _replaced(command.block, {name: value})
            if not self.follow(read_commands(text, command.block.line)):
                return False
        return True

    def _do_read(self, command):
        required = Settings.of("read", command.line, command.block).flag("required", default=True)
        if not command.words:
            raise ScriptError(command.line, "read needs the name of a file.")
        path = self._folder / command.words[0].strip('"')
        if not path.is_file():
            if required:
                raise ScriptError(command.line, f"the file {command.words[0]} is not beside this one.")
            return True
        self._files += 1
        if self._files > _MOST_FILES:
            raise ScriptError(command.line, "files read each other without end.")
        text, _ = expand_template(_text_of(path))
        try:
            return self.follow(read_commands(text))
        except ScriptError as error:
            raise ScriptError(command.line, f"in {command.words[0]}, {error}") from None

    _do_include = _do_read


def _replaced(block, names):
    def value(match):
        try:
            return str(evaluate(match[1], names))
        except InputError as error:
            raise ScriptError(block.line, str(error)) from None

    return _BRACKETED.sub(value, block.text)


def count_of(new, space):
    """How many objects a New is, where a Space gives ``volume`` and ``surface``; in um."""
    if not isinstance(new.count, str):
        return new.count
    names = {} if space is None else {"volume": space.volume, "surface": space.surface}
    try:
        count = evaluate(new.count[1:-1], {name: value for name, value in names.items() if value is not None})
        number = round(count) if isinstance(count, (int, float)) and math.isfinite(count) else -1
    except InputError as error:
        raise ScriptError(new.line, str(error)) from None
    if not 0 <= number <= 10**7:
        raise ScriptError(new.line, f"{new.count} makes {count} objects.")
    return number
