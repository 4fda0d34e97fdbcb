"""Linkers that would bind and unbind far more often in a step than can be followed are refused before the first one."""

import math

from ..errors import InputError
from ..kinetics.first_places import contour_of
from ..units.text import format_time

_MOST_OF_HAND, _MOST_OUT_OF_CONCENTRATION = 1e5, 1e7
"""In a step: how often a hand may bind and unbind, and how many linkers of a type may come out of a concentration."""


def refuse_countless_events(configuration, filaments):
    """Raise InputError where linkers of a configuration do more in a step of the run than can be followed."""
    step = configuration.simulation.time_step
    for number, own in enumerate(configuration.linkers, 1):
        changes = step * max(min(hand.binding_rate, hand.unbinding_rate + hand.catch_rate) for hand in own.kind.hands)
        arrivals = step * (own.concentration or 0.0) * sum(_volume_rate(hand, filaments) for hand in own.kind.hands)
        for count, most, what in (
            (changes, _MOST_OF_HAND, "a hand would bind and unbind"),
            (arrivals, _MOST_OUT_OF_CONCENTRATION, "linkers would come out of their concentration"),
        ):
            if count > 2.0 * most:
                raise InputError(
                    f"[[linkers]] number {number}: {what} about {count:.2g} times in a time_step of "
                    f"{format_time(step)}, where {most:.0e} at most can be followed: make the step smaller, or look "
                    "at the rates and the concentration."
                )


def _volume_rate(hand, filaments):
    # At which linkers bind, over their concentration: for each length of filament, those within reach.
    length = sum(contour_of(filament)[-1] for filament in filaments if hand.binds(filament.type))
    return length * hand.rate_per_length * 4.0 / 3.0 * math.pi * hand.reach**3
