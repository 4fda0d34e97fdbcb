"""Configurations: defaults, presets and their overrides, and a message for every mistake."""

import math

import pytest
from openmm import unit

from openmm_cylchain import (
    DSDNA,
    DSDNA_BASE_PAIRS,
    F_ACTIN,
    MICROTUBULE,
    EndCorrections,
    FilamentType,
    InputError,
    theory,
)
from openmm_cylchain.engine_choice import default_scheme
from openmm_cylchain.runs.configuration import changed_keys, parse_configuration, read_configuration
from openmm_cylchain.runs.run import create_simulation
from openmm_cylchain.time_steps.recommended_step import recommended_time_step
from support.repository import EXAMPLES

SOLVENT = '[solvent]\ntemperature = "310 K"\nviscosity = "1.71 mPa*s"\n'
FILAMENT = '[[filament]]\ntype = "F_ACTIN"\nsegments = 8\n'
SIMULATION = '[simulation]\ntime_step = "10 ns"\nduration = "20 us"\nreport_interval = "1 us"\n'

OWN_TYPE = """
[[filament]]
name = "OWN"
diameter = "6 nm"
segment_length = "200 nm"
bending_rigidity = "7e4 pN*nm^2"
stretching_modulus = "20 nN"
segments = 5
"""


def parse(solvent=SOLVENT, filament=FILAMENT, simulation=SIMULATION, top=""):
    return parse_configuration(top + solvent + filament + simulation)


def test_defaults():
    configuration = parse()
    group, settings = configuration.filaments[0], configuration.simulation
    assert configuration.title == ""
    assert group.type == F_ACTIN
    assert (group.count, group.start, group.position, group.direction, group.clamped) == (
        1,
        "equilibrium",
        None,
        None,
        (),
    )
    assert (settings.scheme, settings.seed, settings.platform, settings.precision) == (
        default_scheme(),
        1,
        "Reference",
        None,
    )
    assert (settings.time_step, settings.steps, settings.steps_per_report) == (1e4, 2000, 100)
    assert settings.steps_per_checkpoint == 1000


def test_every_entry_is_read():
    filament = FILAMENT + (
        'count = 3\nstart = "straight"\nposition = ["1 um", "0 nm", "-2 nm"]\ndirection = [0, 0, 2.5]\n'
        "clamped = [-1, 0]\n"
    )
    simulation = SIMULATION + (
        'scheme = "euler"\ncheckpoint_interval = "4 us"\nseed = 7\nplatform = "CPU"\nprecision = "mixed"\n'
    )
    configuration = parse(filament=filament, simulation=simulation, top='title = "a title"\n')
    group, settings = configuration.filaments[0], configuration.simulation
    assert configuration.title == "a title"
    assert (group.count, group.start, group.clamped) == (3, "straight", (0, 8))
    assert group.position == (1000.0, 0.0, -2.0)
    assert group.direction == (0.0, 0.0, 2.5)
    assert (settings.scheme, settings.seed, settings.platform, settings.precision) == ("euler", 7, "CPU", "mixed")
    assert settings.steps_per_checkpoint == 400


@pytest.mark.parametrize(("name", "preset"), [("DSDNA", DSDNA), ("MICROTUBULE", MICROTUBULE)])
def test_presets(name, preset):
    assert parse(filament=f'[[filament]]\ntype = "{name}"\nsegments = 2\n').filaments[0].type == preset


@pytest.mark.parametrize(
    ("entries", "expected"),
    [
        ('segment_length = "200 nm"', F_ACTIN.with_segment_length(200.0)),
        ('name = "X"\ndiameter = "8 nm"', {"name": "X", "diameter": 8.0}),
        ('bending_rigidity = "0 pN*nm^2"', {"bending_rigidity": 0.0, "temperature": None}),
        ('friction_length = "filament"', {"friction_length": "filament"}),
        ('friction_length = "1 um"', {"friction_length": 1000.0}),
        (
            'persistence_length = "10 um"',
            {"bending_rigidity": None, "persistence_length": 1e4, "temperature": 310.0},
        ),
        (
            'persistence_length = "10 um"\ntemperature = "293 K"',
            {"bending_rigidity": None, "persistence_length": 1e4, "temperature": 293.0},
        ),
        (
            'stretching_modulus = "10 nN"',
            {"stretching_stiffness": None, "stretching_modulus": 10 * unit.nanonewton},
        ),
        (
            'extensional_friction = "1e9 kJ*ps/mol"',
            {"extension_relaxation_time": None, "extensional_friction": 1e9},
        ),
        (
            'stretching_model = "fene"\nmaximum_extension = "20 nm"',
            {"stretching_model": "fene", "maximum_extension": 20},
        ),
        ("end_corrections = { parallel = -0.2 }", {"end_corrections": EndCorrections(parallel=-0.2)}),
        ('bending_model = "quadratic"', {"bending_model": "quadratic"}),
    ],
)
def test_properties_of_a_preset_can_be_changed(entries, expected):
    from dataclasses import replace

    read = parse(filament=FILAMENT + entries + "\n").filaments[0].type
    expected = expected if isinstance(expected, FilamentType) else replace(F_ACTIN, **expected)
    for name in vars(expected):
        value = getattr(expected, name)
        if isinstance(value, float):
            assert getattr(read, name) == pytest.approx(value, rel=1e-12), name
        else:
            assert getattr(read, name) == value, name


def test_stiffness_follows_the_modulus_of_a_preset_cut_into_other_segments():
    entries = 'type = "DSDNA"\nsegment_length = "4 nm"\nstretching_modulus = "500 pN"\nsegments = 2\n'
    read = parse(filament="[[filament]]\n" + entries).filaments[0].type
    assert read.segment_stiffness == pytest.approx(500 * 0.602214076 / 4.0)


def test_a_filament_type_of_ones_own():
    read = parse(filament=OWN_TYPE).filaments[0].type
    assert (read.name, read.diameter, read.segment_length) == ("OWN", 6.0, 200.0)
    assert read.segment_stiffness == pytest.approx(20e3 * 0.602214076 / 200.0)
    assert read.bending_rigidity == pytest.approx(7e4 * 0.602214076)


def test_recommended_time_step_divides_the_report_interval():
    simulation = SIMULATION.replace('"10 ns"', '"recommended"\nscheme = "midpoint"')
    assert parse(simulation=simulation).simulation.time_step == pytest.approx(1e4, rel=1e-3)
    # Of two types the more demanding one decides.
    settings = parse(filament=FILAMENT + OWN_TYPE, simulation=simulation).simulation
    assert settings.time_step < 2e3
    assert settings.time_step * settings.steps_per_report == pytest.approx(1e6, rel=1e-12)
    assert settings.steps == 20 * settings.steps_per_report


def test_intervals_may_carry_rounding_errors():
    simulation = '[simulation]\ntime_step = "0.1 ns"\nduration = "300 us"\nreport_interval = "0.7 ns"\n'
    with pytest.raises(InputError, match="duration is 300 us, which is not a whole multiple of report_interval"):
        parse(simulation=simulation)
    simulation = simulation.replace("300 us", "0.0021 ms")
    assert parse(simulation=simulation).simulation.steps_per_report == 7
    assert parse(simulation=simulation).simulation.steps == 21000


@pytest.mark.parametrize(
    ("parts", "fragments"),
    [
        ({"top": "x\n"}, ["not valid TOML", "line 1"]),
        ({"top": "title = 'a'\ntitle = 'b'\n"}, ["line 2: the key 'title' has come before in the same table"]),
        ({"solvent": SOLVENT + SOLVENT}, ["line 4: [solvent] has come before: give a table once"]),
        ({"filament": FILAMENT + FILAMENT.replace("[[filament]]", "[filament]")}, ["[filament] has come before"]),
        ({"top": "a = { b = 1, b = 2 }\n"}, ["line 1: the key 'b' stands twice between the same braces"]),
        ({"top": "temperature = 310\n"}, ["unknown key 'temperature'", "belongs to [solvent]"]),
        ({"filament": FILAMENT + "count = 1979-05-27\n"}, ["count must be a whole number, but is 1979-05-27."]),
        ({"filament": FILAMENT + "count = [true, {}]\n"}, ["count must be a whole number, but is [true, {}]."]),
        (
            {"filament": FILAMENT + FILAMENT.replace("[filament]", "[simulation.filament]")},
            ["'filament'. It is a table of its own: write [[filament]]."],
        ),
        (
            {"simulation": SIMULATION.replace('"10 ns"', '"1e-4 ps"')},
            ["report_interval makes 1e+10 steps from report to report"],
        ),
        ({"solvent": SOLVENT.replace("solvent", "solvents")}, ["unknown key 'solvents'", "Did you mean 'solvent'"]),
        ({"solvent": ""}, ["[solvent]", "lacks the key 'temperature'", '"310 K"']),
        ({"solvent": "solvent = 3\n"}, ["'solvent' must be a table"]),
        ({"solvent": SOLVENT.replace("310 K", "-3 K")}, ["[solvent] temperature", "positive"]),
        ({"solvent": SOLVENT.replace("310 K", "0 K")}, ["[solvent] temperature", "positive"]),
        ({"solvent": SOLVENT.replace("1.71 mPa*s", "1.71 mPa")}, ["[solvent] viscosity", "mPa", "1.71 mPa*s"]),
        ({"solvent": SOLVENT.replace("1.71", "nan")}, ["[solvent] viscosity must be finite"]),
        ({"solvent": SOLVENT.replace('"310 K"', "310")}, ["[solvent] temperature must be a text"]),
        ({"filament": ""}, ["no [[filament]] table"]),
        ({"filament": FILAMENT.replace("[[filament]]", "[filament]")}, ["list of tables", "two brackets"]),
        ({"filament": FILAMENT + "segment_lenght = 3\n"}, ["number 1", "Did you mean 'segment_length'"]),
        ({"filament": FILAMENT + 'duration = "3 ns"\n'}, ["number 1", "'duration'", "belongs to [simulation]"]),
        ({"filament": FILAMENT * 2 + 'start = "bent"\n'}, ["number 2: start", "equilibrium, straight", "'bent'"]),
        ({"filament": FILAMENT.replace("F_ACTIN", "ACTIN")}, ["number 1: type", "Did you mean 'F_ACTIN'"]),
        ({"filament": '[[filament]]\nsegments = 3\ndiameter = "3 nm"\n'}, ["lacks the key 'type'", "DSDNA"]),
        ({"filament": OWN_TYPE.replace('diameter = "6 nm"\n', "")}, ["number 1", "lacks the key 'diameter'"]),
        ({"filament": OWN_TYPE.replace('stretching_modulus = "20 nN"\n', "")}, ["number 1", "stretching_stiffness"]),
        ({"filament": OWN_TYPE.replace('"OWN"', '"TOOLONG"')}, ["number 1", "1 to 5 letters"]),
        ({"filament": OWN_TYPE.replace('"OWN"', "3")}, ["number 1: name must be a text"]),
        ({"filament": FILAMENT.replace("segments = 8\n", "")}, ["number 1", "lacks the key 'segments'"]),
        ({"filament": FILAMENT.replace("8", "0")}, ["number 1: segments must be at least 1"]),
        ({"filament": FILAMENT.replace("8", "8.5")}, ["number 1: segments must be a whole number"]),
        ({"filament": FILAMENT + "count = true\n"}, ["number 1: count must be a whole number"]),
        ({"filament": FILAMENT + "clamped = [9]\n"}, ["number 1: clamped node 9 does not exist", "there are 9 nodes"]),
        ({"filament": FILAMENT + "clamped = 3\n"}, ["number 1: clamped must be a list"]),
        ({"filament": FILAMENT.replace("8", "1") + "clamped = [0, 1]\n"}, ["all of its nodes clamped"]),
        ({"filament": FILAMENT + "direction = [0, 0, 0]\n"}, ["number 1: direction", "zero vector"]),
        ({"filament": FILAMENT + "direction = [1, nan, 0]\n"}, ["number 1: direction[1]", "finite"]),
        ({"filament": FILAMENT + 'position = ["0 nm", "0 nm"]\n'}, ["number 1: position", "list of three"]),
        ({"filament": FILAMENT + 'position = ["0 nm", "0 s", "0 nm"]\n'}, ["number 1: position[1]", "length"]),
        ({"filament": FILAMENT + 'segment_length = "4 nm"\n'}, ["number 1", "eq. (6)"]),
        ({"filament": FILAMENT + 'segment_length = "-4 nm"\n'}, ["number 1: segment_length must be positive"]),
        (
            {"filament": FILAMENT + 'stretching_modulus = "1 nN"\nstretching_stiffness = "1 pN/nm"\n'},
            ["number 1", "either stretching_stiffness"],
        ),
        ({"filament": FILAMENT + 'temperature = "300 K"\n'}, ["number 1", "temperature belongs to persistence_length"]),
        ({"filament": FILAMENT + "end_corrections = 3\n"}, ["end_corrections must be a table"]),
        ({"filament": FILAMENT + "end_corrections = { paralel = 1 }\n"}, ["'paralel'", "Did you mean 'parallel'"]),
        ({"simulation": SIMULATION + 'scheme = "middle"\n'}, ["[simulation] scheme", "euler, midpoint"]),
        ({"simulation": SIMULATION + 'platfrom = "CPU"\n'}, ["'platfrom'", "Did you mean 'platform'"]),
        ({"simulation": SIMULATION + "seed = 0\n"}, ["[simulation] seed must be at least 1"]),
        ({"simulation": SIMULATION + "seed = 2147483648\n"}, ["[simulation] seed must be below 2^31"]),
        ({"simulation": SIMULATION + 'checkpoint_interval = "1.5 us"\n'}, ["checkpoint_interval", '"1 us" or "2 us"']),
        ({"simulation": SIMULATION.replace("10 ns", "0.3 us")}, ["report_interval", '"900 ns" or "1.2 us"']),
        ({"simulation": SIMULATION.replace("10 ns", "2 us")}, ["report_interval", 'use "2 us"']),
        ({"simulation": SIMULATION.replace('"20 us"', '"0.5 us"')}, ["duration", 'use "1 us"']),
        ({"simulation": SIMULATION.replace('"10 ns"', '"fast"')}, ["[simulation] time_step", "number and a unit"]),
        ({"simulation": SIMULATION.replace('"10 ns"', "10")}, ["[simulation] time_step must be a text"]),
        ({"simulation": SIMULATION + 'precision = "half"\n'}, ["[simulation] precision", "single, mixed, double"]),
    ],
)
def test_mistakes_are_named(parts, fragments):
    with pytest.raises(InputError) as caught:
        parse(**parts)
    for fragment in fragments:
        assert fragment in str(caught.value)


def test_file_is_named_in_messages(tmp_path):
    path = tmp_path / "run.toml"
    with pytest.raises(InputError, match="run.toml cannot be read: No such file"):
        read_configuration(path)
    path.write_text("x")
    with pytest.raises(InputError, match="run.toml: not valid TOML"):
        read_configuration(path)
    path.write_bytes(b"\xff\xfe")
    with pytest.raises(InputError, match="run.toml is not UTF-8"):
        read_configuration(path)
    path.write_bytes((SOLVENT + FILAMENT + SIMULATION).replace("\n", "\r\n").encode())
    assert read_configuration(path) == parse()


def test_platforms_for_gpus_say_why_not():
    with pytest.raises(
        InputError, match=r"\[simulation\] platform: Filaments cannot be computed on the platform HIP here"
    ):
        create_simulation(parse(simulation=SIMULATION + 'platform = "HIP"\n'))
    with pytest.raises(InputError, match="platform must be one of those that OpenMM has loaded, .*'Vulkan'"):
        create_simulation(parse(simulation=SIMULATION + 'platform = "Vulkan"\n'))


def test_changes_are_named():
    assert changed_keys(parse(), parse(top="# a comment\n")) == []
    assert changed_keys(parse(), parse(top='title = "x"\n', simulation=SIMULATION + "seed = 3\n")) == [
        "title",
        "[simulation] seed",
    ]
    assert changed_keys(parse(), parse(filament=FILAMENT + "count = 2\n")) == ["[[filament]] number 1: count"]
    assert changed_keys(parse(), parse(filament=FILAMENT * 2)) == ["the number of [[filament]] tables"]


def test_example_is_the_filament_of_table_2():
    path = EXAMPLES / "f_actin.toml"
    configuration = read_configuration(path)
    group, settings = configuration.filaments[0], configuration.simulation
    assert group.type == F_ACTIN
    assert group.segments == 64
    solvent = configuration.solvent
    recommended = recommended_time_step(F_ACTIN, solvent.viscosity, solvent.temperature, segments=64)
    assert settings.time_step == pytest.approx(recommended.step, rel=0.05)
    assert math.isclose(configuration.solvent.viscosity, 1.71e-3 * 602214.076, rel_tol=1e-6)


BEADS = """
[[filament]]
name = "BSP"
diameter = "2 nm"
bead_spacing = "0.33 nm"
bead_friction = "1.91e-12 kg/s"
segments = 7
"""


def beads(lines="", filament=BEADS):
    return parse(filament=filament + lines).filaments[0].type


def test_chains_of_beads():
    preset = '[[filament]]\ntype = "DSDNA_BASE_PAIRS"\nsegments = 7\n'
    assert beads(filament=preset) == DSDNA_BASE_PAIRS
    assert beads("coarse_graining = 5\n", preset) == DSDNA_BASE_PAIRS.coarse_grained(5)
    changed = beads('persistence_length = "50 nm"\nbead_mass = "330 Da"\n', preset)
    assert changed.persistence_length_at(310.0) == pytest.approx(50.0)
    assert (changed.bead_mass, changed.stretching_modulus) == (330.0, DSDNA_BASE_PAIRS.stretching_modulus)
    described = beads('stretching_modulus = "1100 pN"\npersistence_length = "50 nm"\ntemperature = "296.15 K"\n')
    assert described.persistence_length_at(296.15) == pytest.approx(50.0)
    assert described.stretching_modulus == pytest.approx(1100 * 0.602214076)
    assert described.bead_friction == pytest.approx(DSDNA_BASE_PAIRS.bead_friction, rel=1e-3)
    reduced = beads("nu = 0.35\nreduced_temperature = 0.034\n")
    assert (reduced.nu, reduced.reduced_temperature(310.0)) == pytest.approx((0.35, 0.034))


@pytest.mark.parametrize(
    ("lines", "fragment"),
    [
        ("", "lacks the key 'stretching_modulus'"),
        ("nu = 0.35\n", "nu and reduced_temperature go together"),
        ("nu = 0.6\nreduced_temperature = 0.034\n", "nu of filament type 'BSP' must be below 1/2"),
        ('nu = 0.3\nreduced_temperature = 0.1\nstretching_modulus = "1 pN"\n', "stretching_modulus belongs to"),
        ('stretching_modulus = "1 pN"\nsegment_length = "1 nm"\n', "segment_length belongs to a chain of cylinders"),
        ('stretching_modulus = "1 pN"\nbending_model = "quadratic"\n', "bending_model belongs to a chain of cylinders"),
        ('stretching_modulus = "1 pN"\n', "either bending_rigidity or persistence_length"),
        ('stretching_modulus = "1 pN"\ntemperature = "300 K"\n', "temperature belongs to"),
        ("coarse_graining = 0\n", "coarse_graining must be at least 1"),
    ],
)
def test_mistakes_in_chains_of_beads_are_named(lines, fragment):
    with pytest.raises(InputError) as caught:
        beads(lines)
    assert fragment in str(caught.value)


def test_a_type_that_is_calibrated_up_to_a_force():
    lines = 'type = "DSDNA"\nsegment_length = "4 nm"\ncalibrated_up_to_force = "20 pN"\nsegments = 7\n'
    (kind,) = {one.type for one in parse(filament="[[filament]]\n" + lines).filaments}
    expected = theory.calibrated_up_to_force(DSDNA.with_segment_length(4.0), 20 * 0.602214076, 310.0)
    assert kind == expected and kind.contour_per_segment == 4.0 and kind.segment_length < 4.0
    for mistake in ("20 nm", "0 pN"):
        with pytest.raises(InputError, match="calibrated_up_to_force"):
            parse(filament="[[filament]]\n" + lines.replace("20 pN", mistake))
    with pytest.raises(InputError, match="calibrated_up_to_force belongs to a chain of cylinders"):
        beads('stretching_modulus = "1 pN"\ncalibrated_up_to_force = "20 pN"\n')


def test_cylinders_have_no_beads():
    with pytest.raises(InputError, match="bead_friction belongs to a chain of beads"):
        beads('bead_friction = "1e-12 kg/s"\n', FILAMENT)
