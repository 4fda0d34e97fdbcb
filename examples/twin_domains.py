"""Twin domains: a polymerase that cannot turn, and DNA that is overwound ahead of it and underwound behind.

DNA of 800 nm is held at both ends, so far apart that it is slack. In its middle, a polymerase follows the helix as it
walks. What is bound to it, RNA and proteins, keeps it from turning: so the DNA turns, by one turn for each 3.57 nm (Liu
and Wang, Proc. Natl. Acad. Sci. USA 1987, 84, 7024). Both sides take turns up as twist, and coil up. Torque slows the
polymerase down, and stops it at 11 pN nm (Ma, Bai and Wang, Science 2013, 340, 1580). It walks some thousand times as
fast as one does, which is slow beside how twist spreads; but supercoils would have more time to move.

    python twin_domains.py [folder] [steps]
"""

import sys
from dataclasses import replace
from pathlib import Path

import matplotlib

matplotlib.use("Agg")

import matplotlib.pyplot as plt
import numpy as np
import openmm
from matplotlib.collections import LineCollection
from openmm import app, unit

from openmm_cylchain import DSDNA, Crosslinker, Filaments, Hand, HandOnHelix, capsule_contact_force

SEGMENTS, SEGMENT_LENGTH = 160, 5.0  # nm
PITCH = 3.57  # nm: 10.5 base pairs
STALL_TORQUE = 11.0  # pN nm
PICONEWTON = 0.602214076  # kJ/(mol nm)
# Beyond the recommended step, which resolves how segments turn.
STEP = 20 * unit.nanosecond
STEPS = 25000
FRAMES = 250
VISCOSITY = 1e-3 * unit.pascal * unit.second
TEMPERATURE = 298 * unit.kelvin

folder = Path(sys.argv[1] if len(sys.argv) > 1 else "output_twin_domains")
steps = int(sys.argv[2]) if len(sys.argv) > 2 else STEPS
folder.mkdir(parents=True, exist_ok=True)

dna = replace(
    DSDNA.with_segment_length(SEGMENT_LENGTH), twist_persistence_length=100 * unit.nanometer, temperature=TEMPERATURE
)
# An arc between both ends, 0.7 of the length apart, straight along z where these are held.
length = SEGMENTS * SEGMENT_LENGTH
angles = 1.14 * np.sin(2.0 * np.pi * (np.arange(SEGMENTS) + 0.5) / SEGMENTS)
steps_along = SEGMENT_LENGTH * np.column_stack([np.sin(angles), np.zeros(SEGMENTS), np.cos(angles)])
nodes = np.vstack([np.zeros(3), np.cumsum(steps_along, axis=0)])
hold = [0, 1, SEGMENTS - 1, SEGMENTS]
filaments = Filaments(VISCOSITY, TEMPERATURE)
filaments.add_nodes(dna, nodes, clamped=hold)
for end in ("minus", "plus"):
    filaments.add_end_frame(0, end, [0, 0, 1])
bound = {"binding_rate": 0.0, "reach": 5 * unit.nanometer, "unbinding_rate": 0.0}
polymerase = Crosslinker(
    name="polymerase",
    hands=[
        Hand(
            **bound,
            speed=0.1 * unit.nanometer / unit.microsecond,
            walks_backward=True,
            helix=HandOnHelix(
                pitch=PITCH * unit.nanometer,
                rotational_friction=1 * unit.piconewton * unit.nanometer * unit.second,
                stall_torque=STALL_TORQUE * unit.piconewton * unit.nanometer,
            ),
        ),
        Hand(**bound),  # of nothing
    ],
    stiffness=1 * unit.piconewton / unit.nanometer,
)
start = 0.5 * length
filaments.add_linkers(polymerase, count=1, bound=1, volume=1 * unit.micrometer**3, places=[(0, start)])
topology, system, positions = filaments.build()
system.addForce(capsule_contact_force(filaments, system, 5 * unit.nanometer))
integrator = filaments.create_integrator(system, STEP, random_seed=1, checks=False)
simulation = app.Simulation(topology, system, integrator, openmm.Platform.getPlatformByName("CPU"))
simulation.context.setPositions(positions)
with open(folder / "domains.cif", "w") as file:
    app.PDBxFile.writeFile(topology, positions, file, keepIds=True)
here = filaments.in_context(simulation.context)
interval = max(1, steps // FRAMES)
simulation.reporters.append(app.DCDReporter(str(folder / "domains.dcd"), interval))

walked, twists = [], []
for _ in range(steps // interval):
    simulation.step(interval)
    walked.append(here.linkers().arc_lengths[0, 0] - start)
    twists.append(here.twists(0).value_in_unit(unit.radian)[1:-1])
walked, twists = np.array(walked), np.array(twists)
time = STEP.value_in_unit(unit.microsecond) * interval * np.arange(1, len(walked) + 1)
joints = SEGMENT_LENGTH * np.arange(1, SEGMENTS)
ahead = joints[None, :] > (start + walked)[:, None] + SEGMENT_LENGTH
behind = joints[None, :] < (start + walked)[:, None] - SEGMENT_LENGTH
torque = dna.twist_stiffness * twists / PICONEWTON
sides = {
    "ahead": (ahead, walked / (length - start - walked), "#D55E00"),
    "behind": (behind, -walked / (start + walked), "#0072B2"),
}
late = slice(3 * len(time) // 4, None)
print(f"{steps} steps of {STEP}, {integrator.getNumDividedSteps()} divided; {time[-1]:.3g} us")
print(f"The polymerase has walked {walked[-1]:.1f} nm, {walked[-1] / PITCH:.1f} turns of the helix")
print("         turns over those at rest  of these twist  torque (pN nm)")
means = {}
for name, (joined, density, _) in sides.items():
    means[name] = (torque * joined).sum(axis=1) / joined.sum(axis=1)
    twisted = (twists * joined).sum(axis=1) / joined.sum(axis=1) * PITCH / (2.0 * np.pi * SEGMENT_LENGTH)
    share = twisted[late].mean() / density[late].mean()
    print(f"{name:8s} {density[-1]:10.3f} {share:28.2f} {means[name][late].mean():15.1f}")

figure = plt.figure(figsize=(12, 7), layout="constrained")
grid = figure.add_gridspec(2, 2, height_ratios=(1.0, 1.6))
top = figure.add_subplot(grid[0, :])
shape = simulation.context.getState(positions=True).getPositions(asNumpy=True).value_in_unit(unit.nanometer)
shape = shape[filaments.node_indices[0]]
# Seen along the axis across which it is thinnest.
across = shape[:, :2] @ np.linalg.eigh(shape[:, :2].T @ shape[:, :2])[1][:, 1]
shape = np.column_stack([shape[:, 2], across])
at = start + walked[-1]
colours = [sides["ahead" if own > at else "behind"][2] for own in SEGMENT_LENGTH * (np.arange(SEGMENTS) + 0.5)]
lines = np.stack([shape[:-1], shape[1:]], axis=1)
top.add_collection(LineCollection(lines, colors=colours, linewidths=4, capstyle="round"))
place = [np.interp(at, SEGMENT_LENGTH * np.arange(SEGMENTS + 1), shape[:, k]) for k in (0, 1)]
top.plot(*place, "o", color="0.25", markersize=14, label="polymerase, walks to the right")
top.plot(shape[[0, -1], 0], shape[[0, -1], 1], "s", color="0.6", markersize=9, label="held")
for name, text in (("ahead", "overwound"), ("behind", "underwound")):
    top.plot([], [], color=sides[name][2], linewidth=4, label=text)
top.autoscale()
top.set(aspect="equal", xlabel="nm", ylabel="nm")
top.legend(frameon=False, loc="lower center", ncols=4, bbox_to_anchor=(0.5, 1.0))
left, right = figure.add_subplot(grid[1, 0]), figure.add_subplot(grid[1, 1])
smooth = max(1, len(time) // 25)
blocks = len(time) // smooth * smooth
for name, (_, density, colour) in sides.items():
    left.plot(time, density, color=colour, label=name)
    # Means of some reports: torques fluctuate.
    mean = means[name][:blocks].reshape(-1, smooth).mean(axis=1)
    right.plot(time[:blocks].reshape(-1, smooth).mean(axis=1), mean, "o-", color=colour, linewidth=0.8, label=name)
left.set(ylabel="turns, over those at rest", title=f"{walked[-1] / PITCH:.1f} turns of the helix walked")
right.set(ylabel="torque (pN nm)", title=f"Torque: {STALL_TORQUE:g} pN nm from side to side stop it")
for axes in (left, right):
    axes.axhline(0, color="0.8", linewidth=1, zorder=0)
    axes.set(xlabel="time (µs)", xlim=(0, time[-1]))
    axes.legend(frameon=False)
for axes in (top, left, right):
    axes.spines[["top", "right"]].set_visible(False)
figure.savefig(folder / "domains.png", dpi=110)
print(f"Wrote domains.cif, domains.dcd and domains.png to {folder}.")
