"""What filaments of beam elements cannot have as yet: an error in place of a wrong result."""

from collections.abc import Iterable
from typing import Any

from ..errors import InputError


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
