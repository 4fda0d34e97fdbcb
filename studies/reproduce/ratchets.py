"""Brownian ratchets: growing filaments that push obstacles against loads, and what theory has of their speeds.

Lengths are in monomers, energies in k_B T and rates in k_on c: then the speed depends on the load w = f delta/k_B T,
the diffusion constant D of the obstacle, k_off and the contact alone, and a step is k_on c h long.
"""

from dataclasses import dataclass

import numpy as np
import openmm
import scipy
from openmm import unit

from openmm_cylchain import Filaments, FilamentType, Growth, Monomers, capsule_contact_force
from openmm_cylchain.units.quantities import thermal_energy

TEMPERATURE = 300.0
KT = thermal_energy(TEMPERATURE)
OFF_RATE = 0.1
STALL = float(-np.log(OFF_RATE))
CONTACT_STIFFNESS = 4.0
"""In k_B T per square of a monomer: so soft that steps resolve it."""
_SEGMENT = 108.0
_SEGMENTS = 4
_SPHERE = 6000.0
"""Diameter of a sphere, beside which it is a plane that a tip pushes."""
_THICKNESS = 30.0
"""Contact diameter of rods."""
_SLOWER = 20.0
"""In so many steps an obstacle relaxes across the way on which it is pushed."""


@dataclass(frozen=True)
class Ratchet:
    """A rod that is too stiff to bend grows at its plus end against an obstacle that a load presses on it.

    Attributes
    ----------
    load : float
        w.
    diffusion : float
        D of the obstacle, in delta^2 k_on c.
    step : float
        k_on c h.
    obstacle : str
        "sphere", whose size makes it a plane, or "rod", another filament that lies across the one that grows.
    monomer : float
        delta in nm.
    off_rate : float
        k_off/(k_on c).
    stiffness : float
        Of the contact, in k_B T/delta^2.
    """

    load: float
    diffusion: float = 1.0
    step: float = 0.2
    obstacle: str = "sphere"
    monomer: float = 2.7
    off_rate: float = OFF_RATE
    stiffness: float = CONTACT_STIFFNESS

    def speeds(self, copies, steps, seed):
        """Speeds (copies,) in delta k_on c of so many copies, over so many steps after a tenth as many more."""
        context, growth = self._start(copies, seed)
        context.getIntegrator().step(steps // 10)
        before = growth(context)
        context.getIntegrator().step(steps)
        after = growth(context)
        if after.waited.any():
            raise AssertionError("A filament has no nodes left.")
        return (after.monomers - before.monomers)[:, 1] / (steps * self.step)

    def _start(self, copies, seed):
        # Rods in a solvent so thick that steps resolve their contacts, too.
        filaments = Filaments(1.0 * unit.pascal * unit.second, TEMPERATURE)
        per_segment = round(_SEGMENT / self.monomer)
        rod = FilamentType(
            name="ROD",
            diameter=7.0,
            bending_rigidity=1e9 * KT,
            stretching_modulus=1e6 * unit.piconewton,
            segment_length=per_segment * self.monomer,
        )
        friction = rod.segment_friction(filaments.viscosity, TEMPERATURE, 1).perpendicular
        rate = KT / friction / (self.diffusion * self.monomer**2) if self.obstacle == "rod" else 1e-6
        monomers = Monomers(length=self.monomer, plus_on_rate=rate, plus_off_rate=self.off_rate * rate)
        length = _SEGMENTS * rod.segment_length
        growth = Growth(
            monomers=monomers, pool=1.0, longest=20.0 * length, shortest=1.6 * rod.segment_length, minus_capped=True
        )
        apart = 1.5 * _SPHERE
        for copy in range(copies):
            filaments.add_straight(rod, _SEGMENTS, [0, apart * copy, 0], [1, 0, 0], clamped=[0], growth=growth)
        gaps = np.random.default_rng(seed).exponential(self.monomer / self.load, copies)
        if self.obstacle == "rod":
            for copy, gap in enumerate(gaps):
                start = [length + _THICKNESS + gap, apart * copy - 0.5 * rod.segment_length, 0]
                filaments.add_straight(rod, 1, start, [0, 1, 0])
        _, system, positions = filaments.build()
        positions = positions.value_in_unit(unit.nanometer)
        for copy in range(copies):
            # The second node, too: the rod keeps its direction.
            system.setParticleMass(int(filaments.node_indices[copy][1]), 0.0)
        step, load = self.step / rate, self.load * KT / self.monomer
        spheres = []
        if self.obstacle == "sphere":
            friction = KT / (self.diffusion * self.monomer**2 * rate)
            spheres = [system.addParticle(1.0) for _ in range(copies)]
            centers = [length + 0.5 * (_THICKNESS + _SPHERE) + gaps, apart * np.arange(copies), 0.0 * gaps]
            positions = np.concatenate([positions, np.stack(centers, axis=1)])
            system.addForce(_pressed(spheres, positions, load, friction / (_SLOWER * step)))
        else:
            rods = filaments.node_indices[copies:]
            system.addForce(_pressed(np.concatenate(rods), positions, 0.5 * load, 0.25 * friction / step))
            system.addForce(_kept_across(rods, 0.25 * friction / step))
        stiffness = self.stiffness * KT / self.monomer**2
        options = {"particles": spheres, "particle_diameter": _SPHERE} if spheres else {}
        system.addForce(capsule_contact_force(filaments, system, _THICKNESS, stiffness, **options))
        options = {"particle_friction": friction} if spheres else {}
        integrator = filaments.create_integrator(system, step, random_seed=seed, checks=False, **options)
        context = openmm.Context(system, integrator, openmm.Platform.getPlatform("CPU"), {"Threads": "1"})
        context.setPositions(positions)
        return context, lambda context: filaments.in_context(context).growth()


def _pressed(particles, positions, load, stiffness):
    force = openmm.CustomExternalForce("load*x+0.5*stiffness*((y-y0)^2+z^2)")
    force.addGlobalParameter("load", load)
    force.addGlobalParameter("stiffness", stiffness)
    force.addPerParticleParameter("y0")
    for particle in particles:
        force.addParticle(int(particle), [positions[particle][1]])
    return force


def _kept_across(rods, stiffness):
    force = openmm.CustomCompoundBondForce(2, "0.25*turning*(x1-x2)^2")
    force.addGlobalParameter("turning", stiffness)
    for nodes in rods:
        force.addBond([int(node) for node in nodes])
    return force


def speed_of_fast_obstacle(load, off_rate=OFF_RATE):
    """V = exp(-w)-k_off of an obstacle that diffuses far faster than monomers come."""
    return np.exp(-load) - off_rate


def speed_of_slow_obstacle(load, diffusion):
    """V = D w^2/(exp(w)-1-w) of one that diffuses far more slowly, if no monomers go.

    Peskin, Odell and Oster, Biophys. J. 1993, 65, 316.
    """
    return diffusion * load**2 / (np.expm1(load) - load)


def exact_speed(ratchet, points=100):
    """The speed in the limit of short steps: that of the master equation of the gap before the tip.

    The gap g has the energy w g+k min(g, 0)^2/2 and diffuses with D. Monomers come with the rate min(1, exp(-dU)) and
    go with k_off min(1, exp(-dU)), which moves it by one. ``points`` are those of a monomer.
    """
    deepest, width = -1.0 - 6.0 / np.sqrt(ratchet.stiffness), 1.0 / points
    gaps = np.arange(deepest, 8.0 + 12.0 / ratchet.load, width)
    surface = 0.5 * ratchet.stiffness * np.minimum(gaps, 0.0) ** 2
    slopes = np.diff(surface + ratchet.load * gaps)
    count, numbers = len(gaps), np.arange(len(gaps))
    gains = np.exp(np.minimum(0.0, surface[points:] - surface[:-points]))
    losses = np.full(count - points, ratchet.off_rate)
    moves = [
        (numbers[:-1], numbers[1:], ratchet.diffusion / width**2 * np.exp(-0.5 * slopes)),
        (numbers[1:], numbers[:-1], ratchet.diffusion / width**2 * np.exp(0.5 * slopes)),
        (numbers[points:], numbers[:-points], gains),
        (numbers[:-points], numbers[points:], losses),
    ]
    start, end, rates = (np.concatenate(column) for column in zip(*moves))
    rows, columns = np.concatenate([end, start]), np.concatenate([start, start])
    generator = scipy.sparse.csr_matrix((np.concatenate([rates, -rates]), (rows, columns)), shape=(count, count))
    # In place of the last equation, which follows from the others: probabilities have the sum one.
    equations = scipy.sparse.vstack([generator[:-1], np.ones((1, count))]).tocsc()
    weights = scipy.sparse.linalg.spsolve(equations, np.eye(1, count, count - 1)[0])
    return float(gains @ weights[points:] - losses @ weights[:-points])
