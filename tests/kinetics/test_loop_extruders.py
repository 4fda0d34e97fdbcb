"""Linkers that load as pairs and extrude loops, and barriers, through Contexts: their load, restarts, what is refused.

Their kinetics is tested in tests/cpp/TestLoopExtruders.cpp.
"""

from dataclasses import replace

import numpy as np
import openmm
import pytest
from openmm import unit

from openmm_cylchain import (
    COHESIN,
    DSDNA,
    Crosslinker,
    Filaments,
    FilamentType,
    Hand,
    HandAtEnd,
    InputError,
)
from support.contexts import new_context

PN = 0.602214076  # kJ/(mol nm)
NM, SECOND = unit.nanometer, unit.second
KT = 4.1420  # pN nm, at 300 K
SEGMENT = 50.0


def hand(speed=0.0, unbinding=0.0, spacing=None, stall=None, **others):
    return Hand(
        binding_rate=20 / SECOND,
        reach=100 * NM,
        unbinding_rate=unbinding / SECOND,
        speed=speed * NM / SECOND,
        site_spacing=spacing,
        stall_force=None if stall is None else stall * unit.piconewton,
        **others,
    )


def extruder(speed=500.0, unbinding=0.5, stiffness=0.02, **others):
    hands = [hand(direction * speed, 0.5 * unbinding, **others) for direction in (-1, 1)]
    return Crosslinker(hands=hands, stiffness=stiffness * PN, rest_length=30.0, loading_distance=50.0)


def chains(count=1, segments=60, viscosity=0.1, jointed=False):
    filaments = Filaments(viscosity=viscosity * unit.pascal * SECOND, temperature=300 * unit.kelvin)
    kind = FilamentType(
        name="CHR",
        diameter=10.0,
        segment_length=SEGMENT,
        bending_rigidity=0.0 if jointed else 0.5 * SEGMENT * KT * PN,
        stretching_modulus=500 * unit.piconewton,
        friction_length=SEGMENT,
    )
    for number in range(count):
        filaments.add_equilibrium(kind, segments, seed=number)
    return filaments


def test_pairs_and_barriers_in_a_context_that_starts_again():
    """Both hands of a linker are bound, on one filament, or none; a checkpoint and a State go on to the bit."""
    for spacing in (None, 25.0):
        filaments = chains(2)
        filaments.add_linkers(extruder(spacing=spacing), 30, volume=1e9)
        for place in (800.0, 1500.0, 2200.0):
            filaments.add_barrier(1, place, toward="both", release_rate=0.1 / SECOND, capture_probability=0.7)
        _, system, positions = filaments.build()
        copy = openmm.XmlSerializer.deserialize(openmm.XmlSerializer.serialize(system))

        def context_of(own, filaments=filaments):
            integrator = filaments.create_integrator(own, 1e8, random_seed=3, checks=False)
            return openmm.Context(own, integrator, openmm.Platform.getPlatformByName("Reference"))

        context = context_of(system)
        context.setPositions(positions)
        here = filaments.in_context(context)
        context.getIntegrator().step(6000)
        table = here.linkers()
        both = table.held == 2
        assert 5 < both.sum() < 30 and not np.any(table.held == 1)
        assert np.all(table.filaments[both, 0] == table.filaments[both, 1])
        assert np.all(np.diff(table.arc_lengths[both], axis=1) > 0)
        on = table.filaments == 1
        held = (
            table.arc_lengths[on] % 25 == 0.625 * 25 if spacing else np.isin(table.arc_lengths[on], [800, 1500, 2200])
        )
        assert held.any()
        checkpoint = context.createCheckpoint()
        state = context.getState(positions=True, parameters=True, integratorParameters=True)
        ends = []
        for start in (None, checkpoint, openmm.XmlSerializer.serialize(state)):
            own = context if start is None else context_of(copy)
            if isinstance(start, bytes):
                own.loadCheckpoint(start)
            elif start is not None:
                own.setState(openmm.XmlSerializer.deserialize(start))
            own.getIntegrator().step(500)
            end = filaments.in_context(own).linkers()
            ends.append((end.arc_lengths, own.getState(positions=True).getPositions(asNumpy=True)._value))
        assert np.any(ends[0][0] != table.arc_lengths)
        for arc_lengths, places in ends[1:]:
            np.testing.assert_array_equal(arc_lengths, ends[0][0])
            np.testing.assert_array_equal(places, ends[0][1])


def way_of_hands(outer, tension, loop, stiffness, stall, speed, time):
    """How far hands walk outward on a freely jointed chain under a tension, from places on their segments.

    The part a of a segment between a hand and the joint beyond it has the partition function sinh(x)/x under the
    tension T, with x = T a/k_BT, so that it pulls with T c, c = coth x - 1/x. With the segment's other part i, n whole
    ones b and the part of the other hand, the loop goes from hand to hand along the spring k, whose mean is T/k along
    the tension. It pulls with k_BT (i (1 + c^2) - c T/k)/s, where s = n b^2/3 + k_BT/k is its variance in a direction.
    """
    way, parts = np.zeros_like(outer), 2000
    for _ in range(parts):
        part = (outer - way) % SEGMENT
        x, inner = tension * np.maximum(part, 1e-3) / KT, SEGMENT - part
        cosine = 1.0 / np.tanh(x) - 1.0 / x
        of_loop = KT * (inner * (1.0 + cosine**2) - cosine * tension / stiffness)
        load = tension * cosine + of_loop / (loop * SEGMENT**2 / 3.0 + KT / stiffness)
        way += speed * (1.0 - load / stall) * time / parts
    return way


@pytest.mark.slow
def test_loops_grow_against_the_tension_of_the_chain_and_stall():
    """Within 3 % of their way, which a tension of 1.5 pN leaves a third of."""
    stall, speed, step, loop, stiffness = 2.0, 50.0, 2e7, 12, 0.05
    for tension, count in ((0.5, 8), (1.5, 48), (2.6, 8)):
        filaments = Filaments(viscosity=0.02 * unit.pascal * SECOND, temperature=300 * unit.kelvin)
        kind = chains(jointed=True)[0].type
        turn = 2 * np.pi * np.arange(1, loop + 1) / loop
        radius = loop * SEGMENT / (2 * np.pi)
        nodes = [[(i - 8) * SEGMENT, 0, 0] for i in range(9)]
        nodes += [[radius * np.sin(w), radius * (1 - np.cos(w)), 5 * w] for w in turn]
        nodes += [[(i + 1) * SEGMENT, 0, 31] for i in range(8)]
        for _ in range(count):
            number = filaments.add_nodes(kind, nodes)
            filaments.add_tether(number, 0, nodes[0], 100.0)
        own = replace(extruder(speed, 0.0, stiffness, stall=stall, walks_backward=True), rest_length=0.0)
        filaments.add_linkers(own, count, volume=1e9)
        _, system, positions = filaments.build()
        pull = openmm.CustomExternalForce(f"-{tension * PN}*x")
        for particles in filaments.node_indices:
            pull.addParticle(int(particles[-1]), [])
        system.addForce(pull)
        integrator = filaments.create_integrator(system, step, random_seed=1, checks=False)
        context = openmm.Context(system, integrator, openmm.Platform.getPlatformByName("Reference"))
        context.setPositions(positions)
        here = filaments.in_context(context)
        middle = 8 * SEGMENT
        arc_lengths = [[middle - 5, middle + loop * SEGMENT + 5]] * count
        here.set_linkers(replace(here.linkers(), filaments=[[i, i] for i in range(count)], arc_lengths=arc_lengths))
        tables = []
        for steps in (5000, 25000):
            integrator.step(steps)
            tables.append(here.linkers().arc_lengths)
        ways = (tables[1] - tables[0]) * [-1, 1]
        if tension > 2.5:
            # Hands have gone back to joints: beyond them segments pull with more than the stall force.
            np.testing.assert_allclose(tables[1], [[400, 1000]] * count, atol=0.5)
            continue
        # Between the hand and the joint beyond it.
        outer = np.stack([tables[0][:, 0], -tables[0][:, 1]], axis=1) % SEGMENT
        expected = way_of_hands(outer, tension, loop, stiffness, stall, speed, 25000 * step * 1e-12)
        error = (ways - expected).std(ddof=1) / np.sqrt(ways.size)
        assert abs((ways - expected).mean()) < 4 * error and 4 * error < 0.03 * expected.mean()


def test_presets_extrude():
    filaments = chains()
    filaments.add_linkers(COHESIN, 10, volume=1e7)
    _, system, positions = filaments.build()
    integrator = filaments.create_integrator(system, 5e8, random_seed=3, checks=False)
    context = openmm.Context(system, integrator, openmm.Platform.getPlatformByName("Reference"))
    context.setPositions(positions)
    integrator.step(400)
    table = filaments.in_context(context).linkers()
    assert np.diff(table.arc_lengths[table.held == 2], axis=1).max() > 60.0


def test_what_is_refused():
    with pytest.raises(InputError, match="site holds one hand"):
        extruder(spacing=60.0)
    with pytest.raises(InputError, match="loading_distance, or cosine_range or trans_activated"):
        replace(extruder(), trans_activated=True)
    with pytest.raises(InputError, match="bind at ends have no loading_distance"):
        replace(extruder(), hands=hand(filament_end=HandAtEnd(end="plus", range=10.0, binds_there=True)))
    filaments = chains()
    with pytest.raises(InputError, match="begin unbound"):
        filaments.add_linkers(extruder(), 3, volume=1e9, bound=1)
    with pytest.raises(InputError, match="loading_distance is of two"):
        same = replace(extruder(), hands=hand(5.0))
        filaments.add_linkers(same, anchors=[[0.0, 0.0, 0.0]])
    settings = {"toward": "plus", "release_rate": 0.0}
    with pytest.raises(InputError, match="3000 nm long, but arc_length is 3001"):
        filaments.add_barrier(0, 3001.0, **settings)
    with pytest.raises(InputError, match="toward"):
        filaments.add_barrier(0, 5.0, toward="left", release_rate=0.0)
    with pytest.raises(InputError, match="capture_probability must be between 0 and 1"):
        filaments.add_barrier(0, 5.0, capture_probability=1.1, **settings)
    with pytest.raises(InputError, match="[Ff]ilament"):
        filaments.add_barrier(1, 5.0, **settings)
    filaments.add_barrier(0, 5.0, **settings)
    assert filaments.barriers[0].direction == 1
    with pytest.raises(InputError, match="no linkers that they could capture"):
        filaments.build()
    portable = Filaments(viscosity=0.6, temperature=300.0, engine="portable")
    portable.add_straight(DSDNA, 5, [0, 0, 0], [1, 0, 0])
    with pytest.raises(InputError, match="no linkers"):
        portable.add_barrier(0, 5.0, **settings)


def test_half_a_pair_is_refused():
    filaments = chains()
    filaments.add_linkers(extruder(), 2, volume=1e9)
    _, system, positions = filaments.build()
    context = new_context(system, positions, filaments.create_integrator(system, 1e8, checks=False))
    here = filaments.in_context(context)
    with pytest.raises(InputError, match="one hand bound, but those of its type bind and unbind both"):
        here.set_linkers(replace(here.linkers(), filaments=[[0, -1], [-1, -1]]))
