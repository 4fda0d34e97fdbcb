"""Networks for the comparison of beam elements and straight segments: how they are drawn, and what shears them."""

import numpy as np
import pytest

from reproduce import beam_networks
from reproduce.beam_networks import LENGTH, SPAN, STIFFNESS, STRAIN, Network
from reproduce.rods_on_string import ACTIN


def two_filaments():
    """A filament that is held at its foot and moved at its head, along the axis across it, with a hinge between."""
    starts, directions = np.array([[0.0, 0.0], [0.0, SPAN]]), np.array([[0.0, 1.0], [0.0, 1.0]])
    links = [(0, SPAN, 1, 0.0)]
    held = [(0, 0.0, False), (0, 0.5 * SPAN, False), (1, SPAN, True)]
    return Network(starts, directions, np.array([1, 1]), SPAN, 2.0 * SPAN, links, held)


@pytest.mark.parametrize("kind", ["random", "lattice"])
def test_places_of_links_are_in_one_point(kind):
    network = Network.of_kind(kind, 3)
    assert len(network.links) > 50
    for i, s, j, t in network.links:
        assert i != j and network.place(i, s) == pytest.approx(network.place(j, t), abs=1e-6)
        assert 0.0 <= s <= network.lengths[i] * network.unit
    heights = {bool(moves): [] for moves in (False, True)}
    for filament, arc_length, moves in network.held:
        heights[bool(moves)].append(network.place(filament, arc_length)[1])
    assert np.ptp(heights[False]) < 1e-6 and np.ptp(heights[True]) < 1e-6
    assert heights[True][0] - heights[False][0] == pytest.approx(network.height)


def test_a_lever_has_no_stiffness_and_a_beam_that_of_its_span():
    network = two_filaments()
    # The second filament turns about its foot: what holds it is the hinge alone, so that nothing resists.
    assert abs(beam_networks.continuous_force(network)) < 1e-4 * STIFFNESS * network.shift
    # A cantilever of one and a half spans: its foot is held at two places, which are as stiff as links.
    starts, directions = np.array([[0.0, 0.0]]), np.array([[0.0, 1.0]])
    held = [(0, 0.0, False), (0, SPAN, False), (0, 2.0 * SPAN, True)]
    beam = Network(starts, directions, np.array([2]), SPAN, SPAN, [], held)
    # Three springs, whose forces are 1, -2, 1 times the load by moments, and the overhanging beam: P a^2 (L + a)/3 EI.
    compliance = (1.0 + 4.0 + 1.0) / STIFFNESS + SPAN**2 * 2.0 * SPAN / (3.0 * ACTIN.rigidity)
    assert beam_networks.continuous_force(beam) == pytest.approx(STRAIN * SPAN / compliance, rel=1e-4)


def test_the_engine_agrees_with_the_exact_solution_where_it_is_exact():
    """With one beam element for each span of a lattice, but for strains that do not jump."""
    exact = beam_networks.continuous_force(Network.draw_lattice(1))
    found = beam_networks.network_forces("lattice", [1], 1, "beam")
    assert found["force"][0] == pytest.approx(exact, rel=1e-3)
    straight = beam_networks.network_forces("lattice", [1], 2, "straight")
    assert straight["unknowns"] < found["unknowns"]
    assert straight["force"][0] < 0.95 * exact


def test_filaments_have_the_length_that_they_should():
    network = Network.draw_random(5)
    ends = network.place(0, LENGTH) - network.place(0, 0.0)
    assert np.linalg.norm(ends) == pytest.approx(LENGTH)
    assert network.spans > 5.0
