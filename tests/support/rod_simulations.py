"""Systems of rods for Monte Carlo as Contexts of the package, and the places of their rods there."""

from dataclasses import replace

import numpy as np

from openmm_cylchain import F_ACTIN, Crosslinks, Filaments, Plane, capsule_contact_force, filament_wall_force
from support.contexts import new_context, positions_of
from support.rod_monte_carlo import Link, RodSystem
from support.solvent import KT, TEMPERATURE, VISCOSITY

PICONEWTON_PER_NANOMETER = 0.602214076
# Copies that are in one System are that far from each other, in nm.
APART = 3000.0


def rod_system(rods, length=100.0, diameter=30.0, contact=80 * KT / 30.0**2, links=(), wall=0.0, **properties):
    """A RodSystem of actin. Stiffnesses of contacts in kJ/(mol nm^2), of walls and links in pN/nm.

    Links are ((rod, fraction), (rod, fraction), stiffness, rest length).
    """
    scale = PICONEWTON_PER_NANOMETER / KT
    links = tuple(Link(first, second, stiffness * scale, rest) for first, second, stiffness, rest in links)
    stretching = F_ACTIN.with_segment_length(length).segment_stiffness / KT
    return RodSystem(rods, length, stretching, diameter, contact / KT, links, wall=wall * scale, **properties)


class RodSimulation:
    """Copies of a RodSystem in one Context. Only systems without a box have more than one copy."""

    def __init__(self, system, middles, along, factor=1.0, step=None, scheme="implicit", seed=1, threads=1, **options):
        """With a step in us, or the recommended one times a factor."""
        copies = len(middles)
        assert copies == 1 or (system.box is None and not (system.wall and system.contact))
        self.system = system
        self._origins = np.zeros((copies, 1, 3))
        side = int(np.ceil(copies ** (1 / 3)))
        self._origins[:, 0] = APART * np.array(list(np.ndindex(side, side, side)))[:copies]
        if system.wall or system.planar:
            side = int(np.ceil(copies**0.5))
            self._origins[:, 0, 2] = 0.0
            self._origins[:, 0, :2] = APART * np.array(list(np.ndindex(side, side)))[:copies]
        kind = replace(F_ACTIN, stretching_stiffness=system.stretching * KT).with_segment_length(system.length)
        filaments = Filaments(VISCOSITY, TEMPERATURE)
        for own in self._positions(middles, along).reshape(-1, 2, 3):
            filaments.add_nodes(kind, own, planar=system.planar)
        box = None if system.box is None else np.diag(system.box)
        _, openmm_system, positions = filaments.build(box_vectors=box)
        # Of forces, for their energies.
        self.groups = {"contacts": {1}, "walls": {2}, "links": {3}}
        periodic = box is not None
        if system.contact:
            stiffness = system.contact * KT
            force = capsule_contact_force(filaments, openmm_system, system.diameter, stiffness, periodic=periodic)
            force.setForceGroup(1)
            openmm_system.addForce(force)
        if system.wall:
            for height, normal in ((0.0, 1.0), (system.height, -1.0)):
                plane = Plane([0.0, 0.0, height], [0.0, 0.0, normal])
                force = filament_wall_force(filaments, openmm_system, plane, system.wall * KT)
                force.setForceGroup(2)
                openmm_system.addForce(force)
        if system.links:
            links = Crosslinks(1.0, 0.0)
            for link in system.links:
                for first in range(0, copies * system.rods, system.rods):
                    places = [
                        filaments.segment_place(first + rod, segment=0, fraction=fraction)
                        for rod, fraction in (link.first, link.second)
                    ]
                    links.add(None, *places, link.stiffness * KT, link.rest_length)
            links.add_to(openmm_system, force_group=3, periodic=periodic)
        self.recommended = filaments.recommended_time_step(scheme, system=openmm_system)
        self.step = (step if step is not None else self.recommended.step * factor / 1e6) * 1e6
        self.integrator = filaments.create_integrator(
            openmm_system, self.step, scheme=scheme, random_seed=seed, checks=False, **options
        )
        self._nodes = np.array(filaments.node_indices).reshape(copies, system.rods, 2)
        self.context = new_context(openmm_system, positions, self.integrator, "CPU", {"Threads": str(threads)})

    def _positions(self, middles, along):
        ends = (middles + self._origins)[:, :, None] + np.array([-0.5, 0.5])[:, None] * along[:, :, None]
        return ends.reshape(-1, 3)

    def set_configuration(self, middles, along):
        self.context.setPositions(self._positions(middles, along))

    def configuration(self):
        """Middles and along, as RodMonteCarlo has them."""
        nodes = positions_of(self.context)[self._nodes] - self._origins[:, :, None]
        return nodes.mean(axis=2), nodes[:, :, 1] - nodes[:, :, 0]

    def rows(self, observe, samples, interval, blocks=1):
        """Means of ``observe`` over samples, each after so many steps: rows for all blocks and copies."""
        rows = []
        for _ in range(blocks):
            total, count = 0.0, samples // blocks
            for _ in range(count):
                self.integrator.step(interval)
                total = total + observe(self.system, *self.configuration())
            rows.append(total / count)
        return np.concatenate(rows)
