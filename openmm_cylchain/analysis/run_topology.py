"""The topology of a run, as mdtraj reads it."""

from pathlib import Path

import mdtraj

from ..errors import InputError


def read_topology(path: Path, particles: int) -> mdtraj.Topology:
    """The topology in an mmCIF file; InputError if it is damaged, or that of another number of particles."""
    try:
        topology = mdtraj.load_topology(str(path))
    except OSError:
        raise
    except Exception:  # Its reader raises whatever comes of a file that has been cut.
        topology = None
    if topology is None or topology.n_atoms != particles:
        there = "" if topology is None else f" ({topology.n_atoms} atoms for {particles} particles)"
        raise InputError(
            f"{path} is damaged{there}: put back what it was, or start the run again in another directory."
        )
    return topology
