"""One filament of a type at a place, and tethers of filaments."""

from dataclasses import dataclass

from ..units.types import FloatArray
from .chain_type import ChainType
from .placement import joint_stiffnesses

NODE_NAME = "NOD"
"""Atom name of a filament node in topologies."""


@dataclass(frozen=True)
class Filament:
    """One filament.

    Attributes
    ----------
    type : FilamentType or BeadSpringType
    positions : (n, 3) array
        Initial node positions in nm.
    clamped : tuple of int
        Nodes that do not move.
    closed : bool
        A ring, whose last node is joined to the first.
    planar : bool
        The nodes keep their z.
    propulsion : float
        F0 in kJ/(mol nm): the force F0 t on every segment, half on either end, with its tangent t.
    """

    type: ChainType
    positions: FloatArray
    clamped: tuple[int, ...]
    closed: bool = False
    planar: bool = False
    propulsion: float = 0.0

    @property
    def segments(self) -> int:
        """Number of segments."""
        return len(self.positions) - (0 if self.closed else 1)

    @property
    def joint_stiffnesses(self) -> FloatArray:
        """Stiffness in the bending potential of every joint, see ``placement.joint_stiffnesses``.

        In kJ/mol; of bending model "bond-difference" in kJ/(mol nm^2).
        """
        return joint_stiffnesses(self.type, len(self.positions), self.clamped, self.closed)

    def energies(self, nodes: FloatArray) -> tuple[float, float]:
        """Stretching and bending energy, in kJ/mol, with node positions (n, 3) in nm."""
        return self.type.chain_energies(nodes, self.joint_stiffnesses, self.closed)


@dataclass(frozen=True)
class Tether:
    """A harmonic spring between a node and a point: energy (k/2) d^2 for their distance d.

    Attributes
    ----------
    filament, node : int
    point : tuple of three floats
        In nm.
    stiffness : float
        k in kJ/(mol nm^2).
    """

    filament: int
    node: int
    point: tuple[float, float, float]
    stiffness: float
