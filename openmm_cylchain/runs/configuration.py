"""The configuration of a run: a TOML file with units, read into frozen dataclasses and checked.

    [solvent]            temperature, viscosity
    [box]                optional: edges of a periodic box
    [[filament]]         one or more: type or a description, segments, count, start, position, direction, clamped
    [[linkers]]          any number: crosslinkers and motors; type or hands, how many, and what is changed
    [simulation]         scheme, time_step, duration, report_interval, checkpoint_interval, seed, engine, platform,
                         precision

Every mistake is an InputError that names the table and the key, and says what to do.
"""

import dataclasses
import difflib
import math
import sys
from dataclasses import dataclass
from pathlib import Path

from ..bead_spring.bead_spring_type import DSDNA_BASE_PAIRS, BeadSpringType
from ..dynamics.recommended_step import recommended_time_step
from ..dynamics.schemes import SCHEMES
from ..engine_choice import ENGINES, default_scheme
from ..errors import InputError
from ..filaments.chain_type import ChainType
from ..filaments.filament_type import DSDNA, F_ACTIN, MICROTUBULE, FilamentType
from ..filaments.placement import clamped_nodes
from ..kinetics.crosslinker import Crosslinker
from ..kinetics.hand import AT_ENDS, Hand
from ..kinetics.linkers import as_linkers
from ..kinetics.presets import PRESETS as LINKER_PRESETS
from ..mechanics.friction import EndCorrections
from ..units import quantities as units
from ..units.text import example as example_of
from ..units.text import format_time, parse_quantity
from .initial_state import recommended_step_of_network

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

PRESETS = {"F_ACTIN": F_ACTIN, "DSDNA": DSDNA, "MICROTUBULE": MICROTUBULE, "DSDNA_BASE_PAIRS": DSDNA_BASE_PAIRS}
"""Filament types by the names that a configuration uses."""

STARTS = ("equilibrium", "straight")
PRECISIONS = ("automatic", "single", "mixed", "double")
"""Those of filaments with the compiled engine, and those of platforms. The default, "automatic", chooses for them."""


@dataclass(frozen=True)
class Solvent:
    """Temperature in K and viscosity in kJ ps/(mol nm^3)."""

    temperature: float
    viscosity: float


@dataclass(frozen=True)
class FilamentGroup:
    """One [[filament]] table: ``count`` filaments of one type, length and start; lengths in nm.

    ``linked`` says whether linkers bind to them.
    """

    type: ChainType
    segments: int
    count: int
    start: str
    position: tuple
    direction: tuple
    clamped: tuple
    linked: bool = False


@dataclass(frozen=True)
class LinkerGroup:
    """One [[linkers]] table; lengths in nm, anchors as points or as numbers of particles."""

    kind: Crosslinker
    count: int
    concentration: float
    volume: float
    anchors: tuple
    bound: int


@dataclass(frozen=True)
class SimulationSettings:
    """The [simulation] table: times in ps, intervals in steps."""

    scheme: str
    time_step: float
    steps: int
    steps_per_report: int
    steps_per_checkpoint: int
    seed: int
    engine: str
    platform: str
    precision: str


@dataclass(frozen=True)
class Configuration:
    """Everything that a run needs; ``text`` is the file that it was read from, ``box`` the edges of a box in nm."""

    title: str
    solvent: Solvent
    filaments: tuple
    simulation: SimulationSettings
    text: str = dataclasses.field(compare=False, repr=False)
    box: tuple | None = None
    linkers: tuple = ()


def read_configuration(path):
    """Read and check a configuration file.

    Parameters
    ----------
    path : str or Path

    Returns
    -------
    Configuration

    Raises
    ------
    InputError
        For a file that cannot be read, is not TOML, or describes no run.
    """
    path = Path(path)
    try:
        # In bytes: reading as text would turn line ends into those of the platform.
        text = path.read_bytes().decode("utf-8")
    except OSError as error:
        raise InputError(f"The configuration {path} cannot be read: {error.strerror}.") from None
    except UnicodeDecodeError:
        raise InputError(f"The configuration {path} is not UTF-8 text: save it as UTF-8.") from None
    try:
        return parse_configuration(text)
    except InputError as error:
        raise InputError(f"{path}: {error}") from None


def parse_configuration(text):
    """Read and check the text of a configuration; see ``read_configuration``."""
    try:
        entries = tomllib.loads(text.replace("\r\n", "\n"))
    except tomllib.TOMLDecodeError as error:
        raise InputError(f'not valid TOML: {error}. Texts, quantities among them, need quotes: "360 nm".') from None
    top = _Table(entries, "the configuration", ("title", "solvent", "box", "filament", "linkers", "simulation"))
    solvent = _solvent(top.table("solvent", _SOLVENT_KEYS))
    box = _box(top.table("box", _BOX_KEYS)) if "box" in top else None
    if not top.get("filament", [], ""):
        raise InputError("There is no [[filament]] table: add one for every kind of filament.")
    filaments = tuple(_filament_group(table, solvent) for table in top.tables("filament", _FILAMENT_KEYS))
    linkers = tuple(_linker_group(table, filaments, box) for table in top.tables("linkers", _LINKER_KEYS))
    filaments = tuple(dataclasses.replace(group, linked=_is_linked(group, linkers)) for group in filaments)
    simulation = _simulation(top.table("simulation", _SIMULATION_KEYS), solvent, filaments, box, linkers)
    return Configuration(top.text("title", ""), solvent, filaments, simulation, text, box, linkers)


def changed_keys(first, second):
    """Names of the tables and entries in which two configurations differ, apart from their text."""
    names = [] if first.title == second.title else ["title"]
    for table in ("solvent", "simulation"):
        names += _changed_fields(getattr(first, table), getattr(second, table), f"[{table}]")
    if first.box != second.box:
        names.append("[box] edges")
    if len(first.linkers) != len(second.linkers):
        names.append("the number of [[linkers]] tables")
    for number, (one, other) in enumerate(zip(first.linkers, second.linkers), start=1):
        names += _changed_fields(one, other, f"[[linkers]] number {number}:")
    if len(first.filaments) != len(second.filaments):
        return [*names, "the number of [[filament]] tables"]
    for number, (one, other) in enumerate(zip(first.filaments, second.filaments), start=1):
        names += _changed_fields(one, other, f"[[filament]] number {number}:")
    return names


def linker_labels(configuration):
    """A name for each [[linkers]] table, distinct if there are several."""
    names = [own.kind.name for own in configuration.linkers]
    return [
        name if names.count(name) == 1 else f"{name} (table {number})" for number, name in enumerate(names, start=1)
    ]


def _changed_fields(first, second, label):
    fields = (field.name for field in dataclasses.fields(first))
    return [f"{label} {name}" for name in fields if getattr(first, name) != getattr(second, name)]


_REQUIRED = object()


class _Table:
    # One table of the file: hands out checked entries and knows what to call them in messages.

    def __init__(self, entries, label, keys):
        self.entries = entries
        self.label = label
        for key in entries:
            if key not in keys:
                raise InputError(f"{label} has an unknown key {key!r}.{_suggestion(key, keys)}")

    def __contains__(self, key):
        return key in self.entries

    def name(self, key):
        return f"{self.label} {key}"

    def get(self, key, default, example):
        if key in self.entries:
            return self.entries[key]
        if default is _REQUIRED:
            raise InputError(f"{self.label} lacks the key {key!r}: add a line such as {key} = {example}")
        return default

    def table(self, key, keys):
        entries = self.get(key, {}, "")
        if not isinstance(entries, dict):
            raise InputError(f"{key!r} must be a table: write [{key}] once, with its keys below it.")
        return _Table(entries, f"[{key}]", keys)

    def tables(self, key, keys):
        entries = self.get(key, [], "")
        if not isinstance(entries, list) or not all(isinstance(entry, dict) for entry in entries):
            raise InputError(f"{key!r} must be a list of tables: write [[{key}]] with two brackets before each.")
        return [_Table(entry, f"[[{key}]] number {number}:", keys) for number, entry in enumerate(entries, start=1)]

    def quantity(self, key, unit, default=_REQUIRED, zero_allowed=False):
        text = self.get(key, default, f'"{example_of(unit)}"')
        if text is default:
            return default
        value = parse_quantity(text, unit, self.name(key))
        if value < 0 or (value == 0 and not zero_allowed):
            raise InputError(f'{self.name(key)} must be {"zero or " if zero_allowed else ""}positive, but is "{text}".')
        return value

    def whole_number(self, key, minimum, default=_REQUIRED, example="64"):
        value = self.get(key, default, example)
        if value is default:
            return default
        if isinstance(value, bool) or not isinstance(value, int):
            raise InputError(f"{self.name(key)} must be a whole number, but is {value!r}.")
        if value < minimum:
            raise InputError(f"{self.name(key)} must be at least {minimum}, but is {value}.")
        return value

    def text(self, key, default=_REQUIRED, example='"..."'):
        value = self.get(key, default, example)
        if not isinstance(value, str) and value is not default:
            raise InputError(f"{self.name(key)} must be a text in quotes, but is {value!r}.")
        return value

    def choice(self, key, choices, default=_REQUIRED):
        value = self.text(key, default, f'"{next(iter(choices))}"')
        if value is not default and value not in choices:
            raise InputError(
                f"{self.name(key)} must be one of {', '.join(choices)}, but is {value!r}.{_close_match(value, choices)}"
            )
        return value

    def flag(self, key):
        value = self.entries[key]
        if not isinstance(value, bool):
            raise InputError(f"{self.name(key)} must be true or false, without quotes, but is {value!r}.")
        return value

    def number(self, key, default):
        return _number(self.get(key, default, "1.0"), self.name(key))

    def triple(self, key, read, example):
        value = self.get(key, None, example)
        if value is None:
            return None
        if not isinstance(value, list) or len(value) != 3:
            raise InputError(f"{self.name(key)} must be a list of three, as in {example}, but is {value!r}.")
        return tuple(read(item, f"{self.name(key)}[{index}]") for index, item in enumerate(value))


def _number(value, name):
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not math.isfinite(value):
        raise InputError(f"{name} must be a finite number without a unit, but is {value!r}.")
    return float(value)


def _close_match(text, choices):
    close = difflib.get_close_matches(text, choices, n=1)
    return f" Did you mean {close[0]!r}?" if close else ""


def _suggestion(key, keys):
    for table, known in (
        ("[solvent]", _SOLVENT_KEYS),
        ("[simulation]", _SIMULATION_KEYS),
        ("[[filament]]", _FILAMENT_KEYS),
        ("[[linkers]]", _LINKER_KEYS),
        ("the hand of [[linkers]]", _HAND_KEYS),
    ):
        if key in known and known is not keys:
            return f" It belongs to {table}."
    return _close_match(key, keys) or f" Known are {', '.join(keys)}."


_SOLVENT_KEYS = ("temperature", "viscosity")


def _solvent(table):
    return Solvent(table.quantity("temperature", units.TEMPERATURE), table.quantity("viscosity", units.VISCOSITY))


_TYPE_QUANTITIES = {
    "diameter": units.LENGTH,
    "segment_length": units.LENGTH,
    "bending_rigidity": units.BENDING_RIGIDITY,
    "persistence_length": units.LENGTH,
    "temperature": units.TEMPERATURE,
    "stretching_stiffness": units.STIFFNESS,
    "stretching_modulus": units.FORCE,
    "maximum_extension": units.LENGTH,
    "extension_relaxation_time": units.TIME,
    "extensional_friction": units.ROTATIONAL_FRICTION,
    "mass_per_length": units.MASS_PER_LENGTH,
}
_TYPE_TEXTS = ("name", "bending_model", "stretching_model")
_TYPE_KEYS = (*_TYPE_TEXTS, *_TYPE_QUANTITIES, "friction_length", "end_corrections")

# Of chains of beads alone, and of those that cylinders have as well.
_BEAD_QUANTITIES = {"bead_spacing": units.LENGTH, "bead_friction": units.FRICTION, "bead_mass": units.MASS}
_BEAD_NUMBERS = ("nu", "reduced_temperature")
_BEAD_KEYS = (*_BEAD_QUANTITIES, *_BEAD_NUMBERS, "coarse_graining")
_SHARED_KEYS = ("name", "diameter", "bending_rigidity", "persistence_length", "temperature", "stretching_modulus")

_FILAMENT_KEYS = ("type", "segments", "count", "start", "position", "direction", "clamped", *_TYPE_KEYS, *_BEAD_KEYS)

# Setting one of a pair in a preset takes the place of the other.
_EXCLUSIVE = (
    ("bending_rigidity", "persistence_length"),
    ("stretching_stiffness", "stretching_modulus"),
    ("extension_relaxation_time", "extensional_friction"),
)


def _filament_group(table, solvent):
    if "type" not in table and "name" not in table:
        raise InputError(
            f"{table.label} lacks the key 'type': name a preset ({', '.join(PRESETS)}), or describe the filament "
            "with name, diameter, segment_length and the other properties of a FilamentType, or with bead_spacing and "
            "those of a BeadSpringType."
        )
    position = table.triple(
        "position", lambda text, name: parse_quantity(text, units.LENGTH, name), '["0 nm", "0 nm", "0 nm"]'
    )
    direction = table.triple("direction", _number, "[1, 0, 0]")
    if direction == (0.0, 0.0, 0.0):
        raise InputError(f"{table.name('direction')} must not be the zero vector.")
    segments = table.whole_number("segments", 1)
    filament_type = _filament_type(table, solvent)
    group = FilamentGroup(
        type=filament_type,
        segments=segments,
        count=table.whole_number("count", 1, 1),
        start=table.choice("start", STARTS, "equilibrium"),
        position=position,
        direction=direction,
        clamped=_clamped(table, segments + 1),
    )
    try:
        filament_type.segment_friction(solvent.viscosity, solvent.temperature, segments)
    except InputError as error:
        raise InputError(f"{table.label} {error}") from None
    return group


def _clamped(table, nodes):
    value = table.get("clamped", [], "[0]")
    if not isinstance(value, list) or any(isinstance(node, bool) or not isinstance(node, int) for node in value):
        raise InputError(f"{table.name('clamped')} must be a list of node numbers, as in [0], but is {value!r}.")
    return clamped_nodes(value, nodes, table.label.rstrip(":"))


def _filament_type(table, solvent):
    preset = PRESETS[table.choice("type", PRESETS)] if "type" in table else None
    if isinstance(preset, BeadSpringType) or (preset is None and "bead_spacing" in table):
        return _bead_spring_type(table, solvent, preset)
    _refuse_keys(table, _BEAD_KEYS, "a chain of beads: give its bead_spacing, or the type DSDNA_BASE_PAIRS")
    properties = _type_properties(table, _TYPE_QUANTITIES, _TYPE_TEXTS)
    if "persistence_length" in properties:
        properties.setdefault("temperature", solvent.temperature)
    elif "temperature" in properties:
        raise InputError(f"{table.label} temperature belongs to persistence_length; give both.")
    try:
        if preset is None:
            return _described_type(table, properties)
        if "segment_length" in properties:
            preset = preset.with_segment_length(properties.pop("segment_length"))
        return dataclasses.replace(preset, **_without_alternatives(properties)) if properties else preset
    except InputError as error:
        raise _named(table, error) from None


def _named(table, error):
    message = str(error)
    return InputError(message if message.startswith(table.label) else f"{table.label} {message}")


def _refuse_keys(table, keys, owner):
    for key in keys:
        if key in table:
            raise InputError(f"{table.name(key)} belongs to {owner}.")


def _bead_spring_type(table, solvent, preset):
    own = [key for key in _TYPE_KEYS if key not in _SHARED_KEYS]
    _refuse_keys(table, own, "a chain of cylinders, but this one has beads")
    quantities = {key: unit for key, unit in _TYPE_QUANTITIES.items() if key in _SHARED_KEYS} | _BEAD_QUANTITIES
    properties = _type_properties(table, quantities, ("name",))
    beads = table.whole_number("coarse_graining", 1, 1, "2")
    try:
        return _bead_spring(table, solvent, preset, properties).coarse_grained(beads)
    except InputError as error:
        raise _named(table, error) from None


def _bead_spring(table, solvent, preset, properties):
    reduced = [key for key in _BEAD_NUMBERS if key in table]
    if reduced and (preset is not None or len(reduced) < len(_BEAD_NUMBERS)):
        raise InputError(f"{table.label} nu and reduced_temperature go together, in a description without a type.")
    if reduced or "persistence_length" in properties:
        properties.setdefault("temperature", solvent.temperature)
    elif "temperature" in properties:
        raise InputError(f"{table.label} temperature belongs to persistence_length, or to reduced_temperature.")
    if preset is not None:
        # Attributes of a type hold its bending_rigidity alone.
        alternatives = {"bending_rigidity": None} if "persistence_length" in properties else {}
        return dataclasses.replace(preset, **{**alternatives, **properties}) if properties else preset
    missing = (("name", '"DNA"'), ("diameter", '"2 nm"'), ("bead_friction", '"1.91e-12 kg/s"'))
    for key, example in missing if reduced else (*missing, ("stretching_modulus", '"1100 pN"')):
        table.get(key, _REQUIRED, example)
    if not reduced:
        return BeadSpringType(**properties)
    _refuse_keys(
        table,
        ("bending_rigidity", "persistence_length", "stretching_modulus"),
        "a description without nu and reduced_temperature",
    )
    numbers = {key: table.number(key, None) for key in _BEAD_NUMBERS}
    return BeadSpringType.from_reduced(**properties, **numbers)


def _type_properties(table, quantities, texts):
    properties = {}
    for key, unit in quantities.items():
        if key in table:
            properties[key] = table.quantity(key, unit, zero_allowed=key == "bending_rigidity")
    for key in texts:
        if key in table:
            properties[key] = table.text(key)
    if "friction_length" in table:
        properties["friction_length"] = _friction_length(table)
    if "end_corrections" in table:
        properties["end_corrections"] = _end_corrections(table)
    return properties


def _friction_length(table):
    if table.text("friction_length") in ("segment", "filament"):
        return table.text("friction_length")
    return table.quantity("friction_length", units.LENGTH)


def _end_corrections(table):
    entries = table.get("end_corrections", {}, "")
    names = tuple(field.name for field in dataclasses.fields(EndCorrections))
    if not isinstance(entries, dict):
        raise InputError(
            f"{table.name('end_corrections')} must be a table such as "
            f"{{ parallel = -0.114, perpendicular = 0.886, rotational = -0.447 }}, but is {entries!r}."
        )
    corrections = _Table(entries, table.name("end_corrections"), names)
    return EndCorrections(**{name: corrections.number(name, getattr(EndCorrections, name)) for name in names})


def _described_type(table, properties):
    for key, example in (("diameter", '"6 nm"'), ("segment_length", '"360 nm"')):
        table.get(key, _REQUIRED, example)
    return FilamentType(**properties)


def _without_alternatives(properties):
    changed = dict(properties)
    if "bending_rigidity" in properties:
        changed["temperature"] = None
    for pair in _EXCLUSIVE:
        if any(key in properties for key in pair):
            for key in pair:
                changed.setdefault(key, None)
    return changed


_BOX_KEYS = ("edges",)


def _box(table):
    table.get("edges", _REQUIRED, _EDGES)
    edges = table.triple("edges", lambda text, name: parse_quantity(text, units.LENGTH, name), _EDGES)
    if min(edges) <= 0.0:
        raise InputError(f"{table.name('edges')} must be positive, but are {table.entries['edges']}.")
    return edges


_EDGES = '["1 um", "1 um", "1 um"]'

_HAND_QUANTITIES = {
    "binding_rate": units.RATE,
    "reach": units.LENGTH,
    "unbinding_rate": units.RATE,
    "unbinding_force": units.FORCE,
    "catch_rate": units.RATE,
    "catch_force": units.FORCE,
    "speed": units.VELOCITY,
    "stall_force": units.FORCE,
    "site_spacing": units.LENGTH,
}
_HAND_KEYS = (*_HAND_QUANTITIES, "strain_share", "walks_backward", "at_end", "binds_to")
_LINKER_KEYS = (
    "type",
    "name",
    "hand",
    "hands",
    "stiffness",
    "rest_length",
    "same_filament",
    "count",
    "concentration",
    "volume",
    "anchors",
    "bound",
)
_HAND_EXAMPLE = '{ binding_rate = "10 1/s", reach = "50 nm", unbinding_rate = "0.3 1/s" }'


def _linker_group(table, filaments, box):
    kind = _linker_kind(table)
    group = LinkerGroup(
        kind=kind,
        count=table.whole_number("count", 0, None, "1000"),
        concentration=table.quantity("concentration", units.NUMBER_DENSITY, None, zero_allowed=True),
        volume=table.quantity("volume", units.VOLUME, None),
        anchors=_anchors(table, sum(own.count * (own.segments + 1) for own in filaments)),
        bound=table.whole_number("bound", 0, 0, "100"),
    )
    try:
        as_linkers(kind, group.count, group.concentration, group.volume, group.anchors, group.bound, 0)
    except InputError as error:
        raise _named(table, error) from None
    if box is None and group.count is not None and group.volume is None:
        raise InputError(
            f"{table.label} Linkers that are not bound are in a volume: add a periodic [box] with edges = {_EDGES}, or "
            'to this table a line such as volume = "1 um^3".'
        )
    names = sorted({own.type.name for own in filaments})
    for hand in kind.hands:
        if box is not None and hand.reach >= 0.5 * min(box):
            raise InputError(
                f"{table.label} The reach of a hand, {hand.reach:g} nm, must be less than half of the shortest edge of "
                f"the box, {min(box):g} nm."
            )
        if not any(hand.binds(own.type) for own in filaments):
            raise InputError(
                f"{table.label} A hand binds to filaments of the type {' or '.join(hand.binds_to)}, but those of the "
                f'configuration are {", ".join(names)}: change it, as in hand = {{ binds_to = "{names[0]}" }}.'
            )
    return group


def _is_linked(group, linkers):
    return any(hand.binds(group.type) for own in linkers for hand in own.kind.hands)


def _linker_kind(table):
    preset = LINKER_PRESETS[table.choice("type", LINKER_PRESETS)] if "type" in table else None
    properties = {}
    if "stiffness" in table:
        properties["stiffness"] = table.quantity("stiffness", units.STIFFNESS)
    if "rest_length" in table:
        properties["rest_length"] = table.quantity("rest_length", units.LENGTH, zero_allowed=True)
    if "same_filament" in table:
        properties["same_filament"] = table.flag("same_filament")
    if "name" in table:
        properties["name"] = table.text("name")
    try:
        hands = _hands(table, preset)
        if hands is not None:
            properties["hands"] = hands
        if preset is not None:
            return dataclasses.replace(preset, **properties)
        table.get("stiffness", _REQUIRED, f'"{example_of(units.STIFFNESS)}"')
        return Crosslinker(**properties)
    except InputError as error:
        raise _named(table, error) from None


def _hands(table, preset):
    if "hand" in table and "hands" in table:
        raise InputError(f"{table.label} give hand, for two equal ones, or hands, not both.")
    if "hands" in table:
        tables = table.get("hands", [], "")
        if not isinstance(tables, list) or len(tables) != 2 or not all(isinstance(own, dict) for own in tables):
            raise InputError(
                f"{table.name('hands')} must be a list of two tables, as in [{_HAND_EXAMPLE}, {{ ... }}], but is "
                f"{tables!r}."
            )
        first = (None, None) if preset is None else preset.hands
        return tuple(
            _hand(_Table(own, table.name(f"hands[{number}]"), _HAND_KEYS), changed)
            for number, (own, changed) in enumerate(zip(tables, first))
        )
    if "hand" not in table:
        if preset is None:
            raise InputError(
                f"{table.label} lacks the key 'type': name a preset ({', '.join(LINKER_PRESETS)}), or describe the "
                f"linker with stiffness, rest_length and hand = {_HAND_EXAMPLE}"
            )
        return None
    entries = table.get("hand", {}, "")
    if not isinstance(entries, dict):
        raise InputError(f"{table.name('hand')} must be a table, as in hand = {_HAND_EXAMPLE}, but is {entries!r}.")
    own = _Table(entries, table.name("hand"), _HAND_KEYS)
    return _hand(own, None) if preset is None else tuple(_hand(own, changed) for changed in preset.hands)


def _hand(table, changed):
    properties = {}
    for key, unit in _HAND_QUANTITIES.items():
        if key in table:
            properties[key] = parse_quantity(table.entries[key], unit, table.name(key))
    if "strain_share" in table:
        properties["strain_share"] = table.number("strain_share", 0.0)
    if "walks_backward" in table:
        properties["walks_backward"] = table.flag("walks_backward")
    if "at_end" in table:
        properties["at_end"] = table.choice("at_end", AT_ENDS)
    if "binds_to" in table:
        properties["binds_to"] = _binds_to(table)
    if changed is None:
        for key in ("binding_rate", "reach", "unbinding_rate"):
            table.get(key, _REQUIRED, f'"{example_of(_HAND_QUANTITIES[key])}"')
    try:
        return Hand(**properties) if changed is None else dataclasses.replace(changed, **properties)
    except InputError as error:
        # Hands begin their messages with their own name.
        raise InputError(f"{table.label}: {str(error).removeprefix('Hand: ')}") from None


def _binds_to(table):
    names = table.get("binds_to", [], "")
    names = [names] if isinstance(names, str) else names
    if not isinstance(names, list) or not names or not all(isinstance(name, str) for name in names):
        raise InputError(
            f"{table.name('binds_to')} must be a name of a type of filaments, or a list of them, as in "
            f'["F_ACTIN"], but is {names!r}.'
        )
    return tuple(PRESETS[name].name if name in PRESETS else name for name in names)


def _anchors(table, particles):
    if "anchors" not in table:
        return None
    entries = table.entries["anchors"]
    example = '[["0 nm", "0 nm", "0 nm"], ["100 nm", "0 nm", "0 nm"]]'
    name = table.name("anchors")
    if not isinstance(entries, list) or not entries:
        raise InputError(f"{name} must be a list of points, as in {example}, or of numbers of nodes, as in [0, 64].")
    if all(isinstance(own, int) and not isinstance(own, bool) for own in entries):
        if not 0 <= min(entries) <= max(entries) < particles:
            raise InputError(f"{name} must be numbers of nodes between 0 and {particles - 1}, but are {entries}.")
        return tuple(entries)
    points = []
    for index, own in enumerate(entries):
        if not isinstance(own, list) or len(own) != 3:
            raise InputError(f"{name}[{index}] must be a point, as in {example}, but is {own!r}.")
        points.append(tuple(parse_quantity(text, units.LENGTH, f"{name}[{index}]") for text in own))
    return tuple(points)


_SIMULATION_KEYS = (
    "scheme",
    "time_step",
    "duration",
    "report_interval",
    "checkpoint_interval",
    "seed",
    "engine",
    "platform",
    "precision",
)


def _simulation(table, solvent, filaments, box, linkers):
    engine = table.choice("engine", ENGINES, None)
    if linkers and engine == "portable":
        raise InputError(f'{table.name("engine")} has no [[linkers]]: leave it out, or write "compiled".')
    scheme = table.choice("scheme", SCHEMES, None) or default_scheme(engine)
    report = table.quantity("report_interval", units.TIME)
    if table.text("time_step", example='"recommended"') == "recommended":
        if linkers:
            largest = recommended_step_of_network(solvent, filaments, box, linkers, engine, scheme).step
        else:
            largest = _recommended_of(scheme, solvent, filaments)
        time_step = _divisor(report, largest)
    else:
        time_step = table.quantity("time_step", units.TIME)
    steps_per_report = _multiple(table.name("report_interval"), report, "time_step", time_step)
    duration = table.quantity("duration", units.TIME)
    checkpoint = table.quantity("checkpoint_interval", units.TIME, None)
    reports = _multiple(table.name("duration"), duration, "report_interval", report)
    reports_per_checkpoint = 10
    if checkpoint is not None:
        reports_per_checkpoint = _multiple(table.name("checkpoint_interval"), checkpoint, "report_interval", report)
    seed = table.whole_number("seed", 1, 1, "1")
    if seed >= 2**31:
        raise InputError(f"{table.name('seed')} must be below 2^31, but is {seed}.")
    return SimulationSettings(
        scheme=scheme,
        time_step=time_step,
        steps=reports * steps_per_report,
        steps_per_report=steps_per_report,
        steps_per_checkpoint=reports_per_checkpoint * steps_per_report,
        seed=seed,
        engine=engine,
        platform=table.text("platform", "Reference"),
        precision=table.choice("precision", PRECISIONS, None),
    )


def _recommended_of(scheme, solvent, filaments):
    return min(
        recommended_time_step(group.type, solvent.viscosity, solvent.temperature, scheme, group.segments).step
        for group in filaments
    )


def _divisor(report, largest):
    # The largest step that fits into a report interval a whole number of times and exceeds the recommendation, which
    # is no sharper than that, by at most 0.1 %.
    return report / max(1, math.ceil(report / largest * (1.0 - 1e-3)))


def _multiple(name, interval, base_name, base):
    ratio = interval / base
    count = round(ratio)
    if count >= 1 and abs(ratio - count) <= 1e-6 * max(1.0, 1e-3 * ratio):
        return count
    below, above = math.floor(ratio), math.floor(ratio) + 1
    nearest = " or ".join(f'"{format_time(n * base, 12)}"' for n in (below, above) if n > 0)
    raise InputError(
        f"{name} is {format_time(interval, 12)}, which is not a whole multiple of {base_name}, "
        f"{format_time(base, 12)}: use {nearest}."
    )
