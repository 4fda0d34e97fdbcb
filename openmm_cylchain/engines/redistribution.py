"""Mechanics of chains in NumPy: resistance, noise, redistribution of forces, one step.

No OpenMM here. Equation numbers refer to Pesek et al., Soft Matter 2016, 12, 3360. All chains of a
system are handled at once: nodes are numbered chain after chain, and segment s joins the nodes
``first_node[s]`` (its minus end) and ``first_node[s] + 1`` (its plus end).
"""

from dataclasses import dataclass

import numpy as np
from scipy.linalg import LinAlgError, solveh_banded

from ..errors import InstabilityError

_BANDWIDTH = 5  # 3x3 blocks next to the diagonal reach five places below it.
_ROW, _COLUMN = np.tril_indices(3)


@dataclass(frozen=True)
class ChainSet:
    """Chains with the friction of their segments, eq. (3), kept at the values of the rest length.

    Attributes
    ----------
    node_counts : (chains,) int array
        Number of nodes of each chain, at least two.
    parallel, perpendicular, rotational, extensional : (segments,) arrays
        Friction coefficients of every segment, chain after chain.
    fixed : (nodes,) bool array
        Nodes that do not move (clamped).
    """

    node_counts: np.ndarray
    parallel: np.ndarray
    perpendicular: np.ndarray
    rotational: np.ndarray
    extensional: np.ndarray
    fixed: np.ndarray

    def __post_init__(self):
        starts = np.concatenate([[0], np.cumsum(self.node_counts)[:-1]])
        first = np.concatenate([np.arange(n - 1) + s for n, s in zip(self.node_counts, starts)] or [[]]).astype(int)
        chain = np.repeat(np.arange(len(self.node_counts)), np.asarray(self.node_counts) - 1)
        object.__setattr__(self, "first_node", first)
        object.__setattr__(self, "chain_of_segment", chain)
        object.__setattr__(self, "start_of_chain", starts)

    @property
    def node_count(self):
        """Total number of nodes."""
        return int(np.sum(self.node_counts))

    @property
    def segment_count(self):
        """Total number of segments."""
        return len(self.first_node)

    def locate_segment(self, segment):
        """The chain of a segment and the segment's number within it."""
        chain = int(self.chain_of_segment[segment])
        return chain, int(self.first_node[segment] - self.start_of_chain[chain])


def segment_geometry(chains, nodes):
    """Lengths (segments,) and tangents (segments, 3) of all segments."""
    difference = nodes[chains.first_node + 1] - nodes[chains.first_node]
    length = np.sqrt(np.einsum("ij,ij->i", difference, difference))
    with np.errstate(invalid="ignore", divide="ignore"):
        tangent = difference / length[:, None]
    return length, tangent


def resistance_bands(chains, nodes):
    """The resistance Z of all chains in the lower banded form of ``scipy.linalg.solveh_banded``.

    Z = sum_s P_s^T zeta_s P_s with the segment resistance

        zeta = [[g_trans/4 + g_dr/l^2, g_trans/4 - g_dr/l^2],
                [g_trans/4 - g_dr/l^2, g_trans/4 + g_dr/l^2]]

    which is what eliminating the virtual forces from (22)-(24) leaves. Rows and columns of fixed
    nodes are those of the identity.

    Returns
    -------
    (6, 3 nodes) array
    """
    length, tangent = segment_geometry(chains, nodes)
    across_trans, along_trans = 0.25 * chains.perpendicular, 0.25 * chains.parallel
    across_dr, along_dr = chains.rotational / length**2, chains.extensional / length**2
    first = chains.first_node

    # The six components of a symmetric 3x3 block for each node, at first for the segment that starts there.
    same, other = np.zeros((2, chains.node_count, 6))
    same[first] = _axial(across_trans + across_dr, along_trans + along_dr, tangent)
    other[first] = _axial(across_trans - across_dr, along_trans - along_dr, tangent)
    same[1:] += same[:-1].copy()
    if chains.fixed.any():
        same[chains.fixed] = [1.0, 0.0, 1.0, 0.0, 0.0, 1.0]
        other[chains.fixed] = 0.0
        other[:-1][chains.fixed[1:]] = 0.0

    # LAPACK wants the columns of the banded form contiguous.
    columns = np.zeros((chains.node_count, 3, _BANDWIDTH + 1))
    for component, (row, column) in enumerate(zip(_ROW, _COLUMN)):
        columns[:, column, row - column] = same[:, component]
        columns[:, column, 3 + row - column] = other[:, component]
        columns[:, row, 3 + column - row] = other[:, component]
    return columns.reshape(-1, _BANDWIDTH + 1).T


def _axial(across, along, tangent):
    components = (along - across)[:, None] * tangent[:, _ROW] * tangent[:, _COLUMN]
    components[:, _ROW == _COLUMN] += across[:, None]
    return components


def redistribute(chains, nodes, forces):
    """Velocities Z^-1 f of all nodes under nodal forces (nodes, 3), in O(nodes).

    Raises
    ------
    InstabilityError
        If the resistance is singular: a segment has collapsed or a position is not finite.
    """
    right = np.where(chains.fixed[:, None], 0.0, forces).reshape(-1)
    try:
        velocities = solveh_banded(
            resistance_bands(chains, nodes), right, overwrite_ab=True, lower=True, check_finite=False
        )
    except LinAlgError:
        raise InstabilityError("The resistance of a chain is singular.") from None
    return velocities.reshape(-1, 3)


def segment_forces_to_nodes(chains, minus, plus):
    """Nodal forces from the forces (segments, 3) on the minus and plus ends of all segments."""
    forces = np.zeros((chains.node_count, 3))
    forces[chains.first_node] += minus
    forces[chains.first_node + 1] += plus
    return forces


def noise_forces(chains, nodes, kT, step, translational, rotational):
    """Random forces on the ends of all segments, step (1) of Section 4.

    F = sqrt(2 k_B T/dt) g_trans^(1/2) a, T = sqrt(2 k_B T/dt) g_dr^(1/2) b, f_pm = F/2 pm T/l, so that
    the nodal forces have the covariance (2 k_B T/dt) Z.

    Parameters
    ----------
    translational, rotational : (segments, 3) arrays
        The independent standard Gaussian vectors a and b.

    Returns
    -------
    (minus, plus) : two (segments, 3) arrays
    """
    length, tangent = segment_geometry(chains, nodes)
    amplitude = np.sqrt(2.0 * kT / step)
    force = amplitude * _apply_root(chains.perpendicular, chains.parallel, tangent, translational)
    torque = amplitude * _apply_root(chains.rotational, chains.extensional, tangent, rotational)
    pair = torque / length[:, None]
    return 0.5 * force - pair, 0.5 * force + pair


def _apply_root(across, along, tangent, vector):
    projection = np.einsum("ij,ij->i", tangent, vector)
    return np.sqrt(across)[:, None] * vector + ((np.sqrt(along) - np.sqrt(across)) * projection)[:, None] * tangent


def thermal_forces(chains, nodes, kT):
    """Forces on the ends of all segments from the thermal torque (15), step (2) of Section 4.

    T = 2 k_B T (2 - g_def/g_rot) t, f_pm = pm T/l.

    Returns
    -------
    (minus, plus) : two (segments, 3) arrays
    """
    length, tangent = segment_geometry(chains, nodes)
    torque = 2.0 * kT * (2.0 - chains.extensional / chains.rotational)
    pair = (torque / length)[:, None] * tangent
    return -pair, pair


def euler_step(chains, nodes, forces, kT, step, translational, rotational):
    """Displacements in one step of the paper's scheme, Section 4 (Euler-Maruyama).

    dx = dt Z(x)^-1 (f + f_noise + f_thermal), with the thermal torque (15) of a *free* segment sent
    through the constraints. Exact in its drift for free segments. For chains it is not: k_B T div(Z^-1)
    involves the mobility of a segment's ends inside the chain, and equilibrium averages keep a bias at
    any step (freely jointed, two segments: <cos^2> = 0.30 where 1/3 is exact).
    """
    noise = segment_forces_to_nodes(chains, *noise_forces(chains, nodes, kT, step, translational, rotational))
    thermal = segment_forces_to_nodes(chains, *thermal_forces(chains, nodes, kT))
    return step * redistribute(chains, nodes, forces + noise + thermal)


def midpoint_step(chains, nodes, forces, kT, step, translational, rotational):
    """Displacements in one step of Fixman's midpoint scheme; weak order one, right drift on chains.

    x* = x + dt/2 Z(x)^-1 f, dx = dt Z(x*)^-1 f, with the same total force f, noise drawn at x, in both.
    Expanding Z(x*)^-1 gives the drift k_B T div(Z^-1) with no formula for it. (Fixman, J. Chem. Phys.
    1978, 69, 1527.)
    """
    noise = segment_forces_to_nodes(chains, *noise_forces(chains, nodes, kT, step, translational, rotational))
    total = forces + noise
    halfway = nodes + 0.5 * step * redistribute(chains, nodes, total)
    return step * redistribute(chains, halfway, total)


STEPS = {"euler": euler_step, "midpoint": midpoint_step}


def joint_tensions(chains, nodes, minus, plus):
    """Virtual forces Phi at the joints, eqs. (22)-(24), from the forces on the ends of all segments.

    Phi of joint i is the force that segment i + 1 exerts on segment i: parallel to the tangent when the
    chain is under tension. It is what segment i needs, beyond the forces applied to it, to move as the
    chain does: Phi_i = zeta_i v - f_i at its plus end.

    Returns
    -------
    (segments, 3) array; the row of the last segment of a chain is zero (a free end), unless that end is
    fixed, when it is the force that holds it.
    """
    velocities = redistribute(chains, nodes, segment_forces_to_nodes(chains, minus, plus))
    length, tangent = segment_geometry(chains, nodes)
    mean = 0.25 * (velocities[chains.first_node] + velocities[chains.first_node + 1])
    difference = (velocities[chains.first_node + 1] - velocities[chains.first_node]) / length[:, None] ** 2
    resistance = _apply(chains.perpendicular, chains.parallel, tangent, mean) + _apply(
        chains.rotational, chains.extensional, tangent, difference
    )
    return resistance - plus


def _apply(across, along, tangent, vector):
    projection = np.einsum("ij,ij->i", tangent, vector)
    return across[:, None] * vector + ((along - across) * projection)[:, None] * tangent
