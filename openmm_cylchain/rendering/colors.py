"""Colors of what is in pictures of runs."""

from ..analysis.runs import Run
from ..output.colors import colors_of_filaments, spring_colors

# Of linkers where colors of filaments are numbers.
_GREYS = ("#333333", "#8A8A8A", "#5E5E5E", "#B0B0B0")

# Of particles beside filaments, which are many.
_PARTICLES = ("#B9BDC6", "#D8B98A", "#9C8FB5", "#A9C4A0")

WALL_COLOR = "#9EA3AD"


def filament_colors(run: Run) -> dict[str, str]:
    """Colors "#RRGGBB" of the filaments of a run, by their labels: types, and loads if these differ."""
    labels = dict.fromkeys(own.label for own in run.filaments)
    return dict(zip(labels, colors_of_filaments(len(labels))))


def particle_colors(run: Run) -> dict[str, str]:
    """Colors "#RRGGBB" of the particles of a run beside its filaments, by their names."""
    names = dict.fromkeys(own.name for own in run.particles)
    return {name: _PARTICLES[number % len(_PARTICLES)] for number, name in enumerate(names)}


def linker_colors(run: Run, grey: bool = False) -> list[str]:
    """Colors "#RRGGBB" of the kinds in ``run.spring_names``."""
    kinds = len(run.spring_names)
    if grey:
        return [_GREYS[kind % len(_GREYS)] for kind in range(kinds)]
    # Crosslinks come last.
    motors = [own.motor for own in run.linker_types]
    return spring_colors([*motors, False][:kinds])
