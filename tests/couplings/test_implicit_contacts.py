"""Contacts in the equations of implicit steps of 10 us: what may not cross, what is refused, the same to the bit."""

import itertools

import numpy as np
import openmm
import pytest
from openmm import unit

from openmm_cylchain import (
    F_ACTIN,
    ContactWarning,
    Crosslinks,
    Filaments,
    Flow,
    InstabilityError,
    SegmentPlace,
    capsule_contact_force,
)
from openmm_cylchain.analysis.crossings import CrossingCounter
from openmm_cylchain.engine_choice import load_plugin
from support.contexts import new_context, positions_of
from support.solvent import KT, TEMPERATURE, VISCOSITY

ACTIN = F_ACTIN.with_segment_length(100)
DIAMETER = 30.0
STIFFNESS = 80 * KT / DIAMETER**2
PICONEWTON = 0.60221408
# In a step of 10 us two segments diffuse against each other by 0.6 diameters.
LARGEST_STEP = 1e7


def _context(filaments, system, positions, step, threads=1, seed=1, **options):
    integrator = filaments.create_integrator(system, step, random_seed=seed, checks=False, **options)
    return new_context(system, positions, integrator, "CPU", {"Threads": str(threads)})


def _count_crossings(filaments, context, steps, box=None):
    counter = CrossingCounter(filaments, positions_of(context), box)
    for _ in range(steps):
        context.getIntegrator().step(1)
        counter.update(positions_of(context))
    return counter.count


def _dense(count=20, edge=500.0, seed=1):
    """Filaments of 5 segments at random in a box, which overlap where they are drawn on top of each other."""
    generator = np.random.default_rng(seed)
    filaments = Filaments(VISCOSITY, TEMPERATURE)
    for number in range(count):
        filaments.add_equilibrium(ACTIN, 5, seed=number + 1, start=generator.uniform(0, edge, 3))
    box = edge * np.eye(3)
    _, system, positions = filaments.build(box_vectors=box)
    system.addForce(capsule_contact_force(filaments, system, DIAMETER, STIFFNESS))
    return filaments, system, positions, box


def _grow_step(context, step):
    integrator = context.getIntegrator()
    for fraction, steps in ((1e-4, 200), (1e-3, 100), (1e-2, 100), (1e-1, 50)):
        integrator.setStepSize(fraction * step)
        integrator.step(steps)
    integrator.setStepSize(step)
    integrator.step(50)


def test_dense_filaments_do_not_cross_at_the_largest_step():
    filaments, system, positions, box = _dense()
    context = _context(filaments, system, positions, LARGEST_STEP)
    _grow_step(context, LARGEST_STEP)
    assert _count_crossings(filaments, context, 600, box) == 0
    # Below 1 %.
    assert context.getIntegrator().getNumDividedSteps() < 120


def test_contacts_of_explicit_force_groups_push_with_the_force_of_the_start():
    """Two parallel rods without noise that overlap by d/2: each moves by F dt/zeta, however long the step."""
    filaments = Filaments(VISCOSITY, TEMPERATURE)
    for y in (0.0, DIAMETER / 2):
        filaments.add_straight(ACTIN, 1, start=(0, y, 0), direction=(1, 0, 0))
    _, system, positions = filaments.build()
    system.addForce(capsule_contact_force(filaments, system, DIAMETER, STIFFNESS))
    system.getForce(system.getNumForces() - 1).setForceGroup(3)
    friction = ACTIN.segment_friction(VISCOSITY, TEMPERATURE, 1).perpendicular
    # With its force at the start, the gap grows by twice the overlap.
    step = 2 * friction / (2 * STIFFNESS)
    integrator = filaments.create_integrator(system, step, random_seed=1, checks=False)
    integrator.setTemperature(0)
    integrator.setExplicitForceGroups(1 << 3)
    read = openmm.XmlSerializer.deserialize(openmm.XmlSerializer.serialize(integrator))
    assert load_plugin().CylinderChainIntegrator.cast(read).getExplicitForceGroups() == 1 << 3
    context = new_context(system, positions, integrator, "Reference", {})
    integrator.step(1)
    nodes = positions_of(context)
    np.testing.assert_allclose(nodes[2:, 1] - nodes[:2, 1], DIAMETER / 2 + 2 * DIAMETER / 2, rtol=1e-6)
    # In the equations, it cannot come farther apart than it touches.
    context.setPositions(positions)
    integrator.setExplicitForceGroups(0)
    integrator.step(1)
    nodes = positions_of(context)
    assert np.all(nodes[2:, 1] - nodes[:2, 1] < 1.01 * DIAMETER)


def _steps_of_pairs(clump):
    """Displacements of two filaments that overlap a little, far from some that are drawn on top of each other."""
    generator = np.random.default_rng(1)
    filaments = Filaments(VISCOSITY, 0)
    filaments.add_straight(ACTIN, 5, [0, -250, -5000], [0, 1, 0])
    filaments.add_straight(ACTIN, 5, [20, 0, -5250], [0, 0, 1])
    for _ in range(clump):
        filaments.add_straight(ACTIN, 10, generator.uniform(0, 700, 3), generator.normal(size=3))
    _, system, positions = filaments.build()
    system.addForce(capsule_contact_force(filaments, system, DIAMETER, STIFFNESS))
    context = _context(filaments, system, positions, 5e6)
    context.getIntegrator().step(1)
    nodes = np.concatenate(filaments.node_indices[:2])
    return positions_of(context)[nodes] - positions._value[nodes], context.getIntegrator().getNumDividedSteps()


def test_contacts_that_a_step_takes_for_hard_are_those_around_what_failed():
    alone, _ = _steps_of_pairs(0)
    beside, divided = _steps_of_pairs(100)
    assert divided > 30
    assert np.abs(alone).max() > 1
    np.testing.assert_allclose(beside, alone, atol=1e-6)


# Restarts and threads: the same to the bit


def _mixed():
    """Filaments, a ring, a planar one, clamped and driven ones, a sphere, and crosslinks, in a small volume."""
    filaments = Filaments(VISCOSITY, TEMPERATURE)
    generator = np.random.default_rng(3)
    for number in range(12):
        filaments.add_equilibrium(ACTIN, 5, seed=number + 1, start=generator.uniform(0, 400, 3))
    filaments.add_straight(ACTIN, 4, [0, 0, 600], [1, 0, 0], clamped=[0, 1])
    filaments.add_straight(ACTIN, 4, [0, 50, 640], [1, 0, 0], propulsion=0.5)
    filaments.add_straight(ACTIN, 4, [0, 0, -300], [1, 0, 0], planar=True)
    filaments.add_straight(ACTIN, 4, [200, -150, -262], [0, 1, 0])
    filaments.add_ring(ACTIN, 12, [200, 200, 900])
    filaments.add_straight(ACTIN, 4, [180, 180, 700], [0, 0, 1])
    _, system, positions = filaments.build()
    sphere = system.addParticle(1.0)
    positions = np.vstack([positions._value, [100, 90, 640]])
    spheres = {"particles": [sphere], "particle_diameter": 40.0}
    system.addForce(capsule_contact_force(filaments, system, DIAMETER, STIFFNESS, **spheres))
    links = Crosslinks(stiffness=0.004, rest_length=0.0)
    nodes = filaments.node_indices
    for number in range(8):
        links.add(None, int(nodes[number][2]), int(nodes[number + 1][3]))
    links.add(None, SegmentPlace(int(nodes[12][2]), int(nodes[12][3]), 0.3), sphere)
    links.add_to(system)
    return filaments, system, positions


def _mixed_context(threads=1, step=2e6):
    filaments, system, positions = _mixed()
    flow = Flow.shear(1e-8)
    return _context(filaments, system, positions, step, threads, flow=flow, particle_friction=4e5)


def test_threads_change_no_bit():
    results, divided = [], []
    for threads in (1, 2, 3):
        context = _mixed_context(threads)
        context.getIntegrator().step(60)
        results.append(positions_of(context))
        divided.append(context.getIntegrator().getNumDividedSteps())
    assert np.array_equal(results[0], results[1]) and np.array_equal(results[0], results[2])
    assert divided[0] == divided[1] == divided[2]
    assert np.isfinite(results[0]).all()


def test_restarts_and_two_contexts_change_no_bit():
    context, other = _mixed_context(), _mixed_context()
    for one in (context, other):
        one.getIntegrator().step(20)
    checkpoint = context.createCheckpoint()
    context.getIntegrator().step(20)
    expected = positions_of(context)
    # The other Context goes on meanwhile, elsewhere on its path.
    other.getIntegrator().step(7)
    other.loadCheckpoint(checkpoint)
    other.getIntegrator().step(20)
    assert np.array_equal(positions_of(other), expected)
    context.loadCheckpoint(checkpoint)
    for _ in range(20):
        context.getIntegrator().step(1)
    assert np.array_equal(positions_of(context), expected)


def test_systems_and_integrators_from_xml_change_no_bit():
    context = _mixed_context()
    copied = [
        openmm.XmlSerializer.deserialize(openmm.XmlSerializer.serialize(one))
        for one in (context.getSystem(), context.getIntegrator())
    ]
    restored = new_context(copied[0], positions_of(context), copied[1], "CPU", {"Threads": "1"})
    for one in (context, restored):
        one.getIntegrator().step(20)
    assert np.array_equal(positions_of(context), positions_of(restored))


def test_contacts_that_nothing_touches_change_little():
    """Far from each other, filaments move as without contacts but for where Newton's method ends."""
    results = []
    for contacts in (False, True):
        filaments = Filaments(VISCOSITY, TEMPERATURE)
        for number in range(9):
            filaments.add_equilibrium(ACTIN, 4, seed=number + 1, start=[2000 * number, 0, 0])
        _, system, positions = filaments.build()
        if contacts:
            system.addForce(capsule_contact_force(filaments, system, DIAMETER, STIFFNESS))
        context = _context(filaments, system, positions, LARGEST_STEP, precision="double")
        context.getIntegrator().step(5)
        results.append(positions_of(context))
    assert np.abs(results[0] - results[1]).max() < 0.02


def _pressed_together(order, step):
    """Where 90 filaments that overlap are after three steps without noise, by their numbers in the order of one run."""
    generator = np.random.default_rng(3)
    starts, directions = generator.uniform(0, 900, (90, 3)), generator.normal(size=(90, 3))
    filaments = Filaments(VISCOSITY, 0)
    for number in order:
        filaments.add_straight(ACTIN, 5, starts[number], directions[number])
    _, system, positions = filaments.build()
    system.addForce(capsule_contact_force(filaments, system, DIAMETER, STIFFNESS))
    context = _context(filaments, system, positions, step)
    context.getIntegrator().step(3)
    assert context.getIntegrator().getNumDividedSteps() == 0
    return positions_of(context)[np.array(filaments.node_indices)][np.argsort(order)]


@pytest.mark.parametrize("step", [3e4, 1e5])
def test_filaments_that_have_converged_before_others_go_where_they_would_with_these(step):
    """Which filaments rest while others go on depends on who shares a vector of the processor: on their order."""
    first = _pressed_together(np.arange(90), step)
    other = _pressed_together(np.random.default_rng(1).permutation(90), step)
    assert np.abs(first - other).max() < 1e-6


# Where steps go wrong


def _dropped(force, seed):
    """A filament that falls onto another one that is clamped, with a force in pN."""
    filaments = Filaments(VISCOSITY, TEMPERATURE)
    filaments.add_straight(ACTIN, 20, [-1000, 0, 0], [1, 0, 0], clamped=[0, 1, 19, 20])
    filaments.add_straight(ACTIN, 20, [50, -1000, 45], [0, 1, 0])
    _, system, positions = filaments.build()
    system.addForce(capsule_contact_force(filaments, system, DIAMETER, STIFFNESS))
    weight = openmm.CustomExternalForce(f"{force * PICONEWTON / 21}*z")
    for node in filaments.node_indices[1]:
        weight.addParticle(int(node))
    system.addForce(weight)
    return filaments, _context(filaments, system, positions, LARGEST_STEP, seed=seed)


@pytest.mark.parametrize("force", [2, 5, 10])
def test_a_filament_that_is_dropped_onto_another_stays_above(force):
    """Forces in pN, below the 11.4 pN with which a contact pushes back at most."""
    filaments, context = _dropped(force, seed=1)
    assert _count_crossings(filaments, context, 200) == 0
    # It hangs there.
    assert positions_of(context)[filaments.node_indices[1], 2].min() < -100


@pytest.mark.parametrize("step", [LARGEST_STEP, 10 * LARGEST_STEP])
@pytest.mark.parametrize(
    "start, direction",
    [([0, 0, 0], [1, 0, 0]), ([500, 0, 0], [-1, 0, 0]), ([30, 0, 0], [1, 0, 0]), ([0, 5, 0], [1, 0, 0])],
)
def test_filaments_on_top_of_each_other_come_apart(step, start, direction):
    filaments = Filaments(VISCOSITY, TEMPERATURE)
    filaments.add_straight(ACTIN, 5, [0, 0, 0], [1, 0, 0])
    filaments.add_straight(ACTIN, 5, start, direction)
    _, system, positions = filaments.build()
    contacts = capsule_contact_force(filaments, system, DIAMETER, STIFFNESS)
    contacts.setForceGroup(1)
    system.addForce(contacts)
    context = _context(filaments, system, positions, step)
    context.getIntegrator().step(50)
    energy = context.getState(energy=True, groups={1}).getPotentialEnergy().value_in_unit(unit.kilojoule_per_mole)
    assert np.isfinite(positions_of(context)).all()
    assert energy < 10 * KT


def test_filaments_do_not_cross_at_joints():
    """Above the force of a contact a filament may be stopped, or pass with an error; never unnoticed."""
    for seed in range(1, 7):
        filaments, context = _dropped(20, seed)
        try:
            assert _count_crossings(filaments, context, 100) == 0, seed
        except InstabilityError:
            pass


def test_errors_name_both_segments_of_a_contact():
    """A filament is torn through another one by more than a contact can hold."""
    filaments = Filaments(VISCOSITY, TEMPERATURE)
    filaments.add_straight(ACTIN, 4, [0, 0, 9000], [1, 0, 0])
    filaments.add_straight(ACTIN, 20, [-1000, 0, 0], [1, 0, 0], clamped=[0, 1, 19, 20])
    filaments.add_straight(ACTIN, 20, [50, -1050, 45], [0, 1, 0])
    _, system, positions = filaments.build()
    system.addForce(capsule_contact_force(filaments, system, DIAMETER, STIFFNESS))
    weight = openmm.CustomExternalForce(f"{300 * PICONEWTON / 21}*z")
    for node in filaments.node_indices[2]:
        weight.addParticle(int(node))
    system.addForce(weight)
    context = _context(filaments, system, positions, LARGEST_STEP)
    with pytest.raises(InstabilityError, match="would pass through segment .* of filament 2 .*ContactForce") as raised:
        context.getIntegrator().step(100)
    error = raised.value
    # Both filaments slide: it is the segments that were above each other before the step, or their neighbours.
    held, torn = (positions_of(context)[filaments.node_indices[filament]] for filament in (1, 2))
    above = np.argmin(np.abs(torn[1:, 1] + torn[:-1, 1]))
    below = np.argmin(np.abs(held[1:, 0] + held[:-1, 0] - torn[above, 0] - torn[above + 1, 0]))
    assert (error.filament, error.other_filament) == (1, 2)
    assert abs(error.segment - below) <= 1 and abs(error.other_segment - above) <= 1
    assert str(error).startswith(f"Filament 1 (ACT) has blown up at segment {error.segment} in step ")
    assert f"segment {error.other_segment} of filament 2" in str(error)
    assert error.step == context.getStepCount() + 1 > 1
    assert (error.link, error.particle) == (None, None)


def test_errors_name_a_link_and_its_force():
    filaments = Filaments(VISCOSITY, TEMPERATURE)
    for height in (0, 100):
        filaments.add_straight(ACTIN, 4, [0, 0, height], [1, 0, 0])
    _, system, positions = filaments.build()
    links = Crosslinks(stiffness=60, rest_length=0.1)
    links.add(None, 9, [400, 0, 100], rest_length=0.0)
    for segment in range(3):
        links.add(None, filaments.segment_place(0, segment=segment), filaments.segment_place(1, segment=segment))
    links.add_to(system)
    context = _context(filaments, system, positions, 1e10)
    what = "link . to segment . of filament 1 .ACT. (cannot be solved|would leave)"
    with pytest.raises(InstabilityError, match=what) as raised:
        context.getIntegrator().step(20)
    error = raised.value
    assert error.link in (1, 2, 3)
    assert (error.filament, error.other_filament) == (0, 1)
    assert error.segment == error.other_segment == error.link - 1
    assert "Crosslinks" in str(error)


# Periodic boxes that are narrow


def _in_a_narrow_box(edge):
    filaments = Filaments(VISCOSITY, TEMPERATURE)
    for row, column in itertools.product(range(3), range(3)):
        filaments.add_straight(ACTIN, 2, [10, 80 * row, 80 * column], [1, 0.1, 0])
    _, system, positions = filaments.build(box_vectors=edge * np.eye(3))
    system.addForce(capsule_contact_force(filaments, system, DIAMETER, STIFFNESS))
    return filaments, system, positions


def test_a_box_that_is_too_narrow_for_implicit_steps_is_refused():
    filaments, system, positions = _in_a_narrow_box(319.0)
    with pytest.raises(openmm.OpenMMException, match="319 nm wide .* 2 diameters, 320 nm"):
        _context(filaments, system, positions, LARGEST_STEP)
    # Others need less.
    context = _context(filaments, system, positions, 1e3, scheme="midpoint")
    context.getIntegrator().step(1)


def test_steps_are_divided_where_segments_move_too_far_for_the_box():
    filaments, system, positions = _in_a_narrow_box(320.0)
    context = _context(filaments, system, positions, 6 * LARGEST_STEP)
    context.getIntegrator().step(100)
    assert context.getIntegrator().getNumDividedSteps() > 0
    assert context.getStepCount() == 100


def test_a_box_that_shrinks_too_much_says_so():
    filaments, system, positions = _in_a_narrow_box(320.0)
    context = _context(filaments, system, positions, LARGEST_STEP)
    context.setPeriodicBoxVectors(*(200 * np.eye(3)))
    with pytest.raises(InstabilityError, match="moves too far for the periodic box"):
        context.getIntegrator().step(1)


def test_a_sphere_does_not_pass_through_a_row_of_rods():
    """It is pushed by 0.5 pN, by less than 18 nm in a step, onto a grid that is too narrow for it by far."""
    filaments = Filaments(VISCOSITY, TEMPERATURE)
    for row in range(-8, 9):
        filaments.add_straight(ACTIN, 4, [-200, 20 * row, 0], [1, 0, 0], clamped=[0, 1, 3, 4])
    _, system, positions = filaments.build()
    sphere = system.addParticle(1.0)
    positions = np.vstack([positions._value, [0, 10, 40]])
    spheres = {"particles": [sphere], "particle_diameter": 45.0}
    with pytest.warns(ContactWarning):
        system.addForce(capsule_contact_force(filaments, system, 15.0, STIFFNESS, **spheres))
    push = openmm.CustomExternalForce(f"{0.5 * PICONEWTON}*z+0.01*(x^2+y^2)")
    push.addParticle(sphere)
    system.addForce(push)
    for step, steps in ((LARGEST_STEP / 10, 1000), (LARGEST_STEP, 100)):
        context = _context(filaments, system, positions, step, particle_friction=2.9e5)
        for _ in range(steps // 50):
            context.getIntegrator().step(50)
            assert positions_of(context)[sphere, 2] > 0, step


@pytest.mark.parametrize("coupling", ["contacts", "links"])
@pytest.mark.parametrize(
    "planar, clamped, fixed",
    [
        (False, [0, 2, 4], [(0, None), (2, None), (4, None)]),
        (True, [], [(node, 2) for node in range(5)]),
    ],
)
def test_nodes_that_do_not_move_are_not_moved_by_couplings(coupling, planar, clamped, fixed):
    """Clamped nodes, and the height of those of planar filaments."""
    filaments = Filaments(VISCOSITY, TEMPERATURE)
    filaments.add_straight(ACTIN, 4, [0, 0, 0], [1, 0, 0], clamped=clamped, planar=planar)
    filaments.add_straight(ACTIN, 4, [150, -150, 20], [0, 1, 0], clamped=[0, 1, 3, 4])
    _, system, positions = filaments.build()
    if coupling == "contacts":
        system.addForce(capsule_contact_force(filaments, system, DIAMETER, STIFFNESS))
    else:
        links = Crosslinks(stiffness=0.1, rest_length=0.0)
        links.add(None, SegmentPlace(1, 2, 0.5), [150, 0, 50])
        links.add_to(system)
    context = _context(filaments, system, positions, LARGEST_STEP)
    context.getIntegrator().step(20)
    moved = positions_of(context) - positions._value
    assert np.abs(moved).max() > 1
    for node, axis in fixed:
        assert np.all(moved[node] == 0.0) if axis is None else moved[node, axis] == 0.0, (node, moved[node])


def _intersections(filaments, positions, edge):
    """Number of pairs of segments of different filaments in one plane that lie across each other."""
    nodes = filaments.node_indices
    starts = np.concatenate([positions[own[:-1], :2] for own in nodes])
    along = np.concatenate([np.diff(positions[own, :2], axis=0) for own in nodes])
    owner = np.repeat(np.arange(len(nodes)), [len(own) - 1 for own in nodes])
    count = 0
    for one, other in itertools.combinations(range(len(starts)), 2):
        if owner[one] == owner[other]:
            continue
        between = starts[other] - starts[one] + 0.5 * (along[other] - along[one])
        between -= edge * np.round(between / edge)
        between += 0.5 * (along[one] - along[other])
        p, q = along[one], along[other]
        area = p[0] * q[1] - p[1] * q[0]
        s = (between[0] * q[1] - between[1] * q[0]) / area
        t = (between[0] * p[1] - between[1] * p[0]) / area
        count += 0 < s < 1 and 0 < t < 1
    return count


def test_planar_filaments_stay_beside_each_other():
    """Rows of filaments in one plane, 120 nm apart: they diffuse, and do not lie across each other."""
    edge = 1200.0
    filaments = Filaments(VISCOSITY, TEMPERATURE)
    for row, column in itertools.product(range(10), range(2)):
        filaments.add_straight(ACTIN, 4, [100 + 600 * column, 30 + 120 * row, 0], [1, 0, 0], planar=True)
    _, system, positions = filaments.build(box_vectors=edge * np.eye(3))
    system.addForce(capsule_contact_force(filaments, system, DIAMETER, STIFFNESS))
    context = _context(filaments, system, positions, LARGEST_STEP, seed=1)
    for _ in range(4):
        context.getIntegrator().step(50)
        assert _intersections(filaments, positions_of(context), edge) == 0


@pytest.mark.parametrize("force", [0.5, 1.0])
def test_a_bead_that_is_pushed_does_not_go_through_a_taut_filament(force):
    """Forces in pN. The bead is held above the filament sideways, by more than what would let it slip off."""
    filaments = Filaments(VISCOSITY, TEMPERATURE)
    held = [node for node in range(21) if node != 10]
    filaments.add_straight(ACTIN, 20, [-1000, 0, 0], [1, 0, 0], clamped=held)
    _, system, positions = filaments.build()
    sphere = system.addParticle(1.0)
    positions = np.vstack([positions._value, [0, 0, 40]])
    spheres = {"particles": [sphere], "particle_diameter": DIAMETER}
    system.addForce(capsule_contact_force(filaments, system, DIAMETER, STIFFNESS, **spheres))
    push = openmm.CustomExternalForce(f"{force * PICONEWTON}*z+0.075*(x^2+y^2)")
    push.addParticle(sphere)
    system.addForce(push)
    context = _context(filaments, system, positions, LARGEST_STEP, particle_friction=2.9e6)
    heights = []
    for _ in range(400):
        context.getIntegrator().step(1)
        now = positions_of(context)
        heights.append(now[sphere, 2] - np.interp(now[sphere, 0], now[:21, 0], now[:21, 2]))
    assert min(heights) > 0
    # It lies on the filament.
    assert np.mean(heights[100:]) < 40


def _winding(ring, point):
    """How often a closed line goes around a point in the plane."""
    r = np.append(ring, ring[:1], axis=0) - point
    cross = r[:-1, 0] * r[1:, 1] - r[:-1, 1] * r[1:, 0]
    return round(np.sum(np.arctan2(cross, np.sum(r[:-1] * r[1:], axis=1))) / (2 * np.pi))


@pytest.mark.parametrize("seed", [1, 2])
def test_a_planar_filament_does_not_leave_a_planar_ring(seed):
    """It drives itself against the ring from within; counted by winding numbers and by passages of ends."""
    filaments = Filaments(VISCOSITY, TEMPERATURE)
    filaments.add_ring(ACTIN, 12, [0, 0, 0], planar=True)
    filaments.add_straight(ACTIN, 2, [-100, 0, 0], [1, 0, 0], planar=True, propulsion=2 * PICONEWTON / 100)
    _, system, positions = filaments.build()
    system.addForce(capsule_contact_force(filaments, system, DIAMETER, STIFFNESS))
    context = _context(filaments, system, positions, LARGEST_STEP / 2, seed=seed)
    ring, inner = filaments.node_indices
    height = positions._value[ring[0], 2]
    counter = CrossingCounter(filaments, positions_of(context))
    for _ in range(200):
        context.getIntegrator().step(1)
        now = positions_of(context)
        counter.update(now)
        assert np.all(now[:, 2] == height)
        assert all(abs(_winding(now[ring, :2], now[node, :2])) == 1 for node in inner)
    assert counter.count == 0
