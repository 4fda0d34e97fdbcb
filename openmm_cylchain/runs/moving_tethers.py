"""Tethers of a configuration whose points move at constant velocity, and what they pull with."""

import math

import numpy as np

from ..units.quantities import thermal_energy

_FINE = 0.05
"""Of the thermal width (k_BT/k)^(1/2) of a tether: how far its point may move at once."""


class MovingTethers:
    """Moves the points of tethers, at steps that follow from their numbers alone, so that a resumed run has the same.

    A point is at ``point + velocity max(0, t - start_time)`` at the last step at which points were moved: often enough
    that none moves by more than a twentieth of its thermal width at once, if steps allow it.

    Attributes
    ----------
    interval : int
        Steps from one motion to the next.
    """

    def __init__(self, configuration, filaments):
        self._filaments = filaments
        self._step = configuration.simulation.time_step
        self._tethers, velocities, starts = [], [], []
        number = 0
        for own in configuration.tethers:
            for _ in own.filaments:
                if own.velocity is not None:
                    self._tethers.append(number)
                    velocities.append(own.velocity)
                    starts.append(own.start_time)
                number += 1
        named = [filaments.tethers[number] for number in self._tethers]
        self._velocities = np.array(velocities, dtype=float).reshape(-1, 3)
        self._starts = np.array(starts, dtype=float)
        self._points = np.array([own.point for own in named], dtype=float).reshape(-1, 3)
        self._stiffness = np.array([own.stiffness for own in named])
        self._owners = [own.filament for own in named]
        speeds = np.linalg.norm(self._velocities, axis=1)
        self._directions = self._velocities / speeds[:, None]
        ends = [self._ends(own) for own in named]
        self._pulled, self._far, self._near = np.array(ends, dtype=int).reshape(-1, 3).T
        self.interval = 1
        if len(named):
            widths = np.sqrt(thermal_energy(configuration.solvent.temperature) / self._stiffness)
            steps = float(np.min(_FINE * widths / (speeds * self._step)))
            self.interval = max(1, min(configuration.simulation.steps_per_report, math.floor(steps)))

    def __len__(self):
        return len(self._tethers)

    def _ends(self, tether):
        nodes = self._filaments.node_indices[tether.filament]
        node = tether.node % len(nodes)
        ends = (nodes[0], nodes[-1]) if 2 * node >= len(nodes) - 1 else (nodes[-1], nodes[0])
        return nodes[node], *ends

    def _points_at(self, step):
        times = np.maximum(0.0, step // self.interval * self.interval * self._step - self._starts)
        return self._points + times[:, None] * self._velocities

    def move(self, context, step):
        """Put the points where they are from a step on."""
        if len(self):
            self._filaments.in_context(context).move_tethers(self._tethers, self._points_at(step))

    def rows(self, step, positions):
        """Lines of PULLING_TABLE_COLUMNS without the step, for positions (particles, 3) in nm.

        Points are those since the last motion before the step.
        """
        points = self._points_at(max(step - 1, 0))
        forces = self._stiffness * np.sum((points - positions[self._pulled]) * self._directions, axis=1)
        extensions = np.sum((positions[self._near] - positions[self._far]) * self._directions, axis=1)
        time = step * self._step
        for tether, owner, point, force, extension in zip(self._tethers, self._owners, points, forces, extensions):
            yield time, tether, owner, *point, force, extension
