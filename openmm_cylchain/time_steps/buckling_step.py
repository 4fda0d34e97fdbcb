"""The recommended step of filaments that forces known before a run compress: it resolves how fast they buckle.

A filament under a compressive force P bends as ``zeta dy/dt = -EI y'''' - P y''``, with the friction zeta per length
across it. A wave of wave number q grows with the rate (P q^2 - EI q^4)/zeta, the fastest, q^2 = P/2EI, with P^2/(4 EI
zeta). An end on which a constant force presses, and which nothing holds, turns away four times as fast: P^2/(EI zeta).
That is the solution y = A exp(p x) + B exp(p* x) with y'' = 0 and EI y''' + P y' = 0 at the end, which is
p = (P/EI)^(1/2) exp(2 pi i/3). Neither depends on the length of the filament; below Euler's load nothing grows, and
what the rates allow there is longer than the step of the filament. Waves shorter than a segment do not grow: no rate is
above P l0/gamma_rot, with which a segment turns.

Compression acts on a segment as it is in the middle of a step, where bends resist as they are at its end. So a mode of
the rate lambda grows in a step h by (1 + theta z)/(1 - (1 - theta) z) with z = lambda h, by 1 + z at long ones: rates
come out too low by z/2. Measured over P^2/(EI zeta) at 100 times Euler's load: 0.964 at z = 0.1 and 0.926 at 0.2 with
scheme "implicit", 0.990 and 0.962 with "implicit-second-order". The explicit schemes grow by 1 + z.

P is that of a straight filament whose lengths have come to rest, while it has not begun to bend: of constant forces,
tethers and propulsion along the line between its ends, against the friction along it or what holds its nodes.
"""

import math
from collections.abc import Mapping

import numpy as np
import scipy

from ..filaments.collection import FilamentCollection
from ..filaments.filament import Filament, Tether
from ..units.quantities import PICONEWTON
from ..units.types import FloatArray
from .time_step import TimeStep

_SHARE_OF_RATE = {"implicit-second-order": 0.15}
_SHARE_OF_RATE_OF_OTHERS = 0.09
# Of its length, between the ends of a filament: one that is more bent has no direction along which it is compressed.
_STRAIGHT = 0.5
_ROUNDING = 1e-9


def steps_of_buckling(
    filaments: FilamentCollection, scheme: str, constant_forces: Mapping[int, FloatArray]
) -> list[TimeStep]:
    """The TimeSteps of filaments that known forces compress, one for each type: of the one that is pressed most.

    The step is 0.09 over the fastest rate with which it buckles, or 0.15 over it with scheme "implicit-second-order":
    growth rates are then right within 5 %. Filaments are as they begin. Constant forces, (3,) in kJ/(mol nm), are by
    the particle that they act on.
    """
    tethers: dict[int, list[Tether]] = {}
    for tether in filaments.tethers:
        tethers.setdefault(tether.filament, []).append(tether)
    fastest: dict[str, tuple[float, float, int]] = {}
    for number, filament in enumerate(filaments):
        # Without forces, filaments need not be in a System.
        nodes = filaments.node_indices[number].tolist() if constant_forces else []
        loads = {node: constant_forces[one] for node, one in enumerate(nodes) if one in constant_forces}
        own = tethers.get(number, [])
        if filament.closed or not (loads or own or (filament.propulsion and filament.clamped)):
            continue
        compression, at_end = _compression(filament, loads, own)
        rate = _growth_rate(filament, filaments, compression, at_end)
        if rate > fastest.get(filament.type.name, (0.0,))[0]:
            fastest[filament.type.name] = rate, max(compression, at_end), number
    return [_time_step(name, scheme, *found) for name, found in fastest.items()]


def _time_step(name, scheme, rate, compression, number):
    share = _SHARE_OF_RATE.get(scheme, _SHARE_OF_RATE_OF_OTHERS)
    what = f"buckling of {name}, filament {number}"
    reason = (
        f"{what}: compressed with {compression / PICONEWTON:.3g} pN, it grows with up to {rate * 1e12:.3g}/s, "
        f"of which a step may take {share:g}"
    )
    return TimeStep(share / rate, reason, {what: 1.0 / rate}, {what: share / rate})


def _growth_rate(filament, filaments, compression, at_end):
    kind = filament.type
    friction = kind.segment_friction(filaments.viscosity, filaments.temperature, filament.segments)
    per_length = friction.perpendicular / kind.segment_length
    # What does not bend, turns.
    inside = compression if filament.bends else 0.0
    square = max(inside**2 / 4.0, at_end**2)
    if square == 0.0:
        return 0.0
    waves = square / (kind.bending_rigidity * per_length) if kind.bending_rigidity > 0.0 else math.inf
    if not kind.segment_kind.straight:
        return waves
    return min(waves, max(inside, at_end) * kind.segment_length / friction.rotational)


def _compression(filament: Filament, loads: Mapping[int, FloatArray], tethers: list[Tether]) -> tuple[float, float]:
    # The largest compressive force of all segments, and that at an end which nothing holds.
    positions, count = filament.positions, len(filament.positions)
    chord = positions[-1] - positions[0]
    distance = float(np.linalg.norm(chord))
    if distance < _STRAIGHT * filament.type.segment_lengths(filament.segments).sum():
        return 0.0, 0.0
    along = chord / distance
    forces = np.zeros(count)
    forces[:-1] += 0.5 * filament.propulsion
    forces[1:] += 0.5 * filament.propulsion
    for node, load in loads.items():
        forces[node] += load @ along
    held = np.zeros(count)
    for tether in tethers:
        forces[tether.node] += tether.stiffness * ((np.array(tether.point) - positions[tether.node]) @ along)
        held[tether.node] += tether.stiffness
    stiffness = filament.type.segment_stiffnesses(filament.segments)
    fixed = list(filament.clamped)
    forces[fixed] = 0.0
    held[fixed] = 1e6 * stiffness.max()
    if held.any():
        moved = displacements(stiffness, held, forces)
        tension = stiffness * np.diff(moved)
    else:
        friction = np.full(count, 1.0)
        friction[[0, -1]] = 0.5
        tension = -np.cumsum(forces - friction * forces.sum() / friction.sum())[:-1]
    tension[np.abs(tension) < _ROUNDING * np.abs(forces).sum()] = 0.0
    ends = [0.0] + [-tension[end] for end in (0, -1) if held[end] == 0.0]
    return max(0.0, float(-tension.min())), float(max(ends))


def displacements(stiffness: FloatArray, held: FloatArray, forces: FloatArray) -> FloatArray:
    """Of the nodes of a chain of springs along a line, at rest under forces (nodes,) or (nodes, 3).

    ``held`` (nodes,) are the stiffnesses of springs that hold nodes.
    """
    bands = np.zeros((2, len(held)))
    bands[0, 1:] = -stiffness
    bands[1] = held
    bands[1, :-1] += stiffness
    bands[1, 1:] += stiffness
    return scipy.linalg.solveh_banded(bands, forces)
