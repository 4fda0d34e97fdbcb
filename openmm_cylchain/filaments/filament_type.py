"""FilamentType: what a filament of cylinders is made of."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, cast

import numpy as np
import numpy.typing as npt

from ..errors import InputError
from ..mechanics.friction import EndCorrections, SegmentFriction, affine_extensional_friction, extensional_friction
from ..mechanics.geometry import joined
from ..mechanics.potentials import BENDING_POTENTIALS, STRETCHING_POTENTIALS, BendingPotential, StretchingPotential
from ..units.quantities import (
    ANGLE_PER_LENGTH,
    BENDING_RIGIDITY,
    DIMENSIONLESS,
    ENERGY,
    FORCE,
    LENGTH,
    MASS,
    ROTATIONAL_FRICTION,
    STIFFNESS,
    TEMPERATURE,
    TIME,
    VISCOSITY,
    finite_number,
    in_units_of,
    numbers_to_compute_with,
    one_of,
    positive,
    thermal_energy,
    true_or_false,
    whole_number,
)
from ..units.types import FloatArray, FloatOrArray, Scalar
from .beam_elements import BEAM_ELEMENTS
from .chain_type import ChainType, SegmentKind, check_bending_is_given_once, check_type_name, number_of
from .equilibrium import draw_chain
from .joint_calibration import calibrated_stiffness
from .straight_segments import STRAIGHT_SEGMENTS

_ELEMENTS = {"straight": STRAIGHT_SEGMENTS, "beam": BEAM_ELEMENTS}

_SMALLEST, _LARGEST = 1e-30, 1e30
"""Of what a filament type is given: fourth powers and products of two are finite."""


@dataclass(frozen=True, kw_only=True)
class FilamentType(ChainType):
    """Material, geometry and model of a filament: an immutable description.

    All arguments are keywords and take ``openmm.unit`` quantities or plain numbers in OpenMM's
    units; the attributes hold plain numbers in OpenMM's units (nm, ps, kJ/mol, Da).

    Parameters
    ----------
    name : str
        Residue name of its nodes in topologies and its name in messages; up to 5 letters or digits
        so that every format can hold it.
    diameter : length
        Diameter d of the cylinder.
    element : {"straight", "beam"}
        What segments are. Straight ones turn at joints. Beam elements bend inside: the filament is a curve with a
        continuous tangent, so a few of them do where curves, moments or clamps would need many straight ones. See
        Notes.
    segment_length : length
        Rest length l0 of a segment. With ``friction_length="segment"`` it must be long enough for eq. (6): every
        ln(l0/d) + c positive.
    persistence_length : length with temperature : temperature
        The length l_p over which tangents of the free discrete chain decorrelate in space at that temperature:
        ``<t_i.t_(i+k)> = exp(-k l0/l_p)``, exactly, for every bending model and segment length. The stiffness K of a
        joint is the one with that average; K tends to a/l0, a = l_p k_B T, for segments that are short against l_p.
        K, a property of the material, stays when the simulation runs at another temperature or in a plane. In a
        plane ``<t_i.t_(i+k)>`` is about exp(-k l0/2 l_p), and exactly so in the limit of short segments.
    bending_rigidity : energy*length
        Instead of a persistence length: the rigidity a = EI, with K = a/l0 as in Pesek et al. 2016. Tangents then
        decorrelate over another length than a/k_B T, by the order of l0: ``theory.chain_persistence_length``.
        ``bending_rigidity=0`` is a freely jointed chain.
    stretching_stiffness : energy/length^2, or stretching_modulus : force
        Stiffness k of one segment, or the modulus EA of the material, k = EA/l0.
    bending_model : {"inscribed-circle", "kratky-porod", "quadratic"}
        V_b of a joint with c = t1.t2 and the stiffness K: 2K (1-c)/(1+c), eq. (27); K (1-c), eq. (26);
        (K/2) theta^2.
    stretching_model : {"harmonic", "fene"}
        V_el of a segment: (k/2)(l-l0)^2, eq. (7), or -(k/2) D^2 ln(1-((l-l0)/D)^2).
    maximum_extension : length
        D of the FENE potential (required by it, refused otherwise): l stays within l0 - D and l0 + D.
    extension_relaxation_time : time, or extensional_friction : energy*time
        tau_l of eq. (20), or gamma_def itself. With neither, gamma_def is that of a cylinder that
        deforms affinely, gamma_par l0^2/12.
    end_corrections : EndCorrections
        c_par, c_perp and c_r of eq. (6).
    friction_length : "segment", "filament", or length
        What the logarithm of eq. (6) takes: the segment's length, as Pesek et al. 2016; that of the whole filament, as
        Chandran and Mofrad, Phys. Rev. E 2009, 79, 011906, "the ln term ... determined by the overall filament
        dimensions"; or a length over which the filament is straight and all of it drags the solvent along, and the
        segment's where that is longer. With "segment" the friction of a length of filament grows without end as it
        is cut into shorter segments; with the other two it converges.
    contour_per_segment : length, optional
        Length of the continuous filament that a segment stands for, if it is not segment_length:
        ``theory.calibrated_up_to_force`` makes such types.
    calibrated_force : force, optional
        Up to which such a type follows the wormlike chain.
    twist_persistence_length : length with temperature : temperature
        The length l_t = C/k_B T over which twist is lost: the frames of two places of the free filament at a distance s
        along it have ``<cos(turn)> = exp(-s/2 l_t)``. Without it, and without a torsional rigidity, there is no twist.
    torsional_rigidity : energy*length
        Instead of it: C of the twist energy (C/2 l0) (m - m0)^2 of a joint with the twist m in radians. See Notes.
    intrinsic_twist : angle/length, optional
        How much the filament is twisted at rest, per length of its contour: B-DNA by about 1.8 radians/nm. Zero if not
        given; positive is right-handed. m0 is that of the contour that a segment stands for.
    mass_per_length : mass/length
        Only for the relaxation times of momenta, eq. (51), and for the masses that OpenMM asks for:
        the dynamics is overdamped and does not depend on it.

    Raises
    ------
    InputError
        For a value that is missing, given twice, not finite, of the wrong unit, zero or negative.

    Notes
    -----
    ``with_segment_length`` changes the segment length and rescales what should rescale.

    Elements "beam" have the bending energy (EI/2) int kappa^2 ds and the stretching energy (EA/2) int (|r'| - 1)^2 ds
    of their curve, and the friction per length of a segment, evenly along it, so there are no ``bending_model``, FENE
    lengths, ``extension_relaxation_time``, ``extensional_friction`` or rotational end correction: leave them out. Of a
    persistence length, EI is such that tangents of neighbouring nodes have ``<t.t'> = exp(-l0/l_p)`` in space: less
    than l_p k_B T, by 1 % where an element is a tenth of l_p long, and by 3 % where it is a quarter. The compiled
    engine alone has them, with scheme "implicit".

    Twist is for straight segments of open filaments and rings in space, with scheme "implicit" of the compiled engine.
    Each segment has a material frame, which turns about the segment against the friction 4 pi eta (d/2)^2 l0 of a
    cylinder; m is the angle between two of them beyond parallel transport. What holds frames at its ends is added by
    ``Filaments.add_end_frame``. The filament bends as easily in all directions of its frames, and is straight at rest
    unless it has ``rest_bends`` (``RestBends``): so its intrinsic twist is what twists and linking numbers are counted
    from, and changes neither shapes nor torques.

    A type keeps the persistence length as ``bending_rigidity`` a = l_p k_B T, the rigidity of the continuous filament,
    with the ``temperature``: the two together mean the same as l_p = a/k_B T with the temperature. So
    ``dataclasses.replace(kind, temperature=None)`` has joints of a/l0 instead.
    """

    name: str
    diameter: float
    segment_length: float
    bending_rigidity: float = None  # type: ignore[assignment]  # None is for the constructor.
    persistence_length: float | None = field(default=None, repr=False)
    temperature: float | None = None
    stretching_stiffness: float | None = None
    stretching_modulus: float | None = None
    bending_model: str = "inscribed-circle"
    stretching_model: str = "harmonic"
    maximum_extension: float | None = None
    extension_relaxation_time: float | None = None
    extensional_friction: float | None = None
    end_corrections: EndCorrections = EndCorrections()
    friction_length: str | float = "segment"
    mass_per_length: float = 3500.0
    element: str = "straight"
    contour_per_segment: float | None = None
    calibrated_force: float | None = None
    torsional_rigidity: float | None = None
    twist_persistence_length: float | None = field(default=None, repr=False)
    intrinsic_twist: float = 0.0

    if TYPE_CHECKING:  # What may be given; the attributes hold plain numbers.

        def __init__(
            self,
            *,
            name: str,
            diameter: Scalar,
            segment_length: Scalar,
            bending_rigidity: Scalar | None = None,
            persistence_length: Scalar | None = None,
            temperature: Scalar | None = None,
            stretching_stiffness: Scalar | None = None,
            stretching_modulus: Scalar | None = None,
            bending_model: str = "inscribed-circle",
            stretching_model: str = "harmonic",
            maximum_extension: Scalar | None = None,
            extension_relaxation_time: Scalar | None = None,
            extensional_friction: Scalar | None = None,
            end_corrections: EndCorrections = ...,
            friction_length: str | Scalar = "segment",
            mass_per_length: Scalar = 3500.0,
            element: str = "straight",
            contour_per_segment: Scalar | None = None,
            calibrated_force: Scalar | None = None,
            torsional_rigidity: Scalar | None = None,
            twist_persistence_length: Scalar | None = None,
            intrinsic_twist: Scalar = 0.0,
        ) -> None: ...

    def __post_init__(self) -> None:
        check_type_name(self.name)
        for attribute, dimension in (
            ("diameter", LENGTH),
            ("segment_length", LENGTH),
            ("contour_per_segment", LENGTH),
            ("calibrated_force", FORCE),
            ("mass_per_length", MASS / LENGTH),
            ("maximum_extension", LENGTH),
            ("extension_relaxation_time", TIME),
            ("extensional_friction", ROTATIONAL_FRICTION),
            ("stretching_modulus", FORCE),
            ("stretching_stiffness", STIFFNESS),
        ):
            value = getattr(self, attribute)
            if value is not None:
                value = positive(value, dimension, f"{attribute} of filament type {self.name!r}")
                self._check_magnitude(attribute, value)
                self._set(attribute, value)
        for attribute, usual in (
            ("diameter", ""),
            ("segment_length", ""),
            ("mass_per_length", "; usual are 3500 Da/nm"),
        ):
            if getattr(self, attribute) is None:
                self._fail(f"{attribute} must be given{usual}.")
        self._resolve_bending()
        self._resolve_twist()
        if (self.stretching_stiffness is None) == (self.stretching_modulus is None):
            self._fail("give either stretching_stiffness (of one segment) or stretching_modulus (EA).")
        if self.extension_relaxation_time is not None and self.extensional_friction is not None:
            self._fail("give either extension_relaxation_time or extensional_friction, not both.")
        if (self.contour_per_segment is None) != (self.calibrated_force is None):
            self._fail("contour_per_segment and calibrated_force belong together.")
        self._check_choices()
        if not isinstance(self.end_corrections, EndCorrections):
            self._fail("end_corrections must be an EndCorrections(parallel, perpendicular, rotational).")
        self._check_segment_length()

    def _set(self, attribute, value):
        object.__setattr__(self, attribute, value)

    def _fail(self, message):
        raise InputError(f"Filament type {self.name!r}: {message}")

    def _resolve_bending(self):
        name = f"of filament type {self.name!r}"
        check_bending_is_given_once(self.name, self.bending_rigidity, self.persistence_length)
        if self.persistence_length is None:
            rigidity = in_units_of(self.bending_rigidity, BENDING_RIGIDITY, f"bending_rigidity {name}")
            if not isinstance(rigidity, float) or rigidity < 0:
                self._fail("bending_rigidity must be a single number that is not negative.")
        elif self.temperature is None:
            self._fail("persistence_length needs the temperature at which it holds.")
        if self.temperature is not None:
            self._set("temperature", positive(self.temperature, TEMPERATURE, f"temperature {name}"))
        if self.persistence_length is not None:
            length = positive(self.persistence_length, LENGTH, f"persistence_length {name}")
            rigidity = length * thermal_energy(self.temperature)
        self._check_magnitude("bending_rigidity", rigidity)
        self._set("bending_rigidity", rigidity)
        self._set("persistence_length", None)

    def _resolve_twist(self):
        name = f"of filament type {self.name!r}"
        intrinsic = finite_number(self.intrinsic_twist, ANGLE_PER_LENGTH, f"intrinsic_twist {name}")
        self._check_magnitude("intrinsic_twist", abs(intrinsic))
        self._set("intrinsic_twist", intrinsic)
        if self.torsional_rigidity is not None and self.twist_persistence_length is not None:
            self._fail("give either torsional_rigidity or twist_persistence_length (with its temperature).")
        if self.torsional_rigidity is not None:
            rigidity = positive(self.torsional_rigidity, BENDING_RIGIDITY, f"torsional_rigidity {name}")
        elif self.twist_persistence_length is not None:
            if self.temperature is None:
                self._fail("twist_persistence_length needs the temperature at which it holds.")
            length = positive(self.twist_persistence_length, LENGTH, f"twist_persistence_length {name}")
            rigidity = length * thermal_energy(self.temperature)
        else:
            if intrinsic != 0.0:
                self._fail("intrinsic_twist needs a torsional_rigidity or a twist_persistence_length.")
            return
        self._refuse_beam("twist")
        self._check_magnitude("torsional_rigidity", rigidity)
        self._set("torsional_rigidity", rigidity)
        self._set("twist_persistence_length", None)

    def _check_magnitude(self, attribute, value):
        # Powers of what is beyond are not finite.
        if not (value == 0.0 or _SMALLEST <= value <= _LARGEST):
            self._fail(
                f"{attribute} must be between {_SMALLEST:g} and {_LARGEST:g} in OpenMM's units, but is {value:g}."
            )

    def _check_choices(self):
        for attribute, choices in (
            ("element", tuple(_ELEMENTS)),
            ("bending_model", tuple(BENDING_POTENTIALS)),
            ("stretching_model", tuple(STRETCHING_POTENTIALS)),
        ):
            one_of(getattr(self, attribute), choices, f"Filament type {self.name!r}: {attribute}")
        self._check_friction_length()
        self.segment_kind.check_type(self)
        if (self.stretching_model == "fene") != (self.maximum_extension is not None):
            self._fail("maximum_extension must be given for stretching_model 'fene', and only for it.")
        if self.maximum_extension is not None and self.maximum_extension > self.segment_length:
            self._fail("maximum_extension must not exceed segment_length.")

    def _refuse_beam(self, what):
        if not self.segment_kind.straight:
            self._fail(
                f"its {self.segment_kind.name}s have no {what}, which belongs to straight segments. Take "
                "element='straight' where it is needed."
            )

    def _check_friction_length(self):
        if isinstance(self.friction_length, str) and self.friction_length in ("segment", "filament"):
            return
        if isinstance(self.friction_length, str):
            self._fail(f"friction_length must be one of segment, filament, or a length, but is {self.friction_length}.")
        length = positive(self.friction_length, LENGTH, f"friction_length of filament type {self.name!r}")
        self._set("friction_length", length)

    def _check_segment_length(self):
        if self.friction_length != "filament":
            try:
                self.segment_friction(viscosity=1.0, temperature=0.0)
            except InputError as error:
                self._fail(str(error))

    @property
    def segment_kind(self) -> SegmentKind:
        """The one that ``element`` names."""
        return _ELEMENTS[self.element]

    @property
    def segment_stiffness(self) -> float:
        """Stretching stiffness k of one segment in kJ/(mol nm^2): given, or EA/l0."""
        if self.stretching_stiffness is not None:
            return self.stretching_stiffness
        return cast(float, self.stretching_modulus) / self.segment_length

    @property
    def joint_stiffness(self) -> float:
        """Bending stiffness K of one joint in kJ/mol: of the persistence length, or a/l0 of the bending rigidity."""
        return self.stiffness_of_joint(self.segment_length)

    @property
    def clamped_joint_stiffness(self) -> float:
        """Bending stiffness in kJ/mol of a joint next to a segment that is held: as if l0 were half as long, so 2a/l0.

        Only the half segment on the free side bends. Of a persistence length: the direction of the first free segment
        and that of the held one have ``<t.t'> = exp(-l0/2 l_p)``.
        """
        return self.stiffness_of_joint(0.5 * self.segment_length)

    @property
    def bending_stiffness(self) -> float:
        """``joint_stiffness``: bending potentials are functions of the angle."""
        return self.joint_stiffness

    @property
    def clamped_bending_stiffness(self) -> float:
        """``clamped_joint_stiffness``."""
        return self.clamped_joint_stiffness

    def stiffness_of_joint(self, length: float) -> float:
        """Bending stiffness in kJ/mol of a joint between segments whose mean length in nm is given."""
        self._refuse_beam("joint stiffness")
        if self.temperature is None or self.bending_rigidity == 0.0:
            return self.bending_rigidity / length
        kT = thermal_energy(self.temperature)
        return kT * calibrated_stiffness(self.bending_model, length * kT / self.bending_rigidity)

    @property
    def twist_stiffness(self) -> float:
        """Stiffness C/l0 of one joint against twist in kJ/mol; InputError if the type has no twist."""
        if self.torsional_rigidity is None:
            self._fail("it has no twist: give it a torsional_rigidity or a twist_persistence_length.")
        return cast(float, self.torsional_rigidity) / self.segment_length

    @property
    def rest_twist(self) -> float:
        """Twist m0 of one joint at rest in radians: ``intrinsic_twist`` times the contour that a segment stands for."""
        return self.intrinsic_twist * (self.contour_per_segment or self.segment_length)

    def axial_friction(self, viscosity: Scalar) -> float:
        """Friction 4 pi eta (d/2)^2 l0 of one segment against turning about itself, in kJ ps/mol.

        Parameters
        ----------
        viscosity : pressure*time
            A plain number is in kJ ps/(mol nm^3), 602214 of which are 1 Pa s.
        """
        viscosity = positive(viscosity, VISCOSITY, "viscosity")
        return float(np.pi * viscosity * self.diameter**2 * self.segment_length)

    @property
    def segment_mass(self) -> float:
        """Mass of one segment in Da."""
        return self.mass_per_length * self.segment_length

    def node_masses(self, nodes: int, closed: bool = False) -> FloatArray:
        """Masses (nodes,) in Da: that of each segment goes to its two ends in equal parts."""
        masses = np.full(number_of(nodes, "nodes", 2), self.segment_mass)
        if not true_or_false(closed, "closed"):
            masses[[0, -1]] *= 0.5
        return masses

    @property
    def bending_potential(self) -> BendingPotential:
        """The BendingPotential that ``bending_model`` names."""
        return BENDING_POTENTIALS[self.bending_model]

    @property
    def stretching_potential(self) -> StretchingPotential:
        """The StretchingPotential that ``stretching_model`` names."""
        return STRETCHING_POTENTIALS[self.stretching_model]

    def stretching_energy(self, length: npt.ArrayLike) -> FloatOrArray:
        """Energy of segments of the given lengths (nm) in kJ/mol."""
        self._refuse_beam("energy of a length alone")
        length = numbers_to_compute_with(length, LENGTH, "length")
        return self.stretching_potential.energy(
            self.segment_stiffness, self.segment_length, self.maximum_extension, length
        )

    def stretching_derivative(self, length: npt.ArrayLike) -> FloatOrArray:
        """Derivative dV_el/dl at the given lengths (nm) in kJ/(mol nm)."""
        self._refuse_beam("energy of a length alone")
        length = numbers_to_compute_with(length, LENGTH, "length")
        return self.stretching_potential.derivative(
            self.segment_stiffness, self.segment_length, self.maximum_extension, length
        )

    def bending_energy(self, cosine: npt.ArrayLike, stiffness: npt.ArrayLike | None = None) -> FloatOrArray:
        """Energy of joints with the given cosines t1.t2 in kJ/mol; ``joint_stiffness`` if no stiffness is given."""
        return self._of_joints(self.bending_potential.energy, cosine, stiffness)

    def bending_derivative(self, cosine: npt.ArrayLike, stiffness: npt.ArrayLike | None = None) -> FloatOrArray:
        """Derivative dV_b/dc at the given cosines t1.t2 in kJ/mol; ``joint_stiffness`` if no stiffness is given."""
        return self._of_joints(self.bending_potential.derivative, cosine, stiffness)

    def _of_joints(self, function, cosine, stiffness):
        cosine = numbers_to_compute_with(cosine, DIMENSIONLESS, "cosine")
        if np.any(np.abs(cosine) > 1.0 + 1e-6):
            raise InputError("cosine must be between -1 and 1.")
        if self.bending_rigidity == 0.0:
            return np.zeros_like(cosine)
        if stiffness is None:
            return function(self.joint_stiffness, cosine)
        return function(numbers_to_compute_with(stiffness, ENERGY, "stiffness"), cosine)

    def _stretching_energies(self, lengths, closed):
        return np.asarray(self.stretching_energy(lengths))

    def _stretching_derivatives(self, lengths, closed):
        return np.asarray(self.stretching_derivative(lengths))

    def _bending_energies(self, vectors, stiffnesses, closed):
        return np.asarray(self.bending_energy(_cosines(_tangents(vectors), closed), stiffnesses))

    def _bending_end_forces(self, vectors, stiffnesses, closed):
        """Eq. (28).

        A bending torque T on a segment is the pair of forces -T/l and T/l on its ends, with
        T_i = -dV_b/dc (t_j - c t_i) for each joint with a neighbour j (the print of (28) lacks brackets and
        a 1/l).
        """
        plus = np.zeros_like(vectors)
        self._refuse_beam("bending force of joints")
        if self.bending_rigidity == 0.0 or len(vectors) < 2:
            return plus
        length, tangent = np.linalg.norm(vectors, axis=1), _tangents(vectors)
        before, behind = joined(np.arange(len(length)), closed)
        cosine = _cosines(tangent, closed)
        slope = np.asarray(self.bending_derivative(cosine, stiffnesses))[:, None]
        cosine = cosine[:, None]
        plus[before] -= slope * (tangent[behind] - cosine * tangent[before]) / length[before, None]
        plus[behind] -= slope * (tangent[before] - cosine * tangent[behind]) / length[behind, None]
        return plus

    def _check_folds(self, vectors, label, closed):
        if self.bending_rigidity == 0.0 or not self.segment_kind.straight:
            return
        cosines = _cosines(_tangents(vectors), closed)
        energies = self.bending_energy(cosines)
        if not np.all(np.isfinite(energies)) or np.any(cosines < -1.0 + 1e-12):
            joint = int(np.argmin(cosines)) + (0 if closed else 1)
            raise InputError(
                f"{label}: the segments before and after node {joint} are antiparallel, where the bending force is not "
                "defined; move the node."
            )

    def _draw_chain(self, segments, temperature, generator, start, direction, planar, joint_stiffnesses):
        self._refuse_beam("draw without control points")
        return draw_chain(self, segments, temperature, generator, start, direction, planar, joint_stiffnesses)

    def persistence_length_at(self, temperature: Scalar) -> float:
        """Persistence length a/(k_B T) of the continuous filament in nm at a temperature.

        At the temperature for which ``persistence_length`` was given, that of the discrete chain, too, exactly.
        ``theory.chain_persistence_length`` is that of the discrete chain at any temperature.
        """
        return super().persistence_length_at(temperature)

    def segment_friction(self, viscosity: Scalar, temperature: Scalar, segments: int = 1) -> SegmentFriction:
        """Friction coefficients of one segment in a solvent, eqs. (6) and (20).

        Parameters
        ----------
        viscosity : pressure*time
            Viscosity of the solvent; a plain number is in kJ ps/(mol nm^3), 602214 of which are 1 Pa s.
        temperature : temperature
            Enters eq. (20) only.
        segments : int
            Number of segments of the filament; matters only with ``friction_length="filament"``.

        Returns
        -------
        SegmentFriction
        """
        segments = whole_number(segments, 1, "segments")
        thermal_energy(temperature)
        length, logarithm_length = self.segment_length, self._logarithm_length(segments)
        parallel, perpendicular, rotational = self.segment_kind.frictions(
            length, self.diameter, viscosity, self.end_corrections, logarithm_length
        )
        if self.extensional_friction is not None:
            extensional = self.extensional_friction
        elif self.extension_relaxation_time is not None:
            extensional = extensional_friction(
                self.extension_relaxation_time, self.segment_stiffness, length, temperature
            )
        else:
            extensional = affine_extensional_friction(parallel, length)
        return SegmentFriction(parallel, perpendicular, rotational, extensional)

    def _logarithm_length(self, segments):
        if self.friction_length == "filament":
            return self.segment_length * segments
        if self.friction_length == "segment":
            return self.segment_length
        return max(self.segment_length, self.friction_length)

    def with_segment_length(self, segment_length: Scalar) -> FilamentType:
        """The same filament cut into segments of another length.

        Rescaled: k = EA/l0 if a stretching modulus was given; the stiffness of the joints, so that the persistence
        length stays, or as a/l0 if a bending rigidity was given; the friction coefficients; maximum_extension, in
        proportion; extensional_friction, as the friction of length per segment scales, with l0^3. Unchanged:
        diameter, persistence length or bending rigidity, a stretching
        stiffness given for one segment (as Pesek et al. do in Table 3, so the filament as a whole
        becomes softer or stiffer), extension_relaxation_time, end corrections, friction_length, mass per length.

        Raises InputError for segments too short for their friction, see ``friction_length``, and for a type that
        ``theory.calibrated_up_to_force`` made: cut first, and calibrate then.
        """
        if self.contour_per_segment is not None:
            self._fail("it is calibrated up to a force in segments of its own length: cut first, and calibrate then.")
        length = positive(segment_length, LENGTH, f"segment_length of filament type {self.name!r}")
        scale = length / self.segment_length
        return replace(
            self,
            segment_length=length,
            maximum_extension=None if self.maximum_extension is None else self.maximum_extension * scale,
            extensional_friction=None if self.extensional_friction is None else self.extensional_friction * scale**3,
        )


def _tangents(vectors):
    lengths = np.linalg.norm(vectors, axis=-1)
    if np.any(lengths == 0.0):
        raise InputError(f"vectors: segment {int(np.argwhere(lengths == 0.0)[0][-1])} has no length, so no direction.")
    return vectors / lengths[..., None]


def _cosines(tangents, closed):
    before = np.roll(tangents, 1, axis=-2) if closed else tangents[..., :-1, :]
    behind = tangents if closed else tangents[..., 1:, :]
    return np.einsum("...k,...k->...", before, behind)
