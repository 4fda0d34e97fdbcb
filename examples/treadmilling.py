"""Treadmilling: actin filaments that grow at one end and shrink at the other.

Monomers come to both ends, and leave them. Below the treadmilling concentration of free monomers filaments become
shorter, above it longer. At it they keep their length, and yet move: the plus end gains what the minus end loses. Rates
are those of ATP-actin, thirty times as fast, so that seconds are enough.

    python treadmilling.py [folder] [steps]
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

from openmm_cylchain import ACTIN_ATP, F_ACTIN, Filaments, Growth, MonomerPool

FASTER = 30.0  # than pure actin
SHARES = (0.75, 1.0, 1.25)  # of the treadmilling concentration
FILAMENTS = 8  # at each of them
SEGMENTS = 18
MONOMERS = 40  # of a segment
LONGEST = 6 * unit.micrometer
STEP = 2 * unit.millisecond
STEPS = 15000
FRAMES = 150
VISCOSITY = 1 * unit.pascal * unit.second  # as in a dense gel: they hardly diffuse
TEMPERATURE = 298 * unit.kelvin
COLOURS = ("#0072B2", "#009E73", "#D55E00")

folder = Path(sys.argv[1] if len(sys.argv) > 1 else "output_treadmilling")
steps = int(sys.argv[2]) if len(sys.argv) > 2 else STEPS
folder.mkdir(parents=True, exist_ok=True)

rates = ("plus_on_rate", "plus_off_rate", "minus_on_rate", "minus_off_rate")
fast = replace(ACTIN_ATP, **{name: FASTER * getattr(ACTIN_ATP, name) for name in rates})
balance = fast.treadmilling_concentration
actin = F_ACTIN.with_segment_length(MONOMERS * fast.length)
filaments = Filaments(VISCOSITY, TEMPERATURE)
growths = [Growth(monomers=fast, pool=MonomerPool(share * balance), longest=LONGEST) for share in SHARES]
for growth in growths:
    for _ in range(FILAMENTS):
        number = len(filaments)
        start = [0.0, 500.0 * number, 0.0]
        filaments.add_equilibrium(actin, SEGMENTS, number, start, [1, 0, 0], planar=True, growth=growth)
topology, system, positions = filaments.build()
integrator = filaments.create_integrator(system, STEP, random_seed=1, checks=False)
simulation = app.Simulation(topology, system, integrator, openmm.Platform.getPlatformByName("CPU"))
simulation.context.setPositions(positions)
here = filaments.in_context(simulation.context)
with open(folder / "treadmilling.cif", "w") as file:
    app.PDBxFile.writeFile(topology, positions, file, keepIds=True)


def current():
    """How far filaments have grown, and along x the first and the last node of each, in um."""
    state = simulation.context.getState(positions=True)
    x = state.getPositions(asNumpy=True).value_in_unit(unit.micrometer)[:, 0]
    # Spare nodes are where the last node is.
    return here.growth(), np.array([x[nodes[[0, -1]]] for nodes in filaments.node_indices])


def free_rate(growth, end):
    """Monomers that a free end gains in a second."""
    on, off = growth.rates(end)
    return 1e12 * (on * growth.pool.concentration - off)


interval = max(1, steps // FRAMES)
simulation.reporters.append(app.DCDReporter(str(folder / "treadmilling.dcd"), interval))
course = [current()]
for _ in range(steps // interval):
    simulation.step(interval)
    course.append(current())
time = interval * STEP.value_in_unit(unit.second) * np.arange(len(course))
grown, ends = [one for one, _ in course], np.array([own for _, own in course])
lengths = np.array([one.lengths.value_in_unit(unit.micrometer) for one in grown]).reshape(len(time), len(SHARES), -1)
gained = (grown[-1].gained - grown[-1].lost).reshape(len(SHARES), FILAMENTS, 2).mean(axis=1) / time[-1]
micromolar = 1e6 * balance.value_in_unit(unit.molar)
free = np.array([[free_rate(growth, end) for end in ("minus", "plus")] for growth in growths])
print(f"{steps} steps of {STEP}; {time[-1]:.3g} s. Filaments treadmill at {micromolar:.4f} uM")
for share, own, exact in zip(SHARES, gained, free):
    print(
        f"{share * micromolar:.3f} uM: minus ends gain {own[0]:.1f} monomers per s (free ends {exact[0]:.1f}), "
        f"plus ends {own[1]:.1f} ({exact[1]:.1f})"
    )

figure, panels = plt.subplots(2, len(SHARES), figsize=(13, 8), layout="constrained", sharey="row", sharex=True)
for number, (share, colour) in enumerate(zip(SHARES, COLOURS)):
    kymograph, panel = panels[:, number]
    # One filament: where it is along x, at each time.
    minus, plus = ends[:, number * FILAMENTS].T
    kymograph.fill_between(time, minus, plus, color=colour, alpha=0.35, linewidth=0, label="filament")
    kymograph.plot(time, plus, color="#101010", linewidth=2, label="plus end")
    kymograph.plot(time, minus, color=colour, linewidth=2, label="minus end")
    kymograph.set_title(f"{share * micromolar:.3f} µM, {share:g} of what balances both ends")
    panel.plot(time, lengths[:, number], color=colour, linewidth=0.8, alpha=0.5)
    panel.plot(time, lengths[:, number].mean(axis=1), color=colour, linewidth=2.5, label="mean")
    speed = free[number].sum() * fast.length / 1000
    straight = lengths[0, number].mean() + speed * time
    panel.plot(time, straight, "--", color="#101010", linewidth=1.5, label="free ends")
    panel.set(xlabel="time (s)", xlim=(0, time[-1]))
    for axes in (kymograph, panel):
        axes.spines[["top", "right"]].set_visible(False)
panels[0, 0].set_ylabel("one filament, along x (µm)")
panels[1, 0].set_ylabel("length of each filament (µm)")
panels[1, 0].set_ylim(bottom=0)
panels[0, 0].legend(frameon=False, loc="best")
panels[1, 0].legend(frameon=False, loc="lower left")
figure.savefig(folder / "treadmilling.png", dpi=100)
print(f"Wrote treadmilling.cif, treadmilling.dcd and treadmilling.png to {folder}.")
