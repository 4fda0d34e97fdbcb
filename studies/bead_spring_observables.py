"""The three observables by which Panja, Barkema and van Leeuwen, PRE 2015, 92, 032603, Section V, judge a step."""

import numpy as np

from openmm_cylchain import theory


def observables(nodes):
    """End-to-end vector, middle bond, and middle bead as seen from the center of all beads.

    Of positions (chains, beads, 3): (chains, 3, 3), in the same unit.
    """
    middle = nodes.shape[1] // 2
    vectors = (nodes[:, -1] - nodes[:, 0], nodes[:, middle] - nodes[:, middle - 1], nodes[:, middle] - nodes.mean(1))
    return np.stack(vectors, axis=1)


def mean_squares_of_observables(bead_type, bonds, temperature):
    """Exact mean squares (3,) of the ``observables`` in nm^2, of two bonds or more."""
    middle = (bonds + 1) // 2
    squares = (
        theory.bead_spring_mean_square_end_to_end(bead_type, bonds, temperature),
        theory.bead_spring_mean_square_lengths(bead_type, bonds, temperature)[middle - 1],
        theory.bead_spring_mean_square_distances_from_center(bead_type, bonds, temperature, beads=[middle])[0],
    )
    return np.array(squares)
