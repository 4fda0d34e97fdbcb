"""Pictures and films of runs, drawn without a display by a ray caster of tubes."""

from .pictures import View, write_film, write_picture
from .scene import Look

__all__ = ["Look", "View", "write_film", "write_picture"]
