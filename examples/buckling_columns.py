"""Microtubules of two beam elements that buckle under forces along them, against Euler's elastica.

Columns of 10 um are clamped at the foot: their first node does not move, and its tangent does not turn. Forces of 0.8
to 2.2 times the critical load pi^2 a/(4 L^2) press on their ends, and hardly one across. At zero temperature they relax
to the shape a theta'' = -F sin(theta), which below the critical load is straight.

    python buckling_columns.py [folder] [steps]
"""

import sys
import warnings
from pathlib import Path

import matplotlib

matplotlib.use("Agg")

import matplotlib.pyplot as plt
import mdtraj
import numpy as np
import openmm
from openmm import app, unit
from scipy.integrate import solve_bvp

from openmm_cylchain import Filaments, FilamentType, TimeStepWarning, analysis

LOADS = (0.8, 1.05, 1.15, 1.3, 1.7, 2.2)  # of the critical one
LENGTH = 10000.0  # nm
ELEMENTS = 2
STEPS = 6000
FRAMES = 100
NUDGE = 1e-4  # of the load, across
PICONEWTON = 0.602214076  # kJ/(mol nm)

folder = Path(sys.argv[1] if len(sys.argv) > 1 else "output_buckling_columns")
steps = int(sys.argv[2]) if len(sys.argv) > 2 else STEPS
folder.mkdir(parents=True, exist_ok=True)

microtubule = FilamentType(
    name="MT",
    diameter=25 * unit.nanometer,
    segment_length=LENGTH / ELEMENTS,
    bending_rigidity=2.2e-23 * unit.newton * unit.meter**2,
    stretching_modulus=200e-9 * unit.newton,
    friction_length="filament",
    element="beam",
)
filaments = Filaments(viscosity=1e-3 * unit.pascal * unit.second, temperature=0 * unit.kelvin)
for number in range(len(LOADS)):
    foot = [2500 * number, 0, 0]
    filaments.add_straight(microtubule, ELEMENTS, foot, direction=[0, 0, 1], clamped=0, clamped_tangents=0)
topology, system, positions = filaments.build()

rigidity = microtubule.bending_rigidity
critical = 0.25 * np.pi**2 * rigidity / LENGTH**2
press = openmm.CustomExternalForce("force*z-nudge*x")
press.addPerParticleParameter("force")
press.addPerParticleParameter("nudge")
for nodes, load in zip(filaments.node_indices, LOADS):
    press.addParticle(int(nodes[-1]), [load * critical, NUDGE * load * critical])
system.addForce(press)

# Forty times the recommended step: nothing fluctuates, and where the columns come to rest does not depend on it.
warnings.simplefilter("ignore", TimeStepWarning)
step = 40 * filaments.recommended_time_step().step * unit.picosecond
integrator = filaments.create_integrator(system, step)
simulation = app.Simulation(topology, system, integrator, openmm.Platform.getPlatformByName("Reference"))
simulation.context.setPositions(positions)
with open(folder / "columns.cif", "w") as file:
    app.PDBxFile.writeFile(topology, positions, file, keepIds=True)
simulation.reporters.append(app.DCDReporter(str(folder / "columns.dcd"), max(1, steps // FRAMES)))
simulation.step(steps)

# Points along the curves, eight for each element.
last = mdtraj.load(str(folder / "columns.dcd"), top=str(folder / "columns.cif"))[-1]
shapes = [line[0][:, [0, 2]] for line in analysis.filament_curves(last)]
tips = np.array([shape[-1] - shape[0] for shape in shapes]) / LENGTH


def elastica(load):
    """Shape (x, z)/L of a column that is clamped at its foot, under a load in units of the critical one."""

    def slope(s, y):
        return np.array([y[1], -0.25 * np.pi**2 * load * np.sin(y[0]), np.sin(y[0]), np.cos(y[0])])

    def ends(start, end):
        return np.array([start[0], end[1], start[2], start[3]])

    s = np.linspace(0, 1, 200)
    angle = min(2.0, 2.5 * np.sqrt(max(load - 1.0, 0.0))) * np.sin(0.5 * np.pi * s)
    return solve_bvp(slope, ends, s, np.vstack([angle, np.gradient(angle, s), 0 * s, s]), tol=1e-8).sol(s)[2:].T


simulated_time = (steps * step).value_in_unit(unit.second)
print(f"{steps} steps of {step.value_in_unit(unit.millisecond):.2f} ms, {simulated_time:.0f} s in all.")
print("Tip aside (L), load:   two elements   elastica")
theories = [elastica(load) for load in LOADS]
for load, tip, theory in zip(LOADS, tips, theories):
    print(f"{load:20.2f} {tip[0]:14.4f} {theory[-1, 0]:10.4f}")

figure, (left, right) = plt.subplots(1, 2, figsize=(11, 5), gridspec_kw={"width_ratios": [1.7, 1]})
for load, shape, theory, colour in zip(LOADS, shapes, theories, plt.cm.viridis(np.linspace(0.05, 0.8, len(LOADS)))):
    foot = shape[0] / 1000
    left.plot(*(theory * LENGTH / 1000 + foot).T, color=colour, linewidth=6, alpha=0.35)
    left.plot(*(shape / 1000).T, color=colour, linewidth=1.5)
    left.plot(*(shape[:: (len(shape) - 1) // ELEMENTS] / 1000).T, "o", color=colour, markersize=6)
    left.text(foot[0], -0.35, f"{load:g}", ha="center", va="top", color=colour)
left.axhspan(-0.25, 0, color="0.9", zorder=0)
left.plot([], [], color="grey", linewidth=6, alpha=0.35, label="elastica")
left.plot([], [], "o-", color="grey", markersize=6, linewidth=1.5, label="two beam elements, their nodes")
left.set(xlabel="x (µm)", ylabel="z (µm)", aspect="equal", ylim=(-1.2, 12))
left.legend(frameon=False, loc="upper right", ncols=2)
left.set_title("Columns; load in units of the critical one")

grid = np.linspace(1.001, 2.4, 60)
right.plot([0.7, 1.0, *grid], [0, 0, *[elastica(load)[-1, 0] for load in grid]], color="0.5", label="elastica")
right.plot(LOADS, tips[:, 0], "o", color="#1f6f8b", markersize=8, label="two beam elements")
right.set(xlabel="load / critical load", ylabel="tip aside  ($L$)")
right.legend(frameon=False, loc="lower right")
right.set_title("They bend beyond the critical load")
for axes in (left, right):
    axes.spines[["top", "right"]].set_visible(False)
figure.tight_layout()
figure.savefig(folder / "columns.png", dpi=150)
print(f"Wrote columns.cif, columns.dcd and columns.png to {folder}.")
