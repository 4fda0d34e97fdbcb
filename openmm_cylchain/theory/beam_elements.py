"""Averages of free chains of beam elements in space, in equilibrium; exact but for products of strains and bends."""

import numpy as np

from ..beams.equilibrium import ElementAverages, element_averages
from ..filaments.filament_type import FilamentType
from ..units.types import Scalar
from .arguments import thermal_energy_above_zero


def beam_averages(filament_type: FilamentType, temperature: Scalar) -> ElementAverages:
    """Those of an element with stiff lengths: see ``ElementAverages``."""
    element = filament_type.beam_element(temperature)
    return element_averages(element.length * thermal_energy_above_zero(temperature) / element.rigidity)


def beam_persistence_length(filament_type: FilamentType, temperature: Scalar) -> float:
    """-h/ln<t.t'> of tangents at neighbouring nodes, in nm."""
    return float(-filament_type.segment_length / np.log(beam_averages(filament_type, temperature).cosine))


def beam_mean_square_end_to_end(filament_type: FilamentType, elements: int, temperature: Scalar) -> float:
    """<R^2> in nm^2: bends of different elements are independent, and turn about the tangent between them at random."""
    own = beam_averages(filament_type, temperature)
    apart = np.arange(1, elements)
    pairs = 2.0 * own.chord_along**2 * np.sum((elements - apart) * own.cosine ** (apart - 1))
    return float(filament_type.segment_length**2 * (elements * own.chord_square + pairs))


def beam_stretching_energy_mean(filament_type: FilamentType, elements: int, temperature: Scalar) -> float:
    """Mean stretching energy per element in kJ/mol of a chain: that of its strains at nodes and in middles.

    A strain e with the energy (c/2) e^2 and the measure (1 + e)^2 de, that of a vector, has
    (k_B T/2) (1 + 3w)/(1 + w) with w = k_B T/c; in the middle of an element d|u|/de makes a little of it more.
    """
    kT = thermal_energy_above_zero(temperature)
    element = filament_type.beam_element(temperature)
    shares = np.full(elements + 1, 1.0 / 3.0)
    shares[[0, -1]] = 1.0 / 6.0
    widths = kT / (element.modulus * element.length * shares)
    nodes = 0.5 * kT * np.sum((1.0 + 3.0 * widths) / (1.0 + widths))
    width = 1.5 * kT / (element.modulus * element.length)
    middles = 0.5 * kT * elements * (1.0 + 3.0 * _MIDDLE * width) / (1.0 + _MIDDLE * width)
    return float((nodes + middles) / elements)


_MIDDLE = 1.66
"""The second coefficient of |u|^2 d|u|/de = 1 + 2.2 e + 1.66 e^2 + ... of a straight element, where
e = x - x^2/10 with x = |u| - 1."""
