"""A bead that a comet of branched actin pushes, as Listeria and beads with activators of Arp2/3 move.

Near the bead, filaments have branches, which grow until they are capped, and crosslinkers hold all together. The oldest
filaments stand on a base, at the angle that branches make with their mothers. A constant force presses the bead on
them, and a weak trap keeps it above them. Ends grow where they find room between filaments and bead, each a Brownian
ratchet, so the bead moves ahead against the force, and what has been capped stays behind it. The bead is a rigid body
that turns and diffuses. What makes branches is on its surface: where they begin follows it, some times in each second
of the run, in another System that goes on from the Context before. For comparison, a bead with the same filaments that
have no branches: the oldest ones lift it until they are capped, and there it stays.

    python motile_bead.py [folder] [steps]
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
    Body,
    Branching,
    EndStates,
    Filaments,
    Growth,
    Sphere,
    capsule_contact_force,
)

RADIUS = 150.0  # nm, of the bead
BEADS = 3
LOAD = 2.0  # pN, on the bead
TRAP = 0.02  # pN/nm, across
MOTHERS, PLACES, CROSSLINKERS = 30, 500, 200
MONOMERS = 20  # of a segment
ANGLE = np.deg2rad(35)  # of mothers: half of that between them and branches
CONCENTRATION = unit.Quantity(10e-6, unit.molar)
BRANCHING = 200.0  # per um and second, near the bead
NEAR = 50.0  # nm from its surface
CAPPING = 5.0  # per second
DIAMETER = 7.0  # nm, at which filaments touch
STEP = 0.1 * unit.millisecond
STEPS = 15000
FRAMES = 100
MOVES = 30  # how often branches follow the bead
VISCOSITY = 1.0 * unit.pascal * unit.second
TEMPERATURE = 298.15 * unit.kelvin
PICONEWTON = 0.602214076  # kJ/(mol nm)
GROWING, CAPPED, MOTHER, STILL = "#D55E00", "#7FA7C9", "#333333", "#999999"

folder = Path(sys.argv[1] if len(sys.argv) > 1 else "output_motile_bead")
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


def comet(seed, rate, bead):
    """Mothers on a base below a bead, and places for branches near a bead at a point, in a Simulation."""
    generator = np.random.default_rng(seed)
    filaments = Filaments(VISCOSITY, TEMPERATURE)
    for number in range(MOTHERS):
        # At places of a spiral, apart from each other, below the lower half of the bead.
        out = 0.9 * RADIUS * np.sqrt((number + 0.5) / MOTHERS)
        x, y = out * np.array([np.cos(2.4 * number), np.sin(2.4 * number)])
        tip = np.array([x, y, -np.sqrt((RADIUS + DIAMETER) ** 2 - out**2) - 5.0])
        around = generator.uniform(0, 2 * np.pi)
        direction = np.array([np.sin(ANGLE) * np.cos(around), np.sin(ANGLE) * np.sin(around), np.cos(ANGLE)])
        start = tip - 2 * actin.segment_length * direction
        filaments.add_straight(actin, 2, start, direction, growth=growth, clamped=[0])
    branching = Branching(
        rate=rate / unit.micrometer / unit.second, region=Sphere(bead, RADIUS + NEAR), distance=DIAMETER
    )
    filaments.add_reserve(actin, PLACES, growth=growth, nucleation=branching)
    filaments.add_linkers(ALPHA_ACTININ, CROSSLINKERS, volume=4 * RADIUS**3)
    filaments.add_body(Body.sphere(RADIUS, name="Bead"), [0, 0, 0])
    topology, system, positions = filaments.build()
    for nodes in filaments.node_indices[:MOTHERS]:
        # The second node, too: mothers keep their direction at the base.
        system.setParticleMass(int(nodes[1]), 0.0)
    centre = int(filaments.body_indices[0][0])
    system.addForce(
        capsule_contact_force(filaments, system, DIAMETER, particles=[centre], particle_diameter=2 * RADIUS)
    )
    press = openmm.CustomExternalForce("load*z+0.5*trap*(x^2+y^2)")
    press.addGlobalParameter("load", LOAD * PICONEWTON)
    press.addGlobalParameter("trap", TRAP * PICONEWTON)
    press.addParticle(centre)
    system.addForce(press)
    integrator = filaments.create_integrator(system, STEP, random_seed=seed, checks=False)
    simulation = app.Simulation(topology, system, integrator, openmm.Platform.getPlatformByName("CPU"))
    simulation.context.setPositions(positions)
    return filaments, simulation, centre


def run(seed, rate, report=False):
    """Filaments, a Simulation at its end, and the course of the bead: times in s and places in nm."""
    filaments, simulation, centre = comet(seed, rate, np.zeros(3))
    reporters = []
    if report:
        reporters.append(app.DCDReporter(str(folder / "motile.dcd"), interval))
        with open(folder / "motile.cif", "w") as file:
            positions = simulation.context.getState(positions=True).getPositions()
            app.PDBxFile.writeFile(simulation.topology, positions, file, keepIds=True)
    course, done = [np.zeros(3)], 0
    while done < steps:
        simulation.reporters = reporters
        own = min(max(20, steps // MOVES), steps - done)
        simulation.step(own)
        done += own
        place = simulation.context.getState(positions=True).getPositions(asNumpy=True)._value[centre]
        course.append(np.array(place))
        if done < steps:
            following = comet(seed, rate, course[-1])
            following[0].in_context(following[1].context).go_on_from(simulation.context)
            filaments, simulation, centre = following
    times = STEP.value_in_unit(unit.second) * np.linspace(0, steps, len(course))
    return filaments, simulation, times, np.array(course)


runs = [run(seed + 1, BRANCHING, seed == 0) for seed in range(BEADS)]
still = [run(seed + 1, 0.0) for seed in range(BEADS)]
times = runs[0][2]
moved = {name: np.array([own[3][:, 2] for own in group]) for name, group in (("comet", runs), ("none", still))}
begun = np.mean([filaments.in_context(simulation.context).growth().nucleated for filaments, simulation, *_ in runs])
print(f"{steps} steps of {STEP}, {times[-1]:.2g} s; {BEADS} beads of {RADIUS:g} nm under {LOAD:g} pN")
print(f"{begun:.0f} branches behind each")
for name, text in (("comet", "With branches"), ("none", "Without")):
    late = moved[name][:, -1] - moved[name][:, len(times) // 2]
    speed, error = late.mean(), late.std(ddof=1) / np.sqrt(BEADS)
    half = times[-1] - times[len(times) // 2]
    print(f"{text}, beads move up by {speed / half:.0f} +- {error / half:.0f} nm/s in the second half")

figure, (picture, panel) = plt.subplots(1, 2, figsize=(12, 6.5), layout="constrained")
filaments, simulation, _, course = runs[0]
x = simulation.context.getState(positions=True).getPositions(asNumpy=True).value_in_unit(unit.nanometer)
grown = filaments.in_context(simulation.context).growth()
growing = grown.end_states[:, 1] == 0
for number in np.flatnonzero(grown.nodes):
    nodes = x[filaments.node_indices[number]][: grown.nodes[number]]
    colour = GROWING if growing[number] else MOTHER if number < MOTHERS else CAPPED
    picture.plot(nodes[:, 0], nodes[:, 2], color=colour, linewidth=1.6, alpha=0.9)
picture.add_patch(plt.Circle(course[0, [0, 2]], RADIUS, fill=False, linestyle="--", color="#999999"))
picture.add_patch(plt.Circle(course[-1, [0, 2]], RADIUS, facecolor="#E8D9B5", edgecolor="#555555", linewidth=1.5))
picture.plot(*course[:, [0, 2]].T, color="#555555", linewidth=1)
for label, colour in (("growing", GROWING), ("capped", CAPPED), ("capped, from the start", MOTHER)):
    picture.plot([], [], color=colour, label=label)
picture.set(aspect="equal", xlabel="x (nm)", ylabel="z (nm)", title=f"After {times[-1]:.2g} s")
picture.legend(frameon=False, loc="lower left", fontsize=9)
for name, colour, text in (("comet", GROWING, "with branches"), ("none", STILL, "without")):
    panel.plot(times, moved[name].T, color=colour, linewidth=0.8, alpha=0.5)
    panel.plot(times, moved[name].mean(axis=0), color=colour, linewidth=2.4, label=text)
panel.set(xlabel="time (s)", ylabel="z of the bead (nm)", xlim=(0, times[-1]))
panel.legend(frameon=False)
for own in (picture, panel):
    own.spines[["top", "right"]].set_visible(False)
figure.savefig(folder / "motile.png", dpi=100)
print(f"Wrote motile.cif, motile.dcd and motile.png to {folder}.")
