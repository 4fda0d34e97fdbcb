"""The configuration of a run: a TOML file with units, read into frozen dataclasses and checked.

    [solvent]            temperature, viscosity
    [[filament]]         one or more: type or a description, segments, count, start, position, direction, clamped
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
from ..mechanics.friction import EndCorrections
from ..units import quantities as units
from ..units.text import example as example_of
from ..units.text import format_time, parse_quantity

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
    """One [[filament]] table: ``count`` filaments of one type, length and start; lengths in nm."""

    type: ChainType
    segments: int
    count: int
    start: str
    position: tuple
    direction: tuple
    clamped: tuple


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
    """Everything that a run needs; ``text`` is the file that it was read from."""

    title: str
    solvent: Solvent
    filaments: tuple
    simulation: SimulationSettings
    text: str = dataclasses.field(compare=False, repr=False)


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
    top = _Table(entries, "the configuration", ("title", "solvent", "filament", "simulation"))
    solvent = _solvent(top.table("solvent", _SOLVENT_KEYS))
    filaments = tuple(_filament_group(table, solvent) for table in top.tables("filament", _FILAMENT_KEYS))
    simulation = _simulation(top.table("simulation", _SIMULATION_KEYS), solvent, filaments)
    return Configuration(top.text("title", ""), solvent, filaments, simulation, text)


def changed_keys(first, second):
    """Names of the tables and entries in which two configurations differ, apart from their text."""
    names = [] if first.title == second.title else ["title"]
    for table in ("solvent", "simulation"):
        names += _changed_fields(getattr(first, table), getattr(second, table), f"[{table}]")
    if len(first.filaments) != len(second.filaments):
        return [*names, "the number of [[filament]] tables"]
    for number, (one, other) in enumerate(zip(first.filaments, second.filaments), start=1):
        names += _changed_fields(one, other, f"[[filament]] number {number}:")
    return names


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
        if not entries:
            raise InputError(f"There is no [[{key}]] table: add one for every kind of filament.")
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


def _simulation(table, solvent, filaments):
    engine = table.choice("engine", ENGINES, None)
    scheme = table.choice("scheme", SCHEMES, None) or default_scheme(engine)
    report = table.quantity("report_interval", units.TIME)
    if table.text("time_step", example='"recommended"') == "recommended":
        time_step = _recommended_divisor(report, scheme, solvent, filaments)
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


def _recommended_divisor(report, scheme, solvent, filaments):
    # The largest step that fits into a report interval a whole number of times and exceeds the recommendation, which
    # is no sharper than that, by at most 0.1 %.
    largest = min(
        recommended_time_step(group.type, solvent.viscosity, solvent.temperature, scheme, group.segments).step
        for group in filaments
    )
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
