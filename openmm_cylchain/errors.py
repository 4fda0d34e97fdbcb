"""Exceptions and warnings of the package."""


class InputError(ValueError):
    """Input that cannot be simulated: the message says what is wrong, where, and what to do."""


class InstabilityError(RuntimeError):
    """A simulation that has blown up: the message names the filament, the segment and the step.

    Attributes
    ----------
    filament, segment : int or None
        Which segment of which filament; None where a particle outside filaments is at fault, or it is not known.
    other_filament, other_segment : int or None
        What the segment would pass through, or is linked with, in an implicit step that cannot be solved.
    particle : int or None
        Which particle outside filaments.
    link : int or None
        The number of a crosslink that is at fault.
    step : int or None
        In which step, counting from 1.
    """

    def __init__(
        self,
        message="",
        *,
        filament=None,
        segment=None,
        particle=None,
        step=None,
        link=None,
        other_filament=None,
        other_segment=None,
    ):
        super().__init__(message)
        self.filament = filament
        self.segment = segment
        self.particle = particle
        self.step = step
        self.link = link
        self.other_filament = other_filament
        self.other_segment = other_segment

    @property
    def place(self) -> dict[str, int | None]:
        """The attributes by their names, for an error with another text."""
        return dict(vars(self))


# Where the last error of a PythonForce was. OpenMM hands on the text alone, as that of an OpenMMException.
_raised_in_force: dict[str, int | None] | None = None


def note_raised_in_force(error: Exception | None) -> None:
    """Keep what a PythonForce is about to raise, for ``instability_in_force``; None before a step."""
    global _raised_in_force
    _raised_in_force = None if error is None else error.place if isinstance(error, InstabilityError) else {}


def instability_in_force(exception: Exception, advice: str = "") -> InstabilityError | None:
    """The InstabilityError behind an exception of a step, with advice, or None if no PythonForce has raised it."""
    return None if _raised_in_force is None else InstabilityError(f"{exception}{advice}", **_raised_in_force)


class TimeStepError(InstabilityError):
    """A time step that is far too long for what happens in it: the message says by what it shows and what to do."""


class BoxWarning(UserWarning):
    """Forces on filaments that do not take nearest images, though the System is periodic."""


class ContactWarning(UserWarning):
    """Beads too far apart, or contacts too soft, to keep filaments apart; contacts that a step takes for hard ones."""


class EngineWarning(UserWarning):
    """The compiled engine is installed, but does not work: the portable one, much slower, is taken in its place."""


class JointWarning(UserWarning):
    """Joints so stiff that bends beside them are wrong in long steps: the message says which, and what to do."""


class LinkerWarning(UserWarning):
    """Linkers that do not do what their numbers suggest, such as hands whose springs keep them from binding."""


class EquilibrationWarning(UserWarning):
    """A trajectory whose start differs from its end by more than chance: averages over it contain the relaxation."""


class PrecisionWarning(UserWarning):
    """Positions of a trajectory whose single precision is coarser than what is computed from them."""


class SegmentLengthWarning(UserWarning):
    """Segments that are too long for the force that pulls them: the message says by how much the force is off."""


class StageWarning(UserWarning):
    """A stage of a run that does not do all that it says, such as planes that leave filaments whole."""


class TimeStepWarning(UserWarning):
    """A time step that is too long: above a bound, which the message names, or by what a run shows of it."""


class TwistWarning(UserWarning):
    """A torque that winds a filament up without end, or turns that one has lost: the message says which, and what to
    do."""
