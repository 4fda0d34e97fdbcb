"""Filament types in a configuration: presets, what is changed of them, and descriptions of one's own."""

import dataclasses

from ...bead_spring.bead_spring_type import DSDNA_BASE_PAIRS, BeadSpringType
from ...filaments.filament_type import FilamentType
from ...filaments.presets import DSDNA, F_ACTIN, MICROTUBULE
from ...mechanics.friction import EndCorrections
from ...mechanics.potentials import BENDING_POTENTIALS, STRETCHING_POTENTIALS
from ...theory import calibrated_up_to_force
from ...units import quantities as units
from ..keys import Choice, Inline, Key, Number, Quantity, Text, Whole, WordOrQuantity, as_written
from ..table import TableKind

PRESETS = {"F_ACTIN": F_ACTIN, "DSDNA": DSDNA, "MICROTUBULE": MICROTUBULE, "DSDNA_BASE_PAIRS": DSDNA_BASE_PAIRS}
"""Filament types by the names that a configuration uses."""

MONOMER_LENGTHS = {
    "F_ACTIN": 2.73,
    "DSDNA": 0.34,
    "MICROTUBULE": 8.0 / 13.0,
    "DSDNA_BASE_PAIRS": DSDNA_BASE_PAIRS.segment_length,
}
"""Lengths in nm per monomer: subunits of actin (Holmes, Popp, Gebhard and Kabsch, Nature 1990, 347, 44), base pairs,
and dimers of tubulin in 13 protofilaments."""


class TypeNames:
    """Names of filament types, or of other things: one, or a list of them."""

    def __init__(self, things="a type of filaments", example='"F_ACTIN"'):
        self.text = f"a name of {things}, or a list of them"
        self.example = example

    def read(self, value, place):
        names = [value] if isinstance(value, str) else value
        if not isinstance(names, list) or not names or not all(isinstance(name, str) for name in names):
            raise place.error(f'must be {self.text}, as in ["F_ACTIN"], but is {as_written(names)}.')
        return tuple(PRESETS[name].name if name in PRESETS else name for name in names)

    def schema(self):
        return {"anyOf": [{"type": "string"}, {"type": "array", "items": {"type": "string"}, "minItems": 1}]}


_CORRECTIONS = TableKind(
    "end_corrections",
    tuple(
        Key(
            field.name,
            Number(f"{field.default}"),
            field.default,
            "End correction of the friction of a cylinder, eq. (20) of the paper.",
        )
        for field in dataclasses.fields(EndCorrections)
    ),
    "End corrections of friction.",
)

_QUANTITIES = {
    "diameter": (units.LENGTH, "Diameter of the filament."),
    "segment_length": (units.LENGTH, "Length of a segment at rest."),
    "bending_rigidity": (
        units.BENDING_RIGIDITY,
        "Bending rigidity of the filament, a; joints have a/l0, as in the paper.",
    ),
    "persistence_length": (units.LENGTH, "In place of bending_rigidity: persistence length of the chain of segments."),
    "temperature": (
        units.TEMPERATURE,
        "Temperature at which the filament has its persistence_length; that of the solvent if not given.",
    ),
    "stretching_stiffness": (units.STIFFNESS, "Stiffness of one segment."),
    "stretching_modulus": (units.FORCE, "In place of stretching_stiffness: stiffness times length of a segment."),
    "maximum_extension": (units.LENGTH, 'Largest extension of a segment with stretching_model = "fene".'),
    "extension_relaxation_time": (units.TIME, "Time in which the length of a segment relaxes."),
    "extensional_friction": (
        units.ROTATIONAL_FRICTION,
        "In place of extension_relaxation_time: friction of a change of length.",
    ),
    "torsional_rigidity": (units.BENDING_RIGIDITY, "Torsional rigidity, C; without it, filaments have no twist."),
    "twist_persistence_length": (units.LENGTH, "In place of torsional_rigidity: C over k_B T, as persistence_length."),
    "intrinsic_twist": (units.ANGLE_PER_LENGTH, "How much filaments with twist are twisted at rest; right-handed."),
    "mass_per_length": (units.MASS_PER_LENGTH, "For other programs: motion does not depend on it."),
}
# All others are positive.
_SIGNS = {"bending_rigidity": "zero", "intrinsic_twist": "any"}
_TEXTS = ("name", "element", "bending_model", "stretching_model")
_CYLINDER_KEYS = (*_TEXTS, *_QUANTITIES, "friction_length", "end_corrections")
_BEAD_QUANTITIES = {
    "bead_spacing": (units.LENGTH, "Distance of beads at rest, which makes the type a chain of beads."),
    "bead_friction": (units.FRICTION, "Friction of a bead."),
    "bead_mass": (units.MASS, "Mass of a bead: motion does not depend on it."),
}
_BEAD_NUMBERS = ("nu", "reduced_temperature")
_BEAD_KEYS = (*_BEAD_QUANTITIES, *_BEAD_NUMBERS, "coarse_graining")
# Of both.
_SHARED_KEYS = ("name", "diameter", "bending_rigidity", "persistence_length", "temperature", "stretching_modulus")

TYPE_KEYS = (
    Key("type", Choice(tuple(PRESETS)), None, "A preset, of which any property can be changed by the keys below."),
    Key("name", Text('"DNA"'), None, "Name of your own type: up to 5 letters or digits."),
    Key("element", Choice(("straight", "beam")), None, 'What segments are: "beam" elements bend inside.'),
    Key("bending_model", Choice(tuple(BENDING_POTENTIALS)), None, "See `FilamentType`."),
    Key("stretching_model", Choice(tuple(STRETCHING_POTENTIALS)), None, "See `FilamentType`."),
    *(
        Key(name, Quantity(unit, _SIGNS.get(name, "positive")), None, text)
        for name, (unit, text) in _QUANTITIES.items()
    ),
    Key(
        "friction_length",
        WordOrQuantity(("segment", "filament"), units.LENGTH),
        None,
        "Length in the friction of a cylinder, eq. (20).",
    ),
    Key(
        "end_corrections",
        Inline(_CORRECTIONS, "{ parallel = -0.114 }"),
        None,
        "Corrections for the ends of a cylinder, eq. (20).",
    ),
    *(Key(name, Quantity(unit), None, text) for name, (unit, text) in _BEAD_QUANTITIES.items()),
    Key(
        "nu",
        Number("0.35"),
        None,
        "With reduced_temperature, describes a chain of beads: see `BeadSpringType.from_reduced`.",
    ),
    Key("reduced_temperature", Number("0.034"), None, "See nu."),
    Key(
        "calibrated_up_to_force",
        Quantity(units.FORCE),
        None,
        "Force up to which the chain of segments follows the wormlike chain: `theory.calibrated_up_to_force`. "
        "segment_length is then the length of filament that a segment stands for.",
    ),
    Key("coarse_graining", Whole(1, 10**6, "2"), 1, "How many beads of the type become one."),
)
"""Of a [[filament]] table: what kind of filament it is."""

# What presets have and beam elements do not.
_OF_STRAIGHT_SEGMENTS = {
    "bending_model": "inscribed-circle",
    "extension_relaxation_time": None,
    "extensional_friction": None,
}
# Setting one of a pair in a preset takes the place of the other.
_EXCLUSIVE = (
    ("bending_rigidity", "persistence_length"),
    ("stretching_stiffness", "stretching_modulus"),
    ("extension_relaxation_time", "extensional_friction"),
)


def read_filament_type(entries, solvent):
    """The FilamentType or BeadSpringType of a [[filament]] table."""
    if not entries.given("type", "name"):
        raise entries.error(
            f"lacks the key 'type': name a preset ({', '.join(PRESETS)}), or describe the filament "
            "with name, diameter, segment_length and the other properties of a FilamentType, or with bead_spacing and "
            "those of a BeadSpringType."
        )
    preset = PRESETS[entries["type"]] if "type" in entries else None
    with entries.naming():
        if isinstance(preset, BeadSpringType) or (preset is None and "bead_spacing" in entries):
            entries.refuse(("calibrated_up_to_force",), "belongs to a chain of cylinders, but this one has beads.")
            return _bead_spring_type(entries, solvent, preset)
        kind = _cylinder_type(entries, solvent, preset)
        if "calibrated_up_to_force" not in entries:
            return kind
        if solvent.temperature == 0.0:
            raise entries.error("calibrated_up_to_force needs a temperature above zero.")
        return calibrated_up_to_force(kind, entries["calibrated_up_to_force"], solvent.temperature)


def _cylinder_type(entries, solvent, preset):
    entries.refuse(_BEAD_KEYS, "belongs to a chain of beads: give its bead_spacing, or the type DSDNA_BASE_PAIRS.")
    properties = entries.given(*_CYLINDER_KEYS)
    if "end_corrections" in properties:
        properties["end_corrections"] = EndCorrections(**properties["end_corrections"].values)
    lengths = entries.given("persistence_length", "twist_persistence_length")
    if lengths:
        temperature = properties.setdefault("temperature", solvent.temperature)
    else:
        entries.refuse(("temperature",), "belongs to persistence_length or twist_persistence_length; give both.")
    if "twist_persistence_length" in properties and "torsional_rigidity" not in properties:
        # A bending_rigidity beside it has no temperature.
        length = properties.pop("twist_persistence_length")
        properties["torsional_rigidity"] = length * units.thermal_energy(temperature)
        if "persistence_length" not in properties:
            del properties["temperature"]
    if preset is None:
        entries.require("diameter", "segment_length")
        return FilamentType(**properties)
    if properties.get("element") == "beam":
        properties = {**_OF_STRAIGHT_SEGMENTS, **properties}
    if "segment_length" in properties:
        preset = preset.with_segment_length(properties.pop("segment_length"))
    return dataclasses.replace(preset, **_without_alternatives(properties)) if properties else preset


def _without_alternatives(properties):
    changed = dict(properties)
    if "bending_rigidity" in properties:
        changed["temperature"] = None
    for pair in _EXCLUSIVE:
        if any(key in properties for key in pair):
            for key in pair:
                changed.setdefault(key, None)
    return changed


def _bead_spring_type(entries, solvent, preset):
    own = [key for key in _CYLINDER_KEYS if key not in _SHARED_KEYS]
    entries.refuse(own, "belongs to a chain of cylinders, but this one has beads.")
    properties = entries.given(*_SHARED_KEYS, *_BEAD_QUANTITIES)
    numbers = entries.given(*_BEAD_NUMBERS)
    if numbers and (preset is not None or len(numbers) < len(_BEAD_NUMBERS)):
        raise entries.error("nu and reduced_temperature go together, in a description without a type.")
    if numbers or "persistence_length" in properties:
        properties.setdefault("temperature", solvent.temperature)
    else:
        entries.refuse(("temperature",), "belongs to persistence_length, or to reduced_temperature.")
    return _bead_spring(entries, preset, properties, numbers).coarse_grained(entries["coarse_graining"])


def _bead_spring(entries, preset, properties, numbers):
    if preset is not None:
        # Attributes of a type hold its bending_rigidity alone.
        alternatives = {"bending_rigidity": None} if "persistence_length" in properties else {}
        return dataclasses.replace(preset, **{**alternatives, **properties}) if properties else preset
    entries.require("name", "diameter", "bead_friction")
    if not numbers:
        entries.require("stretching_modulus")
        return BeadSpringType(**properties)
    entries.refuse(
        ("bending_rigidity", "persistence_length", "stretching_modulus"),
        "belongs to a description without nu and reduced_temperature.",
    )
    return BeadSpringType.from_reduced(**properties, **numbers)
