"""Whether filaments with twist and contacts have lost turns, because strands have passed through each other."""

from __future__ import annotations

import warnings

import numpy as np
import openmm

from ..errors import TwistWarning
from ..filaments.collection import FilamentCollection
from ..filaments.twist import has_twist

_MOST_SEGMENTS = 1000
"""Of filaments that are looked at: linking numbers take the time of all pairs of segments."""


class LostTurns:
    """Linking numbers of rings with twist, and of filaments with frames at both ends that turn as they are told."""

    def __init__(self, filaments: FilamentCollection) -> None:
        self._filaments = filaments
        self._speeds: dict[int, float] = {}
        frames: dict[int, list] = {}
        for frame in filaments.end_frames:
            frames.setdefault(frame.filament, []).append(frame)
        for number, own in enumerate(filaments):
            if not has_twist(own.type) or own.segments > _MOST_SEGMENTS or not own.takes_part:
                continue
            held = [frame for frame in frames.get(number, []) if frame.keeps_turns]
            if own.closed or len(held) == 2:
                signs = {"minus": -1.0, "plus": 1.0}
                self._speeds[number] = sum(signs[frame.end] * frame.angular_velocity for frame in held) / (2.0 * np.pi)
        self._last: dict[int, tuple[float, float]] = {}

    def look(self, context: openmm.Context) -> None:
        """Issue a TwistWarning for each filament that has lost or won more than a turn since it was looked at last."""
        time, found = context.getTime()._value, self._filaments.in_context(context).linking_numbers([*self._speeds])
        for (number, speed), linking in zip(self._speeds.items(), found):
            begun, before = self._last.get(number, (time, linking))
            self._last[number] = (time, linking)
            lost = before + speed * (time - begun) - linking
            if abs(lost) > 1.0:
                kind = self._filaments[number].type.name
                warnings.warn(
                    f"Filament {number} ({kind}) has lost {lost:.1f} turns between two reports: strands have passed "
                    "through each other. Give contacts a larger diameter or stiffness or fewer excluded_neighbors, or "
                    "take shorter segments or a shorter step.",
                    TwistWarning,
                    stacklevel=2,
                )
