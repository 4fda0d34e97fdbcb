"""The rule by which a step is right or wrong: what ``step_check`` says of errors and their standard errors."""

LARGEST_ERROR = 0.05
"""Relative error up to which a step is right."""

DIVERGED = 100.0
"""Relative error from which on a step is wrong, whatever the standard error."""

SIGMAS = 4.0
"""Standard errors in an error bar."""


def surely_large(error: float, standard_error: float) -> bool:
    """Whether an error is beyond ``LARGEST_ERROR`` by more than chance."""
    return abs(error) - SIGMAS * standard_error > LARGEST_ERROR or diverged(error)


def diverged(error: float) -> bool:
    """Whether an error is beyond what any error bar could explain, or NaN."""
    # Written so that NaN has.
    return not abs(error) <= DIVERGED
