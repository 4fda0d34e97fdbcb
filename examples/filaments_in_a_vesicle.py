"""Actin filaments with cargo in a vesicle: confinement, and forces anywhere along a segment.

Twenty-four filaments of 1.2 um are confined in a sphere of 1 um diameter, so they must bend. Each carries a particle of
60 nm that is bound to an attachment point at 0.9 um from its first node by a soft spring. The bending energy of the
joints is compared with that of filaments that are free.

    python filaments_in_a_vesicle.py [folder] [steps]
"""

import sys
from pathlib import Path

import matplotlib

matplotlib.use("Agg")

import matplotlib.pyplot as plt
import numpy as np
import openmm
from openmm import app, unit

from openmm_cylchain import F_ACTIN, Filaments, Sphere, stokes_friction, theory, wall_force

RADIUS = 500.0  # nm
FILAMENTS = 24
SEGMENTS = 12
SEGMENT_LENGTH = 100.0  # nm
CARGO_DIAMETER = 60.0  # nm
PLACE = 900.0  # nm from the first node
SPRING = 0.05  # kJ/(mol nm^2)
WALL = 0.05  # kJ/(mol nm^2)
# The wall and the springs are explicit: a step must stay well below 2 gamma/k, 0.9 us for the end of a filament.
STEP = 0.1 * unit.microsecond
STEPS = 20000
FRAMES = 100
VISCOSITY = 1.71e-3 * unit.pascal * unit.second
TEMPERATURE = 310 * unit.kelvin

folder = Path(sys.argv[1] if len(sys.argv) > 1 else "output_filaments_in_a_vesicle")
steps = int(sys.argv[2]) if len(sys.argv) > 2 else STEPS
folder.mkdir(parents=True, exist_ok=True)
generator = np.random.default_rng(3)

# Cargo comes first, then filaments, each bent along a great circle inside the vesicle to begin with.
actin = F_ACTIN.with_segment_length(SEGMENT_LENGTH)
filaments = Filaments(VISCOSITY, TEMPERATURE)
bend = 0.85 * RADIUS
angles = SEGMENT_LENGTH / bend * np.arange(SEGMENTS + 1)
for number in range(FILAMENTS):
    first, second, _ = np.linalg.qr(generator.normal(size=(3, 3)))[0].T
    filaments.add_nodes(actin, bend * (np.cos(angles)[:, None] * first + np.sin(angles)[:, None] * second))
    filaments.add_attachment(number, arc_length=PLACE)

topology, system = app.Topology(), openmm.System()
cargo_chain = topology.addChain("C")
for _ in range(FILAMENTS):
    topology.addAtom("CRG", None, topology.addResidue("CRG", cargo_chain))
    system.addParticle(1.0)
places = [filaments[number].positions[round(PLACE / SEGMENT_LENGTH)] for number in range(FILAMENTS)]
cargo = list(range(FILAMENTS))
positions = filaments.add_to(topology, system, 0.9 * np.array(places))

springs = openmm.HarmonicBondForce()
for particle, point in zip(cargo, filaments.attachment_indices):
    springs.addBond(particle, int(point), 0.5 * CARGO_DIAMETER, SPRING)
system.addForce(springs)
nodes = np.concatenate(filaments.node_indices)
system.addForce(wall_force(Sphere([0, 0, 0], RADIUS), WALL, nodes))
system.addForce(wall_force(Sphere([0, 0, 0], RADIUS - 0.5 * CARGO_DIAMETER), WALL, cargo))

friction = stokes_friction(CARGO_DIAMETER * unit.nanometer, VISCOSITY)
integrator = filaments.create_integrator(system, STEP, particle_friction=friction, random_seed=1)
simulation = app.Simulation(topology, system, integrator, openmm.Platform.getPlatformByName("CPU"))
simulation.context.setPositions(positions)
with open(folder / "vesicle.cif", "w") as file:
    app.PDBxFile.writeFile(topology, positions, file, keepIds=True)
interval = max(1, steps // FRAMES)
simulation.reporters.append(app.DCDReporter(str(folder / "vesicle.dcd"), interval))
bending, distances = [], []
for _ in range(steps // interval):
    simulation.step(interval)
    final = simulation.context.getState(positions=True).getPositions(asNumpy=True).value_in_unit(unit.nanometer)
    tangents = np.diff(final[np.array(filaments.node_indices)], axis=1)
    tangents /= np.linalg.norm(tangents, axis=2)[..., None]
    bending.append(actin.bending_energy(np.sum(tangents[:, 1:] * tangents[:, :-1], axis=2)).mean())
    distances.append(np.linalg.norm(final[cargo] - final[filaments.attachment_indices], axis=1).mean())

free = theory.bending_energy_mean(actin, TEMPERATURE)
print(f"{steps} steps of {STEP}, {(steps * STEP).value_in_unit(unit.millisecond):.3g} ms in all")
print(f"farthest node from the centre: {np.linalg.norm(final[nodes], axis=1).max():.0f} nm; radius {RADIUS:.0f} nm")
print(f"distance of cargo from its point: {np.mean(distances):.1f} nm; springs at rest {0.5 * CARGO_DIAMETER:.1f} nm")
print(f"bending energy of a joint: {np.mean(bending[len(bending) // 2 :]):.2f} kJ/mol; {free:.2f} if free")

figure = plt.figure(figsize=(8, 8))
axes = figure.add_subplot(projection="3d", proj_type="ortho")
longitude, latitude = np.meshgrid(np.linspace(0, 2 * np.pi, 25), np.linspace(0, np.pi, 13))
axes.plot_wireframe(
    RADIUS * np.sin(latitude) * np.cos(longitude),
    RADIUS * np.sin(latitude) * np.sin(longitude),
    RADIUS * np.cos(latitude),
    color="0.85",
    linewidth=0.6,
)
for number, indices in enumerate(filaments.node_indices):
    label = f"{FILAMENTS} actin filaments of 1.2 µm" if number == 0 else None
    axes.plot(*final[indices].T, color="#c0392b", linewidth=2, label=label)
axes.scatter(*final[cargo].T, s=90, color="#1f6f8b", depthshade=True, label="cargo, 60 nm")
for particle, point in zip(cargo, filaments.attachment_indices):
    axes.plot(*final[[particle, point]].T, color="#1f6f8b", linewidth=1)
axes.plot([-RADIUS, RADIUS], [0, 0], [-1.15 * RADIUS] * 2, color="0.3", linewidth=1.5)
axes.text(0, 0, -1.27 * RADIUS, "1 µm, the diameter of the vesicle", ha="center", fontsize=14, color="0.3")
limits = (-1.05 * RADIUS, 1.05 * RADIUS)
axes.set(xlim=limits, ylim=limits, zlim=limits)
axes.set_box_aspect((1, 1, 1), zoom=1.38)
axes.view_init(elev=20, azim=-90)  # The bar along x is as long as it says.
axes.set_axis_off()
figure.subplots_adjust(left=0, right=1, bottom=0, top=1)
figure.legend(loc="upper center", bbox_to_anchor=(0.5, 0.99), ncols=2, fontsize=14, frameon=False)
figure.savefig(folder / "vesicle.png", dpi=110)
print(f"Wrote vesicle.cif, vesicle.dcd and vesicle.png to {folder}.")
