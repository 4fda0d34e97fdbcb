"""Growth under load beside theory: a tiny study, and a planted fault."""

import json
from dataclasses import replace

import pytest

from command_line import main
from reproduce import growth_under_load
from reproduce.ratchets import STALL, Ratchet
from support.verdicts import verdicts

pytest.importorskip("openmm_cylchain.plugin")


@pytest.fixture
def fewest(monkeypatch):
    """A case for each kind of result."""
    monkeypatch.setattr(growth_under_load, "_STALLS", {"actin_at_a_plane": Ratchet(STALL)})
    monkeypatch.setattr(growth_under_load, "_STIFFNESSES", {1.0: 4.0})
    monkeypatch.setattr(growth_under_load, "_SHARES", (0.25,))
    monkeypatch.setattr(growth_under_load, "_STEPS", (0.5,))


def test_a_tiny_study(fewest, tmp_path, monkeypatch):
    monkeypatch.setattr(growth_under_load, "_COPIES", {True: 5})
    monkeypatch.setattr(growth_under_load, "_DURATIONS", {True: 500})
    # So few monomers come that it may or may not agree.
    try:
        main(["reproduce", "ratchets", "--quick", "--output", str(tmp_path)])
    except SystemExit:
        pass
    page = (tmp_path / "ratchets.md").read_text()
    assert "| 0.5 | " in page and "3.53 pN with" in page and "15.50 pN with" in page
    assert "(ratchets.png)" in page and (tmp_path / "ratchets.png").exists()
    results = {own["name"]: own for own in json.loads((tmp_path / "results.json").read_text())["cases"][0]["results"]}
    assert set(results) == {"stall_force_of_actin_at_a_plane", "speed_at_0.25_of_the_stall_force,_D_=_1"}
    assert results["stall_force_of_actin_at_a_plane"]["theory"] == pytest.approx(3.532, abs=0.001)


@pytest.mark.slow
def test_a_planted_fault(fewest, tmp_path, monkeypatch):
    (case,) = growth_under_load.CASES
    assert set(verdicts(case, tmp_path / "right").values()) == {"agrees"}
    # Loads that are a tenth too small are seen.
    original = Ratchet.speeds

    def speeds_at_less(ratchet, *arguments):
        return original(replace(ratchet, load=0.9 * ratchet.load), *arguments)

    monkeypatch.setattr(Ratchet, "speeds", speeds_at_less)
    assert verdicts(case, tmp_path / "weaker")["stall_force_of_actin_at_a_plane"] == "differs"
