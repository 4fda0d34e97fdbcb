"""Hands that bind at the ends of filaments that grow, stay there, and change what these do."""

from dataclasses import replace

import numpy as np
import openmm
import pytest
from openmm import unit

from openmm_cylchain import (
    F_ACTIN,
    Crosslinker,
    DynamicInstability,
    EndStates,
    Filaments,
    Growth,
    Hand,
    HandAtEnd,
    InputError,
    MonomerPool,
    Monomers,
    Severing,
)
from support.contexts import new_context

pytest.importorskip("openmm_cylchain.plugin")

PER_SECOND = 1 / unit.second
PER_CONCENTRATION = 1e6 * unit.liter / unit.mole / unit.second
ACTIN = F_ACTIN.with_segment_length(108.0)
FILAMENTS = 48


def states(free, held, off=(0.0, 0.0)):
    """An end that gains so many monomers per second at 1 uM, without and with a hand."""
    return EndStates(
        on_rates=[free * PER_CONCENTRATION, held * PER_CONCENTRATION],
        off_rates=[rate * PER_SECOND for rate in off],
        switch_rates=np.zeros((2, 2)),
        names=["free", "held"],
    )


def simulated(filaments, milliseconds):
    """A Context of filaments, and its integrator with steps of so long."""
    _, system, positions = filaments.build()
    step = milliseconds * unit.millisecond
    integrator = filaments.create_integrator(system, step, random_seed=3, checks=False)
    return new_context(system, positions, integrator), integrator


def formin(**changes):
    at_end = dict(end="plus", range=20.0, binds_there=True, tracks=True, changes=("free", "held"))
    return Hand(
        binding_rate=PER_SECOND,
        reach=10.0,
        unbinding_rate=2 * PER_SECOND,
        filament_end=HandAtEnd(**{**at_end, **changes}),
    )


def filaments_with(hand, plus, concentration=5e-4):
    filaments = Filaments(viscosity=1e-3 * unit.pascal * unit.second, temperature=298.0)
    growth = Growth(
        monomers=Monomers(length=2.7), pool=MonomerPool(1e-6 * unit.molar), longest=1200.0, plus_instability=plus
    )
    for number in range(FILAMENTS):
        filaments.add_equilibrium(ACTIN, segments=6, seed=number + 1, growth=growth)
    other = Hand(binding_rate=0.0, reach=10.0, unbinding_rate=0.0)
    filaments.add_linkers(
        Crosslinker(hands=[hand, other], stiffness=0.1, rest_length=10.0), concentration=concentration
    )
    return filaments


def context_of(hand, plus, step=1.0, **options):
    filaments = filaments_with(hand, plus, **options)
    context, integrator = simulated(filaments, step)
    return filaments.in_context(context), integrator


def test_formins_stay_at_the_ends_that_they_slow_down():
    inside, integrator = context_of(formin(), states(20.0, 4.0))
    integrator.step(500)
    start, held = inside.growth(), []
    for _ in range(60):
        integrator.step(20)
        growth, linkers = inside.growth(), inside.linkers()
        bound = linkers.filaments[:, 0] >= 0
        ends = 2.7 * growth.monomers[linkers.filaments[bound, 0], 1]
        assert linkers.arc_lengths[bound, 0] == pytest.approx(ends, abs=1e-6)
        held.append(np.mean(growth.end_states[:, 1]))
    gained = (inside.growth().gained - start.gained)[:, 1] / 1.2
    expected = 4.0 * np.mean(held) + 20.0 * (1.0 - np.mean(held))
    assert 0.2 < np.mean(held) < 0.8
    assert abs(gained.mean() - expected) < 4 * np.sqrt(expected / 1.2 / FILAMENTS)


def test_a_hand_that_blocks_the_end_stops_it():
    inside, integrator = context_of(formin(), states(20.0, 0.0), concentration=1.0)
    integrator.step(100)
    before = inside.growth().gained[:, 1]
    assert np.all(inside.growth().end_states[:, 1] == 1)
    integrator.step(50)
    # A formin lets go now and then, and another one comes at once.
    assert (inside.growth().gained[:, 1] - before).sum() < 0.05 * 20.0 * 0.05 * FILAMENTS


def test_hands_stay_at_ends_that_shrink():
    inside, integrator = context_of(formin(changes=None), states(0.0, 0.0, off=(200.0, 0.0)), step=2.0)
    integrator.step(150)
    growth, linkers = inside.growth(), inside.linkers()
    bound = linkers.filaments[:, 0] >= 0
    assert bound.any() and growth.lost[:, 1].sum() > 1000
    ends = 2.7 * growth.monomers[linkers.filaments[bound, 0], 1]
    assert linkers.arc_lengths[bound, 0] == pytest.approx(ends, abs=1e-6)


def test_hands_change_the_ends_to_which_they_bind_and_no_others():
    instability = DynamicInstability(
        catastrophe_rate=20 * PER_SECOND, rescue_rate=1 * PER_SECOND, shrinking_off_rate=0 * PER_SECOND
    )
    filaments = Filaments(viscosity=1e-3 * unit.pascal * unit.second, temperature=298.0)
    pool = MonomerPool(1e-6 * unit.molar)
    for plus, kind in ((states(20.0, 4.0), ACTIN), (instability, replace(ACTIN, name="MT"))):
        growth = Growth(monomers=Monomers(length=2.7), pool=pool, longest=1200.0, plus_instability=plus)
        for number in range(FILAMENTS):
            filaments.add_equilibrium(kind, segments=6, seed=number + 1, growth=growth)
    other = Hand(binding_rate=0.0, reach=10.0, unbinding_rate=0.0)
    hands = [replace(formin(), binds_to=[ACTIN.name]), other]
    filaments.add_linkers(Crosslinker(hands=hands, stiffness=0.1, rest_length=10.0), concentration=1e-9)
    context, integrator = simulated(filaments, 1)
    integrator.step(300)
    growth = filaments.in_context(context).growth()
    # 20 of 21 shrink in the long run, of 48.
    assert growth.shrinking[FILAMENTS:, 1].sum() > 38 and not growth.shrinking[:FILAMENTS].any()


def test_a_tether_of_a_growing_filament_moves():
    filaments = Filaments(viscosity=1e-3 * unit.pascal * unit.second, temperature=298.0)
    monomers = Monomers(length=2.7, plus_on_rate=50 * PER_CONCENTRATION)
    growth = Growth(monomers=monomers, pool=1e-6 * unit.molar, longest=1200.0, minus_capped=True)
    filaments.add_straight(ACTIN, 4, [0, 0, 0], [1, 0, 0], growth=growth)
    filaments.add_tether(0, 0, [0, 0, 0], 50.0)
    context, integrator = simulated(filaments, 0.2)
    integrator.step(100)
    filaments.in_context(context).move_tether(0, [0, 30.0, 0])
    integrator.step(500)
    first = context.getState(getPositions=True).getPositions(asNumpy=True)._value[filaments.node_indices[0][0]]
    # The spring has 0.4 nm of thermal motion.
    assert np.linalg.norm(first - [0, 30.0, 0]) < 2.0
    assert filaments.in_context(context).growth().gained[0, 1] > 3


def cutting_context(rate, growth):
    filaments = Filaments(viscosity=1e-3 * unit.pascal * unit.second, temperature=298.0)
    for number in range(FILAMENTS):
        filaments.add_equilibrium(ACTIN, segments=6, seed=number + 1, growth=growth)
    filaments.add_reserve(ACTIN, FILAMENTS, growth=growth)
    hands = [
        Hand(binding_rate=PER_SECOND, reach=10.0, unbinding_rate=0.0, severing_rate=rate * PER_SECOND),
        Hand(binding_rate=0.0, reach=10.0, unbinding_rate=0.0),
    ]
    severers = Crosslinker(hands=hands, stiffness=0.1, rest_length=10.0)
    filaments.add_linkers(severers, count=FILAMENTS, bound=FILAMENTS, volume=1e9)
    context, integrator = simulated(filaments, 1)
    return filaments.in_context(context), integrator


def test_hands_cut_filaments_where_they_are_bound():
    growth = Growth(
        monomers=Monomers(length=2.7),
        pool=MonomerPool(0.0),
        longest=800.0,
        shortest=10.8,
        plus_capped=True,
        minus_capped=True,
        severing=Severing(rate=0.0),
    )
    inside, integrator = cutting_context(35.0, growth)
    places = inside.linkers().arc_lengths[:, 0]
    integrator.step(20)
    linkers, state = inside.linkers(), inside.growth()
    assert np.all(linkers.arc_lengths[:, 0] == places) and 0.2 < state.severed / FILAMENTS < 0.8
    expected = 1.0 - np.exp(-0.7)
    assert abs(state.severed - FILAMENTS * expected) < 4 * np.sqrt(FILAMENTS * expected * (1.0 - expected))
    parts = np.flatnonzero(state.parents >= 0)
    assert len(parts) == state.severed
    # Each cut is at the monomer that is nearest to a hand, and this is on one of both parts.
    cuts = 2.7 * state.monomers[parts, 0]
    assert np.all(np.abs(places[:, None] - cuts).min(axis=0) <= 1.35 + 1e-9)
    ends = 2.7 * state.monomers[linkers.filaments[:, 0]]
    assert np.all(places >= ends[:, 0] - 1.36) and np.all(places <= ends[:, 1] + 1.36)


def test_a_system_keeps_what_hands_do_at_ends():
    hand = replace(formin(), severing_rate=PER_SECOND)
    _, system, _ = filaments_with(hand, states(20.0, 4.0)).build()
    copy = openmm.XmlSerializer.deserialize(openmm.XmlSerializer.serialize(system))
    assert openmm.XmlSerializer.serialize(copy) == openmm.XmlSerializer.serialize(system)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: HandAtEnd(end="middle", range=1.0), "end"),
        (lambda: HandAtEnd(end="plus", range=0.0), "range"),
        (lambda: HandAtEnd(end="plus", range=1.0, changes=("free",)), "two different states"),
        (lambda: HandAtEnd(end="plus", range=1.0, tracks=1.0), "tracks"),
        (lambda: Hand(binding_rate=1.0, reach=1.0, unbinding_rate=1.0, filament_end="plus"), "filament_end"),
        (
            lambda: filaments_with(formin(changes=("free", "slow")), states(20.0, 4.0)).build(),
            "but the states are free, held",
        ),
    ],
)
def test_wrong_ends_are_refused(make, message):
    with pytest.raises(InputError, match=message):
        make()


def test_states_that_a_hand_changes_have_the_same_numbers():
    three = EndStates(
        on_rates=[1, 1, 1], off_rates=[0, 0, 0], switch_rates=np.zeros((3, 3)), names=["free", "odd", "held"]
    )
    own, other = (
        Growth(monomers=Monomers(length=2.7), pool=1e-4, longest=1200.0, plus_instability=plus)
        for plus in (states(20.0, 4.0), three)
    )
    hand = formin().filament_end
    assert hand.find_changes([own]) == (0, 1) and hand.find_changes([other]) == (0, 2)
    with pytest.raises(InputError, match="different numbers"):
        hand.find_changes([own, other])


def test_reserves_have_no_tethers():
    filaments = Filaments(viscosity=1e-3 * unit.pascal * unit.second, temperature=298.0)
    monomers = Monomers(length=2.7, plus_on_rate=PER_CONCENTRATION)
    growth, vanishing = (
        Growth(monomers=monomers, pool=1e-4, longest=1200.0, minus_capped=True, vanishes=vanishes)
        for vanishes in (False, True)
    )
    filaments.add_straight(ACTIN, 4, [0, 0, 0], [1, 0, 0], growth=vanishing)
    filaments.add_reserve(ACTIN, 1, growth=growth)
    with pytest.raises(InputError, match="if it does not vanish"):
        filaments.add_tether(0, 0, [0, 0, 0], 0.5)
    with pytest.raises(InputError, match="its nodes come and go"):
        filaments.add_tether(1, 0, [0, 0, 0], 0.5)


def test_the_first_node_of_a_capped_end_has_a_tether():
    filaments = Filaments(viscosity=1e-3 * unit.pascal * unit.second, temperature=298.0)
    monomers = Monomers(length=2.7, plus_on_rate=50 * PER_CONCENTRATION, plus_off_rate=PER_SECOND)
    growth = Growth(monomers=monomers, pool=1e-6 * unit.molar, longest=1200.0, minus_capped=True)
    for number in range(FILAMENTS):
        filaments.add_equilibrium(ACTIN, segments=4, seed=number + 1, start=[0, 0, 0], growth=growth)
        filaments.add_tether(number, 0, [0, 0, 0], 0.5)
    with pytest.raises(InputError, match="minus_capped=True"):
        filaments.add_tether(0, 1, [0, 0, 0], 0.5)
    context, integrator = simulated(filaments, 0.2)
    first, squares = [nodes[0] for nodes in filaments.node_indices], []
    integrator.step(100)
    for _ in range(100):
        integrator.step(20)
        state = context.getState(getPositions=True)
        squares.append(np.sum(state.getPositions(asNumpy=True)._value[first] ** 2, axis=1))
    # 3 k_BT/k, and the filaments have grown.
    expected = 3 * 0.00831446 * 298.0 / 0.5
    means = np.mean(squares, axis=0)
    assert abs(means.mean() - expected) < 4 * means.std() / np.sqrt(FILAMENTS)
    assert means.std() / np.sqrt(FILAMENTS) < 0.02 * expected
    assert np.all(filaments.in_context(context).growth().gained[:, 1] > 10)
