"""Reporters of forces of walls and contacts: what they write, and which steps it is the mean of."""

import io

import numpy as np
import pytest

from openmm_cylchain import (
    F_ACTIN,
    ContactForceReporter,
    Filaments,
    InputError,
    Plane,
    Slab,
    WallForceReporter,
    capsule_contact_force,
    contact_forces,
    filament_wall_force,
    wall_force,
    wall_forces,
)
from support.contexts import new_simulation, positions_of
from support.solvent import TEMPERATURE, VISCOSITY

FLOOR = Plane([0, 0, 0], [0, 0, 1])


def _simulation(forces=True):
    filaments = Filaments(VISCOSITY, TEMPERATURE)
    for number in range(3):
        filaments.add_straight(F_ACTIN.with_segment_length(100), 2, [0, 10 * number, -3], [1, 0, 0])
    topology, system, positions = filaments.build()
    if forces:
        system.addForce(filament_wall_force(filaments, system, Slab([0, 0, 5], [0, 0, 1], 10.0), 0.3))
        system.addForce(wall_force(FLOOR, 0.3, filaments.node_indices[0]))
        system.addForce(capsule_contact_force(filaments, system, 12.0, 2.0))
    integrator = filaments.create_integrator(system, 1e4, random_seed=1, checks=False)
    return filaments, new_simulation(topology, system, positions, integrator)


def test_reports_are_means_over_the_steps_since_the_one_before():
    """Of two reporters with other intervals, beside what Python is told."""
    filaments, simulation = _simulation()
    wall_file, contact_file = io.StringIO(), io.StringIO()
    walls = WallForceReporter(wall_file, 4)
    simulation.reporters += [walls, WallForceReporter(None, 3), ContactForceReporter(contact_file, 6, filaments)]
    contacts = simulation.reporters[-1]
    simulation.step(12)
    (told, portable), (touched,) = wall_forces(simulation.context), contact_forces(simulation.context)
    assert walls.places == [(0, 0), (0, 1), (1, 0)]
    np.testing.assert_array_equal(walls["duration_ps"], np.tile([4e4, 4e4, 0.0], (3, 1)))
    np.testing.assert_allclose(walls["load"][:, :2].mean(axis=0), told.loads._value, rtol=1e-9)
    np.testing.assert_allclose(walls["force_z"][:, :2].mean(axis=0), told.sums._value[:, 2], rtol=1e-9)
    assert walls["load"].min(axis=0)[1] > 0.0
    depths = np.maximum(0.0, -positions_of(simulation.context)[filaments.node_indices[0], 2])
    assert walls["load"][-1, 2] == pytest.approx(0.3 * depths.sum()) == pytest.approx(portable.loads._value[0])
    assert simulation.reporters[1]["duration_ps"][:, 0].tolist() == [3e4] * 4
    assert contacts["load"].shape == (2, 3) and contacts["load"].min() > 0.0
    np.testing.assert_allclose(contacts["load"].mean(axis=0), touched.loads_of_filaments(filaments)._value, rtol=1e-9)
    for axis in range(3):
        found = contacts[f"force_{'xyz'[axis]}"].mean(axis=0)
        np.testing.assert_allclose(found, touched.on_filaments(filaments)._value[:, axis], atol=1e-9)
    lines = wall_file.getvalue().splitlines()
    assert lines[0] == "step,time_ps,wall,face,duration_ps,load,force_x,force_y,force_z"
    assert [line.split(",")[:5] for line in lines[1:4]] == [
        ["4", "40000", "0", "0", "40000"],
        ["4", "40000", "0", "1", "40000"],
        ["4", "40000", "1", "0", "0"],
    ]
    assert len(lines) == 10 and len(contact_file.getvalue().splitlines()) == 7
    with pytest.raises(InputError, match="There is no column 'pressure'"):
        walls["pressure"]


def test_reporters_go_on_with_their_files(tmp_path):
    path = str(tmp_path / "wall_forces.csv")
    for append in (False, True):
        _, simulation = _simulation()
        simulation.reporters.append(WallForceReporter(path, 5, append=append))
        simulation.step(10)
        simulation.reporters[0].close()
    assert np.loadtxt(path, delimiter=",", skiprows=1)[:, 0].tolist() == [5.0] * 3 + [10.0] * 3 + [5.0] * 3 + [10.0] * 3


@pytest.mark.parametrize("kind", ["walls", "contacts"])
def test_systems_without_such_forces_are_refused(kind):
    filaments, simulation = _simulation(forces=False)
    reporter = WallForceReporter(None, 1) if kind == "walls" else ContactForceReporter(None, 1, filaments)
    simulation.reporters.append(reporter)
    with pytest.raises(InputError, match=f"There are no {kind} to report"):
        simulation.step(1)
