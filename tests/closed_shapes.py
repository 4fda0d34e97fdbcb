"""Short chains whose ends are held, and rings, in exact equilibrium: independent draws with weights.

With w = r1 + r2 of the length r, three segments between two fixed points, and four in a ring, have the measure
l1 l2 l3 (l4) dl1 dl2 dl3 (dl4) dr dphi, phi being the angle by which what follows is turned about w. So lengths are
drawn from l exp(-V_el/k_B T), r and phi from the bending energy with lengths at rest, and the rest is a weight.
"""

import numpy as np
from physics_cases import KT

from openmm_cylchain.equilibrium import SegmentLengthDistribution


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

    def __init__(self, kind, distance, temperature, draws=400_000, cells=(600, 300)):
        self.kind, self.distance = kind, distance
        generator = np.random.default_rng(3)
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
        coarse = self._bending(rest, r.ravel(), phi.ravel())[1]
        chance = np.exp(-(coarse - coarse.min()) / KT)
        # A fifth of the draws anywhere, so that nothing is left out.
        chance = 0.8 * chance / chance.sum() + 0.2 / len(chance)
        cell = generator.choice(len(chance), draws, p=chance)
        r = r.ravel()[cell] + steps[0] * (generator.random(draws) - 0.5)
        phi = phi.ravel()[cell] + steps[1] * (generator.random(draws) - 0.5)
        lengths = SegmentLengthDistribution(kind, temperature, planar=True).sample(generator, (count, draws))
        self._vectors, bending = self._bending(lengths, r, phi)
        weight = np.exp(-(bending - bending.min()) / KT) / chance[cell]
        self.weight = weight / weight.sum()
        self.effective = 1.0 / np.sum(self.weight**2)
        self.stretching = self._mean(kind.stretching_energy(lengths).mean(axis=0) / KT)
        joints = count if distance is None else count - 1
        self.bending = self._mean(bending / KT / joints)

    def _mean(self, values):
        kept = self.weight > 0.0
        return float(self.weight[kept] @ values[kept])

    def _bending(self, lengths, r, phi):
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
        vectors = np.array(vectors)
        tangents = vectors / np.linalg.norm(vectors, axis=1)[:, None]
        after = np.roll(tangents, -1, axis=0)
        joints = len(vectors) if self.distance is None else len(vectors) - 1
        cosines = np.sum(tangents * after, axis=1)[:joints]
        with np.errstate(invalid="ignore", divide="ignore"):
            energy = self.kind.bending_energy(np.clip(cosines, -1.0, 1.0)).sum(axis=0)
        return vectors, np.where(np.isfinite(vectors).all(axis=(0, 1)), energy, np.inf)

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
