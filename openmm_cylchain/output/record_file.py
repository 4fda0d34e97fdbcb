"""Records of one kind in a NumPy file that grows while a run goes on."""

import os
from pathlib import Path
from typing import Any

import numpy as np
from numpy.lib import format as npy

from ..errors import InputError


class RecordFile:
    """A NumPy file (``.npy``) of records of one kind that is written report by report and can be continued.

    ``numpy.load(path)`` reads it at any time, with ``mmap_mode="r"`` without reading it whole. Its header says how many
    records there are; what a kill has left behind them does not count.

    Parameters
    ----------
    dtype : numpy.dtype
        Of a record.
    content : str
        What the records are, for messages.
    count : int, optional
        How many records to keep of a file that exists, all if -1; a new file if not given.

    Raises
    ------
    InputError
        If the file to continue is not there, has another content or fewer records, or has been cut off.
    """

    def __init__(self, path: Path, dtype: np.dtype[Any], content: str, count: int | None = None) -> None:
        self._dtype, self._content = dtype, content
        if count is not None and not path.exists():
            raise InputError(f"{path} is missing: it cannot be continued.")
        self._file = open(path, "w+b" if count is None else "r+b")  # noqa: SIM115 - closed with this
        self.count = 0
        if count is not None:
            written = self._read_count(path)
            needed = written if count < 0 else count
            there = min(written, (path.stat().st_size - _HEADER_SIZE) // dtype.itemsize)
            if there < needed:
                self._file.close()
                raise InputError(f"{path} has {there} whole records, but had {needed}: it cannot be continued.")
            self.count = needed
        self._write_header()
        self._file.truncate(self._file.tell() + self.count * dtype.itemsize)
        self._file.seek(0, os.SEEK_END)

    def _read_count(self, path):
        count, dtype = 0, None
        try:
            if npy.read_magic(self._file) == (1, 0):
                (count,), _, dtype = npy.read_array_header_1_0(self._file)
        except ValueError:
            pass
        if dtype != self._dtype or self._file.tell() != _HEADER_SIZE:
            self._file.close()
            raise InputError(f"{path} is not a file of {self._content}: it cannot be continued.")
        return count

    def _write_header(self):
        self._file.seek(0)
        self._file.write(_header(self._dtype, self.count))

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


def read_records(path: Path) -> np.ndarray:
    """The records of a RecordFile, or of one that is being written; InputError if it is missing or has been cut off."""
    try:
        records: np.ndarray = np.load(path, mmap_mode="r")
    except FileNotFoundError:
        raise InputError(f"{path} is missing.") from None
    except (ValueError, EOFError):
        raise InputError(f"{path} is damaged: it does not have all records that it should have.") from None
    return records


def _header(dtype, count):
    # Of one size for any count: version 1.0 of the format.
    start = npy.magic(1, 0)
    text = repr({"descr": npy.dtype_to_descr(dtype), "fortran_order": False, "shape": (count,)})
    size = _HEADER_SIZE - len(start) - 2
    return start + size.to_bytes(2, "little") + text.encode().ljust(size - 1) + b"\n"
