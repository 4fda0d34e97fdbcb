"""Points at random on walls: motors of a gliding assay, or tethers, are anchored there."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from ..errors import InputError
from ..mechanics.geometry import directions_across
from ..units.quantities import LENGTH, vector, whole_number, whole_numbers
from ..units.types import FloatArray, Vector
from .shapes import Box, Capsule, Cylinder, Ellipsoid, Plane, Shape, Slab, Sphere, Torus

_MOST_DRAWS = 10**7
"""Points that may be drawn for one on a part of the wall."""

_MOST_POINTS = 10**7
_BATCH = 4096
_ROUNDING = 1e-9
"""How far beyond the region a point on the wall may be, over the size of numbers."""


def random_points_on(
    wall: Shape, count: int, seed: int | Sequence[int] = 0, lower: Vector | None = None, upper: Vector | None = None
) -> FloatArray:
    """Points at random on a wall, with the same chance for each area: an array (count, 3) in nm.

    Parameters
    ----------
    wall : Plane, Slab, Sphere, Cylinder, Capsule, Torus, Box or Ellipsoid
    count : int
    seed : int, or several
    lower, upper : (3,) length, optional
        Opposite corners of a box along the axes of space: points are on what it holds of the wall. Planes, slabs and
        cylinders, which have no end, need both.

    Raises
    ------
    InputError
        For a value that is missing or wrong, or a box that holds nothing of the wall, or less than 10^-7 of what is
        near it.
    """
    if not isinstance(wall, Shape):
        raise InputError(f"wall must be a shape, such as Plane(point, normal), but is {wall!r}.")
    count = whole_number(count, 1, "count")
    if count > _MOST_POINTS:
        raise InputError(f"count must be at most {_MOST_POINTS:.0e}, but is {count:.3g}.")
    if isinstance(wall, (Plane, Slab, Cylinder)) and (lower is None or upper is None):
        raise InputError(
            f"A {type(wall).__name__} has no end: give lower and upper, the corners of the box to stay in."
        )
    low = np.full(3, -np.inf) if lower is None else vector(lower, LENGTH, "lower")
    high = np.full(3, np.inf) if upper is None else vector(upper, LENGTH, "upper")
    if np.any(low > high):
        raise InputError(f"lower must not be above upper, but they are {low.tolist()} and {high.tolist()} nm.")
    seeds = whole_numbers(seed, 0, "seed") if isinstance(seed, Sequence) else whole_number(seed, 0, "seed")
    generator = np.random.default_rng(seeds)
    draw = _SAMPLERS[type(wall)]
    slack = _ROUNDING * max(np.abs(corner[np.isfinite(corner)]).max(initial=0.0) for corner in (low, high))
    found, drawn = np.zeros((0, 3)), 0
    while len(found) < count:
        points = draw(wall, _BATCH, generator, low, high)
        drawn += _BATCH
        inside = np.all((points >= low - slack) & (points <= high + slack), axis=1)
        found = np.vstack([found, points[inside]])
        if drawn > _MOST_DRAWS * max(1, len(found)):
            raise InputError(
                f"The box from {low.tolist()} to {high.tolist()} nm holds nothing of the wall, or too little of it: "
                "take a larger one that the wall goes through."
            )
    return np.clip(found[:count], low, high)


def _corners(low, high):
    return np.array([[x, y, z] for x in (low[0], high[0]) for y in (low[1], high[1]) for z in (low[2], high[2])])


def _on_plane(plane, count, generator, low, high):
    across = np.array(directions_across(plane.normal))
    extent = (_corners(low, high) - plane.point) @ across.T
    return plane.point + generator.uniform(extent.min(axis=0), extent.max(axis=0), (count, 2)) @ across


def _on_slab(slab, count, generator, low, high):
    sides = generator.choice([-0.5, 0.5], count) * slab.thickness
    return _on_plane(slab, count, generator, low, high) + sides[:, None] * slab.normal


def _on_cylinder(cylinder, count, generator, low, high):
    heights = (_corners(low, high) - cylinder.point) @ cylinder.axis
    first, second = directions_across(cylinder.axis)
    angle = generator.uniform(0.0, 2.0 * math.pi, (count, 1))
    height = generator.uniform(heights.min(), heights.max(), (count, 1))
    return cylinder.point + height * cylinder.axis + cylinder.radius * (np.cos(angle) * first + np.sin(angle) * second)


def _directions(count, generator):
    normals = generator.normal(size=(count, 3))
    return normals / np.linalg.norm(normals, axis=1)[:, None]


def _on_sphere(sphere, count, generator, low, high):
    return sphere.center + sphere.radius * _directions(count, generator)


def _on_capsule(capsule, count, generator, low, high):
    # Of its area, the half spheres have the share of their diameter in its whole length.
    along, normals = capsule.axis, _directions(count, generator)
    on_caps = generator.uniform(size=(count, 1)) * (capsule.length + 2.0 * capsule.radius) > capsule.length
    heights = (normals @ along)[:, None]
    across = normals - heights * along
    across /= np.linalg.norm(across, axis=1)[:, None]
    height = np.where(on_caps, np.sign(heights), generator.uniform(-1.0, 1.0, (count, 1))) * 0.5 * capsule.length
    return capsule.center + height * along + capsule.radius * np.where(on_caps, normals, across)


def _on_torus(torus, count, generator, low, high):
    # An area grows with the distance from the axis.
    around, about = generator.uniform(0.0, 2.0 * np.pi, (2, count))
    distances = torus.major_radius + torus.minor_radius * np.cos(about)
    kept = generator.uniform(size=count) * (torus.major_radius + torus.minor_radius) < distances
    first, second = directions_across(torus.axis)
    outward = np.cos(around)[:, None] * first + np.sin(around)[:, None] * second
    places = distances[:, None] * outward + torus.minor_radius * np.sin(about)[:, None] * torus.axis
    return torus.center + places[kept]


def _on_ellipsoid(ellipsoid, count, generator, low, high):
    # Of the unit sphere, an area grows with |n/a| a b c for its direction n and the semi-axes.
    directions = _directions(count, generator)
    growth = np.linalg.norm(directions / ellipsoid.semi_axes, axis=1) * ellipsoid.semi_axes.min()
    kept = generator.uniform(size=count) < growth
    return ellipsoid.center + directions[kept] * ellipsoid.semi_axes


def _on_box(box, count, generator, low, high):
    edges = box.upper - box.lower
    areas = np.prod(edges) / edges
    axes = generator.choice(3, count, p=areas / areas.sum())
    points = generator.uniform(box.lower, box.upper, (count, 3))
    ends = np.where(generator.integers(2, size=count) == 0, box.lower[axes], box.upper[axes])
    points[np.arange(count), axes] = ends
    return points


_SAMPLERS = {
    Plane: _on_plane,
    Slab: _on_slab,
    Sphere: _on_sphere,
    Cylinder: _on_cylinder,
    Capsule: _on_capsule,
    Torus: _on_torus,
    Box: _on_box,
    Ellipsoid: _on_ellipsoid,
}
