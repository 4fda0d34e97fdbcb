"""Those of a collection of filaments that take part in a coupling, as a collection of their own."""

from collections.abc import Iterable, Iterator
from dataclasses import replace
from typing import Any

import numpy as np

from ..units.types import IntArray
from .attachments import Attachment
from .collection import FilamentCollection
from .filament import Filament


class FilamentsThatTakePart:
    """A FilamentCollection of the filaments with some ``numbers``."""

    def __init__(self, filaments: FilamentCollection, numbers: Iterable[int]) -> None:
        self._filaments = filaments
        self.numbers = list(numbers)

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
        own = np.isin([one.filament for one in self._filaments.attachments], self.numbers)
        return self._filaments.attachment_indices[own]
