"""Frames at ends of filaments that rigid bodies carry: both turn as they must, and are in equilibrium."""

import numpy as np
import openmm
import pytest
from openmm import unit
from scipy.linalg import expm
from scipy.spatial.transform import Rotation

from openmm_cylchain import (
    Body,
    Crosslinks,
    Filaments,
    InputError,
    InstabilityError,
    RestBends,
    capsule_contact_force,
)
from openmm_cylchain.engines.compiled import CylinderChainForce
from support.contexts import new_context, positions_of
from support.platforms import ON_COMPILED_PLATFORMS
from support.solvent import KT, TEMPERATURE, VISCOSITY
from support.twisted_chains import DNA, LENGTH, SIGMAS, in_context, mean_and_error, rates_of_turns

SEGMENTS = 8
END = SEGMENTS * LENGTH
RADIUS = 10.0
FRICTION = float(Body.sphere(RADIUS).rotational_friction(VISCOSITY)[0, 0])
BY_ITSELF = FRICTION / (2.0 * DNA.twist_stiffness)
"""The time in which the joint to its frame alone would turn a body: 0.25 us."""
POINTS = RADIUS * np.eye(3)
ORIENTATION = np.array([[0.36, 0.48, -0.8], [-0.8, 0.6, 0.0], [0.48, 0.64, 0.6]])


def straight_chain_between_bodies(ends, orientation=None, planar=False):
    """One along z that is at rest, with a body at each of some ends, and its frame held at the other one."""
    filaments = Filaments(VISCOSITY, 0.0)
    for end in ends:
        centre = [0, 0, END if end == "plus" else 0]
        filaments.add_body(Body.sphere(RADIUS, POINTS), centre, orientation, planar=planar)
    filaments.add_straight(DNA, SEGMENTS, [0, 0, 0], [0, 0, 1], clamped=range(1, SEGMENTS))
    for end in ("minus", "plus"):
        filaments.add_end_frame(0, end, [0, 0, 1], body=ends.index(end) if end in ends else None)
    return filaments


def turned_about_z(before, after):
    """The angle by which a body has turned, from the positions of its particles."""
    arms = [(positions[1:3] - positions[0])[:, :2] for positions in (before, after)]
    across = arms[0][:, 0] * arms[1][:, 1] - arms[0][:, 1] * arms[1][:, 0]
    return np.arctan2(across.sum(), np.sum(arms[0] * arms[1]))


@ON_COMPILED_PLATFORMS
@pytest.mark.parametrize("share", [0.005, 2.0])
@pytest.mark.parametrize("ends", [("plus",), ("minus",), ("minus", "plus")])
def test_bodies_turn_back_as_they_must(ends, share, platform):
    """As in the solution of the linear equations of a straight chain, from a turn in its joints; bodies against it.

    In steps that are longer than those in which its joint would turn a body by itself, too, which are divided.
    """
    planar, steps = platform.name == "CPU", max(4, round(0.2 / share))
    filaments = straight_chain_between_bodies(ends, None if planar else ORIENTATION, planar)
    context, own = in_context(filaments, share * BY_ITSELF, platform=platform)
    rates = rates_of_turns(SEGMENTS, *(FRICTION if end in ends else None for end in ("minus", "plus")))
    twists = np.full(SEGMENTS + 1, 0.1)
    twists[[0, -1]] = 0.05
    own.set_twists(0, twists)
    angles = np.append(0.0, np.cumsum(twists))
    turns = expm(-rates * steps * share * BY_ITSELF) @ angles
    before = positions_of(context)
    context.getIntegrator().step(steps)
    # A body turns when its chain has.
    assert own.twists(0)._value == pytest.approx(np.diff(turns), rel=0.01 if share < 1.0 else 0.1)
    after = positions_of(context)
    for particles, number in zip(filaments.body_indices, [0 if end == "minus" else -1 for end in ends]):
        turned = turned_about_z(before[particles], after[particles])
        assert turned == pytest.approx((turns - angles)[number], rel=0.01)
    assert (context.getIntegrator().getNumDividedSteps() > 0) == (share > 1.0)


def test_motor_on_a_body_turns_filament_and_body_against_each_other():
    """As the frictions of both let it."""
    filaments = Filaments(VISCOSITY, 0.0)
    filaments.add_body(Body.sphere(RADIUS, POINTS), [0, 0, 0], ORIENTATION)
    filaments.add_straight(DNA, SEGMENTS, [0, 0, 0], [0, 0, 1], clamped=range(SEGMENTS))
    speed = 1e-3 * unit.radian / unit.nanosecond
    filaments.add_end_frame(0, "minus", [0, 0, 1], angular_velocity=speed, body=0)
    context, own = in_context(filaments, 1e3)
    context.getIntegrator().step(100)
    before = positions_of(context)[filaments.body_indices[0]]
    context.getIntegrator().step(1000)
    after = positions_of(context)[filaments.body_indices[0]]
    friction = SEGMENTS * DNA.axial_friction(VISCOSITY)
    assert abs(turned_about_z(before, after)) == pytest.approx(friction / (friction + FRICTION), rel=0.01)
    torque = 2.0 * DNA.twist_stiffness * abs(own.twists(0)._value[0])
    assert torque == pytest.approx(1e-6 * friction * FRICTION / (friction + FRICTION), rel=0.01)


def test_bodies_that_are_far_too_small_are_named():
    filaments = Filaments(VISCOSITY, TEMPERATURE)
    filaments.add_body(Body.sphere(1.0), [0, 0, END])
    filaments.add_straight(DNA, SEGMENTS, [0, 0, 0], [0, 0, 1], clamped=range(SEGMENTS))
    filaments.add_end_frame(0, "plus", [0, 0, 1], body=0)
    context, _ = in_context(filaments, 0.2 * BY_ITSELF)
    with pytest.raises(InstabilityError, match=r"twist of Filament 0 .* would turn body 0.* shorter step"):
        context.getIntegrator().step(1)


def gap_under_pressure(radius, step):
    """Of a chain that is pressed on another for 60 ns, whose end carries a body, and whether that divides steps."""
    filaments = Filaments(VISCOSITY, 0.0)
    filaments.add_body(Body.sphere(radius), [0, 0, END + radius])
    filaments.add_straight(DNA, SEGMENTS, [0, 0, 0], [0, 0, 1])
    filaments.add_straight(DNA, SEGMENTS, [3, 0, 0], [0, 0, 1], clamped=range(SEGMENTS))
    filaments.add_end_frame(0, "plus", [0, 0, 1], body=0)
    _, system, positions = filaments.build()
    press = openmm.CustomExternalForce("-x+20*y^2+20*(z-z0)^2")
    press.addPerParticleParameter("z0")
    for number, node in enumerate(filaments.node_indices[0]):
        press.addParticle(int(node), [number * LENGTH])
    system.addForce(press)
    system.addForce(capsule_contact_force(filaments, system, 2.0, stiffness=5.0))
    integrator = filaments.create_integrator(system, step, checks=False)
    context = new_context(system, positions, integrator, "CPU")
    integrator.step(round(60e3 / step))
    gap = 3.0 - positions_of(context)[filaments.node_indices[0]][1:-1, 0].mean()
    return gap, integrator.getNumDividedSteps() > 0


@pytest.mark.parametrize(("share", "parts"), [(0.15, 2), (0.3, 4), (0.6, 8)])
def test_contacts_are_as_in_shorter_steps_where_bodies_need_these(share, parts):
    """They are soft: hard ones, as where the equations of a step are not solved, would leave 0.01 nm more."""
    step, small = 200.0, RADIUS * (200.0 / share / BY_ITSELF) ** (1 / 3)
    gap, is_divided = gap_under_pressure(small, step)
    expected, others = gap_under_pressure(RADIUS, step / parts)
    assert is_divided and not others
    assert gap == pytest.approx(expected, abs=1e-3)


@pytest.mark.parametrize("share", [0.2, 2.0])
def test_long_bodies_are_looked_at_about_all_axes(share):
    """One that turns about its length a thousand times as easily, which a ninth of the couple of a bent end does."""
    filaments = Filaments(VISCOSITY, 0.0)
    rod = Body([[10.0 * number, 0, 0] for number in range(-20, 21)], 1.0)
    filaments.add_body(rod, [0, 0, 0])
    easy, *_, hard = np.linalg.eigvalsh(rod.rotational_friction(VISCOSITY))
    assert hard > 1e3 * easy
    nodes = np.arange(5)[:, None] * [3.0, 0, 4.0]
    filaments.add_nodes(DNA, nodes, clamped=[0, 1, 2])
    filaments.add_end_frame(0, "minus", [0, 0, 1], body=0)
    context, _ = in_context(filaments, share * easy / (2.0 * DNA.twist_stiffness))
    context.getIntegrator().step(1)
    assert (context.getIntegrator().getNumDividedSteps() > 0) == (share > 1.0)


TURN = 2.0
"""By which chains are wound between bodies that springs hold in their places."""
SPRING = 5.0 * KT / RADIUS**2


def held_bodies(count, end, step):
    """A Context of chains along z, whose segment at one end can bend, and bodies there, each held by four springs."""
    filaments = Filaments(VISCOSITY, TEMPERATURE)
    sign = 1 if end == "plus" else -1
    for number in range(count):
        filaments.add_body(Body.sphere(RADIUS, POINTS), [100.0 * number, 0, END])
        start, clamped = [100.0 * number, 0, 0 if sign > 0 else END], np.arange(SEGMENTS) + (sign < 0)
        filaments.add_straight(DNA, SEGMENTS, start, [0, 0, sign], clamped=clamped.tolist())
        for name in ("minus", "plus"):
            filaments.add_end_frame(number, name, [0, 0, sign], body=number if name == end else None)
    _, system, positions = filaments.build()
    links = Crosslinks(stiffness=SPRING, rest_length=0.0)
    for number, (centre, *places) in enumerate(filaments.body_indices):
        there = np.array([100.0 * number, 0, END])
        links.add(None, int(centre), there, stiffness=100.0 * KT)
        for place, point in zip(places, POINTS):
            links.add(None, int(place), there + point)
    links.add_to(system)
    integrator = filaments.create_integrator(system, step, random_seed=1, checks=False)
    return filaments, new_context(system, positions, integrator, "CPU")


def carried(vectors, before, behind):
    """Vectors that are carried from one direction to another by parallel transport, (n, 3) all of them."""
    axis = np.cross(before, behind)
    once = np.cross(axis, vectors)
    return vectors + once + np.cross(axis, once) / (1.0 + np.sum(before * behind, axis=1))[:, None]


@pytest.fixture(scope="module")
def averages_by_monte_carlo():
    """What test_bodies_are_in_equilibrium() looks at, from Metropolis moves of the directions and of all turns."""
    count, sweeps = 400, 6000
    generator = np.random.default_rng(1)
    bending = 2.0 * DNA.bending_rigidity / LENGTH / KT
    z, x = np.tile([0.0, 0.0, 1.0], (count, 1)), np.tile([1.0, 0.0, 0.0], (count, 1))

    def describe(tangents, rotations, near):
        there = carried(carried(x, z, tangents), tangents, rotations[..., 2])
        sines = np.sum(np.cross(there, rotations[..., 0]) * rotations[..., 2], axis=1)
        angles = np.arctan2(sines, np.sum(there * rotations[..., 0], axis=1)) + TURN
        twists = angles + 2.0 * np.pi * np.round((near - angles) / (2.0 * np.pi))
        energies = bending * (1.0 - tangents[:, 2]) + 0.5 * DNA.torsional_rigidity / KT / END * twists**2
        energies += SPRING * RADIUS**2 / KT * (3.0 - np.trace(rotations, axis1=1, axis2=2))
        return twists, energies

    tangents, rotations = z, np.tile(np.eye(3), (count, 1, 1))
    twists, energies = describe(tangents, rotations, np.full(count, TURN))
    samples = []
    for sweep in range(sweeps):
        of_body = generator.random(count) < 0.5
        vectors = np.where(of_body[:, None], generator.normal(0.0, 0.25, (count, 3)), 0.0)
        others = tangents + np.where(of_body[:, None], 0.0, generator.normal(0.0, 0.2, (count, 3)))
        others /= np.linalg.norm(others, axis=1)[:, None]
        turned = Rotation.from_rotvec(vectors).as_matrix() @ rotations
        new = describe(others, turned, twists)
        taken = generator.random(count) < np.exp(np.minimum(0.0, energies - new[1]))
        tangents = np.where(taken[:, None], others, tangents)
        rotations = np.where(taken[:, None, None], turned, rotations)
        twists, energies = (np.where(taken, one, other) for one, other in zip(new, (twists, energies)))
        if sweep > 500 and sweep % 4 == 0:
            share = 0.5 / SEGMENTS
            at_body = (share * twists) ** 2 + 0.5 * KT / DNA.twist_stiffness * (1.0 - share)
            samples.append(what_is_looked_at(tangents, rotations, twists, at_body))
    return [mean_and_error(values) for values in np.moveaxis(samples, 1, 0)]


def what_is_looked_at(tangents, rotations, twists, at_body):
    """Of the square of the twist at the body, too, over that of the joint there by itself."""
    between = np.sum(tangents * rotations[..., 2], axis=1)
    of_body = rotations[:, 2, 2], rotations[:, 0, 0], rotations[:, 1, 0]
    return tangents[:, 2], *of_body, between, twists, twists**2, at_body * 2.0 * DNA.twist_stiffness / KT


@pytest.mark.slow
@pytest.mark.parametrize(("end", "share"), [("plus", 0.05), ("minus", 0.1), ("plus", 2.0)])
def test_bodies_are_in_equilibrium(averages_by_monte_carlo, end, share):
    """How they and the segments that they hold are turned, under a torque of 4 k_B T, up to the recommended step.

    And in one that is 40 times as long, and is divided.
    """
    count, interval = 64, 2 * BY_ITSELF
    filaments, context = held_bodies(count, end, share * BY_ITSELF)
    own = filaments.in_context(context)
    twists = np.full(SEGMENTS + 1, TURN / SEGMENTS)
    twists[[0, -1]] /= 2
    for number in range(count):
        own.set_twists(number, twists)
    steps = max(1, round(interval / share / BY_ITSELF))
    context.getIntegrator().step(20 * steps)
    nodes, bodies = np.array(filaments.node_indices), np.array(filaments.body_indices)
    last = nodes[:, [-2, -1]] if end == "plus" else nodes[:, [1, 0]]
    samples = []
    for _ in range(600):
        context.getIntegrator().step(steps)
        positions = positions_of(context)
        tangents = positions[last[:, 1]] - positions[last[:, 0]]
        tangents /= np.linalg.norm(tangents, axis=1)[:, None]
        rotations = np.moveaxis(positions[bodies[:, 1:]] - positions[bodies[:, :1]], 1, 2) / RADIUS
        turned = np.array([own.twists(number)._value for number in range(count)])
        at_body = turned[:, -1 if end == "plus" else 0] ** 2
        samples.append(what_is_looked_at(tangents, rotations, turned.sum(axis=1), at_body))
    for values, (exact, its_error) in zip(np.moveaxis(samples, 1, 0), averages_by_monte_carlo):
        mean, error = mean_and_error(values)
        error = np.hypot(error, its_error)
        assert SIGMAS * error < 0.03 * max(1.0, exact)
        assert mean == pytest.approx(exact, abs=SIGMAS * error + 0.002)


def test_frame_on_a_body_survives_xml_and_checkpoints():
    filaments = straight_chain_between_bodies(("minus", "plus"), ORIENTATION)
    _, system, positions = filaments.build()
    copy = openmm.XmlSerializer.deserialize(openmm.XmlSerializer.serialize(system))
    forces = [CylinderChainForce.cast(own) for own in copy.getForces() if CylinderChainForce.isinstance(own)]
    assert [forces[0].getEndFrameBody(0, end) for end in (0, 1)] == [0, 1]
    direction = forces[0].getEndFrame(0, 1)[0]
    assert list(direction) == pytest.approx(ORIENTATION.T @ [0, 0, 1])
    integrator = filaments.create_integrator(copy, 1e3, random_seed=1, temperature=TEMPERATURE)
    context = new_context(copy, positions, integrator, "CPU")
    integrator.step(5)
    checkpoint, ends = context.createCheckpoint(), []
    for _ in range(2):
        context.loadCheckpoint(checkpoint)
        integrator.step(5)
        ends.append((positions_of(context), filaments.in_context(context).twists(0)._value))
    assert np.array_equal(ends[0][0], ends[1][0]) and np.array_equal(ends[0][1], ends[1][1])
    with pytest.raises(InputError, match="a body carries"):
        filaments.in_context(context).linking_number(0)
    forces[0].setEndFrameBody(0, 0, 2)
    with pytest.raises(openmm.OpenMMException, match="body 2 carries, which does not exist"):
        new_context(copy, positions, filaments.create_integrator(copy, 1e3), "CPU")


def test_recommended_step_knows_what_twist_turns():
    filaments = straight_chain_between_bodies(("plus",))
    _, system, _ = filaments.build()
    recommended = filaments.recommended_time_step(system=system, temperature=TEMPERATURE)
    allowed = {reason: step for reason, step in recommended.allowed.items() if "twist turns body 0" in reason}
    assert list(allowed.values()) == pytest.approx([0.05 * BY_ITSELF])


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"body": 1}, "body 1 does not exist"),
        ({"body": -1}, "body"),
        ({"body": "bead"}, "body"),
        ({"body": 0, "torque": KT}, "turns with it"),
        ({"body": 0, "direction": [0, 0.1, -1]}, "against filament 0 at its plus end"),
        ({"body": 0, "rotational_friction": 1.0}, "turns with it"),
    ],
)
def test_bad_frames_are_refused(options, message):
    filaments = Filaments(VISCOSITY, TEMPERATURE)
    filaments.add_body(Body.sphere(RADIUS), [0, 0, 0])
    filaments.add_straight(DNA, 4, [0, 0, 0], [0, 0, 1])
    with pytest.raises(InputError, match=message):
        filaments.add_end_frame(0, "plus", **{"direction": [0, 0, 1], **options})


def test_joints_that_are_bent_at_rest_are_refused():
    filaments = Filaments(VISCOSITY, TEMPERATURE)
    filaments.add_body(Body.sphere(RADIUS), [0, 0, 0])
    filaments.add_straight(DNA, 4, [0, 0, 0], [0, 0, 1], rest_bends=RestBends(0.1))
    with pytest.raises(InputError, match="rest_bends"):
        filaments.add_end_frame(0, "plus", [0, 0, 1], body=0)
