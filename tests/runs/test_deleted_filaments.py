"""Filaments that stages delete or cut: which ones, and what happens to all that holds them."""

import json
import warnings

import numpy as np
import pytest

from openmm_cylchain import InputError, StageWarning, analysis
from openmm_cylchain.cli import main
from openmm_cylchain.export.simularium import write_simularium
from openmm_cylchain.output.read_tables import read_reports, read_table
from openmm_cylchain.rendering import Look
from openmm_cylchain.rendering.scene import make_scene
from openmm_cylchain.runs.configuration import parse_configuration
from openmm_cylchain.runs.dry_run import dry_run
from openmm_cylchain.runs.run import run
from openmm_cylchain.runs.tables.deletion import Deletion
from support.run_figures import rendered
from support.small_runs import NETWORK
from support.staged_runs import DELETING, DELETING_GROWN

pytestmark = pytest.mark.filterwarnings(
    "ignore::openmm_cylchain.errors.TimeStepWarning", "ignore::openmm_cylchain.errors.ContactWarning"
)


@pytest.fixture(scope="module")
def deleting(tmp_path_factory):
    path = tmp_path_factory.mktemp("deleting")
    run(parse_configuration(DELETING), path / "out")
    return analysis.load(path / "out")


def those_there(found):
    return np.array([[len(own) > 0 for own in found.nodes(frame)] for frame in range(len(found))])


def test_those_in_a_region_go(deleting):
    there = those_there(deleting)
    before, after = deleting.stages[0].frames[-1], deleting.stages[1].frames[0]
    middles = np.array([own.mean(axis=0) for own in deleting.nodes(before)])
    distances = np.linalg.norm(middles - [500.0, 0.0, 0.0], axis=1)
    assert np.all(there[: before + 1]) and 5 < (distances < 500.0).sum() < 35
    np.testing.assert_array_equal(there[after], distances >= 500.0)
    assert there.sum(axis=1).tolist() == [40] * 3 + [
        int((distances >= 500.0).sum()) - lost for lost in (0, 0, 5, 5, 10, 10)
    ]
    # None comes back, and each repetition draws others.
    assert not np.any(~there[:-1] & there[1:])


def test_nothing_holds_what_has_gone(deleting, tmp_path):
    there = those_there(deleting)
    loads = read_reports(deleting.path / "contact_forces.csv")["load (pN)"]
    for frame in range(len(deleting)):
        held = set(deleting.linkers[frame]["filaments"].ravel().tolist()) - {-1}
        assert held <= set(np.flatnonzero(there[frame]))
        assert not set(np.flatnonzero(~there[frame])) & set(deleting.contacts(frame).filaments.ravel())
        assert not loads[frame][~there[frame]].any()
    active = [deleting.crosslinks(frame).active for frame in range(len(deleting))]
    assert active[0].all() and 0 < active[-1].sum() < active[3].sum() < 20
    # A link is off where one of the two has gone.
    nodes = deleting.nodes(0)
    places = deleting.crosslinks(0).places
    owners = [
        [int(np.argmin([np.linalg.norm(own - place, axis=1).min() for own in nodes])) for place in each]
        for each in places
    ]
    np.testing.assert_array_equal(active[-1], there[-1][owners].all(axis=1))
    table = read_reports(deleting.path / "linkers.csv")
    assert np.all(table["unbound"] + table["one hand bound"] + table["both hands bound"] == 60)


def test_frames_pictures_and_tables_are_without_them(deleting, tmp_path):
    there, last = those_there(deleting), len(deleting) - 1
    assert deleting.passing == frozenset(np.flatnonzero(~there[-1]))
    assert [len(own) > 0 for own in deleting.segment_tensions(last)] == there[-1].tolist()
    assert [len(own) > 0 for own in deleting.bends(last)] == there[-1].tolist()
    with pytest.raises(InputError, match="Filaments come or go in these frames"):
        deleting.segment_tensions(3, average=4)
    with pytest.raises(InputError, match="come and go|come or go"):
        analysis.mesh_size(deleting, volume=1e9)
    assert np.isfinite(analysis.stress(deleting, last, volume=1e9).total).all()
    scene = make_scene(deleting, Look(linkers=False), [0])
    gone = len(scene.tubes(0).radii) - len(scene.tubes(last).radii)
    assert gone == (~there[-1]).sum() * 4
    write_simularium(deleting, tmp_path / "run.simularium")
    data = json.loads((tmp_path / "run.simularium").read_text())["spatialData"]["bundleData"][last]["data"]
    assert len(data) > 0
    lengths = analysis.contour_lengths(deleting.mdtraj([last]))[0]
    np.testing.assert_array_equal(np.isfinite(lengths), there[-1])
    # Energies are those of the filaments that there are: per segment, of about kT/2.
    energies = read_table(deleting.path / "energies.csv")
    per_segment = energies["stretching energy per segment (kT)"]
    kT = energies["stretching energy (pN nm)"] / per_segment / (4 * there.sum(axis=1))
    assert kT == pytest.approx(kT[0], rel=1e-6)


def test_summary_says_what_is_there_all_the_time(tmp_path, capsys):
    path = tmp_path / "run.toml"
    path.write_text(DELETING + "[[stage]]\nduration = '0.1 ms'\nfilament.ROD.delete = {}\n")
    with rendered():
        assert main(["run", str(path), "--output", str(tmp_path / "out")]) == 0
    assert "None of them is there all the time" in capsys.readouterr().out
    assert those_there(analysis.load(tmp_path / "out"))[-2:].any() == False  # noqa: E712


def test_grown_filaments_go_with_their_monomers(tmp_path):
    """Those of a table with their branches and parts; what held them lets go, and pools get nothing."""
    run(parse_configuration(DELETING_GROWN), tmp_path / "out")
    found = analysis.load(tmp_path / "out")
    there = those_there(found)
    first, fewer, middle, laser = (own.frames for own in found.stages)
    assert there[first[-1]].sum() >= 25 and np.all(there[first[-1]][:20])
    lengths, free = found.growth["length (nm)"], found.growth["free monomers (uM)"][:, 0]
    total = lengths.sum(axis=1) / 5.0 + free * 2.0 * 602.214
    for own in (first, fewer, middle, laser):
        assert total[own] == pytest.approx(total[own[0]], abs=0.1)
    # Within the first report of a stage, some begin anew.
    lost = np.flatnonzero(there[first[-1]] & ~there[fewer[0]])
    assert 12 <= len(lost) <= 15
    lost_monomers = lengths[first[-1]][lost].sum() / 5.0
    assert total[first[-1]] - total[fewer[0]] >= lost_monomers - 0.1
    distances = [np.linalg.norm(own.mean(axis=0)) for own in found.nodes(middle[-1]) if len(own)]
    assert max(distances) < 800.0 and there[middle[-1]].sum() < there[fewer[-1]].sum()
    for frame in range(len(found)):
        held = set(found.linkers[frame]["filaments"].ravel().tolist()) - {-1}
        assert held <= set(np.flatnonzero(there[frame]))
    # Planes cut where filaments go through them.
    severed = read_reports(found.path / "growth.csv")["filaments severed"][:, 0]
    crossings = [
        np.sum(np.diff(own[:, axis] > height))
        for own in found.nodes(middle[-1])
        for axis, height in ((0, 0.0), (1, 50.0))
        if len(own)
    ]
    cuts = severed[laser[0]] - severed[middle[-1]]
    assert 3 <= cuts <= sum(crossings) <= cuts + 3


ROD_THAT_IS_CUT = """
[solvent]
temperature = "300 K"
viscosity = "1 Pa*s"
[[monomers]]
name = "unit"
length = "10 nm"
plus_on_rate = "1 1/(uM*s)"
plus_off_rate = "1 1/s"
concentration = "0 uM"
[[filament]]
name = "ROD"
diameter = "10 nm"
segment_length = "100 nm"
persistence_length = "1 mm"
stretching_modulus = "1 nN"
segments = 8
position = ["-0.4 um", "0 um", "0 um"]
direction = [1, 0, 0]
growth = { longest = "1 um", shortest = "0.1 um", severing_rate = "0 1/(um*s)" }
reserve = 3
[simulation]
time_step = "1 us"
report_interval = "10 us"
seed = 1
[[stage]]
duration = "10 us"
[[stage]]
name = "laser"
duration = "10 us"
[stage.filament.ROD]
cut = [{ normal = [1, 0, 0] }, { point = ["0.2 um", "0 um", "0 um"], normal = [1, 0, 0] }]
"""


@pytest.mark.parametrize(
    ("old", "new", "cuts"),
    [("", "", 2), ("reserve = 3", "reserve = 1", 1), ('["0.2 um"', '["0.35 um"', 1)],
)
def test_a_run_says_where_planes_cut_and_where_not(tmp_path, capsys, old, new, cuts):
    """Neither without a place for a part, nor where it would be too short; the dry run says so too."""
    configuration = parse_configuration(ROD_THAT_IS_CUT.replace(old, new))
    text = f"laser: filaments of [[filament]] number 1 are cut at {cuts} of the 2 places"
    for simulate in (lambda: run(configuration, tmp_path / "out"), lambda: list(dry_run(configuration))):
        with warnings.catch_warnings(record=True) as found:
            warnings.simplefilter("always")
            simulate()
        warned = [str(own.message) for own in found if own.category is StageWarning]
        assert len(warned) == (cuts < 2) and all(own.startswith(text) for own in warned)
    assert text in capsys.readouterr().out
    severed = read_reports(tmp_path / "out" / "growth.csv")["filaments severed"][:, 0]
    assert severed.tolist() == [0, 0, cuts]


def test_each_has_the_same_chance():
    generator = np.random.default_rng(1)
    deletion = Deletion(3, None, False)
    counts = np.zeros(10)
    for _ in range(6000):
        counts[deletion.chosen(np.zeros((10, 3)), None, generator)] += 1
    # Binomial, with p = 0.3.
    error = np.sqrt(6000 * 0.3 * 0.7)
    assert error < 0.05 * 1800 and np.abs(counts - 1800).max() < 4.0 * error
    assert len(deletion.chosen(np.zeros((2, 3)), None, generator)) == 2


def test_regions_are_periodic():
    text = (
        DELETING.partition("[[link]]")[0]
        + """
[box]
edges = ["2 um", "2 um", "2 um"]
[simulation]
time_step = "0.5 us"
report_interval = "50 us"
seed = 4
[[stage]]
duration = "50 us"
[[stage]]
duration = "50 us"
[stage.filament.ROD.delete.outside]
shape = "box"
lower = ["0 um", "0 um", "0 um"]
upper = ["1 um", "2 um", "2 um"]
"""
    )
    deletion = parse_configuration(text).stages[1].configuration.filaments[0].delete
    middles = np.array([[500.0, 10.0, 3990.0], [1500.0, 10.0, 10.0], [-1500.0, -10.0, 10.0], [-500.0, 0.0, 0.0]])
    chosen = deletion.chosen(middles, np.full(3, 2000.0), np.random.default_rng(0))
    assert chosen.tolist() == [1, 3]


STAGED = (
    NETWORK.replace('duration = "1 ms"\n', "")
    + """[[stage]]
duration = "0.1 ms"
[[stage]]
name = "thin"
duration = "0.1 ms"
"""
)


@pytest.mark.parametrize(
    ("text", "line", "message"),
    [
        (NETWORK.replace("[[linkers]]", "delete = { count = 1 }\n[[linkers]]", 1), "delete", "belongs to a [[stage]]"),
        (
            STAGED.replace("[[stage]]\n", "[[stage]]\nfilament.delete = {}\n", 1),
            "filament.delete",
            "belongs to a later stage",
        ),
        (STAGED + "filament.delete = { number = 3 }", "filament.delete", "unknown key 'number'"),
        (STAGED + "filament.cut = [{ normal = [1, 0, 0] }]", "filament.cut", "needs filaments that may be cut"),
        (STAGED + "filament.cut = [3]", "filament.cut", "must be a table, as in { normal = [1, 0, 0] }"),
        (STAGED + "filament.cut = { normal = [1, 0, 0] }", "filament.cut", "must be a list of tables"),
        (STAGED + "filament.delete = { count = 0 }", "filament.delete", "must be at least 1"),
        (
            STAGED
            + 'filament.delete = { inside = { shape = "sphere", radius = "1 um" }, outside = { shape = "sphere", '
            'radius = "1 um" } }',
            "filament.delete",
            "say the same",
        ),
        (
            STAGED.replace("[[linkers]]", '[[tether]]\nfilament = 0\nnode = 0\nstiffness = "1 pN/nm"\n[[linkers]]', 1)
            + "filament.delete = { count = 1 }",
            "[[stage]]",
            "has a [[tether]] that holds filaments of [[filament]] number 1, of which some have been deleted",
        ),
    ],
)
def test_what_is_refused_says_where(text, line, message):
    with pytest.raises(InputError) as error:
        parse_configuration(text)
    numbers = [number for number, own in enumerate(text.splitlines(), start=1) if own.startswith(line)]
    assert message in str(error.value)
    assert any(str(error.value).startswith(f"line {number}: ") for number in numbers)


def test_a_tether_that_is_taken_away_refuses_nothing():
    text = STAGED.replace("[[linkers]]", '[[tether]]\nfilament = 0\nnode = 0\nstiffness = "1 pN/nm"\n[[linkers]]', 1)
    configuration = parse_configuration(text + "filament.delete = { count = 2 }\ntether.active = false")
    assert any("thin: from" in line for line in dry_run(configuration))


def test_beads_of_deleted_beams_touch_nothing(tmp_path):
    """Two beams that overlap, of which one goes: its beads are still somewhere."""
    beam = (
        '[[filament]]\ntype = "MICROTUBULE"\nelement = "beam"\nsegment_length = "500 nm"\n'
        'nodes = [["0 um", "{0} nm", "0 um"], ["0.5 um", "{0} nm", "0 um"], ["1 um", "{0} nm", "0 um"]]\n'
    )
    text = '[solvent]\ntemperature = "300 K"\nviscosity = "10 mPa*s"\n' + beam.format(0) + beam.format(20)
    text += (
        '[contacts]\ndiameter = "25 nm"\nrelax = false\n[simulation]\ntime_step = "0.1 us"\nseed = 1\nchecks = false\n'
    )
    text += (
        'report_interval = "1 us"\n[[stage]]\nduration = "2 us"\n[[stage]]\nduration = "2 us"\nfilament.2.delete = {}\n'
    )
    run(parse_configuration(text), tmp_path / "out")
    found = analysis.load(tmp_path / "out")
    assert [len(found.contacts(frame).gaps) > 0 for frame in range(5)] == [True, True, True, False, False]
    assert [len(own) for own in found.curves(4)] == [17, 0]
