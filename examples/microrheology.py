"""Microrheology: beads that stick to a network of linked actin, and what their motion says of its modulus.

Beads are rigid bodies; springs hold filaments near their surfaces. From the mean square displacement of a bead with
the radius a follows the modulus at the angular frequency 1/t (Mason, Rheol. Acta 2000, 39, 371),

    |G*(1/t)| = k_B T/(pi a MSD(t) Gamma(1 + alpha(t))),    alpha = d ln MSD/d ln t.

Other beads, which nothing holds and which do not meet filaments, diffuse in the solvent alone, with MSD = 6 D t and
|G*| = viscosity/t. Motion of the solvent does not couple beads and filaments here.

    python microrheology.py [folder] [steps]
"""

import math
import sys
from pathlib import Path

import matplotlib

matplotlib.use("Agg")

import matplotlib.pyplot as plt
import numpy as np
import openmm
from openmm import app, unit
from scipy.spatial import cKDTree

from openmm_cylchain import F_ACTIN, Body, Crosslinks, Filaments

BOX = 2500.0  # nm
FILAMENTS = 120
SEGMENTS = 16
SEGMENT = 125.0  # nm
BEADS = 8  # in the network, and as many free ones
RADIUS = 200.0  # nm
NEAR = 100.0  # nm: nodes that are linked to each other, and those that a bead holds
STEP = 100 * unit.microsecond
STEPS = 12000
VISCOSITY = 10e-3 * unit.pascal * unit.second
TEMPERATURE = 298 * unit.kelvin
STIFFNESS = 0.05 * unit.piconewton / unit.nanometer
HELD, FREE = "#0072B2", "#D55E00"

folder = Path(sys.argv[1] if len(sys.argv) > 1 else "output_microrheology")
steps = int(sys.argv[2]) if len(sys.argv) > 2 else STEPS
folder.mkdir(parents=True, exist_ok=True)
interval = max(1, steps // 40)

generator = np.random.default_rng(1)
actin = F_ACTIN.with_segment_length(SEGMENT * unit.nanometer)
filaments = Filaments(VISCOSITY, TEMPERATURE)
for number in range(FILAMENTS):
    filaments.add_equilibrium(actin, SEGMENTS, seed=number + 1, start=generator.uniform(0, BOX, 3))
nodes = np.concatenate([own.positions for own in filaments])
owner = np.repeat(np.arange(FILAMENTS), SEGMENTS + 1)
tree = cKDTree(nodes % BOX, boxsize=BOX)
pairs = tree.query_pairs(NEAR, output_type="ndarray")
pairs = pairs[owner[pairs[:, 0]] != owner[pairs[:, 1]]]
held = []  # node, body, point
grid = BOX / 2 * (0.5 + np.stack(np.meshgrid(*[np.arange(2)] * 3), axis=-1).reshape(-1, 3)[:BEADS])
for bead, centre in enumerate(grid):
    near = np.array(tree.query_ball_point(centre, RADIUS + NEAR), dtype=int)
    arms = (nodes[near] - centre + BOX / 2) % BOX - BOX / 2
    arms *= RADIUS / np.linalg.norm(arms, axis=1)[:, None]
    filaments.add_body(Body.sphere(RADIUS, arms, name="Bead"), centre)
    held += [(int(node), bead, point) for point, node in enumerate(near, 1)]
for centre in generator.uniform(0, BOX, (BEADS, 3)):
    filaments.add_body(Body.sphere(RADIUS, name="Free"), centre)
topology, system, positions = filaments.build(box_vectors=BOX * np.eye(3))
number_of = np.concatenate(filaments.node_indices)
links = Crosslinks(stiffness=STIFFNESS, rest_length=0)
start = np.array(positions.value_in_unit(unit.nanometer))


def link(first, second):
    """Springs that are at rest as they are drawn."""
    between = start[second] - start[first]
    between -= BOX * np.round(between / BOX)
    for one, other, length in zip(first, second, np.linalg.norm(between, axis=1)):
        links.add(None, int(one), int(other), rest_length=float(length))


link(number_of[pairs[:, 0]], number_of[pairs[:, 1]])
link(number_of[[node for node, _, _ in held]], [int(filaments.body_indices[bead][point]) for _, bead, point in held])
links.add_to(system)
integrator = filaments.create_integrator(system, STEP, random_seed=1, checks=False)
simulation = app.Simulation(topology, system, integrator, openmm.Platform.getPlatformByName("CPU"))
simulation.context.setPositions(positions)
with open(folder / "microrheology.cif", "w") as file:
    app.PDBxFile.writeFile(topology, positions, file, keepIds=True)
simulation.reporters.append(app.DCDReporter(str(folder / "microrheology.dcd"), interval))
centres = [int(own[0]) for own in filaments.body_indices]
course = np.empty((steps, 2 * BEADS, 3))
for number in range(steps):
    simulation.step(1)
    course[number] = simulation.context.getState(positions=True).getPositions(asNumpy=True)._value[centres]
course = course[steps // 10 :]

seconds = STEP.value_in_unit(unit.second)
lags = np.unique(np.geomspace(1, max(2, len(course) // 10), 25).astype(int))
time = seconds * lags
own = np.array([np.mean(np.sum((course[lag:] - course[:-lag]) ** 2, axis=2), axis=0) for lag in lags]) / 1e6  # um^2
energy = (unit.MOLAR_GAS_CONSTANT_R * TEMPERATURE / unit.AVOGADRO_CONSTANT_NA).value_in_unit(unit.joule)
viscosity = VISCOSITY.value_in_unit(unit.pascal * unit.second)
diffusion = energy / (6 * np.pi * viscosity * RADIUS * 1e-9) * 1e12  # um^2/s
curves = {}
for label, beads in (("network", own[:, :BEADS]), ("solvent", own[:, BEADS:])):
    mean, error = beads.mean(axis=1), beads.std(axis=1, ddof=1) / np.sqrt(BEADS)
    slope = np.gradient(np.log(mean), np.log(time))
    modulus = energy / (np.pi * RADIUS * 1e-9 * mean * 1e-12 * np.array([math.gamma(1 + a) for a in slope]))
    curves[label] = mean, error, modulus
mean, error, modulus = curves["solvent"]
print(f"{steps} steps of {STEP}; {len(pairs)} links of filaments, {len(held)} of {BEADS} beads to filaments")
shown = len(lags) // 3
print(
    f"free beads: MSD/(6 D t) = {mean[shown] / (6 * diffusion * time[shown]):.3f} +- "
    f"{error[shown] / (6 * diffusion * time[shown]):.3f} at {1e3 * time[shown]:.3g} ms"
)
for which in (0, -1):
    mean, error, modulus = (values[which] for values in curves["network"])
    print(
        f"in the network at {1e3 * time[which]:.3g} ms: MSD {1e6 * mean:.3g} +- {1e6 * error:.2g} nm^2, "
        f"|G*| {modulus:.2g} Pa, that of the solvent {viscosity / time[which]:.2g} Pa"
    )

figure = plt.figure(figsize=(13, 4.8), layout="constrained")
picture, panel, moduli = figure.subplots(1, 3, width_ratios=(1, 1.1, 1.1))
x = simulation.context.getState(positions=True).getPositions(asNumpy=True).value_in_unit(unit.micrometer)
box = BOX / 1000
for places in filaments.node_indices:
    shape = x[places] - box * np.floor(x[places].mean(axis=0) / box)
    picture.plot(*shape[:, :2].T, color="0.35", linewidth=0.8, alpha=0.6)
for number, centre in enumerate(centres):
    place = x[centre] % box
    picture.add_patch(
        plt.Circle(place[:2], RADIUS / 1000, color=HELD if number < BEADS else FREE, alpha=0.75, zorder=3)
    )
picture.set(xlim=(0, box), ylim=(0, box), aspect="equal", xlabel="x (µm)", ylabel="y (µm)")
for label, colour in (("network", HELD), ("solvent", FREE)):
    mean, error, modulus = curves[label]
    panel.errorbar(time, mean, error, fmt="o", markersize=4, color=colour, label=f"beads in the {label}")
    moduli.plot(1 / time, modulus, "o", markersize=4, color=colour, label=f"beads in the {label}")
panel.plot(time, 6 * diffusion * time, "--", color="#101010", label="6Dt of a free bead")
moduli.plot(1 / time, viscosity / time, "--", color="#101010", label="viscosity of the solvent × frequency")
panel.set(xscale="log", yscale="log", xlabel="time (s)", ylabel="mean square displacement (µm²)")
moduli.set(xscale="log", yscale="log", xlabel="angular frequency (1/s)", ylabel="|G*| (Pa)")
for axes in (panel, moduli):
    axes.legend(frameon=False)
    axes.spines[["top", "right"]].set_visible(False)
figure.savefig(folder / "microrheology.png", dpi=110)
print(f"Wrote microrheology.cif, microrheology.dcd and microrheology.png to {folder}.")
