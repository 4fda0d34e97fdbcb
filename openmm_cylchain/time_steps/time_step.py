"""A time step and why it is not larger, and which relaxation it resolves."""

import math
from collections.abc import Iterable
from dataclasses import dataclass, field

import numpy as np
import scipy

from ..errors import InputError
from ..mechanics.flow import Flow
from ..units.quantities import DIMENSIONLESS, TIME, non_negative, positive, require_kind, shown
from ..units.text import format_time
from ..units.types import Scalar
from .schemes import amplification_of_second_order, check_scheme

RECOMMENDED_STRAIN = 0.03
"""By how much a flow may strain the solvent in a step."""

IDLE = "length"
"""The bound that holds where nothing but the relaxation of lengths is left to resolve."""


def strain_rate(flow: Flow) -> float:
    """The fastest rate, in 1/ps, at which a flow strains the solvent: the norm of its gradient."""
    return float(np.linalg.norm(flow.gradient, 2))


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
    bounds: dict[str, float]
    allowed: dict[str, float] = field(default_factory=dict)
    unknown_forces: tuple[str, ...] = ()
    dynamics: tuple[tuple[str, float], ...] = ()

    def __post_init__(self) -> None:
        # Infinite where nothing bounds it.
        if not (isinstance(self.step, float) and self.step == math.inf):
            object.__setattr__(self, "step", positive(self.step, TIME, "TimeStep: step"))
        require_kind(self.reason, str, "TimeStep: reason")
        for name, kind in (("bounds", dict), ("allowed", dict), ("unknown_forces", tuple), ("dynamics", tuple)):
            require_kind(getattr(self, name), kind, f"TimeStep: {name}")
        for force in self.unknown_forces:
            require_kind(force, str, "TimeStep: one of unknown_forces")
        for pair in self.dynamics:
            if not (isinstance(pair, tuple) and len(pair) == 2):
                raise InputError(f"TimeStep: dynamics must be pairs of a scheme and a rate, but one is {shown(pair)}.")

    def resolved_relaxation_time(self, error: float = 0.05) -> float:
        """The shortest relaxation time, in ps, of a mode of bending whose rate is right within ``error`` at the step.

        See ``resolved_relaxation_time`` of this module. Zero if it holds no filaments.
        """
        times = [resolved_relaxation_time(self.step, scheme, error, fastest) for scheme, fastest in self.dynamics]
        return max(times, default=0.0)

    def describe_dynamics(self) -> str:
        """What holds of relaxation at the step, in words; its equilibrium is right for all modes."""
        if not self.dynamics:
            return "no modes of bending"
        five, ten = (format_time(self.resolved_relaxation_time(error), 3) for error in (0.05, 0.10))
        return f"modes of bending that relax in {five} or longer are right to 5 %, in {ten} or longer to 10 %"

    def __str__(self) -> str:
        unknown = f"; not known: {', '.join(self.unknown_forces)}" if self.unknown_forces else ""
        return f"{format_time(self.step, 4)}: {self.reason}{unknown}"


def as_step(step: Scalar | TimeStep, name: str = "step_size") -> float:
    """A time step in ps: of a TimeStep, or of a quantity or plain number that must be positive."""
    return positive(step.step if isinstance(step, TimeStep) else step, TIME, name)


def shortest(steps: Iterable[TimeStep]) -> TimeStep:
    """The TimeStep that binds of several, with the bounds of all of them, each at its shortest."""
    steps = list(steps)
    if any(math.isfinite(one.step) and IDLE not in one.bounds for one in steps):
        # The relaxation of lengths counts only where there is nothing else to resolve.
        steps = [one for one in steps if IDLE not in one.bounds]
    least = min(steps, key=lambda one: one.step)
    bounds: dict[str, float] = {}
    allowed: dict[str, float] = {}
    for one in steps:
        for name, value in one.allowed.items():
            if value < allowed.get(name, math.inf) or name not in allowed:
                allowed[name], bounds[name] = value, one.bounds[name]
    unknown = tuple(dict.fromkeys(force for one in steps for force in one.unknown_forces))
    dynamics = tuple(dict.fromkeys(each for one in steps for each in one.dynamics))
    return TimeStep(least.step, least.reason, bounds, allowed, unknown, dynamics)


_SMALLEST_ERROR = 1e-4

# R(z, theta): what is left, after a step, of a mode that relaxes by z = lambda h in it.
_DECAYS = {
    "euler": lambda z, theta: 1.0 - z,
    "midpoint": lambda z, theta: 1.0 - z,
    "implicit": lambda z, theta: (1.0 - (1.0 - theta) * z) / (1.0 + theta * z),
    "implicit-second-order": lambda z, theta: float(amplification_of_second_order(z)),
    "modes": lambda z, theta: math.exp(-z),
}


def effective_rate(step: Scalar | TimeStep, scheme: str, rate: Scalar, fastest_rate: Scalar = 0.0) -> float:
    """The rate, in 1/ps, at which a mode of bending of the rate ``rate`` relaxes in steps of a length: ``-ln(R)/h``.

    R is what is left of the mode after one step, with z = lambda h:

    - "euler" and "midpoint": R = 1 - z
    - "implicit": R = (1 - (1 - theta) z)/(1 + theta z) with theta = max(1/2, 1 - 1/z') for all modes of a chain, z'
      being the step times the rate of the sharpest bend, 4 K/gamma_rot. Steps that do not resolve that one relax as
      those of the implicit Euler method, R = 1/(1 + z), steps that do as Crank and Nicolson's.
    - "implicit-second-order": ``schemes.amplification_of_second_order``.
    - "modes": R = exp(-z), of modes alone. What couples them is another matter.

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
    rate, fastest_rate = positive(rate, TIME**-1, "rate"), non_negative(fastest_rate, TIME**-1, "fastest_rate")
    return rate * _rate_ratio(scheme, step * rate, _theta(step * fastest_rate))


def _theta(fastest):
    return max(0.5, 1.0 - 1.0 / fastest) if fastest > 0.0 else 0.5


def _rate_ratio(scheme, z, theta):
    left = _DECAYS[scheme](z, theta)
    return -math.log(left) / z if left > 0.0 else math.inf


def resolved_relaxation_time(
    step: Scalar | TimeStep, scheme: str, error: float = 0.05, fastest_rate: Scalar = 0.0
) -> float:
    """The shortest relaxation time, in ps, of a mode of bending that relaxes at a rate right to within ``error``.

    By ``effective_rate``. At long steps of scheme "implicit" it is 9.3 steps for 5 % and 4.3 for 10 %, of scheme
    "implicit-second-order" 1.0 and 0.8; the explicit schemes need 10.7 and 5.7.

    Parameters
    ----------
    step : time
    error : float
        Of the rate, above 0 and below 1.
    fastest_rate : 1/time
        As for ``effective_rate``. With zero, there are no bends, and every relaxation is taken as slow.
    """
    check_scheme(scheme)
    step = as_step(step, "step")
    error = positive(error, DIMENSIONLESS, "error")
    if not _SMALLEST_ERROR <= error < 1.0:
        raise InputError(f"error must be between {_SMALLEST_ERROR:g} and 1, but is {error:g}.")
    theta = _theta(step * non_negative(fastest_rate, TIME**-1, "fastest_rate"))

    def excess(logarithm):
        return min(abs(_rate_ratio(scheme, math.exp(logarithm), theta) - 1.0), 1.0) - error

    grid = np.log(np.geomspace(1e-4, 10.0, 400))
    beyond = [index for index in range(1, len(grid)) if excess(grid[index]) > 0.0]
    if not beyond:
        return step * math.exp(-grid[-1])
    first = beyond[0]
    return step * math.exp(-scipy.optimize.brentq(excess, grid[first - 1], grid[first]))
