"""Energies of joints and segments in equilibrium: their means and variances."""

import math

import numpy as np
import scipy

from ..filaments.equilibrium import PlanarJointAngleDistribution, SegmentLengthDistribution
from ..filaments.filament_type import FilamentType
from ..units.quantities import true_or_false
from ..units.types import Scalar
from .arguments import require_straight_segments, thermal_energy_above_zero


def bending_energy_mean(filament_type: FilamentType, temperature: Scalar, planar: bool = False) -> float:
    """Mean bending energy of one joint at equilibrium, in kJ/mol; exact for every bending model.

    Inscribed circle: eq. (40), ``x k_B T (E_1(x)/E_2(x) - 1)`` with x = 2 K/k_B T, the paper's 2 lp/l0. Kratky-Porod:
    ``k_B T (1 - 2u/(exp(2u) - 1))`` with u = K/k_B T. Quadratic: by quadrature. A freely jointed chain has 0;
    stiff chains tend to k_B T, and the inscribed circle to ``k_B T (1 - l0/lp)``: the limit printed below
    (41), k_B T/(1 - l0/lp), has the wrong sign before l0/lp. In a plane: by quadrature; it tends to k_B T/2.

    Parameters
    ----------
    filament_type : FilamentType
    temperature : temperature, above zero
    planar : bool
        In a plane.
    """
    require_straight_segments(filament_type)
    kT = thermal_energy_above_zero(temperature)
    if true_or_false(planar, "planar"):
        distribution = PlanarJointAngleDistribution(filament_type, temperature)
        return float(distribution.mean(lambda angle: filament_type.bending_energy(np.cos(angle))))
    return kT * _reduced_bending_moments(filament_type, kT)[0]


def bending_energy_variance(filament_type: FilamentType, temperature: Scalar) -> float:
    """Variance of the bending energy of one joint, in (kJ/mol)^2; exact for every bending model.

    Inscribed circle: eq. (41), ``(x k_B T)^2 (E_0/E_2 - (E_1/E_2)^2)`` at x = 2 K/k_B T. Kratky-Porod:
    ``(k_B T)^2 (1 - (u/sinh u)^2)`` with u = K/k_B T. Quadratic: by quadrature.
    """
    require_straight_segments(filament_type)
    kT = thermal_energy_above_zero(temperature)
    return kT**2 * _reduced_bending_moments(filament_type, kT)[1]


def _reduced_bending_moments(filament_type, kT):
    stiffness = filament_type.joint_stiffness / kT
    if stiffness == 0:
        return 0.0, 0.0
    moments = {
        "inscribed-circle": _inscribed_circle_moments,
        "kratky-porod": _kratky_porod_moments,
        "quadratic": _quadratic_moments,
    }
    if filament_type.bending_model in moments:
        mean, variance = moments[filament_type.bending_model](stiffness)
    else:
        mean, variance = _moments_by_quadrature(filament_type.bending_potential, stiffness)
    return float(mean), float(variance)


def _moments_by_quadrature(potential, stiffness):
    # Of any model, as far as tangent_decorrelation goes.
    node, weight = np.polynomial.legendre.leggauss(400)
    angle = 0.5 * min(math.pi, 20.0 / math.sqrt(stiffness)) * (node + 1.0)
    energy = potential.energy(stiffness, np.cos(angle))
    return _moments(energy, weight * np.sin(angle) * np.exp(-energy))


def _inscribed_circle_moments(stiffness):
    x = 2.0 * stiffness
    if x < 20.0:
        second = scipy.special.expn(2, x)
        first, zeroth = scipy.special.expn(1, x) / second, math.exp(-x) / (x * second)
        return x * (first - 1.0), x**2 * (zeroth - first**2)
    # The ratios of E_n cancel and underflow for large x; v = V_b/k_B T has the density exp(-v)/(1 + v/x)^2.
    energy, weight = np.polynomial.laguerre.laggauss(60)
    return _moments(energy, weight / (1.0 + energy / x) ** 2)


def _kratky_porod_moments(stiffness):
    if stiffness < 0.02:
        square = stiffness**2
        mean = stiffness - square * (1.0 / 3.0 - square * (1.0 / 45.0 - square * 2.0 / 945.0))
        return mean, square * (1.0 / 3.0 - square * (1.0 / 15.0 - square * 2.0 / 189.0))
    inverse_sinh = 2.0 * math.exp(-stiffness) / -math.expm1(-2.0 * stiffness)
    return 1.0 - stiffness * math.exp(-stiffness) * inverse_sinh, 1.0 - (stiffness * inverse_sinh) ** 2


def _quadratic_moments(stiffness):
    node, weight = np.polynomial.legendre.leggauss(200)
    angle = 0.5 * min(math.pi, math.sqrt(160.0 / stiffness)) * (node + 1.0)
    energy = 0.5 * stiffness * angle**2
    return _moments(energy, weight * np.sin(angle) * np.exp(-energy))


def _moments(values, weights):
    mean = weights @ values / weights.sum()
    return mean, weights @ (values - mean) ** 2 / weights.sum()


def stretching_energy_mean(filament_type: FilamentType, temperature: Scalar, planar: bool = False) -> float:
    """Mean stretching energy of one segment at equilibrium, in kJ/mol; exact.

    Averages over (19), rho(l) ~ l^2 exp(-V_el/k_B T). Harmonic: ``(k_B T/2)(1 + 2/(s^2 + 1))`` with
    s^2 = k l0^2/k_B T, up to terms in exp(-s^2/2) that are included. The printed (42) and its variance weigh
    with l where (19) has l^2, and so miss the term 2/(s^2 + 1); the printed expansion of (42) also has the
    wrong sign before its exponential, and the printed variance lacks a sqrt(pi) in the denominator. FENE, and all
    filaments in a plane, with rho(l) ~ l exp(-V_el/k_B T): by quadrature.

    Parameters
    ----------
    filament_type : FilamentType
    temperature : temperature, above zero
    planar : bool
        In a plane.
    """
    require_straight_segments(filament_type)
    if true_or_false(planar, "planar"):
        return float(
            SegmentLengthDistribution(filament_type, temperature, planar).mean(filament_type.stretching_energy)
        )
    return _stretching_moments(filament_type, temperature)[0]


def stretching_energy_variance(filament_type: FilamentType, temperature: Scalar) -> float:
    """Variance of the stretching energy of one segment, in (kJ/mol)^2; exact, see ``stretching_energy_mean``."""
    require_straight_segments(filament_type)
    return _stretching_moments(filament_type, temperature)[1]


def _stretching_moments(filament_type, temperature):
    kT = thermal_energy_above_zero(temperature)
    if filament_type.stretching_model != "harmonic":
        distribution = SegmentLengthDistribution(filament_type, temperature)
        mean = distribution.mean(filament_type.stretching_energy)
        variance = distribution.mean(lambda length: (filament_type.stretching_energy(length) - mean) ** 2)
        return float(mean), float(variance)
    scaled_length = filament_type.segment_length * math.sqrt(filament_type.segment_stiffness / kT)
    moment = _truncated_normal_moments(scaled_length, 6)

    def weighted(order):
        # l^2 ~ (s + u)^2 for l = l0 (1 + u/s).
        return scaled_length**2 * moment[order] + 2.0 * scaled_length * moment[order + 1] + moment[order + 2]

    mean = 0.5 * weighted(2) / weighted(0)
    return kT * mean, kT**2 * (0.25 * weighted(4) / weighted(0) - mean**2)


def _truncated_normal_moments(bound, highest):
    # Integrals of u^n times the normal density from -bound to infinity, by parts.
    density = math.exp(-0.5 * bound**2) / math.sqrt(2.0 * math.pi)
    moments = [0.5 * math.erfc(-bound / math.sqrt(2.0)), density]
    for order in range(2, highest + 1):
        moments.append((order - 1) * moments[order - 2] + (-bound) ** (order - 1) * density)
    return moments
