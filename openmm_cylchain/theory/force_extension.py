"""Force and extension: of the wormlike chain, of the discrete chain, and spring constants of chains under tension."""

from __future__ import annotations

import math

import numpy as np
import scipy

from ..errors import InputError
from ..filaments.equilibrium import JointAngleDistribution
from ..filaments.filament_type import FilamentType
from ..mechanics.quadrature import gauss_points
from ..units.quantities import DIMENSIONLESS, FORCE, LENGTH, STIFFNESS, in_units_of, positive, whole_number
from ..units.types import FloatOrArray, Numbers, Scalar
from .arguments import each_not_negative, number_in_memory, require_straight_segments, thermal_energy_above_zero

_MOST_DIRECTIONS = 1500
"""In which segments are looked at: matrices of so many rows are inverted within seconds."""


def marko_siggia_force(relative_extension: Numbers, persistence_length: Scalar, temperature: Scalar) -> FloatOrArray:
    """Force that holds a WLC at a relative extension, eq. (34), in kJ/(mol nm).

    ``F = k_B T/lp (1/(4(1-z)^2) - 1/4 + z)``, z = <R.e>/L: the interpolation of Marko and Siggia, within some
    10 % of the exact WLC between its limits.

    Parameters
    ----------
    relative_extension : number or array in [0, 1)
    persistence_length : length, above zero
    temperature : temperature, above zero
    """
    extension = each_not_negative(relative_extension, DIMENSIONLESS, "relative_extension")
    if np.any(np.asarray(extension) >= 1.0):
        raise InputError("relative_extension must be below 1: eq. (34) is for an inextensible chain.")
    scale = thermal_energy_above_zero(temperature) / positive(persistence_length, LENGTH, "persistence_length")
    return scale * _reduced_force(extension)


def _reduced_force(extension):
    return extension + extension * (2.0 - extension) / (4.0 * (1.0 - extension) ** 2)


def marko_siggia_extension(force: Numbers, persistence_length: Scalar, temperature: Scalar) -> FloatOrArray:
    """Relative extension <R.e>/L of a WLC under a force, the inverse of eq. (34); accurate to rounding.

    Parameters
    ----------
    force : force, number or array, not negative
    persistence_length : length, above zero
    temperature : temperature, above zero
    """
    scale = positive(persistence_length, LENGTH, "persistence_length") / thermal_energy_above_zero(temperature)
    reduced = np.asarray(each_not_negative(force, FORCE, "force") * scale)
    weak = np.minimum(reduced, 1.0)
    root = np.sqrt(4.0 * weak + 1.0)
    # Both starting points lie beyond the root of a convex function, from where Newton's method cannot overshoot.
    extension = np.minimum(2.0 * weak / 3.0, 4.0 * weak / (4.0 * weak + 1.0 + root))
    strong = np.maximum(reduced, 1.0)
    slack = 1.0 / np.sqrt(4.0 * strong - 3.0)
    for _ in range(12):
        slope = 1.0 + 0.5 / (1.0 - extension) ** 3
        extension = extension - (_reduced_force(extension) - weak) / slope
        value = slack**2 * (4.0 * slack + 4.0 * strong - 3.0) - 1.0
        slack = slack - value / (12.0 * slack**2 + 2.0 * slack * (4.0 * strong - 3.0))
    return np.where(reduced <= 1.0, extension, 1.0 - slack)[()]


def chain_extension(filament_type: FilamentType, segments: int, force: Numbers, temperature: Scalar) -> FloatOrArray:
    """Mean extension <R.e> in nm of the discrete chain whose ends are pulled apart by a constant force F e; exact.

    By transfer: with ``g(c) = int l^2 exp(-V_el/k_B T + F l c/k_B T) dl`` for a segment at the cosine c to e, and the
    bending weight ``exp(-V_b/k_B T)`` of two neighbours averaged over their azimuth, Z is a product of N - 1 integrals
    over c and ``<R.e> = k_B T d ln Z/dF``. A freely jointed chain has N times the mean of l (coth u - 1/u) with the
    weight ``l^2 exp(-V_el/k_B T) sinh(u)/u``, u = F l/k_B T.

    Parameters
    ----------
    filament_type : FilamentType
    segments : int
    force : force, number or array, not negative
    temperature : temperature, above zero
    """
    require_straight_segments(filament_type)
    # One product after another: of longer chains, N times ``long_chain_extension`` is as good.
    segments = number_in_memory(segments, 1, "segments", 10**5)
    kT = thermal_energy_above_zero(temperature)
    forces = np.asarray(each_not_negative(force, FORCE, "force")) / kT
    bending = _bending_transfer(filament_type, temperature, float(np.max(forces, initial=0.0)))
    return np.vectorize(lambda each: _extension(filament_type, segments, each, kT, *bending), otypes=[float])(forces)[
        ()
    ]


def _bending_transfer(filament_type, temperature, force):
    # Nodes and weights in c, and the azimuthal average of exp(-V_b/k_B T) between them by Legendre's addition theorem.
    order = 48
    cosines = JointAngleDistribution(filament_type, temperature)
    if filament_type.joint_stiffness > 0.0:
        # The n-th coefficient falls off as exp(-n^2/2s) for a joint of stiffness s k_B T.
        bend = cosines.mean(lambda cosine: 1.0 - cosine)
        order = max(order, math.ceil(min(9.0 / math.sqrt(bend), _MOST_DIRECTIONS)))
    node, weight = _cosine_nodes(2 * order, force * filament_type.segment_length)
    if filament_type.joint_stiffness == 0.0:
        return node, weight, np.full((len(node), len(node)), 0.5)
    polynomials = np.polynomial.legendre.legvander(node, order - 1)
    scale = (np.arange(order) + 0.5) * cosines.legendre_means(order)
    return node, weight, (polynomials * scale) @ polynomials.T


def _cosine_nodes(least, alignment):
    # For exp(u c) with u up to ``alignment``: in s of c = 1 - 2 s^2 it is a Gaussian of the width (4 u)^-1/2, which the
    # nodes, the denser the nearer to s = 0, divide into several parts.
    points = max(least, int(30.0 * (1.0 + alignment) ** 0.25))
    if points > _MOST_DIRECTIONS:
        raise InputError(
            "Segments are too stiff or too strongly aligned for this sum over their directions: take a smaller force, "
            "a higher temperature or longer segments."
        )
    root, weight = gauss_points(points)
    return 1.0 - 2.0 * root**2, 4.0 * root * weight


def _pulled_lengths(filament_type, force, kT, node):
    # g(c) at the nodes and its derivative by F/k_B T, both over the same constant.
    width = math.sqrt(kT / filament_type.segment_stiffness)
    rest = filament_type.segment_length
    low, high = rest - 12.0 * width, rest + 12.0 * width + force * width**2 + 2.0 * width**2 / rest
    if filament_type.maximum_extension is not None:
        low, high = (rest + sign * filament_type.maximum_extension * (1.0 - 1e-12) for sign in (-1.0, 1.0))
    place, gauss_weight = gauss_points(200)
    low = max(low, 0.0)
    length = low + (high - low) * place
    with np.errstate(divide="ignore"):
        exponent = 2.0 * np.log(length) - filament_type.stretching_energy(length) / kT + np.outer(node, force * length)
    density = gauss_weight * np.exp(exponent - exponent.max())
    return density.sum(axis=1), node * (density @ length)


def _extension(filament_type, segments, force, kT, node, weight, bending):
    # Z and its derivative by F/k_B T together: one vector each, over the cosine of the segment reached.
    pull, slope = _pulled_lengths(filament_type, force, kT, node)
    partition, derivative = pull, slope
    for _ in range(segments - 1):
        partition, derivative = bending @ (weight * partition), bending @ (weight * derivative)
        partition, derivative = pull * partition, pull * derivative + slope * partition
        scale = partition.max()
        partition, derivative = partition / scale, derivative / scale
    return (weight @ derivative) / (weight @ partition)


def long_chain_extension(filament_type: FilamentType, force: Numbers, temperature: Scalar) -> FloatOrArray:
    """Mean extension in nm of a segment of a long discrete chain under a constant force F e; exact.

    ``k_B T d ln lambda/dF`` for the largest eigenvalue lambda of the transfer of ``chain_extension``, which is what a
    segment in the middle of a chain has that is long against the persistence length and k_B T/F.

    Parameters
    ----------
    filament_type : FilamentType
    force : force, number or array, not negative
    temperature : temperature, above zero
    """
    require_straight_segments(filament_type)
    kT = thermal_energy_above_zero(temperature)
    forces = np.asarray(each_not_negative(force, FORCE, "force")) / kT
    node, weight, bending = _bending_transfer(filament_type, temperature, float(np.max(forces, initial=0.0)))

    def extension(each):
        pull, slope = _pulled_lengths(filament_type, each, kT, node)
        root = np.sqrt(weight * pull)
        state = scipy.linalg.eigh(root[:, None] * bending * root, subset_by_index=[len(node) - 1] * 2)[1][:, 0]
        used = pull > 0.0
        return float(state[used] ** 2 @ (slope[used] / pull[used]))

    return np.vectorize(extension, otypes=[float])(forces)[()]


def wlc_relative_extension(
    force: Numbers, persistence_length: Scalar, temperature: Scalar, stretching_modulus: Scalar | None = None
) -> FloatOrArray:
    """Relative extension <R.e>/L of a long WLC under a force, which may be extensible; exact.

    ``k_B T dg/dF`` for g, the largest eigenvalue of

        -L^2/(2 lp) + F c/k_B T + F^2 c^2/(2 EA k_B T)

    with c, the cosine between the tangent and the force, and the square L^2 of the angular momentum, in Legendre
    polynomials. The last term is what lengths of a continuous chain add, the energy of which is EA/2 of the square of
    the strain per length. For k_B T/lp << F << EA it is ``1 - (k_B T/lp F)^(1/2)/2 + F/EA``, as Odijk, Macromolecules
    1995, 28, 7016.

    Parameters
    ----------
    force : force, number or array, not negative
    persistence_length : length, above zero
    temperature : temperature, above zero
    stretching_modulus : force EA, optional
        Inextensible if not given.
    """
    kT = thermal_energy_above_zero(temperature)
    length = positive(persistence_length, LENGTH, "persistence_length")
    forces = np.asarray(each_not_negative(force, FORCE, "force"))
    softness = 0.0
    if stretching_modulus is not None:
        softness = 1.0 / positive(stretching_modulus, FORCE, "stretching_modulus")

    def extension(each):
        # The state has the width (k_B T/lp F)^(1/4) in angle.
        width = (each * (1.0 + each * softness) * length / kT) ** 0.25
        if 40 + 12.0 * width > _MOST_DIRECTIONS:
            raise InputError(f"force is {each:g} kJ/(mol nm), too strong for this sum: take a smaller one.")
        order = np.arange(int(40 + 12.0 * width))
        beside = order[1:] / np.sqrt(4.0 * order[1:] ** 2 - 1.0)
        cosine = np.diag(beside, 1) + np.diag(beside, -1)
        square = cosine @ cosine
        energy = np.diag(order * (order + 1) / (2.0 * length)) - each / kT * (cosine + 0.5 * each * softness * square)
        state = scipy.linalg.eigh(energy, subset_by_index=[0, 0])[1][:, 0]
        return float(state @ cosine @ state + each * softness * (state @ square @ state))

    return np.vectorize(extension, otypes=[float])(forces)[()]


def wlc_share_of_force(filament_type: FilamentType, force: Numbers, temperature: Scalar) -> FloatOrArray:
    """The force that a long discrete chain needs for the extension of a WLC under a force F, over F.

    Segments take two things from a wormlike chain. Bends between their ends are missing, so that a large force leaves
    too little of them; and, since a length has the weight l^2, each is longer than l0 by 2 k_B T/k, which adds up as
    they become shorter. With f = F lp/k_B T and EA = k l0, a large force leaves of the relative extension

        WLC: 1 - 1/(2 sqrt(f)) + F/EA
        chain: (1 + 2 k_B T/(EA l0)) (1 - 1/(2 sqrt(f + (F l0/2 k_B T)^2))) + F/EA

    and it is the force at which the second is what the first is at F. Good to 0.05 for DNA; ``long_chain_extension``
    and ``wlc_relative_extension`` are exact.

    Parameters
    ----------
    filament_type : FilamentType
        Not one of ``calibrated_up_to_force``.
    force : force, number or array, not negative
    temperature : temperature, above zero
    """
    require_not_calibrated(filament_type)
    kT = thermal_energy_above_zero(temperature)
    length, rigidity = filament_type.segment_length, filament_type.bending_rigidity
    modulus = filament_type.segment_stiffness * length
    longest = 1.0 + 2.0 * kT / (modulus * length)

    def extension(force):
        stiff = math.sqrt(force * rigidity) / kT
        return longest * (1.0 - 0.5 / math.hypot(stiff, 0.5 * force * length / kT)) + force / modulus

    def share(force):
        if force == 0.0 or rigidity == 0.0:
            return 1.0
        target = 1.0 - 0.5 * kT / math.sqrt(force * rigidity) + force / modulus
        return math.exp(scipy.optimize.brentq(lambda x: extension(force * math.exp(x)) - target, -30.0, 30.0))

    return np.vectorize(share, otypes=[float])(each_not_negative(force, FORCE, "force"))[()]


def require_not_calibrated(filament_type: FilamentType) -> None:
    """Raise InputError if a type is one of ``calibrated_up_to_force``, or of segments that are not straight."""
    require_straight_segments(filament_type)
    if filament_type.contour_per_segment is not None:
        raise InputError(
            f"Filament type {filament_type.name!r} is calibrated up to a force already: take the type that it was "
            "made of."
        )


def linear_force(extension: Numbers, contour_length: Scalar, segment_stiffness: Scalar, segments: int) -> FloatOrArray:
    """Force of a straight chain of springs, eq. (35): ``F = (k/N)(<R.e> - L)``, in kJ/(mol nm).

    Parameters
    ----------
    extension : length, number or array
        <R.e>, the end-to-end vector along the force.
    contour_length : length, above zero
        Rest length L of the chain.
    segment_stiffness : stiffness k of one segment, above zero
    segments : int
    """
    excess = in_units_of(extension, LENGTH, "extension") - positive(contour_length, LENGTH, "contour_length")
    return limiting_spring_constant(segment_stiffness, segments) * excess


def effective_spring_constant(force: Numbers, extension: Numbers, contour_length: Scalar) -> FloatOrArray:
    """Effective spring constant of a chain under tension, eq. (36): ``F/|<R.e> - L|``, in kJ/(mol nm^2).

    Parameters
    ----------
    force : force, number or array
    extension : length, number or array of the same shape
    contour_length : length, above zero

    Raises InputError where the extension equals the contour length: (36) diverges there.
    """
    force = each_not_negative(force, FORCE, "force")
    excess = in_units_of(extension, LENGTH, "extension") - positive(contour_length, LENGTH, "contour_length")
    if np.any(np.asarray(excess) == 0):
        raise InputError("The effective spring constant (36) diverges where the extension equals contour_length.")
    return force / np.abs(excess)


def limiting_spring_constant(segment_stiffness: Scalar, segments: int) -> float:
    """Spring constant of a chain at large force, eq. (37): ``k/N``, in kJ/(mol nm^2)."""
    return positive(segment_stiffness, STIFFNESS, "segment_stiffness") / whole_number(segments, 1, "segments")


def marko_siggia_spring_constant(
    force: Numbers, contour_length: Scalar, persistence_length: Scalar, temperature: Scalar
) -> FloatOrArray:
    """Effective spring constant (36) where bending rules, eq. (38) with its prefactor, in kJ/(mol nm^2).

    ``k_eff = 2 F^(3/2) (lp/k_B T)^(1/2) / L``, from the first term of (34); it holds for k_B T/lp << F << the
    ``crossover_force``.

    Parameters
    ----------
    force : force, number or array, not negative
    contour_length, persistence_length : length, above zero
    temperature : temperature, above zero
    """
    force = each_not_negative(force, FORCE, "force")
    scale = positive(persistence_length, LENGTH, "persistence_length") / thermal_energy_above_zero(temperature)
    return 2.0 * force**1.5 * math.sqrt(scale) / positive(contour_length, LENGTH, "contour_length")


def crossover_force(
    contour_length: Scalar, persistence_length: Scalar, segment_stiffness: Scalar, segments: int, temperature: Scalar
) -> float:
    """Force at which the asymptotes (37) and (38) cross: ``(k L/(2N))^(2/3) (k_B T/lp)^(1/3)``, kJ/(mol nm)."""
    spring = limiting_spring_constant(segment_stiffness, segments)
    length = positive(contour_length, LENGTH, "contour_length")
    scale = thermal_energy_above_zero(temperature) / positive(persistence_length, LENGTH, "persistence_length")
    return (0.5 * spring * length) ** (2.0 / 3.0) * scale ** (1.0 / 3.0)
