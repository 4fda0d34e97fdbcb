"""DNA, base pair by base pair, that tumbles in a shear flow.

Twelve molecules of 255 bonds, 84 nm and a good two persistence lengths, are in water that flows along x and whose
velocity grows along z, by 1.54e8 per second. The flow stretches a molecule along x; noise takes an end across the flow,
which then folds the molecule and turns it over. A bead is a base pair (DSDNA_BASE_PAIRS). Bonds between beads relax
within picoseconds; scheme "implicit" takes steps of 195 ps, in which the flow strains the solvent by 0.03.

    python tumbling_dna.py [folder] [steps]
"""

import sys
from pathlib import Path

import matplotlib

matplotlib.use("Agg")

import matplotlib.pyplot as plt
import numpy as np
import openmm
from openmm import app, unit

from openmm_cylchain import DSDNA_BASE_PAIRS, Filaments, Flow, theory

MOLECULES = 12
BONDS = 255
RATE = 1.54e8 / unit.second
STEPS = 20000
FRAMES = 1000
POSES = 7
SPACING = 95.0  # nm between them in the picture
SHOWN = 4
VISCOSITY = 1e-3 * unit.pascal * unit.second  # Of the solvent; beads have a friction of their own.
TEMPERATURE = 296.15 * unit.kelvin

folder = Path(sys.argv[1] if len(sys.argv) > 1 else "output_tumbling_dna")
steps = int(sys.argv[2]) if len(sys.argv) > 2 else STEPS
folder.mkdir(parents=True, exist_ok=True)

filaments = Filaments(VISCOSITY, TEMPERATURE)
for number in range(MOLECULES):
    filaments.add_equilibrium(DSDNA_BASE_PAIRS, BONDS, seed=number, start=[0, 100 * number, 0])
topology, system, positions = filaments.build()
flow = Flow.shear(RATE)
step = filaments.recommended_time_step("implicit", flow=flow)
integrator = filaments.create_integrator(system, step, "implicit", random_seed=1, flow=flow)
simulation = app.Simulation(topology, system, integrator, openmm.Platform.getPlatformByName("Reference"))
simulation.context.setPositions(positions)
with open(folder / "tumbling.cif", "w") as file:
    app.PDBxFile.writeFile(topology, positions, file, keepIds=True)
interval = max(1, steps // FRAMES)
simulation.reporters.append(app.DCDReporter(str(folder / "tumbling.dcd"), interval))
chains = []
for _ in range(steps // interval):
    simulation.step(interval)
    now = simulation.context.getState(positions=True).getPositions(asNumpy=True).value_in_unit(unit.nanometer)
    chains.append(now[np.array(filaments.node_indices)])
chains = np.array(chains)  # (frames, molecules, beads, 3)
time = 1e-6 * interval * step.step * np.arange(1, len(chains) + 1)  # microseconds

ends = chains[:, :, -1] - chains[:, :, 0]
contour = DSDNA_BASE_PAIRS.straight_lengths(BONDS).sum()
rest = theory.bead_spring_mean_square_end_to_end(DSDNA_BASE_PAIRS, BONDS, TEMPERATURE)
squares = np.mean(ends**2, axis=(0, 1))
sides = np.sign(ends[..., 0]) * (np.abs(ends[..., 0]) > 0.3 * contour)


def turns(signs):
    """How often the vector along the flow turns over, from the one side to the other."""
    signs = signs[signs != 0]
    return np.count_nonzero(signs[1:] != signs[:-1])


count = sum(turns(sides[:, number]) for number in range(MOLECULES))
rate = RATE.value_in_unit(unit.second**-1)
print(f"{steps} steps of {step.step:.4g} ps, {time[-1]:.3g} us in all: {step.reason}")
print(f"mean square end-to-end distance {squares.sum():.0f} nm^2, {rest:.0f} nm^2 at rest; {contour:.0f} nm long")
print(f"share of it along the flow: {squares[0] / squares.sum():.2f}; 0.33 at rest")
turned, vorticity = count / (MOLECULES * time[-1]), 1e-6 * rate / (2 * np.pi)
print(f"molecules turn over {turned:.2f} times per us; with the vorticity {vorticity:.1f}")
print(f"steps that were divided: {integrator.getNumDividedSteps()} of {MOLECULES * steps}")

figure, (film, panel) = plt.subplots(2, 1, figsize=(11, 6), gridspec_kw={"height_ratios": [0.28, 1]})
# The molecule and the time in which it turns over farthest within a shear of 40.
span = max(1, min(len(chains) - 1, round(40 / (1e-6 * rate * time[0]))))
over = np.abs(ends[span:, :, 0] - ends[:-span, :, 0]) if len(chains) > span else np.abs(ends[:1, :, 0])
first, chosen = np.unravel_index(np.argmax(over), over.shape)
for place, pose in enumerate(np.linspace(first, min(len(chains) - 1, first + span), POSES).astype(int)):
    colour = plt.cm.plasma(0.05 + 0.8 * place / (POSES - 1))
    shape = chains[pose, chosen] - chains[pose, chosen].mean(axis=0)
    film.plot(shape[:, 0] + SPACING * place, shape[:, 2], color=colour, linewidth=2.2, solid_capstyle="round")
    film.plot(shape[0, 0] + SPACING * place, shape[0, 2], "o", color=colour, markersize=6)
    film.text(SPACING * place, -32, f"{time[pose]:.2f} µs", ha="center", color="0.4")
film.set(aspect="equal", xlim=(-0.6 * SPACING, SPACING * (POSES - 0.4)), ylim=(-36, 26))
film.set_axis_off()
for number in range(SHOWN):
    panel.plot(time, ends[:, number, 0], color=plt.cm.viridis(0.9 * number / SHOWN), linewidth=1)
panel.axhline(0, color="0.7", linewidth=0.8)
panel.set(xlabel="t (µs)", ylabel="end-to-end vector along the flow (nm)", xlim=(0, time[-1]))
panel.spines[["top", "right"]].set_visible(False)
figure.tight_layout()
figure.savefig(folder / "tumbling.png", dpi=110)
print(f"Wrote tumbling.cif, tumbling.dcd and tumbling.png to {folder}.")
