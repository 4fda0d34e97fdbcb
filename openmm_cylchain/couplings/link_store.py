"""What Crosslinks sees of the force that computes them in a System: a PythonForce, or that of the compiled engine."""

from abc import ABC, abstractmethod
from typing import Any

import openmm

from ..errors import InputError
from ..units.types import FloatArray, IntArray
from .beam_curves import BeamCurves
from .crosslink_tables import CrosslinkTable
from .link_places import LinkPlaces


class LinkStore(ABC):
    """The crosslinks of the Contexts of a System.

    Attributes
    ----------
    model : {"harmonic", "fene"}
    defaults : tuple of float
        Stiffness, rest length and maximum extension of crosslinks that are given none.
    initial : CrosslinkTable
        What a new Context begins with.
    """

    model: str
    defaults: tuple[float, float, float]
    initial: CrosslinkTable

    @abstractmethod
    def require(self, context: openmm.Context) -> None:
        """Raise InputError if a Context is of a System that does not have these crosslinks."""

    @abstractmethod
    def table(self, context: openmm.Context) -> CrosslinkTable:
        """The crosslinks of a Context; raises InputError if they are not known."""

    @abstractmethod
    def replace(self, context: openmm.Context, table: CrosslinkTable) -> None:
        """Give a Context other crosslinks, whether its present ones are known or not."""

    @abstractmethod
    def boxes(self, context: openmm.Context, state: openmm.State) -> tuple[FloatArray | None, FloatArray | None]:
        """The boxes (3, 3) of nearest images of places, and of the two particles of a place, or None."""

    def curves(self, context: openmm.Context) -> BeamCurves | None:
        """The curves of the beam elements of a Context, or None if it has none."""
        return None

    def next_number(self, context: openmm.Context) -> int:
        """The number of the next crosslink of a Context."""
        return self.table(context).next_number

    def add(self, context: openmm.Context, places: LinkPlaces, parameters: tuple[float, float, float]) -> None:
        """Add crosslinks of equal stiffness, rest length and maximum extension to a Context."""
        self.replace(context, self.table(context).with_links(places, *parameters))

    def remove(self, context: openmm.Context, numbers: IntArray) -> None:
        """Remove crosslinks from a Context."""
        self.replace(context, self.table(context).without(numbers))

    def switch(self, context: openmm.Context, numbers: IntArray, active: bool) -> None:
        """Switch crosslinks of a Context on or off."""
        self.replace(context, self.table(context).switched(numbers, active))


def unknown_crosslinks(changes: int) -> InputError:
    """The error of a Context whose State is from elsewhere, or from too many changes ago."""
    return InputError(
        "The crosslinks of this Context are not known: its State or checkpoint was saved in another process, "
        f"or more than {changes} changes ago. Give the crosslinks that belong to it with Crosslinks.set_table (those "
        "that Crosslinks.table returned when it was saved) or Crosslinks.set_pairs."
    )


def not_of_this_system() -> InputError:
    """The error of a Context without these crosslinks."""
    return InputError(
        "This Context is of a System that does not have these crosslinks. Those of another System, and of a copy, are "
        "Crosslinks.from_system(system)."
    )


def parameters_of(force: openmm.Force, beginning: str) -> list[Any]:
    """Names of the global parameters of a PythonForce that begin in some way."""
    # OpenMM has them since 8.5.
    kind: Any = getattr(openmm, "PythonForce", ())
    if not isinstance(force, kind):
        return []
    return [name for name in dict(force.getGlobalParameters()) if name.startswith(beginning)]
