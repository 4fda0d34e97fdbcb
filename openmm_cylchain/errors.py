"""Exceptions and warnings of the package."""


class InputError(ValueError):
    """Input that cannot be simulated: the message says what is wrong, where, and what to do."""


class InstabilityError(RuntimeError):
    """A simulation that has blown up: the message names the filament, the segment and the step."""


class ContactWarning(UserWarning):
    """Beads that are too far apart or too soft to keep filaments from passing through each other."""


class EquilibrationWarning(UserWarning):
    """A trajectory whose start differs from its end by more than chance: averages over it contain the relaxation."""


class TimeStepWarning(UserWarning):
    """A time step above a stability bound: the message names the bound."""
