"""Self-propelled actin filaments in a plane, as on a surface coated with motors: half of them glide backwards.

Forty filaments of 3 um move in the plane z = 0. A force along each segment drives them at 4 um/s, those of the first
half with their last node in front and the others with their first. Thermal noise turns them. Speed and turning are
compared with those of straight rods: v = F0/gamma_parallel, and <u(0).u(t)> = exp(-D t) with D = k_B T/(sum of the
segments' gamma_rot and of gamma_perp times their squared distances from the middle).

    python gliding_filaments.py [folder] [steps]
"""

import sys
from pathlib import Path

import matplotlib

matplotlib.use("Agg")

import matplotlib.pyplot as plt
import numpy as np
import openmm
from openmm import app, unit

from openmm_cylchain import F_ACTIN, Filaments

FILAMENTS = 40
SEGMENTS = 6
SEGMENT_LENGTH = 500.0  # nm
SPEED = 4e-9  # nm/ps, 4 um/s
STEP = 0.5 * unit.millisecond
STEPS = 12000
FRAMES = 300
SHORTEST = 40  # frames over which turning is measured
VISCOSITY = 1.71e-3 * unit.pascal * unit.second
TEMPERATURE = 310 * unit.kelvin

folder = Path(sys.argv[1] if len(sys.argv) > 1 else "output_gliding_filaments")
steps = int(sys.argv[2]) if len(sys.argv) > 2 else STEPS
folder.mkdir(parents=True, exist_ok=True)
generator = np.random.default_rng(2)

actin = F_ACTIN.with_segment_length(SEGMENT_LENGTH)
friction = actin.segment_friction(VISCOSITY, TEMPERATURE)
signs = np.where(np.arange(FILAMENTS) < FILAMENTS // 2, 1.0, -1.0)
filaments = Filaments(VISCOSITY, TEMPERATURE)
for number, sign in enumerate(signs):
    start = [*generator.uniform(-15000, 15000, 2), 0]
    filaments.add_equilibrium(
        actin, SEGMENTS, seed=number, start=start, planar=True, propulsion=sign * SPEED * friction.parallel
    )
topology, system, positions = filaments.build()
integrator = filaments.create_integrator(system, STEP, random_seed=1)
simulation = app.Simulation(topology, system, integrator, openmm.Platform.getPlatformByName("Reference"))
simulation.context.setPositions(positions)
with open(folder / "gliding.cif", "w") as file:
    app.PDBxFile.writeFile(topology, positions, file, keepIds=True)
interval = max(1, steps // FRAMES)
simulation.reporters.append(app.DCDReporter(str(folder / "gliding.dcd"), interval))
frames = []
for _ in range(steps // interval):
    simulation.step(interval)
    now = simulation.context.getState(positions=True).getPositions(asNumpy=True).value_in_unit(unit.nanometer)
    frames.append(now[np.array(filaments.node_indices)])
frames = np.array(frames)[..., :2]  # (frames, filaments, nodes, 2)

# Where filaments point to is where they are pushed.
vectors = signs[:, None] * (frames[:, :, -1] - frames[:, :, 0])
directions = vectors / np.linalg.norm(vectors, axis=-1)[..., None]
middles = 0.5 * (frames[:, :, :-1] + frames[:, :, 1:]).mean(axis=2)
interval_time = interval * STEP.value_in_unit(unit.second)
moves = np.diff(middles, axis=0) / (1000 * interval_time)
forward = np.sum(moves * 0.5 * (directions[1:] + directions[:-1]), axis=-1)
places = SEGMENT_LENGTH * (np.arange(SEGMENTS) - 0.5 * (SEGMENTS - 1))
turning_friction = SEGMENTS * friction.rotational + friction.perpendicular * np.sum(places**2)
thermal_energy = unit.MOLAR_GAS_CONSTANT_R.value_in_unit(unit.kilojoule_per_mole / unit.kelvin) * 310
diffusion = 1e12 * thermal_energy / turning_friction  # 1/s
lags = np.arange(min(len(frames) // 2, 4 * SHORTEST))
turned = [np.sum(directions[: len(frames) - lag] * directions[lag:], axis=-1).mean() for lag in lags]

print(f"{steps} steps of {STEP}, {steps * STEP.value_in_unit(unit.second):.3g} s in all")
print(f"speed along the filament: {forward.mean():.3f} um/s; F0/gamma_parallel is {1000 * SPEED * 1e9 / 1e3:.3f} um/s")
lag = min(SHORTEST, len(frames) - 1)
expected = np.exp(-diffusion * lag * interval_time)
measured = np.sum(directions[:-lag] * directions[lag:], axis=-1).mean()
print(f"<u(0).u(t)> after {lag * interval_time:.3g} s: {measured:.3f}; {expected:.3f} for a rod")
print(f"sideways: {np.abs(middles[-1] - middles[0]).mean() / 1000:.1f} um on average in x and y; z stays at 0 nm")

figure, (plane, panel) = plt.subplots(1, 2, figsize=(12, 6.6), gridspec_kw={"width_ratios": [1.5, 1]})
colours = {1.0: "#c0392b", -1.0: "#1f6f8b"}
for number, sign in enumerate(signs):
    colour = colours[sign]
    path = middles[:, number] / 1000
    # The trace fades towards the past.
    for part in range(8):
        piece = slice(part * len(path) // 8, (part + 1) * len(path) // 8 + 1)
        plane.plot(*path[piece].T, color=colour, linewidth=1, alpha=0.06 + 0.07 * part)
    nodes = frames[-1, number][:: int(sign)] / 1000
    plane.plot(*nodes.T, color=colour, linewidth=2.6, solid_capstyle="round")
    ahead = nodes[-1] - nodes[-2]
    plane.annotate(
        "",
        nodes[-1] + 1.2 * ahead,
        nodes[-1] - 0.2 * ahead,
        arrowprops={"arrowstyle": "-|>", "color": colour, "linewidth": 0, "mutation_scale": 16},
    )
plane.plot([], [], color=colours[1.0], linewidth=3, label="last node in front")
plane.plot([], [], color=colours[-1.0], linewidth=3, label="first node in front")
plane.legend(frameon=False, loc="upper center", bbox_to_anchor=(0.5, 1.07), ncols=2)
plane.set(aspect="equal", xlabel="x (µm)", ylabel="y (µm)")
panel.plot(lags * interval_time, turned, color="0.25", linewidth=2.5, label="simulation")
panel.plot(lags * interval_time, np.exp(-diffusion * lags * interval_time), "--", color="#e67e22", label="straight rod")
panel.set(xlabel="t (s)", ylabel=r"$\langle u(0)\cdot u(t)\rangle$", title="Thermal noise turns them")
panel.legend(frameon=False)
for axes in (plane, panel):
    axes.spines[["top", "right"]].set_visible(False)
figure.tight_layout()
figure.savefig(folder / "gliding.png", dpi=120)
print(f"Wrote gliding.cif, gliding.dcd and gliding.png to {folder}.")
