"""The Python examples run, in a process of their own, and write what they say."""

import re
import subprocess
import sys

import matplotlib.image
import mdtraj
import numpy as np
import pytest

from support.repository import EXAMPLES

# Name, stem of the files, steps of a short run and its frames, particles and bonds.
CASES = [
    ("lennard_jones_box", "box", 40, 40, 150 + 8, 7),
    ("mixed_system", "mixed", 40, 40, 60 + 8 * (11 + 5) + 3 * 6, 8 * 10 + 3 * 5),
    ("two_filament_types", "filaments", 50, 50, 16 * (49 + 17), 16 * (48 + 16)),
    ("clamped_filament", "filaments", 200, 100, 8 * 9, 8 * 8),
    ("buckling_columns", "columns", 200, 100, 6 * 2 * 3, 6 * 2),
    ("gliding_filaments", "gliding", 60, 60, 40 * 7, 40 * 6),
    ("tumbling_in_shear", "shear", 60, 60, 24 * 13 + 6 * 12, 24 * 12 + 6 * 12),
    ("tumbling_dna", "tumbling", 60, 60, 12 * 256, 12 * 255),
    ("periodic_box", "periodic", 40, 40, 60 + 8 * 17, 8 * 16),
    ("dense_network", "network", 40, 40, 120 * 11, 120 * 10),
    ("filaments_in_a_vesicle", "vesicle", 40, 40, 24 + 24 * (13 + 1), 24 * 12),
    ("contractile_bundle", "bundle", 40, 40, 434, 394),
    ("gliding_assay", "assay", 60, 60, 12 * 9, 12 * 8),
    ("contractile_ring", "ring", 60, 60, 80 * 11, 80 * 10),
    ("mixed_motors", "motors", 60, 60, 24 * 5, 24 * 4),
    ("sliding_microtubules", "sliding", 60, 60, 12 * 9, 12 * 8),
    ("loop_extrusion", "loops", 60, 60, 121, 120),
    ("aster", "aster", 40, 40, 60 * 5, 60 * 4),
    ("rearranging_network", "network", 200, 20, 140 * 11, 140 * 10),
    ("crosslinked_bundle", "bundle", 40, 40, 6 * 31, 6 * 30),
    ("treadmilling", "treadmilling", 60, 60, 24 * 57, 24 * 56),
    ("actin_turnover", "turnover", 60, 60, 32 * 29, 32 * 28),
    ("turnover_bundle", "turnover", 60, 60, (48 + 96) * 20, (48 + 96) * 19),
    ("microtubule_search", "search", 60, 60, 250 * 32, 250 * 31),
    ("branched_network", "branched", 60, 60, (20 + 120) * 8, (20 + 120) * 7),
    ("motile_bead", "motile", 60, 60, (30 + 500) * 8 + 3, (30 + 500) * 7),
    ("aster_in_a_cell", "aster", 60, 60, 2120, 1536),
    ("microrheology", "microrheology", 60, 60, 2179, 120 * 16),
    ("force_extension", "dna", 200, 100, 24 * 21, 24 * 20),
    ("magnetic_tweezers", "tweezers", 200, 100, 22 * 41, 22 * 40),
    ("cyclisation", "loops", 200, 100, 42 * (46 + 4), 42 * 46),
    ("twin_domains", "domains", 60, 60, 161, 160),
    ("supercoiled_plasmid", "plasmids", 60, 60, 3 * 120, 3 * 120),
]
# The others are slow tests.
AT_ONCE = (
    "lennard_jones_box",
    "two_filament_types",
    "gliding_assay",
)
# What an example writes beside the files that all of them write.
MORE_FILES = {"periodic_box": ["periodic.psf"]}


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


@pytest.mark.parametrize(
    "name, stem, steps, frames, particles, bonds",
    [pytest.param(*case, id=case[0], marks=[] if case[0] in AT_ONCE else pytest.mark.slow) for case in CASES],
)
def test_example(name, stem, steps, frames, particles, bonds, tmp_path):
    folder = tmp_path / "results"
    process = run(name, folder, steps)
    assert process.returncode == 0, process.stderr
    assert "Warning" not in process.stderr
    assert 3 <= len(process.stdout.splitlines()) <= 12
    assert str(folder) in process.stdout
    assert "nan" not in process.stdout
    files = [f"{stem}.cif", f"{stem}.dcd", f"{stem}.png", *MORE_FILES.get(name, [])]
    assert sorted(path.name for path in folder.iterdir()) == sorted(files)

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
    nodes = trajectory.xyz[-1].reshape(8, 9, 3)
    np.testing.assert_allclose(nodes[:, 0, [0, 2]], np.tile([-300, 0], (8, 1)), atol=1e-3)
    np.testing.assert_allclose(nodes[:, 1, [0, 2]], np.zeros((8, 2)), atol=1e-3)
    for tips in (nodes[:4, -1, 2], nodes[4:, -1, 2]):
        assert (np.diff(tips) > 0).all()
        assert tips[0] > 0


def test_gliding_filaments_stay_in_their_plane(tmp_path):
    folder = tmp_path / "results"
    assert run("gliding_filaments", folder, 60).returncode == 0
    trajectory = mdtraj.load(str(folder / "gliding.dcd"), top=str(folder / "gliding.cif"))
    assert np.all(trajectory.xyz[..., 2] == 0)
    nodes = trajectory.xyz.reshape(60, 40, 7, 3)
    along = np.einsum("ij,ij->i", (nodes[-1] - nodes[0]).mean(axis=1), nodes[0, :, -1] - nodes[0, :, 0])
    assert along[:20].mean() > 0 > along[20:].mean()


def test_wrapped_filaments_are_whole_and_a_psf_has_their_bonds(tmp_path):
    folder = tmp_path / "results"
    process = run("periodic_box", folder, 40)
    assert process.returncode == 0
    wrapped, torn, whole = (float(number) for number in re.findall(r"(\d+\.\d) nm", process.stdout)[:3])
    assert wrapped == whole < 380 and torn > 1000
    trajectory = mdtraj.load(str(folder / "periodic.dcd"), top=str(folder / "periodic.psf"))
    bonds = np.array([(first.index, second.index) for first, second in trajectory.topology.bonds])
    lengths = np.linalg.norm(trajectory.xyz[:, bonds[:, 1]] - trajectory.xyz[:, bonds[:, 0]], axis=2)
    assert lengths.shape == (40, 128) and lengths.max() < 380
