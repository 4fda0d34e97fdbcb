"""Short chains whose ends are held, and rings, in exact equilibrium: independent draws with weights.

With w = r1 + r2 of the length r, three segments between two fixed points, and four in a ring, have the measure
l1 l2 l3 (l4) dl1 dl2 dl3 (dl4) dr dphi, phi being the angle by which what follows is turned about w. So lengths are
drawn from l exp(-V_el/k_B T), r and phi from the bending energy with lengths at rest, and the rest is a weight.

Where stiff joints hold soft lengths, few of these draws count. There, shapes are drawn about the straight chain or the
square at rest, which have the least energy, from a multivariate t distribution that has the curvature of the energy: of
the places of the inner nodes of held chains, and of l1 .. l4, r and phi of rings.
"""

import numpy as np

from openmm_cylchain.filaments.equilibrium import SegmentLengthDistribution
from support.solvent import KT


class ClosedShape:
    """Weighted draws of three segments between two fixed points, or of a ring of four.

    Parameters
    ----------
    kind : FilamentType
    distance : float or None
        Of the fixed points in nm; None for a ring.
    temperature : float
    draws : int
    """

    def __init__(self, kind, distance, temperature, draws=400_000, about_rest=False):
        self.kind, self.distance = kind, distance
        generator = np.random.default_rng(3)
        if not about_rest:
            vectors, logarithm = self._lengths_first(generator, temperature, draws)
        elif distance is None:
            vectors, logarithm = self._ring_about_rest(generator, draws)
        else:
            vectors, logarithm = self._held_about_rest(generator, draws)
        self._vectors = vectors
        weight = np.exp(logarithm - logarithm.max())
        self.weight = weight / weight.sum()
        self.effective = 1.0 / np.sum(self.weight**2)
        stretching, bending = self._energies(vectors)
        self.stretching, self.bending = self._mean(stretching / len(vectors)), self._mean(bending / self._joints)

    @property
    def _joints(self):
        return 4 if self.distance is None else 2

    def _lengths_first(self, generator, temperature, draws, cells=(600, 300)):
        kind, distance = self.kind, self.distance
        count = 4 if distance is None else 3
        rest = np.full((count, 1), kind.segment_length)
        # What r can be where lengths are eight standard deviations off.
        spread = 8.0 * np.sqrt(KT / kind.segment_stiffness)
        low, high = 0.0, 2.0 * (kind.segment_length + spread)
        if distance is not None:
            low = max(low, abs(distance - rest[0, 0]) - spread)
            high = min(high, distance + rest[0, 0] + spread)
        steps = (high - low) / cells[0], np.pi / cells[1]
        r, phi = np.meshgrid(
            low + steps[0] * (np.arange(cells[0]) + 0.5), steps[1] * (np.arange(cells[1]) + 0.5), indexing="ij"
        )
        coarse = self._energies(self._segments(rest, r.ravel(), phi.ravel()))[1]
        chance = np.exp(-(coarse - coarse.min()))
        # A fifth of the draws anywhere, so that nothing is left out.
        chance = 0.8 * chance / chance.sum() + 0.2 / len(chance)
        cell = generator.choice(len(chance), draws, p=chance)
        r = r.ravel()[cell] + steps[0] * (generator.random(draws) - 0.5)
        phi = phi.ravel()[cell] + steps[1] * (generator.random(draws) - 0.5)
        lengths = SegmentLengthDistribution(kind, temperature, planar=True).sample(generator, (count, draws))
        vectors = self._segments(lengths, r, phi)
        return vectors, -self._energies(vectors)[1] - np.log(chance[cell])

    def _held_about_rest(self, generator, draws):
        length = self.kind.segment_length
        assert self.distance == 3.0 * length

        def vectors_of(inner):
            nodes = np.zeros((4, 3, inner.shape[1]))
            nodes[1:3] = inner.reshape(2, 3, -1)
            nodes[3, 0] = self.distance
            return np.diff(nodes, axis=0)

        def energy(inner):
            return sum(self._energies(vectors_of(inner)))

        straight = np.array([length, 0.0, 0.0, 2.0 * length, 0.0, 0.0])
        inner, chance = draw_about(straight, self._least_spread * np.ones(6), energy, generator, draws)
        return vectors_of(inner), -energy(inner) - chance

    def _ring_about_rest(self, generator, draws):
        length = self.kind.segment_length

        def vectors_of(coordinates):
            return self._segments(coordinates[:4], coordinates[4], coordinates[5])

        def energy(coordinates):
            return sum(self._energies(vectors_of(coordinates)))

        square = np.array([length, length, length, length, np.sqrt(2.0) * length, np.pi])
        spreads = self._least_spread * np.array([1.0, 1.0, 1.0, 1.0, 1.0, 1.0 / length])
        coordinates, chance = draw_about(square, spreads, energy, generator, draws)
        measure = np.log(np.abs(coordinates[:4])).sum(axis=0)
        return vectors_of(coordinates), measure - energy(coordinates) - chance

    @property
    def _least_spread(self):
        # That of a length, or of a place that a joint holds.
        kind = self.kind
        return np.sqrt(KT / max(kind.segment_stiffness, kind.joint_stiffness / kind.segment_length**2))

    def _mean(self, values):
        kept = self.weight > 0.0
        return float(self.weight[kept] @ values[kept])

    def _segments(self, lengths, r, phi):
        """Vectors (segments, 3, n), not finite where there is no such shape."""
        l1, l2, l3 = lengths[:3]
        with np.errstate(invalid="ignore"):
            along = (r**2 + l1**2 - l2**2) / (2.0 * r)
            across = np.sqrt(l1**2 - along**2)
            third = self.distance**2 - l3**2 if self.distance is not None else lengths[3] ** 2 - l3**2
            ahead = (third - r**2) / (2.0 * r)
            aside = np.sqrt(l3**2 - ahead**2)
        zero = np.zeros_like(r)
        vectors = [
            np.stack([across, zero, along]),
            np.stack([-across, zero, r - along]),
            np.stack([aside * np.cos(phi), aside * np.sin(phi), ahead]),
        ]
        if self.distance is None:
            vectors.append(-sum(vectors))
        return np.array(vectors)

    def _energies(self, vectors):
        """Of stretching and of bending of each shape, in k_B T; infinite where it is not finite."""
        lengths = np.linalg.norm(vectors, axis=1)
        with np.errstate(invalid="ignore", divide="ignore"):
            tangents = vectors / lengths[:, None]
            after = np.roll(tangents, -1, axis=0)
            cosines = np.sum(tangents * after, axis=1)[: self._joints]
            bending = self.kind.bending_energy(np.clip(cosines, -1.0, 1.0)).sum(axis=0)
            stretching = self.kind.stretching_energy(lengths).sum(axis=0)
        possible = np.isfinite(vectors).all(axis=(0, 1))
        return np.where(possible, stretching / KT, np.inf), np.where(possible, bending / KT, np.inf)

    def draw(self, count, seed=1):
        """Nodes (count, n, 3) of independent shapes; held ones lead from the origin along x."""
        generator = np.random.default_rng(seed)
        chosen = generator.choice(len(self.weight), count, p=self.weight)
        vectors = self._vectors[:, :, chosen].transpose(2, 0, 1)
        nodes = np.concatenate([np.zeros((count, 1, 3)), np.cumsum(vectors, axis=1)], axis=1)
        if self.distance is None:
            return nodes[:, :-1]
        whole = nodes[:, -1] / self.distance
        # Rotated by pi about the bisector of x and the whole.
        axis = whole + np.array([1.0, 0.0, 0.0])
        axis /= np.linalg.norm(axis, axis=1)[:, None]
        return 2.0 * np.einsum("cni,ci->cn", nodes, axis)[..., None] * axis[:, None] - nodes


def draw_about(middle, spreads, energy, generator, draws, freedom=8.0):
    """Draws (coordinates, n) about a minimum of an energy in k_B T, and the logarithms of their densities but for a
    constant. The spreads are what coordinates move by for about one k_B T."""
    count = len(middle)
    steps = np.diag(0.3 * spreads)
    hessian = np.empty((count, count))
    for i, a in enumerate(steps):
        for j, b in enumerate(steps):
            corners = np.array([middle + a + b, middle - a - b, middle + a - b, middle - a + b])
            hessian[i, j] = energy(corners.T) @ [1.0, 1.0, -1.0, -1.0] / (4.0 * a.sum() * b.sum())
    root = np.linalg.cholesky(np.linalg.inv(hessian))
    deviates = generator.normal(size=(count, draws)) / np.sqrt(generator.chisquare(freedom, draws) / freedom)
    density = -0.5 * (freedom + count) * np.log1p(np.sum(deviates**2, axis=0) / freedom)
    return middle[:, None] + root @ deviates, density
