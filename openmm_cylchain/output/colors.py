"""Colors of pictures and figures, which the color-blind can tell apart.

Those of filaments are of Okabe and Ito; motors and crosslinkers differ from each other in hue and in lightness.
"""

from collections.abc import Sequence

PLUS_END, PLUS_END_COLOR = "last node (plus end)", "#101010"
"""What legends call the mark at the end to which motors walk, and its color."""

FILAMENT_COLORS = ("#0072B2", "#009E73", "#56B4E9", "#6B6B6B")
_MOTOR_COLORS = ("#B3261E", "#CC79A7", "#6A3D9A")
_CROSSLINKER_COLORS = ("#F2B200", "#8C6D31", "#C9C400")


def colors_of_filaments(count: int) -> list[str]:
    """Colors of kinds of filaments, "#RRGGBB": those that are known best, or, of more kinds, of a scale of colors."""
    if count <= len(FILAMENT_COLORS):
        return list(FILAMENT_COLORS[:count])
    from matplotlib import colormaps
    from matplotlib.colors import to_hex

    return [to_hex(colormaps["viridis"](0.9 * number / (count - 1))) for number in range(count)]


def spring_colors(motors: Sequence[bool]) -> list[str]:
    """Colors of kinds of linkers that are motors or not: the first motor has one color in every run."""
    colors, counts = [], [0, 0]
    for motor in motors:
        own = _MOTOR_COLORS if motor else _CROSSLINKER_COLORS
        colors.append(own[counts[motor] % len(own)])
        counts[motor] += 1
    return colors
