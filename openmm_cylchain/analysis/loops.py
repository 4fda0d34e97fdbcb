"""Loops of long filaments: contact probability P(s), sparse contact maps, and the loops that linkers hold."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np
import scipy

from ..errors import InputError
from ..output.files import check_path
from ..units.quantities import LENGTH, positive, shown, whole_number
from ..units.types import FloatArray, IntArray, Scalar
from .crossings import pairs_of_points
from .runs import Run, require_run

_CHROMOSOME = re.compile("[!-9;-~]+")


@dataclass(frozen=True)
class ContactProbability:
    """How likely two places along a filament are in contact, by the length s of filament between them.

    Attributes
    ----------
    separations : (bins,) array
        s in nm: the geometric mean of the separations of nodes in each bin.
    values : (frames, bins) array
        Of each frame: the share of pairs of nodes that are in contact, of all pairs in a bin.
    """

    separations: FloatArray
    values: FloatArray

    @property
    def mean(self) -> FloatArray:
        """P(s), the mean over frames: (bins,) array. ``statistics`` has errors of means of series."""
        return self.values.mean(axis=0)


def contact_probability(
    run: Run, cutoff: Scalar, frames: range | None = None, bins_per_decade: int = 10
) -> ContactProbability:
    """The probability P(s) that two nodes of a filament with the contour length s between them are within a cutoff.

    All filaments of a run count, those of all lengths; along a ring, s is the shorter way. Nodes stand for the places
    of filaments, so segments should be shorter than the cutoff.

    Parameters
    ----------
    run : Run
        Whose filaments do not grow, and have segments of one length.
    cutoff : length
    frames : range, optional
        Numbers of frames; all if not given.
    bins_per_decade : int
        Bins in the logarithm of s. Near neighbours have a bin each.

    Raises
    ------
    InputError
        For filaments that grow, or whose segments differ in length, and a cutoff beyond the width of the periodic box.
    """
    own = _frames(run, frames)
    cutoff = positive(cutoff, LENGTH, "cutoff")
    per_decade = whole_number(bins_per_decade, 1, "bins_per_decade")
    length = _segment_length(run)
    longest = max(len(each.nodes) // 2 if each.ring else len(each.nodes) - 1 for each in run.filaments)
    decades = np.log10(longest + 1)
    edges = np.unique(np.round(np.logspace(0.0, decades, int(np.ceil(per_decade * decades)) + 1))).astype(int)
    possible = np.zeros(longest + 1)
    for each in run.filaments:
        possible += _pairs_by_separation(len(each.nodes), each.ring, longest)
    bin_of = np.searchsorted(edges, np.arange(longest + 1), side="right") - 1
    inside = np.arange(longest + 1) >= 1
    pairs_in_bins = np.bincount(bin_of[inside], possible[inside], len(edges) - 1)
    logarithms = np.bincount(bin_of[inside], (possible * np.log(np.maximum(np.arange(longest + 1), 1)))[inside])
    counts = np.array([len(each.nodes) for each in run.filaments])
    rings = np.array([each.ring for each in run.filaments])
    rows = []
    for first, second in _contacts(run, own, cutoff):
        same = first.filament == second.filament
        filament, separations = first.filament[same], np.abs(second.along - first.along)[same]
        around = np.minimum(separations, counts[filament] - separations)
        separations = np.where(rings[filament], around, separations)
        rows.append(np.bincount(bin_of[separations], minlength=len(edges) - 1) / pairs_in_bins)
    return ContactProbability(length * np.exp(logarithms / pairs_in_bins), np.array(rows))


def contact_counts(
    run: Run, cutoff: Scalar, bin_length: Scalar | None = None, frames: range | None = None
) -> scipy.sparse.csr_array:
    """How many pairs of nodes are within a cutoff, summed over frames, by the places of both along all filaments.

    A map as that of a Hi-C experiment: symmetric and sparse. Its bins are stretches of filaments, one filament behind
    the other, the last bin of each filament maybe shorter. A pair within a bin counts once, on the diagonal. Frames are
    taken one after the other: the memory is that of the pairs of one frame, and of the map.

    Parameters
    ----------
    run : Run
        Whose filaments do not grow, and have segments of one length.
    cutoff : length
    bin_length : length, optional
        Along filaments, rounded to a whole number of segments; a node has a bin of its own if not given.
    frames : range, optional
        Numbers of frames; all if not given.

    Returns
    -------
    (bins, bins) scipy.sparse.csr_array of int64
    """
    own = _frames(run, frames)
    cutoff, length = positive(cutoff, LENGTH, "cutoff"), _segment_length(run)
    size = 1
    if bin_length is not None:
        size = max(1, round(positive(bin_length, LENGTH, "bin_length") / length))
    counts = np.array([len(each.nodes) for each in run.filaments])
    bins = -(-counts // size)
    starts = np.cumsum(bins) - bins
    total = int(bins.sum())
    result = scipy.sparse.csr_array((total, total), dtype=np.int64)
    for pair in _contacts(run, own, cutoff):
        rows, columns = (starts[nodes.filament] + nodes.along // size for nodes in pair)
        apart = rows != columns
        both = np.concatenate([rows, columns[apart]]), np.concatenate([columns, rows[apart]])
        ones = np.ones(len(both[0]), dtype=np.int64)
        result = result + scipy.sparse.coo_array((ones, both), (total, total)).tocsr()
    return result


def write_cooler(
    run: Run,
    path: str | Path,
    cutoff: Scalar,
    base_pairs: int,
    bin_size: int | None = None,
    frames: range | None = None,
    names: Sequence[str] | None = None,
) -> None:
    """Write the sparse map of ``contact_counts`` as a file of cooler, which programs for Hi-C read.

    Filaments are chromosomes. A node stands for the segment that begins there, so that an open filament has the base
    pairs of one segment more than it has. Counts are pairs of nodes summed over frames, the upper half of the symmetric
    map, and not balanced; a pair within a bin counts once. The metadata have ``cutoff_nm`` and the number of
    ``frames``. ``cooler.merge_coolers`` adds the maps of several runs. See Abdennur and Mirny, Bioinformatics 2020, 36,
    311.

    Parameters
    ----------
    run : Run
        Whose filaments do not grow, and have segments of one length.
    path : str or Path
        Ends in ``.cool``.
    cutoff : length
    base_pairs : int
        In a segment: its length over 0.34 nm for B-DNA, or those of a coarser model. Bins of cooler begin at whole
        base pairs.
    bin_size : int, optional
        Base pairs in a bin, whole segments; those of one segment if not given.
    frames : range, optional
        Numbers of frames; all if not given.
    names : sequence of str, optional
        Of chromosomes, one for each filament; ``filament_0`` and so on if not given.

    Raises
    ------
    InputError
        As ``contact_counts``; for bins that are not whole segments, names that are not those of chromosomes, filaments
        of more than 2^31 - 1 base pairs; and if the package cooler is not installed.
    """
    path = check_path(path, ".cool")
    try:
        import cooler
        import pandas
    except ImportError:
        raise InputError("Files of cooler need the package cooler: install it by pip install cooler.") from None
    own, cutoff, length = _frames(run, frames), positive(cutoff, LENGTH, "cutoff"), _segment_length(run)
    largest = np.iinfo(np.int32).max
    base_pairs = whole_number(base_pairs, 1, "base_pairs", largest)
    size = base_pairs if bin_size is None else whole_number(bin_size, 1, "bin_size", largest)
    if size % base_pairs:
        raise InputError(f"bin_size must be whole segments of {base_pairs} base pairs, but is {size}.")
    chromosomes = _chromosome_names(names, len(run.filaments))
    ends = base_pairs * np.array([len(each.nodes) for each in run.filaments])
    if ends.max() > largest:
        raise InputError(f"Files of cooler have 2^31 - 1 base pairs at most, but filament {ends.argmax()} has more.")
    starts = [np.arange(0, end, size) for end in ends]
    bins = pandas.DataFrame(
        {
            "chrom": np.repeat(chromosomes, [len(each) for each in starts]),
            "start": np.concatenate(starts),
            "end": np.concatenate([np.append(each[1:], end) for each, end in zip(starts, ends)]),
        }
    )
    upper = scipy.sparse.triu(contact_counts(run, cutoff, size // base_pairs * length, own), format="coo")
    pixels = pandas.DataFrame({"bin1_id": upper.row, "bin2_id": upper.col, "count": upper.data})
    metadata = {"cutoff_nm": cutoff, "frames": len(own)}
    temporary = path.with_name(f".{path.stem}.new.cool")
    try:
        # By default, counts would be of 32 bits.
        cooler.create_cooler(str(temporary), bins, pixels, dtypes={"count": np.int64}, metadata=metadata)
        temporary.replace(path)
    finally:
        temporary.unlink(missing_ok=True)


def loop_lengths(run: Run, frame: int, kind: int | None = None) -> FloatArray:
    """Lengths of the loops that linkers hold, with both hands on one filament: (loops,) array in nm.

    Along a ring, the shorter way.

    Parameters
    ----------
    run : Run
    frame : int
    kind : int, optional
        Number of a type of linkers; all if not given.
    """
    require_run(run)
    records = run.linkers[frame]
    filaments = records["filaments"]
    held = (filaments[:, 0] >= 0) & (filaments[:, 0] == filaments[:, 1])
    if kind is not None:
        held &= records["type"] == whole_number(kind, 0, "kind")
    lengths = np.abs(np.diff(records["arc_lengths"][held], axis=1)[:, 0])
    contours = np.array([float(own.type.segment_lengths(own.segments, own.ring).sum()) for own in run.filaments])
    rings = np.array([own.ring for own in run.filaments], dtype=bool)
    on = filaments[held, 0]
    return np.where(rings[on], np.minimum(lengths, contours[on] - lengths), lengths)


def _frames(run, frames):
    require_run(run)
    own = range(len(run)) if frames is None else frames
    if not len(own) or min(own) < 0 or max(own) >= len(run):
        raise InputError(f"frames must be numbers of frames, of which there are {len(run)}.")
    return own


def _segment_length(run):
    if any(own.monomer_length for own in run.filaments) or run.passing:
        raise InputError("Filaments grow, come or go: their nodes are not the same places along them in all frames.")
    lengths = {own.type.segment_length for own in run.filaments}
    if len(lengths) != 1:
        raise InputError(f"Filaments must have segments of one length, but have {sorted(lengths)} nm.")
    return lengths.pop()


def _chromosome_names(names: Sequence[str] | None, filaments: int) -> list[str]:
    if names is None:
        return [f"filament_{number}" for number in range(filaments)]
    # Regions of cooler are asked for as name:start-end.
    known = isinstance(names, Sequence) and all(isinstance(each, str) and _CHROMOSOME.fullmatch(each) for each in names)
    if isinstance(names, str) or not known or not len(names) == len(set(names)) == filaments:
        raise InputError(
            f"names must be {filaments} different ones, one for each filament, of ASCII without colons and spaces, "
            f"but are {shown(names)}."
        )
    return list(names)


def _pairs_by_separation(nodes: int, ring: bool, longest: int) -> FloatArray:
    separations = np.arange(longest + 1)
    if not ring:
        return np.maximum(nodes - separations, 0) * (separations > 0)
    halves = np.where(2 * separations == nodes, 0.5, 1.0)
    return nodes * halves * (separations > 0) * (2 * separations <= nodes)


class _Nodes(NamedTuple):
    filament: IntArray
    along: IntArray


def _contacts(run: Run, frames: range, cutoff: float) -> Iterator[tuple[_Nodes, _Nodes]]:
    # Of each frame, pairs of nodes: the filaments of the first and the second ones, and their numbers along these.
    counts = np.array([len(own.nodes) for own in run.filaments])
    filament = np.repeat(np.arange(len(counts)), counts)
    along = np.arange(counts.sum()) - (np.cumsum(counts) - counts)[filament]
    for frame in frames:
        pairs = pairs_of_points(np.concatenate(run.nodes(frame)), cutoff, run.box)
        first, second = (_Nodes(filament[nodes], along[nodes]) for nodes in (pairs.first, pairs.second))
        yield first, second
