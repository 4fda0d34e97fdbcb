"""Runs with filaments of beam elements: files, curves, crosslinks on them, pictures, and what is refused."""

import numpy as np
import openmm
import pytest
from openmm import app
from PIL import Image

from openmm_cylchain import Crosslinks, Filaments, RunReporter, analysis
from openmm_cylchain.beams.curve import curve_points
from openmm_cylchain.cli import main
from support.contexts import close_reporters, energy_of, positions_of
from support.linked_beams import BEAM, STRAIGHT
from support.solvent import TEMPERATURE, VISCOSITY


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
    assert run.energies["potential energy (kJ/mol)"][-1] == pytest.approx(energy, rel=1e-6)
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
