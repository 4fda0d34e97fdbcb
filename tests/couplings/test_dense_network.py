"""Filaments with contacts do not pass through each other at the recommended step; without contacts, they do."""

import numpy as np
import pytest

from benchmark.memory import resident_and_peak
from support.dense_network import crosslinked_network, dense_network


def test_filaments_cross_only_without_contacts():
    """Twenty filaments of 0.5 um in a box of 0.5 um, every single step looked at."""
    counts = []
    for contacts in (True, False):
        network = dense_network(20, 5, 500.0, contacts=contacts, relaxation=300)
        counts.append(network.count_crossings(steps=400, interval=1))
        assert network.context.getIntegrator().getNumDividedSteps() == 0
    assert counts[0] == 0
    assert counts[1] > 100


@pytest.mark.slow
def test_a_dense_crosslinked_network_for_long():
    """Two hundred crosslinked filaments of 0.5 um in a sphere of 1.2 um: no crossing, no memory that grows."""
    without, _ = crosslinked_network(200, 10, 600.0, links=200, contacts=False)
    assert without.count_crossings(steps=300, interval=20) > 100
    network, crosslinks = crosslinked_network(200, 10, 600.0, links=200)
    crossings = network.count_crossings(steps=300, interval=20)
    memory, _ = resident_and_peak()
    crossings += network.count_crossings(steps=700, interval=20)
    assert crossings == 0
    assert network.context.getIntegrator().getNumDividedSteps() < 100
    positions = network.positions()._value
    assert np.isfinite(positions).all()
    assert resident_and_peak()[0] < memory + 10e6
    # Twice as far as the soft wall lets a node go with a few k_B T.
    assert np.linalg.norm(positions[np.concatenate(network.filaments.node_indices)], axis=1).max() < 600 + 60
    extensions = crosslinks.extensions(network.context)
    assert len(extensions) == 200
    assert np.abs(extensions).max() < 60
