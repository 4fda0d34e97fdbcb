"""Actin filaments and microtubules in one System: how fast does each forget its direction?

Filaments of both kinds, 6 um long, start in equilibrium at 37 C and move for 0.1 s. The cosine of the angle
between two pieces of a filament falls off as exp(-s/l_p) with the distance s between them; the persistence length
l_p is 17 um for actin and 5 mm for microtubules.

    python two_filament_types.py [folder] [steps]
"""

import sys
from pathlib import Path

import matplotlib

matplotlib.use("Agg")

import matplotlib.pyplot as plt
import numpy as np
import openmm
from openmm import app, unit

from openmm_cylchain import F_ACTIN, MICROTUBULE, Filaments, theory

CONTOUR = 6000  # nm
FILAMENTS = 16  # of each kind
SEGMENTS = {"actin": 48, "microtubule": 16}
COLOURS = {"actin": "#c0392b", "microtubule": "#1f6f8b"}
TEMPERATURE = 310 * unit.kelvin
STEPS = 5000
FRAMES = 50

folder = Path(sys.argv[1] if len(sys.argv) > 1 else "output_two_filament_types")
steps = int(sys.argv[2]) if len(sys.argv) > 2 else STEPS
folder.mkdir(parents=True, exist_ok=True)

types = {
    "actin": F_ACTIN.with_segment_length(CONTOUR / SEGMENTS["actin"]),
    "microtubule": MICROTUBULE.with_segment_length(CONTOUR / SEGMENTS["microtubule"]),
}
filaments = Filaments(viscosity=1e-3 * unit.pascal * unit.second, temperature=TEMPERATURE)
members = {
    name: [
        filaments.add_equilibrium(
            types[name],
            SEGMENTS[name],
            seed=100 * row + number,
            start=[7500 * row, 500 * number, 0],
            direction=[1, 0, 0],
        )
        for number in range(FILAMENTS)
    ]
    for row, name in enumerate(types)
}
topology, system, positions = filaments.build()
recommended = filaments.recommended_time_step()
integrator = filaments.create_integrator(system, recommended.step, random_seed=1)
print(f"time step {recommended}")

simulation = app.Simulation(topology, system, integrator, openmm.Platform.getPlatformByName("Reference"))
simulation.context.setPositions(positions)
with open(folder / "filaments.cif", "w") as file:
    app.PDBxFile.writeFile(topology, positions, file, keepIds=True)
interval = max(1, steps // FRAMES)
simulation.reporters.append(app.DCDReporter(str(folder / "filaments.dcd"), interval))
frames = []
for _ in range(steps // interval):
    simulation.step(interval)
    frames.append(simulation.context.getState(positions=True).getPositions(asNumpy=True)._value)
frames = np.array(frames)


def tangent_correlation(nodes):
    """Mean of t(i).t(i+k) and its standard error, for k = 0, 1, 2, ... up to half the length."""
    difference = np.diff(nodes, axis=-2)
    tangent = difference / np.linalg.norm(difference, axis=-1)[..., None]
    count = tangent.shape[-2]
    products = [
        np.einsum("fcsi,fcsi->fcs", tangent[:, :, : count - lag], tangent[:, :, lag:]).mean(axis=(0, 2))
        for lag in range(count // 2 + 1)
    ]
    # Filaments are independent of each other; frames and joints of one filament are not.
    return np.mean(products, axis=1), np.std(products, axis=1, ddof=1) / np.sqrt(nodes.shape[1])


figure, (shapes, decay) = plt.subplots(1, 2, figsize=(13, 5), gridspec_kw={"width_ratios": [1.45, 1]})
print(f"{'':12} 1 - <cos> of a joint                  persistence length (um)")
print(f"{'':12} simulation             expected      simulation     expected")
for name, filament_type in types.items():
    nodes = np.array([filaments.node_indices[number] for number in members[name]])
    mean, error = tangent_correlation(frames[:, nodes])
    distance = filament_type.segment_length * np.arange(len(mean))
    exact = theory.chain_tangent_correlation(filament_type, np.arange(len(mean)), TEMPERATURE)
    simulated = -filament_type.segment_length / np.log(mean[1]) / 1000
    expected = theory.chain_persistence_length(filament_type, TEMPERATURE) / 1000
    print(f"{name:12} {1 - mean[1]:.3e} +/- {error[1]:.0e}   {1 - exact[1]:.3e} {simulated:14.4g} {expected:12.4g}")
    for filament in nodes:
        shapes.plot(
            frames[-1, filament, 0] / 1000,
            frames[-1, filament, 1] / 1000,
            color=COLOURS[name],
            linewidth=1.4 if name == "actin" else 3.2,
            alpha=0.85,
            solid_capstyle="round",
        )
    decay.fill_between(
        distance[1:] / 1000, (1 - mean - error)[1:], (1 - mean + error)[1:], color=COLOURS[name], alpha=0.2, linewidth=0
    )
    decay.plot(distance[1:] / 1000, 1 - mean[1:], "o", color=COLOURS[name], markersize=4, label=f"{name}, simulation")
    continuous = np.geomspace(distance[1], distance[-1], 100)
    decay.plot(
        continuous / 1000,
        -np.expm1(-continuous / filament_type.persistence_length_at(TEMPERATURE)),
        color=COLOURS[name],
        linewidth=1.2,
        label=r"$1-\exp(-s/\ell_p)$",
    )
    shapes.text(3 + 7.5 * list(types).index(name), 9.7, name, color=COLOURS[name], ha="center", fontsize=12)
shapes.set(xlabel="x (µm)", ylabel="y (µm)", aspect="equal", ylim=(-1.5, 10.3))
shapes.set_title("Filaments of 6 µm at the end of the simulation")
decay.set(xscale="log", yscale="log", xlabel="distance along the filament s (µm)", xlim=(0.1, 4))
decay.set_xticks([0.1, 0.2, 0.5, 1, 2], ["0.1", "0.2", "0.5", "1", "2"])
decay.xaxis.set_minor_formatter("")
decay.set_ylabel(r"$1-\langle\mathbf{t}(0)\cdot\mathbf{t}(s)\rangle$")
decay.set_title("Loss of direction")
decay.legend(frameon=False)
for axes in (shapes, decay):
    axes.spines[["top", "right"]].set_visible(False)
figure.tight_layout()
figure.savefig(folder / "filaments.png", dpi=150)
print(f"Wrote filaments.cif, filaments.dcd and filaments.png to {folder}.")
