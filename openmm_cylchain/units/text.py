"""Physical quantities as text: reading "1.71 mPa*s" into OpenMM's units, and writing times for people."""

import functools
import re
from dataclasses import dataclass

from ..errors import InputError
from .quantities import AVOGADRO


@dataclass(frozen=True)
class Dimension:
    """A kind of quantity: what to call it, the unit that OpenMM's plain numbers have, and an example."""

    name: str
    unit: str
    example: str


LENGTH = Dimension("length", "nm", "360 nm")
TIME = Dimension("time", "ps", "10 ns")
TEMPERATURE = Dimension("temperature", "K", "310 K")
VISCOSITY = Dimension("viscosity", "kJ*ps/mol/nm^3", "1.71 mPa*s")
STIFFNESS = Dimension("stiffness", "kJ/mol/nm^2", "48.7 pN/nm")
FORCE = Dimension("force", "kJ/mol/nm", "1100 pN")
BENDING_RIGIDITY = Dimension("bending rigidity", "kJ/mol*nm", "2.2e7 pN*nm^2")
ROTATIONAL_FRICTION = Dimension("rotational friction", "kJ*ps/mol", "7e4 pN*nm*us")
MASS_PER_LENGTH = Dimension("mass per length", "Da/nm", "3500 Da/nm")

_NUMBER = r"[-+]?(?:(?:\d+\.?\d*|\.\d+)(?:e[-+]?\d+)?|nan|inf)"
_NUMBER_AND_UNIT = re.compile(rf"\s*({_NUMBER})\s*(.*?)\s*", re.IGNORECASE)


@functools.cache
def _registry():
    import pint

    return pint.UnitRegistry(autoconvert_offset_to_baseunit=True)


def parse_quantity(text, dimension, name):
    """Read a number with a unit, such as "48.7 pN/nm", as a plain number in OpenMM's unit.

    Quantities per particle (pN/nm, Pa*s) are turned into quantities per mole where OpenMM's are.

    Parameters
    ----------
    text : str
    dimension : Dimension
    name : str
        What to call the quantity in messages.

    Raises
    ------
    InputError
        For text that is not one finite number with a unit of the right dimension.
    """
    example = f'as in "{dimension.example}"'
    if not isinstance(text, str):
        raise InputError(f"{name} must be a text with a number and a unit, {example}, but is {text!r}.")
    # pint alone would read "1,71 nm" as 171 nm and "nm" as 1 nm.
    match = _NUMBER_AND_UNIT.fullmatch(text)
    if match is None:
        raise InputError(f"{name} must be a number and a unit, {example}, but is {text!r}.")
    number, unit = float(match[1]), match[2]
    if number - number != 0:
        raise InputError(f"{name} must be finite, but is {text!r}.")
    if not unit:
        raise InputError(f"{name} needs a unit, {example}, but is {text!r}.")
    return _convert(number, _parse_unit(unit, dimension, name), dimension, name)


def _parse_unit(unit, dimension, name):
    import pint

    try:
        return _registry().parse_units(unit)
    except pint.UndefinedUnitError as error:
        reason = str(error).replace(" in the unit registry", "")
    except Exception:  # Malformed expressions make pint raise anything from AssertionError to TokenError.
        reason = "it cannot be read"
    raise InputError(f'{name} has the unit {unit!r}: {reason}. Write a {dimension.name} as in "{dimension.example}".')


def _convert(number, unit, dimension, name):
    registry = _registry()
    quantity = registry.Quantity(number, unit)
    candidates = [quantity]
    if "mol" in dimension.unit:
        candidates.append(quantity.to_base_units() * (AVOGADRO / registry.mole))
    elif "Da" in dimension.unit:
        candidates.append(quantity.to_base_units() * (registry.mole / AVOGADRO))
    for candidate in candidates:
        if candidate.is_compatible_with(dimension.unit):
            # 15 digits drop the rounding noise of the conversion: 10 ns are 10000 ps.
            return float(f"{candidate.m_as(dimension.unit):.15g}")
    raise InputError(
        f'{name} has the unit {unit:~}, which is not one of {dimension.name}: write it as in "{dimension.example}".'
    )


_TIME_UNITS = (("s", 1e12), ("ms", 1e9), ("us", 1e6), ("ns", 1e3), ("ps", 1.0))


def time_unit(time):
    """The name and the length in ps of the largest of s, ms, us, ns and ps that a time in ps reaches."""
    for name, length in _TIME_UNITS:
        if time >= 0.9999999 * length:
            return name, length
    return _TIME_UNITS[-1]


def format_time(time, digits=6):
    """Write a time in ps with a unit that suits it: 200e6 is "200 us"."""
    name, length = time_unit(time)
    return f"{time / length:.{digits}g} {name}"
