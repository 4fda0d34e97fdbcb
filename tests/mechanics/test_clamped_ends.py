"""Clamped ends: hinges, clamped directions, cantilevers against Euler's elastica, and their thermal fluctuations."""

from dataclasses import replace

import numpy as np
import openmm
import pytest
from scipy.integrate import solve_bvp

from openmm_cylchain import F_ACTIN, Filaments, theory
from openmm_cylchain.filaments.equilibrium import (
    JointAngleDistribution,
    PlanarJointAngleDistribution,
    SegmentLengthDistribution,
)
from openmm_cylchain.output.reporters import FilamentReporter
from support.bending_models import BENDING_MODELS
from support.contexts import forces_of, new_context, new_simulation, positions_of
from support.equilibrium_cases import Case, soft_chain, time_step
from support.platforms import ENGINES
from support.solvent import KT, TEMPERATURE, VISCOSITY

SIGMAS = 4.0
LENGTH = 2000.0  # nm of the cantilevers
# Joints of a/l0: rods that bend without thermal noise have the rigidity a.
ACTIN = replace(F_ACTIN, temperature=None)


@pytest.mark.parametrize(
    ("clamped", "factors"),
    [
        ((), [1, 1, 1, 1, 1]),
        ((0,), [1, 1, 1, 1, 1]),
        ((0, 1), [2, 1, 1, 1, 1]),
        ((0, 1, 2), [1, 2, 1, 1, 1]),
        ((-1, -2), [1, 1, 1, 1, 2]),
        ((0, 1, -2, -1), [2, 1, 1, 1, 2]),
        ((2, 3), [1, 2, 2, 1, 1]),
        ((0, 2, 4), [1, 1, 1, 1, 1]),
        ((1, 2, 4, 5), [2, 2, 1, 2, 2]),
    ],
)
def test_stiffness_of_joints(clamped, factors):
    """A joint is at each of the nodes 1 to 5; those between a held segment and a free one are twice as stiff."""
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine="portable")
    filaments.add_straight(ACTIN, 6, [0, 0, 0], [1, 0, 0], clamped=clamped)
    expected = ACTIN.bending_rigidity / 360 * np.array(factors)
    assert filaments[0].joint_stiffnesses == pytest.approx(expected)


@pytest.mark.parametrize(
    ("clamped", "factors"),
    [
        ((), [1] * 5),
        ((2,), [1] * 5),
        ((1, 2), [1, 2, 2, 1, 1]),
        ((0, 4), [2, 1, 1, 1, 2]),
        ((0, 1, 2, 3), [2, 1, 1, 2, 1]),
    ],
)
def test_stiffness_of_the_joints_of_a_ring(clamped, factors):
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine="portable")
    filaments.add_ring(ACTIN, 5, [0, 0, 0], clamped=clamped)
    expected = ACTIN.bending_rigidity / 360 * np.array(factors)
    assert filaments[0].joint_stiffnesses == pytest.approx(expected)


@pytest.mark.parametrize("model", BENDING_MODELS)
@pytest.mark.parametrize("engine", ENGINES)
def test_reporter_and_state_have_the_stiffness_of_the_joints(engine, model):
    kind = replace(ACTIN, bending_model=model)
    angles = np.cumsum([0, 0.3, -0.2, 0.4, 0.1])
    nodes = np.zeros((6, 3))
    nodes[1:] = np.cumsum(360 * np.stack([np.cos(angles), 0 * angles, np.sin(angles)], axis=1), axis=0)
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine=engine)
    filaments.add_nodes(kind, nodes, clamped=[0, 1])
    topology, system, positions = filaments.build()
    integrator = filaments.create_integrator(system, 1e-6, temperature=0)
    simulation = new_simulation(topology, system, positions, integrator)
    expected = float(np.sum([2, 1, 1, 1] * kind.bending_energy(np.cos([0.3, 0.2, 0.4, 0.1]))))
    state = simulation.context.getState(energy=True, forces=True)
    assert state.getPotentialEnergy()._value == pytest.approx(expected, rel=1e-9)
    reporter = FilamentReporter(None, 1, filaments)
    simulation.reporters.append(reporter)
    simulation.step(1)
    assert reporter["bending_energy"][0, 0] == pytest.approx(expected, rel=1e-6)
    # Without anything else on the nodes, a joint carries what holds the segments beyond it back from relaxing.
    forces = state.getForces(asNumpy=True)._value
    for node in range(2, 6):
        for axis in (0, 2):
            energies = []
            for sign in (1, -1):
                shifted = nodes.copy()
                shifted[node, axis] += sign * 1e-3
                energies.append(sum(filaments[0].energies(shifted)))
            assert forces[node, axis] == pytest.approx((energies[1] - energies[0]) / 2e-3, abs=1e-5)


# Cantilevers


def _cantilever(engine, segments, load):
    """A filament with so many free segments beyond its clamp, and nodal loads (segments,) along z, at rest."""
    kind = ACTIN.with_segment_length(LENGTH / segments)
    filaments = Filaments(VISCOSITY, 0, engine=engine)
    filaments.add_straight(kind, segments + 1, [-LENGTH / segments, 0, 0], [1, 0, 0], clamped=[0, 1])
    _, system, positions = filaments.build()
    pull = openmm.CustomExternalForce("-part*force*z")
    pull.addPerParticleParameter("force")
    pull.addGlobalParameter("part", 1.0)
    for node, force in enumerate(load, start=2):
        pull.addParticle(node, [force])
    system.addForce(pull)
    context = new_context(system, positions)
    return kind, _at_rest(context, positions._value)


def _at_rest(context, positions):
    # Newton's method in the xz plane, with the load in parts; derivatives by differences of OpenMM's forces.
    x = positions.copy()
    free = [(node, axis) for node in range(2, len(x)) for axis in (0, 2)]

    def forces(values):
        context.setPositions(values)
        all_forces = forces_of(context)
        return np.array([all_forces[index] for index in free])

    for part in np.linspace(0.1, 1.0, 10):
        context.setParameter("part", part)
        for _ in range(12):
            slopes = np.empty((len(free), len(free)))
            for column, index in enumerate(free):
                ends = []
                for shift in (1e-3, -1e-3):
                    moved = x.copy()
                    moved[index] += shift
                    ends.append(forces(moved))
                slopes[:, column] = (ends[0] - ends[1]) / 2e-3
            step = -np.linalg.solve(slopes, forces(x))
            for index, change in zip(free, step):
                x[index] += change
            if np.abs(step).max() < 1e-8:
                break
    assert np.abs(step).max() < 1e-6
    return x


def _elastica(rigidity, force, weight):
    """Tip (x, z) of a clamped rod with a force at its end and a weight per length, both along z."""

    def slope(s, y):
        moment = (force + weight * (LENGTH - s)) * np.cos(y[0])
        return np.array([y[1], -moment / rigidity, np.cos(y[0]), np.sin(y[0])])

    def ends(start, end):
        return np.array([start[0], end[1], start[2], start[3]])

    s = np.linspace(0, LENGTH, 200)
    solution = solve_bvp(slope, ends, s, np.vstack([0 * s, 0 * s, s, 0 * s]), tol=1e-9, max_nodes=100000)
    assert solution.success
    return solution.sol(LENGTH)[2:]


@pytest.mark.parametrize("segments", [1, 2, 5, 12])
@pytest.mark.parametrize("engine", ENGINES)
def test_small_deflection_of_a_cantilever(engine, segments):
    """F L^3/(3 a) (1 + 1/(2 n^2)), for any number n of free segments."""
    force = 1e-5
    load = np.zeros(segments)
    load[-1] = force
    kind, nodes = _cantilever(engine, segments, load)
    exact = force * LENGTH**3 / (3 * kind.bending_rigidity) * (1 + 1 / (2 * segments**2))
    assert nodes[-1, 2] == pytest.approx(exact, rel=1e-5)
    if segments == 12:
        # The shape of a beam, F s^2 (3 L - s)/(6 a).
        s = LENGTH / 12 * np.arange(13)
        beam = force * s**2 * (3 * LENGTH - s) / (6 * kind.bending_rigidity)
        assert nodes[1:, 2] == pytest.approx(beam, abs=0.006 * exact)


@pytest.mark.parametrize("kind_of_load", ["end", "distributed"])
@pytest.mark.parametrize("engine", ENGINES)
def test_large_deflection_tends_to_the_elastica(engine, kind_of_load):
    """The tip of a filament bent by half its length; the error falls at least with the square of the segments."""
    errors = []
    for segments in (6, 12):
        rigidity = ACTIN.bending_rigidity
        force, weight = (3 * rigidity / LENGTH**2, 0.0) if kind_of_load == "end" else (0.0, 8 * rigidity / LENGTH**3)
        load = np.full(segments, weight * LENGTH / segments)
        load[-1] = force + 0.5 * weight * LENGTH / segments
        _, nodes = _cantilever(engine, segments, load)
        tip = _elastica(rigidity, force, weight)
        assert tip[1] > 0.5 * LENGTH
        errors.append(np.abs(nodes[-1, [0, 2]] - tip).max())
    assert errors[1] < 0.0015 * LENGTH
    assert errors[0] / errors[1] > 3.8


# Thermal fluctuations


def _exact_fluctuations(kind, segments, planar):
    """<y^2> of the tip, <t_y^2> of the last segment and <1 - c> of the joint at the clamp, which points along x.

    The joints are independent, so the first two are products of averages over single ones.
    """
    if planar:
        joints = [PlanarJointAngleDistribution(kind, TEMPERATURE, f * kind.joint_stiffness) for f in (2, 1)]
        cosines = [one.mean(np.cos) for one in joints]
        # Of t_y^2 = (1 - cos 2 theta)/2.
        doubles, share, rest = [one.mean(lambda angle: np.cos(2 * angle)) for one in joints], 0.5, 0.5
    else:
        joints = [JointAngleDistribution(kind, TEMPERATURE, f * kind.joint_stiffness) for f in (2, 1)]
        cosines = [one.mean(lambda c: c) for one in joints]
        # Of t_y^2 = (1 - t_x^2)/2, t_x^2 = (1 + 2 P_2)/3.
        doubles, share, rest = [one.mean(lambda c: 1.5 * c**2 - 0.5) for one in joints], 1 / 3, 1 / 3
    decay = doubles[0] * doubles[1] ** np.arange(segments)
    squares = share - rest * decay
    lengths = SegmentLengthDistribution(kind, TEMPERATURE, planar)
    mean, square = lengths.mean(lambda length: length), lengths.mean(lambda length: length**2)
    tip = square * squares.sum()
    for i in range(segments):
        for j in range(i + 1, segments):
            tip += 2 * mean**2 * cosines[1] ** (j - i) * squares[i]
    return {"tip": tip, "tangent": squares[-1], "bend": 1.0 - cosines[0]}


def _drawn(engine, kind, segments, planar, count):
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine=engine)
    for seed in range(count):
        filaments.add_equilibrium(kind, segments + 1, seed, direction=[1, 0, 0], clamped=[0, 1], planar=planar)
    return filaments


def _fluctuations(nodes):
    first, last = nodes[:, 2] - nodes[:, 1], nodes[:, -1] - nodes[:, -2]
    return {
        "tip": nodes[:, -1, 1] ** 2,
        "tangent": (last[:, 1] / np.linalg.norm(last, axis=1)) ** 2,
        "bend": 1.0 - first[:, 0] / np.linalg.norm(first, axis=1),
    }


def _assert_means(samples, exact):
    for name, expected in exact.items():
        values = np.mean([one[name] for one in samples], axis=0)
        error = values.std(ddof=1) / np.sqrt(len(values))
        assert abs(values.mean() - expected) < SIGMAS * error, name
        # Were it not twice as stiff, the joint at the clamp would bend by twice as much, and <y^2> be larger by 16 %.
        assert SIGMAS * error < 0.1 * expected, name


STIFF = soft_chain("CLAMP", bending_rigidity=6 * KT * 100)


@pytest.mark.slow
@pytest.mark.parametrize("planar", [False, True])
def test_draws_of_clamped_filaments(planar):
    filaments = _drawn("portable", STIFF, 6, planar, 6000)
    nodes = np.array([filament.positions for filament in filaments])
    assert np.all(nodes[:, 1, 1:] == 0)
    _assert_means([_fluctuations(nodes)], _exact_fluctuations(STIFF, 6, planar))


@pytest.mark.sample("compiled")
@pytest.mark.slow
@pytest.mark.parametrize("planar", [False, True])
@pytest.mark.parametrize("engine", ENGINES)
def test_dynamics_keep_the_fluctuations_of_clamped_filaments(engine, planar):
    filaments = _drawn(engine, STIFF, 3, planar, 2500)
    _, system, positions = filaments.build()
    step = time_step(Case(STIFF, 4, 1, 1, 0.02))
    integrator = filaments.create_integrator(system, step, scheme="midpoint", random_seed=2)
    context = new_context(system, positions, integrator)
    integrator.step(100)
    samples = []
    for _ in range(20):
        integrator.step(15)
        nodes = positions_of(context).reshape(2500, 5, 3)
        samples.append(_fluctuations(nodes))
    _assert_means(samples, _exact_fluctuations(STIFF, 3, planar))


@pytest.mark.slow
def test_stiff_clamped_filaments_have_gaussian_angles():
    """Eqs. (41) to (43) of Chandran and Mofrad, Phys. Rev. E 2009, 79, 011906, for 25 segments."""
    segments, length = 25, 5000.0
    persistence_length = 100 * length
    kind = replace(ACTIN.with_segment_length(length / segments), bending_rigidity=persistence_length * KT)
    nodes = np.array([filament.positions for filament in _drawn("portable", kind, segments, False, 3000)])
    last = nodes[:, -1] - nodes[:, -2]
    angles = np.concatenate([last[:, 1], last[:, 2]]) / (length / segments)
    # The last segment's angle is that of its middle, half a segment before the end.
    variance = theory.clamped_angle_variance(length - 0.5 * length / segments, persistence_length)
    assert variance == pytest.approx(0.98 * length / persistence_length)
    error = np.sqrt(2 / len(angles)) * variance
    assert abs(angles.var() - variance) < SIGMAS * error
    # (41) is normal: its fourth moment is 3, with a standard error of sqrt(24/n).
    fourth = np.mean(angles**4) / np.mean(angles**2) ** 2
    assert abs(fourth - 3) < SIGMAS * np.sqrt(24 / len(angles)) + 0.01
    for node in (5, 10, 25):
        s = node * length / segments
        deflections = np.concatenate([nodes[:, node + 1, 1], nodes[:, node + 1, 2]])
        exact = theory.clamped_deflection_variance(s, persistence_length) * (1 + 1 / (2 * node**2))
        assert abs(deflections.var() - exact) < SIGMAS * np.sqrt(2 / len(deflections)) * exact
    # (43) is the first mode's share.
    printed = 32 * length**3 / (np.pi**4 * persistence_length)
    assert theory.clamped_deflection_variance(length, persistence_length) == pytest.approx(printed, rel=0.02)
