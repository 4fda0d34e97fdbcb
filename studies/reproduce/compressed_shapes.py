"""Shapes of compressed filaments: the measures of Simularium's comparison, and the elastica between held ends.

The measures are those of simularium/subcell-pipeline, ``analysis/compression_metrics``, on points along a filament; all
take arrays of them (..., points, 3) and return one number for each. What is compressed lies along x.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.special import ellipe, ellipj, ellipk, elliprd, elliprf

_ZERO = 1e-6
"""In nm; vectors that are shorter have no direction."""


def axis_distances(points):
    """Distances of points from the line through both ends, and their places along it, from 0 to 1 at the ends.

    Returns
    -------
    (distances, places) : arrays (..., points)
    """
    vectors = points - points[..., :1, :]
    axis = vectors[..., -1:, :]
    places = np.sum(vectors * axis, axis=-1) / np.sum(axis**2, axis=-1)
    return np.linalg.norm(vectors - places[..., None] * axis, axis=-1), places


def average_distance(points):
    """The mean of the distances from the line through both ends (``average_perp_distance``), in nm."""
    return axis_distances(points)[0].mean(axis=-1)


def peak_asymmetry(points):
    """How far the point that is farthest from the line through both ends is from its middle: |place - 1/2|."""
    distances, places = axis_distances(points)
    peak = np.argmax(distances, axis=-1)[..., None]
    asymmetry = np.abs(np.take_along_axis(places, peak, axis=-1)[..., 0] - 0.5)
    return np.where(np.max(distances, axis=-1) < _ZERO, 0.0, asymmetry)


def non_coplanarity(points):
    """The smallest variance of the points along a principal axis, as a share of all three: 0 in a plane."""
    variances = np.linalg.svd(points - points.mean(axis=-2, keepdims=True), compute_uv=False) ** 2
    return variances[..., -1] / np.sum(variances, axis=-1)


def mean_bend(points):
    """The mean of 1 - cos(angle) from each piece between points to the next (``calc_bending_energy``, in pN nm)."""
    tangents = _directions(points)
    return 1.0 - np.mean(np.sum(tangents[..., 1:, :] * tangents[..., :-1, :], axis=-1), axis=-1)


def contour_length(points):
    """The sum of the distances from point to point, in nm."""
    return np.sum(np.linalg.norm(np.diff(points, axis=-2), axis=-1), axis=-1)


def compression_ratio(points):
    """1 - R/L with the distance of the ends R and the contour length L."""
    return 1.0 - np.linalg.norm(points[..., -1, :] - points[..., 0, :], axis=-1) / contour_length(points)


def total_twist(points):
    """The sum of the angles from each binormal to the next, over the contour length (``total_fiber_twist``), in 1/nm.

    A binormal is the vector product of the directions of a piece and of the next. Pieces that go straight on have none.
    """
    tangents = _directions(points)
    binormals = np.cross(tangents[..., :-1, :], tangents[..., 1:, :])
    flat = np.all(np.linalg.norm(binormals, axis=-1) < _ZERO, axis=-1)
    binormals = _scaled(binormals)
    angles = np.arccos(np.clip(np.sum(binormals[..., 1:, :] * binormals[..., :-1, :], axis=-1), -1.0, 1.0))
    return np.where(flat, 0.0, np.sum(angles, axis=-1) / contour_length(points))


def twist_angle(points):
    """The angle seen along x from the first piece to the last one turned round, in degrees.

    Its sign is positive where more pieces turn to the left, as seen along x, than to the right: a half-turn of a
    left-handed helix and of a right-handed one have opposite signs.
    """
    pieces = np.diff(points[..., 1:], axis=-2)
    lengths = np.linalg.norm(pieces, axis=-1, keepdims=True)
    pieces = np.divide(pieces, lengths, out=np.zeros_like(pieces), where=lengths >= _ZERO)
    turns = pieces[..., :-1, 0] * pieces[..., 1:, 1] - pieces[..., :-1, 1] * pieces[..., 1:, 0]
    angle = np.arccos(np.clip(-np.sum(pieces[..., 0, :] * pieces[..., -1, :], axis=-1), -1.0, 1.0))
    return np.sign(np.sum(np.sign(turns), axis=-1)) * np.degrees(angle)


MEASURES = {
    "non_coplanarity": non_coplanarity,
    "peak_asymmetry": peak_asymmetry,
    "average_perp_distance": average_distance,
    "calc_bending_energy": mean_bend,
    "contour_length": contour_length,
    "compression_ratio": compression_ratio,
    "total_fiber_twist": total_twist,
    "twist_angle": twist_angle,
}
"""By the columns of their table."""


def bending_energy(points, rigidity):
    """(rigidity/h) sum(1 - cos(angle)) over the joints of pieces of the length h = L/pieces: of a smooth filament, the
    integral of (rigidity/2) curvature^2."""
    pieces = points.shape[-2] - 1
    return rigidity * pieces / contour_length(points) * (pieces - 1) * mean_bend(points)


@dataclass(frozen=True)
class HeldElastica:
    """Euler's elastica between two ends that are held straight and moved towards each other along their line.

    Its tangent makes the angle theta with the line, sin(theta/2) = k sn(4 K(k) s/l), over the free length l, with the
    modulus k for which the distance of the ends of it is l (2 E(k)/K(k) - 1); K and E are complete elliptic integrals
    (Love, A Treatise on the Mathematical Theory of Elasticity, sections 262 and 263: four of his arcs).

    Attributes
    ----------
    length : float
        Of the filament, in nm.
    held : float
        Length at each end that is straight.
    rigidity : float
        In pN nm^2.
    shortening : float
        By how much the ends are closer than the length.
    """

    length: float
    held: float
    rigidity: float
    shortening: float

    @property
    def free_length(self):
        """What bends."""
        return self.length - 2.0 * self.held

    @cached_property
    def parameter(self):
        """k^2, the squared sine of half the largest angle."""
        lower, upper = 0.0, 0.9
        ratio = 1.0 - self.shortening / self.free_length
        for _ in range(60):
            middle = 0.5 * (lower + upper)
            lower, upper = (middle, upper) if 2.0 * ellipe(middle) / ellipk(middle) - 1.0 > ratio else (lower, middle)
        return 0.5 * (lower + upper)

    @property
    def load(self):
        """(4 K)^2 rigidity/l^2 in pN; 4 pi^2 rigidity/l^2, Euler's, at first."""
        return (4.0 * ellipk(self.parameter)) ** 2 * self.rigidity / self.free_length**2

    @property
    def energy(self):
        """The integral of (rigidity/2) curvature^2, load (r - l cos(largest angle)), r the distance of the ends of what
        bends, in pN nm."""
        distance = self.free_length - self.shortening
        return self.load * (distance - self.free_length * (1.0 - 2.0 * self.parameter))

    @property
    def height(self):
        """The largest distance from the line, k l/K(k), in nm."""
        return np.sqrt(self.parameter) * self.free_length / ellipk(self.parameter)

    def average_distance(self, points):
        """The measure ``average_distance`` of so many evenly spaced points of it, both ends included, in nm."""
        return float(np.mean(self.shape(np.linspace(0.0, self.length, points))[:, 1]))

    def shape(self, arc_lengths):
        """Points (n, 2) in nm at lengths along the filament, whose ends are at the height 0."""
        modulus = self.parameter
        quarter = 4.0 * ellipk(modulus) / self.free_length
        free = np.clip(arc_lengths - self.held, 0.0, self.free_length)
        sine, cosine, delta, _ = ellipj(quarter * free, modulus)
        heights = 2.0 * np.sqrt(modulus) / quarter * (1.0 - cosine)
        # E(am u, k) by Carlson's integrals on a half period, DLMF 19.25.9, of which there is a number before.
        halves = np.round(quarter * free / (2.0 * ellipk(modulus)))
        sine = (-1.0) ** halves * sine
        squares = cosine**2, delta**2, 1.0
        own = sine * elliprf(*squares) - modulus / 3.0 * sine**3 * elliprd(*squares)
        along = 2.0 * (own + 2.0 * halves * ellipe(modulus)) / quarter - free
        return np.stack([along + arc_lengths - free, heights], axis=-1)


def _directions(points):
    return _scaled(np.diff(points, axis=-2))


def _scaled(vectors):
    lengths = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return vectors / np.where(lengths > 0.0, lengths, 1.0)
