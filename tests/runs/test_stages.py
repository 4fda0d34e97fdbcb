"""Stages of a run: what changes, what goes on to the bit, and what is refused."""

import json

import numpy as np
import pytest

from openmm_cylchain import analysis
from openmm_cylchain.cli import main
from openmm_cylchain.errors import InputError
from openmm_cylchain.output.read_tables import read_reports, read_table
from openmm_cylchain.runs.configuration import parse_configuration, read_configuration
from openmm_cylchain.runs.dry_run import dry_run
from openmm_cylchain.runs.run import run
from openmm_cylchain.runs.run_directory import RunDirectory
from openmm_cylchain.runs.stages import frame_steps, frame_times
from openmm_cylchain.units.quantities import thermal_energy
from support import configurations
from support.configurations import BEAMS, COMING_AND_GOING, EVERYTHING
from support.run_figures import rendered
from support.small_runs import NETWORK
from support.staged_runs import DELETING, DELETING_GROWN, GROWING, MANY_CHANGES, divided

pytestmark = pytest.mark.filterwarnings("ignore::openmm_cylchain.errors.TimeStepWarning")
OWN = ("configuration.toml", "description.json", "checkpoint.chk", ".lock")


def contents(directory):
    found = {path.name: path.read_bytes() for path in directory.iterdir() if path.name not in OWN[:2]}
    found["checkpoint.chk"] = found["checkpoint.chk"].partition(b"\n")[2]
    return found


@pytest.mark.parametrize(
    "text",
    [NETWORK, configurations.GROWING, pytest.param(COMING_AND_GOING, marks=pytest.mark.slow), EVERYTHING, BEAMS],
    ids=["linked", "growing", "coming and going", "all", "beams"],
)
def test_stages_that_change_nothing_change_nothing(text, tmp_path):
    """To the bit: another System goes on with the noise, the linkers and the growth of the one before."""
    run(parse_configuration(text), tmp_path / "whole")
    run(parse_configuration(divided(text)), tmp_path / "divided")
    whole, parts = (contents(tmp_path / name) for name in ("whole", "divided"))
    assert whole.keys() == parts.keys()
    for name in whole.keys() - set(OWN):
        assert whole[name] == parts[name], name


@pytest.mark.parametrize(
    "text",
    [
        MANY_CHANGES,
        DELETING,
        pytest.param(DELETING_GROWN, marks=pytest.mark.slow),
        pytest.param(GROWING, marks=pytest.mark.slow),
    ],
    ids=["linked", "deleting", "deleting grown", "growing"],
)
def test_a_run_goes_on_from_any_checkpoint(text, tmp_path, monkeypatch):
    configuration = parse_configuration(text)
    run(configuration, tmp_path / "whole")
    write, count = RunDirectory.write_checkpoint, 0

    def writes(directory, checkpoint):
        nonlocal count
        write(directory, checkpoint)
        count += 1
        if directory.path.name != "whole":
            raise KeyboardInterrupt

    monkeypatch.setattr(RunDirectory, "write_checkpoint", writes)
    steps = set()
    while True:
        try:
            run(configuration, tmp_path / "broken", resume=True)
        except KeyboardInterrupt:
            header = (tmp_path / "broken" / "checkpoint.chk").read_bytes().partition(b"\n")[0]
            steps.add(json.loads(header)["step"])
            continue
        break
    assert {stage.last_step for stage in configuration.stages} <= steps
    assert contents(tmp_path / "whole") == contents(tmp_path / "broken")


def test_what_a_stage_says_is_there(tmp_path):
    configuration = parse_configuration(MANY_CHANGES)
    stages = configuration.stages
    assert [own.name for own in stages] == [
        "start",
        "drug",
        *("cycle 1, hot", "cycle 1, squeeze", "cycle 1, squeeze"),
        *("cycle 2, hot", "cycle 2, squeeze", "cycle 2, squeeze"),
    ]
    assert [own.configuration.linkers[1].kind.hands[0].speed for own in stages[:3]] == [-5e-10, 0.0, 0.0]
    assert [own.configuration.solvent.temperature for own in stages[1:5]] == [298.15, 310.0, 298.15, 298.15]
    # In the middles of pieces, and where it ends from there on.
    assert [own.configuration.walls[0].shape.upper[0] for own in stages[3:]] == [900.0, 700.0, 600.0, 900.0, 700.0]
    assert configuration.simulation.steps == 40 + 80 + 2 * 80
    run(configuration, tmp_path / "out")
    table = read_reports(tmp_path / "out" / "linkers.csv")
    counts = table["unbound"] + table["one hand bound"] + table["both hands bound"]
    late = table["step"][:, 0] > 40
    assert np.all(counts[~late] == [60, 40]) and np.all(counts[late] == [80, 25])
    # Ten of those that were added began bound.
    bound = table["one hand bound"] + table["both hands bound"]
    assert bound[late][0, 0] - bound[~late][-1, 0] == pytest.approx(10, abs=3)
    found = analysis.load(tmp_path / "out")
    assert np.array_equal(found.steps, frame_steps(configuration))
    assert found.times == pytest.approx(frame_times(configuration))
    assert np.diff(found.times) == pytest.approx([5e7] * 4 + [2.5e7] * 24)
    assert [len(found.crosslinks(frame)) for frame in (0, 4, 5, 28)] == [0, 0, 1, 1]
    loads = read_reports(tmp_path / "out" / "wall_forces.csv")
    assert np.all(loads["load (pN)"][:17] == 0.0) and loads["mean over (ms)"][20].max() > 0.0


def test_stages_that_are_the_same_have_one_configuration(tmp_path):
    """Each of which is built once, to see that it can be, however often it comes."""
    path = tmp_path / "run.toml"
    path.write_text(MANY_CHANGES)
    stages = read_configuration(path).stages
    # Those of the two pieces of each squeeze.
    assert all(stages[number].configuration is stages[number + 3].configuration for number in (3, 4))
    assert {own.configuration.path for own in stages} == {str(path)}


WASHED = """
[[stage]]
duration = "0.2 ms"
[[stage]]
name = "washed"
duration = "0.1 ms"
linkers.motor.keep = "both hands bound"
linkers.1.keep = "bound"
linkers.1.hand.binding_rate = "0 1/s"
[[stage]]
name = "again"
duration = "0.1 ms"
linkers.motor.count = 30
"""


def test_a_stage_keeps_bound_linkers_and_none_come_back_by_themselves(tmp_path):
    """From reports at which a stage begins, when nothing has unbound yet: 5 us later."""
    text = NETWORK.replace('duration = "1 ms"\n', "checks = false\n").replace('"0.1 ms"', '"5 us"') + WASHED
    run(parse_configuration(text), tmp_path / "out")
    table = read_reports(tmp_path / "out" / "linkers.csv")
    counts = table["unbound"] + table["one hand bound"] + table["both hands bound"]
    both, bound = table["both hands bound"], table["one hand bound"] + table["both hands bound"]
    assert both[40, 1] > 10 and bound[40, 0] < 40
    assert np.all(counts[41:61] == [bound[40, 0], both[40, 1]])
    assert np.all(counts[61:, 1] == 30) and np.all(counts[61:, 0] == bound[40, 0])


def test_concentrations_and_counts_take_turns(tmp_path):
    text = (
        NETWORK.replace('duration = "1 ms"\n', "checks = false\n")
        + """
[[stage]]
duration = "0.2 ms"
[[stage]]
duration = "0.2 ms"
linkers.motor.concentration = "1 uM"
[[stage]]
duration = "0.2 ms"
linkers.motor.count = 70
"""
    )
    configuration = parse_configuration(text)
    assert [own.configuration.linkers[1].count for own in configuration.stages] == [40, None, 70]
    run(configuration, tmp_path / "out")
    table = read_reports(tmp_path / "out" / "linkers.csv")
    bound = table["one hand bound"][:, 1] + table["both hands bound"][:, 1]
    # Nobody counts those of a concentration that are not bound.
    assert np.all(np.nan_to_num(table["unbound"][3:5, 1]) == 0.0) and bound[4] > 20
    assert table["unbound"][5, 1] + bound[5] == 70


COMES_AND_GOES = """
[solvent]
temperature = "300 K"
viscosity = "1 mPa*s"
[[filament]]
name = "STAYS"
diameter = "10 nm"
segment_length = "100 nm"
persistence_length = "10 um"
stretching_modulus = "1 nN"
segments = 4
count = 6
inside = { shape = "sphere", radius = "0.3 um" }
[[filament]]
name = "COMES"
diameter = "10 nm"
segment_length = "100 nm"
persistence_length = "10 um"
stretching_modulus = "1 nN"
segments = 4
count = 6
inside = { shape = "sphere", radius = "0.3 um" }
active = false
[[linkers]]
name = "glue"
stiffness = "0.1 pN/nm"
rest_length = "20 nm"
hand = { binding_rate = "1e5 1/s", reach = "60 nm", unbinding_rate = "100 1/s" }
count = 60
volume = "0.1 um^3"
[[wall]]
shape = "sphere"
radius = "0.31 um"
stiffness = "0.1 pN/nm"
[contacts]
diameter = "20 nm"
[simulation]
time_step = "0.5 us"
report_interval = "50 us"
seed = 4
checks = false
[[stage]]
duration = "0.2 ms"
[[stage]]
name = "comes"
duration = "0.3 ms"
filament.COMES.active = true
[[stage]]
name = "goes"
duration = "0.2 ms"
filament.STAYS.active = false
"""


@pytest.mark.filterwarnings("ignore::openmm_cylchain.errors.ContactWarning")
def test_filaments_come_and_go(tmp_path):
    """Those that are not active are not in frames; nothing binds to them or touches them."""
    configuration = parse_configuration(COMES_AND_GOES)
    run(configuration, tmp_path / "out")
    found = analysis.load(tmp_path / "out")
    first, second, third = (stage.frames for stage in found.stages)
    stays, comes = slice(0, 6), slice(6, 12)
    there = np.array([[len(own) > 0 for own in found.nodes(frame)] for frame in range(len(found))])
    assert np.all(there[: first.stop, stays]) and not np.any(there[: first.stop, comes])
    assert np.all(there[second])
    assert not np.any(there[third, stays]) and np.all(there[third, comes])
    begun = [own.mean(axis=0) for own in found.nodes(second[0])[comes]]
    assert np.linalg.norm(begun, axis=1).max() < 300.0 and len({*map(tuple, begun)}) == 6
    held = [set(found.linkers[frame]["filaments"].ravel().tolist()) - {-1} for frame in range(len(found))]
    assert held[first[-1]] and held[first[-1]] <= set(range(6))
    assert held[second[-1]] & set(range(6, 12))
    assert held[third[0]] and held[third[-1]] <= set(range(6, 12))
    loads = read_reports(tmp_path / "out" / "contact_forces.csv")["load (pN)"]
    assert np.all(loads[: first.stop, comes] == 0.0) and np.all(loads[third.start :, stays] == 0.0)
    assert loads[second.start :, comes].max() > 0.0


def test_points_of_tethers_go_on_from_stage_to_stage(tmp_path):
    configuration = parse_configuration(MANY_CHANGES)
    run(configuration, tmp_path / "out")
    table = read_table(tmp_path / "out" / "pulling.csv")
    points = np.stack([table[f"point {axis} (nm)"] for axis in "xyz"], axis=1)
    moved, times = points - points[0], table["time (ms)"]
    along_x = 100.0 * np.minimum(times, 0.2)
    # What the first warm part says stays in force behind it.
    along_y = 50.0 * np.maximum(0.0, times - 0.4)
    # Points have moved for the last time up to an interval before.
    assert moved[:, 0] == pytest.approx(along_x, abs=1.01)
    assert moved[:, 1] == pytest.approx(along_y, abs=1.01)


TRAPS = """
[solvent]
temperature = "300 K"
viscosity = "1 mPa*s"
[[filament]]
name = "ROD"
diameter = "10 nm"
segment_length = "50 nm"
persistence_length = "1 um"
stretching_modulus = "1 nN"
segments = 2
count = 600
[[tether]]
table = 1
node = 0
stiffness = "0.05 pN/nm"
[simulation]
time_step = "0.2 us"
report_interval = "20 us"
seed = 3
checks = false
[[stage]]
name = "soft"
duration = "60 us"
[[stage]]
name = "stiff"
duration = "40 us"
tether.stiffness = "0.2 pN/nm"
[[stage]]
name = "warm"
duration = "40 us"
solvent.temperature = "360 K"
filament.ROD.bending_rigidity = "6e-27 N*m^2"
simulation.time_step = "0.1 us"
"""


def test_fluctuations_in_a_trap_are_those_of_each_stage(tmp_path):
    """By equipartition: kT/k along each axis, whatever else the filament does."""
    configuration = parse_configuration(TRAPS)
    run(configuration, tmp_path / "out")
    found = analysis.load(tmp_path / "out")
    points = np.array([own[0] for own in found.nodes(0)])
    for frame, stage in ((3, 0), (5, 1), (7, 2)):
        own = configuration.stages[stage].configuration
        squares = (np.array([nodes[0] for nodes in found.nodes(frame)]) - points) ** 2
        expected = thermal_energy(own.solvent.temperature) / own.tethers[0].stiffness
        error = squares.std() / np.sqrt(squares.size)
        assert error < 0.04 * expected
        assert squares.mean() == pytest.approx(expected, abs=4.0 * error)


GROWTH = """
[solvent]
temperature = "300 K"
viscosity = "1 mPa*s"
[[monomers]]
name = "unit"
length = "5 nm"
plus_on_rate = "400 1/(uM*s)"
plus_off_rate = "300 1/s"
concentration = "6 uM"
volume = "20 um^3"
[[filament]]
name = "GROWS"
diameter = "10 nm"
segment_length = "100 nm"
persistence_length = "10 um"
stretching_modulus = "1 nN"
segments = 4
count = 60
growth = { longest = "5 um" }
[simulation]
time_step = "0.5 ms"
report_interval = "10 ms"
seed = 7
checks = false
[[stage]]
name = "rich"
duration = "100 ms"
[[stage]]
name = "poor"
duration = "100 ms"
monomers.concentration = "4 uM"
[[stage]]
name = "capped"
duration = "50 ms"
[stage.monomers]
plus_on_rate = "0 1/(uM*s)"
plus_off_rate = "1e-9 1/s"
"""


def test_growth_follows_the_monomers_of_each_stage(tmp_path):
    """k_on c - k_off, at the concentrations that the pool has; and monomers that come or go are counted."""
    run(parse_configuration(GROWTH), tmp_path / "out")
    table = read_reports(tmp_path / "out" / "growth.csv")
    lengths = (table["plus end (monomers)"] - table["minus end (monomers)"]).sum(axis=1)
    free = table["free monomers (uM)"][:, 0]
    volume = 20.0 * 602.214
    total = free * volume + lengths
    assert total[1:11] == pytest.approx(total[0], abs=0.1)
    # The concentration at first is 2 uM less now.
    assert total[11:] == pytest.approx(total[0] - 2.0 * volume, abs=1.0)
    for stage, rates in ((slice(0, 11), (400.0, 300.0)), (slice(11, 21), (400.0, 300.0)), (slice(21, 26), (0.0, 1e-9))):
        seconds = np.diff(table["time (ms)"][stage, 0]) / 1e3
        mean = 0.5 * (free[stage][1:] + free[stage][:-1])
        gained = 60.0 * np.sum(rates[0] * mean * seconds)
        lost = 60.0 * rates[1] * seconds.sum()
        error = np.sqrt(gained + lost)
        assert gained == 0.0 or error < 0.05 * gained
        assert lengths[stage][-1] - lengths[stage][0] == pytest.approx(gained - lost, abs=4.0 * error + 1e-9)


def test_recommended_steps_are_those_of_each_stage(tmp_path, capsys):
    path = tmp_path / "staged.toml"
    path.write_text(TRAPS.replace("count = 600", "count = 2"))
    assert main(["timestep", str(path)]) == 0
    said = [line for line in capsys.readouterr().out.splitlines() if line.startswith("stage")]
    assert [line.partition(":")[0] for line in said] == ["stage 'soft'", "stage 'stiff'", "stage 'warm'"]
    assert [line.rpartition(" here ")[2] for line in said] == ["200 ns", "200 ns", "100 ns"]


def test_errors_of_a_stage_say_which(tmp_path):
    text = (
        NETWORK.replace('duration = "1 ms"\n', "checks = false\n")
        + """
[[stage]]
duration = "0.1 ms"
[[stage]]
name = "fast"
duration = "0.1 ms"
linkers.motor.concentration = "50 M"
"""
    )
    with pytest.raises(InputError, match=r"In stage 'fast'"):
        run(parse_configuration(text), tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_dry_run_begins_each_stage():
    lines = list(dry_run(parse_configuration(MANY_CHANGES)))
    assert "    drug: from 200 us to 400 us" in lines
    assert "    cycle 2, squeeze: from 700 us to 800 us, in 2 pieces" in lines


def test_summary_and_figure_have_stages(tmp_path, capsys):
    path = tmp_path / "staged.toml"
    path.write_text(MANY_CHANGES)
    with rendered():
        assert main(["run", str(path), "--output", str(tmp_path / "out")]) == 0
    text = capsys.readouterr().out
    assert "network: 800 us in steps of 5 us and 2.5 us" in text
    content = json.loads((tmp_path / "out" / "summary.json").read_text())
    assert [own["name"] for own in content["stages"]][:3] == ["start", "drug", "cycle 1, hot"]
    mean, error = content["stages"][1]["values"]["motor, both hands bound"]
    table = read_reports(tmp_path / "out" / "linkers.csv")
    assert mean == pytest.approx(table["both hands bound"][9:13, 1].mean())
    assert error > 0.0


ONE = """[[stage]]
name = "only"
duration = "0.1 ms"
"""


@pytest.mark.parametrize(
    ("stage", "line", "message"),
    [
        ("[[stage]]\nname = 'a'\n", "[[stage]]", "stage 'a': lacks the key 'duration'"),
        (ONE + "[stage.linkers.motor]\nhand.sped = '0 um/s'", "hand.sped", "unknown key 'sped'"),
        (
            ONE + "[stage.linkers.motor]\nhand.speed = '0 nm'",
            "hand.speed",
            "stage 'only': [[linkers]] number 2: hand speed",
        ),
        (ONE + "[stage.linkers.myosin]\ncount = 1", "[stage.linkers", "has no table 'myosin': there are 1, 2"),
        (ONE + "[stage.box]\nedges = ['1 um', '1 um', '1 um']", "[stage.box]", "box cannot change while a run goes on"),
        (ONE + "[stage.filament]\nsegments = 5", "segments = 5", "segments cannot change while a run goes on"),
        (ONE + "[stage.wall]\nradius = '1 um'", "[stage.wall]", "changes a [[wall]] of the file, which has none"),
        (ONE + "[stage.solvents]\ntemperature = '1 K'", "[stage.solvents]", "unknown key 'solvents'"),
        (ONE + "filament.active = true\nfilament.1.clamped = [0]", "filament.1.clamped", "cannot change while a run"),
        (ONE + "repeat = 0", "repeat", "must be at least 1"),
        (
            ONE + "[stage.solvent]\ntemperature = { from = '300 K', to = '310 K' }",
            "temperature = {",
            "say into how many pieces the stage is divided",
        ),
        (
            ONE + "pieces = 3\n[stage.solvent]\ntemperature = { from = '300 K', to = '310 K' }",
            'duration = "0.1',
            "not a whole multiple of report_interval",
        ),
        (ONE + "pieces = 3", "pieces", "belongs to a value that goes from one to another"),
        (
            ONE + "pieces = 1\n[stage.linkers.motor]\nhand.at_end = { from = 'hold', to = 'release' }",
            "hand.at_end",
            "cannot go from one value to another",
        ),
        (ONE.replace("0.1 ms", "0.15 ms"), 'duration = "0.15', "stage 'only': [simulation] duration is 150 us"),
        (ONE + "[stage.simulation]\ntime_step = '3 us'", "time_step = '3", "not a whole multiple of time_step"),
        (
            "[[stage]]\nrepeat = 2\ntether.node = 1\n[[stage.stage]]\nduration = '1 ms'",
            "tether.node",
            "move tether into",
        ),
    ],
)
def test_mistakes_name_the_stage_and_the_line(stage, line, message):
    text = NETWORK.replace('duration = "1 ms"\n', "") + stage
    with pytest.raises(InputError) as error:
        parse_configuration(text)
    number = next(n for n, own in reversed(list(enumerate(text.splitlines(), start=1))) if own.startswith(line))
    assert message in str(error.value)
    assert str(error.value).startswith(f"line {number}: ")


def test_states_of_ends_and_duration_of_the_file_are_refused():
    text = divided(COMING_AND_GOING) + "[stage.filament]\ngrowth.plus_capped = true\n"
    with pytest.raises(InputError, match="changes which states|cannot be with|aging"):
        parse_configuration(text)
    with pytest.raises(InputError, match=r"\[simulation\] duration is said by \[\[stage\]\] tables"):
        parse_configuration(NETWORK + ONE)
