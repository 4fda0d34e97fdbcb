"""Linkers that begin bound at given places."""

import numpy as np
import openmm
import pytest
from openmm import unit

from openmm_cylchain import (
    ACTIN_ATP,
    F_ACTIN,
    MICROTUBULE,
    Body,
    Crosslinker,
    Filaments,
    Growth,
    Hand,
    InputError,
    MonomerPool,
    Monomers,
)
from support.solvent import KT, TEMPERATURE

STAYS = Hand(binding_rate=0.0, reach=1.0, unbinding_rate=0.0)
# nm, and kJ/(mol nm^2).
MONOMER, SPRING = 2.7, 0.05
HOLDS = Crosslinker(hands=(STAYS, STAYS), stiffness=100.0, rest_length=0.0)


def two_filaments():
    filaments = Filaments(viscosity=1.0 * unit.millipascal * unit.second, temperature=300.0)
    for y in (0.0, 500.0):
        filaments.add_straight(MICROTUBULE, 4, [0.0, y, 0.0], [1.0, 0.0, 0.0])
    return filaments


@pytest.mark.parametrize("anchored", [False, True])
def test_they_are_where_they_are_told_and_stay(anchored):
    filaments = two_filaments()
    length = float(MICROTUBULE.segment_lengths(4, False).sum())
    places = [(1, 0.0), (0, 0.3 * length), (1, length)]
    anchors = {"anchors": np.zeros((4, 3))} if anchored else {"count": 4, "volume": 1e9}
    filaments.add_linkers(HOLDS, bound=3, places=places, **anchors)
    _, system, positions = filaments.build()
    integrator = filaments.create_integrator(system, 1.0, random_seed=1, checks=False)
    context = openmm.Context(system, integrator, openmm.Platform.getPlatform("Reference"))
    context.setPositions(positions)
    for _ in range(2):
        table = filaments.in_context(context).linkers()
        hand = int(anchored)
        assert table.filaments[:, hand].tolist() == [1, 0, 1, -1]
        np.testing.assert_allclose(table.arc_lengths[:3, hand], [along for _, along in places])
        assert np.all(table.filaments[:, 1 - hand] == -1)
        integrator.step(5)


def crosslink_of_growing():
    """Two filaments that treadmill by a hundred monomers in 0.2 s, joined where they cross, and their Context."""
    filaments = Filaments(viscosity=1.0 * unit.millipascal * unit.second, temperature=TEMPERATURE)
    kind = F_ACTIN.with_segment_length(108.0)
    per_second = 1 / unit.second
    monomers = Monomers(
        length=MONOMER, plus_on_rate=1160 * per_second / unit.micromolar, minus_off_rate=400 * per_second
    )
    growth = Growth(monomers=monomers, pool=MonomerPool(0.3448 * unit.micromolar), longest=4000.0)
    filaments.add_straight(kind, 20, [-1080.0, 0.0, 0.0], [1.0, 0.0, 0.0], growth=growth)
    filaments.add_straight(kind, 20, [0.0, -1080.0, 0.0], [0.0, 1.0, 0.0], growth=growth)
    link = Crosslinker(hands=(STAYS, STAYS), stiffness=SPRING, rest_length=0.0)
    places = [((0, 1080.0), (1, 1.08 * unit.micrometer))]
    filaments.add_linkers(link, count=1, volume=1e9, bound=1, places=places)
    _, system, positions = filaments.build()
    integrator = filaments.create_integrator(system, 50 * unit.microsecond, random_seed=1, checks=False)
    context = openmm.Context(system, integrator, openmm.Platform.getPlatform("CPU"), {"Threads": "1"})
    context.setPositions(positions)
    return filaments, context


def test_a_crosslink_of_filaments_that_grow_stays_with_its_monomers():
    filaments, context = crosslink_of_growing()
    here = filaments.in_context(context)
    for _ in range(3):
        context.getIntegrator().step(1500)
        growth, ends = here.growth(), here.linker_pulls().places[0]
        positions = context.getState(positions=True).getPositions(asNumpy=True)._value
        for number, end in enumerate(ends):
            nodes = positions[filaments.node_indices[number][: growth.nodes[number]]]
            segments = np.diff(nodes, axis=0)
            lengths = np.linalg.norm(segments, axis=1)
            along = np.clip(np.sum((end - nodes[:-1]) * segments, axis=1) / lengths**2, 0, 1)
            nearest = np.argmin(np.linalg.norm(nodes[:-1] + along[:, None] * segments - end, axis=1))
            contour = lengths[:nearest].sum() + along[nearest] * lengths[nearest]
            assert contour == pytest.approx(1080.0 - MONOMER * growth.monomers[number, 0], abs=2.0)
    assert growth.monomers[:, 0].min() > 50


@pytest.mark.slow
def test_a_crosslink_of_filaments_that_grow_has_its_energy():
    filaments, context = crosslink_of_growing()
    here = filaments.in_context(context)
    energies = []
    for _ in range(4000):
        context.getIntegrator().step(4)
        energies.append(0.5 * SPRING * here.linker_pulls().lengths[0] ** 2 / KT)
    blocks = np.mean(np.array_split(energies, 20), axis=1)
    error = np.std(blocks, ddof=1) / np.sqrt(20)
    assert 4 * error < 0.1
    assert np.mean(blocks) == pytest.approx(1.5, abs=4 * error)


def test_their_anchors_may_be_on_bodies():
    filaments = two_filaments()
    filaments.add_body(Body.sphere(100.0), [0.0, 0.0, 0.0])
    first = 2 * 5
    filaments.add_linkers(HOLDS, anchors=np.array([first, first]), bound=2, places=[(0, 0.0), (1, 0.0)])
    _, system, positions = filaments.build()
    assert filaments.body_indices[0][0] == first
    integrator = filaments.create_integrator(system, 1e3, random_seed=1, checks=False)
    context = openmm.Context(system, integrator, openmm.Platform.getPlatform("Reference"))
    context.setPositions(positions)
    integrator.step(20)
    pulls = filaments.in_context(context).linker_pulls()
    positions = context.getState(positions=True).getPositions(asNumpy=True)._value
    np.testing.assert_allclose(pulls.places[:, 0], positions[[first, first]], atol=1e-9)
    np.testing.assert_allclose(pulls.places[:, 1], positions[[0, 5]], atol=1e-9)


@pytest.mark.parametrize(
    ("places", "message"),
    [
        ([(0, 0.0)], "2 begin bound, but there are 1 places"),
        ([(0, 0.0), (2, 0.0)], "filament 2 does not exist"),
        ([(0, 0.0), (1, -1.0)], "places cannot be negative"),
        ([(0, 0.0), (1, 1e6)], "beyond the end of filament 1"),
    ],
)
def test_what_is_refused(places, message):
    with pytest.raises(InputError, match=message):
        two_filaments().add_linkers(HOLDS, anchors=np.zeros((2, 3)), bound=2, places=places)
    later = two_filaments()
    later.add_reserve(
        F_ACTIN.with_segment_length(108.0), 3, growth=Growth(monomers=ACTIN_ATP, pool=MonomerPool(1e-6), longest=540.0)
    )
    with pytest.raises(InputError, match="filament 2 is not there yet"):
        later.add_linkers(HOLDS, count=1, volume=1e9, bound=1, places=[(2, 0.0)])
    both = [((0, 0.0), (0, 10.0))]
    with pytest.raises(InputError, match="both hands are on filament 0"):
        two_filaments().add_linkers(HOLDS, count=1, volume=1e9, bound=1, places=both)
    with pytest.raises(InputError, match="has one hand, and one place"):
        two_filaments().add_linkers(HOLDS, anchors=np.zeros((1, 3)), bound=1, places=both)
    sites = Hand(binding_rate=0.0, reach=1.0, unbinding_rate=0.0, site_spacing=8.0)
    walker = Crosslinker(hands=(sites, sites), stiffness=1.0, rest_length=0.0)
    with pytest.raises(InputError, match="hands without sites"):
        two_filaments().add_linkers(walker, anchors=np.zeros((1, 3)), bound=1, places=[(0, 0.0)])
