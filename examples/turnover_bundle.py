"""A bundle with turnover: motors contract it for good if its filaments come and go, else until it is a cluster.

Actin filaments of both polarities lie in a tube with closed ends. Motors walk towards plus ends, stay there, and so
pull plus ends together; crosslinkers hold filaments, bind and unbind. Filaments that keep their monomers contract into
a cluster, and then nothing moves any more. With turnover, new filaments begin anywhere in the tube, grow until they are
capped, are cut, and lose monomers at their minus ends until they vanish; all share a pool of monomers. Then the bundle
stays as long as the tube, and what it is made of flows together, and goes on to do so. Rates are faster than those of
actin in cells, for a short example. Filaments pass through each other here.

    python turnover_bundle.py [folder] [steps]
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
    Box,
    Crosslinker,
    Cylinder,
    EndStates,
    Filaments,
    Growth,
    Hand,
    MonomerPool,
    Monomers,
    Nucleation,
    Severing,
    Slab,
    filament_wall_force,
)

FILAMENTS, SEGMENTS, PLACES = 48, 7, 96
MONOMER, MONOMERS = 2.7, 40  # nm, and how many a segment has
LENGTH, RADIUS = 4000.0, 90.0  # nm, of the tube
PLUS, MINUS = 400.0, 100.0  # nm/s, by which plus ends grow at first, and minus ends shrink
CAPPING, SEVERING, NUCLEATION = 0.4, 0.02, 6.0  # per second; per um and second; per second
MOTORS, CROSSLINKERS = 200, 150
STEP = 1 * unit.millisecond
STEPS = 30000
FRAMES = 100
VISCOSITY = 0.1 * unit.pascal * unit.second
TEMPERATURE = 298.15 * unit.kelvin
RUNS = {"come and go": "#009E73", "keep their monomers": "#555555"}

folder = Path(sys.argv[1] if len(sys.argv) > 1 else "output_turnover_bundle")
steps = int(sys.argv[2]) if len(sys.argv) > 2 else STEPS
folder.mkdir(parents=True, exist_ok=True)
interval = max(1, steps // FRAMES)

actin = F_ACTIN.with_segment_length(MONOMERS * MONOMER)
molar, piconewton, second = unit.mole / unit.liter, unit.piconewton, unit.second
concentration = 2e-6 * molar
monomers = Monomers(
    length=MONOMER, plus_on_rate=PLUS / MONOMER / second / concentration, minus_off_rate=MINUS / MONOMER / second
)
# A growing end, and a capped one that stays as it is.
capping = EndStates(
    on_rates=(monomers.plus_on_rate, 0.0),
    off_rates=(0.0, 0.0),
    switch_rates=((0.0, CAPPING / second), (0.0, 0.0)),
    names=("growing", "capped"),
)
turnover = Growth(
    monomers=monomers,
    pool=MonomerPool(concentration, 15 * unit.micrometer**3),
    longest=2 * unit.micrometer,
    plus_instability=capping,
    vanishes=True,
    severing=Severing(rate=SEVERING / unit.micrometer / second),
)


def linkers():
    """Motors that stay at plus ends, and crosslinkers."""
    hand = {"binding_rate": 10 / second, "reach": 60 * unit.nanometer}
    speed = 0.2 * unit.micrometer / second
    head = Hand(**hand, unbinding_rate=0.3 / second, speed=speed, stall_force=4 * piconewton, at_end="hold")
    stiffness = 0.05 * piconewton / unit.nanometer
    yield Crosslinker(hands=head, stiffness=stiffness, rest_length=40 * unit.nanometer, name="motor"), MOTORS
    held = Hand(**hand, unbinding_rate=0.5 / second)
    yield Crosslinker(hands=held, stiffness=stiffness, rest_length=40 * unit.nanometer), CROSSLINKERS


def bundle(growth):
    """A bundle in a Simulation."""
    generator = np.random.default_rng(3)
    filaments = Filaments(VISCOSITY, TEMPERATURE)
    half = 0.5 * SEGMENTS * actin.segment_length
    for sign in np.resize([1, -1], FILAMENTS):
        x, angle = generator.uniform(half - 0.5 * LENGTH, 0.5 * LENGTH - half), generator.uniform(0, 2 * np.pi)
        radius = 0.9 * RADIUS * np.sqrt(generator.uniform())
        start = [x - sign * half, radius * np.cos(angle), radius * np.sin(angle)]
        filaments.add_straight(actin, SEGMENTS, start, [sign, 0, 0], growth=growth)
    if growth is not None:
        corner = np.array([0.5 * LENGTH, 0.6 * RADIUS, 0.6 * RADIUS])
        for sign in (1, -1):
            begins = Nucleation(rate=0.5 * NUCLEATION / second, region=Box(-corner, corner), direction=[sign, 0, 0])
            filaments.add_reserve(actin, PLACES // 2, growth=growth, nucleation=begins)
    for kind, count in linkers():
        filaments.add_linkers(kind, count, volume=np.pi * RADIUS**2 * LENGTH, bound=count)
    topology, system, positions = filaments.build()
    for wall in (Cylinder([0, 0, 0], [1, 0, 0], RADIUS), Slab([0, 0, 0], [1, 0, 0], LENGTH)):
        system.addForce(filament_wall_force(filaments, system, wall, 0.1 * piconewton / unit.nanometer))
    integrator = filaments.create_integrator(system, STEP, random_seed=1, checks=False)
    simulation = app.Simulation(topology, system, integrator, openmm.Platform.getPlatformByName("CPU"))
    simulation.context.setPositions(positions)
    return filaments, simulation


def speckles(filaments, simulation):
    """Where monomers at joints are, x in um by the identity of their filament and their number in segments."""
    x = simulation.context.getState(positions=True).getPositions(asNumpy=True).value_in_unit(unit.micrometer)[:, 0]
    if filaments[0].growth is None:
        ends = [(0, SEGMENTS * MONOMERS)] * FILAMENTS
        identities = range(FILAMENTS)
    else:
        grown = filaments.in_context(simulation.context).growth()
        ends, identities = grown.monomers.tolist(), grown.identities.tolist()
    found = {}
    for nodes, identity, (first, last) in zip(filaments.node_indices, identities, ends):
        # Joints are at multiples of the monomers of a segment, half a segment or more from the ends.
        begin, end = -(-(first + MONOMERS // 2) // MONOMERS), (last - MONOMERS // 2) // MONOMERS
        found |= {(identity, number): x[nodes[1 + number - begin]] for number in range(begin, end + 1)}
    return found


def contraction(course):
    """At which rate monomers flow together in each interval, in 1/s: minus the slope of their speeds along x."""
    rates = []
    for before, after in zip(course, course[1:]):
        both = sorted(before.keys() & after.keys())
        x, moved = (np.array(own) for own in zip(*((before[one], after[one] - before[one]) for one in both)))
        rates.append(-np.polyfit(x, moved, 1)[0] / seconds)
    return np.array(rates)


def length(shown):
    """The length over which joints lie if they lie evenly: 12^(1/2) standard deviations, in um."""
    return np.sqrt(12) * np.std(list(shown.values()))


def mean_and_error(values):
    """Of a series, from the means of five pieces of it."""
    pieces = [np.mean(piece) for piece in np.array_split(values, 5)]
    return f"{100 * np.mean(values):.1f} +- {100 * np.std(pieces, ddof=1) / np.sqrt(5):.1f} %/s"


seconds = interval * STEP.value_in_unit(second)
courses, shapes = {}, {}
for name in RUNS:
    growth = turnover if name == "come and go" else None
    filaments, simulation = bundle(growth)
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
    counts = grown.nodes if growth else np.full(FILAMENTS, SEGMENTS + 1)
    shapes[name] = [x[nodes[:count], :2] for nodes, count in zip(filaments.node_indices, counts) if count]

time = seconds * np.arange(steps // interval + 1)
rates = {name: contraction(course) for name, course in courses.items()}
lengths = {name: np.array([length(shown) for shown in course]) for name, course in courses.items()}
print(f"{steps} steps of {STEP}; {time[-1]:.3g} s. Monomers flow together:")
for name in RUNS:
    fifth = max(1, len(rates[name]) // 5)
    print(
        f"filaments that {name}: {mean_and_error(rates[name][:fifth])} in the first fifth, "
        f"{mean_and_error(rates[name][-2 * fifth :])} in the last two; the bundle is {lengths[name][0]:.2f} um long at "
        f"first, {lengths[name][-1]:.2f} um at last"
    )
there = grown.nodes > 0
print(
    f"{grown.nucleated} filaments have begun, {grown.severed} were cut, {grown.vanished} have vanished; at last "
    f"{there.sum()} are {grown.lengths[there].mean()._value:.0f} nm long; {grown.without_place} found no place"
)

figure = plt.figure(figsize=(12, 8), layout="constrained")
grid = figure.add_gridspec(3, 2, height_ratios=(0.8, 0.8, 2.2))
widest, of_signs = 0.54 * LENGTH / 1000, {1: "#0072B2", -1: "#D55E00"}
for row, name in enumerate(RUNS):
    axes = figure.add_subplot(grid[row, :])
    for points in shapes[name]:
        sign = 1 if points[-1, 0] > points[0, 0] else -1
        axes.plot(*points.T, color=of_signs[sign], linewidth=1.1, alpha=0.8)
    axes.set(xlim=(-widest, widest), ylim=(-0.14, 0.14), ylabel="y (µm)")
    axes.set_title(f"Filaments that {name}: after {time[-1]:.3g} s", loc="left")
for sign, label in ((1, "plus end on the right"), (-1, "plus end on the left")):
    figure.axes[0].plot([], [], color=of_signs[sign], label=label)
figure.axes[0].legend(frameon=False, ncols=2, loc="lower right", bbox_to_anchor=(1.0, 1.0))
figure.axes[1].set_xlabel("x (µm)")
panels = [figure.add_subplot(grid[2, column]) for column in range(2)]
window = max(1, len(time) // 12)
for name, colour in RUNS.items():
    smooth = 100 * np.convolve(rates[name], np.full(window, 1 / window), "valid")
    panels[0].plot(time[: len(smooth)] + 0.5 * window * time[1], smooth, color=colour, linewidth=2, label=name)
    panels[1].plot(time, lengths[name], color=colour, linewidth=2, label=name)
panels[0].axhline(0, color="0.8", linewidth=1, zorder=0)
panels[0].set(xlabel="time (s)", xlim=(0, time[-1]), ylabel="contraction (%/s)")
panels[1].set(xlabel="time (s)", xlim=(0, time[-1]), ylabel="length of the bundle (µm)", ylim=(0, None))
panels[0].legend(frameon=False)
for axes in figure.axes:
    axes.spines[["top", "right"]].set_visible(False)
figure.savefig(folder / "turnover.png", dpi=100)
print(f"Wrote turnover.cif, turnover.dcd and turnover.png to {folder}.")
