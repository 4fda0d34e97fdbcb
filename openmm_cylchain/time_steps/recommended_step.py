"""The recommended step of filaments of one type, alone and in contact."""

import math
from typing import cast

from ..bead_spring.bead_spring_type import BeadSpringType
from ..engine_choice import default_scheme
from ..errors import InputError
from ..filaments.chain_type import ChainType
from ..mechanics.flow import Flow, as_flow
from ..mechanics.friction import SegmentFriction
from ..units.quantities import (
    DIMENSIONLESS,
    ENERGY,
    LENGTH,
    VISCOSITY,
    finite_number,
    positive,
    require_kind,
    thermal_energy,
    true_or_false,
    whole_number,
)
from ..units.types import Scalar
from .bead_spring_step import bead_spring_time_step
from .beam_step import beam_time_step
from .schemes import IMPLICIT_SCHEMES, MODES, check_scheme
from .stability import bounds_of_chain, contact_stiffness_bound, diffusion_bound
from .time_step import IDLE, RECOMMENDED_STRAIN, TimeStep, strain_rate

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
    IDLE: "relaxation of a segment's length, which takes 20 steps: at a temperature of zero nothing else moves",
}
_RELAXATION_STEPS = 20.0
_RELAXATION_STEPS_OF_SECOND_ORDER = 2.0
_OVAL_MODE = 4.0 * math.pi * math.sqrt(0.75)
_ACCURACY_MARGIN = 20.0
_TURNING_ANGLE = 0.1
_IMPLICIT_TURNING_ANGLE = {"implicit": 0.15, "implicit-second-order": 0.1}
_NOISE_LEAK = 0.1
_CONTACT_MARGIN = 4.0
_RANGE_OF_TURNING = 12.0
_SOFT_LENGTHS = 16.0
_SOFT_LENGTH_ERROR = 0.008
_LENGTH_DIFFUSION = 0.0008


def recommended_time_step(
    filament_type: ChainType,
    viscosity: Scalar,
    temperature: Scalar,
    scheme: str | None = None,
    segments: int = 2,
    closed: bool = False,
    flow: Flow | None = None,
    friction: SegmentFriction | None = None,
    propulsion: float = 0.0,
    longest: int | None = None,
) -> TimeStep:
    """The step at which equilibrium energies of a chain are good to about 5 %.

    Explicit schemes of weak order one leave a harmonic mode of rate lambda with a variance too large by
    1/(1 - lambda dt/2). The largest rates are 2/(bound) with the bounds of a chain, so a margin of 20
    below them, ``dt = bound/20``, leaves 5 % in the fastest mode and less in every average over modes. A
    segment must also turn by less than 0.1 rad in a step, ``2 k_B T dt/gamma_rot < 0.1^2``, because its
    friction is kept fixed within the step. Scheme "midpoint" draws its noise before the segment turns
    half-way, so noise along the segment leaks across it: a large extensional friction tightens the bound
    to ``2 k_B T dt/gamma_rot < 0.1 gamma_rot/gamma_def``, at which free segments turn some 3 % too fast.

    FENE lengths narrow the bounds (``fene_bound``, for "implicit" ``fene_steps``), and a flow may strain the solvent by
    0.03 in a step at most. For beads, see ``bead_spring_step.bead_spring_time_step``, for beam elements
    ``beam_step.beam_time_step``.

    Parameters
    ----------
    filament_type : FilamentType or BeadSpringType
    viscosity : pressure*time
    temperature : temperature
    scheme : {"implicit", "implicit-second-order", "midpoint", "euler", "modes"}, optional
        That of the fastest engine that is available if not given. "midpoint" and "euler" are explicit and have the
        same bounds; "euler" has a bias on chains that no step removes. "implicit" is not bound by stretching and
        bending, see ``implicit_time_step``. "modes" is for beads.
    segments : int
    closed : bool
        A ring; matters only to "implicit".
    flow : Flow, optional
        Of the solvent.
    friction : SegmentFriction, optional
        Of a segment; that at the given temperature if not given.
    propulsion : float
        F0 of self-propelled filaments, in kJ/(mol nm); matters only to beam elements.
    longest : int, optional
        Segments of a filament that grows when it has grown; matters only to "implicit", which resolves the relaxation
        of the filament then.

    Returns
    -------
    TimeStep
    """
    scheme = default_scheme() if scheme is None else scheme
    check_scheme(scheme)
    require_kind(filament_type, ChainType, "filament_type")
    segments, closed, flow = whole_number(segments, 1, "segments"), true_or_false(closed, "closed"), as_flow(flow)
    longest = None if longest is None else whole_number(longest, segments, "longest")
    propulsion = finite_number(propulsion, ENERGY / LENGTH, "propulsion")
    if friction is not None:
        require_kind(friction, SegmentFriction, "friction")
    positive(viscosity, VISCOSITY, "viscosity")
    thermal_energy(temperature)
    if isinstance(filament_type, BeadSpringType):
        return bead_spring_time_step(filament_type, scheme, segments, closed, flow)
    if scheme == MODES:
        raise InputError(f"Scheme 'modes' moves chains of beads, but no cylinders, such as {filament_type.name!r}.")
    if friction is None:
        friction = filament_type.segment_friction(viscosity, temperature, segments)
    if not filament_type.segment_kind.straight:
        return beam_time_step(filament_type, temperature, scheme, segments, flow, friction, propulsion, closed)
    if scheme in IMPLICIT_SCHEMES:
        return implicit_time_step(
            filament_type, viscosity, temperature, segments, closed, flow, friction, scheme, longest
        )
    bounds = bounds_of_chain(filament_type, friction, segments)
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
        bounds["flow"] = allowed["flow"] = RECOMMENDED_STRAIN / rate
    if filament_type.maximum_extension is not None:
        if scheme in IMPLICIT_SCHEMES:
            resolved, drawn = fene_steps(filament_type, friction, temperature)
            bound = math.inf if min(allowed.values()) >= drawn else resolved
        else:
            bound = fene_bound(filament_type, friction, temperature)
        bounds["range"] = allowed["range"] = bound
    if not any(math.isfinite(step) for step in allowed.values()):
        relaxation = friction.extensional / (filament_type.segment_stiffness * filament_type.segment_length**2)
        bounds[IDLE], allowed[IDLE] = relaxation, relaxation / _RELAXATION_STEPS
    binding = min(allowed, key=allowed.__getitem__)
    reason = _REASONS[binding].format(
        margin=_ACCURACY_MARGIN, angle=angle, relaxation_steps=_relaxation_steps(scheme), strain=RECOMMENDED_STRAIN
    )
    fastest = 4.0 * filament_type.joint_stiffness / friction.rotational
    dynamics = ((scheme, fastest),) if segments > 1 and fastest > 0.0 else ()
    return TimeStep(allowed[binding], reason, bounds, allowed, dynamics=dynamics)


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


def fene_bound(filament_type: ChainType, friction: SegmentFriction, temperature: Scalar) -> float:
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
    stiffness, extension = filament_type.segment_stiffness, cast(float, filament_type.maximum_extension)
    length = filament_type.segment_length
    tau = friction.extensional / (stiffness * length**2)
    if kT == 0.0:
        return 0.1 * tau
    nu = stiffness * extension**2 / kT
    narrow = 10.0 ** (-12.0 / nu)
    edge = narrow / (1.0 + math.sqrt(1.0 - narrow))
    noise = (extension * edge / 5.0) ** 2 * friction.extensional / (2.0 * kT * length**2)
    return min(noise, 0.1 * tau * narrow**2 / (2.0 - narrow))


def fene_steps(filament_type: ChainType, friction: SegmentFriction, temperature: Scalar) -> tuple[float, float]:
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
    require_kind(filament_type, ChainType, "filament_type")
    require_kind(friction, SegmentFriction, "friction")
    if filament_type.stretching_model != "fene":
        raise InputError(
            f"Filament type {filament_type.name!r} has the stretching_model {filament_type.stretching_model!r}: "
            "fene_steps are those of 'fene', with a maximum_extension."
        )
    kT = thermal_energy(temperature)
    stiffness, extension = filament_type.segment_stiffness, cast(float, filament_type.maximum_extension)
    length = filament_type.segment_length
    if kT == 0.0:
        return math.inf, 0.0
    nu = stiffness * extension**2 / kT
    diffusion = extension**2 * friction.extensional / ((length + extension) ** 2 * kT)
    resolved = (1.5e-5 + 6e-4 * nu**2) * diffusion
    drawn = 200.0 * friction.extensional / (nu * stiffness * length**2)
    return (math.inf, 0.0) if resolved >= drawn else (resolved, drawn)


def implicit_time_step(
    filament_type: ChainType,
    viscosity: Scalar,
    temperature: Scalar,
    segments: int = 2,
    closed: bool = False,
    flow: Flow | None = None,
    friction: SegmentFriction | None = None,
    scheme: str = "implicit",
    longest: int | None = None,
) -> TimeStep:
    """The step of an implicit scheme at which equilibrium energies of a chain are good to 2 %, and dynamics to 5 %.

    Its equilibrium is exact for linear forces at any step; what is left comes from segments that turn within one.
    A segment turns by the mean square of what a free segment does, 2 k_B T dt/gamma_rot, or, if that is less, of what
    its neighbours allow: after dt, waves of up to the length xi = (a dt l0/gamma_perp)^(1/4) have relaxed, which turns
    it by k_B T xi/a, and the filament turns as a whole by 24 k_B T dt l0/(gamma_perp L^3). Either must stay below
    0.15^2, or 0.1^2 for scheme "implicit-second-order", with which bends of long filaments are up to 10 % too large at
    0.15 rad. Measured with ``python studies benchmark time-step``, F-actin, microtubules, DNA and chains with free
    joints keep equilibrium within 5 % and dynamics within 10 % at that step and at several times as much. A step must
    also resolve the slowest relaxation of the filament, by 20 steps, or 2 of scheme "implicit-second-order", which is
    1 % too fast there: gamma_perp/(l0 a) (L/4.73)^4, or that of the mode in which a ring of radius R becomes oval,
    gamma_perp/(l0 a) R^4/9 = gamma_perp/(l0 a) (L/10.9)^4. (With the friction along the ring it is (gamma_perp +
    gamma_par/4)/(l0 a) R^4/9.) Of a filament that grows that is the relaxation when it is longest: those of shorter
    ones are over within a step then, and bends and lengths are in equilibrium all the same.

    Stiff lengths do not bound the step, nor does their friction: that acts on true changes of a length, so a segment
    turns freely however slowly its length relaxes, and the length needs a run that is longer than tau_l, not shorter
    steps. Soft ones do: with the variance s l0^2 of a length (s = k_B T/(k l0^2) for a spring), V_el of N segments is
    measured to be too large by 16 s/N at most, at steps of tau = gamma_def/(k l0^2) and longer. Where that is more than
    0.8 %, the step may be 0.0008 N gamma_def/k_B T, which leaves 0.8 %. FENE lengths may bind it, see ``fene_steps``.
    At a temperature of zero, where nothing else moves (one segment, or free joints), the relaxation of a segment's
    length is resolved by 20 steps.
    """
    kT = thermal_energy(temperature)
    if friction is None:
        friction = filament_type.segment_friction(viscosity, temperature, segments)
    length, rigidity = filament_type.segment_length, filament_type.bending_rigidity
    friction_per_length = friction.perpendicular / length
    square_angle = _IMPLICIT_TURNING_ANGLE[scheme] ** 2
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
    most = segments if longest is None else longest
    if most > 1 and rigidity > 0.0:
        wave_number = _OVAL_MODE if closed else 4.73
        bounds["relaxation"] = friction_per_length * (most * length / wave_number) ** 4 / rigidity
        allowed["relaxation"] = bounds["relaxation"] / _relaxation_steps(scheme)
    angle = math.sqrt(square_angle)
    return _binding(filament_type, friction, temperature, scheme, segments, flow, bounds, allowed, angle)


def _relaxation_steps(scheme):
    return _RELAXATION_STEPS_OF_SECOND_ORDER if scheme == "implicit-second-order" else _RELAXATION_STEPS


def contact_time_step(
    filament_type: ChainType,
    viscosity: Scalar,
    temperature: Scalar,
    diameter: Scalar,
    stiffness: Scalar,
    segments: int = 2,
    beads_per_segment: float = 1.0,
    confidence: float = 3.0,
) -> TimeStep:
    """The step at which filaments of one type with contacts do not pass through each other.

    It is the lesser of two bounds: (56) with the contact diameter, which keeps ends from diffusing by more than half of
    it in a step, and a quarter of ``contact_stiffness_bound``. The fluctuations of a contact are then too large by a
    third at most, and a filament in a bundle, which six others touch, is stable, too.

    Parameters
    ----------
    viscosity : pressure*time
    diameter : length
        Contact diameter.
    stiffness : energy/length^2
        Of a contact between two beads, as of ``contacts.contact_force``.
    confidence : float
        c_sigma of eq. (53): how many standard deviations of a displacement must stay below half the diameter.
    """
    friction = filament_type.segment_friction(viscosity, temperature, segments)
    length = filament_type.segment_length
    confidence = positive(confidence, DIMENSIONLESS, "confidence")
    bounds = {
        "contact diffusion": diffusion_bound(friction, diameter, length, temperature, confidence),
        "contact stiffness": contact_stiffness_bound(friction, length, stiffness, beads_per_segment),
    }
    allowed = {**bounds, "contact stiffness": bounds["contact stiffness"] / _CONTACT_MARGIN}
    binding = min(allowed, key=allowed.__getitem__)
    return TimeStep(allowed[binding], _REASONS[binding].format(contact_margin=_CONTACT_MARGIN), bounds, allowed)


def contact_diffusion_step(
    filament_type: ChainType,
    friction: SegmentFriction,
    temperature: Scalar,
    diameter: Scalar,
    confidence: float = 3.0,
) -> TimeStep:
    """The part of ``contact_time_step`` that does not depend on the stiffness of contacts."""
    confidence = positive(confidence, DIMENSIONLESS, "confidence")
    bound = diffusion_bound(friction, diameter, filament_type.segment_length, temperature, confidence)
    bounds = {"contact diffusion": bound}
    return TimeStep(bound, _REASONS["contact diffusion"], bounds, dict(bounds))
