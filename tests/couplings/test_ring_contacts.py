"""A ring of DNA that touches itself: bends, contacts and distances beside Monte Carlo of the same energies.

The reference is by ``support.ring_monte_carlo``, which knows nothing of the package. An exhaustive test computes it
again.
"""

import numpy as np
import pytest
from openmm import unit

from openmm_cylchain import DSDNA, Filaments, capsule_contact_force
from support.contexts import energy_of, new_context, positions_of
from support.ring_monte_carlo import Ring, RingMonteCarlo, regular_rings
from support.solvent import KT, TEMPERATURE

KIND = DSDNA.with_segment_length(10.0)
# Contacts at 10 nm, with 40 k_BT for crossing; next neighbours do not touch.
RING = Ring(24, 10.0, KIND.joint_stiffness / KT, KIND.segment_stiffness / KT, 10.0, 80 / 10.0**2, 2)
NAMES = ("energy of contacts", "bends", "pairs that touch", "pairs within 2 nm of touching")
REFERENCE = np.array([0.002354, 20.7014, 0.017286, 0.05029])
REFERENCE_ERRORS = np.array([0.000092, 0.0158, 0.00076, 0.0016])
APART = 1500.0


class RingSimulation:
    """Copies of the ring in one Context, at the recommended step times a factor."""

    def __init__(self, nodes, factor, seed):
        copies = len(nodes)
        side = int(np.ceil(copies ** (1 / 3)))
        origins = APART * np.array(list(np.ndindex(side, side, side)), dtype=float)[:copies]
        filaments = Filaments(0.69e-3 * unit.pascal * unit.second, TEMPERATURE)
        for origin in origins:
            filaments.add_ring(KIND, RING.segments, origin)
        _, system, _ = filaments.build()
        force = capsule_contact_force(filaments, system, RING.diameter)
        force.setForceGroup(1)
        system.addForce(force)
        self.step = factor * filaments.recommended_time_step(system=system).step
        self.integrator = filaments.create_integrator(system, self.step, random_seed=seed)
        placed = nodes - nodes.mean(axis=1)[:, None] + origins[:, None]
        self.context = new_context(system, placed.reshape(-1, 3), self.integrator, "CPU", {"Threads": "1"})

    def nodes(self):
        return positions_of(self.context).reshape(-1, RING.segments, 3)

    def contact_energy(self):
        return energy_of(self.context, {1}) / KT


def in_equilibrium(copies, sweeps, seed):
    """Rings with the weights of their contacts."""
    sampler = RingMonteCarlo(RING, regular_rings(RING, copies), seed)
    sampler.sweep(sweeps)
    weights = np.exp(-RING.contact_energies(sampler.nodes))
    return sampler.nodes[np.random.default_rng(seed).random(copies) < weights]


def test_energies_of_contacts_are_those_of_monte_carlo():
    """Of rings that are pressed flat, so that many of them touch themselves, also at joints."""
    sampler = RingMonteCarlo(RING, regular_rings(RING, 100), 1)
    sampler.sweep(300)
    nodes = sampler.nodes * [1.0, 0.55, 0.55]
    simulation = RingSimulation(nodes, 1e-3, 1)
    expected = RING.contact_energies(simulation.nodes()).sum()
    assert expected > 30
    assert simulation.contact_energy() == pytest.approx(expected, rel=1e-6)


@pytest.mark.exhaustive
def test_a_ring_that_touches_itself():
    """Energies of contacts are of few rings at a time: too few to be looked at."""
    simulation = RingSimulation(in_equilibrium(300, 3000, 3), 1.0, 5)
    interval = max(1, round(2e5 / simulation.step))
    totals, samples = 0.0, 30
    for _ in range(samples):
        simulation.integrator.step(interval)
        totals = totals + RING.observe(simulation.nodes())
    rows = totals / samples
    errors = np.hypot(rows.std(axis=0, ddof=1) / np.sqrt(len(rows)), REFERENCE_ERRORS)
    measured = zip(NAMES, rows.mean(axis=0), errors, REFERENCE)
    lines = [f"{name}: {mean:.5f} +- {error:.5f} of {exact:.5f}" for name, mean, error, exact in measured]
    assert (np.abs(rows.mean(axis=0) - REFERENCE)[1:] < 4 * errors[1:]).all(), "\n".join(lines)
    assert 4 * errors[1] < 0.02 * REFERENCE[1], "\n".join(lines)
    assert (4 * errors[2:] < 0.8 * REFERENCE[2:]).all(), "\n".join(lines)


@pytest.mark.exhaustive
def test_reference_is_that_of_monte_carlo():
    """Within what a minute can see."""
    sampler = RingMonteCarlo(RING, regular_rings(RING, 1000), 11)
    sampler.sweep(2000)
    means, errors = sampler.means(6, 400)
    assert (np.abs(means - REFERENCE) < 4 * np.hypot(errors, REFERENCE_ERRORS)).all()
    assert 4 * errors[1] < 0.03 * REFERENCE[1]
