"""Reading of the tables of a run, as far as their lines are whole."""

import csv
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import InputError
from .run_tables import GROWTH_TABLE_COLUMNS, TEXT_COLUMNS, check_columns


def read_table(path: Path, columns: Sequence[str] | None = None) -> dict[str, Any]:
    """The columns of a table by their headers: a dict of (lines,) arrays, of texts for TEXT_COLUMNS; InputError if it
    is empty or damaged, or has other columns than those that are given, or than a run writes into a file of this
    name."""
    # A kill may leave a part of the last line.
    with open(path, newline="") as file:
        lines = [line for line in file if line.endswith("\n")]
    if not lines:
        raise InputError(f"{path} is empty.")
    check_columns(path, lines[0].rstrip("\r\n"), columns)
    names = next(csv.reader(lines[:1]))
    try:
        cells = [line.rstrip("\r\n").split(",") for line in lines[1:]]
        columns_of_cells = zip(*cells, strict=True) if cells else [()] * len(names)
        pairs = zip(names, columns_of_cells, strict=True)
        return {name: np.array(own, dtype=str if name in TEXT_COLUMNS else float) for name, own in pairs}
    except ValueError:
        raise InputError(f"{path} is damaged: its lines do not fit {lines[0].strip()!r}.") from None


def read_reports(path: Path, lines: int | None = None) -> dict[str, Any]:
    """The columns of a table that has several lines for each report, whole ones: a dict of (reports, lines) arrays.

    Reports have as many lines as the first one if that is not given.
    """
    table = read_table(path)
    steps = table["step"]
    each = lines or max(1, int(np.count_nonzero(steps == steps[:1])))
    whole = len(steps) // each
    return {name: values[: whole * each].reshape(whole, each) for name, values in table.items()}


def read_growth(path: str | Path) -> dict[str, Any]:
    """Read how far filaments have grown: ``growth.csv`` of a run, or the file of a ``GrowthReporter``.

    Of reports with the same step, which a script writes that goes on from an older checkpoint, the last one holds. A
    report that is not whole is left out.

    Parameters
    ----------
    path : str or Path

    Returns
    -------
    dict of (reports, filaments that grow) arrays
        By the headers of the file, see ``GrowthReporter``; of texts for the names of states.

    Raises
    ------
    InputError
        If the file does not exist, is empty or damaged, or has other columns.
    """
    path = Path(path)
    if not path.is_file():
        raise InputError(f"There is no file {path}.")
    table = read_table(path, GROWTH_TABLE_COLUMNS)
    filaments = np.unique(table["filament"])
    last: dict[float, dict[float, int]] = {}
    for line, (step, filament) in enumerate(zip(table["step"].tolist(), table["filament"].tolist())):
        last.setdefault(step, {})[filament] = line
    whole = [last[step] for step in sorted(last) if len(last[step]) == len(filaments)]
    lines = np.array([[report[filament] for filament in filaments] for report in whole], dtype=int)
    return {name: values[lines.reshape(len(whole), len(filaments))] for name, values in table.items()}
