"""Twist of filaments in a Context: what it is there, and how it is changed."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt
import openmm
from openmm import unit

from ..engines.compiled_twist import set_twists_of, twists_of
from ..engines.protocol import PlacedFilaments
from ..errors import InputError
from ..filaments.twist import FILAMENT_ENDS, end_number, has_twist
from ..units.quantities import ANGLE, finite_number, in_units_of, whole_number
from ..units.types import Scalar


class TwistInContext:
    """The twists of filaments in a Context, and the linking numbers that follow from them."""

    def __init__(self, placed: PlacedFilaments, context: openmm.Context) -> None:
        self._placed = placed
        self._context = context

    def twists(self, filament: int) -> unit.Quantity:
        """Twists of a filament: the angle of the material frames of neighbouring segments beyond parallel transport.

        They are followed in time and not wrapped, so no turn is lost. A Context begins with ``rest_twist`` of the type
        in each joint, and with zero at ends. Checkpoints and States with ``integratorParameters=True`` hold them;
        setting positions does not change them.

        Parameters
        ----------
        filament : int

        Returns
        -------
        (segments + 1,) Quantity in radians
            The first is between the frame beyond the minus end and the first segment, the last between the last segment
            and the frame beyond the plus end, and those of joints are between these. Where an end is free, or its frame
            turns freely, its twist says how far the segment there has turned since the start. A ring has as many as
            segments; the first is that at node 0. One with ``rest_bends`` has one more, of its first frame: see
            ``RestBends``.

        Raises
        ------
        InputError
            For a filament that does not exist or has no twist.
        """
        return twists_of(self._context, self._twisted(filament)) * unit.radian

    def linking_number(self, filament: int) -> float:
        """Linking number Lk of a ring with twist, or by how much the frames at the ends of a filament have turned.

        The sum of twists over 2 pi, those at rest among them, and the writhe: a number that changes by two where a
        strand passes through another. The writhe of an open filament is that with straight ends, a thousand times as
        long as itself, along the directions of its frames: its Lk is that turn of the frame at the plus end against the
        one at the minus end where both directions are the same, to a thousandth. The time is that of all pairs of
        segments.

        Parameters
        ----------
        filament : int

        Raises
        ------
        InputError
            For a filament that does not exist, has no twist, lacks a frame at an end, or has one that a body carries.
        """
        return self.linking_numbers([filament])[0]

    def linking_numbers(self, filaments: Sequence[int]) -> list[float]:
        """``linking_number`` of several filaments at once, for which positions are fetched once."""
        positions = self._context.getState(positions=True).getPositions(asNumpy=True)._value
        return [self._linking_number(self._twisted(filament), positions) for filament in filaments]

    def _linking_number(self, number, positions):
        # Analysis takes long to load.
        from ..analysis.linking import writhe

        own = self._placed.filaments[number]
        nodes = positions[self._placed.node_indices[number]]
        if not own.closed:
            frames = {frame.end: frame for frame in self._placed.end_frames if frame.filament == number}
            if any(frame.body is not None for frame in frames.values()):
                raise InputError(f"Filament {number} has no linking number: a body carries a frame at an end.")
            if len(frames) < 2:
                raise InputError(
                    f"Filament {number} has no linking number: it is no ring, and lacks a frame at an end."
                )
            length = 1e3 * own.segments * own.type.segment_length
            ends = [length * np.array(frames[end].direction) for end in FILAMENT_ENDS]
            nodes = np.vstack([nodes[0] - ends[0], nodes, nodes[-1] + ends[1]])
        twists = twists_of(self._context, number)
        # Rings that are bent at rest have one more, which is that of no joint.
        turned = twists[: own.segments] if own.closed else twists
        return float(turned.sum()) / (2.0 * np.pi) + writhe(nodes, own.closed)

    def set_twists(self, filament: int, twists: npt.ArrayLike) -> None:
        """Give a filament other twists, such as those of another run, or of a ring that is closed with some turns.

        Those of a ring whose ends are joined add up to 2 pi (Lk - Wr), with a whole linking number Lk.

        Parameters
        ----------
        filament : int
        twists : array of angles
            As ``twists`` returns them; radians if plain numbers.
        """
        number = self._twisted(filament)
        values = np.asarray(in_units_of(twists, ANGLE, "twists"))
        count = len(twists_of(self._context, number))
        if values.shape != (count,):
            raise InputError(f"twists must have the shape ({count},), but have {values.shape}.")
        set_twists_of(self._context, number, values)

    def turn_end(self, filament: int, end: str, angle: Scalar) -> None:
        """Turn the frame that holds an end of a filament, at once: turn it by little between steps.

        Parameters
        ----------
        filament : int
        end : {"minus", "plus"}
        angle : angle
            About the direction of the frame, counter-clockwise as seen from where it points, and against a body that
            carries it; radians if a plain number.

        Raises
        ------
        InputError
            If the end has no frame that is held.
        """
        number = self._twisted(filament)
        side = end_number(end, "turn_end: end")
        frames = [own for own in self._placed.end_frames if (own.filament, own.end) == (number, end)]
        if not frames or not frames[0].is_held:
            raise InputError(f"The {end} end of filament {number} has no frame that is held: add it by add_end_frame.")
        if side == 0 and self._placed.filaments[number].rest_bends is not None:
            raise InputError(f"Filament {number} has rest_bends, which turn with its minus end: turn its plus end.")
        twists = twists_of(self._context, number)
        twists[-1 if side else 0] += finite_number(angle, ANGLE, "angle") * (1 if side else -1)
        set_twists_of(self._context, number, twists)

    def _number(self, filament):
        number, count = whole_number(filament, 0, "filament"), len(self._placed.filaments)
        if number >= count:
            raise InputError(f"Filament {number} does not exist; there are {count}.")
        return number

    def _twisted(self, filament):
        number = self._number(filament)
        if not has_twist(self._placed.filaments[number].type):
            raise InputError(f"Filament {number} has no twist: give its type a twist_persistence_length.")
        return number
