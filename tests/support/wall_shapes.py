"""One wall of each shape."""

from openmm import unit

from openmm_cylchain import Box, Capsule, Cylinder, Ellipsoid, Plane, Slab, Sphere, Torus

SHAPES = [
    Plane([0, 0, 1], [1, 2, -2]),
    Slab([1, 2, 3] * unit.angstrom, [0, 1, 1], 3),
    Sphere([0.1, 0.2, 0.3], 2 * unit.nanometer),
    Cylinder([1, 0, 0], [1, 1, 0.2], 1.5),
    Box([-1, -2, -1], [2, 1, 1]),
    Ellipsoid([0.1, 0, 0], [1, 2, 3]),
    Capsule([0.2, -0.1, 0.3], [3, 0, -4], 2 * unit.nanometer, 1),
    Torus([0.2, 0.1, -0.3], [4, 0, 3], 2 * unit.nanometer, 1.3),
]
