"""Integrators inside OpenMM, on every engine: noise, seeds, checkpoints, groups, other particles, failures."""

import copy
import re
import warnings
from dataclasses import replace

import numpy as np
import openmm
import pytest
from conftest import ENGINE_SCHEMES
from openmm import app, unit
from physics_cases import ENGINE_PLATFORMS, KT, TEMPERATURE, VISCOSITY
from test_redistribution import _bent_chain, _dense_resistance

from openmm_cylchain import DSDNA, F_ACTIN, Filaments, InputError, InstabilityError, stokes_friction

STEP = 5e3  # ps


def _context(system, integrator, positions, platform="Reference"):
    context = openmm.Context(system, integrator, openmm.Platform.getPlatform(platform))
    context.setPositions(positions)
    return context


def _positions(context):
    return context.getState(positions=True).getPositions(asNumpy=True)._value


def _filaments(engine, segments=(5, 3)):
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine=engine)
    for seed, count in enumerate(segments):
        filaments.add_equilibrium(F_ACTIN, count, seed=seed)
    return filaments


def _bead_system():
    """A System of three beads, one of them massless, held by a weak bond, with its Topology."""
    topology, system = app.Topology(), openmm.System()
    chain = topology.addChain()
    for mass in (1e5, 0.0, 1e5):
        topology.addAtom("B", None, topology.addResidue("BEA", chain))
        system.addParticle(mass)
    bond = openmm.HarmonicBondForce()
    bond.addBond(0, 2, 100.0, 0.01)
    system.addForce(bond)
    return topology, system, np.array([[0.0, 500.0, 0.0], [50.0, 500.0, 0.0], [100.0, 500.0, 0.0]])


def periodic_force():
    """A force that does nothing but make its System periodic."""
    force = openmm.HarmonicBondForce()
    force.setUsesPeriodicBoundaryConditions(True)
    return force


def mixed_system(engine):
    """Two filaments and three beads in one System."""
    topology, system, positions = _bead_system()
    filaments = _filaments(engine)
    positions = filaments.add_to(topology, system, positions * unit.nanometer)
    return filaments, system, positions


def mixed_integrator(filaments, system, **options):
    friction = stokes_friction(50, VISCOSITY)
    return filaments.create_integrator(system, STEP, particle_friction=friction, **options)


@pytest.mark.parametrize(("engine", "scheme"), ENGINE_SCHEMES)
def test_noise_covariance_between_all_degrees_of_freedom(engine, scheme):
    """Cov(dx) = 2 k_B T dt Z^-1 within each chain and for a free particle, zero across and between steps."""
    topology, system = app.Topology(), openmm.System()
    topology.addAtom("B", None, topology.addResidue("BEA", topology.addChain()))
    system.addParticle(1e5)
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine=engine)
    filaments.add_nodes(F_ACTIN, _bent_chain(F_ACTIN, 3, 1))
    filaments.add_nodes(F_ACTIN, _bent_chain(F_ACTIN, 2, 2))
    positions = filaments.add_to(topology, system, np.zeros((1, 3)) * unit.nanometer)
    friction = stokes_friction(50, VISCOSITY)
    step = 1.0  # ps: the midpoint's resistance differs from that of the start by less than 1e-4.
    integrator = filaments.create_integrator(system, step, scheme=scheme, particle_friction=friction, random_seed=3)
    context = _context(system, integrator, positions)
    start = _positions(context)

    draws = 24000
    steps = np.empty((draws, start.size))
    for draw in range(draws):
        context.setPositions(start)
        integrator.step(1)
        steps[draw] = (_positions(context) - start).reshape(-1)

    expected = np.zeros((start.size, start.size))
    expected[:3, :3] = 2 * KT * step / friction * np.eye(3)
    coefficients = F_ACTIN.segment_friction(VISCOSITY, TEMPERATURE)
    for nodes in filaments.node_indices:
        block = slice(3 * nodes[0], 3 * nodes[-1] + 3)
        resistance = _dense_resistance(start[nodes], coefficients)
        expected[block, block] = 2 * KT * step * np.linalg.inv(resistance)

    centred = steps - steps.mean(axis=0)
    variances = np.diag(expected)
    error = np.sqrt((np.outer(variances, variances) + expected**2) / draws)
    covariance = centred.T @ centred / (draws - 1)
    assert np.abs((covariance - expected) / error).max() < 5
    # A 5 % error in friction or noise would show.
    assert np.all(0.05 * variances > 5 * np.diag(error))
    successive = centred[1:].T @ centred[:-1] / (draws - 1)
    assert np.abs(successive / np.sqrt(np.outer(variances, variances) / draws)).max() < 5


def test_same_seed_same_trajectory_other_seed_independent(engine):
    filaments, system, positions = mixed_system(engine)
    ends = []
    for seed in (1, 1, 2):
        context = _context(system, mixed_integrator(filaments, system, random_seed=seed), positions)
        context.getIntegrator().step(20)
        ends.append(_positions(context))
    assert np.array_equal(ends[0], ends[1])
    moved = ~np.isclose(ends[0], positions._value).all(axis=1)
    assert np.all(np.any(ends[0] != ends[2], axis=1)[moved])


def test_default_seed_differs_between_integrators(engine):
    filaments, system, positions = mixed_system(engine)
    ends = []
    for _ in range(2):
        integrator = mixed_integrator(filaments, system)
        context = _context(system, integrator, positions)
        integrator.step(1)
        ends.append(_positions(context))
    assert not np.allclose(ends[0], ends[1], atol=1e-9)


def test_two_contexts_at_once_equal_each_alone(engine):
    filaments, system, positions = mixed_system(engine)
    alone = []
    for seed in (1, 2):
        integrator = mixed_integrator(filaments, system, random_seed=seed)
        context = _context(system, integrator, positions)
        integrator.step(10)
        alone.append(_positions(context))
    integrators = [mixed_integrator(filaments, system, random_seed=seed) for seed in (1, 2)]
    contexts = [_context(system, integrator, positions) for integrator in integrators]
    for _ in range(10):
        for integrator in integrators:
            integrator.step(1)
    for context, expected in zip(contexts, alone):
        assert np.array_equal(_positions(context), expected)


@pytest.mark.parametrize(("engine", "platform"), ENGINE_PLATFORMS)
def test_two_contexts_in_two_threads_equal_each_alone(engine, platform):
    from concurrent.futures import ThreadPoolExecutor

    filaments, system, positions = mixed_system(engine)

    def run(seed):
        integrator = mixed_integrator(filaments, system, random_seed=seed)
        return integrator, _context(system, integrator, positions, platform)

    expected = []
    for seed in (1, 2):
        integrator, context = run(seed)
        integrator.step(50)
        expected.append(_positions(context))
    pairs = [run(seed) for seed in (1, 2)]
    with ThreadPoolExecutor(2) as pool:
        list(pool.map(lambda pair: pair[0].step(50), pairs))
    for (_, context), positions_alone in zip(pairs, expected):
        assert np.array_equal(_positions(context), positions_alone)


@pytest.mark.parametrize(("engine", "platform"), ENGINE_PLATFORMS)
def test_checkpoint_restart_is_bit_identical(engine, platform):
    filaments, system, positions = mixed_system(engine)
    integrator = mixed_integrator(filaments, system, random_seed=5)
    context = _context(system, integrator, positions, platform)
    integrator.step(15)
    checkpoint = context.createCheckpoint()
    integrator.step(15)
    unbroken = _positions(context)

    other = mixed_integrator(filaments, system, random_seed=5)
    restarted = _context(system, other, positions, platform)
    restarted.loadCheckpoint(checkpoint)
    other.step(15)
    assert np.array_equal(_positions(restarted), unbroken)
    assert restarted.getStepCount() == 30

    context.loadCheckpoint(checkpoint)
    integrator.step(15)
    assert np.array_equal(_positions(context), unbroken)


def test_saved_state_continues_with_the_integrators_own_seed(engine):
    """Replicas that start from one saved State with different seeds are independent."""
    filaments, system, positions = mixed_system(engine)
    integrator = mixed_integrator(filaments, system, random_seed=5)
    context = _context(system, integrator, positions)
    integrator.step(3)
    state = context.getState(positions=True, velocities=True, parameters=True, integratorParameters=True)
    integrator.step(3)
    ends = {5: _positions(context)}
    for seed in (6, 7):
        other = mixed_integrator(filaments, system, random_seed=seed)
        replica = _context(system, other, positions)
        replica.setState(state)
        other.step(3)
        ends[seed] = _positions(replica)
    mobile = [0, 2] + list(range(3, system.getNumParticles()))
    for one, two in ((5, 6), (5, 7), (6, 7)):
        assert np.all(np.any(ends[one][mobile] != ends[two][mobile], axis=1))


@pytest.mark.parametrize(("engine", "platform"), ENGINE_PLATFORMS)
def test_system_survives_xml(engine, platform):
    filaments, system, positions = mixed_system(engine)
    integrator = mixed_integrator(filaments, system, random_seed=5)
    restored = openmm.XmlSerializer.deserialize(openmm.XmlSerializer.serialize(system))
    ends = []
    for one in (system, restored):
        stepper = copy.deepcopy(integrator)
        context = openmm.Context(one, stepper, openmm.Platform.getPlatform(platform))
        context.setPositions(positions)
        stepper.step(10)
        ends.append(_positions(context))
    assert np.array_equal(*ends)
    assert not np.allclose(ends[0], positions._value)


def test_step_size_and_temperature_can_change(engine):
    filaments, system, positions = mixed_system(engine)
    integrator = mixed_integrator(filaments, system, scheme="midpoint", random_seed=1)
    context = _context(system, integrator, positions)
    integrator.step(1)
    integrator.setTemperature(0 * unit.kelvin)
    integrator.setStepSize(10 * unit.picoseconds)
    assert integrator.getTemperature() == 0 * unit.kelvin
    state = context.getState(positions=True, forces=True)
    start, forces = state.getPositions(asNumpy=True)._value, state.getForces(asNumpy=True)._value
    integrator.step(1)
    moved = _positions(context) - start
    friction = F_ACTIN.segment_friction(VISCOSITY, TEMPERATURE)
    for nodes in filaments.node_indices:
        velocity = np.linalg.solve(_dense_resistance(start[nodes], friction), forces[nodes].reshape(-1))
        assert np.allclose(moved[nodes].reshape(-1), 10 * velocity, rtol=1e-4, atol=1e-12)
    assert moved[0] == pytest.approx(10 * forces[0] / stokes_friction(50, VISCOSITY), rel=1e-9)
    assert integrator.computeSystemTemperature() == 0 * unit.kelvin


@pytest.mark.parametrize(("engine", "platform"), ENGINE_PLATFORMS)
def test_reported_forces_and_energy_are_the_physical_ones(engine, platform):
    filaments, system, positions = mixed_system(engine)
    plain = openmm.Context(system, openmm.VerletIntegrator(1.0), openmm.Platform.getPlatform(platform))
    integrator = mixed_integrator(filaments, system, random_seed=1)
    context = _context(system, integrator, positions, platform)
    integrator.step(7)
    plain.setPositions(context.getState(positions=True).getPositions())
    one = context.getState(energy=True, forces=True)
    two = plain.getState(energy=True, forces=True)
    assert one.getPotentialEnergy()._value == pytest.approx(two.getPotentialEnergy()._value, rel=1e-6)
    assert np.allclose(one.getForces(asNumpy=True)._value, two.getForces(asNumpy=True)._value, rtol=1e-5, atol=1e-6)
    assert one.getKineticEnergy()._value == 0.0


def test_integration_force_groups_leave_forces_out(engine):
    filaments, system, positions = mixed_system(engine)
    pull = openmm.CustomExternalForce("-1000*x")
    pull.setForceGroup(5)
    for particle in range(system.getNumParticles()):
        pull.addParticle(particle, [])
    system.addForce(pull)
    ends = []
    for groups in (None, set(range(32)) - {5}, {0, 31}):
        integrator = mixed_integrator(filaments, system, random_seed=1)
        if groups is not None:
            integrator.setIntegrationForceGroups(groups)
        context = _context(system, integrator, positions)
        integrator.step(2)
        ends.append(_positions(context))
    assert np.array_equal(ends[1], ends[2])
    assert np.all(ends[0][3:, 0] > ends[1][3:, 0])


def test_massless_particles_stay_and_virtual_sites_follow(engine):
    topology, system, positions = _bead_system()
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine=engine)
    filaments.add_equilibrium(F_ACTIN, 4, seed=1, clamped=[0, -1])
    positions = filaments.add_to(topology, system, positions * unit.nanometer)
    nodes = filaments.node_indices[0]
    site = system.addParticle(0.0)
    system.setVirtualSite(site, openmm.TwoParticleAverageSite(int(nodes[1]), int(nodes[2]), 0.25, 0.75))
    positions = np.vstack([positions._value, np.zeros(3)])
    for platform in [platform for one, platform in ENGINE_PLATFORMS if one == engine]:
        context = _context(system, mixed_integrator(filaments, system, random_seed=1), positions, platform)
        context.computeVirtualSites()
        context.getIntegrator().step(10)
        end = _positions(context)
        still = [1, nodes[0], nodes[-1]]
        assert np.allclose(end[still], positions[still], rtol=1e-6)
        assert np.all(np.abs(end[nodes[1:-1]] - positions[nodes[1:-1]]) > 0)
        assert np.allclose(end[site], 0.25 * end[nodes[1]] + 0.75 * end[nodes[2]], rtol=1e-5, atol=1e-3)


def test_free_particles_diffuse_with_their_own_friction(engine):
    topology, system = app.Topology(), openmm.System()
    chain = topology.addChain()
    count = 2000
    for _ in range(count):
        topology.addAtom("B", None, topology.addResidue("BEA", chain))
        system.addParticle(1e4)
    filaments = _filaments(engine, (1,))
    positions = filaments.add_to(topology, system, np.zeros((count, 3)) * unit.nanometer)
    friction = np.where(np.arange(count) < count // 2, 1e5, 4e5)
    integrator = filaments.create_integrator(system, STEP, particle_friction=friction, random_seed=9)
    context = _context(system, integrator, positions)
    integrator.step(10)
    moved = _positions(context)[:count]
    for half, gamma in ((slice(0, count // 2), 1e5), (slice(count // 2, count), 4e5)):
        squares = moved[half].reshape(-1) ** 2
        expected = 2 * KT * 10 * STEP / gamma
        assert abs(squares.mean() - expected) < 4 * squares.std(ddof=1) / np.sqrt(len(squares))


@pytest.mark.parametrize(("engine", "platform"), ENGINE_PLATFORMS)
def test_blow_up_names_filament_segment_and_step_and_keeps_positions_finite(engine, platform):
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine=engine)
    filaments.add_equilibrium(F_ACTIN, 6, seed=1)
    filaments.add_equilibrium(DSDNA, 4, seed=2)
    _, system, positions = filaments.build()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        integrator = filaments.create_integrator(system, STEP, scheme="midpoint", random_seed=1)
    context = _context(system, integrator, positions, platform)
    with pytest.raises(InstabilityError, match=r"Filament 1 \(DNA\) has blown up at segment \d in step \d+"):
        integrator.step(1000)
    assert np.isfinite(_positions(context)).all()
    assert np.isfinite(context.getState(energy=True).getPotentialEnergy()._value)


@pytest.mark.parametrize(("engine", "platform"), ENGINE_PLATFORMS)
def test_steps_at_once_equal_steps_one_by_one(engine, platform):
    """With nothing but chains in the System, the compiled engine takes many steps at once."""
    filaments = _filaments(engine, (5, 3, 8, 8, 1))
    _, system, positions = filaments.build()
    ends = []
    for split in ([100], [1] * 100, [7, 40, 1, 52]):
        integrator = filaments.create_integrator(system, STEP, random_seed=2)
        context = _context(system, integrator, positions, platform)
        for steps in split:
            integrator.step(steps)
        state = context.getState(positions=True, velocities=True)
        ends.append((state.getPositions(asNumpy=True)._value, state.getVelocities(asNumpy=True)._value))
        assert context.getStepCount() == 100
        assert context.getTime()._value == pytest.approx(100 * STEP)
    for end in ends[1:]:
        assert np.array_equal(end[0], ends[0][0])
        assert np.array_equal(end[1], ends[0][1])


def test_blow_up_within_steps_at_once_leaves_all_chains_at_the_step_before(engine):
    def start():
        filaments = _filaments(engine, (8,) * 9)
        filaments.add_equilibrium(DSDNA, 4, seed=2)
        _, system, positions = filaments.build()
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            integrator = filaments.create_integrator(system, 170.0, scheme="midpoint", random_seed=1)
        return integrator, _context(system, integrator, positions)

    integrator, context = start()
    with pytest.raises(InstabilityError, match=r"in step \d+") as at_once:
        integrator.step(10000)
    other, other_context = start()
    with pytest.raises(InstabilityError) as one_by_one:
        for _ in range(10000):
            other.step(1)
    assert str(at_once.value) == str(one_by_one.value)
    assert context.getStepCount() == other_context.getStepCount() > 2
    assert np.array_equal(_positions(context), _positions(other_context))


@pytest.mark.parametrize(("engine", "platform"), ENGINE_PLATFORMS)
@pytest.mark.parametrize("box", [None, 1800.0])
def test_lengths_that_leave_the_range_of_fene_are_a_blow_up(engine, platform, box):
    """A segment can be as short or long as its FENE potential allows, or else has no energy."""
    kind = replace(F_ACTIN, stretching_model="fene", maximum_extension=1.0)
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine=engine)
    for seed in range(3):
        filaments.add_equilibrium(kind, 8, seed=seed)
    _, system, positions = filaments.build()
    if box is not None:
        system.setDefaultPeriodicBoxVectors(*np.diag([box] * 3))
        system.addForce(periodic_force())
    step = 500 * filaments.recommended_time_step(scheme="midpoint").step
    integrator = filaments.create_integrator(system, step, scheme="midpoint", random_seed=1, checks=False)
    context = _context(system, integrator, positions, platform)
    with pytest.raises(
        InstabilityError,
        match=r"Filament \d \(ACT\) has blown up at segment \d in step \d+: it would be 3(58|61)\.\d+ nm long after "
        "it, and its FENE potential is finite between 359 and 361 nm alone",
    ) as caught:
        integrator.step(1000)
    filament, segment = map(int, re.search(r"Filament (\d).*segment (\d)", str(caught.value)).groups())
    assert filament < 3 and segment < 8
    assert np.isfinite(context.getState(energy=True).getPotentialEnergy()._value)


@pytest.mark.parametrize("scheme", ["implicit", "midpoint"])
def test_starts_beyond_the_range_of_fene_are_refused(scheme):
    kind = replace(F_ACTIN, stretching_model="fene", maximum_extension=1.0)
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine="compiled")
    for seed in range(2):
        filaments.add_equilibrium(kind, 8, seed=seed, direction=[1, 0, 0])
    _, system, positions = filaments.build()
    integrator = filaments.create_integrator(system, 1.0, scheme=scheme)
    moved = positions._value.copy()
    moved[9] += [-5.0, 0, 0]
    context = _context(system, integrator, moved)
    with pytest.raises(
        InputError,
        match=r"Filament 1 \(ACT\) is out of range at segment 0: it is 36\d\.\d+ nm long, and its FENE "
        "potential is finite",
    ):
        integrator.step(1)
    context.setPositions(positions)
    integrator.step(1)


def test_infinite_force_is_traced_to_its_segment(engine):
    filaments, system, positions = mixed_system(engine)
    wall = openmm.CustomExternalForce("sqrt(-1-x^2)")
    wall.addParticle(int(filaments.node_indices[1][2]), [])
    system.addForce(wall)
    integrator = mixed_integrator(filaments, system)
    context = _context(system, integrator, positions)
    with pytest.raises(InstabilityError, match=r"Filament 1 \(ACT\) has blown up at segment 1 in step 1"):
        integrator.step(1)
    assert np.array_equal(_positions(context), positions._value)


def test_broken_particle_is_named(engine):
    filaments, system, positions = mixed_system(engine)
    wall = openmm.CustomExternalForce("sqrt(-1-x^2)")
    wall.addParticle(2, [])
    system.addForce(wall)
    integrator = mixed_integrator(filaments, system)
    context = _context(system, integrator, positions)
    with pytest.raises(InstabilityError, match="Particle 2, outside filaments"):
        integrator.step(1)
    assert np.array_equal(_positions(context), positions._value)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"scheme": "runge-kutta"}, "scheme must be one of"),
        ({"temperature": -1}, "temperature cannot be negative"),
        ({"temperature": float("nan")}, "temperature must be finite"),
        ({"random_seed": -3}, "random_seed must be at least 0"),
        ({"random_seed": 2**31}, "below 2"),
        ({"random_seed": 1.5}, "whole number"),
    ],
)
def test_bad_options_are_refused(engine, options, message):
    filaments = _filaments(engine, (2,))
    _, system, _ = filaments.build()
    with pytest.raises(InputError, match=message):
        filaments.create_integrator(system, STEP, **options)


@pytest.mark.parametrize("step", [0, -1, float("inf"), 1 * unit.nanometer, [1, 2]])
def test_bad_steps_are_refused(engine, step):
    filaments = _filaments(engine, (2,))
    _, system, _ = filaments.build()
    with pytest.raises(InputError, match="step_size"):
        filaments.create_integrator(system, step)


def test_simulation_and_reporters(engine, tmp_path):
    filaments = _filaments(engine, (4,))
    topology, system, positions = filaments.build()
    integrator = filaments.create_integrator(system, STEP * unit.picoseconds, random_seed=1)
    simulation = app.Simulation(topology, system, integrator, openmm.Platform.getPlatform("Reference"))
    simulation.context.setPositions(positions)
    log = tmp_path / "log.csv"
    simulation.reporters.append(app.DCDReporter(str(tmp_path / "t.dcd"), 5))
    simulation.reporters.append(
        app.StateDataReporter(str(log), 5, step=True, time=True, potentialEnergy=True, temperature=True)
    )
    simulation.step(20)
    rows = np.loadtxt(log, delimiter=",", comments="#")
    assert np.array_equal(rows[:, 0], [5, 10, 15, 20])
    assert rows[:, 1] == pytest.approx(rows[:, 0] * STEP)
    assert np.all(rows[:, 3] == pytest.approx(TEMPERATURE))
    simulation.saveCheckpoint(str(tmp_path / "c.chk"))
    simulation.loadCheckpoint(str(tmp_path / "c.chk"))
    assert simulation.currentStep == 20
