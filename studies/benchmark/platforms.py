"""Platforms: filaments alone, and a network among Lennard-Jones particles, on each platform and in each precision.

The same filaments take the same steps with scheme "implicit" on the CPU platform, with all its threads, and on each
platform for GPUs that filaments can be computed on here, in each precision of OpenMM. All of them are timed in turn.
So are particles with ten filaments among them and without. The Reference platform, which checks others, takes no part.
"""

from dataclasses import dataclass
from functools import partial

import numpy as np
import openmm
from openmm import app, unit

from openmm_cylchain import F_ACTIN, Crosslinks, Filaments, capsule_contact_force
from openmm_cylchain.engine_choice import choose_engine
from openmm_cylchain.engines.gpu_platforms import GPU_PLATFORMS, enable_platform, why_not_on
from openmm_cylchain.errors import InputError
from openmm_cylchain.mechanics.friction import stokes_friction

from .measurement import Case, describe_machine, median, processors, ratio, scaled, time_interleaved
from .report import Report, row
from .systems import IMPLICIT_TIME_STEP, TEMPERATURE, VISCOSITY, simulate_filaments

PRECISIONS = ("single", "mixed", "double")
"""Of OpenMM's platforms for GPUs."""

DIAMETER = 100.0
"""Of Lennard-Jones particles, in nm: their sigma. They attract each other with k_BT."""

PARTICLE_MASS = 1.0e6
"""Of Lennard-Jones particles, in dalton. It has no effect on how they diffuse."""

SPACING = 1.2 * DIAMETER
"""Between particles at the start, on a cubic lattice, and between filaments."""

MIXED_SEGMENTS = 10
MIXED_TIME_STEP = 2.0e5
"""In ps: particles diffuse by 1 % of their diameter in it."""

LINK_STIFFNESS = 0.06
CONTACT_STIFFNESS = 0.06
"""In kJ/(mol nm^2), of what joins filaments and of their contacts."""

ADDED_FILAMENTS = 10
"""Filaments that are added to a System that runs without them."""


@dataclass(frozen=True)
class ChainsSize:
    """Filaments alone."""

    chains: int
    segments: int

    @property
    def name(self):
        """Its part of the names of rows."""
        return f"{self.chains}_chains_of_{self.segments}"

    def simulate(self, platform, properties):
        """A Context of it."""
        return simulate_filaments(
            "compiled", self.chains, self.segments, platform, properties, "implicit", IMPLICIT_TIME_STEP
        ).context


@dataclass(frozen=True)
class MixedSize:
    """Linked filaments of 10 segments, which touch, beside Lennard-Jones particles, in a periodic box."""

    particles: int
    chains: int

    @property
    def name(self):
        """Its part of the names of rows."""
        return f"{self.particles}_particles_and_{self.chains}_filaments"

    def simulate(self, platform, properties):
        """A Context of it."""
        system, positions, integrator = mixed_system(self.particles, self.chains)
        context = openmm.Context(system, integrator, openmm.Platform.getPlatform(platform), properties)
        context.setPositions(positions)
        return context


@dataclass(frozen=True)
class Effort:
    """How much is measured.

    Attributes
    ----------
    sizes : tuple of ChainsSize and MixedSize
    particles : int
        Of the System to which a few filaments are added.
    repetitions : int
    seconds : float
        For each platform and precision of a size in each repetition.
    """

    sizes: tuple
    particles: int
    repetitions: int
    seconds: float


_CHAINS = (ChainsSize(200, 64), ChainsSize(200, 10))
FULL = Effort((*_CHAINS, ChainsSize(20000, 64), MixedSize(100000, 100)), 100000, 7, 1.0)
QUICK = Effort((*_CHAINS, MixedSize(10000, 20)), 20000, 3, 0.2)


def particles_alone(particles, platform, properties):
    """A Context of the particles of a MixedSize without filaments, with OpenMM's own integrator for such particles."""
    system, positions, _ = mixed_system(particles, 0)
    # OpenMM divides forces by mass and friction: this one lets particles move as stokes_friction does.
    friction = stokes_friction(0.5 * DIAMETER, VISCOSITY) / PARTICLE_MASS
    integrator = openmm.BrownianIntegrator(TEMPERATURE, friction, MIXED_TIME_STEP)
    context = openmm.Context(system, integrator, openmm.Platform.getPlatform(platform), properties)
    context.setPositions(positions)
    return context


def mixed_system(particles, chains):
    """A network above a lattice of particles, a System that they share, and its integrator.

    Straight filaments lie beside each other in layers. Each touches the next one, and is linked to it at three places.

    Parameters
    ----------
    particles, chains : int

    Returns
    -------
    system : openmm.System
    positions : Quantity of (particles and nodes, 3)
    integrator : CylinderChainIntegrator, or None without filaments
    """
    columns = max(
        int(np.ceil(particles ** (1 / 3))), int(np.ceil((MIXED_SEGMENTS + 2) * F_ACTIN.segment_length / SPACING))
    )
    layers, rows = -(-particles // columns**2), -(-chains // columns)
    topology, system = app.Topology(), openmm.System()
    system.setDefaultPeriodicBoxVectors(*(SPACING * np.diag([columns, columns, max(11, layers + rows)])))
    topology.setPeriodicBoxVectors(system.getDefaultPeriodicBoxVectors())
    chain = topology.addChain()
    for _ in range(particles):
        topology.addAtom("LJ", None, topology.addResidue("PAR", chain))
        system.addParticle(PARTICLE_MASS)
    numbers = np.arange(particles)
    lattice = SPACING * np.stack([numbers % columns, numbers // columns % columns, numbers // columns**2], axis=1)
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine="compiled")
    for number in range(chains):
        start = SPACING * np.array([0.5, number % columns, layers + number // columns])
        filaments.add_straight(F_ACTIN, MIXED_SEGMENTS, start, [1.0, 0.0, 0.0])
    positions = lattice * unit.nanometer
    if chains:
        positions = filaments.add_to(topology, system, positions)
    if chains > 1:
        links = Crosslinks(LINK_STIFFNESS, SPACING)
        for number in range(chains - 1):
            if (number + 1) % columns:
                for segment in (1, MIXED_SEGMENTS // 2, MIXED_SEGMENTS - 2):
                    places = (filaments.segment_place(number + one, segment=segment) for one in (0, 1))
                    links.add(None, *places)
        links.add_to(system)
        system.addForce(capsule_contact_force(filaments, system, SPACING, CONTACT_STIFFNESS))
    attraction = openmm.NonbondedForce()
    attraction.setNonbondedMethod(openmm.NonbondedForce.CutoffPeriodic)
    attraction.setCutoffDistance(2.5 * DIAMETER)
    attraction.setUseDispersionCorrection(False)
    for _ in range(system.getNumParticles()):
        attraction.addParticle(0.0, DIAMETER, unit.MOLAR_GAS_CONSTANT_R * TEMPERATURE * unit.kelvin)
    system.addForce(attraction)
    if not chains:
        return system, positions, None
    friction = stokes_friction(0.5 * DIAMETER, VISCOSITY)
    integrator = filaments.create_integrator(
        system, MIXED_TIME_STEP, "implicit", particle_friction=friction, random_seed=1
    )
    return system, positions, integrator


def places():
    """The platforms with their properties by their names in rows, the CPU first, and why others are missing.

    Returns
    -------
    found : dict
        Names of platforms with properties of a Context.
    missing : dict
        Reasons.
    """
    found, missing = {"cpu": ("CPU", {"Threads": str(processors())})}, {}
    for name in GPU_PLATFORMS:
        try:
            reason = why_not_on(name)
            if reason is None:
                enable_platform(name)
        except InputError as error:
            reason = str(error)
        if reason is None:
            found |= {f"{name.lower()}_{precision}": (name, {"Precision": precision}) for precision in PRECISIONS}
        else:
            missing[name] = reason
    return found, missing


def benchmark_platforms(effort=FULL, say=lambda message: None):
    """Measure steps on each platform and in each precision, and how many times faster than the CPU they are.

    Parameters
    ----------
    effort : Effort
    say : callable (str), optional
        Told how far it is.

    Returns
    -------
    Report

    Raises
    ------
    InputError
        If there is no compiled engine.
    """
    choose_engine("compiled")
    machine = describe_machine()
    found, missing = places()
    rows, devices = [], {}

    def measure(name, simulations, ways):
        """Seconds by (place, number of the callable that makes a Context there, way in which it is kept busy)."""
        cases = []
        for place, (platform, properties) in found.items():
            say(f"{name}: {place}")
            try:
                contexts = [simulate(platform, properties) for simulate in simulations]
                for context in contexts:
                    context.getIntegrator().step(1)
            except openmm.OpenMMException as error:
                missing[f"{name}_{place}"] = str(error)
            else:
                cases += [
                    Case((place, number, way.__name__), partial(way, context))
                    for number, context in enumerate(contexts)
                    for way in ways
                ]
                devices[platform] = _device(contexts[0])
        return time_interleaved(cases, effort.repetitions, effort.seconds, lambda text: say(f"{name}: {text}"))

    for size in effort.sizes:
        times = measure(size.name, [size.simulate], [steps])
        rows += platform_rows(size.name, {place: own for (place, *_), own in times.items()})
    added = MixedSize(effort.particles, ADDED_FILAMENTS)
    times = measure(added.name, [added.simulate, partial(particles_alone, effort.particles)], [steps, energies])
    rows += added_rows(effort.particles, times)
    settings = {
        "scheme": "implicit",
        "time_step_ps": IMPLICIT_TIME_STEP,
        "time_step_mixed_ps": MIXED_TIME_STEP,
        "threads_of_the_cpu": processors(),
        "precision_of_filaments_on_the_cpu": "automatic",
        "devices": devices,
        "repetitions": effort.repetitions,
        "seconds_per_repetition": effort.seconds,
        "sizes": [size.name for size in effort.sizes],
        "particles_with_and_without_filaments": effort.particles,
    }
    title = f"Platforms, {effort.repetitions} interleaved repetitions; the CPU with {processors()} threads"
    return Report(title, machine, settings, rows, missing)


def _device(context):
    platform = context.getPlatform()
    name = "DeviceName"
    return platform.getPropertyValue(context, name) if name in platform.getPropertyNames() else "the processor"


def steps(context, number):
    """Take steps."""
    context.getIntegrator().step(number)


def energies(context, number):
    """Compute all forces and energies of the System, and nothing else."""
    for _ in range(number):
        context.getState(energy=True)


def added_rows(particles, times):
    """Rows of how much longer steps of particles, and their energies, take with a few filaments among them.

    Parameters
    ----------
    particles : int
        Their number.
    times : dict
        Seconds, one for each repetition, by the names of places, 0 with filaments or 1 without, and what is timed.
    """
    return [
        row(
            f"{way}_with_{ADDED_FILAMENTS}_filaments_over_without_{particles}_particles_{place}",
            ratio(own, times[place, 1, way]),
            "1",
        )
        for (place, number, way), own in times.items()
        if number == 0
    ]


def platform_rows(size, times):
    """Rows of the steps of a size, and of speeds over that of the CPU.

    Parameters
    ----------
    size : str
        Its name.
    times : dict
        Seconds per step, one for each repetition, by the names of places.
    """
    rows = [row(f"time_per_step_{size}_{place}", scaled(median(own), 1e3), "ms") for place, own in times.items()]
    for place, own in times.items():
        if place != "cpu" and "cpu" in times:
            rows.append(row(f"speed_over_cpu_{size}_{place}", ratio(times["cpu"], own), "1"))
    return rows
