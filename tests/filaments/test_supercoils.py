"""Rings that are wound until they supercoil: writhe, torque and size beside Monte Carlo, also between walls and linked.

Energies are those of ``support.supercoil_monte_carlo``, which knows nothing of the package; so are references, of which
an exhaustive test computes one again.
"""

from dataclasses import replace

import numpy as np
import pytest
from openmm import unit

from openmm_cylchain import (
    Crosslinks,
    Filaments,
    FilamentType,
    Slab,
    analysis,
    capsule_contact_force,
    filament_wall_force,
)
from support.contexts import energy_of, new_context, positions_of
from support.ring_monte_carlo import regular_rings
from support.solvent import KT, TEMPERATURE
from support.supercoil_monte_carlo import SupercoiledRing, SupercoilMonteCarlo

KIND = FilamentType(
    name="DNA",
    diameter=2.0,
    segment_length=10.0,
    bending_rigidity=50.0 * KT,
    torsional_rigidity=100.0 * KT,
    stretching_modulus=4000.0 * KT,
    bending_model="kratky-porod",
)
# 300 nm with three turns. Contacts at 6 nm cost 40 k_BT for crossing; next neighbours do not touch.
RING = SupercoiledRing(30, 10.0, 5.0, 400.0, 6.0, 80 / 6.0**2, 2, twist=10.0, turns=3.0)
# The same between walls 20 nm apart, with a link of 15 nm between nodes 0 and 15.
HELD = replace(RING, slab=20.0, wall=1.0, link=0.5, link_length=15.0)
NAMES = ("writhe", "square of the radius of gyration", "energy of contacts", "bends", "walls", "link")
SPACING = 1000.0


class SupercoilSimulation:
    """Copies of a SupercoiledRing in one Context, in steps of so many ps."""

    def __init__(self, ring, nodes, step, seed):
        self.ring, copies = ring, len(nodes)
        origins = SPACING * np.column_stack([np.arange(copies), np.zeros((copies, 2))])
        filaments = Filaments(0.69e-3 * unit.pascal * unit.second, TEMPERATURE)
        for origin in origins:
            filaments.add_ring(KIND, ring.segments, origin)
        _, system, _ = filaments.build()
        self.forces = [capsule_contact_force(filaments, system, ring.diameter, excluded_neighbors=ring.excluded)]
        if ring.wall:
            slab = Slab([0, 0, 0], [0, 0, 1], ring.slab)
            self.forces.append(filament_wall_force(filaments, system, slab, ring.wall * KT))
        for force in self.forces:
            system.addForce(force)
        if ring.link:
            links = Crosslinks(ring.link * KT, ring.link_length)
            for own in filaments.node_indices:
                links.add(None, int(own[0]), int(own[ring.segments // 2]))
            self.forces.append(links.add_to(system))
        for group, force in enumerate(self.forces, 1):
            force.setForceGroup(group)
        self.integrator = filaments.create_integrator(system, step, random_seed=seed, checks=False)
        placed = nodes - nodes.mean(axis=1)[:, None] * [1, 1, 0] + origins[:, None]
        self.context = new_context(system, placed.reshape(-1, 3), self.integrator, "CPU", {"Threads": "1"})
        self.own = filaments.in_context(self.context)

    def energies(self):
        """Of contacts, walls and links, of all copies."""
        return [energy_of(self.context, {group}) / KT for group in range(1, len(self.forces) + 1)]

    def wind(self, times):
        """Little by little, so that no strand passes another one."""
        share = 2 * np.pi * self.ring.turns / self.ring.segments / times
        for _ in range(times):
            for copy in range(len(self.nodes())):
                self.own.set_twists(copy, self.own.twists(copy)._value + share)
            self.integrator.step(2)

    def nodes(self):
        return positions_of(self.context).reshape(-1, self.ring.segments, 3)

    def turns(self):
        """Of twist and writhe, of each copy."""
        twists = [self.own.twists(copy)._value.sum() for copy in range(len(self.nodes()))]
        return np.array(twists) / (2 * np.pi) + self.ring.writhes(self.nodes())


@pytest.mark.parametrize("ring", [RING, HELD], ids=["free", "held"])
def test_energies_are_those_of_monte_carlo(ring):
    """And the writhe: of a few rings that are wound, and pressed flat so that many segments touch."""
    sampler = SupercoilMonteCarlo(ring, regular_rings(ring, 10), 1, winding=40)
    nodes = sampler.nodes * [1.0, 0.2, 0.2 if ring is RING else 1.0]
    simulation = SupercoilSimulation(ring, nodes, 1.0, 1)
    nodes = simulation.nodes()
    rows = ring.observe(nodes)
    assert rows[:, 2].sum() > 10
    assert simulation.energies() == pytest.approx(rows[:, [2, 4, 5]].sum(axis=0)[: len(simulation.forces)], rel=1e-6)
    assert rows[:, 0] == pytest.approx([analysis.writhe(own) for own in nodes], abs=1e-10)


# Means and standard errors of the observables of NAMES, by Metropolis walks of the same energies: the moves of
# ``SupercoilMonteCarlo`` in a compiled program, 12 million of them for the one ring and 7 for the other, in 32 blocks.
REFERENCES = {
    RING: ([2.2648, 949.0, 0.4906, 43.60, 0.0, 0.0], [0.0046, 9.0, 0.0052, 0.21, 0.0, 0.0]),
    HELD: ([2.3524, 1094.0, 0.5838, 42.35, 0.4868, 0.4795], [0.0100, 18.0, 0.0110, 0.28, 0.0074, 0.0070]),
}


@pytest.mark.slow
@pytest.mark.parametrize(
    ("ring", "step", "time", "of_torque"), [(RING, 1e4, 7.5e7, 0.0), (RING, 1e5, 1e8, 0.05), (HELD, 3e4, 2e7, 0.05)]
)
def test_supercoils_are_those_of_monte_carlo(ring, step, time, of_torque):
    """Writhe, and so the torque C (2 pi/L) (Lk - Wr), in steps of 6 to 60 times the recommended one; Lk is kept.

    The first one finds a torque that is off by 5 %. The longest one has hard contacts. One ring in hundreds passes
    through itself in such steps where it has no contacts, between a segment and the next but one, which are bent
    towards each other by twice 120 degrees.
    """
    copies = 48
    simulation = SupercoilSimulation(ring, regular_rings(ring, copies), 1e5, 1)
    simulation.wind(100)
    simulation.integrator.step(200)
    simulation.integrator.setStepSize(step)
    rows, samples = np.zeros(1), 100
    for _ in range(samples):
        simulation.integrator.step(round(time / samples / step))
        rows = rows + ring.observe(simulation.nodes()) / samples
    changes = np.abs(simulation.turns() - ring.turns)
    kept = changes < 1e-9
    assert np.abs(changes[~kept] - 2.0).max(initial=0.0) < 1e-9 and (~kept).sum() <= 1
    rows = rows[kept]
    exact, exact_errors = np.array(REFERENCES[ring])
    means, errors = rows.mean(axis=0), np.hypot(rows.std(axis=0, ddof=1) / np.sqrt(len(rows)), exact_errors)
    # Of the torque, the share that writhe leaves.
    means[0], exact[0] = ring.turns - means[0], ring.turns - exact[0]
    measured = zip(NAMES, means, errors, exact)
    lines = "\n".join(f"{name}: {mean:.5g} +- {error:.2g} of {value:.5g}" for name, mean, error, value in measured)
    allowed = np.array([of_torque, 0.05, 0.15, 0.04, 0.1, 0.05]) * exact
    assert (np.abs(means - exact) <= allowed + 4 * errors).all(), lines
    assert (4 * errors <= np.array([0.12 if of_torque else 0.05, 0.15, 0.2, 0.06, 0.2, 0.2]) * exact).all(), lines


@pytest.mark.exhaustive
def test_linking_number_is_kept_over_a_million_steps():
    ring = replace(RING, segments=20, turns=2.5)
    simulation = SupercoilSimulation(ring, regular_rings(ring, 1), 1e4, 1)
    simulation.wind(100)
    simulation.integrator.step(1_000_000)
    assert abs(simulation.turns()[0] - ring.turns) < 1e-10


@pytest.mark.exhaustive
def test_reference_is_that_of_monte_carlo():
    """Within what minutes can see."""
    sampler = SupercoilMonteCarlo(RING, regular_rings(RING, 64), 11, winding=1500)
    sampler.sweep(3000)
    means, errors = sampler.means(60, 50)
    exact, exact_errors = np.array(REFERENCES[RING])
    assert (np.abs(means - exact) <= 4 * np.hypot(errors, exact_errors)).all()
    assert (4 * errors[:4] <= np.array([0.05, 0.15, 0.4, 0.06]) * exact[:4]).all()
