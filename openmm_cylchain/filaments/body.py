"""Rigid bodies: beads, vesicles, spindle poles, asters, cargo. What they are, before they are in a System."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ..errors import InputError
from ..mechanics.friction import rotational_friction_of_sphere, stokes_friction
from ..units.quantities import LENGTH, VISCOSITY, in_units_of, positive, require_kind, shown, vector
from ..units.types import FloatArray, Numbers, Scalar, Vector, Vectors

BODY_NAME = "BOD"
"""Of the particles of rigid bodies in a Topology."""

_ON_LINE = 1e-3
"""Of its size: how far a point must be from the line of others to tell how a body is turned."""


@dataclass(frozen=True, eq=False)
class Body:
    """A rigid body: points that move as one, each with a radius, as spheres on a stiff frame.

    Its friction is the sum of those of its spheres, without hydrodynamic interactions: with radii r_i at a_i from the
    centre of friction, the mean of all points weighted by their radii,

        zeta = sum 6 pi eta r_i,    Z = sum 8 pi eta r_i^3 + 6 pi eta r_i (a_i^2 - a_i a_i^T).

    For one sphere, these are those of Stokes: 6 pi eta R and 8 pi eta R^3.

    Parameters
    ----------
    points : (n, 3) lengths
        In a frame of the body. Those in a System become particles of it, in this order: crosslinks, linkers with
        anchors, contacts, walls and any other force of OpenMM may take hold of them.
    radii : length, or (n,) lengths
        Zero for points that are places alone, without friction; one at least must not be.
    name : str
        Of the body, in its label and in the Topology.
    viscosity : viscosity, optional
        The eta of its friction where that is not the one of the solvent: of what it moves in, such as a cortex. Its
        noise belongs to this friction.

    Notes
    -----
    If all points are on one line, they do not tell how the body is turned: one or two without a radius are added behind
    them, beside this line.

    Raises
    ------
    InputError
        For points or radii that are none, two points in one place, or no radius.
    """

    points: FloatArray
    radii: FloatArray
    name: str = "Body"
    viscosity: float | None = None
    _markers: int = 0

    def __init__(self, points: Vectors, radii: Numbers, name: str = "Body", viscosity: Scalar | None = None) -> None:
        if not isinstance(name, str) or not name:
            raise InputError(f"The name of a Body must be a text, but is {shown(name)}.")
        label = f"{name}:"
        places = np.array(in_units_of(points, LENGTH, f"{label} points"), dtype=float)
        if places.ndim != 2 or places.shape[1] != 3 or not len(places) or not np.all(np.isfinite(places)):
            raise InputError(f"{label} points must be finite, in the shape (n, 3), but have {places.shape}.")
        given = np.asarray(in_units_of(radii, LENGTH, f"{label} radii"), dtype=float)
        if given.ndim > 1 or (given.ndim == 1 and given.shape != (len(places),)):
            raise InputError(
                f"{label} radii must be one length, or {len(places)} of them, but have the shape {given.shape}."
            )
        sizes = np.array(np.broadcast_to(given, (len(places),)))
        if not np.all(np.isfinite(sizes)) or sizes.min() < 0.0 or sizes.max() == 0.0:
            raise InputError(f"{label} radii must not be negative, and one must be above zero, but are {shown(radii)}.")
        _refuse_coinciding(places, label)
        markers = _points_beside(places, sizes)
        object.__setattr__(self, "points", np.concatenate([places, markers]))
        object.__setattr__(self, "radii", np.concatenate([sizes, np.zeros(len(markers))]))
        object.__setattr__(self, "name", name)
        own = None if viscosity is None else positive(viscosity, VISCOSITY, f"{label} viscosity")
        object.__setattr__(self, "viscosity", own)
        object.__setattr__(self, "_markers", len(markers))
        self.points.flags.writeable = self.radii.flags.writeable = False

    @classmethod
    def sphere(cls, radius: Scalar, points: Vectors = (), name: str = "Body", viscosity: Scalar | None = None) -> Body:
        """A sphere about the origin, with places on it or in it.

        Parameters
        ----------
        radius : length
        points : (n, 3) lengths
            Places for links and hands; their numbers in the body are 1 to n, and 0 is the centre.
        name : str
        viscosity : viscosity, optional
        """
        size = positive(radius, LENGTH, f"{name}: radius")
        places = np.asarray(in_units_of(points, LENGTH, f"{name}: points"), dtype=float)
        if not places.size:
            places = np.zeros((0, 3))
        if places.ndim != 2 or places.shape[1] != 3:
            raise InputError(f"{name}: points must have the shape (n, 3), but have {places.shape}.")
        return cls(np.concatenate([np.zeros((1, 3)), places]), np.r_[size, np.zeros(len(places))], name, viscosity)

    @property
    def has_places(self) -> bool:
        """Whether it has points off its centre, beside those that only tell how it is turned."""
        given = self.points[: len(self.points) - self._markers]
        return bool(np.any(np.linalg.norm(given - self.centre, axis=1) > _ON_LINE * self.radii.max()))

    @property
    def centre(self) -> FloatArray:
        """The centre of friction in the frame of the points: (3,) in nm."""
        return self.radii @ self.points / self.radii.sum()

    def friction(self, viscosity: Scalar) -> float:
        """The friction against motion in a solvent, in kJ ps/(mol nm^2)."""
        viscosity = self._viscosity_in(viscosity)
        return float(sum(stokes_friction(2.0 * radius, viscosity) for radius in self.radii if radius > 0.0))

    def rotational_friction(self, viscosity: Scalar) -> FloatArray:
        """The friction against turning about the centre of friction: (3, 3), in kJ ps/mol."""
        viscosity = self._viscosity_in(viscosity)
        result = np.zeros((3, 3))
        for radius, arm in zip(self.radii, self.points - self.centre):
            if radius > 0.0:
                across = arm @ arm * np.eye(3) - np.outer(arm, arm)
                result += rotational_friction_of_sphere(2.0 * radius, viscosity) * np.eye(3)
                result += stokes_friction(2.0 * radius, viscosity) * across
        return result

    def _viscosity_in(self, viscosity):
        return viscosity if self.viscosity is None else self.viscosity

    def place_frictions(self, viscosity: Scalar) -> FloatArray:
        """The least friction that each point has against motion of its own, in kJ ps/(mol nm^2): (n,)."""
        turning = np.linalg.eigvalsh(self.rotational_friction(viscosity))[0]
        squares = np.sum((self.points - self.centre) ** 2, axis=1)
        return 1.0 / (1.0 / self.friction(viscosity) + squares / turning)


@dataclass(frozen=True, eq=False)
class PlacedBody:
    """A Body where it begins.

    Attributes
    ----------
    body : Body
    positions : (n, 3) array
        Of its points, in nm.
    planar : bool
        Whether it moves in its plane of constant z, and turns about z, alone.
    """

    body: Body
    positions: FloatArray
    planar: bool

    @property
    def rotation(self) -> FloatArray:
        """How the frame of the body is turned: (3, 3)."""
        return rotation_between(self.body.points, self.positions)


def place_body(body: Body, position: Vector, orientation: Vectors | None, planar: bool, label: str) -> PlacedBody:
    """A Body with the origin of its frame at a position, its axes turned as a rotation matrix says."""
    require_kind(body, Body, f"{label}: body")
    origin = np.array([float(x) for x in vector(position, LENGTH, f"{label}: position")])
    try:
        rotation = np.eye(3) if orientation is None else np.asarray(orientation, dtype=float)
    except (TypeError, ValueError):
        rotation = np.zeros(0)
    if (
        rotation.shape != (3, 3)
        or not np.allclose(rotation @ rotation.T, np.eye(3), atol=1e-6)
        or np.linalg.det(rotation) < 0.0
    ):
        raise InputError(f"{label}: orientation must be a rotation matrix (3, 3), but is {shown(orientation)}.")
    return PlacedBody(body, origin + body.points @ rotation.T, planar)


def rotation_between(points: FloatArray, positions: FloatArray) -> FloatArray:
    """The rotation (3, 3) that takes points (n, 3), about their mean, to positions as well as any (Kabsch)."""
    before, after = points - points.mean(axis=0), positions - positions.mean(axis=0)
    left, _, right = np.linalg.svd(after.T @ before)
    sign = np.diag([1.0, 1.0, np.sign(np.linalg.det(left @ right))])
    return left @ sign @ right


def random_rotation(generator: np.random.Generator, planar: bool = False) -> FloatArray:
    """A rotation matrix (3, 3) drawn uniformly from all, or from those about z."""
    if planar:
        angle = generator.uniform(0.0, 2.0 * math.pi)
        return np.array([[math.cos(angle), -math.sin(angle), 0], [math.sin(angle), math.cos(angle), 0], [0, 0, 1]])
    w, *v = (q := generator.normal(size=4)) / np.linalg.norm(q)
    axis = np.array(v)
    across = np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])
    return (w * w - axis @ axis) * np.eye(3) + 2.0 * np.outer(axis, axis) + 2.0 * w * across


def rotation_along(direction: FloatArray) -> FloatArray:
    """A rotation matrix (3, 3) that takes x to a unit vector, y to the xy plane, and z to the side of z."""
    across = np.cross([0.0, 0.0, 1.0], direction)
    length = float(np.linalg.norm(across))
    across = across / length if length > 1e-9 else np.array([0.0, 1.0, 0.0])
    return np.stack([direction, across, np.cross(direction, across)], axis=1)


def _refuse_coinciding(points, label):
    for number, point in enumerate(points):
        same = np.flatnonzero(np.all(points[:number] == point, axis=1))
        if len(same):
            raise InputError(f"{label} points {same[0]} and {number} are in one place, {point.tolist()} nm.")


def _points_beside(points, radii):
    # Those that are missing to tell how the body is turned: none, one beside the line of all, or two beside one point.
    size = max(float(radii.max()), float(np.linalg.norm(points - points[0], axis=1).max()))
    _, spread, axes = np.linalg.svd(points - points.mean(axis=0))
    directions = np.count_nonzero(spread > _ON_LINE * size)
    return points[0] + size * axes[directions:2] if directions < 2 else np.zeros((0, 3))
