"""Hands that follow the helix of filaments with twist: torques on both sides, stall, friction, equilibrium, rings."""

import warnings
from dataclasses import replace

import numpy as np
import openmm
import pytest
from openmm import unit

from openmm_cylchain import (
    Crosslinker,
    Filaments,
    FilamentType,
    Hand,
    HandOnHelix,
    InputError,
    SegmentLengthWarning,
    TimeStepWarning,
    analysis,
)
from openmm_cylchain.kinetics.binding_force import find_binding_force
from support.contexts import new_context, positions_of
from support.solvent import KT, TEMPERATURE, VISCOSITY

SIGMAS = 4.0
LENGTH, COUNT = 5.0, 40
# Bends hardly, so that closed forms of straight rods hold.
ROD = FilamentType(
    name="rod",
    diameter=2.0,
    segment_length=LENGTH,
    bending_rigidity=1e6 * KT,
    stretching_modulus=4000.0 * KT,
    bending_model="kratky-porod",
    torsional_rigidity=100.0 * KT,
)
DNA = replace(ROD, name="DNA", bending_rigidity=50.0 * KT)
STIFFNESS = ROD.twist_stiffness
PITCH = 3.57
PER_LENGTH = 2.0 * np.pi / PITCH
NANOSECOND, MICROSECOND = 1e3, 1e6
# It does not turn, in the time of these tests.
HELD = 1e14
START = 100.0
FREE = Hand(binding_rate=0.0, reach=5.0, unbinding_rate=0.0)


def axial_friction(kind):
    return kind.axial_friction(VISCOSITY)


def polymerase(friction=HELD, speed=0.0, pitch=PITCH, stall_torque=None, torque_range=50.0, **others):
    helix = HandOnHelix(pitch=pitch, rotational_friction=friction, stall_torque=stall_torque, torque_range=torque_range)
    hand = replace(FREE, speed=speed, helix=helix, **others)
    return Crosslinker(hands=[hand, FREE], stiffness=1.0)


def in_context(step, kind, temperature=0.0, held=True, stop=None, places=(START,), rod=ROD, ring=False, seed=1):
    """A Context of a rod along z with hands on it, and a FilamentsInContext."""
    filaments = Filaments(viscosity=VISCOSITY, temperature=temperature)
    if ring:
        filaments.add_ring(rod, COUNT, [0, 0, 0])
    else:
        ends = [0, 1, COUNT - 1, COUNT] if held else [0, 1]
        filaments.add_straight(rod, COUNT, [0, 0, 0], [0, 0, 1], clamped=ends)
    for end in ("minus", "plus") if held and not ring else ():
        filaments.add_end_frame(0, end, [0, 0, 1])
    where = [(0, place) for place in places]
    filaments.add_linkers(kind, count=len(where), bound=len(where), volume=1e6, places=where)
    if stop is not None:
        filaments.add_barrier(0, stop, toward="both", release_rate=0.0)
    _, system, positions = filaments.build()
    with warnings.catch_warnings():
        # Of bends, which hardly matter here.
        for own in (TimeStepWarning, SegmentLengthWarning):
            warnings.simplefilter("ignore", own)
        integrator = filaments.create_integrator(system, step, random_seed=seed)
    context = new_context(system, positions, integrator, "CPU")
    return context, filaments.in_context(context)


def torques_of(own):
    """Of all joints, those to the frames of ends among them."""
    twists = own.twists(0)._value
    stiffness = np.full(len(twists), STIFFNESS)
    stiffness[[0, -1]] *= 2.0
    return stiffness * twists


def place_of(own):
    return float(own.linkers().arc_lengths[0, 0])


def torques_of_turned_rod(place, angle, held=True):
    """Torques of joints of a rod whose frame at a place is turned by an angle, from a solution of its equations."""
    stiffness = np.full(COUNT + 1, STIFFNESS)
    stiffness[[0, -1]] *= 2.0 if held else 0.0
    matrix = np.diag(stiffness[:-1] + stiffness[1:]) - np.diag(stiffness[1:-1], 1) - np.diag(stiffness[1:-1], -1)
    middle = place / LENGTH - 0.5
    weights = np.zeros(COUNT)
    weights[int(middle)], weights[int(middle) + 1] = 1.0 - middle % 1.0, middle % 1.0
    turned = np.linalg.solve(matrix, weights)
    turned *= angle / (weights @ turned)
    return stiffness * np.diff(np.concatenate([[0.0], turned, [0.0]]))


@pytest.mark.parametrize("pitch, speed", [(PITCH, 1.0), (PITCH, -1.0), (-PITCH, 1.0)])
def test_filaments_are_overwound_ahead_and_underwound_behind(pitch, speed):
    # Three turns and a half, to a place between two middles of segments.
    walked = 3.5 * PITCH * speed
    kind = polymerase(pitch=pitch, speed=speed * 0.01 / NANOSECOND)
    context, own = in_context(10 * NANOSECOND, kind, stop=START + walked)
    context.getIntegrator().step(400)
    assert place_of(own) == pytest.approx(START + walked)
    found = torques_of(own)
    angle = -2.0 * np.pi / pitch * walked
    assert found == pytest.approx(torques_of_turned_rod(START + walked, angle), rel=3e-5)
    # As a continuous rod has them; the hand holds an element of it at most.
    behind, ahead = START + walked, COUNT * LENGTH - START - walked
    assert found[0] == pytest.approx(angle * STIFFNESS * LENGTH / behind, rel=0.01)
    assert found[-1] == pytest.approx(-angle * STIFFNESS * LENGTH / ahead, rel=0.01)
    assert abs(own.twists(0)._value.sum()) < 1e-10


@pytest.mark.parametrize("step", [100 * NANOSECOND, 10 * NANOSECOND, NANOSECOND])
def test_turns_of_walking_do_not_depend_on_the_step(step):
    # It walks on: torques follow within a relaxation time of the rod, of 0.05 us.
    context, own = in_context(step, polymerase(speed=0.002 / NANOSECOND))
    context.getIntegrator().step(round(5 * MICROSECOND / step))
    expected = torques_of_turned_rod(START + 10.0, -10.0 * PER_LENGTH)
    # The mean of all joints on either side is without the lag, to first order.
    found = torques_of(own)
    assert found[:20].mean() == pytest.approx(expected[:20].mean(), rel=0.01)
    assert found[25:].mean() == pytest.approx(expected[25:].mean(), rel=0.01)


def test_a_hand_with_friction_turns_as_a_free_filament_lets_it():
    # Z (w + W) + sum of friction w = 0, with the turns w of the rod, and W of the hand against it.
    total = COUNT * axial_friction(ROD)
    speed = 1e-4 / NANOSECOND
    for friction in (0.1 * total, total, 30.0 * total):
        kind = polymerase(friction=friction, speed=speed)
        context, own = in_context(NANOSECOND, kind, held=False, places=(START - 2.5,))
        context.getIntegrator().step(1000)
        before = own.twists(0)._value[[0, -1]]
        context.getIntegrator().step(1000)
        turned = own.twists(0)._value[[0, -1]] - before
        expected = -PER_LENGTH * speed * MICROSECOND * friction / (friction + total)
        assert turned == pytest.approx([expected, -expected], rel=1e-3)


@pytest.mark.parametrize("step", [NANOSECOND, 0.1 * NANOSECOND, 0.01 * NANOSECOND])
def test_twist_relaxes_through_a_hand_as_it_should(step):
    # The slowest mode of the friction of segments and the hand, between frames that are held.
    friction = 20.0 * axial_friction(ROD)
    context, own = in_context(step, polymerase(friction=friction))
    matrix = STIFFNESS * (2.0 * np.eye(COUNT) - np.eye(COUNT, k=1) - np.eye(COUNT, k=-1))
    matrix[[0, -1], [0, -1]] += STIFFNESS
    # Between two segments, to both of which it belongs by half.
    resistance = axial_friction(ROD) * np.eye(COUNT)
    resistance[19:21, 19:21] += 0.25 * friction
    rates, modes = np.linalg.eig(np.linalg.solve(resistance, matrix))
    slowest = np.argmin(rates.real)
    rate, mode = rates.real[slowest], modes[:, slowest].real
    twists = 1e-3 * np.diff(np.concatenate([[0.0], mode, [0.0]]))
    own.set_twists(0, twists)
    duration = 1.0 / rate
    count = round(duration / step)
    context.getIntegrator().step(count)
    # Implicit steps of a linear equation, and what they become as they are short.
    share = max(0.5, 1.0 - axial_friction(ROD) / (4.0 * step * STIFFNESS))
    one = (1.0 - (1.0 - share) * rate * step) / (1.0 + share * rate * step)
    found = own.twists(0)._value
    inner = slice(1, -1)
    assert found[inner] == pytest.approx(twists[inner] * one**count, rel=1e-3, abs=1e-9)
    if step < 0.1 * NANOSECOND:
        assert found[inner] == pytest.approx(twists[inner] * np.exp(-rate * step * count), rel=0.01, abs=1e-9)


@pytest.mark.parametrize("step", [100 * NANOSECOND, 10 * NANOSECOND])
def test_a_torque_stops_a_hand(step):
    # dx/dt = v (1 - w K x/T), where twist keeps up: K = C (1/L_1 + 1/L_2).
    stall = 11.0 * 0.602214
    speed = 1e-4 / NANOSECOND
    kind = polymerase(speed=speed, stall_torque=stall, torque_range=50.0)
    context, own = in_context(step, kind)
    slope = np.diff(torques_of_turned_rod(START, 1.0)[[-1, 0]])[0] * PER_LENGTH
    for duration in (5 * MICROSECOND, 15 * MICROSECOND, 100 * MICROSECOND):
        before = context.getStepCount() * step
        context.getIntegrator().step(round((duration - before) / step))
        expected = stall / slope * (1.0 - np.exp(-speed * slope * duration / stall))
        assert place_of(own) - START == pytest.approx(expected, rel=0.015)
    assert np.diff(torques_of(own)[[0, -1]]) == pytest.approx(stall, rel=1e-3)


def test_the_recommended_step_knows_what_a_hand_winds():
    speed, stall = 1.0 / NANOSECOND, 11.0 * 0.602214
    filaments = Filaments(viscosity=VISCOSITY, temperature=0.0)
    filaments.add_straight(ROD, COUNT, [0, 0, 0], [0, 0, 1])
    kind = polymerase(speed=speed, stall_torque=stall, torque_range=50.0)
    filaments.add_linkers(kind, count=1, volume=1e6)
    _, system, _ = filaments.build()
    allowed = filaments.recommended_time_step(scheme="implicit", system=system).allowed
    found = [step for what, step in allowed.items() if "what a hand winds in a step slows it down" in what]
    assert found == [pytest.approx(0.2 * PITCH * 50.0 * stall / (4.0 * np.pi * ROD.torsional_rigidity * speed))]


def test_a_hand_is_stopped_at_the_mean_torque():
    # With thermal torques: it walks to and fro there.
    stall = 4.0 * KT
    kind = polymerase(speed=0.01 / NANOSECOND, stall_torque=stall, torque_range=50.0, walks_backward=True)
    context, own = in_context(20 * NANOSECOND, kind, temperature=TEMPERATURE)
    context.getIntegrator().step(1000)
    found = []
    for _ in range(4000):
        context.getIntegrator().step(5)
        torques = torques_of(own)
        found.append(torques[25:-1].mean() - torques[1:16].mean())
    blocks = np.array(found).reshape(20, -1).mean(axis=1)
    error = blocks.std(ddof=1) / np.sqrt(len(blocks))
    assert SIGMAS * error < 0.05 * stall
    assert abs(blocks.mean() - stall) < SIGMAS * error


@pytest.mark.parametrize("step", [10 * NANOSECOND, NANOSECOND, 0.1 * NANOSECOND])
def test_hands_leave_the_equilibrium_of_twist(step):
    # Two hands at one pair of segments, and one elsewhere; ends are free: joints are independent.
    friction = 5.0 * axial_friction(ROD)
    places = (START, START + 1.0, 61.0)
    context, own = in_context(step, polymerase(friction=friction), TEMPERATURE, held=False, places=places)
    rng = np.random.default_rng(5)
    start = np.concatenate([[0.0], rng.normal(0.0, np.sqrt(KT / STIFFNESS), COUNT - 1), [0.0]])
    own.set_twists(0, start)
    found = []
    for _ in range(4000):
        context.getIntegrator().step(max(1, round(2 * NANOSECOND / step)))
        found.append(own.twists(0)._value[1:-1])
    squares = np.array(found) ** 2 * STIFFNESS / KT
    # Those between hands and beside them.
    for joints in (slice(19, 20), slice(11, 12), slice(8, 24), slice(None)):
        blocks = squares[:, joints].mean(axis=1).reshape(20, -1).mean(axis=1)
        error = blocks.std(ddof=1) / np.sqrt(len(blocks))
        assert SIGMAS * error < (0.05 if joints == slice(None) else 0.35)
        assert abs(blocks.mean() - 1.0) < SIGMAS * error


@pytest.mark.parametrize("step", [20 * NANOSECOND, 2 * NANOSECOND])
def test_hands_diffuse_about_a_filament(step):
    # With the whole friction of the rod and of the hand.
    total, friction = COUNT * axial_friction(ROD), 60.0 * axial_friction(ROD)
    context, own = in_context(step, polymerase(friction=friction), TEMPERATURE, held=False)
    found = []
    for _ in range(4000):
        context.getIntegrator().step(1)
        # The mean turn of all segments and of the hand, by their friction, moves freely.
        turned = np.cumsum(own.twists(0)._value[:-1])
        found.append((turned.sum() * axial_friction(ROD) + 0.5 * friction * turned[19:21].sum()) / (total + friction))
    squares = np.diff(found) ** 2 * (total + friction) / (2.0 * KT * step)
    error = squares.std(ddof=1) / np.sqrt(len(squares))
    assert SIGMAS * error < 0.1
    assert abs(squares.mean() - 1.0) < SIGMAS * error


def test_linking_numbers_of_rings_are_kept():
    kind = polymerase(friction=30.0 * axial_friction(DNA), speed=0.01 / NANOSECOND)
    context, own = in_context(5 * NANOSECOND, kind, TEMPERATURE, rod=DNA, ring=True)
    for _ in range(20):
        context.getIntegrator().step(100)
        points = positions_of(context)
        writhe = analysis.writhe(points, closed=True)
        assert abs(own.twists(0)._value.sum() / (2.0 * np.pi) + writhe) < 1e-10


def test_all_places_of_a_ring_are_alike():
    found = []
    for place in (50.0, 190.0):
        kind = polymerase(friction=300.0 * axial_friction(ROD), speed=0.01 / NANOSECOND)
        context, own = in_context(NANOSECOND, kind, places=(place,), rod=ROD, ring=True)
        context.getIntegrator().step(2000)
        assert place_of(own) == pytest.approx((place + 20.0) % (COUNT * LENGTH))
        found.append(own.twists(0)._value)
    assert np.abs(found[0]).max() > 0.1
    assert np.roll(found[0], 28) == pytest.approx(found[1], rel=1e-6, abs=1e-9)


def test_a_strong_hand_does_not_hamper_long_steps():
    # Bends of DNA under a pull, one part wound up and the other one not: the same equations, solved by as many steps.
    divided = []
    for friction in (0.0, HELD):
        filaments = Filaments(viscosity=VISCOSITY, temperature=TEMPERATURE)
        filaments.add_straight(DNA, COUNT, [0, 0, 0], [0, 0, 1], clamped=[0, 1])
        filaments.add_end_frame(0, "minus", [0, 0, 1])
        filaments.add_linkers(polymerase(friction=friction), count=1, bound=1, volume=1e6, places=[(0, START)])
        _, system, positions = filaments.build()
        integrator = filaments.create_integrator(system, MICROSECOND, random_seed=2, checks=False)
        context = new_context(system, positions, integrator, "CPU")
        own = filaments.in_context(context)
        wound = np.zeros(COUNT + 1)
        wound[:20] = np.pi / 20.0
        own.set_twists(0, wound)
        integrator.step(1000)
        divided.append(integrator.getNumDividedSteps())
    assert divided[1] <= divided[0] + 3


def test_checkpoints_go_on_alike():
    kind = polymerase(friction=10.0 * axial_friction(DNA), speed=0.01 / NANOSECOND, stall_torque=5.0)
    context, own = in_context(NANOSECOND, kind, TEMPERATURE, rod=DNA)
    context.getIntegrator().step(50)
    checkpoint = context.createCheckpoint()
    context.getIntegrator().step(50)
    expected = own.twists(0)._value, positions_of(context), place_of(own)
    context.loadCheckpoint(checkpoint)
    context.getIntegrator().step(50)
    for found, before in zip((own.twists(0)._value, positions_of(context), place_of(own)), expected):
        np.testing.assert_array_equal(found, before)


def test_forces_keep_how_hands_follow_a_helix():
    helix = HandOnHelix(
        pitch=-3.57 * unit.nanometer,
        rotational_friction=1.0 * unit.piconewton * unit.nanometer * unit.second,
        stall_torque=11.0 * unit.piconewton * unit.nanometer,
    )
    kind = Crosslinker(hands=replace(FREE, speed=1.0, helix=helix), stiffness=1.0)
    context, _ = in_context(NANOSECOND, kind)
    text = openmm.XmlSerializer.serialize(context.getSystem())
    system = openmm.XmlSerializer.deserialize(text)
    assert openmm.XmlSerializer.serialize(system) == text
    expected = [-3.57, 0.602214e12, 11.0 * 0.602214, 100.0]
    assert find_binding_force(system).getHandOnHelix(0) == pytest.approx(expected, rel=1e-5)


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"pitch": 0.0}, "pitch must not be zero"),
        ({"rotational_friction": -1.0}, "rotational_friction"),
        ({"stall_torque": 0.0}, "stall_torque"),
        ({"torque_range": 0.0}, "torque_range"),
    ],
)
def test_bad_helices_are_refused(changed, message):
    with pytest.raises(InputError, match=message):
        replace(HandOnHelix(pitch=PITCH, rotational_friction=1.0), **changed)


def test_hands_that_cannot_follow_a_helix_are_refused():
    helix = HandOnHelix(pitch=PITCH, rotational_friction=1.0)
    for others in ({"site_spacing": 8.0, "speed": 1.0}, {"sliding_friction": 1.0}, {"speed": 1.0, "helix": "right"}):
        with pytest.raises(InputError, match="helix"):
            replace(FREE, **{"helix": helix, **others})
    with pytest.raises(InputError, match="filament 0 .rod., which has no twist"):
        in_context(NANOSECOND, polymerase(), held=False, rod=replace(ROD, torsional_rigidity=None))
