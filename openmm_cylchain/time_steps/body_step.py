"""The recommended step of rigid bodies: what is held off their centres turns little in a step, and so does twist."""

from typing import cast

import numpy as np

from ..filaments.collection import FilamentCollection
from ..filaments.filament_type import FilamentType
from ..units.quantities import thermal_energy
from .time_step import TimeStep

LARGEST_TURN = 0.05
"""D_r h, with the rotational diffusion of a body by itself, which leaves an error of 0.3 % in energies of links."""

LARGEST_TWIST = 0.05
"""(Stiffness) h/(friction), of joints to frames that a body carries: their twists have 0.25 % too much energy then."""


def steps_of_bodies(filaments: FilamentCollection, temperature: float) -> list[TimeStep]:
    """The TimeSteps of bodies with places off their centres, and of those that carry frames, one for each kind of body.

    A body without such places, such as a sphere, has none: nothing turns it but noise, which is right in any step.
    """
    kinds = {id(placed.body): (number, placed.body) for number, placed in reversed([*enumerate(filaments.bodies)])}
    return [
        _step_of(number, body, filaments.viscosity, temperature)
        for number, body in kinds.values()
        if temperature > 0.0 and body.has_places
    ] + _steps_of_twist(filaments)


def _steps_of_twist(filaments):
    stiffness: dict[int, float] = {}
    for frame in filaments.end_frames:
        if frame.body is not None:
            own = 2.0 * cast(FilamentType, filaments[frame.filament].type).twist_stiffness
            stiffness[frame.body] = stiffness.get(frame.body, 0.0) + own
    # Of each kind of body, the one with the stiffest frames.
    stiffest = {id(filaments.bodies[body].body): body for body in sorted(stiffness, key=stiffness.__getitem__)}
    return [_step_of_twist(number, filaments, stiffness[number]) for number in stiffest.values()]


def _least_friction(body, viscosity):
    return float(np.linalg.eigvalsh(body.rotational_friction(viscosity))[0])


def _step_of_twist(number, filaments, stiffness):
    body = filaments.bodies[number].body
    time = _least_friction(body, filaments.viscosity) / stiffness
    reason = f"twist turns body {number} ({body.name}) by {LARGEST_TWIST:g} of itself in a step"
    return TimeStep(LARGEST_TWIST * time, reason, {reason: time}, {reason: LARGEST_TWIST * time})


def _step_of(number, body, viscosity, temperature):
    friction = _least_friction(body, viscosity)
    time = friction / thermal_energy(temperature)
    reason = f"body {number} ({body.name}) turns, with D_r h = {LARGEST_TURN:g} in a step"
    return TimeStep(LARGEST_TURN * time, reason, {reason: time}, {reason: LARGEST_TURN * time})
