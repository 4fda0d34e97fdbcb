"""[[barrier]] tables and linkers with a loading_distance in files: what runs, and what is refused."""

import numpy as np
import pytest

from openmm_cylchain import InputError, analysis, cli
from openmm_cylchain.runs.configuration import read_configuration

FILE = """
[solvent]
temperature = "300 K"
viscosity = "0.1 Pa*s"

[[filament]]
name = "CHR"
diameter = "20 nm"
segment_length = "50 nm"
persistence_length = "50 nm"
stretching_modulus = "50 pN"
friction_length = "100 nm"
segments = 40
count = 2

[[linkers]]
name = "extruder"
hands = [
    { binding_rate = "20 1/s", reach = "100 nm", unbinding_rate = "0.2 1/s", speed = "-2 um/s" },
    { binding_rate = "20 1/s", reach = "100 nm", unbinding_rate = "0.2 1/s", speed = "2 um/s" },
]
stiffness = "0.02 pN/nm"
rest_length = "30 nm"
loading_distance = "50 nm"
count = 20
volume = "1 um^3"

[[barrier]]
filament = 1
arc_lengths = ["0.5 um", "1.5 um"]
toward = "both"
release_rate = "0.1 1/s"

[simulation]
time_step = "0.1 ms"
duration = "0.5 s"
report_interval = "10 ms"
checks = false
seed = 1
"""


def test_a_run_with_barriers(tmp_path):
    (tmp_path / "loops.toml").write_text(FILE)
    assert cli.main(["run", str(tmp_path / "loops.toml"), "--output", str(tmp_path / "out")]) == 0
    run = analysis.load(tmp_path / "out")
    loops = analysis.loop_lengths(run, len(run) - 1)
    assert len(loops) > 2 and loops.max() > 200.0
    records = run.linkers[-1]
    on = records["filaments"] == 1
    assert np.isin(records["arc_lengths"][on], [500.0, 1500.0]).any()
    probability = analysis.contact_probability(run, 100.0, range(10, len(run)))
    assert probability.mean[0] > 0.9 > probability.mean[5]


@pytest.mark.parametrize(
    "line, other, message",
    [
        ("filament = 1", "filament = 2", "2 does not exist"),
        ('"1.5 um"', '"2.5 um"', "2000 nm long, but arc_length is 2500 nm"),
        ('"both"', '"left"', "toward"),
        ('loading_distance = "50 nm"', 'loading_distance = "0 nm"', "loading_distance"),
        ('release_rate = "0.1 1/s"', 'release_rate = "0.1 1/s"\ncapture_probability = 2.0', "between 0 and 1"),
    ],
)
def test_refused(line, other, message, tmp_path):
    path = tmp_path / "loops.toml"
    path.write_text(FILE.replace(line, other))
    with pytest.raises(InputError, match=message):
        read_configuration(path)


def test_a_barrier_needs_linkers(tmp_path):
    path = tmp_path / "loops.toml"
    first, last = FILE.index("[[linkers]]"), FILE.index("[[barrier]]")
    path.write_text(FILE[:first] + FILE[last:])
    with pytest.raises(InputError, match="there are no"):
        read_configuration(path)
