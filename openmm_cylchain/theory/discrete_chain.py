"""Statistics of the free discrete chain, exact for the model that is simulated, at any stiffness."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from ..bead_spring.bead_spring_type import BEAD_BONDS, BeadSpringType
from ..bead_spring.equilibrium import (
    bead_spring_bending_energies,
    bead_spring_mean_square_end_to_end,
    bead_spring_mean_square_radius_of_gyration,
    bead_spring_persistence_length,
    bead_spring_stretching_energies,
)
from ..errors import InputError
from ..filaments.beam_elements import BEAM_ELEMENTS
from ..filaments.chain_type import ChainType, SegmentKind
from ..filaments.equilibrium import JointAngleDistribution, PlanarJointAngleDistribution, SegmentLengthDistribution
from ..filaments.filament_type import FilamentType
from ..filaments.straight_segments import STRAIGHT_SEGMENTS
from ..units.quantities import require_kind, shown, true_or_false, whole_number
from ..units.types import FloatOrArray, Scalar
from .arguments import each_whole_number, number_in_memory, require_straight_segments, thermal_energy_above_zero
from .beam_elements import (
    beam_bending_energy_mean,
    beam_mean_square_end_to_end,
    beam_persistence_length,
    beam_stretching_energy_mean,
    beam_tangent_correlation,
)
from .energies import bending_energy_mean, stretching_energy_mean


def mean_joint_cosine(filament_type: FilamentType, temperature: Scalar, planar: bool = False) -> float:
    """Mean cosine <t1.t2> between neighbouring segments of the free discrete chain, in space or in a plane; exact."""
    require_straight_segments(filament_type)
    if true_or_false(planar, "planar"):
        return float(PlanarJointAngleDistribution(filament_type, temperature).mean(np.cos))
    return float(JointAngleDistribution(filament_type, temperature).mean(lambda cosine: cosine))


def chain_tangent_correlation(
    filament_type: FilamentType, lag: npt.ArrayLike, temperature: Scalar, planar: bool = False
) -> FloatOrArray:
    """Correlation of tangents of the free discrete chain, ``<t(i).t(i+k)> = <c>^k``, exact.

    Of beam elements it is that of tangents at nodes: see ``beam_tangent_correlation``.

    Parameters
    ----------
    filament_type : FilamentType
    lag : int or array of int, not negative
        The distance k along the chain in segments.
    temperature : temperature, above zero
    planar : bool
        In a plane.
    """
    return _averages(filament_type).tangent_correlation(filament_type, lag, temperature, planar)


def _tangent_correlation(filament_type, lag, temperature, planar):
    return mean_joint_cosine(filament_type, temperature, planar) ** each_whole_number(lag, 0, "lag")


def chain_persistence_length(
    filament_type: FilamentType | BeadSpringType, temperature: Scalar, planar: bool = False
) -> float:
    """Length over which tangents of the discrete chain decorrelate in space, ``-<l>/ln<c>``, in nm; exact.

    In a plane they decorrelate over twice the persistence length, ``<t(0).t(s)> = exp(-s/2 l_p)``: it is
    ``-<l>/(2 ln<c>)`` there, with the averages of a plane.

    Of a type given by its ``persistence_length`` it is that length in space at the temperature given with it, times
    <l>/l0. Of one given by its ``bending_rigidity`` it tends to the a/(k_B T) of ``FilamentType.persistence_length_at``
    for segments that are short against it. A freely jointed chain has 0. Of beads and of beam elements, see
    ``bead_spring_persistence_length`` and ``beam_persistence_length``.
    """
    return _averages(filament_type).persistence_length(filament_type, temperature, planar)


def _persistence_length(filament_type, temperature, planar):
    planar = true_or_false(planar, "planar")
    thermal_energy_above_zero(temperature)
    if filament_type.joint_stiffness == 0:
        return 0.0
    length = SegmentLengthDistribution(filament_type, temperature, planar).mean(lambda length: length)
    if planar:
        angles = PlanarJointAngleDistribution(filament_type, temperature)
        bend = angles.mean(lambda angle: 2.0 * np.sin(0.5 * angle) ** 2)
        return float(-length / (2.0 * np.log1p(-bend)))
    bend = JointAngleDistribution(filament_type, temperature).mean(lambda cosine: 1.0 - cosine)
    return float(-length / np.log1p(-bend))


def _subchain_mean_square(filament_type, segments, temperature, planar):
    require_straight_segments(filament_type)
    # <R^2> of every run of 1 to N segments: n<l^2> + 2<l>^2 sum_k (n-k) <c>^k.
    distribution = SegmentLengthDistribution(filament_type, temperature, planar)
    mean, square = distribution.mean(lambda length: length), distribution.mean(lambda length: length**2)
    powers = mean_joint_cosine(filament_type, temperature, planar) ** np.arange(1, segments)
    pairs = np.concatenate([[0.0], np.cumsum(np.cumsum(powers))])
    return np.arange(1, segments + 1) * square + 2.0 * mean**2 * pairs


def chain_mean_square_end_to_end(
    filament_type: FilamentType | BeadSpringType, segments: int, temperature: Scalar, planar: bool = False
) -> float:
    """Mean square end-to-end distance of the free discrete chain in nm^2, exact at any stiffness.

    ``<R^2> = N <l^2> + 2 <l>^2 sum_k (N-k) <c>^k``, the averages over (19) and exp(-V_b/k_B T), or over what
    they are in a plane. Of beads, by the transfer operator; of beam elements, see ``beam_mean_square_end_to_end``.

    Parameters
    ----------
    filament_type : FilamentType or BeadSpringType
    segments : int
    temperature : temperature, above zero
    planar : bool
        In a plane.
    """
    return _averages(filament_type).mean_square_end_to_end(filament_type, segments, temperature, planar)


def _mean_square_end_to_end(filament_type, segments, temperature, planar):
    segments = number_in_memory(segments, 1, "segments")
    return float(_subchain_mean_square(filament_type, segments, temperature, planar)[-1])


def chain_mean_square_radius_of_gyration(
    filament_type: FilamentType | BeadSpringType, segments: int, temperature: Scalar, planar: bool = False
) -> float:
    """Mean square radius of gyration of the N+1 nodes of the free discrete chain in nm^2, exact.

    Every node has the same weight: ``<R_g^2> = sum over pairs <R_ij^2> / (N+1)^2``. Of beads, by the transfer operator.
    """
    return _averages(filament_type).mean_square_radius_of_gyration(filament_type, segments, temperature, planar)


def _mean_square_radius_of_gyration(filament_type, segments, temperature, planar):
    segments = number_in_memory(segments, 1, "segments")
    distances = _subchain_mean_square(filament_type, segments, temperature, planar)
    return float(np.arange(segments, 0, -1) @ distances) / (segments + 1) ** 2


def chain_mean_energies(
    filament_type: FilamentType | BeadSpringType, segments: int, temperature: Scalar, planar: bool = False
) -> tuple[float, float]:
    """Mean stretching energy of a segment, and bending energy of a joint or beam element, of the free discrete chain.

    In kJ/mol; of beads, whose energies depend on their places along the chain, their means over it.

    Parameters
    ----------
    filament_type : FilamentType or BeadSpringType
    segments : int
    temperature : temperature, above zero
    planar : bool
        In a plane.
    """
    return _averages(filament_type).mean_energies(filament_type, segments, temperature, planar)


def _mean_energies(filament_type, segments, temperature, planar):
    whole_number(segments, 1, "segments")
    bending = bending_energy_mean(filament_type, temperature, planar)
    return stretching_energy_mean(filament_type, temperature, planar), bending


def _mean_energies_of_beads(bead_type, bonds, temperature, planar):
    bending = bead_spring_bending_energies(bead_type, bonds, temperature, planar)
    stretching = bead_spring_stretching_energies(bead_type, bonds, temperature, planar)
    return stretching.mean(), bending.mean() if len(bending) else 0.0


def _mean_energies_of_beams(filament_type, elements, temperature, planar):
    bending = beam_bending_energy_mean(filament_type, temperature, planar)
    return beam_stretching_energy_mean(filament_type, elements, temperature, planar), bending


def chain_bending_mode_variance(
    filament_type: FilamentType, segments: int, mode: npt.ArrayLike, temperature: Scalar
) -> FloatOrArray:
    """Variance of the amplitude of a bending mode of the free discrete chain, in nm; exact.

    Half of <|A_n|^2> for the vector amplitude that ``analysis.bending_mode_amplitudes`` takes from the
    tangents t_i (i = 0..N-1), with L = N <l>:
    ``A_n = sqrt(2/L) (L/N) sum_i t_i cos(n pi (i + 1/2)/N)``, and <t_i.t_j> = <c>^|i-j|. It is exact at any
    stiffness; for stiff chains, where A_n is transverse, it is the variance per transverse direction and
    tends to ``l0^2 / (4 lp sin^2(n pi/(2N)))``, which for n << N is the ``bending_mode_variance`` of the WLC.

    Parameters
    ----------
    filament_type : FilamentType
    segments : int
    mode : int or array of int, from 1 to segments - 1
    temperature : temperature, above zero
    """
    require_straight_segments(filament_type)
    # All pairs of segments are in memory.
    segments, modes = _bending_modes(number_in_memory(segments, 2, "segments", 10**4), mode)
    cosines = np.cos(np.multiply.outer(modes, np.pi * (np.arange(segments) + 0.5) / segments))
    lag = np.abs(np.subtract.outer(np.arange(segments), np.arange(segments)))
    bend = JointAngleDistribution(filament_type, temperature).mean(lambda cosine: 1.0 - cosine)
    # The cosines of a mode sum to zero, so <c>^k - 1 serves as well as <c>^k and keeps the digits of stiff chains.
    decorrelation = -np.ones(lag.shape) if bend >= 1.0 else np.expm1(lag * np.log1p(-bend))
    np.fill_diagonal(decorrelation, 0.0)
    length = SegmentLengthDistribution(filament_type, temperature).mean(lambda length: length)
    return np.einsum("...i,ij,...j->...", cosines, decorrelation, cosines)[()] * length / segments


def chain_planar_bending_mode_variance(
    filament_type: FilamentType, segments: int, mode: npt.ArrayLike, temperature: Scalar
) -> FloatOrArray:
    """Variance of the amplitude of a bending mode of the free discrete chain in a plane, in nm; exact.

    For the amplitude ``a_n = sqrt(2/L) l0 sum_i theta_i cos(n pi (i + 1/2)/N)`` of the tangent angles theta_i (i =
    0..N-1, L = N l0), which are sums of independent joint angles theta,

        <a_n^2> = l0 <theta^2>/(4 sin^2(n pi/(2N)))

    For n << N and stiff joints it is the ``bending_mode_variance`` of the WLC.

    Parameters
    ----------
    filament_type : FilamentType
    segments : int
    mode : int or array of int, from 1 to segments - 1
    temperature : temperature, above zero
    """
    require_straight_segments(filament_type)
    segments, modes = _bending_modes(segments, mode)
    square = PlanarJointAngleDistribution(filament_type, temperature).mean(lambda angle: angle**2)
    return filament_type.segment_length * square / (4.0 * np.sin(0.5 * np.pi * modes / segments) ** 2)


def _bending_modes(segments, mode):
    segments = whole_number(segments, 2, "segments")
    modes = each_whole_number(mode, 1, "mode")
    if np.any(np.asarray(modes) >= segments):
        raise InputError(f"mode must be below the number of segments, {segments}, but is {shown(mode)}.")
    return segments, modes


@dataclass(frozen=True)
class _Averages:
    # Of free chains of one kind of segments; those of straight ones refuse what there is no closed form of.
    persistence_length: Callable[..., Any]
    mean_square_end_to_end: Callable[..., Any]
    mean_energies: Callable[..., Any]
    tangent_correlation: Callable[..., Any] = _tangent_correlation
    mean_square_radius_of_gyration: Callable[..., Any] = _mean_square_radius_of_gyration


_AVERAGES: dict[SegmentKind, _Averages] = {
    STRAIGHT_SEGMENTS: _Averages(_persistence_length, _mean_square_end_to_end, _mean_energies),
    BEAM_ELEMENTS: _Averages(
        beam_persistence_length,
        beam_mean_square_end_to_end,
        _mean_energies_of_beams,
        tangent_correlation=beam_tangent_correlation,
    ),
    BEAD_BONDS: _Averages(
        bead_spring_persistence_length,
        bead_spring_mean_square_end_to_end,
        _mean_energies_of_beads,
        mean_square_radius_of_gyration=bead_spring_mean_square_radius_of_gyration,
    ),
}


def _averages(filament_type: ChainType) -> _Averages:
    require_kind(filament_type, ChainType, "filament_type")
    return _AVERAGES[filament_type.segment_kind]
