"""Distances of two filaments in equilibrium, drawn without the package: numpy alone."""

import numpy as np


def distance_to_segment(point, start, along):
    fraction = np.einsum("ij,ij->i", point - start, along) / np.einsum("ij,ij->i", along, along)
    return np.linalg.norm(point - start - np.clip(fraction, 0, 1)[:, None] * along, axis=1)


def segment_distance(start, p, other, q):
    """Of two segments: that of an end of one from the other, or of the lines where these are nearest within both."""
    ends = [distance_to_segment(start, other, q), distance_to_segment(start + p, other, q)]
    ends += [distance_to_segment(other, start, p), distance_to_segment(other + q, start, p)]
    normal = np.cross(p, q)
    square = np.einsum("ij,ij->i", normal, normal)
    between = other - start
    s = np.einsum("ij,ij->i", np.cross(between, q), normal) / square
    t = np.einsum("ij,ij->i", np.cross(between, p), normal) / square
    within = (s > 0) & (s < 1) & (t > 0) & (t < 1)
    lines = np.abs(np.einsum("ij,ij->i", between, normal)) / np.sqrt(square)
    return np.where(within, lines, np.min(ends, axis=0))


def filament_distance(first, second):
    """Least distance of two filaments: nodes (nodes, draws, 3) of both. One with a single node is a sphere's center."""
    if len(second) == 1:
        pairs = [distance_to_segment(second[0], a, b - a) for a, b in zip(first, first[1:])]
    else:
        pairs = [
            segment_distance(a, b - a, c, d - c) for a, b in zip(first, first[1:]) for c, d in zip(second, second[1:])
        ]
    return np.min(pairs, axis=0)


def _turned(tangents, stiffness, generator):
    # By angles with the weight exp(stiffness cos).
    share = generator.uniform(np.exp(-2 * stiffness), 1, len(tangents))
    return turned_by(tangents, 1 + np.log(share) / stiffness, generator)


def turned_by(tangents, cosines, generator):
    """Unit vectors (count, 3) that are turned by angles with so many cosines (count,), about random axes."""
    across = generator.normal(size=tangents.shape)
    across -= np.einsum("ij,ij->i", across, tangents)[:, None] * tangents
    across /= np.linalg.norm(across, axis=1)[:, None]
    return cosines[:, None] * tangents + np.sqrt(1 - cosines**2)[:, None] * across


def draw_filaments(segments, length, stiffness, count, generator):
    """Nodes (segments + 1, count, 3) of chains of an odd number of segments, the middle of which is at the origin.

    ``stiffness`` is that of a joint over k_B T, with the energy 1 - cos.
    """
    middle = segments // 2
    directions = generator.normal(size=(count, 3))
    tangents = [directions / np.linalg.norm(directions, axis=1)[:, None]]
    for _ in range(middle):
        tangents.append(_turned(tangents[-1], stiffness, generator))
        tangents.insert(0, _turned(tangents[0], stiffness, generator))
    nodes = np.concatenate([np.zeros((1, count, 3)), np.cumsum(length * np.array(tangents), axis=0)])
    return nodes - 0.5 * (nodes[middle] + nodes[middle + 1])


def draw_distances(segments, length, stiffness, spread, diameter, contact, count, seed=7, sphere=False):
    """Least distances of pairs, and their weights.

    The middles differ by Gaussians of the standard deviation ``spread``; contacts at ``diameter`` have the stiffness
    ``contact`` over k_B T.
    """
    generator = np.random.default_rng(seed)
    first = draw_filaments(segments, length, stiffness, count, generator)
    if sphere:
        second = np.zeros((1, count, 3))
    else:
        second = draw_filaments(segments, length, stiffness, count, generator)
    distances = filament_distance(first, second + generator.normal(0, spread, (count, 3)))
    return distances, np.exp(-0.5 * contact * np.minimum(0, distances - diameter) ** 2)
