"""Memory of filaments beyond that of stock OpenMM.

Every measurement is made in a fresh process that has imported everything. It builds Topology, System and
Context, takes steps, and reports by how much its resident memory has grown since before the building
(``VmRSS`` of /proc/self/status, and the peak ``VmHWM``). One process does so with filaments, another with as
many particles with stock bonds and angles (HarmonicBondForce, HarmonicAngleForce, BrownianIntegrator), in a
Topology of the same chains, residues, atoms and bonds. What the first takes beyond the second, divided by the
number of segments, is the memory per segment.
"""

import gc
import json
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

from .systems import one_thread_platform, simulate_beads, simulate_filaments

_STATUS = Path("/proc/self/status")
_STEPS = 3
# "python -m" looks in the current directory first: there, it finds this very package and no other.
_HERE = Path(__file__).parents[1]
STOCK = "stock"


class MeasurementError(Exception):
    """Memory that could not be measured: the message says why."""


@dataclass(frozen=True)
class Growth:
    """By how many bytes a process has grown: at the end, and at its largest."""

    resident: int
    peak: int


def measure_growth(kind, chains, segments):
    """Build and step in a fresh process.

    Parameters
    ----------
    kind : {"compiled", "portable", "stock"}
        Filaments with an engine, or beads with stock forces.
    chains, segments : int

    Returns
    -------
    Growth

    Raises
    ------
    MeasurementError
        If the process fails, or memory cannot be measured on this operating system.
    """
    return Growth(**measure_in_process(__name__, kind, str(chains), str(segments)))


def measure_in_process(module, *arguments):
    """Run a module of this package in a fresh process, and read the JSON in the last line of what it writes.

    Raises
    ------
    MeasurementError
        If the process fails.
    """
    command = [sys.executable, "-m", module, *arguments]
    finished = subprocess.run(command, cwd=_HERE, capture_output=True, text=True)
    if finished.returncode != 0:
        lines = finished.stderr.strip().splitlines()
        raise MeasurementError(lines[-1] if lines else f"its process ended with code {finished.returncode}")
    return json.loads(finished.stdout.splitlines()[-1])


def grow(kind, chains, segments):
    """Build and step in this process, and say by how much it has grown.

    Returns
    -------
    Growth
    """
    before, _ = resident_and_peak()
    place = one_thread_platform()
    if kind == STOCK:
        simulated = simulate_beads("harmonic", chains, segments, *place)
    else:
        simulated = simulate_filaments(kind, chains, segments, *place)
    simulated.advance(_STEPS)
    gc.collect()
    resident, peak = resident_and_peak()
    return Growth(resident - before, peak - before)


def resident_and_peak():
    """Resident memory of this process and its peak, in bytes; raises MeasurementError where they are not known."""
    try:
        lines = _STATUS.read_text().splitlines()
    except OSError:
        raise MeasurementError(f"resident memory is read from {_STATUS}, which this system does not have") from None
    fields = dict(line.split(":", 1) for line in lines)
    return tuple(1024 * int(fields[name].split()[0]) for name in ("VmRSS", "VmHWM"))


def print_growth(make):
    """Print by how much this process grows while an object is made, for ``measure_in_process``."""
    before, _ = resident_and_peak()
    made = make()
    gc.collect()
    print(json.dumps({"resident": resident_and_peak()[0] - before}))
    del made


def _main(kind, chains, segments):
    growth = grow(kind, int(chains), int(segments))
    print(json.dumps({"resident": growth.resident, "peak": growth.peak}))


if __name__ == "__main__":
    try:
        _main(*sys.argv[1:])
    except MeasurementError as error:
        sys.exit(str(error))
