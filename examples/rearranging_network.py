"""A network of actin under shear whose crosslinkers rearrange: it yields, and forgets its stress.

Crosslinked filaments lie between two plates, each of which holds what is within 100 nm of it. The upper plate moves by
a third of the thickness, and then stays. Crosslinkers that never unbind keep the stress; those that unbind, and bind
elsewhere, let it relax.

    python rearranging_network.py [folder] [steps]
"""

import sys
from pathlib import Path

import matplotlib

matplotlib.use("Agg")

import matplotlib.pyplot as plt
import numpy as np
import openmm
from matplotlib.collections import LineCollection
from openmm import app, unit

from openmm_cylchain import F_ACTIN, Crosslinker, Filaments, Hand, Slab, filament_wall_force

FILAMENTS, SEGMENTS, SEGMENT_LENGTH = 140, 10, 100.0  # nm
WIDTH, DEPTH, THICKNESS = 2000.0, 700.0, 1000.0  # nm
HELD = 100.0  # nm, of each plate
STRAIN = 0.3
LINKERS = 1200
UNBINDING = (0.0, 20.0)  # 1/s, for the two networks
STEP = 100 * unit.microsecond
STEPS = 2000
FRAMES = 100
FORMED, SHEARED = 0.15, 0.25  # of the steps: when the plate begins to move, and when it stops
PICONEWTON = 0.602214076  # kJ/(mol nm)
TETHER = 0.5 * PICONEWTON  # kJ/(mol nm^2)
VISCOSITY = 1e-3 * unit.pascal * unit.second
TEMPERATURE = 310 * unit.kelvin

folder = Path(sys.argv[1] if len(sys.argv) > 1 else "output_rearranging_network")
steps = int(sys.argv[2]) if len(sys.argv) > 2 else STEPS
folder.mkdir(parents=True, exist_ok=True)
actin = F_ACTIN.with_segment_length(SEGMENT_LENGTH)


def network(unbinding_rate):
    """Filaments, linkers and plates in a Simulation, and the tethers of the upper plate with their points."""
    generator = np.random.default_rng(7)
    filaments = Filaments(VISCOSITY, TEMPERATURE)
    size, upper = np.array([WIDTH, DEPTH, THICKNESS]), []
    for number in range(FILAMENTS):
        while True:
            turn = generator.normal(size=3) * [1, 0.4, 0.7]
            start = generator.uniform(0, size)
            end = start + SEGMENTS * SEGMENT_LENGTH * turn / np.linalg.norm(turn)
            if np.all(end > 0) and np.all(end < size):
                break
        filaments.add_straight(actin, SEGMENTS, start, end - start)
        for node, (x, y, z) in enumerate(np.linspace(start, end, SEGMENTS + 1)):
            if z < HELD or z > THICKNESS - HELD:
                tether = filaments.add_tether(number, node, [x, y, z], TETHER)
                if z > HELD:
                    upper.append((tether, number, node, [x, y, z]))
    hand = Hand(binding_rate=2000 / unit.second, reach=60 * unit.nanometer, unbinding_rate=unbinding_rate / unit.second)
    linker = Crosslinker(hands=hand, stiffness=0.05 * unit.piconewton / unit.nanometer)
    filaments.add_linkers(linker, LINKERS, volume=np.prod(size), bound=LINKERS)
    topology, system, positions = filaments.build()
    walls = Slab([0, 0, 0.5 * THICKNESS], [0, 0, 1], THICKNESS)
    system.addForce(filament_wall_force(filaments, system, walls, 0.1 * PICONEWTON))
    integrator = filaments.create_integrator(system, STEP, random_seed=1, checks=False)
    simulation = app.Simulation(topology, system, integrator, openmm.Platform.getPlatformByName("CPU"))
    simulation.context.setPositions(positions)
    return filaments, simulation, upper


def current(simulation):
    """Positions of all nodes in nm."""
    return simulation.context.getState(positions=True).getPositions(asNumpy=True).value_in_unit(unit.nanometer)


def course(filaments, simulation, upper):
    """Stress in Pa and the number of linkers that join filaments after each interval, and places before the shear."""
    here = filaments.in_context(simulation.context)
    tethers, points = [one[0] for one in upper], np.array([one[3] for one in upper])
    particles = [filaments.node_indices[number][node] for _, number, node, _ in upper]
    stresses, joining, before = [], [], None
    for number in range(steps // interval):
        share = np.clip((number / (steps // interval) - FORMED) / (SHEARED - FORMED), 0, 1)
        if share == 0:
            before = current(simulation)
        moved = points + [STRAIN * THICKNESS * share, 0, 0]
        here.move_tethers(tethers, moved)
        forces = []
        for _ in range(10):
            simulation.step(interval // 10)
            forces.append(np.sum(moved[:, 0] - current(simulation)[particles, 0]) * TETHER)
        # 1 pN/um^2 is 1 Pa.
        stresses.append(np.mean(forces) / PICONEWTON / (WIDTH * DEPTH * 1e-6))
        joining.append(here.linkers().counts()[2])
    return np.array(stresses), np.array(joining), before


interval = max(10, steps // FRAMES // 10 * 10)
results = []
for rate in UNBINDING:
    filaments, simulation, upper = network(rate)
    if rate == UNBINDING[-1]:
        with open(folder / "network.cif", "w") as file:
            positions = simulation.context.getState(positions=True).getPositions()
            app.PDBxFile.writeFile(simulation.topology, positions, file, keepIds=True)
        simulation.reporters.append(app.DCDReporter(str(folder / "network.dcd"), interval))
    stresses, joining, before = course(filaments, simulation, upper)
    divided = simulation.integrator.getNumDividedSteps() / (FILAMENTS * steps)
    results.append((rate, stresses, joining, before, current(simulation)))

time = interval * STEP.value_in_unit(unit.millisecond) * np.arange(1, len(results[0][1]) + 1)
begin, end = (share * time[-1] for share in (FORMED, SHEARED))
print(
    f"{steps} steps of {STEP}, {100 * divided:.2g} % of them divided; strain of {STRAIN:g} within {end - begin:.3g} ms"
)
for rate, stresses, joining, *_ in results:
    peak, last = stresses.max(), stresses[-max(1, len(stresses) // 10) :].mean()
    print(f"unbinding at {rate:g}/s: {joining[-1]} of {LINKERS} join; stress {peak:.1f} Pa at most, {last:.1f} at last")

nodes = np.array(filaments.node_indices)
figure, axes = plt.subplots(2, 2, figsize=(12.5, 8.4), layout="constrained")
_, _, _, before, after = results[-1]
shade = (before[nodes[:, :-1]] + before[nodes[:, 1:]])[..., 0].ravel() / 2000
# Some filaments that nothing holds have left.
places = np.concatenate([before, after])[:, 0] / 1000
for panel, shape, title in (
    (axes[0, 0], before, "Before the shear"),
    (axes[0, 1], after, f"After it, at {time[-1]:.3g} ms"),
):
    lines = np.stack([shape[nodes[:, :-1]], shape[nodes[:, 1:]]], axis=2).reshape(-1, 2, 3)[..., [0, 2]] / 1000
    drawn = LineCollection(lines, array=shade, cmap="viridis", linewidths=1.4, capstyle="round")
    panel.add_collection(drawn)
    panel.set(xlim=(places.min() - 0.1, places.max() + 0.1), ylim=(-0.1, THICKNESS / 1000 + 0.1))
    panel.set(aspect="equal", xlabel="x (µm)", ylabel="z (µm)")
    panel.set_title(title, loc="left", fontsize=11)
    moved = 0 if shape is before else STRAIN * THICKNESS / 1000
    panel.axhspan(-0.1, HELD / 1000, color="0.92", zorder=0)
    panel.axhspan((THICKNESS - HELD) / 1000, THICKNESS / 1000 + 0.1, color="0.92", zorder=0)
    if moved:
        panel.annotate("", (moved + 0.9, 1.05), (0.9, 1.05), arrowprops={"arrowstyle": "-|>"})
figure.colorbar(drawn, ax=axes[0, :], label="x before the shear (µm)", aspect=15)
colours = ("#1f6f8b", "#c0392b")
for (rate, stresses, joining, *_), colour in zip(results, colours):
    label = f"unbind at {rate:g}/s" if rate else "never unbind"
    axes[1, 0].plot(time, stresses, color=colour, linewidth=1.8, label=label)
    axes[1, 1].plot(time, joining, color=colour, linewidth=1.8, label=label)
for panel, name in ((axes[1, 0], "shear stress (Pa)"), (axes[1, 1], "linkers that join two filaments")):
    panel.axvspan(begin, end, color="0.93", zorder=0)
    panel.set(xlabel="time (ms)", ylabel=name, xlim=(0, time[-1]))
    panel.legend(frameon=False)
axes[1, 0].text(begin, 0.02, " the plate moves", color="0.4", transform=axes[1, 0].get_xaxis_transform())
axes[1, 1].set_ylim(0, LINKERS)
for panel in axes.flat:
    panel.spines[["top", "right"]].set_visible(False)
figure.savefig(folder / "network.png", dpi=105)
print(f"Wrote network.cif, network.dcd and network.png to {folder}.")
