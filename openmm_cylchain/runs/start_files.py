"""Files that filaments start from: arrays, structure files, frames of trajectories."""

import hashlib
import os
from pathlib import Path

import mdtraj
import numpy as np

from ..analysis.filament_shapes import control_point_positions
from ..filaments.topology_nodes import filament_nodes, ring_filaments
from .silence import silenced_c_library

COPIES = "start_files"
"""A folder beside a configuration that has copies of the files that it starts from: a run keeps them there."""

_ARRAYS = (".npy", ".npz")
_TRAJECTORIES = (".dcd", ".xtc")
_STRUCTURES = (".cif", ".pdb")


def find_start_file(folder, name):
    """The path of a file that a configuration in a folder names: the copy that a run has kept, if there is one."""
    copy = Path(folder) / COPIES / Path(name).name
    return copy if os.path.isfile(copy) else Path(folder) / name


def digest_of(path):
    """SHA-256 of a file; None if it cannot be read."""
    try:
        return hashlib.sha256(Path(path).read_bytes()).hexdigest()
    except OSError:
        return None


def read_start(folder, place, name, topology, frame, numbers, type_name):
    """Filaments of a file: a list of node positions (n, 3) in nm, whether each one is a ring, and its control points.

    Control points, (n, 3) in nm, are those of beam elements in structure files and trajectories, and None of others.

    Parameters
    ----------
    folder : Path
        That names begin from.
    place : Place
        Of the key, for messages.
    name : str
        An array ``.npy`` (filaments, nodes, 3), or (nodes, 3) of one; arrays of both kinds in an ``.npz``, in nm; an
        mmCIF or PDB file that this package has written; or a trajectory of such a topology.
    topology : str or None
        Structure file of a trajectory.
    frame : int or None
        Of a trajectory; the last one if None.
    numbers : sequence of int or None
        Of the filaments of the file; all whose residues have the name of the type if None.
    type_name : str

    Raises
    ------
    ConfigurationError
    """
    path = find_start_file(folder, name)
    suffix = path.suffix.lower()
    if suffix not in (*_ARRAYS, *_TRAJECTORIES, *_STRUCTURES):
        raise place.error(f"must be a {', '.join((*_ARRAYS, *_STRUCTURES, *_TRAJECTORIES))} file, but is {name!r}.")
    if not os.path.isfile(path):
        raise place.error(f"{str(path)!r} does not exist.")
    if (suffix in _TRAJECTORIES) != (topology is not None):
        raise place.error(f"{name!r}: give a topology for a trajectory, and only for one.")
    if frame is not None and suffix not in _TRAJECTORIES:
        raise place.error(f"{name!r} has no frames: leave frame out.")
    try:
        if suffix in _ARRAYS:
            chains, names = _arrays(path), None
        else:
            with silenced_c_library():
                chains, names = _structure(path, None if topology is None else find_start_file(folder, topology), frame)
    except Exception as error:  # Readers of damaged files raise whatever comes.
        raise place.error(f"{name!r} cannot be read: {error}") from None
    if numbers is not None:
        missing = [number for number in numbers if number >= len(chains)]
        if missing:
            raise place.error(f"{name!r} has {len(chains)} filaments, counted from 0, and no number {missing[0]}.")
        chains = [chains[number] for number in numbers]
    elif names is not None:
        chains = [chain for chain, own in zip(chains, names) if own == type_name]
        if not chains:
            raise place.error(f"{name!r} has filaments of the types {', '.join(sorted(set(names)))}, not {type_name}.")
    for number, (nodes, _, controls) in enumerate(chains):
        if controls is not None and not np.all(np.isfinite(controls)):
            raise place.error(f"{name!r}: control points of filament {number} are not finite.")
        if nodes.ndim != 2 or nodes.shape[1] != 3 or len(nodes) < 2 or not np.all(np.isfinite(nodes)):
            raise place.error(
                f"{name!r}: filament {number} has the shape {nodes.shape}; it must be two nodes or more of three "
                "finite coordinates."
            )
    if not chains:
        raise place.error(f"{name!r} has no filaments.")
    return chains


def _arrays(path):
    loaded = np.load(path, allow_pickle=False)
    arrays = [loaded] if isinstance(loaded, np.ndarray) else [loaded[key] for key in loaded.files]
    chains = []
    for array in arrays:
        array = np.asarray(array, dtype=float)
        chains += list(array) if array.ndim == 3 else [array]
    return [(chain, False, None) for chain in chains]


def _structure(path, topology, frame):
    if topology is None:
        loaded = mdtraj.load(str(path))[-1]
    else:
        with mdtraj.open(str(path)) as file:
            frames = len(file)
        number = frames - 1 if frame is None else frame + (frames if frame < 0 else 0)
        if not 0 <= number < frames:
            raise ValueError(f"there are {frames} frames, counted from 0, and no number {frame}")
        loaded = mdtraj.load_frame(str(path), number, top=mdtraj.load_topology(str(topology)))
    positions = loaded.xyz[0].astype(float)
    nodes, rings = filament_nodes(loaded), ring_filaments(loaded)
    controls = [None if own is None else own[0] for own in control_point_positions(loaded)]
    names = [loaded.topology.atom(int(own[0])).residue.name for own in nodes]
    return [(positions[own], bool(ring), each) for own, ring, each in zip(nodes, rings, controls)], names
