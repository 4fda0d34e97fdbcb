"""Which Systems are periodic: one rule for forces between filaments, linkers and flows, in any order of calls."""

import numpy as np
import openmm

# The box that OpenMM gives to every System until another is set, in nm.
_OPENMM_BOX = 2.0 * np.eye(3)


def has_box(system: openmm.System) -> bool:
    """Whether the box of a System is another one than the cube of 2 nm that OpenMM gives to each."""
    box = np.array([list(edge._value) for edge in system.getDefaultPeriodicBoxVectors()])
    return not np.array_equal(box, _OPENMM_BOX)


def is_periodic(system: openmm.System) -> bool:
    """Whether a System has a box, or a force with periodic boundary conditions: then nearest images are meant."""
    return has_box(system) or system.usesPeriodicBoundaryConditions()
