"""ChainType: what all code that handles filaments needs to know of what they are made of.

What depends on whether segments are straight, or bend inside, is in a SegmentKind.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from ..beams.curve import BeamElement
from ..errors import InputError
from ..mechanics.friction import EndCorrections, SegmentFriction
from ..units.quantities import (
    DIMENSIONLESS,
    LENGTH,
    TEMPERATURE,
    numbers_to_compute_with,
    positive,
    require_kind,
    shown,
    thermal_energy,
    true_or_false,
    vector,
    whole_number,
)
from ..units.types import FloatArray, Indices, IntArray, Numbers, Scalar, Vectors


class ChainType(ABC):
    """Material, geometry and model of a filament: a chain of segments between nodes, an immutable description.

    A ``FilamentType`` is a chain of cylinders, a ``BeadSpringType`` one of beads. Everything is in OpenMM's units. Axes
    in front of those that are named belong to several filaments or frames.

    Attributes
    ----------
    name : str
        Residue name of its nodes in topologies and its name in messages.
    diameter : float
    segment_length : float
        Rest length of a segment; in an open chain of beads, of one that is not at an end.
    bending_rigidity : float
        EI of the continuous filament in kJ nm/mol; zero if it does not resist bending.
    bending_model, stretching_model : str
    maximum_extension : float or None
        By how much a length may differ from its rest length, if there is a bound.
    temperature : float or None
        At which it has the persistence length that it was given by, if it was.
    """

    if TYPE_CHECKING:

        @property
        def name(self) -> str: ...

        @property
        def diameter(self) -> float: ...

        @property
        def segment_length(self) -> float: ...

        @property
        def bending_rigidity(self) -> float: ...

        @property
        def bending_model(self) -> str: ...

        @property
        def stretching_model(self) -> str: ...

        @property
        def maximum_extension(self) -> float | None: ...

        @property
        def temperature(self) -> float | None: ...

    @property
    @abstractmethod
    def segment_kind(self) -> SegmentKind:
        """What its segments are."""

    @property
    @abstractmethod
    def segment_stiffness(self) -> float:
        """Stretching stiffness k of one segment in kJ/(mol nm^2); in a chain of beads, of one not at an end."""

    @property
    @abstractmethod
    def joint_stiffness(self) -> float:
        """Energy K in kJ/mol of one joint, which is K theta^2/2 for small angles theta."""

    @property
    @abstractmethod
    def bending_stiffness(self) -> float:
        """Stiffness in the bending potential, as an engine takes it: K in kJ/mol of potentials of the angle, and kappa
        in kJ/(mol nm^2) of bending model "bond-difference"."""

    @property
    @abstractmethod
    def clamped_bending_stiffness(self) -> float:
        """``bending_stiffness`` of a joint next to a segment that is held."""

    def beam_element(self, temperature: Scalar, planar: bool = False) -> BeamElement:
        """What the beam elements of a filament are made of; InputError if its segments are straight.

        Parameters
        ----------
        temperature : temperature
            At which bends inside of an element shorten its chord, by h k_B T/15 EI in space and half of it in a plane.
        planar : bool
        """
        return self.segment_kind.element(self, temperature, planar)

    @property
    def node_friction(self) -> float:
        """Friction of every node by itself in kJ ps/(mol nm^2), beyond that of the segments; none of cylinders."""
        return 0.0

    def segment_lengths(self, segments: int, closed: bool = False) -> FloatArray:
        """Rest lengths (segments,) in nm."""
        true_or_false(closed, "closed")
        return np.full(number_of(segments, "segments"), self.segment_length)

    def segment_stiffnesses(self, segments: int, closed: bool = False) -> FloatArray:
        """Stretching stiffnesses (segments,) in kJ/(mol nm^2)."""
        true_or_false(closed, "closed")
        return np.full(number_of(segments, "segments"), self.segment_stiffness)

    def straight_lengths(self, segments: int) -> FloatArray:
        """Lengths (segments,) in nm of the segments of a straight open chain on which no forces act."""
        return self.segment_lengths(segments)

    @abstractmethod
    def node_masses(self, nodes: int, closed: bool = False) -> FloatArray:
        """Masses (nodes,) in Da."""

    @abstractmethod
    def segment_friction(self, viscosity: Scalar, temperature: Scalar, segments: int = 1) -> SegmentFriction:
        """Friction coefficients of one segment of a filament with so many segments, in a solvent.

        Those of a chain whose nodes have friction are the coefficients of cylinders with the same friction.
        """

    def stretching_energies(self, lengths: Numbers, closed: bool = False) -> FloatArray:
        """Energies (..., segments) in kJ/mol of all segments of a filament, of lengths (..., segments) in nm."""
        return self._stretching_energies(_lengths(lengths), true_or_false(closed, "closed"))

    def stretching_derivatives(self, lengths: Numbers, closed: bool = False) -> FloatArray:
        """Derivatives (..., segments) dV_el/dl in kJ/(mol nm), of lengths (..., segments) in nm."""
        return self._stretching_derivatives(_lengths(lengths), true_or_false(closed, "closed"))

    def bending_energies(
        self, vectors: Vectors, stiffnesses: npt.ArrayLike | None = None, closed: bool = False
    ) -> FloatArray:
        """Energies (..., joints) in kJ/mol of the joints of a filament with vectors (..., segments, 3) in nm.

        ``stiffnesses`` (joints,) are those of ``Filament.joint_stiffnesses``; of a free chain if not given.
        """
        vectors, closed = _vectors(vectors), true_or_false(closed, "closed")
        if stiffnesses is not None:
            stiffnesses = _stiffnesses(stiffnesses, vectors.shape[-2], closed)
        return self._bending_energies(vectors, stiffnesses, closed)

    def bending_end_forces(self, vectors: Vectors, stiffnesses: npt.ArrayLike, closed: bool = False) -> FloatArray:
        """Forces (segments, 3) of bending on the plus ends of segments, in kJ/(mol nm); the minus ends have the
        opposite ones. ``stiffnesses`` (joints,) are those of ``Filament.joint_stiffnesses``."""
        vectors, closed = _vectors(vectors, 2), true_or_false(closed, "closed")
        return self._bending_end_forces(vectors, _stiffnesses(stiffnesses, len(vectors), closed), closed)

    def check_folds(self, vectors: Vectors, label: str, closed: bool = False) -> None:
        """Raise InputError if a bending force is not defined between segments with vectors (segments, 3) in nm."""
        require_kind(label, str, "label")
        self._check_folds(_vectors(vectors, 2), label, true_or_false(closed, "closed"))

    @abstractmethod
    def _stretching_energies(self, lengths, closed):
        pass

    @abstractmethod
    def _stretching_derivatives(self, lengths, closed):
        pass

    @abstractmethod
    def _bending_energies(self, vectors, stiffnesses, closed):
        pass

    @abstractmethod
    def _bending_end_forces(self, vectors, stiffnesses, closed):
        pass

    @abstractmethod
    def _check_folds(self, vectors, label, closed):
        pass

    @abstractmethod
    def _draw_chain(self, segments, temperature, generator, start, direction, planar, joint_stiffnesses):
        pass

    def draw_chain(
        self,
        segments: int,
        temperature: Scalar,
        generator: np.random.Generator,
        start: npt.ArrayLike = (0.0, 0.0, 0.0),
        direction: FloatArray | None = None,
        planar: bool = False,
        joint_stiffnesses: FloatArray | None = None,
    ) -> FloatArray:
        """Node positions (segments + 1, 3) in nm of a chain drawn from the equilibrium of the free discrete chain.

        Parameters
        ----------
        segments : int
        temperature : temperature, above zero
        generator : numpy.random.Generator
        start : (3,) array, nm
            Position of the first node.
        direction : (3,) array, optional
            Unit vector of the first segment; drawn from the sphere, or the circle, if not given.
        planar : bool
            Draw from the equilibrium in the plane z = start[2].
        joint_stiffnesses : (segments - 1,) array, optional
            As ``Filament.joint_stiffnesses``; the type's if not given.
        """
        segments, planar = number_of(segments, "segments"), true_or_false(planar, "planar")
        temperature = positive(temperature, TEMPERATURE, "temperature")
        require_kind(generator, np.random.Generator, "generator")
        start = vector(start, LENGTH, "start")
        if direction is not None:
            direction = vector(direction, DIMENSIONLESS, "direction")
            if np.hypot(*direction[:2]) == 0.0 and (planar or direction[2] == 0.0):
                raise InputError("direction must not be the zero vector, or in a plane, along z.")
        if joint_stiffnesses is not None:
            joint_stiffnesses = _stiffnesses(joint_stiffnesses, segments, False)
        return self._draw_chain(segments, temperature, generator, start, direction, planar, joint_stiffnesses)

    def persistence_length_at(self, temperature: Scalar) -> float:
        """Persistence length EI/(k_B T) of the continuous filament in nm at a temperature."""
        kT = thermal_energy(positive(temperature, TEMPERATURE, "temperature"))
        return self.bending_rigidity / kT


_MOST_SEGMENTS = 10**8


def number_of(segments: int, name: str, minimum: int = 1) -> int:
    """A number of segments or nodes of a filament as an int; InputError if it is none, or beyond all computers."""
    return whole_number(segments, minimum, name, _MOST_SEGMENTS)


def _lengths(lengths):
    lengths = numbers_to_compute_with(lengths, LENGTH, "lengths")
    if not lengths.ndim or not lengths.shape[-1]:
        raise InputError(f"lengths must have the shape (..., segments), but have {lengths.shape}.")
    return lengths


def _vectors(vectors, dimensions=None):
    vectors = numbers_to_compute_with(vectors, LENGTH, "vectors", 3)
    if dimensions is not None and vectors.ndim != dimensions:
        raise InputError(f"vectors must have the shape (segments, 3), but have {vectors.shape}.")
    return vectors


def _stiffnesses(stiffnesses, segments, closed):
    stiffnesses = numbers_to_compute_with(stiffnesses, DIMENSIONLESS, "stiffnesses")
    joints = segments if closed else segments - 1
    if stiffnesses.shape not in ((), (joints,)):
        raise InputError(f"stiffnesses must have the shape ({joints},), but have {stiffnesses.shape}.")
    return np.broadcast_to(stiffnesses, (joints,))


@dataclass(frozen=True)
class Chain:
    """What the energy of a filament is a function of, beside its positions: see ``Filament``. The temperature is in K,
    that of the solvent."""

    type: ChainType
    clamped: tuple[int, ...]
    closed: bool
    planar: bool
    temperature: float


class SegmentKind(ABC):
    """What segments are. It keeps nothing: there is one object of each class.

    Node positions are (..., n, 3) arrays in nm, and so are control points, of which straight segments have none.

    Attributes
    ----------
    name : str
        Of a segment, in messages.
    bend_name, bend_ends : str
        What bends, and what its angle is between.
    straight : bool
        Whether a segment is the straight line between its nodes. If not, there is a control point beside each node.
    end_mobility : float
        Of a node, across the filament, over that of a whole segment.
    """

    name: str
    bend_name: str
    bend_ends: str
    straight: bool
    end_mobility: float

    @abstractmethod
    def bends(self, segments: int, closed: bool) -> int:
        """How many bends of a filament have an energy."""

    @abstractmethod
    def check_type(self, filament_type: ChainType) -> None:
        """Raise InputError if a FilamentType cannot have such segments."""

    @abstractmethod
    def element(self, filament_type: ChainType, temperature: Scalar, planar: bool) -> BeamElement:
        """What segments that bend inside are made of; InputError if they do not."""

    @abstractmethod
    def bend_stiffness(self, filament_type: ChainType, temperature: float) -> float:
        """The energy of a small bend is half of that, in kJ/mol, times the square of its angle."""

    @abstractmethod
    def frictions(
        self, length: float, diameter: float, viscosity: Scalar, corrections: EndCorrections, logarithm_length: float
    ) -> tuple[float, float, float]:
        """Parallel, perpendicular and rotational friction of a segment that is a cylinder."""

    @abstractmethod
    def control_points(
        self,
        filament_type: ChainType,
        nodes: FloatArray,
        label: str,
        tangents: Vectors | None = None,
        control_points: Vectors | None = None,
        closed: bool = False,
    ) -> FloatArray | None:
        """Control points of nodes (n, 3) with tangents, which are normalised, or given ones, checked; None if segments
        are straight.

        With neither, tangents are those of the natural cubic spline through the nodes, or of the periodic one of a
        ring.
        """

    @abstractmethod
    def ring(
        self,
        filament_type: ChainType,
        segments: int,
        temperature: float,
        center: FloatArray,
        normal: FloatArray,
        planar: bool,
    ) -> Points:
        """A ring without strains."""

    @abstractmethod
    def draw(
        self,
        filament_type: ChainType,
        segments: int,
        temperature: float,
        generator: np.random.Generator,
        start: FloatArray,
        direction: FloatArray | None,
        clamped: int | Indices,
        planar: bool,
        label: str,
    ) -> Points:
        """A free open chain in equilibrium."""

    @abstractmethod
    def clamps(
        self, clamped: int | Indices, tangents: int | Indices, nodes: int, label: str
    ) -> tuple[tuple[int, ...], tuple[int, ...]]:
        """Clamped nodes, and those whose tangents are clamped, too; InputError if they cannot be."""

    @abstractmethod
    def intervals(self, segments: int, segment_length: float, spacing: float) -> int:
        """How many equal intervals beads are apart by along a filament, none longer than the spacing."""

    @abstractmethod
    def particles_along(self, nodes: IntArray, beads: IntArray) -> IntArray:
        """Those between which the surface of a filament is, of the particles of its nodes and its beads."""

    @abstractmethod
    def energies(
        self, chain: Chain, nodes: FloatArray, control_points: FloatArray | None
    ) -> tuple[FloatArray, FloatArray]:
        """Stretching energies (..., segments) and bending energies (..., bends) in kJ/mol."""

    @abstractmethod
    def virial(self, chain: Chain, nodes: FloatArray, control_points: FloatArray) -> FloatArray:
        """The derivative of the energy by an affine strain: (3, 3) in kJ/mol."""

    @abstractmethod
    def tensions(self, chain: Chain, nodes: FloatArray, control_points: FloatArray) -> FloatArray:
        """Tensions (..., segments) dV_el/dl in kJ/(mol nm)."""

    @abstractmethod
    def lengths(self, nodes: FloatArray, control_points: FloatArray, closed: bool) -> FloatArray:
        """Lengths (..., segments) along the filament in nm."""

    @abstractmethod
    def angles(self, nodes: FloatArray, control_points: FloatArray, closed: bool) -> FloatArray:
        """Angles (segments,) in radians by which the segments of a filament bend."""

    @abstractmethod
    def curve(self, nodes: FloatArray, control_points: FloatArray, per_segment: int, closed: bool) -> FloatArray:
        """Points (..., points, 3) that the filament is straight between: nodes, or so many of each segment that bends
        and the last node."""


Points = tuple[FloatArray, FloatArray | None]
"""Nodes and control points, (n, 3) in nm each; None if segments are straight."""


def check_type_name(name: object) -> None:
    """Raise InputError unless ``name`` can name a filament type: a residue name that every format can hold."""
    if not (isinstance(name, str) and name.isascii() and name.isalnum() and len(name) <= 5):
        raise InputError(f"The name of a filament type must be 1 to 5 letters or digits, but is {shown(name)}.")


def check_bending_is_given_once(name: str, bending_rigidity: object, persistence_length: object) -> None:
    """Raise InputError unless either a bending rigidity or a persistence length is given, and the other is None."""
    if (bending_rigidity is None) == (persistence_length is None):
        raise InputError(
            f"Filament type {name!r}: give either bending_rigidity or persistence_length (with its temperature). A "
            "type that exists has a bending_rigidity: set it to None where persistence_length takes its place."
        )
