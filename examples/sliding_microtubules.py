"""Antiparallel microtubules that motors with two heads slide apart, and parallel ones that they do not.

Twelve microtubules lie side by side in six pairs, as in a spindle: those of three pairs are antiparallel, those of the
others parallel. Motors crosslink each pair, and both heads of a motor walk to the plus end of what they hold. Between
antiparallel microtubules they walk away from each other, so that each filament moves with the speed of a head with its
minus end in front, and the two come apart with twice that. On parallel ones both heads walk side by side, and nothing
slides.

    python sliding_microtubules.py [folder] [steps]
"""

import sys
from pathlib import Path

import matplotlib

matplotlib.use("Agg")

import matplotlib.pyplot as plt
import numpy as np
import openmm
from matplotlib.collections import LineCollection
from openmm import app, unit

from openmm_cylchain import MICROTUBULE, Crosslinker, Filaments, Hand

PAIRS = 6  # the second half are parallel
SEGMENTS, SEGMENT_LENGTH = 8, 500.0  # nm
SPACING, BETWEEN_PAIRS = 50.0, 800.0  # nm; the first is also the rest length of a motor
MOTORS = 40  # for each pair
SPEED = 0.1  # um/s
STEP = 2 * unit.millisecond
STEPS = 5000
FRAMES = 200
VISCOSITY = 0.1 * unit.pascal * unit.second
TEMPERATURE = 310 * unit.kelvin

folder = Path(sys.argv[1] if len(sys.argv) > 1 else "output_sliding_microtubules")
steps = int(sys.argv[2]) if len(sys.argv) > 2 else STEPS
folder.mkdir(parents=True, exist_ok=True)

microtubule = MICROTUBULE.with_segment_length(SEGMENT_LENGTH)
length = SEGMENTS * SEGMENT_LENGTH
filaments = Filaments(VISCOSITY, TEMPERATURE)
for pair in range(PAIRS):
    antiparallel = pair < PAIRS // 2
    for side in (0, 1):
        y, forward = pair * BETWEEN_PAIRS + side * SPACING, side == 0 or not antiparallel
        start, direction = ([-0.5 * length, y, 0], [1, 0, 0]) if forward else ([0.5 * length, y, 0], [-1, 0, 0])
        filaments.add_straight(microtubule, SEGMENTS, start=start, direction=direction, planar=True)
head = Hand(
    binding_rate=20 / unit.second,
    reach=100 * unit.nanometer,
    unbinding_rate=0.3 / unit.second,
    unbinding_force=6 * unit.piconewton,
    speed=SPEED * unit.micrometer / unit.second,
    stall_force=6 * unit.piconewton,
)
motor = Crosslinker(
    hands=head, stiffness=0.1 * unit.piconewton / unit.nanometer, rest_length=SPACING * unit.nanometer, name="motor"
)
count = PAIRS * MOTORS
filaments.add_linkers(motor, count, volume=100 * unit.micrometer**3, bound=count)
topology, system, positions = filaments.build()
# Bends of microtubules relax within a step. That is not resolved, and need not be: hence no check of the step.
integrator = filaments.create_integrator(system, STEP, random_seed=1, checks=False)
simulation = app.Simulation(topology, system, integrator, openmm.Platform.getPlatformByName("CPU"))
context = simulation.context
here = filaments.in_context(context)
context.setPositions(positions)
with open(folder / "sliding.cif", "w") as file:
    app.PDBxFile.writeFile(topology, positions, file, keepIds=True)
interval = max(1, steps // FRAMES)
simulation.reporters.append(app.DCDReporter(str(folder / "sliding.dcd"), interval))

nodes = np.array(filaments.node_indices)
frames, joining = [positions.value_in_unit(unit.nanometer)[nodes] / 1000], []
for _ in range(steps // interval):
    simulation.step(interval)
    now = context.getState(positions=True).getPositions(asNumpy=True).value_in_unit(unit.micrometer)
    frames.append(now[nodes])
    joining.append(here.linkers().counts()[2])
frames = np.array(frames)
divided = integrator.getNumDividedSteps() / (len(filaments) * steps)

seconds = interval * STEP.value_in_unit(unit.second)
time = seconds * np.arange(len(frames))
middles = frames.mean(axis=2)[..., 0].reshape(len(frames), PAIRS, 2)
# Positive where each filament moves with its minus end in front.
apart = middles[..., 1] - middles[..., 0]
late = len(time) // 8
speeds = np.array([np.polyfit(time[late:], path[late:], 1)[0] for path in apart.T])
print(f"{steps} steps of {STEP}, {100 * divided:.2g} % of them divided; {time[-1]:.3g} s")
print(f"{np.mean(joining):.0f} of {count} motors join two filaments")
print(f"antiparallel: {speeds[: PAIRS // 2].mean():.3f} um/s; heads walk at {SPEED:g}, both together at {2 * SPEED:g}")
print(f"parallel: {np.abs(speeds[PAIRS // 2 :]).mean():.3f} um/s")

figure, ((before, after), (panel, detail)) = plt.subplots(
    2, 2, figsize=(12, 8.4), height_ratios=(1.4, 1), layout="constrained"
)
colours = ("#0072B2", "#56B4E9")
pulls = here.linker_pulls()
for axes, shape, title in ((before, frames[0], "Before"), (after, frames[-1], f"After {time[-1]:.3g} s")):
    for own in shape:
        right = bool(own[-1, 0] > own[0, 0])
        axes.plot(*own[:, :2].T, color=colours[int(right)], linewidth=1.8)
        axes.plot(*own[-1, :2], marker=">" if right else "<", color=colours[int(right)], markersize=6)
    axes.set_title(title, loc="left", fontsize=11)
    axes.set(aspect="equal", ylabel="y (µm)", xlabel="x (µm)")
after.add_collection(LineCollection(pulls.places[..., :2] / 1000, colors="#B3261E", linewidths=1.2, zorder=3))
limits = [(frames[[0, -1], ..., axis].min() - 0.2, frames[[0, -1], ..., axis].max() + 0.2) for axis in (0, 1)]
for axes in (before, after):
    axes.set(xlim=limits[0], ylim=limits[1])
for colour, label in zip(colours, ("plus end on the left", "plus end on the right")):
    before.plot([], [], color=colour, linewidth=1.8, label=label)
before.plot([], [], color="#B3261E", linewidth=1.5, label="motor")
before.legend(frameon=False, ncols=3, loc="lower left", bbox_to_anchor=(0.12, 1.0))
for pair, path in enumerate(apart.T):
    antiparallel = pair < PAIRS // 2
    label = ("antiparallel" if antiparallel else "parallel") if pair % (PAIRS // 2) == 0 else None
    panel.plot(time, path - path[0], color="#0072B2" if antiparallel else "#7f8c8d", linewidth=1.6, label=label)
panel.plot(time, 2 * SPEED * time, "--", color="0.2", linewidth=1.4, label="twice the speed of a head")
panel.set(xlabel="time (s)", ylabel="apart (µm)", xlim=(0, time[-1]))
panel.legend(frameon=False)
middle = frames[-1, 2:4].mean(axis=(0, 1))
for own in frames[-1, 2:4]:
    colour = colours[int(own[-1, 0] > own[0, 0])]
    detail.plot(*own[:, :2].T, color=colour, linewidth=5, solid_capstyle="butt")
detail.plot(*pulls.places[..., :2].T / 1000, ".-", color="#B3261E", linewidth=1.8, markersize=9, zorder=3)
detail.set(xlim=middle[0] + np.array([-0.45, 0.45]), ylim=middle[1] + np.array([-0.2, 0.2]), aspect="equal")
detail.set(xlabel="x (µm)", ylabel="y (µm)")
detail.set_title("Motors of the second pair from below", loc="left", fontsize=11)
for axes in (before, after, panel, detail):
    axes.spines[["top", "right"]].set_visible(False)
figure.savefig(folder / "sliding.png", dpi=110)
print(f"Wrote sliding.cif, sliding.dcd and sliding.png to {folder}.")
