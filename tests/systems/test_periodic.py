"""Filaments longer than their periodic box: wrapping, restarts without jumps, and chains made whole again."""

import mdtraj
import numpy as np
import openmm
import pytest
from openmm import unit

from openmm_cylchain import F_ACTIN, Filaments, InputError, InstabilityError
from openmm_cylchain.engines.gpu_platforms import GPU_PLATFORMS
from openmm_cylchain.systems.periodic import make_trajectory_whole, make_whole, remove_jumps
from support.contexts import new_context, positions_of
from support.periodic_systems import BEADS, CUBIC, TRICLINIC, crossing_filaments, particles_of
from support.platforms import ENGINE_SCHEMES, EVERYWHERE
from support.solvent import VISCOSITY


def wrapped_one_by_one(positions, vectors):
    """Every particle in the box, as programs wrap that know of no bonds."""
    positions = np.array(positions)
    for axis in (2, 1, 0):
        edge = vectors[..., axis, :]
        positions -= np.floor(positions[..., axis] / edge[..., axis])[..., None] * edge
    return positions


def lattice_coordinates(differences, vectors):
    """Differences of positions in units of the box vectors."""
    return np.linalg.solve(vectors.T, np.asarray(differences).T).T


def crossing_context(engine, platform, vectors):
    filaments, topology, system, positions = crossing_filaments(engine, vectors)
    integrator = filaments.create_integrator(system, 5e3, scheme="midpoint", particle_friction=5e5, random_seed=4)
    precision = {"Precision": "mixed"} if platform in GPU_PLATFORMS else {}
    context = new_context(system, positions, integrator, platform, precision)
    return filaments, topology, integrator, context


@pytest.mark.sample("^(?!portable-OpenCL-cubic)")
@pytest.mark.parametrize("vectors", [CUBIC, TRICLINIC], ids=["cubic", "triclinic"])
@pytest.mark.parametrize(("engine", "platform"), EVERYWHERE)
def test_wrapping_shifts_whole_filaments_and_restarts_do_not_jump(engine, platform, vectors):
    filaments, _, integrator, context = crossing_context(engine, platform, vectors)
    start = positions_of(context)
    integrator.step(60)
    checkpoint = context.createCheckpoint()
    # As Simulation.saveState does.
    saved = context.getState(positions=True, velocities=True, parameters=True, integratorParameters=True)
    free, wrapped = positions_of(context), positions_of(context, wrapped=True)
    assert np.abs(free - start)[:, 0].min() > 2000
    for particles in particles_of(filaments):
        shift = lattice_coordinates(wrapped[particles] - free[particles], vectors)
        assert np.abs(shift - np.round(shift[0])).max() < 1e-5
        assert np.abs(np.round(shift[0])).max() >= 1
        assert np.ptp(free[particles], axis=0).max() > 1500

    integrator.step(20)
    end = positions_of(context)
    for what, restart in (("wrapped", wrapped), ("one by one", wrapped_one_by_one(wrapped, vectors))):
        again, _, other, context = crossing_context(engine, platform, vectors)
        context.loadCheckpoint(checkpoint)
        context.setPositions(make_whole(restart, again, context.getState().getPeriodicBoxVectors()))
        other.step(20)
        shift = lattice_coordinates(positions_of(context) - end, vectors)
        for particles in [*([bead] for bead in range(BEADS)), *particles_of(again)]:
            # The drift has no images, but it is the same everywhere.
            assert np.abs(shift[particles] - np.round(shift[particles[0]])).max() < 2e-5, what
    for what in ("checkpoint", "state"):
        _, _, other, context = crossing_context(engine, platform, vectors)
        if what == "checkpoint":
            context.loadCheckpoint(checkpoint)
        else:
            context.setState(openmm.XmlSerializer.deserialize(openmm.XmlSerializer.serialize(saved)))
        other.step(20)
        assert np.abs(positions_of(context) - end).max() < 0.02, what


@pytest.mark.parametrize("engine, scheme", ENGINE_SCHEMES)
def test_torn_filaments_are_refused_with_advice(engine, scheme):
    filaments, _, system, positions = crossing_filaments(engine, CUBIC)
    integrator = filaments.create_integrator(system, 5e3, scheme=scheme, particle_friction=1e4)
    context = new_context(system, positions, integrator)
    integrator.step(1)
    context.setPositions(wrapped_one_by_one(positions._value, CUBIC))
    error, what = (InputError, "is torn") if engine == "compiled" else (InstabilityError, "has blown up")
    with pytest.raises(error, match=rf"Filament \d \(ACT\) {what} .*openmm_cylchain\.make_whole"):
        integrator.step(1)
    context.setPositions(positions)
    integrator.step(1)


@pytest.mark.parametrize("vectors", [CUBIC, TRICLINIC], ids=["cubic", "triclinic"])
def test_make_whole(vectors):
    filaments, topology, system, positions = crossing_filaments(None, vectors)
    torn = wrapped_one_by_one(positions._value, vectors)
    assert np.linalg.norm(np.diff(torn[filaments.node_indices[0]], axis=0), axis=1).max() > 1000
    for box in (vectors, topology.getPeriodicBoxVectors(), system.getDefaultPeriodicBoxVectors(), vectors.tolist()):
        whole = make_whole(torn, filaments, box).value_in_unit(unit.nanometer)
        for nodes, particles in zip(filaments.node_indices, particles_of(filaments)):
            assert np.array_equal(whole[nodes[0]], torn[nodes[0]])
            shift = whole[particles] - positions._value[particles]
            assert np.abs(shift - shift[0]).max() < 1e-9
        assert np.array_equal(whole[:BEADS], torn[:BEADS])
    angstrom = make_whole(10 * torn * unit.angstrom, filaments, 10 * vectors * unit.angstrom)
    assert angstrom.value_in_unit(unit.nanometer) == pytest.approx(whole)
    # What is whole already stays as it is, to the bit.
    assert np.array_equal(make_whole(positions, filaments, vectors)._value, positions._value)


def test_make_whole_takes_frames_with_boxes_of_their_own():
    filaments, _, _, positions = crossing_filaments(None, CUBIC)
    boxes = np.array([CUBIC, 1.1 * TRICLINIC])
    torn = np.array([wrapped_one_by_one(positions._value, box) for box in boxes])
    whole = make_whole(torn, filaments, boxes)._value
    for frame, box, result in zip(torn, boxes, whole):
        assert np.array_equal(result, make_whole(frame, filaments, box)._value)
    boxes[1] = 700 * np.eye(3)
    with pytest.raises(InputError, match=r"Filament 0 \(ACT\) at rest in frame 1: segment 0 is 360 nm long"):
        make_whole(torn, filaments, boxes)


def _trajectory(vectors, frames):
    # Filaments that fly apart by 400 nm a frame, wrapped one particle after the other; and as they are.
    filaments, topology, _, positions = crossing_filaments(None, vectors)
    steps = np.zeros((frames, len(positions), 3))
    for number, particles in enumerate(particles_of(filaments)):
        steps[:, particles] = 400.0 * np.arange(frames)[:, None, None] * np.eye(3)[number]
    free = positions._value + steps
    torn = wrapped_one_by_one(free, np.broadcast_to(vectors, (1, 1, 3, 3)))
    trajectory = mdtraj.Trajectory(torn, mdtraj.Topology.from_openmm(topology))
    trajectory.unitcell_vectors = np.repeat(vectors[None], frames, axis=0)
    return filaments, trajectory, free


@pytest.mark.parametrize("vectors", [CUBIC, TRICLINIC], ids=["cubic", "triclinic"])
def test_trajectories(vectors):
    filaments, trajectory, free = _trajectory(vectors, 12)
    torn = trajectory.xyz.copy()
    whole, continuous = make_trajectory_whole(trajectory), remove_jumps(trajectory)
    assert np.array_equal(trajectory.xyz, torn)
    for particles in particles_of(filaments):
        differences = whole.xyz[:, particles] - free[:, particles]
        assert np.abs(differences - differences[:, :1]).max() < 0.01
        # Continuous in time as well: one lattice vector for all frames.
        differences = continuous.xyz[:, particles] - free[:, particles]
        assert np.abs(differences - differences[0, 0]).max() < 0.01
    assert np.abs(np.diff(whole.xyz[:, 4], axis=0)).max() > 900
    assert np.array_equal(continuous.xyz[:, :BEADS], torn[:, :BEADS])


def test_bad_input_is_refused():
    filaments, topology, _, positions = crossing_filaments(None, CUBIC)
    for box, message in (
        (720 * np.eye(3), r"Filament 0 \(ACT\) at rest: segment 0 is 360 nm long, and the box 720 nm wide"),
        (np.diag([1500, 1500, 0]), "The box must be wider than zero"),
        (-CUBIC, "The box must be wider than zero"),
        (TRICLINIC.T, "must be along x"),
        ([1500, 1500, 1500], "box_vectors must be three vectors"),
        (np.nan * CUBIC, "box_vectors must be finite"),
        (CUBIC * unit.kelvin, "box_vectors has the unit"),
    ):
        with pytest.raises(InputError, match=message):
            make_whole(positions, filaments, box)
    for given, message in (
        (positions[:-1], r"positions must have the shape .* up to particle"),
        (positions._value.T, "positions must have the shape"),
        (np.nan * positions, "positions must be finite"),
        (positions._value * unit.kelvin, "positions has the unit"),
    ):
        with pytest.raises(InputError, match=message):
            make_whole(given, filaments, CUBIC)
    stretched = positions._value.copy()
    stretched[4 : 4 + 11] *= 2.4
    with pytest.raises(InputError, match=r"Filament 0 \(ACT\): segment \d is \d+(\.\d)? nm long, and the box 1500 nm"):
        make_whole(stretched, filaments, CUBIC)
    with pytest.raises(InputError, match="filaments must be a Filaments object"):
        make_whole(positions, [range(9)], CUBIC)
    unbuilt = Filaments(VISCOSITY, 310)
    unbuilt.add_straight(F_ACTIN, 2, [0, 0, 0], [1, 0, 0])
    with pytest.raises(InputError, match="not in a System yet"):
        make_whole(positions, unbuilt, CUBIC)
    trajectory = mdtraj.Trajectory(positions._value[None], mdtraj.Topology.from_openmm(topology))
    with pytest.raises(InputError, match="has no periodic box"):
        make_trajectory_whole(trajectory)


def test_beads_go_with_their_filament():
    filaments = Filaments(VISCOSITY, 310)
    filaments.add_straight(F_ACTIN, 6, [0, 700, 700], [1, 0.3, 0.2])
    filaments.add_beads(0, 100)
    topology, _, positions = filaments.build(box_vectors=CUBIC)
    torn = wrapped_one_by_one(
        np.tile(positions._value, (3, 1, 1)) + [[[0, 0, 0]], [[600, 0, 0]], [[1200, 0, 0]]], CUBIC
    )
    trajectory = mdtraj.Trajectory(torn, mdtraj.Topology.from_openmm(topology))
    trajectory.unitcell_vectors = np.tile(CUBIC, (3, 1, 1))
    whole, continuous = make_trajectory_whole(trajectory), remove_jumps(trajectory)
    for result in (whole, continuous):
        shape = result.xyz - result.xyz[:, :1]
        np.testing.assert_allclose(shape, np.tile(positions._value - positions._value[0], (3, 1, 1)), atol=1e-3)
    np.testing.assert_allclose(np.diff(continuous.xyz[:, :, 0], axis=0), 600, atol=1e-3)
