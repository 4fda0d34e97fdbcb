"""Exports of runs, read again: fibers, bonds, radii, linkers and times."""

import json
import sys

import gsd.hoomd
import numpy as np
import pytest

from openmm_cylchain import analysis
from openmm_cylchain.cli import main
from support.small_runs import AMONG_SPHERES, NETWORK, TWO_TYPES, simulated

ENDINGS = {"simularium": "simularium", "ovito": "gsd", "vmd": "tcl"}


@pytest.fixture(scope="module")
def two_types(tmp_path_factory):
    return simulated(tmp_path_factory.mktemp("two"), TWO_TYPES.replace("two types", "[two] {types} $x"))


@pytest.fixture(scope="module")
def among_spheres(tmp_path_factory):
    return simulated(tmp_path_factory.mktemp("spheres"), AMONG_SPHERES)


@pytest.fixture(scope="module")
def network(tmp_path_factory):
    return simulated(tmp_path_factory.mktemp("network"), NETWORK)


def exported(run, tmp_path, kind):
    path = tmp_path / f"file.{ENDINGS[kind]}"
    assert main(["export", str(run), "--format", kind, "--output", str(path)]) == 0
    assert list(tmp_path.iterdir()) == [path]
    return path


def agents_of(frame):
    """(shape, number, type, position, radius, subpoints) of the agents of a frame of a Simularium file."""
    data, place = frame["data"], 0
    while place < len(data):
        points = int(data[place + 10])
        shape, number, kind = (int(value) for value in data[place : place + 3])
        subpoints = np.reshape(data[place + 11 : place + 11 + points], (-1, 3))
        yield shape, number, kind, np.array(data[place + 3 : place + 6]), data[place + 9], subpoints
        place += 11 + points
    assert place == len(data)


def test_simularium_fibers_and_times(two_types, tmp_path):
    content = json.loads(exported(two_types, tmp_path, "simularium").read_text())
    run, information = analysis.load(two_types), content["trajectoryInfo"]
    assert information["timeUnits"] == {"magnitude": 1.0, "name": "ms"}
    assert information["timeStepSize"] == pytest.approx(0.1) and information["totalSteps"] == 31
    frames = content["spatialData"]["bundleData"]
    assert [frame["time"] for frame in frames] == pytest.approx(list(run.times / 1e9))
    assert content["spatialData"]["bundleSize"] == len(frames) == 31
    names = {int(key): own["name"] for key, own in information["typeMapping"].items()}
    size = np.array([information["size"][axis] for axis in "xyz"])
    for frame in (0, 30):
        agents = list(agents_of(frames[frame]))
        assert [number for _, number, *_ in agents] == [0, 1, 2, 3]
        shift = agents[0][5][0] - run.nodes(frame)[0][0]
        for (shape, _, kind, position, radius, points), own, nodes in zip(agents, run.filaments, run.nodes(frame)):
            assert (shape, names[kind], radius) == (1001, own.type.name, 0.5 * own.diameter)
            np.testing.assert_allclose(points, nodes + shift, atol=2e-4)
            assert not position.any() and np.all(np.abs(points) < 0.5 * size)


def test_simularium_linkers(network, tmp_path):
    content = json.loads(exported(network, tmp_path, "simularium").read_text())
    run, mapping = analysis.load(network), content["trajectoryInfo"]["typeMapping"]
    assert content["trajectoryInfo"]["size"] == {"x": 400.0, "y": 400.0, "z": 500.0}
    shapes = {own["name"]: own["geometry"]["displayType"] for own in mapping.values()}
    assert shapes == {
        "ACT": "FIBER",
        "alpha-actinin": "FIBER",
        "alpha-actinin#hand": "SPHERE",
        "motor": "FIBER",
        "motor#hand": "SPHERE",
    }
    middle = np.array([200.0, 200.0, 250.0])
    for frame in (0, 10):
        records = run.linkers[frame]
        there = ~np.isnan(records["places"]).any(axis=2)
        agents = list(agents_of(content["spatialData"]["bundleData"][frame]))
        assert len({number for _, number, *_ in agents}) == len(agents)
        for kind, name in enumerate(("alpha-actinin", "motor")):
            own = records["type"] == kind
            hands = [agent for agent in agents if mapping[str(agent[2])]["name"] == f"{name}#hand"]
            springs = [agent for agent in agents if mapping[str(agent[2])]["name"] == name]
            assert len(springs) == there[own].all(axis=1).sum() and all(agent[0] == 1000 for agent in hands)
            np.testing.assert_allclose(
                [own[3] for own in hands], records["places"][own][there[own]] - middle, atol=2e-4
            )


def test_ovito_has_bonds_radii_linkers_and_times(network, tmp_path):
    run = analysis.load(network)
    with gsd.hoomd.open(str(exported(network, tmp_path, "ovito"))) as file:
        assert len(file) == len(run)
        for number, frame in enumerate(file):
            assert frame.log["time_ps"][0] == run.times[number] and frame.configuration.step == run.steps[number]
            np.testing.assert_allclose(frame.configuration.box, [4000, 4000, 5000, 0, 0, 0])
            there = ~np.isnan(run.linkers[number]["places"]).any(axis=2)
            springs = there.all(axis=1).sum()
            assert frame.particles.N == 100 + there.sum() + 2 * springs and frame.bonds.N == 80 + springs
            assert frame.particles.types == ["ACT", "alpha-actinin hand", "motor hand"]
            assert set(frame.particles.diameter[:100]) == {60.0}
            positions = np.concatenate(run.nodes(number)) - [200.0, 200.0, 250.0]
            np.testing.assert_allclose(frame.particles.position[:100], 10.0 * positions, atol=2e-3)
            vectors = np.diff(frame.particles.position[frame.bonds.group], axis=1)[:, 0]
            lengths = np.linalg.norm(vectors, axis=1)
            np.testing.assert_allclose(lengths[:80], 1000.0, atol=60.0)
            records = run.linkers[number][there.all(axis=1)]
            expected = 10.0 * np.linalg.norm(records["places"][:, 1] - records["places"][:, 0], axis=1)
            np.testing.assert_allclose(np.sort(lengths[80:]), np.sort(expected), rtol=1e-3)


def test_particles_are_spheres_in_every_export(among_spheres, tmp_path):
    run, middle = analysis.load(among_spheres), np.array([200.0, 200.0, 250.0])
    places, diameters = run.positions(2)[10:], [80.0] * 3 + [40.0] * 2
    for folder in ENDINGS:
        (tmp_path / folder).mkdir()
    content = json.loads(exported(among_spheres, tmp_path / "simularium", "simularium").read_text())
    names = {int(key): own["name"] for key, own in content["trajectoryInfo"]["typeMapping"].items()}
    spheres = [own for own in agents_of(content["spatialData"]["bundleData"][2]) if own[0] == 1000]
    assert [names[kind] for _, _, kind, *_ in spheres] == ["BIG"] * 3 + ["SMALL"] * 2
    assert [2.0 * radius for *_, radius, _ in spheres] == diameters
    np.testing.assert_allclose([own[3] for own in spheres], places - middle, atol=2e-4)
    with gsd.hoomd.open(str(exported(among_spheres, tmp_path / "ovito", "ovito"))) as file:
        particles = file[2].particles
    assert particles.types == ["ACT", "BIG", "SMALL"]
    assert particles.typeid.tolist() == [0] * 10 + [1] * 3 + [2] * 2
    np.testing.assert_allclose(particles.diameter[10:], 10.0 * np.array(diameters))
    np.testing.assert_allclose(particles.position[10:], 10.0 * (places - middle), atol=2e-3)
    np.testing.assert_allclose(run.mdanalysis().atoms.radii[10:], 5.0 * np.array(diameters))
    calls = _calls_of_vmd(exported(among_spheres, tmp_path / "vmd", "vmd"), 2)
    for indices, diameter in (("10 11 12", 80.0), ("13 14", 40.0)):
        assert ("atomselect", "5", f"index {indices}") in calls and ("mol", "selection", f"index {indices}") in calls
        assert ("selected", "set", "radius", f"{5.0 * diameter:g}") in calls
    assert len([call for call in calls if call[:3] == ("mol", "representation", "VDW")]) == 2


def test_ovito_without_a_box(two_types, tmp_path):
    with gsd.hoomd.open(str(exported(two_types, tmp_path, "ovito"))) as file:
        frame = file[12]
        assert np.all(np.abs(frame.particles.position) < 0.2 * frame.configuration.box[:3])
        assert frame.bonds.N == 20 and set(frame.bonds.typeid[18:]) == {1}
        assert len(set(frame.particles.diameter)) == 2


def test_ovito_without_gsd(two_types, tmp_path, monkeypatch, capsys):
    monkeypatch.setitem(sys.modules, "gsd", None)
    monkeypatch.setitem(sys.modules, "gsd.hoomd", None)
    assert main(["export", str(two_types), "--format", "ovito", "--output", str(tmp_path / "a.gsd")]) == 2
    assert "pip install gsd" in capsys.readouterr().err


def test_vmd_runs_the_script(network, tmp_path):
    calls, run = _calls_of_vmd(exported(network, tmp_path, "vmd"), 7), analysis.load(network)
    assert ("mol", "new", str(network.resolve() / "topology.psf"), "type", "psf", "waitfor", "all") in calls
    assert [call[2] for call in calls if call[:2] == ("mol", "addfile")] == [str(network.resolve() / "trajectory.dcd")]
    (licorice,) = [call[2:] for call in calls if call[:2] == ("mol", "representation")]
    assert licorice[0] == "Licorice" and float(licorice[1]) >= 30.0 and calls.count(("pbc", "box", "-molid", "5")) == 1
    drawn = [call for call in calls if call[0] == "graphics" and call[2] == "cylinder"]
    places = [record["places"] for record in run.linkers[7] if not np.isnan(record["places"]).any()]
    assert len(drawn) == len(places)
    ends = np.array([[[float(x) for x in point.split()] for point in call[3:5]] for call in drawn])
    np.testing.assert_allclose(np.sort(ends.ravel()), np.sort(10.0 * np.ravel(places)), rtol=1e-4, atol=2e-3)
    (text,) = [call[4] for call in calls if call[0] == "graphics" and call[2] == "text"]
    assert text == "0.7 ms"


def test_vmd_quotes_titles(two_types, tmp_path):
    calls = _calls_of_vmd(exported(two_types, tmp_path, "vmd"), 0)
    assert ("mol", "rename", "5", "[two] {types} $x") in calls
    assert len([call for call in calls if call[:2] == ("mol", "addrep")]) == 2


def _calls_of_vmd(path, frame):
    # The script in a Tcl interpreter, with VMD's commands noted.
    tkinter = pytest.importorskip("tkinter", reason="no Tcl interpreter in this Python")
    interpreter, calls = tkinter.Tcl(), []

    def command(name):
        def note(*arguments):
            calls.append((name, *map(str, arguments)))
            return {"mol": 5, "molinfo": frame, "atomselect": "selected"}.get(name, "")

        return note

    for name in ("mol", "molinfo", "atomselect", "selected", "color", "display", "graphics", "pbc"):
        interpreter.createcommand(name, command(name))
    interpreter.eval("package provide pbctools 1")
    interpreter.evalfile(str(path))
    first = len(calls)
    interpreter.eval("set vmd_frame(5) 1")
    redrawn = [call for call in calls[first:] if call[0] == "graphics"]
    before = [call for call in calls[:first] if call[0] == "graphics"]
    assert redrawn == before and redrawn
    return calls[:first]


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--format", "pdb", "--output", "a.pdb"], "--format must be one of simularium, ovito, vmd"),
        (["--format", "ovito", "--output", "a.xyz"], "must end in .gsd"),
        (["--format", "vmd", "--output", "no/a.tcl"], "is not a directory"),
    ],
)
def test_refusals(two_types, tmp_path, monkeypatch, capsys, options, message):
    monkeypatch.chdir(tmp_path)
    assert main(["export", str(two_types), *options]) == 2
    assert message in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


@pytest.mark.slow
def test_ovito_itself_reads_bonds_times_and_radii(two_types, tmp_path):
    """Its Python module, without a display."""
    ovito_io = pytest.importorskip("ovito.io")
    pipeline = ovito_io.import_file(str(exported(two_types, tmp_path, "ovito")))
    run = analysis.load(two_types)
    assert pipeline.source.num_frames == len(run.times) == 31
    for frame in (0, 30):
        data = pipeline.compute(frame)
        assert data.attributes["time_ps"] == pytest.approx(run.times[frame])
        nodes = np.concatenate(list(run.nodes(frame)))
        bonds = np.array(data.particles.bonds["Topology"])
        counts = [len(own) for own in run.nodes(frame)]
        first = np.cumsum([0, *counts[:-1]])
        expected = [(start + i, start + i + 1) for start, count in zip(first, counts) for i in range(count - 1)]
        assert sorted(map(tuple, np.sort(bonds, axis=1))) == expected
        positions, lengths = np.array(data.particles["Position"]), np.linalg.norm
        for a, b in expected:
            assert lengths(positions[a] - positions[b]) == pytest.approx(lengths(nodes[a] - nodes[b]) * 10.0, abs=0.01)
        diameters = [own.diameter for own in run.filaments for _ in range(len(own.nodes))]
        assert np.array(data.particles["Radius"]) == pytest.approx(5.0 * np.array(diameters), rel=1e-6)


@pytest.mark.slow
def test_simulariums_own_reader_reads_fibers_times_and_radii(two_types, tmp_path):
    # With pandas 3, whose arrays are read-only, it reads no file at all: CI has an older one.
    simulariumio = pytest.importorskip("simulariumio")
    path = exported(two_types, tmp_path, "simularium")
    data, run = (
        simulariumio.FileConverter(simulariumio.InputFileData(file_path=str(path)))._data,
        analysis.load(two_types),
    )
    agents = data.agent_data
    assert data.time_units.name == "ms" and agents.times == pytest.approx(run.times / 1e9)
    for frame in (0, 30):
        assert int(agents.n_agents[frame]) == len(run.filaments) == 4
        assert agents.types[frame][:4] == [own.type.name for own in run.filaments]
        assert agents.radii[frame][:4] == pytest.approx([0.5 * own.diameter for own in run.filaments])
        for number, nodes in enumerate(run.nodes(frame)):
            assert agents.n_subpoints[frame][number] == 3 * len(nodes)
            points = np.reshape(agents.subpoints[frame][number][: 3 * len(nodes)], (-1, 3))
            lengths = [np.linalg.norm(np.diff(own, axis=0), axis=1) for own in (points, nodes)]
            np.testing.assert_allclose(*lengths, atol=2e-3)
