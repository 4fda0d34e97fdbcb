"""Hands that slide to the ends of filaments, stay there, and take monomers off: kinesin-13."""

from dataclasses import replace

import numpy as np
import openmm
import pytest
from openmm import unit
from scipy.integrate import quad
from scipy.special import erf

from openmm_cylchain import (
    KINESIN_13,
    MICROTUBULE,
    TUBULIN,
    Crosslinker,
    Filaments,
    Growth,
    HandAtEnd,
    InputError,
    MonomerPool,
    Monomers,
    Severing,
)
from openmm_cylchain.kinetics.binding_force import find_binding_force
from support.contexts import new_context

pytest.importorskip("openmm_cylchain.plugin")

PER_SECOND = 1 / unit.second
KT = 8.31446262e-3 * 298.15
MOLECULES_OF_MICROMOLAR = 6.02214076e-7  # in nm^3
SEGMENT = 1300 * TUBULIN.length  # 800 nm
STABLE = Monomers(length=TUBULIN.length, plus_off_rate=1e-9 * PER_SECOND, minus_off_rate=1e-9 * PER_SECOND)
SLIDING = KINESIN_13.hands[1]
STILL = KINESIN_13.hands[0]


def microtubules(count, segments, **changes):
    options = dict(monomers=STABLE, pool=MonomerPool(0.0), longest=segments * SEGMENT + 1.0, shortest=100.0)
    growth = Growth(**{**options, **changes})
    filaments = Filaments(viscosity=1e-3 * unit.pascal * unit.second, temperature=298.15)
    kind = MICROTUBULE.with_segment_length(SEGMENT)
    for number in range(count):
        filaments.add_straight(kind, segments, [0.0, 0.0, 1000.0 * number], [1, 0, 0], growth=growth)
    return filaments


def simulated(filaments, step):
    """What is in a Context of filaments, and its integrator, with steps in seconds."""
    _, system, positions = filaments.build()
    integrator = filaments.create_integrator(system, step * unit.second, random_seed=3, checks=False)
    return filaments.in_context(new_context(system, positions, integrator)), integrator


def hand(**at_end):
    options = dict(end="both", range=8.0, tracks=True, off_rate=50 * PER_SECOND)
    return replace(SLIDING, unbinding_rate=0.0, filament_end=HandAtEnd(**{**options, **at_end}))


def bound(filaments, own, places):
    """Linkers, of which a hand is bound to each of some places, and does not come back."""
    hands = [replace(own, binding_rate=0.0), STILL]
    kind = Crosslinker(hands=hands, stiffness=0.1, rest_length=30.0)
    filaments.add_linkers(kind, count=len(places), volume=1e9, bound=len(places), places=places)


def test_the_preset_has_the_numbers_of_its_sources():
    at_end = SLIDING.filament_end
    diffusion = KT / SLIDING.sliding_friction * 1e12 / 1e6  # um^2/s
    assert diffusion == pytest.approx(0.38, rel=1e-3)
    assert 1e-12 / SLIDING.unbinding_rate == pytest.approx(0.83)
    assert at_end.off_rate / at_end.unbinding_rate == pytest.approx(20.0)
    assert at_end.sites == 14 and at_end.end == "both" and STILL.binding_rate == 0.0
    # What binds for each length and slides to an end before it unbinds.
    per_length = SLIDING.rate_per_length * 4.0 / 3.0 * np.pi * SLIDING.reach**3 * MOLECULES_OF_MICROMOLAR * 1e12 * 1e3
    assert per_length * np.sqrt(diffusion * 0.83) == pytest.approx(54.0, rel=0.01)


@pytest.mark.parametrize(
    ("step", "regular"),
    [(20e-3, False), (2e-3, False), pytest.param(0.2e-3, False, marks=pytest.mark.slow), (2e-3, True)],
)
def test_hands_at_ends_take_monomers_off_at_their_rate(step, regular):
    """None, one, two and more hands than sites at either end, and at capped ones."""
    numbers, sites, time, each = [(0, 1), (2, 5), (3, 0), (1, 2)], 3, 1.0, 14
    count = each * len(numbers)
    filaments = microtubules(count, 3, deterministic=regular)
    capped = Growth(monomers=STABLE, pool=MonomerPool(0.0), longest=2500.0, shortest=100.0, plus_capped=True)
    kind = MICROTUBULE.with_segment_length(SEGMENT)
    filaments.add_straight(kind, 3, [0.0, 1000.0, 0.0], [1, 0, 0], growth=capped)
    places = [(count, 3 * SEGMENT)]
    for filament in range(count):
        minus, plus = numbers[filament % 4]
        places += [(filament, 0.0)] * minus + [(filament, 3 * SEGMENT)] * plus
    bound(filaments, hand(sites=sites), places)
    inside, integrator = simulated(filaments, step)
    integrator.step(round(time / step))
    lost = inside.growth().lost
    assert not lost[count].any()
    expected = each * 50.0 * time * np.minimum(numbers, sites)
    total = lost[:count].reshape(each, len(numbers), 2).sum(axis=0)
    if regular:
        np.testing.assert_allclose(total, expected, atol=each)
        return
    error = np.sqrt(expected.sum())
    assert 4 * error < 0.05 * expected.sum()
    assert np.all(np.abs(total - expected) <= 4 * np.sqrt(expected))
    assert abs(total.sum() - expected.sum()) < 4 * error
    # They stay at the ends, and with the monomers that are left.
    growth, linkers = inside.growth(), inside.linkers()
    ends = TUBULIN.length * growth.monomers[linkers.filaments[:, 0]]
    assert np.abs(linkers.arc_lengths[:, :1] - ends).min(axis=1) == pytest.approx(0.0, abs=1e-6)


@pytest.mark.parametrize("step", [20e-3, 2e-3, pytest.param(0.2e-3, marks=pytest.mark.slow)])
def test_hands_reach_an_end_before_they_unbind(step):
    """From x they come to the end with the probability exp(-x/sqrt(D tau)): the distance of 0.4 um, of 0.56 um."""
    filaments, count, along = microtubules(1, 12), 8000, 400.0
    own = replace(hand(off_rate=0.0, unbinding_rate=0.0), unbinding_rate=SLIDING.unbinding_rate)
    bound(filaments, own, [(0, along)] * (count // 2) + [(0, 12 * SEGMENT - along)] * (count // 2))
    inside, integrator = simulated(filaments, step)
    integrator.step(round(7.0 / step))
    linkers = inside.linkers()
    places = linkers.arc_lengths[linkers.filaments[:, 0] == 0, 0]
    reached = np.sum(np.minimum(places, 12 * SEGMENT - places) < 1e-6) / count
    expected = np.exp(-along / np.sqrt(0.38e6 * 0.83))
    error = np.sqrt(expected * (1 - expected) / count)
    assert 4 * error < 0.05 * expected
    assert abs(reached - expected) < 4 * error


def arrivals_per_site(duration):
    """Over a source for each length: the integral of (D/k)^(1/2) erf((k t)^(1/2)), in um s."""
    return quad(lambda t: np.sqrt(0.38 * 0.83) * erf(np.sqrt(t / 0.83)), 0.0, duration)[0]


@pytest.mark.parametrize("step", [20e-3, 2e-3])
def test_kinesin_13_arrives_at_both_ends_at_its_rate(step):
    """At 1 uM, from solution to the lattice and along it, within 5 s; none of them leaves an end here."""
    count, duration = 16, 5.0
    filaments = microtubules(count, 6)
    own = replace(SLIDING, filament_end=replace(SLIDING.filament_end, off_rate=0.0, unbinding_rate=0.0))
    filaments.add_linkers(replace(KINESIN_13, hands=[STILL, own]), concentration=1e-6 * unit.molar)
    inside, integrator = simulated(filaments, step)
    integrator.step(round(duration / step))
    places = inside.linkers().arc_lengths[:, 1]
    at_ends = np.array([np.sum(np.abs(places - end) < 1e-6) for end in (0.0, 6 * SEGMENT)])
    expected = count * 96.1 * arrivals_per_site(duration)
    assert 4 * np.sqrt(2 * expected) < 0.05 * 2 * expected
    assert np.all(np.abs(at_ends - expected) < 4 * np.sqrt(expected))
    assert abs(at_ends.sum() - 2 * expected) < 4 * np.sqrt(2 * expected)


def test_kinesin_13_leaves_an_end_after_twenty_seconds_and_twenty_dimers():
    count, duration, step = 2000, 10.0, 50e-3
    filaments = microtubules(count, 1, shortest=100.0, longest=900.0)
    bound(filaments, SLIDING, [(filament, SEGMENT * (filament % 2)) for filament in range(count)])
    inside, integrator = simulated(filaments, step)
    integrator.step(round(duration / step))
    stay = np.exp(-duration / 20.0)
    held = np.sum(inside.linkers().filaments[:, 0] >= 0)
    assert abs(held - count * stay) < 4 * np.sqrt(count * stay * (1 - stay))
    # The number of dimers has the variance of a Poisson process that a random time ends.
    time = 20.0 * (1 - stay)
    square = 2 * 20.0**2 * (1 - stay * (1 + duration / 20.0))
    error = np.sqrt((time + square - time**2) / count)
    assert 4 * error < 0.05 * time
    assert abs(inside.growth().lost.sum() / count - time) < 4 * error


def test_hands_of_both_ends_bind_at_both():
    filaments = microtubules(1, 2)
    own = replace(hand(binds_there=True, off_rate=0.0), binding_rate=PER_SECOND, unbinding_rate=0.0)
    kind = Crosslinker(hands=[own, STILL], stiffness=0.1, rest_length=30.0)
    filaments.add_linkers(kind, concentration=0.01)
    inside, integrator = simulated(filaments, 2e-3)
    integrator.step(500)
    places = inside.linkers().arc_lengths[:, 0]
    numbers = np.array([np.sum(np.abs(places - end) < 1e-6) for end in (0.0, 2 * SEGMENT)])
    expected = own.rate_per_length * 1e12 * 8.0 * 4 / 3 * np.pi * own.reach**3 * 0.01
    assert sum(numbers) == len(places)
    assert np.all(np.abs(numbers - expected) < 4 * np.sqrt(expected)) and expected > 400


def test_a_system_keeps_what_hands_do_at_ends():
    filaments = microtubules(1, 2)
    filaments.add_linkers(KINESIN_13, concentration=1e-9 * unit.molar)
    _, system, _ = filaments.build()
    text = openmm.XmlSerializer.serialize(system)
    assert openmm.XmlSerializer.serialize(openmm.XmlSerializer.deserialize(text)) == text
    force = find_binding_force(system)
    at_end = SLIDING.filament_end
    assert force.getHandRemoval(1) == [at_end.off_rate, 14, at_end.unbinding_rate]


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"off_rate": -1.0}, "off_rate"),
        ({"off_rate": np.nan}, "off_rate"),
        ({"sites": 0}, "sites must be at least 1"),
        ({"sites": 1.5}, "whole number"),
        ({"unbinding_rate": -1.0}, "unbinding_rate"),
        ({"changes": ("free", "held")}, "the plus or the minus end, not of both"),
    ],
)
def test_wrong_numbers_are_refused(changes, message):
    with pytest.raises(InputError, match=message):
        hand(**changes)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"monomers": Monomers(length=TUBULIN.length, plus_off_rate=1e-13)}, "give their monomers a minus_off_rate"),
        ({"plus_capped": True, "minus_capped": True, "severing": Severing(rate=0.0)}, "whose ends are capped"),
    ],
)
def test_ends_that_hands_cannot_shrink_are_refused(changes, message):
    filaments = microtubules(1, 2, **changes)
    filaments.add_linkers(KINESIN_13, concentration=1e-9 * unit.molar)
    with pytest.raises(InputError, match=message):
        filaments.build()
