"""Runs with filaments of beam elements: files, curves, crosslinks on them, pictures, and what is refused."""

import numpy as np
import openmm
import pytest
from openmm import app
from PIL import Image

from openmm_cylchain import Crosslinks, Filaments, RunReporter, analysis, capsule_contact_force
from openmm_cylchain.beams.curve import curve_points
from openmm_cylchain.cli import main
from openmm_cylchain.units.quantities import PICONEWTON
from support.contexts import close_reporters, energy_of, forces_of, new_context, positions_of
from support.linked_beams import BEAM, STRAIGHT
from support.solvent import KT, TEMPERATURE, VISCOSITY


@pytest.fixture(scope="module")
def simulated(tmp_path_factory):
    """A run of two filaments of beam elements and one of straight segments, of which two are linked."""
    path = tmp_path_factory.mktemp("runs") / "run"
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine="compiled")
    filaments.add_equilibrium(STRAIGHT, 6, seed=3)
    filaments.add_equilibrium(BEAM, 4, seed=1)
    filaments.add_equilibrium(BEAM, 3, seed=2, start=[100, 200, 0], planar=True)
    topology, system, positions = filaments.build()
    links = Crosslinks(0.1, 20.0)
    links.add(None, filaments.segment_place(1, segment=1, fraction=0.3), filaments.segment_place(2, segment=1))
    links.add_to(system, 4)
    integrator = filaments.create_integrator(system, filaments.recommended_time_step(system=system), random_seed=1)
    simulation = app.Simulation(topology, system, integrator, openmm.Platform.getPlatform("Reference"))
    simulation.context.setPositions(positions)
    simulation.reporters.append(RunReporter(path, 10, filaments, "beams"))
    simulation.step(50)
    context = simulation.context
    last = positions_of(context), links.lengths(context), energy_of(context, ~(1 << 4))
    close_reporters(simulation)
    return path, filaments, last


def test_a_run_holds_curves_and_links_on_them(simulated):
    path, filaments, (positions, lengths, energy) = simulated
    run = analysis.load(path)
    assert len(run) == 6 and run.filaments[0].control_points.tolist() == []
    assert run.filaments[2].control_points.tolist() == filaments.control_point_indices[2].tolist()
    assert PICONEWTON * run.energies["potential energy (pN nm)"][-1] == pytest.approx(energy, rel=1e-6)
    found = run.crosslinks(-1)
    assert np.linalg.norm(found.places[0, 1] - found.places[0, 0]) == pytest.approx(lengths[0], abs=1e-3)
    assert found.tensions[0] == pytest.approx(0.1 * (lengths[0] - 20.0), abs=1e-3)
    curves = run.curves(-1)
    assert [len(points) for points in curves] == [7, 33, 25]
    expected = curve_points(positions[filaments.node_indices[1]], positions[filaments.control_point_indices[1]], 8)
    assert curves[1] == pytest.approx(expected, abs=1e-3)
    nodes = positions[filaments.node_indices[1]]
    chords = np.concatenate([np.linspace(a, b, 8, endpoint=False) for a, b in zip(nodes, nodes[1:])])
    assert np.abs(curves[1][:-1] - chords).max() > 5.0


@pytest.mark.parametrize("color", ["type", "orientation", "bending"])
def test_pictures_show_the_curve(simulated, tmp_path, color):
    path, *_ = simulated
    assert main(["render", str(path), "--output", str(tmp_path / "run.png"), "--color", color]) == 0
    assert np.ptp(np.array(Image.open(tmp_path / "run.png"))) > 100
    assert main(["export", str(path), "--format", "simularium", "--output", str(tmp_path / "run.simularium")]) == 0


def virial_of(filaments, numbers, context):
    """Of the forces of chains on all particles of some filaments: the sum of -x F, in kJ/mol."""
    positions, forces = positions_of(context), forces_of(context, 1)
    particles = np.concatenate(
        [own[number] for number in numbers for own in (filaments.node_indices, filaments.control_point_indices)]
    )
    return -np.einsum("ni,nj->ij", positions[particles], forces[particles])


def test_the_stress_of_beams_is_the_virial_of_the_forces_of_the_engine(simulated):
    path, filaments, _ = simulated
    run, volume = analysis.load(path), 1e8
    found = analysis.stress(run, -1, volume)
    _, system, _ = rebuilt(filaments)
    context = new_context(system, run.positions(-1))
    expected = virial_of(filaments, range(3), context)
    # Some strains are rounded in the trajectory, but both have the same.
    assert volume * found.chains == pytest.approx(expected, abs=1e-4 * np.abs(expected).max())
    assert found.chains == pytest.approx(found.chains.T, abs=1e-6 * np.abs(found.chains).max())
    # Seven nodes of straight segments; five of a beam, and four in a plane, with their control points.
    points = np.array([7 + 2 * 5 + 2 * 4] * 2 + [7 + 2 * 5])
    assert found.ideal == pytest.approx(-np.diag(points) * KT / volume)
    link = run.crosslinks(-1)
    vector = link.places[0, 1] - link.places[0, 0]
    pull = link.tensions[0] / np.linalg.norm(vector)
    assert volume * found.crosslinks == pytest.approx(pull * np.outer(vector, vector), rel=1e-6)


def rebuilt(filaments):
    """The same filaments in a System without anything else."""
    again = Filaments(VISCOSITY, TEMPERATURE, engine="compiled")
    for own in filaments:
        again.add_nodes(own.type, own.positions, planar=own.planar, control_points=own.control_points)
    return again.build()


def test_a_beam_under_tension_between_two_planes(tmp_path):
    """Straight, stretched by 1 %: the force per area, without noise, and the ideal part of what is free."""
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine="compiled")
    ends = np.outer(1.01 * 250.0 * np.arange(4), [1.0, 0, 0])
    filaments.add_nodes(
        BEAM, ends, control_points=ends + [1.01 * 250.0 / 3.0, 0, 0], clamped=[0, -1], clamped_tangents=0
    )
    topology, system, positions = filaments.build()
    integrator = filaments.create_integrator(system, 1.0, random_seed=1)
    simulation = app.Simulation(topology, system, integrator, openmm.Platform.getPlatform("Reference"))
    simulation.context.setPositions(positions)
    simulation.reporters.append(RunReporter(tmp_path / "run", 1, filaments, "tension"))
    simulation.step(1)
    close_reporters(simulation)
    run = analysis.load(tmp_path / "run")
    assert run.filaments[0].clamped_tangents == (0,)
    length, area = ends[-1, 0], 3e4
    found = analysis.stress(run, 0, length * area)
    # The mean strain is less for bends that fluctuate inside of elements.
    element = BEAM.beam_element(TEMPERATURE)
    force = element.modulus * (0.01 + element.shortening)
    assert found.chains[0, 0] == pytest.approx(force / area, rel=1e-3)
    assert np.abs(found.chains).sum() == pytest.approx(found.chains[0, 0], rel=1e-3)
    # Two nodes and three control points.
    assert found.ideal == pytest.approx(-5 * KT / (length * area) * np.eye(3))


def test_contacts_of_runs_are_those_of_elements(tmp_path):
    """Of a run with beads: which elements touch, where on them, and their part of the stress."""
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine="compiled")
    filaments.add_straight(BEAM, 3, [0, 0, 0], [1, 0, 0])
    filaments.add_straight(STRAIGHT, 3, [300, -50, 25], [0, 1, 0])
    filaments.add_straight(BEAM, 2, [600, -100, 26], [0, 1, 0])
    for number in (0, 2):
        filaments.add_beads(number, 62.5)
    topology, system, positions = filaments.build()
    system.addForce(capsule_contact_force(filaments, system, 30.0, 0.5))
    integrator = filaments.create_integrator(system, 1.0, random_seed=1)
    simulation = app.Simulation(topology, system, integrator, openmm.Platform.getPlatform("Reference"))
    simulation.context.setPositions(positions)
    simulation.reporters.append(RunReporter(tmp_path / "run", 1, filaments, "contacts"))
    simulation.step(1)
    close_reporters(simulation)
    run = analysis.load(tmp_path / "run")
    found = run.contacts(0)
    order = np.argsort(found.distances)
    assert found.filaments[order].tolist() == [[0, 1], [0, 2]]
    assert found.segments[order].tolist() == [[1, 0], [2, 0]]
    assert found.fractions[order] == pytest.approx(np.array([[0.2, 0.4], [0.4, 0.4]]), abs=1e-3)
    assert found.forces[order] == pytest.approx([2.5, 2.0], abs=1e-3)
    stress = analysis.stress(run, 0, 1e6)
    assert 1e6 * stress.contacts == pytest.approx(np.diag([0, 0, -(2.5 * 25 + 2.0 * 26)]), abs=0.1)
