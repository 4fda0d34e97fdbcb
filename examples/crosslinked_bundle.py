"""A bundle of actin filaments under load: crosslinks that bind and break while it slides apart.

Six filaments of 3 um lie side by side. Crosslinkers bind between sites of neighbouring filaments that come near each
other and break at the rate k0 exp(F/F0) of Bell, Science 1978, 200, 618, for the force F that they carry. Once the
bundle has formed, every other filament is pulled to the right by its end and the others to the left. Without crosslinks
they would fly apart; with them they creep, because crosslinks break, and bind again further on. (Rates are a hundred
times those of alpha-actinin, so that some tens of milliseconds show it.) Crosslinks join places on segments, which are
in the implicit step, as bending and stretching are: it may take 10 us.

    python crosslinked_bundle.py [folder] [steps]
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
from scipy.spatial import cKDTree

from openmm_cylchain import F_ACTIN, CrosslinkReporter, Crosslinks, Filaments, change_constant_force, constant_force

FILAMENTS, SEGMENTS, SEGMENT_LENGTH = 6, 30, 100.0  # nm
SPACING = 35.0  # nm, also the rest length of a crosslink
STIFFNESS = 0.05 * unit.piconewton / unit.nanometer
REACH = 45.0  # nm
PICONEWTON = 0.602214076  # kJ/(mol nm)
LOAD = 15 * PICONEWTON
BREAKING_FORCE = 2 * PICONEWTON  # F0
BINDING_RATE, BREAKING_RATE = 5e-9, 2e-11  # 1/ps; k0 is the second
STEP = 10 * unit.microsecond
STEPS = 4000
FRAMES = 100
BOUND = 0.25  # of the steps, before the load
VISCOSITY = 1e-3 * unit.pascal * unit.second
TEMPERATURE = 310 * unit.kelvin

folder = Path(sys.argv[1] if len(sys.argv) > 1 else "output_crosslinked_bundle")
steps = int(sys.argv[2]) if len(sys.argv) > 2 else STEPS
folder.mkdir(parents=True, exist_ok=True)
generator = np.random.default_rng(5)

actin = F_ACTIN.with_segment_length(SEGMENT_LENGTH)
filaments = Filaments(VISCOSITY, TEMPERATURE)
for number in range(FILAMENTS):
    filaments.add_straight(actin, SEGMENTS, start=[0, SPACING * number, 0], direction=[1, 0, 0])
topology, system, positions = filaments.build()
links = Crosslinks(STIFFNESS, SPACING)
links.add_to(system)
nodes = np.array(filaments.node_indices)
signs = np.where(np.arange(FILAMENTS) % 2, -1.0, 1.0)
load = constant_force(np.where(signs > 0, nodes[:, -1], nodes[:, 0]), [0, 0, 0])
system.addForce(load)
integrator = filaments.create_integrator(system, STEP, random_seed=1)
simulation = app.Simulation(topology, system, integrator, openmm.Platform.getPlatformByName("CPU"))
context = simulation.context
context.setPositions(positions)
with open(folder / "bundle.cif", "w") as file:
    app.PDBxFile.writeFile(topology, positions, file, keepIds=True)
interval = max(1, steps // FRAMES)
simulation.reporters.append(app.DCDReporter(str(folder / "bundle.dcd"), interval))
report = CrosslinkReporter(None, interval, links)
simulation.reporters.append(report)

# Crosslinks bind the middles of segments. A place is known by the node at the beginning of its segment.
places = [filaments.segment_place(n, segment=segment) for n in range(FILAMENTS) for segment in range(SEGMENTS)]
sites = np.array([place.first for place in places])
owner = np.repeat(np.arange(FILAMENTS), SEGMENTS)


def current_positions():
    return context.getState(positions=True).getPositions(asNumpy=True).value_in_unit(unit.nanometer)


def middles(shape):
    """Where the sites are in an array of all positions."""
    return 0.5 * (shape[sites] + shape[sites + 1])


def break_loaded(elapsed):
    """Remove crosslinks at the rate of Bell; returns how many, and how many that rate lets expect."""
    rates = BREAKING_RATE * np.exp(links.forces(context) / BREAKING_FORCE)
    chances = -np.expm1(-rates * elapsed)
    broken = generator.random(len(chances)) < chances
    if broken.any():
        links.remove(context, links.numbers(context)[broken])
    return broken.sum(), chances.sum()


def bind_near(elapsed):
    """Bind free sites of neighbouring filaments that are in reach of each other; returns how many pairs."""
    bound = np.isin(sites, links.pairs(context))
    near = cKDTree(middles(current_positions())).query_pairs(REACH, output_type="ndarray")
    near = near[np.abs(owner[near[:, 0]] - owner[near[:, 1]]) == 1]
    near = near[generator.random(len(near)) < -np.expm1(-BINDING_RATE * elapsed)]
    count = 0
    for first, second in near:
        if not bound[first] and not bound[second]:
            links.add(context, places[first], places[second])
            bound[[first, second]] = True
            count += 1
    return count


def snapshot():
    """Nodes, and the ends of crosslinks, both in um, and the forces that crosslinks carry, in pN."""
    shape, pairs = current_positions() / 1000, links.pairs(context)
    return shape, middles(shape)[np.searchsorted(sites, pairs)], links.forces(context) / PICONEWTON


elapsed = STEP.value_in_unit(unit.picosecond)
loaded_at = int(BOUND * steps) // interval * interval
expected_breaks = breaks = bindings = 0
slid, snapshots = [], []
while simulation.currentStep < steps:
    if simulation.currentStep == loaded_at:
        snapshots.append(snapshot())
        change_constant_force(load, context, LOAD * signs[:, None] * [1, 0, 0])
    simulation.step(1)
    broken, expected = break_loaded(elapsed)
    breaks, expected_breaks = breaks + broken, expected_breaks + expected
    bindings += bind_near(elapsed)
    centers = current_positions()[nodes][..., 0].mean(axis=1)
    slid.append(centers[signs > 0].mean() - centers[signs < 0].mean())
snapshots.append(snapshot())
divided = integrator.getNumDividedSteps() / (FILAMENTS * steps)

milliseconds = STEP.value_in_unit(unit.millisecond)
friction = SEGMENTS * actin.segment_friction(VISCOSITY, TEMPERATURE).parallel
free = 2 * LOAD / friction * (steps - loaded_at) * elapsed
print(f"{steps} steps of {STEP}, {100 * divided:.2g} % of them divided; {steps * milliseconds:.3g} ms in all")
print(f"load from {loaded_at * milliseconds:.3g} ms on")
print(f"{bindings} crosslinks have bound and {breaks} broken; {expected_breaks:.0f} expected to break at Bell's rate")
print(f"crosslinks when the load came: {len(snapshots[0][2])}; at the end: {len(snapshots[-1][2])}")
print(f"filaments have slid apart by {slid[-1] - slid[0]:.0f} nm; {free:.0f} nm without crosslinks")

figure, panels = plt.subplots(3, 1, figsize=(9.5, 6.4), height_ratios=(1, 1, 1.5), layout="constrained")
ends = np.concatenate([shape for shape, _, _ in snapshots])
low, high = ends.min(axis=0) - 0.05, ends.max(axis=0) + 0.05
for axes, (shape, crosslinks, forces), title in zip(panels, snapshots, ("Before the load", "At the end")):
    for sign, own, label in zip(signs, nodes, ("pulled to the right", "pulled to the left", *[None] * FILAMENTS)):
        color = "#c0392b" if sign > 0 else "#1f6f8b"
        axes.plot(*shape[own, :2].T, color=color, linewidth=1.3, label=label)
    lines = LineCollection(crosslinks[..., :2], array=forces, cmap="viridis_r", clim=(0, 3), linewidths=2, zorder=3)
    axes.add_collection(lines)
    axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), aspect="equal", ylabel="y (µm)")
    axes.set_title(f"{title}: {len(crosslinks)} crosslinks", loc="left", fontsize=11)
    axes.spines[["top", "right"]].set_visible(False)
panels[0].legend(frameon=False, ncols=2, loc="lower right", bbox_to_anchor=(1, 1))
panels[1].set_xlabel("x (µm)")
figure.colorbar(lines, ax=panels[:2], label="force of a crosslink (pN)", extend="max", aspect=20)
panels[2].plot(report.step * milliseconds, report.count, color="0.25", linewidth=1.6)
panels[2].set(xlabel="time (ms)", ylabel="crosslinks", xlim=(0, steps * milliseconds), ylim=(0, None))
panels[2].axvspan(loaded_at * milliseconds, steps * milliseconds, color="0.93", zorder=0)
panels[2].text(BOUND + 0.01, 0.3, f"load {LOAD / PICONEWTON:g} pN", color="0.4", transform=panels[2].transAxes)
right = panels[2].twinx()
right.plot(milliseconds * np.arange(1, steps + 1), np.array(slid) / 1000, color="#c0392b", linewidth=1.6)
right.set_ylabel("slid apart (µm)", color="#c0392b")
for axes in (panels[2], right):
    axes.spines["top"].set_visible(False)
figure.savefig(folder / "bundle.png", dpi=130)
print(f"Wrote bundle.cif, bundle.dcd and bundle.png to {folder}.")
