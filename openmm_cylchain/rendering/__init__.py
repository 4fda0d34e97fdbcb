"""Pictures and films of runs, drawn without a display by a ray caster of tubes, and their colors."""

import importlib
from typing import TYPE_CHECKING

__all__ = ["Look", "View", "colors_of_filaments", "spring_colors", "write_film", "write_picture"]

if TYPE_CHECKING:
    from ..output.colors import colors_of_filaments, spring_colors
    from .pictures import View, write_film, write_picture
    from .scene import Look
else:
    _MODULES = {"Look": ".scene", "colors_of_filaments": "..output.colors", "spring_colors": "..output.colors"}

    def __getattr__(name: str) -> object:
        # Loaded when they are asked for: the command line looks into this folder whatever it is asked to do.
        if name not in __all__:
            raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
        return getattr(importlib.import_module(_MODULES.get(name, ".pictures"), __name__), name)


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
