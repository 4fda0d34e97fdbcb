"""Directions that turn with the material of twisted chains."""

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
        before, here = tangents[s - 1], tangents[s]
        moved = untwisted[s - 1]
        untwisted[s] = moved - (moved @ here) / (1.0 + before @ here) * (before + here)
    untwisted /= np.linalg.norm(untwisted, axis=1, keepdims=True)
    turns = np.asarray(twists)[: len(tangents)] - rest
    turns[0] = 0.0 if closed else twists[0]
    angles = np.cumsum(turns)[:, None]
    return np.cos(angles) * untwisted + np.sin(angles) * np.cross(tangents, untwisted)
