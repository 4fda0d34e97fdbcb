"""Two kinds of filaments, crosslinks, particles and an optical trap in a periodic box, at rest and in shear flow.

Actin filaments in crosslinked pairs and microtubules share a slit between two walls, periodic along x and y, with
Lennard-Jones particles in OpenMM's NonbondedForce. A trap holds one microtubule at its middle. In the second half of
the run the solvent flows along x, faster the higher it is.

    python mixed_system.py [folder] [steps]
"""

import sys
from dataclasses import dataclass
from pathlib import Path

import matplotlib

matplotlib.use("Agg")

import matplotlib.pyplot as plt
import numpy as np
import openmm
from openmm import app, unit

from openmm_cylchain import (
    F_ACTIN,
    MICROTUBULE,
    Crosslinks,
    Filaments,
    Flow,
    Slab,
    TetherReporter,
    stokes_friction,
    wall_force,
)

BOX = 1600.0  # nm
SLIT = 1200.0  # nm between the walls
PARTICLES = 60
DIAMETER = 60.0  # nm
PAIRS = 4
DISTANCE = 40.0  # nm between the filaments of a pair
LINK_LENGTH = 30.0  # nm
STIFFNESS = 0.05  # kJ/(mol nm^2) of crosslinks, the trap and the walls
SHEAR_RATE = 4000 / unit.second
# Springs and contacts are explicit: a step must stay well below 2 gamma/k, 0.9 us for the end of a filament.
STEP = 0.1 * unit.microsecond
STEPS = 20000
FRAMES = 100
VISCOSITY = 1.71e-3 * unit.pascal * unit.second
TEMPERATURE = 310 * unit.kelvin
KT = (unit.MOLAR_GAS_CONSTANT_R * TEMPERATURE).value_in_unit(unit.kilojoule_per_mole)


@dataclass
class MixedSystem:
    """What the simulation is made of."""

    topology: app.Topology
    system: openmm.System
    positions: unit.Quantity
    filaments: Filaments
    crosslinks: Crosslinks

    def integrator(self, step=STEP, **options):
        """The integrator, with the friction of spheres for the particles."""
        friction = stokes_friction(DIAMETER * unit.nanometer, VISCOSITY)
        return self.filaments.create_integrator(self.system, step, particle_friction=friction, **options)


def build(engine=None):
    """A MixedSystem, for one of the engines of the filaments."""
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine)
    add_filaments(filaments)
    topology, system, particles = lennard_jones_particles(filaments)
    positions = filaments.add_to(topology, system, particles)
    links = crosslinks(filaments)
    links.add_to(system, force_group=1)
    walls = Slab([0, 0, 0], [0, 0, 1], SLIT)
    mobile = [index for index in range(system.getNumParticles()) if not system.isVirtualSite(index)]
    force = wall_force(walls, STIFFNESS, mobile)
    force.setForceGroup(2)
    system.addForce(force)
    return MixedSystem(topology, system, positions, filaments, links)


def add_filaments(filaments):
    """Pairs of actin filaments with attachment points for crosslinks, and three microtubules, one of them in a trap."""
    actin, microtubule = F_ACTIN.with_segment_length(100), MICROTUBULE.with_segment_length(200)
    for pair in range(PAIRS):
        for side in range(2):
            number = filaments.add_straight(
                actin, 10, [-500, -600 + 400 * pair, 200 + DISTANCE * side], [1, 0.2 * (pair - 1.5), 0]
            )
            for place in range(5):
                filaments.add_attachment(number, arc_length=100 + 200 * place)
    for row in range(3):
        number = filaments.add_straight(microtubule, 5, [-500 + 400 * row, -500, -300], [0.1 * row, 1, 0])
    middle = 0.5 * (filaments[number].positions[2] + filaments[number].positions[3])
    filaments.add_tether(number, 2, middle, STIFFNESS * unit.kilojoule_per_mole / unit.nanometer**2)


def lennard_jones_particles(filaments):
    """An ordinary OpenMM System of particles in a periodic box, away from the filaments."""
    topology, system = app.Topology(), openmm.System()
    box_vectors = [openmm.Vec3(*row) for row in BOX * np.eye(3)]
    topology.setPeriodicBoxVectors(box_vectors * unit.nanometer)
    system.setDefaultPeriodicBoxVectors(*box_vectors)
    attraction = openmm.NonbondedForce()
    attraction.setNonbondedMethod(openmm.NonbondedForce.CutoffPeriodic)
    attraction.setCutoffDistance(2.5 * DIAMETER)
    attraction.setForceGroup(3)
    attraction.setUseDispersionCorrection(False)
    system.addForce(attraction)
    chain = topology.addChain("P")
    for _ in range(PARTICLES):
        topology.addAtom("P", None, topology.addResidue("PRT", chain))
        system.addParticle(1.0)
        attraction.addParticle(0.0, DIAMETER, 0.5 * KT)
    lattice = np.stack(np.meshgrid(*[np.arange(8)] * 2, [0, 1], indexing="ij"), axis=-1).reshape(-1, 3)
    places = (lattice - [3.5, 3.5, 0.5]) * [180, 180, 150] - [0, 0, 30]
    return topology, system, np.random.default_rng(2).permutation(places)[:PARTICLES]


def crosslinks(filaments):
    """Springs between the attachment points that the two filaments of each pair have in the same places."""
    links = Crosslinks(STIFFNESS, LINK_LENGTH)
    points = [index for index, _ in enumerate(filaments.attachments)]
    for pair in range(PAIRS):
        first = points[10 * pair : 10 * pair + 5]
        for one, other in zip(first, points[10 * pair + 5 : 10 * pair + 10]):
            links.add(None, *(int(filaments.attachment_indices[index]) for index in (one, other)))
    return links


def main(folder, steps):
    """Run at rest and in shear, and draw the result."""
    folder.mkdir(parents=True, exist_ok=True)
    mixed = build()
    integrator = mixed.integrator(random_seed=1)
    platform = openmm.Platform.getPlatformByName("CPU")
    simulation = app.Simulation(mixed.topology, mixed.system, integrator, platform)
    simulation.context.setPositions(mixed.positions)
    with open(folder / "mixed.cif", "w") as file:
        app.PDBxFile.writeFile(mixed.topology, mixed.positions, file, keepIds=True)
    interval = max(1, steps // FRAMES)
    trap = TetherReporter(None, interval, mixed.filaments)
    simulation.reporters += [app.DCDReporter(str(folder / "mixed.dcd"), interval), trap]

    flow = Flow.shear(SHEAR_RATE, origin=[0, 0, 0])
    snapshots = [simulation.context.getState(positions=True).getPositions(asNumpy=True)._value]
    for current in (None, flow):
        integrator.setFlow(current)
        simulation.step(steps // 2)
        snapshots.append(simulation.context.getState(positions=True).getPositions(asNumpy=True)._value)

    time = steps // 2 * STEP
    heights, drifts = snapshots[1][:PARTICLES, 2], (snapshots[2] - snapshots[1])[:PARTICLES, 0]
    slope = np.polyfit(heights, drifts / time.value_in_unit(unit.second), 1)[0]
    halves = np.array_split(trap["force_x"][:, 0] / 0.602214, 2)
    extensions = mixed.crosslinks.extensions(simulation.context)
    print(f"{2 * (steps // 2)} steps of {STEP}, the second half in shear of {SHEAR_RATE}")
    print(f"particles: drift grows by {slope:.0f} /s with their height at the start of it")
    print(f"crosslinks: {len(extensions)}, extended by {np.mean(extensions):.1f} nm on average")
    print(f"force of the trap along x: {halves[0].mean():.3f} pN at rest, {halves[1].mean():.3f} pN in shear")
    draw(mixed, snapshots, folder / "mixed.png")
    print(f"Wrote mixed.cif, mixed.dcd and mixed.png to {folder}.")


def draw(mixed, snapshots, path):
    """The slit from the side, before and after the shear."""
    figure, panels = plt.subplots(1, 2, figsize=(12, 5.4), sharey=True)
    for axes, positions, title in zip(panels, snapshots[1:], ("at rest", "after shear flow")):
        for nodes, filament in zip(mixed.filaments.node_indices, mixed.filaments):
            chain = positions[nodes]
            chain = chain - BOX * np.round(chain.mean(axis=0) / BOX) * [1, 1, 0]
            thick = filament.type.name == MICROTUBULE.name
            axes.plot(*chain[:, [0, 2]].T, color="#2e7d5b" if thick else "#c0392b", linewidth=4 if thick else 1.8)
        beads = positions[:PARTICLES] - BOX * np.round(positions[:PARTICLES] / BOX) * [1, 1, 0]
        axes.scatter(*beads[:, [0, 2]].T, s=110, color="#1f6f8b", alpha=0.6, edgecolors="white", zorder=0)
        (tether,) = mixed.filaments.tethers
        axes.plot(tether.point[0], tether.point[2], "*", markersize=18, color="#d4ac0d", markeredgecolor="0.2")
        for wall in (-0.5 * SLIT, 0.5 * SLIT):
            axes.axhline(wall, color="0.3", linewidth=5)
        axes.set(title=title, xlabel="x (nm)", xlim=(-0.6 * BOX, 0.6 * BOX), ylim=(-0.55 * SLIT, 0.55 * SLIT))
        axes.spines[["top", "right"]].set_visible(False)
    for height in np.linspace(-500, 500, 9):
        panels[1].annotate(
            "", (0.57 * BOX + 0.12 * height, height), (0.57 * BOX, height), arrowprops={"arrowstyle": "->"}
        )
    panels[0].set_ylabel("z (nm)")
    figure.suptitle("Actin (red), microtubules (green) and particles (blue) in a slit; the star is an optical trap")
    figure.tight_layout()
    figure.savefig(path, dpi=130)


if __name__ == "__main__":
    main(
        Path(sys.argv[1] if len(sys.argv) > 1 else "output_mixed_system"),
        int(sys.argv[2]) if len(sys.argv) > 2 else STEPS,
    )
