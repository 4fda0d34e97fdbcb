"""Twist: of free chains, and of nearly straight ones under tension and torque."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..errors import InputError
from ..filaments.filament_type import FilamentType
from ..units.quantities import ENERGY, FORCE, in_units_of, non_negative, whole_number
from ..units.types import FloatOrArray, Numbers, Scalar
from .arguments import require_straight_segments, thermal_energy_above_zero


def chain_twist_variance(filament_type: FilamentType, temperature: Scalar) -> float:
    """Variance k_B T l0/C of the twist of a joint of a free chain, in radians^2; exact, and joints are independent.

    Parameters
    ----------
    filament_type : FilamentType
        With twist.
    temperature : temperature
    """
    return thermal_energy_above_zero(temperature) / _twist_stiffness(filament_type)


def chain_mean_turn_cosine(filament_type: FilamentType, segments: int, temperature: Scalar) -> float:
    """Mean cosine cos(n m0) exp(-n k_B T l0/2C) of the twist of so many joints n of a free chain; exact.

    Parameters
    ----------
    filament_type : FilamentType
        With twist.
    segments : int
        How many segments apart two material frames are.
    temperature : temperature
    """
    count = whole_number(segments, 0, "segments")
    decay = np.exp(-0.5 * count * chain_twist_variance(filament_type, temperature))
    return float(decay * np.cos(count * filament_type.rest_twist))


@dataclass(frozen=True)
class TwistedChain:
    """A nearly straight chain under tension and torque; see ``twisted_chain``.

    Attributes
    ----------
    relative_extension : float
        <z>/L.
    writhe_per_segment : float
        Mean writhe <Wr> of a segment.
    turns_per_segment : float
        Mean turns Lk of a segment, of twist and writhe, beyond those at rest.
    effective_torsional_rigidity : float
        C_eff in kJ nm/mol without torque: k_B T L over the variance of the angle between the ends.
    """

    relative_extension: float
    writhe_per_segment: float
    turns_per_segment: float
    effective_torsional_rigidity: float


def twisted_chain(filament_type: FilamentType, force: Scalar, torque: Scalar, temperature: Scalar) -> TwistedChain:
    """Extension, writhe and turns of a long discrete chain that is pulled and turned; for small angles.

    Bends of the discrete chain with inextensible segments, to the second order: with K the stiffness of a joint, and
    over k_B T ``a = 2K + f l0``, ``b = 2K`` and the torque g, ::

        1 - z/L = 1/(a^2 - b^2 - g^2)^(1/2),
        2 pi <Wr> = g/(b^2 + g^2) (a/(a^2 - b^2 - g^2)^(1/2) - 1)               of a segment,
        1/C_eff - 1/C = (a/(a^2 - b^2)^(1/2) - 1)/(l0 b^2).

    Of short segments, these are 1/(4Af - g^2)^(1/2) and 1/(4A (Af)^(1/2)) (Moroz and Nelson, Proc. Natl. Acad. Sci. USA
    1997, 94, 14418). Without torque, 1 - z/L is too large by about (1 - z/L)^2/2.

    Parameters
    ----------
    filament_type : FilamentType
        With twist and straight segments.
    force : force, not negative
    torque : energy
    temperature : temperature

    Raises
    ------
    InputError
        For a torque with which the straight chain is not stable.
    """
    require_straight_segments(filament_type)
    kT = thermal_energy_above_zero(temperature)
    length, stiffness = filament_type.segment_length, filament_type.joint_stiffness / kT
    bare = _twist_stiffness(filament_type) * length / kT
    pull = non_negative(force, FORCE, "force") * length / kT
    turn = float(in_units_of(torque, ENERGY, "torque")) / kT
    a, b = 2.0 * stiffness + pull, 2.0 * stiffness
    square = (a - b) * (a + b) - turn**2
    if square <= 0.0:
        raise InputError(
            f"A straight chain under this force is stable up to a torque of {critical_torque(filament_type, force):g} "
            f"kJ/mol, but the torque is {turn * kT:g} kJ/mol."
        )
    root = np.sqrt(square)
    writhe = turn / (b**2 + turn**2) * (a / root - 1.0)
    compliance = 1.0 / bare + (a / np.sqrt((a - b) * (a + b)) - 1.0) / (length * b**2)
    return TwistedChain(
        float(1.0 - 1.0 / root),
        float(writhe / (2.0 * np.pi)),
        float((turn * length / bare + writhe) / (2.0 * np.pi)),
        float(kT / compliance),
    )


def critical_torque(filament_type: FilamentType, force: Numbers) -> FloatOrArray:
    """Torque ``(4 K l0 f + (f l0)^2)^(1/2)`` beyond which a long straight chain under tension is not stable, in kJ/mol.

    Parameters
    ----------
    filament_type : FilamentType
        With straight segments.
    force : force, number or array, not negative
    """
    require_straight_segments(filament_type)
    pull = np.asarray(in_units_of(force, FORCE, "force")) * filament_type.segment_length
    if np.any(pull < 0.0):
        raise InputError("force must not be negative.")
    return np.sqrt(4.0 * filament_type.joint_stiffness * pull + pull**2)[()]


def ring_buckling_turns(filament_type: FilamentType) -> float:
    """Turns sqrt(3) A/C beyond which a flat ring without noise is not stable, of the continuous filament.

    Parameters
    ----------
    filament_type : FilamentType
        With twist.
    """
    rigidity = filament_type.bending_rigidity
    return float(np.sqrt(3.0) * rigidity / (_twist_stiffness(filament_type) * filament_type.segment_length))


def _twist_stiffness(filament_type):
    require_straight_segments(filament_type)
    return filament_type.twist_stiffness
