"""The PythonForce of the portable engine: displacements of all particles in one step.

Each step the integrator hands the total forces and then the configuration to it, in a force group of its own, *through
the positions*; it returns displacements as "forces". A context parameter tells it what the positions hold; between
steps the parameter says "idle" and it contributes nothing, so that reported forces and energies are the physical ones.
"""

import hashlib
import pickle
import threading
from contextlib import contextmanager
from functools import lru_cache

import numpy as np
import openmm

from ..couplings.link_store import parameters_of
from ..couplings.periodicity import is_periodic
from ..errors import InputError, InstabilityError, note_raised_in_force
from ..mechanics.broken_segment import find_broken_segment
from ..mechanics.flow import Flow, flow_velocities
from ..mechanics.geometry import to_nearest_images
from ..mechanics.redistribution import STEPS
from ..time_steps.schemes import EXPLICIT_SCHEMES

REDISTRIBUTION_NAME = "CylinderChainRedistribution"

# What the positions hold: a value of the parameter PHASE.
IDLE, FORCES, CONFIGURATION = 0.0, 1.0, 2.0

# Context parameters.
PHASE = "cylinder_chain_phase"
SCHEME = "cylinder_chain_scheme"
KT = "cylinder_chain_kT"
STEP_SIZE = "cylinder_chain_step_size"
SEED = "cylinder_chain_seed"
STEPS_TAKEN = "cylinder_chain_steps_taken"
FLOWS = "cylinder_chain_flows"
# Those of the flow hold only while it flows.
FLOW = tuple(
    f"cylinder_chain_flow_{name}"
    for name in (
        *("velocity_x", "velocity_y", "velocity_z", "origin_x", "origin_y", "origin_z"),
        *(f"gradient_{row}{column}" for row in "xyz" for column in "xyz"),
    )
)

# Of the integrator that is stepping, if it looks for steps that are too long.
_RECORDER = None


@contextmanager
def recording(recorder):
    """Let a WorkRecorder, or None, take note of the steps that are taken meanwhile: one at a time in a process."""
    global _RECORDER
    _RECORDER = recorder
    try:
        yield
    finally:
        _RECORDER = None


def flow_to_values(flow):
    """A Flow as numbers in the order of the names FLOW."""
    return (*flow.velocity, *flow.origin, *np.ravel(flow.gradient).tolist())


@lru_cache(maxsize=32)
def flow_from_values(values):
    """The Flow of a tuple of such numbers."""
    return Flow(values[:3], np.reshape(values[6:], (3, 3)), values[3:6])


class ChainDisplacements:
    """The computation of the PythonForce: displacements of all particles in one step.

    It can be pickled, so a System that holds it can be serialised to XML.

    Parameters
    ----------
    chains : ChainSet
    nodes : (nodes,) int array
        Particle index of every node.
    rest_lengths : (segments,) array
    ranges : (segments,) array
        By how much a segment may be longer or shorter than that.
    labels : list of str
        What to call each chain in messages.
    others : (others,) int array
        Mobile particles outside chains.
    frictions : (others,) array
        Their friction coefficients in kJ ps/(mol nm^2).
    advice : str
        What else to say of a chain that has blown up.
    periodic : bool
        Whether a flow is that at the images nearest to its origin.
    """

    def __init__(self, chains, nodes, rest_lengths, ranges, labels, others, frictions, advice="", periodic=False):
        self._chains = chains
        self._nodes = nodes
        self._rest_lengths = rest_lengths
        self._ranges = ranges
        self._labels = labels
        self._others = others
        self._frictions = frictions
        self._advice = advice
        self._periodic = periodic
        self._forces = {}

    def __getstate__(self):
        return {**self.__dict__, "_forces": {}}

    def fingerprint(self):
        """A short text that equal computations share."""
        return hashlib.sha256(pickle.dumps(self)).hexdigest()[:16]

    def __call__(self, state):
        parameters = state.getParameters()
        phase = parameters[PHASE]
        vectors = state.getPositions(asNumpy=True)._value
        result = np.zeros_like(vectors)
        # Contexts that step in parallel do so in different threads, which keeps their forces apart.
        thread = threading.get_ident()
        if phase == FORCES:
            self._forces[thread] = np.array(vectors)
        elif phase == CONFIGURATION and thread in self._forces:
            flow = flow_from_values(tuple(parameters[name] for name in FLOW)) if parameters[FLOWS] else None
            if flow is not None and self._periodic:
                vectors = self._near_origin(vectors, flow, state.getPeriodicBoxVectors(asNumpy=True)._value)
            forces, start = self._forces.pop(thread), vectors
            self._displace(result, vectors, forces, parameters, state.getStepCount(), flow)
            if _RECORDER is not None:
                _RECORDER.record(int(parameters[STEPS_TAKEN]), start, forces, result, parameters[KT])
        return 0.0, result

    def _near_origin(self, positions, flow, box):
        # Images of chains, as a whole, and of other particles that are nearest to the origin of a flow.
        first, images = self._nodes[self._chains.start_of_chain], np.array(positions)
        shifts = to_nearest_images(positions[first] - flow.origin, box) + flow.origin - positions[first]
        images[self._nodes] += np.repeat(shifts, self._chains.node_counts, axis=0)
        images[self._others] = to_nearest_images(positions[self._others] - flow.origin, box) + flow.origin
        return images

    def _displace(self, result, positions, forces, parameters, step_count, flow):
        kT, step = parameters[KT], parameters[STEP_SIZE]
        steps_taken = int(parameters[STEPS_TAKEN])
        chains = self._chains
        parts = np.cumsum([chains.segment_count, chains.segment_count, len(self._others)])
        count = parts[-1] + (0 if chains.node_friction is None else chains.node_count)
        gaussian = _gaussian_vectors(int(parameters[SEED]), steps_taken, step_count, count)
        translational, rotational, other, nodal = np.split(gaussian, parts)
        advance = STEPS[EXPLICIT_SCHEMES[int(parameters[SCHEME])]]
        with np.errstate(all="ignore"):
            try:
                nodes = positions[self._nodes]
                displacements = advance(
                    chains, nodes, forces[self._nodes], kT, step, translational, rotational, flow, nodal
                )
            except InstabilityError:
                displacements = np.full((chains.node_count, 3), np.nan)
        self._check_chains(displacements, positions[self._nodes], forces[self._nodes], steps_taken)
        result[self._nodes] = displacements
        friction = self._frictions[:, None]
        result[self._others] = step / friction * forces[self._others] + np.sqrt(2.0 * kT * step / friction) * other
        if flow is not None:
            # The velocity half-way, so that particles keep to closed streamlines.
            start = positions[self._others]
            halfway = start + 0.5 * step * flow_velocities(flow, start)
            result[self._others] += step * flow_velocities(flow, halfway)
        self._check_others(result, steps_taken)

    def _check_chains(self, displacements, nodes, forces, steps_taken):
        broken = find_broken_segment(self._chains, self._rest_lengths, self._ranges, nodes, forces, displacements)
        if broken is None:
            return
        _raise_instability(
            f"{self._labels[broken.chain]} has blown up at segment {broken.segment} in step {steps_taken}: "
            f"{broken.what}. Positions are those before this step. Use a smaller time step, or look for overlapping "
            f"particles or excessive forces.{self._advice}",
            filament=broken.chain,
            segment=broken.segment,
            step=steps_taken,
        )

    def _check_others(self, result, steps_taken):
        broken = ~np.isfinite(result[self._others]).all(axis=1)
        if broken.any():
            particle = int(self._others[np.argmax(broken)])
            _raise_instability(
                f"Particle {particle}, outside filaments, has blown up in step {steps_taken}: "
                "the force on it is not finite. Use a smaller time step, or look for overlapping particles.",
                particle=particle,
                step=steps_taken,
            )


def _raise_instability(message, **place):
    error = InstabilityError(message, **place)
    note_raised_in_force(error)
    raise error


def _gaussian_vectors(seed, steps_taken, step_count, count):
    # Counter-based: the noise of a step depends on the seed and the step's number alone, not on the platform, on
    # other Contexts or on how the run was split. Steps are counted by a parameter, which a State without parameters
    # does not bring along, and by the Context, whose count users may set: with both, no noise comes twice.
    bits = np.random.Philox(key=[seed, 0], counter=[0, 0, steps_taken, step_count % 2**64])
    return np.random.Generator(bits).standard_normal((count, 3))


def add_redistribution(system, computation):
    """Give the System a PythonForce with a ChainDisplacements, in a force group of its own.

    An equal one that is there already is used again. One that differs stays, idle, because Contexts
    may be using it: OpenMM does not copy forces.

    Returns
    -------
    int
        The force group: the highest that no other force uses.

    Raises
    ------
    InputError
        If all 32 force groups are taken.
    """
    # A periodic PythonForce sees positions as they are stored. Otherwise, GPU platforms would shift the vectors that
    # are passed through the positions by the box vectors by which they have wrapped each molecule.
    periodic = is_periodic(system)
    fingerprint = f"{REDISTRIBUTION_NAME} {computation.fingerprint()} {'periodic' if periodic else 'open'}"
    taken = {}
    for force in system.getForces():
        if force.getName() == fingerprint:
            return force.getForceGroup()
        taken[force.getForceGroup()] = force
    free = [group for group in range(31, -1, -1) if group not in taken]
    if not free:
        raise InputError("The portable engine needs a force group of its own, but all 32 are in use: free one.")
    force = openmm.PythonForce(
        computation,
        {
            **{PHASE: IDLE, SCHEME: 0.0, KT: 0.0, STEP_SIZE: 0.0, SEED: 0.0, STEPS_TAKEN: 0.0, FLOWS: 0.0},
            **dict.fromkeys(FLOW, 0.0),
        },
    )
    force.setName(fingerprint)
    force.setForceGroup(free[0])
    force.setUsesPeriodicBoundaryConditions(periodic)
    system.addForce(force)
    return free[0]


def _is_redistribution(force):
    # By its parameters: XML files written by OpenMM 8.5 lose the names of PythonForces.
    return PHASE in parameters_of(force, PHASE)


def check_redistribution(system, group):
    """Raise InputError unless a force group of a System holds redistribution forces alone, which fit the System."""
    forces = [force for force in system.getForces() if force.getForceGroup() == group]
    if not any(_is_redistribution(force) for force in forces):
        raise InputError(
            f"The System has no filaments with an integrator in force group {group}: call Filaments.create_integrator."
        )
    for force in forces:
        if not _is_redistribution(force):
            raise InputError(
                f"Force {force.getName()!r} is in force group {group}, which the portable engine needs for itself: "
                "give it another group, or add it before the integrator is created."
            )
        if force.usesPeriodicBoundaryConditions() != is_periodic(system):
            raise InputError(
                "The System has become periodic since its filaments got an integrator: call "
                "Filaments.create_integrator after all forces have been added."
            )
