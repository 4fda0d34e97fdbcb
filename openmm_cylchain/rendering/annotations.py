"""What is written on a picture: a legend or a scale of colors, a scale bar and a clock."""

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from ..filaments.presets import DSDNA, F_ACTIN, MICROTUBULE
from ..units.text import time_unit
from ..units.types import FloatArray
from .camera import Camera
from .scene import Scene

_FULL_NAMES = {F_ACTIN.name: "actin", DSDNA.name: "DNA", MICROTUBULE.name: "microtubules"}
_INK = "#222222"


@dataclass(frozen=True)
class Margins:
    """What a picture leaves free on its left and right for what is written there, in pixels."""

    left: int
    right: int


def annotated(image: FloatArray, camera: Camera, scene: Scene, clock: str) -> FloatArray:
    """An image with its annotations, (height, width, 3) as whole numbers from 0 to 255.

    The image without its margins, which the camera sees, is sRGB between 0 and 1; ``clock`` is a ``clock_text``.
    """
    height, width = image.shape[:2]
    figure, canvas, text = _figure((width, height))
    _draw_legend(figure, scene, text)
    _draw_color_scale(figure, scene, text)
    _draw_scale_bar(figure, camera, text)
    figure.text(0.975, 0.97, clock, ha="right", va="top", fontsize=1.1 * text, color=_INK)
    canvas.draw()
    drawn = np.asarray(canvas.buffer_rgba()).astype(float) / 255.0
    opacity = drawn[..., 3:]
    # Agg blends onto its own background, so that colors are those of full opacity.
    result = drawn[..., :3] * opacity + image * (1.0 - opacity)
    return np.round(255.0 * np.clip(result, 0.0, 1.0)).astype(np.uint8)


def clock_text(time: float, times: FloatArray) -> str:
    """The time of a picture, such as "2.00 s", in a unit and with decimals that suit all times of its film, in ps.

    The last one has three digits, or as many as part it from the others.
    """
    last = float(np.max(times))
    if last <= 0.0:
        return "0"
    name, length = time_unit(last)
    spacings = np.diff(np.unique(times))
    digits = max(0, 2 - math.floor(math.log10(last / length)))
    if len(spacings):
        # A spacing of 1 ms less rounding needs no more digits than 1 ms.
        digits = max(digits, min(6, math.ceil(-math.log10(1.001 * float(spacings.min()) / length))))
    return f"{time / length:.{digits}f} {name.replace('us', 'µs')}"


def margins(scene: Scene, cameras: Callable[[Margins], Iterable[Camera]], size: tuple[int, int]) -> Margins:
    """Those that a picture needs so that nothing is written over what it shows; ``size`` is (width, height) in pixels.

    With margins, ``cameras`` makes those of all pictures of a film, whose pixels begin behind the left margin.
    """
    width, height = size
    figure, canvas, text = _figure(size)
    right = 0
    if scene.scale is not None:
        right = width - math.floor(_draw_color_scale(figure, scene, text).get_tightbbox(canvas.get_renderer()).x0)
    legend = _draw_legend(figure, scene, text)
    bare = Margins(0, min(right, width // 3))
    if legend is None:
        return bare
    corner = legend.get_window_extent(canvas.get_renderer())
    for camera in cameras(bare):
        across, up = camera.places(scene.points).T
        if np.any((across < corner.x1 - 0.5 * camera.width) & (up > corner.y0 - 0.5 * height)):
            return Margins(min(math.ceil(corner.x1), width // 3), bare.right)
    return bare


def _figure(size):
    width, height = size
    figure = Figure(figsize=(width / 100, height / 100), dpi=100)
    figure.patch.set_alpha(0.0)
    return figure, FigureCanvasAgg(figure), 0.165 * np.sqrt(width * height) / 10.0


def _draw_legend(figure, scene, text):
    handles = []
    for label, color, kind in scene.legend:
        if kind == "filament":
            name, comma, load = label.partition(", ")
            label = _FULL_NAMES.get(name, name) + comma + load
            handles.append(Line2D([], [], color=color, linewidth=0.45 * text, solid_capstyle="round", label=label))
        elif kind == "particle":
            marker = dict(marker="o", markersize=0.8 * text, linestyle="none")
            handles.append(Line2D([], [], color=color, label=label, **marker))
        else:
            handles.append(
                Line2D([], [], color=color, linewidth=0.15 * text, marker="o", markersize=0.55 * text, label=label)
            )
    if not handles:
        return None
    return figure.legend(
        handles=handles,
        loc="upper left",
        bbox_to_anchor=(0.01, 0.985),
        fontsize=text,
        frameon=False,
        labelcolor=_INK,
        handlelength=1.6,
    )


def _draw_color_scale(figure, scene, text):
    if scene.scale is None:
        return None
    axis = figure.add_axes((0.955, 0.3, 0.014, 0.4))
    shown = ScalarMappable(Normalize(scene.scale.lowest, scene.scale.highest), scene.scale.map)
    bar = figure.colorbar(shown, cax=axis)
    axis.yaxis.set_ticks_position("left")
    axis.yaxis.set_label_position("left")
    bar.set_label(scene.scale.label, fontsize=text, color=_INK)
    bar.outline.set_visible(False)
    axis.tick_params(labelsize=0.9 * text, colors=_INK, length=0.25 * text)
    return axis


def scale_bar_length(camera: Camera) -> float:
    """A round length in nm of at most a quarter of the picture's width in the plane through its center."""
    longest = 0.25 * camera.width / camera.scale
    decade = 10.0 ** np.floor(np.log10(longest))
    return float(max(step * decade for step in (1, 2, 5) if step * decade <= longest))


def _draw_scale_bar(figure, camera, text):
    length = scale_bar_length(camera)
    name, unit = next((name, unit) for name, unit in (("mm", 1e6), ("µm", 1e3), ("nm", 0.0)) if length >= unit)
    part = length * camera.scale / (100.0 * figure.get_figwidth())
    figure.add_artist(
        Line2D([0.025, 0.025 + part], [0.035, 0.035], color=_INK, linewidth=0.3 * text, solid_capstyle="butt")
    )
    label = f"{length / (unit or 1.0):g} {name}"
    figure.text(0.025 + 0.5 * part, 0.05, label, ha="center", va="bottom", fontsize=text, color=_INK)
