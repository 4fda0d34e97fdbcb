"""What a picture of a run shows: filaments, linkers, the periodic box and walls as tubes, with their colors."""

from dataclasses import dataclass, field
from typing import Any

import matplotlib
import numpy as np

from ..analysis.order import director
from ..analysis.runs import Run
from ..couplings.walls import Box, Cylinder, Ellipsoid, Plane, Sphere
from ..errors import InputError
from ..mechanics.geometry import joint_cosines, segment_vectors
from ..units.quantities import AVOGADRO
from ..units.types import FloatArray, IntArray
from .colors import filament_colors, linker_color
from .tubes import Tubes

COLORINGS = ("type", "tension", "orientation", "bending")

_LINE_COLOR, _LINE_WIDTH = np.array([0.62, 0.64, 0.68]), 0.0011
_VISIBLE = 0.009  # Of the extent of the scene: what a tube is wide at least.
_ROUND = 72
_PICONEWTON = 1e-15 * AVOGADRO * 1e-9


@dataclass(frozen=True)
class Look:
    """How a run is drawn.

    Attributes
    ----------
    color : {"type", "tension", "orientation", "bending"}
        Of filaments. The orientation is the angle of a segment with the director of the first frame that is drawn.
    diameter : float or None
        Of all tubes in nm; 0 for that of each filament, None for that or one that can be seen.
    whole : bool
        Whether filaments leave a periodic box, or go on at the opposite face.
    linkers : bool
        Whether linkers are drawn.
    average : int
        Over how many frames a tension is averaged.
    """

    color: str = "type"
    diameter: float | None = None
    whole: bool = False
    linkers: bool = True
    average: int = 1

    def __post_init__(self) -> None:
        if self.color not in COLORINGS:
            raise InputError(f"color must be one of {', '.join(COLORINGS)}, but is {self.color!r}.")


@dataclass(frozen=True)
class ColorScale:
    """A scale of colors for numbers: a label with a unit, the name of matplotlib's map, and its ends."""

    label: str
    map: str
    lowest: float
    highest: float

    def colors(self, values: FloatArray) -> FloatArray:
        """(n, 3) sRGB of (n,) values."""
        fraction = (np.asarray(values) - self.lowest) / max(self.highest - self.lowest, 1e-300)
        return matplotlib.colormaps[self.map](np.clip(fraction, 0.0, 1.0))[:, :3]


@dataclass(frozen=True)
class Scene:
    """What is common to the pictures of a run: framing, widths, colors; ``tubes(frame)`` are those of a frame.

    Attributes
    ----------
    points : (n, 3) array
        In nm: what a camera has to see.
    legend : list of (label, color, kind) with the kind "filament" or "linker"
    scale : ColorScale or None
        If filaments are not colored by their type.
    """

    run: Run
    look: Look
    points: FloatArray
    diameters: FloatArray
    legend: list[tuple[str, str, str]]
    scale: ColorScale | None
    _director: FloatArray | None = None
    _fixed: list[Tubes] = field(default_factory=list)

    def tubes(self, frame: int) -> Tubes:
        """Everything in a frame."""
        parts = list(self._fixed)
        values = None if self.scale is None else _values(self.run, self.look, self._director, frame)
        colors = filament_colors(self.run)
        for number, (own, nodes) in enumerate(zip(self.run.filaments, self.run.nodes(frame))):
            ends = np.stack([nodes, np.roll(nodes, -1, axis=0)], axis=1)[: own.segments]
            color = np.tile(_rgb(colors[own.type.name]), (own.segments, 1))
            if self.scale is not None and values is not None:
                color = self.scale.colors(values[number])
            ends, which = self._wrapped(ends)
            parts.append(Tubes.of_one_kind(ends, 0.5 * self.diameters[number], color[which]))
        if self.look.linkers:
            parts += self._linkers(frame)
        return Tubes.joined(parts)

    def _linkers(self, frame):
        records = self.run.linkers[frame]
        radius = 0.5 * float(np.median(self.diameters))
        parts = []
        for kind in range(len(self.run.linker_types)):
            places = np.asarray(records["places"][records["type"] == kind], dtype=float)
            color = _rgb(linker_color(kind, self.scale is not None))
            there = ~np.isnan(places).any(axis=2)
            springs, _ = self._wrapped(places[there.all(axis=1)])
            hands, _ = self._wrapped(np.repeat(places[there][:, None], 2, axis=1))
            parts.append(Tubes.of_one_kind(springs, 0.55 * radius, color))
            parts.append(Tubes.of_one_kind(hands, 1.35 * radius, color))
        return parts

    def _wrapped(self, ends):
        if self.run.box is None or self.look.whole or not len(ends):
            return ends, np.arange(len(ends))
        return cut_at_faces(ends, self.run.box)


def cut_at_faces(ends: FloatArray, box: FloatArray) -> tuple[FloatArray, IntArray]:
    """Lines (n, 2, 3) cut where they cross faces of a periodic box, and brought into it piece by piece.

    Returns
    -------
    (m, 2, 3) array in nm, and (m,) int array of the lines that the pieces belong to.
    """
    inverse = np.linalg.inv(box)
    pieces, which = ends @ inverse, np.arange(len(ends))
    for axis in range(3):
        while True:
            first, last = pieces[:, 0, axis], pieces[:, 1, axis]
            # The next face on the way; what ends on a face crosses none.
            face = np.where(last > first, np.floor(first) + 1.0, np.ceil(first) - 1.0)
            crosses = (face - first) * (last - face) > 1e-12
            if not crosses.any():
                break
            part = ((face - first) / np.where(crosses, last - first, 1.0))[crosses, None]
            middle = (1.0 - part) * pieces[crosses, 0] + part * pieces[crosses, 1]
            middle[:, axis] = face[crosses]
            behind = np.stack([middle, pieces[crosses, 1]], axis=1)
            pieces[crosses, 1] = middle
            pieces, which = np.concatenate([pieces, behind]), np.concatenate([which, which[crosses]])
    pieces -= np.floor(pieces.mean(axis=1))[:, None]
    return pieces @ box, which


def make_scene(run: Run, look: Look, frames: list[int]) -> Scene:
    """The scene of some frames of a run, which have one framing and one scale of colors."""
    points = _framed_points(run, look, frames)
    extent = float(np.linalg.norm(np.ptp(points, axis=0)))
    own = np.array([filament.diameter for filament in run.filaments])
    if look.diameter is None:
        diameters = np.maximum(own, _VISIBLE * extent * own / own.max())
    else:
        diameters = own if look.diameter == 0.0 else np.full(len(own), look.diameter)
    # Tubes stand out from the points by half their width.
    points = np.concatenate([points + 0.5 * diameters.max(), points - 0.5 * diameters.max()])
    colors = filament_colors(run)
    legend = [(name, color, "filament") for name, color in colors.items()] if look.color == "type" else []
    if look.linkers:
        legend += [
            (own.name, linker_color(kind, look.color != "type"), "linker") for kind, own in enumerate(run.linker_types)
        ]
    axis = director(np.concatenate(_segments(run, frames[0]))) if look.color == "orientation" else None
    scale = _color_scale(run, look, axis, frames)
    fixed = _lines(_outlines(run, points), _LINE_WIDTH * extent)
    return Scene(run, look, points, diameters, legend, scale, axis, fixed)


def _framed_points(run, look, frames):
    if run.box is not None and not look.whole:
        corners = np.array(np.meshgrid(*[[0.0, 1.0]] * 3)).reshape(3, 8).T
        return corners @ run.box
    sampled = {frames[round(place)] for place in np.linspace(0, len(frames) - 1, min(len(frames), 20))}
    ends = []
    for frame in sampled:
        nodes = np.concatenate(run.nodes(frame))
        ends += [nodes.min(axis=0), nodes.max(axis=0)]
        if len(frames) == 1:
            ends.extend(nodes)
    walls = [line for wall in run.walls for line in _outline(wall, np.array(ends))]
    if walls:
        ends.extend(np.concatenate(walls))
    return np.array(ends)


def _rgb(color):
    return np.array(matplotlib.colors.to_rgb(color))


def _segments(run, frame):
    return [segment_vectors(nodes, own.ring) for own, nodes in zip(run.filaments, run.nodes(frame))]


def _values(run: Run, look: Look, axis: FloatArray | None, frame: int) -> list[FloatArray]:
    # Of each segment of each filament.
    if look.color == "tension":
        return [tensions / _PICONEWTON for tensions in run.segment_tensions(frame, look.average)]
    units = [own / np.linalg.norm(own, axis=1, keepdims=True) for own in _segments(run, frame)]
    if look.color == "orientation":
        return [np.degrees(np.arccos(np.clip(np.abs(own @ axis), 0.0, 1.0))) for own in units]
    return [_bends(own, filament.ring) for own, filament in zip(units, run.filaments)]


def _bends(units, ring):
    # The mean of the angles at the joints of a segment.
    angles = np.degrees(np.arccos(np.clip(joint_cosines(units, ring), -1.0, 1.0)))
    if ring:
        return 0.5 * (angles + np.roll(angles, -1))
    if len(units) == 1:
        return np.zeros(1)
    padded = np.concatenate([angles[:1], angles, angles[-1:]])
    return 0.5 * (padded[1:] + padded[:-1])


def _color_scale(run, look, axis, frames):
    if look.color == "type":
        return None
    if look.color == "orientation":
        return ColorScale("angle to the director (°)", "viridis", 0.0, 90.0)
    sampled = {frames[round(place)] for place in np.linspace(0, len(frames) - 1, min(len(frames), 8))}
    values = np.concatenate([np.concatenate(_values(run, look, axis, frame)) for frame in sampled])
    if look.color == "bending":
        return ColorScale("angle between segments (°)", "viridis", 0.0, float(np.quantile(values, 0.98)) or 1.0)
    largest = float(np.quantile(np.abs(values), 0.98)) or 1.0
    return ColorScale("tension (pN)", "coolwarm", -largest, largest)


def _lines(outlines, radius):
    lines = [np.stack([outline[:-1], outline[1:]], axis=1) for outline in outlines]
    return [Tubes.of_one_kind(np.concatenate(lines), radius, _LINE_COLOR, shaded=False)] if lines else []


def _outlines(run, points):
    outlines: list[Any] = []
    if run.box is not None:
        outlines += _box_edges(np.zeros(3), run.box)
    for wall in run.walls:
        outlines += _outline(wall, points)
    return outlines


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
    if isinstance(wall, Cylinder):
        heights = (points - wall.point) @ wall.axis
        places = np.linspace(heights.min(), heights.max(), 7)
        circle = wall.radius * _circle(wall.axis)
        rings = [wall.point + height * wall.axis + circle for height in places]
        return rings + [np.array([rings[0][i], rings[-1][i]]) for i in range(0, _ROUND, _ROUND // 8)]
    offsets = (0.0,) if isinstance(wall, Plane) else (-0.5 * wall.thickness, 0.5 * wall.thickness)
    return [line for offset in offsets for line in _grid(wall.point + offset * wall.normal, wall.normal, points)]


def _circle(normal):
    first, second = _across(normal)
    angles = np.linspace(0.0, 2.0 * np.pi, _ROUND + 1)[:, None]
    return np.cos(angles) * first + np.sin(angles) * second


def _across(normal):
    first = np.cross(normal, np.eye(3)[np.argmin(np.abs(normal))])
    first /= np.linalg.norm(first)
    return first, np.cross(normal, first)


def _grid(point, normal, points):
    if isinstance(points, list):
        points = np.array(points)
    first, second = _across(normal)
    ranges = []
    for direction in (first, second):
        heights = (points - point) @ direction
        ranges.append((heights.min(), heights.max()))
    lines = []
    for (low, high), (start, end), along, aside in ((*ranges, first, second), (*ranges[::-1], second, first)):
        for place in np.linspace(low, high, 5):
            lines.append(point + np.array([place * along + start * aside, place * along + end * aside]))
    return lines
