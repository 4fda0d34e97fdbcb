"""Bends at rest of the joints of filaments with twist: curved DNA, and helices."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
import numpy.typing as npt
from openmm import unit

from ..errors import InputError
from ..mechanics.material_frames import bends_in_material, first_vector, transported, turned
from ..mechanics.potentials import BENDING_POTENTIALS
from ..units.quantities import ANGLE, in_units_of, require_kind
from ..units.types import FloatArray
from .chain_type import ChainType
from .equilibrium import BentJointDistribution, SegmentLengthDistribution
from .twist import has_twist

_LARGEST = 1.0
"""Of R k; segments may turn by less than a right angle in a step."""


@dataclass(frozen=True)
class RestBends:
    """By how much the joints of a filament with twist are bent at rest, and where to in its material.

    The energy of a joint is that of the vector b - R k in place of its bend b, which the bending model makes of its
    angle: ``(K/2) |b - R k|^2``, where b has the size ``(2 V_b/K)^(1/2)``. R k has that of the angle at rest, and a
    direction in the material half-way over the joint: in the frame of the segment before, carried over to the bisector
    by parallel transport, and turned by half of the twist m of the joint.

    Attributes
    ----------
    angles : angle, or an angle of each joint
        At rest, from 0 to about 0.9 radians; zero for joints that are straight. For a curvature, take it times the
        length of a segment.
    directions : angle, or an angle of each joint
        To which the joint bends: from the first axis of the material frame to the second one.

    Notes
    -----
    The scheme is "implicit" of the compiled engine. Joints of a ring begin with that at its first node, of an open
    filament with that at its second one. The frame of the first segment is state: the first twist of an open filament
    says how far it is turned from one that parallel transport brings there from the direction of ``add_end_frame``, or
    from the z axis without such; and a ring has one twist more, the last, for that. ``docs/design/twist.md`` says how
    long steps may be.

    Examples
    --------
    >>> from openmm import unit
    >>> RestBends(6 * unit.degree).directions
    0.0
    >>> RestBends([0.0, 0.3, 0.0], directions=0.5).angles
    (0.0, 0.3, 0.0)
    """

    angles: float | tuple[float, ...]
    directions: float | tuple[float, ...] = 0.0

    def __init__(self, angles: unit.Quantity | npt.ArrayLike, directions: unit.Quantity | npt.ArrayLike = 0.0) -> None:
        for name, value in (("angles", angles), ("directions", directions)):
            numbers = np.asarray(in_units_of(value, ANGLE, f"RestBends: {name}"), dtype=float)
            if numbers.ndim > 1 or numbers.size == 0 or not np.all(np.isfinite(numbers)):
                raise InputError(f"RestBends: {name} must be an angle, or one of each joint.")
            if name == "angles" and (np.any(numbers < 0.0) or np.any(numbers >= np.pi)):
                raise InputError("RestBends: angles must not be negative, and must be less than pi.")
            object.__setattr__(self, name, tuple(numbers.tolist()) if numbers.ndim else float(numbers))

    def components(self, bending_model: str, joints: int) -> FloatArray:
        """R k in the axes of the material: (joints, 2), of joints of a BendingPotential with this name."""
        for name in ("angles", "directions"):
            if np.size(getattr(self, name)) not in (1, joints) or (np.ndim(getattr(self, name)) and joints == 0):
                raise InputError(
                    f"rest_bends: {name} must be one angle, or one of each of {joints} joints, but there are "
                    f"{np.size(getattr(self, name))}."
                )
        energy = BENDING_POTENTIALS[bending_model].energy(1.0, np.cos(np.asarray(self.angles)))
        size = np.broadcast_to(np.sqrt(2.0 * energy), (joints,))
        direction = np.broadcast_to(np.asarray(self.directions), (joints,))
        return size[:, None] * np.stack([np.cos(direction), np.sin(direction)], axis=1)


def check_rest_bends(
    rest_bends: RestBends, filament_type: ChainType, joints: int, planar: bool, grows: bool, label: str
) -> None:
    """Raise InputError if a filament with so many joints cannot have these bends at rest."""
    require_kind(rest_bends, RestBends, f"{label}: rest_bends")
    if not has_twist(filament_type):
        raise InputError(
            f"{label}: rest_bends have directions in the material, which only filaments with twist know: give the type "
            "a twist_persistence_length."
        )
    if planar or grows:
        raise InputError(f"{label} {'is planar' if planar else 'grows'}, and cannot have rest_bends.")
    if filament_type.bending_rigidity == 0.0:
        raise InputError(f"{label}: rest_bends need a bending_rigidity.")
    try:
        sizes = np.linalg.norm(rest_bends.components(filament_type.bending_model, joints), axis=1)
    except InputError as error:
        raise InputError(f"{label}: {error}") from None
    if np.any(sizes > _LARGEST):
        joint = int(np.argmax(sizes))
        raise InputError(
            f"{label}: joint {joint} is bent too far at rest, by b = {sizes[joint]:.3g}, of at most {_LARGEST:g}: take "
            "shorter segments."
        )


def bending_energies_at_rest(
    filament_type: ChainType,
    nodes: FloatArray,
    closed: bool,
    twists: FloatArray,
    beyond: FloatArray,
    rest: FloatArray,
    stiffnesses: FloatArray,
) -> FloatArray:
    """Energies (..., joints) in kJ/mol of joints with bends at rest (joints, 2), for nodes (..., n, 3) in nm.

    ``twists`` (..., n) or (..., n+1) are in radians, and ``beyond`` is the direction from which the frame of the first
    segment is counted.
    """
    potential = BENDING_POTENTIALS[filament_type.bending_model]
    bends = bends_in_material(nodes, closed, twists, beyond, lambda cosine: potential.energy(1.0, cosine))
    return 0.5 * stiffnesses * np.sum((bends - rest) ** 2, axis=-1)


def draw_bent_chain(
    filament_type: Any,
    temperature: float,
    generator: np.random.Generator,
    start: FloatArray,
    direction: FloatArray | None,
    rest: FloatArray,
    stiffnesses: FloatArray,
) -> FloatArray:
    """Nodes of a free open chain with bends at rest (joints, 2) from its equilibrium, with twists at rest.

    The frame of its first segment is that for a first twist of zero.
    """
    lengths = SegmentLengthDistribution(filament_type, temperature).sample(generator, len(rest) + 1)
    tangent = generator.normal(size=3) if direction is None else np.asarray(direction, dtype=float)
    tangent = tangent / np.linalg.norm(tangent)
    beyond = np.array([0.0, 0.0, 1.0])
    axis = transported(first_vector(beyond), beyond, tangent)
    tangents, half = [tangent], 0.5 * filament_type.rest_twist
    for own, stiffness in zip(rest, stiffnesses):
        size = float(np.linalg.norm(own))
        cosine, along = _draw_bend(filament_type, temperature, generator, float(stiffness), size)
        azimuth = np.arctan2(own[1], own[0]) + along + half
        across = turned(axis, tangent, azimuth)
        following = cosine * tangent + np.sqrt((1.0 - cosine) * (1.0 + cosine)) * across
        axis = turned(transported(axis, tangent, following), following, 2.0 * half)
        tangent = following / np.linalg.norm(following)
        tangents.append(tangent)
    steps = lengths[:, None] * np.array(tangents)
    return np.asarray(start, dtype=float) + np.concatenate([np.zeros((1, 3)), np.cumsum(steps, axis=0)])


@lru_cache(maxsize=512)
def _bend_distribution(filament_type, temperature, stiffness, size):
    return BentJointDistribution(filament_type, temperature, stiffness, size)


def _draw_bend(filament_type, temperature, generator, stiffness, size):
    # The cosine of a joint, and the angle from the bend at rest to its bend.
    distribution = _bend_distribution(filament_type, temperature, stiffness, size)
    cosine = float(distribution.sample(generator, 1)[0])
    return cosine, generator.vonmises(0.0, distribution.concentration(cosine))
