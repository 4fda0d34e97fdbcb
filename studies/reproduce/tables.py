"""Tables 1 and 3, and the relaxation times of momenta in Section 5.

Ours is what the software says of a filament; the theory is each formula of the paper once more, in pN, us and nm.
"""

import math

from benchmark.measurement import Estimate
from openmm_cylchain.mechanics.friction import momentum_relaxation_times
from openmm_cylchain.time_steps.stability import bead_spring_bounds, time_step_bounds

from .case import Case, Outcome
from .result import ROUNDING, Result, printed
from .table_2 import ACTIN, MICROSECOND, SOLVENT_TEMPERATURE, SOLVENT_VISCOSITY, actin_friction

LENGTHS = (10, 20, 30, 40, 80, 150, 300, 600, 1200, 2400)
_TABLE_3 = {
    "translation": "0.0316 0.023 0.025 0.028 0.041 0.061 0.099 0.168 0.29 0.51",
    "rotation": "0.1311 0.022 0.022 0.023 0.031 0.045 0.072 0.121 0.21 0.36",
    "diffusion": "0.0158 0.012 0.013 0.014 0.020 0.030 0.050 0.084 0.15 0.26",
    "stretching": "0.1993 0.200 0.200 0.200 0.200 0.200 0.200 0.200 0.20 0.20",
    "bending": "0.0076 0.010 0.034 0.086 0.932 8.903 113.952 1.5e3 20.8e3 0.29e6",
}
SPEED_UP = dict(zip(LENGTHS, "13.4 18.1 22.1 24.8 35.7 53.3 87.2 147.5 255.5 351.8".split()))
"""As printed, by length in nm."""
_BEAD_SPRING = {"translation": "0.01130", "stretching": "0.00199", "bending": "0.00057"}
_MOMENTA = {
    "perpendicular": ("2.15", "the print has the labels of translation along and across the segment swapped"),
    "parallel": ("1.35", "the print has the labels of translation along and across the segment swapped"),
    "rotational": ("0.33", "the print is a third of M l^2/(12 gamma_rot)"),
    "extensional": ("0.04", ""),
}

_RIGIDITY_CAUSE = "the print was computed with a = 73.47e3 pN nm^2, 0.2 % below the l_p k_B T of Table 2"

# Table 2 in pN, us and nm; k_B T of 310 K, which it rounds to 4.28.
_KT, _ETA, _D, _K, _TAU = 1.380649e-2 * 310.0, 1.71e-3, 6.0, 48.7, 0.1
_A = 17200.0 * _KT
_CONFIDENCE = 3.0


def _formulas(length):
    # Eqs. (6), (20), (54) to (58), with gamma_perp in the second denominator of (56).
    logarithm = math.log(length / _D)
    parallel = 2 * math.pi * _ETA * length / (logarithm - 0.114)
    perpendicular = 4 * math.pi * _ETA * length / (logarithm + 0.886)
    rotational = math.pi * _ETA * length**3 / (3 * (logarithm - 0.447))
    extensional = _TAU * (_K * length**2 - 4 * _KT)
    scale = _D**2 / (8 * _CONFIDENCE**2 * _KT)
    along = parallel * extensional / (extensional + length**2 / 4 * parallel)
    across = perpendicular * rotational / (rotational + length**2 / 4 * perpendicular)
    return {
        "translation": scale * parallel,
        "rotation": 4 * scale * rotational / length**2,
        "diffusion": scale * min(along, across),
        "stretching": 2 * extensional / (_K * length**2),
        "bending": 2 * length * rotational / _A,
    }


def _bead_formulas():
    friction = 3 * math.pi * _ETA * _D
    return {
        "translation": _D**2 * friction / (8 * _CONFIDENCE**2 * _KT),
        "stretching": friction / _K,
        "bending": 2 * friction * _D**3 / _A,
    }


def _in_microseconds(bounds):
    return {name: bound / MICROSECOND for name, bound in bounds.items()}


def _beads():
    return _in_microseconds(
        bead_spring_bounds(
            ACTIN.diameter, SOLVENT_VISCOSITY, ACTIN.segment_stiffness, ACTIN.bending_rigidity, SOLVENT_TEMPERATURE
        )
    )


def _segments(length):
    kind = ACTIN.with_segment_length(float(length))
    return _in_microseconds(time_step_bounds(kind, SOLVENT_VISCOSITY, SOLVENT_TEMPERATURE, _CONFIDENCE))


def speed_up(length):
    """The smallest bound on the step of segments of a length in nm over that of touching beads."""
    return min(_segments(length).values()) / min(_beads().values())


def _closed(name, unit, ours, theory, text, cause=""):
    return Result(name, unit, Estimate(float(ours), None), ROUNDING, theory, printed(text), cause)


def evaluate_table_3(records, quick):
    """Bounds on the time step by the formulas of Table 1, for the segments of Table 3."""
    beads = _beads()
    bead_theory = _bead_formulas()
    results = [
        _closed(f"{name}_bead_spring", "us", beads[name], bead_theory[name], text, _RIGIDITY_CAUSE)
        for name, text in _BEAD_SPRING.items()
    ]
    texts = {name: row.split() for name, row in _TABLE_3.items()}
    for column, length in enumerate(LENGTHS):
        bounds = _segments(length)
        theory = _formulas(float(length))
        for name, bound in bounds.items():
            cause = _RIGIDITY_CAUSE if name == "bending" else ""
            results.append(_closed(f"{name}_{length}_nm", "us", bound, theory[name], texts[name][column], cause))
        expected = min(theory.values()) / min(bead_theory.values())
        results.append(
            _closed(f"speed_up_{length}_nm", "1", speed_up(length), expected, SPEED_UP[length], _RIGIDITY_CAUSE)
        )
    return Outcome(results)


def evaluate_momenta(records, quick):
    """Relaxation times of momenta, eq. (51), of a segment of 1.26 MDa."""
    times = momentum_relaxation_times(actin_friction(), ACTIN.segment_mass, ACTIN.segment_length)
    length = ACTIN.segment_length
    logarithm = math.log(length / _D)
    mass = 1.26 * 1.66053907e-6  # 1.26 MDa in pN us^2/nm
    theory = {
        "parallel": mass * (logarithm - 0.114) / (2 * math.pi * _ETA * length),
        "perpendicular": mass * (logarithm + 0.886) / (4 * math.pi * _ETA * length),
        "rotational": mass * 3 * (logarithm - 0.447) / (12 * math.pi * _ETA * length),
        "extensional": mass * length**2 / (12 * _TAU * (_K * length**2 - 4 * _KT)),
    }
    return Outcome(
        [
            _closed(f"momentum_{name}", "ps", times[name], theory[name] * MICROSECOND, text, cause)
            for name, (text, cause) in _MOMENTA.items()
        ]
    )


CASES = (
    Case("table-3", "Tables 1 and 3: bounds on the time step", (), evaluate_table_3),
    Case("momenta", "Section 5: relaxation times of momenta", (), evaluate_momenta),
)
