"""The segment of a chain by which a simulation has gone wrong."""

from dataclasses import dataclass

import numpy as np

from ..units.types import FloatArray
from .redistribution import ChainSet


@dataclass(frozen=True)
class BrokenSegment:
    """Which segment has gone wrong, and how.

    Attributes
    ----------
    segment : int
        Its number in the chain.
    what : str
        What is wrong with it, or would be after a step, for messages.
    """

    chain: int
    segment: int
    what: str


def find_broken_segment(
    chains: ChainSet,
    rest_lengths: FloatArray,
    ranges: FloatArray,
    positions: FloatArray,
    forces: FloatArray | None = None,
    displacements: FloatArray | None = None,
) -> BrokenSegment | None:
    """The segment by which a configuration, or a step from it, has gone wrong; None if all is well.

    Parameters
    ----------
    rest_lengths : (segments,) array
    ranges : (segments,) array
        By how much a segment may be longer or shorter than that.
    positions, forces, displacements : (nodes, 3) arrays
        At the start of a step, and what it would move nodes by. No forces and no displacements if not given.
    """
    forces = np.zeros_like(positions) if forces is None else forces
    displacements = np.zeros_like(positions) if displacements is None else displacements
    first, second = chains.first_node, chains.second_node
    with np.errstate(all="ignore"):
        changes = displacements[second] - displacements[first]
        change = np.linalg.norm(changes, axis=1)
        length = np.linalg.norm(positions[second] - positions[first] + changes, axis=1)
        # Written so that NaN counts as broken.
        leaves_range = ~(np.abs(length - rest_lengths) < ranges)
        broken = ~(change < rest_lengths) | leaves_range
    if not broken.any():
        return None
    # A singular resistance spoils every chain, so the culprit is looked for in what went in.
    finite = np.all(np.isfinite(positions) & np.isfinite(forces), axis=1)
    culprits = np.flatnonzero(~(finite[first] & finite[second]))
    if not len(culprits):
        culprits = np.flatnonzero(broken)
        scale = np.linalg.norm(forces[first], axis=1) + np.linalg.norm(forces[second], axis=1)
        culprits = culprits[np.argsort(-scale[culprits], kind="stable")]
    culprit = culprits[0]
    if not (finite[first[culprit]] and finite[second[culprit]]):
        what = "the force on it, or its position, is not finite"
    elif change[culprit] < rest_lengths[culprit]:
        rest, extension = rest_lengths[culprit], ranges[culprit]
        what = (
            f"it would be {length[culprit]:.6g} nm long after it, and its FENE potential is finite between "
            f"{max(0.0, rest - extension):.6g} and {rest + extension:.6g} nm alone"
        )
    else:
        what = f"its ends would move by {change[culprit]:.3g} nm against each other in one step"
    return BrokenSegment(*chains.locate_segment(culprit), what)
