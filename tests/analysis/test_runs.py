"""Runs that are loaded: times, filaments, linkers, what mdtraj and MDAnalysis see, and directories that are refused."""

import fcntl
import re
import shutil

import MDAnalysis
import mdtraj
import numpy as np
import openmm
import pytest
from openmm import app

from openmm_cylchain import (
    DSDNA_BASE_PAIRS,
    F_ACTIN,
    MICROTUBULE,
    Box,
    Cylinder,
    Filaments,
    InputError,
    PrecisionWarning,
    RunReporter,
    Sphere,
    analysis,
    filament_wall_force,
)
from openmm_cylchain.output.run_description import (
    DescribedContacts,
    DescribedFilament,
    DescribedLinkers,
    DescribedParticles,
    DescribedWall,
    RunDescription,
    read_run_description,
)
from openmm_cylchain.runs.configuration import parse_configuration
from openmm_cylchain.runs.description import describe
from support.configurations import placed_filaments
from support.small_runs import NETWORK, TWO_TYPES, simulated

FRAMES = 31


@pytest.fixture(scope="module")
def two_types(tmp_path_factory):
    return simulated(tmp_path_factory.mktemp("two"), TWO_TYPES)


@pytest.fixture(scope="module")
def network(tmp_path_factory):
    return simulated(tmp_path_factory.mktemp("network"), NETWORK)


def copied(run, tmp_path):
    return shutil.copytree(run, tmp_path / "copy")


def cut(path, size):
    """Shorten a file by ``size`` bytes."""
    with open(path, "r+b") as file:
        file.truncate(path.stat().st_size - size)


def test_frames_and_their_times(two_types):
    run = analysis.load(two_types)
    assert (len(run), run.title, run.temperature, run.complete) == (FRAMES, "two types", 310.0, True)
    assert run.times.dtype == np.float64
    np.testing.assert_array_equal(run.times, 1e8 * np.arange(FRAMES))
    np.testing.assert_array_equal(run.steps, 10 * np.arange(FRAMES))
    assert run.box is None and run.walls == () and run.linker_table == {}
    assert [len(records) for records in run.linkers] == [0] * FRAMES
    assert run.energies["potential energy (pN nm)"].shape == (FRAMES,)


def test_positions_are_those_of_the_trajectory(two_types):
    run = analysis.load(two_types)
    expected = mdtraj.load_dcd(str(two_types / "trajectory.dcd"), top=str(two_types / "topology.cif")).xyz
    for frame in (0, 7, -1):
        # mdtraj rounds to single precision once more.
        np.testing.assert_allclose(run.positions(frame), expected[frame], rtol=2e-7)
    for frame in (FRAMES, -FRAMES - 1, 1.5, True):
        with pytest.raises(InputError, match="frames 0 to 30"):
            run.positions(frame)


def test_filaments(two_types):
    run = analysis.load(two_types)
    assert [(own.type.name, len(own.nodes), own.diameter, own.ring, own.segments) for own in run.filaments] == [
        *[("ACT", 7, 6.0, False, 6)] * 3,
        ("MT", 3, MICROTUBULE.diameter, False, 2),
    ]
    assert run.filaments[0].type == F_ACTIN
    nodes = analysis.filament_nodes(mdtraj.load_topology(str(two_types / "topology.cif")))
    for own, expected in zip(run.filaments, nodes):
        np.testing.assert_array_equal(own.nodes, expected)


def test_mdtraj_has_times_and_bonds(two_types):
    run = analysis.load(two_types)
    trajectory = run.mdtraj()
    assert trajectory.time.dtype == np.float64
    np.testing.assert_array_equal(trajectory.time, run.times)
    assert trajectory.topology.n_bonds == 3 * 6 + 2
    np.testing.assert_array_equal(run.mdtraj(slice(3, None, 4)).time, run.times[3::4])
    np.testing.assert_array_equal(run.mdtraj([5, -1]).xyz, trajectory.xyz[[5, FRAMES - 1]])
    with pytest.raises(InputError, match="no frame"):
        run.mdtraj(slice(40, None))


def test_mdtraj_has_the_box(network):
    vectors = analysis.load(network).mdtraj().unitcell_vectors
    np.testing.assert_allclose(vectors[3], np.diag([400.0, 400.0, 500.0]), atol=1e-4)


def test_mdanalysis_has_times_bonds_and_radii(network):
    run = analysis.load(network)
    universe = run.mdanalysis()
    assert [frame.time for frame in universe.trajectory] == pytest.approx(list(run.times), rel=1e-12)
    assert len(universe.bonds) == 80 and len(universe.segments) == 20
    assert set(universe.atoms.radii) == {30.0} and set(universe.atoms.types) == {"ACT"}
    masses = [own.type.node_masses(len(own.nodes)) for own in run.filaments]
    np.testing.assert_allclose(universe.atoms.masses, np.concatenate(masses), rtol=1e-6)
    universe.trajectory[4]
    np.testing.assert_allclose(universe.atoms.positions, 10.0 * run.positions(4), rtol=1e-6)
    np.testing.assert_allclose(universe.dimensions, [4000.0, 4000.0, 5000.0, 90.0, 90.0, 90.0])
    np.testing.assert_allclose(universe.bonds.bonds(), 1000.0, atol=60.0)


def test_radii_of_mdanalysis_are_those_of_each_filament(two_types):
    run = analysis.load(two_types)
    atoms = run.mdanalysis().atoms
    assert len(atoms) == sum(len(own.nodes) for own in run.filaments)
    for own in run.filaments:
        np.testing.assert_allclose(atoms.radii[own.nodes], 5.0 * own.diameter)


def test_radii_of_gyration_of_mdanalysis_are_weighted_by_masses_also_of_clamped_nodes(tmp_path):
    filaments = Filaments(602.0, 300.0)
    filaments.add_straight(F_ACTIN.with_segment_length(100.0), 5, [0, 0, 0], [1, 0, 0], clamped=[0])
    topology, system, positions = filaments.build()
    integrator = filaments.create_integrator(system, 1e3, random_seed=1)
    simulation = app.Simulation(topology, system, integrator, openmm.Platform.getPlatform("CPU"))
    simulation.context.setPositions(positions)
    simulation.reporters.append(RunReporter(tmp_path / "run", 5, filaments))
    simulation.step(5)
    run = analysis.load(tmp_path / "run")
    segment_file = MDAnalysis.Universe(str(tmp_path / "run/topology.psf"), str(tmp_path / "run/trajectory.dcd"))
    masses = np.array([1.0, 2.0, 2.0, 2.0, 2.0, 1.0])
    for universe in (run.mdanalysis(), segment_file):
        for frame in range(2):
            universe.trajectory[frame]
            places = run.positions(frame)
            center = np.average(places, axis=0, weights=masses)
            radius = np.sqrt(np.average(np.sum((places - center) ** 2, axis=1), weights=masses))
            np.testing.assert_allclose(universe.atoms.center_of_mass(), 10.0 * center, rtol=1e-5, atol=1e-3)
            assert universe.atoms.radius_of_gyration() == pytest.approx(10.0 * radius, rel=1e-5)


@pytest.mark.parametrize(("name", "kind"), [("topology.psf", "PSF"), ("topology.data", "DATA")])
def test_mdanalysis_reads_the_files_as_they_are(two_types, network, name, kind):
    for directory in (two_types, network):
        run = analysis.load(directory)
        universe = MDAnalysis.Universe(str(directory / name), str(directory / "trajectory.dcd"), topology_format=kind)
        expected = [(node, node + 1) for own in run.filaments for node in own.nodes[:-1]]
        assert sorted(map(tuple, np.sort(universe.bonds.indices, axis=1))) == expected
        if kind == "PSF":
            np.testing.assert_allclose(universe.atoms.masses, run.mdanalysis().atoms.masses)
        # The header of a DCD file has the time between frames in single precision.
        np.testing.assert_allclose([frame.time for frame in universe.trajectory], run.times, rtol=1e-7)
        universe.trajectory[-1]
        np.testing.assert_allclose(universe.atoms.positions, 10.0 * run.positions(-1), rtol=1e-6)
        if run.box is not None:
            np.testing.assert_allclose(universe.dimensions[:3], 10.0 * np.diag(run.box))


def test_linkers_of_frames(network):
    run = analysis.load(network)
    assert [own.name for own in run.linker_types] == ["alpha-actinin", "motor"]
    records = np.load(network / "linkers.npy")
    assert len(run.linkers) == len(run) == 11
    assert np.concatenate(run.linkers).tobytes() == records.tobytes()
    for frame, linkers in enumerate(run.linkers):
        assert set(linkers["step"]) == {run.steps[frame]}
        doubly = (linkers["filaments"] >= 0).all(axis=1)
        for kind in (0, 1):
            assert (doubly & (linkers["type"] == kind)).sum() == run.linker_table["both hands bound"][frame, kind]
    # Hands are on the filaments where the trajectory has them.
    one = run.linkers[6][0]
    hand = int(np.argmax(one["filaments"] >= 0))
    nodes = run.nodes(6)[one["filaments"][hand]]
    segment, fraction = divmod(one["arc_lengths"][hand] / 100.0, 1.0)
    place = (1 - fraction) * nodes[int(segment)] + fraction * nodes[int(segment) + 1]
    np.testing.assert_allclose(one["places"][hand], place, atol=1e-3)


def test_segment_tensions(two_types):
    run = analysis.load(two_types)
    positions = [run.positions(frame)[run.filaments[1].nodes] for frame in range(FRAMES)]
    lengths = np.linalg.norm(np.diff(positions, axis=1), axis=-1)
    tensions = F_ACTIN.segment_stiffness * (lengths - 360.0)
    np.testing.assert_allclose(run.segment_tensions(4)[1], tensions[4], rtol=1e-9)
    np.testing.assert_allclose(run.segment_tensions(4, average=5)[1], tensions[2:7].mean(axis=0), rtol=1e-9)
    np.testing.assert_allclose(run.segment_tensions(30, average=3)[1], tensions[29:].mean(axis=0), rtol=1e-9)
    with pytest.raises(InputError, match="average"):
        run.segment_tensions(4, average=0)


def test_directories_that_are_no_runs(tmp_path, two_types):
    with pytest.raises(InputError, match="not a directory"):
        analysis.load(tmp_path / "missing")
    with pytest.raises(InputError, match="nothing has run into it"):
        analysis.load(tmp_path)
    copy = copied(two_types, tmp_path)
    (copy / "energies.csv").rename(copy / "other.csv")
    with pytest.raises(InputError, match=r"lacks energies\.csv"):
        analysis.load(copy)
    (copy / "description.json").unlink()
    with pytest.raises(InputError, match="older version"):
        analysis.load(copy)


def test_damaged_files(tmp_path, two_types, network):
    copy = copied(two_types, tmp_path)
    (copy / "description.json").write_text("{}")
    with pytest.raises(InputError, match="does not describe a run"):
        analysis.load(copy)
    shutil.copy(network / "description.json", copy)
    shutil.copy(network / "linkers.csv", copy)
    shutil.copy(network / "linkers.npy", copy)
    with pytest.raises(InputError, match="not of one run"):
        analysis.load(copy)
    shutil.copy(two_types / "description.json", copy)
    (copy / "trajectory.dcd").write_bytes(b"nothing")
    with pytest.raises(InputError, match="not a DCD trajectory"):
        analysis.load(copy)
    shutil.copy(two_types / "trajectory.dcd", copy)
    text = (copy / "energies.csv").read_text()
    (copy / "energies.csv").write_text(re.sub(r"(?m)^50,", "55,", text))
    with pytest.raises(InputError, match="a line for each frame"):
        analysis.load(copy)
    (copy / "energies.csv").write_text(text.replace(",", ";", 40))
    with pytest.raises(InputError, match="damaged"):
        analysis.load(copy)


@pytest.mark.parametrize(
    ("file", "bytes_less", "frames"), [("trajectory.dcd", 1, 30), ("trajectory.dcd", 700, 28), ("energies.csv", 3, 30)]
)
def test_incomplete_runs(tmp_path, two_types, file, bytes_less, frames):
    copy = copied(two_types, tmp_path)
    cut(copy / file, bytes_less)
    with pytest.raises(InputError, match=f"incomplete: it has {frames} of 31 frames.*--resume"):
        analysis.load(copy)
    run = analysis.load(copy, incomplete=True)
    assert len(run) == frames and not run.complete
    whole = analysis.load(two_types)
    np.testing.assert_array_equal(run.positions(-1), whole.positions(frames - 1))
    np.testing.assert_array_equal(run.times, whole.times[:frames])


def test_a_frame_without_its_linkers_does_not_count(tmp_path, network):
    copy = copied(network, tmp_path)
    cut(copy / "energies.csv", 3)
    records = np.load(copy / "linkers.npy")
    np.save(copy / "linkers.npy", records[records["step"] < 180])
    assert len(analysis.load(copy, incomplete=True)) == 9


def test_a_run_that_goes_on(two_types):
    with open(two_types / ".lock", "a+b") as lock:
        fcntl.flock(lock.fileno(), fcntl.LOCK_EX)
        with pytest.raises(InputError, match="still going on"):
            analysis.load(two_types)
        assert len(analysis.load(two_types, incomplete=True)) == FRAMES
    assert len(analysis.load(two_types)) == FRAMES


def test_far_from_the_origin_the_trajectory_is_coarse(tmp_path):
    near = TWO_TYPES.replace("count = 3", 'position = ["0 nm", "2 um", "0 nm"]').replace('"3 ms"', '"0.2 ms"')
    run = analysis.load(simulated(tmp_path, near))
    assert run.coordinate_resolution < 1e-3
    (tmp_path / "far").mkdir()
    out = simulated(tmp_path / "far", near.replace("2 um", "1 m"))
    with pytest.warns(PrecisionWarning, match="far from the origin"):
        run = analysis.load(out)
    # 1 m is between 2^33 and 2^34 angstrom; a significand has 24 bits.
    assert run.coordinate_resolution == pytest.approx(0.1 * 2**10)
    with pytest.warns(PrecisionWarning, match="far from the origin"):
        run.segment_tensions(0)


def test_walls_are_described():
    configuration = parse_configuration(TWO_TYPES)
    filaments = placed_filaments(configuration)
    topology, system, _ = filaments.build()
    for shape in (Sphere([1, 2, 3], 5e4), Box([-1e4] * 3, [2e4] * 3), Cylinder([0, 0, 1], [0, 0, 2], 3e4)):
        system.addForce(filament_wall_force(filaments, system, shape, 1.0))
    held = {"stiffness": 1.0, "particles": tuple(range(24)), "radii": (0.0,) * 24}
    assert describe(configuration, filaments, system, topology).walls == (
        DescribedWall("sphere", (1.0, 2.0, 3.0), (0.0, 0.0, 0.0), 5e4, **held),
        DescribedWall("box", (-1e4,) * 3, (2e4,) * 3, 0.0, **held),
        DescribedWall("cylinder", (0.0, 0.0, 1.0), (0.0, 0.0, 1.0), 3e4, **held),
    )


def test_description_is_kept_as_it_is(tmp_path):
    description = RunDescription(
        title="µ",
        temperature=310.0,
        time_step=1.3e9 / 7.0,
        steps=70,
        steps_per_frame=7,
        particles=12,
        filaments=(
            DescribedFilament(F_ACTIN, (0, 1, 2), True),
            DescribedFilament(DSDNA_BASE_PAIRS, (3, 4, 5, 6), False, (0, 1)),
            DescribedFilament(MICROTUBULE, (7, 8)),
            DescribedFilament(F_ACTIN, (9, 10, 11)),
        ),
        box=((1.0, 0.0, 0.0), (0.0, 2.0, 0.0), (0.0, 0.0, 3.0)),
        linkers=(DescribedLinkers("motor", 0.1, 30.0),),
        walls=(DescribedWall("sphere", (1.0, 2.0, 3.0), (0.0, 0.0, 0.0), 50.0, 0.3, (0, 2), (1.0, 1.5)),),
        contacts=(
            DescribedContacts(
                0.1, True, (((0, 1, 2), 8.0, 2, True), ((7, 8), 25.0, 1, False)), ((12, 3.0),), ((0, 1, 1, 0),)
            ),
        ),
        others=(DescribedParticles("BEAD", (12, 13), 3.0), DescribedParticles("ION", (14,), 0.0)),
    )
    description.write(tmp_path / "description.json")
    assert read_run_description(tmp_path / "description.json") == description
