"""A run that checks its own step: averages with the step h beside those with h/2 on the same Brownian path.

Both runs begin with the same positions and, with the compiled engine, follow one path (``setPathLevel``), so that what
differs between their averages is the step, and little noise. With 16 segments of F-actin in the recommended step, error
bars are 2 times (bending energy) to 18 times (end-to-end distance) as small as those of independent runs, 6 times for
the slowest bending modes; for stretching, which is drawn anew in each step, 1.4 times. The runs are not brought
together again on the way: that makes error bars hardly smaller, and would hide errors of averages that relax slowly.

All schemes are of weak order one: an average is A(h) = A + c h + O(h^2), so that its error is

    A(h) - A = 2 (A(h) - A(h/2)) + O(h^2)                          two steps
    A(h) - A = (2 A(h) + 6 A(h/2) - 8 A(h/4))/3 + O(h^3)           three steps

It is given relative to the average with the shortest step. For a coordinate with an explicit harmonic force, whose
variance is too large by 1/(1 - lambda h/2), the former is then exact. Where the error is of second order, as that of a
symmetric drift may be, two steps show 3/2 of it.

The standard error comes from the differences, frame by frame: from their means over 16 and 32 blocks of time, and over
filaments of one kind if there are eight at least. The largest of them counts, so that it is rather too large than too
small, by a sixth or so. The rule, with the error e and its standard error s:

    wrong           |e| - 4 s > 5 %, or |e| > 100: energies that grow without bound have no error bar
    right           |e| <= 5 % and 4 s <= 5 %, within |e| + 4 s
    not resolved    anything else: a longer check is needed

What the check cannot see: what relaxes more slowly than it lasts, and errors that do not depend on the step, such as
those of scheme "euler" on chains. For the latter, free filaments that begin in equilibrium are held against exact
averages, too.
"""

import time
import warnings
from collections.abc import Callable, Mapping

import numpy as np
import openmm

from ..dynamics.recommended_step import recommended_time_step
from ..dynamics.schemes import check_scheme
from ..dynamics.time_step import TimeStep, as_step
from ..engine_choice import default_scheme
from ..errors import InputError, InstabilityError
from ..mechanics.flow import Flow
from ..units.quantities import DIMENSIONLESS, positive, thermal_energy, whole_number
from ..units.text import format_time
from ..units.types import Numbers, Scalar, Vectors
from .filaments import Filaments
from .step_check_comparison import WEIGHTS, ExactAverages, compare
from .step_check_observables import STEPS_PER_FRAME, Probe
from .step_check_results import StepCheck

_RELAXATIONS_OF_FEW = 20.0


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
    levels: int = 2,
    random_seed: int = 1,
    equilibrium: bool = False,
    platform: openmm.Platform | None = None,
    properties: Mapping[str, str] | None = None,
    say: Callable[[str], object] = lambda message: None,
    stop: Callable[[], bool] = lambda: False,
) -> StepCheck:
    """Run a System with a step and with half of it, and say whether the step is right.

    Compared are, for each kind of filament, the mean energies of stretching (per segment) and bending (per joint), of
    beams per element, the mean square end-to-end distance (of rings: the distance across), how far the three slowest
    bending modes and the middle of a filament move in ten steps, and the mean energies of tethers and of each other
    force of the System. The first quarter of the runs is left out. See ``step_check`` for errors, their standard
    errors, the verdicts and what the check cannot see.

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
        Length of the runs in tens of steps h, in place of ``seconds``: the result is then the same each time.
    levels : {2, 3}
        Steps h and h/2, or h/4 as well: it takes 7/3 as long, and errors that are large are closer to the truth.
    random_seed : int
        At least 1.
    equilibrium : bool
        Whether filaments were drawn from equilibrium: then the exact averages of free ones count for the verdict.
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
        At a temperature of zero, or as ``Filaments.create_integrator``.
    """
    step = as_step(step_size)
    scheme = default_scheme(filaments.engine) if scheme is None else scheme
    check_scheme(scheme)
    bath = filaments.temperature if temperature is None else temperature
    if thermal_energy(bath) == 0.0:
        raise InputError("At a temperature of zero there are no averages to compare: check a warmer System.")
    if levels not in WEIGHTS:
        raise InputError(f"levels must be 2 or 3, but is {levels!r}.")
    random_seed = whole_number(random_seed, 1, "random_seed")
    if frames is None:
        seconds = positive(seconds, DIMENSIONLESS, "seconds")
    else:
        frames = whole_number(frames, 2, "frames")
    settings = {"scheme": scheme, "temperature": temperature, "particle_friction": particle_friction, "flow": flow}
    probe = Probe(filaments, system, bath)
    paired = filaments.engine == "compiled"
    runs = [
        _Run(filaments, probe, positions, step, level, random_seed, paired, settings, platform, properties)
        for level in range(levels)
    ]
    start = time.monotonic()
    records, failure = _advance(runs, probe, seconds, frames, say, stop)
    elapsed = time.monotonic() - start
    relaxation = _slowest_relaxation(probe.kinds, filaments, bath)
    observables = []
    if failure is None:
        lasting = len(records) * STEPS_PER_FRAME * step >= _RELAXATIONS_OF_FEW * relaxation
        exact = ExactAverages(filaments, system, flow, bath, equilibrium, lasting)
        observables = compare(probe, records, exact, elapsed)
    return StepCheck(
        step=step,
        scheme=scheme,
        steps=tuple(step / 2**level for level in range(levels)),
        paired=paired,
        observables=observables,
        divided=tuple(run.divided_share() for run in runs),
        failure=failure,
        frames=len(records),
        seconds=elapsed,
        relaxation=relaxation,
    )


def _advance(runs, probe, seconds, frames, say, stop):
    # Values (levels, ...) of every frame but the first, and why it ended early.
    start, records, told = time.monotonic(), [], 0
    try:
        for run in runs:
            run.look(probe)
        while True:
            records.append([run.advance(probe) for run in runs])
            share = len(records) / frames if frames else (time.monotonic() - start) / seconds
            if share >= (told + 1) / 10.0:
                told = int(10.0 * share)
                say(f"{min(100, 10 * told)} %, {len(records) * STEPS_PER_FRAME} steps")
            if share >= 1.0 or stop():
                return records, None
    except InstabilityError as error:
        return records, str(error)


class _Run:
    # A Context with the step h/2^level.

    def __init__(self, filaments, probe, positions, step, level, seed, paired, settings, platform, properties):
        self._system = probe.grouped_system()
        self._steps = STEPS_PER_FRAME * 2**level
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
        arguments = () if platform is None else (platform, properties or {})
        try:
            self.context = openmm.Context(self._system, self._integrator, *arguments)
        except openmm.OpenMMException as error:
            name = "OpenMM" if platform is None else f"The platform {platform.getName()}"
            raise InputError(f'{name} cannot run this System: {error}. "Reference" always can.') from None
        self.context.setPositions(positions)
        self.context.computeVirtualSites()
        self._before = None

    def look(self, probe):
        values, self._before = probe.measure(self.context, self._before)
        return values

    def advance(self, probe):
        self._integrator.step(self._steps)
        self._taken += self._steps
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
