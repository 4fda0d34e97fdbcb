"""Stiff links side by side, between the same two segments, in implicit steps that are long for them.

Each keeps the others from moving along it, and lets them turn: what they let move changes with their directions.
Copies begin in equilibrium.
"""

import numpy as np
import pytest

from support.linked_networks import MICROSECOND, LinkPotential, Network, Simulation, mean_and_error

SCHEMES = ("implicit", "implicit-second-order")
SINGLE, DOUBLE = LinkPotential(100.0, 35.0), LinkPotential(200.0, 35.0)
SEGMENT_LENGTH = 100.0


def parallel_links(distance, copies, scheme, step):
    """Pairs of filaments with two links, so many nm apart on both: they begin as if they were at one place."""
    offset = 0.5 * distance / SEGMENT_LENGTH
    links = tuple(((0, 2, 0.5 + side * offset), (1, 3, 0.5 + side * offset)) for side in (-1, 1))
    network = Network(links, 2)
    together = Network((((0, 2, 0.5), (1, 3, 0.5)),), 2)
    nodes, particles = together.draw(DOUBLE, copies, np.random.default_rng(5))
    return Simulation(network, SINGLE, nodes, particles, scheme, step * MICROSECOND)


@pytest.mark.parametrize("scheme", SCHEMES)
@pytest.mark.parametrize(("distance", "step"), [(0.0, 2.0), (0.0, 5.0), (1.0, 5.0), (1.0, 20.0)])
def test_they_are_solved(distance, step, scheme):
    copies, steps = 60, 60
    simulation = parallel_links(distance, copies, scheme, step)
    # What begins apart from equilibrium is over.
    simulation.integrator.setStepSize(0.1 * MICROSECOND)
    simulation.integrator.step(60)
    simulation.integrator.setStepSize(step * MICROSECOND)
    before = simulation.integrator.getNumDividedSteps()
    simulation.integrator.step(steps)
    divided = (simulation.integrator.getNumDividedSteps() - before) / (2 * copies * steps)
    assert divided < 0.01


@pytest.mark.parametrize("scheme", SCHEMES)
def test_two_at_the_same_places_are_one_of_twice_the_stiffness(scheme):
    energies = parallel_links(0.0, 200, scheme, 5.0).measure(80, 1)["links"]
    mean, error = mean_and_error(energies)
    exact = 0.5 * DOUBLE.mean(DOUBLE.energy)
    assert error < 0.0125 * exact
    assert abs(mean - exact) < 0.01 * exact + 4 * error


@pytest.mark.slow
def test_they_point_in_all_directions_alike():
    """Against space and against the filaments that they join; without metric forces, 3 to 5 % less along these."""
    copies, samples = 700, 30
    simulation = parallel_links(0.0, copies, "implicit", 20.0)
    network = simulation.network
    squares, against = np.zeros((copies, 3)), np.zeros(copies)
    for _ in range(samples):
        simulation.integrator.step(4)
        nodes, particles = simulation.configuration()
        first, second = network.links[0]
        vector = network.at(first, nodes, particles) - network.at(second, nodes, particles)
        vector /= np.linalg.norm(vector, axis=1)[:, None]
        squares += vector**2
        tangent = nodes[:, 0, 3] - nodes[:, 0, 2]
        against += (np.sum(tangent * vector, axis=1) / np.linalg.norm(tangent, axis=1)) ** 2
    for name, values in [*((f"axis {axis}", squares[:, axis]) for axis in range(3)), ("along the filament", against)]:
        mean, error = mean_and_error(3 * values / samples)
        assert error < 0.01, (name, error)
        assert abs(mean - 1) < 0.01 + 4 * error, f"{name}: {mean:.4f} +- {error:.4f}"
