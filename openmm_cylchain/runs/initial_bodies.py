"""Rigid bodies of a configuration where they begin, and what holds filaments on them."""

import numpy as np

from ..couplings.link_places import as_places
from ..kinetics.crosslinker import Crosslinker
from ..kinetics.hand import Hand
from .table import group_of


def add_bodies(configuration, filaments, seed):
    """Add bodies to Filaments, and return the starts of filaments on them: (place, direction) by their numbers."""
    starts = {}
    for number, (own, entries) in enumerate(zip(configuration.bodies, configuration.tables["body"])):
        with entries.naming():
            placed = list(own.starts(np.random.default_rng([seed, number, 6]), configuration.box))
            for origin, rotation in placed:
                filaments.add_body(own.body, origin, rotation, planar=own.planar)
        if own.held is None:
            continue
        for index, filament in enumerate(own.held.numbers):
            slot, body = divmod(index, own.count)
            origin, rotation = placed[body]
            outward = rotation @ own.held.directions[slot]
            starts[filament] = origin + rotation @ own.held.places[slot], outward, own.held.end
    return starts


def first_particles(configuration, filaments):
    """The first particle of each body of a configuration, of Filaments that are the first in a System."""
    there = len(filaments.attachments) + sum(
        (1 if own.control_points is None else 2) * (len(own.positions) + own.spare_nodes) for own in filaments
    )
    points = [len(own.body.points) for own in configuration.bodies for _ in range(own.count)]
    return there + np.concatenate([[0], np.cumsum(points)]).astype(int)


def add_holding_linkers(configuration, filaments, seed):
    """Add the linkers that hold filaments that grow on bodies, bound for ever."""
    firsts, before = first_particles(configuration, filaments), 0
    for own, entries in zip(configuration.bodies, configuration.tables["body"]):
        if own.held is not None and own.held.growing:
            with entries.naming():
                for stiffness, points, along in _springs(own.held):
                    _hold_by_linkers(own, filaments, firsts[before:], stiffness, points, along, seed)
        before += own.count


def holding_links(configuration, filaments):
    """LinkPlaces, stiffness (n,) and rest lengths (n,) of the links that hold filaments on bodies, for each table."""
    parts, before = [], 0
    for own in configuration.bodies:
        held = own.held
        if held is not None and not held.growing:
            for stiffness, points, along in _springs(held):
                pairs = []
                for index, number in enumerate(held.numbers):
                    slot, body = divmod(index, own.count)
                    particle = int(filaments.body_indices[before + body][points[slot]])
                    pairs.append((_place(filaments, number, held.end, along), particle))
                parts.append((as_places(pairs), np.full(len(pairs), stiffness), np.zeros(len(pairs))))
        before += own.count
    return parts


def spheres_of_bodies(configuration, filaments, groups, most=None):
    """Particles and radii in nm of the spheres of the bodies of some BodyGroups, or of the first ones of each."""
    particles, radii = [], []
    for number, placed in enumerate(filaments.bodies):
        own = group_of(number, configuration.bodies)
        if not any(group is own for group in groups):
            continue
        spheres = np.flatnonzero(placed.body.radii > 0.0)[:most]
        particles += filaments.body_indices[number][spheres].tolist()
        radii += placed.body.radii[spheres].tolist()
    return particles, np.array(radii)


def _springs(held):
    yield held.stiffness, held.bases, 0.0
    if held.arm_stiffness is not None:
        yield held.arm_stiffness, held.arms, held.arm


def _place(filaments, number, end, along):
    if along == 0.0:
        return int(filaments.node_indices[number][0 if end == "minus" else -1])
    return filaments.segment_place(number, _arc_length(filaments, number, end, along))


def _arc_length(filaments, number, end, along):
    own = filaments[number]
    return along if end == "minus" else float(own.type.segment_lengths(own.segments, False).sum()) - along


def _hold_by_linkers(own, filaments, firsts, stiffness, points, along, seed):
    held = own.held
    hand = Hand(binding_rate=0.0, reach=1.0, unbinding_rate=0.0, binds_to=(filaments[held.numbers[0]].type.name,))
    anchors, places = [], []
    for index, number in enumerate(held.numbers):
        slot, body = divmod(index, own.count)
        anchors.append(int(firsts[body]) + points[slot])
        places.append((number, _arc_length(filaments, number, held.end, along)))
    kind = Crosslinker(hands=(hand, hand), stiffness=stiffness, rest_length=0.0, name=f"{own.body.name} holds")
    filaments.add_linkers(kind, anchors=np.array(anchors), bound=len(anchors), places=places, seed=seed)
