"""Reporters of tension and of filaments against numbers from a trajectory that was written in the same run."""

import csv

import mdtraj
import numpy as np
import openmm
import pytest
from openmm import app

from openmm_cylchain import F_ACTIN, Filaments, InputError
from openmm_cylchain.output.reporters import FilamentReporter, TensionReporter
from support.contexts import close_reporters, new_simulation
from support.periodic_systems import CUBIC, TRICLINIC, crossing_simulation
from support.solvent import TEMPERATURE, VISCOSITY


def pulled(filaments, force, temperature=0, step=1e4):
    """A Simulation in which the last node of filament 0 is pulled by a force, without noise unless at a temperature."""
    topology, system, positions = filaments.build()
    pull = openmm.CustomExternalForce("-(fx*x+fy*y+fz*z)")
    for name, value in zip(("fx", "fy", "fz"), force):
        pull.addGlobalParameter(name, float(value))
    pull.addParticle(int(filaments.node_indices[0][-1]), [])
    system.addForce(pull)
    integrator = filaments.create_integrator(system, step, scheme="euler", temperature=temperature)
    return new_simulation(topology, system, positions, integrator)


@pytest.mark.parametrize("tension", [3.0, -0.02])
def test_a_filament_that_is_held_at_one_end_and_pulled_at_the_other_has_one_tension(engine, tension, tmp_path):
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine=engine)
    length = F_ACTIN.segment_length + tension / F_ACTIN.segment_stiffness
    filaments.add_nodes(F_ACTIN, length * np.arange(6)[:, None] * np.array([1, 0, 0]), clamped=[0])
    filaments.add_equilibrium(F_ACTIN, 1, seed=1)
    simulation = pulled(filaments, [tension, 0, 0])
    summary = TensionReporter(tmp_path / "tension.csv", 1, filaments)
    joints = TensionReporter(str(tmp_path / "joints.csv"), 2, filaments, joints=True)
    simulation.reporters += [summary, joints]
    simulation.step(4)
    assert summary.places == [(0,)] and joints.places == [(0, joint) for joint in range(4)]
    for column in ("mean_tension", "minimum_tension", "maximum_tension"):
        assert summary[column] == pytest.approx(np.full((4, 1), tension), rel=1e-6)
    assert joints["tension"] == pytest.approx(np.full((2, 4), tension), rel=1e-6)
    with open(tmp_path / "joints.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    assert list(rows[0]) == ["step", "time_ps", "filament", "joint", "tension"]
    assert [int(row["joint"]) for row in rows] == [0, 1, 2, 3] * 2
    assert [float(row["tension"]) for row in rows] == pytest.approx(joints["tension"].ravel(), rel=1e-9)
    with open(tmp_path / "tension.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    assert list(rows[0]) == ["step", "time_ps", "filament", "mean_tension", "minimum_tension", "maximum_tension"]
    assert [int(row["step"]) for row in rows] == [1, 2, 3, 4]


def test_tension_is_what_moves_the_segments_behind_a_joint(engine, tmp_path):
    """Without noise: Phi of a joint is the force on the segments behind it, less the drag on them as they move.

    Velocities are those of the trajectory, so nothing of how tensions are computed is used.
    """
    force = np.array([2.0, -5.0, 1.0])
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine=engine)
    # About the origin, where the numbers of the file are good to the most digits.
    filaments.add_equilibrium(F_ACTIN, 7, seed=3, start=[-1200, 0, 0], direction=[1, 0, 0])
    filaments.add_equilibrium(F_ACTIN, 4, seed=4, start=[-700, 0, 0], direction=[1, 0, 0])
    step = 2e4
    simulation = pulled(filaments, force, step=step)
    reporter = TensionReporter(None, 1, filaments, joints=True)
    simulation.reporters += [app.DCDReporter(str(tmp_path / "motion.dcd"), 1), reporter]
    simulation.step(5)
    close_reporters(simulation)
    frames = mdtraj.load(str(tmp_path / "motion.dcd"), top=mdtraj.Topology.from_openmm(simulation.topology)).xyz
    friction = F_ACTIN.segment_friction(VISCOSITY, TEMPERATURE)
    checked = 0
    for now, then, reported in zip(frames[:-1].astype(float), frames[1:], reporter["tension"]):
        expected = []
        for nodes, pull in zip(filaments.node_indices, (force, np.zeros(3))):
            segments = np.diff(now[nodes], axis=0)
            tangents = segments / np.linalg.norm(segments, axis=1)[:, None]
            velocity = (then[nodes] - now[nodes]) / step
            velocity = 0.5 * (velocity[1:] + velocity[:-1])
            along = np.sum(velocity * tangents, axis=1)[:, None] * tangents
            drag = friction.parallel * along + friction.perpendicular * (velocity - along)
            behind = np.cumsum(drag[::-1], axis=0)[::-1][1:]
            directions = tangents[1:] + tangents[:-1]
            directions /= np.linalg.norm(directions, axis=1)[:, None]
            expected.append(np.sum((pull - behind) * directions, axis=1))
        expected = np.concatenate(expected)
        # Positions in the file are good to 1e-4 nm, and velocities to 1e-8 nm/ps.
        assert reported == pytest.approx(expected, abs=0.02)
        checked += np.abs(expected).max() > 1
    assert checked == 4


@pytest.mark.parametrize("vectors", [CUBIC, TRICLINIC], ids=["cubic", "triclinic"])
@pytest.mark.parametrize("wrapped", [False, True])
def test_numbers_are_those_of_the_trajectory_in_a_periodic_box(engine, wrapped, vectors, tmp_path):
    filaments, simulation = crossing_simulation(engine, vectors)
    simulation.reporters.append(app.DCDReporter(str(tmp_path / "box.dcd"), 2, enforcePeriodicBox=wrapped))
    reporter, tensions = FilamentReporter(None, 2, filaments), TensionReporter(None, 2, filaments, joints=True)
    simulation.reporters += [reporter, tensions]
    simulation.step(8)
    close_reporters(simulation)
    frames = mdtraj.load(str(tmp_path / "box.dcd"), top=mdtraj.Topology.from_openmm(simulation.topology)).xyz
    frames = frames.astype(float)
    assert len(frames) == 4
    for number, nodes in enumerate(filaments.node_indices):
        segments = np.diff(frames[:, nodes], axis=1)
        lengths = np.linalg.norm(segments, axis=2)
        tangents = segments / lengths[..., None]
        cosines = np.sum(tangents[:, 1:] * tangents[:, :-1], axis=2)
        stretching = F_ACTIN.stretching_energy(lengths).sum(axis=1)
        bending = F_ACTIN.bending_energy(cosines).sum(axis=1)
        end_to_end = np.linalg.norm(frames[:, nodes[-1]] - frames[:, nodes[0]], axis=1)
        assert reporter["contour_length"][:, number] == pytest.approx(lengths.sum(axis=1), abs=0.01)
        assert reporter["end_to_end_distance"][:, number] == pytest.approx(end_to_end, abs=0.01)
        # Single precision in lengths, times the stiffness, in the sum over segments.
        assert reporter["stretching_energy"][:, number] == pytest.approx(stretching, rel=0.05, abs=0.5)
        assert reporter["bending_energy"][:, number] == pytest.approx(bending, rel=0.01)
    last = filaments.in_context(simulation.context).joint_tensions()
    for (number, joint), tension in zip(tensions.places, tensions["tension"][-1]):
        nodes = frames[-1, filaments.node_indices[number]][joint : joint + 3]
        tangents = np.diff(nodes, axis=0) / np.linalg.norm(np.diff(nodes, axis=0), axis=1)[:, None]
        direction = tangents.sum(axis=0) / np.linalg.norm(tangents.sum(axis=0))
        phi = last[number][joint]._value
        assert tension == pytest.approx(phi @ direction, abs=1e-3 * np.linalg.norm(phi) + 1e-6)


def test_bad_input_is_refused():
    filaments = Filaments(VISCOSITY, TEMPERATURE)
    filaments.add_equilibrium(F_ACTIN, 1, seed=1)
    with pytest.raises(InputError, match="not in a System yet"):
        two = Filaments(VISCOSITY, TEMPERATURE)
        two.add_equilibrium(F_ACTIN, 2, seed=1)
        TensionReporter(None, 1, two)
    filaments.build()
    for joints in (False, True):
        with pytest.raises(InputError, match="no tensions to report"):
            TensionReporter(None, 1, filaments, joints=joints)
