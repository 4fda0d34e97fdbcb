"""Configurations of runs that take a second, and their directories."""

from openmm_cylchain.cli import main
from openmm_cylchain.runs import run as run_module

TWO_TYPES = """
title = "two types"
[solvent]
temperature = "310 K"
viscosity = "1.71 mPa*s"
[[filament]]
type = "F_ACTIN"
segments = 6
count = 3
[[filament]]
type = "MICROTUBULE"
segments = 2
clamped = [0]
[simulation]
time_step = "10 us"
duration = "3 ms"
report_interval = "0.1 ms"
checkpoint_interval = "1 ms"
seed = 5
"""

MOTOR = 'hand = { binding_rate = "1e5 1/s", reach = "60 nm", unbinding_rate = "2000 1/s", speed = "-0.5 um/s" }'
NETWORK = """
title = "network"
[solvent]
temperature = "298.15 K"
viscosity = "1 mPa*s"
[box]
edges = ["0.4 um", "0.4 um", "0.5 um"]
[[filament]]
type = "F_ACTIN"
segment_length = "100 nm"
segments = 4
count = 20
[[linkers]]
type = "ALPHA_ACTININ"
count = 60
bound = 30
[[linkers]]
name = "motor"
stiffness = "0.1 pN/nm"
rest_length = "30 nm"
MOTOR
count = 40
bound = 40
[simulation]
time_step = "5 us"
duration = "1 ms"
report_interval = "0.1 ms"
seed = 5
""".replace("MOTOR", MOTOR)

AMONG_SPHERES = """
title = "among spheres"
[solvent]
temperature = "298.15 K"
viscosity = "1 mPa*s"
[box]
edges = ["0.4 um", "0.4 um", "0.5 um"]
[[filament]]
type = "F_ACTIN"
segment_length = "100 nm"
segments = 4
count = 2
[[particles]]
name = "BIG"
diameter = "80 nm"
count = 3
[[particles]]
name = "SMALL"
diameter = "40 nm"
positions = [["0 nm", "0 nm", "0 nm"], ["900 nm", "100 nm", "100 nm"]]
[simulation]
time_step = "5 us"
duration = "0.1 ms"
report_interval = "50 us"
seed = 5
"""

TWO_LOADS = """
[solvent]
temperature = "298.15 K"
viscosity = "1 mPa*s"
[[filament]]
type = "DSDNA"
segments = 5
count = 2
[[filament]]
type = "DSDNA"
segments = 5
[[pull]]
table = 1
tension = "0.2 pN"
[[pull]]
table = 2
tension = "10 pN"
[simulation]
time_step = "1 ns"
duration = "20 ns"
report_interval = "1 ns"
seed = 5
"""


def run_command(folder, text):
    """The command that runs a configuration, which it writes to a folder."""
    (folder / "input.toml").write_text(text)
    return ["run", str(folder / "input.toml"), "--output", str(folder / "out")]


def simulated(folder, text):
    """The directory of a run of a configuration."""
    assert main(run_command(folder, text)) == 0
    return folder / "out"


def stop_and_resume(command, monkeypatch, checkpoints):
    """Run a command until so many checkpoints are written, and a report after the last one; then resume it."""
    written = run_module.Recorder._write_checkpoint
    count = 0

    def stopped(recorder):
        nonlocal count
        checkpoint = written(recorder)
        count += 1
        if count == checkpoints:
            recorder._report()
            raise KeyboardInterrupt
        return checkpoint

    with monkeypatch.context() as patch:
        patch.setattr(run_module.Recorder, "_write_checkpoint", stopped)
        assert main(command) == 130
    assert main([*command, "--resume"]) == 0
