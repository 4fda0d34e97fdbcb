"""Linkers on what moves: equilibrium of binding and motion together, whatever the step; motors that move filaments."""

import warnings
from dataclasses import replace

import numpy as np
import pytest

from openmm_cylchain import (
    F_ACTIN,
    MICROTUBULE,
    Crosslinker,
    Filaments,
    Hand,
    TimeStepWarning,
    constant_force,
)
from support.contexts import new_context
from support.linker_contexts import PICONEWTON, SECOND, context_with_trapped_linkers, fixed_filament, glide
from support.solvent import KT, TEMPERATURE, VISCOSITY


def expected_binding(weight, stiffness, rest_length, trap, above):
    """The ratio of bound and unbound copies, and the mean squared length of the spring, by sums over places."""
    width = np.sqrt(KT / trap)
    y = above + width * np.linspace(-6, 6, 161)[:, None, None]
    z = width * np.linspace(-6, 6, 161)[None, :, None]
    s = np.linspace(-90.0, 90.0, 361)
    density = np.exp(-((y - above) ** 2 + z**2) / (2.0 * width**2))
    distance = np.sqrt(y**2 + z**2 + s**2)
    bound = density * np.exp(-stiffness * (distance - rest_length) ** 2 / (2.0 * KT))
    ratio = weight * bound.sum() * (s[1] - s[0]) / density.sum()
    return ratio, (bound * distance**2).sum() / bound.sum()


@pytest.mark.parametrize(
    ("rest_length", "step", "strain_share"),
    [pytest.param(0.0, 0.03, 0.0, marks=pytest.mark.slow), (0.0, 2.0, 0.4), (25.0, 0.2, 0.4), (25.0, 2.0, 0.0)],
)
def test_binding_and_motion_are_in_equilibrium_together(step, rest_length, strain_share):
    """Of particles in traps above a filament, each with a hand: how many are bound, and how far their springs reach.

    Steps are in units of the relaxation of a particle in its trap, in which a hand unbinds about once.
    """
    copies, trap, stiffness, above = 80, 0.05 * PICONEWTON, 0.1 * PICONEWTON, 15.0
    friction = 1e6
    relaxation = friction / trap
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine="compiled")
    fixed_filament(filaments, 2 * copies + 4, (0.0, 0.0, 0.0))
    hand = Hand(binding_rate=80.0 / relaxation, reach=90.0, unbinding_rate=1.0 / relaxation, strain_share=strain_share)
    centres = np.column_stack([200.0 * np.arange(copies) + 150.0, np.full(copies, above), np.zeros(copies)])
    crosslinker = Crosslinker(hands=hand, stiffness=stiffness, rest_length=rest_length)
    context = context_with_trapped_linkers(filaments, crosslinker, centres, trap, friction, step * relaxation)
    here, integrator = filaments.in_context(context), context.getIntegrator()
    interval = max(1, round(1.5 / step))
    integrator.step(8 * interval)
    bound, squares = [], []
    for _ in range(180):
        integrator.step(interval)
        bound.append(here.linkers().bound[:, 1].mean())
        lengths = here.linker_pulls().lengths
        squares.append((lengths**2).mean())
    weight = hand.rate_per_length / hand.unbinding_rate
    ratio, square = expected_binding(weight, stiffness, rest_length, trap, above)
    for values, exact in ((bound, ratio / (1.0 + ratio)), (squares, square)):
        means = np.reshape(values, (15, -1)).mean(axis=1)
        error = means.std(ddof=1) / np.sqrt(len(means))
        assert 4.0 * error < 0.06 * exact
        assert abs(np.mean(values) - exact) < 0.01 * exact + 4.0 * error


def test_fixed_motors_make_a_filament_glide_at_their_speed():
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine="compiled")
    filaments.add_straight(F_ACTIN.with_segment_length(100.0), 20, (0.0, 0.0, 0.0), (1.0, 0.0, 0.0))
    system, step, displacement = glide(filaments)
    assert filaments.recommended_time_step(system=system).step > step
    # Towards the plus end they walk, so the filament goes the other way.
    assert displacement[0] == pytest.approx(-1000.0, rel=0.03)
    assert np.linalg.norm(displacement[1:]) < 60.0


def carried(number, segments, reach, unbinding, stall, anchors, load=0.0, planar=False):
    """Microtubules along x with motors of 1000 nm/s on points, which pull at them against a load."""
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine="compiled")
    kind = MICROTUBULE.with_segment_length(1000.0)
    for copy in range(number):
        filaments.add_straight(kind, segments, (0.0, 4000.0 * copy, 0.0), (1.0, 0.0, 0.0), planar=planar)
    hand = Hand(
        binding_rate=4.0 * unbinding,
        reach=reach,
        unbinding_rate=unbinding,
        speed=1000.0 / SECOND,
        stall_force=stall,
        walks_backward=True,
        at_end="release",
    )
    points = np.concatenate([anchors + [0.0, 4000.0 * copy, 0.0] for copy in range(number)])
    stiffness = 0.1 * PICONEWTON if unbinding else PICONEWTON
    filaments.add_linkers(Crosslinker(hands=hand, stiffness=stiffness), anchors=points)
    _, system, positions = filaments.build()
    if load:
        system.addForce(constant_force([int(nodes[-1]) for nodes in filaments.node_indices], [load, 0.0, 0.0]))
    return filaments, system, positions


@pytest.mark.parametrize("unbinding, milliseconds", [(5.0, 20.0), (40.0, 20.0)])
def test_filaments_glide_as_fast_in_long_steps(unbinding, milliseconds):
    """A hand walks by half its reach in a step, and unbinds with a rate of 0.1 or 0.8 over it."""
    anchors = np.zeros((200, 3))
    anchors[:, 0] = np.random.default_rng(1).uniform(-4000.0, 8000.0, 200)
    filaments, system, positions = carried(6, 8, 40.0, unbinding / SECOND, 6.0 * PICONEWTON, anchors, planar=True)
    step = milliseconds * 1e-3 * SECOND
    context = new_context(system, positions, filaments.create_integrator(system, step, random_seed=2, checks=False))
    places = []
    for steps in (15, 100):
        context.getIntegrator().step(steps)
        positions = context.getState(positions=True).getPositions(asNumpy=True)._value
        places.append([positions[nodes].mean(axis=0) for nodes in filaments.node_indices])
    speeds = np.linalg.norm(np.array(places[1]) - places[0], axis=1) / (100 * milliseconds * 1e-3)
    error = speeds.std(ddof=1) / np.sqrt(len(speeds))
    assert 4.0 * error < 30.0
    assert abs(speeds.mean() - 1000.0) < 4.0 * error + 5.0


def test_a_motor_near_stall_has_the_speed_of_its_law():
    """Of 5 of 6 pN, less the friction of the filament, at the recommended step and twice as long."""
    number, segments, stall, load = 40, 20, 6.0 * PICONEWTON, 5.0 * PICONEWTON
    anchors = np.array([[8000.0, 0.0, 0.0]])
    filaments, system, positions = carried(number, segments, 40.0, 0.0, stall, anchors, load)
    kind = MICROTUBULE.with_segment_length(1000.0)
    friction = segments * kind.segment_friction(VISCOSITY, TEMPERATURE, segments).parallel
    expected = 1000.0 * (1.0 - load / stall) / (1.0 + friction * 1000.0 / SECOND / stall)
    recommended = 0.2 * stall / (PICONEWTON * 1000.0 / SECOND)
    for factor in (1.0, 2.0):
        step = factor * recommended
        context = new_context(system, positions, filaments.create_integrator(system, step, random_seed=3, checks=False))
        here = filaments.in_context(context)
        table = here.linkers()
        bound, places = table.filaments.copy(), table.arc_lengths.copy()
        bound[:, 1], places[:, 1] = np.arange(number), 8000.0
        here.set_linkers(replace(table, filaments=bound, arc_lengths=places))
        context.getIntegrator().step(50)
        before = here.linkers().arc_lengths[:, 1]
        context.getIntegrator().step(2000)
        speeds = (here.linkers().arc_lengths[:, 1] - before) / (2000 * step / SECOND)
        error = speeds.std(ddof=1) / np.sqrt(number)
        assert 4.0 * error < 0.05 * expected
        assert abs(speeds.mean() - expected) < 4.0 * error


def test_steps_too_long_for_hands_are_warned_of():
    filaments, system, _ = carried(1, 2, 40.0, 5.0 / SECOND, 6.0 * PICONEWTON, np.zeros((1, 3)))
    # Of 0.2 of the reach.
    allowed = 8e-3 * SECOND
    for factor, warned in ((3.9, False), (4.1, True)):
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            filaments.create_integrator(system, factor * allowed)
        named = [one for one in caught if "one of linkers: Linkers: type 0, a hand walks by 0.2" in str(one.message)]
        assert [one.category for one in named] == [TimeStepWarning] * warned


def test_motors_with_two_hands_slide_antiparallel_filaments():
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine="compiled")
    kind = MICROTUBULE.with_segment_length(500.0)
    filaments.add_straight(kind, 12, (0.0, 0.0, 0.0), (1.0, 0.0, 0.0))
    filaments.add_straight(kind, 12, (6000.0, 20.0, 0.0), (-1.0, 0.0, 0.0))
    speed = 400.0 / SECOND
    hand = Hand(binding_rate=0.0, reach=80.0, unbinding_rate=0.0, speed=speed, stall_force=6.0 * PICONEWTON)
    motor = Crosslinker(hands=hand, stiffness=0.2 * PICONEWTON)
    filaments.add_linkers(motor, count=30, volume=1e9)
    _, system, positions = filaments.build()
    integrator = filaments.create_integrator(system, 5e-5 * SECOND, random_seed=2, checks=False)
    context = new_context(system, positions, integrator)
    here = filaments.in_context(context)
    # Each begins on both, where they face each other.
    along = np.linspace(1500.0, 4500.0, 30)
    table = replace(
        here.linkers(),
        filaments=np.tile([0, 1], (30, 1)),
        arc_lengths=np.column_stack([along, 6000.0 - along]),
    )
    here.set_linkers(table)

    def offset():
        # Of the second filament against the first one, along both.
        x = context.getState(positions=True).getPositions(asNumpy=True)._value
        first, second = (x[nodes] for nodes in filaments.node_indices)
        axis = (first[-1] - first[0]) - (second[-1] - second[0])
        return (second.mean(axis=0) - first.mean(axis=0)) @ axis / np.linalg.norm(axis)

    start = offset()
    integrator.step(10000)
    # Hands walk to the plus end of either filament, so each is pushed towards its minus end.
    assert offset() - start == pytest.approx(2 * 400.0 * 0.5, rel=0.02)


@pytest.mark.slow
def test_catch_bonds_live_longest_under_the_load_of_their_closed_form():
    """Of hands under springs of fixed lengths, on a segment that does not move: 1/(k e^(F/F_u) + k_c e^(-F/F_c))."""
    slip, catch, number, stiffness = 2.0 / SECOND, 60.0 / SECOND, 4000, 0.05 * PICONEWTON
    slip_force, catch_force = 4.0 * PICONEWTON, 1.5 * PICONEWTON
    hand = Hand(
        binding_rate=0.0,
        reach=500.0,
        unbinding_rate=slip,
        unbinding_force=slip_force,
        catch_rate=catch,
        catch_force=catch_force,
    )
    # The rate is least where k/F_u e^(F/F_u) = k_c/F_c e^(-F/F_c).
    best = np.log(catch * slip_force / (slip * catch_force)) / (1.0 / slip_force + 1.0 / catch_force)
    loads = best * np.array([0.0, 0.5, 1.0, 2.0])
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine="compiled")
    nodes = np.array([[0.0, 0.0, 0.0], [100.0, 0.0, 0.0], [200.0, 0.0, 0.0]])
    filaments.add_nodes(F_ACTIN.with_segment_length(100.0), nodes, clamped=range(2))
    kind = Crosslinker(hands=hand, stiffness=stiffness, rest_length=20.0)
    types = [
        filaments.add_linkers(kind, anchors=[[50.0, 20.0 + load / stiffness, 0.0]] * number, bound=number)
        for load in loads
    ]
    _, system, positions = filaments.build()
    rates = slip * np.exp(loads / slip_force) + catch * np.exp(-loads / catch_force)
    context = new_context(
        system, positions, filaments.create_integrator(system, 0.1 / rates.max(), random_seed=7, checks=False)
    )
    here = filaments.in_context(context)
    table = here.linkers()
    here.set_linkers(replace(table, arc_lengths=np.where(table.bound, 50.0, 0.0)))
    times, steps = [], 0
    for rate in np.sort(rates)[::-1]:
        target = round(1.0 / rate * rates.max() / 0.1)
        context.getIntegrator().step(target - steps)
        steps = target
        times.append(steps * context.getIntegrator().getStepSize()._value)
        # Those of this rate have lived for one lifetime.
        type_ = types[int(np.flatnonzero(rates == rate)[0])]
        left = here.linkers().counts(type_)[2]
        expected = np.exp(-rate * times[-1])
        assert left / number == pytest.approx(expected, abs=4.0 * np.sqrt(expected * (1.0 - expected) / number))
    survivors = [here.linkers().counts(type_)[2] for type_ in types]
    assert np.argmax(survivors) == 2
    assert np.argmin(rates) == 2
