"""One filament of a type at a place, and tethers of filaments."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..beams.curve import BeamElement
from ..errors import InputError
from ..units.quantities import (
    FORCE,
    LENGTH,
    STIFFNESS,
    finite_number,
    numbers_to_compute_with,
    positive,
    require_kind,
    true_or_false,
    vector,
    whole_number,
    whole_numbers,
)
from ..units.types import FloatArray
from .chain_type import Chain, ChainType
from .growth import Growth
from .placement import joint_stiffnesses
from .rest_bends import RestBends

NODE_NAME = "NOD"
"""Atom name of a filament node in topologies."""

CONTROL_POINT_NAME = "CTL"
"""Atom name of the control point of a node in topologies, which filaments of beam elements have."""


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
        F0 in kJ/(mol nm): the force F0 t on every segment, half on either end, with its tangent t. On a beam element,
        it is spread evenly along its curve.
    control_points : (n, 3) array or None
        Of beam elements: P + h r'/3 in nm for a node at P, with the tangent r' there.
    clamped_tangents : tuple of int
        Clamped nodes of beam elements whose tangents do not turn either.
    growth : Growth or None
        How it grows, if it does.
    spare_nodes : int
        How many particles it has besides its nodes, which become nodes as it grows.
    is_reserve : bool
        It has not begun yet: both of its nodes are in one place, which is no place of a filament.
    nucleation : kinetics.nucleation.Nucleation or None
        How those that have not begun do so, if not as a part of one that is cut.
    rest_bends : RestBends or None
        By how much its joints are bent at rest, if they are.
    takes_part : bool
        Linkers bind to it. One that does not stands aside: see ``Filaments.set_aside``.
    """

    type: ChainType
    positions: FloatArray
    clamped: tuple[int, ...]
    closed: bool = False
    planar: bool = False
    propulsion: float = 0.0
    control_points: FloatArray | None = None
    clamped_tangents: tuple[int, ...] = ()
    growth: Growth | None = None
    spare_nodes: int = 0
    is_reserve: bool = False
    nucleation: Any = None
    takes_part: bool = True
    rest_bends: RestBends | None = None

    def __post_init__(self) -> None:
        require_kind(self.type, ChainType, "Filament: type")
        for name in ("closed", "planar"):
            true_or_false(getattr(self, name), f"Filament: {name}")
        for name in ("clamped", "clamped_tangents"):
            whole_numbers(getattr(self, name), 0, f"Filament: {name}")
        finite_number(self.propulsion, FORCE, "Filament: propulsion")
        points = [self.positions] if self.control_points is None else [self.positions, self.control_points]
        if any(numbers_to_compute_with(own, LENGTH, "Filament: positions", 3).ndim != 2 for own in points):
            raise InputError("Filament: positions and control_points must have the shape (n, 3).")

    @property
    def segments(self) -> int:
        """Number of segments."""
        return len(self.positions) - (0 if self.closed else 1)

    @property
    def may_be_absent(self) -> bool:
        """Whether it is not there at times, with all of its particles in one place."""
        return self.is_reserve or (self.growth is not None and self.growth.vanishes)

    @property
    def bends(self) -> int:
        """Number of bends that have an energy: joints, or beam elements, which bend themselves."""
        return self.type.segment_kind.bends(self.segments, self.closed)

    @property
    def joint_stiffnesses(self) -> FloatArray:
        """Stiffness in the bending potential of every joint, see ``placement.joint_stiffnesses``.

        In kJ/mol; of bending model "bond-difference" in kJ/(mol nm^2).
        """
        return joint_stiffnesses(self.type, len(self.positions), self.clamped, self.closed)

    @property
    def components_of_rest_bends(self) -> FloatArray:
        """(joints, 2), see ``RestBends.components``; no joints if it has no bends at rest."""
        if self.rest_bends is None:
            return np.zeros((0, 2))
        return self.rest_bends.components(self.type.bending_model, self.bends)

    @property
    def twists(self) -> int:
        """How many a filament with twist has: a ring with rest_bends has one of its first frame, too."""
        return len(self.positions) + (self.closed and self.rest_bends is not None)

    def beam_element(self, temperature: float) -> BeamElement:
        """What its beam elements are made of, see ``FilamentType.beam_element``."""
        return self.type.beam_element(temperature, self.planar)

    def energies(
        self, nodes: FloatArray, control_points: FloatArray | None = None, temperature: float = 0.0
    ) -> tuple[float, float]:
        """Stretching and bending energy, in kJ/mol, with node positions (n, 3) in nm.

        Of beam elements, control points (n, 3) and the temperature of the solvent are needed, too.
        """
        stretching, bending = self.energies_along(nodes, control_points, temperature)
        return float(np.sum(stretching)), float(np.sum(bending))

    def energies_along(
        self, nodes: FloatArray, control_points: FloatArray | None, temperature: float
    ) -> tuple[FloatArray, FloatArray]:
        """Those of its segments (..., segments) and of its bends (..., bends), with node positions (..., n, 3)."""
        if self.rest_bends is not None:
            raise InputError(
                f"A filament of {self.type.name} has bends at rest: its energies depend on its frames, too. "
                "FilamentsInContext.energies has them."
            )
        chain = Chain(self.type, self.clamped, self.closed, self.planar, temperature)
        return self.type.segment_kind.energies(chain, nodes, control_points)


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

    def __post_init__(self) -> None:
        for name in ("filament", "node"):
            object.__setattr__(self, name, whole_number(getattr(self, name), 0, f"Tether: {name}"))
        if not (isinstance(self.point, tuple) and len(self.point) == 3 and all(map(_is_plain, self.point))):
            object.__setattr__(self, "point", tuple(vector(self.point, LENGTH, "Tether: point").tolist()))
        object.__setattr__(self, "stiffness", positive(self.stiffness, STIFFNESS, "Tether: stiffness"))


def _is_plain(value):
    # Many tethers move at once: what has been checked is not checked once more.
    return type(value) is float and math.isfinite(value)
