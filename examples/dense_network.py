"""A dense network of actin filaments that cannot pass through each other.

A hundred and twenty filaments of 1 um are put at random into a periodic box of 1 um, where their mesh is 0.16 um wide.
Their segments are capsules, and repel those of other filaments where two axes come closer than 30 nm. Contacts are in
the implicit step, as bending and stretching are, so that it may take 10 us. The program counts in every step how often
filaments pass through each other. That must be never; a network without contacts takes the same steps for comparison.

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

from openmm_cylchain import F_ACTIN, Filaments, analysis, capsule_contact_force

FILAMENTS = 120
SEGMENTS = 10
SEGMENT_LENGTH = 100.0  # nm
BOX = 1000.0  # nm
CONTACT_DIAMETER = 30.0  # nm
STEP = 5.0  # us
STEPS = 800
FRAMES = 100
VISCOSITY = 1.71e-3 * unit.pascal * unit.second
TEMPERATURE = 310 * unit.kelvin

folder = Path(sys.argv[1] if len(sys.argv) > 1 else "output_dense_network")
steps = int(sys.argv[2]) if len(sys.argv) > 2 else STEPS
folder.mkdir(parents=True, exist_ok=True)
actin = F_ACTIN.with_segment_length(SEGMENT_LENGTH)
box = BOX * np.eye(3)


def network(with_contacts):
    """Filaments in a Simulation, with contacts or without."""
    generator = np.random.default_rng(5)
    filaments = Filaments(VISCOSITY, TEMPERATURE)
    for number in range(FILAMENTS):
        filaments.add_equilibrium(actin, SEGMENTS, seed=number, start=generator.uniform(0, BOX, 3))
    topology, system, positions = filaments.build(box_vectors=box)
    if with_contacts:
        system.addForce(capsule_contact_force(filaments, system, CONTACT_DIAMETER))
    # One contact that is not solved divides the step of all filaments around it: the share is printed, not warned of.
    integrator = filaments.create_integrator(system, STEP * unit.microsecond, random_seed=1, checks=False)
    simulation = app.Simulation(topology, system, integrator, Platform.getPlatformByName("CPU"))
    simulation.context.setPositions(positions)
    # Filaments are drawn on top of each other: they come apart in the cold, in steps that grow, and then warm up.
    for temperature, lengths in ((1 * unit.kelvin, (1e-3, 1e-2, 0.1, 1.0)), (TEMPERATURE, (0.1, 1.0, STEP))):
        integrator.setTemperature(temperature)
        for length in lengths:
            integrator.setStepSize(length * unit.microsecond)
            integrator.step(20)
    return filaments, simulation


def current(simulation):
    """Positions of all nodes, not wrapped into the box."""
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


filaments, simulation = network(with_contacts=True)
nodes = np.array(filaments.node_indices)
start = current(simulation)
with open(folder / "network.cif", "w") as file:
    app.PDBxFile.writeFile(simulation.topology, start * unit.nanometer, file, keepIds=True)
reporter = app.DCDReporter(str(folder / "network.dcd"), max(1, steps // FRAMES), enforcePeriodicBox=False)
simulation.reporters.append(reporter)
divided = simulation.integrator.getNumDividedSteps()
held = crossings(filaments, simulation)
divided = (simulation.integrator.getNumDividedSteps() - divided) / (FILAMENTS * steps)
passed = crossings(*network(with_contacts=False))

length = FILAMENTS * SEGMENTS * SEGMENT_LENGTH / BOX**3
print(f"{steps} steps of {STEP:g} us, {steps * STEP * 1e-3:.3g} ms in all; {100 * divided:.2g} % of them divided")
print(f"mesh of {np.sqrt(3 / length):.0f} nm; contact diameter {CONTACT_DIAMETER:.0f} nm")
print(f"crossings with contacts: {held[-1]}; without: {passed[-1]}")

figure = plt.figure(figsize=(11, 6.2))
axes = figure.add_axes((-0.02, 0.0, 0.62, 0.93), projection="3d")
final = current(simulation)
moved = np.linalg.norm((final - start)[nodes].mean(axis=1), axis=1)
pieces = []
for own in nodes:
    # Straight lines between nodes, each in the image whose middle is in the box.
    fine = np.concatenate([np.linspace(a, b, 20, endpoint=False) for a, b in zip(final[own], final[own[1:]])])
    lines = np.stack([fine[:-1], fine[1:]], axis=1)
    pieces.append(lines - BOX * np.floor(lines.mean(axis=1, keepdims=True) / BOX))
shades = np.repeat(moved, [len(lines) for lines in pieces])
drawn = Line3DCollection(np.concatenate(pieces) / BOX, array=shades, cmap="viridis", linewidths=2.4, capstyle="round")
axes.add_collection3d(drawn)
corners = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]])
edges = [(0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 4), (0, 4), (1, 5), (2, 6), (3, 7)]
axes.add_collection3d(Line3DCollection([corners[list(edge)] for edge in edges], colors="0.75", linewidths=0.8))
axes.set(xlim=(0, 1), ylim=(0, 1), zlim=(0, 1), xlabel="x (µm)", ylabel="y (µm)", zlabel="z (µm)")
axes.set(xticks=(0, 0.5, 1), yticks=(0, 0.5, 1), zticks=(0, 0.5, 1))
axes.set_box_aspect((1, 1, 1))
axes.grid(False)
for axis in (axes.xaxis, axes.yaxis, axes.zaxis):
    axis.set_pane_color((1, 1, 1, 0))
axes.view_init(elev=16, azim=-68)
figure.colorbar(drawn, cax=figure.add_axes((0.6, 0.24, 0.012, 0.5)), label=f"moved in {steps * STEP * 1e-3:g} ms (nm)")
plot = figure.add_axes((0.74, 0.24, 0.24, 0.5))
time = 1e-3 * STEP * np.arange(1, steps + 1)
plot.plot(time, passed, color="0.6", linewidth=2, label="without contacts")
plot.plot(time, held, color="#c0392b", linewidth=2, label="with contacts")
plot.set(xlabel="time (ms)", ylabel="crossings", xlim=(0, time[-1]))
plot.legend(frameon=False)
plot.spines[["top", "right"]].set_visible(False)
figure.suptitle(
    f"{FILAMENTS} actin filaments of 1 µm in 1 µm³, and how often they pass through each other", x=0.5, y=0.97
)
figure.savefig(folder / "network.png", dpi=120)
print(f"Wrote network.cif, network.dcd and network.png to {folder}.")
