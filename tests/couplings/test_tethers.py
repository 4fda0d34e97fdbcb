"""Tethers: energy and forces, moving them, and equilibrium in a trap as stiff as a segment."""

import copy

import numpy as np
import openmm
import pytest
from openmm import unit

from openmm_cylchain import F_ACTIN, Filaments, InputError
from support.contexts import energy_of, forces_of, new_context, positions_of
from support.solvent import KT, TEMPERATURE, VISCOSITY

MICROSECOND = 1e6
STIFFNESS = F_ACTIN.segment_stiffness


def _trapped(engine, points, stiffness=STIFFNESS, segments=3, chains=1, **options):
    """Filaments that begin in the origin's neighbourhood, tethered at both ends."""
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine=engine)
    for chain in range(chains):
        filaments.add_straight(F_ACTIN, segments, [0, 1000 * chain, 0], [1, 0, 0], **options)
        for node, point in points.items():
            filaments.add_tether(chain, node, np.add(point, [0, 1000 * chain, 0]), stiffness)
    return filaments


def _context(filaments, step=MICROSECOND, **options):
    topology, system, positions = filaments.build()
    integrator = filaments.create_integrator(system, step, **options)
    return new_context(system, positions, integrator)


@pytest.mark.parametrize("engine", ["portable", "compiled"])
def test_energy_and_force_of_a_tether_that_is_moved(engine):
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine=engine)
    filaments.add_straight(F_ACTIN, 3, [0, 0, 0], [1, 0, 0])
    tether = filaments.add_tether(0, -1, [1.08, 0.01, 0] * unit.micrometer, 0.5 * unit.piconewton / unit.nanometer)
    stiffness = 0.5 * 0.602214076
    context = _context(filaments, 1.0, scheme="midpoint")
    here = filaments.in_context(context)
    assert energy_of(context) == pytest.approx(0.5 * stiffness * 100, rel=1e-6)
    forces = forces_of(context)
    assert forces[3] == pytest.approx([0, 10 * stiffness, 0], rel=1e-6, abs=1e-6)
    here.move_tether(tether, [1080, 0, -3])
    assert energy_of(context) == pytest.approx(0.5 * stiffness * 9, rel=1e-6)
    here.move_tether(tether, [1080, 0, -3], 2 * stiffness)
    assert energy_of(context) == pytest.approx(stiffness * 9, rel=1e-6)


def test_the_nearest_image_of_a_point_counts_in_a_periodic_box():
    from openmm_cylchain.engines.compiled import CylinderChainForce

    filaments = _trapped("compiled", {0: [5010, 0, 0]})
    topology, system, positions = filaments.build(box_vectors=5000 * np.eye(3))
    force = CylinderChainForce.cast(system.getForce(0))
    force.setUsesPeriodicBoundaryConditions(True)
    integrator = filaments.create_integrator(system, MICROSECOND, scheme="implicit", temperature=0)
    context = new_context(system, positions, integrator)
    assert energy_of(context) == pytest.approx(0.5 * STIFFNESS * 100, rel=1e-6)
    integrator.step(200)
    assert energy_of(context) < 1e-6
    assert positions_of(context)[0, 0] == pytest.approx(10, abs=1e-3)


def test_both_engines_move_a_trapped_filament_alike():
    ends = []
    for engine in ("portable", "compiled"):
        filaments = _trapped(engine, {0: [0, 20, 0], 3: [1090, -30, 5]}, 0.01 * STIFFNESS)
        context = _context(filaments, 1e3, scheme="midpoint", temperature=0)
        context.getIntegrator().step(100)
        ends.append(positions_of(context))
    assert np.abs(ends[0] - ends[1]).max() < 1e-9 * 1090
    assert np.abs(ends[0][0]).max() > 0.1


def test_copies_and_xml_keep_tethers():
    filaments = _trapped("compiled", {0: [1, 2, 3], 2: [4, 5, 6]})
    _, system, _ = filaments.build()
    from openmm_cylchain.engines.compiled import CylinderChainForce

    force = CylinderChainForce.cast(system.getForce(0))
    for duplicate in (copy.deepcopy(force), openmm.XmlSerializer.deserialize(openmm.XmlSerializer.serialize(force))):
        duplicate = CylinderChainForce.cast(duplicate)
        assert duplicate.getNumTethers() == 2
        assert duplicate.getTetherParameters(1) == force.getTetherParameters(1)
        chain, node, point, stiffness = duplicate.getTetherParameters(1)
        assert (chain, node, tuple(point._value), stiffness._value) == (0, 2, (4, 5, 6), STIFFNESS)


@pytest.mark.parametrize("engine", ["portable", "compiled"])
def test_contexts_of_one_system_have_tethers_of_their_own(engine):
    filaments = _trapped(engine, {0: [0, 0, 0], 3: [1080, 0, 0]})
    _, system, positions = filaments.build()
    contexts = []
    for _ in range(2):
        context = openmm.Context(system, openmm.VerletIntegrator(1), openmm.Platform.getPlatform("Reference"))
        context.setPositions(positions)
        contexts.append(context)
    first, second = (filaments.in_context(context) for context in contexts)
    rest = energy_of(contexts[0])
    first.move_tether(0, [0, 3, 0])
    second.move_tether(1, [1080, 4, 0], 2 * STIFFNESS)
    assert energy_of(contexts[0]) - rest == pytest.approx(0.5 * STIFFNESS * 9)
    assert energy_of(contexts[1]) - rest == pytest.approx(STIFFNESS * 16)
    first.move_tether(1, [1080, 1, 0])
    assert energy_of(contexts[0]) - rest == pytest.approx(0.5 * STIFFNESS * 10)
    assert [tether.point for tether in first.tethers()] == [(0, 3, 0), (1080, 1, 0)]
    assert [tether.point for tether in second.tethers()] == [(0, 0, 0), (1080, 4, 0)]
    assert filaments.in_context(contexts[1]).tethers() == second.tethers()
    assert [tether.stiffness for tether in second.tethers()] == [STIFFNESS, 2 * STIFFNESS]
    # A new Context begins as the filaments were described.
    fresh = openmm.Context(system, openmm.VerletIntegrator(1), openmm.Platform.getPlatform("Reference"))
    fresh.setPositions(positions)
    assert energy_of(fresh) == pytest.approx(rest, abs=1e-9)
    assert filaments.in_context(fresh).tethers() == filaments.tethers


@pytest.mark.sample(r"^0\.1|^40")
@pytest.mark.parametrize("step", [0.1, 5, 40])
def test_equilibrium_in_traps_as_stiff_as_a_segment(step):
    """Straight filaments held at both ends: every node fluctuates as the Hessian says, whatever the step.

    The traps pull with 97 pN, so the filaments relax within 5 us.
    """
    segments, pull, chains = 3, 5.0, 800
    ends = {0: [-pull, 0, 0], segments: [360 * segments + pull, 0, 0]}
    filaments = _trapped("compiled", ends, chains=chains)
    # Steps that do not resolve the relaxation of such short filaments, either.
    context = _context(filaments, step * MICROSECOND, scheme="implicit", random_seed=5, checks=False)
    nodes = np.array(filaments.node_indices)
    samples = []
    context.getIntegrator().step(max(50, int(20 / step)))
    for _ in range(40):
        context.getIntegrator().step(max(8, int(5 / step)))
        samples.append(positions_of(context)[nodes])
    samples = np.array(samples)
    assert context.getIntegrator().getNumDividedSteps() == 0
    # Longitudinal: five springs in a row, all of the same stiffness.
    extension = 2 * pull / (segments + 2)
    springs = 2 * np.eye(segments + 1) - np.eye(segments + 1, k=1) - np.eye(segments + 1, k=-1)
    # Transverse: tension, the joints' bending, and the traps.
    difference = np.diff(np.eye(segments + 1), axis=0)
    length = 360 + extension
    bends = np.diff(difference, axis=0) / length
    transverse = extension / length * difference.T @ difference * STIFFNESS
    transverse += F_ACTIN.joint_stiffness * bends.T @ bends
    transverse[0, 0] += STIFFNESS
    transverse[-1, -1] += STIFFNESS
    for axis, hessian in ((0, STIFFNESS * springs), (1, transverse), (2, transverse)):
        expected = KT * np.diag(np.linalg.inv(hessian))
        rest = samples[..., axis].mean(axis=(0, 1)) if axis == 0 else 1000 * np.arange(chains)[:, None] * (axis == 1)
        variances = ((samples[..., axis] - rest) ** 2).mean(axis=0)
        mean, error = variances.mean(axis=0), variances.std(axis=0) / np.sqrt(len(variances) - 1)
        assert np.all(4 * error < 0.05 * expected), (axis, error / expected)
        assert np.all(np.abs(mean - expected) < 0.02 * expected + 4 * error), (axis, mean / expected, error / expected)


def test_a_moving_trap_drags_a_filament_with_a_lag_of_friction_over_stiffness():
    filaments = _trapped("compiled", {0: [0, 0, 0]})
    step, speed = 0.005 * MICROSECOND, 1e-5
    context = _context(filaments, step, scheme="implicit", temperature=0)
    for index in range(1, 401):
        filaments.in_context(context).move_tether(0, [speed * step * (index - 0.5), 0, 0])
        context.getIntegrator().step(1)
    node = positions_of(context)[0]
    friction = 3 * F_ACTIN.segment_friction(VISCOSITY, TEMPERATURE, 3).parallel
    assert speed * step * 400 - node[0] == pytest.approx(speed * friction / STIFFNESS, rel=0.01)


def test_bad_tethers_are_refused():
    filaments = Filaments(VISCOSITY, TEMPERATURE)
    filaments.add_straight(F_ACTIN, 2, [0, 0, 0], [1, 0, 0])
    filaments.add_tether(0, 0, [0, 0, 0], 1)
    for arguments, message in (
        ((1, 0, [0, 0, 0], 1), "Tether 1: filament 1 does not exist; there are 1"),
        ((0, 3, [0, 0, 0], 1), "Tether 1: node 3 does not exist; there are 3 nodes"),
        ((0, -3, [0, 0, 0], 1), "Tether 1: node 0 of filament 0 has a tether already"),
        ((0, 1, [0, 0], 1), "Tether 1: point must have three components"),
        ((0, 1, [0, 0, np.nan], 1), "Tether 1: point must be finite"),
        ((0, 1, [0, 0, 0], 0), "Tether 1: stiffness must be positive"),
        ((0, 1, [0, 0, 0], 1 * unit.nanometer), "Tether 1: stiffness has the unit"),
    ):
        with pytest.raises(InputError, match=message):
            filaments.add_tether(*arguments)
    context = _context(filaments, 1.0)
    with pytest.raises(InputError, match="Tether 1 comes too late"):
        filaments.add_tether(0, 1, [0, 0, 0], 1)
    with pytest.raises(InputError, match="Tether 1 does not exist; there are 1"):
        filaments.in_context(context).move_tether(1, [0, 0, 0])
