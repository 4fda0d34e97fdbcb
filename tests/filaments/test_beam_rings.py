"""Rings of beam elements as filaments: circles, places on the last element, couplings, flow, and what is written."""

from dataclasses import replace

import mdtraj
import numpy as np
import openmm
import pytest
from openmm import unit

from openmm_cylchain import (
    Crosslinker,
    Crosslinks,
    Filaments,
    Flow,
    Hand,
    InputError,
    Joints,
    RunReporter,
    Slab,
    analysis,
    capsule_contact_force,
    check_time_step,
    filament_wall_force,
    make_whole,
)
from openmm_cylchain.beams.curve import arc_lengths, curve_points, element_energies, element_points
from openmm_cylchain.cli import main
from openmm_cylchain.mechanics.geometry import unrolled
from openmm_cylchain.output.reporters import FilamentReporter
from support.contexts import close_reporters, energy_of, forces_of, new_context, new_simulation, positions_of, slopes_of
from support.linked_beams import BEAM, LENGTH
from support.linker_contexts import PICONEWTON, SECOND
from support.solvent import KT, TEMPERATURE, VISCOSITY

ELEMENTS = 6
SIGMAS = 4.0


def curve_of(filaments, positions, number=0):
    return positions[filaments.node_indices[number]], positions[filaments.control_point_indices[number]]


@pytest.mark.parametrize("elements", [4, 9])
def test_rings_begin_as_circles_at_rest(elements):
    filaments = Filaments(VISCOSITY, 0.0, engine="compiled")
    number = filaments.add_ring(BEAM, elements, [1, 2, 3] * unit.micrometer, [1, -2, 2])
    own = filaments[number]
    assert own.closed and own.segments == elements
    radii = curve_points(own.positions, own.control_points, 12, closed=True) - [1000, 2000, 3000]
    normal = np.array([1.0, -2.0, 2.0]) / 3.0
    assert radii @ normal == pytest.approx(np.zeros(len(radii)), abs=1e-9)
    radius = elements * LENGTH / (2.0 * np.pi)
    assert np.linalg.norm(radii, axis=1) == pytest.approx(np.full(len(radii), radius), rel=0.02 * (4 / elements) ** 4)
    assert np.all(np.cross(radii, np.roll(radii, -1, axis=0)) @ normal > 0.0)
    stretching, bending = own.energies(own.positions, own.control_points, 0.0)
    # pi EI/R of the circle with the length at rest.
    assert bending == pytest.approx(np.pi * own.beam_element(0.0).rigidity / radius, rel=1e-9)
    assert stretching < 1e-9 * bending
    for given in (filaments.add_nodes(BEAM, own.positions, closed=True), number):
        tangents = filaments[given].control_points - filaments[given].positions
        assert np.linalg.norm(tangents, axis=1) == pytest.approx(LENGTH / 3.0)
    with pytest.raises(InputError, match="at least 4 segments, but has 3"):
        filaments.add_ring(BEAM, 3, [0, 0, 0])
    with pytest.raises(InputError, match="must have the same z|is planar"):
        filaments.add_ring(BEAM, 5, [0, 0, 0], [1, 0, 0], planar=True)


def test_the_spline_of_a_ring_is_periodic():
    """It does not matter which node is the first; through points of a circle, tangents are those of the circle."""
    angles = 2.0 * np.pi * np.arange(8) / 8
    circle = 300.0 * np.stack([np.cos(angles), np.sin(angles), np.zeros(8)], axis=1)
    scattered = circle + np.random.default_rng(1).normal(0.0, 20.0, circle.shape)
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine="compiled")
    for nodes in (circle, scattered, np.roll(scattered, 3, axis=0)):
        filaments.add_nodes(BEAM, nodes, closed=True)
    tangents = (filaments[0].control_points - circle) * 3.0 / LENGTH
    assert tangents == pytest.approx(np.stack([-np.sin(angles), np.cos(angles), np.zeros(8)], axis=1), abs=1e-9)
    assert np.roll(filaments[1].control_points, 3, axis=0) == pytest.approx(filaments[2].control_points)


def coupled(turn, periodic=False):
    """Two bent rings with all that filaments may have, most of it at the last element and the first node.

    ``turn`` tells from which node on the nodes of both are counted.
    """
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine="compiled")
    generator = np.random.default_rng(1)
    for number in range(2):
        shape = Filaments(VISCOSITY, TEMPERATURE, engine="compiled")
        shape.add_ring(BEAM, ELEMENTS, [0, 30.0 * number, 18.0 * number])
        nodes = shape[0].positions + generator.normal(0.0, 8.0, (ELEMENTS, 3))
        controls = shape[0].control_points + generator.normal(0.0, 8.0, (ELEMENTS, 3))
        filaments.add_nodes(
            BEAM,
            np.roll(nodes, turn, axis=0),
            closed=True,
            control_points=np.roll(controls, turn, axis=0),
            propulsion=0.02 if number else 0.0,
        )

    def place(number, segment, fraction):
        return filaments.segment_place(number, segment=(segment + turn) % ELEMENTS, fraction=fraction)

    filaments.add_tether(0, turn % ELEMENTS, filaments[0].positions[turn] + [0, 0, 20.0], 0.5)
    filaments.add_attachment(1, segment=(ELEMENTS - 1 + turn) % ELEMENTS, fraction=0.3)
    for number in range(2):
        filaments.add_beads(number, LENGTH / 5)
    box = 4000.0 * np.eye(3) if periodic else None
    _, system, positions = filaments.build(box)
    links, joints = Crosslinks(0.2, 20.0), Joints(100.0)
    last = ELEMENTS - 1
    node = int(filaments.node_indices[1][(last + turn) % ELEMENTS])
    links.add_many(
        None,
        [
            (place(0, last, 0.4), place(1, last, 0.5)),
            (place(0, last, 0.9), [230.0, -60.0, 60.0]),
            (node, place(0, 0, 0.1)),
        ],
    )
    joints.add(None, place(0, last, 0.6), place(1, 2, 0.2))
    joints.add(None, place(0, last, 1.0), [0, 1, 1], angle=0.7)
    links.add_to(system, 1, periodic)
    joints.add_to(system, 2)
    contacts = capsule_contact_force(filaments, system, 24.0, 0.3)
    contacts.setForceGroup(3)
    wall = filament_wall_force(filaments, system, Slab([0, 0, 5.0], [0, 0, 1], 20.0), 0.02, radius=5.0)
    wall.setForceGroup(4)
    pull = openmm.CustomExternalForce("0.01*((x-300)^2+y^2+z^2)/2")
    pull.addParticle(int(filaments.attachment_indices[0]))
    pull.setForceGroup(5)
    for force in (contacts, wall, pull):
        system.addForce(force)
    return filaments, system, positions._value, links


@pytest.mark.parametrize("platform", ["Reference", "CPU"])
def test_forces_of_all_couplings_are_differences_of_their_energies(platform):
    filaments, system, positions, _ = coupled(0)
    context = new_context(system, positions, platform=platform)
    moved = [int(p) for own in (*filaments.node_indices, *filaments.control_point_indices) for p in own]
    for group in range(1, 6):
        assert energy_of(context, 1 << group) != 0.0
    everything = (1 << 6) - 2
    slopes = slopes_of(context, positions, moved, everything)
    context.setPositions(positions)
    context.computeVirtualSites()
    forces = forces_of(context, everything)
    assert forces[moved] == pytest.approx(-slopes, abs=1e-4)
    last = filaments.segment_place(0, segment=ELEMENTS - 1, fraction=0.5)
    assert np.any(forces[[last.first, last.second]])


def test_it_does_not_matter_which_node_is_the_first():
    """Steps without noise of two rings with links, joints, contacts, a wall, a tether, propulsion and a flow."""
    flow = Flow(velocity=[1e-7, 0, 0], gradient=1e-9 * np.array([[0, 1, 0], [0.3, 0, 0], [0, 0, 0]]))
    ends = []
    for turn in (0, 1, 4):
        filaments, system, positions, links = coupled(turn)
        integrator = filaments.create_integrator(system, 3e4, temperature=0.0, flow=flow, checks=False)
        context = new_context(system, positions, integrator)
        integrator.step(6)
        after = positions_of(context)
        own = [np.roll(part, -turn, axis=0) for number in range(2) for part in curve_of(filaments, after, number)]
        ends.append(np.concatenate([*own, after[filaments.attachment_indices[:1]], [links.lengths(context)]]))
    start = np.concatenate([part for number in range(2) for part in curve_of(filaments, positions, number)])
    assert np.abs(ends[2][: len(start)] - start).max() > 15.0
    for other in ends[1:]:
        # Iterations of coupled filaments end when what is left is this small.
        assert other == pytest.approx(ends[0], abs=0.01)


@pytest.mark.sample("100")
@pytest.mark.parametrize("stiffness", [0.1, 100.0])
def test_links_of_last_elements_have_their_energy(stiffness):
    """3/2 k_B T in a link without a rest length, whatever the shapes of the two rings that it joins, and in a tether.

    Bends and strains are those of rings that are free.
    """
    count, energies, bends = 48, [], []
    kind = replace(BEAM, bending_rigidity=None, persistence_length=2500.0, temperature=TEMPERATURE)
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine="compiled")
    for number in range(count):
        for side in range(2):
            filaments.add_ring(kind, 4, [0, 0, 1e4 * number], [0, side, 1 - side])
        point = filaments[2 * number].positions[0]
        filaments.add_tether(2 * number, 0, point, stiffness)
    for number in range(count):
        filaments.add_ring(kind, 4, [0, 5e4, 1e4 * number])
    _, system, positions = filaments.build()
    links = Crosslinks(stiffness, 0.0)
    for number in range(count):
        links.add(None, *(filaments.segment_place(2 * number + side, segment=3, fraction=0.4) for side in range(2)))
    links.add_to(system)
    step = filaments.recommended_time_step(system=system)
    integrator = filaments.create_integrator(system, step, random_seed=3)
    context = new_context(system, positions, integrator, "CPU")
    nodes = np.array(filaments.node_indices)
    controls, points = np.array(filaments.control_point_indices), np.array([own.point for own in filaments.tethers])
    element = filaments[0].beam_element(TEMPERATURE)
    integrator.step(300)
    for _ in range(300):
        integrator.step(2)
        now = positions_of(context)
        tethers = np.sum((now[nodes[: 2 * count : 2, 0]] - points) ** 2, axis=1)
        energies.append(0.5 * stiffness / KT * np.array([links.lengths(context) ** 2, tethers]))
        bends.append(element_energies(now[nodes], now[controls], element, closed=True)[1].sum(axis=1) / KT)
    for own in np.mean(energies, axis=0):
        error = own.std(ddof=1) / np.sqrt(count)
        assert error < 0.0125 * 1.5
        assert own.mean() == pytest.approx(1.5, abs=SIGMAS * error)
    bends = np.mean(bends, axis=0)
    linked, free = bends[: 2 * count : 2] + bends[1 : 2 * count : 2], 2.0 * bends[2 * count :]
    error = np.hypot(linked.std(ddof=1), free.std(ddof=1)) / np.sqrt(count)
    # Of what fluctuates: 4 n - 6 bends of each ring.
    assert error < 0.0125 * 10.0
    assert linked.mean() == pytest.approx(free.mean(), abs=SIGMAS * error)


def test_stiff_rings_turn_with_a_flow_and_by_their_propulsion():
    """A ring in its plane turns by half the vorticity, and one that propels itself glides at F0/(friction along it)."""
    stiff = replace(BEAM, persistence_length=None, bending_rigidity=1e8 * KT)
    rate, step, steps = 1e-9, 2e7, 10
    for propulsion, flow in ((0.0, Flow.shear(rate, [1, 0, 0], [0, 1, 0])), (0.3, Flow())):
        filaments = Filaments(VISCOSITY, TEMPERATURE, engine="compiled")
        filaments.add_ring(stiff, 12, [0, 0, 0], planar=True, propulsion=propulsion)
        _, system, positions = filaments.build()
        integrator = filaments.create_integrator(system, step, temperature=0.0, flow=flow, checks=False)
        context = new_context(system, positions, integrator)
        integrator.step(steps)
        nodes, _ = curve_of(filaments, positions_of(context))
        first = positions._value[filaments.node_indices[0]]
        assert nodes.mean(axis=0) == pytest.approx(np.zeros(3), abs=0.1)
        friction, radius = stiff.segment_friction(VISCOSITY, TEMPERATURE, 12), np.linalg.norm(first[0])
        angle = steps * step * (propulsion / friction.parallel / radius if propulsion else -0.5 * rate)
        assert 0.05 < abs(angle) < 2.0
        expected = first @ np.array([[np.cos(angle), np.sin(angle), 0], [-np.sin(angle), np.cos(angle), 0], [0, 0, 1]])
        assert np.linalg.norm(nodes - expected, axis=1).max() < 0.01 * abs(angle) * radius


def test_motors_walk_around_a_ring():
    """A hand that walks comes back to where it began: along the last element, and from there to the first node."""
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine="compiled")
    filaments.add_ring(BEAM, 4, [0, 0, 0], clamped=[0, 1, 2, 3], clamped_tangents=[0, 1, 2])
    hand = Hand(
        binding_rate=1e5 / SECOND, reach=200.0, unbinding_rate=0.0, speed=1e6 / SECOND, stall_force=1e9 * PICONEWTON
    )
    motors = Crosslinker(hands=hand, stiffness=1e-12 * PICONEWTON)
    filaments.add_linkers(motors, count=200, volume=1e9, bound=200, seed=1)
    _, system, positions = filaments.build()
    step = 2e-6 * SECOND
    integrator = filaments.create_integrator(system, step, random_seed=1, checks=False)
    context = new_context(system, positions, integrator)
    here = filaments.in_context(context)
    before = here.linkers()
    integrator.step(300)
    after = here.linkers()
    length = 4 * LENGTH
    bound = before.bound & after.bound
    assert np.count_nonzero(bound) >= 200
    moved = (after.arc_lengths - before.arc_lengths)[bound] % length
    # 300 steps of 2 nm.
    assert moved == pytest.approx(np.full(len(moved), 600.0), abs=1e-6)
    assert np.count_nonzero(after.arc_lengths[bound] < before.arc_lengths[bound]) > 60


def test_what_is_written_and_read_of_a_ring(tmp_path):
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine="compiled")
    filaments.add_ring(BEAM, ELEMENTS, [0, 0, 0])
    filaments.add_equilibrium(BEAM, 2, seed=1, start=[0, 0, 300])
    filaments.add_attachment(0, segment=-1, fraction=0.25)
    topology, system, positions = filaments.build()
    links = Crosslinks(0.1, 20.0)
    links.add(
        None, filaments.segment_place(0, segment=ELEMENTS - 1, fraction=0.3), filaments.segment_place(1, segment=1)
    )
    links.add_to(system, 4)
    bonds = {tuple(sorted(atom.index for atom in bond)) for bond in topology.bonds()}
    assert (0, ELEMENTS - 1) in bonds and len(bonds) == ELEMENTS + 2
    integrator = filaments.create_integrator(system, filaments.recommended_time_step(system=system), random_seed=1)
    simulation = new_simulation(topology, system, positions, integrator)
    reporter = FilamentReporter(None, 10, filaments)
    simulation.reporters += [RunReporter(tmp_path / "run", 10, filaments, "ring"), reporter]
    simulation.step(40)
    after, lengths = positions_of(simulation.context), links.lengths(simulation.context)
    close_reporters(simulation)
    nodes, controls = curve_of(filaments, after)
    vectors = np.roll(nodes, -1, axis=0) - nodes
    assert np.linalg.norm(vectors, axis=1).min() > 0.8 * LENGTH
    # The attachment is a quarter of the way from the last node to the first.
    around = [np.concatenate([own, own[:1]]) for own in (nodes, controls)]
    place = element_points(*around, [0.25])[-1, 0]
    assert after[filaments.attachment_indices[0]] == pytest.approx(place, abs=1e-9)
    element = filaments[0].beam_element(TEMPERATURE)
    energies = [part.sum() for part in element_energies(nodes, controls, element, closed=True)]
    assert reporter["stretching_energy"][-1, 0] == pytest.approx(energies[0])
    assert reporter["bending_energy"][-1, 0] == pytest.approx(energies[1])
    assert reporter["end_to_end_distance"][-1, 0] == 0.0
    assert reporter["contour_length"][-1, 0] == pytest.approx(arc_lengths(nodes, controls, closed=True).sum())
    run = analysis.load(tmp_path / "run")
    assert run.filaments[0].ring and run.filaments[0].segments == ELEMENTS
    assert run.curves(-1)[0] == pytest.approx(curve_points(nodes, controls, 8, closed=True), abs=1e-3)
    assert [len(part[0]) for part in (run.bends(-1), run.segment_tensions(-1))] == [ELEMENTS, ELEMENTS]
    tangents = (controls - nodes) / np.linalg.norm(controls - nodes, axis=1, keepdims=True)
    angles = np.arccos(np.sum(tangents * np.roll(tangents, -1, axis=0), axis=1))
    assert run.bends(-1)[0] == pytest.approx(angles, abs=1e-3)
    found = run.crosslinks(-1)
    assert np.linalg.norm(found.places[0, 1] - found.places[0, 0]) == pytest.approx(lengths[0], abs=1e-3)
    _check_stress(run, system, filaments)
    trajectory = mdtraj.load(str(tmp_path / "run" / "trajectory.dcd"), top=str(tmp_path / "run" / "topology.cif"))
    assert analysis.segment_lengths(trajectory)[0][-1] == pytest.approx(
        arc_lengths(nodes, controls, closed=True), rel=1e-4
    )
    assert analysis.filament_curves(trajectory)[0].shape[1] == 8 * ELEMENTS
    # Pictures and exports, and the box that a trajectory was wrapped into.
    for name in ("vmd", "simularium", "ovito"):
        suffix = {"vmd": "tcl", "simularium": "simularium", "ovito": "gsd"}[name]
        assert main(["export", str(tmp_path / "run"), "--format", name, "--output", str(tmp_path / f"a.{suffix}")]) == 0
    assert main(["render", str(tmp_path / "run"), "--output", str(tmp_path / "a.png"), "--color", "bending"]) == 0
    box = 2000.0 * np.eye(3)
    torn = after + 2000.0 * np.floor(np.random.default_rng(1).normal(0.0, 2.0, after.shape))
    whole = make_whole(torn, filaments, box)._value
    own, _ = curve_of(filaments, whole)
    assert own - own[0] == pytest.approx(nodes - nodes[0], abs=1e-6)
    assert whole[filaments.attachment_indices[0]] - own[0] == pytest.approx(place - nodes[0], abs=1e-6)


def test_contacts_of_a_run_name_the_last_element(tmp_path):
    """A ring of four elements of five pieces each, and a filament that crosses the element that closes it."""
    filaments = Filaments(VISCOSITY, 0.0, engine="compiled")
    filaments.add_ring(BEAM, 4, [0, 0, 0])
    place = element_points(unrolled(filaments[0].positions), unrolled(filaments[0].control_points), [0.3])[-1, 0]
    filaments.add_straight(BEAM, 2, place + [0, 0, 15.0 - LENGTH], [0, 0, 1])
    for number in range(2):
        filaments.add_beads(number, LENGTH / 5)
    topology, system, positions = filaments.build()
    system.addForce(capsule_contact_force(filaments, system, 24.0, 0.3))
    simulation = new_simulation(topology, system, positions, filaments.create_integrator(system, 1.0))
    simulation.reporters.append(RunReporter(tmp_path / "run", 1, filaments))
    simulation.step(1)
    close_reporters(simulation)
    found = analysis.load(tmp_path / "run").contacts(0)
    ring = found.filaments == 0
    assert np.count_nonzero(ring) >= 1 and np.all(found.segments[ring] == 3)
    assert found.fractions[ring] == pytest.approx(np.full(np.count_nonzero(ring), 0.3), abs=0.02)


def _check_stress(run, system, filaments):
    context = new_context(system, run.positions(-1))
    positions, forces = positions_of(context), forces_of(context, 1)
    particles = np.concatenate([*filaments.node_indices, *filaments.control_point_indices])
    virial = -np.einsum("ni,nj->ij", positions[particles], forces[particles])
    assert analysis.stress(run, -1, 1e9).chains * 1e9 == pytest.approx(
        virial, rel=1e-3, abs=1e-3 * np.abs(virial).max()
    )


def test_steps_of_rings():
    """The oval mode must be resolved, (L/10.9)^4 zeta/EI; springs and the check of a step know the last element."""
    stiff = replace(BEAM, persistence_length=None, bending_rigidity=1e6 * KT)
    steps = []
    for closed in (False, True):
        filaments = Filaments(VISCOSITY, TEMPERATURE, engine="compiled")
        if closed:
            filaments.add_ring(stiff, 8, [0, 0, 0])
        else:
            filaments.add_straight(stiff, 8, [0, 0, 0], [1, 0, 0])
        steps.append(filaments.recommended_time_step().step)
    assert steps[1] / steps[0] == pytest.approx((4.73 / 10.88) ** 4)
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine="compiled")
    for number in range(2):
        filaments.add_ring(BEAM, 5, [0, 0, 600.0 * number])
        filaments.add_attachment(number, segment=4 - 2 * number, fraction=0.5)
    _, system, positions = filaments.build()
    bounds = []
    for number in range(2):
        spring = openmm.CustomExternalForce("5*(x^2+y^2+z^2)")
        spring.addParticle(int(filaments.attachment_indices[number]))
        own = openmm.XmlSerializer.clone(system)
        own.addForce(spring)
        bounds.append(filaments.recommended_time_step(system=own).step)
    # Any element of a ring is as good as another.
    assert bounds[0] == pytest.approx(bounds[1]) and bounds[0] < filaments.recommended_time_step().step
    check = check_time_step(filaments, system, positions, filaments.recommended_time_step(), frames=40)
    names = [one.name for one in check.observables]
    assert any("across, mean square" in name for name in names) and not any("mode" in name for name in names)
