"""What the check of a step found: averages, their errors and the verdicts."""

import math
from dataclasses import asdict, dataclass
from typing import Any, cast

from ..time_steps.step_watch import LARGEST_DIVIDED_SHARE
from ..units.text import format_time
from .step_check_rule import DIVERGED, LARGEST_ERROR, diverged, sigmas, surely_large
from .step_check_text import format_check, percent, two_digits


@dataclass(frozen=True)
class ObservableCheck:
    """One average with the step h and with shorter ones.

    Attributes
    ----------
    name, unit : str
    values : tuple of float
        With the step, and with that of the reference.
    error : float
        Of the average with the step, relative to the reference, extrapolated.
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
    degrees : float
        Degrees of freedom of the standard errors.
    """

    name: str
    unit: str
    values: tuple[float, ...]
    error: float
    standard_error: float
    unpaired_standard_error: float
    exact: float | None
    deviation: float | None
    deviation_standard_error: float | None
    judged_by_exact: bool
    seconds: float
    degrees: float = math.inf

    @property
    def error_bar(self) -> float:
        """Half of the range in which the true error is, but for 6 in 100 000: four standard errors that are known."""
        return sigmas(self.degrees) * self.standard_error

    @property
    def verdict(self) -> str:
        """ "right", "wrong" or "not resolved", see ``step_check``."""
        if surely_large(self.error, self.error_bar) or self.off_exact:
            return "wrong"
        right = abs(self.error) <= LARGEST_ERROR and self.error_bar <= LARGEST_ERROR
        return "right" if right else "not resolved"

    @property
    def off_exact(self) -> bool:
        """Whether the average with h differs from the exact one by more than 5 % for sure."""
        if not self.judged_by_exact:
            return False
        deviation, standard_error = cast(float, self.deviation), cast(float, self.deviation_standard_error)
        return surely_large(deviation, sigmas(self.degrees) * standard_error)

    @property
    def required_seconds(self) -> float:
        """About how long a check takes that resolves this error; infinite if nothing is known."""
        room = LARGEST_ERROR
        if abs(self.error) > LARGEST_ERROR:
            room = min(room, max(abs(self.error) - LARGEST_ERROR, 0.2 * LARGEST_ERROR))
        return self.seconds * max(1.0, (self.error_bar / room) ** 2)

    def explanation(self) -> str:
        """The verdict in words."""
        if diverged(self.error):
            return "wrong: it grows without bound"
        if surely_large(self.error, self.error_bar):
            return f"wrong by {percent(self.error)} +- {percent(self.standard_error)}"
        if self.off_exact:
            return f"wrong: {percent(cast(float, self.deviation), '+')} off the exact value"
        if self.verdict == "right":
            return f"right within {percent(abs(self.error) + self.error_bar)}"
        bar = f"error bar {percent(self.error_bar)}"
        if not math.isfinite(self.standard_error):
            return "not resolved: too few steps, run longer"
        return f"not resolved: {bar}, run about {two_digits(self.required_seconds)} s"


@dataclass(frozen=True)
class StepCheck:
    """What ``check_time_step`` found. ``print`` shows it as a table.

    Attributes
    ----------
    step : float
        h in ps.
    scheme : str
    steps : tuple of float
        h, and that of the reference.
    paired : bool
        Whether the runs followed one Brownian path.
    observables : list of ObservableCheck
    divided : tuple of float
        Shares of steps of filaments that had to be divided, by run.
    failure : str or None
        Why a run ended, if one blew up.
    windows, frames : int
        In how many windows of time the runs were compared, and of how many frames of ten steps h these are.
    seconds : float
        Time that it took.
    relaxation : float
        Of the slowest bends of the filaments, in ps; zero where nothing bends.
    strained : tuple of str
        Forces whose energies at the start were far above what they became: what grows from there was not looked at.
    """

    step: float
    scheme: str
    steps: tuple[float, ...]
    paired: bool
    observables: list[ObservableCheck]
    divided: tuple[float, ...]
    failure: str | None
    windows: int
    frames: int
    seconds: float
    relaxation: float
    strained: tuple[str, ...] = ()

    @property
    def verdict(self) -> str:
        """ "wrong" if anything is wrong, "right" if everything is right, or else "not resolved"."""
        verdicts = [one.verdict for one in self.observables]
        if self.failure is not None or self.divided[0] > LARGEST_DIVIDED_SHARE or "wrong" in verdicts:
            return "wrong"
        return "right" if verdicts and set(verdicts) == {"right"} else "not resolved"

    def __getitem__(self, name: str) -> ObservableCheck:
        """The ObservableCheck of a name."""
        for one in self.observables:
            if one.name == name:
                return one
        raise KeyError(f"{name}; there are {', '.join(one.name for one in self.observables)}")

    def explanation(self) -> str:
        """The verdict in a sentence."""
        step = format_time(self.step, 4)
        if self.failure is not None:
            return f"The step of {step} is wrong: {self.failure}"
        wrong = [one for one in self.observables if one.verdict == "wrong"]
        if wrong:
            # NaN comes first.
            worst = max(wrong, key=lambda one: abs(one.error) if one.error == one.error else math.inf)
            others = f", and {len(wrong) - 1} more" if len(wrong) > 1 else ""
            text = f"The step of {step} is wrong: {worst.name}{others}."
            if LARGEST_ERROR < abs(worst.error) < DIVERGED:
                better = format_time(self.step * LARGEST_ERROR / abs(worst.error), 2)
                text += f" A step of {better} should do; check it, too."
            return text
        if self.divided[0] > LARGEST_DIVIDED_SHARE:
            return f"The step of {step} is wrong: {percent(self.divided[0])} of the steps of filaments were divided."
        if self.verdict == "right":
            return f"The step of {step} is right."
        open_ = [one for one in self.observables if one.verdict != "right"]
        longest = max((one.required_seconds for one in open_), default=math.inf)
        advice = f"check for about {two_digits(longest)} s" if math.isfinite(longest) else "check for longer"
        return (
            f"Not resolved: {len(open_)} of {len(self.observables)} errors are not known to "
            f"{percent(LARGEST_ERROR)}; {advice}."
        )

    def __str__(self) -> str:
        return format_check(self)

    def as_dict(self) -> dict[str, Any]:
        """Everything in numbers, texts, lists and dicts, for JSON; None in place of numbers that are not finite."""
        content = asdict(self)
        for entry, one in zip(content["observables"], self.observables):
            entry.update(error_bar=one.error_bar, verdict=one.verdict, explanation=one.explanation())
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
