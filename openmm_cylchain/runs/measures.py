"""What a run of its kind is made for: order, bundles and contraction of a network, the speed of gliding, forces."""

import math
import warnings
from dataclasses import dataclass

import numpy as np
import scipy

from .. import analysis
from ..analysis.statistics import mean_with_error
from ..errors import InputError, PrecisionWarning
from ..mechanics.geometry import segment_vectors
from ..output.colors import PLUS_END
from ..output.run_files import RunFiles
from ..output.run_tables import MILLISECOND
from ..units.quantities import thermal_energy
from .growth_summary import ENDS, GrowthTable, rate_of_gains
from .summary import group_members, is_in_equilibrium, mean_over_filaments
from .tables.linkers import binds_to

_BUNDLE_ANGLE, _BUNDLE_OVERLAP = math.radians(20.0), 0.4
"""At most between filaments side by side, and the share of the shortest one that is so."""
_FEWEST_OF_NETWORK, _FRAMES_OF_COURSE = 8, 40
_SECOND = 1e12
"""In ps."""

ORDER = "nematic order of filaments"
BUNDLED = "share of filaments in bundles"
JOINED = "share of filaments in the largest joined network"
GYRATION = "radius of gyration of all filaments"
GLIDING = {1.0: f"gliding speed, {PLUS_END} ahead", -1.0: "gliding speed, first node (minus end) ahead"}
PULLING = "force of moving tethers along their velocity"
WALLS = "sum of forces of walls"
CONTACTS = "sum of forces of contacts on a filament"
GROWN = "mean length of filaments that grow"
GROWTH = {end: f"growth of {end} ends" for end in ENDS}
MEASURES = {
    **dict.fromkeys((ORDER, BUNDLED, JOINED), ""),
    **dict.fromkeys((GYRATION, GROWN), "nm"),
    **dict.fromkeys((*GLIDING.values(), *GROWTH.values()), "nm/s"),
    **dict.fromkeys((PULLING, WALLS, CONTACTS), "pN"),
}
"""Their units by their names."""


@dataclass(frozen=True)
class Measure:
    """A number about all of a run.

    Attributes
    ----------
    first, last : float or None
        In the first and in the last frame.
    mean, standard_error : float or None
        Over the second half of the run.
    """

    name: str
    unit: str
    first: float | None = None
    last: float | None = None
    mean: float | None = None
    standard_error: float | None = None


@dataclass(frozen=True)
class Course:
    """What a network does: values by their names, at times in ms. Lengths are those over the first one."""

    times: np.ndarray
    shares: dict


def load_run(directory):
    """The Run in a directory, see ``analysis.load``."""
    with warnings.catch_warnings():
        # The notes of the summary say it.
        warnings.simplefilter("ignore", PrecisionWarning)
        return analysis.load(directory.path)


def measure(configuration, run):
    """What matters of a run that is complete: a list of Measure, empty for free filaments; see ``load_run``."""
    ends = (0, len(run) - 1)
    found = [
        *(
            (name, {end: value for end, value in zip(("first", "last"), values) if math.isfinite(value)})
            for name, values in _of_networks(configuration, run, ends)
        ),
        *_of_gliding(configuration, run),
        *_of_forces(configuration, run),
        *_of_growth(configuration, run),
    ]
    return [Measure(name, MEASURES[name], **values) for name, values in found]


def course(configuration, run):
    """The Course of a network of filaments in up to forty frames; None where filaments are not one."""
    if len(run.filaments) < _FEWEST_OF_NETWORK or any(map(is_in_equilibrium, configuration.filaments)):
        return None
    frames = np.unique(np.linspace(0, len(run) - 1, min(len(run), _FRAMES_OF_COURSE)).round().astype(int)).tolist()
    found = dict(_of_networks(configuration, run, frames))
    if not found:
        return None
    if GYRATION in found:
        radii = np.array(found.pop(GYRATION))
        there = radii[np.isfinite(radii)]
        found["radius of gyration of all, over that at the start"] = radii / there[0] if len(there) else radii
    return Course(run.times[frames] / MILLISECOND, found)


def _of_networks(configuration, run, frames):
    # Names with their values in frames: NaN where no filament is there.
    joined = bool(configuration.linkers or configuration.links or configuration.contacts or configuration.walls)
    if len(run.filaments) < 2 or not (joined or any(group.propulsion for group in configuration.filaments)):
        return
    yield ORDER, [_order(run, frame) for frame in frames]
    free = [own.kind for own in configuration.linkers if own.anchors is None]
    if free:
        kT = thermal_energy(configuration.solvent.temperature)
        gap = min(kind.rest_length + 2.0 * math.sqrt(kT / kind.stiffness) for kind in free)
        overlap = _BUNDLE_OVERLAP * _shortest(run)
        try:
            yield BUNDLED, [_bundled(run, frame, gap, overlap) for frame in frames]
        except InputError:
            # A periodic box that is narrower than two segments has no neighbours that are known.
            pass
        yield JOINED, [_joined(run, frame) for frame in frames]
    if run.box is None:
        yield GYRATION, [_radius(run, frame) for frame in frames]


def _shortest(run):
    # At rest, and of filaments that grow at the start.
    lengths = [
        own.type.segment_lengths(own.segments, own.ring).sum() for own in run.filaments if not own.monomer_length
    ]
    grown = run.growth["length (nm)"][0] if run.growth else np.zeros(0)
    return float(min([*lengths, *grown[grown > 0.0]], default=0.0))


def _order(run, frame):
    vectors = [segment_vectors(own, each.ring) for each, own in zip(run.filaments, run.curves(frame))]
    return analysis.order_parameter(np.concatenate(vectors)) if any(map(len, vectors)) else math.nan


def _bundled(run, frame, gap, overlap):
    bundles = analysis.find_bundles(run, frame, gap, _BUNDLE_ANGLE, overlap)
    return sum(map(len, bundles)) / max(1, _count(run, frame))


def _joined(run, frame):
    # Filaments that linkers with both hands bound join, one by the other.
    pairs = run.linkers[frame]["filaments"]
    pairs = pairs[(pairs >= 0).all(axis=1)]
    count = len(run.filaments)
    graph = scipy.sparse.coo_array((np.ones(len(pairs)), pairs.T), (count, count))
    _, label = scipy.sparse.csgraph.connected_components(graph, directed=False)
    largest = int(np.bincount(label).max())
    return largest / _count(run, frame) if largest > 1 else 0.0


def _count(run, frame):
    return sum(1 for own in run.nodes(frame) if len(own))


def _radius(run, frame):
    points = np.concatenate(run.curves(frame))
    return math.sqrt(float(np.var(points, axis=0).sum())) if len(points) else math.nan


def _of_gliding(configuration, run):
    anchored = [own for own in configuration.linkers if own.anchors is not None]
    members = [
        number
        for group, numbers in zip(configuration.filaments, group_members(configuration))
        if not (group.closed or group.clamped) and (group.propulsion or binds_to(group, anchored))
        for number in numbers
    ]
    first = len(run) // 2
    if not members or len(run) - first < 3:
        return
    nodes = [run.nodes(frame) for frame in range(first, len(run))]
    members = [number for number in members if all(len(own[number]) for own in nodes)]
    if not members:
        return
    nodes = [[own[number] for number in members] for own in nodes]
    ends = np.array([[(own[0], own[-1]) for own in frame] for frame in nodes])
    centers = np.array([[0.5 * (own[1:] + own[:-1]).mean(axis=0) for own in frame] for frame in nodes])
    axes = ends[:, :, 1] - ends[:, :, 0]
    axes = axes[1:] + axes[:-1]
    axes /= np.linalg.norm(axes, axis=2, keepdims=True)
    times = np.diff(run.times[first:])[:, None] / _SECOND
    mean, error = mean_over_filaments(np.sum(np.diff(centers, axis=0) * axes, axis=2) / times)
    yield GLIDING[math.copysign(1.0, mean)], {"mean": abs(mean), "standard_error": error}


def _of_forces(configuration, run):
    # Means over the steps between frames are none in the first one.
    for name, table, column in (
        (PULLING, run.pulling, "force along the velocity (pN)"),
        (WALLS, run.wall_forces, "load (pN)"),
        (CONTACTS, run.contact_forces, "load (pN)"),
    ):
        late = table[column][max(1, len(run) // 2) :] if table else []
        if len(late) > 1:
            values = late.sum(axis=1) if name == WALLS else late.mean(axis=1)
            mean, error = mean_with_error(values)
            yield name, {"mean": mean, "standard_error": error}


def _of_growth(configuration, run):
    growing = [group for group in configuration.filaments if group.growth is not None]
    if not growing:
        return
    table = GrowthTable(RunFiles(run.path))
    lengths, late, there = table.column("length (nm)"), slice(len(table.times) // 2, None), table.there()
    if there.all():
        found = {"first": float(lengths[0].mean()), "last": float(lengths[-1].mean())}
        if len(lengths[late]) > 1:
            found["mean"], found["standard_error"] = mean_over_filaments(lengths[late])
        yield GROWN, found
    sizes = np.concatenate([np.full(group.count, group.growth.monomers.length) for group in growing])
    for end, name in GROWTH.items():
        if len(lengths[late]) > 2 and any(group.growth.states(end).grows for group in growing):
            mean, error = rate_of_gains(table, end, late=late, sizes=sizes)
            if np.isfinite(mean):
                yield name, {"mean": mean, "standard_error": error}
