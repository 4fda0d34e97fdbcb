"""Conversion of user input, with or without units, to plain numbers in OpenMM's units."""

from __future__ import annotations

import math
import reprlib
from collections.abc import Collection, Iterable, Mapping
from typing import Any

import numpy as np
from openmm import unit

from ..errors import InputError
from .types import FloatArray, FloatOrArray, Numbers, Scalar, Vector

AVOGADRO = 6.02214076e23
PICONEWTON = 1e-15 * AVOGADRO * 1e-9
"""In kJ/(mol nm)."""
BOLTZMANN = unit.MOLAR_GAS_CONSTANT_R.value_in_unit(unit.kilojoule_per_mole / unit.kelvin)

LENGTH = unit.nanometer
ANGLE = unit.radian
ANGLE_PER_LENGTH = unit.radian / unit.nanometer
VOLUME = unit.nanometer**3
NUMBER_DENSITY = unit.nanometer**-3
TIME = unit.picosecond
TEMPERATURE = unit.kelvin
VELOCITY = unit.nanometer / unit.picosecond
RATE = unit.picosecond**-1
ON_RATE = VOLUME * RATE
"""Of what comes, per number of free ones in a volume."""
RATE_PER_LENGTH = RATE / LENGTH
RATE_PER_VOLUME = RATE / VOLUME
ENERGY = unit.kilojoule_per_mole
FORCE = unit.kilojoule_per_mole / unit.nanometer
STIFFNESS = unit.kilojoule_per_mole / unit.nanometer**2
BENDING_RIGIDITY = unit.kilojoule_per_mole * unit.nanometer
FRICTION = unit.kilojoule_per_mole * unit.picosecond / unit.nanometer**2
ROTATIONAL_FRICTION = unit.kilojoule_per_mole * unit.picosecond
DIFFUSION = unit.nanometer**2 / unit.picosecond
VISCOSITY = unit.kilojoule_per_mole * unit.picosecond / unit.nanometer**3
MASS = unit.dalton
MASS_PER_LENGTH = unit.dalton / unit.nanometer
DIMENSIONLESS = unit.dimensionless

_LARGEST = 1e60
"""Powers of what is beyond, or below its inverse, are not finite."""

_LARGEST_WHOLE = 2**63 - 1
LARGEST_INT = 2**31 - 1
"""Of whole numbers that OpenMM and files keep in 32 bits."""

_SHOWN_NUMBERS = 16
_short = reprlib.Repr()
_short.maxstring = _short.maxother = 160


def in_units_of(value: Numbers, target: unit.Unit, name: str) -> FloatOrArray:
    """Return ``value`` as a float or float array in the unit ``target``.

    A plain number or array is taken to be in ``target`` already. A quantity is converted; one per particle
    (pN/nm, Pa s) is turned into one per mole (kJ/mol/nm^2) where ``target`` is molar. InputError if the value is not a
    number, not finite, beyond what can be computed with, or has the dimension of something else.
    """
    # By far the most frequent, and this is asked of every filament that is added.
    if isinstance(value, float) and abs(value) <= _LARGEST:
        return float(value)
    if not isinstance(value, unit.Quantity) and isinstance(value, (list, tuple)):
        if any(isinstance(item, unit.Quantity) for item in value):
            value = np.array([in_units_of(item, target, name) for item in value])
    if isinstance(value, unit.Quantity):
        value = _converted(value, target, name)
    try:
        array = np.asarray(value)
    except ValueError:
        array = np.asarray(None)
    if array.dtype.kind not in "iuf" and array.size:
        raise InputError(f"{name} must be a number or an array of numbers, but is {shown(value)}.")
    array = array.astype(float)
    largest = np.max(np.abs(array), initial=0.0)
    if not largest <= _LARGEST:
        if not np.isfinite(largest):
            raise InputError(f"{name} must be finite, but contains NaN or infinity.")
        raise _beyond_all_measure(name, largest)
    return float(array) if array.ndim == 0 else array


def numbers_to_compute_with(value: Numbers, target: unit.Unit, name: str, components: int = 0) -> FloatArray:
    """Return ``value`` as a float array in ``target``, as ``in_units_of`` does, but with NaN where it is NaN.

    InputError if infinite, or unless it has so many components along its last axis, if any are given.
    """
    if isinstance(value, unit.Quantity):
        value = _converted(value, target, name)
    array = np.asarray(value) if isinstance(value, np.ndarray) and value.dtype.kind == "f" else None
    if array is None:
        array = np.asarray(in_units_of(value, target, name))
    elif np.max(np.abs(array), initial=0.0, where=~np.isnan(array)) > _LARGEST:
        raise InputError(f"{name} must be below {_LARGEST:g} in OpenMM's units.")
    if components and (array.ndim < 2 or array.shape[-1] != components):
        raise InputError(f"{name} must have the shape (..., {components}), but has {array.shape}.")
    return array


def shown(value: Any) -> str:
    """What to say of a value in a message: itself on one line, if it is short; of an array its shape."""
    shape, size = getattr(value, "shape", None), getattr(value, "size", 0)
    if isinstance(shape, tuple) and isinstance(size, int) and size > _SHOWN_NUMBERS:
        return f"an array of the shape {shape}"
    return " ".join(_short.repr(value).split())


def _converted(quantity, target, name):
    own = quantity.unit
    # Rates may be those of angles, and energies torques.
    of_angle = own / unit.radian if target == RATE else own * unit.radian if target == ENERGY else own
    for plain in (own, of_angle):
        if plain.is_compatible(target):
            return unit.Quantity(quantity._value, plain).value_in_unit(target)
        molar = plain / unit.mole
        if molar.is_compatible(target):
            per_particle = unit.Quantity(quantity._value, molar).value_in_unit(target)
            return np.asarray(per_particle) * AVOGADRO
    raise InputError(f"{name} has the unit {own}, which cannot be converted to {target}.")


def finite_number(value: Scalar, target: unit.Unit, name: str) -> float:
    """Return ``value`` as a float in ``target``; raise InputError unless it is one number that can be computed with."""
    return _of_size(_single_number(value, target, name), name)


def positive(value: Scalar, target: unit.Unit, name: str) -> float:
    """Return ``value`` as a float in ``target``; raise InputError unless it is one number above zero."""
    converted = _single_number(value, target, name)
    if converted <= 0:
        raise InputError(f"{name} must be positive, but is {converted:g}.")
    return _of_size(converted, name)


def non_negative(value: Scalar, target: unit.Unit, name: str) -> float:
    """Return ``value`` as a float in ``target``; raise InputError if it is negative or not one number."""
    converted = _single_number(value, target, name)
    if converted < 0:
        raise InputError(f"{name} cannot be negative, but is {converted:g}.")
    return _of_size(converted, name)


def as_number_density(concentration: Scalar, name: str) -> float:
    """A number of molecules in 1 nm^3, of a number or an amount of substance in a volume."""
    if isinstance(concentration, unit.Quantity) and concentration.unit.is_compatible(unit.molar):
        concentration = concentration * unit.AVOGADRO_CONSTANT_NA
    return non_negative(concentration, NUMBER_DENSITY, name)


def _single_number(value, target, name):
    converted = in_units_of(value, target, name)
    if not isinstance(converted, float):
        raise InputError(f"{name} must be a single number, but has the shape {converted.shape}.")
    return converted


def _of_size(number, name):
    if number != 0.0 and abs(number) < 1.0 / _LARGEST:
        raise _beyond_all_measure(name, number)
    return number


def _beyond_all_measure(name, number):
    return InputError(
        f"{name} must be between {1.0 / _LARGEST:g} and {_LARGEST:g} in OpenMM's units, but is {number:g}."
    )


def whole_number(value: Any, minimum: int, name: str, maximum: int = _LARGEST_WHOLE) -> int:
    """Return ``value`` as an int; raise InputError unless it is a whole number from ``minimum`` to ``maximum``."""
    if isinstance(value, bool) or not isinstance(value, (int, np.integer)):
        if not (isinstance(value, float) and math.isfinite(value) and value == int(value)):
            raise InputError(f"{name} must be a whole number, but is {shown(value)}.")
    if value < minimum:
        raise InputError(f"{name} must be at least {minimum}, but is {shown(value)}.")
    if value > maximum:
        raise InputError(f"{name} must be at most {maximum}, but is {shown(value)}.")
    return int(value)


def whole_numbers(values: Any, minimum: int, name: str) -> list[int]:
    """Return a sequence of whole numbers as ints; raise InputError for anything else."""
    others = (str, bytes, Mapping, unit.Quantity)
    if isinstance(values, others) or not isinstance(values, Collection) or getattr(values, "ndim", 1) == 0:
        raise InputError(f"{name} must be a sequence of whole numbers, but is {shown(values)}.")
    return [whole_number(value, minimum, f"An entry of {name}") for value in values]


def numbers_of(values: Any, minimum: int, name: str) -> list[int]:
    """Return a whole number, or a sequence of them, as a list of ints; raise InputError for anything else."""
    alone = np.ndim(values) == 0 if isinstance(values, np.ndarray) else isinstance(values, (int, float, np.integer))
    return (
        [whole_number(getattr(values, "item", lambda: values)(), minimum, name)]
        if alone
        else whole_numbers(values, minimum, name)
    )


def true_or_false(value: Any, name: str) -> bool:
    """Return ``value`` as a bool; raise InputError if it is none."""
    if not isinstance(value, (bool, np.bool_)):
        raise InputError(f"{name} must be True or False, but is {shown(value)}.")
    return bool(value)


def one_of(value: Any, choices: Iterable[str], name: str) -> str:
    """Return ``value``; raise InputError unless it is one of a few words."""
    if not isinstance(value, str) or value not in choices:
        raise InputError(f"{name} must be one of {', '.join(choices)}, but is {shown(value)}.")
    return value


def require_kind(value: Any, kind: type, name: str) -> None:
    """Raise InputError unless ``value`` is an object of a class."""
    if not isinstance(value, kind):
        raise InputError(f"{name} must be an object of the class {kind.__name__}, but is {shown(value)}.")


def require_callable(value: Any, name: str) -> None:
    """Raise InputError unless ``value`` can be called."""
    if not callable(value):
        raise InputError(f"{name} must be a function, but is {shown(value)}.")


def vector(value: Vector, target: unit.Unit, name: str) -> FloatArray:
    """Return ``value`` as a (3,) array in the unit ``target``; raise InputError if it has another shape."""
    components = np.asarray(in_units_of(value, target, name))
    if components.shape != (3,):
        raise InputError(f"{name} must have three components, but has the shape {components.shape}.")
    return components


def unit_vector(direction: Vector, label: str, name: str = "direction") -> FloatArray:
    """Return ``direction`` normalised; raise InputError if it is zero or not a vector."""
    direction = vector(direction, DIMENSIONLESS, f"{label}: {name}")
    largest = np.max(np.abs(direction))
    if largest == 0:
        raise InputError(f"{label}: {name} must not be the zero vector.")
    # Squares of small components would be zero.
    direction = direction / largest if largest < 1.0 / _LARGEST else direction
    return direction / np.linalg.norm(direction)


def thermal_energy(temperature: Scalar) -> float:
    """Return k_B T in kJ/mol for a temperature (zero allowed)."""
    return BOLTZMANN * non_negative(temperature, TEMPERATURE, "temperature")
