"""Quantities as text with a unit: read, refused and written."""

import pytest

from openmm_cylchain import InputError
from openmm_cylchain.units.quantities import (
    BENDING_RIGIDITY,
    FORCE,
    LENGTH,
    MASS_PER_LENGTH,
    NUMBER_DENSITY,
    RATE,
    ROTATIONAL_FRICTION,
    STIFFNESS,
    TEMPERATURE,
    TIME,
    VELOCITY,
    VISCOSITY,
    VOLUME,
)
from openmm_cylchain.units.text import format_time, format_with_error, parse_quantity


@pytest.mark.parametrize(
    ("text", "dimension", "expected"),
    [
        ("310 K", TEMPERATURE, 310.0),
        ("36.85 degC", TEMPERATURE, 310.0),
        ("360 nm", LENGTH, 360.0),
        ("0.36um", LENGTH, 360.0),
        ("10 ns", TIME, 1e4),
        ("10 µs", TIME, 1e7),
        ("1.71 mPa*s", VISCOSITY, 1.71e-3 * 602214.076),
        ("1.71e-3 pN*us/nm^2", VISCOSITY, 1.71e-3 * 602214.076),
        ("1029.8 kJ*ps/mol/nm^3", VISCOSITY, 1029.8),
        ("10 1/s", RATE, 1e-11),
        ("10 Hz", RATE, 1e-11),
        ("6 hour^-1", RATE, 1e-12 / 600),
        ("-0.5 um/s", VELOCITY, -5e-10),
        ("2 um^3", VOLUME, 2e9),
        ("1 fL", VOLUME, 1e9),
        ("1 uM", NUMBER_DENSITY, 6.02214076e-7),
        ("1 mol/m^3", NUMBER_DENSITY, 6.02214076e-4),
        ("3 1/um^3", NUMBER_DENSITY, 3e-9),
        ("48.7 pN/nm", STIFFNESS, 48.7 * 0.602214076),
        ("48.7 mN/m", STIFFNESS, 48.7 * 0.602214076),
        ("2 kJ/mol/nm^2", STIFFNESS, 2.0),
        ("1 pN", FORCE, 0.602214076),
        ("1e-26 N*m^2", BENDING_RIGIDITY, 1e4 * 0.602214076),
        ("1 pN*nm*us", ROTATIONAL_FRICTION, 602214.076),
        ("3500 Da/nm", MASS_PER_LENGTH, 3500.0),
        ("3.5 kg/mol/nm", MASS_PER_LENGTH, 3500.0),
    ],
)
def test_quantities_are_converted(text, dimension, expected):
    assert parse_quantity(text, dimension, "x") == pytest.approx(expected, rel=1e-8)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (310, "must be a text"),
        (True, "must be a text"),
        ("", "must be a number and a unit"),
        ("nm", "must be a number and a unit"),
        ("360", "needs a unit"),
        ("nan nm", "must be finite"),
        ("inf nm", "must be finite"),
        ("1e999 nm", "must be finite"),
        ("1,71 nm", "cannot be read"),
        ("3,1 nm", "cannot be read"),
        ("3 1 nm", "cannot be read"),
        ("3 % nm", "cannot be read"),
        ("3\nnm", "must be a number and a unit"),
        ("3 nm\n", "must be a number and a unit"),
        ("1..5 nm", "cannot be read"),
        ("2 3 nm", "cannot be read"),
        ("3 parrots", "'parrots' is not defined"),
        ("3 ns", "not one of length"),
        ("3 nm/mol", "not one of length"),
        ("3 nm*(", "cannot be read"),
    ],
)
def test_bad_quantities_are_refused(text, message):
    with pytest.raises(InputError, match="^width") as caught:
        parse_quantity(text, LENGTH, "width")
    assert message in str(caught.value)
    assert '"360 nm"' in str(caught.value) or "finite" in message


def test_errors_have_two_digits():
    pairs = ((81.38, 11.7), (0.03922, 0.0412), (1882, 3.6), (5, 0.0), (4.308, 0.951), (1234.5, 320))
    said = ["81 ± 12", "0.039 ± 0.041", "1882.0 ± 3.6", "5 ± 0", "4.31 ± 0.95", "1234 ± 320"]
    assert [format_with_error(*pair) for pair in pairs] == said
    assert format_with_error(3.0, float("nan")) == "3 ± nan"


def test_times_are_written_with_a_unit_that_suits_them():
    assert [format_time(t) for t in (2e8, 1e4, 1.5e12, 999.9, 0.0)] == ["200 us", "10 ns", "1.5 s", "999.9 ps", "0 ps"]
