"""Observables on trajectories with known answers, among other particles."""

import math
import warnings

import mdtraj
import numpy as np
import pytest
from mdtraj.core import element
from openmm import unit

from openmm_cylchain import analysis, theory
from openmm_cylchain.analysis import statistics
from openmm_cylchain.errors import EquilibrationWarning, InputError
from openmm_cylchain.filaments.equilibrium import draw_chain
from openmm_cylchain.filaments.filament_type import FilamentType
from openmm_cylchain.units.quantities import thermal_energy
from support.random_series import correlated_series

TEMPERATURE = 300.0


def make_trajectory(filaments, time=None, other_particles=True):
    """A trajectory of filaments, given as (frames, nodes, 3) arrays, among other particles."""
    topology, columns = mdtraj.Topology(), []
    frames = len(filaments[0])
    for positions in filaments:
        if other_particles:
            solvent = topology.add_chain()
            topology.add_atom("O", element.oxygen, topology.add_residue("HOH", solvent))
            columns.append(np.full((frames, 1, 3), 77.0))
        chain = topology.add_chain()
        for node in range(positions.shape[1]):
            residue = topology.add_residue("ACT", chain)
            topology.add_atom("NOD", element.virtual, residue)
            columns.append(positions[:, node : node + 1])
            if other_particles:
                topology.add_atom("LAB", element.virtual, residue)
                columns.append(np.full((frames, 1, 3), -55.0))
    return mdtraj.Trajectory(np.concatenate(columns, axis=1), topology, time=time)


@pytest.fixture(scope="module")
def flexible():
    rigidity = 8.0 * 10.0 * thermal_energy(TEMPERATURE)
    return FilamentType(
        name="FLEX", diameter=1.0, segment_length=10.0, bending_rigidity=rigidity, stretching_stiffness=20.0
    )


@pytest.fixture(scope="module")
def equilibrium(flexible):
    """Twenty frames of fifteen chains of 120 segments, all independent draws from equilibrium."""
    generator = np.random.default_rng(1)
    chains = [[draw_chain(flexible, 120, TEMPERATURE, generator) for _ in range(20)] for _ in range(15)]
    return make_trajectory([np.array(frames) for frames in chains])


@pytest.fixture(scope="module")
def corners():
    """One frame each of an L of lengths 2, 1 and a straight line of three segments of length 1."""
    bent = np.array([[[0, 0, 0], [2, 0, 0], [2, 1, 0]]], dtype=float)
    straight = np.array([[[0, 0, 5], [0, 0, 6], [0, 0, 7], [0, 0, 8]]], dtype=float)
    return make_trajectory([bent, straight])


def test_nodes_are_found_among_other_particles(corners):
    for source in (corners, corners.topology):
        nodes = analysis.filament_nodes(source)
        assert [index.tolist() for index in nodes] == [[1, 3, 5], [8, 10, 12, 14]]


def test_a_trajectory_without_filaments_is_refused(corners):
    water = corners.atom_slice(corners.topology.select("name O"))
    with pytest.raises(InputError, match="no filament"):
        analysis.filament_nodes(water)
    lonely = make_trajectory([np.zeros((1, 1, 3))])
    with pytest.raises(InputError, match="single node"):
        analysis.filament_nodes(lonely)


def test_shapes_by_hand(corners):
    assert analysis.end_to_end_vectors(corners)[0] == pytest.approx(np.array([[2, 1, 0], [0, 0, 3]]))
    assert analysis.contour_lengths(corners) == pytest.approx(np.array([[3, 3]]))
    bent, straight = analysis.segment_lengths(corners)
    assert bent == pytest.approx(np.array([[2, 1]])) and straight == pytest.approx(np.ones((1, 3)))
    assert analysis.tangents(corners)[0][0] == pytest.approx(np.array([[1, 0, 0], [0, 1, 0]]))
    cosines = analysis.joint_cosines(corners)
    assert cosines[0] == pytest.approx(np.zeros((1, 1))) and cosines[1] == pytest.approx(np.ones((1, 2)))
    centers = analysis.centers_of_mass(corners)[0]
    assert centers == pytest.approx(np.array([[1.5, 0.25, 0], [0, 0, 6.5]]))
    # Nodes at 0, 1, 2, 3 have the variance 5/4; those of the L have 8/9 along x and 2/9 along y.
    assert analysis.radii_of_gyration(corners)[0] ** 2 == pytest.approx([10 / 9, 5 / 4])


def test_selection_of_filaments(corners):
    assert analysis.end_to_end_vectors(corners, 1)[0] == pytest.approx(np.array([[0, 0, 3]]))
    assert [len(lengths[0]) for lengths in analysis.segment_lengths(corners, [1, 0])] == [3, 2]
    for selection in (2, -1, [0, 5], [], [0.5]):
        with pytest.raises(InputError):
            analysis.contour_lengths(corners, selection)


def test_coinciding_nodes_have_no_tangent():
    with pytest.raises(InputError, match="one point"):
        analysis.tangents(make_trajectory([np.array(2 * [[[0.0, 0.0, 0.0], [0.0, 0.0, 0.0], [1.0, 0.0, 0.0]]])]))


def test_tangent_correlation_of_equilibrium_draws(flexible, equilibrium):
    result = analysis.tangent_correlation(equilibrium, maximum_lag=12)
    exact = theory.chain_tangent_correlation(flexible, result.lag, TEMPERATURE)
    assert result.mean[0] == 1.0 and result.standard_error[0] == 0.0
    assert np.all(np.abs(result.mean - exact)[1:] < 4 * result.standard_error[1:])
    assert np.all(result.standard_error[1:] < 0.03)
    assert result.contour_distance == pytest.approx(10.0 * result.lag, rel=0.01)


def test_tangent_correlation_of_one_frame_takes_its_error_from_the_filaments(flexible, equilibrium):
    result = analysis.tangent_correlation(equilibrium[:1], maximum_lag=1)
    per_filament = [cosines.mean() for cosines in analysis.joint_cosines(equilibrium[:1])]
    assert result.mean[1] == pytest.approx(np.mean(per_filament))
    assert result.standard_error[1] == pytest.approx(np.std(per_filament, ddof=1) / math.sqrt(15))


def test_pooling_filaments_of_different_length_is_refused(corners):
    with pytest.raises(InputError, match="differ"):
        analysis.tangent_correlation(corners)
    with pytest.raises(InputError, match="two values"):
        analysis.tangent_correlation(corners, 0)


def test_persistence_length_is_recovered_and_a_wrong_one_is_not(flexible, equilibrium):
    value, error = analysis.persistence_length(equilibrium)
    exact = theory.chain_persistence_length(flexible, TEMPERATURE)
    assert abs(value - exact) < 4 * error
    for wrong in (0.95 * exact, 1.05 * exact):
        assert abs(value - wrong) > 4 * error


def test_persistence_length_error_is_the_spread_between_filaments(equilibrium):
    values, errors = np.array([analysis.persistence_length(equilibrium, filament) for filament in range(15)]).T
    # Fifteen values give their spread to 19 %.
    assert np.std(values, ddof=1) == pytest.approx(np.sqrt(np.mean(errors**2)), rel=0.6)


def test_persistence_length_is_no_surer_for_frames_that_repeat(equilibrium):
    once = analysis.persistence_length(equilibrium, 0)
    repeated = mdtraj.Trajectory(np.repeat(equilibrium.xyz, 10, axis=0), equilibrium.topology)
    again = analysis.persistence_length(repeated, 0)
    assert again[0] == pytest.approx(once[0], rel=1e-6)
    assert again[1] > 0.7 * once[1]


def test_persistence_length_in_a_plane_is_half_of_what_tangents_decorrelate_over(flexible, equilibrium):
    """By the angle's density exp(-K (1 - cos)/k_B T), or what the type has for it, summed over a grid."""
    generator = np.random.default_rng(2)
    chains = [[draw_chain(flexible, 120, TEMPERATURE, generator, planar=True) for _ in range(20)] for _ in range(15)]
    trajectory = make_trajectory([np.array(frames) for frames in chains])
    angle = np.linspace(-np.pi, np.pi, 20001)[1:-1]
    weight = np.exp(-flexible.bending_energy(np.cos(angle)) / thermal_energy(TEMPERATURE))
    exact = -10.0 / (2.0 * np.log(np.average(np.cos(angle), weights=weight)))
    assert theory.chain_persistence_length(flexible, TEMPERATURE, planar=True) == pytest.approx(exact, rel=5e-3)
    value, error = analysis.persistence_length(trajectory)
    assert error < 0.0125 * exact and abs(value - exact) < 4 * error + 5e-3 * exact
    in_space = analysis.persistence_length(trajectory, planar=False)
    assert in_space == pytest.approx((2 * value, 2 * error))
    mixed = make_trajectory([np.array(chains[0]), equilibrium.xyz[:, analysis.filament_nodes(equilibrium.topology)[0]]])
    with pytest.raises(InputError, match="Some of the filaments are planar, and others are not"):
        analysis.persistence_length(mixed)


def test_persistence_length_needs_bends_of_less_than_a_right_angle():
    zigzag = np.array([[[0, 0, 0], [1, 0, 0], [0.5, 0.2, 0]], [[0, 0, 0], [1, 0, 0], [0.5, 0.3, 0]]])
    with pytest.raises(InputError, match="not defined"):
        analysis.persistence_length(make_trajectory([zigzag]))
    with pytest.raises(InputError, match="two segments"):
        analysis.persistence_length(make_trajectory([zigzag[:, :2]]))


def _relaxing(flexible, frames, seed):
    """Filaments that start straight and forget it within some 20 frames, as angles in a plane."""
    generator = np.random.default_rng(seed)
    filaments = []
    for _ in range(10):
        joints = correlated_series(generator, frames, 0.5, (30,)) * 0.35
        joints *= 1.0 - np.exp(-np.arange(frames) / 20.0)[:, None]
        angles = np.concatenate([np.zeros((frames, 1)), np.cumsum(joints, axis=1)], axis=1)
        steps = 10.0 * np.stack([np.cos(angles), np.sin(angles), 0 * angles], axis=2)
        filaments.append(np.concatenate([np.zeros((frames, 1, 3)), np.cumsum(steps, axis=1)], axis=1))
    return make_trajectory(filaments)


@pytest.mark.parametrize("filaments", [None, 0])
def test_a_straight_start_is_told(flexible, equilibrium, filaments):
    relaxing = _relaxing(flexible, 100, 3)
    assert analysis.bending_drift(relaxing, filaments) > statistics.SIGNIFICANT_DRIFT
    with pytest.warns(EquilibrationWarning, match="more bent in the last half .*Leave out the frames"):
        value, _ = analysis.persistence_length(relaxing, filaments)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        relaxed, _ = analysis.persistence_length(_relaxing(flexible, 400, 3)[200:], filaments)
        analysis.persistence_length(equilibrium, filaments)
    assert value > 1.3 * relaxed


def test_bending_mode_amplitudes_of_single_modes():
    segments, mode, amplitude = 24, 3, 0.02
    index = np.arange(segments) + 0.5
    angle = math.sqrt(2.0 / (segments * 5.0)) * amplitude * np.cos(mode * math.pi * index / segments)
    steps = 5.0 * np.stack([np.cos(angle), np.zeros(segments), np.sin(angle)], axis=-1)
    nodes = np.concatenate([np.zeros((1, 3)), np.cumsum(steps, axis=0)])
    trajectory = make_trajectory([nodes[None]])
    amplitudes = analysis.bending_mode_amplitudes(trajectory, 0, [1, 2, 3, 4])
    expected = np.zeros((1, 4, 3))
    expected[0, 2, 2] = amplitude
    assert amplitudes == pytest.approx(expected, abs=2e-5)
    assert analysis.bending_mode_amplitudes(trajectory, 0, 3, 120 * unit.nanometer).shape == (1, 1, 3)


def test_bending_mode_variances_of_equilibrium_draws(flexible, equilibrium):
    modes = [1, 4, 20]
    amplitudes = np.stack([analysis.bending_mode_amplitudes(equilibrium, f, modes) for f in range(15)], axis=1)
    samples = 0.5 * np.sum(amplitudes**2, axis=-1).reshape(-1, 3)
    exact = theory.chain_bending_mode_variance(flexible, 120, modes, TEMPERATURE)
    error = samples.std(axis=0, ddof=1) / math.sqrt(len(samples))
    assert np.all(np.abs(samples.mean(axis=0) - exact) < 4 * error)


def test_bending_modes_beyond_the_filament_are_refused(corners):
    for modes in (0, 2, [1, 2], 0.5):
        with pytest.raises(InputError, match="modes"):
            analysis.bending_mode_amplitudes(corners, 0, modes)


def brownian_rods(generator, frames, rods, along, across):
    """Straight rods on the x axis that diffuse without turning, with these variances per frame."""
    spread = np.sqrt([along, across, across])
    paths = np.cumsum(spread * generator.normal(size=(rods, frames, 3)), axis=1)
    rod = np.array([[0, 0, 0], [1, 0, 0], [2, 0, 0]], dtype=float)
    return [path[:, None] + rod for path in paths]


def test_displacement_of_brownian_rods():
    rods = brownian_rods(np.random.default_rng(3), 200, 60, along=2.0, across=0.5)
    trajectory = make_trajectory(rods, time=20.0 * np.arange(200))
    lags = [0, 1, 7, 50]
    result = analysis.mean_square_displacement(trajectory, lags=lags)
    assert result.time == pytest.approx(20.0 * np.array(lags))
    for values, errors, slope in (
        (result.parallel, result.parallel_error, 2.0),
        (result.perpendicular, result.perpendicular_error, 0.5),
        (result.center, result.center_error, 3.0),
        (result.nodes, result.nodes_error, 3.0),
    ):
        assert values[0] == 0
        assert np.all(np.abs(values - slope * np.array(lags))[1:] < 4 * errors[1:])
        assert errors[1] < 0.02 * values[1]


def test_displacement_from_the_first_frame_of_a_moving_and_turning_rod():
    frames = np.arange(5.0)
    center = np.stack([3 * frames, 4 * frames, 0 * frames], axis=-1)
    angle = 0.5 * math.pi * frames
    axis = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=-1)
    trajectory = make_trajectory([np.stack([center - axis, center + axis], axis=1)])
    result = analysis.mean_square_displacement(
        trajectory, lags=[1, 2], window_average=False, time_step=2 * unit.nanosecond
    )
    assert result.time == pytest.approx([2000.0, 4000.0])
    assert result.center == pytest.approx([25.0, 100.0], rel=1e-5)
    assert result.parallel == pytest.approx([9.0, 36.0], rel=1e-5)
    assert result.perpendicular == pytest.approx([8.0, 32.0], rel=1e-5)
    # Each end moves with the centre and, relative to it, by the chord of the turn: 2 and 4 squared nm.
    assert result.nodes == pytest.approx([27.0, 104.0], rel=1e-5)
    assert np.all(np.isnan(result.center_error))
    windows = analysis.mean_square_displacement(trajectory, lags=[1, 2])
    # The rod lies on x and y in turn, so that the windows of one frame see 9 and 16 alternately.
    assert windows.parallel[0] == pytest.approx(0.5 * (9 + 16), rel=1e-5)


def test_displacement_chooses_lags_and_refuses_uneven_times():
    rods = brownian_rods(np.random.default_rng(4), 60, 2, along=1.0, across=1.0)
    result = analysis.mean_square_displacement(make_trajectory(rods, time=np.arange(60.0)))
    assert result.time[0] == 0 and result.time[-1] == 30 and np.all(np.diff(result.time) > 0)
    with pytest.raises(InputError, match="evenly"):
        analysis.mean_square_displacement(make_trajectory(rods, time=np.arange(60.0) ** 2))
    for lags in ([60], [-1], [0.5]):
        with pytest.raises(InputError):
            analysis.mean_square_displacement(make_trajectory(rods), lags=lags)
    with pytest.raises(InputError, match="two frames"):
        analysis.mean_square_displacement(make_trajectory(rods)[0])
