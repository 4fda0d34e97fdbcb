"""Averages of free chains of beam elements in equilibrium, in space or in a plane.

They are exact but for products of strains and bends.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from ..beams.equilibrium import ElementAverages, element_averages
from ..errors import InputError
from ..filaments.chain_type import ChainType
from ..filaments.filament_type import FilamentType
from ..units.quantities import require_kind
from ..units.types import FloatOrArray, Scalar
from .arguments import each_whole_number, number_in_memory, thermal_energy_above_zero

_LONGEST = 10.0


def beam_averages(filament_type: FilamentType, temperature: Scalar, planar: bool = False) -> ElementAverages:
    """Those of an element with stiff lengths: see ``ElementAverages``."""
    require_kind(filament_type, ChainType, "filament_type")
    kT = thermal_energy_above_zero(temperature)
    element = filament_type.beam_element(temperature, planar)
    bend = element.length * kT / element.rigidity
    if bend > _LONGEST:
        raise InputError(
            f"Filament type {filament_type.name!r}: an element is {bend:.3g} persistence lengths long at this "
            f"temperature, and averages are those of up to {_LONGEST:g}: take a shorter segment_length."
        )
    return element_averages(bend, bool(planar))


def beam_tangent_correlation(
    filament_type: FilamentType, lag: npt.ArrayLike, temperature: Scalar, planar: bool = False
) -> FloatOrArray:
    """Correlation of tangents at nodes of a free chain of beam elements, ``<t(i).t(i+k)> = <t.t'>^k``.

    Parameters
    ----------
    filament_type : FilamentType
        With ``element="beam"``.
    lag : int or array of int, not negative
        The distance k along the chain in elements.
    temperature : temperature, above zero
    planar : bool
        In a plane.

    Raises
    ------
    InputError
        If segments are straight, or a lag or the temperature is none.
    """
    return beam_averages(filament_type, temperature, planar).cosine ** each_whole_number(lag, 0, "lag")


def beam_persistence_length(filament_type: FilamentType, temperature: Scalar, planar: bool = False) -> float:
    """-h/ln<t.t'> of tangents at neighbouring nodes of a free chain of beam elements of the length h in space, in nm.

    In a plane, half of that, since ``<t(0).t(s)> = exp(-s/2 l_p)`` there. Of a type given by its
    ``persistence_length`` it is that length in space at the temperature given with it. Raises InputError if segments
    are straight, or the temperature is not above zero.
    """
    logarithm = np.log(beam_averages(filament_type, temperature, planar).cosine)
    return float(-filament_type.segment_length / ((2.0 if planar else 1.0) * logarithm))


def beam_mean_square_end_to_end(
    filament_type: FilamentType, elements: int, temperature: Scalar, planar: bool = False
) -> float:
    """<R^2> of a free chain of beam elements, in nm^2.

    Bends of different elements are independent, and turn about the tangent between them, or to either side in a plane,
    at random. With the chord c of an element and the tangents t and t' at its ends,

        <R^2> = N <c^2> + 2 <c.t>^2 sum_k (N - k) <t.t'>^(k-1)

    Parameters
    ----------
    filament_type : FilamentType
        With ``element="beam"``.
    elements : int
        Their number N.
    temperature : temperature, above zero
    planar : bool
        In a plane.

    Raises
    ------
    InputError
        If segments are straight, or the number or the temperature is none.
    """
    elements = number_in_memory(elements, 1, "elements")
    own = beam_averages(filament_type, temperature, planar)
    apart = np.arange(1, elements)
    pairs = 2.0 * own.chord_along**2 * np.sum((elements - apart) * own.cosine ** (apart - 1))
    return float(filament_type.segment_length**2 * (elements * own.chord_square + pairs))


def beam_bending_energy_mean(filament_type: FilamentType, temperature: Scalar, planar: bool = False) -> float:
    """Mean bending energy of one element of a free chain of beam elements, in kJ/mol, by quadrature.

    An element has two bends in each direction: of short ones it is 2 k_B T in space, and k_B T in a plane. Raises
    InputError if segments are straight, or the temperature is not above zero.
    """
    return beam_averages(filament_type, temperature, planar).bending * thermal_energy_above_zero(temperature)


def beam_stretching_energy_mean(
    filament_type: FilamentType, elements: int, temperature: Scalar, planar: bool = False
) -> float:
    """Mean stretching energy per element in kJ/mol of a free chain, of strains at nodes and in middles.

    A strain e with the energy (c/2) e^2 and the measure (1 + e)^2 de, that of a vector in space, has
    (k_B T/2) (1 + 3w)/(1 + w) with w = k_B T/c; in a plane, the measure (1 + e) de leaves k_B T/2. In the middle of an
    element d|u|/de makes a little of it more. N stiff elements have (2 N + 1) k_B T/2 together.

    Parameters
    ----------
    filament_type : FilamentType
        With ``element="beam"``.
    elements : int
        Their number N.
    temperature : temperature, above zero
    planar : bool
        In a plane.

    Raises
    ------
    InputError
        If segments are straight, or the number or the temperature is none.
    """
    require_kind(filament_type, ChainType, "filament_type")
    elements = number_in_memory(elements, 1, "elements")
    kT = thermal_energy_above_zero(temperature)
    element = filament_type.beam_element(temperature, planar)
    shares = np.full(elements + 1, 1.0 / 3.0)
    shares[[0, -1]] = 1.0 / 6.0
    of_nodes, of_middles = _SECOND_IN_A_PLANE if planar else _SECOND_IN_SPACE
    widths = of_nodes * kT / (element.modulus * element.length * shares)
    nodes = 0.5 * kT * np.sum((1.0 + 3.0 * widths) / (1.0 + widths))
    width = of_middles * 1.5 * kT / (element.modulus * element.length)
    middles = 0.5 * kT * elements * (1.0 + 3.0 * width) / (1.0 + width)
    return float((nodes + middles) / elements)


_SECOND_IN_SPACE, _SECOND_IN_A_PLANE = (1.0, 1.66), (0.0, 0.36)
"""The second coefficient of the measure of a strain at a node, (1 + e)^2 or 1 + e, and in the middle of a straight
element, |u|^2 d|u|/de = 1 + 2.2 e + 1.66 e^2 + ... or |u| d|u|/de = 1 + 1.2 e + 0.36 e^2 + ..., where e = x - x^2/10
with x = |u| - 1."""
