"""Where linkers are bound to begin with: near their anchors, and on sites that no other linker has."""

from dataclasses import replace

import numpy as np
import pytest
from openmm import unit

from openmm_cylchain import ACTIN_ATP, F_ACTIN, MICROTUBULE, Crosslinker, Filaments, Growth, Hand, InputError
from support.contexts import new_context
from support.solvent import KT, TEMPERATURE, VISCOSITY

HAND = Hand(binding_rate=1e-8, reach=40.0, unbinding_rate=1e-9)
SPRING = Crosslinker(hands=HAND, stiffness=0.02, rest_length=5.0)
ABOVE = 12.0


def straight(kinds=(F_ACTIN,)):
    """Filaments of 400 nm along x, 100 nm beside each other."""
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine="compiled")
    for number, kind in enumerate(kinds):
        filaments.add_straight(kind.with_segment_length(100.0), 4, (0.0, 100.0 * number, 0.0), (1.0, 0.0, 0.0))
    return filaments


def begun(filaments, box=None):
    """The table and the springs of a Context in which nothing has happened yet."""
    _, system, positions = filaments.build(box_vectors=box)
    integrator = filaments.create_integrator(system, 1.0, checks=False)
    context = new_context(system, positions, integrator)
    here = filaments.in_context(context)
    return here.linkers(), here.linker_pulls()


@pytest.mark.parametrize("shift", [0.0, 1.0])
@pytest.mark.parametrize("units", [1.0, unit.nanometer])
def test_anchored_linkers_begin_in_the_equilibrium_of_their_springs(shift, units):
    """Above the middle of a filament, also where that is an image in a triclinic box."""
    box = np.array([[450.0, 0.0, 0.0], [120.0, 300.0, 0.0], [-90.0, 100.0, 350.0]])
    filaments = straight()
    points = np.tile([[200.0, ABOVE, 0.0]] + shift * (box[0] - box[2]), (4000, 1))
    filaments.add_linkers(SPRING, anchors=points * units, bound=4000)
    table, pulls = begun(filaments, box)
    assert table.counts() == (0, 0, 4000)
    along = np.linspace(-1.0, 1.0, 4001) * np.sqrt(HAND.reach**2 - ABOVE**2)
    lengths = np.hypot(ABOVE, along)
    weights = np.exp(-0.5 * SPRING.stiffness * (lengths - SPRING.rest_length) ** 2 / KT)
    for found, exact in ((pulls.lengths, lengths), (table.arc_lengths[:, 1], 200.0 + along)):
        mean = np.average(exact, weights=weights)
        error = np.sqrt(np.average((exact - mean) ** 2, weights=weights) / len(found))
        assert 4.0 * error < 0.05 * mean
        assert abs(found.mean() - mean) < 4.0 * error
    assert pulls.lengths.max() < HAND.reach


def test_anchors_that_have_no_filament_within_reach_begin_unbound():
    filaments = straight((F_ACTIN, MICROTUBULE))
    hand = replace(HAND, binds_to=MICROTUBULE)
    points = [[x, y, 0.0] for x in (-41.0, -39.0, 10.0, 439.0, 441.0) for y in (0.0, 100.0)]
    filaments.add_linkers(replace(SPRING, hands=hand), anchors=points, bound=2)
    table, pulls = begun(filaments)
    np.testing.assert_array_equal(np.flatnonzero(table.bound[:, 1]), [3, 5])
    assert np.all(table.filaments[[3, 5], 1] == 1) and pulls.lengths.max() < 40.0
    again = straight((F_ACTIN, MICROTUBULE))
    again.add_linkers(replace(SPRING, hands=hand, name="motor"), anchors=points, bound=4)
    with pytest.raises(InputError, match="'motor': 4 are .* only 3 of the 10 anchors have a free place"):
        again.build()


def test_particles_are_anchors_where_they_are():
    """The nodes of a ring and of a filament; at zero temperature, springs are as little strained as can be."""
    filaments = Filaments(VISCOSITY, 0.0, engine="compiled")
    angles = 2.0 * np.pi * np.arange(6) / 6
    ring = 100.0 * np.column_stack([np.cos(angles), np.sin(angles), np.zeros(6)])
    filaments.add_nodes(F_ACTIN.with_segment_length(100.0), ring, closed=True)
    filaments.add_straight(MICROTUBULE.with_segment_length(100.0), 1, [75.0, -43.0, 9.0], [0.0, 0.0, 1.0])
    hand = replace(HAND, binds_to=F_ACTIN)
    with pytest.warns(match="thermal extension is 0 nm"):
        filaments.add_linkers(Crosslinker(hands=hand, stiffness=0.1), anchors=[0, 3, 6], bound=3)
    table, pulls = begun(filaments)
    assert np.all(table.filaments[:, 1] == 0)
    # The last one is near the segment that closes the ring.
    assert 500.0 < table.arc_lengths[2, 1] < 600.0
    np.testing.assert_allclose(pulls.lengths, [0.0, 0.0, 9.0], atol=2.0)
    late = straight()
    late.add_linkers(SPRING, anchors=[7], bound=1)
    with pytest.raises(InputError, match="where particle 7, an anchor, is, is not known: there are only 5"):
        late.build()


@pytest.mark.parametrize("anchored", [False, True])
def test_types_of_linkers_share_sites(anchored):
    """Forty sites of 10 nm on each of two filaments."""
    filaments = straight((F_ACTIN, MICROTUBULE))
    kind = replace(SPRING, hands=replace(HAND, site_spacing=10.0))
    filaments.add_linkers(kind, 30, volume=1e9, bound=30)
    of_microtubules = replace(kind, hands=replace(kind.hands[0], binds_to=MICROTUBULE))
    filaments.add_linkers(of_microtubules, 12, volume=1e9, bound=12)
    if anchored:
        points = [[x, y, 1.0] for x in np.arange(400.0) for y in (0.0, 100.0)]
        filaments.add_linkers(replace(kind, name="motor"), anchors=points, bound=38)
    else:
        filaments.add_linkers(replace(kind, name="motor"), 38, volume=1e9, bound=38)
    table, _ = begun(filaments)
    side = np.where(table.bound[:, 1], 1, 0)
    rows = np.flatnonzero(table.bound.any(axis=1))
    places = {(int(table.filaments[row, side[row]]), float(table.arc_lengths[row, side[row]])) for row in rows}
    assert places == {(number, 10.0 * site + 5.0) for number in (0, 1) for site in range(40)}
    more = straight((F_ACTIN, MICROTUBULE))
    more.add_linkers(kind, 50, volume=1e9, bound=50)
    more.add_linkers(replace(kind, name="motor"), 31, volume=1e9, bound=31)
    with pytest.raises(InputError, match="'motor': 31 are to begin bound, but there are only 30 sites"):
        more.build()


def reserve(filaments):
    """A hundred filaments that are not there yet."""
    growth = Growth(monomers=ACTIN_ATP, pool=0.0, longest=1000.0)
    filaments.add_reserve(F_ACTIN.with_segment_length(108.0), 100, growth=growth)
    return filaments


def test_no_linker_begins_on_filaments_that_are_not_there_yet():
    filaments = reserve(straight())
    points = np.tile([[200.0, ABOVE, 0.0]], (50, 1))
    filaments.add_linkers(SPRING, 50, volume=1e6, bound=50)
    filaments.add_linkers(SPRING, anchors=points, bound=50)
    table, _ = begun(filaments)
    assert table.counts(0) == (0, 50, 0) and table.counts(1) == (0, 0, 50)
    assert set(table.filaments.ravel().tolist()) == {0, -1}


@pytest.mark.parametrize("linkers", [{"count": 1, "volume": 1e6}, {"anchors": [[0.0, 0.0, 0.0]]}])
def test_linkers_are_refused_that_begin_on_a_reserve_alone(linkers):
    filaments = reserve(Filaments(VISCOSITY, TEMPERATURE, engine="compiled"))
    filaments.add_linkers(SPRING, bound=1, **linkers)
    with pytest.raises(InputError, match="none is there yet"):
        begun(filaments)
