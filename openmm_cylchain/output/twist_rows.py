"""What a line of ``twist.csv`` says."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import cast

import openmm

from ..filaments.collection import FilamentCollection
from ..filaments.filament_type import FilamentType


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
