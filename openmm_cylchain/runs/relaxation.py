"""Filaments that are drawn on top of each other come apart before a run begins."""

import math
from dataclasses import replace

import numpy as np
from openmm import Context, OpenMMException, Platform, unit

from ..couplings.capsule_contacts import as_capsule_contact_force
from ..couplings.contact_frames import find_contacts
from ..couplings.planar_crossings import find_planar_crossing
from ..errors import InputError, InstabilityError
from ..filaments.filaments_that_take_part import FilamentsThatTakePart
from ..kinetics.binding_force import find_binding_force, place_linkers
from ..output.progress import LateMessages, ProgressMessages
from ..systems.refused_context import refusal
from ..time_steps.coupled_step import mobilities, mobilities_of_ends
from ..time_steps.hard_contacts import longest_resolving_step
from ..units.quantities import thermal_energy
from .initial_state import box_vectors, build_system, contact_diameters

_COLD_TEMPERATURE = 1.0
_MOST_PUSHES, _LOOKED_AT, _JUDGED = 2000, 10, 100
"""Steps in the cold at most, after how many of them contacts are counted, and after how many what they have brought."""
_FARTHEST, _LEAST_GAIN = 0.2, 0.02
"""How far a push moves a place at most, in diameters, and the share of the energy that so many pushes take away."""
_LENGTHS = (32.0, 8.0, 4.0, 2.0, 1.0, 1.0, 1.0, 1.0)
"""Of pushes in turn, over the time in which the fastest contact comes apart; long ones spread what is dense."""
_LARGEST_ENERGY, _DEEPEST = 3.0, 0.5
"""Of a contact in k_B T, and how deep it is in shares of its diameter, where pushes end.

Steps at the temperature of the solvent bring back what is in equilibrium, and take long where contacts are deeper."""
_EXPLICIT_GROUP = 1
_COLD, _WARM = (1e-3, 1e-2, 0.1, 0.5), (0.1, 0.5, 1.0)
"""Lengths of steps with contacts in their equations, in those of the run or, where those are longer, in recommended
ones; in the cold only where planar filaments cross, which pushes do not take apart. Warm ones are as long as it takes
to have contacts for hard ones where the run does."""
_STEPS = 20
_BEYOND = 1.01
"""How long steps are that take contacts for hard ones, over the longest that do not."""
_MOST_SHIFTS, _SHIFT = 3, 0.1
"""How often a filament is shifted that does not come apart, and how far along each axis, in diameters of contacts."""
_LEAST_CHANCE, _MOST_ROUNDS = 3e-4, 100
"""Of the deepest contact, or as many steps follow again; and how often."""
_FULLEST = math.pi / math.sqrt(12.0)
"""Share of a box that cylinders fill at most."""
_ALL_STEPS = _MOST_PUSHES + _STEPS * len(_WARM)


def relaxed_positions(configuration, built, say=None, stop=None):
    """Positions in which a run begins: those of a BuiltSystem, or where contacts have pushed what overlapped.

    Linkers that begin bound near anchors are bound then, which a Context has that is made or initialised later.
    It takes steps without linkers. In the cold, contacts push with the forces of the start of each step, which is as
    long as these allow, until none has more than 3 k_B T, or more steps bring little; so filaments that lie on each
    other may go through each other. (Where planar filaments cross, 80 steps with contacts in their equations take the
    place of these.) 60 steps at the temperature of the solvent follow, with contacts in their equations, which are hard
    ones if those of the run are, and more as long as contacts are deeper than chance allows. A filament that would have
    to go through another one then is shifted by a tenth of a diameter, up to three times. The result depends on the
    configuration alone.

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
    text = "filaments that overlap come apart before the first step: {} of at most {} steps"
    return LateMessages(say, text, _ALL_STEPS)


def _begun(configuration, built, progress, stop):
    positions = _come_apart(configuration, built.positions, progress, stop, built.filaments)
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


def _come_apart(configuration, positions, progress, stop, begun, deleted=frozenset()):
    stop = stop or (lambda: None)
    settings, temperature = configuration.simulation, configuration.solvent.temperature
    alone = build_system(configuration, settings.engine, settings.seed, kinetics=False, begun=begun, deleted=deleted)
    diameters = contact_diameters(configuration, alone.filaments)
    _refuse_if_full(configuration, alone.filaments, diameters)
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
    box = None if configuration.box is None else box_vectors(configuration.box)
    pushes = _Pushes(alone, diameters, temperature, longest, max(settings.time_step, recommended.step), box)
    hard = _shortest_hard_step(settings, alone)
    reference = Platform.getPlatform("Reference")
    try:
        context = Context(alone.system, integrator, reference)
    except OpenMMException as error:
        raise refusal(error, alone.system, integrator, reference) from None

    def step(count=1):
        integrator.step(count)
        stop()
        if shift == 0:
            progress.one_is_done()

    for shift in range(_MOST_SHIFTS + 1):
        context.setPositions(positions)
        try:
            pushes.push(context, integrator, step)
            integrator.setTemperature(temperature)
            _take_steps(integrator, step, [max(length * longest, hard) for length in _WARM])
            integrator.setStepSize(max(recommended.step, hard))
            rounds = 0
            while rounds < _MOST_ROUNDS and _chance_of_deepest(pushes.contacts(context), temperature) < _LEAST_CHANCE:
                step(_STEPS)
                rounds += 1
            return context.getState(positions=True).getPositions(asNumpy=True)
        except (InstabilityError, OpenMMException) as error:
            number = getattr(error, "filament", None)
            if number is None or shift == _MOST_SHIFTS:
                raise InputError(
                    f"[contacts] filaments that overlap at first have not come apart: {error} Begin with fewer "
                    "filaments, with a smaller diameter or time_step, or set relax = false."
                ) from None
        diameter = diameters.get(number, alone.filaments[number].type.diameter)
        positions = _shifted(positions, alone.filaments, number, diameter, settings.seed, shift)
    return positions


def _shortest_hard_step(settings, alone):
    # Where the run takes contacts for hard ones, else 0: where many touch, steps that resolve them take far longer.
    forces = [own for own in map(as_capsule_contact_force, alone.system.getForces()) if own is not None]
    steps = [longest_resolving_step(alone.filaments, alone.system, own, alone.particle_friction) for own in forces]
    longest = _BEYOND * max(steps, default=math.inf)
    return longest if settings.scheme == "implicit" and settings.time_step >= longest else 0.0


class _Pushes:
    # Steps in which contacts push with the forces of the start: that they are many or deep costs no more.

    def __init__(self, alone, numbers, temperature, resolving, longest, box):
        self._temperature, self._box = temperature or _COLD_TEMPERATURE, box
        self._resolving, self._longest = resolving, longest
        self._touching = FilamentsThatTakePart(alone.filaments, numbers)
        forces = [as_capsule_contact_force(own) for own in alone.system.getForces()]
        self._forces = [own for own in forces if own is not None]
        self._smallest, self._mobilities = math.inf, []
        mobility = mobilities(alone.filaments, alone.system, alone.particle_friction)
        self._mobility = mobilities_of_ends(alone.filaments, mobility)
        for own in self._forces:
            own.setForceGroup(_EXPLICIT_GROUP)
            chains, spheres = range(own.getNumChains()), range(own.getNumSpheres())
            diameters = [own.getChainDiameter(i) for i in chains] + [own.getSphereDiameter(i) for i in spheres]
            self._smallest = min(self._smallest, *(value._value for value in diameters))
            of_chains = [self._mobility[list(own.getChainParticles(i))].max(initial=0.0) for i in chains]
            of_spheres = [self._mobility[own.getSphereParticle(i)] for i in spheres]
            self._mobilities.append((np.array([*of_chains, 0.0]), np.array([*of_spheres, 0.0])))

    def contacts(self, context):
        return [find_contacts(own, context) for own in self._forces]

    def push(self, context, integrator, step):
        """Take steps until contacts are shallow, or more would bring little."""
        begun = _positions(context)
        integrator.setTemperature(_COLD_TEMPERATURE)
        if find_planar_crossing(self._touching, self._box, begun) is not None:
            _take_steps(integrator, step, [length * self._resolving for length in _COLD])
            return
        integrator.setExplicitForceGroups(1 << _EXPLICIT_GROUP)
        before = math.inf
        for count in range(_MOST_PUSHES):
            if count % _LOOKED_AT == 0:
                contacts = self.contacts(context)
                if all(self._are_shallow(own) for own in contacts):
                    break
                rate = max(map(_fastest, contacts, self._mobilities))
            if count % _JUDGED == 0:
                energy = sum(float(_energies(own).sum()) for own in contacts)
                if energy > (1.0 - _LEAST_GAIN) * before:
                    break
                before = energy
            forces = context.getState(forces=True, groups={_EXPLICIT_GROUP}).getForces(asNumpy=True)._value
            speed = float((np.linalg.norm(forces, axis=1) * self._mobility).max())
            if speed == 0.0 or rate == 0.0:
                break
            own = _LENGTHS[count % len(_LENGTHS)] / rate
            integrator.setStepSize(min(self._longest, own, _FARTHEST * self._smallest / speed))
            step()
        integrator.setExplicitForceGroups(0)
        self._refuse_planar_crossings(_positions(context))

    def _are_shallow(self, contacts):
        # Where axes meet, a step does not know on which sides they are.
        depths = contacts.gaps / (contacts.gaps - contacts.distances)
        largest = _LARGEST_ENERGY * thermal_energy(self._temperature)
        return bool(np.all(depths < _DEEPEST) and np.all(_energies(contacts) < largest))

    def _refuse_planar_crossings(self, pushed):
        # The equations of later steps would keep them.
        found = find_planar_crossing(self._touching, self._box, pushed)
        if found is None:
            return
        number, other = (self._touching.numbers[one] for one in (found.filament, found.other_filament))
        kind = self._touching[found.other_filament].type
        raise InstabilityError(
            f"Filament {other} ({kind.name}) would be pushed through filament {number}.",
            filament=other,
            segment=found.other_segment,
        )


def _take_steps(integrator, step, lengths):
    for length in lengths:
        integrator.setStepSize(length)
        for _ in range(_STEPS):
            step()


def _positions(context):
    return context.getState(positions=True).getPositions(asNumpy=True)._value


def _fastest(contacts, mobilities):
    # How fast the fastest of contacts comes apart, or faster: the rows of their equations, in 1/ps.
    if len(contacts) == 0:
        return 0.0
    of_chains, of_spheres = mobilities
    chains, numbers = contacts.filaments, contacts.segments
    both = np.where(chains < 0, of_spheres[np.where(chains < 0, numbers, -1)], of_chains[chains])
    _, which = np.unique(np.stack([chains.ravel(), numbers.ravel()]), axis=1, return_inverse=True)
    which = which.reshape(chains.shape)
    stiffness = contacts.forces / np.where(contacts.gaps < 0.0, -contacts.gaps, math.inf)
    of_capsules = np.bincount(which.ravel(), np.repeat(stiffness, 2))
    return float((of_capsules[which] * both).sum(axis=1).max())


def _refuse_if_full(configuration, filaments, diameters):
    if configuration.box is None or not diameters:
        return
    there = [filaments[number] for number in diameters]
    lengths = np.array([np.linalg.norm(np.diff(own.positions, axis=0), axis=1).sum() for own in there])
    widths = np.array(list(diameters.values()))
    share, most = (lengths * widths**2).sum() * math.pi / 4.0 / math.prod(configuration.box), _FULLEST
    if all(own.planar for own in there):
        share, most = (lengths * widths).sum() / math.prod(configuration.box[:2]), 1.0
    if share > most:
        raise InputError(
            f"[contacts] filaments of up to {widths.max():g} nm would fill {100 * share:.0f} % of the box, in which "
            "they cannot come apart. Begin with fewer filaments or with a smaller diameter, or set relax = false."
        )


def _energies(contacts):
    return np.abs(0.5 * contacts.forces * contacts.gaps)


def _chance_of_deepest(contacts, temperature):
    # About that of one as deep among so many contacts.
    if temperature == 0.0 or not contacts:
        return 1.0
    energies = np.concatenate([_energies(own) for own in contacts])
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
