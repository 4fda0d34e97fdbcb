"""Forces of a chain's own potentials on the ends of each segment, as joint tensions need them.

OpenMM reports the total force on a node; the virtual force at a joint depends on how much of it acts
on the segment before the joint and how much on the one behind it.
"""

from collections.abc import Iterable, Sequence
from typing import Any, Protocol

import numpy as np

from ..units.types import FloatArray, IntArray
from .flow import Flow
from .geometry import segment_vectors
from .redistribution import ChainSet, joint_tensions, segment_forces_to_nodes, segments_at_nodes


class Chain(Protocol):
    """What the forces of a chain's own potentials depend on: a ``Filament`` has it."""

    @property
    def type(self) -> Any: ...

    @property
    def segments(self) -> int: ...

    @property
    def closed(self) -> bool: ...

    @property
    def propulsion(self) -> float: ...

    @property
    def joint_stiffnesses(self) -> FloatArray: ...


def segment_end_forces(filament: Chain, nodes: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Forces of stretching (8), bending (28) and propulsion on the minus and plus ends of all segments of one filament.

    (segments, 3) arrays in kJ/(mol nm), for nodes (n, 3) in nm.
    """
    vectors = segment_vectors(nodes, filament.closed)
    length = np.linalg.norm(vectors, axis=1)
    tangent = vectors / length[:, None]
    plus = -filament.type.stretching_derivatives(length, filament.closed)[:, None] * tangent
    plus += filament.type.bending_end_forces(vectors, filament.joint_stiffnesses, filament.closed)
    propulsion = 0.5 * filament.propulsion * tangent
    return propulsion - plus, propulsion + plus


def split_external_forces(
    chains: ChainSet, forces: FloatArray, minus: FloatArray, plus: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Add what the nodal forces hold beyond (minus, plus), (segments, 3), to these forces on the ends of the segments.

    Half to each of the two segments at a joint, all of it to the one segment at an end.
    """
    external = forces - segment_forces_to_nodes(chains, minus, plus)
    share = external / segments_at_nodes(chains)[:, None]
    return minus + share[chains.first_node], plus + share[chains.second_node]


def filament_tensions(
    filaments: Iterable[Chain],
    node_indices: Sequence[IntArray],
    chains: ChainSet,
    positions: FloatArray,
    forces: FloatArray,
    flow: Flow | None = None,
) -> list[FloatArray]:
    """Virtual forces Phi at the joints of all filaments, see ``FilamentsInContext.joint_tensions``.

    Parameters
    ----------
    node_indices : sequence of int arrays
        Particle indices of the nodes of each filament.
    chains : ChainSet
        The same filaments.
    positions, forces : (particles, 3) arrays in nm and kJ/(mol nm)

    Returns
    -------
    list of (joints, 3) arrays in kJ/(mol nm), one for each filament
    """
    ends = [segment_end_forces(one, positions[nodes]) for one, nodes in zip(filaments, node_indices)]
    nodes = np.concatenate(node_indices)
    minus, plus = (np.concatenate(one) for one in zip(*ends))
    minus, plus = split_external_forces(chains, forces[nodes], minus, plus)
    tensions = joint_tensions(chains, positions[nodes], minus, plus, flow)
    boundaries = np.cumsum([filament.segments for filament in filaments])[:-1]
    parts = np.split(tensions, boundaries)
    return [part if filament.closed else part[:-1] for filament, part in zip(filaments, parts)]


def axial_tensions(nodes: FloatArray, virtual_forces: FloatArray, closed: bool = False) -> FloatArray:
    """Components (joints,) of virtual forces (joints, 3) along a chain with nodes (n, 3), positive under tension.

    The direction at a joint is that of the sum of the unit vectors along its two segments. Forces are in the order of
    ``FilamentsInContext.joint_tensions``.
    """
    tangents = segment_vectors(nodes, closed)
    tangents /= np.linalg.norm(tangents, axis=1)[:, None]
    return components_along(tangents, virtual_forces)


def components_along(tangents: FloatArray, virtual_forces: FloatArray) -> FloatArray:
    """Components (joints,) of virtual forces (joints, 3) along a chain with unit vectors (segments, 3)."""
    directions = tangents + np.roll(tangents, -1, axis=0)
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    return np.einsum("ij,ij->i", virtual_forces, directions[: len(virtual_forces)])
