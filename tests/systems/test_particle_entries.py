"""Forces that ask for an entry of every particle: filaments join them and change nothing else, or they are refused."""

import itertools
import re

import numpy as np
import openmm
import pytest
from openmm import app

from openmm_cylchain import ACTIN_ATP, DSDNA, F_ACTIN, Filaments, Growth, InputError
from support.contexts import new_context
from support.solvent import VISCOSITY

CHARGES = (0.5, -0.5, 0.3, -0.3, 0.2, -0.2)
COUNT = len(CHARGES)
POSITIONS = np.array([[0, 0, 0], [0.2, 0, 0], [0, 0.22, 0], [0.1, 0.1, 0.25], [0.4, 0.1, 0.1], [0.3, 0.35, 0]])
# Closer to all of them than they are to each other.
NODES = np.array([[0.02, 0.03, -0.05], [0.25, 0.18, 0.08], [0.05, 0.0, 0.12]])
QUADRUPOLE = [0.001, 0, 0, 0, 0.001, 0, 0, 0, -0.002]
FREE = (openmm.AmoebaMultipoleForce.NoAxisType, -1, -1, -1)
GROUP, CHAIN_GROUP = 1, 2


def with_entries(force, *entry, of_charges=False):
    for charge in CHARGES:
        force.addParticle(*((charge,) if of_charges else ()), *entry)
    return force


def nonbonded():
    return with_entries(openmm.NonbondedForce(), 0.2, 0.5, of_charges=True)


def custom_nonbonded():
    # Divided by a parameter: a node with a zero there would be infinite.
    force = openmm.CustomNonbondedForce("q1*q2*exp(-r/a)/r/w; w = w1*w2; a = 0.3")
    for name in "qw":
        force.addPerParticleParameter(name)
    for charge in CHARGES:
        force.addParticle([charge, 2.0])
    return force


def generalized_born(surface):
    from openmm.app.internal.customgbforces import GBSAGBn2Force, GBSAOBC2Force

    force = GBSAOBC2Force(SA="ACE") if surface else GBSAGBn2Force()
    for charge in CHARGES:
        force.addParticle([charge, 0.15, 0.8, *(() if surface else (1.0, 0.8, 4.85))])
    force.finalize()
    return force


def many_particle(filtered):
    force = openmm.CustomManyParticleForce(3, "exp(-distance(p1,p2)-distance(p2,p3))*c1")
    force.addPerParticleParameter("c")
    for index, charge in enumerate(CHARGES):
        force.addParticle([charge], index % 2)
    if filtered:
        force.setTypeFilter(0, {0})
    return force


def gay_berne():
    force = openmm.GayBerneForce()
    for index in range(COUNT):
        axes = (1, 2) if index == 0 else (-1, -1)
        force.addParticle(0.2, 1.0, *axes, *((0.3, 0.2, 0.25) if index == 0 else (0.2, 0.2, 0.2)), 1.0, 1.0, 1.0)
    return force


def multipoles():
    force = openmm.AmoebaMultipoleForce()
    force.setMutualInducedMaxIterations(200)
    for charge in CHARGES:
        force.addMultipole(charge, [0.01, 0, 0.02], QUADRUPOLE, *FREE, 0.39, 0.3, 0.0008)
    return force


def amoeba_vdw(types=False, rule="HHG"):
    force = openmm.AmoebaVdwForce()
    force.setEpsilonCombiningRule(rule)
    if types:
        force.addParticleType(0.2, 0.5)
    for index in range(COUNT):
        force.addParticle(index, *((0,) if types else (0.2, 0.5)), 0.9)
        force.setParticleExclusions(index, [index])
    return force


def hippo():
    force = openmm.HippoNonbondedForce()
    for charge in CHARGES:
        damped = (1.0, 30.0, 1000.0, 30.0, 0.01, 1.0, 1.0, 30.0, 0.001)
        force.addParticle(charge, [0.01, 0, 0.02], QUADRUPOLE, *damped, *FREE)
    return force


def within(force):
    collective = openmm.CustomCVForce("a + a^2/1000")
    collective.addCollectiveVariable("a", force)
    return collective


def harmonic(state):
    positions = state.getPositions(asNumpy=True)._value
    return 0.5 * np.sum(positions**2), -positions


REFERENCE = [openmm.Vec3(*place) for place in 1.1 * POSITIONS + [0, 0, 0.1] * POSITIONS[:, :1]]
FORCES = {
    "NonbondedForce": nonbonded,
    "CustomNonbondedForce": custom_nonbonded,
    "CustomGBForce, OBC2": lambda: generalized_born(True),
    "CustomGBForce, GBn2": lambda: generalized_born(False),
    "CustomManyParticleForce": lambda: many_particle(False),
    "CustomManyParticleForce, filtered": lambda: many_particle(True),
    "GayBerneForce": gay_berne,
    "LCPOForce": lambda: with_entries(openmm.LCPOForce(), 0.3, 0.5, -0.1, -0.01, 0.02),
    "AmoebaMultipoleForce": multipoles,
    "AmoebaVdwForce": amoeba_vdw,
    "AmoebaVdwForce, types": lambda: amoeba_vdw(True),
    "AmoebaVdwForce, arithmetic": lambda: amoeba_vdw(False, "ARITHMETIC"),
    "AmoebaWcaDispersionForce": lambda: with_entries(openmm.AmoebaWcaDispersionForce(), 0.15, 0.4),
    "HippoNonbondedForce": hippo,
    "CustomCVForce": lambda: within(nonbonded()),
    "RMSDForce": lambda: openmm.RMSDForce(REFERENCE),
    "OrientationRestraintForce": lambda: openmm.OrientationRestraintForce(100.0, REFERENCE),
    "RGForce": lambda: openmm.RGForce(),
    "PythonForce": lambda: openmm.PythonForce(harmonic),
}
# Older versions of OpenMM have fewer.
FORCES = {name: make for name, make in FORCES.items() if hasattr(openmm, name.partition(",")[0])}


def without_surface():
    force = with_entries(openmm.GBSAOBCForce(), 0.15, 0.8, of_charges=True)
    force.setSurfaceAreaEnergy(0.0)
    return force


FORCES["GBSAOBCForce"] = without_surface


def system_with(force):
    topology, system = app.Topology(), openmm.System()
    chain = topology.addChain("X")
    for _ in range(COUNT):
        system.addParticle(12.0)
        topology.addAtom("C", None, topology.addResidue("X", chain))
    force.setForceGroup(GROUP)
    system.addForce(force)
    return topology, system


def with_filament(topology, system, beads=None):
    filaments = Filaments(VISCOSITY, 300.0)
    filaments.add_nodes(DSDNA, NODES)
    if beads:
        filaments.add_beads(0, beads)
    return filaments.add_to(topology, system, POSITIONS, CHAIN_GROUP, CHAIN_GROUP)


def forces_and_energy(system, positions, platform):
    state = new_context(system, positions, platform=platform).getState(forces=True, energy=True, groups={GROUP})
    return state.getForces(asNumpy=True)._value, state.getPotentialEnergy()._value


def assert_nothing_changes(make, platform, beads=None, tolerance=1e-11):
    topology, system = system_with(make())
    forces, energy = forces_and_energy(system, POSITIONS, platform)
    everything = with_filament(topology, system, beads)
    new_forces, new_energy = forces_and_energy(system, everything, platform)
    scale = np.abs(forces).max()
    assert scale > 1e-3
    np.testing.assert_allclose(new_forces[:COUNT], forces, rtol=0, atol=tolerance * scale)
    assert np.abs(new_forces[COUNT:]).max() <= tolerance * scale
    assert new_energy == pytest.approx(energy, rel=tolerance)


@pytest.mark.parametrize("name", FORCES)
def test_forces_and_energies_of_what_was_there_do_not_change(name, reference):
    assert_nothing_changes(FORCES[name], reference)


@pytest.mark.parametrize("name", ["CustomNonbondedForce", "CustomGBForce, OBC2", "GBSAOBCForce"])
def test_on_the_cpu_platform_they_do_not_change_either(name):
    assert_nothing_changes(FORCES[name], openmm.Platform.getPlatform("CPU"), tolerance=1e-5)


@pytest.mark.parametrize(
    "name",
    sorted(
        FORCES.keys()
        & {"NonbondedForce", "CustomNonbondedForce", "CustomManyParticleForce", "AmoebaVdwForce", "LCPOForce"}
    ),
)
def test_beads_may_be_where_nodes_are(name, reference):
    assert_nothing_changes(FORCES[name], reference, beads=4.0)


@pytest.mark.parametrize("name", ["CustomGBForce, OBC2", "AmoebaMultipoleForce", "GBSAOBCForce", "HippoNonbondedForce"])
def test_forces_without_exclusions_are_refused_beside_beads(name):
    topology, system = system_with(FORCES[name]())
    with pytest.raises(InputError, match="beads, attachment points and spare nodes of filaments that grow may be"):
        with_filament(topology, system, beads=4.0)


def constant_potential():
    return with_entries(openmm.ConstantPotentialForce(), of_charges=True)


@pytest.mark.skipif(not hasattr(openmm, "ConstantPotentialForce"), reason="OpenMM before 8.4 has none")
def test_electrodes(reference):
    # It has periodic boundaries always.
    topology, system = system_with(constant_potential())
    box = 3.0 * np.eye(3)
    system.setDefaultPeriodicBoxVectors(*box)
    forces, energy = forces_and_energy(system, POSITIONS, reference)
    everything = with_filament(topology, system, beads=4.0)
    new_forces, new_energy = forces_and_energy(system, everything, reference)
    np.testing.assert_allclose(new_forces[:COUNT], forces, rtol=0, atol=1e-10 * np.abs(forces).max())
    assert np.abs(new_forces[COUNT:]).max() == 0.0
    assert new_energy == pytest.approx(energy, rel=1e-10)


def test_what_cannot_be_filled_is_refused_before_anything_changes():
    surface = without_surface()
    surface.setSurfaceAreaEnergy(2.26)
    kirkwood = with_entries(openmm.AmoebaGeneralizedKirkwoodForce(), 0.15, 0.7, of_charges=True)
    alchemical = openmm.ATMForce("u0+u1")
    short = openmm.NonbondedForce()
    short.addParticle(0, 1, 0)
    cases = {
        r"GBSAOBCForce \(force 0\) would give nodes .* a surface energy.*setSurfaceAreaEnergy": surface,
        r"AmoebaGeneralizedKirkwoodForce \(force 0\) has no entries": kirkwood,
        r"ATMForce \(force 0\) has no entries": alchemical,
        r"NonbondedForce \(force 0\) has entries for 1 particles, but the System has 6": short,
    }
    for message, force in cases.items():
        topology, system = system_with(force)
        before = openmm.XmlSerializer.serialize(system)
        with pytest.raises(InputError, match=message):
            with_filament(topology, system)
        assert openmm.XmlSerializer.serialize(system) == before
        assert topology.getNumAtoms() == COUNT


@pytest.mark.parametrize(
    "nodes, other, box",
    [
        ([[5, 5, 5], [0.2, 0, 0]], "node 1 is in the same place as particle 1", None),
        ([[-9.0, 0.22, 3.0], [5, 5, 5]], "node 0 is in the same place as particle 2", 3.0),
        ([[7, 7, 7], [1, 1, 1]], "node 0 is in the same place as node 1 of filament 0", None),
    ],
)
def test_nodes_in_the_place_of_another_particle_are_refused(nodes, other, box):
    """OpenMM gives no energy then, or crashes on its CPU platform."""
    for force, refused in ((nonbonded(), True), (openmm.HarmonicBondForce(), False)):
        topology, system = system_with(force)
        if box:
            system.setDefaultPeriodicBoxVectors(*box * np.eye(3))
        filaments = Filaments(VISCOSITY, 300.0)
        filaments.add_nodes(DSDNA, [[3.5, 3, 3], [7, 7, 7]])
        filaments.add_nodes(DSDNA, nodes)
        if not refused:
            filaments.add_to(topology, system, POSITIONS)
            continue
        with pytest.raises(InputError, match=f"{re.escape('Filament 1 (DNA)')}: {other}"):
            filaments.add_to(topology, system, POSITIONS)
        assert system.getNumParticles() == COUNT


def test_every_force_of_openmm_with_entries_is_known():
    """A new one of OpenMM, with entries of particles, would be OpenMM's error later."""
    own_lists = {"CustomExternalForce", "DrudeForce"}  # They name the particles that they act on.
    known = {name.partition(",")[0] for name in FORCES} | own_lists
    known |= {"ConstantPotentialForce", "AmoebaGeneralizedKirkwoodForce", "ATMForce"}
    for name, kind in vars(openmm).items():
        if isinstance(kind, type) and issubclass(kind, openmm.Force):
            if any(hasattr(kind, method) for method in ("addParticle", "addMultipole", "setReferencePositions")):
                assert name in known


def test_a_name_that_is_taken_is_not_taken_again(reference):
    def make():
        force = openmm.CustomNonbondedForce("takes_part1*takes_part2/r")
        force.addPerParticleParameter("takes_part")
        for charge in CHARGES:
            force.addParticle([charge])
        return force

    assert_nothing_changes(make, reference)


def made_vdw():
    force = openmm.AmoebaVdwForce()
    force.addParticle(0, 0.3, 0.2, 1.0)
    force.setParticleExclusions(0, [0])
    return force


def pair_of(index, force, name):
    return tuple(sorted(getattr(force, name)(index)[:2]))


@pytest.mark.parametrize(
    ("make", "excluded"),
    [
        (
            openmm.NonbondedForce,
            lambda f: [pair_of(i, f, "getExceptionParameters") for i in range(f.getNumExceptions())],
        ),
        (
            lambda: openmm.CustomNonbondedForce("1/r"),
            lambda f: [pair_of(i, f, "getExclusionParticles") for i in range(f.getNumExclusions())],
        ),
        (openmm.CustomGBForce, lambda f: [pair_of(i, f, "getExclusionParticles") for i in range(f.getNumExclusions())]),
        (
            made_vdw,
            lambda f: [(i, j) for i in range(f.getNumParticles()) for j in f.getParticleExclusions(i) if i < j],
        ),
    ],
)
def test_all_pairs_of_nodes_that_may_be_spare_are_excluded_once(make, excluded):
    force, topology, system, filaments = make(), app.Topology(), openmm.System(), Filaments(VISCOSITY, 298.0)
    growth = Growth(monomers=ACTIN_ATP, pool=0.0, longest=600.0)
    for number, own in enumerate((growth, growth, None)):
        kind = F_ACTIN.with_segment_length(54.0)
        filaments.add_straight(kind, 4, [0, 30 * number, 0], [1, 0, 0], growth=own)
    topology.addAtom("A", None, topology.addResidue("A", topology.addChain()))
    system.addParticle(10.0)
    if force.getNumParticles() == 0:
        force.addParticle(*([1.0, 1.0, 1.0] if make is openmm.NonbondedForce else [[]]))
    system.addForce(force)
    filaments.add_to(topology, system, [[0, 50, 0]])
    expected = [pair for own in filaments.node_indices[:2] for pair in itertools.combinations(own[1:].tolist(), 2)]
    assert len(expected) == 2 * 66 and sorted(excluded(force)) == sorted(expected)
    if make is openmm.NonbondedForce:
        parameters = [force.getExceptionParameters(index)[2:] for index in range(force.getNumExceptions())]
        assert all((own[0]._value, own[2]._value) == (0.0, 0.0) for own in parameters)
