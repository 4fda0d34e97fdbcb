"""Filaments that begin, vanish and are cut while they move: how many there are, how long, and in equilibrium.

Against the law of mass action, quadrature of rods between walls, and the master equation of severing.
"""

import tracemalloc
from dataclasses import replace

import numpy as np
import openmm
import pytest
from openmm import app, unit

from openmm_cylchain import (
    F_ACTIN,
    Box,
    Branching,
    Crosslinker,
    DynamicInstability,
    EndStates,
    Filaments,
    Growth,
    Hand,
    InputError,
    MonomerPool,
    Monomers,
    MonomerState,
    Nucleation,
    Plane,
    Severing,
    Slab,
    Sphere,
    capsule_contact_force,
    filament_wall_force,
)
from openmm_cylchain.engine_choice import load_plugin
from support.contexts import positions_of

pytest.importorskip("openmm_cylchain.plugin")

TEMPERATURE = 300.0
KT = 0.00831446261815324 * TEMPERATURE
MONOMER, PER_SEGMENT, FEWEST = 13.5, 8, 4
ACTIN = F_ACTIN.with_segment_length(PER_SEGMENT * MONOMER)
MICROSECOND = 1e6
POOL = MonomerPool(1e-4)
WATER = 1e-3 * unit.pascal * unit.second


def growth(gain, loss, **options):
    """A plus end that gains and loses so many monomers per ps, and a minus end that does not."""
    monomers = Monomers(length=MONOMER, plus_on_rate=gain / POOL.concentration, plus_off_rate=loss)
    return Growth(**{"monomers": monomers, "pool": POOL, "longest": 1000.0, "vanishes": True, **options})


def simulate(filaments, system, positions, step, threads=1, seed=7):
    integrator = filaments.create_integrator(system, step, random_seed=seed, checks=False)
    cpu = openmm.Platform.getPlatformByName("CPU")
    context = openmm.Context(system, integrator, cpu, {"Threads": str(threads)})
    context.setPositions(positions)
    return context


def chain_force(system):
    kind = load_plugin().CylinderChainForce
    return next(kind.cast(force) for force in system.getForces() if kind.isinstance(force))


def blocks(filaments, system, context, steps, looks=10, count=20):
    """For blocks of steps: numbers of filaments, lengths in monomers, energies of a length and of a bend in k_BT."""
    force, found = chain_force(system), []
    for _ in range(count):
        numbers, monomers, energies = [], [], np.zeros(4)
        for _ in range(looks):
            context.getIntegrator().step(steps // (looks * count))
            state = filaments.in_context(context).growth()
            there = state.nodes > 0
            numbers.append(there.sum())
            monomers.append(np.diff(state.monomers[there], axis=1)[:, 0])
            nodes = state.nodes[there]
            stretching, bending = (one._value / KT for one in force.computeEnergies(context))
            energies += stretching, bending, (nodes - 1).sum(), (nodes - 2).sum()
        found.append(
            (np.mean(numbers), np.concatenate(monomers), energies[0] / energies[2], energies[1] / max(1.0, energies[3]))
        )
    return list(zip(*found))


def mean_within(samples, expected, bias):
    """The mean of samples is as expected; their error is so small that a bias would show."""
    samples = np.asarray(samples, dtype=float)
    error = samples.std(ddof=1) / np.sqrt(len(samples))
    assert error < bias * abs(expected) / 4.0, (samples.mean(), expected, error)
    assert abs(samples.mean() - expected) < 4.0 * error, (samples.mean(), expected, error)


def nucleating(step, ratio, turnover, expected, region, surround=None, viscosity=WATER):
    """Filaments that begin and vanish: k_off is turnover per step, and k_on c its ratio-fold."""
    loss = turnover / step
    filaments = Filaments(viscosity, TEMPERATURE)
    nucleation = Nucleation(rate=expected * (1.0 - ratio) * loss, region=region)
    filaments.add_reserve(ACTIN, int(2 * expected) + 30, growth=growth(ratio * loss, loss), nucleation=nucleation)
    _, system, positions = filaments.build()
    if surround is not None:
        surround(filaments, system)
    return filaments, system, simulate(filaments, system, positions, step)


@pytest.mark.parametrize(
    ("microseconds", "ratio", "turnover", "expected", "steps"),
    [
        (10.0, 0.5, 5.0, 120.0, 200),
        (100.0, 0.5, 5.0, 80.0, 200),
        pytest.param(10.0, 0.8, 8.0, 80.0, 1500, marks=pytest.mark.slow),
        pytest.param(1000.0, 0.7, 20.0, 40.0, 600, marks=pytest.mark.slow),
    ],
)
def test_numbers_and_lengths_of_free_filaments(microseconds, ratio, turnover, expected, steps):
    """J/k_off with the fewest monomers, z times as many with each monomer more, and equilibrium of shapes."""
    step = microseconds * MICROSECOND
    filaments, system, context = nucleating(step, ratio, turnover, expected, Sphere([0, 0, 0], 500.0))
    context.getIntegrator().step(steps // 4)
    looks = min(30, steps // 20)
    numbers, monomers, lengths, bends = blocks(filaments, system, context, steps, looks)
    mean_within(numbers, expected, 0.07)
    mean_within([own.mean() for own in monomers], FEWEST + ratio / (1.0 - ratio), 0.05)
    mean_within(lengths, 0.5, 0.05)
    if ratio > 0.6:
        mean_within(bends, 1.0, 0.15)
    state = filaments.in_context(context).growth()
    assert state.without_place == 0 and state.nucleated - state.vanished == (state.nodes > 0).sum()
    assert len(set(state.identities[state.nodes > 0])) == (state.nodes > 0).sum()


WALL, THICKNESS = 5.0, 100.0


def weights_in_a_slab(monomers, lower, upper):
    """exp(-V/k_BT) of rods of so many monomers, over places of their first nodes and directions."""
    along, cosines = np.linspace(lower, upper, 1001), np.linspace(-1.0, 1.0, 1001)

    def energy(height):
        return 0.5 * WALL * np.maximum(np.abs(height) - 0.5 * THICKNESS, 0.0) ** 2

    return np.array(
        [
            np.exp(-(energy(along)[:, None] + energy(along[:, None] + number * MONOMER * cosines)) / KT).mean()
            for number in monomers
        ]
    )


@pytest.mark.sample("^2.0")
@pytest.mark.slow
@pytest.mark.parametrize(("microseconds", "steps"), [(2.0, 1600), (20.0, 1600)])
def test_rods_between_walls(microseconds, steps):
    region = Box([-300, -300, -0.5 * THICKNESS - 5.0], [300, 300, 0.5 * THICKNESS + 5.0])

    def surround(filaments, system):
        system.addForce(filament_wall_force(filaments, system, Slab([0, 0, 0], [0, 0, 1], THICKNESS), WALL))

    free = 100.0
    filaments, system, context = nucleating(microseconds * MICROSECOND, 0.7, 3.0, free, region, surround)
    context.getIntegrator().step(steps // 4)
    _, monomers, lengths, _ = blocks(filaments, system, context, steps)
    # Of those with one segment: numbers in a frame, and lengths.
    rods = np.arange(FEWEST, PER_SEGMENT + 4)
    weights = 0.7 ** (rods - FEWEST) * weights_in_a_slab(rods, -0.5 * THICKNESS - 5.0, 0.5 * THICKNESS + 5.0)
    straight = [own[own <= rods[-1]] for own in monomers]
    mean_within([len(own) / 10.0 for own in straight], free * 0.3 * weights.sum(), 0.08)
    mean_within([own.mean() for own in straight], np.average(rods, weights=weights), 0.03)
    # There would be more without walls.
    assert weights.sum() < 0.9 * np.sum(0.7 ** (rods - FEWEST))
    mean_within(lengths, 0.5, 0.08)


BALL, ROOM = 100.0, 140.0
"""The radii of an obstacle, with the filament, and of the sphere around it, in nm."""


def weights_around_a_ball(monomers, count=200_000):
    """exp(-V/k_BT) of rods between a ball and a sphere, by Monte Carlo of their first nodes within ROOM + 5 nm."""
    generator = np.random.default_rng(6)
    first, along = generator.normal(size=(2, count, 3))
    first *= (ROOM + 5.0) * (generator.uniform(size=count) ** (1.0 / 3.0) / np.linalg.norm(first, axis=1))[:, None]
    along /= np.linalg.norm(along, axis=1)[:, None]
    weights = []
    for number in monomers:
        length = number * MONOMER
        nearest = np.clip(-np.sum(first * along, axis=1), 0.0, length)
        depths = [BALL - np.linalg.norm(first + nearest[:, None] * along, axis=1)]
        depths += [np.linalg.norm(own, axis=1) - ROOM for own in (first, first + length * along)]
        weights.append(np.exp(-0.5 * WALL * sum(np.maximum(own, 0.0) ** 2 for own in depths) / KT).mean())
    return np.array(weights)


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore::openmm_cylchain.ContactWarning")
def test_rods_around_a_ball():
    """New ones, and monomers that come, find contacts and walls in their way."""
    step, ratio, turnover, free, steps, thin = 1.0 * MICROSECOND, 0.6, 4.0, 30.0, 10000, 3.0
    loss = turnover / step
    topology, system = app.Topology(), openmm.System()
    topology.addAtom("B", None, topology.addResidue("B", topology.addChain()))
    system.addParticle(0.0)
    filaments = Filaments(WATER, TEMPERATURE)
    region = Sphere([0, 0, 0], ROOM + 5.0)
    nucleation = Nucleation(rate=free * (1.0 - ratio) * loss, region=region)
    filaments.add_reserve(ACTIN, 200, growth=growth(ratio * loss, loss), nucleation=nucleation)
    positions = filaments.add_to(topology, system, np.zeros((1, 3)))
    # So few rods hardly meet each other: that is a percent of their number.
    contacts = capsule_contact_force(filaments, system, thin, WALL, [0], 2.0 * BALL - thin)
    system.addForce(contacts)
    system.addForce(filament_wall_force(filaments, system, Sphere([0, 0, 0], ROOM), WALL))
    context = simulate(filaments, system, positions, step)
    context.getIntegrator().step(100)
    _, monomers, *_ = blocks(filaments, system, context, steps, looks=50)
    rods = np.arange(FEWEST, PER_SEGMENT + 4)
    weights = ratio ** (rods - FEWEST) * weights_around_a_ball(rods)
    straight = [own[own <= rods[-1]] for own in monomers]
    mean_within([len(own) / 50.0 for own in straight], free * (1.0 - ratio) * weights.sum(), 0.09)
    mean_within([own.mean() for own in straight], np.average(rods, weights=weights), 0.03)
    # Of free ones there would be three times as many, and longer.
    assert weights.sum() < 0.4 * np.sum(ratio ** (rods - FEWEST))
    assert np.average(rods, weights=weights) < 0.95 * np.average(rods, weights=ratio**rods)


STILL = EndStates(on_rates=[0.0, 0.0], off_rates=[0.0, 0.0], switch_rates=np.zeros((2, 2)))
"""An end at which nothing happens, with as many states as one with a dynamic instability."""


def lengths_of_lineages(gain, cut, fewest, most=400):
    """Monomers of filaments that grow, begin with the fewest, and lose the part at their minus end at random cuts.

    The stationary solution of the master equation, in which parts that are too short are lost.
    """
    numbers = np.arange(fewest, most)
    generator = np.diag(-gain - cut * (numbers - 1.0)) + np.diag(np.full(len(numbers) - 1, gain), -1)
    generator += np.triu(np.full((len(numbers),) * 2, cut), 1)
    begin = np.zeros(len(numbers))
    begin[0] = -1.0
    weights = np.linalg.solve(generator, begin)
    return numbers, weights / weights.sum()


@pytest.mark.parametrize(
    ("microseconds", "gain", "cut", "count", "steps"),
    [
        (20.0, 2.0, 0.008, 40, 400),
        pytest.param(200.0, 2.0, 0.001, 40, 1500, marks=pytest.mark.slow),
    ],
)
def test_lengths_of_filaments_that_are_cut(microseconds, gain, cut, count, steps):
    """One grows at the speed v and is cut at the rate r per length; the part with the new plus end shrinks away."""
    step = microseconds * MICROSECOND
    shrinks = DynamicInstability(catastrophe_rate=0.0, rescue_rate=0.0, shrinking_off_rate=400.0 * gain / step)
    severing = Severing(rate=cut / step / MONOMER, shrinks=True)
    # Four monomers are half a segment: as short as one with friction may be.
    options = {"severing": severing, "longest": 4000.0, "minus_instability": STILL}
    grows = growth(gain / step, 0.0, plus_instability=shrinks, **options)
    filaments = Filaments(WATER, TEMPERATURE)
    numbers, weights = lengths_of_lineages(gain, cut, FEWEST)
    mean = numbers @ weights
    # As often as lineages end.
    ends = cut * (FEWEST - 1) * np.sum(weights * (numbers >= 2)) * count / step
    nucleation = Nucleation(rate=ends, region=Sphere([0, 0, 0], 500.0))
    filaments.add_reserve(ACTIN, 8 * count, growth=grows, nucleation=nucleation)
    for number in range(count):
        filaments.add_equilibrium(ACTIN, max(1, round(mean / PER_SEGMENT)), number + 1, growth=grows)
    _, system, positions = filaments.build()
    context = simulate(filaments, system, positions, step)
    context.getIntegrator().step(steps // 4)
    force, means, lengths, bends, spread = chain_force(system), [], [], [], []
    for _ in range(20):
        found, energies = [], np.zeros(4)
        for _ in range(5):
            context.getIntegrator().step(steps // 100)
            state = filaments.in_context(context).growth()
            grow = (state.nodes > 0) & ~state.shrinking[:, 1]
            found.append(np.diff(state.monomers[grow], axis=1)[:, 0])
            nodes = state.nodes[state.nodes > 0]
            stretching, bending = (one._value / KT for one in force.computeEnergies(context))
            energies += stretching, bending, (nodes - 1).sum(), (nodes - 2).sum()
        found = np.concatenate(found)
        means.append(found.mean())
        spread.append(np.mean(found.astype(float) ** 2))
        lengths.append(energies[0] / energies[2])
        bends.append(energies[1] / energies[3])
    mean_within(means, mean, 0.12)
    mean_within(spread, numbers.astype(float) ** 2 @ weights, 0.25)
    mean_within(lengths, 0.5, 0.07)
    mean_within(bends, 1.0, 0.15)
    # Of long filaments it is sqrt(pi v/2r).
    assert mean == pytest.approx(np.sqrt(np.pi * gain / (2.0 * cut)), rel=0.2)
    assert state.severed > count and state.without_place == 0


def test_hands_stay_where_they_hold_filaments_that_are_cut():
    """Each keeps its length along the filament, on the part that has it."""
    step = 10.0
    filaments = Filaments(WATER, TEMPERATURE)
    severing = Severing(rate=0.02 / step / 3000.0)
    cut = growth(0.0, 0.0, severing=severing, longest=3000.0, minus_capped=True, vanishes=False)
    for number in range(5):
        filaments.add_equilibrium(ACTIN, 24, number + 1, start=[0, 1000.0 * number, 0], growth=cut)
    filaments.add_reserve(ACTIN, 60, growth=cut)
    still = Hand(binding_rate=0.0, reach=20.0, unbinding_rate=0.0)
    filaments.add_linkers(Crosslinker(name="link", hands=(still, still), stiffness=0.1), 100, volume=1e9, bound=100)
    _, system, positions = filaments.build()
    context = simulate(filaments, system, positions, step)
    inside = filaments.in_context(context)
    before, places = inside.linkers(), inside.linker_places()._value[:, 0]
    context.getIntegrator().step(400)
    after, state = inside.linkers(), inside.growth()
    assert 20 < state.severed < 60 and np.array_equal(before.numbers, after.numbers)
    np.testing.assert_array_equal(before.arc_lengths[:, 0], after.arc_lengths[:, 0])
    assert np.mean(before.filaments[:, 0] != after.filaments[:, 0]) > 0.3
    first, last = MONOMER * state.monomers[after.filaments[:, 0]].T
    assert np.all((first <= after.arc_lengths[:, 0]) & (after.arc_lengths[:, 0] <= last))
    # In 4 ns they hardly move, but where a joint was drawn anew by a cut.
    moved = np.linalg.norm(inside.linker_places()._value[:, 0] - places, axis=1)
    assert np.median(moved) < 1.0 and moved.max() < ACTIN.segment_length
    # All parts of a filament lie one behind the other.
    present = state.monomers[state.nodes > 0]
    assert np.diff(present, axis=1).sum() == 5 * 24 * PER_SEGMENT


def test_new_plus_ends_shrink_where_minus_ends_have_one_state():
    shrinks = DynamicInstability(catastrophe_rate=0.0, rescue_rate=0.0, shrinking_off_rate=1e-6)
    severing = Severing(rate=2e-9, shrinks=True)
    filaments = Filaments(WATER, TEMPERATURE)
    cut = growth(1e-6, 0.0, plus_instability=shrinks, severing=severing, minus_capped=True)
    filaments.add_straight(ACTIN, 5, [0, 0, 0], [1, 0, 0], growth=cut)
    filaments.add_reserve(ACTIN, 3, growth=cut)
    _, system, positions = filaments.build()
    context = simulate(filaments, system, positions, 1e6)
    context.getIntegrator().step(5)
    found = filaments.in_context(context).growth()
    parents = set(found.parents[found.parents >= 0])
    assert parents and all(found.shrinking[np.isin(found.identities, list(parents)), 1])


def everything():
    """Filaments that grow, begin, vanish, branch, age and are cut, with linkers, contacts and walls."""
    step = 2.0 * MICROSECOND
    aging = [MonomerState(name="old", rate=0.02 / step, plus_off_rate=0.2 / step)]
    monomers = Monomers(length=MONOMER, plus_on_rate=0.3 / step / 1e-4, plus_off_rate=0.2 / step, aging=aging)
    severing = Severing(rate=0.004 / step / 100.0, of_states=["old"])
    pool = MonomerPool(1e-4, 1e8)
    options = {"monomers": monomers, "pool": pool, "longest": 700.0, "vanishes": True, "minus_capped": True}
    grows = Growth(**options, severing=severing)
    filaments = Filaments(1e-2 * unit.pascal * unit.second, TEMPERATURE)
    for number in range(4):
        filaments.add_straight(ACTIN, 3, [-150, 30 * number, 0], [1, 0, 0], growth=grows)
    region = Sphere([0, 0, 0], 300.0)
    filaments.add_reserve(ACTIN, 20, growth=grows, nucleation=Nucleation(rate=0.05 / step, region=region, order=2))
    letting_go = {"debranching_rate": 0.001 / step, "debranching_force": 20.0}
    branching = Branching(rate=0.005 / step / 100.0, distance=7.5, **letting_go)
    filaments.add_reserve(ACTIN, 10, growth=Growth(**options), nucleation=branching)
    hand = Hand(binding_rate=0.5 / step, reach=30.0, unbinding_rate=0.05 / step)
    filaments.add_linkers(Crosslinker(name="link", hands=(hand, hand), stiffness=0.05), 300, volume=1e8)
    _, system, positions = filaments.build()
    system.addForce(capsule_contact_force(filaments, system, 7.0, stiffness=4.0))
    system.addForce(filament_wall_force(filaments, system, Sphere([0, 0, 0], 400.0), 2.0))
    return filaments, system, positions, step


def seen(filaments, context):
    inside = filaments.in_context(context)
    state, table = inside.growth(), inside.linkers()
    numbers = np.concatenate(
        [state.monomers.ravel(), state.end_states.ravel(), state.identities, state.parents, state.gained.ravel()]
    )
    counts = state.nucleated, state.vanished, state.severed, state.without_place
    hands = table.filaments.ravel(), np.nan_to_num(table.arc_lengths.ravel()), table.numbers
    return [positions_of(context), numbers, np.array(counts), *hands, state.concentrations._value]


@pytest.mark.parametrize("kind, seed", [("checkpoint", 7), ("checkpoint", 10), ("State", 7)])
def test_restarts_go_on_to_the_bit(kind, seed):
    """On one thread and on two. With the second seed, hands are on parts that are cut off and vanish."""
    filaments, system, positions, step = everything()
    one, two, other = (simulate(filaments, system, positions, step, threads, seed) for threads in (1, 2, 1))
    for context in (one, two):
        context.getIntegrator().step(150)
    for first, second in zip(seen(filaments, one), seen(filaments, two), strict=True):
        np.testing.assert_array_equal(first, second)
    if kind == "checkpoint":
        other.loadCheckpoint(one.createCheckpoint())
    else:
        state = one.getState(positions=True, velocities=True, parameters=True, integratorParameters=True)
        state = openmm.XmlSerializer.deserialize(openmm.XmlSerializer.serialize(state))
        other.setState(state)
    one.getIntegrator().step(100)
    other.getIntegrator().step(100)
    for first, second in zip(seen(filaments, one), seen(filaments, other), strict=True):
        np.testing.assert_array_equal(first, second)
    found = filaments.in_context(one).growth()
    assert found.nucleated > 10 and found.vanished > 5 and found.severed > 3
    table = filaments.in_context(one).linkers()
    assert (table.types > 0).any() and ((table.filaments >= 0).all(axis=1) & (table.types == 0)).any()


def test_memory_stays_as_it_is():
    """While 100000 filaments begin and vanish."""
    filaments, system, context = nucleating(10.0 * MICROSECOND, 0.5, 50.0, 40.0, Sphere([0, 0, 0], 500.0))

    def resident():
        with open("/proc/self/statm") as file:
            return int(file.read().split()[1]) * 4096

    context.getIntegrator().step(20)
    tracemalloc.start()
    before, begun = resident(), filaments.in_context(context).growth().nucleated
    sizes = []
    for _ in range(10):
        context.getIntegrator().step(12)
        sizes.append(len(context.createCheckpoint()))
    assert filaments.in_context(context).growth().nucleated - begun > 100000
    assert resident() - before < 4e6 and max(sizes) < 1.2 * min(sizes)
    tracemalloc.stop()


def test_a_plane_cuts_filaments_where_they_go_through_it():
    """At the nearest monomers, from both sides, again and again; all else stays to the bit, and hands with it."""
    still = growth(0.0, 0.0, severing=Severing(rate=0.0), longest=2400.0, minus_capped=True, vanishes=False)
    filaments = Filaments(WATER, TEMPERATURE)
    soft = replace(ACTIN, bending_rigidity=400.0 * KT)
    for number in range(30):
        filaments.add_equilibrium(soft, 20, number + 1, start=[0, 0, 300.0 * number], growth=still)
    filaments.add_reserve(soft, 200, growth=still)
    hand = Hand(binding_rate=0.0, reach=10.0, unbinding_rate=0.0)
    places = [(number, 72.0 * along) for number in range(30) for along in range(1, 30)]
    kind = Crosslinker(hands=hand, stiffness=1.0, rest_length=0.0)
    filaments.add_linkers(kind, len(places), volume=1e9, bound=len(places), places=places)
    _, system, positions = filaments.build()
    context = simulate(filaments, system, positions, 1e5)
    context.getIntegrator().step(50)
    here = filaments.in_context(context)
    expected, others = set(), []
    before = positions_of(context)
    for number in range(30):
        nodes = before[filaments.node_indices[number][:21]]
        first, second = nodes[:-1, 0] - 300.0, nodes[1:, 0] - 300.0
        for segment in np.flatnonzero((first < 0.0) != (second < 0.0)):
            place = PER_SEGMENT * (segment + first[segment] / (first[segment] - second[segment]))
            expected.add((number, round(place)))
    crossings = len({own for own in expected if 0 < own[1] < 160})
    expected = {own for own in expected if FEWEST <= own[1] <= 160 - FEWEST}
    assert len(expected) > len({number for number, _ in expected}) > 10
    hands = here.linkers()
    found = here.cut(Plane([300, 0, 0], [2, 0, 0]))
    state, after = here.growth(), positions_of(context)
    # Parts are not cut again, whose new ends are drawn, on either side of the plane.
    assert found == (crossings, state.severed) and state.without_place == 0
    root = {own: number for number, own in enumerate(state.identities[:30])}
    for own, parent in zip(state.identities, state.parents):
        if parent >= 0:
            root[own] = root[parent]
    there = np.flatnonzero(state.nodes)
    cuts = {(root[state.identities[own]], int(state.monomers[own, 0])) for own in there if state.parents[own] >= 0}
    # Those that leave less than the fewest monomers between them are not.
    assert cuts <= expected and len(cuts) == state.severed > 0.8 * len(expected)
    for number in range(30):
        parts = [own for own in there if root[state.identities[own]] == number]
        monomers = state.monomers[parts][np.argsort(state.monomers[parts, 0])]
        assert monomers[0, 0] == 0 and monomers[-1, 1] == 160
        np.testing.assert_array_equal(monomers[1:, 0], monomers[:-1, 1])
        if len(parts) == 1:
            others.append(number)
            own = filaments.node_indices[number]
            np.testing.assert_array_equal(after[own], before[own])
    assert 0 < len(others) < 20
    moved = here.linkers()
    np.testing.assert_array_equal(moved.arc_lengths, hands.arc_lengths)
    for (was, _), (now, _), (place, _) in zip(hands.filaments, moved.filaments, moved.arc_lengths):
        assert root[state.identities[now]] == was
        first, last = state.monomers[now] * MONOMER
        assert first <= place <= last
    # All of what goes through the plane is where it was cut, or has been drawn there anew.
    again = here.cut(Plane([300, 0, 0], [-1, 0, 0]), others)
    assert again == (0, 0) or again[1] == 0
    context.getIntegrator().step(50)
    assert here.cut(Plane([0, 0, 4500], [0, 0, 1]), [0, 1]) == (0, 0)


def test_what_planes_do_not_cut():
    filaments = Filaments(WATER, TEMPERATURE)
    still = growth(0.0, 0.0, severing=Severing(rate=0.0), vanishes=False)
    filaments.add_straight(ACTIN, 5, [0, 0, 0], [1, 0, 0])
    filaments.add_straight(ACTIN, 5, [0, 100, 0], [1, 0, 0], growth=still)
    _, system, positions = filaments.build()
    here = filaments.in_context(simulate(filaments, system, positions, 1e5))
    middle = Plane([250, 0, 0], [1, 0, 0])
    with pytest.raises(InputError, match="Filament 0 cannot be cut: it does not grow"):
        here.cut(middle, [0])
    with pytest.raises(InputError, match="plane must be an object of the class Plane"):
        here.cut(Sphere([0, 0, 0], 100.0))
    # There is no place for the part.
    assert here.cut(middle) == (1, 0) and here.growth().without_place == 1
    boxed = Filaments(WATER, TEMPERATURE)
    boxed.add_straight(ACTIN, 5, [0, 100, 0], [1, 0, 0], growth=still)
    _, system, positions = boxed.build(box_vectors=2000.0 * np.eye(3))
    with pytest.raises(InputError, match="In a periodic box"):
        boxed.in_context(simulate(boxed, system, positions, 1e5)).cut(middle)


@pytest.mark.parametrize("severing", [None, Severing(rate=2e-9)])
def test_hands_let_go_of_what_vanishes(severing):
    """Others may take the place of a filament that vanishes, but not what is bound to it."""
    step = MICROSECOND
    filaments = Filaments(WATER, TEMPERATURE)
    nucleation = Nucleation(rate=2.0 / step, region=Sphere([0, 0, 0], 400.0), length=8 * MONOMER)
    turning = growth(0.3 / step, 0.6 / step, longest=600.0, minus_capped=True, severing=severing)
    filaments.add_reserve(ACTIN, 60, growth=turning, nucleation=nucleation)
    hand = Hand(binding_rate=5.0 / step, reach=40.0, unbinding_rate=0.01 / step)
    filaments.add_linkers(Crosslinker(hands=hand, stiffness=0.1, rest_length=0.0), count=60, volume=1e8)
    _, system, positions = filaments.build()
    context = simulate(filaments, system, positions, step)
    inside, before, followed = filaments.in_context(context), {}, 0
    for _ in range(300):
        context.getIntegrator().step(1)
        state, linkers = inside.growth(), inside.linkers()
        now = {}
        for number, side in np.argwhere(linkers.filaments >= 0):
            slot = linkers.filaments[number, side]
            known = state.identities[slot], state.parents[slot]
            now[linkers.numbers[number], side] = (*known, linkers.arc_lengths[number, side])
        for key in now.keys() & before.keys():
            if now[key][2] == before[key][2]:
                # It is on the same filament, or on a part of it.
                assert before[key][0] in now[key][:2] or severing is not None
                followed += 1
        before = now
    assert followed > 1000 and state.vanished > 100 and (severing is None) == (state.severed == 0)
    bound = (linkers.filaments >= 0).all(axis=1)
    places = inside.linker_places()._value[bound]
    assert np.all(np.linalg.norm(places[:, 0] - places[:, 1], axis=1) < 60.0)
