"""What segments and joints a filament has that has grown: from the numbers of its first monomer and behind its last."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..errors import InputError
from ..mechanics.geometry import segment_vectors
from ..units.types import FloatArray, IntArray
from .filament_type import FilamentType
from .growth import Growth, segment_of_length

if TYPE_CHECKING:
    from .filament import Filament


def count_nodes_of_monomers(monomers: IntArray, per_segment: IntArray | int) -> IntArray:
    """How many nodes filaments have with the monomers (..., 2) from a first one to before another.

    Joints are at multiples of the monomers of a segment, with half of these or more beyond the last joint at an end.
    """
    least = np.asarray(per_segment) // 2
    first = -((-(monomers[..., 0] + least)) // per_segment)
    last = (monomers[..., 1] - least) // per_segment
    return np.maximum(0, last - first + 1) + 2


def monomers_of_segments(monomers: IntArray, per_segment: int) -> IntArray:
    """Of how many monomers the segments (segments,) of a filament are."""
    first, last = monomers
    nodes = int(count_nodes_of_monomers(np.asarray(monomers), per_segment))
    joint = -((-(first + per_segment // 2)) // per_segment)
    joints = per_segment * (joint + np.arange(nodes - 2))
    return np.diff(np.concatenate([[first], joints, [last]])).astype(int)


def rest_lengths(monomers: IntArray, per_segment: int, monomer_length: float) -> FloatArray:
    """Rest lengths (segments,) in nm of a filament with the monomers from a first one to before another."""
    return monomer_length * monomers_of_segments(monomers, per_segment)


def longest_segment(filament_type: FilamentType, growth: Growth) -> float:
    """The longest rest length, in nm, that a segment of a filament that grows can have."""
    per_segment = growth.monomers_per_segment(filament_type)
    least = per_segment // 2
    # Without a joint, both of its ends are at an end of the filament.
    alone = per_segment + 2 * least - 1
    most = alone if growth.fewest_monomers(filament_type) <= alone else per_segment + least - 1
    return most * growth.monomers.length


def energies_of_grown(filament: Filament, nodes: FloatArray, monomers: IntArray) -> tuple[float, float]:
    """Stretching and bending energy in kJ/mol of a filament that has grown, with all of its particles (n, 3) in nm."""
    kind, growth = filament.type, filament.growth
    assert isinstance(kind, FilamentType) and growth is not None
    numbers = monomers_of_segments(monomers, growth.monomers_per_segment(kind))
    if len(nodes) <= len(numbers):
        raise InputError(f"{len(numbers)} segments have {len(numbers) + 1} nodes, but there are {len(nodes)}.")
    vectors = segment_vectors(nodes[: len(numbers) + 1], False)
    lengths = np.linalg.norm(vectors, axis=1)
    stretching = 0.0
    for number in np.unique(numbers):
        own = segment_of_length(kind, int(number) * growth.monomers.length)
        stretching += float(np.sum(own.stretching_energy(lengths[numbers == number])))
    if len(numbers) < 2:
        return stretching, 0.0
    means = 0.5 * growth.monomers.length * (numbers[1:] + numbers[:-1])
    found, which = np.unique(means, return_inverse=True)
    stiffnesses = np.array([kind.stiffness_of_joint(float(length)) for length in found])[which]
    return stretching, float(np.sum(kind.bending_energies(vectors, stiffnesses)))
