"""What a run shows of a time step that is too long: divided steps, and the work of explicit forces.

Integrators look at both while they run, and turn it off with their attribute ``checks``, or
``Filaments.create_integrator(..., checks=False)``. Warnings are TimeStepWarnings, once for each integrator; errors are
TimeStepErrors.
"""

import math
import warnings
from typing import Any

import numpy as np

from ..errors import TimeStepError, TimeStepWarning
from ..units.types import FloatArray

WINDOW = 128
"""Steps over which the work of explicit forces is averaged, and that an integrator takes at once."""

FIRST_WINDOW = 32
"""Steps of the first windows of a run: three of them are over within its first hundred steps."""

LARGEST_DIVIDED_SHARE = 1e-3
"""Scheme "implicit" divides steps whose equations it cannot solve: a larger share of them may bias averages."""

INTOLERABLE_DIVIDED_SHARE = 0.1
"""Share of divided steps at which a run is stopped."""

_TURN_OFF = "integrator.checks = False turns this check off."


class DividedSteps:
    """Watches the share of divided steps in windows of a run, so that neither its past nor its future hides anything.

    A window for the warning ends after 1000 steps of chains and 100 steps at least, and one for the error after 100
    steps of chains and 50 steps. (A single divided step never warns: it is one in a thousand by chance.)

    Parameters
    ----------
    chains : int
        Of which every one takes every step; with zero, nothing is watched.
    """

    def __init__(self, chains: int) -> None:
        self._chains = chains
        self._warning = _Window(1000, 100)
        self._error = _Window(100, 50)
        self._warned = False

    def add(self, steps: int, divided: int) -> None:
        """Take note of some steps, in which ``divided`` steps of chains were divided.

        Warns
        -----
        TimeStepWarning
            Once, if more than one in a thousand of a window were.

        Raises
        ------
        TimeStepError
            If more than one in ten of a window were.
        """
        if not self._chains:
            return
        share = self._error.add(steps, self._chains, divided)
        if share is not None and share > INTOLERABLE_DIVIDED_SHARE:
            raise TimeStepError(
                f"{_description(share)}: results would be wrong. Use a smaller time step "
                "(Filaments.recommended_time_step(system=system) knows the stiffness of most forces), or start from a "
                f"configuration without overlaps. {_TURN_OFF}"
            )
        share = self._warning.add(steps, self._chains, divided)
        if share is not None and share > LARGEST_DIVIDED_SHARE and not self._warned:
            self._warned = True
            warnings.warn(
                f"{_description(share)}: averages may be biased. Use a smaller time step. {_TURN_OFF}",
                TimeStepWarning,
                stacklevel=3,
            )


def _description(share):
    return (
        f"{100 * share:.2g} % of the last steps of filaments were divided, because the equations of the implicit "
        "scheme could not be solved"
    )


class _Window:
    # Gives the share of divided steps when enough steps have been counted, and begins anew.

    def __init__(self, chain_steps, steps):
        self._chain_steps, self._steps = chain_steps, steps
        self._clear()

    def _clear(self):
        self._taken = self._counted = self._divided = 0

    def add(self, steps, chains, divided):
        self._taken += steps
        self._counted += steps * chains
        self._divided += divided
        if self._taken < self._steps or self._counted < self._chain_steps:
            return None
        share = self._divided / self._counted if self._divided > 1 else 0.0
        self._clear()
        return share


WARNING_WORK = 0.35
"""Mean work of explicit forces on a particle in a step, in k_B T, from which on a run is warned of.

An explicit harmonic coordinate that relaxes by x = k mu h in a step has the mean work 2 x/(1 - x/2), and a variance too
large by 1/(1 - x/2), which are 0.35 and 1.09 at x = 0.16.
"""

ERROR_WORK = 3.0
"""Mean work, in k_B T, at which a run is stopped (x = 0.86 for one coordinate)."""

WINDOWS = 3
"""Windows in succession that must show such work."""


class ExplicitWork:
    """Watches the work that explicit forces do because they are those of the start of a step.

    With the forces f_i on a particle before and after a step that moves it by dx_i,
    w_i = -(f_i(after) - f_i(before)).dx_i is 2 k_B T x/(1 - x/2) on the mean for a harmonic coordinate that relaxes by
    x = k mu h in a step, summed over the coordinates that the particle has. Its mean over a window of steps is
    compared with ``WARNING_WORK`` and ``ERROR_WORK``, for the particle where it is largest. Chance makes the largest of
    n means over s steps larger than what is expected of each by a factor of about 1 + sqrt(2/s) sqrt(2 ln n), which is
    allowed for. ``WINDOWS`` in succession must show it: a jump of a force, however large, and what relaxes after it or
    after a start within the steps of a window, are in two at most.

    The first ``WINDOWS`` are shorter, so that a run that is far too coarse is warned of within its first hundred steps:
    if all of them show the work of an error and the last one at least half of the first one's, as nothing does that
    relaxes.
    """

    def __init__(self) -> None:
        self._warned = False
        self._large = self._too_large = 0
        self._first: list[float] = []

    @property
    def window(self) -> int:
        """Steps of the next window."""
        return WINDOW if len(self._first) == WINDOWS else FIRST_WINDOW

    def add(self, work: float, particle: int, steps: int, particles: int) -> None:
        """Take note of a window.

        Parameters
        ----------
        work : float
            Mean of w_i/k_B T over the window, of the particle where it is largest.
        particle : int
            Its index.
        steps : int
            In the window.
        particles : int
            Of which it is the largest.

        Warns
        -----
        TimeStepWarning
            Once, if it is above ``WARNING_WORK`` for the third time in succession.

        Raises
        ------
        TimeStepError
            If it is above ``ERROR_WORK``, or not a number, for the third time in succession.
        """
        chance = 1.0 + math.sqrt(2.0 / steps) * math.sqrt(2.0 * math.log(max(particles, 1)))
        if steps < WINDOW:
            self._first.append(work)
            far_too_large = all(not one <= ERROR_WORK * chance for one in self._first)
            if len(self._first) == WINDOWS and far_too_large and not work < 0.5 * self._first[0]:
                self._warn(work, particle)
            return
        # Written so that NaN is too large.
        self._large = 0 if work <= WARNING_WORK * chance else self._large + 1
        self._too_large = 0 if work <= ERROR_WORK * chance else self._too_large + 1
        if self._too_large >= WINDOWS:
            raise TimeStepError(
                f"{_work_description(work, particle)}: energies are far too high. Use a smaller time step "
                "(Filaments.recommended_time_step(system=system) knows the stiffness of most forces), or look for "
                f"overlapping particles. {_TURN_OFF}"
            )
        if self._large >= WINDOWS and not self._warned:
            self._warn(work, particle)

    def _warn(self, work, particle):
        self._warned = True
        warnings.warn(
            f"{_work_description(work, particle)}: its fluctuations are more than 10 % too large, or "
            "it is driven too fast. Use a smaller time step (see Filaments.recommended_time_step(system=system)). "
            f"{_TURN_OFF}",
            TimeStepWarning,
            stacklevel=4,
        )


def _work_description(work, particle):
    return (
        f"The time step is too long for the forces on particle {particle}: in a step they change by so much that "
        f"this alone is a work of {work:.2g} k_B T"
    )


class WorkRecorder:
    """Means of the work w_i of all particles over windows of steps, from what the portable engine computes in each.

    Steps that do not follow on from each other, because positions were set or a checkpoint was loaded, are left out. Of
    displacements and changes of forces, their means over the window are taken off: a filament that is dragged along
    steadily, while its tension turns, is no sign of a step that is too long. ``window``, how many steps one has, may be
    changed at any time.
    """

    def __init__(self) -> None:
        self.window = WINDOW
        self.clear()

    def clear(self) -> None:
        """Forget everything, as after a pause."""
        self._number: int | None = None
        self._forces: Any = None
        self._arrival: Any = None
        self._moves: Any = None
        self._finished: FloatArray | None = None
        self._begin()

    def _begin(self):
        self._count, self._work, self._change, self._way = 0, 0.0, 0.0, 0.0

    def record(self, number: int, positions: FloatArray, forces: FloatArray, moves: FloatArray, kT: float) -> None:
        """Take note of one step with a number: positions and forces (particles, 3) at its start, and displacements in
        it.

        With a kT of zero, nothing is recorded.
        """
        if kT <= 0.0:
            self.clear()
            return
        if self._number == number - 1 and _agree(positions, self._arrival):
            change = forces - self._forces
            self._work = self._work + np.einsum("ij,ij->i", change, self._moves)
            self._change, self._way = self._change + change, self._way + self._moves
            self._count += 1
            if self._count >= self.window:
                steady = np.einsum("ij,ij->i", self._change, self._way) / self._count
                self._finished = (steady - self._work) / (self._count * kT)
                self._begin()
        else:
            self._begin()
        self._number = number
        self._forces = np.array(forces)
        self._moves = np.array(moves)
        self._arrival = positions + moves

    def take(self) -> FloatArray | None:
        """The means (particles,) of w_i/k_B T of the last finished window, once; None if there is none."""
        finished, self._finished = self._finished, None
        return finished


def _agree(positions, expected):
    # Platforms in single precision round positions to about 1e-7 of their size.
    scale = np.max(np.abs(expected), initial=1.0)
    return positions.shape == expected.shape and bool(np.all(np.abs(positions - expected) <= 1e-5 * scale))
