"""Analysis of filaments that grow: nodes that they have in a frame are looked at, and spare ones left out."""

import mdtraj
import numpy as np
import pytest
from openmm import unit

from openmm_cylchain import (
    ACTIN_ATP,
    F_ACTIN,
    Filaments,
    Growth,
    InputError,
    RunReporter,
    Sphere,
    analysis,
    capsule_contact_force,
    filament_wall_force,
    make_trajectory_whole,
    remove_jumps,
)
from openmm_cylchain.couplings.contact_frames import find_contacts
from support.contexts import new_simulation, positions_of
from support.solvent import KT, TEMPERATURE, VISCOSITY

KIND = F_ACTIN.with_segment_length(54.0)
FRAMES = 4


@pytest.fixture(scope="module")
def grown(tmp_path_factory):
    """A run of filaments in a narrow sphere, all but the last of which grow, and what they are like in each frame."""
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine="compiled")
    pool = unit.Quantity(50e-6, unit.molar)
    for number in range(6):
        growth = Growth(monomers=ACTIN_ATP, pool=pool, longest=500.0) if number < 5 else None
        start = [-80, 24 * (number // 3), 24 * (number % 3)]
        filaments.add_straight(KIND, 3, start, [1, 0, 0], growth=growth)
    topology, system, positions = filaments.build()
    contacts = capsule_contact_force(filaments, system, 20.0)
    system.addForce(contacts)
    system.addForce(filament_wall_force(filaments, system, Sphere([0, 12, 24], 100.0), 1.0))
    integrator = filaments.create_integrator(system, 2e7, random_seed=2, checks=False)
    simulation = new_simulation(topology, system, positions, integrator)
    directory = tmp_path_factory.mktemp("run")
    simulation.reporters.append(RunReporter(directory, 250, filaments))
    seen = []
    for _ in range(FRAMES):
        simulation.step(250)
        state, frame = filaments.in_context(simulation.context).growth(), find_contacts(contacts, simulation.context)
        seen.append((positions_of(simulation.context), state, frame))
    return filaments, analysis.load(directory), seen


def test_frames_have_the_nodes_that_there_are(grown):
    filaments, run, seen = grown
    assert len(run) == FRAMES + 1 and run.filaments[0].monomer_length == 2.7 and run.filaments[5].monomer_length == 0.0
    for frame, (positions, state, _) in enumerate(seen, 1):
        counts = [*state.nodes, 4]
        for own, nodes, count in zip(run.nodes(frame), filaments.node_indices, counts, strict=True):
            np.testing.assert_allclose(own, positions[nodes[:count]], atol=1e-4)
        assert [len(own) for own in run.curves(frame)] == counts
        assert [len(own) for own in run.bends(frame)] == [count - 1 for count in counts]
        assert [len(own) for own in run.segment_tensions(frame)] == [count - 1 for count in counts]
        np.testing.assert_array_equal([run.monomers(frame)[i] for i in range(5)], state.monomers)
    assert max(counts) > 4 and run.growth["nodes"].shape == (FRAMES + 1, 5)
    with pytest.raises(InputError, match="average=1"):
        run.segment_tensions(2, average=3)


def test_contacts_and_stress_of_runs(grown):
    """Contacts are those of the compiled engine; the ideal part has the nodes that there are."""
    _, run, seen = grown
    touched = 0
    for frame, (_, state, expected) in enumerate(seen, 1):
        found = run.contacts(frame)
        touched += len(expected.gaps)
        assert len(found.gaps) == len(expected.gaps)
        np.testing.assert_allclose(np.sort(found.gaps), np.sort(expected.gaps), atol=1e-4)
        np.testing.assert_array_equal(np.sort(found.filaments, axis=0), np.sort(expected.filaments, axis=0))
        stress = analysis.stress(run, frame, volume=1e6)
        np.testing.assert_allclose(np.diag(stress.ideal), -(state.nodes.sum() + 4) * KT / 1e6)
        assert np.all(np.isfinite(stress.chains))
    assert touched > 0
    assert analysis.contact_map(run, 4, gap=20.0).any() and analysis.filament_distances(run, 4, 30.0).shape == (6, 6)
    assert len(analysis.contraction(run)) == FRAMES + 1
    with pytest.raises(InputError, match="mesh size changes"):
        analysis.mesh_size(run, volume=1e6)


def test_trajectories(grown):
    """Of what there is for a node, segment or joint, spare ones are NaN; averages are over the others."""
    filaments, run, seen = grown
    trajectory = run.mdtraj()
    shapes = analysis.node_positions, analysis.segment_lengths, analysis.tangents, analysis.joint_cosines
    for frame, (positions, state, _) in enumerate(seen, 1):
        for function, fewer in zip(shapes, (0, 1, 1, 2)):
            there = [np.isfinite(own[frame]).reshape(len(own[frame]), -1).all(axis=1) for own in function(trajectory)]
            for own, count in zip(there, [*state.nodes, 4]):
                assert own[: count - fewer].all() and not own[count - fewer :].any()
        nodes = [positions[own[:count]] for own, count in zip(filaments.node_indices, [*state.nodes, 4])]
        for function, value in (
            (analysis.contour_lengths, lambda x: np.linalg.norm(np.diff(x, axis=0), axis=1).sum()),
            (analysis.end_to_end_vectors, lambda x: x[-1] - x[0]),
            (analysis.radii_of_gyration, lambda x: np.sqrt(np.var(x, axis=0).sum())),
            (analysis.centers_of_mass, lambda x: 0.5 * (x[1:] + x[:-1]).mean(axis=0)),
        ):
            np.testing.assert_allclose(function(trajectory)[frame], [value(own) for own in nodes], atol=1e-3)
    assert [own.shape[1] for own in analysis.filament_curves(trajectory)] == [11, 11, 11, 11, 11, 4]
    for function in (
        analysis.persistence_length,
        analysis.bending_drift,
        analysis.tangent_correlation,
        analysis.mean_square_displacement,
        lambda t: analysis.bending_mode_amplitudes(t, 0, 1),
    ):
        with pytest.raises(InputError, match=r"Filament 0 grows: \d to \d of its 11 particles are nodes"):
            function(trajectory)
    assert analysis.mean_square_displacement(trajectory, 5).nodes[0] == 0.0


def test_trajectories_in_boxes(grown):
    """Wrapped, made whole, without jumps and turned: spare nodes stay where the last node is."""
    _, run, seen = grown
    trajectory = run.mdtraj()
    box = np.repeat(180.0 * np.eye(3, dtype=np.float32)[None], len(trajectory), axis=0)
    wrapped = mdtraj.Trajectory(trajectory.xyz % 180.0, trajectory.topology)
    wrapped.unitcell_vectors = box
    for made in (make_trajectory_whole(wrapped), remove_jumps(wrapped), trajectory.superpose(trajectory)):
        for number, nodes in enumerate(analysis.filament_nodes(trajectory)[:5]):
            counts = [state.nodes[number] for _, state, _ in seen]
            np.testing.assert_array_equal(analysis.count_nodes(made.xyz[:, nodes]), [4, *counts])


@pytest.mark.parametrize("wrong", [np.zeros((3,)), np.zeros((2, 1, 3)), np.zeros((2, 4, 2)), 1 * unit.second])
def test_positions_without_nodes_to_count(wrong):
    with pytest.raises(InputError, match="positions"):
        analysis.count_nodes(wrong)
