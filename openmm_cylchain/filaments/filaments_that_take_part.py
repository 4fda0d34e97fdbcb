"""Those of a collection of filaments that take part in what happens, as a collection of their own."""

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np

from ..units.types import IntArray
from .attachments import Attachment
from .collection import FilamentCollection
from .filament import Filament


class FilamentsThatTakePart:
    """A FilamentCollection without the filaments that stand aside; ``numbers`` are those of the others."""

    def __init__(self, filaments: FilamentCollection) -> None:
        self._filaments = filaments
        self.numbers = [number for number, own in enumerate(filaments) if own.takes_part]

    def __getattr__(self, name: str) -> Any:
        return getattr(self._filaments, name)

    def __len__(self) -> int:
        return len(self.numbers)

    def __getitem__(self, index: int) -> Filament:
        return self._filaments[self.numbers[index]]

    def __iter__(self) -> Iterator[Filament]:
        return (self._filaments[number] for number in self.numbers)

    @property
    def node_indices(self) -> list[IntArray]:
        """Of their nodes."""
        return [self._filaments.node_indices[number] for number in self.numbers]

    @property
    def control_point_indices(self) -> list[IntArray]:
        """Of their control points."""
        return [self._filaments.control_point_indices[number] for number in self.numbers]

    @property
    def bead_indices(self) -> list[IntArray]:
        """Of their beads."""
        every = self._filaments.bead_indices
        return [every[number] for number in self.numbers]

    @property
    def attachments(self) -> tuple[Attachment, ...]:
        """On them, with their numbers here."""
        place = {number: index for index, number in enumerate(self.numbers)}
        every = (own for own in self._filaments.attachments if own.filament in place)
        return tuple(replace(own, filament=place[own.filament]) for own in every)

    @property
    def attachment_indices(self) -> IntArray:
        """Particles of their attachment points."""
        own = [self._filaments[one.filament].takes_part for one in self._filaments.attachments]
        return self._filaments.attachment_indices[np.array(own, dtype=bool)]
