"""Chains of beads in Systems with everything else, in both engines: restarts, files, forces, noise and equilibrium."""

from threading import Thread

import mdtraj
import numpy as np
import openmm
import pytest
from openmm import app, unit

from openmm_cylchain import (
    DSDNA,
    DSDNA_BASE_PAIRS,
    Crosslinks,
    FilamentReporter,
    Filaments,
    Plane,
    Slab,
    analysis,
    constant_tension,
    contact_force,
    theory,
    wall_force,
)
from openmm_cylchain.bead_spring.draws import draw_bonds
from openmm_cylchain.engines.gpu_platforms import GPU_PLATFORMS
from openmm_cylchain.units.quantities import thermal_energy
from support.contexts import close_reporters, energy_of, forces_of, new_context, new_simulation, positions_of
from support.noise_covariance import assert_covariance, moves_of_a_step
from support.platforms import ENGINE_PLATFORMS, ENGINE_SCHEMES, ENGINES, ENGINES_PORTABLE_SLOW

KIND, ROOM, VISCOSITY = DSDNA_BASE_PAIRS, 296.15, 602.0
KT = thermal_energy(ROOM)
HELD, FLAT = 3, 4
STEPS = {"euler": 0.002, "midpoint": 0.002, "implicit": 0.3}


def everything(engine):
    """Chains of beads (open, a ring, held, planar, tethered, propelled), cylinders and particles, with contacts, links,
    walls and a pull."""
    topology, system = app.Topology(), openmm.System()
    chain = topology.addChain()
    for mass in (1e5, 0.0):
        topology.addAtom("B", None, topology.addResidue("BEA", chain))
        system.addParticle(mass)
    filaments = Filaments(VISCOSITY, ROOM, engine=engine)
    filaments.add_equilibrium(KIND, 20, 1, [0.0, 0.0, 0.0], [1.0, 0.0, 0.0])
    filaments.add_equilibrium(KIND, 15, 2, [0.0, 3.0, 0.0], [1.0, 0.0, 0.0], propulsion=5.0)
    filaments.add_ring(KIND, 40, [0.0, 9.0, 0.0])
    filaments.add_straight(KIND, 9, [0.0, 15.0, 0.0], [0.0, 0.0, 1.0], clamped=[0, 1])
    filaments.add_equilibrium(KIND, 8, 3, [0.0, 18.0, 1.0], planar=True)
    filaments.add_straight(DSDNA, 3, [0.0, 21.0, 0.0], [1.0, 0.0, 0.0])
    filaments.add_tether(1, 0, [0.0, 3.0, 0.0], 500.0)
    filaments.add_beads(0, 1.0)
    filaments.add_beads(5, 1.0)
    filaments.add_attachment(2, segment=7, fraction=0.25)
    positions = filaments.add_to(topology, system, [[2.0, -3.0, 0.0], [4.0, -3.0, 0.0]] * unit.nanometer)
    system.addForce(contact_force(filaments, system, 2.0, particles=[0, 1], particle_diameter=2.0))
    system.addForce(wall_force(Slab([0, 0, 0], [0, 0, 1], 40.0), 20.0, np.concatenate(filaments.node_indices)))
    system.addForce(constant_tension(filaments, 10.0, [1, 0, 0], [1]))
    links = Crosslinks(2.0, 100.0)
    nodes, place = filaments.node_indices, int(filaments.attachment_indices[-1])
    links.set_pairs(None, [(int(nodes[0][5]), int(nodes[1][5])), (place, int(nodes[HELD][-1])), (0, int(nodes[0][0]))])
    links.add_to(system)
    return filaments, topology, system, positions


def context_of(parts, scheme, platform="Reference", seed=3, step=None):
    filaments, _, system, positions = parts
    step = STEPS[scheme] if step is None else step
    integrator = filaments.create_integrator(system, step, scheme, particle_friction=1e4, random_seed=seed)
    properties = {"DeterministicForces": "true"} if platform == "CPU" else {}
    return new_context(system, positions, integrator, platform, properties), integrator


@pytest.mark.parametrize("platform", sorted({platform for _, platform in ENGINE_PLATFORMS} - set(GPU_PLATFORMS)))
def test_engines_have_the_same_forces_and_energies(platform):
    found = []
    for engine in ENGINES:
        context, _ = context_of(everything(engine), "midpoint", platform)
        found.append((energy_of(context), forces_of(context)))
    (energy, forces), (other_energy, other_forces) = found
    tolerance = 1e-9 if platform == "Reference" else 1e-5
    assert energy == pytest.approx(other_energy, rel=tolerance)
    # What acts on a virtual site is passed on to its segment; links of the compiled engine act there at once.
    system = context.getSystem()
    real = [particle for particle in range(system.getNumParticles()) if not system.isVirtualSite(particle)]
    forces, other_forces = forces[real], other_forces[real]
    assert np.abs(forces - other_forces).max() < tolerance * np.abs(forces).max()


@pytest.mark.parametrize(("engine", "scheme"), ENGINE_SCHEMES)
def test_restarts_are_identical(engine, scheme):
    """From a checkpoint, from a State and from the XML of the System, beside another Context that steps in a thread."""
    parts = everything(engine)
    context, integrator = context_of(parts, scheme)
    integrator.step(20)
    checkpoint = context.createCheckpoint()
    state = context.getState(positions=True, velocities=True, parameters=True, integratorParameters=True)
    before = positions_of(context)
    integrator.step(20)
    expected = positions_of(context)
    nodes = parts[0].node_indices
    moved = expected - before
    assert np.all(moved[nodes[HELD][:2]] == 0.0) and np.all(moved[nodes[FLAT], 2] == 0.0)
    assert all(np.abs(moved[one]).max() > 1e-3 for one in nodes)

    context.loadCheckpoint(checkpoint)
    integrator.step(20)
    assert np.array_equal(positions_of(context), expected)
    other, stepping = context_of(parts, scheme, seed=4)
    thread = Thread(target=stepping.step, args=(30,))
    thread.start()
    context.setState(openmm.XmlSerializer.deserialize(openmm.XmlSerializer.serialize(state)))
    integrator.step(20)
    thread.join()
    assert np.array_equal(positions_of(context), expected)
    assert not np.allclose(positions_of(other), expected)
    system = openmm.XmlSerializer.deserialize(openmm.XmlSerializer.serialize(parts[2]))
    assert energy_of(new_context(system, before)) == pytest.approx(energy_of(new_context(parts[2], before)), rel=1e-12)


@pytest.mark.parametrize("engine", ENGINES)
def test_files_have_a_base_pair_in_a_residue(engine, tmp_path):
    filaments, topology, system, positions = everything(engine)
    integrator = filaments.create_integrator(system, 0.002, particle_friction=1e4, scheme="midpoint", random_seed=1)
    simulation = new_simulation(topology, system, positions, integrator)
    with open(tmp_path / "beads.cif", "w") as file:
        app.PDBxFile.writeFile(topology, positions, file, keepIds=True)
    simulation.reporters.append(app.DCDReporter(str(tmp_path / "beads.dcd"), 5))
    reporter = FilamentReporter(None, 5, filaments)
    simulation.reporters.append(reporter)
    simulation.step(10)
    expected = positions_of(simulation.context)
    stretching, bending = reporter["stretching_energy"][-1], reporter["bending_energy"][-1]
    contour = reporter["contour_length"][-1]
    close_reporters(simulation)
    read = mdtraj.load(str(tmp_path / "beads.dcd"), top=str(tmp_path / "beads.cif"))
    assert read.xyz[-1] == pytest.approx(expected, abs=1e-5)
    pairs = [atom.residue.name for atom in read.topology.atoms if atom.name == "NOD"].count("DBP")
    assert pairs == sum(len(one) for one in filaments.node_indices[:5])
    assert all(residue.n_atoms == 1 for residue in read.topology.residues)
    assert analysis.ring_filaments(read).tolist() == [False, False, True, False, False, False]
    for number, nodes in enumerate(filaments.node_indices):
        energies = filaments[number].energies(expected[nodes])
        assert (stretching[number], bending[number]) == pytest.approx(energies, rel=1e-9)
        lengths = analysis.segment_lengths(read)[number][-1]
        assert lengths.sum() == pytest.approx(contour[number], rel=1e-4)


@pytest.mark.parametrize("engine", ENGINES)
def test_a_wall_and_a_pull_push_beads_as_they_should(engine):
    filaments = Filaments(VISCOSITY, ROOM, engine=engine)
    filaments.add_straight(KIND, 6, [0.0, 0.0, -0.5], [1.0, 0.0, 0.0])
    _, system, positions = filaments.build()
    system.addForce(wall_force(Plane([0, 0, 0], [0, 0, 1]), 20.0, filaments.node_indices[0]))
    system.addForce(constant_tension(filaments, 7.0, [1, 0, 0]))
    forces = forces_of(new_context(system, positions))
    assert forces[:, 2] == pytest.approx(10.0)
    assert forces[:, 0] == pytest.approx([-7.0, *[0.0] * 5, 7.0], abs=1e-6)


SHORT, DRAWS = 1e-3 * KIND.time_unit, 110


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("beside", [False, True])
def test_covariance_of_the_noise_of_beads(engine, beside):
    """2 k_B T h/xi in each direction in which a bead may move, nothing between two, with cylinders beside or not."""
    filaments, count = Filaments(VISCOSITY, ROOM, engine=engine), 200
    nodes = KIND.draw_chain(3, ROOM, np.random.default_rng(1))
    for _ in range(count):
        filaments.add_nodes(KIND, nodes, clamped=[1])
    if beside:
        # Of as many nodes, so that moves have a filament's shape.
        for _ in range(count):
            filaments.add_nodes(DSDNA, 24.0 * nodes)
    moves = moves_of_a_step(filaments, SHORT, DRAWS)
    moves = moves.reshape(DRAWS, -1, 4, 3)[:, :count].reshape(-1, 4, 3)
    assert np.all(moves[:, 1] == 0.0)
    assert_covariance(moves[:, [0, 2, 3]].reshape(-1, 9), 2.0 * KT * SHORT / KIND.bead_friction * np.eye(9))


@pytest.mark.parametrize("engine", ENGINES)
def test_noise_of_planar_beads_and_rings(engine):
    filaments, count = Filaments(VISCOSITY, ROOM, engine=engine), 200
    angles = 0.5 * np.pi * np.arange(4)
    nodes = 0.25 * np.stack([np.cos(angles), np.sin(angles), np.zeros(4)], axis=1)
    for _ in range(count):
        filaments.add_nodes(KIND, nodes, closed=True, planar=True)
    moves = moves_of_a_step(filaments, SHORT, DRAWS)
    assert np.all(moves[..., 2] == 0.0)
    assert_covariance(moves[..., :2].reshape(-1, 8), 2.0 * KT * SHORT / KIND.bead_friction * np.eye(8))


SIGMAS, ALLOWED = 4.0, 0.02


@pytest.mark.sample("compiled|True")
@pytest.mark.parametrize("planar", [False, True])
@pytest.mark.parametrize("engine", ENGINES_PORTABLE_SLOW)
def test_energies_of_short_chains_are_exact(engine, planar):
    """At the recommended explicit step, no mode has a variance more than 5 % too large, and bends have 1.2 %."""
    bonds, count, scheme = 4, 600, "euler" if planar else "midpoint"
    filaments = Filaments(VISCOSITY, ROOM, engine=engine)
    drawn = draw_bonds(KIND.nu, KIND.reduced_temperature(ROOM), bonds, np.random.default_rng(8), count, planar)
    for vectors in KIND.natural_length * drawn:
        filaments.add_nodes(KIND, np.concatenate([np.zeros((1, 3)), np.cumsum(vectors, axis=0)]), planar=planar)
    _, system, positions = filaments.build()
    integrator = filaments.create_integrator(system, filaments.recommended_time_step(scheme), scheme, random_seed=5)
    context = new_context(system, positions, integrator)
    integrator.step(100)
    samples = []
    for _ in range(40):
        integrator.step(12)
        vectors = np.diff(positions_of(context).reshape(count, bonds + 1, 3), axis=1)
        stretching = KIND.stretching_energies(np.linalg.norm(vectors, axis=2)).sum(axis=1)
        samples.append([stretching, KIND.bending_energies(vectors).sum(axis=1)])
    by_chain = np.mean(samples, axis=0)
    exact = [
        function(KIND, bonds, ROOM, planar).sum()
        for function in (theory.bead_spring_stretching_energies, theory.bead_spring_bending_energies)
    ]
    ratios, errors = by_chain.mean(axis=1) / exact, by_chain.std(axis=1, ddof=1) / np.sqrt(count) / exact
    print(ratios, errors)
    assert np.all(SIGMAS * errors + ALLOWED < 0.05)
    assert np.all(np.abs(ratios - 1.0) < SIGMAS * errors + ALLOWED)


def test_joints_of_a_pulled_chain_carry_the_force():
    filaments, count, force = Filaments(VISCOSITY, ROOM, engine="compiled"), 60, 30.0
    for _ in range(count):
        filaments.add_straight(KIND, 10, [0.0, 0.0, 0.0], [1.0, 0.0, 0.0], clamped=[0])
    _, system, positions = filaments.build()
    pull = openmm.CustomExternalForce(f"-{force}*x")
    for nodes in filaments.node_indices:
        pull.addParticle(int(nodes[-1]), [])
    system.addForce(pull)
    context, integrator = context_of((filaments, None, system, positions), "implicit", step=10.0 * KIND.time_unit)
    integrator.setRecordsTensions(True)
    integrator.step(300)
    samples = []
    for _ in range(1500):
        integrator.step(1)
        samples.append([tensions._value for tensions in filaments.in_context(context).mean_joint_tensions()])
    by_chain = np.mean(samples, axis=0)[:, :, 0]
    error = by_chain.std(axis=0, ddof=1) / np.sqrt(count)
    assert np.all(SIGMAS * error < 0.1 * force)
    assert np.all(np.abs(by_chain.mean(axis=0) - force) < SIGMAS * error)


@pytest.mark.parametrize(
    ("engine", "scheme", "stiffness"),
    [("compiled", "implicit", 1e3), pytest.param("portable", "euler", 2e4, marks=pytest.mark.slow)],
)
def test_a_spring_between_beads_has_its_energy_at_the_recommended_step(engine, scheme, stiffness):
    """3/2 k_B T, where two free chains are joined by a spring of no length, and 5 % more at most."""
    filaments, generator, pairs, bonds = Filaments(VISCOSITY, ROOM, engine=engine), np.random.default_rng(3), 100, 4
    spring = openmm.HarmonicBondForce()
    for pair in range(pairs):
        first = filaments.add_equilibrium(KIND, bonds, 2 * pair + 1, [0.0, 40.0 * pair, 0.0])
        start = filaments[first].positions[2] + generator.normal(scale=np.sqrt(KT / stiffness), size=3)
        filaments.add_equilibrium(KIND, bonds, 2 * pair + 2, start)
        ends = (10 * pair + 2, 10 * pair + 5)
        spring.addBond(*ends, 0.0, stiffness)
    _, system, positions = filaments.build()
    system.addForce(spring)
    step = filaments.recommended_time_step(scheme, system=system)
    assert "HarmonicBondForce" in step.reason
    context, integrator = context_of((filaments, None, system, positions), scheme, step=step)
    integrator.step(50)
    samples = []
    for _ in range(200):
        integrator.step(5)
        nodes = positions_of(context).reshape(pairs, 10, 3)
        samples.append(0.5 * stiffness * np.sum((nodes[:, 2] - nodes[:, 5]) ** 2, axis=1) / (1.5 * KT))
    by_pair = np.mean(samples, axis=0)
    error = by_pair.std(ddof=1) / np.sqrt(pairs)
    assert SIGMAS * error < 0.1
    assert abs(by_pair.mean() - 1.0) < 0.05 + SIGMAS * error
