"""A DNA filament among Lennard-Jones particles in a periodic box.

150 particles the size of proteins attract each other weakly through a NonbondedForce with a cutoff. The nodes of the
filament repel the particles through a CustomNonbondedForce between the two groups: the purely repulsive part of the
Lennard-Jones potential (Weeks, Chandler and Andersen). With nodes 8 nm apart, particles of 5 nm and a filament of
2 nm, hardly a particle slips between two nodes. The particles move by Brownian dynamics with the Stokes friction of
spheres, the filament with that of cylinders.

    python lennard_jones_box.py [folder] [steps]
"""

import sys
from pathlib import Path

import matplotlib

matplotlib.use("Agg")

import matplotlib.pyplot as plt
import numpy as np
import openmm
from openmm import app, unit

from openmm_cylchain import DSDNA, Filaments, stokes_friction, theory

BOX = 60.0  # nm
PARTICLES = 150
DIAMETER = 5.0  # nm, sigma of the particles
ATTRACTION = 1.5  # kJ/mol, 0.6 k_B T
SEGMENTS = 7
STEPS = 6000
FRAMES = 100
VISCOSITY = 1e-3 * unit.pascal * unit.second
TEMPERATURE = 310 * unit.kelvin
CHAIN_GROUP = 1
# Contacts are explicit forces: a step must stay well below 2 gamma/k, 2 ns for a node against a particle. The filament
# alone would allow more, see filaments.recommended_time_step().
STEP = 0.1 * unit.nanosecond

folder = Path(sys.argv[1] if len(sys.argv) > 1 else "output_lennard_jones_box")
steps = int(sys.argv[2]) if len(sys.argv) > 2 else STEPS
folder.mkdir(parents=True, exist_ok=True)
generator = np.random.default_rng(5)

# An ordinary OpenMM system: particles on a lattice, with places near the filament left out.
filaments = Filaments(VISCOSITY, TEMPERATURE)
filaments.add_equilibrium(DSDNA, SEGMENTS, seed=3, start=[5, 30, 30], direction=[1, 0, 0])
lattice = (np.stack(np.meshgrid(*[np.arange(9)] * 3, indexing="ij"), axis=-1).reshape(-1, 3) + 0.5) * BOX / 9
axis = np.concatenate([np.linspace(*pair) for pair in zip(filaments[0].positions[:-1], filaments[0].positions[1:])])
gaps = lattice[:, None] - axis
gaps -= BOX * np.round(gaps / BOX)
away = np.linalg.norm(gaps, axis=2).min(axis=1) > 0.5 * (DIAMETER + DSDNA.diameter)
particle_positions = generator.permutation(lattice[away])[:PARTICLES]

topology, system = app.Topology(), openmm.System()
box_vectors = [openmm.Vec3(*row) for row in BOX * np.eye(3)]
topology.setPeriodicBoxVectors(box_vectors * unit.nanometer)
system.setDefaultPeriodicBoxVectors(*box_vectors)
attraction = openmm.NonbondedForce()
attraction.setNonbondedMethod(openmm.NonbondedForce.CutoffPeriodic)
attraction.setCutoffDistance(2.5 * DIAMETER)
system.addForce(attraction)
particle_chain = topology.addChain("P")
for _ in range(PARTICLES):
    topology.addAtom("P", None, topology.addResidue("PRT", particle_chain))
    system.addParticle(50000)
    attraction.addParticle(0, DIAMETER, ATTRACTION)

# The filament joins them. It takes no part in forces that were there before.
positions = filaments.add_to(topology, system, particle_positions, CHAIN_GROUP, CHAIN_GROUP)

# Particles and nodes touch at the sum of their radii.
contact = 0.5 * (DIAMETER + DSDNA.diameter)
repulsion = openmm.CustomNonbondedForce(
    "step(contact-r)*4*epsilon*((s/r)^12-(s/r)^6+0.25); s=contact/2^(1/6); epsilon=2.5"
)
repulsion.addGlobalParameter("contact", contact)
repulsion.setNonbondedMethod(openmm.CustomNonbondedForce.CutoffPeriodic)
repulsion.setCutoffDistance(contact)
for _ in range(system.getNumParticles()):
    repulsion.addParticle([])
repulsion.addInteractionGroup(range(PARTICLES), [int(node) for node in filaments.node_indices[0]])
system.addForce(repulsion)

friction = stokes_friction(DIAMETER * unit.nanometer, VISCOSITY)
integrator = filaments.create_integrator(system, STEP, particle_friction=friction, random_seed=1)
simulation = app.Simulation(topology, system, integrator, openmm.Platform.getPlatformByName("CPU"))
simulation.context.setPositions(positions)
with open(folder / "box.cif", "w") as file:
    app.PDBxFile.writeFile(topology, positions, file, keepIds=True)
interval = max(1, steps // FRAMES)
simulation.reporters.append(app.DCDReporter(str(folder / "box.dcd"), interval))
energies = []
for _ in range(steps // interval):
    simulation.step(interval)
    state = simulation.context.getState(energy=True, groups={CHAIN_GROUP})
    energies.append(state.getPotentialEnergy()._value)
final = simulation.context.getState(positions=True).getPositions(asNumpy=True).value_in_unit(unit.nanometer)
nodes = final[filaments.node_indices[0]]
particles = final[:PARTICLES]

moved = np.sqrt(np.mean(np.sum((particles - particle_positions) ** 2, axis=1)))
gaps = particles[:, None] - nodes
gaps -= BOX * np.round(gaps / BOX)
print(f"{steps} steps of {STEP}, {(steps * STEP).value_in_unit(unit.nanosecond):.0f} ns in all")
print(f"particles moved by {moved:.1f} nm (root mean square)")
print(f"closest particle to a node: {np.linalg.norm(gaps, axis=2).min():.2f} nm; they touch at {contact:.2f} nm")
print(f"end-to-end distance of the filament: {np.linalg.norm(nodes[-1] - nodes[0]):.1f} nm")
exact = SEGMENTS * theory.stretching_energy_mean(DSDNA, TEMPERATURE) + (SEGMENTS - 1) * theory.bending_energy_mean(
    DSDNA, TEMPERATURE
)
print(f"energy of the filament: {np.mean(energies):.1f} kJ/mol, {exact:.1f} in equilibrium without particles")


def surface(axes, points, colour):
    light = matplotlib.colors.LightSource(azdeg=300, altdeg=50)
    axes.plot_surface(*points, color=colour, linewidth=0, antialiased=False, shade=True, lightsource=light)


def sphere(centre, radius, resolution=16):
    polar, azimuth = np.meshgrid(np.linspace(0, np.pi, resolution), np.linspace(0, 2 * np.pi, resolution))
    unit_sphere = np.array([np.sin(polar) * np.cos(azimuth), np.sin(polar) * np.sin(azimuth), np.cos(polar)])
    return centre[:, None, None] + radius * unit_sphere


def cylinder(start, end, radius, resolution=14):
    axis = (end - start) / np.linalg.norm(end - start)
    across = np.cross(axis, [0, 0, 1] if abs(axis[2]) < 0.9 else [0, 1, 0])
    across /= np.linalg.norm(across)
    angle = np.linspace(0, 2 * np.pi, resolution)[:, None]
    ring = radius * (np.cos(angle) * across + np.sin(angle) * np.cross(axis, across))
    return np.stack([start + ring, end + ring], axis=1).transpose(2, 0, 1)


figure = plt.figure(figsize=(8, 8))
axes = figure.add_subplot(projection="3d", computed_zorder=True)
inside = nodes - BOX * np.floor(nodes.mean(axis=0) / BOX)
for particle in particles % BOX:
    surface(axes, sphere(particle, DIAMETER / 2), "#bfe0f5")
for first, second in zip(inside[:-1], inside[1:]):
    for start, end in zip(np.linspace(first, second, 5)[:-1], np.linspace(first, second, 5)[1:]):
        surface(axes, cylinder(start, end, DSDNA.diameter / 2), "#d9482f")
for node in inside:
    surface(axes, sphere(node, 0.55 * DSDNA.diameter), "#922b21")
for low in range(3):
    for second in (0, BOX):
        for third in (0, BOX):
            edge = np.insert(np.array([[second, third]] * 2, dtype=float), low, [0, BOX], axis=1)
            axes.plot(*edge.T, color="0.6", linewidth=0.8)
axes.set(xlim=(0, BOX), ylim=(0, BOX), zlim=(0, BOX), box_aspect=(1, 1, 1))
axes.view_init(elev=18, azim=-62)
axes.set_axis_off()
figure.subplots_adjust(left=-0.03, right=1.03, bottom=-0.05, top=0.98)
length = SEGMENTS * DSDNA.segment_length
figure.text(0.5, 0.965, f"DNA of {length:.0f} nm (red) among spheres of {DIAMETER:g} nm", ha="center", fontsize=16)
figure.text(0.5, 0.93, f"in a periodic box of {BOX:g} nm", ha="center", fontsize=16)
figure.savefig(folder / "box.png", dpi=130)
print(f"Wrote box.cif, box.dcd and box.png to {folder}.")
