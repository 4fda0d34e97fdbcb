"""ChainType: what all code that handles filaments needs to know of what they are made of."""

from abc import ABC, abstractmethod
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from ..beams.curve import BeamElement
from ..errors import InputError
from ..mechanics.friction import SegmentFriction
from ..mechanics.geometry import segment_vectors
from ..units.quantities import TEMPERATURE, positive, thermal_energy
from ..units.types import FloatArray, Scalar


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

    @property
    def has_beam_elements(self) -> bool:
        """Whether segments are beam elements, with a control point beside each node, and not straight."""
        return False

    def beam_element(self, temperature: Scalar, planar: bool = False) -> BeamElement:
        """What the beam elements of a filament are made of; InputError if its segments are straight."""
        raise InputError(f"Filament type {self.name!r}: its segments are straight, so it has no beam elements.")

    @property
    def node_friction(self) -> float:
        """Friction of every node by itself in kJ ps/(mol nm^2), beyond that of the segments; none of cylinders."""
        return 0.0

    def segment_lengths(self, segments: int, closed: bool = False) -> FloatArray:
        """Rest lengths (segments,) in nm."""
        return np.full(segments, self.segment_length)

    def segment_stiffnesses(self, segments: int, closed: bool = False) -> FloatArray:
        """Stretching stiffnesses (segments,) in kJ/(mol nm^2)."""
        return np.full(segments, self.segment_stiffness)

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

    @abstractmethod
    def stretching_energies(self, lengths: FloatArray, closed: bool = False) -> FloatArray:
        """Energies (..., segments) in kJ/mol of all segments of a filament, of lengths (..., segments) in nm."""

    @abstractmethod
    def stretching_derivatives(self, lengths: FloatArray, closed: bool = False) -> FloatArray:
        """Derivatives (..., segments) dV_el/dl in kJ/(mol nm), of lengths (..., segments) in nm."""

    @abstractmethod
    def bending_energies(
        self, vectors: FloatArray, stiffnesses: npt.ArrayLike | None = None, closed: bool = False
    ) -> FloatArray:
        """Energies (..., joints) in kJ/mol of the joints of a filament with vectors (..., segments, 3) in nm.

        ``stiffnesses`` (joints,) are those of ``Filament.joint_stiffnesses``; of a free chain if not given.
        """

    @abstractmethod
    def bending_end_forces(self, vectors: FloatArray, stiffnesses: FloatArray, closed: bool = False) -> FloatArray:
        """Forces (segments, 3) of bending on the plus ends of segments, in kJ/(mol nm); the minus ends have the
        opposite ones."""

    def chain_energies(
        self, nodes: FloatArray, joint_stiffnesses: npt.ArrayLike | None = None, closed: bool = False
    ) -> tuple[float, float]:
        """Stretching and bending energy, in kJ/mol, of a chain with node positions (n, 3) in nm.

        Parameters
        ----------
        nodes : (n, 3) array
        joint_stiffnesses : (joints,) array, optional
            As ``Filament.joint_stiffnesses``; those of a free chain if not given.
        closed : bool
            Whether the last node is joined to the first.
        """
        vectors = segment_vectors(nodes, closed)
        bending = self.bending_energies(vectors, joint_stiffnesses, closed)
        stretching = self.stretching_energies(np.linalg.norm(vectors, axis=1), closed)
        return float(np.sum(stretching)), float(np.sum(bending))

    @abstractmethod
    def check_folds(self, vectors: FloatArray, label: str, closed: bool = False) -> None:
        """Raise InputError if a bending force is not defined between segments with vectors (segments, 3) in nm."""

    @abstractmethod
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

    def persistence_length_at(self, temperature: Scalar) -> float:
        """Persistence length EI/(k_B T) of the continuous filament in nm at a temperature."""
        kT = thermal_energy(positive(temperature, TEMPERATURE, "temperature"))
        return self.bending_rigidity / kT


def check_type_name(name: object) -> None:
    """Raise InputError unless ``name`` can name a filament type: a residue name that every format can hold."""
    if not (isinstance(name, str) and name.isascii() and name.isalnum() and len(name) <= 5):
        raise InputError(f"The name of a filament type must be 1 to 5 letters or digits, but is {name!r}.")


def check_bending_is_given_once(name: str, bending_rigidity: object, persistence_length: object) -> None:
    """Raise InputError unless either a bending rigidity or a persistence length is given, and the other is None."""
    if (bending_rigidity is None) == (persistence_length is None):
        raise InputError(
            f"Filament type {name!r}: give either bending_rigidity or persistence_length (with its temperature). A "
            "type that exists has a bending_rigidity: set it to None where persistence_length takes its place."
        )
