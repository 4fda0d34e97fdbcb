"""What filaments of beam elements cannot have as yet: an error in place of a wrong result."""

from collections.abc import Iterable

from ..errors import InputError
from .filament import Filament


def refuse_beams(filaments: Iterable[Filament], what: str) -> None:
    """Raise InputError, naming the first filament of beam elements, for something that knows straight segments alone.

    Parameters
    ----------
    filaments : iterable of Filament
    what : str
        That cannot have them, such as "contacts of capsules".
    """
    for number, filament in enumerate(filaments):
        if filament.type.has_beam_elements:
            raise InputError(
                f"Filament {number} ({filament.type.name}) has beam elements, which {what} cannot have as yet: give "
                "its type element='straight'."
            )
