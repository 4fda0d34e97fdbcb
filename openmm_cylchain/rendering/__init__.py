"""Pictures and films of runs, drawn without a display by a ray caster of tubes, and their colors."""

from ..output.colors import colors_of_filaments, spring_colors
from .pictures import View, write_film, write_picture
from .scene import Look

__all__ = ["Look", "View", "colors_of_filaments", "spring_colors", "write_film", "write_picture"]
