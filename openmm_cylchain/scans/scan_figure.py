"""The figure of a scan: each quantity against the first key that varies, with error bars over replicas."""

import io
import math

from matplotlib import rc_context
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from ..output.files import write_atomically
from .grid import written

_COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#56B4E9", "#E69F00", "#000000")
_MARKERS = "osD^v<>"
_COLUMNS = 3
_FONT_SIZE = 11


def write_scan_figure(path, scan, results):
    """Draw results, rows of ``results.csv``, as PNG: a panel for each quantity, a curve for each point of all keys but
    the first."""
    # Titles and names are of users: "$" is no mathematics in them.
    with rc_context({"text.parse_math": False}):
        image = _draw(scan, results)
    write_atomically(path, image)


def _draw(scan, results):
    panels = list(dict.fromkeys((row["of"], row["quantity"], row["unit"]) for row in results))
    columns = min(_COLUMNS, len(panels))
    rows = math.ceil(len(panels) / columns)
    figure = Figure(figsize=(4.6 * columns + 0.6, 3.7 * rows + 0.9), layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.subplots(rows, columns, squeeze=False)
    if scan.title:
        figure.suptitle(scan.title, fontsize=_FONT_SIZE + 2)
    for axis, panel in zip(axes.flat, panels):
        own = [row for row in results if (row["of"], row["quantity"], row["unit"]) == panel]
        _draw_panel(axis, scan, own)
        of, quantity, unit = panel
        axis.set_title(of, fontsize=_FONT_SIZE)
        unit = unit.replace("^2", "²").replace("^3", "³")
        axis.set_ylabel(f"{quantity}{f' ({unit})' if unit else ''}".replace(", ", ",\n"), fontsize=_FONT_SIZE - 1)
        axis.tick_params(labelsize=_FONT_SIZE - 1)
    for axis in axes.flat[len(panels) :]:
        axis.set_axis_off()
    handles = {}
    for axis in axes.flat[: len(panels)]:
        handles.update({label: handle for handle, label in zip(*axis.get_legend_handles_labels())})
    figure.legend(
        handles.values(),
        handles.keys(),
        loc="outside lower center",
        # About as many as the width has room for.
        ncols=max(1, min(len(handles), int(12.0 * figure.get_figwidth() / (6 + max(map(len, handles)))))),
        fontsize=_FONT_SIZE - 1,
    )
    image = io.BytesIO()
    figure.savefig(image, format="png", dpi=130)
    return image.getvalue()


def _draw_panel(axis, scan, rows):
    places = _places(axis, scan)
    others = [own.label for own in scan.axes[1:]]
    curves = {}
    for row in rows:
        curves.setdefault(tuple(row[label] for label in others), []).append(row)
    for number, (point, own) in enumerate(curves.items()):
        colour = _COLOURS[number % len(_COLOURS)]
        x = [places[row[scan.axes[0].label]] if scan.axes else 0.0 for row in own]
        label = ", ".join(f"{name} = {value}" for name, value in zip(others, point)) or "mean over replicas"
        axis.errorbar(
            x,
            [row["mean"] for row in own],
            [row["standard error"] or 0.0 for row in own],
            fmt=_MARKERS[number % len(_MARKERS)],
            color=colour,
            capsize=3,
            markersize=5,
            label=label,
        )
        theory = sorted((place, row["theory"]) for place, row in zip(x, own) if row["theory"] is not None)
        if theory:
            style = "--" if len(theory) > 1 else "_"
            axis.plot(*zip(*theory), style, color=colour, markersize=18, linewidth=1.3, label=f"theory{_of(label)}")
    if len({row[scan.axes[0].label] for row in rows} if scan.axes else {0}) == 1:
        axis.set_xscale("linear")
    axis.margins(x=0.12)
    axis.ticklabel_format(axis="y", useOffset=False)


def _of(label):
    return "" if label == "mean over replicas" else f", {label}"


def _places(axis, scan):
    # Of the values of the first key on the axis x: where they are, or next to each other if they are no numbers.
    if not scan.axes:
        axis.set_xticks([])
        return {}
    first = scan.axes[0]
    texts = [written(value) for value in first.values]
    if first.numbers is None:
        axis.set_xticks(range(len(texts)), texts)
        axis.set_xlabel(first.label, fontsize=_FONT_SIZE - 1)
        return {text: float(place) for place, text in enumerate(texts)}
    numbers, unit = first.numbers
    axis.set_xlabel(f"{first.label}{f' ({unit})' if unit else ''}", fontsize=_FONT_SIZE - 1)
    if min(numbers) > 0.0 and max(numbers) >= 50.0 * min(numbers):
        axis.set_xscale("log")
    return dict(zip(texts, numbers))
