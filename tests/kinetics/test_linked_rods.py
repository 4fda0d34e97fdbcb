"""Linkers between rods that both move: they pull the rods together as the partition function of bound linkers says."""

from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest

from openmm_cylchain import F_ACTIN, Crosslinker, Crosslinks, Filaments, Hand
from support.contexts import new_context, positions_of
from support.solvent import KT, TEMPERATURE, VISCOSITY

PICONEWTON = 0.602214076
LENGTH, APART = 100.0, 40.0
TRAP = 0.01 * PICONEWTON
SPRING, REST_LENGTH, REACH = 0.1 * PICONEWTON, 20.0, 70.0
PLACES = np.array([20.0, 50.0, 80.0])
ACTIN = F_ACTIN.with_segment_length(LENGTH)
FIRST, SECOND = replace(ACTIN, name="ONE"), replace(ACTIN, name="TWO")


def _rods_in_traps(height, count, generator):
    """Middles and directions of rods whose ends have springs to two points, without linkers."""
    middles = generator.normal(0.0, np.sqrt(KT / (2.0 * TRAP)), (count, 3)) + np.array([0.0, height, 0.0])
    # The cosine with the line of both points has the density exp(narrow cosine).
    narrow = 2.0 * TRAP * (0.5 * LENGTH) ** 2 / KT
    share = generator.uniform(size=count)
    cosine = 1.0 + np.log(share + (1.0 - share) * np.exp(-2.0 * narrow)) / narrow
    angle = generator.uniform(0.0, 2.0 * np.pi, count)
    sine = np.sqrt(1.0 - cosine**2)
    return middles, np.column_stack([cosine, sine * np.cos(angle), sine * np.sin(angle)])


@lru_cache
def _expected(weight, draws=200000):
    """Linkers bound to both rods of a pair, and the distance of the rods across both, by sums over draws of rods."""
    generator = np.random.default_rng(11)
    first, second = (_rods_in_traps(height, draws, generator) for height in (0.0, APART))
    along = (np.arange(40) + 0.5) * LENGTH / 40 - 0.5 * LENGTH
    bound = np.empty((draws, len(PLACES)))
    for number, place in enumerate(PLACES - 0.5 * LENGTH):
        apart = first[0] + place * first[1] - second[0]
        # The distance to places on the other rod, squared.
        square = (apart**2).sum(axis=1)[:, None] - 2.0 * (apart * second[1]).sum(axis=1)[:, None] * along + along**2
        factor = np.exp(-SPRING * (np.sqrt(square) - REST_LENGTH) ** 2 / (2.0 * KT))
        bound[:, number] = weight * np.where(square < REACH**2, factor, 0.0).sum(axis=1) * LENGTH / len(along)
    # Given the rods, linkers are independent of each other.
    of_pair = (1.0 + bound).prod(axis=1)
    height = second[0][:, 1] - first[0][:, 1]
    return [np.average(value, weights=of_pair) for value in ((bound / (1.0 + bound)).sum(axis=1), height)]


def _pairs(copies, hand):
    """Pairs of rods in a Context, each with linkers that never leave the first rod."""
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine="compiled")
    for copy in range(copies):
        for kind, height in ((FIRST, 0.0), (SECOND, APART)):
            filaments.add_straight(kind, 1, (-0.5 * LENGTH, height, 1000.0 * copy), (1.0, 0.0, 0.0))
    stays = Hand(binding_rate=0.0, reach=REACH, unbinding_rate=0.0, binds_to=FIRST)
    kind = Crosslinker(hands=(stays, hand), stiffness=SPRING, rest_length=REST_LENGTH)
    count = copies * len(PLACES)
    filaments.add_linkers(kind, count=count, volume=1e9, bound=count)
    _, system, positions = filaments.build()
    traps = Crosslinks(stiffness=TRAP, rest_length=0.0)
    for nodes in filaments.node_indices:
        for node in nodes:
            traps.add(None, int(node), positions[int(node)])
    traps.add_to(system)
    return filaments, system, positions


@pytest.mark.parametrize(
    ("step", "samples"),
    [pytest.param(0.02, 400, marks=pytest.mark.slow), (0.2, 400), pytest.param(2.0, 1000, marks=pytest.mark.slow)],
)
def test_linkers_pull_rods_together_as_their_free_energy_says(step, samples):
    """The number of linkers between two rods, and how far apart these are, over a factor of 100 in the step.

    Steps are in units of the relaxation of a rod in its traps, in which a hand unbinds about once.
    """
    copies = 40
    relaxation = ACTIN.segment_friction(VISCOSITY, TEMPERATURE).perpendicular / (2.0 * TRAP)
    hand = Hand(
        binding_rate=14.0 / relaxation,
        reach=REACH,
        unbinding_rate=1.0 / relaxation,
        strain_share=0.4,
        binds_to=SECOND,
    )
    filaments, system, positions = _pairs(copies, hand)
    integrator = filaments.create_integrator(system, step * relaxation, random_seed=4, checks=False)
    context = new_context(system, positions, integrator)
    here = filaments.in_context(context)
    ends = np.tile(2 * np.arange(copies), (len(PLACES), 1)).T.ravel()
    here.set_linkers(
        replace(
            here.linkers(),
            filaments=np.column_stack([ends, np.full(len(ends), -1)]),
            arc_lengths=np.column_stack([np.tile(PLACES, copies), np.zeros(len(ends))]),
        ),
    )
    interval = max(1, round(2.0 / step))
    integrator.step(8 * interval)
    nodes = np.array(filaments.node_indices).reshape(copies, 2, 2)
    bound, heights = [], []
    for _ in range(samples):
        integrator.step(interval)
        bound.append(here.linkers().bound[:, 1].sum() / copies)
        middles = positions_of(context)[nodes].mean(axis=2)
        heights.append((middles[:, 1, 1] - middles[:, 0, 1]).mean())
    expected = _expected(hand.rate_per_length / hand.unbinding_rate)
    for values, exact in zip((bound, heights), expected, strict=True):
        means = np.reshape(values, (20, -1)).mean(axis=1)
        error = means.std(ddof=1) / np.sqrt(len(means))
        assert 4.0 * error < 0.05 * exact
        # Springs with a rest length are not linear.
        assert abs(np.mean(values) - exact) < 0.01 * exact + 4.0 * error
    # Without linkers, rods are as far apart as their traps: the test would see that.
    assert expected[1] < 0.9 * APART
