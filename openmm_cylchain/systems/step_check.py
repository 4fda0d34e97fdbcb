"""A run that checks its own step: averages with the step h beside those with h/16, on the same Brownian path.

A step against half of it would prove little where both are wrong alike, so the reference is much shorter. What differs
between the averages of the two is

    A(h) - A(h/n) = c (1 - 1/n) h + O(h^2),        n = 16,

since all schemes are of weak order one, and n/(n-1) of that is the error, relative to the average of the reference.

The runs are compared in 16 windows of time. In each both begin with the positions, and the linkers, that the reference
has come to, and, with the compiled engine, follow one Brownian path (``setPathLevel``), so that what differs between
them is the step, and less noise than in independent runs. The first quarter of a window is left out. Noise is not the
same in any two windows, so that their differences are independent however slowly the system relaxes: the standard error
is that of the mean of 16 of them, or of the mean over filaments of one kind where they are eight at least, whichever is
larger, and the error bar four times that, or more by Student's t: 5.5 times for 16 windows. Blocks of one run, which
are not independent where linkers bind and unbind slowly, had error bars several times too small. The rule, with the
error e and its error bar b:

    wrong           |e| - b > 5 %, or |e| > 100: energies that grow without bound have no error bar
    right           |e| <= 5 % and b <= 5 %, within |e| + b
    not resolved    anything else: a longer check is needed

Averages begin long after what is driven has grown. So before, both runs take twenty steps h from the start, again and
again, and where bends of filaments grow beyond what they are in equilibrium and were at the start, the time that this
takes is compared, too: unless they begin strained, with energies of forces far above what they are later.

What the check cannot see: what relaxes more slowly than a window lasts, and errors that do not depend on the step, such
as those of scheme "euler" on chains. For the latter, free filaments that begin in equilibrium are held against exact
averages, too.
"""

from __future__ import annotations

import math
import time
import warnings
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import openmm

from ..engine_choice import default_scheme
from ..errors import InputError, InstabilityError
from ..filaments.collection import require_filaments
from ..filaments.placement import refuse_coinciding
from ..filaments.refusals import refuse_growth
from ..filaments.twist import has_twist
from ..kinetics.binding_force import find_binding_force
from ..mechanics.flow import Flow
from ..mechanics.geometry import segment_vectors
from ..time_steps.recommended_step import recommended_time_step
from ..time_steps.schemes import check_scheme
from ..time_steps.time_step import TimeStep, as_step
from ..units.quantities import (
    DIMENSIONLESS,
    LENGTH,
    in_units_of,
    positive,
    require_callable,
    require_kind,
    shown,
    thermal_energy,
    true_or_false,
    whole_number,
)
from ..units.text import format_time
from ..units.types import Numbers, Scalar, Vectors
from .filaments import Filaments
from .refused_context import refusal
from .step_check_comparison import ExactAverages, bends_grow, compare, compare_growth, find_strained
from .step_check_observables import STEPS_PER_FRAME, Probe
from .step_check_results import StepCheck

_RELAXATIONS_OF_FEW = 20.0
_WINDOWS = 16
_LARGEST_PARTS = 1024
# How many steps h are looked at one by one from the start, in how many runs, and in how many at most if bends grow.
_STEPS_OF_START = 20
_RUNS_FROM_START, _MOST_RUNS_FROM_START = 4, 64
_SHARE_OF_START = 0.2
_LOOKS_OF_REFERENCE = 4


def check_time_step(
    filaments: Filaments,
    system: openmm.System,
    positions: Vectors,
    step_size: Scalar | TimeStep,
    *,
    scheme: str | None = None,
    temperature: Scalar | None = None,
    particle_friction: Numbers | None = None,
    flow: Flow | None = None,
    seconds: float = 20.0,
    frames: int | None = None,
    parts: int = 16,
    random_seed: int = 1,
    equilibrium: bool = False,
    twists: Mapping[int, Numbers] | None = None,
    platform: openmm.Platform | None = None,
    properties: Mapping[str, str] | None = None,
    say: Callable[[str], object] = lambda message: None,
    stop: Callable[[], bool] = lambda: False,
) -> StepCheck:
    """Run a System with a step and with a sixteenth of it, and say whether the step is right.

    Compared are, for each kind of filament, the mean energies of stretching (per segment) and bending (per joint), of
    beams per element, and of twist per joint, the mean square end-to-end distance (of rings: the distance across) and
    the mean square of the whole twist, and how far the three slowest bending modes and the middle of a filament move in
    ten steps; how far particles move in them, and from where
    they began; the mean energies of tethers and of each other force of the System, such as walls, contacts and linkers;
    how many hands are bound; and how long bends take to grow where filaments buckle. See ``step_check`` for
    errors, their error bars, the verdicts and what the check cannot see.

    The System is copied. What is not part of it, such as crosslinks that a Crosslinks object adds and removes, stays as
    it is in the System.

    With the portable engine, runs do not follow one path: error bars are several times as large.

    Parameters
    ----------
    filaments : Filaments
        In the System.
    system : openmm.System
        With all forces.
    positions : (particles, 3) length
        Where both runs begin, at best in equilibrium.
    step_size : time, or TimeStep
    scheme, temperature, particle_friction, flow : optional
        As for ``Filaments.create_integrator``.
    seconds : float
        Time that the check may take.
    frames : int, optional
        Length of the run in tens of steps h, all windows together, in place of ``seconds``: the result is then the same
        each time.
    parts : int
        By which the step of the reference is shorter: a power of two from 2 to 1024. The check takes parts + 1 steps in
        place of one.
    random_seed : int
        At least 1.
    equilibrium : bool
        Whether filaments were drawn from equilibrium: then the exact averages of free ones count for the verdict.
    twists : mapping of int to array of angles, optional
        Of filaments, by their numbers: with which they begin, as ``FilamentsInContext.twists`` returns them. The others
        begin with twists at rest.
    platform : openmm.Platform, optional
    properties : dict, optional
        Of the platform.
    say : callable (str), optional
        Told how far it is.
    stop : callable (), optional
        Asked after every ten steps h whether to end early.

    Returns
    -------
    StepCheck

    Raises
    ------
    InputError
        At a temperature of zero, for filaments that grow, for twists of filaments that have none, or as
        ``Filaments.create_integrator``.
    """
    require_filaments(filaments)
    refuse_growth(filaments, "the check of a step, which compares the same nodes in two runs,")
    require_kind(system, openmm.System, "system")
    positions = np.asarray(in_units_of(positions, LENGTH, "positions"))
    if positions.shape != (system.getNumParticles(), 3):
        raise InputError(
            f"positions must have the shape ({system.getNumParticles()}, 3) of the System's particles, but have "
            f"{positions.shape}."
        )
    for number, (filament, nodes) in enumerate(zip(filaments, filaments.node_indices)):
        apart = np.linalg.norm(segment_vectors(positions[nodes], filament.closed), axis=1)
        refuse_coinciding(apart, len(nodes), f"positions: filament {number}")
    equilibrium = true_or_false(equilibrium, "equilibrium")
    require_callable(say, "say")
    require_callable(stop, "stop")
    _check_platform(platform, properties)
    if twists is not None:
        require_kind(twists, Mapping, "twists")
    step = as_step(step_size)
    scheme = default_scheme(filaments.engine) if scheme is None else scheme
    check_scheme(scheme)
    bath = filaments.temperature if temperature is None else temperature
    if thermal_energy(bath) == 0.0:
        raise InputError("At a temperature of zero there are no averages to compare: check a warmer System.")
    parts = whole_number(parts, 2, "parts")
    if parts & (parts - 1) or parts > _LARGEST_PARTS:
        raise InputError(f"parts must be a power of two up to {_LARGEST_PARTS}, but is {parts}.")
    random_seed = whole_number(random_seed, 1, "random_seed")
    if frames is None:
        seconds = positive(seconds, DIMENSIONLESS, "seconds")
    else:
        frames = whole_number(frames, 2, "frames")
    settings = {"scheme": scheme, "temperature": temperature, "particle_friction": particle_friction, "flow": flow}
    probe = Probe(filaments, system, bath)
    paired = filaments.engine == "compiled"
    arguments = (filaments, probe, positions, step, random_seed, paired, settings, platform, properties)
    runs = [_Run(*arguments, level) for level in (0, parts.bit_length() - 1)]
    for run in runs:
        run.set_twists(twists or {})
    start = time.monotonic()
    pair = _Pair(runs, probe, stop)
    windows: list[list[Any]] = []
    growing: list[Any] = []
    failure = None
    try:
        growing = pair.from_start(math.inf if frames else _SHARE_OF_START * seconds)
        if frames:
            pair.take_windows(windows, frames, math.inf, say)
        else:
            pair.take_windows(windows, None, start + seconds, say)
    except InstabilityError as error:
        failure = str(error)
    elapsed = time.monotonic() - start
    relaxation = _slowest_relaxation(probe.kinds, filaments, bath)
    observables = []
    strained: tuple[str, ...] = ()
    per_window = len(windows[0]) if windows else 0
    if failure is None and windows:
        lasting = len(windows) * per_window * STEPS_PER_FRAME * step >= _RELAXATIONS_OF_FEW * relaxation
        exact = ExactAverages(filaments, system, flow, bath, equilibrium, lasting)
        observables = compare(probe, windows, parts, exact, elapsed)
        looks = min(parts, _LOOKS_OF_REFERENCE)
        strained = find_strained(probe, windows, pair.energies)
        if growing and not strained:
            observables += compare_growth(probe, growing, step, looks, elapsed)
    return StepCheck(
        step=step,
        scheme=scheme,
        steps=(step, step / parts),
        paired=paired,
        observables=observables,
        divided=tuple(run.divided_share() for run in runs),
        failure=failure,
        windows=len(windows),
        frames=per_window,
        seconds=elapsed,
        relaxation=relaxation,
        strained=strained,
    )


def _check_platform(platform, properties):
    if platform is not None:
        require_kind(platform, openmm.Platform, "platform")
    if properties is not None:
        require_kind(properties, Mapping, "properties")
        if any(not isinstance(one, str) for pair in properties.items() for one in pair):
            raise InputError(f"properties must be texts by names of properties, but are {shown(properties)}.")
        if platform is None and properties:
            raise InputError("properties are those of a platform: give the platform, too.")


class _Pair:
    # A run with the step and one with that of the reference.

    def __init__(self, runs, probe, stop):
        self._runs, self._probe, self._stop = runs, probe, stop

    def from_start(self, seconds):
        # Amplitudes of bending modes of each run, each time from the start, after each of the first steps. Of the
        # reference in between, too.
        found: list[Any] = []
        begun = time.monotonic()
        start = self._runs[0].state()
        self.energies = self._probe.energies(self._runs[0].context)
        if not any(len(own) for own in self._probe.equilibrium_amplitudes()):
            return found
        while len(found) < _MOST_RUNS_FROM_START and not self._stop():
            runs = []
            for run in self._runs:
                run.begin(start)
                looks = min(run.steps, _LOOKS_OF_REFERENCE)
                amplitudes = [self._probe.mode_amplitudes(run.context)]
                for _ in range(_STEPS_OF_START * looks):
                    run.advance(run.steps // looks)
                    amplitudes.append(self._probe.mode_amplitudes(run.context))
                runs.append(amplitudes)
            found.append(runs)
            if time.monotonic() - begun > seconds:
                break
            if len(found) == _RUNS_FROM_START and not bends_grow(self._probe, found):
                break
        for run in self._runs:
            run.begin(start)
        return found

    def take_windows(self, windows, frames, end, say):
        # Each of as many frames; of the first one, as many as fit in its share of the time.
        begun, told = time.monotonic(), 0
        first_end = begun + (end - begun) / _WINDOWS
        length = None if frames is None else max(1, frames // _WINDOWS)
        total = math.inf if frames is None else length * min(_WINDOWS, frames)
        taken = 0
        while taken < total:
            window: list[Any] = []
            for run in self._runs:
                run.look(self._probe)
            while len(window) != length:
                window.append([run.frame(self._probe) for run in self._runs])
                taken += 1
                now = time.monotonic()
                share = taken / total if frames else (now - begun) / max(end - begun, 1e-9)
                if share >= (told + 1) / 10.0:
                    told = int(10.0 * share)
                    say(f"{min(100, 10 * told)} %, {taken * STEPS_PER_FRAME} steps")
                over = now >= end or self._stop()
                if over or (length is None and now >= first_end):
                    break
            length = length or len(window)
            if len(window) == length:
                windows.append(window)
            if over:
                return
            reached = self._runs[-1].state()
            for run in self._runs:
                run.begin(reached)


class _Run:
    # A Context with the step h/2^level.

    def __init__(self, filaments, probe, positions, step, seed, paired, settings, platform, properties, level):
        self._filaments = filaments
        self._system = probe.grouped_system()
        self.steps = 2**level
        self._chains = len(filaments)
        self._taken = 0
        with warnings.catch_warnings():
            # Whether the step is too long is what is looked at.
            warnings.simplefilter("ignore")
            self._integrator = filaments.create_integrator(
                self._system,
                step / 2**level,
                random_seed=seed if paired else seed + level,
                checks=False,
                **settings,
            )
        if paired:
            self._integrator.setPathLevel(level)
        arguments = () if platform is None else (platform, dict(properties or {}))
        try:
            self.context = openmm.Context(self._system, self._integrator, *arguments)
        except openmm.OpenMMException as error:
            raise refusal(error, self._system, self._integrator, platform) from None
        self.context.setPositions(positions)
        self.context.computeVirtualSites()
        self._before = None

    def state(self):
        # What a run can begin with: positions, the box, linkers and twists.
        state = self.context.getState(positions=True)
        own = self._filaments.in_context(self.context)
        linkers = own.linkers() if find_binding_force(self._system) is not None else None
        twists = {number: own.twists(number) for number, one in enumerate(self._filaments) if has_twist(one.type)}
        return state.getPositions(asNumpy=True), state.getPeriodicBoxVectors(), linkers, twists

    def begin(self, state):
        positions, box, linkers, twists = state
        self.context.setPeriodicBoxVectors(*box)
        self.context.setPositions(positions)
        if linkers is not None:
            self._filaments.in_context(self.context).set_linkers(linkers)
        self.set_twists(twists)
        self._before = None

    def set_twists(self, twists):
        own = self._filaments.in_context(self.context)
        for number, values in twists.items():
            own.set_twists(number, values)

    def look(self, probe):
        values, self._before = probe.measure(self.context, self._before)
        return values

    def advance(self, steps):
        self._integrator.step(steps)
        self._taken += steps

    def frame(self, probe):
        self.advance(STEPS_PER_FRAME * self.steps)
        values = self.look(probe)
        if not all(np.all(np.isfinite(one)) for one in values):
            step = format_time(self._integrator.getStepSize()._value, 3)
            raise InstabilityError(f"with a step of {step} it has blown up by step {self._taken}.")
        return values

    def divided_share(self):
        divided = getattr(self._integrator, "getNumDividedSteps", lambda: 0)()
        return divided / max(1, self._chains * self._taken)


def _slowest_relaxation(kinds, filaments, temperature):
    # In ps.
    longest = 0.0
    for one in (kind.filament for kind in kinds):
        bounds = recommended_time_step(
            one.type, filaments.viscosity, temperature, "implicit", one.segments, one.closed
        ).bounds
        longest = max(longest, bounds.get("relaxation", 0.0))
    return longest
