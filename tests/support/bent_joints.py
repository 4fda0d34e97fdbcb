"""Joints that are bent at rest, by formulas of their own: numpy and scipy, without the package.

The energy of a joint is (K/2) |b - k|^2, for the two components of its bend b in the material frame half-way over it;
energies are in k_B T.
"""

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

MODELS = {
    "kratky-porod": (lambda b: 2 * np.arcsin(np.minimum(b / 2, 1)), 2.0),
    "quadratic": (lambda b: b, np.pi),
    "inscribed-circle": (lambda b: 2 * np.arctan(b / 2), np.inf),
}
"""The angle of a joint with the bend b, and the largest b."""


@dataclass(frozen=True)
class BentJoint:
    """One with a bending stiffness, its two components at rest, and the stiffness and the rest of its twist."""

    model: str
    stiffness: float
    rest: tuple
    twist: float = 1.0
    rest_twist: float = 0.0

    def grid(self):
        """Sizes b and directions of bends, and their weights: arrays of one shape."""
        angle_of, largest = MODELS[self.model]
        size = np.hypot(*self.rest)
        deviation = 1 / np.sqrt(self.stiffness)
        edges = np.linspace(max(0.0, size - 9 * deviation), min(largest, size + 9 * deviation), 1501)
        b = 0.5 * (edges[1:] + edges[:-1])
        directions = 2 * np.pi * (np.arange(256) + 0.5) / 256
        # Of solid angles.
        measure = -np.diff(np.cos(angle_of(edges)))
        b, directions = np.meshgrid(b, directions, indexing="ij")
        x, y = b * np.cos(directions) - self.rest[0], b * np.sin(directions) - self.rest[1]
        weights = measure[:, None] * np.exp(-0.5 * self.stiffness * (x**2 + y**2))
        return b, directions, weights / weights.sum()

    def moments(self):
        """Means of the components of b, and of its energy."""
        b, directions, weights = self.grid()
        x, y = b * np.cos(directions), b * np.sin(directions)
        energy = 0.5 * self.stiffness * ((x - self.rest[0]) ** 2 + (y - self.rest[1]) ** 2)
        return np.array([(weights * own).sum() for own in (x, y, energy)])

    def draw_rotations(self, count, generator):
        """So many rotations (count, 3, 3) from the frame of a segment to that of the next one."""
        b, directions, weights = self.grid()
        drawn = np.searchsorted(np.cumsum(weights.ravel()), generator.random(count))
        b, directions = b.ravel()[drawn], directions.ravel()[drawn]
        axes = np.stack([-np.sin(directions), np.cos(directions), 0 * directions], axis=1)
        twists = generator.normal(self.rest_twist, 1 / np.sqrt(self.twist), count)
        half = Rotation.from_rotvec(0.5 * twists[:, None] * [0, 0, 1])
        return (half * Rotation.from_rotvec(axes * MODELS[self.model][0](b)[:, None]) * half).as_matrix()

    def mean_rotation(self):
        """The mean (3, 3) of the rotation from the frame of a segment to that of the next one; tangents are along z."""
        b, directions, weights = self.grid()
        angles = MODELS[self.model][0](b)
        axes = np.stack([-np.sin(directions), np.cos(directions), 0 * directions], axis=-1)
        bend = np.einsum(
            "ab,abij->ij",
            weights,
            Rotation.from_rotvec((axes * angles[..., None]).reshape(-1, 3)).as_matrix().reshape(*b.shape, 3, 3),
        )
        points, shares = np.polynomial.hermite_e.hermegauss(40)
        halves = Rotation.from_euler("z", 0.5 * (self.rest_twist + points / np.sqrt(self.twist))[:, None]).as_matrix()
        return np.einsum("m,mij->ij", shares / shares.sum(), halves @ bend @ halves)


def drawn_distances(joint, segments, count, generator):
    """Distances (count,) of the ends of chains with segments of the length one, whose joints are all alike."""
    frames, ends = np.tile(np.eye(3), (count, 1, 1)), np.tile([0.0, 0.0, 1.0], (count, 1))
    for _ in range(segments - 1):
        frames = frames @ joint.draw_rotations(count, generator)
        ends += frames[:, :, 2]
    return np.linalg.norm(ends, axis=1)


def mean_square_distance(joints, length):
    """Of the ends of a chain with segments of a length, whose joints are independent."""
    means, total = [own.mean_rotation() for own in joints], 0.0
    for first in range(len(means) + 1):
        product = np.eye(3)
        for second in range(first, len(means) + 1):
            total += (1 if second == first else 2) * product[2, 2]
            if second < len(means):
                product = product @ means[second]
    return total * length**2


def helix_of_joints(angle, twist, length):
    """Radius and rise per segment of the polygon whose joints all have one bend and one twist."""
    turn = 2 * np.arccos(np.cos(angle / 2) * np.cos(twist / 2))
    rise = length * np.cos(angle / 2) * np.sin(twist / 2) / np.sin(turn / 2)
    return np.sqrt(length**2 - rise**2) / (2 * np.sin(turn / 2)), rise, turn


def material_bends(model, nodes, twists):
    """The components (copies, joints, 2) of the bends of open chains (copies, nodes, 3), with twists (copies, nodes).

    The first twist is counted from the z axis: the x axis is carried from there. Frames are carried by rotations.
    """
    along = np.diff(nodes, axis=1)
    tangents = along / np.linalg.norm(along, axis=2)[..., None]
    axis = np.tile([1.0, 0.0, 0.0], (len(nodes), 1))
    axis = _turn(_carry(axis, np.tile([0.0, 0.0, 1.0], (len(nodes), 1)), tangents[:, 0]), tangents[:, 0], twists[:, 0])
    found = []
    for joint in range(1, tangents.shape[1]):
        before, behind, half = tangents[:, joint - 1], tangents[:, joint], 0.5 * twists[:, joint]
        middle = before + behind
        middle /= np.linalg.norm(middle, axis=1)[:, None]
        axis = _turn(_carry(axis, before, middle), middle, half)
        bent = behind - before
        chord = np.linalg.norm(bent, axis=1)
        sizes = {
            "kratky-porod": chord,
            "quadratic": 2 * np.arcsin(chord / 2),
            "inscribed-circle": 2 * np.tan(np.arcsin(chord / 2)),
        }
        bent *= (sizes[model] / chord)[:, None]
        found.append(np.stack([(bent * axis).sum(axis=1), (bent * np.cross(middle, axis)).sum(axis=1)], axis=1))
        axis = _carry(_turn(axis, middle, half), middle, behind)
    return np.stack(found, axis=1)


def _turn(vectors, axes, angles):
    return Rotation.from_rotvec(axes * angles[:, None]).apply(vectors)


def _carry(vectors, before, behind):
    axes = np.cross(before, behind)
    sines = np.linalg.norm(axes, axis=1)
    angles = np.arctan2(sines, (before * behind).sum(axis=1))
    return Rotation.from_rotvec(axes * (angles / np.maximum(sines, 1e-300))[:, None]).apply(vectors)
