"""Bending and stretching potentials of a chain: energies, derivatives and OpenMM expressions.

Every potential is written once as a function of its own coordinate: the cosine ``c = t1.t2``
between neighbouring segments for bending, the segment length ``l`` for stretching.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np


@dataclass(frozen=True)
class BendingPotential:
    """Energy of a joint as a function of the cosine of the angle between its two segments.

    Attributes
    ----------
    name : str
        The name by which a FilamentType selects the potential.
    energy : callable (stiffness, cosine) -> energy
        With the stiffness K of the joint in kJ/mol: the a/l0 of the paper. It is (K/2) theta^2 for small angles
        theta, and never below 2K (theta/pi)^2: averages are taken as far as that reaches.
    derivative : callable (stiffness, cosine) -> dV/dc
    expression : str
        The same energy for OpenMM's CustomAngleForce, whose ``theta`` is pi for a straight joint.
    """

    name: str
    energy: Callable[..., Any]
    derivative: Callable[..., Any]
    expression: str


def _angle(cosine):
    return np.arccos(np.clip(cosine, -1.0, 1.0))


def _angle_over_sine(cosine):
    # theta/sin(theta) tends to 1 for a straight joint, where the quotient itself is 0/0.
    angle = _angle(cosine)
    sine = np.sin(angle)
    straight = angle < 1e-4
    return np.where(straight, 1.0 + angle**2 / 6.0, angle / np.where(straight, 1.0, np.maximum(sine, 1e-300)))


def _inverse(value):
    with np.errstate(divide="ignore"):
        return np.divide(1.0, value)


BENDING_POTENTIALS = {
    potential.name: potential
    for potential in (
        # Eq. (26) of Pesek et al. 2016.
        BendingPotential(
            name="kratky-porod",
            energy=lambda stiffness, c: stiffness * (1.0 - c),
            derivative=lambda stiffness, c: -stiffness * np.ones_like(c),
            expression="bending_stiffness*2*cos(theta/2)^2",
        ),
        # Case B of Fig. 5 of Pesek et al. 2016.
        BendingPotential(
            name="quadratic",
            energy=lambda stiffness, c: 0.5 * stiffness * _angle(c) ** 2,
            derivative=lambda stiffness, c: -stiffness * _angle_over_sine(c),
            expression=f"0.5*bending_stiffness*(theta-{np.pi!r})^2",
        ),
        # Eq. (27) of Pesek et al. 2016: curvature of the inscribed circle, which diverges for antiparallel segments.
        BendingPotential(
            name="inscribed-circle",
            energy=lambda stiffness, c: 2.0 * stiffness * (1.0 - c) * _inverse(1.0 + c),
            derivative=lambda stiffness, c: -4.0 * stiffness * _inverse(1.0 + c) ** 2,
            expression="2*bending_stiffness*(cos(theta/2)/sin(theta/2))^2",
        ),
    )
}

BOND_DIFFERENCE = "bond-difference"
"""The bending model (K/2) |u2 - u1|^2 of the vectors of two segments, which is no function of their angle alone."""
BOND_DIFFERENCE_EXPRESSION = "0.5*bending_stiffness*((x1-2*x2+x3)^2+(y1-2*y2+y3)^2+(z1-2*z2+z3)^2)"
"""Its energy for OpenMM's CustomCompoundBondForce of three nodes."""
BENDING_MODELS = (*BENDING_POTENTIALS, BOND_DIFFERENCE)


@dataclass(frozen=True)
class StretchingPotential:
    """Energy of a segment as a function of its length.

    Attributes
    ----------
    name : str
        The name by which a FilamentType selects the potential.
    energy : callable (stiffness, rest_length, maximum_extension, length) -> energy
    derivative : callable (stiffness, rest_length, maximum_extension, length) -> dV/dl
    expression : str
        The same energy for OpenMM's CustomBondForce.
    """

    name: str
    energy: Callable[..., Any]
    derivative: Callable[..., Any]
    expression: str


def _fene_energy(stiffness, rest_length, maximum_extension, length):
    relative = (length - rest_length) / maximum_extension
    with np.errstate(divide="ignore", invalid="ignore"):
        energy = -0.5 * stiffness * maximum_extension**2 * np.log1p(-(relative**2))
    return np.where(np.abs(relative) < 1.0, energy, np.inf)


def _fene_derivative(stiffness, rest_length, maximum_extension, length):
    extension = length - rest_length
    left = 1.0 - (extension / maximum_extension) ** 2
    with np.errstate(divide="ignore"):
        # Beyond the largest extension the formula turns its sign.
        return stiffness * np.divide(extension, np.maximum(left, 0.0))


STRETCHING_POTENTIALS = {
    potential.name: potential
    for potential in (
        # Eq. (7) of Pesek et al. 2016.
        StretchingPotential(
            name="harmonic",
            energy=lambda k, l0, extension, length: 0.5 * k * (length - l0) ** 2,
            derivative=lambda k, l0, extension, length: k * (length - l0),
            expression="0.5*stretching_stiffness*(r-rest_length)^2",
        ),
        # Finitely extensible: the length stays within rest_length -/+ maximum_extension.
        StretchingPotential(
            name="fene",
            energy=_fene_energy,
            derivative=_fene_derivative,
            expression=("-0.5*stretching_stiffness*maximum_extension^2*log(1-((r-rest_length)/maximum_extension)^2)"),
        ),
    )
}
