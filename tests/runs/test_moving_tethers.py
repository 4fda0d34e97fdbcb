"""Tethers of a configuration that move: where they are, what they pull with, resuming, and what is refused."""

import numpy as np
import pytest

from openmm_cylchain import DSDNA, ConstantVelocityPulling, analysis
from openmm_cylchain.runs.configuration import parse_configuration
from openmm_cylchain.runs.keys import ConfigurationError
from openmm_cylchain.runs.moving_tethers import MovingTethers
from openmm_cylchain.runs.run import create_simulation
from openmm_cylchain.runs.stages import stages_of
from support.small_runs import simulated, stop_and_resume

PULLED = """
title = "pulled"
[solvent]
temperature = "310 K"
viscosity = "0.69 mPa*s"
[[filament]]
type = "DSDNA"
segments = 8
count = 2
start = "straight"
direction = [1, 0, 0]
clamped = [0]
[[tether]]
table = 1
node = -1
stiffness = "0.05 pN/nm"
velocity = ["400 um/s", "300 um/s", "0 um/s"]
start_time = "2 us"
[[tether]]
filament = 1
node = 4
stiffness = "0.01 pN/nm"
[simulation]
time_step = "2 ns"
duration = "20 us"
report_interval = "1 us"
checkpoint_interval = "3 us"
seed = 3
checks = false
"""


@pytest.fixture(scope="module")
def pulled(tmp_path_factory):
    return simulated(tmp_path_factory.mktemp("pulled"), PULLED)


def test_points_forces_and_extensions(pulled):
    run = analysis.load(pulled)
    table = run.pulling
    assert table["force along the velocity (pN)"].shape == (21, 2)
    np.testing.assert_array_equal(table["tether"], np.tile([0, 1], (21, 1)))
    np.testing.assert_array_equal(table["filament"], np.tile([0, 1], (21, 1)))
    # 1 um/s is 1e-9 nm/ps; an interval of the points' motion before the report.
    configuration = parse_configuration(PULLED)
    simulation, built = create_simulation(configuration)
    moving = MovingTethers(stages_of(configuration)[0], built.filaments)
    steps = moving.interval
    width = np.sqrt(0.0083144626 * 310.0 / (0.05 * 0.602214))
    assert 0.025 * width < 5e-7 * 2e3 * steps <= 0.05 * width
    last = (np.maximum(500 * np.arange(21) - 1, 0) // steps) * steps * 2e3
    for number in range(2):
        begin = built.filaments[number].positions[-1]
        expected = begin + np.maximum(0.0, last - 2e6)[:, None] * np.array([4e-7, 3e-7, 0.0])
        points = np.stack([table[f"point {axis} (nm)"][:, number] for axis in "xyz"], axis=1)
        np.testing.assert_allclose(points, expected, atol=1e-9)
        nodes = np.array([run.nodes(frame)[number] for frame in range(21)])
        along = np.array([0.8, 0.6, 0.0])
        forces = 0.05 * (points - nodes[:, -1]) @ along
        np.testing.assert_allclose(table["force along the velocity (pN)"][:, number], forces, atol=1e-5)
        extensions = (nodes[:, -1] - nodes[:, 0]) @ along
        np.testing.assert_allclose(table["extension along the velocity (nm)"][:, number], extensions, atol=1e-3)


def test_the_same_from_python(pulled):
    """Filaments go where ConstantVelocityPulling brings them."""
    configuration = parse_configuration(PULLED)
    simulation, built = create_simulation(configuration)
    steps = MovingTethers(stages_of(configuration)[0], built.filaments).interval
    velocity = [[4e-7, 3e-7, 0.0]] * 2
    pulling = ConstantVelocityPulling(None, steps, built.filaments, [0, 1], velocity, start_time=2e6)
    simulation.context.setPositions(built.positions)
    simulation.reporters.append(pulling)
    simulation.step(10000)
    found = simulation.context.getState(positions=True).getPositions(asNumpy=True)._value
    np.testing.assert_allclose(found, analysis.load(pulled).positions(-1), atol=1e-4)
    # The bond is stretched, so that points matter.
    assert (
        analysis.load(pulled).pulling["extension along the velocity (nm)"][-1, 0] > 0.8 * 8 * DSDNA.segment_length * 0.8
    )


def test_a_resumed_run_is_the_same(pulled, tmp_path, monkeypatch):
    (tmp_path / "input.toml").write_text(PULLED)
    command = ["run", str(tmp_path / "input.toml"), "--output", str(tmp_path / "out")]
    stop_and_resume(command, monkeypatch, checkpoints=2)
    for name in ("pulling.csv", "energies.csv"):
        assert (tmp_path / "out" / name).read_text() == (pulled / name).read_text()
    one, other = analysis.load(pulled), analysis.load(tmp_path / "out")
    np.testing.assert_array_equal(one.positions(-1), other.positions(-1))


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('["400 um/s", "300 um/s", "0 um/s"]', '["0 um/s", "0 um/s", "0 um/s"]', "velocity is zero: leave it out"),
        ('velocity = ["400 um/s", "300 um/s", "0 um/s"]\n', "", "lacks the key 'velocity'"),
        ('"400 um/s"', '"400 um"', "unit um, which is not one of velocity"),
        ('start_time = "2 us"', 'start_time = "-2 us"', "start_time"),
    ],
)
def test_what_is_refused(old, new, message):
    assert old in PULLED
    with pytest.raises(ConfigurationError, match=message):
        parse_configuration(PULLED.replace(old, new))
