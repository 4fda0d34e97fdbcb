"""What a check of a step looks at: kinds of filaments, and the values of one frame of a Context."""

import copy
import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import openmm
import scipy

from ..couplings.chain_forces import is_chain_force
from ..couplings.pulling import is_constant_force
from ..filaments.collection import FilamentCollection
from ..filaments.filament import Filament
from ..filaments.twist import has_twist
from ..kinetics.binding_force import find_binding_force
from ..units.quantities import thermal_energy
from ..units.types import FloatArray, IntArray, Scalar

STEPS_PER_FRAME = 10
"""Steps h between two looks at both runs."""

_MODES = 3
_LAST_GROUP = 30
_WITHOUT_ENERGY = (openmm.CMMotionRemover, openmm.MonteCarloBarostat)


@dataclass(frozen=True)
class Kind:
    """Filaments that are equal but for their positions."""

    label: str
    filament: Filament
    numbers: list[int]
    nodes: IntArray
    control_points: IntArray


def _kinds(filaments):
    groups: dict[Any, list[int]] = {}
    frames: dict[int, list[Any]] = {}
    for own in filaments.end_frames:
        frames.setdefault(own.filament, []).append(own)
    for number, one in enumerate(filaments):
        key = (one.type, one.segments, one.closed, one.planar, one.clamped, one.clamped_tangents, one.propulsion)
        own_frames = sorted(frames.get(number, []), key=lambda frame: frame.end)
        key += (one.rest_bends, *(replace(frame, filament=0, body=frame.body and 0) for frame in own_frames))
        groups.setdefault(key, []).append(number)
    kinds: list[Kind] = []
    for numbers in groups.values():
        first = filaments[numbers[0]]
        label = first.type.name if len(groups) == 1 else f"{first.type.name} x {first.segments}"
        if label in [kind.label for kind in kinds]:
            label += f" (filament {numbers[0]})"
        nodes, control_points = (
            np.array([own[number] for number in numbers])
            for own in (filaments.node_indices, filaments.control_point_indices)
        )
        kinds.append(Kind(label, first, numbers, nodes, control_points))
    return kinds


class Probe:
    """What is looked at in a Context: names, units, and values of one frame."""

    def __init__(self, filaments: FilamentCollection, system: openmm.System, temperature: Scalar) -> None:
        self._temperature, self._kT = temperature, thermal_energy(temperature)
        self._filaments = filaments
        self.kinds = _kinds(filaments)
        self._system = system
        chains = [np.zeros(0, dtype=int), *filaments.node_indices, *filaments.control_point_indices]
        outside = np.setdiff1d(np.arange(system.getNumParticles()), np.concatenate(chains))
        mobile = [system.getParticleMass(int(index))._value != 0.0 for index in outside]
        self._particles = outside[np.array(mobile, dtype=bool)]
        self._has_linkers = find_binding_force(system) is not None
        self._groups: dict[int, tuple[str, list[int]]] = {}
        for count, (index, force) in enumerate(
            (index, force)
            for index, force in _other_forces(system)
            if not isinstance(force, _WITHOUT_ENERGY) and not is_constant_force(force)
        ):
            name = f"{force.getName()} (force {index})"
            group = min(count + 1, _LAST_GROUP)
            label = name if count + 1 < _LAST_GROUP else "further forces"
            self._groups.setdefault(group, (label, []))[1].append(index)
        self.rows = list(self._describe())

    def grouped_system(self) -> openmm.System:
        """A copy of the System in which each force that is looked at has a group of its own."""
        system = copy.deepcopy(self._system)
        for force in system.getForces():
            force.setForceGroup(0)
        for group, (_, indices) in self._groups.items():
            for index in indices:
                system.getForce(index).setForceGroup(group)
        return system

    def _describe(self):
        # Name, unit, kind and what it is, in the order of the values.
        for kind in self.kinds:
            yield f"{kind.label} stretching energy", "k_B T", kind, "stretching"
            yield f"{kind.label} bending energy", "k_B T", kind, "bending"
            across = "across" if kind.filament.closed else "end to end"
            yield f"{kind.label} {across}, mean square", "nm^2", kind, "distance"
            if has_twist(kind.filament.type):
                yield f"{kind.label} twist energy", "k_B T", kind, "twist"
                yield f"{kind.label} twist, mean square", "radian^2", kind, "twist"
            for mode in range(1, self._modes(kind) + 1):
                yield f"{kind.label} bending mode {mode}, change", "nm", kind, "mode"
            yield f"{kind.label} middle, displacement", "nm^2", kind, "middle"
        if len(self._particles):
            yield "particles, displacement", "nm^2", None, "particles"
            yield "particles, from where they began", "nm^2", None, "particles"
        if self._filaments.tethers:
            yield "tethers", "k_B T", None, "tethers"
        if self._has_linkers:
            yield "hands that are bound", "", None, "linkers"
        for label, _ in self._groups.values():
            yield label, "k_B T", None, "force"

    @staticmethod
    def _modes(kind):
        return 0 if kind.filament.closed else min(_MODES, kind.filament.segments - 1)

    def measure(self, context: openmm.Context, before: list[Any] | None) -> tuple[list[FloatArray], list[Any]]:
        """Values, (filaments,) or (1,) each, of this frame, and what the next one needs of it."""
        positions = context.getState(positions=True).getPositions(asNumpy=True)._value
        values, after = [], []
        with np.errstate(all="ignore"):
            for index, kind in enumerate(self.kinds):
                own, kept = self._measure_kind(kind, context, positions, None if before is None else before[index])
                values += own
                after.append(kept)
            if len(self._particles):
                own = positions[self._particles]
                last, start = (own, own) if before is None else before[-1]
                values += [np.sum((own - one) ** 2, axis=1) for one in (last, start)]
                after.append((own, start))
            if self._filaments.tethers:
                values.append(self._tether_energy(positions))
            if self._has_linkers:
                values.append(np.array([float(self._filaments.in_context(context).linkers().bound.sum())]))
        return values + self.energies(context), after

    def energies(self, context: openmm.Context) -> list[FloatArray]:
        """Of the forces beside those of filaments, (1,) each: the last of the rows."""
        states = (context.getState(energy=True, groups=1 << group) for group in self._groups)
        return [np.array([state.getPotentialEnergy()._value / self._kT]) for state in states]

    def mode_amplitudes(self, context: openmm.Context) -> list[FloatArray]:
        """Of each kind of open filaments, the mean square amplitude in nm of every bending mode, from the first on."""
        positions = context.getState(positions=True).getPositions(asNumpy=True)._value
        found = []
        for kind in self.kinds:
            if not kind.filament.closed:
                vectors = np.diff(positions[kind.nodes], axis=1)
                tangents = vectors / np.linalg.norm(vectors, axis=2)[..., None]
                # Twice the sum over cosines of the middles of segments.
                amplitudes = 0.5 * scipy.fft.dct(tangents, type=2, axis=1)[:, 1:] * self._scale(kind)
                found.append(np.mean(np.sum(amplitudes**2, axis=2), axis=0))
        return found

    def equilibrium_amplitudes(self) -> list[FloatArray]:
        """What those are for free filaments, 2 k_B T/(EI q^2) with the wave number q, or less where they are coils."""
        found = []
        for kind in self.kinds:
            if not kind.filament.closed:
                one, count = kind.filament.type, kind.filament.segments
                waves = np.pi * np.arange(1, count) / (count * one.segment_length)
                with np.errstate(divide="ignore"):
                    stiff = 2.0 * self._kT / (one.bending_rigidity * waves**2)
                found.append(np.minimum(stiff, 2.0 * one.segment_length * count))
        return found

    def _scale(self, kind):
        return math.sqrt(2.0 * kind.filament.type.segment_length / kind.filament.segments)

    def _measure_kind(self, kind, context, positions, before):
        filament, nodes = kind.filament, positions[kind.nodes]
        closed = filament.closed
        vectors = np.diff(nodes, axis=1, append=nodes[:, :1]) if closed else np.diff(nodes, axis=1)
        lengths = np.linalg.norm(vectors, axis=2)
        tangents = vectors / lengths[..., None]
        half = nodes.shape[1] // 2
        ends = nodes[:, half if closed else -1] - nodes[:, 0]
        middle = nodes[:, half]
        modes = np.arange(1, self._modes(kind) + 1)
        waves = np.cos(np.outer(modes, np.pi * (np.arange(filament.segments) + 0.5) / filament.segments))
        amplitudes = self._scale(kind) * np.einsum("ms,fsk->mfk", waves, tangents)
        moved = [amplitudes, middle] if before is None else [amplitudes - before[0], middle - before[1]]
        if filament.rest_bends is None:
            energies = filament.energies_along(nodes, positions[kind.control_points], self._temperature)
        else:
            own = self._filaments.in_context(context)
            found = [own.energies(number) for number in kind.numbers]
            energies = [np.array([one[which]._value for one in found]) for which in (0, 1)]
        # Of a single straight segment, nothing bends.
        values = [*(own.sum(axis=1) / max(1, own.shape[1]) / self._kT for own in energies), np.sum(ends**2, axis=1)]
        if has_twist(filament.type):
            values += self._measure_twist(kind, context)
        values += [*np.sum(moved[0] ** 2, axis=2), np.sum(moved[1] ** 2, axis=1)]
        return values, (amplitudes, middle)

    def _measure_twist(self, kind, context):
        own = self._filaments.in_context(context)
        twists = np.array([own.twists(number)._value for number in kind.numbers])
        # Without those to frames of ends, or of the first frame of a ring.
        twists = twists[:, : kind.filament.segments] if kind.filament.closed else twists[:, 1:-1]
        twists = twists - kind.filament.type.rest_twist
        energies = 0.5 * kind.filament.type.twist_stiffness * np.sum(twists**2, axis=1) / max(1, twists.shape[1])
        return [energies / self._kT, np.sum(twists, axis=1) ** 2]

    def _tether_energy(self, positions):
        energy = 0.0
        for tether in self._filaments.tethers:
            node = self._filaments.node_indices[tether.filament][tether.node]
            energy += 0.5 * tether.stiffness * np.sum((positions[node] - tether.point) ** 2)
        return np.array([energy / self._kT])


def interacting(filaments: FilamentCollection, system: openmm.System) -> bool:
    """Whether anything but their own forces acts on filaments."""
    return bool(filaments.tethers) or any(
        not isinstance(force, openmm.CMMotionRemover) for _, force in _other_forces(system)
    )


def _other_forces(system):
    return [(index, force) for index, force in enumerate(system.getForces()) if not is_chain_force(force)]
