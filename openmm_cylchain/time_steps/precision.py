"""The precision that the steps of filaments are computed in."""

from collections.abc import Iterable
from typing import Any

from ..errors import InputError
from ..units.quantities import one_of

PRECISIONS = ("automatic", "mixed", "double")


def check_precision(precision: str) -> None:
    """Raise InputError unless ``precision`` names one of filaments."""
    one_of(precision, PRECISIONS, "precision")


def refuse_mixed_precision_of_beams(filaments: Iterable[Any], precision: str) -> None:
    """Raise InputError if ``precision`` is "mixed" and all filaments, each with a ``type``, have beam elements.

    Their steps are in double precision. Beside others, they are as filaments in which "mixed" would not do.
    """
    straight = [one.type.segment_kind.straight for one in filaments]
    if precision == "mixed" and straight and not any(straight):
        raise InputError(
            'precision "mixed" is for filaments of straight segments, but all of these have beam elements, whose steps '
            'are in double precision: choose "automatic" or "double".'
        )
