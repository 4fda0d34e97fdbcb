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

import copy
import math
import time
import warnings
from dataclasses import asdict, dataclass

import numpy as np
import openmm

from ..couplings.pulling import is_constant_force
from ..dynamics.recommended_step import implicit_time_step
from ..dynamics.schemes import check_scheme
from ..dynamics.step_watch import LARGEST_DIVIDED_SHARE
from ..dynamics.time_step import as_step
from ..engine_choice import default_scheme
from ..errors import InputError, InstabilityError
from ..theory import bending_energy_mean, chain_mean_square_end_to_end, stretching_energy_mean
from ..units.quantities import DIMENSIONLESS, positive, thermal_energy, whole_number
from ..units.text import format_time

LARGEST_ERROR = 0.05
"""Relative error up to which a step is right."""

DIVERGED = 100.0
"""Relative error from which on a step is wrong, whatever the standard error."""

SIGMAS = 4.0
"""Standard errors in an error bar."""

STEPS_PER_FRAME = 10
"""Steps h between two looks at both runs."""

_WEIGHTS = {2: (2.0, -2.0), 3: (2.0 / 3.0, 2.0, -8.0 / 3.0)}
_BLOCKS = (32, 16)
_FEWEST_COPIES = 8
_WARM_UP = 0.25
_MODES = 3
_RELAXATIONS = 5.0
_RELAXATIONS_OF_FEW = 20.0
_LAST_GROUP = 30
_WITHOUT_ENERGY = (openmm.CMMotionRemover, openmm.MonteCarloBarostat)


@dataclass(frozen=True)
class ObservableCheck:
    """One average with the step h and with shorter ones.

    Attributes
    ----------
    name, unit : str
    values : tuple of float
        With h, h/2 and, of three, h/4.
    error : float
        Of the average with h, relative to that with the shortest step, extrapolated.
    standard_error : float
        Of ``error``.
    unpaired_standard_error : float
        What it would be if the runs had nothing in common.
    exact : float or None
        The exact average in equilibrium, where it is known.
    deviation, deviation_standard_error : float or None
        Of the average with h from the exact one, relative. The standard error is infinite for fewer than eight
        filaments in a check that is not long against their relaxation.
    judged_by_exact : bool
        Whether the deviation counts for the verdict: the filaments began in equilibrium.
    seconds : float
        Time that all of this took.
    """

    name: str
    unit: str
    values: tuple
    error: float
    standard_error: float
    unpaired_standard_error: float
    exact: float | None
    deviation: float | None
    deviation_standard_error: float | None
    judged_by_exact: bool
    seconds: float

    @property
    def verdict(self):
        """ "right", "wrong" or "not resolved", see ``step_check``."""
        if _surely_large(self.error, self.standard_error) or self.off_exact:
            return "wrong"
        right = abs(self.error) <= LARGEST_ERROR and SIGMAS * self.standard_error <= LARGEST_ERROR
        return "right" if right else "not resolved"

    @property
    def off_exact(self):
        """Whether the average with h differs from the exact one by more than 5 % for sure."""
        return self.judged_by_exact and _surely_large(self.deviation, self.deviation_standard_error)

    @property
    def required_seconds(self):
        """About how long a check takes that resolves this error; infinite if nothing is known."""
        bar = SIGMAS * self.standard_error
        room = LARGEST_ERROR
        if abs(self.error) > LARGEST_ERROR:
            room = min(room, max(abs(self.error) - LARGEST_ERROR, 0.2 * LARGEST_ERROR))
        return self.seconds * max(1.0, (bar / room) ** 2)

    def explanation(self):
        """The verdict in words."""
        if _diverged(self.error):
            return "wrong: it grows without bound"
        if _surely_large(self.error, self.standard_error):
            return f"wrong by {_percent(self.error)} +- {_percent(self.standard_error)}"
        if self.off_exact:
            return f"wrong: {_percent(self.deviation, '+')} off the exact value"
        if self.verdict == "right":
            return f"right within {_percent(abs(self.error) + SIGMAS * self.standard_error)}"
        bar = f"error bar {_percent(SIGMAS * self.standard_error)}"
        if not math.isfinite(self.standard_error):
            return "not resolved: too few steps, run longer"
        return f"not resolved: {bar}, run about {_round(self.required_seconds)} s"


@dataclass(frozen=True)
class StepCheck:
    """What ``check_time_step`` found. ``print`` shows it as a table.

    Attributes
    ----------
    step : float
        h in ps.
    scheme : str
    steps : tuple of float
        h, h/2 and, of three, h/4.
    paired : bool
        Whether the runs followed one Brownian path.
    observables : list of ObservableCheck
    divided : tuple of float
        Shares of steps of filaments that had to be divided, by run.
    failure : str or None
        Why a run ended, if one blew up.
    frames : int
        Of ten steps h each.
    seconds : float
        Time that it took.
    relaxation : float
        Of the slowest bends of the filaments, in ps; zero where nothing bends.
    """

    step: float
    scheme: str
    steps: tuple
    paired: bool
    observables: list
    divided: tuple
    failure: str | None
    frames: int
    seconds: float
    relaxation: float

    @property
    def verdict(self):
        """ "wrong" if anything is wrong, "right" if everything is right, or else "not resolved"."""
        verdicts = [one.verdict for one in self.observables]
        if self.failure is not None or self.divided[0] > LARGEST_DIVIDED_SHARE or "wrong" in verdicts:
            return "wrong"
        return "right" if verdicts and set(verdicts) == {"right"} else "not resolved"

    def __getitem__(self, name):
        """The ObservableCheck of a name."""
        for one in self.observables:
            if one.name == name:
                return one
        raise KeyError(f"{name}; there are {', '.join(one.name for one in self.observables)}")

    def explanation(self):
        """The verdict in a sentence."""
        step = format_time(self.step, 4)
        if self.failure is not None:
            return f"The step of {step} is wrong: {self.failure}"
        wrong = [one for one in self.observables if one.verdict == "wrong"]
        if wrong:
            worst = max(wrong, key=lambda one: abs(one.error))
            others = f", and {len(wrong) - 1} more" if len(wrong) > 1 else ""
            text = f"The step of {step} is wrong: {worst.name}{others}."
            if LARGEST_ERROR < abs(worst.error) < DIVERGED:
                better = format_time(self.step * LARGEST_ERROR / abs(worst.error), 2)
                text += f" A step of {better} should do; check it, too."
            return text
        if self.divided[0] > LARGEST_DIVIDED_SHARE:
            return f"The step of {step} is wrong: {_percent(self.divided[0])} of the steps of filaments were divided."
        if self.verdict == "right":
            return f"The step of {step} is right."
        open_ = [one for one in self.observables if one.verdict != "right"]
        longest = max((one.required_seconds for one in open_), default=math.inf)
        advice = f"check for about {_round(longest)} s" if math.isfinite(longest) else "check for longer"
        return (
            f"Not resolved: {len(open_)} of {len(self.observables)} errors are not known to "
            f"{_percent(LARGEST_ERROR)}; {advice}."
        )

    def __str__(self):
        return format_check(self)

    def as_dict(self):
        """Everything in numbers, texts, lists and dicts, for JSON; None in place of numbers that are not finite."""
        content = asdict(self)
        for entry, one in zip(content["observables"], self.observables):
            entry.update(verdict=one.verdict, explanation=one.explanation())
        content.update(verdict=self.verdict, explanation=self.explanation())
        return _finite(content)


def _finite(content):
    if isinstance(content, dict):
        return {key: _finite(value) for key, value in content.items()}
    if isinstance(content, (list, tuple)):
        return [_finite(value) for value in content]
    if isinstance(content, float) and not math.isfinite(content):
        return None
    return content


def _surely_large(error, standard_error):
    return abs(error) - SIGMAS * standard_error > LARGEST_ERROR or _diverged(error)


def _diverged(error):
    # Written so that NaN has.
    return not abs(error) <= DIVERGED


def _percent(share, sign=""):
    digits = ".2g" if abs(share) < 0.995 else ".0f" if abs(share) < DIVERGED else ".1e"
    return f"{100.0 * share:{sign}{digits}} %"


def _round(seconds):
    return f"{float(f'{seconds:.2g}'):.6g}"


def check_time_step(
    filaments,
    system,
    positions,
    step_size,
    *,
    scheme=None,
    temperature=None,
    particle_friction=None,
    flow=None,
    seconds=20.0,
    frames=None,
    levels=2,
    random_seed=1,
    equilibrium=False,
    platform=None,
    properties=None,
    say=lambda message: None,
    stop=lambda: False,
):
    """Run a System with a step and with half of it, and say whether the step is right.

    Compared are, for each kind of filament, the mean energies of stretching (per segment) and bending (per joint), the
    mean square end-to-end distance (of rings: the distance across), how far the three slowest bending modes and the
    middle of a filament move in ten steps, and the mean energies of tethers and of each other force of the System. The
    first quarter of the runs is left out. See ``step_check`` for errors, their standard errors, the verdicts and what
    the check cannot see.

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
    kT = thermal_energy(bath)
    if kT == 0.0:
        raise InputError("At a temperature of zero there are no averages to compare: check a warmer System.")
    if levels not in _WEIGHTS:
        raise InputError(f"levels must be 2 or 3, but is {levels!r}.")
    random_seed = whole_number(random_seed, 1, "random_seed")
    if frames is None:
        seconds = positive(seconds, DIMENSIONLESS, "seconds")
    else:
        frames = whole_number(frames, 2, "frames")
    settings = {"scheme": scheme, "temperature": temperature, "particle_friction": particle_friction, "flow": flow}
    probe = _Probe(filaments, system, kT)
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
        exact = _Exact(filaments, system, flow, bath, equilibrium, lasting)
        observables = _compare(probe, records, exact, elapsed)
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


def _is_chain_force(force):
    return force.getName().startswith("CylinderChain")


def _other_forces(system):
    return [(index, force) for index, force in enumerate(system.getForces()) if not _is_chain_force(force)]


def _interacting(filaments, system):
    return bool(filaments.tethers) or any(
        not isinstance(force, openmm.CMMotionRemover) for _, force in _other_forces(system)
    )


@dataclass(frozen=True)
class _Kind:
    # Filaments that are equal but for their positions.
    label: str
    filament: object
    nodes: np.ndarray
    joint_stiffnesses: np.ndarray


def _kinds(filaments):
    groups = {}
    for number, one in enumerate(filaments):
        key = (one.type, one.segments, one.closed, one.planar, one.clamped, one.propulsion)
        groups.setdefault(key, []).append(number)
    kinds = []
    for numbers in groups.values():
        first = filaments[numbers[0]]
        label = first.type.name if len(groups) == 1 else f"{first.type.name} x {first.segments}"
        if label in [kind.label for kind in kinds]:
            label += f" (filament {numbers[0]})"
        nodes = np.array([filaments.node_indices[number] for number in numbers])
        kinds.append(_Kind(label, first, nodes, first.joint_stiffnesses))
    return kinds


class _Probe:
    # What is looked at in a Context: names, units, and values of one frame.

    def __init__(self, filaments, system, kT):
        self._kT = kT
        self._filaments = filaments
        self.kinds = _kinds(filaments)
        self._system = system
        self._groups = {}
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

    def grouped_system(self):
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
            for mode in range(1, self._modes(kind) + 1):
                yield f"{kind.label} bending mode {mode}, change", "nm", kind, "mode"
            yield f"{kind.label} middle, displacement", "nm^2", kind, "middle"
        if self._filaments.tethers:
            yield "tethers", "k_B T", None, "tethers"
        for label, _ in self._groups.values():
            yield label, "k_B T", None, "force"

    @staticmethod
    def _modes(kind):
        return 0 if kind.filament.closed else min(_MODES, kind.filament.segments - 1)

    def measure(self, context, before):
        """Values, (filaments,) or (1,) each, of this frame, and what the next one needs of it."""
        positions = context.getState(positions=True).getPositions(asNumpy=True)._value
        values, after = [], []
        with np.errstate(all="ignore"):
            for index, kind in enumerate(self.kinds):
                own, kept = self._measure_kind(kind, positions[kind.nodes], None if before is None else before[index])
                values += own
                after.append(kept)
            if self._filaments.tethers:
                values.append(self._tether_energy(positions))
        for group in self._groups:
            energy = context.getState(energy=True, groups=1 << group).getPotentialEnergy()._value
            values.append(np.array([energy / self._kT]))
        return values, after

    def _measure_kind(self, kind, nodes, before):
        filament, one = kind.filament, kind.filament.type
        closed = filament.closed
        vectors = np.diff(nodes, axis=1, append=nodes[:, :1]) if closed else np.diff(nodes, axis=1)
        lengths = np.linalg.norm(vectors, axis=2)
        tangents = vectors / lengths[..., None]
        if closed:
            cosines = np.einsum("fsk,fsk->fs", np.roll(tangents, 1, axis=1), tangents)
        else:
            cosines = np.einsum("fsk,fsk->fs", tangents[:, :-1], tangents[:, 1:])
        bending = np.zeros(len(nodes))
        if cosines.shape[1] and one.bending_rigidity > 0.0:
            bending = one.bending_energy(cosines, kind.joint_stiffnesses).mean(axis=1) / self._kT
        half = nodes.shape[1] // 2
        ends = nodes[:, half if closed else -1] - nodes[:, 0]
        middle = nodes[:, half]
        modes = np.arange(1, self._modes(kind) + 1)
        waves = np.cos(np.outer(modes, np.pi * (np.arange(filament.segments) + 0.5) / filament.segments))
        scale = math.sqrt(2.0 * one.segment_length / filament.segments)
        amplitudes = scale * np.einsum("ms,fsk->mfk", waves, tangents)
        moved = [amplitudes, middle] if before is None else [amplitudes - before[0], middle - before[1]]
        values = [one.stretching_energy(lengths).mean(axis=1) / self._kT, bending, np.sum(ends**2, axis=1)]
        values += [*np.sum(moved[0] ** 2, axis=2), np.sum(moved[1] ** 2, axis=1)]
        return values, (amplitudes, middle)

    def _tether_energy(self, positions):
        energy = 0.0
        for tether in self._filaments.tethers:
            node = self._filaments.node_indices[tether.filament][tether.node]
            energy += 0.5 * tether.stiffness * np.sum((positions[node] - tether.point) ** 2)
        return np.array([energy / self._kT])


class _Exact:
    # Exact averages of filaments that nothing acts on, and how far others are off.

    def __init__(self, filaments, system, flow, temperature, equilibrium, lasting):
        self._free = not _interacting(filaments, system) and flow is None
        self._temperature, self._kT = temperature, thermal_energy(temperature)
        self._equilibrium, self._lasting = equilibrium, lasting

    def compare(self, kind, what, series):
        """What an ObservableCheck says of the exact average, with the values (frames, copies) with h."""
        exact = self._average(kind, what)
        if exact is None:
            return {name: None for name in ("exact", "deviation", "deviation_standard_error")} | {
                "judged_by_exact": False
            }
        # Time tells little of a few filaments that keep their shape.
        known = self._lasting or series.shape[1] >= _FEWEST_COPIES
        return {
            "exact": float(exact),
            "deviation": float(series.mean() / exact - 1.0),
            "deviation_standard_error": _standard_error(series) / exact if known else math.inf,
            "judged_by_exact": self._equilibrium,
        }

    def _average(self, kind, what):
        if kind is None or not self._free:
            return None
        one = kind.filament
        if one.closed or one.clamped or one.propulsion:
            return None
        arguments = self._temperature, one.planar
        if what == "stretching":
            return stretching_energy_mean(one.type, *arguments) / self._kT
        if what == "bending":
            return bending_energy_mean(one.type, *arguments) / self._kT
        if what == "distance":
            return chain_mean_square_end_to_end(one.type, one.segments, *arguments)
        return None


def _slowest_relaxation(kinds, filaments, temperature):
    # In ps.
    longest = 0.0
    for one in (kind.filament for kind in kinds):
        bounds = implicit_time_step(one.type, filaments.viscosity, temperature, one.segments, one.closed).bounds
        longest = max(longest, bounds.get("relaxation", 0.0))
    return longest


@np.errstate(over="ignore", invalid="ignore")
def _compare(probe, records, exact, seconds):
    late = records[int(_WARM_UP * len(records)) :]
    checks = []
    for row, (name, unit, kind, what) in enumerate(probe.rows):
        # (levels, frames, copies)
        series = np.array([[level[row] for level in frame] for frame in late]).swapaxes(0, 1)
        means = series.mean(axis=(1, 2))
        if not np.any(means):
            # Nothing of the kind: a single segment does not bend, a clamped middle does not move.
            continue
        weights = np.array(_WEIGHTS[len(means)])
        scale, influence = abs(means[-1]), math.copysign(1.0, means[-1])
        if kind is None and scale < 1.0:
            # Energies of forces may have any sign: an error well below k_B T is none.
            scale, influence = 1.0, 0.0
        error = float(weights @ means / scale)
        # How each frame contributes to the ratio.
        linear = np.tensordot(weights, series, 1) - error * influence * series[-1]
        unpaired = [weight * _standard_error(one) for weight, one in zip(weights, series)]
        checks.append(
            ObservableCheck(
                name=name,
                unit=unit,
                values=tuple(float(mean) for mean in means),
                error=error,
                standard_error=_standard_error(linear) / scale,
                unpaired_standard_error=float(np.linalg.norm(unpaired)) / scale,
                seconds=seconds,
                **exact.compare(kind, what, series[0]),
            )
        )
    return checks


def _standard_error(series):
    # Of the mean of (frames, copies): the largest of what blocks of several lengths and copies give.
    frames, copies = series.shape
    if frames < _BLOCKS[-1]:
        return math.inf
    line = series.mean(axis=1)
    errors = []
    for count in _BLOCKS:
        length = frames // count
        if length:
            means = line[frames - count * length :].reshape(count, length).mean(axis=1)
            # Blocks leave out what is left over of the frames.
            errors.append(means.std(ddof=1) / math.sqrt(frames / length))
    if copies >= _FEWEST_COPIES:
        errors.append(series.mean(axis=0).std(ddof=1) / math.sqrt(copies))
    return float(max(errors))


def format_check(check):
    """A StepCheck as a table in ASCII, with its verdict below."""
    times = [format_time(step, 3) for step in check.steps]
    simulated = check.frames * STEPS_PER_FRAME * check.step
    path = "the same Brownian path" if check.paired else "independent paths: the portable engine has no common one"
    lines = [
        f"{' against '.join(times)} on {path}; scheme {check.scheme}",
        f"{format_time(simulated, 3)} simulated in {check.seconds:.3g} s; changes and displacements are those in "
        f"{format_time(STEPS_PER_FRAME * check.step, 3)}; +- one standard error",
        "",
    ]
    if check.observables:
        lines += [*_table(check, times), ""]
    lines += _notes(check, simulated)
    lines.append(check.explanation())
    return "\n".join(lines)


def _table(check, times):
    header = ["average", "", *times, "error of the step", "exact", "off exact", "verdict"]
    rows = [header, *(_table_row(one) for one in check.observables)]
    if all(one.exact is None for one in check.observables):
        rows = [row[:-3] + row[-1:] for row in rows]
    widths = [max(map(len, column)) for column in zip(*rows)]
    left = (0, 1, len(widths) - 1)
    for row in rows:
        cells = [
            text.ljust(width) if column in left else text.rjust(width)
            for column, (text, width) in enumerate(zip(row, widths))
        ]
        yield "  ".join(cells).rstrip()


def _notes(check, simulated):
    if check.divided[0] > 0.0:
        yield f"{_percent(check.divided[0])} of the steps of filaments were divided."
    if check.failure is None and simulated < _RELAXATIONS * check.relaxation:
        yield (
            f"The slowest bends relax in {format_time(check.relaxation, 3)}: what a longer run would show of them is "
            "not seen."
        )
    off = [
        one.name
        for one in check.observables
        if one.exact is not None
        and not one.judged_by_exact
        and _surely_large(one.deviation, one.deviation_standard_error)
    ]
    if off:
        yield (
            f"Off their exact values are {', '.join(off)}: filaments did not begin in equilibrium, or any step of this "
            "scheme is wrong."
        )


def _table_row(one):
    exact = "" if one.exact is None else f"{one.exact:.4g}"
    off = ""
    if one.deviation is not None:
        known = math.isfinite(one.deviation_standard_error)
        error = f" +- {100.0 * one.deviation_standard_error:.1f}" if known else ""
        off = f"{100.0 * one.deviation:+.1f}{error} %"
    return [
        one.name,
        one.unit,
        *(f"{value:.4g}" for value in one.values),
        _percent(one.error, "+")
        if _diverged(one.error)
        else f"{100.0 * one.error:+.2f} +- {100.0 * one.standard_error:.2f} %",
        exact,
        off,
        one.explanation(),
    ]
