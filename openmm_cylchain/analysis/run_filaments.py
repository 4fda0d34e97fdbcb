"""The filaments of a run, and its other particles."""

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ..filaments.chain_type import Chain
from ..output.run_description import DescribedFilament
from ..units.types import IntArray

PIECES_OF_ELEMENT = 8
"""Straight pieces by which a beam element is drawn, alike in its parameter."""


@dataclass(frozen=True)
class RunFilament:
    """A filament of a run.

    Attributes
    ----------
    type : FilamentType or BeadSpringType
    nodes : (n,) int array
        Particles, in order along the filament.
    diameter : float
        In nm.
    ring : bool
        Whether the last node is joined to the first.
    clamped : tuple of int
        Nodes that do not move, counted along the filament.
    control_points : (n,) int array
        Particles of the control points of nodes of beam elements; empty of straight segments.
    clamped_tangents : tuple of int
        Nodes whose control points do not move.
    planar : bool
        Whether it stays in its plane z = const.
    load : str
        What pulls at it, such as "0.2 pN", where loads differ; else empty.
    monomer_length : float
        By which it grows, in nm; zero if it does not. Its particles are then nodes as far as ``Run.growth`` says, and
        the others are where the last node is.
    bent_at_rest : bool
        Whether its joints are.
    """

    type: Any
    nodes: IntArray
    diameter: float
    ring: bool
    clamped: tuple[int, ...] = ()
    control_points: IntArray = field(default_factory=lambda: np.zeros(0, dtype=int))
    clamped_tangents: tuple[int, ...] = ()
    planar: bool = False
    load: str = ""
    monomer_length: float = 0.0
    bent_at_rest: bool = False

    @property
    def label(self) -> str:
        """The name of its type, and its load if loads differ."""
        return f"{self.type.name}, {self.load}" if self.load else self.type.name

    @property
    def segments(self) -> int:
        """Number of segments, of a filament that grows the most that it can have."""
        return len(self.nodes) - (0 if self.ring else 1)

    @property
    def pieces(self) -> int:
        """Straight pieces by which each of its segments is drawn: 1, or ``PIECES_OF_ELEMENT`` of a beam element."""
        return 1 if self.type.segment_kind.straight else PIECES_OF_ELEMENT


@dataclass(frozen=True)
class RunParticles:
    """Particles of a run beside its filaments.

    Attributes
    ----------
    name : str
        Of their residues.
    indices : (n,) int array
    diameter : float
        In nm, 0 if it is not known.
    """

    name: str
    indices: IntArray
    diameter: float


def chain_of(own: RunFilament, temperature: float) -> Chain:
    """What the energy of a filament is a function of, beside positions, at a temperature in K."""
    return Chain(own.type, own.clamped, own.ring, own.planar, temperature)


def described_filament(own: DescribedFilament) -> RunFilament:
    """A filament of a run, as its description has it."""
    nodes, control_points = (np.array(particles, dtype=int) for particles in (own.nodes, own.control_points))
    return RunFilament(
        own.type,
        nodes,
        own.diameter,
        own.ring,
        own.clamped,
        control_points,
        own.clamped_tangents,
        own.planar,
        own.load,
        own.monomer_length,
        own.bent_at_rest,
    )
