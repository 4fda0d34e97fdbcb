"""The panels of a figure that show filaments that grow: lengths, and where their ends are or how many there are."""

import numpy as np

from ..units.text import time_unit
from .figure_style import legend, length_unit
from .growth_summary import ENDS, GrowthTable, free_of_kind, free_rate, growing_groups, populations

_SHOWN = 30
"""Of the filaments of a group: so many have a line of their own."""
_SECOND = 1e12
"""In ps."""


def draw_growth(axes, configuration, members, colours, directory):
    """Draw lengths of filaments that grow, and positions of their ends, into two panels.

    Where filaments come and go, their numbers are in place of positions of ends, which begin anywhere.
    ``members`` are the numbers of the filaments of each [[filament]] table, ``colours`` those of the tables.
    """
    table = GrowthTable(directory)
    name, unit_of_time = time_unit(table.times[-1])
    times = table.times / unit_of_time
    of_groups = {id(group): colour for group, colour in zip(configuration.filaments, colours)}
    come_and_go = list(populations(configuration, members))
    of_kinds = [(groups[0], numbers, name) for groups, numbers, name in come_and_go]
    growths = {id(group.growth) for group, *_ in of_kinds}
    others = [own for own in growing_groups(configuration, members) if id(own[0].growth) not in growths]
    _draw_lengths(axes[0], times, table, [*of_kinds, *others], of_groups)
    if come_and_go:
        _draw_free_lengths(axes[0], table, configuration, come_and_go, of_groups)
        _draw_numbers(axes[1], times, table, configuration, come_and_go, of_groups)
    else:
        _draw_ends(axes[1], times, unit_of_time, table, configuration, members, of_groups)
    for axis in axes:
        axis.set_xlim(times[0], times[-1])
        axis.set_xlabel(f"time ({name.replace('us', 'µs')})")
        # Below lines that begin anywhere.
        where = {"loc": "upper center", "bbox_to_anchor": (0.5, -0.15)} if come_and_go else {"loc": "best"}
        legend(axis, **where)


def _draw_lengths(axis, times, table, kinds, colours):
    unit, scale = length_unit(float(table.column("length (nm)").max()))
    for group, numbers, label in kinds:
        there = table.there(numbers)
        lengths = np.where(there, table.column("length (nm)", numbers), np.nan) / scale
        colour = colours[id(group)]
        axis.plot(times, lengths[:, :_SHOWN], color=colour, linewidth=0.7, alpha=0.45)
        means = np.full(len(times), np.nan)
        means[there.any(axis=1)] = np.nanmean(lengths[there.any(axis=1)], axis=1)
        axis.plot(times, means, color=colour, linewidth=2.2, label=f"{label}, mean")
    axis.set_ylim(bottom=0.0)
    axis.set_ylabel(f"length ({unit})")
    axis.set_title("Lengths of filaments that grow")


def _draw_free_lengths(axis, table, configuration, kinds, colours):
    # Those of free filaments in the long run, which are known where their number is.
    _, scale = length_unit(float(table.column("length (nm)").max()))
    for groups, numbers, _ in kinds:
        free = free_of_kind(configuration, table, groups, numbers)
        if free is not None:
            axis.axhline(
                free.length / scale,
                linestyle="--",
                color=colours[id(groups[0])],
                linewidth=1.2,
                zorder=1,
                label="free ones in the long run",
            )


def _draw_numbers(axis, times, table, configuration, kinds, colours):
    for groups, numbers, name in kinds:
        colour = colours[id(groups[0])]
        axis.plot(times, table.there(numbers).sum(axis=1), color=colour, linewidth=1.8, label=name)
        free = free_of_kind(configuration, table, groups, numbers)
        if free is not None:
            axis.axhline(free.number, linestyle="--", color=colour, linewidth=1.2, label="free ones in the long run")
    axis.set_ylim(bottom=0.0)
    axis.set_ylabel("filaments")
    axis.set_title("Filaments that come and go")


def _draw_ends(axis, times, unit_of_time, table, configuration, members, colours):
    # By monomers from where they were at the start: that of the plus end upwards, that of the minus end downwards.
    groups = growing_groups(configuration, members)
    places = {}
    for group, numbers, _ in groups:
        moved = {end: table.gains(end, numbers).mean(axis=1) * group.growth.monomers.length for end in ENDS}
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
