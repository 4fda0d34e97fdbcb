"""Directions that turn with the material of twisted chains."""

from collections.abc import Callable

import numpy as np

from ..units.types import FloatArray
from .geometry import segment_vectors


def material_vectors(nodes: FloatArray, closed: bool, twists: FloatArray, rest: float) -> FloatArray:
    """Unit vectors (segments, 3) across the segments of a chain, one in each material frame.

    That of a segment is that of the one before, carried over by parallel transport, and turned by the twist of the
    joint beyond that at rest. The first one is turned by the twist of the first joint of open chains, from where the x
    axis is nearest to, or the y axis if the segment is along x.

    Parameters
    ----------
    nodes : (n, 3) array
    closed : bool
        Whether the last node is joined to the first.
    twists : (n,) array
        In radians, of all joints, those to the frames of ends of open chains among them.
    rest : float
        Of joints between segments, in radians.
    """
    vectors = segment_vectors(nodes, closed)
    tangents = vectors / np.linalg.norm(vectors, axis=1, keepdims=True)
    axis = np.eye(3)[0 if abs(tangents[0, 0]) < 0.9 else 1]
    untwisted = np.empty_like(tangents)
    untwisted[0] = axis - (axis @ tangents[0]) * tangents[0]
    for s in range(1, len(tangents)):
        untwisted[s] = transported(untwisted[s - 1], tangents[s - 1], tangents[s])
    untwisted /= np.linalg.norm(untwisted, axis=1, keepdims=True)
    turns = np.asarray(twists)[: len(tangents)] - rest
    turns[0] = 0.0 if closed else twists[0]
    return turned(untwisted, tangents, np.cumsum(turns))


def first_vector(direction: FloatArray) -> FloatArray:
    """The unit vector (3,) across a unit vector from which the frame of the first segment is counted.

    Duff et al., J. Comput. Graph. Tech. 2017, 6, 1.
    """
    x, y, z = direction
    sign = np.copysign(1.0, z)
    a = -1.0 / (sign + z)
    return np.array([1.0 + sign * x * x * a, sign * x * y * a, -sign * x])


def transported(vectors: FloatArray, before: FloatArray, behind: FloatArray) -> FloatArray:
    """Vectors (..., 3) across unit vectors, carried over to other ones by parallel transport."""
    along = np.sum(vectors * behind, axis=-1) / (1.0 + np.sum(before * behind, axis=-1))
    return vectors - along[..., None] * (before + behind)


def turned(vectors: FloatArray, axes: FloatArray, angles: FloatArray) -> FloatArray:
    """Vectors (..., 3) across unit vectors, turned about these by angles (...)."""
    angles = np.asarray(angles)[..., None]
    return np.cos(angles) * vectors + np.sin(angles) * np.cross(axes, vectors)


def bends_in_material(
    nodes: FloatArray,
    closed: bool,
    twists: FloatArray,
    beyond: FloatArray,
    energy: Callable[[FloatArray], FloatArray],
) -> FloatArray:
    """Bends b (..., joints, 2) in the material frames half-way over their joints: see ``RestBends``.

    Parameters
    ----------
    nodes : (..., n, 3) array
    closed : bool
        Whether the last node is joined to the first.
    twists : (..., n) array, or (..., n + 1) if closed
        In radians. The first one of an open chain, or the last of a closed one, is how far the frame of the first
        segment is turned.
    beyond : (3,) array
        The direction from which that is counted.
    energy : callable
        That of a joint with the stiffness one as a function of its cosine, b^2/2.
    """
    vectors = segment_vectors(nodes, closed)
    tangents = vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)
    count = tangents.shape[-2]
    beyond = np.broadcast_to(np.asarray(beyond, dtype=float), tangents[..., 0, :].shape)
    first = np.broadcast_to(first_vector(beyond.reshape(-1, 3)[0]), beyond.shape)
    axis = turned(transported(first, beyond, tangents[..., 0, :]), tangents[..., 0, :], twists[..., count * closed])
    found = []
    for s in range(1, count + closed):
        before, behind = tangents[..., s - 1, :], tangents[..., s % count, :]
        bisector = before + behind
        bisector = bisector / np.linalg.norm(bisector, axis=-1, keepdims=True)
        half = 0.5 * twists[..., s % count]
        axis = turned(transported(axis, before, bisector), bisector, half)
        bent = behind - before
        size = np.linalg.norm(bent, axis=-1)
        # 1-c of the cosine is half the square of that, without a loss of digits.
        bend = np.sqrt(2.0 * energy(1.0 - 0.5 * size**2)) / np.where(size > 0.0, size, 1.0)
        bent = bend[..., None] * bent
        axes = axis, np.cross(bisector, axis)
        found.append(np.stack([np.sum(bent * own, axis=-1) for own in axes], axis=-1))
        axis = transported(turned(axis, bisector, half), bisector, behind)
    if not found:
        return np.zeros((*nodes.shape[:-2], 0, 2))
    # Joints of a ring begin at its first node.
    return np.stack(found[-1:] + found[:-1] if closed else found, axis=-2)
