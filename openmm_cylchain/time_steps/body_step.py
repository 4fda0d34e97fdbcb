"""The recommended step of rigid bodies: what is held off their centres turns little in a step."""

import numpy as np

from ..filaments.collection import FilamentCollection
from ..units.quantities import thermal_energy
from .time_step import TimeStep

LARGEST_TURN = 0.05
"""D_r h, with the rotational diffusion of a body by itself, which leaves an error of 0.3 % in energies of links."""


def steps_of_bodies(filaments: FilamentCollection, temperature: float) -> list[TimeStep]:
    """The TimeSteps of bodies with places off their centres, one for each kind of body.

    A body without such places, such as a sphere, has none: nothing turns it but noise, which is right in any step.
    """
    kinds = {id(placed.body): (number, placed.body) for number, placed in reversed([*enumerate(filaments.bodies)])}
    return [
        _step_of(number, body, filaments.viscosity, temperature)
        for number, body in kinds.values()
        if temperature > 0.0 and body.has_places
    ]


def _step_of(number, body, viscosity, temperature):
    friction = float(np.linalg.eigvalsh(body.rotational_friction(viscosity))[0])
    time = friction / thermal_energy(temperature)
    reason = f"body {number} ({body.name}) turns, with D_r h = {LARGEST_TURN:g} in a step"
    return TimeStep(LARGEST_TURN * time, reason, {reason: time}, {reason: LARGEST_TURN * time})
