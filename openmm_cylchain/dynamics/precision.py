"""The precision that the steps of filaments are computed in."""

from ..errors import InputError
from ..units.quantities import shown

PRECISIONS = ("automatic", "mixed", "double")


def check_precision(precision: str) -> None:
    """Raise InputError unless ``precision`` names one of filaments."""
    if precision not in PRECISIONS:
        raise InputError(f"precision must be one of {', '.join(PRECISIONS)}, but is {shown(precision)}.")
