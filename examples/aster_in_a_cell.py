"""Asters that find the middle of their cells: microtubules that grow push the pole away from the wall.

A pole, which is a rigid body, holds the minus ends of microtubules, and keeps them radial. Their plus ends turn from
growth to shrinking at catastrophes, and back. At the wall they push, grow more slowly, and turn more often. More of
them reach the wall where it is near, so the pole moves to the middle, as in chambers of glass (Holy, Dogterom, Yurke,
Leibler, PNAS 1997, 94, 6228). There it wanders by about 1 um, since few of them push at a time. The cells are in one
System: in half of them, microtubules keep their lengths, and poles only diffuse. Speeds and rates are of the order of
those in cells.

    python aster_in_a_cell.py [folder] [steps]
"""

import sys
from pathlib import Path

import matplotlib

matplotlib.use("Agg")

import matplotlib.pyplot as plt
import numpy as np
import openmm
from openmm import app, unit

from openmm_cylchain import (
    MICROTUBULE,
    Body,
    Crosslinker,
    DynamicInstability,
    Filaments,
    Growth,
    Hand,
    Monomers,
    Sphere,
    filament_wall_force,
)

CELLS = 4  # with growth, and as many without
RADIUS = 5000.0  # nm, of a cell
POLE = 300.0  # nm, radius
BEGIN = 2500.0  # nm, from the middle
MICROTUBULES = 24  # of an aster
RING = 8.0  # nm: 13 dimers of tubulin, one for each protofilament
SEGMENT = 100 * RING
SEGMENTS = 2
STEP = 2 * unit.millisecond
STEPS = 30000
FRAMES = 100
VISCOSITY = 0.03 * unit.pascal * unit.second
TEMPERATURE = 310 * unit.kelvin
NEWTONS = unit.piconewton / unit.nanometer
GROWS, STAYS = "#0072B2", "#D55E00"

folder = Path(sys.argv[1] if len(sys.argv) > 1 else "output_aster_in_a_cell")
steps = int(sys.argv[2]) if len(sys.argv) > 2 else STEPS
folder.mkdir(parents=True, exist_ok=True)
interval = max(1, steps // FRAMES)

CONCENTRATION = unit.Quantity(15e-6, unit.molar)
ring = Monomers(length=RING, plus_on_rate=25 / unit.second / CONCENTRATION)
growth = Growth(
    monomers=ring,
    pool=CONCENTRATION,
    growing_force=1.7 * unit.piconewton,
    shortest=1.5 * SEGMENT,
    longest=2.2 * RADIUS,
    minus_capped=True,
    plus_instability=DynamicInstability(
        catastrophe_rate=0.08 / unit.second,
        blocked_catastrophe_rate=0.25 / unit.second,
        rescue_rate=0.3 / unit.second,
        shrinking_off_rate=60 / unit.second,
    ),
)
microtubule = MICROTUBULE.with_segment_length(SEGMENT)

# Directions that are spread evenly: a spiral of Fibonacci.
height = 1 - (2 * np.arange(MICROTUBULES) + 1) / MICROTUBULES
turn = np.pi * (3 - np.sqrt(5)) * np.arange(MICROTUBULES)
directions = np.stack([*(np.sqrt(1 - height**2) * [np.cos(turn), np.sin(turn)]), height], axis=1)
pole = Body.sphere(POLE, np.concatenate([POLE * directions, (POLE + SEGMENT) * directions]), name="Pole")

generator = np.random.default_rng(1)
filaments = Filaments(VISCOSITY, TEMPERATURE)
middles = 2.4 * RADIUS * np.array([[cell % CELLS, -(cell // CELLS), 0] for cell in range(2 * CELLS)])
starts = []
for cell, middle in enumerate(middles):
    angle = generator.uniform(0, 2 * np.pi)
    starts.append(middle + BEGIN * np.array([np.cos(angle), np.sin(angle), 0]))
    for direction in directions:
        start = starts[-1] + POLE * direction
        filaments.add_straight(microtubule, SEGMENTS, start, direction, growth=growth if cell < CELLS else None)
# Linkers that never unbind hold them: at their minus ends, and, to keep them radial, a segment further out.
particle = sum(len(own.positions) + own.spare_nodes for own in filaments)  # the first one of the first pole
hold = Hand(binding_rate=0.0, reach=1.0, unbinding_rate=0.0)
for stiffness, first, along in ((1.0, 1, 0.0), (0.1, 1 + MICROTUBULES, SEGMENT)):
    kind = Crosslinker(hands=hold, stiffness=stiffness * NEWTONS, rest_length=0.0, name=f"at {along:g} nm")
    points = first + np.arange(MICROTUBULES)
    anchors = np.concatenate([particle + cell * len(pole.points) + points for cell in range(2 * CELLS)])
    places = [(number, along) for number in range(len(anchors))]
    filaments.add_linkers(kind, anchors=anchors, bound=len(anchors), places=places)
for start in starts:
    filaments.add_body(pole, start)
topology, system, positions = filaments.build()
centres = [int(own[0]) for own in filaments.body_indices]
for cell, middle in enumerate(middles):
    own = range(cell * MICROTUBULES, (cell + 1) * MICROTUBULES)
    wall = filament_wall_force(
        filaments, system, Sphere(middle, RADIUS), 0.1 * NEWTONS, 0.0, [centres[cell]], POLE, numbers=own
    )
    system.addForce(wall)
integrator = filaments.create_integrator(system, STEP, random_seed=1, checks=False)
simulation = app.Simulation(topology, system, integrator, openmm.Platform.getPlatformByName("CPU"))
simulation.context.setPositions(positions)
here = filaments.in_context(simulation.context)
with open(folder / "aster.cif", "w") as file:
    app.PDBxFile.writeFile(topology, positions, file, keepIds=True)
simulation.reporters.append(app.DCDReporter(str(folder / "aster.dcd"), interval))


def shapes():
    """Nodes of the microtubules of the first cell, from its middle in um, and which of them shrink."""
    x = simulation.context.getState(positions=True).getPositions(asNumpy=True)._value
    found = here.growth()
    own = [x[filaments.node_indices[number]][: found.nodes[number]] for number in range(MICROTUBULES)]
    return [(nodes - middles[0]) / 1000 for nodes in own], (x[centres] - middles) / 1000


begin = shapes()
course, lengths = [begin[1]], []
for _ in range(steps // interval):
    simulation.step(interval)
    end = shapes()
    course.append(end[1])
    lengths.append(here.growth().lengths._value[: CELLS * MICROTUBULES].mean() / 1000)
time = interval * STEP.value_in_unit(unit.second) * np.arange(len(course))
# How far from the middle poles are, along the line on which they begin.
course = np.einsum("tci,ci->tc", course, begin[1] / np.linalg.norm(begin[1], axis=1)[:, None])
mean = {True: course[:, :CELLS].mean(axis=1), False: course[:, CELLS:].mean(axis=1)}
error = {
    True: course[:, :CELLS].std(axis=1, ddof=1) / np.sqrt(CELLS),
    False: course[:, CELLS:].std(axis=1, ddof=1) / np.sqrt(CELLS),
}
divided = integrator.getNumDividedSteps() / (len(filaments) * steps)
print(f"{steps} steps of {STEP}, {100 * divided:.2g} % of them divided; {time[-1]:.3g} s in {2 * CELLS} cells")
for own, text in ((course[:, :CELLS], "grow and shrink"), (course[:, CELLS:], "keep their lengths")):
    late = own[len(own) // 2 :].mean(axis=0)
    print(
        f"where microtubules {text}, poles are {late.mean():.2f} +- {late.std(ddof=1) / np.sqrt(CELLS):.2f} um from "
        f"the middle in the second half, along the line on which they begin, at first {own[0].mean():.2f} um"
    )
print(f"those that grow are {lengths[-1]:.2f} um long in the mean, at first {SEGMENTS * SEGMENT / 1000:.2f} um")

figure = plt.figure(figsize=(13, 5), layout="constrained")
before, after, panel = figure.subplots(1, 3, width_ratios=(1, 1, 1.25))
radius = RADIUS / 1000
for axes, (nodes, poles), title in ((before, begin, "At first"), (after, end, f"After {time[-1]:.3g} s")):
    axes.add_patch(plt.Circle((0, 0), radius, facecolor="#F4F1EA", edgecolor="#555555", linewidth=2))
    for own in sorted(nodes, key=lambda own: own[-1, 2]):
        axes.plot(*own[:, :2].T, color=GROWS, linewidth=1.6, alpha=0.85)
        axes.plot(*own[-1, :2], "o", color=GROWS, markersize=3.5)
    axes.add_patch(plt.Circle(poles[0, :2], POLE / 1000, facecolor="#333333", zorder=3))
    axes.plot(0, 0, "+", color="#101010", markersize=9, zorder=4)
    axes.set(xlim=(-1.05 * radius, 1.05 * radius), ylim=(-1.05 * radius, 1.05 * radius), aspect="equal", title=title)
    axes.set_axis_off()
for grows, colour, text in ((True, GROWS, "grow and shrink"), (False, STAYS, "keep their lengths")):
    own = course[:, :CELLS] if grows else course[:, CELLS:]
    panel.plot(time, own, color=colour, linewidth=0.8, alpha=0.45)
    panel.plot(time, mean[grows], color=colour, linewidth=2.2, label=f"microtubules {text}")
    panel.fill_between(time, mean[grows] - error[grows], mean[grows] + error[grows], color=colour, alpha=0.25)
panel.set(xlabel="time (s)", ylabel="pole from the middle, along its first direction (µm)", xlim=(0, time[-1]))
panel.axhline(0, color="0.6", linewidth=1)
panel.legend(frameon=False, loc="lower left")
panel.spines[["top", "right"]].set_visible(False)
figure.savefig(folder / "aster.png", dpi=110)
print(f"Wrote aster.cif, aster.dcd and aster.png to {folder}.")
