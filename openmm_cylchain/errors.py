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


class TimeStepError(InstabilityError):
    """A time step that is far too long for what happens in it: the message says by what it shows and what to do."""


class ContactWarning(UserWarning):
    """Beads that are too far apart or too soft to keep filaments from passing through each other."""


class EquilibrationWarning(UserWarning):
    """A trajectory whose start differs from its end by more than chance: averages over it contain the relaxation."""


class TimeStepWarning(UserWarning):
    """A time step that is too long: above a bound, which the message names, or by what a run shows of it."""
