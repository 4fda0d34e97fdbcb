"""Filaments that are not there now, before they begin or after they vanish: what looks at filaments leaves them out."""

import copy
import json

import gsd.hoomd
import mdtraj
import numpy as np
import openmm
import pytest
from openmm import app, unit

from openmm_cylchain import (
    ACTIN_ATP,
    F_ACTIN,
    Crosslinker,
    FilamentReporter,
    Filaments,
    Growth,
    GrowthReporter,
    Hand,
    InputError,
    Nucleation,
    RunReporter,
    Slab,
    Sphere,
    TensionReporter,
    analysis,
    capsule_contact_force,
    check_time_step,
    filament_wall_force,
    make_trajectory_whole,
    make_whole,
    remove_jumps,
)
from openmm_cylchain.export.ovito import write_ovito
from openmm_cylchain.export.simularium import write_simularium
from openmm_cylchain.export.vmd import write_vmd
from openmm_cylchain.filaments.grown import GrownChain, monomers_of_segments
from openmm_cylchain.rendering import Look, write_film, write_picture
from openmm_cylchain.rendering.scene import make_scene
from support.contexts import energy_of, forces_of, positions_of
from support.solvent import TEMPERATURE, VISCOSITY

pytestmark = pytest.mark.filterwarnings("error::RuntimeWarning")
KIND = F_ACTIN.with_segment_length(54.0)
POOL = unit.Quantity(5e-6, unit.molar)
GROWTH = Growth(monomers=ACTIN_ATP, pool=POOL, longest=300.0, vanishes=True)
REGION = Sphere([80, 0, 0], 100.0)


def added(growing=0, still=0, reserve=3, growth=GROWTH, nucleation=None, **options):
    """Filaments side by side that grow, some that do not, and others that have not begun."""
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine="compiled")
    for number in range(growing + still):
        own = {"growth": growth} if number < growing else {}
        filaments.add_straight(KIND, 3, [0, 30 * number, 0], [1, 0, 0], **own)
    filaments.add_reserve(KIND, reserve, growth=growth, nucleation=nucleation, **options)
    return filaments


def simulated(filaments, topology, system, positions, step=1e6, **options):
    integrator = filaments.create_integrator(system, step, random_seed=3, checks=False, **options)
    cpu = openmm.Platform.getPlatformByName("CPU")
    simulation = app.Simulation(topology, system, integrator, cpu, {"Threads": "1"})
    simulation.context.setPositions(positions)
    return simulation


def with_surroundings(filaments):
    topology, system, positions = filaments.build()
    system.addForce(capsule_contact_force(filaments, system, 8.0))
    system.addForce(filament_wall_force(filaments, system, Slab([0, 0, 0], [0, 0, 1], 500.0), 1.0))
    return topology, system, positions


@pytest.fixture(scope="module")
def passing(tmp_path_factory):
    """A run with a filament that grows, one that does not, four that are not there at first, and one that never is."""
    filaments = added(1, 1, 4, nucleation=Nucleation(rate=5e4 / unit.second, region=REGION))
    filaments.add_reserve(KIND, 1, growth=GROWTH)
    topology, system, positions = with_surroundings(filaments)
    simulation = simulated(filaments, topology, system, positions)
    directory = tmp_path_factory.mktemp("run")
    filament_reporter = FilamentReporter(None, 10, filaments)
    tensions = TensionReporter(None, 10, filaments, mean=True)
    growth = GrowthReporter(None, 10, filaments)
    simulation.reporters += [RunReporter(directory, 10, filaments), filament_reporter, tensions, growth]
    simulation.step(50)
    return filaments, analysis.load(directory), filament_reporter, tensions, growth


@pytest.fixture(scope="module")
def empty(tmp_path_factory):
    """A run without any filament."""
    filaments = added(0, 0, 3)
    topology, system, positions = with_surroundings(filaments)
    simulation = simulated(filaments, topology, system, positions)
    directory = tmp_path_factory.mktemp("empty")
    simulation.reporters.append(RunReporter(directory, 5, filaments))
    simulation.step(10)
    return analysis.load(directory)


def are_there(run):
    """Which filaments there are in each frame, of ``passing``: the second one does not grow."""
    grown = run.growth["nodes"] > 0
    return np.insert(grown, 1, True, axis=1)


def test_frames_and_reporters(passing):
    filaments, run, reporter, tensions, growth = passing
    there = are_there(run)
    assert not there[0, 2:].any() and 1 <= there[-1, 2:].sum() <= 4 and not there[:, 6].any()
    assert {6} < run.passing and not run.passing & {0, 1}
    np.testing.assert_array_equal(growth["nodes"] > 0, np.delete(there, 1, axis=1)[1:])
    for column in ("stretching_energy", "bending_energy", "end_to_end_distance", "contour_length"):
        np.testing.assert_array_equal(np.isfinite(reporter[column]), there[1:])
    np.testing.assert_array_equal(np.isfinite(tensions["mean_tension"])[:, :2], True)
    for frame in range(len(run)):
        counts = there[frame] * 1
        for of_filaments in (run.nodes, run.curves, run.bends, run.segment_tensions):
            np.testing.assert_array_equal([min(1, len(own)) for own in of_filaments(frame)], counts)
        stress = analysis.stress(run, frame, volume=1e6)
        assert np.all(np.isfinite(stress.total))
        distances = analysis.filament_distances(run, frame, 1000.0)
        np.testing.assert_array_equal(np.isfinite(distances[1]), there[frame])
        assert not analysis.contact_map(run, frame, gap=500.0)[~there[frame]].any()
        assert not set(np.flatnonzero(~there[frame])) & set(run.contacts(frame).filaments.ravel())
        for bundle in analysis.find_bundles(run, frame, 500.0, 1.5, 0.0):
            assert there[frame][bundle].all()
    assert np.all(np.isfinite(analysis.contraction(run)))


def test_contacts_of_runs_have_the_numbers_of_filaments(tmp_path):
    """Behind one that is not there, others keep theirs."""
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine="compiled")
    filaments.add_reserve(KIND, 2, growth=GROWTH)
    for height in (0.0, 7.0):
        filaments.add_straight(KIND, 3, [0, 0, height], [1, 0, 0])
    topology, system, positions = with_surroundings(filaments)
    simulation = simulated(filaments, topology, system, positions)
    simulation.reporters.append(RunReporter(tmp_path, 10, filaments))
    simulation.step(0)
    simulation.step(10)
    found = analysis.load(tmp_path).contacts(0)
    assert len(found.gaps) > 0 and {tuple(sorted(own)) for own in found.filaments.tolist()} == {(2, 3)}


def test_trajectories(passing):
    filaments, run, *_ = passing
    there, trajectory = are_there(run), run.mdtraj()
    for shapes in (
        analysis.contour_lengths,
        analysis.end_to_end_vectors,
        analysis.radii_of_gyration,
        analysis.centers_of_mass,
    ):
        found = shapes(trajectory)
        finite = np.isfinite(found).reshape(*there.shape, -1)
        np.testing.assert_array_equal(finite.all(axis=2), there)
        np.testing.assert_array_equal(finite.any(axis=2), there)
    for shapes in (analysis.node_positions, analysis.segment_lengths, analysis.tangents):
        for own, present in zip(shapes(trajectory), there.T):
            np.testing.assert_array_equal(np.isfinite(own).reshape(len(run), -1).any(axis=1), present)
    with pytest.raises(InputError, match="Filament 6 grows: 0 to 0 of its"):
        analysis.persistence_length(trajectory, 6)
    box = np.repeat(250.0 * np.eye(3, dtype=np.float32)[None], len(run), axis=0)
    wrapped = mdtraj.Trajectory(trajectory.xyz % 250.0, trajectory.topology)
    wrapped.unitcell_vectors = box
    for made in (make_trajectory_whole(wrapped), remove_jumps(wrapped)):
        for number, nodes in enumerate(analysis.filament_nodes(trajectory)):
            np.testing.assert_array_equal(analysis.count_nodes(made.xyz[:, nodes]) > 0, there[:, number])
    whole = make_whole(run.positions(-1) % 250.0, filaments, 250.0 * np.eye(3))._value
    assert np.ptp(whole[filaments.node_indices[6]]) == pytest.approx(np.ptp(whole[filaments.node_indices[6]][0]))


@pytest.mark.parametrize("color", ["type", "tension", "orientation", "bending"])
def test_pictures(passing, empty, tmp_path, color):
    _, run, *_ = passing
    for own in (run, empty):
        for frame in (0, -1):
            write_picture(own, frame, tmp_path / "picture.png", Look(color=color))
    scene = make_scene(run, Look(color=color, linkers=False), [0])
    drawn = scene.tubes(0)
    assert len(drawn.radii) == len(scene._fixed[0].radii) + 3 + 3 + 2  # Segments, and ends of two filaments.
    write_film(run, tmp_path / "film.gif", [0, len(run) - 1], look=Look(color=color))


def fibers_of(agents):
    """Numbers of the fibers of a frame of a Simularium file, all of which have points."""
    data, place, found = agents["data"], 0, []
    while place < len(data):
        assert data[place + 10] > 0
        found.append(int(data[place + 1]))
        place += 11 + int(data[place + 10])
    return found


def test_exports(passing, empty, tmp_path):
    _, run, *_ = passing
    for own, there in ((run, are_there(run)), (empty, np.zeros((len(empty), 3), dtype=bool))):
        write_simularium(own, tmp_path / "run.simularium")
        write_ovito(own, tmp_path / "run.gsd")
        write_vmd(own, tmp_path / "run.tcl")
        frames = json.loads((tmp_path / "run.simularium").read_text())["spatialData"]["bundleData"]
        with gsd.hoomd.open(str(tmp_path / "run.gsd")) as file:
            for frame, (agents, snapshot) in enumerate(zip(frames, file, strict=True)):
                numbers = [number for number in fibers_of(agents) if number < len(own.filaments)]
                assert numbers == np.flatnonzero(there[frame]).tolist()
                nodes = [len(each) for each in own.nodes(frame)]
                assert (snapshot.particles.typeid == 0).sum() == sum(nodes)
                assert (snapshot.bonds.typeid == 0).sum() == sum(nodes) - there[frame].sum()


def test_scripts_for_vmd(passing, tmp_path):
    """Those that come and go are drawn for each frame, and not as bonds, which would be dots."""
    _, run, *_ = passing
    write_vmd(run, tmp_path / "run.tcl")
    lines = (tmp_path / "run.tcl").read_text().splitlines()
    (selection,) = (line for line in lines if "not index" in line)
    hidden = set(map(int, selection.partition("not index ")[2].rstrip("}").split()))
    assert hidden == {int(node) for number in run.passing for node in run.filaments[number].nodes}
    curves = [line for line in lines if line.startswith("lappend curves")]
    assert len(curves) == len(run) and len(curves[0]) < len(curves[-1])


def test_chains_without_segments():
    assert len(monomers_of_segments(np.zeros(2, dtype=int), 20)) == 0
    chain = GrownChain(KIND, 2.7, np.zeros(2, dtype=int), np.zeros((9, 3)))
    assert chain.nodes == 0 and chain.energies == (0.0, 0.0) and chain.tensions.shape == (0,)
    np.testing.assert_array_equal(chain.virial, np.zeros((3, 3)))


@pytest.mark.parametrize("propulsion", [0.0, 0.1 * unit.piconewton])
@pytest.mark.parametrize("planar", [False, True])
def test_recommended_steps(propulsion, planar):
    """A filament that has not begun counts as a short one: steps are those of nuclei."""
    filaments = added(propulsion=propulsion, planar=planar)
    short = Filaments(VISCOSITY, TEMPERATURE, engine="compiled")
    short.add_straight(KIND, 1, [0, 0, 0], [1, 0, 0], propulsion=propulsion, planar=planar, growth=GROWTH)
    systems = [with_surroundings(own)[1] for own in (filaments, short)]
    steps = [own.recommended_time_step(system=one) for own, one in zip((filaments, short), systems)]
    assert steps[0].step == pytest.approx(steps[1].step) and np.isfinite(steps[0].step)
    with pytest.raises(InputError, match="grows"):
        check_time_step(filaments, systems[0], np.zeros((systems[0].getNumParticles(), 3)), 1e6)


def linked(growing, bound, anchors, spacing):
    hand = Hand(binding_rate=1e4 / unit.second, reach=40.0, unbinding_rate=1e2 / unit.second, site_spacing=spacing)
    filaments = added(growing, reserve=3)
    if anchors:
        kind = Crosslinker(name="link", hands=hand, stiffness=0.06)
        filaments.add_linkers(kind, anchors=np.zeros((30, 3)), bound=bound, seed=1)
    else:
        kind = Crosslinker(name="link", hands=(hand, hand), stiffness=0.06)
        filaments.add_linkers(kind, 30, volume=1e7, bound=bound, seed=1)
    return filaments


@pytest.mark.parametrize("anchors", [False, True])
@pytest.mark.parametrize("spacing", [None, 5.4])
def test_linkers_begin_on_filaments_that_are_there(anchors, spacing):
    filaments = linked(1, 5, anchors, spacing)
    simulation = simulated(filaments, *filaments.build())
    inside = filaments.in_context(simulation.context)
    table = inside.linkers()
    assert (table.filaments == 0).sum() == 5 and not (table.filaments > 0).any()
    simulation.step(100)
    assert not (inside.linkers().filaments > 0).any() and len(inside.linker_pulls().numbers) >= 0
    assert np.nanmax(inside.linker_places()._value) < 1e4
    with pytest.raises(InputError, match="'link': 10 are to begin bound, but of the filaments .* none is there yet"):
        linked(0, 10, anchors, spacing).build()
    none = linked(0, 0, anchors, spacing)
    simulation = simulated(none, *none.build())
    simulation.step(100)
    assert not (none.in_context(simulation.context).linkers().filaments >= 0).any()


def particles_beside(filaments, force, entry):
    topology, system = app.Topology(), openmm.System()
    chain = topology.addChain()
    positions = np.array([[1.0 * number, 300.0, 0.0] for number in range(3)])
    for _ in positions:
        topology.addAtom("A", None, topology.addResidue("A", chain))
        system.addParticle(50.0)
        force.addParticle(*entry)
    system.addForce(force)
    return topology, system, filaments.add_to(topology, system, positions)


@pytest.mark.parametrize(
    ("make", "entry"),
    [
        (openmm.NonbondedForce, (0.3, 0.5, 0.5)),
        (lambda: openmm.CustomNonbondedForce("1/r^6"), ([],)),
    ],
)
def test_forces_between_all_particles(make, entry):
    """All particles of a filament are in one place at times, and those of no two filaments are at the start."""
    nucleation = Nucleation(rate=3e6 / unit.second, region=REGION)
    filaments, force = added(1, 0, 4, nucleation=nucleation), make()
    filaments.add_reserve(KIND, 2, growth=GROWTH, nucleation=Nucleation(rate=0.0, region=REGION))
    built = particles_beside(filaments, force, entry)
    simulation = simulated(filaments, *built, step=1e4, particle_friction=1e3)
    alone = openmm.System()
    for _ in range(3):
        alone.addParticle(50.0)
    other = make()
    for _ in range(3):
        other.addParticle(*entry)
    alone.addForce(other)
    reference = openmm.Context(alone, openmm.VerletIntegrator(1.0), openmm.Platform.getPlatformByName("Reference"))
    for _ in range(3):
        simulation.step(40)
        positions = positions_of(simulation.context)
        assert np.all(np.isfinite(forces_of(simulation.context)))
        reference.setPositions(positions[:3])
        # Energies of chains are left out.
        chains = sum(
            GrownChain(KIND, 2.7, own, positions[filaments.node_indices[number]]).energies[index]
            for number, own in zip(*_monomers(filaments, simulation.context))
            for index in (0, 1)
        )
        assert energy_of(simulation.context) - chains == pytest.approx(energy_of(reference), rel=1e-4, abs=1e-3)
    assert filaments.in_context(simulation.context).growth().nucleated > 0


def _monomers(filaments, context):
    found = filaments.in_context(context).growth()
    return found.filaments, found.monomers


def test_what_a_context_says_of_filaments_that_are_not_there():
    filaments = added(2, 1, 2)
    topology, system, positions = with_surroundings(filaments)
    simulation = simulated(filaments, topology, system, positions)
    inside = filaments.in_context(simulation.context)
    inside.record_tensions()
    inside.set_growth([[0, 0], [0, 60], [0, 0], [0, 0]])
    simulation.step(20)
    found = inside.growth()
    assert found.nodes.tolist()[0] == 0 and found.nodes[1] > 0 and found.lengths._value.tolist()[0] == 0.0
    assert found.identities.tolist() == [-1, 1, -1, -1] and not found.gained[[0, 2, 3]].any()
    for values in (inside.mean_tensions(), inside.mean_joint_tensions(), inside.mean_axial_tensions()):
        assert [len(own) > 0 for own in values] == [False, True, True, False, False]
    with pytest.raises(InputError, match="grows"):
        inside.joint_tensions()
    openmm.LocalEnergyMinimizer.minimize(simulation.context, 1e-3)
    for nodes in (filaments.node_indices[number] for number in (0, 3, 4)):
        assert np.all(positions_of(simulation.context)[nodes] == positions_of(simulation.context)[nodes][0])
    assert np.all(forces_of(simulation.context)[np.concatenate(filaments.node_indices[3:])] == 0.0)


def test_filaments_that_are_not_there_have_no_energy():
    """Also where their particles are behind a wall."""
    filaments = added(nucleation=Nucleation(rate=0.0, region=Sphere([0, 0, 5000], 10.0)))
    simulation = simulated(filaments, *with_surroundings(filaments))
    assert energy_of(simulation.context) == 0.0 and not forces_of(simulation.context).any()
    simulation.step(10)
    assert energy_of(simulation.context) == 0.0


def test_copies_and_xml_of_systems():
    filaments = added(1, 0, 3, nucleation=Nucleation(rate=1e5 / unit.second, region=REGION))
    topology, system, positions = with_surroundings(filaments)
    integrator = filaments.create_integrator(system, 1e6, random_seed=3, checks=False)
    text = openmm.XmlSerializer.serialize(system)
    copies = [system, copy.deepcopy(system), openmm.XmlSerializer.deserialize(text)]
    found = []
    for own in copies:
        assert openmm.XmlSerializer.serialize(own) == text
        cpu = openmm.Platform.getPlatformByName("CPU")
        context = openmm.Context(own, copy.deepcopy(integrator), cpu, {"Threads": "1"})
        context.setPositions(positions)
        context.getIntegrator().step(30)
        found.append(positions_of(context))
    for own in found[1:]:
        np.testing.assert_array_equal(own, found[0])
    assert np.ptp(found[0][filaments.node_indices[1]]) > 0.0


@pytest.mark.parametrize("kind", ["checkpoint", "State", "set_growth"])
def test_contexts_go_back_to_before_filaments_began(kind):
    """Also those that do not vanish by themselves."""
    lasting = Growth(monomers=ACTIN_ATP, pool=POOL, longest=300.0)
    filaments = added(0, 0, 3, growth=lasting, nucleation=Nucleation(rate=1e6 / unit.second, region=REGION))
    context = simulated(filaments, *filaments.build()).context
    inside = filaments.in_context(context)
    checkpoint = context.createCheckpoint()
    state = context.getState(positions=True, parameters=True, integratorParameters=True)
    context.getIntegrator().step(20)
    assert np.all(inside.growth().nodes > 0)
    if kind == "checkpoint":
        context.loadCheckpoint(checkpoint)
    elif kind == "State":
        context.setState(state)
    else:
        inside.set_growth(np.zeros((3, 2), dtype=int))
    assert not inside.growth().nodes.any() and energy_of(context) == 0.0
    positions = positions_of(context)
    for nodes in filaments.node_indices:
        assert np.all(positions[nodes] == positions[nodes][0])
    context.getIntegrator().step(20)
    assert np.all(inside.growth().nodes > 0)


def test_periodic_boxes():
    """Where filaments begin anywhere in the box, with contacts of nearest images."""
    filaments = added(1, 0, 4, nucleation=Nucleation(rate=3e5 / unit.second))
    topology, system, positions = filaments.build(box_vectors=400.0 * np.eye(3))
    system.addForce(capsule_contact_force(filaments, system, 8.0))
    simulation = simulated(filaments, topology, system, positions)
    counts = []
    for _ in range(4):
        simulation.step(10)
        state = simulation.context.getState(positions=True, enforcePeriodicBox=True)
        wrapped = state.getPositions(asNumpy=True)._value
        whole = make_whole(wrapped, filaments, 400.0 * np.eye(3))._value
        nodes = filaments.in_context(simulation.context).growth().nodes
        counts.append((nodes > 0).sum())
        for count, own in zip(nodes, filaments.node_indices):
            assert analysis.count_nodes(whole[own]) == count
    assert counts[-1] >= 4
