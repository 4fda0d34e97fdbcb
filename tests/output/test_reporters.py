"""Reporters of filaments and tethers: what they write and keep."""

import csv
import io

import numpy as np
import pytest

from openmm_cylchain import DSDNA, F_ACTIN, Filaments, InputError
from openmm_cylchain.output.reporters import FilamentReporter, TetherReporter
from support.contexts import new_simulation, positions_of
from support.solvent import TEMPERATURE, VISCOSITY

COLUMNS = ["stretching_energy", "bending_energy", "end_to_end_distance", "contour_length"]


@pytest.fixture(params=["portable", "compiled"])
def simulated(request):
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine=request.param)
    filaments.add_equilibrium(F_ACTIN, 5, seed=1)
    filaments.add_equilibrium(DSDNA, 1, seed=2)
    filaments.add_tether(0, -1, [1500, 0, 0], 0.5)
    topology, system, positions = filaments.build()
    integrator = filaments.create_integrator(system, 1.0, scheme="midpoint", random_seed=1)
    return filaments, new_simulation(topology, system, positions, integrator)


def _read(path):
    with open(path, newline="") as file:
        return list(csv.DictReader(file))


def test_filaments(simulated, tmp_path):
    filaments, simulation = simulated
    reporter = FilamentReporter(tmp_path / "filaments.csv", 4, filaments)
    simulation.reporters.append(reporter)
    simulation.step(12)
    rows = _read(tmp_path / "filaments.csv")
    assert list(rows[0]) == ["step", "time_ps", "filament", *COLUMNS]
    assert [(int(row["step"]), int(row["filament"])) for row in rows] == [(s, f) for s in (4, 8, 12) for f in (0, 1)]
    assert reporter.step.tolist() == [4, 8, 12] and reporter.time == pytest.approx([4, 8, 12])
    for column in COLUMNS:
        assert reporter[column].shape == (3, 2)
        assert [float(row[column]) for row in rows] == pytest.approx(reporter[column].ravel(), rel=1e-9)
    state = simulation.context.getState(energy=True, positions=True)
    nodes = state.getPositions(asNumpy=True)._value
    trap = 0.25 * np.sum((nodes[5] - [1500, 0, 0]) ** 2)
    total = reporter["stretching_energy"][-1].sum() + reporter["bending_energy"][-1].sum()
    assert state.getPotentialEnergy()._value == pytest.approx(total + trap, rel=1e-6)
    assert reporter["end_to_end_distance"][-1, 0] == pytest.approx(np.linalg.norm(nodes[5] - nodes[0]))
    assert reporter["contour_length"][-1, 1] == pytest.approx(np.linalg.norm(nodes[7] - nodes[6]))
    assert reporter["bending_energy"][:, 1].tolist() == [0, 0, 0]


def test_tethers(simulated, tmp_path):
    filaments, simulation = simulated
    reporter = TetherReporter(str(tmp_path / "tethers.csv"), 2, filaments)
    simulation.reporters.append(reporter)
    simulation.step(2)
    filaments.in_context(simulation.context).move_tether(0, [1600, 0, 10])
    simulation.step(2)
    assert reporter["point_x"].tolist() == [[1500], [1600]] and reporter["point_z"].tolist() == [[0], [10]]
    node = positions_of(simulation.context)[5]
    assert reporter["extension_y"][-1, 0] == pytest.approx(node[1])
    assert reporter["force_x"][-1, 0] == pytest.approx(-0.5 * (node[0] - 1600))
    rows = _read(tmp_path / "tethers.csv")
    assert [float(row["force_z"]) for row in rows] == pytest.approx(reporter["force_z"][:, 0], rel=1e-9)


def test_files(simulated, tmp_path):
    filaments, simulation = simulated
    path = tmp_path / "filaments.csv"
    text = io.StringIO()
    memory = FilamentReporter(None, 1, filaments)
    simulation.reporters.extend([FilamentReporter(path, 1, filaments), FilamentReporter(text, 1, filaments), memory])
    simulation.step(1)
    # What is written is on disk at once.
    assert len(_read(path)) == 2
    simulation.reporters[0].close()
    simulation.reporters[0] = FilamentReporter(path, 1, filaments, append=True)
    simulation.step(1)
    assert [row["step"] for row in _read(path)] == ["1", "1", "2", "2"]
    assert text.getvalue() == path.read_text()
    assert memory["contour_length"].shape == (2, 2)


def test_a_killed_run_leaves_no_broken_line(simulated, tmp_path):
    filaments, simulation = simulated
    path = tmp_path / "filaments.csv"
    simulation.reporters.append(FilamentReporter(path, 1, filaments))
    simulation.step(2)
    complete = path.read_text()
    for cut in (len(complete) - 1, len(complete) - 20, 30, 0):
        path.write_text(complete[:cut])
        simulation.reporters = [FilamentReporter(path, 1, filaments, append=True)]
        simulation.step(1)
        rows = _read(path)
        assert list(rows[0]) == ["step", "time_ps", "filament", *COLUMNS]
        assert all(None not in row.values() and None not in row for row in rows)
        assert [int(row["filament"]) for row in rows[-2:]] == [0, 1]
        assert int(rows[-1]["step"]) == simulation.currentStep
        assert len(rows) == 2 + max(0, complete[:cut].count("\n") - 1)
    with pytest.raises(InputError, match="filaments.csv is not a file of this reporter"):
        TetherReporter(path, 1, filaments, append=True)
    assert _read(path) == rows


def test_a_run_that_goes_on_from_a_checkpoint_writes_the_same(simulated, tmp_path):
    filaments, simulation = simulated
    checkpoint = simulation.context.createCheckpoint()
    tables = []
    for parts in ((6,), (3, 3)):
        simulation.context.loadCheckpoint(checkpoint)
        path = tmp_path / f"{len(parts)}.csv"
        for number, steps in enumerate(parts):
            simulation.reporters = [FilamentReporter(path, 1, filaments, append=number > 0)]
            simulation.step(steps)
        tables.append(path.read_text())
    assert tables[0] == tables[1]
    assert np.isfinite([[float(value) for value in row.values()] for row in _read(path)]).all()


def test_bad_input_is_refused(simulated, tmp_path):
    filaments, _ = simulated
    with pytest.raises(InputError, match="reportInterval must be at least 1"):
        FilamentReporter(None, 0, filaments)
    with pytest.raises(InputError, match="file must be a path"):
        FilamentReporter(3, 1, filaments)
    with pytest.raises(InputError, match="no column 'energy': known are stretching_energy"):
        FilamentReporter(None, 1, filaments)["energy"]
    without = Filaments(VISCOSITY, TEMPERATURE)
    without.add_straight(F_ACTIN, 2, [0, 0, 0], [1, 0, 0])
    with pytest.raises(InputError, match="not in a System yet"):
        FilamentReporter(None, 1, without)
    with pytest.raises(InputError, match="no tethers to report"):
        TetherReporter(None, 1, without)
