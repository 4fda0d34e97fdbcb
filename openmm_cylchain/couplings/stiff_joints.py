"""Joints of filaments that are not linked where they are joined: how stiff one may be for long steps to be right."""

import warnings
from typing import Any

import numpy as np
import openmm
import scipy

from ..engine_choice import load_plugin
from ..errors import JointWarning
from ..filaments.collection import FilamentCollection
from ..units.types import FloatArray, IntArray
from .native_links import is_link_force, table_of_force

LARGEST_STIFFNESS = 20.0
"""Of a joint over EI/h of an element, up to which energies and bends are right at the recommended step within 1.3 %."""
_SAME_PLACE = 1e-3
_NONE, _NOWHERE = np.zeros((0, 4)), np.full(4, -2.0)


def warn_of_stiff_joints(system: openmm.System, filaments: FilamentCollection) -> None:
    """Warn (JointWarning) of joints so stiff that bends beside them fluctuate too little.

    At the recommended step, a joint of 100 EI/h has 2.6 % too much energy, and elements beside it 2.7 % too little in
    their bends, of 500 EI/h 5.6 %, half as much in a fourth of that step: measured, see docs/design/beam_elements.md.
    Where a crosslink without rest length holds the same two places together, they are right.
    """
    plugin: Any = load_plugin()
    forces = [plugin.CylinderChainLinkForce.cast(force) for force in system.getForces() if is_link_force(force)]
    if not any(force.getJoinsTangents() for force in forces) or filaments.temperature == 0.0:
        return
    places = _PlacesOnFilaments(system.getNumParticles(), filaments)
    tables = [(force.getJoinsTangents(), table_of_force(force)) for force in forces]
    linked = np.concatenate(
        [places.of(table)[_holds_together(table)] for joins, table in tables if not joins] or [_NONE]
    )
    # In either order.
    linked = np.concatenate([linked, linked[:, [2, 3, 0, 1]], [_NOWHERE]])
    stiffest: tuple[float, int, int, int] = LARGEST_STIFFNESS, 0, 0, 0
    for joins, table in tables:
        if not joins:
            continue
        own = places.of(table)
        joined = table.active & np.all(own[:, ::2] >= 0, axis=1)
        rigidities = places.rigidities[own[:, ::2].astype(int)].min(axis=1)
        # Of the angle: its energy is that of the difference of unit vectors, see Joints.add().
        ratios = np.where(joined, table.stiffness * (1.0 - 0.25 * table.rest_length**2) / rigidities, 0.0)
        stiff = np.flatnonzero(ratios > LARGEST_STIFFNESS)
        away, _ = scipy.spatial.cKDTree(linked).query(own[stiff], p=np.inf)
        for row in stiff[away > _SAME_PLACE]:
            first, second = own[row, ::2].astype(int)
            stiffest = max(stiffest, (ratios[row], int(table.numbers[row]), first, second))
    if stiffest[0] > LARGEST_STIFFNESS:
        ratio, number, first, second = stiffest
        warnings.warn(
            f"Joint {number} between filaments {first} and {second}, which are not linked there, is {ratio:.3g} times "
            "as stiff as an element is against bending (EI/h): at the recommended step, bends beside it fluctuate by "
            f"up to 6 % too little. Take a joint of at most {LARGEST_STIFFNESS:g} EI/h; or link the two places with "
            "Crosslinks(rest_length=0), if they are one.",
            JointWarning,
            stacklevel=4,
        )


class _PlacesOnFilaments:
    """Where places are on filaments of beam elements: the number of the filament, and elements from its first node."""

    def __init__(self, particles: int, filaments: FilamentCollection) -> None:
        self._filament: IntArray = np.full(particles, -1)
        self._node: IntArray = np.zeros(particles, dtype=int)
        self._elements = np.array([filament.segments if filament.closed else np.inf for filament in filaments])
        rigidities = []
        for number, filament in enumerate(filaments):
            nodes = filaments.node_indices[number]
            self._filament[nodes], self._node[nodes] = number, np.arange(len(nodes))
            rigidities.append(filament.type.segment_kind.bend_stiffness(filament.type, filaments.temperature))
        self.rigidities = np.array(rigidities)

    def of(self, table: Any) -> FloatArray:
        """(filament, elements) of both places of each link: (n, 4); -1 for a filament where there is none."""
        found = np.full((len(table), 4), -1.0)
        pairs, partners, fractions = table.places.pairs, table.places.partners, table.places.fractions
        for side in (0, 1):
            first, second = pairs[:, side], partners[:, side]
            there = first >= 0
            node = np.where(there, self._node[first], 0)
            step = np.where(there & (second >= 0), self._node[second] - node, 0)
            # Across the end of a ring.
            step = np.where(np.abs(step) > 1, -np.sign(step), step)
            found[:, 2 * side] = np.where(there, self._filament[first], -1)
            along = node + step * fractions[:, side]
            # The end of a ring is its beginning.
            around = self._elements[self._filament[first]]
            found[:, 2 * side + 1] = np.where(along > around - 0.5 * _SAME_PLACE, along - around, along)
        return found


def _holds_together(table):
    return table.active & (table.rest_length == 0.0)
