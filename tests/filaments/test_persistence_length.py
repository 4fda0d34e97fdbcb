"""Persistence length: tangents of the discrete chain decorrelate over the length that the type says."""

import copy
import math
import pickle
import re
from dataclasses import replace

import numpy as np
import pytest
from openmm import unit
from scipy.integrate import quad

from openmm_cylchain import DSDNA, F_ACTIN, MICROTUBULE, EndCorrections, Filaments, FilamentType, InputError, theory
from openmm_cylchain.filaments.equilibrium import JointAngleDistribution, PlanarJointAngleDistribution, draw_chain
from openmm_cylchain.filaments.joint_calibration import calibrated_stiffness, tangent_decorrelation
from openmm_cylchain.runs.reference import reference_page
from support.bending_models import BENDING_MODELS
from support.contexts import new_context, positions_of
from support.solvent import TEMPERATURE, VISCOSITY

KT = 8.31446262e-3 * TEMPERATURE
SIGMAS = 4.0
PRESETS = [(F_ACTIN, 360.0), (F_ACTIN, 60.0), (DSDNA, 8.0), (DSDNA, 4.0), (DSDNA, 2.0), (DSDNA, 1.0)]
PRESET_LENGTHS = {"ACT": 17200.0, "DNA": 43.3}


def chain(ratio, model="inscribed-circle", **changes):
    """Segments of 100 nm and a persistence length of 100 nm over the ratio."""
    arguments = dict(
        name="WLC",
        diameter=5.0,
        segment_length=100.0,
        persistence_length=100.0 / ratio,
        temperature=TEMPERATURE,
        stretching_stiffness=3e4,
        bending_model=model,
    )
    return FilamentType(**{**arguments, **changes})


def mean_bend(model, stiffness, kT=KT):
    """<1 - c> by adaptive quadrature, independent of the code."""
    reduced = stiffness / kT
    widest = min(math.pi, 15 / math.sqrt(reduced))

    def integral(power):
        def weight(angle):
            return math.exp(-reduced * BENDING_MODELS[model].energy(angle)) * math.sin(angle)

        return quad(
            lambda angle: (2 * math.sin(angle / 2) ** 2) ** power * weight(angle), 0, widest, epsabs=0, epsrel=1e-11
        )[0]

    return integral(1) / integral(0)


@pytest.mark.parametrize("model", BENDING_MODELS)
@pytest.mark.parametrize("ratio", [1e-5, 0.003, 0.05, 8 / 43.3, 0.7, 2.0, 5.0])
def test_tangents_decorrelate_over_the_persistence_length(model, ratio):
    kind = chain(ratio, model)
    assert mean_bend(model, kind.joint_stiffness) == pytest.approx(-math.expm1(-ratio), rel=1e-8)
    assert theory.mean_joint_cosine(kind, TEMPERATURE) == pytest.approx(math.exp(-ratio), rel=1e-7)
    # The chain's contour is a little longer than its rest length.
    length = theory.chain_persistence_length(kind, TEMPERATURE)
    assert length == pytest.approx(kind.persistence_length_at(TEMPERATURE), rel=1e-4)


@pytest.mark.parametrize("model", BENDING_MODELS)
@pytest.mark.parametrize("kind, length", PRESETS)
def test_presets_are_what_their_label_says(kind, length, model):
    kind = replace(kind.with_segment_length(length), bending_model=model)
    expected = -math.expm1(-length / PRESET_LENGTHS[kind.name])
    assert mean_bend(model, kind.joint_stiffness) == pytest.approx(expected, rel=1e-8)
    lags = np.arange(6)
    correlation = theory.chain_tangent_correlation(kind, lags, TEMPERATURE)
    assert correlation == pytest.approx(np.exp(-lags * length / PRESET_LENGTHS[kind.name]), rel=1e-7)


@pytest.mark.parametrize("model", BENDING_MODELS)
def test_weak_joints_reach_every_correlation(model):
    for decorrelation in (10.0, 25.0, 80.0):
        stiffness = calibrated_stiffness(model, decorrelation)
        assert 0 < stiffness < 1e-2
        assert tangent_decorrelation(model, stiffness) == pytest.approx(decorrelation, rel=1e-9)
    # A chain that is freely jointed for all purposes still has a stiffness above zero, and finite energies.
    free = chain(1e4, model)
    assert 0 < free.joint_stiffness < 1e-30
    assert free.bending_energy(0.5) < 1e-30


@pytest.mark.parametrize("model", BENDING_MODELS)
def test_stiffness_tends_to_the_rigidity_over_the_segment_length(model):
    """K l0/a - 1 falls with l0/l_p: by -1/6 - 16 q for the energy K (angle^2/2 + q angle^4).

    The slope of Kratky-Porod joints, K/k_BT = 1/(1 - exp(-l0/l_p)), is 1/2, and their q is -1/24.
    """
    quartic = (BENDING_MODELS[model].energy(0.01) - 0.01**2 / 2) / 0.01**4
    for ratio in (0.02, 0.002):
        deviation = chain(ratio, model).joint_stiffness * ratio / KT - 1
        assert deviation == pytest.approx((-1 / 6 - 16 * quartic) * ratio, abs=3 * ratio**2)


def test_quantities_and_plain_numbers_make_the_same_type():
    plain = chain(0.5)
    quantities = chain(0.5, persistence_length=0.2 * unit.micrometer, temperature=310 * unit.kelvin)
    assert quantities.joint_stiffness == pytest.approx(plain.joint_stiffness, rel=1e-12)
    assert quantities.temperature == plain.temperature == 310.0


def test_copies_keep_the_persistence_length():
    kind = chain(0.3, "quadratic")
    for twin in (copy.copy(kind), copy.deepcopy(kind), pickle.loads(pickle.dumps(kind)), replace(kind)):
        assert twin == kind and hash(twin) == hash(kind)
        assert twin.joint_stiffness == kind.joint_stiffness
    assert eval(repr(kind), {"FilamentType": FilamentType, "EndCorrections": EndCorrections}) == kind
    assert kind.persistence_length_at(TEMPERATURE) == pytest.approx(100 / 0.3, rel=1e-12)


def test_another_segment_length_or_model_keeps_the_persistence_length():
    kind = chain(0.3)
    for changed in (kind.with_segment_length(20), replace(kind, segment_length=20.0)):
        assert theory.mean_joint_cosine(changed, TEMPERATURE) == pytest.approx(math.exp(-0.06), rel=1e-7)
    changed = replace(kind, bending_model="kratky-porod")
    assert theory.mean_joint_cosine(changed, TEMPERATURE) == pytest.approx(math.exp(-0.3), rel=1e-7)
    changed = replace(kind, bending_rigidity=None, persistence_length=50.0)
    assert theory.mean_joint_cosine(changed, TEMPERATURE) == pytest.approx(math.exp(-2), rel=1e-7)
    with pytest.raises(InputError, match="set it to None where persistence_length takes its place"):
        replace(kind, persistence_length=50.0)


def test_bending_rigidity_gives_the_joints_of_the_paper():
    kind = chain(0.3, persistence_length=None, temperature=None, bending_rigidity=1000.0)
    assert kind.joint_stiffness == 10.0
    assert kind.clamped_joint_stiffness == 20.0
    assert replace(chain(0.3), temperature=None).joint_stiffness == pytest.approx(KT / 0.3, rel=1e-8)
    # The two together are the persistence length.
    both = chain(0.3, persistence_length=None, bending_rigidity=1000.0)
    assert both == replace(kind, temperature=TEMPERATURE)
    assert both.joint_stiffness == pytest.approx(chain(100.0 * KT / 1000.0).joint_stiffness, rel=1e-8)
    assert MICROTUBULE.joint_stiffness == MICROTUBULE.bending_rigidity / 1000.0


def test_the_stiffness_stays_at_another_temperature():
    kind, cold = chain(0.5, "kratky-porod"), 155.0
    reduced = kind.joint_stiffness / (0.5 * KT)
    # Langevin's function.
    assert theory.mean_joint_cosine(kind, cold) == pytest.approx(1 / math.tanh(reduced) - 1 / reduced, rel=1e-8)


@pytest.mark.parametrize("model", BENDING_MODELS)
def test_joint_at_a_clamp_is_that_of_half_a_segment(model):
    kind = chain(0.4, model)
    assert mean_bend(model, kind.clamped_joint_stiffness) == pytest.approx(-math.expm1(-0.2), rel=1e-8)
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine="portable")
    filaments.add_straight(kind, 4, [0, 0, 0], [1, 0, 0], clamped=[0, 1])
    expected = [kind.clamped_joint_stiffness, kind.joint_stiffness, kind.joint_stiffness]
    assert list(filaments[0].joint_stiffnesses) == expected


def test_a_filament_whose_first_segment_is_held_is_clamped_at_node_1():
    """Under a small force at its tip it bends as a rod of the length L - l0, within 1/(2 n^2) of n free segments."""
    kind = FilamentType(
        name="ROD",
        diameter=8.0,
        segment_length=50.0,
        bending_rigidity=4e4,
        stretching_stiffness=1e3,
        extension_relaxation_time=1.0,
    )
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine="portable")
    filaments.add_straight(kind, 21, [0, 0, 0], [1, 0, 0], clamped=[0, 1])
    levers = 50.0 * np.arange(20, 0, -1)
    compliance = np.sum(levers**2 / filaments[0].joint_stiffnesses)
    assert compliance == pytest.approx(1000.0**3 / (3 * 4e4), rel=1.01 / (2 * 20**2))
    assert compliance < 0.87 * 1050.0**3 / (3 * 4e4)
    # The key and the docstring say so.
    for text in (reference_page(), Filaments.add_straight.__doc__):
        assert re.search(r"\[0, 1\].{0,40}node 1", text, re.DOTALL)


@pytest.mark.parametrize("model", BENDING_MODELS)
def test_in_a_plane_tangents_decorrelate_over_twice_the_length(model):
    """About, and exactly in the limit of short segments: the stiffness of a joint is the one in space."""
    for ratio, tolerance in ((0.1, 0.06), (0.001, 6e-4)):
        mean = PlanarJointAngleDistribution(chain(ratio, model), TEMPERATURE).mean(lambda angle: 1 - np.cos(angle))
        assert -math.log1p(-mean) == pytest.approx(ratio / 2, rel=tolerance)
        length = theory.chain_persistence_length(chain(ratio, model), TEMPERATURE, planar=True)
        assert length == pytest.approx(100.0 / ratio, rel=tolerance)


# DNA cut into ever shorter segments


def test_friction_of_a_length_of_dna_does_not_grow_with_its_segments():
    whole = DSDNA.segment_friction(VISCOSITY, TEMPERATURE)
    assert whole == replace(DSDNA, friction_length="segment").segment_friction(VISCOSITY, TEMPERATURE)
    for parts in (2, 4, 8, 16):
        cut = DSDNA.with_segment_length(8 / parts).segment_friction(VISCOSITY, TEMPERATURE)
        assert parts * cut.parallel == pytest.approx(whole.parallel, rel=1e-12)
        assert parts * cut.perpendicular == pytest.approx(whole.perpendicular, rel=1e-12)
        assert parts**3 * cut.rotational == pytest.approx(whole.rotational, rel=1e-12)
    long = DSDNA.with_segment_length(20)
    assert long.segment_friction(VISCOSITY, 310) == replace(long, friction_length="segment").segment_friction(
        VISCOSITY, 310
    )


def test_friction_length_takes_quantities_and_plain_numbers():
    kind = replace(F_ACTIN, friction_length=0.1 * unit.micrometer)
    assert kind.friction_length == 100.0
    assert kind == replace(F_ACTIN, friction_length=100)
    assert kind.with_segment_length(5).friction_length == 100.0
    for value, message in ((0, "must be positive"), (8.0, "rotational friction"), (1 * unit.kelvin, "has the unit")):
        with pytest.raises(InputError, match=f"(?s)(?=.*'ACT').*{message}"):
            replace(F_ACTIN, segment_length=5.0, friction_length=value)


def test_too_short_segments_are_told_what_to_do():
    with pytest.raises(InputError, match="friction_length='filament'.* or a length .* above 9.382 nm"):
        F_ACTIN.with_segment_length(5)


def test_end_to_end_distance_of_dna_converges():
    contour = 400.0
    exact = theory.wlc_mean_square_end_to_end(contour, 43.3)
    stiff = replace(DSDNA, stretching_modulus=1e6 * DSDNA.stretching_modulus)
    errors = []
    for length in (8.0, 4.0, 2.0, 1.0):
        segments = round(contour / length)
        cut = stiff.with_segment_length(length)
        errors.append(theory.chain_mean_square_end_to_end(cut, segments, TEMPERATURE) / exact - 1)
        # As it stretches, a segment lengthens by 2 k_BT/EA on average, so that <R^2> grows.
        stretched = theory.chain_mean_square_end_to_end(DSDNA.with_segment_length(length), segments, TEMPERATURE)
        lengthened = (1 + 2 * KT / (DSDNA.stretching_modulus * length)) ** 2
        assert stretched == pytest.approx(exact * (1 + errors[-1]) * lengthened, rel=1e-3)
    assert abs(errors[0]) < 5e-3
    for coarse, fine in zip(errors, errors[1:]):
        assert coarse / fine == pytest.approx(4, rel=0.03)


@pytest.mark.parametrize("kind, length", PRESETS)
def test_draws_have_the_persistence_length(kind, length):
    kind = kind.with_segment_length(length)
    nodes = draw_chain(kind, 15000, TEMPERATURE, np.random.default_rng(5))
    tangents = np.diff(nodes, axis=0)
    tangents /= np.linalg.norm(tangents, axis=1)[:, None]
    bends = 0.5 * np.sum(np.diff(tangents, axis=0) ** 2, axis=1)
    exact = -math.expm1(-length / PRESET_LENGTHS[kind.name])
    error = bends.std(ddof=1) / math.sqrt(len(bends))
    assert error < 0.01 * exact
    assert abs(bends.mean() - exact) < SIGMAS * error


@pytest.mark.parametrize("length", [8.0, 4.0, 2.0])
def test_end_to_end_distance_of_drawn_dna(length):
    segments, chains = round(64 / length), 1500
    kind = DSDNA.with_segment_length(length)
    generator = np.random.default_rng(8)
    ends = [draw_chain(kind, segments, TEMPERATURE, generator)[-1] for _ in range(chains)]
    squares = np.sum(np.square(ends), axis=1)
    error = squares.std(ddof=1) / math.sqrt(chains)
    assert error < 0.012 * squares.mean()
    assert abs(squares.mean() - theory.wlc_mean_square_end_to_end(64.0, 43.3)) < SIGMAS * error + 0.01 * squares.mean()


@pytest.mark.parametrize("kind, length", [(DSDNA, 8.0), (DSDNA, 2.0), (F_ACTIN, 360.0)])
def test_simulations_keep_the_persistence_length(kind, length):
    kind = kind.with_segment_length(length)
    segments, chains = 12, 600
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine="compiled")
    for seed in range(chains):
        filaments.add_equilibrium(kind, segments, seed)
    _, system, positions = filaments.build()
    step = filaments.recommended_time_step().step
    integrator = filaments.create_integrator(system, step, random_seed=3)
    context = new_context(system, positions, integrator, "CPU", {"Threads": "1"})
    integrator.step(100)
    bends = []
    for _ in range(20):
        integrator.step(20)
        nodes = positions_of(context).reshape(chains, segments + 1, 3)
        tangents = np.diff(nodes, axis=1)
        tangents /= np.linalg.norm(tangents, axis=2)[..., None]
        bends.append(0.5 * np.sum(np.diff(tangents, axis=1) ** 2, axis=2).mean(axis=1))
    bends = np.mean(bends, axis=0)
    exact = -math.expm1(-length / PRESET_LENGTHS[kind.name])
    error = bends.std(ddof=1) / math.sqrt(chains)
    assert error < 0.01 * exact
    assert abs(bends.mean() - exact) < SIGMAS * error


def test_marginal_of_the_joint_is_that_of_the_calibrated_stiffness():
    kind = DSDNA.with_segment_length(4)
    mean = JointAngleDistribution(kind, TEMPERATURE).mean(lambda cosine: 1 - cosine)
    assert mean == pytest.approx(mean_bend("inscribed-circle", kind.joint_stiffness), rel=1e-6)
