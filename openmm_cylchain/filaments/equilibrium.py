"""Exact equilibrium of the discrete chain: marginals of segment lengths and joint angles, and draws.

In node coordinates the equilibrium is exp(-V/k_B T). With l0, not l, in the bending potential, segment
lengths and joint angles are independent,

    rho(l) ~ l^2 exp(-V_el(l)/k_B T)        eq. (19) of Pesek et al., Soft Matter 2016, 12, 3360
    rho(c) ~ exp(-V_b(c)/k_B T)             c = t1.t2 in [-1, 1]

and the azimuth of every joint is uniform, so every average below is exact at any stiffness. For filaments that move
in a plane,

    rho(l) ~ l exp(-V_el(l)/k_B T)
    rho(theta) ~ exp(-V_b(cos theta)/k_B T)         theta in (-pi, pi)
"""

from collections.abc import Callable
from functools import cached_property, lru_cache
from typing import Protocol

import numpy as np
import numpy.typing as npt
import scipy

from ..mechanics.geometry import directions_across
from ..units.quantities import TEMPERATURE, positive, thermal_energy, true_or_false
from ..units.types import FloatArray, FloatOrArray, Scalar

_GRID = 20001


class IndependentJoints(Protocol):
    """A chain whose segments are alike and whose bending energy depends on the angle alone: a ``FilamentType``."""

    @property
    def segment_length(self) -> float: ...

    @property
    def segment_stiffness(self) -> float: ...

    @property
    def maximum_extension(self) -> float | None: ...

    @property
    def joint_stiffness(self) -> float: ...

    def __hash__(self) -> int: ...

    def stretching_energy(self, length: npt.ArrayLike) -> FloatOrArray: ...

    def bending_energy(self, cosine: npt.ArrayLike, stiffness: npt.ArrayLike | None = None) -> FloatOrArray: ...


class _Marginal:
    """A density exp(log_density) on a grid fine enough for both averages and draws."""

    def __init__(self, coordinate: FloatArray, log_density: FloatArray) -> None:
        weight = np.exp(log_density - np.max(log_density))
        spacing = np.diff(coordinate)
        cumulative = np.concatenate([[0.0], np.cumsum(0.5 * (weight[1:] + weight[:-1]) * spacing)])
        self._coordinate = coordinate
        self._weight = weight
        self._cumulative = cumulative / cumulative[-1]

    @property
    def coordinate(self) -> FloatArray:
        """The grid."""
        return self._coordinate

    def mean(self, function: Callable[[FloatArray], npt.ArrayLike]) -> float:
        """Average of ``function`` (of the coordinate) by Simpson's rule."""
        return float(self._share @ np.where(self._weight > 0, function(self._coordinate), 0.0))

    def legendre_means(self, count: int) -> FloatArray:
        """Averages of the Legendre polynomials P_0 to P_(count-1) of the coordinate."""
        means, before, polynomial = np.empty(count), np.zeros(_GRID), np.ones(_GRID)
        for order in range(count):
            means[order] = self._share @ polynomial
            following = ((2 * order + 1) * self._coordinate * polynomial - order * before) / (order + 1)
            before, polynomial = polynomial, following
        return means

    @cached_property
    def _share(self) -> FloatArray:
        # Of each point of the grid in averages. Where the spacing is lost to rounding, there is nothing between points.
        first, second = np.diff(self._coordinate)[::2], np.diff(self._coordinate)[1::2]
        both = first + second
        with np.errstate(divide="ignore", invalid="ignore"):
            parts = [2.0 - second / first, both**2 / (first * second), 2.0 - first / second]
        share = np.zeros(_GRID)
        for start, part in enumerate(parts):
            share[start : start + _GRID - 2 : 2] += both * np.where(np.isfinite(part), part, 0.0)
        share *= self._weight
        return share / share.sum()

    def sample(self, generator: np.random.Generator, size: int) -> FloatArray:
        """Independent draws by inversion of the cumulative distribution."""
        return self.quantile(generator.random(size))

    def quantile(self, probability: FloatArray) -> FloatArray:
        """Where the cumulative distribution has the given values."""
        return np.interp(probability, self._cumulative, self._coordinate)


def _grid(low, high):
    # Dense towards both ends, where potentials diverge within a narrow layer.
    return low + (high - low) * 0.5 * (1.0 - np.cos(np.linspace(0.0, np.pi, _GRID)))


class SegmentLengthDistribution(_Marginal):
    """Equilibrium distribution of the length of a segment, eq. (19): rho(l) ~ l^2 exp(-V_el/k_B T).

    In a plane, it is rho(l) ~ l exp(-V_el/k_B T). The temperature is above zero.
    """

    def __init__(self, filament_type: IndependentJoints, temperature: Scalar, planar: bool = False) -> None:
        planar = true_or_false(planar, "planar")
        kT = thermal_energy(positive(temperature, TEMPERATURE, "temperature"))
        rest, stiffness = filament_type.segment_length, filament_type.segment_stiffness
        if filament_type.maximum_extension is not None:
            extension = filament_type.maximum_extension * (1.0 - 1e-12)
            low, high = rest - extension, rest + extension
        else:
            low, high = 0.0, np.inf
        # Twelve standard deviations about the most probable length leave out less than 1e-30.
        width = np.sqrt(kT / stiffness)
        power = 1.0 if planar else 2.0
        mode = 0.5 * (rest + np.sqrt(rest**2 + 4.0 * power * width**2))
        length = _grid(max(low, mode - 12.0 * width), min(high, mode + 12.0 * width))
        with np.errstate(divide="ignore"):
            super().__init__(length, power * np.log(length) - filament_type.stretching_energy(length) / kT)


class JointAngleDistribution(_Marginal):
    """Equilibrium distribution of the cosine c = t1.t2 of a joint: rho(c) ~ exp(-V_b/k_B T) on [-1, 1].

    The stiffness is in kJ/mol; it is the type's if not given.
    """

    def __init__(
        self, filament_type: IndependentJoints, temperature: Scalar, joint_stiffness: float | None = None
    ) -> None:
        kT = thermal_energy(positive(temperature, TEMPERATURE, "temperature"))
        joint_stiffness = filament_type.joint_stiffness if joint_stiffness is None else joint_stiffness
        cosine = _grid(1.0 - _widest_bend(joint_stiffness / kT), 1.0)
        with np.errstate(divide="ignore", over="ignore"):
            super().__init__(cosine, -np.asarray(filament_type.bending_energy(cosine, joint_stiffness)) / kT)


class PlanarJointAngleDistribution(_Marginal):
    """Equilibrium distribution of the angle of a joint in a plane: rho(theta) ~ exp(-V_b/k_B T) on [-pi, pi].

    The stiffness is in kJ/mol; it is the type's if not given.
    """

    def __init__(
        self, filament_type: IndependentJoints, temperature: Scalar, joint_stiffness: float | None = None
    ) -> None:
        kT = thermal_energy(positive(temperature, TEMPERATURE, "temperature"))
        joint_stiffness = filament_type.joint_stiffness if joint_stiffness is None else joint_stiffness
        widest = np.arccos(1.0 - _widest_bend(joint_stiffness / kT))
        angle = _grid(-widest, widest)
        with np.errstate(divide="ignore", over="ignore"):
            super().__init__(angle, -np.asarray(filament_type.bending_energy(np.cos(angle), joint_stiffness)) / kT)


class BentJointDistribution(_Marginal):
    """Equilibrium distribution of the cosine of a joint with a bend at rest, for frames that rest.

    With the sizes k of R k (see ``RestBends``) and b of the bend, and the Bessel function I0, it is

        rho(c) ~ exp(-K (b^2 + k^2)/2 k_B T) I0(K b k/k_B T)

    on [-1, 1]. The angle from R k to b has the von Mises distribution with the concentration K b k/k_B T.
    """

    def __init__(
        self, filament_type: IndependentJoints, temperature: Scalar, joint_stiffness: float, rest_bend: float
    ) -> None:
        kT = thermal_energy(positive(temperature, TEMPERATURE, "temperature"))
        self._size_of = lambda cosine: np.sqrt(2.0 * np.asarray(filament_type.bending_energy(cosine, 1.0)))
        self._concentration_of_size = joint_stiffness * rest_bend / kT
        widest = 0.5 * (rest_bend + np.sqrt(2.0 * _widest_bend(joint_stiffness / kT))) ** 2
        cosine = _grid(1.0 - min(2.0, widest), 1.0)
        with np.errstate(divide="ignore", over="ignore"):
            size = self._size_of(cosine)
            weight = -0.5 * joint_stiffness / kT * (size - rest_bend) ** 2
            super().__init__(
                cosine, weight + np.log(scipy.special.i0e(self._concentration_of_size * np.minimum(size, 1e150)))
            )

    def concentration(self, cosine: float) -> float:
        """That of the angle from R k to the bend."""
        return float(self._concentration_of_size * self._size_of(cosine))


def _widest_bend(stiffness):
    # V_b is at least K (1-c)*0.8, so 1-c up to 60 k_B T/K holds all of a stiff joint.
    return 2.0 if stiffness < 50.0 else min(2.0, 100.0 / stiffness)


@lru_cache(maxsize=32)
def _length_distribution(filament_type, temperature, planar):
    return SegmentLengthDistribution(filament_type, temperature, planar)


@lru_cache(maxsize=32)
def _angle_distribution(filament_type, temperature, planar, joint_stiffness):
    kind = PlanarJointAngleDistribution if planar else JointAngleDistribution
    return kind(filament_type, temperature, joint_stiffness)


def _draw_joints(filament_type, temperature, generator, planar, stiffnesses):
    # Angles of all joints in a plane, cosines in space.
    probability = generator.random(len(stiffnesses))
    drawn = np.empty(len(stiffnesses))
    for stiffness in np.unique(stiffnesses):
        chosen = stiffnesses == stiffness
        distribution = _angle_distribution(filament_type, temperature, planar, float(stiffness))
        drawn[chosen] = distribution.quantile(probability[chosen])
    return drawn


def draw_chain(
    filament_type: IndependentJoints,
    segments: int,
    temperature: Scalar,
    generator: np.random.Generator,
    start: npt.ArrayLike = (0.0, 0.0, 0.0),
    direction: FloatArray | None = None,
    planar: bool = False,
    stiffnesses: FloatArray | None = None,
) -> FloatArray:
    """See ``ChainType.draw_chain``."""
    lengths = _length_distribution(filament_type, temperature, planar).sample(generator, segments)
    if stiffnesses is None:
        stiffnesses = np.full(segments - 1, filament_type.joint_stiffness)
    joints = _draw_joints(filament_type, temperature, generator, planar, stiffnesses)
    draw = _tangents_in_plane if planar else _tangents_in_space
    steps = lengths[:, None] * draw(joints, generator, direction)
    return np.asarray(start, dtype=float) + np.concatenate([np.zeros((1, 3)), np.cumsum(steps, axis=0)])


def _tangents_in_plane(angles, generator, direction):
    first = generator.uniform(-np.pi, np.pi) if direction is None else np.arctan2(direction[1], direction[0])
    angle = first + np.concatenate([[0.0], np.cumsum(angles)])
    return np.stack([np.cos(angle), np.sin(angle), np.zeros_like(angle)], axis=1)


def _tangents_in_space(cosines, generator, direction):
    azimuths = generator.uniform(0.0, 2.0 * np.pi, len(cosines))
    if direction is None:
        direction = generator.normal(size=3)
    tangent = np.asarray(direction, dtype=float) / np.linalg.norm(direction)
    # Rows of a frame are the tangent, the normal and the binormal; each joint turns it in its own axes.
    sines = np.sqrt((1.0 - cosines) * (1.0 + cosines))
    along, across, none = np.cos(azimuths), np.sin(azimuths), np.zeros(len(azimuths))
    turns = [cosines, sines * along, sines * across, -sines, cosines * along, cosines * across, none, -across, along]
    frame = np.stack([tangent, *directions_across(tangent)])
    tangents = np.empty((len(cosines) + 1, 3))
    tangents[0] = tangent
    for joint, turn in enumerate(np.stack(turns, axis=1).reshape(-1, 3, 3)):
        frame = turn @ frame
        tangents[joint + 1] = frame[0]
    return tangents / np.linalg.norm(tangents, axis=1, keepdims=True)
