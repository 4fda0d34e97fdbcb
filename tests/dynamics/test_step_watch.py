"""What a run shows of a step that is too long: divided steps, and the work of explicit forces."""

import warnings

import numpy as np
import openmm
import pytest
from openmm import unit

from openmm_cylchain import (
    DSDNA,
    F_ACTIN,
    MICROTUBULE,
    Filaments,
    InstabilityError,
    TimeStepError,
    TimeStepWarning,
)
from openmm_cylchain.couplings.shapes import Slab
from openmm_cylchain.couplings.walls import wall_force
from openmm_cylchain.engines.compiled import CylinderChainIntegrator
from openmm_cylchain.time_steps.step_watch import ERROR_WORK, WARNING_WORK, DividedSteps, ExplicitWork, WorkRecorder
from support.contexts import new_context, positions_of
from support.solvent import KT, TEMPERATURE, VISCOSITY

# Divided steps


def test_one_divided_step_in_a_thousand_is_tolerated():
    watch = DividedSteps(chains=10)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for _ in range(50):
            watch.add(100, 1)


def test_more_than_one_in_a_thousand_warn_once():
    watch = DividedSteps(chains=1)
    with pytest.warns(TimeStepWarning, match=r"0.3 % of the last steps of filaments were divided") as caught:
        for _ in range(10):
            watch.add(500, 1)
            watch.add(500, 2)
    assert len(caught) == 1
    assert "integrator.checks = False" in str(caught[0].message)


def test_the_end_of_a_long_run_counts():
    watch = DividedSteps(chains=4)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for _ in range(10000):
            watch.add(500, 0)
    with pytest.warns(TimeStepWarning):
        watch.add(500, 20)
    with pytest.raises(TimeStepError, match="11 % of the last steps.*Use a smaller time step"):
        watch.add(500, 220)


def test_a_bad_start_does_not_condemn_a_run():
    watch = DividedSteps(chains=200)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        # All filaments in the first step, of those in the window that it begins.
        watch.add(1, 200)
        watch.add(49, 0)
        # The warning's window is longer: it sees 1 in 100.
    with pytest.warns(TimeStepWarning):
        for _ in range(1000):
            watch.add(50, 0)


@pytest.mark.parametrize("chains, windows", [(1, 2), (2, 1), (100, 1)])
def test_more_than_one_in_ten_stop_the_run_within_a_hundred_steps(chains, windows):
    watch = DividedSteps(chains)
    for _ in range(windows - 1):
        watch.add(50, 20 * chains)
    with pytest.raises(TimeStepError):
        watch.add(50, 20 * chains)


def test_without_chains_nothing_is_watched():
    DividedSteps(0).add(1000, 1000)


# Work


def test_warning_and_error_of_work():
    watch = ExplicitWork()
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        watch.add(0.99 * WARNING_WORK, 3, 10**6, 1)
        for _ in range(2):
            watch.add(10.0 * WARNING_WORK, 3, 10**6, 1)
            watch.add(10.0 * WARNING_WORK, 3, 10**6, 1)
            watch.add(0.99 * WARNING_WORK, 3, 10**6, 1)
    with pytest.warns(TimeStepWarning, match="forces on particle 3: .* work of 0.36 k_B T") as caught:
        for _ in range(4):
            watch.add(1.02 * WARNING_WORK, 3, 10**6, 1)
    assert len(caught) == 1
    for factor in (1.01, 1.01, 0.99, 1.01, 1.01):
        watch.add(factor * ERROR_WORK, 3, 10**6, 1)
    with pytest.raises(TimeStepError, match="particle 7"):
        watch.add(np.nan, 7, 10**6, 1)


@pytest.mark.parametrize(
    "works, warns", [((4, 4, 4), True), ((9, 6, 3.4), False), ((np.nan,) * 3, True), ((9, 3, 9), False)]
)
def test_the_first_windows_are_short_and_warn_of_what_does_not_relax(works, warns):
    watch = ExplicitWork()
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        for work in works:
            assert watch.window == 32
            watch.add(work / 3 * ERROR_WORK, 5, watch.window, 1)
    assert bool(caught) == warns
    assert watch.window == 128


def test_a_force_that_is_not_known_is_noticed_within_a_hundred_steps():
    _, integrator = particle_in_a_trap(1.5)
    with pytest.warns(TimeStepWarning, match="too long for the forces on particle"):
        integrator.step(100)
    with pytest.raises(TimeStepError, match="energies are far too high"):
        integrator.step(400)


def test_the_largest_of_many_is_allowed_to_be_larger():
    # The work of harmonic coordinates in windows: squares of Gaussian displacements.
    generator = np.random.default_rng(3)
    steps, particles = 128, 1000
    mean = 0.8 * WARNING_WORK
    watch = ExplicitWork()
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for _ in range(30):
            work = mean * np.mean(generator.normal(size=(steps, particles)) ** 2, axis=0)
            assert work.max() > WARNING_WORK
            watch.add(work.max(), int(work.argmax()), steps, particles)


@pytest.mark.parametrize("x", [0.05, 0.2, 1.0])
def test_recorder_measures_the_work_of_a_harmonic_coordinate(x):
    generator = np.random.default_rng(1)
    stiffness, recorder = 3.0, WorkRecorder()
    positions = generator.normal(size=(400, 3))
    noise = np.sqrt(2 * KT * x / stiffness)
    means = []
    for number in range(1, 1 + 11 * recorder.window):
        forces = -stiffness * positions
        moves = x / stiffness * forces + noise * generator.normal(size=positions.shape)
        recorder.record(number, positions, forces, moves, KT)
        positions = positions + moves
        work = recorder.take()
        if work is not None and number > 2 * recorder.window:
            means.append(work)
    assert len(means) == 9
    assert np.mean(means) == pytest.approx(3 * 2 * x / (1 - x / 2), rel=0.02)


def test_recorder_leaves_out_what_does_not_follow_on():
    recorder = WorkRecorder()
    recorder.window = 4
    still, jump = np.zeros((2, 3)), np.full((2, 3), 1e3)
    forces = np.ones((2, 3))
    for number in range(1, 4):
        recorder.record(number, still, forces, still, KT)
    # Positions are set; then a step is missing; then all is well.
    recorder.record(4, jump, -1e9 * forces, still, KT)
    recorder.record(6, jump, 1e9 * forces, still, KT)
    for number in range(7, 11):
        recorder.record(number, jump, 1e9 * forces, still, KT)
    assert recorder.take() == pytest.approx(np.zeros(2))
    assert recorder.take() is None
    recorder.record(11, jump, forces, still, 0.0)
    recorder.record(12, jump, forces, still, KT)
    assert recorder._count == 0


# In the integrators


def portable(factor, kind=F_ACTIN, segments=8, temperature=None, checks=True):
    """A context of the portable engine with a step ``factor`` times as long as the recommended one."""
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine="portable")
    filaments.add_equilibrium(kind, segments, seed=4)
    _, system, positions = filaments.build()
    step = factor * filaments.recommended_time_step().step
    integrator = filaments.create_integrator(system, step, temperature=temperature, random_seed=3, checks=False)
    integrator.checks = checks
    context = new_context(system, positions, integrator)
    return context, integrator


@pytest.mark.parametrize("kind", [F_ACTIN, DSDNA, F_ACTIN.with_segment_length(30)])
def test_the_portable_engine_is_silent_at_the_recommended_step(kind):
    _, integrator = portable(1.0, kind)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        integrator.step(1000)


def test_the_portable_engine_warns_of_a_long_step():
    _, integrator = portable(6.0)
    with pytest.warns(TimeStepWarning, match="too long for the forces on particle") as caught:
        integrator.step(1000)
    assert len(caught) == 1
    assert caught[0].filename == __file__


def test_the_portable_engine_stops_at_far_too_long_a_step():
    _, integrator = portable(15.0)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", TimeStepWarning)
        with pytest.raises(TimeStepError, match="energies are far too high"):
            integrator.step(2000)


def test_checks_are_turned_off_by_name():
    _, integrator = portable(6.0, checks=False)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        integrator.step(600)


def test_no_work_at_zero_temperature():
    _, integrator = portable(6.0, temperature=0.0)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        integrator.step(600)


def test_checks_change_nothing():
    positions = []
    for checks in (True, False):
        context, integrator = portable(1.0, checks=checks)
        integrator.step(300)
        positions.append(positions_of(context))
    assert np.array_equal(*positions)


def kicked(stiffness, checks=True, filaments_count=1):
    """Filaments whose middles a stiff spring joins, with the compiled engine, at the recommended step without it."""
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine="compiled")
    force = openmm.HarmonicBondForce()
    for _ in range(filaments_count):
        filaments.add_straight(F_ACTIN, 16, [0, 0, 0], [1, 0, 0])
        filaments.add_straight(F_ACTIN, 16, [0, 30, 0], [1, 0, 0])
    _, system, positions = filaments.build()
    middles = [int(nodes[8]) for nodes in filaments.node_indices]
    for first, second in zip(middles[::2], middles[1::2]):
        force.addBond(first, second, 0.0, stiffness)
    system.addForce(force)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", TimeStepWarning)
        step = filaments.recommended_time_step()
        integrator = filaments.create_integrator(system, step, random_seed=1, checks=checks)
    context = new_context(system, positions, integrator)
    return context, integrator


def test_a_system_that_is_thrown_apart_stops():
    _, integrator = kicked(0.003 * 0.602214076)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", TimeStepWarning)
        with pytest.raises(TimeStepError, match="% of the last steps of filaments were divided.*recommended_time_step"):
            integrator.step(5000)
    # It has stopped long before the end.
    assert 0 < integrator.getNumDividedSteps() < 4000
    assert issubclass(TimeStepError, InstabilityError)


def test_a_system_that_is_thrown_apart_goes_on_without_checks():
    _, integrator = kicked(0.003 * 0.602214076, checks=False)
    integrator.step(1500)
    assert integrator.getNumDividedSteps() > 500


def test_long_calls_are_the_same_as_short_ones():
    positions = []
    for calls in ([1300], [500, 500, 300], [1] * 1300):
        context, integrator = kicked(1e-5)
        for steps in calls:
            integrator.step(steps)
        positions.append(positions_of(context))
    assert np.array_equal(positions[0], positions[1]) and np.array_equal(positions[0], positions[2])


# The work of explicit forces in the compiled engine


def context_of(filaments, system, positions, step, scheme="implicit", **options):
    """A Context and an integrator whose creation warns of nothing."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", TimeStepWarning)
        integrator = filaments.create_integrator(system, step, scheme, random_seed=5, **options)
    context = new_context(system, positions, integrator)
    return context, integrator


def linked(kind, segments, stiffness):
    """Two filaments whose middles a spring (pN/nm) joins."""
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine="compiled")
    for _ in range(2):
        filaments.add_straight(kind, segments, [-0.5 * segments * kind.segment_length, 0, 0], [1, 0, 0])
    _, system, positions = filaments.build()
    force = openmm.HarmonicBondForce()
    force.addBond(*(int(nodes[segments // 2]) for nodes in filaments.node_indices), 0.0, stiffness * 0.602214)
    system.addForce(force)
    return filaments, system, positions


def between_walls(stiffness=0.01):
    """A filament between walls (pN/nm) that are nearer to each other than it is long."""
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine="compiled")
    filaments.add_straight(F_ACTIN, 8, [0, 0, 0], [1, 0, 0])
    _, system, positions = filaments.build()
    system.addForce(wall_force(Slab((0, 0, 0), (0, 0, 1), 100.0), stiffness * 0.602214, list(range(9))))
    return filaments, system, positions


TOO_STIFF = [
    (DSDNA, 8, 10.0),
    (MICROTUBULE, 8, 0.03),
    (MICROTUBULE, 8, 0.1),
    (F_ACTIN, 16, 0.001),
    (F_ACTIN, 16, 0.003),
]


@pytest.mark.parametrize(("kind", "segments", "stiffness"), TOO_STIFF)
def test_springs_that_are_too_stiff_for_the_step_are_noticed(kind, segments, stiffness):
    filaments, system, positions = linked(kind, segments, stiffness)
    _, integrator = context_of(filaments, system, positions, filaments.recommended_time_step())
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        try:
            integrator.step(500)
            stopped = False
        except TimeStepError:
            stopped = True
    assert stopped or [str(one.message)[:45] for one in caught] == ["The time step is too long for the forces on p"]
    if not stopped:
        assert caught[0].filename == __file__


@pytest.mark.parametrize(("kind", "segments", "stiffness"), TOO_STIFF)
def test_the_step_that_knows_them_is_silent(kind, segments, stiffness):
    filaments, system, positions = linked(kind, segments, stiffness)
    _, integrator = context_of(filaments, system, positions, filaments.recommended_time_step(system=system))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        integrator.step(2000)


def test_walls_that_are_too_stiff_for_the_step_are_noticed():
    filaments, system, positions = between_walls()
    step = filaments.recommended_time_step(system=system).step
    _, integrator = context_of(filaments, system, positions, step)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        integrator.step(2000)
    _, integrator = context_of(*between_walls(), 10 * step)
    with warnings.catch_warnings():
        warnings.simplefilter("error", TimeStepWarning)
        with pytest.raises((TimeStepWarning, TimeStepError), match="too long for the forces on particle [0-8]:"):
            integrator.step(600)


def particle_in_a_trap(x, particles=400, **options):
    """Free particles in harmonic traps in which they relax by ``x`` in a step, and a filament that nothing acts on."""
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine="compiled")
    filaments.add_straight(F_ACTIN, 2, [0, 0, 0], [1, 0, 0])
    _, system, positions = filaments.build()
    force = openmm.CustomExternalForce("0.5*k*((x-trap)^2+y^2+z^2)")
    force.addGlobalParameter("trap", 0.0)
    force.addPerParticleParameter("k")
    for _ in range(particles):
        force.addParticle(system.addParticle(1.0), [3.0])
    system.addForce(force)
    positions = np.concatenate([positions._value, np.zeros((particles, 3))])
    friction = 3.0 * 1000.0 / x
    return context_of(filaments, system, positions, 1000.0, particle_friction=friction, **options)


def works(integrator, windows, window=128):
    """What the integrator measures in windows of steps."""
    integrator.setWorkWindow(window)
    found = []
    while len(found) < windows:
        integrator.checks = False
        CylinderChainIntegrator.step(integrator, window)
        work, particle, steps, particles = integrator.takeExplicitWork()
        if steps:
            found.append((work, particle, steps, particles))
    return found


@pytest.mark.parametrize("x", [0.05, 0.2, 1.0])
def test_measured_work_is_that_of_a_harmonic_coordinate(x):
    """One particle, whose largest mean is its mean, in windows so long that there is little chance in them."""
    _, integrator = particle_in_a_trap(x, particles=1)
    works(integrator, 2)
    found = works(integrator, 10, 20000)
    assert {one[1:] for one in found} == {(3, 20000, 1)}
    mean, error = np.mean([one[0] for one in found]), np.std([one[0] for one in found], ddof=1) / np.sqrt(10)
    assert error < 0.01 * mean
    assert abs(mean - 3 * 2 * x / (1 - x / 2)) < 4 * error + 1e-4 * mean


def test_the_largest_of_particles_is_found():
    _, integrator = particle_in_a_trap(0.2)
    works(integrator, 2)
    expected = 3 * 2 * 0.2 / 0.9
    for work, particle, steps, particles in works(integrator, 5):
        assert 3 <= particle < 403 and (steps, particles) == (128, 400)
        # By chance, the largest of 400.
        assert expected < work < expected * (1 + np.sqrt(2 / 128) * np.sqrt(2 * np.log(400)))


def test_measured_work_is_that_of_the_portable_engine():
    """The same forces and displacements give the same mean, to rounding."""
    context, integrator = particle_in_a_trap(0.4, particles=3)
    integrator.checks = False
    integrator.setWorkWindow(128)
    recorder, before = WorkRecorder(), None
    for number in range(1, 130):
        state = context.getState(positions=True, forces=True)
        positions, forces = state.getPositions(asNumpy=True)._value, state.getForces(asNumpy=True)._value
        forces[:3] = 0.0
        if before is not None:
            recorder.record(number - 1, before[0], before[1], positions - before[0], KT)
        before = positions, forces
        CylinderChainIntegrator.step(integrator, 1)
    recorder.record(129, *before, np.zeros_like(before[0]), KT)
    expected = recorder.take()
    work, particle, steps, particles = integrator.takeExplicitWork()
    assert (particle, steps, particles) == (int(np.argmax(expected)), 128, 3)
    assert work == pytest.approx(expected.max(), rel=1e-6)
    assert integrator.takeExplicitWork()[2] == 0


def moved(context, distance):
    context.setPositions(context.getState(positions=True).getPositions(asNumpy=True) + distance * unit.nanometer)


CHANGES = {
    "positions": lambda context, number: moved(context, [0, 100.0, -100.0][number % 3] + 1e3 * (number % 2)),
    "parameters": lambda context, number: context.setParameter("trap", 1e3 * (number % 2)),
    "forces": lambda context, number: trap_of(context, 1e3 * (number % 2)),
    "checkpoint": lambda context, number: context.loadCheckpoint(context.createCheckpoint()),
}


def trap_of(context, stiffness):
    force = context.getSystem().getForce(context.getSystem().getNumForces() - 1)
    force.setParticleParameters(0, 3, [3.0 + stiffness])
    force.updateParametersInContext(context)


@pytest.mark.parametrize("change", CHANGES)
def test_changes_from_outside_do_not_count(change):
    """A particle that hardly moves: what changes from outside is then all that could do work."""
    context, integrator = particle_in_a_trap(1e-9, particles=1)
    moved(context, 50.0)
    integrator.setWorkWindow(64)
    integrator.checks = False
    found = []
    for number in range(100):
        CHANGES[change](context, number)
        CylinderChainIntegrator.step(integrator, 3)
        found.append(integrator.takeExplicitWork())
    finished = [one for one in found if one[2]]
    # Of three steps, the two that follow on a step count.
    assert [one[2] for one in finished] == [64] * 3
    assert max(abs(one[0]) for one in finished) < 1e-5


def test_a_trap_that_jumps_now_and_then_does_not_warn():
    context, integrator = particle_in_a_trap(0.03, particles=1)
    integrator.checks = True
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for _ in range(40):
            # Three hundred thermal widths; it relaxes within a hundred steps, in one window of four, or two.
            integrator.step(510)
            context.setParameter("trap", 300.0 - context.getParameter("trap"))


def test_the_compiled_engine_measures_nothing_when_it_need_not():
    # At zero temperature.
    context, integrator = particle_in_a_trap(1.9, temperature=0.0)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        integrator.step(600)
    assert integrator.takeExplicitWork()[2] == 0
    # Without checks.
    context, integrator = particle_in_a_trap(1.9, checks=False)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        integrator.step(600)
    assert integrator.getWorkWindow() == 0 and integrator.takeExplicitWork()[2] == 0
    with pytest.raises(openmm.OpenMMException, match="must not be negative"):
        integrator.setWorkWindow(-1)


@pytest.mark.parametrize("scheme", ["implicit", "midpoint"])
def test_what_is_explicit_depends_on_the_scheme(scheme):
    """The forces of the chains are explicit in an explicit scheme alone."""
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine="compiled")
    filaments.add_straight(F_ACTIN, 4, [0, 0, 0], [1, 0, 0])
    _, system, positions = filaments.build()
    force = openmm.CustomExternalForce("1e-9*x^2")
    force.addParticle(2, [])
    system.addForce(force)
    step = filaments.recommended_time_step(scheme="midpoint")
    _, integrator = context_of(filaments, system, positions, step, scheme)
    (_, particle, _, particles), *_ = works(integrator, 1)
    assert particles == (1 if scheme == "implicit" else 5)
    assert particle == 2 or scheme == "midpoint"


def test_measuring_changes_no_trajectory():
    ends = []
    for checks in (True, False):
        context, integrator = context_of(*linked(F_ACTIN, 8, 1e-5), 1e6, checks=checks)
        integrator.step(300)
        ends.append(positions_of(context))
    assert np.array_equal(*ends)
