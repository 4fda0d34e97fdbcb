"""Loop extruders on a chain of chromatin, with a domain between two barriers as CTCF makes it.

Extruders load anywhere on a chain as pairs of hands that walk apart, one hand to each end, and reel a loop in until
they let go. They stop each other, since a site holds one hand. Two barriers capture the hands that come to them from
between, so that many loops join both. Hands walk some ten times as fast as cohesin does, to see more in less time.

    python loop_extrusion.py [folder] [steps]
"""

import sys
from pathlib import Path

import matplotlib

matplotlib.use("Agg")

import matplotlib.pyplot as plt
import numpy as np
import openmm
from openmm import app, unit

from openmm_cylchain import Crosslinker, Filaments, FilamentType, Hand

SEGMENTS, SEGMENT_LENGTH = 120, 50.0  # nm
BARRIERS = (2000.0, 4000.0)  # nm, along the chain
EXTRUDERS = 4
SPEED, STALL_FORCE = 300.0, 1.0  # nm/s of each hand, pN
LIFETIME = 6.0  # s
SITE = 25.0  # nm
STEP = 100 * unit.microsecond
STEPS = 400000
FRAMES = 400
VISCOSITY = 0.1 * unit.pascal * unit.second
TEMPERATURE = 310 * unit.kelvin

folder = Path(sys.argv[1] if len(sys.argv) > 1 else "output_loop_extrusion")
steps = int(sys.argv[2]) if len(sys.argv) > 2 else STEPS
folder.mkdir(parents=True, exist_ok=True)

nanometer, second = unit.nanometer, unit.second
chromatin = FilamentType(
    name="CHR",
    diameter=20 * nanometer,
    segment_length=SEGMENT_LENGTH * nanometer,
    persistence_length=50 * nanometer,
    temperature=TEMPERATURE,
    stretching_modulus=50 * unit.piconewton,
    friction_length=100 * nanometer,
)
filaments = Filaments(VISCOSITY, TEMPERATURE)
filaments.add_equilibrium(chromatin, SEGMENTS, seed=1)
hands = [
    Hand(
        binding_rate=1 / second,
        reach=100 * nanometer,
        unbinding_rate=0.5 / (LIFETIME * second),
        speed=direction * SPEED * nanometer / second,
        stall_force=STALL_FORCE * unit.piconewton,
        site_spacing=SITE * nanometer,
    )
    for direction in (-1, 1)
]
extruder = Crosslinker(
    hands=hands,
    stiffness=0.02 * unit.piconewton / nanometer,
    rest_length=30 * nanometer,
    loading_distance=50 * nanometer,
    name="extruder",
)
# So small a volume that an unbound one loads within some tenths of a second.
filaments.add_linkers(extruder, EXTRUDERS, volume=0.05 * unit.micrometer**3)
for place, toward in zip(BARRIERS, ("minus", "plus")):
    filaments.add_barrier(0, place * nanometer, toward=toward, release_rate=0.1 / second)
topology, system, positions = filaments.build()
# Segments turn within a step. That is not resolved, and need not be: hence no check of the step.
integrator = filaments.create_integrator(system, STEP, random_seed=1, checks=False)
simulation = app.Simulation(topology, system, integrator, openmm.Platform.getPlatformByName("CPU"))
context = simulation.context
here = filaments.in_context(context)
context.setPositions(positions)
with open(folder / "loops.cif", "w") as file:
    app.PDBxFile.writeFile(topology, positions, file, keepIds=True)
interval = max(1, steps // FRAMES)
simulation.reporters.append(app.DCDReporter(str(folder / "loops.dcd"), interval))

shapes, tables = [], []
for _ in range(steps // interval):
    simulation.step(interval)
    now = context.getState(positions=True).getPositions(asNumpy=True).value_in_unit(unit.micrometer)
    shapes.append(now[filaments.node_indices[0]])
    tables.append(here.linkers())

time = interval * STEP.value_in_unit(second) * np.arange(1, len(tables) + 1)
loops = [np.sort(table.arc_lengths[table.held == 2], axis=1) / 1000 for table in tables]
lengths = np.concatenate([np.zeros(1), *(np.diff(own, axis=1)[:, 0] for own in loops[len(loops) // 4 :])])[1:]
sites = np.array(BARRIERS) / 1000
joined = np.mean([np.any(np.all(np.abs(own - sites) <= 2 * SITE / 1000, axis=1)) for own in loops[len(loops) // 4 :]])
distances = np.zeros((SEGMENTS + 1, SEGMENTS + 1))
for shape in shapes[len(shapes) // 4 :]:
    distances += np.linalg.norm(shape[:, None] - shape, axis=2) < 0.15
contacts = distances / len(shapes[len(shapes) // 4 :])
divided = integrator.getNumDividedSteps() / steps
print(f"{steps} steps of {STEP}, {100 * divided:.2g} % of them divided; {time[-1]:.3g} s")
print(f"{np.mean([len(own) for own in loops]):.1f} of {EXTRUDERS} extruders are bound")
if len(lengths):
    alone = 2 * SPEED * LIFETIME / 1000
    print(f"Their loops are {lengths.mean():.2f} um long; one that nothing stops has {alone:.2f} um")
print(f"Both barriers are joined for {100 * joined:.0f} % of the time")

figure, ((picture, kymograph), (map_of_contacts, histogram)) = plt.subplots(
    2, 2, figsize=(12, 9.5), layout="constrained"
)
along = np.linspace(0, SEGMENTS * SEGMENT_LENGTH / 1000, SEGMENTS + 1)
shape = shapes[-1] - shapes[-1].mean(axis=0)
picture.plot(*shape[:, :2].T, color="0.75", linewidth=1, zorder=1)
picture.scatter(*shape[:, :2].T, c=along, cmap="viridis", s=22, zorder=2)
for first, second_hand in loops[-1]:
    places = [[np.interp(place, along, shape[:, axis]) for axis in (0, 1)] for place in (first, second_hand)]
    picture.plot(*np.transpose(places), ".-", color="#B3261E", markersize=9, linewidth=1.5, zorder=3)
for place in sites:
    picture.plot(*[np.interp(place, along, shape[:, axis]) for axis in (0, 1)], "k^", markersize=9, zorder=4)
picture.set(aspect="equal", xlabel="x (µm)", ylabel="y (µm)")
picture.set_title("At the end: extruders red, barriers black", loc="left", fontsize=11)
for moment, own in zip(time, loops):
    kymograph.vlines(np.full(len(own), moment), *own.T, color="#0072B2", alpha=0.25, linewidth=1.2)
    kymograph.plot(np.full(own.size, moment), own.ravel(), ".", color="#B3261E", markersize=2)
for place in sites:
    kymograph.axhline(place, color="black", linewidth=1, linestyle="--")
kymograph.set(xlabel="time (s)", ylabel="along the chain (µm)", xlim=(0, time[-1]), ylim=(0, along[-1]))
kymograph.set_title("Loops, hands red, barriers dashed", loc="left", fontsize=11)
image = map_of_contacts.imshow(
    np.log10(np.maximum(contacts, 1e-3)), origin="lower", extent=(0, along[-1]) * 2, cmap="magma_r", vmin=-3, vmax=0
)
figure.colorbar(image, ax=map_of_contacts, label="log10 of the share of time within 150 nm", shrink=0.8)
map_of_contacts.plot([sites[0], sites[0], sites[1]], [sites[0], sites[1], sites[1]], color="#0072B2", linewidth=1)
map_of_contacts.set(xlabel="along the chain (µm)", ylabel="along the chain (µm)")
map_of_contacts.set_title("Contacts; the domain between the barriers is framed", loc="left", fontsize=11)
if len(lengths):
    histogram.hist(lengths, bins=30, color="#56B4E9")
histogram.axvline(sites[1] - sites[0], color="black", linestyle="--", linewidth=1)
histogram.set(xlabel="length of a loop (µm)", ylabel="number", xlim=(0, None))
histogram.set_title("Loops; dashed: from barrier to barrier", loc="left", fontsize=11)
for axes in (picture, kymograph, histogram):
    axes.spines[["top", "right"]].set_visible(False)
figure.savefig(folder / "loops.png", dpi=110)
print(f"Wrote loops.cif, loops.dcd and loops.png to {folder}.")
