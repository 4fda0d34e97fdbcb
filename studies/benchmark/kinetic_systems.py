"""The contractile bundle of the benchmark of kinetics: actin, motors and crosslinkers in a cylinder."""

import math
from dataclasses import dataclass

import numpy as np
import openmm
from openmm import unit

from openmm_cylchain import (
    Crosslinker,
    Cylinder,
    Filaments,
    FilamentType,
    Hand,
    Slab,
    analysis,
    capsule_contact_force,
    filament_wall_force,
)
from openmm_cylchain.units.quantities import thermal_energy

from . import systems

TEMPERATURE = 298.15
VISCOSITY = 1.0 * unit.pascal * unit.second
SEGMENT_LENGTH = 50.0
PICONEWTON = 0.602214076
"""In kJ/(mol nm)."""

MICROSECOND = 1e6
MILLISECOND = 1e9
"""In ps."""

ACTIN = FilamentType(
    name="ACT",
    diameter=6.0,
    bending_rigidity=0.06e6 * PICONEWTON,
    temperature=TEMPERATURE,
    stretching_modulus=4.37e4 * PICONEWTON,
    segment_length=SEGMENT_LENGTH,
    friction_length="filament",
)
"""The rigidity is that of the benchmark, EA that of Kojima et al., PNAS 1994, 91, 12962."""

RADIUS, LENGTH = 100.0, 5000.0
"""Of the cylinder, in nm."""

WALL_STIFFNESS = 0.5 * PICONEWTON
CONTACT_DIAMETER = 20.0
REST_LENGTH = 50.0
"""Of motors and crosslinkers, in nm."""

REACH = 80.0
"""In nm: beyond the rest length, so that a spring that is not strained is well within reach."""

MOTOR_STIFFNESS, CROSSLINKER_STIFFNESS = 0.1 * PICONEWTON, 0.08 * PICONEWTON
BINDING_RATE = 1e-12
"""In 1/ps, with which a second hand binds to a straight filament at the rest length of its spring."""

_CONTACT_GROUP, _WALL_GROUP = 1, 2
_SEED = 1
_COLD = 1.0
_COLD_STEPS = (1.0, 10.0, 100.0, 1000.0)
_WARM_STEPS = (10.0, 100.0, 1000.0)


def binding_rate(stiffness, rate=BINDING_RATE, reach=REACH, rest_length=REST_LENGTH, temperature=TEMPERATURE):
    """The ``binding_rate`` of a Hand that binds with a rate to a straight filament at the rest length of the spring.

    Such a filament has places with the springs' energies U(s) = (k/2) ((d0^2 + s^2)^(1/2) - d0)^2, of which each length
    binds with ``binding_rate/(2 reach) exp(-U/k_B T)``.

    Parameters
    ----------
    stiffness : float
        k, in kJ/(mol nm^2).
    rate : float
        In 1/ps.
    reach, rest_length : float
        R and d0, in nm.
    temperature : float
        In K.
    """
    end = math.sqrt(reach**2 - rest_length**2)
    along, weights = np.polynomial.legendre.leggauss(64)
    energies = 0.5 * stiffness * (np.hypot(rest_length, end * along) - rest_length) ** 2
    width = end * np.sum(weights * np.exp(-energies / thermal_energy(temperature)))
    return rate * 2.0 * reach / float(width)


@dataclass(frozen=True)
class BundleSystem:
    """A contractile bundle.

    Attributes
    ----------
    name : str
        For rows.
    filaments, motors, crosslinkers : int
    length : float
        Of the cylinder, in nm.
    speed : float
        Of motors, in nm/ps.
    contacts : bool
        Whether filaments do not pass through each other.
    """

    name: str = "bundle"
    filaments: int = 150
    motors: int = 1000
    crosslinkers: int = 1000
    length: float = LENGTH
    speed: float = 0.5e-9
    contacts: bool = True


@dataclass(frozen=True)
class Bundle:
    """A bundle in a Context."""

    system: BundleSystem
    filaments: Filaments
    context: openmm.Context

    @property
    def integrator(self):
        """Of the Context."""
        return self.context.getIntegrator()

    def positions(self):
        """Of all nodes, in nm."""
        return self.context.getState(positions=True).getPositions(asNumpy=True)._value

    def linkers(self):
        """The linkers now, a LinkerTable."""
        return self.filaments.in_context(self.context).linkers()

    def length(self):
        """How long the bundle is, in nm: 12^(1/2) times the standard deviation of x of segments.

        That is the length over which they lie if they lie there evenly.
        """
        positions = self.positions()
        middles = np.concatenate([0.5 * (positions[own[:-1], 0] + positions[own[1:], 0]) for own in self.nodes])
        return float(math.sqrt(12.0) * middles.std())

    @property
    def nodes(self):
        """The particles of every filament."""
        return self.filaments.node_indices

    def crossings(self, steps):
        """How often filaments pass through each other in so many steps, each of them looked at."""
        counter = analysis.CrossingCounter(self.filaments, self.positions())
        for _ in range(steps):
            self.integrator.step(1)
            counter.update(self.positions())
        return counter.count

    def energies(self):
        """Energies by name, in k_BT: of bending, stretching, springs of linkers, contacts and walls."""
        positions, kT = self.positions(), thermal_energy(TEMPERATURE)
        energies = {"bending": 0.0, "stretching": 0.0}
        for own in self.nodes:
            vectors = np.diff(positions[own], axis=0)
            lengths = np.linalg.norm(vectors, axis=1)
            tangents = vectors / lengths[:, None]
            energies["stretching"] += float(ACTIN.stretching_energy(lengths).sum())
            energies["bending"] += float(ACTIN.bending_energy(np.sum(tangents[1:] * tangents[:-1], axis=1)).sum())
        pulls, table = self.filaments.in_context(self.context).linker_pulls(), self.linkers()
        types = table.types[np.searchsorted(table.numbers, pulls.numbers)]
        for number, linkers in enumerate(self.filaments.linkers):
            extensions = pulls.lengths[types == number] - linkers.kind.rest_length
            energies[linkers.kind.name] = float(0.5 * linkers.kind.stiffness * np.sum(extensions**2))
        for name, group in (("contact", _CONTACT_GROUP), ("wall", _WALL_GROUP)):
            state = self.context.getState(energy=True, groups={group})
            energies[name] = state.getPotentialEnergy()._value
        return {name: energy / kT for name, energy in energies.items()}


def linker_types(system):
    """The Crosslinkers of a bundle: motors, then crosslinkers."""
    motor = Hand(
        binding_rate=binding_rate(MOTOR_STIFFNESS),
        reach=REACH,
        unbinding_rate=0.51e-12,
        speed=system.speed,
        stall_force=4.0 * PICONEWTON if system.speed else None,
    )
    passive = Hand(binding_rate=binding_rate(CROSSLINKER_STIFFNESS), reach=REACH, unbinding_rate=0.0)
    return (
        Crosslinker(hands=motor, stiffness=MOTOR_STIFFNESS, rest_length=REST_LENGTH, name="motor"),
        Crosslinker(hands=passive, stiffness=CROSSLINKER_STIFFNESS, rest_length=REST_LENGTH, name="crosslinker"),
    )


def create_bundle(system, step, seed=1, positions=None, table=None, linkers=True):
    """A bundle in a Context on one thread.

    Parameters
    ----------
    system : BundleSystem
    step : float
        Of the implicit scheme, in us.
    seed : int
        Of the noise.
    positions : (nodes, 3) array, optional
        In nm; as drawn if not given.
    table : LinkerTable, optional
        Linkers; each with its first hand at a random place if not given.
    linkers : bool
        Whether there are motors and crosslinkers.
    """
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine="compiled")
    generator = np.random.default_rng(_SEED)
    for _ in range(system.filaments):
        segments = int(np.clip(round(generator.normal(20.0, 6.0)), 4, 36))
        half = 0.5 * segments * SEGMENT_LENGTH
        x = generator.uniform(half - 0.5 * system.length, 0.5 * system.length - half)
        angle = generator.uniform(0.0, 2.0 * math.pi)
        radius = (RADIUS - 0.5 * CONTACT_DIAMETER) * math.sqrt(generator.uniform())
        sign = generator.choice((-1.0, 1.0))
        start = [x - sign * half, radius * math.cos(angle), radius * math.sin(angle)]
        filaments.add_straight(ACTIN, segments, start=start, direction=[sign, 0.0, 0.0])
    volume = math.pi * RADIUS**2 * system.length
    for kind, count in zip(linker_types(system), (system.motors, system.crosslinkers) if linkers else ()):
        filaments.add_linkers(kind, count, volume=volume, bound=count, seed=_SEED)
    _, openmm_system, drawn = filaments.build()
    if system.contacts:
        contacts = capsule_contact_force(filaments, openmm_system, CONTACT_DIAMETER)
        contacts.setForceGroup(_CONTACT_GROUP)
        openmm_system.addForce(contacts)
    axis, origin = [1.0, 0.0, 0.0], [0.0, 0.0, 0.0]
    for shape in (Cylinder(origin, axis, RADIUS), Slab(origin, axis, system.length)):
        wall = filament_wall_force(filaments, openmm_system, shape, WALL_STIFFNESS)
        wall.setForceGroup(_WALL_GROUP)
        openmm_system.addForce(wall)
    integrator = filaments.create_integrator(openmm_system, step * MICROSECOND, random_seed=seed, checks=False)
    nodes = drawn._value if positions is None else positions
    context = systems.one_thread_context(openmm_system, integrator, nodes)
    if table is not None:
        filaments.in_context(context).set_linkers(table)
    return Bundle(system, filaments, context)


def relaxed_positions(system, steps):
    """Positions in which filaments that were drawn on top of each other have come apart, before there are linkers.

    They come apart in the cold, in steps that grow: where two axes nearly meet, noise would let them cross.

    Parameters
    ----------
    system : BundleSystem
    steps : int
        How many, of the longest, come last.

    Returns
    -------
    (nodes, 3) array
        In nm.
    """
    bundle = create_bundle(system, _COLD_STEPS[0], linkers=False)
    for temperature, lengths, count in (
        (_COLD, _COLD_STEPS, 20),
        (TEMPERATURE, _WARM_STEPS, 20),
        (TEMPERATURE, _WARM_STEPS[-1:], steps),
    ):
        bundle.integrator.setTemperature(temperature)
        for length in lengths:
            bundle.integrator.setStepSize(length * MICROSECOND)
            bundle.integrator.step(count)
    return bundle.positions()
