"""What panels of the figure of a run have in common."""

FONT_SIZE = 11


def legend(axis, **options):
    """The legend of a panel."""
    axis.legend(fontsize=FONT_SIZE - 1, framealpha=0.85, edgecolor="none", **options)


def legend_below(axis):
    """The legend where there are too many lines to leave room for it."""
    legend(axis, loc="upper center", bbox_to_anchor=(0.5, -0.15), ncols=2)


def length_unit(length):
    """The unit in which people write a length in nm, and what it is in nm."""
    return ("µm", 1e3) if length >= 1e3 else ("nm", 1.0)
