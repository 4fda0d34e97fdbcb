"""DNA in magnetic tweezers, also with plectonemes: extension and torque beside Monte Carlo.

Energies are those of ``support.tweezers_monte_carlo``, which knows nothing of the package; so are references.
"""

from dataclasses import replace

import numpy as np
import openmm
import pytest
from openmm import unit

from openmm_cylchain import Filaments, FilamentType, capsule_contact_force
from support.contexts import energy_of, new_context, positions_of
from support.solvent import KT, TEMPERATURE
from support.tweezers_monte_carlo import TweezedChain, TweezersMonteCarlo

KIND = FilamentType(
    name="DNA",
    diameter=2.0,
    segment_length=5.0,
    bending_rigidity=50.0 * KT,
    torsional_rigidity=100.0 * KT,
    stretching_modulus=4000.0 * KT,
    bending_model="kratky-porod",
)
# 250 nm between straight ends of 50 nm, under 0.5 pN: before and beyond the transition, at which loops begin.
STRAIGHT = TweezedChain(
    70, 5.0, 10.0, 800.0, 6.0, 80 / 6.0**2, 3, twist=20.0, turns=1.0, handle=10, pull=0.12, aligning=4.0
)
PLECTONEME = replace(STRAIGHT, turns=3.0)
NAMES = ("writhe", "z of the last node", "energy of contacts", "bends")
SPACING = 1000.0


class TweezersSimulation:
    """Copies of a TweezedChain in one Context, in steps of so many ps."""

    def __init__(self, chain, nodes, step, seed):
        self.chain, copies = chain, len(nodes)
        self._origins = SPACING * np.column_stack([np.arange(copies), np.zeros((copies, 2))])
        filaments = Filaments(0.69e-3 * unit.pascal * unit.second, TEMPERATURE)
        for number, origin in enumerate(self._origins):
            filaments.add_straight(KIND, chain.segments, origin, [0, 0, 1], clamped=range(chain.handle + 1))
            for end in ("minus", "plus"):
                filaments.add_end_frame(number, end, [0, 0, 1])
        _, self.system, _ = filaments.build()
        pull = openmm.CustomExternalForce("-pull*z")
        pull.addPerParticleParameter("pull")
        for own in filaments.node_indices:
            pull.addParticle(int(own[-1]), [(chain.pull + chain.aligning) * KT])
            pull.addParticle(int(own[-1 - chain.handle]), [-chain.aligning * KT])
        self.system.addForce(pull)
        contacts = capsule_contact_force(filaments, self.system, chain.diameter)
        contacts.setForceGroup(1)
        self.system.addForce(contacts)
        self.integrator = filaments.create_integrator(self.system, step, random_seed=seed, checks=False)
        placed = (nodes + self._origins[:, None]).reshape(-1, 3)
        self.context = new_context(self.system, placed, self.integrator, "CPU", {"Threads": "1"})
        self.own = filaments.in_context(self.context)
        # The same twist in all joints, of which those at the ends are half as long.
        shares = np.array([0.5, *[1.0] * (chain.segments - 1), 0.5]) / chain.segments
        for copy, writhe in enumerate(chain.writhes(nodes)):
            self.own.set_twists(copy, 2 * np.pi * (chain.turns - writhe) * shares)

    def nodes(self):
        return positions_of(self.context).reshape(len(self._origins), -1, 3) - self._origins[:, None]

    def energy_of_contacts(self):
        """Of all copies."""
        return energy_of(self.context, {1}) / KT

    def turns(self):
        """Of twist and writhe, of each copy."""
        twists = [self.own.twists(copy)._value.sum() for copy in range(len(self._origins))]
        return np.array(twists) / (2 * np.pi) + self.chain.writhes(self.nodes())


def test_energies_are_those_of_monte_carlo():
    """Of chains that are wound up in coils which touch each other."""
    generator = np.random.default_rng(1)
    chain, nodes = PLECTONEME, PLECTONEME.coiled(4, 5.0, height=28.0)
    nodes[:, chain.handle + 1 :] += generator.normal(0.0, 1.0, (4, chain.segments - chain.handle, 3))
    rows = chain.observe(nodes)
    assert (rows[:, 2] > 1).all()
    for own, row in zip(nodes, rows):
        assert TweezersSimulation(chain, own[None], 1.0, 1).energy_of_contacts() == pytest.approx(row[2], rel=1e-6)


def test_moves_of_monte_carlo():
    """What is fixed stays, and so do turns and what energies are known to be."""
    nodes = PLECTONEME.coiled(4, 2.0)
    sampler = TweezersMonteCarlo(PLECTONEME, nodes, 1, winding=1)
    sampler.sweep(40)
    assert np.array_equal(sampler.nodes[:, :11], nodes[:, :11])
    assert (np.abs(sampler.nodes - nodes).max(axis=(1, 2)) > 1.0).all()
    assert sampler._energies == pytest.approx(sampler._energies_of(sampler.nodes))
    assert sampler._writhes == pytest.approx(PLECTONEME.writhes(sampler.nodes))


# Means and standard errors of the observables of NAMES, by Metropolis walks of the same energies: the moves of
# ``TweezersMonteCarlo`` in a compiled program, 2 million of them for the first and 12 for the other.
REFERENCES = {
    STRAIGHT: ([0.1607, 291.6, 0.0, 51.04], [0.0127, 2.4, 0.0, 0.52]),
    PLECTONEME: ([1.7457, 188.9, 0.3457, 64.46], [0.0205, 2.3, 0.0098, 0.16]),
}


def assert_as_in_monte_carlo(chain, rows):
    """Of the torque C (2 pi/L) (Lk - Wr), the share that writhe leaves."""
    exact, exact_errors = np.array(REFERENCES[chain])
    means, errors = rows.mean(axis=0), np.hypot(rows.std(axis=0, ddof=1) / np.sqrt(len(rows)), exact_errors)
    means[0], exact[0] = chain.turns - means[0], chain.turns - exact[0]
    measured = zip(NAMES, means, errors, exact)
    lines = "\n".join(f"{name}: {mean:.5g} +- {error:.2g} of {value:.5g}" for name, mean, error, value in measured)
    # What touches seldom cannot be told apart.
    seen = [0, 1, 3]
    assert (np.abs(means - exact) <= 0.05 * exact + 4 * errors)[seen].all(), lines
    assert (4 * errors <= np.array([0.2, 0.12, 1.0, 0.06]) * exact)[seen].all(), lines


@pytest.mark.slow
@pytest.mark.sample("plectoneme")
@pytest.mark.parametrize(("chain", "coils"), [(STRAIGHT, 0.0), (PLECTONEME, 2.0)], ids=["straight", "plectoneme"])
def test_extension_and_torque_are_those_of_monte_carlo(chain, coils):
    """In steps of 40 times the recommended one.

    Lk is kept, but for the polygon that closes far away, and for one chain or two that slip over an end, or through
    segments that do not touch each other, which Monte Carlo refuses.
    """
    simulation = TweezersSimulation(chain, chain.coiled(32, coils), 2e4, 1)
    simulation.integrator.step(round(2e8 / 2e4))
    rows, samples = 0.0, 30
    for _ in range(samples):
        simulation.integrator.step(round(3e8 / samples / 2e4))
        rows = rows + chain.observe(simulation.nodes()) / samples
    lost = np.abs(simulation.turns() - chain.turns)
    kept = lost < 1e-3
    assert kept.sum() >= 29 and lost[~kept] == pytest.approx(2.0, abs=1e-3)
    assert_as_in_monte_carlo(chain, rows[kept])
