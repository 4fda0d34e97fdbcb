"""The three observables by which Panja, Barkema and van Leeuwen, PRE 2015, 92, 032603, Section V, judge a step."""

import numpy as np

from ..units.types import FloatArray, Scalar
from .bead_spring_type import BeadSpringType
from .equilibrium import (
    bead_spring_mean_square_distances_from_center,
    bead_spring_mean_square_end_to_end,
    bead_spring_mean_square_lengths,
)


def observables(nodes: FloatArray) -> FloatArray:
    """End-to-end vector, middle bond, and middle bead as seen from the center of all beads.

    Of positions (chains, beads, 3): (chains, 3, 3), in the same unit.
    """
    middle = nodes.shape[1] // 2
    vectors = (nodes[:, -1] - nodes[:, 0], nodes[:, middle] - nodes[:, middle - 1], nodes[:, middle] - nodes.mean(1))
    return np.stack(vectors, axis=1)


def mean_squares_of_observables(bead_type: BeadSpringType, bonds: int, temperature: Scalar) -> FloatArray:
    """Exact mean squares (3,) of the ``observables`` in nm^2, of two bonds or more."""
    middle = (bonds + 1) // 2
    squares = (
        bead_spring_mean_square_end_to_end(bead_type, bonds, temperature),
        bead_spring_mean_square_lengths(bead_type, bonds, temperature)[middle - 1],
        bead_spring_mean_square_distances_from_center(bead_type, bonds, temperature, beads=[middle])[0],
    )
    return np.array(squares)
