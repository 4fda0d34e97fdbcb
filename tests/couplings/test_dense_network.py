"""Filaments with contacts do not pass through each other at the recommended step; without contacts, they do."""

import numpy as np
import pytest
from scipy.spatial import cKDTree

from benchmark.memory import resident_and_peak
from benchmark.network_systems import (
    CONTACT_DIAMETER,
    CONTACT_STIFFNESS,
    NETWORKS,
    SEGMENTS,
    create_network,
    relaxed_positions,
)
from benchmark.systems import TEMPERATURE
from openmm_cylchain.analysis.crossings import segment_distances
from openmm_cylchain.units.quantities import thermal_energy
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


def _least_distance(positions, edge):
    """Of axes of segments that are not neighbors in a filament, in a cubic box."""
    nodes = positions.reshape(-1, SEGMENTS + 1, 3)
    starts, along = nodes[:, :-1].reshape(-1, 3), np.diff(nodes, axis=1).reshape(-1, 3)
    middles = starts + 0.5 * along
    reach = np.linalg.norm(along, axis=1).max() + CONTACT_DIAMETER
    pairs = cKDTree(middles % edge, boxsize=edge).query_pairs(reach, output_type="ndarray")
    first, second = pairs[(pairs[:, 1] - pairs[:, 0] > 1) | (pairs[:, 1] % SEGMENTS == 0)].T
    shift = edge * np.round((middles[first] - middles[second]) / edge)
    return segment_distances(along[first], along[second], starts[second] + shift - starts[first]).min()


@pytest.mark.slow
@pytest.mark.parametrize("step", [5.0, 10.0])
def test_no_contact_is_deeper_than_chance_allows(step):
    """In the network of the benchmark, and no step of it is divided.

    About fifty pairs touch, with exponents of the Boltzmann factor that are distributed exponentially or more steeply:
    one of 16 comes in none of a hundred such runs.
    """
    system = next(one for one in NETWORKS if one.name == "contacts")
    network = create_network(system, "implicit", step, positions=relaxed_positions(system, 400), seed=3)
    network.integrator.step(100)
    nearest = []
    for _ in range(400):
        network.integrator.step(1)
        nearest.append(_least_distance(network.positions(), system.edge))
    exponent = 0.5 * CONTACT_STIFFNESS * (CONTACT_DIAMETER - min(nearest)) ** 2 / thermal_energy(TEMPERATURE)
    assert exponent < 16
    assert network.integrator.getNumDividedSteps() == 0
