"""Contacts and links together, in steps of the recommended length and ten times that."""

from dataclasses import replace

import numpy as np
import pytest

from benchmark.network_systems import NETWORKS, SEGMENTS, create_network, enlarged, relaxed_positions

FILAMENTS, STEPS = 40, 150


@pytest.fixture(scope="module")
def system():
    """The network of the benchmark with contacts and links, a fifth of it at the same density."""
    whole = next(one for one in NETWORKS if one.name == "contacts_and_links")
    return enlarged(whole, FILAMENTS / whole.filaments)


@pytest.fixture(scope="module")
def relaxed(system):
    """Positions of filaments that were drawn on top of each other, and have come apart."""
    return relaxed_positions(replace(system, steps=(1.0,)), 400)


@pytest.mark.parametrize("factor", [1, 10])
def test_few_steps_are_divided_and_none_tears_filaments_away(system, relaxed, factor):
    recommended = create_network(system, "implicit", None).integrator.getStepSize()._value / 1e6
    network = create_network(system, "implicit", factor * recommended, positions=relaxed, seed=3)
    centers = []
    for _ in range(STEPS + 1):
        centers.append(network.positions().reshape(FILAMENTS, SEGMENTS + 1, 3).mean(axis=1))
        network.integrator.step(1)
    moves = np.linalg.norm(np.diff(centers, axis=0), axis=2)
    assert np.isfinite(network.positions()).all()
    # One is divided for all filaments that are connected, which are most of them.
    assert network.integrator.getNumDividedSteps() < 0.05 * FILAMENTS * STEPS
    assert moves.max() < 10 * np.median(moves)
    assert network.energies()["contact"] > 1
