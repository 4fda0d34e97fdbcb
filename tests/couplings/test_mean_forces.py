"""Forces of walls and contacts over steps: what they carry, who asks for them, checkpoints and threads."""

import numpy as np
import openmm
import pytest
from openmm import unit

from openmm_cylchain import (
    F_ACTIN,
    Filaments,
    InputError,
    Plane,
    Slab,
    capsule_contact_force,
    constant_force,
    contact_forces,
    filament_wall_force,
    wall_force,
    wall_forces,
)
from openmm_cylchain.couplings.mean_forces import ForceReaders
from openmm_cylchain.engines.compiled import plugin
from support.contexts import forces_of, new_context, positions_of
from support.platforms import ON_COMPILED_PLATFORMS
from support.rod_cases import RODS_IN_A_SLAB, quadrature_between_walls, rods_between_walls
from support.rod_simulations import RodSimulation
from support.solvent import KT, TEMPERATURE, VISCOSITY
from support.wall_shapes import SHAPES

PICONEWTON = 0.602214076
FLOOR = Plane([0, 0, 0], [0, 0, 1])


def _rods(count=1, segments=1, height=5.0, temperature=TEMPERATURE, **options):
    """Rods of actin above each other along y, parallel to the floor."""
    filaments = Filaments(VISCOSITY, temperature, **options)
    for number in range(count):
        filaments.add_straight(F_ACTIN.with_segment_length(100), segments, [0, 1000 * number, height], [1, 0, 0])
    _, system, positions = filaments.build()
    return filaments, system, np.array(positions._value)


def _context(filaments, system, positions, step, scheme="implicit", threads=1, seed=1):
    integrator = filaments.create_integrator(system, step, scheme=scheme, random_seed=seed, checks=False)
    return new_context(system, positions, integrator, "CPU", {"Threads": str(threads)})


def _steps(context, count):
    context.getIntegrator().step(count)


# What walls carry


def _on_floor(share, scheme, engine="compiled"):
    """Rods that 6 pN press on a floor of 0.5 pN/nm, at a share of the recommended step."""
    filaments, system, positions = _rods(30, engine=engine)
    nodes = np.concatenate(filaments.node_indices)
    stiffness = 0.5 * PICONEWTON
    native = engine == "compiled"
    system.addForce(
        filament_wall_force(filaments, system, FLOOR, stiffness) if native else wall_force(FLOOR, stiffness, nodes)
    )
    system.addForce(constant_force(nodes, [0, 0, -3 * PICONEWTON]))
    step = share * filaments.recommended_time_step(scheme, system=system).step
    return filaments, _context(filaments, system, positions, step, scheme), step


@pytest.mark.parametrize(
    ("scheme", "share"),
    [
        ("implicit", 1.0),
        pytest.param("implicit", 0.1, marks=pytest.mark.slow),
        ("implicit", 10.0),
        ("euler", 1.0),
    ],
)
def test_a_floor_carries_what_presses_on_it(scheme, share):
    """The mean force on each rod is the load, at steps of any length, and what they are over is said."""
    filaments, context, step = _on_floor(share, scheme)
    duration = 2e8
    _steps(context, int(0.2 * duration / step))
    wall_forces(context)
    count = int(duration / step)
    _steps(context, count)
    (found,) = wall_forces(context)
    assert found.duration._value == pytest.approx(count * step)
    forces = found.on_filaments(filaments)._value / (6 * PICONEWTON)
    error = forces[:, 2].std(ddof=1) / np.sqrt(len(forces))
    assert 4 * error < 0.03
    assert forces[:, 2].mean() == pytest.approx(1.0, abs=4 * error)
    np.testing.assert_array_equal(forces[:, :2], 0.0)
    np.testing.assert_allclose(found.sums._value, [found.forces._value.sum(axis=0)], rtol=1e-9)
    assert found.loads._value[0] == pytest.approx(found.sums._value[0, 2], rel=1e-9)


@pytest.mark.parametrize(
    ("share", "duration", "allowed"), [(1.0, 8e9, 0.03), pytest.param(0.1, 1.6e10, 0.01, marks=pytest.mark.slow)]
)
def test_walls_have_the_mean_force_of_quadrature(share, duration, allowed):
    """Of rods that turn between two walls: 0.976 +- 0.006 of it at the recommended step, in which they turn by 0.15."""
    system = rods_between_walls(0.5)
    middles = np.zeros((60, 1, 3)) + [0, 0, 0.5 * system.height]
    simulation = RodSimulation(system, middles, np.zeros((60, 1, 3)) + [system.length, 0, 0], factor=share)
    interval = int(duration / 20 / simulation.step)
    simulation.integrator.step(interval)
    wall_forces(simulation.context)
    means = []
    for _ in range(20):
        simulation.integrator.step(interval)
        means.append(sum(own.loads._value.sum() for own in wall_forces(simulation.context)) / 60)
    exact = KT * quadrature_between_walls(system)[1]
    error = np.std(means, ddof=1) / np.sqrt(len(means))
    assert 4 * error < 0.06 * exact
    assert np.mean(means) == pytest.approx(exact, abs=4 * error + allowed * exact)


def test_contacts_have_the_mean_force_of_overlaps():
    """Of dense rods between walls: means over steps, over the forces of overlaps at the ends of steps."""
    simulation = _rods_in_a_slab(threads=1)
    contacts = plugin.CylinderChainContactForce.cast(simulation.context.getSystem().getForce(1))
    simulation.integrator.step(1000)
    ratios = []
    for _ in range(16):
        contact_forces(simulation.context)
        overlaps = 0.0
        for _ in range(50):
            simulation.integrator.step(4)
            overlaps += sum(contacts.getContacts(simulation.context)[3]._value) / 50
        ratios.append(contact_forces(simulation.context)[0].loads._value.sum() / overlaps)
    error = np.std(ratios, ddof=1) / 4
    assert 4 * error < 0.08
    assert np.mean(ratios) == pytest.approx(1.0, abs=0.03 + 4 * error)


def _rods_in_a_slab(threads):
    system = RODS_IN_A_SLAB
    rng = np.random.default_rng(2)
    middles = rng.uniform(0, 1, (1, system.rods, 3)) * [340.0, 340.0, 60.0] + [0, 0, 20.0]
    along = rng.normal(size=middles.shape) * [1, 1, 0.1]
    along *= system.length / np.linalg.norm(along, axis=-1, keepdims=True)
    return RodSimulation(system, middles, along, threads=threads)


@pytest.mark.parametrize("step", [1e4, 1e6])
def test_without_noise_forces_are_what_moves_filaments(step):
    """What a rod does not move by, of what its load would move it, is the force of the floor over its friction."""
    filaments, system, positions = _rods(height=1.0, temperature=0.0)
    stiffness, load = 0.5 * PICONEWTON, 0.3 * PICONEWTON
    system.addForce(filament_wall_force(filaments, system, FLOOR, stiffness))
    system.addForce(constant_force(filaments.node_indices[0], [0, 0, -load]))
    context = _context(filaments, system, positions, step)
    friction = plugin.CylinderChainForce.cast(system.getForce(0)).getSegmentParameters(0, 0)[4]._value
    for _ in range(10):
        before = positions_of(context)
        _steps(context, 1)
        moved = (positions_of(context) - before)[:, 2].mean()
        found = wall_forces(context)[0].sums._value[0, 2]
        assert found == pytest.approx(2 * load + friction * moved / step, abs=2e-3 * load)


@pytest.mark.parametrize(("load", "step", "divides"), [(1.0, 1e6, False), (50.0, 4e5, True)])
def test_without_noise_contacts_are_what_moves_filaments(load, step, divides):
    """Two rods across each other that a load in pN presses together, in steps that are divided, too."""
    filaments = Filaments(VISCOSITY, 0.0)
    filaments.add_straight(F_ACTIN.with_segment_length(100), 1, [-50, 0, 12], [1, 0, 0])
    filaments.add_straight(F_ACTIN.with_segment_length(100), 1, [0, -50, 0], [0, 1, 0])
    _, system, positions = filaments.build()
    nodes = np.concatenate(filaments.node_indices)
    system.addForce(capsule_contact_force(filaments, system, 20.0, PICONEWTON))
    presses = 0.5 * load * PICONEWTON * np.array([[0, 0, -1], [0, 0, -1], [0, 0, 1], [0, 0, 1]])
    system.addForce(constant_force(nodes, presses))
    context = _context(filaments, system, np.array(positions._value), step)
    friction = plugin.CylinderChainForce.cast(system.getForce(0)).getSegmentParameters(0, 0)[4]._value
    for _ in range(4):
        before = positions_of(context)
        _steps(context, 1)
        moved = (positions_of(context) - before)[:2, 2].mean()
        (found,) = contact_forces(context)
        expected = load * PICONEWTON + friction * moved / step
        assert expected > 0.1
        np.testing.assert_allclose(found.on_filaments(filaments)._value[:, 2], [expected, -expected], rtol=1e-9)
        np.testing.assert_allclose(found.loads._value, [expected], rtol=1e-9)
        assert found.pairs.tolist() == [[0, 1]]
    assert (context.getIntegrator().getNumDividedSteps() > 0) == divides


# Where nothing is summed up


@pytest.mark.parametrize("scheme", ["euler", "midpoint"])
def test_explicit_steps_have_forces_at_their_starts(scheme):
    filaments, system, positions = _rods(3, segments=2, height=-1.0)
    system.addForce(filament_wall_force(filaments, system, Slab([0, 0, 5], [0, 0, 1], 12.0), 0.5 * PICONEWTON))
    system.addForce(capsule_contact_force(filaments, system, 1005.0, 1.0))
    for number in (0, 1):
        system.getForce(system.getNumForces() - 1 - number).setForceGroup(number + 1)
    context = _context(filaments, system, positions, 1000.0, scheme)
    sums = np.zeros((2, *positions.shape))
    for _ in range(20):
        sums += [forces_of(context, groups={group}) for group in (1, 2)]
        _steps(context, 1)
    (contacts,), (walls,) = contact_forces(context), wall_forces(context)
    np.testing.assert_allclose(contacts.forces._value, sums[0] / 20, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(walls.forces._value, sums[1] / 20, rtol=1e-9, atol=1e-12)
    assert contacts.duration == walls.duration == 20000 * unit.picosecond
    assert contacts.pairs.tolist() == [[0, 1], [1, 2]]
    np.testing.assert_allclose(contacts.on_filaments(filaments)._value[0], contacts.sums._value[0], atol=1e-12)
    np.testing.assert_allclose(contacts.loads_of_filaments(filaments)._value[1], contacts.loads._value.sum())
    assert walls.loads._value[0] == 0.0 < walls.loads._value[1]


@ON_COMPILED_PLATFORMS
@pytest.mark.parametrize("shape", SHAPES, ids=lambda shape: type(shape).__name__)
def test_without_steps_forces_are_those_at_the_positions(shape, platform):
    """Of both kinds of walls: those that OpenMM has of them, in the sum of faces."""
    filaments, system, _ = _rods(10, segments=3)
    nodes = np.concatenate(filaments.node_indices)
    system.addForce(filament_wall_force(filaments, system, shape, 7.0))
    system.addForce(wall_force(shape, 5.0, nodes))
    for number in (0, 1):
        system.getForce(number + 1).setForceGroup(number + 1)
    points = np.random.default_rng(3).uniform(-4, 4, size=(len(nodes), 3))
    context = new_context(system, points, None, platform)
    for group, found in zip((1, 2), wall_forces(context)):
        assert found.duration == 0 * unit.picosecond and found.force == group
        expected = forces_of(context, groups={group})
        np.testing.assert_allclose(found.forces._value, expected, atol=1e-4, rtol=1e-5)
        np.testing.assert_allclose(found.sums._value.sum(axis=0), expected.sum(axis=0), atol=1e-3)
    one, other = wall_forces(context)
    np.testing.assert_allclose(one.loads._value / 7, other.loads._value / 5, rtol=1e-5)
    np.testing.assert_allclose(one.sums._value / 7, other.sums._value / 5, rtol=1e-5, atol=1e-5)


def test_forces_in_other_groups_are_those_that_steps_have():
    """A wall that the integrator leaves out has pushed nothing."""
    filaments, system, positions = _rods(height=-5.0)
    force = filament_wall_force(filaments, system, FLOOR, 1.0)
    force.setForceGroup(3)
    system.addForce(force)
    integrator = filaments.create_integrator(system, 1e4, checks=False)
    integrator.setIntegrationForceGroups({0})
    context = new_context(system, positions, integrator, "CPU")
    assert wall_forces(context)[0].loads._value[0] == pytest.approx(10.0)
    _steps(context, 3)
    (found,) = wall_forces(context)
    assert found.duration == 3e4 * unit.picosecond and found.loads._value[0] == 0.0


def test_what_is_no_wall_is_not_taken_for_one():
    filaments, system, positions = _rods()
    other = openmm.CustomExternalForce("(0.5)*(x^2)")
    other.setName("Wall (sphere)")
    system.addForce(other)
    assert wall_forces(new_context(system, positions)) == contact_forces(new_context(system, positions)) == []


# Who asks, and checkpoints


def _pressed(step=2e5, threads=1, seed=1):
    filaments, system, positions = _rods(2, height=2.0)
    system.addForce(filament_wall_force(filaments, system, FLOOR, 0.5 * PICONEWTON))
    system.addForce(constant_force(np.concatenate(filaments.node_indices), [0, 0, -PICONEWTON]))
    return _context(filaments, system, positions, step, threads=threads, seed=seed)


def test_readers_do_not_shorten_what_others_have_the_mean_of():
    """Of three that ask at different times: the sum of what each is told is the same."""
    context = _pressed()
    readers = [ForceReaders(context), ForceReaders(context)]
    told = np.zeros((3, 4, 3))
    asks = (5, lambda: wall_forces(context)), (3, readers[0].wall_forces), (30, readers[1].wall_forces)
    for count in range(1, 31):
        _steps(context, 1)
        for number, (every, ask) in enumerate(asks):
            if count % every == 0:
                (found,) = ask()
                assert found.duration._value == pytest.approx(every * 2e5)
                told[number] += found.forces._value * every
    assert np.abs(told[0]).max() > 0
    np.testing.assert_allclose(told[1], told[0], rtol=1e-12)
    np.testing.assert_allclose(told[2], told[0], rtol=1e-12)
    with pytest.raises(openmm.OpenMMException, match="There is no reader 7 of forces"):
        plugin.CylinderChainWallForce.cast(context.getSystem().getForce(1)).takeMeanForces(context, 7)


def test_checkpoints_hold_the_sums_and_states_do_not():
    context = _pressed()
    _steps(context, 4)
    checkpoint, state = context.createCheckpoint(), context.getState(positions=True, integratorParameters=True)
    _steps(context, 3)
    (whole,) = wall_forces(context)
    again = _pressed(seed=9)
    again.loadCheckpoint(checkpoint)
    _steps(again, 3)
    (found,) = wall_forces(again)
    assert found.duration == whole.duration
    np.testing.assert_array_equal(found.forces._value, whole.forces._value)
    np.testing.assert_array_equal(found.loads._value, whole.loads._value)
    _steps(again, 5)
    again.loadCheckpoint(checkpoint)
    assert wall_forces(again)[0].duration == 8e5 * unit.picosecond
    other = _pressed(seed=9)
    other.setState(state)
    _steps(other, 3)
    assert wall_forces(other)[0].duration == 6e5 * unit.picosecond


def test_forces_do_not_depend_on_threads():
    """To the bit, of rods with contacts between walls, whose steps are long."""
    found = []
    for threads in (1, 2, 3):
        simulation = _rods_in_a_slab(threads)
        simulation.integrator.step(60)
        forces = [*contact_forces(simulation.context), *wall_forces(simulation.context)]
        found.append([part._value for own in forces for part in (own.forces, own.loads, own.sums)])
        assert len(forces[0].pairs) > 10 and min(own.loads._value.sum() for own in forces) > 0
    for other in found[1:]:
        for one, two in zip(found[0], other):
            np.testing.assert_array_equal(one, two)


def test_loads_are_those_of_the_filaments_that_contacts_have():
    """Of the last two of three rods, which lie across each other, and of a bead on the last one."""
    filaments = Filaments(VISCOSITY, TEMPERATURE)
    kind = F_ACTIN.with_segment_length(100.0)
    for height, direction in ((2.0, [1, 1, 0]), (0.0, [1, 0, 0]), (8.0, [0, 1, 0])):
        filaments.add_straight(kind, 1, start=[-50.0 * own for own in direction[:2]] + [height], direction=direction)
    _, system, positions = filaments.build()
    bead = system.addParticle(1.0)
    positions = np.concatenate([positions._value, [[0.0, 30.0, 13.0]]])
    arguments = {"particles": [bead], "particle_diameter": 10.0, "numbers": [2, 1]}
    system.addForce(capsule_contact_force(filaments, system, [12.0, 10.0], 3.0, **arguments))
    integrator = filaments.create_integrator(system, 1.0, particle_friction=[1.0], checks=False)
    found = contact_forces(new_context(system, positions, integrator, "CPU"))[0]
    # Their gap is 8 - 11 nm; that of the bead 5 - 11 nm.
    assert sorted(map(tuple, found.pairs)) == [(0, 1), (0, 2)]
    assert found.loads_of_filaments(filaments)._value == pytest.approx([0.0, 9.0, 27.0])
    forces = found.on_filaments(filaments)._value
    assert not forces[0].any() and forces[1, 2] == pytest.approx(-9.0) and forces[2, 2] == pytest.approx(-9.0)


def test_filaments_of_another_system_are_refused():
    filaments = Filaments(VISCOSITY, TEMPERATURE)
    filaments.add_straight(F_ACTIN.with_segment_length(100), 1, [0, 0, 0], [1, 0, 0])
    (found,) = wall_forces(_pressed())
    with pytest.raises(InputError):
        found.on_filaments(filaments)
