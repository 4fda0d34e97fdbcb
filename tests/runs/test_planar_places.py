"""Planar filaments at random places: with contacts they do not cross each other, however they are placed."""

import itertools

import numpy as np
import pytest

from openmm_cylchain import F_ACTIN, ContactWarning, Filaments, InputError, capsule_contact_force
from openmm_cylchain.runs import initial_state
from openmm_cylchain.runs.configuration import parse_configuration
from openmm_cylchain.runs.initial_state import place_filaments

BOX = np.array([2000.0, 2000.0, 2000.0])
TEXT = """
[solvent]
temperature = "300 K"
viscosity = "1 mPa*s"
[[filament]]
type = "F_ACTIN"
segment_length = "100 nm"
segments = 4
count = 40
planar = true
PLACE
[simulation]
time_step = "1 us"
duration = "1 us"
report_interval = "1 us"
"""
IN_BOX = '[box]\nedges = ["2 um", "2 um", "2 um"]\n'
CONTACTS = '[contacts]\ndiameter = "20 nm"\n'


def placed(place="", more=CONTACTS, seed=1):
    return place_filaments(parse_configuration(TEXT.replace("PLACE", place) + more, "here.toml"), "compiled", seed)


def crossings(filaments, box=None):
    """By the signs of areas, of all segments of different filaments."""

    def side(a, b, c):
        return np.sign((b - a)[..., 0] * (c - a)[..., 1] - (b - a)[..., 1] * (c - a)[..., 0])

    count = 0
    for one, other in itertools.combinations(filaments, 2):
        (a, b), (c, d) = (np.array([own.positions[:-1], own.positions[1:]]) for own in (one, other))
        a, b, c, d = a[:, None], b[:, None], c[None], d[None]
        shift = 0.0 if box is None else box * np.round((c + d - a - b) / (2 * box))
        p, q = c - shift, d - shift
        count += np.sum((side(a, b, p) != side(a, b, q)) & (side(p, q, a) != side(p, q, b)))
    return count


def test_in_a_box():
    assert crossings(placed(more=IN_BOX), BOX) > 5
    filaments = placed(more=IN_BOX + CONTACTS)
    assert crossings(filaments, BOX) == 0
    # Those that crossed none are where they were.
    before = placed(more=IN_BOX)
    same = [np.array_equal(one.positions, other.positions) for one, other in zip(filaments, before)]
    assert 10 < sum(same) < 40


def test_in_a_region():
    place = 'inside = { shape = "sphere", radius = "800 nm" }'
    assert crossings(placed(place, more="")) > 5
    assert crossings(placed(place)) == 0


def test_other_heights_do_not_cross():
    """A second table in a plane above is drawn as without the first one."""
    text = TEXT.replace("PLACE", "") + CONTACTS + IN_BOX
    above = text[text.index("[[filament]]") : text.index("[simulation]")] + 'height = "50 nm"\n'
    configuration = parse_configuration(text.replace("[simulation]", above + "[simulation]"), "here.toml")
    filaments = list(place_filaments(configuration, "compiled", 1))
    assert crossings(filaments[:40], BOX) == crossings(filaments[40:], BOX) == 0
    assert crossings(filaments, BOX) > 5


def test_too_many_are_refused(monkeypatch):
    monkeypatch.setattr(initial_state, "_ATTEMPTS", 30)
    with pytest.raises(InputError, match=r"number 1: planar filament \d+ crosses another one, or itself, at each of"):
        placed(more=CONTACTS + IN_BOX.replace("2 um", "0.5 um"))
    with pytest.raises(InputError, match=r"at all \d+ of 30 random places inside it crosses another planar"):
        placed('inside = { shape = "sphere", radius = "230 nm" }')


def test_filaments_of_a_users_own_are_warned_of():
    filaments = Filaments(602.0, 300.0)
    short = F_ACTIN.with_segment_length(100.0)
    filaments.add_straight(short, 2, [0, 0, 0], [1, 0, 0], planar=True)
    filaments.add_straight(short, 3, [150, -120, 0], [0, 1, 0], planar=True)
    _, system, _ = filaments.build()
    with pytest.warns(ContactWarning, match="Segment 1 of filament 0 and segment 1 of filament 1 cross each other"):
        capsule_contact_force(filaments, system, 20.0)


def test_a_filament_that_crosses_itself_is_warned_of():
    filaments = Filaments(602.0, 300.0)
    nodes = [[0, 0, 0], [100, 0, 0], [100, 100, 0], [50, 100, 0], [50, -50, 0]]
    filaments.add_nodes(F_ACTIN.with_segment_length(100.0), nodes, planar=True)
    _, system, _ = filaments.build()
    with pytest.warns(ContactWarning, match="Segment 0 of filament 0 and segment 3 of filament 0 cross each other"):
        capsule_contact_force(filaments, system, 20.0)
