"""A dense network of filaments with contacts, and the run that counts how often they pass through each other."""

from dataclasses import dataclass

import numpy as np
import openmm
from openmm import unit
from scipy.spatial import cKDTree

from openmm_cylchain import F_ACTIN, Filaments
from openmm_cylchain.analysis.crossings import CrossingCounter
from openmm_cylchain.couplings.contacts import contact_force
from openmm_cylchain.couplings.crosslinks import Crosslinks
from openmm_cylchain.couplings.shapes import Sphere
from openmm_cylchain.couplings.walls import wall_force
from openmm_cylchain.filaments.equilibrium import draw_chain
from support.contexts import new_context
from support.solvent import TEMPERATURE, VISCOSITY

DIAMETER = 30 * unit.nanometer
SPACING = 18 * unit.nanometer
ACTIN = F_ACTIN.with_segment_length(100)


@dataclass
class Network:
    """A network in a Context, whose filaments have come apart where they were drawn on top of each other."""

    filaments: Filaments
    context: openmm.Context
    box: np.ndarray | None
    step: float

    def positions(self):
        """Of all particles, not wrapped."""
        return self.context.getState(positions=True).getPositions(asNumpy=True)

    def count_crossings(self, steps, interval):
        """Number of crossings in a number of steps, looked for in intervals of them."""
        counter = CrossingCounter(self.filaments, self.positions(), self.box)
        for _ in range(steps // interval):
            self.context.getIntegrator().step(interval)
            counter.update(self.positions())
        return counter.count


def dense_network(count, segments, edge, contacts=True, seed=1, relaxation=1000):
    """Filaments in equilibrium, at random in a periodic box, after some steps of the recommended length."""
    generator = np.random.default_rng(seed)
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine="compiled")
    for number in range(count):
        filaments.add_equilibrium(ACTIN, segments, seed=number, start=generator.uniform(0, edge, 3))
        filaments.add_beads(number, SPACING)
    box = edge * np.eye(3)
    _, system, positions = filaments.build(box_vectors=box)
    if contacts:
        system.addForce(contact_force(filaments, system, DIAMETER))
    return _relaxed(filaments, system, positions, box, seed, relaxation)


def crosslinked_network(count, segments, radius, links, contacts=True, seed=1, relaxation=1000):
    """Filaments in a sphere with contacts, and crosslinks between neighbours, after some steps of recommended length.

    Returns
    -------
    (Network, Crosslinks)
    """
    generator = np.random.default_rng(seed)
    short = F_ACTIN.with_segment_length(50)
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine="compiled")
    while len(filaments) < count:
        start = generator.uniform(-radius, radius, 3)
        nodes = draw_chain(short, segments, TEMPERATURE, generator, start)
        if np.linalg.norm(nodes, axis=1).max() < radius:
            filaments.add_beads(filaments.add_nodes(short, nodes), SPACING)
    _, system, positions = filaments.build()
    if contacts:
        system.addForce(contact_force(filaments, system, DIAMETER))
    system.addForce(wall_force(Sphere([0, 0, 0], radius), 0.05, np.concatenate(filaments.node_indices)))
    crosslinks = Crosslinks(stiffness=0.05, rest_length=35)
    for first, second in _neighbouring_beads(filaments, positions._value, 50)[:links]:
        crosslinks.add(None, int(first), int(second))
    crosslinks.add_to(system)
    return _relaxed(filaments, system, positions, None, seed, relaxation), crosslinks


def _neighbouring_beads(filaments, positions, distance):
    # Pairs of beads of different filaments, in no order.
    beads = np.concatenate(filaments.bead_indices)
    owner = np.repeat(np.arange(len(filaments)), [len(own) for own in filaments.bead_indices])
    pairs = cKDTree(positions[beads]).query_pairs(distance, output_type="ndarray")
    pairs = pairs[owner[pairs[:, 0]] != owner[pairs[:, 1]]]
    return beads[np.random.default_rng(0).permutation(pairs)]


def _relaxed(filaments, system, positions, box, seed, relaxation):
    # At this step filaments do not cross. Energies of contacts are too high, which integrators warn of.
    step = filaments.recommended_time_step(contact_diameter=DIAMETER).step
    integrator = filaments.create_integrator(system, step, random_seed=seed, checks=False)
    context = new_context(system, positions, integrator, "CPU")
    integrator.step(relaxation)
    return Network(filaments, context, box, step)
