"""Beam elements, which bend inside: the filament is a curve with a continuous tangent."""

import math

import numpy as np

from ..beams.curve import (
    BeamElement,
    arc_lengths,
    beam_virial,
    control_points_of,
    curve_points,
    element_energies,
    natural_tangents,
    shortening_of,
)
from ..beams.equilibrium import LONGEST_ELEMENT, calibrated_rigidity, draw_beam
from ..beams.rings import circle
from ..errors import InputError
from ..mechanics.friction import EndCorrections, translational_frictions
from ..mechanics.geometry import joint_cosines, segment_vectors
from ..units.quantities import DIMENSIONLESS, LENGTH, in_units_of, thermal_energy, true_or_false
from ..units.types import FloatArray, Indices, IntArray, Scalar, Vectors
from .chain_type import Chain, ChainType, Points, SegmentKind
from .placement import named_nodes, refuse_coinciding


class BeamElements(SegmentKind):
    """Each has the stretching and bending energy of its curve: see ``SegmentKind``."""

    name, bend_name, bend_ends = "beam element", "beam element", "ends of an element"
    straight = False
    # That of a rod that is alone: elements are long.
    end_mobility = 4.0

    def bends(self, segments: int, closed: bool) -> int:
        """The elements themselves."""
        return segments

    def check_type(self, filament_type: ChainType) -> None:
        """Raise InputError for what belongs to straight segments, and for elements that are longer than l_p."""
        label = f"Filament type {filament_type.name!r}"
        for attribute, allowed in (
            ("bending_model", "inscribed-circle"),
            ("stretching_model", "harmonic"),
            ("extension_relaxation_time", None),
            ("extensional_friction", None),
        ):
            if getattr(filament_type, attribute) != allowed:
                raise InputError(
                    f"{label}: {attribute} is one of straight segments: leave it out for element 'beam', whose energy "
                    "and friction are those of its curve."
                )
        if filament_type.bending_rigidity == 0.0:
            raise InputError(f"{label}: bending_rigidity must be above zero for element 'beam'.")
        if filament_type.temperature is not None:
            bend = _bend(filament_type, filament_type.bending_rigidity, filament_type.temperature)
            if bend > LONGEST_ELEMENT or bend > LONGEST_ELEMENT * calibrated_rigidity(bend):
                raise InputError(
                    f"{label}: an element is {bend:.3g} persistence lengths long, and must not be longer than 0.92: "
                    "take a shorter segment_length."
                )

    def element(self, filament_type: ChainType, temperature: Scalar, planar: bool) -> BeamElement:
        """With a rigidity EI of which tangents decorrelate over the persistence length."""
        planar = true_or_false(planar, "planar")
        rigidity, length = filament_type.bending_rigidity, filament_type.segment_length
        if filament_type.temperature is not None:
            rigidity *= calibrated_rigidity(_bend(filament_type, rigidity, filament_type.temperature))
        shortening = shortening_of(_bend(filament_type, rigidity, temperature), planar)
        return BeamElement(length, rigidity, filament_type.segment_stiffness * length, shortening)

    def bend_stiffness(self, filament_type: ChainType, temperature: float) -> float:
        """EI/h."""
        element = self.element(filament_type, temperature, False)
        return element.rigidity / element.length

    def frictions(
        self, length: float, diameter: float, viscosity: Scalar, corrections: EndCorrections, logarithm_length: float
    ) -> tuple[float, float, float]:
        """Translation as in eq. (6), and the rotation of a friction per length."""
        parallel, across = translational_frictions(length, diameter, viscosity, corrections, logarithm_length)
        return parallel, across, across * length**2 / 12.0

    def control_points(
        self,
        filament_type: ChainType,
        nodes: FloatArray,
        label: str,
        tangents: Vectors | None = None,
        control_points: Vectors | None = None,
        closed: bool = False,
    ) -> FloatArray:
        if control_points is not None:
            return _given(nodes, control_points, label)
        if tangents is None:
            apart = np.linalg.norm(segment_vectors(nodes, closed), axis=1)
            refuse_coinciding(apart, len(nodes), label)
            tangents = natural_tangents(nodes, closed)
            turning = ~np.isfinite(tangents).all(axis=1)
            if np.any(turning):
                raise InputError(f"{label}: its nodes turn back at node {int(np.argmax(turning))}: give its tangents.")
            return control_points_of(nodes, tangents, filament_type.segment_length)
        tangents = np.asarray(in_units_of(tangents, DIMENSIONLESS, f"{label}: tangents"))
        if tangents.shape != nodes.shape:
            raise InputError(f"{label}: tangents must have the shape {nodes.shape}, but have {tangents.shape}.")
        # Squares of small components would be zero.
        tangents = tangents / np.maximum(np.max(np.abs(tangents), axis=1, keepdims=True), 1e-300)
        lengths = np.linalg.norm(tangents, axis=1, keepdims=True)
        if np.any(lengths == 0.0):
            raise InputError(f"{label}: the tangent of node {int(np.argmin(lengths))} is zero.")
        return control_points_of(nodes, tangents / lengths, filament_type.segment_length)

    def ring(
        self,
        filament_type: ChainType,
        segments: int,
        temperature: float,
        center: FloatArray,
        normal: FloatArray,
        planar: bool,
    ) -> Points:
        """A circle."""
        return circle(filament_type.beam_element(temperature, planar), segments, center, normal)

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
        """See ``beams.equilibrium``; without clamps, next to which an element is as stiff as others."""
        element = filament_type.beam_element(temperature, planar)
        try:
            return draw_beam(element, segments, thermal_energy(temperature), generator, start, direction, planar)
        except InputError as error:
            raise InputError(f"{label}: {error}") from None

    def clamps(
        self, clamped: int | Indices, tangents: int | Indices, nodes: int, label: str
    ) -> tuple[tuple[int, ...], tuple[int, ...]]:
        """All nodes may be, if a tangent is free."""
        held = named_nodes(clamped, nodes, f"{label}: clamped")
        directed = named_nodes(tangents, nodes, f"{label}: clamped_tangents")
        if len(directed) == nodes:
            raise InputError(f"{label} has all of its nodes and tangents clamped: leave at least one free to move.")
        for node in directed:
            if node not in held:
                raise InputError(f"{label}: the tangent of node {node} is clamped, but the node is not: clamp it, too.")
        return held, directed

    def intervals(self, segments: int, segment_length: float, spacing: float) -> int:
        """With a bead at each node, so that the piece of curve between two beads is one of a single element."""
        return segments * max(1, math.ceil(segment_length / spacing * (1.0 - 1e-12)))

    def particles_along(self, nodes: IntArray, beads: IntArray) -> IntArray:
        """Beads, if there are any."""
        return beads if len(beads) else nodes

    def energies(
        self, chain: Chain, nodes: FloatArray, control_points: FloatArray | None
    ) -> tuple[FloatArray, FloatArray]:
        """Of elements."""
        if control_points is None:
            raise InputError(f"Energies of beam elements ({chain.type.name}) need the control points of its nodes.")
        return element_energies(nodes, control_points, _element(chain), chain.closed)

    def virial(self, chain: Chain, nodes: FloatArray, control_points: FloatArray) -> FloatArray:
        """See ``beam_virial``."""
        return beam_virial(nodes, control_points, _element(chain), chain.closed)

    def tensions(self, chain: Chain, nodes: FloatArray, control_points: FloatArray) -> FloatArray:
        """EA times the mean strain along the arc of an element."""
        element = _element(chain)
        lengths = self.lengths(nodes, control_points, chain.closed)
        return element.modulus * (lengths / element.length - 1.0 + element.shortening)

    def lengths(self, nodes: FloatArray, control_points: FloatArray, closed: bool) -> FloatArray:
        """Of arcs."""
        return arc_lengths(nodes, control_points, closed)

    def angles(self, nodes: FloatArray, control_points: FloatArray, closed: bool) -> FloatArray:
        """Between the tangents at the ends of an element."""
        vectors = control_points - nodes
        tangents = vectors / np.linalg.norm(vectors, axis=1, keepdims=True)
        between = np.arccos(np.clip(joint_cosines(tangents, closed), -1.0, 1.0))
        # Those of a ring begin with the angle between the tangents at its last and its first node.
        return np.roll(between, -1) if closed else between

    def curve(self, nodes: FloatArray, control_points: FloatArray, per_segment: int, closed: bool) -> FloatArray:
        """See ``curve_points``."""
        return curve_points(nodes, control_points, per_segment, closed)


def _element(chain):
    return chain.type.beam_element(chain.temperature, chain.planar)


def _bend(filament_type, rigidity, temperature):
    # h k_B T/EI of an element.
    return filament_type.segment_length * thermal_energy(temperature) / rigidity


def _given(nodes, control_points, label):
    controls = np.array(in_units_of(control_points, LENGTH, f"{label}: control_points"))
    if controls.shape != nodes.shape:
        raise InputError(f"{label}: control_points must have the shape {nodes.shape}, but have {controls.shape}.")
    apart = np.linalg.norm(controls - nodes, axis=1)
    if not np.all(apart > 0.0):
        raise InputError(f"{label}: the control point of node {int(np.argmin(apart))} is at the node.")
    return controls


BEAM_ELEMENTS = BeamElements()
