"""Actin filaments clamped at one end and bent by a force at the other: simulation against elastica theory.

Four filaments of 2.1 um stand side by side. The first two nodes of each are clamped, which fixes position and
direction, and a constant force pulls the last node sideways. At zero temperature they relax to the shape in which
the force is balanced by bending: the elastica, a theta'' = -F cos(theta). For small forces its tip is deflected by
F L^3/(3 a).

    python clamped_filament.py [folder] [steps]
"""

import sys
from pathlib import Path

import matplotlib

matplotlib.use("Agg")

import matplotlib.pyplot as plt
import numpy as np
import openmm
from openmm import app, unit
from scipy.integrate import solve_bvp
from scipy.optimize import minimize

from openmm_cylchain import F_ACTIN, Filaments

FORCES = (0.01, 0.02, 0.05, 0.1)  # pN
SEGMENTS = 7
SEGMENT_LENGTH = 300  # nm
STEPS = 10000
FRAMES = 100
PICONEWTON = 0.602214076  # kJ/(mol nm)

folder = Path(sys.argv[1] if len(sys.argv) > 1 else "output_clamped_filament")
steps = int(sys.argv[2]) if len(sys.argv) > 2 else STEPS
folder.mkdir(parents=True, exist_ok=True)

actin = F_ACTIN.with_segment_length(SEGMENT_LENGTH * unit.nanometer)
filaments = Filaments(viscosity=1e-3 * unit.pascal * unit.second, temperature=0 * unit.kelvin)
for number in range(len(FORCES)):
    filaments.add_straight(actin, SEGMENTS, start=[0, 300 * number, 0], direction=[1, 0, 0], clamped=[0, 1])
topology, system, positions = filaments.build()

pull = openmm.CustomExternalForce("-force*z")
pull.addPerParticleParameter("force")
for nodes, force in zip(filaments.node_indices, FORCES):
    pull.addParticle(int(nodes[-1]), [force * PICONEWTON])
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


def elastica(force, rigidity, length, points=200):
    """Shape (x, z) of a clamped rod under a force across its clamp, and constant in direction."""

    def slope(s, y):
        angle, curvature = y[0], y[1]
        return np.array([curvature, -force / rigidity * np.cos(angle), np.cos(angle), np.sin(angle)])

    def ends(start, end):
        return np.array([start[0], end[1], start[2], start[3]])

    s = np.linspace(0, length, points)
    return solve_bvp(slope, ends, s, np.vstack([0 * s, 0 * s, s, 0 * s]), tol=1e-8).sol(s)[2:].T


def discrete_deflection(force, filament_type, joints):
    """Deflection of the tip of a chain of rigid segments: the minimum of its energy over their angles."""

    def energy(angles):
        bends = np.diff(angles, prepend=0.0)
        height = filament_type.segment_length * np.sum(np.sin(angles))
        return np.sum(filament_type.bending_energy(np.cos(bends))) - force * height

    angles = minimize(energy, np.zeros(joints), options={"gtol": 1e-8}).x
    return filament_type.segment_length * np.sum(np.sin(angles))


# A joint bends by (moment) l0/a. With n = SEGMENTS - 1 joints at 1, 2, ... n segments from the tip, a small force
# deflects the tip by F l0^3/a sum m^2 = F l0^3/a n (n + 1)(2 n + 1)/6, as if the rod were clamped in the middle of
# the first segment, L = (n + 1/2) l0, to one part in 4 n^2.
rigidity, l0, joints = actin.bending_rigidity, actin.segment_length, SEGMENTS - 1
length = (joints + 0.5) * l0
simulated_time = (steps * step).value_in_unit(unit.millisecond)
print(f"{steps} steps of {step.value_in_unit(unit.microsecond):.2f} us, {simulated_time:.0f} ms in all.")
print("Deflection (nm):  simulation   discrete chain   elastica   F L^3/(3 a)")
theories = []
for force, shape in zip(FORCES, shapes):
    pulled = force * PICONEWTON
    theories.append(elastica(pulled, rigidity, length))
    small = pulled * length**3 / (3 * rigidity)
    expected = discrete_deflection(pulled, actin, joints)
    print(f"{force:13.2f} pN {shape[-1, 1]:13.1f} {expected:16.1f} {theories[-1][-1, 1]:10.1f} {small:13.1f}")

figure, (left, right) = plt.subplots(1, 2, figsize=(11, 4.6), gridspec_kw={"width_ratios": [1.25, 1]})
colours = plt.cm.viridis(np.linspace(0.05, 0.8, len(FORCES)))
for force, shape, theory, colour in zip(FORCES, shapes, theories, colours):
    left.plot((theory[:, 0] + l0 / 2) / 1000, theory[:, 1] / 1000, color=colour, linewidth=5, alpha=0.35)
    left.plot(*(shape / 1000).T, "o-", color=colour, markersize=4, linewidth=1, label=f"{force:g} pN")
left.plot([], [], color="grey", linewidth=5, alpha=0.35, label="elastica")
left.axvspan(-0.1, SEGMENT_LENGTH / 1000, color="0.9", zorder=0)
left.text(0.1, 1.3, "clamped", ha="center", color="0.35")
left.set(xlabel="x (µm)", ylabel="z (µm)", aspect="equal", xlim=(-0.1, 2.25), ylim=(-0.15, 1.45))
left.legend(frameon=False, loc="upper center", bbox_to_anchor=(0.42, 0.98))
left.set_title("Shapes of an actin filament pulled at its tip")

grid = np.geomspace(0.003, 0.2, 25)
right.plot(grid, grid * PICONEWTON * length**3 / (3 * rigidity), "--", color="0.5", label="$FL^3/3a$")
right.plot(grid, [elastica(f * PICONEWTON, rigidity, length)[-1, 1] for f in grid], color="0.2", label="elastica")
for force, shape, colour in zip(FORCES, shapes, colours):
    right.plot(force, shape[-1, 1], "o", color=colour, markersize=8)
right.plot([], [], "o", color=colours[1], markersize=8, label="simulation")
right.set(xscale="log", yscale="log", xlabel="force (pN)", ylabel="deflection of the tip (nm)")
right.legend(frameon=False)
right.set_title("Deflection")
for axes in (left, right):
    axes.spines[["top", "right"]].set_visible(False)
figure.tight_layout()
figure.savefig(folder / "filaments.png", dpi=150)
print(f"Wrote filaments.cif, filaments.dcd and filaments.png to {folder}.")
