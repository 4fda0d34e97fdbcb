"""Mechanics of chains in NumPy: resistance, noise, redistribution of forces, one step.

No OpenMM here. Equation numbers refer to Pesek et al., Soft Matter 2016, 12, 3360. All chains of a
system are handled at once: nodes are numbered chain after chain, and segment s joins the nodes
``first_node[s]`` (its minus end) and ``second_node[s]`` (its plus end).
"""

from dataclasses import dataclass, field

import numpy as np
import scipy

from ..errors import InstabilityError
from ..units.types import BoolArray, FloatArray, IntArray
from .flow import Flow, flow_velocities

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
    closed : (chains,) bool array, optional
        Rings, in which the last segment leads from the last node to the first; none if not given.
    planar : (chains,) bool array, optional
        Chains that lie in a plane of constant z and stay there; none if not given.
    node_friction : (nodes,) array, optional
        Friction of nodes by themselves, the same in all directions; none if not given.
    """

    node_counts: IntArray
    parallel: FloatArray
    perpendicular: FloatArray
    rotational: FloatArray
    extensional: FloatArray
    fixed: BoolArray
    closed: BoolArray = None  # type: ignore[assignment]  # None is for the constructor.
    planar: BoolArray = None  # type: ignore[assignment]
    node_friction: FloatArray | None = None
    start_of_chain: IntArray = field(init=False, repr=False)
    first_node: IntArray = field(init=False, repr=False)
    second_node: IntArray = field(init=False, repr=False)
    chain_of_segment: IntArray = field(init=False, repr=False)
    planar_node: BoolArray = field(init=False, repr=False)
    segment_dimensions: FloatArray = field(init=False, repr=False)
    place: IntArray | slice = field(init=False, repr=False)

    def __post_init__(self) -> None:
        counts = np.asarray(self.node_counts, dtype=int)
        none = np.zeros(len(counts), dtype=bool)
        closed = none if self.closed is None else np.asarray(self.closed, dtype=bool)
        planar = none if self.planar is None else np.asarray(self.planar, dtype=bool)
        starts = np.concatenate([[0], np.cumsum(counts)[:-1]])
        chain = np.repeat(np.arange(len(counts)), counts)
        last = np.zeros(len(chain), dtype=bool)
        last[starts + counts - 1] = True
        first = np.flatnonzero(~last | closed[chain])
        second = np.where(last[first], starts[chain[first]], first + 1)
        # Nodes of rings have their places in the banded resistance in the order 0, n - 1, 1, n - 2, ...
        place: IntArray | slice = slice(None)
        if closed.any():
            node = np.arange(len(chain))
            from_start, from_end = node - starts[chain], (starts + counts - 1)[chain] - node
            folded = starts[chain] + np.minimum(2 * from_start, 2 * from_end + 1)
            place = np.where(closed[chain], folded, node)
        for name, value in (
            ("closed", closed),
            ("planar", planar),
            ("start_of_chain", starts),
            ("first_node", first),
            ("second_node", second),
            ("chain_of_segment", chain[first]),
            ("planar_node", planar[chain]),
            ("segment_dimensions", np.where(planar[chain[first]], 2.0, 3.0)),
            ("place", place),
        ):
            object.__setattr__(self, name, value)

    @property
    def node_count(self) -> int:
        """Total number of nodes."""
        return int(np.sum(self.node_counts))

    @property
    def segment_count(self) -> int:
        """Total number of segments."""
        return len(self.first_node)

    def locate_segment(self, segment: int) -> tuple[int, int]:
        """The chain of a segment and the segment's number within it."""
        chain = int(self.chain_of_segment[segment])
        return chain, int(self.first_node[segment] - self.start_of_chain[chain])


def segment_geometry(chains: ChainSet, nodes: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Lengths (segments,) and tangents (segments, 3) of all segments."""
    difference = nodes[chains.second_node] - nodes[chains.first_node]
    length = np.sqrt(np.einsum("ij,ij->i", difference, difference))
    with np.errstate(invalid="ignore", divide="ignore"):
        tangent = difference / length[:, None]
    return length, tangent


def resistance_bands(chains: ChainSet, nodes: FloatArray) -> FloatArray:
    """The resistance Z of all chains in the lower banded form of ``scipy.linalg.solveh_banded``.

    Z = sum_s P_s^T zeta_s P_s, and the friction of nodes on its diagonal, with the segment resistance

        zeta = [[g_trans/4 + g_dr/l^2, g_trans/4 - g_dr/l^2],
                [g_trans/4 - g_dr/l^2, g_trans/4 + g_dr/l^2]]

    which is what eliminating the virtual forces from (22)-(24) leaves. Rows and columns of fixed
    nodes are those of the identity. Nodes are in the order of their ``place``: neighbours in open chains are one place
    apart, in rings two.

    Returns
    -------
    (6, 3 nodes) array, or (9, 3 nodes) if there is a ring
    """
    length, tangent = segment_geometry(chains, nodes)
    across_trans, along_trans = 0.25 * chains.perpendicular, 0.25 * chains.parallel
    across_dr, along_dr = chains.rotational / length**2, chains.extensional / length**2
    first, second = chains.first_node, chains.second_node

    # The six components of the symmetric 3x3 blocks: of each node, and of each segment's two nodes with each other.
    end = _axial(across_trans + across_dr, along_trans + along_dr, tangent)
    same = np.zeros((chains.node_count, 6))
    same[first] = end
    same[second] += end
    if chains.node_friction is not None:
        same[:, _ROW == _COLUMN] += chains.node_friction[:, None]
    other = _axial(across_trans - across_dr, along_trans - along_dr, tangent)
    if chains.fixed.any():
        same[chains.fixed] = [1.0, 0.0, 1.0, 0.0, 0.0, 1.0]
        other[chains.fixed[first] | chains.fixed[second]] = 0.0
    return _banded(same, _blocks_below(chains, other), chains.place)


def _blocks_below(chains, other):
    # Blocks one place below the diagonal, and two places if there is a ring, for the place in whose columns they are.
    first, second = chains.first_node, chains.second_node
    if not chains.closed.any():
        below = np.zeros((1, chains.node_count, 6))
        below[0, first] = other
        return below
    below = np.zeros((2, chains.node_count, 6))
    first, second = chains.place[first], chains.place[second]
    below[np.abs(second - first) - 1, np.minimum(first, second)] = other
    return below


def _banded(same, below, place):
    # LAPACK wants the columns of the banded form contiguous.
    columns = np.zeros((len(same), 3, 3 * len(below) + 3))
    for component, (row, column) in enumerate(zip(_ROW, _COLUMN)):
        columns[place, column, row - column] = same[:, component]
        for distance, blocks in enumerate(below, start=1):
            columns[:, column, 3 * distance + row - column] = blocks[:, component]
            columns[:, row, 3 * distance + column - row] = blocks[:, component]
    return columns.reshape(-1, columns.shape[-1]).T


def _axial(across, along, tangent):
    components = (along - across)[:, None] * tangent[:, _ROW] * tangent[:, _COLUMN]
    components[:, _ROW == _COLUMN] += across[:, None]
    return components


def redistribute(chains: ChainSet, nodes: FloatArray, forces: FloatArray, flow: Flow | None = None) -> FloatArray:
    """Velocities of all nodes under nodal forces (nodes, 3), in O(nodes): Z v = f, or Z (v - u) = f in a flow u.

    For a flow that is linear in space, Z u holds all of the drag on resting segments: that of u at their middles, and
    what its gradient does to turn and stretch them. Fixed nodes stay, but the flow drags at their segments, too. Planar
    chains do not move along z.

    Raises
    ------
    InstabilityError
        If the resistance is singular: a segment has collapsed or a position is not finite.
    """
    if flow is not None:
        velocities = _flow_at_nodes(chains, nodes, flow)
        forces = forces + segment_forces_to_nodes(chains, *drag_forces(chains, nodes, velocities))
        if chains.node_friction is not None:
            forces += chains.node_friction[:, None] * velocities
    right = np.where(chains.fixed[:, None], 0.0, forces)
    right[chains.planar_node, 2] = 0.0
    places = np.empty_like(right)
    places[chains.place] = right
    try:
        velocities = scipy.linalg.solveh_banded(
            resistance_bands(chains, nodes), places.reshape(-1), overwrite_ab=True, lower=True, check_finite=False
        )
    except scipy.linalg.LinAlgError:
        raise InstabilityError("The resistance of a chain is singular.") from None
    return velocities.reshape(-1, 3)[chains.place]


def _flow_at_nodes(chains, nodes, flow):
    velocities = flow_velocities(flow, nodes)
    velocities[chains.planar_node, 2] = 0.0
    return velocities


def drag_forces(chains: ChainSet, nodes: FloatArray, velocities: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Forces zeta_s v on the ends of all segments whose nodes move with the given velocities (nodes, 3).

    They are (minus, plus), (segments, 3) each. Those of the friction of nodes are not among them.
    """
    length, tangent = segment_geometry(chains, nodes)
    first, second = velocities[chains.first_node], velocities[chains.second_node]
    translation = _apply(chains.perpendicular, chains.parallel, tangent, 0.25 * (first + second))
    deformation = _apply(chains.rotational, chains.extensional, tangent, (second - first) / length[:, None] ** 2)
    return translation - deformation, translation + deformation


def _apply(across, along, tangent, vector):
    projection = np.einsum("ij,ij->i", tangent, vector)
    return across[:, None] * vector + ((along - across) * projection)[:, None] * tangent


def segments_at_nodes(chains: ChainSet) -> IntArray:
    """How many segments meet in every node: (nodes,)."""
    return np.bincount(np.concatenate([chains.first_node, chains.second_node]), minlength=chains.node_count)


def segment_forces_to_nodes(chains: ChainSet, minus: FloatArray, plus: FloatArray) -> FloatArray:
    """Nodal forces from the forces (segments, 3) on the minus and plus ends of all segments."""
    forces = np.zeros((chains.node_count, 3))
    forces[chains.first_node] += minus
    forces[chains.second_node] += plus
    return forces


def noise_forces(
    chains: ChainSet, nodes: FloatArray, kT: float, step: float, translational: FloatArray, rotational: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Random forces on the ends of all segments, step (1) of Section 4.

    F = sqrt(2 k_B T/dt) g_trans^(1/2) a, T = sqrt(2 k_B T/dt) g_dr^(1/2) b, f_pm = F/2 pm T/l, so that
    the nodal forces have the covariance (2 k_B T/dt) Z, but for what the friction of nodes adds to it (see
    ``random_forces``).

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


def random_forces(
    chains: ChainSet,
    nodes: FloatArray,
    kT: float,
    step: float,
    translational: FloatArray,
    rotational: FloatArray,
    nodal: FloatArray | None = None,
) -> FloatArray:
    """Random forces (nodes, 3) on all nodes, of the covariance (2 k_B T/dt) Z.

    Those of ``noise_forces``, and sqrt(2 k_B T xi/dt) c where nodes have a friction xi by themselves. The independent
    standard Gaussian vectors c, ``nodal`` (nodes, 3), are needed if, and only if, they have.
    """
    forces = segment_forces_to_nodes(chains, *noise_forces(chains, nodes, kT, step, translational, rotational))
    if chains.node_friction is not None:
        forces += np.sqrt(2.0 * kT / step * chains.node_friction)[:, None] * nodal
    return forces


def _apply_root(across, along, tangent, vector):
    projection = np.einsum("ij,ij->i", tangent, vector)
    return np.sqrt(across)[:, None] * vector + ((np.sqrt(along) - np.sqrt(across)) * projection)[:, None] * tangent


def thermal_forces(chains: ChainSet, nodes: FloatArray, kT: float) -> tuple[FloatArray, FloatArray]:
    """Forces (minus, plus), (segments, 3), on the ends of all segments from the thermal torque (15), step (2) of
    Section 4.

    T = 2 k_B T (2 - g_def/g_rot) t, f_pm = pm T/l; in d dimensions, k_B T (d + 1 - (d - 1) g_def/g_rot) t. None on
    segments without friction, whose nodes have all of it: the mobility of those depends on nothing.
    """
    length, tangent = segment_geometry(chains, nodes)
    dimensions, turns = chains.segment_dimensions, chains.rotational > 0.0
    ratio = chains.extensional / np.where(turns, chains.rotational, 1.0)
    torque = kT * np.where(turns, dimensions + 1.0 - (dimensions - 1.0) * ratio, 0.0)
    pair = (torque / length)[:, None] * tangent
    return -pair, pair


def euler_step(
    chains: ChainSet,
    nodes: FloatArray,
    forces: FloatArray,
    kT: float,
    step: float,
    translational: FloatArray,
    rotational: FloatArray,
    flow: Flow | None = None,
    nodal: FloatArray | None = None,
) -> FloatArray:
    """Displacements in one step of the paper's scheme, Section 4 (Euler-Maruyama).

    dx = dt Z(x)^-1 (f + f_noise + f_thermal), with the thermal torque (15) of a *free* segment sent
    through the constraints. Exact in its drift for free segments. For chains it is not: k_B T div(Z^-1)
    involves the mobility of a segment's ends inside the chain, and equilibrium averages keep a bias at
    any step (freely jointed, two segments: <cos^2> = 0.30 where 1/3 is exact).
    """
    noise = random_forces(chains, nodes, kT, step, translational, rotational, nodal)
    thermal = segment_forces_to_nodes(chains, *thermal_forces(chains, nodes, kT))
    return step * redistribute(chains, nodes, forces + noise + thermal, flow)


def midpoint_step(
    chains: ChainSet,
    nodes: FloatArray,
    forces: FloatArray,
    kT: float,
    step: float,
    translational: FloatArray,
    rotational: FloatArray,
    flow: Flow | None = None,
    nodal: FloatArray | None = None,
) -> FloatArray:
    """Displacements in one step of Fixman's midpoint scheme; weak order one, right drift on chains.

    x* = x + dt/2 Z(x)^-1 f, dx = dt Z(x*)^-1 f, with the same total force f, noise drawn at x, in both.
    Expanding Z(x*)^-1 gives the drift k_B T div(Z^-1) with no formula for it. (Fixman, J. Chem. Phys.
    1978, 69, 1527.) The drag of a flow is that at x and at x*.
    """
    noise = random_forces(chains, nodes, kT, step, translational, rotational, nodal)
    total = forces + noise
    halfway = nodes + 0.5 * step * redistribute(chains, nodes, total, flow)
    return step * redistribute(chains, halfway, total, flow)


STEPS = {"euler": euler_step, "midpoint": midpoint_step}


def joint_tensions(
    chains: ChainSet, nodes: FloatArray, minus: FloatArray, plus: FloatArray, flow: Flow | None = None
) -> FloatArray:
    """Virtual forces Phi at the joints, eqs. (22)-(24), from the forces on the ends of all segments.

    Phi of joint i is the force that segment i + 1 exerts on segment i: parallel to the tangent when the
    chain is under tension. It is what segment i needs, beyond the forces applied to it, to move as the
    chain does: Phi_i = zeta_i (v - u) - f_i at its plus end. The friction of a node belongs to its segments in equal
    parts.

    Returns
    -------
    (segments, 3) array; the row of the last segment of an open chain is zero (a free end), unless that end is
    fixed, when it is the force that holds it. In a ring, that row is the joint at the first node.
    """
    velocities = redistribute(chains, nodes, segment_forces_to_nodes(chains, minus, plus), flow)
    if flow is not None:
        velocities -= _flow_at_nodes(chains, nodes, flow)
    tensions = drag_forces(chains, nodes, velocities)[1] - plus
    if chains.node_friction is not None:
        share = chains.node_friction / segments_at_nodes(chains)
        tensions += share[chains.second_node, None] * velocities[chains.second_node]
    tensions[chains.planar_node[chains.first_node], 2] = 0.0
    return tensions
