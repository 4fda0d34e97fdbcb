"""Linkers of a type as ``Filaments.add_linkers`` keeps them, and what they do in a Context."""

from dataclasses import dataclass

import numpy as np
from openmm import unit

from ..errors import InputError
from ..units.quantities import LENGTH, NUMBER_DENSITY, VOLUME, in_units_of, non_negative, positive, whole_number
from ..units.types import FloatArray, Scalar
from .crosslinker import Crosslinker


@dataclass(frozen=True)
class Linkers:
    """Linkers of one type, before they are in a System.

    Attributes
    ----------
    kind : Crosslinker
    count : int
        How many there are to begin with.
    concentration : float or None
        Of those that are not bound, in 1/nm^3, if it does not change.
    volume : float or None
        Of those that are not bound, in nm^3; the periodic box if None.
    anchors : (count,) int array of particles, (count, 3) array of points in nm, or None
    bound : int
        How many begin with their first hand bound, or their only one, at random places.
    seed : int
        Of these places.
    """

    kind: Crosslinker
    count: int
    concentration: float | None
    volume: float | None
    anchors: np.ndarray | None
    bound: int
    seed: int


@dataclass(frozen=True)
class LinkerPulls:
    """What the springs of linkers do that join two places.

    Attributes
    ----------
    numbers : (n,) int array
        Of linkers.
    types : (n,) int array
        What ``Filaments.add_linkers`` returned for their types.
    places : (n, 2, 3) array
        The first hand or the anchor, and the second hand, in nm; the second one is the image next to the first.
    lengths : (n,) array
        In nm.
    forces : (n, 3) array
        On the first place, in kJ/(mol nm); the opposite one acts on the second.
    """

    numbers: np.ndarray
    types: np.ndarray
    places: FloatArray
    lengths: FloatArray
    forces: FloatArray


def as_linkers(
    kind: Crosslinker,
    count: int | None,
    concentration: Scalar | None,
    volume: Scalar | None,
    anchors: object,
    bound: int,
    seed: int,
) -> Linkers:
    """Linkers from what a user gives; InputError if something is wrong, or missing."""
    if not isinstance(kind, Crosslinker):
        raise InputError(f"Linkers are described by a Crosslinker, not by {kind!r}.")
    label = f"Linkers {kind.name!r}:"
    if (count is not None) + (concentration is not None) + (anchors is not None) != 1:
        raise InputError(f"{label} give one of count, concentration and anchors.")
    room = None if volume is None else positive(volume, VOLUME, f"{label} volume")
    if anchors is not None:
        if kind.hands[0] != kind.hands[1]:
            raise InputError(f"{label} a linker with an anchor has one hand, but this type has two that differ.")
        places = _as_anchors(anchors, label)
        return Linkers(kind, len(places), None, room, places, _as_bound(bound, len(places), label), seed)
    if concentration is not None:
        density = _as_density(concentration, f"{label} concentration")
        if bound:
            raise InputError(f"{label} give a count if some of them are to begin bound.")
        return Linkers(kind, 0, density, room, None, 0, seed)
    number = whole_number(count, 0, f"{label} count")
    return Linkers(kind, number, None, room, None, _as_bound(bound, number, label), seed)


def _as_bound(bound, count, label):
    number = whole_number(bound, 0, f"{label} bound")
    if number > count:
        raise InputError(f"{label} {number} are to begin bound, but there are only {count}.")
    return number


def _as_density(concentration, name):
    # A number of linkers in a volume, or an amount of substance such as 1 uM.
    if isinstance(concentration, unit.Quantity) and concentration.unit.is_compatible(unit.molar):
        concentration = concentration * unit.AVOGADRO_CONSTANT_NA
    return non_negative(concentration, NUMBER_DENSITY, name)


def _as_anchors(anchors, label):
    plain = np.asarray(getattr(anchors, "_value", anchors))
    if plain.ndim == 1 and plain.dtype.kind in "iu":
        if len(plain) and plain.min() < 0:
            raise InputError(f"{label} particles of anchors cannot be negative.")
        return plain
    points = np.asarray(in_units_of(anchors, LENGTH, f"{label} anchors"))
    if points.ndim != 2 or points.shape[1] != 3:
        raise InputError(f"{label} anchors must be particle indices (n,) or points (n, 3), but have {points.shape}.")
    return points
