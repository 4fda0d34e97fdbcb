"""The recommended step of filaments in a System, with all of its forces."""

from collections import Counter

import openmm

from ..couplings.capsule_contacts import as_capsule_contact_force, owners_of_chains
from ..couplings.contacts import default_stiffness, filament_diameters, is_contact_force
from ..errors import InputError
from ..filaments.attachments import BEAD_NAME
from ..filaments.collection import FilamentCollection
from ..mechanics.flow import Flow
from ..units.types import FloatArray, Numbers, Scalar
from .body_step import steps_of_bodies
from .buckling_step import steps_of_buckling
from .coupled_forces import CoupledForces
from .coupled_step import steps_of_couplings, steps_of_linked_contacts
from .explicit_forces import ExplicitForces
from .growth_step import kind_of_segments, steps_of_growth
from .kinetic_step import steps_of_kinetics
from .recommended_step import contact_diffusion_step, contact_time_step, recommended_time_step
from .schemes import IMPLICIT_SCHEMES, check_scheme
from .time_step import TimeStep, shortest


def recommended_step_of(
    filaments: FilamentCollection,
    scheme: str,
    contact_diameter: Numbers | None,
    contact_stiffness: Scalar | None,
    confidence: float,
    *,
    system: openmm.System | None,
    temperature: float,
    particle_friction: Numbers | None,
    flow: Flow,
) -> TimeStep:
    """The TimeStep of filaments and of the forces of their System; see ``Filaments.recommended_time_step``."""
    check_scheme(scheme)
    if not (len(filaments) or filaments.bodies):
        raise InputError("There are no filaments to recommend a time step for.")
    steps = _steps_of_types(filaments, scheme, temperature, flow)
    if contact_diameter is not None:
        steps.append(_step_of_contacts(filaments, contact_diameter, contact_stiffness, confidence))
    elif contact_stiffness is not None:
        raise InputError("A contact_stiffness needs a contact_diameter.")
    steps += steps_of_bodies(filaments, temperature)
    constant_forces: dict[int, FloatArray] = {}
    if system is not None:
        coupled = CoupledForces(system)
        coupled.refuse_in_two_stages(scheme)
        steps += _steps_of_diffusion(filaments, system, temperature, confidence, scheme, coupled)
        if scheme in IMPLICIT_SCHEMES:
            steps += steps_of_couplings(filaments, system, temperature, particle_friction, coupled)
        steps += steps_of_growth(filaments, system, particle_friction, coupled)
        steps += steps_of_kinetics(filaments, system, scheme, temperature, particle_friction)
        explicit = ExplicitForces(system, filaments, scheme, particle_friction, coupled)
        steps.append(explicit.recommended_step())
        constant_forces = explicit.constant_forces
    steps += steps_of_buckling(filaments, scheme, constant_forces)
    if system is not None and scheme == "implicit":
        longest = shortest(steps).step
        steps += steps_of_linked_contacts(filaments, system, particle_friction, coupled, longest)
    return shortest(steps)


def _steps_of_types(filaments, scheme, temperature, flow):
    # In the order of the filaments, so that the first of equals is named. Friction is that at the temperature of the
    # filaments, whatever that of the run is.
    solvent = filaments.viscosity, filaments.temperature
    return [
        recommended_time_step(
            kind,
            solvent[0],
            temperature,
            scheme,
            segments,
            closed,
            flow,
            kind.segment_friction(*solvent, segments),
            propulsion,
            longest,
        )
        for kind, segments, propulsion, longest, closed in dict.fromkeys(
            (*kind_of_segments(f), f.closed) for f in filaments
        )
    ]


def _step_of_contacts(filaments, diameter, stiffness, confidence):
    diameters = filament_diameters(diameter, len(filaments))
    if stiffness is None:
        if filaments.temperature == 0.0:
            raise InputError("At a temperature of zero, contacts need a contact_stiffness.")
        stiffness = default_stiffness(diameters.min(), filaments.temperature)
    solvent = filaments.viscosity, filaments.temperature
    beads = Counter(one.filament for one in filaments.attachments if one.name == BEAD_NAME)
    steps = []
    for number, (filament, d) in enumerate(zip(filaments, diameters)):
        density = max(1.0, beads[number] / filament.segments)
        steps.append(contact_time_step(filament.type, *solvent, d, stiffness, filament.segments, density, confidence))
    return shortest(steps)


def _steps_of_diffusion(filaments, system, temperature, confidence, scheme, coupled):
    # Of filaments that a contact force of the System keeps apart, unless it is in the equations of the step.
    found = {}
    for index, force in enumerate(system.getForces()):
        capsules = as_capsule_contact_force(force)
        if capsules is not None and not (scheme in IMPLICIT_SCHEMES and coupled.includes(index)):
            for chain, number in enumerate(owners_of_chains(capsules, filaments)):
                if number >= 0:
                    kind, segments = filaments[number].type, filaments[number].segments
                    found[kind, segments, capsules.getChainDiameter(chain)._value] = True
        if is_contact_force(force):
            for filament, beads in zip(filaments, filaments.bead_indices):
                diameter = force.getParticleParameters(int(beads[0]))[0] if len(beads) else 0.0
                if diameter > 0.0:
                    found[filament.type, filament.segments, diameter] = True
    return [
        contact_diffusion_step(
            kind,
            kind.segment_friction(filaments.viscosity, filaments.temperature, segments),
            temperature,
            diameter,
            confidence,
        )
        for kind, segments, diameter in found
    ]
