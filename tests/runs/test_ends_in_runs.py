"""What ends do in runs from files: states of one's own, ends that turn, hands at ends, tethers of capped ends."""

import json

import numpy as np
import pytest

from openmm_cylchain import (
    ACTIN_ATP,
    KINESIN_13,
    MDIA1_ENDS,
    DynamicInstability,
    HandAtEnd,
    InputError,
    TwoUnitCap,
    analysis,
)
from openmm_cylchain.cli import main
from openmm_cylchain.output.read_tables import read_reports
from openmm_cylchain.runs.configuration import changed_keys, parse_configuration
from openmm_cylchain.runs.run import begin, create_simulation
from support.configurations import ENDS

HEAD = '[solvent]\ntemperature = "298 K"\nviscosity = "1 mPa*s"\n'
MONOMERS = '[[monomers]]\ntype = "ACTIN_ATP"\nconcentration = "5 uM"\n'
AGING = MONOMERS.replace("ACTIN_ATP", "ACTIN_AGING")
FILAMENT = '[[filament]]\ntype = "F_ACTIN"\nsegment_length = "108 nm"\nsegments = 5\ncount = 2\n'
TAIL = '[simulation]\ntime_step = "1 ms"\nduration = "0.1 s"\nreport_interval = "10 ms"\n'
FORMIN = 'plus_states = [{ name = "free" }, { name = "with formin", on_rate = "3 1/(uM*s)" }]'
HANDS = """[[linkers]]
stiffness = "0.1 pN/nm"
rest_length = "10 nm"
concentration = "1 uM"
[linkers.hand]
binding_rate = "1 1/s"
reach = "10 nm"
unbinding_rate = "1 1/s"
"""
TURNING = 'catastrophe_rate = "1 1/s", rescue_rate = "1 1/s", shrinking_off_rate = "1 1/s"'


def growth_of(keys):
    return f'growth = {{ longest = "1 um", {keys} }}\n'


def parse(keys, *tables, monomers=MONOMERS, filament=FILAMENT):
    return parse_configuration(HEAD + monomers + filament + growth_of(keys) + "".join(tables) + TAIL)


def per_second(rates):
    return np.array(rates) * 1e12


def rates_of(turning):
    return per_second([turning.catastrophe_rate, turning.rescue_rate, turning.shrinking_off_rate])


def test_what_is_read_is_that_of_python():
    configuration = parse_configuration(ENDS)
    growth = configuration.filaments[0].growth
    own = growth.states("plus")
    assert own.names == ("free", "with formin", "in pause") and growth.keeps_first_node
    np.testing.assert_allclose(np.array(own.on_rates) / ACTIN_ATP.plus_on_rate, [1.0, 3 / 11.6, 0.0])
    np.testing.assert_allclose(per_second(own.off_rates), [1.4, 0.4, 0.0])
    np.testing.assert_allclose(per_second(own.switch_rates), [[0, 0, 60], [0, 0, 0], [30, 0, 0]])
    assert own.after_gain == own.after_loss == (0, 1, 2)
    second = configuration.filaments[1].growth
    assert second.plus_instability is None and isinstance(second.minus_instability, DynamicInstability)
    assert rates_of(second.minus_instability) == pytest.approx([10.0, 20.0, 50.0])
    assert second.minus_instability.shrinking_on_rate == pytest.approx(ACTIN_ATP.plus_on_rate / 116, rel=1e-9, abs=0.0)
    third = configuration.filaments[2].growth.states("minus")
    assert third.after_gain == third.after_loss == (1, 0) and per_second(third.off_rates) == pytest.approx([10.0, 10.0])
    hand, other = configuration.linkers[0].kind.hands
    assert other.filament_end is None and hand.filament_end == HandAtEnd(
        end="plus", range=20.0, binds_there=True, tracks=True, changes=("free", "with formin")
    )
    keys = 'minus_hydrolysis_rate = "0.4 1/s", minus_shrinking_off_rate = "56 1/s", shrinking_on_rate = "1 1/(uM*s)", '
    both = parse(keys + TURNING).filaments[0].growth
    assert rates_of(both.plus_instability) == pytest.approx([1.0, 1.0, 1.0])
    assert both.plus_instability.shrinking_on_rate == pytest.approx(ACTIN_ATP.plus_on_rate / 11.6, rel=1e-9, abs=0.0)
    cap = both.minus_instability
    assert isinstance(cap, TwoUnitCap) and cap.rescue_rate == 0.0
    assert per_second([cap.hydrolysis_rate, cap.shrinking_off_rate]) == pytest.approx([0.4, 56.0])


def test_ends_that_begin_anew_at_the_shortest_length_are_read():
    minus = f"minus_{TURNING}".replace(", ", ", minus_")
    growth = parse(f'{TURNING}, renucleation_rate = "3 1/s", {minus}').filaments[0].growth
    assert growth.plus_instability.renucleation_rate * 1e12 == pytest.approx(3.0)
    assert growth.minus_instability.renucleation_rate is None
    cap = parse('hydrolysis_rate = "0.4 1/s", shrinking_off_rate = "56 1/s", renucleation_rate = "3 1/s"')
    assert np.array(cap.filaments[0].growth.states("plus").shortest_switch_rates)[3, 0] * 1e12 == pytest.approx(3.0)
    own = parse(
        'plus_states = [{ name = "a", switch_rates = { b = "2 1/s" } }, '
        '{ name = "b", shortest_switch_rates = { a = "4 1/s" } }]'
    )
    found = np.array(own.filaments[0].growth.states("plus").shortest_switch_rates)
    assert found.ravel() * 1e12 == pytest.approx([0.0, 0.0, 4.0, 0.0])
    with pytest.raises(InputError, match=r"line \d+: .*renucleation_rate must not be below rescue_rate"):
        parse(f'{TURNING}, renucleation_rate = "0.5 1/s"')


def test_catastrophes_of_blocked_ends_and_of_long_filaments_are_read():
    more = ', blocked_catastrophe_rate = "4 1/s", catastrophe_length = "2 um"'
    minus = "".join(f", minus_{one}" for one in (TURNING + more).split(", "))
    growth = parse((TURNING + more).replace("2 um", "3 um") + minus).filaments[0].growth
    for turning, length in ((growth.plus_instability, 3000.0), (growth.minus_instability, 2000.0)):
        assert rates_of(turning) == pytest.approx([1.0, 1.0, 1.0])
        assert turning.blocked_catastrophe_rate * 1e12 == pytest.approx(4.0)
        assert turning.catastrophe_length == length
    plain = parse(TURNING).filaments[0].growth.plus_instability
    assert plain.blocked_catastrophe_rate is None and plain.catastrophe_length is None
    own = parse(
        'plus_states = [{ name = "a", switch_rates = { b = "2 1/s" }, blocked_switch_rates = { b = "3 1/s" } }, '
        '{ name = "b", switch_rates = { a = "1 1/s" }, switch_length = "2 um" }]'
    )
    found = own.filaments[0].growth.states("plus")
    np.testing.assert_allclose(per_second(found.switch_rates), [[0, 2], [1, 0]])
    np.testing.assert_allclose(per_second(found.blocked_switch_rates), [[0, 3], [0, 0]])
    assert found.switch_lengths == (0.0, 2000.0)


def test_hands_that_cut_are_read():
    cut = (f"{CAPPED}, plus_capped = true", "reserve = 4\n", HANDS, 'severing_rate = "0.2 1/s"\n')
    with pytest.raises(InputError, match="two capped ends does not grow"):
        parse(*cut)
    configuration = parse(f'{cut[0]}, severing_rate = "0 1/(um*s)"', *cut[1:])
    hand, other = configuration.linkers[0].kind.hands
    assert hand == other and hand.severing_rate * 1e12 == pytest.approx(0.2)
    assert configuration.filaments[0].growth.severing.rate == 0.0


def test_a_preset_has_the_critical_concentration_of_free_ends():
    """With mDia1, an end grows nine tenths as fast, and stands still where a free one does."""
    own = parse('plus_states = "MDIA1_ENDS"').filaments[0].growth.states("plus")
    assert own is MDIA1_ENDS and own.on_rates[0] == ACTIN_ATP.plus_on_rate
    assert own.on_rates[1] == pytest.approx(0.9 * own.on_rates[0], rel=1e-12, abs=0.0)
    ratios = np.array(own.off_rates) / own.on_rates
    np.testing.assert_allclose(ratios, ACTIN_ATP.plus_off_rate / ACTIN_ATP.plus_on_rate)


def test_changes_are_named():
    first, second = parse(FORMIN), parse(FORMIN.replace('"3 ', '"2 '))
    assert changed_keys(first, first) == [] and changed_keys(first, second) == ["[[filament]] number 1: growth"]


def states(text):
    return f'plus_states = [{{ name = "a", {text} }}, {{ name = "b" }}]'


AT_END = 'filament_end = {{ end = "plus", range = "20 nm", {} }}\n'
TETHER = '[[tether]]\nfilament = 0\nnode = 0\nstiffness = "1 pN/nm"\n'
CAPPED = "minus_capped = true"


@pytest.mark.parametrize(
    ("message", "keys", "tables", "parts"),
    [
        ("growth plus_states must be a list of tables", "plus_states = []", (), {}),
        ("plus_states must be one of MDIA1_ENDS, but is 'mDia1'", "plus_states = 'mDia1'", (), {}),
        ("plus_states[0] lacks the key 'name'", 'plus_states = [{ off_rate = "1 1/s" }]', (), {}),
        (
            "plus_states[0] has an unknown key 'onrate'. Did you mean 'on_rate'?",
            'plus_states = [{ name = "a", onrate = 1 }]',
            (),
            {},
        ),
        ("name is 'a', and so is another one", 'plus_states = [{ name = "a" }, { name = "a" }]', (), {}),
        ("without commas and quotes, but is 'a, b'", 'plus_states = [{ name = "a, b" }]', (), {}),
        ("on_rate has the unit", states('on_rate = "1 1/s"'), (), {}),
        ("switch_rates must be a table of rates by names of states", states('switch_rates = "1 1/s"'), (), {}),
        ("plus_states[0] switch_rates 'b' must be", states("switch_rates = { b = 3 }"), (), {}),
        ("switch_rates is 'bb', but the states are a, b. Did you", states('switch_rates = { bb = "3 1/s" }'), (), {}),
        ("has 'a', which is the state itself", states('switch_rates = { a = "3 1/s" }'), (), {}),
        ("after_gain is 'c', but the states are a, b", states('after_gain = "c"'), (), {}),
        ("after_loss is 'c', but the states are a, b", states('after_loss = "c"'), (), {}),
        ("catastrophe_rate cannot be with plus_states", f"{FORMIN}, {TURNING}", (), {}),
        ("plus_states cannot be with plus_capped = true", f"{FORMIN}, plus_capped = true", (), {}),
        (
            "minus_rescue_rate cannot be with minus_capped",
            'minus_rescue_rate = "1 1/s", minus_capped = true',
            (),
            {},
        ),
        ("plus_states cannot be with monomers that age", FORMIN, (), {"monomers": AGING}),
        (
            "shrinking_on_rate cannot be with hydrolysis_rate",
            'hydrolysis_rate = "1 1/s", shrinking_off_rate = "1 1/s", shrinking_on_rate = "1 1/(uM*s)"',
            (),
            {},
        ),
        (
            "minus_catastrophe_rate cannot be with minus_hydrolysis_rate",
            'minus_hydrolysis_rate = "1 1/s", minus_catastrophe_rate = "1 1/s"',
            (),
            {},
        ),
        (
            "blocked_catastrophe_rate must not be below catastrophe_rate",
            f'{TURNING}, blocked_catastrophe_rate = "0.5 1/s"',
            (),
            {},
        ),
        ("but only 58 monomers/s come to it", f'{TURNING}, blocked_catastrophe_rate = "100 1/s"', (), {}),
        ("lacks the key 'catastrophe_rate': an end", 'catastrophe_length = "1 um"', (), {}),
        ("catastrophe_length must be positive", f'{TURNING}, catastrophe_length = "0 um"', (), {}),
        ("catastrophe_length has the unit", f'{TURNING}, catastrophe_length = "1 1/s"', (), {}),
        (
            "blocked_catastrophe_rate cannot be with hydrolysis_rate",
            'hydrolysis_rate = "1 1/s", shrinking_off_rate = "1 1/s", blocked_catastrophe_rate = "1 1/s"',
            (),
            {},
        ),
        (
            "minus_catastrophe_length cannot be with minus_hydrolysis_rate",
            'minus_hydrolysis_rate = "1 1/s", minus_shrinking_off_rate = "1 1/s", minus_catastrophe_length = "1 um"',
            (),
            {},
        ),
        ("blocked_switch_rates is 'c', but", states('blocked_switch_rates = { c = "3 1/s" }'), (), {}),
        ("blocked_switch_rates has 'a', which", states('blocked_switch_rates = { a = "3 1/s" }'), (), {}),
        ("only 58 monomers/s come", states('blocked_switch_rates = { b = "60 1/s" }'), (), {}),
        ("switch_length must be positive", states('switch_length = "-1 um"'), (), {}),
        (
            "no places for their parts: add to their table",
            CAPPED,
            (HANDS, 'severing_rate = "1 1/s"\n'),
            {},
        ),
        (
            "cuts filaments, but binds to none that grow",
            CAPPED,
            (
                '[[filament]]\ntype = "MICROTUBULE"\nsegments = 3\n',
                HANDS,
                'binds_to = "MICROTUBULE"\nsevering_rate = "1 1/s"\n',
            ),
            {},
        ),
        ("severing_rate must be zero or positive", CAPPED, (HANDS, 'severing_rate = "-1 1/s"\n'), {}),
        ("lacks the key 'minus_shrinking_off_rate'", 'minus_hydrolysis_rate = "1 1/s"', (), {}),
        ("lacks the key 'minus_catastrophe_rate': an end", 'minus_rescue_rate = "1 1/s"', (), {}),
        ("hand filament_end lacks the key 'range'", FORMIN, (HANDS, 'filament_end = { end = "plus" }\n'), {}),
        ("changes must be a list of two names", FORMIN, (HANDS, AT_END.format('changes = ["free"]')), {}),
        ("two different states", FORMIN, (HANDS, AT_END.format('changes = ["free", "free"]')), {}),
        (
            "to 'slow', but the states are free, with formin",
            FORMIN,
            (HANDS, AT_END.format('changes = ["free", "slow"]')),
            {},
        ),
        (
            "binds to no filaments that grow",
            FORMIN,
            (
                '[[filament]]\ntype = "MICROTUBULE"\nsegments = 3\n',
                HANDS,
                'binds_to = "MICROTUBULE"\n',
                AT_END.format("tracks = true"),
            ),
            {},
        ),
        ("tethers hold the first node alone", FORMIN, (TETHER,), {}),
        ("tethers hold the first node alone", CAPPED, (TETHER.replace("node = 0", "node = -1"),), {}),
        ("which is not there at times", f"{CAPPED}, vanishes = true", (TETHER,), {}),
        (
            "which is not there at times",
            f'{CAPPED}, severing_rate = "1 1/(um*s)"',
            ("reserve = 3\n", TETHER.replace("filament = 0", "filament = 4")),
            {},
        ),
    ],
)
def test_what_does_not_go_together_is_refused(message, keys, tables, parts):
    with pytest.raises(InputError) as caught:
        parse(keys, *tables, **parts)
    assert message in str(caught.value) and str(caught.value).startswith("line "), caught.value


def test_tethers_of_a_table_leave_out_places_for_parts():
    configuration = parse(
        f'{CAPPED}, severing_rate = "1 1/(um*s)"', "reserve = 3\n", TETHER.replace("filament = 0", "table = 1")
    )
    assert configuration.tethers[0].filaments == (0, 1)


@pytest.fixture(scope="module")
def directory(tmp_path_factory):
    path = tmp_path_factory.mktemp("ends")
    (path / "ends.toml").write_text(ENDS)
    assert main(["run", str(path / "ends.toml"), "--output", str(path / "out")]) == 0
    return path / "out"


def test_tables_name_states(directory):
    configuration = parse_configuration(ENDS)
    simulation, built = create_simulation(configuration)
    begin(configuration, simulation, built)
    simulation.context.loadCheckpoint((directory / "checkpoint.chk").read_bytes().partition(b"\n")[2])
    growth = built.filaments.in_context(simulation.context).growth()
    table = read_reports(directory / "growth.csv")
    for end, which in enumerate(("minus", "plus")):
        np.testing.assert_array_equal(table[f"{which} end state"][-1], growth.state_names[:, end])
    plus, minus = table["plus end state"], table["minus end state"]
    assert set(plus[:, :6].ravel()) == {"free", "with formin", "in pause"} and set(minus[:, :6].ravel()) == {"capped"}
    assert set(plus[:, 6:10].ravel()) == {"growing"} and set(plus[:, 10]) == {"capped"}
    assert set(minus[:, 6:10].ravel()) == {"growing", "shrinking"} and set(minus[:, 10]) == {"odd", "even"}
    np.testing.assert_array_equal(table["minus end shrinking"] == 1, minus == "shrinking")
    # Every monomer turns odd to even.
    events = table["minus end gained (monomers)"] + table["minus end lost (monomers)"]
    np.testing.assert_array_equal(events[:, 10] % 2 == 1, minus[:, 10] == "even")
    np.testing.assert_array_equal(analysis.load(directory).growth["plus end state"], plus)


def test_summary_names_states(directory, capsys):
    content = json.loads((directory / "summary.json").read_text())["growth"]
    found = {own["name"] + own["end"]: {one["name"]: one for one in own["states"]} for own in content}
    first, second = found["6 × ACT, 4 segmentsplus"], found["4 × MT, 3 segmentsminus"]
    assert list(first) == ["free", "with formin", "in pause"] and first["with formin"]["share"] > 0.2
    assert sum(own["share"] for own in first.values()) == pytest.approx(1.0)
    assert second["shrinking"]["share_of_free_ends"] == pytest.approx(1 / 3)
    assert found["4 × MT, 3 segmentsplus"] == {}
    assert main(["run", str(directory / "configuration.toml"), "--output", str(directory), "--resume"]) == 0
    said = capsys.readouterr().out
    assert "6 × ACT, 4 segments, plus ends: with formin" in said and "1 × MT, 3 segments, minus end: even" in said


def test_tethers_hold_first_nodes(directory):
    """Their mean square distance from where they began: 3 k_BT/k."""
    trajectory = analysis.load(directory)
    nodes = [own.nodes[0] for own in trajectory.filaments[:6]]
    first = trajectory.positions(0)[nodes]
    squares = [np.sum((trajectory.positions(frame)[nodes] - first) ** 2, axis=1) for frame in range(5, 21)]
    expected = 3 * 1.380649e-2 * 298 / 0.5
    # Sixteen frames of six filaments: rather a look than a measurement, which tests of Python have.
    assert 0.5 * expected < np.mean(squares) < 2.0 * expected


CYCLE = (
    HEAD.replace("1 mPa", "1000 mPa")
    + MONOMERS.replace("5 uM", "10 uM")
    + '[[monomers]]\nname = "rings"\nlength = "8 nm"\nminus_on_rate = "1 1/(uM*s)"\nconcentration = "10 uM"\n'
    + FILAMENT.replace("segments = 5\ncount = 2", "segments = 3\ncount = 200")
    + """[filament.growth]
monomers = "ACTIN_ATP"
longest = "1.2 um"
minus_capped = true
plus_states = [
    { name = "open", on_rate = "20 1/(uM*s)", off_rate = "0 1/s", after_gain = "shut" },
    { name = "shut", on_rate = "0 1/(uM*s)", off_rate = "0 1/s", switch_rates = { loose = "50 1/s" } },
    { name = "loose", on_rate = "0 1/(uM*s)", off_rate = "100 1/s", switch_rates.open = "300 1/s", after_loss = "open" }
]
[[filament]]
type = "MICROTUBULE"
segment_length = "160 nm"
segments = 3
count = 200
[filament.growth]
monomers = "rings"
longest = "1.2 um"
minus_catastrophe_rate = "20 1/s"
minus_rescue_rate = "60 1/s"
minus_shrinking_off_rate = "20 1/s"
[simulation]
time_step = "10 ms"
duration = "1.2 s"
report_interval = "40 ms"
seed = 5
platform = "CPU"
threads = 1
checks = false
"""
)


MICROTUBULES = """[[filament]]
type = "MICROTUBULE"
segment_length = "800 nm"
segments = 3
count = 3
growth = { longest = "3 um", monomers = "TUBULIN" }
"""
DEPOLYMERASE = """[[linkers]]
type = "KINESIN_13"
concentration = "1 uM"
"""


def test_kinesin_13_in_a_run(tmp_path):
    monomers = MONOMERS.replace("ACTIN_ATP", "TUBULIN").replace("5 uM", "0 uM")
    text = HEAD + monomers + MICROTUBULES + DEPOLYMERASE + TAIL
    assert parse_configuration(text).linkers[0].kind == KINESIN_13
    at_end = 'filament_end = { end = "both", range = "8 nm", tracks = true, off_rate = "2 1/s", sites = 3, '
    changed = f'[[linkers.hands]]\n[[linkers.hands]]\n{at_end}unbinding_rate = "0.1 1/s" }}\n'
    still, sliding = parse_configuration(text.replace(DEPOLYMERASE, DEPOLYMERASE + changed)).linkers[0].kind.hands
    assert still == KINESIN_13.hands[0] and sliding.sliding_friction == KINESIN_13.hands[1].sliding_friction
    own = sliding.filament_end
    assert per_second([own.off_rate, own.unbinding_rate]) == pytest.approx([2.0, 0.1]) and own.sites == 3
    (tmp_path / "run.toml").write_text(text)
    assert main(["run", str(tmp_path / "run.toml"), "--output", str(tmp_path / "out")]) == 0
    lost = analysis.load(tmp_path / "out").growth["minus end lost (monomers)"][-1]
    # 23 per s leave by themselves; 54 come to an end per second then.
    assert 0 < lost.sum() < 40


def test_shares_of_time_in_states(tmp_path):
    """A cycle is 5 ms open, 20 ms shut and 2.5 ms loose, and gains 3/4 of a monomer; minus ends shrink 20/80."""
    (tmp_path / "cycle.toml").write_text(CYCLE)
    assert main(["run", str(tmp_path / "cycle.toml"), "--output", str(tmp_path / "out")]) == 0
    table = read_reports(tmp_path / "out" / "growth.csv")
    late = slice(5, None)
    for column, members, expected in (
        ("plus end state", slice(0, 200), {"open": 5 / 27.5, "shut": 20 / 27.5, "loose": 2.5 / 27.5}),
        ("minus end state", slice(200, None), {"growing": 0.75, "shrinking": 0.25}),
    ):
        names = table[column][late, members]
        for name, share in expected.items():
            found = np.mean(names == name, axis=0)
            error = found.std(ddof=1) / np.sqrt(len(found))
            assert abs(found.mean() - share) < 4 * error, (name, found.mean(), share, error)
            assert share < 0.5 or 4 * error < 0.05 * share, (name, error)
    gained = table["plus end gained (monomers)"] - table["plus end lost (monomers)"]
    rates = (gained[-1] - gained[5])[:200] / (1.0 / 0.0275)
    error = rates.std(ddof=1) / np.sqrt(200)
    assert 4 * error < 0.05 * 0.75 and abs(rates.mean() - 0.75) < 4 * error
    content = json.loads((tmp_path / "out" / "summary.json").read_text())["growth"]
    free = {one["name"]: one["share_of_free_ends"] for own in content for one in own["states"]}
    expected = {"open": 5 / 27.5, "shut": 20 / 27.5, "loose": 2.5 / 27.5, "growing": 0.75, "shrinking": 0.25}
    assert free == pytest.approx(expected)
    assert content[0]["rate_of_free_ends"] == pytest.approx(0.75 / 0.0275)


def test_shares_that_depend_on_lengths_are_left_out(tmp_path):
    text = HEAD + MONOMERS + FILAMENT + growth_of(TURNING + ', catastrophe_length = "1 um"') + TAIL
    (tmp_path / "long.toml").write_text(text)
    assert main(["run", str(tmp_path / "long.toml"), "--output", str(tmp_path / "out")]) == 0
    (plus,) = (
        own for own in json.loads((tmp_path / "out" / "summary.json").read_text())["growth"] if own["end"] == "plus"
    )
    assert plus["rate_of_free_ends"] is None
    assert [own["share_of_free_ends"] for own in plus["states"]] == [None, None]


def test_tethers_of_filaments_that_grow_can_move(tmp_path):
    """By 20 nm, of which drag leaves out 0.001 nm: the node follows within four thermal widths of 2.03 nm."""
    moving = TETHER + 'velocity = ["0.2 um/s", "0 um/s", "0 um/s"]\n'
    (tmp_path / "moving.toml").write_text(HEAD + MONOMERS + FILAMENT + growth_of(CAPPED) + moving + TAIL)
    assert main(["run", str(tmp_path / "moving.toml"), "--output", str(tmp_path / "out")]) == 0
    table = read_reports(tmp_path / "out" / "pulling.csv")
    moved = table["point x (nm)"][:, 0] - table["point x (nm)"][0, 0]
    # Up to a step before each report.
    np.testing.assert_allclose(moved, 0.2 * table["time (ms)"][:, 0], atol=0.5)
    assert np.all(np.abs(table["force along the velocity (pN)"][1:, 0]) < 4 * 2.03) and moved[-1] > 19.0
    assert np.any(np.diff(read_reports(tmp_path / "out" / "growth.csv")["length (nm)"][:, 0]))
