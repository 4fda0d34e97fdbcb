"""Linkers that diffuse while they are not bound: against closed forms, those without positions, and restarts."""

import numpy as np
import openmm
import pytest
from openmm import unit

from openmm_cylchain import (
    ACTIN_ATP,
    F_ACTIN,
    Box,
    Crosslinker,
    Cylinder,
    Filaments,
    Growth,
    Hand,
    InputError,
    LinkerTable,
    Plane,
    Slab,
    Sphere,
    filament_wall_force,
)
from support.contexts import new_context
from support.linker_contexts import check_that_runs_go_on_to_the_bit

RADIUS, REACH, LENGTH, DIFFUSION = 200.0, 40.0, 200.0, 0.008
UNBINDING = 1e-6
BOX = np.diag([400.0, 400.0, 400.0])


def spring(binding_rate=1e-5, reach=REACH, **properties):
    hand = Hand(binding_rate=binding_rate, reach=reach, unbinding_rate=UNBINDING, **properties)
    return Crosslinker(hands=hand, stiffness=0.02)


def rods(number=1):
    """Filaments that stand still."""
    filaments = Filaments(viscosity=1e-3 * unit.pascal * unit.second, temperature=300.0)
    kind = F_ACTIN.with_segment_length(50.0)
    for own in range(number):
        start = [-0.5 * LENGTH, 30.0 * own, 0.0]
        filaments.add_straight(kind, 4, start, [1, 0, 0], clamped=range(1, 5))
    return filaments


def made(filaments, step, wall=None, box=None, seed=3, system_only=False):
    _, system, positions = filaments.build(box_vectors=box)
    if wall is not None:
        system.addForce(filament_wall_force(filaments, system, wall, 1.0))
    integrator = filaments.create_integrator(system, step, random_seed=seed, checks=False)
    return system if system_only else new_context(system, positions, integrator)


def shares_over_time(filaments, context, warm_up, samples, interval):
    """(samples, 3): of linkers in each state."""
    here, found = filaments.in_context(context), []
    context.getIntegrator().step(warm_up)
    for _ in range(samples):
        context.getIntegrator().step(interval)
        found.append(here.linkers().counts())
    return np.array(found) / np.sum(found[0])


def mean_and_error(values, blocks=10):
    own = np.array([block.mean(axis=0) for block in np.array_split(values, blocks)])
    return own.mean(axis=0), own.std(axis=0, ddof=1) / np.sqrt(blocks)


@pytest.mark.parametrize("step", [1e4, pytest.param(1e6, marks=pytest.mark.slow)])
def test_as_many_are_bound_as_of_a_reservoir(step):
    """In a sphere: 2 L (c/k) v/V for each that is not, with two hands that bind."""
    filaments = rods()
    filaments.add_linkers(spring(8e-6), 5000, diffusion=DIFFUSION)
    context = made(filaments, step, Sphere([0, 0, 0], RADIUS))
    interval, samples = (200, 10) if step < 1e6 else (20, 30)
    shares = shares_over_time(filaments, context, 5 * interval, samples, interval)
    mean, error = mean_and_error(shares[:, 1])
    ratio = 2.0 * LENGTH * 8e-6 / (2.0 * REACH) / UNBINDING * REACH**3 / RADIUS**3
    expected = ratio / (1.0 + ratio)
    assert 4.0 * error < 0.05 * expected
    assert abs(mean - expected) < 4.0 * error


def test_as_many_join_filaments_as_of_a_reservoir():
    """In a periodic box, linkers that begin bound among them."""
    results = []
    for arguments in ({"diffusion": DIFFUSION}, {}):
        filaments = rods(2)
        filaments.add_linkers(spring(1.5e-5), 3000, bound=1500, **arguments)
        context = made(filaments, 1e5, box=BOX)
        results.append(mean_and_error(shares_over_time(filaments, context, 100, 60, 8)))
    (own, error), (expected, other) = results
    bound = 4.0 * np.hypot(error, other)
    assert np.all(bound < 0.05 * expected[[0, 1, 2]].max())
    assert np.all(np.abs(own - expected) < bound)
    assert expected[2] > 0.08


@pytest.mark.parametrize("planar", [False, True])
def test_mean_squared_displacement(planar):
    filaments = rods()
    filaments.add_linkers(spring(0.0), 5000, diffusion=3.0 * unit.micrometer**2 / unit.second, planar=planar)
    context = made(filaments, 1e8, box=BOX)
    here = filaments.in_context(context)
    before = here.linkers().positions
    context.getIntegrator().step(20)
    squares = (here.linkers().positions - before) ** 2
    # 3 um^2/s are 3e-6 nm^2/ps.
    expected = 2.0 * 3e-6 * 20 * 1e8
    error = expected * np.sqrt(2.0 / 5000)
    axes = 2 if planar else 3
    np.testing.assert_allclose(squares.mean(axis=0)[:axes], expected, atol=4.0 * error)
    assert 4.0 * error < 0.1 * expected
    if planar:
        assert np.all(here.linkers().positions[:, 2] == 0.0)


def test_they_are_everywhere_in_a_box_of_walls():
    """Beside a filament that some hold, after steps: moments of a uniform distribution; only unbound ones are there."""
    filaments = rods()
    filaments.add_linkers(spring(5e-6), 6000, diffusion=DIFFUSION)
    lower, upper = np.array([-120.0, -30.0, -100.0]), np.array([120.0, 200.0, 150.0])
    context = made(filaments, 2e5, Box(lower, upper))
    here = filaments.in_context(context)
    shares = []
    context.getIntegrator().step(150)
    for _ in range(20):
        context.getIntegrator().step(15)
        table = here.linkers()
        assert np.array_equal(np.isnan(table.positions[:, 0]), table.held > 0)
        places = (table.positions[table.held == 0] - lower) / (upper - lower)
        assert places.min() >= 0.0 and places.max() <= 1.0
        near = np.all(np.abs(table.positions[table.held == 0, 1:]) < 60.0, axis=1)
        shares.append([*places.mean(axis=0), *(places**2).mean(axis=0), near.mean()])
    mean, error = mean_and_error(np.array(shares))
    expected = np.array([0.5] * 3 + [1 / 3] * 3 + [90.0 * 120.0 / (230.0 * 250.0)])
    assert np.all(4.0 * error < 0.05 * expected)
    assert np.all(np.abs(mean - expected) < 4.0 * error)


def test_a_region_of_their_own():
    """A cylinder with a slab across it, in which others are within the walls of the System."""
    filaments = rods()
    axis = np.array([1.0, 2.0, 2.0]) / 3.0
    region = [Cylinder([10, 0, 0], axis, 60.0), Slab([20, 20, 20], axis, 90.0)]
    filaments.add_linkers(spring(0.0), 4000, diffusion=DIFFUSION, region=region)
    filaments.add_linkers(spring(0.0), 4000, diffusion=DIFFUSION)
    context = made(filaments, 1e5, Sphere([0, 0, 0], RADIUS))
    context.getIntegrator().step(100)
    positions = filaments.in_context(context).linkers().positions
    own = positions[:4000] - [10, 0, 0]
    along = own @ axis
    squares = np.sum(own**2, axis=1) - along**2
    middle = np.array([10, 20, 20]) @ axis
    assert np.all(np.abs(along - middle) <= 45.0) and squares.max() <= 3600.0
    # As many in each half of the area and of the length.
    assert abs(np.mean(squares < 1800.0) - 0.5) < 4.0 * 0.5 / 4000**0.5
    assert abs(np.mean(along < middle) - 0.5) < 4.0 * 0.5 / 4000**0.5
    assert np.linalg.norm(positions[4000:], axis=1).max() > 0.98 * RADIUS


@pytest.mark.parametrize("walls", [True, False])
def test_restarts_are_to_the_bit(walls):
    """Of motors that walk off the ends of filaments that move, in a sphere or a periodic box."""

    def network():
        filaments = Filaments(viscosity=1e-3 * unit.pascal * unit.second, temperature=300.0)
        for own in range(6):
            start = [-100.0, 20.0 * own - 50.0, 0.0]
            filaments.add_equilibrium(F_ACTIN.with_segment_length(50.0), 4, seed=own + 1, start=start)
        filaments.add_linkers(spring(2e-5, speed=1e-4), 300, diffusion=DIFFUSION)
        filaments.add_linkers(spring(2e-5, site_spacing=5.0), 200, bound=50, diffusion=0.1 * DIFFUSION)
        filaments.add_linkers(spring(), concentration=1e-6)
        wall = Sphere([0, 0, 0], RADIUS) if walls else None
        return filaments, made(filaments, 1e5, wall, BOX)

    filaments, linkers = check_that_runs_go_on_to_the_bit(network)
    free = ~np.isnan(linkers.positions[:, 0])
    assert np.array_equal(free, (linkers.held == 0) & (linkers.types < 2))
    assert 50 < free.sum() < 450


def test_those_that_lose_their_filament_are_near_to_where_it_was():
    """A filament that shrinks under hands that never unbind: one that lets go is within reach of the end."""
    filaments = Filaments(viscosity=1e-3 * unit.pascal * unit.second, temperature=300.0)
    growth = Growth(monomers=ACTIN_ATP, pool=0.0, longest=500.0, deterministic=True, minus_capped=True)
    kind = F_ACTIN.with_segment_length(54.0)
    filaments.add_straight(kind, 8, [0, 0, 0], [1, 0, 0], growth=growth, clamped=[0])
    hand = Hand(binding_rate=0.0, reach=REACH, unbinding_rate=0.0)
    filaments.add_linkers(Crosslinker(hands=hand, stiffness=0.02), 400, bound=400, diffusion=0.0)
    context = made(filaments, 1e9, Sphere([0, 0, 0], 600.0))
    here = filaments.in_context(context)
    for _ in range(20):
        before = here.linkers()
        context.getIntegrator().step(1000)
        table = here.linkers()
        let_go = (before.held == 1) & (table.held == 0)
        assert np.array_equal(np.isfinite(table.positions).all(axis=1), table.held == 0)
        # The filament turns around its first node, and is a little bent.
        along = before.arc_lengths[let_go].max(axis=1)
        assert np.all(np.abs(np.linalg.norm(table.positions[let_go], axis=1) - along) < 1.3 * REACH)
    assert 20 < np.sum(table.held == 0) < 400


def test_systems_as_xml_have_them():
    filaments = rods()
    filaments.add_linkers(spring(), 20, diffusion=DIFFUSION, planar=True)
    system = made(filaments, 1e5, Sphere([0, 0, 0], RADIUS), system_only=True)
    text = openmm.XmlSerializer.serialize(system)
    assert openmm.XmlSerializer.serialize(openmm.XmlSerializer.deserialize(text)) == text
    assert 'diffusion=".008"' in text or 'diffusion="0.008"' in text or f'diffusion="{DIFFUSION!r}"' in text


def test_positions_are_set_with_the_table():
    filaments = rods()
    filaments.add_linkers(spring(), 3, diffusion=0.0)
    context = made(filaments, 1e5, Sphere([0, 0, 0], RADIUS))
    here = filaments.in_context(context)
    table = here.linkers()
    assert np.all(np.linalg.norm(table.positions, axis=1) <= RADIUS)
    arguments = {name: getattr(table, name) for name in table.__dataclass_fields__}
    places = np.array([[0.0, 150.0, 0.0], [np.nan] * 3, [10.0, -150.0, 3.0]])
    here.set_linkers(LinkerTable(**{**arguments, "positions": places}))
    found = here.linkers().positions
    np.testing.assert_array_equal(found[[0, 2]], places[[0, 2]])
    assert np.all(np.isfinite(found[1]))
    context.getIntegrator().step(5)
    np.testing.assert_array_equal(here.linkers().positions[[0, 2]], places[[0, 2]])
    with pytest.raises(InputError, match="outside of the walls"):
        here.set_linkers(LinkerTable(**{**arguments, "positions": places + 100.0}))
    bound = {**arguments, "filaments": [[0, -1]] * 3, "positions": places}
    with pytest.raises(InputError, match="no unbound linker with the number 0"):
        here.set_linkers(LinkerTable(**bound))
    with pytest.raises(InputError, match=r"positions must have the shape \(3, 3\)"):
        LinkerTable(**{**arguments, "positions": places[:2]})


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"count": 10, "diffusion": -1.0}, "diffusion cannot be negative|diffusion must"),
        ({"count": 10, "diffusion": np.nan}, "diffusion"),
        ({"count": 10, "diffusion": 1.0 * unit.nanometer}, "diffusion"),
        ({"count": 10, "diffusion": 1.0, "volume": 1e6}, "neither a volume"),
        ({"concentration": 1e-6, "diffusion": 1.0}, "those that diffuse have a count"),
        ({"anchors": [[0.0, 0.0, 0.0]], "diffusion": 1.0}, "those that diffuse have a count"),
        ({"count": 10, "planar": True, "volume": 1e6}, "give their diffusion"),
        ({"count": 10, "planar": 1, "diffusion": 1.0}, "planar"),
        ({"count": 10, "region": Sphere([0, 0, 0], 9.0), "volume": 1e6}, "give their diffusion"),
        ({"count": 10, "region": [], "diffusion": 1.0}, "region must be a Shape"),
        ({"count": 10, "region": "box", "diffusion": 1.0}, "region must be a Shape"),
    ],
)
def test_wrong_arguments_are_refused(arguments, message):
    with pytest.raises(InputError, match=message):
        rods().add_linkers(spring(), **arguments)


@pytest.mark.parametrize(
    ("wall", "box"),
    [
        (None, None),
        (Cylinder([0, 0, 0], [1, 0, 0], RADIUS), None),
        (Plane([0, 0, -RADIUS], [0, 0, 1]), None),
        (Plane([0, 0, -RADIUS], [0, 0, 1]), BOX),
    ],
)
def test_a_region_is_needed(wall, box):
    filaments = rods()
    filaments.add_linkers(spring(), 10, diffusion=DIFFUSION)
    with pytest.raises(InputError, match="diffuse, and need a region"):
        made(filaments, 1e5, wall, box)


def test_a_region_without_room_is_refused():
    filaments = rods()
    filaments.add_linkers(spring(), 10, diffusion=DIFFUSION, planar=True)
    with pytest.raises(openmm.OpenMMException, match="no room"):
        made(filaments, 1e5, Sphere([0, 0, 500], RADIUS))
