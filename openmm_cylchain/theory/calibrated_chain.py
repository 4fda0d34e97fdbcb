"""Chains of segments that extend and turn under force as the continuous wormlike chain does."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache

import numpy as np
import scipy

from ..errors import InputError
from ..filaments.filament_type import FilamentType
from ..units.quantities import DIMENSIONLESS, FORCE, PICONEWTON, positive
from ..units.types import Scalar
from .arguments import thermal_energy_above_zero
from .force_extension import long_chain_extension, require_not_calibrated, wlc_relative_extension
from .twisted_chain import twisted_chain

_FORCES, _TABLE = 14, 60
_WEAKEST = 0.02
"""In k_B T/lp: under less, the extension is in proportion to the force."""
_STRAIGHTENED = 10.0
"""In k_B T/lp: from there on, C_eff is known, since bends are small."""
_BOUNDS = ((0.5, 1.1), (0.5, 2.0), (0.2, 4.0))
"""Of the rest length, the rigidity and the stiffness of a segment, over those that only cutting gives."""


def calibrated_up_to_force(
    filament_type: FilamentType, force: Scalar, temperature: Scalar, within: Scalar = 0.01
) -> FilamentType:
    """A type whose long chain follows the extensible wormlike chain under all forces up to one, within 1 %.

    A segment stands for a length b of the filament, ``contour_per_segment``, whose own bends it does not have. Instead,
    its rest length l0 is shorter, it stretches with another stiffness, and joints bend with another one: such that of
    the forces f up to F the largest relative error is as small as it can be,

        long_chain_extension(calibrated, f) = b wlc_relative_extension(f (1 - error), lp, T, EA).

    The relative error of the extension is that times d ln z/d ln f: equal under weak forces, a thirtieth at 20 pN. Of a
    type with twist, C of the joints is such that C_eff is, as nearly as can be, that of the continuous filament, 1/C +
    k_B T/(4 A (A f)^(1/2)) with A = lp k_B T (Moroz and Nelson 1997), from 10 k_B T/lp to F. N segments are N b of the
    filament.

    Of ``DSDNA``, the largest errors of the force are

    ======== =============== =============== ===============
    segments up to 5 pN      up to 10 pN     up to 20 pN
    ======== =============== =============== ===============
    8 nm     1.7 %           1.7 %           2.8 %
    6 nm     0.6 %           0.9 %           1.7 %
    5 nm     0.3 %           0.6 %           1.2 %
    4 nm     0.2 %           0.4 %           0.7 %
    3 nm     0.1 %           0.2 %           0.4 %
    2 nm     0.04 %          0.1 %           0.2 %
    ======== =============== =============== ===============

    Parameters
    ----------
    filament_type : FilamentType
        Of straight segments with harmonic lengths, as it is cut.
    force : force, above zero
        F.
    temperature : temperature, above zero
    within : number
        The largest error that is allowed.

    Returns
    -------
    FilamentType

    Raises
    ------
    InputError
        For beads, beam elements, FENE lengths, a type that does not bend or is calibrated already, and where segments
        are too long for the force: the error then says how near they come.
    """
    require_not_calibrated(filament_type)
    name = f"Filament type {filament_type.name!r}"
    force, kT = positive(force, FORCE, "force"), thermal_energy_above_zero(temperature)
    allowed = positive(within, DIMENSIONLESS, "within")
    if filament_type.maximum_extension is not None or filament_type.bending_rigidity == 0.0:
        raise InputError(f"{name}: FENE lengths, or joints that do not bend back, are those of no wormlike chain.")
    length, stiffness = filament_type.segment_length, filament_type.segment_stiffness
    persistence_length = filament_type.persistence_length_at(temperature)
    forces = np.geomspace(min(_WEAKEST * kT / persistence_length, 0.1 * force), force, _FORCES)
    # The wormlike chain's forces by its extensions.
    table = np.geomspace(0.5 * forces[0], 2.0 * force, _TABLE)
    extensions = length * wlc_relative_extension(table, persistence_length, temperature, stiffness * length)
    logarithm = scipy.interpolate.CubicSpline(extensions, np.log(table))

    def changed(factors):
        rest, rigidity, spring = factors
        return replace(
            filament_type,
            segment_length=rest * length,
            bending_rigidity=rest * rigidity * filament_type.bending_rigidity,
            stretching_modulus=None,
            stretching_stiffness=spring * stiffness,
            contour_per_segment=length,
            calibrated_force=force,
        )

    def errors(factors):
        return np.log(forces) - logarithm(long_chain_extension(changed(factors), forces, temperature))

    factors, largest = _least_largest(errors, 1.0 - length / (6.0 * persistence_length))
    if largest > allowed:
        raise InputError(
            f"{name}: chains of segments of {length:g} nm follow the wormlike chain up to {force / PICONEWTON:.3g} pN "
            f"within {100 * largest:.2g} % of the force, but {100 * allowed:g} % are allowed. Take shorter segments, "
            "a smaller force, or a larger 'within'."
        )
    kind = changed(factors)
    return kind if kind.torsional_rigidity is None else _turning(kind, persistence_length, force, temperature)


def _least_largest(errors, rest):
    # Factors of rest length, rigidity and stiffness with the smallest largest error, over that error.
    scales = np.array([0.01, 0.02, 0.1])
    start = np.array([math.log(max(rest, 0.9)), 0.0, 0.0])
    bounds = [tuple((np.log(bound) - here) / scale) for bound, here, scale in zip(_BOUNDS, start, scales)]

    @cache
    def percent(*point):
        return 100.0 * errors(np.exp(start + scales * point))

    def margins(unknowns):
        own = percent(*unknowns[:3])
        return np.concatenate([unknowns[3] - own, unknowns[3] + own])

    found = scipy.optimize.minimize(
        lambda unknowns: unknowns[3],
        [0.0, 0.0, 0.0, np.abs(percent(0.0, 0.0, 0.0)).max()],
        jac=lambda unknowns: np.array([0.0, 0.0, 0.0, 1.0]),
        bounds=[*bounds, (0.0, None)],
        constraints={"type": "ineq", "fun": margins},
        method="SLSQP",
        options={"ftol": 1e-4, "eps": 1e-4},
    )
    return np.exp(start + scales * found.x[:3]), 0.01 * float(np.abs(percent(*found.x[:3])).max())


def _turning(kind, persistence_length, force, temperature):
    kT, length = thermal_energy_above_zero(temperature), kind.contour_per_segment
    weakest = min(_STRAIGHTENED * kT / persistence_length, force)
    forces = np.geomspace(weakest, force, _FORCES)
    rigidity = kind.torsional_rigidity
    wanted = kT / rigidity + 0.25 * (kT / forces) ** 0.5 * persistence_length**-1.5
    twist = kT * kind.segment_length / (rigidity * length)
    chain = [twisted_chain(kind, one, 0.0, temperature).effective_torsional_rigidity for one in forces]
    missing = wanted - kT * kind.segment_length / (length * np.array(chain))
    compliance = twist + 0.5 * (missing.max() + missing.min())
    return replace(kind, torsional_rigidity=kT * kind.segment_length / (length * compliance))
