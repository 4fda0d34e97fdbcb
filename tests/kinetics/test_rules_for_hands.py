"""Rules for which hands bind, and hands that slide: as users describe them, on filaments that move and grow."""

from dataclasses import replace

import numpy as np
import openmm
import pytest
from openmm import unit

from openmm_cylchain import (
    ACTIN_ATP,
    F_ACTIN,
    MICROTUBULE,
    BindingRange,
    Crosslinker,
    Filaments,
    Growth,
    Hand,
    HandAtEnd,
    InputError,
    MonomerPool,
    Monomers,
    constant_force,
)
from openmm_cylchain.kinetics.binding_force import find_binding_force
from support.contexts import new_context
from support.linker_contexts import (
    PICONEWTON,
    SECOND,
    check_that_runs_go_on_to_the_bit,
    context_with_trapped_linkers,
    fixed_filament,
)
from support.solvent import KT, TEMPERATURE, VISCOSITY

pytest.importorskip("openmm_cylchain.plugin")

HAND = Hand(binding_rate=3e4 / SECOND, reach=60.0, unbinding_rate=2e3 / SECOND)
NEAR = BindingRange(end="plus", range=150.0)
SLIDING = replace(HAND, sliding_friction=1e-3 * SECOND * PICONEWTON / 1e3)


def network(*linkers, growth=None):
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine="compiled")
    generator = np.random.default_rng(1)
    for number in range(24):
        start = generator.uniform(0.0, 500.0, 3)
        kind = F_ACTIN.with_segment_length(108.0)
        filaments.add_equilibrium(kind, 6, seed=number, start=start, growth=growth)
    for kind, arguments in linkers:
        filaments.add_linkers(kind, **arguments)
    _, system, positions = filaments.build(box_vectors=500.0 * np.eye(3))
    integrator = filaments.create_integrator(system, 2e7, random_seed=5, checks=False)
    return filaments, new_context(system, positions, integrator)


def test_rules_take_units_and_reach_the_force():
    hand = Hand(
        binding_rate=3e4 / unit.second,
        reach=60.0 * unit.nanometer,
        unbinding_rate=2e3 / unit.second,
        sliding_friction=2.0 * unit.piconewton * unit.second / unit.micrometer,
    )
    assert hand.sliding_friction == pytest.approx(2.0 * PICONEWTON * SECOND / 1e3)
    assert hand.holds_at_ends and not replace(hand, at_end="release").holds_at_ends and not HAND.holds_at_ends
    near = replace(HAND, binding_range=BindingRange(end="both", range=0.1 * unit.micrometer, excluded=True))
    kind = Crosslinker(
        hands=[hand, near], stiffness=0.1, cosine_range=np.array([0.5, 1]), trans_activated=True, reversible=False
    )
    assert kind.cosine_range == (0.5, 1.0) and kind.has_rules and not replace(kind, hands=HAND).is_motor
    _, context = network((kind, {"count": 5}), (Crosslinker(hands=HAND, stiffness=0.1), {"count": 1}))
    text = openmm.XmlSerializer.serialize(context.getSystem())
    system = openmm.XmlSerializer.deserialize(text)
    assert openmm.XmlSerializer.serialize(system) == text
    force = find_binding_force(system)
    assert force.getLinkerTypeRules(0) == [0.5, 1.0, True, False] and force.getLinkerTypeRules(1)[:2] == [-1.0, 1.0]
    assert force.getHandSliding(0) == pytest.approx(hand.sliding_friction) and force.getHandSliding(1) == 0.0
    assert force.getHandBindingRange(1) == [2, pytest.approx(100.0), True] and force.getHandBindingRange(0)[0] == -1


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"sliding_friction": 0.0}, "sliding_friction must be positive"),
        ({"sliding_friction": 1.0, "speed": 1.0}, "sliding_friction or speed"),
        ({"sliding_friction": 1.0, "site_spacing": 8.0}, "sliding_friction or site_spacing"),
        ({"sliding_friction": 1.0, "binding_range": NEAR}, "sliding_friction or binding_range"),
        ({"binding_range": "plus"}, "binding_range"),
        (
            {"binding_range": NEAR, "filament_end": HandAtEnd(end="plus", range=20.0, binds_there=True)},
            "leave one of them out",
        ),
    ],
)
def test_bad_hands_are_refused(changed, message):
    with pytest.raises(InputError, match=message):
        replace(HAND, **changed)


def test_bad_rules_are_refused():
    for cosines in ((1.0, 0.5), (0.5, 0.5), (-2.0, 1.0), (0.5,), 0.5, "ab", (np.nan, 1.0)):
        with pytest.raises(InputError, match="cosine_range"):
            Crosslinker(hands=HAND, stiffness=1.0, cosine_range=cosines)
    for changed in ({"end": "middle"}, {"range": 0.0}, {"excluded": 1}):
        with pytest.raises(InputError, match="BindingRange"):
            BindingRange(**{"end": "plus", "range": 1.0, **changed})
    kind = Crosslinker(hands=HAND, stiffness=1.0, trans_activated=True)
    with pytest.raises(InputError, match="one hand"):
        Filaments(VISCOSITY, TEMPERATURE, engine="compiled").add_linkers(kind, anchors=[[0.0, 0.0, 0.0]])


def test_linkers_begin_bound_in_their_range():
    near = Crosslinker(hands=replace(HAND, binding_range=NEAR), stiffness=0.1)
    away = Crosslinker(hands=replace(HAND, binding_range=replace(NEAR, excluded=True)), stiffness=0.1)
    filaments, context = network((near, {"count": 300, "bound": 300}), (away, {"count": 300, "bound": 300}))
    table = filaments.in_context(context).linkers()
    along = table.arc_lengths[:, 0]
    assert np.all(along[:300] >= 648.0 - 150.0) and np.all(along[300:] <= 648.0 - 150.0)
    # Anywhere in it.
    assert along[:300].mean() == pytest.approx(573.0, abs=4.0 * 150.0 / np.sqrt(12.0 * 300.0))
    none = Crosslinker(
        hands=replace(HAND, binding_range=BindingRange(end="both", range=400.0, excluded=True)), stiffness=1
    )
    with pytest.raises(InputError, match="few or no places"):
        network((none, {"count": 3, "bound": 3}))


def test_runs_go_on_from_checkpoints_and_states_to_the_bit():
    kinds = [
        Crosslinker(hands=SLIDING, stiffness=0.1 * PICONEWTON, cosine_range=(-0.7, 1.0)),
        Crosslinker(hands=[SLIDING, HAND], stiffness=0.1 * PICONEWTON, rest_length=20.0, trans_activated=True),
        Crosslinker(hands=replace(HAND, binding_range=NEAR), stiffness=0.1 * PICONEWTON),
    ]
    _, table = check_that_runs_go_on_to_the_bit(
        lambda: network(*((kind, {"count": 80, "bound": 50}) for kind in kinds))
    )
    assert all(np.any((table.types == number) & (table.held == 2)) for number in range(3))


def test_on_filaments_that_grow_hands_stay_on_them_and_in_range_as_they_bind():
    growth = Growth(
        monomers=Monomers(length=2.7, plus_on_rate=2e4 * 1e6 / (unit.molar * unit.second)),
        pool=MonomerPool(1e-6 * unit.molar),
        longest=1500.0,
    )
    # Slides to ends, and never lets go; never slides, and lets go soon.
    slides = Crosslinker(hands=replace(SLIDING, unbinding_rate=0.0), stiffness=0.1 * PICONEWTON)
    near = Crosslinker(
        hands=replace(HAND, binding_range=replace(NEAR, range=100.0), unbinding_rate=4e4 / SECOND), stiffness=0.1
    )
    linkers = ((slides, {"count": 60, "bound": 60}), (near, {"count": 500, "bound": 100}))
    filaments, table = check_that_runs_go_on_to_the_bit(lambda: network(*linkers, growth=growth))
    assert np.all(table.bound[:60, 0])
    filaments, context = network(*linkers, growth=growth)
    here = filaments.in_context(context)
    context.getIntegrator().step(200)
    ends = here.growth().lengths
    assert ends._value.mean() > 700.0


@pytest.mark.parametrize("step", [0.1, 10.0])
def test_sliding_and_motion_are_in_equilibrium_together(step):
    """Particles in traps beside a filament, on springs with hands that slide; steps in relaxations of a particle."""
    copies, trap, stiffness, above, rest_length = 60, 0.02 * PICONEWTON, 0.05 * PICONEWTON, 20.0, 30.0
    friction = 1e6
    relaxation = friction / trap
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine="compiled")
    fixed_filament(filaments, 2 * copies + 4, (0.0, 0.0, 0.0))
    hand = Hand(binding_rate=0.0, reach=90.0, unbinding_rate=0.0, sliding_friction=0.7 * friction)
    centres = np.column_stack([200.0 * np.arange(copies) + 150.0, np.full(copies, above), np.zeros(copies)])
    crosslinker = Crosslinker(hands=hand, stiffness=stiffness, rest_length=rest_length)
    context = context_with_trapped_linkers(filaments, crosslinker, centres, trap, friction, step * relaxation)
    here, integrator = filaments.in_context(context), context.getIntegrator()
    table = here.linkers()
    bound, places = table.filaments.copy(), table.arc_lengths.copy()
    bound[:, 1], places[:, 1] = 0, centres[:, 0]
    here.set_linkers(replace(table, filaments=bound, arc_lengths=places))
    interval = max(1, round(1.5 / step))
    integrator.step(8 * interval)
    squares, moved = [], []
    for _ in range(150):
        integrator.step(interval)
        pulls = here.linker_pulls()
        squares.append((pulls.lengths**2).mean())
        moved.append(((pulls.places[:, 1] - pulls.places[:, 0])[:, 0] ** 2).mean())
    # By sums over places of the particle across the filament, and along it from the hand.
    width = np.sqrt(KT / trap)
    y = above + width * np.linspace(-5, 5, 101)[:, None, None]
    z = width * np.linspace(-5, 5, 101)[None, :, None]
    s = np.linspace(-150.0, 150.0, 301)
    square = y**2 + z**2 + s**2
    trapped = np.exp(-((y - above) ** 2 + z**2) / (2.0 * width**2))
    weight = trapped * np.exp(-stiffness * (np.sqrt(square) - rest_length) ** 2 / (2.0 * KT))
    for values, exact in ((squares, np.average(square, weights=weight)), (moved, (weight * s**2).sum() / weight.sum())):
        means = np.reshape(values, (15, -1)).mean(axis=1)
        error = means.std(ddof=1) / np.sqrt(len(means))
        assert 4.0 * error < 0.06 * exact
        assert abs(np.mean(values) - exact) < 4.0 * error


def test_friction_of_hands_that_slide_adds_up():
    """Filaments that a force pulls through hands on fixed points, at the recommended step and five times as long."""
    copies, hands, load = 30, 4, 4.0 * PICONEWTON
    friction = 2.0 * PICONEWTON * SECOND / 1e3
    stiffness = 0.2 * PICONEWTON
    for factor in (1.0, 5.0):
        filaments = Filaments(VISCOSITY, TEMPERATURE, engine="compiled")
        kind = MICROTUBULE.with_segment_length(1000.0)
        for copy in range(copies):
            filaments.add_straight(kind, 10, (0.0, 4000.0 * copy, 0.0), (1.0, 0.0, 0.0))
        hand = Hand(binding_rate=0.0, reach=40.0, unbinding_rate=0.0, sliding_friction=friction)
        along = 7000.0 + 500.0 * np.arange(hands)
        points = np.array([[x, 4000.0 * copy, 0.0] for copy in range(copies) for x in along])
        filaments.add_linkers(Crosslinker(hands=hand, stiffness=stiffness), anchors=points)
        _, system, positions = filaments.build()
        system.addForce(constant_force([int(nodes[-1]) for nodes in filaments.node_indices], [load, 0.0, 0.0]))
        recommended = filaments.recommended_time_step(system=system).step
        assert recommended <= 0.1 * friction / stiffness * (1.0 + 1e-9)
        step = factor * 0.1 * friction / stiffness
        context = new_context(system, positions, filaments.create_integrator(system, step, random_seed=3, checks=False))
        here = filaments.in_context(context)
        table = here.linkers()
        bound, places = table.filaments.copy(), table.arc_lengths.copy()
        bound[:, 1], places[:, 1] = np.repeat(np.arange(copies), hands), np.tile(along, copies)
        here.set_linkers(replace(table, filaments=bound, arc_lengths=places))
        context.getIntegrator().step(int(20 / factor))
        before = here.linkers().arc_lengths[:, 1]
        duration = 3.0 * SECOND
        context.getIntegrator().step(round(duration / step))
        slid = (before - here.linkers().arc_lengths[:, 1]).reshape(copies, hands).mean(axis=1)
        own = 10 * kind.segment_friction(VISCOSITY, TEMPERATURE, 10).parallel
        expected = load / (hands * friction + own) * round(duration / step) * step
        error = slid.std(ddof=1) / np.sqrt(copies)
        assert 4.0 * error < 0.06 * expected
        assert abs(slid.mean() - expected) < 4.0 * error


@pytest.mark.parametrize("end, bound", [("plus", 20), ("minus", 0)])
def test_hands_that_slide_and_track_an_end_stay_there(end, bound):
    """Their springs pull them beyond the plus end, where all others let go."""
    filaments = Filaments(VISCOSITY, TEMPERATURE)
    growth = Growth(monomers=ACTIN_ATP, pool=0.2e-6 * unit.molar, longest=600.0, minus_capped=True)
    filaments.add_straight(F_ACTIN.with_segment_length(108.0), 3, [0, 0, 0], [1, 0, 0], clamped=[0], growth=growth)
    tracks = HandAtEnd(end=end, range=20.0, tracks=True)
    hand = replace(SLIDING, unbinding_rate=0.0, at_end="release", filament_end=tracks, sliding_friction=1e6)
    filaments.add_linkers(Crosslinker(hands=hand, stiffness=0.05), anchors=[[345.0, 0, 0]] * 20, bound=20)
    _, system, positions = filaments.build()
    integrator = filaments.create_integrator(system, 2e6, random_seed=1, checks=False)
    context = new_context(system, positions, integrator)
    integrator.step(1000)
    assert filaments.in_context(context).linkers().counts()[2] == bound
