"""The compiled engine: a CylinderChainForce and a CylinderChainIntegrator from the plugin.

It is there on the platforms Reference and CPU, and on those for GPUs that gpu_platforms.py turns on.

Importing this module loads the plugin into OpenMM. An ImportError says why that cannot be done.
"""

from pathlib import Path

import numpy as np
import openmm

from ..engine_choice import why_openmm_differs
from ..errors import InputError, InstabilityError, instability_in_force, note_raised_in_force
from ..filaments.twist import has_twist
from ..kinetics.binding_force import find_binding_force, make_binding_force
from ..kinetics.growth_force import make_growth_force
from ..mechanics.flow import Flow, as_flow
from ..mechanics.potentials import BENDING_MODELS as ALL_BENDING_MODELS
from ..mechanics.potentials import STRETCHING_POTENTIALS
from ..time_steps.other_particles import describe_other_particles
from ..time_steps.precision import PRECISIONS as ALL_PRECISIONS
from ..time_steps.precision import check_precision
from ..time_steps.schemes import IMPLICIT_SCHEMES, check_scheme
from ..time_steps.schemes import SCHEMES as ALL_SCHEMES
from ..time_steps.step_watch import DividedSteps, ExplicitWork
from ..time_steps.time_step import as_step
from ..units.quantities import TEMPERATURE, non_negative, whole_number
from .compiled_twist import set_end_frame
from .description import (
    advice_after_blow_up,
    filament_label,
    fixed_nodes,
    friction_of_segments,
)
from .protocol import Engine


def _load_plugin():
    try:
        from .. import plugin_version  # noqa: F401
    except ModuleNotFoundError:
        raise ImportError(
            f"the package in {Path(__file__).parents[1]} has no compiled plugin. Install it with pip and a C++ "
            "compiler, without OPENMM_CYLCHAIN_PORTABLE, and run Python outside its source directory."
        ) from None
    reason = why_openmm_differs()
    if reason is not None:
        raise ImportError(f"{reason}.")
    from .. import plugin

    libraries = sorted(
        (Path(plugin._plugin.__file__).parent / "lib" / "plugins").glob("libOpenMMCylinderChainReference*")
    )
    if not libraries:
        raise ImportError("the installation lacks the plugin's libraries for OpenMM. Install openmm_cylchain again.")
    try:
        for library in libraries:
            openmm.Platform.loadPluginLibrary(str(library))
    except openmm.OpenMMException as error:
        raise ImportError(f"OpenMM cannot load the plugin: {error}") from None
    return plugin


plugin = _load_plugin()
CylinderChainForce = plugin.CylinderChainForce
CylinderChainIntegrator = plugin.CylinderChainIntegrator


def _numbers(of_plugin, of_package, what):
    """The numbers by which the plugin knows what the package has names for; ImportError if the names differ."""
    if set(of_plugin) != set(of_package):
        raise ImportError(
            f"the plugin has the {what} {', '.join(of_plugin)}, but the package {', '.join(of_package)}. "
            "Install openmm_cylchain again."
        )
    return {name: number for number, name in enumerate(of_plugin)}


BENDING_MODELS = _numbers(CylinderChainForce.getBendingModelNames(), ALL_BENDING_MODELS, "bending models")
STRETCHING_MODELS = _numbers(CylinderChainForce.getStretchingModelNames(), STRETCHING_POTENTIALS, "stretching models")
SCHEMES = _numbers(CylinderChainIntegrator.getSchemeNames(), ALL_SCHEMES, "schemes")
PRECISIONS = _numbers(CylinderChainIntegrator.getPrecisionNames(), ALL_PRECISIONS, "precisions")

# Of particles outside filaments, over their mass: each has a friction of its own, or a Context is refused.
_EACH_ITS_OWN = 0.0


class CompiledEngine(Engine):
    """The compiled engine: a CylinderChainForce and a CylinderChainIntegrator."""

    has_linkers = True
    has_growth = True
    has_beam_elements = True
    has_bodies = True
    has_twist = True

    def add_forces(self, system, placed, stretching_force_group, bending_force_group):
        """Add one CylinderChainForce, with one force group for stretching and bending."""
        if stretching_force_group != bending_force_group:
            raise InputError(
                "The compiled engine has one force for stretching and bending: give them the same force group. "
                "CylinderChainForce.computeEnergies tells their energies apart."
            )
        force = CylinderChainForce()
        force.setForceGroup(int(stretching_force_group))
        for number, (filament, nodes) in enumerate(zip(placed.filaments, placed.node_indices)):
            if filament.type.segment_kind.straight:
                _add_chain(force, filament, nodes, placed.viscosity, placed.temperature)
            else:
                controls = placed.control_point_indices[number]
                _add_beam_chain(force, filament, nodes, controls, placed.viscosity, placed.temperature)
            force.setChainName(number, filament_label(number, filament))
        for frame in placed.end_frames:
            set_end_frame(force, placed.filaments[frame.filament], frame, placed.bodies)
        for tether in placed.tethers:
            force.addTether(tether.filament, tether.node, openmm.Vec3(*tether.point), tether.stiffness)
        for body, particles in zip(placed.bodies, placed.body_indices):
            _add_body(force, body, particles, placed.viscosity)
        system.addForce(force)
        box = None
        if placed.periodic:
            box = np.array([vector._value for vector in system.getDefaultPeriodicBoxVectors()])
        if any(filament.growth is not None for filament in placed.filaments):
            system.addForce(make_growth_force(placed.filaments, placed.viscosity, placed.temperature, box))
        if placed.linkers:
            linkers, filaments = placed.linkers, placed.filaments
            settings = placed.temperature, placed.positions, box, placed.barriers
            system.addForce(make_binding_force(linkers, filaments, *settings))

    def create_integrator(self, system, placed, settings):
        """Create a NativeIntegrator."""
        fixed_nodes(system, placed)
        inside = np.concatenate([placed.nodes, *placed.body_indices])
        others, frictions = describe_other_particles(system, inside, settings.particle_friction)
        integrator = NativeIntegrator(
            settings.temperature,
            settings.step_size,
            settings.scheme,
            settings.random_seed,
            len(placed.filaments) + len(placed.bodies),
            settings.flow,
            advice_after_blow_up(system, placed.filaments),
            settings.checks,
            settings.precision,
        )
        for particle, friction in zip(others, frictions):
            integrator.setParticleFriction(int(particle), float(friction))
        linkers = find_binding_force(system)
        if linkers is not None:
            linkers.setTemperature(settings.temperature)
            linkers.setRandomNumberSeed(settings.random_seed)
        return integrator

    def flow_of(self, context):
        """The flow of the solvent in a Context, at rest where its integrator knows of none."""
        integrator = context.getIntegrator()
        if not CylinderChainIntegrator.isinstance(integrator):
            return Flow()
        return _flow_of_integrator(CylinderChainIntegrator.cast(integrator))

    def set_tethers(self, context, placed, tethers):
        """Give a Context other tethers, by their numbers."""
        for force in context.getSystem().getForces():
            if CylinderChainForce.isinstance(force):
                force = CylinderChainForce.cast(force)
                _set_tethers(force, tethers)
                force.updateParametersInContext(context)
                _set_tethers(force, {number: placed.tethers[number] for number in tethers})

    def record_tensions(self, context):
        """See ``NativeIntegrator.setRecordsTensions``."""
        _recording_integrator(context).setRecordsTensions(True)

    def mean_tensions(self, context, filaments):
        """Those of the last step that an implicit scheme has taken."""
        integrator = _recording_integrator(context)
        try:
            recorded = [CylinderChainIntegrator.getMeanTensions(integrator, chain) for chain in range(filaments)]
        except plugin.CylinderChainException as error:
            if error.kind != "nothing-recorded":
                raise
            raise InputError(
                "No mean tensions were recorded in the last step: call integrator.setRecordsTensions(True) before it "
                "is taken."
            ) from None
        return [
            (np.array(tensions._value), np.array(forces._value).reshape(-1, 3), np.array(directions).reshape(-1, 3))
            for tensions, forces, directions in recorded
        ]


ENGINE = CompiledEngine()


def _set_tethers(force, tethers):
    for number, tether in tethers.items():
        force.setTetherParameters(number, tether.filament, tether.node, openmm.Vec3(*tether.point), tether.stiffness)


def _flow_of_integrator(integrator):
    velocity, *gradient, origin = (tuple(vector._value) for vector in CylinderChainIntegrator.getFlow(integrator))
    return Flow(velocity, gradient, origin)


def _recording_integrator(context):
    integrator = context.getIntegrator()
    if not CylinderChainIntegrator.isinstance(integrator):
        raise InputError("The Context has no integrator of Filaments.create_integrator: it records no mean tensions.")
    integrator = CylinderChainIntegrator.cast(integrator)
    _refuse_unless_implicit(integrator.getScheme())
    return integrator


def _refuse_unless_implicit(scheme):
    if scheme not in (SCHEMES[name] for name in IMPLICIT_SCHEMES):
        raise InputError(
            "Mean tensions belong to the implicit schemes: the explicit schemes have those of the configuration alone "
            "(FilamentsInContext.joint_tensions)."
        )


def _add_chain(force, filament, nodes, viscosity, temperature):
    kind = filament.type
    friction = friction_of_segments(filament, viscosity, temperature)
    frictions = (friction.parallel, friction.perpendicular, friction.rotational, friction.extensional)
    extension = 0.0 if kind.maximum_extension is None else kind.maximum_extension
    chain = force.addChain(
        [int(node) for node in nodes],
        BENDING_MODELS[kind.bending_model],
        STRETCHING_MODELS[kind.stretching_model],
        kind.segment_length,
        kind.segment_stiffness,
        extension,
        kind.bending_stiffness,
        *frictions,
        filament.closed,
    )
    lengths = kind.segment_lengths(filament.segments, filament.closed)
    stiffnesses = kind.segment_stiffnesses(filament.segments, filament.closed)
    for segment in np.flatnonzero((lengths != kind.segment_length) | (stiffnesses != kind.segment_stiffness)):
        own = float(lengths[segment]), float(stiffnesses[segment])
        force.setSegmentParameters(chain, int(segment), *own, extension, *frictions)
    if kind.node_friction > 0.0:
        force.setChainNodeFriction(chain, kind.node_friction)
    force.setChainPlanar(chain, filament.planar)
    for segment in range(filament.segments if filament.propulsion else 0):
        force.setSegmentPropulsion(chain, segment, filament.propulsion)
    stiffnesses = filament.joint_stiffnesses
    for joint, stiffness in enumerate(stiffnesses):
        force.setJointParameters(chain, joint, float(stiffness))
    if has_twist(kind):
        of_joints = ([own] * len(stiffnesses) for own in (kind.twist_stiffness, kind.rest_twist))
        force.setChainTwist(chain, *of_joints, [kind.axial_friction(viscosity)] * filament.segments)
        force.setChainRestBends(chain, filament.components_of_rest_bends.ravel().tolist())


def _add_body(force, placed, particles, viscosity):
    body = placed.body
    # In a frame that is not tilted, planar ones turn about z.
    turn = placed.rotation if placed.planar else np.eye(3)
    rotational = turn @ body.rotational_friction(viscosity) @ turn.T
    force.addBody(
        [int(particle) for particle in particles],
        ((body.points - body.centre) @ turn.T).ravel().tolist(),
        body.friction(viscosity),
        rotational[np.triu_indices(3)].tolist(),
        placed.planar,
    )


def _add_beam_chain(force, filament, nodes, control_points, viscosity, temperature):
    element = filament.beam_element(temperature)
    friction = friction_of_segments(filament, viscosity, temperature)
    chain = force.addBeamChain(
        [int(particle) for pair in zip(nodes, control_points) for particle in pair],
        element.length,
        element.modulus,
        element.rigidity,
        element.shortening,
        friction.parallel / element.length,
        friction.perpendicular / element.length,
        filament.planar,
        filament.closed,
    )
    force.setBeamChainPropulsion(chain, filament.propulsion)


class NativeIntegrator(CylinderChainIntegrator):
    """A CylinderChainIntegrator that raises the errors of this package.

    Parameters
    ----------
    temperature : temperature
        Zero is allowed: no noise.
    step_size : time, or TimeStep
    scheme : {"implicit", "implicit-second-order", "midpoint", "euler"}
    random_seed : int
        0 draws a fresh seed for each Context.
    filaments : int
        How many there are, and bodies.
    flow : Flow, optional
        Of the solvent; at rest if not given.
    advice : str
        What else to say of a chain that has blown up.
    checks : bool
        Whether to look, while it runs, for signs of a step that is too long.
    precision : {"automatic", "mixed", "double"}
        As for ``Filaments.create_integrator``.

    Attributes
    ----------
    checks : bool

    Raises
    ------
    InputError
        For an unknown scheme or precision, a negative temperature or a step size that is not positive.
    """

    def __init__(
        self,
        temperature,
        step_size,
        scheme="implicit",
        random_seed=0,
        filaments=0,
        flow=None,
        advice="",
        checks=True,
        precision="automatic",
    ):
        temperature = non_negative(temperature, TEMPERATURE, "temperature")
        super().__init__(temperature, _EACH_ITS_OWN, as_step(step_size))
        self.checks = checks
        self._divided_steps = DividedSteps(filaments)
        self._work = ExplicitWork()
        check_scheme(scheme)
        check_precision(precision)
        self._advice = advice
        self.setScheme(SCHEMES[scheme])
        self.setPrecision(PRECISIONS[precision])
        self.setRandomNumberSeed(random_seed)
        self.setFlow(flow)

    def step(self, steps):
        """Advance by a number of steps.

        Warns
        -----
        TimeStepWarning
            Once, if more than one in a thousand steps of filaments had to be divided, and once if the work of explicit
            forces shows that the step is too long for them; see ``step_watch``.

        Raises
        ------
        InstabilityError
            If a chain, a particle or a FENE crosslink blows up; positions are then those before the failing step.
        TimeStepError
            If more than one in ten steps of filaments had to be divided, or if the step is far too long for the forces.
        InputError
            If a filament was torn because positions were wrapped into a periodic box, or if a segment of the positions
            that were set is longer or shorter than its FENE potential allows; if it is not known which crosslinks the
            Context has, because its State is from elsewhere.
        """
        steps = whole_number(steps, 0, "steps")
        if not self.checks:
            self.setWorkWindow(0)
            self._advance(steps)
            return
        while steps > 0:
            self.setWorkWindow(self._work.window)
            # A window at most is finished meanwhile.
            chunk = min(steps, self._work.window)
            before = self.getNumDividedSteps()
            self._advance(chunk)
            steps -= chunk
            self._divided_steps.add(chunk, self.getNumDividedSteps() - before)
            work, particle, window, particles = self.takeExplicitWork()
            if window:
                self._work.add(work, particle, window, particles)

    def setStepSize(self, size):
        """Set the time step: a time, or a TimeStep."""
        super().setStepSize(as_step(size))

    def _advance(self, steps):
        note_raised_in_force(None)
        try:
            super().step(steps)
        except plugin.CylinderChainException as error:
            raise self._error_of(error) from None
        except openmm.OpenMMException as error:
            instability = instability_in_force(error, self._advice)
            if instability is None:
                raise
            raise instability from None

    def _error_of(self, error):
        if error.kind == "torn-chain":
            return InputError(f"{error} (openmm_cylchain.make_whole).")
        if error.kind in ("length-out-of-range", "unknown-links", "element-too-long"):
            return InputError(f"{error}.")
        if error.kind in ("link-out-of-range", "unstable-chain", "unstable-particle"):
            names = ("segment", "other_segment", "particle", "link", "step")
            place = {name: getattr(error, name) for name in names}
            return InstabilityError(
                f"{error}{self._advice}", filament=error.chain, other_filament=error.other_chain, **place
            )
        return error

    def setRandomNumberSeed(self, seed):
        """Set the seed of the noise; 0 draws one for each Context that is created."""
        seed = whole_number(seed, 0, "random_seed")
        if seed >= 2**31:
            raise InputError(f"random_seed must be below 2^31, but is {seed}.")
        super().setRandomNumberSeed(seed)

    def setPathLevel(self, level):
        """Set the path level of the noise: that of two runs whose steps are h and h/2^level, at level 0 and at another
        level, is that of the same Brownian path, if their seeds are equal. It holds for Contexts created later.

        Raises
        ------
        InputError
            If it is not a whole number between 0 and ``getLargestPathLevel()``.
        """
        level, largest = whole_number(level, 0, "path level"), self.getLargestPathLevel()
        if level > largest:
            raise InputError(f"path level must be at most {largest}, but is {level}.")
        super().setPathLevel(level)

    def setRecordsTensions(self, records):
        """Set whether mean tensions are recorded, in the last step of each call of ``step``.

        ``mean_joint_tensions`` and ``mean_tensions`` of a FilamentsInContext return them. The last step takes about a
        third longer then.

        Raises
        ------
        InputError
            If the scheme is not "implicit".
        """
        if records:
            _refuse_unless_implicit(self.getScheme())
        super().setRecordsTensions(bool(records))

    def getFlow(self):
        """The Flow of the solvent."""
        return _flow_of_integrator(self)

    def setFlow(self, flow):
        """Set the Flow of the solvent; None brings it to rest."""
        flow = as_flow(flow)
        super().setFlow(*(openmm.Vec3(*vector) for vector in (flow.velocity, *flow.gradient, flow.origin)))
