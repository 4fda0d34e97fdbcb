"""Supercoiled rings in equilibrium by Monte Carlo, without the package: numpy alone.

Lengths are in nm and energies in k_B T. Configurations are arrays (copies, nodes, 3).
"""

from dataclasses import dataclass

import numpy as np

from support.ring_monte_carlo import Ring, RingMonteCarlo


@dataclass(frozen=True)
class SupercoiledRing(Ring):
    """A Ring with bends of the energy joint (1 - c), which is closed with so many turns.

    What is not writhe is twist, with the energy (twist/2 segments) (2 pi (turns - Wr))^2: that of all twists of joints
    with this sum. There may be walls at z = +-slab/2, and a link between the first node and the one across.
    """

    twist: float
    turns: float
    slab: float = 0.0
    wall: float = 0.0
    link: float = 0.0
    link_length: float = 0.0

    def energies(self, nodes):
        along = np.roll(nodes, -1, axis=1) - nodes
        lengths = np.linalg.norm(along, axis=2)
        tangents = along / lengths[..., None]
        cosines = np.einsum("cnk,cnk->cn", tangents, np.roll(tangents, 1, axis=1))
        return self.joint * (1.0 - cosines), 0.5 * self.stretching * (lengths - self.length) ** 2

    def writhes(self, nodes):
        """(copies,), see ``writhes_of_polygons``."""
        return writhes_of_polygons(nodes)

    def held_energies(self, nodes):
        """Of walls, and of the link: an array (copies, 2)."""
        depths = np.maximum(np.abs(nodes[..., 2]) - 0.5 * self.slab, 0.0)
        across = np.linalg.norm(nodes[:, 0] - nodes[:, self.segments // 2], axis=1)
        link = 0.5 * self.link * (across - self.link_length) ** 2
        return np.column_stack([0.5 * self.wall * (depths**2).sum(axis=1), link])

    def observe(self, nodes):
        """Writhe, square of the radius of gyration, energies of contacts, bends, walls, link: an array (copies, 6)."""
        out = nodes - nodes.mean(axis=1)[:, None]
        sizes = (out**2).sum(axis=2).mean(axis=1)
        bends = self.energies(nodes)[0].sum(axis=1)
        return np.column_stack(
            [self.writhes(nodes), sizes, self.contact_energies(nodes), bends, self.held_energies(nodes)]
        )


def writhes_of_polygons(nodes):
    """(copies,), of the solid angles of pairs of segments that are no neighbours."""
    segments = nodes.shape[1]
    first, second = np.triu_indices(segments, 2)
    first, second = (own[second - first < segments - 1] for own in (first, second))
    # With x, y and z in front, as contiguous arrays.
    starts = np.ascontiguousarray(np.moveaxis(nodes, 2, 0))
    ends = np.roll(starts, -1, axis=2)
    corners = [one[..., first] - other[..., second] for one in (starts, ends) for other in (starts, ends)]
    angles = _solid_angles(corners[0], corners[2], corners[3]) + _solid_angles(corners[0], corners[3], corners[1])
    return -angles.sum(axis=1) / (2.0 * np.pi)


def _solid_angles(a, b, c):
    def dot(v, w):
        return v[0] * w[0] + v[1] * w[1] + v[2] * w[2]

    across = b[1] * c[2] - b[2] * c[1], b[2] * c[0] - b[0] * c[2], b[0] * c[1] - b[1] * c[0]
    x, y, z = (np.sqrt(dot(v, v)) for v in (a, b, c))
    return 2.0 * np.arctan2(dot(a, across), x * y * z + dot(a, b) * z + dot(b, c) * x + dot(c, a) * y)


class SupercoilMonteCarlo(RingMonteCarlo):
    """Metropolis moves of copies of a SupercoiledRing, which are wound in the first ones.

    Moves that change the writhe by more than one are refused: strands pass each other there, and make knots.
    """

    largest_turn = 0.5

    def __init__(self, ring, nodes, seed, winding):
        super().__init__(ring, nodes, seed)
        self._writhes, self._turns = ring.writhes(self.nodes), 0.0
        for self._turns in np.linspace(ring.turns, 0.0, winding, endpoint=False)[::-1]:
            self.sweep()

    def sweep(self, sweeps=1):
        for _ in range(sweeps):
            for move in (self._turn, self._shift):
                self._take(move())

    def _take(self, moved):
        writhes = self.ring.writhes(moved)
        energies = self._energies_of(moved)
        before, after = (self._twist_energies(own) for own in (self._writhes, writhes))
        taken = np.log(self._generator.random(len(energies))) < self._energies + before - energies - after
        taken &= np.abs(writhes - self._writhes) < 1.0
        self.nodes[taken], self._energies[taken], self._writhes[taken] = moved[taken], energies[taken], writhes[taken]

    def _energies_of(self, nodes):
        further = self.ring.contact_energies(nodes) + self.ring.held_energies(nodes).sum(axis=1)
        return super()._energies_of(nodes) + further

    def _twist_energies(self, writhes):
        return 0.5 * self.ring.twist / self.ring.segments * (2.0 * np.pi * (self._turns - writhes)) ** 2

    def means(self, samples, interval):
        """Means and standard errors (6,) of ``SupercoiledRing.observe``, of copies that are equal."""
        total = 0.0
        for _ in range(samples):
            self.sweep(interval)
            total = total + self.ring.observe(self.nodes) / samples
        return total.mean(axis=0), total.std(axis=0, ddof=1) / np.sqrt(len(total))
