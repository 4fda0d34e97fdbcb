"""A contractile bundle: motors and crosslinkers between actin filaments of both polarities in a cylinder.

Forty filaments of about 1 um lie in a cylinder, as in a stress fibre or a contractile ring. Motors walk towards plus
ends with both of their heads, and pull filaments of opposite directions past each other; crosslinkers hold filaments
together, bind and unbind. Filaments do not pass through each other. The bundle becomes shorter; with motors that do not
walk, for comparison, it does not.

Steps resolve contacts. How much so few filaments contract is chance: a few percent more or less.

    python contractile_bundle.py [folder] [steps]
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
    F_ACTIN,
    Crosslinker,
    Cylinder,
    Filaments,
    Hand,
    capsule_contact_force,
    filament_wall_force,
)
from openmm_cylchain.rendering import colors_of_filaments, spring_colors

FILAMENTS = 40
SEGMENT_LENGTH = 100.0  # nm
LENGTH, RADIUS = 4000.0, 80.0  # nm, of the bundle at first and of the cylinder
DIAMETER = 20.0  # nm, at which filaments touch
MOTORS, CROSSLINKERS = 200, 200
STEP = 0.1 * unit.millisecond
STEPS = 15000
FRAMES = 100
VISCOSITY = 1 * unit.pascal * unit.second
TEMPERATURE = 298.15 * unit.kelvin

folder = Path(sys.argv[1] if len(sys.argv) > 1 else "output_contractile_bundle")
steps = int(sys.argv[2]) if len(sys.argv) > 2 else STEPS
folder.mkdir(parents=True, exist_ok=True)
actin = F_ACTIN.with_segment_length(SEGMENT_LENGTH)
piconewton = unit.piconewton


def linkers(speed):
    """Motors and crosslinkers; their springs are of 50 nm, so that they reach somewhat further."""
    head = Hand(
        binding_rate=16 / unit.second,
        reach=80 * unit.nanometer,
        unbinding_rate=1 / unit.second,
        speed=speed * unit.micrometer / unit.second,
        stall_force=4 * piconewton if speed else None,
    )
    passive = Hand(binding_rate=16 / unit.second, reach=80 * unit.nanometer, unbinding_rate=0.4 / unit.second)
    of_motors, of_crosslinkers = 0.1 * piconewton / unit.nanometer, 0.08 * piconewton / unit.nanometer
    yield Crosslinker(hands=head, stiffness=of_motors, rest_length=50 * unit.nanometer, name="motor"), MOTORS
    yield Crosslinker(hands=passive, stiffness=of_crosslinkers, rest_length=50 * unit.nanometer), CROSSLINKERS


def bundle(speed, positions=None):
    """A bundle in a Simulation; from given positions with linkers, else without."""
    generator = np.random.default_rng(2)
    filaments = Filaments(VISCOSITY, TEMPERATURE)
    for number in range(FILAMENTS):
        segments = int(np.clip(round(generator.normal(10, 3)), 4, 16))
        half, sign = 0.5 * segments * SEGMENT_LENGTH, 1 - 2 * (number % 2)
        x, angle = generator.uniform(half - 0.5 * LENGTH, 0.5 * LENGTH - half), generator.uniform(0, 2 * np.pi)
        radius = (RADIUS - 0.5 * DIAMETER) * np.sqrt(generator.uniform())
        start = [x - sign * half, radius * np.cos(angle), radius * np.sin(angle)]
        filaments.add_straight(actin, segments, start, [sign, 0, 0])
    if positions is not None:
        for kind, count in linkers(speed):
            filaments.add_linkers(kind, count, volume=np.pi * RADIUS**2 * LENGTH, bound=count)
    topology, system, drawn = filaments.build()
    system.addForce(capsule_contact_force(filaments, system, DIAMETER))
    wall = Cylinder([0, 0, 0], [1, 0, 0], RADIUS)
    system.addForce(filament_wall_force(filaments, system, wall, 0.5 * piconewton / unit.nanometer))
    integrator = filaments.create_integrator(system, STEP, random_seed=1)
    simulation = app.Simulation(topology, system, integrator, openmm.Platform.getPlatformByName("CPU"))
    simulation.context.setPositions(drawn if positions is None else positions)
    return filaments, simulation


def current(simulation):
    """Positions of all nodes in um."""
    return simulation.context.getState(positions=True).getPositions(asNumpy=True).value_in_unit(unit.micrometer)


def relaxed():
    """Positions in which filaments, drawn on top of each other, have come apart: first in the cold, then warm."""
    _, simulation = bundle(0.0)
    # Divided steps are no harm where nothing is averaged.
    simulation.integrator.checks = False
    for temperature, lengths in ((1 * unit.kelvin, (1e-3, 0.01, 0.1, 1.0)), (TEMPERATURE, (0.01, 0.1, 1.0))):
        simulation.integrator.setTemperature(temperature)
        for length in lengths:
            simulation.integrator.setStepSize(length * unit.millisecond)
            simulation.integrator.step(30)
    return current(simulation) * unit.micrometer


def length(filaments, shape):
    """The length over which segments lie if they lie evenly: 12^(1/2) standard deviations."""
    middles = [0.5 * (shape[own[1:], 0] + shape[own[:-1], 0]) for own in filaments.node_indices]
    return np.sqrt(12) * np.concatenate(middles).std()


def course(filaments, simulation):
    """Lengths and numbers of linkers with both hands bound after each interval."""
    lengths, bound = [length(filaments, current(simulation))], [(0, 0)]
    for _ in range(steps // interval):
        simulation.step(interval)
        lengths.append(length(filaments, current(simulation)))
        table = filaments.in_context(simulation.context).linkers()
        bound.append((table.counts(0)[2], table.counts(1)[2]))
    return np.array(lengths), np.array(bound)


interval = max(1, steps // FRAMES)
start = relaxed()
filaments, simulation = bundle(1.0, start)
here = filaments.in_context(simulation.context)
first = current(simulation)
with open(folder / "bundle.cif", "w") as file:
    app.PDBxFile.writeFile(simulation.topology, start, file, keepIds=True)
simulation.reporters.append(app.DCDReporter(str(folder / "bundle.dcd"), interval))
lengths, bound = course(filaments, simulation)
divided = simulation.integrator.getNumDividedSteps() / (FILAMENTS * steps)
passive_lengths, _ = course(*bundle(0.0, start))

time = interval * STEP.value_in_unit(unit.second) * np.arange(len(lengths))
print(f"{steps} steps of {STEP}, {100 * divided:.2g} % of them divided; {time[-1]:.3g} s")
print(f"at the end {bound[-1][0]} of {MOTORS} motors and {bound[-1][1]} of {CROSSLINKERS} crosslinkers join filaments")
print(f"length: {lengths[0]:.2f} um at first, {lengths[-1]:.2f} um at last; {passive_lengths[-1]:.2f} um if none walk")

figure = plt.figure(figsize=(11, 6.6), layout="constrained")
grid = figure.add_gridspec(3, 2, height_ratios=(1, 1, 2.6))
panels = [figure.add_subplot(grid[0, :]), figure.add_subplot(grid[1, :])]
plot, numbers = figure.add_subplot(grid[2, 0]), figure.add_subplot(grid[2, 1])
colours, (of_motors, of_crosslinkers) = colors_of_filaments(2), spring_colors([True, False])
last, table = current(simulation), here.linkers()
pulls = here.linker_pulls()
kinds = table.types[np.searchsorted(table.numbers, pulls.numbers)]
for axes, shape, title in zip(panels, (first, last), ("At first", f"After {time[-1]:.3g} s")):
    for number, own in enumerate(filaments.node_indices):
        axes.plot(*shape[own, :2].T, color=colours[number % 2], linewidth=1.2, alpha=0.9)
    for y in (-RADIUS, RADIUS):
        axes.axhline(y / 1000, color="0.8", linewidth=1, zorder=0)
    reach = 0.55 * LENGTH / 1000
    axes.set(aspect="equal", xlim=(-reach, reach), ylim=(-0.14, 0.14), ylabel="y (µm)")
    axes.set_title(title, loc="left", fontsize=11)
    axes.spines[["top", "right"]].set_visible(False)
for kind, (colour, label) in enumerate(((of_motors, "motor"), (of_crosslinkers, "crosslinker"))):
    panels[1].plot(*pulls.places[kinds == kind, :, :2].T / 1000, color=colour, linewidth=1.0, zorder=3)
    panels[0].plot([], [], color=colour, linewidth=1.6, label=label)
for colour, label in zip(colours, ("plus end on the right", "plus end on the left")):
    panels[0].plot([], [], color=colour, linewidth=1.6, label=label)
panels[0].legend(frameon=False, ncols=4, loc="lower right", bbox_to_anchor=(1.0, 1.0))
panels[1].set_xlabel("x (µm)")
plot.plot(time, 100 * (1 - lengths / lengths[0]), color=of_motors, linewidth=2, label="motors walk")
plot.plot(time, 100 * (1 - passive_lengths / lengths[0]), "--", color="0.5", linewidth=2, label="no motor walks")
plot.set(xlabel="time (s)", ylabel="shortening (%)", xlim=(0, time[-1]))
for kind, (colour, label) in enumerate(((of_motors, "motors"), (of_crosslinkers, "crosslinkers"))):
    numbers.plot(time, bound[:, kind], color=colour, linewidth=1.8, label=f"{label}, of {(MOTORS, CROSSLINKERS)[kind]}")
numbers.set(xlabel="time (s)", ylabel="with both hands bound", xlim=(0, time[-1]), ylim=(0, None))
for axes in (plot, numbers):
    axes.legend(frameon=False)
    axes.spines[["top", "right"]].set_visible(False)
figure.savefig(folder / "bundle.png", dpi=110)
print(f"Wrote bundle.cif, bundle.dcd and bundle.png to {folder}.")
