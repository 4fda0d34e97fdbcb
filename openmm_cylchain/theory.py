"""Closed forms to hold simulations against: chain statistics, forces, energies and free diffusion.

Equation numbers refer to Pesek et al., Soft Matter 2016, 12, 3360. Arguments are ``openmm.unit``
quantities or plain numbers in OpenMM's units; results are plain numbers or arrays in OpenMM's units (nm,
ps, kJ/mol). Every function raises InputError for values that are not finite, have the wrong unit or lie
outside the stated range. Functions of the discrete chain are exact for the model that is simulated, at
any stiffness; the others belong to the continuous wormlike chain (WLC).
"""

import math

import numpy as np

from .errors import InputError
from .filaments.equilibrium import JointAngleDistribution, PlanarJointAngleDistribution, SegmentLengthDistribution
from .mechanics.friction import rotational_relaxation_time
from .units.quantities import (
    DIMENSIONLESS,
    FORCE,
    LENGTH,
    STIFFNESS,
    TEMPERATURE,
    TIME,
    in_units_of,
    positive,
    thermal_energy,
    whole_number,
)


def _not_negative(value, dimension, name):
    number = in_units_of(value, dimension, name)
    if np.any(np.asarray(number) < 0):
        raise InputError(f"{name} cannot be negative.")
    return number


def _thermal_energy_above_zero(temperature):
    return thermal_energy(positive(temperature, TEMPERATURE, "temperature"))


def _whole_numbers(value, minimum, name):
    number = in_units_of(value, DIMENSIONLESS, name)
    if np.any(number != np.floor(number)) or np.any(np.asarray(number) < minimum):
        raise InputError(f"{name} must be whole numbers of at least {minimum}, but is {value!r}.")
    return number


def wlc_mean_square_end_to_end(contour_length, persistence_length, planar=False):
    """Mean square end-to-end distance of the free WLC, eq. (25), in nm^2.

    ``<R^2> = 2 lp^2 (L/lp - 1 + exp(-L/lp))``, accurate to rounding from rods to coils. In a plane, where tangents
    decorrelate over 2 lp, ``8 lp^2 (L/2lp - 1 + exp(-L/2lp))``: eq. (44) of Chandran and Mofrad, Phys. Rev. E 2009, 79,
    011906.

    Parameters
    ----------
    contour_length : length, number or array, not negative
    persistence_length : length, above zero
        a/(k_B T), in space and in a plane.
    planar : bool
        In a plane.
    """
    length = _not_negative(contour_length, LENGTH, "contour_length")
    ratio = np.asarray(length / _correlation_length(persistence_length, planar))
    # The closed form loses digits to cancellation for rods: 1 - x/3 + x^2/12 - ... there.
    series = sum(2.0 * (-1.0) ** n * np.minimum(ratio, 1.0) ** n / math.factorial(n + 2) for n in range(12))
    large = np.maximum(ratio, 0.1)
    closed = 2.0 * (large + np.expm1(-large)) / large**2
    return length**2 * np.where(ratio < 0.1, series, closed)[()]


def _correlation_length(persistence_length, planar):
    # A tangent has one direction to turn to in a plane, two in space.
    return (2.0 if planar else 1.0) * positive(persistence_length, LENGTH, "persistence_length")


def wlc_tangent_correlation(contour_distance, persistence_length, planar=False):
    """Correlation of tangents of the WLC, ``<t(0).t(s)> = exp(-s/lp)``, in a plane ``exp(-s/2lp)``.

    Parameters
    ----------
    contour_distance : length, number or array, not negative
    persistence_length : length, above zero
    planar : bool
        In a plane.
    """
    distance = _not_negative(contour_distance, LENGTH, "contour_distance")
    return np.exp(-distance / _correlation_length(persistence_length, planar))


def mean_joint_cosine(filament_type, temperature, planar=False):
    """Mean cosine <t1.t2> between neighbouring segments of the free discrete chain, in space or in a plane; exact."""
    if planar:
        return float(PlanarJointAngleDistribution(filament_type, temperature).mean(np.cos))
    return float(JointAngleDistribution(filament_type, temperature).mean(lambda cosine: cosine))


def chain_tangent_correlation(filament_type, lag, temperature, planar=False):
    """Correlation of tangents of the free discrete chain, ``<t(i).t(i+k)> = <c>^k``, exact.

    Parameters
    ----------
    filament_type : FilamentType
    lag : int or array of int, not negative
        The distance k along the chain in segments.
    temperature : temperature, above zero
    planar : bool
        In a plane.
    """
    return mean_joint_cosine(filament_type, temperature, planar) ** _whole_numbers(lag, 0, "lag")


def chain_persistence_length(filament_type, temperature):
    """Length over which tangents of the discrete chain decorrelate, ``-<l>/ln<c>``, in nm; exact.

    Of a type given by its ``persistence_length`` it is that length at the temperature given with it, times <l>/l0. Of
    one given by its ``bending_rigidity`` it tends to the a/(k_B T) of ``FilamentType.persistence_length_at`` for
    segments that are short against it. A freely jointed chain has 0.
    """
    if filament_type.joint_stiffness == 0:
        return 0.0
    length = SegmentLengthDistribution(filament_type, temperature).mean(lambda length: length)
    bend = JointAngleDistribution(filament_type, temperature).mean(lambda cosine: 1.0 - cosine)
    return float(-length / np.log1p(-bend))


def _subchain_mean_square(filament_type, segments, temperature, planar):
    # <R^2> of every run of 1 to N segments: n<l^2> + 2<l>^2 sum_k (n-k) <c>^k.
    distribution = SegmentLengthDistribution(filament_type, temperature, planar)
    mean, square = distribution.mean(lambda length: length), distribution.mean(lambda length: length**2)
    powers = mean_joint_cosine(filament_type, temperature, planar) ** np.arange(1, segments)
    pairs = np.concatenate([[0.0], np.cumsum(np.cumsum(powers))])
    return np.arange(1, segments + 1) * square + 2.0 * mean**2 * pairs


def chain_mean_square_end_to_end(filament_type, segments, temperature, planar=False):
    """Mean square end-to-end distance of the free discrete chain in nm^2, exact at any stiffness.

    ``<R^2> = N <l^2> + 2 <l>^2 sum_k (N-k) <c>^k``, the averages over (19) and exp(-V_b/k_B T), or over what
    they are in a plane.

    Parameters
    ----------
    filament_type : FilamentType
    segments : int
    temperature : temperature, above zero
    planar : bool
        In a plane.
    """
    segments = whole_number(segments, 1, "segments")
    return float(_subchain_mean_square(filament_type, segments, temperature, planar)[-1])


def chain_mean_square_radius_of_gyration(filament_type, segments, temperature, planar=False):
    """Mean square radius of gyration of the N+1 nodes of the free discrete chain in nm^2, exact.

    Every node has the same weight: ``<R_g^2> = sum over pairs <R_ij^2> / (N+1)^2``.
    """
    segments = whole_number(segments, 1, "segments")
    distances = _subchain_mean_square(filament_type, segments, temperature, planar)
    return float(np.arange(segments, 0, -1) @ distances) / (segments + 1) ** 2


def bending_mode_variance(mode, contour_length, persistence_length):
    """Variance of the amplitude of a bending mode of the free WLC per transverse direction, in nm.

    ``<a_n^2> = (L/(n pi))^2 / lp`` for the tangent angle theta(s) = sqrt(2/L) sum_n a_n cos(n pi s/L) in one
    transverse plane: eqs. (45) and (46) of Chandran and Mofrad, Phys. Rev. E 2009, 79, 011906. It holds for
    small angles.

    Parameters
    ----------
    mode : int or array of int, at least 1
    contour_length, persistence_length : length, above zero
    """
    length = positive(contour_length, LENGTH, "contour_length")
    wavelength = length / (np.pi * _whole_numbers(mode, 1, "mode"))
    return wavelength**2 / positive(persistence_length, LENGTH, "persistence_length")


def chain_bending_mode_variance(filament_type, segments, mode, temperature):
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
    segments, modes = _bending_modes(segments, mode)
    cosines = np.cos(np.multiply.outer(modes, np.pi * (np.arange(segments) + 0.5) / segments))
    lag = np.abs(np.subtract.outer(np.arange(segments), np.arange(segments)))
    bend = JointAngleDistribution(filament_type, temperature).mean(lambda cosine: 1.0 - cosine)
    # The cosines of a mode sum to zero, so <c>^k - 1 serves as well as <c>^k and keeps the digits of stiff chains.
    decorrelation = -np.ones(lag.shape) if bend >= 1.0 else np.expm1(lag * np.log1p(-bend))
    np.fill_diagonal(decorrelation, 0.0)
    length = SegmentLengthDistribution(filament_type, temperature).mean(lambda length: length)
    return np.einsum("...i,ij,...j->...", cosines, decorrelation, cosines)[()] * length / segments


def chain_planar_bending_mode_variance(filament_type, segments, mode, temperature):
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
    segments, modes = _bending_modes(segments, mode)
    square = PlanarJointAngleDistribution(filament_type, temperature).mean(lambda angle: angle**2)
    return filament_type.segment_length * square / (4.0 * np.sin(0.5 * np.pi * modes / segments) ** 2)


def _bending_modes(segments, mode):
    segments = whole_number(segments, 2, "segments")
    modes = _whole_numbers(mode, 1, "mode")
    if np.any(np.asarray(modes) >= segments):
        raise InputError(f"mode must be below the number of segments, {segments}, but is {mode!r}.")
    return segments, modes


def clamped_angle_variance(contour_distance, persistence_length):
    """Variance of the tangent angle of a WLC that is clamped at one end: ``s/lp`` at the distance s from there.

    Eq. (42) of Chandran and Mofrad, Phys. Rev. E 2009, 79, 011906. In space it holds for small angles, in either
    transverse plane; for motion in a plane it is exact.

    Parameters
    ----------
    contour_distance : length, number or array, not negative
    persistence_length : length, above zero
    """
    distance = _not_negative(contour_distance, LENGTH, "contour_distance")
    return distance / positive(persistence_length, LENGTH, "persistence_length")


def clamped_deflection_variance(contour_distance, persistence_length):
    """Variance of the deflection of a WLC that is clamped at one end, ``s^3/(3 lp)``, in nm^2.

    It holds for small angles, in either transverse plane. Eq. (43) of Chandran and Mofrad, Phys. Rev. E 2009, 79,
    011906, has the factor 32/pi^4 for 1/3.

    Parameters
    ----------
    contour_distance : length, number or array, not negative
        s, from the clamp.
    persistence_length : length, above zero
    """
    distance = _not_negative(contour_distance, LENGTH, "contour_distance")
    return distance**3 / (3.0 * positive(persistence_length, LENGTH, "persistence_length"))


def marko_siggia_force(relative_extension, persistence_length, temperature):
    """Force that holds a WLC at a relative extension, eq. (34), in kJ/(mol nm).

    ``F = k_B T/lp (1/(4(1-z)^2) - 1/4 + z)``, z = <R.e>/L: the interpolation of Marko and Siggia, within some
    10 % of the exact WLC between its limits.

    Parameters
    ----------
    relative_extension : number or array in [0, 1)
    persistence_length : length, above zero
    temperature : temperature, above zero
    """
    extension = _not_negative(relative_extension, DIMENSIONLESS, "relative_extension")
    if np.any(np.asarray(extension) >= 1.0):
        raise InputError("relative_extension must be below 1: eq. (34) is for an inextensible chain.")
    scale = _thermal_energy_above_zero(temperature) / positive(persistence_length, LENGTH, "persistence_length")
    return scale * _reduced_force(extension)


def _reduced_force(extension):
    return extension + extension * (2.0 - extension) / (4.0 * (1.0 - extension) ** 2)


def marko_siggia_extension(force, persistence_length, temperature):
    """Relative extension <R.e>/L of a WLC under a force, the inverse of eq. (34); accurate to rounding.

    Parameters
    ----------
    force : force, number or array, not negative
    persistence_length : length, above zero
    temperature : temperature, above zero
    """
    scale = positive(persistence_length, LENGTH, "persistence_length") / _thermal_energy_above_zero(temperature)
    reduced = np.asarray(_not_negative(force, FORCE, "force") * scale)
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


def chain_extension(filament_type, segments, force, temperature):
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
    segments = whole_number(segments, 1, "segments")
    kT = _thermal_energy_above_zero(temperature)
    forces = np.asarray(_not_negative(force, FORCE, "force")) / kT
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
        order = max(order, int(9.0 / math.sqrt(bend)))
    node, weight = _cosine_nodes(2 * order, force * filament_type.segment_length)
    if filament_type.joint_stiffness == 0.0:
        return node, weight, np.full((len(node), len(node)), 0.5)
    coefficients = [
        cosines.mean(lambda cosine, n=n: np.polynomial.legendre.legval(cosine, np.eye(1, n + 1, n)[0]))
        for n in range(order)
    ]
    polynomials = np.polynomial.legendre.legvander(node, order - 1)
    scale = (np.arange(order) + 0.5) * np.array(coefficients)
    return node, weight, (polynomials * scale) @ polynomials.T


def _cosine_nodes(least, alignment):
    # For exp(u c) with u up to ``alignment``: in s of c = 1 - 2 s^2 it is a Gaussian of the width (4 u)^-1/2, which the
    # nodes, the denser the nearer to s = 0, divide into several parts.
    points = max(least, int(30.0 * (1.0 + alignment) ** 0.25))
    gauss, gauss_weight = np.polynomial.legendre.leggauss(points)
    root = 0.5 * (gauss + 1.0)
    return 1.0 - 2.0 * root**2, 2.0 * root * gauss_weight


def _extension(filament_type, segments, force, kT, node, weight, bending):
    width = math.sqrt(kT / filament_type.segment_stiffness)
    rest = filament_type.segment_length
    low, high = rest - 12.0 * width, rest + 12.0 * width + force * width**2 + 2.0 * width**2 / rest
    if filament_type.maximum_extension is not None:
        low, high = (rest + sign * filament_type.maximum_extension * (1.0 - 1e-12) for sign in (-1.0, 1.0))
    gauss, gauss_weight = np.polynomial.legendre.leggauss(200)
    low = max(low, 0.0)
    length = low + 0.5 * (high - low) * (gauss + 1.0)
    with np.errstate(divide="ignore"):
        exponent = 2.0 * np.log(length) - filament_type.stretching_energy(length) / kT + np.outer(node, force * length)
    density = gauss_weight * np.exp(exponent - exponent.max())
    # Z and its derivative by F/k_B T together: one vector each, over the cosine of the segment reached.
    pull, slope = density.sum(axis=1), node * (density @ length)
    partition, derivative = pull, slope
    for _ in range(segments - 1):
        partition, derivative = bending @ (weight * partition), bending @ (weight * derivative)
        partition, derivative = pull * partition, pull * derivative + slope * partition
        scale = partition.max()
        partition, derivative = partition / scale, derivative / scale
    return (weight @ derivative) / (weight @ partition)


def linear_force(extension, contour_length, segment_stiffness, segments):
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


def effective_spring_constant(force, extension, contour_length):
    """Effective spring constant of a chain under tension, eq. (36): ``F/|<R.e> - L|``, in kJ/(mol nm^2).

    Parameters
    ----------
    force : force, number or array
    extension : length, number or array of the same shape
    contour_length : length, above zero

    Raises InputError where the extension equals the contour length: (36) diverges there.
    """
    force = _not_negative(force, FORCE, "force")
    excess = in_units_of(extension, LENGTH, "extension") - positive(contour_length, LENGTH, "contour_length")
    if np.any(np.asarray(excess) == 0):
        raise InputError("The effective spring constant (36) diverges where the extension equals contour_length.")
    return force / np.abs(excess)


def limiting_spring_constant(segment_stiffness, segments):
    """Spring constant of a chain at large force, eq. (37): ``k/N``, in kJ/(mol nm^2)."""
    return positive(segment_stiffness, STIFFNESS, "segment_stiffness") / whole_number(segments, 1, "segments")


def marko_siggia_spring_constant(force, contour_length, persistence_length, temperature):
    """Effective spring constant (36) where bending rules, eq. (38) with its prefactor, in kJ/(mol nm^2).

    ``k_eff = 2 F^(3/2) (lp/k_B T)^(1/2) / L``, from the first term of (34); it holds for k_B T/lp << F << the
    ``crossover_force``.

    Parameters
    ----------
    force : force, number or array, not negative
    contour_length, persistence_length : length, above zero
    temperature : temperature, above zero
    """
    force = _not_negative(force, FORCE, "force")
    scale = positive(persistence_length, LENGTH, "persistence_length") / _thermal_energy_above_zero(temperature)
    return 2.0 * force**1.5 * math.sqrt(scale) / positive(contour_length, LENGTH, "contour_length")


def crossover_force(contour_length, persistence_length, segment_stiffness, segments, temperature):
    """Force at which the asymptotes (37) and (38) cross: ``(k L/(2N))^(2/3) (k_B T/lp)^(1/3)``, kJ/(mol nm)."""
    spring = limiting_spring_constant(segment_stiffness, segments)
    length = positive(contour_length, LENGTH, "contour_length")
    scale = _thermal_energy_above_zero(temperature) / positive(persistence_length, LENGTH, "persistence_length")
    return (0.5 * spring * length) ** (2.0 / 3.0) * scale ** (1.0 / 3.0)


def bending_energy_mean(filament_type, temperature, planar=False):
    """Mean bending energy of one joint at equilibrium, in kJ/mol; exact for every bending model.

    Inscribed circle: eq. (40), ``x k_B T (E_1(x)/E_2(x) - 1)`` with x = 2 K/k_B T, the paper's 2 lp/l0. Kratky-Porod:
    ``k_B T (1 - 2u/(exp(2u) - 1))`` with u = K/k_B T. Quadratic: by quadrature. A freely jointed chain has 0;
    stiff chains tend to k_B T, and the inscribed circle to ``k_B T (1 - l0/lp)``: the limit printed below
    (41), k_B T/(1 - l0/lp), has the wrong sign before l0/lp. In a plane: by quadrature; it tends to k_B T/2.

    Parameters
    ----------
    filament_type : FilamentType
    temperature : temperature, above zero
    planar : bool
        In a plane.
    """
    kT = _thermal_energy_above_zero(temperature)
    if planar:
        distribution = PlanarJointAngleDistribution(filament_type, temperature)
        return float(distribution.mean(lambda angle: filament_type.bending_energy(np.cos(angle))))
    return kT * _reduced_bending_moments(filament_type, kT)[0]


def bending_energy_variance(filament_type, temperature):
    """Variance of the bending energy of one joint, in (kJ/mol)^2; exact for every bending model.

    Inscribed circle: eq. (41), ``(x k_B T)^2 (E_0/E_2 - (E_1/E_2)^2)`` at x = 2 K/k_B T. Kratky-Porod:
    ``(k_B T)^2 (1 - (u/sinh u)^2)`` with u = K/k_B T. Quadratic: by quadrature.
    """
    kT = _thermal_energy_above_zero(temperature)
    return kT**2 * _reduced_bending_moments(filament_type, kT)[1]


def _reduced_bending_moments(filament_type, kT):
    stiffness = filament_type.joint_stiffness / kT
    if stiffness == 0:
        return 0.0, 0.0
    moments = {
        "inscribed-circle": _inscribed_circle_moments,
        "kratky-porod": _kratky_porod_moments,
        "quadratic": _quadratic_moments,
    }
    mean, variance = moments[filament_type.bending_model](stiffness)
    return float(mean), float(variance)


def _inscribed_circle_moments(stiffness):
    from scipy.special import expn

    x = 2.0 * stiffness
    if x < 20.0:
        first, zeroth = expn(1, x) / expn(2, x), math.exp(-x) / (x * expn(2, x))
        return x * (first - 1.0), x**2 * (zeroth - first**2)
    # The ratios of E_n cancel and underflow for large x; v = V_b/k_B T has the density exp(-v)/(1 + v/x)^2.
    energy, weight = np.polynomial.laguerre.laggauss(60)
    return _moments(energy, weight / (1.0 + energy / x) ** 2)


def _kratky_porod_moments(stiffness):
    if stiffness < 0.02:
        square = stiffness**2
        mean = stiffness - square * (1.0 / 3.0 - square * (1.0 / 45.0 - square * 2.0 / 945.0))
        return mean, square * (1.0 / 3.0 - square * (1.0 / 15.0 - square * 2.0 / 189.0))
    inverse_sinh = 2.0 * math.exp(-stiffness) / -math.expm1(-2.0 * stiffness)
    return 1.0 - stiffness * math.exp(-stiffness) * inverse_sinh, 1.0 - (stiffness * inverse_sinh) ** 2


def _quadratic_moments(stiffness):
    node, weight = np.polynomial.legendre.leggauss(200)
    angle = 0.5 * min(math.pi, math.sqrt(160.0 / stiffness)) * (node + 1.0)
    energy = 0.5 * stiffness * angle**2
    return _moments(energy, weight * np.sin(angle) * np.exp(-energy))


def _moments(values, weights):
    mean = weights @ values / weights.sum()
    return mean, weights @ (values - mean) ** 2 / weights.sum()


def stretching_energy_mean(filament_type, temperature, planar=False):
    """Mean stretching energy of one segment at equilibrium, in kJ/mol; exact.

    Averages over (19), rho(l) ~ l^2 exp(-V_el/k_B T). Harmonic: ``(k_B T/2)(1 + 2/(s^2 + 1))`` with
    s^2 = k l0^2/k_B T, up to terms in exp(-s^2/2) that are included. The printed (42) and its variance weigh
    with l where (19) has l^2, and so miss the term 2/(s^2 + 1); the printed expansion of (42) also has the
    wrong sign before its exponential, and the printed variance lacks a sqrt(pi) in the denominator. FENE, and all
    filaments in a plane, with rho(l) ~ l exp(-V_el/k_B T): by quadrature.

    Parameters
    ----------
    filament_type : FilamentType
    temperature : temperature, above zero
    planar : bool
        In a plane.
    """
    if planar:
        return float(
            SegmentLengthDistribution(filament_type, temperature, planar).mean(filament_type.stretching_energy)
        )
    return _stretching_moments(filament_type, temperature)[0]


def stretching_energy_variance(filament_type, temperature):
    """Variance of the stretching energy of one segment, in (kJ/mol)^2; exact, see ``stretching_energy_mean``."""
    return _stretching_moments(filament_type, temperature)[1]


def _stretching_moments(filament_type, temperature):
    kT = _thermal_energy_above_zero(temperature)
    if filament_type.stretching_model != "harmonic":
        distribution = SegmentLengthDistribution(filament_type, temperature)
        mean = distribution.mean(filament_type.stretching_energy)
        variance = distribution.mean(lambda length: (filament_type.stretching_energy(length) - mean) ** 2)
        return float(mean), float(variance)
    scaled_length = filament_type.segment_length * math.sqrt(filament_type.segment_stiffness / kT)
    moment = _truncated_normal_moments(scaled_length, 6)

    def weighted(order):
        # l^2 ~ (s + u)^2 for l = l0 (1 + u/s).
        return scaled_length**2 * moment[order] + 2.0 * scaled_length * moment[order + 1] + moment[order + 2]

    mean = 0.5 * weighted(2) / weighted(0)
    return kT * mean, kT**2 * (0.25 * weighted(4) / weighted(0) - mean**2)


def _truncated_normal_moments(bound, highest):
    # Integrals of u^n times the normal density from -bound to infinity, by parts.
    density = math.exp(-0.5 * bound**2) / math.sqrt(2.0 * math.pi)
    moments = [0.5 * math.erfc(-bound / math.sqrt(2.0)), density]
    for order in range(2, highest + 1):
        moments.append((order - 1) * moments[order - 2] + (-bound) ** (order - 1) * density)
    return moments


def mean_orientation(time, friction, temperature):
    """Mean orientation of a free segment along its initial one, ``exp(-t/tau_r)`` with tau_r of eq. (29).

    Parameters
    ----------
    time : time, number or array, not negative
    friction : SegmentFriction
    temperature : temperature, above zero
    """
    time = _not_negative(time, TIME, "time")
    return np.exp(-time / rotational_relaxation_time(friction, temperature))


def free_segment_mean_square_displacement(time, friction, temperature):
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
    time = _not_negative(time, TIME, "time")
    relaxed = -np.expm1(-3.0 * time / rotational_relaxation_time(friction, temperature))
    anisotropy = friction.rotational / 9.0 * (1.0 / friction.parallel - 1.0 / friction.perpendicular) * relaxed
    isotropic = long_time_mean_square_displacement(time, friction, temperature)
    return isotropic + 2.0 * anisotropy, isotropic - anisotropy


def short_time_mean_square_displacement(time, friction, temperature):
    """Mean square displacement of a free segment that has not turned yet, eq. (30): (parallel, perpendicular)."""
    doubled = 2.0 * _thermal_energy_above_zero(temperature) * _not_negative(time, TIME, "time")
    return doubled / friction.parallel, doubled / friction.perpendicular


def long_time_mean_square_displacement(time, friction, temperature):
    """Mean square displacement of a free segment along any one direction once it has turned, eq. (31), in nm^2.

    ``(2 k_B T/3)(1/gamma_par + 2/gamma_perp) t``: the slope of (32) at long times, without its constant.
    """
    time = _not_negative(time, TIME, "time")
    mobility = (1.0 / friction.parallel + 2.0 / friction.perpendicular) / 3.0
    return 2.0 * _thermal_energy_above_zero(temperature) * mobility * time
