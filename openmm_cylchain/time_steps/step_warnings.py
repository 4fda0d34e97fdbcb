"""Warnings of a time step that is too long, before it is taken."""

import warnings
from collections.abc import Sequence

import openmm

from ..errors import TimeStepWarning
from ..filaments.chain_type import ChainType
from ..filaments.collection import FilamentCollection
from ..mechanics.flow import Flow
from ..mechanics.friction import SegmentFriction
from ..units.text import format_time
from ..units.types import Numbers, Scalar
from .buckling_step import steps_of_buckling
from .coupled_forces import CoupledForces
from .explicit_forces import ExplicitForces
from .growth_step import kind_of_segments, warn_if_growth_is_not_resolved
from .hard_contacts import warn_of_hard_contacts
from .kinetic_step import steps_of_hands
from .pulled_filaments import warn_of_pulled_filaments
from .recommended_step import fene_steps, recommended_time_step
from .schemes import EXPLICIT_SCHEMES, IMPLICIT_SCHEMES
from .stability import stability_bounds
from .time_step import IDLE, RECOMMENDED_STRAIN, TimeStep, as_step, strain_rate
from .winding_filaments import warn_of_winding_filaments

_LARGEST_STRAIN = 0.06
_LARGEST_ADVANCE = 0.5
_FAR_ABOVE = 4.0


def warn_of_long_step(
    filaments: FilamentCollection,
    system: openmm.System,
    step: float,
    scheme: str,
    temperature: float,
    particle_friction: Numbers | None,
    flow: Flow,
) -> None:
    """Warn (TimeStepWarning) of a step in ps that is too long for filaments, a flow or the forces of a System.

    And (SegmentLengthWarning) of segments that are too long for forces that pull them, (TwistWarning) of torques that
    these do not bear, and (ContactWarning) of contacts that the step takes for hard ones.
    """
    warn_if_strained(step, flow)
    solvent = filaments.viscosity, filaments.temperature
    kinds = dict.fromkeys((*kind_of_segments(f), f.closed) for f in filaments)
    for kind, segments, propulsion, longest, closed in kinds:
        warn_if_driven_far(kind, *solvent, step, segments, propulsion)
        if not warn_if_unstable(kind, *solvent, step, segments, scheme):
            friction = kind.segment_friction(*solvent, segments)
            warn_if_far_above(kind, solvent[0], temperature, step, segments, scheme, closed, friction, longest)
            warn_if_fene_is_wrong(kind, temperature, step, friction, scheme)
    coupled = CoupledForces(system)
    forces = ExplicitForces(system, filaments, scheme, particle_friction, coupled)
    forces.warn_if_too_stiff(step)
    warn_if_hands_are_not_resolved(system, step)
    warn_if_growth_is_not_resolved(filaments, system, step)
    warn_if_buckling_is_not_resolved(steps_of_buckling(filaments, scheme, forces.constant_forces), step)
    warn_of_pulled_filaments(filaments, temperature, forces.constant_forces)
    warn_of_winding_filaments(filaments, forces.constant_forces)
    warn_of_hard_contacts(filaments, system, step, scheme, particle_friction, coupled)


def warn_if_unstable(
    filament_type: ChainType,
    viscosity: Scalar,
    temperature: Scalar,
    step: Scalar | TimeStep,
    segments: int = 1,
    scheme: str = "midpoint",
) -> bool:
    """Issue a TimeStepWarning, naming the bound, if ``step`` exceeds a stability bound of an explicit scheme.

    Returns whether it does.
    """
    step = as_step(step, "time step")
    if scheme not in EXPLICIT_SCHEMES:
        return False
    unstable = False
    for name, bound in stability_bounds(filament_type, viscosity, temperature, segments).items():
        if step > bound:
            unstable = True
            recommended = recommended_time_step(filament_type, viscosity, temperature, scheme, segments)
            warnings.warn(
                f"A time step of {format_time(step, 4)} exceeds the {name} bound of {format_time(bound, 4)} of "
                f"filament type {filament_type.name!r}: the simulation will blow up. Recommended: {recommended}.",
                TimeStepWarning,
                stacklevel=4,
            )
    return unstable


def warn_if_far_above(
    filament_type: ChainType,
    viscosity: Scalar,
    temperature: Scalar,
    step: Scalar | TimeStep,
    segments: int = 1,
    scheme: str = "midpoint",
    closed: bool = False,
    friction: SegmentFriction | None = None,
    longest: int | None = None,
) -> None:
    """Issue a TimeStepWarning if ``step`` exceeds the recommended step of a chain by more than a factor of four.

    Not where nothing but the relaxation of lengths is left to resolve (see ``implicit_time_step``): whatever moves such
    a filament then is not the chain's own.
    """
    step = as_step(step, "time step")
    recommended = recommended_time_step(
        filament_type, viscosity, temperature, scheme, segments, closed, friction=friction, longest=longest
    )
    if step > _FAR_ABOVE * recommended.step and IDLE not in recommended.bounds:
        warnings.warn(
            f"A time step of {format_time(step, 4)} is {step / recommended.step:.3g} times as long as the recommended "
            f"one of filament type {filament_type.name!r} with {segments} segments. Recommended: {recommended}.",
            TimeStepWarning,
            stacklevel=4,
        )


def warn_if_fene_is_wrong(
    filament_type: ChainType, temperature: Scalar, step: Scalar | TimeStep, friction: SegmentFriction, scheme: str
) -> None:
    """Issue a TimeStepWarning if a step of an implicit scheme is between those that keep the energy of FENE lengths."""
    step = as_step(step, "time step")
    if filament_type.maximum_extension is None or scheme not in IMPLICIT_SCHEMES:
        return
    resolved, drawn = fene_steps(filament_type, friction, temperature)
    if 1.01 * resolved < step < 0.99 * drawn:
        warnings.warn(
            f"A time step of {format_time(step, 4)} neither resolves the lengths of filament type "
            f"{filament_type.name!r} within their FENE range nor is long enough to draw them anew: their energies are "
            f"too high. Use a step of at most {format_time(resolved, 4)}, or of at least {format_time(drawn, 4)} if "
            "the rest allows it.",
            TimeStepWarning,
            stacklevel=4,
        )


def warn_if_strained(step: Scalar | TimeStep, flow: Flow) -> None:
    """Issue a TimeStepWarning if a flow strains the solvent in a step by more than 0.06: by ``dt |gradient u|``."""
    step = as_step(step, "time step")
    strain = step * strain_rate(flow)
    if strain > _LARGEST_STRAIN:
        warnings.warn(
            f"In a time step of {format_time(step, 4)} the flow strains the solvent by {strain:.3g}: it is not "
            f"resolved. Use a step of at most {format_time(_LARGEST_STRAIN * step / strain, 4)}, or better "
            f"{format_time(RECOMMENDED_STRAIN * step / strain, 4)}.",
            TimeStepWarning,
            stacklevel=4,
        )


def warn_if_driven_far(
    filament_type: ChainType,
    viscosity: Scalar,
    temperature: Scalar,
    step: Scalar | TimeStep,
    segments: int = 1,
    propulsion: float = 0.0,
) -> None:
    """Issue a TimeStepWarning if self-propulsion takes a segment farther in a step than by half its length.

    Beyond ``dt F0/gamma_par = l0/2`` a bent filament cuts its corners.
    """
    step = as_step(step, "time step")
    friction = filament_type.segment_friction(viscosity, temperature, segments)
    advance = step * abs(propulsion) / friction.parallel / filament_type.segment_length
    if advance > _LARGEST_ADVANCE:
        warnings.warn(
            f"In a time step of {format_time(step, 4)} a propelled segment of filament type {filament_type.name!r} "
            f"advances by {advance:.3g} of its length: it is not resolved. Use a step of at most "
            f"{format_time(_LARGEST_ADVANCE * step / advance, 4)}.",
            TimeStepWarning,
            stacklevel=4,
        )


def warn_if_buckling_is_not_resolved(recommended: Sequence[TimeStep], step: Scalar | TimeStep) -> None:
    """Issue a TimeStepWarning if ``step`` exceeds one of ``steps_of_buckling`` by more than a factor of four."""
    step = as_step(step, "time step")
    for one in recommended:
        if step > _FAR_ABOVE * one.step:
            warnings.warn(
                f"A time step of {format_time(step, 4)} does not resolve how a filament buckles, which is too slow in "
                f"it. Recommended: {one}.",
                TimeStepWarning,
                stacklevel=4,
            )


def warn_if_hands_are_not_resolved(system: openmm.System, step: Scalar | TimeStep) -> None:
    """Issue a TimeStepWarning if ``step`` exceeds one of ``steps_of_hands`` by more than a factor of four."""
    step = as_step(step, "time step")
    for what, allowed in steps_of_hands(system).items():
        if step > _FAR_ABOVE * allowed:
            warnings.warn(
                f"A time step of {format_time(step, 4)} is {step / allowed:.3g} times as long as the recommended one "
                f"of linkers: {what} in {format_time(allowed, 4)}.",
                TimeStepWarning,
                stacklevel=4,
            )
