"""What filaments of beam elements, with twist or that grow cannot have as yet: an error in place of a wrong result."""

from collections.abc import Iterable
from typing import Any

from ..errors import InputError
from .twist import has_twist

HELD_BY_LINKERS = "Linkers whose hands never unbind hold it as well: add_linkers(..., places=...)."
"""What to do instead of a crosslink or an attachment of a filament that grows."""


def refuse_beams(filaments: Iterable[Any], what: str) -> None:
    """Raise InputError, naming the first filament of beam elements, for something that knows straight segments alone.

    Filaments are anything that has a ``type``; ``what`` cannot have them, such as "contacts of capsules".
    """
    for number, filament in enumerate(filaments):
        kind = filament.type.segment_kind
        if not kind.straight:
            raise InputError(
                f"Filament {number} ({filament.type.name}) has {kind.name}s, which {what} cannot have as yet: give its "
                "type element='straight'."
            )


def refuse_twist(filaments: Iterable[Any], what: str) -> None:
    """Raise InputError, naming the first filament with twist, for something that knows none."""
    for number, filament in enumerate(filaments):
        if has_twist(filament.type):
            raise InputError(
                f"Filament {number} ({filament.type.name}) has twist, which {what} cannot have as yet: leave out "
                "torsional_rigidity and twist_persistence_length of its type."
            )


def refuse_growth(filaments: Iterable[Any], what: str, advice: str = "") -> None:
    """Raise InputError, naming the first filament that grows, for something that needs nodes that stay.

    Filaments are anything that has a ``type`` and a ``growth``. ``what`` is what cannot have it, such as "a tether",
    and ``advice`` a sentence.
    """
    for number, filament in enumerate(filaments):
        if filament.growth is not None:
            raise InputError(growth_refusal(f"Filament {number} ({filament.type.name})", what, advice))


def growth_refusal(label: str, what: str, advice: str = "") -> str:
    """What is said of a filament that grows, which is known by a label."""
    sentence = f"{label} grows, so that its nodes come and go: {what} cannot have it as yet."
    return f"{sentence} {advice}" if advice else sentence
