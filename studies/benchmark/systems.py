"""What is measured: actin filaments with an engine, and chains of beads of stock OpenMM."""

from dataclasses import dataclass, replace

import numpy as np
import openmm
from openmm import app, unit

from openmm_cylchain import F_ACTIN, Filaments
from openmm_cylchain.engines.portable_forces import add_bending_forces

from .measurement import Case

TEMPERATURE = 310.0
VISCOSITY = 1.71e-3 * unit.pascal * unit.second
TIME_STEP = 5.0e3
"""In ps, half the recommended step."""

IMPLICIT_TIME_STEP = 1.0e9
"""The same for scheme "implicit", three quarters of it."""

SCHEME = "euler"
"""That which is most like what stock OpenMM does: one evaluation of forces and one solution a step."""

ONE_THREAD = ("CPU", {"Threads": "1"})
REFERENCE = ("Reference", {})
_SHAPES = 64


BEAMS = replace(F_ACTIN, element="beam", extension_relaxation_time=None)


@dataclass(frozen=True)
class Simulated:
    """A Context with all that a user keeps beside it; ``filaments`` is None where there are only beads."""

    filaments: Filaments | None
    topology: app.Topology
    system: openmm.System
    integrator: openmm.Integrator
    context: openmm.Context

    def advance(self, steps):
        """Advance by a number of steps."""
        self.integrator.step(steps)


@dataclass(frozen=True)
class Network:
    """Filaments in a Context."""

    filaments: Filaments
    context: openmm.Context

    def advance(self, steps):
        """Take steps."""
        self.context.getIntegrator().step(steps)


def restarting(name, network, step=None):
    """A Case of a Network that begins from the same state each time, in steps of a length in ps if one is given."""
    checkpoint = network.context.createCheckpoint()

    def advance(steps):
        network.context.loadCheckpoint(checkpoint)
        if step is not None:
            # A checkpoint has the step, too.
            network.context.getIntegrator().setStepSize(step)
        network.advance(steps)

    return Case(name, advance)


def one_thread_platform():
    """The platform on which one thread computes, with its properties: CPU, or Reference where there is none."""
    names = [openmm.Platform.getPlatform(index).getName() for index in range(openmm.Platform.getNumPlatforms())]
    return ONE_THREAD if ONE_THREAD[0] in names else REFERENCE


def one_thread_context(system, integrator, positions, platform=None):
    """A Context on the platform on which one thread computes, or on one that is given: a name and its properties."""
    platform, properties = one_thread_platform() if platform is None else platform
    return _started(None, None, system, integrator, positions, platform, properties).context


def simulate_filaments(
    engine,
    chains,
    segments,
    platform,
    properties,
    scheme=SCHEME,
    step=TIME_STEP,
    precision="automatic",
    filament_type=F_ACTIN,
):
    """Actin filaments in equilibrium, with an engine, ready to step.

    Parameters
    ----------
    engine : {"compiled", "portable"}
    chains, segments : int
        Number of filaments, and of the segments of each.
    platform : str
    properties : dict
        Of the platform.
    scheme : str
    step : float or None
        In ps; the recommended one if None.
    precision : {"automatic", "mixed", "double"}
    filament_type : FilamentType

    Returns
    -------
    Simulated
    """
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine=engine)
    for positions in _node_positions(chains, segments):
        filaments.add_nodes(filament_type, positions)
    topology, system, positions = filaments.build()
    if step is None:
        step = filaments.recommended_time_step(scheme, system=system)
    integrator = filaments.create_integrator(system, step, scheme=scheme, random_seed=1, precision=precision)
    return _started(filaments, topology, system, integrator, positions, platform, properties)


def simulate_beads(angle_force, chains, segments, platform, properties):
    """Chains of as many particles with stock forces and OpenMM's BrownianIntegrator, ready to step.

    Bonds are those of a HarmonicBondForce with the filaments' stiffness; a bead has the mean of the friction
    of a segment along and across it.

    Parameters
    ----------
    angle_force : {"harmonic", "custom"}
        A HarmonicAngleForce of the filaments' stiffness, or a CustomAngleForce with their potential.
    chains, segments, platform, properties
        See ``simulate_filaments``.

    Returns
    -------
    Simulated
    """
    topology, system = _bead_topology(chains, segments), openmm.System()
    for _ in range(chains * (segments + 1)):
        system.addParticle(1.0)
    system.addForce(bonds(F_ACTIN, chains, segments))
    if angle_force == "harmonic":
        system.addForce(harmonic_angles(F_ACTIN, chains, segments))
    else:
        joints = ((F_ACTIN, *triple, F_ACTIN.joint_stiffness) for triple in _successive(chains, segments, 3))
        add_bending_forces(system, joints, 0)
    friction = F_ACTIN.segment_friction(VISCOSITY, TEMPERATURE, segments)
    rate = (friction.parallel + 2.0 * friction.perpendicular) / 3.0
    integrator = openmm.BrownianIntegrator(TEMPERATURE, rate, TIME_STEP)
    integrator.setRandomNumberSeed(1)
    positions = np.concatenate(list(_node_positions(chains, segments)))
    return _started(None, topology, system, integrator, positions, platform, properties)


def _started(filaments, topology, system, integrator, positions, platform, properties):
    context = openmm.Context(system, integrator, openmm.Platform.getPlatform(platform), properties)
    context.setPositions(positions)
    return Simulated(filaments, topology, system, integrator, context)


def _node_positions(chains, segments):
    # Chains do not interact, so a few shapes, over and over and in one place, cost what as many different ones do.
    shapes = Filaments(VISCOSITY, TEMPERATURE)
    for seed in range(min(chains, _SHAPES)):
        shapes.add_equilibrium(F_ACTIN, segments, seed)
    for chain in range(chains):
        yield shapes[chain % _SHAPES].positions


def _successive(chains, segments, count):
    for chain in range(chains):
        first = chain * (segments + 1)
        for particle in range(first, first + segments + 2 - count):
            yield tuple(range(particle, particle + count))


def bonds(filament_type, chains, segments):
    """A HarmonicBondForce between successive particles of chains, with the stiffness of a filament's segments."""
    force = openmm.HarmonicBondForce()
    for pair in _successive(chains, segments, 2):
        force.addBond(*pair, filament_type.segment_length, filament_type.segment_stiffness)
    return force


def harmonic_angles(filament_type, chains, segments):
    """A HarmonicAngleForce along chains, with the stiffness of a filament's joints."""
    force = openmm.HarmonicAngleForce()
    for triple in _successive(chains, segments, 3):
        force.addAngle(*triple, np.pi, filament_type.joint_stiffness)
    return force


def _bead_topology(chains, segments):
    topology = app.Topology()
    for number in range(chains):
        chain = topology.addChain(f"F{number}")
        previous = None
        for node in range(segments + 1):
            residue = topology.addResidue(F_ACTIN.name, chain, str(node + 1))
            atom = topology.addAtom("NOD", None, residue)
            if previous is not None:
                topology.addBond(previous, atom)
            previous = atom
    return topology
