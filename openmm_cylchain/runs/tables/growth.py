"""The ``growth`` of a [[filament]] table: how filaments gain and lose monomers at their ends."""

from ...engine_choice import choose_engine
from ...filaments.end_states import ENDS, DynamicInstability, EndStates, TwoUnitCap
from ...filaments.growth import Growth
from ...filaments.presets import MDIA1_ENDS
from ...filaments.severing import Severing
from ...time_steps.schemes import IMPLICIT_SCHEMES
from ...units import quantities as units
from ..keys import REQUIRED, Choice, Either, Flag, Inline, Key, Listing, Named, Quantity, Text, close_match
from ..table import TableKind, group_of

PRESETS = {"MDIA1_ENDS": MDIA1_ENDS}
"""States of ends by the names that a configuration uses."""

_INSTABILITY = ("catastrophe_rate", "rescue_rate", "shrinking_off_rate")
_OF_CATASTROPHES = ("shrinking_on_rate", "blocked_catastrophe_rate", "catastrophe_length")
_TURNING = (*_INSTABILITY, "hydrolysis_rate", *_OF_CATASTROPHES, "renucleation_rate")
_PREFIXES = {"minus": "minus_", "plus": ""}
"""Of what turns each end."""
_OF_GROWTH = ("longest", "shortest", "plus_capped", "minus_capped", "deterministic", "growing_force", "vanishes")
GROWTH_EXAMPLE = '{ longest = "5 um" }'
SEVERING_EXAMPLE = '{ longest = "5 um", severing_rate = "0.01 1/(um*s)" }'

_STATE_EXAMPLE = '{ name = "paused", on_rate = "0 1/(uM*s)", switch_rates = { growing = "0.2 1/s" } }'
_STATE = TableKind(
    "states",
    (
        Key("name", Text('"paused"'), REQUIRED, "What the state is called."),
        Key("on_rate", Quantity(units.ON_RATE, "zero"), None, "k_on in it; as of the monomers there if not given."),
        Key("off_rate", Quantity(units.RATE, "zero"), None, "k_off in it, likewise."),
        Key(
            "switch_rates",
            Named(Quantity(units.RATE, "zero"), "rates by names of states", '{ growing = "0.2 1/s" }'),
            None,
            "At which it changes to other states by itself, by their names; to none if not given.",
        ),
        Key(
            "blocked_switch_rates",
            Named(Quantity(units.RATE, "zero"), "rates by names of states", '{ shrinking = "0.5 1/s" }'),
            None,
            "How much larger switch_rates are while growth is blocked; not at all if not given.",
        ),
        Key(
            "shortest_switch_rates",
            Named(Quantity(units.RATE, "zero"), "rates by names of states", '{ growing = "1 1/s" }'),
            None,
            "How much larger switch_rates are while the filament has its shortest length; not at all if not given.",
        ),
        Key(
            "switch_length",
            Quantity(units.LENGTH),
            None,
            "Rates at which it changes are those of a filament of this length, and proportional to lengths, if given.",
        ),
        Key("after_gain", Text('"growing"'), None, "State after a monomer has come; as it is if not given."),
        Key("after_loss", Text('"paused"'), None, "State after a monomer has gone; as it is if not given."),
    ),
    "A state of an end, see `EndStates`. Ends are in the first one at first.",
    owner="plus_states or minus_states of growth",
)


_STATES = Listing(Inline(_STATE, _STATE_EXAMPLE), "tables", f"[{_STATE_EXAMPLE}]")

_RATE = Quantity(units.RATE, "zero")
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
            _RATE,
            None,
            "At which the plus end begins to shrink, if it grows and shrinks in turn: see `DynamicInstability`.",
        ),
        Key(
            "hydrolysis_rate",
            _RATE,
            None,
            "In place of it, of an end with a cap of two monomers, which shrinks when both have hydrolysed: at which "
            "each of them does. See `TwoUnitCap`.",
        ),
        Key("rescue_rate", _RATE, None, "At which it begins to grow again; with hydrolysis_rate zero if not given."),
        Key("shrinking_off_rate", _RATE, None, "How many monomers it loses while it shrinks."),
        Key(
            "shrinking_on_rate",
            Quantity(units.ON_RATE, "zero"),
            None,
            "k_on while it shrinks, with catastrophe_rate; zero if not given.",
        ),
        Key(
            "blocked_catastrophe_rate",
            _RATE,
            None,
            "catastrophe_rate of an end whose growth is blocked; between, the rate falls with the share of monomers "
            "that come. As that of a free one if not given.",
        ),
        Key(
            "catastrophe_length",
            Quantity(units.LENGTH),
            None,
            "catastrophe_rate is that of a filament of this length, and proportional to lengths, if given.",
        ),
        Key(
            "renucleation_rate",
            _RATE,
            None,
            "At which the plus end grows again when its filament has shrunk to the shortest; rescue_rate if not given.",
        ),
        Key("minus_catastrophe_rate", _RATE, None, "At which the minus end begins to shrink; as that of the plus end."),
        Key("minus_hydrolysis_rate", _RATE, None, "In place of it, likewise."),
        Key("minus_rescue_rate", _RATE, None, "At which the minus end begins to grow again."),
        Key("minus_shrinking_off_rate", _RATE, None, "How many monomers the minus end loses while it shrinks."),
        Key("minus_shrinking_on_rate", Quantity(units.ON_RATE, "zero"), None, "k_on of the minus end, likewise."),
        Key("minus_blocked_catastrophe_rate", _RATE, None, "That of a minus end whose growth is blocked, likewise."),
        Key("minus_catastrophe_length", Quantity(units.LENGTH), None, "Of catastrophes of the minus end, likewise."),
        Key("minus_renucleation_rate", _RATE, None, "At which the minus end of the shortest grows again, likewise."),
        Key(
            "plus_states",
            Either(((list, _STATES), (object, Choice(tuple(PRESETS))))),
            None,
            "In place of these, states of your own of the plus end, the first one first; or a preset.",
        ),
        Key("minus_states", _STATES, None, "States of your own of the minus end."),
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
            **{f"{end}_instability": _instability(entries, end, found[0].monomers) for end in ENDS},
            severing=_severing(entries),
            **{name: entries[name] for name in _OF_GROWTH},
        )


def _instability(entries, end, monomers):
    # What makes the "plus" or "minus" end turn, for its Monomers; None if nothing does.
    prefix, states = _PREFIXES[end], f"{end}_states"
    given = {name: entries[prefix + name] for name in _TURNING if prefix + name in entries}
    if states in entries:
        entries.refuse([prefix + name for name in given], f"cannot be with {states}, which say what that end does.")
    elif not given:
        return None
    first = entries.at(states if states in entries else prefix + next(iter(given)))
    if monomers.aging:
        raise first.error(
            "cannot be with monomers that age, which decide what ends do: take other monomers, or leave it out."
        )
    if entries[f"{end}_capped"]:
        raise first.error(f"cannot be with {end}_capped = true: leave one of them out.")
    if states in entries:
        if isinstance(entries[states], str):
            return PRESETS[entries[states]]
        return _states(entries[states], *(getattr(monomers, f"{end}_{which}_rate") for which in ("on", "off")))
    if "hydrolysis_rate" in given:
        others = [prefix + name for name in ("catastrophe_rate", *_OF_CATASTROPHES)]
        entries.refuse(others, f"cannot be with {prefix}hydrolysis_rate, which says when an end shrinks.")
        entries.require(prefix + "shrinking_off_rate")
        return TwoUnitCap(**given)
    missing = [prefix + name for name in _INSTABILITY if name not in given]
    if missing:
        raise entries.error(f"lacks the key {missing[0]!r}: an end that grows and shrinks in turn has all three rates.")
    return DynamicInstability(**given)


def _states(tables, on_rate, off_rate):
    # The EndStates of tables, with rates where they give none.
    names = [own["name"] for own in tables]
    for own, name in zip(tables, names):
        if names.count(name) > 1:
            raise own.at("name").error(f"is {name!r}, and so is another one: give each state a name of its own.")
    after = {
        what: [
            _number_of(own[what], names, own.at(what)) if what in own else number for number, own in enumerate(tables)
        ]
        for what in ("after_gain", "after_loss")
    }
    return EndStates(
        on_rates=[on_rate if own["on_rate"] is None else own["on_rate"] for own in tables],
        off_rates=[off_rate if own["off_rate"] is None else own["off_rate"] for own in tables],
        switch_rates=_switches(tables, names, "switch_rates"),
        blocked_switch_rates=_switches(tables, names, "blocked_switch_rates"),
        shortest_switch_rates=_switches(tables, names, "shortest_switch_rates"),
        switch_lengths=[own["switch_length"] or 0.0 for own in tables],
        names=names,
        **after,
    )


def _switches(tables, names, key):
    # Of each state to each.
    switches = [[0.0] * len(names) for _ in names]
    for number, own in enumerate(tables):
        for name, rate in (own[key] or {}).items():
            other = _number_of(name, names, own.at(key))
            if other == number:
                raise own.at(key).error(f"has {name!r}, which is the state itself: name others.")
            switches[number][other] = rate
    return switches


def _number_of(name, names, place):
    if name not in names:
        raise place.error(f"is {name!r}, but the states are {', '.join(names)}.{close_match(name, names)}")
    return names.index(name)


def _severing(entries):
    if "severing_rate" not in entries:
        entries.refuse(("severing_states", "severed_ends_shrink"), "belongs to severing_rate.")
        return None
    states, shrinks = entries["severing_states"] or (), entries["severed_ends_shrink"]
    return Severing(rate=entries["severing_rate"], of_states=states, shrinks=shrinks)


_HELD_BY_LINKERS = "Hands of [[linkers]] with bound_at and an unbinding_rate of 0 hold them as well."


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
        if own.anchors is not None and own.body_anchors is None and isinstance(own.anchors[0], int):
            raise entries.at("anchors").error("must be points where filaments grow, but are numbers of nodes.")
    for entries, own in zip(tables["pull"], configuration.pulls):
        for number in own.filaments:
            _refuse_growth(entries, number, groups, "constant forces do not pull at")
    for entries, own in zip(tables["tether"], configuration.tethers):
        for number in own.filaments:
            _check_tether(entries, number, own.node, groups)
    for entries, own in zip(tables["link"], configuration.links):
        if own.between is None:
            raise entries.at("within").error(
                f"may join filaments that grow, which links do not yet: give between. {_HELD_BY_LINKERS}"
            )
        for place in own.between:
            if place["filament"] is not None:
                _refuse_growth(entries, place["filament"], groups, "links do not join", _HELD_BY_LINKERS)


def _refuse_unused(tables):
    for entries in tables:
        raise entries.error(f"but no filaments grow: add to a [[filament]] table the line growth = {GROWTH_EXAMPLE}")


def _check_tether(entries, number, node, groups):
    group = group_of(number, groups)
    if group.growth is None:
        return
    if group.is_reserve or group.growth.vanishes:
        raise entries.error(
            f"means filament {number}, which is not there at times ({group.label}): tethers hold lasting ones. Take "
            "another filament."
        )
    if node not in (0, -group.nodes) or not group.growth.keeps_first_node:
        raise entries.error(
            f"means node {node} of filament {number}, which grows ({group.label}): tethers hold the first node alone, "
            "node = 0, if its growth has minus_capped = true."
        )


def _refuse_growth(entries, number, groups, what, advice="Leave its growth out, or take another filament."):
    group = group_of(number, groups)
    if group.growth is not None:
        raise entries.error(
            f"means filament {number}, which grows ({group.label}): {what} filaments that grow yet. {advice}"
        )
