"""Filaments whose joints are bent at rest: what they are given, their equilibrium at any step, and how they move."""

from dataclasses import replace

import numpy as np
import openmm
import pytest
from openmm import unit
from scipy.linalg import expm
from scipy.special import iv

from openmm_cylchain import Crosslinks, Filaments, InputError, RestBends, check_time_step
from openmm_cylchain.engines.compiled import CylinderChainForce
from support.bent_joints import BentJoint, drawn_distances, helix_of_joints, material_bends, mean_square_distance
from support.bent_ring_monte_carlo import BentRings, squared_radii
from support.contexts import energy_of, forces_of, new_context, positions_of
from support.solvent import KT, TEMPERATURE, VISCOSITY
from support.twisted_chains import (
    DNA,
    LENGTH,
    NANOSECOND,
    SIGMAS,
    UNTWISTED,
    assert_near,
    in_context,
    mean_square_angle_of_an_end,
    squares_of_end_angles,
)

CIRCLE = replace(DNA, bending_model="inscribed-circle")


def force_of(system):
    return next(CylinderChainForce.cast(own) for own in system.getForces() if CylinderChainForce.isinstance(own))


def chains(kind, bends, count=1, segments=6, temperature=TEMPERATURE):
    filaments = Filaments(VISCOSITY, temperature)
    for number in range(count):
        filaments.add_equilibrium(kind, segments, number, rest_bends=bends)
    return filaments


# What is given


def test_bends_are_given_with_units_for_one_joint_or_each():
    assert RestBends(30 * unit.degree, 90 * unit.degree) == RestBends(np.pi / 6, np.pi / 2)
    bends = RestBends([0.0, 0.4, 0.2], directions=[0.0, 0.0, np.pi / 2])
    sizes = {
        "quadratic": (0.4, 0.2),
        "kratky-porod": 2 * np.sin([0.2, 0.1]),
        "inscribed-circle": 2 * np.tan([0.2, 0.1]),
    }
    for model, (first, second) in sizes.items():
        assert bends.components(model, 3) == pytest.approx(np.array([[0, 0], [first, 0], [0, second]]), abs=1e-15)
    filaments = chains(CIRCLE, bends, segments=4)
    assert filaments[0].rest_bends is bends
    _, system, _ = filaments.build()
    copy = openmm.XmlSerializer.deserialize(openmm.XmlSerializer.serialize(system))
    for one in (system, copy):
        assert force_of(one).getChainRestBends(0) == pytest.approx(bends.components("inscribed-circle", 3).ravel())


@pytest.mark.parametrize(
    ("bends", "kind", "options", "message"),
    [
        (lambda: RestBends(-0.1), DNA, {}, "angles"),
        (lambda: RestBends(np.nan), DNA, {}, "angles"),
        (lambda: RestBends([]), DNA, {}, "angles"),
        (lambda: RestBends(1.0 * unit.nanometer), DNA, {}, "angles"),
        (lambda: RestBends(0.1, [[0.0]]), DNA, {}, "directions"),
        (lambda: RestBends([0.1, 0.1]), DNA, {}, "one of each of 5 joints"),
        (lambda: RestBends(0.1, [0.1] * 4), DNA, {}, "one of each of 5 joints"),
        (lambda: RestBends(1.2), DNA, {}, "too far"),
        (lambda: RestBends(0.1), UNTWISTED, {}, "twist"),
        (lambda: RestBends(0.1), replace(DNA, bending_rigidity=0.0), {}, "bending_rigidity"),
        (lambda: RestBends(0.1), DNA, {"planar": True}, "planar"),
        (lambda: 0.1, DNA, {}, "rest_bends"),
    ],
)
def test_bad_bends_are_refused(bends, kind, options, message):
    with pytest.raises(InputError, match=message):
        Filaments(VISCOSITY, TEMPERATURE).add_straight(kind, 6, [0, 0, 0], [1, 0, 0], rest_bends=bends(), **options)


def test_what_knows_no_bends_at_rest_refuses_them():
    filaments = chains(DNA, RestBends(0.1))
    with pytest.raises(InputError, match="turn its plus end"):
        filaments.add_end_frame(0, "minus", [0, 0, 1], angular_velocity=1e-5)
    with pytest.raises(InputError, match="cannot have a friction"):
        filaments.add_end_frame(0, "plus", [0, 0, 1], rotational_friction=1e5)
    filaments.add_end_frame(0, "minus", [0, 0, 1])
    with pytest.raises(InputError, match="FilamentsInContext.energies"):
        filaments[0].energies(np.array(filaments[0].positions))
    context, own = in_context(filaments, NANOSECOND)
    with pytest.raises(InputError, match="turn its plus end"):
        own.turn_end(0, "minus", 0.1)
    with pytest.raises(openmm.OpenMMException, match="bends at rest"):
        forces_of(context)
    for scheme in ("midpoint", "implicit-second-order"):
        with pytest.raises(InputError, match="twist"):
            filaments.create_integrator(context.getSystem(), NANOSECOND, scheme=scheme)


def test_rings_have_a_twist_for_their_first_frame():
    filaments = Filaments(VISCOSITY, TEMPERATURE)
    filaments.add_ring(DNA, 12, [0, 0, 0], rest_bends=RestBends(2 * np.pi / 12))
    context, own = in_context(filaments, NANOSECOND)
    assert own.twists(0)._value.shape == (13,)
    # Turned about its axis, the material is at rest once in a turn, and bent the wrong way half a turn on.
    energies = []
    for angle in np.linspace(0.0, 2 * np.pi, 9):
        own.set_twists(0, [0.0] * 12 + [angle])
        energies.append(own.energies(0)[1]._value)
        assert own.linking_number(0) == pytest.approx(0.0, abs=1e-10)
    energies = np.array(energies)
    assert energies.std(axis=1) == pytest.approx(0.0, abs=1e-9)
    size = 4 * np.sin(np.pi / 12) ** 2 * DNA.joint_stiffness
    phase = np.angle(np.exp(1j * np.linspace(0.0, 2 * np.pi, 9))[:-1] @ energies[:-1, 0])
    expected = size * (1 + np.cos(np.linspace(0.0, 2 * np.pi, 9) - phase))
    assert energies[:, 0] == pytest.approx(expected, abs=1e-9 * size)


# Energies, state


def test_energy_of_a_context_is_that_of_bends_in_the_frames():
    filaments = chains(CIRCLE, RestBends(0.3, 0.4), 3)
    filaments.add_ring(DNA, 12, [0, 0, 50.0], rest_bends=RestBends([0.1] * 6 + [0.2] * 6, 0.2))
    context, own = in_context(filaments, NANOSECOND)
    for _ in range(3):
        context.getIntegrator().step(100)
        stretching, bending = (sum(own.energies(n)[part]._value.sum() for n in range(4)) for part in (0, 1))
        assert [one._value for one in force_of(context.getSystem()).computeEnergies(context)] == pytest.approx(
            [stretching, bending], rel=1e-10
        )
        assert energy_of(context) == pytest.approx(stretching + bending, rel=1e-10)


def test_step_is_checked():
    """The angle of the first frame of a ring is no twist."""
    filaments = chains(CIRCLE, RestBends(0.3), 8, 8)
    for number in range(8):
        filaments.add_ring(CIRCLE, 12, [200.0 * number, 0, 0], rest_bends=RestBends(0.5))
    _, system, positions = filaments.build()
    twists = {number: [0.0] * 12 + [100.0] for number in range(8, 16)}
    check = check_time_step(filaments, system, positions, NANOSECOND, frames=24, twists=twists)
    exact = BentJoint("inscribed-circle", 10.0, (2 * np.tan(0.15), 0.0)).moments()[2]
    assert check["DNA x 8 bending energy"].values == pytest.approx((exact, exact), rel=0.25)
    for label in ("DNA x 8", "DNA x 12"):
        assert check[f"{label} twist energy"].values == pytest.approx((0.5, 0.5), rel=0.3)


@pytest.mark.parametrize("model", ["inscribed-circle", "quadratic", "kratky-porod"])
def test_chains_are_drawn_from_equilibrium(model):
    kind = replace(DNA, bending_model=model, intrinsic_twist=0.3)
    bends = RestBends(0.35, 0.4)
    filaments = chains(kind, bends, 160, 60)
    _, own = in_context(filaments, NANOSECOND)
    energies = [own.energies(number)[1]._value / KT for number in range(160)]
    exact = BentJoint(model, 10.0, tuple(bends.components(model, 1)[0])).moments()[2]
    assert_near(np.array(energies).T, exact)


@pytest.mark.parametrize("platform", ["Reference", "CPU"])
def test_checkpoint_goes_on_to_the_bit(platform):
    """And so do a State with integratorParameters, and a Context of another System."""

    def bent():
        filaments = chains(CIRCLE, RestBends(0.3, 0.4), 3, 12)
        filaments.add_ring(CIRCLE, 12, [500, 0, 0], rest_bends=RestBends(0.4))
        return in_context(filaments, 30 * NANOSECOND, platform=platform)

    (context, own), *others = [bent() for _ in range(4)]
    context.getIntegrator().step(37)
    others[0][0].loadCheckpoint(context.createCheckpoint())
    others[1][0].setState(context.getState(positions=True, integratorParameters=True))
    others[2][1].go_on_from(context)
    context.getIntegrator().step(21)
    assert own.twists(3)._value[-1] != 0.0
    for other, of_other in others:
        other.getIntegrator().step(21)
        assert np.array_equal(positions_of(context), positions_of(other))
        for number in range(4):
            assert np.array_equal(own.twists(number)._value, of_other.twists(number)._value)


def test_chains_of_other_lengths_share_lanes():
    """Of the processor's registers: each moves as by itself."""

    def after_steps(lengths):
        filaments = Filaments(VISCOSITY, TEMPERATURE)
        for number, segments in enumerate(lengths):
            filaments.add_straight(
                CIRCLE, segments, [300.0 * number, 0, 0], [0, 0, 1], clamped=[0, 1], rest_bends=RestBends(0.2)
            )
        filaments.add_end_frame(1, "plus", [0, 0, 1], torque=2 * KT)
        context, own = in_context(filaments, 5 * NANOSECOND, pull=KT)
        context.getIntegrator().step(6)
        positions = positions_of(context)
        return [(positions[nodes], own.twists(n)._value) for n, nodes in enumerate(filaments.node_indices)]

    lengths = np.array([20, 19, 18])
    together = after_steps(lengths)
    for number, (nodes, twists) in enumerate(together):
        alone = after_steps(np.where(np.arange(3) == number, lengths, 4))[number]
        assert nodes == pytest.approx(alone[0], abs=1e-9) and twists == pytest.approx(alone[1], abs=1e-9)


# How segments turn


@pytest.mark.parametrize("step", [1e3, 1e2])
def test_torsional_diffusion_of_ends(step):
    """Without bends, that of the discrete modes of straight chains, by the split step."""
    squares = squares_of_end_angles(step, 1e4, 16, rest_bends=RestBends(0.0))
    assert_near(squares, mean_square_angle_of_an_end(16, 1e4))


def correlation_of_sines(concentration, time):
    """<sin(x) sin(x(t))> of an angle that diffuses, with the coefficient 1, in the potential -concentration cos(x)."""
    modes = np.arange(-40, 41)
    rate = np.diag(-(modes**2.0))
    rate += concentration / 2 * (np.diag(modes[1:], -1) - np.diag(modes[:-1], 1))
    density = iv(np.abs(modes), concentration).astype(complex)
    weighted = (np.roll(density, 1) - np.roll(density, -1)) / 2j
    after = expm(rate * time) @ weighted
    return ((after[39] - after[41]) / 2j / density[40]).real


@pytest.mark.parametrize("step", [1e2, 1e3, 1e4, 1e6])
def test_segments_turn_in_a_bent_joint(step):
    """Two segments whose nodes rest, and which turn together: Brownian motion in a cosine, and its equilibrium."""
    angle, rest, count = 0.8, 0.25, 200
    nodes = np.array([[0, 0, 0], [0, 0, 1], [np.sin(angle), 0, 1 + np.cos(angle)]])
    nodes = LENGTH * np.vstack([nodes, 2 * nodes[2] - nodes[1]])
    filaments = Filaments(VISCOSITY, TEMPERATURE)
    for number in range(count):
        filaments.add_nodes(CIRCLE, nodes + [0, 30.0 * number, 0], clamped=[0, 1, 2])
    _, system, positions = filaments.build()
    force, friction = force_of(system), CIRCLE.axial_friction(VISCOSITY)
    for number in range(count):
        # The third segment is free.
        force.setChainTwist(number, [1e4 * KT, 1e-9], [0.0, 0.0], [friction] * 3)
        force.setChainRestBends(number, [rest, 0.0, 0.0, 0.0])
    integrator = filaments.create_integrator(system, step, random_seed=3, checks=False)
    context = new_context(system, positions, integrator, "CPU")
    concentration = filaments[0].joint_stiffnesses[0] / KT * 2 * np.tan(angle / 2) * rest
    drawn = np.random.default_rng(1).vonmises(0.0, concentration, count)
    for number in range(count):
        force.setTwists(context, number, [float(drawn[number]), 0.0, 0.0, 0.0])
    apart = max(1, round(4e3 / step))
    angles = []
    for _ in range(400):
        twists = np.array([force.getTwists(context, number) for number in range(count)])
        angles.append(twists[:, 0] + 0.5 * twists[:, 1])
        integrator.step(apart)
    angles = np.array(angles)
    assert_near(np.cos(angles), iv(1, concentration) / iv(0, concentration))
    if step < 1e4:
        exact = correlation_of_sines(concentration, apart * step * KT / (2 * friction))
        assert_near(np.sin(angles[1:]) * np.sin(angles[:-1]), exact)
    elif step > 1e5:
        mean = (np.sin(angles[1:]) * np.sin(angles[:-1])).mean()
        assert abs(mean) < 0.05


def test_helix_is_the_rest_of_constant_bends_and_twists():
    """Without noise."""
    angle, twist, segments = 0.3, 0.5, 12
    kind = replace(DNA, intrinsic_twist=twist / LENGTH)
    filaments = Filaments(VISCOSITY, 0.0)
    filaments.add_straight(kind, segments, [0, 0, 0], [1, 0, 0], rest_bends=RestBends(angle))
    filaments.add_straight(kind, segments, [0, 0, 90.0], [1, 0, 0], rest_bends=RestBends(angle, 1.0))
    context, own = in_context(filaments, 20 * NANOSECOND)
    context.getIntegrator().step(2000)
    radius, rise, turn = helix_of_joints(angle, twist, LENGTH)
    number = np.arange(segments + 1)
    exact = np.column_stack([radius * np.cos(turn * number), radius * np.sin(turn * number), rise * number])
    for filament, nodes in enumerate(filaments.node_indices):
        found = positions_of(context)[nodes]
        distances = [np.linalg.norm(own[:, None] - own[None], axis=2) for own in (found, exact)]
        assert distances[0] == pytest.approx(distances[1], abs=1e-3)
        assert np.linalg.det(np.diff(found, axis=0)[:3]) > 0
        assert own.energies(filament)[1]._value == pytest.approx(0.0, abs=1e-6)


# Equilibrium


@pytest.mark.parametrize(
    ("model", "step"),
    [
        ("inscribed-circle", 1e3),
        ("inscribed-circle", 1e4),
        ("kratky-porod", 3e3),
        ("quadratic", 3e3),
        pytest.param("inscribed-circle", 1e2, marks=pytest.mark.slow),
    ],
)
def test_bends_and_twists_of_free_chains(model, step):
    """Both components of the bend in the material, the energy, and the twist."""
    kind = replace(DNA, bending_model=model)
    bends = RestBends(0.35, 0.6)
    filaments = Filaments(VISCOSITY, TEMPERATURE)
    for number in range(120):
        filaments.add_equilibrium(kind, 5, number, [100.0 * number, 0, 0], rest_bends=bends)
    context, own = in_context(filaments, step)
    joint = BentJoint(model, 10.0, tuple(bends.components(model, 1)[0]))
    exact = joint.moments()
    nodes = np.array(filaments.node_indices)
    energies, twists, cosines, components = [], [], [], []
    for _ in range(300):
        context.getIntegrator().step(int(max(2, 4e4 / step)))
        of_chains = np.array([own.twists(number)._value for number in range(len(nodes))])
        positions = positions_of(context)[nodes]
        found = material_bends(model, positions, of_chains)
        components.append(found.mean(axis=1))
        energies.append(5.0 * ((found - joint.rest) ** 2).sum(axis=2).mean(axis=1))
        twists.append((of_chains[:, 1:-1] ** 2).mean(axis=1))
        tangents = np.diff(positions, axis=1)
        tangents /= np.linalg.norm(tangents, axis=2)[..., None]
        cosines.append(1 - (tangents[:, 1:] * tangents[:, :-1]).sum(axis=2).mean(axis=1))
    for axis in (0, 1):
        assert_near(np.array(components)[..., axis], exact[axis])
    assert_near(energies, exact[2])
    assert_near(twists, LENGTH / 100)
    assert_near(cosines, 1 - joint.mean_rotation()[2, 2])


@pytest.mark.parametrize("step", [2e3, 2e4])
@pytest.mark.parametrize("pattern", ["helix", "random"])
def test_distance_of_ends(pattern, step):
    """Of chains with a twist at rest that all bend to one side, and of those with bends to all sides."""
    segments, count = 10, 96
    twist = 0.6 if pattern == "helix" else 0.0
    kind = replace(CIRCLE, intrinsic_twist=twist / LENGTH)
    directions = 0.3 if pattern == "helix" else np.random.default_rng(5).uniform(0, 2 * np.pi, segments - 1)
    bends = RestBends(np.full(segments - 1, 0.5), directions)
    context, _ = in_context(filaments := chains(kind, bends, count, segments), step)
    squares = []
    context.getIntegrator().step(10)
    for _ in range(100):
        context.getIntegrator().step(round(1e5 / step))
        nodes = positions_of(context)[np.array(filaments.node_indices)]
        squares.append(((nodes[:, -1] - nodes[:, 0]) ** 2).sum(axis=1))
    rest = bends.components("inscribed-circle", segments - 1)
    joints = [BentJoint("inscribed-circle", 10.0, tuple(own), 20.0, twist) for own in rest]
    straight = [BentJoint("inscribed-circle", 10.0, (0.0, 0.0), 20.0, twist)] * (segments - 1)
    exact = mean_square_distance(joints, LENGTH)
    assert exact < 0.9 * mean_square_distance(straight, LENGTH)
    assert_near(squares, exact)


@pytest.mark.parametrize("step", [2e3, 2e4])
def test_frames_at_ends_wind_chains(step):
    """By the split step: a torque on the frame beyond the plus end is that of all joints."""
    filaments = Filaments(VISCOSITY, TEMPERATURE)
    for number in range(32):
        filaments.add_straight(DNA, 12, [100.0 * number, 0, 0], [0, 0, 1], clamped=[0, 1], rest_bends=RestBends(0.0))
        filaments.add_end_frame(number, "minus", [0, 0, 1])
        filaments.add_end_frame(number, "plus", [0, 0, 1], torque=5 * KT)
    context, own = in_context(filaments, step, pull=2 * KT)
    context.getIntegrator().step(int(1e6 / step))
    torques = []
    for _ in range(200):
        context.getIntegrator().step(int(5e4 / step))
        twists = np.array([own.twists(number)._value for number in range(32)])
        torques.append(100.0 / LENGTH * twists[:, 1:-1].mean(axis=1))
    assert_near(torques, 5.0)


@pytest.mark.parametrize("step", [1e3, 1e4])
def test_links_join_the_ends_of_bent_chains(step):
    """Beside draws of chains with the weight of the link."""
    segments, count, stiffness, rest = 6, 160, 0.05, 10.0
    filaments = Filaments(VISCOSITY, TEMPERATURE)
    bends = RestBends(0.35, 0.6)
    for number in range(count):
        filaments.add_equilibrium(CIRCLE, segments, number, [200.0 * number, 0, 0], rest_bends=bends)
    links = Crosslinks(stiffness * KT, rest)
    _, system, positions = filaments.build()
    nodes = np.array(filaments.node_indices)
    for own in nodes:
        links.add(None, int(own[0]), int(own[-1]))
    links.add_to(system)
    context = new_context(
        system, positions, filaments.create_integrator(system, step, random_seed=2, checks=False), "CPU"
    )
    context.getIntegrator().step(int(2e5 / step))
    distances = []
    for _ in range(250):
        context.getIntegrator().step(int(4e4 / step))
        found = positions_of(context)
        distances.append(np.linalg.norm(found[nodes[:, -1]] - found[nodes[:, 0]], axis=1))
    joint = BentJoint("inscribed-circle", 10.0, tuple(bends.components("inscribed-circle", 1)[0]), 20.0)
    drawn = LENGTH * drawn_distances(joint, segments, 200000, np.random.default_rng(4))
    weights = np.exp(-0.5 * stiffness * (drawn - rest) ** 2)
    exact = (drawn * weights).sum() / weights.sum()
    assert exact < 0.8 * drawn.mean()
    assert_near(distances, exact, error=0.02)


@pytest.mark.slow
def test_rings_are_those_of_monte_carlo():
    """Rings that are curved at rest as the flat one is."""
    segments, count = 20, 160
    rings = BentRings(segments, 10.0, 20.0, (2 * np.sin(np.pi / segments), 0.0), count)
    generator = np.random.default_rng(3)
    rings.move(8000, generator)
    observed = []
    for _ in range(120):
        rings.move(50, generator)
        observed.append(rings.observe())
    exact = np.mean(observed, axis=(0, 1))
    errors = np.mean(observed, axis=0).std(axis=0) / np.sqrt(count)
    for step in (1e3, 1e4):
        filaments = Filaments(VISCOSITY, TEMPERATURE)
        for tangents in rings.tangents:
            nodes = LENGTH * np.cumsum(np.vstack([np.zeros(3), tangents[:-1]]), axis=0)
            filaments.add_nodes(DNA, nodes, closed=True, rest_bends=RestBends(2 * np.pi / segments))
        context, own = in_context(filaments, step)
        for number, twists in enumerate(np.column_stack([rings.twists, rings.first_twists()])):
            own.set_twists(number, twists)
        start = [own.energies(number)[1]._value.sum() / KT for number in range(count)]
        assert start == pytest.approx(rings.observe()[:, 0], rel=1e-6)
        found = []
        for _ in range(60):
            context.getIntegrator().step(int(max(10, 3e4 / step)))
            bending = [own.energies(number)[1]._value.sum() / KT for number in range(count)]
            twisting = [10.0 * (own.twists(number)._value[:-1] ** 2).sum() for number in range(count)]
            radii = squared_radii(positions_of(context)[np.array(filaments.node_indices)]) / LENGTH**2
            found.append(np.column_stack([bending, twisting, radii]))
        means = np.mean(found, axis=0)
        both = np.sqrt(errors**2 + (means.std(axis=0) / np.sqrt(count)) ** 2)
        assert np.all(SIGMAS * both < 0.05 * exact), "too few samples to tell"
        assert np.all(np.abs(means.mean(axis=0) - exact) < SIGMAS * both)
