"""Modes of open bead-spring chains: their amplitudes, rates and what couples them.

Equation numbers refer to Panja, Barkema and van Leeuwen, PRE 2015, 92, 032603. N bonds join N + 1 beads r_n, and

    R_p = sum_n phi_np r_n,    phi_np = sqrt(2/(N+1)) cos(p (n + 1/2) pi/(N+1)), phi_n0 = 1/sqrt(N+1), p = 0 ... N (26)

diagonalise all of the energy but the contour length: dR_p/dtau = -zeta_p R_p + DeltaH_p + G_p (46), exactly.
"""

import numpy as np
import scipy

from ..errors import InputError
from ..units.quantities import LENGTH, TIME, in_units_of, positive, shown, thermal_energy, whole_number
from ..units.types import FloatArray, Indices, Scalar, Vectors
from .bead_spring_type import BeadSpringType


def bead_spring_mode_amplitudes(positions: Vectors) -> FloatArray:
    """Amplitudes R_p, eq. (26): (..., beads, 3) in nm of p = 0 to N, from positions (..., beads, 3) of chains.

    R_0 is sqrt(N+1) times the centre of the beads. ``bead_spring_positions`` is the inverse.
    """
    return np.asarray(scipy.fft.dct(_vectors(positions, "positions"), type=2, norm="ortho", axis=-2))


def bead_spring_positions(amplitudes: Vectors) -> FloatArray:
    """Positions (..., beads, 3) in nm of the beads of chains whose modes have the amplitudes (..., beads, 3)."""
    return np.asarray(scipy.fft.idct(_vectors(amplitudes, "amplitudes"), type=2, norm="ortho", axis=-2))


def _vectors(values, name):
    values = np.asarray(in_units_of(values, LENGTH, name))
    if values.ndim < 2 or values.shape[-1] != 3 or values.shape[-2] < 2:
        raise InputError(f"{name} must have the shape (..., beads, 3), two beads or more, but have {values.shape}.")
    return values


def mode_shapes(bonds: int, modes: int | Indices) -> FloatArray:
    """phi_np of eq. (26): (beads, modes), for modes p from 0 to N."""
    numbers = np.atleast_1d(np.asarray(modes))
    if np.any((numbers < 0) | (numbers > bonds)):
        raise InputError(f"modes must be from 0 to the number of bonds, {bonds}, but are {shown(modes)}.")
    shapes = np.cos(np.pi / (bonds + 1) * np.outer(np.arange(bonds + 1) + 0.5, numbers))
    return np.where(numbers == 0, np.sqrt(0.5), 1.0) * np.sqrt(2.0 / (bonds + 1)) * shapes


def bead_spring_mode_rates(bead_type: BeadSpringType, bonds: int) -> tuple[FloatArray, FloatArray]:
    """Rates of the modes p = 0 to N in 1/ps: (zeta_p, zeta^l_p), two arrays (bonds + 1,).

    With s_p = sin(p pi/(2 (N+1))), in units of lambda/xi:

        zeta^l_p = 4 s_p^2 (1 - 2 nu cos(p pi/(N+1)))        (27): of stretching along a straight chain
        zeta_p = zeta^l_p - (1 - 2 nu) 4 s_p^2 = 16 nu s_p^4  (45): of bending across it
    """
    bonds = whole_number(bonds, 1, "bonds")
    square = np.sin(0.5 * np.pi * np.arange(bonds + 1) / (bonds + 1)) ** 2
    nu = bead_type.nu
    along = 4.0 * square * (1.0 - 2.0 * nu + 4.0 * nu * square)
    return 16.0 * nu * square**2 / bead_type.time_unit, along / bead_type.time_unit


def bead_spring_mode_step(
    bead_type: BeadSpringType, bonds: int, step: Scalar, temperature: Scalar
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """What one step of scheme "modes" does to all modes: decay, response and noise, three arrays (bonds + 1,).

        R_p(t + h) = exp(-zeta_p h) R_p(t) + E_p F_p(t) + w_p N(0, 1)

    with the force F_p = lambda DeltaH_p, of ``bead_spring_mode_forces``, taken to decay with zeta^l_p in the step (48):

        E_p = (exp(-zeta_p h) - exp(-zeta^l_p h))/(xi (zeta^l_p - zeta_p)), E_0 = h/xi    (49), in nm^2 mol/kJ
        w_p^2 = k_B T (1 - exp(-2 zeta_p h))/(xi zeta_p), w_0^2 = 2 k_B T h/xi            (35), w_p in nm

    Parameters
    ----------
    step : time
    """
    step = positive(step, TIME, "step")
    bending, along = bead_spring_mode_rates(bead_type, bonds)
    decay, friction = np.exp(-bending * step), bead_type.bead_friction
    with np.errstate(invalid="ignore", divide="ignore"):
        response = decay * -np.expm1(-(along - bending) * step) / (along - bending)
        noise = -np.expm1(-2.0 * bending * step) / bending
    response[0], noise[0] = step, 2.0 * step
    return decay, response / friction, np.sqrt(thermal_energy(temperature) / friction * noise)


def bead_spring_mode_forces(bead_type: BeadSpringType, positions: Vectors) -> tuple[FloatArray, FloatArray]:
    """What couples the modes of chains: (lambda DeltaH_p, lambda H_p), two arrays (..., beads, 3) in kJ/(mol nm).

    H_p is the force of the contour length, (37), all that is not linear; DeltaH_p, (44), what is left of it once the
    linear force that it has on average is in zeta_p:

        DeltaH_p = sum_n chi_np u_n (1/|u_n| - (1 - 2 nu)),    chi_np = phi_np - phi_(n-1)p

    with lengths in units of d. (chi_np = -2 sqrt(2/(N+1)) s_p sin(p n pi/(N+1)); the print of (39) lacks the minus.)

    Parameters
    ----------
    positions : (..., beads, 3) length
        Of open chains.
    """
    bonds = np.diff(_vectors(positions, "positions"), axis=-2)
    tangents = bonds / np.linalg.norm(bonds, axis=-1)[..., None]
    force = bead_type.stiffness * bead_type.natural_length
    linear = bonds / bead_type.bead_spacing
    return (
        bead_spring_mode_amplitudes(force * _on_beads(tangents - linear)),
        bead_spring_mode_amplitudes(force * _on_beads(tangents)),
    )


def _on_beads(pushes):
    # Every bond pushes its beads apart: forces (..., beads, 3) of pushes (..., bonds, 3).
    none = np.zeros_like(pushes[..., :1, :])
    return np.concatenate([none, pushes], axis=-2) - np.concatenate([pushes, none], axis=-2)
