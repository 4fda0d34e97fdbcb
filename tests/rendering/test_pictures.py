"""Pictures and films of runs: what is in them, and what is refused."""

import json
import shutil
import sys

import imageio_ffmpeg
import numpy as np
import pytest
from matplotlib.colors import to_rgb
from PIL import Image

from openmm_cylchain import InputError, Plane, Slab, Sphere, analysis
from openmm_cylchain.cli import main
from openmm_cylchain.couplings.shapes import Box, Capsule, Cylinder, Ellipsoid, Torus
from openmm_cylchain.output.colors import PLUS_END_COLOR, colors_of_filaments
from openmm_cylchain.rendering.annotations import Margins, clock_text, margins, scale_bar_length
from openmm_cylchain.rendering.camera import camera_on
from openmm_cylchain.rendering.colors import filament_colors, linker_colors
from openmm_cylchain.rendering.pictures import View, images, write_film
from openmm_cylchain.rendering.scene import COLORINGS, Look, has_polarity, make_scene
from openmm_cylchain.runs.configuration import parse_configuration
from openmm_cylchain.runs.description import describe
from openmm_cylchain.runs.run import create_simulation
from support.small_runs import AMONG_SPHERES, NETWORK, TWO_LOADS, TWO_TYPES, simulated

SIZE = ["--size", "160x120"]
SMALL = View(size=(160, 120))
BLUE, GREEN, RED, YELLOW = (0, 114, 178), (0, 158, 115), (179, 38, 30), (242, 178, 0)


@pytest.fixture(scope="module")
def two_types(tmp_path_factory):
    return simulated(tmp_path_factory.mktemp("two"), TWO_TYPES)


@pytest.fixture(scope="module")
def network(tmp_path_factory):
    return simulated(tmp_path_factory.mktemp("network"), NETWORK)


def picture(run, tmp_path, *options):
    path = tmp_path / "picture.png"
    assert main(["render", str(run), "--output", str(path), *options]) == 0
    return np.asarray(Image.open(path)).astype(int)


def hue_of(image, color):
    """How many pixels have about the direction of a color, less its white."""
    wanted = max(color) - np.array(color)
    own = image.max(axis=2, keepdims=True) - image
    size = np.linalg.norm(own, axis=2)
    return np.sum((size > 40) & (own @ wanted > 0.97 * size * np.linalg.norm(wanted)))


def test_a_picture_of_a_network(network, tmp_path):
    image = picture(network, tmp_path, "--size", "320x240")
    assert image.shape == (240, 320, 3)
    assert tuple(np.median(image.reshape(-1, 3), axis=0)) == (255, 255, 255)
    assert hue_of(image, BLUE) > 1000 and hue_of(image, YELLOW) > 50 and hue_of(image, RED) > 100
    bare = picture(network, tmp_path, "--size", "320x240", "--no-linkers")
    assert max(hue_of(bare, YELLOW), hue_of(bare, RED)) < 20 < hue_of(bare, BLUE)


def test_types_have_colors(two_types, tmp_path):
    image = picture(two_types, tmp_path, "--size", "320x240", "--diameter", "50 nm")
    assert hue_of(image, BLUE) > 100 and hue_of(image, GREEN) > 100


def test_loads_have_colors(tmp_path):
    path = simulated(tmp_path, TWO_LOADS)
    run = analysis.load(path)
    assert [own.load for own in run.filaments] == ["0.2 pN", "0.2 pN", "10 pN"]
    name = run.filaments[0].type.name
    assert list(filament_colors(run)) == [f"{name}, 0.2 pN", f"{name}, 10 pN"]
    image = picture(path, tmp_path, "--size", "320x240")
    assert hue_of(image, BLUE) > 100 and hue_of(image, GREEN) > 100
    # In other programs, too.
    selections = [line for line in exported(path, tmp_path, "vmd").splitlines() if "mol selection" in line]
    nodes = [" ".join(map(str, range(*ends))) for ends in ((0, 12), (12, 18))]
    assert selections == [f"mol selection {{index {own}}}" for own in nodes]
    content = json.loads(exported(path, tmp_path, "simularium"))
    names = [own["name"] for own in content["trajectoryInfo"]["typeMapping"].values()]
    assert names == list(filament_colors(run))


def test_loads_are_those_of_all_pulls():
    pulls = '[[pull]]\nfilament = [0, 1]\ntension = "0.2 pN"\n'
    pulls += '[[pull]]\nfilament = [1, 2]\nnode = -1\nforce = ["0.3 pN", "0 pN", "-0.4 pN"]\n[simulation]'
    first, rest = TWO_LOADS.replace("count = 2", "count = 3").split("[[pull]]", 1)
    text = first + pulls + rest.split("[simulation]")[1]
    configuration = parse_configuration(text)
    simulation, built = create_simulation(configuration)
    description = describe(configuration, built.filaments, built.system, simulation.topology)
    expected = ["0.2 pN", "0.2 pN + 0.5 pN on node -1", "0.5 pN on node -1", "no pull"]
    assert [own.load for own in description.filaments] == expected


def exported(run, tmp_path, kind):
    path = tmp_path / ("file.tcl" if kind == "vmd" else "file.simularium")
    assert main(["export", str(run), "--format", kind, "--output", str(path)]) == 0
    return path.read_text()


@pytest.mark.parametrize("count", [1, 4, 5, 30])
def test_no_two_kinds_of_filaments_have_one_color(count):
    assert len(set(colors_of_filaments(count))) == count


def test_frames_differ_and_repeat(two_types, tmp_path):
    last, first, again = (picture(two_types, tmp_path, *SIZE, "--frame", n) for n in ("-1", "0", "30"))
    assert np.any(last != first)
    np.testing.assert_array_equal(last, again)


@pytest.mark.parametrize("options", [["--projection", "orthographic"], ["--view", "0,1,0"], ["--whole"]])
def test_views_differ(network, tmp_path, options):
    assert np.any(picture(network, tmp_path, *SIZE) != picture(network, tmp_path, *SIZE, *options))


def test_the_scale_bar_is_as_long_as_it_says(network):
    run = analysis.load(network)
    view = View(size=(400, 300), projection="orthographic")
    (image,) = images(run, [0], Look(), view)
    camera = camera_on(make_scene(run, Look(), [0]).points, view.size, view.projection)
    # Dark pixels without color, in the lowest rows.
    bar = np.flatnonzero(
        np.all(image[-14:-4, :200].max(axis=2) < 60, axis=0) | np.any(image[-14:-4, :200].max(axis=2) < 60, axis=0)
    )
    assert np.all(np.diff(bar) == 1)
    assert len(bar) == pytest.approx(scale_bar_length(camera) * camera.scale, abs=2.0)


@pytest.mark.parametrize(
    ("time", "times", "text"),
    [
        (0.0, [0.0], "0"),
        (0.0, [0.0, 2e9, 100e9], "0 ms"),
        (2e9, [0.0, 2e9, 100e9], "2 ms"),
        (4e12, [4e12], "4.00 s"),
        (20e3, [0.0, 20e3, 40e3, 20e6], "0.02 µs"),
        (20e6, [0.0, 20e3, 40e3, 20e6], "20.00 µs"),
    ],
)
def test_the_clock(time, times, text):
    assert clock_text(time, np.array(times)) == text


def test_nothing_is_written_over_a_box(network):
    run, size = analysis.load(network), (320, 240)
    scene = make_scene(run, Look(), [0])

    def cameras(free):
        return [camera_on(scene.points, (size[0] - free.left - free.right, size[1]), view=np.array([0.0, 0.0, -1.0]))]

    free = margins(scene, cameras, size)
    (image,) = images(run, [0], Look(), View(size=size, direction=(0.0, 0.0, -1.0)))
    dark = np.all(image[:100, :160] < 60, axis=2).any(axis=0)  # Text; lines of the box are lighter.
    assert 0 < np.flatnonzero(dark).max() < free.left
    # From there on there is something: the box.
    lit = np.flatnonzero(np.any(image[110:180] < 200, axis=(0, 2)))
    assert free.left <= lit.min() and lit.max() < size[0]
    (bare,) = cameras(Margins(0, 0))
    seen = bare.seen(scene.points)
    assert (bare.distance * bare.scale * seen[:, 0] / -seen[:, 2]).min() + 160 < np.flatnonzero(dark).max()


def test_wide_scenes_make_room_for_the_scale_of_colors(two_types, tmp_path):
    plain = picture(two_types, tmp_path, "--size", "640x200", "--view", "0,1,0", "--whole")
    scaled = picture(two_types, tmp_path, "--size", "640x200", "--view", "0,1,0", "--whole", "--color", "bending")
    for image, right in ((plain, 640), (scaled, 560)):
        colored = np.ptp(image[:, :560], axis=2).max(axis=0) > 30
        assert np.any(colored) and np.flatnonzero(colored).max() < right


@pytest.mark.parametrize("direction", [(1.0, -1.0, 0.0), (1.0, 1.0, -1.0), (-0.42, 0.83, -0.36)])
def test_films_show_all_filaments(two_types, direction):
    run = analysis.load(two_types)
    frames = [0, 10, 20, 30]
    scene = make_scene(run, Look(), frames)
    camera = camera_on(scene.points, (320, 240), view=np.array(direction))
    seen = camera.seen(np.concatenate([nodes for frame in frames for nodes in run.nodes(frame)]))
    places = camera.distance * camera.scale * seen[:, :2] / -seen[:, 2:]
    assert np.all(np.abs(places) < [160, 120])


@pytest.mark.parametrize(
    "axis", [(1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0), (1.0, 1.0, 1.0), (-0.4, 0.8, -0.4)]
)
def test_what_is_thin_is_seen_from_its_side(axis):
    axis = np.array(axis) / np.linalg.norm(axis)
    across = np.linalg.svd(axis[None])[2][1:]
    turn = np.linspace(0.0, 2.0 * np.pi, 24, endpoint=False)
    circle = np.stack([np.cos(turn), np.sin(turn)], axis=1) @ across
    points = np.concatenate([100.0 * height * axis + 5.0 * circle for height in np.linspace(-1.0, 1.0, 9)])
    camera = camera_on(points, (960, 720))
    assert abs(camera.axes[2] @ axis) < 0.01
    # It fills the picture in one direction.
    assert np.max(np.abs(camera.places(points)).max(axis=0) / [480, 360]) == pytest.approx(0.88)


def test_pictures_of_thin_things_are_thin(tmp_path):
    """They are no larger than what they show needs, unless a size is given."""
    text = """[solvent]
        temperature = "310 K"
        viscosity = "1 mPa*s"
        [[filament]]
        type = "F_ACTIN"
        segments = 5
        start = "straight"
        direction = [1, 0, 0]
        [simulation]
        time_step = "1 us"
        duration = "10 us"
        report_interval = "10 us"
        seed = 1
    """
    run = simulated(tmp_path, text)
    image = picture(run, tmp_path)
    assert image.shape == (360, 960, 3)
    # From its first to its last column.
    assert np.ptp(np.flatnonzero(np.any(np.ptp(image[100:260], axis=2) > 60, axis=0))) > 0.8 * 960
    assert picture(run, tmp_path, *SIZE).shape == (120, 160, 3)


@pytest.mark.parametrize("color", COLORINGS)
def test_colorings(two_types, color):
    run = analysis.load(two_types)
    scene = make_scene(run, Look(color, average=3), [4, 9])
    colors = scene.tubes(9).colors
    assert colors.shape == (3 * 6 + 2, 3)
    tangents = [np.diff(nodes, axis=0) for nodes in run.nodes(9)]
    tangents = [own / np.linalg.norm(own, axis=1, keepdims=True) for own in tangents]
    if color == "type":
        expected = np.array([BLUE] * 18 + [GREEN] * 2) / 255.0
    elif color == "tension":
        expected = scene.scale.colors(np.concatenate(run.segment_tensions(9, 3)) / 0.602214076)
    elif color == "orientation":
        axis = analysis.director(np.concatenate([np.diff(nodes, axis=0) for nodes in run.nodes(4)]))
        expected = scene.scale.colors(np.degrees(np.arccos(np.abs(np.concatenate(tangents) @ axis))))
    else:
        angles = [np.degrees(np.arccos(np.sum(own[1:] * own[:-1], axis=1))) for own in tangents]
        expected = scene.scale.colors(
            np.concatenate([np.r_[own[0], 0.5 * (own[1:] + own[:-1]), own[-1]] for own in angles])
        )
    np.testing.assert_allclose(colors, expected, atol=1e-6)


def test_tubes_are_as_wide_as_asked(two_types):
    run = analysis.load(two_types)
    true = make_scene(run, Look(diameter=0.0), [0]).tubes(0)
    np.testing.assert_allclose(2.0 * true.radii, [6.0] * 18 + [run.filaments[3].diameter] * 2)
    assert set(make_scene(run, Look(diameter=30.0), [0]).tubes(0).radii) == {15.0}
    # Of visible ones, the thickest is a hundredth of the scene wide, the others in proportion.
    visible = make_scene(run, Look(), [0]).diameters
    assert visible[0] / visible[3] == pytest.approx(6.0 / run.filaments[3].diameter)
    assert visible[3] > 20.0


def test_particles_are_balls_of_their_diameter(tmp_path):
    run = analysis.load(simulated(tmp_path, AMONG_SPHERES))
    positions = run.positions(-1)
    assert [(own.name, own.indices.tolist(), own.diameter) for own in run.particles] == [
        ("BIG", [10, 11, 12], 80.0),
        ("SMALL", [13, 14], 40.0),
    ]
    bare, wrapped, whole = (
        make_scene(run, look, [-1]).tubes(-1) for look in (Look(particles=False), Look(), Look(whole=True))
    )
    for drawn in (wrapped, whole):
        np.testing.assert_allclose(drawn.radii[-5:], [40.0] * 3 + [20.0] * 2)
        assert np.all(drawn.ends[-5:, 0] == drawn.ends[-5:, 1])
    assert len(wrapped.ends) == len(bare.ends) + 5
    np.testing.assert_allclose(whole.ends[-5:, 0], positions[10:])
    inside = wrapped.ends[-5:, 0]
    assert np.all((inside >= 0.0) & (inside <= [400.0, 400.0, 500.0]))
    images = (inside - positions[10:]) / [400.0, 400.0, 500.0]
    np.testing.assert_allclose(images, np.round(images), atol=1e-6)
    legends = [make_scene(run, look, [-1]).legend for look in (Look(), Look(particles=False))]
    assert [name for name, _, kind in legends[0] if kind == "particle"] == ["BIG", "SMALL"]
    assert legends[0][0] == legends[1][0] and len(legends[1]) == 1
    pictures = [picture(run.path, tmp_path, *SIZE, *options) for options in ([], ["--no-particles"])]
    assert np.mean(np.any(pictures[0] != pictures[1], axis=2)) > 0.02
    alone = Look(hidden=("BIG",))
    assert [own.name for own in alone.particles_of(run)] == ["SMALL"]
    assert [name for name, _, kind in make_scene(run, alone, [0]).legend if kind == "particle"] == ["SMALL"]
    hidden = picture(run.path, tmp_path, *SIZE, "--hide", "BIG,SMALL")
    np.testing.assert_array_equal(hidden, pictures[1])


def test_water_is_left_out_and_plus_ends_are_marked(network):
    """Of this run: particles that it does not have, and motors that walk."""
    run = analysis.load(network)
    assert "HOH" in Look().hidden and has_polarity(run)
    scene = make_scene(run, Look(whole=True, linkers=False), [6])
    assert ("last node (plus end)", PLUS_END_COLOR, "particle") in scene.legend
    black = np.all(np.abs(scene.tubes(6).colors - np.array(to_rgb(PLUS_END_COLOR))) < 1e-9, axis=1)
    drawn = {tuple(np.round(place, 3)) for place in scene.tubes(6).ends[black][:, 0]}
    assert drawn == {tuple(np.round(own[-1].astype(float), 3)) for own in run.nodes(6)}


def test_linkers_are_drawn_where_they_are(network):
    run = analysis.load(network)
    bare, full = (make_scene(run, Look(whole=True, linkers=shown), [6]).tubes(6) for shown in (False, True))
    records = run.linkers[6]
    there = ~np.isnan(records["places"]).any(axis=2)
    assert len(full.ends) - len(bare.ends) == there.all(axis=1).sum() + there.sum()
    drawn = {tuple(np.round(place, 3)) for place in full.ends[len(bare.ends) :].reshape(-1, 3)}
    assert drawn == {tuple(np.round(place.astype(float), 3)) for place in records["places"][there]}


WALLS = [
    Sphere([100, 0, 0], 3000),
    Ellipsoid([0, 0, 0], [3000, 2000, 1000]),
    Cylinder([0, 0, 0], [1, 1, 0], 2000),
    Capsule([100, 0, 0], [1, 1, 0], 3000, 1000),
    Torus([100, 0, 0], [1, 1, 0], 3000, 1000),
    Box([-2000] * 3, [3000] * 3),
    Slab([0, 0, 10], [0, 0, 1], 900),
    Plane([0, 0, -500], [0, 1, 1]),
]


@pytest.mark.parametrize("wall", WALLS, ids=lambda wall: type(wall).__name__)
def test_walls_are_drawn_where_they_are(two_types, wall):
    run = analysis.load(two_types)
    bare = make_scene(run, Look(), [0])
    run.walls = (wall,)
    scene = make_scene(run, Look(), [0])
    lines = scene.tubes(0)
    lines = lines.ends[~lines.shaded].reshape(-1, 3)
    assert len(lines) >= 20 and np.all(bare.tubes(0).shaded)
    # On the wall: beyond it when moved outwards, within when moved inwards.
    depth = np.sqrt(wall.square_depth(lines))
    assert depth.max() < 1e-3 * np.abs(lines).max()
    middle = getattr(wall, "center", getattr(wall, "point", np.array([500.0] * 3)))
    normal = getattr(wall, "normal", None)
    outwards = (
        0.02 * (lines - middle)
        if normal is None
        else 50.0 * np.sign((lines - middle) @ normal + 1e-9)[:, None] * normal
    )
    if isinstance(wall, Plane):
        outwards = np.tile(-50.0 * wall.normal, (len(lines), 1))
    if isinstance(wall, Torus):
        across = lines - middle - np.outer((lines - middle) @ wall.axis, wall.axis)
        outwards = 0.02 * (lines - middle - 3000 * across / np.linalg.norm(across, axis=1)[:, None])
    if isinstance(wall, Cylinder):
        outwards -= np.outer(outwards @ wall.axis, wall.axis)
    assert np.all(wall.square_depth(lines + outwards) > 0)
    (image,) = images(run, [0], Look(), SMALL)
    assert np.any(image != next(images(analysis.load(two_types), [0], Look(), SMALL)))


def test_a_gif(network, tmp_path):
    path = tmp_path / "film.gif"
    options = ["--film", "--frames", "1::3", "--fps", "10", *SIZE]
    assert main(["render", str(network), "--output", str(path), *options]) == 0
    film = Image.open(path)
    assert (film.n_frames, film.size, film.info["duration"], film.info["loop"]) == (4, (160, 120), 100, 0)
    assert list(tmp_path.iterdir()) == [path]


def test_a_gif_keeps_the_colors_of_its_legend(network, tmp_path):
    path = tmp_path / "film.gif"
    options = ["--film", "--frames", ":2", "--size", "640x480"]
    assert main(["render", str(network), "--output", str(path), *options]) == 0
    there = {tuple(color) for color in np.asarray(Image.open(path).convert("RGB")).reshape(-1, 3)}
    run = analysis.load(network)
    for color in (*filament_colors(run).values(), *linker_colors(run)):
        assert tuple(bytes.fromhex(color[1:])) in there, color


@pytest.mark.parametrize("ending", ["mp4", "webm"])
def test_a_film(network, tmp_path, ending):
    path = tmp_path / f"film.{ending}"
    options = ["--film", "--frames", ":5", "--turn", "90", "--fps", "5", *SIZE]
    assert main(["render", str(network), "--output", str(path), *options]) == 0
    reader = imageio_ffmpeg.read_frames(str(path))
    information = next(reader)
    assert information["size"] == (160, 120) and information["fps"] == 5.0
    frames = [np.frombuffer(frame, np.uint8).reshape(120, 160, 3).astype(int) for frame in reader]
    assert len(frames) == 5
    expected = list(images(analysis.load(network), list(range(5)), Look(), View(size=(160, 120), turn=90.0)))
    motion = np.abs(expected[0].astype(int) - expected[4]).mean()
    assert motion > 5.0
    for frame, image in zip(frames, expected):
        assert np.abs(frame - image).mean() < 0.5 * motion


def test_without_ffmpeg(network, tmp_path, monkeypatch, capsys):
    monkeypatch.setitem(sys.modules, "imageio_ffmpeg", None)
    assert main(["render", str(network), "--film", "--output", str(tmp_path / "a.mp4")]) == 2
    assert "pip install imageio-ffmpeg, or write a GIF" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--output", "a.jpg"], "A picture is a file that ends in .png"),
        (["--film", "--output", "a.png"], "A film is a file that ends in .gif or .mp4 or .webm"),
        (["--output", "no/where.png"], "is not a directory"),
        (["--frame", "11"], "frames 0 to 10"),
        (["--size", "161x120"], "even numbers of pixels"),
        (["--size", "big"], "--size must be 2 numbers"),
        (["--view", "0,0,0"], "must be a direction"),
        (["--view", "0,0"], "--view must be 3 numbers"),
        (["--projection", "flat"], "projection must be one of"),
        (["--color", "mood"], "color must be one of type, tension"),
        (["--average", "0", "--color", "tension"], "average"),
        (["--diameter", "thick"], "--diameter"),
        (["--diameter", "-3 nm"], "--diameter must be positive"),
        (["--turn", "5"], "belong to --film"),
        (["--film", "--output", "a.gif", "--frames", "20:"], "selects none"),
        (["--film", "--output", "a.gif", "--frames", "a"], "--frames must be such as"),
        (["--film", "--output", "a.gif", "--fps", "0"], "frames per second"),
    ],
)
def test_refusals(network, tmp_path, monkeypatch, capsys, options, message):
    monkeypatch.chdir(tmp_path)
    given = options if "--output" in options else [*options, "--output", "a.png"]
    assert main(["render", str(network), *given]) == 2
    assert message in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


def test_incomplete_runs_are_drawn_if_asked(two_types, tmp_path, capsys):
    copy = shutil.copytree(two_types, tmp_path / "copy")
    with open(copy / "energies.csv", "r+b") as file:
        file.truncate((copy / "energies.csv").stat().st_size - 2)
    assert main(["render", str(copy), "--output", str(tmp_path / "a.png")]) == 2
    assert "incomplete" in capsys.readouterr().err
    assert picture(copy, tmp_path, "--incomplete", *SIZE).shape == (120, 160, 3)


def test_a_film_needs_frames(two_types, tmp_path):
    with pytest.raises(InputError, match="needs a frame"):
        write_film(analysis.load(two_types), tmp_path / "a.gif", [])
