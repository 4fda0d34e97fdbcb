"""Filaments that grow while they move: rates of free ends, equilibrium at all times, and lengths between walls."""

import numpy as np
import openmm
import pytest
from openmm import unit

from openmm_cylchain import (
    F_ACTIN,
    MICROTUBULE,
    TUBULIN,
    Crosslinker,
    DynamicInstability,
    Filaments,
    Growth,
    Hand,
    Monomers,
    Slab,
    capsule_contact_force,
    filament_wall_force,
)
from openmm_cylchain.engine_choice import load_plugin

pytest.importorskip("openmm_cylchain.plugin")

TEMPERATURE = 300.0
KT = 0.00831446261815324 * TEMPERATURE
MONOMER = 2.7
PER_SEGMENT = 40
ACTIN = F_ACTIN.with_segment_length(PER_SEGMENT * MONOMER)
"""Segments of 40 monomers."""
ON = unit.liter / unit.mole / unit.second


def growth(plus, minus=(0.0, 0.0), **options):
    """Ends that gain and lose so many monomers per second."""
    monomers = Monomers(
        length=MONOMER,
        plus_on_rate=plus[0] * 1e6 * ON,
        plus_off_rate=plus[1] / unit.second,
        minus_on_rate=minus[0] * 1e6 * ON,
        minus_off_rate=minus[1] / unit.second,
    )
    return Growth(monomers=monomers, pool=unit.Quantity(1e-6, unit.molar), **options)


def simulate(filaments, system, positions, step):
    integrator = filaments.create_integrator(system, step, random_seed=5, checks=False)
    context = openmm.Context(system, integrator, openmm.Platform.getPlatformByName("CPU"), {"Threads": "1"})
    context.setPositions(positions)
    return context, integrator


def chain_force(system):
    kind = load_plugin().CylinderChainForce
    return next(kind.cast(force) for force in system.getForces() if kind.isinstance(force))


def mean_within(samples, expected, bias):
    """The mean of samples, a row each, is as expected; their error is so small that a bias would show."""
    samples = np.asarray(samples)
    error = samples.std(ddof=1) / np.sqrt(len(samples))
    assert error < bias * abs(expected) / 4.0
    assert abs(samples.mean() - expected) < 4.0 * error, (samples.mean(), expected, error)


@pytest.mark.parametrize("milliseconds, count, steps", [(0.03, 60, 1000), (1.0, 250, 240)])
def test_free_ends_keep_their_rates_and_the_equilibrium_of_filaments(milliseconds, count, steps):
    rates = 3.0 / (0.03 * milliseconds**0.5)
    plus, minus = (2.0 * rates, rates), (0.5 * rates, rates)
    filaments = Filaments(1e-3 * unit.pascal * unit.second, TEMPERATURE)
    for number in range(count):
        filaments.add_equilibrium(ACTIN, 7, number, growth=growth(plus, minus, longest=4.0 * unit.micrometer))
    topology, system, positions = filaments.build()
    context, integrator = simulate(filaments, system, positions, milliseconds * unit.millisecond)
    force, lengths, bends = chain_force(system), [], []
    for _ in range(40):
        integrator.step(steps // 40)
        nodes = filaments.in_context(context).growth().nodes
        stretching, bending = force.computeEnergies(context)
        lengths.append(stretching._value / KT / (nodes - 1).sum())
        bends.append(bending._value / KT / (nodes - 2).sum())
    time, state = milliseconds * 1e-3 * steps, filaments.in_context(context).growth()
    moved = state.monomers - [0, 7 * PER_SEGMENT]
    mean_within(moved[:, 1], (plus[0] - plus[1]) * time, 0.25)
    mean_within(moved[:, 0], (minus[1] - minus[0]) * time, 0.6)
    assert np.all(state.gained[:, 1] - state.lost[:, 1] == moved[:, 1]) and not state.waited.any()
    # Joints of some 160 k_BT bend as harmonic ones, to half a percent.
    mean_within(lengths, 0.5, 0.05)
    mean_within(bends, 1.0, 0.05)


@pytest.mark.parametrize("segments, rate", [(2, 5e3), (4, 600.0)])
def test_seeds_keep_their_equilibrium_at_the_recommended_step(segments, rate):
    """It is far longer than the relaxation of a seed: that of the longest filament counts."""
    filaments, still = (Filaments(1e-3 * unit.pascal * unit.second, TEMPERATURE) for _ in range(2))
    for number in range(400):
        own = growth((rate, rate), (rate, rate), longest=4.0 * unit.micrometer)
        filaments.add_equilibrium(ACTIN, segments, number, growth=own)
    still.add_equilibrium(ACTIN, segments, 0)
    step = filaments.recommended_time_step().step
    assert step > 10.0 * 20.0 * still.recommended_time_step().allowed["relaxation"]
    assert step == pytest.approx(still.recommended_time_step().allowed["rotation"], rel=0.3)
    topology, system, positions = filaments.build()
    context, integrator = simulate(filaments, system, positions, step)
    force, lengths, bends = chain_force(system), [], []
    for _ in range(60):
        integrator.step(2)
        stretching, bending = force.computeEnergies(context)
        nodes = filaments.in_context(context).growth().nodes
        lengths.append(stretching._value / KT / (nodes - 1).sum())
        bends.append(bending._value / KT / (nodes - 2).sum())
    mean_within(lengths, 0.5, 0.05)
    mean_within(bends, 1.0, 0.05)
    assert filaments.in_context(context).growth().gained.sum() > 1000
    assert integrator.getNumDividedSteps() < 400 * 120 * 1e-3


def squares_across(options, milliseconds, count, steps):
    """Mean square displacements of last nodes across their filaments in a step, and how often joints came and went."""
    filaments = Filaments(1e-3 * unit.pascal * unit.second, TEMPERATURE)
    for number in range(count):
        filaments.add_equilibrium(ACTIN, 7, number, **options)
    topology, system, positions = filaments.build()
    context, integrator = simulate(filaments, system, positions, milliseconds * unit.millisecond)
    ends = np.array([[own[0], own[-1]] for own in filaments.node_indices])
    tips, directions, nodes = [], [], []
    for _ in range(steps):
        integrator.step(1)
        own = context.getState(positions=True).getPositions(asNumpy=True)._value[ends]
        along = own[:, 1] - own[:, 0]
        tips.append(own[:, 1])
        directions.append(along / np.linalg.norm(along, axis=1)[:, None])
        nodes.append(filaments.in_context(context).growth().nodes if options else np.full(count, 8))
    moves, directions = np.diff(tips, axis=0), np.array(directions[:-1])
    across = (moves**2).sum(axis=2) - (moves * directions).sum(axis=2) ** 2
    return across.mean(axis=0), np.count_nonzero(np.diff(nodes, axis=0))


@pytest.mark.parametrize("milliseconds", [pytest.param(0.3, marks=pytest.mark.slow), 1.0])
def test_tips_move_as_those_of_filaments_that_do_not_grow(milliseconds):
    """That joints come and go near them moves them no more."""
    own = growth((3000.0, 3000.0), longest=2.5 * unit.micrometer, minus_capped=True)
    growing, passages = squares_across({"growth": own}, milliseconds, 200, 200)
    still, _ = squares_across({}, milliseconds, 200, 200)
    assert passages > 500
    error = np.hypot(*(one.std(ddof=1) / np.sqrt(len(one)) / one.mean() for one in (growing, still)))
    assert 4.0 * error < 0.05
    assert growing.mean() / still.mean() == pytest.approx(1.0, abs=0.01 + 4.0 * error)


def test_spare_nodes_are_where_the_last_node_is():
    filaments = Filaments(1e-3 * unit.pascal * unit.second, TEMPERATURE)
    for number in range(5):
        options = growth((4e3, 2e3), (2e3, 3e3), longest=2.0 * unit.micrometer)
        filaments.add_equilibrium(ACTIN, 4, number, growth=options)
    topology, system, positions = filaments.build()
    context, integrator = simulate(filaments, system, positions, 0.1 * unit.millisecond)
    for _ in range(10):
        integrator.step(20)
        where = context.getState(positions=True).getPositions(asNumpy=True)._value
        for nodes, own in zip(filaments.in_context(context).growth().nodes, filaments.node_indices):
            spare = where[own][nodes - 1 :]
            assert np.all(spare == spare[0])
            lengths = np.linalg.norm(np.diff(where[own][:nodes], axis=0), axis=1)
            assert np.all((lengths > 0.4 * ACTIN.segment_length) & (lengths < 2.0 * ACTIN.segment_length))


WALL, THICKNESS = 5.0, 170.0
RATE = 2e5


def weights_in_a_slab(monomers):
    """Of rods of so many monomers between soft walls: their places and directions, by quadrature."""
    along, cosines = np.linspace(-0.5 * THICKNESS - 4.0, 0.5 * THICKNESS + 4.0, 801), np.linspace(-1.0, 1.0, 401)

    def energy(height):
        return 0.5 * WALL * np.maximum(np.abs(height) - 0.5 * THICKNESS, 0.0) ** 2

    weights = []
    for number in monomers:
        both = energy(along)[:, None] + energy(along[:, None] + number * MONOMER * cosines)
        weights.append(np.exp(-both / KT).mean())
    return np.array(weights)


@pytest.mark.sample("^20")
@pytest.mark.slow
@pytest.mark.parametrize("microseconds, steps", [(2.0, 12000), (20.0, 1600)])
def test_lengths_of_rods_between_walls_are_in_equilibrium(microseconds, steps):
    filaments = Filaments(1e-3 * unit.pascal * unit.second, TEMPERATURE)
    generator = np.random.default_rng(1)
    grows = growth((RATE, RATE), longest=108.0, shortest=60.0, minus_capped=True)
    for angle in generator.uniform(0.0, 2.0 * np.pi, 150):
        start = [0.0, 0.0, generator.uniform(-70.0, 70.0)]
        filaments.add_straight(ACTIN, 1, start, [np.cos(angle), np.sin(angle), 0.0], growth=grows)
    topology, system, positions = filaments.build()
    system.addForce(filament_wall_force(filaments, system, Slab([0, 0, 0], [0, 0, 1], THICKNESS), WALL))
    context, integrator = simulate(filaments, system, positions, microseconds * unit.microsecond)
    integrator.step(steps // 3)
    # Of those with one segment.
    numbers, blocks = np.arange(22, 60), []
    for _ in range(20):
        found = []
        for _ in range(8):
            integrator.step(steps // 160)
            monomers = filaments.in_context(context).growth().monomers
            found.append(monomers[:, 1] - monomers[:, 0])
        found = np.concatenate(found)
        blocks.append(found[found < 60].mean())
    weights = weights_in_a_slab(numbers)
    expected = np.average(numbers, weights=weights)
    # Without walls it would be a monomer and a half more.
    assert numbers.mean() - expected > 1.3
    mean_within(blocks, expected, 0.025)


@pytest.mark.slow
def test_contacts_links_walls_and_growth_together_keep_the_equilibrium_of_filaments():
    filaments = Filaments(1e-2 * unit.pascal * unit.second, TEMPERATURE)
    generator = np.random.default_rng(2)
    for number in range(40):
        options = growth((8e3, 4e3), (2e3, 6e3), longest=1.5 * unit.micrometer)
        start = generator.uniform(-150.0, 150.0, 3)
        filaments.add_equilibrium(ACTIN, 4, number, start, growth=options)
    hand = Hand(binding_rate=5e4 / unit.second, reach=40.0, unbinding_rate=500.0 / unit.second)
    linker = Crosslinker(name="link", hands=(hand, hand), stiffness=0.06, rest_length=30.0)
    filaments.add_linkers(linker, 1000, volume=0.3 * unit.micrometer**3)
    topology, system, positions = filaments.build()
    system.addForce(filament_wall_force(filaments, system, Slab([0, 0, 0], [0, 0, 1], 900.0), 1.0))
    system.addForce(capsule_contact_force(filaments, system, 7.0, stiffness=5.0))
    context, integrator = simulate(filaments, system, positions, 2.0 * unit.microsecond)
    force, lengths, bends, pulling = chain_force(system), [], [], []
    integrator.step(500)
    for _ in range(40):
        integrator.step(100)
        inside = filaments.in_context(context)
        nodes = inside.growth().nodes
        stretching, bending = force.computeEnergies(context)
        lengths.append(stretching._value / KT / (nodes - 1).sum())
        bends.append(bending._value / KT / (nodes - 2).sum())
        pulling.append((inside.linkers().filaments >= 0).all(axis=1).sum())
    events = inside.growth()
    assert (events.gained + events.lost).sum() > 4000 and np.mean(pulling) > 10
    mean_within(lengths, 0.5, 0.1)
    mean_within(bends, 1.0, 0.1)


def test_linkers_are_where_they_hold_filaments_that_have_grown():
    filaments = Filaments(1e-2 * unit.pascal * unit.second, TEMPERATURE)
    for number in range(3):
        options = growth((6e3, 4e3), (5e3, 4e3), longest=1.5 * unit.micrometer)
        filaments.add_equilibrium(ACTIN, 4, number, [0.0, 20.0 * number, 0.0], direction=[1, 0, 0], growth=options)
    hand = Hand(binding_rate=5e4 / unit.second, reach=40.0, unbinding_rate=100.0 / unit.second)
    filaments.add_linkers(Crosslinker(name="link", hands=(hand, hand), stiffness=0.06), 200, volume=1e6)
    topology, system, positions = filaments.build()
    context, integrator = simulate(filaments, system, positions, 5.0 * unit.microsecond)
    integrator.step(2000)
    inside = filaments.in_context(context)
    growth_now, table, pulls = inside.growth(), inside.linkers(), inside.linker_pulls()
    assert len(pulls.numbers) > 10 and np.ptp(growth_now.monomers[:, 0]) > 0
    for filament, along in zip(table.filaments.ravel(), table.arc_lengths.ravel()):
        if filament >= 0:
            first, last = MONOMER * growth_now.monomers[filament]
            assert first - 1e-9 <= along <= last + 1e-9
    # Their energy is that of what has no energy of chains.
    stretching, bending = chain_force(system).computeEnergies(context)
    energy = context.getState(energy=True).getPotentialEnergy() - stretching - bending
    assert 0.5 * 0.06 * np.sum(pulls.lengths**2) == pytest.approx(energy._value, rel=1e-9)


def test_microtubules_grow_and_shrink_with_the_mean_speed_of_dynamic_instability():
    catastrophe, rescue, shrinking = 20.0, 40.0, 733.0
    instability = DynamicInstability(
        catastrophe_rate=catastrophe / unit.second,
        rescue_rate=rescue / unit.second,
        shrinking_off_rate=shrinking / unit.second,
    )
    # At 200 uM they gain 1736 dimers per second while they grow.
    options = {"pool": unit.Quantity(2e-4, unit.molar), "longest": 6.0 * unit.micrometer, "minus_capped": True}
    grows = Growth(monomers=TUBULIN, plus_instability=instability, **options)
    segment = 200 * TUBULIN.length
    filaments = Filaments(1e-3 * unit.pascal * unit.second, TEMPERATURE)
    for number in range(80):
        filaments.add_straight(
            MICROTUBULE.with_segment_length(segment), 20, [0, 100 * number, 0], [1, 0, 0], growth=grows
        )
    topology, system, positions = filaments.build()
    context, integrator = simulate(filaments, system, positions, 5.0 * unit.millisecond)
    integrator.step(100)
    # From when ends have forgotten that all of them grew at the start.
    before = filaments.in_context(context).growth()
    integrator.step(200)
    state = filaments.in_context(context).growth()
    speed = (state.monomers - before.monomers)[:, 1] / 1.0
    growing = 8.9 * 200.0 - 44.0
    mean_within(speed, (growing * rescue - shrinking * catastrophe) / (catastrophe + rescue), 0.12)
    spread = rescue * catastrophe * (growing + shrinking) ** 2 / (catastrophe + rescue) ** 3
    assert speed.var() == pytest.approx(2.0 * spread, rel=0.6)
    assert state.catastrophes.sum() > 1000 and not state.catastrophes[:, 0].any()
    assert 0.12 < state.shrinking[:, 1].mean() < 0.55
    assert not state.gained[:, 0].any()


def test_spare_nodes_follow_where_energies_are_minimised():
    filaments = Filaments(1e-3 * unit.pascal * unit.second, TEMPERATURE)
    filaments.add_equilibrium(ACTIN, 4, 1, growth=growth((4e3, 2e3), longest=2.0 * unit.micrometer))
    topology, system, positions = filaments.build()
    context, integrator = simulate(filaments, system, positions, 0.1 * unit.millisecond)
    integrator.step(5)
    openmm.LocalEnergyMinimizer.minimize(context, 1e-3)
    where = context.getState(positions=True).getPositions(asNumpy=True)._value
    spare = where[filaments.node_indices[0]][filaments.in_context(context).growth().nodes[0] - 1 :]
    assert len(spare) > 10 and np.all(spare == spare[0])
