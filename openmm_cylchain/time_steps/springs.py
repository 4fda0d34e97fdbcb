"""Springs by which forces act on particles, taken at the start of a step."""

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from ..units.types import FloatArray, Indices, IntArray

ACCURATE = 2.0 * (1.0 - 1.0 / 1.05)
"""lambda up to which no variance is more than 5 % too large."""

ACCURATE_ALONG_CONTACT = 0.5
"""lambda where filaments touch with all beads at once, which they seldom do: up to a third too large."""

NOWHERE = -1
"""In place of a particle: a fixed point."""


@dataclass(frozen=True, eq=False)
class Springs:
    """The springs of one force.

    Attributes
    ----------
    force : str
        Name and number of the force.
    item : str
        What one of the springs is called.
    numbers : (n,) int array
        By which they are known in the force.
    first, second : (n,) int arrays
        Particles; -1 for a fixed point in place of a second one.
    stiffness : (n,) array
        In kJ/(mol nm^2), along its stiffest direction.
    accurate : float
        lambda up to which their energies are right.
    """

    force: str
    item: str
    numbers: IntArray
    first: IntArray
    second: IntArray
    stiffness: FloatArray
    accurate: float = ACCURATE

    @classmethod
    def at_points(cls, force: str, item: str, particles: Indices, stiffness: npt.ArrayLike, **others: Any) -> "Springs":
        """Springs to fixed points."""
        particles = np.asarray(particles, dtype=int)
        nowhere = np.full(len(particles), NOWHERE)
        stiffness = np.broadcast_to(np.asarray(stiffness, dtype=float), len(particles))
        return cls(force, item, np.arange(len(particles)), particles, nowhere, stiffness, **others)
