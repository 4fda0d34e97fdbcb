"""Bounds on the time step and a recommended step.

Equation numbers refer to Pesek et al., Soft Matter 2016, 12, 3360, appendix D. The bounds of
Table 3 are bounds of stability or of passing through; they say nothing about accuracy, which is
why ``recommended_time_step`` stays well below them.
"""

import math
import warnings
from dataclasses import dataclass

import numpy as np

from .engines import default_scheme
from .errors import InputError, TimeStepWarning
from .quantities import (
    BENDING_RIGIDITY,
    DIMENSIONLESS,
    LENGTH,
    STIFFNESS,
    TIME,
    VISCOSITY,
    in_units_of,
    positive,
    thermal_energy,
)

EXPLICIT_SCHEMES = ("euler", "midpoint")
SCHEMES = (*EXPLICIT_SCHEMES, "implicit")


def translation_bound(friction, diameter, temperature, confidence=3.0):
    """Largest step, in ps, in which translational diffusion cannot carry segments through each other, eq. (54).

    ``dt < d^2 gamma_par / (8 c_sigma^2 k_B T)``

    As printed, and as Table 3 was computed; for segments shorter than about seven diameters the
    perpendicular friction is the smaller one, and ``diffusion_bound`` accounts for it.
    """
    return _diffusion_bound(friction.parallel, diameter, temperature, confidence)


def rotation_bound(friction, diameter, length, temperature, confidence=3.0):
    """Largest step, in ps, in which rotational diffusion cannot carry segments through each other, eq. (55).

    ``dt < d^2 gamma_rot / (2 c_sigma^2 k_B T l^2)``
    """
    effective = 4.0 * friction.rotational / positive(length, LENGTH, "length") ** 2
    return _diffusion_bound(effective, diameter, temperature, confidence)


def diffusion_bound(friction, diameter, length, temperature, confidence=3.0):
    """Largest step, in ps, for the diffusion of a segment's ends, eq. (56).

    ``dt < d^2/(8 c_sigma^2 k_B T) min(1/(1/gamma_par + l^2/4 gamma_def), 1/(1/gamma_perp + l^2/4 gamma_rot))``

    The printed second denominator carries gamma_par where (16) gives gamma_perp; Table 3 was computed
    with gamma_perp, and so is this.
    """
    return _diffusion_bound(
        _end_friction(friction, positive(length, LENGTH, "length")), diameter, temperature, confidence
    )


def _end_friction(friction, length):
    # Of one end of a free segment, in the direction in which it is lower.
    quarter = length**2 / 4.0
    along = 1.0 / (1.0 / friction.parallel + quarter / friction.extensional)
    across = 1.0 / (1.0 / friction.perpendicular + quarter / friction.rotational)
    return min(along, across)


def _diffusion_bound(friction, diameter, temperature, confidence):
    kT = thermal_energy(temperature)
    if kT == 0.0:
        return math.inf
    return positive(diameter, LENGTH, "diameter") ** 2 * friction / (8.0 * confidence**2 * kT)


def stretching_bound(friction, stiffness, length):
    """Step, in ps, above which an explicit scheme overshoots a change of length, eq. (57).

    ``dt < 2 gamma_def / (k l0^2)``
    """
    stiffness = positive(stiffness, STIFFNESS, "stiffness")
    return 2.0 * friction.extensional / (stiffness * positive(length, LENGTH, "length") ** 2)


def bending_bound(friction, bending_rigidity, length):
    """Step, in ps, above which an explicit scheme overshoots a bend, eq. (58).

    ``dt < 2 l0 gamma_rot / a`` (infinite for a = 0)
    """
    rigidity = in_units_of(bending_rigidity, BENDING_RIGIDITY, "bending_rigidity")
    if rigidity == 0.0:
        return math.inf
    return 2.0 * positive(length, LENGTH, "length") * friction.rotational / rigidity


def chain_stretching_bound(friction, stiffness, length):
    """Step, in ps, above which an explicit scheme blows up the stiffest longitudinal mode of a chain.

    ``dt < 2/lambda``, lambda the largest eigenvalue of Z^-1 K of a long straight chain. A longitudinal
    wave of wave number q has K = 4 k sin^2(q/2) and Z = gamma_par cos^2(q/2) + (4 gamma_def/l0^2)
    sin^2(q/2), so the fastest mode is the one in which neighbouring nodes move against each other and

        dt < 2 gamma_def / (k l0^2),

    which is (57): being in a chain changes nothing.
    """
    return stretching_bound(friction, stiffness, length)


def chain_bending_bound(friction, bending_rigidity, length):
    """Step, in ps, above which an explicit scheme blows up the stiffest bending mode of a chain.

    ``dt < 2/lambda``, lambda the largest eigenvalue of Z^-1 K of a long straight chain. A transverse
    wave of wave number q has K = (16 a/l0^3) sin^4(q/2) and Z = gamma_perp cos^2(q/2) +
    (4 gamma_rot/l0^2) sin^2(q/2), so neighbouring nodes against each other give

        dt < gamma_rot l0 / (2 a),

    a quarter of (58), which looks at a single joint.
    """
    return bending_bound(friction, bending_rigidity, length) / 4.0


def bead_spring_bounds(diameter, viscosity, stiffness, bending_rigidity, temperature, confidence=3.0):
    """Bounds, in ps, of a chain of touching beads, eq. (59), with gamma = 3 pi eta d and l0 = d.

    Returns a dict with ``translation`` d^2 gamma/(8 c_sigma^2 k_B T), ``stretching`` gamma/k and
    ``bending`` 2 gamma l0^3/a.
    """
    diameter = positive(diameter, LENGTH, "diameter")
    friction = 3.0 * math.pi * positive(viscosity, VISCOSITY, "viscosity") * diameter
    return {
        "translation": _diffusion_bound(friction, diameter, temperature, confidence),
        "stretching": friction / positive(stiffness, STIFFNESS, "stiffness"),
        "bending": 2.0 * friction * diameter**3 / positive(bending_rigidity, BENDING_RIGIDITY, "bending_rigidity"),
    }


def contact_stiffness_bound(friction, length, stiffness, beads_per_segment=1.0):
    """Step, in ps, above which contacts of stiffness k, which are explicit in every scheme, overshoot and blow up.

    ``dt < 2/lambda``, lambda the fastest relaxation of two equal segments that touch. One pair of beads at their ends
    relaxes with 2 k/gamma*, where gamma* is the friction of an end as in (56), and n pairs along both of them with
    2 n k/gamma_perp where they move, and 2 n k (l0^2/12)/gamma_rot where they turn, so

        dt < min(gamma*, gamma_perp/n, 12 gamma_rot/(n l0^2)) / k.

    Segments in a chain move less, which leaves the bound on the safe side.
    """
    length = positive(length, LENGTH, "length")
    pairs = max(1.0, positive(beads_per_segment, DIMENSIONLESS, "beads_per_segment"))
    softest = min(
        _end_friction(friction, length),
        friction.perpendicular / pairs,
        12.0 * friction.rotational / (pairs * length**2),
    )
    return softest / positive(stiffness, STIFFNESS, "stiffness")


def time_step_bounds(filament_type, viscosity, temperature, confidence=3.0, segments=1):
    """The five bounds of Table 1 for a filament type in a solvent, in ps.

    Parameters
    ----------
    filament_type : FilamentType
    viscosity : pressure*time
    temperature : temperature
    confidence : float
        c_sigma of eq. (53): how many standard deviations of a displacement must stay below d.
    segments : int
        Number of segments of the filament; matters only with ``friction_length="filament"``.

    Returns
    -------
    dict
        ``translation`` (54), ``rotation`` (55), ``diffusion`` (56), ``stretching`` (57), ``bending`` (58).
    """
    friction = filament_type.segment_friction(viscosity, temperature, segments)
    length, diameter = filament_type.segment_length, filament_type.diameter
    return {
        "translation": translation_bound(friction, diameter, temperature, confidence),
        "rotation": rotation_bound(friction, diameter, length, temperature, confidence),
        "diffusion": diffusion_bound(friction, diameter, length, temperature, confidence),
        "stretching": stretching_bound(friction, filament_type.segment_stiffness, length),
        "bending": bending_bound(friction, filament_type.joint_stiffness * length, length),
    }


@dataclass(frozen=True)
class TimeStep:
    """A recommended time step and why it is not larger.

    Attributes
    ----------
    step : float
        The recommended step in ps.
    reason : str
        The bound that binds, in words.
    bounds : dict
        Largest step that each effect allows, in ps, before the margin for accuracy.
    """

    step: float
    reason: str
    bounds: dict

    def __str__(self):
        return f"{self.step:.4g} ps: {self.reason}"


_REASONS = {
    "stretching": "relaxation of a segment's length, eq. (57), with a margin of {margin:g} for accuracy",
    "bending": "relaxation of the sharpest bend of a chain (a quarter of eq. 58), with a margin of {margin:g} "
    "for accuracy",
    "turning": "rotational diffusion of a segment: it may turn by {angle:g} rad in a step, or less where its "
    "extensional friction is large",
    "rotation": "rotation of segments: they may turn by {angle:g} rad in a step",
    "relaxation": "relaxation of the whole filament, which takes {relaxation_steps:g} steps",
    "contact diffusion": "diffusion of a segment's ends, eq. (56) with the contact diameter: filaments must not jump "
    "through each other",
    "contact stiffness": "stiffness of contacts, which are explicit, with a margin of {contact_margin:g}",
}
LARGEST_DIVIDED_SHARE = 1e-3
"""Scheme "implicit" divides steps whose equations it cannot solve: a larger share of them may bias averages."""

_RELAXATION_STEPS = 20.0
_OVAL_MODE = 4.0 * math.pi * math.sqrt(0.75)
_LARGEST_STRAIN = 0.1
_LARGEST_ADVANCE = 0.5
_ACCURACY_MARGIN = 20.0
_TURNING_ANGLE = 0.1
_IMPLICIT_TURNING_ANGLE = 0.15
_NOISE_LEAK = 0.1
_CONTACT_MARGIN = 4.0


def stability_bounds(filament_type, viscosity, temperature, segments=1):
    """Steps, in ps, above which the explicit schemes blow up: ``stretching`` and ``bending`` of a chain."""
    friction = filament_type.segment_friction(viscosity, temperature, segments)
    length = filament_type.segment_length
    bounds = {"stretching": chain_stretching_bound(friction, filament_type.segment_stiffness, length)}
    if segments > 1:
        bounds["bending"] = chain_bending_bound(friction, filament_type.joint_stiffness * length, length)
    return bounds


def recommended_time_step(filament_type, viscosity, temperature, scheme=None, segments=2, closed=False):
    """The step at which equilibrium energies of a chain are good to about 5 %.

    Explicit schemes of weak order one leave a harmonic mode of rate lambda with a variance too large by
    1/(1 - lambda dt/2). The largest rates are 2/(bound) with the bounds of a chain, so a margin of 20
    below them, ``dt = bound/20``, leaves 5 % in the fastest mode and less in every average over modes. A
    segment must also turn by less than 0.1 rad in a step, ``2 k_B T dt/gamma_rot < 0.1^2``, because its
    friction is kept fixed within the step. Scheme "midpoint" draws its noise before the segment turns
    half-way, so noise along the segment leaks across it: a large extensional friction tightens the bound
    to ``2 k_B T dt/gamma_rot < 0.1 gamma_rot/gamma_def``, at which free segments turn some 3 % too fast.

    Parameters
    ----------
    filament_type : FilamentType
    viscosity : pressure*time
    temperature : temperature
    scheme : {"implicit", "midpoint", "euler"}, optional
        That of the fastest engine that is available if not given. "midpoint" and "euler" are explicit and have the
        same bounds; "euler" has a bias on chains that no step removes. "implicit" is not bound by stretching and
        bending, see ``implicit_time_step``.
    segments : int
    closed : bool
        A ring; matters only to "implicit".

    Returns
    -------
    TimeStep
    """
    scheme = default_scheme() if scheme is None else scheme
    check_scheme(scheme)
    if scheme == "implicit":
        return implicit_time_step(filament_type, viscosity, temperature, segments, closed)
    friction = filament_type.segment_friction(viscosity, temperature, segments)
    bounds = stability_bounds(filament_type, viscosity, temperature, segments)
    allowed = {name: bound / _ACCURACY_MARGIN for name, bound in bounds.items()}
    kT = thermal_energy(temperature)
    turning = _TURNING_ANGLE**2
    if scheme == "midpoint":
        turning = min(turning, _NOISE_LEAK * friction.rotational / friction.extensional)
    bounds["turning"] = math.inf if kT == 0.0 else turning * friction.rotational / (2.0 * kT)
    allowed["turning"] = bounds["turning"]
    binding = min(allowed, key=allowed.get)
    reason = _REASONS[binding].format(margin=_ACCURACY_MARGIN, angle=_TURNING_ANGLE)
    return TimeStep(step=allowed[binding], reason=reason, bounds=bounds)


def implicit_time_step(filament_type, viscosity, temperature, segments=2, closed=False):
    """The step of scheme "implicit" at which equilibrium energies of a chain are good to 2 %, and dynamics to 5 %.

    Its equilibrium is exact for linear forces at any step; what is left comes from segments that turn within one.
    A segment turns by the mean square of what a free segment does, 2 k_B T dt/gamma_rot, or, if that is less, of what
    its neighbours allow: after dt, waves of up to the length xi = (a dt l0/gamma_perp)^(1/4) have relaxed, which turns
    it by k_B T xi/a, and the filament turns as a whole by 24 k_B T dt l0/(gamma_perp L^3). Either must stay below
    0.15^2. Measured with ``openmm-cylchain benchmark time-step``, F-actin, microtubules, DNA and chains with free
    joints keep equilibrium within 5 % and dynamics within 10 % at that step and at several times as much. A step must
    also resolve the slowest relaxation of the filament by 20 steps: gamma_perp/(l0 a) (L/4.73)^4, or that of the mode
    in which a ring of radius R becomes oval, gamma_perp/(l0 a) R^4/9 = gamma_perp/(l0 a) (L/10.9)^4. (With the friction
    along the ring it is (gamma_perp + gamma_par/4)/(l0 a) R^4/9.)

    Returns
    -------
    TimeStep
    """
    kT = thermal_energy(temperature)
    friction = filament_type.segment_friction(viscosity, temperature, segments)
    length, rigidity = filament_type.segment_length, filament_type.bending_rigidity
    friction_per_length = friction.perpendicular / length
    turning = math.inf
    if kT > 0.0:
        free = _IMPLICIT_TURNING_ANGLE**2 * friction.rotational / (2.0 * kT)
        turning = free
    bends = segments > 1 and rigidity > 0.0
    if bends and kT > 0.0:
        waves = friction_per_length * (_IMPLICIT_TURNING_ANGLE**2 * rigidity / kT) ** 4 / rigidity
        whole = _IMPLICIT_TURNING_ANGLE**2 * friction_per_length * (segments * length) ** 3 / (24.0 * kT)
        turning = max(free, min(waves, whole))
    bounds = {"rotation": turning}
    allowed = dict(bounds)
    if bends:
        wave_number = _OVAL_MODE if closed else 4.73
        bounds["relaxation"] = friction_per_length * (segments * length / wave_number) ** 4 / rigidity
        allowed["relaxation"] = bounds["relaxation"] / _RELAXATION_STEPS
    binding = min(allowed, key=allowed.get)
    reason = _REASONS[binding].format(angle=_IMPLICIT_TURNING_ANGLE, relaxation_steps=_RELAXATION_STEPS)
    return TimeStep(step=allowed[binding], reason=reason, bounds=bounds)


def contact_time_step(
    filament_type, viscosity, temperature, diameter, stiffness, segments=2, beads_per_segment=1.0, confidence=3.0
):
    """The step at which filaments of one type with contacts do not pass through each other.

    It is the lesser of two bounds: (56) with the contact diameter, which keeps ends from diffusing by more than half of
    it in a step, and a quarter of ``contact_stiffness_bound``. The fluctuations of a contact are then too large by a
    third at most, and a filament in a bundle, which six others touch, is stable, too.

    Parameters
    ----------
    filament_type : FilamentType
    viscosity : pressure*time
    temperature : temperature
    diameter : length
        Contact diameter.
    stiffness : energy/length^2
        Of a contact between two beads, as of ``contacts.contact_force``.
    segments : int
    beads_per_segment : float
    confidence : float
        c_sigma of eq. (53): how many standard deviations of a displacement must stay below half the diameter.

    Returns
    -------
    TimeStep
    """
    friction = filament_type.segment_friction(viscosity, temperature, segments)
    length = filament_type.segment_length
    confidence = positive(confidence, DIMENSIONLESS, "confidence")
    bounds = {
        "contact diffusion": diffusion_bound(friction, diameter, length, temperature, confidence),
        "contact stiffness": contact_stiffness_bound(friction, length, stiffness, beads_per_segment),
    }
    allowed = {**bounds, "contact stiffness": bounds["contact stiffness"] / _CONTACT_MARGIN}
    binding = min(allowed, key=allowed.get)
    return TimeStep(allowed[binding], _REASONS[binding].format(contact_margin=_CONTACT_MARGIN), bounds)


def check_scheme(scheme):
    """Raise InputError unless ``scheme`` names an integration scheme."""
    if scheme not in SCHEMES:
        raise InputError(f"scheme must be one of {', '.join(SCHEMES)}, but is {scheme!r}.")


def warn_if_unstable(filament_type, viscosity, temperature, step, segments=1, scheme="midpoint"):
    """Issue a TimeStepWarning, naming the bound, if ``step`` exceeds a stability bound of an explicit scheme."""
    step = positive(step, TIME, "time step")
    if scheme not in EXPLICIT_SCHEMES:
        return
    for name, bound in stability_bounds(filament_type, viscosity, temperature, segments).items():
        if step > bound:
            recommended = recommended_time_step(filament_type, viscosity, temperature, scheme, segments)
            warnings.warn(
                f"A time step of {step:.4g} ps exceeds the {name} bound of {bound:.4g} ps of filament type "
                f"{filament_type.name!r}: the simulation will blow up. Recommended: {recommended}.",
                TimeStepWarning,
                stacklevel=3,
            )


def warn_if_strained(step, flow):
    """Issue a TimeStepWarning if a flow strains the solvent in a step by more than 0.1: by ``dt |gradient u|``."""
    strain = step * float(np.linalg.norm(flow.gradient, 2))
    if strain > _LARGEST_STRAIN:
        warnings.warn(
            f"In a time step of {step:.4g} ps the flow strains the solvent by {strain:.3g}: it is not resolved. Use a "
            f"step of at most {_LARGEST_STRAIN * step / strain:.4g} ps.",
            TimeStepWarning,
            stacklevel=3,
        )


def warn_if_driven_far(filament_type, viscosity, temperature, step, segments=1, propulsion=0.0):
    """Issue a TimeStepWarning if self-propulsion takes a segment farther in a step than by half its length.

    Beyond ``dt F0/gamma_par = l0/2`` a bent filament cuts its corners.
    """
    friction = filament_type.segment_friction(viscosity, temperature, segments)
    advance = step * abs(propulsion) / friction.parallel / filament_type.segment_length
    if advance > _LARGEST_ADVANCE:
        warnings.warn(
            f"In a time step of {step:.4g} ps a propelled segment of filament type {filament_type.name!r} advances by "
            f"{advance:.3g} of its length: it is not resolved. Use a step of at most "
            f"{_LARGEST_ADVANCE * step / advance:.4g} ps.",
            TimeStepWarning,
            stacklevel=3,
        )
