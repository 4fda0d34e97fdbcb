"""The force-velocity curve of branched networks of actin that push an obstacle.

Filaments stand on a base. New ones branch off them and off each other near the obstacle, as Arp2/3 complex makes them;
they grow until a capping protein stops them, and crosslinkers hold all together. So the ends that push are always
others. The obstacle is a plate that a constant force presses on them. It moves as in a viscous solvent, by what the
force of the ends on it, over a few steps, exceeds the load. Filaments bend, and those that it has left behind carry
nothing. Filaments pass through each other here. So few ends push that the speed of a network is chance, too: several
are pushed at each load, and errors are those of their mean. For comparison, the speed of ends that share the load
evenly, as many as grow, each of them a Brownian ratchet at the angle of the mothers.

    python branched_network.py [folder] [steps]
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
    ACTIN_ATP,
    ALPHA_ACTININ,
    F_ACTIN,
    Box,
    Branching,
    Cylinder,
    EndStates,
    Filaments,
    Growth,
    Plane,
    filament_wall_force,
    wall_forces,
)

LOADS = (1.0, 3.0, 8.0, 16.0)  # pN
NETWORKS = 4  # at each load
MOTHERS, PLACES, CROSSLINKERS = 20, 120, 100
MONOMERS = 20  # of a segment
ANGLE = np.deg2rad(35)  # of mothers: half of that between them and branches
HEIGHT, RADIUS = 90.0, 150.0  # nm, of the obstacle at first, and of a tube around the network
CONCENTRATION = unit.Quantity(10e-6, unit.molar)
BRANCHING = 30.0  # per um and second
NEAR = 60.0  # nm below the obstacle at first: above that, filaments have branches
CAPPING = 4.0  # per second
FRICTION = 0.005  # pN s/nm, of the obstacle
OBSTACLE_STIFFNESS = 0.5  # pN/nm
STEP = 0.05 * unit.millisecond
EVERY = 5  # steps in which the obstacle stands still
STEPS = 12000
FRAMES = 100
VISCOSITY = 0.1 * unit.pascal * unit.second
TEMPERATURE = 298.15 * unit.kelvin
COLOURS = ("#0072B2", "#009E73", "#E69F00", "#D55E00")
GROWING, CAPPED, MOTHER = "#D55E00", "#7FA7C9", "#333333"
PER_LENGTH = unit.piconewton / unit.nanometer
PICONEWTON = 0.602214076  # kJ/(mol nm)
THERMAL_ENERGY = (unit.MOLAR_GAS_CONSTANT_R * TEMPERATURE).value_in_unit(unit.kilojoule_per_mole)

folder = Path(sys.argv[1] if len(sys.argv) > 1 else "output_branched_network")
steps = int(sys.argv[2]) if len(sys.argv) > 2 else STEPS
folder.mkdir(parents=True, exist_ok=True)
interval = max(1, steps // FRAMES)

actin = F_ACTIN.with_segment_length(MONOMERS * ACTIN_ATP.length)
# A growing end, and a capped one that stays as it is.
capping = EndStates(
    on_rates=(ACTIN_ATP.plus_on_rate, 0.0),
    off_rates=(ACTIN_ATP.plus_off_rate, 0.0),
    switch_rates=((0.0, CAPPING / unit.second), (0.0, 0.0)),
    names=("growing", "capped"),
)
growth = Growth(monomers=ACTIN_ATP, pool=CONCENTRATION, longest=350.0, minus_capped=True, plus_instability=capping)


def network(seed):
    """Mothers below an obstacle, and places for branches, in a Simulation; and the Force of the obstacle."""
    generator = np.random.default_rng(seed)
    filaments = Filaments(VISCOSITY, TEMPERATURE)
    for _ in range(MOTHERS):
        around, angle = generator.uniform(0, 2 * np.pi, 2)
        radius = 0.6 * RADIUS * np.sqrt(generator.uniform())
        tip = [radius * np.cos(angle), radius * np.sin(angle), HEIGHT - generator.uniform(2, 20)]
        direction = np.array([np.sin(ANGLE) * np.cos(around), np.sin(ANGLE) * np.sin(around), np.cos(ANGLE)])
        start = tip - 2 * actin.segment_length * direction
        filaments.add_straight(actin, 2, start, direction, growth=growth, clamped=[0])
    region = Box([-2 * RADIUS, -2 * RADIUS, HEIGHT - NEAR], [2 * RADIUS, 2 * RADIUS, HEIGHT + 500.0])
    branching = Branching(rate=BRANCHING / unit.micrometer / unit.second, region=region)
    filaments.add_reserve(actin, PLACES, growth=growth, nucleation=branching)
    filaments.add_linkers(ALPHA_ACTININ, CROSSLINKERS, volume=np.pi * RADIUS**2 * HEIGHT)
    topology, system, positions = filaments.build()
    for nodes in filaments.node_indices[:MOTHERS]:
        # The second node, too: mothers keep their direction at the base.
        system.setParticleMass(int(nodes[1]), 0.0)
    plate = Plane([0, 0, HEIGHT], [0, 0, -1])
    obstacle = filament_wall_force(filaments, system, plate, OBSTACLE_STIFFNESS * PER_LENGTH)
    system.addForce(obstacle)
    tube = Cylinder([0, 0, 0], [0, 0, 1], RADIUS)
    system.addForce(filament_wall_force(filaments, system, tube, 0.05 * PER_LENGTH))
    integrator = filaments.create_integrator(system, STEP, random_seed=seed, checks=False)
    simulation = app.Simulation(topology, system, integrator, openmm.Platform.getPlatformByName("CPU"))
    simulation.context.setPositions(positions)
    return filaments, simulation, obstacle


def push(load, seed):
    """The network after all steps, and a course: the time in s, the height of the obstacle, and how many ends grow."""
    filaments, simulation, obstacle = network(seed)
    if seed == 1:
        with open(folder / "branched.cif", "w") as file:
            positions = simulation.context.getState(positions=True).getPositions()
            app.PDBxFile.writeFile(simulation.topology, positions, file, keepIds=True)
        simulation.reporters.append(app.DCDReporter(str(folder / "branched.dcd"), interval))
    here, height, course = filaments.in_context(simulation.context), HEIGHT, []
    seconds = EVERY * STEP.value_in_unit(unit.second)
    for passed in range(steps // EVERY):
        simulation.step(EVERY)
        force = -wall_forces(simulation.context)[0].sums[0, 2]._value / PICONEWTON
        height += (force - load) / FRICTION * seconds
        obstacle.setRegion("plane", openmm.Vec3(0, 0, height), openmm.Vec3(0, 0, -1), 0)
        obstacle.updateParametersInContext(simulation.context)
        if passed % max(1, interval // EVERY) == 0:
            grown = here.growth()
            course.append(((passed + 1) * seconds, height, np.count_nonzero(grows(grown))))
    return filaments, simulation, here.growth(), np.array(course)


def grows(grown):
    """Which filaments are there with a plus end that is not capped."""
    return (grown.nodes > 0) & (grown.end_states[:, 1] == 0)


def speed(course):
    """Of the obstacle, in nm/s, in the second half."""
    return np.polyfit(*course[len(course) // 2 :, :2].T, 1)[0]


def shared(load, ends):
    """The speed in nm/s of an obstacle that so many ends push, which share the load in pN."""
    work = load / ends * PICONEWTON * ACTIN_ATP.length * np.cos(ANGLE) / THERMAL_ENERGY
    gain = ACTIN_ATP.plus_on_rate * growth.pool.concentration * np.exp(-work) - ACTIN_ATP.plus_off_rate
    return 1e12 * gain * ACTIN_ATP.length * np.cos(ANGLE)


runs = {load: [push(load, NETWORKS * number + own + 1) for own in range(NETWORKS)] for number, load in enumerate(LOADS)}
free = 1e12 * (ACTIN_ATP.plus_on_rate * growth.pool.concentration - ACTIN_ATP.plus_off_rate) * ACTIN_ATP.length
print(f"{steps} steps of {STEP} of {NETWORKS} networks at each load. A free end grows by {free:.0f} nm/s")
speeds, evenly = {}, {}
for load, networks in runs.items():
    own = [speed(course) for *_, course in networks]
    speeds[load] = np.mean(own), np.std(own, ddof=1) / np.sqrt(NETWORKS)
    ends = np.mean([course[len(course) // 2 :, 2].mean() for *_, course in networks])
    evenly[load] = shared(load, ends)
    branches = np.mean([grown.nucleated for _, _, grown, _ in networks])
    print(
        f"{load:g} pN: the obstacle moves by {speeds[load][0]:.0f} +- {speeds[load][1]:.0f} nm/s, and would by "
        f"{evenly[load]:.0f} if all ends shared the load; {branches:.0f} branches have begun, {ends:.0f} ends grow"
    )

figure, panels = plt.subplots(2, 2, figsize=(12, 9.5), layout="constrained")
for panel, load in zip(panels[0], (LOADS[0], LOADS[-1])):
    filaments, simulation, grown, course = runs[load][0]
    state = simulation.context.getState(positions=True)
    x = state.getPositions(asNumpy=True).value_in_unit(unit.nanometer)
    growing = grows(grown)
    for number in np.flatnonzero(grown.nodes):
        nodes = x[filaments.node_indices[number]][: grown.nodes[number]]
        colour = GROWING if growing[number] else MOTHER if number < MOTHERS else CAPPED
        panel.plot(nodes[:, 0], nodes[:, 2], color=colour, linewidth=1.6, alpha=0.9)
        panel.plot(*nodes[-1, [0, 2]], "o", color=colour, markersize=3)
    panel.axhspan(course[-1, 1], course[-1, 1] + 25, color="#999999")
    panel.axhline(course[-1, 1], color="#555555", linewidth=1)
    for label, colour in (("growing", GROWING), ("capped", CAPPED), ("capped, from the start", MOTHER)):
        panel.plot([], [], "-o", color=colour, markersize=3, label=label)
    panel.set(xlim=(-1.2 * RADIUS, 1.2 * RADIUS), ylim=(-20, max(own[0][-1][-1, 1] for own in runs.values()) + 25))
    panel.set(aspect="equal", xlabel="x (nm)", ylabel="z (nm)")
    panel.set_title(f"{load:g} pN, after {course[-1, 0]:.2g} s", loc="left")
panels[0, 0].legend(frameon=False, loc="lower left", fontsize=9)
heights, curve = panels[1]
for (load, networks), colour in zip(runs.items(), COLOURS):
    for number, (*_, course) in enumerate(networks):
        heights.plot(*course[:, :2].T, color=colour, linewidth=1.4, label=f"{load:g} pN" if number == 0 else None)
    curve.errorbar(load, speeds[load][0], speeds[load][1], fmt="o", color=colour, markersize=7, capsize=3)
heights.set(xlabel="time (s)", ylabel="obstacle (nm)")
heights.legend(frameon=False)
curve.plot(LOADS, list(evenly.values()), "--", color="#555555", label="if all growing ends shared the load")
curve.axhline(0, color="#999999", linewidth=0.8)
curve.legend(frameon=False)
curve.set(xlabel="load (pN)", ylabel="speed in the second half (nm/s)", xlim=(0, None))
for panel in panels.flat:
    panel.spines[["top", "right"]].set_visible(False)
figure.savefig(folder / "branched.png", dpi=100)
print(f"Wrote branched.cif, branched.dcd and branched.png to {folder}.")
