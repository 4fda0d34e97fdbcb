"""Stages of a run: from [[stage]] tables to whole configurations, one after the other.

A stage is the configuration before it with some keys in the place of others, and is read and checked as any other.
What a message says of a value that a stage has set is said at the line of that stage.
"""

import contextlib
import dataclasses
import itertools
from dataclasses import dataclass

import numpy as np

from ..errors import InputError, InstabilityError
from ..units.quantities import TIME
from ..units.text import format_time
from .deleted_and_cut_filaments import refuse_held
from .keys import ConfigurationError, Place, Quantity
from .stage_changes import apply_stage, in_unit_of
from .table import UnknownKeyError
from .tables.stages import STAGE

_MOST_STAGES = 10**5
_AT_THE_BEGINNING = {"linkers": ("bound", "bound_at", "keep"), "filament": ("delete", "cut")}
_DURATION = ("simulation", "duration")


@dataclass(frozen=True)
class TetherCourse:
    """A [[tether]] table whose points move in some stage of a run.

    ``group`` is its TetherGroup, now or when it is there; ``displacement`` (3,) in nm that of its points as the stage
    begins; ``velocity`` (3,) in nm/ps, zero where they stay or it is not active; ``direction`` that of the last or next
    motion.
    """

    group: object
    active: bool
    displacement: np.ndarray
    velocity: np.ndarray
    direction: np.ndarray


@dataclass(frozen=True)
class Stage:
    """A part of a run with one configuration.

    Attributes
    ----------
    name : str
    configuration : Configuration
        That of the stage: its steps are those of the stage alone.
    number : int
        Counted from 0; pieces of stages with ramps are counted, too.
    begin : float
        Time in ps.
    first_step, first_report : int
        How many steps and reports come before it, but for that of the start.
    is_piece : bool
        Whether it goes on with a stage that is divided.
    counted, bound : frozenset of int
        Numbers of [[linkers]] tables whose count it gives, and of which those that are added begin bound.
    tethers : tuple of TetherCourse
    """

    name: str
    configuration: object
    number: int = 0
    begin: float = 0.0
    first_step: int = 0
    first_report: int = 0
    is_piece: bool = False
    counted: frozenset = frozenset()
    bound: frozenset = frozenset()
    tethers: tuple = ()

    @property
    def last_step(self):
        """How many steps have been taken as it ends."""
        return self.first_step + self.configuration.simulation.steps

    @property
    def reports(self):
        """How many there are in it, with that at its end."""
        settings = self.configuration.simulation
        return settings.steps // settings.steps_per_report

    @property
    def report_steps(self):
        """Those of its reports, (reports,)."""
        return self.first_step + self.configuration.simulation.steps_per_report * np.arange(1, self.reports + 1)

    @property
    def end(self):
        """Time in ps."""
        return self.time(self.last_step)

    def time(self, step):
        """That of a step, or of several, in ps."""
        return self.begin + (step - self.first_step) * self.configuration.simulation.time_step


def stages_of(configuration):
    """The stages of a run: a tuple, of one Stage if the configuration has no [[stage]] tables."""
    return configuration.stages or _with_tethers([Stage("", configuration)], [frozenset()])


def stage_at(stages, step):
    """The Stage in which a step is taken: the first one for zero."""
    return next(own for own in stages if step <= own.last_step)


def named_stages(stages):
    """The stages with their pieces taken together: (first, last) Stage of each."""
    found = []
    for stage in stages:
        if stage.is_piece:
            found[-1] = found[-1][0], stage
        else:
            found.append((stage, stage))
    return found


def time_steps_in_words(stages):
    """The time steps of stages as text, each once."""
    return " and ".join(dict.fromkeys(format_time(own.configuration.simulation.time_step) for own in stages))


@contextlib.contextmanager
def naming_stage(stage):
    """A context whose errors say in which stage of a run they are."""
    try:
        yield
    except InstabilityError as error:
        raise type(error)(f"{error}{_in_words(stage)}", **error.place) from None
    except InputError as error:
        raise InputError(f"{error}{_in_words(stage)}") from None


def _in_words(stage):
    return f" (In stage {stage.name!r}.)" if stage.name else ""


def frame_steps(configuration):
    """The steps of all reports of a run, (frames,)."""
    return np.concatenate([np.zeros(1, dtype=int), *(own.report_steps for own in stages_of(configuration))])


def frame_times(configuration):
    """The times of all reports of a run in ps, (frames,)."""
    return np.concatenate([np.zeros(1), *(own.time(own.report_steps) for own in stages_of(configuration))])


@dataclass(frozen=True)
class _Leaf:
    # A stage that has no stages in it.
    name: str
    place: Place
    table: dict
    entries: object


def read_stages(raw, kinds, read):
    """The stages of a configuration.

    Parameters
    ----------
    raw : dict
        What tomllib has read.
    kinds : sequence of TableKind
        Those that a stage may change.
    read : callable (dict)
        Makes a Configuration of tables without stages.

    Returns
    -------
    tuple of Stage

    Raises
    ------
    ConfigurationError
    """
    tables = {name: own for name, own in raw.items() if name != STAGE.name}
    simulation = tables.get(_DURATION[0])
    if isinstance(simulation, dict) and _DURATION[1] in simulation:
        text = "[simulation] duration is said by [[stage]] tables: leave it out, or give it as that of a first stage."
        raise ConfigurationError(text, _DURATION)
    stages, reset, known, thinned = [], [], {}, set()
    for leaf in _leaves(raw[STAGE.name], ("stage",), "", itertools.count(1)):
        changes = apply_stage(_as_they_are(tables) if stages else tables, leaf.table, leaf.place, kinds)
        for path, origin in changes.origins.items():
            if path[0] == "filament" and path[2:] in (("delete",), ("cut",)):
                if not stages:
                    raise origin.error("belongs to a later stage: in the first one, all begin that the file has.")
                if path[2] == "delete":
                    thinned.add(path[1] + 1)
        pieces = _pieces(leaf, changes)
        for piece in range(pieces):
            own = changes.resolved((piece + 0.5) / pieces)
            configuration = _read_piece(own, leaf, pieces, changes, read, known)
            if stages:
                _refuse_other_structure(stages[0].configuration, configuration, leaf)
                refuse_held(configuration, thinned, leaf.place)
            stages.append(_next_stage(stages, leaf, configuration, piece, changes))
            moved = {path[1] for path in changes.origins if path[0] == "tether" and path[2] == "point"}
            reset.append(frozenset(moved) if piece == 0 else frozenset())
        tables = changes.resolved(1.0)
    return _with_tethers(stages, reset)


def _leaves(tables, path, before, count):
    if not isinstance(tables, list) or not tables or not all(isinstance(own, dict) for own in tables):
        raise ConfigurationError("'stage' must be a list of tables: write [[stage]] with two brackets.", path)
    for number, table in enumerate(tables):
        place = Place(f"[[stage]] number {number + 1}", (*path, number))
        own = {name: value for name, value in table.items() if name in STAGE.names}
        entries = STAGE.read(own, place)
        name = entries["name"] or f"stage {number + 1}"
        place = Place(f"stage {name!r}:", place.path)
        inner = table.get("stage")
        for repeat in range(entries["repeat"]):
            label = before + (name if entries["repeat"] == 1 else f"{name} {repeat + 1}")
            if inner is None:
                if next(count) > _MOST_STAGES:
                    raise place.error(f"makes more than {_MOST_STAGES} stages.")
                if "duration" not in entries:
                    raise place.error(f"lacks the key 'duration': add a line such as {STAGE.keys[1].line}")
                yield _Leaf(label, place, table, entries)
                continue
            others = [key for key in table if key not in ("name", "repeat", "stage")]
            if others:
                text = f"has stages of its own, which say what there is: move {others[0]} into one of them."
                raise ConfigurationError(f"{place.name} {text}", (*place.path, others[0]))
            yield from _leaves(inner, (*place.path, "stage"), f"{label}, ", count)


def _pieces(leaf, changes):
    if changes.ramps and "pieces" not in leaf.entries:
        raise changes.ramps[0].place.error(
            "goes from one value to another: say into how many pieces the stage is divided, as in pieces = 20."
        )
    if not changes.ramps and "pieces" in leaf.entries:
        raise leaf.entries.at("pieces").error(
            'belongs to a value that goes from one to another, as in { from = "2 um", to = "1 um" }.'
        )
    return leaf.entries["pieces"] or 1


def _as_they_are(tables):
    # What holds for the beginning of a stage alone is said by that stage.
    kept = {}
    for name, keys in _AT_THE_BEGINNING.items():
        there = tables.get(name)
        if isinstance(there, list) and all(isinstance(own, dict) for own in there):
            kept[name] = [{key: own[key] for key in own if key not in keys} for own in there]
    return {**tables, **kept}


def _read_piece(tables, leaf, pieces, changes, read, known):
    place = Place(f"{leaf.place.name} duration", (*leaf.place.path, "duration"))
    text = leaf.table["duration"]
    if pieces > 1:
        text = in_unit_of(text, leaf.entries["duration"] / pieces, Quantity(TIME), place)
    simulation = tables.get("simulation", {})
    tables = {**tables, "simulation": {**simulation, "duration": text} if isinstance(simulation, dict) else simulation}
    key = repr(tables)
    if key not in known:
        try:
            known[key] = read(tables)
        except ConfigurationError as error:
            raise _in_stage(error, leaf, changes) from None
    return known[key]


def _in_stage(error, leaf, changes):
    # The same at the line of the stage, if it has set what is wrong.
    if error.path == _DURATION:
        return ConfigurationError(f"{leaf.place.name} {error}", (*leaf.place.path, "duration"))
    for length in range(len(error.path), 0, -1):
        place = changes.origins.get(error.path[:length])
        if place is not None:
            rest = error.path[length:]
            return ConfigurationError(f"{leaf.place.name} {error}", (*place.path, *rest))
    if isinstance(error, UnknownKeyError) or not changes.origins:
        return error
    # What the stage has set of the same table, or within it.
    path = leaf.place.path
    for table in (error.path, error.path[:-1]):
        touched = [place.path for own, place in changes.origins.items() if table and own[: len(table)] == table]
        if touched:
            path = touched[0]
            break
    return ConfigurationError(f"{leaf.place.name} {error}", path)


def _refuse_other_structure(first, other, leaf):
    # What positions and states of the stage before would not fit.
    for before, after in zip(first.filaments, other.filaments):
        for name, text in (
            ("count", "how many filaments there are"),
            ("nodes", "how many nodes filaments have"),
            ("spare_nodes", "for how many nodes filaments that grow have places"),
            ("clamped", "which nodes are clamped"),
        ):
            if getattr(before, name) != getattr(after, name):
                raise leaf.place.error(f"changes {text} ({after.label}), which cannot change while a run goes on.")
        if before.growth is None:
            continue
        for end in ("plus", "minus"):
            states = [list(own.growth.states(end).names) for own in (before, after)]
            if states[0] != states[1]:
                raise leaf.place.error(
                    f"changes which states {end} ends have ({after.label}), from {', '.join(map(repr, states[0]))} to "
                    f"{', '.join(map(repr, states[1]))}: their rates alone can change. Give the file all of them, with "
                    "rates of zero."
                )
    for number, (before, after) in enumerate(zip(first.linkers, other.linkers), start=1):
        anchors = [None if own.anchors is None else len(own.anchors) for own in (before, after)]
        if anchors[0] != anchors[1]:
            raise leaf.place.error(f"changes how many anchors [[linkers]] number {number} has, which cannot change.")


def _next_stage(stages, leaf, configuration, piece, changes):
    bound, counted = (_numbers_of("linkers", name, changes.origins) for name in ("bound", "count"))
    if bound and stages and piece == 0:
        _refuse_bound_on_growing(bound, configuration, leaf)
    if not stages:
        return Stage(leaf.name, configuration)
    last = stages[-1]
    return Stage(
        name=leaf.name,
        configuration=configuration,
        number=last.number + 1,
        begin=last.end,
        first_step=last.last_step,
        first_report=last.first_report + last.reports,
        is_piece=piece > 0,
        counted=counted,
        bound=bound,
    )


def _numbers_of(table, name, origins):
    return frozenset(path[1] for path in origins if path[0] == table and path[2] == name)


def _refuse_bound_on_growing(bound, configuration, leaf):
    for number in bound:
        own = configuration.linkers[number]
        hand = own.kind.hands[0] if own.anchors is None else own.kind.hands[1]
        if own.anchors is not None or any(
            group.growth is not None and hand.binds(group.type) for group in configuration.filaments
        ):
            what = "that are anchored" if own.anchors is not None else "to filaments that grow"
            raise leaf.place.error(f"linkers that are added in a stage do not begin bound {what}: leave bound out.")


def _with_tethers(stages, reset):
    # The stages with their TetherCourses; ``reset`` are tables whose points each stage gives anew.
    groups = [{own.number: own for own in stage.configuration.tethers} for stage in stages]
    moving = sorted({number for own in groups for number, group in own.items() if group.velocity is not None})
    every = sorted(set().union(*groups)) if moving else []
    courses = {number: _courses(number, stages, groups, reset) for number in every}
    return tuple(
        dataclasses.replace(stage, tethers=tuple(courses[number][place] for number in every))
        for place, stage in enumerate(stages)
    )


def _courses(number, stages, groups, reset):
    velocities = [
        np.zeros(3) if number not in own or own[number].velocity is None else np.array(own[number].velocity)
        for own in groups
    ]
    moving = [own / np.linalg.norm(own) for own in velocities if own.any()]
    direction = moving[0] if moving else np.zeros(3)
    group = next(own[number] for own in groups if number in own)
    displacement, found = np.zeros(3), []
    for stage, own, velocity, anew in zip(stages, groups, velocities, reset):
        group = own.get(number, group)
        if number in anew:
            displacement = np.zeros(3)
        if velocity.any():
            direction = velocity / np.linalg.norm(velocity)
        found.append(TetherCourse(group, number in own, displacement, velocity, direction))
        displacement = displacement + velocity * max(0.0, stage.end - max(stage.begin, group.start_time))
    return found
