"""The Python of the README and the guide, run as it stands, and the docstrings' examples; links between pages."""

import doctest
import re

import numpy as np
import openmm
import pytest
from openmm import unit

from openmm_cylchain import F_ACTIN, Filaments, cli, stokes_friction
from openmm_cylchain.systems import filaments as build
from support.contexts import new_context, positions_of
from support.repository import ROOT
from support.solvent import VISCOSITY

PAGES = [ROOT / "README.md", *sorted(ROOT.glob("docs/*.md")), *sorted(ROOT.glob("docs/design/*.md"))]
PAGES += [ROOT / "ARCHITECTURE.md", ROOT / "CONTRIBUTING.md"]
PYTHON = [
    block
    for page in PAGES[:1] + [ROOT / "docs" / "guide.md"]
    for block in re.findall(r"```python\n(.*?)```", page.read_text(), flags=re.DOTALL)
]
BUILDING, ADDING, ANALYSING = PYTHON

QUICK = """
[solvent]
temperature = "310 K"
viscosity = "1.71 mPa*s"
[[filament]]
type = "F_ACTIN"
segments = 8
count = 4
[simulation]
time_step = "10 ns"
duration = "2 us"
report_interval = "100 ns"
seed = 1
"""


@pytest.fixture(autouse=True)
def _in_temporary_directory(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


def test_building(tmp_path):
    assert len(BUILDING.splitlines()) <= 13
    names = {}
    exec(BUILDING, names)
    assert names["simulation"].currentStep == 1000
    assert (tmp_path / "trajectory.dcd").stat().st_size > 10 * 65 * 12


def test_adding():
    topology, system, positions = _beads()
    filaments = Filaments(VISCOSITY, 310)
    filaments.add_straight(F_ACTIN, 4, [0, 100, 0], [1, 0, 0])
    names = {
        "filaments": filaments,
        "topology": topology,
        "system": system,
        "positions": positions,
        "step_size": 5e3,
        "diameter": 50 * unit.nanometer,
        "viscosity": VISCOSITY,
        "stokes_friction": stokes_friction,
    }
    exec(ADDING, names)
    context = new_context(system, names["positions"], names["integrator"])
    names["integrator"].step(5)
    moved = positions_of(context)
    assert moved.shape == (7, 3)
    assert np.all(np.any(moved != names["positions"]._value, axis=1))


def _beads():
    topology, system = openmm.app.Topology(), openmm.System()
    chain = topology.addChain()
    for _ in range(2):
        topology.addAtom("B", None, topology.addResidue("BEA", chain))
        system.addParticle(1e5)
    return topology, system, np.array([[0.0, 0.0, 0.0], [100.0, 0.0, 0.0]]) * unit.nanometer


def test_analysing(tmp_path, capsys):
    (tmp_path / "quick.toml").write_text(QUICK)
    assert cli.main(["run", "quick.toml", "--output", "output_f_actin"]) == 0
    capsys.readouterr()
    exec(ANALYSING, {})
    value, error = eval(capsys.readouterr().out.replace("np.float64", ""))
    assert value > 0 and error > 0


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_links_lead_somewhere(page):
    text = page.read_text()
    for target in re.findall(r"\]\(([^)#]+)[^)]*\)", text):
        assert target.startswith("http") or (page.parent / target).exists(), target
    # Files that are named in code style.
    for path in re.findall(r"`([\w-]+/[\w/.-]+\.(?:py|h|cpp|md|toml|i))`", text):
        found = any((ROOT / folder / path).exists() for folder in ("", "openmm_cylchain", "plugin_src"))
        assert found or "yours" in path, path


def test_docstring_examples():
    results = doctest.testmod(build)
    assert results.attempted >= 4
    assert results.failed == 0
