"""Spaces of Cytosim: what is inside, their volumes, and the walls, boxes and regions that they are here; in um.

``SHAPES`` has one function for each shape, which makes a ``Space`` of the settings with which one is created.
"""

import math
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from ..couplings.shapes import prism_faces
from ..errors import InputError
from .document import point, quantity
from .settings import as_vector

_NAMES = {
    "circle": "sphere",
    "rectangle": "square",
    "cube": "square",
    "spherocylinder": "capsule",
    "semi_periodic": "strip",
}
_FLAT = 1.0
"""Half the thickness in um of walls and regions around a plane, in which nothing is at another height."""
_THIN = 1e-4
"""Half of a width in um that is zero in Cytosim: of planes, lines and points."""
_DRAWS = 100_000


@dataclass
class Space:
    """A space: ``inside(points)`` says which of (n, 3) points are in it, ``half`` are the halves of its box.

    ``walls`` are tables of [[wall]] without stiffness, None if none of ours is that shape; ``region`` is where things
    begin, None if there is none; ``edges`` are those of a periodic box, of which None does not repeat. It is ``thin``
    if it is a plane, a line or a point, all of which is its surface.
    """

    shape: str
    half: np.ndarray
    inside: object
    volume: float | None = None
    surface: float | None = None
    walls: list | None = None
    region: dict | None = None
    edges: tuple | None = None
    middle: np.ndarray = field(default_factory=lambda: np.zeros(3))
    thin: bool = False

    def draw(self, generator):
        """A random point in it, or None if none is found."""
        for _ in range(_DRAWS):
            place = self.middle + generator.uniform(-1.0, 1.0, 3) * self.half
            if self.inside(place[None])[0]:
                return place
        return None


def make_space(shape, settings, dimensions, folder="."):
    """A Space of a shape with settings; None if the shape is not known here, or has no size.

    Parameters
    ----------
    shape : str
    settings : list of Settings
        That of ``new`` and that of ``set``, of which the first one that has a key counts.
    dimensions : {2, 3}
    folder : str or Path
        Where files of corners are.
    """
    shape = _NAMES.get(shape, shape)
    if dimensions == 2:
        shape = {"cylinder": "square", "cylinderP": "strip"}.get(shape, shape)
    if shape not in SHAPES:
        return None
    sizes = _Sizes(settings, Path(folder))
    space = SHAPES[shape](sizes, dimensions)
    if space is not None:
        space.thin = sizes.thin
    return space


class _Sizes:
    def __init__(self, settings, folder):
        self._settings, self._folder, self.thin = settings, folder, False

    def number(self, *places, default=None):
        for settings in self._settings:
            value = settings.number(*places)
            if value is not None:
                return value
        return default

    def radius(self):
        diameter = self.number("diameter", "width")
        return self.wide(self.number("radius") if diameter is None else 0.5 * diameter)

    def halves(self, count):
        lengths = [self.number(("length", axis)) for axis in range(count)]
        return None if None in lengths else [self.wide(0.5 * length) for length in lengths]

    def wide(self, half):
        """Half of a width, which is not zero."""
        if half != 0.0:
            return half
        self.thin = True
        return _THIN

    @property
    def corners(self):
        """Those of a polygon, as (n, 2), or None."""
        for settings in self._settings:
            scale = settings.number("scale", default=1.0)
            if "points" in settings:
                found = [settings.vector("points", own)[:2] for own in range(len(settings.values("points")))]
                return scale * np.array(found)
            order = settings.number("order")
            if order is not None and 3 <= order < 1000:
                angles = settings.number("angle", default=0.0) + 2.0 * np.pi * np.arange(int(order)) / int(order)
                radius = settings.number("radius", default=1.0)
                return scale * radius * np.stack([np.cos(angles), np.sin(angles)], axis=1)
            path = self._folder / (settings.text("file") or "")
            if path.is_file():
                rows = [line.split("%")[0].split() for line in path.read_text(errors="replace").splitlines()]
                return scale * np.array(
                    [as_vector(" ".join(row[:2]), settings.line, path.name)[:2] for row in rows if row]
                )
        return None

    def ends(self, index=0):
        length = self.number(("length", index))
        if length is not None:
            bottom, top = -0.5 * length, 0.5 * length
        else:
            bottom, top = self.number("bottom"), self.number("top")
        if bottom is None or bottom != top:
            return bottom, top
        return bottom - self.wide(0.0), top + self.wide(0.0)


def _flat(half, dimensions):
    return np.array([*half[:2], 0.0] if dimensions == 2 else half[:3], dtype=float)


def _box(half):
    half = [own or _FLAT for own in half]
    return {"shape": "box", "lower": point([-own for own in half]), "upper": point(half)}


def _sphere(sizes, dimensions):
    radius = sizes.radius()
    if not radius:
        return None
    volume = math.pi * radius**2 if dimensions == 2 else 4.0 / 3.0 * math.pi * radius**3
    wall = {"shape": "sphere", "radius": quantity(radius, "um")}
    surface = 2.0 * math.pi * radius if dimensions == 2 else 4.0 * math.pi * radius**2
    region = disc_region(radius) if dimensions == 2 else wall
    half = _flat([radius] * 3, dimensions)
    return Space("sphere", half, lambda at: np.sum(at**2, -1) <= radius**2, volume, surface, [wall], region)


def disc_region(radius, thickness=2 * _FLAT, center=(0.0, 0.0, 0.0), axis=(0, 0, 1)):
    """A region within a circle, as a flat cylinder."""
    at = {} if not any(center) else {"point": point(center)}
    sizes = {"radius": quantity(radius, "um"), "length": quantity(thickness, "um")}
    return {"shape": "cylinder", **at, "axis": list(axis), **sizes}


def _square(sizes, dimensions):
    half = sizes.halves(1)
    others = [sizes.number(("length", axis)) for axis in range(1, dimensions)]
    others = [sizes.radius() if own is None else sizes.wide(0.5 * own) for own in others]
    if half is None or None in others or min(half + others) <= 0.0:
        return None
    half = _flat([*half, *others], dimensions)
    sides = half[:dimensions]
    surface = None if dimensions == 2 else 8.0 * (half[0] * half[1] + half[1] * half[2] + half[0] * half[2])
    # Spheres of bodies fit between walls above and below a plane.
    wall = _box([own or 2.0 * max(half) for own in half])
    volume = float(np.prod(2 * sides))
    return Space("square", half, lambda at: np.all(np.abs(at) <= half, -1), volume, surface, [wall], _box(half))


def _capsule(sizes, dimensions):
    radius, length = sizes.radius(), sizes.number("length")
    if not radius or length is None or length < 2 * radius:
        return None
    if length == 2 * radius:
        return _sphere(sizes, dimensions)
    half = 0.5 * length - radius
    if dimensions == 2:
        volume = 4 * half * radius + math.pi * radius**2
    else:
        volume = 2 * math.pi * half * radius**2 + 4 / 3 * math.pi * radius**3
    wall = {"shape": "capsule", "length": quantity(2 * half, "um"), "radius": quantity(radius, "um")}
    # Planar filaments begin where their plane cuts it, which is drawn point by point.
    region = None if dimensions == 2 else wall
    sizes_of_box = _flat([half + radius, radius, radius], dimensions)
    return Space("capsule", sizes_of_box, _along(half, radius), volume, None, [wall], region)


def _along(half, radius):
    def inside(at):
        beyond = np.maximum(np.abs(at[..., 0]) - half, 0.0)
        return beyond**2 + at[..., 1] ** 2 + at[..., 2] ** 2 <= radius**2

    return inside


def _ellipse(sizes, dimensions):
    axes = []
    for axis in range(dimensions):
        width = sizes.number(("diameter", axis), ("length", axis))
        axes.append(sizes.number(("radius", axis)) if width is None else 0.5 * width)
    if None in axes or min(axes) <= 0.0:
        return None
    half = _flat([*axes, 0.0], dimensions)
    whole = np.where(half > 0.0, half, max(axes))
    shape = {"shape": "ellipsoid", "semi_axes": point(whole)}
    volume = math.pi * math.prod(axes) * (1.0 if dimensions == 2 else 4.0 / 3.0)
    # Planar filaments begin where their plane cuts it: as an ellipse that is drawn point by point.
    region = None if dimensions == 2 else shape
    return Space("ellipse", half, lambda at: np.sum((at / whole) ** 2, -1) <= 1.0, volume, None, [shape], region)


def _cylinder(sizes, dimensions, axis=0):
    radius = sizes.radius()
    bottom, top = sizes.ends()
    if not radius or bottom is None or top is None or not bottom < top or dimensions == 2:
        return None
    half, middle, along = 0.5 * (top - bottom), np.zeros(3), np.eye(3)[axis]
    middle[axis] = 0.5 * (top + bottom)
    across = [own for own in range(3) if own != axis]

    def inside(at):
        return (np.sum(at[..., across] ** 2, -1) <= radius**2) & (np.abs(at[..., axis] - middle[axis]) <= half)

    center = point(middle)
    direction = along.astype(int).tolist()
    walls = [
        {"shape": "cylinder", "point": center, "axis": direction, "radius": quantity(radius, "um")},
        {"shape": "slit", "point": center, "normal": direction, "thickness": quantity(2 * half, "um")},
    ]
    region = disc_region(radius, 2 * half, middle, direction)
    surface = 2 * math.pi * radius * (2 * half + radius)
    sizes_of_box = along * half + (1.0 - along) * radius
    volume = 2 * math.pi * radius**2 * half
    return Space("cylinder", sizes_of_box, inside, volume, surface, walls, region, middle=middle)


def _bicylinder(sizes, dimensions):
    # Where two cylinders along x and y cross.
    radius = sizes.radius()
    if not radius or dimensions == 2:
        return None

    def inside(at):
        return np.maximum(at[..., 0] ** 2, at[..., 1] ** 2) + at[..., 2] ** 2 <= radius**2

    size = quantity(radius, "um")
    walls = [{"shape": "cylinder", "axis": axis, "radius": size} for axis in ([1, 0, 0], [0, 1, 0])]
    return Space("bicylinder", np.full(3, radius), inside, 16.0 / 3.0 * radius**3, 16.0 * radius**2, walls)


def _cylinder_periodic(sizes, dimensions):
    space = _cylinder(sizes, dimensions)
    if space is None:
        return None
    space.walls, space.edges = space.walls[:1], (2 * space.half[0], None, None)
    return space


def _periodic(sizes, dimensions):
    half = sizes.halves(dimensions)
    if half is None or min(half) <= 0.0:
        return None
    half = _flat([*half, 0.0], dimensions)
    edges = tuple(2 * own or None for own in half)
    volume = float(np.prod(2 * half[:dimensions]))
    return Space("periodic", half, lambda at: np.ones(at.shape[:-1], bool), volume, None, [], None, edges)


def _strip(sizes, dimensions):
    half = sizes.halves(dimensions - 1)
    bottom, top = sizes.ends(dimensions - 1)
    if top is None and dimensions == 2 and sizes.radius():
        bottom, top = -sizes.radius(), sizes.radius()
    if half is None or bottom is None or top is None or not bottom < top or min(half) <= 0.0:
        return None
    last, middle = dimensions - 1, np.zeros(3)
    middle[last] = 0.5 * (top + bottom)
    half = _flat([*half, 0.5 * (top - bottom), 0.0], dimensions)
    normal = np.eye(3, dtype=int)[last].tolist()
    slit = {"shape": "slit", "point": point(middle), "normal": normal, "thickness": quantity(top - bottom, "um")}
    edges = tuple(2 * own if axis < last else None for axis, own in enumerate(half))
    limits = [own or _FLAT for own in half]
    region = {"shape": "box", "lower": point(middle - limits), "upper": point(middle + limits)}

    def inside(at):
        return np.abs(at[..., last] - middle[last]) <= half[last]

    volume = float(np.prod(2 * half[:dimensions]))
    return Space("strip", half, inside, volume, None, [slit], region, edges, middle)


def _annular(sizes, dimensions):
    radius, width = sizes.radius(), sizes.number("width")
    inner, outer = sizes.number("inner", "radius_inner"), sizes.number("outer", "radius_outer")
    if inner is None and radius is not None and width is not None:
        inner, outer = radius - 0.5 * width, radius + 0.5 * width
    bottom, top = sizes.number("bottom", default=0.0), sizes.number("top", default=0.0)
    if inner is None or outer is None or not 0.0 <= inner < outer:
        return None
    height = top - bottom if dimensions == 3 else 0.0
    middle = np.array([0.0, 0.0, 0.5 * (top + bottom) if dimensions == 3 else 0.0])

    def inside(at):
        radial = np.hypot(at[..., 0], at[..., 1])
        return (inner <= radial) & (radial <= outer) & (np.abs(at[..., 2] - middle[2]) <= 0.5 * height)

    volume = math.pi * (outer**2 - inner**2) * (height if dimensions == 3 else 1.0)
    return Space("annulus", np.array([outer, outer, 0.5 * height]), inside, volume, middle=middle)


def _torus(sizes, dimensions):
    width, ring = sizes.number("width"), sizes.number("curvature")
    radius = sizes.number("radius") if width is None else 0.5 * width
    if not radius or not ring:
        return None

    def inside(at):
        return (np.hypot(at[..., 0], at[..., 1]) - ring) ** 2 + at[..., 2] ** 2 <= radius**2

    volume = 4 * math.pi * ring * radius if dimensions == 2 else 2 * math.pi**2 * ring * radius**2
    sizes_of_box = _flat([ring + radius, ring + radius, radius], dimensions)
    if radius >= ring:
        return Space("torus", sizes_of_box, inside, volume)
    shape = {"shape": "torus", "axis": [0, 0, 1]}
    shape |= {"major_radius": quantity(ring, "um"), "minor_radius": quantity(radius, "um")}
    # Planar filaments begin where their plane cuts it, which is drawn point by point.
    region = None if dimensions == 2 else shape
    return Space("torus", sizes_of_box, inside, volume, None, [shape], region)


def _polygon(sizes, dimensions):
    corners = sizes.corners
    if corners is None or len(corners) < 3:
        return None
    height = sizes.number("height", default=0.0) if dimensions == 3 else 0.0
    low, high = corners.min(axis=0), corners.max(axis=0)
    first, last = corners, np.roll(corners, -1, axis=0)

    def inside(at):
        # By how many sides a ray along x goes through.
        x, y = at[..., None, 0], at[..., None, 1]
        crosses = (first[:, 1] > y) != (last[:, 1] > y)
        with np.errstate(divide="ignore", invalid="ignore"):
            where = first[:, 0] + (y - first[:, 1]) / (last[:, 1] - first[:, 1]) * (last[:, 0] - first[:, 0])
        within = np.sum(crosses & (x < where), -1) % 2 == 1
        return within & (np.abs(at[..., 2]) <= 0.5 * height)

    area = abs(0.5 * float(np.sum(first[:, 0] * last[:, 1] - last[:, 0] * first[:, 1])))
    half, middle = np.array([*(0.5 * (high - low)), 0.5 * height]), np.array([*(0.5 * (high + low)), 0.0])
    volume = area if dimensions == 2 else area * height
    return Space("polygon", half, inside, volume, None, _prism(corners, height), middle=middle)


def _prism(corners, height):
    # None unless it is convex.
    try:
        prism_faces(corners)
    except InputError:
        return None
    wall = {"shape": "prism", "corners": [point(corner) for corner in corners]}
    if height:
        wall |= {"bottom": quantity(-0.5 * height, "um"), "top": quantity(0.5 * height, "um")}
    return [wall]


def _dice(sizes, dimensions):
    half, edge = sizes.halves(dimensions), sizes.number("edge", "radius", default=0.0)
    if half is None or min(half) <= edge:
        return None
    half = _flat([*half, 0.0], dimensions)
    core = np.maximum(half - edge, 0.0)

    def inside(at):
        return np.sum(np.maximum(np.abs(at) - core, 0.0) ** 2, -1) <= edge**2

    generator = np.random.default_rng(1)
    share = float(np.mean(inside(generator.uniform(-1.0, 1.0, (_DRAWS, 3)) * half)))
    return Space("dice", half, inside, share * float(np.prod(2 * half[:dimensions])))


SHAPES = {
    "sphere": _sphere,
    "square": _square,
    "capsule": _capsule,
    "ellipse": _ellipse,
    "cylinder": _cylinder,
    "cylinderZ": lambda sizes, dimensions: _cylinder(sizes, dimensions, 2),
    "disc": lambda sizes, dimensions: _sphere(sizes, 2) if dimensions == 2 else _cylinder(sizes, dimensions, 2),
    "cylinderP": _cylinder_periodic,
    "bicylinder": _bicylinder,
    "periodic": _periodic,
    "strip": _strip,
    "annulus": _annular,
    "torus": _torus,
    "polygon": _polygon,
    "dice": _dice,
}
"""What makes a Space, by the names of shapes that are read here."""
