"""Bounds on the time step and a recommended step.

Equation numbers refer to Pesek et al., Soft Matter 2016, 12, 3360, appendix D. The bounds of
Table 3 are bounds of stability or of passing through; they say nothing about accuracy, which is
why ``recommended_time_step`` stays well below them.
"""

import math
import warnings
from dataclasses import dataclass, field

import numpy as np
from scipy.optimize import brentq

from ..engine_choice import default_scheme
from ..errors import InputError, TimeStepWarning
from ..units.quantities import (
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
from ..units.text import format_time
from .schemes import EXPLICIT_SCHEMES, IMPLICIT_SCHEMES, SCHEMES, amplification_of_second_order


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
    allowed : dict
        The same with the margin: the least of them is the recommended step.
    unknown_forces : tuple of str
        Forces of the System whose stiffness is not known; they may need a shorter step.
    dynamics : tuple of (str, float)
        The scheme and the rate, in 1/ps, of the fastest bend of each kind of filament.
    """

    step: float
    reason: str
    bounds: dict
    allowed: dict = field(default_factory=dict)
    unknown_forces: tuple = ()
    dynamics: tuple = ()

    def resolved_relaxation_time(self, error=0.05):
        """The shortest relaxation time, in ps, of a mode of bending whose rate is right within ``error`` at the step.

        See ``resolved_relaxation_time`` of this module. Zero if it holds no filaments.
        """
        times = [resolved_relaxation_time(self.step, scheme, error, fastest) for scheme, fastest in self.dynamics]
        return max(times, default=0.0)

    def describe_dynamics(self):
        """What holds of relaxation at the step, in words; its equilibrium is right for all modes."""
        if not self.dynamics:
            return "no modes of bending"
        five, ten = (format_time(self.resolved_relaxation_time(error), 3) for error in (0.05, 0.10))
        return f"modes of bending that relax in {five} or longer are right to 5 %, in {ten} or longer to 10 %"

    def __str__(self):
        unknown = f"; not known: {', '.join(self.unknown_forces)}" if self.unknown_forces else ""
        return f"{self.step:.4g} ps: {self.reason}{unknown}"


def as_step(step, name="step_size"):
    """A time step in ps: of a TimeStep, or of a quantity or plain number that must be positive."""
    return step.step if isinstance(step, TimeStep) else positive(step, TIME, name)


def shortest(steps):
    """The TimeStep that binds of several, with the bounds of all of them, each at its shortest."""
    steps = list(steps)
    if any(math.isfinite(one.step) and _IDLE not in one.bounds for one in steps):
        # The relaxation of lengths counts only where there is nothing else to resolve.
        steps = [one for one in steps if _IDLE not in one.bounds]
    least = min(steps, key=lambda one: one.step)
    bounds, allowed = {}, {}
    for one in steps:
        for name, value in one.allowed.items():
            if value < allowed.get(name, math.inf) or name not in allowed:
                allowed[name], bounds[name] = value, one.bounds[name]
    unknown = tuple(dict.fromkeys(force for one in steps for force in one.unknown_forces))
    dynamics = tuple(dict.fromkeys(each for one in steps for each in one.dynamics))
    return TimeStep(least.step, least.reason, bounds, allowed, unknown, dynamics)


# R(z, theta): what is left, after a step, of a mode that relaxes by z = lambda h in it.
_DECAYS = {
    "euler": lambda z, theta: 1.0 - z,
    "midpoint": lambda z, theta: 1.0 - z,
    "implicit": lambda z, theta: (1.0 - (1.0 - theta) * z) / (1.0 + theta * z),
    "implicit-second-order": lambda z, theta: float(amplification_of_second_order(z)),
}


def effective_rate(step, scheme, rate, fastest_rate=0.0):
    """The rate, in 1/ps, at which a mode of bending of the rate ``rate`` relaxes in steps of a length: ``-ln(R)/h``.

    R is what is left of the mode after one step, with z = lambda h:

    - "euler" and "midpoint": R = 1 - z
    - "implicit": R = (1 - (1 - theta) z)/(1 + theta z) with theta = max(1/2, 1 - 1/z') for all modes of a chain, z'
      being the step times the rate of the sharpest bend, 4 K/gamma_rot. Steps that do not resolve that one relax as
      those of the implicit Euler method, R = 1/(1 + z), steps that do as Crank and Nicolson's.
    - "implicit-second-order": ``schemes.amplification_of_second_order``.

    Fluctuations keep their exact variance in the implicit schemes, whatever the step; the rate alone is off.

    Parameters
    ----------
    step : time
    scheme : str
    rate : 1/time
        lambda.
    fastest_rate : 1/time
        Of the sharpest bend, 4 K/gamma_rot.

    Returns
    -------
    float
        Infinite if nothing is left after a step.
    """
    check_scheme(scheme)
    step = as_step(step, "step")
    rate, fastest_rate = (
        in_units_of(value, TIME**-1, name) for value, name in ((rate, "rate"), (fastest_rate, "fastest_rate"))
    )
    return rate * _rate_ratio(scheme, step * rate, _theta(step * fastest_rate))


def _theta(fastest):
    return max(0.5, 1.0 - 1.0 / fastest) if fastest > 0.0 else 0.5


def _rate_ratio(scheme, z, theta):
    left = _DECAYS[scheme](z, theta)
    return -math.log(left) / z if left > 0.0 else math.inf


def resolved_relaxation_time(step, scheme, error=0.05, fastest_rate=0.0):
    """The shortest relaxation time, in ps, of a mode of bending that relaxes at a rate right to within ``error``.

    By ``effective_rate``. At long steps of scheme "implicit" it is 9.3 steps for 5 % and 4.3 for 10 %, of scheme
    "implicit-second-order" 1.0 and 0.8; the explicit schemes need 10.7 and 5.7.

    Parameters
    ----------
    step : time
    scheme : str
    error : float
        Of the rate, above 0 and below 1.
    fastest_rate : 1/time
        As for ``effective_rate``. With zero, there are no bends, and every relaxation is taken as slow.

    Returns
    -------
    float
    """
    check_scheme(scheme)
    step = as_step(step, "step")
    error = positive(error, DIMENSIONLESS, "error")
    theta = _theta(step * in_units_of(fastest_rate, TIME**-1, "fastest_rate"))

    def excess(logarithm):
        return min(abs(_rate_ratio(scheme, math.exp(logarithm), theta) - 1.0), 1.0) - error

    grid = np.log(np.geomspace(1e-4, 10.0, 400))
    beyond = [index for index in range(1, len(grid)) if excess(grid[index]) > 0.0]
    if not beyond:
        return step * math.exp(-grid[-1])
    first = beyond[0]
    return step * math.exp(-brentq(excess, grid[first - 1], grid[first]))


_IDLE = "length"
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
    "soft lengths": "soft lengths, which may change by a twentieth of themselves in a step (more if segments are many)",
    "range": "FENE lengths, whose distribution a step must resolve (or be much longer than their relaxation)",
    "flow": "flow, which may strain the solvent by {strain:g} in a step",
    _IDLE: "relaxation of a segment's length, which takes 20 steps: at a temperature of zero nothing else moves",
}
_RELAXATION_STEPS = 20.0
_RELAXATION_STEPS_OF_SECOND_ORDER = 2.0
_OVAL_MODE = 4.0 * math.pi * math.sqrt(0.75)
_RECOMMENDED_STRAIN = 0.03
_LARGEST_STRAIN = 0.06
_LARGEST_ADVANCE = 0.5
_ACCURACY_MARGIN = 20.0
_TURNING_ANGLE = 0.1
_IMPLICIT_TURNING_ANGLE = 0.15
_NOISE_LEAK = 0.1
_CONTACT_MARGIN = 4.0
_RANGE_OF_TURNING = 12.0
_SOFT_LENGTHS = 16.0
_SOFT_LENGTH_ERROR = 0.008
_LENGTH_DIFFUSION = 0.0008
_FAR_ABOVE = 4.0


def stability_bounds(filament_type, viscosity, temperature, segments=1):
    """Steps, in ps, above which the explicit schemes blow up: ``stretching`` and ``bending`` of a chain."""
    friction = filament_type.segment_friction(viscosity, temperature, segments)
    return _stability_bounds(filament_type, friction, segments)


def _stability_bounds(filament_type, friction, segments):
    length = filament_type.segment_length
    bounds = {"stretching": chain_stretching_bound(friction, filament_type.segment_stiffness, length)}
    if segments > 1:
        bounds["bending"] = chain_bending_bound(friction, filament_type.joint_stiffness * length, length)
    return bounds


def recommended_time_step(
    filament_type, viscosity, temperature, scheme=None, segments=2, closed=False, flow=None, friction=None
):
    """The step at which equilibrium energies of a chain are good to about 5 %.

    Explicit schemes of weak order one leave a harmonic mode of rate lambda with a variance too large by
    1/(1 - lambda dt/2). The largest rates are 2/(bound) with the bounds of a chain, so a margin of 20
    below them, ``dt = bound/20``, leaves 5 % in the fastest mode and less in every average over modes. A
    segment must also turn by less than 0.1 rad in a step, ``2 k_B T dt/gamma_rot < 0.1^2``, because its
    friction is kept fixed within the step. Scheme "midpoint" draws its noise before the segment turns
    half-way, so noise along the segment leaks across it: a large extensional friction tightens the bound
    to ``2 k_B T dt/gamma_rot < 0.1 gamma_rot/gamma_def``, at which free segments turn some 3 % too fast.

    FENE lengths narrow the bounds (``fene_bound``, for "implicit" ``fene_steps``), and a flow may strain the solvent by
    0.03 in a step at most.

    Parameters
    ----------
    filament_type : FilamentType
    viscosity : pressure*time
    temperature : temperature
    scheme : {"implicit", "implicit-second-order", "midpoint", "euler"}, optional
        That of the fastest engine that is available if not given. "midpoint" and "euler" are explicit and have the
        same bounds; "euler" has a bias on chains that no step removes. "implicit" is not bound by stretching and
        bending, see ``implicit_time_step``.
    segments : int
    closed : bool
        A ring; matters only to "implicit".
    flow : Flow, optional
        Of the solvent.
    friction : SegmentFriction, optional
        Of a segment; that at the given temperature if not given.

    Returns
    -------
    TimeStep
    """
    scheme = default_scheme() if scheme is None else scheme
    check_scheme(scheme)
    if friction is None:
        friction = filament_type.segment_friction(viscosity, temperature, segments)
    if scheme in IMPLICIT_SCHEMES:
        return implicit_time_step(filament_type, viscosity, temperature, segments, closed, flow, friction, scheme)
    bounds = _stability_bounds(filament_type, friction, segments)
    allowed = {name: bound / _ACCURACY_MARGIN for name, bound in bounds.items()}
    kT = thermal_energy(temperature)
    turning = min(_TURNING_ANGLE**2, _turning_in_range(filament_type))
    if scheme == "midpoint":
        turning = min(turning, _NOISE_LEAK * friction.rotational / friction.extensional)
    bounds["turning"] = math.inf if kT == 0.0 else turning * friction.rotational / (2.0 * kT)
    allowed["turning"] = bounds["turning"]
    return _binding(filament_type, friction, temperature, scheme, segments, flow, bounds, allowed, math.sqrt(turning))


def _binding(filament_type, friction, temperature, scheme, segments, flow, bounds, allowed, angle):
    # The TimeStep of a chain, with what flow and FENE lengths add to its bounds.
    rate = 0.0 if flow is None else strain_rate(flow)
    if rate > 0.0:
        bounds["flow"] = allowed["flow"] = _RECOMMENDED_STRAIN / rate
    if filament_type.maximum_extension is not None:
        if scheme in IMPLICIT_SCHEMES:
            resolved, drawn = fene_steps(filament_type, friction, temperature)
            bound = math.inf if min(allowed.values()) >= drawn else resolved
        else:
            bound = fene_bound(filament_type, friction, temperature)
        bounds["range"] = allowed["range"] = bound
    if not any(math.isfinite(step) for step in allowed.values()):
        relaxation = friction.extensional / (filament_type.segment_stiffness * filament_type.segment_length**2)
        bounds[_IDLE], allowed[_IDLE] = relaxation, relaxation / _RELAXATION_STEPS
    binding = min(allowed, key=allowed.get)
    reason = _REASONS[binding].format(
        margin=_ACCURACY_MARGIN, angle=angle, relaxation_steps=_relaxation_steps(scheme), strain=_RECOMMENDED_STRAIN
    )
    fastest = 4.0 * filament_type.joint_stiffness / friction.rotational
    dynamics = ((scheme, fastest),) if segments > 1 and fastest > 0.0 else ()
    return TimeStep(allowed[binding], reason, bounds, allowed, dynamics=dynamics)


def strain_rate(flow):
    """The fastest rate, in 1/ps, at which a flow strains the solvent: the norm of its gradient."""
    return float(np.linalg.norm(flow.gradient, 2))


def _turning_in_range(filament_type):
    # Mean square angle: a segment that turns by phi is longer by l0 phi^2/2 before its length is solved for, which must
    # stay inside the range of a FENE length at five standard deviations.
    if filament_type.maximum_extension is None:
        return math.inf
    return filament_type.maximum_extension / (_RANGE_OF_TURNING * filament_type.segment_length)


def _length_variance(filament_type, kT):
    # Over l0^2; for a FENE potential that of the distribution (1 - u^2)^(nu/2).
    if filament_type.maximum_extension is None:
        return kT / (filament_type.segment_stiffness * filament_type.segment_length**2)
    extension = filament_type.maximum_extension
    softness = kT / (filament_type.segment_stiffness * extension**2)
    return softness / (1.0 + 3.0 * softness) * (extension / filament_type.segment_length) ** 2


def fene_bound(filament_type, friction, temperature):
    """The step, in ps, of an explicit scheme in which the length of a segment with a FENE potential stays in its range.

    With nu = k D^2/k_B T, u = (l - l0)/D has the distribution (1 - u^2)^(nu/2), and relaxes in
    tau = gamma_def/(k l0^2). Neither the noise of a step, sigma^2 = 2 k_B T dt l0^2/gamma_def, nor the force may take a
    length from u*, which it exceeds once in a million, out of its range: ``5 sigma < D (1 - u*)`` and
    ``dt < 0.1 tau (1 - u*^2)^2/(1 + u*^2)``, 1 - u*^2 = 10^(-12/nu).

    A segment must also turn by less: by a mean square angle of D/(12 l0) at most. Before its length is solved for, one
    that turns by phi is longer by l0 phi^2/2. This is part of the bound "turning". Scheme "implicit" needs neither, see
    ``fene_steps``.
    """
    kT = thermal_energy(temperature)
    stiffness, extension = filament_type.segment_stiffness, filament_type.maximum_extension
    length = filament_type.segment_length
    tau = friction.extensional / (stiffness * length**2)
    if kT == 0.0:
        return 0.1 * tau
    nu = stiffness * extension**2 / kT
    narrow = 10.0 ** (-12.0 / nu)
    edge = narrow / (1.0 + math.sqrt(1.0 - narrow))
    noise = (extension * edge / 5.0) ** 2 * friction.extensional / (2.0 * kT * length**2)
    return min(noise, 0.1 * tau * narrow**2 / (2.0 - narrow))


def fene_steps(filament_type, friction, temperature):
    """Where implicit schemes keep the energy of FENE lengths: up to the first step, in ps, and from the second one on.

    With nu = k D^2/k_B T, u = (l - l0)/D has the distribution (1 - u^2)^(nu/2). A length never leaves its range, at any
    step. Steps much longer than its relaxation, tau = gamma_def/(k l0^2), draw it anew from its distribution, and short
    ones resolve how it diffuses through its range, in t_D = D^2 gamma_def/((l0 + D)^2 k_B T). Between them the noise of
    friction meets the edges of the range, where the force is nothing like that of a spring: V_el is up to 7 % too large
    for nu = 10, 47 % for nu = 3, four times as large for nu = 1 and twenty times for nu = 0.01. The two steps are

        (1.5e-5 + 6e-4 nu^2) t_D        and        200 tau/nu,

    where V_el is measured to be 3 to 5 % too large at most. From nu = 24 on (34 for D = l0) they overlap, so that every
    step is right to 3 %, and both are infinite and zero then. (DNA segments of 8 nm with D from 0.01 to 7.9 nm, nu from
    0.01 to 100 and steps from 26 ps to 2.6 ns; F-actin with D from 0.1 to 36 nm at 0.4 ms.)
    """
    kT = thermal_energy(temperature)
    stiffness, extension = filament_type.segment_stiffness, filament_type.maximum_extension
    length = filament_type.segment_length
    if kT == 0.0:
        return math.inf, 0.0
    nu = stiffness * extension**2 / kT
    diffusion = extension**2 * friction.extensional / ((length + extension) ** 2 * kT)
    resolved = (1.5e-5 + 6e-4 * nu**2) * diffusion
    drawn = 200.0 * friction.extensional / (nu * stiffness * length**2)
    return (math.inf, 0.0) if resolved >= drawn else (resolved, drawn)


def implicit_time_step(
    filament_type,
    viscosity,
    temperature,
    segments=2,
    closed=False,
    flow=None,
    friction=None,
    scheme="implicit",
):
    """The step of an implicit scheme at which equilibrium energies of a chain are good to 2 %, and dynamics to 5 %.

    Its equilibrium is exact for linear forces at any step; what is left comes from segments that turn within one.
    A segment turns by the mean square of what a free segment does, 2 k_B T dt/gamma_rot, or, if that is less, of what
    its neighbours allow: after dt, waves of up to the length xi = (a dt l0/gamma_perp)^(1/4) have relaxed, which turns
    it by k_B T xi/a, and the filament turns as a whole by 24 k_B T dt l0/(gamma_perp L^3). Either must stay below
    0.15^2. Measured with ``openmm-cylchain benchmark time-step``, F-actin, microtubules, DNA and chains with free
    joints keep equilibrium within 5 % and dynamics within 10 % at that step and at several times as much. A step must
    also resolve the slowest relaxation of the filament, by 20 steps, or 2 of scheme "implicit-second-order", which is
    1 % too fast there: gamma_perp/(l0 a) (L/4.73)^4, or that of the mode in which a ring of radius R becomes oval,
    gamma_perp/(l0 a) R^4/9 = gamma_perp/(l0 a) (L/10.9)^4. (With the friction along the ring it is (gamma_perp +
    gamma_par/4)/(l0 a) R^4/9.)

    Stiff lengths do not bound the step, nor does their friction: that acts on true changes of a length, so a segment
    turns freely however slowly its length relaxes, and the length needs a run that is longer than tau_l, not shorter
    steps. Soft ones do: with the variance s l0^2 of a length (s = k_B T/(k l0^2) for a spring), V_el of N segments is
    measured to be too large by 16 s/N at most, at steps of tau = gamma_def/(k l0^2) and longer. Where that is more than
    0.8 %, the step may be 0.0008 N gamma_def/k_B T, which leaves 0.8 %. FENE lengths may bind it, see ``fene_steps``.
    At a temperature of zero, where nothing else moves (one segment, or free joints), the relaxation of a segment's
    length is resolved by 20 steps.

    Returns
    -------
    TimeStep
    """
    kT = thermal_energy(temperature)
    if friction is None:
        friction = filament_type.segment_friction(viscosity, temperature, segments)
    length, rigidity = filament_type.segment_length, filament_type.bending_rigidity
    friction_per_length = friction.perpendicular / length
    square_angle = _IMPLICIT_TURNING_ANGLE**2
    turning = math.inf
    if kT > 0.0:
        free = square_angle * friction.rotational / (2.0 * kT)
        turning = free
    bends = segments > 1 and rigidity > 0.0
    if bends and kT > 0.0:
        waves = friction_per_length * (square_angle * rigidity / kT) ** 4 / rigidity
        whole = square_angle * friction_per_length * (segments * length) ** 3 / (24.0 * kT)
        turning = max(free, min(waves, whole))
    bounds = {"rotation": turning}
    if _SOFT_LENGTHS * _length_variance(filament_type, kT) > _SOFT_LENGTH_ERROR * segments:
        bounds["soft lengths"] = _LENGTH_DIFFUSION * segments * friction.extensional / kT
    allowed = dict(bounds)
    if bends:
        wave_number = _OVAL_MODE if closed else 4.73
        bounds["relaxation"] = friction_per_length * (segments * length / wave_number) ** 4 / rigidity
        allowed["relaxation"] = bounds["relaxation"] / _relaxation_steps(scheme)
    angle = math.sqrt(square_angle)
    return _binding(filament_type, friction, temperature, scheme, segments, flow, bounds, allowed, angle)


def _relaxation_steps(scheme):
    return _RELAXATION_STEPS_OF_SECOND_ORDER if scheme == "implicit-second-order" else _RELAXATION_STEPS


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
    return TimeStep(allowed[binding], _REASONS[binding].format(contact_margin=_CONTACT_MARGIN), bounds, allowed)


def contact_diffusion_step(filament_type, friction, temperature, diameter, confidence=3.0):
    """The part of ``contact_time_step`` that does not depend on the stiffness of contacts, for segments of a friction.

    Returns
    -------
    TimeStep
    """
    confidence = positive(confidence, DIMENSIONLESS, "confidence")
    bound = diffusion_bound(friction, diameter, filament_type.segment_length, temperature, confidence)
    bounds = {"contact diffusion": bound}
    return TimeStep(bound, _REASONS["contact diffusion"], bounds, dict(bounds))


def check_scheme(scheme):
    """Raise InputError unless ``scheme`` names an integration scheme."""
    if scheme not in SCHEMES:
        raise InputError(f"scheme must be one of {', '.join(SCHEMES)}, but is {scheme!r}.")


def warn_if_unstable(filament_type, viscosity, temperature, step, segments=1, scheme="midpoint"):
    """Issue a TimeStepWarning, naming the bound, if ``step`` exceeds a stability bound of an explicit scheme.

    Returns whether it does.
    """
    step = as_step(step, "time step")
    if scheme not in EXPLICIT_SCHEMES:
        return False
    unstable = False
    for name, bound in stability_bounds(filament_type, viscosity, temperature, segments).items():
        if step > bound:
            unstable = True
            recommended = recommended_time_step(filament_type, viscosity, temperature, scheme, segments)
            warnings.warn(
                f"A time step of {step:.4g} ps exceeds the {name} bound of {bound:.4g} ps of filament type "
                f"{filament_type.name!r}: the simulation will blow up. Recommended: {recommended}.",
                TimeStepWarning,
                stacklevel=4,
            )
    return unstable


def warn_if_far_above(
    filament_type, viscosity, temperature, step, segments=1, scheme="midpoint", closed=False, friction=None
):
    """Issue a TimeStepWarning if ``step`` exceeds the recommended step of a chain by more than a factor of four.

    Not where nothing but the relaxation of lengths is left to resolve (see ``implicit_time_step``): whatever moves such
    a filament then is not the chain's own.
    """
    step = as_step(step, "time step")
    recommended = recommended_time_step(
        filament_type, viscosity, temperature, scheme, segments, closed, friction=friction
    )
    if step > _FAR_ABOVE * recommended.step and _IDLE not in recommended.bounds:
        warnings.warn(
            f"A time step of {step:.4g} ps is {step / recommended.step:.3g} times as long as the recommended one of "
            f"filament type {filament_type.name!r} with {segments} segments. Recommended: {recommended}.",
            TimeStepWarning,
            stacklevel=4,
        )


def warn_if_fene_is_wrong(filament_type, temperature, step, friction, scheme):
    """Issue a TimeStepWarning if a step of an implicit scheme is between those that keep the energy of FENE lengths."""
    step = as_step(step, "time step")
    if filament_type.maximum_extension is None or scheme not in IMPLICIT_SCHEMES:
        return
    resolved, drawn = fene_steps(filament_type, friction, temperature)
    if 1.01 * resolved < step < 0.99 * drawn:
        warnings.warn(
            f"A time step of {step:.4g} ps neither resolves the lengths of filament type {filament_type.name!r} within "
            "their FENE range nor is long enough to draw them anew: their energies are too high. Use a step of at most "
            f"{resolved:.4g} ps, or of at least {drawn:.4g} ps if the rest allows it.",
            TimeStepWarning,
            stacklevel=4,
        )


def warn_if_strained(step, flow):
    """Issue a TimeStepWarning if a flow strains the solvent in a step by more than 0.06: by ``dt |gradient u|``."""
    step = as_step(step, "time step")
    strain = step * strain_rate(flow)
    if strain > _LARGEST_STRAIN:
        warnings.warn(
            f"In a time step of {step:.4g} ps the flow strains the solvent by {strain:.3g}: it is not resolved. Use a "
            f"step of at most {_LARGEST_STRAIN * step / strain:.4g} ps, or better "
            f"{_RECOMMENDED_STRAIN * step / strain:.4g} ps.",
            TimeStepWarning,
            stacklevel=4,
        )


def warn_if_driven_far(filament_type, viscosity, temperature, step, segments=1, propulsion=0.0):
    """Issue a TimeStepWarning if self-propulsion takes a segment farther in a step than by half its length.

    Beyond ``dt F0/gamma_par = l0/2`` a bent filament cuts its corners.
    """
    step = as_step(step, "time step")
    friction = filament_type.segment_friction(viscosity, temperature, segments)
    advance = step * abs(propulsion) / friction.parallel / filament_type.segment_length
    if advance > _LARGEST_ADVANCE:
        warnings.warn(
            f"In a time step of {step:.4g} ps a propelled segment of filament type {filament_type.name!r} advances by "
            f"{advance:.3g} of its length: it is not resolved. Use a step of at most "
            f"{_LARGEST_ADVANCE * step / advance:.4g} ps.",
            TimeStepWarning,
            stacklevel=4,
        )
