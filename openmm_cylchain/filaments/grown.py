"""What segments and joints a filament has that has grown: from the numbers of its first monomer and behind its last."""

from __future__ import annotations

import numpy as np

from ..errors import InputError
from ..mechanics.geometry import segment_vectors
from ..units.types import FloatArray, IntArray
from .filament import Filament
from .filament_type import FilamentType
from .growth import segment_of_length


def count_nodes_of_monomers(monomers: IntArray, per_segment: IntArray | int) -> IntArray:
    """How many nodes filaments have with the monomers (..., 2) from a first one to before another; none without any.

    Joints are at multiples of the monomers of a segment, with half of these or more beyond the last joint at an end.
    """
    least = np.asarray(per_segment) // 2
    first = -((-(monomers[..., 0] + least)) // per_segment)
    last = (monomers[..., 1] - least) // per_segment
    nodes: IntArray = np.where(monomers[..., 0] == monomers[..., 1], 0, np.maximum(0, last - first + 1) + 2)
    return nodes


def monomers_of_segments(monomers: IntArray, per_segment: int) -> IntArray:
    """Of how many monomers the segments (segments,) of a filament are; none where there is no filament."""
    first, last = monomers
    nodes = int(count_nodes_of_monomers(np.asarray(monomers), per_segment))
    if nodes == 0:
        return np.zeros(0, dtype=int)
    joint = -((-(first + per_segment // 2)) // per_segment)
    joints = per_segment * (joint + np.arange(nodes - 2))
    return np.diff(np.concatenate([[first], joints, [last]])).astype(int)


def rest_lengths(monomers: IntArray, per_segment: int, monomer_length: float) -> FloatArray:
    """Rest lengths (segments,) in nm of a filament with the monomers from a first one to before another."""
    return np.asarray(monomer_length * monomers_of_segments(monomers, per_segment), dtype=float)


def longest_segment(filament: Filament) -> float:
    """The longest rest length, in nm, that a segment of a filament can have, also as it grows."""
    filament_type, growth = filament.type, filament.growth
    if growth is None or not isinstance(filament_type, FilamentType):
        return filament.type.segment_length
    per_segment = growth.monomers_per_segment(filament_type)
    least = per_segment // 2
    # Without a joint, both of its ends are at an end of the filament.
    alone = per_segment + 2 * least - 1
    most = alone if growth.fewest_monomers(filament_type) <= alone else per_segment + least - 1
    return most * growth.monomers.length


class GrownChain:
    """The segments of a filament that has grown, or of one that is not there now: none.

    Parameters
    ----------
    kind : FilamentType
    monomer_length : float
        In nm.
    monomers : (2,) int array
        The number of the first monomer, and that behind the last one.
    particles : (n, 3) array
        All of its particles in nm, the nodes first.
    """

    def __init__(self, kind: FilamentType, monomer_length: float, monomers: IntArray, particles: FloatArray) -> None:
        self._kind, self._monomer_length = kind, monomer_length
        self._numbers = monomers_of_segments(monomers, round(kind.segment_length / monomer_length))
        if len(particles) < self.nodes:
            raise InputError(f"{self.nodes} nodes are needed for so many monomers, but there are {len(particles)}.")
        self._vectors = segment_vectors(particles[: self.nodes], False)
        self._lengths = np.linalg.norm(self._vectors, axis=1)

    @property
    def nodes(self) -> int:
        """How many nodes it has: none where there is no filament."""
        return len(self._numbers) + 1 if len(self._numbers) else 0

    @property
    def energies(self) -> tuple[float, float]:
        """Of stretching and bending in kJ/mol."""
        stretching = sum(float(np.sum(own.stretching_energy(self._lengths[which]))) for own, which in self._types)
        if len(self._numbers) < 2:
            return stretching, 0.0
        return stretching, float(np.sum(self._kind.bending_energies(self._vectors, self._stiffnesses)))

    @property
    def tensions(self) -> FloatArray:
        """Of its segments (segments,) in kJ/(mol nm)."""
        tensions = np.empty(len(self._numbers))
        for own, which in self._types:
            tensions[which] = own.stretching_derivative(self._lengths[which])
        return tensions

    @property
    def virial(self) -> FloatArray:
        """As that of ``SegmentKind.virial``."""
        pulls = (self.tensions / self._lengths)[:, None] * self._vectors
        if len(self._numbers) > 1:
            pulls -= self._kind.bending_end_forces(self._vectors, self._stiffnesses)
        return np.einsum("ni,nj->ij", self._vectors, pulls)

    @property
    def _types(self):
        # Those that there are, and which segments are of each.
        found = [(int(number), self._numbers == number) for number in np.unique(self._numbers)]
        return [(segment_of_length(self._kind, number * self._monomer_length), which) for number, which in found]

    @property
    def _stiffnesses(self):
        sums, which = np.unique(self._numbers[1:] + self._numbers[:-1], return_inverse=True)
        length = 0.5 * self._monomer_length
        return np.array([self._kind.stiffness_of_joint(length * float(both)) for both in sums])[which]
