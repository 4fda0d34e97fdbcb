"""One run of a scan, in a process of its own: started, started again from its checkpoint if it dies, and ended with us.

The process ends when the one that started it is gone, whatever killed that: its standard input is closed then.
"""

import contextlib
import dataclasses
import json
import os
import signal
import subprocess
import sys
import threading
import time
from dataclasses import dataclass
from pathlib import Path

import openmm

from ..errors import InputError, InstabilityError

_FAILED, _WRONG_INPUT = 1, 2
_SECONDS_TO_END = 20.0
LOG = "log.txt"
"""What a run says, in its directory."""

_going_on = {}


@dataclass(frozen=True)
class Task:
    """A run to be done: its configuration, the folder of its files, its directory; ``threads`` None for all cores."""

    text: str
    folder: str
    directory: str
    attempts: int
    threads: int | None = None


@dataclass(frozen=True)
class Outcome:
    """What became of a run: "done", "failed" or "interrupted", in how many attempts and seconds, and why."""

    status: str
    attempts: int
    seconds: float
    reason: str = ""


def perform(task):
    """Do a run in a process of its own, or what is left of it, and return its Outcome."""
    begun = time.monotonic()
    attempt, code = 0, -1
    while code < 0 and attempt < task.attempts:
        attempt += 1
        code = _process(task)
    seconds = time.monotonic() - begun
    if code == 0:
        return Outcome("done", attempt, seconds)
    if code > 128:
        return Outcome(
            "interrupted",
            attempt,
            seconds,
            f"ended by signal {code - 128}; it goes on where it was when the scan is started again",
        )
    if code < 0:
        times = "once" if attempt == 1 else f"{attempt} times"
        return Outcome("failed", attempt, seconds, f"died {times}, at last by signal {-code}")
    return Outcome("failed", attempt, seconds, _last_line(Path(task.directory) / LOG))


def end_all():
    """Have the runs that this process has started write a checkpoint and end."""
    for process in list(_going_on):
        process.stdin.close()


def _process(task):
    directory = Path(task.directory)
    directory.mkdir(parents=True, exist_ok=True)
    environment = dict(os.environ)
    if task.threads is not None:
        environment.setdefault("OPENMM_CPU_THREADS", str(task.threads))
    with open(directory / LOG, "ab") as log:
        # In the directory of the run: what is there cannot take the place of this package.
        process = subprocess.Popen(
            [sys.executable, "-c", f"import sys; from {__name__} import main; sys.exit(main())"],
            cwd=directory,
            env=environment,
            stdin=subprocess.PIPE,
            stdout=log,
            stderr=subprocess.STDOUT,
        )
    _going_on[process] = None
    try:
        order = {"text": task.text, "folder": task.folder, "directory": task.directory}
        process.stdin.write(json.dumps(order).encode() + b"\n")
        process.stdin.flush()
    except BrokenPipeError:
        pass  # It died at once: its exit code says how.
    try:
        code = process.wait()
        # Before its first step a run ends at once, without a checkpoint, when it is told to.
        return 128 - code if code < 0 and process.stdin.closed else code
    finally:
        del _going_on[process]
        process.stdin.close()


def _last_line(path):
    lines = [line.strip() for line in path.read_text(errors="replace").splitlines()]
    errors = [line.removeprefix("error: ") for line in lines if line.startswith("error: ")]
    return (errors or [line for line in lines if line] or ["it said nothing"])[-1]


def main():
    """Do the run that standard input describes; return the exit code."""
    from ..runs.run import RunInterrupted
    from ..runs.run_directory import RunDirectory
    from ..runs.summarised_run import run_with_summary

    order = json.loads(sys.stdin.buffer.readline())
    threading.Thread(target=_end_with_the_starter, daemon=True).start()
    try:
        directory = RunDirectory(order["directory"])
        configuration = _read(order["text"], order["folder"], directory)
        # One that a scan which was killed has started is about to write its last checkpoint.
        deadline = time.monotonic() + 2.0 * _SECONDS_TO_END
        while directory.is_being_written and time.monotonic() < deadline:
            time.sleep(0.1)
        print(_platform_in_words(configuration.simulation), flush=True)
        with _kept_where_it_fails(configuration, directory):
            run_with_summary(configuration, directory.path, resume=True)
    except InputError as error:
        print(f"error: {error}", flush=True)
        return _WRONG_INPUT
    except (InstabilityError, OSError) as error:
        print(f"error: {error}", flush=True)
        return _FAILED
    except RunInterrupted as interruption:
        print(f"interrupted: {interruption}", flush=True)
        return 128 + interruption.signal_number
    return 0


def _read(text, folder, directory):
    from ..runs.configuration import parse_configuration

    try:
        return dataclasses.replace(parse_configuration(text, folder), path=str(directory.configuration))
    except InputError as error:
        # There is no file of it: the scan could read it, and this process, perhaps on another machine, cannot.
        separator = ", " if str(error).startswith("line ") else ": "
        raise InputError(f"The configuration of the run in {directory.path}{separator}{error}") from None


@contextlib.contextmanager
def _kept_where_it_fails(configuration, directory):
    # Errors name lines of the configuration, which a run keeps from its first step on.
    try:
        yield
    except InputError:
        if not directory.configuration.exists():
            with contextlib.suppress(InputError), directory:
                directory.claim(configuration, resume=True)
        raise


def _platform_in_words(settings):
    if settings.platform != "CPU":
        return f"On the platform {settings.platform}."
    threads = settings.threads or int(openmm.Platform.getPlatform("CPU").getPropertyDefaultValue("Threads"))
    return f"On the platform CPU with {threads} thread{'s' * (threads > 1)}."


def _end_with_the_starter():
    # Not through sys.stdin, which would be locked when the process ends.
    while os.read(0, 4096):
        pass
    os.kill(os.getpid(), signal.SIGTERM)
    time.sleep(_SECONDS_TO_END)
    os._exit(128 + signal.SIGTERM)
