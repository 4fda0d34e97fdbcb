"""Accuracy of beam elements and straight segments against the number of unknowns, and that faults turn verdicts."""

from dataclasses import replace

import pytest

from command_line import main
from reproduce import beam_accuracy, chromosome, rods_on_string
from reproduce.records import Records
from support.verdicts import verdicts

CASES = {case.key: case for case in beam_accuracy.CASES}


def soft(monkeypatch):
    original = rods_on_string.SIMULATED_ACTIN
    changed = replace(original, bending_rigidity=0.95 * original.bending_rigidity)
    monkeypatch.setattr(rods_on_string, "SIMULATED_ACTIN", changed)


@pytest.mark.slow
def test_the_page(tmp_path, monkeypatch):
    monkeypatch.setattr(chromosome, "_BEAM_COPIES", {True: 400})
    monkeypatch.setattr(beam_accuracy, "_DRAWN", (3,))
    assert main(["reproduce", "beams", "--quick", "--output", str(tmp_path)]) == 0
    page = (tmp_path / "beams.md").read_text()
    assert "30 of 30 results agree" in page and "(columns.png)" in page
    assert "| beam elements | 1 | 4 | +0.75" in page


@pytest.mark.parametrize("key", ["cantilevers", "columns"])
def test_softer_filaments_differ(key, tmp_path, monkeypatch):
    monkeypatch.setattr(beam_accuracy, "_COUNTS", {"straight": (4,), "beam": (2,)})
    monkeypatch.setattr(beam_accuracy, "_COLUMN_COUNTS", {"straight": (2,), "beam": (1,)})
    soft(monkeypatch)
    assert set(verdicts(CASES[key], tmp_path).values()) == {"differs"}


def test_a_critical_load_is_found_whatever_is_expected(tmp_path):
    for guess in (0.98, 1.02):
        found = beam_accuracy._critical_load(Records(tmp_path / str(guess)), "straight", 2, guess * 2.343146)
        assert found == pytest.approx(2.343146, rel=2e-3)
