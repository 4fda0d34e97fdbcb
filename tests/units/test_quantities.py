"""Input with and without units."""

import math

import numpy as np
import pytest
from openmm import Vec3, unit

from openmm_cylchain import InputError
from openmm_cylchain.units import quantities
from openmm_cylchain.units.quantities import in_units_of, non_negative, positive, thermal_energy, whole_number

# 1 pN nm = 1e-21 J; times 6.02214076e23 per mole, divided by 1000 J per kJ.
KJ_PER_MOLE_IN_ONE_PN_NM = 0.602214076

PICONEWTON = unit.piconewton
PASCAL_SECOND = unit.pascal * unit.second


@pytest.mark.parametrize("value", [3, 3.0, np.float32(3.0), np.int64(3), np.array(3.0)])
def test_plain_number_is_taken_as_it_is(value):
    result = in_units_of(value, quantities.LENGTH, "length")
    assert type(result) is float
    assert result == 3.0


def test_plain_array_keeps_its_shape():
    result = in_units_of([[1, 2, 3], [4, 5, 6]], quantities.LENGTH, "positions")
    assert result.dtype == float
    assert result.shape == (2, 3)


@pytest.mark.parametrize(
    "value, target, expected",
    [
        (1.5 * unit.micrometer, quantities.LENGTH, 1500.0),
        (20 * unit.angstrom, quantities.LENGTH, 2.0),
        (0.1 * unit.microsecond, quantities.TIME, 1e5),
        (1 * unit.kilocalorie_per_mole, quantities.ENERGY, 4.184),
        (2 * unit.kilojoule_per_mole / unit.angstrom**2, quantities.STIFFNESS, 200.0),
        (1.26e6 * unit.dalton, quantities.MASS, 1.26e6),
        (310 * unit.kelvin, quantities.TEMPERATURE, 310.0),
        (7 * unit.dimensionless, quantities.DIMENSIONLESS, 7.0),
    ],
)
def test_quantity_is_converted(value, target, expected):
    assert in_units_of(value, target, "value") == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize(
    "value, target, expected",
    [
        (4.28 * PICONEWTON * unit.nanometer, quantities.ENERGY, 4.28 * KJ_PER_MOLE_IN_ONE_PN_NM),
        (48.7 * PICONEWTON / unit.nanometer, quantities.STIFFNESS, 48.7 * KJ_PER_MOLE_IN_ONE_PN_NM),
        (48.7e-3 * unit.newton / unit.meter, quantities.STIFFNESS, 48.7 * KJ_PER_MOLE_IN_ONE_PN_NM),
        (1100 * PICONEWTON, quantities.FORCE, 1100 * KJ_PER_MOLE_IN_ONE_PN_NM),
        # 1 Pa s = 1 pN us/nm^2 = 1e6 pN nm ps/nm^3
        (1 * PASCAL_SECOND, quantities.VISCOSITY, 1e6 * KJ_PER_MOLE_IN_ONE_PN_NM),
        (
            1.71e-3 * PICONEWTON * unit.microsecond / unit.nanometer**2,
            quantities.VISCOSITY,
            1710 * KJ_PER_MOLE_IN_ONE_PN_NM,
        ),
        (1 * PICONEWTON * unit.microsecond / unit.nanometer, quantities.FRICTION, 1e6 * KJ_PER_MOLE_IN_ONE_PN_NM),
        (
            1 * PICONEWTON * unit.microsecond * unit.nanometer,
            quantities.ROTATIONAL_FRICTION,
            1e6 * KJ_PER_MOLE_IN_ONE_PN_NM,
        ),
        # 2.2e-23 N m^2 = 2.2e7 pN nm^2
        (2.2e-23 * unit.newton * unit.meter**2, quantities.BENDING_RIGIDITY, 2.2e7 * KJ_PER_MOLE_IN_ONE_PN_NM),
    ],
)
def test_quantity_per_particle_becomes_one_per_mole(value, target, expected):
    assert in_units_of(value, target, "value") == pytest.approx(expected, rel=1e-12)


def test_molar_and_per_particle_input_agree():
    molar = in_units_of(29.3 * unit.kilojoule_per_mole, quantities.ENERGY, "energy")
    single = in_units_of(29.3e3 / 6.02214076e23 * unit.joule, quantities.ENERGY, "energy")
    assert single == pytest.approx(molar, rel=1e-12)


@pytest.mark.parametrize(
    "value",
    [
        [1 * unit.micrometer, 2 * unit.micrometer, 3 * unit.micrometer],
        (1 * unit.micrometer, 2000 * unit.nanometer, 30000 * unit.angstrom),
        [1 * unit.micrometer, 2000, 3000.0],
        np.array([1.0, 2.0, 3.0]) * unit.micrometer,
        [1.0, 2.0, 3.0] * unit.micrometer,
        Vec3(1.0, 2.0, 3.0) * unit.micrometer,
    ],
)
def test_collections_of_quantities(value):
    np.testing.assert_allclose(in_units_of(value, quantities.LENGTH, "start"), [1000.0, 2000.0, 3000.0], rtol=1e-12)


@pytest.mark.parametrize(
    "value",
    [
        [Vec3(1.0, 2.0, 3.0), Vec3(4.0, 5.0, 6.0)] * unit.nanometer,
        [Vec3(1.0, 2.0, 3.0) * unit.nanometer, Vec3(4.0, 5.0, 6.0) * unit.nanometer],
        [Vec3(1.0, 2.0, 3.0), Vec3(4.0, 5.0, 6.0)],
    ],
)
def test_lists_of_vectors(value):
    result = in_units_of(value, quantities.LENGTH, "positions")
    np.testing.assert_allclose(result, [[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]], rtol=1e-15)


def test_array_of_per_particle_quantities():
    result = in_units_of(np.array([1.0, 2.0]) * PICONEWTON, quantities.FORCE, "force")
    np.testing.assert_allclose(result, np.array([1.0, 2.0]) * KJ_PER_MOLE_IN_ONE_PN_NM, rtol=1e-12)


@pytest.mark.parametrize(
    "value, target",
    [
        (1 * unit.second, quantities.LENGTH),
        (1 * unit.nanometer, quantities.STIFFNESS),
        (1 * PICONEWTON, quantities.ENERGY),
        (1 * unit.pascal, quantities.VISCOSITY),
        (1 * unit.kelvin, quantities.ENERGY),
        (1 * unit.nanometer, quantities.DIMENSIONLESS),
        ([1 * unit.second, 2.0, 3.0], quantities.LENGTH),
    ],
)
def test_wrong_unit_names_the_quantity_and_both_units(value, target):
    with pytest.raises(InputError, match="my quantity has the unit .* cannot be converted to"):
        in_units_of(value, target, "my quantity")


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf, [1.0, math.nan], math.nan * unit.nanometer])
def test_not_finite(value):
    with pytest.raises(InputError, match="my length must be finite"):
        in_units_of(value, quantities.LENGTH, "my length")


@pytest.mark.parametrize(
    "value",
    [
        None,
        [1.0, None],
        "long",
        "1.5",
        True,
        [1.0, "2"],
        [True, False],
        {"a": 1},
        object(),
        [[1, 2], [3]],
        1j,
        np.array([1j]),
    ],
)
def test_not_a_number(value):
    with pytest.raises(InputError, match="my length"):
        in_units_of(value, quantities.LENGTH, "my length")


@pytest.mark.parametrize("check", [positive, non_negative])
@pytest.mark.parametrize("value", [[1.0], [1.0, 2.0], np.ones((2, 2)), [1.0, 2.0] * unit.nanometer])
def test_single_number_is_asked_for(check, value):
    with pytest.raises(InputError, match="my length must be a single number, but has the shape"):
        check(value, quantities.LENGTH, "my length")


@pytest.mark.parametrize("value", [0, 0.0, -1, -1e-300, -1 * unit.nanometer])
def test_positive_refuses_zero_and_below(value):
    with pytest.raises(InputError, match="my length must be positive, but is"):
        positive(value, quantities.LENGTH, "my length")


def test_non_negative():
    assert non_negative(0 * unit.kelvin, quantities.TEMPERATURE, "temperature") == 0.0
    with pytest.raises(InputError, match="my temperature cannot be negative, but is -1"):
        non_negative(-1, quantities.TEMPERATURE, "my temperature")


@pytest.mark.parametrize("value", [2, 2.0, np.int32(2), np.int64(2), np.float64(2.0)])
def test_whole_number(value):
    result = whole_number(value, 1, "segments")
    assert type(result) is int
    assert result == 2


@pytest.mark.parametrize("value", [2.5, math.nan, math.inf, True, "2", None, [2], 2 * unit.nanometer, 2 + 0j])
def test_not_a_whole_number(value):
    with pytest.raises(InputError, match="segments must be a whole number"):
        whole_number(value, 1, "segments")


def test_whole_number_below_the_minimum():
    with pytest.raises(InputError, match="segments must be at least 1, but is 0"):
        whole_number(0, 1, "segments")


def test_thermal_energy():
    # k_B = 1.380649e-23 J/K and N_A = 6.02214076e23 are exact since 2019; Table 2 of Pesek et al. has 4.28 pN nm.
    assert thermal_energy(310) == pytest.approx(1.380649e-23 * 6.02214076e23 * 310 / 1000, rel=1e-9)
    assert thermal_energy(310 * unit.kelvin) / KJ_PER_MOLE_IN_ONE_PN_NM == pytest.approx(4.28, abs=0.005)
    assert thermal_energy(0) == 0.0
    with pytest.raises(InputError, match="temperature cannot be negative"):
        thermal_energy(-1)
