"""Filaments that grow in runs from files: what is built, what is refused, and what a run writes of them."""

import json
import re

import gsd.hoomd
import numpy as np
import openmm
import pytest
from openmm import unit

from openmm_cylchain import (
    ACTIN_ATP,
    F_ACTIN,
    Filaments,
    Growth,
    GrowthReporter,
    InputError,
    MonomerPool,
    Monomers,
    RunReporter,
    analysis,
)
from openmm_cylchain.cli import main
from openmm_cylchain.output.read_tables import read_reports, read_table
from openmm_cylchain.rendering.scene import COLORINGS, Look, has_polarity, make_scene
from openmm_cylchain.runs.configuration import changed_keys, parse_configuration
from openmm_cylchain.runs.growth_summary import free_rate
from openmm_cylchain.runs.initial_state import build_system
from openmm_cylchain.runs.relaxation import relaxed_positions
from openmm_cylchain.runs.run import begin, create_simulation
from support.configurations import GROWING
from support.run_figures import rendered

HEAD = '[solvent]\ntemperature = "298 K"\nviscosity = "1 mPa*s"\n'
MONOMERS = '[[monomers]]\ntype = "ACTIN_ATP"\nconcentration = "5 uM"\n'
FILAMENT = '[[filament]]\ntype = "F_ACTIN"\nsegment_length = "108 nm"\nsegments = 5\ncount = 2\n'
GROWTH = 'growth = { longest = "1 um" }\n'
STILL = FILAMENT.replace("108", "100")
TAIL = '[simulation]\ntime_step = "1 ms"\nduration = "0.1 s"\nreport_interval = "10 ms"\n'
WALL = '[[wall]]\nshape = "sphere"\nradius = "2 um"\nstiffness = "0.1 pN/nm"\n'
BOX = '[box]\nedges = ["2 um", "2 um", "2 um"]\n'


def parse(*tables, monomers=MONOMERS, filament=FILAMENT + GROWTH, simulation=TAIL):
    return parse_configuration(HEAD + monomers + filament + "".join(tables) + simulation)


def test_what_is_built_is_that_of_python():
    """Two tables that share a pool, and one with monomers of its own."""
    slow = '[[monomers]]\nname = "slow"\nlength = "3 nm"\nplus_on_rate = "5 1/(uM*s)"\nplus_off_rate = "2 1/s"\n'
    slow += 'concentration = "2 uM"\nvolume = "0.5 um^3"\n'
    first = 'growth = { monomers = "ACTIN_ATP", longest = "1 um", shortest = "300 nm", plus_capped = true }\n'
    second = 'growth = { monomers = "ACTIN_ATP", longest = "2 um" }\n'
    third = (
        'growth = { monomers = "slow", longest = "2 um", minus_capped = true }\nclamped = [0]\npropulsion = "0.1 pN"\n'
    )
    tables = FILAMENT + first, FILAMENT + second, FILAMENT.replace("108", "60") + third
    configuration = parse(
        BOX, monomers=MONOMERS + 'minus_off_rate = "1 1/s"\nvolume = "box"\n' + slow, filament="".join(tables)
    )
    own = build_system(configuration, None, 3)
    nodes = [filament.positions for filament in own.filaments]
    filaments = Filaments(1e-3 * unit.pascal * unit.second, 298)
    micromolar, per_second = unit.Quantity(1e-6, unit.molar), 1 / unit.second
    pool = MonomerPool(5 * micromolar, 8.0 * unit.micrometer**3)
    actin = Monomers(
        length=2.7,
        plus_on_rate=ACTIN_ATP.plus_on_rate,
        plus_off_rate=1.4 * per_second,
        minus_on_rate=ACTIN_ATP.minus_on_rate,
        minus_off_rate=1.0 * per_second,
    )
    slow = Monomers(length=3.0, plus_on_rate=5 / (micromolar * unit.second), plus_off_rate=2 * per_second)
    growths = (
        Growth(monomers=actin, pool=pool, longest=1000, shortest=300, plus_capped=True),
        Growth(monomers=actin, pool=pool, longest=2000),
        Growth(
            monomers=slow, pool=MonomerPool(2 * micromolar, 0.5 * unit.micrometer**3), longest=2000, minus_capped=True
        ),
    )
    for number, positions in enumerate(nodes):
        kind = F_ACTIN.with_segment_length(108 if number < 4 else 60)
        held = {"clamped": [0], "propulsion": 0.1 * unit.piconewton} if number > 3 else {}
        filaments.add_nodes(kind, positions, growth=growths[number // 2], **held)
    _, system, _ = filaments.build(np.diag([2000.0] * 3))
    texts = [_rounded(openmm.XmlSerializer.serialize(one)) for one in (own.system, system)]
    assert texts[0] == texts[1]


def _rounded(text):
    # Rates as text have 15 digits.
    return re.sub(r"\d*\.\d+(e[-+]\d+)?", lambda number: f"{float(number[0]):.12g}", text)


NODE = '[[tether]]\nfilament = 0\nnode = 0\nstiffness = "1 pN/nm"\n'
LINK = '[[link]]\nstiffness = "1 pN/nm"\n'
LINKERS = '[[linkers]]\ntype = "MYOSIN_II"\n'
NAMED = MONOMERS + 'name = "other"\n'


@pytest.mark.parametrize(
    ("message", "tables", "parts"),
    [
        ("needs monomers: add a [[monomers]] table", (), {"monomers": ""}),
        ("but no filaments grow: add to a [[filament]] table", (), {"filament": FILAMENT}),
        ("lacks the key 'monomers': there are ACTIN_ATP, other", (), {"monomers": MONOMERS + NAMED}),
        ("is called 'other', and so is another one", (), {"monomers": NAMED + NAMED}),
        (
            "is 'x', but there are ACTIN_ATP",
            (),
            {"filament": FILAMENT + 'growth = { monomers = "x", longest = "1 um" }\n'},
        ),
        ("plus_on_rate has the unit nm", (), {"monomers": MONOMERS + 'plus_on_rate = "1 nm"\n'}),
        ("lacks its rates", (), {"monomers": NAMED.replace('type = "ACTIN_ATP"', 'length = "2 nm"')}),
        ("lacks the key 'length'", (), {"monomers": NAMED.replace('type = "ACTIN_ATP"', 'plus_off_rate = "2 1/s"')}),
        ("lacks the key 'concentration'", (), {"monomers": '[[monomers]]\ntype = "ACTIN_ATP"\n'}),
        ("that are counted one by one", (), {"monomers": MONOMERS + 'volume = "1 m^3"\n'}),
        ("add a periodic [box]", (), {"monomers": MONOMERS + 'volume = "box"\n'}),
        ('whole number of monomers, as with segment_length = "99.9 nm"', (), {"filament": STILL + GROWTH}),
        ("lacks the key 'longest'", (), {"filament": FILAMENT + "growth = {}\n"}),
        ("is 540 nm long, but its growth", (), {"filament": FILAMENT + 'growth = { longest = "0.4 um" }\n'}),
        (
            "lacks the key 'rescue_rate': an end that grows and shrinks",
            (),
            {"filament": FILAMENT + 'growth = { longest = "1 um", catastrophe_rate = "1 1/s" }\n'},
        ),
        ("only open filaments of straight segments", (), {"filament": FILAMENT + GROWTH + "closed = true\n"}),
        ("only open filaments of straight", (), {"filament": FILAMENT + GROWTH + 'element = "beam"\n'}),
        ("the first node alone may be clamped", (), {"filament": FILAMENT + GROWTH + "clamped = [0]\n"}),
        ("a friction_length that is a length", (), {"filament": FILAMENT + GROWTH + 'friction_length = "filament"\n'}),
        ("engine has no filaments that grow", (), {"simulation": TAIL + 'engine = "portable"\n'}),
        ("scheme has no filaments that grow", (), {"simulation": TAIL + 'scheme = "midpoint"\n'}),
        (
            "anchors must be points where filaments grow",
            ('[[filament]]\ntype = "MICROTUBULE"\nsegments = 2\n', LINKERS, "anchors = [0, 1, 2]\n")
            + ('hand = { binds_to = "MICROTUBULE" }\n',),
            {},
        ),
        ("tethers hold the first node alone", (NODE,), {}),
        ("constant forces do not pull at", ('[[pull]]\ntable = 1\ntension = "1 pN"\n',), {}),
        ("may join filaments that grow", (LINK, 'within = "1 um"\n'), {}),
        (
            "links do not join filaments that grow",
            (LINK, 'between = [{ point = ["0 nm", "0 nm", "0 nm"] }, { filament = 1, node = 0 }]\n'),
            {},
        ),
    ],
)
def test_what_does_not_go_together_is_refused(message, tables, parts):
    with pytest.raises(InputError) as caught:
        parse(*tables, **parts)
    assert message in str(caught.value) and str(caught.value).startswith(("line ", "[[")), caught.value


def test_changes_are_named():
    changed = parse(monomers=MONOMERS.replace("5 uM", "6 uM"), filament=FILAMENT + GROWTH.replace("1 um", "2 um"))
    names = ["[[filament]] number 1: growth", "[[monomers]] number 1: concentration"]
    assert changed_keys(parse(), changed) == names


def test_filaments_that_come_apart_before_the_run_do_not_grow():
    configuration = parse(
        '[contacts]\ndiameter = "10 nm"\n',
        monomers=MONOMERS.replace("5 uM", "5 mM"),
        filament=FILAMENT + GROWTH + 'inside = { shape = "sphere", radius = "0.4 um" }\n',
    )
    built = build_system(configuration, None, 1)
    positions = relaxed_positions(configuration, built)._value
    for nodes in built.filaments.node_indices:
        # Five segments of 108 nm, and spare nodes on the last one.
        lengths = np.linalg.norm(np.diff(positions[nodes], axis=0), axis=1)
        assert np.all(np.abs(lengths[:5] - 108.0) < 5.0) and np.all(lengths[5:] == 0.0)


def test_ends_may_grow_and_shrink_in_turn():
    rates = 'catastrophe_rate = "3 1/s", rescue_rate = "1 1/s", shrinking_off_rate = "100 1/s"'
    configuration = parse(filament=FILAMENT + f'growth = {{ longest = "1 um", {rates} }}\n')
    growth = configuration.filaments[0].growth
    turning = growth.plus_instability
    found = (turning.shrinking_on_rate, turning.shrinking_off_rate, turning.catastrophe_rate, turning.rescue_rate)
    assert found == pytest.approx((0.0, 1e-10, 3e-12, 1e-12)) and not growth.minus_instability
    # A quarter of the time it grows, with 11.6 - 1.4 monomers per second at 1 uM.
    assert free_rate(growth, "plus", 1.0) == pytest.approx(0.25 * 10.2 - 0.75 * 100.0)


@pytest.fixture(scope="module")
def directory(tmp_path_factory):
    path = tmp_path_factory.mktemp("growing")
    (path / "growing.toml").write_text(GROWING)
    with rendered():
        assert main(["run", str(path / "growing.toml"), "--output", str(path / "out")]) == 0
    assert (path / "out" / "summary.png").stat().st_size > 10_000
    return path / "out"


def test_run_says_how_far_filaments_have_grown(directory, capsys):
    configuration = parse_configuration(GROWING)
    simulation, built = create_simulation(configuration)
    simulation.context.loadCheckpoint((directory / "checkpoint.chk").read_bytes().partition(b"\n")[2])
    growth = built.filaments.in_context(simulation.context).growth()
    table = read_reports(directory / "growth.csv")
    assert len(table["step"]) == 21 and table["filament"].shape[1] == 6
    last = {name: values[-1] for name, values in table.items()}
    np.testing.assert_array_equal(last["filament"], growth.filaments)
    np.testing.assert_array_equal(last["nodes"], growth.nodes)
    np.testing.assert_allclose(last["length (nm)"], growth.lengths._value, rtol=1e-12)
    np.testing.assert_allclose(last["free monomers (uM)"], 1e6 * growth.concentrations._value, rtol=1e-12)
    for end, which in enumerate(("minus", "plus")):
        names = {"gained": "gained (monomers)", "lost": "lost (monomers)"}
        for what in ("gained", "lost", "waited", "shrinking", "catastrophes", "rescues"):
            found = last[f"{which} end {names.get(what, what)}"]
            np.testing.assert_array_equal(found, getattr(growth, what)[:, end])
        gained = last[f"{which} end gained (monomers)"] - last[f"{which} end lost (monomers)"]
        moved = gained * (1, -1)[which == "minus"]
        first = table[f"{which} end (monomers)"][0]
        np.testing.assert_array_equal(last[f"{which} end (monomers)"], first + moved)
    # The box holds less monomers by those that filaments have.
    gained = (growth.gained - growth.lost)[:5].sum()
    free = table["free monomers (uM)"][:, 0]
    volume = 4 / 3 * np.pi * 0.8**3
    assert gained > 100
    np.testing.assert_allclose(free[0] - free[-1], gained / volume / 602.214076, rtol=1e-6)


def test_steps_resolve_the_relaxation_of_the_longest(tmp_path, capsys):
    said = []
    for name, growth, segments in (("still", "", 9), ("grows", GROWTH, 5)):
        path = tmp_path / f"{name}.toml"
        path.write_text(HEAD + MONOMERS * bool(growth) + FILAMENT.replace("= 5", f"= {segments}") + growth + TAIL)
        assert main(["timestep", str(path)]) == 0
        said.append(re.search(r"allowed by relaxation +(\S+ \S+)", capsys.readouterr().out)[1])
    # 1 um are nine segments of 108 nm.
    assert said[0] == said[1]


def test_a_run_reporter_writes_the_same(directory, tmp_path):
    configuration = parse_configuration(GROWING)
    simulation, built = create_simulation(configuration)
    begin(configuration, simulation, built)
    simulation.reporters.append(RunReporter(tmp_path / "out", 50, built.filaments))
    simulation.reporters.append(GrowthReporter(tmp_path / "growth.csv", 50, built.filaments))
    simulation.step(500)
    header, *lines = (tmp_path / "growth.csv").read_text().splitlines()
    assert header in (directory / "growth.csv").read_text() and len(lines) == 60
    assert set(lines) < set((directory / "growth.csv").read_text().splitlines())
    for name in ("growth.csv", "energies.csv"):
        text = (tmp_path / "out" / name).read_text()
        assert (directory / name).read_text().startswith(text) and text.count("\n") > 10, name
    assert len(analysis.load(tmp_path / "out").growth["nodes"]) == 11


def test_energies_are_those_of_the_segments_that_there_are(directory):
    table, energies = read_reports(directory / "growth.csv"), read_table(directory / "energies.csv")
    segments = table["nodes"].sum(axis=1) - 6 + 3
    per_segment = energies["stretching energy (pN nm)"] / segments / (1.380649e-2 * 298)
    np.testing.assert_allclose(energies["stretching energy per segment (kT)"], per_segment, rtol=1e-9)
    assert np.all(np.isfinite(energies["bending energy per joint (kT)"]))
    # 20 frames of 35 segments, with a standard error of sqrt(1/2/700) in equilibrium.
    assert abs(per_segment.mean() - 0.5) < 4 * 0.03
    assert len(set(segments)) > 1


def test_summary_has_what_ends_did(directory, capsys):
    again = GROWING.replace("50 uM", "500 uM").replace("100 ms", "30 ms")
    (directory.parent / "again.toml").write_text(again)
    assert main(["run", str(directory.parent / "again.toml"), "--output", str(directory.parent / "again")]) == 0
    said = capsys.readouterr().out
    assert re.search(r"3 × ACT, 4 segments, plus ends +\d+ +\d+ ", said) and "minus end " not in said
    assert "mean length of filaments that grow (nm)" in said and "They grow: see growth.csv" in said
    assert re.search(r"\d+ monomers more would have come, .* give growth a larger longest", said)
    run = analysis.load(directory)
    assert len(run) == 21


def test_dry_run_says_what_is_expected(directory, capsys):
    assert main(["run", str(directory / "configuration.toml"), "--dry-run"]) == 0
    said = capsys.readouterr().out
    assert "+579 monomers/s at the plus end and +64.2 monomers/s at the minus end, where it is free, at 50 uM" in said
    assert re.search(r"-50 monomers/s at the plus end, where it is free, at 2 uM; \d+ spare nodes each, for a", said)


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("color", COLORINGS)
def test_pictures_have_the_nodes_that_there_are(directory, color):
    run = analysis.load(directory)
    scene = make_scene(run, Look(color=color, diameter=0.0, linkers=False), [20])
    tubes = scene.tubes(20)
    segments = run.growth["nodes"][20].sum() - 6 + 3
    assert has_polarity(run)
    # Beside lines of the wall, and balls at plus ends.
    assert np.sum(np.isin(np.round(tubes.radii, 6), (3.0, 12.5))) == segments
    assert np.all(np.isfinite(tubes.colors))


def test_exports_have_the_nodes_that_there_are(directory, tmp_path):
    run = analysis.load(directory)
    for kind, name in (("ovito", "a.gsd"), ("simularium", "a.simularium"), ("vmd", "a.tcl")):
        assert main(["export", str(directory), "--format", kind, "--output", str(tmp_path / name)]) == 0
    content = json.loads((tmp_path / "a.simularium").read_text())
    with gsd.hoomd.open(str(tmp_path / "a.gsd")) as file:
        for frame in (0, 20):
            nodes = run.growth["nodes"][frame].astype(int).tolist() + [4]
            assert np.sum(np.isin(file[frame].particles.typeid, (0, 1))) == sum(nodes)
            assert np.sum(np.isin(file[frame].bonds.typeid, (0, 1))) == sum(nodes) - 7
            data, place, points = content["spatialData"]["bundleData"][frame]["data"], 0, []
            for _ in nodes:
                points.append(int(data[place + 10]) // 3)
                place += 11 + int(data[place + 10])
            assert points == nodes


def test_free_ends_treadmill_at_that_concentration():
    growth = Growth(monomers=ACTIN_ATP, pool=unit.Quantity(1e-6, unit.molar), longest=1000.0)
    concentration = 1e6 * ACTIN_ATP.treadmilling_concentration._value
    assert concentration == pytest.approx(2.2 / 12.9)
    assert free_rate(growth, "plus", concentration) == pytest.approx(0.578, abs=5e-4)
    assert free_rate(growth, "minus", concentration) == pytest.approx(-0.578, abs=5e-4)
