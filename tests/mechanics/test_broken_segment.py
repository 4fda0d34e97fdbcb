"""The segment by which a configuration or a step has gone wrong: where it is, and what is said of it."""

import numpy as np
import pytest

from openmm_cylchain.mechanics.broken_segment import BrokenSegment, find_broken_segment
from openmm_cylchain.mechanics.redistribution import ChainSet

# An open chain of two segments and a ring of four, all of length 1. The second chain's segments are 2 to 5.
COUNTS, CLOSED = (3, 4), (False, True)
NODES = np.array([[0, 0, 0], [1, 0, 0], [2, 0, 0], [0, 5, 0], [1, 5, 0], [1, 6, 0], [0, 6, 0]], dtype=float)
REST_LENGTHS = np.ones(6)
HARMONIC, FENE = np.full(6, np.inf), np.full(6, 0.1)
CHAINS = ChainSet(np.array(COUNTS), *np.ones((4, 6)), fixed=np.zeros(7, dtype=bool), closed=np.array(CLOSED))


def moved(node, by, values=NODES):
    values = np.array(values)
    values[node] += by
    return values


def vectors(**nodes):
    values = np.zeros((7, 3))
    for node, vector in nodes.items():
        values[int(node.removeprefix("n"))] = vector
    return values


def test_nothing_is_broken():
    assert find_broken_segment(CHAINS, REST_LENGTHS, FENE, NODES) is None
    assert find_broken_segment(CHAINS, REST_LENGTHS, HARMONIC, moved(6, [0, 10, 0])) is None
    steps = vectors(n0=[0.9, 0, 0])
    assert find_broken_segment(CHAINS, REST_LENGTHS, HARMONIC, NODES, np.zeros((7, 3)), steps) is None


@pytest.mark.parametrize("node, chain, segment", [(2, 0, 1), (3, 1, 0), (6, 1, 2)])
def test_position_that_is_not_finite(node, chain, segment):
    broken = find_broken_segment(CHAINS, REST_LENGTHS, HARMONIC, moved(node, [np.nan, 0, 0]))
    assert broken == BrokenSegment(chain, segment, "the force on it, or its position, is not finite")


def test_force_that_is_not_finite_is_the_culprit_where_everything_is_spoilt():
    everything = np.full((7, 3), np.nan)
    broken = find_broken_segment(CHAINS, REST_LENGTHS, HARMONIC, NODES, vectors(n5=[np.inf, 0, 0]), everything)
    assert (broken.chain, broken.segment) == (1, 1)
    assert "not finite" in broken.what


def test_length_beyond_the_range_of_its_potential():
    """The last segment of a ring leads back to its first node."""
    broken = find_broken_segment(CHAINS, REST_LENGTHS, FENE, moved(2, [0.2, 0, 0]))
    assert (broken.chain, broken.segment) == (0, 1)
    assert broken.what.startswith("it would be 1.2 nm long after it, and its FENE potential is finite between 0.9 and")
    halves = vectors(n3=[0, -0.06, 0], n4=[0, -0.06, 0], n6=[0, 0.06, 0])
    broken = find_broken_segment(CHAINS, REST_LENGTHS, FENE, NODES, displacements=halves)
    assert (broken.chain, broken.segment) == (1, 3)
    assert broken.what.startswith("it would be 1.12 nm long")


def test_of_segments_that_move_too_far_the_one_with_the_greatest_force():
    forces, steps = vectors(n1=[1, 0, 0], n5=[0, 3, 0]), vectors(n1=[0, 1.5, 0], n5=[0, 2.5, 0])
    broken = find_broken_segment(CHAINS, REST_LENGTHS, HARMONIC, NODES, forces, steps)
    assert broken == BrokenSegment(1, 1, "its ends would move by 2.5 nm against each other in one step")
