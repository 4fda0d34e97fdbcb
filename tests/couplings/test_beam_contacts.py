"""Contacts of capsules on the curves of beam elements: geometry, forces, rest, equilibrium, and what is refused."""

from dataclasses import replace

import numpy as np
import openmm
import pytest
from openmm import unit
from scipy.optimize import minimize
from scipy.spatial.transform import Rotation

from openmm_cylchain import (
    F_ACTIN,
    Filaments,
    InputError,
    InstabilityError,
    TimeStepWarning,
    capsule_contact_force,
    find_contacts,
)
from openmm_cylchain.beams.curve import curve_points, element_energies, element_points
from openmm_cylchain.beams.equilibrium import draw_beam
from openmm_cylchain.couplings.capsule_contacts import contact_spacing
from support.contexts import energy_of, forces_of, new_context, positions_of, slopes_of
from support.linked_beams import BEAM, LENGTH, STRAIGHT
from support.solvent import KT, TEMPERATURE, VISCOSITY

SIGMAS = 4.0
CONTACTS = 4
DIAMETER, STIFFNESS = 30.0, 0.3


def crossing(pieces, periodic=False):
    """Two curved beams that overlap where they cross, and a straight filament and a sphere that touch the first."""
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine="compiled")
    angles = np.linspace(-0.45, 0.45, 3)
    arc = np.stack([550.0 * np.sin(angles), 0 * angles, 550.0 * (1 - np.cos(angles))], axis=1)
    filaments.add_nodes(BEAM, arc, tangents=np.stack([np.cos(angles), 0 * angles, np.sin(angles)], axis=1))
    other = arc[:, [1, 0, 2]] * [1, 1, -1] + [60.0, 20.0, 24.0]
    filaments.add_nodes(BEAM, other, tangents=np.stack([0 * angles, np.cos(angles), -np.sin(angles)], axis=1))
    filaments.add_straight(STRAIGHT, 4, [-150.0, -200.0, 45.0], [0, 1, 0])
    for number in (0, 1):
        filaments.add_beads(number, LENGTH / pieces)
    box = 1600.0 * np.eye(3) if periodic else None
    _, system, positions = filaments.build(box)
    particle = system.addParticle(1.0)
    positions = np.concatenate([positions._value, [[180.0, 0.0, 50.0]]])
    force = capsule_contact_force(filaments, system, DIAMETER, STIFFNESS, [particle], 40.0)
    force.setForceGroup(CONTACTS)
    system.addForce(force)
    return filaments, system, positions, force


def fine_curve(filaments, positions, number, points=600):
    nodes, controls = filaments.node_indices[number], filaments.control_point_indices[number]
    if not len(controls):
        return np.linspace(positions[nodes[0]], positions[nodes[-1]], 4 * points)
    return curve_points(positions[nodes], positions[controls], points)


def nearest(one, other):
    return min(np.linalg.norm(one[i : i + 50, None] - other, axis=2).min() for i in range(0, len(one), 50))


@pytest.mark.parametrize("platform", ["Reference", "CPU"])
def test_energies_and_forces_are_those_of_pieces_of_the_curve(platform):
    filaments, system, positions, force = crossing(8, True)
    context = new_context(system, positions, platform=platform)
    curves = [fine_curve(filaments, positions, number) for number in range(3)]
    overlaps = [
        DIAMETER - nearest(curves[0], curves[1]),
        DIAMETER - nearest(curves[0], curves[2]),
        35.0 - nearest(curves[0], positions[-1:]),
    ]
    assert min(overlaps) > 2.0
    groups = 1 << CONTACTS
    # Pieces are 0.09 nm away from the curve.
    expected = 0.5 * STIFFNESS * np.sum(np.square(overlaps))
    assert energy_of(context, groups) == pytest.approx(expected, rel=0.03)
    forces = forces_of(context, groups)
    sites = {int(site) for own in filaments.bead_indices for site in own}
    moving = sorted(set(range(len(positions))) - sites)
    assert np.sum(forces[moving], axis=0) == pytest.approx(0.0, abs=1e-9)
    slopes = slopes_of(context, positions, moving, groups, distance=1e-3)
    assert forces[moving] == pytest.approx(-slopes, abs=1e-5)
    assert np.any(forces[filaments.control_point_indices[0]]) and np.any(forces[filaments.control_point_indices[1]])
    context.setPositions(positions)
    context.computeVirtualSites()
    found = find_contacts(force, context)
    assert len(found) == 3 and found.gaps.min() == pytest.approx(-max(overlaps), abs=0.3)


def test_pieces_come_to_the_curve_with_their_number():
    errors = []
    for pieces in (2, 4, 8):
        filaments, system, positions, force = crossing(pieces)
        assert len(filaments.bead_indices[0]) == 2 * pieces + 1
        context = new_context(system, positions)
        overlap = DIAMETER - nearest(*(fine_curve(filaments, positions, number) for number in (0, 1)))
        found = find_contacts(force, context)
        between = np.all(np.sort(found.filaments, axis=1) == [0, 1], axis=1)
        errors.append(abs(-found.gaps[between][0] - overlap))
    # Each of the two, whose elements bend by 0.45 radians.
    assert np.all(np.array(errors) < 2.0 * LENGTH * 0.45 / (8.0 * np.array([2, 4, 8]) ** 2))
    assert errors[0] > 4.0 * errors[2] > 0.0


def test_beads_are_at_nodes_and_their_spacing_fits_the_diameter():
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine="compiled")
    filaments.add_straight(BEAM, 3, [0, 0, 0], [1, 0, 0])
    filaments.add_beads(0, 0.3 * LENGTH * unit.nanometer)
    _, _, positions = filaments.build()
    assert positions._value[filaments.bead_indices[0], 0] == pytest.approx(np.arange(13) * LENGTH / 4)
    # Bent by 0.71 radians, n pieces are 22 nm/n^2 away from an element.
    assert contact_spacing(BEAM, 30.0, TEMPERATURE) == LENGTH / 4
    assert contact_spacing(BEAM, 8.0 * unit.nanometer, TEMPERATURE) == pytest.approx(LENGTH / 6)


@pytest.mark.slow
def test_a_beam_that_is_pulled_onto_another_rests_where_their_energy_is_least():
    """Without noise: bent over each other, with the contact in the middle of an element of each."""
    elements, spring, stiffness, diameter = 3, 0.02, 0.2, 20.0
    kind = replace(BEAM, temperature=None, persistence_length=None, bending_rigidity=400.0 * KT)
    filaments = Filaments(VISCOSITY, 0.0, engine="compiled")
    half = 0.5 * elements * LENGTH
    filaments.add_straight(kind, elements, [-half, 0, 0], [1, 0, 0], clamped=[0, -1], clamped_tangents=[0, -1])
    filaments.add_straight(kind, elements, [0, -half, 30], [0, 1, 0])
    points = {0: [0, -half, -150.0], -1: [0, half, -150.0]}
    for node, point in points.items():
        filaments.add_tether(1, node, point, spring)
    for number in (0, 1):
        filaments.add_beads(number, LENGTH / 8)
    _, system, positions = filaments.build()
    system.addForce(capsule_contact_force(filaments, system, diameter, stiffness))
    integrator = filaments.create_integrator(system, 1e5, checks=False)
    context = new_context(system, positions, integrator)
    integrator.step(4500)
    found = positions_of(context)
    elements_of = [own.beam_element(0.0) for own in filaments]
    start = [np.stack([own.positions, own.control_points]) for own in filaments]

    def placed(free):
        first, second = start[0].copy(), free[12:].reshape(2, 4, 3) * LENGTH
        first[:, 1:3] = free[:12].reshape(2, 2, 3) * LENGTH
        return first, second

    def energy(free):
        chains = placed(free)
        total = sum(
            part.sum() for chain, element in zip(chains, elements_of) for part in element_energies(*chain, element)
        )
        total += 0.5 * spring * sum(np.sum((chains[1][0, node] - point) ** 2) for node, point in points.items())
        heights = [element_points(*chain, [0.5])[1, 0, 2] for chain in chains]
        return total + 0.5 * stiffness * max(0.0, diameter - (heights[1] - heights[0])) ** 2

    free = np.concatenate([start[0][:, 1:3].ravel(), start[1].ravel()]) / LENGTH
    # With differences to one side, rounding would end the search at places that depend on the processor.
    search = minimize(energy, free, method="BFGS", jac="3-point", options={"gtol": 1e-3})
    assert np.abs(search.jac).max() < 1e-3
    least = placed(search.x)
    for own, chain in enumerate(least):
        for particles, expected in zip((filaments.node_indices[own], filaments.control_point_indices[own]), chain):
            assert found[particles] == pytest.approx(expected, abs=0.1)
    heights = [element_points(*chain, [0.5])[1, 0, 2] for chain in least]
    assert heights[0] < -10.0 and 2.0 < diameter - (heights[1] - heights[0]) < 4.0


def test_beams_that_are_pushed_through_each_other_do_not_cross():
    """With noise, and tethers that pull the second of each pair to the other side of the first."""
    pairs, diameter = 20, 20.0
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine="compiled")
    for pair in range(pairs):
        origin = np.array([0.0, 0.0, 1000.0 * pair])
        filaments.add_straight(BEAM, 2, origin - [LENGTH, 0, 0], [1, 0, 0], clamped=[0, -1])
        filaments.add_straight(BEAM, 2, origin + [0, -LENGTH, 30.0], [0, 1, 0])
        for node in (0, -1):
            filaments.add_tether(2 * pair + 1, node, origin + [0, LENGTH * (2 * (node == -1) - 1), -100.0], 0.01)
    for number in range(2 * pairs):
        filaments.add_beads(number, contact_spacing(BEAM, diameter, TEMPERATURE))
    _, system, positions = filaments.build()
    system.addForce(capsule_contact_force(filaments, system, diameter))
    step = filaments.recommended_time_step(system=system)
    integrator = filaments.create_integrator(system, step, random_seed=6)
    context = new_context(system, positions, integrator, "CPU")
    for _ in range(30):
        integrator.step(20)
        now = positions_of(context)
        for pair in range(pairs):
            lower, upper = (fine_curve(filaments, now, 2 * pair + i, 50) for i in (0, 1))
            distances = np.linalg.norm(lower[:, None] - upper, axis=2)
            i, j = np.unravel_index(np.argmin(distances), distances.shape)
            assert distances[i, j] > 0.4 * diameter
            # Between ends that lie far apart, the one above stays there.
            assert upper[j, 2] > lower[i, 2] or distances[i, j] > 2.0 * diameter


def drawn_between(points, spring, element, draws, generator):
    """Elements in equilibrium whose two nodes springs tie to two points: nodes and control points, (draws, 2, 3)."""
    chain = draw_beam(element, draws, KT, generator, np.zeros(3), None, False)
    nodes, controls = (np.stack([own[:-1], own[1:]], axis=1) for own in chain)
    nodes, controls = nodes - nodes[:, :1], controls - nodes[:, :1]
    apart = points[1] - points[0]
    length, distance = np.linalg.norm(nodes[:, 1], axis=1), np.linalg.norm(apart)
    # With the place integrated over, the two are one of half the stiffness between the end and the second point: shapes
    # weigh as their lengths have it, and directions have the distribution of von Mises and Fisher.
    kappa = 0.5 * spring * length * distance / KT
    logarithm = kappa - np.log(kappa) + np.log1p(-np.exp(-2.0 * kappa)) - 0.25 * spring * length**2 / KT
    weights = np.exp(logarithm - logarithm.max())
    chosen = generator.choice(draws, draws, p=weights / weights.sum())
    nodes, controls, kappa = nodes[chosen], controls[chosen], kappa[chosen]
    uniform = generator.uniform(size=draws)
    cosine = 1.0 + np.log(uniform + (1.0 - uniform) * np.exp(-2.0 * kappa)) / kappa
    across = generator.normal(size=(draws, 3))
    axis = apart / distance
    across -= np.outer(across @ axis, axis)
    across /= np.linalg.norm(across, axis=1, keepdims=True)
    direction = cosine[:, None] * axis + np.sqrt(1.0 - cosine**2)[:, None] * across
    own = nodes[:, 1] / np.linalg.norm(nodes[:, 1], axis=1, keepdims=True)
    turn = np.cross(own, direction)
    size = np.linalg.norm(turn, axis=1, keepdims=True)
    turns = Rotation.from_rotvec(turn / size * np.arctan2(size, np.sum(own * direction, axis=1, keepdims=True)))
    turns = turns * Rotation.from_rotvec(own * generator.uniform(0.0, 2.0 * np.pi, (draws, 1)))
    nodes, controls = (np.stack([turns.apply(each[:, end]) for end in (0, 1)], axis=1) for each in (nodes, controls))
    shift = 0.5 * (points[0] + points[1] - nodes[:, 1]) + np.sqrt(0.5 * KT / spring) * generator.normal(size=(draws, 3))
    return nodes + shift[:, None], controls + shift[:, None]


def least_distances(first, second):
    """Of the lines through points (n, points, 3), over all pairs of pieces, and whether the second is above there."""
    least, above = np.full(len(first), np.inf), np.zeros(len(first), dtype=bool)
    for i in range(first.shape[1] - 1):
        for j in range(second.shape[1] - 1):
            p, q = first[:, i + 1] - first[:, i], second[:, j + 1] - second[:, j]
            w = first[:, i] - second[:, j]
            a, b, c, d, e = (np.sum(x * y, axis=1) for x, y in ((p, p), (p, q), (q, q), (p, w), (q, w)))
            s = np.clip((b * e - c * d) / (a * c - b * b), 0.0, 1.0)
            t = np.clip((b * s + e) / c, 0.0, 1.0)
            s = np.clip((b * t - d) / a, 0.0, 1.0)
            t = np.clip((b * s + e) / c, 0.0, 1.0)
            vector = w + s[:, None] * p - t[:, None] * q
            distance = np.linalg.norm(vector, axis=1)
            above = np.where(distance < least, vector[:, 2] < 0.0, above)
            least = np.minimum(least, distance)
    return least, above


@pytest.mark.slow
@pytest.mark.parametrize("stiffness", [0.2, 1.0])
def test_equilibrium_is_that_of_weighted_draws(stiffness):
    """Pairs of crossed elements that springs pull into each other: how far apart they are, how they lie, and bends.

    Without the contact, pairs are drawn exactly, and weigh as its energy has it, if the second is above the first where
    they are nearest: a contact does not let them change sides, but for the few that come around their ends.
    """
    copies, samples, diameter, spring, draws, pieces, depth = 400, 80, 30.0, 4e-3, 20000, 6, 15.0
    generator, element = np.random.default_rng(3), BEAM.beam_element(TEMPERATURE)
    ends = 0.5 * LENGTH * np.array([[[-1.0, 0, 0], [1.0, 0, 0]], [[0, -1.0, 0], [0, 1.0, 0]]])
    ends[1, :, 2] += depth
    drawn = [drawn_between(points, spring, element, draws, generator) for points in ends]

    def measure(first, second):
        heights = [element_points(*own, [0.5])[:, 0, 0, 2] for own in (first, second)]
        middles = [own[0][:, :, 2].mean(axis=1) for own in (first, second)]
        bends = [element_energies(*own, element)[1][:, 0] / KT for own in (first, second)]
        return heights[1] - heights[0], middles[1] - middles[0], 0.5 * (bends[0] + bends[1])

    def nearest_of(first, second):
        return least_distances(*(curve_points(*own, pieces) for own in (first, second)))

    values = measure(*drawn)
    least, above = nearest_of(*drawn)
    weights = np.exp(-0.5 * stiffness * np.maximum(0.0, diameter - least) ** 2 / KT) * above
    weights /= weights.sum()
    assert 1.0 / np.sum(weights**2) > 0.1 * draws
    expected = np.array([weights @ each for each in values])
    errors = np.array([np.sqrt(np.sum((weights * (each - mean)) ** 2)) for each, mean in zip(values, expected)])
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine="compiled")
    for copy in range(copies):
        for points, direction in zip(ends, ([1, 0, 0], [0, 1, 0])):
            moved = points + [0, 0, 1000.0 * copy]
            number = filaments.add_straight(BEAM, 1, moved[0], direction)
            filaments.add_beads(number, LENGTH / pieces)
            for node in (0, 1):
                filaments.add_tether(number, node, moved[node], spring)
    _, system, positions = filaments.build()
    system.addForce(capsule_contact_force(filaments, system, diameter, stiffness))
    positions, chosen = positions._value, generator.choice(draws, copies, p=weights)
    nodes, controls = (np.array(own) for own in (filaments.node_indices, filaments.control_point_indices))
    origins = np.zeros((copies, 1, 3))
    origins[:, 0, 2] = 1000.0 * np.arange(copies)
    for side, own in enumerate(drawn):
        for particles, placed in zip((nodes, controls), own):
            positions[particles[side::2]] = placed[chosen] + origins
    step = filaments.recommended_time_step(system=system)
    integrator = filaments.create_integrator(system, step, random_seed=4)
    context = new_context(system, positions, integrator, "CPU")
    context.computeVirtualSites()
    integrator.step(20)
    measured = []
    for _ in range(samples):
        integrator.step(10)
        now = positions_of(context)
        measured.append(measure(*((now[nodes[i::2]], now[controls[i::2]]) for i in (0, 1))))
    least, above = nearest_of(*((now[nodes[i::2]], now[controls[i::2]]) for i in (0, 1)))
    assert np.mean(above) > 0.98 and np.min(least) > 0.5 * diameter
    means = np.mean(measured, axis=0)
    found, error = means.mean(axis=1), np.hypot(means.std(axis=1, ddof=1) / np.sqrt(copies), errors)
    print(found, expected, error, step.step, integrator.getNumDividedSteps() / (2 * copies * 10 * samples))
    assert np.all(error < 0.0125 * expected)
    assert np.all(np.abs(found - expected) < SIGMAS * error + 0.01 * expected)
    # Without the contact, the two would be as near as the springs are.
    assert expected[0] > 1.5 * depth


def test_what_is_refused():
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine="compiled")
    filaments.add_straight(BEAM, 3, [0, 0, 0], [1, 0, 0])
    filaments.add_straight(BEAM, 3, [0, 100, 0], [1, 0, 0])
    filaments.add_beads(0, 62.5)
    _, system, positions = filaments.build()
    with pytest.raises(InputError, match=r"Filament 1 \(BEAM\) has beam elements.*filaments.add_beads\(1, 62.5\)"):
        capsule_contact_force(filaments, system, 30.0)
    # Of the engine's own: capsules between nodes are not on the curve.
    from openmm_cylchain.engines.compiled import plugin

    force = plugin.CylinderChainContactForce(1.0)
    force.addChain([int(node) for node in filaments.node_indices[1]], 8.0, 1)
    system.addForce(force)
    with pytest.warns(TimeStepWarning, match="explicit because of the place between particles"):
        integrator = filaments.create_integrator(system, 1e4)
    with pytest.raises(openmm.OpenMMException, match="contacts of this plugin between their nodes"):
        new_context(system, positions, integrator)


@pytest.mark.parametrize("piconewton", [1e5, 1e6])
def test_beams_that_are_torn_through_each_other_end_in_an_error_that_names_them(piconewton):
    """Also where the first iteration leads to no finite place."""
    kind = replace(F_ACTIN.with_segment_length(100), element="beam", extension_relaxation_time=None)
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine="compiled")
    for start, direction in (([0, 0, 0], [1, 0, 0]), ([300, -300, 40], [0, 1, 0])):
        filaments.add_beads(filaments.add_straight(kind, 6, start, direction), 25)
    _, system, positions = filaments.build()
    system.addForce(capsule_contact_force(filaments, system, DIAMETER, STIFFNESS))
    pull = openmm.CustomExternalForce("-f*z")
    pull.addGlobalParameter("f", 0.6022 * piconewton)
    pull.addParticle(int(filaments.node_indices[0][3]))
    system.addForce(pull)
    integrator = filaments.create_integrator(system, 1e6, random_seed=1, checks=False)
    context = new_context(system, positions, integrator, "CPU")
    before = positions_of(context)
    reasons = "it would pass through|equations cannot be solved|its contact with element . of filament . "
    with pytest.raises(InstabilityError, match=f"Filament 0 .*({reasons})"):
        integrator.step(20)
    assert np.isfinite(positions_of(context)).all()
    assert np.abs(positions_of(context) - before).max() < 1e3
