"""How figures are drawn."""

PAPER, THEORY, OURS = "#D55E00", "black", "#0072B2"
COLOURS = ("#0072B2", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#D55E00", "#000000")
SIZE = (6.4, 4.6)
DOTS_PER_INCH = 150
_FONT_SIZE = 10


def finish(axis, xlabel, ylabel, legend=True, **settings):
    """Label an axis, set its scales and limits, and add a legend, ours first."""
    axis.set(**settings)
    axis.set_xlabel(xlabel, fontsize=_FONT_SIZE)
    axis.set_ylabel(ylabel, fontsize=_FONT_SIZE)
    axis.tick_params(labelsize=_FONT_SIZE - 1, which="both", direction="in", top=True, right=True)
    if legend:
        entries = zip(*axis.get_legend_handles_labels())
        handles, labels = zip(*sorted(entries, key=lambda entry: not entry[1].startswith("ours")))
        axis.legend(handles, labels, fontsize=_FONT_SIZE - 2, framealpha=0.9, edgecolor="none")
