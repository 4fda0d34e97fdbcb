"""Arguments that are not what they should be are refused in words, wherever they would fail later or not at all."""

import dataclasses
import re

import numpy as np
import openmm
import pytest
from openmm import app, unit

from openmm_cylchain import (
    DSDNA_BASE_PAIRS,
    F_ACTIN,
    Box,
    ConstantVelocityPulling,
    Crosslinker,
    CrosslinkReporter,
    Crosslinks,
    CrosslinkTable,
    FilamentReporter,
    Filaments,
    FilamentType,
    Hand,
    InputError,
    Joints,
    LinkerReporter,
    LinkerTable,
    Sphere,
    TensionReporter,
    TetherReporter,
    capsule_contact_force,
    constant_force,
    constant_tension,
    contact_force,
    contact_forces,
    crossing_barrier,
    effective_rate,
    excluded_pairs,
    filament_wall_force,
    random_points_on,
    recommended_time_step,
    share_exclusions,
    theory,
    time_step_bounds,
    wall_force,
    wall_forces,
    write_psf,
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
    with pytest.raises(InputError, match=r"up to 1e\+18 nm from the origin. Beyond 1e\+12 nm"):
        filaments.add_nodes(F_ACTIN, nodes + [0, 0, 1e18], planar=planar)
    with pytest.raises(InputError, match=r"positions must be between 1e-60 and 1e\+60 in .*, but is 1e\+200"):
        filaments.add_nodes(F_ACTIN, nodes + [0, 0, 1e200], planar=planar)
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
    message = rf"{name}.* must be between 1e-[36]0 and 1e\+[36]0 in OpenMM's units, but is {re.escape(f'{value:g}')}\."
    with pytest.raises(InputError, match=message):
        dataclasses.replace(F_ACTIN, **{name: value})


def test_a_filament_type_without_mass():
    with pytest.raises(InputError, match="mass_per_length must be given"):
        dataclasses.replace(F_ACTIN, mass_per_length=None)
    assert FilamentType(
        name="X", diameter=7.0, segment_length=100.0, bending_rigidity=0.0, stretching_modulus=1e3
    ).mass_per_length == pytest.approx(3500.0)


RATES = {"binding_rate": 1e-11, "reach": 60.0, "unbinding_rate": 1e-12}
HAND = Hand(**RATES)
LINKER = Crosslinker(hands=HAND, stiffness=0.1)


def _new():
    filaments = Filaments(602.0, 300.0, engine="compiled")
    for y in (0.0, 500.0):
        filaments.add_straight(F_ACTIN, 3, (0, y, 0), (1, 0, 0))
    return filaments


def _built():
    filaments = _new()
    return filaments, filaments.build()[1]


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (
            lambda f, s: Filaments(602.0, 300.0).add_straight(F_ACTIN, 10**400, (0, 0, 0), (1, 0, 0)),
            "segments must be at most",
        ),
        (
            lambda f, s: Filaments(602.0, 300.0).add_nodes(F_ACTIN, np.eye(3), closed=np.array([])),
            "closed must be True or False",
        ),
        (
            lambda f, s: Filaments(602.0, 300.0).add_linkers(LINKER, 5, seed=1 * unit.nanometer),
            "seed must be a whole number",
        ),
        (lambda f, s: _new().add_linkers(LINKER, 5, seed=-1), "seed must be at least 0"),
        (lambda f, s: f.create_integrator(None, 1.0), "system must be an object of the class System"),
        (lambda f, s: f.create_integrator(s, 1.0, scheme=np.array([])), "scheme must be one of"),
        (lambda f, s: f.create_integrator(s, 1.0, precision=np.array([])), "precision must be one of"),
        (lambda f, s: f.create_integrator(s, 1.0, checks=None), "checks must be True or False"),
        (lambda f, s: f.create_integrator(s, 1e-300), "must be between 1e-60 and"),
        (lambda f, s: f.chain_set(openmm.System()), "too few particles"),
        (lambda f, s: f.in_context(None), "context must be an object of the class Context"),
        (lambda f, s: _new().add_to(None, s, np.zeros((8, 3))), "topology must be a Topology"),
        (lambda f, s: Hand(**RATES, at_end=np.array([])), "at_end must be one of release"),
        (lambda f, s: HAND.binds(None), "filament_type must be an object"),
        (lambda f, s: Crosslinker(hands=HAND, stiffness=1.0, name=None), "name must be an object of the class str"),
        (lambda f, s: Crosslinker(hands=HAND, stiffness=1.0, same_filament=2), "same_filament must be True or False"),
        (lambda f, s: LINKER.energy_at_reach(None, 300.0), "hand must be an object of the class Hand"),
        (lambda f, s: Sphere((0, 0, 0), 1.0).square_depth([1, [2]]), "positions must be a number or an array"),
        (lambda f, s: Box((0, 0, 0), (1, 1, 1)).square_depth([1, 2]), "positions must have the shape"),
        (lambda f, s: random_points_on(Sphere((0, 0, 0), 1.0), 10**9), "count must be at most 1e"),
        (lambda f, s: random_points_on(Sphere((0, 0, 0), 1.0), 3, -1), "seed must be at least 0"),
        (lambda f, s: Crosslinks(1.0, 1.0).add(None, 0, [1, [2]]), "A place must be a particle"),
        (lambda f, s: Crosslinks(1.0, 1.0).remove(None, [1, [2]]), "must be a whole number"),
        (lambda f, s: Crosslinks(1.0, 1.0).remove(None, 2**40), "numbers are below"),
        (lambda f, s: Crosslinks(1.0, 1.0).add_to(None), "system must be an object of the class System"),
        (lambda f, s: Crosslinks(1.0, 1.0).add_to(s, periodic="no"), "periodic must be True or False"),
        (lambda f, s: CrosslinkTable(**{**COLUMNS, "pairs": 1}), "pairs of a table of crosslinks must be an array"),
        (lambda f, s: CrosslinkTable(**COLUMNS, active=3), "active of a table of crosslinks must be"),
        (lambda f, s: CrosslinkTable(**{**COLUMNS, "numbers": [10**400]}), "must be an array of numbers"),
        (lambda f, s: Joints(1.0).add_to(None), "system must be an object of the class System"),
        (lambda f, s: LinkerTable(None, [], [], [], [], 0), "LinkerTable: numbers must be"),
        (lambda f, s: LinkerTable([0.5], [0], [-1], [[-1, -1]], [[0, 0]], 1), "LinkerTable: numbers must be whole"),
        (lambda f, s: LinkerTable([0], [0], [-1], [[-1, -1]], [[0, 0]], np.nan), "next_number must be a whole number"),
        (lambda f, s: constant_force(None, (1, 0, 0)), "particles must be a sequence of whole numbers"),
        (lambda f, s: constant_tension("abc", 1.0, (1, 0, 0)), "must be a Filaments object"),
        (lambda f, s: constant_tension(f, 1.0, (1, 0, 0), 1.5), "numbers must be a sequence of whole numbers"),
        (lambda f, s: ConstantVelocityPulling(None, 1, None, 0, (1, 0, 0)), "must be a Filaments object"),
        (lambda f, s: capsule_contact_force(None, s, 10.0), "must be a Filaments object"),
        (lambda f, s: capsule_contact_force(f, None, 10.0), "system must be an object of the class System"),
        (lambda f, s: contact_force(None, s, 10.0), "must be a Filaments object"),
        (lambda f, s: excluded_pairs("", 1.0), "must be a Filaments object"),
        (lambda f, s: share_exclusions(None), "system must be an object of the class System"),
        (lambda f, s: wall_force(Sphere((0, 0, 0), 1.0), 1.0, "abc"), "particles must be a sequence of whole numbers"),
        (lambda f, s: filament_wall_force(None, s, Sphere((0, 0, 0), 99.0), 1.0), "must be a Filaments object"),
        (lambda f, s: wall_forces(None), "context must be an object of the class Context"),
        (lambda f, s: contact_forces(None), "context must be an object of the class Context"),
        (lambda f, s: crossing_barrier(1e30, 1.0, 1.0), "spacing is 1 nm, which is too small"),
        (lambda f, s: effective_rate(1.0, "implicit", 0.0), "rate must be positive"),
        (lambda f, s: effective_rate(1.0, "implicit", [1.0]), "rate must be a single number"),
        (lambda f, s: time_step_bounds(F_ACTIN, 602.0, 300.0, confidence=0.0), "confidence must be positive"),
        (lambda f, s: recommended_time_step(None, 602.0, 300.0), "filament_type must be an object"),
        (lambda f, s: recommended_time_step(F_ACTIN, 602.0, 300.0, flow=3), "flow must be a Flow"),
        (lambda f, s: recommended_time_step(F_ACTIN, 602.0, 300.0, friction=3), "friction must be an object"),
        (lambda f, s: theory.bending_energy_mean(None, 300.0), "filament_type must be an object"),
        (lambda f, s: theory.bead_spring_mean_lengths(DSDNA_BASE_PAIRS, 10**10, 300.0), "bonds must be at most"),
        (lambda f, s: theory.bead_spring_mean_lengths(DSDNA_BASE_PAIRS, 4, 300.0, None), "planar must be True or"),
        (lambda f, s: write_psf(app.Topology(), "none.psf", system=3), "system must be an object of the class System"),
    ],
)
def test_wrong_calls_are_refused_in_words(call, message):
    with pytest.raises(InputError, match=message):
        call(*_built())
