"""Arguments that are not what they should be are refused in words, wherever they would fail later or not at all."""

import dataclasses
import re

import numpy as np
import pytest
from openmm import unit

from openmm_cylchain import (
    F_ACTIN,
    CrosslinkReporter,
    Crosslinks,
    CrosslinkTable,
    FilamentReporter,
    Filaments,
    FilamentType,
    InputError,
    LinkerReporter,
    TensionReporter,
    TetherReporter,
)


@pytest.fixture
def filaments():
    return Filaments(602.0, 300.0)


def test_numbers_of_segments_that_no_computer_holds(filaments):
    message = re.escape("segments must be at most 1e+08, but is 1e+15")
    for segments in (10**15, 1e15):
        with pytest.raises(InputError, match=message):
            filaments.add_straight(F_ACTIN, segments, (0, 0, 0), (1, 0, 0))
        with pytest.raises(InputError, match=message):
            filaments.add_equilibrium(F_ACTIN, segments, seed=1)
        with pytest.raises(InputError, match=message):
            filaments.add_ring(F_ACTIN, segments, (0, 0, 0))


def test_arguments_are_shown_on_one_short_line(filaments):
    with pytest.raises(InputError, match=re.escape("must be a whole number, but is an array of the shape (1000,).")):
        filaments.add_straight(F_ACTIN, np.zeros(1000), (0, 0, 0), (1, 0, 0))
    for wrong in (["x"] * 1000, "x" * 1000, {"a": np.eye(9)}, object()):
        with pytest.raises(InputError) as caught:
            filaments.add_straight(F_ACTIN, wrong, (0, 0, 0), (1, 0, 0))
        assert len(str(caught.value)) < 250 and "\n" not in str(caught.value)
    with pytest.raises(InputError, match=r"but is \[1, 2\]\."):
        filaments.add_straight(F_ACTIN, [1, 2], (0, 0, 0), (1, 0, 0))


@pytest.mark.parametrize("planar", [False, True])
def test_positions_beyond_all_measure(filaments, planar):
    nodes = np.array([[0.0, 0, 0], [360, 0, 0], [720, 0, 0]])
    for far in (1e18, 1e200):
        with pytest.raises(InputError, match=r"up to 1e\+(18|200) nm from the origin. Beyond 1e\+12 nm"):
            filaments.add_nodes(F_ACTIN, nodes + [0, 0, far], planar=planar)
    for wrong in (-np.inf, np.nan):
        with pytest.raises(InputError, match="positions must be finite"):
            filaments.add_nodes(F_ACTIN, nodes + [0, 0, wrong], planar=planar)


@pytest.mark.parametrize("box", [5, "box", [1, 2], np.eye(3)[:2], [5.0, 5.0, 5.0], np.nan * np.eye(3)])
def test_boxes_that_are_none(filaments, box):
    filaments.add_straight(F_ACTIN, 2, (0, 0, 0), (1, 0, 0))
    with pytest.raises(InputError, match="box_vectors must"):
        filaments.build(box)


@pytest.mark.parametrize("box", [-np.eye(3), 0.0 * np.eye(3), [[1, 0, 0], [0, 1, 0], [5, 0, 1]]])
def test_boxes_in_another_form(filaments, box):
    filaments.add_straight(F_ACTIN, 2, (0, 0, 0), (1, 0, 0))
    with pytest.raises(InputError, match="in the reduced form of OpenMM"):
        filaments.build(box)


def test_boxes_with_and_without_units():
    box = [[1000.0, 0, 0], [0, 2000.0, 0], [100.0, 0, 3000.0]]
    for given in (box, np.array(box) * unit.nanometer, [0.001 * np.array(edge) * unit.micrometer for edge in box]):
        filaments = Filaments(602.0, 300.0)
        filaments.add_straight(F_ACTIN, 2, (0, 0, 0), (1, 0, 0))
        _, system, _ = filaments.build(given)
        vectors = system.getDefaultPeriodicBoxVectors()
        np.testing.assert_allclose([[x for x in edge._value] for edge in vectors], box)


@pytest.mark.parametrize("wrong", ["filaments", 3, None, Crosslinks(1.0, 1.0)])
@pytest.mark.parametrize("reporter", [FilamentReporter, TensionReporter, TetherReporter, LinkerReporter])
def test_reporters_of_another_object(reporter, wrong):
    with pytest.raises(InputError, match=f"must be a Filaments object, but is {type(wrong).__name__}"):
        reporter(None, 5, wrong)


def test_a_reporter_of_crosslinks_that_are_none(filaments):
    for wrong in (filaments, None):
        with pytest.raises(InputError, match="must be a Crosslinks object"):
            CrosslinkReporter(None, 5, wrong)


COLUMNS = {
    "numbers": [0],
    "pairs": [[0, 1]],
    "stiffness": [1.0],
    "rest_length": [1.0],
    "maximum_extension": [np.inf],
    "next_number": 1,
}


@pytest.mark.parametrize(
    ("name", "value", "message"),
    [
        ("numbers", np.nan, "numbers of a table of crosslinks must be finite"),
        ("numbers", [np.nan], "numbers of a table of crosslinks must be finite"),
        ("numbers", [0.5], "numbers of a table of crosslinks must be whole"),
        ("numbers", "abc", "numbers of a table of crosslinks must be an array of numbers"),
        ("pairs", [[np.nan, 1]], "pairs of a table of crosslinks must be finite"),
        ("partners", [[np.inf, 1]], "partners of a table of crosslinks must be finite"),
        ("stiffness", [np.nan], "stiffness of a table of crosslinks must be finite"),
        ("stiffness", [np.inf], "stiffness of a table of crosslinks must be finite"),
        ("stiffness", ["a"], "stiffness of a table of crosslinks must be an array of numbers"),
        ("rest_length", [np.inf], "rest_length of a table of crosslinks must be finite"),
        ("maximum_extension", [np.nan], "positive"),
        ("points", [[np.nan, 0, 0]], "points of a table of crosslinks must be finite"),
        ("next_number", np.nan, "next_number must be a whole number"),
        ("next_number", "x", "next_number must be a whole number"),
    ],
)
def test_tables_of_crosslinks(name, value, message):
    assert len(CrosslinkTable(**COLUMNS)) == 1
    with pytest.raises(InputError, match=message):
        CrosslinkTable(**{**COLUMNS, name: value})


@pytest.mark.parametrize("name", ["bending_rigidity", "segment_length", "diameter", "mass_per_length"])
@pytest.mark.parametrize("value", [1e308, 1e-300])
def test_filament_types_beyond_all_measure(name, value):
    message = f"{name} must be between 1e-30 and 1e+30 in OpenMM's units, but is {value:g}."
    with pytest.raises(InputError, match=re.escape(message)):
        dataclasses.replace(F_ACTIN, **{name: value})


def test_a_filament_type_without_mass():
    with pytest.raises(InputError, match="mass_per_length must be given"):
        dataclasses.replace(F_ACTIN, mass_per_length=None)
    assert FilamentType(
        name="X", diameter=7.0, segment_length=100.0, bending_rigidity=0.0, stretching_modulus=1e3
    ).mass_per_length == pytest.approx(3500.0)
