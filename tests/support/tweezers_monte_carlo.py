"""DNA in magnetic tweezers in equilibrium by Monte Carlo, without the package: numpy alone.

Lengths are in nm and energies in k_B T. Configurations are arrays (copies, segments + 1, 3).
"""

from dataclasses import dataclass

import numpy as np

from support.rod_monte_carlo import contact_distances
from support.supercoil_monte_carlo import SupercoiledRing, SupercoilMonteCarlo, writhes_of_polygons

# Where polygons close; how far out is what their writhe is wrong by.
_FAR = 1e6


@dataclass(frozen=True)
class TweezedChain(SupercoiledRing):
    """An open chain with the energies of a SupercoiledRing, whose ends are held with so many turns.

    Its first ``handle`` segments are fixed along z. ``pull`` acts along z on the last node, and a pair of forces,
    ``aligning``, on the ends of the last ``handle`` segments.
    """

    handle: int = 0
    pull: float = 0.0
    aligning: float = 0.0

    def energies(self, nodes):
        along = np.diff(nodes, axis=1)
        lengths = np.linalg.norm(along, axis=2)
        tangents = along / lengths[..., None]
        cosines = np.einsum("cnk,cnk->cn", tangents[:, 1:], tangents[:, :-1])
        return self.joint * (1.0 - cosines), 0.5 * self.stretching * (lengths - self.length) ** 2

    def pairs(self, nodes):
        first, second = np.triu_indices(self.segments, self.excluded + 1)
        along = np.diff(nodes, axis=1)
        middles = nodes[:, :-1] + 0.5 * along
        between = middles[:, first] - middles[:, second]
        return first, second, *contact_distances(between, along[:, first], along[:, second])

    def writhes(self, nodes):
        """(copies,), of chains that go on straight along z, and close in a plane far away."""
        low, high = nodes[:, 0], nodes[:, -1]
        up, aside = np.array([0.0, 0.0, _FAR]), np.full(low.shape, [_FAR, 0.0, 0.0])
        closing = np.stack([high + up, aside + up, aside - up, low - up], axis=1)
        return writhes_of_polygons(np.concatenate([nodes, closing], axis=1))

    def held_energies(self, nodes):
        """Of the forces: an array (copies, 1)."""
        height, handle = nodes[:, -1, 2], nodes[:, -1, 2] - nodes[:, -1 - self.handle, 2]
        return (-self.pull * height - self.aligning * handle)[:, None]

    def observe(self, nodes):
        """Writhe, z of the last node, energies of contacts and bends: an array (copies, 4)."""
        bends = self.energies(nodes)[0].sum(axis=1)
        return np.column_stack([self.writhes(nodes), nodes[:, -1, 2], self.contact_energies(nodes), bends])

    def coiled(self, copies, coils, height=90.0):
        """Chains along z, whose middle is a right-handed helix of so many turns and such a height, if there are any."""
        nodes = np.zeros((self.segments + 1, 3))
        nodes[:, 2] = self.length * np.arange(self.segments + 1)
        if coils:
            count = self.segments - 2 * self.handle
            along = np.linspace(0.0, 1.0, count + 1)
            radius = np.sqrt((count * self.length) ** 2 - height**2) / (2.0 * np.pi * coils)
            angle, start = 2.0 * np.pi * coils * along, self.length * self.handle
            helix = [radius * (np.cos(angle) - 1.0), radius * np.sin(angle), start + height * along]
            nodes[self.handle : self.segments + 1 - self.handle] = np.column_stack(helix)
            nodes[self.segments + 1 - self.handle :, 2] -= count * self.length - height
        return np.repeat(nodes[None], copies, axis=0)


class TweezersMonteCarlo(SupercoilMonteCarlo):
    """Metropolis moves of copies of a TweezedChain: a part, or all behind a node, turns or moves."""

    largest_turn = 2.0

    def _turn(self):
        chain, generator, copies = self.ring, self._generator, len(self.nodes)
        first = generator.integers(chain.handle, chain.segments)
        last = generator.integers(first + 2, chain.segments + 2)
        start = self.nodes[:, first, None]
        if last > chain.segments:
            axis = generator.normal(size=start.shape)
        else:
            axis = self.nodes[:, last, None] - start
        axis /= np.linalg.norm(axis, axis=2)[..., None]
        angle = self.largest_turn * 10.0 ** generator.uniform(-2.0, 0.0, copies) * generator.normal(size=copies)
        angle = angle[:, None, None]
        out = self.nodes[:, first + 1 : last] - start
        parallel = axis * (out * axis).sum(axis=2)[..., None]
        moved = self.nodes.copy()
        turned = parallel + (out - parallel) * np.cos(angle) + np.cross(axis, out) * np.sin(angle)
        moved[:, first + 1 : last] = start + turned
        return moved

    def _shift(self):
        generator, copies = self._generator, len(self.nodes)
        size = 1.3 / np.sqrt(self.ring.stretching) * 10.0 ** generator.uniform(-1.0, 0.0, (copies, 1, 1))
        first = generator.integers(self.ring.handle + 1, self.ring.segments + 1)
        last = generator.choice([first + 1, self.ring.segments + 1])
        moved = self.nodes.copy()
        moved[:, first:last] += size * generator.normal(size=(copies, 1, 3))
        return moved
