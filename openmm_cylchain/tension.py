"""Forces of a chain's own potentials on the ends of each segment, as joint tensions need them.

OpenMM reports the total force on a node; the virtual force at a joint depends on how much of it acts
on the segment before the joint and how much on the one behind it.
"""

import numpy as np

from .engines.redistribution import joint_tensions, segment_forces_to_nodes


def segment_end_forces(filament_type, nodes):
    """Forces of stretching (8) and bending (28) on the ends of all segments of one filament.

    A bending torque T on a segment is the pair of forces -T/l and T/l on its ends, with
    T_i = -dV_b/dc (t_j - c t_i) for each joint with a neighbour j (the print of (28) lacks brackets and
    a 1/l).

    Parameters
    ----------
    filament_type : FilamentType
    nodes : (n, 3) array in nm

    Returns
    -------
    (minus, plus) : two (n - 1, 3) arrays in kJ/(mol nm)
    """
    difference = np.diff(nodes, axis=0)
    length = np.linalg.norm(difference, axis=1)
    tangent = difference / length[:, None]
    plus = -filament_type.stretching_derivative(length)[:, None] * tangent
    if filament_type.bending_rigidity > 0.0 and len(length) > 1:
        cosine = np.einsum("ij,ij->i", tangent[:-1], tangent[1:])[:, None]
        slope = filament_type.bending_derivative(cosine)
        plus[:-1] -= slope * (tangent[1:] - cosine * tangent[:-1]) / length[:-1, None]
        plus[1:] -= slope * (tangent[:-1] - cosine * tangent[1:]) / length[1:, None]
    return -plus, plus


def split_external_forces(chains, forces, minus, plus):
    """Add what the nodal forces hold beyond ``minus`` and ``plus`` to the ends of the segments.

    Half to each of the two segments at a joint, all of it to the one segment at an end.

    Returns
    -------
    (minus, plus) : two (segments, 3) arrays
    """
    external = forces - segment_forces_to_nodes(chains, minus, plus)
    neighbours = np.zeros(chains.node_count)
    np.add.at(neighbours, chains.first_node, 1.0)
    np.add.at(neighbours, chains.first_node + 1, 1.0)
    share = external / neighbours[:, None]
    return minus + share[chains.first_node], plus + share[chains.first_node + 1]


def filament_tensions(filaments, node_indices, chains, positions, forces):
    """Virtual forces Phi at the joints of all filaments, see ``Filaments.joint_tensions``.

    Parameters
    ----------
    filaments : sequence of Filament
    node_indices : sequence of int arrays
        Particle indices of the nodes of each filament.
    chains : ChainSet
        The same filaments.
    positions, forces : (particles, 3) arrays in nm and kJ/(mol nm)

    Returns
    -------
    list of (segments - 1, 3) arrays in kJ/(mol nm), one for each filament
    """
    ends = [segment_end_forces(one.type, positions[nodes]) for one, nodes in zip(filaments, node_indices)]
    nodes = np.concatenate(node_indices)
    minus, plus = (np.concatenate(one) for one in zip(*ends))
    minus, plus = split_external_forces(chains, forces[nodes], minus, plus)
    tensions = joint_tensions(chains, positions[nodes], minus, plus)
    boundaries = np.cumsum([filament.segments for filament in filaments])[:-1]
    return [part[:-1] for part in np.split(tensions, boundaries)]


def axial_tensions(nodes, virtual_forces):
    """Components (n - 2,) of virtual forces (n - 2, 3) along a chain with nodes (n, 3), positive under tension.

    The direction at a joint is that of the sum of the unit vectors along its two segments.
    """
    tangents = np.diff(nodes, axis=0)
    tangents /= np.linalg.norm(tangents, axis=1)[:, None]
    directions = tangents[:-1] + tangents[1:]
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    return np.einsum("ij,ij->i", virtual_forces, directions)
