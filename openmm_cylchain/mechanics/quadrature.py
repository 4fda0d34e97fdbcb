"""Gauss-Legendre quadrature from 0 to 1."""

from functools import cache

import numpy as np

from ..units.types import FloatArray


@cache
def gauss_points(count: int) -> tuple[FloatArray, FloatArray]:
    """Places from 0 to 1 and their weights, which add up to 1; right for polynomials of the degree 2 count - 1."""
    places, weights = np.polynomial.legendre.leggauss(count)
    return 0.5 * (1.0 + places), 0.5 * weights
