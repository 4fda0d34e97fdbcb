"""What filaments that grow cannot have as yet: an error in place of a wrong result."""

from collections.abc import Iterable
from typing import Any

from ..errors import InputError

HELD_BY_LINKERS = "Linkers whose hands never unbind hold it as well: add_linkers(..., places=...)."
"""What to do instead of a crosslink or an attachment."""


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
