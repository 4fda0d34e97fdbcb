"""Joints of a configuration where filaments begin."""

import numpy as np

from ..beams.curve import element_slopes
from ..couplings.joints import Joints
from ..filaments.segment_place import SegmentPlace


def add_joints(configuration, filaments, system):
    """Add the joints of a configuration to a System with its filaments."""
    if not configuration.joints:
        return
    joints = Joints(configuration.joints[0].stiffness)
    for own, entries in zip(configuration.joints, configuration.tables["joint"]):
        with entries.naming():
            _add_joint(own, joints, filaments)
    joints.add_to(system)


def _add_joint(own, joints, filaments):
    # The filament comes first, and a direction second.
    places, vectors = zip(
        *sorted((_tangent(entries, filaments) for entries in own.between), key=lambda one: one[0] is None)
    )
    second = vectors[1] if places[1] is None else places[1]
    cosine = vectors[0] @ vectors[1] / np.prod(np.linalg.norm(vectors, axis=1))
    angle = float(np.arccos(np.clip(cosine, -1.0, 1.0))) if own.angle is None else min(own.angle, np.pi)
    if angle > 0.5 * np.pi * (1.0 + 1e-12):
        # The same as the rest of a straight angle with the opposite of one of the two.
        second = _opposite(second)
        angle = np.pi - angle
    joints.add(None, places[0], second, angle, own.stiffness)


def _tangent(entries, filaments):
    # The place of a tangent and the vector there; None and the vector for a direction.
    if entries["direction"] is not None:
        return None, np.array(entries["direction"])
    number = entries["filament"]
    if entries["node"] is not None:
        node = entries["node"] % len(filaments[number].positions)
        # At the end of the element before it, or of a ring at the beginning of the one behind it.
        after = filaments[number].closed or node == 0
        place = filaments.segment_place(number, segment=node if after else node - 1, fraction=float(not after))
    else:
        place = filaments.segment_place(number, entries["arc_length"], entries["segment"], entries["fraction"])
    return place, _tangent_at(place, filaments, number)


def _tangent_at(place, filaments, number):
    own = filaments[number]
    element = np.array([place.first, place.second]) - filaments.node_indices[number][0]
    return element_slopes(own.positions[element], own.control_points[element], [place.fraction], 1.0)[0, 0]


def _opposite(tangent):
    if isinstance(tangent, SegmentPlace):
        return SegmentPlace(tangent.second, tangent.first, 1.0 - tangent.fraction)
    return -tangent
