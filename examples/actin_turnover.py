"""Turnover: motors in a bundle of actin come to a stop, unless filaments treadmill.

A bundle lies in a tube with closed ends, towards which all plus ends point. Motors walk towards plus ends with both of
their heads, and so pull filaments of both halves into the middle, minus ends in front; crosslinkers hold filaments
together, bind and unbind. Filaments that keep their monomers pass each other until they are sorted the other way round,
and motors have nowhere left to pull them. Where they treadmill, plus ends stay at the ends of the tube and grow as fast
as filaments are pulled away from there, and monomers flow on. Rates are those of ATP-actin, sixty times as fast, with a
pool that filaments share. Filaments pass through each other here.

    python actin_turnover.py [folder] [steps]
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

from openmm_cylchain import (
    ACTIN_ATP,
    F_ACTIN,
    Crosslinker,
    Cylinder,
    Filaments,
    Growth,
    Hand,
    MonomerPool,
    Slab,
    filament_wall_force,
)

FASTER = 60.0  # than pure actin
FILAMENTS, SEGMENTS = 32, 10
MONOMERS = 40  # of a segment
LONGEST = 3 * unit.micrometer
LENGTH, RADIUS = 1800.0, 80.0  # nm, of the tube
MOTORS, CROSSLINKERS = 128, 128
STEP = 1 * unit.millisecond
STEPS = 30000
FRAMES = 150
VISCOSITY = 0.1 * unit.pascal * unit.second
TEMPERATURE = 298.15 * unit.kelvin
RUNS = {"treadmill": "#009E73", "keep their monomers": "#555555"}

folder = Path(sys.argv[1] if len(sys.argv) > 1 else "output_actin_turnover")
steps = int(sys.argv[2]) if len(sys.argv) > 2 else STEPS
folder.mkdir(parents=True, exist_ok=True)
interval = max(1, steps // FRAMES)

rates = ("plus_on_rate", "plus_off_rate", "minus_on_rate", "minus_off_rate")
fast = replace(ACTIN_ATP, **{name: FASTER * getattr(ACTIN_ATP, name) for name in rates})
balance = fast.treadmilling_concentration
pool = MonomerPool(balance, 10 * unit.micrometer**3)
turnover = Growth(monomers=fast, pool=pool, longest=LONGEST)
actin = F_ACTIN.with_segment_length(MONOMERS * fast.length)
piconewton = unit.piconewton


def linkers():
    """Motors like myosin and crosslinkers like alpha-actinin, and how many there are."""
    hand = {"binding_rate": 10 / unit.second, "reach": 60 * unit.nanometer}
    head = Hand(
        **hand, unbinding_rate=0.5 / unit.second, speed=0.2 * unit.micrometer / unit.second, stall_force=4 * piconewton
    )
    stiffness = 0.05 * piconewton / unit.nanometer
    yield Crosslinker(hands=head, stiffness=stiffness, rest_length=40 * unit.nanometer, name="motor"), MOTORS
    held = Hand(**hand, unbinding_rate=0.4 / unit.second)
    yield Crosslinker(hands=held, stiffness=stiffness, rest_length=40 * unit.nanometer), CROSSLINKERS


def bundle(growth):
    """A bundle in a Simulation, and which filaments point along x."""
    generator = np.random.default_rng(4)
    filaments, signs = Filaments(VISCOSITY, TEMPERATURE), np.resize([1, -1], FILAMENTS)
    half = 0.5 * SEGMENTS * actin.segment_length
    for sign in signs:
        x, angle = sign * (0.5 * LENGTH - half - generator.uniform(0, 50)), generator.uniform(0, 2 * np.pi)
        radius = 0.9 * RADIUS * np.sqrt(generator.uniform())
        start = [x - sign * half, radius * np.cos(angle), radius * np.sin(angle)]
        filaments.add_straight(actin, SEGMENTS, start, [sign, 0, 0], growth=growth)
    for kind, count in linkers():
        filaments.add_linkers(kind, count, volume=np.pi * RADIUS**2 * LENGTH, bound=count)
    topology, system, positions = filaments.build()
    for wall in (Cylinder([0, 0, 0], [1, 0, 0], RADIUS), Slab([0, 0, 0], [1, 0, 0], LENGTH)):
        system.addForce(filament_wall_force(filaments, system, wall, 0.1 * piconewton / unit.nanometer))
    integrator = filaments.create_integrator(system, STEP, random_seed=1, checks=False)
    simulation = app.Simulation(topology, system, integrator, openmm.Platform.getPlatformByName("CPU"))
    simulation.context.setPositions(positions)
    return filaments, simulation, signs


def speckles(filaments, simulation):
    """Where monomers are that lie at joints: for each filament, their numbers in segments, and x in um."""
    state = simulation.context.getState(positions=True)
    x = state.getPositions(asNumpy=True).value_in_unit(unit.micrometer)[:, 0]
    grows = filaments[0].growth is not None
    ends = filaments.in_context(simulation.context).growth().monomers if grows else [(0, SEGMENTS * MONOMERS)] * len(x)
    found = []
    for nodes, (first, last) in zip(filaments.node_indices, ends):
        # Joints are at multiples of the monomers of a segment, half a segment or more from the ends.
        begin, end = -(-(first + MONOMERS // 2) // MONOMERS), (last - MONOMERS // 2) // MONOMERS
        numbers = np.arange(begin, end + 1)
        found.append(dict(zip(numbers.tolist(), x[nodes[1 : 1 + len(numbers)]])))
    return found


def flow(course, signs):
    """How fast monomers move, with minus ends in front, in each interval: the mean over them, in um/s."""
    seconds = interval * STEP.value_in_unit(unit.second)
    speeds = []
    for before, after in zip(course, course[1:]):
        moved = [
            sign * (one[number] - other[number])
            for sign, one, other in zip(signs, before, after)
            for number in one.keys() & other.keys()
        ]
        speeds.append(np.mean(moved) / seconds)
    return np.array(speeds)


def side(shown, signs):
    """How far filaments are on the side to which their plus ends point: the mean of their x, in um."""
    return np.mean([sign * x for sign, own in zip(signs, shown) for x in own.values()])


def mean_and_error(values):
    """Of a series, from the means of five pieces of it."""
    pieces = [np.mean(piece) for piece in np.array_split(values, 5)]
    return f"{1000 * np.mean(values):.0f} +- {1000 * np.std(pieces, ddof=1) / np.sqrt(5):.0f} nm/s"


courses, shapes = {}, {}
for name in RUNS:
    growth = turnover if name == "treadmill" else None
    filaments, simulation, signs = bundle(growth)
    if growth:
        with open(folder / "turnover.cif", "w") as file:
            positions = simulation.context.getState(positions=True).getPositions()
            app.PDBxFile.writeFile(simulation.topology, positions, file, keepIds=True)
        simulation.reporters.append(app.DCDReporter(str(folder / "turnover.dcd"), interval))
    courses[name] = [speckles(filaments, simulation)]
    for _ in range(steps // interval):
        simulation.step(interval)
        courses[name].append(speckles(filaments, simulation))
    if growth:
        grown = filaments.in_context(simulation.context).growth()
    state = simulation.context.getState(positions=True)
    x = state.getPositions(asNumpy=True).value_in_unit(unit.micrometer)
    shapes[name] = [x[nodes, :2] for nodes in filaments.node_indices]

time = interval * STEP.value_in_unit(unit.second) * np.arange(steps // interval + 1)
flows = {name: flow(course, signs) for name, course in courses.items()}
sides = {name: np.array([side(shown, signs) for shown in course]) for name, course in courses.items()}
late = 3 * len(time) // 4
print(f"{steps} steps of {STEP}; {time[-1]:.3g} s. Monomers flow with the minus ends of their filaments in front:")
for name in RUNS:
    early, last = flows[name][: len(time) - late], flows[name][late:]
    print(
        f"filaments that {name}: {mean_and_error(early)} in the first quarter, {mean_and_error(last)} in the last; "
        f"from the middle to their plus ends' side {sides[name][0]:.2f} um at first, {sides[name][-1]:.2f} um at last"
    )
plus, minus = ((grown.gained - grown.lost).mean(axis=0) / time[-1] * fast.length)[::-1]
mean, free = grown.lengths.mean()._value, 1e6 * grown.concentrations[0].value_in_unit(unit.molar)
print(f"plus ends grow by {plus:.0f} nm/s and minus ends by {minus:.0f} nm/s; at last filaments are {mean:.0f} nm long")
print(f"of free monomers there are {free:.3f} uM, {1e6 * balance.value_in_unit(unit.molar):.3f} at first")

figure = plt.figure(figsize=(12, 9), layout="constrained")
grid = figure.add_gridspec(3, 2, height_ratios=(0.9, 2, 2))
of_signs = {1: "#0072B2", -1: "#D55E00"}
widest = 0.55 * LENGTH / 1000
for column, name in enumerate(RUNS):
    end, kymograph = figure.add_subplot(grid[0, column]), figure.add_subplot(grid[1, column])
    for sign, points in zip(signs, shapes[name]):
        end.plot(*points.T, color=of_signs[sign], linewidth=1.1, alpha=0.8)
    end.set(xlim=(-widest, widest), ylim=(-0.13, 0.13), xlabel="x (µm)", ylabel="y (µm)")
    end.set_title(f"Filaments that {name}: after {time[-1]:.3g} s", loc="left")
    for number, sign in enumerate(signs):
        own = [shown[number] for shown in courses[name]]
        # One in four of the joints, from when it is there to when it is gone.
        for joint in {one for shown in own for one in shown if one % 4 == 0}:
            there = [(when, shown[joint]) for when, shown in zip(time, own) if joint in shown]
            kymograph.plot(*np.transpose(there), color=of_signs[sign], linewidth=0.9, alpha=0.6)
    kymograph.set(xlim=(0, time[-1]), ylim=(-widest, widest), xlabel="time (s)", ylabel="monomers, along x (µm)")
    for sign, label in ((1, "plus end at larger x"), (-1, "plus end at smaller x")):
        kymograph.plot([], [], color=of_signs[sign], label=label)
panels = [figure.add_subplot(grid[2, column]) for column in range(2)]
window = max(1, len(time) // 20)
for name, colour in RUNS.items():
    smooth = 1000 * np.convolve(flows[name], np.full(window, 1 / window), "valid")
    panels[0].plot(time[: len(smooth)] + 0.5 * window * time[1], smooth, color=colour, linewidth=2, label=name)
    panels[1].plot(time, sides[name], color=colour, linewidth=2, label=name)
for axes in panels:
    axes.axhline(0, color="0.8", linewidth=1, zorder=0)
panels[0].set(xlabel="time (s)", xlim=(0, time[-1]), ylabel="flow, minus ends in front (nm/s)")
panels[1].set(xlabel="time (s)", xlim=(0, time[-1]), ylabel="middles, towards plus ends (µm)")
for axes in figure.axes:
    axes.spines[["top", "right"]].set_visible(False)
for axes in (kymograph, *panels):
    axes.legend(frameon=False, loc="upper left" if axes is kymograph else "best")
figure.savefig(folder / "turnover.png", dpi=100)
print(f"Wrote turnover.cif, turnover.dcd and turnover.png to {folder}.")
