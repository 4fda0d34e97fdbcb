"""How often the two ends of a short piece of DNA meet: J factors by springs of which each is stiffer than the last.

Ends of DNA of 80 nm meet in one of a million configurations. Springs of rest length zero between them, which grow
stiffer from filament to filament, lead there step by step; distances in all of them together give the free energy of
each spring (MBAR, Shirts and Chodera, J. Chem. Phys. 2008, 129, 124105). The stiffest, of k, lets ends be apart by
3 nm alone, and the density of one end at the other, the J factor, is

    J = (k / 2 pi k_B T)^(3/2) exp(-F_k / k_B T).

However stiff they are, springs do not shorten the step. But J depends on all of the energy that a loop costs, and so
the step is the recommended one: in longer ones loops cost less, and at four times the step J is a tenth too large.

    python cyclisation.py [folder] [steps]
"""

import logging
import sys
from pathlib import Path

import matplotlib

matplotlib.use("Agg")

import matplotlib.pyplot as plt
import numpy as np
import openmm
from openmm import app, unit

from openmm_cylchain import DSDNA, Crosslinks, Filaments, theory

SEGMENT_LENGTHS = 10.0  # nm
SEGMENTS = (8, 10, 12, 16)
STIFFNESSES = (0.0, 3e-4, 1e-3, 3e-3, 0.01, 0.03, 0.1)  # k_BT/nm^2
REPLICAS = 6  # of each length and stiffness
BASE_PAIR = 0.34  # nm
MOLAR = 0.602214076  # per nm^3
STEPS = 200000
EQUILIBRATION = 0.05  # of the steps
EVERY, FRAMES = 100, 100
VISCOSITY = 1e-3 * unit.pascal * unit.second
TEMPERATURE = 310 * unit.kelvin

# It says on import that there is no JAX.
logging.getLogger("pymbar").setLevel(logging.ERROR)
from pymbar import MBAR  # noqa: E402

folder = Path(sys.argv[1] if len(sys.argv) > 1 else "output_cyclisation")
steps = int(sys.argv[2]) if len(sys.argv) > 2 else STEPS
folder.mkdir(parents=True, exist_ok=True)

thermal_energy = (unit.MOLAR_GAS_CONSTANT_R * TEMPERATURE).value_in_unit(unit.kilojoule_per_mole)
dna = DSDNA.with_segment_length(SEGMENT_LENGTHS)
filaments = Filaments(VISCOSITY, TEMPERATURE)
for column, count in enumerate(SEGMENTS):
    for row in range(len(STIFFNESSES) * REPLICAS):
        filaments.add_equilibrium(dna, count, seed=1000 * column + row, start=[200.0 * column, 200.0 * row, 0])
topology, system, positions = filaments.build()
first = [nodes[0] for nodes in filaments.node_indices]
last = [nodes[-1] for nodes in filaments.node_indices]
springs = Crosslinks(STIFFNESSES[-1] * thermal_energy, 0.0)
for one, other, stiffness in zip(first, last, np.tile(np.repeat(STIFFNESSES, REPLICAS), len(SEGMENTS))):
    if stiffness > 0:
        springs.add(None, one, other, stiffness=stiffness * thermal_energy)
springs.add_to(system)
step = filaments.recommended_time_step(system=system).step * unit.picosecond
integrator = filaments.create_integrator(system, step, random_seed=1)
simulation = app.Simulation(topology, system, integrator, openmm.Platform.getPlatformByName("CPU"))
simulation.context.setPositions(positions)
with open(folder / "loops.cif", "w") as file:
    app.PDBxFile.writeFile(topology, positions, file, keepIds=True)
simulation.reporters.append(app.DCDReporter(str(folder / "loops.dcd"), max(1, steps // FRAMES)))

every = min(EVERY, max(1, steps // 20))
distances = []
for taken in range(0, steps, every):
    simulation.step(every)
    now = simulation.context.getState(positions=True).getPositions(asNumpy=True).value_in_unit(unit.nanometer)
    if taken >= EQUILIBRATION * steps:
        distances.append(np.linalg.norm(now[last] - now[first], axis=1))
distances = np.array(distances).T.reshape(len(SEGMENTS), len(STIFFNESSES), REPLICAS, -1)


def j_factor(samples):
    """J in mol/l of distances with each stiffness."""
    energies = 0.5 * np.outer(STIFFNESSES, samples.ravel() ** 2)
    free_energies = MBAR(energies, [samples[0].size] * len(STIFFNESSES)).compute_free_energy_differences()["Delta_f"][0]
    return (STIFFNESSES[-1] / (2 * np.pi)) ** 1.5 * np.exp(-free_energies[-1]) / MOLAR


lengths = np.array(SEGMENTS) * SEGMENT_LENGTHS
fine = np.linspace(72, 170, 99)
persistence_length = dna.persistence_length_at(TEMPERATURE)
curve = theory.wlc_j_factor(fine, persistence_length) / MOLAR
means, errors = [], []
for samples in distances:
    parts = [j_factor(samples[:, replica]) for replica in range(REPLICAS)]
    means.append(j_factor(samples))
    errors.append(np.std(parts, ddof=1) / np.sqrt(REPLICAS))
print(f"{steps} steps of {step.value_in_unit(unit.nanosecond):.3g} ns, {distances[0].size * every} for each length")
for length, mean, error in zip(lengths, means, errors):
    expected = theory.wlc_j_factor(length, persistence_length) / MOLAR
    pairs = length / BASE_PAIR
    print(
        f"{pairs:.0f} base pairs: J = {mean * 1e9:.1f} +- {error * 1e9:.1f} nM; wormlike chain {expected * 1e9:.1f} nM"
    )

figure, (loops, plot) = plt.subplots(1, 2, figsize=(11, 5), width_ratios=(1, 1.4))
now = simulation.context.getState(positions=True).getPositions(asNumpy=True).value_in_unit(unit.nanometer)
colors = plt.cm.viridis(np.linspace(0.0, 0.9, len(STIFFNESSES)))
for row, color in enumerate(colors):
    for column in range(len(SEGMENTS)):
        nodes = now[filaments.node_indices[(column * len(STIFFNESSES) + row) * REPLICAS]]
        nodes = nodes - nodes.mean(axis=0)
        # Seen along the direction in which it is flattest.
        flat = nodes @ np.linalg.svd(nodes)[2][:2].T
        loops.plot(*(flat + [column * 110, -row * 90]).T, color=color, linewidth=3, solid_capstyle="round")
loops.set_aspect("equal")
loops.axis("off")
loops.set_title("springs between ends grow stiffer downwards", fontsize=10)
plot.plot(fine / BASE_PAIR, curve * 1e9, color="0.6", label="wormlike chain (Shimada and Yamakawa)")
plot.errorbar(
    lengths / BASE_PAIR, np.array(means) * 1e9, np.array(errors) * 1e9, fmt="o", color="#c0392b", label="simulated"
)
plot.set(xlabel="base pairs", ylabel="J (nM)", ylim=(0, None))
plot.legend(frameon=False)
plot.spines[["top", "right"]].set_visible(False)
figure.suptitle("How often both ends of DNA meet")
figure.tight_layout()
figure.savefig(folder / "loops.png", dpi=120)
print(f"Wrote loops.cif, loops.dcd and loops.png to {folder}.")
