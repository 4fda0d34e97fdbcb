"""[[monomers]], of which filaments grow, and the ``growth`` of a [[filament]] table."""

import dataclasses
from dataclasses import dataclass

from ...engine_choice import choose_engine
from ...filaments.end_states import DynamicInstability, TwoUnitCap
from ...filaments.growth import Growth, MonomerPool, Monomers, MonomerState, Severing
from ...filaments.presets import ACTIN_AGING, ACTIN_ATP, TUBULIN
from ...time_steps.schemes import IMPLICIT_SCHEMES
from ...units import quantities as units
from ..keys import REQUIRED, Choice, Flag, Inline, Key, Listing, Quantity, Text, WordOrQuantity
from ..table import TableKind
from .couplings import group_of
from .shapes import volume_within
from .solvent import EDGES

PRESETS = {"ACTIN_ATP": ACTIN_ATP, "ACTIN_AGING": ACTIN_AGING, "TUBULIN": TUBULIN}
"""Monomers by the names that a configuration uses."""

_RATES = ("plus_on_rate", "plus_off_rate", "minus_on_rate", "minus_off_rate")
_INSTABILITY = ("catastrophe_rate", "rescue_rate", "shrinking_off_rate")
_CAP = ("hydrolysis_rate", "rescue_rate", "shrinking_off_rate")
_OF_GROWTH = ("longest", "shortest", "plus_capped", "minus_capped", "deterministic", "growing_force", "vanishes")
GROWTH_EXAMPLE = '{ longest = "5 um" }'
SEVERING_EXAMPLE = '{ longest = "5 um", severing_rate = "0.01 1/(um*s)" }'

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

GROWTH = TableKind(
    "growth",
    (
        Key("monomers", Text('"actin"'), None, "Name of a [[monomers]] table; of the only one if not given."),
        Key("longest", Quantity(units.LENGTH), REQUIRED, "Length for which a filament has spare nodes."),
        Key("shortest", Quantity(units.LENGTH), None, "To which it shrinks at most; half a segment if not given."),
        Key("plus_capped", Flag(), False, "Whether the end at the last node neither gains nor loses monomers."),
        Key("minus_capped", Flag(), False, "Whether that at the first node does not."),
        Key(
            "catastrophe_rate",
            Quantity(units.RATE, "zero"),
            None,
            "At which the plus end begins to shrink, if it grows and shrinks in turn: see `DynamicInstability`.",
        ),
        Key(
            "hydrolysis_rate",
            Quantity(units.RATE, "zero"),
            None,
            "In place of it, of an end with a cap of two monomers, which shrinks when both have hydrolysed: at which "
            "each of them does. See `TwoUnitCap`.",
        ),
        Key(
            "rescue_rate",
            Quantity(units.RATE, "zero"),
            None,
            "At which it begins to grow again; with hydrolysis_rate zero if not given.",
        ),
        Key("shrinking_off_rate", Quantity(units.RATE, "zero"), None, "How many monomers it loses while it shrinks."),
        Key(
            "deterministic",
            Flag(),
            False,
            "Whether monomers come and go at regular times, so that filaments grow at a constant speed.",
        ),
        Key(
            "growing_force",
            Quantity(units.FORCE),
            None,
            "F_g of the rate k_on c exp(-F/F_g) under the load F; kT over the length of a monomer, which has an "
            "equilibrium, if not given.",
        ),
        Key("vanishes", Flag(), False, "Whether a filament of the shortest length vanishes with its next monomer."),
        Key(
            "severing_rate",
            Quantity(units.RATE_PER_LENGTH, "zero"),
            None,
            "How often it is cut in a length, at random: see `Severing`. Parts need places: reserve of [[filament]].",
        ),
        Key(
            "severing_states",
            Listing(Text('"ADP"'), "names of states", '["ADP"]'),
            None,
            "Of monomers that age: before which of them it is cut, any if not given; the first one is called new.",
        ),
        Key(
            "severed_ends_shrink",
            Flag(),
            False,
            "Whether plus ends that cuts make shrink, where these grow and shrink in turn.",
        ),
    ),
    "How filaments grow and shrink at their ends, see `Growth`.",
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
        volume = volume_within([wall.shape for wall in walls], box)
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


def read_growth(entries, monomers):
    """The Growth of a ``growth`` table, for MonomerGroups."""
    found = [own for own in monomers if entries["monomers"] in (None, own.name)]
    if not monomers:
        raise entries.error(
            'needs monomers: add a [[monomers]] table with lines such as type = "ACTIN_ATP" and concentration = "1 uM"'
        )
    if not found:
        names = ", ".join(own.name for own in monomers)
        raise entries.at("monomers").error(f"is {entries['monomers']!r}, but there are {names}.")
    if len(found) > 1:
        names = ", ".join(own.name for own in monomers)
        raise entries.error(f"lacks the key 'monomers': there are {names}.")
    with entries.naming():
        return Growth(
            monomers=found[0].monomers,
            pool=found[0].pool,
            plus_instability=_instability(entries),
            severing=_severing(entries),
            **{name: entries[name] for name in _OF_GROWTH},
        )


def _instability(entries):
    if "hydrolysis_rate" in entries:
        entries.refuse(("catastrophe_rate",), "cannot be with hydrolysis_rate, which says when an end shrinks.")
        entries.require("shrinking_off_rate")
        return TwoUnitCap(**entries.given(*_CAP))
    turning = entries.given(*_INSTABILITY)
    missing = [name for name in _INSTABILITY if name not in turning]
    if turning and missing:
        raise entries.error(f"lacks the key {missing[0]!r}: an end that grows and shrinks in turn has all three rates.")
    return DynamicInstability(**turning) if turning else None


def _severing(entries):
    if "severing_rate" not in entries:
        entries.refuse(("severing_states", "severed_ends_shrink"), "belongs to severing_rate.")
        return None
    states, shrinks = entries["severing_states"] or (), entries["severed_ends_shrink"]
    return Severing(rate=entries["severing_rate"], of_states=states, shrinks=shrinks)


def check_with_others(tables, configuration, settings):
    """Raise ConfigurationError where filaments that grow have what they cannot have.

    ``tables`` are the entries of all tables, by names; ``settings`` those of [simulation].
    """
    groups = configuration.filaments
    if all(group.growth is None for group in groups):
        _refuse_unused(tables["monomers"])
        return
    with settings.naming():
        if choose_engine(settings["engine"]) != "compiled":
            raise settings.at("engine").error('has no filaments that grow: leave growth out, or write "compiled".')
    if settings["scheme"] not in (None, *IMPLICIT_SCHEMES):
        raise settings.at("scheme").error('has no filaments that grow: leave it out, or write "implicit".')
    for entries, own in zip(tables["linkers"], configuration.linkers):
        if own.anchors is not None and isinstance(own.anchors[0], int):
            raise entries.at("anchors").error("must be points where filaments grow, but are numbers of nodes.")
    for name, what in (("tether", "tethers do not hold"), ("pull", "constant forces do not pull at")):
        for entries, own in zip(tables[name], getattr(configuration, f"{name}s")):
            for number in own.filaments:
                _refuse_growth(entries, number, groups, what)
    for entries, own in zip(tables["link"], configuration.links):
        if own.between is None:
            raise entries.at("within").error("may join filaments that grow, which links do not yet: give between.")
        for place in own.between:
            if place["filament"] is not None:
                _refuse_growth(entries, place["filament"], groups, "links do not join")


def _refuse_unused(tables):
    for entries in tables:
        raise entries.error(f"but no filaments grow: add to a [[filament]] table the line growth = {GROWTH_EXAMPLE}")


def _refuse_growth(entries, number, groups, what):
    group = group_of(number, groups)
    if group.growth is not None:
        raise entries.error(
            f"means filament {number}, which grows ({group.label}): {what} filaments that grow "
            "yet. Leave its growth out, or take another filament."
        )
