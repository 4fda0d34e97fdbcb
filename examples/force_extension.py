"""Force-extension curve of DNA in one run: pulled by a trap at constant velocity, against theory.

Twenty-four DNA molecules of 160 nm are held at one end. The other end is in a harmonic trap, which moves away until the
molecules carry 12 pN. Forces and extensions that were recorded on the way are averaged in windows of time. They are
compared with the exact mean extension of the discrete chain under a constant force, and with the interpolation of Marko
and Siggia for an inextensible wormlike chain. A trap also confines the end across the force, where a constant force
leaves it to wander: for a stiffness k this adds k_BT/F - k_BT/(F + k x) to the extension x, if that is little.

    python force_extension.py [folder] [steps]
"""

import sys
from pathlib import Path

import matplotlib

matplotlib.use("Agg")

import matplotlib.pyplot as plt
import numpy as np
import openmm
from openmm import app, unit

from openmm_cylchain import DSDNA, ConstantVelocityPulling, Filaments, theory

MOLECULES, SEGMENTS = 24, 20
PICONEWTON = 0.602214076  # kJ/(mol nm)
STIFFNESS = 0.05 * PICONEWTON  # of the trap, per nm
START, TRAVEL = 120.0, 280.0  # nm
# The recommended step is 1.6 ns; at 4 ns extensions are still good to about 0.1 %.
STEP = 4 * unit.nanosecond
STEPS = 400000
EQUILIBRATION = 0.05  # of the steps, before the trap moves
FRAMES = 100
WINDOWS = 22
VISCOSITY = 1e-3 * unit.pascal * unit.second
TEMPERATURE = 298 * unit.kelvin

folder = Path(sys.argv[1] if len(sys.argv) > 1 else "output_force_extension")
steps = int(sys.argv[2]) if len(sys.argv) > 2 else STEPS
folder.mkdir(parents=True, exist_ok=True)

filaments = Filaments(VISCOSITY, TEMPERATURE)
tethers = []
for number in range(MOLECULES):
    first = np.array([0.0, 200.0 * number, 0.0])
    filaments.add_equilibrium(DSDNA, SEGMENTS, seed=number, start=first, direction=[1, 0, 0], clamped=[0])
    tethers.append(filaments.add_tether(number, -1, first + [START, 0, 0], STIFFNESS))
topology, system, positions = filaments.build()
integrator = filaments.create_integrator(system, STEP, random_seed=1)
simulation = app.Simulation(topology, system, integrator, openmm.Platform.getPlatformByName("CPU"))
simulation.context.setPositions(positions)
with open(folder / "dna.cif", "w") as file:
    app.PDBxFile.writeFile(topology, positions, file, keepIds=True)
simulation.reporters.append(app.DCDReporter(str(folder / "dna.dcd"), max(1, steps // FRAMES)))
waiting = int(EQUILIBRATION * steps)
velocity = TRAVEL / ((steps - waiting) * STEP.value_in_unit(unit.picosecond))
pulling = ConstantVelocityPulling(
    None, max(1, steps // 4000), filaments, tethers, [velocity, 0, 0], start_time=waiting * STEP
)
simulation.reporters.append(pulling)
shapes = []
for part in range(4):
    simulation.step(steps // 4 + (steps % 4 if part == 3 else 0))
    shape = simulation.context.getState(positions=True).getPositions(asNumpy=True).value_in_unit(unit.nanometer)
    shapes.append((shape[filaments.node_indices[2]] - [0, 400, 0], pulling["point_x"][-1, 0]))

moving = pulling.step > waiting
length = SEGMENTS * DSDNA.segment_length
windows = [
    np.array_split(pulling[name][moving] / scale, WINDOWS)
    for name, scale in (("force", PICONEWTON), ("extension", length))
]
(force, force_error), (extension, extension_error) = (
    np.transpose([(part.mean(), part.mean(axis=0).std(ddof=1) / np.sqrt(MOLECULES)) for part in parts])
    for parts in windows
)
grid = np.geomspace(0.2, 20, 120)
exact = theory.chain_extension(DSDNA, SEGMENTS, grid * PICONEWTON, TEMPERATURE) / length
lp = DSDNA.persistence_length_at(TEMPERATURE)
thermal_energy = (unit.MOLAR_GAS_CONSTANT_R * TEMPERATURE).value_in_unit(unit.kilojoule_per_mole)
across = thermal_energy / PICONEWTON / length
trapped = exact + across / grid - across / (grid + STIFFNESS / PICONEWTON * length * exact)
expected = np.interp(force, grid, trapped)

microseconds = (steps * STEP).value_in_unit(unit.microsecond)
print(f"{steps} steps of {STEP}, {microseconds:.4g} us in all; the trap moves at {velocity * 1e6:.3g} nm/us")
print("force (pN)       extension/L     expected")
for row in range(1, WINDOWS, 3):
    print(f"{force[row]:9.2f} {extension[row]:12.4f} +- {extension_error[row]:6.4f} {expected[row]:9.4f}")
work = pulling["work"].sum(axis=0)
print(f"work of the trap: {work.mean():.1f} +- {work.std(ddof=1) / np.sqrt(MOLECULES):.1f} kJ/mol for a molecule")

figure, (left, right) = plt.subplots(1, 2, figsize=(11.5, 4.8), gridspec_kw={"width_ratios": [1.1, 1]})
colours = plt.cm.viridis(np.linspace(0.1, 0.8, len(shapes)))
for row, ((shape, trap), colour) in enumerate(zip(shapes, colours)):
    lift = -60 * row
    left.plot(shape[:, 0], shape[:, 2] + lift, color=colour, linewidth=2.4, solid_capstyle="round")
    left.plot([shape[-1, 0], trap], [shape[-1, 2] + lift, lift], ":", color="0.5", linewidth=1.2)
    left.plot(trap, lift, "o", color="#c0392b", markersize=9)
    left.plot(0, lift, "s", color="0.3", markersize=7)
    left.text(trap + 14, lift - 4, f"{(row + 1) * microseconds / 4000:.1f} ms", color=colour, fontsize=10)
left.plot([], [], "o", color="#c0392b", markersize=9, label="centre of the trap")
left.plot([], [], "s", color="0.3", markersize=7, label="held end")
left.legend(frameon=False, loc="upper right", ncols=2)
left.set(aspect="equal", xlabel="x (nm)", xlim=(-30, START + TRAVEL + 90), ylim=(-60 * len(shapes) - 10, 80), yticks=[])
left.set_title("One of the molecules")
right.plot(
    theory.marko_siggia_extension(grid * PICONEWTON, lp, TEMPERATURE),
    grid,
    "--",
    color="0.55",
    label="Marko and Siggia",
)
right.plot(exact, grid, color="0.2", linewidth=1, label="discrete chain, exact, constant force")
right.plot(trapped, grid, color="#c0392b", alpha=0.45, linewidth=4, label="the same in the trap")
right.errorbar(
    extension, force, force_error, extension_error, "o", color="#c0392b", markersize=5.5, label="pulled", zorder=3
)
right.set(yscale="log", xlabel="extension / contour length", ylabel="force (pN)", xlim=(0.6, 1.02), ylim=(0.15, 20))
right.legend(frameon=False, loc="upper left", fontsize=9)
right.set_title(f"Force and extension of {MOLECULES} molecules of {length:.0f} nm")
for axes in (left, right):
    axes.spines[["top", "right"]].set_visible(False)
left.spines["left"].set_visible(False)
figure.tight_layout()
figure.savefig(folder / "dna.png", dpi=140)
print(f"Wrote dna.cif, dna.dcd and dna.png to {folder}.")
