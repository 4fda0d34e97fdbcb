"""Runs from Python that are loaded, drawn and exported as those of ``openmm-cylchain run`` are."""

import dataclasses
import json
import shutil

import gsd.hoomd
import numpy as np
import pytest
from openmm import NonbondedForce, Platform, System, app, unit
from PIL import Image

from openmm_cylchain import (
    F_ACTIN,
    Crosslinks,
    FilamentReporter,
    Filaments,
    InputError,
    RunReporter,
    Sphere,
    analysis,
    capsule_contact_force,
    filament_wall_force,
)
from openmm_cylchain.cli import main
from openmm_cylchain.runs.configuration import parse_configuration
from openmm_cylchain.runs.run import create_simulation
from openmm_cylchain.units.quantities import PICONEWTON
from support.small_runs import NETWORK, simulated

WALL = Sphere([0, 0, 0], 2000.0)


def two_filaments(wall=True, box=None):
    """A Simulation of two actin filaments with a crosslink that is 40 nm long, its Filaments and Crosslinks."""
    filaments = Filaments(602.214, 300.0)
    for height in (0.0, 40.0):
        filaments.add_straight(F_ACTIN, segments=4, start=(-720.0, 0.0, height), direction=(1, 0, 0))
    topology, system, positions = filaments.build(box)
    links = Crosslinks(1.0, 30.0)
    links.add(None, filaments.segment_place(0, arc_length=500.0), filaments.segment_place(1, arc_length=500.0))
    links.add_to(system)
    if wall:
        system.addForce(filament_wall_force(filaments, system, WALL, 0.1, radius=3.0))
        system.addForce(capsule_contact_force(filaments, system, 10.0))
    integrator = filaments.create_integrator(system, 10 * unit.microsecond, random_seed=3)
    simulation = app.Simulation(topology, system, integrator, Platform.getPlatformByName("Reference"))
    simulation.context.setPositions(positions)
    return simulation, filaments, links


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    """A run of 6 frames: a crosslink, two from frame 2 on, none from frame 4 on."""
    path = tmp_path_factory.mktemp("runs") / "run"
    simulation, filaments, links = two_filaments()
    simulation.reporters.append(RunReporter(path, 5, filaments, "two filaments"))
    lengths = FilamentReporter(None, 5, filaments)
    simulation.reporters.append(lengths)
    simulation.step(5)
    links.add(simulation.context, int(filaments.node_indices[0][0]), (-720.0, 0.0, -50.0), 2.0, 45.0)
    simulation.step(10)
    links.remove(simulation.context, [0, 1])
    simulation.step(10)
    return path, filaments, lengths, simulation.context.getState(positions=True).getPositions(asNumpy=True)._value


def test_frames_energies_and_description(written):
    path, filaments, lengths, positions = written
    run = analysis.load(path)
    assert (len(run), run.title, run.temperature, run.complete) == (6, "two filaments", 300.0, True)
    np.testing.assert_allclose(run.times, 5e7 * np.arange(6))
    np.testing.assert_array_equal(run.steps, 5 * np.arange(6))
    np.testing.assert_allclose(run.positions(-1), positions, atol=1e-3)
    np.testing.assert_allclose(
        PICONEWTON * run.energies["bending energy (pN nm)"][1:], lengths["bending_energy"].sum(axis=1), rtol=1e-9
    )
    assert [own.type for own in run.filaments] == [F_ACTIN] * 2 and run.box is None
    (wall,) = run.walls
    assert isinstance(wall, Sphere) and wall.radius == 2000.0
    np.testing.assert_allclose(run.mdtraj().time, run.times)
    assert run.mdanalysis().trajectory[3].time == pytest.approx(1.5e8)


def test_crosslinks_come_and_go(written):
    run = analysis.load(written[0])
    assert [len(run.crosslinks(frame)) for frame in range(6)] == [1, 1, 2, 2, 0, 0]
    for frame in range(4):
        nodes = run.nodes(frame)
        # 500 nm from the first node is 140 nm into the second segment.
        ends = [own[1] + (own[2] - own[1]) * 140.0 / 360.0 for own in nodes]
        found = run.crosslinks(frame)
        np.testing.assert_allclose(found.places[0], ends, atol=1e-3)
        length = np.linalg.norm(ends[1] - ends[0])
        assert found.tensions[0] == pytest.approx(length - 30.0, abs=1e-3)
    found = run.crosslinks(3)
    np.testing.assert_array_equal(found.numbers, [0, 1])
    np.testing.assert_allclose(found.places[1], [run.nodes(3)[0][0], [-720.0, 0.0, -50.0]], atol=1e-3)
    extension = np.linalg.norm(run.nodes(3)[0][0] - [-720.0, 0.0, -50.0]) - 45.0
    assert found.tensions[1] == pytest.approx(2.0 * extension, abs=3e-3)


def test_they_are_drawn_and_exported(written, tmp_path):
    path = str(written[0])
    pictures = []
    for frame in ("0", "-1"):
        picture = tmp_path / "picture.png"
        assert main(["render", path, "--frame", frame, "--size", "320x240", "--output", str(picture)]) == 0
        pictures.append(np.asarray(Image.open(picture)).astype(int))
    # Orange as crosslinks are, beside the legend.
    orange = [np.sum(own[80:, :, 0] - own[80:, :, 2] > 80) for own in pictures]
    assert orange[0] > 5 and orange[1] == 0
    for kind, name in (("simularium", "a.simularium"), ("ovito", "a.gsd"), ("vmd", "a.tcl")):
        assert main(["export", path, "--format", kind, "--output", str(tmp_path / name)]) == 0
    content = json.loads((tmp_path / "a.simularium").read_text())
    names = [own["name"] for own in content["trajectoryInfo"]["typeMapping"].values()]
    assert names == ["ACT", "crosslink", "crosslink#hand", "wall"]
    assert min(content["trajectoryInfo"]["size"].values()) > 4000.0
    with gsd.hoomd.open(str(tmp_path / "a.gsd")) as file:
        assert file[0].particles.types == ["ACT", "crosslink hand", "wall"]
        counts = [np.bincount(frame.bonds.typeid, minlength=3)[:2].tolist() for frame in file]
        assert counts == [[8, 1], [8, 1], [8, 2], [8, 2], [8, 0], [8, 0]]
        ends = file[0].particles.position[file[0].bonds.group[file[0].bonds.typeid == 1]]
        assert np.linalg.norm(ends[0, 1] - ends[0, 0]) == pytest.approx(400.0, abs=0.1)
        around = file[0].particles.position[file[0].particles.typeid == 2]
        np.testing.assert_allclose(np.linalg.norm(around, axis=1).max(), 2e4, rtol=0.02)
    script = (tmp_path / "a.tcl").read_text()
    assert script.count("lappend links") == 6 and "set walls {{{" in script


def test_it_goes_on_from_a_checkpoint(tmp_path):
    """As if it had not stopped, to the bit, whatever was written behind the checkpoint."""
    paths = [tmp_path / "straight", tmp_path / "stopped"]
    for path in paths:
        simulation, filaments, links = two_filaments(wall=False)
        simulation.reporters.append(RunReporter(path, 5, filaments))
        simulation.step(12)
        if path == paths[1]:
            simulation.saveCheckpoint(str(tmp_path / "checkpoint"))
            links.add(simulation.context, 0, 6)
            simulation.step(10)
            simulation.reporters[0].close()
            simulation, filaments, links = two_filaments(wall=False)
            simulation.loadCheckpoint(str(tmp_path / "checkpoint"))
            simulation.reporters.append(RunReporter(path, 5, filaments, append=True))
        simulation.step(13)
        links.add(simulation.context, 1, 7)
        simulation.step(10)
        simulation.reporters[0].close()
    for name in ("trajectory.dcd", "energies.csv", "description.json", "topology.cif"):
        one, other = ((path / name).read_bytes() for path in paths)
        # OpenMM writes the time at which it has begun a DCD file.
        assert one[260:] == other[260:] and one[:180] == other[:180], name
    one, other = map(analysis.load, paths)
    assert len(one) == len(other) == 8
    for frame in range(8):
        np.testing.assert_array_equal(one.crosslinks(frame).places, other.crosslinks(frame).places)
    assert [len(other.crosslinks(frame)) for frame in range(8)] == [1] * 6 + [2] * 2


def test_twists_go_on_from_a_checkpoint(tmp_path):
    """Of rings; a filament without twist has none."""
    kind = dataclasses.replace(F_ACTIN, torsional_rigidity=F_ACTIN.bending_rigidity)
    paths = [tmp_path / "straight", tmp_path / "stopped"]
    for path in paths:
        for begins in (True, False) if path == paths[1] else (True,):
            filaments = Filaments(602.214, 300.0)
            filaments.add_straight(F_ACTIN, 4, [0, 0, 0], [0, 0, 1])
            filaments.add_ring(kind, 8, [5000, 0, 0])
            topology, system, positions = filaments.build()
            integrator = filaments.create_integrator(system, 1e6, random_seed=2)
            simulation = app.Simulation(topology, system, integrator, Platform.getPlatform("Reference"))
            simulation.context.setPositions(positions)
            if begins:
                filaments.in_context(simulation.context).set_twists(1, np.full(8, 0.1))
            else:
                simulation.loadCheckpoint(str(tmp_path / "twisted"))
            simulation.reporters.append(RunReporter(path, 5, filaments, append=not begins))
            simulation.step(13 if begins else 12)
            if begins:
                simulation.saveCheckpoint(str(tmp_path / "twisted"))
                simulation.step(12)
            simulation.reporters[0].close()
    one, other = map(analysis.load, paths)
    assert (paths[0] / "twists.npy").read_bytes() == (paths[1] / "twists.npy").read_bytes()
    assert len(one) == len(other) == 6 and len(one.twists(-1)[0]) == 0
    np.testing.assert_array_equal(one.twists(-1)[1], filaments.in_context(simulation.context).twists(1)._value)
    assert [len(own) for own in other.material_frames(3)] == [0, 8]


@pytest.mark.filterwarnings("ignore::openmm_cylchain.TimeStepWarning")
def test_linkers_are_as_those_of_a_configuration(tmp_path):
    """The same network as a run from a file: linkers of the same places and tables of the same columns."""
    folder = simulated(tmp_path, NETWORK)
    simulation, built = create_simulation(parse_configuration(NETWORK))
    simulation.context.setPositions(built.positions)
    simulation.reporters.append(RunReporter(tmp_path / "python", 20, built.filaments, "network"))
    simulation.step(200)
    expected, found = analysis.load(folder), analysis.load(tmp_path / "python")
    np.testing.assert_array_equal(found.box, expected.box)
    for frame in range(len(expected)):
        np.testing.assert_array_equal(found.positions(frame), expected.positions(frame))
        assert found.linkers[frame].tobytes() == expected.linkers[frame].tobytes()
    for name in ("energies.csv", "linkers.csv"):
        assert (folder / name).read_text() == (tmp_path / "python" / name).read_text()


def test_particles_beside_filaments_have_diameters(tmp_path):
    """Those that are given, else those of contacts, else the sigma of Lennard-Jones, else none."""
    filaments = Filaments(602.214, 300.0)
    filaments.add_straight(F_ACTIN, segments=2, start=(0, 0, 0), direction=(1, 0, 0))
    filaments.add_attachment(0, arc_length=200.0)
    topology, system = app.Topology(), System()
    force = NonbondedForce()
    system.addForce(force)
    chain = topology.addChain()
    for name in ("LJ", "NEUT", "BALL", "BALL", "NAMED"):
        topology.addAtom("P", None, topology.addResidue(name, chain))
        system.addParticle(1.0)
        force.addParticle(0.0, 7.0, 0.0 if name == "NEUT" else 1e-6)
    places = [[0.0, 500.0 * (1 + number), 0.0] for number in range(5)]
    positions = filaments.add_to(topology, system, np.array(places))
    system.addForce(capsule_contact_force(filaments, system, 10.0, particles=[2, 3], particle_diameter=[20.0, 30.0]))
    integrator = filaments.create_integrator(system, 1 * unit.nanosecond, particle_friction=1e4)
    simulation = app.Simulation(topology, system, integrator, Platform.getPlatformByName("CPU"))
    simulation.context.setPositions(positions)
    named = {"NAMED": 0.1 * unit.micrometer}
    simulation.reporters.append(RunReporter(tmp_path / "run", 1, filaments, particle_diameters=named))
    simulation.step(2)
    run = analysis.load(tmp_path / "run")
    assert [(own.name, own.indices.tolist(), own.diameter) for own in run.particles] == [
        ("LJ", [0], 7.0),
        ("NEUT", [1], 0.0),
        ("BALL", [2], 20.0),
        ("BALL", [3], 30.0),
        ("NAMED", [4], 100.0),
    ]
    assert main(["render", str(run.path), "--size", "160x120", "--output", str(tmp_path / "picture.png")]) == 0
    for diameters, message in (({"PRT": 5.0}, "residues are named ACT, BALL"), ({"LJ": -1.0}, "diameter of 'LJ'")):
        with pytest.raises(InputError, match=message):
            simulation.reporters.append(RunReporter(tmp_path / "other", 1, filaments, particle_diameters=diameters))
            simulation.step(1)
        simulation.reporters.pop()
    with pytest.raises(InputError, match="by names of residues"):
        RunReporter(tmp_path / "other", 1, filaments, particle_diameters=5.0)


def test_what_is_refused(written, tmp_path):
    path, filaments, *_ = written
    with pytest.raises(InputError, match="holds a run already"):
        RunReporter(path, 5, filaments)
    with pytest.raises(InputError, match="holds no run"):
        RunReporter(tmp_path / "none", 5, filaments, append=True)
    with pytest.raises(InputError, match="must be a Filaments object, but is str"):
        RunReporter(tmp_path / "none", 5, "filaments")
    with pytest.raises(InputError, match="must be Shapes"):
        RunReporter(tmp_path / "none", 5, filaments, walls=["sphere"])
    with pytest.raises(InputError, match="reportInterval"):
        RunReporter(tmp_path / "none", 0, filaments)
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match="is a file"):
        RunReporter(tmp_path / "file", 5, filaments)
    assert not (tmp_path / "none").exists()
    damaged = shutil.copytree(path, tmp_path / "damaged")
    with open(damaged / "trajectory.dcd", "r+b") as file:
        file.truncate(600)
    simulation, own, _ = two_filaments()
    simulation.context.setStepCount(25)
    simulation.reporters.append(RunReporter(damaged, 5, own, append=True))
    with pytest.raises(InputError, match="damaged"):
        simulation.step(1)
