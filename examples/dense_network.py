"""A dense network of actin filaments that cannot pass through each other.

A hundred and twenty filaments of 1 um are put at random into a periodic box of 1 um, where their mesh is 0.16 um wide.
Beads along them repel those of other filaments where two axes come closer than 30 nm. The program counts in every step
how often filaments pass through each other. That must be never; a network without contacts takes the same steps for
comparison.

    python dense_network.py [folder] [steps]
"""

import sys
from pathlib import Path

import matplotlib

matplotlib.use("Agg")

import matplotlib.pyplot as plt
import numpy as np
from mpl_toolkits.mplot3d.art3d import Line3DCollection
from openmm import Platform, app, unit

from openmm_cylchain import F_ACTIN, Filaments, analysis, contact_force

FILAMENTS = 120
SEGMENTS = 10
SEGMENT_LENGTH = 100.0  # nm
BOX = 1000.0  # nm
CONTACT_DIAMETER = 30.0  # nm
BEAD_SPACING = 18.0  # nm
STEPS = 1500
FRAMES = 100
# Filaments are drawn on top of each other, and come apart in these steps, which are not looked at.
RELAXATION_STEPS = 400
VISCOSITY = 1.71e-3 * unit.pascal * unit.second
TEMPERATURE = 310 * unit.kelvin

folder = Path(sys.argv[1] if len(sys.argv) > 1 else "output_dense_network")
steps = int(sys.argv[2]) if len(sys.argv) > 2 else STEPS
folder.mkdir(parents=True, exist_ok=True)
actin = F_ACTIN.with_segment_length(SEGMENT_LENGTH)
box = BOX * np.eye(3)


def network(with_contacts, step=None):
    """Filaments in a Simulation, with contacts or without, and its step: that for contacts if none is given."""
    generator = np.random.default_rng(5)
    filaments = Filaments(VISCOSITY, TEMPERATURE)
    for number in range(FILAMENTS):
        filaments.add_equilibrium(actin, SEGMENTS, seed=number, start=generator.uniform(0, BOX, 3))
        filaments.add_beads(number, BEAD_SPACING)
    topology, system, positions = filaments.build(box_vectors=box)
    if with_contacts:
        system.addForce(contact_force(filaments, system, CONTACT_DIAMETER))
    if step is None:
        step = filaments.recommended_time_step(system=system)
    integrator = filaments.create_integrator(system, step, random_seed=1)
    simulation = app.Simulation(topology, system, integrator, Platform.getPlatformByName("CPU"))
    simulation.context.setPositions(positions)
    simulation.step(RELAXATION_STEPS)
    return filaments, simulation, step


def current(simulation):
    """Positions of all particles, not wrapped into the box."""
    return simulation.context.getState(positions=True).getPositions(asNumpy=True).value_in_unit(unit.nanometer)


def crossings(filaments, simulation):
    """How often filaments have passed through each other after every step."""
    counter = analysis.CrossingCounter(filaments, current(simulation), box)
    counts = []
    for _ in range(steps):
        simulation.step(1)
        counter.update(current(simulation))
        counts.append(counter.count)
    return counts


filaments, simulation, recommended = network(with_contacts=True)
with open(folder / "network.cif", "w") as file:
    app.PDBxFile.writeFile(simulation.topology, current(simulation) * unit.nanometer, file, keepIds=True)
reporter = app.DCDReporter(str(folder / "network.dcd"), max(1, steps // FRAMES), enforcePeriodicBox=False)
simulation.reporters.append(reporter)
held = crossings(filaments, simulation)
free_filaments, free_simulation, _ = network(with_contacts=False, step=recommended)
passed = crossings(free_filaments, free_simulation)

length = FILAMENTS * SEGMENTS * SEGMENT_LENGTH / BOX**3
print(f"{steps} steps of {recommended.step * 1e-6:.3f} us, {steps * recommended.step * 1e-9:.3g} ms in all")
print(f"limited by the {recommended.reason}")
print(f"mesh of {np.sqrt(3 / length):.0f} nm; contact diameter {CONTACT_DIAMETER:.0f} nm")
print(f"crossings with contacts: {held[-1]}; without: {passed[-1]}")

figure = plt.figure(figsize=(11, 6.2))
axes = figure.add_axes((-0.02, 0.0, 0.66, 0.93), projection="3d")
final = current(simulation)
colors = plt.get_cmap("twilight")(np.linspace(0.05, 0.95, FILAMENTS))
pieces, shades = [], []
for indices, color in zip(filaments.node_indices, colors):
    # Straight lines between beads, each in the image whose middle is in the box.
    nodes = final[indices]
    fine = np.concatenate([np.linspace(a, b, 20, endpoint=False) for a, b in zip(nodes, nodes[1:])])
    lines = np.stack([fine[:-1], fine[1:]], axis=1)
    lines -= BOX * np.floor(lines.mean(axis=1, keepdims=True) / BOX)
    depth = 0.45 + 0.55 * (1.0 - lines[:, :, 1].mean(axis=1) / BOX)
    pieces.append(lines)
    shades += [(*color[:3], alpha) for alpha in depth]
axes.add_collection3d(Line3DCollection(np.concatenate(pieces), colors=shades, linewidths=2.4))
corners = BOX * np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]])
edges = [(0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 4), (0, 4), (1, 5), (2, 6), (3, 7)]
axes.add_collection3d(Line3DCollection([corners[list(edge)] for edge in edges], colors="0.75", linewidths=0.8))
axes.set(xlim=(0, BOX), ylim=(0, BOX), zlim=(0, BOX))
axes.set_box_aspect((1, 1, 1), zoom=1.12)
axes.view_init(elev=16, azim=-68)
axes.set_axis_off()
plot = figure.add_axes((0.68, 0.2, 0.29, 0.55))
time = 1e-6 * recommended.step * np.arange(1, steps + 1)
plot.plot(time, passed, color="0.6", linewidth=2, label="without contacts")
plot.plot(time, held, color="#c0392b", linewidth=2, label="with contacts")
plot.set(xlabel="time (µs)", ylabel="crossings", xlim=(0, time[-1]))
plot.legend(frameon=False)
plot.spines[["top", "right"]].set_visible(False)
figure.suptitle(
    f"{FILAMENTS} actin filaments of 1 µm in 1 µm³, and how often they pass through each other", x=0.5, y=0.97
)
figure.savefig(folder / "network.png", dpi=120)
print(f"Wrote network.cif, network.dcd and network.png to {folder}.")
