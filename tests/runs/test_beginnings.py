"""Configurations to begin with, dry runs, and a run with everything that is killed and resumed."""

import re
import signal

import numpy as np
import pytest

from openmm_cylchain.cli import main
from openmm_cylchain.output.read_tables import read_table
from openmm_cylchain.runs.beginnings import START_NAMES, start_text
from openmm_cylchain.runs.configuration import parse_configuration, read_configuration
from openmm_cylchain.runs.initial_state import build_system
from openmm_cylchain.runs.run import run
from support.checkpoints import resealed
from support.commands import finish, start, wait_for_size
from support.configurations import BODIES, COMING_AND_GOING, ENDS, EVERYTHING, GROWING


@pytest.mark.parametrize("kind", START_NAMES)
def test_new_configurations_run(tmp_path, kind, monkeypatch, capsys):
    """As they are written, but for few steps; each says what it does, and the command how to run it."""
    monkeypatch.chdir(tmp_path)
    assert main(["new", kind]) == 0
    assert f"openmm-cylchain run {kind}.toml --output {kind}" in capsys.readouterr().out
    text = (tmp_path / f"{kind}.toml").read_text()
    assert text == start_text(kind) and text.count("#") >= 5
    configuration = read_configuration(f"{kind}.toml")
    settings = configuration.simulation
    report = settings.steps_per_report * settings.time_step
    assert settings.steps // settings.steps_per_report >= 40
    # A few steps: two reports of as many steps as keep the test short.
    few = max(1, settings.steps_per_report // 40) * settings.time_step
    short = re.sub(r"(?m)^duration = .*$", f'duration = "{2 * few!r} ps"', text)
    short = re.sub(r"(?m)^report_interval = .*$", f'report_interval = "{few!r} ps"', short)
    short = re.sub(r"(?m)^time_step = .*$", f'time_step = "{settings.time_step!r} ps"', short)
    short = re.sub(r"(?m)^pieces = \d+", "pieces = 2", short)
    assert few <= report
    (tmp_path / "short.toml").write_text(short)
    assert main(["run", "short.toml", "--output", "out"]) == 0
    assert "warning" not in capsys.readouterr().err
    assert all(np.all(np.isfinite(column)) for column in read_table(tmp_path / "out" / "energies.csv").values())


def test_new_does_not_overwrite(tmp_path, capsys):
    path = tmp_path / "mine.toml"
    assert main(["new", "treadmilling", str(path)]) == 0
    assert "render mine --film --output mine.gif\n" in path.read_text()
    path.unlink()
    assert main(["new", "dna", str(path)]) == 0
    assert "run mine.toml --output mine\n" in path.read_text()
    path.write_text("x")
    assert main(["new", "dna", str(path)]) == 2
    assert "mine.toml exists already" in capsys.readouterr().err
    assert path.read_text() == "x"
    assert main(["new", "dna", str(tmp_path / "no" / "x.toml")]) == 2
    with pytest.raises(SystemExit):
        main(["new", "protein"])


def test_dry_run(tmp_path, capsys):
    path = tmp_path / "all.toml"
    path.write_text(EVERYTHING)
    assert main(["run", str(path), "--dry-run"]) == 0
    said = capsys.readouterr().out
    built = build_system(parse_configuration(EVERYTHING), None, 2)
    assert f"9 filaments, 58 segments, {built.system.getNumParticles()} particles" in said
    assert f"{built.links} links" in said and "20 linkers: alpha-actinin" in said and "3 × COL, 50 nm" in said
    for force in built.system.getForces():
        assert force.getName() in said
    assert "200 steps of 10 us, scheme implicit, compiled engine, platform CPU" in said
    assert re.search(r"recommended [0-9.]+ [a-z]+: relaxation of the whole filament", said)
    assert re.search(r"about [0-9.e-]+ seconds for steps and reports: [0-9.e-]+ ms a step at first", said)
    assert list(tmp_path.iterdir()) == [path]
    # The size of the trajectory is right to the digits given.
    run(parse_configuration(EVERYTHING), tmp_path / "out")
    size = (tmp_path / "out" / "trajectory.dcd").stat().st_size
    assert f"21 frames, every 100 us: trajectory of {size / 1e3:.3g} kB" in said
    assert main(["run", str(path)]) == 2
    assert "--output DIR" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("text", "tables"),
    [
        (EVERYTHING, ("energies.csv", "linkers.csv", "linkers.npy", "wall_forces.csv", "contact_forces.csv")),
        (
            GROWING,
            ("energies.csv", "growth.csv", "linkers.csv", "linkers.npy", "wall_forces.csv", "contact_forces.csv"),
        ),
        (
            COMING_AND_GOING,
            ("energies.csv", "growth.csv", "linkers.csv", "linkers.npy", "wall_forces.csv", "contact_forces.csv"),
        ),
        (ENDS, ("energies.csv", "growth.csv", "linkers.csv", "linkers.npy")),
        (
            BODIES,
            ("energies.csv", "growth.csv", "linkers.csv", "linkers.npy", "wall_forces.csv", "contact_forces.csv"),
        ),
    ],
    ids=["everything", "growing", "coming and going", "ends", "bodies"],
)
def test_run_with_everything_is_resumed_to_the_bit(tmp_path, text, tables):
    (tmp_path / "all.toml").write_text(text)
    configuration = parse_configuration(text)
    run(configuration, tmp_path / "one")
    output = tmp_path / "two"
    frame = ((tmp_path / "one" / "trajectory.dcd").stat().st_size - 276) // 21
    process = start(str(tmp_path / "all.toml"), output)
    wait_for_size(output / "trajectory.dcd", 276 + 8 * frame, process)
    process.kill()
    assert finish(process)[0] == -signal.SIGKILL
    # What a kill may leave half written.
    for name in tables:
        with open(output / name, "ab") as file:
            file.write(b"1")
    run(configuration, output, resume=True)
    for name in ("trajectory.dcd", *tables):
        contents = [(tmp_path / folder / name).read_bytes() for folder in ("one", "two")]
        assert contents[0] == contents[1], name


def test_runs_whose_files_were_cut_off_are_not_resumed(tmp_path, capsys):
    """By a single byte, whichever of them: nothing is filled up. Whole again, they are."""
    run(parse_configuration(EVERYTHING), tmp_path / "out")
    arguments = ["run", str(tmp_path / "out" / "configuration.toml"), "--output", str(tmp_path / "out"), "--resume"]
    checkpoint = tmp_path / "out" / "checkpoint.chk"
    checkpoint.write_bytes(resealed(checkpoint.read_bytes(), step=190))
    names = ("trajectory.dcd", "energies.csv", "linkers.csv", "linkers.npy", "pulling.csv", "crosslinks.npy")
    names += ("wall_forces.csv", "contact_forces.csv")
    for name in names:
        path = tmp_path / "out" / name
        whole = path.read_bytes()
        path.write_bytes(whole[:-1])
        assert main(arguments) == 2, name
        errors = capsys.readouterr().err
        assert errors.startswith("error: ") and name in errors and "Traceback" not in errors
        assert path.read_bytes() == whole[:-1], name
        path.write_bytes(whole)
    # Without a summary: the step of this checkpoint is not that of its state.
    run(parse_configuration(EVERYTHING), tmp_path / "out", resume=True)
