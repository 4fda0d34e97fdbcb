"""The rule by which a step is right or wrong: what ``step_check`` says of errors and their standard errors."""

import math

import scipy

LARGEST_ERROR = 0.05
"""Relative error up to which a step is right."""

DIVERGED = 100.0
"""Relative error from which on a step is wrong, whatever the standard error."""

SIGMAS = 4.0
"""Standard errors in an error bar, of those that are known."""


def sigmas(degrees: float) -> float:
    """Standard errors, estimated with so many degrees of freedom, in an error bar that is as safe: of Student's t."""
    return float(scipy.special.stdtrit(degrees, scipy.special.ndtr(SIGMAS))) if degrees > 0.0 else math.inf


def surely_large(error: float, error_bar: float) -> bool:
    """Whether an error is beyond ``LARGEST_ERROR`` by more than chance."""
    return abs(error) - error_bar > LARGEST_ERROR or diverged(error)


def diverged(error: float) -> bool:
    """Whether an error is beyond what any error bar could explain, or NaN."""
    # Written so that NaN has.
    return not abs(error) <= DIVERGED
