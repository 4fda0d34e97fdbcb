"""The CylinderChainBindingForce of a System: linkers of the compiled engine."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any

import numpy as np
import openmm

from ..couplings.beam_curves import BeamCurves
from ..engine_choice import load_plugin
from ..errors import InputError
from ..filaments.filament import Filament
from ..filaments.twist import has_twist
from ..mechanics.geometry import to_nearest_images
from ..units.quantities import require_kind, thermal_energy
from ..units.types import FloatArray, IntArray
from .barrier import Barrier
from .binding_range import ENDS_OF_RANGE
from .first_places import FirstPlaces, contour_of
from .growth_force import branchings_of
from .hand import Hand
from .linker_table import LinkerTable
from .linkers import LinkerPulls, Linkers

BINDING_FORCE_NAME = "Linkers"
_ANY_NUMBER = 2**31 - 1
"""Of hands that take monomers off an end."""


def is_binding_force(force: openmm.Force) -> bool:
    """Whether a force of a System is a CylinderChainBindingForce."""
    plugin = load_plugin()
    return plugin is not None and plugin.CylinderChainBindingForce.isinstance(force)


def find_binding_force(system: openmm.System) -> Any:
    """The CylinderChainBindingForce of a System, or None."""
    for force in system.getForces():
        if is_binding_force(force):
            return load_plugin().CylinderChainBindingForce.cast(force)
    return None


def make_binding_force(
    linkers: Sequence[Linkers],
    filaments: Sequence[Filament],
    temperature: float,
    positions: FloatArray,
    box: FloatArray | None,
    barriers: Sequence[Barrier] = (),
) -> openmm.Force:
    """The force of linkers that bind to the filaments of a System.

    Parameters
    ----------
    linkers : sequence of Linkers
        The types of linkers, in the order of their numbers.
    temperature : float
        In K.
    positions : (particles, 3) array
        In nm, of the System: some particles may be anchors.
    box : (3, 3) array or None
        Periodic box vectors if distances are those of nearest images.
    barriers : sequence of Barrier
        What captures hands that walk.

    Raises
    ------
    InputError
        If there is nothing that a hand binds to, or no place for all that are to begin bound.
    """
    force = load_plugin().CylinderChainBindingForce(temperature)
    force.setName(BINDING_FORCE_NAME)
    force.setUsesPeriodicBoundaryConditions(box is not None)
    hands: dict[Hand, int] = {}
    for own in linkers:
        numbers = []
        for hand in own.kind.hands:
            if hand not in hands:
                hands[hand] = _add_hand(force, hand, filaments, own.kind.name)
            numbers.append(hands[hand])
        loading = own.kind.loading_distance or 0.0
        first = -1 if own.anchors is not None else numbers[0]
        number = force.addLinkerType(
            first, numbers[1], own.kind.rest_length, own.kind.stiffness, own.kind.same_filament or loading > 0.0
        )
        force.setLinkerTypeRules(number, *own.kind.cosine_range, own.kind.trans_activated, own.kind.reversible)
        force.setLinkerTypeLoading(number, loading)
        density = -1.0 if own.concentration is None else own.concentration
        force.setLinkerTypeReservoir(number, own.volume or 0.0, density)
        if own.diffusion is not None:
            force.setLinkerTypeDiffusion(number, own.diffusion, own.planar)
        for shape in own.region:
            name, point, direction, length = shape.region
            force.addLinkerTypeWall(number, name, openmm.Vec3(*point), openmm.Vec3(*direction), length)
        for anchor in () if own.anchors is None else own.anchors:
            _add_anchor(force, anchor)
    _add_branch_joints(force, filaments, len(linkers))
    for barrier in barriers:
        place = barrier.filament, barrier.arc_length, barrier.direction
        force.addBarrier(*place, barrier.capture_probability, barrier.release_rate)
    place_linkers(force, linkers, filaments, temperature, positions, box)
    return force


def _add_branch_joints(force, filaments, types):
    # Their linkers are the last ones, in the order of the nucleators.
    branchings = branchings_of(filaments)
    first = types - sum(len(own.springs) for _, own in branchings)
    for nucleator, own in branchings:
        springs = own.springs
        numbers = list(range(first, first + len(springs)))
        force.addBranchJoint(nucleator, numbers, [spring[2] for spring in springs], [spring[3] for spring in springs])
        first += len(springs)


def place_linkers(
    force: Any,
    linkers: Sequence[Linkers],
    filaments: Sequence[Filament],
    temperature: float,
    positions: FloatArray,
    box: FloatArray | None,
) -> None:
    """Have the linkers of a force begin where they do on filaments at given places; see ``make_binding_force``."""
    columns: list[Any] = [[], [], [], []]
    first_places = FirstPlaces(filaments, thermal_energy(temperature), box)
    anchored = 0
    for number, own in enumerate(linkers):
        anchors = np.full(own.count, -1)
        if own.anchors is not None:
            anchors = np.arange(anchored, anchored + own.count)
            anchored += own.count
        chains, places = np.full((own.count, 2), -1), np.zeros((own.count, 2))
        generator = np.random.default_rng((own.seed, number))
        hand = int(own.anchors is not None)
        if own.places is not None:
            for row, of_hands in enumerate(own.places):
                for column, place in enumerate(of_hands, hand):
                    chains[row, column], places[row, column] = place
        elif own.anchors is None:
            where = first_places.anywhere(own.kind.hands[0], own.bound, generator, own.kind.name)
            chains[: own.bound, 0], places[: own.bound, 0] = where
        elif own.bound:
            which, where = first_places.near(_anchor_points(own, positions), own.kind, own.bound, generator)
            chains[which, 1], places[which, 1] = where
        for column, values in zip(columns, (np.full(own.count, number), anchors, chains, places)):
            column.append(values)
    rows: list[list[Any]] = [np.concatenate(column).ravel().tolist() for column in columns]
    count = len(rows[0])
    force.setLinkers(list(range(count)), *rows, count)


def _add_hand(force, hand, filaments, name):
    every = [i for i, filament in enumerate(filaments) if hand.binds(filament.type)]
    chains = [i for i in every if filaments[i].takes_part]
    if not every:
        types = sorted({filament.type.name for filament in filaments})
        raise InputError(
            f"Linkers {name!r}: a hand binds to filaments of the type {' or '.join(hand.binds_to)}, of which there are "
            f"none among {', '.join(types)}: change its binds_to."
        )
    longest = max(_longest_contour(filament) for filament in filaments if hand.binds(filament.type))
    if hand.site_spacing is not None and hand.site_spacing > longest * (1.0 + 1e-9):
        raise InputError(
            f"Linkers {name!r}: a hand has no sites, {hand.site_spacing:g} nm apart, on filaments of {longest:g} nm: "
            "make its site_spacing smaller."
        )
    number = force.addHand(hand.rate_per_length, hand.reach, hand.unbinding_rate, chains)
    force.setHandUnbinding(
        number, hand.strain_share, hand.unbinding_force or 0.0, hand.catch_rate, hand.catch_force or 0.0
    )
    force.setHandWalking(number, hand.speed, hand.stall_force or 0.0, hand.walks_backward, hand.holds_at_ends)
    force.setHandSiteSpacing(number, hand.site_spacing or 0.0)
    force.setHandSevering(number, hand.severing_rate)
    force.setHandSliding(number, hand.sliding_friction or 0.0)
    if hand.helix is not None:
        for i in every:
            if filaments[i].rest_bends is not None:
                raise InputError(
                    f"Linkers {name!r}: a hand follows a helix, but binds to filament {i} "
                    f"({filaments[i].type.name}), which has rest_bends, and cannot be turned as yet: name others in "
                    "binds_to."
                )
            if not has_twist(filaments[i].type):
                raise InputError(
                    f"Linkers {name!r}: a hand follows a helix, but binds to filament {i} "
                    f"({filaments[i].type.name}), which has no twist: give its type a twist_persistence_length, or "
                    "name others in binds_to."
                )
        own = hand.helix
        force.setHandOnHelix(number, own.pitch, own.rotational_friction, own.stall_torque or 0.0, own.torque_range)
    if hand.binding_range is not None:
        own = hand.binding_range
        force.setHandBindingRange(number, ENDS_OF_RANGE.index(own.end), own.range, own.excluded)
    if hand.severing_rate > 0.0 and not any(filaments[i].growth is not None for i in chains):
        raise InputError(f"Linkers {name!r}: a hand cuts filaments, but binds to none that grow: give them a growth.")
    if hand.filament_end is not None:
        _set_hand_at_end(force, number, hand, {i: filaments[i].growth for i in chains}, name)
    return number


def _set_hand_at_end(force, number, hand, growths, name):
    own = hand.filament_end
    # Many filaments share a growth.
    different = {id(growth): growth for growth in growths.values() if growth is not None}
    try:
        free, held = own.find_changes(different.values())
        own.require_ends_that_shrink(different.values())
    except InputError as error:
        raise InputError(f"Linkers {name!r}: {error}") from None
    changed = [i for i, growth in growths.items() if growth is not None and own.may_change(growth)]
    end = ENDS_OF_RANGE.index(own.end)
    force.setHandAtEnd(number, end, own.range, own.binds_there, own.tracks, free, held, changed)
    unbinding = -1.0 if own.unbinding_rate is None else own.unbinding_rate
    force.setHandRemoval(number, own.off_rate, own.sites or _ANY_NUMBER, unbinding)


def _longest_contour(filament):
    return contour_of(filament)[-1] if filament.growth is None else filament.growth.longest


def _anchor_points(linkers, positions):
    anchors = np.asarray(linkers.anchors)
    if anchors.ndim == 2:
        return anchors
    if anchors.max() >= len(positions):
        raise InputError(
            f"Linkers {linkers.kind.name!r}: {linkers.bound} are to begin bound, but where particle {anchors.max()}, "
            f"an anchor, is, is not known: there are only {len(positions)} particles yet."
        )
    return positions[anchors]


def _add_anchor(force, anchor):
    if np.ndim(anchor) == 0:
        return force.addParticleAnchor(int(anchor))
    return force.addPointAnchor(openmm.Vec3(*(float(x) for x in anchor)))


@contextmanager
def naming_unknown_linkers() -> Iterator[None]:
    """InputError in place of what the plugin raises where it is not known where linkers are."""
    try:
        yield
    except openmm.OpenMMException as error:
        raise InputError(str(error)) from None


def table_of(force: Any, context: openmm.Context) -> LinkerTable:
    """The linkers of a Context; InputError if it is not known where they are."""
    with naming_unknown_linkers():
        columns = force.getLinkersInContext(context)
        unbound, coordinates = force.getUnboundPositionsInContext(context)
    numbers, types, anchors, chains, places = (np.array(column) for column in columns[:5])
    positions = np.full((len(numbers), 3), np.nan)
    positions[np.searchsorted(numbers, unbound)] = np.reshape(coordinates, (-1, 3))
    return LinkerTable(
        numbers.astype(int),
        types.astype(int),
        anchors.astype(int),
        chains.astype(int).reshape(-1, 2),
        places.astype(float).reshape(-1, 2),
        columns[5],
        positions,
    )


def set_table(force: Any, context: openmm.Context, table: LinkerTable) -> None:
    """Give a Context the linkers of a table; InputError if they do not fit types, anchors or filaments."""
    require_kind(table, LinkerTable, "table")
    columns = [np.asarray(column).ravel().tolist() for column in (
        table.numbers, table.types, table.anchors, table.filaments, table.arc_lengths
    )]  # fmt: skip
    known = ~np.isnan(table.positions).all(axis=1)
    try:
        force.setLinkersInContext(context, *columns, int(table.next_number))
        if np.any(known):
            positions = table.positions[known].ravel().tolist()
            force.setUnboundPositionsInContext(context, table.numbers[known].tolist(), positions)
    except openmm.OpenMMException as error:
        raise InputError(str(error)) from None


def pulls_of(
    force: Any,
    table: LinkerTable,
    contours: Sequence[FloatArray],
    nodes: Sequence[IntArray],
    positions: FloatArray,
    box: FloatArray | None,
    curves: BeamCurves | None = None,
) -> LinkerPulls:
    """What the springs of linkers do; arguments are those of ``places_of``."""
    pulling = table.held == 2
    places = places_of(force, table, contours, nodes, positions, box, curves)[pulling]
    vectors = places[:, 1] - places[:, 0]
    distance = np.linalg.norm(vectors, axis=1)
    parameters = np.array([force.getLinkerTypeParameters(i)[2:4] for i in range(force.getNumLinkerTypes())])
    rest, stiffness = parameters[table.types[pulling]].T
    with np.errstate(invalid="ignore", divide="ignore"):
        directions = np.where(distance[:, None] > 0.0, vectors / distance[:, None], 0.0)
    forces = (stiffness * (distance - rest))[:, None] * directions
    return LinkerPulls(table.numbers[pulling], table.types[pulling], places, distance, forces)


def places_of(
    force: Any,
    table: LinkerTable,
    contours: Sequence[FloatArray],
    nodes: Sequence[IntArray],
    positions: FloatArray,
    box: FloatArray | None,
    curves: BeamCurves | None = None,
) -> FloatArray:
    """Where the two ends of linkers hold something: (n, 2, 3) in nm, NaN where they do not.

    By where the segments of each filament begin along it, and its end (``contours_in``), the particles of its nodes,
    all positions in nm, and the curves of beam elements. In a box, (3, 3), a second end is at the nearest image of its
    first one.
    """
    places = np.full((len(table), 2, 3), np.nan)
    chains, along = np.asarray(table.filaments), np.asarray(table.arc_lengths)
    minus = np.concatenate([own[: len(contour) - 1] for contour, own in zip(contours, nodes)])
    plus = np.concatenate([np.roll(own, -1)[: len(contour) - 1] for contour, own in zip(contours, nodes)])
    # Of all filaments, one behind the other.
    begins = np.cumsum([0.0, *(contour[-1] - contour[0] for contour in contours)])
    begins = begins[:-1] - [contour[0] for contour in contours]
    starts = np.concatenate([begin + contour[:-1] for begin, contour in zip(begins, contours)])
    sizes = np.concatenate([np.diff(contour) for contour in contours])
    first = np.cumsum([0, *(len(contour) - 1 for contour in contours)])
    for side in (0, 1):
        on = chains[:, side] >= 0
        chain = chains[on, side]
        position = begins[chain] + along[on, side]
        segment = np.clip(np.searchsorted(starts, position, side="right") - 1, first[chain], first[chain + 1] - 1)
        between = _nearest(positions[plus[segment]] - positions[minus[segment]], box)
        fraction = (position - starts[segment]) / sizes[segment]
        own = positions[minus[segment]] + fraction[:, None] * between
        if curves is not None:
            rows = np.flatnonzero(curves.on_curve(minus[segment], plus[segment]))
            joined = minus[segment[rows]], plus[segment[rows]]
            own[rows] = curves.places(*joined, fraction[rows], positions, box)
        places[on, side] = own
    for row in np.flatnonzero(np.asarray(table.anchors) >= 0):
        particle, point = force.getAnchor(int(table.anchors[row]))
        places[row, 0] = positions[particle] if particle >= 0 else getattr(point, "_value", point)
    both = table.held == 2
    places[both, 1] = places[both, 0] + _nearest(places[both, 1] - places[both, 0], box)
    return places


def _nearest(vectors, box):
    return vectors if box is None else to_nearest_images(vectors, box)
