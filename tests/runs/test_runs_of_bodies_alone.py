"""Runs without filaments: bodies alone, from the file to the summary."""

import json
import math
import warnings

import gsd.hoomd
import matplotlib.pyplot as plt
import numpy as np
import pytest
from openmm import app

from openmm_cylchain import Body, Filaments, RunReporter, analysis, make_whole
from openmm_cylchain.cli import main
from openmm_cylchain.errors import ContactWarning, InputError, InstabilityError
from openmm_cylchain.runs.configuration import parse_configuration
from openmm_cylchain.runs.run import run

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
    assert np.isnan(analysis.contraction(found)).all()
    assert (tmp_path / "out" / "summary.png").exists()
    assert json.loads((tmp_path / "out" / "summary.json").read_text())


@pytest.mark.parametrize(
    "table",
    [
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


def test_what_is_made_of_a_run_of_bodies_alone(tmp_path):
    path, out = tmp_path / "balls.toml", str(tmp_path / "out")
    path.write_text(BALLS)
    assert main(["run", str(path), "--output", out]) == 0
    for color in ("type", "orientation", "tension", "bending"):
        picture = tmp_path / f"{color}.png"
        assert main(["render", out, "--color", color, "--size", "100x100", "--output", str(picture)]) == 0
        pixels = plt.imread(picture)[..., :3]
        assert len(np.unique(pixels.reshape(-1, 3), axis=0)) > 10
    for kind, name in (("simularium", "balls.simularium"), ("ovito", "balls.gsd"), ("vmd", "balls.tcl")):
        assert main(["export", out, "--format", kind, "--output", str(tmp_path / name)]) == 0
    with gsd.hoomd.open(str(tmp_path / "balls.gsd")) as file:
        particles = file[-1].particles
    names = np.array([particles.types[own] for own in particles.typeid])
    # In angstroms.
    assert (names == "BALL").sum() == 10
    assert np.all(particles.diameter[names == "BALL"] == 1000.0)


CROWD = (
    BALLS.replace("count = 10", "count = 40")
    .replace('radius = "1 um"', 'radius = "250 nm"')
    .replace('radius = "1.5 um"', 'radius = "300 nm"')
)


def _overlaps(positions):
    centres = positions.reshape(40, -1, 3)[:, 0]
    first, second = np.triu_indices(40, 1)
    return np.maximum(100.0 - np.linalg.norm(centres[first] - centres[second], axis=1), 0.0)


def test_bodies_on_top_of_each_other_come_apart_before_a_run(tmp_path):
    """A fifth of a sphere is full of them: contacts of 2 pN/nm leave overlaps of few nm."""
    apart = parse_configuration(CROWD + '[contacts]\nstiffness = "2 pN/nm"\n')
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ContactWarning)
        run(apart, tmp_path / "out")
        run(parse_configuration(CROWD), tmp_path / "without")
    found, without = (analysis.load(tmp_path / name) for name in ("out", "without"))
    assert _overlaps(without.positions(0)).max() > 50.0
    for frame in (0, 10):
        assert _overlaps(found.positions(frame)).max() < 10.0
    touching = found.contacts(10)
    assert np.all(touching.filaments == -1)
    assert len(touching) == np.count_nonzero(_overlaps(found.positions(10)))


def test_contacts_need_a_diameter_where_there_are_filaments():
    text = CROWD + '[[filament]]\ntype = "F_ACTIN"\nsegments = 3\n[contacts]\nstiffness = "2 pN/nm"\n'
    with pytest.raises(InputError, match="lacks the key 'diameter'"):
        parse_configuration(text)


def test_a_step_of_bodies_alone_is_checked(tmp_path):
    path = tmp_path / "balls.toml"
    path.write_text(BALLS)
    assert main(["timestep", str(path), "--check", "--seconds", "1"]) == 0


def test_a_reporter_writes_bodies_alone(tmp_path):
    filaments = Filaments(viscosity=602.2, temperature=300.0)
    filaments.add_body(Body.sphere(50.0), [0.0, 0.0, 0.0])
    topology, system, positions = filaments.build()
    integrator = filaments.create_integrator(system, 1e6, random_seed=1, checks=False)
    simulation = app.Simulation(topology, system, integrator)
    simulation.context.setPositions(positions)
    reporter = RunReporter(tmp_path / "out", 5, filaments)
    simulation.reporters.append(reporter)
    simulation.step(10)
    reporter.close()
    found = analysis.load(tmp_path / "out")
    assert found.steps.tolist() == [0, 5, 10]
    whole = make_whole(found.positions(2), filaments, np.diag([1000.0] * 3))
    assert np.all(whole._value == found.positions(2))


def test_bodies_that_blow_up_are_said_to(tmp_path, monkeypatch):
    monkeypatch.setattr("openmm_cylchain.runs.run.total_energies", lambda *_: (math.nan, 0.0))
    with pytest.raises(InstabilityError, match="not finite"):
        run(parse_configuration(BALLS), tmp_path / "out")


def test_something_must_be_there():
    text = BALLS.replace("[[body]]", "[[particles]]")
    with pytest.raises(InputError):
        parse_configuration(text)
