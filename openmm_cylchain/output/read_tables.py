"""Reading of the tables of a run, as far as their lines are whole."""

import csv
from pathlib import Path

import numpy as np

from ..errors import InputError
from ..units.types import FloatArray
from .run_tables import check_columns


def read_table(path: Path) -> dict[str, FloatArray]:
    """The columns of a table by their headers: a dict of (lines,) arrays; InputError if it is empty or damaged, or that
    of a run with other columns."""
    # A kill may leave a part of the last line.
    with open(path, newline="") as file:
        lines = [line for line in file if line.endswith("\n")]
    if not lines:
        raise InputError(f"{path} is empty.")
    check_columns(path, lines[0].rstrip("\r\n"))
    names = next(csv.reader(lines[:1]))
    try:
        values = np.array([[float(cell) for cell in line.split(",")] for line in lines[1:]])
        return dict(zip(names, values.reshape(len(lines) - 1, len(names)).T))
    except ValueError:
        raise InputError(f"{path} is damaged: its lines do not fit {lines[0].strip()!r}.") from None


def read_reports(path: Path, lines: int | None = None) -> dict[str, FloatArray]:
    """The columns of a table that has several lines for each report, whole ones: a dict of (reports, lines) arrays.

    Reports have as many lines as the first one if that is not given.
    """
    table = read_table(path)
    steps = table["step"]
    each = lines or max(1, int(np.count_nonzero(steps == steps[:1])))
    whole = len(steps) // each
    return {name: values[: whole * each].reshape(whole, each) for name, values in table.items()}
