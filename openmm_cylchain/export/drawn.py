"""What exports have in common: the thickness of linkers and crosslinks."""

import numpy as np

from ..analysis.run_filaments import RunParticles
from ..analysis.runs import Run
from ..rendering.outlines import wall_lines
from ..units.types import FloatArray


def thickness(run: Run) -> float:
    """The diameter in nm of the thinnest filament, of which linkers are drawn; without filaments, of a particle."""
    return min(own.diameter for own in run.filaments or [one for one in run.particles if one.diameter])


def visible_diameter(run: Run, own: RunParticles) -> float:
    """The diameter in nm of particles; where it is not known, twice that of the thinnest filament."""
    return own.diameter or 2.0 * thickness(run)


def walls(run: Run) -> list[FloatArray]:
    """Lines (n, 3) in nm on the walls of a run, as far as something is beside them at its ends."""
    return wall_lines(run, np.concatenate([run.points(frame) for frame in (0, -1)]))


def spring_labels(run: Run) -> list[str]:
    """Names of kinds of springs, with their number if there are several of one name."""
    names = run.spring_names
    return [name if names.count(name) == 1 else f"{name} {kind + 1}" for kind, name in enumerate(names)]
