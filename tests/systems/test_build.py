"""Filaments: what ends up in Topology, System, positions and files, and what stays as it was."""

from dataclasses import replace

import mdtraj
import numpy as np
import openmm
import pytest
from openmm import app, unit

from openmm_cylchain import DSDNA, F_ACTIN, MICROTUBULE, Filaments, stokes_friction
from support.contexts import forces_of, new_context
from support.solvent import VISCOSITY

PN = 0.602214076  # kJ/(mol nm)
TEMPERATURE = 310 * unit.kelvin
LENNARD_JONES_GROUP, CHAIN_GROUP = 0, 1


@pytest.fixture
def filaments(engine):
    return Filaments(VISCOSITY, TEMPERATURE, engine)


@pytest.fixture
def portable_filaments():
    return Filaments(VISCOSITY, TEMPERATURE, "portable")


def nanometers(positions):
    return positions.value_in_unit(unit.nanometer)


def force_named(system, text):
    found = [force for force in system.getForces() if text in force.getName()]
    assert len(found) == 1
    return found[0]


# Positions


def test_straight(filaments):
    assert filaments.add_straight(F_ACTIN, 3, [10, 20, 30], [0, 3, 4]) == 0
    _, _, positions = filaments.build()
    distance = 360.0 * np.arange(4)[:, None]
    np.testing.assert_allclose(nanometers(positions), [10, 20, 30] + distance * [0, 0.6, 0.8], rtol=1e-15)


def test_straight_with_units_is_the_same(filaments):
    other = Filaments(1.71e-3 * 602214.076, 310)
    assert other.viscosity == pytest.approx(filaments.viscosity, rel=1e-12)
    assert other.temperature == filaments.temperature == 310.0
    filaments.add_straight(F_ACTIN, 3, [0.01, 0.02, 0.03] * unit.micrometer, openmm.Vec3(0, 0, 2))
    other.add_straight(F_ACTIN, 3, (10, 20, 30), (0, 0, 1))
    np.testing.assert_allclose(filaments[0].positions, other[0].positions, rtol=1e-14)


@pytest.mark.parametrize(
    "given",
    [
        [[0, 0, 0], [350, 0, 0], [700, 90, 0]],
        np.array([[0, 0, 0], [0.35, 0, 0], [0.7, 0.09, 0]]) * unit.micrometer,
        [openmm.Vec3(0, 0, 0), openmm.Vec3(350, 0, 0), openmm.Vec3(700, 90, 0)] * unit.nanometer,
        [openmm.Vec3(0, 0, 0) * unit.nanometer, openmm.Vec3(0.35, 0, 0) * unit.micrometer, (700, 90, 0)],
    ],
)
def test_nodes(filaments, given):
    filaments.add_nodes(F_ACTIN, given)
    _, _, positions = filaments.build()
    np.testing.assert_allclose(nanometers(positions), [[0, 0, 0], [350, 0, 0], [700, 90, 0]], rtol=1e-14)


def test_given_positions_are_copied(filaments):
    given = np.array([[0.0, 0.0, 0.0], [350.0, 0.0, 0.0]])
    filaments.add_nodes(F_ACTIN, given)
    given[:] = 7.0
    assert filaments[0].positions[1, 0] == 350.0


def test_rest_length_is_that_of_the_type_whatever_the_nodes_are(portable_filaments):
    portable_filaments.add_nodes(F_ACTIN, [[0, 0, 0], [350, 0, 0], [720, 0, 0]])
    _, system, _ = portable_filaments.build()
    stretching = force_named(system, "Stretching")
    for bond, pair in enumerate([(0, 1), (1, 2)]):
        first, second, (stiffness, length) = stretching.getBondParameters(bond)
        assert ((first, second), length) == (pair, 360.0)
        assert stiffness == pytest.approx(48.7 * PN, rel=1e-12)


def test_equilibrium(filaments):
    filaments.add_equilibrium(DSDNA, 40, seed=3, start=[1, 2, 3])
    positions = filaments[0].positions
    assert positions.shape == (41, 3)
    np.testing.assert_array_equal(positions[0], [1, 2, 3])
    assert np.linalg.norm(np.diff(positions, axis=0), axis=1).mean() == pytest.approx(8.0, rel=0.02)


# Systems


def test_several_types_in_one_system(filaments):
    assert filaments.add_straight(F_ACTIN, 3, [0, 0, 0], [1, 0, 0]) == 0
    assert filaments.add_straight(DSDNA, 5, [0, 100, 0], [1, 0, 0], clamped=[0, -1]) == 1
    assert filaments.add_straight(MICROTUBULE, 1, [0, 200, 0], [1, 0, 0]) == 2
    assert len(filaments) == 3
    assert [filament.segments for filament in (filaments[0], filaments[1], filaments[2])] == [3, 5, 1]
    topology, system, positions = filaments.build()
    assert system.getNumParticles() == topology.getNumAtoms() == len(positions) == 4 + 6 + 2
    assert [list(nodes) for nodes in filaments.node_indices] == [[0, 1, 2, 3], [4, 5, 6, 7, 8, 9], [10, 11]]
    masses = [system.getParticleMass(index)._value for index in range(12)]
    actin, dna, microtubule = (t.segment_mass for t in (F_ACTIN, DSDNA, MICROTUBULE))
    expected = [actin / 2, actin, actin, actin / 2, 0, dna, dna, dna, dna, 0, microtubule / 2, microtubule / 2]
    assert masses == pytest.approx(expected, rel=1e-12)
    assert sum(masses[:4]) == pytest.approx(3 * 360 * 3500)


def test_topology(filaments):
    filaments.add_straight(F_ACTIN, 2, [0, 0, 0], [1, 0, 0])
    filaments.add_straight(DSDNA, 1, [0, 0, 0], [1, 0, 0])
    topology, _, _ = filaments.build()
    assert [chain.id for chain in topology.chains()] == ["F0", "F1"]
    assert [residue.name for residue in topology.residues()] == ["ACT"] * 3 + ["DNA"] * 2
    assert [residue.id for residue in topology.residues()] == ["1", "2", "3", "1", "2"]
    assert {atom.name for atom in topology.atoms()} == {"NOD"}
    assert {atom.element for atom in topology.atoms()} == {None}
    assert [(a.index, b.index) for a, b in topology.bonds()] == [(0, 1), (1, 2), (3, 4)]


def test_clamped_nodes(filaments):
    filaments.add_straight(F_ACTIN, 4, [0, 0, 0], [1, 0, 0], clamped=[0, 1, -1, 4])
    assert filaments[0].clamped == (0, 1, 4)
    _, system, _ = filaments.build()
    assert [system.getParticleMass(index)._value == 0 for index in range(5)] == [True, True, False, False, True]


def test_force_groups(portable_filaments):
    portable_filaments.add_straight(F_ACTIN, 4, [0, 0, 0], [1, 0, 0])
    _, system, _ = portable_filaments.build(stretching_force_group=7, bending_force_group=9)
    assert force_named(system, "Stretching").getForceGroup() == 7
    assert force_named(system, "Bending").getForceGroup() == 9


@pytest.mark.parametrize("vectors", [np.diag([100.0, 200.0, 300.0]), np.diag([0.1, 0.2, 0.3]) * unit.micrometer])
def test_box_vectors(filaments, vectors):
    filaments.add_straight(F_ACTIN, 1, [0, 0, 0], [1, 0, 0])
    topology, system, _ = filaments.build(box_vectors=vectors)
    for box in (system.getDefaultPeriodicBoxVectors(), topology.getPeriodicBoxVectors()):
        found = [vector.value_in_unit(unit.nanometer) for vector in box]
        np.testing.assert_allclose(np.array(found), np.diag([100, 200, 300]), rtol=1e-12)


def test_freely_jointed_filaments_have_no_bending_force(portable_filaments):
    portable_filaments.add_straight(replace(F_ACTIN, bending_rigidity=0.0), 4, [0, 0, 0], [1, 0, 0])
    _, system, _ = portable_filaments.build()
    assert [force.getName() for force in system.getForces()] == ["CylinderChainStretching (harmonic)"]


# Filaments among other particles


def lennard_jones_system(kind, count=64, box=6.0):
    """A periodic Lennard-Jones gas on a distorted lattice, as a NonbondedForce or a CustomNonbondedForce."""
    system, topology = openmm.System(), app.Topology()
    chain = topology.addChain("X")
    system.setDefaultPeriodicBoxVectors(*(box * np.eye(3)))
    if kind.startswith("custom"):
        force = openmm.CustomNonbondedForce("4*epsilon*((sigma/r)^12-(sigma/r)^6)*scale1*scale2; sigma=0.4; epsilon=1")
        force.addPerParticleParameter("scale")
        force.setNonbondedMethod(openmm.CustomNonbondedForce.CutoffPeriodic)
        force.setUseLongRangeCorrection("correction" in kind)
        if "groups" in kind:
            force.addInteractionGroup(range(0, count, 2), range(1, count, 2))
    else:
        force = openmm.NonbondedForce()
        force.setNonbondedMethod(openmm.NonbondedForce.CutoffPeriodic)
        force.setUseDispersionCorrection("correction" in kind)
    force.setCutoffDistance(1.2)
    force.setForceGroup(LENNARD_JONES_GROUP)
    for index in range(count):
        system.addParticle(40.0)
        topology.addAtom("X", None, topology.addResidue("X", chain))
        if kind.startswith("custom"):
            force.addParticle([1.0 + 0.01 * index])
        else:
            force.addParticle(0.1 * (-1) ** index, 0.4, 1.0)
    system.addForce(force)
    lattice = np.stack(np.meshgrid(*[np.arange(4)] * 3), axis=-1).reshape(-1, 3) * box / 4
    positions = lattice + np.random.default_rng(8).uniform(-0.4, 0.4, lattice.shape)
    return topology, system, positions


def lennard_jones_state(system, positions, platform):
    context = new_context(system, positions, platform=platform)
    state = context.getState(forces=True, energy=True, groups={LENNARD_JONES_GROUP})
    return state.getForces(asNumpy=True)._value, state.getPotentialEnergy()._value


KINDS = ["nonbonded", "custom", "custom, groups", "custom, correction", "custom, groups, correction"]


@pytest.mark.parametrize("kind", [*KINDS, "nonbonded, correction"])
def test_other_particles_keep_their_forces_and_energy(filaments, kind, reference):
    topology, system, positions = lennard_jones_system(kind)
    forces, energy = lennard_jones_state(system, positions, reference)
    assert np.abs(forces).max() > 0.1
    # Straight through the box, between the particles.
    filaments.add_straight(DSDNA, 2, [-5, 3.1, 3.2], [1, 0.02, 0.03])
    everything = filaments.add_to(topology, system, positions, CHAIN_GROUP, CHAIN_GROUP)
    filaments.create_integrator(system, 1.0, particle_friction=1000.0)
    new_forces, new_energy = lennard_jones_state(system, everything, reference)
    np.testing.assert_allclose(new_forces[:64], forces, rtol=0, atol=1e-12 * np.abs(forces).max())
    assert np.abs(new_forces[64:]).max() == 0.0
    if "correction" in kind:
        # OpenMM averages the correction beyond the cutoff over pairs of particles, nodes included: that constant,
        # which no force depends on, changes by one part in the number of particles.
        _, uncorrected, _ = lennard_jones_system(kind.replace(", correction", ""))
        constant = energy - lennard_jones_state(uncorrected, positions, reference)[1]
        assert 0 < abs(new_energy - energy) < 2 * abs(constant) / 64
    else:
        assert new_energy == pytest.approx(energy, rel=1e-12)


def test_existing_topology_and_system_come_first(filaments):
    topology, system, positions = lennard_jones_system("nonbonded")
    filaments.add_straight(F_ACTIN, 2, [0.1, 0, 0], [1, 0.1, 0.3])
    everything = filaments.add_to(topology, system, positions * unit.nanometer)
    np.testing.assert_array_equal(nanometers(everything)[:64], positions)
    np.testing.assert_array_equal(nanometers(everything)[64:], filaments[0].positions)
    assert list(filaments.node_indices[0]) == [64, 65, 66]
    assert [chain.id for chain in topology.chains()] == ["X", "F0"]
    assert [(a.index, b.index) for a, b in topology.bonds()] == [(64, 65), (65, 66)]
    assert [system.getParticleMass(index)._value for index in (0, 63)] == [40.0, 40.0]
    nonbonded = system.getForce(0)
    assert nonbonded.getNumParticles() == system.getNumParticles() == 67
    charge, _, epsilon = nonbonded.getParticleParameters(65)
    assert charge._value == epsilon._value == 0.0


def test_build_and_add_to_an_empty_system_are_the_same(filaments):
    other = Filaments(VISCOSITY, TEMPERATURE, filaments.engine)
    for target in (filaments, other):
        target.add_equilibrium(DSDNA, 5, seed=1)
        target.add_straight(F_ACTIN, 5, [0, 0, 0], [0, 0, 1], clamped=[0])
    _, built, positions = filaments.build()
    topology, system = app.Topology(), openmm.System()
    added = other.add_to(topology, system, np.zeros((0, 3)))
    np.testing.assert_array_equal(nanometers(positions), nanometers(added))
    assert openmm.XmlSerializer.serialize(built) == openmm.XmlSerializer.serialize(system)


@pytest.mark.parametrize("fraction", [0.0, 0.3, 0.5, 1.0])
def test_force_on_a_virtual_site_is_the_force_and_torque_of_step_5(filaments, fraction, reference):
    filaments.add_nodes(F_ACTIN, [[0, 0, 0], [300, 200, 0], [600, 400, 100], [950, 450, 100]])
    topology, system, positions = filaments.build(stretching_force_group=1, bending_force_group=1)
    nodes = nanometers(positions)
    site = system.addParticle(0.0)
    system.setVirtualSite(site, openmm.TwoParticleAverageSite(1, 2, 1 - fraction, fraction))
    pull = np.array([3.0, -5.0, 11.0])
    force = openmm.CustomExternalForce(f"-({pull[0]}*x+{pull[1]}*y+{pull[2]}*z)")
    force.addParticle(site)
    system.addForce(force)
    context = new_context(system, np.vstack([nodes, np.zeros(3)]), platform=reference)
    context.computeVirtualSites()
    forces = forces_of(context, {0})

    minus, plus = forces[1], forces[2]
    segment = nodes[2] - nodes[1]
    length = np.linalg.norm(segment)
    point = nodes[1] + fraction * segment
    r = (point - 0.5 * (nodes[1] + nodes[2])) @ segment / length
    np.testing.assert_allclose(minus + plus, pull, rtol=1e-12)
    np.testing.assert_allclose(length / 2 * (plus - minus), r * pull, rtol=1e-12, atol=1e-12)
    assert r == pytest.approx((fraction - 0.5) * length, rel=1e-12, abs=1e-9)
    np.testing.assert_array_equal(forces[[0, 3]], 0.0)


def test_particles_outside_diffuse_next_to_a_filament(filaments, reference):
    topology, system, positions = lennard_jones_system("nonbonded")
    filaments.add_straight(DSDNA, 2, [-5, 3.1, 3.2], [1, 0.02, 0.03])
    everything = filaments.add_to(topology, system, positions)
    friction = stokes_friction(0.4, VISCOSITY)
    step = 1e-3
    integrator = filaments.create_integrator(
        system, step, particle_friction=np.full(64, friction), temperature=0, random_seed=1
    )
    context = new_context(system, everything, integrator, reference)
    forces = forces_of(context)
    integrator.step(1)
    moved = nanometers(context.getState(positions=True).getPositions(asNumpy=True)) - nanometers(everything)
    np.testing.assert_allclose(moved[:64], step * forces[:64] / friction, rtol=1e-9, atol=1e-15)


# Joint tensions


def pull(system, particle, force):
    """A constant force on one particle."""
    external = openmm.CustomExternalForce("-(fx*x+fy*y+fz*z)")
    for name in ("fx", "fy", "fz"):
        external.addPerParticleParameter(name)
    external.addParticle(particle, force)
    system.addForce(external)


def tensions_after(filaments, forces, steps, platform):
    """Joint tensions in pN of the first filament after relaxation without noise under forces on its nodes."""
    _, system, positions = filaments.build()
    for node, force in forces.items():
        pull(system, int(filaments.node_indices[0][node]), np.asarray(force) * PN)
    integrator = filaments.create_integrator(system, 0.02 * unit.microsecond, temperature=0)
    context = new_context(system, positions, integrator, platform)
    integrator.step(steps)
    tension = filaments.in_context(context).joint_tensions()
    assert len(tension) == len(filaments)
    return tension[0].value_in_unit(unit.kilojoule_per_mole / unit.nanometer) / PN


DIRECTION = np.array([2.0, -1.0, 2.0]) / 3.0


def test_tension_of_a_chain_pulled_at_both_ends(filaments, reference):
    filaments.add_straight(F_ACTIN, 5, [0, 0, 0], DIRECTION)
    filaments.add_straight(F_ACTIN, 2, [0, 0, 900], DIRECTION)
    tension = tensions_after(filaments, {0: -5 * DIRECTION, -1: 5 * DIRECTION}, 400, reference)
    assert tension.shape == (4, 3)
    np.testing.assert_allclose(tension, np.tile(5 * DIRECTION, (4, 1)), atol=5e-3)


def test_tension_of_a_clamped_chain(filaments, reference):
    filaments.add_straight(F_ACTIN, 4, [0, 0, 0], DIRECTION, clamped=[0])
    tension = tensions_after(filaments, {-1: 5 * DIRECTION}, 400, reference)
    np.testing.assert_allclose(tension, np.tile(5 * DIRECTION, (3, 1)), atol=5e-3)


def test_tension_of_a_dragged_chain_grows_with_the_drag_behind_it(filaments, reference):
    filaments.add_straight(F_ACTIN, 5, [0, 0, 0], DIRECTION)
    tension = tensions_after(filaments, {-1: 5 * DIRECTION}, 400, reference)
    np.testing.assert_allclose(tension, np.arange(1, 5)[:, None] * DIRECTION, atol=5e-3)


def test_tension_of_a_compressed_chain_is_negative_along_it(filaments, reference):
    filaments.add_straight(F_ACTIN, 3, [0, 0, 0], DIRECTION)
    tension = tensions_after(filaments, {0: 0.1 * DIRECTION, -1: -0.1 * DIRECTION}, 400, reference)
    np.testing.assert_allclose(tension @ DIRECTION, -0.1, atol=1e-4)


def test_no_tension_in_one_segment(filaments, reference):
    filaments.add_straight(F_ACTIN, 1, [0, 0, 0], [1, 0, 0])
    assert tensions_after(filaments, {}, 1, reference).shape == (0, 3)


# Files


def write_structure(path, topology, positions):
    # OpenMM numbers chains A to Z and starts again unless it keeps the ids; bonds of later chains are then lost.
    with open(path, "w") as file:
        app.PDBxFile.writeFile(topology, positions, file, keepIds=True)


def test_long_filament_survives_files(filaments, tmp_path, reference):
    filaments.add_equilibrium(F_ACTIN, 64, seed=2, start=[5000, -3000, 12000])
    topology, system, positions = filaments.build()
    integrator = filaments.create_integrator(system, 10 * unit.nanosecond, random_seed=1)
    simulation = app.Simulation(topology, system, integrator, reference)
    simulation.context.setPositions(positions)
    simulation.reporters.append(app.DCDReporter(str(tmp_path / "t.dcd"), 2))
    frames = []
    for _ in range(3):
        simulation.step(2)
        frames.append(nanometers(simulation.context.getState(positions=True).getPositions(asNumpy=True)))
    simulation.reporters.clear()
    write_structure(tmp_path / "t.cif", topology, positions)

    structure = mdtraj.load(str(tmp_path / "t.cif"))
    assert [(a.index, b.index) for a, b in structure.topology.bonds] == [(n, n + 1) for n in range(64)]
    # mmCIF holds 1e-4 angstrom, mdtraj single precision.
    start = nanometers(positions)
    np.testing.assert_allclose(structure.xyz[0], start, atol=1e-5 + 2.0**-23 * np.abs(start).max())

    trajectory = mdtraj.load(str(tmp_path / "t.dcd"), top=structure.topology)
    assert trajectory.n_frames == 3
    # DCD holds single-precision angstroms.
    np.testing.assert_allclose(trajectory.xyz, frames, atol=2.0**-22 * np.abs(frames).max())
    assert np.abs(np.diff(trajectory.xyz, axis=0)).max() > 1e-3
    lengths = np.linalg.norm(np.diff(trajectory.xyz.astype(float), axis=1), axis=2)
    assert lengths.sum(axis=1) == pytest.approx(64 * 360, rel=0.01)


def test_200_filaments_keep_chains_and_bonds_in_a_file(filaments, tmp_path):
    for number in range(200):
        filaments.add_straight(F_ACTIN if number % 2 else DSDNA, 16, [0, 50 * number, 0], [1, 0, 0])
    topology, _, positions = filaments.build()
    write_structure(tmp_path / "many.cif", topology, positions)
    expected = [(17 * chain + node, 17 * chain + node + 1) for chain in range(200) for node in range(16)]
    by_openmm = app.PDBxFile(str(tmp_path / "many.cif")).topology
    assert [len(list(chain.residues())) for chain in by_openmm.chains()] == [17] * 200
    assert [(a.index, b.index) for a, b in by_openmm.bonds()] == expected
    by_mdtraj = mdtraj.load(str(tmp_path / "many.cif")).topology
    assert [chain.n_residues for chain in by_mdtraj.chains] == [17] * 200
    assert [(a.index, b.index) for a, b in by_mdtraj.bonds] == expected
    assert [residue.name for residue in by_mdtraj.residues] == (["DNA"] * 17 + ["ACT"] * 17) * 100


def test_filaments_say_what_they_are():
    filaments = Filaments(viscosity=1e-3 * unit.pascal * unit.second, temperature=310 * unit.kelvin)
    assert repr(filaments) == f"<Filaments at 310 K, {filaments.engine} engine: none yet>"
    for number in range(3):
        filaments.add_equilibrium(F_ACTIN, segments=(4, 4, 1)[number], seed=number)
    assert repr(filaments).endswith("engine: 2 × ACT, 4 segments; 1 × ACT, 1 segment>")
