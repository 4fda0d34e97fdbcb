"""The curves of beam elements on which crosslinks hold places: those between neighbouring nodes of a filament."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import openmm

from ..beams.curve import place_weights, slope_weights
from ..engine_choice import load_plugin
from ..mechanics.geometry import to_nearest_images
from ..units.types import BoolArray, FloatArray, IntArray


class BeamCurves:
    """Which pairs of particles are the nodes of a beam element, and where places on its curve are.

    Parameters
    ----------
    chains : sequence of ((n,) int array, (n,) int array, bool)
        The particles of the nodes of each filament of beam elements, and of their control points, and whether it is a
        ring.
    particles : int
        How many there are.
    """

    def __init__(self, chains: Sequence[tuple[IntArray, IntArray, bool]], particles: int) -> None:
        self._controls = np.full(particles, -1)
        self._next = np.full(particles, -1)
        for nodes, controls, closed in chains:
            self._controls[nodes] = controls
            self._next[nodes[:-1]] = nodes[1:]
            if closed:
                self._next[nodes[-1]] = nodes[0]

    @classmethod
    def of_system(cls, system: openmm.System) -> "BeamCurves | None":
        """Those of the CylinderChainForce of a System, or None if there are none."""
        plugin: Any = load_plugin()
        chains = []
        for force in system.getForces():
            if plugin is None or not plugin.CylinderChainForce.isinstance(force):
                continue
            own = plugin.CylinderChainForce.cast(force)
            for chain in range(own.getNumChains()):
                if own.getChainKind(chain) == own.BeamElements:
                    particles = np.array(own.getChainParticles(chain))
                    chains.append((particles[::2], particles[1::2], own.isChainClosed(chain)))
        return cls(chains, system.getNumParticles()) if chains else None

    def on_curve(self, first: IntArray, second: IntArray) -> BoolArray:
        """Which pairs of particles, -1 for none, are the two nodes of an element, in either order: (n,)."""
        both = (first >= 0) & (second >= 0)
        return both & ((self._next[first] == second) | (self._next[second] == first))

    def places(
        self,
        first: IntArray,
        second: IntArray,
        fractions: FloatArray,
        positions: FloatArray,
        box: FloatArray | None = None,
    ) -> FloatArray:
        """Where places on curves are, by the fraction from the first node of each to the second: (n, 3) in nm.

        Parameters
        ----------
        first, second : (n,) int arrays
            Nodes for which ``on_curve`` is true.
        fractions : (n,) array
        positions : (particles, 3) array
        box : (3, 3) array, optional
            Of which to take the nearest images of neighbouring particles.
        """
        weights, vectors, chord, turned = self._on_elements(place_weights, first, second, fractions, positions, box)
        moved = sum(weight[:, None] * vector for weight, vector in zip(weights.T[1:], vectors))
        # With a box, places are near the first of the two nodes that are given.
        return positions[first] + moved - np.where(turned[:, None], chord, 0.0)

    def tangents(
        self,
        first: IntArray,
        second: IntArray,
        fractions: FloatArray,
        positions: FloatArray,
        box: FloatArray | None = None,
    ) -> FloatArray:
        """Unit vectors (n, 3) along curves at ``places``, from the first node of each towards the second."""
        weights, vectors, _, turned = self._on_elements(slope_weights, first, second, fractions, positions, box)
        slopes = sum(weight[:, None] * vector for weight, vector in zip(weights.T[1:], vectors))
        return np.where(turned, -1.0, 1.0)[:, None] * slopes / np.linalg.norm(slopes, axis=1, keepdims=True)

    def _on_elements(self, weights_of, first, second, fractions, positions, box):
        # Weights (n, 4), the vectors that the last three belong to, chords, and which were given from the second node.
        turned = self._next[first] != second
        minus, plus = np.where(turned, second, first), np.where(turned, first, second)
        weights = weights_of(np.where(turned, 1.0 - fractions, fractions))

        def between(start, end):
            vectors = positions[end] - positions[start]
            return vectors if box is None else to_nearest_images(vectors, box)

        chord = between(minus, plus)
        vectors = between(minus, self._controls[minus]), chord, between(plus, self._controls[plus])
        return weights, vectors, chord, turned
