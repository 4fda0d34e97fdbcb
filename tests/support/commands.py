"""Runs in processes of their own, which may be killed."""

import subprocess
import sys
import time

COMMAND = [sys.executable, "-m", "openmm_cylchain.cli", "run"]


def start(config, output, *options):
    return subprocess.Popen(
        [*COMMAND, config, "--output", str(output), *options],
        cwd=output.parent,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


def finish(process):
    output, errors = process.communicate(timeout=60)
    return process.returncode, output, errors


def wait_for_size(path, size, process):
    deadline = time.monotonic() + 30
    while not (path.exists() and path.stat().st_size >= size):
        assert process.poll() is None, process.communicate()
        assert time.monotonic() < deadline
        time.sleep(0.002)
