"""Files that are written as a whole, and paths that can be written to."""

import os
from pathlib import Path
from typing import TextIO, TypeAlias

from ..errors import InputError
from ..units.quantities import shown

TextFile: TypeAlias = str | Path | TextIO
"""A file to write text to: its path, or a file that is open."""


def write_atomically(path: Path, data: bytes) -> None:
    """Replace a file as a whole: after a kill it holds either the old or the new content."""
    temporary = path.with_name(path.name + ".new")
    with open(temporary, "wb") as file:
        file.write(data)
        file.flush()
        os.fsync(file.fileno())
    os.replace(temporary, path)
    _sync_directory(path.parent)


def _sync_directory(path):
    if os.name == "posix":
        descriptor = os.open(path, os.O_RDONLY)
        try:
            os.fsync(descriptor)
        finally:
            os.close(descriptor)


def as_path(path: str | Path, name: str) -> Path:
    """The path of a file or directory; InputError if it is none."""
    if not isinstance(path, (str, os.PathLike)) or not os.fspath(path) or "\0" in str(path):
        raise InputError(f"{name} must be a path, but is {shown(path)}.")
    return Path(path)


def check_output_path(path: str | Path) -> None:
    """Raise InputError if a file cannot be written there, before hours are spent on its content."""
    path = as_path(path, "file")
    if path.is_dir() or not path.parent.is_dir():
        what = "is a directory" if path.is_dir() else f"is in {path.parent}, which is not a directory"
        raise InputError(f"{path} {what}: give the path of a file.")


def check_path(path: str | Path, ending: str) -> Path:
    """The path of a file that can be written, with the ending of its format; InputError if it is not."""
    check_output_path(path)
    if Path(path).suffix != ending:
        raise InputError(f"The file must end in {ending}, but is {path}.")
    return Path(path)
