"""What a line of ``twist.csv`` says, and the twists of all joints in a file that grows."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import cast

import numpy as np
import openmm

from ..filaments.collection import FilamentCollection
from ..filaments.filament_type import FilamentType
from ..filaments.twist import has_twist
from .record_file import RecordFile


def rows_of_twist(
    filaments: FilamentCollection, context: openmm.Context, numbers: Iterable[int]
) -> Iterator[tuple[float, ...]]:
    """What lines of TWIST_COLUMNS say behind step and time, for filaments with some numbers.

    The torque is the mean of (C/l0) (m - m0) over joints between segments.
    """
    for number in numbers:
        twists = filaments.in_context(context).twists(number)._value
        kind = cast(FilamentType, filaments[number].type)
        yield number, float(twists.sum()), float(kind.twist_stiffness * (twists[1:-1] - kind.rest_twist).mean())


class TwistFile(RecordFile):
    """A RecordFile with a record at each report: its step, and the twists in radians of all filaments that have any.

    Those of the joints to the frames of ends are among them.
    """

    def __init__(self, path: Path, filaments: FilamentCollection, count: int | None = None) -> None:
        self._filaments = filaments
        self._numbers = [number for number, own in enumerate(filaments) if has_twist(own.type)]
        joints = sum(filaments[number].twists for number in self._numbers)
        super().__init__(path, np.dtype([("step", "<i8"), ("twists", "<f8", (joints,))]), "twists", count)

    def measure(self, context: openmm.Context, step: int) -> None:
        """Write the record of a Context."""
        here = self._filaments.in_context(context)
        record = np.zeros(1, dtype=self._dtype)
        record["step"] = step
        record["twists"] = np.concatenate([self._twists_of(here, number) for number in self._numbers])
        self.write(record)

    def _twists_of(self, here, number):
        # A filament that has gone has none.
        filament = self._filaments[number]
        return here.twists(number)._value if filament.takes_part else np.zeros(filament.twists)
