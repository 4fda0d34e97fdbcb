"""Actin filaments clamped at one end and bent by a force at the other, or all along, against Euler's elastica.

Eight filaments stand side by side. The first two nodes of each are clamped, which fixes position and direction, and
2.1 um are free. A constant force pulls the last node of four of them sideways, and a constant weight per length, in
parts that act on the nodes, all of the other four. At zero temperature they relax to the shape in which bending
balances the load, the elastica: a theta'' = -(F + w (L - s)) cos(theta). For small loads its tip is deflected by
F L^3/(3 a) or w L^4/(8 a).

    python clamped_filament.py [folder] [steps]
"""

import sys
from dataclasses import replace
from pathlib import Path

import matplotlib

matplotlib.use("Agg")

import matplotlib.pyplot as plt
import numpy as np
import openmm
from openmm import app, unit
from scipy.integrate import solve_bvp

from openmm_cylchain import F_ACTIN, Filaments

FORCES = (0.01, 0.02, 0.05, 0.1)  # pN at the end
WEIGHTS = (0.03, 0.06, 0.15, 0.3)  # pN in all
FREE_SEGMENTS = 7
SEGMENT_LENGTH = 300  # nm
LENGTH = FREE_SEGMENTS * SEGMENT_LENGTH
STEPS = 10000
FRAMES = 100
PICONEWTON = 0.602214076  # kJ/(mol nm)

folder = Path(sys.argv[1] if len(sys.argv) > 1 else "output_clamped_filament")
steps = int(sys.argv[2]) if len(sys.argv) > 2 else STEPS
folder.mkdir(parents=True, exist_ok=True)

# The held segment lies before the clamp at x = 0.
# Joints of a/l0, so that loads bend the filament as a rod of the rigidity a.
actin = replace(F_ACTIN.with_segment_length(SEGMENT_LENGTH * unit.nanometer), temperature=None)
filaments = Filaments(viscosity=1e-3 * unit.pascal * unit.second, temperature=0 * unit.kelvin)
loads = [(force, 0.0) for force in FORCES] + [(0.0, weight) for weight in WEIGHTS]
for number in range(len(loads)):
    start = [-SEGMENT_LENGTH, 300 * number, 0]
    filaments.add_straight(actin, FREE_SEGMENTS + 1, start, direction=[1, 0, 0], clamped=[0, 1])
topology, system, positions = filaments.build()

pull = openmm.CustomExternalForce("-force*z")
pull.addPerParticleParameter("force")
for nodes, (force, weight) in zip(filaments.node_indices, loads):
    # Half of a segment's weight acts on each of its ends.
    shares = np.full(FREE_SEGMENTS, weight / FREE_SEGMENTS)
    shares[-1] = force + 0.5 * weight / FREE_SEGMENTS
    for node, share in zip(nodes[2:], shares):
        pull.addParticle(int(node), [share * PICONEWTON])
system.addForce(pull)

step = filaments.recommended_time_step().step * unit.picosecond
integrator = filaments.create_integrator(system, step)
simulation = app.Simulation(topology, system, integrator, openmm.Platform.getPlatformByName("Reference"))
simulation.context.setPositions(positions)
with open(folder / "filaments.cif", "w") as file:
    app.PDBxFile.writeFile(topology, positions, file, keepIds=True)
simulation.reporters.append(app.DCDReporter(str(folder / "filaments.dcd"), max(1, steps // FRAMES)))
simulation.step(steps)
state = simulation.context.getState(positions=True)
final = state.getPositions(asNumpy=True).value_in_unit(unit.nanometer)
shapes = [final[nodes][:, [0, 2]] for nodes in filaments.node_indices]


def elastica(force, weight, rigidity, points=200):
    """Shape (x, z) of a clamped rod under a force at its end and a weight in all, both along z and in kJ/(mol nm)."""

    def slope(s, y):
        angle, curvature = y[0], y[1]
        beyond = force + weight * (1.0 - s / LENGTH)
        return np.array([curvature, -beyond / rigidity * np.cos(angle), np.cos(angle), np.sin(angle)])

    def ends(start, end):
        return np.array([start[0], end[1], start[2], start[3]])

    s = np.linspace(0, LENGTH, points)
    return solve_bvp(slope, ends, s, np.vstack([0 * s, 0 * s, s, 0 * s]), tol=1e-8).sol(s)[2:].T


rigidity = actin.bending_rigidity
simulated_time = (steps * step).value_in_unit(unit.millisecond)
print(f"{steps} steps of {step.value_in_unit(unit.microsecond):.2f} us, {simulated_time:.0f} ms in all.")
print("Deflection (nm):       simulation   elastica   small loads")
theories = []
for (force, weight), shape in zip(loads, shapes):
    theories.append(elastica(force * PICONEWTON, weight * PICONEWTON, rigidity))
    small = (force / 3 + weight / 8) * PICONEWTON * LENGTH**3 / rigidity
    label = f"{force:.2f} pN at the end" if force else f"{weight:.2f} pN all along"
    print(f"{label:22} {shape[-1, 1]:10.1f} {theories[-1][-1, 1]:10.1f} {small:13.1f}")

figure, panels = plt.subplots(1, 3, figsize=(13.5, 4.6), gridspec_kw={"width_ratios": [1.2, 1.2, 1]})
colours = plt.cm.viridis(np.linspace(0.05, 0.8, len(FORCES)))
for axes, first, title, values in (
    (panels[0], 0, "A force at the end", FORCES),
    (panels[1], len(FORCES), "A weight all along", WEIGHTS),
):
    for number, (value, colour) in enumerate(zip(values, colours), start=first):
        axes.plot(*(theories[number] / 1000).T, color=colour, linewidth=5, alpha=0.35)
        axes.plot(*(shapes[number] / 1000).T, "o-", color=colour, markersize=4, linewidth=1, label=f"{value:g} pN")
    axes.plot([], [], color="grey", linewidth=5, alpha=0.35, label="elastica")
    axes.axvspan(-0.4, 0, color="0.9", zorder=0)
    axes.text(-0.2, 1.2, "clamped", ha="center", color="0.35", rotation=90)
    axes.set(xlabel="x (µm)", ylabel="z (µm)", aspect="equal", xlim=(-0.4, 2.2), ylim=(-0.15, 1.8))
    axes.legend(frameon=False, loc="upper left", bbox_to_anchor=(0.17, 1.0))
    axes.set_title(title)

grid = np.geomspace(0.2, 20, 25)
for scale, marker, colour, label, values, first, part in (
    (3, "o", "#1f6f8b", "force at the end", FORCES, 0, (1, 0)),
    (8, "s", "#c0392b", "weight all along", WEIGHTS, len(FORCES), (0, 1)),
):
    unit_load = rigidity / LENGTH**2
    curve = [elastica(part[0] * load * unit_load, part[1] * load * unit_load, rigidity)[-1, 1] for load in grid]
    panels[2].plot(grid, np.array(curve) / LENGTH, color=colour, label=f"elastica, {label}")
    panels[2].plot(grid, grid / scale, "--", color=colour, linewidth=0.8)
    tips = [shapes[first + number][-1, 1] / LENGTH for number in range(len(values))]
    panels[2].plot(np.array(values) * PICONEWTON / unit_load, tips, marker, color=colour, markersize=8)
panels[2].set(
    xscale="log", yscale="log", ylim=(0.02, 1.5), xlabel="load  ($a/L^2$)", ylabel="deflection of the tip  ($L$)"
)
panels[2].legend(frameon=False, loc="lower right")
panels[2].set_title("Deflection; dashed: small loads")
for axes in panels:
    axes.spines[["top", "right"]].set_visible(False)
figure.tight_layout()
figure.savefig(folder / "filaments.png", dpi=150)
print(f"Wrote filaments.cif, filaments.dcd and filaments.png to {folder}.")
