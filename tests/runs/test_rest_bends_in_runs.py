"""Bends at rest in files of runs: tables, energies, twists, resuming, and what is refused."""

import json

import numpy as np
import pytest

from openmm_cylchain import InputError, analysis
from openmm_cylchain.runs.configuration import parse_configuration
from openmm_cylchain.runs.created_simulation import create_simulation
from openmm_cylchain.runs.keys import ConfigurationError
from support.small_runs import run_command, simulated, stop_and_resume

BENT = """
title = "curved DNA"
[solvent]
temperature = "298 K"
viscosity = "1 mPa s"
[[filament]]
type = "DSDNA"
segment_length = "5 nm"
twist_persistence_length = "100 nm"
count = 2
segments = 12
rest_bends = { angles = ["15 deg"], directions = ["30 deg"] }
[[filament]]
type = "DSDNA"
segment_length = "5 nm"
twist_persistence_length = "100 nm"
segments = 12
closed = true
rest_bends = { angles = ["0 deg", "30 deg", "0 deg", "0 deg", "0 deg", "0 deg", "0 deg", "0 deg", "30 deg", "0 deg", \
"0 deg", "0 deg"] }
[simulation]
duration = "0.5 us"
time_step = "1 ns"
report_interval = "0.05 us"
checkpoint_interval = "0.1 us"
seed = 3
"""


@pytest.fixture(scope="module")
def bent(tmp_path_factory):
    folder = tmp_path_factory.mktemp("bent")
    return simulated(folder, BENT)


def test_bends_of_tables_are_those_of_filaments():
    groups = parse_configuration(BENT).filaments
    assert (groups[0].rest_bends.angles, groups[0].rest_bends.directions) == pytest.approx(np.radians([15, 30]))
    assert groups[1].rest_bends.angles == pytest.approx(np.radians([0, 30, 0, 0, 0, 0, 0, 0, 30, 0, 0, 0]))


def test_twists_and_frames_of_a_run(bent):
    run = analysis.load(bent)
    assert [own.bent_at_rest for own in run.filaments] == [True] * 3
    assert [len(own) for own in run.twists(-1)] == [13, 13, 13]
    assert [own.shape for own in run.material_frames(-1)] == [(12, 3)] * 3
    with pytest.raises(InputError, match="bends at rest"):
        analysis.stress(run, -1, volume=1e6)


def test_energies_are_those_of_bends_at_rest(bent):
    """Joints have about k_B T each; as bends of straight joints, they would have half as much more."""
    summary = (bent / "summary.json").read_text()
    assert "their joints are bent at rest" in summary
    observables = [own["verdict"] for group in json.loads(summary)["groups"] for own in group["observables"]]
    assert set(observables) == {"not comparable"}
    run = analysis.load(bent)
    energies = run.energies["bending energy per joint (kT)"]
    assert 0.6 < energies[3:].mean() < 1.4


def test_a_resumed_run_is_the_same(bent, tmp_path, monkeypatch):
    stop_and_resume(run_command(tmp_path, BENT), monkeypatch, checkpoints=3)
    for name in ("twists.npy", "energies.csv", "trajectory.dcd"):
        assert (tmp_path / "out" / name).read_bytes() == (bent / name).read_bytes()


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('twist_persistence_length = "100 nm"\ncount', "count", "twist"),
        ('["15 deg"]', '["15 deg", "15 deg"]', "one of each of 11 joints"),
        ('["15 deg"]', '["80 deg"]', "too far"),
        ('["15 deg"]', '["-15 deg"]', "angles"),
        ('["15 deg"]', '["15 nm"]', "angle"),
        ('angles = ["15 deg"], ', "", "angles"),
        ("segments = 12\nrest", "segments = 12\nplanar = true\nrest", "planar"),
        ("seed = 3", 'seed = 3\nengine = "portable"', "twist"),
    ],
)
def test_what_is_refused(old, new, message):
    assert old in BENT
    with pytest.raises(ConfigurationError, match=message):
        create_simulation(parse_configuration(BENT.replace(old, new, 1)))
