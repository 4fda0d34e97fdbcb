"""The summary of a run: observables of its trajectory against theory."""

import math
import warnings
from dataclasses import dataclass

import mdtraj
import numpy as np

from .. import theory
from ..analysis.bending import bending_drift, joint_cosines, persistence_length
from ..analysis.filament_shapes import control_point_positions, end_to_end_vectors, node_positions, segment_lengths
from ..analysis.run_topology import read_topology
from ..analysis.statistics import FEWEST_FRAMES_OF_DRIFT, SIGNIFICANT_DRIFT, mean_with_error, statistical_inefficiency
from ..bead_spring.bead_spring_type import BEAD_BONDS
from ..beams.curve import element_energies
from ..errors import EquilibrationWarning, InputError
from ..filaments.beam_elements import BEAM_ELEMENTS
from ..filaments.equilibrium import SegmentLengthDistribution
from ..filaments.straight_segments import STRAIGHT_SEGMENTS
from ..output.dcd_frames import DCDFrames
from ..theory import beam_elements
from ..units.quantities import thermal_energy
from .description import loads_of_filaments
from .silence import silenced_c_library
from .stages import frame_times

_STRETCHING, _STRETCHING_OF_ELEMENTS = "stretching energy per segment", "stretching energy per element"
_WORMLIKE = "the same, theory of the wormlike chain (25)"
_EXTENSION = "extension along the tension, second half of the run"
_ROUNDING_OF_STRETCHING, _ROUNDING_OF_ALL = 0.01, 1.0
"""Beyond which share of its thermal energy, that of stretching, or nothing at all, is compared with theory."""
_ENOUGH_FILAMENTS = 8
NOT_COMPARABLE = "not comparable"
AGREEMENT_SIGMA = 3.0
AGREEMENT_FRACTION = 0.05
_DISTURBANCES = {
    "linkers": "linkers bind to these filaments",
    "links": "links join them",
    "joints": "joints hold their directions",
    "bodies": "rigid bodies hold them",
    "contacts": "contacts keep them apart",
    "walls": "walls confine them",
    "forces": "constant forces pull at them",
    "frames": "their twist is held",
    "tethers": "tethers hold them in several places",
    "flow": "the solvent flows",
    "propulsion": "they propel themselves",
    "rest_bends": "their joints are bent at rest",
}


@dataclass(frozen=True)
class Observable:
    """An average over a run and what theory says.

    Attributes
    ----------
    theory : float
        Exact value for the free discrete chain in equilibrium, unless the name says otherwise.
    deviation : float or None
        (value - theory) in standard errors; None without an error.
    relative_deviation : float or None
        (value - theory)/theory.
    verdict : str
        "agrees" (within 3 standard errors), "within 5 %", "differs", "reference" (theory of another model) or
        "not comparable".
    """

    name: str
    unit: str
    value: float
    standard_error: float
    theory: float
    deviation: float
    relative_deviation: float
    verdict: str


@dataclass(frozen=True)
class GroupSummary:
    """Observables of the filaments of one [[filament]] table, and remarks on how to read them."""

    label: str
    type: str
    filaments: int
    segments: int
    start: str
    in_equilibrium: bool
    observables: tuple
    notes: tuple


def load_trajectory(configuration, directory):
    """The trajectory of a run as an mdtraj.Trajectory with its times in ps."""
    topology = read_topology(directory.topology, DCDFrames(directory.trajectory).particles)
    with silenced_c_library():
        trajectory = mdtraj.load_dcd(str(directory.trajectory), top=topology)
    trajectory.time = frame_times(configuration)[: trajectory.n_frames]
    return trajectory


def group_members(configuration):
    """Filament numbers that belong to each [[filament]] table: a list of ranges."""
    ends = np.cumsum([0] + [group.count for group in configuration.filaments])
    return [range(first, last) for first, last in zip(ends[:-1], ends[1:])]


def group_labels(configuration):
    """A short name for each [[filament]] table, distinct if there are several."""
    labels = [_label(group) for group in configuration.filaments]
    loads = loads_of_filaments(configuration)
    of_groups = [list(dict.fromkeys(loads[number] for number in own)) for own in group_members(configuration)]
    if len(set(labels)) < len(labels) and any(loads) and all(len(own) == 1 for own in of_groups):
        labels = [f"{label}, {load}" for label, (load,) in zip(labels, of_groups)]
    if len(set(labels)) < len(labels):
        labels = [f"{label} (table {group.path[1] + 1})" for label, group in zip(labels, configuration.filaments)]
    return labels


def _label(group):
    if group.is_reserve:
        what = {"filament": "parts of others", "nucleation": "that begin", "branching": "branches"}[group.path[0]]
        return f"up to {group.count} × {group.type.name}, {what}"
    segments = f"{group.segments} {group.type.segment_kind.name}{'s' * (group.segments > 1)}"
    return f"{group.count} × {group.type.name}, {segments}"


def is_in_equilibrium(group):
    """Whether the exact averages of the free chain hold for a group from its first frame on.

    One clamped node, or one tether, leaves lengths and angles alone; several hold the chain, and linkers pull at it. So
    does a clamped tangent, whose length does not fluctuate.
    """
    free = not (group.disturbed or group.closed)
    return free and group.start == "equilibrium" and len(group.clamped) <= 1 and not group.clamped_tangents


def summarise(configuration, trajectory):
    """Observables of a run against theory: a GroupSummary for each [[filament]] table; see ``load_trajectory``."""
    labels = group_labels(configuration)
    return [
        _summarise_group(
            configuration, group, members_in_all_frames(configuration, members, trajectory), label, trajectory
        )
        for group, members, label in zip(configuration.filaments, group_members(configuration), labels)
    ]


def members_in_all_frames(configuration, members, trajectory):
    """Those of some filaments that are there in all stages of a run, but for those that grow: a list of numbers."""
    if len(configuration.stages) < 2:
        return list(members)
    nodes = node_positions(trajectory, list(members)) if len(members) else []
    return [number for number, own in zip(members, nodes) if np.all(np.isfinite(own))]


def _summarise_group(configuration, group, members, label, trajectory):
    observables, short = [], []
    if group.growth is not None:
        return _without_averages(group, label, _GROW)
    if not members:
        return _without_averages(group, label, _PASS)
    rounding = _rounding_share(configuration, group, trajectory)
    comparable = is_in_equilibrium(group) and rounding <= _ROUNDING_OF_ALL
    temperature = configuration.solvent.temperature
    for name, unit, series, exact in _series(group, temperature, trajectory, members):
        value, error = mean_over_filaments(series)
        slow = len(members) < _ENOUGH_FILAMENTS and statistical_inefficiency(series) > len(series) / 10
        if slow and name != _WORMLIKE:
            short.append(name)
        rounded = name in (_STRETCHING, _STRETCHING_OF_ELEMENTS) and rounding > _ROUNDING_OF_STRETCHING
        observables.append(_compared(name, unit, value, error, exact, comparable and not rounded))
    if has_exact_extension(group):
        series = extensions(group, trajectory, members)
        value, error = mean_over_filaments(series)
        exact = float(theory.chain_extension(group.type, group.segments, group.tension[0], temperature))
        observables.append(_compared(_EXTENSION, "nm", value, error, exact, rounding <= _ROUNDING_OF_ALL))
    observables += _persistence_length(group, temperature, trajectory, members, comparable)
    return GroupSummary(
        label=label,
        type=group.type.name,
        filaments=len(members),
        segments=group.segments,
        start=group.start,
        in_equilibrium=is_in_equilibrium(group),
        observables=tuple(observables),
        notes=tuple(_notes(configuration, group, members, trajectory, short, rounding)),
    )


_GROW = "They grow: see growth.csv for their lengths, and energies.csv for energies per segment and joint."
_PASS = "None of them is there all the time: there are no averages."


def _without_averages(group, label, note):
    own = label, group.type.name, group.count, group.segments, group.start
    return GroupSummary(*own, in_equilibrium=False, observables=(), notes=(note,))


def has_exact_extension(group):
    """Whether the exact extension of a group under its tension is known."""
    plain = not (group.closed or group.planar or group.clamped) and group.type.segment_kind is STRAIGHT_SEGMENTS
    return plain and group.tension is not None and group.tension[0] >= 0.0


def extensions(group, trajectory, members):
    """Extensions R.e along the tension of a group in nm, in the second half of a run: (frames, filaments)."""
    direction = np.array(group.tension[1]) / np.linalg.norm(group.tension[1])
    return end_to_end_vectors(trajectory[trajectory.n_frames // 2 :], members) @ direction


def _series(group, temperature, trajectory, members):
    # (name, unit, (frames, filaments) averages, exact value) of every observable that is a plain average.
    kind = group.type.segment_kind
    if kind is BEAD_BONDS and group.closed:
        # Nothing is known of rings of beads.
        return
    yield from _SERIES[kind](group, temperature, trajectory, members)
    if not group.closed:
        yield from _end_to_end(group, temperature, trajectory, members)


def _series_of_cylinders(group, temperature, trajectory, members):
    kT, kind = thermal_energy(temperature), group.type
    lengths = np.stack(segment_lengths(trajectory, members), axis=1)
    distribution = SegmentLengthDistribution(kind, temperature, group.planar)
    yield (
        _STRETCHING,
        "kT",
        kind.stretching_energy(lengths).mean(axis=2) / kT,
        theory.stretching_energy_mean(kind, temperature, group.planar) / kT,
    )
    yield "segment length", "nm", lengths.mean(axis=2), float(distribution.mean(lambda length: length))
    if group.joints:
        cosines = np.stack(joint_cosines(trajectory, members), axis=1)
        if kind.bending_rigidity > 0 and group.rest_bends is None:
            yield (
                "bending energy per joint",
                "kT",
                kind.bending_energy(cosines).mean(axis=2) / kT,
                theory.bending_energy_mean(kind, temperature, group.planar) / kT,
            )
        exact = theory.mean_joint_cosine(kind, temperature, group.planar)
        yield "cosine of joint angle", "", cosines.mean(axis=2), exact


def _series_of_beams(group, temperature, trajectory, members):
    # Averages over all elements of a chain.
    kT = thermal_energy(temperature)
    kind, exact = group.type, beam_elements.beam_averages(group.type, temperature, group.planar)
    nodes, controls = node_positions(trajectory, members), control_point_positions(trajectory, members)
    element = kind.beam_element(temperature, group.planar)
    stretching, bending = element_energies(np.stack(nodes, axis=1), np.stack(controls, axis=1), element, group.closed)
    theory_of_stretching = theory.beam_stretching_energy_mean(kind, group.segments, temperature, group.planar) / kT
    yield _STRETCHING_OF_ELEMENTS, "kT", stretching.mean(axis=2) / kT, theory_of_stretching
    yield "bending energy per element", "kT", bending.mean(axis=2) / kT, exact.bending
    cosines = np.stack(joint_cosines(trajectory, members), axis=1)
    yield "cosine between ends of an element", "", cosines.mean(axis=2), exact.cosine


def _series_of_beads(group, temperature, trajectory, members):
    # Averages over all bonds, or joints, of a chain, which are not alike.
    kT, kind = thermal_energy(temperature), group.type
    vectors = np.diff(np.stack(node_positions(trajectory, members), axis=1), axis=2)
    lengths = np.linalg.norm(vectors, axis=3)
    free = kind, group.segments, temperature, group.planar
    energies = kind.stretching_energies(lengths).mean(axis=2) / kT
    yield _STRETCHING, "kT", energies, theory.bead_spring_stretching_energies(*free).mean() / kT
    yield "segment length", "nm", lengths.mean(axis=2), theory.bead_spring_mean_lengths(*free).mean()
    if group.joints:
        energies = kind.bending_energies(vectors).mean(axis=2) / kT
        yield "bending energy per joint", "kT", energies, theory.bead_spring_bending_energies(*free).mean() / kT


_SERIES = {
    STRAIGHT_SEGMENTS: _series_of_cylinders,
    BEAM_ELEMENTS: _series_of_beams,
    BEAD_BONDS: _series_of_beads,
}


def _end_to_end(group, temperature, trajectory, members):
    kind, segments, planar = group.type, group.segments, group.planar
    squares = np.sum(end_to_end_vectors(trajectory, members) ** 2, axis=2)
    name = "mean square end-to-end distance"
    yield name, "nm^2", squares, theory.chain_mean_square_end_to_end(kind, segments, temperature, planar)
    if kind.bending_rigidity > 0:
        wormlike = theory.wlc_mean_square_end_to_end(
            segments * kind.segment_length, kind.persistence_length_at(temperature), planar
        )
        yield _WORMLIKE, "nm^2", squares, float(wormlike)


def mean_over_filaments(series):
    """The mean of (frames, filaments) values and its error: over filaments, or in time if they are few."""
    filaments = series.shape[1]
    if filaments >= _ENOUGH_FILAMENTS:
        means = series.mean(axis=0)
        return float(means.mean()), float(means.std(ddof=1) / math.sqrt(filaments))
    return mean_with_error(series)


def _persistence_length(group, temperature, trajectory, members, comparable):
    # Rings bend all around. In chains of beads, mean cosines depend on the place along the chain.
    kind = group.type.segment_kind
    if group.closed or kind not in _PERSISTENCE_LENGTHS:
        return []
    measured = _PERSISTENCE_LENGTHS[kind](group, trajectory, members)
    if measured is None:
        return []
    exact = theory.chain_persistence_length(group.type, temperature, group.planar)
    return [_compared("persistence length", "nm", *measured, exact, comparable)]


def _persistence_length_of_cylinders(group, trajectory, members):
    if group.segments < 2 or group.type.bending_rigidity == 0:
        return None
    try:
        with warnings.catch_warnings():
            # The notes say it.
            warnings.simplefilter("ignore", EquilibrationWarning)
            return persistence_length(trajectory, members, group.planar)
    except InputError:
        # The mean cosine of a very flexible or unrelaxed chain need not define one.
        return None


def _persistence_length_of_beams(group, trajectory, members):
    # -h/ln<c> of the cosine c between tangents at the ends of an element, half of it in a plane, and its error.
    cosine, error = mean_over_filaments(np.stack(joint_cosines(trajectory, members), axis=1).mean(axis=2))
    if not 0.0 < cosine < 1.0:
        return None
    length = group.type.segment_length / (2.0 if group.planar else 1.0)
    value = -length / math.log(cosine)
    return value, error * value**2 / (length * cosine)


_PERSISTENCE_LENGTHS = {
    STRAIGHT_SEGMENTS: _persistence_length_of_cylinders,
    BEAM_ELEMENTS: _persistence_length_of_beams,
}


def _compared(name, unit, value, error, exact, comparable):
    difference = value - exact
    deviation = difference / error if error > 0 else None
    relative = difference / exact if abs(exact) > 1e-6 else None
    if not comparable:
        verdict = NOT_COMPARABLE
    elif name == _WORMLIKE:
        verdict = "reference"
    elif deviation is not None and abs(deviation) <= AGREEMENT_SIGMA:
        verdict = "agrees"
    elif relative is not None and abs(relative) <= AGREEMENT_FRACTION:
        verdict = f"within {100 * AGREEMENT_FRACTION:.0f} %"
    else:
        verdict = "differs"
    return Observable(name, unit, value, error, exact, deviation, relative, verdict)


def _notes(configuration, group, members, trajectory, short, rounding):
    if group.start == "straight":
        yield (
            "Started straight, not in equilibrium: the averages contain the relaxation, so they are not compared "
            "with equilibrium."
        )
    bends = group.segments > 1 and not group.closed and trajectory.n_frames >= FEWEST_FRAMES_OF_DRIFT
    bends = bends and rounding <= _ROUNDING_OF_ALL
    drift = bending_drift(trajectory, members) if bends else 0.0
    if abs(drift) > SIGNIFICANT_DRIFT:
        yield (
            f"Not in equilibrium from the first frame on: joints are {'more' if drift > 0 else 'less'} bent in the "
            f"last half of the run than in its first quarter, by {abs(drift):.1f} standard errors. Leave out the "
            "start, or run longer."
        )
    if len(group.clamped) > 1:
        yield "Several nodes are clamped: the exact values are those of free chains, so they are not compared."
    elif group.clamped_tangents:
        yield "A tangent is clamped: the exact values are those of free chains, so they are not compared."
    if group.disturbed:
        reasons = "; ".join(_DISTURBANCES[name] for name in group.disturbed)
        yield f"{reasons[0].upper()}{reasons[1:]}: the exact values are those of free chains, so they are not compared."
    if group.closed:
        yield "They are rings: the exact values are those of open chains, so they are not compared."
    if group.start == "file":
        yield "Started from a file: whether that is equilibrium is not known, so nothing is compared with it."
    if group.start == "nodes":
        yield "Started from given nodes: whether that is equilibrium is not known, so nothing is compared with it."
    if len(members) >= _ENOUGH_FILAMENTS:
        yield (
            f"Errors: standard error of the time averages of {len(members)} independent filaments, which holds "
            "however slowly a filament relaxes (persistence length: from its correlation in time)."
        )
    else:
        yield "Errors: from fluctuations in time, accounting for their correlation, pooled over filaments."
    if short:
        yield (
            f"The run is short against the correlation time of {', '.join(short)}: the error is a lower bound. Run "
            f"longer, or at least {_ENOUGH_FILAMENTS} filaments."
        )
    if configuration.simulation.scheme == "euler":
        yield 'Scheme "euler" has the drift of free segments: chain averages are biased at any time step.'
    if rounding > _ROUNDING_OF_STRETCHING:
        what = "nothing is" if rounding > _ROUNDING_OF_ALL else "it is not"
        yield (
            f"The single precision of the trajectory adds about {100 * rounding:.2g} % to the stretching energy this "
            f"far from the origin, so {what} compared. energies.csv is not affected. Begin nearer to the origin."
        )


def _rounding_share(configuration, group, trajectory):
    # DCD holds single-precision angstroms and mdtraj single-precision nm; each rounds both ends of a segment.
    spacing = float(np.spacing(np.float32(10.0 * np.abs(trajectory.xyz).max()))) / 10.0
    variance = 4.0 * spacing**2 / 12.0
    if not group.type.segment_kind.straight:
        # The strain at a node is that of Q - P, a third of an element long, with a share of an element of its energy.
        variance *= 3.0
    return variance * group.type.segment_stiffness / thermal_energy(configuration.solvent.temperature)
