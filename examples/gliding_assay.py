"""A gliding assay: microtubules that are carried over a plane by motors which are anchored there.

Motors are anchored at random points of a plane in a periodic box. The hand of each binds to filaments within its reach,
walks towards their plus ends (their last nodes) and lets go; filaments glide with their minus ends in front, with the
speed of the motors. Nothing else drives them. Their noise is that of the solvent and of motors that come and go.

    python gliding_assay.py [folder] [steps]
"""

import sys
from pathlib import Path

import matplotlib

matplotlib.use("Agg")

import matplotlib.pyplot as plt
import numpy as np
import openmm
from openmm import app, unit

from openmm_cylchain import MICROTUBULE, Crosslinker, Filaments, Hand

FILAMENTS = 12
SEGMENTS, SEGMENT_LENGTH = 8, 500.0  # nm
BOX = 8000.0  # nm
MOTORS = 3500
SPEED = 0.8  # um/s
STEP = 2 * unit.millisecond
STEPS = 3000
FRAMES = 100
VISCOSITY = 1e-3 * unit.pascal * unit.second
TEMPERATURE = 310 * unit.kelvin

folder = Path(sys.argv[1] if len(sys.argv) > 1 else "output_gliding_assay")
steps = int(sys.argv[2]) if len(sys.argv) > 2 else STEPS
folder.mkdir(parents=True, exist_ok=True)
generator = np.random.default_rng(4)

microtubule = MICROTUBULE.with_segment_length(SEGMENT_LENGTH)
filaments = Filaments(VISCOSITY, TEMPERATURE)
for number in range(FILAMENTS):
    start = [*generator.uniform(0, BOX, 2), 0]
    filaments.add_equilibrium(microtubule, SEGMENTS, seed=number, start=start, planar=True)
hand = Hand(
    binding_rate=20 / unit.second,
    reach=50 * unit.nanometer,
    unbinding_rate=0.5 / unit.second,
    unbinding_force=6 * unit.piconewton,
    speed=SPEED * unit.micrometer / unit.second,
    stall_force=5 * unit.piconewton,
)
motor = Crosslinker(hands=hand, stiffness=0.02 * unit.piconewton / unit.nanometer, name="motor")
anchors = np.column_stack([generator.uniform(0, BOX, (MOTORS, 2)), np.zeros(MOTORS)])
filaments.add_linkers(motor, anchors=anchors)
box = np.diag([BOX, BOX, 1000.0])
topology, system, positions = filaments.build(box_vectors=box)
# Bends of microtubules relax within a step. That is not resolved, and need not be: hence no check of the step.
integrator = filaments.create_integrator(system, STEP, random_seed=1, checks=False)
simulation = app.Simulation(topology, system, integrator, openmm.Platform.getPlatformByName("CPU"))
context = simulation.context
here = filaments.in_context(context)
context.setPositions(positions)
with open(folder / "assay.cif", "w") as file:
    app.PDBxFile.writeFile(topology, positions, file, keepIds=True)
interval = max(1, steps // FRAMES)
simulation.reporters.append(app.DCDReporter(str(folder / "assay.dcd"), interval, enforcePeriodicBox=False))

nodes = np.array(filaments.node_indices)
frames, holding = [], []
for _ in range(steps // interval):
    simulation.step(interval)
    frames.append(context.getState(positions=True).getPositions(asNumpy=True).value_in_unit(unit.nanometer)[nodes])
    holding.append(here.linkers().counts()[2])
frames = np.array(frames)[..., :2]
divided = integrator.getNumDividedSteps() / (FILAMENTS * steps)

seconds = interval * STEP.value_in_unit(unit.second)
directions = frames[:, :, 0] - frames[:, :, -1]
directions /= np.linalg.norm(directions, axis=-1)[..., None]
moves = np.diff(frames.mean(axis=2), axis=0) / (1000 * seconds)
forward = np.sum(moves * 0.5 * (directions[1:] + directions[:-1]), axis=-1)
print(
    f"{steps} steps of {STEP}, {100 * divided:.2g} % of them divided; {steps * STEP.value_in_unit(unit.second):.3g} s"
)
print(f"{np.mean(holding):.0f} of {MOTORS} motors hold a filament: {np.mean(holding) / FILAMENTS:.0f} each")
late = forward[len(forward) // 10 :]
print(f"filaments glide at {late.mean():.3f} um/s, with their minus ends in front; motors walk at {SPEED:g} um/s")

figure, (plane, panel) = plt.subplots(1, 2, figsize=(12, 6.6), width_ratios=(1.5, 1), layout="constrained")


def wrapped(path):
    """A path in um in the periodic box, broken where it leaves it."""
    inside = np.mod(path, BOX) / 1000
    leaves = np.abs(np.diff(inside, axis=0)).max(axis=1) > 0.5 * BOX / 1000
    return np.insert(inside, np.flatnonzero(leaves) + 1, np.nan, axis=0)


plane.plot(*anchors[:, :2].T / 1000, ".", color="0.8", markersize=1.5, zorder=0)
pulls = here.linker_pulls()
plane.plot(*np.mod(pulls.places[:, 0, :2], BOX).T / 1000, ".", color="#B3261E", markersize=4, zorder=3)
for number in range(FILAMENTS):
    trace = frames[:, number].mean(axis=1)
    plane.plot(*wrapped(trace).T, color="#0072B2", linewidth=1, alpha=0.35)
    fine = np.concatenate([np.linspace(a, b, 20) for a, b in zip(frames[-1, number], frames[-1, number][1:])])
    plane.plot(*wrapped(fine).T, color="#0072B2", linewidth=2.6, solid_capstyle="round")
    tip = np.mod(frames[-1, number, 0], BOX) / 1000
    ahead = 0.12 * directions[-1, number]
    arrow = {"arrowstyle": "-|>", "color": "#0072B2", "linewidth": 0, "mutation_scale": 16}
    plane.annotate("", tip + ahead, tip - ahead, arrowprops=arrow)
plane.plot([], [], color="#0072B2", linewidth=2.6, label="microtubule, minus end in front")
plane.plot([], [], color="#0072B2", linewidth=1, alpha=0.35, label="path of its middle")
plane.plot([], [], ".", color="#B3261E", markersize=8, label="motor that holds one")
plane.plot([], [], ".", color="0.8", markersize=6, label="other motors")
plane.legend(frameon=False, loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=2)
plane.set(aspect="equal", xlabel="x (µm)", ylabel="y (µm)", xlim=(0, BOX / 1000), ylim=(0, BOX / 1000))
# Noise moves a filament by more than motors do in one frame.
window = max(1, min(10, len(forward) // 2))
mean = np.array([np.convolve(path, np.ones(window) / window, "valid") for path in forward.T])
time = seconds * (1 + np.arange(mean.shape[1]) + 0.5 * window)
panel.plot(time, mean.T, color="0.75", linewidth=0.8)
panel.plot([], [], color="0.75", linewidth=1, label="each filament")
panel.plot(time, mean.mean(axis=0), color="#0072B2", linewidth=2.2, label="mean of all filaments")
panel.axhline(SPEED, color="#B3261E", linestyle="--", linewidth=1.8, label="speed of motors without load")
panel.set(xlabel="time (s)", ylim=(0, 1.6 * SPEED), xlim=(0, time[-1] + seconds))
panel.set_ylabel(f"speed along the filament, over {window * seconds:.2g} s (µm/s)")
panel.legend(frameon=False, loc="lower right")
panel.spines[["top", "right"]].set_visible(False)
figure.savefig(folder / "assay.png", dpi=110)
print(f"Wrote assay.cif, assay.dcd and assay.png to {folder}.")
