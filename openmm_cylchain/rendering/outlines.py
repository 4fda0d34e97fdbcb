"""The periodic box and walls as lines."""

import numpy as np

from ..analysis.runs import Run
from ..couplings.shapes import Box, Capsule, Cylinder, Ellipsoid, Plane, Sphere, Torus
from ..mechanics.geometry import directions_across
from ..units.types import FloatArray

_ROUND = 72


def box_edges(run: Run) -> list[FloatArray]:
    """The edges of the periodic box of a run, if it has one: (2, 3) arrays in nm."""
    return [] if run.box is None else _box_edges(np.zeros(3), run.box)


def wall_lines(run: Run, points: FloatArray) -> list[FloatArray]:
    """Lines on the walls of a run, (n, 3) arrays in nm, as far as there are some of the points (m, 3) beside them."""
    return [line for wall in run.walls for line in _outline(wall, points)]


def _box_edges(origin, vectors):
    edges = []
    for axis in range(3):
        others = [vectors[other] for other in range(3) if other != axis]
        for i in (0, 1):
            for j in (0, 1):
                start = origin + i * others[0] + j * others[1]
                edges.append(np.array([start, start + vectors[axis]]))
    return edges


def _outline(wall, points):
    # Lines on a wall, as far as there is something beside it.
    if isinstance(wall, Box):
        return _box_edges(wall.lower, np.diag(wall.upper - wall.lower))
    if isinstance(wall, (Sphere, Ellipsoid)):
        axes = np.full(3, wall.radius) if isinstance(wall, Sphere) else wall.semi_axes
        outlines = []
        for normal in range(3):
            for height in (-0.75, -0.4, 0.0, 0.4, 0.75) if normal == 2 else (0.0,):
                circle = np.sqrt(1.0 - height**2) * _circle(np.eye(3)[normal]) + height * np.eye(3)[normal]
                outlines.append(wall.center + axes * circle)
        for angle in (np.pi / 4, -np.pi / 4):
            outlines.append(wall.center + axes * _circle(np.array([np.cos(angle), np.sin(angle), 0.0])))
        return outlines
    if isinstance(wall, Capsule):
        return _outline_of_capsule(wall)
    if isinstance(wall, Torus):
        return _outline_of_torus(wall)
    if isinstance(wall, Cylinder):
        heights = (points - wall.point) @ wall.axis
        places = np.linspace(heights.min(), heights.max(), 7)
        circle = wall.radius * _circle(wall.axis)
        rings = [wall.point + height * wall.axis + circle for height in places]
        return rings + [np.array([rings[0][i], rings[-1][i]]) for i in range(0, _ROUND, _ROUND // 8)]
    offsets = (0.0,) if isinstance(wall, Plane) else (-0.5 * wall.thickness, 0.5 * wall.thickness)
    return [line for offset in offsets for line in _grid(wall.point + offset * wall.normal, wall.normal, points)]


def _outline_of_capsule(wall):
    half, circle = 0.5 * wall.length * wall.axis, wall.radius * _circle(wall.axis)
    rings = [wall.center + share * half + circle for share in (-1.0, 0.0, 1.0)]
    quarter = np.linspace(0.0, 0.5 * np.pi, _ROUND // 4 + 1)[:, None]
    for side in circle[: _ROUND // 2 : _ROUND // 8]:
        # From the tip of one cap to the tip of the other, and back on the far side.
        cap = half + np.cos(quarter) * wall.radius * wall.axis + np.sin(quarter) * side
        other = half + np.cos(quarter) * wall.radius * wall.axis - np.sin(quarter) * side
        rings.append(wall.center + np.concatenate([cap, -other[::-1], -cap, other[::-1]]))
    return rings


def _outline_of_torus(wall):
    # Four circles along the tube, and eight around it.
    circle, tube, lines = _circle(wall.axis), wall.minor_radius, []
    for along, across in ((tube, 0.0), (-tube, 0.0), (0.0, tube), (0.0, -tube)):
        lines.append(wall.center + (wall.major_radius + across) * circle + along * wall.axis)
    angles = np.linspace(0.0, 2.0 * np.pi, _ROUND + 1)[:, None]
    for outward in circle[: -1 : _ROUND // 8]:
        ring = np.cos(angles) * outward + np.sin(angles) * wall.axis
        lines.append(wall.center + wall.major_radius * outward + tube * ring)
    return lines


def _circle(normal):
    first, second = directions_across(normal)
    angles = np.linspace(0.0, 2.0 * np.pi, _ROUND + 1)[:, None]
    return np.cos(angles) * first + np.sin(angles) * second


def _grid(point, normal, points):
    sides = []
    for direction in directions_across(normal):
        heights = (points - point) @ direction
        sides.append((direction, heights.min(), heights.max()))
    lines = []
    for (along, low, high), (aside, start, end) in (sides, sides[::-1]):
        for place in np.linspace(low, high, 5):
            lines.append(point + np.array([place * along + start * aside, place * along + end * aside]))
    return lines
