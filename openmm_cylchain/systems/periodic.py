"""Periodic boxes: filaments that were wrapped into the box node by node are made whole again.

Filaments may be longer than the box and cross it. Forces along a chain take its positions as they are, and what OpenMM
wraps (``enforcePeriodicBox``) it shifts as a whole, so nothing has to be done. Other programs wrap every particle or
residue by itself. Such positions must be made whole before a simulation starts from them, which pulls torn filaments
together otherwise, or stops, and before they are analysed.

Images of a node differ by lattice vectors, and no lattice vector is shorter than the narrowest width of the box, the
least of the diagonal elements of its vectors. So there is one image at most that is nearer to the node before it than
half that width, and that is the one to take.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from openmm import unit

from ..engines.description import filament_label
from ..errors import InputError
from ..filaments.collection import require_filaments
from ..filaments.grown import longest_segment
from ..filaments.topology_nodes import filament_nodes, require_trajectory
from ..units.quantities import LENGTH, in_units_of
from ..units.types import BoxVectors, Vectors
from .filaments import Filaments

if TYPE_CHECKING:
    import mdtraj


def make_whole(positions: Vectors, filaments: Filaments, box_vectors: BoxVectors) -> unit.Quantity:
    """Positions in which filaments are whole: each node is at the image that is nearest to the node before it.

    First nodes and particles outside filaments stay where they are; attachment points go with their segments.

    Parameters
    ----------
    positions : (particles, 3) or (frames, particles, 3) length
    filaments : Filaments
        In the System of these particles.
    box_vectors : three (3,) lengths, or (frames, 3, 3) length
        In OpenMM's form: the first along x, the second in the plane of x and y.

    Returns
    -------
    Quantity in nm
        Of the shape of the positions.

    Raises
    ------
    InputError
        If a segment is at least half as long as the box is wide, as it is or at rest, because there is no telling which
        image of its end belongs to it. If box vectors or positions are none, or not of these filaments.

    Examples
    --------
    >>> context.setPositions(make_whole(positions, filaments, box_vectors))  # doctest: +SKIP
    """
    require_filaments(filaments)
    given = np.asarray(in_units_of(positions, LENGTH, "positions"))
    own = [*filaments.node_indices, *filaments.control_point_indices, filaments.attachment_indices]
    last = int(np.concatenate(own).max(initial=-1))
    if given.ndim not in (2, 3) or given.shape[-1] != 3 or given.shape[-2] <= last:
        raise InputError(
            "positions must have the shape (particles, 3) or (frames, particles, 3) and hold the filaments, up to "
            f"particle {last}, but have the shape {given.shape}."
        )
    frames = given.reshape(-1, *given.shape[-2:]).copy()
    vectors = _lattice(box_vectors, len(frames))
    for number, (filament, nodes) in enumerate(zip(filaments, filaments.node_indices)):
        label = filament_label(number, filament)
        _refuse_ambiguous(np.full((len(frames), 1), longest_segment(filament)), vectors, f"{label} at rest")
        frames[:, nodes] = _whole_chains(frames[:, nodes], vectors, label)
        control_points = filaments.control_point_indices[number]
        if len(control_points):
            apart = frames[:, control_points] - frames[:, nodes]
            frames[:, control_points] -= _lattice_sums(_images_between(apart, vectors), vectors)
    for attachment, particle in zip(filaments.attachments, filaments.attachment_indices):
        nodes = filaments.node_indices[attachment.filament]
        minus, plus = (frames[:, nodes[(attachment.segment + end) % len(nodes)]] for end in (0, 1))
        place = (1.0 - attachment.fraction) * minus + attachment.fraction * plus
        frames[:, particle] -= _lattice_sums(_images_between(frames[:, particle] - place, vectors), vectors)
    return frames.reshape(given.shape) * unit.nanometer


def make_trajectory_whole(trajectory: mdtraj.Trajectory) -> mdtraj.Trajectory:
    """A copy of an mdtraj trajectory in which filaments are whole in every frame; see ``make_whole``.

    Filaments are found by the names of their nodes, see ``analysis``. An attachment point goes to the segment of its
    filament that it is nearest to.

    Parameters
    ----------
    trajectory : mdtraj.Trajectory
        With the vectors of its periodic box.

    Returns
    -------
    mdtraj.Trajectory

    Raises
    ------
    InputError
        If the trajectory has no box or no filaments, or a segment is at least half as long as the box is wide.
    """
    require_trajectory(trajectory)
    nodes_of = filament_nodes(trajectory)
    vectors = _trajectory_lattice(trajectory)
    positions = trajectory.xyz.astype(float)
    for number, nodes in enumerate(nodes_of):
        positions[:, nodes] = _whole_chains(positions[:, nodes], vectors, f"Filament {number}")
        for point in np.setdiff1d(_particles_of_chain(trajectory, nodes), nodes):
            positions[:, point] = _onto_chains(positions[:, point], positions[:, nodes], vectors)
    return _with_positions(trajectory, positions)


def remove_jumps(trajectory: mdtraj.Trajectory) -> mdtraj.Trajectory:
    """A copy of an mdtraj trajectory in which filaments are whole and go on from frame to frame without jumps.

    A filament's middle is taken to the image that is nearest to where it was in the frame before, so that it may leave
    the box and mean-square displacements are those of its motion. Frames must be so close that no filament moves by
    half a box between two of them.

    Parameters
    ----------
    trajectory : mdtraj.Trajectory
        With the vectors of its periodic box.

    Returns
    -------
    mdtraj.Trajectory

    Raises
    ------
    InputError
        As ``make_trajectory_whole``.
    """
    whole = make_trajectory_whole(trajectory)
    vectors = _trajectory_lattice(trajectory)[1:]
    positions = whole.xyz.astype(float)
    for nodes in filament_nodes(whole):
        middles = positions[:, nodes].mean(axis=1)
        jumps = _lattice_sums(_images_between(np.diff(middles, axis=0), vectors), vectors)
        positions[1:, _particles_of_chain(whole, nodes)] -= np.cumsum(jumps, axis=0)[:, None]
    return _with_positions(whole, positions)


def _particles_of_chain(trajectory, nodes):
    # A filament is a chain of the topology: its nodes, and attachment points and beads of whatever name.
    return [atom.index for atom in trajectory.topology.atom(int(nodes[0])).residue.chain.atoms]


def _with_positions(trajectory, positions):
    result = trajectory.slice(slice(None), copy=True)
    result.xyz = positions
    return result


def _trajectory_lattice(trajectory):
    if trajectory.unitcell_vectors is None:
        raise InputError("The trajectory has no periodic box: set its unitcell_vectors.")
    return _lattice(trajectory.unitcell_vectors.astype(float), trajectory.n_frames)


def _lattice(box_vectors, frames):
    # Box vectors (frames, 3, 3), checked.
    vectors = np.asarray(in_units_of(box_vectors, LENGTH, "box_vectors"))
    if vectors.shape not in ((3, 3), (frames, 3, 3)):
        raise InputError(
            f"box_vectors must be three vectors, or three for each of {frames} frames, but have the shape "
            f"{vectors.shape}."
        )
    vectors = np.broadcast_to(vectors, (frames, 3, 3))
    widths = np.diagonal(vectors, axis1=1, axis2=2)
    if np.any(widths <= 0):
        raise InputError(f"The box must be wider than zero along every axis, but is {widths.min(axis=0)} nm wide.")
    if np.any(np.abs(np.triu(vectors, 1)) > 1e-5 * widths.max()):
        raise InputError("The first of box_vectors must be along x and the second in the plane of x and y.")
    return vectors


def _images_between(differences, vectors):
    # How many lattice vectors to take off differences (frames, ..., 3): whole numbers of the same shape.
    remainder, counts = differences.copy(), np.zeros_like(differences)
    for axis in (2, 1, 0):
        edge = vectors[:, axis].reshape(len(vectors), *[1] * (differences.ndim - 2), 3)
        counts[..., axis] = np.round(remainder[..., axis] / edge[..., axis])
        remainder -= counts[..., axis, None] * edge
    return counts


def _lattice_sums(counts, vectors):
    return np.einsum("f...k,fkx->f...x", counts, vectors)


def _whole_chains(nodes, vectors, label):
    # Positions (frames, nodes, 3) of one filament. Whole numbers are summed up, so that no error grows along a chain.
    counts = np.cumsum(_images_between(np.diff(nodes, axis=1), vectors), axis=1)
    whole = nodes.copy()
    whole[:, 1:] -= _lattice_sums(counts, vectors)
    _refuse_ambiguous(np.linalg.norm(np.diff(whole, axis=1), axis=2), vectors, label)
    return whole


def _refuse_ambiguous(lengths, vectors, label):
    widths = np.diagonal(vectors, axis1=1, axis2=2).min(axis=1)
    too_long = lengths >= 0.5 * widths[:, None]
    if np.any(too_long):
        frame, segment = np.argwhere(too_long)[0]
        where = f" in frame {frame}" if len(vectors) > 1 else ""
        raise InputError(
            f"{label}{where}: segment {segment} is {lengths[frame, segment]:.4g} nm long, and the box "
            f"{widths[frame]:.4g} nm wide. Only segments shorter than half the box can be made whole: check the box "
            "vectors, or take shorter segments."
        )


def _onto_chains(points, nodes, vectors):
    # The images of points (frames, 3) that are nearest to the nearest segment of a chain (frames, nodes, 3).
    minus, segments = nodes[:, :-1], np.diff(nodes, axis=1)
    images = points[:, None] - minus - 0.5 * segments
    images = points[:, None] - _lattice_sums(_images_between(images, vectors), vectors)
    along = np.sum((images - minus) * segments, axis=2) / np.sum(segments**2, axis=2)
    places = minus + np.clip(along, 0.0, 1.0)[..., None] * segments
    nearest = np.argmin(np.linalg.norm(images - places, axis=2), axis=1)
    return images[np.arange(len(points)), nearest]
