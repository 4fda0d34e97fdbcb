"""Closed forms of theory against quadrature, brute force, limits and numbers of Pesek et al. 2016."""

import math
from dataclasses import replace

import numpy as np
import pytest
from openmm import unit
from scipy.integrate import quad
from scipy.optimize import brentq

from openmm_cylchain import theory
from openmm_cylchain.errors import InputError
from openmm_cylchain.filaments.equilibrium import draw_chain
from openmm_cylchain.filaments.filament_type import FilamentType
from openmm_cylchain.filaments.presets import DSDNA, F_ACTIN
from openmm_cylchain.theory import energies
from openmm_cylchain.units.quantities import thermal_energy
from support.bending_models import BENDING_MODELS

TEMPERATURE = 310.0
KT = thermal_energy(TEMPERATURE)
LENGTH = 100.0
PICONEWTON = 0.602214076  # kJ/(mol nm)


def filament(bending=10.0, stretching=1000.0, **options):
    """A filament of segments of 100 nm with a/(l0 k_B T) and k l0^2/(k_B T) as given."""
    return FilamentType(
        name="TEST",
        diameter=1.0,
        segment_length=LENGTH,
        bending_rigidity=bending * KT * LENGTH,
        stretching_stiffness=stretching * KT / LENGTH**2,
        **options,
    )


def average_over_angle(model, stiffness, function):
    """<function(V_b/k_B T)> with the weight sin(angle) exp(-V_b/k_B T), by adaptive quadrature in angle."""
    upper = min(math.pi, 12.0 / math.sqrt(stiffness))

    def integral(value):
        def integrand(angle):
            energy = stiffness * BENDING_MODELS[model].energy(angle)
            return 0.0 if energy > 700.0 else value(energy) * math.sin(angle) * math.exp(-energy)

        return quad(integrand, 0.0, upper, epsabs=0, epsrel=1e-12, limit=500)[0]

    return integral(function) / integral(lambda energy: 1.0)


def average_over_length(energy, lower, upper, function, power=2):
    def integral(value):
        return quad(
            lambda length: value(length) * length**power * math.exp(-energy(length) / KT),
            lower,
            upper,
            epsabs=0,
            epsrel=1e-12,
            limit=500,
        )[0]

    return integral(function) / integral(lambda length: 1.0)


@pytest.mark.parametrize("ratio", [0.0, 1e-9, 1e-3, 0.099999, 0.100001, 1.0, 30.0])
def test_wlc_end_to_end_is_the_double_integral_of_the_tangent_correlation(ratio):
    length = 500.0
    persistence = length / ratio if ratio else 1e50
    integral, _ = quad(lambda s: 2.0 * (length - s) * math.exp(-s / persistence), 0.0, length, epsrel=1e-13)
    assert theory.wlc_mean_square_end_to_end(length, persistence) == pytest.approx(integral, rel=1e-12)


def test_wlc_end_to_end_takes_arrays_and_units_and_has_the_limits_of_rod_and_coil():
    lengths = np.array([0.0, 1e-6, 1e7])
    rod_and_coil = theory.wlc_mean_square_end_to_end(lengths, 100.0)
    assert rod_and_coil == pytest.approx([0.0, 1e-12, 2 * 100.0 * 1e7], rel=2e-5)
    with_units = theory.wlc_mean_square_end_to_end(23.04 * unit.micrometer, 17.2 * unit.micrometer)
    assert with_units == theory.wlc_mean_square_end_to_end(23040.0, 17200.0)
    # 2 lp^2 (L/lp - 1 + exp(-L/lp)) with L/lp = 1.339535, by hand.
    assert with_units == pytest.approx(2 * 17200.0**2 * (0.3395349 + 0.2619674), rel=1e-5)


def test_wlc_tangent_correlation():
    assert theory.wlc_tangent_correlation([0.0, 17200.0], 17.2 * unit.micrometer) == pytest.approx([1.0, math.exp(-1)])


@pytest.mark.parametrize("model", BENDING_MODELS)
@pytest.mark.parametrize("stiffness", [1e-4, 0.019, 0.021, 0.5, 3.0, 9.9, 10.1, 47.8, 1e3, 1e5])
def test_bending_energy_moments_match_quadrature(model, stiffness):
    chain = filament(stiffness, bending_model=model)
    mean = average_over_angle(model, stiffness, lambda energy: energy)
    variance = average_over_angle(model, stiffness, lambda energy: (energy - mean) ** 2)
    assert theory.bending_energy_mean(chain, TEMPERATURE) / KT == pytest.approx(mean, rel=1e-8)
    assert theory.bending_energy_variance(chain, TEMPERATURE) / KT**2 == pytest.approx(variance, rel=1e-8)


@pytest.mark.parametrize("model", BENDING_MODELS)
def test_bending_energy_of_a_freely_jointed_chain_is_zero(model):
    chain = filament(0.0, bending_model=model)
    assert theory.bending_energy_mean(chain, TEMPERATURE) == 0.0
    assert theory.bending_energy_variance(chain, TEMPERATURE) == 0.0
    assert theory.chain_persistence_length(chain, TEMPERATURE) == 0.0


def test_bending_energy_of_actin_is_the_number_of_table_2():
    actin = replace(F_ACTIN, temperature=None)
    assert theory.bending_energy_mean(actin, TEMPERATURE * unit.kelvin) / KT == pytest.approx(0.980, abs=5e-4)


def test_bending_energy_tends_to_equipartition_from_below():
    for stiffness in (1e2, 1e4, 1e6):
        mean = theory.bending_energy_mean(filament(stiffness), TEMPERATURE) / KT
        assert mean == pytest.approx(1.0 / (1.0 + 1.0 / stiffness), abs=3.0 / stiffness**2)


@pytest.mark.parametrize("reduced", [0.3, 2.0, 30.0, 1e3, 1.475e6])
def test_stretching_energy_moments_match_quadrature(reduced):
    chain = filament(stretching=reduced)
    width = LENGTH / math.sqrt(reduced)
    lower, upper = max(0.0, LENGTH - 12 * width), LENGTH + 14 * width

    def energy(length):
        return 0.5 * chain.segment_stiffness * (length - LENGTH) ** 2

    mean = average_over_length(energy, lower, upper, energy)
    variance = average_over_length(energy, lower, upper, lambda length: (energy(length) - mean) ** 2)
    assert theory.stretching_energy_mean(chain, TEMPERATURE) == pytest.approx(mean, rel=1e-8)
    assert theory.stretching_energy_variance(chain, TEMPERATURE) == pytest.approx(variance, rel=1e-8)


def test_printed_stretching_energy_has_the_weight_l_where_the_equilibrium_has_its_square():
    reduced = 2.0
    chain = filament(stretching=reduced)
    y = 0.5 * reduced
    bracket = math.sqrt(math.pi * y) * math.erfc(-math.sqrt(y))
    printed = KT * (0.5 * bracket + math.exp(-y)) / (bracket + math.exp(-y))

    def energy(length):
        return 0.5 * chain.segment_stiffness * (length - LENGTH) ** 2

    assert average_over_length(energy, 0.0, 15 * LENGTH, energy, power=1) == pytest.approx(printed, rel=1e-9)
    assert theory.stretching_energy_mean(chain, TEMPERATURE) > 1.1 * printed


def test_stretching_energy_of_stiff_segments_has_its_leading_correction():
    mean = theory.stretching_energy_mean(filament(stretching=400.0), TEMPERATURE)
    assert mean == pytest.approx(0.5 * KT * (1 + 2 / 401), rel=1e-12)
    assert theory.stretching_energy_mean(F_ACTIN, TEMPERATURE) == pytest.approx(0.5 * KT, rel=2e-6)


def test_stretching_energy_moments_of_fene_match_quadrature():
    chain = filament(stretching=50.0, stretching_model="fene", maximum_extension=50.0)

    def energy(length):
        return -0.5 * chain.segment_stiffness * 50.0**2 * math.log1p(-(((length - LENGTH) / 50.0) ** 2))

    bounds = (50.0 + 1e-9, 150.0 - 1e-9)
    mean = average_over_length(energy, *bounds, energy)
    variance = average_over_length(energy, *bounds, lambda length: (energy(length) - mean) ** 2)
    assert theory.stretching_energy_mean(chain, TEMPERATURE) == pytest.approx(mean, rel=1e-6)
    assert theory.stretching_energy_variance(chain, TEMPERATURE) == pytest.approx(variance, rel=1e-6)


def test_chain_end_to_end_is_the_double_sum_over_segments():
    chain, segments = filament(2.0, 20.0, bending_model="kratky-porod"), 7
    cosine = 1 / math.tanh(2.0) - 0.5

    def energy(length):
        return 0.5 * chain.segment_stiffness * (length - LENGTH) ** 2

    mean, square = (average_over_length(energy, 0.0, 5 * LENGTH, lambda length, n=n: length**n) for n in (1, 2))
    table = np.array([[square if i == j else mean**2 * cosine ** abs(i - j) for i in range(7)] for j in range(7)])
    assert theory.mean_joint_cosine(chain, TEMPERATURE) == pytest.approx(cosine, rel=1e-9)
    assert theory.chain_mean_square_end_to_end(chain, segments, TEMPERATURE) == pytest.approx(table.sum(), rel=1e-9)
    nodes = range(segments + 1)
    pairs = sum(table[i:j, i:j].sum() for i in nodes for j in nodes if i < j) / (segments + 1) ** 2
    gyration = theory.chain_mean_square_radius_of_gyration(chain, segments, TEMPERATURE)
    assert gyration == pytest.approx(pairs, rel=1e-9)


def test_chain_sizes_match_draws_from_equilibrium():
    chain, segments, generator = filament(3.0, 30.0), 12, np.random.default_rng(20)
    nodes = np.array([draw_chain(chain, segments, TEMPERATURE, generator) for _ in range(1500)])
    square = np.sum((nodes[:, -1] - nodes[:, 0]) ** 2, axis=-1)
    gyration = np.var(nodes, axis=1).sum(axis=-1)
    for sample, exact in (
        (square, theory.chain_mean_square_end_to_end(chain, segments, TEMPERATURE)),
        (gyration, theory.chain_mean_square_radius_of_gyration(chain, segments, TEMPERATURE)),
    ):
        assert abs(sample.mean() - exact) < 4 * sample.std(ddof=1) / math.sqrt(len(sample))


def test_chain_tends_to_the_freely_jointed_and_to_the_wormlike_chain():
    free = filament(0.0, 1e8)
    assert theory.chain_mean_square_end_to_end(free, 50, TEMPERATURE) == pytest.approx(50 * LENGTH**2, rel=1e-6)
    fine = filament(1000.0, 1e8)
    wlc = theory.wlc_mean_square_end_to_end(3000 * LENGTH, 1000 * LENGTH)
    assert theory.chain_mean_square_end_to_end(fine, 3000, TEMPERATURE) == pytest.approx(wlc, rel=2e-3)
    assert theory.chain_persistence_length(fine, TEMPERATURE) == pytest.approx(1000 * LENGTH, rel=2e-3)


def test_chain_tangent_correlation_decays_with_the_chain_persistence_length():
    chain = filament(5.0, 1e9)
    lags = np.array([0, 1, 4, 9])
    correlation = theory.chain_tangent_correlation(chain, lags, TEMPERATURE)
    persistence = theory.chain_persistence_length(chain, TEMPERATURE)
    assert correlation == pytest.approx(np.exp(-lags * LENGTH / persistence), rel=1e-7)


def test_bending_mode_variance_of_the_wormlike_chain():
    # kT/EI (L/n pi)^2 for a filament of 15.5 um with EI = 7.3e-26 N m^2, in um and at kT = 4.28e-21 J.
    persistence = 7.3e-26 / 4.28e-21 * unit.meter
    expected = 4.28e-21 / 7.3e-26 * (15.5e-6 / (np.array([1, 2]) * math.pi)) ** 2
    variance = theory.bending_mode_variance([1, 2], 15.5 * unit.micrometer, persistence)
    assert variance * 1e-9 == pytest.approx(expected, rel=1e-12)


def test_bending_modes_of_a_stiff_chain_are_those_of_its_quadratic_energy():
    stiffness, segments, modes = 1e6, 16, np.arange(1, 16)
    variance = theory.chain_bending_mode_variance(filament(stiffness, 1e12), segments, modes, TEMPERATURE)
    weak = LENGTH / (4 * stiffness * np.sin(modes * math.pi / (2 * segments)) ** 2)
    assert variance == pytest.approx(weak, rel=1e-4)
    continuous = theory.bending_mode_variance(1, segments * LENGTH, stiffness * LENGTH)
    assert variance[0] == pytest.approx(continuous, rel=4e-3)


def test_bending_modes_of_a_flexible_chain_match_draws():
    chain, segments, generator = filament(2.0, 100.0), 6, np.random.default_rng(5)
    steps = np.diff([draw_chain(chain, segments, TEMPERATURE, generator) for _ in range(1500)], axis=1)
    lengths = np.linalg.norm(steps, axis=-1, keepdims=True)
    for mode in (1, 3, 5):
        cosine = np.cos(mode * math.pi * (np.arange(segments) + 0.5) / segments)
        vectors = np.einsum("i,fix->fx", cosine, steps / lengths) * math.sqrt(2 * lengths.mean() / segments)
        sample = 0.5 * np.sum(vectors**2, axis=-1)
        exact = theory.chain_bending_mode_variance(chain, segments, mode, TEMPERATURE)
        assert abs(sample.mean() - exact) < 4 * sample.std(ddof=1) / math.sqrt(len(sample))


def test_bending_modes_of_a_freely_jointed_chain_are_white():
    variance = theory.chain_bending_mode_variance(filament(0.0, 1e10), 8, [1, 4, 7], TEMPERATURE)
    assert variance == pytest.approx(0.5 * LENGTH * np.ones(3), rel=1e-6)


def test_marko_siggia_force_and_extension_are_inverse_over_many_decades():
    forces = np.logspace(-9, 6, 61)
    extensions = theory.marko_siggia_extension(forces, 50.0, TEMPERATURE)
    assert np.all(np.diff(extensions) > 0) and extensions[-1] < 1
    assert theory.marko_siggia_force(extensions, 50.0, TEMPERATURE) == pytest.approx(forces, rel=1e-10)


def test_marko_siggia_limits_and_known_values():
    scale = KT / 50.0
    assert theory.marko_siggia_extension(0.0, 50.0, TEMPERATURE) == 0.0
    assert theory.marko_siggia_extension(1e-9 * scale, 50.0, TEMPERATURE) == pytest.approx(2e-9 / 3, rel=1e-8)
    assert 1 - theory.marko_siggia_extension(1e8 * scale, 50.0, TEMPERATURE) == pytest.approx(0.5e-4, rel=1e-6)
    # At half extension the bracket of (34) is 1 - 1/4 + 1/2.
    assert theory.marko_siggia_force(0.5, 50.0, TEMPERATURE) == pytest.approx(1.25 * scale, rel=1e-14)
    force = 0.1 * unit.piconewton
    with_units = theory.marko_siggia_extension(force, 50 * unit.nanometer, TEMPERATURE * unit.kelvin)
    assert with_units == pytest.approx(theory.marko_siggia_extension(0.1 * PICONEWTON, 50.0, TEMPERATURE), rel=1e-9)
    # lambda-DNA (lp = 50 nm) is known to be about half extended at 0.1 pN.
    assert with_units == pytest.approx(0.49, abs=0.01)


def test_marko_siggia_rejects_what_the_interpolation_does_not_cover():
    for extension in (-0.1, 1.0, 1.5, float("nan")):
        with pytest.raises(InputError):
            theory.marko_siggia_force(extension, 50.0, TEMPERATURE)
    with pytest.raises(InputError):
        theory.marko_siggia_extension(-1.0, 50.0, TEMPERATURE)


def test_springs_of_a_straight_chain():
    stiffness, segments, contour = F_ACTIN.segment_stiffness, 64, 64 * 360.0
    limit = theory.limiting_spring_constant(48.7 * unit.piconewton / unit.nanometer, segments)
    assert limit == pytest.approx(48.7 / 64 * PICONEWTON, rel=1e-9)
    force = theory.linear_force([contour + 10.0, contour - 1.0], contour, stiffness, segments)
    assert force == pytest.approx([10 * limit, -limit], rel=1e-12)
    assert theory.effective_spring_constant(force[0], contour + 10.0, contour) == pytest.approx(limit)
    with pytest.raises(InputError, match="diverges"):
        theory.effective_spring_constant(1.0, contour, contour)


def test_spring_constant_where_bending_rules_is_the_asymptote_of_the_interpolation():
    contour, persistence = 23040.0, 17200.0
    force = np.array([100.0, 400.0]) * KT / persistence
    extension = contour * theory.marko_siggia_extension(force, persistence, TEMPERATURE)
    effective = theory.effective_spring_constant(force, extension, contour)
    asymptote = theory.marko_siggia_spring_constant(force, contour, persistence, TEMPERATURE)
    assert asymptote == pytest.approx(effective, rel=5e-3)
    assert asymptote[1] / asymptote[0] == pytest.approx(8.0, rel=1e-12)


def test_crossover_force_is_where_the_asymptotes_cross_and_near_that_of_the_paper():
    stiffness = F_ACTIN.segment_stiffness
    force = theory.crossover_force(23040.0, 17200.0, stiffness, 64, TEMPERATURE)
    bending = theory.marko_siggia_spring_constant(force, 23040.0, 17200.0, TEMPERATURE)
    assert bending == pytest.approx(theory.limiting_spring_constant(stiffness, 64), rel=1e-12)
    # The paper fits both asymptotes to its data and finds 23.93 pN.
    assert force / PICONEWTON == pytest.approx(23.93, rel=0.15)


@pytest.fixture(scope="module")
def friction():
    return F_ACTIN.segment_friction(1.71e-3 * unit.pascal * unit.second, TEMPERATURE)


def test_orientation_relaxes_with_the_time_of_the_paper(friction):
    relaxation = 2.676 * unit.millisecond
    assert theory.mean_orientation(relaxation, friction, TEMPERATURE) == pytest.approx(math.exp(-1), rel=3e-4)
    times = np.array([0.0, 2.676e9, 5.352e9])
    expected = np.exp([0.0, -1.0, -2.0])
    assert theory.mean_orientation(times, friction, TEMPERATURE) == pytest.approx(expected, rel=1e-3)


def test_free_segment_displacement_has_its_limits(friction):
    early, late = 1e3, 1e14
    full = theory.free_segment_mean_square_displacement(early, friction, TEMPERATURE)
    assert full == pytest.approx(theory.short_time_mean_square_displacement(early, friction, TEMPERATURE), rel=1e-5)
    full = theory.free_segment_mean_square_displacement(late, friction, TEMPERATURE)
    isotropic = theory.long_time_mean_square_displacement(late, friction, TEMPERATURE)
    assert full == pytest.approx((isotropic, isotropic), rel=1e-4)
    assert full[0] > full[1]


def test_free_segment_displacement_matches_brute_force(friction):
    generator = np.random.default_rng(11)
    rods, steps, end = 6000, 300, 4e9
    step = end / steps
    axis = np.tile([1.0, 0.0, 0.0], (rods, 1))
    position = np.zeros((rods, 3))
    turn, along, across = (
        math.sqrt(2 * KT * step / value) for value in (friction.rotational, friction.parallel, friction.perpendicular)
    )
    for _ in range(steps):
        turned = axis + turn * np.cross(axis, generator.normal(size=(rods, 3)))
        turned /= np.linalg.norm(turned, axis=-1, keepdims=True)
        middle = axis + turned
        middle /= np.linalg.norm(middle, axis=-1, keepdims=True)
        kick = generator.normal(size=(rods, 3))
        parallel = np.sum(kick * middle, axis=-1, keepdims=True) * middle
        position += along * parallel + across * (kick - parallel)
        axis = turned
    exact = theory.free_segment_mean_square_displacement(end, friction, TEMPERATURE)
    for sample, expected in ((position[:, 0] ** 2, exact[0]), (position[:, 1:].ravel() ** 2, exact[1])):
        assert abs(sample.mean() - expected) < 4 * sample.std(ddof=1) / math.sqrt(sample.size)
    orientation = theory.mean_orientation(end, friction, TEMPERATURE)
    assert abs(axis[:, 0].mean() - orientation) < 4 * axis[:, 0].std() / math.sqrt(rods)


def test_results_are_plain_numbers_for_plain_input():
    values = (
        theory.wlc_mean_square_end_to_end(10.0, 5.0),
        theory.marko_siggia_extension(1.0, 5.0, 300.0),
        theory.bending_energy_mean(DSDNA, 300.0),
        theory.stretching_energy_variance(DSDNA, 300.0),
        theory.chain_bending_mode_variance(DSDNA, 5, 1, 300.0),
        theory.chain_mean_square_end_to_end(DSDNA, 1, 300.0),
    )
    assert all(isinstance(value, float) and math.isfinite(value) for value in values)


@pytest.mark.parametrize(
    "call",
    [
        lambda: theory.wlc_mean_square_end_to_end(-1.0, 5.0),
        lambda: theory.wlc_mean_square_end_to_end(1.0, 0.0),
        lambda: theory.wlc_mean_square_end_to_end(1.0 * unit.second, 5.0),
        lambda: theory.bending_energy_mean(F_ACTIN, 0.0),
        lambda: theory.stretching_energy_mean(F_ACTIN, -5.0),
        lambda: theory.chain_mean_square_end_to_end(F_ACTIN, 0, 300.0),
        lambda: theory.chain_mean_square_end_to_end(F_ACTIN, 2.5, 300.0),
        lambda: theory.chain_tangent_correlation(F_ACTIN, [0.5], 300.0),
        lambda: theory.chain_bending_mode_variance(F_ACTIN, 8, 8, 300.0),
        lambda: theory.bending_mode_variance(0, 10.0, 10.0),
        lambda: theory.mean_orientation(-1.0, F_ACTIN.segment_friction(1000.0, 300.0), 300.0),
    ],
)
def test_input_outside_the_range_is_refused(call):
    with pytest.raises(InputError):
        call()


def test_joints_stiffen_against_k_t_as_the_temperature_falls():
    # The rigidity is a property of the filament, so at half the temperature a joint is twice as stiff.
    actin = replace(F_ACTIN, temperature=None)
    cold = theory.bending_energy_mean(actin, 155.0) / thermal_energy(155.0)
    stiffer = replace(actin, bending_rigidity=2 * actin.bending_rigidity)
    assert cold == pytest.approx(theory.bending_energy_mean(stiffer, 310.0) / KT, rel=1e-12)


@pytest.mark.parametrize("model", BENDING_MODELS)
@pytest.mark.parametrize("stiffness", [0.3, 10.0, 1e3, 1e8])
def test_moments_of_any_bending_model_by_quadrature(model, stiffness):
    kind = filament(stiffness, bending_model=model)
    mean, variance = energies._moments_by_quadrature(kind.bending_potential, stiffness)
    # The cosine of a stiff joint has lost the digits of its angle.
    accuracy = 1e-8 if stiffness < 1e6 else 1e-7
    assert mean * KT == pytest.approx(theory.bending_energy_mean(kind, TEMPERATURE), rel=accuracy)
    assert variance * KT**2 == pytest.approx(theory.bending_energy_variance(kind, TEMPERATURE), rel=accuracy)


def test_long_chain_has_what_one_more_segment_adds():
    forces = np.array([0.3, 3.0, 30.0]) * PICONEWTON
    added = np.subtract(*(theory.chain_extension(DSDNA, segments, forces, TEMPERATURE) for segments in (121, 120)))
    assert theory.long_chain_extension(DSDNA, forces, TEMPERATURE) == pytest.approx(added, rel=1e-8)


def test_extension_of_the_wormlike_chain():
    """Beside the interpolation of Bouchiat et al., Biophys. J. 1999, 76, 409, and at large and small forces."""
    length, modulus = 43.3, 1100 * PICONEWTON
    extensions = np.array([0.1, 0.3, 0.5, 0.7, 0.9, 0.97])
    corrections = (-0.5164228, -2.737418, 16.07497, -38.87607, 39.49944, -14.17718)
    forces = theory.marko_siggia_force(extensions, length, TEMPERATURE)
    forces += KT / length * sum(a * extensions**power for power, a in enumerate(corrections, 2))
    assert theory.wlc_relative_extension(forces, length, TEMPERATURE) == pytest.approx(extensions, abs=5e-4)
    for force in (20 * PICONEWTON, 200 * PICONEWTON):
        # By F of F + F^2/2EA - (k_B T (F + F^2/EA)/lp)^(1/2).
        strain = force / modulus
        expected = 1 + strain - 0.5 * math.sqrt(KT / (force * length * (1 + strain))) * (1 + 2 * strain)
        assert theory.wlc_relative_extension(force, length, TEMPERATURE, modulus) == pytest.approx(expected, abs=1e-3)
    weak = 1e-4 * KT / length
    assert theory.wlc_relative_extension(weak, length, TEMPERATURE) == pytest.approx(2e-4 / 3, rel=1e-6)
    assert theory.wlc_relative_extension(0.0, length, TEMPERATURE, modulus) == pytest.approx(0, abs=1e-12)


def wlc_force(extension):
    """That which holds the wormlike chain of DSDNA at a relative extension."""
    return brentq(
        lambda force: theory.wlc_relative_extension(force, 43.3, TEMPERATURE, 1100 * PICONEWTON) - extension, 1e-4, 60.0
    )


def share_of_force(kind, contour, force):
    wanted = contour * theory.wlc_relative_extension(force, 43.3, TEMPERATURE, 1100 * PICONEWTON)
    return brentq(
        lambda share: theory.long_chain_extension(kind, share * force, TEMPERATURE) - wanted, 0.3, 2.0, xtol=1e-6
    )


def test_force_of_dna_in_segments():
    """Not of a wormlike chain, however it is cut; finer segments are longer by 2 k_B T/k each, from the weight l^2."""
    for length, shares in {8.0: (0.956, 0.667), 2.0: (0.955, 0.862), 1.0: (0.916, 0.796)}.items():
        kind = DSDNA.with_segment_length(length)
        for newton, expected in zip((1, 20), shares):
            exact = share_of_force(kind, length, newton * PICONEWTON)
            assert exact == pytest.approx(expected, abs=2e-3)
            closed = theory.wlc_share_of_force(kind, newton * PICONEWTON, TEMPERATURE)
            assert closed == pytest.approx(exact, abs=0.05)


@pytest.mark.parametrize(
    "length, largest_error",
    [pytest.param(8.0, 0.03, marks=pytest.mark.slow), (4.0, 0.008), pytest.param(2.0, 0.002, marks=pytest.mark.slow)],
)
def test_calibrated_dna_is_a_wormlike_chain(length, largest_error):
    """In its force at every extension up to that at 20 pN, and in C_eff from 1 pN on."""
    dna = replace(DSDNA.with_segment_length(length), twist_persistence_length=100.0)
    kind = theory.calibrated_up_to_force(dna, 20 * unit.piconewton, TEMPERATURE, within=0.03)
    assert kind.contour_per_segment == length and kind.calibrated_force == pytest.approx(20 * PICONEWTON)
    errors = []
    for force in (0.01, 0.3, 1.3, 7.0, 16.0, 20.0):
        extension = theory.long_chain_extension(kind, force * PICONEWTON, TEMPERATURE) / length
        errors.append(abs(wlc_force(extension) / (force * PICONEWTON) - 1))
    assert 0.5 * largest_error < max(errors) < largest_error
    forces = np.array([1.0, 2.0, 5.0, 10.0, 20.0]) * PICONEWTON
    # Moroz and Nelson 1997.
    expected = KT / (1 / 100.0 + 1 / (4 * 43.3 * np.sqrt(43.3 * forces / KT)))

    def rigidities(kind, contour):
        own = [theory.twisted_chain(kind, force, 0, TEMPERATURE).effective_torsional_rigidity for force in forces]
        return np.array(own) * contour / kind.segment_length

    assert np.abs(rigidities(kind, length) / expected - 1).max() < (0.012 if length == 8.0 else 0.006)
    assert np.abs(rigidities(dna, length) / expected - 1).max() > 0.015


def test_calibration_says_how_near_segments_come():
    with pytest.raises(InputError, match="up to 20 pN within 2.8 % of the force, but 1 % are allowed"):
        theory.calibrated_up_to_force(DSDNA, 20 * unit.piconewton, TEMPERATURE)


def test_calibration_of_actin_with_a_stiffness_given_for_a_segment():
    kind = theory.calibrated_up_to_force(F_ACTIN, 0.1 * unit.piconewton, TEMPERATURE)
    assert 0.9 < kind.segment_length / kind.contour_per_segment < 1.0


def test_types_that_cannot_be_calibrated():
    calibrated = theory.calibrated_up_to_force(DSDNA.with_segment_length(2.0), 5 * unit.piconewton, TEMPERATURE)
    fene = replace(DSDNA, stretching_model="fene", maximum_extension=1.0)
    for kind, message in (
        (calibrated, "calibrated up to a force already"),
        (fene, "FENE"),
        (replace(DSDNA, bending_rigidity=0.0, temperature=None), "do not bend back"),
        (replace(DSDNA, element="beam"), "beam elements"),
    ):
        with pytest.raises(InputError, match=message):
            theory.calibrated_up_to_force(kind, 5 * unit.piconewton, TEMPERATURE)
    with pytest.raises(InputError, match="cut first"):
        calibrated.with_segment_length(4.0)
    with pytest.raises(InputError, match="calibrated up to a force already"):
        theory.wlc_share_of_force(calibrated, 1.0, TEMPERATURE)
    with pytest.raises(InputError, match="belong together"):
        replace(DSDNA, calibrated_force=1.0)
    with pytest.raises(InputError, match="force"):
        theory.calibrated_up_to_force(DSDNA, 0.0, TEMPERATURE)


def test_the_j_factor_of_a_wormlike_chain_is_that_of_its_fine_chain():
    # Four million draws of chains in segments of a twentieth of the persistence length, with 0.03 k_BT/nm^2.
    drawn = {100.0: 4.40e-8, 150.0: 6.90e-8, 200.0: 6.90e-8}
    lengths = np.array(list(drawn))
    assert theory.wlc_j_factor(lengths, 50 * unit.nanometer) == pytest.approx(np.array(list(drawn.values())), rel=0.1)
    assert theory.wlc_j_factor(0.1 * unit.micrometer, 50.0) == pytest.approx(4.064e-8, rel=1e-3)
