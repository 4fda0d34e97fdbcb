"""Linkers in Contexts: random numbers, States and checkpoints of others, other integrators, all kinds of filaments."""

from dataclasses import replace

import numpy as np
import openmm
import pytest
from openmm import unit

from openmm_cylchain import F_ACTIN, Crosslinker, Filaments, Hand, InputError
from openmm_cylchain.kinetics.binding_force import find_binding_force
from support.contexts import energy_of, forces_of, new_context
from support.solvent import KT, TEMPERATURE, VISCOSITY

SECOND = 1e12
HAND = Hand(binding_rate=3e4 / SECOND, reach=60.0, unbinding_rate=2e3 / SECOND)
SPRING = Crosslinker(hands=HAND, stiffness=0.06, rest_length=10.0)
STEP = 2e7
BOX = np.array([[220.0, 0.0, 0.0], [70.0, 210.0, 0.0], [-60.0, 50.0, 200.0]])


def shapes(shape, box=BOX):
    """Filaments across each other: open ones, rings, some in planes, some clamped, of a single segment."""
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine="compiled")
    kind = F_ACTIN.with_segment_length(50.0)
    generator = np.random.default_rng(3)
    for number in range(12):
        start = generator.uniform(0.0, 200.0, 3)
        if shape == "rings":
            normal = generator.normal(size=3)
            filaments.add_ring(kind, 8, start, normal)
        elif shape == "planar":
            start[2] = 20.0 * (number % 4)
            filaments.add_equilibrium(kind, 6, seed=number + 1, start=start, planar=True)
        else:
            segments = 1 if shape == "single segments" else 6
            clamped = [0] if shape == "clamped" else []
            filaments.add_equilibrium(kind, segments, seed=number + 1, start=start, clamped=clamped)
    return filaments


def linked(filaments, kind=SPRING, box=BOX, **arguments):
    """Filaments with linkers in a Context."""
    filaments.add_linkers(kind, **(arguments or {"count": 200, "bound": 150}))
    _, system, positions = filaments.build(box_vectors=box)
    integrator = filaments.create_integrator(system, STEP, random_seed=5, checks=False)
    return new_context(system, positions, integrator)


def differ(first, second):
    return not np.array_equal(first.filaments, second.filaments)


@pytest.mark.parametrize("shape", ["open", "rings", "planar", "clamped", "single segments"])
def test_forces_are_those_of_the_springs_on_all_kinds_of_filaments(shape):
    """In a triclinic box, after steps: energy and forces on particles, from what linkers() says of places."""
    filaments = shapes(shape)
    context = linked(filaments)
    context.getIntegrator().step(60)
    find_binding_force(context.getSystem()).setForceGroup(7)
    context.reinitialize(preserveState=True)
    here = filaments.in_context(context)
    table, pulls = here.linkers(), here.linker_pulls()
    assert len(pulls.numbers) > 5
    energy = 0.5 * SPRING.stiffness * np.sum((pulls.lengths - SPRING.rest_length) ** 2)
    assert energy_of(context, {7}) == pytest.approx(energy, rel=1e-9)
    expected = np.zeros((context.getSystem().getNumParticles(), 3))
    for row, force in zip(np.flatnonzero(table.held == 2), pulls.forces, strict=True):
        for side, sign in ((0, 1.0), (1, -1.0)):
            nodes = filaments.node_indices[table.filaments[row, side]]
            segment, rest = divmod(table.arc_lengths[row, side], 50.0)
            minus, plus = int(segment), (int(segment) + 1) % len(nodes)
            expected[nodes[minus]] += sign * (1.0 - rest / 50.0) * force
            expected[nodes[plus]] += sign * rest / 50.0 * force
    expected[[context.getSystem().getParticleMass(i)._value == 0.0 for i in range(len(expected))]] = 0.0
    found = forces_of(context, {7})
    found[[context.getSystem().getParticleMass(i)._value == 0.0 for i in range(len(found))]] = 0.0
    np.testing.assert_allclose(found, expected, atol=1e-9 * np.abs(expected).max())


def test_random_numbers_are_those_of_the_integrator_of_a_context():
    """Whichever integrator was made last."""
    filaments = shapes("open")
    filaments.add_linkers(SPRING, count=200, bound=150)
    _, system, positions = filaments.build(box_vectors=BOX)
    seeds = (1, 2, 1)
    integrators = [filaments.create_integrator(system, STEP, random_seed=seed, checks=False) for seed in seeds]
    contexts = [new_context(system, positions, integrator) for integrator in integrators]
    for context in contexts:
        # Filaments are where they were.
        context.getIntegrator().setTemperature(0.0)
        context.getIntegrator().step(5)
    tables = [filaments.in_context(context).linkers() for context in contexts]
    assert differ(tables[0], tables[1]) and not differ(tables[0], tables[2])


def test_states_of_other_contexts_are_noticed():
    """Of as many steps, in which other things have happened. Before the first step, all are the same."""
    filaments = shapes("open")
    filaments.add_linkers(SPRING, count=200, bound=150)
    _, system, positions = filaments.build(box_vectors=BOX)
    contexts = []
    for seed in (1, 2):
        integrator = filaments.create_integrator(system, STEP, random_seed=seed, checks=False)
        contexts.append(new_context(system, positions, integrator))
    first, second = (filaments.in_context(context) for context in contexts)
    contexts[0].setState(contexts[1].getState(positions=True, parameters=True))
    for context in contexts:
        context.getIntegrator().step(10)
    state = contexts[1].getState(positions=True, parameters=True)
    contexts[0].setState(state)
    with pytest.raises(InputError, match="of another Context, that does not say it"):
        contexts[0].getIntegrator().step(1)
    first.set_linkers(second.linkers())
    contexts[0].getIntegrator().step(1)
    # One that says it.
    contexts[0].setState(contexts[1].getState(positions=True, parameters=True, integratorParameters=True))
    assert not differ(first.linkers(), second.linkers())
    contexts[0].getIntegrator().step(1)


def test_numbers_that_are_used_up_are_given_anew():
    filaments = shapes("open")
    context = linked(filaments, concentration=1e-6)
    here = filaments.in_context(context)
    context.getIntegrator().step(20)
    table = here.linkers()
    assert len(table) > 20
    here.set_linkers(replace(table, next_number=2 * 10**9 + 1))
    with pytest.raises(openmm.OpenMMException, match="Two thousand million linkers have come out"):
        context.getIntegrator().step(1)
    numbers = np.arange(len(table))
    here.set_linkers(replace(table, numbers=numbers, next_number=len(table)))
    context.getIntegrator().step(1)
    assert here.linkers().next_number >= len(table)


@pytest.mark.slow
def test_more_than_can_come_out_of_a_concentration_ends_in_an_error():
    filaments = shapes("open")
    context = linked(filaments, concentration=1e6)
    with pytest.raises(openmm.OpenMMException, match="More than ten million linkers of type 0 come out"):
        context.getIntegrator().step(1)


def test_a_hundred_thousand_come_out_of_a_concentration_in_a_step():
    filaments = shapes("open")
    context = linked(filaments, concentration=1e-2)
    context.getIntegrator().step(1)
    weight = HAND.rate_per_length / HAND.unbinding_rate * 4.0 / 3.0 * np.pi * HAND.reach**3 * 1e-2
    passed = -np.expm1(-HAND.unbinding_rate * STEP)
    expected = 2.0 * weight * 12 * 300.0 * passed
    assert expected > 1.5e5
    # A few of them bind with the other hand as well.
    assert len(filaments.in_context(context).linkers()) == pytest.approx(expected, rel=0.01)


def test_reaches_that_are_tiny_bind_hardly_anything():
    kind = replace(SPRING, hands=replace(HAND, reach=1e-6))
    filaments = shapes("open")
    context = linked(filaments, kind)
    context.getIntegrator().step(20)
    assert filaments.in_context(context).linkers().counts()[2] == 0


@pytest.mark.parametrize("speed", [1e60, -1e60])
def test_hands_of_any_speed_come_to_an_end_or_an_error(speed):
    hand = replace(HAND, unbinding_rate=0.0, speed=speed, at_end="hold")
    filaments = shapes("open")
    context = linked(filaments, replace(SPRING, hands=hand))
    context.getIntegrator().step(2)
    table = filaments.in_context(context).linkers()
    ends = table.arc_lengths[table.bound]
    assert np.isin(ends, [0.0, 300.0]).sum() >= 150
    context = linked(shapes("rings"), replace(SPRING, hands=hand))
    with pytest.raises(openmm.OpenMMException, match="walk more than a hundred thousand"):
        context.getIntegrator().step(1)


def test_linkers_follow_any_integrator():
    """Of particles that do not move, so that what is bound is known; checkpoints of it do not say where linkers are."""
    filaments = shapes("open")
    filaments.add_linkers(replace(SPRING, hands=replace(HAND, binding_rate=0.0)), count=400, bound=400)
    _, system, positions = filaments.build(box_vectors=BOX)
    for particle in range(system.getNumParticles()):
        system.setParticleMass(particle, 0.0)
    rate = HAND.unbinding_rate
    integrator = openmm.LangevinMiddleIntegrator(TEMPERATURE * unit.kelvin, 1e-3 / unit.picosecond, 0.05 / rate)
    context = new_context(system, positions, integrator)
    here = filaments.in_context(context)
    integrator.step(10)
    checkpoint = context.createCheckpoint()
    integrator.step(4)
    left = here.linkers().counts()[1]
    share = np.exp(-0.7)
    assert abs(left - 400 * share) < 4.0 * np.sqrt(400 * share * (1.0 - share))
    context.loadCheckpoint(checkpoint)
    with pytest.raises(InputError, match="not known"):
        here.linkers()


@pytest.mark.parametrize("anchor", ["node", "virtual site"])
def test_recommended_steps_know_what_linkers_are_anchored_to(anchor):
    """Implicit steps have springs to nodes in their equations, but not those to virtual sites."""
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine="compiled")
    kind = F_ACTIN.with_segment_length(100.0)
    filaments.add_straight(kind, 2, (0.0, 0.0, 0.0), (1.0, 0.0, 0.0))
    filaments.add_straight(replace(kind, name="OTHER"), 2, (0.0, 15.0, 0.0), (1.0, 0.0, 0.0))
    filaments.add_attachment(0, arc_length=130.0)
    hand = replace(HAND, unbinding_rate=0.0, binds_to="OTHER")
    linker = Crosslinker(hands=hand, stiffness=6.0, rest_length=15.0)
    filaments.add_linkers(linker, anchors=[1 if anchor == "node" else 3], bound=1)
    _, system, positions = filaments.build()
    assert system.isVirtualSite(3)
    found = filaments.recommended_time_step(system=system)
    assert ("linker to come" in found.reason) == (anchor == "virtual site")
    integrator = filaments.create_integrator(system, found, random_seed=2)
    context = new_context(system, positions, integrator)
    integrator.step(500)
    squares = []
    for _ in range(2000):
        integrator.step(5)
        squares.append((float(filaments.in_context(context).linker_pulls().lengths[0]) - linker.rest_length) ** 2)
    # Springs of 10 pN/nm are near their rest length, where they fluctuate along one direction.
    assert linker.stiffness * np.mean(squares) == pytest.approx(KT, rel=0.3)
