"""Networks that grow: rods held by links and walls share a closed pool, against a Monte Carlo of the same energies."""

from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest
from openmm import unit

from openmm_cylchain import (
    F_ACTIN,
    Crosslinker,
    Filaments,
    Growth,
    Hand,
    MonomerPool,
    Monomers,
    Slab,
    filament_wall_force,
)
from support.contexts import new_context, positions_of

pytest.importorskip("openmm_cylchain.plugin")

TEMPERATURE = 300.0
KT = 0.00831446261815324 * TEMPERATURE
MONOMER, PER_SEGMENT = 2.7, 80
ROD = F_ACTIN.with_segment_length(MONOMER * PER_SEGMENT)
LEAST, SHARED, POOL = 61, 58, 20.0
"""Monomers of the shortest rod, those that rods share beyond, and k_off V/k_on: a rod has always one segment."""
HELD = np.array([[0.0, 0.0, -40.0], [40.0, 0.0, 0.0], [0.0, 60.0, 30.0]])
TETHER, LINK, REST_LENGTH, WALL, THICKNESS = 0.02, 0.02, 20.0, 0.5, 200.0
LINKS = ((0, 1, 50.0, 90.0), (1, 2, 110.0, 80.0), (0, 2, 80.0, 40.0))
"""Of rods, at lengths along both, which they never lose."""
RODS = len(HELD)


def energies_of_links(starts, directions):
    """Those of each link, for rods that start at (..., rods, 3) and have so many directions."""
    apart = [
        starts[..., i, :] + along * directions[..., i, :] - starts[..., j, :] - other * directions[..., j, :]
        for i, j, along, other in LINKS
    ]
    return 0.5 * LINK * (np.linalg.norm(np.stack(apart, axis=-2), axis=-1) - REST_LENGTH) ** 2


def observed(monomers, starts, directions):
    """Of each copy of a network, monomers of each rod and the mean energy of a link in kT."""
    return np.column_stack([monomers, energies_of_links(starts, directions).mean(axis=-1) / KT])


def energies(starts, directions, monomers):
    ends = starts + MONOMER * monomers[..., None] * directions
    depths = [np.maximum(np.abs(at[..., 2]) - 0.5 * THICKNESS, 0.0) for at in (starts, ends)]
    held = 0.5 * TETHER * ((starts - HELD) ** 2).sum(axis=(-2, -1))
    return energies_of_links(starts, directions).sum(-1) + held + 0.5 * WALL * sum((own**2).sum(-1) for own in depths)


@lru_cache
def expected(walkers=600, sweeps=2000):
    """Means of monomers of each rod and of the energies of links in kT, with errors, by Metropolis moves of rigid rods.

    The weight of n free monomers is POOL^n/n!, as each rod gains at k_on n/V and loses at k_off.
    """
    generator = np.random.default_rng(7)
    starts = HELD + generator.normal(0.0, np.sqrt(KT / TETHER), (walkers, RODS, 3))
    directions = generator.normal(size=(walkers, RODS, 3))
    directions[..., 2] = 0.0
    directions /= np.linalg.norm(directions, axis=-1, keepdims=True)
    monomers = np.full((walkers, RODS), LEAST + SHARED // (2 * RODS))
    free = np.arange(SHARED + 1)
    log_weight = free * np.log(POOL) - np.cumsum(np.log(np.maximum(free, 1)))
    now, sums = energies(starts, directions, monomers), np.zeros((walkers, RODS + 1))
    for sweep in range(sweeps):
        for rod in range(RODS):
            for move in range(3):
                own = [starts.copy(), directions.copy(), monomers.copy()]
                prior = 0.0
                if move == 0:
                    own[0][:, rod] += generator.normal(0.0, (4.0, 12.0)[sweep % 2], (walkers, 3))
                elif move == 1:
                    turned = own[1][:, rod] + generator.normal(0.0, (0.1, 0.3, 1.0, 10.0)[sweep % 4], (walkers, 3))
                    own[1][:, rod] = turned / np.linalg.norm(turned, axis=-1, keepdims=True)
                else:
                    own[2][:, rod] += generator.integers(-12, 13, walkers)
                    free = SHARED + RODS * LEAST - own[2].sum(axis=1)
                    allowed = (own[2][:, rod] >= LEAST) & (free >= 0)
                    before = log_weight[SHARED + RODS * LEAST - monomers.sum(axis=1)]
                    prior = np.where(allowed, log_weight[np.where(allowed, free, 0)] - before, -np.inf)
                then = energies(*own)
                taken = np.log(generator.uniform(size=walkers)) < prior - (then - now) / KT
                for values, changed in zip((starts, directions, monomers), own):
                    values[taken] = changed[taken]
                now = np.where(taken, then, now)
        if sweep >= sweeps // 5:
            sums += observed(monomers, starts, directions)
    means = sums / (sweeps - sweeps // 5)
    return means.mean(axis=0), means.std(axis=0, ddof=1) / np.sqrt(walkers)


def simulated(microseconds, looks, between, copies, turnover=6e4):
    """The same of copies that move in steps, with errors of blocks."""
    filaments = Filaments(1e-3 * unit.pascal * unit.second, TEMPERATURE)
    volume = 1e8
    per_second = turnover / unit.second
    monomers = Monomers(
        length=MONOMER, plus_on_rate=turnover * 1e-12 * volume / POOL, plus_off_rate=per_second, minus_on_rate=0.0
    )
    free = SHARED - RODS * (PER_SEGMENT - LEAST)
    generator = np.random.default_rng(3)
    for copy in range(copies):
        growth = Growth(
            monomers=monomers,
            pool=MonomerPool(free / volume, volume),
            longest=1.4 * ROD.segment_length,
            shortest=LEAST * MONOMER,
            minus_capped=True,
        )
        for rod in range(RODS):
            start = HELD[rod] + [1000.0 * copy, 0.0, 0.0]
            around = generator.uniform(0.0, 2.0 * np.pi)
            along = [np.cos(around), np.sin(around), 0.0]
            filaments.add_straight(ROD, 1, start, along, growth=growth)
            filaments.add_tether(RODS * copy + rod, 0, start, TETHER)
    hand = Hand(binding_rate=0.0, reach=10.0, unbinding_rate=0.0)
    count = copies * len(LINKS)
    filaments.add_linkers(
        Crosslinker(hands=(hand, hand), stiffness=LINK, rest_length=REST_LENGTH), count=count, volume=1e9, bound=count
    )
    _, system, positions = filaments.build()
    system.addForce(filament_wall_force(filaments, system, Slab([0, 0, 0], [0, 0, 1], THICKNESS), WALL))
    integrator = filaments.create_integrator(system, microseconds * unit.microsecond, random_seed=4, checks=False)
    context = new_context(system, positions, integrator, "CPU", {"Threads": "1"})
    here = filaments.in_context(context)
    rods = np.array([(i, j) for i, j, _, _ in LINKS])
    along = np.array([own[2:] for own in LINKS])
    here.set_linkers(
        replace(
            here.linkers(),
            filaments=(rods + RODS * np.arange(copies)[:, None, None]).reshape(-1, 2),
            arc_lengths=np.tile(along, (copies, 1)),
        )
    )
    first = np.array([own[0] for own in filaments.node_indices]).reshape(copies, RODS)
    found = []
    integrator.step(looks * between // 5)
    for _ in range(looks):
        integrator.step(between)
        ranges = here.growth().monomers
        numbers = (ranges[:, 1] - ranges[:, 0]).reshape(copies, RODS)
        at = positions_of(context)
        directions = (at[first + 1] - at[first]) / (MONOMER * numbers[..., None])
        found.append(observed(numbers, at[first], directions))
    assert here.linkers().bound.all()
    # Copies are independent of each other.
    means = np.mean(found, axis=0)
    return means.mean(axis=0), means.std(axis=0, ddof=1) / np.sqrt(copies)


@pytest.mark.slow
@pytest.mark.parametrize(("microseconds", "between"), [(4.0, 50), (40.0, 8)])
def test_a_growing_network_has_the_weights_of_its_energies(microseconds, between):
    """In the longer step, a rod gains and loses two monomers and a half."""
    exact, of_exact = expected()
    found, error = simulated(microseconds, 100, between, 100)
    error = np.hypot(error, of_exact)
    assert np.all(4.0 * error < 0.05 * exact)
    assert np.all(np.abs(found - exact) < 4.0 * error), (found, exact, error)
    # Each rod has another length, and more monomers than the shortest, so that walls and links matter.
    assert np.ptp(exact[:RODS]) > 2.0 and exact[:RODS].min() > LEAST + 5
