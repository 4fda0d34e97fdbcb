"""Filaments that are drawn on top of each other come apart before a run begins."""

import math
from dataclasses import replace

import numpy as np
from openmm import Context, OpenMMException, Platform, unit

from ..couplings.capsule_contacts import as_capsule_contact_force
from ..couplings.contact_frames import find_contacts
from ..errors import InputError, InstabilityError
from ..kinetics.binding_force import find_binding_force, place_linkers
from ..output.progress import LateMessages, ProgressMessages
from ..systems.refused_context import refusal
from ..units.quantities import thermal_energy
from .initial_state import box_vectors, build_system

# Lengths of steps in those of the run or, where those are longer, in recommended ones; first in the cold.
_COLD, _WARM = (1e-3, 1e-2, 0.1, 0.5), (0.1, 0.5, 1.0)
_STEPS = 20
_COLD_TEMPERATURE = 1.0
_MOST_SHIFTS, _SHIFT = 3, 0.1
"""How often a filament is shifted that does not come apart, and how far along each axis, in diameters of contacts."""
_LEAST_CHANCE, _MOST_ROUNDS = 3e-4, 100
"""Of the deepest contact, or as many steps follow again; and how often."""
_FULLEST = math.pi / math.sqrt(12.0)
"""Share of a box that cylinders fill at most."""
_ALL_STEPS = _STEPS * (len(_COLD) + len(_WARM))


def relaxed_positions(configuration, built, say=None, stop=None):
    """Positions in which a run begins: those of a BuiltSystem, or where contacts have pushed what overlapped.

    Linkers that begin bound near anchors are bound then, which a Context has that is made or initialised later.
    It takes 140 steps without linkers: in the cold, in steps that grow, and then at the temperature of the solvent; and
    more as long as contacts are deeper than chance allows. A filament that would have to go through another one is
    shifted by a tenth of a diameter, up to three times. The result depends on the configuration alone.

    Parameters
    ----------
    built : BuiltSystem
    say : callable (str), optional
        Told how far it is where it takes longer than two seconds; lines of standard error if not given.
    stop : callable (), optional
        Called after each step; what it raises ends the relaxation.

    Raises
    ------
    InputError
        If they do not come apart.
    """
    if not configuration.relaxes:
        return built.positions
    if say is not None:
        return _begun(configuration, built, _progress(say), stop)
    messages = ProgressMessages()
    try:
        return _begun(configuration, built, _progress(messages), stop)
    finally:
        messages.finish()


def _progress(say):
    return LateMessages(say, "filaments that overlap come apart before the first step: {} of {} steps", _ALL_STEPS)


def _begun(configuration, built, progress, stop):
    positions = _come_apart(configuration, built.positions, progress, stop)
    if any(own.bound and own.anchors is not None for own in configuration.linkers):
        _bind_linkers(configuration, built, positions._value)
    return positions


def _bind_linkers(configuration, built, positions):
    filaments = built.filaments
    nodes, controls = filaments.node_indices, filaments.control_point_indices
    moved = [
        replace(
            own,
            positions=positions[nodes[number][: len(own.positions)]],
            control_points=None if own.control_points is None else positions[controls[number]],
        )
        for number, own in enumerate(filaments)
    ]
    # Behind those of the configuration are those of branches.
    linkers = list(filaments.linkers)
    for number, group in enumerate(configuration.linkers):
        linkers[number] = replace(linkers[number], bound=group.bound)
    box = None if configuration.box is None else box_vectors(configuration.box)
    place_linkers(find_binding_force(built.system), linkers, moved, filaments.temperature, positions, box)


def relaxed_again(configuration, begun, positions, deleted, stop=None):
    """Positions in the midst of a run, as a quantity, where filaments that have come may overlap with others.

    ``begun`` are Filaments whose initial places are those of the run, ``deleted`` the numbers of those that have gone;
    ``stop`` is called after each step.
    """
    messages = ProgressMessages()
    try:
        return _come_apart(configuration, positions, _progress(messages), stop, begun, deleted)
    finally:
        messages.finish()


def _come_apart(configuration, positions, progress, stop, begun=None, deleted=frozenset()):
    stop = stop or (lambda: None)
    settings, temperature = configuration.simulation, configuration.solvent.temperature
    alone = build_system(configuration, settings.engine, settings.seed, kinetics=False, begun=begun, deleted=deleted)
    _refuse_if_full(configuration, alone.filaments)
    recommended = alone.filaments.recommended_time_step(settings.scheme, system=alone.system, **alone.arguments())
    longest = min(settings.time_step, recommended.step)
    integrator = alone.filaments.create_integrator(
        alone.system,
        longest,
        scheme=settings.scheme,
        random_seed=settings.seed,
        checks=False,
        precision="double",
        **alone.arguments(),
    )
    reference = Platform.getPlatform("Reference")
    try:
        context = Context(alone.system, integrator, reference)
    except OpenMMException as error:
        raise refusal(error, alone.system, integrator, reference) from None
    for shift in range(_MOST_SHIFTS + 1):
        context.setPositions(positions)
        try:
            for bath, lengths in ((_COLD_TEMPERATURE, _COLD), (temperature, _WARM)):
                integrator.setTemperature(bath)
                for length in lengths:
                    integrator.setStepSize(length * longest)
                    for _ in range(_STEPS):
                        integrator.step(1)
                        stop()
                        if shift == 0:
                            progress.one_is_done()
            integrator.setStepSize(recommended.step)
            rounds = 0
            while rounds < _MOST_ROUNDS and _chance_of_deepest(context, temperature) < _LEAST_CHANCE:
                integrator.step(_STEPS)
                stop()
                rounds += 1
            return context.getState(positions=True).getPositions(asNumpy=True)
        except (InstabilityError, OpenMMException) as error:
            number = getattr(error, "filament", None)
            if number is None or shift == _MOST_SHIFTS:
                raise InputError(
                    f"[contacts] filaments that overlap at first have not come apart: {error} Begin with fewer "
                    "filaments, with a smaller diameter or time_step, or set relax = false."
                ) from None
        positions = _shifted(positions, alone.filaments, number, configuration.contacts.diameter, settings.seed, shift)
    return positions


def _refuse_if_full(configuration, filaments):
    diameter = configuration.contacts.diameter
    if configuration.box is None or diameter is None:
        # Of bodies alone.
        return
    there = [own for own in filaments if own.takes_part]
    length = sum(float(np.linalg.norm(np.diff(own.positions, axis=0), axis=1).sum()) for own in there)
    share, most = length * math.pi * diameter**2 / 4.0 / math.prod(configuration.box), _FULLEST
    if all(own.planar for own in there):
        share, most = length * diameter / math.prod(configuration.box[:2]), 1.0
    if share > most:
        raise InputError(
            f"[contacts] filaments with a diameter of {diameter:g} nm would fill {100 * share:.0f} % of the box, in "
            "which they cannot come apart. Begin with fewer filaments or with a smaller diameter, or set relax = false."
        )


def _chance_of_deepest(context, temperature):
    # About that of one as deep among so many contacts.
    forces = [force for force in context.getSystem().getForces() if as_capsule_contact_force(force)]
    if temperature == 0.0 or not forces:
        return 1.0
    contacts = [find_contacts(force, context) for force in forces]
    energies = np.concatenate([np.abs(0.5 * own.forces * own.gaps) for own in contacts])
    return float(np.exp(-energies / thermal_energy(temperature)).min(initial=1.0) * max(len(energies), 1))


def _shifted(positions, filaments, number, diameter, seed, shift):
    # A filament whose axis goes through that of another one has no side to which it could be pushed.
    points = np.array(positions.value_in_unit(unit.nanometer))
    vector = np.random.default_rng([seed, number, shift]).normal(0.0, _SHIFT * diameter, 3)
    if filaments[number].planar:
        vector[2] = 0.0
    for indices in (filaments.node_indices[number], filaments.control_point_indices[number]):
        points[indices] += vector
    return points * unit.nanometer
