"""Exceptions and warnings of the package."""


class InputError(ValueError):
    """Input that cannot be simulated: the message says what is wrong, where, and what to do."""


class InstabilityError(RuntimeError):
    """A simulation that has blown up: the message names the filament, the segment and the step.

    Attributes
    ----------
    filament, segment : int or None
        Which segment of which filament; None where a particle outside filaments is at fault, or it is not known.
    particle : int or None
        Which particle outside filaments.
    step : int or None
        In which step, counting from 1.
    """

    def __init__(self, message="", *, filament=None, segment=None, particle=None, step=None):
        super().__init__(message)
        self.filament = filament
        self.segment = segment
        self.particle = particle
        self.step = step


# The last error of a PythonForce. OpenMM hands on nothing but its text, as that of an OpenMMException.
_raised_in_force: Exception | None = None


def note_raised_in_force(error: Exception) -> None:
    """Keep an error that the computation of a PythonForce is about to raise, for ``is_raised_in_force``."""
    global _raised_in_force
    _raised_in_force = error


def is_raised_in_force(exception: Exception) -> bool:
    """Whether an exception of OpenMM is the error of a PythonForce that was kept last."""
    return _raised_in_force is not None and str(_raised_in_force) in str(exception)


class TimeStepError(InstabilityError):
    """A time step that is far too long for what happens in it: the message says by what it shows and what to do."""


class ContactWarning(UserWarning):
    """Beads that are too far apart or too soft to keep filaments from passing through each other."""


class EquilibrationWarning(UserWarning):
    """A trajectory whose start differs from its end by more than chance: averages over it contain the relaxation."""


class TimeStepWarning(UserWarning):
    """A time step that is too long: above a bound, which the message names, or by what a run shows of it."""
