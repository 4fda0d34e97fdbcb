"""Filaments with contacts do not pass through each other at the recommended step; without contacts, they do."""

from pathlib import Path

import numpy as np
import pytest
from dense_network import dense_network


def _resident_megabytes():
    status = Path("/proc/self/status").read_text()
    return int(next(line for line in status.splitlines() if line.startswith("VmRSS")).split()[1]) / 1024


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
def test_a_dense_network_for_long():
    """Two hundred filaments of 1 um in a box of 1.2 um: no crossing in 1e5 steps, and no memory that grows."""
    without = dense_network(200, 10, 1200.0, contacts=False)
    assert without.count_crossings(steps=1000, interval=10) > 1000
    network = dense_network(200, 10, 1200.0)
    crossings = network.count_crossings(steps=10000, interval=10)
    memory = _resident_megabytes()
    crossings += network.count_crossings(steps=90000, interval=10)
    assert crossings == 0
    assert network.context.getIntegrator().getNumDividedSteps() < 100
    assert np.isfinite(network.positions()._value).all()
    assert _resident_megabytes() < memory + 20
