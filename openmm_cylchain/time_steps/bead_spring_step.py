"""Recommended steps and bounds of bead-spring chains.

Equation and table numbers refer to Panja, Barkema and van Leeuwen, PRE 2015, 92, 032603. Times are in units of
tau = xi/lambda there and here; results in ps.
"""

import math

from ..bead_spring.bead_spring_type import BeadSpringType
from ..errors import InputError
from ..filaments.filament import Filament
from ..mechanics.flow import Flow
from .schemes import EXPLICIT_SCHEMES, MODES, check_scheme
from .time_step import RECOMMENDED_STRAIN, TimeStep, strain_rate

EXPLICIT_MARGIN = 20.0
"""Below ``bead_spring_stability_bound``, as for cylinders: 1/20 makes no variance more than 5 % too large."""

EULER_STEP = 0.1
"""tau, at nu = 0.35: of Section III A."""

MODES_STEP, LARGEST_MODES_STEP = 10.0, 100.0
"""tau, at nu = 0.35: of 63 bonds, and of 255 bonds and more, in the final column of Table II."""

IMPLICIT_STEPS = {"implicit": 1e4, "implicit-second-order": 1e3}
"""tau, at nu = 0.35, of RESOLVING_BONDS and more."""

RESOLVING_BONDS = 63

SHORTEST_IMPLICIT_STEP, SINGLE_BOND_STEP = 10.0, 0.3
"""tau, at nu = 0.35: of few bonds, and of a single one, which turns too far in more (in 10 tau, 9 % are divided)."""

_NU = 0.35
# Down to which the error of scheme "modes" is measured to be the same at the same step in tau.
_SMALLEST_NU = 0.0117
_RING = 4.73 / (4.0 * math.pi * math.sqrt(0.75))
_REASONS = {
    "springs": "relaxation of the stiffest mode of the springs, with a margin of {margin:.2g}",
    "modes": "coupling of modes, which scheme 'modes' leaves out of those that relax within a step (Table II): chains "
    "have the right size, but bonds and bends too much energy",
    "bends": "relaxation of bends, which an implicit scheme resolves over ten steps",
    "flow": "flow, which may strain the solvent by {strain:g} in a step",
}


def refuse_modes(filament: Filament, label: str) -> None:
    """Raise InputError unless a filament is an open chain of beads that are all free, as scheme "modes" moves them."""
    if not isinstance(filament.type, BeadSpringType):
        raise InputError(f"{label}: scheme 'modes' moves chains of beads (a BeadSpringType), but no cylinders.")
    if filament.closed or filament.clamped:
        what = "a ring" if filament.closed else "clamped"
        raise InputError(f"{label} is {what}: scheme 'modes' moves open chains whose beads are all free.")


def bead_spring_stability_bound(bead_type: BeadSpringType) -> float:
    """The step, in ps, above which explicit schemes blow up the stiffest mode of a chain: tau/(2 (1 + 2 nu)).

    Neighbouring beads that move against each other along the chain relax with zeta^l = 4 (1 + 2 nu), eq. (27). It is
    0.29 tau at nu = 0.35, where the paper finds 0.3.
    """
    return bead_type.time_unit / (2.0 * (1.0 + 2.0 * bead_type.nu))


def bead_spring_time_step(
    bead_type: BeadSpringType, scheme: str, bonds: int, closed: bool = False, flow: Flow | None = None
) -> TimeStep:
    """The recommended step of a chain of beads, at which <L^2> is right within 2 %, with scheme "modes" within 5 %.

    - "euler" and "midpoint": 1/20 of ``bead_spring_stability_bound``, which is 0.015 tau at nu = 0.35. No mode has a
      variance more than 5 % too large; energies of bends are 1.2 % too large, of bonds less. With the 0.1 tau of
      Section III A, <L^2> is right within 0.2 %, too, but bends of 16 bonds have 11 % too much energy.
    - "modes": 10 tau ((N+1)/64)^2, and no more than 100 tau. A step h uncouples the modes that relax within it, and
      <L^2> is measured to be too small by about 0.42 sqrt(h/tau)/(N+1), as if the ends of the chain were too short: for
      3 to 31 bonds, 1 to 30 tau, nu from 0.0117 to 0.45 and T* from 0.001 to 0.3. So chains err by some 2 %, as the
      shortest of Table II does.
      At smaller nu steps are shorter in proportion. Energies of bonds and bends are not right at all: those of a
      chain of 63 at 10 tau are 55 and 19 % too large.
    - "implicit": 1e4 tau for 63 bonds and more, where correlations of the end-to-end vector lose 4 % too little over
      three steps and 2 % over ten; of fewer bonds as their slowest relaxation, with (N+1)^4, but 10 tau at least, or
      0.3 tau of a single bond. At a smaller nu they are shorter by nu/0.35: what holds lengths is stiffer against what
      bends.
      "implicit-second-order": a tenth of that, where they lose 8 % too much over three steps.

    Parameters
    ----------
    closed : bool
        A ring relaxes as an open chain that is 2.3 times shorter.
    flow : Flow, optional
        It may strain the solvent by 0.03 in a step.
    """
    check_scheme(scheme)
    unit, bound = bead_type.time_unit, bead_spring_stability_bound(bead_type)
    beads = (bonds + 1) * (_RING if closed else 1.0)
    if scheme in EXPLICIT_SCHEMES:
        name, step = "springs", bound / EXPLICIT_MARGIN
    elif scheme == MODES:
        # In steps of Euler's scheme hardly a mode is uncoupled.
        name, euler = "modes", EULER_STEP * 2.0 * (1.0 + 2.0 * _NU) * bound
        bound = step = max(euler, unit * _modes_step(beads) * min(1.0, bead_type.nu / _SMALLEST_NU))
    else:
        name = "bends"
        bound = step = unit * min(1.0, bead_type.nu / _NU) * _implicit_step(scheme, bonds, beads)
    bounds, allowed = {name: bound}, {name: step}
    rate = 0.0 if flow is None else strain_rate(flow)
    if rate > 0.0:
        bounds["flow"] = allowed["flow"] = RECOMMENDED_STRAIN / rate
    binding = min(allowed, key=allowed.__getitem__)
    reason = _REASONS[binding].format(margin=bounds[binding] / allowed[binding], strain=RECOMMENDED_STRAIN)
    fastest = 16.0 * bead_type.bending_stiffness / bead_type.bead_friction
    dynamics = ((scheme, fastest),) if bonds > 1 else ()
    return TimeStep(allowed[binding], reason, bounds, allowed, dynamics=dynamics)


def _modes_step(beads):
    return min(MODES_STEP * (beads / 64.0) ** 2, LARGEST_MODES_STEP)


def _implicit_step(scheme, bonds, beads):
    if bonds == 1:
        return SINGLE_BOND_STEP
    return max(SHORTEST_IMPLICIT_STEP, IMPLICIT_STEPS[scheme] * min(1.0, (beads / (RESOLVING_BONDS + 1)) ** 4))
