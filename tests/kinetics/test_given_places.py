"""Linkers that begin bound at given places."""

import numpy as np
import openmm
import pytest
from openmm import unit

from openmm_cylchain import MICROTUBULE, Body, Crosslinker, Filaments, Hand, InputError

STAYS = Hand(binding_rate=0.0, reach=1.0, unbinding_rate=0.0)
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
    sites = Hand(binding_rate=0.0, reach=1.0, unbinding_rate=0.0, site_spacing=8.0)
    walker = Crosslinker(hands=(sites, sites), stiffness=1.0, rest_length=0.0)
    with pytest.raises(InputError, match="hands without sites"):
        two_filaments().add_linkers(walker, anchors=np.zeros((1, 3)), bound=1, places=[(0, 0.0)])
