"""The integrator of the portable engine, a CustomIntegrator."""

import threading

import numpy as np
import openmm
from openmm import unit

from ..errors import InputError, instability_in_force, note_raised_in_force
from ..mechanics.flow import Flow, as_flow
from ..time_steps.schemes import EXPLICIT_SCHEMES, check_scheme
from ..time_steps.step_watch import ExplicitWork, WorkRecorder
from ..time_steps.time_step import as_step
from ..units.quantities import BOLTZMANN, TEMPERATURE, non_negative, whole_number
from .portable_displacements import (
    CONFIGURATION,
    FLOW,
    FLOWS,
    FORCES,
    IDLE,
    KT,
    PHASE,
    SCHEME,
    SEED,
    STEP_SIZE,
    STEPS_TAKEN,
    check_redistribution,
    flow_from_values,
    flow_to_values,
    recording,
)

# Variables of the integrator: their names must differ from those of the context parameters that they set.
_INTEGRATOR_KT = "cylinder_chain_integrator_kT"
_INTEGRATOR_SEED = "cylinder_chain_integrator_seed"
_INTEGRATOR_FLOWS = "cylinder_chain_integrator_flows"
_INTEGRATOR_FLOW = tuple(name.replace("chain_", "chain_integrator_") for name in FLOW)
_START = "cylinder_chain_start"

# CustomIntegrator draws from one random generator per process, which is not safe in two threads at once.
_STEPPING = threading.Lock()


def flow_of_integrator(integrator):
    """The Flow that an integrator knows of; at rest if it is none of this engine."""
    if not isinstance(integrator, openmm.CustomIntegrator):
        return Flow()
    names = {integrator.getGlobalVariableName(index) for index in range(integrator.getNumGlobalVariables())}
    if not names.issuperset(_INTEGRATOR_FLOW):
        return Flow()
    return flow_from_values(tuple(integrator.getGlobalVariableByName(name) for name in _INTEGRATOR_FLOW))


def _mobile_particles(system):
    return {index for index in range(system.getNumParticles()) if system.getParticleMass(index)._value != 0.0}


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
        check_redistribution(system, force_group)
        self._mobile = _mobile_particles(system)
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
            (SCHEME, str(scheme)),
            (KT, _INTEGRATOR_KT),
            (STEP_SIZE, "dt"),
            (SEED, _INTEGRATOR_SEED),
            (STEPS_TAKEN, f"{STEPS_TAKEN}+1"),
            (FLOWS, _INTEGRATOR_FLOWS),
        ):
            self.addComputeGlobal(parameter, value)
        self.beginIfBlock(f"{_INTEGRATOR_FLOWS} > 0")
        for parameter, value in zip(FLOW, _INTEGRATOR_FLOW):
            self.addComputeGlobal(parameter, value)
        self.endBlock()
        self.addComputePerDof(_START, "x")

        # Hand over the forces. The PythonForce answers zero.
        self.addComputePerDof("x", "f")
        self.addComputeGlobal(PHASE, str(FORCES))
        self.addComputePerDof("x", f"{_START}+{redistribution}")

        # Hand over the configuration. The PythonForce answers with displacements.
        self.addComputeGlobal(PHASE, str(CONFIGURATION))
        self.addComputePerDof("x", f"x+{redistribution}")
        self.addComputePerDof("v", f"(x-{_START})/dt")
        self.addConstrainPositions()
        self.addComputeGlobal(PHASE, str(IDLE))

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
            If forces added since the integrator was created stand in its way, or particles were added that can move.
        """
        if not self._checked:
            check_redistribution(self._system, self._force_group)
            self._refuse_late_particles()
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

    def _refuse_late_particles(self):
        late = _mobile_particles(self._system) - self._mobile
        if late:
            raise InputError(
                f"Particle {min(late)} can move, but has no friction coefficient: it was added, or was given a mass, "
                "after Filaments.create_integrator. Call that when the System is complete, with its particle_friction."
            )

    def _advance(self, steps, recorder):
        note_raised_in_force(None)
        with _STEPPING, recording(recorder):
            try:
                super().step(steps)
            except openmm.OpenMMException as error:
                instability = instability_in_force(error)
                if instability is None:
                    raise
                raise instability from None

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
        return flow_of_integrator(self)

    def setFlow(self, flow):
        """Set the Flow of the solvent; None brings it to rest."""
        flow = as_flow(flow)
        for name, value in zip(_INTEGRATOR_FLOW, flow_to_values(flow)):
            self.setGlobalVariableByName(name, value)
        self.setGlobalVariableByName(_INTEGRATOR_FLOWS, float(not flow.is_at_rest))
