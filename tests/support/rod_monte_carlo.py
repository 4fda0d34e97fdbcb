"""Rods of one segment in equilibrium by Monte Carlo, without the package: numpy alone.

Lengths are in nm and energies in k_B T, so a stiffness is in 1/nm^2. Configurations are the middles of rods and the
vectors along them, two arrays (copies, rods, 3).
"""

from dataclasses import dataclass, replace

import numpy as np

# Rods with a lesser sin^2 of their angle touch at both ends of their overlap, with half the stiffness each.
LARGEST_PARALLEL = 1e-3


@dataclass(frozen=True)
class Link:
    """The energy ``stiffness/2 (d - rest_length)^2`` of two places: (rod, fraction of its length)."""

    first: tuple
    second: tuple
    stiffness: float
    rest_length: float


@dataclass(frozen=True)
class RodSystem:
    """What rods there are, and what acts between them.

    ``diameter`` and ``contact`` are the distance at which rods touch and the stiffness of contacts, ``height`` and
    ``wall`` the distance of two walls at z = 0 and z = height, and their stiffness. ``box`` has the lengths of a
    periodic box, and is as wide as twice a rod with its diameter. Rods of planar systems are in the plane z = 0.
    """

    rods: int
    length: float
    stretching: float
    diameter: float = 0.0
    contact: float = 0.0
    links: tuple = ()
    height: float = 0.0
    wall: float = 0.0
    box: tuple | None = None
    planar: bool = False

    def without_contacts(self):
        return replace(self, contact=0.0)

    def nearest_image(self, vectors):
        if self.box is None:
            return vectors
        box = np.array(self.box)
        return vectors - box * np.round(vectors / box)

    def contact_distances(self, middles, along, others, others_along):
        """See ``contact_distances``."""
        return contact_distances(self.nearest_image(middles - others), along, others_along)

    def contact_energies(self, distances, parallel):
        """Of pairs, from what ``contact_distances`` returns."""
        overlaps = np.maximum(self.diameter - distances, 0.0)
        squares = np.where(parallel, 0.5 * (overlaps[1] ** 2 + overlaps[2] ** 2), overlaps[0] ** 2)
        return 0.5 * self.contact * squares

    def depths(self, middles, along):
        """By how much the two ends of rods are beyond a wall: an array (2, ...)."""
        z = middles[..., 2] + np.multiply.outer([-0.5, 0.5], along[..., 2])
        return np.maximum(np.maximum(-z, z - self.height), 0.0)

    def wall_energies(self, middles, along):
        """Of each rod."""
        return 0.5 * self.wall * (self.depths(middles, along) ** 2).sum(axis=0)

    def link_lengths(self, middles, along):
        """An array (copies, links)."""
        lengths = np.empty((len(middles), len(self.links)))
        for number, link in enumerate(self.links):
            first, second = (middles[:, i] + (f - 0.5) * along[:, i] for i, f in (link.first, link.second))
            lengths[:, number] = np.linalg.norm(self.nearest_image(first - second), axis=-1)
        return lengths

    def link_energies(self, middles, along):
        """An array (copies, links)."""
        stiffness, rest = np.array([(link.stiffness, link.rest_length) for link in self.links]).reshape(-1, 2).T
        return 0.5 * stiffness * (self.link_lengths(middles, along) - rest) ** 2

    def pairs(self, middles, along):
        """Distances (3, copies, pairs) and parallel (copies, pairs) of all pairs, see ``contact_distances``."""
        i, j = np.triu_indices(self.rods, 1)
        return self.contact_distances(middles[:, i], along[:, i], middles[:, j], along[:, j])


def contact_distances(between, p, q):
    """Of rods along p and q whose middles differ by ``between``, which is from the second to the first.

    Returns
    -------
    distances : (3, ...) array
        The least distance, and for those that are parallel the distances at both ends of their overlap.
    parallel : (...) array of bool
    """
    w = between - 0.5 * p + 0.5 * q
    a, b, c, e, f, g = (np.einsum("...i,...i->...", x, y) for x, y in ((p, p), (p, q), (p, w), (q, q), (q, w), (w, w)))

    def square(s, t):
        return g + s * (a * s + 2.0 * (c - b * t)) + t * (e * t - 2.0 * f)

    # Of an end of one from the other, or of the lines, where they are nearest to each other within both.
    least = square(0.0, np.clip(f / e, 0.0, 1.0))
    np.minimum(least, square(1.0, np.clip((b + f) / e, 0.0, 1.0)), out=least)
    np.minimum(least, square(np.clip(-c / a, 0.0, 1.0), 0.0), out=least)
    np.minimum(least, square(np.clip((b - c) / a, 0.0, 1.0), 1.0), out=least)
    determinant = a * e - b * b
    s, t = b * f - c * e, a * f - b * c
    within = (s > 0.0) & (s < determinant) & (t > 0.0) & (t < determinant)
    divisor = np.where(within, determinant, 1.0)
    least = np.where(within, square(s / divisor, t / divisor), least)
    # Of lines that cross: what is left of rounding.
    least[least < 1e-9] = 0.0
    distances = np.zeros((3, *least.shape))
    distances[0] = np.sqrt(np.maximum(least, 0.0))
    parallel = determinant < LARGEST_PARALLEL * a * e
    if parallel.any():
        a, b, c, e, f, g = (np.broadcast_to(value, parallel.shape)[parallel] for value in (a, b, c, e, f, g))
        ends = np.sort([-c / a, (b - c) / a], axis=0)
        lower, upper = np.maximum(ends[0], 0.0), np.minimum(ends[1], 1.0)
        for number, s in enumerate((lower, upper), 1):
            # At an end of the second rod, or at the place of it that is nearest to an end of the first.
            t = np.clip((b * s + f) / e, 0.0, 1.0)
            t = np.where(s == -c / a, 0.0, np.where(s == (b - c) / a, 1.0, t))
            distances[number, parallel] = np.sqrt(np.maximum(square(s, t), 0.0))
        parallel[parallel] = upper > lower
    return distances, parallel


def length_distribution(rest_length, stiffness, dimensions=3):
    """Cumulative shares and lengths, for ``numpy.interp``: of free springs with the density l^(d-1) exp(-V)."""
    width = 1.0 / np.sqrt(stiffness)
    edges = np.linspace(max(rest_length - 9 * width, 0.0), rest_length + 9 * width, 20001)
    lengths = 0.5 * (edges[1:] + edges[:-1])
    density = lengths ** (dimensions - 1) * np.exp(-0.5 * stiffness * (lengths - rest_length) ** 2)
    return np.concatenate([[0.0], np.cumsum(density) / density.sum()]), edges


class RodMonteCarlo:
    """Metropolis moves of copies of a RodSystem: a rod moves, turns and gets a new length."""

    LARGEST_MOVE, LARGEST_TURN = 60.0, 1.0

    def __init__(self, system, middles, along, seed):
        self.system, self.generator = system, np.random.default_rng(seed)
        self.middles, self.along = np.array(middles, dtype=float), np.array(along, dtype=float)
        self.accepted = 0.0
        self._dimensions = 2 if system.planar else 3
        self._distribution = length_distribution(system.length, system.stretching, self._dimensions)
        self._longest = max(self._distribution[1][-1], np.linalg.norm(self.along, axis=-1).max())

    def _random_vectors(self):
        vectors = self.generator.normal(size=(len(self.middles), 3))
        vectors[:, self._dimensions :] = 0.0
        return vectors

    def _energies(self, rod, middle, along):
        """Of all that acts on one rod of each copy, (copies,)."""
        system = self.system
        energies = np.zeros(len(middle))
        if system.contact:
            between = system.nearest_image(middle[:, None] - self.middles)
            reach = 0.5 * (self._longest + np.linalg.norm(along, axis=1)) + system.diameter
            near = np.einsum("crk,crk->cr", between, between) < reach[:, None] ** 2
            near[:, rod] = False
            copy, other = np.nonzero(near)
            distances = contact_distances(between[copy, other], along[copy], self.along[copy, other])
            energies += np.bincount(copy, system.contact_energies(*distances), minlength=len(middle))
        if system.wall:
            energies += system.wall_energies(middle, along)
        if system.links:
            middles, all_along = self.middles.copy(), self.along.copy()
            middles[:, rod], all_along[:, rod] = middle, along
            energies += system.link_energies(middles, all_along).sum(axis=1)
        return energies

    def sweep(self, sweeps=1):
        """As many moves as there are rods, so many times."""
        generator, copies = self.generator, len(self.middles)
        for _ in range(sweeps * self.system.rods):
            rod = generator.integers(self.system.rods)
            middle, along = self.middles[:, rod], self.along[:, rod]
            scale = 10.0 ** generator.uniform(-1.5, 0.0, size=(copies, 1))
            new_middle = middle + self.LARGEST_MOVE * scale * self._random_vectors()
            new_along = along / np.linalg.norm(along, axis=1)[:, None]
            new_along = new_along + self.LARGEST_TURN * scale * self._random_vectors()
            # Lengths as they are of a free rod: stretching needs no further weight.
            lengths = np.interp(generator.random(copies), *self._distribution)
            new_along *= (lengths / np.linalg.norm(new_along, axis=1))[:, None]
            change = self._energies(rod, new_middle, new_along) - self._energies(rod, middle, along)
            taken = np.log(generator.random(copies)) < -change
            self.middles[taken, rod], self.along[taken, rod] = new_middle[taken], new_along[taken]
            self.accepted += taken.mean()

    def means(self, observe, samples, interval):
        """Means (copies, observables) over samples of what ``observe(system, middles, along)`` returns."""
        total = 0.0
        for _ in range(samples):
            self.sweep(interval)
            total = total + observe(self.system, self.middles, self.along)
        return total / samples


def random_rods(system, copies, seed):
    """Middles and along of rods at random, which may overlap, in the box, between the walls or near each other."""
    generator = np.random.default_rng(seed)
    shape = (copies, system.rods, 3)
    room = np.array(system.box if system.box is not None else [system.length] * 3, dtype=float)
    if system.wall:
        room[2] = system.height
    middles, along = room * generator.random(shape), generator.normal(size=shape)
    if system.planar:
        middles[..., 2] = along[..., 2] = 0.0
    if system.wall:
        along[..., 2] = 0.0
    return middles, along * (system.length / np.linalg.norm(along, axis=-1)[..., None])


def linked_pair(system, copies, seed):
    """Middles, along and weights (copies,) of two rods with one link between their middles, drawn one by one.

    Weights are those of contacts.
    """
    (link,) = system.links
    assert system.rods == 2 and link.first[1] == link.second[1] == 0.5
    generator = np.random.default_rng(seed)
    along = generator.normal(size=(copies, 2, 3))
    lengths = np.interp(generator.random((copies, 2)), *length_distribution(system.length, system.stretching))
    along *= (lengths / np.linalg.norm(along, axis=-1))[..., None]
    between = generator.normal(size=(copies, 3))
    distance = np.interp(generator.random(copies), *length_distribution(link.rest_length, link.stiffness))
    between *= (distance / np.linalg.norm(between, axis=-1))[:, None]
    middles = np.stack([0.5 * between, -0.5 * between], axis=1)
    return middles, along, np.exp(-system.contact_energies(*system.pairs(middles, along)).sum(axis=1))
