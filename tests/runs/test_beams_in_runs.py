"""Runs of files with beam elements: what is built, refused, written, resumed, summarised, drawn and exported."""

import json
import re

import gsd.hoomd
import mdtraj
import numpy as np
import openmm
import pytest
from openmm import app
from PIL import Image

from openmm_cylchain import (
    F_ACTIN,
    FilamentReporter,
    Filaments,
    FilamentType,
    InputError,
    RunReporter,
    analysis,
)
from openmm_cylchain.beams.curve import curve_points, element_energies, element_points
from openmm_cylchain.cli import main
from openmm_cylchain.couplings.capsule_contacts import contact_spacing
from openmm_cylchain.output.read_tables import read_table
from openmm_cylchain.runs.configuration import parse_configuration, read_configuration
from openmm_cylchain.runs.initial_state import build_system
from openmm_cylchain.runs.run_directory import RunDirectory
from openmm_cylchain.runs.summary import group_labels, load_trajectory, summarise
from openmm_cylchain.units.quantities import PICONEWTON
from support.configurations import BEAMS
from support.contexts import positions_of
from support.run_figures import rendered
from support.small_runs import simulated

SHORT_ELEMENT = {
    "name": "BEAM",
    "diameter": 8.0,
    "segment_length": 1000.0,
    "bending_rigidity": 2e4,
    "stretching_modulus": 6e3,
    "element": "beam",
}
ELEMENTS = 2 * 3 + 2 + 2 + 3
STRAIGHT = 2
PARTICLES = 2 * (2 * 4 + 3 + 3 + 4) + 3


@pytest.fixture(scope="module")
def unbroken(tmp_path_factory):
    with rendered():
        return simulated(tmp_path_factory.mktemp("beams"), BEAMS)


def chains_of(filaments, positions):
    for own, nodes, controls in zip(filaments, filaments.node_indices, filaments.control_point_indices):
        yield own, positions[nodes], positions[controls]


def test_what_is_built_is_that_of_python():
    built = build_system(parse_configuration(BEAMS), None, 5)
    free, other, clamped, straight, *flat = built.filaments
    hand = Filaments(built.filaments.viscosity, 310.0)
    kind = FilamentType(
        name="BEAM",
        diameter=8.0,
        segment_length=1000.0,
        persistence_length=5000.0,
        temperature=310.0,
        stretching_modulus=6022.14076,
        friction_length="filament",
        element="beam",
    )
    assert free.type == other.type == kind and not clamped.type.segment_kind.straight
    for own in (free, other):
        hand.add_nodes(kind, own.positions, control_points=own.control_points)
    tangents = [[1, 0.5, 0], [1, 0, 0], [1, -0.5, 0]]
    nodes = [[0, 4000, 1000], [950, 4200, 1000], [1900, 4000, 1000]]
    hand.add_nodes(clamped.type, nodes, clamped=[0, -1], tangents=tangents, clamped_tangents=0)
    hand.add_nodes(F_ACTIN, [[0, 6000, 0], [360, 6000, 0], [720, 6000, 0]], planar=True)
    for own in flat:
        assert np.all(own.positions[:, 2] == 200.0) and np.all(own.control_points[:, 2] == 200.0) and own.planar
        curve = curve_points(own.positions, own.control_points, 20)
        assert np.linalg.norm(curve, axis=1).max() < 3000.0
        hand.add_nodes(own.type, own.positions, control_points=own.control_points, planar=True)
    _, system, positions = hand.build()
    np.testing.assert_allclose(positions._value, built.positions._value, atol=1e-9)
    one, other = (openmm.XmlSerializer.serialize(own.getForce(0)) for own in (built.system, system))
    assert one == other
    # The strains of draws are kept.
    assert element_energies(free.positions, free.control_points, free.beam_element(310.0))[0].min() > 1e-3
    # The link is as long as its places on the curve are apart.
    (links,) = (force for force in built.system.getForces() if "Crosslinks" in force.getName())
    place = element_points(free.positions, free.control_points, [0.25])[1, 0]
    length = np.linalg.norm(built.filaments[1].positions[-1] - place)
    assert f"{length:.9g}"[:8] in openmm.XmlSerializer.serialize(links)


def changed(old, new):
    text, count = re.subn(old, new, BEAMS, count=1)
    assert count == 1
    return text


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (
            'element = "beam"\ndiameter',
            "clamped_tangents = [0]\ndiameter",
            'clamped_tangents belongs to element = "beam"',
        ),
        ("segments = 3\n", "segments = 4\nclosed = true\n", None),
        ("segments = 3\n", "segments = 3\nclosed = true\n", "segments must be at least 4 in a ring"),
        ("segments = 3\n", 'segments = 3\npropulsion = "1 pN"\n', None),
        ("segments = 3\n", "segments = 3\ntangents = [[1, 0, 0], [1, 0, 0]]\n", "tangents belongs to nodes"),
        (
            "segments = 3\n",
            "segments = 3\nclamped_tangents = [0]\n",
            "the tangent of node 0 is clamped, but the node is",
        ),
        ("segments = 3\n", 'segments = 3\nbending_model = "quadratic"\n', "bending_model is one of straight segments"),
        ("segments = 3\n", 'segments = 3\nextension_relaxation_time = "1 us"\n', "is one of straight segments"),
        (r"tangents = \[\[1, 0.5, 0\], ", "tangents = [", r"tangents must have the shape \(3, 3\)"),
        ("clamped = ", 'position = ["0 nm", "0 nm", "0 nm"]\nclamped = ', "position cannot be with nodes"),
        ('"4.2 um"', '"8.2 um"', "nodes are apart by .* but segments of ACT are of 1000 nm"),
        ('"360 nm", "6 um", "0 um"', '"360 nm", "6 um", "1 nm"', "nodes must have one z"),
        ("clamped = ", "planar = true\nclamped = ", None),
        (r"\[1, 0.5, 0\], ", "[1, 0.5, 0.1], ", None),
        ('"5 um"\nstretching', '"0.5 um"\nstretching', "must not be longer than 0.92"),
        ('element = "beam"\ndiameter', 'element = "curved"\ndiameter', "element must be one of straight, beam"),
    ],
)
def test_what_beams_cannot_have_is_refused_with_its_line(old, new, message):
    text = changed(old, new)
    if message is None:
        parse_configuration(text)
        return
    with pytest.raises(InputError, match=message) as caught:
        parse_configuration(text)
    assert str(caught.value).startswith("line ")


def test_tangents_out_of_the_plane_are_refused():
    text = changed("clamped = ", "planar = true\nclamped = ").replace("[1, 0.5, 0]", "[1, 0.5, 0.1]")
    with pytest.raises(InputError, match="tangents must lie in the xy plane"):
        parse_configuration(text)


RINGS = """
[[filament]]
name = "LOOP"
element = "beam"
diameter = "8 nm"
segment_length = "500 nm"
persistence_length = "5 um"
stretching_modulus = "10 nN"
closed = true
segments = 6
count = 2
inside = { shape = "sphere", radius = "3 um" }
[[filament]]
name = "LOOP"
element = "beam"
diameter = "8 nm"
segment_length = "500 nm"
persistence_length = "5 um"
stretching_modulus = "10 nN"
closed = true
nodes = [["0 nm", "0 nm", "0 um"], ["450 nm", "0 nm", "0 um"], ["450 nm", "450 nm", "0 um"], ["0 nm", "450 nm", "0 um"]]
clamped = [0]
clamped_tangents = [0]
[[link]]
between = [{ filament = 6, arc_length = "2.75 um" }, { filament = 7, segment = 5, fraction = 0.4 }]
stiffness = "0.001 pN/nm"
[[joint]]
between = [{ filament = 6, node = 0 }, { filament = 7, segment = 5, fraction = 0.9 }]
stiffness = "1 kJ/mol"
"""


def test_runs_of_rings(tmp_path):
    """Begun as circles in a region and from nodes, linked at their last elements, summarised, and gone on with."""
    text = BEAMS.replace("[[link]]", f"{RINGS}[[link]]", 1)
    out = simulated(tmp_path, text)
    filaments = build_system(parse_configuration(text), None, 5).filaments
    loop = filaments[6]
    assert loop.closed and loop.segments == 6
    curve = curve_points(loop.positions, loop.control_points, 20, closed=True)
    assert np.linalg.norm(curve, axis=1).max() < 3000.0
    radii = np.linalg.norm(curve - curve.mean(axis=0), axis=1)
    assert radii == pytest.approx(np.full(len(radii), 3000.0 / (2.0 * np.pi)), rel=0.01)
    run = analysis.load(out)
    assert [own.ring for own in run.filaments[6:]] == [True] * 3
    configuration = read_configuration(out / "configuration.toml")
    groups = summarise(configuration, load_trajectory(configuration, RunDirectory(out)))
    rings = [group for group in groups if "LOOP" in group.label]
    assert len(rings) == 2
    for group in rings:
        assert any("They are rings" in note for note in group.notes)
        names = [own.name for own in group.observables]
        assert names == [
            "stretching energy per element",
            "bending energy per element",
            "cosine between ends of an element",
        ]
    energies, bending = read_table(out / "energies.csv"), 0.0
    for own, nodes, controls in chains_of(filaments, run.positions(-1)):
        parts = own.energies(nodes) if own.type.segment_kind.straight else own.energies(nodes, controls, 310.0)
        bending += parts[1]
    assert PICONEWTON * energies["bending energy (pN nm)"][-1] == pytest.approx(bending, rel=1e-3)
    assert main(["render", str(out), "--output", str(tmp_path / "rings.png")]) == 0
    # Rings of a trajectory are known by their bonds.
    files = f'file = "{out}/trajectory.dcd"\ntopology = "{out}/topology.cif"\nfilaments = [6, 7]\n'
    begin = text.split("[[filament]]")[0]
    own = RINGS.split("[[filament]]")[1].split("closed")[0]
    again = f"{begin}[[filament]]{own}{files}[simulation]{text.split('[simulation]')[1]}"
    for chain, before in zip(build_system(parse_configuration(again), None, 5).filaments, run.filaments[6:8]):
        assert chain.closed
        np.testing.assert_allclose(chain.control_points, run.positions(-1)[before.control_points], atol=2e-3)


LINKERS = """
[[linkers]]
name = "motor"
count = 40
bound = 40
volume = "1 um^3"
hand = { binding_rate = "1e5 1/s", reach = "500 nm", unbinding_rate = "1 1/s", speed = "80 um/s", stall_force = "4 pN" }
stiffness = "0.0001 pN/nm"
"""


def test_linkers_of_runs_are_on_the_curves(tmp_path):
    out = simulated(tmp_path, BEAMS.replace("[simulation]", f"{LINKERS}[simulation]"))
    run = analysis.load(out)
    on_curves = 0
    for frame in (0, 30, -1):
        positions, records = run.positions(frame), run.linkers[frame]
        for filament, along, place in zip(
            records["filaments"].ravel(), records["arc_lengths"].ravel(), records["places"].reshape(-1, 3)
        ):
            if filament < 0 or not len(run.filaments[filament].control_points):
                continue
            own = run.filaments[filament]
            element = min(int(along // own.type.segment_length), own.segments - 1)
            fraction = along / own.type.segment_length - element
            points = element_points(positions[own.nodes], positions[own.control_points], [fraction])
            np.testing.assert_allclose(place, points[element, 0], atol=0.02)
            on_curves += 1
    assert on_curves > 60
    assert run.linker_table["one hand bound"][-1].sum() > 20


def test_dry_run_names_beam_elements(tmp_path, capsys):
    (tmp_path / "input.toml").write_text(BEAMS)
    assert main(["run", str(tmp_path / "input.toml"), "--dry-run"]) == 0
    text = capsys.readouterr().out
    assert "2 × BEAM, 3 beam elements" in text and "1 × ACT, 2 segments" in text and "1 × ACT, 2 beam elements" in text
    assert f"{ELEMENTS + STRAIGHT} segments, {PARTICLES} particles" in text and "1 link" in text


def test_timestep_explains_that_of_beam_elements(tmp_path, capsys):
    (tmp_path / "input.toml").write_text(BEAMS)
    assert main(["timestep", str(tmp_path / "input.toml")]) == 0
    text = capsys.readouterr().out
    assert "BEAM, 3 beam elements of 1000 nm" in text and "ACT, 2 segments of 360 nm" in text
    assert text.count("recommended  ") == 5 + 1 and text.count("stability of explicit schemes") == 1


def test_energies_are_those_of_the_curve(unbroken):
    energies, run = read_table(unbroken / "energies.csv"), analysis.load(unbroken)
    configuration = read_configuration(unbroken / "configuration.toml")
    filaments = build_system(configuration, None, 5).filaments
    kT = 8.31446261815324e-3 * 310
    for frame in (0, 30, -1):
        stretching = bending = 0.0
        for own, nodes, controls in chains_of(filaments, run.positions(frame)):
            if own.control_points is None:
                parts = own.energies(nodes)
            else:
                parts = element_energies(nodes, controls, own.beam_element(310.0))
            stretching, bending = stretching + np.sum(parts[0]), bending + np.sum(parts[1])
        assert PICONEWTON * energies["bending energy (pN nm)"][frame] == pytest.approx(bending, rel=1e-3)
        assert PICONEWTON * energies["stretching energy (pN nm)"][frame] == pytest.approx(stretching, rel=1e-2)
        # Of the straight filament, a joint and two segments.
        joints = ELEMENTS + STRAIGHT - 1
        assert energies["bending energy per joint (kT)"][frame] == pytest.approx(bending / joints / kT, rel=1e-3)
    # What is clamped stays: two nodes, and the tangent of the first.
    clamped, positions = run.filaments[2], [run.positions(frame) for frame in (0, -1)]
    still = [*clamped.nodes[[0, -1]], clamped.control_points[0]]
    np.testing.assert_array_equal(positions[0][still], positions[1][still])
    assert np.abs(positions[1] - positions[0])[clamped.control_points[-1]].max() > 0.1


def test_mdtraj_has_nodes_with_bonds_and_control_points_without(unbroken):
    trajectory = mdtraj.load_dcd(str(unbroken / "trajectory.dcd"), top=str(unbroken / "topology.cif"))
    assert trajectory.n_frames == 61 and trajectory.n_atoms == PARTICLES
    assert trajectory.topology.n_bonds == ELEMENTS + STRAIGHT
    assert all(one.name == other.name == "NOD" for one, other in trajectory.topology.bonds)
    run = analysis.load(unbroken)
    for ours, own in zip(analysis.filament_curves(trajectory[-1]), run.curves(-1)):
        np.testing.assert_allclose(ours[0], own, atol=1e-2)


def test_a_run_that_was_broken_off_resumes_to_the_same_files(tmp_path, monkeypatch, unbroken, capsys):
    output, config = tmp_path / "out", tmp_path / "input.toml"
    config.write_text(BEAMS)
    whole_step, taken = app.Simulation.step, []

    def step(simulation, steps):
        taken.append(steps)
        if sum(taken) > 65:
            raise RuntimeError("broken off")
        whole_step(simulation, steps)

    with monkeypatch.context() as patch:
        patch.setattr(app.Simulation, "step", step)
        with pytest.raises(RuntimeError, match="broken off"):
            main(["run", str(config), "--output", str(output)])
    assert main(["run", str(config), "--output", str(output), "--resume"]) == 0
    assert "Resuming at step 60" in capsys.readouterr().out
    for name in ("trajectory.dcd", "energies.csv"):
        one, other = ((folder / name).read_bytes() for folder in (output, unbroken))
        assert one == other


def test_a_run_starts_where_another_has_ended(tmp_path, unbroken):
    files = f'file = "{unbroken}/trajectory.dcd"\ntopology = "{unbroken}/topology.cif"\nfilaments = [0, 1]\n'
    text = BEAMS.split("[[filament]]")[1].replace("segments = 3\ncount = 2\n", files)
    text = BEAMS.split("[[filament]]")[0] + "[[filament]]" + text + "[simulation]" + BEAMS.split("[simulation]")[1]
    built, run = build_system(parse_configuration(text), None, 5), analysis.load(unbroken)
    for own, chain in zip(built.filaments, run.filaments):
        np.testing.assert_allclose(own.positions, run.positions(-1)[chain.nodes], atol=2e-3)
        np.testing.assert_allclose(own.control_points, run.positions(-1)[chain.control_points], atol=2e-3)
    with pytest.raises(InputError, match='file has beam elements: write element = "beam"'):
        parse_configuration(text.replace('element = "beam"\n', ""))


def test_summary_says_what_is_compared(unbroken):
    configuration = read_configuration(unbroken / "configuration.toml")
    groups = summarise(configuration, load_trajectory(configuration, RunDirectory(unbroken)))
    assert [group.label for group in groups] == group_labels(configuration)
    # Those in a plane are free.
    compared = [any(each.verdict != "not comparable" for each in group.observables) for group in groups]
    assert compared == [False, False, False, True, True] == [group.in_equilibrium for group in groups]
    assert any("A tangent is clamped" in note or "Several nodes" in note for note in groups[1].notes)
    assert any("Started from given nodes" in note for note in groups[1].notes)
    assert Image.open(unbroken / "summary.png").size[0] > 1000
    content = json.loads((unbroken / "summary.json").read_text())
    assert content["groups"][0]["observables"][0]["name"] == "stretching energy per element"


def test_equilibrium_agrees_with_theory(tmp_path):
    begin, rest = BEAMS.split("[[filament]]")[:2]
    rest = rest.replace("count = 2", "count = 200").replace('"5 um"', '"10 um"')
    end = '[simulation]\ntime_step = "recommended"\nduration = "30 ms"\nreport_interval = "5 ms"\nseed = 8\n'
    end = end.replace('"30 ms"', '"600 ms"').replace('"5 ms"', '"20 ms"')
    directory = simulated(tmp_path, f"{begin}[[filament]]{rest}{end}")
    configuration = read_configuration(directory / "configuration.toml")
    (group,) = summarise(configuration, load_trajectory(configuration, RunDirectory(directory)))
    allowed = {"stretching energy per element": 0.01, "bending energy per element": 0.01, "persistence length": 0.03}
    compared = [own for own in group.observables if own.verdict != "reference"]
    assert group.in_equilibrium and len(compared) == 5
    for own in compared:
        bias = allowed.get(own.name, 0.005) * own.theory
        assert own.standard_error < (0.0125 if own.name != "persistence length" else 0.025) * own.theory
        assert abs(own.value - own.theory) < 4.0 * own.standard_error + bias, own


BENT = """
[solvent]
temperature = "310 K"
viscosity = "1.71 mPa*s"
[[filament]]
name = "BENT"
element = "beam"
diameter = "40 nm"
segment_length = "1 um"
bending_rigidity = "7e-25 N*m^2"
stretching_modulus = "10 nN"
friction_length = "filament"
nodes = [["0 nm", "0 nm", "0 nm"], ["900 nm", "0 nm", "0 nm"]]
tangents = [[1, 1.2, 0], [1, -1.2, 0]]
clamped = [0, 1]
clamped_tangents = [0]
[simulation]
time_step = "1 us"
duration = "20 us"
report_interval = "10 us"
"""


@pytest.fixture(scope="module")
def bent(tmp_path_factory):
    return simulated(tmp_path_factory.mktemp("bent"), BENT)


def test_pictures_show_the_curve_and_not_its_control_points(bent, tmp_path):
    path = tmp_path / "bent.png"
    options = ["--frame", "0", "--view", "0,0,-1", "--projection", "orthographic", "--size", "400x300"]
    assert main(["render", str(bent), "--output", str(path), *options]) == 0
    image = np.asarray(Image.open(path)).astype(int)
    blue = image[:, :, 2] - image[:, :, 0] > 60
    blue[:70, :160] = False  # The legend.
    rows, columns = np.nonzero(blue)
    middle = np.abs(columns - 0.5 * (columns.min() + columns.max())) < 3
    ends = columns < columns.min() + 12
    nm_per_pixel = 940.0 / (columns.max() - columns.min() + 1)
    (line,) = analysis.load(bent).curves(0)
    # The bow is as high above the ends as that of the curve, and there is nothing on the chord.
    assert rows[middle].max() < rows[ends].min()
    height = (np.mean(rows[ends]) - np.mean(rows[middle])) * nm_per_pixel
    assert line[4, 1] > 150.0
    assert height == pytest.approx(line[4, 1], abs=40.0)
    # Control points are above the curve.
    controls = analysis.load(bent).positions(0)[analysis.load(bent).filaments[0].control_points]
    assert controls[0, 1] > line[:, 1].max() and rows.min() * nm_per_pixel > 0.0
    assert (rows.max() - rows.min()) * nm_per_pixel < line[4, 1] + 100.0


@pytest.mark.parametrize("color", ["orientation", "bending", "tension"])
def test_curves_have_every_coloring(unbroken, tmp_path, color):
    path = tmp_path / "colored.png"
    assert main(["render", str(unbroken), "--output", str(path), "--color", color, "--size", "300x200"]) == 0
    assert np.ptp(np.asarray(Image.open(path)).astype(int)) > 100


def test_bends_and_tensions_are_those_of_elements(bent):
    run = analysis.load(bent)
    (angles,) = run.bends(0)
    assert angles == pytest.approx([2.0 * np.arctan(1.2)], rel=1e-5)
    (line,), (nodes,) = run.curves(0), run.nodes(0)
    assert line.shape == (9, 3) and np.array_equal(line[[0, -1]], nodes)
    (tension,) = run.segment_tensions(0)
    fine = curve_points(nodes, run.positions(0)[run.filaments[0].control_points], 1000)
    length = np.linalg.norm(np.diff(fine, axis=0), axis=1).sum()
    element = run.filaments[0].type.beam_element(310.0)
    assert tension == pytest.approx([6022.14076 * (length / 1000.0 - 1.0 + element.shortening)], rel=1e-4)


def test_exports_have_the_curve(unbroken, tmp_path):
    run = analysis.load(unbroken)
    lines, pieces = run.curves(-1), 8 * ELEMENTS + STRAIGHT
    for kind, ending in (("simularium", "simularium"), ("ovito", "gsd"), ("vmd", "tcl")):
        assert main(["export", str(unbroken), "--format", kind, "--output", str(tmp_path / f"run.{ending}")]) == 0
    with gsd.hoomd.open(str(tmp_path / "run.gsd")) as file:
        frame = file[-1]
        points = np.concatenate(lines)
        # Two ends of the link are particles, too.
        assert frame.bonds.N == pieces + 1 and frame.particles.N > len(points)
        shift = frame.particles.position[0] - 10.0 * points[0]
        np.testing.assert_allclose(frame.particles.position[: len(points)], 10.0 * points + shift, atol=2e-2)
        lengths = np.linalg.norm(np.diff(frame.particles.position[frame.bonds.group[:pieces]], axis=1), axis=2)
        assert lengths.max() < 4000.0
    data = json.loads((tmp_path / "run.simularium").read_text())["spatialData"]["bundleData"][-1]["data"]
    assert data[10] == 3 * len(lines[0])
    script = (tmp_path / "run.tcl").read_text()
    assert script.count("lappend curves") == len(run)
    last = [line for line in script.splitlines() if line.startswith("lappend curves")][-1]
    # Three kinds, each a list of filaments, each a list of points.
    assert last.count("{") == 1 + 3 + 5 + sum(len(own) for own in lines) - len(lines[3])
    hidden = " ".join(str(i) for i in (*run.filaments[2].nodes, *run.filaments[2].control_points))
    assert f"mol selection {{resname ACT and not index {hidden}}}" in script
    assert "resname BEAM" not in script


def test_a_run_reporter_writes_what_is_loaded_and_drawn_alike(tmp_path):
    filaments = Filaments(602.214, 300.0)
    kind = FilamentType(
        name="BEAM", diameter=8.0, segment_length=1000.0, bending_rigidity=2e4, stretching_modulus=6e3, element="beam"
    )
    filaments.add_equilibrium(kind, 2, seed=3)
    filaments.add_straight(F_ACTIN, 3, [0, 2000, 0], [1, 0, 0])
    topology, system, positions = filaments.build()
    integrator = filaments.create_integrator(system, 1e7, random_seed=3)
    simulation = app.Simulation(topology, system, integrator, openmm.Platform.getPlatformByName("Reference"))
    simulation.context.setPositions(positions)
    energies = FilamentReporter(None, 5, filaments)
    simulation.reporters += [RunReporter(tmp_path / "run", 5, filaments), energies]
    simulation.step(10)
    run = analysis.load(tmp_path / "run")
    assert len(run) == 3 and [own.pieces for own in run.filaments] == [8, 1]
    bending = energies["bending_energy"].sum(axis=1)
    assert PICONEWTON * run.energies["bending energy (pN nm)"][1:] == pytest.approx(bending)
    now = positions_of(simulation.context)
    expected = curve_points(now[filaments.node_indices[0]], now[filaments.control_point_indices[0]], 8)
    np.testing.assert_allclose(run.curves(-1)[0], expected, atol=1e-3)
    assert analysis.filament_distances(run, -1, 5000.0)[0, 1] < 5000.0
    assert np.trace(analysis.stress(run, -1, 1e9).ideal) == pytest.approx(
        -3 * (2 * 3 + 4) * 8.314462618e-3 * 300.0 / 1e9
    )


@pytest.mark.parametrize("particle", ["node", "control point"])
def test_what_has_blown_up_is_traced_to_its_node(tmp_path, monkeypatch, capsys, particle):
    """Where an engine has not stopped before."""

    def step(simulation, steps):
        positions = positions_of(simulation.context)
        # The second node of the second filament.
        positions[8 + 1 + 4 * (particle != "node")] = np.nan
        simulation.context.setPositions(positions)

    monkeypatch.setattr(app.Simulation, "step", step)
    (tmp_path / "input.toml").write_text(BEAMS)
    assert main(["run", str(tmp_path / "input.toml"), "--output", str(tmp_path / "out")]) == 1
    assert "Filament 1 (BEAM) has blown up at node 1 by step" in capsys.readouterr().err


def test_control_points_that_are_none_are_refused():
    filaments = Filaments(602.214, 300.0)
    kind = FilamentType(
        name="BEAM", diameter=8.0, segment_length=1000.0, bending_rigidity=2e4, stretching_modulus=6e3, element="beam"
    )
    nodes, controls = [[0, 0, 0], [1000, 0, 0]], [[333, 0, 0], [1333, 0, 0]]
    filaments.add_nodes(kind, nodes, control_points=np.array(controls) * openmm.unit.nanometer)
    np.testing.assert_array_equal(filaments[0].control_points, controls)
    with pytest.raises(InputError, match="give either tangents or control_points"):
        filaments.add_nodes(kind, nodes, tangents=[[1, 0, 0]] * 2, control_points=controls)
    with pytest.raises(InputError, match="control_points belong to nodes of beam elements"):
        filaments.add_nodes(F_ACTIN, [[0, 0, 0], [360, 0, 0]], control_points=controls)
    with pytest.raises(InputError, match=r"control_points must have the shape \(2, 3\)"):
        filaments.add_nodes(kind, nodes, control_points=controls[:1])
    with pytest.raises(InputError, match="the control point of node 0 is at the node"):
        filaments.add_nodes(kind, nodes, control_points=[[0, 0, 0], [1333, 0, 0]])


WITH_CONTACTS = """
[solvent]
temperature = "310 K"
viscosity = "1.71 mPa*s"

[box]
edges = ["4 um", "4 um", "4 um"]

[[filament]]
type = "F_ACTIN"
element = "beam"
segments = 3
count = 6

[[filament]]
type = "F_ACTIN"
segments = 3
count = 2

[contacts]
diameter = "30 nm"

[[tether]]
filament = [0, 1]
node = -1
stiffness = "0.01 pN/nm"
velocity = ["1 um/s", "0 um/s", "0 um/s"]

[[pull]]
filament = 2
node = 0
force = ["0.1 pN", "0 pN", "0 pN"]

[simulation]
time_step = "recommended"
duration = "20 ms"
report_interval = "1 ms"
seed = 4
"""


def test_contacts_tethers_and_pulls_of_beams_in_files(tmp_path):
    """Beads cover the curves as finely as the diameter needs, and contacts that are found belong to filaments."""
    built = build_system(parse_configuration(WITH_CONTACTS), None, 4)
    spacing = contact_spacing(built.filaments[0].type, 30.0, 310.0)
    assert [len(beads) for beads in built.filaments.bead_indices] == [3 * round(360.0 / spacing) + 1] * 6 + [0, 0]
    (tmp_path / "input.toml").write_text(WITH_CONTACTS)
    assert main(["run", str(tmp_path / "input.toml"), "--output", str(tmp_path / "run")]) == 0
    run = analysis.load(tmp_path / "run")
    assert len(run) == 21
    owners = {run.contacts(frame).filaments.max(initial=-1) for frame in range(len(run))}
    assert max(owners) < 8
    nodes = run.nodes(-1)
    for number in (0, 1):
        assert np.linalg.norm(nodes[number] - run.nodes(0)[number], axis=1).max() > 1.0
    assert np.isfinite(analysis.stress(run, -1).total).all()
