"""Filaments that forces known before a run pull so much that their segments are too long to be a wormlike chain.

A force F irons out all bends that are longer than (k_B T l_p/F)^(1/2). Where segments are not short against that, they
leave out bends that a wormlike chain would have, and the chain is longer than it: see ``theory.wlc_share_of_force``.
"""

import math
import warnings
from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import Any

import numpy as np
import scipy

from ..errors import SegmentLengthWarning
from ..filaments.collection import FilamentCollection
from ..filaments.filament import Filament, Tether
from ..filaments.filament_type import FilamentType
from ..filaments.straight_segments import STRAIGHT_SEGMENTS
from ..theory.force_extension import marko_siggia_extension, wlc_share_of_force
from ..units.quantities import PICONEWTON
from ..units.types import FloatArray
from .buckling_step import displacements

_LARGEST_ERROR = 0.1
_BEYOND = 0.05
_HELD = 1e6


def warn_of_pulled_filaments(
    filaments: FilamentCollection, temperature: float, constant_forces: Mapping[int, FloatArray]
) -> None:
    """Issue a SegmentLengthWarning, for each type, of the filament whose force is most off, if by more than a tenth.

    Of a type that is calibrated up to a force, of the one that is pulled most, if by more. Filaments are as they begin.
    At a temperature of zero, nothing bends. Constant forces, (3,) in kJ/(mol nm), are by the particle that they act on.
    """
    if temperature == 0.0:
        return
    worst: dict[str, tuple[float, float, FilamentType, int]] = {}
    for number, (kind, force) in _pulls(filaments, temperature, constant_forces).items():
        error = _error(kind, force, temperature)
        if error > worst.get(kind.name, (0.0,))[0]:
            worst[kind.name] = error, force, kind, number
    for _, force, kind, number in worst.values():
        _warn(kind, number, force, temperature)


def _error(kind, force, temperature):
    # Zero where it is no reason to warn.
    if kind.calibrated_force is not None:
        return max(0.0, math.log(force / kind.calibrated_force) - _BEYOND)
    share = float(wlc_share_of_force(kind, force, temperature))
    return abs(math.log(share)) if abs(share - 1.0) > _LARGEST_ERROR else 0.0


def _warn(kind, number, force, temperature):
    text = f"Filament {number} ({kind.name}) is pulled with {force / PICONEWTON:.3g} pN"
    if kind.calibrated_force is not None:
        text += (
            f", but calibrated up to {kind.calibrated_force / PICONEWTON:.3g} pN: calibrate it up to a larger force."
        )
    else:
        bend = math.sqrt(kind.bending_rigidity / force)
        share = float(wlc_share_of_force(kind, force, temperature))
        text += (
            f", under which a wormlike chain bends over (k_BT l_p/F)^(1/2) = {bend:.3g} nm. In segments of "
            f"{kind.segment_length:.4g} nm, a long filament has the extension of the wormlike chain at {share:.2f} of "
            "the force. Take theory.calibrated_up_to_force (in a file: calibrated_up_to_force), and shorter segments "
            "where it says so."
        )
    warnings.warn(text, SegmentLengthWarning, stacklevel=4)


def _pulls(filaments, temperature, constant_forces):
    # The type and the largest tension of each filament that is pulled, by what is known of it.
    tethers: dict[int, list[Tether]] = {}
    for tether in filaments.tethers:
        tethers.setdefault(tether.filament, []).append(tether)
    known: dict[Any, float] = {}
    pulls = {}
    for number, filament in enumerate(filaments):
        kind = filament.type
        if kind.segment_kind is not STRAIGHT_SEGMENTS or kind.bending_rigidity == 0.0:
            continue
        nodes = filaments.node_indices[number].tolist() if constant_forces else []
        loads = {node: constant_forces[one] for node, one in enumerate(nodes) if one in constant_forces}
        own = tethers.get(number, [])
        if filament.closed or not (loads or len(own) + len(filament.clamped) > 1):
            continue
        tension = max(_of_loads(filament, loads, own), _of_held_nodes(filament, own, temperature, known))
        if tension > 0.0:
            pulls[number] = kind, tension
    return pulls


def _of_loads(filament, loads, tethers):
    if not loads:
        return 0.0
    tension = tensions_of_loads(filament, loads, tethers)
    along = filament.positions[-1] - filament.positions[0]
    # Forces on the ends that press them together do not pull.
    lengths = np.linalg.norm(tension, axis=1)
    return float(np.max(np.where(tension @ along > -0.5 * lengths * np.linalg.norm(along), lengths, 0.0)))


def tensions_of_loads(filament: Filament, loads: Mapping[int, FloatArray], tethers: Sequence[Tether]) -> FloatArray:
    """What constant forces (3,) on nodes, by their numbers, add up to on one side of each segment: (segments, 3)."""
    count = len(filament.positions)
    forces = np.zeros((count, 3))
    for node, load in loads.items():
        forces[node] = load
    held = np.zeros(count)
    for tether in tethers:
        held[tether.node] += tether.stiffness
    stiffness = filament.type.segment_stiffnesses(filament.segments)
    fixed = list(filament.clamped)
    held[fixed] = _HELD * stiffness.max()
    if held.any():
        return stiffness[:, None] * np.diff(displacements(stiffness, held, forces), axis=0)
    friction = np.full(count, 1.0)
    friction[[0, -1]] = 0.5
    return -np.cumsum(forces - np.outer(friction / friction.sum(), forces.sum(axis=0)), axis=0)[:-1]


def _of_held_nodes(filament, tethers, temperature, known):
    # Of a wormlike chain between neighbouring nodes that are held, at the distance of what holds them.
    held = {node: (np.asarray(filament.positions[node]), 0.0) for node in filament.clamped}
    held.update({tether.node: (np.asarray(tether.point), 1.0 / tether.stiffness) for tether in tethers})
    kind, largest = filament.type, 0.0
    contour = kind.segment_length if kind.contour_per_segment is None else kind.contour_per_segment
    bending = kind.persistence_length_at(temperature) * contour / kind.segment_length
    for (first, (here, soft)), (second, (there, softer)) in pairwise(sorted(held.items(), key=lambda one: one[0])):
        if second - first == 1:
            # Nothing bends in between: a clamp is one.
            continue
        distance = float(np.linalg.norm(there - here))
        length = (second - first) * contour
        compliance = (second - first) / kind.segment_stiffness + soft + softer
        key = kind, length, round(distance, 6), compliance
        if key not in known:
            known[key] = _force_at(distance, length, compliance, bending, temperature)
        largest = max(largest, known[key])
    return largest


def _force_at(distance, length, compliance, bending, temperature):
    # Of a wormlike chain behind a spring.
    def excess(force):
        return length * marko_siggia_extension(force, bending, temperature) + force * compliance - distance

    return scipy.optimize.brentq(excess, 0.0, distance / compliance) if distance > 0.0 else 0.0
