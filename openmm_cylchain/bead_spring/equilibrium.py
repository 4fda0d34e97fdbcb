"""Exact equilibrium of free bead-spring chains, by their transfer operator, at any stiffness and temperature.

Chains are open, with their short end bonds, and have any number of bonds N; there are N + 1 beads. Arguments are
``openmm.unit`` quantities or plain numbers in OpenMM's units; results are plain numbers or arrays in nm and kJ/mol.
"""

from __future__ import annotations

import numpy as np

from ..errors import InputError
from ..units.quantities import TEMPERATURE, numbers_of, positive, shown, true_or_false
from ..units.types import FloatArray, Indices, Scalar
from .bead_spring_type import BeadSpringType
from .modes import mode_shapes, number_of_bonds
from .transfer_operator import TransferOperator, transfer_operator

_MOST_BONDS_OF_PAIRS = 10**4


def _operator(bead_type, bonds, temperature, planar):
    if not isinstance(bead_type, BeadSpringType):
        raise InputError(f"This is for a BeadSpringType, such as DSDNA_BASE_PAIRS, but not for {shown(bead_type)}.")
    bonds, planar = number_of_bonds(bonds), true_or_false(planar, "planar")
    reduced = bead_type.reduced_temperature(positive(temperature, TEMPERATURE, "temperature"))
    return transfer_operator(bead_type.nu, reduced, bonds, 2 if planar else 3)


def bead_spring_mean_lengths(
    bead_type: BeadSpringType, bonds: int, temperature: Scalar, planar: bool = False
) -> FloatArray:
    """Mean lengths <|u_n|> of all bonds: (bonds,) in nm.

    Parameters
    ----------
    bead_type : BeadSpringType
    bonds : int
    temperature : temperature, above zero
    planar : bool
        In a plane.
    """
    operator = _operator(bead_type, bonds, temperature, planar)
    return bead_type.natural_length * operator.means(lambda length: length)[0]


def bead_spring_mean_square_lengths(
    bead_type: BeadSpringType, bonds: int, temperature: Scalar, planar: bool = False
) -> FloatArray:
    """Mean squares <u_n^2> of all bonds: (bonds,) in nm^2; see ``bead_spring_mean_lengths``."""
    operator = _operator(bead_type, bonds, temperature, planar)
    return bead_type.natural_length**2 * operator.means(np.square)[0]


def bead_spring_bond_correlations(
    bead_type: BeadSpringType, bonds: int, temperature: Scalar, planar: bool = False
) -> FloatArray:
    """Covariances <u_i.u_j> of all pairs of bonds: (bonds, bonds) in nm^2, in a time that grows as bonds^2."""
    bonds = number_of_bonds(bonds, _MOST_BONDS_OF_PAIRS)
    operator = _operator(bead_type, bonds, temperature, planar)
    correlations = np.diag(operator.means(np.square)[0])
    for bond in range(operator.bonds - 1):
        correlations[bond, bond + 1 :] = correlations[bond + 1 :, bond] = operator.correlations(bond)
    return bead_type.natural_length**2 * correlations


def bead_spring_mean_square_end_to_end(
    bead_type: BeadSpringType, bonds: int, temperature: Scalar, planar: bool = False
) -> float:
    """Mean square end-to-end distance <|r_N - r_0|^2> in nm^2; see ``bead_spring_mean_lengths``."""
    operator = _operator(bead_type, bonds, temperature, planar)
    return float(bead_type.natural_length**2 * _mean_squares(operator, np.ones((operator.bonds, 1)))[0])


def bead_spring_mean_square_distances_from_center(
    bead_type: BeadSpringType,
    bonds: int,
    temperature: Scalar,
    planar: bool = False,
    beads: int | Indices | None = None,
) -> FloatArray:
    """Mean squares <|r_n - R|^2> in nm^2 of the distances of beads from the centre R of all beads.

    Parameters
    ----------
    bead_type, bonds, temperature, planar
        See ``bead_spring_mean_lengths``.
    beads : sequence of int, optional
        Which, from 0 to bonds; all of them if not given.
    """
    operator = _operator(bead_type, bonds, temperature, planar)
    count = operator.bonds + 1
    chosen = np.arange(count) if beads is None else np.array(numbers_of(beads, 0, "beads"), dtype=int)
    if np.any(chosen >= count):
        raise InputError(f"beads must be from 0 to {count - 1}, but are {shown(beads)}.")
    bond = np.arange(1, count)[:, None]
    weights = (bond <= chosen).astype(float) - (count - bond) / count
    return bead_type.natural_length**2 * _mean_squares(operator, weights)


def bead_spring_mean_square_radius_of_gyration(
    bead_type: BeadSpringType, bonds: int, temperature: Scalar, planar: bool = False
) -> float:
    """Mean square radius of gyration of the N + 1 beads in nm^2; see ``bead_spring_mean_lengths``."""
    operator = _operator(bead_type, bonds, temperature, planar)
    count = operator.bonds + 1
    # The sum over all pairs of bonds of min(i, j) (N + 1 - max(i, j)) <u_i.u_j>.
    before = np.arange(1.0, count)[:, None]
    behind = count - before
    squares = (before * behind).T @ operator.means(np.square)[0]
    total = squares + 2.0 * operator.correlation_sum(before, behind)
    return float(bead_type.natural_length**2 * total[0]) / count**2


def bead_spring_mode_variances(
    bead_type: BeadSpringType, bonds: int, modes: int | Indices, temperature: Scalar, planar: bool = False
) -> FloatArray:
    """Mean squares <|R_p|^2> in nm^2 of the amplitudes of modes p >= 1, R_p = sum_n phi_np r_n, eq. (26).

    All components together: three times k_B T/(lambda zeta_p) is what they would be without a coupling of modes.
    """
    operator = _operator(bead_type, bonds, temperature, planar)
    shapes = mode_shapes(operator.bonds, modes)
    # r_n - R is a sum of bonds, and so is an amplitude: - sum_n u_n sum_(m < n) phi_m.
    return bead_type.natural_length**2 * _mean_squares(operator, -np.cumsum(shapes, axis=0)[:-1])


def _mean_squares(operator: TransferOperator, weights: FloatArray) -> FloatArray:
    # <|sum_n w_n u_n|^2> for the columns of (bonds, sums) weights.
    return (weights**2).T @ operator.means(np.square)[0] + 2.0 * operator.correlation_sum(weights, weights)


def bead_spring_stretching_energies(
    bead_type: BeadSpringType, bonds: int, temperature: Scalar, planar: bool = False
) -> FloatArray:
    """Mean stretching energies of all bonds: (bonds,) in kJ/mol, as of ``BeadSpringType.stretching_energies``."""
    operator = _operator(bead_type, bonds, temperature, planar)
    mean, square = operator.means(lambda length: length, np.square)
    rest = bead_type.segment_lengths(operator.bonds) / bead_type.natural_length
    extension = square - 2.0 * rest * mean + rest**2
    return 0.5 * bead_type.segment_stiffnesses(operator.bonds) * bead_type.natural_length**2 * extension


def bead_spring_bending_energies(
    bead_type: BeadSpringType, bonds: int, temperature: Scalar, planar: bool = False
) -> FloatArray:
    """Mean bending energies (kappa/2) <|u_(n+1) - u_n|^2> of all joints: (bonds - 1,) in kJ/mol."""
    operator = _operator(bead_type, bonds, temperature, planar)
    squares = operator.means(np.square)[0]
    differences = squares[1:] + squares[:-1] - 2.0 * operator.neighbor_correlations()
    return 0.5 * bead_type.bending_stiffness * bead_type.natural_length**2 * differences


def bead_spring_persistence_length(bead_type: BeadSpringType, temperature: Scalar, planar: bool = False) -> float:
    """Length over which <u_i.u_j> falls by 1/e in the middle of a long chain, in nm: so many bonds times a.

    In a plane, half of it, since ``<t(0).t(s)> = exp(-s/2 l_p)`` there.
    From the largest eigenvalues of the transfer operator. It is shorter than l_p = kappa a^3/(k_B T), eq. (3), by the
    order of a: 112.7 a of ``DSDNA_BASE_PAIRS``, where l_p is 114.4 a.
    """
    operator = _operator(bead_type, 1, temperature, planar)
    length = bead_type.bead_spacing * operator.correlation_length()
    return 0.5 * length if planar else length
