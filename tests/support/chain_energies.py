"""Energies of stretching and bending of chains, as they are in nodes and as they should be."""

import numpy as np

from openmm_cylchain.filaments.equilibrium import JointAngleDistribution, SegmentLengthDistribution
from openmm_cylchain.mechanics.geometry import segment_vectors
from support.solvent import KT, TEMPERATURE


def energies_of(kind, nodes, closed=False):
    """Mean energies of the segments and joints of each chain in k_B T; of closed ones, beyond that of a square."""
    vectors = (np.roll(nodes, -1, axis=1) - nodes) if closed else np.diff(nodes, axis=1)
    lengths = np.linalg.norm(vectors, axis=2)
    tangents = vectors / lengths[..., None]
    before, after = (tangents, np.roll(tangents, -1, axis=1)) if closed else (tangents[:, :-1], tangents[:, 1:])
    cosines = np.einsum("ijk,ijk->ij", before, after)
    bending = np.zeros(cosines.shape) if kind.bending_rigidity == 0 else kind.bending_energy(cosines)
    if closed:
        bending = bending - kind.bending_energy(0.0)
    joints = max(1, cosines.shape[1])
    return np.array([kind.stretching_energy(lengths).mean(axis=1), bending.sum(axis=1) / joints]) / KT


def exact_energies(kind):
    """Of a free chain."""
    stretching = SegmentLengthDistribution(kind, TEMPERATURE).mean(kind.stretching_energy) / KT
    if kind.bending_rigidity == 0:
        return stretching, 0.0
    return stretching, JointAngleDistribution(kind, TEMPERATURE).mean(kind.bending_energy) / KT


def chain_energies(kind, nodes, stiffnesses=None, closed=False):
    """Stretching and bending energy in kJ/mol of a chain of straight segments, whose joints may have other ones."""
    vectors = segment_vectors(nodes, closed)
    stretching = kind.stretching_energies(np.linalg.norm(vectors, axis=1), closed)
    return float(stretching.sum()), float(kind.bending_energies(vectors, stiffnesses, closed).sum())
