"""The curve of a chain of beam elements: tangents, places, arc lengths and energies.

Node i has a position P and a control point Q. Element i of length h is the cubic curve with the Bezier points P_i, Q_i,
2 P_(i+1) - Q_(i+1) and P_(i+1), so r' = 3 (Q - P)/h at a node. The last element of a ring, which is closed, leads from
the last node to the first. The energy is that of ``plugin_src/mechanics/BeamChain.h``.
Axes in front of (nodes, 3) belong to several filaments or frames; everything is in OpenMM's units.
"""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import scipy

from ..mechanics.geometry import cross, unrolled
from ..mechanics.quadrature import gauss_points
from ..units.types import FloatArray

_STRAIN = 1e-6
"""Of differences."""


@dataclass(frozen=True)
class BeamElement:
    """What an element is made of.

    Attributes
    ----------
    length : float
        h at rest, in nm.
    rigidity : float
        EI in kJ nm/mol.
    modulus : float
        K in kJ/(mol nm).
    shortening : float
        The part by which its chord is shorter because of bends inside of it for which it has no coordinates.
    """

    length: float
    rigidity: float
    modulus: float
    shortening: float = 0.0


def shortening_of(bend: float, planar: bool) -> float:
    """``BeamElement.shortening`` where an element is ``bend`` = h k_B T/EI persistence lengths long."""
    return bend / (30.0 if planar else 15.0)


def node_tangents(nodes: FloatArray, control_points: FloatArray, length: float) -> FloatArray:
    """r' = 3 (Q - P)/h at the nodes, about a unit vector: (..., nodes, 3)."""
    return 3.0 * (control_points - nodes) / length


def control_points_of(nodes: FloatArray, tangents: FloatArray, length: float) -> FloatArray:
    """Q = P + h t/3 for unit vectors t at the nodes: (nodes, 3) in nm."""
    return nodes + length / 3.0 * tangents


def natural_tangents(nodes: FloatArray, closed: bool = False) -> FloatArray:
    """Unit vectors (nodes, 3) along the natural cubic spline through nodes (nodes, 3), which bends least.

    Of a ring, along the periodic one. NaN where it stops and turns back.
    """
    if closed:
        around = unrolled(nodes)
        along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(around, axis=0), axis=1))])
        slopes = scipy.interpolate.CubicSpline(along, around, bc_type="periodic")(along[:-1], 1)
    elif len(nodes) == 2:
        slopes = np.repeat(np.diff(nodes, axis=0), 2, axis=0)
    else:
        along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(nodes, axis=0), axis=1))])
        slopes = scipy.interpolate.CubicSpline(along, nodes, bc_type="natural")(along, 1)
    with np.errstate(invalid="ignore"):
        return slopes / np.linalg.norm(slopes, axis=1, keepdims=True)


def _hermite(places, derivative):
    # Weights of P and Q - P of the first node and of the second one, (places, 4); slopes are by the place.
    x, y = places, 1.0 - places
    if derivative:
        return np.stack([-6 * x * y, 3 * y * (1 - 3 * x), 6 * x * y, 3 * x * (3 * x - 2)], axis=-1)
    return np.stack([y * y * (1 + 2 * x), 3 * x * y * y, x * x * (1 + 2 * y), -3 * x * x * y], axis=-1)


def place_weights(places: npt.ArrayLike) -> FloatArray:
    """Weights of P and Q - P of the first node of an element and of the second one at places from 0 to 1: (..., 4)."""
    return _hermite(np.asarray(places, dtype=float), False)


def slope_weights(places: npt.ArrayLike) -> FloatArray:
    """Weights, as ``place_weights``, of the derivative of a place by its parameter: (..., 4)."""
    return _hermite(np.asarray(places, dtype=float), True)


def particle_weights(place: float) -> tuple[float, float, float, float]:
    """Weights of the particles P and Q of the first node of an element and of the second one: their sum is 1."""
    first, control, second, other = place_weights(place).tolist()
    return first - control, control, second - other, other


def _on_elements(nodes, control_points, places, derivative=False):
    vectors = control_points - nodes
    ends = np.stack([nodes[..., :-1, :], vectors[..., :-1, :], nodes[..., 1:, :], vectors[..., 1:, :]], axis=-2)
    return np.einsum("pw,...ewx->...epx", _hermite(np.asarray(places, dtype=float), derivative), ends)


def element_points(nodes: FloatArray, control_points: FloatArray, places: npt.ArrayLike) -> FloatArray:
    """Points of every element at places from 0, its first node, to 1, its second: (..., elements, places, 3)."""
    return _on_elements(nodes, control_points, places)


def element_slopes(nodes: FloatArray, control_points: FloatArray, places: npt.ArrayLike, length: float) -> FloatArray:
    """r' = dr/ds of every element at places from 0 to 1: (..., elements, places, 3)."""
    return _on_elements(nodes, control_points, places, derivative=True) / length


def curve_points(nodes: FloatArray, control_points: FloatArray, per_element: int, closed: bool = False) -> FloatArray:
    """Points along the curve, ``per_element`` for each element and the last node: (..., points, 3).

    Of a ring, the first point is also behind the last one, and is not there twice.
    """
    if closed:
        return curve_points(unrolled(nodes), unrolled(control_points), per_element)[..., :-1, :]
    points = element_points(nodes, control_points, np.arange(per_element) / per_element)
    points = points.reshape(*points.shape[:-3], -1, 3)
    return np.concatenate([points, nodes[..., -1:, :]], axis=-2)


def arc_lengths(nodes: FloatArray, control_points: FloatArray, closed: bool = False) -> FloatArray:
    """Lengths of the elements along the curve: (..., elements) in nm, by eight Gauss points."""
    if closed:
        return arc_lengths(unrolled(nodes), unrolled(control_points))
    places, weights = gauss_points(8)
    slopes = _on_elements(nodes, control_points, places, derivative=True)
    return np.linalg.norm(slopes, axis=-1) @ weights


def _bend(first, second):
    # The rotation from one direction to another, as vectors along its axis.
    axis = cross(first, second)
    sine, cosine = np.linalg.norm(axis, axis=-1), np.sum(first * second, axis=-1)
    factor = np.where(sine > 0.0, np.arctan2(sine, cosine) / np.where(sine > 0.0, sine, 1.0), 1.0)
    return axis * factor[..., None]


def element_energies(
    nodes: FloatArray, control_points: FloatArray, element: BeamElement, closed: bool = False
) -> tuple[FloatArray, FloatArray]:
    """Stretching and bending energies of the elements, (..., elements) each, in kJ/mol; of a ring if ``closed``."""
    if closed:
        return element_energies(unrolled(nodes), unrolled(control_points), element)
    h = element.length
    slopes = node_tangents(nodes, control_points, h)
    middle = element_slopes(nodes, control_points, [0.5], h)[..., 0, :]
    strain = np.linalg.norm(slopes, axis=-1) - 1.0
    length = np.linalg.norm(middle, axis=-1)
    directions, along = slopes / (1.0 + strain[..., None]), middle / length[..., None]
    alpha, beta = _bend(directions[..., :-1, :], along), _bend(along, directions[..., 1:, :])
    turn = np.sum((slopes[..., 1:, :] - slopes[..., :-1, :]) ** 2, axis=-1)
    bow = np.sum((slopes[..., 1:, :] + slopes[..., :-1, :] - 2.0 * middle) ** 2, axis=-1)
    apart = np.sum((beta - alpha) ** 2, axis=-1)
    scale = 1.0 + turn / 40.0 + turn**2 / 560.0 + apart / 84.0
    bending = element.rigidity / (2.0 * h) * (np.sum((alpha + beta) ** 2, axis=-1) + 4.0 / 3.0 * apart * scale**2)
    inner = length - 1.0 - bow / 40.0 + turn**2 / 480.0 + 1.5 * element.shortening
    ends = (strain[..., :-1] ** 2 + strain[..., 1:] ** 2) / 6.0
    return 0.5 * element.modulus * h * (ends + 2.0 / 3.0 * inner**2), bending


def beam_virial(
    nodes: FloatArray, control_points: FloatArray, element: BeamElement, closed: bool = False
) -> FloatArray:
    """The derivative of the energy of a chain by an affine strain of its nodes and control points: (3, 3) in kJ/mol.

    By central differences of strains of 1e-6, in which energies are nearly quadratic; component (i, j) is the sum over
    particles of r_i dE/dr_j.
    """
    strains = _STRAIN * np.eye(9).reshape(9, 3, 3)
    particles = np.stack([nodes, control_points]) - nodes[0]

    def energies(signed):
        points, controls = particles[:, None] + particles[:, None] @ signed
        stretching, bending = element_energies(points, controls, element, closed)
        return stretching.sum(axis=-1) + bending.sum(axis=-1)

    return (energies(strains) - energies(-strains)).reshape(3, 3) / (2.0 * _STRAIN)
