"""Tables of forces of walls and contacts in runs: of files and of a RunReporter, and their panels in the figure."""

import os
import signal

import numpy as np
import pytest

from openmm_cylchain import RunReporter, analysis
from openmm_cylchain.cli import main
from openmm_cylchain.runs import run as run_module
from openmm_cylchain.runs import summary_figure
from openmm_cylchain.runs.configuration import parse_configuration
from openmm_cylchain.runs.run import create_simulation
from openmm_cylchain.runs.run_directory import RunDirectory
from openmm_cylchain.runs.summarised_run import run_with_summary
from openmm_cylchain.runs.summary import load_trajectory

BETWEEN_WALLS = """
[solvent]
temperature = "310 K"
viscosity = "1.71 mPa*s"
[box]
edges = ["0.4 um", "0.4 um", "1 um"]
[[filament]]
type = "F_ACTIN"
segment_length = "100 nm"
segments = 1
count = 12
[contacts]
diameter = "20 nm"
[[wall]]
shape = "slit"
point = ["0.2 um", "0.2 um", "0.5 um"]
normal = [0, 0, 1]
thickness = "60 nm"
stiffness = "0.5 pN/nm"
[simulation]
time_step = "1 us"
duration = "0.2 ms"
report_interval = "20 us"
checkpoint_interval = "40 us"
seed = 5
"""
TABLES = ("wall_forces.csv", "contact_forces.csv")


def test_sides_of_a_prism_are_faces_of_one_wall(tmp_path):
    """Each pushes along its normal, inwards."""
    corners = '[["0 nm", "0 nm"], ["160 nm", "0 nm"], ["0 nm", "150 nm"]]'
    head, _, tail = BETWEEN_WALLS.partition("[contacts]")
    head = head.replace('[box]\nedges = ["0.4 um", "0.4 um", "1 um"]\n', "")
    head += 'inside = { shape = "sphere", center = ["40 nm", "40 nm", "55 nm"], radius = "55 nm" }\n'
    wall = f'[[wall]]\nshape = "prism"\ncorners = {corners}\nbottom = "0 nm"\ntop = "110 nm"\nstiffness = "0.5 pN/nm"\n'
    text = head + wall + tail[tail.index("[simulation]") :].replace('"0.2 ms"', '"40 us"')
    run_with_summary(parse_configuration(text), tmp_path / "out")
    found = analysis.load(tmp_path / "out").wall_forces
    assert found["face"][0].tolist() == [0, 1, 2, 3, 4] and not found["wall"].any()
    loads = found["load (pN)"][1:]
    forces = np.stack([found[f"force {axis} (pN)"][1:] for axis in "xyz"], axis=-1)
    normals = np.array([[0, 160, 0], [-150, -160, 0], [150, 0, 0], [0, 0, -1], [0, 0, 1]])
    normals = normals / np.linalg.norm(normals, axis=1)[:, None]
    assert loads.min() > 0.0
    np.testing.assert_allclose(forces, loads[..., None] * normals, atol=1e-6 * loads.max())


@pytest.fixture(scope="module")
def unbroken(tmp_path_factory):
    path = tmp_path_factory.mktemp("forces") / "out"
    run_with_summary(parse_configuration(BETWEEN_WALLS), path)
    return path


def test_tables_have_means_between_reports(unbroken):
    found = analysis.load(unbroken)
    walls, contacts = found.wall_forces, found.contact_forces
    assert walls["load (pN)"].shape == (11, 2) and contacts["load (pN)"].shape == (11, 12)
    for table in (walls, contacts):
        np.testing.assert_allclose(table["mean over (ms)"][:, 0], [0.0, *[0.02] * 10])
        np.testing.assert_allclose(table["time (ms)"][:, 0], 1e-9 * found.times, rtol=1e-14)
    assert walls["face"][0].tolist() == [0, 1] and walls["load (pN)"][1:].min() > 0.0
    np.testing.assert_allclose(walls["force z (pN)"][1:] * [-1, 1], walls["load (pN)"][1:])
    assert contacts["load (pN)"].max() > 0.0
    # They push each other.
    sums = [contacts[f"force {axis} (pN)"].sum(axis=1) for axis in "xyz"]
    np.testing.assert_allclose(sums, 0.0, atol=1e-9)


def test_a_run_that_is_resumed_between_reports_has_the_same_tables(unbroken, tmp_path, monkeypatch):
    """A signal comes at 50 us, half-way between two reports: the next mean is that over all steps between them."""
    take = run_module.Recorder._timed_steps

    def signalled(recorder, steps):
        result = take(recorder, min(steps, 50 - recorder._step))
        if recorder._step == 50:
            os.kill(os.getpid(), signal.SIGINT)
        return result

    (tmp_path / "input.toml").write_text(BETWEEN_WALLS)
    command = ["run", str(tmp_path / "input.toml"), "--output", str(tmp_path / "out")]
    monkeypatch.setattr(run_module.Recorder, "_timed_steps", signalled)
    assert main(command) == 130
    assert len((tmp_path / "out" / TABLES[0]).read_text().splitlines()) == 1 + 2 * 3
    monkeypatch.setattr(run_module.Recorder, "_timed_steps", take)
    assert main([*command, "--resume"]) == 0
    for name in TABLES:
        assert (tmp_path / "out" / name).read_text() == (unbroken / name).read_text(), name


def test_a_run_reporter_writes_the_same_tables(unbroken, tmp_path):
    simulation, built = create_simulation(parse_configuration(BETWEEN_WALLS))
    simulation.context.setPositions(analysis.load(unbroken).positions(0))
    simulation.reporters.append(RunReporter(tmp_path / "out", 20, built.filaments))
    simulation.step(100)
    found, exact = analysis.load(tmp_path / "out"), analysis.load(unbroken)
    for one, other in ((found.wall_forces, exact.wall_forces), (found.contact_forces, exact.contact_forces)):
        assert list(one) == list(other)
        np.testing.assert_array_equal(one["step"], other["step"][:6])
        # Positions of a trajectory are in single precision.
        np.testing.assert_allclose(one["load (pN)"], other["load (pN)"][:6], atol=1e-2)


def test_runs_without_walls_and_contacts_have_no_such_tables(tmp_path):
    begin, end = BETWEEN_WALLS.index("[contacts]"), BETWEEN_WALLS.index("[simulation]")
    run_with_summary(parse_configuration(BETWEEN_WALLS[:begin] + BETWEEN_WALLS[end:]), tmp_path / "out")
    found = analysis.load(tmp_path / "out")
    assert found.wall_forces == found.contact_forces == {}
    assert not any((tmp_path / "out" / name).exists() for name in TABLES)


def test_the_figure_has_panels_of_forces(unbroken, monkeypatch):
    drawn = []
    monkeypatch.setattr(summary_figure.Figure, "savefig", lambda figure, *_, **__: drawn.append(figure))
    configuration = parse_configuration(BETWEEN_WALLS)
    files = RunDirectory(unbroken)
    summary_figure._draw(configuration, files, load_trajectory(configuration, files), None)
    walls, contacts = drawn[0].axes[-2:]
    assert walls.get_title() == "Forces of walls, by faces"
    assert [line.get_label() for line in walls.lines] == ["wall 0, slit, upper face", "wall 0, slit, lower face"]
    table = analysis.load(unbroken).contact_forces["load (pN)"][1:]
    np.testing.assert_allclose(contacts.lines[0].get_ydata(), table.mean(axis=1))
    np.testing.assert_allclose(contacts.lines[1].get_ydata(), table.max(axis=1))
