"""The scan: runs on an executor, those that are done left out, then tables and a figure of all."""

import concurrent.futures
import os
import time
from dataclasses import dataclass
from pathlib import Path

from ..errors import InputError
from ..output.files import as_path, write_atomically
from ..output.run_files import RunFiles, try_lock
from ..units.quantities import require_callable, shown, whole_number
from .one_run import Task, end_all, perform
from .scan_figure import write_scan_figure
from .scan_file import Scan, read_scan
from .scan_tables import gather, write_results, write_runs

_SECONDS_BETWEEN_LINES = 60.0


@dataclass(frozen=True)
class ScanResult:
    """What a scan has come to.

    Attributes
    ----------
    path : Path
        Its directory.
    runs : tuple of dict
        A row of ``runs.csv`` for each run: values that vary, replica, seed, status ("done", "failed", "interrupted"),
        directory, and each quantity with its standard error within the run.
    results : tuple of dict
        A row of ``results.csv`` for each quantity of each point: mean over replicas, its standard error, theory.
    """

    path: Path
    runs: tuple
    results: tuple

    @property
    def is_complete(self):
        """Whether all runs are done."""
        return all(run["status"] == "done" for run in self.runs)


def scan(configuration, output, executor=None, workers=None, say=print):
    """Do all runs of a scan that are not done yet, and gather their quantities.

    Each run is a process of its own, with a directory ``runs/NAME`` in ``output``, whose name is a digest of its
    configuration: what is there is not run again, and what was interrupted goes on from its checkpoint, whoever was
    killed. A run that dies by a signal is started again. ``runs.csv`` and ``results.csv`` have the quantities of runs
    and, over replicas, of points; ``scan.png`` draws them, with standard errors over replicas.

    Parameters
    ----------
    configuration : str, Path or Scan
        The file of a scan, or what ``read_scan`` returned.
    output : str or Path
        Directory of the scan; made if it does not exist. One that all workers reach by the same path.
    executor : concurrent.futures.Executor, optional
        Where runs are started, such as those of Dask (``client.get_executor(pure=False)``) and mpi4py
        (``MPIPoolExecutor()``). By default threads here.
    workers : int, optional
        Runs at a time without an executor; as many as there are processors if not given.
    say : callable (str)
        Told how far it is.

    Returns
    -------
    ScanResult

    Raises
    ------
    InputError
        For a scan that is none, or a directory in which another one is going on.
    """
    own = configuration if isinstance(configuration, Scan) else read_scan(configuration)
    if executor is not None and workers is not None:
        raise InputError("Give workers or an executor, which has workers of its own, not both.")
    if executor is not None and not callable(getattr(executor, "submit", None)):
        raise InputError(f"executor must be one of concurrent.futures, but is {shown(executor)}.")
    if workers is not None:
        workers = whole_number(workers, 1, "workers")
    require_callable(say, "say")
    path = as_path(output, "output").absolute()
    if path.exists() and not path.is_dir():
        raise InputError(f"The output directory {path} is a file: choose another name.")
    path.mkdir(parents=True, exist_ok=True)
    with open(path / ".lock", "a+b") as lock:
        if not try_lock(lock):
            raise InputError(f"Another scan is going on in {path}: wait until it ends, or choose another directory.")
        write_atomically(path / "scan.toml", own.text.encode())
        outcomes = _do_runs(own, path, executor, workers, say)
        return _gathered(own, path, outcomes, say)


def _do_runs(own, path, executor, workers, say):
    # The Outcome of each run that was to be done, by its name.
    left = [run for run in own.runs if not _is_done(run, path)]
    count, before = len(own.runs), len(own.runs) - len(left)
    here = executor is None
    if here:
        workers = min(workers or os.cpu_count() or 1, max(1, len(left)))
    at_a_time = f", {workers} at a time" if here and left else ""
    say(f"Scan of {count} run{'s' * (count > 1)}: {before} done before, {len(left)} to do{at_a_time}.")
    if not left:
        return {}
    threads = max(1, (os.cpu_count() or 1) // workers) if here else None
    pool = concurrent.futures.ThreadPoolExecutor(workers) if here else executor
    futures = {}
    try:
        for run in left:
            task = Task(run.text, str(own.folder.absolute()), str(_directory(run, path)), own.attempts, threads)
            futures[pool.submit(perform, task)] = run
        return _outcomes(futures, before, count, say)
    except BaseException:
        for future in futures:
            future.cancel()
        end_all()
        raise
    finally:
        if here:
            pool.shutdown()


def _outcomes(futures, before, count, say):
    outcomes, begun = {}, time.monotonic()
    waiting = set(futures)
    while waiting:
        done, waiting = concurrent.futures.wait(
            waiting, _SECONDS_BETWEEN_LINES, return_when=concurrent.futures.FIRST_COMPLETED
        )
        if not done:
            say(f"{before + len(outcomes)} of {count} runs ended, after {time.monotonic() - begun:.0f} s.")
        for future in done:
            run = futures[future]
            outcomes[run.name] = future.exception() or future.result()
            say(f"[{before + len(outcomes)}/{count}] {run.label}: {_in_words(outcomes[run.name])}")
    return outcomes


def _in_words(outcome):
    if isinstance(outcome, BaseException):
        return f"failed with its worker: {_reason(outcome)}"
    again = f", started {outcome.attempts} times" if outcome.attempts > 1 else ""
    if outcome.status == "done":
        return f"done in {outcome.seconds:.3g} s{again}"
    return f"{outcome.status}: {outcome.reason}"


def _reason(error):
    return f"{type(error).__name__}: {error}"


def _directory(run, path):
    return path / "runs" / run.name


def _is_done(run, path):
    files = RunFiles(_directory(run, path))
    if files.configuration.exists() and files.configuration.read_bytes() != run.text.encode():
        raise InputError(f"{files.configuration} has been changed: put back what it was, or remove {files.path}.")
    # The last file that a run writes.
    return files.summary.exists()


def _gathered(own, path, outcomes, say):
    rows, results = gather(own, path, lambda run: _status(run, path, outcomes))
    write_runs(path / "runs.csv", own, rows)
    write_results(path / "results.csv", own, results)
    written = ["runs.csv", "results.csv"]
    if results:
        write_scan_figure(path / "scan.png", own, results)
        written.append("scan.png")
    there = {row["quantity"] for row in results}
    for name in own.gather:
        if results and name not in there:
            say(f"No run has the quantity {name!r}: they have {', '.join(sorted(there)) or 'none of those asked for'}.")
    others = {entry.name for entry in (path / "runs").glob("*")} - {run.name for run in own.runs}
    if others:
        say(f"{len(others)} runs in {path / 'runs'} belong to no point of this scan, and are left out.")
    say(f"Written to {path}: {', '.join(written)}")
    return ScanResult(path, tuple(rows), tuple(results))


def _status(run, path, outcomes):
    if _is_done(run, path):
        return "done"
    outcome = outcomes.get(run.name)
    return getattr(outcome, "status", "failed")
