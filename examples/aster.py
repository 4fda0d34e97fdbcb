"""An aster: motors that hold at the ends of filaments gather these.

Microtubules at random in a disc are crosslinked by motors with two heads. Both heads walk to the plus end of what they
hold and stay there, so that the plus ends which a motor joins come together; in the end they all are in a few places,
with the filaments around them like the rays of a star. Motors whose heads let go at ends, for comparison, gather them
hardly.

    python aster.py [folder] [steps]
"""

import sys
from pathlib import Path

import matplotlib

matplotlib.use("Agg")

import matplotlib.pyplot as plt
import numpy as np
import openmm
from openmm import app, unit
from scipy.spatial import cKDTree

from openmm_cylchain import MICROTUBULE, Crosslinker, Cylinder, Filaments, Hand, filament_wall_force

FILAMENTS = 60
SEGMENTS, SEGMENT_LENGTH = 4, 500.0  # nm
RADIUS = 3000.0  # nm, of the disc
MOTORS = 1000
STEP = 4 * unit.millisecond
STEPS = 1500
FRAMES = 75
NEAR = 0.3  # um
VISCOSITY = 0.05 * unit.pascal * unit.second
TEMPERATURE = 310 * unit.kelvin

folder = Path(sys.argv[1] if len(sys.argv) > 1 else "output_aster")
steps = int(sys.argv[2]) if len(sys.argv) > 2 else STEPS
folder.mkdir(parents=True, exist_ok=True)
microtubule = MICROTUBULE.with_segment_length(SEGMENT_LENGTH)


def disc(at_end):
    """Filaments and motors in a Simulation; what motors do at ends is given."""
    generator = np.random.default_rng(3)
    filaments = Filaments(VISCOSITY, TEMPERATURE)
    for number in range(FILAMENTS):
        angle, turn = generator.uniform(0, 2 * np.pi, 2)
        middle = 0.7 * RADIUS * np.sqrt(generator.uniform()) * np.array([np.cos(angle), np.sin(angle), 0])
        direction = np.array([np.cos(turn), np.sin(turn), 0])
        start = middle - 0.5 * SEGMENTS * SEGMENT_LENGTH * direction
        filaments.add_equilibrium(microtubule, SEGMENTS, number, start, direction, planar=True)
    head = Hand(
        binding_rate=10 / unit.second,
        reach=60 * unit.nanometer,
        unbinding_rate=0.2 / unit.second,
        speed=0.5 * unit.micrometer / unit.second,
        stall_force=5 * unit.piconewton,
        at_end=at_end,
    )
    motor = Crosslinker(hands=head, stiffness=0.02 * unit.piconewton / unit.nanometer, name="motor")
    filaments.add_linkers(motor, MOTORS, volume=np.pi * RADIUS**2 * 500.0)
    topology, system, positions = filaments.build()
    wall = Cylinder([0, 0, 0], [0, 0, 1], RADIUS)
    system.addForce(filament_wall_force(filaments, system, wall, 0.1 * unit.piconewton / unit.nanometer))
    # Bends of microtubules relax within a step. That is not resolved, and need not be: hence no check of the step.
    integrator = filaments.create_integrator(system, STEP, random_seed=1, checks=False)
    simulation = app.Simulation(topology, system, integrator, openmm.Platform.getPlatformByName("CPU"))
    simulation.context.setPositions(positions)
    return filaments, simulation


def current(filaments, simulation):
    """Nodes of all filaments in um: (filaments, nodes, 3)."""
    state = simulation.context.getState(positions=True)
    return state.getPositions(asNumpy=True).value_in_unit(unit.micrometer)[np.array(filaments.node_indices)]


def neighbours(ends):
    """How many other ends are near an end, on average."""
    return 2 * len(cKDTree(ends).query_pairs(NEAR)) / len(ends)


def course(filaments, simulation):
    """Shapes at the end of each interval."""
    shapes = [current(filaments, simulation)]
    for _ in range(steps // interval):
        simulation.step(interval)
        shapes.append(current(filaments, simulation))
    return np.array(shapes)


interval = max(1, steps // FRAMES)
filaments, simulation = disc("hold")
here = filaments.in_context(simulation.context)
with open(folder / "aster.cif", "w") as file:
    positions = simulation.context.getState(positions=True).getPositions()
    app.PDBxFile.writeFile(simulation.topology, positions, file, keepIds=True)
simulation.reporters.append(app.DCDReporter(str(folder / "aster.dcd"), interval))
held = course(filaments, simulation)
divided = simulation.integrator.getNumDividedSteps() / (FILAMENTS * steps)
table, pulls = here.linkers(), here.linker_pulls()
joining = table.held == 2
at_ends = np.sum(table.arc_lengths[joining] >= SEGMENTS * SEGMENT_LENGTH - 1e-3) / max(1, 2 * joining.sum())
released = course(*disc("release"))

seconds = interval * STEP.value_in_unit(unit.second)
time = seconds * np.arange(len(held))
curves = {
    "plus ends, motors that hold at ends": ([neighbours(one[:, -1]) for one in held], "#101010", "-"),
    "minus ends": ([neighbours(one[:, 0]) for one in held], "#0072B2", "-"),
    "plus ends, motors that let go": ([neighbours(one[:, -1]) for one in released], "0.5", "--"),
}
print(f"{steps} steps of {STEP}, {100 * divided:.2g} % of them divided; {time[-1]:.3g} s")
print(f"{joining.sum()} of {MOTORS} motors join two filaments; {100 * at_ends:.0f} % of their heads at ends")
for label, (counts, _, _) in curves.items():
    print(f"others within {NEAR:g} um, {label}: {counts[0]:.1f} at first, {counts[-1]:.1f} at the end")

figure = plt.figure(figsize=(13, 8.2), layout="constrained")
top, bottom = figure.subfigures(2, 1, height_ratios=(1.25, 1))
discs = top.subplots(1, 3)
turn = np.linspace(0, 2 * np.pi, 200)
titles = ("At first", f"After {time[-1]:.3g} s", f"After {time[-1]:.3g} s, motors that let go at ends")
for axes, shape, title in zip(discs, (held[0], held[-1], released[-1]), titles):
    axes.plot(RADIUS / 1000 * np.cos(turn), RADIUS / 1000 * np.sin(turn), color="0.7", linewidth=1)
    for own in shape:
        axes.plot(*own[:, :2].T, color="#0072B2", linewidth=1.3, alpha=0.85)
    axes.plot(*shape[:, -1, :2].T, "o", color="#101010", markersize=4, zorder=3)
    axes.set(aspect="equal", xlabel="x (µm)")
    axes.set_title(title, fontsize=11)
    axes.spines[["top", "right"]].set_visible(False)
discs[0].set_ylabel("y (µm)")
discs[0].plot([], [], color="#0072B2", linewidth=1.5, label="microtubule")
discs[0].plot([], [], "o", color="#101010", markersize=4, label="its plus end")
top.legend(*discs[0].get_legend_handles_labels(), frameon=False, loc="outside lower center", ncols=2)
panel, zoom = bottom.subplots(1, 2, width_ratios=(1.6, 1))
for label, (counts, colour, style) in curves.items():
    panel.plot(time, counts, style, color=colour, linewidth=2, label=label)
panel.set(xlabel="time (s)", ylabel=f"others within {NEAR:g} µm of an end", xlim=(0, time[-1]), ylim=(0, None))
panel.legend(frameon=False, loc="upper left")
panel.spines[["top", "right"]].set_visible(False)
ends = held[-1][:, -1, :2]
densest = ends[np.argmax([np.sum(np.linalg.norm(ends - one, axis=1) < NEAR) for one in ends])]
for own in held[-1]:
    zoom.plot(*own[:, :2].T, color="#0072B2", linewidth=1.6)
    zoom.plot(*own[-1, :2], "o", color="#101010", markersize=5, zorder=3)
zoom.plot(*pulls.places[..., :2].T / 1000, color="#B3261E", linewidth=1.2, zorder=4)
zoom.plot(*pulls.places[..., :2].reshape(-1, 2).T / 1000, ".", color="#B3261E", markersize=3, zorder=4)
zoom.plot([], [], ".-", color="#B3261E", label="motors")
zoom.legend(loc="upper right")
zoom.set(xlim=densest[0] + np.array([-0.2, 0.2]), ylim=densest[1] + np.array([-0.18, 0.18]), aspect="equal")
zoom.set(xlabel="x (µm)", ylabel="y (µm)", title="The middle of the aster")
figure.savefig(folder / "aster.png", dpi=100)
print(f"Wrote aster.cif, aster.dcd and aster.png to {folder}.")
