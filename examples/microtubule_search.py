"""Microtubules that search a cell: they grow from its centre, shrink, vanish, and begin anew.

Their minus ends are capped. Plus ends turn from growth to shrinking at catastrophes, and a few back; what has shrunk to
the least length vanishes, and its place is free for another that begins around the centre. Lengths are exponential
then, with a mean that the two speeds and the two rates of dynamic instability decide. Where microtubules meet the wall
of the cell they push it, and bend. The speeds are those of pure tubulin; catastrophes are as frequent as in cells.

    python microtubule_search.py [folder] [steps]
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
    TUBULIN,
    DynamicInstability,
    Filaments,
    Growth,
    Nucleation,
    Sphere,
    filament_wall_force,
)

RADIUS = 3000.0  # nm, of the cell
CENTRE = 300.0  # nm, of the ball in which microtubules begin
PLACES = 250
SEGMENT = 400  # monomers: 246 nm
SHORTEST = 0.5 * SEGMENT * TUBULIN.length
CONCENTRATION = unit.Quantity(15e-6, unit.molar)
NUCLEATION = 6.0  # per second
STEP = 5 * unit.millisecond
STEPS = 60000
FRAMES = 150
VISCOSITY = 1 * unit.pascal * unit.second
TEMPERATURE = 310 * unit.kelvin
GROWING, SHRINKING = "#0072B2", "#D55E00"

folder = Path(sys.argv[1] if len(sys.argv) > 1 else "output_microtubule_search")
steps = int(sys.argv[2]) if len(sys.argv) > 2 else STEPS
folder.mkdir(parents=True, exist_ok=True)
interval = max(1, steps // FRAMES)

instability = DynamicInstability(
    catastrophe_rate=0.05 / unit.second, rescue_rate=0.02 / unit.second, shrinking_off_rate=733 / unit.second
)
growth = Growth(
    monomers=TUBULIN,
    pool=CONCENTRATION,
    shortest=SHORTEST,
    longest=2.5 * RADIUS,
    plus_instability=instability,
    minus_capped=True,
    vanishes=True,
)
nucleation = Nucleation(rate=NUCLEATION / unit.second, region=Sphere([0, 0, 0], CENTRE))
microtubule = MICROTUBULE.with_segment_length(SEGMENT * TUBULIN.length)
filaments = Filaments(VISCOSITY, TEMPERATURE)
filaments.add_reserve(microtubule, PLACES, growth=growth, nucleation=nucleation)
topology, system, positions = filaments.build()
wall = Sphere([0, 0, 0], RADIUS)
system.addForce(filament_wall_force(filaments, system, wall, 1 * unit.piconewton / unit.nanometer))
integrator = filaments.create_integrator(system, STEP, random_seed=1, checks=False)
simulation = app.Simulation(topology, system, integrator, openmm.Platform.getPlatformByName("CPU"))
simulation.context.setPositions(positions)
here = filaments.in_context(simulation.context)
with open(folder / "search.cif", "w") as file:
    app.PDBxFile.writeFile(topology, positions, file, keepIds=True)
simulation.reporters.append(app.DCDReporter(str(folder / "search.dcd"), interval))


def per_second(rate):
    """A rate in 1/ps, in 1/s."""
    return 1e12 * rate


growing_on, growing_off = growth.rates("plus")
speed = per_second(growing_on * growth.pool.concentration - growing_off) * TUBULIN.length / 1000  # um/s
shrinking_speed = per_second(instability.shrinking_off_rate) * TUBULIN.length / 1000
catastrophes, rescues = per_second(instability.catastrophe_rate), per_second(instability.rescue_rate)
mean = speed * shrinking_speed / (shrinking_speed * catastrophes - speed * rescues)
life = mean / speed + mean / shrinking_speed
# One that has just begun vanishes if it ever loses a monomer more than it gains while it grows.
survive = 1 - growing_off / (growing_on * growth.pool.concentration)
expected = NUCLEATION * survive * life

course = []
for _ in range(steps // interval):
    simulation.step(interval)
    course.append(here.growth())
time = interval * STEP.value_in_unit(unit.second) * np.arange(1, len(course) + 1)
present = [own.nodes > 0 for own in course]
numbers = np.array([np.count_nonzero(own) for own in present])
shrinking = np.array([np.count_nonzero(own.shrinking[there, 1]) for own, there in zip(course, present)])
late = time > min(4 * life, 0.5 * time[-1])
# By so much are they longer than those that vanish.
longer = np.concatenate(
    [own.lengths._value[there] - SHORTEST for own, there, use in zip(course, present, late) if use] or [np.zeros(0)]
)
longer = 0.001 * longer
state = simulation.context.getState(positions=True)
x = state.getPositions(asNumpy=True).value_in_unit(unit.micrometer)
last = course[-1]
ends = np.array([x[filaments.node_indices[number][-1]] for number in np.flatnonzero(present[-1])]).reshape(-1, 3)
at_wall = np.count_nonzero(np.linalg.norm(ends, axis=1) > 0.95 * RADIUS / 1000)
print(
    f"{steps} steps of {STEP}; {time[-1]:.3g} s. {last.nucleated} microtubules have begun and {last.vanished} vanished"
)
if longer.size:
    print(
        f"they are {longer.mean():.2f} um longer than those that vanish, without a wall {mean:.2f} um; "
        f"{numbers[late].mean():.0f} at a time, of which {shrinking[late].mean():.1f} shrink "
        f"({expected:.0f} and {expected * speed / (speed + shrinking_speed):.1f})"
    )
print(
    f"of {numbers[-1]} plus ends, {at_wall} are within a twentieth of the radius of the wall; "
    f"{last.without_place} microtubules found no place to begin"
)

figure = plt.figure(figsize=(13, 6.5), layout="constrained")
grid = figure.add_gridspec(2, 2, width_ratios=(1.1, 1))
cell, courses, lengths = figure.add_subplot(grid[:, 0]), figure.add_subplot(grid[0, 1]), figure.add_subplot(grid[1, 1])
radius = RADIUS / 1000
cell.add_patch(plt.Circle((0, 0), radius, facecolor="#F4F1EA", edgecolor="#555555", linewidth=2))
for number in sorted(np.flatnonzero(present[-1]), key=lambda number: x[filaments.node_indices[number][0], 2]):
    nodes = x[filaments.node_indices[number]][: last.nodes[number]]
    colour = SHRINKING if last.shrinking[number, 1] else GROWING
    cell.plot(*nodes[:, :2].T, color=colour, linewidth=1.6, alpha=0.85)
    cell.plot(*nodes[-1, :2], "o", color=colour, markersize=3.5)
for label, colour in (("plus end grows", GROWING), ("plus end shrinks", SHRINKING)):
    cell.plot([], [], "-o", color=colour, linewidth=1.6, markersize=3.5, label=label)
cell.legend(frameon=False, loc="upper left")
cell.set(xlim=(-1.05 * radius, 1.05 * radius), ylim=(-1.05 * radius, 1.05 * radius), aspect="equal")
cell.set_axis_off()
courses.plot(time, numbers, color="#333333", linewidth=1.5, label="microtubules")
courses.plot(time, shrinking, color=SHRINKING, linewidth=1.5, label="of which shrink")
courses.axhline(expected, color="#333333", linestyle="--", linewidth=1)
courses.axhline(expected * speed / (speed + shrinking_speed), color=SHRINKING, linestyle="--", linewidth=1)
courses.set(xlabel="time (s)", ylabel="how many", xlim=(0, time[-1]), ylim=(0, None))
courses.legend(frameon=False, loc="center right")
bins = np.linspace(0, 6 * mean, 37)
lengths.hist(longer, bins, density=longer.size > 0, color="#009E73", alpha=0.6, label="simulated")
lengths.plot(bins, np.exp(-bins / mean) / mean, "--", color="#101010", label="exponential, without a wall")
lengths.set(yscale="log", ylim=(1e-3, 2 / mean), xlim=(0, bins[-1]))
lengths.set(xlabel="length beyond that of those which vanish (µm)", ylabel="density (1/µm)")
lengths.legend(frameon=False)
for panel in (courses, lengths):
    panel.spines[["top", "right"]].set_visible(False)
figure.savefig(folder / "search.png", dpi=100)
print(f"Wrote search.cif, search.dcd and search.png to {folder}.")
