"""The benchmark of DNA: its chains, the energies of polychrom's beads, rows from given timings, and that it runs."""

import json

import numpy as np
import pytest

from benchmark import dna
from benchmark.dna import BEAD, BeadsOfPolychrom, DnaEffort, brownian_time, create_chain, rows_in_a_box
from command_line import main


def test_rows_fill_a_box_without_touching():
    nodes, edge = rows_in_a_box(1000)
    assert len(nodes) == 1001
    assert np.allclose(np.linalg.norm(np.diff(nodes, axis=0), axis=1), BEAD)
    distances = np.linalg.norm(nodes[::2, None] - nodes[::2], axis=2)
    assert np.min(distances[~np.eye(len(distances), dtype=bool)]) > 0.99 * BEAD
    assert 0.1 < 1000 * (BEAD / edge) ** 3 < 0.3


def test_extruders_have_just_loaded():
    chain = create_chain(500, 20, contacts=True)
    table = chain.filaments.in_context(chain.context).linkers()
    assert np.all(table.held == 2)
    assert np.allclose(np.diff(table.arc_lengths, axis=1), BEAD)


def test_beads_have_the_energies_of_polychrom():
    """Two beads of one chain at a distance: 1.5 k_BT of repulsion at none, none at 1.05, flat in between."""
    beads = BeadsOfPolychrom(60, 2)
    system = beads.context.getSystem()
    repulsion = system.getForce(2)
    assert repulsion.getCutoffDistance()._value == pytest.approx(1.05 * BEAD)
    positions = beads.context.getState(positions=True).getPositions(asNumpy=True)._value
    kT = 0.0083144626 * 300.0

    def energy(distance):
        # All others are nearly in one place, away from these two.
        moved = np.random.default_rng(1).normal(scale=0.01, size=positions.shape)
        moved[[0, 40]] = 3.0 * BEAD
        moved[0, 2] += distance
        beads.context.setPositions(moved)
        repulsion.setForceGroup(1)
        beads.context.reinitialize(preserveState=True)
        return beads.context.getState(energy=True, groups={1}).getPotentialEnergy()._value

    far = energy(1.06 * BEAD)
    assert energy(1e-3) - far == pytest.approx(1.5 * kT, rel=2e-3)
    assert energy(0.6 * BEAD) - far == pytest.approx(1.5 * kT, rel=0.05)
    assert energy(1.049 * BEAD) - far == pytest.approx(0.0, abs=2e-2)
    beads.context.setPositions(positions)
    # A move takes the bonds of extruders from one place to the next.
    before = beads.context.getState(energy=True, groups={0}).getPotentialEnergy()._value
    beads.move(1)
    moved = beads.context.getState(energy=True, groups={0}).getPotentialEnergy()._value
    beads.move(1)
    assert moved != before
    assert beads.context.getState(energy=True, groups={0}).getPotentialEnergy()._value == pytest.approx(before)


def test_rows_from_given_timings():
    times = {"chain": np.full(3, 0.5), "polychrom": np.full(3, 0.1), "moves": np.full(3, 7.5)}
    rows = {row.name: row.value for row in dna.speed_rows({"chain": 1e6}, times)}
    assert rows["simulated_seconds_per_second_chain"] == pytest.approx(2e-6)
    assert rows["time_per_step_polychrom"] == pytest.approx(110.0)
    assert rows["simulated_seconds_per_second_polychrom"] == pytest.approx(brownian_time() * 1e-12 / 0.11)


def test_a_step_of_the_langevin_integrator_is_so_long_a_time():
    """A fifth of k_BT h/(m gamma) over the square of a bead, in which a segment diffuses as far by itself."""
    friction = dna.CHROMATIN.segment_friction(dna._NUCLEOPLASM, 300.0)
    mobility = 3.0 / (friction.parallel + 2.0 * friction.perpendicular)
    share = 0.0083144626 * 300.0 * mobility * brownian_time() / BEAD**2
    assert share == pytest.approx(0.0083144626 * 300.0 * 0.08 / (100.0 * 0.01), rel=1e-6)


def test_command_measures_and_writes(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(dna, "QUICK", DnaEffort(40, 400, 5, 20, (1.0,), 2, 0.01))
    path = tmp_path / "dna.json"
    assert main(["benchmark", "dna", "--quick", "--json", str(path)]) == 0
    assert "simulated_seconds_per_second_plasmid" in capsys.readouterr().out
    rows = {row["name"]: row["value"] for row in json.loads(path.read_text())["rows"]}
    assert rows["missing_turns_plasmid"] == pytest.approx(0.06 * 40 * 8.5 / 0.34 / 10.5)
    assert rows["recommended_step_chain"] > 0.1
