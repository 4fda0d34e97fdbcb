"""Tensions as means over a step, with friction and noise: against outer forces, and against those without noise."""

import copy

import numpy as np
import openmm
import pytest

from openmm_cylchain import F_ACTIN, Filaments, Flow, InputError
from openmm_cylchain.mechanics.geometry import regular_polygon, segment_vectors
from openmm_cylchain.output.reporters import TensionReporter
from support.contexts import new_context, new_simulation, positions_of
from support.solvent import TEMPERATURE, VISCOSITY


def context_of(filaments, step=None, pull=0.0, recording=True, **options):
    """A Context in which the last nodes of all filaments are pulled along x."""
    _, system, positions = filaments.build()
    if pull:
        force = openmm.CustomExternalForce("-pull*x")
        force.addGlobalParameter("pull", pull)
        for nodes in filaments.node_indices:
            force.addParticle(int(nodes[-1]), [])
        system.addForce(force)
    step = filaments.recommended_time_step(system=system) if step is None else step
    integrator = filaments.create_integrator(system, step, random_seed=3, checks=False, **options)
    context = new_context(system, positions, integrator)
    if recording:
        integrator.setRecordsTensions(True)
    return context, integrator


def standard_error(values):
    """Of the mean, from the means (copies, ...) of copies that do not know of each other."""
    return values.std(axis=0, ddof=1) / np.sqrt(len(values))


def mean_forces(context, filaments, integrator, steps):
    """Means over so many steps of joint forces (filaments, joints, 3)."""
    forces = 0.0
    for _ in range(steps):
        integrator.step(1)
        forces = (
            forces + np.array([part._value for part in filaments.in_context(context).mean_joint_tensions()]) / steps
        )
    return forces


def filaments_that_are(what):
    """Some filaments of a kind, their flow and the force that pulls them."""
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine="compiled")
    options = {"planar": what == "planar", "propulsion": 0.3 if what == "propelled" else 0.0}
    for seed, segments in enumerate((6, 6, 4)):
        if what == "rings":
            ring = regular_polygon(5 + segments, F_ACTIN.segment_length, np.zeros(3), np.array([0.6, 0, 0.8]))
            displaced = ring + np.random.default_rng(seed).normal(scale=0.1, size=ring.shape)
            filaments.add_nodes(F_ACTIN, displaced, closed=True)
        else:
            filaments.add_equilibrium(F_ACTIN, segments, seed=seed, **options)
    if what == "tethered":
        filaments.add_tether(0, 2, filaments[0].positions[2] + [50, -20, 10], 0.2)
        filaments.add_tether(1, -1, filaments[1].positions[-1] + [50, -20, 10], 0.2)
    gradient = 1e-8 * np.array([[1, 2, 3], [-1, 2, 1], [2, 1, -3]])
    return filaments, Flow([1e-3, 2e-3, 0], gradient) if what == "in a flow" else None, 2.0 * (what == "pulled")


KINDS = ["open", "pulled", "rings", "planar", "in a flow", "tethered", "propelled"]


@pytest.mark.parametrize("what", KINDS)
def test_without_noise_a_short_step_has_the_instantaneous_tensions(what):
    differences = []
    for step in (20.0, 10.0):
        filaments, flow, pull = filaments_that_are(what)
        context, integrator = context_of(filaments, step, pull, temperature=0.0, flow=flow)
        here = filaments.in_context(context)
        expected = here.joint_tensions()
        integrator.step(1)
        found = here.mean_joint_tensions()
        assert [len(part) for part in found] == [len(one.joint_stiffnesses) for one in filaments]
        scale = max(np.abs(part._value).max() for part in expected)
        assert scale > 1e-3
        differences.append(max(np.abs(a._value - b._value).max() for a, b in zip(expected, found)) / scale)
    assert differences[0] < 2e-3
    # The rest is of first order in the step.
    assert differences[1] < 0.6 * differences[0] + 1e-9


@pytest.mark.parametrize("what", ["open", "pulled", "rings", "planar", "tethered", "propelled"])
def test_without_noise_tension_is_elastic_force_and_friction_of_the_length(what):
    step = 100.0
    filaments, _, pull = filaments_that_are(what)
    context, integrator = context_of(filaments, step, pull, temperature=0.0)
    before = positions_of(context)
    integrator.step(1)
    after = positions_of(context)
    for filament, nodes, found in zip(filaments, filaments.node_indices, filaments.in_context(context).mean_tensions()):
        friction = filament.type.segment_friction(VISCOSITY, TEMPERATURE, filament.segments).extensional
        start, end = (np.linalg.norm(segment_vectors(x[nodes], filament.closed), axis=1) for x in (before, after))
        elastic = filament.type.stretching_derivative(0.5 * (start + end))
        expected = elastic + friction * (end - start) / (step * start * end)
        assert found._value == pytest.approx(expected, rel=1e-3, abs=1e-3 * np.abs(expected).max())


def test_joints_of_a_pulled_filament_carry_the_force():
    """The mean over time is exact: the force at the end acts on all behind a joint; friction and noise have no mean."""
    force = 0.3
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine="compiled")
    for seed in range(48):
        filaments.add_equilibrium(F_ACTIN, 6, seed=seed, direction=[1, 0, 0], clamped=[0])
    context, integrator = context_of(filaments, pull=force)
    integrator.step(200)
    forces = mean_forces(context, filaments, integrator, 1200)
    expected = np.array([force, 0, 0])
    error = standard_error(forces)
    assert error[:, 0].max() < 0.0125 * force
    assert np.all(np.abs(forces.mean(axis=0) - expected) < 4 * error)


def test_joints_between_two_traps_carry_the_force_of_the_traps():
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine="compiled")
    stiffness, length = 0.01, 6 * F_ACTIN.segment_length
    for number in range(48):
        filaments.add_straight(F_ACTIN, 6, [0, 0, 0], [1, 0, 0])
        filaments.add_tether(number, 0, [-30, 0, 0], stiffness)
        filaments.add_tether(number, -1, [length + 30, 0, 0], stiffness)
    context, integrator = context_of(filaments)
    last = np.array([nodes[-1] for nodes in filaments.node_indices])
    integrator.step(200)
    forces, steps = 0.0, 1000
    trap = 0.0
    for _ in range(steps):
        integrator.step(1)
        forces = (
            forces
            + np.array([part._value for part in filaments.in_context(context).mean_joint_tensions()])[:, :, 0] / steps
        )
        positions = positions_of(context)
        trap = trap + stiffness * (length + 30 - positions[last, 0]) / steps
    error = standard_error(forces - trap[:, None])
    assert error.max() < 0.0125 * trap.mean()
    assert np.all(np.abs((forces - trap[:, None]).mean(axis=0)) < 4 * error)


def test_recording_changes_no_trajectory_and_ends_with_the_last_step():
    ends, values = [], []
    for calls, recording in (([40], True), ([40], False), ([1] * 40, True), ([13, 27], True)):
        filaments = Filaments(VISCOSITY, TEMPERATURE, engine="compiled")
        for seed in range(9):
            filaments.add_equilibrium(F_ACTIN, 5, seed=seed)
        context, integrator = context_of(filaments, recording=recording)
        for steps in calls:
            integrator.step(steps)
        ends.append(positions_of(context))
        if recording:
            values.append(np.concatenate([part._value for part in filaments.in_context(context).mean_joint_tensions()]))
    assert all(np.array_equal(ends[0], end) for end in ends)
    assert all(np.array_equal(values[0], value) for value in values)
    assert copy.deepcopy(integrator).getRecordsTensions()


def test_reporter_of_means(tmp_path):
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine="compiled")
    for seed, segments in enumerate((5, 1, 3)):
        filaments.add_equilibrium(F_ACTIN, segments, seed=seed)
    topology, system, positions = filaments.build()
    step = filaments.recommended_time_step()
    integrator = filaments.create_integrator(system, step, random_seed=3)
    simulation = new_simulation(topology, system, positions, integrator)
    here = filaments.in_context(simulation.context)
    summary = TensionReporter(tmp_path / "tension.csv", 5, filaments, mean=True)
    joints = TensionReporter(None, 5, filaments, joints=True, mean=True)
    simulation.reporters += [summary, joints]
    simulation.step(20)
    assert joints["tension"].shape == (4, 6) and summary["mean_tension"].shape == (4, 2)
    assert np.array_equal(joints.step, [5, 10, 15, 20])
    axial = [part._value for part in here.mean_axial_tensions()]
    assert joints["tension"][-1] == pytest.approx(np.concatenate(axial))
    assert summary["maximum_tension"][-1] == pytest.approx([axial[0].max(), axial[2].max()])
    forces = [part._value for part in here.mean_joint_tensions()]
    for along, vectors in zip(axial, forces):
        assert np.all(np.abs(along) <= np.linalg.norm(vectors, axis=1) * (1 + 1e-12))


def test_what_cannot_be_recorded_is_refused():
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine="compiled")
    filaments.add_equilibrium(F_ACTIN, 3, seed=1)
    context, integrator = context_of(filaments, 10.0, recording=False)
    here = filaments.in_context(context)
    integrator.step(1)
    for call in (here.mean_joint_tensions, here.mean_tensions, here.mean_axial_tensions):
        with pytest.raises(InputError, match=r"No mean tensions were recorded .*setRecordsTensions\(True\)"):
            call()
    integrator.setRecordsTensions(True)
    with pytest.raises(InputError, match="No mean tensions were recorded"):
        here.mean_tensions()
    integrator.step(1)
    assert len(here.mean_tensions()[0]) == 3
    integrator.setRecordsTensions(False)
    integrator.step(1)
    with pytest.raises(InputError, match="No mean tensions were recorded"):
        here.mean_tensions()


@pytest.mark.parametrize("kind", ["compiled", "portable"])
def test_explicit_schemes_have_no_means(kind):
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine=kind)
    filaments.add_equilibrium(F_ACTIN, 3, seed=1)
    context, integrator = context_of(filaments, 10.0, recording=False, scheme="midpoint")
    here = filaments.in_context(context)
    for call in (here.mean_joint_tensions, here.mean_tensions, here.record_tensions):
        with pytest.raises(InputError, match="Mean tensions belong to the implicit schemes"):
            call()
    if kind == "compiled":
        with pytest.raises(InputError, match="Mean tensions belong to the implicit schemes"):
            integrator.setRecordsTensions(True)
