"""Arguments of closed forms, which may be numbers or arrays, with units or without."""

import numpy as np
import numpy.typing as npt
from openmm import unit

from ..errors import InputError
from ..filaments.chain_type import ChainType
from ..filaments.straight_segments import STRAIGHT_SEGMENTS
from ..units.quantities import (
    DIMENSIONLESS,
    TEMPERATURE,
    in_units_of,
    positive,
    require_kind,
    shown,
    thermal_energy,
    whole_number,
)
from ..units.types import FloatOrArray, Numbers, Scalar


def require_straight_segments(filament_type: ChainType) -> None:
    """Raise InputError for a chain of beads or of beam elements, for which closed forms of straight segments fail.

    Lengths and joints of beads do not fluctuate independently, and beam elements bend inside.
    """
    require_kind(filament_type, ChainType, "filament_type")
    if filament_type.segment_kind is not STRAIGHT_SEGMENTS:
        raise InputError(
            f"Filament type {filament_type.name!r} has no straight segments of cylinders, for which this closed form "
            "holds: see the functions theory.bead_spring_... of beads, and theory.beam_... of beam elements."
        )


def each_not_negative(value: Numbers, dimension: unit.Unit, name: str) -> FloatOrArray:
    """Numbers in a unit; raise InputError if one is negative."""
    number = in_units_of(value, dimension, name)
    if np.any(np.asarray(number) < 0):
        raise InputError(f"{name} cannot be negative.")
    return number


def number_in_memory(value: int, minimum: int, name: str, most: int = 10**7) -> int:
    """A number of segments of which arrays are made; InputError if it is none, or more than can be computed."""
    number = whole_number(value, minimum, name)
    if number > most:
        raise InputError(f"{name} must be at most {most:.0e}, but is {number:.3g}.")
    return number


def thermal_energy_above_zero(temperature: Scalar) -> float:
    """k_B T in kJ/mol; raise InputError at a temperature of zero."""
    return thermal_energy(positive(temperature, TEMPERATURE, "temperature"))


def each_whole_number(value: npt.ArrayLike, minimum: int, name: str) -> FloatOrArray:
    """Whole numbers; raise InputError if one is none or below the minimum."""
    number = in_units_of(value, DIMENSIONLESS, name)
    if np.any(number != np.floor(number)) or np.any(np.asarray(number) < minimum):
        raise InputError(f"{name} must be whole numbers of at least {minimum}, but is {shown(value)}.")
    return number
