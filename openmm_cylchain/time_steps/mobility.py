"""How far an explicit force moves a filament in one step: the response that limits the stiffness of such forces.

In one step of length h a straight filament takes with linear forces and the friction Z of its nodes

    Z (y - x)/h + K (theta y + (1 - theta) x) = f(x) + noise,

where K are its own stiffnesses, which scheme "implicit" weighs with theta = max(1/2, 1 - 1/z), z being the step over
the relaxation time of the fastest mode (``plugin_src/IMPLICIT_SCHEME.md``). With A = Z/h + (theta - 1/2) K this is

    A (y - x) + K (x + y)/2 = f(x) + noise of the covariance 2 k_B T A,

which keeps the covariance k_B T K^-1 exactly. An explicit force f = -S x takes S/2 from A, but leaves the noise. So
with the largest eigenvalue lambda of A^-1 S no variance is too large by more than the factor 1/(1 - lambda/2), and the
filament is thrown apart from lambda = 2 on. A^-1 is the response: in short steps h times the mobility of a segment, in
long ones that of as much filament as a force moves within the step. In an explicit scheme A = Z/h.

A mode of the rate z/h thus responds with h/(1 + (theta - 1/2) z). Any scheme that multiplies it by R(z) in a step and
keeps its equilibrium and that under a constant force does so with h 2 (1 - R)/(z (1 + R)), by the same argument; for
scheme "implicit-second-order", R is ``schemes.amplification_of_second_order``.
"""

from abc import ABC, abstractmethod
from collections.abc import Iterator
from typing import Any

import numpy as np
import scipy

from ..filaments.filament import Filament
from ..mechanics.friction import SegmentFriction
from ..units.types import FloatArray, IntArray
from .schemes import IMPLICIT_SCHEMES, amplification_of_second_order

_LONGEST_PIECE = 128


class PlaceResponse(ABC):
    """The response of places on a filament, or on a piece of one, to explicit forces in a step."""

    _piece: int

    def piece_of(self, segment: int) -> int:
        """The piece that a segment belongs to."""
        return int(segment) // self._piece

    def largest_eigenvalue(
        self, piece: int, segments: IntArray, fractions: FloatArray, stiffness: FloatArray, step: float
    ) -> float:
        """lambda, the largest eigenvalue of A^-1 S for springs at places of a piece, in the worst direction.

        Parameters
        ----------
        segments, fractions : (places,) arrays
            The places: at ``fraction`` from the first to the second end of a segment, or of the curve of an element.
        stiffness : (places,) array
            Of a spring from each place to a fixed point, in kJ/(mol nm^2).
        step : float
            In ps.
        """
        root = np.sqrt(stiffness)[:, None]
        largest = 0.0
        for factor in self._factors(piece, segments, fractions, step):
            scaled = root * factor
            gram = scaled @ scaled.T if scaled.shape[0] <= scaled.shape[1] else scaled.T @ scaled
            largest = max(largest, float(scipy.linalg.eigvalsh(gram, subset_by_index=[len(gram) - 1] * 2)[0]))
        return largest

    def at(self, piece: int, segments: IntArray, fractions: FloatArray, step: float) -> FloatArray:
        """The response of each place to a force on it, in the worst direction: an array in nm^2 mol/kJ."""
        return np.max([np.sum(one**2, axis=1) for one in self._factors(piece, segments, fractions, step)], axis=0)

    @abstractmethod
    def _factors(self, piece: int, segments: IntArray, fractions: FloatArray, step: float) -> Iterator[FloatArray]:
        """Yield, across and along the filament, F (places, unknowns) so that F F^T is the response between places."""


class FilamentResponse(PlaceResponse):
    """The response of one filament of straight segments, taken as straight, to explicit forces in a step.

    Clamped nodes stay. Tethers are left out, and filaments of more than 128 segments are cut into pieces: both make it
    more mobile than it is.
    """

    def __init__(self, filament: Filament, friction: SegmentFriction, scheme: str) -> None:
        self.segments = filament.segments
        self._filament = filament
        self._friction = friction
        self._scheme = scheme
        whole_ring = filament.closed and self.segments <= _LONGEST_PIECE
        self._closed = whole_ring
        self._piece = self.segments if whole_ring else min(self.segments, _LONGEST_PIECE)
        self._pieces: dict[int, list[Any]] = {}

    def _factors(self, piece, segments, fractions, step):
        if piece not in self._pieces:
            self._pieces[piece] = list(self._modes(piece))
        minus = np.asarray(segments) - piece * self._piece
        fractions = np.asarray(fractions)[:, None]
        for direction, (modes, rates, fastest) in enumerate(self._pieces[piece]):
            plus = (minus + 1) % len(modes)
            shapes = (1.0 - fractions) * modes[minus] + fractions * modes[plus]
            yield shapes * np.sqrt(self._responses(direction == 0, rates, fastest, step))

    def _responses(self, across, rates, fastest, step):
        if self._scheme == "implicit-second-order" and across:
            # Lengths are those of scheme "implicit".
            z = np.maximum(step * rates, 1e-9)
            factor = amplification_of_second_order(z)
            return step * 2.0 * (1.0 - factor) / (z * (1.0 + factor))
        implicit = self._scheme in IMPLICIT_SCHEMES and fastest > 0.0
        excess = max(0.0, 0.5 - 1.0 / (step * fastest)) if implicit else 0.0
        return step / (1.0 + step * excess * rates)

    def _modes(self, piece):
        first = piece * self._piece
        count = min(self._piece, self.segments - first)
        nodes = count if self._closed else count + 1
        fixed = np.zeros(nodes, dtype=bool)
        for node in self._filament.clamped:
            local = node - first
            if 0 <= local < nodes:
                fixed[local] = True
        kind, friction = self._filament.type, self._friction
        length = kind.segment_length
        bend = kind.joint_stiffness / length**2
        # The differences of nodes that a length and a bend are, straight.
        lengths = self._differences(nodes, [-1.0, 1.0])
        bends = self._differences(nodes, [1.0, -2.0, 1.0]) if nodes > 2 else np.zeros((0, nodes))
        middles = self._differences(nodes, [0.5, 0.5])
        for across, turning, stiffness, fastest in (
            (friction.perpendicular, friction.rotational, bend * bends.T @ bends, 4.0 * bend / friction.rotational),
            (
                friction.parallel,
                friction.extensional,
                kind.segment_stiffness * lengths.T @ lengths,
                kind.segment_stiffness / friction.extensional,
            ),
        ):
            resistance = across * middles.T @ middles + turning / length**2 * lengths.T @ lengths
            yield self._eigenmodes(stiffness, resistance, fixed, fastest * length**2)

    def _differences(self, nodes, weights):
        rows = np.zeros((nodes if self._closed else nodes - len(weights) + 1, nodes))
        for offset, weight in enumerate(weights):
            rows[np.arange(len(rows)), (np.arange(len(rows)) + offset) % nodes] = weight
        return rows

    def _eigenmodes(self, stiffness, resistance, fixed, fastest):
        free = np.flatnonzero(~fixed)
        modes = np.zeros((len(fixed), len(free)))
        if not len(free):
            return modes, np.zeros(0), fastest
        rates, modes[free] = scipy.linalg.eigh(stiffness[np.ix_(free, free)], resistance[np.ix_(free, free)])
        rates = np.maximum(rates, 0.0)
        if self._closed:
            # A ring can turn; an endless straight filament, whose modes these are, cannot.
            rates[:3] = 0.0
        return modes, rates, fastest
