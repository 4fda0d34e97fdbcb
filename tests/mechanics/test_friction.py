"""Friction of one segment against numbers worked out by hand from Pesek et al. 2016."""

import math

import numpy as np
import pytest
from openmm import unit

from openmm_cylchain import F_ACTIN, InputError, SegmentFriction, stokes_friction
from openmm_cylchain.mechanics import friction as module
from openmm_cylchain.mechanics.redistribution import ChainSet, thermal_forces
from openmm_cylchain.units.quantities import thermal_energy

PN_NM = 0.602214076  # kJ/mol
PN_US_PER_NM = 1e6 * PN_NM  # kJ ps/(mol nm^2)
PN_US_NM = 1e6 * PN_NM  # kJ ps/mol
VISCOSITY = 1.71e-3 * unit.piconewton * unit.microsecond / unit.nanometer**2
TEMPERATURE = 310 * unit.kelvin


def thermal_torque(friction, temperature):
    """Of the forces on the ends of one segment, 2 nm long."""
    coefficients = friction.parallel, friction.perpendicular, friction.rotational, friction.extensional
    segment = ChainSet(np.array([2]), *(np.array([one]) for one in coefficients), fixed=np.zeros(2, dtype=bool))
    _, force = thermal_forces(segment, np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 2.0]]), thermal_energy(temperature))
    return 2.0 * force[0, 2]


@pytest.fixture(scope="module")
def actin():
    return F_ACTIN.segment_friction(VISCOSITY, TEMPERATURE)


def test_translation_and_rotation_of_table_2(actin):
    # ln(360/6) = 4.0943446. With eta = 1.71e-3 pN us/nm^2:
    # 2 pi eta 360/3.9803446, 4 pi eta 360/4.9803446 and pi eta 360^3/(3*3.6473446), in pN us/nm and pN us nm.
    assert actin.parallel / PN_US_PER_NM == pytest.approx(0.971757, rel=1e-5)
    assert actin.perpendicular / PN_US_PER_NM == pytest.approx(1.553275, rel=1e-5)
    assert actin.rotational / PN_US_NM == pytest.approx(22906.2, rel=1e-5)


def test_extension_of_table_2(actin):
    # tau (k l0^2 - 4 k_B T) = 0.1 us * (48.7*360^2 - 4*4.28) pN nm = 0.1*(6311520 - 17.12)
    assert actin.extensional / PN_US_NM == pytest.approx(631150.3, rel=1e-6)


@pytest.mark.parametrize(
    "length, diameter, viscosity", [(100.0, 10.0, 602.0), (2400.0, 6.0, 1029.8), (40.0, 25.0, 1.0)]
)
def test_equation_6(length, diameter, viscosity):
    ratio = math.log(length) - math.log(diameter)
    assert module.translational_friction_parallel(length, diameter, viscosity) == pytest.approx(
        6.283185307 * viscosity * length / (ratio - 0.114), rel=1e-9
    )
    assert module.translational_friction_perpendicular(length, diameter, viscosity) == pytest.approx(
        12.566370614 * viscosity * length / (ratio + 0.886), rel=1e-9
    )
    assert module.rotational_friction(length, diameter, viscosity) == pytest.approx(
        1.0471975512 * viscosity * length**3 / (ratio - 0.447), rel=1e-9
    )


def test_other_end_corrections():
    # With corrections of zero and ln(L/d) = 1 only the prefactors are left.
    diameter, viscosity = 10.0, 2.0
    length = diameter * math.e
    assert module.translational_friction_parallel(length, diameter, viscosity, 0.0) == pytest.approx(
        2 * math.pi * viscosity * length
    )
    assert module.translational_friction_perpendicular(length, diameter, viscosity, 0.0) == pytest.approx(
        4 * math.pi * viscosity * length
    )
    assert module.rotational_friction(length, diameter, viscosity, 0.0) == pytest.approx(
        math.pi * viscosity * length**3 / 3
    )


def test_logarithm_length():
    own = module.translational_friction_parallel(100.0, 5.0, 1.0)
    whole = module.translational_friction_parallel(100.0, 5.0, 1.0, logarithm_length=2000.0)
    assert whole / own == pytest.approx((math.log(20) - 0.114) / (math.log(400) - 0.114), rel=1e-12)


def test_friction_is_proportional_to_viscosity():
    thin, thick = (F_ACTIN.segment_friction(eta, TEMPERATURE) for eta in (1.0, 7.0))
    for name in ("parallel", "perpendicular", "rotational"):
        assert getattr(thick, name) == pytest.approx(7 * getattr(thin, name), rel=1e-14)
    assert thick.extensional == thin.extensional


@pytest.mark.parametrize(
    "function, correction, direction",
    [
        (module.translational_friction_parallel, -0.114, "parallel"),
        (module.translational_friction_perpendicular, 0.886, "perpendicular"),
        (module.rotational_friction, -0.447, "rotational"),
    ],
)
def test_segment_too_short(function, correction, direction):
    shortest = 6.0 * math.exp(-correction)
    with pytest.raises(InputError, match=f"{direction} friction .* above {shortest:.4g} nm for a diameter of 6 nm"):
        function(0.999 * shortest, 6.0, 1.0)
    assert function(1.001 * shortest, 6.0, 1.0) > 0
    with pytest.raises(InputError, match="Use longer segments"):
        function(100.0, 6.0, 1.0, logarithm_length=0.999 * shortest)


@pytest.mark.parametrize("arguments", [(0.0, 6.0, 1.0), (100.0, -6.0, 1.0), (100.0, 6.0, 0.0), (math.nan, 6.0, 1.0)])
def test_bad_cylinders(arguments):
    for function in (
        module.translational_friction_parallel,
        module.translational_friction_perpendicular,
        module.rotational_friction,
    ):
        with pytest.raises(InputError, match="length|diameter|viscosity"):
            function(*arguments)


def test_rotational_relaxation_time(actin):
    # The paper's theoretical value below (29)
    assert module.rotational_relaxation_time(actin, TEMPERATURE) / 1e9 == pytest.approx(2.676, abs=0.0005)
    with pytest.raises(InputError, match="infinite at zero temperature"):
        module.rotational_relaxation_time(actin, 0)


def test_momentum_relaxation_times(actin):
    # Section 5 prints 2.15, 1.35, 0.33 and 0.04 ps with M = 1.26 MDa, but labels the first two the wrong way round
    # (friction is higher across the axis, so the time is shorter), and (51) gives 0.986 ps for rotation.
    times = module.momentum_relaxation_times(actin, 1.26e6 * unit.dalton, 360 * unit.nanometer)
    assert times["parallel"] == pytest.approx(2.15, abs=0.005)
    assert times["perpendicular"] == pytest.approx(1.35, abs=0.005)
    assert times["rotational"] == pytest.approx(0.986, abs=0.001)
    assert times["extensional"] == pytest.approx(0.036, abs=0.0005)
    by_type = module.momentum_relaxation_times(actin, F_ACTIN.segment_mass, F_ACTIN.segment_length)
    assert by_type == pytest.approx(times, rel=1e-12)


def test_extensional_friction_and_its_inverse():
    # tau (k l0^2 - 4 k_B T) = 100*(3*10^2 - 4*2.494339) with k_B T = 8.31446262e-3*300
    gamma = module.extensional_friction(100.0, 3.0, 10.0, 300.0)
    assert gamma == pytest.approx(100.0 * (300.0 - 9.97735514), rel=1e-8)
    friction = SegmentFriction(parallel=1.0, perpendicular=1.0, rotational=1.0, extensional=gamma)
    assert module.extension_relaxation_time(friction, 3.0, 10.0, 300.0) == pytest.approx(100.0, rel=1e-14)


@pytest.mark.parametrize("temperature", [3.0 / 8.31446261815e-3 / 4 * 1.0001, 1e4])
def test_spring_softer_than_four_kT(temperature):
    with pytest.raises(InputError, match="k\\*l0\\^2 > 4 k_B T"):
        module.extensional_friction(1.0, 3.0, 1.0, temperature)
    with pytest.raises(InputError, match="k\\*l0\\^2 > 4 k_B T"):
        module.extension_relaxation_time(SegmentFriction(1.0, 1.0, 1.0, 1.0), 3.0, 1.0, temperature)


def test_thermal_torque(actin):
    # 2 k_B T (2 - gamma_def/gamma_rot) with gamma_def/gamma_rot = 631150.3/22906.2 = 27.5537
    expected = 2 * 4.28 * (2 - 27.5537)
    assert thermal_torque(actin, TEMPERATURE) / PN_NM == pytest.approx(expected, rel=1e-4)
    assert thermal_torque(actin, 0) == 0.0
    balanced = SegmentFriction(parallel=1.0, perpendicular=1.0, rotational=1.0, extensional=2.0)
    assert thermal_torque(balanced, 300) == 0.0


def test_thermal_torque_is_the_divergence_of_the_mobility_of_a_free_segment():
    # Forces f and -f on the ends change r = x+ - x- at the rate M f, M = l^2 gamma_dr^-1, and are a torque of T = l f.
    # The drift of r is k_B T div(M), here by finite differences; that of a torque T t is l T t/gamma_def.
    friction = SegmentFriction(parallel=1.0, perpendicular=2.0, rotational=5.0, extensional=3.0)
    kT = 8.31446262e-3 * 300

    def mobility(r):
        length = np.linalg.norm(r)
        axial = np.outer(r, r) / length**2
        return length**2 * (axial / friction.extensional + (np.eye(3) - axial) / friction.rotational)

    r = np.array([1.0, 2.0, -0.5])
    step = 1e-5
    divergence = sum(
        (mobility(r + step * axis) - mobility(r - step * axis))[:, index] / (2 * step)
        for index, axis in enumerate(np.eye(3))
    )
    torque = thermal_torque(friction, 300)
    np.testing.assert_allclose(torque * r / friction.extensional, kT * divergence, rtol=1e-8)


def test_affine_extensional_friction():
    # A rod whose parallel friction is spread evenly: integral of s^2 gamma/l ds from -l/2 to l/2
    positions = (np.arange(1000) + 0.5) / 1000 * 40.0 - 20.0
    assert module.affine_extensional_friction(3.0, 40.0) == pytest.approx(np.mean(3.0 * positions**2), rel=1e-5)


def test_stokes_friction():
    # A sphere of 1 um in water of 1 mPa s: 3 pi * 1e-3 Pa s * 1e-6 m = 9.424778e-9 kg/s, and 1 kg/s = 1e9 pN us/nm
    gamma = stokes_friction(1 * unit.micrometer, 1e-3 * unit.pascal * unit.second)
    assert gamma / PN_US_PER_NM == pytest.approx(9.424778, rel=1e-7)
    with pytest.raises(InputError, match="diameter must be positive"):
        stokes_friction(0, 1.0)
    with pytest.raises(InputError, match="viscosity has the unit"):
        stokes_friction(1.0, 1 * unit.pascal)
