"""Magnetic tweezers: the extension and torque of DNA that is wound under tension, against theory.

Twenty-two DNA molecules of 200 nm are clamped at one end and pulled at the other. Frames hold the material at both
ends. One frame of each molecule is turned, until it has its own number of turns between -2.5 and 2.5, and held then.
Means over the rest of the run are compared with theory of the discrete chain under tension and torque, for small
angles: turns become twist and writhe, the torque is in proportion to C_eff, and the extension falls with its square. A
pair of forces keeps the last segment along the pull, as a bead does; so the extension is that of the middle.

    python magnetic_tweezers.py [folder] [steps]
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

from openmm_cylchain import DSDNA, Filaments, theory

SEGMENTS, SEGMENT_LENGTH = 40, 5.0  # nm
TURNS = np.linspace(-2.5, 2.5, 11)
COPIES = 2
ENDS = 6  # segments at each end that are not in the middle
PICONEWTON = 0.602214076  # kJ/(mol nm)
PULL, ALIGNING = 4.0, 20.0  # pN
# Far beyond the recommended step of 0.4 ns, of which warnings would come: chains that are pulled straight keep their
# equilibrium, as the comparison shows.
STEP = 20 * unit.nanosecond
STEPS = 60000
WINDING = 2000  # steps before these
FRAMES = 100
VISCOSITY = 1e-3 * unit.pascal * unit.second
TEMPERATURE = 298 * unit.kelvin

folder = Path(sys.argv[1] if len(sys.argv) > 1 else "output_magnetic_tweezers")
steps = int(sys.argv[2]) if len(sys.argv) > 2 else STEPS
folder.mkdir(parents=True, exist_ok=True)

kind = replace(
    DSDNA.with_segment_length(SEGMENT_LENGTH), twist_persistence_length=100 * unit.nanometer, temperature=TEMPERATURE
)
turns = np.repeat(TURNS, COPIES)
filaments = Filaments(VISCOSITY, TEMPERATURE)
for number in range(len(turns)):
    filaments.add_straight(kind, SEGMENTS, [60.0 * number, 0, 0], [0, 0, 1], clamped=[0, 1])
    for end in ("minus", "plus"):
        filaments.add_end_frame(number, end, [0, 0, 1])
topology, system, positions = filaments.build()
pull = openmm.CustomExternalForce("-pull*z")
pull.addPerParticleParameter("pull")
for nodes in filaments.node_indices:
    pull.addParticle(int(nodes[-1]), [(PULL + ALIGNING) * PICONEWTON])
    pull.addParticle(int(nodes[-2]), [-ALIGNING * PICONEWTON])
system.addForce(pull)
integrator = filaments.create_integrator(system, STEP, random_seed=1, checks=False)
simulation = app.Simulation(topology, system, integrator, openmm.Platform.getPlatformByName("CPU"))
simulation.context.setPositions(positions)
with open(folder / "tweezers.cif", "w") as file:
    app.PDBxFile.writeFile(topology, positions, file, keepIds=True)
here = filaments.in_context(simulation.context)
for _ in range(WINDING):
    for number, whole in enumerate(turns):
        here.turn_end(number, "plus", 2 * np.pi * whole / WINDING)
    simulation.step(1)
simulation.reporters.append(app.DCDReporter(str(folder / "tweezers.dcd"), max(1, steps // FRAMES)))

interval = max(1, steps // 3000)
middles = np.array([nodes[ENDS : SEGMENTS + 1 - ENDS] for nodes in filaments.node_indices])
extensions, torques, shape = [], [], None
for _ in range(steps // interval):
    simulation.step(interval)
    shape = simulation.context.getState(positions=True).getPositions(asNumpy=True).value_in_unit(unit.nanometer)
    along = np.diff(shape[middles], axis=1)
    extensions.append(along[:, :, 2].sum(axis=1) / np.linalg.norm(along, axis=2).sum(axis=1))
    twists = [here.twists(number).value_in_unit(unit.radian)[1:-1] for number in range(len(turns))]
    torques.append(kind.twist_stiffness * np.mean(twists, axis=1) / PICONEWTON)
simulation.step(steps % interval)


def means(values):
    """Of late values of each molecule, over copies, and their standard errors from eight blocks of time."""
    late = np.array(values)[len(values) // 8 :]
    blocks = np.array([block.mean(axis=0) for block in np.array_split(late, min(8, len(late)))])
    blocks = blocks.reshape(len(blocks), len(TURNS), COPIES).mean(axis=2)
    return blocks.mean(axis=0), blocks.std(axis=0, ddof=1) / np.sqrt(len(blocks))


length = SEGMENTS * SEGMENT_LENGTH
(extension, extension_error), (torque, torque_error) = means(extensions), means(torques)
grid = np.linspace(-30, 30, 121)
exact = [theory.twisted_chain(kind, PULL * PICONEWTON, own * PICONEWTON, TEMPERATURE) for own in grid]
fall = np.array([own.relative_extension for own in exact])
fall /= fall[len(grid) // 2]
exact_turns = np.array([SEGMENTS * own.turns_per_segment for own in exact])
unwound = np.mean(extension / np.interp(TURNS, exact_turns, fall))
extension, extension_error = extension / unwound, extension_error / unwound
rigidity = exact[0].effective_torsional_rigidity / PICONEWTON
slope = np.polyfit(TURNS, torque, 1)[0] * length / (2 * np.pi)
print(f"{steps} steps of {STEP}, {len(turns)} molecules of {length:.0f} nm under {PULL:g} pN")
print("turns   extension, relative  torque (pN nm)")
for row in range(0, len(TURNS), 2):
    print(
        f"{TURNS[row]:5.1f} {extension[row]:8.4f} +- {extension_error[row]:.4f} {torque[row]:10.2f} +- "
        f"{torque_error[row]:.2f}"
    )
bare = kind.torsional_rigidity / PICONEWTON
print(f"torque per turn times L/2 pi: {slope:.0f} pN nm^2; C_eff {rigidity:.0f}, C {bare:.0f}")

figure = plt.figure(figsize=(11.5, 5), layout="constrained")
left, right = figure.subplots(1, 2, width_ratios=(1, 1.15))
colours = plt.cm.coolwarm(np.linspace(0.0, 1.0, len(TURNS)))
for number in range(len(TURNS)):
    nodes = filaments.node_indices[COPIES * number]
    left.plot(shape[nodes, 0] - 30.0 * number, shape[nodes, 2], color=colours[number], linewidth=2)
    left.plot(shape[nodes[-1], 0] - 30.0 * number, shape[nodes[-1], 2], "o", color="0.35", markersize=8)
left.axhline(0, color="0.3", linewidth=3)
left.set(xticks=[], ylabel="z (nm)", ylim=(-5, 1.08 * length))
left.set_xlabel(f"{TURNS[0]:g} turns … {TURNS[-1]:g} turns")
left.set_title("One molecule of each", fontsize=11)
right.plot(exact_turns, fall, color="0.2", linewidth=1.2, label="theory")
right.errorbar(TURNS, extension, extension_error, fmt="o", color="#2a6f97", label="simulated")
right.set(xlabel="turns", ylabel="extension, over that without turns", xlim=(-3, 3), ylim=(0.96, 1.015))
right.set_title(f"{PULL:g} pN, molecules of {length:.0f} nm", fontsize=11)
torque_axes = right.twinx()
torque_axes.plot(exact_turns, grid, color="#c0392b", linewidth=1.2)
torque_axes.errorbar(TURNS, torque, torque_error, fmt="s", color="#c0392b")
torque_axes.set_ylabel("torque (pN nm)", color="#c0392b")
torque_axes.set_ylim(-45, 45)
right.legend(frameon=False, loc="lower center")
for axes in (left, right, torque_axes):
    axes.spines["top"].set_visible(False)
left.spines[["right", "bottom"]].set_visible(False)
figure.savefig(folder / "tweezers.png", dpi=110)
print(f"Wrote tweezers.cif, tweezers.dcd and tweezers.png to {folder}.")
