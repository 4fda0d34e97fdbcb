"""A figure of the errors against the step, for the documentation."""

from pathlib import Path

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from openmm_cylchain.errors import InputError
from openmm_cylchain.output.files import check_output_path
from openmm_cylchain.time_steps.schemes import CYLINDER_SCHEMES

from .time_step import CRITERIA

_COLORS = {
    "euler": "tab:red",
    "midpoint": "tab:orange",
    "implicit": "tab:blue",
    "implicit-second-order": "tab:purple",
}
_MICROSECOND = 1e6
_LIMITS = (0.05, 200.0)
_FORMATS = (".png", ".svg", ".pdf")


def check_figure_path(path):
    """Raise InputError if a figure cannot be written there."""
    check_output_path(path)
    if Path(path).suffix not in _FORMATS:
        raise InputError(f"{path} must end in one of {', '.join(_FORMATS)}, which chooses the format of the figure.")


def write_figure(results, path):
    """Draw the largest errors of equilibrium and dynamics of every system against the step.

    Parameters
    ----------
    results : list of SystemErrors
    path : str or Path
        Its suffix chooses the format.
    """
    columns = min(3, len(results))
    rows = -(-len(results) // columns)
    figure = Figure(figsize=(1.0 + 3.6 * columns, 1.4 + 2.7 * rows), layout="constrained")
    FigureCanvasAgg(figure)
    panels = figure.subplots(rows, columns, squeeze=False, sharey=True).ravel()
    for panel, result in zip(panels, results):
        _draw(panel, result)
    for panel in panels[len(results) :]:
        panel.set_axis_off()
    for row in range(rows):
        panels[row * columns].set_ylabel("largest error (%)")
    figure.legend(*panels[0].get_legend_handles_labels(), fontsize="small", loc="outside lower center", ncols=columns)
    figure.savefig(Path(path), dpi=150)


def _draw(panel, result):
    equilibrium, dynamics = CRITERIA[""]
    for scheme in CYLINDER_SCHEMES:
        steps = [one for one in result.of_scheme(scheme) if np.isfinite(one.largest_equilibrium_error)]
        errors = [(one.step, one.largest_equilibrium_error) for one in steps]
        _draw_errors(panel, errors, "o-", color=_COLORS[scheme], label=f"{scheme}, equilibrium")
        errors = [(one.step, one.largest_dynamic_error) for one in steps if one.dynamics]
        _draw_errors(panel, errors, "x--", color=_COLORS[scheme], label=f"{scheme}, dynamics", linewidth=0.8)
    panel.axhline(100 * equilibrium, color="gray", linewidth=0.8)
    panel.axhline(100 * dynamics, color="gray", linewidth=0.8, linestyle="--")
    panel.axvline(result.recommended / _MICROSECOND, color="tab:green", linewidth=0.8, label="recommended (implicit)")
    panel.set(xscale="log", yscale="log", ylim=_LIMITS, xlabel="step (µs)")
    panel.set_title(result.system.label, fontsize="small")


def _draw_errors(panel, errors, style, **properties):
    steps, values = np.array(errors).reshape(-1, 2).T
    panel.plot(steps / _MICROSECOND, 100 * values, style, markersize=4, **properties)
