"""The first steps of what is written: where they have no solution at the time step of Cytosim, in shorter ones.

Where even these have none, without contacts: those of Cytosim let filaments through each other.
"""

import contextlib
import io
import time
import warnings

from openmm import OpenMMException

from ..errors import InputError, InstabilityError
from .document import LEFT_OUT, NEAREST, Note, number_in, quantity

_STEPS, _OF_STAGE, _MOST_SECONDS = 10_000, 100, 6.0
"""Of a run at most, of each stage before it is said to be slow, and seconds of these at most."""
_SHOWN = 5
_NEEDS = "starts from which steps can be taken"
_PARTS = (2, 5, 10, 20, 50, 100)


def try_first_steps(document, configuration, configuration_of):
    """Divide the time steps of a Document until its run takes its first steps, and say so where that was needed.

    As what follows may need shorter ones by chance, the next shorter one is taken after the longest that will do.
    Contacts are turned off where that is of no help. Steps are too long, too, where so many of the few that there is
    time for are divided that a run would be stopped; if shorter ones are as well, they stay as they are.

    Parameters
    ----------
    document : Document
    configuration : Configuration
        Of what it says.
    configuration_of : callable ()
        That of what it says after a change.

    Returns
    -------
    str or None
        That they could not all be tried.
    """
    trouble, untried = _trouble(configuration)
    if trouble is None:
        return untried
    tables = [own for own in document.tables if own.header in ("[simulation]", "[stage.simulation]")]
    whole = [(table, list(table.entries)) for table in tables]
    will_do = False
    for parts in _PARTS:
        for table, entries in whole:
            table.entries = [_divided(entry, parts) for entry in entries]
        still, unknown = _trouble(configuration_of())
        if still is None and (will_do or unknown or parts == _PARTS[-1]):
            return unknown
        will_do = still is None
    for table, entries in whole:
        table.entries = entries
    if untried is not None:
        return untried
    touching = [own for own in document.tables if own.header in ("[contacts]", "[stage.contacts]")]
    whole = [(table, list(table.entries)) for table in touching]
    for table in touching:
        text = f"contacts, with which the first steps have no solution, however short: {trouble}"
        table.entries = [entry for entry in table.entries if entry[0] != "active"]
        table.add("active", False, Note(LEFT_OUT, text, None, _NEEDS))
    if touching:
        still, unknown = _trouble(configuration_of())
        if still is None:
            return unknown
    for table, entries in whole:
        table.entries = entries
    document.note(LEFT_OUT, f"a start from which steps can be taken, however short: {trouble}", None, _NEEDS)
    return None


def _divided(entry, parts):
    key, value, _ = entry
    if key != "time_step":
        return entry
    note = Note(NEAREST, f"{value} in Cytosim, in which the first steps have no solution here")
    return key, quantity(number_in(value) / parts, "s"), note


def _trouble(configuration):
    # Why a run does not take its first steps, or None; and what there was no time to know, or None: sentences. Steps
    # that are slow and divided have both.
    from ..runs.created_simulation import create_simulation
    from ..runs.dry_run import STEPS_OF_STAGE, take_first_steps
    from ..runs.relaxation import relaxed_positions
    from ..runs.stages import stages_of
    from ..time_steps.step_watch import INTOLERABLE_DIVIDED_SHARE

    start, longest, slow, divided = time.process_time(), 2.0 * _MOST_SECONDS, [], 0.0

    def stop():
        if time.process_time() - start > longest:
            raise _TooLongError

    try:
        with contextlib.redirect_stderr(io.StringIO()), warnings.catch_warnings():
            # The run itself warns.
            warnings.simplefilter("ignore")
            stages = stages_of(configuration)
            first = stages[0].configuration
            simulation, built = create_simulation(first)
            positions = relaxed_positions(first, built, lambda _: None, stop)
            # What comes in later stages meets what has hardly moved in a dry run.
            counts = [max(_OF_STAGE, _STEPS // len(stages)), *([STEPS_OF_STAGE] if len(stages) > 1 else [])]
            for count in counts:
                simulation.context.reinitialize()
                simulation.context.setPositions(positions)
                for stage, taken, share in take_first_steps(stages, (simulation, built), count, _MOST_SECONDS, stop):
                    if taken is not None and taken < min(_OF_STAGE, count, stage.configuration.simulation.steps):
                        slow.append(stage.name or "the run")
                        divided = max(divided, share)
    except (InputError, InstabilityError, OpenMMException) as error:
        return str(error), None
    except _TooLongError:
        return None, f"Its filaments overlap, and do not come apart within {longest:g} s: it may not run."
    if slow:
        names = ", ".join(list(dict.fromkeys(slow))[:_SHOWN])
        trouble = f"{100 * divided:.2g} % of them are divided." if divided > INTOLERABLE_DIVIDED_SHARE else None
        return trouble, f"Not all of the first steps were tried, since they are slow: {names}."
    return None, None


class _TooLongError(Exception):
    pass
