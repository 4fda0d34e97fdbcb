"""Presets of crosslinkers and motors: their numbers in other units than they are written in, and that they bind."""

import dataclasses

import numpy as np
import pytest
from openmm import unit
from scipy.integrate import quad

from openmm_cylchain import (
    ACTIN_AGING,
    ALPHA_ACTININ,
    COFILIN,
    DYNEIN,
    F_ACTIN,
    FILAMIN,
    INSTABILITY_IN_MITOSIS,
    KINESIN_1,
    KINESIN_13,
    MICROTUBULE,
    MYOSIN_II,
    TUBULIN_IN_MITOSIS,
    Filaments,
    Growth,
    InputError,
)
from openmm_cylchain.kinetics.presets import PRESETS
from support.contexts import new_context
from support.solvent import VISCOSITY

TEMPERATURE = 298.15
KT = 4.116  # pN nm
PN = 0.602214076  # kJ/(mol nm)
PER_SECOND = 1e-12


# Hands of others load as pairs, or slide to ends: test_loop_extruders.py and test_depolymerases.py have them.
ONE_BY_ONE = [name for name, kind in PRESETS.items() if kind.loading_distance is None and kind != KINESIN_13]


def rate_for_straight_filament(kind, distance):
    """The rate in 1/s with which a hand binds to a filament that passes the other end of its linker."""
    hand = kind.hands[1]
    stiffness = kind.stiffness / PN  # pN/nm

    def boltzmann(s):
        return np.exp(-stiffness * (np.hypot(distance, s) - kind.rest_length) ** 2 / (2.0 * KT))

    end = np.sqrt(hand.reach**2 - distance**2)
    window = quad(boltzmann, -end, end, points=[0.0], limit=200)[0]
    return hand.binding_rate / PER_SECOND / (2.0 * hand.reach) * window


def test_rates_of_motors_for_a_filament_at_the_rest_length():
    expected = {"KINESIN_1": 5.0, "DYNEIN": 1.6, "MYOSIN_II": 22 * 0.2}
    for name, rate in expected.items():
        kind = PRESETS[name]
        assert rate_for_straight_filament(kind, kind.rest_length) == pytest.approx(rate, rel=0.05), name


def test_hands_of_crosslinkers_bind_to_actin_with_1_micromolar():
    for kind in (ALPHA_ACTININ, FILAMIN):
        hand = kind.hands[0]
        volume = 4.0 / 3.0 * np.pi * hand.reach**3
        per_site = hand.binding_rate / (2.0 * hand.reach) * volume * 2.7  # nm^3/ps: a rate over a number density
        per_litre = hand.unbinding_rate / per_site * 1e24
        assert per_litre / 6.02214076e23 == pytest.approx(1e-6, rel=0.03)


def test_speeds_runs_and_forces():
    for kind, speed, run, stall in ((KINESIN_1, 0.8, 1.0, 6.0), (DYNEIN, -0.65, -2.4, 1.1), (MYOSIN_II, 0.5, 1.2, 4.0)):
        hand = kind.hands[0]
        assert hand.speed / (1e3 * PER_SECOND) == pytest.approx(speed)
        assert hand.speed / hand.unbinding_rate / 1e3 == pytest.approx(run, rel=0.02)
        assert hand.stall_force / PN == pytest.approx(stall)
    ensemble = 22 * 0.2 / ((1 + 0.2 / 1.7) ** 22 - 1)
    assert MYOSIN_II.hands[0].unbinding_rate / PER_SECOND == pytest.approx(ensemble, rel=0.02)
    assert ALPHA_ACTININ.hands[0].unbinding_force / PN == pytest.approx(KT / 0.24, rel=0.01)


@pytest.mark.parametrize("name", ONE_BY_ONE)
def test_reach_does_not_cut_the_spring_off(name):
    kind = PRESETS[name]
    assert kind.energy_at_reach(kind.hands[1], TEMPERATURE) > 4.0
    assert kind.hands[0] == kind.hands[1]


@pytest.mark.parametrize("name", ONE_BY_ONE)
def test_presets_bind_to_filaments_of_their_type(name):
    """Two filaments that stand still side by side at the rest length."""
    kind = PRESETS[name]
    filament = MICROTUBULE if name in ("KINESIN_1", "DYNEIN") else F_ACTIN
    filaments = Filaments(VISCOSITY, TEMPERATURE)
    length = filament.segment_length
    filaments.add_straight(filament, 4, [-2 * length, 0, 0], [1, 0, 0], clamped=range(1, 5))
    filaments.add_straight(filament, 4, [-2 * length, kind.rest_length, 0], [1, 0, 0], clamped=range(1, 5))
    filaments.add_linkers(kind, 40, volume=1 * unit.micrometer**3, bound=40)
    _, system, positions = filaments.build()
    integrator = filaments.create_integrator(system, 5 * unit.millisecond, random_seed=3, checks=False)
    context = new_context(system, positions, integrator)
    integrator.step(60)
    assert filaments.in_context(context).linkers().counts()[2] >= 5


def test_presets_refuse_filaments_that_they_do_not_bind_to():
    filaments = Filaments(VISCOSITY, TEMPERATURE)
    filaments.add_straight(F_ACTIN, 2, [0, 0, 0], [1, 0, 0])
    filaments.add_linkers(KINESIN_1, 10, volume=1e9)
    with pytest.raises(InputError, match="'kinesin-1': a hand binds to filaments of the type MT, of which there are"):
        filaments.build()
    changed = dataclasses.replace(KINESIN_1, hands=dataclasses.replace(KINESIN_1.hands[0], binds_to=None))
    assert changed.hands[0].speed == KINESIN_1.hands[0].speed


def test_speeds_of_microtubules_in_mitosis():
    """12.8 and 14.1 um/min, at 10 uM."""
    concentration = 10e-6 * 0.602214076  # 1/nm^3
    net = TUBULIN_IN_MITOSIS.plus_on_rate * concentration - TUBULIN_IN_MITOSIS.plus_off_rate
    per_minute = TUBULIN_IN_MITOSIS.length * 60e-3 / PER_SECOND
    assert net * per_minute == pytest.approx(12.8)
    assert INSTABILITY_IN_MITOSIS.shrinking_off_rate * per_minute == pytest.approx(14.1)


def test_cofilin_cuts_actin_that_ages():
    """0.032 times per second in 1000 monomers of ADP-actin."""
    assert COFILIN.rate * 1000 * ACTIN_AGING.length / PER_SECOND == pytest.approx(0.032)
    pool = unit.Quantity(1e-6, unit.molar)
    growth = Growth(monomers=ACTIN_AGING, pool=pool, longest=2000.0, vanishes=True, severing=COFILIN)
    assert growth.severing.of_states == (ACTIN_AGING.aging[-1].name,)
