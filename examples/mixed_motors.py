"""A gliding assay with fast and slow motors: how fast microtubules glide over a mixture of both.

Motors of two kinds are anchored on a plane. Those that hold a microtubule share its speed: slow ones hold it back, and
fast ones pull. With the same stall force F_s and n motors of each kind that walk at v (1 + F/F_s) under a load F along
their way, forces are balanced at the speed

    V = (n_fast + n_slow)/(n_fast/v_fast + n_slow/v_slow).

    python mixed_motors.py [folder] [steps]
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

from openmm_cylchain import MICROTUBULE, Crosslinker, Filaments, Hand

SHARES = (0.0, 0.2, 0.4, 0.6, 0.8, 1.0)  # of slow motors, in lanes side by side
FILAMENTS, SEGMENTS, SEGMENT_LENGTH = 4, 4, 500.0  # in each lane; nm
LENGTH, WIDTH = 4000.0, 2000.0  # of a lane, in nm
MOTORS = 4000  # in each lane
FAST, SLOW = 0.8, 0.4  # um/s
STEP = 1 * unit.millisecond
STEPS = 3000
FRAMES = 100
VISCOSITY = 1e-3 * unit.pascal * unit.second
TEMPERATURE = 310 * unit.kelvin

folder = Path(sys.argv[1] if len(sys.argv) > 1 else "output_mixed_motors")
steps = int(sys.argv[2]) if len(sys.argv) > 2 else STEPS
folder.mkdir(parents=True, exist_ok=True)
generator = np.random.default_rng(4)

fast = Hand(
    binding_rate=20 / unit.second,
    reach=30 * unit.nanometer,
    unbinding_rate=0.5 / unit.second,
    speed=FAST * unit.micrometer / unit.second,
    stall_force=5 * unit.piconewton,
)
slow = replace(fast, speed=SLOW * unit.micrometer / unit.second)
microtubule = MICROTUBULE.with_segment_length(SEGMENT_LENGTH)
filaments = Filaments(VISCOSITY, TEMPERATURE)
for number in range(len(SHARES) * FILAMENTS):
    start = [generator.uniform(0, LENGTH), (number + 0.5) * WIDTH / FILAMENTS, 0]
    filaments.add_straight(microtubule, SEGMENTS, start, [1, 0, 0], planar=True)
places = generator.uniform(0, [LENGTH, WIDTH, 0], (len(SHARES), MOTORS, 3))
places[..., 1] += WIDTH * np.arange(len(SHARES))[:, None]
is_slow = np.arange(MOTORS) < MOTORS * np.array(SHARES)[:, None]
for hand, anchors in ((fast, places[~is_slow]), (slow, places[is_slow])):
    filaments.add_linkers(Crosslinker(hands=hand, stiffness=0.05 * unit.piconewton / unit.nanometer), anchors=anchors)
topology, system, positions = filaments.build(box_vectors=np.diag([LENGTH, WIDTH * len(SHARES), 1000.0]))
# Bends of microtubules relax within a step. That is not resolved, and need not be: hence no check of the step.
integrator = filaments.create_integrator(system, STEP, random_seed=1, checks=False)
simulation = app.Simulation(topology, system, integrator, openmm.Platform.getPlatform("CPU"))
context = simulation.context
context.setPositions(positions)
with open(folder / "motors.cif", "w") as file:
    app.PDBxFile.writeFile(topology, positions, file, keepIds=True)
interval = max(1, steps // FRAMES)
simulation.reporters.append(app.DCDReporter(str(folder / "motors.dcd"), interval, enforcePeriodicBox=False))

nodes = np.array(filaments.node_indices)
frames = []
for _ in range(steps // interval):
    simulation.step(interval)
    frames.append(context.getState(positions=True).getPositions(asNumpy=True).value_in_unit(unit.nanometer)[nodes])
frames = np.array(frames)[..., :2]

# Until the springs of motors are loaded, fast ones and slow ones walk as they like.
late = frames[len(frames) // 3 :]
along = late[0, :, 0] - late[0, :, -1]
along /= np.linalg.norm(along, axis=1)[:, None]
seconds = (len(late) - 1) * interval * STEP.value_in_unit(unit.second)
speeds = np.sum((late[-1] - late[0]).mean(axis=1) * along, axis=1) / 1000 / seconds
speeds = speeds.reshape(len(SHARES), FILAMENTS)
means, errors = speeds.mean(axis=1), speeds.std(axis=1, ddof=1) / np.sqrt(FILAMENTS)
expected = 1 / ((1 - np.array(SHARES)) / FAST + np.array(SHARES) / SLOW)
for share, mean, error, own in zip(SHARES, means, errors, expected):
    print(f"{share:4.0%} of motors slow: {mean:.3f} +- {error:.3f} um/s; {own:.3f} where forces are balanced")

figure, (plane, panel) = plt.subplots(1, 2, figsize=(11, 6), width_ratios=(1, 1.6), layout="constrained")
for number, path in enumerate(np.moveaxis(late, 1, 0)):
    color = plt.cm.plasma(0.9 * (number // FILAMENTS) / (len(SHARES) - 1))
    middle = path.mean(axis=1) / 1000
    plane.plot(middle[:, 0] - middle[0, 0], middle[:, 1], color=color)
    plane.plot(*(path[-1] - [path[0].mean(axis=0)[0], 0]).T / 1000, color=color, lw=3)
plane.set(xlabel="way (µm)", ylabel="y (µm)", title="Where microtubules have gone")
fine = np.linspace(0, 1, 101)
panel.plot(100 * fine, 1 / ((1 - fine) / FAST + fine / SLOW), "k-", label="balance of forces")
for share, mean, error in zip(SHARES, means, errors):
    color = plt.cm.plasma(0.9 * share)
    panel.errorbar(100 * share, mean, error, fmt="o", color=color, markersize=9, capsize=4)
panel.set(xlabel="slow motors (%)", ylabel="speed (µm/s)", ylim=(0, None), title="Speed over fast and slow motors")
panel.legend()
figure.savefig(folder / "motors.png", dpi=110)
print(f"Wrote {folder}: motors.cif, motors.dcd and motors.png")
