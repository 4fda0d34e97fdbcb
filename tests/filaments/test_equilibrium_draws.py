"""Exact equilibrium of free discrete chains: marginal distributions and draws.

Statistical checks use fixed seeds, exact expectations and four standard errors, measured from the sample; the samples
are large enough for four standard errors to stay below 5 % of what is measured.
"""

import math

import numpy as np
import pytest
from openmm import unit
from scipy.integrate import quad

from openmm_cylchain import DSDNA, F_ACTIN, MICROTUBULE, Filaments, FilamentType, InputError
from openmm_cylchain.filaments.equilibrium import (
    JointAngleDistribution,
    SegmentLengthDistribution,
    _tangents_in_space,
    draw_chain,
)
from support.bending_models import BENDING_MODELS

TEMPERATURE = 300.0
KT = 8.31446262e-3 * TEMPERATURE


def chain_type(joint_stiffness=5.0, segment_stiffness=100.0, length=10.0, **changes):
    """A type with a/l0 and k l0^2 given in k_B T."""
    return FilamentType(
        name="TEST",
        diameter=0.1 * length,
        segment_length=length,
        bending_rigidity=joint_stiffness * KT * length,
        stretching_stiffness=segment_stiffness * KT / length**2,
        **changes,
    )


class Quantiles:
    """Stands in for a generator: its "random" numbers are given."""

    def __init__(self, quantiles):
        self._quantiles = np.asarray(quantiles)

    def random(self, size):
        assert size == len(self._quantiles)
        return self._quantiles


def integral(function, low, high, points=()):
    edges = [low, *(point for point in sorted(points) if low < point < high), high]
    parts = zip(edges[:-1], edges[1:])
    return math.fsum(quad(function, a, b, epsabs=0.0, epsrel=1e-11, limit=200)[0] for a, b in parts)


def assert_mean(samples, expected, scale=None):
    """The mean agrees within four standard errors, and these are below 5 % of the expectation."""
    error = np.std(samples) / math.sqrt(len(samples))
    assert 4 * error < 0.05 * abs(expected if scale is None else scale)
    assert abs(np.mean(samples) - expected) < 4 * error


# Joint angles


def bending_energy(model, stiffness, bend):
    """V_b in k_B T as a function of bend = 1 - c."""
    return stiffness * BENDING_MODELS[model].energy(2 * math.asin(math.sqrt(0.5 * bend)))


def bend_integral(model, stiffness, function, low=0.0, high=2.0):
    scale = 1 / max(stiffness, 1.0)
    points = [scale * factor for factor in (0.3, 1, 3, 10, 30, 80)]

    def weighted(bend):
        energy = bending_energy(model, stiffness, bend)
        return math.exp(-energy) * function(bend) if energy < 200 else 0.0

    return integral(weighted, low, min(high, 200 * scale), points)


@pytest.mark.parametrize("model", BENDING_MODELS)
@pytest.mark.parametrize("stiffness", [0.0, 0.1, 1.0, 5.4, 47.8, 49.9, 50.1, 600.0, 1e5])
def test_joint_angle_moments(model, stiffness):
    filament_type = chain_type(joint_stiffness=stiffness, bending_model=model)
    joint = JointAngleDistribution(filament_type, TEMPERATURE)
    norm = bend_integral(model, stiffness, lambda bend: 1.0)
    for power in (1, 2, 3):
        expected = bend_integral(model, stiffness, lambda bend, power=power: bend**power) / norm
        assert joint.mean(lambda c, power=power: (1 - c) ** power) == pytest.approx(expected, rel=1e-6)
    energy = bend_integral(model, stiffness, lambda bend: bending_energy(model, stiffness, bend)) / norm
    assert joint.mean(filament_type.bending_energy) / KT == pytest.approx(energy, rel=1e-6, abs=1e-15)


@pytest.mark.parametrize("model", BENDING_MODELS)
@pytest.mark.parametrize("stiffness", [0.0, 1.0, 47.8, 1e5])
def test_joint_angles_are_drawn_by_the_inverse_distribution(model, stiffness):
    joint = JointAngleDistribution(chain_type(joint_stiffness=stiffness, bending_model=model), TEMPERATURE)
    quantiles = np.array([0.001, 0.1, 0.5, 0.9, 0.999])
    norm = bend_integral(model, stiffness, lambda bend: 1.0)
    for quantile, cosine in zip(quantiles, joint.sample(Quantiles(quantiles), 5)):
        above = bend_integral(model, stiffness, lambda bend: 1.0, 1 - cosine) / norm
        assert above == pytest.approx(quantile, rel=1e-4, abs=1e-7)


def test_kratky_porod_has_the_langevin_function():
    joint = JointAngleDistribution(chain_type(joint_stiffness=3.0, bending_model="kratky-porod"), TEMPERATURE)
    assert joint.mean(lambda c: c) == pytest.approx(1 / math.tanh(3.0) - 1 / 3.0, rel=1e-8)


def test_rigidity_stays_when_the_temperature_changes():
    filament_type = chain_type(joint_stiffness=3.0, bending_model="kratky-porod")
    hot = JointAngleDistribution(filament_type, 2 * TEMPERATURE)
    assert hot.mean(lambda c: c) == pytest.approx(1 / math.tanh(1.5) - 1 / 1.5, rel=1e-8)


# Segment lengths


def stretching_energy(stiffness, extension, length):
    """V_el in k_B T for a rest length of one; ``extension`` is None for the harmonic potential."""
    strain = length - 1
    if extension is None:
        return 0.5 * stiffness * strain**2
    relative = (strain / extension) ** 2
    return -0.5 * stiffness * extension**2 * math.log1p(-relative) if relative < 1 else math.inf


def length_integral(stiffness, extension, function, upper=math.inf):
    width = 1 / math.sqrt(stiffness)
    reach = 15 * width + 4 / stiffness if extension is None else min(extension, 15 * width + 4 / stiffness)
    points = [1 + factor * width for factor in (-6, -3, -1, 0, 1, 3, 6)]

    def weighted(length):
        energy = stretching_energy(stiffness, extension, length)
        return length**2 * math.exp(-energy) * function(length) if energy < 300 else 0.0

    return integral(weighted, max(0.0, 1 - reach), min(upper, 1 + reach), points)


STRETCHING = [
    (1.0, None),
    (10.0, None),
    (100.0, None),
    (1.475e6, None),
    (10.0, 1.0),
    (100.0, 0.5),
    (100.0, 0.1),
    (1.475e6, 0.1),
]


def stretching_type(stiffness, extension, length=10.0):
    model = {} if extension is None else dict(stretching_model="fene", maximum_extension=extension * length)
    return chain_type(segment_stiffness=stiffness, length=length, **model)


@pytest.mark.parametrize("stiffness, extension", STRETCHING)
def test_segment_length_moments(stiffness, extension):
    filament_type = stretching_type(stiffness, extension)
    segment = SegmentLengthDistribution(filament_type, TEMPERATURE)
    norm = length_integral(stiffness, extension, lambda length: 1.0)
    for power in (1, 2):
        strain = length_integral(stiffness, extension, lambda length, power=power: (length - 1) ** power) / norm
        assert segment.mean(lambda length, power=power: (length / 10 - 1) ** power) == pytest.approx(strain, rel=1e-5)
    energy = length_integral(stiffness, extension, lambda length: stretching_energy(stiffness, extension, length))
    assert segment.mean(filament_type.stretching_energy) / KT == pytest.approx(energy / norm, rel=1e-5)


@pytest.mark.parametrize("stiffness, extension", STRETCHING)
def test_segment_lengths_are_drawn_by_the_inverse_distribution(stiffness, extension):
    segment = SegmentLengthDistribution(stretching_type(stiffness, extension), TEMPERATURE)
    quantiles = np.array([0.001, 0.1, 0.5, 0.9, 0.999])
    norm = length_integral(stiffness, extension, lambda length: 1.0)
    for quantile, length in zip(quantiles, segment.sample(Quantiles(quantiles), 5)):
        below = length_integral(stiffness, extension, lambda length: 1.0, upper=length / 10) / norm
        assert below == pytest.approx(quantile, rel=1e-3, abs=1e-6)


def test_stiff_segments_lengthen_by_two_kT_over_k_l0():
    # <l>/l0 = 1 + 2/y with y = k l0^2/k_B T, to first order: the l^2 of eq. (19)
    segment = SegmentLengthDistribution(chain_type(segment_stiffness=1e6), TEMPERATURE)
    assert segment.mean(lambda length: length / 10 - 1) == pytest.approx(2e-6, rel=1e-4)


@pytest.mark.parametrize("distribution", [JointAngleDistribution, SegmentLengthDistribution])
def test_no_equilibrium_at_zero_temperature(distribution):
    with pytest.raises(InputError, match="temperature must be positive"):
        distribution(F_ACTIN, 0)


# Draws


def internal_coordinates(nodes):
    """Lengths, cosines of joints and dihedral angles of a chain."""
    difference = np.diff(nodes, axis=0)
    length = np.linalg.norm(difference, axis=1)
    tangent = difference / length[:, None]
    cosine = np.einsum("ij,ij->i", tangent[1:], tangent[:-1])
    normal = np.cross(tangent[:-1], tangent[1:])
    across = np.cross(normal[:-1], tangent[1:-1])
    dihedral = np.arctan2(
        np.einsum("ij,ij->i", across, normal[1:]) / np.linalg.norm(across, axis=1),
        np.einsum("ij,ij->i", normal[:-1], normal[1:]) / np.linalg.norm(normal[:-1], axis=1),
    )
    return length, cosine, dihedral


@pytest.mark.parametrize("model", BENDING_MODELS)
@pytest.mark.parametrize("extension", [None, 0.2])
@pytest.mark.parametrize("joint_stiffness", [2.0, 60.0])
def test_drawn_lengths_and_angles(model, extension, joint_stiffness):
    stiffness = 50.0
    model_of_length = {} if extension is None else dict(stretching_model="fene", maximum_extension=10 * extension)
    filament_type = chain_type(joint_stiffness, stiffness, bending_model=model, **model_of_length)
    nodes = draw_chain(filament_type, 15000, TEMPERATURE, np.random.default_rng(20160414))
    length, cosine, dihedral = internal_coordinates(nodes)

    norm = length_integral(stiffness, extension, lambda x: 1.0)
    assert_mean(length / 10, length_integral(stiffness, extension, lambda x: x) / norm)
    energy = length_integral(stiffness, extension, lambda x: stretching_energy(stiffness, extension, x)) / norm
    assert_mean(filament_type.stretching_energy(length) / KT, energy)

    norm = bend_integral(model, joint_stiffness, lambda x: 1.0)
    assert_mean(1 - cosine, bend_integral(model, joint_stiffness, lambda x: x) / norm)
    energy = bend_integral(model, joint_stiffness, lambda x: bending_energy(model, joint_stiffness, x)) / norm
    assert_mean(filament_type.bending_energy(cosine) / KT, energy)

    for harmonic in (1, 2):
        assert_mean(np.cos(harmonic * dihedral), 0.0, scale=1.0)
        assert_mean(np.sin(harmonic * dihedral), 0.0, scale=1.0)
    assert_mean(np.cos(dihedral) ** 2, 0.5)
    # Neighbouring lengths and angles are independent.
    for a, b in ((length[1:], length[:-1]), (cosine[1:], cosine[:-1]), (length[1:], cosine)):
        assert_mean((a - a.mean()) * (b - b.mean()) / (a.std() * b.std()), 0.0, scale=1.0)


def test_freely_jointed_chain_has_isotropic_joints():
    nodes = draw_chain(chain_type(joint_stiffness=0.0), 15000, TEMPERATURE, np.random.default_rng(7))
    _, cosine, dihedral = internal_coordinates(nodes)
    assert_mean(cosine, 0.0, scale=1.0)
    assert_mean(cosine**2, 1 / 3)
    assert_mean(np.cos(dihedral), 0.0, scale=1.0)


def test_first_segment_is_isotropic():
    generator = np.random.default_rng(11)
    directions = np.array([np.diff(draw_chain(DSDNA, 1, 300, generator), axis=0)[0] for _ in range(5500)])
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    for component in directions.T:
        assert_mean(component, 0.0, scale=1.0)
        assert_mean(component**2, 1 / 3)
    assert_mean(directions[:, 0] * directions[:, 1], 0.0, scale=1.0)


def test_tangents_of_a_long_chain_stay_unit_vectors_with_the_drawn_angles():
    """As they are turned by joint after joint, rounding does not add up."""
    generator = np.random.default_rng(3)
    cosines = 1.0 - 2e-3 * generator.random(100000)
    tangents = _tangents_in_space(cosines, generator, np.array([0.0, 3.0, 4.0]))
    assert tangents[0] == pytest.approx([0.0, 0.6, 0.8], abs=1e-15)
    np.testing.assert_allclose(np.linalg.norm(tangents, axis=1), 1.0, atol=1e-14)
    np.testing.assert_allclose(np.einsum("ij,ij->i", tangents[1:], tangents[:-1]), cosines, atol=1e-12)


@pytest.mark.parametrize("stiffness", [3.0, 5000.0])
def test_means_of_legendre_polynomials(stiffness):
    joint = JointAngleDistribution(chain_type(joint_stiffness=stiffness), TEMPERATURE)
    expected = [joint.mean(lambda x, n=n: np.polynomial.legendre.legval(x, np.eye(41)[n])) for n in (0, 1, 7, 40)]
    assert joint.legendre_means(41)[[0, 1, 7, 40]] == pytest.approx(expected, abs=1e-12)


# End-to-end distances. (length over persistence length, segments, chains)
CHAINS = [(0.05, 10, 500), (0.2, 10, 500), (1.0, 15, 1200), (5.0, 25, 3600)]


def continuum_mean_square(contour, persistence):
    """Eq. (25)."""
    ratio = contour / persistence
    return 2 * persistence**2 * (ratio + math.expm1(-ratio))


def discrete_mean_square(model, joint_stiffness, segment_stiffness, segments, length):
    """<R^2> = N <l^2> + 2 <l>^2 sum_k (N - k) <c>^k of a chain with independent lengths and joints."""
    norm = length_integral(segment_stiffness, None, lambda x: 1.0)
    first = length * length_integral(segment_stiffness, None, lambda x: x) / norm
    second = length**2 * length_integral(segment_stiffness, None, lambda x: x**2) / norm
    norm = bend_integral(model, joint_stiffness, lambda x: 1.0)
    cosine = 1 - bend_integral(model, joint_stiffness, lambda x: x) / norm
    lags = np.arange(1, segments)
    return segments * second + 2 * first**2 * np.sum((segments - lags) * cosine**lags)


def discretisation_error(ratio, step):
    """Bound on the relative difference between a discrete chain and eq. (25), for ratio L/l_p and step l0/l_p.

    To first order in l0/l_p a chain has the persistence length -l0/ln<c> = l_p (1 + f l0/l_p), with f = 3/2 for the
    inscribed circle, -1/2 for Kratky-Porod and less in size than 3/2 for the quadratic potential; the second order is
    taken to be below 4 (l0/l_p)^2. <R^2> follows with the exponent d ln<R^2>/d ln l_p. The sum over segments instead
    of an integral adds at most L l0^2/(3 l_p).
    """
    exponent = (math.log(continuum_mean_square(ratio, 1.001)) - math.log(continuum_mean_square(ratio, 0.999))) / 0.002
    return exponent * (1.5 * step + 4 * step**2) + ratio * step**2 / 3 / continuum_mean_square(ratio, 1.0)


@pytest.mark.sample("^(?!inscribed-circle-5)")
@pytest.mark.parametrize(
    "model, ratio, segments, chains",
    [("inscribed-circle", *chain) for chain in CHAINS]
    + [(model, *CHAINS[2]) for model in BENDING_MODELS if model != "inscribed-circle"],
)
def test_mean_square_end_to_end_distance(model, ratio, segments, chains):
    joint_stiffness, segment_stiffness = segments / ratio, 400.0
    filament_type = chain_type(joint_stiffness, segment_stiffness, bending_model=model)
    # The pieces of one long chain are independent of each other: they share no segment and no joint.
    generator = np.random.default_rng(round(100 * ratio))
    nodes = draw_chain(filament_type, segments * chains, TEMPERATURE, generator)[::segments]
    squares = np.sum(np.diff(nodes, axis=0) ** 2, axis=1)
    exact = discrete_mean_square(model, joint_stiffness, segment_stiffness, segments, 10.0)
    assert_mean(squares, exact)


@pytest.mark.parametrize("model", BENDING_MODELS)
@pytest.mark.parametrize("ratio, segments, chains", CHAINS)
def test_discrete_chain_approaches_the_worm_like_chain(model, ratio, segments, chains):
    # Stiff segments, so that only the discreteness of the bend is left.
    exact = discrete_mean_square(model, segments / ratio, 1e8, segments, 1.0 / segments)
    continuum = continuum_mean_square(1.0, 1.0 / ratio)
    assert abs(exact / continuum - 1) < discretisation_error(ratio, ratio / segments)


@pytest.mark.parametrize("filament_type", [F_ACTIN, DSDNA, MICROTUBULE])
def test_drawn_presets_follow_eq_25(filament_type):
    segments, chains = 25, 1000
    persistence = filament_type.persistence_length_at(310)
    contour = segments * filament_type.segment_length
    generator = np.random.default_rng(2016)
    nodes = draw_chain(filament_type, segments * chains, 310, generator)[::segments]
    squares = np.sum(np.diff(nodes, axis=0) ** 2, axis=1)
    allowed = discretisation_error(contour / persistence, filament_type.segment_length / persistence)
    # Segments lengthen by 2 k_B T/(k l0^2) of their length.
    allowed += 4 * 8.31446262e-3 * 310 / (filament_type.segment_stiffness * filament_type.segment_length**2)
    error = 4 * np.std(squares) / math.sqrt(chains)
    expected = continuum_mean_square(contour, persistence)
    assert abs(np.mean(squares) - expected) < error + allowed * expected


def equilibrium_positions(seed, **arguments):
    filaments = Filaments(1000.0, 310)
    filaments.add_equilibrium(DSDNA, 30, seed=seed, **arguments)
    return filaments[0].positions


def test_seed_makes_the_chain():
    np.testing.assert_array_equal(equilibrium_positions(5), equilibrium_positions(5))
    assert np.abs(equilibrium_positions(5) - equilibrium_positions(6)).max() > 1.0


def test_start_and_direction():
    positions = equilibrium_positions(5, start=[1, 2, 3] * unit.micrometer, direction=[0, 3, 4])
    np.testing.assert_allclose(positions[0], [1000, 2000, 3000], rtol=1e-15)
    first = positions[1] - positions[0]
    np.testing.assert_allclose(first / np.linalg.norm(first), [0, 0.6, 0.8], atol=1e-12)


def test_chain_of_one_segment():
    nodes = draw_chain(DSDNA, 1, 310, np.random.default_rng(1))
    assert nodes.shape == (2, 3)


def test_long_chain_stays_normalised():
    # 1e4 rotations in sequence must not let rounding errors grow.
    nodes = draw_chain(MICROTUBULE, 10000, 310, np.random.default_rng(1))
    length, cosine, _ = internal_coordinates(nodes)
    assert np.abs(length / MICROTUBULE.segment_length - 1).max() < 1e-2
    assert cosine.min() > 0.99
