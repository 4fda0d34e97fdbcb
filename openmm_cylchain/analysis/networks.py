"""Networks of filaments: distances and contacts of filaments, mesh size, and contraction against time."""

import math

import numpy as np

from ..errors import InputError
from ..mechanics.geometry import segment_vectors
from ..units.quantities import LENGTH, VOLUME, non_negative, positive
from ..units.types import BoolArray, FloatArray, Scalar
from .crossings import pairs_of_points, segment_distances
from .runs import Run


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
        In nm, symmetric; infinite beyond the cutoff, 0 on the diagonal.

    Raises
    ------
    InputError
        For a cutoff that with the longest segment exceeds the width of the periodic box.
    """
    cutoff = positive(cutoff, LENGTH, "cutoff")
    nodes = run.nodes(frame)
    starts = np.concatenate([own if filament.ring else own[:-1] for filament, own in zip(run.filaments, nodes)])
    vectors = np.concatenate([segment_vectors(own, filament.ring) for filament, own in zip(run.filaments, nodes)])
    owners = np.repeat(np.arange(len(run.filaments)), [own.segments for own in run.filaments])
    middles = starts + 0.5 * vectors
    # Two segments within the cutoff have middles within that and half of their lengths.
    reach = cutoff + float(np.linalg.norm(vectors, axis=1).max())
    pairs = pairs_of_points(middles, reach, run.box)
    pairs = pairs.where(owners[pairs.first] != owners[pairs.second])
    first, second = pairs.first, pairs.second
    distances = segment_distances(vectors[first], vectors[second], starts[second] + pairs.shift - starts[first])
    result = np.full((len(run.filaments),) * 2, np.inf)
    near = distances <= cutoff
    np.minimum.at(result, (owners[first[near]], owners[second[near]]), distances[near])
    result = np.minimum(result, result.T)
    np.fill_diagonal(result, 0.0)
    return result


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
    gap = non_negative(gap, LENGTH, "gap")
    radii = 0.5 * np.array([own.diameter for own in run.filaments])
    reach = radii[:, None] + radii[None] + gap
    near = filament_distances(run, frame, float(reach.max())) <= reach
    np.fill_diagonal(near, False)
    return near


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
        Without a periodic box and a volume.
    """
    if volume is None:
        if run.box is None:
            raise InputError("There is no periodic box: give the volume in which the filaments are.")
        room = float(np.linalg.det(run.box))
    else:
        room = positive(volume, VOLUME, "volume")
    length = sum(float(own.type.segment_lengths(own.segments, own.ring).sum()) for own in run.filaments)
    return math.sqrt(3.0 * room / length)


def contraction(run: Run) -> FloatArray:
    """The radius of gyration of all nodes over that of the first frame: (frames,) array.

    For networks without a periodic box, where filaments may leave a volume; all nodes have one weight.

    Raises
    ------
    InputError
        In a periodic box, whose size does not change.
    """
    if run.box is not None:
        raise InputError("A periodic box does not contract: look at contacts or distances instead.")
    radii = [math.sqrt(float(np.var(np.concatenate(run.nodes(frame)), axis=0).sum())) for frame in range(len(run))]
    return np.array(radii) / radii[0]
