"""Filaments and rings that tumble in a shear flow, between thermal noise and the turning of the solvent.

Twenty-four actin filaments of 6 um and six rings of the same length are in a solvent that flows along x and whose
velocity grows along z, by 8 per second. A filament lies along the flow most of the time, until noise takes it across
and the flow turns it over. Without noise a thin rod would turn as cot(phi) = cot(phi_0) + rate t, to rest along x.

    python tumbling_in_shear.py [folder] [steps]
"""

import sys
from pathlib import Path

import matplotlib

matplotlib.use("Agg")

import matplotlib.pyplot as plt
import numpy as np
import openmm
from openmm import app, unit

from openmm_cylchain import F_ACTIN, Filaments, Flow

FILAMENTS = 24
RINGS = 6
SEGMENTS = 12
SEGMENT_LENGTH = 500.0  # nm
RATE = 8 / unit.second
STEP = 0.5 * unit.millisecond
STEPS = 40000
FRAMES = 1000
POSES = 9
SPACING = 7.0  # um between them in the picture
VISCOSITY = 1.71e-3 * unit.pascal * unit.second
TEMPERATURE = 310 * unit.kelvin

folder = Path(sys.argv[1] if len(sys.argv) > 1 else "output_tumbling_in_shear")
steps = int(sys.argv[2]) if len(sys.argv) > 2 else STEPS
folder.mkdir(parents=True, exist_ok=True)
generator = np.random.default_rng(4)

actin = F_ACTIN.with_segment_length(SEGMENT_LENGTH)
filaments = Filaments(VISCOSITY, TEMPERATURE)
for number in range(FILAMENTS):
    filaments.add_equilibrium(actin, SEGMENTS, seed=number, start=[-3000, 3000 * number, 0], direction=[1, 0, 0])
for number in range(RINGS):
    filaments.add_ring(actin, SEGMENTS, [0, 3000 * (FILAMENTS + number), 0], normal=generator.normal(size=3))
topology, system, positions = filaments.build()
integrator = filaments.create_integrator(system, STEP, random_seed=1, flow=Flow.shear(RATE))
simulation = app.Simulation(topology, system, integrator, openmm.Platform.getPlatformByName("Reference"))
simulation.context.setPositions(positions)
with open(folder / "shear.cif", "w") as file:
    app.PDBxFile.writeFile(topology, positions, file, keepIds=True)
interval = max(1, steps // FRAMES)
simulation.reporters.append(app.DCDReporter(str(folder / "shear.dcd"), interval))
chains, rings = [], []
for _ in range(steps // interval):
    simulation.step(interval)
    now = simulation.context.getState(positions=True).getPositions(asNumpy=True).value_in_unit(unit.nanometer)
    chains.append(now[np.array(filaments.node_indices[:FILAMENTS])])
    rings.append(now[np.array(filaments.node_indices[FILAMENTS:])])
chains, rings = np.array(chains), np.array(rings)  # (frames, filaments, nodes, 3)
time = interval * STEP.value_in_unit(unit.second) * np.arange(1, len(chains) + 1)

# Angle of the ends, and of any one node of a ring around its middle, in the plane of flow and gradient.
ends = chains[:, :, -1] - chains[:, :, 0]
angles = np.unwrap(np.arctan2(ends[..., 2], ends[..., 0]), axis=0)
spokes = rings[:, :, 0] - rings.mean(axis=2)
ring_angles = np.unwrap(np.arctan2(spokes[..., 2], spokes[..., 0]), axis=0)
rate = RATE.value_in_unit(unit.second**-1)
turns = -(angles[-1] - angles[0]) / np.pi
ring_turns = -(ring_angles[-1] - ring_angles[0]) / (2 * np.pi)
aligned = np.mean(ends[..., 0] ** 2, axis=(0, 1)) / np.mean(np.sum(ends**2, axis=-1), axis=(0, 1))
print(f"{steps} steps of {STEP}, {time[-1]:.3g} s in all; the shear is {rate * time[-1]:.3g}")
print(
    f"filaments turn over {turns.mean() / time[-1]:.2f} times per second; with the vorticity {rate / (2 * np.pi):.2f}"
)
print(f"rings turn {ring_turns.mean() / time[-1]:.2f} times per second; with the vorticity {rate / (4 * np.pi):.2f}")
print(f"share of the end-to-end vectors along the flow: {aligned:.2f}; 0.33 at rest")

figure, (film, panel) = plt.subplots(2, 1, figsize=(11, 7), gridspec_kw={"height_ratios": [0.55, 1]})
# The filament that makes half a turn within a shear of 4 and stays best in the plane of the picture, and such a ring.
span = max(1, min(len(angles) // 2, round(4 / (rate * time[0]))))
forward = (angles[:-span] - angles[span:]) / np.pi
windows = np.lib.stride_tricks.sliding_window_view(np.hypot(ends[..., 0], ends[..., 2]), span + 1, axis=0)
in_plane = windows.min(axis=-1)
first, chosen = np.unravel_index(np.argmax(in_plane * np.exp(-(((forward - 1.0) / 0.1) ** 2))), forward.shape)
loop_chosen = np.argmax(np.hypot(spokes[..., 0], spokes[..., 2])[first : first + span].mean(axis=0))
poses = np.linspace(max(0, first - span // 4), min(len(chains) - 1, first + 5 * span // 4), POSES).astype(int)
for place, pose in enumerate(poses):
    colour = plt.cm.plasma(0.05 + 0.8 * place / (POSES - 1))
    shape = (chains[pose, chosen] - chains[pose, chosen].mean(axis=0)) / 1000
    loop = (rings[pose, loop_chosen] - rings[pose, loop_chosen].mean(axis=0)) / 1000
    for outline, height in ((shape, 4.0), (np.concatenate([loop, loop[:1]]), -1.0)):
        x, z = outline[:, 0] + SPACING * place, outline[:, 2] + height
        film.plot(x, z, color=colour, linewidth=2.6, solid_capstyle="round")
        film.plot(x[0], z[0], "o", color=colour, markersize=6)
    film.text(SPACING * place, 7.4, f"{time[pose]:.2f} s", ha="center", color="0.4")
for height in (-2, -1, 1, 2):
    arrow = {"arrowstyle": "->", "color": "#7f8c8d"}
    film.annotate("", (-6 + 1.2 * height, 1.5 + height), (-6, 1.5 + height), arrowprops=arrow)
film.plot([-6, -6], [-1, 4], color="#7f8c8d", linewidth=1)
film.text(-6, 4.6, "flow", ha="center", color="#7f8c8d")
film.set(aspect="equal", xlim=(-9, SPACING * POSES - 3), ylim=(-3, 8.4))
film.set_axis_off()
for number in range(FILAMENTS):
    style = {"color": "#1f6f8b", "linewidth": 0.8, "alpha": 0.6}
    panel.plot(time, -(angles[:, number] - angles[0, number]) / np.pi, **style, label=None if number else "filaments")
for number in range(RINGS):
    style = {"color": "#c0392b", "linewidth": 1.2, "alpha": 0.9}
    turned = -(ring_angles[:, number] - ring_angles[0, number]) / np.pi
    panel.plot(time, turned, **style, label=None if number else "rings")
panel.set(xlabel="t (s)", ylabel="half turns", xlim=(0, time[-1]))
panel.legend(frameon=False)
panel.spines[["top", "right"]].set_visible(False)
figure.tight_layout()
figure.savefig(folder / "shear.png", dpi=110)
print(f"Wrote shear.cif, shear.dcd and shear.png to {folder}.")
