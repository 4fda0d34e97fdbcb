"""Attachment points: places on filaments where any OpenMM force can act.

An attachment point is a virtual site between the two ends of a segment, x = (1-s) x_minus + s x_plus, and follows them
in the same step. OpenMM hands a force on it to the ends in the same proportions, which is what a force F at the place s
of a cylinder does: the sum is F, and the torque around the segment's middle (s-1/2) l t x F (step 5 of Section 4 of
Pesek et al., Soft Matter 2016, 12, 3360). On a beam element, it is the point of its curve at the parameter s, a mean of
its two nodes and their control points with the weights of the curve.
"""

from collections import defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
import openmm
from numpy.typing import ArrayLike

from ..beams.curve import particle_weights, place_weights
from ..errors import InputError
from ..units.quantities import DIMENSIONLESS, LENGTH, in_units_of, non_negative, require_kind, whole_number
from ..units.types import FloatArray, Indices, IntArray, Scalar
from .chain_type import ChainType
from .filament import Filament

ATTACHMENT_NAME = "ATT"
"""Atom name of attachment points in topologies."""

BEAD_NAME = "BED"
"""Atom name of beads in topologies."""

_MOST_BEADS = 10**6

SAME_PLACE = 1e-9
"""Places that are closer than this along a contour, in segments, are one."""


@dataclass(frozen=True)
class Attachment:
    """A place on a filament.

    Attributes
    ----------
    filament, segment : int
    fraction : float
        Of the segment's length, from its minus end: 0 to 1. On a beam element, the parameter of its curve.
    name : str
        Of its atom in topologies.
    """

    filament: int
    segment: int
    fraction: float
    name: str = ATTACHMENT_NAME

    def __post_init__(self) -> None:
        for name in ("filament", "segment"):
            object.__setattr__(self, name, whole_number(getattr(self, name), 0, f"Attachment: {name}"))
        object.__setattr__(self, "fraction", _fraction(self.fraction, "Attachment"))
        require_kind(self.name, str, "Attachment: name")


def locate(
    filament: Filament,
    number: int,
    label: str,
    arc_length: Scalar | None = None,
    segment: int | None = None,
    fraction: float | None = None,
) -> Attachment:
    """An Attachment from an arc length, or from a segment and a fraction of it.

    Parameters
    ----------
    number : int
        Of the filament.
    label : str
        What to call the attachment point in messages.
    arc_length : length, optional
        Along segments of rest length, from the first node.
    segment : int, optional
        Negative numbers count from the end.
    fraction : float, optional
        0.5 if not given.

    Raises
    ------
    InputError
        If both or neither are given, or the place is not on the filament.
    """
    if (arc_length is None) == (segment is None):
        raise InputError(f"{label}: give either arc_length or segment (and fraction).")
    if arc_length is None:
        return Attachment(number, _segment(segment, filament, label), _fraction(fraction, label))
    if fraction is not None:
        raise InputError(f"{label}: a fraction goes with a segment, not with an arc_length.")
    arc_length = non_negative(arc_length, LENGTH, f"{label}: arc_length")
    place, contour = _along(filament, np.array([arc_length]))
    if place[0] > filament.segments * (1.0 + 1e-12):
        raise InputError(f"{label}: arc_length is {arc_length:g} nm, but the filament is {contour:g} nm long.")
    (segment,), (fraction,) = places_along(filament, [arc_length])
    return Attachment(number, int(segment), float(fraction))


def places_along(filament: Filament, arc_lengths: ArrayLike) -> tuple[IntArray, FloatArray]:
    """Segments, and fractions of them, at arc lengths (n,) in nm from the first node, up to that of the filament."""
    places, _ = _along(filament, np.asarray(arc_lengths))
    segments = np.minimum(np.floor(places).astype(int), filament.segments - 1)
    return segments, np.minimum(places - segments, 1.0)


def lengths_along(filament_type: ChainType, segments: int, closed: bool) -> FloatArray:
    """The lengths in nm of segments by which arc lengths count: those of a straight chain, or of a ring, at rest."""
    return filament_type.segment_lengths(segments, True) if closed else filament_type.straight_lengths(segments)


def _along(filament, arc_lengths):
    # Arc lengths in segments, and that of the whole filament, at rest.
    kind, segments = filament.type, filament.segments
    lengths = lengths_along(kind, segments, filament.closed)
    if np.all(lengths == kind.segment_length):
        return arc_lengths / kind.segment_length, segments * kind.segment_length
    ends = np.concatenate([[0.0], np.cumsum(lengths)])
    inside = np.interp(arc_lengths, ends, np.arange(segments + 1))
    return np.where(arc_lengths > ends[-1], segments * arc_lengths / ends[-1], inside), ends[-1]


def _segment(segment, filament, label):
    segment = whole_number(segment, -filament.segments, f"{label}: segment")
    if segment >= filament.segments:
        raise InputError(f"{label}: segment {segment} does not exist; there are {filament.segments}.")
    return segment % filament.segments


def _fraction(fraction, label):
    if not isinstance(fraction, float) or not 0.0 <= fraction <= 1.0:
        fraction = 0.5 if fraction is None else in_units_of(fraction, DIMENSIONLESS, f"{label}: fraction")
    if not isinstance(fraction, float) or not 0.0 <= fraction <= 1.0:
        raise InputError(f"{label}: fraction must be a number between 0 and 1, but is {fraction}.")
    return fraction


def add_virtual_site(system: openmm.System, attachment: Attachment, nodes: IntArray, control_points: IntArray) -> int:
    """Add the particle of an attachment point to a System that holds the nodes of its filament; return its index.

    Control points are those of beam elements, none of straight segments.
    """
    particle = system.addParticle(0.0)
    if len(control_points):
        ends = [attachment.segment, (attachment.segment + 1) % len(nodes)]
        parents = [int(own[end]) for end in ends for own in (nodes, control_points)]
        # A mean of four particles, without an offset in a frame that would have axes.
        none = [0.0] * 4
        weights = particle_weights(attachment.fraction)
        system.setVirtualSite(particle, openmm.LocalCoordinatesSite(parents, weights, none, none, openmm.Vec3(0, 0, 0)))
        return particle
    minus, plus = int(nodes[attachment.segment]), int(nodes[(attachment.segment + 1) % len(nodes)])
    site = openmm.TwoParticleAverageSite(minus, plus, 1.0 - attachment.fraction, attachment.fraction)
    system.setVirtualSite(particle, site)
    return particle


def neighbors(attachments: Sequence[Attachment], particles: Indices, nodes: Indices) -> Iterator[tuple[int, int]]:
    """Pairs of particles of one filament that may coincide: attachment points, and the ends of their segments.

    By the particles of the attachments, and those of the nodes.
    """
    on_segment = defaultdict(list)
    for attachment, particle in zip(attachments, particles):
        on_segment[attachment.segment].append(int(particle))
    for segment, points in on_segment.items():
        # Those at the end of a segment may meet those at the beginning of the next.
        following = (segment + 1) % len(nodes)
        others = [int(nodes[segment]), int(nodes[following]), *on_segment.get(following, ())]
        yield from combinations(points, 2)
        yield from ((point, other) for point in points for other in others)


def attachment_positions(
    segments: IntArray, fractions: FloatArray, positions: FloatArray, control_points: FloatArray | None = None
) -> FloatArray:
    """Where places on segments (places,) of a filament with node positions (n, 3) are: an array (places, 3).

    Of beam elements, the control points (n, 3) are needed, too.
    """
    if control_points is not None:
        weights = place_weights(fractions)
        vectors = control_points - positions
        following = (segments + 1) % len(positions)
        columns = (positions[segments], vectors[segments], positions[following], vectors[following])
        return np.einsum("pw,wpx->px", weights, np.array(columns))
    shares = fractions[:, None]
    return (1.0 - shares) * positions[segments] + shares * positions[(segments + 1) % len(positions)]


def distribute_beads(filament: Filament, number: int, spacing: float) -> list[Attachment]:
    """Attachments along segments of rest length, the first and the last node of a chain included, at equal distances of
    ``spacing`` in nm at most.

    In a ``BeadSpringType``, whose end bonds are shorter, they are closer to each other there. On beam elements, there
    is one at each node, so that the pieces of curve between neighbours belong to one element each.
    """
    kind = filament.type.segment_kind
    intervals = kind.intervals(filament.segments, filament.type.segment_length, spacing)
    if intervals > _MOST_BEADS:
        raise InputError(
            f"Beads of filament {number}: spacing is {spacing:g} nm, which makes {intervals:.3g} beads, and at most "
            f"{_MOST_BEADS:.0e} are possible: take half of the contact diameter."
        )
    # In a ring, the last place would be the first once more.
    count = intervals if filament.closed else intervals + 1
    places = filament.segments * np.arange(count) / intervals
    nearest = np.rint(places)
    places = np.where(np.abs(places - nearest) < SAME_PLACE, nearest, places)
    segments = np.minimum(np.floor(places).astype(int), filament.segments - 1)
    fractions = places - segments
    return [Attachment(number, int(s), float(f), BEAD_NAME) for s, f in zip(segments, fractions)]
