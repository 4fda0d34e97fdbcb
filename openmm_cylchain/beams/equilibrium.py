"""Equilibrium of free chains of beam elements: draws, and the rigidity that has a given persistence length.

Positions and control points are linear in the vectors r' at the nodes, t, and in the middles of elements, u, so the
measure is flat in these: directions are uniform on the sphere, lengths have the weight of their square. Seen from u,
the bends alpha (from t_i to u) and beta (from u to t_(i+1)) are vectors across it, with the density

    sin(alpha) sin(beta)/(alpha beta) exp(-(EI/2h k_B T) (|alpha + beta|^2 + (4/3) |d|^2)) d^2 alpha d^2 beta

where d = (beta - alpha) (1 + ...) is that of ``curve.element_energies``. In a plane they are angles, without the sines.
The strain in the middle, e = |u| - 1 - |t_i + t_(i+1) - 2u|^2/40 + ..., adds the factor |u|^2 d|u|/de, which favours
bends a little: those of an element a quarter of a persistence length long have 1.5 % more of <theta^2> for it. Elements
are drawn one behind the other, by rejection from the normal distribution that has beta - alpha in place of d.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import numpy.typing as npt
import scipy

from ..errors import InputError
from ..mechanics.geometry import cross
from ..units.types import FloatArray
from .curve import BeamElement, control_points_of, shortening_of

LONGEST_ELEMENT = 1.0
"""Of an element, in persistence lengths: the engine cannot step longer ones."""

_WIDEST_STRAIN = 8.0
_WIDEST_BEND = 7.0


def draw_beam(
    element: BeamElement,
    elements: int,
    kT: float,
    generator: np.random.Generator,
    start: npt.ArrayLike,
    direction: FloatArray | None,
    planar: bool,
) -> tuple[FloatArray, FloatArray]:
    """Nodes and control points, (elements + 1, 3) in nm each, of a free chain drawn from its equilibrium.

    It is exact but for products of strains and bends.

    Parameters
    ----------
    kT : float
        In kJ/mol, above zero.
    start : (3,) array, nm
        Position of the first node.
    direction : (3,) array, optional
        Unit vector of the tangent there; drawn from the sphere, or the circle, if not given.
    planar : bool
        In the plane z = start[2].

    Raises
    ------
    InputError
        For elements of more than a persistence length.
    """
    bend = element.length * kT / element.rigidity
    if bend > LONGEST_ELEMENT:
        raise InputError(
            f"elements are {bend:.3g} persistence lengths long, and must not be longer than {LONGEST_ELEMENT:g}: take "
            "a shorter segment_length."
        )
    lengths = _node_lengths(element, elements + 1, kT, generator, 1 if planar else 2)
    first, middle, last = _drawn_elements(element, bend, lengths, kT, generator, planar)
    if direction is None:
        direction = _random_direction(generator, planar)
    # Rows are axes: the first along the tangent. Each element begins along the tangent, turned about it at random.
    begins, ends = _frames(first, planar), _frames(last, planar)
    if not planar:
        begins = _turned_about(begins, generator.uniform(0.0, 2.0 * np.pi, elements))
    frame = _frames(np.asarray(direction, dtype=float)[None], planar)[0]
    tangents, chords = [lengths[0] * frame[0]], []
    inner = (middle + 0.25 * (first + last)) * (element.length / 1.5)
    for begin, end, chord, t in zip(begins, ends, inner, last):
        turned = frame.T @ begin
        chords.append(turned @ chord)
        tangents.append(turned @ t)
        frame = end @ turned.T
    nodes = np.asarray(start, dtype=float) + np.concatenate([np.zeros((1, 3)), np.cumsum(chords, axis=0)])
    control_points = control_points_of(nodes, np.array(tangents), element.length)
    if planar:
        nodes[:, 2] = control_points[:, 2] = nodes[0, 2]
    return nodes, control_points


def _random_direction(generator, planar):
    if planar:
        angle = generator.uniform(0.0, 2.0 * np.pi)
        return np.array([np.cos(angle), np.sin(angle), 0.0])
    vector = generator.normal(size=3)
    return vector / np.linalg.norm(vector)


def _frames(vectors, planar):
    # Rows of each: the direction of a vector and two axes across it; in a plane, z is the last.
    directions = vectors / np.linalg.norm(vectors, axis=1, keepdims=True)
    if planar:
        third = np.broadcast_to([0.0, 0.0, 1.0], directions.shape)
        second = cross(third, directions)
    else:
        away = np.eye(3)[np.argmin(np.abs(directions), axis=1)]
        second = cross(directions, away)
        second /= np.linalg.norm(second, axis=1, keepdims=True)
        third = cross(directions, second)
    return np.stack([directions, second, third], axis=1)


def _turned_about(frames, angles):
    # About their first axes.
    cosine, sine = np.cos(angles)[:, None], np.sin(angles)[:, None]
    second, third = frames[:, 1], frames[:, 2]
    return np.stack([frames[:, 0], cosine * second + sine * third, cosine * third - sine * second], axis=1)


def _node_lengths(element, nodes, kT, generator, power):
    # |t| of every node: a strain of the variance k_B T/(K h share), and the measure of its length.
    share = np.full(nodes, 1.0 / 3.0)
    share[[0, -1]] = 1.0 / 6.0
    width = np.sqrt(kT / (element.modulus * element.length * share))
    lengths, wanted = np.ones(nodes), np.arange(nodes)
    while len(wanted):
        drawn = 1.0 + width[wanted] * generator.normal(size=len(wanted))
        chance = (np.maximum(drawn, 0.0) / (1.0 + _WIDEST_STRAIN * width[wanted])) ** power
        taken = generator.random(len(wanted)) < chance
        lengths[wanted[taken]] = drawn[taken]
        wanted = wanted[~taken]
    return lengths


def _drawn_elements(element, bend, lengths, kT, generator, planar):
    # Vectors r' of every element at its first node, in its middle (along x) and at its second node: (elements, 3) each.
    elements = len(lengths) - 1
    first, middle, last = np.zeros((3, elements, 3))
    width = np.sqrt(1.5 * kT / (element.modulus * element.length))
    power = 1 if planar else 2
    wanted = np.arange(elements)
    while len(wanted):
        count = len(wanted)
        total, apart = np.sqrt(bend) * generator.normal(size=(2, count, 1 if planar else 2))
        apart *= np.sqrt(0.75)
        t1 = lengths[wanted, None] * _turned(-0.5 * (total - apart))
        t2 = lengths[wanted + 1, None] * _turned(0.5 * (total + apart))
        turn, square = np.sum((t2 - t1) ** 2, axis=1), np.sum(apart**2, axis=1)
        scale = 1.0 + turn / 40.0 + turn**2 / 560.0 + square / 84.0
        chance = np.exp(-(2.0 / 3.0) / bend * (scale**2 - 1.0) * square)
        if not planar:
            chance *= _sinc(total - apart) * _sinc(total + apart)
        strain = width * generator.normal(size=count) - 1.5 * element.shortening
        length, slope = middle_length(strain, (t1 + t2)[:, 0], np.sum((t1 + t2) ** 2, axis=1), turn)
        # At most 1.5 for bends and 1 + 8 standard deviations for strains.
        chance *= length**power * slope / (1.6 * (1.0 + _WIDEST_STRAIN * width) ** 3)
        taken = generator.random(count) < chance
        chosen = wanted[taken]
        first[chosen], last[chosen], middle[chosen, 0] = t1[taken], t2[taken], length[taken]
        wanted = wanted[~taken]
    return first, middle, last


def middle_length(
    strain: FloatArray | float, along: FloatArray | float, square: FloatArray | float, turn: FloatArray | float
) -> tuple[FloatArray, FloatArray]:
    """|u| and d|u|/de of e = |u| - 1 - |t1 + t2 - 2u|^2/40 + turn^2/480 = strain, for a vector u in the middle.

    Parameters
    ----------
    strain, along, square, turn : arrays or floats
        e, (t1 + t2).u/|u|, |t1 + t2|^2 and |t2 - t1|^2.
    """
    half = 1.0 + 0.1 * along
    root = np.sqrt(np.maximum(half**2 - 0.4 * (1.0 + square / 40.0 - turn**2 / 480.0 + strain), 1e-12))
    return np.maximum(5.0 * (half - root), 0.0), 1.0 / root


def _turned(bends):
    # Unit vectors that are turned from x by bends (count, 1 or 2) towards the axes across it.
    angle = np.linalg.norm(bends, axis=1)
    vectors = np.zeros((len(bends), 3))
    vectors[:, 0] = np.cos(angle)
    vectors[:, 1 : 1 + bends.shape[1]] = np.sinc(angle / np.pi)[:, None] * bends
    return vectors


def _sinc(twice):
    # sin(a)/a of half a vector, zero where a direction would be reached a second time.
    angle = 0.5 * np.linalg.norm(twice, axis=1)
    return np.where(angle < np.pi, np.sinc(angle / np.pi), 0.0)


@dataclass(frozen=True)
class ElementAverages:
    """Averages of an element with stiff lengths, with its chord c over h and unit tangents t, t' at its ends.

    Attributes
    ----------
    cosine : float
        <t.t'>.
    bending : float
        Energy over k_B T.
    chord_along : float
        <c.t>.
    chord_square : float
        <c^2>.
    """

    cosine: float
    bending: float
    chord_along: float
    chord_square: float


def mean_cosine(bend: float) -> float:
    """<t.t'> between the ends of an element in space that is ``bend`` = h k_B T/EI long, with stiff lengths."""
    return element_averages(bend).cosine


@lru_cache(maxsize=64)
def element_averages(bend: float, planar: bool = False) -> ElementAverages:
    """Averages of an element that is ``bend`` = h k_B T/EI long, in space or in a plane, by quadrature over bends."""
    radii, weights = np.polynomial.legendre.leggauss(48)
    largest = min(np.pi, _WIDEST_BEND * np.sqrt(bend))
    radii, weights = 0.5 * largest * (1.0 + radii), 0.5 * largest * weights
    azimuths = np.array([0.0, np.pi]) if planar else np.pi * (np.arange(64) + 0.5) / 64
    a, b = radii[:, None, None], radii[None, :, None]
    cosine = np.cos(azimuths)
    total, apart = a**2 + b**2 + 2 * a * b * cosine, a**2 + b**2 - 2 * a * b * cosine
    ends = np.cos(a) * np.cos(b) - np.sin(a) * np.sin(b) * cosine
    turn = 2.0 - 2.0 * ends
    scale = 1.0 + turn / 40.0 + turn**2 / 560.0 + apart / 84.0
    energy = (total + 4.0 / 3.0 * apart * scale**2) / (2.0 * bend)
    density = np.exp(-energy) * (1.0 if planar else np.sin(a) * np.sin(b))
    # Of stiff lengths.
    square = 2.0 + 2.0 * ends
    length, slope = middle_length(-1.5 * shortening_of(bend, planar), np.cos(a) + np.cos(b), square, turn)
    density *= length ** (1 if planar else 2) * slope * weights[:, None, None] * weights[None, :, None]
    along = (length * np.cos(a) + 0.25 * (1.0 + ends)) / 1.5
    chord = (length**2 + 0.5 * length * (np.cos(a) + np.cos(b)) + square / 16.0) / 2.25
    density /= np.sum(density)
    return ElementAverages(*(float(np.sum(values * density)) for values in (ends, energy, along, chord)))


@lru_cache(maxsize=64)
def calibrated_rigidity(bend: float) -> float:
    """EI of elements over l_p k_B T, with which ``<t.t'> = exp(-h/l_p)`` between neighbouring nodes in space.

    ``bend`` is h/l_p, at most ``LONGEST_ELEMENT``.
    """
    return 1.0 / scipy.optimize.brentq(lambda factor: np.log(mean_cosine(bend * factor)) + bend, 0.9, 1.3, xtol=1e-10)
