"""How far an explicit force moves a filament of beam elements in one step, taken as straight: see ``mobility``."""

import numpy as np
from scipy.linalg import cholesky, solve_triangular

from ..beams.curve import BeamElement, place_weights
from ..filaments.filament import Filament
from ..mechanics.friction import SegmentFriction
from .mobility import PlaceResponse

_LONGEST_PIECE = 128
# Rates of relaxation of a free element, as in plugin_src/beams/BeamStep-inl.h: of strains in K/(zeta h^2), of the sum
# and of the difference of its bends in EI/(zeta h^4).
_STRAIN_RATE, _SUM_RATE, _DIFFERENCE_RATE = 378.0, 720.0, 8400.0
_GAUSS_PLACES, _GAUSS_WEIGHTS = np.polynomial.legendre.leggauss(4)


class BeamResponse(PlaceResponse):
    """The response of one filament of beam elements, taken as straight, to explicit forces in a step.

    Clamped nodes and tangents stay. Filaments of more than 128 elements are cut into pieces.

    Parameters
    ----------
    filament : Filament
    friction : SegmentFriction
        Of an element.
    element : BeamElement
    """

    def __init__(self, filament: Filament, friction: SegmentFriction, element: BeamElement) -> None:
        self.segments = filament.segments
        self._piece = min(self.segments, _LONGEST_PIECE)
        self._filament = filament
        h = element.length
        # The coordinates of an element by P and Q - P of its nodes, their stiffness, and their rates.
        ends, middle = np.array([[0, 3, 0, 0], [0, 0, 0, 3]]) / h, np.array([-1.5, -0.75, 1.5, -0.75]) / h
        modulus, rigidity = element.modulus * h, element.rigidity / h
        along, across = friction.parallel / h, friction.perpendicular / h
        strain_rate = _STRAIN_RATE * element.modulus / (along * h**2)
        rates = np.array([_SUM_RATE, _DIFFERENCE_RATE]) * element.rigidity / (across * h**4)
        bends = np.array([ends[1] - ends[0], ends[0] + ends[1] - 2.0 * middle])
        self._directions = (
            (across * h, bends, rigidity * np.array([1.0, 4.0 / 3.0]), rates),
            (
                along * h,
                np.array([*ends, middle]),
                modulus * np.array([1.0, 1.0, 4.0]) / 6.0,
                np.full(3, strain_rate),
            ),
        )

    def _factors(self, piece, segments, fractions, step):
        # Across and along the filament: F (places, unknowns) so that F F^T is the response between places.
        first = piece * self._piece
        elements = min(self._piece, self.segments - first)
        free = ~self._fixed(first, elements)
        local = np.asarray(segments) - first
        shapes = np.zeros((len(local), 2 * elements + 2))
        columns = 2 * local[:, None] + np.arange(4)
        np.put_along_axis(shapes, columns, place_weights(fractions), axis=1)
        weights = place_weights(0.5 * (1.0 + _GAUSS_PLACES))
        consistent = 0.5 * weights.T @ (_GAUSS_WEIGHTS[:, None] * weights)
        for friction, coordinates, stiffness, rates in self._directions:
            # What an implicit step resists: friction, and coordinates whose theta is above 1/2.
            excess = np.maximum(0.0, 0.5 - 1.0 / (step * rates))
            own = friction / step * consistent + coordinates.T @ ((excess * stiffness)[:, None] * coordinates)
            matrix = np.zeros((2 * elements + 2, 2 * elements + 2))
            for element in range(elements):
                matrix[2 * element : 2 * element + 4, 2 * element : 2 * element + 4] += own
            lower = cholesky(matrix[np.ix_(free, free)], lower=True)
            yield solve_triangular(lower, shapes[:, free].T, lower=True).T

    def _fixed(self, first, elements):
        fixed = np.zeros((elements + 1, 2), dtype=bool)
        for column, nodes in enumerate((self._filament.clamped, self._filament.clamped_tangents)):
            for node in nodes:
                if first <= node <= first + elements:
                    fixed[node - first, column] = True
        return fixed.ravel()
