"""Colors of filaments and linkers: those of Okabe and Ito, which the color-blind can tell apart."""

from ..analysis.runs import Run

_FILAMENTS = ("#0072B2", "#009E73", "#56B4E9", "#6B6B6B")
_LINKERS = ("#E69F00", "#D55E00", "#CC79A7", "#F0E442")
# Of linkers where colors of filaments are numbers.
_GREYS = ("#333333", "#8A8A8A", "#5E5E5E", "#B0B0B0")


WALL_COLOR = "#9EA3AD"


def filament_colors(run: Run) -> dict[str, str]:
    """Colors "#RRGGBB" of the types of filaments of a run, by their names."""
    names = dict.fromkeys(own.type.name for own in run.filaments)
    return {name: _FILAMENTS[number % len(_FILAMENTS)] for number, name in enumerate(names)}


def linker_color(kind: int, grey: bool = False) -> str:
    """The color "#RRGGBB" of a kind of linkers, or of crosslinks."""
    colors = _GREYS if grey else _LINKERS
    return colors[kind % len(colors)]
