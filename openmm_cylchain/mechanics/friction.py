"""Friction of one segment: coefficients and relaxation times.

Equation numbers refer to Pesek et al., Soft Matter 2016, 12, 3360. All results are plain numbers
in OpenMM's units: friction in kJ ps/(mol nm^2), rotational friction in kJ ps/mol, time in ps.
"""

import math
from dataclasses import dataclass

from ..errors import InputError
from ..units.quantities import (
    DIMENSIONLESS,
    FRICTION,
    LENGTH,
    MASS,
    ROTATIONAL_FRICTION,
    STIFFNESS,
    TIME,
    VISCOSITY,
    finite_number,
    non_negative,
    positive,
    require_kind,
    thermal_energy,
)
from ..units.types import Scalar


@dataclass(frozen=True)
class EndCorrections:
    """End-correction constants of the friction of a cylinder, eq. (6); defaults of Table 2."""

    parallel: float = -0.114
    perpendicular: float = 0.886
    rotational: float = -0.447

    def __post_init__(self) -> None:
        for direction in ("parallel", "perpendicular", "rotational"):
            value = finite_number(getattr(self, direction), DIMENSIONLESS, f"EndCorrections: {direction}")
            object.__setattr__(self, direction, value)


@dataclass(frozen=True)
class SegmentFriction:
    """The four friction coefficients of one segment, eq. (3).

    Attributes
    ----------
    parallel, perpendicular : float
        Translation along and across the axis, kJ ps/(mol nm^2).
    rotational : float
        Rotation about an axis across the segment, kJ ps/mol.
    extensional : float
        Change of length (gamma_def in the paper), kJ ps/mol.
    """

    parallel: float
    perpendicular: float
    rotational: float
    extensional: float

    def __post_init__(self) -> None:
        for name, dimension in (
            ("parallel", FRICTION),
            ("perpendicular", FRICTION),
            ("rotational", ROTATIONAL_FRICTION),
            ("extensional", ROTATIONAL_FRICTION),
        ):
            object.__setattr__(self, name, non_negative(getattr(self, name), dimension, f"SegmentFriction: {name}"))


def _logarithm(length, diameter, correction, direction):
    value = math.log(length / diameter) + correction
    if value <= 0:
        shortest = diameter * math.exp(-correction)
        raise InputError(
            f"The {direction} friction of eq. (6) needs a length above {shortest:.4g} nm for a diameter of "
            f"{diameter:g} nm, but the length is {length:.4g} nm. Use longer segments, other end corrections, "
            "or another length in the logarithm: friction_length='filament' for that of the whole filament, or a "
            f"length over which the filament is straight, above {shortest:.4g} nm."
        )
    return value


def translational_friction_parallel(
    length: Scalar,
    diameter: Scalar,
    viscosity: Scalar,
    correction: float = -0.114,
    logarithm_length: Scalar | None = None,
) -> float:
    """Friction for translation of a cylinder along its axis, eq. (6).

    ``gamma = 2 pi eta l / (ln(L/d) + c)``, with L = l unless ``logarithm_length`` is given.

    Raises InputError if the logarithm and its correction do not add up to a positive number.
    """
    length, logarithm = _cylinder(length, diameter, correction, logarithm_length, "parallel")
    return 2.0 * math.pi * positive(viscosity, VISCOSITY, "viscosity") * length / logarithm


def translational_friction_perpendicular(
    length: Scalar,
    diameter: Scalar,
    viscosity: Scalar,
    correction: float = 0.886,
    logarithm_length: Scalar | None = None,
) -> float:
    """Friction for translation of a cylinder across its axis, eq. (6).

    ``gamma = 4 pi eta l / (ln(L/d) + c)``, with L = l unless ``logarithm_length`` is given.

    Raises InputError if the logarithm and its correction do not add up to a positive number.
    """
    length, logarithm = _cylinder(length, diameter, correction, logarithm_length, "perpendicular")
    return 4.0 * math.pi * positive(viscosity, VISCOSITY, "viscosity") * length / logarithm


def translational_frictions(
    length: Scalar, diameter: Scalar, viscosity: Scalar, corrections: EndCorrections, logarithm_length: Scalar
) -> tuple[float, float]:
    """``translational_friction_parallel`` and ``translational_friction_perpendicular``."""
    parallel = translational_friction_parallel(length, diameter, viscosity, corrections.parallel, logarithm_length)
    return parallel, translational_friction_perpendicular(
        length, diameter, viscosity, corrections.perpendicular, logarithm_length
    )


def rotational_friction(
    length: Scalar,
    diameter: Scalar,
    viscosity: Scalar,
    correction: float = -0.447,
    logarithm_length: Scalar | None = None,
) -> float:
    """Friction for rotation of a cylinder about an axis across it, eq. (6).

    ``gamma = pi eta l^3 / (3 (ln(L/d) + c))``, with L = l unless ``logarithm_length`` is given.

    Raises InputError if the logarithm and its correction do not add up to a positive number.
    """
    length, logarithm = _cylinder(length, diameter, correction, logarithm_length, "rotational")
    return math.pi * positive(viscosity, VISCOSITY, "viscosity") * length**3 / (3.0 * logarithm)


def _cylinder(length, diameter, correction, logarithm_length, direction):
    length = positive(length, LENGTH, "length")
    diameter = positive(diameter, LENGTH, "diameter")
    if logarithm_length is None:
        logarithm_length = length
    else:
        logarithm_length = positive(logarithm_length, LENGTH, "logarithm_length")
    return length, _logarithm(logarithm_length, diameter, correction, direction)


def extensional_friction(relaxation_time: Scalar, stiffness: Scalar, rest_length: Scalar, temperature: Scalar) -> float:
    """Friction for extension from the relaxation time of a segment's length, eq. (20).

    ``gamma_def = tau (k l0^2 - 4 k_B T)``

    Raises InputError if k l0^2 does not exceed 4 k_B T: the estimate (20) then has no meaning, and
    the friction must be given instead of the time.
    """
    tau = positive(relaxation_time, TIME, "extension_relaxation_time")
    stiffness = positive(stiffness, STIFFNESS, "stiffness")
    rest_length = positive(rest_length, LENGTH, "rest_length")
    energy = stiffness * rest_length**2 - 4.0 * thermal_energy(temperature)
    if energy <= 0:
        raise InputError(
            "The stretching stiffness is too small for an extension relaxation time: eq. (20) needs "
            f"k*l0^2 > 4 k_B T, but k*l0^2 = {stiffness * rest_length**2:.4g} kJ/mol. "
            "Give extensional_friction instead."
        )
    return tau * energy


def affine_extensional_friction(parallel: float, length: Scalar) -> float:
    """Friction for extension of a cylinder that deforms affinely, ``gamma_def = gamma_par l^2 / 12``.

    The parallel friction spread evenly over the segment, sum r^2 dgamma in eq. (3); the default where
    no extension relaxation time is known.
    """
    return parallel * positive(length, LENGTH, "length") ** 2 / 12.0


def stokes_friction(diameter: Scalar, viscosity: Scalar) -> float:
    """Translational friction of a sphere, 3 pi eta d, for particles outside filaments."""
    return 3.0 * math.pi * positive(viscosity, VISCOSITY, "viscosity") * positive(diameter, LENGTH, "diameter")


def rotational_friction_of_sphere(diameter: Scalar, viscosity: Scalar) -> float:
    """Rotational friction of a sphere, pi eta d^3, in kJ ps/mol."""
    return math.pi * positive(viscosity, VISCOSITY, "viscosity") * positive(diameter, LENGTH, "diameter") ** 3


def rotational_relaxation_time(friction: SegmentFriction, temperature: Scalar) -> float:
    """Relaxation time of the mean orientation of a free segment, eq. (29): gamma_rot/(2 k_B T), in ps."""
    require_kind(friction, SegmentFriction, "friction")
    kT = thermal_energy(temperature)
    if kT == 0:
        raise InputError("The rotational relaxation time is infinite at zero temperature.")
    return friction.rotational / (2.0 * kT)


def extension_relaxation_time(
    friction: SegmentFriction, stiffness: Scalar, rest_length: Scalar, temperature: Scalar
) -> float:
    """Relaxation time of the length of a segment with a harmonic potential, eq. (20), in ps."""
    stiffness = positive(stiffness, STIFFNESS, "stiffness")
    rest_length = positive(rest_length, LENGTH, "rest_length")
    energy = stiffness * rest_length**2 - 4.0 * thermal_energy(temperature)
    if energy <= 0:
        raise InputError("Eq. (20) needs k*l0^2 > 4 k_B T.")
    return friction.extensional / energy


def momentum_relaxation_times(friction: SegmentFriction, mass: Scalar, length: Scalar) -> dict[str, float]:
    """Relaxation times of a segment's momenta, eq. (51), in ps.

    Returns a dict with ``parallel`` M/gamma_par, ``perpendicular`` M/gamma_perp, ``rotational``
    M l^2/(12 gamma_rot) and ``extensional`` M l^2/(12 gamma_def). A time step must be much longer
    than each of them. (Section 5 of the paper swaps the labels of the first two.)
    """
    mass = positive(mass, MASS, "mass")
    inertia = mass * positive(length, LENGTH, "length") ** 2 / 12.0
    return {
        "parallel": mass / friction.parallel,
        "perpendicular": mass / friction.perpendicular,
        "rotational": inertia / friction.rotational,
        "extensional": inertia / friction.extensional,
    }
