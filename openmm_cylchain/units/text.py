"""Physical quantities as text: reading "1.71 mPa*s" into OpenMM's units, and writing times for people."""

import functools
import math
import re

from openmm import unit

from ..errors import InputError
from .quantities import (
    ANGLE,
    ANGLE_PER_LENGTH,
    AVOGADRO,
    BENDING_RIGIDITY,
    DIFFUSION,
    ENERGY,
    FORCE,
    FRICTION,
    LENGTH,
    MASS,
    MASS_PER_LENGTH,
    NUMBER_DENSITY,
    ON_RATE,
    RATE,
    RATE_PER_LENGTH,
    RATE_PER_VOLUME,
    ROTATIONAL_FRICTION,
    STIFFNESS,
    TEMPERATURE,
    TIME,
    VELOCITY,
    VISCOSITY,
    VOLUME,
)

_EXAMPLES = {
    LENGTH: ("length", "360 nm"),
    TIME: ("time", "10 ns"),
    TEMPERATURE: ("temperature", "310 K"),
    VISCOSITY: ("viscosity", "1.71 mPa*s"),
    STIFFNESS: ("stiffness", "48.7 pN/nm"),
    FORCE: ("force", "1100 pN"),
    BENDING_RIGIDITY: ("bending rigidity", "2.2e7 pN*nm^2"),
    FRICTION: ("friction", "1.91e-12 kg/s"),
    DIFFUSION: ("diffusion coefficient", "1 um^2/s"),
    MASS: ("mass", "650 Da"),
    ROTATIONAL_FRICTION: ("rotational friction", "7e4 pN*nm*us"),
    MASS_PER_LENGTH: ("mass per length", "3500 Da/nm"),
    RATE: ("rate", "10 1/s"),
    ON_RATE: ("rate per concentration", "11.6 1/(uM*s)"),
    RATE_PER_LENGTH: ("rate per length", "0.01 1/(um*s)"),
    RATE_PER_VOLUME: ("rate per volume", "0.1 1/(um^3*s)"),
    VELOCITY: ("velocity", "0.5 um/s"),
    VOLUME: ("volume", "1 um^3"),
    NUMBER_DENSITY: ("concentration", "1 uM"),
    ENERGY: ("energy", "20 kJ/mol"),
    ANGLE: ("angle", "60 deg"),
    ANGLE_PER_LENGTH: ("angle per length", "1.8 rad/nm"),
}
"""What to call a quantity with such a unit, and how people write one."""

_NUMBER = r"[-+]?(?:(?:\d+\.?\d*|\.\d+)(?:e[-+]?\d+)?|nan|inf)"
_NUMBER_AND_UNIT = re.compile(rf"\s*({_NUMBER})\s*(.*?)\s*", re.IGNORECASE)
# Units begin with a letter, or with "1/": pint would skip what comes before, as in "3,1 K" and "3 1 K".
_UNIT = re.compile(r"\(*(?:1\s*/\s*\(*)?[^\W\d_°]|°")


def example(target: unit.Unit) -> str:
    """How people write a quantity in the unit ``target``, such as "360 nm"."""
    return _EXAMPLES[target][1]


def kind_of(target: unit.Unit) -> str:
    """What to call a quantity in the unit ``target``, such as "length"."""
    return _EXAMPLES[target][0]


@functools.cache
def _registry():
    import pint

    return pint.UnitRegistry(autoconvert_offset_to_baseunit=True)


def parse_quantity(text: str, target: unit.Unit, name: str) -> float:
    """Read a number with a unit, such as "48.7 pN/nm", as a plain number in the unit ``target``.

    Quantities per particle (pN/nm, Pa*s) are turned into quantities per mole where the unit is one.

    Parameters
    ----------
    target : openmm.unit.Unit
        LENGTH, TIME and so on of ``quantities``.
    name : str
        What to call the quantity in messages.

    Raises
    ------
    InputError
        For text that is not one finite number with a unit of the right dimension.
    """
    written = f'as in "{example(target)}"'
    if not isinstance(text, str):
        raise InputError(f"{name} must be a text with a number and a unit, {written}, but is {text!r}.")
    # pint alone would read "1,71 nm" as 171 nm and "nm" as 1 nm.
    match = _NUMBER_AND_UNIT.fullmatch(text)
    if match is None or not text.isprintable():
        raise InputError(f"{name} must be a number and a unit, {written}, but is {text!r}.")
    number, unit = float(match[1]), match[2]
    if number - number != 0:
        raise InputError(f"{name} must be finite, but is {text!r}.")
    if not unit:
        raise InputError(f"{name} needs a unit, {written}, but is {text!r}.")
    return _convert(number, unit, target, name)


def _parse_unit(unit, target, name):
    import pint

    try:
        if _UNIT.match(unit) is None:
            raise ValueError
        return _registry().parse_units(unit)
    except pint.UndefinedUnitError as error:
        reason = str(error).replace(" in the unit registry", "")
    except Exception:  # Malformed expressions make pint raise anything from AssertionError to TokenError.
        reason = "it cannot be read"
    kind, written = _EXAMPLES[target]
    raise InputError(f'{name} has the unit {unit!r}: {reason}. Write a {kind} as in "{written}".')


def _convert(number, written, target, name):
    factor = _factor(written, target)
    value = _convert_in_full(number, written, target, name) if factor is None else number * factor
    # 15 digits drop the rounding noise of the conversion: 10 ns are 10000 ps.
    return float(f"{value:.15g}")


@functools.lru_cache(maxsize=1000)
def _factor(written, target):
    # Of a unit that is right and has no offset: configurations may have thousands of quantities in it.
    try:
        zero, one = (_convert_in_full(number, written, target, "") for number in (0.0, 1.0))
    except InputError:
        return None
    return one if zero == 0.0 else None


def _convert_in_full(number, written, target, name):
    registry, unit = _registry(), _parse_unit(written, target, name)
    # pint reads "1/ps", not "/ps".
    symbol = re.sub("^/", "1/", target.get_symbol())
    try:
        quantity = registry.Quantity(number, unit)
        candidates = [quantity]
        if "mol" in symbol or target in (NUMBER_DENSITY, RATE_PER_VOLUME):
            candidates.append(quantity.to_base_units() * (AVOGADRO / registry.mole))
        elif "Da" in symbol or target is ON_RATE:
            candidates.append(quantity.to_base_units() * (registry.mole / AVOGADRO))
        for candidate in candidates:
            if candidate.is_compatible_with(symbol):
                return float(candidate.m_as(symbol))
    except Exception:  # noqa: S110 - logarithmic units, such as decibels, make pint raise anything as well.
        pass
    kind, example_of_kind = _EXAMPLES[target]
    raise InputError(f'{name} has the unit {written}, which is not one of {kind}: write it as in "{example_of_kind}".')


_TIME_UNITS = (("s", 1e12), ("ms", 1e9), ("us", 1e6), ("ns", 1e3), ("ps", 1.0))


def format_with_error(value: float, error: float) -> str:
    """A value and its standard error, which has two significant digits: "0.0392 ± 0.0041"."""
    if not (math.isfinite(value) and math.isfinite(error) and error > 0.0):
        return f"{value:.4g} ± {error:.2g}"
    decimals = max(0, 1 - math.floor(math.log10(error)))
    return f"{value:.{decimals}f} ± {error:.{decimals}f}"


def time_unit(time: float) -> tuple[str, float]:
    """The name and the length in ps of the largest of s, ms, us, ns and ps that a time in ps reaches."""
    for name, length in _TIME_UNITS:
        if time >= 0.9999999 * length:
            return name, length
    return _TIME_UNITS[-1]


def format_time(time: float, digits: int = 6) -> str:
    """Write a time in ps with a unit that suits it: 200e6 is "200 us"."""
    name, length = time_unit(time)
    return f"{time / length:.{digits}g} {name}"
