"""[[monomers]], of which filaments grow."""

import dataclasses
from dataclasses import dataclass

from ...filaments.monomers import MonomerPool, Monomers, MonomerState
from ...filaments.presets import ACTIN_AGING, ACTIN_ATP, TUBULIN, TUBULIN_IN_MITOSIS
from ...units import quantities as units
from ..keys import REQUIRED, Choice, Inline, Key, Listing, Quantity, Text, WordOrQuantity
from ..table import TableKind
from .solvent import EDGES
from .walls import volume_of_walls

PRESETS = {
    "ACTIN_ATP": ACTIN_ATP,
    "ACTIN_AGING": ACTIN_AGING,
    "TUBULIN": TUBULIN,
    "TUBULIN_IN_MITOSIS": TUBULIN_IN_MITOSIS,
}
"""Monomers by the names that a configuration uses."""

_RATES = ("plus_on_rate", "plus_off_rate", "minus_on_rate", "minus_off_rate")

_AGE_EXAMPLE = '{ name = "ADP", rate = "0.003 1/s", plus_off_rate = "5.4 1/s" }'
_AGE = TableKind(
    "aging",
    (
        Key("name", Text('"ADP"'), REQUIRED, "What the state is called."),
        Key("rate", Quantity(units.RATE, "zero"), REQUIRED, "At which monomers come to it from the state before."),
        Key(
            "plus_off_rate", Quantity(units.RATE, "zero"), None, "k_off of such a monomer at the end at the last node."
        ),
        Key("minus_off_rate", Quantity(units.RATE, "zero"), None, "k_off of one at the first node."),
        Key("plus_on_rate", Quantity(units.ON_RATE, "zero"), None, "k_on there; that of new monomers if not given."),
        Key("minus_on_rate", Quantity(units.ON_RATE, "zero"), None, "k_on at the first node, likewise."),
    ),
    "A state that monomers come to after some time, see `MonomerState`.",
    owner="aging of [[monomers]]",
)

MONOMERS = TableKind(
    "monomers",
    (
        Key("type", Choice(tuple(PRESETS)), None, "A preset, of which any property can be changed by the keys below."),
        Key("name", Text('"actin"'), None, "What filaments call them; the type if not given."),
        Key("length", Quantity(units.LENGTH), None, "By which a filament grows with a monomer."),
        Key(
            "plus_on_rate",
            Quantity(units.ON_RATE, "zero"),
            None,
            "k_on of the end at the last node, which gains k_on c monomers per time.",
        ),
        Key("plus_off_rate", Quantity(units.RATE, "zero"), None, "k_off of that end: it loses so many."),
        Key("minus_on_rate", Quantity(units.ON_RATE, "zero"), None, "k_on of the end at the first node."),
        Key("minus_off_rate", Quantity(units.RATE, "zero"), None, "k_off of that end."),
        Key(
            "aging",
            Listing(Inline(_AGE, _AGE_EXAMPLE), "tables", f"[{_AGE_EXAMPLE}]", 0),
            None,
            "States to which monomers come one after the other. The rates above are those of new ones.",
        ),
        Key(
            "concentration",
            Quantity(units.NUMBER_DENSITY, "zero"),
            REQUIRED,
            "Of free monomers, c; with a volume, at the start.",
        ),
        Key(
            "volume",
            WordOrQuantity(("box",), units.VOLUME),
            None,
            'In which they are, "box" for what the wall and the box leave. A filament takes monomers out of it, and '
            "they become fewer. Without it, their concentration stays as it is.",
        ),
    ),
    "Monomers of which filaments grow, and how many are free, see `Monomers` and `MonomerPool`. Filaments that name "
    "the same table share them.",
    repeated=True,
)


@dataclass(frozen=True)
class MonomerGroup:
    """A [[monomers]] table: its name, what they are, and those that are free."""

    name: str
    monomers: Monomers
    pool: MonomerPool


def read_monomers(entries, box, walls):
    """The MonomerGroup of a [[monomers]] table."""
    preset = PRESETS[entries["type"]] if "type" in entries else None
    name = entries["name"] or entries["type"]
    if name is None:
        raise entries.error(
            f"lacks the key 'type': name a preset ({', '.join(PRESETS)}), or describe the monomers with name, length "
            f"and {', '.join(_RATES)}."
        )
    properties = entries.given("length", *_RATES)
    if "aging" in entries:
        properties["aging"] = [_age(own) for own in entries["aging"]]
    if preset is None:
        entries.require("length")
    if preset is None and not any(properties.get(rate) for rate in _RATES):
        raise entries.error('lacks its rates: add lines such as plus_on_rate = "11.6 1/(uM*s)"')
    volume = entries["volume"]
    if volume == "box":
        volume = volume_of_walls(walls, box)
        if volume is None:
            raise entries.at("volume").error(
                "is that which walls and the box leave, but they do not say it: add a periodic [box] with edges = "
                f'{EDGES.example}, or write a volume, as in "1 um^3".'
            )
    with entries.naming():
        monomers = Monomers(**properties) if preset is None else dataclasses.replace(preset, **properties)
        return MonomerGroup(name, monomers, MonomerPool(entries["concentration"], volume))


def _age(entries):
    with entries.naming():
        return MonomerState(**entries.given(*_AGE.names))


def check_names(tables, groups):
    """Raise ConfigurationError unless MonomerGroups of tables have different names."""
    names = [own.name for own in groups]
    for entries, name in zip(tables, names):
        if names.count(name) > 1:
            raise entries.error(f"is called {name!r}, and so is another one: give each a name of its own.")
