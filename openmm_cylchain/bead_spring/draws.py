"""Independent draws of bead-spring chains from their exact equilibrium."""

import numpy as np

from ..units.types import FloatArray
from .transfer_operator import transfer_operator


def draw_bonds(
    nu: float,
    reduced_temperature: float,
    bonds: int,
    generator: np.random.Generator,
    count: int = 1,
    planar: bool = False,
    direction: FloatArray | None = None,
) -> FloatArray:
    """Bond vectors (count, bonds, 3) of independent chains, in units of d; parameters are those of
    ``TransferOperator``.

    The unit vector ``direction`` of first bonds is drawn from the sphere, or with ``planar`` from the circle, if not
    given.
    """
    operator = transfer_operator(nu, reduced_temperature, bonds, 2 if planar else 3)
    lengths, concentrations = operator.draw(generator, count)
    tangents = _tangents_in_plane if planar else _tangents_in_space
    return lengths[..., None] * tangents(concentrations, generator, direction)


def _tangents_in_plane(concentrations, generator, direction):
    count = len(concentrations)
    if direction is None:
        first = generator.uniform(-np.pi, np.pi, count)
    else:
        first = np.full(count, np.arctan2(direction[1], direction[0]))
    angles = np.cumsum(np.concatenate([first[:, None], generator.vonmises(0.0, concentrations)], axis=1), axis=1)
    return np.stack([np.cos(angles), np.sin(angles), np.zeros_like(angles)], axis=2)


def _tangents_in_space(concentrations, generator, direction):
    count, joints = concentrations.shape
    # 1 - cos of every joint, whose density is exp(x cos), and the direction to which it bends.
    safe = np.maximum(concentrations, 1e-12)
    bends = np.minimum(-np.log1p(generator.random((count, joints)) * np.expm1(-2.0 * safe)) / safe, 2.0)
    sines = np.sqrt(bends * (2.0 - bends))
    towards = generator.normal(size=(joints + 1, count, 3))
    tangents = np.empty((joints + 1, count, 3))
    tangents[0] = towards[0] if direction is None else direction
    tangents[0] /= np.linalg.norm(tangents[0], axis=1)[:, None]
    for joint in range(joints):
        tangent, across = tangents[joint], _cross(tangents[joint], towards[joint + 1])
        across *= (sines[:, joint] / _norms(across))[:, None]
        following = (1.0 - bends[:, joint])[:, None] * tangent + across
        tangents[joint + 1] = following / _norms(following)[:, None]
    return tangents.transpose(1, 0, 2)


def _cross(one, other):
    # As of numpy, whose own takes longer for one pair than all else of a joint.
    return one[:, _NEXT] * other[:, _LAST] - one[:, _LAST] * other[:, _NEXT]


def _norms(vectors):
    return np.sqrt(np.add.reduce(vectors * vectors, axis=1))


_NEXT, _LAST = np.array([1, 2, 0]), np.array([2, 0, 1])
