"""Shapes that walls have: planes, slabs, spheres, cylinders, capsules, tori, boxes and ellipsoids."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from ..errors import InputError
from ..mechanics.geometry import directions_across
from ..units.quantities import LENGTH, finite_number, in_units_of, positive, unit_vector, vector
from ..units.types import FloatArray, FloatOrArray, Scalar, Vector, Vectors

# In nm^2: keeps the derivative of a square root finite at its zero, in single precision as well.
_TINY = "1e-30"
# Angle by which sides of a polygon turn that are in a line.
_IN_LINE = 1e-9


Region = tuple[str, FloatArray, FloatArray, float]


class Shape(ABC):
    """A region that particles are kept in.

    ``expression`` is the square of the depth d beyond the wall in OpenMM's syntax, a function of x, y and z in nm.
    ``region`` is what a CylinderChainWallForce knows it by, and ``room`` the largest radius, exclusive, of a particle
    that fits in.
    """

    @property
    @abstractmethod
    def expression(self) -> str:
        """The square of the depth for OpenMM."""

    @property
    @abstractmethod
    def region(self) -> Region:
        """Name, point, vector and length for the compiled engine."""

    @property
    @abstractmethod
    def room(self) -> float:
        """In nm."""

    def square_depth(self, positions: Vectors) -> FloatOrArray:
        """The square of the depth, in nm^2, for positions (..., 3); zero inside.

        InputError for positions that are none.
        """
        return self._square_depth(_as_points(positions))

    @abstractmethod
    def _square_depth(self, positions: FloatArray) -> FloatOrArray:
        """The same, for an array in nm."""

    @property
    @abstractmethod
    def faces(self) -> tuple[Face, ...]:
        """What the wall is made of: planes of a slab or box, in the order of the compiled engine, or itself."""


class Face(Shape):
    """A region with one face."""

    @property
    def faces(self) -> tuple[Face, ...]:
        return (self,)

    def depths(self, positions: Vectors) -> tuple[FloatArray, FloatArray]:
        """Depths beyond the face in nm, negative inside, and their gradients, for positions (..., 3).

        InputError for positions that are none.
        """
        return self._depths(_as_points(positions))

    @abstractmethod
    def _depths(self, positions: FloatArray) -> tuple[FloatArray, FloatArray]:
        """The same, for an array in nm."""

    def _square_depth(self, positions: FloatArray) -> FloatOrArray:
        depths, _ = self._depths(positions)
        return np.maximum(0.0, depths) ** 2


def _as_points(positions):
    points = np.asarray(in_units_of(positions, LENGTH, "positions"))
    if not points.ndim or points.shape[-1] != 3:
        raise InputError(f"positions must have the shape (..., 3), but have the shape {points.shape}.")
    return points


def _radial(vectors, radius):
    # Depths and gradients of what is so far from a centre or an axis; in the middle, there is no gradient.
    distances = np.linalg.norm(vectors, axis=-1)
    scale = np.divide(1.0, distances, out=np.zeros_like(distances), where=distances > 0.0)
    return distances - radius, vectors * scale[..., None]


def number(value: float) -> str:
    """A number as it stands in formulas."""
    return f"({float(value)!r})"


def _along(point, direction):
    terms = (f"{number(n)}*({name}-{number(p)})" for name, n, p in zip("xyz", direction, point))
    return f"({'+'.join(terms)})"


def _beyond(expression):
    return f"max(0, {expression})^2"


@dataclass(frozen=True)
class Plane(Face):
    """The half space to which a normal points.

    Parameters
    ----------
    point : (3,) length
        On the plane.
    normal : (3,) array
        Need not be normalised.
    """

    point: FloatArray
    normal: FloatArray

    if TYPE_CHECKING:

        def __init__(self, point: Vector, normal: Vector) -> None: ...

    def __post_init__(self) -> None:
        _set(self, "point", vector(self.point, LENGTH, "Plane: point"))
        _set(self, "normal", unit_vector(self.normal, "Plane"))

    @property
    def expression(self) -> str:
        return _beyond(f"-{_along(self.point, self.normal)}")

    @property
    def region(self) -> Region:
        return ("plane", self.point, self.normal, 0.0)

    @property
    def room(self) -> float:
        return math.inf

    def _depths(self, positions: FloatArray) -> tuple[FloatArray, FloatArray]:
        depths = -((positions - self.point) @ self.normal)
        return depths, np.broadcast_to(-self.normal, positions.shape)


@dataclass(frozen=True)
class Slab(Shape):
    """The space between two parallel planes.

    Parameters
    ----------
    point : (3,) length
        Half-way between the planes.
    normal : (3,) array
    thickness : length
    """

    point: FloatArray
    normal: FloatArray
    thickness: float

    if TYPE_CHECKING:

        def __init__(self, point: Vector, normal: Vector, thickness: Scalar) -> None: ...

    def __post_init__(self) -> None:
        _set(self, "point", vector(self.point, LENGTH, "Slab: point"))
        _set(self, "normal", unit_vector(self.normal, "Slab"))
        _set(self, "thickness", positive(self.thickness, LENGTH, "Slab: thickness"))

    @property
    def expression(self) -> str:
        return _beyond(f"abs({_along(self.point, self.normal)})-{number(0.5 * self.thickness)}")

    @property
    def region(self) -> Region:
        return ("slab", self.point, self.normal, self.thickness)

    @property
    def room(self) -> float:
        return 0.5 * self.thickness

    def _square_depth(self, positions: FloatArray) -> FloatOrArray:
        height = np.abs((positions - self.point) @ self.normal)
        return np.maximum(0.0, height - 0.5 * self.thickness) ** 2

    @property
    def faces(self) -> tuple[Face, ...]:
        half = 0.5 * self.thickness * self.normal
        return Plane(self.point + half, -self.normal), Plane(self.point - half, self.normal)


@dataclass(frozen=True)
class Sphere(Face):
    """The inside of a sphere.

    Parameters
    ----------
    center : (3,) length
    radius : length
    """

    center: FloatArray
    radius: float

    if TYPE_CHECKING:

        def __init__(self, center: Vector, radius: Scalar) -> None: ...

    def __post_init__(self) -> None:
        _set(self, "center", vector(self.center, LENGTH, "Sphere: center"))
        _set(self, "radius", positive(self.radius, LENGTH, "Sphere: radius"))

    @property
    def expression(self) -> str:
        squares = "+".join(f"({name}-{number(c)})^2" for name, c in zip("xyz", self.center))
        return _beyond(f"sqrt({squares}+{_TINY})-{number(self.radius)}")

    @property
    def region(self) -> Region:
        return ("sphere", self.center, np.zeros(3), self.radius)

    @property
    def room(self) -> float:
        return self.radius

    def _depths(self, positions: FloatArray) -> tuple[FloatArray, FloatArray]:
        return _radial(positions - self.center, self.radius)


@dataclass(frozen=True)
class Cylinder(Face):
    """The inside of a cylinder without ends.

    Parameters
    ----------
    point : (3,) length
        On the axis.
    axis : (3,) array
    radius : length
    """

    point: FloatArray
    axis: FloatArray
    radius: float

    if TYPE_CHECKING:

        def __init__(self, point: Vector, axis: Vector, radius: Scalar) -> None: ...

    def __post_init__(self) -> None:
        _set(self, "point", vector(self.point, LENGTH, "Cylinder: point"))
        _set(self, "axis", unit_vector(self.axis, "Cylinder"))
        _set(self, "radius", positive(self.radius, LENGTH, "Cylinder: radius"))

    @property
    def expression(self) -> str:
        first, second = (_along(self.point, direction) for direction in directions_across(self.axis))
        return _beyond(f"sqrt({first}^2+{second}^2+{_TINY})-{number(self.radius)}")

    @property
    def region(self) -> Region:
        return ("cylinder", self.point, self.axis, self.radius)

    @property
    def room(self) -> float:
        return self.radius

    def _depths(self, positions: FloatArray) -> tuple[FloatArray, FloatArray]:
        relative = positions - self.point
        return _radial(relative - (relative @ self.axis)[..., None] * self.axis, self.radius)


@dataclass(frozen=True)
class Capsule(Face):
    """The inside of a capsule: a cylinder with a half sphere on each end.

    Parameters
    ----------
    center : (3,) length
        Its middle.
    axis : (3,) array
    length : length
        Of the cylinder, from the center of one half sphere to that of the other.
    radius : length
    """

    center: FloatArray
    axis: FloatArray
    length: float
    radius: float

    if TYPE_CHECKING:

        def __init__(self, center: Vector, axis: Vector, length: Scalar, radius: Scalar) -> None: ...

    def __post_init__(self) -> None:
        _set(self, "center", vector(self.center, LENGTH, "Capsule: center"))
        _set(self, "axis", unit_vector(self.axis, "Capsule"))
        _set(self, "length", positive(self.length, LENGTH, "Capsule: length"))
        _set(self, "radius", positive(self.radius, LENGTH, "Capsule: radius"))

    @property
    def expression(self) -> str:
        directions = (*directions_across(self.axis), self.axis)
        first, second, along = (_along(self.center, direction) for direction in directions)
        beyond = f"max(0, abs({along})-{number(0.5 * self.length)})"
        return _beyond(f"sqrt({first}^2+{second}^2+{beyond}^2+{_TINY})-{number(self.radius)}")

    @property
    def region(self) -> Region:
        return ("capsule", self.center, 0.5 * self.length * self.axis, self.radius)

    @property
    def room(self) -> float:
        return self.radius

    def _depths(self, positions: FloatArray) -> tuple[FloatArray, FloatArray]:
        relative = positions - self.center
        along = np.clip(relative @ self.axis, -0.5 * self.length, 0.5 * self.length)
        return _radial(relative - along[..., None] * self.axis, self.radius)


@dataclass(frozen=True)
class Torus(Face):
    """The inside of a torus: a tube around a circle.

    With the distances ``rho`` from the axis and ``z`` along it, from the center, its depth is
    ``((rho - R)^2 + z^2)^(1/2) - r``.

    Parameters
    ----------
    center : (3,) length
    axis : (3,) array
        At right angles to the plane of the circle.
    major_radius : length
        R, of the circle in the middle of the tube.
    minor_radius : length
        r, of the tube: smaller than that of the circle.
    """

    center: FloatArray
    axis: FloatArray
    major_radius: float
    minor_radius: float

    if TYPE_CHECKING:

        def __init__(self, center: Vector, axis: Vector, major_radius: Scalar, minor_radius: Scalar) -> None: ...

    def __post_init__(self) -> None:
        _set(self, "center", vector(self.center, LENGTH, "Torus: center"))
        _set(self, "axis", unit_vector(self.axis, "Torus"))
        _set(self, "major_radius", positive(self.major_radius, LENGTH, "Torus: major_radius"))
        _set(self, "minor_radius", positive(self.minor_radius, LENGTH, "Torus: minor_radius"))
        if self.minor_radius >= self.major_radius:
            raise InputError(
                f"Torus: minor_radius must be smaller than major_radius, {self.major_radius:g} nm, but is "
                f"{self.minor_radius:g} nm: there is no hole then. Take a Sphere or an Ellipsoid."
            )

    @property
    def expression(self) -> str:
        directions = (*directions_across(self.axis), self.axis)
        first, second, along = (_along(self.center, direction) for direction in directions)
        radial = f"(sqrt({first}^2+{second}^2+{_TINY})-{number(self.major_radius)})"
        return _beyond(f"sqrt({radial}^2+{along}^2+{_TINY})-{number(self.minor_radius)}")

    @property
    def region(self) -> Region:
        return ("torus", self.center, self.major_radius * self.axis, self.minor_radius)

    @property
    def room(self) -> float:
        return self.minor_radius

    def _depths(self, positions: FloatArray) -> tuple[FloatArray, FloatArray]:
        relative = positions - self.center
        across = relative - (relative @ self.axis)[..., None] * self.axis
        distances, outward = _radial(across, 0.0)
        # On the axis, all of the circle is as near.
        outward = np.where(distances[..., None] > 0.0, outward, directions_across(self.axis)[0])
        return _radial(relative - self.major_radius * outward, self.minor_radius)


@dataclass(frozen=True)
class Box(Shape):
    """The inside of a box with edges along the axes; d is the distance from the box.

    Parameters
    ----------
    lower, upper : (3,) length
        Two opposite corners.
    """

    lower: FloatArray
    upper: FloatArray

    if TYPE_CHECKING:

        def __init__(self, lower: Vector, upper: Vector) -> None: ...

    def __post_init__(self) -> None:
        _set(self, "lower", vector(self.lower, LENGTH, "Box: lower"))
        _set(self, "upper", vector(self.upper, LENGTH, "Box: upper"))
        if not np.all(self.lower < self.upper):
            raise InputError(f"Box: upper must exceed lower along every axis, but they are {self.upper}, {self.lower}.")

    @property
    def expression(self) -> str:
        pairs = zip("xyz", self.lower, self.upper)
        return "+".join(f"max(0, max({number(a)}-{name}, {name}-{number(b)}))^2" for name, a, b in pairs)

    @property
    def region(self) -> Region:
        return ("box", self.lower, self.upper, 0.0)

    @property
    def room(self) -> float:
        return 0.5 * float(np.min(self.upper - self.lower))

    def _square_depth(self, positions: FloatArray) -> FloatOrArray:
        beyond = np.maximum(0.0, np.maximum(self.lower - positions, positions - self.upper))
        return np.sum(beyond**2, axis=-1)

    @property
    def faces(self) -> tuple[Face, ...]:
        sides = (self.lower, 1.0), (self.upper, -1.0)
        return tuple(Plane(corner, sign * axis) for axis in np.eye(3) for corner, sign in sides)


@dataclass(frozen=True)
class Ellipsoid(Face):
    """The inside of an ellipsoid with axes along x, y and z.

    With s^2 the sum of (x_i/a_i)^2, the depth is taken as (s-1)/|grad s|, which is the distance from the surface to
    first order. Where its rim is so sharp that a node moves by more than the radius of curvature in a step, steps are
    divided.

    Parameters
    ----------
    center : (3,) length
    semi_axes : (3,) length
    """

    center: FloatArray
    semi_axes: FloatArray

    if TYPE_CHECKING:

        def __init__(self, center: Vector, semi_axes: Vector) -> None: ...

    def __post_init__(self) -> None:
        _set(self, "center", vector(self.center, LENGTH, "Ellipsoid: center"))
        _set(self, "semi_axes", vector(self.semi_axes, LENGTH, "Ellipsoid: semi_axes"))
        if not np.all(self.semi_axes > 0):
            raise InputError(f"Ellipsoid: semi_axes must be positive, but are {self.semi_axes}.")

    @property
    def expression(self) -> str:
        def total(power):
            terms = zip("xyz", self.center, self.semi_axes)
            return "+".join(f"({name}-{number(c)})^2*{number(a**-power)}" for name, c, a in terms)

        floor = number(self._least_steepness)
        return f"max(0, s-1)^2*s^2/max(steepness, {floor}); s=sqrt({total(2.0)}+{_TINY}); steepness={total(4.0)}"

    @property
    def _least_steepness(self):
        # Less than anywhere outside, for a quotient that is finite at the center.
        return 0.25 / np.max(self.semi_axes) ** 2

    @property
    def region(self) -> Region:
        return ("ellipsoid", self.center, self.semi_axes, 0.0)

    @property
    def room(self) -> float:
        return float(np.min(self.semi_axes))

    def _depths(self, positions: FloatArray) -> tuple[FloatArray, FloatArray]:
        relative, squares = positions - self.center, self.semi_axes**2
        s = np.sqrt(np.sum(relative**2 / squares, axis=-1))
        steepness = np.maximum(np.sum(relative**2 / squares**2, axis=-1), self._least_steepness)
        depths = (s - 1.0) * s / np.sqrt(steepness)
        # Of the square of s, and of the steepness; inside, the gradient is of no use.
        of_square, of_steepness = 2.0 * relative / squares, 2.0 * relative / squares**2
        rise = (1.0 - 0.5 / np.maximum(s, 0.5)) / np.sqrt(steepness)
        return depths, rise[..., None] * of_square - (0.5 * depths / steepness)[..., None] * of_steepness


def prism_faces(
    corners: npt.ArrayLike, bottom: Scalar | None = None, top: Scalar | None = None
) -> tuple[Plane | Slab, ...]:
    """What encloses a prism over a convex polygon, along z: a Plane for each side, and a Slab if it has ends.

    Each is a wall by itself. Beyond an edge, what two of them hold is pushed by both, each by its own depth, so that
    the energy is ``(k/2) sum d_i^2``, as that of a ``Box``.

    Parameters
    ----------
    corners : (n, 2) length
        x and y, one after the other, either way round. Sides that go on in a line are one.
    bottom, top : length, optional
        z of its ends; it goes on without end if not given.

    Returns
    -------
    tuple of Plane and Slab

    Raises
    ------
    InputError
        If there are less than three corners, two of them are in one place, the polygon is not convex or crosses itself,
        or the top is not above the bottom.

    Examples
    --------
    >>> for face in prism_faces([[0, 0], [2000, 0], [0, 2000]]):  # doctest: +SKIP
    ...     system.addForce(filament_wall_force(filaments, system, face, 1000.0))
    """
    points = np.asarray(in_units_of(corners, LENGTH, "corners"), dtype=float)
    if points.ndim != 2 or points.shape[1:] != (2,) or len(points) < 3:
        raise InputError(f"corners must have the shape (n, 2) with at least three, but have {points.shape}.")
    ways = np.roll(points, -1, axis=0) - points
    lengths = np.linalg.norm(ways, axis=1)
    if not np.all(lengths > 0.0):
        raise InputError(f"Corner {int(np.argmin(lengths))} and the next one are in one place: leave one of them out.")
    ways = ways / lengths[:, None]
    before = np.roll(ways, 1, axis=0)
    turns = np.arctan2(before[:, 0] * ways[:, 1] - before[:, 1] * ways[:, 0], np.sum(before * ways, axis=1))
    sense = math.copysign(1.0, float(turns.sum()))
    if np.any(sense * turns < -_IN_LINE) or not math.isclose(sense * float(turns.sum()), 2.0 * math.pi, rel_tol=1e-6):
        raise InputError("corners must be those of a convex polygon, one after the other.")
    faces: list[Plane | Slab] = [
        Plane([*point, 0.0], [-sense * way[1], sense * way[0], 0.0])
        for point, way, turn in zip(points, ways, turns)
        if sense * turn > _IN_LINE
    ]
    if bottom is not None or top is not None:
        if bottom is None or top is None:
            raise InputError("A prism has both a bottom and a top, or none of them.")
        low, high = (finite_number(own, LENGTH, name) for own, name in ((bottom, "bottom"), (top, "top")))
        if not low < high:
            raise InputError(f"top must be above bottom, but they are at {high:g} and {low:g} nm.")
        faces.append(Slab([0.0, 0.0, 0.5 * (low + high)], [0.0, 0.0, 1.0], high - low))
    return tuple(faces)


ClosedShape = Box | Sphere | Ellipsoid | Capsule | Torus


def _set(instance, name, value):
    object.__setattr__(instance, name, value)


def bounds_of(shape: ClosedShape) -> tuple[FloatArray, FloatArray]:
    """Two opposite corners (3,) in nm of the box around a shape that is closed."""
    if isinstance(shape, Box):
        return shape.lower, shape.upper
    if isinstance(shape, Torus):
        reach = shape.minor_radius + shape.major_radius * np.sqrt(1.0 - shape.axis**2)
        return shape.center - reach, shape.center + reach
    reach = shape.semi_axes if isinstance(shape, Ellipsoid) else np.full(3, shape.radius)
    if isinstance(shape, Capsule):
        reach = reach + 0.5 * shape.length * np.abs(shape.axis)
    return shape.center - reach, shape.center + reach


def volume_of(shape: ClosedShape) -> float:
    """The volume in nm^3 of a shape that is closed."""
    if isinstance(shape, Capsule):
        return math.pi * shape.radius**2 * (shape.length + 4.0 / 3.0 * shape.radius)
    if isinstance(shape, Torus):
        return 2.0 * math.pi**2 * shape.major_radius * shape.minor_radius**2
    lower, upper = bounds_of(shape)
    return float(np.prod(upper - lower)) * (1.0 if isinstance(shape, Box) else np.pi / 6.0)
