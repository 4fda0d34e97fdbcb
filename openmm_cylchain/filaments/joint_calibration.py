"""Stiffness of a joint from the length over which the tangents of the discrete chain decorrelate."""

from functools import lru_cache

import numpy as np
import scipy

from ..mechanics.potentials import BENDING_POTENTIALS
from ..mechanics.quadrature import gauss_points

_POINTS = 400
_LARGEST_DECORRELATION = 300.0


def tangent_decorrelation(bending_model: str, reduced_stiffness: float) -> float:
    """``-ln <c>`` of a joint in space: the average of c = t1.t2 with the weight exp(-V_b/k_B T), by quadrature.

    The stiffness is K/(k_B T), where K takes the place of a/l0 in the bending potential; it is above zero.
    """
    # V_b is at least K theta^2 2/pi^2, so that beyond the widest angle exp(-V_b/k_B T) vanishes.
    widest = min(np.pi, 20.0 / np.sqrt(reduced_stiffness))
    places, weights = gauss_points(_POINTS)
    angle = widest * places
    cosine = np.cos(angle)
    measure = weights * np.sin(angle)
    energy = BENDING_POTENTIALS[bending_model].energy(reduced_stiffness, cosine)
    norm = measure @ np.exp(-energy)
    bend = measure @ (2.0 * np.sin(0.5 * angle) ** 2 * np.exp(-energy)) / norm
    if bend < 0.5:
        return -np.log1p(-bend)
    # The average of c itself is zero, so exp(-v) - 1 serves as well as exp(-v) and keeps the digits of weak joints.
    return -np.log(measure @ (cosine * np.expm1(-energy)) / norm)


@lru_cache(maxsize=256)
def calibrated_stiffness(bending_model: str, decorrelation: float) -> float:
    """K/(k_B T) of the joint with ``<t1.t2> = exp(-decorrelation)``, the inverse of ``tangent_decorrelation``.

    It tends to 1/decorrelation for stiff joints, and falls to zero for weak ones, without end: every bending model
    reaches every mean cosine between 0 and 1.
    """
    # exp(-300) is no correlation at all to any precision.
    decorrelation = min(decorrelation, _LARGEST_DECORRELATION)

    def excess(logarithm):
        return np.log(tangent_decorrelation(bending_model, np.exp(logarithm)) / decorrelation)

    lowest, highest = np.log(1e-3) - decorrelation, np.log(3.0 / decorrelation + 3.0)
    return float(np.exp(scipy.optimize.brentq(excess, lowest, highest, xtol=1e-14, rtol=1e-14)))
