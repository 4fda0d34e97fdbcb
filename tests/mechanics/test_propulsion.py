"""Self-propelled filaments: forces along their segments, and how they move."""

from dataclasses import replace

import numpy as np
import openmm
import pytest
from openmm import unit

from openmm_cylchain import F_ACTIN, Filaments, FilamentType, InputError
from support.contexts import forces_of, new_context, positions_of
from support.dense_mechanics import bent_chain, dense_resistance
from support.platforms import ENGINE_PLATFORMS, ENGINES
from support.solvent import KT, TEMPERATURE, VISCOSITY

FRICTION = F_ACTIN.segment_friction(VISCOSITY, TEMPERATURE)


def _tangents(nodes, closed):
    vectors = np.diff(nodes, axis=0, append=nodes[:1]) if closed else np.diff(nodes, axis=0)
    return vectors / np.linalg.norm(vectors, axis=1)[:, None]


@pytest.mark.parametrize("propulsion", [5.0, -2.0, 8 * unit.piconewton])
@pytest.mark.parametrize(("engine", "platform"), ENGINE_PLATFORMS)
def test_straight_filament_glides(engine, platform, propulsion):
    """v = F0 t/gamma_par, with any number of segments."""
    filaments = Filaments(VISCOSITY, 0, engine=engine)
    for segments in (1, 5):
        filaments.add_straight(F_ACTIN, segments, [0, 0, 100 * segments], [3, 4, 0], propulsion=propulsion)
    filaments.add_straight(F_ACTIN, 2, [0, 0, -100], [3, 4, 0])
    _, system, positions = filaments.build()
    step = 1e4
    integrator = filaments.create_integrator(system, step, scheme="midpoint")
    context = new_context(system, positions, integrator, platform)
    integrator.step(20)
    moved = (positions_of(context) - positions._value) / (20 * step)
    force = filaments[0].propulsion
    if isinstance(propulsion, unit.Quantity):
        assert force == pytest.approx(8 * 0.602214076)
    for nodes in filaments.node_indices[:2]:
        expected = np.tile(force / FRICTION.parallel * np.array([0.6, 0.8, 0.0]), (len(nodes), 1))
        assert moved[nodes] == pytest.approx(expected, rel=1e-3, abs=1e-9)
    assert np.abs(moved[filaments.node_indices[2]]).max() < 1e-9


def _propelled_shapes(engine, factor=1.0):
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine=engine)
    shapes = [(bent_chain(F_ACTIN, 6, 1), False, 0.7), (bent_chain(F_ACTIN, 4, 2), False, 0.0)]
    ring = Filaments(VISCOSITY, TEMPERATURE, engine="portable")
    ring.add_ring(F_ACTIN, 7, [0, 0, 0], [1, 2, 3])
    shapes.append((ring[0].positions + np.random.default_rng(3).normal(scale=20, size=(7, 3)), True, -0.4))
    for nodes, closed, propulsion in shapes:
        filaments.add_nodes(F_ACTIN, nodes, closed=closed, propulsion=factor * propulsion)
    _, system, positions = filaments.build()
    return filaments, system, positions


@pytest.mark.parametrize(("engine", "platform"), ENGINE_PLATFORMS)
def test_state_holds_the_forces_but_no_energy(engine, platform):
    states = []
    for factor in (1.0, 0.0):
        filaments, system, positions = _propelled_shapes(engine, factor)
        context = new_context(system, positions, platform=platform)
        states.append(context.getState(forces=True, energy=True))
        if factor:
            propelled = filaments
    assert states[0].getPotentialEnergy() == states[1].getPotentialEnergy()
    forces = states[0].getForces(asNumpy=True)._value - states[1].getForces(asNumpy=True)._value
    for filament, indices in zip(propelled, propelled.node_indices):
        half = 0.5 * filament.propulsion * _tangents(filament.positions, filament.closed)
        expected = np.zeros((len(indices), 3))
        for segment, force in enumerate(half):
            expected[segment] += force
            expected[(segment + 1) % len(indices)] += force
        assert forces[indices] == pytest.approx(expected, abs=1e-3 if platform != "Reference" else 1e-9)


@pytest.mark.parametrize("engine", ENGINES)
def test_a_step_equals_the_dense_solution(engine):
    filaments, system, positions = _propelled_shapes(engine)
    step = 100.0
    integrator = filaments.create_integrator(system, step, scheme="euler", temperature=0)
    context = new_context(system, positions, integrator)
    forces = forces_of(context)
    integrator.step(1)
    moved = positions_of(context) - positions._value
    for filament, indices in zip(filaments, filaments.node_indices):
        resistance = dense_resistance(positions._value[indices], FRICTION, filament.closed)
        expected = step * np.linalg.solve(resistance, forces[indices].reshape(-1)).reshape(-1, 3)
        assert np.abs(moved[indices] - expected).max() < 1e-10 * np.abs(expected).max()


@pytest.mark.parametrize("engine", ENGINES)
def test_joints_carry_what_the_segments_beyond_push(engine):
    """Free, straight and propelled evenly, no segment pushes another; held at an end, each carries those beyond."""
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine=engine)
    for number, (clamped, propulsion) in enumerate([((), 0.3), ([0], 0.3), ([0], -0.3)]):
        nodes = np.zeros((6, 3))
        nodes[:, 0] = 500 * number
        nodes[:, 1] = 360 * np.arange(6)
        if clamped:
            # At rest: segment i is stretched by all beyond it and half of its own.
            nodes[1:, 1] += np.cumsum(propulsion * (np.arange(5, 0, -1) - 0.5) / F_ACTIN.segment_stiffness)
        filaments.add_nodes(F_ACTIN, nodes, clamped=clamped, propulsion=propulsion)
    _, system, positions = filaments.build()
    context = new_context(system, positions, filaments.create_integrator(system, 1.0))
    free, pulled, pushed = (tensions._value for tensions in filaments.in_context(context).joint_tensions())
    assert np.abs(free).max() < 1e-9
    assert pulled[:, 1] == pytest.approx(0.3 * np.arange(4, 0, -1), rel=1e-6)
    assert pushed[:, 1] == pytest.approx(-0.3 * np.arange(4, 0, -1), rel=1e-6)


@pytest.mark.parametrize("engine", ENGINES)
def test_gliding_rod_turns_and_diffuses(engine):
    """In a plane: <x> = v tau (1 - exp(-t/tau)) along the first direction, v = F0/gamma_par, tau = gamma_rot/k_B T."""
    count, steps = 2500, 150
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine=engine)
    # Soft, so that long steps resolve its length; neither the speed nor the turning depends on that.
    kind = FilamentType(
        name="ROD", diameter=6, segment_length=360, bending_rigidity=0, stretching_stiffness=30 * KT / 360**2
    )
    kind = replace(kind, extensional_friction=kind.segment_friction(VISCOSITY, TEMPERATURE).rotational)
    friction = kind.segment_friction(VISCOSITY, TEMPERATURE)
    tau = friction.rotational / KT
    speed = 3 * 360 / tau
    for number in range(count):
        filaments.add_straight(kind, 1, [0, 0, number], [1, 0, 0], planar=True, propulsion=speed * friction.parallel)
    _, system, positions = filaments.build()
    step = tau / steps
    integrator = filaments.create_integrator(system, step, scheme="midpoint", random_seed=5, checks=False)
    context = new_context(system, positions, integrator)
    integrator.step(steps)
    middles = (positions_of(context) - positions._value).reshape(count, 2, 3).mean(axis=1)
    along = middles[:, 0]
    expected = speed * tau * (1 - np.exp(-1))
    # The step's own error is half a step: the direction is that of its beginning.
    assert abs(along.mean() - expected) < 4 * along.std(ddof=1) / np.sqrt(count) + 0.5 * expected / steps
    assert 0.05 * expected > 4 * along.std(ddof=1) / np.sqrt(count)
    # <r^2> = 2 v^2 tau (t - tau + tau exp(-t/tau)) + 2 k_B T (1/gamma_par + 1/gamma_perp) t
    squares = np.sum(middles[:, :2] ** 2, axis=1)
    active = 2 * (speed * tau) ** 2 * np.exp(-1)
    passive = 2 * KT * (1 / friction.parallel + 1 / friction.perpendicular) * tau
    error = squares.std(ddof=1) / np.sqrt(count)
    assert abs(squares.mean() - active - passive) < 4 * error + active / steps
    assert 0.1 * (active + passive) > 4 * error


@pytest.mark.parametrize(("engine", "platform"), ENGINE_PLATFORMS)
def test_system_survives_xml(engine, platform):
    filaments, system, positions = _propelled_shapes(engine)
    restored = openmm.XmlSerializer.deserialize(openmm.XmlSerializer.serialize(system))
    forces = []
    for one in (system, restored):
        context = new_context(one, positions, platform=platform)
        forces.append(forces_of(context))
    assert np.array_equal(*forces)


@pytest.mark.parametrize(
    ("propulsion", "message"),
    [
        (np.nan, "Filament 0 .ACT.: propulsion must be finite"),
        ([1.0, 2.0], "propulsion must be a single number"),
        (1 * unit.nanometer, "propulsion has the unit"),
        ("fast", "propulsion must be a number"),
    ],
)
def test_bad_propulsions_are_refused(propulsion, message):
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine="portable")
    for add in (
        lambda: filaments.add_straight(F_ACTIN, 2, [0, 0, 0], [1, 0, 0], propulsion=propulsion),
        lambda: filaments.add_nodes(F_ACTIN, [[0, 0, 0], [360, 0, 0]], propulsion=propulsion),
        lambda: filaments.add_equilibrium(F_ACTIN, 2, seed=1, propulsion=propulsion),
        lambda: filaments.add_ring(F_ACTIN, 5, [0, 0, 0], propulsion=propulsion),
    ):
        with pytest.raises(InputError, match=message):
            add()
    assert len(filaments) == 0
