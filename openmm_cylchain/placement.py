"""Checks of where filaments are put, before anything is built."""

import numpy as np

from .errors import InputError
from .quantities import DIMENSIONLESS, in_units_of, whole_number


def vector(value, target, name):
    """Return ``value`` as a (3,) array in the unit ``target``; raise InputError if it has another shape."""
    components = np.asarray(in_units_of(value, target, name))
    if components.shape != (3,):
        raise InputError(f"{name} must have three components, but has the shape {components.shape}.")
    return components


def unit_vector(direction, label):
    """Return ``direction`` normalised; raise InputError if it is zero or not a vector."""
    direction = vector(direction, DIMENSIONLESS, f"{label}: direction")
    norm = np.linalg.norm(direction)
    if norm == 0:
        raise InputError(f"{label}: direction must not be the zero vector.")
    return direction / norm


def _check_folds(filament_type, positions, label):
    if filament_type.bending_rigidity == 0.0:
        return
    difference = np.diff(positions, axis=0)
    tangents = difference / np.linalg.norm(difference, axis=1)[:, None]
    cosines = np.einsum("ij,ij->i", tangents[1:], tangents[:-1])
    energies = filament_type.bending_energy(cosines)
    if not np.all(np.isfinite(energies)) or np.any(cosines < -1.0 + 1e-12):
        joint = int(np.argmin(cosines)) + 1
        raise InputError(
            f"{label}: the segments before and after node {joint} are antiparallel, where the bending force is not "
            "defined; move the node."
        )


def named_nodes(nodes, count, label):
    """Return nodes, counted from the start and sorted; raise InputError for one that does not exist."""
    numbers = set()
    for node in np.atleast_1d(np.asarray(nodes, dtype=object)):
        number = whole_number(node, -count, f"{label} node")
        number += count if number < 0 else 0
        if number >= count:
            raise InputError(f"{label} node {node} does not exist; there are {count} nodes.")
        numbers.add(number)
    return tuple(sorted(numbers))


def clamped_nodes(clamped, count, label):
    """Return the clamped nodes, counted from the start and sorted; raise InputError for one that does not exist."""
    nodes = named_nodes(clamped, count, f"{label}: clamped")
    if len(nodes) == count:
        raise InputError(f"{label} has all of its nodes clamped (mass zero): leave at least one free to move.")
    return nodes


def check_shape(filament_type, positions, label):
    """Raise InputError for node positions (n, 3) in nm in which a force is not defined."""
    lengths = np.linalg.norm(np.diff(positions, axis=0), axis=1)
    if np.any(lengths == 0.0):
        node = int(np.argmax(lengths == 0.0))
        raise InputError(f"{label}: nodes {node} and {node + 1} coincide; move them apart.")
    if filament_type.maximum_extension is not None:
        _check_extension(filament_type, lengths, label)
    _check_folds(filament_type, positions, label)


def _check_extension(filament_type, lengths, label):
    extension = np.abs(lengths - filament_type.segment_length)
    segment = int(np.argmax(extension))
    if extension[segment] >= filament_type.maximum_extension:
        raise InputError(
            f"{label}: segment {segment} is {lengths[segment]:.4g} nm long, outside the FENE potential's "
            f"{filament_type.segment_length:g} -/+ {filament_type.maximum_extension:g} nm."
        )
