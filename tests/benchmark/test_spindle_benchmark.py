"""The benchmark of a spindle: it is as large as it says, and runs."""

import json

import pytest

from benchmark import spindle
from benchmark.spindle import SPINDLE, SpindleEffort
from command_line import main
from openmm_cylchain.runs.configuration import read_configuration


def test_spindle_has_the_size_of_the_published_one():
    """200 microtubules, 6000 kinesin-5, 3000 dynein; speeds of Table I of Loughlin et al. 2010."""
    configuration = read_configuration(SPINDLE)
    assert sum(group.count for group in configuration.filaments) == 200
    assert [own.count for own in configuration.linkers] == [6000, 3000]
    assert configuration.simulation.time_step == pytest.approx(5e9)
    growth = configuration.filaments[0].growth
    on, off = growth.rates("plus")
    length = growth.monomers.length
    assert (on * growth.pool.concentration - off) * length * 1e9 == pytest.approx(0.18, rel=0.01)
    assert growth.plus_instability.shrinking_off_rate * length * 1e9 == pytest.approx(0.33, rel=0.01)


def test_command_measures_and_writes(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(spindle, "QUICK", SpindleEffort(0.05, 2, 0.02))
    path = tmp_path / "spindle.json"
    assert main(["benchmark", "spindle", "--quick", "--json", str(path)]) == 0
    assert "simulated_seconds_per_second_spindle" in capsys.readouterr().out
    rows = {row["name"]: row["value"] for row in json.loads(path.read_text())["rows"]}
    assert rows["hours_for_5000_s_spindle"] == pytest.approx(
        5000 / 3600 / rows["simulated_seconds_per_second_spindle"], rel=0.2
    )
    assert 1 <= rows["microtubules_spindle"] <= 200
