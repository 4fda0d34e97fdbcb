"""Linkers as users describe them: units, bad input, tables, checkpoints, XML, threads, recommended steps."""

import warnings
from dataclasses import replace

import numpy as np
import openmm
import pytest
from openmm import unit

from openmm_cylchain import F_ACTIN, MICROTUBULE, Crosslinker, Filaments, Hand, InputError, LinkerWarning
from openmm_cylchain.kinetics.binding_force import find_binding_force
from support.contexts import new_context, positions_of
from support.linker_contexts import PICONEWTON, SECOND, check_that_runs_go_on_to_the_bit, same_linkers
from support.solvent import KT, TEMPERATURE, VISCOSITY

HAND = Hand(binding_rate=3e4 / SECOND, reach=60.0, unbinding_rate=2e3 / SECOND)
MOTOR = Hand(
    binding_rate=3e4 / SECOND,
    reach=60.0,
    unbinding_rate=2e3 / SECOND,
    unbinding_force=3.0 * PICONEWTON,
    speed=8e4 / SECOND,
    stall_force=6.0 * PICONEWTON,
    site_spacing=8.0,
)
SPRING = Crosslinker(hands=HAND, stiffness=0.1 * PICONEWTON)


def network(
    linkers=((SPRING, {"count": 150, "bound": 100}),), kinds=(F_ACTIN,), engine="compiled", step=2e7, **options
):
    """Filaments that cross each other in a small periodic box, with their linkers in a Context."""
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine=engine)
    generator = np.random.default_rng(1)
    for number in range(24):
        kind = kinds[number % len(kinds)].with_segment_length(100.0)
        filaments.add_equilibrium(kind, 6, seed=number, start=generator.uniform(0.0, 500.0, 3))
    for kind, arguments in linkers:
        filaments.add_linkers(kind, **arguments)
    _, system, positions = filaments.build(box_vectors=500.0 * np.eye(3))
    integrator = filaments.create_integrator(system, step, random_seed=5, checks=False)
    return filaments, new_context(system, positions, integrator, **options)


def test_hands_and_crosslinkers_take_units():
    hand = Hand(
        binding_rate=3e4 / unit.second,
        reach=0.06 * unit.micrometer,
        unbinding_rate=2e3 / unit.second,
        unbinding_force=3.0 * unit.piconewton,
        speed=80.0 * unit.micrometer / unit.second,
        stall_force=6.0 * unit.piconewton,
        site_spacing=8.0 * unit.nanometer,
    )
    for name in MOTOR.__dataclass_fields__:
        expected = getattr(MOTOR, name)
        if isinstance(expected, float):
            expected = pytest.approx(expected, rel=1e-9)
        assert getattr(hand, name) == expected, name
    spring = Crosslinker(
        hands=[hand, HAND], stiffness=0.1 * unit.piconewton / unit.nanometer, rest_length=0.1 * unit.micrometer
    )
    assert spring.stiffness == pytest.approx(SPRING.stiffness) and spring.rest_length == pytest.approx(100.0)
    assert spring.hands[1] is HAND and SPRING.hands == (HAND, HAND)
    energy = 0.5 * SPRING.stiffness * 60.0**2 / KT
    assert SPRING.energy_at_reach(HAND, 310 * unit.kelvin) == pytest.approx(energy)
    assert "unbinding_force" in repr(MOTOR) and "catch_rate" not in repr(MOTOR)


def test_concentrations_take_units():
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine="compiled")
    filaments.add_straight(F_ACTIN, 2, (0, 0, 0), (1, 0, 0))
    for number in (6.02214076e-4, 1.0 * unit.millimolar, 6.02214076e23 / unit.meter**3):
        filaments.add_linkers(SPRING, concentration=number)
    densities = [own.concentration for own in filaments.linkers]
    assert densities == pytest.approx([6.02214076e-4] * 3, rel=1e-6)


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"binding_rate": -1.0}, "binding_rate cannot be negative"),
        ({"binding_rate": np.nan}, "binding_rate must be finite"),
        ({"binding_rate": np.inf}, "binding_rate must be finite"),
        ({"unbinding_rate": -1.0}, "unbinding_rate cannot be negative"),
        ({"unbinding_rate": np.nan}, "unbinding_rate must be finite"),
        ({"catch_rate": -1.0, "catch_force": 1.0}, "catch_rate cannot be negative"),
        ({"unbinding_rate": np.inf}, "unbinding_rate must be finite"),
        ({"unbinding_rate": 1.0 * unit.second}, "unit"),
        ({"reach": 0.0}, "reach must be positive"),
        ({"reach": [1.0, 2.0]}, "single number"),
        ({"strain_share": 1.5}, "between 0 and 1"),
        ({"strain_share": 0.5, "unbinding_force": 1.0}, "not both"),
        ({"unbinding_force": 0.0}, "unbinding_force must be positive"),
        ({"catch_rate": 1.0}, "given together"),
        ({"stall_force": 1.0}, "speed is zero"),
        ({"speed": 1.0, "stall_force": 0.0}, "stall_force must be positive"),
        ({"speed": np.nan}, "finite"),
        ({"at_end": "stop"}, "release, hold"),
        ({"site_spacing": -8.0}, "site_spacing must be positive"),
        ({"binds_to": [3]}, "binds_to"),
        ({"binds_to": []}, "binds_to"),
        ({"binds_to": 3}, "binds_to must be types of filaments or their names, but is 3"),
        *(({name: None}, f"{name} must be a number") for name in ("binding_rate", "reach", "unbinding_rate")),
        *(({name: None}, f"{name} must be a number") for name in ("strain_share", "catch_rate", "speed")),
        ({"walks_backward": None}, "walks_backward must be True or False, but is None"),
    ],
)
def test_bad_hands_are_refused(changed, message):
    with pytest.raises(InputError, match=message):
        Hand(**{"binding_rate": 1.0, "reach": 1.0, "unbinding_rate": 1.0, **changed})


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"hands": 3}, "hands must be"),
        ({"hands": None}, "hands must be"),
        ({"hands": [HAND]}, "two of them"),
        ({"stiffness": 0.0}, "stiffness must be positive"),
        ({"rest_length": -1.0}, "rest_length cannot be negative"),
    ],
)
def test_bad_crosslinkers_are_refused(changed, message):
    with pytest.raises(InputError, match=message):
        Crosslinker(**{"hands": HAND, "stiffness": 1.0, **changed})


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({}, "one of count, concentration and anchors"),
        ({"count": 1, "concentration": 1.0}, "one of count, concentration and anchors"),
        ({"count": -1}, "count must be at least 0"),
        ({"count": 1.5}, "whole number"),
        ({"count": 10**12}, "count must be at most"),
        ({"count": 2, "bound": 3}, "only 2"),
        ({"concentration": -1.0}, "concentration cannot be negative"),
        ({"concentration": 1.0 * unit.nanometer}, "unit"),
        ({"concentration": 1.0, "bound": 1}, "give a count"),
        ({"count": 1, "volume": 0.0}, "volume must be positive"),
        ({"concentration": 1.0, "volume": 1.0}, "a volume is that of a count .* a concentration need none"),
        ({"anchors": [[0.0, 0.0, 0.0]], "volume": 1.0}, "a volume is that of a count .* anchors need none"),
        ({"anchors": [[0.0, 0.0]]}, "anchors must be"),
        ({"anchors": [-1]}, "cannot be negative"),
        ({"anchors": [[0.0, 0.0, np.nan]]}, "finite"),
    ],
)
def test_bad_numbers_of_linkers_are_refused(arguments, message):
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine="compiled")
    filaments.add_straight(F_ACTIN, 2, (0, 0, 0), (1, 0, 0))
    with pytest.raises(InputError, match=message):
        filaments.add_linkers(SPRING, **arguments)


@pytest.mark.parametrize(
    ("rest_length", "stiffness", "warned"), [(0.0, 110.0, True), (0.0, 90.0, False), (20.0, 110.0, False)]
)
def test_springs_much_shorter_than_the_reach_are_warned_of(rest_length, stiffness, warned):
    """In units of k_BT/reach^2: the thermal extension is a tenth of the reach with 100."""
    kind = Crosslinker(hands=HAND, stiffness=stiffness * KT / HAND.reach**2, rest_length=rest_length, name="stiff")
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine="compiled")
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        filaments.add_linkers(kind, count=1)
    messages = [str(one.message) for one in caught if one.category is LinkerWarning]
    assert len(messages) == warned
    assert not warned or ("'stiff'" in messages[0] and "reach of 60 nm" in messages[0] and "5.72 nm" in messages[0])
    assert all(one.filename == __file__ for one in caught)


def test_in_the_cold_no_reach_is_advised():
    filaments = Filaments(VISCOSITY, 0.0, engine="compiled")
    with pytest.warns(LinkerWarning, match="farther than 0 nm away") as caught:
        filaments.add_linkers(Crosslinker(hands=HAND, stiffness=0.06, rest_length=0.0), count=1)
    assert str(caught[0].message).endswith("or a smaller stiffness.")


@pytest.mark.parametrize(("energy", "share", "warned"), [(3.1, 0.0, True), (2.9, 0.0, False), (3.1, 0.1, False)])
def test_springs_much_longer_than_the_reach_are_warned_of(energy, share, warned):
    """Energies of a spring that is compressed by 40 nm within all of the reach, in k_BT."""
    hands = [replace(HAND, binding_rate=0.0, reach=1.0), replace(HAND, strain_share=share)]
    kind = Crosslinker(hands=hands, stiffness=2.0 * energy * KT / 40.0**2, rest_length=HAND.reach + 40.0)
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine="compiled")
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        filaments.add_linkers(kind, count=1)
    messages = [str(one.message) for one in caught if one.category is LinkerWarning]
    assert len(messages) == warned
    assert not warned or ("reach of 60 nm" in messages[0] and r"slower by exp(-3.1)" in messages[0])
    assert all(one.filename == __file__ for one in caught)


@pytest.mark.parametrize("spacing", [1e-7, 1e-30])
def test_sites_that_cannot_be_told_apart_are_refused(spacing):
    kind = Crosslinker(hands=replace(HAND, site_spacing=spacing), stiffness=0.1)
    with pytest.raises(openmm.OpenMMException, match="Chain 0 would have more than a thousand million sites of hand 0"):
        network([(kind, {"count": 1})])


def test_more_spacings_of_sites_than_are_known_apart_are_refused():
    kinds = [Crosslinker(hands=replace(HAND, site_spacing=5.0 + i), stiffness=0.1) for i in range(17)]
    network([(kind, {"count": 1}) for kind in kinds[:16]])
    with pytest.raises(openmm.OpenMMException, match="more than 16 different spacings"):
        network([(kind, {"count": 1}) for kind in kinds])


def test_more_than_there_are_sites_is_refused():
    spring = Crosslinker(hands=MOTOR, stiffness=1.0)
    with pytest.raises(InputError, match="only 1800 sites"):
        network([(spring, {"count": 2000, "bound": 1801})])
    filaments, context = network([(spring, {"count": 2000, "bound": 1800})])
    table = filaments.in_context(context).linkers()
    sites = {
        (int(f), round(s / 8.0 - 0.5, 6)) for f, s in zip(table.filaments[:, 0], table.arc_lengths[:, 0]) if f >= 0
    }
    assert len(sites) == 1800 and table.counts() == (200, 1800, 0)
    context.getIntegrator().step(5)


def test_what_a_system_cannot_hold_is_refused():
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine="portable")
    filaments.add_straight(F_ACTIN, 2, (0, 0, 0), (1, 0, 0))
    with pytest.raises(InputError, match="portable engine has no linkers"):
        filaments.add_linkers(SPRING, count=1)
    with pytest.raises(openmm.OpenMMException, match="less than half of the periodic box"):
        network([(Crosslinker(hands=replace(HAND, reach=250.0), stiffness=1.0), {"count": 1})])
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine="compiled")
    filaments.add_straight(F_ACTIN, 2, (0, 0, 0), (1, 0, 0))
    filaments.add_linkers(SPRING, count=1)
    _, system, positions = filaments.build()
    with pytest.raises(InputError, match="already in a System"):
        filaments.add_linkers(SPRING, count=1)
    with pytest.raises(InputError, match="Linkers 'crosslinker' need a volume or a concentration"):
        filaments.create_integrator(system, 1e6, checks=False)


def test_a_box_that_has_become_too_narrow_for_a_reach_is_refused():
    _, context = network()
    context.getIntegrator().step(1)
    context.setPeriodicBoxVectors(*(119.0 * np.eye(3)))
    with pytest.raises(openmm.OpenMMException, match="reach of hand 0 must be less than half of the periodic box"):
        context.getIntegrator().step(1)


def test_the_temperature_is_that_of_the_integrator():
    """In the cold, hands bind only where that strains nothing."""
    bound = []
    for temperature in (TEMPERATURE, 1.0):
        filaments, context = network([(SPRING, {"count": 800, "bound": 800})])
        context.getIntegrator().setTemperature(temperature)
        context.getIntegrator().step(10)
        bound.append(filaments.in_context(context).linkers().counts()[2])
    assert bound[0] > 3 and bound[1] < 0.4 * bound[0]


def test_rates_that_no_step_can_take_end_in_an_error():
    hand = replace(HAND, binding_rate=1e12, unbinding_rate=1e12)
    _, context = network([(Crosslinker(hands=hand, stiffness=0.1), {"count": 5, "bound": 5})])
    with pytest.raises(openmm.OpenMMException, match="linker [0-4] bind, unbind or walk more than"):
        context.getIntegrator().step(1)


def test_hands_bind_to_their_types_of_filaments():
    hands = [replace(HAND, binds_to=(F_ACTIN.name,)), replace(HAND, binds_to=(MICROTUBULE.name,))]
    spring = Crosslinker(hands=hands, stiffness=0.1 * PICONEWTON)
    assert hands[0].binds(F_ACTIN) and not hands[0].binds(MICROTUBULE)
    filaments, context = network([(spring, {"count": 200, "bound": 50})], (F_ACTIN, MICROTUBULE))
    seen = np.zeros(2, dtype=int)
    for _ in range(20):
        context.getIntegrator().step(10)
        table = filaments.in_context(context).linkers()
        for side in (0, 1):
            on = table.filaments[table.bound[:, side], side]
            assert np.all(on % 2 == side)
            seen[side] += len(on)
    assert seen.min() > 20


@pytest.mark.slow
def test_linkers_out_of_a_concentration_come_and_go():
    filaments, context = network([(SPRING, {"concentration": 5e-8})])
    here = filaments.in_context(context)
    table = here.linkers()
    assert len(table) == 0
    means = []
    for _ in range(220):
        context.getIntegrator().step(12)
        table = here.linkers()
        assert table.counts()[0] == 0 and np.all(np.diff(table.numbers) > 0)
        means.append(table.counts()[1])
    # Of two hands; few bind with the other one as well, which changes nothing of the first.
    weight = HAND.rate_per_length / HAND.unbinding_rate * 4.0 / 3.0 * np.pi * HAND.reach**3 * 5e-8
    expected = 2.0 * weight * 24 * 600.0
    means = np.reshape(means[20:], (20, -1)).mean(axis=1)
    error = means.std(ddof=1) / np.sqrt(len(means))
    assert 4.0 * error < 0.06 * expected
    assert abs(means.mean() - expected) < 4.0 * error


def test_runs_go_on_from_checkpoints_and_states_to_the_bit():
    linkers = [
        (SPRING, {"count": 150, "bound": 100}),
        (Crosslinker(hands=MOTOR, stiffness=0.1 * PICONEWTON, rest_length=20.0), {"count": 60, "bound": 40}),
        (SPRING, {"concentration": 3e-8}),
    ]
    _, table = check_that_runs_go_on_to_the_bit(lambda: network(linkers))
    assert table.counts()[2] > 3


def test_checkpoints_of_systems_without_linkers_are_refused():
    _, bare = network([])
    _, context = network()
    with pytest.raises(openmm.OpenMMException, match="linkers of 0 Forces, but the System has 1"):
        context.loadCheckpoint(bare.createCheckpoint())
    with pytest.raises(openmm.OpenMMException, match="linkers of 1 Forces, but the System has 0"):
        bare.loadCheckpoint(context.createCheckpoint())


def test_states_that_do_not_say_where_linkers_are_are_noticed():
    filaments, context = network()
    here = filaments.in_context(context)
    context.getIntegrator().step(10)
    state = context.getState(positions=True, parameters=True)
    table = here.linkers()
    context.getIntegrator().step(10)
    context.setState(state)
    with pytest.raises(InputError, match="not known"):
        context.getIntegrator().step(1)
    here.set_linkers(table)
    context.getIntegrator().step(1)


@pytest.mark.parametrize("integrator_of", ["ours", "OpenMM's"])
def test_states_without_parameters_are_noticed(integrator_of):
    """They say nothing of linkers. A new Context begins with its own, wherever filaments are."""
    filaments, first = network()
    context, system = first, first.getSystem()
    if integrator_of == "OpenMM's":
        context = new_context(system, positions_of(first), openmm.LangevinIntegrator(300.0, 1.0, 0.01))
    context.getIntegrator().step(10)
    table, state = filaments.in_context(context).linkers(), context.getState(positions=True, velocities=True)
    # At once: nothing has changed.
    context.setState(state)
    context.getIntegrator().step(10)
    context.setState(state)
    with pytest.raises((InputError, openmm.OpenMMException), match="not known.*linkers that it had before"):
        context.getIntegrator().step(1)
    with pytest.raises(InputError, match="not known"):
        filaments.in_context(context).linkers()
    filaments.in_context(context).set_linkers(table)
    context.getIntegrator().step(2)
    assert context.getStepCount() == 12
    # Given before the State comes.
    filaments.in_context(context).set_linkers(table)
    context.setState(state)
    context.getIntegrator().step(2)


def test_clocks_that_are_set_alone_say_nothing_of_linkers():
    filaments, context = network()
    here = filaments.in_context(context)
    context.getIntegrator().step(10)
    context.setTime(0.0)
    context.getIntegrator().step(1)
    context.setStepCount(0)
    context.getIntegrator().step(1)
    context.setPositions(positions_of(context))
    context.getIntegrator().step(1)
    # Both look like a State, unless linkers are given.
    here.set_linkers(here.linkers())
    context.setTime(0.0)
    context.setStepCount(0)
    context.getIntegrator().step(1)


def test_two_contexts_have_linkers_of_their_own():
    filaments, context = network()
    system = context.getSystem()
    other = new_context(
        system, positions_of(context), filaments.create_integrator(system, 2e7, random_seed=6, checks=False)
    )
    here = filaments.in_context(other)
    before = here.linkers()
    context.getIntegrator().step(20)
    assert same_linkers(here.linkers(), before)
    other.getIntegrator().step(20)
    assert not same_linkers(here.linkers(), filaments.in_context(context).linkers())


def test_tables_are_checked():
    filaments, context = network()
    here = filaments.in_context(context)
    table = here.linkers()
    for changed, message in [
        ({"types": table.types + 1}, "illegal type"),
        ({"filaments": table.filaments + 100}, "does not bind"),
        ({"arc_lengths": table.arc_lengths + 700.0}, "only 600"),
        ({"anchors": table.anchors + 1}, "anchor"),
        ({"numbers": table.numbers[::-1]}, "ascend"),
        ({"next_number": 3}, "next number"),
    ]:
        with pytest.raises(InputError, match=message):
            here.set_linkers(replace(table, **changed))
    with pytest.raises(InputError, match="shape"):
        replace(table, filaments=table.filaments[:5])
    context.getIntegrator().step(1)


@pytest.mark.parametrize("threads", ["2", "3"])
def test_threads_change_nothing(threads):
    linkers = [
        (SPRING, {"count": 900, "bound": 600}),
        (Crosslinker(hands=MOTOR, stiffness=0.1), {"count": 100, "bound": 80}),
        (Crosslinker(hands=MOTOR, stiffness=0.1), {"concentration": 1e-7}),
    ]
    results = []
    for number in ("1", threads):
        filaments, context = network(linkers, platform="CPU", properties={"Threads": number})
        context.getIntegrator().step(60)
        results.append((filaments.in_context(context).linkers(), positions_of(context)))
    assert same_linkers(results[0][0], results[1][0])
    assert np.array_equal(results[0][1], results[1][1])


def test_forces_of_systems_survive_xml():
    filaments, context = network(
        [
            (SPRING, {"count": 20, "bound": 5}),
            (Crosslinker(hands=MOTOR, stiffness=2.0), {"anchors": [[1.0, 2.0, 3.0]] * 3}),
        ]
    )
    system = context.getSystem()
    text = openmm.XmlSerializer.serialize(system)
    assert openmm.XmlSerializer.serialize(openmm.XmlSerializer.deserialize(text)) == text
    read = openmm.XmlSerializer.deserialize(text)
    force = find_binding_force(read)
    assert force.getNumLinkers() == 23 and force.getNumAnchors() == 3 and force.usesPeriodicBoundaryConditions()


def test_forces_and_energies_are_those_of_the_springs():
    filaments, context = network()
    context.getIntegrator().step(120)
    pulls = filaments.in_context(context).linker_pulls()
    assert len(pulls.numbers) > 1
    force = find_binding_force(context.getSystem())
    force.setForceGroup(7)
    context.reinitialize(preserveState=True)
    state = context.getState(energy=True, forces=True, groups={7})
    energy = 0.5 * SPRING.stiffness * (pulls.lengths**2).sum()
    assert state.getPotentialEnergy()._value == pytest.approx(energy, rel=1e-9)
    assert np.abs(state.getForces(asNumpy=True)._value.sum(axis=0)).max() < 1e-9
    assert np.linalg.norm(pulls.forces, axis=1) == pytest.approx(SPRING.stiffness * pulls.lengths)


def test_recommended_steps_know_linkers():
    fast = replace(HAND, unbinding_rate=1e6 / SECOND)
    walking = replace(HAND, unbinding_rate=0.0, speed=1e-3, stall_force=1e4)
    stiff = replace(walking, speed=1e-6, stall_force=1e-4)
    stepping = replace(fast, speed=1e-9, stall_force=None, site_spacing=8.0)
    for hand, rest, step, words in [
        (fast, 0.0, 0.2e6, "unbinds with the rate 1e+06/s"),
        (stepping, 0.0, 0.1e6, "unbinds with the rate 1e+06/s"),
        (walking, 0.0, 0.2 * 60.0 / 1e-3, "a hand walks"),
        (stiff, 0.0, 0.2 * 1e-4 / (SPRING.stiffness * 1e-6), "stall force"),
        (HAND, 5.0, None, "diffuse against each other"),
    ]:
        kind = Crosslinker(hands=hand, stiffness=SPRING.stiffness, rest_length=rest)
        filaments, context = network([(kind, {"count": 1})])
        found = filaments.recommended_time_step(system=context.getSystem(), scheme="implicit")
        assert words in found.reason
        assert step is None or found.step == pytest.approx(step, rel=1e-6)
        assert not found.unknown_forces
    explicit = filaments.recommended_time_step(system=context.getSystem(), scheme="midpoint")
    assert any("linker to come" in name for name in explicit.bounds)
