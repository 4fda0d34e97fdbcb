"""Tables III, V and VI, units of time in Section VII B and the Appendix, and Fig. 5: beads of several base pairs.

Ours is what ``BeadSpringType.coarse_grained`` makes of the preset, the theory is (3) and (53) to (55), (70) and (A4)
once more, in pN, nm and ps.
"""

from dataclasses import replace

import numpy as np
from openmm import unit

from benchmark.measurement import Estimate
from openmm_cylchain import BeadSpringType
from openmm_cylchain.units.quantities import BOLTZMANN

from . import base_pairs, simulation, style
from .base_pairs import BASE_PAIRS, TEMPERATURE
from .case import Case, Outcome
from .page import format_number
from .result import ROUNDING, Result, Rule, printed

_TABLE_3 = {
    1: ("0.034", "0.35"),
    2: ("0.008", "0.1875"),
    5: ("0.002192", "0.0437956"),
    10: ("0.001024", "0.0117188"),
    12: ("0.000847", "0.00819672"),
    15: ("0.000673", "0.00527704"),
    20: ("0.000503", "0.00298211"),
}
_TABLE_5 = dict(zip(_TABLE_3, "1.54 13.09 119.434 511.327 741.622 1165.66 2081.9".split()))
_TABLE_6 = {
    1: ("0.000713", "0.030603", "0.00025"),
    2: ("0.001298", "0.008019", "0.00402"),
    5: ("0.003159", "0.001301", "0.15713"),
    10: ("0.006294", "0.000326", "2.51414"),
    20: ("0.012575", "8.14832e-5", "40.2263"),
    50: ("0.031428", "1.30391e-5", "1571.34"),
}
_OTHER = (120.0, 12000.0)
"""r and y to which Table III belongs from its second row on."""

_KILOGRAM_PER_SECOND = 1e15
"""In pN ps/nm."""
# In pN, nm and ps: the friction of (69) from D of 20 base pairs, and the preset's parameters.
_KT = 1.380649e-2 * 296.15
_SPACING, _NU, _T = 0.33, 0.35, 0.034
_TIME = _SPACING**2 / (20.0 * 1.07e-4)
"""a^2 xi/k_B T in ps, D = 1.07e-4 nm^2/ps."""
_PRINTED_TIME = "52.0"

# F-actin, Appendix: nm, pN, k_B T of 20 C.
_ACTIN_LENGTH, _ACTIN_SPACING, _ACTIN_MODULUS, _ACTIN_KT = 8750.0, 5.5, 35.5e3, 1.380649e-2 * 293.15
_ACTIN_FRICTION = 5.5e-11
"""(A2), in kg/s."""
_ACTIN_TEMPERATURE = 293.15
_PRINTED_ACTIN = (1591.0, 7.765e7, 0.4)
"""r, y and a^2 xi/k_B T in us to which Table VI belongs."""

_RULE = Rule(3.0, 0.03, 0.05)
_DIMER_STEP = 100.0
_DIMER_SPACING = 1000.0
_DIMER_FRAMES = {True: 200, False: 1000}
_DIMER_LAGS = {True: (1, 3, 10, 30), False: (1, 3, 10, 30, 100, 300)}
_DIMER_COPIES = {True: 64, False: 192}


def coarse(r, y, k):
    """T*_k and nu_k of (55)."""
    return (2.0 * r**2 + k**2 * y) * r / (k**3 * y**2), r**2 / (2.0 * r**2 + k**2 * y)


def unit_of_time(r, y, k, time):
    """c_k: xi/lambda of beads of k base pairs, from a^2 xi/k_B T of one, in the unit of that.

    (70) with the spacing k a and the friction k xi, and l_p/(k a) = r/k.
    """
    return k**4 * coarse(r, y, k)[1] / r * time


def evaluate_tables(records, quick):
    """Tables III and V, and (69) to (74)."""
    r = _NU / _T / (1.0 - 2.0 * _NU) ** 2
    y = (1.0 / _NU - 2.0) * r**2
    results = list(_units(r))
    for k, (temperature, nu) in _TABLE_3.items():
        kind = BASE_PAIRS.coarse_grained(k)
        ours = kind.reduced_temperature(TEMPERATURE), kind.nu
        cause = _cause_of_table_3(k, ours)
        for name, value, theory, text in zip(("T", "nu"), ours, coarse(r, y, k), (temperature, nu)):
            label = f"{name}_of_{k}_base_pairs"
            results.append(_exact(label, "1", value, theory, text, cause))
    for k, text in _TABLE_5.items():
        ours, theory = BASE_PAIRS.coarse_grained(k).time_unit, unit_of_time(r, y, k, _TIME)
        results.append(_exact(f"unit_of_time_of_{k}_base_pairs", "ps", ours, theory, text, _cause_of_table_5(k, text)))
    for k in (2, 5, 10, 12, 20):
        # What (55) gives for the r and y that the print must have had.
        for name, value, text in zip(("T", "nu"), coarse(*_OTHER, k), _TABLE_3[k]):
            results.append(_exact(f"{name}_of_{k}_base_pairs_with_r_120_and_y_12000", "1", value, None, text))
    remarks = (
        f"The preset has r = l_p/a = {r:.2f} and y = l_p K/k_BT = {y:.0f}, by (3) and (54) from ν = 0.35 and "
        "T* = 0.034. From the second row on Table III follows instead from r = 120 and y = 12000, which make "
        f"ν = {coarse(*_OTHER, 1)[1]:.4f} of a single base pair. Table V belongs to that chain with a²ξ/k_BT = "
        f"{_implied_time(5, _TABLE_5[5]):.1f} ps, ten times what (71) says. "
        "Sections III A and VIII, too, say that one unit of time is 1.5 ps, (72) and Tables I and IV 0.16 ps; the "
        "latter follows from (69) and (70)."
    )
    return Outcome(results, {}, remarks)


def _units(r):
    """(69) to (73)."""
    friction = BASE_PAIRS.bead_friction / (BOLTZMANN * TEMPERATURE)
    theory = _KT / (20.0 * 1.07e-4) / _KILOGRAM_PER_SECOND
    yield _exact("friction_of_a_base_pair", "kg/s", friction * _KT / _KILOGRAM_PER_SECOND, theory, "1.91e-12")
    cause = "a = 0.33 nm and (69) make it 50.9 ps; the print, and with it all of its times in ps, has 2 % more"
    yield _exact("a^2_xi_over_k_B_T", "ps", friction * BASE_PAIRS.bead_spacing**2, _TIME, _PRINTED_TIME, cause)
    theory = _NU / r * _TIME
    yield _exact("unit_of_time", "ps", BASE_PAIRS.time_unit, theory, "0.16")
    cause = (
        "Sections III A and VIII contradict (72) and Table IV; with 1.5 ps the 16 ps of the movie would not be the 100 "
        f"tau of Table II, and Euler's step of 0.1 tau is {0.1 * theory:.2g} ps and not 0.16 ps"
    )
    yield _exact("unit_of_time_in_section_III", "ps", BASE_PAIRS.time_unit, theory, "1.5", cause)
    ours = BASE_PAIRS.time_unit / BASE_PAIRS.nu
    cause = "a²ξ/k_BT is 50.9 ps here and 52.0 ps in (71)"
    yield _exact("unit_of_time_of_the_inextensible_chain", "ps", ours, _TIME / r, "0.45", cause)
    ours = BASE_PAIRS.persistence_length_at(TEMPERATURE) / BASE_PAIRS.bead_spacing
    yield _exact("persistence_length_in_base_pairs", "1", ours, r, "114")
    # (13), of the extensible wormlike chain: 2 kappa + lambda d/a = lambda.
    ours = 2.0 * BASE_PAIRS.bending_stiffness + BASE_PAIRS.stretching_modulus / BASE_PAIRS.bead_spacing
    yield Result("(13)_over_lambda", "1", Estimate(ours / BASE_PAIRS.stiffness, None), ROUNDING, 1.0)


def _cause_of_table_3(k, ours):
    other = coarse(*_OTHER, k)
    matches = all(abs(a / float(b) - 1.0) < 5e-3 for a, b in zip(other, _TABLE_3[k]))
    if k == 1 or not matches:
        return ""
    return (
        "the print belongs to r = 120 and y = 12000, as below, and not to ν = 0.35 and T* = 0.034 of its first row, "
        "whose r is 114.4 and y 11214"
    )


def _implied_time(k, text):
    return float(text) / unit_of_time(*_OTHER, k, 1.0)


def _cause_of_table_5(k, text):
    r = _NU / _T / (1.0 - 2.0 * _NU) ** 2
    implied = float(text) / unit_of_time(r, (1.0 / _NU - 2.0) * r**2, k, 1.0) if k == 1 else _implied_time(k, text)
    if not 9.0 < implied / float(_PRINTED_TIME) < 11.0:
        return ""
    return "a²ξ/k_BT of 500 to 530 ps stands behind Table V, ten times the 52.0 ps of (71) and of Table IV"


def actin():
    """F-actin of the Appendix as a BeadSpringType."""
    return BeadSpringType(
        name="ACT",
        diameter=7.0,
        bead_spacing=_ACTIN_SPACING * unit.nanometer,
        bead_friction=_ACTIN_FRICTION * unit.kilogram / unit.second * unit.AVOGADRO_CONSTANT_NA,
        stretching_modulus=_ACTIN_MODULUS * unit.piconewton,
        persistence_length=_ACTIN_LENGTH * unit.nanometer,
        temperature=_ACTIN_TEMPERATURE * unit.kelvin,
    )


def _actin_of_table_6():
    """F-actin with the r, y and a^2 xi/k_B T of Table VI, and the temperature at which it has them."""
    r, y, time = _PRINTED_ACTIN
    one, length = actin(), r * _ACTIN_SPACING
    thermal = length * one.stretching_modulus / y
    friction = time * 1e6 * thermal / _ACTIN_SPACING**2
    return replace(one, bending_rigidity=length * thermal, bead_friction=friction), thermal / BOLTZMANN


def evaluate_actin(records, quick):
    """Table VI and the Appendix."""
    one = actin()
    r, y = _ACTIN_LENGTH / _ACTIN_SPACING, _ACTIN_LENGTH * _ACTIN_MODULUS / _ACTIN_KT
    time = _ACTIN_SPACING**2 * _ACTIN_FRICTION * _KILOGRAM_PER_SECOND / _ACTIN_KT * 1e-6
    persistence = one.persistence_length_at(_ACTIN_TEMPERATURE)
    lost = (
        "the print has k_BT of 21 °C, or has lost a digit: Table VI belongs to 7.765·10⁷, that of k_BT = 4.00 pN nm, "
        "with which all of it follows from (55), as below"
    )
    results = [
        _exact("l_p_over_a", "1", persistence / one.bead_spacing, r, "1591"),
        _exact("l_p_K_0_over_k_B_T", "1", _modulus_ratio(one), y, "7.65e7", lost),
        _exact("a^2_xi_over_k_B_T", "us", _time(one), time, "0.4"),
    ]
    table, temperature = _actin_of_table_6()
    for k, row in _TABLE_6.items():
        ours, (reduced, nu) = table.coarse_grained(k), coarse(*_PRINTED_ACTIN[:2], k)
        numbers = (
            ("T_over_nu", "1", ours.reduced_temperature(temperature) / ours.nu, reduced / nu),
            ("nu", "1", ours.nu, nu),
            ("unit_of_time", "us", ours.time_unit / ours.nu * 1e-6, k**4 / _PRINTED_ACTIN[0] * _PRINTED_ACTIN[2]),
        )
        for (name, dimension, value, theory), text in zip(numbers, row):
            results.append(_exact(f"{name}_of_{k}_monomers_with_y_7.765e7", dimension, value, theory, text))
    many = one.coarse_grained(50)
    cause = (
        "the 1571 µs of Table VI are k⁴ (a/l_p) 0.4 µs (k⁴ a/l_p is 3928 for k = 50), and (A5) multiplies by 0.4 µs "
        "once more"
    )
    ours, theory = 5e-5 * many.time_unit / many.nu * 1e-6, 5e-5 * 50**4 / r * time
    results.append(_exact("largest_step_of_50_monomers", "us", ours, theory, "0.03", cause))
    results.append(_diffusion_of_actin())
    remarks = (
        "Ours has k_BT of 20 °C, and for Table VI r = 1591, y = 7.765·10⁷ and 0.4 µs. The column of times in Table VI "
        "holds the 0.4 µs of (A3) already. The friction "
        "5.5·10⁻¹¹ kg/s and the time 1.5·10⁴ s of (A2) do not belong together, and 0.1 Pa s is a hundred times the "
        "viscosity of water."
    )
    return Outcome(results, {}, remarks)


def _exact(name, dimension, value, theory, text, cause=""):
    return Result(name, dimension, Estimate(value, None), ROUNDING, theory, printed(text), cause)


def _modulus_ratio(kind):
    length = kind.persistence_length_at(_ACTIN_TEMPERATURE)
    return length * kind.stretching_modulus / (BOLTZMANN * _ACTIN_TEMPERATURE)


def _time(kind):
    return kind.bead_spacing**2 * kind.bead_friction / (BOLTZMANN * _ACTIN_TEMPERATURE) * 1e-6


def _diffusion_of_actin():
    # (A2): L^2/(6 D) of a free-draining chain of 10 um; D = k_B T/(N xi).
    one, length = actin(), 1e4
    ours = length**3 / (6.0 * _ACTIN_SPACING) * one.bead_friction / (BOLTZMANN * _ACTIN_TEMPERATURE) * 1e-12
    friction = _ACTIN_FRICTION * _KILOGRAM_PER_SECOND
    theory = friction * length**3 / (6.0 * _ACTIN_SPACING * _ACTIN_KT) * 1e-12
    cause = f"(A2) makes {theory:.0f} s of the printed friction, length and monomer"
    return _exact("time_to_diffuse_10_um", "s", ours, theory, "1.5e4", cause)


def dimers(beads_per_bond, bonds, copies, groups, step_picoseconds, spacing, frames, lags, seed):
    """Mean square displacement of the end-to-end vector of chains whose beads are some base pairs each.

    Parameters
    ----------
    beads_per_bond : int
        k.
    bonds, copies, groups : int
    step_picoseconds : float
    spacing : int
        Steps between frames.
    frames : int
    lags : list of int
        In frames.
    seed : int

    Returns
    -------
    dict of arrays
        ``moved`` (lags, groups) in nm^2.
    """
    kind = base_pairs.SIMULATED.coarse_grained(beads_per_bond)
    step = step_picoseconds / kind.time_unit
    context = base_pairs.start("modes", step, base_pairs.drawn_positions(kind, bonds, copies, seed), seed, kind)
    every = simulation.frames(context, copies, spacing * np.arange(frames + 1))
    ends = np.array([nodes[:, -1] - nodes[:, 0] for nodes in every])
    moved = [np.sum((ends[lag:] - ends[:-lag]) ** 2, axis=-1).mean(axis=0) for lag in lags]
    return {"moved": simulation.groups(moved, groups)}


def evaluate_dimers(records, quick):
    """Fig. 5."""
    step = _DIMER_STEP * BASE_PAIRS.time_unit
    lags, spacing = _DIMER_LAGS[quick], round(_DIMER_SPACING / _DIMER_STEP)
    moved = {}
    for k, bonds in ((1, 255), (2, 127)):
        data = records.measure(
            f"figure-05-{k}-base-pairs", dimers, beads_per_bond=k, bonds=bonds, copies=_DIMER_COPIES[quick], groups=16,
            step_picoseconds=step, spacing=spacing, frames=_DIMER_FRAMES[quick], lags=list(lags), seed=5,
        )  # fmt: skip
        moved[k] = simulation.mean(data["moved"])
    times = np.array(lags) * spacing * step
    results = []
    for number, time in enumerate(times):
        ratio = moved[2].value[number] / moved[1].value[number]
        errors = [moved[k].error[number] / moved[k].value[number] for k in (1, 2)]
        ours = Estimate(float(ratio), float(ratio * np.hypot(*errors)))
        label = f"displacement_of_dimers_over_base_pairs_after_{format_number(time * 1e-3, digits=3)}_ns"
        results.append(Result(label, "1", ours, _RULE, 1.0))

    def draw(figure):
        axis = figure.subplots()
        for (k, estimate), colour, marker in zip(moved.items(), style.COLOURS, "os"):
            label = f"ours, {256 // k} beads of {k} base pair{'s' if k > 1 else ''}"
            axis.errorbar(
                times * 1e-3, estimate.value, estimate.error, fmt=marker, color=colour, markersize=4, capsize=2,
                markerfacecolor="none", label=label,
            )  # fmt: skip
        ylabel = r"$\langle|L(t)-L(0)|^2\rangle$ (nm$^2$)"
        style.finish(axis, "time (ns)", ylabel, xscale="log", yscale="log")

    dimer = BASE_PAIRS.coarse_grained(2)
    remarks = (
        "Mean square displacement of the end-to-end vector of 256 base pairs and of 128 dimers, which have twice the "
        f"friction, ν = {dimer.nu:.4f} and T* = {dimer.reduced_temperature(TEMPERATURE):.5f} by (55) (the paper: "
        f"0.1875 and 0.008), both with scheme modes and steps of {step:.3g} ps, that is "
        f"{step / dimer.time_unit:.3g} tau of the dimers."
    )
    return Outcome(results, {"Displacement of the end-to-end vector": draw}, remarks)


CASES = (
    Case("table-03-05", "Tables III and V, (69) to (73): coarse graining and units", (), evaluate_tables),
    Case("table-06", "Table VI and the Appendix: F-actin", (), evaluate_actin),
    Case("figure-05", "Fig. 5: base pairs and dimers", (5,), evaluate_dimers),
)
