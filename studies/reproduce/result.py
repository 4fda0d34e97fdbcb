"""Results beside the numbers of a paper and the theory, and the rule that judges them.

A verdict is computed from the numbers, never written down, and every rule can turn it: a result that is too uncertain
to see a deviation does not agree with anything.
"""

import math
from dataclasses import dataclass

import numpy as np

from benchmark.measurement import Estimate
from openmm_cylchain.errors import InputError

AGREES, DIFFERS = "agrees", "differs"


@dataclass(frozen=True)
class Printed:
    """A number as it is printed in a paper.

    Attributes
    ----------
    value : float
    error : float
        The printed standard error, 0 if there is none.
    rounding : float
        Half a unit of the last digit.
    """

    value: float
    error: float = 0.0
    rounding: float = 0.0


def printed(text, error="0"):
    """A Printed from its text, such as "2.685" or "20.8e3", which tells how it was rounded.

    Parameters
    ----------
    text, error : str
    """
    try:
        value, uncertainty = float(text), float(error)
    except (TypeError, ValueError):
        raise InputError(
            f"A printed number must be the text of one, but is {text!r} with the error {error!r}."
        ) from None
    if not (math.isfinite(value) and math.isfinite(uncertainty) and uncertainty >= 0):
        raise InputError(f"A printed number must be finite, but is {text!r} with the error {error!r}.")
    mantissa, _, exponent = text.lower().partition("e")
    decimals = len(mantissa.partition(".")[2])
    return Printed(value, uncertainty, 0.5 * 10.0 ** (int(exponent or 0) - decimals))


@dataclass(frozen=True)
class Rule:
    """When a result agrees.

    |ours - theory| <= n s + b |theory| and |ours - paper| <= n sqrt(s^2 + s_paper^2) + b |paper| + rounding, with the
    standard error s of ours.

    Attributes
    ----------
    standard_errors : float
        n.
    tolerance : float
        b, the share by which a finite time step or a finite sample may bias ours.
    resolution : float, optional
        Largest standard error of ours, as a share of the theory, or of the paper's value where there is no theory.
        Above it nothing agrees.
    """

    standard_errors: float = 3.0
    tolerance: float = 0.0
    resolution: float | None = None

    relation = ""
    """What stands before the number of the paper."""

    def allows(self, difference, error, value, rounding):
        """Whether ours may differ so much from a value of the paper or the theory.

        Parameters
        ----------
        difference : float
            Ours less the value.
        error : float
            The standard error of the difference.
        value : float
        rounding : float
            Of the value.
        """
        return abs(difference) <= self.standard_errors * error + self.tolerance * abs(value) + rounding

    def __str__(self):
        if self.standard_errors == 0:
            return f"the theory to {self.tolerance:g}, and the print as it is rounded"
        text = f"within {self.standard_errors:g} standard errors"
        if self.tolerance:
            text += f" and {100 * self.tolerance:g} %"
        if self.resolution is not None:
            text += f", with a standard error of at most {100 * self.resolution:g} %"
        return text


ROUNDING = Rule(0.0, 1e-7)
"""For closed forms: ours is the theory, and rounds to what is printed."""


@dataclass(frozen=True)
class LowerBound:
    """When a result agrees with a paper, or a theory, that says "more than".

    ours - value >= n s, with the standard error s of the difference.

    Attributes
    ----------
    standard_errors : float
        n.
    """

    standard_errors: float = 3.0

    resolution = None
    relation = "> "

    def allows(self, difference, error, value, rounding):
        """Whether ours surely lies above a value; see ``Rule.allows``."""
        return difference >= self.standard_errors * error

    def __str__(self):
        return f"above by at least {self.standard_errors:g} standard errors"


@dataclass(frozen=True)
class AtMost:
    """When a result agrees with a paper, or a theory, that gives a limit: ours is not surely above it.

    ours - value <= n s, with the standard error s of the difference.

    Attributes
    ----------
    standard_errors : float
        n.
    resolution : float, optional
        See ``Rule``.
    """

    standard_errors: float = 3.0
    resolution: float | None = None

    relation = "≤ "

    def allows(self, difference, error, value, rounding):
        """Whether ours may lie below a value; see ``Rule.allows``."""
        return difference <= self.standard_errors * error + rounding

    def __str__(self):
        text = f"not above by more than {self.standard_errors:g} standard errors"
        if self.resolution is not None:
            text += f", with a standard error of at most {100 * self.resolution:g} %"
        return text


@dataclass(frozen=True)
class AtLeast(AtMost):
    """The same of a lower limit: ours is not surely below it."""

    relation = "≥ "

    def allows(self, difference, error, value, rounding):
        """Whether ours may lie above a value; see ``Rule.allows``."""
        return difference >= -self.standard_errors * error - rounding

    def __str__(self):
        return super().__str__().replace("above", "below")


@dataclass(frozen=True)
class Result:
    """One number.

    Attributes
    ----------
    name : str
        For files: words joined by underscores.
    unit : str
        "1" for a number without a unit.
    ours : Estimate
    rule : Rule, LowerBound, AtMost or AtLeast
    theory : float, optional
    paper : Printed, optional
    cause : str
        Why the paper's number is expected to be off, if it is; part of the reason if the verdict is "differs" although
        ours agrees with the theory.

    Raises
    ------
    InputError
        If there is neither a theory nor a paper's number, or a number that is not finite.
    """

    name: str
    unit: str
    ours: Estimate
    rule: Rule | LowerBound | AtMost
    theory: float | None = None
    paper: Printed | None = None
    cause: str = ""

    def __post_init__(self):
        if self.theory is None and self.paper is None:
            raise InputError(f"Result {self.name} has nothing to be compared with.")
        numbers = [self.ours.value, self.ours.error, self.theory, self.paper and self.paper.value]
        if not all(number is None or np.isfinite(number) for number in numbers):
            raise InputError(f"Result {self.name} must have finite numbers, but has {numbers}.")

    @property
    def resolved(self):
        """Whether the standard error is small enough for a verdict."""
        if self.rule.resolution is None:
            return True
        scale = self.paper.value if self.theory is None else self.theory
        return self._error <= self.rule.resolution * abs(scale)

    @property
    def agrees_with_theory(self):
        """Whether ours is as close to the theory as the rule says; true if there is none."""
        if self.theory is None:
            return True
        return self.rule.allows(self.ours.value - self.theory, self._error, self.theory, 0.0)

    @property
    def agrees_with_paper(self):
        """Whether ours is as close to the paper's number as the rule says; true if there is none."""
        if self.paper is None:
            return True
        difference, error = self.ours.value - self.paper.value, math.hypot(self._error, self.paper.error)
        return self.rule.allows(difference, error, self.paper.value, 1.001 * self.paper.rounding)

    @property
    def verdict(self):
        """ "agrees" or "differs"."""
        return AGREES if self.resolved and self.agrees_with_theory and self.agrees_with_paper else DIFFERS

    @property
    def unexplained(self):
        """Whether it differs from the theory, or from the paper without a cause, or is too uncertain."""
        if not (self.resolved and self.agrees_with_theory):
            return True
        return not self.agrees_with_paper and not self.cause

    @property
    def reason(self):
        """Why it differs; empty if it agrees."""
        reasons = []
        if not self.resolved:
            reasons.append(f"the standard error {self._error:.2g} is too large for a verdict")
        if not self.agrees_with_theory:
            reasons.append(self._deviation("theory", self.theory, self._error))
        if not self.agrees_with_paper:
            error = math.hypot(self._error, self.paper.error)
            reasons.append(self._deviation("paper", self.paper.value, error))
            if self.cause and self.resolved and self.agrees_with_theory:
                reasons.append(self.cause)
        return "; ".join(reasons)

    @property
    def _error(self):
        return self.ours.error or 0.0

    def _deviation(self, what, value, error):
        text = f"{what}: "
        if value and not 0.5 < self.ours.value / value < 2.0:
            text += f"{self.ours.value / value:.2g} times as much"
        else:
            text += f"{100 * (self.ours.value / value - 1):+.2g} %" if value else f"{self.ours.value - value:+.2g}"
        return text + (f", {abs(self.ours.value - value) / error:.1f} standard errors" if error else "")

    def _paper_as_dict(self):
        error = self.paper.error or None
        return {"value": self.paper.value, "error": error, "relation": self.rule.relation}

    def as_dict(self):
        """What results.json says of it."""
        return {
            "name": self.name,
            "unit": self.unit,
            "paper": None if self.paper is None else self._paper_as_dict(),
            "theory": self.theory,
            "ours": {"value": self.ours.value, "error": self.ours.error},
            "rule": str(self.rule),
            "verdict": self.verdict,
            "reason": self.reason,
            "unexplained": self.unexplained,
        }
