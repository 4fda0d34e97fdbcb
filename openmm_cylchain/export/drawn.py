"""What exports have in common: paths, the thickness of linkers, and where they are."""

from pathlib import Path

import numpy as np

from ..analysis.runs import Run
from ..errors import InputError
from ..output.files import check_output_path
from ..units.types import FloatArray


def check_path(path: str | Path, ending: str) -> Path:
    """The path of a file that can be written, with the ending of its format; InputError if it is not."""
    if Path(path).suffix != ending:
        raise InputError(f"The file must end in {ending}, but is {path}.")
    check_output_path(path)
    return Path(path)


def thickness(run: Run) -> float:
    """The diameter in nm of the thinnest filament, of which linkers are drawn."""
    return min(own.diameter for own in run.filaments)


def linker_lines(run: Run, frame: int, kind: int) -> tuple[FloatArray, FloatArray]:
    """Linkers of a kind in a frame: lines (n, 2, 3) of those that join two places, and places (m, 3) of bound hands."""
    records = run.linkers[frame]
    places = np.asarray(records["places"][records["type"] == kind], dtype=float)
    there = ~np.isnan(places).any(axis=2)
    return places[there.all(axis=1)], places[there]
