"""[[body]] tables: what is built of them, what is refused with its line, and runs whose bodies are in equilibrium."""

import json

import numpy as np
import openmm
import pytest

from openmm_cylchain import InputError, analysis
from openmm_cylchain.cli import main
from openmm_cylchain.couplings.capsule_contacts import as_capsule_contact_force
from openmm_cylchain.couplings.crosslinks import CROSSLINKS_NAME
from openmm_cylchain.couplings.walls import as_filament_wall_force
from openmm_cylchain.runs.configuration import changed_keys, parse_configuration
from openmm_cylchain.runs.initial_bodies import first_particles
from openmm_cylchain.runs.initial_state import build_system
from openmm_cylchain.runs.run import run
from support.configurations import BODIES

BOLTZMANN = 0.00831446261815324


def replaced(*pairs, text=BODIES):
    for old, new in pairs:
        assert old in text
        text = text.replace(old, new, 1)
    return text


def built_of(text, seed=3):
    configuration = parse_configuration(text)
    built = build_system(configuration, None, seed)
    return configuration, built, built.positions._value


def test_filaments_begin_on_bodies_along_their_radius():
    configuration, built, positions = built_of(BODIES)
    filaments = built.filaments
    assert [len(placed.positions) for placed in filaments.bodies] == [9, 9, 9, 3, 3]
    np.testing.assert_array_equal(
        first_particles(configuration, filaments)[:-1], [own[0] for own in filaments.body_indices]
    )
    for number in range(8):
        center = positions[filaments.body_indices[number % 2][0]]
        nodes = positions[filaments.node_indices[number]] - center
        radii = np.linalg.norm(nodes, axis=1)
        np.testing.assert_allclose(radii, 200.0 + 250.0 * np.arange(len(nodes)), rtol=1e-9)
        np.testing.assert_allclose(nodes @ nodes[0], radii * radii[0], rtol=1e-9)
    center = positions[filaments.body_indices[2][0]]
    for number in range(8, 12):
        nodes = positions[filaments.node_indices[number]][:5] - center
        np.testing.assert_allclose(np.linalg.norm(nodes, axis=1), 100.0 + 240.0 * np.arange(5), rtol=1e-9)


def test_directions_are_spread_evenly():
    """As on average on a sphere or a circle: sum of vectors zero, sum of their squares n/3 along each axis."""
    text = replaced(("count = 8", "count = 400"), ("[4, 6]", "4"))
    (held, *_) = [own.held for own in parse_configuration(text).bodies]
    assert held.directions.shape == (200, 3)
    np.testing.assert_allclose(held.directions.sum(axis=0), 0.0, atol=0.5)
    np.testing.assert_allclose(held.directions.T @ held.directions, np.eye(3) * 200.0 / 3.0, atol=0.7)
    cosines = held.directions @ held.directions.T - 2.0 * np.eye(200)
    # 0.9 of the distance of hexagonal neighbours, 0.6 of them for each area.
    assert np.degrees(np.arccos(cosines.max())) > 0.7 * np.degrees(np.sqrt(8.0 * np.pi / np.sqrt(3.0) / 200.0))
    drawn = replaced(('"0.5 pN/nm" }', '"0.5 pN/nm", spread = "random" }'), text=text)
    directions = parse_configuration(drawn).bodies[0].held.directions
    assert np.all(np.abs(directions.sum(axis=0)) < 4.0 * np.sqrt(200.0 / 3.0))
    flat = replaced(("[4, 6]", "4\nplanar = true"), ("[[body]]", "[[body]]\nplanar = true"))
    directions = parse_configuration(flat).bodies[0].held.directions
    angles = np.sort(np.arctan2(directions[:, 1], directions[:, 0]))
    np.testing.assert_allclose(np.diff(angles), 0.5 * np.pi, atol=1e-9)


@pytest.mark.parametrize("end", ["minus", "plus"])
def test_springs_are_without_force_at_first(end):
    text = replaced(("{ table = 1, ", f'{{ table = 1, end = "{end}", arm = "100 nm", '))
    _, built, positions = built_of(text)
    assert built.links == 2 + 2 * 8
    (links,) = [own for own in built.system.getForces() if own.getName() == CROSSLINKS_NAME]
    links.setForceGroup(9)
    integrator = built.filaments.create_integrator(built.system, 1.0, checks=False)
    context = openmm.Context(built.system, integrator, openmm.Platform.getPlatform("Reference"))
    context.setPositions(positions)
    energy = context.getState(energy=True, groups={9}).getPotentialEnergy()._value
    # Of the two links of the file alone.
    filaments = built.filaments
    vectors = [
        positions[filaments.body_indices[3][2]] - positions[filaments.node_indices[12][0]],
        positions[filaments.body_indices[4][0]] - [0.0, -3000.0, 0.0],
    ]
    expected = sum(0.5 * 0.1 * 0.602214076 * vector @ vector for vector in vectors)
    assert energy == pytest.approx(expected, rel=1e-9)


def test_contacts_and_walls_take_spheres():
    _, built, _ = built_of(BODIES)
    forces = built.system.getForces()
    (contacts,) = filter(None, map(as_capsule_contact_force, forces))
    (walls,) = filter(None, map(as_filament_wall_force, forces))
    spheres = {contacts.getSphereParticle(i): contacts.getSphereDiameter(i)._value for i in range(4)}
    indices = built.filaments.body_indices
    assert contacts.getNumSpheres() == 4
    assert spheres == {own[place]: size for own in indices[3:] for place, size in ((0, 200.0), (1, 120.0))}
    radii = {walls.getParticle(i): walls.getParticleRadius(i)._value for i in range(walls.getNumParticles())}
    assert {radii[int(own[0])] for own in indices} == {200.0, 100.0}
    assert not any(int(own[2]) in radii for own in indices)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('name = "POLE"', 'name = "POLES1"', "1 to 5 letters or digits"),
        ('name = "POLE"', 'name = "NOD"', "is that of other particles"),
        ('radius = "200 nm"', 'radius = "0 nm"', "radius must be positive"),
        ('radius = "200 nm"', 'radii = ["200 nm"]', "lacks the key 'points'"),
        ('radius = "200 nm"\n', "", "lacks its size"),
        ('radius = "200 nm"', 'radius = "200 nm"\nradii = ["1 nm"]', "say the same"),
        ('["100 nm", "60 nm", "0 nm"]', '["100 nm", "60 nm"]', "one for each of the 3 points"),
        ('["150 nm", "0 nm", "0 nm"]', '["0 nm", "0 nm", "0 nm"]', "are in one place"),
        ("count = 2\n", "", "lacks the key 'count'"),
        ('count = 2\ninside = { shape = "sphere", radius = "3 um" }', "count = 2", "lacks the key 'inside'"),
        ("table = 1, stiff", "table = 9, stiff", "there is no such"),
        ("table = 2, stiff", "table = 1, stiff", "as in another"),
        ("table = 1, stiff", 'table = 1, arm = "3 um", stiff', "take a shorter one"),
        ('", arm_stiffness = "0.5 pN/nm" }', '", arm = "100 nm" }', "belongs to an arm_stiffness"),
        ('plus_on_rate = "100', 'plus_off_rate = "1 1/s"\nplus_on_rate = "100', "may shrink to 120 nm"),
        ("table = 2, stiff", 'table = 2, end = "plus", stiff', "plus_capped = true"),
        (", minus_capped = true", "", "minus_capped = true"),
        ("count = 8", 'count = 8\nstart = "equilibrium"', "must be straight"),
        ("count = 8", "count = 8\ndirection = [1, 0, 0]", "begin on bodies"),
        ("table = 1, stiff", 'table = 1, places = [["1 nm", "0 nm", "0 nm"]], stiff', "lacks the key 'directions'"),
        ("table = 1, stiff", "table = 1, directions = [[1, 0, 0]], stiff", "belong to places"),
        (
            "table = 1, stiff",
            'table = 1, places = [["1 nm", "0 nm", "0 nm"]], directions = [[1, 0, 0]], stiff',
            "4, but are 1 and 1",
        ),
        ("count = 8", "count = 8\nplanar = true", "its bodies must be planar"),
        ("body = 3, body_point = 2", "body = 5", "there are 5, counted from 0"),
        ("body = 3, body_point = 2", "body = 3, body_point = 3", "there are 3, from 0 on"),
        ("body = 3, body_point = 2", "body = 3, node = 0", "cannot be with a body"),
        ("filament = 12, node = 0", "filament = 12, node = 0, body_point = 1", "belongs to a body"),
        ("body_table = 3, body_points = [2, 2, 0]", "body_table = 4", "there are 3"),
        ("[2, 2, 0]", "[2, 3]", "3 does not exist; there are 3"),
        ("body_table = 3, body_points = [2, 2, 0]", "body_points = [1]", "belongs to a body_table"),
        ("body_table = 3, body_points", "count = 3, body_table = 3, body_points", "cannot be with a body_table"),
        ("[simulation]", '[simulation]\nengine = "portable"', "has no"),
        ("[simulation]", '[simulation]\nscheme = "explicit-implicit"', "scheme"),
        ('radius = "6 um"', 'radius = "150 nm"', "does not fit"),
    ],
)
def test_mistakes_are_named(old, new, message):
    with pytest.raises(InputError, match=message):
        build_system(parse_configuration(replaced((old, new))), None, 1)


def test_arms_are_where_filaments_that_shrink_always_are():
    """Those that are not given are as long as these may become, if that is less than a segment."""
    shrinks = replaced(
        ('plus_on_rate = "100', 'plus_off_rate = "1 1/s"\nplus_on_rate = "100'), (', arm = "300 nm" }', " }")
    )
    for text, arms in ((replaced((', arm = "300 nm" }', " }")), [250.0, 240.0]), (shrinks, [250.0, 120.0])):
        assert [own.held.arm for own in parse_configuration(text).bodies if own.held is not None] == arms


def test_what_has_changed_is_named():
    before, after = parse_configuration(BODIES), parse_configuration(replaced(('"POLE"', '"SPB"')))
    assert changed_keys(before, after) == ["[[body]] number 1: name"]


def test_regions_that_are_too_small_are_refused():
    text = replaced(
        ('inside = { shape = "sphere", radius = "3 um" }', 'inside = { shape = "sphere", radius = "50 nm" }')
    )
    with pytest.raises(InputError, match="inside is too small"):
        build_system(parse_configuration(text), None, 1)


def test_runs_describe_draw_and_export_bodies(tmp_path, capsys):
    (tmp_path / "bodies.toml").write_text(BODIES)
    assert main(["run", str(tmp_path / "bodies.toml"), "--dry-run"]) == 0
    assert "2 × POLE, 1 sphere of 200 nm" in capsys.readouterr().out
    run(parse_configuration(BODIES), tmp_path / "out")
    found = analysis.load(tmp_path / "out")
    sizes = {(own.name, own.diameter): len(own.indices) for own in found.particles}
    assert sizes == {("POLE", 400.0): 2, ("MTOC", 200.0): 1, ("CARGO", 200.0): 2, ("CARGO", 120.0): 2}
    assert main(["render", str(tmp_path / "out"), "--output", str(tmp_path / "all.png"), "--size", "200x150"]) == 0
    arguments = ["--format", "simularium", "--output", str(tmp_path / "all.simularium")]
    assert main(["export", str(tmp_path / "out"), *arguments]) == 0
    types = json.loads((tmp_path / "all.simularium").read_text())["trajectoryInfo"]["typeMapping"]
    assert {"POLE", "CARGO"} <= {own["name"] for own in types.values()}
    # Bodies keep their shapes, as far as single precision says.
    _, built, _ = built_of(BODIES)
    for frame in (0, 20):
        positions = found.positions(frame)
        for placed, own in zip(built.filaments.bodies, built.filaments.body_indices):
            distances = np.linalg.norm(positions[own][:, None] - positions[own], axis=2)
            before = np.linalg.norm(placed.positions[:, None] - placed.positions, axis=2)
            np.testing.assert_allclose(distances, before, atol=2e-3)


HELD = """
[solvent]
temperature = "300 K"
viscosity = "0.01 Pa*s"
[[filament]]
type = "MICROTUBULE"
segment_length = "200 nm"
segments = 3
count = 24
{growth}
[[body]]
radius = "100 nm"
count = 8
inside = {{ shape = "sphere", radius = "1 um" }}
filaments = {{ table = 1, stiffness = "0.2 pN/nm" }}
[simulation]
time_step = "{step}"
duration = "{duration}"
report_interval = "{interval}"
platform = "CPU"
seed = 5
"""
TETHERED = """
[[link]]
between = [{{ body = {number} }}, {{ point = ["{number} um", "0 um", "0 um"] }}]
stiffness = "0.05 pN/nm"
rest_length = "0 nm"
"""
GROWN = 'growth = { monomers = "tubulin", longest = "900 nm", minus_capped = true }\n[[monomers]]\nname = "tubulin"\n'
GROWN += 'length = "8 nm"\nconcentration = "1 uM"\nplus_on_rate = "500 1/(uM*s)"'


@pytest.mark.filterwarnings("ignore:A time step:openmm_cylchain.TimeStepWarning")
@pytest.mark.parametrize("growth", ["", GROWN], ids=["links", "linkers"])
def test_springs_are_in_equilibrium(growth, tmp_path):
    """The mean square of a spring without a rest length is 3 kT/k, of those at the ends of filaments and of others.

    The springs that tie bodies to points are soft; a link relaxes within 6 pi eta R/k = 2 ms.
    """
    text = HELD.format(growth=growth, step="50 us", duration="250 ms", interval="1 ms")
    text = text.replace("[simulation]", "".join(TETHERED.format(number=i) for i in range(8)) + "[simulation]")
    text = text.replace("inside", "planar = false\ninside")
    run(parse_configuration(text), tmp_path / "out")
    found = analysis.load(tmp_path / "out")
    indices = [own.indices for own in found.particles][0]
    configuration, built, _ = built_of(text, 5)
    (body,) = configuration.bodies
    held, ties = [], []
    for frame in range(20, len(found)):
        positions = found.positions(frame)
        ties += [positions[indices[i]] - [1000.0 * i, 0.0, 0.0] for i in range(8)]
        for index, number in enumerate(body.held.numbers):
            slot, owner = divmod(index, 8)
            point = built.filaments.body_indices[owner][body.held.bases[slot]]
            held.append(positions[found.filaments[number].nodes[0]] - positions[point])
    for vectors, count, stiffness in ((held, 24, 0.2), (ties, 8, 0.05)):
        squares = np.sum(np.square(vectors), axis=1).reshape(-1, count) * stiffness * 0.602214076 / (BOLTZMANN * 300.0)
        # Of each spring on its own, whose means over time are independent.
        means = squares.mean(axis=0)
        error = means.std(ddof=1) / np.sqrt(count)
        assert abs(means.mean() - 3.0) < 4.0 * error
        assert error < (0.04 if count == 24 else 0.25), (means.mean(), error)
