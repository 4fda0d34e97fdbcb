"""Modes of open bead-spring chains: their shapes and rates.

Equation numbers refer to Panja, Barkema and van Leeuwen, PRE 2015, 92, 032603. N bonds join N + 1 beads r_n, and

    R_p = sum_n phi_np r_n,    phi_np = sqrt(2/(N+1)) cos(p (n + 1/2) pi/(N+1)), phi_n0 = 1/sqrt(N+1), p = 0 ... N (26)

diagonalise all of the energy but the contour length: dR_p/dtau = -zeta_p R_p + DeltaH_p + G_p (46), exactly.
"""

from __future__ import annotations

import numpy as np

from ..errors import InputError
from ..units.quantities import numbers_of, require_kind, shown, whole_number
from ..units.types import FloatArray, Indices
from .bead_spring_type import BeadSpringType

_MOST_BONDS = 10**7


def number_of_bonds(bonds: int, most: int = _MOST_BONDS) -> int:
    """A number of bonds as an int; InputError if it is none, or more than a computer can hold."""
    number = whole_number(bonds, 1, "bonds")
    if number > most:
        raise InputError(f"bonds must be at most {most:.0e}, but is {number}.")
    return number


def mode_shapes(bonds: int, modes: int | Indices) -> FloatArray:
    """phi_np of eq. (26): (beads, modes), for modes p from 0 to N."""
    numbers = np.array(numbers_of(modes, 0, "modes"), dtype=int)
    if np.any(numbers > bonds):
        raise InputError(f"modes must be from 0 to the number of bonds, {bonds}, but are {shown(modes)}.")
    shapes = np.cos(np.pi / (bonds + 1) * np.outer(np.arange(bonds + 1) + 0.5, numbers))
    return np.where(numbers == 0, np.sqrt(0.5), 1.0) * np.sqrt(2.0 / (bonds + 1)) * shapes


def bead_spring_mode_rates(bead_type: BeadSpringType, bonds: int) -> tuple[FloatArray, FloatArray]:
    """Rates of the modes p = 0 to N in 1/ps: (zeta_p, zeta^l_p), two arrays (bonds + 1,).

    With s_p = sin(p pi/(2 (N+1))), in units of lambda/xi:

        zeta^l_p = 4 s_p^2 (1 - 2 nu cos(p pi/(N+1)))        (27): of stretching along a straight chain
        zeta_p = zeta^l_p - (1 - 2 nu) 4 s_p^2 = 16 nu s_p^4  (45): of bending across it
    """
    require_kind(bead_type, BeadSpringType, "bead_type")
    bonds = number_of_bonds(bonds)
    square = np.sin(0.5 * np.pi * np.arange(bonds + 1) / (bonds + 1)) ** 2
    nu = bead_type.nu
    along = 4.0 * square * (1.0 - 2.0 * nu + 4.0 * nu * square)
    return 16.0 * nu * square**2 / bead_type.time_unit, along / bead_type.time_unit
