"""Plasmids of 3 kilobases that supercoil: rings of DNA that are closed with too few turns.

Three rings begin as flat circles, all turns that are missing in their twist: none, 3 % and 6 % of the turns of relaxed
DNA. Writhe takes up twist, while the linking number, their sum, stays to rounding, since contacts let no strand pass.
Rings of bacteria have about 6 %; of their missing turns 0.7 are writhe, in pictures of electron microscopes (Boles,
White and Cozzarelli, J. Mol. Biol. 1990, 213, 931) and in Monte Carlo (Vologodskii et al., J. Mol. Biol. 1992, 227,
1224), at all densities.

    python supercoiled_plasmid.py [folder] [steps]
"""

import sys
from pathlib import Path

import matplotlib

matplotlib.use("Agg")

import matplotlib.pyplot as plt
import numpy as np
import openmm
from matplotlib.collections import LineCollection
from matplotlib.colors import to_rgb
from openmm import app, unit

from openmm_cylchain import Filaments, FilamentType, analysis, capsule_contact_force

SEGMENTS, SEGMENT_LENGTH = 120, 8.5  # nm: 25 base pairs
DENSITIES = (0.0, -0.03, -0.06)  # of supercoiling: missing turns over those of relaxed DNA
BASE_PAIR, PITCH = 0.34, 10.5  # nm, and base pairs in a turn
# Beyond the recommended step of 1.8 ns, which resolves how segments turn: writhe at 5 ns is the same.
STEP = 10 * unit.nanosecond
STEPS = 40000
FRAMES = 200
VISCOSITY = 1e-3 * unit.pascal * unit.second
TEMPERATURE = 298 * unit.kelvin

folder = Path(sys.argv[1] if len(sys.argv) > 1 else "output_supercoiled_plasmid")
steps = int(sys.argv[2]) if len(sys.argv) > 2 else STEPS
folder.mkdir(parents=True, exist_ok=True)

dna = FilamentType(
    name="DNA",
    diameter=2 * unit.nanometer,
    segment_length=SEGMENT_LENGTH * unit.nanometer,
    persistence_length=50 * unit.nanometer,
    twist_persistence_length=75 * unit.nanometer,
    temperature=TEMPERATURE,
    stretching_modulus=1100 * unit.piconewton,
    mass_per_length=1940 * unit.dalton / unit.nanometer,
)
filaments = Filaments(VISCOSITY, TEMPERATURE)
for number in range(len(DENSITIES)):
    filaments.add_ring(dna, SEGMENTS, [500.0 * number, 0, 0])
topology, system, positions = filaments.build()
# DNA in 0.1 M of salt keeps off by its charge, too: it is as if it were 5 nm thick.
system.addForce(capsule_contact_force(filaments, system, 5 * unit.nanometer))
integrator = filaments.create_integrator(system, STEP, random_seed=1, checks=False)
simulation = app.Simulation(topology, system, integrator, openmm.Platform.getPlatformByName("CPU"))
simulation.context.setPositions(positions)
with open(folder / "plasmids.cif", "w") as file:
    app.PDBxFile.writeFile(topology, positions, file, keepIds=True)
here = filaments.in_context(simulation.context)
closed_with = np.array(DENSITIES) * SEGMENTS * SEGMENT_LENGTH / BASE_PAIR / PITCH
for number, turns in enumerate(closed_with):
    here.set_twists(number, np.full(SEGMENTS, 2 * np.pi * turns / SEGMENTS))
interval = max(1, steps // FRAMES)
simulation.reporters.append(app.DCDReporter(str(folder / "plasmids.dcd"), interval))

writhes, twists, radii = [], [], []
for _ in range(steps // interval):
    simulation.step(interval)
    nodes = simulation.context.getState(positions=True).getPositions(asNumpy=True).value_in_unit(unit.nanometer)
    rings = [nodes[own] for own in filaments.node_indices]
    writhes.append([analysis.writhe(ring) for ring in rings])
    twists.append([here.twists(number).value_in_unit(unit.radian).sum() / (2 * np.pi) for number in range(len(rings))])
    radii.append([np.sqrt(np.mean(np.sum((ring - ring.mean(axis=0)) ** 2, axis=1))) for ring in rings])
writhes, twists, radii = np.array(writhes), np.array(twists), np.array(radii)

time = STEP.value_in_unit(unit.microsecond) * interval * np.arange(1, len(writhes) + 1)
late = slice(len(time) // 2, None)
print(f"{steps} steps of {STEP}, {integrator.getNumDividedSteps()} divided; {time[-1]:.3g} us")
print("      turns    twist   writhe  share of writhe  radius of gyration (nm)")
for number, turns in enumerate(closed_with):
    twist, writhe = twists[late, number].mean(), writhes[late, number].mean()
    share = f"{writhe / turns:10.2f}" if turns else "          "
    print(f"{turns:10.2f} {twist:10.2f} {writhe:8.2f}   {share}  {radii[late, number].mean():16.1f}")
print(f"Linking numbers have changed by {np.abs(writhes + twists - closed_with).max():.1g}")

colours = ("0.45", "#0072B2", "#D55E00")
figure = plt.figure(figsize=(12, 5.5), layout="constrained")
left, right = figure.subplots(1, 2, width_ratios=(1.25, 1))
x = 0.0
for number, ring in enumerate(rings):
    # Seen from where it is broadest, with its longest axis upright; what is behind is paler.
    shape = ring - ring.mean(axis=0)
    shape = (shape @ np.linalg.eigh(shape.T @ shape)[1])[:, [1, 2, 0]]
    shape[:, 0] += x - shape[:, 0].min()
    closed = np.concatenate([shape, shape[:1]])
    pieces = np.stack([closed[:-1, :2], closed[1:, :2]], axis=1)
    depth = 0.5 * (closed[:-1, 2] + closed[1:, 2])
    order = np.argsort(depth)
    strength = np.linspace(0.4, 1.0, len(order))[:, None]
    paler = strength * to_rgb(colours[number]) + (1.0 - strength)
    left.add_collection(LineCollection(pieces[order], colors=paler, linewidths=4, capstyle="round"))
    left.plot([], [], color=colours[number], linewidth=4, label=f"{abs(closed_with[number]):.1f} turns missing")
    x = shape[:, 0].max() + 40
left.autoscale()
left.set(aspect="equal", xlabel="nm", ylabel="nm")
left.legend(frameon=False, loc="lower center", ncols=3, bbox_to_anchor=(0.5, -0.45))
left.set_title(f"After {time[-1]:.3g} µs", fontsize=11)
for number, turns in enumerate(closed_with):
    right.plot(time, writhes[:, number], color=colours[number])
    right.axhline(0.72 * turns, color=colours[number], linewidth=1, linestyle="--")
right.set(xlabel="time (µs)", ylabel="writhe", xlim=(0, time[-1]))
right.set_title("Writhe; dashed: 0.72 of the missing turns", fontsize=11)
for axes in (left, right):
    axes.spines[["top", "right"]].set_visible(False)
figure.savefig(folder / "plasmids.png", dpi=110)
print(f"Wrote plasmids.cif, plasmids.dcd and plasmids.png to {folder}.")
