"""Filaments of beam elements: what they are made of, draws, dynamics, statics, and what they cannot have as yet."""

from dataclasses import replace

import numpy as np
import openmm
import pytest
from openmm import unit

from openmm_cylchain import F_ACTIN, Filaments, FilamentType, InputError, InstabilityError, make_whole, theory
from openmm_cylchain.analysis import contour_lengths, end_to_end_vectors, joint_cosines, segment_lengths, tangents
from openmm_cylchain.beams.curve import arc_lengths, curve_points, element_energies, node_tangents
from openmm_cylchain.beams.equilibrium import calibrated_rigidity, mean_cosine
from openmm_cylchain.filaments.beam_elements import BEAM_ELEMENTS
from openmm_cylchain.output.reporters import FilamentReporter
from openmm_cylchain.time_steps.recommended_step import recommended_time_step
from support.contexts import energy_of, new_context, new_simulation, positions_of
from support.solvent import KT, TEMPERATURE, VISCOSITY

SIGMAS = 4.0
KIND = FilamentType(
    name="BEAM",
    diameter=6.0,
    segment_length=250.0,
    persistence_length=1000.0,
    temperature=TEMPERATURE,
    stretching_modulus=1e4,
    friction_length="filament",
    element="beam",
)


def filaments_of(kind, count, elements, temperature=TEMPERATURE, planar=False):
    filaments = Filaments(VISCOSITY, temperature, engine="compiled")
    for seed in range(count):
        filaments.add_equilibrium(kind, elements, seed=seed, planar=planar)
    return filaments


def curves_of(filaments, positions):
    """Nodes and control points, (filaments, nodes, 3) each."""
    return positions[np.array(filaments.node_indices)], positions[np.array(filaments.control_point_indices)]


def cosines_of(nodes, control_points, length):
    t = node_tangents(nodes, control_points, length)
    t = t / np.linalg.norm(t, axis=-1, keepdims=True)
    return np.sum(t[..., :-1, :] * t[..., 1:, :], axis=-1), np.sum(t[..., 0, :] * t[..., -1, :], axis=-1)


def assert_mean(values, expected, allowed=0.0):
    error = np.std(values, ddof=1) / np.sqrt(len(values))
    assert abs(np.mean(values) - expected) < SIGMAS * error + allowed
    return error / abs(expected)


def test_energies_are_those_of_the_engine():
    filaments = filaments_of(KIND, 3, 4)
    _, system, positions = filaments.build()
    positions = positions._value + np.random.default_rng(1).normal(0.0, 20.0, positions.shape)
    nodes, control_points = curves_of(filaments, positions)
    expected = sum(sum(own.energies(*each, TEMPERATURE)) for own, *each in zip(filaments, nodes, control_points))
    assert energy_of(new_context(system, positions)) == pytest.approx(expected, rel=1e-8)


@pytest.mark.parametrize("planar", [False, True])
@pytest.mark.parametrize(("length", "elements", "count"), [(50.0, 6, 900), (250.0, 3, 900)])
def test_draws_are_those_of_the_worm_like_chain(length, elements, count, planar):
    """Tangents, mean square distance of the ends, and the energy of stretching; of bending 1 k_BT a direction or so."""
    kind = KIND.with_segment_length(length)
    filaments = filaments_of(kind, count, elements, planar=planar)
    nodes, control_points = (
        np.array([getattr(own, name) for own in filaments]) for name in ("positions", "control_points")
    )
    neighbors, ends = cosines_of(nodes, control_points, length)
    persistence_length, contour = (2000.0 if planar else 1000.0), elements * length
    # In a plane, the rigidity is that which is right in space: 0.8 % less for elements of 50 nm, 4 % for those of 250.
    slack = 0.04 * length / persistence_length if planar else 0.0
    assert assert_mean(neighbors.mean(axis=1), np.exp(-length / persistence_length), slack) < 0.01
    assert_mean(ends, np.exp(-contour / persistence_length), elements * slack)
    square = np.sum((nodes[:, -1] - nodes[:, 0]) ** 2, axis=1)
    expected = theory.wlc_mean_square_end_to_end(contour, persistence_length)
    assert assert_mean(square, expected, 0.005 * expected) < 0.02
    stretching, bending = element_energies(nodes, control_points, filaments[0].beam_element(TEMPERATURE))
    assert_mean(stretching.sum(axis=1) / KT, 0.5 * (2 * elements + 1))
    assert_mean(bending.mean(axis=1) / KT, 1.0 if planar else 2.0 - 1.4 * 0.2 * length / 1000.0, 0.01)


def test_a_draw_begins_as_it_is_told_and_a_seed_repeats_it():
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine="compiled")
    for _ in range(2):
        filaments.add_equilibrium(KIND, 5, seed=4, start=[1.0, 2.0, 3.0], direction=[0, 1, 1])
    first, second = filaments
    assert np.array_equal(first.positions, second.positions)
    assert np.array_equal(first.control_points, second.control_points)
    assert np.array_equal(first.positions[0], [1.0, 2.0, 3.0])
    tangent = first.control_points[0] - first.positions[0]
    assert tangent / np.linalg.norm(tangent) == pytest.approx(np.array([0, 1, 1]) / np.sqrt(2.0))


def test_the_rigidity_of_a_persistence_length_and_of_a_rigidity():
    assert mean_cosine(1e-4) == pytest.approx(1.0 - 1e-4, rel=1e-7)
    for bend in (0.02, 0.25, 0.9):
        assert mean_cosine(bend / calibrated_rigidity(bend)) == pytest.approx(np.exp(-bend), rel=1e-9)
    assert KIND.beam_element(TEMPERATURE).rigidity == pytest.approx(calibrated_rigidity(0.25) * 1000.0 * KT)
    assert replace(KIND, temperature=None).beam_element(TEMPERATURE).rigidity == pytest.approx(1000.0 * KT)


@pytest.mark.parametrize("planar", [False, True])
def test_equilibrium_stays_as_it_was_drawn_at_the_recommended_step(planar):
    length, elements = 250.0, 3
    filaments = filaments_of(KIND, 200, elements, planar=planar)
    _, system, positions = filaments.build()
    step = filaments.recommended_time_step(system=system)
    assert step.step == step.allowed["bends"]
    integrator = filaments.create_integrator(system, step, random_seed=2)
    context = new_context(system, positions, integrator, "CPU")
    bends, cosines, squares = [], [], []
    integrator.step(300)
    for _ in range(120):
        integrator.step(10)
        nodes, control_points = curves_of(filaments, positions_of(context))
        bends.append(element_energies(nodes, control_points, filaments[0].beam_element(TEMPERATURE))[1].mean(axis=1))
        cosines.append(cosines_of(nodes, control_points, length)[1])
        squares.append(np.sum((nodes[:, -1] - nodes[:, 0]) ** 2, axis=1))
    heights = positions_of(context)[:, 2]
    assert not planar or np.array_equal(heights, positions._value[:, 2])
    bend, cosine, square = (np.mean(values, axis=0) for values in (bends, cosines, squares))
    assert assert_mean(bend / KT, 1.0 if planar else 1.93, 0.01) < 0.01
    persistence_length, contour = (2000.0 if planar else 1000.0), elements * length
    assert assert_mean(cosine, np.exp(-contour / persistence_length), 0.02 if planar else 0.0) < 0.03
    expected = theory.wlc_mean_square_end_to_end(contour, persistence_length)
    assert assert_mean(square, expected, 0.005 * expected) < 0.01


@pytest.mark.parametrize(
    ("elements", "load", "back", "across"),
    [(1, 1.0, 0.0564332363, 0.3017207738), (2, 10.0, 0.5549955978, 0.8106090249)],
)
def test_a_clamped_filament_is_the_elastica(elements, load, back, across):
    """The end under P L^2/EI within 0.15 %, with a force of OpenMM on its node; two of straight segments beside it."""
    length, rigidity = 1000.0, 1000.0 * KT
    kind = replace(KIND, segment_length=length / elements, bending_rigidity=rigidity, temperature=None)
    filaments = Filaments(VISCOSITY, 0.0, engine="compiled")
    filaments.add_straight(replace(kind, element="straight", friction_length="segment"), 2, [0, 500, 0], [1, 0, 0])
    number = filaments.add_straight(kind, elements, [0, 0, 0], [1, 0, 0], clamped=0, clamped_tangents=0)
    _, system, positions = filaments.build()
    pull = openmm.CustomExternalForce("-pull*y")
    pull.addGlobalParameter("pull", load * rigidity / length**2)
    pull.addParticle(int(filaments.node_indices[number][-1]))
    system.addForce(pull)
    step = filaments.recommended_time_step()
    integrator = filaments.create_integrator(system, 20 * step.step, checks=False)
    context = new_context(system, positions, integrator)
    integrator.step(600)
    nodes, control_points = (
        positions_of(context)[own[number]] for own in (filaments.node_indices, filaments.control_point_indices)
    )
    assert np.array_equal(nodes[0], [0, 0, 0]) and np.array_equal(control_points[0], [length / elements / 3, 0, 0])
    assert 1.0 - nodes[-1, 0] / length == pytest.approx(back, rel=1.5e-3)
    assert nodes[-1, 1] / length == pytest.approx(across, rel=1.5e-3)


def test_a_clamped_node_alone_is_a_hinge():
    filaments = Filaments(VISCOSITY, 0.0, engine="compiled")
    filaments.add_straight(KIND, 2, [0, 0, 0], [1, 0, 0], clamped=0)
    _, system, positions = filaments.build()
    pull = openmm.CustomExternalForce("-10*y")
    pull.addParticle(2)
    system.addForce(pull)
    integrator = filaments.create_integrator(system, 1e7, checks=False)
    context = new_context(system, positions, integrator)
    integrator.step(2000)
    end = positions_of(context)
    assert np.array_equal(end[0], [0, 0, 0])
    assert end[2] == pytest.approx([0.0, 500.0, 0.0], abs=1.0)


def arc(filaments, radius, elements, angle):
    """A filament along an arc of a circle in the xy plane."""
    angles = np.linspace(0.0, angle, elements + 1)
    nodes = radius * np.stack([np.sin(angles), 1.0 - np.cos(angles), 0 * angles], axis=1)
    directions = np.stack([np.cos(angles), np.sin(angles), 0 * angles], axis=1)
    return filaments.add_nodes(KIND, nodes, tangents=7.0 * directions)


def test_analysis_and_reports_are_of_the_curve():
    radius, elements, angle = 1000.0, 3, 0.75
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine="compiled")
    arc(filaments, radius, elements, angle)
    topology, system, positions = filaments.build()
    nodes, control_points = (own[0] for own in curves_of(filaments, positions._value))
    points = curve_points(nodes, control_points, 5)
    assert np.linalg.norm(points - [0, radius, 0], axis=1) == pytest.approx(radius, rel=1e-4)
    assert arc_lengths(nodes, control_points) == pytest.approx(250.0, rel=1e-4)
    mdtraj = pytest.importorskip("mdtraj")
    trajectory = mdtraj.Trajectory(positions._value[None], mdtraj.Topology.from_openmm(topology))
    assert segment_lengths(trajectory)[0] == pytest.approx(250.0, rel=1e-4)
    assert contour_lengths(trajectory)[0, 0] == pytest.approx(750.0, rel=1e-4)
    assert joint_cosines(trajectory)[0] == pytest.approx(np.cos(0.25), rel=1e-4)
    assert tangents(trajectory)[0][0, -1] == pytest.approx([np.cos(angle), np.sin(angle), 0.0], abs=1e-5)
    assert end_to_end_vectors(trajectory)[0, 0] == pytest.approx(nodes[-1] - nodes[0], rel=1e-5)
    integrator = filaments.create_integrator(system, filaments.recommended_time_step())
    simulation = new_simulation(topology, system, positions, integrator)
    reporter = FilamentReporter(None, 1, filaments)
    state = simulation.context.getState(positions=True, energy=True)
    reporter.report(simulation, state)
    energies = reporter["stretching_energy"] + reporter["bending_energy"]
    assert energies[0, 0] == pytest.approx(state.getPotentialEnergy()._value, rel=1e-6)
    assert reporter["contour_length"][0, 0] == pytest.approx(750.0, rel=1e-4)
    # (EI/2) L/R^2
    assert reporter["bending_energy"][0, 0] == pytest.approx(
        0.5 * 750.0 / radius * KT * calibrated_rigidity(0.25), rel=1e-3
    )


def test_tangents_that_are_not_given_are_those_of_the_smoothest_curve():
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine="compiled")
    filaments.add_nodes(KIND, [[0, 0, 0], [250, 0, 0], [500, 0, 0]])
    assert filaments[0].control_points == pytest.approx(filaments[0].positions + np.array([250 / 3, 0, 0]))
    filaments.add_nodes(KIND, [[0, 0, 0], [250, 0, 0], [250, 250, 0]])
    middle = filaments[1].control_points[1] - filaments[1].positions[1]
    assert middle / np.linalg.norm(middle) == pytest.approx(np.array([1, 1, 0]) / np.sqrt(2.0))


def test_control_points_are_made_whole():
    box = [[900.0, 0, 0], [0, 900.0, 0], [0, 0, 900.0]]
    filaments = filaments_of(KIND, 2, 4)
    _, _, positions = filaments.build(box)
    wrapped = positions._value % 900.0
    assert not np.allclose(wrapped, positions._value)
    whole = make_whole(wrapped, filaments, box)._value
    moved = whole - positions._value
    for nodes, own in zip(filaments.node_indices, filaments.control_point_indices):
        assert np.allclose(moved[[*nodes, *own]], moved[nodes[0]], atol=1e-9)


def test_the_recommended_step():
    kind = replace(KIND, temperature=None, bending_rigidity=1000.0 * KT)
    friction = kind.segment_friction(VISCOSITY, TEMPERATURE, 3)
    unit_step = friction.perpendicular / 250.0 * 250.0**4 / (1000.0 * KT)
    step = recommended_time_step(kind, VISCOSITY, TEMPERATURE, "implicit", 3)
    assert step.step == pytest.approx(2e-5 / 0.25**3 * unit_step)
    stiff = replace(kind, bending_rigidity=1e6 * KT)
    step = recommended_time_step(stiff, VISCOSITY, TEMPERATURE, "implicit", 3)
    assert step.step == pytest.approx((3 / 4.73) ** 4 / 20.0 * unit_step / 1000.0)
    assert "relaxation of the whole filament" in step.reason


def test_what_a_type_of_beam_elements_cannot_have():
    for wrong, message in (
        ({"bending_model": "quadratic"}, "bending_model is one of straight segments"),
        ({"stretching_model": "fene", "maximum_extension": 50.0}, "stretching_model is one of straight segments"),
        ({"extension_relaxation_time": 1.0}, "extension_relaxation_time is one of straight segments"),
        ({"extensional_friction": 1.0}, "extensional_friction is one of straight segments"),
        ({"segment_length": 950.0}, "0.95 persistence lengths long, and must not be longer than 0.92"),
        ({"element": "curved"}, "element must be one of straight, beam"),
        ({"bending_rigidity": 0.0, "temperature": None}, "bending_rigidity must be above zero"),
    ):
        with pytest.raises(InputError, match=message):
            replace(KIND, **wrong)
    for name in ("joint_stiffness", "clamped_bending_stiffness"):
        with pytest.raises(InputError, match="beam elements have no joint stiffness"):
            getattr(KIND, name)
    with pytest.raises(InputError, match="has no straight segments of cylinders"):
        theory.chain_mean_square_radius_of_gyration(KIND, 4, TEMPERATURE)
    with pytest.raises(InputError, match="segments are straight"):
        F_ACTIN.beam_element(TEMPERATURE)
    assert replace(F_ACTIN, element="beam", extension_relaxation_time=None).segment_kind is BEAM_ELEMENTS


def test_what_filaments_of_beam_elements_cannot_have():
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine="compiled")
    nodes = [[0, 0, 0], [250, 0, 0], [500, 0, 0], [500, 250, 0]]
    for add, message in (
        (lambda: filaments.add_ring(KIND, 3, [0, 0, 0]), "at least 4 segments"),
        (lambda: filaments.add_nodes(KIND, nodes[:3], closed=True), "at least 4 segments"),
        (lambda: filaments.add_straight(KIND, 3, [0, 0, 0], [1, 0, 0], propulsion=np.nan), "must be finite"),
        (
            lambda: filaments.add_straight(KIND, 3, [0, 0, 0], [1, 0, 0], clamped_tangents=1),
            "the node is not: clamp it",
        ),
        (
            lambda: filaments.add_nodes(KIND, nodes, planar=True, tangents=[[1, 0, 1]] * 4),
            "with its tangents, is planar",
        ),
        (lambda: filaments.add_nodes(KIND, nodes, tangents=[[1, 0, 1]] * 3), r"shape \(4, 3\)"),
        (lambda: filaments.add_nodes(KIND, nodes, tangents=[[0, 0, 0]] * 4), "tangent of node 0 is zero"),
        (lambda: filaments.add_nodes(F_ACTIN, nodes, tangents=[[1, 0, 0]] * 4), "its segments are straight"),
        (lambda: filaments.add_nodes(F_ACTIN, nodes, clamped=0, clamped_tangents=0), "clamp two neighbouring nodes"),
        (
            lambda: filaments.add_straight(KIND, 1, [0, 0, 0], [1, 0, 0], clamped=[0, 1], clamped_tangents=[0, 1]),
            "all of its nodes and tangents clamped",
        ),
        (lambda: Filaments(VISCOSITY, TEMPERATURE, "portable").add_straight(KIND, 3, [0, 0, 0], [1, 0, 0]), "portable"),
    ):
        with pytest.raises(InputError, match=message):
            add()
    filaments.add_straight(KIND, 3, [0, 0, 0], [1, 0, 0])
    topology, system, positions = filaments.build()
    for scheme in ("midpoint", "implicit-second-order"):
        with pytest.raises(InputError, match="Filament 0 .BEAM. has beam elements"):
            filaments.create_integrator(system, 1.0, scheme)
    integrator = filaments.create_integrator(system, filaments.recommended_time_step())
    context = new_context(system, positions, integrator)
    here = filaments.in_context(context)
    for ask in (
        lambda: filaments.chain_set(system),
        here.joint_tensions,
        here.record_tensions,
    ):
        with pytest.raises(InputError, match="beam elements"):
            ask()


def test_errors_of_steps_name_the_filament():
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine="compiled")
    filaments.add_straight(F_ACTIN, 3, [0, 0, 0], [1, 0, 0])
    filaments.add_straight(KIND, 3, [0, 900, 0], [1, 0, 0])
    _, system, positions = filaments.build()
    integrator = filaments.create_integrator(system, 100.0, temperature=5.0 * TEMPERATURE, checks=False)
    contexts = [new_context(system, positions, integrator)]
    with pytest.raises(InputError, match=r"The elements of filament 1 \(BEAM\) are 1.28.* persistence lengths"):
        integrator.step(1)
    integrator = filaments.create_integrator(system, 100.0 * unit.picosecond, checks=False)
    broken = positions._value.copy()
    broken[filaments.node_indices[1][1]] *= 1e6
    contexts.append(new_context(system, broken, integrator))
    with pytest.raises(InstabilityError, match=r"Filament 1 \(BEAM\) has blown up in step 1") as raised:
        integrator.step(10)
    assert (raised.value.filament, raised.value.step) == (1, 1)


@pytest.mark.parametrize("times", [20.0, 100.0, 1000.0])
def test_a_couple_bends_a_cantilever_into_an_arc(times):
    """M L/EI = 1.5, by the energy -M theta of a tangent, in steps of many times the recommended one."""
    filaments = Filaments(VISCOSITY, 0.0, engine="compiled")
    for planar in (True, False):
        clamped = {"clamped": 0, "clamped_tangents": 0, "planar": planar}
        filaments.add_straight(KIND, 3, [0, 0, 500.0 * planar], [1, 0, 0], **clamped)
    _, system, positions = filaments.build()
    couple = openmm.CustomCompoundBondForce(2, "-couple*atan2(y2-y1, x2-x1)")
    couple.addPerBondParameter("couple")
    length = 3 * KIND.segment_length
    for nodes, controls in zip(filaments.node_indices, filaments.control_point_indices):
        couple.addBond([int(nodes[-1]), int(controls[-1])], [1.5 * filaments[0].beam_element(0.0).rigidity / length])
    system.addForce(couple)
    recommended = filaments.recommended_time_step(system=system)
    assert "relaxation" in recommended.reason
    integrator = filaments.create_integrator(system, times * recommended.step, checks=False)
    context = new_context(system, positions, integrator)
    integrator.step(max(60, int(15000 / times)))
    radius = length / 1.5
    for own, first in zip(curves_of(filaments, positions_of(context))[0], curves_of(filaments, positions._value)[0]):
        end = [radius * np.sin(1.5), radius * (1.0 - np.cos(1.5)), 0.0]
        assert own[-1] - first[0] == pytest.approx(end, abs=2e-4 * length)
