"""What linkers do at a report: numbers and tensions of each type, and where each one is, in a file that grows."""

import os
from pathlib import Path
from typing import Any, Protocol

import numpy as np
import openmm
from numpy.lib import format as npy

from ..errors import InputError

LINKER_COLUMNS = (
    "unbound",
    "one_hand_bound",
    "both_hands_bound",
    "mean_tension",
    "maximum_tension",
    "bindings",
    "unbindings",
)
"""Of a type of linkers; tensions in kJ/(mol nm), NaN where no linker pulls."""

LINKER_RECORD = np.dtype(
    [
        ("step", "<i8"),
        ("number", "<i8"),
        ("type", "<i4"),
        ("anchor", "<i4"),
        ("filaments", "<i4", (2,)),
        ("arc_lengths", "<f8", (2,)),
        ("places", "<f4", (2, 3)),
        ("tension", "<f8"),
    ]
)
"""Of a linker with a hand that is bound: as in LinkerTable; places in nm, tension in kJ/(mol nm), both NaN if none."""


class LinkedFilaments(Protocol):
    """What is seen of a Filaments object, whose docstrings say what is what."""

    @property
    def linkers(self) -> tuple[Any, ...]: ...

    def linkers_in(self, context: openmm.Context) -> Any: ...

    def linker_places(self, context: openmm.Context) -> Any: ...

    def linker_events(self, context: openmm.Context) -> tuple[int, int]: ...


def measure_linkers(
    filaments: LinkedFilaments, context: openmm.Context, step: int
) -> tuple[list[tuple[float, ...]], np.ndarray]:
    """Rows of LINKER_COLUMNS, one for each type, and an array of LINKER_RECORD of linkers with a hand that is bound."""
    table, places = filaments.linkers_in(context), filaments.linker_places(context)._value
    lengths = np.linalg.norm(places[:, 1] - places[:, 0], axis=1)
    kinds = [own.kind for own in filaments.linkers]
    stiffness, rest = np.array([(kind.stiffness, kind.rest_length) for kind in kinds])[table.types].T
    tensions = stiffness * (lengths - rest)
    events = filaments.linker_events(context)
    rows = []
    for number in range(len(kinds)):
        pulling = tensions[(table.types == number) & ~np.isnan(tensions)]
        mean, largest = (pulling.mean(), pulling.max()) if len(pulling) else (np.nan, np.nan)
        rows.append((*table.counts(number), float(mean), float(largest), *events))
    bound = table.bound.any(axis=1)
    records = np.zeros(int(bound.sum()), dtype=LINKER_RECORD)
    records["step"] = step
    for name, values in (
        ("number", table.numbers),
        ("type", table.types),
        ("anchor", table.anchors),
        ("filaments", table.filaments),
        ("arc_lengths", table.arc_lengths),
        ("places", places),
        ("tension", tensions),
    ):
        records[name] = values[bound]
    return rows, records


class LinkerFile:
    """A NumPy file (``.npy``) of LINKER_RECORD that is written report by report and can be continued.

    ``numpy.load(path)`` reads it at any time, with ``mmap_mode="r"`` without reading it whole. Its header says how many
    records there are; what a kill has left behind them does not count.

    Parameters
    ----------
    path : Path
    count : int, optional
        How many records to keep of a file that exists, all if -1; a new file if not given.

    Raises
    ------
    InputError
        If the file to continue is not there, has another content or fewer records.
    """

    def __init__(self, path: Path, count: int | None = None) -> None:
        if count is not None and not path.exists():
            raise InputError(f"{path} is missing: it cannot be continued.")
        self._file = open(path, "w+b" if count is None else "r+b")  # noqa: SIM115 - closed with this
        self.count = 0
        if count is not None:
            written = self._read_count(path)
            if count > written:
                self._file.close()
                raise InputError(f"{path} has {written} records, but had {count}: it cannot be continued.")
            self.count = written if count < 0 else count
        self._write_header()
        self._file.truncate(self._file.tell() + self.count * LINKER_RECORD.itemsize)
        self._file.seek(0, os.SEEK_END)

    def _read_count(self, path):
        count, dtype = 0, None
        try:
            if npy.read_magic(self._file) == (1, 0):
                (count,), _, dtype = npy.read_array_header_1_0(self._file)
        except ValueError:
            pass
        if dtype != LINKER_RECORD or self._file.tell() != _HEADER_SIZE:
            self._file.close()
            raise InputError(f"{path} is not a file of places of linkers: it cannot be continued.")
        return count

    def _write_header(self):
        self._file.seek(0)
        self._file.write(_header(self.count))

    def write(self, records: np.ndarray) -> None:
        """Append records; the header knows of them when they are in the file."""
        self._file.write(records.tobytes())
        self._file.flush()
        self.count += len(records)
        self._write_header()
        self._file.flush()
        self._file.seek(0, os.SEEK_END)

    def synchronise(self) -> int:
        """Bring everything to disk and return how many records there are."""
        self._file.flush()
        os.fsync(self._file.fileno())
        return self.count

    def close(self) -> None:
        """Close the file."""
        self._file.close()


_HEADER_SIZE = 512


def _header(count):
    # Of one size for any count: version 1.0 of the format.
    start = npy.magic(1, 0)
    text = repr({"descr": npy.dtype_to_descr(LINKER_RECORD), "fortran_order": False, "shape": (count,)})
    size = _HEADER_SIZE - len(start) - 2
    return start + size.to_bytes(2, "little") + text.encode().ljust(size - 1) + b"\n"
