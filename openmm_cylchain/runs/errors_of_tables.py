"""Errors about what a configuration describes, with its file and the line of the table that is at fault."""

import contextlib
import functools
import re

from ..errors import InputError, InstabilityError, TimeStepError
from .keys import ConfigurationError, LocatedError, place_in_words
from .toml_lines import line_of

_HEADER = re.compile(r"\[\[(?P<repeated>\w+)\]\] number (?P<number>\d+)|\[(?P<single>\w+)\](?: (?P<key>\w+))?")
_FILAMENT = re.compile(r"Filament (\d+)\b")
_TABLES_OF_FORCES = {"CylinderChainContactForce": "contacts", "CylinderChainWallForce": "wall", "Crosslink": "link"}
_LINKERS = re.compile(r"Linkers '([^']*)'")


@contextlib.contextmanager
def located(configuration):
    """A context whose InputErrors get the file of a configuration, and the line of a table.

    The table is that of the header, the filament or the linkers with which a message begins.
    """
    try:
        yield
    except LocatedError:
        raise
    except ConfigurationError as error:
        raise error.with_line(configuration.lines, configuration.path) from None
    except InputError as error:
        path = _path_of(str(error), configuration)
        raise ConfigurationError(str(error), path).with_line(configuration.lines, configuration.path) from None


def located_errors(function):
    """A function whose first argument is a configuration, with its errors as in ``located``."""

    @functools.wraps(function)
    def with_place(configuration, *arguments, **options):
        with located(configuration):
            return function(configuration, *arguments, **options)

    return with_place


@contextlib.contextmanager
def located_instability(configuration):
    """A context whose InstabilityErrors get the file of a configuration, and the line of the filament's table."""
    try:
        yield
    except InstabilityError as error:
        line = line_of(configuration.lines, _path_of_instability(error, configuration))
        if line is None and not configuration.path:
            raise
        raise type(error)(f"{place_in_words(configuration.path, line)}: {error}", **error.place) from None


def _path_of_instability(error, configuration):
    if error.filament is not None:
        return _path_of_filament(error.filament, configuration)
    return ("simulation", "time_step") if isinstance(error, TimeStepError) else ()


def _path_of(message, configuration):
    header, filament, linkers = (pattern.match(message) for pattern in (_HEADER, _FILAMENT, _LINKERS))
    if header and header["repeated"]:
        return header["repeated"], int(header["number"]) - 1
    if header:
        return tuple(one for one in (header["single"], header["key"]) if one)
    if filament:
        return _path_of_filament(int(filament[1]), configuration)
    if message.startswith("Scheme "):
        return "simulation", "scheme"
    of_force = next((table for name, table in _TABLES_OF_FORCES.items() if message.startswith(name)), None)
    if of_force and len(configuration.tables[of_force]) == 1:
        return (of_force,)
    if linkers:
        named = [number for number, own in enumerate(configuration.linkers) if own.kind.name == linkers[1]]
        # Where several tables have one name, a wrong line is worse than none.
        return ("linkers", named[0]) if len(named) == 1 else ()
    return ()


def _path_of_filament(number, configuration):
    for group in configuration.filaments:
        if number < group.count:
            return group.path
        number -= group.count
    return ()
