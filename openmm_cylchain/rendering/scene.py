"""What a picture of a run shows, with its colors: filaments, linkers, the periodic box and walls as tubes, particles as
balls."""

from dataclasses import dataclass, field

import matplotlib
import numpy as np

from ..analysis.order import director
from ..analysis.run_filaments import RunParticles
from ..analysis.runs import Run
from ..errors import InputError
from ..mechanics.geometry import segment_vectors
from ..output.colors import PLUS_END, PLUS_END_COLOR
from ..units.quantities import PICONEWTON
from ..units.types import FloatArray, IntArray
from .colors import filament_colors, linker_colors, particle_colors
from .outlines import box_edges, wall_lines
from .tubes import Tubes

WATER = ("HOH", "WAT", "SOL", "TIP3", "H2O")
"""Names of residues of water."""

COLORINGS = ("type", "tension", "orientation", "bending")

_LINE_COLOR, _LINE_WIDTH = np.array([0.62, 0.64, 0.68]), 0.0011
_VISIBLE = 0.009  # Of the extent of the scene: what a tube is wide at least.
_VISIBLE_BALL = 0.012
# A line along a filament that turns with its material: its radius, and how far out it is, over the filament's radius.
_STRIPE, _STRIPE_OUT, _STRIPE_COLOR = 0.6, 0.7, np.array([0.08, 0.08, 0.1])
_PLUS_END = 0.75  # Of the diameter of a filament: the radius of the ball at its last node.


@dataclass(frozen=True)
class Look:
    """How a run is drawn.

    Attributes
    ----------
    color : {"type", "tension", "orientation", "bending"}
        Of filaments. The orientation is the angle of a segment with the director of the first frame that is drawn
        with filaments.
    diameter : float or None
        Of all tubes in nm; 0 for that of each filament, None for that or one that can be seen.
    whole : bool
        Whether filaments leave a periodic box, or go on at the opposite face.
    linkers : bool
        Whether linkers and crosslinks are drawn.
    average : int
        Over how many frames a tension is averaged.
    particles : bool
        Whether particles beside filaments are drawn.
    hidden : tuple of str
        Names of residues that are not: of water if not given, which would cover all else.
    """

    color: str = "type"
    diameter: float | None = None
    whole: bool = False
    linkers: bool = True
    average: int = 1
    particles: bool = True
    hidden: tuple[str, ...] = WATER

    def particles_of(self, run: Run) -> list[RunParticles]:
        """The particles beside filaments that are drawn."""
        return [own for own in run.particles if own.name not in self.hidden] if self.particles else []

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
    legend : list of (label, color, kind) with the kind "filament", "particle" or "linker"
    scale : ColorScale or None
        If filaments are not colored by their type and load.
    """

    run: Run
    look: Look
    points: FloatArray
    diameters: FloatArray
    ball_diameters: list[float]
    legend: list[tuple[str, str, str]]
    scale: ColorScale | None
    _director: FloatArray | None = None
    _fixed: list[Tubes] = field(default_factory=list)

    def tubes(self, frame: int) -> Tubes:
        """Everything in a frame."""
        parts = list(self._fixed)
        values = None if self.scale is None else _values(self.run, self.look, self._director, frame)
        colors, frames = filament_colors(self.run), self.run.material_frames(frame)
        for number, (own, points) in enumerate(zip(self.run.filaments, self.run.curves(frame))):
            if not len(points):
                continue
            ends = np.stack([points, np.roll(points, -1, axis=0)], axis=1)[: len(points) - (not own.ring)]
            color = np.tile(_rgb(colors[own.label]), (len(ends), 1))
            if self.scale is not None and values is not None:
                color = self.scale.colors(values[number])
            if has_polarity(self.run) and not own.ring:
                plus, _ = self._wrapped(np.repeat(points[-1:, None], 2, axis=1).astype(float))
                parts.append(Tubes.of_one_kind(plus, _PLUS_END * self.diameters[number], _rgb(PLUS_END_COLOR)))
            ends, which = self._wrapped(ends)
            radius = 0.5 * self.diameters[number]
            parts.append(Tubes.of_one_kind(ends, radius, color[which]))
            if len(frames[number]):
                stripe, _ = self._wrapped(_stripe(points, own.ring, frames[number], _STRIPE_OUT * radius))
                parts.append(Tubes.of_one_kind(stripe, _STRIPE * radius, _STRIPE_COLOR))
        if self.look.linkers:
            parts += self._linkers(frame)
        return Tubes.joined(parts + self._balls(frame))

    def _balls(self, frame):
        colors, positions = particle_colors(self.run), self.run.positions(frame)
        parts = []
        for own, diameter in zip(self.look.particles_of(self.run), self.ball_diameters):
            balls, _ = self._wrapped(np.repeat(positions[own.indices][:, None], 2, axis=1).astype(float))
            parts.append(Tubes.of_one_kind(balls, 0.5 * diameter, _rgb(colors[own.name])))
        return parts

    def _linkers(self, frame):
        radius = 0.5 * float(np.median(self.diameters if len(self.diameters) else self.ball_diameters))
        parts = []
        for kind, name in enumerate(linker_colors(self.run, self.scale is not None)):
            lines, places = self.run.springs(frame, kind)
            color = _rgb(name)
            springs, _ = self._wrapped(lines)
            hands, _ = self._wrapped(np.repeat(places[:, None], 2, axis=1))
            parts.append(Tubes.of_one_kind(springs, 0.55 * radius, color))
            parts.append(Tubes.of_one_kind(hands, 1.35 * radius, color))
        return parts

    def _wrapped(self, ends):
        if self.run.box is None or self.look.whole or not len(ends):
            return ends, np.arange(len(ends))
        return cut_at_faces(ends, self.run.box)


def _stripe(points, ring, across, distance):
    # Pieces between nodes and middles of segments of a line along a filament that turns with its material.
    vectors = np.roll(points, -1, axis=0) - points if ring else np.diff(points, axis=0)
    middles = points[: len(vectors)] + 0.5 * vectors + distance * across
    before = np.roll(across, 1, axis=0)
    if not ring:
        before, across = np.vstack([across[:1], before[1:], across[-1:]]), np.vstack([across, across[-1:]])
    at_nodes = before + across
    at_nodes /= np.maximum(np.linalg.norm(at_nodes, axis=1, keepdims=True), 1e-9)
    places = points + distance * at_nodes
    behind = np.roll(places, -1, axis=0) if ring else places[1:]
    return np.concatenate([np.stack([places[: len(middles)], middles], axis=1), np.stack([middles, behind], axis=1)])


def has_polarity(run: Run) -> bool:
    """Whether the last nodes of filaments are marked: where motors walk to them, or filaments grow."""
    polar = any(own.motor for own in run.linker_types) or any(own.monomer_length for own in run.filaments)
    return polar and not all(own.ring for own in run.filaments)


def cut_at_faces(ends: FloatArray, box: FloatArray) -> tuple[FloatArray, IntArray]:
    """Lines (n, 2, 3) cut where they cross faces of a periodic box, and brought into it piece by piece.

    These are the pieces (m, 2, 3) in nm, and the numbers (m,) of the lines that they belong to.
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
        diameters = np.maximum(own, _VISIBLE * extent * own / own.max(initial=0.0))
    else:
        diameters = own if look.diameter == 0.0 else np.full(len(own), look.diameter)
    balls = [max(own.diameter, _VISIBLE_BALL * extent) for own in look.particles_of(run)]
    # Tubes and balls stand out from the points by half their width.
    widest = max([*diameters, *balls], default=0.0)
    points = np.concatenate([points + 0.5 * widest, points - 0.5 * widest])
    axis = _first_director(run, frames) if look.color == "orientation" else None
    scale = _color_scale(run, look, axis, frames)
    fixed = _lines(box_edges(run) + wall_lines(run, points), _LINE_WIDTH * extent)
    return Scene(run, look, points, diameters, balls, legend_of(run, look), scale, axis, fixed)


def legend_of(run: Run, look: Look) -> list[tuple[str, str, str]]:
    """Labels, colors "#RRGGBB" and kinds of what the legend of a picture has; see ``Scene``."""
    colors = filament_colors(run)
    legend = [(name, color, "filament") for name, color in colors.items()] if look.color == "type" else []
    if has_polarity(run):
        legend.append((PLUS_END, PLUS_END_COLOR, "particle"))
    shown = {own.name for own in look.particles_of(run)}
    legend += [(name, color, "particle") for name, color in particle_colors(run).items() if name in shown]
    if look.linkers:
        colors_of_linkers = linker_colors(run, look.color != "type")
        legend += [(name, color, "linker") for name, color in zip(run.spring_names, colors_of_linkers)]
    return legend


def _framed_points(run, look, frames):
    if run.box is not None and not look.whole:
        corners = np.array(np.meshgrid(*[[0.0, 1.0]] * 3)).reshape(3, 8).T
        return corners @ run.box
    sampled = {frames[round(place)] for place in np.linspace(0, len(frames) - 1, min(len(frames), 20))}
    points = np.concatenate(
        [
            np.zeros((0, 3)),
            *(own for frame in sampled for own in run.curves(frame)),
            *(run.positions(frame)[own.indices] for frame in sampled for own in look.particles_of(run)),
        ]
    )
    if not len(points):
        points = run.positions(frames[0])
    return np.concatenate([points, *wall_lines(run, points)])


def _rgb(color):
    return np.array(matplotlib.colors.to_rgb(color))


def _first_director(run, frames):
    # Of the first frame with a filament; any where there is none.
    vectors = (np.concatenate([np.zeros((0, 3)), *_segments(run, frame)]) for frame in frames)
    return next((director(own) for own in vectors if len(own)), np.array([1.0, 0.0, 0.0]))


def _segments(run, frame):
    return [segment_vectors(points, own.ring) for own, points in zip(run.filaments, run.curves(frame))]


def _values(run: Run, look: Look, axis: FloatArray | None, frame: int) -> list[FloatArray]:
    # Of each piece of each filament that is drawn.
    if look.color == "orientation":
        units = [own / np.linalg.norm(own, axis=1, keepdims=True) for own in _segments(run, frame)]
        return [np.degrees(np.arccos(np.clip(np.abs(own @ axis), 0.0, 1.0))) for own in units]
    if look.color == "tension":
        values = [tensions / PICONEWTON for tensions in run.segment_tensions(frame, look.average)]
    else:
        values = [np.degrees(bends) for bends in run.bends(frame)]
    return [np.repeat(own, filament.pieces) for own, filament in zip(values, run.filaments)]


def _color_scale(run, look, axis, frames):
    if look.color == "type":
        return None
    if look.color == "orientation":
        return ColorScale("angle to the director (°)", "viridis", 0.0, 90.0)
    sampled = {frames[round(place)] for place in np.linspace(0, len(frames) - 1, min(len(frames), 8))}
    values = np.concatenate([np.zeros(0), *(own for frame in sampled for own in _values(run, look, axis, frame))])
    values = values if len(values) else np.zeros(1)
    if look.color == "bending":
        return ColorScale("angle between segments (°)", "viridis", 0.0, float(np.quantile(values, 0.98)) or 1.0)
    largest = float(np.quantile(np.abs(values), 0.98)) or 1.0
    return ColorScale("tension (pN)", "coolwarm", -largest, largest)


def _lines(outlines, radius):
    lines = [np.stack([outline[:-1], outline[1:]], axis=1) for outline in outlines]
    return [Tubes.of_one_kind(np.concatenate(lines), radius, _LINE_COLOR, shaded=False)] if lines else []
