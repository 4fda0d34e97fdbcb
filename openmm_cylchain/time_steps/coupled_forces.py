"""Which forces of a System implicit schemes have in their equations, and what keeps others out: the plugin says it."""

import openmm

from ..couplings.capsule_contacts import as_capsule_contact_force
from ..couplings.chain_forces import is_coupling
from ..couplings.walls import as_filament_wall_force
from ..engine_choice import load_plugin
from ..errors import InputError


class CoupledForces:
    """The forces of a System that implicit schemes of the compiled engine may have in their equations.

    These are links, contacts, walls and linkers. They are in the equations if all of their places are: particles that
    move by themselves, nodes, places on segments, and what does not move. A place that moves in any other way, such as
    a virtual site between particles that are not the ends of a segment, makes its force explicit: all of it. What is
    read is the System with all of its forces.
    """

    def __init__(self, system: openmm.System) -> None:
        self._system = system
        self._known: dict[int, str | None] = {}

    def may_include(self, index: int) -> bool:
        """Whether a force, by its index, is one of links, contacts, walls or linkers: in the equations if it can be."""
        return is_coupling(self._system.getForce(index))

    def includes(self, index: int) -> bool:
        """Whether a force, by its index, is in the equations of implicit schemes."""
        return self.may_include(index) and self.place_outside(index) is None

    def refuse_in_two_stages(self, scheme: str) -> None:
        """Raise InputError if scheme "implicit-second-order" has contacts or walls in its equations.

        In its two stages, they would not keep their equilibrium.
        """
        if scheme != "implicit-second-order":
            return
        for index, force in enumerate(self._system.getForces()):
            pushes = as_capsule_contact_force(force) is not None or as_filament_wall_force(force) is not None
            if pushes and self.includes(index):
                raise InputError(
                    f'{force.getName()} (force {index}): contacts and walls need scheme="implicit": in the two stages '
                    f"of {scheme!r} they would not keep their equilibrium."
                )

    def place_outside(self, index: int) -> str | None:
        """What makes a force that may be included explicit, in words; None if nothing does."""
        if index not in self._known:
            coupling = load_plugin().CylinderChainCoupling.cast(self._system.getForce(index))
            self._known[index] = coupling.whyExplicit(self._system) or None
        return self._known[index]
