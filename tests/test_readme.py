"""The Python of the README, as short as it is and as it stands; the docstrings' examples."""

import doctest

from openmm_cylchain.systems import filaments as build
from support.pages import blocks_of
from support.repository import ROOT


def test_building(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (block,) = blocks_of(ROOT / "README.md", "python")
    assert len(block.text.splitlines()) <= 13
    names = {}
    exec(block.text, names)
    assert names["simulation"].currentStep == 1000
    assert (tmp_path / "trajectory.dcd").stat().st_size > 10 * 65 * 12


def test_docstring_examples():
    results = doctest.testmod(build)
    assert results.attempted >= 4
    assert results.failed == 0
