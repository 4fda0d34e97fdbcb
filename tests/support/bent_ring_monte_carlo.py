"""Rings with material frames whose joints are bent at rest, in equilibrium by Monte Carlo: numpy and scipy alone.

Energies are in k_B T: (joint/2) |b - rest|^2 of each bend in the frame half-way over its joint, of the Kratky-Porod
model, and (twist/2) m^2. Segments do not stretch. Frames are vectors that turn with the segments: nothing is carried
along.
"""

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation


@dataclass
class BentRings:
    """Copies of a ring, which begin flat; vectors and frames are (copies, segments, 3), twists (copies, segments)."""

    segments: int
    joint: float
    twist: float
    rest: tuple
    copies: int

    def __post_init__(self):
        angles = 2 * np.pi * np.arange(self.segments) / self.segments
        along = np.stack([-np.sin(angles), np.cos(angles), 0 * angles], axis=-1)
        inward = np.stack([-np.cos(angles), -np.sin(angles), 0 * angles], axis=-1)
        self.tangents, self.frames = (np.tile(own, (self.copies, 1, 1)) for own in (along, inward))
        self.twists = np.zeros((self.copies, self.segments))
        self.bends, self.twists = self.describe(self.tangents, self.frames)

    def describe(self, tangents, frames):
        """Bends in the material, and twists that are nearest to those there are."""
        before, axis = np.roll(tangents, 1, axis=1), np.roll(frames, 1, axis=1)
        carried = _carried(axis, before, tangents)
        twists = np.arctan2(_dot(np.cross(carried, frames), tangents), _dot(carried, frames))
        twists = twists + 2 * np.pi * np.round((self.twists - twists) / (2 * np.pi))
        middle = before + tangents
        middle /= np.linalg.norm(middle, axis=2)[..., None]
        axis = _carried(axis, before, middle)
        half = 0.5 * twists[..., None]
        axis = np.cos(half) * axis + np.sin(half) * np.cross(middle, axis)
        bent = tangents - before
        return np.stack([_dot(bent, axis), _dot(bent, np.cross(middle, axis))], axis=-1), twists

    def energies(self, bends, twists):
        """Of bends and of twists: an array (2, copies)."""
        bending = 0.5 * self.joint * ((bends - np.array(self.rest)) ** 2).sum(axis=(1, 2))
        return np.array([bending, 0.5 * self.twist * (twists**2).sum(axis=1)])

    def move(self, moves, generator):
        """Turn stretches about their chords, and frames about their segments, by turns."""
        for move in range(moves):
            first, count = (
                generator.integers(0, self.segments, self.copies),
                generator.integers(2, self.segments - 1, self.copies),
            )
            inside = (np.arange(self.segments) - first[:, None]) % self.segments < count[:, None]
            angles = generator.normal(size=self.copies) * generator.choice([0.15, 0.5], self.copies)
            if move % 2:
                axes, angles = self.tangents, np.where(inside, 2 * angles[:, None], 0.0)
            else:
                axes = (self.tangents * inside[..., None]).sum(axis=1)[:, None]
                axes = axes / np.linalg.norm(axes, axis=2, keepdims=True) * np.ones((self.segments, 1))
                angles = np.where(inside, angles[:, None], 0.0)
            turns = Rotation.from_rotvec((axes * angles[..., None]).reshape(-1, 3))
            new = [turns.apply(own.reshape(-1, 3)).reshape(own.shape) for own in (self.tangents, self.frames)]
            bends, twists = self.describe(*new)
            excess = (self.energies(bends, twists) - self.energies(self.bends, self.twists)).sum(axis=0)
            taken = generator.random(self.copies) < np.exp(-np.maximum(excess, 0.0))
            self.tangents[taken], self.frames[taken] = new[0][taken], new[1][taken]
            self.bends[taken], self.twists[taken] = bends[taken], twists[taken]

    def observe(self):
        """Energies of bends and twists, and squared radii of gyration for segments of the length one: (copies, 3)."""
        return np.column_stack(
            [*self.energies(self.bends, self.twists), squared_radii(np.cumsum(self.tangents, axis=1))]
        )

    def first_twists(self):
        """By how much the first frames are turned from where the x axis is carried from the z axis: (copies,)."""
        tangents, axis = self.tangents[:, 0], np.tile([1.0, 0.0, 0.0], (self.copies, 1))
        axis = _carried(axis, np.tile([0.0, 0.0, 1.0], (self.copies, 1)), tangents)
        return np.arctan2(_dot(np.cross(axis, self.frames[:, 0]), tangents), _dot(axis, self.frames[:, 0]))


def squared_radii(nodes):
    """Squares of the radii of gyration of (copies, nodes, 3)."""
    return ((nodes - nodes.mean(axis=1)[:, None]) ** 2).sum(axis=2).mean(axis=1)


def _dot(first, second):
    return (first * second).sum(axis=-1)


def _carried(vectors, before, behind):
    axes = np.cross(before, behind)
    sines, cosines = np.linalg.norm(axes, axis=-1)[..., None], _dot(before, behind)[..., None]
    axes = axes / np.maximum(sines, 1e-300)
    return vectors * cosines + np.cross(axes, vectors) * sines + axes * _dot(axes, vectors)[..., None] * (1 - cosines)
