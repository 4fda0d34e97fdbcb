"""Frames beyond the ends of filaments with twist, and what filaments with twist cannot have."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..errors import InputError
from ..units.quantities import (
    DIMENSIONLESS,
    ENERGY,
    RATE,
    ROTATIONAL_FRICTION,
    finite_number,
    one_of,
    positive,
    vector,
    whole_number,
)

FILAMENT_ENDS = ("minus", "plus")
"""Of the first and of the last node, as numbers 0 and 1."""


@dataclass(frozen=True)
class EndFrame:
    """A frame beyond an end of a filament, which the material of the filament there is bound to.

    Attributes
    ----------
    filament : int
    end : {"minus", "plus"}
        That of the first node, or that of the last.
    direction : tuple of three floats
        Where the filament would go on, or has come from: a unit vector from minus to plus.
    torque : float or None
        On a frame that turns about the direction, in kJ/mol; None if there is none.
    angular_velocity : float
        Of a frame that is held, about the direction, in radians/ps.
    rotational_friction : float or None
        Of a frame that turns against it, in kJ ps/mol.
    body : int or None
        The rigid body that carries the frame. The direction is that where the body begins.
    """

    filament: int
    end: str
    direction: tuple[float, float, float]
    torque: float | None = None
    angular_velocity: float = 0.0
    rotational_friction: float | None = None
    body: int | None = None

    @property
    def is_held(self) -> bool:
        """Whether the frame turns as fast as it is told, in space or against the body that carries it."""
        return self.torque is None and self.rotational_friction is None

    @property
    def keeps_turns(self) -> bool:
        """Whether it is known how far the frame has turned."""
        return self.is_held and self.body is None

    def __post_init__(self) -> None:
        label = "End frame"
        object.__setattr__(self, "filament", whole_number(self.filament, 0, f"{label}: filament"))
        one_of(self.end, FILAMENT_ENDS, f"{label}: end")
        direction = vector(self.direction, DIMENSIONLESS, f"{label}: direction")
        length = float(np.linalg.norm(direction))
        if length == 0.0:
            raise InputError(f"{label}: direction must not be the zero vector.")
        object.__setattr__(self, "direction", tuple((direction / length).tolist()))
        if self.torque is not None:
            object.__setattr__(self, "torque", finite_number(self.torque, ENERGY, f"{label}: torque"))
        velocity = finite_number(self.angular_velocity, RATE, f"{label}: angular_velocity")
        object.__setattr__(self, "angular_velocity", velocity)
        if self.rotational_friction is not None:
            friction = positive(self.rotational_friction, ROTATIONAL_FRICTION, f"{label}: rotational_friction")
            object.__setattr__(self, "rotational_friction", friction)
        if self.body is not None:
            object.__setattr__(self, "body", whole_number(self.body, 0, f"{label}: body"))
        if self.body is not None and not self.is_held:
            raise InputError(f"{label}: a frame that a body carries turns with it: give no torque and no friction.")
        if velocity != 0.0 and not self.is_held:
            raise InputError(
                f"{label}: an angular_velocity is that of a frame that is held: give it no torque and no "
                "rotational_friction, or give those alone."
            )


def end_number(end: str, label: str) -> int:
    """0 for "minus" and 1 for "plus"; InputError for anything else."""
    one_of(end, FILAMENT_ENDS, label)
    return FILAMENT_ENDS.index(end)


def has_twist(filament_type: Any) -> bool:
    """Whether filaments of a type resist twist."""
    return getattr(filament_type, "torsional_rigidity", None) is not None
