"""Actin filaments that are longer than their periodic box, among particles: wrapped, torn and made whole again.

Eight filaments of 5.8 um cross a periodic box of 2 um with 60 particles of 200 nm, which repel each other and the
filaments' nodes across its faces. OpenMM wraps filaments as a whole; here every particle is wrapped by itself, as other
programs do, and filaments are made whole again. The picture shows both. VMD shows the bonds of periodic.dcd if
periodic.psf is loaded first.

    python periodic_box.py [folder] [steps]
"""

import sys
from pathlib import Path

import matplotlib

matplotlib.use("Agg")

import matplotlib.pyplot as plt
import numpy as np
import openmm
from openmm import app, unit

from openmm_cylchain import F_ACTIN, Filaments, make_whole, stokes_friction, write_psf

BOX = 2000.0  # nm
FILAMENTS = 8
SEGMENTS = 16
PARTICLES = 60
DIAMETER = 200.0  # nm
REPULSION = 0.005  # kJ/(mol nm^2)
# The repulsion is explicit: a step must stay well below 2 gamma/k, 60 us for the end of a filament.
STEP = 10 * unit.microsecond
STEPS = 10000
FRAMES = 100
VISCOSITY = 1.71e-3 * unit.pascal * unit.second
TEMPERATURE = 310 * unit.kelvin

folder = Path(sys.argv[1] if len(sys.argv) > 1 else "output_periodic_box")
steps = int(sys.argv[2]) if len(sys.argv) > 2 else STEPS
folder.mkdir(parents=True, exist_ok=True)
generator = np.random.default_rng(5)

topology, system = app.Topology(), openmm.System()
box_vectors = BOX * np.eye(3)
topology.setPeriodicBoxVectors(box_vectors * unit.nanometer)
system.setDefaultPeriodicBoxVectors(*box_vectors)
chain = topology.addChain("P")
for _ in range(PARTICLES):
    topology.addAtom("PRT", None, topology.addResidue("PRT", chain))
    system.addParticle(1e6)
grid = np.stack(np.meshgrid(*[np.arange(4)] * 3), axis=-1).reshape(-1, 3)[:PARTICLES]
filaments = Filaments(VISCOSITY, TEMPERATURE)
for number in range(FILAMENTS):
    filaments.add_equilibrium(F_ACTIN, SEGMENTS, seed=number, start=generator.uniform(0, BOX, 3))
positions = filaments.add_to(topology, system, BOX / 4 * (grid + 0.5))

repulsion = openmm.CustomNonbondedForce(f"0.5*{REPULSION}*(r-{DIAMETER})^2")
repulsion.setNonbondedMethod(openmm.CustomNonbondedForce.CutoffPeriodic)
repulsion.setCutoffDistance(DIAMETER)
for _ in range(system.getNumParticles()):
    repulsion.addParticle([])
repulsion.addInteractionGroup(range(PARTICLES), range(system.getNumParticles()))
system.addForce(repulsion)

friction = stokes_friction(DIAMETER * unit.nanometer, VISCOSITY)
integrator = filaments.create_integrator(system, STEP, particle_friction=friction, random_seed=1)
simulation = app.Simulation(topology, system, integrator, openmm.Platform.getPlatformByName("CPU"))
simulation.context.setPositions(positions)
with open(folder / "periodic.cif", "w") as file:
    app.PDBxFile.writeFile(topology, positions, file, keepIds=True)
write_psf(topology, folder / "periodic.psf", system)
interval = max(1, steps // FRAMES)
simulation.reporters.append(app.DCDReporter(str(folder / "periodic.dcd"), interval, enforcePeriodicBox=True))
simulation.step(steps // interval * interval)


def positions_now(**options):
    state = simulation.context.getState(positions=True, **options)
    return state.getPositions(asNumpy=True).value_in_unit(unit.nanometer)


def longest_segment(positions):
    return max(np.linalg.norm(np.diff(positions[nodes], axis=0), axis=1).max() for nodes in filaments.node_indices)


free, wrapped = positions_now(), positions_now(enforcePeriodicBox=True)
torn = wrapped % BOX
whole = make_whole(torn, filaments, box_vectors).value_in_unit(unit.nanometer)
shifts = (whole - free) / BOX
error = BOX * max(np.abs(shifts[nodes] - np.round(shifts[nodes[0]])).max() for nodes in filaments.node_indices)

print(f"{simulation.currentStep} steps of {STEP}, {FILAMENTS} filaments of {SEGMENTS * 0.36:.1f} um in a box of 2 um")
print(f"longest segment: {longest_segment(wrapped):.1f} nm where OpenMM wraps filaments as a whole,")
print(f"                 {longest_segment(torn):.1f} nm where every particle is wrapped by itself,")
print(f"                 {longest_segment(whole):.1f} nm after make_whole")
print(f"up to shifts by whole boxes, they are those of the simulation to {error:.1g} nm")


def draw_box(axes):
    corners = BOX * np.array([(x, y, z) for x in (0, 1) for y in (0, 1) for z in (0, 1)])
    for first in corners:
        for second in corners:
            if np.count_nonzero(first != second) == 1:
                axes.plot(*np.transpose([first, second]), color="0.6", linewidth=0.8)


def draw_wrapped(axes, nodes, color):
    # Many points along the chain, each in the box; lines end where the chain goes through a face.
    places = np.linspace(0, len(nodes) - 1, 60 * (len(nodes) - 1))
    points = np.stack([np.interp(places, np.arange(len(nodes)), coordinate) for coordinate in nodes.T], axis=1) % BOX
    through = np.flatnonzero(np.abs(np.diff(points, axis=0)).max(axis=1) > 0.5 * BOX) + 1
    for piece in np.split(points, through):
        axes.plot(*piece.T, color=color, linewidth=2)


figure = plt.figure(figsize=(13, 6.5))
views = [figure.add_subplot(1, 2, number, projection="3d") for number in (1, 2)]
colors = plt.get_cmap("turbo")(np.linspace(0.05, 0.95, FILAMENTS))
for nodes, color in zip(filaments.node_indices, colors):
    views[0].plot(*whole[nodes].T, color=color, linewidth=2, marker="o", markersize=2)
    draw_wrapped(views[1], torn[nodes[0]] + free[nodes] - free[nodes[0]], color)
titles = ("made whole: each filament in one piece", "wrapped: everything in the box")
for axes, title, zoom, size in zip(views, titles, (1.45, 1.08), (45, 420)):
    axes.scatter(*torn[:PARTICLES].T, s=size, color="#8d99ae", alpha=0.8, linewidths=0)
    draw_box(axes)
    axes.set_box_aspect(np.ptp([axes.get_xlim(), axes.get_ylim(), axes.get_zlim()], axis=1), zoom=zoom)
    axes.set_axis_off()
    axes.set_title(title, y=1.02)
figure.suptitle(f"{FILAMENTS} filaments of {SEGMENTS * 0.36:.1f} µm in a periodic box of 2 µm", y=0.985)
figure.subplots_adjust(left=0, right=1, bottom=0, top=0.94, wspace=0)
figure.savefig(folder / "periodic.png", dpi=120)
print(f"Wrote periodic.cif, periodic.psf, periodic.dcd and periodic.png to {folder}.")
