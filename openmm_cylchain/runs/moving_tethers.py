"""Tethers of a configuration whose points move at constant velocity, and what they pull with."""

import math

import numpy as np

from ..units.quantities import thermal_energy

_FINE = 0.05
"""Of the thermal width (k_BT/k)^(1/2) of a tether: how far its point may move at once."""


class MovingTethers:
    """Moves the points of tethers in a stage, at steps that follow from their numbers alone, as in a resumed run.

    A point is where it was as the stage began, and ``velocity max(0, t - start_time)`` further, at the last step at
    which points were moved: often enough that none moves by more than a twentieth of its thermal width at once, if
    steps allow it. Those that move in any stage of a run have rows in all of its stages.

    Attributes
    ----------
    interval : int
        Steps from one motion to the next.
    """

    def __init__(self, stage, filaments):
        self._stage, self._filaments = stage, filaments
        settings = stage.configuration.simulation
        self._step = settings.time_step
        there, count = {}, 0
        for own in stage.configuration.tethers:
            there[own.number] = count
            count += len(own.filaments)
        rows, label = [], 0
        for course in stage.tethers:
            for place, filament in enumerate(course.group.filaments):
                if course.direction.any():
                    number = there[course.group.number] + place if course.active else -1
                    rows.append((label + place, number, filament, course))
            label += len(course.group.filaments)
        self._labels = [label for label, *_ in rows]
        self._numbers = np.array([number for _, number, *_ in rows], dtype=int)
        self._owners = [filament for *_, filament, _ in rows]
        self._points = np.array([self._first_point(*row) for row in rows], dtype=float).reshape(-1, 3)
        courses = [course for *_, course in rows]
        self._displacements = np.array([own.displacement for own in courses], dtype=float).reshape(-1, 3)
        self._velocities = np.array([own.velocity for own in courses], dtype=float).reshape(-1, 3)
        self._directions = np.array([own.direction for own in courses], dtype=float).reshape(-1, 3)
        self._starts = np.array([max(stage.begin, own.group.start_time) for own in courses], dtype=float)
        self._stiffness = np.array([own.group.stiffness if own.active else 0.0 for own in courses])
        ends = [self._ends(filament, own.group.node) for *_, filament, own in rows]
        self._pulled, self._far, self._near = np.array(ends, dtype=int).reshape(-1, 3).T
        self.interval = 1
        speeds = np.linalg.norm(self._velocities, axis=1)
        moving = speeds > 0.0
        if moving.any():
            widths = np.sqrt(thermal_energy(stage.configuration.solvent.temperature) / self._stiffness[moving])
            steps = float(np.min(_FINE * widths / (speeds[moving] * self._step)))
            self.interval = max(1, min(settings.steps_per_report, math.floor(steps)))

    def __len__(self):
        return len(self._labels)

    def _first_point(self, _, number, filament, course):
        if number >= 0:
            return self._filaments.tethers[number].point
        own = course.group
        return self._filaments[filament].positions[own.node] if own.point is None else own.point

    def _ends(self, filament, node):
        nodes = self._filaments.node_indices[filament]
        node = node % len(nodes)
        ends = (nodes[0], nodes[-1]) if 2 * node >= len(nodes) - 1 else (nodes[-1], nodes[0])
        return nodes[node], *ends

    def _points_at(self, step):
        since = max(0, step - self._stage.first_step) // self.interval * self.interval * self._step
        times = np.maximum(0.0, self._stage.begin + since - self._starts)
        return self._points + self._displacements + times[:, None] * self._velocities

    def move(self, context, step):
        """Put the points where they are from a step on."""
        active = self._numbers >= 0
        if active.any():
            self._filaments.in_context(context).move_tethers(self._numbers[active], self._points_at(step)[active])

    def rows(self, step, positions):
        """Lines of PULLING_TABLE_COLUMNS without the step, for positions (particles, 3) in nm.

        Points are those since the last motion before the step.
        """
        points = self._points_at(max(step - 1, 0))
        forces = self._stiffness * np.sum((points - positions[self._pulled]) * self._directions, axis=1)
        extensions = np.sum((positions[self._near] - positions[self._far]) * self._directions, axis=1)
        time = self._stage.time(step)
        for tether, owner, point, force, extension in zip(self._labels, self._owners, points, forces, extensions):
            yield time, tether, owner, *point, force, extension
