"""Diffusion of a free segment: its orientation, and the displacement of its centre."""

from __future__ import annotations

import numpy as np

from ..mechanics.friction import SegmentFriction, rotational_relaxation_time
from ..units.quantities import FRICTION, ROTATIONAL_FRICTION, TIME, positive, require_kind
from ..units.types import FloatOrArray, Numbers, Scalar
from .arguments import each_not_negative, thermal_energy_above_zero


def mean_orientation(time: Numbers, friction: SegmentFriction, temperature: Scalar) -> FloatOrArray:
    """Mean orientation of a free segment along its initial one, ``exp(-t/tau_r)`` with tau_r of eq. (29).

    Parameters
    ----------
    time : time, number or array, not negative
    friction : SegmentFriction
    temperature : temperature, above zero
    """
    _require_friction(friction)
    time = each_not_negative(time, TIME, "time")
    return np.exp(-time / rotational_relaxation_time(friction, temperature))


def free_segment_mean_square_displacement(
    time: Numbers, friction: SegmentFriction, temperature: Scalar
) -> tuple[FloatOrArray, FloatOrArray]:
    """Mean square displacement of the centre of a free segment at any time, eq. (32), in nm^2.

    Parameters
    ----------
    time : time, number or array, not negative
    friction : SegmentFriction
    temperature : temperature, above zero

    Returns
    -------
    (parallel, perpendicular)
        Along the initial axis, and along one direction across it; each of the shape of ``time``.
    """
    _require_friction(friction)
    time = each_not_negative(time, TIME, "time")
    relaxed = -np.expm1(-3.0 * time / rotational_relaxation_time(friction, temperature))
    anisotropy = friction.rotational / 9.0 * (1.0 / friction.parallel - 1.0 / friction.perpendicular) * relaxed
    isotropic = long_time_mean_square_displacement(time, friction, temperature)
    return isotropic + 2.0 * anisotropy, isotropic - anisotropy


def short_time_mean_square_displacement(
    time: Numbers, friction: SegmentFriction, temperature: Scalar
) -> tuple[FloatOrArray, FloatOrArray]:
    """Mean square displacement of a free segment that has not turned yet, eq. (30): (parallel, perpendicular)."""
    _require_friction(friction)
    doubled = 2.0 * thermal_energy_above_zero(temperature) * each_not_negative(time, TIME, "time")
    return doubled / friction.parallel, doubled / friction.perpendicular


def long_time_mean_square_displacement(time: Numbers, friction: SegmentFriction, temperature: Scalar) -> FloatOrArray:
    """Mean square displacement of a free segment along any one direction once it has turned, eq. (31), in nm^2.

    ``(2 k_B T/3)(1/gamma_par + 2/gamma_perp) t``: the slope of (32) at long times, without its constant.
    """
    _require_friction(friction)
    time = each_not_negative(time, TIME, "time")
    mobility = (1.0 / friction.parallel + 2.0 / friction.perpendicular) / 3.0
    return 2.0 * thermal_energy_above_zero(temperature) * mobility * time


def _require_friction(friction):
    # That of a chain of beads, whose nodes have it all, moves no free segment.
    require_kind(friction, SegmentFriction, "friction")
    for name in ("parallel", "perpendicular"):
        positive(getattr(friction, name), FRICTION, f"friction: {name}")
    positive(friction.rotational, ROTATIONAL_FRICTION, "friction: rotational")
