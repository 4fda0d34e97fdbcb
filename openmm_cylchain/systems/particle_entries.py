"""Entries of filaments in forces that ask for one of every particle: such as leave all else as it is.

Most such forces have parameters of a particle that does not interact. A CustomNonbondedForce and a CustomGBForce get a
parameter more, which their energies are asked by; energies of what was there stay as they are to the last digit.
"""

from collections import defaultdict
from collections.abc import Callable, Iterable, Sequence
from itertools import combinations

import numpy as np
import openmm

from ..couplings.crosslinks import Crosslinks
from ..couplings.periodicity import default_box, is_periodic
from ..engines.description import filament_label
from ..errors import InputError
from ..filaments.filament import Filament
from ..units.types import FloatArray

_TAKES_PART = "takes_part"
"""The parameter of the forces of an expression: 1 of particles that were there, 0 of filaments."""
_NO_QUADRUPOLE = [0.0] * 9
_PAIRS_EVERYWHERE = (
    "GBSAOBCForce",
    "GayBerneForce",
    "AmoebaMultipoleForce",
    "AmoebaWcaDispersionForce",
    "HippoNonbondedForce",
)
"""Forces that divide by the distance of all pairs, also of those that do not interact."""
_REFUSED = {
    "AmoebaGeneralizedKirkwoodForce": "nodes would push the solvent away in it",
    "ATMForce": "OpenMM does not let anybody change the forces within it",
}


def refuse_forces(
    system: openmm.System, positions: FloatArray, filaments: Sequence[Filament], may_coincide: bool
) -> None:
    """Raise InputError if filaments cannot have entries without interaction in a force of a System.

    Parameters
    ----------
    system : openmm.System
        Without the filaments.
    positions : (particles, 3) array
        In nm, of what is there.
    filaments : sequence of Filament
    may_coincide : bool
        Whether particles of filaments may be in one place, as beads at nodes and spare nodes are.
    """
    for index, force in enumerate(system.getForces()):
        for own in _with_those_within(force):
            label = f"{own.getName()} (force {index})"
            _refuse_force(own, label, may_coincide)
            count = _number_of_entries(own)
            if count not in (None, system.getNumParticles()):
                raise InputError(
                    f"{label} has entries for {count} particles, but the System has {system.getNumParticles()} "
                    "particles: complete it before filaments are added."
                )
            if count is not None:
                _refuse_same_places(system, positions, filaments, label)


def _refuse_force(force, label, may_coincide):
    kind = type(force).__name__
    if kind in _REFUSED:
        raise InputError(
            f"{label} has no entries for filaments that leave all else as it is, since {_REFUSED[kind]}. Add it to the "
            "System when the filaments are in it, with entries of your choice for their particles."
        )
    if kind == "GBSAOBCForce" and force.getSurfaceAreaEnergy()._value != 0.0:
        raise InputError(
            f"{label} would give nodes of filaments a surface energy. Set it to zero by setSurfaceAreaEnergy(0), or "
            "take the CustomGBForce that app.ForceField makes of 'implicit/obc2.xml'."
        )
    everywhere = kind in _PAIRS_EVERYWHERE or (kind == "CustomGBForce" and _has_pairs_without_exclusions(force))
    if may_coincide and everywhere:
        raise InputError(
            f"{label} divides by distances of all pairs, but beads, attachment points and spare nodes of filaments "
            "that grow may be where nodes are. Leave them out: capsule_contact_force and crosslinks need none."
        )


def _refuse_same_places(system, positions, filaments, label):
    # Nodes and particles that are there; control points are beside nodes. Of a filament that has not begun, one node.
    nodes = [own.positions[:1] if own.is_reserve else own.positions for own in filaments]
    places = np.concatenate([positions, *nodes])
    if is_periodic(system):
        places = np.round(places @ np.linalg.inv(default_box(system)), 9) % 1.0
    _, first, which = np.unique(np.round(places, 9), axis=0, return_index=True, return_inverse=True)
    found = np.flatnonzero(first[which.reshape(-1)] != np.arange(len(places)))
    found = found[found >= len(positions)]
    if not len(found):
        return
    owners = [(number, node) for number, own in enumerate(nodes) for node in range(len(own))]
    number, node = owners[found[0] - len(positions)]
    other = first[which.reshape(-1)[found[0]]]
    where = f"particle {other}"
    if other >= len(positions):
        where = "node {1} of filament {0}".format(*owners[other - len(positions)])
    raise InputError(
        f"{filament_label(number, filaments[number])}: node {node} is in the same place as {where}, but {label} "
        "divides by the distance of all particles, also of those that do not interact. Move one of them."
    )


def _has_pairs_without_exclusions(force):
    terms = [force.getComputedValueParameters(index)[2] for index in range(force.getNumComputedValues())]
    terms += [force.getEnergyTermParameters(index)[1] for index in range(force.getNumEnergyTerms())]
    return openmm.CustomGBForce.ParticlePairNoExclusions in terms


def add_noninteracting_entries(
    system: openmm.System, existing: int, positions: FloatArray, coinciding: Iterable[tuple[int, ...]]
) -> None:
    """Give forces that ask for an entry of every particle those of particles that do not interact.

    Parameters
    ----------
    system : openmm.System
    existing : int
        Number of particles that have entries; the others are of filaments.
    positions : (particles, 3) array
        In nm; of all particles, for forces with a reference structure.
    coinciding : tuples of int
        Particles of filaments that may all be in one place. Those of more than two are in no other one.
    """
    added = range(existing, system.getNumParticles())
    forces = [own for outer in system.getForces() for own in _with_those_within(outer)]
    groups = list(coinciding)
    for force in forces:
        kind = type(force).__name__
        if kind in _ENTRIES:
            _ENTRIES[kind](force, added)
        if kind in _EXCLUSIONS:
            # Particles in one place would give 0/0, even if they do not interact.
            _EXCLUSIONS[kind](force, groups)
        if kind in _OF_ALL_PARTICLES and existing and not Crosslinks.of_force(force) and not force.getParticles():
            force.setParticles(list(range(existing)))
        if kind in _WITH_REFERENCE:
            reference = [*force.getReferencePositions()._value, *(openmm.Vec3(*positions[i]) for i in added)]
            force.setReferencePositions(reference)


def _with_those_within(force):
    yield force
    if isinstance(force, openmm.CustomCVForce):
        for index in range(force.getNumCollectiveVariables()):
            yield from _with_those_within(force.getCollectiveVariable(index))


def _number_of_entries(force):
    if type(force).__name__ not in _ENTRIES:
        return None
    return force.getNumMultipoles() if isinstance(force, openmm.AmoebaMultipoleForce) else force.getNumParticles()


def _same_for_all(*entry, method="addParticle"):
    def add(force, added):
        for _ in added:
            getattr(force, method)(*entry)

    return add


def _add_to_custom_nonbonded(force, added):
    if force.getNumInteractionGroups():
        for _ in added:
            force.addParticle([0.0] * force.getNumPerParticleParameters())
        return
    # A group of those that were there would be all pairs of them on OpenMM's CPU platform, without a list of neighbors.
    name = _add_parameter(force, [force.getEnergyFunction()], added.start)
    force.setEnergyFunction(_zero_unless(f"{name}1*{name}2", force.getEnergyFunction()))
    _add_copies(force, added)


def _add_to_custom_gb(force, added):
    single = openmm.CustomGBForce.SingleParticle
    values = [force.getComputedValueParameters(index) for index in range(force.getNumComputedValues())]
    terms = [force.getEnergyTermParameters(index) for index in range(force.getNumEnergyTerms())]
    name = _add_parameter(force, [own[1] for own in values] + [own[0] for own in terms], added.start)
    for index, (value, expression, kind) in enumerate(values):
        if kind != single:
            force.setComputedValueParameters(index, value, _zero_unless(f"{name}1*{name}2", expression), kind)
    for index, (expression, kind) in enumerate(terms):
        condition = name if kind == single else f"{name}1*{name}2"
        force.setEnergyTermParameters(index, _zero_unless(condition, expression), kind)
    _add_copies(force, added)


def _add_parameter(force, expressions, count):
    # Of a name that no expression has.
    name, parameters = _TAKES_PART, range(force.getNumPerParticleParameters())
    taken = [*expressions, *(force.getPerParticleParameterName(index) for index in parameters)]
    while any(name in own for own in taken):
        name += "_"
    force.addPerParticleParameter(name)
    for particle in range(count):
        force.setParticleParameters(particle, [*force.getParticleParameters(particle), 1.0])
    return name


def _add_copies(force, added):
    # Parameters of the first particle, with which all expressions have a value.
    count = force.getNumPerParticleParameters()
    entry = [*force.getParticleParameters(0)[:-1], 0.0] if added.start else [0.0] * count
    for _ in added:
        force.addParticle(entry)


def _zero_unless(condition, expression):
    energy, semicolon, definitions = expression.partition(";")
    return f"select({condition}, {energy}, 0){semicolon}{definitions}"


def _add_to_many_particle(force, added):
    types = {force.getParticleParameters(index)[1] for index in range(added.start)} or {0}
    for index in range(force.getNumParticlesPerSet()):
        filtered = set(force.getTypeFilter(index))
        force.setTypeFilter(index, filtered or types)
        types |= filtered
    for _ in added:
        force.addParticle([0.0] * force.getNumPerParticleParameters(), max(types) + 1)


def _add_to_amoeba_vdw(force, added):
    entry = (force.addParticleType(1.0, 0.0),) if force.getUseParticleTypes() else (1.0, 0.0)
    for particle in added:
        # The scale of all interactions is zero, whatever the rule for epsilon.
        force.addParticle(particle, *entry, 1.0, False, 0.0)
        force.setParticleExclusions(particle, [particle])


def _pairs(groups):
    return (pair for group in groups for pair in combinations(group, 2))


def _excluding(add, exclude_bonded):
    # Spare nodes have so many pairs that OpenMM counts them out, as particles that are bonded to the same one.
    def exclude(force, groups):
        bonds = [(group[0], other) for group in groups if len(group) > 2 for other in group[1:]]
        if bonds:
            exclude_bonded(force, bonds)
        for pair in _pairs(group for group in groups if len(group) == 2):
            add(force, pair)

    return exclude


def _exclude_from_custom_gb(force, groups):
    for pair in _pairs(groups):
        force.addExclusion(*pair)


def _exclude_from_amoeba_vdw(force, groups):
    excluded = defaultdict(set)
    for group in groups:
        for particle in group:
            excluded[particle].update(group)
    for particle, others in excluded.items():
        force.setParticleExclusions(particle, sorted({*force.getParticleExclusions(particle), *others}))


_FREE_AXES = (openmm.AmoebaMultipoleForce.NoAxisType, -1, -1, -1)
_ENTRIES: dict[str, Callable[[openmm.Force, range], None]] = {
    "NonbondedForce": _same_for_all(0.0, 1.0, 0.0),
    "CustomNonbondedForce": _add_to_custom_nonbonded,
    "CustomGBForce": _add_to_custom_gb,
    "CustomManyParticleForce": _add_to_many_particle,
    "ConstantPotentialForce": _same_for_all(0.0),
    "GayBerneForce": _same_for_all(1.0, 0.0, -1, -1, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0),
    # Scale factors must be above zero: this one is lost beside any distance.
    "GBSAOBCForce": _same_for_all(0.0, 0.15, 1e-20),
    "LCPOForce": _same_for_all(0.0, 0.0, 0.0, 0.0, 0.0),
    "AmoebaMultipoleForce": _same_for_all(
        0.0, [0.0] * 3, _NO_QUADRUPOLE, *_FREE_AXES, 0.0, 0.0, 0.0, method="addMultipole"
    ),
    "AmoebaVdwForce": _add_to_amoeba_vdw,
    "AmoebaWcaDispersionForce": _same_for_all(0.0, 0.0),
    # Others transfer charge to it over the length 1/damping; energies are divided by polarizability.
    "HippoNonbondedForce": _same_for_all(
        0.0, [0.0] * 3, _NO_QUADRUPOLE, 0.0, 30.0, 0.0, 1e6, 0.0, 0.0, 0.0, 30.0, 1e-20, *_FREE_AXES
    ),
}
"""How to add entries of a range of particles to a force, by its class."""
_EXCLUSIONS: dict[str, Callable[[openmm.Force, list[tuple[int, ...]]], None]] = {
    "NonbondedForce": _excluding(
        lambda force, pair: force.addException(*pair, 0.0, 1.0, 0.0),
        lambda force, bonds: force.createExceptionsFromBonds(bonds, 0.0, 0.0),
    ),
    "ConstantPotentialForce": _excluding(
        lambda force, pair: force.addException(*pair, 0.0),
        lambda force, bonds: force.createExceptionsFromBonds(bonds, 0.0),
    ),
    "CustomNonbondedForce": _excluding(
        lambda force, pair: force.addExclusion(*pair),
        lambda force, bonds: force.createExclusionsFromBonds(bonds, 2),
    ),
    "CustomGBForce": _exclude_from_custom_gb,
    "AmoebaVdwForce": _exclude_from_amoeba_vdw,
}
_OF_ALL_PARTICLES = ("RGForce", "RMSDForce", "OrientationRestraintForce", "PythonForce")
"""Forces for which no particles are all of them: those that were there."""
_WITH_REFERENCE = ("RMSDForce", "OrientationRestraintForce")
