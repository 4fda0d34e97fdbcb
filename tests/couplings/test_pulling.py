"""Pulling: constant forces and tension, tethers at constant velocity, and what they measure against exact values."""

import csv
import subprocess
import sys

import numpy as np
import pytest
from openmm import unit
from scipy.integrate import quad

from openmm_cylchain import DSDNA, F_ACTIN, Filaments, InputError, recommended_time_step, theory
from openmm_cylchain.couplings.pulling import (
    ConstantVelocityPulling,
    change_constant_force,
    constant_force,
    constant_tension,
    tension_forces,
)
from openmm_cylchain.filaments.equilibrium import JointAngleDistribution, SegmentLengthDistribution
from support.contexts import energy_of, forces_of, new_context, new_simulation, positions_of
from support.equilibrium_cases import CASES
from support.platforms import ENGINE_PLATFORMS
from support.repository import TESTS
from support.solvent import KT, TEMPERATURE, VISCOSITY
from support.straight_filaments import straight_filaments

PICONEWTON = 0.602214076
FREELY_JOINTED = CASES["freely-jointed"].type


def langevin_extension(kind, force):
    """Mean extension of one freely jointed segment: weight l^2 exp(-V/k_BT) sinh(u)/u, u = F l/k_BT."""

    def integral(function):
        def integrand(length):
            u = force * length / KT
            weight = np.exp(-kind.stretching_energy(length) / KT + u) * -np.expm1(-2 * u) / (2 * u)
            return length**2 * weight * function(length, u)

        rest = kind.segment_length
        return quad(integrand, 0, 4 * rest, points=[0.5 * rest, rest, 1.5 * rest], epsabs=0, limit=500)[0]

    return integral(lambda length, u: length * (1 / np.tanh(u) - 1 / u)) / integral(lambda length, u: 1.0)


def test_theory_of_free_joints_is_the_langevin_function_of_an_extensible_segment():
    forces = np.array([0.1, 1, 10]) * KT / 100
    expected = [langevin_extension(FREELY_JOINTED, force) for force in forces]
    assert theory.chain_extension(FREELY_JOINTED, 1, forces, TEMPERATURE) == pytest.approx(expected, rel=1e-9)
    assert theory.chain_extension(FREELY_JOINTED, 7, forces, TEMPERATURE) == pytest.approx(7 * np.array(expected))
    fene = CASES["fene"].type
    strong = theory.chain_extension(fene, 3, 1000 * PICONEWTON, TEMPERATURE)
    assert 3 * 149 < strong < 3 * 150


@pytest.mark.parametrize("kind, segments", [(DSDNA, 40), (F_ACTIN, 30), (CASES["quadratic"].type, 8)])
def test_theory_at_small_forces_is_the_linear_response(kind, segments):
    """<R.e> = F <R^2>/(3 k_BT)."""
    expected = theory.chain_mean_square_end_to_end(kind, segments, TEMPERATURE) / (3 * KT)
    force = 1e-4 * KT / (kind.segment_length * segments)
    assert theory.chain_extension(kind, segments, force, TEMPERATURE) / force == pytest.approx(expected, rel=1e-6)


@pytest.mark.parametrize("force", [30, 100, 1000])
def test_theory_at_large_forces_is_that_of_small_angles(force):
    """Tangents across the force have the energy (F l/2) t^2 each and (a/2 l0) (t1 - t2)^2 for neighbours."""
    force, segments = force * PICONEWTON, 64
    length = F_ACTIN.segment_length + force / F_ACTIN.segment_stiffness
    neighbours = np.diff(np.eye(segments), axis=0)
    stiffness = force * length * np.eye(segments) + F_ACTIN.joint_stiffness * neighbours.T @ neighbours
    expected = segments * length - length * KT * np.trace(np.linalg.inv(stiffness))
    assert theory.chain_extension(F_ACTIN, segments, force, TEMPERATURE) == pytest.approx(expected, abs=0.03)


def _draw_ends(kind, segments, count, generator):
    """End-to-end vectors (count, 3) of free chains in equilibrium."""
    lengths = SegmentLengthDistribution(kind, TEMPERATURE).sample(generator, (count, segments))
    cosines = JointAngleDistribution(kind, TEMPERATURE).sample(generator, (count, segments))
    tangent = _unit(generator.normal(size=(count, 3)))
    ends = lengths[:, :1] * tangent
    for segment in range(1, segments):
        across = generator.normal(size=(count, 3))
        across = _unit(across - np.sum(across * tangent, axis=1)[:, None] * tangent)
        cosine = cosines[:, segment, None]
        tangent = cosine * tangent + np.sqrt(1 - cosine**2) * across
        ends += lengths[:, segment, None] * tangent
    return ends


def _unit(vectors):
    return vectors / np.linalg.norm(vectors, axis=1)[:, None]


@pytest.mark.parametrize("name", ["kratky-porod", "inscribed-circle", "fene"])
def test_theory_is_the_reweighted_mean_of_free_chains(name):
    kind, segments, force = CASES[name].type, 4, 0.8 * KT / 100
    x = _draw_ends(kind, segments, 200_000, np.random.default_rng(1))[:, 0]
    weight = np.exp(force * x / KT)
    mean = np.sum(weight * x) / weight.sum()
    error = np.sqrt(np.sum(weight**2 * (x - mean) ** 2)) / weight.sum()
    assert 4 * error < 0.05 * mean
    assert abs(theory.chain_extension(kind, segments, force, TEMPERATURE) - mean) < 4 * error


@pytest.mark.parametrize("engine, platform", ENGINE_PLATFORMS)
def test_constant_forces_act_and_change(engine, platform):
    filaments = straight_filaments(engine)
    filaments.add_attachment(0, segment=0, fraction=0.25)
    _, system, positions = filaments.build()
    point = filaments.attachment_indices[0]
    force = constant_force([2, point], [[1, 2, 3], [4, 0, 0]] * unit.piconewton)
    system.addForce(force)
    context = new_context(system, positions, filaments.create_integrator(system, 1.0, scheme="midpoint"), platform)
    forces = forces_of(context)
    assert forces[2] == pytest.approx(np.array([1, 2, 3]) * PICONEWTON, rel=1e-5)
    assert forces[:2, 0] == pytest.approx(np.array([3, 1]) * PICONEWTON, rel=1e-5)
    energy = energy_of(context)
    assert energy == pytest.approx(-(200 * 1 + 25 * 4) * PICONEWTON, rel=1e-5)
    change_constant_force(force, context, [0, 0, 2])
    assert forces_of(context)[2] == pytest.approx([0, 0, 2])


def test_tension_pulls_at_the_ends_of_the_filaments_that_are_named():
    filaments = straight_filaments("portable", chains=3)
    _, system, positions = filaments.build()
    force = constant_tension(filaments, [1, 2] * unit.piconewton, [0, 0, 2], numbers=[0, 2])
    system.addForce(force)
    context = new_context(system, positions)
    expected = np.zeros((9, 3))
    expected[[0, 2, 6, 8], 2] = np.array([-1, 1, -2, 2]) * PICONEWTON
    assert forces_of(context) == pytest.approx(expected, abs=1e-9)
    change_constant_force(force, context, tension_forces(2, 5, [1, 0, 0]))
    assert forces_of(context)[[0, 2, 6, 8], 0] == pytest.approx([-5, 5, -5, 5])


@pytest.mark.sample("^(?!portable-Reference)")
@pytest.mark.parametrize(
    "engine, platform, force, steps",
    [
        ("compiled", "CPU", 1.0, 80),
        pytest.param("portable", "CPU", 3.0, 20, marks=pytest.mark.slow),
        pytest.param("compiled", "Reference", 3.0, 80, marks=pytest.mark.slow),
        pytest.param("portable", "Reference", 1.0, 500, marks=pytest.mark.slow),
    ],
)
def test_extension_of_freely_jointed_chains_under_constant_tension(engine, platform, force, steps):
    """Every segment is independent; the chains begin with segments drawn at that tension."""
    force *= KT / 100
    chains, segments = (1500 if engine == "compiled" else 700), 3
    vectors = _draw_pulled_segments(FREELY_JOINTED, force, (chains, segments), np.random.default_rng(5))
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine=engine)
    for nodes in np.concatenate([np.zeros((chains, 1, 3)), np.cumsum(vectors, axis=1)], axis=1):
        filaments.add_nodes(FREELY_JOINTED, nodes)
    _, system, positions = filaments.build()
    system.addForce(constant_tension(filaments, force, [1, 0, 0]))
    integrator = filaments.create_integrator(system, filaments.recommended_time_step().step, random_seed=7)
    context = new_context(system, positions, integrator, platform)
    samples = []
    for _ in range(30):
        integrator.step(steps)
        nodes = positions_of(context)[np.array(filaments.node_indices)]
        samples.append(nodes[:, -1, 0] - nodes[:, 0, 0])
    of_chains = np.mean(samples[5:], axis=0)
    error = of_chains.std(ddof=1) / np.sqrt(chains)
    expected = segments * langevin_extension(FREELY_JOINTED, force)
    assert 4 * error < 0.05 * expected
    assert abs(of_chains.mean() - expected) < 4 * error


def _draw_pulled_segments(kind, force, shape, generator):
    """Vectors (*shape, 3) of freely jointed segments under a force along x."""
    lengths = np.linspace(1, 250, 5000)
    u = force * lengths / KT
    weight = lengths**2 * np.exp(-kind.stretching_energy(lengths) / KT) * np.sinh(u) / u
    length = generator.choice(lengths, shape, p=weight / weight.sum())
    u = force * length / KT
    cosine = 1 + np.log(1 - generator.random(shape) * -np.expm1(-2 * u)) / u
    sine, azimuth = np.sqrt(1 - cosine**2), generator.uniform(0, 2 * np.pi, shape)
    return length[..., None] * np.stack([cosine, sine * np.cos(azimuth), sine * np.sin(azimuth)], axis=-1)


def test_the_motion_of_a_tether_is_recorded(engine, tmp_path):
    filaments = straight_filaments(engine, chains=2, segments=3)
    filaments.add_tether(0, 3, [300, 0, 0], 0.5)
    filaments.add_tether(1, 0, [0, 1000, 0], 0.25)
    topology, system, positions = filaments.build()
    simulation = new_simulation(
        topology, system, positions, filaments.create_integrator(system, 10.0, scheme="midpoint", random_seed=1)
    )
    path = tmp_path / "pulling.csv"
    velocity = np.array([[0.01, 0.02, 0], [-0.03, 0, 0]])
    pulling = ConstantVelocityPulling(path, 4, filaments, [0, 1], velocity, start_time=40 * unit.picosecond)
    simulation.reporters.append(pulling)
    seen = [positions._value]
    for _ in range(5):
        simulation.step(4)
        seen.append(positions_of(simulation.context))
    assert pulling.time == pytest.approx([40, 80, 120, 160, 200])
    points = np.array([[300, 0, 0], [0, 1000, 0]]) + velocity * np.maximum(0, pulling.time - 80)[:, None, None]
    for index, axis in enumerate("xyz"):
        assert pulling[f"point_{axis}"] == pytest.approx(points[..., index])
    assert filaments.in_context(simulation.context).tethers()[0].point == pytest.approx(
        points[0, 0] + 160 * velocity[0]
    )
    nodes = np.array([[x[3], x[4]] for x in seen[1:]])
    directions = velocity / np.linalg.norm(velocity, axis=1)[:, None]
    stiffness = np.array([0.5, 0.25])
    assert pulling["force"] == pytest.approx(stiffness * np.sum((points - nodes) * directions, axis=2))
    after = np.array([[300, 0, 0], [0, 1000, 0]]) + velocity * np.maximum(0, pulling.time - 40)[:, None, None]
    energies = [0.5 * stiffness * np.sum((nodes - places) ** 2, axis=2) for places in (points, after)]
    assert pulling["work"] == pytest.approx(energies[1] - energies[0])
    vectors = np.array([[x[3] - x[0], x[4] - x[7]] for x in seen[1:]])
    assert pulling["extension"] == pytest.approx(np.sum(vectors * directions, axis=2))
    assert pulling["extension"][:, 1] == pytest.approx(300, abs=20)
    assert pulling["end_to_end_distance"] == pytest.approx(np.linalg.norm(vectors, axis=2))
    with open(path, newline="") as file:
        rows = list(csv.DictReader(file))
    assert list(rows[0])[:4] == ["step", "time_ps", "tether", "point_x"] and len(rows) == 10
    assert [float(row["work"]) for row in rows] == pytest.approx(pulling["work"].ravel(), rel=1e-8, abs=1e-8)


RUN = """
import sys
sys.path.insert(0, {tests!r})
import numpy as np
from openmm_cylchain import ConstantVelocityPulling
from support.contexts import new_simulation, positions_of
from support.straight_filaments import straight_filaments
filaments = straight_filaments({engine!r}, chains=2, segments=3)
filaments.add_tether(0, 3, [300, 0, 0], 0.05)
topology, system, positions = filaments.build()
integrator = filaments.create_integrator(system, 1e4, scheme="midpoint", random_seed=1)
simulation = new_simulation(topology, system, positions, integrator)
if {restart}:
    simulation.loadCheckpoint("checkpoint")
pulling = ConstantVelocityPulling("pulling.csv", 4, filaments, 0, [1e-4, 0, 0], append={restart})
simulation.reporters.append(pulling)
if not {restart}:
    simulation.step({split})
    simulation.saveCheckpoint("checkpoint")
simulation.step(40 - simulation.currentStep)
np.save({file!r}, positions_of(simulation.context))
"""


@pytest.mark.sample("compiled-22|portable-20")
@pytest.mark.parametrize("split", [20, 22])
def test_a_restart_goes_on_with_the_tether_where_it_was(engine, split, tmp_path):
    ends, tables = [], []
    for restart in (False, True):
        code = RUN.format(engine=engine, restart=restart, split=split, file=f"{restart}.npy", tests=str(TESTS))
        if restart:
            lines = (tmp_path / "pulling.csv").read_text().splitlines(keepends=True)
            tables.append(lines)
            (tmp_path / "pulling.csv").write_text("".join(lines[:6]))
        process = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True)
        assert process.returncode == 0, process.stderr
        ends.append(np.load(tmp_path / f"{restart}.npy"))
    tables.append((tmp_path / "pulling.csv").read_text().splitlines(keepends=True))
    if split % 4 == 0:
        assert np.array_equal(*ends) and tables[0] == tables[1]
    assert ends[1] == pytest.approx(ends[0], abs=1e-9)
    assert len(tables[0]) == 11 and np.abs(ends[0][3] - [300, 0, 0]).max() > 1


def _mean_in_trap(values, ends, point, stiffness):
    """Mean of values of free chains, and its error, when their ends are in a trap at a point."""
    exponent = -0.5 * stiffness * np.sum((ends - point) ** 2, axis=1) / KT
    weight = np.exp(exponent - exponent.max())
    mean = np.sum(weight * values) / weight.sum()
    return mean, np.sqrt(np.sum(weight**2 * (values - mean) ** 2)) / weight.sum()


@pytest.mark.parametrize("engine", ["compiled", pytest.param("portable", marks=pytest.mark.exhaustive)])
def test_slow_pulling_measures_the_force_in_equilibrium(engine):
    """Chains of two free joints held at one end and in a trap at the other, against reweighted free chains."""
    kind, segments, chains, stiffness = FREELY_JOINTED, 2, 450, 6 * KT / 100**2
    ends = _draw_ends(kind, segments, 500_000, np.random.default_rng(2))
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine=engine)
    for chain in range(chains):
        filaments.add_straight(kind, segments, [0, 1000 * chain, 0], [1, 0, 0], clamped=[0])
        filaments.add_tether(chain, -1, [100, 1000 * chain, 0], stiffness)
    topology, system, positions = filaments.build()
    # The same velocity with every engine, at which the friction of a chain is below the error of the mean force.
    step = filaments.recommended_time_step().step
    interval = round(50 * recommended_time_step(kind, VISCOSITY, TEMPERATURE, "implicit", segments).step / step)
    integrator = filaments.create_integrator(system, step, random_seed=3)
    simulation = new_simulation(topology, system, positions, integrator)
    simulation.step(10 * interval)
    start = simulation.context.getTime()._value
    velocity = [0.4 / (interval * step), 0, 0]
    pulling = ConstantVelocityPulling(None, interval, filaments, range(chains), velocity, start_time=start)
    simulation.reporters.append(pulling)
    simulation.step(100 * interval)
    assert pulling["point_x"][0] == pytest.approx(100) and pulling["point_x"][-1] == pytest.approx(139.6)
    for window in (slice(0, 20), slice(40, 60), slice(80, 100)):
        point = [pulling["point_x"][window, 0].mean(), 0, 0]
        for name, values in (("force", stiffness * (point[0] - ends[:, 0])), ("extension", ends[:, 0])):
            mean, uncertainty = _mean_in_trap(values, ends, point, stiffness)
            of_chains = pulling[name][window].mean(axis=0)
            error = np.hypot(of_chains.std(ddof=1) / np.sqrt(chains), uncertainty)
            assert abs(of_chains.mean() - mean) < 4 * error, (name, point, of_chains.mean(), mean, error)
            if name == "extension":
                assert 4 * error < 0.05 * mean
            else:
                # Nodes move in proportion to their distance from the held end, at most all of them across.
                friction = segments * kind.segment_friction(VISCOSITY, TEMPERATURE).perpendicular / 3
                assert friction * velocity[0] < 1.5 * error


@pytest.mark.slow
def test_work_obeys_the_equality_of_jarzynski():
    """Dragging a free filament through the solvent leaves its free energy: <exp(-W/k_BT)> = 1 however fast it goes."""
    chains, stiffness = 3200, 50 * KT / 100**2
    generator = np.random.default_rng(4)
    filaments = Filaments(VISCOSITY, TEMPERATURE)
    for chain in range(chains):
        filaments.add_equilibrium(FREELY_JOINTED, 1, seed=chain)
        filaments.add_tether(chain, 0, generator.normal(0, np.sqrt(KT / stiffness), 3), stiffness)
    topology, system, positions = filaments.build()
    friction = FREELY_JOINTED.segment_friction(VISCOSITY, TEMPERATURE)
    step = 0.02 * friction.parallel / stiffness
    distance, steps = 11.0, 60
    simulation = new_simulation(topology, system, positions, filaments.create_integrator(system, step, random_seed=2))
    pulling = ConstantVelocityPulling(None, 3, filaments, range(chains), [distance / (steps * step), 0, 0])
    simulation.reporters.append(pulling)
    simulation.step(steps)
    work = pulling["work"].sum(axis=0) / KT
    assert work.mean() > 0.1 and work.mean() / (work.std() / np.sqrt(chains)) > 8
    factors = np.exp(-work)
    error = factors.std(ddof=1) / np.sqrt(chains)
    assert 4 * error < 0.05
    assert abs(factors.mean() - 1) < 4 * error


def test_bad_input_is_refused():
    filaments = straight_filaments("portable", chains=2)
    with pytest.raises(InputError, match="not in a System yet"):
        constant_tension(filaments, 1, [1, 0, 0])
    filaments.add_tether(0, 0, [0, 0, 0], 1)
    filaments.add_tether(1, 0, [0, 0, 0], 1)
    _, system, positions = filaments.build()
    for arguments, message in (
        (([0, 1], [1, 2]), r"forces must have the shape \(3,\) or \(2, 3\), but have \(2,\)"),
        (([0], [[1, 2, 3], [1, 2, 3]]), r"\(3,\) or \(1, 3\), but have \(2, 3\)"),
        (([0], [1, 2, np.nan]), "forces must be finite"),
        (([0], [1, 2, 3] * unit.nanometer), "forces has the unit"),
        (([-1], [1, 2, 3]), "An entry of particles must be at least 0"),
        (([0.5], [1, 2, 3]), "An entry of particles must be a whole number"),
    ):
        with pytest.raises(InputError, match=message):
            constant_force(*arguments)
    for arguments, message in (
        ((1, [0, 0, 0]), "direction must not be the zero vector"),
        ((1, [1, 0]), "direction must have three components"),
        (([1, 2, 3], [1, 0, 0]), r"tension must be a number or have the shape \(2,\), but has \(3,\)"),
        ((np.inf, [1, 0, 0]), "tension must be finite"),
        ((1 * unit.kelvin, [1, 0, 0]), "tension has the unit"),
        ((1, [1, 0, 0], [2]), "Filament 2 does not exist; there are 2"),
        ((1, [1, 0, 0], [-1]), "An entry of numbers must be at least 0"),
    ):
        with pytest.raises(InputError, match=message):
            constant_tension(filaments, *arguments)
    context = new_context(system, positions)
    here = filaments.in_context(context)
    with pytest.raises(InputError, match="must be one that constant_force or constant_tension has made"):
        change_constant_force(system.getForce(0), context, [1, 0, 0])
    for arguments, message in (
        ((0, filaments, 0, [1, 0, 0]), "reportInterval must be at least 1"),
        ((1, filaments, 2, [1, 0, 0]), "Tether 2 does not exist; there are 2"),
        ((1, filaments, [0, 0], [1, 0, 0]), "tethers must be different and at least one"),
        ((1, filaments, [], [1, 0, 0]), "tethers must be different and at least one"),
        ((1, filaments, -1, [1, 0, 0]), "tether must be at least 0"),
        ((1, filaments, 0, [0, 0, 0]), "velocity of a tether: direction must not be the zero vector"),
        ((1, filaments, 0, [1, 0]), r"velocity must have the shape \(3,\) or \(1, 3\)"),
        ((1, filaments, 0, [1, 0, 0] * unit.nanometer), "velocity has the unit"),
        ((1, filaments, 0, [1, np.nan, 0]), "velocity must be finite"),
        ((1, filaments, 0, [1, 0, 0], [0, 0]), "start must have the shape"),
        ((1, filaments, 0, [1, 0, 0], None, [1, 2]), "start_time must be a single number"),
        ((1, filaments, 0, [1, 0, 0], None, 1 * unit.kelvin), "start_time has the unit"),
    ):
        with pytest.raises(InputError, match=message):
            ConstantVelocityPulling(None, *arguments)
    with pytest.raises(InputError, match="There is no column 'x'"):
        ConstantVelocityPulling(None, 1, filaments, 0, [1, 0, 0])["x"]
    for arguments, message in (
        (([0], [[0, 0]]), r"points must have the shape \(1, 3\)"),
        (([0, 2], np.zeros((2, 3))), "Tether 2 does not exist"),
        (([0], [[0, 0, np.nan]]), "points must be finite"),
    ):
        with pytest.raises(InputError, match=message):
            here.move_tethers(*arguments)
    assert [tether.point for tether in here.tethers()] == [(0, 0, 0), (0, 0, 0)]
