"""Linkers of a type as ``Filaments.add_linkers`` keeps them, and what they do in a Context."""

import math
import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import openmm

from ..couplings.shapes import Shape
from ..couplings.walls import as_filament_wall_force
from ..errors import InputError, LinkerWarning
from ..units.quantities import (
    DIFFUSION,
    LENGTH,
    VOLUME,
    as_number_density,
    in_units_of,
    non_negative,
    positive,
    shown,
    thermal_energy,
    true_or_false,
    whole_number,
)
from ..units.types import FloatArray, Scalar
from .crosslinker import Crosslinker

MOST_LINKERS = 10**9
"""They are numbered by 32 bits."""

LARGEST_REACH_OF_WIDTH = 10.0
"""How many thermal extensions of a spring without rest length a reach may be before that is warned of."""

LARGEST_EXPONENT_AT_REACH = 3.0
"""By which exponent binding may be slower everywhere within reach of a spring of rest length before it is warned of."""

_CLOSED = ("sphere", "box", "ellipsoid", "capsule", "torus")
"""Regions of walls that have a volume."""


@dataclass(frozen=True)
class Linkers:
    """Linkers of one type, before they are in a System.

    Attributes
    ----------
    count : int
        How many there are to begin with.
    concentration : float or None
        Of those that are not bound, in 1/nm^3, if it does not change.
    volume : float or None
        Of those that are not bound, in nm^3; the periodic box if None.
    anchors : (count,) int array of particles, (count, 3) array of points in nm, or None
    bound : int
        How many begin with their first hand bound at random places, or their only one within reach of its anchor.
    seed : int
        Of these places.
    diffusion : float or None
        Of those that are not bound, in nm^2/ps, if they have positions of their own.
    planar : bool
        Whether these stay in the plane z = 0.
    region : tuple of Shape
        All of which they are within then; the walls of the System if there are none.
    places : tuple of tuples of (filament, arc length)
        Where the one hand, or both, of those begin bound, in nm from the first node, if that is given.
    """

    kind: Crosslinker
    count: int
    concentration: float | None
    volume: float | None
    anchors: np.ndarray | None
    bound: int
    seed: int
    diffusion: float | None = None
    planar: bool = False
    region: tuple[Shape, ...] = ()
    places: tuple[tuple[tuple[int, float], ...], ...] | None = None


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
    diffusion: Scalar | None = None,
    planar: bool = False,
    region: Shape | Sequence[Shape] | None = None,
) -> Linkers:
    """Linkers from what a user gives; InputError if something is wrong, or missing."""
    if not isinstance(kind, Crosslinker):
        raise InputError(f"Linkers are described by a Crosslinker, not by {kind!r}.")
    label = f"Linkers {kind.name!r}:"
    seed = whole_number(seed, 0, f"{label} seed")
    if (count is not None) + (concentration is not None) + (anchors is not None) != 1:
        raise InputError(f"{label} give one of count, concentration and anchors.")
    coefficient = None if diffusion is None else non_negative(diffusion, DIFFUSION, f"{label} diffusion")
    if coefficient is not None and (count is None or volume is not None):
        raise InputError(
            f"{label} those that diffuse have a count, and neither a volume, which is that of the walls or the "
            "periodic box, nor a concentration or anchors."
        )
    if true_or_false(planar, f"{label} planar") and coefficient is None:
        raise InputError(f"{label} planar says how unbound linkers diffuse: give their diffusion.")
    shapes = _as_shapes(region, label)
    if shapes and coefficient is None:
        raise InputError(f"{label} a region is where unbound linkers diffuse: give their diffusion.")
    room = None if volume is None else positive(volume, VOLUME, f"{label} volume")
    if room is not None and count is None:
        raise InputError(
            f"{label} a volume is that of a count of unbound linkers: those with "
            f"{'a concentration' if anchors is None else 'anchors'} need none."
        )
    if kind.loading_distance is not None:
        if bound:
            raise InputError(f"{label} those with a loading_distance begin unbound: let them bind, or set_linkers.")
        if anchors is not None:
            raise InputError(f"{label} a linker with an anchor has one hand: loading_distance is of two.")
    if anchors is not None:
        if kind.hands[0] != kind.hands[1]:
            raise InputError(f"{label} a linker with an anchor has one hand, but this type has two that differ.")
        if kind.has_rules:
            raise InputError(
                f"{label} a linker with an anchor has one hand: cosine_range and trans_activated are of two."
            )
        places = _as_anchors(anchors, label)
        return Linkers(kind, len(places), None, None, places, _as_bound(bound, len(places), label), seed)
    if concentration is not None:
        density = as_number_density(concentration, f"{label} concentration")
        if bound:
            raise InputError(f"{label} give a count if some of them are to begin bound.")
        return Linkers(kind, 0, density, None, None, 0, seed)
    number = whole_number(count, 0, f"{label} count")
    if number > MOST_LINKERS:
        raise InputError(f"{label} count must be at most {MOST_LINKERS}, but is {number}.")
    begin = _as_bound(bound, number, label)
    return Linkers(kind, number, None, room, None, begin, seed, coefficient, planar, shapes)


def _as_shapes(region, label):
    shapes = (region,) if isinstance(region, Shape) else region
    if shapes is None:
        return ()
    if not isinstance(shapes, Sequence) or not shapes or not all(isinstance(own, Shape) for own in shapes):
        raise InputError(f"{label} region must be a Shape such as Sphere, or several, but is {shown(region)}.")
    return tuple(shapes)


def refuse_barriers_without_linkers(linkers: Sequence[Linkers], barriers: Sequence[object]) -> None:
    """Raise InputError for barriers that have nothing to capture."""
    if barriers and not linkers:
        raise InputError("There are barriers, but no linkers that they could capture: add some, or leave barriers out.")


def refuse_linkers_without_volume(linkers: Sequence[Linkers], system: openmm.System) -> None:
    """Raise InputError for linkers that move freely in a System without a periodic box, in no volume."""
    for own in linkers:
        if own.diffusion is not None:
            _refuse_without_region(own, system)
            continue
        free = own.anchors is None and own.concentration is None and own.volume is None
        if free and not system.usesPeriodicBoundaryConditions():
            raise InputError(
                f"Linkers {own.kind.name!r} need a volume or a concentration, since there is no periodic box: give "
                "add_linkers one of them, or box_vectors to the System."
            )


def _refuse_without_region(linkers, system):
    walls = [own.region for own in linkers.region]
    if not walls:
        forces = [own for own in map(as_filament_wall_force, system.getForces()) if own is not None]
        sides = [(force.getSide(), tuple(force.getRegion())) for force in forces]
        walls = [wall for side, wall in sides if side == "inside" or (side == "outside" and wall[0] == "plane")]
    if not is_closed(walls, system.usesPeriodicBoundaryConditions()):
        raise InputError(
            f"Linkers {linkers.kind.name!r} diffuse, and need a region: give add_linkers one (a Sphere, Box, Capsule, "
            "Torus or Ellipsoid, or a Cylinder with a Slab across it), add a filament_wall_force of such a shape to "
            "the System, or give that box_vectors, in which there may be a Slab or a Cylinder."
        )


def is_closed(walls: Sequence[tuple[Any, ...]], periodic: bool) -> bool:
    """Whether walls, as a CylinderChainWallForce has their regions, and a periodic box leave a volume."""
    names = [wall[0] for wall in walls]
    if any(name in _CLOSED for name in names) or (periodic and "plane" not in names):
        return True
    axes = [
        [np.array(getattr(wall[2], "_value", wall[2])) for wall in walls if wall[0] == name]
        for name in ("cylinder", "slab")
    ]
    return any(abs(first @ second) > 1.0 - 1e-9 for first in axes[0] for second in axes[1])


def warn_if_springs_do_not_fit(kind: Crosslinker, temperature: Scalar) -> None:
    """Warn where a spring hardly lets hands bind, whatever their rates are.

    That is one which is much longer at rest than hands reach; or one without rest length that is so stiff that they
    bind only very near to the other end: its length in equilibrium has the standard deviation (k_BT/k)^(1/2) along each
    axis, and binding at the distance d from the other end is slower by exp(-k d^2/(2 k_BT)).
    """
    if kind.loading_distance is not None:
        return
    if kind.rest_length > 0.0:
        _warn_if_reach_is_short(kind, temperature)
        return
    width = math.sqrt(thermal_energy(temperature) / kind.stiffness)
    reach = max(hand.reach for hand in kind.hands if hand.binding_rate > 0.0) if _any_binds(kind) else 0.0
    if reach > LARGEST_REACH_OF_WIDTH * width:
        shorter = (
            f"; or, if that is what is meant, a reach of about {4.0 * width:.3g} nm with a binding_rate smaller in "
            "proportion"
        )
        warnings.warn(
            f"Linkers {kind.name!r}: a reach of {reach:.4g} nm is far beyond what their spring allows: with the "
            f"stiffness {kind.stiffness:.4g} kJ/(mol nm^2) and no rest length, its thermal extension is {width:.3g} "
            f"nm, so that hands bind to hardly anything farther than {3.0 * width:.3g} nm away. Give it a rest_length, "
            f"as long as the linker is, or a smaller stiffness{shorter if width > 0.0 else ''}.",
            LinkerWarning,
            stacklevel=3,
        )


def _warn_if_reach_is_short(kind, temperature):
    for hand in dict.fromkeys(kind.hands):
        exponent = -(1.0 - hand.strain_share) * kind.energy_at_reach(hand, temperature)
        if hand.binding_rate > 0.0 and exponent > LARGEST_EXPONENT_AT_REACH:
            warnings.warn(
                f"Linkers {kind.name!r}: a hand with a reach of {hand.reach:.4g} nm binds only where the spring, with "
                f"its rest length of {kind.rest_length:.4g} nm, is compressed, and thus slower by exp({-exponent:.3g}) "
                "at least. Give it a reach somewhat beyond the rest length, or a smaller stiffness.",
                LinkerWarning,
                stacklevel=4,
            )
            return


def _any_binds(kind):
    return any(hand.binding_rate > 0.0 for hand in kind.hands)


def _as_bound(bound, count, label):
    number = whole_number(bound, 0, f"{label} bound")
    if number > count:
        raise InputError(f"{label} {number} are to begin bound, but there are only {count}.")
    return number


def _as_anchors(anchors, label):
    try:
        plain = np.asarray(getattr(anchors, "_value", anchors))
    except ValueError:
        plain = np.asarray(None)
    if plain.ndim == 1 and plain.dtype.kind in "iu":
        if len(plain) and plain.min() < 0:
            raise InputError(f"{label} particles of anchors cannot be negative.")
        return plain
    points = np.asarray(in_units_of(anchors, LENGTH, f"{label} anchors"))
    if points.ndim != 2 or points.shape[1] != 3:
        raise InputError(f"{label} anchors must be particle indices (n,) or points (n, 3), but have {points.shape}.")
    return points
