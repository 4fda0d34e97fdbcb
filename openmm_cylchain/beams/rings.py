"""Circles of beam elements: how rings begin."""

import math

import numpy as np

from ..mechanics.geometry import regular_polygon
from ..units.types import FloatArray
from .curve import BeamElement, control_points_of
from .equilibrium import middle_length


def circle(
    element: BeamElement, elements: int, center: FloatArray, normal: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Nodes and control points, (elements, 3) in nm each, of a circle of elements without strains.

    Its radius is elements h/(2 pi) but for what ``BeamElement.shortening`` takes off and, where elements bend far, for
    the error of cubic curves: it is 2e-4 of it with six elements.

    Parameters
    ----------
    elements : int
        At least three.
    center : (3,) array
        In nm.
    normal : (3,) array
        Unit vector across the circle; nodes go counter-clockwise around it.
    """
    half = math.pi / elements
    # Along a chord, the tangents at its ends add up to this.
    along, turn = 2.0 * math.cos(half), 4.0 * math.sin(half) ** 2
    length, _ = middle_length(-1.5 * element.shortening, along, along**2, turn)
    chord = element.length / 1.5 * (float(length) + 0.25 * along)
    nodes = regular_polygon(elements, chord, center, normal)
    radii = nodes - center
    tangents = np.cross(normal, radii / np.linalg.norm(radii, axis=1, keepdims=True))
    return nodes, control_points_of(nodes, tangents, element.length)
