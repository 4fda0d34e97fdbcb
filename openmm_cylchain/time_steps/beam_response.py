"""How far an explicit force moves a filament of beam elements in one step, taken as straight: see ``mobility``."""

import numpy as np
import scipy

from ..beams.curve import BeamElement, place_weights
from ..filaments.filament import Filament
from ..mechanics.friction import SegmentFriction
from ..mechanics.quadrature import gauss_points
from .mobility import PlaceResponse

_LONGEST_PIECE = 128
# Rates of relaxation of a free element, as in plugin_src/beams/BeamStep-inl.h: of strains in K/(zeta h^2), of the sum
# and of the difference of its bends in EI/(zeta h^4).
_STRAIN_RATE, _SUM_RATE, _DIFFERENCE_RATE = 378.0, 720.0, 8400.0


class BeamResponse(PlaceResponse):
    """The response of one filament of beam elements, taken as straight, to explicit forces in a step.

    Clamped nodes and tangents stay. Filaments of more than 128 elements are cut into pieces, and rings, whose elements
    are taken as straight but joined all the same, are then open. The friction is that of an element.
    """

    def __init__(self, filament: Filament, friction: SegmentFriction, element: BeamElement) -> None:
        self.segments = filament.segments
        self._piece = min(self.segments, _LONGEST_PIECE)
        self._filament = filament
        self._closed = filament.closed and self.segments <= _LONGEST_PIECE
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
        unknowns = 2 * elements + (0 if self._closed else 2)
        shapes = np.zeros((len(local), unknowns))
        columns = (2 * local[:, None] + np.arange(4)) % unknowns
        np.put_along_axis(shapes, columns, place_weights(fractions), axis=1)
        places, shares = gauss_points(4)
        weights = place_weights(places)
        consistent = weights.T @ (shares[:, None] * weights)
        for friction, coordinates, stiffness, rates in self._directions:
            # What an implicit step resists: friction, and coordinates whose theta is above 1/2.
            excess = np.maximum(0.0, 0.5 - 1.0 / (step * rates))
            own = friction / step * consistent + coordinates.T @ ((excess * stiffness)[:, None] * coordinates)
            matrix = np.zeros((unknowns, unknowns))
            for element in range(elements):
                of_element = (2 * element + np.arange(4)) % unknowns
                matrix[np.ix_(of_element, of_element)] += own
            lower = scipy.linalg.cholesky(matrix[np.ix_(free, free)], lower=True)
            yield scipy.linalg.solve_triangular(lower, shapes[:, free].T, lower=True).T

    def _fixed(self, first, elements):
        count = elements if self._closed else elements + 1
        fixed = np.zeros((count, 2), dtype=bool)
        for column, nodes in enumerate((self._filament.clamped, self._filament.clamped_tangents)):
            for node in nodes:
                # The last piece of a ring that is cut ends at its first node.
                if first <= node < first + count:
                    fixed[node - first, column] = True
                elif self._filament.closed and node == 0 and first + elements == self.segments:
                    fixed[-1, column] = True
        return fixed.ravel()
