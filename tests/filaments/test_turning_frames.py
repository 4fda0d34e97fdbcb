"""Frames at ends of filaments that turn against a friction, as beads do: their motion and equilibrium at any step."""

import numpy as np
import openmm
import pytest
from openmm import unit
from scipy.linalg import expm

from openmm_cylchain import Filaments, InputError
from openmm_cylchain.engines.compiled import CylinderChainForce
from support.contexts import positions_of
from support.solvent import KT, TEMPERATURE, VISCOSITY
from support.twisted_chains import DNA, SIGMAS, in_context, rates_of_turns

STIFFNESS, FRICTION = DNA.twist_stiffness, DNA.axial_friction(VISCOSITY)
SEGMENTS = 8
BEAD = 20.0 * FRICTION
TORQUE = 2.0 * KT


def chains_with_beads(count, temperature, minus="held", segments=(SEGMENTS,), torque=None, bead=BEAD):
    """Filaments along z with a bead at the plus end and the minus end "held", "free", or at a bead as well."""
    filaments = Filaments(VISCOSITY, temperature)
    for number in range(count):
        own = segments[number % len(segments)]
        filaments.add_straight(DNA, own, [100.0 * number, 0, 0], [0, 0, 1], clamped=[0, 1])
        if minus != "free":
            friction = 3 * bead if minus == "bead" else None
            filaments.add_end_frame(number, "minus", [0, 0, 1], rotational_friction=friction)
        filaments.add_end_frame(number, "plus", [0, 0, 1], torque=torque, rotational_friction=bead)
    return filaments


RATES = rates_of_turns(SEGMENTS, plus=BEAD)
RELAXATION = 1.0 / np.linalg.eigvals(RATES[1:, 1:]).real.min()
"""Of the bead, by the twist of its chain: 0.23 us."""


def test_bead_turns_back_as_it_must():
    """As in the solution of the linear equations of a straight chain, which begins with a turn in its last joint."""
    filaments = chains_with_beads(1, 0.0)
    context, own = in_context(filaments, RELAXATION / 200, pull=0.0)
    twists = np.zeros(SEGMENTS + 1)
    twists[-1] = 0.1
    own.set_twists(0, twists)
    begun = np.append(0.0, np.cumsum(twists))
    for time in (0.5, 1.0, 1.5):
        context.getIntegrator().step(100)
        assert own.twists(0)._value == pytest.approx(np.diff(expm(-RATES * time * RELAXATION) @ begun), rel=0.01)


@pytest.mark.parametrize("step", [1e2, 1e4, 1e6])
def test_torque_on_a_bead_turns_it_and_its_chain_with_a_free_end(step):
    """In the end, all turns alike, and each joint has the torque that turns what is behind it."""
    filaments = chains_with_beads(1, 0.0, minus="free", torque=TORQUE)
    context, own = in_context(filaments, step, pull=0.0)
    speed = TORQUE / (BEAD + SEGMENTS * FRICTION)
    context.getIntegrator().step(round(max(10, 20 * RELAXATION / step)))
    before = own.twists(0)._value
    context.getIntegrator().step(10)
    after = own.twists(0)._value
    assert (after - before)[0] == pytest.approx(10 * step * speed, rel=1e-6)
    torques = np.append(np.full(SEGMENTS - 1, STIFFNESS), 2 * STIFFNESS) * after[1:]
    assert torques == pytest.approx(speed * FRICTION * np.arange(1, SEGMENTS + 1), rel=1e-6)


def test_bead_on_a_chain_with_a_free_end_diffuses():
    """With the friction of all, over times in which the chain follows it."""
    filaments = chains_with_beads(64, TEMPERATURE, minus="free")
    step = RELAXATION
    context, own = in_context(filaments, step, pull=1e3 * KT)
    turned = []
    for _ in range(101):
        turned.append([own.twists(number)._value.sum() for number in range(64)])
        context.getIntegrator().step(10)
    squares = np.diff(turned, axis=0) ** 2
    exact = 2 * KT / (BEAD + SEGMENTS * FRICTION) * 10 * step
    error = squares.mean(axis=0).std(ddof=1) / 8
    assert SIGMAS * error < 0.1 * exact
    assert squares.mean() == pytest.approx(exact, abs=SIGMAS * error)


@pytest.mark.parametrize("minus", ["held", "bead"])
@pytest.mark.parametrize("step", [0.05 * RELAXATION, RELAXATION, 100 * RELAXATION])
def test_twist_is_in_equilibrium(step, minus):
    """Each joint has k_B T, and all of them together as much: what a bead turns by is no constraint."""
    filaments = chains_with_beads(64, TEMPERATURE, minus)
    context, own = in_context(filaments, step, pull=2.0 * KT)
    variances = KT / STIFFNESS / np.array([2.0, *[1.0] * (SEGMENTS - 1), 2.0])
    generator = np.random.default_rng(1)
    for number in range(64):
        own.set_twists(number, generator.normal(0.0, np.sqrt(variances)))
    context.getIntegrator().step(10)
    samples = []
    for _ in range(320):
        context.getIntegrator().step(max(1, round(RELAXATION / step)))
        samples.append([own.twists(number)._value for number in range(64)])
    squares = np.array(samples) ** 2 / variances
    whole = np.sum(samples, axis=2) ** 2 / variances.sum()
    for values in (squares.mean(axis=2), whole, squares[..., -1], squares[..., 0]):
        mean, error = values.mean(), values.mean(axis=0).std(ddof=1) / 8
        assert SIGMAS * error < 0.06
        assert mean == pytest.approx(1.0, abs=SIGMAS * error)


def test_beads_of_chains_of_other_lengths_share_lanes():
    """Of the processor's registers: each turns as beside chains that are too short for them."""

    def after_steps(lengths):
        filaments = chains_with_beads(len(lengths), TEMPERATURE, "bead", lengths, torque=TORQUE)
        context, own = in_context(filaments, 10 * RELAXATION, pull=KT)
        context.getIntegrator().step(6)
        return [own.twists(number)._value for number in range(len(lengths))]

    lengths = np.array([20, 19, 18])
    together = after_steps(lengths)
    for number, twists in enumerate(together):
        alone = after_steps(np.where(np.arange(3) == number, lengths, 4))[number]
        assert twists == pytest.approx(alone, abs=1e-9)


@pytest.mark.parametrize("platform", ["Reference", "CPU"])
def test_bead_turns_alike_where_filaments_may_touch(platform):
    """Their steps are solved together then, and divided together: here, none touches another."""
    ends = []
    for contacts in (False, True):
        filaments = chains_with_beads(3, TEMPERATURE, "bead", torque=TORQUE)
        context, own = in_context(filaments, RELAXATION, 2.0 * KT, platform=platform, contacts=contacts)
        context.getIntegrator().step(6)
        ends.append([own.twists(number)._value for number in range(3)])
    assert np.array(ends[0]) == pytest.approx(np.array(ends[1]), abs=1e-3)


def test_beads_are_given_with_units_and_survive_xml():
    filaments = chains_with_beads(1, TEMPERATURE, "bead", torque=TORQUE)
    assert filaments.end_frames[0].rotational_friction == pytest.approx(3 * BEAD)
    assert not any(own.is_held for own in filaments.end_frames)
    filaments.add_straight(DNA, 4, [50, 0, 0], [0, 0, 1])
    friction = 1e-6 * unit.piconewton * unit.nanometer * unit.second
    filaments.add_end_frame(1, "plus", [0, 0, 1], rotational_friction=friction)
    assert filaments.end_frames[2].rotational_friction == pytest.approx(0.602214076 * 1e6)
    _, system, _ = filaments.build()
    copy = openmm.XmlSerializer.deserialize(openmm.XmlSerializer.serialize(system))
    frames = [
        str(CylinderChainForce.cast(own).getEndFrame(chain, end))
        for one in (system, copy)
        for own in one.getForces()
        if CylinderChainForce.isinstance(own)
        for chain in (0, 1)
        for end in (0, 1)
    ]
    assert frames[:4] == frames[4:] and str(BEAD)[:8] in frames[1]
    _, own = in_context(chains_with_beads(1, TEMPERATURE), 1e3, pull=0.0)
    with pytest.raises(InputError, match="no frame that is held"):
        own.turn_end(0, "plus", 0.1)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"rotational_friction": 0.0}, "rotational_friction"),
        ({"rotational_friction": -1.0}, "rotational_friction"),
        ({"rotational_friction": np.nan}, "rotational_friction"),
        ({"rotational_friction": 1.0 * unit.nanometer}, "rotational_friction"),
        ({"rotational_friction": 1.0, "angular_velocity": 1.0}, "angular_velocity"),
    ],
)
def test_bad_beads_are_refused(options, message):
    filaments = Filaments(VISCOSITY, TEMPERATURE)
    filaments.add_straight(DNA, 4, [0, 0, 0], [0, 0, 1])
    with pytest.raises(InputError, match=message):
        filaments.add_end_frame(0, "plus", [0, 0, 1], **options)


def test_run_goes_on_to_the_bit():
    filaments = chains_with_beads(3, TEMPERATURE, "bead", torque=TORQUE)
    context, own = in_context(filaments, RELAXATION, pull=KT)
    context.getIntegrator().step(5)
    checkpoint = context.createCheckpoint()
    ends = []
    for _ in range(2):
        context.loadCheckpoint(checkpoint)
        context.getIntegrator().step(5)
        ends.append((positions_of(context), own.twists(1)._value))
    assert np.array_equal(ends[0][0], ends[1][0]) and np.array_equal(ends[0][1], ends[1][1])
