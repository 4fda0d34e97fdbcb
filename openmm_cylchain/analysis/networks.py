"""Networks of filaments: distances, contacts and bundles of filaments, mesh size, contraction against time."""

from __future__ import annotations

import math

import numpy as np
import scipy

from ..errors import InputError
from ..mechanics.geometry import segment_vectors
from ..units.quantities import ANGLE, LENGTH, non_negative, positive
from ..units.types import BoolArray, FloatArray, IntArray, Scalar
from .crossings import pairs_of_points, segment_distances
from .runs import Run, require_run, volume_of


def filament_distances(run: Run, frame: int, cutoff: Scalar) -> FloatArray:
    """Shortest distances between the axes of all pairs of filaments in a frame, as far as they are within a cutoff.

    In a periodic box they are between the nearest of all images.

    Parameters
    ----------
    run : Run
    frame : int
    cutoff : length

    Returns
    -------
    (filaments, filaments) array
        In nm, symmetric; infinite beyond the cutoff and to filaments that are not there, 0 on the diagonal.

    Raises
    ------
    InputError
        For a cutoff that with the longest segment exceeds the width of the periodic box.
    """
    require_run(run)
    cutoff = positive(cutoff, LENGTH, "cutoff")
    near = _NearSegments(run, frame, cutoff)
    owners, first, second, distances = near.owners, near.first, near.second, near.distances
    result = np.full((len(run.filaments),) * 2, np.inf)
    np.minimum.at(result, (owners[first], owners[second]), distances)
    result = np.minimum(result, result.T)
    np.fill_diagonal(result, 0.0)
    return result


class _NearSegments:
    # All segments, or pieces of beam elements, and the pairs of those of two filaments within a cutoff.

    def __init__(self, run, frame, cutoff):
        lines = run.curves(frame)
        starts = np.concatenate([own if filament.ring else own[:-1] for filament, own in zip(run.filaments, lines)])
        self.vectors = np.concatenate([segment_vectors(own, each.ring) for each, own in zip(run.filaments, lines)])
        counts = [max(0, len(own) - (not each.ring)) for each, own in zip(run.filaments, lines)]
        self.owners = np.repeat(np.arange(len(counts)), counts)
        # Two segments within the cutoff have middles within that and half of their lengths.
        reach = cutoff + float(np.linalg.norm(self.vectors, axis=1).max(initial=0.0))
        pairs = pairs_of_points(starts + 0.5 * self.vectors, reach, run.box)
        pairs = pairs.where(self.owners[pairs.first] != self.owners[pairs.second])
        between = starts[pairs.second] + pairs.shift - starts[pairs.first]
        distances = segment_distances(self.vectors[pairs.first], self.vectors[pairs.second], between)
        near = distances <= cutoff
        self.first, self.second, self.distances = pairs.first[near], pairs.second[near], distances[near]


def contact_map(run: Run, frame: int, gap: Scalar = 0.0) -> BoolArray:
    """Which filaments touch, or come within a gap of their surfaces: (filaments, filaments) bool array.

    Its diagonal is False.

    Parameters
    ----------
    run : Run
    frame : int
    gap : length
        Between surfaces, from which the diameters are taken; 0 for contact.
    """
    require_run(run)
    gap = non_negative(gap, LENGTH, "gap")
    radii = 0.5 * np.array([own.diameter for own in run.filaments])
    reach = radii[:, None] + radii[None] + gap
    near = filament_distances(run, frame, float(reach.max())) <= reach
    np.fill_diagonal(near, False)
    return near


def find_bundles(run: Run, frame: int, gap: Scalar, angle: Scalar, overlap: Scalar) -> list[IntArray]:
    """Bundles of filaments: those that run side by side, and what runs beside these.

    Two filaments are in one bundle if each has segments of at least the length ``overlap`` in all that come within a
    gap of the other's surface and are aligned with it there to within an angle, whichever way they point.

    Parameters
    ----------
    run : Run
    frame : int
    gap : length
        Between surfaces, beside the diameters: that of a crosslinker with what it fluctuates.
    angle : angle
        Largest one of two segments side by side, up to 90 degrees; a number is in radians.
    overlap : length
        Along the contour, such as a fifth of a filament; 0 for any.

    Returns
    -------
    list of int arrays
        Numbers of the filaments of each bundle, from the bundle with the most to that with the fewest, two at least.

    Raises
    ------
    InputError
        For a gap that with diameter and longest segment exceeds the width of the periodic box; bad lengths or angle.
    """
    require_run(run)
    gap, overlap = non_negative(gap, LENGTH, "gap"), non_negative(overlap, LENGTH, "overlap")
    angle = positive(angle, ANGLE, "angle")
    if angle > 0.5 * math.pi:
        raise InputError(f"angle must be at most 90 degrees, but is {math.degrees(angle):g} degrees.")
    radii = 0.5 * np.array([own.diameter for own in run.filaments])
    near = _NearSegments(run, frame, 2.0 * float(radii.max()) + gap)
    first, second = near.first, near.second
    lengths = np.linalg.norm(near.vectors, axis=1)
    cosines = np.abs(np.einsum("ni,ni->n", near.vectors[first], near.vectors[second]))
    aligned = cosines >= (math.cos(angle) - 1e-12) * lengths[first] * lengths[second]
    close = near.distances <= radii[near.owners[first]] + radii[near.owners[second]] + gap
    first, second = first[aligned & close], second[aligned & close]
    # How much of each filament (row) runs beside each other one (column); a segment counts once for a filament.
    beside = np.unique(
        np.concatenate([[first, near.owners[second]], [second, near.owners[first]]], axis=1).astype(int), axis=1
    )
    count = len(run.filaments)
    shared = scipy.sparse.coo_array((lengths[beside[0]], (near.owners[beside[0]], beside[1])), (count, count)).tocsr()
    joined = shared.minimum(shared.T) >= overlap if overlap > 0.0 else shared > 0.0
    number, label = scipy.sparse.csgraph.connected_components(joined, directed=False)
    bundles = [np.flatnonzero(label == each) for each in range(number)]
    return sorted((own for own in bundles if len(own) > 1), key=lambda own: -len(own))


def mesh_size(run: Run, volume: Scalar | None = None) -> float:
    """The mesh size ``xi = (3/rho)^(1/2)`` in nm, with the contour length rho of filaments per volume, at rest.

    It is the edge of a cubic lattice of straight filaments along its axes with this density (one edge along each of
    three directions for each cell of the volume xi^3): Schmidt, Baermann, Isenberg and Sackmann, Macromolecules 1989,
    22, 3638.

    Parameters
    ----------
    run : Run
    volume : volume, optional
        That of the periodic box if not given.

    Raises
    ------
    InputError
        Without a periodic box and a volume, and where filaments grow, come or go.
    """
    room = volume_of(run, volume)
    if any(own.monomer_length for own in run.filaments) or run.passing:
        raise InputError("Filaments grow, come or go, and the mesh size changes: take the lengths in Run.growth.")
    length = sum(float(own.type.segment_lengths(own.segments, own.ring).sum()) for own in run.filaments)
    return math.sqrt(3.0 * room / length)


def contraction(run: Run) -> FloatArray:
    """The radius of gyration of all nodes over that of the first frame with any: (frames,) array, NaN without any.

    For networks without a periodic box, where filaments may leave a volume; all nodes have one weight.

    Raises
    ------
    InputError
        In a periodic box, whose size does not change.
    """
    require_run(run)
    if run.box is not None:
        raise InputError("A periodic box does not contract: look at contacts or distances instead.")
    points = (np.concatenate([np.zeros((0, 3)), *run.curves(frame)]) for frame in range(len(run)))
    radii = np.array([math.sqrt(float(np.var(own, axis=0).sum())) if len(own) else np.nan for own in points])
    there = np.flatnonzero(np.isfinite(radii))
    return radii / radii[there[0]] if len(there) else radii
