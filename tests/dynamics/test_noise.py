"""Noise inside OpenMM: no step uses that of another one, and steps of different sizes follow one Brownian path."""

import copy

import numpy as np
import openmm
import pytest

from openmm_cylchain import F_ACTIN, Filaments, FilamentType, InputError, stokes_friction
from support.contexts import new_context, positions_of
from support.platforms import ENGINE_SCHEMES
from support.solvent import KT, TEMPERATURE, VISCOSITY

# A segment that turns little and stretches little in a step.
SOFT = FilamentType(
    name="SOFT",
    diameter=F_ACTIN.diameter,
    segment_length=F_ACTIN.segment_length,
    bending_rigidity=0.0,
    stretching_stiffness=50 * KT / F_ACTIN.segment_length**2,
)
STEP = 1e4
COUNT = 1500


def context_of(engine, scheme="midpoint", step=STEP, level=0, seed=5, count=COUNT, kind=SOFT, segments=1):
    """Free segments and free particles, far from each other."""
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine=engine)
    for number in range(count):
        filaments.add_straight(kind, segments, [0, 0, 1000.0 * number], [1, 0, 0])
    _, system, positions = filaments.build()
    for _ in range(count):
        system.addParticle(1.0)
    friction = stokes_friction(50, VISCOSITY)
    integrator = filaments.create_integrator(system, step, scheme=scheme, particle_friction=friction, random_seed=seed)
    if level:
        integrator.setPathLevel(level)
    context = new_context(system, np.concatenate([positions._value, np.zeros((count, 3))]), integrator)
    return context, integrator


def moves(context, integrator, steps=1):
    """Displacements in the next steps, one after another."""
    result = []
    for _ in range(steps):
        before = positions_of(context)
        integrator.step(1)
        result.append(positions_of(context) - before)
    return np.array(result)


def correlation(one, other):
    """Of displacements, over the standard deviation of what independent ones give."""
    one, other = np.ravel(one), np.ravel(other)
    return np.corrcoef(one, other)[0, 1] * np.sqrt(one.size)


@pytest.mark.sample("compiled-implicit|portable-midpoint")
@pytest.mark.parametrize(("engine", "scheme"), ENGINE_SCHEMES)
def test_state_without_integrator_parameters_does_not_replay_noise(engine, scheme):
    context, integrator = context_of(engine, scheme)
    first = moves(context, integrator, 3)
    state = context.getState(positions=True)
    assert state.getStepCount() == 3
    replica, other = context_of(engine, scheme)
    # Without a State the noise is the same.
    assert np.corrcoef(np.ravel(first[0]), np.ravel(moves(replica, other)[0]))[0, 1] > 0.999
    replica, other = context_of(engine, scheme)
    replica.setState(state)
    later = moves(replica, other, 3)
    for one in first:
        for two in later:
            assert abs(correlation(one, two)) < 5


@pytest.mark.parametrize(("engine", "scheme"), ENGINE_SCHEMES)
def test_step_count_that_is_set_back_does_not_replay_noise(engine, scheme):
    context, integrator = context_of(engine, scheme)
    first = moves(context, integrator, 3)
    context.setStepCount(0)
    assert context.getStepCount() == 0
    later = moves(context, integrator, 3)
    context.setStepCount(1)
    later = np.concatenate([later, moves(context, integrator, 1)])
    assert context.getStepCount() == 2
    for one in first:
        for two in later:
            assert abs(correlation(one, two)) < 5


@pytest.mark.parametrize("engine", ["compiled", "portable"])
def test_checkpoints_and_states_restore_noise_exactly_after_the_step_count_was_set(engine):
    context, integrator = context_of(engine, count=20)
    integrator.step(3)
    for count in (0, 40):
        context.setStepCount(count)
        checkpoint = context.createCheckpoint()
        state = context.getState(positions=True, velocities=True, parameters=True, integratorParameters=True)
        integrator.step(4)
        expected = positions_of(context)
        context.loadCheckpoint(checkpoint)
        integrator.step(4)
        assert np.array_equal(positions_of(context), expected)
        context.setState(openmm.XmlSerializer.deserialize(openmm.XmlSerializer.serialize(state)))
        integrator.step(4)
        assert np.array_equal(positions_of(context), expected)
        other_context, other = context_of(engine, count=20)
        other_context.loadCheckpoint(checkpoint)
        other.step(4)
        assert np.array_equal(positions_of(other_context), expected)


@pytest.mark.sample("midpoint|implicit")
@pytest.mark.parametrize("scheme", ["midpoint", "euler"])
def test_finer_steps_follow_the_same_path(scheme):
    """Differences between runs at neighbouring levels shrink with the step; other seeds share nothing."""
    ends = {}
    for key in ((0, 5), (1, 5), (2, 5), (3, 5), (0, 6)):
        level, seed = key
        context, integrator = context_of("compiled", scheme, 4 * STEP / 2**level, level, seed)
        start = positions_of(context)
        integrator.step(16 * 2**level)
        ends[key] = positions_of(context) - start
    nodes = 2 * COUNT
    path, other = [ends[level, 5] for level in range(4)], ends[0, 6]
    size = np.sqrt(np.mean(path[0][:nodes] ** 2))
    errors = [np.sqrt(np.mean((path[k + 1][:nodes] - path[k][:nodes]) ** 2)) / size for k in range(3)]
    assert errors[0] < 0.01
    # Strong order one half, or one as far as noise along a segment and friction do not depend on each other.
    for coarse, fine in zip(errors, errors[1:]):
        assert fine < 0.8 * coarse
    # Without forces, particles outside chains do nothing but follow their path.
    for level in (1, 2, 3):
        assert path[level][nodes:] == pytest.approx(path[0][nodes:], abs=1e-9)
    assert abs(correlation(other[nodes:], path[0][nodes:])) < 5
    assert path[1][nodes:].var() == pytest.approx(other[nodes:].var(), rel=5 * np.sqrt(4 / (3 * COUNT)))


def test_implicit_steps_follow_the_same_path():
    """Filaments move alike at two levels, and not at the same level with half the step."""
    ends = {}
    for level, step_level in ((0, 0), (1, 1), (0, 1)):
        context, integrator = context_of(
            "compiled", "implicit", 1e6 / 2**step_level, level, count=60, kind=F_ACTIN, segments=8
        )
        start = positions_of(context)
        integrator.step(32 * 2**step_level)
        moved = (positions_of(context) - start)[: 60 * 9]
        ends[level, step_level] = moved.reshape(60, 9, 3).mean(axis=1)

    def relative(one, other):
        return np.sqrt(np.mean((ends[one] - ends[other]) ** 2) / np.mean(ends[one] ** 2))

    assert relative((0, 0), (1, 1)) < 0.02
    assert relative((0, 0), (0, 1)) > 0.5


def test_state_of_another_level_continues_at_the_same_time():
    """From level 0 to level 1 and back: particles outside chains follow the path of an unbroken run."""
    context, integrator = context_of("compiled", count=30)
    unbroken = moves(context, integrator, 12)[:, 60:].sum(axis=0)

    def continued(state, level, steps):
        context, integrator = context_of("compiled", step=STEP / 2**level, level=level, count=30)
        context.setState(openmm.XmlSerializer.deserialize(openmm.XmlSerializer.serialize(state)))
        # A State brings its step size along.
        integrator.setStepSize(STEP / 2**level)
        integrator.step(steps)
        return context.getState(positions=True, integratorParameters=True)

    context, integrator = context_of("compiled", count=30)
    integrator.step(4)
    state = context.getState(positions=True, integratorParameters=True)
    state = continued(state, 2, 16)
    state = continued(state, 1, 4)
    state = continued(state, 0, 2)
    assert state.getPositions(asNumpy=True)._value[60:] == pytest.approx(unbroken, abs=1e-9)


def test_level_is_kept_and_checked():
    _, integrator = context_of("compiled", count=1)
    assert integrator.getPathLevel() == 0
    integrator.setPathLevel(20)
    assert copy.deepcopy(integrator).getPathLevel() == 20
    text = openmm.XmlSerializer.serialize(integrator)
    assert 'pathLevel="20"' in text
    plain = type(integrator).cast(openmm.XmlSerializer.deserialize(text))
    assert plain.getPathLevel() == 20
    with pytest.raises(openmm.OpenMMException, match="Unsupported version"):
        openmm.XmlSerializer.deserialize(text.replace('version="4"', 'version="3"'))
    for wrong in (-1, 21, 1.5, True):
        with pytest.raises(InputError, match="path level"):
            integrator.setPathLevel(wrong)
    for wrong in (-1, 21):
        with pytest.raises(openmm.OpenMMException, match="between 0 and 20"):
            plain.setPathLevel(wrong)


def test_level_belongs_to_the_context():
    """A new level takes effect when the Context is reinitialized; a checkpoint brings its own."""
    context, integrator = context_of("compiled", count=20)
    integrator.step(2)
    integrator.setPathLevel(1)
    checkpoint = context.createCheckpoint()
    integrator.step(2)
    expected = positions_of(context)
    other_context, other = context_of("compiled", count=20)
    other.step(4)
    assert np.array_equal(positions_of(other_context), expected)
    context.loadCheckpoint(checkpoint)
    integrator.step(2)
    assert np.array_equal(positions_of(context), expected)
    start = positions_of(context)
    context.reinitialize()
    context.setPositions(start)
    integrator.step(1)
    fresh, fine = context_of("compiled", count=20, level=1)
    fresh.setPositions(start)
    fine.step(1)
    assert np.array_equal(positions_of(context), positions_of(fresh))
