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
    segment_length=10.0,
    bending_rigidity=50.0 * KT,
    torsional_rigidity=100.0 * KT,
    stretching_modulus=4000.0 * KT,
    bending_model="kratky-porod",
)
# 160 nm between straight ends of 50 nm, under 0.5 pN: before and beyond the transition, at which loops begin.
STRAIGHT = TweezedChain(
    26, 10.0, 5.0, 400.0, 6.0, 80 / 6.0**2, 2, twist=10.0, turns=1.0, handle=5, pull=0.12, aligning=4.0
)
PLECTONEME = replace(STRAIGHT, turns=2.0)
NAMES = ("writhe", "z of the last node", "energy of contacts", "bends")
SPACING = 1000.0


class TweezersSimulation:
    """Copies of a TweezedChain in one Context, in steps of so many ps."""

    def __init__(self, chain, nodes, step, seed):
        self.chain, copies = chain, len(nodes)
        self._origins = SPACING * np.column_stack([np.arange(copies), np.zeros((copies, 2))])
        filaments = Filaments(0.69e-3 * unit.pascal * unit.second, TEMPERATURE)
        kind = KIND.with_segment_length(chain.length)
        for number, origin in enumerate(self._origins):
            filaments.add_straight(kind, chain.segments, origin, [0, 0, 1], clamped=range(chain.handle + 1))
            for end in ("minus", "plus"):
                filaments.add_end_frame(number, end, [0, 0, 1])
        _, self.system, _ = filaments.build()
        pull = openmm.CustomExternalForce("-pull*z")
        pull.addPerParticleParameter("pull")
        for own in filaments.node_indices:
            pull.addParticle(int(own[-1]), [(chain.pull + chain.aligning) * KT])
            pull.addParticle(int(own[-1 - chain.handle]), [-chain.aligning * KT])
        self.system.addForce(pull)
        contacts = capsule_contact_force(filaments, self.system, chain.diameter, excluded_neighbors=chain.excluded)
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
    chain, nodes = PLECTONEME, PLECTONEME.coiled(4, 3.0, height=17.0)
    nodes[:, chain.handle + 1 :] += generator.normal(0.0, 1.0, (4, chain.segments - chain.handle, 3))
    rows = chain.observe(nodes)
    assert (rows[:, 2] > 1).all()
    for own, row in zip(nodes, rows):
        assert TweezersSimulation(chain, own[None], 1.0, 1).energy_of_contacts() == pytest.approx(row[2], rel=1e-6)


def test_moves_of_monte_carlo():
    """What is fixed stays, and so do turns and what energies are known to be."""
    nodes = PLECTONEME.coiled(4, 1.0)
    sampler = TweezersMonteCarlo(PLECTONEME, nodes, 1, winding=1)
    sampler.sweep(40)
    assert np.array_equal(sampler.nodes[:, :6], nodes[:, :6])
    assert (np.abs(sampler.nodes - nodes).max(axis=(1, 2)) > 1.0).all()
    assert sampler._energies == pytest.approx(sampler._energies_of(sampler.nodes))
    assert sampler._writhes == pytest.approx(PLECTONEME.writhes(sampler.nodes))


# Means and standard errors of the observables of NAMES, by Metropolis walks of the same energies: the moves of
# ``TweezersMonteCarlo`` in a compiled program, 12 million of them for the first and 130 for the other.
REFERENCES = {
    STRAIGHT: ([0.1174, 223.3, 0.0006, 14.80], [0.0053, 0.8, 0.0005, 0.14]),
    PLECTONEME: ([1.0811, 159.30, 0.178, 24.563], [0.0042, 0.55, 0.002, 0.022]),
}


@pytest.mark.slow
@pytest.mark.sample("plectoneme")
@pytest.mark.parametrize(("chain", "coils"), [(STRAIGHT, 0.0), (PLECTONEME, 1.2)], ids=["straight", "plectoneme"])
def test_extension_and_torque_are_those_of_monte_carlo(chain, coils):
    """In six times the recommended step, so that a torque or a height that is off by 5 % fails.

    Lk is kept, but for the polygon that closes far away. Of the torque C (2 pi/L) (Lk - Wr) is compared what writhe
    leaves.
    """
    step, copies, samples = 1e4, 64, 58
    simulation = TweezersSimulation(chain, chain.coiled(copies, coils, height=60.0), 50.0, 1)
    # The turns of a helix fall apart first.
    for settling, steps in ((50.0, 400), (500.0, 400), (step, 4000)):
        simulation.integrator.setStepSize(settling)
        simulation.integrator.step(steps)
    rows = 0.0
    for _ in range(samples):
        simulation.integrator.step(500)
        rows = rows + chain.observe(simulation.nodes()) / samples
    assert simulation.turns() == pytest.approx(np.full(copies, chain.turns), abs=1e-3)
    exact, exact_errors = np.array(REFERENCES[chain])
    means, errors = rows.mean(axis=0), np.hypot(rows.std(axis=0, ddof=1) / np.sqrt(copies), exact_errors)
    means[0], exact[0] = chain.turns - means[0], chain.turns - exact[0]
    measured = zip(NAMES, means, errors, exact)
    lines = "\n".join(f"{name}: {mean:.5g} +- {error:.2g} of {value:.5g}" for name, mean, error, value in measured)
    # What touches seldom cannot be told. Bends are 0.8 % smaller in long steps.
    seen, allowed = [0, 1, 3], np.array([0.0, 0.0, 0.0, 0.01]) * exact
    assert (np.abs(means - exact) <= allowed + 4 * errors)[seen].all(), lines
    assert (4 * errors <= np.array([0.05, 0.05, 1.0, 0.05]) * exact)[seen].all(), lines


@pytest.mark.slow
def test_tight_plectonemes_keep_their_turns():
    """Under 2 pN, where torque folds the joint at the tip: it opens again, as long as what lies beside it touches."""
    lengths = {"segments": 46, "length": 5.0, "joint": 10.0, "stretching": 800.0, "twist": 20.0, "handle": 7}
    chain = replace(PLECTONEME, turns=3.0, pull=0.48, **lengths)
    simulation = TweezersSimulation(chain, chain.coiled(32, 1.5, height=100.0), 50.0, 1)
    folded = 0
    for step, steps, times in ((50.0, 400, 1), (500.0, 100, 100)):
        simulation.integrator.setStepSize(step)
        for _ in range(times):
            simulation.integrator.step(steps)
            tangents = np.diff(simulation.nodes(), axis=1) / chain.length
            folded += ((tangents[:, 1:] * tangents[:, :-1]).sum(axis=2) < -0.5).sum()
    assert simulation.turns() == pytest.approx(np.full(32, 3.0), abs=1e-3)
    assert folded > 0
