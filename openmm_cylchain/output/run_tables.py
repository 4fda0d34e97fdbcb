"""The files of a run that grow while it goes on, and can be continued: its trajectory and its tables."""

import math
import os
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from ..errors import InputError
from ..units.quantities import PICONEWTON
from ..units.types import FloatArray
from .dcd_frames import DCDFrames

if TYPE_CHECKING:
    from openmm import app

_DCD_HEADER_SIZE, _DCD_DATE, _DCD_TITLE_LINE = 92, 180, 80
MILLISECOND = 1e9
"""In ps."""


def _open_at(path, size):
    # Open for appending at a length that the file had at a checkpoint, and forget what was written since.
    if not path.exists() or path.stat().st_size < size:
        raise InputError(
            f"{path} is missing or shorter than at the checkpoint: the run cannot be resumed. Start it again in "
            "another directory."
        )
    file = open(path, "r+b")
    file.truncate(size)
    return file


def size_of_lines(path: Path, step: int) -> tuple[int, int]:
    """The size of a ReportTable up to a step, and the number of its whole lines until then, but for the header."""
    with open(path, "rb") as file:
        header = file.readline()
        check_columns(path, header.decode(errors="replace").rstrip("\r\n"))
        size, count = len(header), 0
        for line in file:
            if not line.endswith(b"\n") or int(line.partition(b",")[0]) > step:
                break
            size, count = size + len(line), count + 1
    return size, count


def start_of_trajectory(path: Path, frames: int) -> tuple[int, bytes]:
    """The size and the header of a trajectory with its first frames alone; InputError if it has fewer."""
    there = DCDFrames(path)
    if len(there) < frames:
        raise InputError(f"{path} has {len(there)} frames, but there are energies of {frames}: it is damaged.")
    with open(path, "rb") as file:
        header = bytearray(file.read(_DCD_HEADER_SIZE))
    first, interval = (int.from_bytes(header[place : place + 4], "little") for place in (12, 16))
    for place, value in ((8, frames), (20, first + max(frames - 1, 0) * interval)):
        header[place : place + 4] = value.to_bytes(4, "little")
    return there.size_of(frames), bytes(header)


class TrajectoryFile:
    """A DCD file that is written frame by frame and can be continued.

    ``time_step`` is in ps. Where the file is continued, ``size`` is that of the file there, and ``header`` what it has
    at that size.
    """

    def __init__(
        self,
        path: Path,
        topology: "app.Topology",
        time_step: float,
        steps_per_frame: int,
        size: int | None = None,
        header: bytes = b"",
    ) -> None:
        from openmm import app

        if size is None:
            self._file = open(path, "w+b")
        else:
            self._file = _open_at(path, size)
            # The number of frames stands in the header, which may be ahead of the checkpoint.
            self._file.write(header)
        self._dcd = app.DCDFile(self._file, topology, time_step, 0, steps_per_frame, append=size is not None)
        if size is None:
            # Not when it was made: files of the same run are the same.
            self._file.seek(_DCD_DATE)
            self._file.write(b"openmm-cylchain".ljust(_DCD_TITLE_LINE, b"\0"))
            self._file.seek(0, os.SEEK_END)

    def write(self, positions: FloatArray) -> None:
        """Append a frame of (particles, 3) positions in nm."""
        self._dcd.writeModel(positions)

    def synchronise(self) -> tuple[int, bytes]:
        """Bring everything to disk and return the size and the header of the file."""
        self._file.flush()
        os.fsync(self._file.fileno())
        self._file.seek(0)
        header = self._file.read(_DCD_HEADER_SIZE)
        return self._file.seek(0, os.SEEK_END), header

    def close(self) -> None:
        """Close the file."""
        self._file.close()


ENERGY_COLUMNS = (
    "step",
    "time (ms)",
    "stretching energy (pN nm)",
    "bending energy (pN nm)",
    "potential energy (pN nm)",
    "stretching energy per segment (kT)",
    "bending energy per joint (kT)",
    "mean end-to-end distance (nm)",
)


LINKER_TABLE_COLUMNS = (
    "step",
    "time (ms)",
    "linkers",
    "unbound",
    "one hand bound",
    "both hands bound",
    "mean tension (pN)",
    "maximum tension (pN)",
    "bindings",
    "unbindings",
)
"""A line per report and [[linkers]] table, which are counted from 0."""


PULLING_TABLE_COLUMNS = (
    "step",
    "time (ms)",
    "tether",
    "filament",
    "point x (nm)",
    "point y (nm)",
    "point z (nm)",
    "force along the velocity (pN)",
    "extension along the velocity (nm)",
)
"""A line per report and moving tether; the extension is that of the end-to-end vector that points to the tether."""


TWIST_COLUMNS = ("step", "time (ms)", "filament", "twist (turns)", "torque (pN nm)")
"""A line per report and filament with end frames: the sum of its twists, and the mean torque of its joints."""


_OF_END = ("gained (monomers)", "lost (monomers)", "waited", "state", "shrinking", "catastrophes", "rescues")

POPULATION_COLUMNS = ("filaments nucleated", "filaments vanished", "filaments severed", "without place")
"""How many have, of all that grow, since the start."""

GROWTH_TABLE_COLUMNS = (
    "step",
    "time (ms)",
    "filament",
    "length (nm)",
    "nodes",
    "minus end (monomers)",
    "plus end (monomers)",
    *(f"{end} end {event}" for end in ("minus", "plus") for event in _OF_END),
    "free monomers (uM)",
    "identity",
    "parent",
    *POPULATION_COLUMNS,
)
"""A line per report and place of a filament that grows, without nodes while there is none; ends are where they are
since it began, in monomers along the filament, and have waited so often because there was no spare node."""

TEXT_COLUMNS = "minus end state", "plus end state"
"""Columns of names; others are of numbers."""


_MEAN_FORCE_COLUMNS = (
    "mean over (ms)",
    "load (pN)",
    "force x (pN)",
    "force y (pN)",
    "force z (pN)",
)

WALL_FORCE_COLUMNS = ("step", "time (ms)", "wall", "face", *_MEAN_FORCE_COLUMNS)
"""A line per report and face of a wall: its force on what it keeps in, and the sum of the sizes of its forces."""

CONTACT_FORCE_COLUMNS = ("step", "time (ms)", "filament", *_MEAN_FORCE_COLUMNS)
"""A line per report and filament: the force of all contacts on it, and the sum of the sizes of their forces."""


TABLE_COLUMNS = {
    "energies.csv": ENERGY_COLUMNS,
    "linkers.csv": LINKER_TABLE_COLUMNS,
    "pulling.csv": PULLING_TABLE_COLUMNS,
    "twist.csv": TWIST_COLUMNS,
    "growth.csv": GROWTH_TABLE_COLUMNS,
    "wall_forces.csv": WALL_FORCE_COLUMNS,
    "contact_forces.csv": CONTACT_FORCE_COLUMNS,
}
"""Columns by the names of files."""

_SIZES = {
    "ms": MILLISECOND,
    "nm": 1.0,
    "pN": PICONEWTON,
    "pN nm": PICONEWTON,
    "kT": 1.0,
    "uM": 1e-6,
    "turns": 2.0 * math.pi,
}
# In OpenMM's units; but energies in kT and concentrations in mol/l come as such.


def check_columns(path: Path, header: str, columns: Sequence[str] | None = None) -> None:
    """Raise InputError if a table has other columns, or other units, than it is written with.

    These are ``columns``, or if not given those of a table of a run by the name of its file.
    """
    expected = ",".join(TABLE_COLUMNS.get(path.name, (header,)) if columns is None else columns)
    if header != expected:
        raise InputError(
            f"{path} was written by another version of openmm_cylchain: its columns are {header!r}, but now "
            f"{expected!r}. Take that version, or run it again in another directory."
        )


def in_units_of_columns(columns: Sequence[str], values: Sequence[float | str]) -> tuple[float | str, ...]:
    """Numbers in OpenMM's units (NaN where one has no meaning) in the units that the names of their columns say.

    Energies in kT, concentrations in mol/l and texts come as such.
    """
    units = (name.partition("(")[2].rstrip(")") for name in columns)
    pairs = zip(values, units, strict=True)
    return tuple(
        value if isinstance(value, (int, str)) else float(value) / _SIZES.get(unit, 1.0) for value, unit in pairs
    )


def line_of_table(step: int, cells: Sequence[float | str]) -> str:
    """A line of a table: a step, numbers to the last digit, and texts without commas."""
    return ",".join(cell if isinstance(cell, str) else repr(cell) for cell in (step, *cells))


class ReportTable:
    """A table of comma-separated values that is continued where the file has a given size; a new file if not given.

    Its columns are those of TABLE_COLUMNS.
    """

    def __init__(self, path: Path, size: int | None = None) -> None:
        self._columns = TABLE_COLUMNS[path.name]
        if size is None:
            self._file = open(path, "w+b")
            self._file.write((",".join(self._columns) + "\n").encode())
        else:
            self._file = _open_at(path, size)
            self._file.seek(0)
            check_columns(path, self._file.readline().decode(errors="replace").rstrip("\r\n"))
            self._file.seek(0, os.SEEK_END)

    def write(self, step: int, values: Sequence[float | str]) -> None:
        """Append a line: the step and a value for each further column, as ``in_units_of_columns`` takes them."""
        cells = in_units_of_columns(self._columns[1:], values)
        self._file.write(line_of_table(step, cells).encode() + b"\n")
        self._file.flush()

    def synchronise(self) -> int:
        """Bring everything to disk and return the size of the file."""
        self._file.flush()
        os.fsync(self._file.fileno())
        return self._file.tell()

    def close(self) -> None:
        """Close the file."""
        self._file.close()
