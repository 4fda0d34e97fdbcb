"""Arguments of closed forms, which may be numbers or arrays, with units or without."""

import numpy as np

from ..errors import InputError
from ..units.quantities import DIMENSIONLESS, TEMPERATURE, in_units_of, positive, thermal_energy


def each_not_negative(value, dimension, name):
    number = in_units_of(value, dimension, name)
    if np.any(np.asarray(number) < 0):
        raise InputError(f"{name} cannot be negative.")
    return number


def thermal_energy_above_zero(temperature):
    return thermal_energy(positive(temperature, TEMPERATURE, "temperature"))


def each_whole_number(value, minimum, name):
    number = in_units_of(value, DIMENSIONLESS, name)
    if np.any(number != np.floor(number)) or np.any(np.asarray(number) < minimum):
        raise InputError(f"{name} must be whole numbers of at least {minimum}, but is {value!r}.")
    return number
