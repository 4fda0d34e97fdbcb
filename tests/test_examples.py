"""The Python examples run, in a process of their own, and write what they say."""

import subprocess
import sys
from pathlib import Path

import matplotlib.image
import mdtraj
import numpy as np
import pytest

EXAMPLES = Path(__file__).parents[1] / "examples"

# Name, stem of the files, steps of a short run and its frames, particles and bonds.
CASES = [
    ("lennard_jones_box", "box", 40, 40, 150 + 8, 7),
    ("two_filament_types", "filaments", 50, 50, 16 * (49 + 17), 16 * (48 + 16)),
    ("clamped_filament", "filaments", 200, 100, 4 * 8, 4 * 7),
    ("dense_network", "network", 40, 40, 120 * (11 + 57), 120 * 10),
    ("filaments_in_a_vesicle", "vesicle", 40, 40, 24 + 24 * (13 + 1), 24 * 12),
]


def run(name, folder, steps):
    return subprocess.run(
        [sys.executable, str(EXAMPLES / f"{name}.py"), str(folder), str(steps)],
        cwd=folder.parent,
        capture_output=True,
        text=True,
        timeout=120,
    )


def test_every_example_is_run_here():
    assert sorted(path.stem for path in EXAMPLES.glob("*.py")) == sorted(case[0] for case in CASES)


@pytest.mark.parametrize("name, stem, steps, frames, particles, bonds", CASES)
def test_example(name, stem, steps, frames, particles, bonds, tmp_path):
    folder = tmp_path / "results"
    process = run(name, folder, steps)
    assert process.returncode == 0, process.stderr
    assert "Warning" not in process.stderr
    assert 3 <= len(process.stdout.splitlines()) <= 12
    assert str(folder) in process.stdout
    assert "nan" not in process.stdout
    assert sorted(path.name for path in folder.iterdir()) == [f"{stem}.cif", f"{stem}.dcd", f"{stem}.png"]

    structure = mdtraj.load(str(folder / f"{stem}.cif"))
    assert (structure.n_atoms, structure.topology.n_bonds) == (particles, bonds)
    trajectory = mdtraj.load(str(folder / f"{stem}.dcd"), top=structure.topology)
    assert trajectory.n_frames == frames
    assert np.isfinite(trajectory.xyz).all()
    assert np.abs(trajectory.xyz[-1] - trajectory.xyz[0]).max() > 0.01

    picture = matplotlib.image.imread(folder / f"{stem}.png")
    assert min(picture.shape[:2]) > 500
    assert picture[..., :3].std() > 0.05


def test_clamped_nodes_stay_and_tips_rise_with_the_force(tmp_path):
    folder = tmp_path / "results"
    assert run("clamped_filament", folder, 200).returncode == 0
    trajectory = mdtraj.load(str(folder / "filaments.dcd"), top=str(folder / "filaments.cif"))
    nodes = trajectory.xyz[-1].reshape(4, 8, 3)
    np.testing.assert_allclose(nodes[:, 1], nodes[:, 0] + [300, 0, 0], atol=1e-3)
    tips = nodes[:, -1, 2]
    assert (np.diff(tips) > 0).all()
    assert tips[0] > 0
