"""Networks that are killed at random moments, again and again, end with the same files.

``OPENMM_CYLCHAIN_TEST_KILLS=100`` before the command of pytest kills it so often.
"""

import json
import multiprocessing
import os
import re
import signal
import time

import numpy as np
import pytest

from openmm_cylchain.runs.configuration import parse_configuration
from openmm_cylchain.runs.run import run
from support import small_runs
from support.configurations import COMING_AND_GOING
from support.staged_runs import MANY_CHANGES

# Many checkpoints, so that kills fall into writing them, too.
NETWORK = small_runs.NETWORK.replace(
    'duration = "1 ms"\nreport_interval = "0.1 ms"',
    'duration = "8 ms"\nreport_interval = "50 us"\ncheckpoint_interval = "50 us"',
)
GROWING = COMING_AND_GOING.replace(
    'report_interval = "5 ms"\ncheckpoint_interval = "15 ms"',
    'report_interval = "0.5 ms"\ncheckpoint_interval = "1 ms"',
)
FILES = ("trajectory.dcd", "energies.csv", "linkers.csv", "linkers.npy", "description.json", "topology.cif")
OF_GROWING = ("growth.csv", "wall_forces.csv", "contact_forces.csv", "checkpoint.chk")
STAGED = re.sub(r'(?m)^duration = "(.*) ms"', lambda match: f'duration = "{6 * float(match[1]):g} ms"', MANY_CHANGES)
OF_STAGES = ("pulling.csv", "wall_forces.csv", "crosslinks.npy", "checkpoint.chk")
KILLS = int(os.environ.get("OPENMM_CYLCHAIN_TEST_KILLS", "3"))


def contents(directory, name):
    # The header of a DCD file has the date of its beginning, behind the number of frames.
    # So does the first line of a checkpoint.
    content = (directory / name).read_bytes()
    if name == "checkpoint.chk":
        return content.partition(b"\n")[2]
    return content[:92] + content[276:] if name == "trajectory.dcd" else content


def step_of_checkpoint(directory):
    path = directory / "checkpoint.chk"
    return json.loads(path.read_bytes().partition(b"\n")[0])["step"] if path.exists() else None


@pytest.fixture
def processes(tmp_path, monkeypatch):
    """Begin with all that a run imports, so that many can be killed in a minute."""
    monkeypatch.chdir(tmp_path)  # What is installed is imported, not what is in the folder of the tests.
    context = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload(["openmm_cylchain.runs.run"])
    return context


def started(processes, configuration, output):
    process = processes.Process(target=run, args=(configuration, output, True))
    process.start()
    return process


@pytest.mark.slow
@pytest.mark.parametrize(
    ("text", "steps", "files"),
    [(NETWORK, 1600, FILES), (GROWING, 1000, FILES + OF_GROWING), (STAGED, 1680, FILES + OF_STAGES)],
    ids=["linked", "growing", "staged"],
)
def test_network_that_is_killed_at_random_moments(text, steps, files, tmp_path, processes):
    """Counted are kills of what has written a checkpoint and is not at its last step; others come on top."""
    configuration = parse_configuration(text)
    assert configuration.simulation.steps == steps
    reference = tmp_path / "reference"
    started(processes, configuration, tmp_path / "first").join()  # It starts the server, which takes long.
    begun = time.monotonic()
    whole = started(processes, configuration, reference)
    whole.join()
    assert whole.exitcode == 0
    longest = time.monotonic() - begun
    generator = np.random.default_rng(17)
    counted, others, runs = [], 0, 0
    while len(counted) < KILLS:
        assert runs < 10 + 10 * KILLS
        output = tmp_path / f"run{runs}"
        runs += 1
        code = None
        while code != 0:
            before = step_of_checkpoint(output)
            process = started(processes, configuration, output)
            process.join(generator.uniform(0.0, 1.0) * longest if len(counted) < KILLS else None)
            process.kill()
            process.join()
            code = process.exitcode
            assert code in (0, -signal.SIGKILL)
            if code == 0:
                longest *= 0.9  # So that about as many kills come too late as too early, however busy the machine is.
            else:
                step = step_of_checkpoint(output)
                if step not in (before, steps):
                    counted.append(step)
                else:
                    others += 1
                    longest *= 1.1
        for name in files:
            assert contents(output, name) == contents(reference, name) != b"", (name, counted)
    print(f"{len(counted)} kills of {runs} runs of {longest:.2f} s, and {others} before a checkpoint or behind the end")
