"""Joints of beam elements: energies, moments, welded filaments, equilibrium, States and XML, and what is refused."""

import warnings
from dataclasses import replace

import numpy as np
import openmm
import pytest
from openmm import unit

from openmm_cylchain import Crosslinks, Filaments, InputError, Joints, JointWarning, SegmentPlace
from openmm_cylchain.beams.curve import element_energies, element_slopes
from openmm_cylchain.engines.compiled import CylinderChainForce
from support.contexts import energy_of, forces_of, new_context, positions_of, slopes_of
from support.linked_beams import BEAM, LENGTH, STRAIGHT
from support.solvent import KT, TEMPERATURE, VISCOSITY

SIGMAS = 4.0
BENDS = 1.93
"""Of an element of a quarter of a persistence length in space, in k_B T: see the tests of chains without links."""
JOINTS = 9


def jointed(periodic=False):
    """Two beams, one of them in a plane, with joints between them, to themselves, and to a direction."""
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine="compiled")
    filaments.add_equilibrium(BEAM, 3, seed=1)
    filaments.add_equilibrium(BEAM, 2, seed=2, start=[100, 200, 0], planar=True)
    box = [[1500.0, 0, 0], [100.0, 1500.0, 0], [-60.0, 90.0, 1600.0]] * unit.nanometer
    _, system, positions = filaments.build(box if periodic else None)
    CylinderChainForce.cast(system.getForce(0)).setUsesPeriodicBoundaryConditions(periodic)
    joints = Joints(30.0 * unit.kilojoule_per_mole)
    one, other = (
        filaments.segment_place(0, segment=1, fraction=0.3),
        filaments.segment_place(1, segment=1, fraction=1.0),
    )
    joints.add(None, one, other)
    joints.add(None, one, SegmentPlace(other.second, other.first, 1.0 - other.fraction), 50.0 * unit.degree)
    joints.add(None, one, [0, 3, 4], angle=0.4, stiffness=7.0)
    joints.add(None, filaments.segment_place(0, segment=2, fraction=0.9), one, 0.5 * np.pi)
    return filaments, system, positions._value, joints, joints.add_to(system, JOINTS)


def tangent(filaments, positions, filament, segment, fraction):
    own = [positions[particles[filament]] for particles in (filaments.node_indices, filaments.control_point_indices)]
    return element_slopes(*own, [fraction], LENGTH)[segment, 0]


@pytest.mark.parametrize("periodic", [False, True])
@pytest.mark.parametrize("platform", ["Reference", "CPU"])
def test_energies_angles_and_forces(platform, periodic):
    filaments, system, positions, joints, _ = jointed(periodic)
    one, other, last = (tangent(filaments, positions, *place) for place in ((0, 1, 0.3), (1, 1, 1.0), (0, 2, 0.9)))
    pairs = ((one, other, 30.0, 0.0), (one, -other, 30.0, np.radians(50.0)), (one, [0, 0.6, 0.8], 7.0, 0.4))
    pairs += ((last, one, 30.0, 0.5 * np.pi),)
    if periodic:
        # Each particle in the box by itself.
        positions[:, 2] %= 1600.0
        positions[::2, 0] += 1500.0
    context = new_context(system, positions, platform=platform)
    forces, groups = forces_of(context, 1 << JOINTS), 1 << JOINTS
    expected = [
        0.5 * k * ((np.linalg.norm(a - np.array(b)) - 2 * np.sin(0.5 * c)) / np.cos(0.5 * c)) ** 2
        for a, b, k, c in pairs
    ]
    assert energy_of(context, groups) == pytest.approx(sum(expected), rel=1e-9)
    cosines = [np.dot(a, b) / np.linalg.norm(a) / np.linalg.norm(b) for a, b, *_ in pairs]
    assert joints.angles(context) == pytest.approx(np.arccos(cosines), rel=1e-9)
    own = (
        30.0 * (2 * np.sin(0.5 * np.arccos(cosines[1])) - 2 * np.sin(np.radians(25.0))) / np.cos(np.radians(25.0)) ** 2
    )
    assert joints.moments(context)[1] == pytest.approx(own * np.cos(0.5 * np.arccos(cosines[1])), rel=1e-9)
    # They are couples.
    assert np.sum(forces, axis=0) == pytest.approx(0.0, abs=1e-9)
    slopes = slopes_of(context, positions, range(len(positions)), groups)
    assert forces == pytest.approx(-slopes, abs=1e-6)
    assert np.abs(forces).max() > 1e-3


def cantilever(welded, elements, angle=0.0):
    """A clamped beam, of one piece or of two that are welded end to end, which a force across bends at its end."""
    kind = replace(BEAM, temperature=None, persistence_length=None, bending_rigidity=1000.0 * KT)
    filaments = Filaments(VISCOSITY, 0.0, engine="compiled")
    clamp = {"clamped": 0, "clamped_tangents": 0}
    if welded:
        filaments.add_straight(kind, elements // 2, [0, 0, 0], [1, 0, 0], **clamp)
        direction = [np.cos(angle), np.sin(angle), 0]
        filaments.add_straight(kind, elements // 2, [elements // 2 * LENGTH, 0, 0], direction)
    else:
        filaments.add_straight(kind, elements, [0, 0, 0], [1, 0, 0], **clamp)
    _, system, positions = filaments.build()
    force = openmm.CustomExternalForce("-0.003*y")
    force.addParticle(int(filaments.node_indices[-1][-1]), [])
    system.addForce(force)
    if welded:
        ends = filaments.segment_place(0, segment=-1, fraction=1.0), filaments.segment_place(1, segment=0, fraction=0.0)
        links = Crosslinks(1e4, 0.0)
        links.add(None, *ends)
        links.add_to(system)
        joints = Joints(1e7)
        joints.add(None, *ends, angle)
        joints.add_to(system)
    integrator = filaments.create_integrator(system, 1e10, checks=False)
    context = new_context(system, positions, integrator)
    integrator.step(200)
    return filaments, positions_of(context), context


def test_beams_that_are_welded_end_to_end_are_one_beam():
    """A cantilever that a force bends by three tenths of its length, with a stiff link and a stiff joint in it."""
    whole, expected, _ = cantilever(False, 4)
    parts, found, _ = cantilever(True, 4)
    end = expected[whole.node_indices[0]]
    assert end[-1, 1] > 0.3 * 4 * LENGTH and end[-1, 0] < 0.97 * 4 * LENGTH
    joined = np.concatenate([found[parts.node_indices[0]][:-1], found[parts.node_indices[1]]])
    assert joined == pytest.approx(end, abs=1e-4 * end[-1, 1])


def test_a_stiff_joint_holds_its_angle_against_a_force():
    filaments, found, context = cantilever(True, 2, 0.9)
    before, after = tangent(filaments, found, 0, 0, 1.0), tangent(filaments, found, 1, 0, 0.0)
    cosine = np.dot(before, after) / np.linalg.norm(before) / np.linalg.norm(after)
    assert np.arccos(cosine) == pytest.approx(0.9, abs=1e-3)
    assert np.arctan2(before[1], before[0]) > 0.02


def mean_energy_and_cosine(stiffness, angle):
    """Of a joint between two unit vectors, in k_B T, in its own equilibrium."""
    theta = np.linspace(0.0, np.pi, 200001)
    energy = 0.5 * stiffness * ((2 * np.sin(0.5 * theta) - 2 * np.sin(0.5 * angle)) / np.cos(0.5 * angle)) ** 2 / KT
    weights = np.sin(theta) * np.exp(-energy)
    weights /= weights.sum()
    return weights @ energy, weights @ np.cos(theta), theta, weights


@pytest.mark.sample("^(?!1000)")
@pytest.mark.slow
@pytest.mark.parametrize(
    ("stiffness", "angle", "welded"),
    [
        (100.0, 1.0, True),
        (1000.0, 0.0, True),
        (50.0, 0.0, False),
    ],
)
def test_equilibrium_of_joints_at_the_recommended_step(stiffness, angle, welded):
    """The ends of two filaments: the angle has its own distribution, as directions of free chains have no other weight.

    With a stiff link at the same places or without one; bends are those of free chains.
    """
    copies, samples = 300, 80
    exact, cosine, theta, weights = mean_energy_and_cosine(stiffness, angle)
    if angle == 0.0:
        # Strains of the two ends let the absolute values of their tangents differ, a third component.
        ends = BEAM.stretching_modulus * LENGTH / 6.0
        exact += 0.5 * stiffness / (stiffness + 0.5 * ends)
    filaments, generator = Filaments(VISCOSITY, TEMPERATURE, engine="compiled"), np.random.default_rng(3)
    for number in range(copies):
        first = filaments.add_equilibrium(BEAM, 2, seed=2 * number)
        axis = filaments[first].control_points[-1] - filaments[first].positions[-1]
        axis /= np.linalg.norm(axis)
        across = np.cross(axis, generator.normal(size=3))
        across /= np.linalg.norm(across)
        turn = generator.choice(theta, p=weights)
        direction = np.cos(turn) * axis + np.sin(turn) * across
        drawn = Filaments(VISCOSITY, TEMPERATURE, engine="compiled")
        drawn.add_equilibrium(BEAM, 2, seed=2 * number + 1)
        start, control = drawn[0].positions[0], drawn[0].control_points[0]
        turned = turning((control - start) / np.linalg.norm(control - start), direction)
        move = filaments[first].positions[-1]
        nodes, controls = ((own - start) @ turned.T + move for own in (drawn[0].positions, drawn[0].control_points))
        filaments.add_nodes(BEAM, nodes, control_points=controls)
    _, system, positions = filaments.build()
    joints, links = Joints(stiffness), Crosslinks(100.0, 0.0)
    for number in range(0, 2 * copies, 2):
        ends = (
            filaments.segment_place(number, segment=-1, fraction=1.0),
            filaments.segment_place(number + 1, segment=0, fraction=0.0),
        )
        joints.add(None, *ends, angle)
        links.add(None, *ends)
    joints.add_to(system)
    if welded:
        links.add_to(system)
    step = filaments.recommended_time_step(system=system)
    assert not step.unknown_forces
    integrator = filaments.create_integrator(system, step, random_seed=2)
    context = new_context(system, positions, integrator, "CPU")
    integrator.step(50)
    energies, cosines, bends, stretched = [], [], [], []
    nodes, controls = (np.array(own) for own in (filaments.node_indices, filaments.control_point_indices))
    for _ in range(samples):
        integrator.step(10)
        now = positions_of(context)
        first, second = (
            3.0 * (now[controls[i::2, end]] - now[nodes[i::2, end]]) / LENGTH for i, end in ((0, -1), (1, 0))
        )
        distance = np.linalg.norm(first - second, axis=1)
        energies.append(0.5 * stiffness * ((distance - 2 * np.sin(0.5 * angle)) / np.cos(0.5 * angle)) ** 2 / KT)
        cosines.append(1.0 - np.cos(joints.angles(context)))
        element = filaments[0].beam_element(TEMPERATURE)
        stretching, bending = element_energies(now[nodes], now[controls], element)
        bends.append(bending.mean(axis=1).reshape(-1, 2).mean(axis=1) / KT)
        if welded:
            stretched.append(50.0 * np.sum((now[nodes[::2, -1]] - now[nodes[1::2, 0]]) ** 2, axis=1) / KT)
    assert integrator.getNumDividedSteps() / (len(filaments) * 850) < 5e-3
    checks = [(energies, exact, 0.015, 0.0125), (cosines, 1.0 - cosine, 0.015, 0.0125), (bends, BENDS, 0.01, 0.0125)]
    for values, expected, allowed, power in [*checks, *([(stretched, 1.5, 0.01, 0.0125)] if welded else [])]:
        means = np.mean(values, axis=0)
        error = np.std(means, ddof=1) / np.sqrt(len(means))
        print(np.mean(means), expected, error)
        assert error < power * expected
        assert abs(np.mean(means) - expected) < SIGMAS * error + allowed * expected


def turning(first, second):
    """The rotation that takes one unit vector to another."""
    axis, cosine = np.cross(first, second), np.dot(first, second)
    cross = np.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])
    return np.eye(3) + cross + cross @ cross / (1.0 + cosine)


def test_joints_come_and_go_and_checkpoints_and_xml_hold_them():
    filaments, system, positions, joints, force = jointed()
    integrator = filaments.create_integrator(system, 1e4, random_seed=1)
    context = new_context(system, positions, integrator)
    begun = energy_of(context, 1 << JOINTS)
    checkpoint = context.createCheckpoint()
    number = joints.add(context, filaments.segment_place(1, segment=0), [1, 0, 0], stiffness=500.0)
    assert number == 4 and joints.numbers(context).tolist() == [0, 1, 2, 3, 4]
    extra = energy_of(context, 1 << JOINTS) - begun
    assert extra > 0.0
    joints.set_active(context, number, False)
    assert energy_of(context, 1 << JOINTS) == pytest.approx(begun)
    assert joints.moments(context)[4] == 0.0
    joints.remove(context, [0, 1])
    context.loadCheckpoint(checkpoint)
    assert joints.numbers(context).tolist() == [0, 1, 2, 3]
    integrator.step(5)
    copied = openmm.XmlSerializer.deserialize(openmm.XmlSerializer.serialize(system))
    again = new_context(copied, positions, openmm.VerletIntegrator(1.0))
    assert energy_of(again, 1 << JOINTS) == pytest.approx(begun, rel=1e-12)
    # They are no crosslinks to those who look for some.
    assert Crosslinks.from_system(copied) == [] and Crosslinks.of_force(force) is None


def test_what_is_refused():
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine="compiled")
    filaments.add_straight(BEAM, 2, [0, 0, 0], [1, 0, 0])
    filaments.add_straight(STRAIGHT, 2, [0, 100, 0], [1, 0, 0])
    _, system, positions = filaments.build()
    beam, straight = (filaments.segment_place(number, segment=0) for number in (0, 1))
    with pytest.raises(InputError, match="stiffness"):
        Joints(0.0)
    joints = Joints(1.0)
    with pytest.raises(InputError, match="must be a SegmentPlace"):
        joints.add(None, 0, beam)
    with pytest.raises(InputError, match="between 0 and pi/2"):
        joints.add(None, beam, [1, 0, 0], 2.0)
    with pytest.raises(InputError, match="zero vector"):
        joints.add(None, beam, [0, 0, 0])
    joints.add(None, beam, straight)
    with pytest.raises(InputError, match="Joint 0 has a place between the particles 6 and 7, which are not"):
        joints.add_to(system)
    joints.remove(None, 0)
    joints.add_to(system)
    context = new_context(system, positions, filaments.create_integrator(system, 1e4))
    with pytest.raises(InputError, match="which are not neighbouring nodes"):
        joints.add(context, straight, beam)
    with pytest.raises(InputError, match="itself"):
        joints.add(context, beam, beam)
    only = Filaments(VISCOSITY, TEMPERATURE, engine="compiled")
    only.add_straight(STRAIGHT, 2, [0, 0, 0], [1, 0, 0])
    with pytest.raises(InputError, match="of which this System has none"):
        Joints(1.0).add_to(only.build()[1])


def beside_each_other(closed=False):
    """Two filaments, and a place on each."""
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine="compiled")
    if closed:
        filaments.add_ring(BEAM, 6, [0, 0, 0])
    else:
        filaments.add_straight(BEAM, 3, [0, 0, 0], [1, 0, 0])
    filaments.add_straight(BEAM, 2, [0, 50, 0], [1, 0, 0])
    element = BEAM.beam_element(TEMPERATURE)
    return filaments, filaments.build()[1], element.rigidity / element.length


def integrator_of(filaments, system):
    return filaments.create_integrator(system, filaments.recommended_time_step())


@pytest.mark.parametrize("closed", [False, True])
@pytest.mark.parametrize("angle", [0.0, 1.0])
def test_stiff_joints_of_filaments_that_are_not_linked_there_are_warned_of(closed, angle):
    filaments, system, rigidity = beside_each_other(closed)
    first = filaments.segment_place(0, segment=-1, fraction=1.0)
    second = filaments.segment_place(1, segment=0, fraction=0.4)
    joints, links = Joints(10.0 * rigidity), Crosslinks(1.0, 0.0)
    joints.add(None, first, second)
    joints.add(None, filaments.segment_place(0, segment=0, fraction=0.5), second, angle, 30.0 * rigidity)
    joints.add(None, first, [0, 0, 1], stiffness=500.0 * rigidity)
    links.add(None, first, second)
    links.add_to(system)
    joints.add_to(system)
    with pytest.warns(JointWarning, match=r"Joint 1 between filaments 0 and 1, .* is 30 times as stiff"):
        integrator_of(filaments, system)


@pytest.mark.parametrize("closed", [False, True])
def test_stiff_joints_of_filaments_that_are_linked_there_are_not(closed):
    """The link is given the other way around, and by the node of the same place: of a ring, the first one."""
    filaments, system, rigidity = beside_each_other(closed)
    node = filaments.node_indices[0][0 if closed else -1]
    place = filaments.segment_place(1, segment=0, fraction=0.4)
    joints, links = Joints(500.0 * rigidity), Crosslinks(1.0, 0.0)
    joints.add(None, filaments.segment_place(0, segment=-1, fraction=1.0), place)
    links.add(None, place, int(node))
    links.add_to(system)
    joints.add_to(system)
    with warnings.catch_warnings():
        warnings.simplefilter("error", JointWarning)
        integrator_of(filaments, system)
