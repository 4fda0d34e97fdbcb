"""Which Systems are periodic: one rule for forces between filaments, linkers and flows, in any order; and boxes."""

import numpy as np
import openmm

from ..errors import InputError
from ..units.types import FloatArray, IntArray

# The box that OpenMM gives to every System until another is set, in nm.
_OPENMM_BOX = 2.0 * np.eye(3)


def default_box(system: openmm.System) -> FloatArray:
    """The vectors (3, 3) in nm of the box that new Contexts of a System have."""
    return np.array([list(edge._value) for edge in system.getDefaultPeriodicBoxVectors()])


def has_box(system: openmm.System) -> bool:
    """Whether the box of a System is another one than the cube of 2 nm that OpenMM gives to each."""
    return not np.array_equal(default_box(system), _OPENMM_BOX)


def is_periodic(system: openmm.System) -> bool:
    """Whether a System has a box, or a force with periodic boundary conditions: then nearest images are meant."""
    return has_box(system) or system.usesPeriodicBoundaryConditions()


def check_rest_lengths(numbers: IntArray, rest_lengths: FloatArray, box: FloatArray) -> None:
    """Raise InputError if a crosslink is longer at rest than nearest images in a box (3, 3) can be apart."""
    # The nearest image of a point is in the brick around the other one that has the widths of the box along the axes.
    farthest = 0.5 * float(np.linalg.norm(np.diagonal(box)))
    too_long = np.flatnonzero(rest_lengths > farthest)
    if len(too_long):
        raise InputError(
            f"Crosslink {numbers[too_long[0]]} has a rest length of {rest_lengths[too_long[0]]:.6g} nm, but in the "
            f"periodic box, nearest images are never more than {farthest:.6g} nm apart. Give it a shorter one, or take "
            "a larger box."
        )
