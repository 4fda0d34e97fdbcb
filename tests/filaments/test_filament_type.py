"""FilamentType: units, exclusive arguments, presets, other segment lengths, refusals."""

import copy
import dataclasses
import math
import pickle

import numpy as np
import pytest
from openmm import unit

from openmm_cylchain import DSDNA, F_ACTIN, MICROTUBULE, EndCorrections, FilamentType, InputError
from support.solvent import VISCOSITY

# 1 pN nm = 0.602214076 kJ/mol, so 1 pN/nm = 0.602214076 kJ/(mol nm^2) and so on.
PN_NM = 0.602214076
PICONEWTON = unit.piconewton
BASE = dict(name="ROD", diameter=5.0, segment_length=100.0, bending_rigidity=4e4, stretching_stiffness=3e4)


def variant(**changes):
    """A valid filament type with some arguments changed, or left out where the change is None."""
    arguments = {**BASE, **changes}
    return FilamentType(**{name: value for name, value in arguments.items() if value is not None})


def test_plain_numbers_are_in_units_of_openmm():
    rod = variant()
    assert (rod.diameter, rod.segment_length, rod.bending_rigidity) == (5.0, 100.0, 4e4)
    assert rod.segment_stiffness == 3e4
    assert rod.joint_stiffness == pytest.approx(400.0, rel=1e-15)
    assert rod.mass_per_length == 3500.0
    assert rod.segment_mass == 3.5e5


def test_quantities_and_plain_numbers_make_the_same_type():
    with_units = FilamentType(
        name="ROD",
        diameter=50 * unit.angstrom,
        segment_length=0.1 * unit.micrometer,
        bending_rigidity=4e4 * unit.kilojoule_per_mole * unit.nanometer,
        stretching_stiffness=3e4 / PN_NM * PICONEWTON / unit.nanometer,
    )
    for field in dataclasses.fields(FilamentType):
        expected, found = getattr(variant(), field.name), getattr(with_units, field.name)
        assert found == (pytest.approx(expected, rel=1e-12) if isinstance(expected, float) else expected)


def test_all_attributes_are_plain_floats():
    rod = variant(
        diameter=5,
        maximum_extension=10 * unit.nanometer,
        stretching_model="fene",
        extension_relaxation_time=1 * unit.nanosecond,
        mass_per_length=3500 * unit.dalton / unit.nanometer,
    )
    for name in ("diameter", "maximum_extension", "extension_relaxation_time", "mass_per_length", "bending_rigidity"):
        assert type(getattr(rod, name)) is float
    assert rod.extension_relaxation_time == pytest.approx(1000.0, rel=1e-12)


def test_persistence_length_with_its_temperature():
    rod = variant(bending_rigidity=None, persistence_length=17.2 * unit.micrometer, temperature=310 * unit.kelvin)
    # a = l_p k_B T with k_B T = 8.31446262e-3 * 310 kJ/mol
    assert rod.bending_rigidity == pytest.approx(17200 * 8.31446262e-3 * 310, rel=1e-8)
    assert rod.persistence_length_at(310) == pytest.approx(17200, rel=1e-12)
    assert rod.persistence_length_at(155 * unit.kelvin) == pytest.approx(34400, rel=1e-12)


def test_modulus_gives_stiffness():
    rod = variant(stretching_stiffness=None, stretching_modulus=1000 * PICONEWTON)
    assert rod.segment_stiffness == pytest.approx(1000 * PN_NM / 100, rel=1e-12)


def test_immutable():
    rod = variant()
    with pytest.raises(dataclasses.FrozenInstanceError):
        rod.diameter = 6.0
    with pytest.raises(dataclasses.FrozenInstanceError):
        del rod.diameter


def test_arguments_are_keywords():
    with pytest.raises(TypeError):
        FilamentType("ROD", 5.0, 100.0)


@pytest.mark.parametrize(
    "original", [variant(), F_ACTIN, DSDNA, MICROTUBULE, variant(end_corrections=EndCorrections())]
)
def test_copies_are_equal_and_hash_alike(original):
    for twin in (copy.copy(original), copy.deepcopy(original), pickle.loads(pickle.dumps(original))):
        assert twin == original
        assert hash(twin) == hash(original)
    assert dataclasses.replace(original) == original
    assert original.with_segment_length(original.segment_length) == original


def test_equality_sees_every_number():
    assert variant() == variant()
    assert variant() != variant(diameter=5.1)
    assert variant() != variant(bending_model="quadratic")
    assert len({variant(), variant(), variant(name="OTHER")}) == 2


def test_repr_shows_the_numbers():
    assert "diameter=5.0" in repr(variant())
    assert "bending_rigidity=40000.0" in repr(variant())


# Presets


def test_actin_is_that_of_table_2():
    assert F_ACTIN.diameter == 6.0
    assert F_ACTIN.segment_length == 360.0
    assert F_ACTIN.persistence_length_at(310) == pytest.approx(17200.0, rel=1e-12)
    # a = 17.2 um * 4.28 pN nm
    assert F_ACTIN.bending_rigidity / PN_NM == pytest.approx(17200 * 4.28, rel=1e-5)
    assert F_ACTIN.segment_stiffness / PN_NM == pytest.approx(48.7, rel=1e-12)
    assert F_ACTIN.extension_relaxation_time == pytest.approx(0.1e6, rel=1e-12)
    assert F_ACTIN.segment_mass == pytest.approx(1.26e6, rel=1e-12)
    assert F_ACTIN.end_corrections == EndCorrections(-0.114, 0.886, -0.447)
    assert (F_ACTIN.bending_model, F_ACTIN.stretching_model) == ("inscribed-circle", "harmonic")
    assert F_ACTIN.friction_length == "segment"


def test_dna_is_that_of_the_footnote():
    assert DSDNA.diameter == 2.0
    assert DSDNA.segment_length == 8.0
    assert DSDNA.persistence_length_at(310) == pytest.approx(43.3, rel=1e-12)
    assert DSDNA.stretching_modulus / PN_NM == pytest.approx(1100, rel=1e-12)
    assert DSDNA.segment_stiffness / PN_NM == pytest.approx(137.5, rel=1e-12)
    assert DSDNA.mass_per_length == pytest.approx(660 / 0.34, rel=1e-3)
    assert DSDNA.extension_relaxation_time is None


def test_microtubule_is_that_of_its_sources():
    assert MICROTUBULE.diameter == 25.0
    # EI = 2.2e-23 N m^2 is 2.2e7 pN nm^2 and l_p = 5.2 mm at 37 C.
    assert MICROTUBULE.bending_rigidity / PN_NM == pytest.approx(2.2e7, rel=1e-12)
    assert MICROTUBULE.persistence_length_at(310.15) == pytest.approx(5.2e6, rel=0.02)
    # Young's modulus 1.2 GPa = 1200 pN/nm^2 times a wall of 220 nm^2
    assert MICROTUBULE.stretching_modulus / PN_NM == pytest.approx(1200 * 220, rel=0.02)
    # 13 protofilaments of 100 kDa every 8 nm
    assert MICROTUBULE.mass_per_length == pytest.approx(13 * 100e3 / 8, rel=0.02)


# Other segment lengths


def test_segment_length_rescales_what_belongs_to_a_length():
    long = variant(
        stretching_stiffness=None,
        stretching_modulus=2e6,
        stretching_model="fene",
        maximum_extension=20.0,
        extensional_friction=5e8,
    )
    short = long.with_segment_length(0.05 * unit.micrometer)
    assert short.segment_length == 50.0
    assert short.segment_stiffness == pytest.approx(2 * long.segment_stiffness, rel=1e-15)
    assert short.joint_stiffness == pytest.approx(2 * long.joint_stiffness, rel=1e-15)
    assert short.maximum_extension == pytest.approx(10.0, rel=1e-15)
    assert short.extensional_friction == pytest.approx(5e8 / 8, rel=1e-15)
    assert short.segment_mass == pytest.approx(long.segment_mass / 2, rel=1e-15)
    for name in ("name", "diameter", "bending_rigidity", "stretching_modulus", "end_corrections", "mass_per_length"):
        assert getattr(short, name) == getattr(long, name)


def test_segment_length_leaves_what_was_given_for_one_segment():
    short = F_ACTIN.with_segment_length(60)
    assert short.segment_stiffness == F_ACTIN.segment_stiffness
    assert short.extension_relaxation_time == F_ACTIN.extension_relaxation_time
    assert (short.bending_rigidity, short.temperature) == (F_ACTIN.bending_rigidity, F_ACTIN.temperature)
    assert F_ACTIN.segment_length == 360.0


def test_new_segment_length_is_checked():
    with pytest.raises(InputError, match="'ACT'.*Use longer segments"):
        F_ACTIN.with_segment_length(8)
    with pytest.raises(InputError, match="segment_length of filament type 'ACT' must be positive"):
        F_ACTIN.with_segment_length(-100)


# Friction


def test_friction_of_filament_length_uses_it_in_the_logarithm_only():
    rod = variant(friction_length="filament")
    eta = 1000.0
    friction = rod.segment_friction(eta, 300, segments=20)
    logarithm = math.log(20 * 100.0 / 5.0)
    assert friction.parallel == pytest.approx(2 * math.pi * eta * 100 / (logarithm - 0.114), rel=1e-12)
    assert friction.perpendicular == pytest.approx(4 * math.pi * eta * 100 / (logarithm + 0.886), rel=1e-12)
    assert friction.rotational == pytest.approx(math.pi * eta * 100**3 / 3 / (logarithm - 0.447), rel=1e-12)
    assert friction.extensional == pytest.approx(friction.parallel * 100**2 / 12, rel=1e-12)
    assert rod.segment_friction(eta, 300, segments=1) == variant().segment_friction(eta, 300, segments=1)


def test_friction_of_segment_length_does_not_depend_on_the_number_of_segments():
    assert F_ACTIN.segment_friction(VISCOSITY, 310, 1) == F_ACTIN.segment_friction(VISCOSITY, 310, 64)


def test_friction_of_filament_length_allows_segments_that_eq_6_would_not():
    with pytest.raises(InputError, match="friction_length='filament'"):
        variant(segment_length=6.0)
    short = variant(segment_length=6.0, friction_length="filament")
    assert short.segment_friction(VISCOSITY, 310, segments=30).parallel > 0
    with pytest.raises(InputError, match="Use longer segments"):
        short.segment_friction(VISCOSITY, 310, segments=1)


def test_three_ways_to_the_extensional_friction():
    kT = 8.31446262e-3 * 310
    by_time = variant(extension_relaxation_time=100.0).segment_friction(1000.0, 310)
    assert by_time.extensional == pytest.approx(100.0 * (3e4 * 100**2 - 4 * kT), rel=1e-9)
    assert variant(extensional_friction=7e6).segment_friction(1000.0, 310).extensional == 7e6
    affine = variant().segment_friction(1000.0, 310)
    assert affine.extensional == pytest.approx(affine.parallel * 100**2 / 12, rel=1e-12)


# Energies


def test_energies_and_derivatives_are_of_one_segment_and_one_joint():
    rod = variant(bending_model="kratky-porod")
    assert rod.stretching_energy(np.array([101.0, 98.0])) == pytest.approx([1.5e4, 6e4], rel=1e-12)
    assert rod.stretching_derivative(98.0) == pytest.approx(-6e4, rel=1e-12)
    assert rod.bending_energy(0.5) == pytest.approx(200.0, rel=1e-12)
    assert rod.bending_derivative(np.array([0.5])) == pytest.approx([-400.0], rel=1e-12)


# Refusals: every message names the type and says what is expected.


@pytest.mark.parametrize("name", ["", "TOOLONG", "AB C", "A-B", "α", None, 5])
def test_names_that_no_file_format_would_hold(name):
    with pytest.raises(InputError, match="name of a filament type must be 1 to 5 letters or digits"):
        FilamentType(**{**BASE, "name": name})


POSITIVE = ("diameter", "segment_length", "stretching_stiffness", "mass_per_length")


@pytest.mark.parametrize("attribute", POSITIVE)
@pytest.mark.parametrize("value", [0, -1.0])
def test_not_positive(attribute, value):
    with pytest.raises(InputError, match=f"{attribute} of filament type 'ROD' must be positive, but is"):
        variant(**{attribute: value})


@pytest.mark.parametrize("attribute", [*POSITIVE, "bending_rigidity", "extensional_friction"])
@pytest.mark.parametrize("value", [math.nan, math.inf])
def test_not_finite(attribute, value):
    with pytest.raises(InputError, match=f"{attribute} of filament type 'ROD' must be finite"):
        variant(**{attribute: value})


@pytest.mark.parametrize(
    "attribute", [*POSITIVE, "bending_rigidity", "extensional_friction", "extension_relaxation_time"]
)
def test_wrong_unit(attribute):
    with pytest.raises(InputError, match=f"{attribute} of filament type 'ROD' has the unit kelvin"):
        variant(**{attribute: 1 * unit.kelvin})


@pytest.mark.parametrize("attribute", [*POSITIVE, "extensional_friction", "extension_relaxation_time"])
def test_not_a_single_number(attribute):
    with pytest.raises(InputError, match=f"{attribute} of filament type 'ROD' must be a single number"):
        variant(**{attribute: [100.0, 100.0]})


@pytest.mark.parametrize("attribute", ["diameter", "segment_length"])
def test_required(attribute):
    arguments = {name: value for name, value in BASE.items() if name != attribute}
    with pytest.raises(TypeError, match=attribute):
        FilamentType(**arguments)


@pytest.mark.parametrize(
    "changes, message",
    [
        (dict(bending_rigidity=None), "give either bending_rigidity or persistence_length"),
        (dict(persistence_length=100.0, temperature=300), "give either bending_rigidity or persistence_length"),
        (dict(bending_rigidity=None, persistence_length=100.0), "persistence_length needs the temperature"),
        (dict(bending_rigidity=-1.0), "bending_rigidity must be a single number that is not negative"),
        (dict(bending_rigidity=[1.0, 2.0]), "bending_rigidity must be a single number that is not negative"),
        (dict(bending_rigidity=None, persistence_length=-1.0, temperature=300), "must be positive"),
        (dict(bending_rigidity=None, persistence_length=1.0, temperature=0), "must be positive"),
        (dict(stretching_stiffness=None), "give either stretching_stiffness .* or stretching_modulus"),
        (dict(stretching_modulus=1e6), "give either stretching_stiffness .* or stretching_modulus"),
        (
            dict(extension_relaxation_time=1.0, extensional_friction=1.0),
            "give either extension_relaxation_time or extensional_friction, not both",
        ),
        (dict(bending_model="harmonic"), "bending_model must be one of .*inscribed-circle"),
        (dict(stretching_model="hooke"), "stretching_model must be one of harmonic, fene"),
        (dict(friction_length="chain"), "friction_length must be one of segment, filament, or a length"),
        (dict(stretching_model="fene"), "maximum_extension must be given for stretching_model 'fene'"),
        (dict(maximum_extension=10.0), "maximum_extension must be given for stretching_model 'fene', and only for it"),
        (dict(stretching_model="fene", maximum_extension=101.0), "maximum_extension must not exceed segment_length"),
        (dict(end_corrections=(-0.1, 0.9, -0.4)), "end_corrections must be an EndCorrections"),
        (dict(segment_length=7.0), "needs a length above .* nm for a diameter of 5 nm"),
    ],
)
def test_refused_with_the_name_of_the_type(changes, message):
    with pytest.raises(InputError, match=f"(?s)(?=.*'ROD').*{message}"):
        variant(**changes)


def test_end_correction_that_is_not_finite():
    with pytest.raises(InputError, match="EndCorrections: rotational must be finite"):
        variant(end_corrections=EndCorrections(rotational=math.nan))


@pytest.mark.parametrize("changes", [dict(bending_model=1), dict(stretching_model=True), dict(friction_length=[])])
def test_choices_of_the_wrong_kind(changes):
    with pytest.raises(InputError):
        variant(**changes)


def test_shortest_allowed_length_is_that_of_the_message():
    # The rotational logarithm vanishes first, at l = d exp(0.447).
    shortest = 5.0 * math.exp(0.447)
    with pytest.raises(InputError, match=f"rotational friction .* above {shortest:.4g} nm"):
        variant(segment_length=shortest * 0.999)
    variant(segment_length=shortest * 1.001)


def test_relaxation_time_of_a_spring_softer_than_kT():
    soft = variant(stretching_stiffness=1e-4, extension_relaxation_time=100.0)
    with pytest.raises(InputError, match="Give extensional_friction instead"):
        soft.segment_friction(VISCOSITY, 310)


@pytest.mark.parametrize("segments", [0, -1, 1.5])
def test_friction_of_no_segments(segments):
    with pytest.raises(InputError, match="segments must be"):
        F_ACTIN.segment_friction(VISCOSITY, 310, segments)
