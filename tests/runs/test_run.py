"""Runs: their files, resuming after a kill at any moment, refusals, signals and blow-ups."""

import csv
import json
import math
import os
import re
import shutil
import signal
import subprocess

import mdtraj
import numpy as np
import pytest
from openmm import app
from PIL import Image

from openmm_cylchain import F_ACTIN, InputError, analysis
from openmm_cylchain.cli import main
from openmm_cylchain.engines.gpu_platforms import why_not_on
from openmm_cylchain.output.read_tables import read_table
from openmm_cylchain.output.run_tables import ReportTable, size_of_lines
from openmm_cylchain.runs.configuration import parse_configuration, read_configuration
from openmm_cylchain.runs.run import run
from openmm_cylchain.runs.run_directory import RunDirectory
from openmm_cylchain.runs.summary import load_trajectory, summarise
from openmm_cylchain.runs.summary_text import format_summary
from openmm_cylchain.units.quantities import PICONEWTON
from support.checkpoints import resealed
from support.commands import COMMAND, finish, start, wait_for_size
from support.configurations import placed_filaments
from support.contexts import positions_of
from support.run_figures import rendered

SHORT = """
title = "short"
[solvent]
temperature = "310 K"
viscosity = "1.71 mPa*s"
[[filament]]
type = "F_ACTIN"
segments = 6
count = 3
[[filament]]
type = "F_ACTIN"
segments = 4
start = "straight"
clamped = [0]
[simulation]
time_step = "10 ns"
duration = "12 us"
report_interval = "0.2 us"
checkpoint_interval = "0.6 us"
seed = 5
"""

FRAMES = 61


def configured(tmp_path, text=SHORT, **changes):
    for key, value in changes.items():
        text, count = re.subn(rf"(?m)^{key} = .*$", f"{key} = {value}", text, count=1)
        if not count:
            text += f"{key} = {value}\n"
    path = tmp_path / "input.toml"
    path.write_text(text)
    return str(path)


def assert_same_run(output, reference):
    for name in ("trajectory.dcd", "energies.csv"):
        assert (output / name).read_bytes() == (reference / name).read_bytes()


@pytest.fixture(scope="module")
def unbroken(tmp_path_factory):
    """The directory of a run of SHORT that nothing disturbed."""
    folder = tmp_path_factory.mktemp("unbroken")
    with rendered():
        assert main(["run", configured(folder), "--output", str(folder / "out")]) == 0
    return folder / "out"


def test_files_of_a_run(unbroken):
    names = {path.name for path in unbroken.iterdir()}
    assert names == {
        ".lock",
        "checkpoint.chk",
        "configuration.toml",
        "description.json",
        "energies.csv",
        "summary.json",
        "summary.png",
        "topology.cif",
        "topology.data",
        "topology.psf",
        "trajectory.dcd",
    }
    assert (unbroken / "configuration.toml").read_text() == SHORT
    assert Image.open(unbroken / "summary.png").size[0] > 1000


def test_mdtraj_reads_trajectory_and_topology(unbroken):
    trajectory = mdtraj.load_dcd(str(unbroken / "trajectory.dcd"), top=str(unbroken / "topology.cif"))
    topology = trajectory.topology
    assert trajectory.n_frames == FRAMES
    assert [chain.n_atoms for chain in topology.chains] == [7, 7, 7, 5]
    assert topology.n_bonds == 3 * 6 + 4
    assert all(
        bond[1].index == bond[0].index + 1 and bond[0].residue.chain == bond[1].residue.chain for bond in topology.bonds
    )
    assert {residue.name for residue in topology.residues} == {"ACT"}
    initial = np.concatenate([f.positions for f in placed_filaments(parse_configuration(SHORT))])
    np.testing.assert_allclose(trajectory.xyz[0], initial, rtol=1e-6, atol=1e-3)
    np.testing.assert_array_equal(trajectory.xyz[:, 21], np.broadcast_to(trajectory.xyz[0, 21], (FRAMES, 3)))


def test_energies_are_those_of_the_trajectory(unbroken):
    with open(unbroken / "energies.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    assert [int(row["step"]) for row in rows] == list(range(0, 1201, 20))
    assert [row["time (ms)"] for row in rows] == [repr(step / 1e5) for step in range(0, 1201, 20)]
    energies = read_table(unbroken / "energies.csv")
    configuration = read_configuration(unbroken / "configuration.toml")
    trajectory = load_trajectory(configuration, RunDirectory(unbroken))
    np.testing.assert_allclose(trajectory.time, 1e9 * energies["time (ms)"])
    kT = 8.31446261815324e-3 * 310
    stretching, bending, distances = 0.0, 0.0, []
    for chain in trajectory.topology.chains:
        nodes = trajectory.xyz[:, [atom.index for atom in chain.atoms]].astype(float)
        segments = np.diff(nodes, axis=1)
        lengths = np.linalg.norm(segments, axis=2)
        tangents = segments / lengths[:, :, None]
        stretching += F_ACTIN.stretching_energy(lengths).sum(axis=1)
        bending += F_ACTIN.bending_energy((tangents[:, 1:] * tangents[:, :-1]).sum(axis=2)).sum(axis=1)
        distances.append(np.linalg.norm(nodes[:, -1] - nodes[:, 0], axis=1))
    tolerance = dict(rtol=1e-2, atol=0.05)
    np.testing.assert_allclose(PICONEWTON * energies["stretching energy (pN nm)"], stretching, **tolerance)
    np.testing.assert_allclose(PICONEWTON * energies["bending energy (pN nm)"], bending, **tolerance)
    np.testing.assert_allclose(PICONEWTON * energies["potential energy (pN nm)"], stretching + bending, **tolerance)
    np.testing.assert_allclose(energies["stretching energy per segment (kT)"], stretching / 22 / kT, **tolerance)
    np.testing.assert_allclose(energies["bending energy per joint (kT)"], bending / 18 / kT, **tolerance)
    np.testing.assert_allclose(energies["mean end-to-end distance (nm)"], np.mean(distances, axis=0), rtol=1e-6)


def test_summary_has_both_groups(unbroken):
    summary = json.loads((unbroken / "summary.json").read_text())
    assert summary["simulated time (ms)"] == 0.012
    free, straight = summary["groups"]
    assert (free["filaments"], free["segments"], free["in_equilibrium"]) == (3, 6, True)
    assert (straight["filaments"], straight["segments"], straight["in_equilibrium"]) == (1, 4, False)
    assert {o["verdict"] for o in straight["observables"]} == {"not comparable"}
    assert any("Started straight" in note for note in straight["notes"])
    observables = {o["name"]: o for o in free["observables"]}
    assert observables["stretching energy per segment"]["theory"] == pytest.approx(0.5, rel=1e-3)
    assert observables["bending energy per joint"]["theory"] == pytest.approx(np.exp(-360 / 17200), rel=1e-6)
    assert observables["segment length"]["value"] == pytest.approx(360, rel=1e-3)
    assert all(o["standard_error"] >= 0 for o in free["observables"])


@pytest.mark.parametrize("begin", ["straight", "equilibrium"])
def test_summary_says_whether_filaments_were_in_equilibrium_from_the_start(tmp_path, begin):
    filament = f'[[filament]]\ntype = "F_ACTIN"\nsegments = 6\ncount = 12\nstart = "{begin}"\n'
    config = configured(tmp_path, SHORT[: SHORT.index("[[")] + filament + SHORT[SHORT.index("[simulation]") :])
    assert main(["run", config, "--output", str(tmp_path / "out")]) == 0
    (group,) = json.loads((tmp_path / "out" / "summary.json").read_text())["groups"]
    found = [note for note in group["notes"] if "first frame on: joints are more bent" in note]
    assert len(found) == (begin == "straight")


def test_equilibrium_run_agrees_with_theory(tmp_path):
    # Time step of a fifth of the recommended one: its error is below the statistical one.
    config = configured(
        tmp_path,
        SHORT.split('[[filament]]\ntype = "F_ACTIN"\nsegments = 4')[0] + "[simulation]\n",
        count=24,
        time_step='"2 ns"',
        duration='"4 us"',
        report_interval='"0.1 us"',
    )
    configuration = read_configuration(config)
    run(configuration, tmp_path / "out")
    groups = summarise(configuration, load_trajectory(configuration, RunDirectory(tmp_path / "out")))
    for observable in groups[0].observables:
        if observable.verdict != "reference":
            assert abs(observable.deviation) < 4.0, observable
    assert "24 independent filaments" in " ".join(groups[0].notes)
    assert "24 × ACT, 6 segments" in format_summary(configuration, groups)


@pytest.mark.parametrize(
    ("kind", "bending", "per"),
    [
        ('type = "F_ACTIN"', 0.5, "joint"),
        pytest.param('type = "F_ACTIN"\nelement = "beam"', 1.0, "element", marks=pytest.mark.slow),
        pytest.param('type = "DSDNA_BASE_PAIRS"', None, "joint", marks=pytest.mark.slow),
    ],
)
def test_planar_filaments_agree_with_theory_of_a_plane(tmp_path, kind, bending, per):
    """As they are drawn, and after a few steps. Bends have half of the energy that they have in space."""
    filaments = f"[[filament]]\n{kind}\nsegments = 24\ncount = 600\nplanar = true\n"
    end = '[simulation]\ntime_step = "10 ns"\nduration = "40 ns"\nreport_interval = "20 ns"\n'
    if "BASE_PAIRS" in kind:
        end = end.replace(" ns", " ps").replace("10 ps", "1 ps")
    config = configured(tmp_path, SHORT[: SHORT.index("[[")] + filaments + end)
    configuration = read_configuration(config)
    run(configuration, tmp_path / "out")
    (group,) = summarise(configuration, load_trajectory(configuration, RunDirectory(tmp_path / "out")))
    assert group.in_equilibrium
    for own in group.observables:
        assert own.standard_error < 0.0125 * own.theory, own
        assert own.verdict == "reference" or abs(own.deviation) < 4.0, own
    (energy,) = [own.theory for own in group.observables if own.name == f"bending energy per {per}"]
    assert bending is None or energy == pytest.approx(bending, rel=0.03)
    lengths = [own.theory for own in group.observables if own.name == "persistence length"]
    assert len(lengths) == ("BASE_PAIRS" not in kind) and lengths == pytest.approx(len(lengths) * [17200.0], rel=0.03)


def test_chains_of_beads_agree_with_theory(tmp_path, capsys):
    config = configured(
        tmp_path,
        """
[solvent]
temperature = "296.15 K"
viscosity = "1 mPa*s"
[[filament]]
type = "DSDNA_BASE_PAIRS"
segments = 12
count = 40
[simulation]
time_step = "recommended"
duration = "1 ns"
report_interval = "10 ps"
""",
    )
    configuration = read_configuration(config)
    run(configuration, tmp_path / "out")
    (group,) = summarise(configuration, load_trajectory(configuration, RunDirectory(tmp_path / "out")))
    names = [observable.name for observable in group.observables]
    assert names[:4] == [
        "stretching energy per segment",
        "segment length",
        "bending energy per joint",
        "mean square end-to-end distance",
    ]
    for observable in group.observables:
        if observable.verdict != "reference":
            assert abs(observable.deviation) < 4.0 or abs(observable.relative_deviation) < 0.01, observable
    assert main(["timestep", config]) == 0
    assert "allowed by bends" in capsys.readouterr().out


def test_killed_run_resumes_to_the_same_files(tmp_path, unbroken, capsys):
    output = tmp_path / "out"
    config = configured(tmp_path)
    frame = 3 * (4 * 26 + 8)
    for frames in (8, 35):
        process = start(config, output, *(["--resume"] if output.exists() else []))
        wait_for_size(output / "trajectory.dcd", 276 + frames * frame, process)
        process.kill()
        assert finish(process)[0] == -signal.SIGKILL
        assert (output / "checkpoint.chk").exists()
    assert main(["run", config, "--output", str(output), "--resume"]) == 0
    assert "Resuming at step" in capsys.readouterr().out
    assert_same_run(output, unbroken)


@pytest.fixture(scope="module")
def killed(tmp_path_factory):
    """A directory with a checkpoint and what came after it, as a kill leaves it."""
    folder = tmp_path_factory.mktemp("killed")
    process = start(configured(folder), folder / "out")
    wait_for_size(folder / "out" / "trajectory.dcd", 276 + 14 * 3 * (4 * 26 + 8), process)
    process.kill()
    process.communicate()
    return folder


@pytest.fixture
def halfway(tmp_path, killed):
    """A copy of it."""
    shutil.copytree(killed, tmp_path / "killed")
    return tmp_path / "killed" / "out"


@pytest.mark.sample(r"^(?!energies\.csv-\\n|trajectory\.dcd-h.+)")
@pytest.mark.parametrize(
    ("file", "rest"),
    [
        ("trajectory.dcd", b"\x68\x00\x00\x00" + b"\x01" * 50),
        ("trajectory.dcd", b"\x68"),
        ("energies.csv", b"260,26000"),
        ("energies.csv", b"\n"),
        ("checkpoint.chk.new", b'{"format": "openmm'),
        ("topology.cif.new", b"data_"),
    ],
)
def test_partial_writes_are_cut_off(halfway, unbroken, file, rest):
    with open(halfway / file, "ab") as target:
        target.write(rest)
    assert main(["run", str(halfway.parent / "input.toml"), "--output", str(halfway), "--resume"]) == 0
    assert_same_run(halfway, unbroken)


@pytest.mark.parametrize(
    "left", [(), ("configuration.toml",), ("configuration.toml", "topology.cif", "trajectory.dcd")]
)
def test_resume_before_the_first_checkpoint_starts_again(tmp_path, unbroken, left, capsys):
    output = tmp_path / "out"
    output.mkdir()
    for name in left:
        shutil.copy(unbroken / name, output)
    assert main(["run", configured(tmp_path), "--output", str(output), "--resume"]) == 0
    assert "starting from the beginning" in capsys.readouterr().out
    assert_same_run(output, unbroken)


def copied(unbroken, tmp_path):
    shutil.copytree(unbroken, tmp_path / "out")
    return str(tmp_path / "out")


def test_resume_of_a_finished_run_redoes_the_summary(tmp_path, unbroken, capsys):
    output = copied(unbroken, tmp_path)
    os.remove(os.path.join(output, "summary.json"))
    assert main(["run", configured(tmp_path), "--output", output, "--resume"]) == 0
    assert "finished" in capsys.readouterr().out
    assert_same_run(tmp_path / "out", unbroken)
    assert (tmp_path / "out" / "summary.json").read_text() == (unbroken / "summary.json").read_text()


def assert_refused(arguments, capsys, *fragments, code=2):
    assert main(arguments) == code
    errors = capsys.readouterr().err
    assert errors.startswith("error: ") and "Traceback" not in errors
    for fragment in fragments:
        assert fragment in errors


def test_resume_with_another_configuration_is_refused(tmp_path, unbroken, capsys):
    output = copied(unbroken, tmp_path)
    config = configured(tmp_path, seed=6, count=2)
    assert_refused(
        ["run", config, "--output", output, "--resume"], capsys, "[simulation] seed", "[[filament]] number 1: count"
    )
    # A comment changes nothing.
    assert main(["run", configured(tmp_path, SHORT + "# comment\n"), "--output", output, "--resume"]) == 0


def test_tables_in_other_units_are_refused(tmp_path, unbroken, capsys):
    out = tmp_path / "out"
    shutil.copytree(unbroken, out)
    table = out / "energies.csv"
    size = table.stat().st_size
    table.write_text(table.read_text().replace("time (ms)", "time (ps)"))
    with pytest.raises(InputError, match=r"energies.csv was written by another version.*'step,time \(ps\),stretching"):
        analysis.load(out)
    with pytest.raises(InputError, match="another version"):
        ReportTable(table, size)
    with pytest.raises(InputError, match="another version"):
        size_of_lines(table, 20)
    assert main(["run", str(out / "configuration.toml"), "--output", str(out), "--resume"]) == 2
    assert "but now 'step,time (ms),stretching energy (pN nm)" in capsys.readouterr().err


def test_directory_of_a_run_is_refused_without_resume(tmp_path, unbroken, capsys):
    output = copied(unbroken, tmp_path)
    before = (tmp_path / "out" / "trajectory.dcd").read_bytes()
    assert_refused(["run", configured(tmp_path), "--output", output], capsys, "already holds a run", "--resume")
    assert (tmp_path / "out" / "trajectory.dcd").read_bytes() == before
    os.remove(os.path.join(output, "configuration.toml"))
    assert_refused(["run", configured(tmp_path), "--output", output, "--resume"], capsys, "no configuration.toml")


def test_damaged_run_is_refused(tmp_path, unbroken, capsys):
    output = copied(unbroken, tmp_path)
    arguments = ["run", configured(tmp_path), "--output", output, "--resume"]
    checkpoint = tmp_path / "out" / "checkpoint.chk"
    content = checkpoint.read_bytes()
    checkpoint.write_bytes(content[:-1])
    assert_refused(arguments, capsys, "checkpoint.chk is damaged")
    checkpoint.write_bytes(re.sub(rb'"version": "[^"]*"', b'"version": "0.0.1"', content))
    assert_refused(arguments, capsys, "started with openmm_cylchain 0.0.1")
    checkpoint.write_bytes(resealed(content, engine="other", step=1140))
    assert_refused(arguments, capsys, "started with the other engine")
    checkpoint.write_bytes(resealed(content, step=1140))
    with open(tmp_path / "out" / "trajectory.dcd", "r+b") as file:
        file.truncate(1000)
    assert_refused(arguments, capsys, "trajectory.dcd is missing or shorter")


@pytest.mark.parametrize(
    ("name", "value"),
    [
        *(("step", value) for value in (-1, 0, 1140, 10**9)),
        *((f"{file}_size", value) for file in ("energies", "trajectory", "linkers") for value in (-1, 7, 10**9)),
        ("linker_records", 3),
        ("trajectory_header", ""),
        ("state_size", 5),
        ("configuration", "0" * 64),
        ("digest", "0" * 64),
        ("digest", None),
    ],
)
def test_checkpoint_that_was_edited_is_refused(tmp_path, unbroken, capsys, name, value):
    output = copied(unbroken, tmp_path)
    checkpoint = tmp_path / "out" / "checkpoint.chk"
    line, _, state = checkpoint.read_bytes().partition(b"\n")
    checkpoint.write_bytes(json.dumps({**json.loads(line), name: value}).encode() + b"\n" + state)
    before = (tmp_path / "out" / "trajectory.dcd").read_bytes()
    assert_refused(["run", configured(tmp_path), "--output", output, "--resume"], capsys, "checkpoint.chk is damaged")
    assert (tmp_path / "out" / "trajectory.dcd").read_bytes() == before


@pytest.mark.parametrize(
    ("old", "new"), [("310 K", "600 K"), ("seed = 5", "seed = 6"), ("[solvent]", "# a\n[solvent]")]
)
def test_configuration_of_a_run_that_was_edited_is_refused(tmp_path, unbroken, capsys, old, new):
    """In its directory, and what is given with it."""
    output = copied(unbroken, tmp_path)
    edited = SHORT.replace(old, new)
    (tmp_path / "out" / "configuration.toml").write_text(edited)
    config = configured(tmp_path, edited)
    assert_refused(["run", config, "--output", output, "--resume"], capsys, "configuration.toml has been changed")
    (tmp_path / "out" / "configuration.toml").write_text(SHORT)
    assert main(["run", configured(tmp_path), "--output", output, "--resume"]) == 0


def test_configuration_that_is_edited_while_the_run_goes_on_is_refused(tmp_path, capsys, monkeypatch):
    output = tmp_path / "out"
    edited = SHORT.replace("310 K", "311 K")
    config = configured(tmp_path)
    step = app.Simulation.step

    def edit(simulation, steps):
        (output / "configuration.toml").write_text(edited)
        step(simulation, steps)

    monkeypatch.setattr(app.Simulation, "step", edit)
    run(read_configuration(config), output)
    config = configured(tmp_path, edited)
    assert_refused(["run", config, "--output", str(output), "--resume"], capsys, "configuration.toml has been changed")


def test_directory_that_is_removed_cannot_be_resumed(tmp_path, capsys, monkeypatch):
    output = tmp_path / "out"

    def step(simulation, steps):
        shutil.rmtree(output)

    monkeypatch.setattr(app.Simulation, "step", step)
    config = configured(tmp_path, duration='"0.2 us"', checkpoint_interval='"0.2 us"')
    assert main(["run", config, "--output", str(output)]) == 1
    errors = capsys.readouterr().err
    assert "out has been removed while the run went on. Start it again" in errors and "--resume" not in errors


def test_title_may_be_anything_on_one_line(tmp_path, capsys):
    short = SHORT.replace('"12 us"', '"0.4 us"').replace('"0.6 us"', '"0.4 us"')
    # With an even number of "$", matplotlib would take a title for mathematics.
    for number, title in enumerate((r"$x^$ \frac{ a_b^c", r"${x <&> \frac{ a_b^c")):
        config = configured(tmp_path, short.replace('"short"', f"'{title}'"))
        with rendered():
            assert main(["run", config, "--output", str(tmp_path / str(number))]) == 0
        assert (tmp_path / str(number) / "summary.png").stat().st_size > 10000
    config = configured(tmp_path, short.replace('"short"', r'"two\nlines"'))
    assert_refused(["run", config, "--output", str(tmp_path / "no")], capsys, "line 2: title must be one line")


def test_output_that_is_a_file_is_refused(tmp_path, capsys):
    (tmp_path / "out").write_text("")
    assert_refused(["run", configured(tmp_path), "--output", str(tmp_path / "out")], capsys, "is a file")


def test_two_runs_in_one_directory_are_refused(tmp_path, capsys):
    config = configured(tmp_path)
    with RunDirectory(tmp_path / "out"):
        assert_refused(["run", config, "--output", str(tmp_path / "out")], capsys, "Another run is writing")
        code, _, errors = finish(start(config, tmp_path / "out"))
        assert code == 2 and "Another run is writing" in errors


@pytest.mark.skipif(os.name != "posix", reason="signals of POSIX")
@pytest.mark.parametrize(("number", "code"), [(signal.SIGTERM, 143), (signal.SIGINT, 130)])
def test_signals_end_a_run_with_a_checkpoint(tmp_path, unbroken, number, code):
    output = tmp_path / "out"
    # No checkpoint is due before the end: the one that is found is due to the signal.
    text = configured(tmp_path, checkpoint_interval='"12 us"')
    process = start(text, output)
    wait_for_size(output / "trajectory.dcd", 276 + 8 * 3 * (4 * 26 + 8), process)
    process.send_signal(number)
    returned, _, errors = finish(process)
    assert returned == code
    assert "--resume" in errors and "Traceback" not in errors
    assert main(["run", text, "--output", str(output), "--resume"]) == 0
    assert_same_run(output, unbroken)


@pytest.mark.skipif(os.name != "posix", reason="pipes of POSIX")
def test_output_that_nobody_reads_ends_a_run_which_goes_on_with_resume(tmp_path, unbroken):
    output, text = tmp_path / "out", configured(tmp_path)
    process = start(text, output)
    process.stdout.close()
    errors = process.stderr.read()
    assert process.wait(timeout=60) == 141
    assert errors.count("error: ") == 1 and "--resume" in errors and "Exception" not in errors, errors
    assert main(["run", text, "--output", str(output), "--resume"]) == 0
    assert_same_run(output, unbroken)


@pytest.mark.skipif(os.name != "posix", reason="pipes of POSIX")
def test_output_that_nobody_reads_is_no_error(tmp_path):
    process = subprocess.Popen([*COMMAND[:-1], "schema"], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    process.stdout.close()
    assert process.stderr.read() == ""
    assert process.wait(timeout=60) == 141


def test_blow_up_is_reported_and_leaves_no_broken_frame(tmp_path, capsys):
    config = configured(
        tmp_path,
        scheme='"midpoint"',
        time_step='"400 ns"',
        duration='"80 us"',
        report_interval='"0.4 us"',
        checkpoint_interval='"0.4 us"',
    )
    output = tmp_path / "out"
    assert main(["run", config, "--output", str(output)]) == 1
    errors = capsys.readouterr().err
    assert "warning: A time step of 400 ns exceeds the stretching bound" in errors
    assert re.search(r"error: \S+, line \d+: Filament \d \(ACT\) has blown up at segment \d in step \d+", errors)
    assert "another directory" in errors and "Traceback" not in errors
    trajectory = mdtraj.load_dcd(str(output / "trajectory.dcd"), top=str(output / "topology.cif"))
    assert 1 <= trajectory.n_frames < 200
    assert np.all(np.isfinite(trajectory.xyz))
    energies = read_table(output / "energies.csv")
    assert len(energies["step"]) == trajectory.n_frames
    assert all(np.all(np.isfinite(column)) for column in energies.values())


def test_infinite_energy_is_not_written(tmp_path, capsys):
    # A FENE segment that a large step carries beyond its maximum extension, at finite positions: the engine stops.
    text = SHORT.replace("segments = 6", 'segments = 6\nstretching_model = "fene"\nmaximum_extension = "1 nm"')
    config = configured(
        tmp_path,
        text,
        scheme='"midpoint"',
        time_step='"60 ns"',
        duration='"60 us"',
        report_interval='"60 ns"',
        checkpoint_interval='"6 us"',
    )
    output = tmp_path / "out"
    assert main(["run", config, "--output", str(output)]) == 1
    assert re.search(
        r"error: \S+, line \d+: Filament \d \(ACT\) has blown up at segment \d in step \d+", capsys.readouterr().err
    )
    energies = read_table(output / "energies.csv")
    assert all(np.all(np.isfinite(column)) for column in energies.values())


@pytest.mark.parametrize("moved", [[0.0, 0.0, 2.0], [0.0, 0.0, np.nan]], ids=["beyond its range", "not a number"])
def test_configuration_without_an_energy_is_traced_to_its_segment(tmp_path, monkeypatch, capsys, moved):
    """Where an engine has not stopped before."""
    text = SHORT.replace(
        'start = "straight"',
        'start = "straight"\ndirection = [0, 0, 1]\nstretching_model = "fene"\nmaximum_extension = "1 nm"',
    )

    def step(simulation, steps):
        positions = positions_of(simulation.context)
        # The last node of the last filament, whose fourth segment it ends.
        positions[-1] += moved
        simulation.context.setPositions(positions)

    monkeypatch.setattr(app.Simulation, "step", step)
    assert main(["run", configured(tmp_path, text), "--output", str(tmp_path / "out")]) == 1
    error = capsys.readouterr().err
    assert "Filament 3 (ACT) has blown up at segment 3 by step" in error and "its position or energy is not" in error
    assert np.all(np.isfinite(read_table(tmp_path / "out" / "energies.csv")["stretching energy (pN nm)"]))


@pytest.mark.parametrize(
    ("changes", "fragment"),
    [
        ({"platform": '"Abacus"'}, "Reference"),
        ({"precision": '"single"'}, "precision cannot be chosen on the platform Reference"),
        ({"temperature": '"310 m"'}, "[solvent] temperature"),
    ],
)
def test_wrong_input_leaves_no_directory(tmp_path, capsys, changes, fragment):
    config = configured(tmp_path, **changes)
    assert_refused(["run", config, "--output", str(tmp_path / "out")], capsys, fragment)
    assert not (tmp_path / "out").exists()


def test_filaments_are_laid_out_side_by_side():
    configuration = parse_configuration(SHORT.replace("count = 3", "count = 15"))
    filaments = placed_filaments(configuration)
    centers = np.array([f.positions.mean(axis=0) for f in filaments])
    distances = np.linalg.norm(centers[:, None] - centers[None], axis=-1)
    extent = max(np.linalg.norm(f.positions - c, axis=1).max() for f, c in zip(filaments, centers))
    assert distances[~np.eye(16, dtype=bool)].min() > extent
    np.testing.assert_allclose(centers.mean(axis=0), 0.0, atol=1e-6)
    # Every filament has a shape of its own.
    assert not np.allclose(filaments[0].positions - centers[0], filaments[1].positions - centers[1])


def test_position_and_direction_are_those_of_the_first_node_and_segment():
    text = SHORT.replace("count = 3", 'count = 2\nposition = ["1 nm", "2 nm", "3 nm"]\ndirection = [0, 3, 0]')
    first, second, _ = placed_filaments(parse_configuration(text))
    for filament in (first, second):
        np.testing.assert_allclose(filament.positions[0], (1.0, 2.0, 3.0))
        tangent = filament.positions[1] - filament.positions[0]
        np.testing.assert_allclose(tangent / np.linalg.norm(tangent), (0.0, 1.0, 0.0), atol=1e-12)
    assert not np.allclose(first.positions, second.positions)


def test_timestep_explains_the_bounds(tmp_path, capsys):
    assert main(["timestep", configured(tmp_path, scheme='"midpoint"')]) == 0
    text = capsys.readouterr().out
    assert "eq. (57)" in text and "200 ns" in text
    assert re.search(r"allowed by stretching +10 ns", text) and "allowed by turning" in text
    assert re.search(r"recommended +10 ns", text)
    assert main(["timestep", configured(tmp_path, scheme='"implicit"')]) == 0
    text = capsys.readouterr().out
    assert re.search(r"recommended +[0-9.]+ us", text) and "relaxation of the whole filament" in text
    assert re.search(r"dynamics at that step: modes of bending that relax in [0-9.]+ [a-z]+ or longer", text)


def test_version(capsys):
    with pytest.raises(SystemExit) as caught:
        main(["--version"])
    assert caught.value.code == 0
    assert capsys.readouterr().out.startswith("openmm-cylchain ")


@pytest.mark.slow
@pytest.mark.skipif(why_not_on("OpenCL") is not None, reason=f"OpenCL: {why_not_on('OpenCL')}")
def test_a_file_turns_on_the_platform_that_it_names(tmp_path, unbroken):
    """In a process of its own, because that lasts until it ends."""
    config = configured(
        tmp_path, SHORT.replace("[simulation]", '[simulation]\nplatform = "OpenCL"\nprecision = "double"')
    )
    code, _, errors = finish(start(config, tmp_path / "out"))
    assert code == 0, errors
    runs = [
        mdtraj.load_dcd(str(path / "trajectory.dcd"), top=str(path / "topology.cif")).xyz
        for path in (tmp_path / "out", unbroken)
    ]
    np.testing.assert_allclose(runs[0], runs[1], rtol=1e-5, atol=1e-3)


@pytest.mark.parametrize(("distance", "compared"), [("1 m", 0), ("1 mm", 5), ("1 um", 6)])
def test_what_a_trajectory_is_too_coarse_for_is_not_compared(tmp_path, distance, compared):
    text = SHORT[: SHORT.index("[[filament]]", 100)] + SHORT[SHORT.index("[simulation]") :]
    text = text.replace("count = 3", f'position = ["0 nm", "{distance}", "0 nm"]')
    configuration = read_configuration(configured(tmp_path, text))
    run(configuration, tmp_path / "out")
    (group,) = summarise(configuration, load_trajectory(configuration, RunDirectory(tmp_path / "out")))
    verdicts = {own.name: own.verdict for own in group.observables if own.verdict != "reference"}
    assert sum(verdict != "not comparable" for verdict in verdicts.values()) == compared
    assert (verdicts["stretching energy per segment"] == "not comparable") == (compared < 6)
    said = [note for note in group.notes if "single precision" in note]
    assert len(said) == (compared < 6)
    if said:
        assert ("nothing is compared" if compared == 0 else "it is not compared") in said[0]
        assert not any("Not in equilibrium" in note for note in group.notes) or compared > 0
    energies = read_table(tmp_path / "out" / "energies.csv")
    assert np.all(energies["stretching energy per segment (kT)"] < 4.0)


def test_freely_jointed_and_single_segments_have_a_summary(tmp_path):
    text = SHORT.replace("segments = 6", 'segments = 3\nbending_rigidity = "0 pN*nm^2"').replace(
        "segments = 4", "segments = 1"
    )
    config = configured(tmp_path, text, duration='"1 us"')
    assert main(["run", config, "--output", str(tmp_path / "out")]) == 0
    jointed, single = json.loads((tmp_path / "out" / "summary.json").read_text())["groups"]
    assert "bending energy per joint" not in {o["name"] for o in jointed["observables"]}
    assert "cosine of joint angle" not in {o["name"] for o in single["observables"]}
    config = configured(
        tmp_path,
        SHORT.split('[[filament]]\ntype = "F_ACTIN"\nsegments = 4')[0] + "[simulation]\n",
        segments=1,
        time_step='"10 ns"',
        duration='"1 us"',
        report_interval='"0.2 us"',
    )
    assert main(["run", config, "--output", str(tmp_path / "single")]) == 0
    column = read_table(tmp_path / "single" / "energies.csv")["bending energy per joint (kT)"]
    assert all(math.isnan(value) for value in column)


def test_run_as_a_function_raises(tmp_path):
    configuration = parse_configuration(SHORT)
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "energies.csv").write_text("")
    with pytest.raises(InputError, match="already holds a run"):
        run(configuration, tmp_path / "out")
