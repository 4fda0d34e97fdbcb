"""Flow of the solvent: uniform, shear, extension, and any other that is linear in space."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from ..errors import InputError
from ..units.quantities import LENGTH, RATE, VELOCITY, finite_number, in_units_of, shown, unit_vector, vector
from ..units.types import FloatArray, Scalar, Vector, Vectors

_REST = (0.0, 0.0, 0.0)
_TRACE_TOLERANCE = 1e-9


@dataclass(frozen=True)
class Flow:
    """Flow of the solvent with the velocity u(x) = velocity + gradient (x - origin).

    Filaments and other particles are dragged along: friction acts on their velocity relative to u. A segment feels u at
    its middle, and is turned and stretched by the gradient. Flows can be added.

    In a System with a periodic box, u is that at the image of a particle which is nearest to the origin of the flow;
    for a filament, at the image of its first node, and continued from there along the filament. So u has a jump half a
    box away from the origin along directions in which it varies: keep particles from there, by walls for instance.

    Parameters
    ----------
    velocity : (3,) length/time
        A plain number is in nm/ps.
    gradient : (3, 3) 1/time
        ``gradient[i][j]`` is du_i/dx_j. Its trace must be zero: the solvent is incompressible.
    origin : (3,) length
        Where u is ``velocity``.

    Raises
    ------
    InputError
        For a wrong shape or unit, a value that is not finite, or a gradient with a trace.

    Examples
    --------
    >>> Flow.shear(rate=1e-9).at([0, 0, 1000]).tolist()
    [1e-06, 0.0, 0.0]
    """

    velocity: tuple[float, float, float] = _REST
    gradient: tuple[tuple[float, float, float], ...] = (_REST, _REST, _REST)
    origin: tuple[float, float, float] = _REST

    if TYPE_CHECKING:  # What may be given; the attributes hold plain numbers.

        def __init__(self, velocity: Vector = ..., gradient: Vectors = ..., origin: Vector = ...) -> None: ...

    def __post_init__(self) -> None:
        gradient = np.asarray(in_units_of(self.gradient, RATE, "gradient of the flow"))
        if gradient.shape != (3, 3):
            raise InputError(f"gradient of the flow must have the shape (3, 3), but has {gradient.shape}.")
        trace = np.trace(gradient)
        if abs(trace) > _TRACE_TOLERANCE * np.abs(gradient).max():
            raise InputError(
                f"The gradient of the flow has the trace {trace:g}, but the solvent is incompressible: "
                "du_x/dx + du_y/dy + du_z/dz must be zero."
            )
        object.__setattr__(self, "gradient", tuple(tuple(float(rate) for rate in row) for row in gradient))
        for name, dimension in (("velocity", VELOCITY), ("origin", LENGTH)):
            components = vector(getattr(self, name), dimension, f"{name} of the flow")
            object.__setattr__(self, name, tuple(float(component) for component in components))

    @classmethod
    def uniform(cls, velocity: Vector) -> Flow:
        """A flow with the same velocity everywhere."""
        return cls(velocity)

    @classmethod
    def shear(
        cls, rate: Scalar, direction: Vector = (1, 0, 0), gradient_direction: Vector = (0, 0, 1), origin: Vector = _REST
    ) -> Flow:
        """Simple shear: u = rate (gradient_direction . (x - origin)) direction.

        Parameters
        ----------
        rate : 1/time
        direction, gradient_direction : (3,) array
            Where the solvent flows to, and along which axis its velocity grows. They must be perpendicular, and need
            not be normalised.
        origin : (3,) length
            A point at which the solvent is at rest.
        """
        along, across = _perpendicular(direction, gradient_direction, "direction", "gradient_direction", "shear")
        rate = finite_number(rate, RATE, "rate of the flow")
        return cls(gradient=rate * np.outer(along, across), origin=origin)

    @classmethod
    def extension(
        cls, rate: Scalar, direction: Vector = (1, 0, 0), compression: Vector = (0, 1, 0), origin: Vector = _REST
    ) -> Flow:
        """Planar extension: u = rate (direction . r) direction - rate (compression . r) compression, r = x - origin.

        Parameters
        ----------
        rate : 1/time
        direction, compression : (3,) array
            The axes of extension and of compression. They must be perpendicular, and need not be normalised.
        origin : (3,) length
            The stagnation point.
        """
        stretched, squeezed = _perpendicular(direction, compression, "direction", "compression", "extension")
        rate = finite_number(rate, RATE, "rate of the flow")
        return cls(gradient=rate * (np.outer(stretched, stretched) - np.outer(squeezed, squeezed)), origin=origin)

    @property
    def is_at_rest(self) -> bool:
        """Whether the solvent does not flow at all."""
        return not (np.any(self.velocity) or np.any(self.gradient))

    def at(self, positions: Vectors) -> FloatArray:
        """Velocity of the solvent at positions (..., 3): an array of their shape in nm/ps."""
        positions = np.asarray(in_units_of(positions, LENGTH, "positions"))
        if positions.ndim == 0 or positions.shape[-1] != 3:
            raise InputError(f"positions must have the shape (..., 3), but have {positions.shape}.")
        return flow_velocities(self, positions)

    def __add__(self, other: Flow) -> Flow:
        """Both flows at once."""
        if not isinstance(other, Flow):
            return NotImplemented
        velocity = self.velocity + other.at(self.origin)
        return Flow(velocity, np.add(self.gradient, other.gradient), self.origin)


def flow_velocities(flow: Flow, positions: npt.ArrayLike) -> FloatArray:
    """Velocities (n, 3) of the solvent at positions (n, 3), as ``Flow.at`` but without its checks."""
    return np.asarray(flow.velocity) + (np.asarray(positions) - flow.origin) @ np.transpose(flow.gradient)


def as_flow(flow: Flow | None) -> Flow:
    """Return a Flow, at rest for None; raise InputError for anything else."""
    if flow is None:
        return Flow()
    if not isinstance(flow, Flow):
        raise InputError(f"flow must be a Flow, such as Flow.shear(rate), but is {shown(flow)}.")
    return flow


def _perpendicular(first, second, first_name, second_name, kind):
    label = f"{kind.capitalize()} flow"
    first, second = unit_vector(first, label, first_name), unit_vector(second, label, second_name)
    if abs(first @ second) > _TRACE_TOLERANCE:
        raise InputError(f"{label}: {first_name} and {second_name} must be perpendicular.")
    return first, second
