"""Shapes in a configuration: of walls, and of regions in which filaments and particles begin."""

import numpy as np

from ...couplings.shapes import (
    Box,
    Capsule,
    ClosedShape,
    Cylinder,
    Ellipsoid,
    Plane,
    Slab,
    Sphere,
    Torus,
    bounds_of,
    prism_faces,
    volume_of,
)
from ...units import quantities as units
from ..keys import REQUIRED, Choice, Key, Listing, Quantity, direction, point
from ..table import TableKind

_SHAPES = {
    "plane": (Plane, ("point", "normal")),
    "slit": (Slab, ("point", "normal", "thickness")),
    "sphere": (Sphere, ("center", "radius")),
    "cylinder": (Cylinder, ("point", "axis", "radius")),
    "capsule": (Capsule, ("center", "axis", "length", "radius")),
    "torus": (Torus, ("center", "axis", "major_radius", "minor_radius")),
    "box": (Box, ("lower", "upper")),
    "ellipsoid": (Ellipsoid, ("center", "semi_axes")),
}
_PRISM = "prism"
_OF_PRISM = ("corners", "bottom", "top")
_BOUNDED = ("sphere", "cylinder", "capsule", "torus", "box", "ellipsoid")
_ORIGIN = (0.0, 0.0, 0.0)

_KEYS = (
    Key(
        "point",
        point(),
        _ORIGIN,
        "A point on a plane, half-way between the planes of a slit, or on the axis of a cylinder.",
    ),
    Key("normal", direction(), (0.0, 0.0, 1.0), "Normal of a plane, to the side of the filaments, or of a slit."),
    Key("thickness", Quantity(units.LENGTH), None, "Distance of the planes of a slit."),
    Key("center", point(), _ORIGIN, "Centre of a sphere, a capsule, a torus or an ellipsoid."),
    Key("radius", Quantity(units.LENGTH), None, "Radius of a sphere, a cylinder or a capsule."),
    Key("axis", direction(), (1.0, 0.0, 0.0), "Direction of the axis of a cylinder, a capsule or a torus."),
    Key("length", Quantity(units.LENGTH), None, "Length of a capsule without its caps, which are half spheres."),
    Key("major_radius", Quantity(units.LENGTH), None, "Of the circle in the middle of the tube of a torus."),
    Key("minor_radius", Quantity(units.LENGTH), None, "Of that tube."),
    Key("lower", point(), None, "Corner of a box, along the axes of space."),
    Key("upper", point(), None, "The opposite corner."),
    Key("semi_axes", point(), None, "Semi-axes of an ellipsoid along x, y and z."),
)
_KEYS_OF_PRISM = (
    Key(
        "corners",
        Listing(
            Listing(Quantity(units.LENGTH, "any"), "two lengths", '["0 um", "0 um"]', 2),
            "corners",
            '[["0 um", "0 um"], ["2 um", "0 um"], ["0 um", "2 um"]]',
            3,
        ),
        None,
        "x and y of the corners of a convex polygon, one after the other: a prism over it has its sides along z.",
    ),
    Key("bottom", Quantity(units.LENGTH, "any"), None, "z of the lower end of a prism; without ends if not given."),
    Key("top", Quantity(units.LENGTH, "any"), None, "z of its upper end."),
)
SHAPE_KEYS = (
    Key("shape", Choice((*_SHAPES, _PRISM)), REQUIRED, "What filaments are kept in."),
    *_KEYS,
    *_KEYS_OF_PRISM,
)
"""Of walls."""

REGION = TableKind(
    "inside",
    (
        Key("shape", Choice(_BOUNDED), REQUIRED, "Shape of the region."),
        *(key for key in _KEYS if key.name not in ("normal", "thickness", "length")),
        Key(
            "length",
            Quantity(units.LENGTH),
            None,
            "Length of a cylinder, half of it on either side of its point, or of a capsule without its caps, which are "
            "half spheres.",
        ),
    ),
    "A region in which filaments or particles begin, or linkers diffuse.",
)
REGION_EXAMPLE = '{ shape = "sphere", radius = "1 um" }'


def read_walls_of(entries):
    """The Shapes of a table with SHAPE_KEYS: one, or the faces of a prism."""
    if entries["shape"] != _PRISM:
        entries.refuse(_OF_PRISM, "belongs to a prism.")
        return (read_shape(entries),)
    entries.refuse(sorted(key.name for key in _KEYS), f"is none of a prism: that has {', '.join(_OF_PRISM)}.")
    entries.require("corners")
    for place, corner in enumerate(entries["corners"]):
        if len(corner) != 2:
            raise entries.at("corners").item(place).error("must be x and y of a corner.")
    with entries.naming():
        return prism_faces(entries["corners"], entries["bottom"], entries["top"])


def read_shape(entries, others=()):
    """The Shape of a table with SHAPE_KEYS; those that its shape does not have are refused, but for others."""
    kind, names = _SHAPES[entries["shape"]]
    every = {key.name for key in _KEYS}
    entries.refuse(
        sorted(every - set(names) - set(others)), f"is none of a {entries['shape']}: that has {', '.join(names)}."
    )
    entries.require(*(name for name in names if entries[name] is None))
    with entries.naming():
        return kind(*(np.array(entries[name]) if isinstance(entries[name], tuple) else entries[name] for name in names))


class Region:
    """A bounded region, of Entries of REGION: positions are drawn in it, and asked whether they are in it."""

    def __init__(self, entries):
        of_region = ("length",) if entries["shape"] == "cylinder" else ()
        self._shape = read_shape(entries, of_region)
        entries.require(*(name for name in of_region if entries[name] is None))
        self._length = entries["length"]
        self._values = entries.values
        self._lower, self._upper = self._bounds()

    def __eq__(self, other):
        return isinstance(other, Region) and self._values == other._values

    __hash__ = None

    @property
    def shape(self):
        """The Shape that it is within."""
        return self._shape

    @property
    def walls(self):
        """Tuple of the Shapes that it is within: a cylinder has a Slab across it."""
        if not isinstance(self._shape, Cylinder):
            return (self._shape,)
        return (self._shape, Slab(self._shape.point, self._shape.axis, self._length))

    @property
    def volume(self):
        """In nm^3."""
        if isinstance(self._shape, Cylinder):
            return np.pi * self._shape.radius**2 * self._length
        return volume_of(self._shape)

    @property
    def diameter(self):
        """Of the box around it in nm: no two points of it are further apart."""
        return float(np.linalg.norm(self._upper - self._lower))

    @property
    def center(self):
        """Of the box around it: (3,) in nm."""
        return 0.5 * (self._lower + self._upper)

    def _bounds(self):
        shape = self._shape
        if isinstance(shape, Cylinder):
            reach = 0.5 * self._length * np.abs(shape.axis) + shape.radius * np.sqrt(1.0 - shape.axis**2)
            return shape.point - reach, shape.point + reach
        return bounds_of(shape)

    def draw(self, generator):
        """A random point in it: a (3,) array in nm."""
        # A long cylinder or capsule that is tilted, or a thin torus, fills next to nothing of the box around it.
        shape = self._shape
        if isinstance(shape, Cylinder):
            return shape.point + _draw_in_cylinder(shape, self._length, generator)
        if isinstance(shape, Capsule):
            if generator.uniform() * (shape.length + 4.0 / 3.0 * shape.radius) < shape.length:
                return shape.center + _draw_in_cylinder(shape, shape.length, generator)
            direction = generator.normal(size=3)
            direction *= shape.radius * np.cbrt(generator.uniform()) / np.linalg.norm(direction)
            return shape.center + direction + np.copysign(0.5 * shape.length, direction @ shape.axis) * shape.axis
        if isinstance(shape, Torus):
            return shape.center + _draw_in_torus(shape, generator)
        while True:
            point = generator.uniform(self._lower, self._upper)
            if self.contains(point):
                return point

    def contains(self, positions):
        """Whether all positions (..., 3) in nm are in it."""
        inside = self._shape.square_depth(positions) == 0.0
        if isinstance(self._shape, Cylinder):
            inside &= np.abs((np.asarray(positions) - self._shape.point) @ self._shape.axis) <= 0.5 * self._length
        return bool(np.all(inside))


def _draw_in_cylinder(shape, length, generator):
    # From the middle of one around the axis of the shape, with its radius.
    _, side, other = np.linalg.svd(shape.axis[None])[2]
    radius, angle = shape.radius * np.sqrt(generator.uniform()), generator.uniform(0.0, 2.0 * np.pi)
    along = length * generator.uniform(-0.5, 0.5)
    return along * shape.axis + radius * (np.cos(angle) * side + np.sin(angle) * other)


def _draw_in_torus(shape, generator):
    # From the center. Its volume grows with the distance from the axis.
    _, side, other = np.linalg.svd(shape.axis[None])[2]
    while True:
        out, along = shape.minor_radius * generator.uniform(-1.0, 1.0, 2)
        distance = shape.major_radius + out
        share = generator.uniform() * (shape.major_radius + shape.minor_radius)
        if out**2 + along**2 <= shape.minor_radius**2 and share < distance:
            break
    angle = generator.uniform(0.0, 2.0 * np.pi)
    return distance * (np.cos(angle) * side + np.sin(angle) * other) + along * shape.axis


def volume_within(shapes, box):
    """The volume in nm^3 that walls of such shapes and a periodic box with three edges leave; None if nobody knows.

    Of one wall that is closed, and of a slit or cylinder across the box; of several walls it is not known.
    """
    if not shapes:
        return None if box is None else float(np.prod(box))
    if len(shapes) > 1:
        return None
    (shape,) = shapes
    if isinstance(shape, ClosedShape):
        fits = box is None or np.all(np.subtract(*bounds_of(shape)[::-1]) <= box)
        return volume_of(shape) if fits else None
    if box is None or isinstance(shape, Plane):
        return None
    along = np.abs(shape.normal if isinstance(shape, Slab) else shape.axis)
    axis = int(np.argmax(along))
    if along[axis] < 1.0 - 1e-12:
        return None
    across = np.delete(box, axis)
    if isinstance(shape, Slab):
        return float(np.prod(across)) * shape.thickness if shape.thickness <= box[axis] else None
    return np.pi * shape.radius**2 * box[axis] if 2.0 * shape.radius <= across.min() else None
