"""How easily the ends of short DNA meet: the J factor from springs between them, against Shimada and Yamakawa.

Molecules of one to four persistence lengths have a spring between their ends, each another one, from none to such that
the ends nearly touch. From all distances r of ends, the shares Z of free molecules that each spring would leave are
found together (Shirts and Chodera, J. Chem. Phys. 2008, 129, 124105), and with the stiffest ones the density of ends at
r = 0,

    J = Z (k/2 pi k_B T)^(3/2),

the concentration at which other ends would be met as often. Nothing else is asked of the ends: neither their directions
nor their twist. For that, J is 112.04 (lp/L)^5 exp(-14.055 lp/L + 0.246 L/lp)/lp^3, which is for less than some three
persistence lengths (Shimada and Yamakawa, Macromolecules 1984, 17, 689; in these units Becker, Rosa and Everaers, Eur.
Phys. J. E 2010, 32, 53).

    python cyclisation.py [folder] [steps]
"""

import sys
from pathlib import Path

import matplotlib

matplotlib.use("Agg")

import matplotlib.pyplot as plt
import numpy as np
import openmm
from openmm import app, unit

from openmm_cylchain import Crosslinks, Filaments, FilamentType

PERSISTENCE_LENGTH = 50.0  # nm
LENGTHS = (1.0, 1.5, 2.0, 3.0, 4.0)  # in persistence lengths
SEGMENTS = (40, 40, 40, 32, 32)  # in such ones, J is some per cent smaller than in finer ones
SPRINGS = 10  # for each length
COPIES = 3
STIFFEST = 1.0  # nm: by so much it lets ends fluctuate
BASE_PAIR = 0.34  # nm
# Far beyond the recommended step: the equilibrium of chains and springs does not depend on it.
STEP = 100 * unit.nanosecond
STEPS = 6000
FRAMES = 1000
VISCOSITY = 1e-3 * unit.pascal * unit.second
TEMPERATURE = 298 * unit.kelvin
KT = (unit.MOLAR_GAS_CONSTANT_R * TEMPERATURE).value_in_unit(unit.kilojoule_per_mole)

folder = Path(sys.argv[1] if len(sys.argv) > 1 else "output_cyclisation")
steps = int(sys.argv[2]) if len(sys.argv) > 2 else STEPS
folder.mkdir(parents=True, exist_ok=True)

filaments = Filaments(VISCOSITY, TEMPERATURE)
links = Crosslinks(stiffness=1.0, rest_length=0.0)
springs = {}
for length, segments in zip(LENGTHS, SEGMENTS):
    contour = length * PERSISTENCE_LENGTH
    # So stiff along itself that its length is fixed, as in the theory.
    kind = FilamentType(
        name="DNA",
        diameter=2 * unit.nanometer,
        segment_length=contour / segments,
        persistence_length=PERSISTENCE_LENGTH,
        temperature=TEMPERATURE,
        stretching_modulus=1e4 * unit.piconewton,
        friction_length=8 * unit.nanometer,
        mass_per_length=1940 * unit.dalton / unit.nanometer,
    )
    springs[length] = np.concatenate([[0.0], KT / np.geomspace(contour, STIFFEST, SPRINGS - 1) ** 2])
    for number in range(SPRINGS * COPIES):
        place = [1.2 * contour * (number % 8), 1.2 * contour * (number // 8), 2 * contour]
        filaments.add_equilibrium(kind, segments, seed=len(filaments), start=place)
topology, system, positions = filaments.build()
ends = np.array([nodes[[0, -1]] for nodes in filaments.node_indices])
stiffnesses = np.concatenate([np.repeat(springs[length], COPIES) for length in LENGTHS])
for pair, stiffness in zip(ends, stiffnesses):
    if stiffness:
        links.add(None, int(pair[0]), int(pair[1]), stiffness=stiffness)
links.add_to(system)
integrator = filaments.create_integrator(system, STEP, random_seed=1, checks=False)
simulation = app.Simulation(topology, system, integrator, openmm.Platform.getPlatformByName("CPU"))
simulation.context.setPositions(positions)
with open(folder / "molecules.cif", "w") as file:
    app.PDBxFile.writeFile(topology, positions, file, keepIds=True)
# Springs first pull ends together that are far from each other.
for share in (1e-4, 1e-3, 1e-2, 1e-1, 1.0):
    integrator.setStepSize(share * STEP)
    simulation.step(20)
simulation.reporters.append(app.DCDReporter(str(folder / "molecules.dcd"), max(1, steps // 50)))

interval = max(1, steps // FRAMES)
distances, shape = [], None
for _ in range(steps // interval):
    simulation.step(interval)
    shape = simulation.context.getState(positions=True).getPositions(asNumpy=True).value_in_unit(unit.nanometer)
    distances.append(np.linalg.norm(shape[ends[:, 1]] - shape[ends[:, 0]], axis=1))
simulation.step(steps % interval)
distances = np.array(distances)[len(distances) // 5 :].T.reshape(len(LENGTHS), SPRINGS, COPIES, -1)


def density_at_contact(squares, stiffness):
    """J in 1/nm^3 from squares of distances, (springs, samples), under springs of each stiffness."""
    energies = 0.5 * stiffness[:, None] * squares.ravel() / KT
    shares = np.zeros(len(stiffness))  # logarithms of Z
    for _ in range(2000):
        # Each sample has the weight of a free molecule over what the mixture of all springs gives it.
        mixture = np.logaddexp.reduce(-energies - shares[:, None], axis=0) + np.log(squares.shape[1])
        new = np.logaddexp.reduce(-energies - mixture, axis=1)
        new -= new[0]
        change, shares = np.abs(new - shares).max(), new
        if change < 1e-7:
            break
    last = np.array([0.5, 1.0]) * stiffness[-1]
    free = np.logaddexp.reduce(-mixture)
    held = np.logaddexp.reduce(-0.5 * last[:, None] * squares.ravel() / KT - mixture, axis=1) - free
    soft, stiff = np.exp(held) * (last / (2 * np.pi * KT)) ** 1.5
    # The density changes over the width of a spring, with 1/k: what would be left of that at k without end.
    return 2 * stiff - soft


def shimada_yamakawa(length):
    """J in 1/nm^3 at a length in persistence lengths."""
    return 112.04 * length**-5.0 * np.exp(-14.055 / length + 0.246 * length) / PERSISTENCE_LENGTH**3


def gaussian(length):
    """J in 1/nm^3 of a long chain, with the first correction of Daniels."""
    return (3 / (4 * np.pi * length)) ** 1.5 * (1 - 1.25 / length) / PERSISTENCE_LENGTH**3


molar = 1e24 / 6.02214076e23  # 1/nm^3
results = []
print(f"{steps} steps of {STEP}, {integrator.getNumDividedSteps()} divided, {len(filaments)} molecules")
print("base pairs  L/lp   J (M)              over Shimada and Yamakawa")
for length, own in zip(LENGTHS, distances):
    each = [density_at_contact(own[:, copy] ** 2, springs[length]) for copy in range(COPIES)]
    mean, error = np.mean(each), np.std(each, ddof=1) / np.sqrt(COPIES)
    results.append((length, mean * molar, error * molar))
    expected = shimada_yamakawa(length)
    print(
        f"{length * PERSISTENCE_LENGTH / BASE_PAIR:8.0f} {length:7.1f}   {mean * molar:.3g} +- {error * molar:.1g}"
        f"     {mean / expected:8.3f} +- {error / expected:.3f}"
    )

figure = plt.figure(figsize=(12, 5.2), layout="constrained")
left, right = figure.subplots(1, 2)
chosen = LENGTHS.index(2.0) * SPRINGS * COPIES
colours = plt.cm.viridis(np.linspace(0.9, 0.0, SPRINGS))
for spring in range(SPRINGS):
    nodes = shape[filaments.node_indices[chosen + spring * COPIES]]
    nodes = (nodes - nodes.mean(axis=0)) @ np.linalg.eigh(np.cov(nodes.T))[1][:, ::-1]
    x, y = 95 * (spring % 4), -85 * (spring // 4)
    left.plot(nodes[:, 0] + x, nodes[:, 1] + y, color=colours[spring], linewidth=2.5)
    left.plot(nodes[[0, -1], 0] + x, nodes[[0, -1], 1] + y, "o", color="#D55E00", markersize=5)
left.set(aspect="equal", xlabel="nm", ylabel="nm")
left.set_title("294 base pairs, from no spring to the stiffest one", fontsize=11)
grid = np.geomspace(0.8, 8, 200)
base_pairs = PERSISTENCE_LENGTH / BASE_PAIR
known = grid < 4
right.plot(
    base_pairs * grid[known], molar * shimada_yamakawa(grid[known]), color="0.2", label="Shimada and Yamakawa 1984"
)
long = grid > 4
right.plot(base_pairs * grid[long], molar * gaussian(grid[long]), "--", color="0.5", label="Daniels, long chains")
length, value, error = np.array(results).T
right.errorbar(base_pairs * length, value, error, fmt="o", color="#0072B2", label="simulated", zorder=3)
right.set(xscale="log", yscale="log", xlabel="base pairs", ylabel="J (mol/L)")
right.set_xticks([150, 300, 600, 1200], labels=["150", "300", "600", "1200"])
right.minorticks_off()
right.set_title("Ends of DNA that meet, in any direction", fontsize=11)
right.legend(frameon=False)
for axes in (left, right):
    axes.spines[["top", "right"]].set_visible(False)
figure.savefig(folder / "molecules.png", dpi=110)
print(f"Wrote molecules.cif, molecules.dcd and molecules.png to {folder}.")
