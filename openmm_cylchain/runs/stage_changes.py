"""What a [[stage]] table changes of a configuration as it stands in its file: other values, and ramps of them."""

import re
from dataclasses import dataclass, field

from .keys import Either, Number, Place, Quantity, Triple, Whole, WordOrQuantity
from .table import UnknownKeyError
from .tables.stages import CHANGES, INSTEAD, STAGE, STAYS

_RAMP = {"from", "to"}
_NUMBER_AND_UNIT = re.compile(r"\s*[-+]?[\d.]+(?:[eE][-+]?\d+)?\s*(.*?)\s*")


@dataclass(frozen=True)
class Ramp:
    """A value that goes from one to another: the path of its key in the file, what kind it is, and where it stands."""

    path: tuple
    kind: object
    first: object
    last: object
    place: Place

    def at(self, share):
        """What would stand in the file after a share of its time, from 0 to 1."""
        return _between(self.kind, self.first, self.last, share, self.place)


@dataclass
class Changes:
    """What a stage changes.

    Attributes
    ----------
    tables : dict
        All of the configuration, as tomllib would have read it.
    origins : dict
        Where each path of ``tables`` that the stage has set stands in the file: Place by path.
    ramps : list of Ramp
    """

    tables: dict
    origins: dict = field(default_factory=dict)
    ramps: list = field(default_factory=list)

    def resolved(self, share):
        """The tables after a share of the time of the stage."""
        tables = self.tables
        for ramp in self.ramps:
            tables = _with(tables, ramp.path, ramp.at(share))
        return tables


def apply_stage(tables, table, place, kinds):
    """The Changes of a configuration by what a [[stage]] table has beside keys of its own.

    Parameters
    ----------
    tables, table : dict
        As tomllib has read them.
    place : Place
        Of the stage.
    kinds : sequence of TableKind

    Raises
    ------
    ConfigurationError
    """
    changes = Changes(dict(tables))
    known = {kind.name: kind for kind in kinds if kind.name in CHANGES}
    for name, value in table.items():
        if name in STAGE.names:
            continue
        here = Place(f"{place.name} {name}", (*place.path, name))
        kind = known.get(name)
        if kind is None:
            others = {kind.name for kind in kinds} - set(known)
            if name in others:
                raise here.error("cannot change while a run goes on: leave it out.")
            raise UnknownKeyError(place, name, (*STAGE.names, *known), value)
        if not isinstance(value, dict):
            raise here.error(f"must be a table: write [stage.{name}] below the keys of the stage.")
        if kind.repeated:
            _change_several(changes, kind, value, here)
        elif isinstance(tables.get(name, {}), dict):
            changes.tables[name] = _changed(changes, dict(tables.get(name, {})), kind, value, (name,), here)
    return changes


def _change_several(changes, kind, value, here):
    there = changes.tables.get(kind.name)
    if not isinstance(there, list) or not there:
        raise here.error(
            f"changes a {kind.header} of the file, which has none: write it there, with active = false or count = 0 "
            "if it comes later."
        )
    if not all(isinstance(own, dict) for own in there):
        # What is wrong with it is said where it is read.
        return
    there = list(there)
    names = {str(number): [number - 1] for number in range(1, len(there) + 1)}
    for number, own in enumerate(there):
        for key in ("name", "type"):
            if isinstance(own.get(key), str):
                names.setdefault(own[key], []).append(number)
                break
    for name, own in value.items():
        if name in names and isinstance(own, dict) and not _is_ramp(own):
            numbers, change, place = names[name], own, Place(f"{here.name} {name}", (*here.path, name))
        elif name in kind.names:
            numbers, change, place = range(len(there)), {name: own}, here
        elif isinstance(own, dict):
            raise here.error(f"has no table {name!r}: there are {', '.join(names)}.")
        else:
            raise UnknownKeyError(here, name, CHANGES[kind.name], own)
        for number in numbers:
            path = kind.name, number
            there[number] = _changed(changes, dict(there[number]), kind, change, path, place)
    changes.tables[kind.name] = there


def _changed(changes, table, kind, change, path, here):
    # A table with keys of a stage in it; ``path`` is its own, ``here`` where the stage has them.
    whole = len(path) <= 2
    for name, value in change.items():
        place = Place(f"{here.name} {name}", (*here.path, name))
        key = next((key for key in kind.keys if key.name == name), None)
        if key is None:
            raise UnknownKeyError(here, name, CHANGES[kind.name] if whole else kind.names, value)
        if (whole and name not in CHANGES[kind.name]) or name in STAYS.get(kind.name, ()):
            raise place.error("cannot change while a run goes on: leave it out.")
        changes.origins[(*path, name)] = place
        for owner, names in INSTEAD:
            if owner == kind.name and name in names:
                for other in names:
                    table.pop(other, None)
        changes.ramps = [ramp for ramp in changes.ramps if ramp.path != (*path, name)]
        inner = getattr(key.kind, "table", None)
        if _is_ramp(value):
            changes.ramps.append(_ramp((*path, name), key.kind, value, place))
            table[name] = value["to"]
        elif isinstance(value, dict) and inner is not None and isinstance(table.get(name), dict):
            table[name] = _changed(changes, dict(table[name]), inner, value, (*path, name), place)
        elif kind.name == "tether" and name == "velocity" and not any(key.kind.read(value, place)):
            table.pop("velocity", None)
            table.pop("start_time", None)
        else:
            table[name] = value
    return table


def _is_ramp(value):
    return isinstance(value, dict) and set(value) == _RAMP


def _ramp(path, kind, value, place):
    ends = [Place(f"{place.name} {name}", (*place.path, name)) for name in ("from", "to")]
    for end, own in zip(ends, (value["from"], value["to"])):
        kind.read(own, end)
    ramp = Ramp(path, kind, value["from"], value["to"], place)
    ramp.at(0.5)
    return ramp


def _between(kind, first, last, share, place):
    if isinstance(kind, Either):
        kind = next((own for accepted, own in kind.kinds if isinstance(first, accepted)), kind.kinds[-1][1])
    if isinstance(kind, WordOrQuantity):
        kind = Quantity(kind.unit)
    if isinstance(kind, Triple):
        return [_between(kind.kind, *pair, share, place) for pair in zip(first, last)]
    if isinstance(kind, Number):
        return first + share * (last - first)
    if isinstance(kind, Whole):
        return round(first + share * (last - first))
    if not isinstance(kind, Quantity):
        raise place.error("cannot go from one value to another: give one value.")
    values = [kind.read(own, place) for own in (first, last)]
    return in_unit_of(first, values[0] + share * (values[1] - values[0]), kind, place)


def in_unit_of(text, value, kind, place):
    """A value of a Quantity, in OpenMM's units, as text in the unit that another text has."""
    unit = _NUMBER_AND_UNIT.fullmatch(text)[1]
    size = Quantity(kind.unit, "any").read(f"1 {unit}", place)
    return f"{value / size:.15g} {unit}"


def _with(tables, path, value):
    # Nested dicts and lists with another value at a path.
    if not path:
        return value
    copied = list(tables) if isinstance(tables, list) else dict(tables)
    copied[path[0]] = _with(copied[path[0]], path[1:], value)
    return copied
