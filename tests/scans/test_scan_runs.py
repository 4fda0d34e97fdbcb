"""Scans that are run: tables over replicas, what is done is not done again, and what was killed goes on."""

import concurrent.futures
import csv
import itertools
import json
import math
import os
import shutil
import signal
import subprocess
import sys
import time

import numpy as np
import pytest
from PIL import Image

from openmm_cylchain import InputError
from openmm_cylchain.cli import main
from openmm_cylchain.scans import read_scan, scan
from openmm_cylchain.scans.grid import written
from openmm_cylchain.scans.one_run import LOG, Task, perform
from openmm_cylchain.scans.scan_figure import write_scan_figure

RUN = """
[solvent]
temperature = "310 K"
viscosity = "1.71 mPa*s"
[[filament]]
type = "F_ACTIN"
segments = 4
count = 8
[simulation]
time_step = "10 us"
duration = "DURATION"
report_interval = "0.1 ms"
checkpoint_interval = "0.1 ms"
"""
TWO_RUNS = """
[scan]
base = "run.toml"
replicas = 2
gather = ["mean square end-to-end distance", "persistence length"]
"""
VARIED = """
[vary]
solvent.temperature = ["280 K", "300 K"]
filament.segments = [4, 8, 16]
"""
RESULTS = ("trajectory.dcd", "energies.csv", "configuration.toml")


def files_of(folder, duration="1 ms", text=TWO_RUNS):
    (folder / "run.toml").write_text(RUN.replace("DURATION", duration))
    (folder / "scan.toml").write_text(text)
    return folder / "scan.toml"


def rows_of(path):
    with open(path, newline="") as file:
        return list(csv.DictReader(file))


def test_a_scan_and_what_is_done_of_it(tmp_path, capsys):
    """All of it in one test, because each run takes seconds to start."""
    path, said = files_of(tmp_path), []
    result = scan(path, tmp_path / "out", workers=2, say=said.append)
    assert_tables_are_those_of_summaries(result, said)
    assert_that_nothing_is_run_again(path, result, capsys)
    assert_that_a_changed_configuration_is_refused(path, result)


def assert_tables_are_those_of_summaries(result, said):
    assert said[0] == "Scan of 2 runs: 0 done before, 2 to do, 2 at a time."
    assert sum(" done in " in line for line in said) == 2 and result.is_complete
    rows = rows_of(result.path / "runs.csv")
    assert [row["replica"] for row in rows] == ["1", "2"] and len({row["seed"] for row in rows}) == 2
    name = "mean square end-to-end distance"
    values, theories = [], []
    for row in rows:
        summary = json.loads((result.path / row["directory"] / "summary.json").read_text())
        (observable,) = [own for own in summary["groups"][0]["observables"] if own["name"] == name]
        assert float(row[f"ACT: {name} (nm^2)"]) == observable["value"]
        assert float(row[f"ACT: {name} (nm^2), standard error"]) == observable["standard_error"]
        values.append(observable["value"])
        theories.append(observable["theory"])
    mean, persistence = rows_of(result.path / "results.csv")
    assert (mean["of"], mean["quantity"], mean["unit"], mean["replicas"]) == ("ACT", name, "nm^2", "2")
    assert float(mean["mean"]) == pytest.approx(np.mean(values), rel=1e-12)
    assert float(mean["standard error"]) == pytest.approx(abs(values[0] - values[1]) / 2.0, rel=1e-9)
    assert float(mean["theory"]) == pytest.approx(theories[0]) and persistence["quantity"] == "persistence length"
    assert values[0] != values[1]
    assert (result.path / "scan.png").stat().st_size > 5000


def assert_that_nothing_is_run_again(path, result, capsys):
    times = {file: file.stat().st_mtime_ns for file in result.path.glob("runs/*/*")}
    assert main(["scan", str(path), "--output", str(result.path)]) == 0
    assert "Scan of 2 runs: 2 done before, 0 to do." in capsys.readouterr().out
    assert {file: file.stat().st_mtime_ns for file in result.path.glob("runs/*/*")} == times


def assert_that_a_changed_configuration_is_refused(path, result):
    changed = next(result.path.glob("runs/*/configuration.toml"))
    changed.write_text(changed.read_text().replace("310 K", "600 K"))
    with pytest.raises(InputError, match="configuration.toml has been changed"):
        scan(path, result.path)


def test_the_legend_of_the_figure_is_within_it(tmp_path):
    scan_of_two = read_scan(files_of(tmp_path, text=TWO_RUNS + VARIED))
    rows = [
        {
            **{axis.label: written(value) for axis, value in zip(scan_of_two.axes, point)},
            **{"of": "ACT", "quantity": "persistence length", "unit": "nm", "mean": 1.0, "standard error": 0.1},
            "theory": 1.0,
        }
        for point in itertools.product(*(axis.values for axis in scan_of_two.axes))
    ]
    write_scan_figure(tmp_path / "scan.png", scan_of_two, rows)
    image = np.asarray(Image.open(tmp_path / "scan.png").convert("L"))
    lowest = image[int(0.8 * len(image)) :]
    assert np.mean(lowest < 128) > 0.005
    assert np.all(lowest[:, :8] > 200) and np.all(lowest[:, -8:] > 200)


def test_dry_run_and_wrong_options(tmp_path, capsys):
    path = str(files_of(tmp_path))
    assert main(["scan", path, "--dry-run"]) == 0
    assert capsys.readouterr().out.endswith("2 runs\n")
    for options, message in (
        ([], "--output DIR"),
        (["--output", path], "is a file"),
        (["--output", str(tmp_path), "--workers", "0"], "workers must be at least 1"),
        (["--output", str(tmp_path), "--executor", "dask"], "--scheduler ADDRESS"),
        (["--output", str(tmp_path), "--workers", "2", "--executor", "mpi"], "has workers of its own"),
    ):
        assert main(["scan", path, *options]) == 2
        assert message in capsys.readouterr().err
    with pytest.raises(InputError, match="executor must be one of concurrent.futures"):
        scan(path, tmp_path, executor=3)


def assert_same_runs(first, second):
    for run in read_scan(first.parent / "scan.toml").runs:
        for name in RESULTS:
            contents = [(path / "runs" / run.name / name).read_bytes() for path in (first, second)]
            assert contents[0] == contents[1] != b"", (run.label, name)


@pytest.fixture(scope="module")
def unbroken(tmp_path_factory):
    folder = tmp_path_factory.mktemp("unbroken")
    return scan(files_of(folder, "20 ms"), folder / "out", workers=2, say=lambda line: None).path


def wait_for(condition):
    deadline = time.monotonic() + 60
    while not condition():
        assert time.monotonic() < deadline
        time.sleep(0.005)


@pytest.mark.slow
def test_killed_halfway_and_started_again(tmp_path, unbroken):
    """The scan is killed, and its runs end with it; started again, it ends with the same files, to the bit."""
    path, output = files_of(tmp_path, "20 ms"), tmp_path / "out"
    command = [sys.executable, "-m", "openmm_cylchain.cli", "scan", str(path), "--output", str(output)]
    process = subprocess.Popen([*command, "--workers", "1"], cwd=tmp_path, stdout=subprocess.DEVNULL)
    wait_for(lambda: [*output.glob("runs/*/checkpoint.chk")])
    process.send_signal(signal.SIGKILL)
    process.wait()
    finished = subprocess.run([*command, "--workers", "2"], cwd=tmp_path, capture_output=True, text=True, timeout=120)
    assert finished.returncode == 0, finished.stdout + finished.stderr
    assert "Scan of 2 runs: 0 done before, 2 to do" in finished.stdout
    (log,) = [own for own in output.glob("runs/*/log.txt") if "Resuming at step" in own.read_text()]
    assert "Interrupted at step" in log.read_text()
    assert_same_runs(output, unbroken)


@pytest.mark.exhaustive
def test_a_run_that_died_goes_on(tmp_path, unbroken):
    path, output, said = files_of(tmp_path, "20 ms"), tmp_path / "out", []
    with concurrent.futures.ThreadPoolExecutor(1) as pool:
        future = pool.submit(scan, path, output, None, 1, said.append)
        wait_for(lambda: [*output.glob("runs/*/checkpoint.chk")])
        (directory,) = [own.parent for own in output.glob("runs/*/checkpoint.chk")]
        processes = [int(name) for name in os.listdir("/proc") if name.isdigit()]
        (victim,) = [number for number in processes if is_run_in(number, directory)]
        os.kill(victim, signal.SIGKILL)
        assert future.result().is_complete
    assert any("started 2 times" in line for line in said)
    assert_same_runs(output, unbroken)


def is_run_in(number, directory):
    try:
        command = open(f"/proc/{number}/cmdline").read()
        return "one_run" in command and os.readlink(f"/proc/{number}/cwd") == str(directory)
    except OSError:
        return False


def test_errors_of_runs_name_their_file_and_line(tmp_path):
    """A run that ends before its first step leaves its configuration, too."""
    text = RUN.replace("DURATION", "1 ms") + 'platform = "no platform"\n'
    outcome = perform(Task(text, str(tmp_path), str(tmp_path / "out"), attempts=1))
    file = tmp_path / "out" / "configuration.toml"
    assert file.read_text() == text
    line = len(text.splitlines())
    assert outcome.reason.startswith(f"{file}, line {line}: [simulation] platform must be one of those that OpenMM has")


@pytest.mark.slow
def test_failures_are_named_and_the_others_gathered(tmp_path, capsys):
    text = TWO_RUNS.replace("replicas = 2", "replicas = 1") + '[vary]\nsimulation.time_step = ["0.1 us", "100 us"]\n'
    path = files_of(tmp_path, text=f"{text}simulation.scheme = ['midpoint']\n")
    assert main(["scan", str(path), "--output", str(tmp_path / "out")]) == 1
    said = capsys.readouterr().out
    assert "failed:" in said and "blown up" in said and "Not complete: " in said
    statuses = [row["status"] for row in rows_of(tmp_path / "out" / "runs.csv")]
    assert "failed" in statuses


@pytest.mark.parametrize(
    ("setting", "threads"), [("", "2 threads"), pytest.param("threads = 1", "1 thread", marks=pytest.mark.slow)]
)
def test_threads_of_a_run_elsewhere(tmp_path, monkeypatch, setting, threads):
    """Those of the environment of a worker, if the file does not say how many."""
    monkeypatch.setenv("OPENMM_CPU_THREADS", "2")
    text = RUN.replace("DURATION", "0.1 ms") + f'platform = "CPU"\nseed = 1\n{setting}\n'
    outcome = perform(Task(text, str(tmp_path), str(tmp_path / "out"), attempts=1))
    assert outcome.status == "done"
    assert (tmp_path / "out" / LOG).read_text().startswith(f"On the platform CPU with {threads}.\n")


def assert_threads(path, threads):
    logs = [own.read_text() for own in path.glob(f"runs/*/{LOG}")]
    assert len(logs) == 2 and all(log.startswith(f"On the platform CPU with {threads}.\n") for log in logs)


def short_on_the_cpu(folder):
    folder.mkdir()
    path = files_of(folder)
    with open(folder / "run.toml", "a") as file:
        file.write('platform = "CPU"\n')
    return path


@pytest.mark.exhaustive
def test_dask_with_two_workers(tmp_path, unbroken, monkeypatch):
    distributed = pytest.importorskip("distributed")
    path = files_of(tmp_path, "20 ms")
    monkeypatch.setenv("OPENMM_CPU_THREADS", "3")
    with (
        distributed.LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster,
        distributed.Client(cluster) as client,
    ):
        assert len(client.scheduler_info()["workers"]) == 2
        result = scan(path, tmp_path / "out", client.get_executor(pure=False), say=lambda line: None)
        assert main(["scan", str(path), "--output", str(tmp_path / "out"), *dask(cluster)]) == 0
        short = short_on_the_cpu(tmp_path / "cpu")
        on_cpu = scan(short, tmp_path / "cpu" / "out", client.get_executor(pure=False), say=lambda line: None)
    assert result.is_complete
    assert_threads(on_cpu.path, "3 threads")
    assert_same_runs(result.path, unbroken)


def dask(cluster):
    return ["--executor", "dask", "--scheduler", cluster.scheduler_address]


@pytest.mark.exhaustive
def test_mpi_with_two_workers(tmp_path, unbroken):
    pytest.importorskip("mpi4py")
    launcher = shutil.which("mpiexec", path=f"{os.path.dirname(sys.executable)}:{os.environ['PATH']}")
    if launcher is None:
        pytest.skip("there is no mpiexec")
    path, output = files_of(tmp_path, "20 ms"), tmp_path / "out"
    command = [launcher, "-n", "3", sys.executable, "-m", "mpi4py.futures", "-m", "openmm_cylchain.cli", "scan"]
    environment = {
        **os.environ,
        "OMPI_ALLOW_RUN_AS_ROOT": "1",
        "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1",
        "PRTE_MCA_rmaps_default_mapping_policy": ":oversubscribe",
    }
    finished = subprocess.run(
        [*command, str(path), "--output", str(output), "--executor", "mpi"],
        cwd=tmp_path,
        env=environment,
        capture_output=True,
        text=True,
        timeout=300,
    )
    assert finished.returncode == 0, finished.stdout + finished.stderr
    assert finished.stdout.count(" done in ") == 2
    assert_same_runs(output, unbroken)


@pytest.mark.slow
def test_pool_of_processes(tmp_path, unbroken):
    path = files_of(tmp_path, "20 ms")
    with concurrent.futures.ProcessPoolExecutor(2) as pool:
        result = scan(path, tmp_path / "out", pool, say=lambda line: None)
    assert result.is_complete and math.isfinite(result.results[0]["mean"])
    assert_same_runs(result.path, unbroken)
