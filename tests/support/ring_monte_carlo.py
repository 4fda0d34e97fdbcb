"""Rings with contacts of themselves in equilibrium by Monte Carlo, without the package: numpy alone.

Lengths are in nm and energies in k_B T. Configurations are arrays (copies, nodes, 3). Rings pass through themselves as
they move, and what they are found in is weighed with their contacts.
"""

from dataclasses import dataclass

import numpy as np

from support.rod_monte_carlo import contact_distances

# Of segments that are no neighbours, in nm.
DISTANCES = np.array([0.0, 10.0, 12.0])


@dataclass(frozen=True)
class Ring:
    """Segments with the energies 2 joint (1 - c)/(1 + c) of bends and (stretching/2) (l - length)^2.

    Those whose numbers differ by more than ``excluded`` touch each other at ``diameter``, with ``contact`` in 1/nm^2.
    """

    segments: int
    length: float
    joint: float
    stretching: float
    diameter: float
    contact: float
    excluded: int

    def energies(self, nodes):
        """Of bends and of lengths, (copies, segments) each."""
        along = np.roll(nodes, -1, axis=1) - nodes
        lengths = np.sqrt(np.einsum("cnk,cnk->cn", along, along))
        cosines = np.einsum("cnk,cnk->cn", along, np.roll(along, 1, axis=1)) / (lengths * np.roll(lengths, 1, axis=1))
        bends = 2.0 * self.joint * (1.0 - cosines) / (1.0 + cosines)
        return bends, 0.5 * self.stretching * (lengths - self.length) ** 2

    def pairs(self, nodes):
        """First and second segments (pairs,), and what ``contact_distances`` has of them."""
        first, second = np.triu_indices(self.segments, 1)
        apart = np.minimum(second - first, self.segments - second + first)
        first, second = first[apart > self.excluded], second[apart > self.excluded]
        along = np.roll(nodes, -1, axis=1) - nodes
        middles = nodes + 0.5 * along
        between = middles[:, first] - middles[:, second]
        return first, second, *contact_distances(between, along[:, first], along[:, second])

    def contact_energies(self, nodes):
        """(copies,). A segment touches another one where no neighbour of either is nearer: joints count once."""
        first, second, distances, parallel = self.pairs(nodes)
        apart = np.full((len(nodes), nodes.shape[1], nodes.shape[1]), np.inf)
        apart[:, first, second] = apart[:, second, first] = distances[0]
        nearest = np.full(apart.shape, True)
        for axis in (1, 2):
            # Of two that are as near as each other, at their joint, the first one counts.
            nearest &= apart < np.roll(apart, 1, axis) - 1e-9
            nearest &= apart <= np.roll(apart, -1, axis) + 1e-9
        overlaps = np.maximum(self.diameter - distances, 0.0)
        one = np.where(nearest[:, first, second], overlaps[0] ** 2, 0.0)
        squares = np.where(parallel, 0.5 * (overlaps[1] ** 2 + overlaps[2] ** 2), one)
        return 0.5 * self.contact * squares.sum(axis=1)

    def observe(self, nodes):
        """Energies of contacts and of bends, and numbers of pairs of segments by DISTANCES: an array (copies, 4)."""
        least = self.pairs(nodes)[2][0]
        within = np.array([np.sum(least < edge, axis=1) for edge in DISTANCES])
        bends = self.energies(nodes)[0].sum(axis=1)
        return np.column_stack([self.contact_energies(nodes), bends, *np.diff(within, axis=0)])


class RingMonteCarlo:
    """Metropolis moves of copies of a Ring without its contacts: parts of it turn, and nodes move."""

    largest_turn = 10.0**0.5

    def __init__(self, ring, nodes, seed):
        self.ring, self.nodes = ring, np.array(nodes, dtype=float)
        self._generator = np.random.default_rng(seed)
        self._energies = self._energies_of(self.nodes)

    def _energies_of(self, nodes):
        bends, lengths = self.ring.energies(nodes)
        return bends.sum(axis=1) + lengths.sum(axis=1)

    def sweep(self, sweeps=1):
        """Two moves of each copy, so many times: a part turns about the line between its ends, and a node moves."""
        for _ in range(sweeps):
            for move in (self._turn, self._shift):
                moved = move()
                energies = self._energies_of(moved)
                taken = np.log(self._generator.random(len(energies))) < self._energies - energies
                self.nodes[taken], self._energies[taken] = moved[taken], energies[taken]

    def _turn(self):
        generator, segments, copies = self._generator, self.ring.segments, len(self.nodes)
        first, count = generator.integers(segments), generator.integers(1, segments - 1)
        turned = (first + 1 + np.arange(count)) % segments
        start = self.nodes[:, first, None]
        axis = self.nodes[:, (first + count + 1) % segments, None] - start
        axis /= np.linalg.norm(axis, axis=2)[..., None]
        angle = self.largest_turn * 10.0 ** generator.uniform(-1.5, 0.0, copies) * generator.normal(size=copies)
        angle = angle[:, None, None]
        out = self.nodes[:, turned] - start
        parallel = axis * (out * axis).sum(axis=2)[..., None]
        moved = self.nodes.copy()
        moved[:, turned] = start + parallel + (out - parallel) * np.cos(angle) + np.cross(axis, out) * np.sin(angle)
        return moved

    def _shift(self):
        generator, copies = self._generator, len(self.nodes)
        size = 1.3 / np.sqrt(self.ring.stretching) * 10.0 ** generator.uniform(-1.0, 0.0, (copies, 1))
        moved = self.nodes.copy()
        moved[:, generator.integers(self.ring.segments)] += size * generator.normal(size=(copies, 3))
        return moved

    def means(self, samples, interval):
        """Means and standard errors (4,) of ``Ring.observe`` with the weights of contacts, of copies that are equal."""
        totals = 0.0
        for _ in range(samples):
            self.sweep(interval)
            values = self.ring.observe(self.nodes)
            weights = np.exp(-values[:, :1])
            totals = totals + weights * np.column_stack([np.ones(len(values)), values])
        means = totals[:, 1:].mean(axis=0) / totals[:, 0].mean()
        errors = (totals[:, 1:] - totals[:, :1] * means).std(axis=0) / totals[:, 0].mean() / np.sqrt(len(totals))
        return means, errors


def regular_rings(ring, copies):
    """Polygons with segments of their rest length."""
    angles = 2.0 * np.pi * np.arange(ring.segments) / ring.segments
    radius = 0.5 * ring.length / np.sin(np.pi / ring.segments)
    polygon = radius * np.column_stack([np.cos(angles), np.sin(angles), 0.0 * angles])
    return np.repeat(polygon[None], copies, axis=0)
