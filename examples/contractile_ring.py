"""A contractile ring: motors and crosslinkers between actin filaments that are bound to a membrane all around a cell.

Filaments of both polarities lie along the circumference of a cylinder, and all of their nodes are held on its surface,
as by anchors in the membrane. Motors walk towards plus ends with both of their heads. The ring is under a tension T
then: it pulls the membrane inwards with T/R for each length, 2 pi T in all, which is what the surface feels. Motors
that do not walk make none. Filaments may pass through each other here.

    python contractile_ring.py [folder] [steps]
"""

import sys
from pathlib import Path

import matplotlib

matplotlib.use("Agg")

import matplotlib.pyplot as plt
import numpy as np
import openmm
from openmm import app, unit

from openmm_cylchain import F_ACTIN, Crosslinker, Cylinder, Filaments, Hand, filament_wall_force, wall_forces
from openmm_cylchain.rendering import colors_of_filaments, spring_colors

FILAMENTS, SEGMENTS, SEGMENT_LENGTH = 80, 10, 100.0  # nm
RADIUS, WIDTH = 1000.0, 100.0  # nm, of the cell and of the ring
MOTORS, CROSSLINKERS = 400, 400
STEP = 0.1 * unit.millisecond
STEPS = 10000
FRAMES = 100
VISCOSITY = 1 * unit.pascal * unit.second
TEMPERATURE = 298.15 * unit.kelvin

folder = Path(sys.argv[1] if len(sys.argv) > 1 else "output_contractile_ring")
steps = int(sys.argv[2]) if len(sys.argv) > 2 else STEPS
folder.mkdir(parents=True, exist_ok=True)
interval = max(1, steps // FRAMES)
piconewton = unit.piconewton


def ring(speed):
    """A ring in a Simulation, whose motors have a speed."""
    generator = np.random.default_rng(3)
    filaments = Filaments(VISCOSITY, TEMPERATURE)
    actin = F_ACTIN.with_segment_length(SEGMENT_LENGTH)
    for number in range(FILAMENTS):
        sign = 1 - 2 * (number % 2)
        angles = generator.uniform(0, 2 * np.pi) + sign * np.arange(SEGMENTS + 1) * SEGMENT_LENGTH / RADIUS
        height = np.full(SEGMENTS + 1, generator.uniform(-0.5, 0.5) * WIDTH)
        filaments.add_nodes(actin, np.column_stack([RADIUS * np.cos(angles), RADIUS * np.sin(angles), height]))
    for kind, count in linkers(speed):
        filaments.add_linkers(kind, count, volume=2 * np.pi * RADIUS * WIDTH * 100.0)
    topology, system, positions = filaments.build()
    membrane = Cylinder([0, 0, 0], [0, 0, 1], RADIUS)
    system.addForce(filament_wall_force(filaments, system, membrane, 0.2 * piconewton / unit.nanometer, side="surface"))
    integrator = filaments.create_integrator(system, STEP, random_seed=1, checks=False)
    simulation = app.Simulation(topology, system, integrator, openmm.Platform.getPlatform("CPU"))
    simulation.context.setPositions(positions)
    return filaments, simulation, positions


def linkers(speed):
    """Motors and crosslinkers, with springs of 50 nm."""
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


def tensions(simulation):
    """Of the ring between frames, in pN, from the load of the membrane on it, which is signed inwards."""
    found = []
    wall_forces(simulation.context)
    for _ in range(steps // interval):
        simulation.step(interval)
        (own,) = wall_forces(simulation.context)
        load = np.sum(own.loads) / unit.AVOGADRO_CONSTANT_NA
        found.append(-load.value_in_unit(piconewton) / (2 * np.pi))
    return np.array(found)


filaments, simulation, positions = ring(0.5)
with open(folder / "ring.cif", "w") as file:
    app.PDBxFile.writeFile(simulation.topology, positions, file, keepIds=True)
simulation.reporters.append(app.DCDReporter(str(folder / "ring.dcd"), interval, enforcePeriodicBox=False))
pulled = tensions(simulation)
here = filaments.in_context(simulation.context)
end = simulation.context.getState(positions=True).getPositions(asNumpy=True).value_in_unit(unit.micrometer)
control = tensions(ring(0.0)[1])
times = np.arange(1, len(pulled) + 1) * interval * STEP.value_in_unit(unit.second)
late = times > 0.5 * times[-1]
print(f"{steps} steps of {STEP}: {times[-1]:.3g} s; {here.linkers().counts()[2]} linkers join filaments")
for name, own in (("walk", pulled), ("stand", control)):
    error = own[late].std(ddof=1) / np.sqrt(late.sum())
    print(f"tension of a ring whose motors {name}: {own[late].mean():.1f} +- {error:.1f} pN in the second half")

figure, (plane, panel) = plt.subplots(1, 2, figsize=(11, 6), width_ratios=(1, 1), layout="constrained")
colours, (of_motors, of_crosslinkers) = colors_of_filaments(2), spring_colors([True, False])
plane.add_patch(plt.Circle((0, 0), RADIUS / 1000, color="0.95"))
for number, own in enumerate(filaments.node_indices):
    # Farther out the higher they lie in the ring, so that one sees them all.
    shape = end[own, :2] * (1 + 2 * (end[own, 2].mean() + WIDTH / 2000))
    plane.plot(*shape.T, color=colours[number % 2], linewidth=1.2, alpha=0.9)
for colour, label in zip(colours, ("plus end counterclockwise", "plus end clockwise")):
    plane.plot([], [], color=colour, linewidth=1.6, label=label)
plane.set(aspect="equal", xlabel="x (µm)", ylabel="y (µm)", title="The ring from above, spread by height")
plane.legend(frameon=False, loc="center")
panel.axhline(0, color="0.8", linewidth=1)
panel.plot(times, pulled, color=of_motors, linewidth=2, label="motors walk")
panel.plot(times, control, "--", color="0.5", linewidth=2, label="motors stand")
panel.set(xlabel="time (s)", ylabel="tension (pN)", xlim=(0, times[-1]), title="Its pull on the membrane")
panel.legend(frameon=False)
for axes in (plane, panel):
    axes.spines[["top", "right"]].set_visible(False)
figure.savefig(folder / "ring.png", dpi=110)
print(f"Wrote ring.cif, ring.dcd and ring.png to {folder}.")
