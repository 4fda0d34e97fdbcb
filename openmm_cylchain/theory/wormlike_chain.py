"""The continuous wormlike chain (WLC): end-to-end distance, tangents, bending modes, and one that is clamped."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from ..errors import InputError
from ..units.quantities import LENGTH, in_units_of, positive, true_or_false
from ..units.types import FloatOrArray, Numbers, Scalar
from .arguments import each_not_negative, each_whole_number


def wlc_mean_square_end_to_end(
    contour_length: Numbers, persistence_length: Scalar, planar: bool = False
) -> FloatOrArray:
    """Mean square end-to-end distance of the free WLC, eq. (25), in nm^2.

    ``<R^2> = 2 lp^2 (L/lp - 1 + exp(-L/lp))``, accurate to rounding from rods to coils. In a plane, where tangents
    decorrelate over 2 lp, ``8 lp^2 (L/2lp - 1 + exp(-L/2lp))``: eq. (44) of Chandran and Mofrad, Phys. Rev. E 2009, 79,
    011906.

    Parameters
    ----------
    contour_length : length, number or array, not negative
    persistence_length : length, above zero
        a/(k_B T), in space and in a plane.
    planar : bool
        In a plane.
    """
    length = each_not_negative(contour_length, LENGTH, "contour_length")
    ratio = np.asarray(length / _correlation_length(persistence_length, planar))
    # The closed form loses digits to cancellation for rods: 1 - x/3 + x^2/12 - ... there.
    series = sum(2.0 * (-1.0) ** n * np.minimum(ratio, 1.0) ** n / math.factorial(n + 2) for n in range(12))
    large = np.maximum(ratio, 0.1)
    closed = 2.0 * (large + np.expm1(-large)) / large**2
    return length**2 * np.where(ratio < 0.1, series, closed)[()]


def _correlation_length(persistence_length, planar):
    # A tangent has one direction to turn to in a plane, two in space.
    directions = 1.0 if true_or_false(planar, "planar") else 2.0
    return 2.0 / directions * positive(persistence_length, LENGTH, "persistence_length")


def wlc_tangent_correlation(
    contour_distance: Numbers, persistence_length: Scalar, planar: bool = False
) -> FloatOrArray:
    """Correlation of tangents of the WLC, ``<t(0).t(s)> = exp(-s/lp)``, in a plane ``exp(-s/2lp)``.

    Parameters
    ----------
    contour_distance : length, number or array, not negative
    persistence_length : length, above zero
    planar : bool
        In a plane.
    """
    distance = each_not_negative(contour_distance, LENGTH, "contour_distance")
    return np.exp(-distance / _correlation_length(persistence_length, planar))


def wlc_j_factor(contour_length: Numbers, persistence_length: Scalar) -> FloatOrArray:
    """J factor of a short WLC: the density of its one end where the other is, whatever their directions, in 1/nm^3.

    ``J = 112.04 lp^-3 (lp/L)^5 exp(-14.054 lp/L + 0.246 L/lp)``: Shimada and Yamakawa, Macromolecules 1984, 17, 689,
    for chains that a loop bends much more than heat does. Divide by 0.602214 for mol/l.

    Parameters
    ----------
    contour_length : length, number or array
        Above zero, and at most 4 persistence lengths.
    persistence_length : length, above zero

    Raises
    ------
    InputError
        If a contour length is out of range.
    """
    persistence = positive(persistence_length, LENGTH, "persistence_length")
    ratio = in_units_of(contour_length, LENGTH, "contour_length") / persistence
    if not np.all((np.asarray(ratio) > 0) & (np.asarray(ratio) <= 4)):
        raise InputError("contour_length must be above zero and at most 4 persistence lengths.")
    return 112.04 / persistence**3 * ratio**-5.0 * np.exp(-14.054 / ratio + 0.246 * ratio)


def bending_mode_variance(mode: npt.ArrayLike, contour_length: Scalar, persistence_length: Scalar) -> FloatOrArray:
    """Variance of the amplitude of a bending mode of the free WLC per transverse direction, in nm.

    ``<a_n^2> = (L/(n pi))^2 / lp`` for the tangent angle theta(s) = sqrt(2/L) sum_n a_n cos(n pi s/L) in one
    transverse plane: eqs. (45) and (46) of Chandran and Mofrad, Phys. Rev. E 2009, 79, 011906. It holds for
    small angles.

    Parameters
    ----------
    mode : int or array of int, at least 1
    contour_length, persistence_length : length, above zero
    """
    length = positive(contour_length, LENGTH, "contour_length")
    wavelength = length / (np.pi * each_whole_number(mode, 1, "mode"))
    return wavelength**2 / positive(persistence_length, LENGTH, "persistence_length")


def clamped_angle_variance(contour_distance: Numbers, persistence_length: Scalar) -> FloatOrArray:
    """Variance of the tangent angle of a WLC that is clamped at one end: ``s/lp`` at the distance s from there.

    Eq. (42) of Chandran and Mofrad, Phys. Rev. E 2009, 79, 011906. In space it holds for small angles, in either
    transverse plane; for motion in a plane it is exact.

    Parameters
    ----------
    contour_distance : length, number or array, not negative
    persistence_length : length, above zero
    """
    distance = each_not_negative(contour_distance, LENGTH, "contour_distance")
    return distance / positive(persistence_length, LENGTH, "persistence_length")


def clamped_deflection_variance(contour_distance: Numbers, persistence_length: Scalar) -> FloatOrArray:
    """Variance of the deflection of a WLC that is clamped at one end, ``s^3/(3 lp)``, in nm^2.

    It holds for small angles, in either transverse plane. Eq. (43) of Chandran and Mofrad, Phys. Rev. E 2009, 79,
    011906, has the factor 32/pi^4 for 1/3.

    Parameters
    ----------
    contour_distance : length, number or array, not negative
        s, from the clamp.
    persistence_length : length, above zero
    """
    distance = each_not_negative(contour_distance, LENGTH, "contour_distance")
    return distance**3 / (3.0 * positive(persistence_length, LENGTH, "persistence_length"))
