"""A Context goes on from one of the same filaments in another System."""

import numpy as np
import openmm
import pytest
from openmm import unit

from openmm_cylchain import ACTIN_ATP, F_ACTIN, Crosslinker, Filaments, Growth, Hand, InputError, MonomerPool, Sphere
from openmm_cylchain.couplings.walls import filament_wall_force
from support.contexts import positions_of

SHORT = F_ACTIN.with_segment_length(27 * 2.7)


def built(radius=600.0, unbinding=2e-9, engine=None, grows=False, seed=3, count=6, linkers=True):
    filaments = Filaments(0.01 * unit.pascal * unit.second, 300 * unit.kelvin, engine)
    growth = {}
    if grows:
        growth["growth"] = Growth(monomers=ACTIN_ATP, pool=MonomerPool(2e-3), longest=1000.0)
    for number in range(count):
        filaments.add_straight(SHORT, 6, [-200, 20 * number, 0], [1, 0, 0], **growth)
    if linkers:
        hand = Hand(binding_rate=1e-7, reach=60.0, unbinding_rate=unbinding, speed=1e-10)
        kind = Crosslinker(stiffness=50.0, rest_length=30.0, hands=[hand, hand])
        filaments.add_linkers(kind, 40, volume=1e8)
    _, system, positions = filaments.build()
    if engine is None:
        system.addForce(filament_wall_force(filaments, system, Sphere([0, 0, 0], radius), 50.0))
    integrator = filaments.create_integrator(system, 1e6 if engine is None else 100.0, random_seed=seed, checks=False)
    context = openmm.Context(system, integrator, openmm.Platform.getPlatformByName("Reference"))
    context.setPositions(positions)
    return filaments, context, integrator


@pytest.mark.parametrize("grows", [False, True])
def test_steps_go_on_as_if_nothing_had_happened(grows):
    _, whole, integrator = built(grows=grows)
    integrator.step(60)
    _, before, integrator = built(grows=grows)
    integrator.step(35)
    filaments, after, integrator = built(grows=grows)
    filaments.in_context(after).go_on_from(before)
    integrator.step(25)
    np.testing.assert_array_equal(positions_of(after), positions_of(whole))
    assert after.getStepCount() == 60
    tables = [vars(filaments.in_context(context).linkers()).values() for context in (after, whole)]
    for one, other in zip(*tables):
        np.testing.assert_array_equal(one, other)


def test_other_forces_and_rates_are_those_of_the_later_system():
    filaments, before, integrator = built()
    integrator.step(200)
    held = filaments.in_context(before).linkers().bound.sum()
    assert held > 10
    later, after, integrator = built(radius=150.0, unbinding=1e-6)
    later.in_context(after).go_on_from(before)
    np.testing.assert_array_equal(positions_of(after), positions_of(before))
    integrator.step(200)
    nodes = positions_of(after)
    assert np.linalg.norm(nodes, axis=1).max() < 200.0 < np.linalg.norm(positions_of(before), axis=1).max()
    # In equilibrium, the odds to be bound are those of rates.
    assert later.in_context(after).linkers().bound.sum() < 0.3 * held


def test_the_portable_engine_goes_on_at_the_same_positions():
    _, before, integrator = built(engine="portable", linkers=False)
    integrator.step(5)
    later, after, _ = built(engine="portable", linkers=False)
    later.in_context(after).go_on_from(before)
    np.testing.assert_array_equal(positions_of(after), positions_of(before))
    assert after.getStepCount() == 5 and after.getTime() == before.getTime()


def test_other_particles_are_refused():
    _, before, _ = built()
    later, after, _ = built(count=5)
    with pytest.raises(InputError, match="has 35 particles, but that before has 42"):
        later.in_context(after).go_on_from(before)
    with pytest.raises(InputError, match="context"):
        later.in_context(after).go_on_from("before")
