"""Linkers in configurations and runs: what is read and refused, files of a run, resuming after a kill, the summary."""

import dataclasses
import json
import re

import numpy as np
import pytest
from openmm import unit
from PIL import Image

from openmm_cylchain import ALPHA_ACTININ, F_ACTIN, KINESIN_1, MICROTUBULE, MYOSIN_II, InputError
from openmm_cylchain.cli import main
from openmm_cylchain.output.linker_records import LINKER_RECORD
from openmm_cylchain.output.read_tables import read_reports
from openmm_cylchain.runs.configuration import changed_keys, parse_configuration, read_configuration
from support import small_runs
from support.checkpoints import resealed
from support.configurations import placed_filaments
from support.repository import EXAMPLES
from support.run_figures import rendered

MOTOR = 'hand = { binding_rate = "1e5 1/s", reach = "60 nm", unbinding_rate = "2000 1/s", speed = "-0.5 um/s", '
MOTOR += 'stall_force = "4 pN" }'
# Longer than that of others, with motors that stall and more checkpoints.
NETWORK = small_runs.NETWORK.replace(small_runs.MOTOR, MOTOR).replace(
    'duration = "1 ms"\nreport_interval = "0.1 ms"',
    'duration = "4 ms"\nreport_interval = "0.1 ms"\ncheckpoint_interval = "0.3 ms"',
)
FRAMES = 41
PN = 0.602214076


@pytest.fixture(scope="module")
def unbroken(tmp_path_factory):
    """The directory of a run of NETWORK that nothing disturbed."""
    folder = tmp_path_factory.mktemp("unbroken")
    (folder / "input.toml").write_text(NETWORK)
    assert main(["run", str(folder / "input.toml"), "--output", str(folder / "out")]) == 0
    return folder / "out"


def test_presets_and_descriptions_are_read():
    configuration = parse_configuration(NETWORK)
    assert configuration.box == (400.0, 400.0, 500.0)
    first, second = configuration.linkers
    assert first.kind == ALPHA_ACTININ
    assert (first.count, first.concentration, first.volume, first.anchors, first.bound) == (60, None, None, None, 30)
    hand = second.kind.hands[0]
    assert second.kind.hands[1] == hand
    assert (second.kind.name, second.kind.rest_length, second.kind.same_filament) == ("motor", 30.0, False)
    assert second.kind.stiffness == pytest.approx(0.1 * PN)
    assert (hand.reach, hand.binds_to, hand.holds_at_ends) == (60.0, None, False)
    assert hand.binding_rate == pytest.approx(1e-7) and hand.speed == pytest.approx(-5e-10)
    assert hand.stall_force == pytest.approx(4 * PN)
    assert configuration.filaments[0].linked
    assert changed_keys(configuration, parse_configuration(NETWORK)) == []


def test_rules_for_hands_are_read():
    near = 'binding_range = { end = "both", range = "20 nm", excluded = true }'
    text = NETWORK.replace(MOTOR, 'hands = [{ X, sliding_friction = "2 pN*s/um" }, { X, near }]')
    text = text.replace("near", near).replace("X", 'binding_rate = "1 1/s", reach = "60 nm", unbinding_rate = "2 1/s"')
    text = text.replace(
        "hands = [{", "cosine_range = [-1, -0.5]\ntrans_activated = true\nreversible = false\nhands = [{"
    )
    kind = parse_configuration(text).linkers[1].kind
    assert (kind.cosine_range, kind.trans_activated, kind.reversible) == ((-1.0, -0.5), True, False)
    assert kind.hands[0].sliding_friction == pytest.approx(2e9 * PN) and kind.hands[0].holds_at_ends
    own = kind.hands[1].binding_range
    assert (own.end, own.range, own.excluded) == ("both", 20.0, True)
    for changed, message in (("[-1, -0.5]", "cosine_range"), ('"both"', "plus"), ('"20 nm"', "range")):
        with pytest.raises(InputError, match=message):
            parse_configuration(text.replace(changed, "[1, 0]" if changed[0] == "[" else '"left"'))


def test_every_entry_is_read():
    text = NETWORK.replace('name = "motor"', 'name = "motor"\nsame_filament = true\nvolume = "2 um^3"').replace(
        MOTOR,
        'hands = [{ binding_rate = "1 Hz", reach = "60 nm", unbinding_rate = "0 1/s", strain_share = 0.5, '
        'speed = "1 um/s", walks_backward = true, at_end = "hold", site_spacing = "8 nm", binds_to = "F_ACTIN" }, '
        '{ binding_rate = "1 1/s", reach = "50 nm", unbinding_rate = "0.1 1/s", unbinding_force = "5 pN", '
        'catch_rate = "3 1/s", catch_force = "2 pN", binds_to = ["ACT"] }]',
    )
    second = parse_configuration(text).linkers[1]
    one, other = second.kind.hands
    assert second.kind.same_filament and second.volume == pytest.approx(2e9)
    assert (one.strain_share, one.walks_backward, one.at_end, one.site_spacing) == (0.5, True, "hold", 8.0)
    assert one.binds_to == other.binds_to == ("ACT",)
    assert one.unbinding_rate == 0.0
    assert other.catch_rate == pytest.approx(3e-12) and other.catch_force == pytest.approx(2 * PN)
    assert other.unbinding_force == pytest.approx(5 * PN)


def test_values_of_a_preset_are_changed():
    text = NETWORK.replace(
        '"ALPHA_ACTININ"', '"MYOSIN_II"\nrest_length = "100 nm"\nhand = { reach = "150 nm", speed = "1 um/s" }'
    )
    kind = parse_configuration(text).linkers[0].kind
    assert kind.hands[0] == dataclasses.replace(MYOSIN_II.hands[0], reach=150.0, speed=1e-9)
    assert (kind.rest_length, kind.stiffness) == (100.0, MYOSIN_II.stiffness)


@pytest.mark.parametrize(
    ("entry", "expected"), [("0.5 uM", 0.5e-6 * 6.02214076e23 / 1e24), ("100 1/um^3", 1e-7), ("0 nM", 0.0)]
)
def test_concentrations(entry, expected):
    text = NETWORK.replace("count = 40\nbound = 40", f'concentration = "{entry}"')
    group = parse_configuration(text).linkers[1]
    assert group.count is None and group.concentration == pytest.approx(expected)
    assert placed_filaments(parse_configuration(text)).linkers[1].concentration == pytest.approx(expected)


@pytest.mark.parametrize(
    ("anchors", "expected"),
    [('[["0 nm", "1 um", "-3 nm"], ["0 nm", "0 nm", "5 nm"]]', [(0, 1000, -3), (0, 0, 5)]), ("[0, 59]", [0, 59])],
)
def test_anchors(anchors, expected):
    text = NETWORK.replace("count = 40\nbound = 40", f"anchors = {anchors}\nbound = 1")
    linkers = placed_filaments(parse_configuration(text)).linkers[1]
    np.testing.assert_array_equal(linkers.anchors, expected)
    assert (linkers.count, linkers.bound) == (2, 1)


def test_anchors_on_walls():
    """At random on what the box holds of the wall: those of random_points_on."""
    wall = '\n[[wall]]\nshape = "plane"\npoint = ["0 nm", "0 nm", "-4 nm"]\nstiffness = "1 pN/nm"\n'
    region = 'count = 300, wall = 1, lower = ["0 nm", "0 nm", "-9 nm"], upper = ["1 um", "2 um", "9 nm"]'
    text = NETWORK.replace("count = 40\nbound = 40", f"anchors = {{ {region} }}\nbound = 1") + wall
    # What a plane leaves of a periodic box is not known.
    text = text.replace("count = 60", 'count = 60\nvolume = "0.08 um^3"')
    anchors = np.array(parse_configuration(text).linkers[1].anchors)
    assert anchors.shape == (300, 3)
    np.testing.assert_array_equal(anchors[:, 2], -4.0)
    assert anchors[:, :2].min() > 0.0 and 900.0 < anchors[:, 0].max() < 1000.0 < anchors[:, 1].max() < 2000.0
    np.testing.assert_array_equal(parse_configuration(text).linkers[1].anchors, anchors)
    with pytest.raises(InputError, match="wall is 2, but there are 1"):
        parse_configuration(text.replace("wall = 1", "wall = 2"))


@pytest.mark.parametrize(
    ("old", "new", "fragments"),
    [
        ('"ALPHA_ACTININ"', '"ACTININ"', ["[[linkers]] number 1: type must be one of ALPHA_ACTININ", "Did you mean"]),
        ('name = "motor"', 'nome = "motor"', ["[[linkers]] number 2: has an unknown key 'nome'", "'name'"]),
        ('"60 nm"', '"60 pN"', ["[[linkers]] number 2: hand reach has the unit", '"360 nm"']),
        ('"60 nm"', '"0 nm"', ["line 21: [[linkers]] number 2: hand reach must be positive"]),
        (
            '"60 nm"',
            '"0.09 nm"',
            ["number 2: The reach of a hand, 0.09 nm, must be at least a thousandth of a segment"],
        ),
        ('reach = "60 nm", ', "", ["number 2: hand lacks the key 'reach': add a line such as reach ="]),
        ('"1e5 1/s"', '"-1e5 1/s"', ["number 2: hand binding_rate must be zero or positive"]),
        ('"2000 1/s"', '"nan 1/s"', ["number 2: hand unbinding_rate must be finite"]),
        ('"1e5 1/s"', '"inf 1/s"', ["number 2: hand binding_rate must be finite"]),
        ('"4 pN"', '"0 pN"', ["number 2: hand stall_force must be positive"]),
        ("stall_force =", 'site_spacing = "0 nm", stall_force =', ["number 2: hand site_spacing must be positive"]),
        ('"1e5 1/s"', '"200"', ["hand binding_rate needs a unit", '"10 1/s"']),
        ('"-0.5 um/s"', '"-0.5 um"', ["hand speed has the unit", '"0.5 um/s"']),
        ('"0.1 pN/nm"', '"-0.1 pN/nm"', ["[[linkers]] number 2: stiffness must be positive"]),
        ('stiffness = "0.1 pN/nm"\n', "", ["number 2: lacks the key 'stiffness'"]),
        (MOTOR, "", ["[[linkers]] number 2: lacks the key 'type'", "KINESIN_1", "hand = {"]),
        (MOTOR, "hand = 3", ["[[linkers]] number 2: hand must be a table", "but is 3"]),
        (MOTOR, "hands = []", ["number 2: hands must be a list of two tables", "but is []"]),
        (
            MOTOR,
            f'{MOTOR}\nhands = [{{ reach = "1 nm" }}, {{}}]',
            ["give hand, for two equal ones, or hands, not both"],
        ),
        ("speed =", "rest_length =", ["number 2: hand has an unknown key 'rest_length'", "belongs to [[linkers]]"]),
        ('name = "motor"', 'speed = "1 um/s"', ["unknown key 'speed'", "belongs to the hand of [[linkers]]"]),
        ("stall_force =", "unbinding_force = 3, stall_force =", ["hand unbinding_force must be a text with a number"]),
        ("stall_force =", 'at_end = "stay", stall_force =', ["hand at_end must be one of release, hold"]),
        ("stall_force =", 'walks_backward = "no", stall_force =', ["hand walks_backward must be true or false"]),
        ("stall_force =", "strain_share = 2, stall_force =", ["hand: strain_share must be between 0 and 1"]),
        ("stall_force =", "binds_to = [1], stall_force =", ["hand binds_to must be a name", "but is [1]"]),
        ("stall_force =", 'binds_to = "MT", stall_force =', ["binds to filaments of the type MT", "are ACT", '"ACT"']),
        ('"ALPHA_ACTININ"', '"KINESIN_1"', ["number 1: A hand binds to filaments of the type MT", "are ACT"]),
        ("count = 60\nbound = 30", "", ["[[linkers]] number 1: ", "give one of count, concentration and anchors"]),
        ("count = 60", "count = 60.5", ["[[linkers]] number 1: count must be a whole number"]),
        ("bound = 30", "bound = 61", ["number 1: ", "61 are to begin bound, but there are only 60"]),
        ("bound = 30", 'concentration = "1 uM"', ["give one of count, concentration and anchors"]),
        ("count = 60\nbound = 30", 'concentration = "1 nm"', ["number 1: concentration has the unit", '"1 uM"']),
        ("count = 60\nbound = 30", "anchors = []", ["number 1: anchors must be a list of points"]),
        ("count = 60\nbound = 30", 'anchors = [["1 nm"]]', ["number 1: anchors[0] must be a point"]),
        ("count = 60\nbound = 30", "anchors = [100]", ["number 1: anchors must be numbers of nodes between 0 and 99"]),
        ('edges = ["0.4 um", ', 'edges = ["0.1 um", ', ["number 1: The reach of a hand, 50 nm", "the box, 100 nm"]),
        ('edges = ["0.4 um", "0.4 um", "0.5 um"]', "", ["[box] lacks the key 'edges': add a line such as"]),
        ('edges = ["0.4 um", "0.4 um", "0.5 um"]', 'edges = "1 um"', ["[box] edges must be a list of three"]),
        ('edges = ["0.4 um", ', 'edges = ["0 um", ', ["[box] edges must be positive"]),
        (
            '[box]\nedges = ["0.4 um", "0.4 um", "0.5 um"]',
            "",
            ["number 1: Linkers that are not bound", "[box]", "volume ="],
        ),
        ("seed = 5", 'engine = "portable"', ["[simulation] engine has no [[linkers]]"]),
    ],
)
def test_mistakes_are_named(old, new, fragments):
    assert old in NETWORK
    with pytest.raises(InputError) as caught:
        parse_configuration(NETWORK.replace(old, new, 1))
    for fragment in fragments:
        assert fragment in str(caught.value)


@pytest.mark.parametrize(
    ("spacing", "message"),
    [
        ("30 nm", r"Linkers 'motor': 40 are to begin bound, but there are only \d+ sites"),
        ("1e-7 nm", 'number 2: hand site_spacing is "1e-7 nm", which is too small to be simulated'),
    ],
)
def test_sites_that_runs_cannot_have_are_refused(spacing, message, tmp_path, capsys):
    text = NETWORK.replace("stall_force =", f'site_spacing = "{spacing}", stall_force =', 1)
    (tmp_path / "input.toml").write_text(text.replace("count = 20", "count = 1", 1))
    assert main(["run", str(tmp_path / "input.toml"), "--output", str(tmp_path / "out")]) != 0
    assert re.search(message, capsys.readouterr().err)


def test_kinesin_binds_to_microtubules_alone():
    text = NETWORK.replace('"ALPHA_ACTININ"', '"KINESIN_1"').split("[[linkers]]\nname")[0]
    text += '[[filament]]\ntype = "MICROTUBULE"\nsegments = 2\n' + NETWORK[NETWORK.index("[simulation]") :]
    configuration = parse_configuration(text)
    assert [group.linked for group in configuration.filaments] == [False, True]
    assert configuration.linkers[0].kind == KINESIN_1
    assert configuration.filaments[1].type == MICROTUBULE


def test_filaments_begin_at_random_places_in_a_box():
    text = NETWORK.replace("count = 20", 'count = 400\nstart = "straight"')
    filaments = placed_filaments(parse_configuration(text))
    middles = np.array([filament.positions.mean(axis=0) for filament in filaments])
    assert (middles >= 0.0).all() and (middles < (400, 400, 500)).all()
    # The standard error of a mean of 400 is 1/(20 sqrt 12) of an edge, and that of mean squares of a unit vector 0.015.
    np.testing.assert_allclose(middles.mean(axis=0) / (400, 400, 500), 0.5, atol=4 * 0.0144)
    ends = np.array([filament.positions[-1] - filament.positions[0] for filament in filaments])
    np.testing.assert_allclose((ends**2).mean(axis=0) / 400**2, 1 / 3, atol=4 * 0.015)


def test_changes_of_linkers_and_box_are_named():
    first = parse_configuration(NETWORK)
    second = parse_configuration(NETWORK.replace('"0.5 um"', '"0.8 um"').replace("bound = 30", "bound = 29"))
    assert changed_keys(first, second) == ["[box] edges", "[[linkers]] number 1: bound"]
    third = parse_configuration(NETWORK.split("[[linkers]]\nname")[0] + NETWORK[NETWORK.index("[simulation]") :])
    assert changed_keys(first, third) == ["the number of [[linkers]] tables"]


def test_tables_and_places_are_those_of_the_linkers(unbroken):
    """Numbers and tensions of the table, from the records of the other file; places lie on the filaments of frames."""
    table = read_reports(unbroken / "linkers.csv")
    assert table["step"].shape == (FRAMES, 2)
    np.testing.assert_array_equal(table["step"][:, 0], np.arange(0, 801, 20))
    np.testing.assert_allclose(table["time (ms)"][:, 1], 5e-3 * table["step"][:, 1])
    states = np.stack([table[name] for name in ("unbound", "one hand bound", "both hands bound")], axis=2)
    np.testing.assert_array_equal(states.sum(axis=2), np.broadcast_to((60, 40), (FRAMES, 2)))
    np.testing.assert_array_equal(states[0], [[30, 30, 0], [0, 40, 0]])
    assert states[-1, 1, 2] > 0
    events = table["bindings"], table["unbindings"]
    for series in events:
        assert (np.diff(series, axis=0) >= 0).all() and series[-1].sum() > 10
    bound = states @ (0, 1, 2)
    np.testing.assert_array_equal(events[0] - events[1], bound - bound[0])

    records = np.load(unbroken / "linkers.npy")
    assert records.dtype == LINKER_RECORD
    configuration = read_configuration(unbroken / "configuration.toml")
    for number, group in enumerate(configuration.linkers):
        for report, step in enumerate(table["step"][:, 0]):
            here = records[(records["step"] == step) & (records["type"] == number)]
            both = (here["filaments"] >= 0).all(axis=1)
            assert (len(here) - both.sum(), both.sum()) == tuple(states[report, number, 1:])
            np.testing.assert_array_equal(np.isnan(here["tension"]), ~both)
            lengths = np.linalg.norm(here["places"][both, 1] - here["places"][both, 0], axis=1)
            tensions = group.kind.stiffness * (lengths - group.kind.rest_length)
            np.testing.assert_allclose(here["tension"][both], tensions, atol=2e-3)
            mean, largest = (PN * table[f"{name} tension (pN)"][report, number] for name in ("mean", "maximum"))
            if both.any():
                np.testing.assert_allclose((mean, largest), (tensions.mean(), tensions.max()), atol=2e-3)
            else:
                assert np.isnan(mean) and np.isnan(largest)


def test_linkers_that_are_gone_are_refused(tmp_path, unbroken, capsys):
    output = tmp_path / "out"
    output.mkdir()
    for path in unbroken.iterdir():
        (output / path.name).write_bytes(path.read_bytes())
    (output / "checkpoint.chk").write_bytes(resealed((output / "checkpoint.chk").read_bytes(), step=780))
    records = (output / "linkers.npy").read_bytes()
    (output / "linkers.npy").write_bytes(records[:300])
    arguments = ["run", str(output / "configuration.toml"), "--output", str(output), "--resume"]
    assert main(arguments) == 2
    assert "linkers.npy is not a file of places of linkers" in capsys.readouterr().err
    (output / "linkers.npy").unlink()
    assert main(arguments) == 2
    assert "linkers.npy is missing" in capsys.readouterr().err


def test_summary_has_linkers(unbroken, capsys):
    summary = json.loads((unbroken / "summary.json").read_text())
    (group,) = summary["groups"]
    assert not group["in_equilibrium"] and any("Linkers bind to these filaments" in note for note in group["notes"])
    table = read_reports(unbroken / "linkers.csv")
    for number, (name, own) in enumerate(zip(("alpha-actinin", "motor"), summary["linkers"])):
        assert own["name"] == name
        late = table["both hands bound"][FRAMES // 2 :, number]
        assert own["both_hands_bound"] == pytest.approx(late.mean())
        tension = table["mean tension (pN)"][FRAMES // 2 :, number]
        largest = table["maximum tension (pN)"][:, number]
        if np.isnan(largest).all():
            assert own["mean_tension"] is None and own["largest_tension"] is None
            continue
        assert own["mean_tension"] == pytest.approx(np.average(tension[late > 0], weights=late[late > 0]))
        assert own["largest_tension"] == pytest.approx(np.nanmax(largest))
    assert summary["linkers"][1]["largest_tension"] > 0
    with rendered():
        assert main(["run", str(unbroken / "configuration.toml"), "--output", str(unbroken), "--resume"]) == 0
    text = capsys.readouterr().out
    assert "both hands" in text and "alpha-actinin" in text and "motor" in text
    assert Image.open(unbroken / "summary.png").size[0] > 1000


def test_example_of_a_network():
    configuration = read_configuration(EXAMPLES / "motor_network.toml")
    assert configuration.box is not None and len(configuration.linkers) == 2
    assert configuration.filaments[0].type == F_ACTIN.with_segment_length(100 * unit.nanometer)
    # What its comments describe is a table of its own.
    text = (EXAMPLES / "motor_network.toml").read_text()
    commented = "".join(re.findall(r"(?m)^#( {5}(?:name|stiffness|rest_length|hand) =.*\n)", text))
    own = parse_configuration(text.replace("[simulation]", f"[[linkers]]\n{commented}count = 5\n[simulation]"))
    assert own.linkers[2].kind.name == "motor" and own.linkers[2].kind.hands[0].speed > 0


def test_shortest_run_without_linkers_that_are_bound(tmp_path, capsys):
    """Two reports; from a concentration of nothing, no linker ever comes, and one on a point far away binds nothing."""
    text = NETWORK.replace("count = 60\nbound = 30", 'concentration = "0 uM"').replace("count = 20", "count = 2")
    text = text.replace("count = 40\nbound = 40", 'anchors = [["90 nm", "90 nm", "90 nm"]]').replace("1e5 1/s", "0 1/s")
    (tmp_path / "input.toml").write_text(text.replace('"4 ms"', '"0.1 ms"').replace('"0.3 ms"', '"0.1 ms"'))
    assert main(["run", str(tmp_path / "input.toml"), "--output", str(tmp_path / "out")]) == 0
    assert len(np.load(tmp_path / "out" / "linkers.npy")) == 0
    empty, anchored = json.loads((tmp_path / "out" / "summary.json").read_text())["linkers"]
    assert (empty["unbound"], empty["largest_tension"], anchored["one_hand_bound"]) == (None, None, 1.0)
    output = capsys.readouterr().out
    assert re.search(r"alpha-actinin +- +0 ± 0 +0 ± 0 +- +-", output)
    assert re.search(r"motor +0 ± 0 +1 ± 0 +0 ± 0 +- +-", output)


def test_example_of_a_network_runs_without_a_warning(tmp_path, capsys):
    text = (EXAMPLES / "motor_network.toml").read_text()
    short = re.sub(r"(?m)^duration = .*$", 'duration = "6 ms"', re.sub(r"(?m)^count = 80 .*$", "count = 20", text))
    (tmp_path / "short.toml").write_text(short)
    assert main(["run", str(tmp_path / "short.toml"), "--output", str(tmp_path / "out")]) == 0
    assert "warning" not in capsys.readouterr().err
    assert read_reports(tmp_path / "out" / "linkers.csv")["step"].shape == (3, 2)


def test_recommended_step_knows_linkers(tmp_path, capsys):
    """Motors that unbind 10^7 times a second allow a fifth of that, and less than the filaments."""
    text = NETWORK.replace('"2000 1/s"', '"1e7 1/s"').replace('time_step = "5 us"', 'time_step = "recommended"')
    (tmp_path / "input.toml").write_text(text.replace('report_interval = "0.1 ms"', 'report_interval = "10 us"'))
    assert main(["timestep", str(tmp_path / "input.toml")]) == 0
    output = capsys.readouterr().out
    assert re.search(r"20 ns  allowed by motor: a hand unbinds with the rate 1e\+07/s", output)
    assert "allowed by alpha-actinin: " in output
    assert "20 ns  (motor: a hand unbinds with the rate 1e+07/s)" in output
    configuration = parse_configuration((tmp_path / "input.toml").read_text())
    assert configuration.simulation.time_step == pytest.approx(2e4)
