"""The panels of a figure that show filaments that grow: lengths, and where their ends are, over time."""

import numpy as np

from ..units.text import time_unit
from .figure_style import legend, length_unit
from .growth_summary import ENDS, GrowthTable, free_rate, growing_groups

_SHOWN = 30
"""Of the filaments of a group: so many have a line of their own."""
_SECOND = 1e12
"""In ps."""


def draw_growth(axes, configuration, members, colours, directory):
    """Draw lengths of filaments that grow, and positions of their ends, into two panels.

    ``members`` are the numbers of the filaments of each [[filament]] table, ``colours`` those of the tables.
    """
    table = GrowthTable(directory)
    name, unit_of_time = time_unit(table.times[-1])
    times = table.times / unit_of_time
    of_groups = {id(group): colour for group, colour in zip(configuration.filaments, colours)}
    _draw_lengths(axes[0], times, table, configuration, members, of_groups)
    _draw_ends(axes[1], times, unit_of_time, table, configuration, members, of_groups)
    for axis in axes:
        axis.set_xlim(times[0], times[-1])
        axis.set_xlabel(f"time ({name.replace('us', 'µs')})")
        legend(axis, loc="best")


def _draw_lengths(axis, times, table, configuration, members, colours):
    unit, scale = length_unit(float(table.column("length (nm)").max()))
    for group, numbers, label in growing_groups(configuration, members):
        lengths = table.column("length (nm)", numbers) / scale
        colour = colours[id(group)]
        axis.plot(times, lengths[:, :_SHOWN], color=colour, linewidth=0.7, alpha=0.45)
        axis.plot(times, lengths.mean(axis=1), color=colour, linewidth=2.2, label=f"{label}, mean")
    axis.set_ylim(bottom=0.0)
    axis.set_ylabel(f"length ({unit})")
    axis.set_title("Lengths of filaments that grow")


def _draw_ends(axis, times, unit_of_time, table, configuration, members, colours):
    # By monomers from where they were at the start: that of the plus end upwards, that of the minus end downwards.
    groups = growing_groups(configuration, members)
    places = {}
    for group, numbers, _ in groups:
        moved = {end: table.ends(end, numbers).mean(axis=1) * group.growth.monomers.length for end in ENDS}
        places[id(group)] = {"plus": moved["plus"], "minus": -moved["minus"]}
    unit, scale = length_unit(max(np.abs(own).max() for each in places.values() for own in each.values()))
    for group, numbers, label in groups:
        concentration = table.column("free monomers (uM)", numbers).mean(axis=1)
        for end, line, sign in (("plus", "-", 1.0), ("minus", ":", -1.0)):
            if not group.growth.states(end).grows:
                continue
            axis.plot(
                times, places[id(group)][end] / scale, line, color=colours[id(group)], label=f"{label}, {end} ends"
            )
            rates = np.array([free_rate(group.growth, end, own) for own in concentration])
            free = np.concatenate([[0.0], np.cumsum(0.5 * (rates[1:] + rates[:-1]) * np.diff(times))])
            free *= sign * group.growth.monomers.length * unit_of_time / _SECOND / scale
            axis.plot(times, free, "--", color="0.4", linewidth=1.2, zorder=1)
    axis.plot([], [], "--", color="0.4", linewidth=1.2, label="free ends at that concentration")
    axis.set_ylabel(f"from where they were ({unit})")
    axis.set_title("Ends of filaments that grow, on average")
