"""Forces on filaments that do not take nearest images, though their System is periodic."""

import warnings

import openmm

from ..couplings.chain_forces import is_coupling
from ..couplings.contacts import is_contact_force
from ..couplings.crosslinks import Crosslinks
from ..couplings.periodicity import is_periodic
from ..couplings.walls import as_filament_wall_force
from ..errors import BoxWarning


def warn_of_forces_without_images(system: openmm.System) -> None:
    """Issue a BoxWarning if the System is periodic, but crosslinks, contacts or linkers of it are not.

    Each was made periodic, or not, when it was made: a box may have been set since. So is a wall that keeps filaments
    outside warned of, which is in one place for ever.
    """
    if not is_periodic(system):
        return
    labels = {f"{force.getName()} (force {index})": force for index, force in enumerate(system.getForces())}
    around = [label for label, force in labels.items() if _keeps_outside(force)]
    if around:
        warnings.warn(
            f"The System is periodic, but {', '.join(around)} keeps filaments and linkers out of one place alone: what "
            "crosses the box meets nothing at the images of that.",
            BoxWarning,
            stacklevel=3,
        )
    names = [
        label
        for label, force in labels.items()
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
    if is_coupling(force):
        return as_filament_wall_force(force) is None
    return is_contact_force(force) or Crosslinks.of_force(force) is not None


def _keeps_outside(force):
    wall = as_filament_wall_force(force)
    return wall is not None and wall.getSide() == "outside"
