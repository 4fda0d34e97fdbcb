"""The benchmark of turnover: its network, its rows from given timings, and that it runs."""

import json

import numpy as np
import pytest

from benchmark import turnover
from benchmark.turnover import TurnoverEffort, TurnoverSystem, create_network
from command_line import main

SMALL = TurnoverSystem(filaments=12, reserve=8, edge=1500.0, crosslinkers=30, motors=8)


def test_network_is_what_it_says():
    network = create_network(TurnoverSystem(), 1000.0, growing=False, linked=False)
    sizes = np.array([len(nodes) - 1 for nodes in network.filaments.node_indices])
    assert sizes.min() >= 2 and sizes.max() <= 60
    assert sizes.sum() == network.segments() == pytest.approx(10_000, rel=0.05)


def test_events_are_those_of_free_ends():
    """Four rates of each filament, in 10 uM."""
    system = TurnoverSystem(filaments=60, reserve=20, births=0.0)
    network, steps = create_network(system, 1000.0, linked=False), 400
    network.advance(steps)
    monomers, cuts = network.events()
    rate = 11.6 * 10.0 + 1.4 + 1.3 * 10.0 + 6.75
    expected = 60 * rate * 1e-3 * steps
    assert 4.0 * np.sqrt(expected) < 0.1 * expected
    # Parts have ends, too: there are hardly more filaments at the end.
    assert abs(monomers - expected) < 4.0 * np.sqrt(expected) + (cuts / 60) * expected


def test_severing_is_that_of_cofilin_in_a_thousand_monomers():
    network = create_network(SMALL, 1000.0)
    severing = network.filaments[0].growth.severing
    assert severing.rate * 1000 * 2.7 * 1e12 == pytest.approx(0.032)


def test_rows_from_given_timings():
    steps = (100.0, 1000.0)
    seconds = {"turnover": 0.010, "growth_alone": 0.006, "growth_with_births": 0.008, "mechanics": 0.002}
    times = {f"{name}_{step:g}_us": np.full(3, own) for step in steps for name, own in seconds.items()}
    rows = {row.name: row.value for row in turnover.speed_rows(steps, times)}
    assert rows["simulated_seconds_per_second_turnover"] == pytest.approx(0.1)
    assert rows["simulated_seconds_per_second_turnover_100_us"] == pytest.approx(0.01)
    assert rows["simulated_seconds_per_second_mechanics_1000_us"] == pytest.approx(0.5)
    assert rows["kinetics_over_mechanics_100_us"] == pytest.approx(4.0)
    assert rows["time_of_births_in_a_step_turnover"] == pytest.approx(2.0 / (1.0 - np.exp(-2.0)))
    rows = {row.name: row.value for row in turnover.event_rows(7000.0, 500.0, times["turnover_1000_us"], 1000.0)}
    assert rows["events_per_second_turnover"] == pytest.approx(750.0)


def test_command_measures_and_writes(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(turnover, "QUICK", TurnoverEffort(SMALL, (100.0, 1000.0), 2e4, 2, 0.01))
    path = tmp_path / "turnover.json"
    assert main(["benchmark", "turnover", "--quick", "--json", str(path)]) == 0
    assert "simulated_seconds_per_second_turnover" in capsys.readouterr().out
    rows = {row["name"]: row["value"] for row in json.loads(path.read_text())["rows"]}
    assert rows["monomers_per_simulated_second_turnover"] > 0.0
    assert rows["segments_mechanics"] > 12
    assert rows["memory_turnover"] > 0.0
