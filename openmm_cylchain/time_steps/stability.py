"""Bounds on the time step: of segments, Tables 1 and 3 of the paper, and of whole chains.

Equation numbers refer to Pesek et al., Soft Matter 2016, 12, 3360, appendix D. Bounds are those of stability or of
passing through; they say nothing about accuracy, which is why ``recommended_step`` stays well below them.
"""

import math
from typing import cast

from ..bead_spring.bead_spring_type import BeadSpringType
from ..errors import InputError
from ..filaments.chain_type import ChainType
from ..mechanics.friction import SegmentFriction
from ..units.quantities import (
    BENDING_RIGIDITY,
    DIMENSIONLESS,
    LENGTH,
    STIFFNESS,
    VISCOSITY,
    in_units_of,
    positive,
    require_kind,
    thermal_energy,
)
from ..units.types import Scalar
from .bead_spring_step import bead_spring_stability_bound


def translation_bound(
    friction: SegmentFriction, diameter: Scalar, temperature: Scalar, confidence: float = 3.0
) -> float:
    """Largest step, in ps, in which translational diffusion cannot carry segments through each other, eq. (54).

    ``dt < d^2 gamma_par / (8 c_sigma^2 k_B T)``

    As printed, and as Table 3 was computed; for segments shorter than about seven diameters the
    perpendicular friction is the smaller one, and ``diffusion_bound`` accounts for it.
    """
    return _diffusion_bound(friction.parallel, diameter, temperature, confidence)


def rotation_bound(
    friction: SegmentFriction, diameter: Scalar, length: Scalar, temperature: Scalar, confidence: float = 3.0
) -> float:
    """Largest step, in ps, in which rotational diffusion cannot carry segments through each other, eq. (55).

    ``dt < d^2 gamma_rot / (2 c_sigma^2 k_B T l^2)``
    """
    effective = 4.0 * friction.rotational / positive(length, LENGTH, "length") ** 2
    return _diffusion_bound(effective, diameter, temperature, confidence)


def diffusion_bound(
    friction: SegmentFriction, diameter: Scalar, length: Scalar, temperature: Scalar, confidence: float = 3.0
) -> float:
    """Largest step, in ps, for the diffusion of a segment's ends, eq. (56).

    ``dt < d^2/(8 c_sigma^2 k_B T) min(1/(1/gamma_par + l^2/4 gamma_def), 1/(1/gamma_perp + l^2/4 gamma_rot))``

    The printed second denominator carries gamma_par where (16) gives gamma_perp; Table 3 was computed
    with gamma_perp, and so is this.
    """
    return _diffusion_bound(
        _end_friction(friction, positive(length, LENGTH, "length")), diameter, temperature, confidence
    )


def _end_friction(friction, length):
    # Of one end of a free segment, in the direction in which it is lower.
    quarter = length**2 / 4.0
    along = 1.0 / (1.0 / friction.parallel + quarter / friction.extensional)
    across = 1.0 / (1.0 / friction.perpendicular + quarter / friction.rotational)
    return min(along, across)


def _diffusion_bound(friction, diameter, temperature, confidence):
    kT = thermal_energy(temperature)
    confidence = positive(confidence, DIMENSIONLESS, "confidence")
    if kT == 0.0:
        return math.inf
    return positive(diameter, LENGTH, "diameter") ** 2 * friction / (8.0 * confidence**2 * kT)


def stretching_bound(friction: SegmentFriction, stiffness: Scalar, length: Scalar) -> float:
    """Step, in ps, above which an explicit scheme overshoots a change of length, eq. (57).

    ``dt < 2 gamma_def / (k l0^2)``
    """
    stiffness = positive(stiffness, STIFFNESS, "stiffness")
    return 2.0 * friction.extensional / (stiffness * positive(length, LENGTH, "length") ** 2)


def bending_bound(friction: SegmentFriction, bending_rigidity: Scalar, length: Scalar) -> float:
    """Step, in ps, above which an explicit scheme overshoots a bend, eq. (58).

    ``dt < 2 l0 gamma_rot / a`` (infinite for a = 0)
    """
    rigidity = cast(float, in_units_of(bending_rigidity, BENDING_RIGIDITY, "bending_rigidity"))
    if rigidity == 0.0:
        return math.inf
    return 2.0 * positive(length, LENGTH, "length") * friction.rotational / rigidity


def bead_spring_bounds(
    diameter: Scalar,
    viscosity: Scalar,
    stiffness: Scalar,
    bending_rigidity: Scalar,
    temperature: Scalar,
    confidence: float = 3.0,
) -> dict[str, float]:
    """Bounds, in ps, of a chain of touching beads, eq. (59), with gamma = 3 pi eta d and l0 = d.

    Returns a dict with ``translation`` d^2 gamma/(8 c_sigma^2 k_B T), ``stretching`` gamma/k and
    ``bending`` 2 gamma l0^3/a.
    """
    diameter = positive(diameter, LENGTH, "diameter")
    friction = 3.0 * math.pi * positive(viscosity, VISCOSITY, "viscosity") * diameter
    return {
        "translation": _diffusion_bound(friction, diameter, temperature, confidence),
        "stretching": friction / positive(stiffness, STIFFNESS, "stiffness"),
        "bending": 2.0 * friction * diameter**3 / positive(bending_rigidity, BENDING_RIGIDITY, "bending_rigidity"),
    }


def contact_stiffness_bound(
    friction: SegmentFriction, length: Scalar, stiffness: Scalar, beads_per_segment: float = 1.0
) -> float:
    """Step, in ps, above which contacts of stiffness k, which are explicit in every scheme, overshoot and blow up.

    ``dt < 2/lambda``, lambda the fastest relaxation of two equal segments that touch. One pair of beads at their ends
    relaxes with 2 k/gamma*, where gamma* is the friction of an end as in (56), and n pairs along both of them with
    2 n k/gamma_perp where they move, and 2 n k (l0^2/12)/gamma_rot where they turn, so

        dt < min(gamma*, gamma_perp/n, 12 gamma_rot/(n l0^2)) / k.

    Segments in a chain move less, which leaves the bound on the safe side.
    """
    length = positive(length, LENGTH, "length")
    pairs = max(1.0, positive(beads_per_segment, DIMENSIONLESS, "beads_per_segment"))
    softest = min(
        _end_friction(friction, length),
        friction.perpendicular / pairs,
        12.0 * friction.rotational / (pairs * length**2),
    )
    return softest / positive(stiffness, STIFFNESS, "stiffness")


def time_step_bounds(
    filament_type: ChainType, viscosity: Scalar, temperature: Scalar, confidence: float = 3.0, segments: int = 1
) -> dict[str, float]:
    """The five bounds of Table 1 for a filament type in a solvent, in ps.

    Parameters
    ----------
    filament_type : FilamentType
    viscosity : pressure*time
    temperature : temperature
    confidence : float
        c_sigma of eq. (53): how many standard deviations of a displacement must stay below d.
    segments : int
        Number of segments of the filament; matters only with ``friction_length="filament"``.

    Returns
    -------
    dict
        ``translation`` (54), ``rotation`` (55), ``diffusion`` (56), ``stretching`` (57), ``bending`` (58).
    """
    require_kind(filament_type, ChainType, "filament_type")
    if isinstance(filament_type, BeadSpringType):
        raise InputError(f"Table 1 has bounds of cylinders, but {filament_type.name!r} has beads: see stability_bounds")
    friction = filament_type.segment_friction(viscosity, temperature, segments)
    length, diameter = filament_type.segment_length, filament_type.diameter
    return {
        "translation": translation_bound(friction, diameter, temperature, confidence),
        "rotation": rotation_bound(friction, diameter, length, temperature, confidence),
        "diffusion": diffusion_bound(friction, diameter, length, temperature, confidence),
        "stretching": stretching_bound(friction, filament_type.segment_stiffness, length),
        "bending": bending_bound(friction, filament_type.joint_stiffness * length, length),
    }


def stability_bounds(
    filament_type: ChainType, viscosity: Scalar, temperature: Scalar, segments: int = 1
) -> dict[str, float]:
    """Steps, in ps, above which the explicit schemes blow up: ``stretching`` and ``bending`` of a chain.

    Of beads one alone, ``springs``, see ``bead_spring_step.bead_spring_stability_bound``.
    """
    require_kind(filament_type, ChainType, "filament_type")
    friction = filament_type.segment_friction(viscosity, temperature, segments)
    if isinstance(filament_type, BeadSpringType):
        return {"springs": bead_spring_stability_bound(filament_type)}
    return bounds_of_chain(filament_type, friction, segments)


def bounds_of_chain(filament_type: ChainType, friction: SegmentFriction, segments: int) -> dict[str, float]:
    """The bounds of ``stability_bounds`` for segments of a friction.

    ``dt < 2/lambda``, lambda the largest eigenvalue of Z^-1 K of a long straight chain. A longitudinal wave of wave
    number q has K = 4 k sin^2(q/2) and Z = gamma_par cos^2(q/2) + (4 gamma_def/l0^2) sin^2(q/2), a transverse one
    K = (16 a/l0^3) sin^4(q/2) and Z = gamma_perp cos^2(q/2) + (4 gamma_rot/l0^2) sin^2(q/2). The fastest are those in
    which neighbouring nodes move against each other, so

        dt < 2 gamma_def/(k l0^2), which is (57): being in a chain changes nothing
        dt < gamma_rot l0/(2 a), a quarter of (58), which looks at a single joint
    """
    length = filament_type.segment_length
    bounds = {"stretching": stretching_bound(friction, filament_type.segment_stiffness, length)}
    if segments > 1:
        bounds["bending"] = bending_bound(friction, filament_type.joint_stiffness * length, length) / 4.0
    return bounds
