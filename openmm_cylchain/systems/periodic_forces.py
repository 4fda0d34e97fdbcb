"""Forces between filaments that do not take nearest images, though their System is periodic."""

import warnings

import openmm

from ..couplings.capsule_contacts import as_capsule_contact_force
from ..couplings.contacts import is_contact_force
from ..couplings.crosslinks import Crosslinks
from ..couplings.periodicity import is_periodic
from ..errors import BoxWarning
from ..kinetics.binding_force import is_binding_force


def warn_of_forces_without_images(system: openmm.System) -> None:
    """Issue a BoxWarning if the System is periodic, but crosslinks, contacts or linkers of it are not.

    Each was made periodic, or not, when it was made: a box may have been set since.
    """
    if not is_periodic(system):
        return
    names = [
        f"{force.getName()} (force {index})"
        for index, force in enumerate(system.getForces())
        if not force.usesPeriodicBoundaryConditions() and _takes_distances(force)
    ]
    if names:
        warnings.warn(
            f"The System is periodic, but distances are not those of nearest images in {', '.join(names)}. If that is "
            "not meant, set the box of the System before its filaments and these forces are added.",
            BoxWarning,
            stacklevel=3,
        )


def _takes_distances(force):
    return (
        is_contact_force(force)
        or is_binding_force(force)
        or as_capsule_contact_force(force) is not None
        or Crosslinks.of_force(force) is not None
    )
