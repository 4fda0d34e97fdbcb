"""The recommended step of linkers that bind to filaments, walk along them and unbind.

Their equilibrium does not depend on the step. How fast things happen does, since filaments stand still while linkers
bind, walk and unbind, and linkers while filaments move:

- a hand should rarely unbind and bind again within a step: ``k dt`` is a fifth at most, with the rate k of unbinding,
  under the stall force if load changes it;
- a hand should walk by a fifth of its reach at most;
- a hand that walks against its spring relaxes towards its stall force with the rate k_s v/F_s, of which a step should
  take a fifth at most. Hands walk after all have bound and unbound, with the speed under the load at the start: a
  filament that follows then has the speed of theory up to k_s v dt/F_s = 1 (measured: within 0.2 % for gliding, also
  at ``k dt`` = 0.8 and where hands walk by more than their reach, and within 1.5 % near stall);
- a hand that slides relaxes its spring with the rate k_s/f, of which a step should take a tenth at most: it moves as
  far as the load at the start takes it, which is right where the filament follows at once, and relaxes a spring faster
  by k_s dt/(2 f) between what stands still;
- hands that bind to sites step between binding and unbinding, along filaments that stand still, which makes them
  slower by (k + k_s v/F_s) dt/2: both are a tenth at most (measured: 8 % slower at a fifth);
- a hand on a helix that a torque stops is slowed down by what it winds within a step: with the pitch p, the torque T_s
  at which it stops, and a filament of the torsional rigidity C that takes up the turns over the range R on both sides,
  the relative change is 4 pi C v dt/(p R T_s), a fifth at most;
- implicit steps lose the direction of a spring that has a rest length when its ends diffuse by that, as those of
  crosslinks: see ``coupled_step``.
"""

import numpy as np
import openmm

from ..filaments.collection import FilamentCollection
from ..kinetics.binding_force import find_binding_force
from ..units.quantities import thermal_energy
from ..units.types import FloatArray, Numbers
from .coupled_step import RELATIVE_MOTION, mobilities
from .schemes import IMPLICIT_SCHEMES
from .time_step import TimeStep

SHARE_OF_RATE = 0.2
"""The largest product of a step and a rate."""

SHARE_OF_RATE_ON_SITES = 0.1
"""The same of hands that bind to sites and walk."""

SHARE_OF_RELAXATION = 0.1
"""By how much a hand that slides relaxes its spring in a step."""

SHARE_OF_REACH = 0.2
"""How far a hand may walk in a step, over its reach."""


def steps_of_kinetics(
    filaments: FilamentCollection,
    system: openmm.System,
    scheme: str,
    temperature: float,
    particle_friction: Numbers | None = None,
) -> list[TimeStep]:
    """The TimeSteps of the linkers of a System; none where there are no linkers.

    Parameters
    ----------
    filaments : Filaments
        In the System.
    temperature : float
        Of the bath, in K.
    particle_friction
        As for ``create_integrator``.

    Returns
    -------
    list of TimeStep
        One for each type of linkers.
    """
    force = find_binding_force(system)
    if force is None:
        return []
    mobility = mobilities(filaments, system, particle_friction)
    # Of the two filaments that move most.
    largest = np.sort([mobility[nodes[0]] for nodes in filaments.node_indices])[::-1]
    steps = []
    for number in range(force.getNumLinkerTypes()):
        first, _, rest, _, _ = force.getLinkerTypeParameters(number)
        label = f"{force.getName()}: type {number}"
        allowed = _steps_of_type(force, number) | _steps_on_helix(filaments, force, number)
        if scheme in IMPLICIT_SCHEMES and rest > 0.0 and temperature > 0.0:
            together = _together(largest, first < 0)
            if together > 0.0:
                bound = rest**2 / (2.0 * thermal_energy(temperature) * together)
                allowed[f"{label}, its ends diffuse against each other by {RELATIVE_MOTION:g} of its rest length"] = (
                    RELATIVE_MOTION**2 * bound
                )
        if allowed:
            reason = min(allowed, key=allowed.__getitem__)
            bounds = {name: step / SHARE_OF_RATE for name, step in allowed.items()}
            steps.append(TimeStep(allowed[reason], reason, bounds, allowed))
    return steps


def steps_of_hands(system: openmm.System) -> dict[str, float]:
    """The steps, in ps, that binding, unbinding and walking of the linkers of a System allow, by what they are."""
    force = find_binding_force(system)
    kinds = range(0 if force is None else force.getNumLinkerTypes())
    return {name: step for number in kinds for name, step in _steps_of_type(force, number).items()}


def _steps_of_type(force, number):
    first, second, _, stiffness, _ = force.getLinkerTypeParameters(number)
    allowed: dict[str, float] = {}
    for hand in dict.fromkeys(hand for hand in (first, second) if hand >= 0):
        for what, step in _steps_of_hand(force, hand, stiffness):
            name = f"{force.getName()}: type {number}, {what}"
            allowed[name] = min(step, allowed.get(name, np.inf))
    return allowed


def _steps_on_helix(filaments, force, number):
    label = f"{force.getName()}: type {number}, what a hand winds in a step slows it down"
    rigidity = max((own.type.torsional_rigidity or 0.0 for own in filaments), default=0.0)
    allowed: dict[str, float] = {}
    for hand in force.getLinkerTypeParameters(number)[:2]:
        if hand < 0:
            continue
        pitch, _, stall, torque_range = force.getHandOnHelix(hand)
        speed = abs(force.getHandWalking(hand)[0])
        if pitch != 0.0 and stall > 0.0 and speed * rigidity > 0.0:
            step = SHARE_OF_RATE * abs(pitch) * torque_range * stall / (4.0 * np.pi * rigidity * speed)
            allowed[label] = min(step, allowed.get(label, np.inf))
    return allowed


def _together(largest: FloatArray, anchored: bool) -> float:
    return float(largest[0] if anchored or len(largest) == 1 else largest[0] + largest[1])


def _steps_of_hand(force, hand, stiffness):
    _, reach, unbinding = force.getHandParameters(hand)
    _, unbinding_force, catch, catch_force = force.getHandUnbinding(hand)
    speed, stall = force.getHandWalking(hand)[:2]
    on_sites = speed != 0.0 and force.getHandSiteSpacing(hand) > 0.0
    share = SHARE_OF_RATE_ON_SITES if on_sites else SHARE_OF_RATE
    rates = [unbinding + catch]
    if stall > 0.0 and unbinding_force > 0.0:
        rates.append(
            unbinding * np.exp(min(stall / unbinding_force, 500.0))
            + catch * (np.exp(-stall / catch_force) if catch_force > 0.0 else 1.0)
        )
    if max(rates) > 0.0:
        yield f"a hand unbinds with the rate {max(rates) * 1e12:.3g}/s", share / max(rates)
    friction = force.getHandSliding(hand)
    if friction > 0.0 and stiffness > 0.0:
        yield "a hand that slides relaxes its spring", SHARE_OF_RELAXATION * friction / stiffness
    if speed != 0.0:
        yield f"a hand walks by {SHARE_OF_REACH:g} of its reach", SHARE_OF_REACH * reach / abs(speed)
        if stall > 0.0 and stiffness > 0.0:
            rate = stiffness * abs(speed) / stall
            yield "a hand that walks relaxes to its stall force", share / rate
