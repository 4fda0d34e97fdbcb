"""The filaments of a topology of mdtraj: their nodes, and whether they are rings."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..errors import InputError
from ..units.quantities import shown
from ..units.types import BoolArray, IntArray
from .filament import NODE_NAME

if TYPE_CHECKING:
    import mdtraj


def filament_nodes(trajectory_or_topology: mdtraj.Trajectory | mdtraj.Topology) -> list[IntArray]:
    """Atom indices of the nodes of every filament, in order along the filament.

    Parameters
    ----------
    trajectory_or_topology : mdtraj.Trajectory or mdtraj.Topology

    Returns
    -------
    list of (nodes,) int arrays

    Raises
    ------
    InputError
        If there is no filament, or one with fewer than two nodes.
    """
    topology = _topology_of(trajectory_or_topology)
    filaments = []
    for chain in topology.chains:
        nodes = np.array([atom.index for atom in chain.atoms if atom.name == NODE_NAME], dtype=int)
        if len(nodes) == 1:
            raise InputError(f"Chain {chain.index} has a single node, but a filament has at least two.")
        if len(nodes):
            filaments.append(nodes)
    if not filaments:
        raise InputError(f"The topology has no filament: no atom has the name {NODE_NAME!r}.")
    return filaments


def require_trajectory(trajectory: mdtraj.Trajectory) -> None:
    """Raise InputError for what is no trajectory of mdtraj."""
    if not all(hasattr(trajectory, name) for name in ("topology", "xyz", "n_frames", "unitcell_vectors")):
        raise InputError(f"trajectory must be an mdtraj.Trajectory, but is {shown(trajectory)}.")


def _topology_of(trajectory_or_topology):
    # Without mdtraj itself, which takes long to import.
    topology = getattr(trajectory_or_topology, "topology", trajectory_or_topology)
    if not all(hasattr(topology, name) for name in ("n_atoms", "chains", "bonds")):
        raise InputError(
            "trajectory must be an mdtraj.Trajectory (or its topology, where nodes are looked for), but is "
            f"{shown(trajectory_or_topology)}."
        )
    return topology


def ring_filaments(trajectory_or_topology: mdtraj.Trajectory | mdtraj.Topology) -> BoolArray:
    """Whether each filament is a ring: (filaments,) bool array."""
    topology = _topology_of(trajectory_or_topology)
    bonds = {frozenset((bond.atom1.index, bond.atom2.index)) for bond in topology.bonds}
    nodes = filament_nodes(topology)
    return np.array([len(one) > 2 and frozenset((int(one[0]), int(one[-1]))) in bonds for one in nodes])
