"""The portable engine: stock OpenMM forces, a CustomIntegrator and one PythonForce.

It runs wherever OpenMM runs. Each step the integrator hands the total forces and then the
configuration to a PythonForce, in a force group of its own, *through the positions*; the PythonForce
returns displacements as "forces". A context parameter tells it what the positions hold; between steps
the parameter says "idle" and the PythonForce contributes nothing, so that reported forces and energies
are the physical ones.
"""

import hashlib
import pickle
import threading
from functools import lru_cache

import numpy as np
import openmm
from openmm import unit

from ..dynamics.other_particles import describe_other_particles
from ..dynamics.schemes import EXPLICIT_SCHEMES, check_scheme
from ..dynamics.step_watch import ExplicitWork, WorkRecorder
from ..dynamics.time_step import as_step
from ..errors import InputError, InstabilityError, instability_in_force, note_raised_in_force
from ..mechanics.broken_segment import find_broken_segment
from ..mechanics.flow import Flow, as_flow, flow_velocities
from ..mechanics.geometry import joined, to_nearest_images
from ..mechanics.potentials import BENDING_POTENTIALS, STRETCHING_POTENTIALS
from ..mechanics.redistribution import STEPS
from ..units.quantities import BOLTZMANN, TEMPERATURE, non_negative, whole_number
from .description import (
    advice_after_blow_up,
    describe_chains,
    describe_lengths,
    filament_label,
    refuse_constraints,
)
from .protocol import Engine

REDISTRIBUTION_NAME = "CylinderChainRedistribution"
STRETCHING_NAME = "CylinderChainStretching"
BENDING_NAME = "CylinderChainBending"
TETHER_NAME = "CylinderChainTethers"
PROPULSION_NAME = "CylinderChainPropulsion"

_IDLE, _FORCES, _CONFIGURATION = 0.0, 1.0, 2.0
_PHASE = "cylinder_chain_phase"
_SCHEME = "cylinder_chain_scheme"
_KT = "cylinder_chain_kT"
_STEP_SIZE = "cylinder_chain_step_size"
_SEED = "cylinder_chain_seed"
_STEPS_TAKEN = "cylinder_chain_steps_taken"
_INTEGRATOR_KT = "cylinder_chain_integrator_kT"
_INTEGRATOR_SEED = "cylinder_chain_integrator_seed"
_START = "cylinder_chain_start"
# Context parameters of the flow, which hold only while it flows; the integrator's variables have names of their own.
_FLOWS = "cylinder_chain_flows"
_INTEGRATOR_FLOWS = "cylinder_chain_integrator_flows"
_FLOW = tuple(
    f"cylinder_chain_flow_{name}"
    for name in (
        *("velocity_x", "velocity_y", "velocity_z", "origin_x", "origin_y", "origin_z"),
        *(f"gradient_{row}{column}" for row in "xyz" for column in "xyz"),
    )
)
_INTEGRATOR_FLOW = tuple(name.replace("chain_", "chain_integrator_") for name in _FLOW)

# CustomIntegrator draws from one random generator per process, which is not safe in two threads at once.
_STEPPING = threading.Lock()

# Of the integrator that is stepping, if it looks for steps that are too long.
_RECORDER = None


class PortableEngine(Engine):
    """The portable engine: stock OpenMM forces, a CustomIntegrator and a PythonForce, on every platform."""

    def add_forces(self, system, placed, stretching_force_group, bending_force_group):
        """Add a force for each model of stretching and bending; those of tethers and propulsion join stretching."""
        segments, joints = [], []
        for filament, indices in zip(placed.filaments, placed.node_indices):
            ends = [(int(indices[node - 1]), int(indices[node])) for node in range(1, len(indices))]
            ends += [(int(indices[-1]), int(indices[0]))] if filament.closed else []
            segments += [(filament.type, *pair) for pair in ends]
            pairs = zip(*joined(np.array(ends), filament.closed))
            for stiffness, (before, behind) in zip(filament.joint_stiffnesses, pairs):
                joints.append((filament.type, *map(int, (before[0], *behind)), stiffness))
        add_stretching_forces(system, segments, stretching_force_group)
        add_bending_forces(system, joints, bending_force_group)
        if any(filament.propulsion for filament in placed.filaments):
            add_propulsion(system, placed.filaments, placed.node_indices, stretching_force_group)
        if placed.tethers:
            add_tethers(system, placed, stretching_force_group)

    def create_integrator(self, system, placed, settings):
        """Create a PortableIntegrator, and the PythonForce that it needs."""
        if settings.precision == "mixed":
            raise InputError(
                "The portable engine computes filaments in double precision alone: use the compiled engine, or leave "
                "precision out."
            )
        refuse_constraints(system, placed)
        filaments = placed.filaments
        computation = ChainDisplacements(
            describe_chains(system, placed),
            placed.nodes,
            *describe_lengths(filaments),
            [filament_label(number, filament) for number, filament in enumerate(filaments)],
            *describe_other_particles(system, placed.nodes, settings.particle_friction),
            advice_after_blow_up(system),
            system.usesPeriodicBoundaryConditions(),
        )
        return PortableIntegrator(
            system,
            add_redistribution(system, computation),
            settings.temperature,
            settings.step_size,
            settings.scheme,
            settings.random_seed,
            settings.flow,
            settings.checks,
        )

    def flow_of(self, context):
        """The flow of the solvent in a Context, at rest where its integrator knows of none."""
        integrator = context.getIntegrator()
        if not isinstance(integrator, openmm.CustomIntegrator):
            return Flow()
        names = {integrator.getGlobalVariableName(index) for index in range(integrator.getNumGlobalVariables())}
        return _flow_from_variables(integrator) if names.issuperset(_INTEGRATOR_FLOW) else Flow()

    def set_tethers(self, context, placed, tethers):
        """Give a Context other tethers, by their numbers."""
        for force in context.getSystem().getForces():
            if force.getName() == TETHER_NAME:
                _set_tethers(force, placed, tethers)
                force.updateParametersInContext(context)
                _set_tethers(force, placed, {number: placed.tethers[number] for number in tethers})

    def record_tensions(self, context):
        """Refused: only the implicit schemes solve for tensions."""
        self.mean_tensions(context, 0)

    def mean_tensions(self, context, filaments):
        """Refused: only the implicit schemes solve for tensions."""
        raise InputError(
            "Mean tensions belong to the implicit schemes of the compiled engine: the portable engine has those of the "
            "configuration alone (Filaments.joint_tensions)."
        )


ENGINE = PortableEngine()


def add_tethers(system, placed, force_group):
    """Add one CustomExternalForce for all tethers."""
    force = openmm.CustomExternalForce("0.5*tether_stiffness*((x-tether_x)^2+(y-tether_y)^2+(z-tether_z)^2)")
    for name in ("tether_x", "tether_y", "tether_z", "tether_stiffness"):
        force.addPerParticleParameter(name)
    force.setName(TETHER_NAME)
    force.setForceGroup(force_group)
    for tether in placed.tethers:
        force.addParticle(int(placed.node_indices[tether.filament][tether.node]), [*tether.point, tether.stiffness])
    system.addForce(force)


def _set_tethers(force, placed, tethers):
    for number, tether in tethers.items():
        node = int(placed.node_indices[tether.filament][tether.node])
        force.setParticleParameters(number, node, [*tether.point, tether.stiffness])


def _flow_from_variables(integrator):
    return _flow_from_values(tuple(integrator.getGlobalVariableByName(name) for name in _INTEGRATOR_FLOW))


@lru_cache(maxsize=32)
def _flow_from_values(values):
    return Flow(values[:3], np.reshape(values[6:], (3, 3)), values[3:6])


def add_stretching_forces(system, segments, force_group):
    """Add one CustomBondForce for each stretching model in use.

    Parameters
    ----------
    system : openmm.System
    segments : iterable of (FilamentType, particle, particle)
    force_group : int
    """
    forces = {}
    for filament_type, minus, plus in segments:
        model = filament_type.stretching_model
        values = [filament_type.segment_stiffness, filament_type.segment_length]
        names = ["stretching_stiffness", "rest_length"]
        if filament_type.maximum_extension is not None:
            values.append(filament_type.maximum_extension)
            names.append("maximum_extension")
        if model not in forces:
            forces[model] = _named_force(
                openmm.CustomBondForce(STRETCHING_POTENTIALS[model].expression), STRETCHING_NAME, model, force_group
            )
            for name in names:
                forces[model].addPerBondParameter(name)
        forces[model].addBond(minus, plus, values)
    for force in forces.values():
        system.addForce(force)


def add_bending_forces(system, joints, force_group):
    """Add one CustomAngleForce for each bending model in use.

    Parameters
    ----------
    system : openmm.System
    joints : iterable of (FilamentType, particle, particle, particle, stiffness)
    force_group : int
    """
    forces = {}
    for filament_type, before, joint, after, stiffness in joints:
        if filament_type.bending_rigidity == 0.0:
            continue
        model = filament_type.bending_model
        if model not in forces:
            forces[model] = _named_force(
                openmm.CustomAngleForce(BENDING_POTENTIALS[model].expression), BENDING_NAME, model, force_group
            )
            forces[model].addPerAngleParameter("bending_stiffness")
        forces[model].addAngle(before, joint, after, [stiffness])
    for force in forces.values():
        system.addForce(force)


def add_propulsion(system, filaments, node_indices, force_group):
    """Add one PythonForce for all self-propelled filaments: no other kind of force may lack an energy."""
    minus, plus, propulsion = [], [], []
    for filament, indices in zip(filaments, node_indices):
        if filament.propulsion:
            minus.append(indices[: filament.segments])
            plus.append(np.roll(indices, -1)[: filament.segments])
            propulsion.append(np.full(filament.segments, filament.propulsion))
    force = openmm.PythonForce(Propulsion(*map(np.concatenate, (minus, plus, propulsion))))
    force.setName(PROPULSION_NAME)
    force.setForceGroup(force_group)
    system.addForce(force)


class Propulsion:
    """The computation of a PythonForce: a force F0 t on every segment of self-propelled filaments.

    Parameters
    ----------
    minus, plus : (segments,) int arrays
        Particle indices of the ends of the segments.
    propulsion : (segments,) array
        F0 in kJ/(mol nm).
    """

    def __init__(self, minus, plus, propulsion):
        self._minus = minus
        self._plus = plus
        self._propulsion = propulsion

    def __call__(self, state):
        positions = state.getPositions(asNumpy=True)._value
        vectors = positions[self._plus] - positions[self._minus]
        half = (0.5 * self._propulsion / np.linalg.norm(vectors, axis=1))[:, None] * vectors
        forces = np.zeros_like(positions)
        # A node is the minus end of one segment at most, and the plus end of one.
        forces[self._minus] += half
        forces[self._plus] += half
        return 0.0, forces


def _named_force(force, name, model, force_group):
    force.setName(f"{name} ({model})")
    force.setForceGroup(force_group)
    return force


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
        phase = parameters[_PHASE]
        vectors = state.getPositions(asNumpy=True)._value
        result = np.zeros_like(vectors)
        # Contexts that step in parallel do so in different threads, which keeps their forces apart.
        thread = threading.get_ident()
        if phase == _FORCES:
            self._forces[thread] = np.array(vectors)
        elif phase == _CONFIGURATION and thread in self._forces:
            flow = _flow_from_values(tuple(parameters[name] for name in _FLOW)) if parameters[_FLOWS] else None
            if flow is not None and self._periodic:
                vectors = self._near_origin(vectors, flow, state.getPeriodicBoxVectors(asNumpy=True)._value)
            forces, start = self._forces.pop(thread), vectors
            self._displace(result, vectors, forces, parameters, state.getStepCount(), flow)
            if _RECORDER is not None:
                _RECORDER.record(int(parameters[_STEPS_TAKEN]), start, forces, result, parameters[_KT])
        return 0.0, result

    def _near_origin(self, positions, flow, box):
        # Images of chains, as a whole, and of other particles that are nearest to the origin of a flow.
        first, images = self._nodes[self._chains.start_of_chain], np.array(positions)
        shifts = to_nearest_images(positions[first] - flow.origin, box) + flow.origin - positions[first]
        images[self._nodes] += np.repeat(shifts, self._chains.node_counts, axis=0)
        images[self._others] = to_nearest_images(positions[self._others] - flow.origin, box) + flow.origin
        return images

    def _displace(self, result, positions, forces, parameters, step_count, flow):
        kT, step = parameters[_KT], parameters[_STEP_SIZE]
        steps_taken = int(parameters[_STEPS_TAKEN])
        chains = self._chains
        count = 2 * chains.segment_count + len(self._others)
        gaussian = _gaussian_vectors(int(parameters[_SEED]), steps_taken, step_count, count)
        translational, rotational, other = np.split(gaussian, [chains.segment_count, 2 * chains.segment_count])
        advance = STEPS[EXPLICIT_SCHEMES[int(parameters[_SCHEME])]]
        with np.errstate(all="ignore"):
            try:
                displacements = advance(
                    chains, positions[self._nodes], forces[self._nodes], kT, step, translational, rotational, flow
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
            f"{broken.what}. "
            "Positions are those before this step. Use a smaller time step, or look for overlapping particles "
            f"or excessive forces.{self._advice}",
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
    periodic = system.usesPeriodicBoundaryConditions()
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
            **{_PHASE: _IDLE, _SCHEME: 0.0, _KT: 0.0, _STEP_SIZE: 0.0, _SEED: 0.0, _STEPS_TAKEN: 0.0, _FLOWS: 0.0},
            **dict.fromkeys(_FLOW, 0.0),
        },
    )
    force.setName(fingerprint)
    force.setForceGroup(free[0])
    force.setUsesPeriodicBoundaryConditions(periodic)
    system.addForce(force)
    return free[0]


def _is_redistribution(force):
    # By its parameters: XML files written by OpenMM 8.5 lose the names of PythonForces.
    return isinstance(force, openmm.PythonForce) and _PHASE in dict(force.getGlobalParameters())


def _check_redistribution(system, group):
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
        if force.usesPeriodicBoundaryConditions() != system.usesPeriodicBoundaryConditions():
            raise InputError(
                "The System has become periodic since its filaments got an integrator: call "
                "Filaments.create_integrator after all forces have been added."
            )


class PortableIntegrator(openmm.CustomIntegrator):
    """Brownian dynamics of filaments, and of all other particles, on any OpenMM platform.

    Weak order one in the step size. Scheme ``"midpoint"`` is Fixman's, with the right drift on chains;
    ``"euler"`` is Section 4 of Pesek et al., Soft Matter 2016, 12, 3360, kept for comparison: its drift
    is that of free segments, and equilibrium averages of chains are biased at any step size.

    Parameters
    ----------
    system : openmm.System
        With filaments.
    force_group : int
        Group of the redistribution force that ``Filaments.create_integrator`` has added to it.
    temperature : temperature
        Zero is allowed: no noise.
    step_size : time, or TimeStep
    scheme : {"midpoint", "euler"}
    random_seed : int
        0 draws a fresh seed from the operating system for this integrator.
    flow : Flow, optional
        Of the solvent; at rest if not given. Like the temperature, it is a variable of the integrator, which
        checkpoints and saved States carry along.
    checks : bool
        Whether to look, while it runs, for signs of a step that is too long.

    Attributes
    ----------
    checks : bool

    Notes
    -----
    The noise of a step depends on the seed, on the number of steps taken and on the step count of the
    Context, which checkpoints and saved States carry along. A restart from a checkpoint with the same seed is therefore
    bit-identical on the same platform; a restart with another seed is independent. Velocities are
    displacements divided by the step; there is no kinetic energy.

    Raises
    ------
    InputError
        For an unknown scheme, a negative temperature, a step size that is not positive, or a System
        without filaments.
    """

    def __init__(
        self,
        system,
        force_group,
        temperature,
        step_size,
        scheme="midpoint",
        random_seed=0,
        flow=None,
        checks=True,
    ):
        super().__init__(as_step(step_size))
        check_scheme(scheme)
        if scheme not in EXPLICIT_SCHEMES:
            raise InputError(
                f"The portable engine does not have scheme {scheme!r}: use the compiled engine, or one of "
                f"{', '.join(EXPLICIT_SCHEMES)}."
            )
        self._scheme = scheme
        self._system = system
        self._force_group = force_group
        self._checked = False
        self.checks = checks
        self._recorder = WorkRecorder()
        self._work = ExplicitWork()
        _check_redistribution(system, force_group)
        self.addGlobalVariable(_INTEGRATOR_KT, 0.0)
        self.addGlobalVariable(_INTEGRATOR_SEED, 0.0)
        for name in (_INTEGRATOR_FLOWS, *_INTEGRATOR_FLOW):
            self.addGlobalVariable(name, 0.0)
        self.addPerDofVariable(_START, 0.0)
        self._add_program(f"f{force_group}", EXPLICIT_SCHEMES.index(scheme))
        self.setKineticEnergyExpression("0")
        self.setIntegrationForceGroups(set(range(32)) - {force_group})
        self.setTemperature(temperature)
        self.setRandomNumberSeed(random_seed)
        self.setFlow(flow)

    def _add_program(self, redistribution, scheme):
        self.addUpdateContextState()
        for parameter, value in (
            (_SCHEME, str(scheme)),
            (_KT, _INTEGRATOR_KT),
            (_STEP_SIZE, "dt"),
            (_SEED, _INTEGRATOR_SEED),
            (_STEPS_TAKEN, f"{_STEPS_TAKEN}+1"),
            (_FLOWS, _INTEGRATOR_FLOWS),
        ):
            self.addComputeGlobal(parameter, value)
        self.beginIfBlock(f"{_INTEGRATOR_FLOWS} > 0")
        for parameter, value in zip(_FLOW, _INTEGRATOR_FLOW):
            self.addComputeGlobal(parameter, value)
        self.endBlock()
        self.addComputePerDof(_START, "x")

        # Hand over the forces. The PythonForce answers zero.
        self.addComputePerDof("x", "f")
        self.addComputeGlobal(_PHASE, str(_FORCES))
        self.addComputePerDof("x", f"{_START}+{redistribution}")

        # Hand over the configuration. The PythonForce answers with displacements.
        self.addComputeGlobal(_PHASE, str(_CONFIGURATION))
        self.addComputePerDof("x", f"x+{redistribution}")
        self.addComputePerDof("v", f"(x-{_START})/dt")
        self.addConstrainPositions()
        self.addComputeGlobal(_PHASE, str(_IDLE))

    def step(self, steps):
        """Advance by a number of steps.

        Integrators may be stepped from different threads, but take turns: use processes to run in parallel.

        Warns
        -----
        TimeStepWarning
            Once, if the work of forces shows that the step is too long for them; see ``step_watch``.

        Raises
        ------
        InstabilityError
            If a chain or a particle blows up; positions are then those before the failing step.
        TimeStepError
            If the step is far too long for the forces.
        InputError
            If forces added since the integrator was created stand in its way.
        """
        if not self._checked:
            _check_redistribution(self._system, self._force_group)
            self._checked = True
        # States and checkpoints carry variables of the integrator that wrote them; the seed is this one's own.
        if self.getGlobalVariableByName(_INTEGRATOR_SEED) != self._key:
            self.setGlobalVariableByName(_INTEGRATOR_SEED, self._key)
        steps = whole_number(steps, 0, "steps")
        if not self.checks:
            self._advance(steps, None)
            return
        while steps > 0:
            self._recorder.window = self._work.window
            # A window at most is finished meanwhile.
            chunk = min(steps, self._recorder.window)
            self._advance(chunk, self._recorder)
            steps -= chunk
            work = self._recorder.take()
            if work is not None:
                # Written so that NaN is the largest.
                worst = int(np.argmax(work))
                self._work.add(float(work[worst]), worst, self._recorder.window, np.count_nonzero(work))

    def setStepSize(self, size):
        """Set the time step: a time, or a TimeStep."""
        super().setStepSize(as_step(size))

    def _advance(self, steps, recorder):
        global _RECORDER
        with _STEPPING:
            _RECORDER = recorder
            try:
                super().step(steps)
            except openmm.OpenMMException as error:
                instability = instability_in_force(error)
                if instability is None:
                    raise
                raise instability from None
            finally:
                _RECORDER = None

    def getScheme(self):
        """The name of the integration scheme."""
        return self._scheme

    def getTemperature(self):
        """The temperature of the bath (kelvin)."""
        return self.getGlobalVariableByName(_INTEGRATOR_KT) / BOLTZMANN * unit.kelvin

    def setTemperature(self, temperature):
        """Set the temperature of the bath. Friction coefficients stay as they are."""
        value = BOLTZMANN * non_negative(temperature, TEMPERATURE, "temperature")
        self.setGlobalVariableByName(_INTEGRATOR_KT, value)

    def computeSystemTemperature(self):
        """The temperature of the bath: overdamped motion has no temperature of its own."""
        return self.getTemperature()

    def setRandomNumberSeed(self, seed):
        """Set the seed of the noise; 0 draws one from the operating system."""
        seed = whole_number(seed, 0, "random_seed")
        if seed >= 2**31:
            raise InputError(f"random_seed must be below 2^31, but is {seed}.")
        super().setRandomNumberSeed(seed)
        self._key = float(seed if seed else np.random.SeedSequence().generate_state(1)[0])
        self.setGlobalVariableByName(_INTEGRATOR_SEED, self._key)

    def getFlow(self):
        """The Flow of the solvent."""
        return _flow_from_variables(self)

    def setFlow(self, flow):
        """Set the Flow of the solvent; None brings it to rest."""
        flow = as_flow(flow)
        for name, value in zip(_INTEGRATOR_FLOW, (*flow.velocity, *flow.origin, *np.ravel(flow.gradient).tolist())):
            self.setGlobalVariableByName(name, value)
        self.setGlobalVariableByName(_INTEGRATOR_FLOWS, float(not flow.is_at_rest))
