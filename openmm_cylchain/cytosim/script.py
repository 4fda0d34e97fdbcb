"""What a configuration of Cytosim does: its commands, followed one after the other up to each of its runs.

Runs between which values change, linkers and fibers come and go, and fibers are cut by planes are stages of one run of
ours. Runs between which fibers go by where they are, or come and grow are of different parts, of which the longest is
taken.
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
_STATES = ("move", "import", "load", "equilibrate")
_SOLVE = "solve"
FILAMENTS_CHANGE = "stages: filaments that go by where they are, or come and grow"
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
    """Objects that are created: how many, of which class and property, and with which settings.

    They are ``late`` if they come between runs of one part; None before a run.
    """

    count: int
    kind: str
    name: str
    settings: Settings
    line: int
    late: bool | None = None


@dataclass
class Script:
    """What is there when a run begins: properties by their names, and objects in their order.

    ``later`` are the Scripts of the runs that follow, as stages of one run; ``stages`` are (line, sentence, what it
    needs) of what is left out of others, ``choices`` (line, sentence) of what was chosen in a template. ``broken`` is
    (line, sentence) of what has happened to filaments since the run before, and ``unbound`` which of the hands that are
    not bound have taken their linkers away since then, by names. Fibers that are deleted stay in ``created``:
    ``deleted`` are (number, count), which of those that have created fibers, and how many go, None for all. ``cuts``
    are (numbers, settings) of planes by which fibers are cut, and ``cut_fibers`` those settings by the names of fibers
    that are cut in any of the runs.
    """

    simul: Settings = field(default_factory=lambda: Settings("simul", 1))
    properties: dict = field(default_factory=dict)
    created: list = field(default_factory=list)
    run: Settings | None = None
    steps: int = 0
    stages: list = field(default_factory=list)
    choices: list = field(default_factory=list)
    later: list = field(default_factory=list)
    broken: list = field(default_factory=list)
    unbound: dict = field(default_factory=dict)
    deleted: list = field(default_factory=list)
    cuts: list = field(default_factory=list)
    cut_fibers: dict = field(default_factory=dict)
    frames: int = 0

    @property
    def duration(self):
        """Of this run and those that follow, in s."""
        return sum(max(1, own.steps) * own.time_step for own in (self, *self.later))

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
    script = whole.script()
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

    def script(self):
        """The Script of the first run of the longest part; or at the end of a file without runs."""
        parts = self._parts()
        if not parts:
            return self._replayed(len(self._actions))
        chosen = max(parts, key=lambda part: sum(run["steps"] for run in part))
        scripts, notes, unbound, deleted, cuts = [], 0, {}, 0, 0
        for run in chosen:
            own = self._replayed(run["number"])
            own.run, own.steps, own.frames = run["settings"], run["steps"], run["frames"]
            between, notes = own.stages[notes:], len(own.stages)
            own.stages = between if scripts else []
            own.deleted, deleted = own.deleted[deleted:], len(own.deleted)
            own.cuts, cuts = own.cuts[cuts:], len(own.cuts)
            own.unbound, unbound = {k: v for k, v in own.unbound.items() if v != unbound.get(k)}, own.unbound
            scripts.append(own)
        first, *first.later = scripts
        cut_fibers = {}
        for own in scripts[1:]:
            cut_fibers = {**_cut_names(own), **cut_fibers}
        for own in scripts:
            own.cut_fibers = cut_fibers
        for line, what in parts[0][0]["broken"]:
            if not what.startswith("new "):
                first.stages.append((line, f"{what}, before the first run", FILAMENTS_CHANGE))
        for number, part in enumerate(parts):
            if part is not chosen:
                # What lies between it and those that are taken.
                (line, what), *_ = parts[number + (parts.index(chosen) > number)][0]["broken"]
                text = f"{sum(run['steps'] for run in part)} steps of other runs, apart by {what}"
                first.stages.append((line, text, FILAMENTS_CHANGE))
        first.stages += [note for own in first.later for note in own.stages]
        return first

    def _parts(self):
        # Lists of runs, between which filaments come, go or are cut; runs between which nothing happens are one.
        script, parts, last, known = Script(), [], None, 0
        for number, (_, what, action) in enumerate(self._actions):
            if what != "run":
                action(script)
                continue
            settings, steps = action(script)
            frames = int(settings.number("nb_frames", default=0.0))
            follows = last is not None and not any(self._changes(last, number))
            last = number
            before = parts[-1][-1] if parts else None
            if follows and settings.text(_SOLVE) == before["settings"].text(_SOLVE):
                before["steps"] += steps
                before["frames"] += frames
                continue
            broken, known = script.broken[known:], len(script.broken)
            for new in script.created:
                if broken or not parts:
                    new.late = False
                elif new.late is None:
                    new.late = True
            run = {"number": number, "settings": settings, "steps": steps, "frames": frames, "broken": broken}
            if parts and not broken:
                parts[-1].append(run)
            else:
                parts.append([run])
        return [[run for run in part if run["steps"] > 0] or part[:1] for part in parts]

    def _changes(self, first, last):
        return (what for _, what, _ in self._actions[first + 1 : last] if what)

    def _replayed(self, number):
        script = Script()
        for _, what, action in self._actions[:number]:
            if what != "run":
                action(script)
        return script

    def _add(self, command, what, action):
        self._actions.append((command.line, what, action))
        return True

    def _other(self, command):
        if command.verb in _WITHOUT_EFFECT:
            return True
        if command.verb in _STATES:
            what = f"{command.verb} {' '.join(command.words)}".strip()

            def happen(script):
                script.broken.append((command.line, what))

            return self._add(command, what, happen)
        raise ScriptError(command.line, f"{command.verb!r} is no command of Cytosim.")

    def _do_delete(self, command):
        words = [word for word in command.words if word != "all"]
        count = int(words.pop(0)) if words and words[0].isdigit() else None
        settings = Settings.of("delete", command.line, command.block)
        conditions = [key for key in settings._values if key not in ("nb_objects", "mark")]
        mark = settings.text("mark")
        what = f"delete {' '.join(command.words)}"

        def delete(script):
            name = words[-1] if words else "*"
            every = [new for new in script.created if name in (new.name, new.kind, "*")]
            every = [new for new in every if mark is None or new.settings.text("mark") == mark]
            fibers = [new for new in every if new.kind == "fiber"]
            if fibers and (conditions or _begins_fibers(script)):
                script.broken.append((command.line, what))
            elif fibers:
                known = [new for new in script.created if new.kind == "fiber"]
                if count is not None and len(fibers) > 1:
                    script.stages.append((command.line, f"{what}: of those that are first in the file", None))
                _delete_fibers(script, fibers, known, count)
                every = [new for new in every if new.kind != "fiber"]
            if conditions and set(conditions) <= {"state1", "state2"} and count is None:
                for key in conditions:
                    if settings.text(key) == "0":
                        script.unbound.setdefault(name, set()).add(key)
                return
            if conditions:
                text = f"{what}, by {conditions[0]} = {settings.text(conditions[0])}"
                if any(new.kind in ("single", "couple") for new in every):
                    script.stages.append((command.line, text, "stages: linkers that go by where or how they are"))
                return
            left = count
            for new in every:
                if left is None or isinstance(new.count, str):
                    script.created.remove(new)
                    continue
                gone = min(left, new.count)
                new.count, left = new.count - gone, left - gone
                if new.count == 0:
                    script.created.remove(new)

        return self._add(command, what, delete)

    def _do_cut(self, command):
        words = [word for word in command.words if word != "all"]
        settings = Settings.of("cut", command.line, command.block)
        what = f"cut {' '.join(command.words)}"

        def cut(script):
            name = words[-1] if words else "*"
            known = [new for new in script.created if new.kind == "fiber"]
            numbers = [place for place, own in enumerate(known) if name in (own.name, own.kind, "*")]
            some = any(word.isdigit() for word in words) or settings.peek("plane") == "random"
            # What is cut grows, and cannot come between runs of one part.
            comes = any(known[number].late is not False for number in numbers)
            if some or comes or _begins_fibers(script):
                script.broken.append((command.line, what))
            if numbers and not some:
                script.cuts.append((numbers, settings))

        return self._add(command, what, cut)

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
            # Spaces have their sizes from when they are created.
            kind, every = (name, None) if whole else ("space", name)
            spaces = [
                own.settings
                for own in script.created
                if own.kind == "space" == kind and every in (own.name, None) and not parameter
            ]
            found = spaces or found
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
            fibers = script.properties.get(settings.text(("fibers", 1))) if own == "aster" else None
            grows = own == "fiber" and (_grows(script.properties[name]) or name in _cut_names(script))
            if grows or (fibers is not None and _grows(fibers)):
                script.broken.append((command.line, f"new {' '.join(words)}, which grows"))

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


def _begins_fibers(script):
    # Whether events or hands create fibers during a run, which are of tables of their own.
    hands = (own.settings for own in script.properties.values() if own.kind == "hand")
    return any(new.kind == "event" for new in script.created) or any(
        settings.peek("activity") == "nucleate" for settings in hands
    )


def _cut_names(script):
    # The settings of planes by the names of fibers that they cut.
    known = [new for new in script.created if new.kind == "fiber"]
    return {known[number].name: settings for numbers, settings in reversed(script.cuts) for number in numbers}


def _delete_fibers(script, fibers, known, count):
    for new in fibers:
        number = next(place for place, own in enumerate(known) if own is new)
        if count is None or isinstance(new.count, str):
            script.deleted.append((number, count))
            continue
        gone = sum(of or new.count for own, of in script.deleted if own == number)
        going = min(count, max(0, new.count - gone))
        if going:
            script.deleted.append((number, going))
        count -= going


def _grows(fiber):
    # Whether fibers may grow: those cannot come between runs of one part.
    return fiber.settings.peek("activity") not in (None, "none", "0")


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
