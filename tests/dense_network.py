"""A dense network of filaments with contacts, and the run that counts how often they pass through each other."""

from dataclasses import dataclass

import numpy as np
import openmm
from openmm import unit
from physics_cases import TEMPERATURE, VISCOSITY

from openmm_cylchain import F_ACTIN, Filaments
from openmm_cylchain.contacts import contact_force
from openmm_cylchain.crossings import CrossingCounter

DIAMETER = 30 * unit.nanometer
SPACING = 18 * unit.nanometer
ACTIN = F_ACTIN.with_segment_length(100)


@dataclass
class Network:
    """A network in a Context, whose filaments have come apart where they were drawn on top of each other."""

    filaments: Filaments
    context: openmm.Context
    box: np.ndarray
    step: float

    def positions(self):
        """Of all particles, not wrapped."""
        return self.context.getState(positions=True).getPositions(asNumpy=True)

    def count_crossings(self, steps, interval):
        """Number of crossings in a number of steps, looked for in intervals of them."""
        counter = CrossingCounter(self.filaments.node_indices, self.positions(), self.box)
        for _ in range(steps // interval):
            self.context.getIntegrator().step(interval)
            counter.update(self.positions())
        return counter.count


def dense_network(
    count, segments, edge, contacts=True, engine="compiled", platform="CPU", seed=1, relaxation=1000, connect=None
):
    """Filaments in equilibrium, at random in a periodic box, after some steps of the recommended length.

    ``connect``, if given, is called with the Filaments, the System and the positions when contacts are in it: to add
    what else there should be, such as crosslinks.
    """
    generator = np.random.default_rng(seed)
    box = edge * np.eye(3)
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine=engine)
    for number in range(count):
        filaments.add_equilibrium(ACTIN, segments, seed=number, start=generator.uniform(0, edge, 3))
        filaments.add_beads(number, SPACING)
    _, system, positions = filaments.build(box_vectors=box)
    if contacts:
        system.addForce(contact_force(filaments, system, DIAMETER))
    if connect is not None:
        connect(filaments, system, positions)
    step = filaments.recommended_time_step(contact_diameter=DIAMETER).step
    integrator = filaments.create_integrator(system, step, random_seed=seed)
    context = openmm.Context(system, integrator, openmm.Platform.getPlatform(platform))
    context.setPositions(positions)
    integrator.step(relaxation)
    return Network(filaments, context, box, step)
