"""Filaments that begin, vanish, are cut and branch in runs from files: what is built, refused, and written."""

import json
import re

import numpy as np
import pytest
from openmm import unit

from openmm_cylchain import (
    ACTIN_AGING,
    Branching,
    InputError,
    MonomerState,
    Nucleation,
    Severing,
    TwoUnitCap,
    analysis,
)
from openmm_cylchain.cli import main
from openmm_cylchain.output.read_tables import read_reports
from openmm_cylchain.runs.configuration import parse_configuration
from openmm_cylchain.runs.initial_state import build_system
from openmm_cylchain.runs.measures import GYRATION, ORDER
from openmm_cylchain.runs.run import create_simulation, run
from openmm_cylchain.runs.steady_populations import steady_population
from openmm_cylchain.runs.summarised_run import run_with_summary
from openmm_cylchain.scans.quantities import read_quantities
from support.configurations import COMING_AND_GOING
from support.run_figures import rendered

HEAD = '[solvent]\ntemperature = "298 K"\nviscosity = "1 mPa*s"\n'
MONOMERS = '[[monomers]]\ntype = "ACTIN_ATP"\nconcentration = "0.1 uM"\n'
FILAMENT = '[[filament]]\ntype = "F_ACTIN"\nsegment_length = "108 nm"\nsegments = 5\ncount = 2\n'
GROWTH = 'growth = { longest = "1 um", vanishes = true }\n'
INSIDE = 'inside = { shape = "sphere", radius = "1 um" }\n'
NUCLEATION = '[[nucleation]]\ntable = 1\ncount = 3\nrate = "2 1/(um^3*s)"\n'
BRANCHING = '[[branching]]\ntable = 1\ncount = 4\nrate = "0.5 1/(um*s)"\n'
SEVERING = 'growth = { longest = "1 um", severing_rate = "1 1/(um*s)" }\n'
TAIL = '[simulation]\ntime_step = "1 ms"\nduration = "0.1 s"\nreport_interval = "10 ms"\nchecks = false\n'


def parse(*tables, monomers=MONOMERS, filament=FILAMENT + GROWTH):
    return parse_configuration(HEAD + monomers + filament + "".join(tables) + TAIL)


def test_places_are_those_of_python():
    """Behind all filaments that are there, which keep their numbers: parts, those that begin, and branches."""
    second = '[[filament]]\ntype = "MICROTUBULE"\nsegments = 3\n'
    configuration = parse(
        NUCLEATION + INSIDE + 'length = "162 nm"\norder = 3\ndirection = [0, 0, 2]\n',
        BRANCHING + 'mothers = [1]\nangle = "60 deg"\ndebranching_rate = "2 1/s"\ndebranching_force = "4 pN"\n',
        '[contacts]\ndiameter = "7 nm"\n',
        filament=FILAMENT + SEVERING + "reserve = 6\npropulsion = '0.1 pN'\n" + second,
    )
    built = list(build_system(configuration, None, 1).filaments)
    there = [filament.is_reserve for filament in built]
    assert there == [False] * 3 + [True] * 13
    assert {filament.growth is built[0].growth for filament in (*built[:2], *built[3:])} == {True}
    assert all(filament.propulsion == built[0].propulsion for filament in built[3:])
    assert len(built[0].positions) + built[0].spare_nodes == 2 + built[3].spare_nodes
    assert [built[3].nucleation, built[8].nucleation, built[9].nucleation] == [
        None,
        None,
        configuration.filaments[3].nucleation,
    ]
    own = built[9].nucleation
    python = Nucleation(
        rate=2 / unit.micrometer**3 / unit.second, region=own.region, length=162, order=3, direction=[0, 0, 1]
    )
    assert 1e12 * own.whole_rate(None) == pytest.approx(1e12 * python.whole_rate(None)) == pytest.approx(8 / 3 * np.pi)
    assert (own.length, own.order, *own.direction) == (162, 3, 0, 0, 1)
    branching = built[12].nucleation
    # Branches have none, but parts and filaments that begin do.
    assert isinstance(branching, Branching) and branching.mothers == (0, 1, *range(3, 12))
    assert branching.distance == 7.0 and branching.angle == pytest.approx(np.pi / 3)
    assert (1e12 * branching.debranching_rate, 1e15 * branching.rate) == pytest.approx((2.0, 0.5))
    assert branching.debranching_force == pytest.approx(4 * 0.602214076)


def test_growth_has_all_that_python_has():
    configuration = parse_configuration(COMING_AND_GOING)
    actin, rings, own = (configuration.filaments[number].growth for number in (0, 2, 5))
    assert actin.monomers == ACTIN_AGING and actin.vanishes and not own.minus_capped
    assert actin.severing == Severing(rate=2e-14, of_states=["ADP", "ADP-Pi"])
    assert rings.plus_instability == TwoUnitCap(hydrolysis_rate=2e-11, shrinking_off_rate=2e-10)
    old = MonomerState(name="old", rate=2e-11, plus_off_rate=8e-10)
    assert own.monomers.aging == (old,)


def test_growth_may_be_steady_and_feel_loads_otherwise():
    own = GROWTH.replace("}", ', deterministic = true, growing_force = "2 pN" }')
    growth = parse(filament=FILAMENT + own).filaments[0].growth
    assert growth.deterministic and growth.growing_force == pytest.approx(2 * 0.602214076)
    assert not parse().filaments[0].growth.deterministic and parse().filaments[0].growth.growing_force is None


def test_a_run_may_begin_without_filaments():
    own = '[[nucleation]]\ntype = "F_ACTIN"\nsegment_length = "54 nm"\ncount = 5\ntotal_rate = "3 1/s"\n'
    configuration = parse(own + INSIDE + GROWTH, filament="")
    (group,) = configuration.filaments
    assert 1e12 * group.nucleation.whole_rate(None) == pytest.approx(3.0) and group.type.segment_length == 54.0
    # In a periodic box, anywhere.
    box = '[box]\nedges = ["2 um", "2 um", "1 um"]\n'
    own = own.replace('total_rate = "3 1/s"', 'rate = "1 nM/s"')
    (group,) = parse(box, own + GROWTH, filament="").filaments
    assert 1e12 * group.nucleation.whole_rate(np.diag([2000.0, 2000.0, 1000.0])) == pytest.approx(4e9 * 6.02214076e-10)


@pytest.mark.parametrize("rate", ["1e-6", "20000"])
def test_summary_of_a_network_that_begins_without_filaments(rate, tmp_path):
    """In whose first frame there is nothing to measure, or in none."""
    wall = '[[wall]]\nshape = "sphere"\nradius = "3 um"\nstiffness = "0.1 pN/nm"\n'
    own = f'[[nucleation]]\ntype = "F_ACTIN"\nsegment_length = "108 nm"\ncount = 5\ntotal_rate = "{rate} 1/s"\n'
    _, _, measures, *_ = run_with_summary(parse(wall, own + INSIDE + GROWTH, filament=""), tmp_path / "out")
    found = {measure.name: measure for measure in measures}
    assert found[ORDER].first is None and found[GYRATION].first is None
    assert (found[ORDER].last is None) == (rate == "1e-6")
    assert (tmp_path / "out" / "summary.png").exists()


def test_they_begin_anywhere_in_a_periodic_box(tmp_path):
    """As many as the rate times the volume and the time, with first nodes all over the box."""
    box = '[box]\nedges = ["2 um", "2 um", "1 um"]\n'
    growth = 'growth = { longest = "1 um", shortest = "432 nm" }\n'
    own = '[[nucleation]]\ntype = "F_ACTIN"\nsegment_length = "108 nm"\ncount = 200\nrate = "400 1/(um^3*s)"\n'
    configuration = parse(box, own + growth, filament="")
    run(configuration, tmp_path / "out")
    table, trajectory = read_reports(tmp_path / "out" / "growth.csv"), analysis.load(tmp_path / "out")
    nucleated = table["filaments nucleated"][-1, 0]
    assert abs(nucleated - 160) < 4 * np.sqrt(160)
    firsts = trajectory.positions(-1)[[own.nodes[0] for own in trajectory.filaments]][table["nodes"][-1] > 0]
    shares = np.mod(firsts, [2000.0, 2000.0, 1000.0]) / [2000.0, 2000.0, 1000.0]
    assert np.all(np.abs(shares.mean(axis=0) - 0.5) < 4 * np.sqrt(1 / 12 / nucleated))


@pytest.mark.parametrize(
    ("message", "tables", "parts"),
    [
        ("does not say where filaments begin: add a [box], or inside", (NUCLEATION,), {}),
        ("lacks the key 'rate'", (NUCLEATION.replace("rate", "# rate"), INSIDE), {}),
        ("total_rate and rate say the same", (NUCLEATION, INSIDE, 'total_rate = "1 1/s"\n'), {}),
        ("rate has the unit 1/(s), which is not one of rate per volume", (NUCLEATION.replace("um^3*", ""), INSIDE), {}),
        ("table is 2, but there is no such [[filament]] table", (NUCLEATION.replace("= 1", "= 2"), INSIDE), {}),
        ("is 1, whose filaments do not grow: add", (NUCLEATION, INSIDE), {"filament": FILAMENT, "monomers": ""}),
        ("add table = 1, or a type and its growth", (NUCLEATION.replace("table", "# table"), INSIDE), {}),
        ("type is that of the table whose number is given", (NUCLEATION, INSIDE, 'type = "F_ACTIN"\n'), {}),
        ("lacks the key 'growth'", (NUCLEATION.replace("table = 1", 'type = "F_ACTIN"'), INSIDE), {}),
        (
            "whole number of monomers, as with segment_length",
            (NUCLEATION.replace("table = 1", 'type = "F_ACTIN"'), INSIDE, GROWTH),
            {},
        ),
        ("lacks the key 'count'", (NUCLEATION.replace("count", "# count"), INSIDE), {}),
        (
            "shape must be a sphere or a box",
            (NUCLEATION, INSIDE.replace("sphere", "cylinder").replace(" }", ', length = "1 um" }')),
            {},
        ),
        ("length must not exceed the longest of its growth, 1000 nm", (NUCLEATION, INSIDE, 'length = "2 um"\n'), {}),
        ("makes 4.4e+07 nodes", (NUCLEATION.replace("= 3", "= 4000000"), INSIDE), {}),
        ("names 3, but there is no such [[filament]] table", (BRANCHING, "mothers = [3]\n"), {}),
        (
            "names 2, whose filaments do not grow",
            ('[[filament]]\ntype = "MICROTUBULE"\nsegments = 3\n', BRANCHING, "mothers = [2]\n"),
            {},
        ),
        ("does not hold an angle", (BRANCHING, 'angle = "180 deg"\n'), {}),
        ("lacks the key 'rate'", (BRANCHING.replace("rate", "# rate"),), {}),
        ("has filaments that are cut, and no places for their parts", (), {"filament": FILAMENT + SEVERING}),
        ("reserve belongs to filaments that are cut", (), {"filament": FILAMENT + "reserve = 3\n", "monomers": ""}),
        (
            "severing_states belongs to severing_rate",
            (),
            {"filament": FILAMENT + 'growth = { longest = "1 um", severing_states = ["ADP"] }\n'},
        ),
        (
            "Monomers that do not age have no states",
            (),
            {"filament": FILAMENT + SEVERING.replace(" }", ', severing_states = ["ADP"] }') + "reserve = 3\n"},
        ),
        (
            "catastrophe_rate cannot be with hydrolysis_rate",
            (),
            {"filament": FILAMENT + GROWTH.replace("}", ', hydrolysis_rate = "1 1/s", catastrophe_rate = "1 1/s" }')},
        ),
        (
            "lacks the key 'shrinking_off_rate'",
            (),
            {"filament": FILAMENT + GROWTH.replace("vanishes = true", 'hydrolysis_rate = "1 1/s"')},
        ),
        ("lacks the key 'name'", (), {"monomers": MONOMERS + 'aging = [{ rate = "1 1/s" }]\n'}),
        (
            "so none of its nodes may be clamped",
            (),
            {"filament": FILAMENT + GROWTH.replace("= true", "= true, minus_capped = true") + "clamped = [0]\n"},
        ),
        (
            "which is not there at times",
            (NUCLEATION, INSIDE, '[[tether]]\nfilament = 4\nnode = 0\nstiffness = "1 pN/nm"\n'),
            {},
        ),
    ],
)
def test_what_does_not_go_together_is_refused(message, tables, parts):
    with pytest.raises(InputError) as caught:
        parse(*tables, **parts)
    assert message in str(caught.value) and str(caught.value).startswith(("line ", "[[")), caught.value


def test_mistakes_in_what_begins_have_their_line():
    text = HEAD + MONOMERS + FILAMENT + GROWTH + NUCLEATION + INSIDE + 'angle = "60 deg"\n' + TAIL
    with pytest.raises(
        InputError, match=r"line 18: .*nucleation.* has an unknown key 'angle'.* It belongs to .*branching"
    ):
        parse_configuration(text)


def _steady(growth, nucleation, concentration="0.1 uM"):
    monomers = MONOMERS.replace("0.1 uM", concentration)
    groups = parse(nucleation, INSIDE, monomers=monomers, filament=FILAMENT + growth).filaments
    return groups[0].growth, groups[-1], steady_population(groups, None, groups[0].growth.pool.concentration)


def test_numbers_in_the_long_run_are_those_of_mass_action():
    """J/k_off of the shortest, and z as many with each further monomer, z = k_on c/k_off of both ends."""
    nucleation = NUCLEATION.replace('rate = "2 1/(um^3*s)"', 'total_rate = "0.5 1/s"')
    growth, _, steady = _steady(GROWTH, nucleation)
    off, on = 1.4 + 0.8, 0.1 * (11.6 + 1.3)
    z = on / off
    assert steady.number == pytest.approx(0.5 / off / (1.0 - z), rel=1e-9)
    assert steady.length == pytest.approx((growth.fewest_monomers(growth_type()) + z / (1.0 - z)) * 2.7, rel=1e-9)
    assert _steady(GROWTH.replace("true", "true, deterministic = true"), nucleation)[2] is None
    # Above the concentration at which they treadmill, they become as long as they may, and there is no such number.
    assert _steady(GROWTH, nucleation, "0.2 uM")[2] is None
    assert _steady(GROWTH.replace("vanishes = true", "vanishes = false"), nucleation)[2] is None
    # Without monomers they are as they begin, for 1/k_off.
    assert _steady(GROWTH, nucleation, "0 uM")[2].number == pytest.approx(0.5 / off, rel=1e-9)


def growth_type():
    return parse().filaments[0].type


def test_lengths_in_the_long_run_are_those_of_dogterom_and_leibler():
    turning = 'catastrophe_rate = "3 1/s", rescue_rate = "1 1/s", shrinking_off_rate = "8000 1/s"'
    growth = f'growth = {{ longest = "20 um", vanishes = true, minus_capped = true, {turning} }}\n'
    growth, _, steady = _steady(growth, NUCLEATION, "172.4137931 uM")
    up, down = (11.6 * 172.4137931 - 1.4) * 2.7, 8000 * 2.7
    mean = up * down / (down * 3.0 - up * 1.0)
    # Beyond the shortest; that each monomer comes by itself adds their own randomness, of a per cent here.
    assert steady.length - 20 * 2.7 == pytest.approx(mean, rel=0.02)
    # A filament lives as long as it grows and shrinks, over and over.
    assert steady.number == pytest.approx(2 * 4 / 3 * np.pi * mean * (1 / up + 1 / down), rel=0.02)


def test_filaments_with_caps_live_until_both_units_have_hydrolysed():
    """1/h + (g+h)^2/(h^2 (3g+2h)) to the catastrophe, and then as long as all that has come takes to go."""
    g, h, off = 11.6 * 2.0, 0.43, 90.0
    caps = f'hydrolysis_rate = "{h} 1/s", shrinking_off_rate = "{off} 1/s"'
    monomers = MONOMERS.replace("0.1 uM", "2 uM") + 'plus_off_rate = "0 1/s"\n'
    growth = f'growth = {{ longest = "30 um", vanishes = true, minus_capped = true, {caps} }}\n'
    groups = parse(NUCLEATION, 'length = "135 nm"\n', INSIDE, monomers=monomers, filament=FILAMENT + growth).filaments
    steady = steady_population(groups, None, groups[0].growth.pool.concentration)
    cap = 1 / h + (g + h) ** 2 / (h**2 * (3 * g + 2 * h))
    more = 50 - groups[0].growth.fewest_monomers(groups[0].type)
    lifetime = cap + (g * cap + more + 1) / off
    assert steady.number == pytest.approx(2 * 4 / 3 * np.pi * lifetime, rel=1e-3)


@pytest.fixture(scope="module")
def directory(tmp_path_factory):
    path = tmp_path_factory.mktemp("coming")
    (path / "coming.toml").write_text(COMING_AND_GOING)
    with rendered():
        assert main(["run", str(path / "coming.toml"), "--output", str(path / "out")]) == 0
    return path / "out"


def test_tables_say_what_comes_and_goes(directory):
    simulation, built = create_simulation(parse_configuration(COMING_AND_GOING))
    simulation.context.loadCheckpoint((directory / "checkpoint.chk").read_bytes().partition(b"\n")[2])
    growth = built.filaments.in_context(simulation.context).growth()
    table = read_reports(directory / "growth.csv")
    last = {name: values[-1] for name, values in table.items()}
    for name, expected in (
        ("nodes", growth.nodes),
        ("identity", growth.identities),
        ("parent", growth.parents),
        ("filaments nucleated", growth.nucleated),
        ("filaments vanished", growth.vanished),
        ("filaments severed", growth.severed),
        ("without place", growth.without_place),
    ):
        np.testing.assert_array_equal(last[name], expected, name)
    # All that have ever been there are there, or have vanished: parts that a cut leaves too short among these.
    there = table["nodes"] > 0
    begun = 8 + table["filaments nucleated"] + table["filaments severed"] - table["filaments vanished"]
    np.testing.assert_array_equal(there.sum(axis=1), begun[:, 0])
    assert growth.nucleated > 5 and growth.severed >= 3 and growth.vanished > 0
    assert np.all(table["length (nm)"][~there] == 0.0) and not there[0, 8:].any()
    for end in ("minus", "plus"):
        assert np.all((table[f"{end} end state"] == "") == ~there)
    assert {"new", "ADP"} <= set(table["plus end state"][:, :6][there[:, :6]]) <= {"new", "ADP-Pi", "ADP"}
    # Curves of those that are not there have no points.
    run = analysis.load(directory)
    curves = analysis.filament_curves(run.mdtraj())
    assert np.array_equal(np.array([np.isfinite(own).all(axis=(1, 2)) for own in curves]).T, there)
    energies = np.loadtxt(directory / "energies.csv", delimiter=",", skiprows=1)
    assert np.all(np.isfinite(energies))


def test_summary_says_what_comes_and_goes(directory, capsys):
    table = read_reports(directory / "growth.csv")
    own = json.loads((directory / "summary.json").read_text())["population"]
    assert (
        own["nucleated"] == table["filaments nucleated"][-1, 0] and own["severed"] == table["filaments severed"][-1, 0]
    )
    actin, tubes, mine = own["kinds"]
    # Six of the first table, twenty places for their parts and ten for branches.
    columns = [*range(6), *range(8, 28), *range(58, 68)]
    late = slice(len(table["step"]) // 2, None)
    lengths, there = (table[name][late][:, columns] for name in ("length (nm)", "nodes"))
    assert actin["number"] == pytest.approx((there > 0).sum() / len(there))
    assert actin["length"] == pytest.approx(lengths.sum() / (there > 0).sum()) and actin["length_error"] > 0.0
    assert actin["number_of_free_ones"] is None and mine["number_of_free_ones"] is None
    gathered = {(one.of, one.name): one for one in read_quantities(directory / "summary.json")}
    found = gathered["all MT of [[filament]] number 2", "filaments at once"]
    assert (found.value, found.theory) == (tubes["number"], tubes["number_of_free_ones"])
    # Fifty begin in a second, and live as the master equation has them.
    assert tubes["number_of_free_ones"] == pytest.approx(15.2, rel=0.01)
    rates = {one["name"]: one["rate"] for one in json.loads((directory / "summary.json").read_text())["growth"]}
    # Of what has never been there, there is none.
    assert rates["3 × ACT, 6 segments"] == pytest.approx(579, abs=4 * 60)
    assert (directory / "summary.png").stat().st_size > 10_000
    capsys.readouterr()
    assert main(["run", str(directory.parent / "coming.toml"), "--dry-run"]) == 0
    said = capsys.readouterr().out
    assert "8 filaments, 49 segments" in said and "60 places for filaments that come" in said
    assert "50 begin per second\n" in said and "20 begin per second on each um of mothers" in said
    assert re.search(r"all MT of \[\[filament\]\] number 2: 15.2 at once in the long run, 283.9 nm long", said), said


def test_runs_say_that_there_was_no_place(directory, tmp_path, capsys):
    text = COMING_AND_GOING.replace("count = 20\nrate", "count = 1\nrate").replace("100 ms", "60 ms")
    (tmp_path / "few.toml").write_text(text)
    assert main(["run", str(tmp_path / "few.toml"), "--output", str(tmp_path / "few")]) == 0
    said = capsys.readouterr().out
    assert re.search(r"In all of it, \d+ began, \d+ vanished, \d+ were cut\.", said)
    assert re.search(r"At the end, \d+ of them hold on to mothers as branches", said)
    assert re.search(r"\d+ more would have begun or been cut, but there was no place .* larger count, or reserve", said)
