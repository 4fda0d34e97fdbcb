"""Filaments that move in a plane: draws, dynamics and statics against the equilibrium of two dimensions."""

from dataclasses import replace

import numpy as np
import openmm
import pytest
from openmm import unit
from scipy.integrate import quad

from openmm_cylchain import F_ACTIN, Filaments, InputError, theory
from openmm_cylchain.filaments.equilibrium import SegmentLengthDistribution
from support.bending_models import BENDING_MODELS
from support.contexts import new_context, positions_of
from support.dense_mechanics import bent_chain, dense_resistance
from support.equilibrium_cases import CASES, time_step
from support.noise_covariance import assert_covariance, moves_of_a_step
from support.platforms import ENGINE_PLATFORMS, ENGINES, ENGINES_PORTABLE_SLOW, EVERYWHERE
from support.solvent import KT, TEMPERATURE, VISCOSITY

SIGMAS = 4.0
FRICTION = F_ACTIN.segment_friction(VISCOSITY, TEMPERATURE)
# The actin filaments of Chandran and Mofrad, Phys. Rev. E 2009, 79, 011906, Section III C: 62 segments, 15.5 um.
THIN_FILM = replace(F_ACTIN.with_segment_length(250), bending_rigidity=17700 * KT)


def _angles(nodes):
    """Angles between successive segments, (chains, joints)."""
    vectors = np.diff(nodes, axis=1)
    before, behind = vectors[:, :-1], vectors[:, 1:]
    across = before[..., 0] * behind[..., 1] - before[..., 1] * behind[..., 0]
    return np.arctan2(across, np.sum(before * behind, axis=2))


def _assert_mean(values, expected, allowed=0.0):
    per_chain = values.reshape(len(values), -1).mean(axis=1)
    error = per_chain.std(ddof=1) / np.sqrt(len(per_chain))
    assert abs(per_chain.mean() - expected) < SIGMAS * error + allowed
    return error


# Exact averages by quadrature, independent of the package's own


def _joint_average(kind, function, stiffness=1.0):
    def weight(angle):
        return np.exp(-stiffness * float(kind.bending_energy(np.cos(angle))) / KT)

    width = min(np.pi, 12 * np.sqrt(KT / max(kind.joint_stiffness, 1e-3)))
    norm = quad(weight, 0, width, limit=200)[0]
    return quad(lambda angle: function(angle) * weight(angle), 0, width, limit=200)[0] / norm


def _length_average(kind, function):
    width = 10 * np.sqrt(KT / kind.segment_stiffness)
    low, high = max(0.0, kind.segment_length - width), kind.segment_length + width
    if kind.stretching_model == "fene":
        low, high = kind.segment_length - kind.maximum_extension, kind.segment_length + kind.maximum_extension

    def weight(length):
        return length * np.exp(-float(kind.stretching_energy(length)) / KT)

    norm = quad(weight, low, high, limit=200)[0]
    return quad(lambda length: function(length) * weight(length), low, high, limit=200)[0] / norm


def _mean_square_end_to_end(kind, segments):
    cosine = _joint_average(kind, np.cos)
    mean, square = _length_average(kind, lambda length: length), _length_average(kind, lambda length: length**2)
    return segments * square + 2 * mean**2 * sum((segments - k) * cosine**k for k in range(1, segments))


NAMES = ("freely-jointed", *BENDING_MODELS, "fene")


@pytest.mark.parametrize("name", [*NAMES, "f-actin-60nm", "dna-8nm"])
def test_theory_equals_quadrature(name):
    kind = CASES[name].type
    expected = {
        "cosine": _joint_average(kind, np.cos),
        "bending": _joint_average(kind, lambda angle: float(kind.bending_energy(np.cos(angle)))),
        "stretching": _length_average(kind, lambda length: float(kind.stretching_energy(length))),
        "end to end": _mean_square_end_to_end(kind, 7),
    }
    assert theory.mean_joint_cosine(kind, TEMPERATURE, planar=True) == pytest.approx(expected["cosine"], abs=1e-6)
    assert theory.chain_tangent_correlation(kind, 3, TEMPERATURE, planar=True) == pytest.approx(
        expected["cosine"] ** 3, abs=1e-6
    )
    assert theory.bending_energy_mean(kind, TEMPERATURE, planar=True) == pytest.approx(
        expected["bending"], rel=1e-5, abs=1e-9
    )
    assert theory.stretching_energy_mean(kind, TEMPERATURE, planar=True) == pytest.approx(
        expected["stretching"], rel=1e-5
    )
    assert theory.chain_mean_square_end_to_end(kind, 7, TEMPERATURE, planar=True) == pytest.approx(
        expected["end to end"], rel=1e-5
    )
    square = _joint_average(kind, lambda angle: angle**2)
    expected = kind.segment_length * square / (4 * np.sin(np.pi / 7) ** 2)
    assert theory.chain_planar_bending_mode_variance(kind, 7, 2, TEMPERATURE) == pytest.approx(expected, rel=1e-5)


def test_wormlike_chain_of_the_thin_film():
    """Section III C of Chandran and Mofrad: <R^2> = 208.7 um^2 for 15.5 um with l_p = 17.7 um."""
    exact = theory.wlc_mean_square_end_to_end(15.5 * unit.micrometer, 17.7 * unit.micrometer, planar=True) / 1e6
    assert round(exact, 1) == 208.7
    assert theory.chain_mean_square_end_to_end(THIN_FILM, 62, TEMPERATURE, True) / 1e6 == pytest.approx(exact, rel=2e-3)
    assert theory.wlc_tangent_correlation(17700, 17700, planar=True) == pytest.approx(np.exp(-0.5))
    assert theory.mean_joint_cosine(THIN_FILM, TEMPERATURE, planar=True) == pytest.approx(
        np.exp(-250 / 35400), abs=2e-4
    )
    modes = np.arange(1, 8)
    discrete = theory.chain_planar_bending_mode_variance(THIN_FILM, 62, modes, TEMPERATURE)
    wormlike = theory.bending_mode_variance(modes, 15500, 17700)
    assert wormlike == pytest.approx((15500 / (modes * np.pi)) ** 2 / 17700)
    assert discrete == pytest.approx(wormlike, rel=0.03)
    # A rod and a coil.
    assert theory.wlc_mean_square_end_to_end(1.0, 1e6, planar=True) == pytest.approx(1.0, rel=1e-6)
    assert theory.wlc_mean_square_end_to_end(1e6, 1.0, planar=True) == pytest.approx(4e6, rel=1e-5)


# Draws


def _drawn(kind, segments, count, **options):
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine="portable")
    for seed in range(count):
        filaments.add_equilibrium(kind, segments, seed, planar=True, **options)
    return filaments, np.array([filament.positions for filament in filaments])


@pytest.mark.parametrize("name", NAMES)
def test_draws_are_the_equilibrium_of_the_plane(name):
    kind = CASES[name].type
    _, nodes = _drawn(kind, 12, 2500, start=[0, 0, 17.3])
    assert np.all(nodes[..., 2] == 17.3)
    lengths = np.linalg.norm(np.diff(nodes, axis=1), axis=2)
    _assert_mean(lengths, _length_average(kind, lambda length: length))
    _assert_mean(lengths**2, _length_average(kind, lambda length: length**2))
    angles = _angles(nodes)
    _assert_mean(angles, 0.0)
    _assert_mean(np.cos(angles), _joint_average(kind, np.cos))
    _assert_mean(angles**2, _joint_average(kind, lambda angle: angle**2))
    squares = np.sum((nodes[:, -1] - nodes[:, 0]) ** 2, axis=1)
    exact = _mean_square_end_to_end(kind, 12)
    error = _assert_mean(squares, exact)
    assert SIGMAS * error < 0.1 * exact
    first = nodes[:, 1] - nodes[:, 0]
    _assert_mean(first[:, 0] / lengths[:, 0], 0.0)
    _assert_mean((first[:, 0] / lengths[:, 0]) ** 2, 0.5)


def test_draws_of_the_thin_film():
    """<R^2> and the variances of bending modes, eqs. (44) to (46) of Chandran and Mofrad."""
    _, nodes = _drawn(THIN_FILM, 62, 2500)
    squares = np.sum((nodes[:, -1] - nodes[:, 0]) ** 2, axis=1) / 1e6
    discrete = theory.chain_mean_square_end_to_end(THIN_FILM, 62, TEMPERATURE, planar=True) / 1e6
    error = _assert_mean(squares, discrete)
    assert SIGMAS * error < 0.02 * 208.7
    angles = np.concatenate([np.zeros((len(nodes), 1)), np.cumsum(_angles(nodes), axis=1)], axis=1)
    for mode in (1, 2, 5, 20):
        shape = np.cos(mode * np.pi * (np.arange(62) + 0.5) / 62)
        amplitudes = np.sqrt(2 / 15500) * 250 * angles @ shape
        exact = theory.chain_planar_bending_mode_variance(THIN_FILM, 62, mode, TEMPERATURE)
        error = _assert_mean(amplitudes**2, exact)
        assert SIGMAS * error < 0.15 * exact


def test_direction_of_a_draw():
    _, nodes = _drawn(F_ACTIN, 3, 5, direction=[3, -4, 0])
    first = nodes[:, 1] - nodes[:, 0]
    assert first / np.linalg.norm(first, axis=1)[:, None] == pytest.approx(np.tile([0.6, -0.8, 0], (5, 1)))


# Dynamics


@pytest.mark.parametrize(("engine", "platform"), EVERYWHERE)
def test_nodes_keep_their_height_to_the_bit(engine, platform):
    """Whatever pulls along z, and beside a filament that moves in space."""
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine=engine)
    filaments.add_equilibrium(F_ACTIN, 6, seed=1, start=[0, 0, 1 / 3], planar=True, propulsion=0.2)
    filaments.add_ring(F_ACTIN, 8, [0, 0, 100.1], planar=True)
    filaments.add_equilibrium(F_ACTIN, 6, seed=2)
    _, system, positions = filaments.build()
    pull = openmm.CustomExternalForce("-x-5*z")
    for particle in range(system.getNumParticles()):
        pull.addParticle(particle, [])
    system.addForce(pull)
    for scheme in ("midpoint", "euler"):
        integrator = filaments.create_integrator(system, 5e3, scheme=scheme, random_seed=1)
        context = new_context(system, positions, integrator, platform)
        start = positions_of(context)
        integrator.step(30)
        end = positions_of(context)
        planar = np.concatenate(filaments.node_indices[:2])
        assert np.array_equal(end[planar, 2], start[planar, 2])
        assert np.all(end[planar, :2] != start[planar, :2])
        assert np.all(end[filaments.node_indices[2], 2] != start[filaments.node_indices[2], 2])


@pytest.mark.parametrize("engine", ENGINES)
def test_noise_covariance_and_drift_of_a_step(engine):
    """Cov(dx) = 2 k_B T dt M in the plane, with M the inverse of the xy part of Z."""
    nodes = bent_chain(F_ACTIN, 2, 3) * [1, 1, 0]
    copies, draws = 1500, 16
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine=engine)
    for _ in range(copies):
        filaments.add_nodes(F_ACTIN, nodes, planar=True)
    step = 1.0
    moves = moves_of_a_step(filaments, step, draws)[..., :2].reshape(-1, 6)
    plane = np.flatnonzero(np.arange(9) % 3 < 2)
    expected = 2 * KT * step * np.linalg.inv(dense_resistance(nodes, FRICTION)[np.ix_(plane, plane)])
    assert_covariance(moves, expected)


def _simulated(engine, platform, kind, segments, chains, steps, scheme="midpoint", fraction=0.01):
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine=engine)
    for seed in range(chains):
        filaments.add_equilibrium(kind, segments, seed, planar=True)
    _, system, positions = filaments.build()
    step = time_step(replace(CASES["kratky-porod"], type=kind, segments=segments, fraction=fraction))
    integrator = filaments.create_integrator(system, step, scheme=scheme, random_seed=7)
    context = new_context(system, positions, integrator, platform)
    integrator.step(steps // 4)
    samples = []
    for _ in range(30):
        integrator.step(steps // 40)
        samples.append(positions_of(context).reshape(chains, segments + 1, 3))
    return samples


def _mean_over_samples(samples, function):
    return np.mean([function(nodes).reshape(len(nodes), -1).mean(axis=1) for nodes in samples], axis=0)


QUICK = ("freely-jointed", "inscribed-circle")


@pytest.mark.parametrize("name", QUICK)
@pytest.mark.parametrize("engine", ENGINES_PORTABLE_SLOW)
def test_dynamics_keep_the_equilibrium_of_the_plane(engine, name):
    _check_dynamics(engine, "Reference", name)


@pytest.mark.sample("compiled|OpenCL-freely|CPU-fene|Reference-kratky")
@pytest.mark.slow
@pytest.mark.parametrize(
    ("engine", "platform", "name"),
    [(*pair, name) for pair in ENGINE_PLATFORMS for name in NAMES if pair[1] != "Reference" or name not in QUICK],
)
def test_dynamics_keep_the_equilibrium_of_the_plane_elsewhere(engine, platform, name):
    _check_dynamics(engine, platform, name)


def _check_dynamics(engine, platform, name):
    kind = CASES[name].type
    segments, chains = (2, 2400) if name == "freely-jointed" else (6, 800)
    samples = _simulated(engine, platform, kind, segments, chains, 400)
    energies = _mean_over_samples(samples, lambda x: kind.stretching_energy(np.linalg.norm(np.diff(x, axis=1), axis=2)))
    exact = _length_average(kind, lambda length: float(kind.stretching_energy(length)))
    # The explicit scheme of weak order one, at a hundredth of the stability bound, is off by up to 1 %.
    error = _assert_mean(energies, exact, 0.01 * exact)
    assert SIGMAS * error < 0.05 * exact
    lengths = _mean_over_samples(samples, lambda x: np.linalg.norm(np.diff(x, axis=1), axis=2))
    _assert_mean(lengths, _length_average(kind, lambda length: length))
    cosines = _mean_over_samples(samples, lambda x: np.cos(_angles(x)))
    _assert_mean(cosines, _joint_average(kind, np.cos))
    squares = _mean_over_samples(samples, lambda x: np.cos(_angles(x)) ** 2)
    exact = _joint_average(kind, lambda angle: np.cos(angle) ** 2)
    error = _assert_mean(squares, exact)
    assert SIGMAS * error < 0.05 * exact
    if kind.bending_rigidity:
        bending = _mean_over_samples(samples, lambda x: kind.bending_energy(np.cos(_angles(x))))
        exact = _joint_average(kind, lambda angle: float(kind.bending_energy(np.cos(angle))))
        _assert_mean(bending, exact, 0.01 * exact)
    ends = _mean_over_samples(samples, lambda x: np.sum((x[:, -1] - x[:, 0]) ** 2, axis=1))
    _assert_mean(ends, _mean_square_end_to_end(kind, segments))


@pytest.mark.parametrize("engine", ENGINES_PORTABLE_SLOW)
def test_free_segment_has_the_right_drift_with_the_printed_scheme(engine):
    """Scheme "euler" is right for one free segment, with the thermal torque of two dimensions."""
    kind = CASES["kratky-porod"].type
    samples = _simulated(engine, "Reference", kind, 1, 3000, 400, scheme="euler")
    lengths = _mean_over_samples(samples, lambda x: np.linalg.norm(np.diff(x, axis=1), axis=2))
    error = _assert_mean(lengths, _length_average(kind, lambda length: length))
    # With the torque of three dimensions, lengths would be those of rho(l) ~ l^2 exp(-V/k_B T).
    in_space = SegmentLengthDistribution(kind, TEMPERATURE).mean(lambda length: length)
    assert in_space - _length_average(kind, lambda length: length) > 2 * SIGMAS * error


# Refusals


def test_bad_input_is_refused():
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine="portable")
    for add, message in (
        (
            lambda: filaments.add_straight(F_ACTIN, 2, [0, 0, 5], [1, 0, 0.1], planar=True),
            r"Filament 0 \(ACT\) is planar, .* must have the same z, but node 0 is at z = 5 nm and node 2",
        ),
        (lambda: filaments.add_nodes(F_ACTIN, [[0, 0, 0], [300, 0, 1]], planar=True), "must have the same z"),
        (lambda: filaments.add_ring(F_ACTIN, 5, [0, 0, 0], [1, 0, 0], planar=True), "must have the same z"),
        (
            lambda: filaments.add_equilibrium(F_ACTIN, 2, 1, direction=[1, 0, 1], planar=True),
            "its direction must lie in the xy plane",
        ),
        (lambda: filaments.add_straight(F_ACTIN, 2, [0, 0, 0], [1, 0, 0], planar=1), "planar must be True or False"),
        (lambda: filaments.add_equilibrium(F_ACTIN, 2, 1, planar="yes"), "planar must be True or False"),
    ):
        with pytest.raises(InputError, match=message):
            add()
    assert len(filaments) == 0


def test_rounding_is_no_tilt():
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine="portable")
    filaments.add_nodes(F_ACTIN, [[0, 0, 7], [300, 0, 7 + 1e-12]], planar=True)
    filaments.add_ring(F_ACTIN, 50, [1e4, 1e4, 0.1], [0, 0, -2], planar=True)
    assert all(np.ptp(filament.positions[:, 2]) == 0 for filament in filaments)
