"""Straight segments, which turn at joints."""

import math

import numpy as np

from ..beams.curve import BeamElement
from ..errors import InputError
from ..mechanics.friction import EndCorrections, rotational_friction, translational_frictions
from ..mechanics.geometry import joint_cosines, regular_polygon, segment_vectors
from ..units.types import FloatArray, Indices, IntArray, Scalar, Vectors
from .chain_type import Chain, ChainType, Points, SegmentKind
from .placement import clamped_nodes, joint_stiffnesses


class StraightSegments(SegmentKind):
    """Each has a stretching energy, and each joint of two a bending energy: see ``SegmentKind``."""

    name, bend_name, bend_ends = "segment", "joint", "neighbouring segments"
    straight = True
    end_mobility = 1.0

    def bends(self, segments: int, closed: bool) -> int:
        """Joints."""
        return segments if closed else segments - 1

    def check_type(self, filament_type: ChainType) -> None:
        """Any can."""

    def element(self, filament_type: ChainType, temperature: Scalar, planar: bool) -> BeamElement:
        """None."""
        raise InputError(
            f"Filament type {filament_type.name!r}: its segments are straight, so it has no beam elements."
        )

    def bend_stiffness(self, filament_type: ChainType, temperature: float) -> float:
        """K of a joint."""
        return filament_type.joint_stiffness

    def frictions(
        self, length: float, diameter: float, viscosity: Scalar, corrections: EndCorrections, logarithm_length: float
    ) -> tuple[float, float, float]:
        """Eq. (6)."""
        # The rotational one first: with the usual end corrections it asks for the longest segments.
        rotational = rotational_friction(length, diameter, viscosity, corrections.rotational, logarithm_length)
        return *translational_frictions(length, diameter, viscosity, corrections, logarithm_length), rotational

    def control_points(
        self,
        filament_type: ChainType,
        nodes: FloatArray,
        label: str,
        tangents: Vectors | None = None,
        control_points: Vectors | None = None,
        closed: bool = False,
    ) -> None:
        """None."""
        for what, given in (("tangents", tangents), ("control_points", control_points)):
            if given is not None:
                raise InputError(f"{label}: {what} belong to nodes of beam elements; its segments are straight.")

    def ring(
        self,
        filament_type: ChainType,
        segments: int,
        temperature: float,
        center: FloatArray,
        normal: FloatArray,
        planar: bool,
    ) -> Points:
        """A regular polygon with segments of rest length."""
        return regular_polygon(segments, filament_type.segment_length, center, normal), None

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
        held = clamped_nodes(clamped, segments + 1, label)
        stiffnesses = joint_stiffnesses(filament_type, segments + 1, held)
        return filament_type.draw_chain(segments, temperature, generator, start, direction, planar, stiffnesses), None

    def clamps(
        self, clamped: int | Indices, tangents: int | Indices, nodes: int, label: str
    ) -> tuple[tuple[int, ...], tuple[int, ...]]:
        """Nodes alone."""
        held = clamped_nodes(clamped, nodes, label)
        if np.size(np.asarray(tangents, dtype=object)):
            raise InputError(f"{label}: clamped_tangents are those of beam elements; clamp two neighbouring nodes.")
        return held, ()

    def intervals(self, segments: int, segment_length: float, spacing: float) -> int:
        """Wherever they end."""
        return max(1, math.ceil(segments * segment_length / spacing * (1.0 - 1e-12)))

    def particles_along(self, nodes: IntArray, beads: IntArray) -> IntArray:
        """Nodes."""
        return nodes

    def energies(
        self, chain: Chain, nodes: FloatArray, control_points: FloatArray | None
    ) -> tuple[FloatArray, FloatArray]:
        """Of lengths and of joints."""
        vectors = segment_vectors(nodes, chain.closed)
        stiffnesses = joint_stiffnesses(chain.type, nodes.shape[-2], chain.clamped, chain.closed)
        bending = chain.type.bending_energies(vectors, stiffnesses, chain.closed)
        return chain.type.stretching_energies(np.linalg.norm(vectors, axis=-1), chain.closed), bending

    def virial(self, chain: Chain, nodes: FloatArray, control_points: FloatArray) -> FloatArray:
        """The sum of r x f over segments, with their vectors and the forces with which they pull at their ends."""
        vectors = segment_vectors(nodes, chain.closed)
        lengths = np.linalg.norm(vectors, axis=1)
        pulls = (chain.type.stretching_derivatives(lengths, chain.closed) / lengths)[:, None] * vectors
        stiffnesses = joint_stiffnesses(chain.type, len(nodes), chain.clamped, chain.closed)
        if len(stiffnesses):
            pulls -= chain.type.bending_end_forces(vectors, stiffnesses, chain.closed)
        return np.einsum("ni,nj->ij", vectors, pulls)

    def tensions(self, chain: Chain, nodes: FloatArray, control_points: FloatArray) -> FloatArray:
        """Of lengths."""
        return chain.type.stretching_derivatives(self.lengths(nodes, control_points, chain.closed), chain.closed)

    def lengths(self, nodes: FloatArray, control_points: FloatArray, closed: bool) -> FloatArray:
        """Distances of nodes."""
        return np.linalg.norm(segment_vectors(nodes, closed), axis=-1)

    def angles(self, nodes: FloatArray, control_points: FloatArray, closed: bool) -> FloatArray:
        """The means of those at the two joints of a segment."""
        vectors = segment_vectors(nodes, closed)
        tangents = vectors / np.linalg.norm(vectors, axis=1, keepdims=True)
        at_joints = np.arccos(np.clip(joint_cosines(tangents, closed), -1.0, 1.0))
        if closed:
            return 0.5 * (at_joints + np.roll(at_joints, -1))
        if not len(at_joints):
            return np.zeros(len(tangents))
        padded = np.concatenate([at_joints[:1], at_joints, at_joints[-1:]])
        return 0.5 * (padded[1:] + padded[:-1])

    def curve(self, nodes: FloatArray, control_points: FloatArray, per_segment: int, closed: bool) -> FloatArray:
        """Nodes."""
        return nodes


STRAIGHT_SEGMENTS = StraightSegments()
