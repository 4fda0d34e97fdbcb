"""Frames of a DCD file as OpenMM writes it, read one by one without reading the file whole."""

from pathlib import Path

import numpy as np

from ..errors import InputError
from ..units.types import FloatArray

_ANGSTROM = 0.1  # in nm
_HEADER_SIZE = 276


class DCDFrames:
    """The whole frames of a DCD file; one that a killed run has left unfinished does not count.

    InputError if the file is no DCD file of OpenMM. ``particles`` says how many a frame has.
    """

    def __init__(self, path: Path) -> None:
        with open(path, "rb") as file:
            header = file.read(_HEADER_SIZE)
        words = np.frombuffer(header[: len(header) // 4 * 4], dtype="<i4")
        # Three records: numbers, two lines of title, how many particles.
        if len(header) < _HEADER_SIZE or header[4:8] != b"CORD" or words[0] != 84 or words[23] != 164 or words[66] != 4:
            raise InputError(f"{path} is not a DCD trajectory of a run.")
        self.particles = int(words[67])
        fields: list[tuple[str, str] | tuple[str, str, tuple[int]]] = []
        if words[12]:
            fields += [("before_cell", "<i4"), ("cell", "<f8", (6,)), ("after_cell", "<i4")]
        for axis in "xyz":
            fields += [(f"before_{axis}", "<i4"), (axis, "<f4", (self.particles,)), (f"after_{axis}", "<i4")]
        frame = np.dtype(fields)
        count = (path.stat().st_size - _HEADER_SIZE) // frame.itemsize
        self._frames = np.memmap(path, frame, "r", _HEADER_SIZE, (count,)) if count else np.zeros(0, frame)

    def __len__(self) -> int:
        return len(self._frames)

    def size_of(self, frames: int) -> int:
        """How many bytes the file has with its first frames alone."""
        return _HEADER_SIZE + frames * self._frames.itemsize

    def positions(self, frame: int) -> FloatArray:
        """Positions (particles, 3) in nm."""
        record = self._frames[frame]
        return _ANGSTROM * np.stack([record[axis] for axis in "xyz"], axis=1).astype(float)
