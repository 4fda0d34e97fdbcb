"""Nematic order of segments: the tensor, its largest eigenvalue and the director."""

from __future__ import annotations

import numpy as np

from ..errors import InputError
from ..units.quantities import LENGTH, in_units_of
from ..units.types import FloatArray


def order_tensor(vectors: FloatArray) -> FloatArray:
    """The nematic order tensor ``Q = <(3 t t - 1)/2>`` of segments, each weighted by its length.

    De Gennes and Prost, The Physics of Liquid Crystals, 2nd ed. (Oxford, 1993), Section 2.1. The length is the weight
    since order is that of the filaments, however they are cut into segments.

    Parameters
    ----------
    vectors : (n, 3) array
        Along the segments; their lengths are their weights.

    Returns
    -------
    (3, 3) array
        Symmetric with trace 0.

    Raises
    ------
    InputError
        For another shape, none, or a total length of zero.
    """
    vectors = np.asarray(in_units_of(vectors, LENGTH, "vectors"))
    if vectors.ndim != 2 or vectors.shape[1] != 3 or not len(vectors):
        raise InputError(f"vectors must have the shape (segments, 3), but have {vectors.shape}.")
    lengths = np.linalg.norm(vectors, axis=1)
    if not lengths.sum() > 0.0:
        raise InputError("Segments of no length have no order.")
    products = np.einsum("ni,nj,n->ij", vectors, vectors, np.divide(1.0, lengths, where=lengths > 0, out=lengths * 0))
    return 1.5 * products / lengths.sum() - 0.5 * np.eye(3)


def order_parameter(vectors: FloatArray) -> float:
    """The nematic order parameter S: the largest eigenvalue of ``order_tensor``; 1 if all are parallel, 0 for many that
    are isotropic. Of n isotropic ones it is about n^(-1/2) above zero by chance."""
    return float(np.linalg.eigvalsh(order_tensor(vectors))[-1])


def director(vectors: FloatArray) -> FloatArray:
    """The direction of order: a unit vector (3,), the eigenvector of ``order_tensor`` with the largest eigenvalue.

    Its sign has no meaning; its largest component is positive.
    """
    axis = np.linalg.eigh(order_tensor(vectors))[1][:, -1]
    return axis * np.sign(axis[np.argmax(np.abs(axis))])
