"""The first steps of what is written: where they have no solution at the time step of Cytosim, in shorter ones."""

import contextlib
import io
import time
import warnings

from ..errors import InputError, InstabilityError
from .document import LEFT_OUT, NEAREST, Note, number_in, quantity

_STEPS, _MOST_SECONDS = 100, 10.0
_PARTS = (2, 5, 10, 20, 50, 100)


def try_first_steps(document, configuration, configuration_of):
    """Divide the time steps of a Document until its run takes its first steps, and say so where that was needed.

    Parameters
    ----------
    document : Document
    configuration : Configuration
        Of what it says.
    configuration_of : callable ()
        That of what it says after a change.
    """
    trouble = _trouble(configuration)
    if trouble is None:
        return
    tables = [own for own in document.tables if own.header in ("[simulation]", "[stage.simulation]")]
    whole = [(table, list(table.entries)) for table in tables]
    for parts in _PARTS:
        for table, entries in whole:
            table.entries = [_divided(entry, parts) for entry in entries]
        if _trouble(configuration_of()) is None:
            return
    for table, entries in whole:
        table.entries = entries
    text = f"a start from which steps can be taken, however short: {trouble}"
    document.note(LEFT_OUT, text, None, "starts from which steps can be taken")


def _divided(entry, parts):
    key, value, _ = entry
    if key != "time_step":
        return entry
    note = Note(NEAREST, f"{value} in Cytosim, in which the first steps have no solution here")
    return key, quantity(number_in(value) / parts, "s"), note


def _trouble(configuration):
    # Why a run does not take its first steps, in a sentence; None if it does, or if they take too long to know.
    from ..runs.created_simulation import create_simulation
    from ..runs.dry_run import take_first_steps
    from ..runs.relaxation import relaxed_positions
    from ..runs.stages import stages_of

    start = time.process_time()

    def stop(_):
        if time.process_time() - start > _MOST_SECONDS:
            raise _TooLongError

    try:
        with contextlib.redirect_stderr(io.StringIO()), warnings.catch_warnings():
            # The run itself warns.
            warnings.simplefilter("ignore")
            stages = stages_of(configuration)
            simulation, built = create_simulation(stages[0].configuration)
            simulation.context.setPositions(relaxed_positions(stages[0].configuration, built, stop))
            for _ in take_first_steps(stages, (simulation, built), _STEPS, _MOST_SECONDS):
                pass
    except (InputError, InstabilityError) as error:
        return str(error)
    except _TooLongError:
        pass
    return None


class _TooLongError(Exception):
    pass
