"""Runs without filaments: bodies alone, from the file to the summary."""

import json

import pytest

from openmm_cylchain import analysis
from openmm_cylchain.cli import main
from openmm_cylchain.errors import InputError
from openmm_cylchain.runs.configuration import parse_configuration

BALLS = """
title = "balls"
[solvent]
temperature = "300 K"
viscosity = "1 mPa*s"
[[body]]
name = "BALL"
radius = "50 nm"
points = [["50 nm", "0 nm", "0 nm"]]
count = 10
inside = { shape = "sphere", radius = "1 um" }
[[wall]]
shape = "sphere"
radius = "1.5 um"
stiffness = "1 pN/nm"
[[link]]
between = [{ body = 0, body_point = 1 }, { body = 1, body_point = 1 }]
stiffness = "0.1 pN/nm"
[simulation]
duration = "0.5 ms"
report_interval = "50 us"
time_step = "2 us"
seed = 1
checks = false
"""


def test_a_run_of_bodies_alone(tmp_path):
    path = tmp_path / "balls.toml"
    path.write_text(BALLS)
    assert main(["run", str(path), "--dry-run"]) == 0
    assert main(["timestep", str(path)]) == 0
    assert main(["run", str(path), "--output", str(tmp_path / "out")]) == 0
    found = analysis.load(tmp_path / "out")
    assert len(found.filaments) == 0 and len(found.times) == 11
    assert (tmp_path / "out" / "summary.png").exists()
    assert json.loads((tmp_path / "out" / "summary.json").read_text())


@pytest.mark.parametrize(
    "table",
    [
        '[contacts]\ndiameter = "10 nm"',
        '[[linkers]]\ntype = "ALPHA_ACTININ"\ncount = 5\nvolume = "1 um^3"',
        '[[link]]\nwithin = "30 nm"\nstiffness = "1 pN/nm"',
    ],
)
def test_what_is_about_filaments_is_refused_without_any(table):
    with pytest.raises(InputError, match=r"is about filaments, but there is no \[\[filament\]\] table"):
        parse_configuration(BALLS + table + "\n")


def test_bodies_alone_are_not_planar():
    assert not parse_configuration(BALLS).bodies[0].planar
    assert parse_configuration(BALLS.replace('name = "BALL"', "planar = true")).bodies[0].planar


def test_something_must_be_there():
    text = BALLS.replace("[[body]]", "[[particles]]")
    with pytest.raises(InputError):
        parse_configuration(text)
