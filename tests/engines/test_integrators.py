"""Integrators inside OpenMM, on every engine: noise, seeds, checkpoints, groups, other particles, failures."""

import copy
import re
import warnings
from dataclasses import replace

import numpy as np
import openmm
import pytest
from openmm import app, unit

from openmm_cylchain import DSDNA, F_ACTIN, Filaments, InputError, InstabilityError, stokes_friction
from support.contexts import energy_of, new_context, new_simulation, positions_of
from support.dense_mechanics import bent_chain, dense_resistance
from support.filaments_and_beads import STEP, actin_filaments, bead_system, filaments_and_beads, integrator_of_both
from support.platforms import ENGINE_PLATFORMS, ENGINE_SCHEMES, EVERYWHERE
from support.solvent import KT, TEMPERATURE, VISCOSITY


def periodic_force():
    """A force that does nothing but make its System periodic."""
    force = openmm.HarmonicBondForce()
    force.setUsesPeriodicBoundaryConditions(True)
    return force


@pytest.mark.sample("compiled")
@pytest.mark.parametrize(("engine", "scheme"), ENGINE_SCHEMES)
def test_noise_covariance_between_all_degrees_of_freedom(engine, scheme):
    """Cov(dx) = 2 k_B T dt Z^-1 within each chain and for a free particle, zero across and between steps."""
    topology, system = app.Topology(), openmm.System()
    topology.addAtom("B", None, topology.addResidue("BEA", topology.addChain()))
    system.addParticle(1e5)
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine=engine)
    filaments.add_nodes(F_ACTIN, bent_chain(F_ACTIN, 3, 1))
    filaments.add_nodes(F_ACTIN, bent_chain(F_ACTIN, 2, 2))
    positions = filaments.add_to(topology, system, np.zeros((1, 3)) * unit.nanometer)
    friction = stokes_friction(50, VISCOSITY)
    step = 1.0  # ps: the midpoint's resistance differs from that of the start by less than 1e-4.
    integrator = filaments.create_integrator(system, step, scheme=scheme, particle_friction=friction, random_seed=3)
    context = new_context(system, positions, integrator)
    start = positions_of(context)

    draws = 24000
    steps = np.empty((draws, start.size))
    for draw in range(draws):
        context.setPositions(start)
        integrator.step(1)
        steps[draw] = (positions_of(context) - start).reshape(-1)

    expected = np.zeros((start.size, start.size))
    expected[:3, :3] = 2 * KT * step / friction * np.eye(3)
    coefficients = F_ACTIN.segment_friction(VISCOSITY, TEMPERATURE)
    for nodes in filaments.node_indices:
        block = slice(3 * nodes[0], 3 * nodes[-1] + 3)
        resistance = dense_resistance(start[nodes], coefficients)
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
    filaments, system, positions = filaments_and_beads(engine)
    ends = []
    for seed in (1, 1, 2):
        context = new_context(system, positions, integrator_of_both(filaments, system, random_seed=seed))
        context.getIntegrator().step(20)
        ends.append(positions_of(context))
    assert np.array_equal(ends[0], ends[1])
    moved = ~np.isclose(ends[0], positions._value).all(axis=1)
    assert np.all(np.any(ends[0] != ends[2], axis=1)[moved])


def test_default_seed_differs_between_integrators(engine):
    filaments, system, positions = filaments_and_beads(engine)
    ends = []
    for _ in range(2):
        integrator = integrator_of_both(filaments, system)
        context = new_context(system, positions, integrator)
        integrator.step(1)
        ends.append(positions_of(context))
    assert not np.allclose(ends[0], ends[1], atol=1e-9)


def test_two_contexts_at_once_equal_each_alone(engine):
    filaments, system, positions = filaments_and_beads(engine)
    alone = []
    for seed in (1, 2):
        integrator = integrator_of_both(filaments, system, random_seed=seed)
        context = new_context(system, positions, integrator)
        integrator.step(10)
        alone.append(positions_of(context))
    integrators = [integrator_of_both(filaments, system, random_seed=seed) for seed in (1, 2)]
    contexts = [new_context(system, positions, integrator) for integrator in integrators]
    for _ in range(10):
        for integrator in integrators:
            integrator.step(1)
    for context, expected in zip(contexts, alone):
        assert np.array_equal(positions_of(context), expected)


@pytest.mark.parametrize(("engine", "platform"), EVERYWHERE)
def test_two_contexts_in_two_threads_equal_each_alone(engine, platform):
    from concurrent.futures import ThreadPoolExecutor

    filaments, system, positions = filaments_and_beads(engine)

    def run(seed):
        integrator = integrator_of_both(filaments, system, random_seed=seed)
        return integrator, new_context(system, positions, integrator, platform)

    expected = []
    for seed in (1, 2):
        integrator, context = run(seed)
        integrator.step(50)
        expected.append(positions_of(context))
    pairs = [run(seed) for seed in (1, 2)]
    with ThreadPoolExecutor(2) as pool:
        list(pool.map(lambda pair: pair[0].step(50), pairs))
    for (_, context), positions_alone in zip(pairs, expected):
        assert np.array_equal(positions_of(context), positions_alone)


@pytest.mark.parametrize(("engine", "platform"), EVERYWHERE)
def test_checkpoint_restart_is_bit_identical(engine, platform):
    filaments, system, positions = filaments_and_beads(engine)
    integrator = integrator_of_both(filaments, system, random_seed=5)
    context = new_context(system, positions, integrator, platform)
    integrator.step(15)
    checkpoint = context.createCheckpoint()
    integrator.step(15)
    unbroken = positions_of(context)

    other = integrator_of_both(filaments, system, random_seed=5)
    restarted = new_context(system, positions, other, platform)
    restarted.loadCheckpoint(checkpoint)
    other.step(15)
    assert np.array_equal(positions_of(restarted), unbroken)
    assert restarted.getStepCount() == 30

    context.loadCheckpoint(checkpoint)
    integrator.step(15)
    assert np.array_equal(positions_of(context), unbroken)


def test_saved_state_continues_with_the_integrators_own_seed(engine):
    """Replicas that start from one saved State with different seeds are independent."""
    filaments, system, positions = filaments_and_beads(engine)
    integrator = integrator_of_both(filaments, system, random_seed=5)
    context = new_context(system, positions, integrator)
    integrator.step(3)
    state = context.getState(positions=True, velocities=True, parameters=True, integratorParameters=True)
    integrator.step(3)
    ends = {5: positions_of(context)}
    for seed in (6, 7):
        other = integrator_of_both(filaments, system, random_seed=seed)
        replica = new_context(system, positions, other)
        replica.setState(state)
        other.step(3)
        ends[seed] = positions_of(replica)
    mobile = [0, 2] + list(range(3, system.getNumParticles()))
    for one, two in ((5, 6), (5, 7), (6, 7)):
        assert np.all(np.any(ends[one][mobile] != ends[two][mobile], axis=1))


@pytest.mark.parametrize(("engine", "platform"), EVERYWHERE)
def test_system_survives_xml(engine, platform):
    filaments, system, positions = filaments_and_beads(engine)
    integrator = integrator_of_both(filaments, system, random_seed=5)
    restored = openmm.XmlSerializer.deserialize(openmm.XmlSerializer.serialize(system))
    ends = []
    for one in (system, restored):
        stepper = copy.deepcopy(integrator)
        context = new_context(one, positions, stepper, platform)
        stepper.step(10)
        ends.append(positions_of(context))
    assert np.array_equal(*ends)
    assert not np.allclose(ends[0], positions._value)


def test_step_size_and_temperature_can_change(engine):
    filaments, system, positions = filaments_and_beads(engine)
    integrator = integrator_of_both(filaments, system, scheme="midpoint", random_seed=1)
    context = new_context(system, positions, integrator)
    integrator.step(1)
    integrator.setTemperature(0 * unit.kelvin)
    integrator.setStepSize(10 * unit.picoseconds)
    assert integrator.getTemperature() == 0 * unit.kelvin
    state = context.getState(positions=True, forces=True)
    start, forces = state.getPositions(asNumpy=True)._value, state.getForces(asNumpy=True)._value
    integrator.step(1)
    moved = positions_of(context) - start
    friction = F_ACTIN.segment_friction(VISCOSITY, TEMPERATURE)
    for nodes in filaments.node_indices:
        velocity = np.linalg.solve(dense_resistance(start[nodes], friction), forces[nodes].reshape(-1))
        assert np.allclose(moved[nodes].reshape(-1), 10 * velocity, rtol=1e-4, atol=1e-12)
    assert moved[0] == pytest.approx(10 * forces[0] / stokes_friction(50, VISCOSITY), rel=1e-9)
    assert integrator.computeSystemTemperature() == 0 * unit.kelvin


@pytest.mark.parametrize(("engine", "platform"), EVERYWHERE)
def test_reported_forces_and_energy_are_the_physical_ones(engine, platform):
    filaments, system, positions = filaments_and_beads(engine)
    plain = new_context(system, positions, platform=platform)
    integrator = integrator_of_both(filaments, system, random_seed=1)
    context = new_context(system, positions, integrator, platform)
    integrator.step(7)
    plain.setPositions(context.getState(positions=True).getPositions())
    one = context.getState(energy=True, forces=True)
    two = plain.getState(energy=True, forces=True)
    assert one.getPotentialEnergy()._value == pytest.approx(two.getPotentialEnergy()._value, rel=1e-6)
    assert np.allclose(one.getForces(asNumpy=True)._value, two.getForces(asNumpy=True)._value, rtol=1e-5, atol=1e-6)
    assert one.getKineticEnergy()._value == 0.0


def test_integration_force_groups_leave_forces_out(engine):
    filaments, system, positions = filaments_and_beads(engine)
    pull = openmm.CustomExternalForce("-1000*x")
    pull.setForceGroup(5)
    for particle in range(system.getNumParticles()):
        pull.addParticle(particle, [])
    system.addForce(pull)
    ends = []
    for groups in (None, set(range(32)) - {5}, {0, 31}):
        integrator = integrator_of_both(filaments, system, random_seed=1)
        if groups is not None:
            integrator.setIntegrationForceGroups(groups)
        context = new_context(system, positions, integrator)
        integrator.step(2)
        ends.append(positions_of(context))
    assert np.array_equal(ends[1], ends[2])
    assert np.all(ends[0][3:, 0] > ends[1][3:, 0])


@pytest.mark.parametrize("late", ["added", "given a mass"])
def test_particles_that_can_move_after_the_integrator_was_created_are_refused(engine, late):
    """They have no friction. The compiled engine refuses the Context, and the portable one its first step."""
    filaments, system, positions = filaments_and_beads(engine)
    integrator = integrator_of_both(filaments, system, random_seed=1)
    particle = 1
    if late == "added":
        particle = system.addParticle(1.0)
        positions = np.vstack([positions._value, np.zeros(3)])
    else:
        system.setParticleMass(particle, 1.0)
    message = rf"Particle {particle} .*can move, but has no friction coefficient.*Filaments\.create_integrator"
    if engine == "compiled":
        with pytest.raises(openmm.OpenMMException, match=message):
            new_context(system, positions, integrator)
        return
    context = new_context(system, positions, integrator)
    with pytest.raises(InputError, match=message):
        integrator.step(1)
    assert np.array_equal(positions_of(context)[particle], np.asarray(positions)[particle])


def test_massless_particles_stay_and_virtual_sites_follow(engine):
    topology, system, positions = bead_system()
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine=engine)
    filaments.add_equilibrium(F_ACTIN, 4, seed=1, clamped=[0, -1])
    positions = filaments.add_to(topology, system, positions * unit.nanometer)
    nodes = filaments.node_indices[0]
    site = system.addParticle(0.0)
    system.setVirtualSite(site, openmm.TwoParticleAverageSite(int(nodes[1]), int(nodes[2]), 0.25, 0.75))
    positions = np.vstack([positions._value, np.zeros(3)])
    for platform in [platform for one, platform in ENGINE_PLATFORMS if one == engine]:
        context = new_context(system, positions, integrator_of_both(filaments, system, random_seed=1), platform)
        context.computeVirtualSites()
        context.getIntegrator().step(10)
        end = positions_of(context)
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
    filaments = actin_filaments(engine, (1,))
    positions = filaments.add_to(topology, system, np.zeros((count, 3)) * unit.nanometer)
    friction = np.where(np.arange(count) < count // 2, 1e5, 4e5)
    integrator = filaments.create_integrator(system, STEP, particle_friction=friction, random_seed=9)
    context = new_context(system, positions, integrator)
    integrator.step(10)
    moved = positions_of(context)[:count]
    for half, gamma in ((slice(0, count // 2), 1e5), (slice(count // 2, count), 4e5)):
        squares = moved[half].reshape(-1) ** 2
        expected = 2 * KT * 10 * STEP / gamma
        assert abs(squares.mean() - expected) < 4 * squares.std(ddof=1) / np.sqrt(len(squares))


@pytest.mark.parametrize(("engine", "platform"), EVERYWHERE)
def test_blow_up_names_filament_segment_and_step_and_keeps_positions_finite(engine, platform):
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine=engine)
    filaments.add_equilibrium(F_ACTIN, 6, seed=1)
    filaments.add_equilibrium(DSDNA, 4, seed=2)
    _, system, positions = filaments.build()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        integrator = filaments.create_integrator(system, STEP, scheme="midpoint", random_seed=1)
    context = new_context(system, positions, integrator, platform)
    with pytest.raises(InstabilityError, match=r"Filament 1 \(DNA\) has blown up at segment \d in step \d+"):
        integrator.step(1000)
    assert np.isfinite(positions_of(context)).all()
    assert np.isfinite(energy_of(context))


@pytest.mark.parametrize(("engine", "platform"), EVERYWHERE)
def test_steps_at_once_equal_steps_one_by_one(engine, platform):
    """With nothing but chains in the System, the compiled engine takes many steps at once."""
    filaments = actin_filaments(engine, (5, 3, 8, 8, 1))
    _, system, positions = filaments.build()
    ends = []
    for split in ([100], [1] * 100, [7, 40, 1, 52]):
        integrator = filaments.create_integrator(system, STEP, random_seed=2)
        context = new_context(system, positions, integrator, platform)
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
        filaments = actin_filaments(engine, (8,) * 9)
        filaments.add_equilibrium(DSDNA, 4, seed=2)
        _, system, positions = filaments.build()
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            integrator = filaments.create_integrator(system, 170.0, scheme="midpoint", random_seed=1)
        return integrator, new_context(system, positions, integrator)

    integrator, context = start()
    with pytest.raises(InstabilityError, match=r"in step \d+") as at_once:
        integrator.step(10000)
    other, other_context = start()
    with pytest.raises(InstabilityError) as one_by_one:
        for _ in range(10000):
            other.step(1)
    assert str(at_once.value) == str(one_by_one.value)
    assert context.getStepCount() == other_context.getStepCount() > 2
    assert np.array_equal(positions_of(context), positions_of(other_context))


@pytest.mark.parametrize(("engine", "platform"), EVERYWHERE)
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
    context = new_context(system, positions, integrator, platform)
    with pytest.raises(
        InstabilityError,
        match=r"Filament \d \(ACT\) has blown up at segment \d in step \d+: it would be 3(58|61)\.\d+ nm long after "
        "it, and its FENE potential is finite between 359 and 361 nm alone",
    ) as caught:
        integrator.step(1000)
    filament, segment = map(int, re.search(r"Filament (\d).*segment (\d)", str(caught.value)).groups())
    assert filament < 3 and segment < 8
    assert np.isfinite(energy_of(context))


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
    context = new_context(system, moved, integrator)
    with pytest.raises(
        InputError,
        match=r"Filament 1 \(ACT\) is out of range at segment 0: it is 36\d\.\d+ nm long, and its FENE "
        "potential is finite",
    ):
        integrator.step(1)
    context.setPositions(positions)
    integrator.step(1)


def test_infinite_force_is_traced_to_its_segment(engine):
    filaments, system, positions = filaments_and_beads(engine)
    wall = openmm.CustomExternalForce("sqrt(-1-x^2)")
    wall.addParticle(int(filaments.node_indices[1][2]), [])
    system.addForce(wall)
    integrator = integrator_of_both(filaments, system)
    context = new_context(system, positions, integrator)
    with pytest.raises(InstabilityError, match=r"Filament 1 \(ACT\) has blown up at segment 1 in step 1"):
        integrator.step(1)
    assert np.array_equal(positions_of(context), positions._value)


def test_broken_particle_is_named(engine):
    filaments, system, positions = filaments_and_beads(engine)
    wall = openmm.CustomExternalForce("sqrt(-1-x^2)")
    wall.addParticle(2, [])
    system.addForce(wall)
    integrator = integrator_of_both(filaments, system)
    context = new_context(system, positions, integrator)
    with pytest.raises(InstabilityError, match="Particle 2, outside filaments"):
        integrator.step(1)
    assert np.array_equal(positions_of(context), positions._value)


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
    filaments = actin_filaments(engine, (2,))
    _, system, _ = filaments.build()
    with pytest.raises(InputError, match=message):
        filaments.create_integrator(system, STEP, **options)


@pytest.mark.parametrize("step", [0, -1, float("inf"), 1 * unit.nanometer, [1, 2]])
def test_bad_steps_are_refused(engine, step):
    filaments = actin_filaments(engine, (2,))
    _, system, _ = filaments.build()
    with pytest.raises(InputError, match="step_size"):
        filaments.create_integrator(system, step)


def test_simulation_and_reporters(engine, tmp_path):
    filaments = actin_filaments(engine, (4,))
    topology, system, positions = filaments.build()
    integrator = filaments.create_integrator(system, STEP * unit.picoseconds, random_seed=1)
    simulation = new_simulation(topology, system, positions, integrator)
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
