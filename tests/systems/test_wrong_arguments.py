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
    Attachment,
    Box,
    ConstantVelocityPulling,
    Crosslinker,
    CrosslinkReporter,
    Crosslinks,
    CrosslinkTable,
    EndCorrections,
    FilamentReporter,
    Filaments,
    FilamentType,
    Hand,
    InputError,
    Joints,
    LinkerReporter,
    LinkerTable,
    RunReporter,
    SegmentFriction,
    Sphere,
    TensionReporter,
    Tether,
    TetherReporter,
    TimeStep,
    analysis,
    capsule_contact_force,
    check_time_step,
    constant_force,
    constant_tension,
    contact_force,
    contact_forces,
    crossing_barrier,
    effective_rate,
    enable_platform,
    excluded_pairs,
    fene_steps,
    filament_wall_force,
    find_contacts,
    make_trajectory_whole,
    random_points_on,
    recommended_time_step,
    remove_jumps,
    scans,
    share_exclusions,
    stability_bounds,
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
BEAM = FilamentType(
    name="BEAM", diameter=7.0, segment_length=300.0, bending_rigidity=4e4, stretching_modulus=1e4, element="beam"
)
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
        (lambda f, s: f[2], "Filament 2 does not exist; there are 2"),
        (lambda f, s: f["0"], "The number of a filament must be a whole number, but is '0'"),
        (lambda f, s: _new().add_beads(0, 1e-6), r"Beads of filament 0: spacing is 1e-06 nm, .* at most 1e\+06"),
        (lambda f, s: _new().add_nodes(BEAM, np.zeros((3, 3))), "nodes 0 and 1 coincide"),
        (lambda f, s: _new().add_nodes(BEAM, [[0, 0, 0], [9, 0, 0], [0, 0, 0]]), "turn back at node 1"),
        (lambda f, s: EndCorrections(rotational=np.nan), "EndCorrections: rotational must be finite"),
        (lambda f, s: EndCorrections([0.1, 0.2]), "EndCorrections: parallel must be a single number"),
        (lambda f, s: SegmentFriction(1.0, np.nan, 1.0, 1.0), "SegmentFriction: perpendicular must be finite"),
        (lambda f, s: TimeStep(np.nan, "", {}), "TimeStep: step must be finite"),
        (lambda f, s: TimeStep(1.0, "", None), "TimeStep: bounds must be an object of the class dict"),
        (lambda f, s: Tether(0, 0, (0.0, np.nan, 0.0), 1.0), "Tether: point must be finite"),
        (lambda f, s: Attachment(0, 0, 2.0), "Attachment: fraction must be a number between 0 and 1"),
        (lambda f, s: dataclasses.replace(f[0], closed=None), "Filament: closed must be True or False"),
        (lambda f, s: F_ACTIN.segment_lengths(2**31), "segments must be at most 100000000"),
        (lambda f, s: F_ACTIN.bending_energy(2.0), "cosine must be between -1 and 1"),
        (lambda f, s: F_ACTIN.stretching_energy("a"), "length must be a number or an array"),
        (lambda f, s: F_ACTIN.draw_chain(3, 300.0, 1), "generator must be an object of the class Generator"),
        (lambda f, s: DSDNA_BASE_PAIRS.bending_energies(np.eye(3), [1.0]), r"stiffnesses must have the shape \(2,\)"),
        (lambda f, s: F_ACTIN.bending_energies(np.zeros((3, 3))), "vectors: segment 0 has no length"),
        (lambda f, s: Sphere((0, 0, 0), 1.0).depths(3.0), r"positions must have the shape \(..., 3\)"),
        (lambda f, s: FilamentReporter(None, 2**31, f), "reportInterval must be at most 2147483647"),
        (lambda f, s: FilamentReporter(None, 5, f, append=np.eye(2)), "append must be True or False"),
        (lambda f, s: FilamentReporter("/none/file.csv", 5, f), "/none, which is not a directory"),
        (lambda f, s: TensionReporter(None, 5, f, joints=None), "joints must be True or False"),
        (lambda f, s: TensionReporter(None, 5, f, mean=1), "mean must be True or False"),
        (lambda f, s: FilamentReporter(None, 5, f)[[]], r"There is no column \[\]"),
        (lambda f, s: RunReporter("run", 5, f, walls=None), "walls must be a sequence of Shapes"),
        (lambda f, s: RunReporter("run", 5, f, particle_diameters=np.eye(2)), "particle_diameters must have lengths"),
        (lambda f, s: write_psf(f.build, None), "topology must be an openmm.app.Topology"),
        (lambda f, s: write_psf(app.Topology(), None), "file must be a path, but is None"),
        (lambda f, s: make_trajectory_whole(None), "trajectory must be an mdtraj.Trajectory"),
        (lambda f, s: remove_jumps(app.Topology()), "trajectory must be an mdtraj.Trajectory"),
        (lambda f, s: Crosslinks.from_system(None), "system must be an object of the class System"),
        (lambda f, s: Crosslinks.of_force(None), "force must be an object of the class Force"),
        (lambda f, s: Crosslinks(1.0, 1.0).thermal_stiffness(3, 300.0), "table must be an object of the class Cross"),
        (lambda f, s: Crosslinks(1.0, 1.0).set_pairs(3, [[0, 1]]), "are not in a System yet"),
        (lambda f, s: Crosslinks(1.0, 1.0).set_pairs(None, "abc"), r"pairs must have the shape \(n, 2\)"),
        (lambda f, s: CrosslinkTable(**COLUMNS).switched([0], None), "active must be True or False"),
        (lambda f, s: CrosslinkTable(**COLUMNS).displacements([[0, 0, 0]]), "hold particle 1"),
        (lambda f, s: CrosslinkTable(**COLUMNS).displacements(np.eye(3), 3.0), "box must be three vectors"),
        (lambda f, s: CrosslinkTable(**COLUMNS).save(None), "file must be a path, but is None"),
        (lambda f, s: CrosslinkTable.load(__file__), "holds no table of crosslinks"),
        (lambda f, s: CrosslinkTable.load("/none/file.npz"), "file /none/file.npz does not exist"),
        (lambda f, s: capsule_contact_force(f, s, 9.0, excluded_neighbors=2**31), "excluded_neighbors must be at most"),
        (lambda f, s: find_contacts(None, None), "force must be one of capsule_contact_force"),
        (lambda f, s: fene_steps(F_ACTIN, F_ACTIN.segment_friction(602.0, 300.0), 300.0), "are those of 'fene'"),
        (lambda f, s: stability_bounds(None, 602.0, 300.0), "filament_type must be an object"),
        (lambda f, s: recommended_time_step(DSDNA_BASE_PAIRS, 602.0, np.nan), "temperature must be finite"),
        (lambda f, s: enable_platform([]), "platform must be one of OpenCL"),
        (lambda f, s: check_time_step(f, s, None, 1.0), "positions must be a number or an array"),
        (lambda f, s: check_time_step(f, s, np.zeros((8, 3)), 1.0), "filament 0: nodes 0 and 1 coincide"),
        (lambda f, s: theory.chain_mean_square_end_to_end(F_ACTIN, 10**9, 300.0), r"segments must be at most 1e\+07"),
        (lambda f, s: theory.chain_extension(F_ACTIN, 10**9, 1.0, 300.0), r"segments must be at most 1e\+05"),
        (lambda f, s: theory.chain_extension(F_ACTIN, 9, 1e9, 300.0), "too strongly aligned"),
        (lambda f, s: theory.wlc_relative_extension(1e12, 50.0, 300.0), "too strong for this sum"),
        (lambda f, s: theory.chain_mean_energies(None, 3, 300.0), "filament_type must be an object"),
        (lambda f, s: theory.mean_joint_cosine(F_ACTIN, 300.0, "no"), "planar must be True or False"),
        (lambda f, s: theory.wlc_tangent_correlation(1.0, 1.0, 3), "planar must be True or False"),
        (lambda f, s: theory.marko_siggia_extension(1e300, 50.0, 300.0), "force must be between"),
        (lambda f, s: theory.mean_orientation(1.0, None, 300.0), "friction must be an object"),
        (lambda f, s: theory.bead_spring_mode_variances(DSDNA_BASE_PAIRS, 4, "a", 300.0), "modes must be a sequence"),
        (lambda f, s: analysis.stress(None, 0), "run must be a Run, as analysis.load returns it"),
        (lambda f, s: analysis.load(None), "path must be a path, but is None"),
        (lambda f, s: analysis.order_parameter("a"), "vectors must be a number or an array"),
        (lambda f, s: analysis.find_crossings(3, np.eye(3), np.eye(3)), "chains must be int arrays"),
        (lambda f, s: analysis.statistics.autocorrelation(np.arange(9.0), [1, 2]), "mean must broadcast"),
        (lambda f, s: scans.read_scan([]), "path must be a path"),
    ],
)
def test_wrong_calls_are_refused_in_words(call, message):
    with pytest.raises(InputError, match=message):
        call(*_built())


def test_crosslinks_are_those_of_one_system():
    platform, contexts, owned = openmm.Platform.getPlatform("Reference"), [], []
    for _ in range(2):
        filaments, system = _built()
        links = Crosslinks(1.0, 1.0)
        links.add_to(system)
        contexts.append(openmm.Context(system, filaments.create_integrator(system, 1.0), platform))
        owned.append(links)
    owned[1].add(contexts[1], 0, 5)
    with pytest.raises(InputError, match="System that does not have these crosslinks. .* Crosslinks.from_system"):
        owned[0].table(contexts[1])
    assert len(Crosslinks.from_system(contexts[1].getSystem())[0].table(contexts[1])) == 1


def test_fene_forces_do_not_turn_beyond_the_largest_extension():
    kind = dataclasses.replace(F_ACTIN, stretching_model="fene", maximum_extension=30.0)
    forces = kind.stretching_derivative(kind.segment_length + np.array([-40.0, -30.0, 29.0, 30.0, 40.0]))
    np.testing.assert_array_equal(np.isinf(forces), [True, True, False, True, True])
    assert np.all(np.sign(forces) == [-1, -1, 1, 1, 1])
